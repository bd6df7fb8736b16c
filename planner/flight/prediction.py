"""A flight predicted: route and vehicle in, segments with their energy out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.power import SteadyPower
from planner.flight.segments import Segments
from planner.frozen import frozen
from planner.physics.atmosphere import standard_temperature_c
from planner.physics.quadrature import unit_quadrature

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.flight.conditions import Conditions
    from planner.flight.motion.kinematics import (
        KinematicState,
        Motion,
    )
    from planner.flight.pilot import Pilot
    from planner.flight.power import Transients
    from planner.mission.route.stage import Route
    from planner.vehicle.model import VehicleModel


@frozen
class Extreme:
    """A highest or lowest value, and where it is reached."""

    value: float
    segment: int


@frozen
class Extremes:
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
    """Return the extremes of a flight.

    Parameters
    ----------
    state : KinematicState
        At the nodes of every piece. (p, k)
    airspeed_m_s : ndarray
        Horizontal speed through the air there. (p, k) [m s⁻¹]
    piece_segment : ndarray of int
        The segment of each piece. (p,)

    Returns
    -------
    Extremes
        Of at least one piece.
    """
    nodes = airspeed_m_s.shape[1]

    def at(values: FloatArray, place: np.intp) -> Extreme:
        return Extreme(
            value=float(values[np.unravel_index(place, values.shape)]),
            segment=int(piece_segment[place // nodes]),
        )

    ground_m_s, climb_m_s = state.ground_speed_m_s, state.climb_m_s
    return Extremes(
        ground_speed_m_s=at(ground_m_s, np.argmax(ground_m_s)),
        airspeed_m_s=at(airspeed_m_s, np.argmax(airspeed_m_s)),
        climb_m_s=at(climb_m_s, np.argmax(climb_m_s)),
        descent_m_s=at(climb_m_s, np.argmin(climb_m_s)),
        highest_m=float(state.height_m.max()),
        lowest_m=float(state.height_m.min()),
    )


# Gauss-Legendre on [0, 1]: exact to degree 7; against 32 nodes within 1e-5 on the sample missions.
QUADRATURE_NODES, QUADRATURE_WEIGHTS = unit_quadrature(4)


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight:
    """A predicted flight, as columns."""

    motion: Motion
    transients: Transients
    power: SteadyPower
    segment_energy_j: FloatArray
    """Energy of each segment, windows counted with the segment that begins them. (n,) [J]"""
    node_power_w: FloatArray
    """Power at the nodes of the quadrature of each piece. (p, k) [W]"""
    extremes: Extremes | None
    """The box the flight stays in; ``None`` where nothing is flown."""
    stopping_factor_p90: float | None = None
    """Factor on stopping distances that one flight of ten exceeds; ``None``: not known. [-]"""

    @property
    def segments(self) -> Segments:
        """The segments one by one."""
        return Segments(
            self.motion.segments,
            self.segment_energy_j,
            stopping_factor_p90=self.stopping_factor_p90,
        )

    @cached_property
    def peak_power_w(self) -> float:
        """Highest power, at the nodes of the quadrature or the peak of a transient. [W]"""
        peaks = self.power_w(np.minimum(self.transients.peak_times_s(), self.time_s))
        return float(np.max(self.node_power_w, initial=np.max(peaks, initial=0.0)))

    @property
    def time_s(self) -> float:
        """Duration of the flight. [s]"""
        return float(self.motion.segments.duration_s.sum())

    @property
    def energy_j(self) -> float:
        """Energy of the flight. [J]"""
        return float(self.segment_energy_j.sum())

    def power_w(self, time_s: FloatArray) -> FloatArray:
        """Return the electrical power at times since the start of the flight. [W]"""
        motion = self.motion
        piece, own_s = motion.piece_at(time_s)
        steady_w = _steady_power_w(motion, piece, motion.state_at(piece, own_s), self.power)
        return steady_w + self.transients.total_power_w(time_s)


def predict_flight(
    route: Route, vehicle: VehicleModel, conditions: Conditions, pilot: Pilot
) -> Flight:
    """Return the flight of a vehicle along a route.

    Parameters
    ----------
    route : Route
        At least one stage.
    vehicle : VehicleModel
        What power it takes.
    conditions : Conditions
        Air and load.
    pilot : Pilot
        How it moves.

    Returns
    -------
    Flight
        Energy by Gauss-Legendre quadrature of the steady power over each piece of motion in closed
        form, plus the exact integrals of the transients.
    """
    motion, transients = pilot.fly(route)
    power = SteadyPower(
        vehicle=vehicle,
        mass_kg=None if vehicle.mass_kg is None else vehicle.mass_kg + conditions.payload_kg,
        home_amsl_m=route.home_amsl_m,
        home_temperature_c=(
            standard_temperature_c(route.home_amsl_m)
            if conditions.temperature_c is None
            else conditions.temperature_c
        ),
        wind=conditions.wind,
    )
    return make_flight(motion, transients, power)


def make_flight(motion: Motion, transients: Transients, power: SteadyPower) -> Flight:
    """Return a motion with its power and energy."""
    piece, node_s = _nodes(motion)
    state = motion.state_at(piece, node_s)
    steady_w = _steady_power_w(motion, piece, state, power)
    at_nodes_w = steady_w + transients.total_power_w(motion.piece_start_s()[:, None] + node_s)
    return Flight(
        motion=motion,
        transients=transients,
        power=power,
        segment_energy_j=_segment_energy_j(motion, transients, steady_w),
        node_power_w=at_nodes_w,
        extremes=(
            flight_extremes(state, power.airspeed_m_s(state), motion.piece_segment)
            if node_s.size
            else None
        ),
    )


def segment_energies_j(
    motion: Motion, transients: Transients, powers: Iterable[SteadyPower]
) -> Iterator[FloatArray]:
    """Yield the energy of each segment of one motion by several powers. (n,) [J]"""
    piece, node_s = _nodes(motion)
    state = motion.state_at(piece, node_s)
    for power in powers:
        steady_w = _steady_power_w(motion, piece, state, power)
        yield _segment_energy_j(motion, transients, steady_w)


def _nodes(motion: Motion) -> tuple[IntArray, FloatArray]:
    """Return the pieces (p, 1) and the times of the nodes of their quadrature (p, k). [s]"""
    return (
        np.arange(len(motion.piece_segment))[:, None],
        QUADRATURE_NODES * motion.piece_duration_s[:, None],
    )


def _steady_power_w(
    motion: Motion, piece: IntArray, state: KinematicState, power: SteadyPower
) -> FloatArray:
    """Return the steady power of pieces, (n,) or (n, 1), in states, (n,) or (n, k). [W]"""
    segment = motion.piece_segment[piece]
    grounded = motion.piece_is_grounded
    return power.power_w(
        state,
        motion.segments.state[segment],
        motion.segments.speed_m_s[segment],
        None if grounded is None else grounded[piece],
    )


def _segment_energy_j(motion: Motion, transients: Transients, steady_w: FloatArray) -> FloatArray:
    count = len(motion.segments.item)
    steady_j = steady_w @ QUADRATURE_WEIGHTS * motion.piece_duration_s
    energy_j = np.zeros(count)
    energy_j += np.bincount(motion.piece_segment, weights=steady_j, minlength=count)
    energy_j += np.bincount(transients.segment, transients.energy_j(), minlength=count)
    return energy_j
