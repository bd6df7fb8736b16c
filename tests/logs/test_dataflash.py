"""ArduPilot's DataFlash logs: what is found in them, and what they are full of besides."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import made_flight as made
import numpy as np
import pytest
from dataflash_writer import DataflashWriter, copter_log

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.logs.files import read_log
from planner.logs.record import Boundary, LogFormat

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from planner.logs.record import FlightRecord

ONE_SAMPLE_J = 2 * 160.0 * 0.1
"""A sampled step of the power is a ramp of one sample at either end. [J]"""


def _read(tmp_path: Path, content: bytes) -> tuple[FlightRecord, ...]:
    path = tmp_path / "flight.bin"
    path.write_bytes(content)
    return read_log(path)


def _codes(record: FlightRecord) -> list[str]:
    return [finding.code for finding in record.findings]


@pytest.fixture
def record(tmp_path: Path) -> FlightRecord:
    [flight] = _read(tmp_path, copter_log().content())
    return flight


def test_a_flight_goes_from_arming_to_disarming(record: FlightRecord) -> None:
    assert record.log_format is LogFormat.DATAFLASH
    assert record.duration_s == pytest.approx(made.DISARMED_S - made.ARMED_S, abs=1e-6)
    assert (record.begins_with, record.ends_with) == (Boundary.ARMING, Boundary.ARMING)
    assert record.begins_in_log_s == pytest.approx(made.ARMED_S)
    assert record.time_s[0] == 0.0
    assert len(record.time_s) == 501
    assert record.findings == ()


def test_energy_and_distance_are_those_flown(record: FlightRecord) -> None:
    energy_j = np.trapezoid(record.power_w, record.time_s)
    assert energy_j == pytest.approx(made.ENERGY_J, abs=ONE_SAMPLE_J)
    assert record.north_m[-1] - record.north_m[0] == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert np.max(record.height_above_home_m) == pytest.approx(made.HEIGHT_M, abs=1e-3)
    assert np.max(record.altitude_amsl_m) == pytest.approx(420.0, abs=1e-3)


def test_climbs_are_positive_upwards(record: FlightRecord) -> None:
    climbing = (record.time_s > 3.5) & (record.time_s < 12.5)
    assert record.climb_m_s[climbing] == pytest.approx(made.CLIMB_M_S)
    assert record.reference_climb_m_s[climbing] == pytest.approx(made.CLIMB_M_S)


def test_references_are_laid_over_the_track_though_their_origin_is_another(
    record: FlightRecord,
) -> None:
    assert record.reference_north_m - record.north_m == pytest.approx(0.5, abs=1e-3)
    assert record.reference_east_m - record.east_m == pytest.approx(0.5, abs=1e-3)
    difference_m = record.reference_height_m - record.height_above_home_m
    assert difference_m == pytest.approx(0.25, abs=1e-3)
    cruising = (record.time_s > 17.5) & (record.time_s < 26.5)
    assert record.reference_speed_m_s[cruising] == pytest.approx(made.CRUISE_M_S)


def test_only_the_first_core_and_the_first_battery_speak(record: FlightRecord) -> None:
    assert record.velocity_east_m_s == pytest.approx(0.0)
    assert record.voltage_v == pytest.approx(made.VOLTAGE_V)


def test_an_angle_is_not_averaged_over_north(record: FlightRecord) -> None:
    off_north_deg = np.abs((record.yaw_deg + 180.0) % 360.0 - 180.0)
    assert np.max(off_north_deg) <= 1.0 + 1e-6
    assert np.all((record.yaw_deg >= 0.0) & (record.yaw_deg < 360.0))


def test_events_become_columns(record: FlightRecord) -> None:
    assert set(record.mode.tolist()) == {"AUTO"}
    in_air = ~record.is_landed
    assert record.time_s[in_air][0] == pytest.approx(made.TAKEOFF_S - made.ARMED_S)
    assert record.time_s[in_air][-1] == pytest.approx(made.LANDED_S - made.ARMED_S - 0.1)
    # Item 2 begins at 10 s; what is flown before it is the one before it.
    assert record.mission_item[record.time_s < 4.95].tolist() == [1] * 50
    assert record.mission_item[(record.time_s > 5.05) & (record.time_s < 34.9)].tolist()[0] == 2
    assert record.mission_item[-1] == 3


def test_mission_parameters_home_and_firmware_are_those_on_board(record: FlightRecord) -> None:
    assert [item.item for item in record.mission_items] == [1, 2, 3]
    assert [item.command for item in record.mission_items] == [22, 16, 21]
    assert record.mission_items[1].frame == 3
    assert record.mission_items[1].latitude_deg == pytest.approx(47.001, abs=1e-6)
    assert record.parameters == {"WPNAV_SPEED": 500.0}
    assert record.home.altitude_amsl_m == pytest.approx(400.0)
    assert record.home.found_in == "ORGN"
    assert record.autopilot is Autopilot.ARDUPILOT
    assert record.firmware == "ArduCopter V4.6.1 (abcdef01)"
    assert record.vehicle == "QUAD/X"


def test_the_table_says_where_at_which_rate_and_what_is_missing(record: FlightRecord) -> None:
    assert [row.name for row in record.quantities] == [*record.columns()][1:]
    power = record.quantity("power_w")
    assert power.found_in == "BAT.Volt × Curr"
    assert power.rate_hz == pytest.approx(10.0)
    assert power.coverage == 1.0
    wind = record.quantity("wind_north_m_s")
    assert not wind.is_found
    assert wind.coverage == 0.0
    assert "calm" in wind.absence_cost
    assert np.all(np.isnan(record.wind_north_m_s))
    assert not record.quantity("airspeed_m_s").is_found
    with pytest.raises(KeyError):
        record.quantity("anything")


def test_without_a_current_sensor_there_is_no_power_and_it_is_said(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_log(current_a=0.0).content())
    assert not record.quantity("power_w").is_found
    assert "no current sensor" in record.quantity("current_a").remark
    assert np.all(np.isnan(record.current_a))
    assert record.voltage_v == pytest.approx(made.VOLTAGE_V)


def test_a_current_that_is_no_number_is_no_current(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_log(current_a=math.nan).content())
    assert not record.quantity("power_w").is_found


def test_a_second_battery_is_told(tmp_path: Path) -> None:
    log = copter_log()
    log.add("BAT", 59_950_000, 1, 12.0, 12.0, 23.1, 0.0)
    [record] = _read(tmp_path, log.content())
    assert _codes(record) == ["R106"]
    assert "23.1 A" in record.findings[0].message


def test_nothing_is_interpolated_over_a_gap(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_log(gap_s=(24.0, 27.0)).content())
    assert _codes(record) == ["R102"]
    inside = (record.time_s > 19.05) & (record.time_s < 21.95)
    assert np.all(np.isnan(record.height_above_home_m[inside]))
    assert np.all(np.isnan(record.power_w[inside]))
    assert np.all(np.isfinite(record.power_w[~inside]))
    assert record.quantity("power_w").coverage == pytest.approx(1 - 29 / 501)


def test_a_short_silence_is_bridged(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_log(gap_s=(24.0, 24.9)).content())
    assert record.findings == ()
    assert np.all(np.isfinite(record.power_w))


def test_a_log_that_begins_in_the_air_says_so(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_log(begins_s=20.0).content())
    assert record.begins_with is Boundary.LOG
    assert _codes(record) == ["R104"]
    assert record.duration_s == pytest.approx(35.0, abs=1e-6)
    assert not record.is_landed[0]


def test_two_flights_of_one_log_are_two_records(tmp_path: Path) -> None:
    log = copter_log()
    copter_log(boot_s=100.0, writer=log)
    first, second = _read(tmp_path, log.content())
    assert (first.number, second.number) == (1, 2)
    assert second.begins_in_log_s == pytest.approx(105.0)
    assert second.duration_s == pytest.approx(first.duration_s)
    assert second.power_w == pytest.approx(first.power_w, abs=1e-9)


def test_a_clock_that_restarts_cuts_the_log_in_two(tmp_path: Path) -> None:
    log = copter_log(boot_s=1000.0)
    second = copter_log(writer=log)
    del second
    first, again = _read(tmp_path, log.content())
    assert first.begins_in_log_s == pytest.approx(1005.0)
    assert again.begins_in_log_s == pytest.approx(5.0)
    assert "R103" in _codes(first)


def test_messages_out_of_time_are_left_out(tmp_path: Path) -> None:
    log = copter_log()
    where = len(log.messages) // 2
    stray = DataflashWriter.content(_one_position_at(log, 900.0))
    log.messages.insert(where, stray)
    [record] = _read(tmp_path, log.content())
    assert record.duration_s == pytest.approx(50.0, abs=1e-6)
    assert _codes(record) == ["R103"]
    assert np.max(record.height_above_home_m) == pytest.approx(made.HEIGHT_M, abs=1e-3)


def _one_position_at(log: DataflashWriter, time_s: float) -> DataflashWriter:
    """Take the last message away from a log into one of its own."""
    log.add("POS", round(time_s * 1e6), 47.0, 8.0, 5000.0, 5000.0, 5000.0)
    alone = DataflashWriter()
    alone.messages = [log.messages.pop()]
    return alone


def test_standing_on_the_ground_armed_is_no_flight(tmp_path: Path) -> None:
    log = DataflashWriter()
    log.define("ARM", "QB", "TimeUS,ArmState")
    log.define("POS", "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt")
    for tenth in range(200):
        if tenth in {10, 150}:
            log.add("ARM", tenth * 100_000, int(tenth == 10))
        log.add("POS", tenth * 100_000, 47.0, 8.0, 400.0, 0.0)
    with pytest.raises(LogFileError, match="never leaves the ground"):
        _read(tmp_path, log.content())


def test_a_truncated_log_gives_what_is_there(tmp_path: Path) -> None:
    content = copter_log().content()
    [record] = _read(tmp_path, content[: len(content) * 2 // 3])
    assert record.ends_with is Boundary.LOG
    assert 30.0 < record.duration_s < 40.0
    assert _codes(record) == ["R104"]


def _hover_throttle(
    tmp_path: Path, throttle: Callable[[made.Moment], float], saved: float, saved_s: float
) -> float:
    """Return MOT_THST_HOVER of the made flight, 0.39 before and saved once more, as the record has it."""
    log = copter_log(throttle=throttle, hover_throttles=((0.0, 0.39), (saved_s, saved)))
    [record] = _read(tmp_path, log.content())
    return record.parameters["MOT_THST_HOVER"]


@pytest.mark.parametrize(
    ("hovering", "saved", "saved_s", "hover"),
    [
        # 12 s of standing in the air at 0.65, faster and slower while it climbs, cruises and sinks
        (0.65, 0.668, made.DISARMED_S + 0.003, 0.65),
        (0.845, 0.6875, made.DISARMED_S + 0.003, 0.845),  # the most that is learnt
        (0.65, 0.2, made.DISARMED_S + 2.9, 0.65),
        # no throttle is logged: what was saved at disarming, not what was set later
        (0.0, 0.668, made.DISARMED_S + 2.9, 0.668),
        (0.0, 0.668, made.DISARMED_S + 3.1, 0.39),
    ],
)
def test_the_hover_throttle_is_that_of_the_flight_not_that_of_the_boot(
    tmp_path: Path, hovering: float, saved: float, saved_s: float, hover: float
) -> None:
    def throttle(moment: made.Moment) -> float:
        moves = moment.climb_m_s or moment.speed_m_s
        return 0.0 if not hovering else 0.9 if moves else hovering

    found = _hover_throttle(tmp_path, throttle, saved, saved_s)
    assert found == pytest.approx(hover, abs=1e-4)


@pytest.mark.parametrize(("seconds", "hover"), [(2.0, 0.65), (1.8, 0.668)])
def test_two_seconds_of_hovering_tell_the_throttle(
    tmp_path: Path, seconds: float, hover: float
) -> None:
    def throttle(moment: made.Moment) -> float:
        return 0.65 if 33.95 < moment.time_s < 33.95 + seconds else 0.0

    found = _hover_throttle(tmp_path, throttle, 0.668, made.DISARMED_S)
    assert found == pytest.approx(hover, abs=1e-4)


def test_damage_in_the_middle_is_counted_and_left_out(tmp_path: Path) -> None:
    messages = copter_log().messages
    half = len(messages) // 2
    content = b"".join(messages[:half]) + b"\x55" * 500 + b"".join(messages[half:])
    [record] = _read(tmp_path, content)
    assert _codes(record) == ["R101"]
    assert "500 of" in record.findings[0].message
    assert record.duration_s == pytest.approx(50.0, abs=1e-6)


def test_memory_never_written_behind_the_log_is_no_damage(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_log().content() + b"\xff" * 4096)
    assert record.findings == ()


def test_impossible_values_are_left_out(tmp_path: Path) -> None:
    log = copter_log()
    half = len(log.messages) // 2
    log.add("POS", 30_050_000, 120.0, 9.0, 420.0, 20.0, 20.0)
    log.messages.insert(half, log.messages.pop())
    log.add("POS", 59_960_000, 47.0, 8.0, 1e30, 0.0, 0.0)
    [record] = _read(tmp_path, log.content())
    assert _codes(record) == ["R108", "R108"]
    assert "1 impossible value of POS.Alt left out, such as 1e+30" in record.findings[0].message
    assert "1 impossible value of POS.Lat left out, such as 120" in record.findings[1].message
    # Half of a place is none: its longitude goes with it.
    assert np.ptp(record.east_m) == pytest.approx(0.0, abs=0.01)


def test_copter_3_1_writes_hundredths_and_the_time_of_satellites(tmp_path: Path) -> None:
    log = DataflashWriter()
    log.define("EV", "B", "Id")
    log.define("MODE", "Mh", "Mode,ThrCrs")
    log.define("PARM", "Nf", "Name,Value")
    log.define(
        "GPS", "BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T"
    )
    log.define(
        "CTUN", "Ihhhffecchh", "TimeMS,ThrIn,AngBst,ThrOut,DAlt,Alt,BarAlt,DSAlt,SAlt,DCRt,CRt"
    )
    log.define(
        "NTUN", "Iffffffffff", "TimeMS,DPosX,DPosY,PosX,PosY,DVelX,DVelY,VelX,VelY,DAccX,DAccY"
    )
    log.define("CURR", "IhIhhhf", "TimeMS,ThrOut,ThrInt,Volt,Curr,Vcc,CurrTot")
    log.add("PARM", "WPNAV_SPEED", 500.0)
    log.add("MODE", 5, 400)
    for moment in made.moments():
        now, speed = round(moment.time_s * 1e3), moment.speed_m_s
        north_cm, climb_cm_s = moment.north_m * 100, moment.climb_m_s * 100
        for at_s, event in ((5.0, 10), (8.0, 28), (50.0, 18), (55.0, 11)):
            if moment.time_s == at_s:
                log.add("EV", event)
        log.add(
            *("GPS", 3, 3_880_600 + now, 1815, 10, 1.0, moment.latitude_deg, made.LONGITUDE_DEG),
            *(moment.height_m, 400.0 + moment.height_m, speed, 0.0, -moment.climb_m_s, now),
        )
        log.add(
            "CTUN", now, 0, 0, 0, moment.height_m, moment.height_m, 0, 0, 0, climb_cm_s, climb_cm_s
        )
        log.add("NTUN", now, north_cm, 0, north_cm, 0, speed * 100, 0, speed * 100, 0, 0, 0)
        log.add("CURR", now, 0, 0, 1600, moment.current_a * 100, 5000, 0.0)
    [record] = _read(tmp_path, log.content())
    # An event carries no time: it happened after the message before it, up to 0.1 s earlier.
    assert record.duration_s == pytest.approx(50.0, abs=0.1)
    assert record.voltage_v == pytest.approx(16.0)
    energy_j = np.trapezoid(record.power_w, record.time_s)
    assert energy_j == pytest.approx(made.ENERGY_J, abs=ONE_SAMPLE_J)
    assert np.max(record.climb_m_s) == pytest.approx(2.0)
    assert np.max(record.ground_speed_m_s) == pytest.approx(5.0)
    assert np.max(record.reference_speed_m_s) == pytest.approx(5.0)
    assert np.ptp(record.north_m) == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert set(record.mode.tolist()) == {"LOITER"}
    assert record.parameters == {"WPNAV_SPEED": 500.0}


def test_the_text_form_tells_the_same(tmp_path: Path) -> None:
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 129, 23, ARM, QB, TimeUS,ArmState",
        "FMT, 130, 31, POS, QLLff, TimeUS,Lat,Lng,Alt,RelHomeAlt",
        "FMT, 131, 31, CURR, Qff, TimeUS,Volt,Curr",
        "FMT, 132, 31, MODE, QMB, TimeUS,Mode,Rsn",
        "MODE, 0, AUTO, 1",
        "POS, 0, nonsense, 8.0, 400, 0",
    ]
    for moment in made.moments():
        now = round(moment.time_s * 1e6)
        if moment.time_s in {made.ARMED_S, made.DISARMED_S}:
            lines.append(f"ARM, {now}, {int(moment.time_s == made.ARMED_S)}")
        height = moment.height_m
        lines.append(f"POS, {now}, {moment.latitude_deg:.9f}, 8.0, {400 + height}, {height}")
        lines.append(f"CURR, {now}, 16.0, {moment.current_a}")
    path = tmp_path / "flight.log"
    path.write_text("\n".join(lines) + "\nPOS, 600", encoding="ascii")
    [record] = read_log(path)
    assert record.duration_s == pytest.approx(50.0, abs=1e-6)
    assert np.trapezoid(record.power_w, record.time_s) == pytest.approx(
        made.ENERGY_J, abs=ONE_SAMPLE_J
    )
    assert np.ptp(record.north_m) == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert set(record.mode.tolist()) == {"AUTO"}
    assert _codes(record) == ["R101"]
    assert "2 of" in record.findings[0].message


def test_landing_is_told_from_the_heights_where_it_is_not_logged(tmp_path: Path) -> None:
    log = DataflashWriter()
    log.define("ARM", "QB", "TimeUS,ArmState")
    log.define("POS", "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt")
    for moment in made.moments():
        now = round(moment.time_s * 1e6)
        if moment.time_s in {made.ARMED_S, made.DISARMED_S}:
            log.add("ARM", now, int(moment.time_s == made.ARMED_S))
        log.add("POS", now, 47.0, 8.0, 400.0 + moment.height_m, moment.height_m)
    [record] = _read(tmp_path, log.content())
    in_air = record.time_s[~record.is_landed]
    # Half a metre is passed a quarter of a second after take-off.
    assert in_air[0] == pytest.approx(3.3, abs=0.05)
    assert in_air[-1] == pytest.approx(44.7, abs=0.05)
    assert record.quantity("is_landed").found_in == "heights of POS.RelHomeAlt"


def test_a_mission_item_of_old_firmware_is_what_is_logged_after_the_list(tmp_path: Path) -> None:
    log = copter_log()
    log.messages = [message for message in log.messages if message[2] != _kind(log, "MISE")]
    log.add("CMD", 41_000_000, 4, 3, 21, 0.0, 0.0, 0.0, 0.0, 47.0, 8.0, 0.0, 3)
    begun = log.messages.pop()
    later = (at for at, message in enumerate(log.messages) if _time_us(message) > 41_000_000)
    log.messages.insert(next(later), begun)
    [record] = _read(tmp_path, log.content())
    assert len(record.mission_items) == 3
    assert record.mission_item[-1] == 3
    assert record.quantity("mission_item").found_in == "CMD.CNum"


def _time_us(message: bytes) -> int:
    """Return the time of a message; definitions have none."""
    return 0 if message[2] == 128 else int.from_bytes(message[3:11], "little")


def _kind(log: DataflashWriter, name: str) -> int:
    return log._types[name][0]


def test_untimed_logs_are_refused(tmp_path: Path) -> None:
    log = DataflashWriter()
    log.define("EV", "B", "Id")
    log.add("EV", 10)
    with pytest.raises(LogFileError, match="no message with a time"):
        _read(tmp_path, log.content())


def test_a_mission_sent_in_flight_is_told(tmp_path: Path) -> None:
    log = copter_log()
    half = len(log.messages) // 2
    at_us = round(0.5 * (made.BEGIN_S + made.END_S) * 1e6)
    for number, command in ((0, 16), (1, 22), (2, 21)):
        log.add(
            *("CMD", at_us, 3, number, command, 0.0, 0.0, 0.0, 0.0),
            *(made.LATITUDE_DEG, made.LONGITUDE_DEG, 30.0, 3),
        )
    sent, log.messages[-3:] = log.messages[-3:], []
    log.messages[half:half] = sent
    [record] = _read(tmp_path, log.content())
    assert _codes(record) == ["R206"]
    assert len(record.mission_items) == 2
