from __future__ import annotations

import pytest

from planner.autopilot import Autopilot
from planner.mission.commands import (
    Command,
    CommandEffect,
    Support,
    command_effect,
    load_command_table,
    support,
)


@pytest.mark.parametrize(
    ("command", "effect"),
    [
        (Command.NAV_WAYPOINT, CommandEffect.MODELLED),
        (Command.NAV_LAND, CommandEffect.MODELLED),
        (Command.DO_JUMP, CommandEffect.MODELLED),
        (Command.DO_SET_CAM_TRIGG_DIST, CommandEffect.NO_EFFECT),
        (Command.DO_LAND_START, CommandEffect.NO_EFFECT),
        (Command.NAV_PAYLOAD_PLACE, CommandEffect.NOT_MODELLED),
        (Command.NAV_GUIDED_ENABLE, CommandEffect.NOT_MODELLED),
        (211, CommandEffect.NOT_MODELLED),
        (246, CommandEffect.NOT_MODELLED),
        (50001, CommandEffect.NOT_MODELLED),
        (Command.NAV_VTOL_TAKEOFF, CommandEffect.NOT_MULTICOPTER),
        (Command.DO_SET_REVERSE, CommandEffect.NOT_MULTICOPTER),
        (Command.NAV_RALLY_POINT, CommandEffect.FENCE_RALLY),
        (Command.NAV_FENCE_RETURN_POINT, CommandEffect.FENCE_RALLY),
    ],
)
def test_a_command_has_one_effect(command: int, effect: CommandEffect) -> None:
    assert command_effect(command) is effect


def test_no_command_that_moves_or_holds_the_vehicle_has_no_effect() -> None:
    for number, definition in load_command_table().commands.items():
        if definition.name.startswith("NAV_") and definition.name != "NAV_ROI":
            assert command_effect(number) is not CommandEffect.NO_EFFECT


@pytest.mark.parametrize(
    ("command", "px4", "ardupilot"),
    [
        # Facts read in the autopilots' sources, which planner.mission.commands names.
        (Command.NAV_WAYPOINT, Support.ACCEPTED, Support.ACCEPTED),
        (Command.NAV_LOITER_TURNS, Support.REFUSED, Support.ACCEPTED),
        (Command.NAV_SPLINE_WAYPOINT, Support.REFUSED, Support.ACCEPTED),
        (Command.NAV_PAYLOAD_PLACE, Support.REFUSED, Support.ACCEPTED),
        (Command.CONDITION_YAW, Support.REFUSED, Support.ACCEPTED),
        (Command.CONDITION_DELAY, Support.BLOCKS_ARMING, Support.ACCEPTED),
        (Command.CONDITION_DISTANCE, Support.BLOCKS_ARMING, Support.ACCEPTED),
        (Command.NAV_VTOL_TAKEOFF, Support.BLOCKS_ARMING, Support.ACCEPTED),
        (Command.DO_VTOL_TRANSITION, Support.BLOCKS_ARMING, Support.SKIPPED),
        (Command.NAV_CONTINUE_AND_CHANGE_ALT, Support.REFUSED, Support.SKIPPED),
        (Command.NAV_SET_YAW_SPEED, Support.REFUSED, Support.SKIPPED),
        (Command.NAV_ARC_WAYPOINT, Support.REFUSED, Support.UNKNOWN),
        (Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION, Support.BLOCKS_ARMING, Support.REFUSED),
        (183, Support.REFUSED, Support.ACCEPTED),
        (50001, Support.REFUSED, Support.REFUSED),
    ],
)
def test_each_autopilot_answers_for_itself(command: int, px4: Support, ardupilot: Support) -> None:
    assert support(command, Autopilot.PX4) is px4
    assert support(command, Autopilot.ARDUPILOT) is ardupilot


@pytest.mark.parametrize(
    ("command", "frame", "expected"),
    [
        (Command.NAV_WAYPOINT, 3, Support.ACCEPTED),
        (Command.NAV_WAYPOINT, 6, Support.ACCEPTED),
        (Command.NAV_WAYPOINT, 2, Support.REFUSED),
        (Command.NAV_WAYPOINT, 10, Support.REFUSED),
        (Command.NAV_RETURN_TO_LAUNCH, 2, Support.ACCEPTED),
        (Command.NAV_RETURN_TO_LAUNCH, 3, Support.REFUSED),
        (Command.NAV_DELAY, 0, Support.REFUSED),
        (Command.DO_LAND_START, 3, Support.REFUSED),
        (Command.CONDITION_DELAY, 2, Support.BLOCKS_ARMING),
        (Command.DO_SET_ROI, 2, Support.ACCEPTED),
        (Command.DO_SET_ROI, 3, Support.ACCEPTED),
        (187, 2, Support.UNKNOWN),
    ],
)
def test_px4_wants_each_command_in_its_frame(command: int, frame: int, expected: Support) -> None:
    assert support(command, Autopilot.PX4, frame=frame) is expected


def test_ardupilot_takes_commands_without_a_place_in_any_frame() -> None:
    assert support(Command.NAV_RETURN_TO_LAUNCH, Autopilot.ARDUPILOT, frame=0) is Support.ACCEPTED


def test_step_references_accept_everything() -> None:
    assert support(50001, Autopilot.STEP) is Support.ACCEPTED
