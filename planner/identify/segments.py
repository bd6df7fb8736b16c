"""Segments of a flight: its states, its steady flight, and what each of them was used for.

States are the eight of the article's Figure 1, ground time left out.  Climb and descent are found by the
motion, and so is horizontal flight, unless the record has the speed reference that an autopilot shaped:
that separates accelerating, cruising and braking without noise.  Thresholds have a hysteresis, those of
climbs grow with the wobble of the height; what is shorter than a second belongs to what was before it.
"""

from __future__ import annotations

import math
from collections import Counter
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, STATES, FlightState
from planner.identify.uncertainty import Estimate, mean_with_error
from planner.physics.atmosphere import (
    SEA_LEVEL_DENSITY_KG_M3,
    air_density_kg_m3,
    standard_temperature_c,
)
from planner.physics.rotor import Acceleration
from planner.values import Value, field_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.logs.record import FlightRecord


class FitStatus(StrEnum):
    """What became of a state."""

    IDENTIFIED = "identified"
    """The flights show it."""
    BASE = "base"
    """The flights do not show it: taken from the base model."""
    LEFT_OUT = "left-out"
    """The flights do not show it, and no base model does."""


class FlightPart(Value):
    """A part of a flight."""

    log: str
    """File name."""
    flight: int
    """Which flight of the log, from 1."""
    start_s: float
    """In the flight. [s]"""
    duration_s: float

    @classmethod
    def within(cls, record: FlightRecord, **fields: Any) -> Self:  # noqa: ANN401 - of the class
        """Return a part of a record: the whole flight, where times are left out."""
        whole = {"start_s": 0.0, "duration_s": record.duration_s}
        return cls(log=record.source, flight=record.number, **whole | fields)


class SegmentUse(FlightPart):
    """A part of a flight, and what it was used for."""

    what: str
    """The state, and how far or fast: ``climb 100 m``."""
    refusal: str = ""
    """Why it was not used; empty where it was."""
    is_held_out: bool = False
    """Whether the fit that is tested was made without it."""
    fit_percent: float | None = None
    """How well the model describes it. [%]"""

    @classmethod
    def of(cls, part: FlightPart, what: str, **use: Any) -> SegmentUse:  # noqa: ANN401 - fields
        """Return what became of a part of a flight."""
        place = {name: getattr(part, name) for name in field_names(FlightPart)}
        return cls(**place, what=what, **use)

    @property
    def is_used(self) -> bool:
        """Whether the model rests on it, or was tested on it."""
        return not self.refusal


class StateOutcome(Value):
    """What was found about one state."""

    name: str
    """``altitude``, ``speed``, ``climb_power`` …, ``hover``, ``cruise``, ``vertical``, ``battery``."""
    status: FitStatus = FitStatus.IDENTIFIED
    summary: str
    """What was identified by which law, or why it was not."""
    unit: str = ""
    """Of the residuals."""
    estimates: tuple[Estimate, ...] = ()
    segments: tuple[SegmentUse, ...] = ()
    """Every span that was looked at."""
    fit_percent: float | None = None
    """On segments held out, by a fit without them. [%]"""
    rms: float | None = None
    """Root mean square of the residuals of those. [unit]"""
    whiteness: float | None = None
    """Median chance that white noise has residuals of such a memory. [-]"""
    not_shown: tuple[str, ...] = ()
    """Names of the numbers whose standard errors exceed them, which are taken as usual or as nothing."""
    refined: StateOutcome | None = None
    """The same by output error, beside what ARX found; ``None``: this is the default's."""

    @classmethod
    def left_out(cls, name: str, why: str, segments: Sequence[SegmentUse] = ()) -> StateOutcome:
        """Return the outcome of a state that the flights do not show."""
        return cls(name=name, status=FitStatus.LEFT_OUT, summary=why, segments=tuple(segments))

    @property
    def used(self) -> int:
        """Number of segments the model rests on."""
        return sum(s.is_used for s in self.segments)

    @property
    def held_out(self) -> int:
        """Number of segments the model was tested on."""
        return sum(s.is_held_out for s in self.segments)

    def refusals(self) -> tuple[tuple[str, int], ...]:
        """Return the reasons for which segments were not used, each with their number."""
        return tuple(Counter(s.refusal for s in self.segments if s.refusal).most_common())


_VERTICAL_M_S = (0.15, 0.3)
_HORIZONTAL_M_S = (0.5, 1.0)
_ACCELERATION_M_S2 = (0.15, 0.3)
"""Where a motion ends, and where it begins: the hysteresis."""
_LEVEL_M_S = 1.0
"""Climb rates below it are wobble for the most part."""
_QUIET_M_S = 0.1
"""Wobble of the climb rate, a standard deviation, from which on its limits grow in proportion."""
_WIDEST = 3.0
"""Most that they grow: landings are as slow as 1 m/s. [-]"""
_SLOPE_S = 3.0
"""Window of a slope: noise of 0.3 m at 10 Hz leaves 0.06 m/s."""
_SHORTEST_S = 1.0
_GROUND_S = 3.0
"""A climb that begins this soon after the ground is a take-off, a descent that ends there a landing."""
_CONTACT_S = 10.0
"""Spinning up before a take-off and waiting for the ground to be noticed take no longer."""
_STEPPED = 0.5
"""Fraction of its range by which a reference that is not shaped jumps from sample to sample. [-]"""
_KNOWN = 0.9
"""Fraction of the flight a column must be known for. [-]"""


class StateSegment(Value):
    """A span of one flight state."""

    state: FlightState
    first: int
    """Its first sample in the record."""
    end: int
    """The sample after its last."""
    start_s: float
    """Time of the first sample in the record. [s]"""
    duration_s: float
    """[s]"""

    @property
    def samples(self) -> slice:
        """Its part of every column of the record."""
        return slice(self.first, self.end)


def find_states(
    record: FlightRecord, *, as_of: FlightRecord | None = None
) -> tuple[StateSegment, ...]:
    """Find the flight states of a record.

    With ``as_of`` a flight and its prediction are cut alike: by the motion alone, climbs by the limits
    that the wobble of that flight asks for.

    Time on the ground, and time at which neither height nor speed is known, belongs to none.
    """
    climb, speed, acceleration = _motion(record, has_reference=as_of is None)
    flying = ~record.is_landed & np.isfinite(climb) & np.isfinite(speed)
    states = np.full(flying.size, -1, dtype=np.int64)
    states[flying] = STATE_INDEX[FlightState.HOVER]
    horizontal = _with_hysteresis(speed, _HORIZONTAL_M_S)
    states[flying & horizontal] = STATE_INDEX[FlightState.CRUISE]
    gaining = _with_hysteresis(acceleration, _ACCELERATION_M_S2)
    losing = _with_hysteresis(-acceleration, _ACCELERATION_M_S2)
    moving = flying & (horizontal | (speed > _HORIZONTAL_M_S[0]))
    states[moving & gaining] = STATE_INDEX[FlightState.ACCELERATE]
    states[moving & losing] = STATE_INDEX[FlightState.BRAKE]
    limits = _vertical_limits_m_s(climb[flying])
    if as_of is not None:
        wobbling, _, _ = _motion(as_of, has_reference=False)
        limits = _vertical_limits_m_s(wobbling[~as_of.is_landed & np.isfinite(wobbling)])
    states[flying & _with_hysteresis(climb, limits)] = STATE_INDEX[FlightState.CLIMB]
    states[flying & _with_hysteresis(-climb, limits)] = STATE_INDEX[FlightState.DESCEND]
    states = _without_short_runs(states, round(_SHORTEST_S / record.step_s))
    _join_ground_contact(states, record)
    return _segments(record, states)


def _vertical_limits_m_s(climb_m_s: FloatArray) -> tuple[float, float]:
    """Return where a climb ends and begins: beyond what the height wobbles by in this flight."""
    level = np.abs(climb_m_s)[np.abs(climb_m_s) < _LEVEL_M_S]
    # the median absolute deviation of normal wobble is 0.6745 of its standard deviation
    wobble = float(np.median(level)) / 0.6745 if level.size else 0.0
    scale = min(max(wobble / _QUIET_M_S, 1.0), _WIDEST)
    return scale * _VERTICAL_M_S[0], scale * _VERTICAL_M_S[1]


def _motion(
    record: FlightRecord, *, has_reference: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    window = round(_SLOPE_S / record.step_s)
    if _known_fraction(record.climb_m_s, record.is_landed) >= _KNOWN:
        climb = _mean(record.climb_m_s, window)
    else:
        climb = slope_per_s(record.height_above_home_m, window, record.step_s)
    if has_reference and _is_shaped(record.reference_speed_m_s, record.is_landed):
        speed = record.reference_speed_m_s
        acceleration = np.gradient(speed, record.step_s)
    else:
        measured = record.ground_speed_m_s
        known, known_in_air = (
            _known_fraction(speed, record.is_landed) for speed in (measured, record.airspeed_m_s)
        )
        if known < min(_KNOWN, known_in_air):
            measured = record.airspeed_m_s
        speed = _mean(measured, round(window / 3))
        acceleration = slope_per_s(measured, window, record.step_s)
    return climb, speed, acceleration


def _known_fraction(column: FloatArray, is_landed: BoolArray) -> float:
    airborne = column[~is_landed]
    return float(np.isfinite(airborne).mean()) if airborne.size else 0.0


def _is_shaped(reference: FloatArray, is_landed: BoolArray) -> bool:
    """Whether a reference is known throughout and changes gradually."""
    if _known_fraction(reference, is_landed) < _KNOWN:
        return False
    known = reference[np.isfinite(reference) & ~is_landed]
    height = float(np.ptp(known))
    return height > 0.0 and float(np.abs(np.diff(known)).max()) < _STEPPED * height


def slope_per_s(column: FloatArray, window: int, step_s: float) -> FloatArray:
    """Slope of a straight line through the samples around each.

    NaN where a sample is not known; towards the ends as at the last full window. The window is made
    odd.
    """
    half = min(window // 2, (column.size - 1) // 2)
    if half < 1:
        return np.zeros(column.size)
    lags = np.arange(-half, half + 1)
    weights = lags / float(lags @ lags) / step_s
    inner = np.convolve(column, weights[::-1], mode="valid")
    return np.pad(inner, half, mode="edge")


def smoothed(column: FloatArray, window: int) -> FloatArray:
    """Mean of the samples around each, over fewer towards the ends."""
    weights = np.ones(2 * (window // 2) + 1)
    counts = np.convolve(np.ones(column.size), weights, mode="same")
    return np.convolve(column, weights, mode="same") / counts


def _mean(column: FloatArray, window: int) -> FloatArray:
    half = min(window // 2, (column.size - 1) // 2)
    weights = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    return np.pad(np.convolve(column, weights, mode="valid"), half, mode="edge")


def _with_hysteresis(values: FloatArray, limits: tuple[float, float]) -> BoolArray:
    """Where values are above the lower limit in a span that reaches the upper one."""
    low, high = limits
    above = np.nan_to_num(values, nan=-np.inf) > low
    starts, ends = run_bounds(above)
    found = np.zeros(values.size, dtype=np.bool_)
    for start, end in zip(starts, ends, strict=True):
        if above[start] and np.max(values[start:end]) > high:
            found[start:end] = True
    return found


def run_bounds(values: npt.NDArray[np.generic]) -> tuple[IntArray, IntArray]:
    """First samples, and samples after the last, of the runs of equal values."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.concatenate([[0], changes]), np.concatenate([changes, [values.size]])


def _without_short_runs(states: IntArray, shortest: int) -> IntArray:
    """Give runs that are too short to what was before them, or after them at the start."""
    cleaned = states.copy()
    starts, ends = run_bounds(states)
    for start, end in zip(starts, ends, strict=True):
        if cleaned[start] < 0 or end - start >= shortest:
            continue
        if start > 0 and cleaned[start - 1] >= 0:
            cleaned[start:end] = cleaned[start - 1]
        elif end < states.size and states[end] >= 0:
            cleaned[start:end] = states[end]
    return cleaned


def _join_ground_contact(states: IntArray, record: FlightRecord) -> None:
    """Give the moment of spinning up to the take-off, that of touching down to the landing."""
    near, longest = round(_GROUND_S / record.step_s), round(_CONTACT_S / record.step_s)
    is_landed, hover = record.is_landed, STATE_INDEX[FlightState.HOVER]
    starts, ends = run_bounds(states)
    for start, end in zip(starts, ends, strict=True):
        if states[start] != hover or end - start > longest:
            continue
        climbs = end < states.size and states[end] == STATE_INDEX[FlightState.CLIMB]
        descended = start > 0 and states[start - 1] == STATE_INDEX[FlightState.DESCEND]
        if climbs and is_landed[max(start - near, 0) : start].any():
            states[start:end] = states[end]
        elif descended and is_landed[end : end + near].any():
            states[start:end] = states[start - 1]


def _segments(record: FlightRecord, states: IntArray) -> tuple[StateSegment, ...]:
    """Join runs to segments; a climb from the ground is a take-off, a descent to it a landing."""
    near = round(_GROUND_S / record.step_s)
    found: list[StateSegment] = []
    starts, ends = run_bounds(states)
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if states[start] < 0:
            continue
        state = STATES[states[start]]
        if state is FlightState.CLIMB and record.is_landed[max(start - near, 0) : start].any():
            state = FlightState.TAKEOFF
        elif state is FlightState.DESCEND and record.is_landed[end : end + near].any():
            state = FlightState.LAND
        found.append(
            StateSegment(
                state=state,
                first=start,
                end=end,
                start_s=float(record.time_s[start]),
                duration_s=(end - start) * record.step_s,
            )
        )
    return tuple(found)


_STRAIGHT = math.cos(math.radians(10.0))
"""Of the way flown, what lies ahead where the vehicle does not turn. [-]"""


def speed_through_air_m_s(record: FlightRecord) -> FloatArray:
    """Horizontal airspeed of a record where it is known, else its ground speed (n,) [m/s]."""
    is_known = bool(np.isfinite(record.airspeed_m_s).any())
    return record.airspeed_m_s if is_known else record.ground_speed_m_s


def speed_over_ground_m_s(record: FlightRecord) -> FloatArray:
    """Horizontal ground speed of a record where it is known, else its airspeed (n,) [m/s]."""
    is_known = bool(np.isfinite(record.ground_speed_m_s).any())
    return record.ground_speed_m_s if is_known else record.airspeed_m_s


def speed_along_m_s(record: FlightRecord, part: slice) -> FloatArray:
    """Return the velocity along its way in part of a record, as commands of speed are (n,) [m/s].

    Unlike its length, a velocity along the way is not raised by noise at rest, and is negative where the
    vehicle swings back.  Where it turns, or its direction is not known, the length is all there is; where no
    velocity over ground is, the airspeed.
    """
    velocity = np.stack([record.velocity_north_m_s[part], record.velocity_east_m_s[part]])
    if not np.isfinite(velocity).all():
        return speed_over_ground_m_s(record)[part]
    lengths = np.asarray(np.hypot(*velocity))
    fast = lengths >= 0.5 * lengths.max()
    ahead = velocity[:, fast].sum(axis=1)
    length = float(np.hypot(*ahead))
    if not length > _STRAIGHT * lengths[fast].sum():
        return lengths
    return np.asarray(ahead / length @ velocity)


def climb_rate_m_s(record: FlightRecord) -> FloatArray:
    """Climb rate of a record where it is known, else by the slope of its height (n,) [m/s]."""
    if np.isfinite(record.climb_m_s).any():
        return record.climb_m_s
    return slope_per_s(record.height_above_home_m, round(_SLOPE_S / record.step_s), record.step_s)


def record_air_density_kg_m3(
    record: FlightRecord, *, home_temperature_c: float | None = None
) -> FloatArray:
    """Density of the air along a record.

    The temperature at home, left out, is that of the standard atmosphere there. NaN where no height
    is known. (n,)
    """
    home_amsl_m = record.home.altitude_amsl_m or 0.0
    altitude = record.altitude_amsl_m
    if not np.isfinite(altitude).any():
        altitude = record.height_above_home_m + home_amsl_m
    temperature_c = (
        standard_temperature_c(home_amsl_m) if home_temperature_c is None else home_temperature_c
    )
    return air_density_kg_m3(altitude, home_amsl_m=home_amsl_m, home_temperature_c=temperature_c)


def mean_air_density_kg_m3(density_kg_m3: FloatArray) -> float:
    """Return the mean of densities along a record; the sea level's where no height is known. [kg m⁻³]"""
    known = density_kg_m3[np.isfinite(density_kg_m3)]
    return float(known.mean()) if known.size else SEA_LEVEL_DENSITY_KG_M3


_SETTLING_S = 5.0
"""Taken off the beginning of a steady span, where the power of the manoeuvre before it rings."""
_SHORTEST_STEADY_S = 5.0
_HEIGHT_RANGE_M = 2.0
_SPEED_RANGE_M_S = 2.0
"""Largest difference between the 5th and the 95th percentile in a span that counts as steady."""


_STANDING_M_S = 0.1
"""Slower it has no direction. [m s⁻¹]"""
_PART_S = 1.0
"""Noise of a velocity over so long is none of an acceleration. [s]"""


def flown_parts(record: FlightRecord, part: BoolArray) -> tuple[FlownPart, ...]:
    """Return the whole seconds of part of a record; none where it does not hold velocities."""
    count = round(_PART_S / record.step_s)
    rows = np.flatnonzero(part)
    columns = (
        speed_through_air_m_s(record),
        climb_rate_m_s(record),
        record.velocity_north_m_s,
        record.velocity_east_m_s,
    )
    found = []
    for first in range(0, rows.size - count, count):
        span = slice(int(rows[first]), int(rows[first]) + count + 1)
        own = np.stack([column[span] for column in columns])
        if own.shape[1] != count + 1 or not np.isfinite(own).all():
            continue
        airspeed, climb, north, east = own.mean(axis=1)
        up, *change = (own[1:, -1] - own[1:, 0]) / _PART_S
        size = max(math.hypot(north, east), _STANDING_M_S)
        along = (change[0] * north + change[1] * east) / size
        across = math.sqrt(max(change[0] ** 2 + change[1] ** 2 - along**2, 0.0))
        found.append(FlownPart(*map(float, (airspeed, climb, along, across, up))))
    return tuple(found)


def flown_acceleration(record: FlightRecord) -> Acceleration:
    """Return how the velocity of a record changes, seen along its track; 0 where it is not known. (n,)"""
    window = round(_PART_S / record.step_s)
    north, east = record.velocity_north_m_s, record.velocity_east_m_s
    up, *change = (
        slope_per_s(column, window, record.step_s)
        for column in (climb_rate_m_s(record), north, east)
    )
    size = np.maximum(np.hypot(north, east), _STANDING_M_S)
    along = (change[0] * north + change[1] * east) / size
    across = (change[1] * north - change[0] * east) / size
    return Acceleration(*map(np.nan_to_num, (along, across, up)))


class FlownPart(NamedTuple):
    """How a vehicle moved for a second of a manoeuvre, in the mean."""

    airspeed_m_s: float
    climb_rate_m_s: float
    along_m_s2: float
    """Acceleration along the track. [m s⁻²]"""
    across_m_s2: float
    up_m_s2: float


class MeasuredPower(Value):
    """Mean power over steady flight at one height and speed, or over a manoeuvre."""

    power_w: float
    """Mean electrical power. [W]"""
    error_w: float
    """Standard error of the mean, memory of the noise counted. [W]"""
    duration_s: float
    """Time it was measured for. [s]"""
    height_above_home_m: float
    """Mean height. [m]"""
    airspeed_m_s: float = 0.0
    """Mean horizontal airspeed. [m/s]"""
    climb_rate_m_s: float = 0.0
    """Mean climb rate, descent negative. [m/s]"""
    air_density_kg_m3: float | None = None
    """Mean air density, where it is known. [kg m⁻³]"""
    mass_kg: float | None = None
    """Mass that flew, where it is known. [kg]"""
    source: str = ""
    """Name of the log and number of the flight, ``log#1``."""
    start_s: float = 0.0
    """When it begins, in the flight. [s]"""
    is_one_way: bool = False
    """Whether its flight heads one way in a wind that nothing tells: the airspeed is that over ground."""
    parts: tuple[FlownPart, ...] = ()
    """Seconds of a manoeuvre: the mean power of what changes is not the power of the mean."""

    @classmethod
    def over(cls, record: FlightRecord, part: slice | BoolArray, **flown: Any) -> MeasuredPower:  # noqa: ANN401 - fields
        """Return the mean power over part of a record, where it is known throughout."""
        power_w, error_w = mean_with_error([record.power_w[part]])
        source = f"{record.source}#{record.number}"
        return cls(power_w=power_w, error_w=error_w, source=source, **flown)


class SteadySpan(Value):
    """A hover or cruise of a record, and the mean power it gives, if any."""

    segment: StateSegment
    power: MeasuredPower | None
    refusal: str = ""
    """Why it gives none; empty where it does."""


def steady_spans(
    record: FlightRecord, segments: Sequence[StateSegment], *, settling_s: float = _SETTLING_S
) -> tuple[SteadySpan, ...]:
    """Mean powers of the hovers and cruises of a record.

    Every hover and cruise, used or refused; ``settling_s`` is left out at the beginning of each.
    """
    found = []
    airspeed = speed_through_air_m_s(record)
    for segment in segments:
        if segment.state not in {FlightState.HOVER, FlightState.CRUISE}:
            continue
        part = slice(segment.first + round(settling_s / record.step_s), segment.end)
        refusal = _unsteadiness(record, segment, part)
        power: MeasuredPower | None = None
        if not refusal:
            is_hover = segment.state is FlightState.HOVER
            power = MeasuredPower.over(
                record,
                part,
                duration_s=record.step_s * (part.stop - part.start),
                height_above_home_m=float(record.height_above_home_m[part].mean()),
                airspeed_m_s=0.0 if is_hover else float(airspeed[part].mean()),
            )
        found.append(SteadySpan(segment=segment, power=power, refusal=refusal))
    return tuple(found)


def _unsteadiness(record: FlightRecord, segment: StateSegment, part: slice) -> str:
    """Why the power over a span is no steady power; empty where it is."""
    if (part.stop - part.start) * record.step_s < _SHORTEST_STEADY_S:
        return f"lasts {segment.duration_s:.1f} s: too short to settle and to average"
    if not np.isfinite(record.power_w[part]).all():
        return "the log does not hold the power throughout"
    speed = speed_through_air_m_s(record)[part]
    if not np.isfinite([record.height_above_home_m[part], speed]).all():
        return "the log does not hold height and speed throughout"
    if np.ptp(np.percentile(record.height_above_home_m[part], (5, 95))) > _HEIGHT_RANGE_M:
        return "the height is not steady"
    if np.ptp(np.percentile(speed, (5, 95))) > _SPEED_RANGE_M_S:
        return "the speed is not steady"
    return ""


_STEADY_M_S2 = 0.3
"""Mean acceleration over that below which flight is steady: gusts shake a vehicle by more than this."""
_FLIGHT_SETTLING_S = 1.5
"""Taken off the beginning of a span: the rotors still answer what was before it. [s]"""
_SHORTEST_FLIGHT_S = 3.0
_LONGEST_S = 20.0
"""Longer spans are cut: height, wind and density change over them. [s]"""
_GROUND_EFFECT_S = 3.0
"""Left out after lift-off and before touch-down: the ground carries part of the weight. [s]"""


def steady_flight(
    record: FlightRecord,
    *,
    air_density_kg_m3: FloatArray,
    mass_kg: float | None = None,
    is_one_way: bool = False,
) -> tuple[MeasuredPower, ...]:
    """Mean powers of all steady flight of a record, which may head one way in a wind that nothing tells.

    In the order flown; none where the log holds no power or no motion.
    """
    airspeed = speed_through_air_m_s(record)
    climb = climb_rate_m_s(record)
    columns = np.stack([record.power_w, airspeed, climb, air_density_kg_m3])
    steady = np.isfinite(columns).all(axis=0) & is_steady(record)
    found = []
    settling, longest = round(_FLIGHT_SETTLING_S / record.step_s), round(_LONGEST_S / record.step_s)
    for start, end in zip(*run_bounds(steady), strict=True):
        if not steady[start]:
            continue
        pieces = max(1, round((end - start - settling) / longest))
        edges = np.linspace(start + settling, end, pieces + 1).astype(int)
        for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            if (last - first) * record.step_s < _SHORTEST_FLIGHT_S:
                continue
            part = slice(first, last)
            found.append(
                MeasuredPower.over(
                    record,
                    part,
                    duration_s=(last - first) * record.step_s,
                    height_above_home_m=float(np.nanmean(record.height_above_home_m[part])),
                    airspeed_m_s=float(airspeed[part].mean()),
                    climb_rate_m_s=_mean_climb_m_s(record, climb, part),
                    air_density_kg_m3=float(air_density_kg_m3[part].mean()),
                    mass_kg=mass_kg,
                    start_s=float(record.time_s[first]),
                    is_one_way=is_one_way,
                )
            )
    return tuple(found)


def is_steady(record: FlightRecord) -> BoolArray:
    """Return where a record is in flight, clear of the ground, without acceleration. (n,)"""
    acceleration = _acceleration_m_s2(record, climb_rate_m_s(record))
    return np.asarray(_is_clear_of_ground(record) & (acceleration < _STEADY_M_S2))


def _mean_climb_m_s(record: FlightRecord, climb_m_s: FloatArray, part: slice) -> float:
    """Mean climb rate by the heights where they are known: climb rates are often biased in cruise."""
    heights = record.height_above_home_m[part]
    if not np.isfinite(heights).all():
        return float(climb_m_s[part].mean())
    return float(np.polyfit(record.time_s[part], heights, 1)[0])


def _acceleration_m_s2(record: FlightRecord, climb_m_s: FloatArray) -> FloatArray:
    """Magnitude of the acceleration over ground; of the speed where the velocity is not known."""
    window = round(_SLOPE_S / record.step_s)
    columns = [record.velocity_north_m_s, record.velocity_east_m_s]
    if not np.isfinite(columns).any(axis=1).all():
        columns = [speed_through_air_m_s(record)]
    slopes = [slope_per_s(column, window, record.step_s) for column in (*columns, climb_m_s)]
    magnitude: FloatArray = np.sqrt(np.sum(np.square(slopes), axis=0))
    return np.where(np.isfinite(magnitude), magnitude, np.inf)


def _is_clear_of_ground(record: FlightRecord) -> BoolArray:
    """Where the vehicle is not on the ground, nor was or will be in a moment."""
    kernel = np.ones(2 * round(_GROUND_EFFECT_S / record.step_s) + 1)
    return np.convolve(record.is_landed, kernel, mode="same")[: record.time_s.size] < 0.5
