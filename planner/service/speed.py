"""Energy and time of a mission over the speed of its level legs, and the speeds worth knowing."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.findings import Severity
from planner.flight.pilot import step_speeds_m_s
from planner.flight.prediction import predict_costs
from planner.mission.convert import level_speeds, routes_at_speeds
from planner.presented import Presented
from planner.service.other_flights import flown_by
from planner.service.preflight import Steps, WhatIfSteps, check_mission
from planner.service.preparation import at_speed, prepare
from planner.setting import is_finite_number
from planner.setup import Setup
from planner.units import wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.flight.prediction import ItemArrival
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.service.preflight import CheckResult
    from planner.service.preparation import Preparation
    from planner.vehicle.declared import Interval
    from planner.vehicle.model import VehicleModel

FINEST_M_S = 0.01
"""Speeds are found to this: no vehicle keeps one better. [m s⁻¹]"""
_SLOWEST_M_S = 1.0
"""Where the range begins; slower, missions are flown by other means. [m s⁻¹]"""
_FASTEST_UNKNOWN_M_S = 20.0
"""Where it ends where nothing about the vehicle says so. [m s⁻¹]"""
_ROWS = 15
"""Speeds in a table, about."""
_MOST_ROWS = 500
_SCANNED = 40
"""Over the range, evenly: as densely the search looks where the lowest may be, before it looks closer."""
_PARTS = 5
"""Of the way to the speeds beside a lowest one, each time it looks closer."""
_ASIDE = 16
"""Of the way between the speeds beside a lowest one, so far to either side of a parabola's vertex."""
_SAME = 1e-9
"""Relative difference of energies, or powers, that are the same: legs too short for a speed."""
_MOST_BRACKETS = 3
MARKS = {
    "present": "present",
    "best_endurance": "best endurance",
    "best_range": "best range",
    "fastest_fitting": "fastest that fits",
    "fastest_clear": "fastest clear of all",
}
"""The speeds worth knowing and how each is called."""


class _StepsAtSpeeds(WhatIfSteps):
    """The steps of checks that differ in the speed of level legs alone: the mission is laid out once."""

    def __init__(self, mission: Mission, setup: Setup) -> None:
        self._own = prepare(mission, setup)
        self._by: dict[Autopilot, Steps] = {}

    def prepare(self, mission: Mission, setup: Setup) -> Preparation:
        """Return what the flight of the mission is predicted from."""
        if setup.speed_m_s is None or self._own.route.held:
            return prepare(mission, setup)
        return at_speed(self._own, setup.speed_m_s)

    def by(self, autopilot: Autopilot) -> Steps:
        """Return the steps of the same checks with an autopilot named."""
        if autopilot not in self._by:
            setup = flown_by(autopilot, self._own.setup)
            self._by[autopilot] = _StepsAtSpeeds(self._own.mission, setup)
        return self._by[autopilot]

    def arrivals(self, assessment: Assessment) -> tuple[ItemArrival, ...]:  # noqa: ARG002 - as of `Steps`
        """Return none: nobody asks at other speeds."""
        return ()


class FlownSpeed(Value):
    """A mission flown at one speed; everything but time is ``None`` where the power is not known."""

    speed_m_s: float | None
    """Over ground, on every level leg; ``None``: legs have several, as the file commands. [m s⁻¹]"""
    time_s: float
    energy_wh: float | None
    mean_power_w: float | None
    energy_wh_per_km: float | None
    """Over the distance flown. [Wh km⁻¹]"""
    margin_wh: float | None
    """Above the reserve at landing; ``None`` with no battery. [Wh]"""
    return_margin_wh: float | None
    """Above the reserve at home, from the point with the tightest return. [Wh]"""
    fits: bool | None
    """Whether the battery does for it: no finding of energy makes it a no-go; ``None``: not known."""
    verdict: str
    verdict_text: str
    """The same in words: what could not be checked is told from what is no go."""
    against: tuple[str, ...]
    """Codes of the findings that make it a no-go, and of those about the fence."""


class SpeedCurve(Presented):
    """Energy and time of a mission over the speed of its level legs, and the speeds worth knowing."""

    file: str
    vehicle_name: str
    vehicle_source: str
    points: tuple[FlownSpeed, ...]
    """Rising speeds, evenly over the range."""
    present: FlownSpeed
    """As the file commands it."""
    best_endurance: FlownSpeed | None
    """Least mean power; this and the next are ``None`` where the model knows no power over speed."""
    best_range: FlownSpeed | None
    """Least energy, and so least energy per distance in this wind."""
    fastest_fitting: FlownSpeed | None
    """Fastest the battery does for, above the reserve and on every return; ``None``: none."""
    fastest_clear: FlownSpeed | None
    """Fastest that is a go with room to the fence, too: no finding of it; ``None``: none."""
    identified_m_s: Interval | None
    """Airspeeds the model was identified at. [m s⁻¹]"""
    is_power_over_speed_known: bool
    """Whether the model knows how its power changes with the airspeed."""
    whole: CheckResult
    """The check of the mission as the file commands it."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the mission as the file commands it."""
        return self.whole.findings

    @property
    def speed_m_s(self) -> FloatArray:
        """Speeds of the points. (n,) [m s⁻¹]"""
        return self._column("speed_m_s")

    @property
    def time_s(self) -> FloatArray:
        """Time of the mission at each. (n,) [s]"""
        return self._column("time_s")

    @property
    def energy_wh(self) -> FloatArray:
        """Energy of the mission at each, NaN where it is not known. (n,) [Wh]"""
        return self._column("energy_wh")

    @property
    def mean_power_w(self) -> FloatArray:
        """Mean power at each, NaN where it is not known. (n,) [W]"""
        return self._column("mean_power_w")

    @property
    def margin_wh(self) -> FloatArray:
        """Energy above the reserve at each, NaN where no battery is known. (n,) [Wh]"""
        return self._column("margin_wh")

    def _column(self, name: str) -> FloatArray:
        return np.array([getattr(point, name) for point in self.points], dtype=np.float64)

    def edges(self) -> tuple[str, ...]:
        """Return which marked speeds are only the slowest or fastest looked at: a better may lie beyond."""
        low_m_s, high_m_s = self.points[0].speed_m_s, self.points[-1].speed_m_s
        ends_m_s = {name: {low_m_s, high_m_s} for name in ("best_endurance", "best_range")}
        ends_m_s |= {name: {high_m_s} for name in ("fastest_fitting", "fastest_clear")}
        return tuple(
            name
            for name, ends in ends_m_s.items()
            if (flown := getattr(self, name)) is not None and flown.speed_m_s in ends
        )

    def marks(self) -> tuple[tuple[str, FlownSpeed], ...]:
        """Return the speeds worth knowing by name, those there are; with what is only an edge."""
        edges = self.edges()
        return tuple(
            (f"{name} (edge)" if key in edges else name, flown)
            for key, name in MARKS.items()
            if (flown := getattr(self, key)) is not None
        )


def predict_speed_curve(
    mission: Mission,
    vehicle: VehicleModel,
    *,
    from_m_s: float | None = None,
    to_m_s: float | None = None,
    step_m_s: float | None = None,
    **options: Any,  # noqa: ANN401 - those of `planner.check`
) -> SpeedCurve:
    """Return energy and time of a mission over the speed of its level legs.

    Parameters
    ----------
    mission, vehicle
        As `planner.read_mission` and `planner.load_vehicle` return them.
    from_m_s, to_m_s : float, optional
        Slowest and fastest speed over ground; default 1 m/s, and the fastest the model was identified
        at or the vehicle can fly, whichever is less. [m s⁻¹]
    step_m_s : float, optional
        Between two points; default about a fifteenth of the range. [m s⁻¹]
    **options
        Battery, conditions and the rest, as `planner.check` takes them.

    Returns
    -------
    SpeedCurve
        Each point is what `planner.check` returns with ``speed_m_s``; the marked speeds are found to
        0.01 m/s among all of the range, however the curve bends.

    Raises
    ------
    UsageError
        If nothing is flown, or the range or a value is unusable.
    MissionFileError
        If an item holds a number no vehicle can fly.

    Notes
    -----
    The search looks at the points, then as densely as at forty over the range where the lowest may be
    between them, then ever closer about the lowest valleys, down to 0.01 m/s: the curve of a mission has
    kinks where legs become too short for a speed, and plateaus beyond.  Of speeds that are equally good,
    the slowest counts.
    """
    return speed_curve(
        mission, Setup(vehicle, **options), from_m_s=from_m_s, to_m_s=to_m_s, step_m_s=step_m_s
    )


def speed_curve(
    mission: Mission,
    setup: Setup,
    *,
    from_m_s: float | None = None,
    to_m_s: float | None = None,
    step_m_s: float | None = None,
) -> SpeedCurve:
    """Return the speed curve of a mission under a setup; see `predict_speed_curve`."""
    if setup.speed_m_s is not None:
        msg = "the speed is what is looked for: give a range instead of one"
        raise UsageError(msg)
    for name, value in (("from_m_s", from_m_s), ("to_m_s", to_m_s), ("step_m_s", step_m_s)):
        if value is not None and not is_finite_number(value):
            msg = f"{name} must be a number: got {value!r}"
            raise UsageError(msg)
    vehicle = setup.vehicle
    at_all_speeds = _Missions(mission, setup)
    present = check_mission(mission, setup)
    if present.assessment is None:
        msg = f"{mission.source}: nothing is flown, at any speed"
        raise UsageError(msg)
    assessment = present.assessment
    speeds = _range(assessment, from_m_s, to_m_s, step_m_s)
    points = tuple(at_all_speeds.flown(speed) for speed in speeds)
    is_known = vehicle.is_power_known and vehicle.knows_airspeed
    endurance = best = None
    if is_known:
        # What is held back is laid out anew at every speed, but not where costs alone are asked for.
        costs = _Costs(assessment, () if assessment.route.held else points)
        best = at_all_speeds.flown(_least(speeds, costs.energies_wh))
        endurance = at_all_speeds.flown(_least(speeds, costs.mean_powers))
    sure = [*points, *(one for one in (best, endurance) if one is not None)]
    commanded = level_speeds(assessment.route)
    own_m_s = _own_speed_m_s(assessment)
    commanded_m_s = {own_m_s if speed is None else speed for speed in commanded}
    return SpeedCurve(
        file=mission.source,
        vehicle_name=vehicle.name,
        vehicle_source=vehicle.source,
        points=points,
        present=_flown(present, commanded_m_s.pop() if len(commanded_m_s) == 1 else None),
        best_endurance=endurance,
        best_range=best,
        fastest_fitting=at_all_speeds.fastest(sure, lambda flown: bool(flown.fits)),
        fastest_clear=at_all_speeds.fastest(
            sure, lambda flown: flown.verdict == "go" and not flown.against
        ),
        identified_m_s=vehicle.valid_for.speed_m_s,
        is_power_over_speed_known=is_known,
        whole=present,
    )


class _Missions:
    """One mission at many speeds, each checked once."""

    def __init__(self, mission: Mission, setup: Setup) -> None:
        self._mission = mission
        self._setup = replace(setup, with_trace=False)
        self._steps = _StepsAtSpeeds(mission, self._setup)
        self._known: dict[float, FlownSpeed] = {}

    def flown(self, speed_m_s: float) -> FlownSpeed:
        """Return the mission at a speed, by the same check as every other."""
        speed_m_s = round(speed_m_s, 6)
        if speed_m_s not in self._known:
            result = check_mission(
                self._mission, replace(self._setup, speed_m_s=speed_m_s), steps=self._steps
            )
            self._known[speed_m_s] = _flown(result, speed_m_s)
        return self._known[speed_m_s]

    def fastest(
        self, sure: list[FlownSpeed], is_good: Callable[[FlownSpeed], bool]
    ) -> FlownSpeed | None:
        """Return the fastest that is good: beyond a good one, halved towards the next that is not."""
        rising = sorted(sure, key=lambda flown: flown.speed_m_s or 0.0)
        good = [number for number, flown in enumerate(rising) if is_good(flown)]
        if not good:
            return None
        low = rising[good[-1]]
        if good[-1] + 1 == len(rising):
            return low
        high = rising[good[-1] + 1]
        while True:
            slow, fast = low.speed_m_s or 0.0, high.speed_m_s or 0.0
            between = round(0.5 * (slow + fast), 2)
            if not slow < between < fast:
                return low
            middle = self.flown(between)
            low, high = (middle, high) if is_good(middle) else (low, middle)


def _flown(result: CheckResult, speed_m_s: float | None) -> FlownSpeed:
    totals, battery, plan = result.totals, result.battery, result.return_plan
    is_known = math.isfinite(totals.energy_wh)
    against = [
        finding.code
        for finding in result.findings
        if finding.severity >= result.setup.fail_on
        or (finding.code.startswith("F") and finding.severity >= Severity.WARNING)
    ]
    lacking = any(
        finding.code.startswith("E") and finding.severity is Severity.ERROR
        for finding in result.findings
    )
    margins_wh = (
        math.nan if battery is None else battery.margin_wh,
        0.0 if plan is None or plan.margin_wh is None else plan.margin_wh,
    )
    distance_km = totals.distance_m / 1000.0
    return FlownSpeed(
        speed_m_s=speed_m_s,
        time_s=totals.time_s,
        energy_wh=totals.energy_wh if is_known else None,
        mean_power_w=totals.mean_power_w if is_known else None,
        energy_wh_per_km=totals.energy_wh / distance_km if is_known and distance_km > 0.0 else None,
        margin_wh=battery.margin_wh if battery is not None and is_known else None,
        return_margin_wh=None if plan is None else plan.margin_wh,
        fits=None if battery is None or not is_known else not lacking and min(margins_wh) >= 0.0,
        verdict=result.verdict,
        verdict_text=result.verdict_text,
        against=tuple(sorted({*against})),
    )


def _range(
    assessment: Assessment, from_m_s: float | None, to_m_s: float | None, step_m_s: float | None
) -> list[float]:
    low = _SLOWEST_M_S if from_m_s is None else from_m_s
    high = max(_highest_m_s(assessment), low) if to_m_s is None else to_m_s
    if not (0.0 < low <= high and math.isfinite(high)):
        msg = f"a range of speeds rises from above 0, got {low:g} to {high:g} m/s"
        raise UsageError(msg)
    step = step_m_s
    if step is None:
        rough = (high - low) / _ROWS
        step = next(one for one in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, math.inf) if one >= rough)
    if not (math.isfinite(step) and step >= FINEST_M_S) or (high - low) / step > _MOST_ROWS:
        msg = (
            f"steps of {step:g} m/s from {low:g} to {high:g} m/s: give {FINEST_M_S:g} m/s or more, "
            f"and no more than {_MOST_ROWS} of them"
        )
        raise UsageError(msg)
    count = math.floor((high - low) / step + 1e-9) + 1
    speeds = [round(low + number * step, 6) for number in range(count)]
    return speeds if high - speeds[-1] < 1e-6 else [*speeds, round(high, 6)]


def _highest_m_s(assessment: Assessment) -> float:
    """Return the fastest the model was identified at or the vehicle can fly, whichever is less."""
    vehicle, parameters = assessment.vehicle, assessment.parameters
    limits = [assessment.airspeed_limit_m_s, getattr(parameters, "speed_max_m_s", None)]
    if vehicle.valid_for.speed_m_s is not None:
        limits.append(vehicle.valid_for.speed_m_s.high)
    return min((limit for limit in limits if limit is not None), default=_FASTEST_UNKNOWN_M_S)


def _own_speed_m_s(assessment: Assessment) -> float | None:
    """Return the speed of legs for which a mission commands none."""
    if assessment.autopilot is Autopilot.STEP:
        return step_speeds_m_s(assessment.vehicle, assessment.own_parameters).own_m_s
    return None if assessment.parameters is None else assessment.parameters.cruise_speed_m_s


def _parted(low_m_s: float, high_m_s: float, parts: int) -> Iterator[float]:
    """Yield what parts a stretch of speeds, as evenly as speeds are looked for."""
    for speed in np.linspace(low_m_s, high_m_s, parts + 1).round(2).tolist():
        if low_m_s < speed < high_m_s:
            yield speed


class _Costs:
    """What a mission takes at many speeds, each flown once and those asked for together at once."""

    def __init__(self, assessment: Assessment, points: Iterable[FlownSpeed]) -> None:
        self._assessment = assessment
        self._known = {
            one.speed_m_s: (one.energy_wh, one.time_s)
            for one in points
            if one.speed_m_s is not None and one.energy_wh is not None
        }
        """Energies [Wh] and times [s]."""

    def energies_wh(self, speeds_m_s: list[float]) -> list[float]:
        """Return the energies at speeds. [Wh]"""
        return [energy_wh for energy_wh, _ in self._at(speeds_m_s)]

    def mean_powers(self, speeds_m_s: list[float]) -> list[float]:
        """Return the energies over the times at speeds. [Wh s⁻¹]"""
        return [energy_wh / time_s for energy_wh, time_s in self._at(speeds_m_s)]

    def _at(self, speeds_m_s: list[float]) -> list[tuple[float, float]]:
        new = [speed for speed in dict.fromkeys(speeds_m_s) if speed not in self._known]
        if new:
            a = self._assessment
            routes = [*routes_at_speeds(a.route, new)]
            energy_j, time_s = predict_costs(routes, a.setup, a.returns.pilot)
            both = zip(wh_from_j(energy_j).tolist(), time_s.tolist(), strict=True)
            self._known.update(zip(new, both, strict=True))
        return [self._known[speed] for speed in speeds_m_s]


def _least(speeds_m_s: list[float], cost: Callable[[list[float]], list[float]]) -> float:
    """Return the slowest speed of least cost, to 0.01 m/s, from rising speeds to look at first."""
    speeds = _scanned(speeds_m_s, cost(speeds_m_s))
    while True:
        costs = cost(speeds)
        least, most = min(costs) * (1.0 - _SAME), min(costs) * (1.0 + _SAME)
        best = next(number for number, own in enumerate(costs) if own <= most)
        ends = [costs[0], *costs, costs[-1]]
        # Not those that would have to fall farther below what is known of them than they rise beside it.
        valleys = [
            n
            for n, own in enumerate(costs)
            if own <= min(ends[n], ends[n + 2]) and 2.0 * own - max(ends[n], ends[n + 2]) < least
        ]
        valleys.sort(key=costs.__getitem__)
        finer: set[float] = set()
        for number in {best, *valleys[:_MOST_BRACKETS]}:
            about = slice(max(number - 1, 0), number + 2)
            finer |= _within(speeds[about], costs[about]) - {*speeds}
        if not finer:
            return speeds[best]
        speeds = sorted({*speeds, *finer})


def _scanned(speeds_m_s: list[float], costs: list[float]) -> list[float]:
    """Return rising speeds with others evenly between, but where costs are too high for the lowest."""
    step_m_s = max((speeds_m_s[-1] - speeds_m_s[0]) / _SCANNED, FINEST_M_S)
    found = {*speeds_m_s}
    for number, (low, high) in enumerate(pairwise(speeds_m_s)):
        about = slice(max(number - 1, 0), number + 3)
        if _lowest(speeds_m_s[about], costs[about]) < min(costs):
            found |= {*_parted(low, high, math.ceil((high - low) / step_m_s - _SAME))}
    return sorted(found)


def _lowest(speeds_m_s: list[float], costs: list[float]) -> float:
    """Return how low costs may be between the inner two of four speeds: where lines from outside meet.

    So it is of a curve that bends upwards; of another, or where a side is not known, no bound.
    """
    if len(costs) < 4:
        return -math.inf
    falling = (costs[1] - costs[0]) / (speeds_m_s[1] - speeds_m_s[0])
    rising = (costs[3] - costs[2]) / (speeds_m_s[3] - speeds_m_s[2])
    over = costs[2] - costs[1] - falling * (speeds_m_s[2] - speeds_m_s[1])
    if rising <= falling or over < 0.0:
        return -math.inf
    along_m_s = max(speeds_m_s[2] - speeds_m_s[1] - over / (rising - falling), 0.0)
    return costs[1] + falling * along_m_s


def _within(speeds_m_s: list[float], costs: list[float]) -> set[float]:
    """Return speeds to look at between that of a lowest cost and those beside it.

    Those about the vertex of the parabola through all three, where it is one and tells anything new; else
    they part the stretches evenly.
    """
    even = {speed for ends in pairwise(speeds_m_s) for speed in _parted(*ends, _PARTS)}
    if len(costs) < 3 or min(costs[0], costs[2]) <= costs[1] * (1.0 + _SAME):
        return even
    low, middle, high = speeds_m_s
    if max(middle - low, high - middle) > _PARTS * min(middle - low, high - middle):
        return even
    before, after = (costs[1] - costs[0]) / (middle - low), (costs[2] - costs[1]) / (high - middle)
    vertex = 0.5 * (low + middle) - 0.5 * before * (high - low) / (after - before)
    aside = max((high - low) / _ASIDE, FINEST_M_S)
    about = {round(vertex + side * aside, 2) for side in (-1, 0, 1)} - {*speeds_m_s}
    return {speed for speed in about if low < speed < high} or even
