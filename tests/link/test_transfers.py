"""Transfers over lines that lose, repeat and reorder, in virtual time."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from thinning import examples
from virtual_vehicle import ARDUPILOT, PX4, VirtualLine, VirtualVehicle, waypoints, wire_item

from planner.errors import LinkError
from planner.link.connection import Purpose
from planner.link.mission import MissionDownload, MissionKind, MissionUpload, UploadOutcome
from planner.link.parameters import ParameterDownload
from planner.link.transfers import LinkSettings, Transfer
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message

PARAMETERS = {
    **{f"P{n:03}": (float(n), 9) for n in range(60)},
    "COUNT": (-5.0, 6),
    "LARGE": (2_000_000_001.0, 6),
}


def _link(line: VirtualLine, **options: object) -> VehicleLink:
    return VehicleLink(line, name="virtual", **options)  # type: ignore[arg-type] # as given


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
@given(seed=st.integers(0, 10**6))
@settings(max_examples=examples(10), deadline=None)
def test_every_list_arrives_whole_when_a_fifth_is_lost_both_ways(autopilot: int, seed: int) -> None:
    vehicle = VirtualVehicle(autopilot=autopilot)
    vehicle.lists = {
        MissionKind.MISSION: waypoints(25),
        MissionKind.FENCE: waypoints(4),
        MissionKind.RALLY: (),
    }
    # PX4 begins anew for a single request that comes two items late.
    line = VirtualLine(vehicle, loss=0.2, repeated=0.1, late=0.03, seed=seed)
    link = _link(line)
    for kind, items in vehicle.lists.items():
        assert link.fetch_items(kind) == items


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
@given(seed=st.integers(0, 10**6))
@settings(max_examples=examples(10), deadline=None)
def test_every_parameter_arrives_when_a_fifth_is_lost_both_ways(autopilot: int, seed: int) -> None:
    vehicle = VirtualVehicle(autopilot=autopilot, parameters=PARAMETERS)
    link = _link(VirtualLine(vehicle, loss=0.2, repeated=0.1, late=0.1, seed=seed))
    is_bytewise = link.identity.is_bytewise
    assert is_bytewise is (autopilot == PX4)
    fetched = {one.name: one.number(is_bytewise=is_bytewise) for one in link.fetch_parameters()}
    exact = {name: value for name, (value, _) in PARAMETERS.items()}
    if not is_bytewise:  # a float holds 24 bits: ArduPilot's way loses the rest
        exact["LARGE"] = 2_000_000_000.0
    assert fetched == exact


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
@example(seed=316)  # the line repeats the last item, and the vehicle's word to the first is lost
@given(seed=st.integers(0, 10**6))
@settings(max_examples=examples(10), deadline=None)
def test_an_upload_through_loss_is_whole_on_the_vehicle(autopilot: int, seed: int) -> None:
    vehicle = VirtualVehicle(autopilot=autopilot)
    line = VirtualLine(vehicle, loss=0.2, repeated=0.1, late=0.1, seed=seed)
    link = _link(line, purpose=Purpose.UPLOAD)
    outcome, why = link.upload_items(MissionKind.MISSION, waypoints(12))
    assert outcome is not UploadOutcome.REJECTED, why
    assert vehicle.lists[MissionKind.MISSION] == waypoints(12)


def test_no_request_is_repeated_on_a_line_that_loses_nothing() -> None:
    vehicle = VirtualVehicle()
    vehicle.lists[MissionKind.MISSION] = waypoints(5)
    link = _link(VirtualLine(vehicle))
    vehicle.received.clear()
    link.fetch_items(MissionKind.MISSION)
    names = [one.name for one in vehicle.received]
    # The last message is still on its way when the transfer is over.
    assert names == ["MISSION_REQUEST_LIST", *["MISSION_REQUEST_INT"] * 5]


def test_a_stalled_list_says_at_which_item() -> None:
    vehicle = VirtualVehicle()
    vehicle.lists[MissionKind.MISSION] = waypoints(9)
    line = VirtualLine(vehicle)
    link = _link(line, settings=LinkSettings(retries=3))
    line._cut_after = line.exchanged + 2 + 2 * 4  # four items come through
    with pytest.raises(LinkError, match="mission stalled: item 5 of 9 did not come"):
        link.fetch_items(MissionKind.MISSION)


def test_an_empty_list_is_no_item() -> None:
    assert _link(VirtualLine(VirtualVehicle())).fetch_items(MissionKind.FENCE) == ()


def test_a_list_the_vehicle_does_not_know_is_none() -> None:
    vehicle = VirtualVehicle(unsupported=frozenset({MissionKind.RALLY}))
    assert _link(VirtualLine(vehicle)).fetch_items(MissionKind.RALLY) is None


def test_a_refused_item_is_named_with_its_reason() -> None:
    vehicle = VirtualVehicle(refused_command=18)
    link = _link(VirtualLine(vehicle), purpose=Purpose.UPLOAD)
    items = (*waypoints(2), wire_item(command=18))
    outcome, why = link.upload_items(MissionKind.MISSION, items)
    assert outcome is UploadOutcome.REJECTED
    assert why == "UNSUPPORTED to item 3 of 3"
    assert vehicle.lists[MissionKind.MISSION] == ()


def _feed(transfer: Transfer, messages: list[Message]) -> None:
    for number, one in enumerate(messages):
        transfer.feed(one, number * 0.01)


def _received(name: str, **fields: object) -> Message:
    return Message(name=name, fields={"mission_type": 0, **fields}, system=1, component=1)


def test_a_count_that_keeps_changing_ends_the_transfer() -> None:
    download = MissionDownload(MissionKind.MISSION, LinkSettings(retries=4))
    download.begin(0.0)
    counts = [_received("MISSION_COUNT", count=10 + n) for n in range(2000)]
    with pytest.raises(LinkError, match="could not be read: begun 5 times"):
        _feed(download, counts)


def test_a_vehicle_that_asks_without_end_is_left() -> None:
    upload = MissionUpload(MissionKind.MISSION, waypoints(2), LinkSettings())
    upload.begin(0.0)
    questions = [_received("MISSION_REQUEST_INT", seq=0)] * 1000
    with pytest.raises(LinkError, match="asks for the items of the mission without end"):
        _feed(upload, questions)


def test_a_vehicle_that_asks_often_gets_every_item() -> None:
    # PX4 asks again after 250 ms, and answers may wait in a busy computer: 40 times for each of 50 items.
    upload = MissionUpload(MissionKind.MISSION, waypoints(50), LinkSettings())
    upload.begin(0.0)
    for seq in range(50):
        for _ in range(40):
            (item,) = upload.feed(_received("MISSION_REQUEST_INT", seq=seq), 0.1)
            assert item["seq"] == seq
    upload.feed(_received("MISSION_ACK", type=0), 0.2)
    assert upload.outcome is UploadOutcome.ACCEPTED


def test_items_that_were_never_announced_are_not_asked_for() -> None:
    upload = MissionUpload(MissionKind.MISSION, waypoints(2), LinkSettings())
    upload.begin(0.0)
    assert upload.feed(_received("MISSION_REQUEST_INT", seq=2), 0.1) == ()
    assert upload.feed(_received("MISSION_ACK", type=0), 0.2) == ()
    assert not upload.is_done


def test_more_parameters_than_a_vehicle_can_have_are_not_believed() -> None:
    download = ParameterDownload(LinkSettings())
    download.begin(0.0)
    claim = _received(
        "PARAM_VALUE",
        param_id="A",
        param_value=0.0,
        param_bytes=bytes(4),
        param_type=9,
        param_index=0,
        param_count=5001,
    )
    with pytest.raises(LinkError, match="claims 5001 parameters"):
        download.feed(claim, 0.1)


def _value(name: str, index: int, count: int) -> Message:
    fields = {"param_id": name, "param_index": index, "param_count": count}
    return _received("PARAM_VALUE", **fields, param_value=0.0, param_bytes=bytes(4), param_type=9)


def test_a_parameter_that_appears_in_between_shifts_the_others_and_none_is_lost() -> None:
    download = ParameterDownload(LinkSettings())
    download.begin(0.0)
    # A and B came, then N appears between them: the numbers of all behind it are others.
    _feed(download, [_value("A", 0, 3), _value("B", 1, 3), _value("B", 2, 4), _value("C", 3, 4)])
    asked = [one["param_index"] for one in download.expire(download.deadline_s)]
    assert asked == [0, 1]
    _feed(download, [_value("A", 0, 4), _value("N", 1, 4)])
    assert download.is_done
    assert [one.name for one in download.parameters] == ["A", "N", "B", "C"]


def test_one_that_appears_as_another_goes_makes_all_be_asked_for_again() -> None:
    download = ParameterDownload(LinkSettings())
    download.begin(0.0)
    _feed(download, [_value("A", 0, 3), _value("B", 1, 3)])
    assert [one.name for one in download.feed(_value("B", 2, 3), 0.5)] == ["PARAM_REQUEST_LIST"]
    _feed(download, [_value("A", 0, 3), _value("N", 1, 3), _value("B", 2, 3)])
    assert [one.name for one in download.parameters] == ["A", "N", "B"]


def test_a_vehicle_whose_parameters_always_change_is_left() -> None:
    download = ParameterDownload(LinkSettings())
    download.begin(0.0)
    with pytest.raises(LinkError, match="they change all the time"):
        _feed(download, [_value("A", 0, 2 + n) for n in range(100)])
