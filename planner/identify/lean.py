"""Drag by how far a vehicle leans, and the airspeed it holds at its greatest lean angle."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.findings import Rule, Severity
from planner.identify.segments import climb_rate_m_s, is_steady, run_bounds, speed_through_air_m_s
from planner.identify.uncertainty import rounded
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.units import GRAVITY_M_S2
from planner.values import Value, replace
from planner.vehicle.model import Aloft, held_drag
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.identify.segments import MeasuredPower
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel

LEANT_WIND = "how the vehicle leans"
"""Where the wind of a record is found that no message of its log holds."""

_NEAR_RAD = math.radians(0.5)
"""A mean lean within this of the limit is at it: the limit is one of the target, which the vehicle
follows without a steady error; recorded within 0.05°."""
_LEVEL_M_S = 0.3
"""Climb rate below which flight is level: a climb tilts the thrust by what it does not take of drag."""
MOVING_M_S = 2.0
"""Below it the lean is that of the trim, not of the drag. [m s⁻¹]"""
_APART = 1.3
"""An exponent takes airspeeds at least so far apart: half a degree of lean is then 0.1 of it. [-]"""
_DRAG_ERROR = 0.03
"""Of the drag of a steady leg, relative: half a degree in fifteen. [-]"""
_WIND_ERROR = 0.15
"""Of a wind that the lean tells, relative: in ArduPilot's simulation within 13 % in eight flights. [-]"""
_TRIM = math.tan(math.radians(1.0))
"""Of the level thrust over that upwards, by which all attitudes of a flight may be off alike: an AHRS_TRIM,
an autopilot or a centre of gravity that is not level; 2.5° in the air take two deviations. [-]"""
LEAST_WIND_M_S = 1.0
"""Of a wind that the lean tells: less is that of trims, and changes the power of a leg by a hundredth."""
_BREEZE_M_S = LEAST_WIND_M_S / math.sqrt(3.0)
"""Standard deviation of a wind along the way that is too weak to be told: any up to that. [m s⁻¹]"""
UNTOLD_WIND_M_S = 3.0
"""Standard deviation of a wind along the way that nothing tells: of 4 m/s from anywhere. [m s⁻¹]"""
_MOST_ERROR = 0.4
"""The highest airspeed_limit_fraction of a model: nothing is certain then. [-]"""
_HELD_ERROR = 0.01
"""Of an airspeed held at the greatest lean, relative: the noise of velocities over seconds. [-]"""
_COMPARED = 0.5
"""Fraction of the fastest from which on legs tell what more lean is sure to hold. [-]"""
_LIMIT_ERROR = 0.03
"""Most that the airspeed at the greatest lean is off by where less lean tells it. [-]"""
_USUAL_EXPONENT = 1.5
"""Of a drag whose exponent flights do not tell: between that of rotors and that of a body. [-]"""
_BESIDE = 1.5
"""Most drag of a frame flown side or tail first, over that nose first. [-]"""
_ONE_WAY = 0.9
"""Of the mean of directions, from which on they are one: of two at right angles it is 0.7. [-]"""
_AHEAD_RAD = math.radians(45.0)
"""Between heading and course, in the mean, up to which the nose points along the way."""
_SHORTEST_S = 5.0
"""Of steady flight; the airspeed is that of its second half, for it is approached exponentially. [s]"""


class LeanFlight(Value):
    """What flights show of how a vehicle leans against its drag."""

    airspeed_limit_m_s: float | None
    """Airspeed held at the greatest lean angle, with the most drag; else the fastest flown; ``None``: how
    much it leans there is not known well enough to tell the limit."""
    limit_lean_deg: float | None
    """The angle at which the model's mass holds it. [°]"""
    drag_exponent: float | None
    """Power of the airspeed that the drag goes by; ``None``: not shown. [-]"""
    limit_fraction: float | None = None
    """Standard deviation of that airspeed, relative. [-]"""
    sure_airspeed_m_s: float | None = None
    """Without a limit, what the greatest lean holds at least: drag goes by the square at most."""
    air_density_kg_m3: float | None = None
    """Of the air that all airspeeds are those in; ``None``: not known."""

    contradicted: frozenset[int] = frozenset()
    """Places of the flights that lean less than others let them: they had the wind behind them."""
    is_one_way: bool = False
    """Whether each flight heads one way, in a wind that nothing tells: all of its speed may be wind."""

    def shown_m_s(self, flown_m_s: float) -> float:
        """Return what of a flown airspeed is shown: of one that may be wind no more than is certain."""
        if self.is_one_way:
            least = flown_m_s - 2.0 * UNTOLD_WIND_M_S
            flown_m_s = max(least, (1.0 - 2.0 * _MOST_ERROR) * flown_m_s)
        if not self.contradicted:
            return flown_m_s
        return min(flown_m_s, self.airspeed_limit_m_s or self.sure_airspeed_m_s or math.inf)

    @property
    def limit_air_kg_m3(self) -> float | None:
        """That of the limit; ``None``: not known, or there is none."""
        return None if self.airspeed_limit_m_s is None else self.air_density_kg_m3


_UNKNOWN = LeanFlight(airspeed_limit_m_s=None, limit_lean_deg=None, drag_exponent=None)


class _Lean(NamedTuple):
    """Steady level flight."""

    airspeed_m_s: float
    drag: float
    """Over the weight of the model: the level thrust, less what still speeds the vehicle up. [-]"""
    times_heavier: float
    lean_rad: float
    limit_rad: float | None
    error: float
    """Of the airspeed, by that of a wind that the lean itself tells, relative. [-]"""
    is_ahead: bool
    """Whether the nose points along the way, as on the legs of missions; trim and frame drag otherwise."""
    course_rad: float
    """Clockwise from north."""
    is_one_way: bool = False
    """Whether all of its flight heads one way, in a wind that nothing tells."""
    is_one_way_at_limit: bool = False
    """Whether all legs at the limit of its flight head one way: a wind too weak to be told is in them."""
    is_contradicted: bool = False
    """Whether it leans less than another leg of its flight lets it: it had the wind behind it."""

    @property
    def is_at_limit(self) -> bool:
        return self.limit_rad is not None and abs(self.lean_rad - self.limit_rad) < _NEAR_RAD

    def sure_airspeed_m_s(self, drag: float) -> float:
        """Return what is certain to be held against a drag over the weight of the model. [m s⁻¹]

        The airspeed less two of its deviations, drag by the square at most.
        """
        flown_m_s = self.airspeed_m_s * max(1.0 - 2.0 * self.error, 0.0)
        return flown_m_s * min(drag / self.drag, math.sqrt(drag / self.drag))


def identified_lean(
    records: Sequence[FlightRecord],
    base: VehicleModel | None = None,
    *,
    times_heavier: Sequence[float] = (),
    air_kg_m3: Sequence[float] = (),
) -> LeanFlight:
    """Return what flights show of lean and drag; where they show no limit, all that a base model gives.

    The limit is that of the leg at it with the most drag: where the wind is not known, airspeeds are over
    ground, and a headwind takes off what a tailwind adds.  Where it was not come to, it is the fastest
    flown, at the lean that the drag of all legs has there, if that tells the limit within 3 %.  Of a base
    model it is that which leans more, and the one known better where they are not known alike.

    ``times_heavier`` are the masses that flew over that of the model, left out of a mass that is not known:
    what is heavier leans less against the same drag.  ``air_kg_m3`` are the densities of the air, left out
    where they are not known: airspeeds are those at the same lean in the densest.
    """
    times = times_heavier or [1.0] * len(records)
    densest = max(air_kg_m3, default=None)
    thinner = [1.0 if densest is None else one / densest for one in air_kg_m3 or times]
    flights = [
        [
            one._replace(airspeed_m_s=one.airspeed_m_s * math.sqrt(air))
            for one in _steady(record, own)
        ]
        for record, own, air in zip(records, times, thinner, strict=True)
    ]
    flown = [one for one in flights if one]
    contradicted = frozenset(
        place for place, one in enumerate(flights) if one and _is_contradicted(one, flown)
    )
    kept = [one for place, one in enumerate(flights) if one and place not in contradicted]
    if not kept:  # the least of them counts, however fast the wind behind it was
        contradicted = frozenset()
        kept = [
            [leg._replace(is_contradicted=_leans_too_little(leg, one)) for leg in one]
            for one in flown
        ]
    found = _of_flights(kept, base, densest)
    if found is None:
        assert base is not None
        return _of_base(base)
    is_one_way = bool(flown) and all(one[0].is_one_way for one in flown)
    found = replace(found, contradicted=contradicted, is_one_way=is_one_way)
    if densest is None:
        return found
    sure_m_s = found.sure_airspeed_m_s
    if sure_m_s is not None:
        # in any air
        sure_m_s = rounded(sure_m_s * math.sqrt(min(densest / SEA_LEVEL_DENSITY_KG_M3, 1.0)), 3)
    return replace(found, air_density_kg_m3=rounded(densest, 4), sure_airspeed_m_s=sure_m_s)


def _is_one_way(record: FlightRecord) -> bool:
    """Return whether the level flight of a record heads one way, in a wind that nothing tells."""
    if np.isfinite(record.airspeed_m_s).any():
        return False
    return _point_one_way(_ways(record))


def _ways(record: FlightRecord) -> list[complex]:
    """Return the directions of the level flight of a record, north and east as real and imaginary."""
    way = record.velocity_north_m_s + 1j * record.velocity_east_m_s
    means = [complex(way[part].mean()) for part in level_parts(record)]
    return [one / abs(one) for one in means]


def _point_one_way(ways: Sequence[complex]) -> bool:
    return bool(ways) and float(abs(np.mean(ways))) > _ONE_WAY


ONE_WAY = Rule(
    "I115 one-way-in-unknown-wind",
    Severity.WARNING,
    summary="All level flight of the logs heads one way, in a wind that nothing tells.",
    why="Speeds over ground count as airspeeds: with 6 m/s behind it a vehicle that holds 10 m/s is taken "
    "for one that holds 15, and flights against that wind fell.",
    how="No log holds an airspeed or a wind, nor tells a wind by its lean, and the steady level flight of "
    "each heads one way, whose wind may be another each time: the mean of its directions is longer than "
    "0.9.  The power of such a flight counts at its speed over ground less a wind of 3 m/s or so along its "
    "way, which other flights and what is usual tell.",
    fix="add a flight that goes there and back at one height",
)


def knows_wind(record: FlightRecord) -> bool:
    """Return whether a record tells speeds through the air from those over ground."""
    return bool(np.isfinite([record.airspeed_m_s, record.wind_north_m_s]).any())


def is_one_way_in_unknown_wind(record: FlightRecord) -> bool:
    """Return whether all of the speed of a record over ground may have the same wind in it."""
    return not knows_wind(record) and _point_one_way(_ways(record))


def winds_of(steady: Sequence[MeasuredPower]) -> tuple[tuple[str, ...], IntArray]:
    """Return flights one way in a wind that nothing tells, and which of them a row moves in, or -1. (n,)"""
    moving = [
        one.source if one.is_one_way and one.airspeed_m_s >= MOVING_M_S else "" for one in steady
    ]
    names = tuple(filter(None, dict.fromkeys(moving)))
    return names, np.array([names.index(one) if one else -1 for one in moving], dtype=np.intp)


def one_way_findings(records: Sequence[FlightRecord]) -> list[Finding]:
    """Return that no flight shows what of its speeds is wind."""
    flying = [one for one in records if level_parts(one)]
    if not flying or not all(map(is_one_way_in_unknown_wind, flying)):
        return []
    names = ", ".join(f"{one.source}#{one.number}" for one in flying)
    return [
        ONE_WAY.finding(
            f"{names}: one way only, and no wind known: speeds over ground count as airspeeds"
        )
    ]


def _is_contradicted(flight: Sequence[_Lean], flights: Sequence[Sequence[_Lean]]) -> bool:
    """Return whether a flight leans less than another leg of it lets it: it had the wind behind it.

    Of a flight one way than legs of others let it.
    """
    return any(
        _leans_too_little(one, others)
        for one in flight
        for others in (flights if one.is_one_way else [flight])
    )


def _leans_too_little(one: _Lean, others: Sequence[_Lean]) -> bool:
    """Return whether a leg leans less than others let it, by what its drag may be.

    It goes by the airspeed at least and by its square at most, by trims, and by how the frame is turned.
    """
    drag = (one.drag + 2.0 * _TRIM) * (1.0 if one.is_ahead else _BESIDE)
    return not one.error and any(
        drag * max(faster, faster**2) < other.drag
        for other in others
        if other.is_ahead and (faster := other.airspeed_m_s / one.airspeed_m_s)
    )


def _of_flights(
    flights: Sequence[Sequence[_Lean]], base: VehicleModel | None, air_kg_m3: float | None
) -> LeanFlight | None:
    """Return what flights show whose airspeeds are those in air of one density; ``None``: what a base has."""
    steady = [one for flight in flights for one in flight]
    ahead = [one for one in steady if one.is_ahead]
    calm = [one for one in ahead if not one.error]
    law = _DragLaw.of(calm) or _DragLaw.of(ahead) or _DragLaw.of(steady)
    exponent = _USUAL_EXPONENT if law is None else law.exponent
    held = max(
        (one for one in steady if one.is_at_limit),
        key=lambda one: one.drag / one.airspeed_m_s**exponent,
        default=None,
    )
    if held is not None and held.limit_rad is not None:
        lean_rad = math.atan(held_drag(held.limit_rad, held.times_heavier))
        found = _limited(held, lean_rad, law, _HELD_ERROR)
        air = Aloft(air_density_kg_m3=air_kg_m3)
        is_of_base = (
            base is not None
            and not _is_known_better(found, base)
            and _leans_more(base, air, found, exponent)
        )
        return None if is_of_base else found
    has_limit = base is not None and base.airspeed_limit_m_s is not None
    limited = [one for one in steady if one.limit_rad is not None]
    fastest = max(limited, default=None)
    if fastest is None or fastest.limit_rad is None:
        return None if has_limit else _UNKNOWN
    most = math.tan(fastest.limit_rad)
    if law is not None and law.error_at(most) <= _LIMIT_ERROR:
        lean_rad = min(math.atan(law.drag(fastest.airspeed_m_s)), fastest.limit_rad)
        flown = fastest._replace(airspeed_m_s=min(fastest.airspeed_m_s, law.airspeed_m_s(most)))
        found = _limited(flown, lean_rad, law, law.error_at(most))
        return None if has_limit and not _is_known_better(found, base) else found
    if has_limit:
        return None
    sure_m_s = min(_sure_m_s(flight, most) for flight in flights if flight[0].limit_rad)
    return replace(_UNKNOWN, sure_airspeed_m_s=rounded(sure_m_s, 3))


def _sure_m_s(flight: Sequence[_Lean], drag: float) -> float:
    """Return what a flight shows to be held for certain against a drag over the weight. [m s⁻¹]

    By its fastest leg, which a wind that the lean tells errs least of; where none is known, a leg with it
    leans too little: by the leg that tells the least of those about as fast.
    """
    fastest = max(flight)
    if fastest.error:
        return fastest.sure_airspeed_m_s(drag)
    near_m_s = _COMPARED * fastest.airspeed_m_s
    return min(one.sure_airspeed_m_s(drag) for one in flight if one.airspeed_m_s >= near_m_s)


def _is_known_better(found: LeanFlight, base: VehicleModel | None) -> bool:
    """Return whether flights tell the limit closer than a base model knows its own."""
    own = 0.0 if base is None else base.airspeed_limit_fraction or 0.0
    return (found.limit_fraction or 0.0) < own


def _leans_more(base: VehicleModel, air: Aloft, found: LeanFlight, exponent: float) -> bool:
    """Return whether a base model holds less airspeed at one lean, in one air, than what flights show."""
    limit_m_s = base.airspeed_limit_at(None, air)
    if limit_m_s is None or base.airspeed_limit_lean_deg is None:
        return False
    assert found.airspeed_limit_m_s is not None
    assert found.limit_lean_deg is not None
    own, shown = (
        math.tan(math.radians(lean))
        for lean in (base.airspeed_limit_lean_deg, found.limit_lean_deg)
    )
    return bool(own / limit_m_s**exponent > shown / found.airspeed_limit_m_s**exponent)


def _of_base(base: VehicleModel) -> LeanFlight:
    return LeanFlight(
        airspeed_limit_m_s=base.airspeed_limit_m_s,
        limit_lean_deg=base.airspeed_limit_lean_deg,
        drag_exponent=base.drag_exponent,
        limit_fraction=base.airspeed_limit_fraction,
        air_density_kg_m3=base.airspeed_limit_air_density_kg_m3,
    )


class _DragLaw(NamedTuple):
    """Drag by a power of the airspeed, between that of rotors and that of a body."""

    log_drag: float
    """Logarithm of the drag over the weight where that of the airspeed is ``log_airspeed``."""
    log_airspeed: float
    exponent: float
    deviation: float
    """Of the logarithm of a drag. [-]"""
    spread: float
    """Root of the sum of squares of the logarithms of the airspeeds. [-]"""
    legs: int
    wind_error: float
    """Of the airspeeds, by winds that the lean tells: all of a flight err alike. [-]"""

    @classmethod
    def of(cls, steady: Sequence[_Lean]) -> _DragLaw | None:
        """Return the law by least squares of logarithms; ``None`` of airspeeds too much alike.

        The rotors' part of the drag goes by the airspeed, that of the body by its square.
        """
        speed = np.array([one.airspeed_m_s for one in steady])
        if not len(speed) or speed.max() < _APART * speed.min():
            return None
        x, y = np.log(speed), np.log([one.drag for one in steady])
        away = x - x.mean()
        square = float(away @ away)
        exponent = float(np.clip(away @ y / square, 1.0, 2.0))
        left = y - y.mean() - exponent * away
        deviation = math.sqrt(float(left @ left) / max(len(x) - 2, 1))
        return cls(
            log_drag=float(y.mean()),
            log_airspeed=float(x.mean()),
            exponent=exponent,
            deviation=max(deviation, _DRAG_ERROR),
            spread=math.sqrt(square),
            legs=len(x),
            wind_error=math.sqrt(float(np.mean(np.square([one.error for one in steady])))),
        )

    def drag(self, airspeed_m_s: float) -> float:
        """Return the drag over the weight at an airspeed. [-]"""
        away = math.log(airspeed_m_s) - self.log_airspeed
        return math.exp(self.log_drag + self.exponent * away)

    def airspeed_m_s(self, drag: float) -> float:
        """Return the airspeed of a drag over the weight. [m s⁻¹]"""
        return math.exp(self.log_airspeed + (math.log(drag) - self.log_drag) / self.exponent)

    def error_at(self, drag: float) -> float:
        """Return how far, relative, that airspeed may be off: a standard error. [-]"""
        away = math.log(self.airspeed_m_s(drag)) - self.log_airspeed
        leverage = math.sqrt(1.0 / self.legs + (away / self.spread) ** 2)
        return math.hypot(self.deviation / self.exponent * leverage, self.wind_error)


def _limited(flown: _Lean, lean_rad: float, law: _DragLaw | None, error: float) -> LeanFlight:
    wind_m_s = 0.0
    if flown.is_one_way or flown.is_contradicted:
        wind_m_s = UNTOLD_WIND_M_S
    elif flown.is_one_way_at_limit:
        wind_m_s = _BREEZE_M_S
    untold = wind_m_s / flown.airspeed_m_s
    return LeanFlight(
        airspeed_limit_m_s=rounded(flown.airspeed_m_s, 4),
        limit_lean_deg=rounded(math.degrees(lean_rad), 4),
        drag_exponent=None if law is None else rounded(law.exponent, 3),
        limit_fraction=min(rounded(math.hypot(error, flown.error, untold), 2), _MOST_ERROR),
    )


def leant_wind_m_s(record: FlightRecord) -> float:
    """Return the speed of the wind of a record that its lean tells; 0 where none does. [m s⁻¹]"""
    if not any(row.found_in == LEANT_WIND for row in record.quantities):
        return 0.0
    return float(
        np.hypot(np.nanmax(np.abs(record.wind_north_m_s)), np.nanmax(np.abs(record.wind_east_m_s)))
    )


def level_parts(record: FlightRecord) -> list[slice]:
    """Return the second halves of the steady level flights of a record whose lean is known."""
    steady = (
        is_steady(record)
        & np.isfinite(record.roll_deg)
        & np.isfinite(record.pitch_deg)
        & (speed_through_air_m_s(record) > MOVING_M_S)
        & (np.abs(climb_rate_m_s(record)) < _LEVEL_M_S)
    )
    return [
        slice((start + end) // 2, end)
        for start, end in zip(*map(np.ndarray.tolist, run_bounds(steady)), strict=True)
        if steady[start] and (end - start) * record.step_s >= _SHORTEST_S
    ]


def _steady(record: FlightRecord, times_heavier: float) -> Iterator[_Lean]:
    legs = list(_legs(record, times_heavier))
    wind_m_s = leant_wind_m_s(record)
    error_m_s = 0.0
    if legs and wind_m_s > 0.0:
        # what another trim takes or gives of airspeed, by the slope of the drag
        by_trim = float(np.mean([one.airspeed_m_s / one.drag for one in legs]))
        by_trim *= _TRIM * times_heavier / _USUAL_EXPONENT
        error_m_s = math.hypot(_WIND_ERROR * wind_m_s, by_trim)
    is_one_way = _is_one_way(record)
    at_limit = [cmath.rect(1.0, one.course_rad) for one in legs if one.is_at_limit]
    is_breezy = not knows_wind(record) and _point_one_way(at_limit)
    for one in legs:
        yield one._replace(
            error=error_m_s / one.airspeed_m_s, is_one_way=is_one_way, is_one_way_at_limit=is_breezy
        )


def _legs(record: FlightRecord, times_heavier: float) -> Iterator[_Lean]:
    """Yield the steady level flight of a record, as if its wind were known."""
    limit_rad, lean_rad = _lean_angle_max_rad(record), _lean_rad(record)
    airspeed = speed_through_air_m_s(record)
    east, north = record.velocity_east_m_s, record.velocity_north_m_s
    course_rad = np.arctan2(east, north)
    turned = np.exp(1j * (np.radians(record.yaw_deg) - course_rad))
    beside = np.abs(np.angle(turned))
    is_blown = leant_wind_m_s(record) > 0.0
    for part in level_parts(record):
        if is_blown and not np.isfinite(record.wind_north_m_s[part]).all():
            continue  # at another height, in a wind that nobody knows
        gained_m_s2 = float(np.polyfit(record.time_s[part], airspeed[part], 1)[0])
        mean_rad = float(lean_rad[part].mean())
        drag = held_drag(mean_rad, times_heavier) - gained_m_s2 / GRAVITY_M_S2 * times_heavier
        if drag > 0.0:
            yield _Lean(
                airspeed_m_s=float(airspeed[part].mean()),
                drag=drag,
                times_heavier=times_heavier,
                lean_rad=mean_rad,
                limit_rad=limit_rad,
                error=0.0,
                is_ahead=not beside[part].mean() > _AHEAD_RAD,
                course_rad=math.atan2(*(float(one[part].mean()) for one in (east, north))),
            )


def is_at_lean_limit(record: FlightRecord) -> BoolArray:
    """Return where a vehicle leans as far as it may: its speed is that of the lean, whatever is commanded."""
    limit_rad = _lean_angle_max_rad(record)
    if limit_rad is None:
        return np.zeros(record.time_s.size, np.bool_)
    return np.abs(_lean_rad(record) - limit_rad) < _NEAR_RAD


def _lean_rad(record: FlightRecord) -> FloatArray:
    roll, pitch = np.radians(record.roll_deg), np.radians(record.pitch_deg)
    return np.asarray(np.arccos(np.cos(roll) * np.cos(pitch)))


def _lean_angle_max_rad(record: FlightRecord) -> float | None:
    """Return the greatest lean angle of a flight by its parameters."""
    own, px4 = parameter_table(ArduPilotParameters), parameter_table(Px4Parameters)
    limits = (own["lean_angle_max_rad"], own["attitude_lean_max_rad"], px4["lean_angle_max_rad"])
    for row in limits:
        for spelling in row.spellings:
            if record.parameters.get(spelling.name, 0.0) > 0.0:
                return spelling.si(record.parameters[spelling.name])
    return None
