"""Everything that is done on a line, against builds of the autopilots: make sitl ARDUCOPTER=… PX4=….

Each step says what it measured; the flights are compared with their prediction.  Nothing of a build is
needed beside its binary and what lies around it where it was built.
"""

from __future__ import annotations

import argparse
import math
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from made_missions import item, mission
from sitl.builds import LOW_M, Build, start_ardupilot, start_px4

from planner.autopilot import Autopilot
from planner.cli.main import main as mavjoule
from planner.errors import LinkError
from planner.flight.motion.px4.landing import LANDED_AFTER_S
from planner.geo.fence import Fence, FencePolygon
from planner.guard.authorisation import Verdict
from planner.link.address import read_address
from planner.link.connection import Purpose
from planner.link.mission import LIST_FILES, MissionKind
from planner.link.parameters import PARAMETER_FILE
from planner.link.snapshot import fetch_snapshot
from planner.link.upload import InterruptedUploadError, is_same, upload_mission
from planner.link.vehicle import LinkRequest, open_link
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission
from planner.mission.items import MissionFormat
from planner.service.guard import GuardRequest, guard_vehicle
from planner.service.vehicle import check_vehicle, fetch_logs
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.guard.decision import Decision
    from planner.guard.session import GuardStatus
    from planner.link.mission import WireItem
    from planner.mission.items import Home, Mission, MissionItem

ARDUPILOT, PX4 = Autopilot.ARDUPILOT, Autopilot.PX4
TOLERANCE = 0.02
"""Of flown time over predicted: what flights of kinds not recorded are scored at. [-]"""
_METRE_DEG = 1.0 / 111_194.0
_LONGEST_S = 240.0
"""By our clock, of one flight. [s]"""
_GUARDED_AS = {"vehicle": "falkowski-2023-quadrotor", "battery": Battery(capacity_wh=77.0)}
"""A model whose power is known, as that of the simulators is not, and a battery of no voltage."""
_OVER = "the guard is no longer needed"
_READY_S = 30.0
"""By our clock, until a build speaks. [s]"""


_KILLED_AFTER = (0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95)
"""Of the time of a whole upload: before it sends, while it does, and as it reads back. [-]"""
_GIVEN_UP_S = 3.0
"""By our clock, after which no build waits for the rest of a list. [s]"""
_JUDGED_S = 90.0
"""By our clock, until the guard has judged a vehicle, on a busy computer too. [s]"""


def _is_verdict(one: Decision) -> bool:
    """Return whether a decision is a verdict on what was read."""
    return one.kind == "verdict" and one.verdict is not Verdict.UNKNOWN


class Place:
    """Items about a home, by metres east and north."""

    def __init__(self, home: Home) -> None:
        self._home = home

    def takeoff(self, height_m: float) -> MissionItem:
        return self._at(22, 0.0, 0.0, height_m)

    def to(
        self, east_m: float, north_m: float, height_m: float, hold_s: float = 0.0
    ) -> MissionItem:
        return self._at(16, east_m, north_m, height_m, (hold_s, 0.0, 0.0, None))

    def wait(self, east_m: float, north_m: float, height_m: float, time_s: float) -> MissionItem:
        return self._at(19, east_m, north_m, height_m, (time_s, 0.0, 0.0, None))

    def land(self, east_m: float, north_m: float) -> MissionItem:
        return self._at(21, east_m, north_m, 0.0)

    def fence(self, side_m: float) -> Fence:
        """Return a square about home."""
        sides = ((-side_m, -side_m), (side_m, -side_m), (side_m, side_m), (-side_m, side_m))
        vertices = tuple(self._degrees(*side) for side in sides)
        return Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=vertices),))

    def _at(
        self,
        command: int,
        east_m: float,
        north_m: float,
        height_m: float,
        params: tuple[float | None, ...] = (0.0, 0.0, 0.0, None),
    ) -> MissionItem:
        latitude_deg, longitude_deg = self._degrees(east_m, north_m)
        return item(command, latitude_deg, height_m, params=params, longitude_deg=longitude_deg)

    def _degrees(self, east_m: float, north_m: float) -> tuple[float, float]:
        slant = math.cos(math.radians(self._home.latitude_deg))
        return (
            self._home.latitude_deg + north_m * _METRE_DEG,
            self._home.longitude_deg + east_m * _METRE_DEG / slant,
        )


RTL = item(20, frame=2, params=(0.0, 0.0, 0.0, 0.0))


def speed(speed_m_s: float) -> MissionItem:
    return item(178, params=(1.0, speed_m_s, -1.0, 0.0), frame=2)


def flights(home: Home) -> Iterator[tuple[str, tuple[MissionItem, ...]]]:
    """Yield the flights: name and items, each of a kind of its own."""
    p = Place(home)
    up = p.takeoff(20.0)
    gripper = item(211, 0.0, frame=2, params=(1.0, 0.0, 0.0, 0.0), longitude_deg=0.0)
    yield "out and back", (up, p.to(0, 100, 20), RTL)
    yield "short leg", (up, p.to(0, 15, 20), RTL)
    yield "long leg", (up, p.to(0, 300, 20), RTL)
    yield "square", (up, p.to(0, 60, 20), p.to(60, 60, 20), p.to(60, 0, 20), RTL)
    yield "obtuse corners", (up, p.to(0, 80, 20), p.to(30, 150, 20), p.to(100, 190, 20), RTL)
    yield "sharp corners", (up, p.to(0, 90, 20), p.to(20, 10, 20), p.to(40, 90, 20), RTL)
    yield "straight on", (up, *(p.to(0, n, 20) for n in range(30, 181, 30)), RTL)
    yield "a gripper", (up, p.to(0, 60, 20), gripper, RTL)
    yield "a hold", (up, p.to(0, 80, 20, 5.0), p.to(80, 80, 20), RTL)
    yield "holds everywhere", (up, *(p.to(0, n, 20, 3.0) for n in (40, 80, 120)), RTL)
    yield "a wait", (up, p.to(0, 60, 20), p.wait(0, 100, 20, 8.0), RTL)
    yield "slow", (up, speed(3.0), p.to(0, 80, 20), p.to(50, 80, 20), RTL)
    yield "slow, then fast", (up, speed(3.0), p.to(0, 60, 20), speed(8.0), p.to(0, 200, 20), RTL)
    yield "climbing", (up, p.to(0, 100, 50), RTL)
    yield "descending", (p.takeoff(50.0), p.to(0, 120, 20), RTL)
    yield "stairs", (up, p.to(0, 50, 30), p.to(0, 100, 20), p.to(0, 150, 40), RTL)
    lanes = [(0, 40, 20), (20, 40, 20), (20, 40, 25), (0, 40, 25), (0, 40, 30), (20, 40, 30)]
    yield "a facade", (up, speed(3.0), *(p.to(*map(float, place)) for place in lanes), RTL)
    yield "high", (p.takeoff(80.0), p.to(0, 60, 80), RTL)
    yield "lands away", (up, p.to(0, 80, 20), p.land(0, 120))
    yield "lands at home", (up, p.to(70, 70, 20), p.land(0, 0))
    rows = [
        (x, y)
        for n, x in enumerate((0, 25, 50, 75))
        for y in ((20, 120) if n % 2 == 0 else (120, 20))
    ]
    yield "survey", (up, *(p.to(float(x), float(y), 20) for x, y in rows), RTL)
    yield (
        "survey, low and slow",
        (
            *(p.takeoff(12.0), speed(4.0)),
            *(p.to(float(x), float(y) / 2.0, 12) for x, y in rows[:6]),
            RTL,
        ),
    )


class Tour:
    """The steps against one build, each of which passes or says why not."""

    def __init__(self, build: Build, folder: Path) -> None:
        self.build = build
        self.folder = folder
        self.request = LinkRequest(address=read_address(build.url, baud=None))
        is_copter = build.autopilot is ARDUPILOT
        self.model = "arducopter-sitl-quad" if is_copter else "px4-sih-quad"
        vehicle = load_vehicle(self.model)
        if is_copter:  # the drag of the stock frame, by flights of its own: the model is of another
            vehicle = replace(vehicle, airspeed_limit_m_s=10.24, airspeed_limit_lean_deg=30.0)
        self.setup = Setup(vehicle, position_noise_m=0.0)
        self.failed: list[str] = []

    def step(self, name: str, does: Callable[[], str]) -> None:
        """Take one step, and say what came of it."""
        began_s = time.monotonic()
        try:
            found = does()
            sign = "ok  "
        except Exception as error:  # noqa: BLE001 - the other steps are taken
            found, sign = f"{type(error).__name__}: {error}", "FAIL"
            (self.folder / f"{name.replace(' ', '-')}.txt").write_text(traceback.format_exc())
            self.failed.append(f"{self.build.autopilot}: {name}")
        took_s = time.monotonic() - began_s
        print(f"{sign} {self.build.autopilot:<10} {name:<18} {took_s:6.1f} s  {found}", flush=True)

    def all(self) -> None:
        """Take all steps."""
        self.step("ready", self._ready)
        self.step("fetch", self._fetch)
        self.step("files or items", self._both_ways)
        self.step("upload and diff", self._upload)
        self.step("cut upload", self._cut)
        self.step("killed uploads", self._killed)
        self.step("guard", self._guard)
        if self.build.autopilot is PX4:
            self.build.set("COM_ARM_AUTH_REQ", 0)
        with open_link(self.request) as link:
            snapshot = fetch_snapshot(link)
        assert snapshot.mission.home is not None
        off: list[float] = []
        for name, items in flights(snapshot.mission.home):
            before = len(self.failed)
            self.step(f"fly: {name}", lambda items=items: self._fly(items, off))  # type: ignore[misc] # bound now
            if len(self.failed) > before:
                self.build.disarm()
        print(
            f"     {self.build.autopilot}: {len(off)} flights, errors of time "
            f"{', '.join(f'{100.0 * one:+.1f}' for one in sorted(off))} %",
            flush=True,
        )
        self.step("logs", self._logs)

    def _ready(self) -> str:
        began_s = time.monotonic()
        while True:  # ArduPilot opens its other ports once somebody has called at the first
            try:
                with open_link(self.request):
                    break
            except LinkError:
                if time.monotonic() - began_s > _READY_S:
                    raise
                time.sleep(0.5)
        self.build.call()
        return self.build.url

    def _call(self, *arguments: str) -> int:
        """Call a command, and keep what it says."""
        with (
            (self.folder / "commands.txt").open("a") as said,
            redirect_stdout(said),
            redirect_stderr(said),
        ):
            return int(mavjoule(list(arguments)))

    def _fetch(self) -> str:
        plan = self.folder / "fetched.plan"
        assert self._call("fetch", self.build.url, "-o", str(plan), "--force") == 0
        count = sum(not line.startswith("#") for line in plan.with_suffix(".params").open())
        assert count > 500, count
        return f"{count} parameters, {len(read_mission(plan).items)} items"

    def _both_ways(self) -> str:
        """Hold what files bring against what is asked for one by one."""
        with open_link(self.request) as link:
            began_s = time.monotonic()
            first = link.fetch_parameters(), [link.fetch_items(kind) for kind in MissionKind]
            files_s = time.monotonic() - began_s
            has_files = link.identity.has_home_slot and not link._unpacked
            link._unpacked |= {PARAMETER_FILE, *LIST_FILES.values()}
            began_s = time.monotonic()
            second = link.fetch_parameters(), [link.fetch_items(kind) for kind in MissionKind]
            items_s = time.monotonic() - began_s
        same = {(one.name, one.content, one.kind) for one in first[0]}
        other = {(one.name, one.content, one.kind) for one in second[0]}
        # Autopilots count some by themselves.
        assert len(same ^ other) <= 20, sorted(same ^ other)[:40]
        assert all(is_same(a or (), b or ()) for a, b in zip(first[1], second[1], strict=True))
        return f"the same: {files_s:.1f} s {'by files' if has_files else ''}, {items_s:.1f} s one by one"

    def _file(self, name: str, held: Mission) -> Path:
        path = self.folder / f"{name}.plan"
        path.write_text(convert_mission(held, MissionFormat.PLAN).text)
        return path

    def _mission(self, items: tuple[MissionItem, ...]) -> Mission:
        return mission(*items, home=None, autopilot=self.build.autopilot)

    def _home(self) -> Home:
        home = read_mission(self.folder / "fetched.plan").home
        assert home is not None
        return home

    def _upload(self) -> str:
        place = Place(self._home())
        many = [place.to(5.0 * (n % 20), 5.0 * (n // 20), 20.0) for n in range(398)]
        path = self._file("many", self._mission((place.takeoff(20.0), *many, RTL)))
        options = ["--vehicle", self.model, "--battery", "60Wh", "--yes", "--force"]
        began_s = time.monotonic()
        assert self._call("upload", str(path), self.build.url, *options) == 0
        took_s = time.monotonic() - began_s
        assert self._call("diff", str(path), self.build.url) == 0
        return f"400 items in {took_s:.1f} s, read back the same"

    def _cut(self) -> str:
        """Stop an upload in its middle: the old mission is there again."""
        place = Place(self._home())
        new = self._mission((place.takeoff(30.0), place.to(0.0, 50.0, 30.0), RTL))
        with open_link(self.request, purpose=Purpose.UPLOAD) as link:
            before = [link.fetch_items(kind) for kind in MissionKind]
            send, left = link.connection.send, [2]

            def stop(sent: object) -> None:
                send(sent)  # type: ignore[arg-type] # a message
                left[0] -= getattr(sent, "name", "") == "MISSION_ITEM_INT"
                if left[0] == 0:
                    left[0] = -1
                    raise KeyboardInterrupt

            link.connection.send = stop  # type: ignore[method-assign] # Ctrl-C
            try:
                upload_mission(link, new, listen_s=0.0)
                msg = "nothing stopped it"
                raise AssertionError(msg)
            except InterruptedUploadError as error:
                said = str(error)
            after = [link.fetch_items(kind) for kind in MissionKind]
        skipped = int(self.build.autopilot is ARDUPILOT)
        for old, now in zip(before, after, strict=True):
            assert is_same((old or ())[skipped:], (now or ())[skipped:])
        return said

    def _killed(self) -> str:
        """Kill uploads at some moments: a fence is there, and lists are whole.

        ArduPilot keeps each item of a mission as it comes: old and new may be mixed.
        """
        place = Place(self._home())
        paths, lists = [], []
        for height_m, side_m in ((20.0, 400.0), (30.0, 500.0)):
            many = [place.to(5.0 * (n % 20), 5.0 * (n // 20), height_m) for n in range(200)]
            held = self._mission((place.takeoff(height_m), *many, RTL))
            paths.append(self._file(f"{height_m:g}", replace(held, fence=place.fence(side_m))))
            began_s = time.monotonic()
            assert self._upload_process(paths[-1]).wait(_LONGEST_S) == 0
            took_s = time.monotonic() - began_s
            lists.append(self._lists())
        found, count = [], len(_KILLED_AFTER)
        for number, part in enumerate(_KILLED_AFTER):
            process = self._upload_process(paths[number % 2])
            with suppress(subprocess.TimeoutExpired):
                process.wait(part * took_s)
            process.kill()
            process.wait()
            time.sleep(_GIVEN_UP_S)
            left = ""
            for kind, now in self._lists().items():
                same = [is_same(one[kind], now) for one in lists]
                is_mixed = kind is MissionKind.MISSION and self.build.autopilot is ARDUPILOT
                assert any(same) or is_mixed, f"{kind.label}: {len(now)} items after {part:g}"
                assert now or kind is MissionKind.RALLY, f"no {kind.label} after {part:g}"
                left += {(True, False): "a", (False, True): "b"}.get((same[0], same[1]), "-")
            found.append(left)
        return f"{count} killed after {', '.join(found)} (mission, fence, rally points)"

    def _upload_process(self, path: Path) -> subprocess.Popen[bytes]:
        given = ["--vehicle", self.model, "--battery", "60Wh", "--yes", "--force"]
        call = "import sys; from planner.cli.main import main; sys.exit(main(sys.argv[1:]))"
        return subprocess.Popen(
            [sys.executable, "-c", call, "upload", str(path), self.build.url, *given],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def _lists(self) -> dict[MissionKind, tuple[WireItem, ...]]:
        """Return what is on the vehicle, without ArduPilot's home."""
        skipped = int(self.build.autopilot is ARDUPILOT)
        with open_link(self.request) as link:
            read = {kind: link.fetch_items(kind) or () for kind in MissionKind}
        return {**read, MissionKind.MISSION: read[MissionKind.MISSION][skipped:]}

    def _guarded(
        self, items: tuple[MissionItem, ...], does: Callable[[], str]
    ) -> tuple[list[Decision], str]:
        """Put a mission on it, guard it, do something, and return the decisions."""
        with open_link(self.request, purpose=Purpose.UPLOAD) as link:
            upload_mission(link, self._mission(items), listen_s=1.0)
        decisions: list[Decision] = []
        is_over = threading.Event()

        def on_status(_: GuardStatus) -> None:
            if is_over.is_set():
                raise LinkError(_OVER)

        def guard() -> None:
            with suppress(LinkError):
                guard_vehicle(
                    self.request,
                    Setup.of(_GUARDED_AS),
                    GuardRequest(),
                    on_decision=decisions.append,
                    on_status=on_status,
                )

        thread = threading.Thread(target=guard)
        thread.start()
        try:
            self.build.until(lambda: any(map(_is_verdict, decisions)), _JUDGED_S)
            return decisions, does()
        finally:
            is_over.set()
            thread.join(10.0)

    def _guard(self) -> str:
        place = Place(self._home())
        near = (place.takeoff(20.0), place.to(0.0, 60.0, 20.0), RTL)
        far = (place.takeoff(20.0), place.to(0.0, 30_000.0, 20.0), RTL)
        is_px4 = self.build.autopilot is PX4

        def try_to_arm() -> str:
            if not is_px4:
                return ""
            armed = self.build.arm()
            self.build.disarm()
            return "armed" if armed else "refused"

        decisions, near_said = self._guarded(near, try_to_arm)
        near_verdict = [one.verdict for one in decisions if one.kind == "verdict"][-1]
        decisions, far_said = self._guarded(far, try_to_arm)
        far_verdict = [one.verdict for one in decisions if one.kind == "verdict"][-1]
        found = f"near: {near_verdict} {near_said}; far: {far_verdict} {far_said}"
        assert far_verdict is Verdict.NO_GO, found
        assert near_verdict is Verdict.GO, found
        assert not is_px4 or (near_said, far_said) == ("armed", "refused"), found
        return found

    def _fly(self, items: tuple[MissionItem, ...], off: list[float]) -> str:
        flown = self._mission(items)
        with open_link(self.request, purpose=Purpose.UPLOAD) as link:
            snapshot = fetch_snapshot(link, flown)
            sent = upload_mission(link, flown, listen_s=0.5)
        assert sent.is_good, sent.rejection or sent.differences
        result = check_vehicle(snapshot, self.setup, mission=flown)
        assert result.totals is not None  # type: ignore[union-attr] # one that can be read
        predicted_s = result.totals.time_s  # type: ignore[union-attr] # as above
        took_s = self.build.fly(_LONGEST_S)
        assert took_s is not None, f"it did not fly: {self.build.texts[-3:]}"
        error = predicted_s / took_s - 1.0
        off.append(error)
        found = f"flown {took_s:6.1f} s, predicted {predicted_s:6.1f} s ({100.0 * error:+.1f} %)"
        if self.build.autopilot is PX4:
            # Its landed flag takes 1.3 to 12 s: judged is when it comes down.
            assert self.build.down_s is not None
            assert self.build.armed_s is not None
            came_s = self.build.down_s - self.build.armed_s
            disarm_s = Px4Parameters().disarm_delay_s if items[-1].command == RTL.command else 0.0
            last_s = LOW_M / Px4Parameters().land_crawl_speed_m_s
            error = (predicted_s - LANDED_AFTER_S - disarm_s - last_s) / came_s - 1.0
            found += f", down after {came_s:.1f} s ({100.0 * error:+.1f} %)"
        assert abs(error) <= TOLERANCE, found
        return found

    def _logs(self) -> str:
        into = self.folder / "logs-fetched"
        listed = fetch_logs(self.request, folder=into).listed
        whole = [log for log in listed if log.size_bytes]
        log = sorted(whole, key=lambda one: one.size_bytes)[len(whole) // 2]
        began_s = time.monotonic()
        (done,) = fetch_logs(self.request, names=[log.name], folder=into).downloaded
        took_s = time.monotonic() - began_s
        own = [
            path for path in self.build.folder.rglob("*") if path.suffix.lower() in {".bin", ".ulg"}
        ]
        content = done.path.read_bytes()
        assert any(
            path.stat().st_size >= len(content) and path.read_bytes()[: len(content)] == content
            for path in own
            if into not in path.parents
        )
        return (
            f"{len(listed)} listed, {log.size_bytes / 1e6:.1f} MB in {took_s:.1f} s, as on its disk"
        )


def main() -> int:
    """Run the tour against the builds that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arducopter", type=Path, help="the binary of ArduCopter's simulator")
    parser.add_argument("--px4", type=Path, help="the binary of PX4's, with SIH")
    parser.add_argument("--instance", type=int, default=7, help="shifts the ports [default: 7]")
    parser.add_argument("--speed", type=float, help="times real time [default: 10, and 5 of PX4]")
    options = parser.parse_args()
    if options.arducopter is None and options.px4 is None:
        print("no build: make sitl ARDUCOPTER=…/bin/arducopter PX4=…/bin/px4 (either or both)")
        return 2
    failed: list[str] = []
    for binary, start, usual in (
        (options.arducopter, start_ardupilot, 10.0),
        (options.px4, start_px4, 5.0),
    ):
        if binary is None:
            continue
        if not binary.is_file():
            print(f"{binary}: no such file: name the binary of the build")
            return 2
        folder = Path(tempfile.mkdtemp(prefix="mavjoule-sitl-"))
        (folder / "run").mkdir()
        build = start(
            binary, folder / "run", instance=options.instance, speed=options.speed or usual
        )
        tour = Tour(build, folder)
        try:
            tour.all()
        finally:
            build.stop()
        failed += tour.failed
        if tour.failed:
            print(f"     what was wrong, and its logs: {folder}")
        else:
            shutil.rmtree(folder)
    print(f"{len(failed)} steps failed: {', '.join(failed)}" if failed else "every step passed")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
