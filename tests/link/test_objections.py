"""What a vehicle says against a mission it was sent, in texts, in events and by what it holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import memory_line

from planner.autopilot import Autopilot
from planner.geo.fence import Fence
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.telemetry import (
    EventRecord,
    EventRequest,
    NextEventRequest,
    StatusText,
    Telemetry,
    VehicleEvent,
    event_number,
)
from planner.link.transfers import LinkSettings
from planner.link.upload import (
    LONGEST_S,
    UploadResult,
    is_event_rejection,
    is_rejection,
    is_same,
    objections,
    upload_mission,
)
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message
from planner.values import replace

if TYPE_CHECKING:
    from simulated_vehicles import MemoryLine

    from planner.mission.items import Mission

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
NEW = mission(takeoff(35.0), waypoint(400.0, 35.0), rtl())
VIOLATION = "navigator_mis_geofence_violation"


def _upload(line: MemoryLine, sent: Mission = NEW, *, has_home: bool = True) -> UploadResult:
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    return upload_mission(link, sent, listen_s=3.0, has_home=has_home)


@pytest.mark.parametrize(
    "text",
    [
        "Mission rejected: takeoff is not the first waypoint item",
        "Geofence violation for waypoint 3",
        "Geofence breach on path to waypoint 4",
        "Geofence requires valid home position",
        "Geofence invalid, doesn't contain Home position",
        "First waypoint too far away: 1200m, 900 max",
        "Distance between waypoint and gate too close: 0 meters",
        "PreArm: Mode requires mission",
    ],
)
def test_what_autopilots_say_against_a_mission_is_a_rejection(text: str) -> None:
    assert is_rejection(StatusText(severity=2, text=text))
    assert not is_rejection(StatusText(severity=6, text=text))


@pytest.mark.parametrize(
    "text",
    [
        "First waypoint far away: 1200m. Correct mission loaded?",
        "Flight plan received",
        "WPM: REJ. CMD: Busy",
        "Low battery level",
        "SIMULATED VEHICLE by mavjoule: nothing flies",
    ],
)
def test_what_is_about_something_else_is_none(text: str) -> None:
    assert not is_rejection(StatusText(severity=2, text=text))


def test_events_are_numbered_as_px4_hashes_them() -> None:
    # FNV-1a's own test vectors: a is e40c292c, foobar is bf9cf968; PX4 keeps 24 bits, 1 above them.
    assert event_number("a") == 0x010C292C
    assert event_number("foobar") == 0x019CF968


def test_a_warning_and_an_event_of_something_else_are_no_rejection() -> None:
    number = event_number("navigator_mis_first_wp_far")
    assert not is_event_rejection(VehicleEvent(number=number, severity=4))
    assert not is_event_rejection(VehicleEvent(number=0x1000001, severity=0))
    violation = VehicleEvent(number=event_number(VIOLATION), severity=3, arguments=b"\x07\0")
    said = f"{VIOLATION} at item 7 (mavjoule explain {VIOLATION})"
    assert objections((), (violation, violation)) == (said,)
    text = StatusText(severity=2, text="Geofence violation for waypoint 7")
    assert objections((text,), (violation,)) == (text.text,)


def test_a_rejection_that_only_an_event_reports_fails_the_upload_through_loss() -> None:
    results = [
        _upload(memory_line(PX4, f"event={VIOLATION},loss=20%,seed={seed}")) for seed in range(4)
    ]
    assert not any(result.is_good for result in results)
    # Event and number of the latest are lost together in one of 25.
    assert sum(VIOLATION in result.rejection for result in results) >= 2


def test_a_mission_that_px4_rejected_before_is_rejected_again_though_it_says_nothing() -> None:
    line = memory_line(PX4, f"event={VIOLATION}")
    assert VIOLATION in _upload(line).rejection
    again = _upload(line)
    assert again.rejection == "the vehicle reports no mission that it would fly"


def test_without_a_place_px4_has_not_judged_it_yet() -> None:
    line = memory_line(PX4, f"event={VIOLATION}")
    _upload(line)
    again = _upload(line, has_home=False)
    assert again.is_unjudged
    assert again.is_good


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_mission_that_is_flown_is_good_and_may_be_sent_twice(autopilot: Autopilot) -> None:
    line = memory_line(autopilot)
    for _ in range(2):
        result = _upload(line)
        assert result.is_good
        assert not result.is_unjudged


def test_no_mission_is_none_and_good() -> None:
    empty = replace(NEW, items=(), fence=Fence(), rally=())
    assert _upload(memory_line(PX4), empty).is_good


def _timed(line: MemoryLine) -> tuple[UploadResult, float]:
    """Return what becomes of an upload that is listened to until it is taken, and how long that took. [s]"""
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    result = upload_mission(link, NEW)
    return result, result.spans_s.get("listened", 0.0)


def test_px4_is_listened_to_until_it_has_judged_the_mission_and_reported_nothing() -> None:
    result, listened_s = _timed(memory_line(PX4))
    assert result.is_good
    assert listened_s < 2.1  # MISSION_CURRENT comes every second, the first that counts after one


def test_ardupilot_has_judged_it_when_it_accepted_it() -> None:
    result, listened_s = _timed(memory_line(ARDUPILOT))
    assert result.is_good
    assert listened_s < 0.5


def test_what_px4_reports_against_a_mission_is_heard_without_a_time_to_listen() -> None:
    result, _ = _timed(memory_line(PX4, f"event={VIOLATION}"))
    assert VIOLATION in result.rejection
    result, _ = _timed(memory_line(PX4, f"event={VIOLATION},loss=20%,seed=1"))
    assert not result.is_good


def test_px4_that_does_not_name_its_mission_is_listened_to_as_long_as_may_be() -> None:
    line = memory_line(PX4)
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    link.would_fly_mission = lambda: False  # type: ignore[method-assign] # as versions before 2025
    result = upload_mission(link, NEW)
    assert result.is_good
    assert result.spans_s["listened"] >= LONGEST_S - 1.0


def _asked_for(link: VehicleLink) -> list[str]:
    names: list[str] = []
    send = link.connection.send

    def note(sent: Message) -> None:
        names.append(sent.name)
        send(sent)

    link.connection.send = note  # type: ignore[method-assign] # reads along
    return names


def test_a_list_that_is_still_the_one_that_was_read_is_not_read_again() -> None:
    line = memory_line(PX4)
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    first = link.fetch_items(MissionKind.MISSION)
    names = _asked_for(link)
    assert link.fetch_items_again(MissionKind.MISSION) == first
    assert "MISSION_REQUEST_INT" not in names
    other = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    assert first is not None
    other.upload_items(MissionKind.MISSION, first[:2])  # another station sends one
    assert is_same(link.fetch_items_again(MissionKind.MISSION) or (), first[:2])
    assert "MISSION_REQUEST_INT" in names


def test_a_vehicle_without_a_later_event_says_so_across_the_end_of_the_numbers() -> None:
    for latest, oldest, is_last in ((70, 51, True), (70, 72, False), (65_535, 65_516, True)):
        record = EventRecord()
        record.take(_latest(latest))
        request = NextEventRequest(record, LinkSettings(), retries=2)
        number = (latest + 1) & 0xFFFF
        assert [one["first_sequence"] for one in request.begin(0.0)] == [number]
        fields = {"sequence": number, "sequence_oldest_available": oldest}
        request.feed(Message(name="RESPONSE_EVENT_ERROR", fields=fields), 0.1)
        assert request.is_done
        assert request.is_last is is_last


def _event(sequence: int, *, number: int = 5) -> Message:
    fields = {"id": number, "sequence": sequence, "log_levels": 0x63, "arguments": b"\0" * 40}
    return Message(name="EVENT", fields=fields, system=1, component=1)


def _latest(sequence: int) -> Message:
    return Message(name="CURRENT_EVENT_SEQUENCE", fields={"sequence": sequence, "flags": 0})


def test_events_that_got_lost_are_known_of_across_the_end_of_the_numbers() -> None:
    record = EventRecord()
    for sequence in (65_533, 65_535, 1):
        record.take(_event(sequence))
    record.take(_latest(2))
    assert list(record.missing) == [0, 2, 65_534]
    record.take(_event(65_534))
    record.take(_event(65_534))
    assert list(record.missing) == [0, 2]
    assert len(record.take_events()) == 4
    assert record.take_events() == ()


def test_before_the_first_word_nothing_is_missing_and_a_restart_is_none() -> None:
    record = EventRecord()
    record.take(_latest(500))
    assert record.missing == ()
    record.take(_latest(3000))
    assert record.missing == ()
    record.take(_event(3001))
    assert len(record.take_events()) == 1


def test_events_that_are_never_sent_again_are_done_without() -> None:
    record = EventRecord()
    record.take(_latest(7))
    record.take(_latest(9))
    request = EventRequest(record, LinkSettings(), retries=2)
    assert [one["first_sequence"] for one in request.begin(0.0)] == [8, 9]
    for _ in range(3):
        request.expire(request.deadline_s)
    assert request.is_done
    assert record.missing == ()


def test_a_vehicle_that_reports_without_end_fills_nothing() -> None:
    telemetry = Telemetry()
    for sequence in range(5000):
        telemetry.take(_event(sequence))
    assert len(telemetry.events.take_events()) == 200
