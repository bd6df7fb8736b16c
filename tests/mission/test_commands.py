from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from generate_mavlink_commands import TARGET, make_table, write_table
from pymavlink.dialects.v20 import ardupilotmega, common

from planner.mission.commands import (
    Command,
    Frame,
    command_name,
    frame_name,
    has_location,
    is_destination,
    load_command_table,
    parameter_names,
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
