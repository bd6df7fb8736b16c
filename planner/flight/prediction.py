"""A flight predicted: route and vehicle in, segments with their energy out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.motion.kinematics import (
    QUADRATURE_POINTS,
    QUADRATURE_WEIGHTS,
    SHORTEST_CHANGE_S,
    STATES,
    FlightState,
    KinematicState,
    greatest,
    quotient,
)
from planner.flight.power import SteadyPower
from planner.physics.atmosphere import SEA_LEVEL_PRESSURE_PA, standard_temperature_c
from planner.physics.quadrature import unit_derivative
from planner.physics.response import farthest_stop_s
from planner.quantity import mean_of
from planner.units import PASCALS_PER_HECTOPASCAL, wh_from_j
from planner.values import Value, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.flight.pilot import Pilot
    from planner.flight.power import Transients
    from planner.mission.route.stage import Route
    from planner.setup import Setup
    from planner.vehicle.model import VehicleModel

TRACE_STEP_S = 0.1
"""Time between samples. [s]"""
MOST_SAMPLES = 200_000
"""A flight of more than five and a half hours is sampled more coarsely, unless asked otherwise."""


class Segment(Value):
    """One part of a flight in one state."""

    index: int
    item: int
    """Mission item from 1 that asks for it, home not counted."""
    state: FlightState
    start_s: float
    duration_s: float
    distance_m: float
    """Horizontal distance flown. [m]"""
    climb_m: float
    """Change of height, negative downwards. [m]"""
    speed_m_s: float
    """Highest horizontal speed in the segment; vertical speed where it is only vertical. [m s⁻¹]"""
    energy_wh: float
    stopping_distance_m: float | None
    """Distance to stand still from its speed, for cruise and brake. [m]"""
    stopping_distance_m_p90: float | None = None
    """Exceeded by one flight of ten; ``None`` while the model carries no spread of it. [m]"""
    farthest_stop_m: float | None = None
    """How far such a stop gets, beyond where it ends if the vehicle swings back. [m]"""


class Segments(Sequence[Segment]):
    """The segments of a flight, made one by one where they are looked at.

    A survey of 10,000 items has 70,000 of them; its verdict needs only their columns.
    """

    __slots__ = ("_energy_j", "_motion", "_overshoot_s", "_stopping_factor_p90")

    def __init__(
        self,
        motion: Motion,
        energy_j: FloatArray,
        stopping_factor_p90: float | None,
        overshoot_s: float,
    ) -> None:
        self._motion = motion
        self._energy_j = energy_j
        self._stopping_factor_p90 = stopping_factor_p90
        self._overshoot_s = overshoot_s

    def __len__(self) -> int:
        return len(self._energy_j)

    @overload
    def __getitem__(self, index: int) -> Segment: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Segment, ...]: ...
    def __getitem__(self, index: int | slice) -> Segment | tuple[Segment, ...]:
        if isinstance(index, slice):
            return tuple(self._made(index))
        first = range(len(self))[index]
        return next(self._made(slice(first, first + 1)))

    def __iter__(self) -> Iterator[Segment]:
        return self._made(slice(None))

    def _made(self, rows: slice) -> Iterator[Segment]:
        columns = self.columns(rows)
        for row in zip(*columns.values(), strict=True):
            yield Segment(**dict(zip(columns, row, strict=True)))

    def columns(self, rows: slice = slice(None)) -> dict[str, list[Any]]:
        """Return the fields of segments by name, in their order, as lists."""
        columns = self._motion.segments
        stopping_m, speed_m_s = columns.stopping_distance_m[rows], columns.speed_m_s[rows]
        factor_p90 = np.nan if self._stopping_factor_p90 is None else self._stopping_factor_p90

        def known(values: FloatArray) -> list[float | None]:
            return [None if math.isnan(one) else one for one in values.tolist()]

        return {
            "index": [*range(len(self))[rows]],
            "item": columns.item[rows].tolist(),
            "state": [STATES[index] for index in columns.state[rows].tolist()],
            "start_s": self._motion.segment_start_s[rows].tolist(),
            "duration_s": columns.duration_s[rows].tolist(),
            "distance_m": columns.distance_m[rows].tolist(),
            "climb_m": columns.climb_m[rows].tolist(),
            "speed_m_s": speed_m_s.tolist(),
            "energy_wh": wh_from_j(self._energy_j[rows]).tolist(),
            "stopping_distance_m": known(stopping_m),
            "stopping_distance_m_p90": known(stopping_m * factor_p90),
            "farthest_stop_m": known(stopping_m + speed_m_s * self._overshoot_s),
        }


class ItemArrival(Value, kw_only=False):
    """When an item is reached and left, and what it took to get there."""

    item: int
    command: str
    arrival_s: float | None
    """From the start of the take-off, the first time; ``None`` where the item is not flown. [s]"""
    energy_used_wh: float | None
    """By then. [Wh]"""
    left_s: float | None = None
    """When it is done: after the hold at its place, where it has one. [s]"""
    later: tuple[tuple[float, float, float], ...] = ()
    """Arrival [s], energy used [Wh] and leaving [s] of every further pass, where a jump leads back."""


SPEED_ROUNDING = 1e-9
"""Part of a speed by which another that is the same may differ. [-]"""


class Extreme(Value):
    """A highest or lowest value, and where it is reached."""

    value: float
    segment: int


class Extremes(Value):
    """The box a flight stays in, at the nodes of its quadrature."""

    ground_speed_m_s: Extreme
    airspeed_m_s: Extreme
    climb_m_s: Extreme
    descent_m_s: Extreme
    """Lowest climb rate. [m s⁻¹]"""
    highest_m: float
    """Height above home. [m]"""
    lowest_m: float


def flight_extremes(
    state: KinematicState, airspeed_m_s: FloatArray, piece_segment: IntArray
) -> Extremes:
    """Return the extremes of a flight of at least one piece.

    ``state`` and ``airspeed_m_s`` are those at the nodes of every piece. (p, k)
    """
    nodes = airspeed_m_s.shape[1]

    def greatest_of(values: FloatArray, sign: float = 1.0) -> Extreme:
        values = sign * values
        most = float(values.max())
        # Of those that differ by rounding alone the first.
        place = (values >= most - SPEED_ROUNDING * abs(most)).argmax()
        return Extreme(value=sign * most, segment=int(piece_segment[place // nodes]))

    return Extremes(
        ground_speed_m_s=greatest_of(state.ground_speed_m_s),
        airspeed_m_s=greatest_of(airspeed_m_s),
        climb_m_s=greatest_of(state.climb_m_s),
        descent_m_s=greatest_of(state.climb_m_s, -1.0),
        highest_m=float(state.height_m.max()),
        lowest_m=float(state.height_m.min()),
    )


class PieceLoads(Value, eq=False):
    """What p pieces of a flight ask of a battery, whatever it is."""

    mean_w: FloatArray
    """(p,) [W]"""
    variance_w2: FloatArray
    """Mean square about it. (p,) [W²]"""
    peak_w: FloatArray
    """Highest, at the nodes. (p,) [W]"""
    end_w: FloatArray
    """At the last node. (p,) [W]"""


HOVER_HEIGHT_M = 10.0
"""Height over home of the hover a reserve is counted in: low, over the landing place. [m]"""


class Flight(Value, eq=False, dict=True):
    """A predicted flight, as columns."""

    motion: Motion
    transients: Transients
    power: SteadyPower
    segment_energy_j: FloatArray
    """Energy of each segment, windows counted with the segment that begins them. (n,) [J]"""
    node_s: FloatArray
    """Times of the nodes of the quadrature of each piece, since it began. (p, k) [s]"""
    node_state: KinematicState
    """Where the vehicle is and how it moves at these nodes. (p, k)"""
    node_steady_w: FloatArray
    """Power there without the transients. (p, k) [W]"""
    stopping_factor_p90: float | None = None
    """Factor on stopping distances that one flight of ten exceeds; ``None``: not known. [-]"""
    overshoot_s: float = 0.0
    """How much farther a stop gets than where it ends, over the speed it begins from. [s]"""

    @cached_property
    def node_power_w(self) -> FloatArray:
        """Power at the nodes of the quadrature of each piece. (p, k) [W]"""
        if not len(self.transients.start_s):
            return self.node_steady_w
        return self.node_steady_w + self._transients_w[0]

    @cached_property
    def _peak_s(self) -> FloatArray:
        """When the windows of transients are at their highest, since the start of the flight. [s]"""
        return np.minimum(self.transients.peak_times_s(), self.time_s)

    @cached_property
    def _transients_w(self) -> tuple[FloatArray, FloatArray]:
        """What transients add at the nodes of the quadrature, and at their peaks. (p, k) [W], [W]"""
        since_start_s = self.motion.piece_start_s[:, None] + self.node_s
        times_s = np.concatenate((since_start_s.ravel(), self._peak_s))
        total_w, count = self.transients.total_power_w(times_s), since_start_s.size
        return total_w[:count].reshape(since_start_s.shape), total_w[count:]

    @cached_property
    def loads(self) -> PieceLoads:
        """What its pieces ask of a battery."""
        node_w = self.node_power_w
        mean_w = node_w @ QUADRATURE_WEIGHTS
        return PieceLoads(
            mean_w=mean_w,
            variance_w2=np.square(node_w - mean_w[:, None]) @ QUADRATURE_WEIGHTS,
            peak_w=greatest(node_w),
            end_w=node_w[:, -1],
        )

    @cached_property
    def hover_near_home_w(self) -> float:
        """Power of a hover low over home, in the wind of the day. [W]"""
        return float(self.power.hover_w(np.array([[0.0, 0.0, HOVER_HEIGHT_M]]))[0])

    @cached_property
    def extremes(self) -> Extremes | None:
        """The box the flight stays in; ``None`` where nothing is flown."""
        if not self.node_s.size:
            return None
        airspeed_m_s = self.power.airspeed_m_s(self.node_state)
        return flight_extremes(self.node_state, airspeed_m_s, self.motion.piece_segment)

    def leading(self, items: int) -> Flight:
        """Return the flights of the first items alone, of those that are flights of their own."""
        motion, transients = self.motion.flights(np.arange(items)), self.transients
        pieces, segments = len(motion.piece_segment), len(motion.segments.item)
        return replace(
            self,
            motion=motion,
            transients=transients.select(transients.segment < segments),
            segment_energy_j=self.segment_energy_j[:segments],
            node_s=self.node_s[:pieces],
            node_state=self.node_state.select(slice(pieces)),
            node_steady_w=self.node_steady_w[:pieces],
        )

    def in_equal_power(self, power: SteadyPower) -> Flight:
        """Return the same flight with a power that counts the same."""
        same, known = replace(self, power=power), vars(self)
        vars(same).update({name: known[name] for name in _OF_POWER if name in known})
        return same

    def with_stops(self, factor_p90: float) -> Flight:
        """Return the same flight with the factor on stopping distances that one of ten exceeds."""
        same = replace(self, stopping_factor_p90=factor_p90)
        vars(same).update(vars(self))  # nothing that is worked out of a flight depends on it
        return same

    @property
    def segments(self) -> Segments:
        """The segments one by one."""
        return Segments(
            self.motion, self.segment_energy_j, self.stopping_factor_p90, self.overshoot_s
        )

    @cached_property
    def peak_power_w(self) -> float:
        """Highest power, at the nodes of the quadrature or the peak of a transient. [W]"""
        highest_w = float(np.max(self.node_power_w, initial=0.0))
        if not len(self.transients.start_s):
            return highest_w
        peaks_w = self._steady_w(self._peak_s) + self._transients_w[1]
        return float(np.max(peaks_w, initial=highest_w))

    @cached_property
    def time_s(self) -> float:
        """Duration of the flight. [s]"""
        return float(self.motion.segments.duration_s.sum())

    @cached_property
    def energy_j(self) -> float:
        """Energy of the flight. [J]"""
        return float(self.segment_energy_j.sum())

    def power_w(self, time_s: FloatArray) -> FloatArray:
        """Return the electrical power at times since the start of the flight. [W]"""
        return self._steady_w(time_s) + self.transients.total_power_w(time_s)

    def _steady_w(self, time_s: FloatArray) -> FloatArray:
        """Return the power at such times without the transients. [W]"""
        motion = self.motion
        piece, own_s = motion.piece_at(time_s)
        state = motion.state_at(piece, own_s)
        changes = self._acceleration_m_s2(piece, own_s)
        return _steady_power_w(motion, piece, state, self.power, changes)

    def _acceleration_m_s2(self, piece: IntArray, own_s: FloatArray) -> FloatArray | None:
        """Return the acceleration at times of pieces, by the velocities at their nodes. (3, n) [m s⁻²]

        ``None`` where the power does not depend on it.
        """
        if not self.power.vehicle.knows_acceleration:
            return None
        duration_s = self.motion.piece_duration_s[piece]
        of_nodes = unit_derivative(QUADRATURE_POINTS, quotient(own_s, duration_s))
        nodes = self.node_state.velocity_m_s[piece]
        changes = np.einsum("nk,nka->an", of_nodes, nodes)
        return quotient(changes, duration_s, above=SHORTEST_CHANGE_S)

    def power_of_airspeed_w(self, time_s: FloatArray, against_m_s: FloatArray) -> FloatArray:
        """Return how much more it takes to fly faster through the air at times, by (t, 2) [m s⁻¹]. (t,) [W]

        None where the model's power has no term of airspeed.
        """
        motion = self.motion
        piece, own_s = motion.piece_at(time_s)
        calm = motion.state_at(piece, own_s)
        blown = replace(
            calm,
            east_m_s=calm.east_m_s + against_m_s[:, 0],
            north_m_s=calm.north_m_s + against_m_s[:, 1],
        )
        changes = self._acceleration_m_s2(piece, own_s)
        calm_w, blown_w = (
            _steady_power_w(motion, piece, one, self.power, changes) for one in (calm, blown)
        )
        return blown_w - calm_w


_OF_POWER = ("node_power_w", "loads", "hover_near_home_w", "peak_power_w")
"""What a flight works out of its power, whatever the air besides."""


def predict_flight(route: Route, setup: Setup, pilot: Pilot) -> Flight:
    """Return the flight of a vehicle along a route of at least one stage.

    Energy is by Gauss-Legendre quadrature of the steady power over each piece of motion in closed form, plus
    the exact integrals of the transients.
    """
    motion, transients = pilot.fly(route)
    return make_flight(motion, transients, steady_power(route, setup))


def predict_costs(
    routes: Sequence[Route], setup: Setup, pilot: Pilot
) -> tuple[FloatArray, FloatArray]:
    """Return the energies and times of flights along n routes from one home, at least one. (n,) [J], (n,) [s]

    As `predict_flight` has them, but for the rounding of times.
    """
    power, count = steady_power(routes[0], setup), len(routes)
    energy_j, time_s = np.zeros((2, count))
    for motion, transients in pilot.fly_all(routes):
        columns = motion.segments
        [own_j] = segment_energies_j(motion, transients, (power,))
        energy_j += np.bincount(columns.item, own_j, count)
        time_s += np.bincount(columns.item, columns.duration_s, count)
    return energy_j, time_s


def steady_power(route: Route, setup: Setup) -> SteadyPower:
    """Return the power of the vehicle of a setup, over the home of a route."""
    vehicle = setup.vehicle
    return SteadyPower(
        vehicle=vehicle,
        mass_kg=setup.flown_mass_kg,
        home_amsl_m=route.home_amsl_m,
        home_temperature_c=(
            standard_temperature_c(route.home_amsl_m)
            if setup.temperature_c is None
            else mean_of(setup.temperature_c)
        ),
        wind=setup.wind,
        sea_level_pressure_pa=(
            SEA_LEVEL_PRESSURE_PA
            if setup.pressure_hpa is None
            else setup.pressure_hpa * PASCALS_PER_HECTOPASCAL
        ),
    )


def make_flight(motion: Motion, transients: Transients, power: SteadyPower) -> Flight:
    """Return a motion with its power and energy."""
    nodes = motion.nodes
    changes = motion.node_acceleration_m_s2 if power.vehicle.knows_acceleration else None
    steady_w = _steady_power_w(motion, nodes.piece, nodes.state, power, changes)
    return Flight(
        motion=motion,
        transients=transients,
        power=power,
        segment_energy_j=_segment_energy_j(motion, transients, steady_w),
        node_s=nodes.time_s,
        node_state=nodes.state,
        node_steady_w=steady_w,
        overshoot_s=_overshoot_s(power.vehicle),
    )


def _overshoot_s(vehicle: VehicleModel) -> float:
    """Return by how much a stop passes where it ends, over the speed; autopilots brake to a point. [s]"""
    response = vehicle.responses.speed
    if vehicle.reference is not Autopilot.STEP or response is None:
        return 0.0
    system = response.transfer_function
    return farthest_stop_s(system) - system.mean_residence_time_s


def segment_energies_j(
    motion: Motion, transients: Transients, powers: Iterable[SteadyPower]
) -> Iterator[FloatArray]:
    """Yield the energy of each segment of one motion by several powers. (n,) [J]"""
    nodes = motion.nodes
    for power in powers:
        changes = motion.node_acceleration_m_s2 if power.vehicle.knows_acceleration else None
        steady_w = _steady_power_w(motion, nodes.piece, nodes.state, power, changes)
        yield _segment_energy_j(motion, transients, steady_w)


def _steady_power_w(
    motion: Motion,
    piece: IntArray,
    state: KinematicState,
    power: SteadyPower,
    acceleration_m_s2: FloatArray | None,
) -> FloatArray:
    """Return the steady power of pieces, (n,) or (n, 1), in states, (n,) or (n, k). [W]"""
    segment = motion.piece_segment[piece]
    grounded, fall_m_s = motion.piece_is_grounded, motion.piece_fall_m_s
    if fall_m_s is not None:
        state = replace(state, climb_m_s=state.climb_m_s + fall_m_s[piece])
    return power.power_w(
        state,
        motion.segments.state[segment],
        motion.segments.speed_m_s[segment],
        None if grounded is None else grounded[piece],
        acceleration_m_s2,
    )


def _segment_energy_j(motion: Motion, transients: Transients, steady_w: FloatArray) -> FloatArray:
    count = len(motion.segments.item)
    steady_j = steady_w @ QUADRATURE_WEIGHTS * motion.piece_duration_s
    energy_j = np.bincount(motion.piece_segment, steady_j, count).astype(np.float64)
    energy_j += np.bincount(transients.segment, transients.energy_j(), count)
    return energy_j


def used_energy_wh(flight: Flight, time_s: FloatArray, power_w: FloatArray) -> FloatArray:
    """Return the energy used by times, rising from 0, with the power at each: exact where segments end."""
    ends_s = np.append(0.0, flight.motion.segments.end_s)
    ends_wh = np.append(0.0, np.cumsum(wh_from_j(flight.segment_energy_j)))
    steps_j = 0.5 * (power_w[1:] + power_w[:-1]) * np.diff(time_s)
    rough_wh: FloatArray = np.append(0.0, np.cumsum(wh_from_j(steps_j)))
    missing_wh = ends_wh - np.interp(ends_s, time_s, rough_wh)
    used_wh: FloatArray = rough_wh + np.interp(time_s, ends_s, missing_wh)
    return used_wh


class Trace(Value, eq=False):
    """Samples of a flight as columns of one length, the segment boundaries among them."""

    time_s: FloatArray
    segment: IntArray
    item: IntArray
    state: tuple[str, ...]
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_above_home_m: FloatArray
    altitude_amsl_m: FloatArray
    """NaN where the altitude of home is not known."""
    ground_speed_m_s: FloatArray
    climb_rate_m_s: FloatArray
    power_w: FloatArray

    def columns(self) -> dict[str, FloatArray | IntArray | tuple[str, ...]]:
        """Return the columns by name, in the order they are written."""
        return field_values(self)


def sample_trace(flight: Flight, route: Route, *, most_samples: int = MOST_SAMPLES) -> Trace:
    """Return a flight sampled at even times and at the boundaries of its segments.

    The last sample of a flight that lands is on the ground: a response of reference steps ends at its
    last metre.  The integral of the power is the energy of the flight, but for a window of a transient
    that the landing cuts short.
    """
    segments = flight.motion.segments
    end_s = segments.end_s
    step_s = max(TRACE_STEP_S, flight.time_s / most_samples)
    even_s = np.arange(0.0, flight.time_s, step_s)
    time_s = np.union1d(even_s, np.concatenate(([0.0], end_s)))
    segment = np.minimum(np.searchsorted(end_s, time_s, side="right"), len(end_s) - 1)
    state = flight.motion.state_at_time(time_s)
    height_m, climb_m_s = state.height_m.copy(), state.climb_m_s.copy()
    last = route.stages[-1]
    lands = STATES[segments.state[-1]] is FlightState.LAND and last.return_path is None
    if lands and height_m[-1] > last.height_m:
        height_m[-1], climb_m_s[-1] = last.height_m, 0.0
    latitude_deg, longitude_deg = route.frame.latitude_longitude_deg(state.east_m, state.north_m)
    return Trace(
        time_s=time_s,
        segment=segment,
        item=segments.item[segment],
        state=tuple(STATES[index].value for index in segments.state[segment].tolist()),
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_above_home_m=height_m,
        altitude_amsl_m=height_m + (route.home_amsl_m if route.knows_home_amsl else np.nan),
        ground_speed_m_s=state.ground_speed_m_s,
        climb_rate_m_s=climb_m_s,
        power_w=flight.power_w(time_s),
    )
