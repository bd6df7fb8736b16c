"""A process that is killed while it uploads: no mission is left without its fence."""

from __future__ import annotations

import socket
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from fenced_missions import box
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import free_port, wire

from planner.autopilot import Autopilot
from planner.geo.fence import Fence
from planner.link.address import LinkAddress, LinkKind
from planner.link.mission import MissionKind
from planner.link.upload import is_same
from planner.mission.formats.writers import plan_text
from planner.simulator.wire import SimulationRunner
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from planner.link.mission import WireItem
    from planner.simulator.wire import PassedMessage

    Lists = Mapping[MissionKind, tuple[WireItem, ...]]

FENCED = replace(
    mission(takeoff(35.0), waypoint(300.0, 35.0), waypoint(600.0, 35.0), rtl()),
    fence=Fence(polygons=(box(-700.0, -700.0, 700.0, 2500.0),)),
)
OPEN = replace(FENCED, fence=None)
CHECK = (
    "--vehicle",
    "arducopter-sitl-quad",
    "--battery",
    "177Wh",
    "--yes",
    "--force",
    "--listen",
    "0",
)
UPLOAD = "import sys; from planner.cli.main import main; sys.exit(main(['upload', *sys.argv[1:]]))"
SENT = frozenset({"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_CLEAR_ALL"})


def killed_upload(
    folder: Path, autopilot: Autopilot, *, is_fenced: bool, at: int | None
) -> tuple[Lists, Lists, bool]:
    """Kill an upload by its n-th message of a list; return what the vehicle had, has, and whether it was."""
    plan = folder / "new.plan"
    plan.write_text(plan_text(FENCED if is_fenced else OPEN), encoding="utf-8")
    theirs = LinkAddress(
        kind=LinkKind.TCP_LISTEN, host="127.0.0.1", port=free_port(socket.SOCK_STREAM)
    )
    made = wire(autopilot)
    lists = made.vehicle.missions.lists
    before = {kind: tuple(items) for kind, items in lists.items()}
    with SimulationRunner(made, theirs):
        process = subprocess.Popen(
            [sys.executable, "-c", UPLOAD, plan, f"tcp:127.0.0.1:{theirs.port}", *CHECK],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            cwd=folder,
        )
        left = [at]

        def hear(passed: PassedMessage) -> None:
            if left[0] and passed.is_to_vehicle and passed.message.name in SENT:
                left[0] -= 1
                if not left[0]:
                    process.kill()

        made.on_message = hear
        try:
            _, said = process.communicate(timeout=60.0)
        finally:
            process.kill()
    assert not (at and left[0]), said.decode()
    return before, {kind: tuple(items) for kind, items in lists.items()}, process.returncode != 0


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
@pytest.mark.parametrize(("is_fenced", "at"), [(True, 8), (False, 5)])
def test_a_killed_process_leaves_whole_lists_and_no_mission_without_its_fence(
    tmp_path: Path, autopilot: Autopilot, *, is_fenced: bool, at: int
) -> None:
    """ArduPilot alone keeps each item of a mission as it comes: old and new are mixed until the last.

    At each of the 46 messages of these uploads it was tried by hand.
    """
    old, new, was_killed = killed_upload(tmp_path, autopilot, is_fenced=is_fenced, at=at)
    assert was_killed
    assert new[MissionKind.FENCE], "the mission is there without a fence"
    assert is_same(new[MissionKind.FENCE], old[MissionKind.FENCE]) == (not is_fenced)
    assert is_same(new[MissionKind.RALLY], old[MissionKind.RALLY])
    assert len(new[MissionKind.MISSION]) == len(old[MissionKind.MISSION])
    if autopilot is Autopilot.PX4:  # fence, then mission: killed before its end, or at it
        assert is_same(new[MissionKind.MISSION], old[MissionKind.MISSION]) == is_fenced
