from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from simulated_vehicles import WIND, Bench, memory_line, named, out_and_back, request, texts

from planner.autopilot import Autopilot
from planner.link.wire import Codec
from planner.service.preflight import CheckResult, check_read
from planner.values import replace

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
METRE_E7 = 1e7 / 111_176.0
"""A metre northward in MAVLink's degrees."""


def _checked(autopilot: Autopilot) -> CheckResult:
    """Return what the check says of the flight that the vehicle flies."""
    asked = replace(request(autopilot).setup, autopilot=autopilot, with_trace=True)
    result = check_read(out_and_back, asked, file="made.plan")
    assert isinstance(result, CheckResult)
    return result


@BOTH
def test_it_says_that_it_is_simulated_before_anything_else(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    assert "SIMULATED" in texts(bench.send("HEARTBEAT", sender=77))[0]
    assert texts(bench.send("HEARTBEAT", sender=77)) == []


@BOTH
def test_it_flies_where_and_with_what_energy_the_check_says(autopilot: Autopilot) -> None:
    result = _checked(autopilot)
    trace = result.trace
    assert trace is not None
    speed_up = 10.0
    bench = Bench(autopilot, speed_up=speed_up)
    began_s = bench.now_s + 1.0
    bench.vehicle.arm_at(began_s)
    for time_s in np.linspace(0.0, result.totals.time_s, 12, endpoint=False)[1:]:
        bench.wait(began_s + time_s / speed_up - bench.now_s)
        place = bench.send("COMMAND_LONG", command=512, param1=33.0)[-1]
        # The vehicle's items have MAVLink's digits (1 cm); positions are told to 1e-7 degrees.
        assert place["lat"] == pytest.approx(
            np.interp(time_s, trace.time_s, trace.latitude_deg) * 1e7, abs=0.1 * METRE_E7
        )
        assert place["relative_alt"] == pytest.approx(
            np.interp(time_s, trace.time_s, trace.height_above_home_m) * 1e3, abs=30.0
        )
        battery = bench.send("COMMAND_LONG", command=512, param1=147.0)[-1]
        used_j = np.trapezoid(*_until(time_s, trace.power_w, trace.time_s))
        # Told in steps of 100 J; the last 0.1 s of the trace is cut off: some 40 J.
        assert battery["energy_consumed"] * 100.0 == pytest.approx(used_j, abs=150.0)
        left = _charge_left(*_until(time_s, trace.power_w, trace.time_s))
        assert battery["battery_remaining"] == pytest.approx(left * 100.0, abs=0.6)  # whole %


def _charge_left(power_w: np.ndarray, times_s: np.ndarray) -> float:
    """Return the state of charge, step by step: P = (U - R i) i, dQ = i dt."""
    pack = request(Autopilot.PX4).setup.flown_pack.battery
    assert pack is not None
    resistance_ohm = pack.internal_resistance_ohm
    assert resistance_ohm is not None
    assert pack.ocv_soc is not None
    assert pack.ocv_v is not None
    left = 1.0
    steps_s = np.diff(times_s)
    for mean_w, step_s in zip(0.5 * (power_w[1:] + power_w[:-1]), steps_s, strict=True):
        open_v = float(np.interp(left, pack.ocv_soc, pack.ocv_v))
        current_a = (open_v - math.sqrt(open_v**2 - 4.0 * resistance_ohm * mean_w)) / (
            2.0 * resistance_ohm
        )
        left -= current_a * step_s / 3600.0 / 8.0
    return left


def _until(
    time_s: float, power_w: np.ndarray, times_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    count = int(np.searchsorted(times_s, time_s))
    return power_w[:count], times_s[:count]


@BOTH
def test_the_flight_takes_the_predicted_time_and_ends_disarmed(autopilot: Autopilot) -> None:
    time_s = _checked(autopilot).totals.time_s
    bench = Bench(autopilot, speed_up=4.0)
    bench.vehicle.arm_at(bench.now_s)
    assert "SIMULATED: landed and disarmed" not in texts(bench.wait(time_s / 4.0 - 1.0))
    said = bench.wait(3.0)
    assert "SIMULATED: landed and disarmed" in texts(said)
    assert not bench.vehicle.is_flying
    heartbeat = named("HEARTBEAT", bench.wait(2.0))[-1]
    assert heartbeat["base_mode"] & 128 == 0


@BOTH
def test_the_items_are_told_as_they_are_flown(autopilot: Autopilot) -> None:
    bench = Bench(autopilot, speed_up=100.0)
    bench.vehicle.arm_at(bench.now_s)
    said = bench.wait(60.0)
    first = int(autopilot is ARDUPILOT)
    reached = [one["seq"] - first for one in named("MISSION_ITEM_REACHED", said)]
    assert reached == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("autopilot", "number", "waiting", "flying"),
    # PX4: main mode 4 (AUTO), sub mode 3 (LOITER) or 4 (MISSION); Copter: STABILIZE 0, AUTO 3.
    [(PX4, 12, 0x03040000, 0x04040000), (ARDUPILOT, 3, 0, 3)],
)
def test_its_heartbeat_is_the_autopilots(
    autopilot: Autopilot, number: int, waiting: int, flying: int
) -> None:
    bench = Bench(autopilot)
    on_ground = bench.wait_for("HEARTBEAT")[-1]
    assert (on_ground["autopilot"], on_ground["type"]) == (number, 2)
    assert on_ground["custom_mode"] == waiting
    assert on_ground["base_mode"] & 129 == 1
    bench.vehicle.arm_at(bench.now_s)
    in_air = bench.wait_for("HEARTBEAT")[-1]
    assert in_air["custom_mode"] == flying
    assert in_air["base_mode"] & 129 == 129


def test_ardupilot_sends_nothing_but_its_heartbeat_unless_it_is_asked_to() -> None:
    line = memory_line(ARDUPILOT)
    codec, names = Codec(0, 0), set()
    while line.now_s() < 5.0:
        for _, data in line.receive(1.0):
            names |= {one.name for one in codec.decode(data)}
    assert names == {"HEARTBEAT", "STATUSTEXT"}
    bench = Bench(ARDUPILOT)
    assert len(bench.wait_for("GLOBAL_POSITION_INT", 1.9)) == 8  # four a second
    bench.send("REQUEST_DATA_STREAM", req_message_rate=4, start_stop=0)
    assert {one.name for one in bench.wait(3.0)} == {"HEARTBEAT"}


def test_px4_streams_its_home_and_ardupilot_tells_it_when_asked() -> None:
    assert Bench(PX4).wait_for("HOME_POSITION")
    bench = Bench(ARDUPILOT)
    assert not bench.wait_for("HOME_POSITION")
    ack, home = bench.send("COMMAND_LONG", command=410, param1=0.0)
    assert (ack["command"], ack["result"]) == (410, 0)
    assert (home["latitude"], home["longitude"]) == (470_000_000, 80_000_000)
    assert home["altitude"] == 400_000


def test_the_wind_is_told_as_each_does() -> None:
    wind = Bench(ARDUPILOT).wait_for("WIND")[0]
    assert (wind["direction"], wind["speed"]) == (WIND.from_deg, WIND.speed_m_s)
    blowing = Bench(PX4).wait_for("WIND_COV")[0]
    # From the west at 4 m/s is 4 m/s to the east.
    assert blowing["wind_x"] == pytest.approx(0.0, abs=1e-12)
    assert blowing["wind_y"] == pytest.approx(4.0)


@BOTH
def test_the_fence_is_reported_healthy_as_long_as_there_is_one(autopilot: Autopilot) -> None:
    bench, fence = Bench(autopilot), 1 << 20  # MAV_SYS_STATUS_GEOFENCE
    for is_there in (True, False):
        status = bench.wait_for("SYS_STATUS")[-1]
        for field in ("present", "enabled", "health"):
            assert bool(status[f"onboard_control_sensors_{field}"] & fence) == is_there
        bench.send("MISSION_CLEAR_ALL", mission_type=1)


@BOTH
def test_an_interval_is_kept_and_a_stream_stops(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    ask: dict[str, Any] = {"command": 511, "param1": 242.0}
    (ack,) = bench.send("COMMAND_LONG", **ask, param2=500_000.0)
    assert ack["result"] == 0
    assert len(bench.wait_for("HOME_POSITION", 10.0)) in {20, 21}
    bench.send("COMMAND_LONG", **ask, param2=-1.0)
    assert bench.wait_for("HOME_POSITION", 10.0) == []


@BOTH
def test_the_version_names_the_firmware_and_the_vehicle(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    version = bench.send("COMMAND_LONG", command=512, param1=148.0)[-1]
    numbers = (1, 16) if autopilot is PX4 else (4, 6)
    assert (version["flight_sw_version"] >> 24, version["flight_sw_version"] >> 16 & 255) == numbers
    assert any(version["uid2"])
    assert bool(version["capabilities"] & 1 << 4) is (autopilot is PX4)  # bytewise parameters


@BOTH
@pytest.mark.parametrize("command", [400, 22, 176, 21, 179])
def test_a_command_that_would_do_something_is_denied_and_noted(
    autopilot: Autopilot, command: int
) -> None:
    # Arm, take off, set the mode, land, set home.
    bench = Bench(autopilot)
    (ack,) = bench.send("COMMAND_LONG", command=command, param1=1.0)
    assert (ack["command"], ack["result"]) == (command, 2)
    assert [act["command"] for act in bench.vehicle.acts] == [command]
    assert not bench.vehicle.is_flying


def test_what_is_meant_for_another_vehicle_is_not_answered() -> None:
    bench = Bench(PX4)
    assert bench.send("PARAM_REQUEST_LIST", target_system=2) == []


def test_a_new_mission_is_what_it_flies() -> None:
    bench = Bench(ARDUPILOT)
    whole = bench.vehicle.missions.lists
    before = bench.vehicle._prediction()
    bench.send("MISSION_WRITE_PARTIAL_LIST", start_index=3, end_index=3, mission_type=0)
    far = next(iter(whole.values()))[3]
    values: dict[str, Any] = {
        "frame": 3,
        "command": 16,
        "current": 0,
        "autocontinue": 1,
        "mission_type": 0,
    }
    values |= {"param1": 0.0, "param2": 0.0, "param3": 0.0, "param4": 0.0, "y": far.y, "z": 40.0}
    bench.send("MISSION_ITEM_INT", seq=3, x=far.x + round(500.0 * METRE_E7), **values)
    after = bench.vehicle._prediction()
    assert before is not None
    assert after is not None
    # 1000 m further at 10 m/s, without the hold of 2 s.
    assert after.duration_s - before.duration_s == pytest.approx(98.0, abs=3.0)
    assert math.isclose(before.state_at(-1.0).state_of_charge or 0.0, 1.0)
