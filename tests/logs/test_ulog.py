"""PX4's ULog: what is found in it, under old names and new, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import made_flight as made
import numpy as np
import pytest
from ulog_writer import UlogWriter, px4_log

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.logs.files import read_log
from planner.logs.messages import MessageTable
from planner.logs.record import AUTO_MISSION, Boundary, LogFormat
from planner.logs.ulog import missions_flown

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from planner.logs.record import FlightRecord


def _read(tmp_path: Path, content: bytes) -> FlightRecord:
    path = tmp_path / "flight.ulg"
    path.write_bytes(content)
    [record] = read_log(path)
    return record


@pytest.fixture
def record(tmp_path: Path) -> FlightRecord:
    return _read(tmp_path, px4_log().content())


def test_a_flight_goes_from_arming_to_disarming(record: FlightRecord) -> None:
    assert record.log_format is LogFormat.ULOG
    assert record.duration_s == pytest.approx(50.0, abs=1e-6)
    assert (record.begins_with, record.ends_with) == (Boundary.ARMING, Boundary.ARMING)
    assert record.findings == ()


def test_energy_and_distance_are_those_flown(record: FlightRecord) -> None:
    energy_j = np.trapezoid(record.power_w, record.time_s)
    assert energy_j == pytest.approx(made.ENERGY_J, abs=2 * 160.0 * 0.1)
    assert np.ptp(record.north_m) == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert np.ptp(record.height_above_home_m) == pytest.approx(made.HEIGHT_M, abs=1e-3)
    assert np.max(record.climb_m_s) == pytest.approx(made.CLIMB_M_S)


def test_the_quaternion_becomes_angles(record: FlightRecord) -> None:
    assert record.pitch_deg == pytest.approx(-4.0, abs=1e-4)
    assert record.roll_deg == pytest.approx(0.0, abs=1e-6)
    assert record.yaw_deg == pytest.approx(0.0, abs=1e-6)


def test_modes_items_home_parameters_and_firmware_are_found(record: FlightRecord) -> None:
    assert set(record.mode.tolist()) == {"AUTO_MISSION"}
    # PX4 counts from 0: its item 1 begins at 10 s of the log, 5 s after arming.
    assert record.mission_item[[0, 49, 51, 349, 351]].tolist() == [1, 1, 2, 2, 3]
    assert record.home.altitude_amsl_m == pytest.approx(400.0)
    assert record.parameters == {"SYS_AUTOSTART": 4001.0, "MPC_XY_CRUISE": 5.0}
    assert record.autopilot is Autopilot.PX4
    assert record.firmware == "PX4 1.15.3"


@pytest.mark.parametrize("reference", [("position", "velocity"), ()])
def test_references_are_found_under_old_names_and_new(
    tmp_path: Path, reference: tuple[str, ...]
) -> None:
    record = _read(tmp_path, px4_log(reference=reference).content())
    assert record.reference_north_m - record.north_m == pytest.approx(0.5, abs=0.01)
    difference_m = record.reference_height_m - record.height_above_home_m
    assert difference_m == pytest.approx(0.25, abs=0.01)
    assert np.max(record.reference_speed_m_s) == pytest.approx(made.CRUISE_M_S)
    assert np.max(record.reference_climb_m_s) == pytest.approx(made.CLIMB_M_S)


def test_a_local_frame_whose_origin_moves_is_one_frame(tmp_path: Path) -> None:
    record = _read(tmp_path, px4_log(origin_moves_s=27.0).content())
    # 1 cm in 100 m: the length of a degree of latitude is rounded to metres.
    assert record.reference_north_m - record.north_m == pytest.approx(0.5, abs=0.02)
    assert np.ptp(record.north_m) == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert np.ptp(record.height_above_home_m) == pytest.approx(made.HEIGHT_M, abs=0.01)
    assert np.ptp(record.reference_height_m) == pytest.approx(made.HEIGHT_M, abs=0.01)


def test_global_positions_come_from_local_ones_where_they_must(tmp_path: Path) -> None:
    log = px4_log()
    whole = _read(tmp_path, log.content())
    log.data = bytearray(bytes(log.data).replace(b"vehicle_global_position", b"x" * 23))
    log.definitions = bytearray(
        bytes(log.definitions).replace(b"vehicle_global_position", b"x" * 23)
    )
    record = _read(tmp_path, log.content())
    assert record.latitude_deg == pytest.approx(whole.latitude_deg, abs=1e-7)
    assert record.altitude_amsl_m == pytest.approx(whole.altitude_amsl_m, abs=1e-3)
    assert "vehicle_local_position" in str(record.quantity("latitude_deg").found_in)


def test_a_jump_of_the_estimate_is_told(tmp_path: Path) -> None:
    record = _read(tmp_path, px4_log(jump_s=30.0).content())
    assert [finding.code for finding in record.findings] == ["R107"]
    # 3 m north and 4 m west are 5 m, 25 s after arming.
    assert "by up to 5.0 m at 25.0 s" in record.findings[0].message


@pytest.mark.parametrize("current_a", [-1.0, 0.0])
def test_without_a_current_sensor_there_is_no_power(tmp_path: Path, current_a: float) -> None:
    record = _read(tmp_path, px4_log(current_a=current_a).content())
    assert not record.quantity("power_w").is_found
    assert "no current sensor" in record.quantity("current_a").remark


def test_setpoints_that_are_no_numbers_are_unknown(tmp_path: Path) -> None:
    log = px4_log()
    for tenth in range(100):
        log.add("trajectory_setpoint", 60.0 + tenth / 10.0, *(float("nan"),) * 6)
    record = _read(tmp_path, log.content())
    assert np.all(np.isfinite(record.reference_north_m))


def test_a_truncated_log_gives_what_is_there(tmp_path: Path) -> None:
    content = px4_log().content()
    record = _read(tmp_path, content[: len(content) * 2 // 3])
    assert record.ends_with is Boundary.LOG
    assert 30.0 < record.duration_s < 40.0


def test_a_log_of_another_program_is_refused_by_its_name(tmp_path: Path) -> None:
    log = UlogWriter()
    log.text("Application", "Lightshow")
    log.define("Vehicle", "float x")
    log.add("Vehicle", 1.0, 2.0)
    with pytest.raises(LogFileError, match="is a ULog of Lightshow without any of PX4's topics"):
        _read(tmp_path, log.content())


def _said(record: FlightRecord) -> list[str]:
    return [finding.message.split(": ", 1)[1] for finding in record.findings]


@dataclass(slots=True)
class OddWriter(UlogWriter):
    """A logger whose messages some hand puts into another time or place."""

    odd: Callable[[str, float], float | None] = lambda _, time_s: time_s
    """Returns the time to write at; ``None``: the message waits for the next of its topic."""
    waiting: dict[str, tuple[float, tuple[float, ...]]] = field(default_factory=dict)

    def add(self, topic: str, time_s: float, *values: float, instance: int = 0) -> None:
        shown_s = self.odd(topic, time_s)
        if shown_s is None:
            self.waiting[topic] = (time_s, values)
            return
        UlogWriter.add(self, topic, shown_s, *values, instance=instance)
        if late := self.waiting.pop(topic, None):
            UlogWriter.add(self, topic, late[0], *late[1])


@pytest.mark.parametrize("stray_s", [0.0, 1.8e10], ids=["without a time", "damaged"])
def test_messages_out_of_time_are_left_out_and_counted(
    tmp_path: Path, record: FlightRecord, stray_s: float
) -> None:
    # PX4 wrote messages that were published without a time (its pull request 11708).
    def odd(topic: str, time_s: float) -> float:
        return stray_s if topic == "battery_status" and 20.0 < time_s < 20.35 else time_s

    found = _read(tmp_path, px4_log(OddWriter(odd=odd)).content())
    assert _said(found) == ["battery_status: out of time and left out: 3 messages"]
    assert found.duration_s == record.duration_s
    assert found.power_w == pytest.approx(record.power_w)  # it is even there: a straight line
    assert found.north_m.tolist() == record.north_m.tolist()


def _set_back(*topics: str) -> bytes:
    """Return a log some of whose topics are set back by 15 s in the middle."""

    def odd(topic: str, time_s: float) -> float:
        return time_s - 15.0 if topic in topics and time_s > 30.0 else time_s

    return px4_log(OddWriter(odd=odd)).content()


def test_a_topic_of_another_clock_is_left_out_and_named(
    tmp_path: Path, record: FlightRecord
) -> None:
    found = _read(tmp_path, _set_back("vehicle_attitude"))
    assert _said(found) == ["the clock of vehicle_attitude goes backwards: the topic is left out"]
    assert not found.quantity("yaw_deg").is_found
    assert found.power_w.tolist() == record.power_w.tolist()
    assert found.north_m.tolist() == record.north_m.tolist()


def test_a_log_most_of_whose_topics_are_set_back_is_refused(tmp_path: Path) -> None:
    topics = ("battery_status", "vehicle_attitude", "vehicle_local_position", "trajectory_setpoint")
    with pytest.raises(LogFileError, match="clock of battery_status goes backwards"):
        _read(tmp_path, _set_back(*topics, "vehicle_global_position"))


def test_messages_written_a_little_late_are_read_in_the_order_of_their_times(
    tmp_path: Path, record: FlightRecord
) -> None:
    # As pyulog's pull request 100 has them.
    def odd(topic: str, time_s: float) -> float | None:
        is_late = topic in {"vehicle_status", "vehicle_land_detected"} and time_s == 20.0
        return None if is_late else time_s

    found = _read(tmp_path, px4_log(OddWriter(odd=odd)).content())
    assert found.findings == ()
    assert found.duration_s == record.duration_s
    assert found.mode.tolist() == record.mode.tolist()


def test_a_header_without_a_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogFileError):
        _read(tmp_path, UlogWriter().content())


def test_another_battery_is_told(tmp_path: Path) -> None:
    log = px4_log()
    log.add("battery_status", 20.0, 12.0, 7.5, instance=1)
    record = _read(tmp_path, log.content())
    assert [finding.code for finding in record.findings] == ["R106"]
    assert record.voltage_v == pytest.approx(made.VOLTAGE_V)


def _log_with_items() -> UlogWriter:
    log = px4_log()
    log.define(
        "navigator_mission_item",
        "uint16_t sequence_current;uint16_t nav_cmd;float latitude;float longitude;float altitude;"
        "float time_inside;bool altitude_is_relative",
    )
    return log


def test_a_landing_flown_to_as_to_a_waypoint_is_read_as_the_landing(tmp_path: Path) -> None:
    # As PX4 1.17 logs a landing elsewhere: to its place first, down there, idle, all of one number.
    log = _log_with_items()
    for time_s, sequence, command in ((6.0, 0, 16), (12.0, 1, 16), (20.0, 1, 21), (25.0, 1, 0)):
        log.add("navigator_mission_item", time_s, sequence, *(command, 50.0, 20.0, 30.0, 0.0, True))
    record = _read(tmp_path, log.content())
    assert [(item.item, item.command) for item in record.mission_items] == [(1, 16), (2, 21)]


def test_items_of_a_return_are_none_of_the_mission() -> None:
    # RTL numbers its way home, its descent and its landing 1, 7 and 8, whatever the mission holds.
    columns = {"sequence_current": (0, 1, 1, 7), "nav_cmd": (16, 16, 21, 21)}
    same = dict.fromkeys(("latitude", "longitude", "altitude", "time_inside"), (0.0,) * 4)
    numbers = {name: np.array(values, float) for name, values in (columns | same).items()}
    numbers["altitude_is_relative"] = np.ones(4)
    items = MessageTable(
        name="", places=np.arange(4), time_s=np.array([6.0, 12.0, 24.0, 25.0]), numbers=numbers
    )
    ((_, found),) = missions_flown(items, None, ((0.0, AUTO_MISSION), (24.0, "AUTO_RTL")))
    assert [(item.item, item.command) for item in found] == [(1, 16), (2, 16)]
    assert missions_flown(items, None, ((0.0, "POSCTL"),)) == ()


def test_changes_of_speed_are_read_from_the_speeds_flown_by(tmp_path: Path) -> None:
    log = _log_with_items()
    log.define("position_setpoint_triplet", "float current.cruising_speed")
    # Items 0, 2, 4: 1 was a change to 8 m/s, 3 was none.
    for time_s, sequence, speed in ((6.0, 0, -1.0), (12.0, 2, 8.0), (20.0, 4, 8.0)):
        log.add("navigator_mission_item", time_s, sequence, *(16, 50.0, 20.0, 30.0, 5.0, True))
        log.add("position_setpoint_triplet", time_s + 0.1, speed)
    record = _read(tmp_path, log.content())
    told = [(item.item, item.command, item.param1, item.param2) for item in record.mission_items]
    assert told == [(1, 16, 5.0, None), (2, 178, 1.0, 8.0), (3, 16, 5.0, None), (5, 16, 5.0, None)]
