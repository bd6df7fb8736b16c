"""Returns from any point of a flight: stop, then fly back by the vehicle's own rules."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    STATES,
    Columns,
    FlightState,
    KinematicState,
    lengths,
    quotient,
    summed,
)
from planner.flight.prediction import PieceLoads, make_flight, segment_energies_j
from planner.flight.reach import situations, slowed_situations
from planner.flight.returns.destination import HOME
from planner.flight.returns.sample import (
    judged_segments,
    landing_segments,
    line_ends,
    sample_points,
)
from planner.mission.route.stage import StageKind
from planner.units import JOULES_PER_WATT_HOUR, wh_from_j
from planner.values import Value, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion, SegmentColumns
    from planner.flight.pilot import Pilot
    from planner.flight.power import SteadyPower, Transients
    from planner.flight.prediction import Flight
    from planner.flight.reach import Situations, SlowedSituations
    from planner.flight.returns.destination import Destinations
    from planner.geo.geodesy import LocalFrame
    from planner.mission.route.stage import ReturnPath, Route

Made = TypeVar("Made")
_BRAKE, _CRUISE = STATE_INDEX[FlightState.BRAKE], STATE_INDEX[FlightState.CRUISE]
_SLOWEST_M_S = 1e-3
"""A slower vehicle counts as standing still. [m s⁻¹]"""
_SAME_SPEED = 0.01
_SIMPSON = np.array([1.0, 4.0, 1.0]) / 6.0
_BRAKING_FRACTIONS = np.array([1.0, 0.5, 0.0])
PROFILE_POINTS = 400
"""Points of a profile, evenly in time; the ends of its stages come on top. [-]"""


class FlightPoint(Value, dict=True):
    """A place along a flight."""

    item: int
    """Mission item that is being flown to, or held at."""
    time_s: float
    """Since the start of the take-off. [s]"""
    along_m: float
    """Distance flown for this item by then. [m]"""
    leg_m: float
    """Whole distance flown for this item. [m]"""
    east_m: float
    """From the origin of the frame, like the next. [m]"""
    north_m: float
    frame: LocalFrame

    @cached_property
    def place_deg(self) -> tuple[float, float]:
        """Latitude and longitude. [°]"""
        latitude_deg, longitude_deg = self.frame.latitude_longitude_deg(self.east_m, self.north_m)
        return float(latitude_deg), float(longitude_deg)

    @property
    def latitude_deg(self) -> float:
        """As of its place. [°]"""
        return self.place_deg[0]

    @property
    def longitude_deg(self) -> float:
        """As of its place. [°]"""
        return self.place_deg[1]


class ReturnPoints(Columns, eq=False):
    """n points of a flight at which a return may begin, each inside one segment."""

    segment: IntArray
    """(n,)"""
    fraction: FloatArray
    """Of the segment's time that has passed, 0 to 1. (n,) [-]"""
    stage: IntArray
    """Position in the route's stages. (n,)"""
    time_s: FloatArray
    """Since the start of the flight. (n,) [s]"""
    place_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    stop_m: FloatArray
    """Where a vehicle that begins its return there stands still. (n, 3) [m]"""
    stop_s: FloatArray
    """Time until it does. (n,) [s]"""
    stop_wh: FloatArray
    """Energy until it does. (n,) [Wh]"""
    used_wh: FloatArray
    """Energy used since the start of the flight. (n,) [Wh]"""


class StopPlaces(Value, eq=False):
    """n points of a flight and the stops from there, as its motion alone has them, whatever the air."""

    segment: IntArray
    """(n,)"""
    fraction: FloatArray
    """As in `ReturnPoints`, like the next five. (n,) [-]"""
    stage: IntArray
    time_s: FloatArray
    place_m: FloatArray
    stop_m: FloatArray
    stop_s: FloatArray
    braking_s: FloatArray
    """Time the pilot brakes for from the ground speed. (n,) [s]"""
    braking: KinematicState
    """At full, half and no speed. (n, 3)"""
    braking_m_s2: FloatArray
    """Acceleration there, east, north and up. (3, n, 3) [m s⁻²]"""
    speed_m_s: FloatArray
    """Over ground. (n,) [m s⁻¹]"""
    stops: BoolArray
    """Whether the leg is flown into a stop anyway. (n,)"""
    brake: IntArray
    """Segment of that stop. (n,)"""
    brake_left: FloatArray
    """Part of its time that is ahead. (n,) [-]"""


class ReturnLoads(PieceLoads, eq=False):
    """What stops and returns from n points ask of a battery: a row for each, its stop first, then its pieces.

    Rows are filled with nothing asked for no time. (n, k)
    """

    duration_s: FloatArray
    """[s]"""


class FlownReturns(Value, eq=False, dict=True):
    """Returns to where the vehicle itself would return, from n points of a flight."""

    points: ReturnPoints
    destination: IntArray
    """As in :meth:`Destinations.targets`. (n,)"""
    flight: Flight
    """The returns from standing still, one after another; the item of a segment is its point's row."""

    @property
    def piece_point(self) -> IntArray:
        """Row of the point each piece of the returns is flown from. (p,)"""
        motion = self.flight.motion
        return motion.segments.item[motion.piece_segment]

    @cached_property
    def stop_w(self) -> tuple[FloatArray, FloatArray]:
        """Mean power of the stops, and power of the hover each ends in. (n,) [W]"""
        points = self.points
        mean_w = quotient(points.stop_wh * JOULES_PER_WATT_HOUR, points.stop_s)
        return mean_w, self.flight.power.hover_w(points.stop_m)

    @cached_property
    def demand(self) -> tuple[float, FloatArray]:
        """Highest power of any, and what each takes by its loads. [W], (n,) [J]"""
        pieces, duration_s = self.flight.loads, self.flight.motion.piece_duration_s
        stop_w, hover_w = self.stop_w
        taken_j = np.bincount(self.piece_point, pieces.mean_w * duration_s, len(stop_w))
        highest_w = max(float(one.max()) for one in (pieces.peak_w, stop_w, hover_w))
        return highest_w, taken_j + stop_w * self.points.stop_s

    @cached_property
    def loads(self) -> ReturnLoads:
        """What they ask of a battery, with the hover that a stop ends in."""
        points, own = self.points, self.flight.loads
        order = np.argsort(self.piece_point, kind="stable")
        row = self.piece_point[order]
        count = np.bincount(row, minlength=len(points.segment))
        column = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1
        rows = np.zeros((5, len(points.segment), int(count.max()) + 1))
        mean_w, variance_w2, peak_w, end_w, duration_s = rows
        for filled, of_pieces in zip(
            rows, (*field_values(own).values(), self.flight.motion.piece_duration_s), strict=True
        ):
            filled[row, column] = of_pieces[order]
        duration_s[:, 0] = points.stop_s
        mean_w[:, 0], end_w[:, 0] = self.stop_w
        peak_w[:, 0] = np.maximum(mean_w[:, 0], end_w[:, 0])
        return ReturnLoads(
            mean_w=mean_w,
            variance_w2=variance_w2,
            peak_w=peak_w,
            end_w=end_w,
            duration_s=duration_s,
        )

    @property
    def time_s(self) -> FloatArray:
        """Time to stop, return and land. (n,) [s]"""
        return self.points.stop_s + self._summed(self.flight.motion.segments.duration_s)

    @property
    def energy_wh(self) -> FloatArray:
        """Energy to stop, return and land. (n,) [Wh]"""
        return self.points.stop_wh + wh_from_j(self._summed(self.flight.segment_energy_j))

    @property
    def state_energy_j(self) -> FloatArray:
        """Energy to return and land once stopped, by state. (n, states) [J]"""
        return by_state(
            self.flight.motion.segments, self.flight.segment_energy_j, len(self.points.segment)
        )

    def _summed(self, of_segments: FloatArray) -> FloatArray:
        item = self.flight.motion.segments.item
        return np.asarray(np.bincount(item, of_segments, len(self.destination)), np.float64)


class Returns(Value, eq=False, dict=True):
    """A flight and the rules by which it can be broken off."""

    route: Route
    flight: Flight
    pilot: Pilot
    destinations: Destinations
    segment_stage: IntArray
    """Stage each segment serves. (s,)"""
    used_wh: FloatArray
    """Energy used before each segment, and after the last. (s + 1,) [Wh]"""
    start_s: FloatArray
    """When each segment begins. (s,) [s]"""
    piece_start_s: FloatArray
    first_piece: IntArray
    """First piece of each segment, and one past the last of all. (s + 1,)"""

    def recalled(self, key: Hashable, make: Callable[[], Made]) -> Made:  # noqa: ARG002
        """Return what follows from these returns and a key: made, where nobody remembers it."""
        return make()

    @cached_property
    def sample(self) -> FlownReturns | None:
        """Returns from all over the flight; ``None`` where no point of it is in the air."""
        return None if self.sampled is None else self.flown(self.points(*self.sampled))

    def sample_and(self, points: ReturnPoints) -> tuple[FlownReturns, ...]:
        """Return the returns of the sample, which there is, and those from further points.

        Both at once while the sample is not known yet: together they take little more time than alone.
        """
        if "sample" in vars(self):
            assert self.sample is not None
            return self.sample, self.flown(points)
        assert self.sampled is not None
        sample = self.points(*self.sampled)
        both = self.flown(ReturnPoints.joined((sample, points)))
        count = len(sample.segment)
        vars(self)["sample"] = FlownReturns(
            points=sample, destination=both.destination[:count], flight=both.flight.leading(count)
        )
        return (both,)

    @cached_property
    def sampled(self) -> tuple[IntArray, FloatArray] | None:
        """Segments of these points, and the fractions of their time, in flown order."""
        return sample_points(self)

    @cached_property
    def situations(self) -> Situations:
        """Every situation the vehicle may be in: mission, holds, returns from anywhere."""
        return situations(self)

    @cached_property
    def slowed(self) -> SlowedSituations | None:
        """Where the mission and returns are slower than commanded; ``None``: nowhere."""
        return slowed_situations(self)

    @cached_property
    def lands(self) -> BoolArray:
        """Which segments come down where the vehicle lands, or are a return already. (s,)"""
        return landing_segments(self)

    @cached_property
    def judged(self) -> tuple[BoolArray, BoolArray]:
        """From which segments returns are judged, and which continue the one before. (s,), (s + 1,)"""
        return judged_segments(self)

    @cached_property
    def judged_sums(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times of segments from which returns are judged, and time and energy of these up to each. (s,)

        The others take none. [s], [s], [Wh]
        """
        judged, _ = self.judged
        own_s = np.where(judged, self.flight.motion.segments.duration_s, 0.0)
        own_wh = np.where(judged, self.used_wh[1:] - self.used_wh[:-1], 0.0)
        return own_s, own_s.cumsum(), own_wh.cumsum()

    @cached_property
    def line_ends(self) -> BoolArray:
        """At which segments a line that is flown ends. (s,)"""
        return line_ends(self)

    @property
    def stage_ends(self) -> IntArray:
        """Last segment of each stage that has one, in flown order."""
        return np.flatnonzero(np.diff(self.segment_stage, append=-1))

    def at(self, time_s: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return segments at times of the flight, and the fractions of them that have passed. (n,)"""
        segment = np.maximum(self.start_s.searchsorted(time_s, side="right") - 1, 0)
        duration_s = np.maximum(self.flight.motion.segments.duration_s[segment], 1e-9)
        fraction = (time_s - self.start_s[segment]) / duration_s
        return segment, np.minimum(np.maximum(fraction, 0.0), 1.0)

    def points(self, segment: IntArray, fraction: FloatArray) -> ReturnPoints:
        """Return points of the flight, by segment and fraction of its time. (n,)

        A return begins with a stop: over the distance the pilot brakes by from the ground speed, in
        the time the pilot takes for it, at Simpson's mean of the powers at full, half and no speed.
        Where the leg is flown into a stop anyway, a cruise stops as its leg does, and a vehicle that
        brakes already goes on braking.  Energy inside a segment is taken to be used evenly.
        """
        places = self.places(segment, fraction)
        braking_wh = wh_from_j(self._braking_power_w(places) * places.braking_s)
        of_leg_wh = places.brake_left * wh_from_j(self.flight.segment_energy_j[places.brake])
        before, after = self.used_wh[segment], self.used_wh[segment + 1]
        return ReturnPoints(
            segment=segment,
            fraction=fraction,
            stage=places.stage,
            time_s=places.time_s,
            place_m=places.place_m,
            stop_m=places.stop_m,
            stop_s=places.stop_s,
            stop_wh=np.where(places.stops, of_leg_wh, braking_wh),
            used_wh=before + fraction * (after - before),
        )

    def end_points(self, segment: IntArray) -> ReturnPoints:
        """Return the points at which segments end. (n,)"""
        return self.points(segment, np.ones(len(segment)))

    def flight_points(self, at: Sequence[tuple[int, float]]) -> tuple[FlightPoint, ...]:
        """Return where along the mission points of the flight are, by segment and fraction of its time."""
        segment = np.repeat([one for one, _ in at], 2)
        fraction = np.array([share for _, one in at for share in (0.0, one)])
        time_s, piece, own_s = self._pieces_at(segment, fraction)
        place_m = self.flight.motion.state_at(piece, own_s).place_m
        begin_m, there_m = place_m[::2], place_m[1::2]
        # Inside a segment the flight is taken to be straight.
        inside_m = lengths((there_m - begin_m)[:, :2])
        distance_m = self.flight.motion.segments.distance_m
        stage = self.segment_stage[segment[::2]]
        first = np.searchsorted(self.segment_stage, stage)
        last = np.searchsorted(self.segment_stage, stage, side="right")
        return tuple(
            FlightPoint(
                item=self.route.stages[stage[row]].item,
                time_s=float(time_s[2 * row + 1]),
                along_m=float(distance_m[first[row] : own].sum())
                + min(float(inside_m[row]), float(distance_m[own])),
                leg_m=float(distance_m[first[row] : last[row]].sum()),
                east_m=float(there_m[row, 0]),
                north_m=float(there_m[row, 1]),
                frame=self.route.frame,
            )
            for row, (own, _) in enumerate(at)
        )

    def places(self, segment: IntArray, fraction: FloatArray) -> StopPlaces:
        """Return where points of the flight are, and where and when vehicles there stand still. (n,)"""
        motion, count = self.flight.motion, len(segment)
        columns = motion.segments
        brakes = columns.state[segment] == _BRAKE
        brake = np.minimum(segment + ~brakes, len(columns.item) - 1)
        brake_m = columns.distance_m[brake]
        # Written so that a distance that is not a number is no stop.
        stops = (
            (brakes | (columns.state[segment] == _CRUISE))
            & (columns.state[brake] == _BRAKE)
            & (np.abs(columns.stopping_distance_m[brake] - brake_m) <= 1e-6 * brake_m)
        )
        # A response may swing about the place where its leg ends: the next segment begins there.
        stands = np.flatnonzero(stops & brakes & (brake + 1 < len(columns.item)))
        time_s, piece, own_s = self._pieces_at(segment, fraction)
        piece = np.concatenate((piece, self.first_piece[brake[stands] + 1]))
        both = motion.state_at(piece, np.concatenate((own_s, np.zeros(len(stands)))))
        state, begin = both.select(slice(count)), both.select(slice(count, None))
        speed = state.ground_speed_m_s
        moves = speed > _SLOWEST_M_S
        safe = np.where(moves, speed, 1.0)
        length_m, braking_s = self.pilot.stop(np.where(moves, speed, 0.0))
        if motion.piece_fall_m_s is not None:  # over the ground it has speeds of its own
            other = np.abs(speed - columns.speed_m_s[segment]) > _SAME_SPEED * speed
            stops &= brakes | ~other
        left = np.where(brakes, 1.0 - fraction, 1.0)
        length_m = np.where(stops & ~brakes, brake_m, length_m)
        place_m = state.place_m
        stop_m = place_m.copy()
        stop_m[:, 0] += length_m * state.east_m_s / safe
        stop_m[:, 1] += length_m * state.north_m_s / safe
        stop_m[stands, 0], stop_m[stands, 1] = begin.east_m, begin.north_m
        braking, braking_m_s2 = _evenly_braked(state, braking_s)
        return StopPlaces(
            segment=segment,
            fraction=fraction,
            stage=self.segment_stage[segment],
            time_s=time_s,
            place_m=place_m,
            stop_m=stop_m,
            stop_s=np.where(stops, left * columns.duration_s[brake], braking_s),
            braking_s=braking_s,
            braking=braking,
            braking_m_s2=braking_m_s2,
            speed_m_s=speed,
            stops=stops,
            brake=brake,
            brake_left=left,
        )

    def _pieces_at(
        self, segment: IntArray, fraction: FloatArray
    ) -> tuple[FloatArray, IntArray, FloatArray]:
        """Return when points of the flight are passed, in which pieces, how long after each began. (n,)

        [s], -, [s]
        """
        motion = self.flight.motion
        time_s = self.start_s[segment] + fraction * motion.segments.duration_s[segment]
        piece = self.piece_start_s.searchsorted(time_s, side="right") - 1
        piece = np.maximum(piece, self.first_piece[segment])
        piece = np.minimum(piece, self.first_piece[segment + 1] - 1)
        own_s = np.maximum(time_s - self.piece_start_s[piece], 0.0)
        return time_s, piece, np.minimum(own_s, motion.piece_duration_s[piece])

    def _braking_power_w(self, places: StopPlaces) -> FloatArray:
        """Return the mean power of stops, evenly braked. (n,) [W]"""
        power_w = self.flight.power.power_w(
            places.braking,
            np.full((len(places.segment), 1), _BRAKE),
            places.speed_m_s[:, None],
            acceleration_m_s2=places.braking_m_s2,
        )
        return np.asarray(power_w @ _SIMPSON)

    def flown(self, points: ReturnPoints) -> FlownReturns:
        """Return the returns the vehicle itself would fly from points."""
        destination, motion, transients = self.ways_back(points)
        return FlownReturns(
            points=points,
            destination=destination,
            flight=make_flight(motion, transients, self.flight.power),
        )

    def ways_back(self, points: ReturnPoints) -> tuple[IntArray, Motion, Transients]:
        """Return where the vehicle itself would return to from points, and how it flies there. (n,)"""
        destination = self.chosen(points)
        targets = self.destinations.targets(points.stage, destination, points.stop_m)
        return destination, *self.pilot.fly_returns(points.stop_m, targets, self.route)

    def in_other_air(self, flight: Flight) -> Self:
        """Return the returns from a flight that differs in its power alone."""
        return replace(self, flight=flight, used_wh=_used_before_wh(flight))

    def fly(
        self, stand_m: FloatArray, stage: IntArray, destination: IntArray | int
    ) -> tuple[FloatArray, FloatArray]:
        """Return time and energy of returns from standing at points to landed. (n,) [s], (n,) [Wh]

        Parameters
        ----------
        stand_m : ndarray
            East, north, height above home; at least one. (n, 3) [m]
        stage : ndarray of int
            Stages flown when the return begins, which decide what home is. (n,)
        destination : ndarray of int
            As in :meth:`Destinations.targets`. (n,)
        """
        powers = (self.flight.power,)
        time_s, [state_j] = self.fly_by_state(stand_m, stage, destination, powers=powers)
        return time_s, wh_from_j(summed(state_j))

    def fly_by_state(
        self,
        stand_m: FloatArray,
        stage: IntArray,
        destination: IntArray | int,
        *,
        powers: Iterable[SteadyPower],
    ) -> tuple[FloatArray, Iterator[FloatArray]]:
        """Return times of the returns of `fly`, and energies by state for each of several powers.

        (n,) [s], (n, states) [J]
        """
        targets = self.destinations.targets(stage, destination, stand_m)
        motion, transients = self.pilot.fly_returns(stand_m, targets, self.route)
        columns, count = motion.segments, len(stand_m)
        time_s = np.bincount(columns.item, columns.duration_s, minlength=count).astype(np.float64)
        return time_s, (
            by_state(columns, own_j, count)
            for own_j in segment_energies_j(motion, transients, powers)
        )

    def chosen(self, points: ReturnPoints) -> IntArray:
        """Return the destination the vehicle itself chooses from points. (n,)"""
        return self.destinations.chosen(points.place_m, points.stage)

    def corners_m(
        self, points: ReturnPoints, destination: IntArray | None = None
    ) -> tuple[FloatArray, ...]:
        """Return the corners of returns: where it decides, stops, sets out, arrives, lands.

        ``destination`` is as in :meth:`Destinations.targets`, by default what the vehicle itself chooses.
        Each row is east, north, height above home, straight in between; along the mission its places instead
        of the arrival. (n times (5 or more, 3)) [m]
        """
        chosen = self.chosen(points) if destination is None else destination
        corners, paths = self.straight_corners_m(points, chosen)
        return tuple(
            own if path is None else np.vstack((own[:3], along_m(path, own[2])))
            for own, path in zip(corners, paths, strict=True)
        )

    def straight_corners_m(
        self, points: ReturnPoints, destination: IntArray
    ) -> tuple[FloatArray, tuple[ReturnPath | None, ...]]:
        """Return the corners of returns as far as they are straight, and what some follow from there.

        Where one decides, stops, sets out, arrives over its target or at its first place along the mission,
        and lands. (n, 5, 3) [m]
        """
        targets = self.destinations.targets(points.stage, destination, points.stop_m)
        height_m = self.pilot.return_heights_m(points.stop_m, targets)
        turn_m, over_m = points.stop_m.copy(), targets.ground_m.copy()
        turn_m[:, 2] = over_m[:, 2] = height_m
        paths = targets.paths or (None,) * len(height_m)
        for row, path in enumerate(paths):
            if path is not None:
                over_m[row] = along_m(path, turn_m[row], most=1)[0]
        corners = (points.place_m, points.stop_m, turn_m, over_m, targets.ground_m)
        return np.stack(corners, axis=1), paths


def make_returns(route: Route, flight: Flight, pilot: Pilot, destinations: Destinations) -> Returns:
    """Return the returns from a flight of at least one segment."""
    motion = flight.motion
    columns = motion.segments
    count = len(columns.item)
    return Returns(
        route=route,
        flight=flight,
        pilot=pilot,
        destinations=destinations,
        segment_stage=np.minimum(motion.segment_stage, len(route.stages) - 1),
        used_wh=_used_before_wh(flight),
        start_s=motion.segment_start_s,
        piece_start_s=motion.piece_start_s,
        first_piece=np.searchsorted(motion.piece_segment, np.arange(count + 1)),
    )


def _used_before_wh(flight: Flight) -> FloatArray:
    """Return the energy used before each segment, and after the last. (s + 1,) [Wh]"""
    return np.concatenate(([0.0], wh_from_j(flight.segment_energy_j))).cumsum()


def _evenly_braked(
    state: KinematicState, braking_s: FloatArray
) -> tuple[KinematicState, FloatArray]:
    """Return stops from states in times, at full, half and no speed, and the accelerations there."""
    zero = np.zeros((len(braking_s), len(_BRAKING_FRACTIONS)))
    slowing = KinematicState.of(
        [own[:, None] + zero for own in (state.east_m, state.north_m, state.height_m)],
        (
            state.east_m_s[:, None] * _BRAKING_FRACTIONS,
            state.north_m_s[:, None] * _BRAKING_FRACTIONS,
            zero,
        ),
    )
    velocity = np.array((state.east_m_s, state.north_m_s, 0.0 * state.climb_m_s))
    return slowing, zero - quotient(velocity, braking_s)[..., None]


def by_state(columns: SegmentColumns, own_j: FloatArray, count: int) -> FloatArray:
    """Return the energies of segments summed by item, of which there are so many, and state. [J]"""
    at = columns.item * len(STATES) + columns.state
    summed_j = np.bincount(at, own_j, minlength=count * len(STATES))
    return summed_j.astype(np.float64).reshape(count, -1)


def thinned(segments: IntArray, most: int) -> IntArray:
    """Return segments, or as many of them as asked, evenly spread, first and last among them."""
    if len(segments) <= most:
        return segments
    return segments[np.linspace(0, len(segments) - 1, most).astype(np.intp)]


def along_m(path: ReturnPath, start_m: FloatArray, *, most: int | None = None) -> FloatArray:
    """Return the corners of a return along the mission, from a place on, of its first stages. (m, 3) [m]"""
    corners: list[tuple[float, float, float]] = []
    height_m = float(start_m[2])
    for stage in path.stages[:most]:
        if stage.kind is not StageKind.GO:  # level to the place first
            corners.append((stage.east_m, stage.north_m, height_m))
        height_m = stage.height_m
        corners.append((stage.east_m, stage.north_m, height_m))
    return np.array(corners)


class ReturnProfile(Value, eq=False):
    """What returns from n points of a flight take, as columns in flown order."""

    time_s: FloatArray
    """Since the start of the flight. (n,) [s]"""
    item: IntArray
    """Mission item flown for. (n,)"""
    along_m: FloatArray
    """Distance flown for that item. (n,) [m]"""
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_above_home_m: FloatArray
    used_wh: FloatArray
    """Energy used by then. (n,) [Wh]"""
    destination: IntArray
    """Where the vehicle itself would return to: 0 for home, k for rally point k, below 0 as in
    `planner.flight.returns.destination`. (n,)"""
    return_s: FloatArray
    """Time to stop, return there and land. (n,) [s]"""
    return_wh: FloatArray
    """Energy for that. (n,) [Wh]"""
    home_s: FloatArray
    """Time to stop, fly home and land, whatever the vehicle would choose. (n,) [s]"""
    home_wh: FloatArray
    rally_s: FloatArray
    """The same for each of r rally points. (n, r) [s]"""
    rally_wh: FloatArray
    """(n, r) [Wh]"""


def return_profile(returns: Returns) -> ReturnProfile:
    """Return what returns take from the ends of the stages of a flight, and evenly in between."""
    columns, ends = returns.flight.motion.segments, returns.stage_ends
    even, fraction = returns.at(np.linspace(0.0, returns.flight.time_s, PROFILE_POINTS))
    segment = np.concatenate((even, ends))
    fraction = np.concatenate((fraction, np.ones(len(ends))))
    order = np.lexsort((fraction, segment))
    points = returns.points(segment[order], fraction[order])
    own = returns.chosen(points)
    places = range(HOME, len(returns.destinations.rally_ground_m) + 1)
    flown = np.array([returns.fly(points.stop_m, points.stage, place) for place in places])
    if (own >= HOME).all():
        chosen = flown[own, :, np.arange(len(own))].T
    else:
        chosen = np.array(returns.fly(points.stop_m, points.stage, own))
    flown = np.concatenate((flown, chosen[None]))
    time_s, energy_wh = points.stop_s + flown[:, 0], points.stop_wh + flown[:, 1]
    latitude_deg, longitude_deg = returns.route.frame.latitude_longitude_deg(
        points.place_m[:, 0], points.place_m[:, 1]
    )
    flown_m = np.concatenate(([0.0], np.cumsum(columns.distance_m)))
    first = np.searchsorted(returns.segment_stage, points.stage)
    along_m = flown_m[points.segment] - flown_m[first]
    items = np.array([stage.item for stage in returns.route.stages], dtype=np.intp)
    return ReturnProfile(
        time_s=points.time_s,
        item=items[points.stage],
        along_m=along_m + points.fraction * columns.distance_m[points.segment],
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_above_home_m=points.place_m[:, 2],
        used_wh=points.used_wh,
        destination=own,
        return_s=time_s[-1],
        return_wh=energy_wh[-1],
        home_s=time_s[HOME],
        home_wh=energy_wh[HOME],
        rally_s=time_s[HOME + 1 : -1].T,
        rally_wh=energy_wh[HOME + 1 : -1].T,
    )
