"""Motion as pieces in closed form: where the vehicle is, how fast, at any time.

Each piece follows one law over its own time.  Laws are columns, an array per parameter, so that 10,000
pieces cost array arithmetic; they are sampled only for plots and traces.
"""

from __future__ import annotations

from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from planner.physics.quadrature import unit_derivative, unit_quadrature
from planner.values import Value, field_names, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding

# Gauss-Legendre on [0, 1]: exact to degree 7; against 32 nodes within 1e-5 on the sample missions.
QUADRATURE_POINTS = 4
QUADRATURE_NODES, QUADRATURE_WEIGHTS = unit_quadrature(QUADRATURE_POINTS)
# In shorter pieces the rounding of speeds, 1e-14 m/s, would pass for an acceleration. [s]
SHORTEST_CHANGE_S = 1e-6


def horizontal(vectors: FloatArray) -> FloatArray:
    """Return the horizontal lengths of vectors that begin with east and north. (…,)"""
    return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))


def lengths(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors. (…,)"""
    return np.asarray(np.sqrt(dot(vectors, vectors)))


def dot(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the scalar products of vectors. (…,)"""
    # By their components: sums along a last axis of two or three take five times as long.
    product: FloatArray = one[..., 0] * other[..., 0]
    for axis in range(1, one.shape[-1]):
        product = product + one[..., axis] * other[..., axis]
    return product


def greatest(vectors: FloatArray) -> FloatArray:
    """Return the greatest component of vectors. (…,)"""
    # As of `dot`: `max` along the last axis takes fifteen times as long.
    most: FloatArray = vectors[..., 0]
    for axis in range(1, vectors.shape[-1]):
        most = np.maximum(most, vectors[..., axis])
    return most


def summed(vectors: FloatArray) -> FloatArray:
    """Return the sums of the components of vectors. (…,)"""
    total: FloatArray = vectors[..., 0]  # as of `dot`
    for axis in range(1, vectors.shape[-1]):
        total = total + vectors[..., axis]
    return total


def is_nonzero(vectors: FloatArray) -> BoolArray:
    """Return whether any component of vectors is not zero. (…,)"""
    return np.asarray(greatest(np.abs(vectors)) != 0.0)


def rows_of(mask: BoolArray | IntArray | FloatArray) -> IntArray:
    """Return the rows in which a mask of one axis holds, or a number is not zero."""
    return mask.nonzero()[0]  # `np.flatnonzero` takes ten times as long of few rows


def clipped(values: FloatArray, least: FloatArray | float, most: FloatArray | float) -> FloatArray:
    """Return values between bounds."""
    # `np.clip` takes twice as long of few rows.
    return np.asarray(np.minimum(np.maximum(values, least), most))


_divide = np.errstate(all="ignore")(np.divide)  # of the quotients that are not taken


def quotient(
    numerator: FloatArray | float,
    denominator: FloatArray,
    otherwise: FloatArray | float = 0.0,
    *,
    above: float = 0.0,
) -> FloatArray:
    """Return quotients where the denominator is ``above`` a number, another value elsewhere."""
    # Of what no vehicle flies a quotient may be infinite, and is reported as that.
    quotients, is_one = _divide(numerator, denominator), np.asarray(denominator > above)
    if quotients.shape != is_one.shape or not is_one.shape or not isinstance(otherwise, float):
        return np.where(is_one, quotients, otherwise)
    quotients[~is_one] = otherwise  # as `np.where`, in half of its time
    return np.asarray(quotients)


class KinematicState(Value, eq=False):
    """Where a vehicle is and how it moves, in the frame of its home; all of one shape."""

    east_m: FloatArray
    north_m: FloatArray
    height_m: FloatArray
    """Height above home. [m]"""
    east_m_s: FloatArray
    north_m_s: FloatArray
    climb_m_s: FloatArray

    @property
    def ground_speed_m_s(self) -> FloatArray:
        """Horizontal speed over ground. [m s⁻¹]"""
        return np.asarray(np.sqrt(self.east_m_s**2 + self.north_m_s**2))

    @property
    def place_m(self) -> FloatArray:
        """East, north and height beside each other. (…, 3) [m]"""
        return np.stack((self.east_m, self.north_m, self.height_m), axis=-1)

    @property
    def velocity_m_s(self) -> FloatArray:
        """East, north and up beside each other. (…, 3) [m s⁻¹]"""
        return np.stack((self.east_m_s, self.north_m_s, self.climb_m_s), axis=-1)

    def select(self, rows: slice) -> KinematicState:
        """Return some of them."""
        columns = field_values(self).items()
        return KinematicState(**{name: column[rows] for name, column in columns})

    def of_shape(self, shape: tuple[int, ...]) -> KinematicState:
        """Return the same, what does not change in time repeated."""
        columns = field_values(self)
        uneven = {name for name, column in columns.items() if column.shape != shape}
        return replace(self, **{name: np.broadcast_to(columns[name], shape) for name in uneven})

    @classmethod
    def of(
        cls, place_m: Iterable[FloatArray], velocity_m_s: Iterable[FloatArray]
    ) -> KinematicState:
        """Return the state at east, north, height, moving east, north and up."""
        east_m, north_m, height_m = place_m
        east_m_s, north_m_s, climb_m_s = velocity_m_s
        return cls(
            east_m=east_m,
            north_m=north_m,
            height_m=height_m,
            east_m_s=east_m_s,
            north_m_s=north_m_s,
            climb_m_s=climb_m_s,
        )


class MotionLaw(Protocol):
    """One law of motion, for many pieces at once."""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of piece ``row`` at its own time; both broadcast together.

        What does not change with time may keep the shape of ``row``.
        """
        ...


class Columns(Value, eq=False):
    """Arrays whose first axis counts the same rows, further columns of these rows, or what all share."""

    def select(self, rows: IntArray | BoolArray) -> Self:
        """Return some of the rows."""
        rows = rows_of(rows) if rows.dtype == np.bool_ else rows
        chosen: dict[str, Any] = {}
        for name in field_names(self):
            value = getattr(self, name)
            if isinstance(value, np.ndarray):
                # Of rows of several values `take` is four times as quick as brackets.
                value = value.take(rows, axis=0)
            elif isinstance(value, Columns):
                value = value.select(rows)
            chosen[name] = value
        return type(self)(**chosen)

    def put(self, rows: IntArray | BoolArray, values: Self) -> None:
        """Overwrite some of the rows, or of some of their columns, in place."""
        for name in field_names(values):
            mine, given = getattr(self, name), getattr(values, name)
            if isinstance(mine, Columns):
                mine.put(rows, given)
            elif isinstance(mine, np.ndarray):
                mine[rows] = given

    @classmethod
    def joined(cls, several: Sequence[Self]) -> Self:
        """Return the rows of several as one."""
        every: dict[str, Any] = {}
        for name in field_names(cls):
            values = [getattr(one, name) for one in several]
            every[name] = value = values[0]
            if isinstance(value, np.ndarray):
                every[name] = np.concatenate(values)
            elif isinstance(value, Columns):
                every[name] = type(value).joined(values)
        return cls(**every)


class SegmentColumns(Columns, eq=False):
    """The segments of a flight as columns, all of length n, in flown order."""

    item: IntArray
    state: IntArray
    """Positions in `STATES`."""
    duration_s: FloatArray
    distance_m: FloatArray
    climb_m: FloatArray
    speed_m_s: FloatArray
    stopping_distance_m: FloatArray
    """NaN where a segment has none. [m]"""

    @property
    def start_s(self) -> FloatArray:
        """Beginning of each segment: exactly the end of the one before. [s]"""
        return np.concatenate(([0.0], self.duration_s[:-1])).cumsum()

    @property
    def end_s(self) -> FloatArray:
        """End of each segment; each begins where the one before ends. [s]"""
        return self.duration_s.cumsum()


class SlowedLegs(Columns, eq=False):
    """Legs that are flown slower than commanded: the lean angle limits the airspeed. n of them."""

    item: IntArray
    """As the segments of the motion have it. (n,)"""
    commanded_m_s: FloatArray
    """Over ground. (n,) [m s⁻¹]"""
    held_m_s: FloatArray
    """What the wind leaves of it. (n,) [m s⁻¹]"""


class CirclesAtRate(Columns, eq=False):
    """Circles whose target turns on at its rate and waits for nobody. n of them."""

    item: IntArray
    """As the segments of the motion have it. (n,)"""
    speed_m_s: FloatArray
    """Of the target over ground. (n,) [m s⁻¹]"""
    turn_m_s2: FloatArray
    """Its acceleration towards the centre. (n,) [m s⁻²]"""
    height_m: FloatArray
    """Above home. (n,) [m]"""


def _spans(owner: IntArray, owners: IntArray) -> tuple[IntArray, IntArray]:
    """Return the rows of owners in their order, of rows whose owners do not fall, and the place of each's."""
    first = owner.searchsorted(owners)
    count = owner.searchsorted(owners, side="right") - first
    place = np.arange(len(owners)).repeat(count)
    return np.arange(len(place)) + (first - count.cumsum() + count)[place], place


class Beside(Value, eq=False):
    """Where the vehicle is beside what it follows.

    In a straight line between these times, and on it before the first and after the last.
    """

    time_s: FloatArray
    """Since the start of the flight, rising. (n,) [s]"""
    east_north_m: FloatArray
    """From what is followed to the vehicle. (n, 2) [m]"""
    chance_s: FloatArray
    """When stages begin in which where it is is a matter of chance. (c,) [s]"""

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return how far the vehicle is to the east and north of what it follows. (2, …) [m]"""
        return np.stack(
            [np.interp(time_s, self.time_s, way_m, 0.0, 0.0) for way_m in self.east_north_m.T]
        )

    def greatest_m(self, begin_s: FloatArray, end_s: FloatArray) -> FloatArray:
        """Return how far the vehicle is beside, at most, in spans that follow each other. (n,) [m]"""
        away_m = np.maximum(np.hypot(*self.at(begin_s)), np.hypot(*self.at(end_s)))
        span = np.searchsorted(end_s, self.time_s).clip(max=len(end_s) - 1)
        np.maximum.at(away_m, span, np.hypot(*self.east_north_m.T))
        return np.asarray(away_m)

    def moved(self, from_s: FloatArray, to_s: FloatArray) -> Beside:
        """Return the same where what ended at times (n,) ends at others (n,)."""
        before_s, after_s = np.append(0.0, from_s), np.append(0.0, to_s)
        return Beside(
            time_s=np.interp(self.time_s, before_s, after_s),
            east_north_m=self.east_north_m,
            chance_s=np.interp(self.chance_s, before_s, after_s),
        )


class Nodes(Value, kw_only=False, eq=False):
    """The nodes of the quadrature of each piece of a motion: k of each."""

    piece: IntArray
    """(p, 1)"""
    time_s: FloatArray
    """Since the piece began. (p, k) [s]"""
    state: KinematicState
    """(p, k)"""


class Motion(Value, eq=False, dict=True):
    """How a vehicle flies a route: segments, and the pieces they are made of."""

    segments: SegmentColumns
    laws: tuple[MotionLaw, ...]
    piece_segment: IntArray
    """Segment each piece belongs to, not falling. (p,)"""
    piece_law: IntArray
    """Position in ``laws``. (p,)"""
    piece_row: IntArray
    """Row of the piece in its law. (p,)"""
    piece_offset_s: FloatArray
    """The law's own time at which the piece begins. (p,) [s]"""
    piece_duration_s: FloatArray
    arrival_segment: IntArray
    """For each stage of the route the segment whose end is the arrival; −1 for none. (stages,)"""
    done_segment: IntArray
    """For each stage the last segment that serves it; −1 for none. (stages,)"""
    braking_s: FloatArray | None = None
    """For each stage of the route when the autopilot begins to brake for the end of its leg, and when it has;
    NaN for none, ``None`` where that changes nothing. (stages, 2) [s]"""
    piece_is_grounded: BoolArray | None = None
    """Whether a piece stands on the ground with idle motors, at no power; ``None``: none does. (p,)"""
    piece_fall_m_s: FloatArray | None = None
    """Rate of descending along ground that is followed, which saves no power; ``None``: none does. (p,)"""
    wander_m: float = 0.0
    """Way beyond that of the segments: wandered about them, past their stops, wide of their bends. [m]"""
    noise_delay_s: float = 0.0
    """How much longer it takes for the noise of the position, in proportion to that. [s]"""
    landing_spread_s: tuple[float, float] = (0.0, 0.0)
    """How much sooner and how much later than predicted its landings may be over, together. [s]"""
    wait_spread_s: FloatArray | None = None
    """How much longer its waits may be: for the heading, from one that is not known, or for a target that
    stands; of cases that are each as likely.  ``None``: its waits are certain.  (k,) [s]"""
    wait_segment: int = 0
    """The segment from which on that counts."""
    slowed: SlowedLegs | None = None
    """``None``: every leg is flown as fast as commanded, as far as the wind goes."""
    circles: CirclesAtRate | None = None
    beside: Beside | None = None
    """``None``: the vehicle is nowhere beside the motion.  Times and energies are those of the motion."""
    climb_lag_s: float = 0.0
    """By which the vehicle's climb rate follows the motion's, where that may jump; else 0. [s]"""
    findings: tuple[Finding, ...] = ()

    @cached_property
    def nodes(self) -> Nodes:
        """Where powers are taken, whatever the air and the load: once for all flights of this motion."""
        piece = np.arange(len(self.piece_segment))[:, None]
        # Nodes of one number lie beside each other, as their states do: what is worked out of both is quick.
        time_s = np.multiply.outer(QUADRATURE_NODES, self.piece_duration_s).T
        return Nodes(piece, time_s, self.state_at(piece, time_s))

    @cached_property
    def node_acceleration_m_s2(self) -> FloatArray:
        """East, north and up, at the nodes; exact where the jerk is constant. (3, p, k) [m s⁻²]

        That of the cubic through the velocities there; none in pieces too short to tell.
        """
        state = self.nodes.state
        velocity = np.array(
            (state.east_m_s.T, state.north_m_s.T, state.climb_m_s.T)
        )  # as of `nodes`
        slopes = unit_derivative(QUADRATURE_POINTS, QUADRATURE_NODES)
        changes = quotient(slopes @ velocity, self.piece_duration_s, above=SHORTEST_CHANGE_S)
        return changes.swapaxes(1, 2)

    @cached_property
    def segment_start_s(self) -> FloatArray:
        """Beginning of each segment. (s,) [s]"""
        return self.segments.start_s

    @cached_property
    def last_piece(self) -> IntArray:
        """Last piece of each segment. (s,)"""
        count = len(self.segments.item)
        return np.searchsorted(self.piece_segment, np.arange(count), side="right") - 1

    @cached_property
    def climbed_m(self) -> tuple[float, float]:
        """All climbs, and all descents. [m]"""
        climb_m = self.segments.climb_m
        return float(climb_m[climb_m > 0.0].sum()), float(-climb_m[climb_m < 0.0].sum())

    @cached_property
    def distance_m(self) -> float:
        """Over the ground, with what it wanders. [m]"""
        return float(self.segments.distance_m.sum()) + self.wander_m

    @property
    def segment_stage(self) -> IntArray:
        """Stage each segment serves; one past the last what comes after all. (s,)"""
        count = len(self.segments.item)
        return np.searchsorted(np.maximum.accumulate(self.done_segment), np.arange(count))

    @property
    def landing_count(self) -> int:
        """How often it lands."""
        lands = self.segments.state == STATE_INDEX[FlightState.LAND]
        return int(np.count_nonzero(lands & ~np.append(False, lands[:-1])))

    @property
    def leg_count(self) -> int:
        """How many stages it serves before that of its last landing, or of its end."""
        served = {*self.done_segment.tolist()} - {-1}  # `np.unique` loads all of `numpy.ma`
        return max(len(served) - 1, 0)

    def flights(self, items: IntArray) -> Self:
        """Return the flights of items, in this order, of those that are flights of their own.

        What is known of all of them together is left out.
        """
        segment, item = _spans(self.segments.item, items)
        segments = replace(self.segments.select(segment), item=item)
        piece, piece_segment = _spans(self.piece_segment, segment)
        own = {
            name: values[piece]
            for name, values in field_values(self).items()
            if name.startswith("piece_") and values is not None
        }
        slowed = self.slowed
        if slowed is not None:
            rows, of_item = _spans(slowed.item, items)
            slowed = replace(slowed.select(rows), item=of_item)
        later = item.searchsorted(np.arange(len(items))) - self.segments.item.searchsorted(items)
        return type(self)(
            **own | {"piece_segment": piece_segment},
            segments=segments,
            laws=self.laws,
            arrival_segment=self.arrival_segment[items] + later,
            done_segment=self.done_segment[items] + later,
            slowed=slowed,
        )

    @cached_property
    def piece_start_s(self) -> FloatArray:
        """When each piece begins. (p,) [s]"""
        return np.concatenate(([0.0], self.piece_duration_s[:-1])).cumsum()

    def state_at(self, piece: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state at times counted from the beginning of each piece.

        Pieces are (n,) for a time each, (n,) [s], or (n, 1) for a row of times each, (n, k) [s].
        """
        law_of = self.piece_law[piece].reshape(len(piece))
        row, own_s = self.piece_row[piece], self.piece_offset_s[piece] + time_s
        counts = np.bincount(law_of, minlength=len(self.laws))
        if np.count_nonzero(counts) == 1:  # most flights have no circles
            return self.laws[counts.argmax()].state_at(row, own_s).of_shape(time_s.shape)
        by_law = law_of.argsort(kind="stable")
        columns = np.empty((len(field_names(KinematicState)), *time_s.shape))
        end = 0
        for law, count in zip(self.laws, counts.tolist(), strict=True):
            begin, end = end, end + count
            if count:
                chosen = by_law[begin:end]
                state = law.state_at(row[chosen], own_s[chosen])
                for column, values in zip(columns, field_values(state).values(), strict=True):
                    column[begin:end] = values
        # Brought into order at once: put where they belong law by law they take three times as long.
        east_m, north_m, height_m, *velocity_m_s = columns.take(by_law.argsort(), axis=1)
        return KinematicState.of((east_m, north_m, height_m), velocity_m_s)

    def control_m(self, piece: IntArray, start_s: FloatArray, end_s: FloatArray) -> FloatArray:
        """Return the Bézier control points of cubics through spans of pieces. (n, 4, 3) [m]

        They have the places and velocities of the motion at their ends.
        """
        ends = self.state_at(piece[:, None], np.column_stack((start_s, end_s)))
        third = ends.velocity_m_s * ((end_s - start_s) / 3.0)[:, None, None]
        place = ends.place_m
        first, last = place[:, 0], place[:, 1]
        return np.stack((first, first + third[:, 0], last - third[:, 1], last), axis=1)

    def piece_at(self, time_s: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the pieces at times since the start of the flight, and the time since each began.

        Times before the start and after the end are those of the first and last piece.
        """
        starts = self.piece_start_s
        piece = np.maximum(starts.searchsorted(time_s, side="right") - 1, 0)
        own_s = np.maximum(time_s - starts[piece], 0.0)
        return piece, np.minimum(own_s, self.piece_duration_s[piece])

    def state_at_time(self, time_s: FloatArray) -> KinematicState:
        """Return the state at times since the start of the flight."""
        return self.state_at(*self.piece_at(time_s))


class PolynomialLaw(Columns, eq=False):
    """Position as a cubic of time on each axis: holding, constant speed, or constant jerk."""

    coefficients: FloatArray
    """Rising powers of time for east, north, height above home. (rows, 3, 4) [m, m s⁻¹, …]"""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        # One column for each power of each axis; times of one piece beside each other: (k, n).
        if row.size < len(self.coefficients):  # of few rows, not all are turned round
            columns = self.coefficients[row.ravel()].transpose(1, 2, 0).reshape(12, -1)
        else:
            columns = self.coefficients.transpose(1, 2, 0).reshape(12, -1).take(row.ravel(), axis=1)
        t = np.ascontiguousarray(time_s.T)
        position, velocity = [], []
        for c0, c1, c2, c3 in columns.reshape(3, 4, -1):
            # c0 + t (c1 + t (c2 + t c3)) and c1 + t (2 (c2 + t c3) + t c3), without copies
            slope = t * c3
            place = c2 + slope
            slope += place
            slope += place
            for power in (c1, c0):
                place *= t
                place += power
            slope *= t
            slope += c1
            position.append(place.T)
            velocity.append(slope.T)
        return KinematicState.of(position, velocity)


class CircleLaw(Columns, eq=False):
    """Level flight about a centre at a steady rate."""

    start_m: FloatArray
    """East, north, height above home where the circle begins. (rows, 3) [m]"""
    centre_m: FloatArray
    """East and north of the centre. (rows, 2) [m]"""
    rate_rad_s: FloatArray
    """Rate of turn about the centre, positive counter-clockwise as seen from above. (rows,)"""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        start, centre, rate = self.start_m[row], self.centre_m[row], self.rate_rad_s[row]
        angle = rate * time_s
        east, north = start[..., 0] - centre[..., 0], start[..., 1] - centre[..., 1]
        away_east = east * np.cos(angle) - north * np.sin(angle)
        away_north = east * np.sin(angle) + north * np.cos(angle)
        return KinematicState.of(
            (centre[..., 0] + away_east, centre[..., 1] + away_north, start[..., 2]),
            (-rate * away_north, rate * away_east, np.zeros(angle.shape)),
        )


class FlightState(StrEnum):
    """What a vehicle does during one segment of its flight."""

    TAKEOFF = "takeoff"
    CLIMB = "climb"
    ACCELERATE = "accelerate"
    CRUISE = "cruise"
    BRAKE = "brake"
    HOVER = "hover"
    DESCEND = "descend"
    LAND = "land"


STATES = tuple(FlightState)
"""The states in a fixed order; columns of segments hold positions in it."""

STATE_INDEX = {state: index for index, state in enumerate(STATES)}


class Manoeuvres(Value, eq=False):
    """Manoeuvres of one kind, one per row; each is one segment."""

    key: IntArray
    """Place in the order of the flight. (n,)"""
    state: FlightState
    speed_m_s: FloatArray
    """Highest speed. (n,) [m s⁻¹]"""
    stopping_distance_m: FloatArray
    """Way to stand still from that speed; NaN for none. (n,) [m]"""
    duration_s: FloatArray
    """Duration of each piece. (n, k) [s]"""
    coefficients: FloatArray
    """Rising powers of the piece's own time for east, north, height. (n, k, 3, 4)"""
    is_grounded: BoolArray
    """Whether a piece stands on the ground at no power. (k,)"""


def make_manoeuvres(
    key: IntArray,
    state: FlightState,
    *,
    position_m: FloatArray,
    velocity_m_s: FloatArray,
    duration_s: FloatArray,
    stopping_distance_m: FloatArray | None = None,
    grounded: tuple[int, ...] = (),
) -> Manoeuvres:
    """Return manoeuvres through places at velocities and times.

    Each piece is the cubic with these ends (Hermite): constant acceleration is reproduced exactly.

    Parameters
    ----------
    key, state, stopping_distance_m
        As in `Manoeuvres`.
    position_m, velocity_m_s : ndarray
        East, north, height above home at the ends of the pieces. (n, k + 1, 3) [m, m s⁻¹]
    duration_s : ndarray
        Of the pieces; those of no duration are left out. (n, k) [s]
    grounded : tuple of int
        Pieces that stand on the ground at no power.
    """
    start, end = position_m[:, :-1], position_m[:, 1:]
    leaving, arriving = velocity_m_s[:, :-1], velocity_m_s[:, 1:]
    per_s = quotient(1.0, duration_s)[..., None]
    mean = (end - start) * per_s
    bend = (3.0 * mean - 2.0 * leaving - arriving) * per_s
    jerk = (leaving + arriving - 2.0 * mean) * per_s**2
    if stopping_distance_m is None:
        stopping_distance_m = np.full(len(key), np.nan)
    return Manoeuvres(
        key=key,
        state=state,
        speed_m_s=greatest(lengths(velocity_m_s)),
        stopping_distance_m=stopping_distance_m,
        duration_s=duration_s,
        coefficients=np.stack((start, leaving, bend, jerk), axis=-1),
        is_grounded=np.array([piece in grounded for piece in range(duration_s.shape[1])]),
    )


def make_vertical(
    key: IntArray,
    state: FlightState,
    *,
    place_m: FloatArray,
    height_m: tuple[FloatArray, ...],
    climb_m_s: tuple[FloatArray, ...],
    duration_s: tuple[FloatArray, ...],
    grounded: tuple[int, ...] = (),
) -> Manoeuvres:
    """Return manoeuvres straight up and down, by heights and climb speeds at the ends of the pieces."""
    count, ends = len(key), len(height_m)
    position, velocity = np.empty((count, ends, 3)), np.zeros((count, ends, 3))
    position[..., :2] = place_m[:, None, :2]
    position[..., 2] = np.column_stack(height_m)
    velocity[..., 2] = np.column_stack(climb_m_s)
    return make_manoeuvres(
        key,
        state,
        position_m=position,
        velocity_m_s=velocity,
        duration_s=np.column_stack(duration_s),
        grounded=grounded,
    )


def hold(
    key: IntArray, state: FlightState, *, place_m: FloatArray, duration_s: FloatArray
) -> Manoeuvres:
    """Return standstills at places for times. (n, 3) [m], (n,) [s]"""
    return make_manoeuvres(
        key,
        state,
        position_m=np.repeat(place_m[:, None], 2, axis=1),
        velocity_m_s=np.zeros((len(key), 2, 3)),
        duration_s=duration_s[:, None],
    )
