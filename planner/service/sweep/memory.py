"""What the checks of a sweep remember of each other, so that nothing is worked out twice.

A step is not made again where everything it looked at the last time is the same now.  What it looks at is
not declared but watched, so that it cannot be wrong: of a setup by the fields that are read, of an
assessment by those that a rule reads.  The figures are those of a check that remembers nothing, bit by
bit, because they are the same values or were worked out from the same ones.
"""

from __future__ import annotations

from collections import OrderedDict
from enum import Enum
from functools import cached_property
from operator import attrgetter
from threading import local
from types import FunctionType, MethodType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import msgspec

from planner.flight.motion.kinematics import Motion
from planner.flight.pilot import StepPilot, make_pilot
from planner.flight.power import Transients
from planner.flight.prediction import make_flight, steady_power
from planner.flight.reach import situations
from planner.flight.returns.path import Returns
from planner.flight.returns.sample import judged_segments, line_ends, sample_points
from planner.flight.uncertainty import sample_flights, sample_times, tightest_rows
from planner.physics.wind import Wind
from planner.rules.assessment import Assessment
from planner.rules.registry import SUBJECTS, checks_of, is_asked, reported
from planner.service.other_flights import flown_by
from planner.service.preflight import Steps, assess_flown, count_packs, fly
from planner.service.preparation import Preparation, over_its_ground, prepare
from planner.setup import Setup
from planner.values import Value, field_names, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.flight.motion.kinematics import KinematicState
    from planner.flight.pilot import Pilot
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Flight, ItemArrival
    from planner.flight.reach import Situations
    from planner.flight.returns.destination import ReturnTargets
    from planner.flight.returns.path import FlightPoint, FlownReturns, ReturnPoints, StopPlaces
    from planner.flight.returns.tightest import ReturnSweep
    from planner.flight.uncertainty import Scenarios
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.rules.declaration import Check
    from planner.rules.ledger import LedgerEntry
    from planner.selection import Selection
    from planner.service.preflight import CountedPack
    from planner.vehicle.model import ModelSpread
    from planner.vehicle.parameters.resolve import FlightParameters

Made = TypeVar("Made")
_KEPT = 8
"""Results of a step that are remembered: of so many cases before."""
_STATES_KEPT = 32
"""States of a motion that are remembered: each case asks for those of some ten sets of points."""


class _Read(local):
    """Names of the fields of watched setups that this thread has read: workers may be threads."""

    def __init__(self) -> None:
        self.names: set[str] = set()


_read = _Read()


class _Watched(Setup):
    """A setup that notes which of its fields are read."""

    def __post_init__(self) -> None:
        """Refuse nothing: it is made of a setup that was not refused."""

    def __getattribute__(self, name: str) -> object:
        if name in _FIELDS:
            _read.names.add(name)
        return super().__getattribute__(name)


_FIELDS = frozenset(field_names(Setup))
_DECIDED = frozenset({"autopilot", "position_noise_m", "keeps_load", "air_density_kg_m3"})
"""Fields that the preparation decides where a setup leaves them open."""


class _Remembered(Value, Generic[Made], eq=False):
    """What a step came to, and what it looked at."""

    subject: object
    seen: dict[str, Any]
    made: Made


class _StepMemory(Generic[Made]):
    """What a step of a subject and a setup came to, the latest first."""

    def __init__(self) -> None:
        self._known: list[_Remembered[Made]] = []

    def recall(
        self, subject: object, setup: Setup, make: Callable[[Setup], Made]
    ) -> tuple[Made, bool]:
        """Return what the step comes to, and whether it was made for that."""
        for at, one in enumerate(self._known):
            if one.subject is subject and _are_same(
                (value, getattr(setup, name)) for name, value in one.seen.items()
            ):
                self._known.insert(0, self._known.pop(at))
                return one.made, False
        _read.names.clear()
        made = make(_Watched(**field_values(setup)))
        seen = {name: getattr(setup, name) for name in _read.names}
        self._known.insert(0, _Remembered(subject=subject, seen=seen, made=made))
        del self._known[_KEPT:]
        return made, True


def _are_same(pairs: Iterable[tuple[object, object]]) -> bool:
    return all(before is now or _is_equal(before, now) for before, now in pairs)


def _is_equal(before: object, now: object) -> bool:
    """Return whether two plain values are equal; arrays and the like only are themselves."""
    is_plain = isinstance(before, int | float | str | Enum | msgspec.Struct)
    return is_plain and type(before) is type(now) and bool(before == now)


class _Latest(Generic[Made]):
    """The latest results by a key of the content they follow from."""

    def __init__(self, most: int = _KEPT) -> None:
        self._known: OrderedDict[Hashable, Made] = OrderedDict()
        self._most = most

    def recall(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """Return the result of a key."""
        if key in self._known:
            self._known.move_to_end(key)
            return self._known[key]
        self._known[key] = made = make()
        while len(self._known) > self._most:
            self._known.popitem(last=False)
        return made


class _KeptMotion(Motion, eq=False, dict=True):
    """A motion that remembers its states: flights in other air have the same."""

    @cached_property
    def _states(self) -> _Latest[KinematicState]:
        return _Latest(_STATES_KEPT)

    def state_at(self, piece: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state at times counted from the beginning of each piece."""
        key = (piece.shape, piece.tobytes(), time_s.tobytes())
        return self._states.recall(key, lambda: Motion.state_at(self, piece, time_s))


class _KeptTransients(Transients, eq=False, dict=True):
    """Transients that remember their power: in other air they are the same."""

    @cached_property
    def _totals_w(self) -> _Latest[FloatArray]:
        return _Latest()

    def total_power_w(self, time_s: FloatArray) -> FloatArray:
        """Return the sum of all windows at times since the start of the flight. [W]"""
        key = (time_s.shape, time_s.tobytes())
        return self._totals_w.recall(key, lambda: Transients.total_power_w(self, time_s))


class _Air:
    """Returns by one power, as it counts, and what those from the same points have come to."""

    def __init__(self, returns: Returns) -> None:
        self.returns = returns
        self.points: _Latest[ReturnPoints] = _Latest()
        self.flown: _Latest[FlownReturns] = _Latest()
        self.others: _Latest[object] = _Latest(_STATES_KEPT)


class _Way:
    """A mission as it is flown, and what follows from that, whatever the air and the load."""

    def __init__(self, returns: Returns) -> None:
        self._returns = returns
        self.timed: _StepMemory[Scenarios] = _StepMemory()
        self.places: _Latest[StopPlaces] = _Latest()
        self.back: _Latest[tuple[IntArray, Motion, Transients]] = _Latest()
        self.flight_points: _Latest[tuple[FlightPoint, ...]] = _Latest()
        self._once: dict[str, Any] = {}
        self._airs: _Latest[_Air] = _Latest()

    def once(self, make: Callable[[Returns], Made], returns: Returns) -> Made:
        """Return what is the same for all returns of this way."""
        name = make.__name__
        if name not in self._once:
            self._once[name] = make(returns)
        return self._once[name]  # type: ignore[no-any-return] # as it was made above

    def returns_by(self, setup: Setup) -> _KeptReturns:
        """Return the flight, and its returns, in the air and with the load of a setup."""
        power = steady_power(self._returns.route, setup)
        counted = power.counted
        others = [value for name, value in field_values(counted).items() if name != "vehicle"]
        air = self._airs.recall((id(power.vehicle), *others), lambda: self._in_air(power))
        flight = air.returns.flight
        if flight.power is not power:
            flight = flight.in_equal_power(power)
        own = field_values(air.returns) | {"flight": flight}
        return _KeptReturns(**own, way=self, air=air)

    def _in_air(self, power: SteadyPower) -> _Air:
        flight = self._returns.flight
        return _Air(
            self._returns.in_other_air(make_flight(flight.motion, flight.transients, power))
        )


class _KeptReturns(Returns, eq=False, dict=True):
    """Returns that remember what others of the same way and of the same power have come to."""

    way: _Way
    air: _Air

    @cached_property
    def sampled(self) -> tuple[IntArray, FloatArray] | None:
        """Segments of the points of the sample, and the fractions of their time, in flown order."""
        return self.way.once(sample_points, self)

    def sample_and(self, points: ReturnPoints) -> tuple[FlownReturns, ...]:
        """Return the returns of the sample, and those from further points: others have that alone."""
        assert self.sample is not None
        return self.sample, self.flown(points)

    @cached_property
    def situations(self) -> Situations:
        """Every situation the vehicle may be in."""
        return self.way.once(situations, self)

    @cached_property
    def judged(self) -> tuple[BoolArray, BoolArray]:
        """From which segments returns are judged, and which continue the one before."""
        return self.way.once(judged_segments, self)

    @cached_property
    def line_ends(self) -> BoolArray:
        """At which segments a line that is flown ends."""
        return self.way.once(line_ends, self)

    def recalled(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """Return what follows from these returns and a key."""
        return self.air.others.recall(key, make)  # type: ignore[return-value] # as it was made

    def places(self, segment: IntArray, fraction: FloatArray) -> StopPlaces:
        """Return where points of the flight are, and where and when vehicles there stand still."""
        key = (segment.tobytes(), fraction.tobytes())
        return self.way.places.recall(key, lambda: Returns.places(self, segment, fraction))

    def ways_back(self, points: ReturnPoints) -> tuple[IntArray, Motion, Transients]:
        """Return where the vehicle itself would return to from points, and how it flies there."""
        key = (points.segment.tobytes(), points.fraction.tobytes())
        return self.way.back.recall(key, lambda: Returns.ways_back(self, points))

    def flight_points(self, at: Sequence[tuple[int, float]]) -> tuple[FlightPoint, ...]:
        """Return where along the mission points of the flight are, by segment and fraction of its time."""
        return self.way.flight_points.recall(tuple(at), lambda: Returns.flight_points(self, at))

    def points(self, segment: IntArray, fraction: FloatArray) -> ReturnPoints:
        """Return points of the flight, by segment and fraction of its time. (n,)"""
        key = (segment.tobytes(), fraction.tobytes())
        return self.air.points.recall(key, lambda: Returns.points(self, segment, fraction))

    def flown(self, points: ReturnPoints) -> FlownReturns:
        """Return the returns the vehicle itself would fly from points."""
        key = (points.segment.tobytes(), points.fraction.tobytes())
        flown = self.air.flown.recall(key, lambda: Returns.flown(self, points))
        if flown.flight.power is self.flight.power:
            return flown
        return replace(flown, flight=flown.flight.in_equal_power(self.flight.power))


class _KeptPilot:
    """A pilot that remembers how it flew."""

    def __init__(self, pilot: Pilot) -> None:
        self._pilot = pilot
        self._ways: list[tuple[Route, tuple[Motion, Transients]]] = []
        self._returns: _Latest[tuple[object, tuple[Motion, Transients]]] = _Latest()
        # with what its key has the identity of
        self.return_heights_m = pilot.return_heights_m
        self.stop = pilot.stop
        self.farthest_stop_m = pilot.farthest_stop_m

    def fly(self, route: Route) -> tuple[Motion, Transients]:
        """Return the motion along a route of at least one stage, and its power transients."""
        known = next((one for one in self._ways if one[0] is route or one[0] == route), None)
        if known is None:
            motion, transients = self._pilot.fly(route)
            kept = _KeptMotion(**field_values(motion)), _KeptTransients(**field_values(transients))
            known = (route, kept)
            self._ways = [known, *self._ways[: _KEPT - 1]]
        return known[1]

    def fly_all(self, routes: Sequence[Route]) -> Iterator[tuple[Motion, Transients]]:
        """Yield the flights along routes, which are not remembered."""
        return self._pilot.fly_all(routes)

    def fly_returns(
        self, points_m: FloatArray, targets: ReturnTargets, route: Route
    ) -> tuple[Motion, Transients]:
        """Return the returns from points (n, 3) [m] where it stands still."""
        ends = (targets.ground_m, targets.above_ground_m, targets.datum_m)
        own = next((one for one, _ in self._ways if one == route), route)
        key = (
            points_m.tobytes(),
            *(one.tobytes() for one in ends),
            *map(id, targets.paths),
            id(own),
        )

        def fly() -> tuple[tuple[ReturnTargets, Route], tuple[Motion, Transients]]:
            return (targets, own), self._pilot.fly_returns(points_m, targets, route)

        return self._returns.recall(key, fly)[1]


class _Watcher:
    """A value whose attributes are noted as they are read; its methods run on it, its parts are watched."""

    def __init__(self, own: object, seen: set[str], path: str = "") -> None:
        self.__own, self.__seen, self.__path = own, seen, path

    def __getattr__(self, name: str) -> object:
        """Return what is read for the first time: it is kept as an attribute."""
        own = self.__own
        of_class = getattr(type(own), name, None)
        value: object
        if isinstance(of_class, FunctionType):
            value = MethodType(of_class, self)
        elif isinstance(of_class, property) and of_class.fget is not None:
            value = of_class.fget(self)
        elif isinstance(of_class, _Derived):
            value, paths = of_class.recalled(own)
            self.__seen.update(paths)
        elif (path := self.__path + name) in _PARTS:
            value = _Watcher(getattr(own, name), self.__seen, f"{path}.")
        else:
            value = getattr(own, name)
            self.__seen.add(path)
        self.__dict__[name] = value
        return value


_PARTS = frozenset({"setup", "flight"})
"""Parts of an assessment of which rules look at parts."""


class RememberingSteps(Steps):
    """The steps of checks that differ in little: each made where something it looks at has changed."""

    def __init__(self) -> None:
        self._flights = 0
        self._by: dict[Autopilot, RememberingSteps] = {}
        self._prepared: _StepMemory[Preparation] = _StepMemory()
        self._returns: _StepMemory[_KeptReturns | None] = _StepMemory()
        self._ways: _Latest[tuple[object, _Way | None]] = _Latest()
        # with what its key has the identity of
        self._pilots: list[tuple[Pilot, _KeptPilot]] = []
        self._found = _Findings()
        self._asked_by: Selection | None = None
        self._asked: dict[str, list[Check]] = {}
        self._latest: Flight | None = None
        self._foreseen: Sequence[Setup] = ()
        self._counted_of: Returns | None = None
        self._counted: dict[Hashable, tuple[Setup, CountedPack]] = {}
        # with what its keys have the identities of
        self._sampled: _Latest[tuple[Returns, _StepMemory[Scenarios]]] = _Latest()
        # with what its key has the identity of

    def prepare(self, mission: Mission, setup: Setup) -> Preparation:
        """Return what the flight of a mission is predicted from."""
        made, _ = self._prepared.recall(mission, setup, lambda own: prepare(mission, own))
        changed = {
            name: value
            for name, value in field_values(made.setup).items()
            if value is not getattr(setup, name) and name in _DECIDED
        }
        return replace(made, setup=replace(setup, **changed) if changed else setup)

    def assess(self, prepared: Preparation) -> Assessment | None:
        """Return everything that is predicted of a flight; ``None``: nothing moves."""
        prepared = over_its_ground(prepared)
        returns, is_new = self._returns.recall(
            prepared.route, prepared.setup, lambda setup: self._fly(replace(prepared, setup=setup))
        )
        self._flights += is_new
        if returns is None:
            return None
        own = field_values(assess_flown(prepared, returns, self))
        before = self._latest
        if before is not None and _is_same_flight(own["flight"], before):
            own["flight"] = before  # with what was worked out of it
        self._latest = own["flight"]
        return _KeptAssessment(**own, kept=self._found)

    @property
    def flights(self) -> int:
        """How many were predicted."""
        return self._flights + sum(one.flights for one in self._by.values())

    def by(self, autopilot: Autopilot) -> Steps:
        """Return the steps of the same checks with an autopilot named, which remember their own."""
        if autopilot not in self._by:
            self._by[autopilot] = RememberingSteps()
            self.foresee(self._foreseen)
        own = self._by[autopilot]
        own.judges_file = self.judges_file
        return own

    def foresee(self, setups: Sequence[Setup]) -> None:
        """Look at what comes next: packs of one flight are counted together."""
        self._foreseen = setups
        for autopilot, own in self._by.items():
            own.foresee([flown_by(autopilot, one) for one in setups])

    def counted(self, returns: Returns, setup: Setup) -> CountedPack:
        """Return what a flight and its returns come to with the pack of a setup."""
        if returns is not self._counted_of or _pack_key(setup) not in self._counted:
            setups = [setup, *(one for one in self._foreseen if _differs_in_pack(one, setup))]
            by_key = {_pack_key(one): one for one in setups}
            packs = count_packs(returns, tuple(by_key.values()))
            self._counted_of = returns
            self._counted = dict(zip(by_key, zip(by_key.values(), packs, strict=True), strict=True))
        return self._counted[_pack_key(setup)][1]

    def sample(
        self, returns: Returns, setup: Setup, spread: ModelSpread, sweep: ReturnSweep | None
    ) -> Scenarios:
        """Return what many flights of the mission take, whatever they fly on."""
        assert isinstance(returns, _KeptReturns)  # as `assess` makes them
        seen = None if sweep is None else tightest_rows(sweep, setup)
        rows = () if seen is None else [one.tobytes() for one in field_values(seen).values()]
        timed, _ = returns.way.timed.recall(
            spread, setup, lambda own: sample_times(returns.flight, own, spread)
        )
        memory = self._sampled.recall((id(returns), *rows), lambda: (returns, _StepMemory()))[1]
        return memory.recall(
            spread,
            setup,
            lambda own: sample_flights(returns, own, spread=spread, sweep=seen, timed=timed),
        )[0]

    def arrivals(self, assessment: Assessment) -> tuple[ItemArrival, ...]:  # noqa: ARG002
        """Return none: no case of a sweep shows them."""
        return ()

    def judge(
        self, assessment: Assessment, selection: Selection
    ) -> tuple[tuple[Finding, ...], tuple[LedgerEntry, ...]]:
        """Return what every rule finds; what was checked is listed for no case."""
        if self._asked_by is not selection:
            self._asked = {
                subject: [check for check in checks_of(subject) if is_asked(check, selection)]
                for subject in SUBJECTS
            }
            self._asked_by = selection
        self._found.begin(assessment)
        findings: list[Finding] = []
        for subject, needs in SUBJECTS.items():
            if all(self._found.recall(need, need.of, assessment) is not None for need in needs):
                for check in self._asked[subject]:
                    found = self._found.recall(check, check, assessment)
                    if found:
                        findings += reported(assessment, found)
        return tuple(findings), ()

    def _fly(self, prepared: Preparation) -> _KeptReturns | None:
        setup = prepared.setup
        pilot = self._pilot(setup, prepared.own_parameters)
        parts = (prepared.route, prepared.own_parameters, pilot, setup.terrain, setup.flown_by)

        def find() -> tuple[object, _Way | None]:
            returns = fly(prepared, pilot_of=lambda *_: pilot)
            return parts, None if returns is None else _Way(returns)

        way = self._ways.recall(tuple(map(id, parts)), find)[1]
        return None if way is None else way.returns_by(setup)

    def _pilot(self, setup: Setup, parameters: FlightParameters | None) -> Pilot:
        pilot = make_pilot(setup, parameters)
        if not isinstance(pilot, StepPilot) and pilot.airspeed_limit_m_s is None:
            pilot = replace(pilot, wind=Wind())  # no wind slows it down: the motion is that of calm
        for known, kept in self._pilots:
            if known == pilot:
                return kept
        kept = _KeptPilot(pilot)
        self._pilots = [(pilot, kept), *self._pilots[: _KEPT - 1]]
        return kept


_OF_PACK = (
    "charge",
    "rest_voltage_v",
    "battery_health",
    "battery_resistance_factor",
    "battery_temperature_c",
    "reserve",
)
"""Fields in which packs differ that fly the same."""
CASES_AHEAD = 96
"""So many cases are looked at ahead: the ways home of all their packs are flown in one."""


def _pack_key(setup: Setup) -> Hashable:
    """Return what tells packs apart: models that do not count its mass fly the same on every battery."""
    return tuple(id(getattr(setup, name)) for name in ("battery", *_OF_PACK))


def _differs_in_pack(one: Setup, other: Setup) -> bool:
    """Return whether setups are the same but for the pack and what the preparation decides."""
    return _are_same((getattr(one, name), getattr(other, name)) for name in _OF_NO_PACK)


_OF_NO_PACK = tuple(_FIELDS - {*_OF_PACK} - _DECIDED)
_OFTEN, _WATCHED_AGAIN = 3, 24
"""What is made in so many cases in a row is made in the next without being watched, up to so many."""


class _Findings:
    """What is found in assessments, one after the other: made again where what it looked at has changed."""

    def __init__(self) -> None:
        self._made: dict[object, _Made] = {}
        self._stale: set[object] = set()
        """Of what was made: what no longer holds, or was never watched."""
        self._seen: dict[str, _Seen] = {}

    def begin(self, a: Assessment) -> None:
        """Look at the next assessment."""
        for seen in self._seen.values():
            if seen.is_changed(a):
                self._stale |= seen.readers

    def recall(self, subject: object, make: Callable[[Any], Made], a: Assessment) -> Made:
        """Return what is made of an assessment."""
        known = self._made.get(subject)
        if known is None:
            known = self._made[subject] = _Made()
            self._stale.add(subject)
        elif subject not in self._stale:
            known.in_a_row = 0
            made: Made = known.made
            return made
        known.in_a_row += 1
        is_often = known.in_a_row % _WATCHED_AGAIN >= _OFTEN
        if not known.is_watched or (is_often and not isinstance(subject, str)):
            return make(a)  # watching it again would save nothing
        seen: set[str] = set()
        try:
            known.made = made = make(_Watcher(a, seen))
        except TypeError:  # it hands the assessment on to what takes nothing else
            known.is_watched = False
            return make(a)
        for path in known.paths - seen:
            self._seen[path].readers.discard(subject)
        for path in seen - known.paths:
            if path not in self._seen:
                self._seen[path] = _Seen(path, a)
            self._seen[path].readers.add(subject)
        known.paths = frozenset(seen)
        self._stale.discard(subject)
        return made

    def paths_of(self, name: str) -> frozenset[str]:
        """Return what was looked at for what was recalled last by a name."""
        known = self._made[name]
        return known.paths if known.is_watched else frozenset({name})


class _Made:
    """What was made of an assessment, and what was looked at for it."""

    def __init__(self) -> None:
        self.made: Any = None
        self.paths: frozenset[str] = frozenset()
        self.in_a_row = 0
        """Cases in which it was made again, one after the other."""
        self.is_watched = True


class _Seen:
    """What was last at a path of an assessment, and what was made of that."""

    def __init__(self, path: str, a: Assessment) -> None:
        self._of = attrgetter(path)
        self._value = self._of(a)
        self.readers: set[object] = set()

    def is_changed(self, a: Assessment) -> bool:
        """Return whether it is another than in the assessment before."""
        value = self._of(a)
        is_same = value is self._value or _is_equal(self._value, value)
        self._value = value
        return not is_same


class _Derived(cached_property[Any]):
    """What an assessment works out of what else it has: remembered like what is found in it."""

    def __init__(self, name: str) -> None:
        super().__init__(self._of)
        self._name, self._make = name, vars(Assessment)[name].func

    def recalled(self, a: Any) -> tuple[object, frozenset[str]]:  # noqa: ANN401 - `_KeptAssessment`
        """Return it, and what it looked at."""
        return getattr(a, self._name), a.kept.paths_of(self._name)

    def _of(self, a: _KeptAssessment) -> object:
        made: object = a.kept.recall(self._name, self._make, a)
        return made


class _KeptAssessment(Assessment, eq=False, dict=True):
    """An assessment that remembers what others before it have worked out of the same."""

    kept: _Findings
    items = _Derived("items")
    reach = _Derived("reach")
    lateness = _Derived("lateness")
    late_returns = _Derived("late_returns")
    uncounted = _Derived("uncounted")
    battery_profile = _Derived("battery_profile")
    return_discharge = _Derived("return_discharge")


def _is_same_flight(one: Flight, other: Flight) -> bool:
    return _are_same(zip(field_values(one).values(), field_values(other).values(), strict=True))
