"""The way home from every stage: the energy to return and land from where each one ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.step_legs import Legs
from planner.flight.motion.step_response import fly_step_references
from planner.flight.prediction import default_speed_m_s, segment_energy_j
from planner.flight.state import STATE_INDEX, FlightState
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.flight.prediction import Flight
    from planner.mission.stage import Route
    from planner.vehicle.model import VehicleModel


def return_energy_j(
    route: Route, flight: Flight, vehicle: VehicleModel
) -> tuple[IntArray, FloatArray]:
    """Return the energy home from the end of every stage that ends in the air.

    The way home is a level leg to home at the height of the stage, at the model's own speed, and a
    landing there.

    Parameters
    ----------
    route : Route
        The route flown.
    flight : Flight
        Its prediction, for the air it is flown in.
    vehicle : VehicleModel
        A model of step references.

    Returns
    -------
    stage : ndarray of int
        Stages, as positions in ``route.stages``. (k,)
    energy_j : ndarray
        Energy home from the end of each. (k,) [J]
    """
    airborne = np.array(
        [
            index
            for index, stage in enumerate(route.stages)
            if stage.kind not in {StageKind.LAND, StageKind.RETURN}
        ],
        dtype=np.intp,
    )
    count = len(airborne)
    if not count:
        return airborne, np.zeros(0)
    stages = [route.stages[index] for index in airborne]
    legs = Legs(
        item=np.arange(count),
        start_m=np.array([(s.east_m, s.north_m, s.height_m) for s in stages]),
        end_m=np.zeros((count, 3)),
        speed_m_s=np.full(count, default_speed_m_s(vehicle)),
        hold_s=np.zeros(count),
        centre_m=np.zeros((count, 2)),
        circle_m=np.zeros(count),
        turns=np.zeros(count),
        climb_state=np.full(count, STATE_INDEX[FlightState.CLIMB]),
        descent_state=np.full(count, STATE_INDEX[FlightState.LAND]),
        rows=np.column_stack((np.arange(count), np.arange(count))),
    )
    motion, transients = fly_step_references(legs, vehicle.responses)
    energy_j = np.zeros(count)
    energy_j += np.bincount(
        motion.segments.item, segment_energy_j(motion, transients, flight.power), minlength=count
    )
    return airborne, energy_j
