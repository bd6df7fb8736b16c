"""Flights of PX4 by their stages and conditions: one, or the returns from places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.flight.motion.px4.pilot import Px4Pilot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import Motion
    from planner.flight.returns.destination import ReturnTargets
    from planner.mission.route.stage import Stage
    from planner.vehicle.parameters.px4 import Px4Parameters


def fly_px4(
    stages: Sequence[Stage],
    parameters: Px4Parameters,
    **conditions: Any,  # noqa: ANN401 - those of `Px4Pilot`
) -> Motion:
    """Return the flight along stages."""
    return Px4Pilot(parameters=parameters, **conditions).flown(stages)


def px4_returns(
    places_m: FloatArray,
    targets: ReturnTargets,
    parameters: Px4Parameters,
    **conditions: Any,  # noqa: ANN401 - those of `Px4Pilot`
) -> Motion:
    """Return the returns from places."""
    return Px4Pilot(parameters=parameters, **conditions).fly_returns(places_m, targets)[0]
