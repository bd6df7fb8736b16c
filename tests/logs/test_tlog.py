"""MAVLink telemetry logs: several vehicles, two clocks, and what links do to them."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import made_flight as made
import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from telemetry_writer import EPOCH_S, TelemetryWriter, copter_telemetry

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.logs.files import read_log
from planner.logs.record import LogFormat

if TYPE_CHECKING:
    from pathlib import Path

    from planner.logs.record import FlightRecord

STEP_J = 2 * 160.0 * 0.2
"""A sampled step of the power is a ramp of one sample, a fifth of a second, at either end. [J]"""


def _read(tmp_path: Path, content: bytes) -> tuple[FlightRecord, ...]:
    path = tmp_path / "flight.tlog"
    path.write_bytes(content)
    return read_log(path)


def test_what_was_flown_is_found(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_telemetry().content())
    assert record.log_format is LogFormat.TLOG
    assert record.duration_s == pytest.approx(50.0, abs=1e-5)
    assert np.trapezoid(record.power_w, record.time_s) == pytest.approx(made.ENERGY_J, abs=STEP_J)
    assert np.ptp(record.north_m) == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert np.max(record.height_above_home_m) == pytest.approx(made.HEIGHT_M)
    assert np.max(record.climb_m_s) == pytest.approx(made.CLIMB_M_S)
    assert record.home.altitude_amsl_m == pytest.approx(400.0, abs=1e-3)
    assert record.parameters == {"WPNAV_SPEED": 500.0}
    assert (record.autopilot, record.vehicle) == (Autopilot.ARDUPILOT, "quadrotor")
    assert set(record.mode.tolist()) == {"AUTO"}
    assert record.mission_item[[0, 49, 52]].tolist() == [1, 1, 2]
    assert record.time_s[~record.is_landed][0] == pytest.approx(3.0, abs=0.01)
    assert record.findings == ()


def test_a_climb_rate_that_is_positive_up_is_known_by_the_heights(tmp_path: Path) -> None:
    [down] = _read(tmp_path, copter_telemetry().content())
    [up] = _read(tmp_path, copter_telemetry(vz_is_up=True).content())
    np.testing.assert_array_equal(up.climb_m_s, down.climb_m_s)
    assert np.max(up.climb_m_s) == pytest.approx(made.CLIMB_M_S)
    found_in = {quantity.name: quantity.found_in for quantity in up.quantities}
    assert found_in["climb_m_s"] == "GLOBAL_POSITION_INT.vz, up as the heights say"


def test_the_vehicle_s_clock_counts_not_when_messages_arrive(tmp_path: Path) -> None:
    log = TelemetryWriter()
    for frame in copter_telemetry().frames:
        # The link holds everything of 20 to 23 s back.
        stamp_s = struct.unpack(">Q", frame[:8])[0] * 1e-6
        late_s = 23.0 if 20.0 <= stamp_s - EPOCH_S < 23.0 else stamp_s - EPOCH_S
        log.frames.append(struct.pack(">Q", round((EPOCH_S + late_s) * 1e6)) + frame[8:])
    [record] = _read(tmp_path, log.content())
    assert record.findings == ()
    assert np.all(np.isfinite(record.power_w))
    moving = record.time_s[record.velocity_north_m_s > 2.5]
    assert moving[0] == pytest.approx(17.0, abs=0.11)


def test_two_vehicles_of_one_link_are_two_records(tmp_path: Path) -> None:
    log = copter_telemetry(system=1)
    copter_telemetry(system=2, current_ca=2000, writer=log)
    first, second = _read(tmp_path, log.content())
    assert first.vehicle == "quadrotor, system 1"
    assert second.vehicle == "quadrotor, system 2"
    assert np.max(first.current_a) == pytest.approx(10.0)
    assert np.max(second.current_a) == pytest.approx(20.0)


def test_a_reboot_on_the_line_keeps_the_parameters(tmp_path: Path) -> None:
    log = copter_telemetry(boot_s=500.0)
    again = copter_telemetry(epoch_s=EPOCH_S + 100.0)
    log.frames += again.frames[1:]  # without the parameter
    first, second = _read(tmp_path, log.content())
    assert "R103" in [finding.code for finding in first.findings]
    assert second.begins_in_log_s == pytest.approx(5.0, abs=0.01)
    assert second.parameters == first.parameters


def test_an_unknown_current_is_no_current(tmp_path: Path) -> None:
    [record] = _read(tmp_path, copter_telemetry(current_ca=-1).content())
    assert not record.quantity("power_w").is_found
    assert "no current sensor" in record.quantity("current_a").remark


def test_frames_with_a_wrong_checksum_are_counted(tmp_path: Path) -> None:
    log = copter_telemetry()
    broken = bytearray(log.frames[100])
    broken[-1] ^= 0xFF
    log.frames[100] = bytes(broken)
    [record] = _read(tmp_path, log.content())
    assert [finding.code for finding in record.findings] == ["R101"]


def test_noise_between_frames_is_skipped(tmp_path: Path) -> None:
    frames = copter_telemetry().frames
    content = b"".join(frames[:500]) + b"\xfe\x03noise" * 60 + b"".join(frames[500:])
    [record] = _read(tmp_path, content)
    assert "R101" in [finding.code for finding in record.findings]
    assert record.duration_s == pytest.approx(50.0, abs=1e-5)


def test_version_1_frames_are_read(tmp_path: Path) -> None:
    log = TelemetryWriter()
    for moment in made.moments(5.0):
        now_ms = round(moment.time_s * 1e3)
        for message in (
            mavlink.MAVLink_global_position_int_message(
                now_ms, 470000000, 80000000, 0, round(moment.height_m * 1e3), 0, 0, 0, 0
            ),
            mavlink.MAVLink_heartbeat_message(13, 12, 128, 4 << 24 | 4 << 16, 4, 3),
        ):
            frame = message.pack(mavlink.MAVLink(None, 1, 1), force_mavlink1=True)
            stamp = struct.pack(">Q", round((EPOCH_S + moment.time_s) * 1e6))
            log.frames.append(stamp + bytes(frame))
    [record] = _read(tmp_path, log.content())
    assert (record.autopilot, record.vehicle) == (Autopilot.PX4, "hexarotor")
    assert set(record.mode.tolist()) == {"AUTO_MISSION"}
    assert np.max(record.height_above_home_m) == pytest.approx(20.0)


def test_the_mission_sent_is_the_mission_on_board(tmp_path: Path) -> None:
    log = copter_telemetry()
    stamp_s = EPOCH_S + 1.0
    upload = [mavlink.MAVLink_mission_count_message(1, 1, 3)]
    upload += [
        mavlink.MAVLink_mission_item_int_message(
            1, 1, number, 3, 16, 0, 1, 4.0, 0, 0, 0, 470010000, 80000000, 20.0
        )
        for number in range(3)
    ]
    fence = mavlink.MAVLink_mission_item_int_message(
        1, 1, 0, 3, 5001, 0, 1, 0, 0, 0, 0, 1, 1, 0.0, mission_type=1
    )
    frames = TelemetryWriter()
    for message in (*upload, fence):
        frames.add(stamp_s, message, system=255, component=190)
    log.frames[20:20] = frames.frames
    [record] = _read(tmp_path, log.content())
    assert [item.item for item in record.mission_items] == [1, 2]
    assert record.mission_items[0].latitude_deg == pytest.approx(47.001)
    assert record.mission_items[0].param1 == 4.0


@pytest.mark.parametrize("mav_autopilot", [12, 3])
def test_positions_told_to_the_controller_are_references_of_px4(
    mav_autopilot: int, tmp_path: Path
) -> None:
    log = copter_telemetry(mav_autopilot=mav_autopilot)
    for number, moment in enumerate(made.moments(5.0)):
        target = mavlink.MAVLink_position_target_global_int_message(
            round(moment.time_s * 1e3), 6, 0, 470010000, 80000000, 15.0, 3.0, 4.0, -1.0,
            0, 0, 0, 0, 0,
        )  # fmt: skip
        frames = TelemetryWriter()
        frames.add(EPOCH_S + moment.time_s, target)
        log.frames.insert(1 + number * 6, frames.frames[0])
    [record] = _read(tmp_path, log.content())
    if record.autopilot is Autopilot.ARDUPILOT:  # it tells the waypoint that it flies to
        assert not record.quantity("reference_height_m").is_found
        return
    assert record.reference_height_m == pytest.approx(15.0)
    # A thousandth of a degree of latitude at 47°: 111.176 m.
    assert record.reference_north_m == pytest.approx(111.176, abs=0.01)
    assert record.reference_speed_m_s == pytest.approx(5.0)
    assert record.reference_climb_m_s == pytest.approx(1.0)


def test_a_ground_station_alone_is_refused(tmp_path: Path) -> None:
    log = TelemetryWriter()
    for second in range(5):
        heartbeat = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)
        log.add(EPOCH_S + second, heartbeat, system=255, component=190)
    with pytest.raises(LogFileError, match="no autopilot is heard"):
        _read(tmp_path, log.content())
