"""Verification: what is wrong with a prediction is found, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from made_record import make_record

from planner.autopilot import Autopilot
from planner.errors import LogFileError, UsageError
from planner.flight.motion.kinematics import FlightState
from planner.identify.flown_mission import cut_record, flown_heading_deg, flown_parameters
from planner.identify.spread import compared_flight
from planner.identify.verification import KnownConditions, Verification, find_stops, verify_flight
from planner.logs.record import Boundary, FlightRecord, LoggedHome, LoggedItem
from planner.report.identification import verification_text
from planner.report.text import Medium
from planner.values import replace
from planner.vehicle.library import load_vehicle

ARTICLE = load_vehicle("falkowski-2023-quadrotor")
HOME = LoggedHome(
    latitude_deg=50.0, longitude_deg=20.0, altitude_amsl_m=200.0, found_in="made for the test"
)
CALM = KnownConditions()


def _item(number: int, command: int, north_deg: float, height_m: float) -> LoggedItem:
    return LoggedItem(
        item=number,
        command=command,
        frame=3,
        param1=10.0 if command == 16 else 0.0,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        latitude_deg=50.0 + north_deg,
        longitude_deg=20.0,
        altitude_m=height_m,
    )


MISSION = (
    _item(1, 22, 0.0, 100.0),
    _item(2, 16, 0.005, 100.0),
    _item(3, 16, 0.005, 200.0),
    _item(4, 16, 0.0, 100.0),
    _item(5, 21, 0.0, 0.0),
)
"""Up, 556 m north (0.005° of 111.2 km), up, back and down, with waits of 10 s."""


def _blank() -> FlightRecord:
    record = make_record(is_landed=np.zeros(20, np.bool_))
    return replace(
        record, home=HOME, mission_items=MISSION, parameters={}, mode=np.full(20, "AUTO_MISSION")
    )


def _flown_as_predicted(seed: int = 1) -> FlightRecord:
    """Return the model's own flight with noise, as a vehicle that keeps to the model flies it."""
    record = verify_flight(_blank(), ARTICLE, CALM).foreseen
    noise = np.random.default_rng(seed)
    size = record.time_s.size
    return replace(
        record,
        mode=np.full(size, "AUTO_MISSION"),
        power_w=record.power_w + noise.normal(0.0, 5.0, size),
        height_above_home_m=record.height_above_home_m + noise.normal(0.0, 0.05, size),
        ground_speed_m_s=np.abs(record.ground_speed_m_s + noise.normal(0.0, 0.02, size)),
    )


@pytest.fixture(scope="module")
def flown() -> FlightRecord:
    return _flown_as_predicted()


@pytest.fixture(scope="module")
def verified(flown: FlightRecord) -> Verification:
    return verify_flight(flown, ARTICLE, CALM)


def test_a_log_without_the_altitude_of_home_is_verified_and_says_so(flown: FlightRecord) -> None:
    found = verify_flight(
        replace(flown, home=replace(flown.home, altitude_amsl_m=None)), ARTICLE, CALM
    )
    assert "no altitude of home in the log" in " ".join(one.message for one in found.findings)
    assert "altitude of home unknown" in verification_text([found], medium=Medium())


def test_a_flight_that_keeps_to_the_model_has_no_errors(verified: Verification) -> None:
    assert verified.time_fraction == pytest.approx(0.0, abs=1e-12)
    # 5 W of noise over some 1600 samples: 0.13 W of 130 W, three times that.
    assert verified.energy_fraction == pytest.approx(0.0, abs=3e-3)
    assert verified.height_rms_m == pytest.approx(0.05, rel=0.1)
    assert verified.power_rms_w == pytest.approx(5.0, rel=0.15)
    assert verified.predicted.distance_m == pytest.approx(2 * 556.0, rel=2e-3)
    # The article's speed response swings 1.9 % of a stop of 32 m back: 4 x 0.6 m of 1112 m.
    assert verified.measured.distance_m == pytest.approx(verified.predicted.distance_m, rel=4e-3)


def test_every_state_fits_a_flight_that_keeps_to_the_model(verified: Verification) -> None:
    assert {row.state for row in verified.states} == set(FlightState)
    for row in verified.states:
        assert row.count == row.predicted_count
        assert row.energy_fraction == pytest.approx(0.0, abs=0.03)
        assert row.fit_percent is not None
        assert row.fit_percent > 95.0


def test_an_energy_five_percent_too_high_is_found_as_such(flown: FlightRecord) -> None:
    modest = replace(flown, power_w=flown.power_w / 1.05)
    verified = verify_flight(modest, ARTICLE, CALM)
    assert verified.energy_fraction == pytest.approx(0.05, abs=4e-3)
    assert verified.time_fraction == pytest.approx(0.0, abs=1e-12)


def _late(flown: FlightRecord) -> FlightRecord:
    """Return a flight that hovers for 20 s more before item 4."""
    hover = int(np.flatnonzero(flown.mission_item == 3)[-1])
    waited = np.concatenate(
        [np.arange(hover), np.full(200, hover), np.arange(hover, flown.time_s.size)]
    )
    columns = {name: column[waited] for name, column in flown.columns().items()}
    columns["time_s"] = np.arange(float(waited.size)) * 0.1
    return replace(flown, **columns, duration_s=flown.duration_s + 20.0)


def test_a_flight_that_takes_longer_is_found_as_such_and_stops_are_still_compared(
    flown: FlightRecord,
) -> None:
    late = _late(flown)
    verified = verify_flight(late, ARTICLE, CALM)
    predicted_s = verified.predicted.time_s
    assert verified.time_fraction == pytest.approx(predicted_s / (predicted_s + 20.0) - 1.0)
    lost = {part.part: part.time_s - part.predicted_time_s for part in verified.parts}
    assert lost == pytest.approx(
        {"first item": 0.0, "items between": 20.0, "last item": 0.0}, abs=1e-6
    )
    assert len(verified.stops) == 2
    for stop in verified.stops:
        assert stop.predicted_m == pytest.approx(stop.measured_m, rel=0.03)


def test_stops_are_those_of_the_article(verified: Verification) -> None:
    # 31.889 m from 9.947 m/s to rest (facts of the article); 98 % of the speed is 2 zeta/wn short of
    # its beginning by the delay of 0.6 s and some tenths, and the last half metre per second is left.
    assert [stop.item for stop in verified.stops] == [2, 4]
    for stop in verified.stops:
        assert stop.speed_m_s == pytest.approx(9.95, abs=0.05)
        assert 20.0 < stop.measured_m < 31.889
        # It swings past, 32.654 m from the command, of which 6.0 m are the delay and 3.3 m the
        # 0.334 s to 98 % of the speed (1 - wn² t²/2): a sample at 10 m/s is one metre.
        assert stop.measured_farthest_m == pytest.approx(23.4, abs=1.0)
        assert stop.predicted_farthest_m == pytest.approx(stop.measured_farthest_m, abs=0.1)


@pytest.mark.parametrize("form", ["stepped", "shaped"])
def test_a_perfect_model_has_no_error_in_any_state_whatever_was_logged(form: str) -> None:
    record = verify_flight(_blank(), ARTICLE, CALM).foreseen
    speed = record.ground_speed_m_s
    # the references that a step model and an autopilot log: ahead of the vehicle
    stepped = np.where(speed > 5.0, 9.947, 0.0)
    shaped = np.interp(record.time_s + 0.5, record.time_s, speed)
    flown = replace(
        record,
        mode=np.full(speed.size, "AUTO_MISSION"),
        reference_speed_m_s=stepped if form == "stepped" else shaped,
    )
    verified = verify_flight(flown, ARTICLE, CALM)
    for row in verified.states:
        assert row.count == row.predicted_count
        assert row.energy_fraction == pytest.approx(0.0, abs=1e-9)


def test_a_log_that_never_lands_is_not_cut_otherwise_than_its_prediction(
    flown: FlightRecord,
) -> None:
    airborne = replace(flown, is_landed=np.zeros(flown.time_s.size, np.bool_))
    for row in verify_flight(airborne, ARTICLE, CALM).states:
        assert row.count == row.predicted_count
        assert row.energy_fraction == pytest.approx(0.0, abs=0.03)


def test_a_gap_in_the_power_is_reported_and_bridged(flown: FlightRecord) -> None:
    power_w = flown.power_w.copy()
    power_w[300:500] = np.nan
    verified = verify_flight(replace(flown, power_w=power_w), ARTICLE, CALM)
    assert "R203" in {finding.code for finding in verified.findings}
    assert verified.energy_fraction == pytest.approx(0.0, abs=0.05)


def test_without_power_energies_are_unknown(flown: FlightRecord) -> None:
    silent = replace(flown, power_w=np.full(flown.time_s.size, np.nan))
    verified = verify_flight(silent, ARTICLE, CALM)
    assert verified.measured.energy_wh is None
    assert verified.energy_fraction is None
    assert verified.power_rms_w is None
    assert all(row.energy_fraction is None for row in verified.states)


def test_a_speed_known_for_most_of_a_flight_tells_its_states(flown: FlightRecord) -> None:
    """Telemetry with gaps: a tenth of the speeds is lost, and no airspeed is measured."""
    speed = flown.ground_speed_m_s.copy()
    speed[-speed.size // 10 :] = np.nan
    rows = verify_flight(replace(flown, ground_speed_m_s=speed), ARTICLE, CALM).states
    assert {FlightState.CRUISE, FlightState.CLIMB} <= {row.state for row in rows if row.count}


def test_a_log_without_a_mission_is_refused(flown: FlightRecord) -> None:
    with pytest.raises(LogFileError, match="--mission"):
        verify_flight(replace(flown, mission_items=()), ARTICLE, CALM)


def test_a_model_of_another_autopilot_is_refused(flown: FlightRecord) -> None:
    model = load_vehicle("px4-sih-quad")
    with pytest.raises(UsageError, match="ArduPilot"):
        verify_flight(replace(flown, autopilot=Autopilot.ARDUPILOT), model, CALM)


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT, None])
def test_a_model_that_only_assumes_its_autopilot_is_flown_by_that_of_the_log(
    flown: FlightRecord, autopilot: Autopilot | None
) -> None:
    model = load_vehicle("dji-f450")
    assert (model.reference, model.reference_assumed) == (Autopilot.ARDUPILOT, True)
    done = verify_flight(replace(flown, autopilot=autopilot), model, CALM)
    assert done.setup.flown_by is (autopilot or Autopilot.ARDUPILOT)
    stated = replace(model, reference=autopilot or Autopilot.ARDUPILOT, reference_assumed=False)
    same = verify_flight(replace(flown, autopilot=autopilot), stated, CALM)
    assert done.predicted == same.predicted


def test_a_pilot_who_takes_over_is_reported(flown: FlightRecord) -> None:
    mode = np.full(flown.time_s.size, "AUTO_MISSION", dtype="<U16")
    mode[600:900] = "POSCTL"
    verified = verify_flight(replace(flown, mode=mode), ARTICLE, CALM)
    [finding] = [finding for finding in verified.findings if finding.code == "R201"]
    assert "POSCTL" in finding.message
    assert "30.0 s from 60.0 s" in finding.message


def test_waiting_on_the_ground_for_the_mission_is_left_out(flown: FlightRecord) -> None:
    size = flown.time_s.size
    shifted = {
        name: np.concatenate([np.repeat(column[:1], 300), column])
        for name, column in flown.columns().items()
    }
    shifted["time_s"] = np.arange(size + 300.0) * 0.1
    shifted["mode"] = np.array(["STABILIZE"] * 300 + ["AUTO_MISSION"] * size)
    shifted["is_landed"][:300] = True
    shifted["is_landed"][300:302] = True
    waiting = replace(flown, **shifted, duration_s=flown.duration_s + 30.0)
    verified = verify_flight(waiting, ARTICLE, CALM)
    assert verified.cut_before_s == pytest.approx(30.0)
    assert verified.time_fraction == pytest.approx(0.0, abs=1e-9)
    assert "R205" in {finding.code for finding in verified.findings}


def test_motors_that_run_already_when_the_mission_begins_are_not_waited_for(
    flown: FlightRecord,
) -> None:
    """Armed in STABILIZE it lifts off 2 s sooner after it enters AUTO; its land detector has it airborne."""
    left = round(2.0 / flown.step_s)
    mode = np.full(flown.time_s.size, "AUTO_MISSION", dtype="<U16")
    mode[:left] = "STABILIZE"
    landed = flown.is_landed.copy()
    landed[:left] = False
    running = replace(flown, mode=mode, is_landed=landed)
    verified = verify_flight(running, ARTICLE, CALM)
    assert verified.cut_before_s == pytest.approx(2.0)
    assert verified.is_of_mission
    assert verified.predicted.time_s == pytest.approx(verified.measured.time_s, abs=0.11)
    assert verified.energy_fraction == pytest.approx(0.0, abs=1e-3)


def _broken_off(record: FlightRecord, item: int, more: int) -> FlightRecord:
    """Return a record whose log ends so many samples behind the one at which an item begins."""
    end = int(np.argmax(record.mission_item == item)) + 1 + more
    return replace(cut_record(record, 0, end), ends_with=Boundary.LOG)


@pytest.mark.parametrize(("item", "more"), [(4, 0), (4, 200), (5, 0), (5, 100)])
def test_what_a_broken_off_log_does_not_hold_is_no_error(
    flown: FlightRecord, item: int, more: int
) -> None:
    """As it begins an item, 20 s later, and 10 s into the landing: both up to where that item begins."""
    verified = verify_flight(_broken_off(flown, item, more), ARTICLE, CALM)
    begun_s = 0.1 * float(np.argmax(flown.mission_item == item))
    assert verified.breaks_off
    assert verified.is_of_mission
    assert verified.measured.time_s == pytest.approx(begun_s)
    assert verified.cut_after_s == pytest.approx(0.1 * more, abs=0.11)
    assert verified.time_fraction == pytest.approx(0.0, abs=1e-9)
    assert verified.energy_fraction == pytest.approx(0.0, abs=5e-3)
    # 556 m out, and back before the landing; wandering with the noise of the speed adds nothing here
    assert verified.predicted.distance_m == pytest.approx(556.0 * (item - 3), rel=0.05)
    [finding] = [finding for finding in verified.findings if finding.code == "R205"]
    assert f"compared up to where item {item} begins" in finding.message
    compared = compared_flight(verified)
    assert compared is not None
    assert compared.landing_s is None
    assert compared.time_error == pytest.approx(0.0, abs=1e-9)
    assert compared.energy_error == pytest.approx(0.0, abs=5e-3)


def test_what_a_broken_off_flight_lost_before_is_an_error_still(flown: FlightRecord) -> None:
    late = _late(flown)
    verified = verify_flight(_broken_off(late, 4, 100), ARTICLE, CALM)
    predicted_s = 0.1 * float(np.argmax(flown.mission_item == 4))
    assert verified.time_fraction == pytest.approx(predicted_s / (predicted_s + 20.0) - 1.0)
    compared = compared_flight(verified)
    assert compared is not None
    assert sum(flown_s - s for flown_s, s in compared.legs_s) == pytest.approx(20.0)


def test_a_log_that_ends_on_the_ground_or_disarmed_is_whole(flown: FlightRecord) -> None:
    """Logs that stop before disarming, behind the landing; and motors that are cut in the air."""
    landed = flown.is_landed.copy()
    landed[-1] = True
    in_air = replace(flown, is_landed=np.zeros(flown.time_s.size, np.bool_))
    for whole in (replace(flown, is_landed=landed, ends_with=Boundary.LOG), in_air):
        verified = verify_flight(whole, ARTICLE, CALM)
        assert not verified.breaks_off
        assert verified.measured.time_s == pytest.approx(flown.duration_s)
    assert verify_flight(replace(in_air, ends_with=Boundary.LOG), ARTICLE, CALM).breaks_off


def test_a_log_that_breaks_off_early_tells_nothing_of_times(flown: FlightRecord) -> None:
    """In the take-off no item is begun in the air; behind it one is, in the first half of the flight."""
    for more in (-1, 0, 200):
        verified = verify_flight(_broken_off(flown, 2, more), ARTICLE, CALM)
        assert not verified.is_of_mission
        assert compared_flight(verified) is None
        assert "R209" in {finding.code for finding in verified.findings}


def test_firmware_before_the_one_that_is_predicted_is_named(flown: FlightRecord) -> None:
    model = load_vehicle("arducopter-sitl-quad")
    old = replace(
        flown,
        autopilot=Autopilot.ARDUPILOT,
        firmware="APM:Copter V3.5.7 (b11c6af3)",
        parameters={"WPNAV_SPEED": 500.0},
    )
    new = replace(old, firmware="ArduCopter V4.6.0 (8264a9b4)")
    is_named = [
        "R208" in {finding.code for finding in verify_flight(one, model, CALM).findings}
        for one in (old, new)
    ]
    assert is_named == [True, False]


def test_loops_are_flown_as_the_firmware_in_the_log_counts_them(flown: FlightRecord) -> None:
    """An inner loop of twice 111 m is flown again in the second lap from ArduCopter 4.7 on, not before."""
    back = replace(_item(0, 177, 0.0, 0.0), param1=2.0, param2=1.0, frame=2)
    places = (
        _item(number, 16, north_deg, 20.0)
        for number, north_deg in ((2, 0.001), (3, 0.002), (5, 0.0))
    )
    first, second, last = (replace(place, param1=0.0) for place in places)
    items = (
        *(_item(1, 22, 0.0, 20.0), first, second, replace(back, item=4)),
        *(last, replace(back, item=6), _item(7, 21, 0.0, 0.0)),
    )
    record = replace(
        flown, autopilot=Autopilot.ARDUPILOT, mission_items=items, parameters={"WPNAV_SPEED": 500.0}
    )
    ways_m = [
        verify_flight(
            replace(record, firmware=f"ArduCopter V{version}.0 (8264a9b4)"),
            load_vehicle("arducopter-sitl-quad"),
            CALM,
        ).predicted.distance_m
        for version in ("4.6", "4.7")
    ]
    # out and back twice, 2 · 2 · 222 m, with the inner loop in the first lap or in both; each of up to eight
    # turns cuts its corner by some 3 m
    inner_m = 2 * 111.2
    assert ways_m == pytest.approx([4 * 222.4 + inner_m, 4 * 222.4 + 2 * inner_m], abs=8 * 4.0)


def test_an_item_that_is_not_logged_is_reported_and_keeps_the_numbers(flown: FlightRecord) -> None:
    gappy = replace(flown, mission_items=(MISSION[0], *MISSION[2:]))
    verified = verify_flight(gappy, ARTICLE, CALM)
    assert "R202" in {finding.code for finding in verified.findings}
    assert set(verified.foreseen.mission_item.tolist()) == {1, 3, 4, 5}


def test_wind_of_the_log_is_taken_as_its_mean_in_the_air(flown: FlightRecord) -> None:
    size = flown.time_s.size
    windy = replace(flown, wind_north_m_s=np.full(size, -3.0), wind_east_m_s=np.full(size, -4.0))
    wind = verify_flight(windy, ARTICLE, CALM).setup.wind
    assert wind.speed_m_s == pytest.approx(5.0)
    assert wind.from_deg == pytest.approx(np.degrees(np.arctan2(4.0, 3.0)))


def test_a_stop_is_measured_from_the_speed_held_to_standstill() -> None:
    # 10 m/s for 30 s, then 2 m/s² to rest: from 9.8 m/s to 0.5 m/s, (9.8² − 0.5²) / 4 = 23.95 m.
    time_s = np.arange(0.0, 60.0, 0.1)
    speed = np.clip(10.0 - 2.0 * (time_s - 30.0), 0.0, 10.0)
    record = make_record(is_landed=np.zeros(time_s.size, np.bool_), ground_speed_m_s=speed)
    [stop] = find_stops(record)
    assert stop.speed_m_s == pytest.approx(10.0, abs=1e-9)
    assert stop.start_s == pytest.approx(30.1, abs=0.11)
    assert stop.measured_m == pytest.approx(23.95, abs=1.2)  # a sample at 10 m/s


def test_an_item_that_a_condition_holds_back_is_carried_out_on_the_way() -> None:
    """1 m/s from 30 s of the 556 m leg on, at 10 m/s: 266 m; slowing down takes 35 m, 255 m are left."""
    vehicle = load_vehicle("arducopter-sitl-quad")
    wait = replace(_item(2, 112, 0.0, 0.0), frame=2, param1=30.0)
    slow = replace(_item(3, 178, 0.0, 0.0), frame=2, param1=1.0, param2=1.0)
    there = replace(_item(4, 16, 0.005, 100.0), param1=0.0)
    end = _item(5, 21, 0.005, 0.0)

    def predicted(*items: LoggedItem) -> Verification:
        numbered = tuple(replace(one, item=number) for number, one in enumerate(items, start=1))
        record = replace(_blank(), mission_items=numbered, autopilot=Autopilot.ARDUPILOT)
        return verify_flight(record, vehicle, CALM)

    plain, held, early = (
        predicted(_item(1, 22, 0.0, 100.0), *between, there, end)
        for between in ((), (wait, slow), (slow,))
    )
    assert "T115" in {one.code for one in held.findings}
    longer_s = held.predicted.time_s - plain.predicted.time_s
    assert longer_s == pytest.approx(255.0 - 29.0, abs=10.0)
    # From the beginning: 556 s for 63 s.
    assert early.predicted.time_s - plain.predicted.time_s == pytest.approx(556.0 - 63.0, abs=15.0)


@pytest.mark.parametrize(
    ("throttles", "times_heavier", "hover"),
    [
        # 4.5 kg, and 5.625 kg: 1.25 times as much of the thrust
        ((0.65, 0.8125), (1.0, 1.25), 0.65),
        ((0.8125,), (1.25,), 0.65),
        # a battery that falls from 25.2 to 22.5 V takes (25.2 / 22.5)² = 1.25 times the throttle
        ((0.4, 0.5), (1.0, 1.0), 0.5),
        ((0.4, 0.501), (1.0, 1.0), None),
    ],
)
def test_flights_agree_on_the_hover_throttle_of_the_mass_of_the_model(
    throttles: tuple[float, ...], times_heavier: tuple[float, ...], hover: float | None
) -> None:
    records = [replace(_blank(), parameters={"MOT_THST_HOVER": value}) for value in throttles]
    common, findings = flown_parameters(records, Autopilot.ARDUPILOT, times_heavier)
    assert dict(common).get("MOT_THST_HOVER") == (hover and pytest.approx(hover, abs=1e-6))
    assert [one.code for one in findings] == [] if hover else ["I104"]


def test_the_heading_before_the_take_off_is_that_it_is_armed_with() -> None:
    is_landed = np.array([True, True, True, False, False, True])
    yaw_deg = np.array([np.nan, 88.0, 90.0, 200.0, 270.0, 10.0])
    record = make_record(is_landed=is_landed, yaw_deg=yaw_deg)
    assert flown_heading_deg(record) == 90.0
    # Without a heading on the ground, as where a log begins in the air, none is known.
    assert flown_heading_deg(replace(record, is_landed=np.zeros(6, np.bool_))) is None
    assert flown_heading_deg(replace(record, yaw_deg=np.full(6, np.nan))) is None
