"""Every command that writes, ended or refused at every call that changes a file.

``python tests/fuzz/interruptions.py`` tries them all and says how many; what each leaves behind is old or
new, never half, and of files that belong together never some old beside some new.
"""

from __future__ import annotations

import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from dataflash_writer import copter_log
from faulty_system import FAULTS, Command, Ended, faults_found, run
from guarded_vehicle import GuardedVehicle, guarded
from made_missions import mission, rtl, takeoff, waypoint
from made_swarm import formation
from simulated_vehicles import memory_line
from ulog_writer import px4_log
from virtual_vehicle import VirtualLine, VirtualVehicle, waypoints

from planner.autopilot import Autopilot
from planner.link.mission import MissionKind
from planner.mission.formats.writers import plan_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.link.wire import VehicleLine

SURVEY = Path(__file__).parents[2] / "missions" / "survey-vineyard.plan"
OLD = b"what was there before\n"
VEHICLE = ("--vehicle", "arducopter-sitl-quad", "--battery", "170Wh")
URL = "udp:127.0.0.1:14550"
_FIRST, _LAST = 1, 1_000_000


_FLEET = b"""schema = 1
[swap]
time_s = 60
[pad.field]
latitude_deg = 47.0
longitude_deg = 8.0
[vehicle.quad]
model = "falkowski-2023-quadrotor"
pad = "field"
[pack.A]
battery = "170Wh"
[job.near]
mission = "in.plan"
"""


_SORTIE = b"""[operation]
start = 2026-05-12T08:00:00+02:00
[sortie.first]
job = "near"
vehicle = "quad"
pack = "A"
start_s = 10
"""


def _plan(distance_m: float) -> bytes:
    legs = (waypoint(one * distance_m, 20.0) for one in range(1, 9))
    return plan_text(mission(takeoff(20.0), *legs, rtl())).encode()


def _opens(line: Callable[[], VehicleLine]) -> Callable[[], None]:
    """Return what makes an address open a line."""

    def prepare() -> None:
        patch = pytest.MonkeyPatch()  # of a process that ends with the command
        patch.setattr("planner.link.vehicle.open_line", lambda _: line())
        patch.setattr("planner.service.vehicle._now", lambda: "2026-11-22T12:00:00Z")

    return prepare


def _fetched() -> VehicleLine:
    vehicle = VirtualVehicle(parameters={"MPC_XY_CRUISE": (6.1, 9)})
    vehicle.lists[MissionKind.MISSION] = waypoints(3)
    return VirtualLine(vehicle)


def _guarded() -> VehicleLine:
    """A vehicle that asks, and whose pilot then stops the guard."""

    def stop(_: GuardedVehicle) -> None:
        raise KeyboardInterrupt

    return VirtualLine(guarded(script=[(20.0, GuardedVehicle.ask), (30.0, stop)]))


@cache
def commands() -> tuple[Command, ...]:
    """Return the commands that write files, one for each way to write."""
    near, far = _plan(30.0), _plan(250.0)
    pictures = tuple(f"pictures/speed.{ending}" for ending in ("svg", "png"))
    parts = ("parts/part-01.plan", "parts/part-02.plan")
    tight = (*VEHICLE[:3], "40Wh")  # takes two flights of 24 Wh
    fetch = ("fetch", URL, "-o", "a.plan")

    def old(*names: str) -> dict[str, bytes]:
        return dict.fromkeys(names, OLD)

    return (
        Command("convert", ("convert", "in.plan", "a.plan"), {"in.plan": near}),
        Command(
            "convert --force",
            ("convert", "in.plan", "a.waypoints", "--force"),
            {"in.plan": near, **old("a.waypoints")},
        ),
        Command("fetch", fetch, {}, pairs=[("a.plan", "a.params")], prepare=_opens(_fetched)),
        Command(
            "fetch --force",
            (*fetch, "--force"),
            old("a.plan", "a.params"),
            pairs=[("a.plan", "a.params")],
            prepare=_opens(_fetched),
        ),
        Command(
            "logs",
            ("logs", URL, "--all", "-o", "logs"),
            {},
            resumes=frozenset({"logs/log-00001.bin.part", "logs/00000001.BIN.part"}),
            prepare=_opens(lambda: memory_line(Autopilot.ARDUPILOT)),
        ),
        Command(
            "guard --log",
            ("guard", URL, *VEHICLE, "--log", "guard.log"),
            {"guard.log": b'{"old": 1}\n'},
            appends=frozenset({"guard.log"}),
            ends=130,
            prepare=_opens(_guarded),
        ),
        Command(
            "segments",
            ("segments", "in.plan", *VEHICLE[:2], "--output", "a.csv", "--format", "csv"),
            {"in.plan": near, **old("a.csv")},
        ),
        Command(
            "check",
            (
                *("check", "in.plan", *VEHICLE, "--format", "json", "--output", "a.json"),
                *("--trace", "a.csv", "--export", "a.kml", "--report", "a.html"),
            ),
            {"in.plan": near, **old("a.json", "a.csv", "a.kml", "a.html")},
        ),
        Command(
            "check --write-baseline",
            ("check", "in.plan", *VEHICLE, "--write-baseline", "a.baseline"),
            {"in.plan": near, **old("a.baseline")},
        ),
        Command(
            "compare",
            (
                *("compare", "in.plan", "far.plan", *VEHICLE, "--output", "a.txt"),
                *("--report", "a.html"),
            ),
            {"in.plan": near, "far.plan": far, **old("a.txt", "a.html")},
        ),
        Command(
            "speed",
            ("speed", "in.plan", *VEHICLE, "--from", "3", "--to", "5", "--output", "a.txt"),
            {"in.plan": near, **old("a.txt")},
        ),
        Command(
            "speed --plots",
            ("speed", "in.plan", *VEHICLE, "--from", "3", "--to", "5", "--plots", "pictures"),
            {"in.plan": near, **old(*pictures)},
            pairs=[pictures],
        ),
        Command(
            "split",
            ("split", "in.plan", *tight, "-o", "parts"),
            {"in.plan": SURVEY.read_bytes()},
            pairs=[parts],
        ),
        Command(
            "split --force",
            ("split", "in.plan", *tight, "-o", "parts", "--force"),
            {"in.plan": SURVEY.read_bytes(), **old(*parts)},
            pairs=[parts],
        ),
        Command(
            "identify",
            ("identify", "a.ulg", "-o", "own.toml", "--mass", "1.5", "--cells", "4", "--force"),
            {"a.ulg": px4_log().content(), **old("own.toml")},
        ),
        Command(
            "verify",
            ("verify", VEHICLE[1], "a.bin", "--format", "json", "--output", "a.json"),
            {"a.bin": copter_log().content(), **old("a.json")},
        ),
        Command(
            "fleet plan",
            ("fleet", "plan", "fleet.toml", "-o", "day"),
            {"fleet.toml": _FLEET, "in.plan": near},
        ),
        Command(
            "fleet check",
            (
                *("fleet", "check", "fleet.toml", "--output", "a.txt", "--report", "a.html"),
                *("--export", "a.kml", "--volumes", "a.json", "--geoid-height", "48"),
            ),
            {
                "fleet.toml": _FLEET + _SORTIE,
                "in.plan": near,
                **old("a.txt", "a.html", "a.kml", "a.json"),
            },
        ),
        Command(
            "fleet simulate",
            ("fleet", "simulate", "fleet.toml", "--until", "9", "--trace", "a.csv"),
            {"fleet.toml": b"schema = 1\n" + formation(20.0).encode(), **old("a.csv")},
            ends=1,  # they are in the air
        ),
        Command(
            "check, with a summary",
            ("check", "in.plan", *VEHICLE, "--format", "github"),
            {"in.plan": near, "summary.md": OLD},
            appends=frozenset({"summary.md"}),
            prepare=lambda: os.environ.update(GITHUB_STEP_SUMMARY="summary.md"),
        ),
    )


def undisturbed(command: Command, folder: Path) -> Ended:
    """Return how a command ends that nothing disturbs."""
    ended = run(command, folder, at=_LAST, fault="once")
    assert ended.code == command.ends, f"{command.name}: {ended.said}"
    return ended


def swept(command: Command, fault: str, folder: Path, whole: Ended) -> Iterator[tuple[int, Ended]]:
    """Yield what comes of each call that fails, until there is no such call."""
    at = _FIRST
    while (ended := run(command, folder, at=at, fault=fault)).is_reached:
        yield at, ended
        at += 1
    assert ended.code == whole.code, command.name


def main() -> int:
    """Try all commands with all faults, or those that are named; return how many left what must not be."""
    wrong = total = 0
    with tempfile.TemporaryDirectory() as top:
        folder = Path(top) / "folder"
        for command in commands():
            if sys.argv[1:] and command.name not in sys.argv[1:]:
                continue
            whole = undisturbed(command, folder)
            counts: list[str] = []
            for fault in FAULTS:
                count = 0
                for at, ended in swept(command, fault, folder, whole):
                    count += 1
                    for text in faults_found(command, whole, ended, fault):
                        wrong += 1
                        print(f"  {command.name}, {fault} at {at}: {text}", flush=True)
                total += count
                counts.append(str(count))
            print(f"{command.name:24} exit {whole.code}  {' '.join(counts)}", flush=True)
    print(f"{total} ends, {wrong} wrong")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
