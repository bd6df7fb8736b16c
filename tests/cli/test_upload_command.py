from __future__ import annotations

import json
import math
import signal
from typing import TYPE_CHECKING, Any

import click
import pytest
from virtual_vehicle import ARDUPILOT, PX4, VirtualLine, VirtualVehicle, wire_item

from planner.cli import upload as upload_module
from planner.cli.main import main
from planner.link.connection import MESSAGES, Purpose
from planner.link.mission import MissionKind
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from planner.link.mission import WireItem

URL = "tcp:127.0.0.1:5760"
OLD = tuple(wire_item(x=500_000_000 + n * 1000, y=200_000_000, z=50.0) for n in range(4))
HOME = wire_item(frame=0, x=500_000_000, y=200_000_000, z=200.0)
VEHICLE = ("--vehicle", "falkowski-2023-quadrotor")
CHECKED = ("upload", "out.waypoints", URL, "--yes", "--listen", "2")
SENT = (*CHECKED, *VEHICLE, "--battery", "77Wh")


def _vehicle(autopilot: int = PX4) -> VirtualVehicle:
    there = (500_000_000, 200_000_000, 200_000)
    one = VirtualVehicle(autopilot=autopilot, home=there, place=there)
    one.lists[MissionKind.MISSION] = (HOME, *OLD) if autopilot == ARDUPILOT else OLD
    one.parameters = {"BAT1_CAPACITY": (5200.0, 9)}
    return one


@pytest.fixture
def on_line(monkeypatch: pytest.MonkeyPatch) -> list[VirtualLine]:
    """What a test puts here is what an address opens."""
    lines: list[VirtualLine] = []
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: lines.pop(0))
    return lines


def _flown(vehicle: VirtualVehicle) -> tuple[WireItem, ...]:
    skipped = 1 if vehicle.autopilot == ARDUPILOT else 0
    return vehicle.lists[MissionKind.MISSION][skipped:]


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_a_go_is_on_the_vehicle_and_the_same_as_the_file(
    on_line: list[VirtualLine], autopilot: int, loss: float, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle(autopilot)
    on_line += [VirtualLine(vehicle, loss=loss), VirtualLine(vehicle)]
    assert main(list(SENT)) == 0
    assert [item.command for item in _flown(vehicle)] == [22, 16, 20]
    said = capsys.readouterr().err
    assert "read back and compared" in said
    assert "took: vehicle found " in said
    assert main(["diff", "out.waypoints", URL]) == 0
    assert "are the same mission" in capsys.readouterr().out


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize(
    ("place", "told"),
    [
        ((500_000_000, 200_000_000, 200_000), False),
        ((500_000_000, 200_000_000, 203_500), True),  # planned at 200 m
        ((500_044_000, 200_000_000, 200_000), False),  # 489 m north
        ((500_046_000, 200_000_000, 200_000), True),  # 511 m
    ],
)
def test_a_mission_planned_from_another_home_is_told_before_it_is_sent(
    on_line: list[VirtualLine],
    place: tuple[int, int, int],
    told: bool,  # noqa: FBT001 - a table of cases
    capsys: pytest.CaptureFixture[str],
) -> None:
    vehicle = _vehicle(ARDUPILOT)
    vehicle.home = vehicle.place = place
    on_line.append(VirtualLine(vehicle))
    main(list(SENT))
    said = capsys.readouterr()
    assert ("A115 home-mismatch [warning]" in said.out + said.err) is told


@pytest.mark.usefixtures("mission")
def test_a_no_go_is_not_sent(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle()
    vehicle.battery_remaining = 21
    on_line += [VirtualLine(vehicle), VirtualLine(vehicle)]
    assert main(list(SENT)) == 1
    assert _flown(vehicle) == OLD
    assert not {"MISSION_COUNT", "MISSION_ITEM_INT"} & {one.name for one in vehicle.received}
    assert "a no-go is not sent" in capsys.readouterr().err
    assert main([*SENT, "--force"]) == 0
    assert len(_flown(vehicle)) == 3


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("given", [(), VEHICLE, ("--battery", "77Wh"), ("--force",)])
def test_without_vehicle_and_battery_nothing_is_sent_even_by_force(
    on_line: list[VirtualLine],
    tmp_path: Path,
    given: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "mavjoule.toml").write_text("", encoding="utf-8")
    vehicle = _vehicle()
    on_line.append(VirtualLine(vehicle))
    assert main([*CHECKED, *given]) == 2
    assert "upload does not start without" in capsys.readouterr().err
    assert not vehicle.received


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize(
    "line",
    [
        'ignore = "M"',
        'select = "T"',
        'fail_on = "error"',
        'baseline = "known.json"',
        "risk = 1.0",
        "reserve = 0",
        'charge = "100%"',
        'battery = "4000Wh"\nvehicle = "px4-sih-quad"\nignore = "M"',
        'home_amsl_m = -400\npayload_kg = 0\nautopilot = "step"',
        '[per_file_ignores]\n"out.waypoints" = "M1"',
    ],
)
def test_a_file_beside_the_mission_has_no_say_in_what_is_sent(
    on_line: list[VirtualLine], tmp_path: Path, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mavjoule.toml"
    file.write_text(f"{line}\n", encoding="utf-8")
    vehicle = _vehicle()
    on_line.append(VirtualLine(vehicle))
    assert main(list(SENT)) == 2
    said = capsys.readouterr().err
    assert "upload obeys only what is typed, and mavjoule.toml sets " in said
    assert said.count("\n") == 1
    assert not vehicle.received


@pytest.mark.usefixtures("mission")
def test_neither_a_project_nor_a_folder_above_has_a_say_in_what_is_sent(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = '[tool.mavjoule]\nignore = "M"\n'
    (tmp_path / "pyproject.toml").write_text(project, encoding="utf-8")
    below = tmp_path / "site" / "north"
    below.mkdir(parents=True)
    (tmp_path / "out.waypoints").rename(below / "out.waypoints")
    vehicle = _vehicle()
    on_line.append(VirtualLine(vehicle))
    path = "site/north/out.waypoints"
    assert main(["upload", path, URL, "--yes", *VEHICLE, "--battery", "77Wh"]) == 2
    assert "and pyproject.toml sets ignore" in capsys.readouterr().err
    assert not vehicle.received


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize(
    "typed",
    [
        ("--select", "T"),
        ("--fail-on", "error"),
        ("--baseline", "known.json"),
        ("--reserve", "0"),
        ("--risk", "100%"),
        ("--ignore", "M,T,P,W,V"),
    ],
)
def test_a_mission_of_twice_the_battery_is_not_sent_whatever_is_typed(
    on_line: list[VirtualLine], typed: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    battery = (*VEHICLE, "--battery", "3Wh")  # it needs about 6 Wh
    main(["check", "out.waypoints", *battery, "--write-baseline", "known.json"])
    vehicle = _vehicle()
    on_line.append(VirtualLine(vehicle))
    assert main([*CHECKED, *battery, *typed]) == 1
    assert _flown(vehicle) == OLD
    assert not {"MISSION_COUNT", "MISSION_ITEM_INT"} & {one.name for one in vehicle.received}
    assert "a no-go is not sent" in capsys.readouterr().err


@pytest.mark.usefixtures("mission")
def test_a_go_that_rests_on_an_error_not_reported_is_not_sent(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site.toml"
    site.write_text("[site]\nmax_height_above_home_m = 50\n", encoding="utf-8")
    vehicle = _vehicle()
    on_line += [VirtualLine(vehicle), VirtualLine(vehicle)]
    assert main([*SENT, "--profile", str(site), "--ignore", "A114"]) == 1
    assert "not sent: A114 too-high-for-site is ignored as A114" in capsys.readouterr().err
    assert _flown(vehicle) == OLD


@pytest.mark.usefixtures("mission", "on_line")
def test_without_a_terminal_and_without_yes_nothing_is_sent(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([one for one in SENT if one != "--yes"]) == 2
    assert "add --yes" in capsys.readouterr().err


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_refused_item_leaves_the_old_mission(
    on_line: list[VirtualLine], autopilot: int, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle(autopilot)
    vehicle.refused_command = 20
    on_line.append(VirtualLine(vehicle))
    assert main(list(SENT)) == 1
    assert _flown(vehicle) == OLD
    said = capsys.readouterr().err
    assert "rejected: the vehicle refuses the mission: UNSUPPORTED to item" in said
    assert "the old mission is on the vehicle again" in said


@pytest.mark.usefixtures("mission")
def test_a_rejection_that_is_only_said_fails_the_upload(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle()
    vehicle.rejection_text = "Mission rejected: takeoff altitude too low"
    on_line.append(VirtualLine(vehicle))
    assert main(list(SENT)) == 1
    assert "rejected: Mission rejected: takeoff altitude too low" in capsys.readouterr().err


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_line_cut_at_any_message_ends_in_exit_3_and_px4_has_one_mission_whole(
    on_line: list[VirtualLine], autopilot: int, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = _vehicle(autopilot)
    line = VirtualLine(whole)
    on_line.append(line)
    assert main(list(SENT)) == 0
    new = _flown(whole)
    for position in range(line.exchanged):
        vehicle = _vehicle(autopilot)
        cut = VirtualLine(vehicle, cut_after=position)
        on_line.append(cut)
        ended = main([*SENT, "--retries", "2"])
        said = capsys.readouterr().err
        assert "bug" not in said
        assert ended in {0, 3}
        assert cut.time_s < 120.0
        # Only PX4 changes missions at once; of ArduPilot the message has to say that they may mix.
        if _flown(vehicle) not in (OLD, new):
            assert autopilot == ARDUPILOT
            assert "a mixture" in said


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_line_that_comes_back_leaves_the_old_or_the_new_mission_whole(
    on_line: list[VirtualLine], autopilot: int, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = _vehicle(autopilot)
    line = VirtualLine(whole)
    on_line.append(line)
    assert main(list(SENT)) == 0
    new = _flown(whole)
    for position in range(line.exchanged):
        vehicle = _vehicle(autopilot)
        on_line.append(VirtualLine(vehicle, cut_after=position, cut_s=10.0))
        ended = main([*SENT, "--retries", "2"])
        said = capsys.readouterr().err
        assert ended in {0, 3}, (position, said)
        assert _flown(vehicle) in (OLD, new), (position, said)
        if "read it back whole" in said or "the old mission is on the vehicle" in said:
            assert _flown(vehicle) == OLD


@pytest.mark.usefixtures("mission")
def test_nothing_but_the_table_goes_out(on_line: list[VirtualLine]) -> None:
    line = VirtualLine(_vehicle())
    on_line.append(line)
    assert main(list(SENT)) == 0
    numbers = {int.from_bytes(frame[7:10], "little") for frame in line.sent}
    assert numbers <= MESSAGES[Purpose.UPLOAD].keys()
    commands = {
        int.from_bytes(frame[38:40], "little")
        for frame in line.sent
        if int.from_bytes(frame[7:10], "little") == 76
    }
    assert commands == {512}  # MAV_CMD_REQUEST_MESSAGE


@pytest.mark.usefixtures("mission")
def test_a_difference_is_told_with_item_and_field(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle()
    on_line += [VirtualLine(vehicle), VirtualLine(vehicle)]
    assert main(list(SENT)) == 0
    items = list(_flown(vehicle))
    items[1] = replace(items[1], frame=0)
    vehicle.lists[MissionKind.MISSION] = tuple(items)
    capsys.readouterr()
    assert main(["diff", "out.waypoints", URL, "--format", "json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert [(one["number"], one["field"], one["kind"]) for one in told["differences"]] == [
        (2, "frame", "changed")
    ]


@pytest.mark.usefixtures("mission")
def test_two_files_are_compared_without_a_vehicle(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", "out.waypoints", "other.plan"]) == 0
    assert main(["diff", "out.waypoints", "other.plan"]) == 0
    assert "are the same mission" in capsys.readouterr().out


@pytest.fixture
def _own_handlers() -> Iterator[None]:
    """Put back what main makes of signals."""
    before = {one: signal.getsignal(one) for one in (signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("mission", "_own_handlers")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interruption_puts_the_old_mission_back(
    on_line: list[VirtualLine], number: signal.Signals, capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted(VirtualLine):
        def send(self, data: bytes, peer: object = None) -> None:
            items = sum(frame[7] == 73 for frame in self.sent)
            if data[7] == 73 and items == 2:  # MISSION_ITEM_INT, the third
                self.sent.append(data)
                signal.raise_signal(number)
            super().send(data, peer)

    vehicle = _vehicle(ARDUPILOT)
    on_line.append(Interrupted(vehicle))
    assert main(list(SENT)) == 130
    assert "interrupted; the old mission is on the vehicle" in capsys.readouterr().err
    assert _flown(vehicle) == OLD


@pytest.mark.usefixtures("mission")
def test_a_bug_within_an_upload_puts_the_old_mission_back(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    class Broken(VirtualLine):
        def send(self, data: bytes, peer: object = None) -> None:
            items = sum(frame[7] == 73 for frame in self.sent)
            if data[7] == 73 and items == 2:
                self.sent.append(data)
                raise ZeroDivisionError
            super().send(data, peer)

    vehicle = _vehicle(ARDUPILOT)
    on_line.append(Broken(vehicle))
    assert main(list(SENT)) == 1
    said = capsys.readouterr().err
    assert "a bug in mavjoule" in said
    assert "ZeroDivisionError: ; the old mission is on the vehicle" in said
    assert _flown(vehicle) == OLD


@pytest.mark.usefixtures("mission")
def test_a_second_interruption_says_what_may_be_on_the_vehicle(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted(VirtualLine):
        items = 0

        def send(self, data: bytes, peer: object = None) -> None:
            self.items += data[7] == 73
            if data[7] == 73 and self.items >= 3:
                raise KeyboardInterrupt
            super().send(data, peer)

    on_line.append(Interrupted(_vehicle(ARDUPILOT)))
    assert main(list(SENT)) == 130
    assert "putting back what it had was interrupted too: it may have the old mission" in (
        capsys.readouterr().err
    )


@pytest.mark.usefixtures("mission")
def test_an_interruption_while_the_vehicle_is_listened_to_says_that_it_has_the_mission(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted(VirtualLine):
        def receive(self, timeout_s: float) -> list[tuple[Any, bytes]]:
            read_back = [one for one in vehicle.received if one.name == "MISSION_REQUEST_LIST"]
            if len(read_back) == 9 and vehicle.received[-1].name == "MISSION_ACK":
                raise KeyboardInterrupt  # each list was read before the check, before and after
            return super().receive(timeout_s)

    vehicle = _vehicle()
    on_line.append(Interrupted(vehicle))
    assert main(list(SENT)) == 130
    assert "interrupted; the mission is on the vehicle" in capsys.readouterr().err


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize(
    ("is_armed", "landed_state", "said"),
    [
        (True, 1, "it is armed"),
        (True, 2, "it is armed and in the air"),
        (False, 2, "it is in the air"),
        (False, 4, "it is in the air"),  # landing
    ],
)
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_nothing_is_sent_to_a_vehicle_that_is_armed_or_in_the_air(
    on_line: list[VirtualLine],
    autopilot: int,
    is_armed: bool,  # noqa: FBT001 - a parameter of a test
    landed_state: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    vehicle = _vehicle(autopilot)
    vehicle.is_armed, vehicle.landed_state = is_armed, landed_state
    on_line += [VirtualLine(vehicle), VirtualLine(vehicle)]
    assert main(list(SENT)) == 2
    assert said in capsys.readouterr().err
    assert _flown(vehicle) == OLD
    assert main([*SENT, "--force"]) == 0


@pytest.mark.usefixtures("mission")
def test_a_vehicle_that_is_armed_during_the_question_is_sent_nothing(
    on_line: list[VirtualLine], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle()

    def arm(question: str, **_: object) -> bool:
        assert "in place of its 4 items?" in question
        vehicle.is_armed = True
        return True

    monkeypatch.setattr(upload_module, "_can_ask", lambda: True)
    monkeypatch.setattr("click.confirm", arm)
    on_line.append(VirtualLine(vehicle))
    assert main([one for one in SENT if one != "--yes"]) == 2
    assert "it is armed" in capsys.readouterr().err
    assert _flown(vehicle) == OLD


@pytest.mark.usefixtures("mission")
def test_a_vehicle_without_heartbeats_is_sent_nothing(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    class Stale(VirtualLine):
        def receive(self, timeout_s: float) -> list[tuple[Any, bytes]]:
            if self.time_s > 1.5:  # it was heard, and answers on
                vehicle.heartbeat_s = math.inf
            return super().receive(timeout_s)

    vehicle = _vehicle()
    on_line.append(Stale(vehicle))
    assert main([*SENT, "--heartbeat-timeout", "3"]) == 3
    said = capsys.readouterr().err
    assert "whether it is armed is not known" in said
    assert "mavjoule: nothing was sent\n" in said
    assert _flown(vehicle) == OLD


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_fence_that_only_the_vehicle_has_is_not_removed_unless_that_is_asked_for(
    on_line: list[VirtualLine], autopilot: int, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle(autopilot)
    fence = (wire_item(command=5003, param1=5000.0, x=500_000_000, y=200_000_000, z=0.0),)
    vehicle.lists[MissionKind.FENCE] = fence
    on_line += [VirtualLine(vehicle) for _ in range(3)]
    assert main(list(SENT)) == 1
    said = capsys.readouterr()
    assert "V106" in said.out
    assert "a fence of 1 area and the mission has none" in said.out
    assert (vehicle.lists[MissionKind.FENCE], _flown(vehicle)) == (fence, OLD)
    assert main([*SENT, "--keep-fence"]) == 0
    assert "V106" not in capsys.readouterr().out
    assert vehicle.lists[MissionKind.FENCE] == fence
    assert len(_flown(vehicle)) == 3
    assert main([*SENT, "--ignore", "V106"]) == 0
    assert "will be removed" in capsys.readouterr().err
    assert vehicle.lists[MissionKind.FENCE] == ()


@pytest.mark.usefixtures("mission")
def test_a_mission_is_checked_with_the_fence_that_is_kept(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle()
    narrow = wire_item(command=5003, param1=1.0, x=500_000_000, y=210_000_000, z=0.0)
    vehicle.lists[MissionKind.FENCE] = (narrow,)
    on_line.append(VirtualLine(vehicle))
    assert main([*SENT, "--keep-fence"]) == 1
    assert "F101" in capsys.readouterr().out
    assert _flown(vehicle) == OLD


@pytest.mark.parametrize("parts", [1, 2])
def test_areas_of_a_drawing_are_judged_as_the_vehicle_holds_them(
    parts: int, on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of the parts of an area one is enough for the drawing, and not for PX4."""
    halves = [[19.999, 20.0005], [20.0005, 20.003]] if parts > 1 else [[19.999, 20.003]]
    rings = [[[[w, 49.999], [e, 49.999], [e, 50.001], [w, 50.001], [w, 49.999]]] for w, e in halves]
    line = {"type": "LineString", "coordinates": [[20.0, 50.0, 250.0], [20.001, 50.0, 250.0]]}
    drawn = [
        {"type": "Feature", "properties": {}, "geometry": line},
        {
            "type": "Feature",
            "properties": {"name": "Flight area"},
            "geometry": {"type": "MultiPolygon", "coordinates": rings},
        },
    ]
    path = tmp_path / "drawn.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": drawn}), encoding="utf-8")
    vehicle = _vehicle()
    on_line.append(VirtualLine(vehicle))
    command = [str(path) if one == "out.waypoints" else one for one in SENT]
    assert main(command) == (1 if parts > 1 else 0)
    assert ("F106" in capsys.readouterr().out) is (parts > 1)
    assert (_flown(vehicle) == OLD) is (parts > 1)


@pytest.mark.usefixtures("mission")
def test_rally_points_that_only_the_vehicle_has_are_named_before_they_go(
    on_line: list[VirtualLine], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(question: str, **_: object) -> bool:
        assert "in place of its 4 items, 1 rally point?" in question
        return False

    vehicle = _vehicle()
    vehicle.lists[MissionKind.RALLY] = (
        wire_item(command=5100, x=500_000_000, y=200_000_000, z=30.0),
    )
    monkeypatch.setattr(upload_module, "_can_ask", lambda: True)
    monkeypatch.setattr("click.confirm", refuse)
    on_line.append(VirtualLine(vehicle))
    assert main([one for one in SENT if one != "--yes"]) == 1
    said = capsys.readouterr()
    assert "V107" in said.out
    assert "will be removed from PX4" in said.err
    assert len(vehicle.lists[MissionKind.RALLY]) == 1


@pytest.mark.usefixtures("mission")
@pytest.mark.parametrize("stop", [click.Abort, KeyboardInterrupt])
def test_an_interruption_at_the_question_says_that_nothing_was_sent(
    on_line: list[VirtualLine],
    stop: type[BaseException],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupt(*_: object, **__: object) -> bool:
        raise stop

    vehicle = _vehicle()
    monkeypatch.setattr(upload_module, "_can_ask", lambda: True)
    monkeypatch.setattr("click.confirm", interrupt)
    on_line.append(VirtualLine(vehicle))
    assert main([one for one in SENT if one != "--yes"]) == 130
    assert "mavjoule: interrupted: nothing was sent\n" in capsys.readouterr().err
    assert _flown(vehicle) == OLD
