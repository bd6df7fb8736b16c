"""The way home from any point of a flight: stop, then return by the vehicle's own rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    STATES,
    FlightState,
    KinematicState,
)
from planner.flight.prediction import segment_energy_j
from planner.frozen import frozen
from planner.mission.route.stage import StageKind
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.flight.destination import Destinations, Targets
    from planner.flight.motion.kinematics import Motion
    from planner.flight.pilot import Pilot
    from planner.flight.prediction import Flight
    from planner.mission.route.stage import (
        ReturnWay,
        Route,
    )

_BRAKE, _CRUISE = STATE_INDEX[FlightState.BRAKE], STATE_INDEX[FlightState.CRUISE]
_SLOWEST_M_S = 1e-3
"""A vehicle slower than this stands. [m s⁻¹]"""
_SIMPSON = np.array([1.0, 4.0, 1.0]) / 6.0
_BRAKING_SHARES = np.array([1.0, 0.5, 0.0])


@frozen
class FlightPoint:
    """A place along a flight."""

    item: int
    """Mission item that is being flown to, or held at."""
    time_s: float
    """Since the start of the take-off. [s]"""
    along_m: float
    """Way flown for this item by then. [m]"""
    leg_m: float
    """Whole way flown for this item. [m]"""
    latitude_deg: float
    longitude_deg: float


@frozen(eq=False)
class Points:
    """Points of a flight, each inside one segment."""

    segment: IntArray
    """(n,)"""
    share: FloatArray
    """Of the segment's time that has passed, 0 to 1. (n,) [-]"""
    stage: IntArray
    """Position in the route's stages. (n,)"""
    time_s: FloatArray
    """Since the start of the flight. (n,) [s]"""
    place_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    stop_m: FloatArray
    """Where a vehicle that is told to return there stands still. (n, 3) [m]"""
    stop_s: FloatArray
    """Time until it does. (n,) [s]"""
    stop_wh: FloatArray
    """Energy until it does. (n,) [Wh]"""
    used_wh: FloatArray
    """Energy used since the start of the flight. (n,) [Wh]"""


@frozen(eq=False)
class Homeward:
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

    def at(self, time_s: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return segments at times of the flight, and shares of their times. (n,), (n,)"""
        segment = np.maximum(np.searchsorted(self.start_s, time_s, side="right") - 1, 0)
        duration_s = np.maximum(self.flight.motion.segments.duration_s[segment], 1e-9)
        return segment, np.clip((time_s - self.start_s[segment]) / duration_s, 0.0, 1.0)

    def points(self, segment: IntArray, share: FloatArray) -> Points:
        """Return points of the flight.

        Parameters
        ----------
        segment : ndarray of int
            (n,)
        share : ndarray
            Share of the time of the segment that has passed, 0 to 1; energy inside a segment is taken
            to be used evenly. (n,) [-]

        Notes
        -----
        A return begins with a stop: over the distance the pilot brakes by from the ground speed, in
        the time the pilot takes for it, at Simpson's mean of the powers at full, half and no speed.
        Where the leg is flown into a stop anyway, a cruise stops as its leg does, and a vehicle that
        brakes already goes on braking.
        """
        motion, columns = self.flight.motion, self.flight.motion.segments
        time_s = self.start_s[segment] + share * columns.duration_s[segment]
        piece = np.clip(
            np.searchsorted(self.piece_start_s, time_s, side="right") - 1,
            self.first_piece[segment],
            self.first_piece[segment + 1] - 1,
        )
        own_s = np.clip(time_s - self.piece_start_s[piece], 0.0, motion.piece_duration_s[piece])
        state = motion.state_at(piece, own_s)
        place_m = np.column_stack((state.east_m, state.north_m, state.height_m))
        stop_m, stop_s, stop_wh = self._stops(state, place_m, segment, share)
        before, after = self.used_wh[segment], self.used_wh[segment + 1]
        return Points(
            segment=segment,
            share=share,
            stage=self.segment_stage[segment],
            time_s=time_s,
            place_m=place_m,
            stop_m=stop_m,
            stop_s=stop_s,
            stop_wh=stop_wh,
            used_wh=before + share * (after - before),
        )

    def flight_point(self, segment: int, share: float) -> FlightPoint:
        """Return where along the mission a point of the flight is."""
        return self.flight_points([(segment, share)])[0]

    def flight_points(self, places: Sequence[tuple[int, float]]) -> list[FlightPoint]:
        """Return where along the mission points of the flight are, by segment and share."""
        segment = np.array([segment for segment, _ in places])
        share = np.array([share for _, share in places])
        count = len(places)
        both = self.points(np.tile(segment, 2), np.concatenate((np.zeros(count), share)))
        # Inside a segment the way is taken to be straight.
        inside = both.place_m[count:] - both.place_m[:count]
        distance_m = self.flight.motion.segments.distance_m
        inside_m = np.minimum(np.hypot(inside[:, 0], inside[:, 1]), distance_m[segment])
        latitude_deg, longitude_deg = self.route.frame.latitude_longitude_deg(
            both.place_m[count:, 0], both.place_m[count:, 1]
        )
        points = []
        for row, stage in enumerate(both.stage[:count].tolist()):
            serving = np.flatnonzero(self.segment_stage == stage)
            before = serving[serving < segment[row]]
            points.append(
                FlightPoint(
                    item=self.route.stages[stage].item,
                    time_s=float(both.time_s[count + row]),
                    along_m=float(distance_m[before].sum() + inside_m[row]),
                    leg_m=float(distance_m[serving].sum()),
                    latitude_deg=float(latitude_deg[row]),
                    longitude_deg=float(longitude_deg[row]),
                )
            )
        return points

    def _stops(
        self, state: KinematicState, place_m: FloatArray, segment: IntArray, share: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where, when and at what energy vehicles in states stand still."""
        columns = self.flight.motion.segments
        speed = state.ground_speed_m_s
        moves = speed > _SLOWEST_M_S
        safe = np.where(moves, speed, 1.0)
        way_m, stop_s = self.pilot.stop(np.where(moves, speed, 0.0))
        stop_wh = wh_from_j(self._braking_power_w(state) * stop_s)
        brakes = columns.state[segment] == _BRAKE
        brake = np.minimum(segment + ~brakes, len(columns.item) - 1)
        brake_m = columns.distance_m[brake]
        # Written so that a distance that is not a number is no stop.
        stops = (
            (brakes | (columns.state[segment] == _CRUISE))
            & (columns.state[brake] == _BRAKE)
            & (np.abs(columns.stopping_distance_m[brake] - brake_m) <= 1e-6 * brake_m)
        )
        left = np.where(brakes, 1.0 - share, 1.0)
        stop_s = np.where(stops, left * columns.duration_s[brake], stop_s)
        stop_wh = np.where(stops, left * wh_from_j(self.flight.segment_energy_j[brake]), stop_wh)
        stop_m = place_m.copy()
        stop_m[:, 0] += way_m * state.east_m_s / safe
        stop_m[:, 1] += way_m * state.north_m_s / safe
        ahead = stops & ~brakes
        stop_m[ahead, 0] = (place_m[:, 0] + brake_m * state.east_m_s / safe)[ahead]
        stop_m[ahead, 1] = (place_m[:, 1] + brake_m * state.north_m_s / safe)[ahead]
        # A response may swing about the place where its leg ends: the next segment begins there.
        stands = np.flatnonzero(stops & brakes & (brake + 1 < len(columns.item)))
        if len(stands):
            after = self.first_piece[brake[stands] + 1]
            begin = self.flight.motion.state_at(after, np.zeros(len(after)))
            stop_m[stands, 0], stop_m[stands, 1] = begin.east_m, begin.north_m
        return stop_m, stop_s, stop_wh

    def _braking_power_w(self, state: KinematicState) -> FloatArray:
        """Return the mean power of stops from states. (n,) [W]"""
        column = np.zeros(len(state.height_m))[:, None]
        slowing = KinematicState(
            east_m=state.east_m[:, None] + column,
            north_m=state.north_m[:, None] + column,
            height_m=state.height_m[:, None] + np.zeros(len(_BRAKING_SHARES)),
            east_m_s=state.east_m_s[:, None] * _BRAKING_SHARES,
            north_m_s=state.north_m_s[:, None] * _BRAKING_SHARES,
            climb_m_s=column + np.zeros(len(_BRAKING_SHARES)),
        )
        braking = np.full(column.shape, _BRAKE)
        power_w = self.flight.power.power_w(
            slowing, braking, state.ground_speed_m_s[:, None] + column
        )
        mean_w: FloatArray = power_w @ _SIMPSON
        return mean_w

    def way(
        self, stand_m: FloatArray, stage: IntArray, destination: IntArray | int
    ) -> tuple[FloatArray, FloatArray]:
        """Return time and energy of ways from standing at points to landed. (n,) [s], (n,) [Wh]

        Parameters
        ----------
        stand_m : ndarray
            East, north, height above home; at least one. (n, 3) [m]
        stage : ndarray of int
            Stages flown when the way begins, which say what home is. (n,)
        destination : ndarray of int
            As in :meth:`Destinations.targets`. (n,)
        """
        time_s, state_j = self.way_by_state(stand_m, stage, destination)
        return time_s, wh_from_j(state_j.sum(axis=1))

    def way_by_state(
        self, stand_m: FloatArray, stage: IntArray, destination: IntArray | int
    ) -> tuple[FloatArray, FloatArray]:
        """Return time and energy by state of the ways of `way`. (n,) [s], (n, states) [J]"""
        targets = self.destinations.targets(stage, destination, stand_m)
        motion, transients = self.pilot.fly_home(stand_m, targets, self.route)
        energy_j = segment_energy_j(motion, transients, self.flight.power)
        time_s = np.zeros(len(stand_m))
        time_s += np.bincount(
            motion.segments.item, motion.segments.duration_s, minlength=len(stand_m)
        )
        return time_s, by_item_and_state_j(motion, energy_j, len(stand_m))

    def chosen(self, points: Points) -> IntArray:
        """Return the destination the vehicle itself chooses from points. (n,)"""
        return self.destinations.chosen(points.place_m, points.stage)

    def paths_m(
        self, points: Points, destination: IntArray | None = None
    ) -> tuple[FloatArray, ...]:
        """Return the corners of ways home: where it decides, stands, turns home, arrives, lands.

        Parameters
        ----------
        points : Points
            Where it is told to return. (n,)
        destination : ndarray of int, optional
            As in :meth:`Destinations.targets`; default what the vehicle itself chooses. (n,)

        Returns
        -------
        tuple of ndarray
            East, north, height above home of the corners of each, straight in between; along the
            mission its places instead of the arrival. (n times (5 or more, 3)) [m]
        """
        chosen = self.chosen(points) if destination is None else destination
        targets = self.destinations.targets(points.stage, chosen, points.stop_m)
        return _corners_m(points, targets, self.pilot)


def _corners_m(points: Points, targets: Targets, pilot: Pilot) -> tuple[FloatArray, ...]:
    height_m = pilot.return_heights_m(points.stop_m, targets)
    turn_m, over_m = points.stop_m.copy(), targets.ground_m.copy()
    turn_m[:, 2] = over_m[:, 2] = height_m
    corners = np.stack((points.place_m, points.stop_m, turn_m, over_m, targets.ground_m), axis=1)
    if not targets.ways:
        return tuple(corners)
    return tuple(
        own if way is None else np.vstack((own[:3], _along_m(way, own[2])))
        for own, way in zip(corners, targets.ways, strict=True)
    )


def _along_m(way: ReturnWay, start_m: FloatArray) -> FloatArray:
    """Return the corners of a way along the mission, from a place on. (m, 3) [m]"""
    corners: list[tuple[float, float, float]] = []
    height_m = float(start_m[2])
    for stage in way.stages:
        if stage.kind is not StageKind.GO:  # level to the place first
            corners.append((stage.east_m, stage.north_m, height_m))
        height_m = stage.height_m
        corners.append((stage.east_m, stage.north_m, height_m))
    return np.array(corners)


def by_item_and_state_j(motion: Motion, segment_j: FloatArray, items: int) -> FloatArray:
    """Return the energies of segments (n,) summed by item and state. (items, states) [J]"""
    at = motion.segments.item * len(STATES) + motion.segments.state
    total_j = np.zeros(items * len(STATES))
    total_j += np.bincount(at, segment_j, minlength=total_j.size)
    return total_j.reshape(items, -1)


def make_homeward(
    route: Route, flight: Flight, pilot: Pilot, destinations: Destinations
) -> Homeward:
    """Return the ways home of a flight of at least one segment."""
    motion = flight.motion
    columns = motion.segments
    count = len(columns.item)
    stage = np.searchsorted(np.maximum.accumulate(motion.done_segment), np.arange(count))
    return Homeward(
        route=route,
        flight=flight,
        pilot=pilot,
        destinations=destinations,
        segment_stage=np.minimum(stage, len(route.stages) - 1),
        used_wh=np.concatenate(([0.0], np.cumsum(wh_from_j(flight.segment_energy_j)))),
        start_s=columns.end_s - columns.duration_s,
        piece_start_s=motion.piece_start_s(),
        first_piece=np.searchsorted(motion.piece_segment, np.arange(count + 1)),
    )
