"""The way home from every stage: the energy to return and land from where each one ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.prediction import segment_energy_j
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.flight.pilot import Pilot
    from planner.flight.power import SteadyPower
    from planner.mission.stage import Route


def return_energy_j(route: Route, pilot: Pilot, power: SteadyPower) -> tuple[IntArray, FloatArray]:
    """Return the energy home from the end of every stage that ends in the air.

    Parameters
    ----------
    route : Route
        The route flown.
    pilot : Pilot
        Who flies home, by its own rules.
    power : SteadyPower
        What flying costs in the air of the day.

    Returns
    -------
    stage : ndarray of int
        Stages, as positions in ``route.stages``. (k,)
    energy_j : ndarray
        Energy home from the end of each. (k,) [J]
    """
    airborne = [
        index
        for index, stage in enumerate(route.stages)
        if stage.kind not in {StageKind.LAND, StageKind.RETURN}
    ]
    count = len(airborne)
    energy_j = np.zeros(count)
    if airborne:
        points_m = np.array(
            [(s.east_m, s.north_m, s.height_m) for s in (route.stages[i] for i in airborne)]
        )
        motion, transients = pilot.fly_home(points_m, route)
        energy_j += np.bincount(
            motion.segments.item, segment_energy_j(motion, transients, power), minlength=count
        )
    return np.array(airborne, dtype=np.intp), energy_j
