"""Lines on which an answer takes seconds, or never comes: what is waited for is told."""

from __future__ import annotations

import pytest
from simulated_vehicles import memory_line
from virtual_vehicle import VirtualLine, VirtualVehicle, waypoints

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.link.mission import MissionKind
from planner.link.snapshot import read_vehicle
from planner.link.transfers import LinkSettings, Retransmission
from planner.link.vehicle import VehicleLink

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT


def test_ardupilot_is_read_over_a_line_on_which_an_answer_takes_ten_seconds() -> None:
    line = memory_line(ARDUPILOT, "delay=5")
    told: dict[str, set[int]] = {}
    link = VehicleLink(
        line, name="slow", on_progress=lambda what, done, _: told.setdefault(what, set()).add(done)
    )
    reading = read_vehicle(link)
    assert len(reading.lists[0] or ()) == 5  # type: ignore[index] # an IntEnum is its number
    assert told["mission"] == {0, 1, 2, 3, 4, 5}
    assert {"the vehicle's heartbeat", "AUTOPILOT_VERSION", "the vehicle's state"} <= told.keys()


def test_px4_over_a_line_slower_than_it_remembers_is_told_of_as_that() -> None:
    link = VehicleLink(memory_line(PX4, "delay=3"), name="slow")
    with pytest.raises(LinkError, match=r"no answer came; the line is too slow .* --reply-timeout"):
        read_vehicle(link)


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_list_with_a_wrong_count_is_no_mission_and_told_of(autopilot: Autopilot) -> None:
    # Two items that are counted and not there: nobody knows whether the mission is whole.
    link = VehicleLink(memory_line(autopilot, "count=+2,no-files"), name="wrong")
    with pytest.raises(LinkError, match=r"it answered \w+; .* or the list on the vehicle broken"):
        read_vehicle(link)


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
@pytest.mark.parametrize("seed", range(4))
def test_what_comes_twice_and_in_another_order_is_read(autopilot: Autopilot, seed: int) -> None:
    faults = f"duplication=50%,reordering=50%,seed={seed}"
    reading = read_vehicle(VehicleLink(memory_line(autopilot, faults), name="mixed"))
    assert len(reading.lists[0] or ()) == (4 if autopilot is PX4 else 5)  # type: ignore[index] # an IntEnum


def test_an_answer_that_takes_long_is_waited_for_longer_the_next_time() -> None:
    timer = Retransmission(LinkSettings(reply_timeout_s=1.5))
    timer.sent(0.0)
    assert timer.deadline_s == 1.5
    for now_s in (1.5, 3.0, 4.5):
        timer.repeated(now_s)
    timer.answered(5.0)
    timer.sent(5.0)
    assert timer.deadline_s == pytest.approx(5.0 + 1.25 * 5.0)
    timer.answered(10.0)  # a clear round trip of 5 s
    timer.sent(10.0)
    assert timer.deadline_s == pytest.approx(10.0 + 1.25 * 5.0)


def test_a_loss_or_two_do_not_make_a_line_slow() -> None:
    timer = Retransmission(LinkSettings(reply_timeout_s=1.5))
    timer.sent(0.0)
    timer.repeated(1.5)
    timer.repeated(3.0)
    timer.answered(3.1)
    timer.sent(3.1)
    assert timer.deadline_s == pytest.approx(3.1 + 1.5)


@pytest.mark.parametrize("seed", range(5))
def test_a_longer_list_is_read_of_px4_through_repetitions_out_of_order(seed: int) -> None:
    vehicle = VirtualVehicle(autopilot=12)
    vehicle.lists[MissionKind.MISSION] = waypoints(25)
    line = VirtualLine(vehicle, repeated=0.5, late=0.5, seed=seed)
    assert VehicleLink(line, name="mixed").fetch_items(MissionKind.MISSION) == waypoints(25)
