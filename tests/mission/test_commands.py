"""MAVLink's commands, and what each autopilot does with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from generate_mavlink_commands import TARGET, make_table, write_table
from pymavlink.dialects.v20 import ardupilotmega, common

from planner.autopilot import Autopilot
from planner.mission.commands import (
    Command,
    CommandEffect,
    Frame,
    Support,
    command_effect,
    command_name,
    frame_name,
    has_location,
    is_destination,
    load_command_table,
    parameter_names,
    support,
)

if TYPE_CHECKING:
    from pathlib import Path


def test_the_data_file_is_what_the_generator_writes(tmp_path: Path) -> None:
    write_table(tmp_path / "commands.json")
    assert TARGET.read_text("utf-8") == (tmp_path / "commands.json").read_text("utf-8")


def test_names_and_locations_are_those_of_pymavlinks_own_tables() -> None:
    table = load_command_table()
    for dialect in (common, ardupilotmega):
        for number, entry in dialect.enums["MAV_CMD"].items():
            if entry.name == "MAV_CMD_ENUM_END":
                continue
            assert "MAV_CMD_" + table.commands[number].name == entry.name
            assert table.commands[number].has_location == entry.has_location
        for number, entry in dialect.enums["MAV_FRAME"].items():
            if entry.name != "MAV_FRAME_ENUM_END":
                assert "MAV_FRAME_" + table.frames[number] == entry.name


def test_the_named_commands_and_frames_are_mavlinks() -> None:
    assert {command.name: int(command) for command in Command} == {
        command_name(command): int(command) for command in Command
    }
    assert {frame.name: int(frame) for frame in Frame} == {
        frame_name(frame): int(frame) for frame in Frame
    }


def test_every_command_has_seven_parameter_names() -> None:
    assert all(len(c.parameters) == 7 for c in load_command_table().commands.values())
    assert all(len(row) == 10 for row in make_table()["commands"].values())


def test_parameters_have_the_names_the_standard_gives_them() -> None:
    assert parameter_names(16) == (
        "Hold",
        "Accept Radius",
        "Pass Radius",
        "Yaw",
        "Latitude",
        "Longitude",
        "Altitude",
    )
    assert parameter_names(177)[:2] == ("Number", "Repeat")
    assert parameter_names(178)[2:] == ("Throttle", "", "", "", "")


@pytest.mark.parametrize(
    ("number", "name"), [(16, "NAV_WAYPOINT"), (5001, "NAV_FENCE_POLYGON_VERTEX_INCLUSION")]
)
def test_a_command_is_named_without_its_prefix(number: int, name: str) -> None:
    assert command_name(number) == name


def test_numbers_that_mavlink_does_not_know_are_named_by_their_number() -> None:
    assert command_name(50001) == "MAV_CMD 50001"
    assert frame_name(99) == "MAV_FRAME 99"
    assert parameter_names(50001) == ("",) * 7
    assert not has_location(50001)


def test_a_place_to_look_at_is_no_place_to_go_to() -> None:
    assert [has_location(command) for command in (16, 195, 177)] == [True, True, False]
    assert [is_destination(command) for command in (16, 195, 177)] == [True, False, False]


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
        # Uploaded to ArduCopter 4.7.0-dev and PX4 1.17: MAV_MISSION_UNSUPPORTED, or flown past.
        (198, Support.REFUSED, Support.REFUSED),  # DO_SET_ROI_SYSID
        (204, Support.ACCEPTED, Support.REFUSED),  # DO_MOUNT_CONFIGURE
        (214, Support.ACCEPTED, Support.REFUSED),  # DO_SET_CAM_TRIGG_INTERVAL
        (530, Support.ACCEPTED, Support.REFUSED),  # SET_CAMERA_MODE
        (531, Support.REFUSED, Support.ACCEPTED),  # SET_CAMERA_ZOOM
        (534, Support.UNKNOWN, Support.ACCEPTED),  # SET_CAMERA_SOURCE
        (2004, Support.REFUSED, Support.REFUSED),  # CAMERA_TRACK_POINT
        (193, Support.REFUSED, Support.SKIPPED),  # DO_PAUSE_CONTINUE
        (176, Support.REFUSED, Support.UNKNOWN),  # DO_SET_MODE
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
