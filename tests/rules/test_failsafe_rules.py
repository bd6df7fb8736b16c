"""What the vehicle decides itself: battery failsafes, arming, rally points, kinds of return."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_missions import METRES_PER_DEGREE_NORTH, item, mission, north, rtl, takeoff, waypoint
from rule_cases.case import PLAIN
from rule_cases.case import found as findings_of

from planner.autopilot import TARGETS, Autopilot
from planner.findings import Severity
from planner.flight.failsafe import (
    BatteryProfile,
    _mean_current_a,
    ardupilot_events,
    battery_profile,
    px4_charge,
    px4_events,
    px4_safe_return_s,
)
from planner.flight.pilot import make_pilot
from planner.flight.prediction import predict_flight
from planner.flight.returns.destination import make_destinations
from planner.flight.returns.path import make_returns
from planner.geo.fence import RallyPoint
from planner.mission.route.route import make_route
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.service.preflight import check
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import ParameterSet, ParameterValue
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.flight.returns.path import Returns
    from planner.mission.items import Mission, MissionItem
    from planner.service.preflight import CheckResult
    from planner.vehicle.model import VehicleModel

OWN = load_vehicle("arducopter-sitl-quad").battery
SURVEY_QUAD = replace(load_vehicle("arducopter-sitl-quad"), battery=None)
"""A label completes from the battery of a model: this one has none."""
FLOWN = mission(takeoff(50), waypoint(1000, 50), waypoint(0, 50), rtl())
LABEL = Battery(capacity_ah=8.0, nominal_voltage_v=22.2)
"""A label without curve: charge goes as energy does. 177.6 Wh."""


def checked(
    flown: Mission = FLOWN,
    *,
    autopilot: Autopilot = Autopilot.ARDUPILOT,
    vehicle: VehicleModel = SURVEY_QUAD,
    battery: Battery = LABEL,
    charge: float | Spread = 1.0,
    reserve: float = 0.0,
    version: tuple[int, int] | None = None,
    **values: float,
) -> CheckResult:
    given = ParameterSet(
        source="made.param",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=autopilot,
        version=version,
    )
    return check(
        flown,
        vehicle,
        battery=battery,
        charge=charge,
        reserve=reserve,
        autopilot=autopilot,
        parameters=given,
    )


def told(result: CheckResult, code: str) -> list[Finding]:
    return [finding for finding in result.findings if finding.code == code]


def ended(result: CheckResult) -> list[Finding]:
    """Return the failsafes that end a flight early: what lands later where it would is a warning."""
    return [one for one in told(result, "E103") if one.severity is Severity.ERROR]


def fraction_left(result: CheckResult, item: int) -> float:
    used = next(one.energy_used_wh for one in result.items if one.item == item)
    assert used is not None
    return 1.0 - used / LABEL.energy_wh


PX4 = {"autopilot": Autopilot.PX4}


def test_px4_returns_where_its_charge_is_critical() -> None:
    base = checked(autopilot=Autopilot.PX4)
    # Critical half-way between what is left at item 2 and at item 3: on the leg to item 3.
    critical = 0.5 * (fraction_left(base, 2) + fraction_left(base, 3))
    result = checked(
        autopilot=Autopilot.PX4, BAT_CRIT_THR=critical, BAT_EMERGEN_THR=0.01, COM_LOW_BAT_ACT=3
    )
    [event] = [one for one in told(result, "E103") if one.severity is Severity.ERROR]
    assert event.item == 3
    assert "the vehicle itself returns at" in event.message
    assert "m into the leg to item 3" in event.message
    assert "BAT_CRIT_THR" in event.message
    assert result.verdict == "no-go"


# 1 is deprecated and in no list of values; ``fromBatteryWarningActParam`` returns by it all the same.
@pytest.mark.parametrize(
    ("action", "does"), [(0, "warns"), (1, "returns"), (2, "lands where it is"), (3, "returns")]
)
def test_px4_does_as_its_action_says(action: int, does: str) -> None:
    result = checked(
        autopilot=Autopilot.PX4, BAT_CRIT_THR=0.9, BAT_LOW_THR=0.05, COM_LOW_BAT_ACT=action
    )
    assert any(f"the vehicle itself {does} at" in f.message for f in told(result, "E103"))
    assert result.verdict == ("go" if action == 0 else "no-go")


def test_the_circuit_breaker_of_the_supply_switches_px4s_battery_off() -> None:
    """``BatteryChecks::checkAndReport`` leaves before it looks at any battery."""
    acts: dict[str, Any] = {"BAT_CRIT_THR": 0.9, "COM_LOW_BAT_ACT": 3.0, "COM_ARM_BAT_MIN": 0.99}
    for breaker, codes in ((0.0, {"E103"}), (894281.0, set()), (894280.0, {"E103"})):
        result = checked(autopilot=Autopilot.PX4, CBRK_SUPPLY_CHK=breaker, **acts)
        assert {f.code for f in result.findings if f.severity is Severity.ERROR} == codes
    empty = checked(autopilot=Autopilot.PX4, charge=0.95, CBRK_SUPPLY_CHK=894281.0, **acts)
    assert not told(empty, "E114")


def test_a_failsafe_that_is_not_reached_is_not_told() -> None:
    assert not told(checked(autopilot=Autopilot.PX4, COM_LOW_BAT_ACT=3), "E103")
    assert not told(checked(BATT_LOW_MAH=100, BATT_FS_LOW_ACT=2, BATT_CAPACITY=8000), "E103")


def test_the_charge_that_is_critical_decides_at_its_boundary() -> None:
    # What is left where the return begins, item 3 done; a return in the return is none.
    base = checked(autopilot=Autopilot.PX4)
    left = fraction_left(base, 3)
    for slack, codes in ((-1e-4, 0), (1e-4, 1)):
        result = checked(
            autopilot=Autopilot.PX4,
            BAT_CRIT_THR=left + slack,
            BAT_LOW_THR=0.01,
            BAT_EMERGEN_THR=0.01,
            COM_LOW_BAT_ACT=3,
        )
        assert [f.severity for f in told(result, "E103")].count(Severity.ERROR) == codes


@pytest.mark.parametrize(
    ("action", "above", "sd", "severity"),
    [
        (2, 0.10, 0.0, Severity.ERROR),
        (2, 0.14, 0.0, None),
        (2, 0.20, 0.003, None),
        (2, 0.20, 0.05, Severity.ERROR),
        (3, 0.06, 0.0, Severity.WARNING),
        (3, 0.10, 0.0, None),
    ],
)
def test_a_failsafe_acts_in_flights_that_take_more_than_predicted(
    action: int, above: float, sd: float, severity: Severity | None
) -> None:
    """5 % of the energy are 11.6 % in one flight of a hundred, and 8.2 % in one of twenty, as --risk allows.

    By charges where the way home begins, where no return matters any more.  The flight takes 23 % of the
    charge, 20 % by then: a fifth of that is 4 %, and 0.3 % beside 5 % of 23 % are 2.8 % in one of a hundred.
    """
    vehicle = replace(SURVEY_QUAD, spread=None)
    plain = check(FLOWN, vehicle, battery=LABEL, autopilot=Autopilot.PX4)
    given = {
        "BAT_CRIT_THR": 1.0 - (1.0 + above) * (1.0 - fraction_left(plain, 3)),
        "BAT_LOW_THR": 0.01,
        "BAT_EMERGEN_THR": 0.005,
        "COM_LOW_BAT_ACT": float(action),
    }
    values = {name: ParameterValue(value) for name, value in given.items()}
    result = check(
        FLOWN,
        vehicle,
        battery=LABEL,
        charge=Spread(mean=1.0, sd=sd) if sd else 1.0,
        reserve=0.0,
        autopilot=Autopilot.PX4,
        parameters=ParameterSet(source="made.params", values=values, stack=Autopilot.PX4),
    )
    found = told(result, "E134")
    assert [f.severity for f in found] == [severity] * (severity is not None)
    assert all("more than predicted" in f.message for f in found)


@pytest.mark.parametrize(
    ("less_mah", "severity"), [(100.0, Severity.ERROR), (2000.0, Severity.WARNING)]
)
def test_a_return_at_risk_that_is_cut_off_is_no_return(less_mah: float, severity: Severity) -> None:
    """1 km home at 10 m/s and 370 W takes 10 Wh, 450 mAh: it lands in the field 100 mAh on, not 2,000."""
    away = mission(takeoff(50), waypoint(1000, 50), item(21, north(1000), 0.0))
    vehicle = replace(SURVEY_QUAD, spread=None)
    plain = check(away, vehicle, battery=LABEL)
    low_mah = 8000.0 * (1.0 - 1.03 * plain.totals.energy_wh / LABEL.energy_wh)
    values = {
        "BATT_CAPACITY": 8000.0,
        "BATT_LOW_MAH": low_mah,
        "BATT_FS_LOW_ACT": 2.0,
        "BATT_CRT_MAH": low_mah - less_mah,
        "BATT_FS_CRT_ACT": 1.0,
    }
    given = ParameterSet(
        source="made.param",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=Autopilot.ARDUPILOT,
    )
    result = check(away, vehicle, battery=LABEL, reserve=0.0, parameters=given)
    assert not [one for one in told(result, "E103") if one.severity is Severity.ERROR]
    [found] = told(result, "E134")
    assert found.severity is severity
    assert ("on that return lands where it is" in found.message) is (severity is Severity.ERROR)


@pytest.mark.parametrize(
    ("above", "risk", "severity"),
    [
        (0.06, 0.05, Severity.WARNING),
        (0.10, 0.05, None),
        (0.06, 0.15, None),
        (0.06, 1.0, None),
        (0.06, 0.005, Severity.WARNING),
    ],
)
@pytest.mark.parametrize("measures", [0, -1])
def test_a_limit_of_the_time_is_met_by_flights_that_last_longer_than_predicted(
    above: float, risk: float, severity: Severity | None, measures: int
) -> None:
    """5 % are 8.2 % in one flight of twenty, 5.2 % in three of twenty; it returns, whatever it measures."""
    away = mission(takeoff(50), waypoint(1000, 50), item(21, north(1000), 0.0))
    vehicle = replace(SURVEY_QUAD, spread=None)
    time_s = check(away, vehicle, battery=LABEL, autopilot=Autopilot.PX4).totals.time_s
    # a landing elsewhere, so that a return is one to the last
    values = {"COM_FLT_TIME_MAX": (1.0 + above) * time_s, "BAT1_SOURCE": float(measures)}
    result = check(
        away,
        vehicle,
        battery=LABEL,
        reserve=0.0,
        risk=risk,
        autopilot=Autopilot.PX4,
        parameters=ParameterSet(
            source="made.params",
            values={name: ParameterValue(value) for name, value in values.items()},
            stack=Autopilot.PX4,
        ),
    )
    assert not told(result, "E103")
    found = told(result, "E134")
    assert [one.severity for one in found] == [severity] * (severity is not None)
    assert all("longer than predicted" in one.message for one in found)


@pytest.mark.parametrize(
    ("charge", "codes"), [(0.27, ["E103"]), (0.31, ["E134"]), (0.34, []), (0.40, [])]
)
def test_px4s_own_estimate_is_asked_in_a_flight_that_takes_more(
    charge: float, codes: list[str]
) -> None:
    """PX4 wants 357 s 1 km away: at 14.5 A 1.44 Ah of 8, a fraction of 0.18 over the 0.12 used by then.

    8.2 % more of the current and of what is used make that 0.325.
    """
    values = {"COM_FLTT_LOW_ACT": 3.0, "BAT1_CAPACITY": 8000.0}
    values |= dict.fromkeys(("BAT_LOW_THR", "BAT_CRIT_THR", "BAT_EMERGEN_THR"), 0.01)
    result = check(
        FLOWN,
        replace(SURVEY_QUAD, spread=None),
        battery=LABEL,
        charge=charge,
        reserve=0.0,
        autopilot=Autopilot.PX4,
        parameters=ParameterSet(
            source="made.params",
            values={name: ParameterValue(value) for name, value in values.items()},
            stack=Autopilot.PX4,
        ),
    )
    found = [one for one in result.findings if "PX4's own estimate" in one.message]
    assert [one.code for one in found] == codes


def test_a_flight_that_takes_more_draws_more_from_less() -> None:
    """By charge and by voltage: 1.2 times the drop over the resistance, from a tenth less of the charge."""
    result = check(FLOWN, load_vehicle("arducopter-sitl-quad"))
    a = result.assessment
    assert a is not None
    assert a.pack is not None
    plain = battery_profile(a.returns, a.pack, a.discharge, charge=1.0)
    more = battery_profile(a.returns, a.pack, a.discharge, charge=1.0, times=1.2, less=0.1)
    assert more.fraction == pytest.approx(0.9 - 1.2 * (1.0 - plain.fraction), abs=1e-12)
    assert plain.used_ah is not None
    assert more.used_ah == pytest.approx(1.2 * plain.used_ah, abs=1e-9)
    drops_v = []
    for one in (plain, more):
        assert one.rest_v is not None
        assert one.loaded_v is not None
        drops_v.append(one.rest_v[1:] - one.loaded_v[1:])
    assert drops_v[1] == pytest.approx(1.2 * drops_v[0], abs=1e-9)


def late(
    lands_m: float | None = None,
    *,
    takeoff_m: float = 50.0,
    **values: Any,  # noqa: ANN401 - as `checked`
) -> CheckResult:
    """Return a check whose charge is low 20 mAh, some 4 s, before the landing; at home by default."""
    end = rtl() if lands_m is None else item(21, north(lands_m), 0.0)
    flown = mission(takeoff(takeoff_m), waypoint(1000, 50), end)
    flight_wh = checked(flown, **values).totals.energy_wh or 0.0
    left_mah = 8000.0 * (1.0 - flight_wh / LABEL.energy_wh)
    return checked(flown, BATT_CAPACITY=8000, BATT_LOW_MAH=left_mah + 20.0, **values)


@pytest.mark.parametrize(
    ("lands_m", "action", "does"),
    [
        (1000.0, 2, "returns"),
        (6.0, 2, "returns"),
        (4.0, 2, ""),
        (None, 2, ""),
        (1000.0, 1, ""),
        (None, 1, ""),
        (None, 3, ""),
        (1000.0, 3, "returns by its own track"),
        (4.0, 3, "returns by its own track"),
        (1.5, 3, ""),
        (None, 4, ""),
        (None, 5, "cuts its motors"),
        (None, 6, ""),
        (1000.0, 6, "returns"),  # the mission has no landing that it finds
        (None, 7, "brakes, or lands"),
    ],
)
def test_a_failsafe_in_the_last_landing_counts_where_it_breaks_it_off(
    lands_m: float | None, action: int, does: str
) -> None:
    """``Copter::handle_battery_failsafe``: only bit 3 of FS_OPTIONS lets a landing continue."""
    found = ended(late(lands_m, BATT_FS_LOW_ACT=action))
    assert bool(found) is bool(does)
    assert all(f"the vehicle itself {does} at" in one.message for one in found)
    assert not told(late(lands_m, BATT_FS_LOW_ACT=action, FS_OPTIONS=24), "E103")


RETURNS = [
    {"BATT_FS_LOW_ACT": 2.0},
    {"BATT_FS_LOW_ACT": 6.0},  # no landing is found: flown, 171 s for 133 s
    {
        "BATT_FS_LOW_ACT": 3.0,
        "SRTL_POINTS": 0.0,
    },  # SmartRTL is switched off: flown, 207 s for 148 s
]


@pytest.mark.parametrize("returns", RETURNS)
def test_a_return_of_the_mission_that_begins_anew_is_told_with_its_time(
    returns: dict[str, float],
) -> None:
    """Flown: low in the 15th second of the wait over home of 30 s: 33 s later down, 10 m higher.

    75 s before the end, 53 s of descent and the last of the wait: it has waited some of these 30 s.
    """
    flown = mission(takeoff(50), waypoint(1000, 50), rtl())
    own: dict[str, Any] = {"RTL_CLIMB_MIN": 1000.0, "RTL_LOIT_TIME": 30_000.0}
    own |= {"RTL_CONE_SLOPE": 0.0, "BATT_CAPACITY": 8000.0}
    landing_mah = 8000.0 * _left(checked(flown, **own)) + 1000.0 * 353.0 * 75.0 / 3600.0 / 22.2
    own |= {"BATT_LOW_MAH": landing_mah, **returns}
    [found] = told(checked(flown, **own), "E103")
    assert found.severity is Severity.WARNING
    [later_s] = re.findall(r"it lands ([\d.]+) s later", found.message)
    assert 5.0 < float(later_s) < 30.0


@pytest.mark.parametrize("before_end_s", [8.0, 15.0, 60.0])
def test_px4_goes_on_in_the_mission_s_return(before_end_s: float) -> None:
    """In AUTO_RTL it only warns: ``FailsafeBase::getSelectedAction``."""
    flown = mission(takeoff(50), waypoint(1000, 50), rtl())
    end_s = checked(flown, autopilot=Autopilot.PX4).totals.time_s
    limited = checked(flown, autopilot=Autopilot.PX4, COM_FLT_TIME_MAX=end_s - before_end_s)
    assert not told(limited, "E103")


@pytest.mark.parametrize(("cut_mah", "acts"), [(30.0, True), (-400.0, False)])
def test_the_next_failsafe_may_cut_the_motors_on_smartrtl_s_track(
    cut_mah: float, *, acts: bool
) -> None:
    """Flown: SmartRTL 8 m up in the landing, critical 14 s later on its climb: motors cut 32 m above home."""
    result = late(
        BATT_FS_LOW_ACT=3, BATT_CRT_MAH=8000.0 * _left(late()) - 30.0 + cut_mah, BATT_FS_CRT_ACT=5
    )
    assert any("on that return cuts its motors" in one.message for one in ended(result)) is acts


def test_smartrtl_of_a_model_without_an_autopilot_goes_up_its_track_by_the_parameters() -> None:
    vehicle = load_vehicle("dji-matrice-100")
    flown = mission(takeoff(50), waypoint(300, 50), rtl())

    def limited(**values: float) -> CheckResult:
        parameters = {name: ParameterValue(value) for name, value in values.items()}
        given = ParameterSet(source="made.param", values=parameters, stack=Autopilot.ARDUPILOT)
        return check(flown, vehicle, battery=LABEL, reserve=0.0, parameters=given)

    left_mah = 8000.0 * _left(limited())
    low = {"BATT_LOW_MAH": left_mah + 150.0, "BATT_CAPACITY": 8000.0, "BATT_FS_LOW_ACT": 3.0}
    [found] = told(limited(BATT_MONITOR=4.0, **low), "E103")
    assert "it lands up to" in found.message


def test_smartrtl_goes_up_to_the_top_of_all_that_climbs_over_home() -> None:
    """Flown: take-off to 10 m, a waypoint over home at 60 m, event 8 m up: up to 60 m, 54 s later down.

    From 8 m to 50 m at 2.5 m/s, to 10 m at 1.5 m/s, down at 0.5 m/s, less the 16 s of landing: 48 s.
    """
    flown = mission(takeoff(10), waypoint(0, 50), waypoint(600, 50), rtl())
    flight_wh = checked(flown).totals.energy_wh or 0.0
    left_mah = 8000.0 * (1.0 - flight_wh / LABEL.energy_wh) + 80.0
    low = {"BATT_LOW_MAH": left_mah, "BATT_FS_LOW_ACT": 3.0, "BATT_CAPACITY": 8000.0}
    [found] = told(checked(flown, **low), "E103")  # type: ignore[arg-type]  # by name
    [later_s] = re.findall(r"lands up to ([\d.]+) s later", found.message)
    assert 40.0 < float(later_s) < 58.0


@pytest.mark.parametrize(("at_item", "acts"), [(2, True), (4, False), (5, False)])
def test_a_landing_that_is_flown_already_is_flown_on(at_item: int, *, acts: bool) -> None:
    """DO_LAND_START or RTL.  Flown five times behind the DO_LAND_START: as planned, to 0.3 s."""
    legs = (waypoint(600, 30), waypoint(300, 30))
    flown = mission(takeoff(30), waypoint(300, 30), LAND_START, *legs, rtl())
    assert bool(ended(to_its_landing(flown, at_item))) is acts


def test_a_take_off_ends_a_landing_sequence() -> None:
    """Flown: a delivery behind whose second take-off it jumps back to the first landing, 270 s for 168 s."""
    there = (waypoint(300, 30), LAND_START, waypoint(350, 30), item(21, north(350), 0.0))
    flown = mission(takeoff(30), *there, takeoff(30), waypoint(600, 30), waypoint(300, 30), rtl())
    assert not ended(to_its_landing(flown, 4))
    assert ended(to_its_landing(flown, 7))


LAND_START = item(189, frame=2)


def to_its_landing(flown: Mission, at_item: int) -> CheckResult:
    """Return a check whose charge is low just before an item, of a vehicle that then goes to its landing."""
    again = {"MIS_OPTIONS": 4.0, "BATT_CAPACITY": 8000.0}
    plain = checked(flown, **again)  # type: ignore[arg-type]  # by name
    low = {"BATT_LOW_MAH": 8000.0 * fraction_left(plain, at_item) + 5.0, "BATT_FS_LOW_ACT": 6.0}
    return checked(flown, **again, **low)  # type: ignore[arg-type]  # by name


@pytest.mark.parametrize("action", [3, 4])
@pytest.mark.parametrize(("takeoff_m", "acts"), [(1.0, True), (4.0, False)])
def test_smartrtl_leads_back_through_the_flight_from_above_its_take_off(
    action: int, takeoff_m: float, *, acts: bool
) -> None:
    """4 s at 0.5 m/s are 2 m.  Flown from 40 m over home after a take-off to 10 m: 816 m, all the way."""
    assert bool(ended(late(takeoff_m=takeoff_m, BATT_FS_LOW_ACT=action))) is acts


@pytest.mark.parametrize("action", [3, 4])
@pytest.mark.parametrize(
    ("margin_wh", "severity"), [(3.0, Severity.ERROR), (12.0, Severity.WARNING)]
)
def test_smartrtl_over_home_may_go_up_its_track_to_the_top_of_the_take_off(
    margin_wh: float, severity: Severity, action: int
) -> None:
    """50 m up at 2.5 m/s and 458 W and down at 1.5 m/s and 302 W, the last 10 m at 0.5 m/s, take 7 Wh.

    Flown: event 4.6 m up after a take-off to 60 m: 66 s later down; 3.6 m up after one to 30 m: 37 s.
    """
    flight_wh = late(takeoff_m=50.0).totals.energy_wh or 0.0
    reserve = 1.0 - (flight_wh + margin_wh) / LABEL.energy_wh
    [found] = told(late(takeoff_m=50.0, reserve=reserve, BATT_FS_LOW_ACT=action), "E103")
    assert found.severity is severity
    said = "below the reserve" if severity is Severity.ERROR else "it lands up to"
    assert said in found.message


@pytest.mark.parametrize("lands_m", [None, 0.0])
@pytest.mark.parametrize(
    ("cone_slope", "margin_wh", "acts"), [(0, 9.0, True), (0, 14.0, False), (3, 9.0, False)]
)
def test_a_return_from_the_last_metres_may_climb_for_more_than_the_battery_holds(
    lands_m: float | None, cone_slope: int, margin_wh: float, *, acts: bool
) -> None:
    """100 m up at 2.5 m/s and 458 W and down at 1.5 m/s and 302 W, the last 10 m at 0.5 m/s and a hover's
    353 W, take 12 Wh; less 4 s of landing that are not flown, 0.4 Wh, and by the ways up to speed."""
    own = {"RTL_ALT": 10000.0, "RTL_CONE_SLOPE": float(cone_slope)}
    flight_wh = late(lands_m, **own).totals.energy_wh or 0.0
    reserve = 1.0 - (flight_wh + margin_wh) / LABEL.energy_wh
    found = ended(late(lands_m, reserve=reserve, BATT_FS_LOW_ACT=2, **own))
    assert bool(found) is acts
    assert all("that return ends" in one.message for one in found)
    assert not told(late(lands_m, reserve=reserve, BATT_FS_LOW_ACT=2, FS_OPTIONS=24, **own), "E103")


@pytest.mark.parametrize(("action", "acts"), [(2, False), (3, True), (4, True), (6, False)])
def test_a_failsafe_on_the_last_way_home_counts_where_it_flies_another(
    action: int,
    acts: bool,  # noqa: FBT001 - a table of cases
) -> None:
    flown = mission(takeoff(50), waypoint(1000, 50), rtl())
    left_mah = 8000.0 * fraction_left(checked(flown), 2)
    low_mah = left_mah - 100.0
    result = checked(flown, BATT_CAPACITY=8000, BATT_LOW_MAH=low_mah, BATT_FS_LOW_ACT=action)
    assert bool(ended(result)) is acts


@pytest.mark.parametrize("returns", RETURNS)
@pytest.mark.parametrize(
    ("climb_m", "critical_mah", "acts"), [(30, 240.0, True), (30, 150.0, False), (0, 130.0, False)]
)
def test_the_next_failsafe_may_end_a_return_of_the_mission_begun_anew(
    climb_m: float, critical_mah: float, returns: dict[str, float], *, acts: bool
) -> None:
    """Planned, the critical charge is met on the descent: flown with 30 m, down 27 m short of home.

    From 80 m that takes 47 s at 302 W and 20 s at 353 W, 265 mAh (from 50 m 190 mAh); 30 m of climb once more
    80 mAh.
    """
    flown = mission(takeoff(50), waypoint(1000, 50), rtl())
    own: dict[str, Any] = {"RTL_CLIMB_MIN": 100.0 * climb_m, "BATT_CAPACITY": 8000.0}
    base = checked(flown, **own)
    values = own | {
        "BATT_LOW_MAH": 8000.0 * fraction_left(base, 2) - 100.0,
        "BATT_CRT_MAH": 8000.0 * fraction_left(base, 3) + critical_mah,
        "BATT_FS_CRT_ACT": 1.0,
        **returns,
    }
    found = ended(checked(flown, **values))
    assert bool(found) is acts
    assert all("and on that return lands where it is" in one.message for one in found)


@pytest.mark.parametrize(("behind", "codes"), [(-0.01, ["E103"]), (0.004, ["E134"]), (0.03, [])])
def test_the_next_failsafe_may_cut_the_motors_on_a_return_begun_anew_in_a_flight_that_takes_more(
    behind: float, codes: list[str]
) -> None:
    """Low only behind the planned end: flown 0.4 % behind it, motors cut 14 m up.

    A flight of a hundred takes some 0.9 % more, by the 0.26 % of the model and those of its states.
    """
    flown = mission(takeoff(50), waypoint(1000, 50), rtl())
    own: dict[str, Any] = {"RTL_CLIMB_MIN": 3000.0, "RTL_CONE_SLOPE": 0.0, "BATT_CAPACITY": 8000.0}
    low_mah = 8000.0 * (1.0 - (1.0 + behind) * (1.0 - _left(checked(flown, **own))))
    own |= {"BATT_LOW_MAH": low_mah, "BATT_FS_LOW_ACT": 2.0}
    result = checked(flown, **own, BATT_CRT_MAH=low_mah - 60.0, BATT_FS_CRT_ACT=5.0)
    found = [*told(result, "E103"), *told(result, "E134")]
    assert [one.code for one in found if "cuts its motors" in one.message] == codes


@pytest.mark.parametrize(("before_landing_s", "acts"), [(20.0, False), (45.0, True)])
def test_a_landing_where_it_waits_over_home_is_the_one_that_was_planned(
    before_landing_s: float, *, acts: bool
) -> None:
    """Flown in the wait of 30 s: down 0.1 m from home, 12 s sooner than planned.

    The charge for 20 s of the wait, at the 353 W of a hover; in 45 s it was still on its way.
    """
    flown = mission(takeoff(50), waypoint(1000, 50), rtl())
    own: dict[str, Any] = {"RTL_LOIT_TIME": 30_000.0, "BATT_CAPACITY": 8000.0}
    plain = checked(flown, **own)
    landing = (row for row in plain.segments if row.state.value in {"descend", "land"})
    waits_mah = (sum(row.energy_wh for row in landing) + 353.0 * before_landing_s / 3600.0) / 0.0222
    critical: dict[str, Any] = {
        "BATT_CRT_MAH": 8000.0 * _left(plain) + waits_mah,
        "BATT_FS_CRT_ACT": 1.0,
    }
    assert bool(ended(checked(flown, **own, **critical))) is acts


@pytest.mark.parametrize(
    ("critical_action", "slope", "acts"), [(5, 0, True), (5, 3, False), (1, 0, False)]
)
def test_the_next_failsafe_may_cut_the_motors_on_a_return_begun_in_the_landing(
    critical_action: int, slope: int, *, acts: bool
) -> None:
    """Flown: low at 96 s of a landing at home, with RTL_CONE_SLOPE 0 up to 60 m, disarmed there at 137 s.

    Up to 60 m at 2.5 m/s and 458 W from 2 m take 137 mAh.
    """
    result = late(
        0.0,
        RTL_ALT=6000.0,
        RTL_CONE_SLOPE=float(slope),
        BATT_FS_LOW_ACT=2,
        BATT_CRT_MAH=8000.0 * _left(late(0.0)) - 60.0,
        BATT_FS_CRT_ACT=critical_action,
    )
    found = ended(result)
    assert bool(found) is acts
    assert all("and on that return cuts its motors" in one.message for one in found)


def _left(result: CheckResult) -> float:
    return 1.0 - (result.totals.energy_wh or 0.0) / LABEL.energy_wh


FAR_LAST = mission(
    takeoff(50), waypoint(200, 50, hold_s=600.0), waypoint(700, 50), item(21, north(700), 0.0)
)
"""Ten minutes 200 m from home, and 500 m farther to land."""


@pytest.mark.parametrize(("apart_mah", "severity"), [(180.0, Severity.ERROR), (400.0, None)])
def test_flights_between_the_worst_and_the_predicted_one_are_looked_at(
    apart_mah: float, severity: Severity | None
) -> None:
    """A flight of a hundred takes 11.6 % more, 9.7 Wh: it is low where it waits, and 1.8 Wh from home.

    500 m and the landing take 8.8 Wh: one that takes 1 % more is low at the end, and 70 s of 320 W from home,
    6.2 Wh; 180 mAh are 4 Wh, 400 mAh 8.9 Wh.
    """
    vehicle = replace(SURVEY_QUAD, spread=None)
    low_mah = 8000.0 * _left(check(FAR_LAST, vehicle, battery=LABEL)) - 22.0
    given = {"BATT_LOW_MAH": low_mah, "BATT_CRT_MAH": low_mah - apart_mah}
    given |= {"BATT_FS_LOW_ACT": 2.0, "BATT_FS_CRT_ACT": 1.0, "BATT_CAPACITY": 8000.0}
    values = {name: ParameterValue(value) for name, value in given.items()}
    parameters = ParameterSet(source="made.param", values=values, stack=Autopilot.ARDUPILOT)
    result = check(FAR_LAST, vehicle, battery=LABEL, parameters=parameters)
    assert not told(result, "E103")
    lands = [one.severity for one in told(result, "E134") if "on that return lands" in one.message]
    assert lands == ([] if severity is None else [severity])


@pytest.mark.parametrize(("apart_v", "acts"), [(0.05, True), (1.0, False)])
def test_voltages_count_on_the_return_that_a_failsafe_begins(apart_v: float, *, acts: bool) -> None:
    """4 % of the charge are some 0.15 V of six cells in the middle of their curve."""
    vehicle = replace(load_vehicle("arducopter-sitl-quad"), spread=None)
    plain = check(FAR_LAST, vehicle)
    assert plain.battery is not None
    assert plain.battery.lowest_voltage_v is not None
    low_v = plain.battery.lowest_voltage_v - 0.05
    given = {"BATT_LOW_VOLT": low_v, "BATT_CRT_VOLT": low_v - apart_v}
    given |= {"BATT_FS_LOW_ACT": 2.0, "BATT_FS_CRT_ACT": 1.0}
    values = {name: ParameterValue(value) for name, value in given.items()}
    parameters = ParameterSet(source="made.param", values=values, stack=Autopilot.ARDUPILOT)
    found = told(check(FAR_LAST, vehicle, parameters=parameters), "E134")
    assert any("on that return lands" in one.message for one in found) == acts


@pytest.mark.parametrize(("charge", "severity"), [(0.8, Severity.ERROR), (1.0, Severity.WARNING)])
def test_smartrtl_needs_as_much_as_has_been_flown(charge: float, severity: Severity) -> None:
    """Low at 47 % used: from 80 % there are 33 % left, from full 53 %."""
    vehicle = replace(SURVEY_QUAD, spread=None)
    left = _left(check(FAR_LAST, vehicle, battery=LABEL))
    given = {"BATT_LOW_MAH": 8000.0 * left - 22.0, "BATT_FS_LOW_ACT": 3.0, "BATT_CAPACITY": 8000.0}
    values = {name: ParameterValue(value) for name, value in given.items()}
    parameters = ParameterSet(source="made.param", values=values, stack=Autopilot.ARDUPILOT)
    result = check(FAR_LAST, vehicle, battery=LABEL, charge=charge, parameters=parameters)
    assert [one.severity for one in told(result, "E134")] == [severity]


@pytest.mark.parametrize(("lands_m", "acts"), [(1000.0, True), (0.0, False)])
def test_the_greatest_time_of_a_px4_flight_ends_a_landing_too(
    lands_m: float,
    acts: bool,  # noqa: FBT001 - a table of cases
) -> None:
    flown = mission(takeoff(50), waypoint(1000, 50), item(21, north(lands_m), 0.0))
    end_s = checked(flown, autopilot=Autopilot.PX4).totals.time_s
    found = ended(checked(flown, autopilot=Autopilot.PX4, COM_FLT_TIME_MAX=end_s - 10.0))
    assert bool(found) is acts


@pytest.mark.parametrize(("sd_kg", "acts"), [(0.01, False), (0.5, True)])
def test_an_uncertain_load_meets_a_failsafe_at_two_deviations(sd_kg: float, *, acts: bool) -> None:
    """1 kg more on 3.5 kg take 46 % more of a hover; 100 mAh less are left than would be low."""
    low_mah = 8000.0 * fraction_left(checked(), 3) - 100.0
    values = {"BATT_CAPACITY": 8000.0, "BATT_LOW_MAH": low_mah, "BATT_FS_LOW_ACT": 2.0}
    result = check(
        FLOWN,
        SURVEY_QUAD,
        battery=LABEL,
        payload_kg=Spread(mean=0.0, sd=sd_kg),
        reserve=0.0,
        parameters=ParameterSet(
            source="made.param",
            values={name: ParameterValue(value) for name, value in values.items()},
            stack=Autopilot.ARDUPILOT,
        ),
    )
    assert (Severity.ERROR in {one.severity for one in told(result, "E103")}) is acts


@pytest.mark.parametrize(("sd_m_s", "acts"), [(0.1, False), (4.5, True)])
def test_an_uncertain_wind_meets_a_failsafe_at_two_deviations(sd_m_s: float, *, acts: bool) -> None:
    """In calm air 150 mAh are left above what is low; 9 m/s of wind take more."""
    low_mah = 8000.0 * fraction_left(checked(), 3) - 150.0
    result = check(
        FLOWN,
        SURVEY_QUAD,
        battery=LABEL,
        wind=Wind(speed_m_s=0.0, from_deg=0.0, speed_sd_m_s=sd_m_s),
        reserve=0.0,
        parameters=ParameterSet(
            source="made.param",
            values={
                "BATT_CAPACITY": ParameterValue(8000.0),
                "BATT_LOW_MAH": ParameterValue(low_mah),
                "BATT_FS_LOW_ACT": ParameterValue(2.0),
            },
            stack=Autopilot.ARDUPILOT,
        ),
    )
    assert (Severity.ERROR in {one.severity for one in told(result, "E103")}) is acts


def test_px4_counts_from_the_capacity_it_was_told() -> None:
    # Told half the charge it counts down twice as fast.
    told_half = checked(
        autopilot=Autopilot.PX4, BAT1_CAPACITY=4000, BAT_LOW_THR=0.9, COM_LOW_BAT_ACT=0
    )
    assert told(told_half, "E103")[0].severity is Severity.INFO
    whole = checked(autopilot=Autopilot.PX4, BAT1_CAPACITY=8000, BAT_LOW_THR=0.9)
    assert told(told_half, "E103")[0].item == 2
    assert (told(whole, "E103")[0].item or 0) >= 2


def test_px4_ends_a_flight_at_its_longest_time() -> None:
    flight_s = checked(autopilot=Autopilot.PX4).totals.time_s
    assert told(checked(autopilot=Autopilot.PX4, COM_FLT_TIME_MAX=60), "E103")
    assert not told(checked(autopilot=Autopilot.PX4, COM_FLT_TIME_MAX=flight_s + 1.0), "E103")
    # FlightTimeChecks: above 0 alone is a limit.
    assert not told(checked(autopilot=Autopilot.PX4, COM_FLT_TIME_MAX=0), "E103")


def _px4_returns(flown: Mission = FLOWN) -> Returns:
    parameters = Px4Parameters()
    pilot = make_pilot(Setup(SURVEY_QUAD), parameters)
    route = make_route(flown)
    flight = predict_flight(route, Setup(SURVEY_QUAD), pilot)
    destinations = make_destinations(flown, route, parameters)
    return make_returns(route, flight, pilot, destinations)


def test_px4_reckons_a_return_by_its_own_formula() -> None:
    # RTL_TIME_FACTOR and RTL_TIME_MARGIN: 1.1 t + 100 s.  1000 m away at 50 m: home at 5 m/s, down at
    # 1.5 m/s.
    returns = _px4_returns()
    far_s = returns.start_s[np.searchsorted(returns.segment_stage, 2)]
    found = px4_safe_return_s(returns, np.array([far_s]), Px4Parameters())
    assert found[0] == pytest.approx(1.1 * (1000.0 / 5.0 + 50.0 / 1.5) + 100.0, abs=2.0)


def test_px4_returns_when_its_estimate_says_the_charge_will_not_last() -> None:
    # 1000 m away PX4 wants 357 s.  Flying there takes 22 Wh, 0.12 of the charge; at about 14.5 A a
    # share of 0.23 lasts 457 s, one of 0.15 298 s.
    def reckoned(charge: float, capacity_mah: float) -> list[str]:
        result = checked(
            autopilot=Autopilot.PX4,
            charge=charge,
            COM_FLTT_LOW_ACT=3,
            BAT_LOW_THR=0.01,
            BAT_CRIT_THR=0.01,
            BAT_EMERGEN_THR=0.01,
            BAT1_CAPACITY=capacity_mah,
        )
        return [f.message for f in told(result, "E103") if "PX4's own estimate" in f.message]

    assert not reckoned(0.35, 8000.0)
    assert len(reckoned(0.27, 8000.0)) == 1
    assert not reckoned(0.27, -1.0), "without BAT1_CAPACITY PX4 reckons nothing"


@pytest.mark.parametrize(
    ("version", "severity"),
    [
        # commander_params.c of 1.15 and 1.16: COM_FLTT_LOW_ACT 3; 0 since PX4 #25267 (July 2025, 1.17).
        ((1, 15), Severity.ERROR),
        ((1, 16), Severity.ERROR),
        ((1, 17), None),
        (None, Severity.WARNING),
    ],
)
def test_px4_returns_by_default_before_1_17(
    version: tuple[int, int] | None, severity: Severity | None
) -> None:
    def reckoned(charge: float, given: Mapping[str, Any] = {}) -> list[Severity]:
        result = checked(
            autopilot=Autopilot.PX4,
            charge=charge,
            version=version,
            BAT_LOW_THR=0.01,
            BAT_CRIT_THR=0.01,
            BAT_EMERGEN_THR=0.01,
            BAT1_CAPACITY=8000.0,
            **given,
        )
        return [f.severity for f in told(result, "E103") if "PX4's own estimate" in f.message]

    assert reckoned(0.27) == ([] if severity is None else [severity])
    assert not reckoned(0.35), "the charge lasts, as in the test above"
    assert not reckoned(0.27, {"COM_FLTT_LOW_ACT": 0})


# 0.6 V over 30 milliohm are 20 A: four cells of 3.8 V show 3.65 V each, between 3.6 and 4.05 V 11 % of the
# charge; 5 milliohm a cell add 0.1 V, 7.5 the whole drop of 0.15 V; -1 has it estimated.
@pytest.mark.parametrize(
    ("cell_ohm", "seen"), [(0.0, 0.1111), (0.005, 0.3333), (0.0075, 0.4444), (-1.0, 0.4444)]
)
def test_px4_takes_the_drop_over_its_own_resistance_out_of_the_voltage(
    cell_ohm: float, seen: float
) -> None:
    profile = BatteryProfile(
        time_s=np.array([0.0, 60.0]),
        used_ah=None,
        fraction=np.array([1.0, 0.9]),
        rest_v=np.array([16.2, 15.2]),
        loaded_v=np.array([16.2, 14.6]),
        resistance_ohm=0.03,
        is_curve_assumed=False,
        later_s=np.zeros(2),
    )
    pack = Battery(capacity_ah=5.0, nominal_voltage_v=14.8, cells_in_series=4)
    parameters = Px4Parameters(battery_cell_resistance_ohm=cell_ohm)
    assert px4_charge(profile, pack, parameters)[-1] == pytest.approx(seen, abs=1e-4)


def test_px4_reckons_its_return_every_two_seconds() -> None:
    times_s = []
    for capacity_mah in (7000.0, 7300.0, 7700.0):
        result = checked(
            autopilot=Autopilot.PX4, charge=0.27, COM_FLTT_LOW_ACT=3, BAT1_CAPACITY=capacity_mah
        )
        a = result.assessment
        assert a is not None
        assert a.pack is not None
        assert isinstance(a.parameters, Px4Parameters)
        profile = battery_profile(a.returns, a.pack, a.discharge, charge=a.charge)
        [event] = [
            one
            for one in px4_events(a.returns, profile, a.pack, a.parameters)
            if one.parameter == "COM_FLTT_LOW_ACT"
        ]
        duration_s = float(a.flight.motion.segments.duration_s[event.segment])
        times_s.append(float(a.returns.start_s[event.segment]) + event.fraction * duration_s)
    assert len(set(times_s)) == 3
    assert np.remainder(np.array(times_s) + 1e-6, 2.0) == pytest.approx(1e-6, abs=2e-6)


def test_ardupilot_returns_where_the_charge_left_of_its_capacity_is_low() -> None:
    base = checked()
    used_ah = [8.0 * (1.0 - fraction_left(base, n)) for n in (1, 2)]
    low_mah = 8000.0 - 1000.0 * sum(used_ah) / 2.0
    result = checked(BATT_CAPACITY=8000, BATT_LOW_MAH=low_mah, BATT_FS_LOW_ACT=2)
    [event] = told(result, "E103")
    assert event.item == 2
    assert event.severity is Severity.ERROR
    assert "BATT_LOW_MAH" in event.message
    only_warns = checked(BATT_CAPACITY=8000, BATT_LOW_MAH=low_mah, BATT_FS_LOW_ACT=0)
    assert [f.severity for f in told(only_warns, "E103")] == [Severity.INFO]


@pytest.mark.parametrize("which", ["LOW", "CRT"])
@pytest.mark.parametrize(
    ("action", "does"),
    [  # BATT_FS_LOW_ACT and BATT_FS_CRT_ACT as ArduPilot lists them for Copter
        (0, "warns"),
        (1, "lands where it is"),
        (2, "returns"),
        (3, "returns by its own track"),  # SmartRTL or RTL
        (4, "returns by its own track, or lands"),  # SmartRTL or land
        (5, "cuts its motors"),
        (6, "returns"),  # DO_LAND_START or RTL: there is none
        (7, "brakes, or lands"),
    ],
)
def test_ardupilot_does_as_its_action_says(which: str, action: int, does: str) -> None:
    given: dict[str, Any] = {f"BATT_{which}_MAH": 7700.0, f"BATT_FS_{which}_ACT": action}
    found = told(checked(BATT_CAPACITY=8000, **given), "E103")
    assert [one.severity for one in found] == [Severity.ERROR if action else Severity.INFO]
    assert found[0].message.startswith(f"the vehicle itself {does} at ")


@pytest.mark.parametrize("return_type", [1.0, 3.0])  # flown: both alike
@pytest.mark.parametrize(
    ("highest_m", "before_end_s", "later_s"),
    [
        (50.0, 18.0, (40.0, 60.0)),  # flown: up to 49 m, and down 51 s later than planned
        (
            22.0,
            18.0,
            (12.0, 25.0),
        ),  # 5 s of hold, and from about 10 m up to 22 m and down: 4 s and 8 s
        (50.0, 1.0, None),  # on the ground, where it waits for 2 s to disarm
    ],
)
def test_a_return_that_breaks_off_the_last_landing_is_told_with_its_time(
    highest_m: float, before_end_s: float, later_s: tuple[float, float] | None, return_type: float
) -> None:
    flown = mission(takeoff(22), waypoint(60, 22), item(21, north(60), 0.0))
    own: dict[str, Any] = {"RTL_TYPE": return_type, "RTL_RETURN_ALT": highest_m}
    end_s = checked(flown, autopilot=Autopilot.PX4, **own).totals.time_s
    own["COM_FLT_TIME_MAX"] = end_s - before_end_s
    found = told(checked(flown, autopilot=Autopilot.PX4, **own), "E103")
    assert [one.severity for one in found] == ([] if later_s is None else [Severity.WARNING])
    if later_s is not None:
        [said] = re.findall(r"it lands ([\d.]+) s later than predicted", found[0].message)
        assert later_s[0] < float(said) < later_s[1]


@pytest.mark.parametrize("lands", [item(21, north(60), 0.0), item(21, north(0), 0.0), rtl()])
@pytest.mark.parametrize(
    ("hold_s", "later_s"), [(None, 5.0), (25.0, 25.0), (3.1, 3.1), (3.0, None), (0.0, None)]
)
def test_px4_holds_before_it_lands_where_it_lands_already(
    lands: MissionItem, hold_s: float | None, later_s: float | None
) -> None:
    """COM_FAIL_ACT_T 5 s.  Flown: 6.3 s later in a landing 72 m from home, 5.8 s in that of a return."""
    own = {} if hold_s is None else {"COM_FAIL_ACT_T": hold_s}
    found = told(_critical(mission(takeoff(20), waypoint(60, 20), lands), 10.0, **own), "E103")
    found = [one for one in found if "BAT_CRIT_THR" in one.message]
    if later_s is None:
        assert not found
        return
    [one] = found
    assert one.severity is Severity.WARNING
    assert one.message.startswith("the vehicle itself lands where it is at ")
    [said] = re.findall(r"; it lands ([\d.]+) s later than predicted$", one.message)
    assert float(said) == later_s


@pytest.mark.parametrize(("before_end_s", "acts"), [(10.0, True), (32.0, False)])
def test_px4_waits_no_longer_over_home_once_it_is_to_land(
    before_end_s: float, *, acts: bool
) -> None:
    """Flown: critical early in a wait of 15 s, down 6.7 s sooner; it lands from 10 m in some 16 s."""
    waits: dict[str, Any] = {"RTL_LAND_DELAY": 30.0}
    result = _critical(mission(takeoff(20), waypoint(60, 20), rtl()), before_end_s, **waits)
    found = [one for one in told(result, "E103") if "BAT_CRIT_THR" in one.message]
    assert ["s later than predicted" in one.message for one in found] == [True] * acts


def _critical(flown: Mission, before_end_s: float, **own: float) -> CheckResult:
    """Return a check of PX4 that lands at a charge it has so long before its end, by the power of a hover."""
    left = _left(checked(flown, **PX4, **own))  # type: ignore[arg-type]  # by name
    critical = left + 353.0 * before_end_s / 3600.0 / LABEL.energy_wh
    by_charge = {"COM_LOW_BAT_ACT": 2.0, "BAT_CRIT_THR": critical, "BAT_EMERGEN_THR": 0.01}
    return checked(flown, **PX4, **own, **by_charge)  # type: ignore[arg-type]  # by name


@pytest.mark.parametrize(("hold_s", "acts"), [(0.0, False), (25.0, True)])
def test_px4s_hold_before_a_return_brings_the_next_failsafe_nearer(
    hold_s: float, *, acts: bool
) -> None:
    """1 km home at 5 m/s and 350 W takes 19.5 Wh, 11 % of the charge, with 25 s of hold 12.4 %."""
    away = mission(takeoff(50), waypoint(1000, 50), item(21, north(1000), 0.0))
    vehicle = replace(SURVEY_QUAD, spread=None)
    flight_wh = check(away, vehicle, battery=LABEL, autopilot=Autopilot.PX4).totals.energy_wh
    critical = 1.0 - 1.03 * flight_wh / LABEL.energy_wh
    values = {
        "COM_FAIL_ACT_T": hold_s,
        "COM_LOW_BAT_ACT": 3.0,
        "BAT_CRIT_THR": critical,
        "BAT_EMERGEN_THR": critical - 0.117,
    }
    given = ParameterSet(
        source="made.params",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=Autopilot.PX4,
    )
    own: dict[str, Any] = {"autopilot": Autopilot.PX4, "parameters": given}
    result = check(away, vehicle, battery=LABEL, reserve=0.0, **own)
    [found] = told(result, "E134")
    assert ("on that return lands where it is" in found.message) is acts


def test_px4s_hold_before_a_return_counts_in_its_energy() -> None:
    """25 s at 353 W of a hover take 2.45 Wh."""
    away = mission(takeoff(50), waypoint(1000, 50), item(21, north(1000), 0.0))
    end_s = checked(away, autopilot=Autopilot.PX4).totals.time_s
    limit: dict[str, Any] = {"COM_FLT_TIME_MAX": end_s - 60.0, "reserve": 0.9}
    short_wh = []
    for hold_s in (0.0, 25.0):
        found = ended(checked(away, **PX4, **limit, COM_FAIL_ACT_T=hold_s))  # type: ignore[arg-type]  # by name
        short_wh += re.findall(r"that return ends ([\d.]+) Wh below the reserve", found[0].message)
    none, held = map(float, short_wh)
    assert held - none == pytest.approx(2.45, abs=0.11)


@pytest.mark.parametrize(
    ("low", "critical", "acts"),
    [
        (0, 1, True),
        (0, 3, True),
        (0, 7, False),  # flown: "Battery 1 is critical", and the mission goes on
        (0, 6, False),
        (7, 7, True),  # and anything behind it
        (7, 3, True),
        (2, 1, True),
        (2, 4, False),
        (1, 2, False),
    ],
)
def test_what_is_critical_acts_by_its_priority_behind_what_was_low(
    low: int, critical: int, *, acts: bool
) -> None:
    # AP_BattMonitor::check_failsafes: terminate, land, return, SmartRTL or land, SmartRTL, none.
    pack = Battery(capacity_ah=8.0, nominal_voltage_v=22.2)
    profile = battery_profile(_px4_returns(), pack, None, charge=1.0)
    used_ah = np.linspace(0.0, 4.0, len(profile.time_s))
    parameters = ArduPilotParameters(
        battery_capacity_ah=8.0,
        battery_low_ah=7.0,
        battery_critical_ah=6.0,
        battery_low_action=low,
        battery_critical_action=critical,
    )
    events = ardupilot_events(replace(profile, used_ah=used_ah), parameters, has_landing=False)
    names = ["BATT_LOW_MAH", "BATT_CRT_MAH"]
    assert [one.parameter for one in events] == (names if acts else names[:1])


@pytest.mark.parametrize("critical_ah", [7.0, 6.0])
def test_what_is_low_does_nothing_behind_what_was_critical(critical_ah: float) -> None:
    # AP_BattMonitor::check_failsafes passes over a type that is no graver than the one before.
    profile = battery_profile(
        _px4_returns(), Battery(capacity_ah=8.0, nominal_voltage_v=22.2), None, charge=1.0
    )
    used_ah = np.linspace(0.0, 4.0, len(profile.time_s))
    parameters = ArduPilotParameters(
        battery_capacity_ah=8.0,
        battery_low_ah=6.0,
        battery_critical_ah=critical_ah,  # or both at once
        battery_low_action=2,
        battery_critical_action=0,
    )
    [event] = ardupilot_events(replace(profile, used_ah=used_ah), parameters, has_landing=False)
    assert event.parameter == "BATT_CRT_MAH"


def test_ardupilot_counts_from_full_whatever_the_charge() -> None:
    # Half full at the start: the autopilot counts down from BATT_CAPACITY all the same.
    full = checked(BATT_CAPACITY=8000, BATT_LOW_MAH=7000, BATT_FS_LOW_ACT=2)
    half = checked(charge=0.5, BATT_CAPACITY=8000, BATT_LOW_MAH=7000, BATT_FS_LOW_ACT=2)
    assert [f.message for f in told(full, "E103")] == [f.message for f in told(half, "E103")]


def test_ardupilot_acts_on_a_voltage_only_after_its_timer() -> None:
    returns = _px4_returns()
    curve = Battery(
        capacity_ah=8.0, ocv_soc=(0.0, 1.0), ocv_v=(18.0, 25.0), internal_resistance_ohm=0.0
    )
    profile = battery_profile(returns, curve, None, charge=1.0)
    count = len(profile.time_s)
    # 22 V at every end but one of 20 V, straight in between: below 21 V for half of two stretches.
    voltage = np.full(count, 22.0)
    voltage[count // 2] = 20.0
    time_s = np.arange(0.0, 10.0 * count, 10.0)
    profile = replace(profile, time_s=time_s, loaded_v=voltage, rest_v=voltage)
    for timer_s, events in ((9.9, 1), (10.1, 0)):
        parameters = ArduPilotParameters(
            battery_low_v=21.0, battery_low_timer_s=timer_s, battery_low_action=2
        )
        assert len(list(ardupilot_events(profile, parameters, has_landing=False))) == events
    assert not list(
        ardupilot_events(profile, ArduPilotParameters(battery_low_v=19.9), has_landing=False)
    )


def test_a_battery_too_empty_to_arm_is_refused() -> None:
    assert told(checked(autopilot=Autopilot.PX4, charge=0.5, COM_ARM_BAT_MIN=0.51), "E114")
    assert not told(checked(autopilot=Autopilot.PX4, charge=0.5, COM_ARM_BAT_MIN=0.5), "E114")
    # -1: the critical one; the default since 1.16, before it 0: that one alone.
    for version in (None, (1, 16), (1, 15)):
        result = checked(autopilot=Autopilot.PX4, charge=0.05, version=version, BAT_CRIT_THR=0.07)
        assert told(result, "E114")
    assert told(checked(BATT_CAPACITY=3000, BATT_ARM_MAH=3001), "E114")
    assert not told(checked(BATT_CAPACITY=3000, BATT_ARM_MAH=3000), "E114")
    # AP_BattMonitor_Backend::arming_checks asks for the failsafes' thresholds whatever they do.
    assert told(checked(BATT_CAPACITY=3000, BATT_LOW_MAH=3001), "E114")
    assert not told(checked(BATT_CAPACITY=3000, BATT_LOW_MAH=3000), "E114")
    assert not told(checked(BATT_CAPACITY=3000, BATT_LOW_MAH=3001, BATT_MONITOR=3), "E114")


def test_ardupilot_does_not_arm_below_its_voltage() -> None:
    own = OWN
    assert own is not None
    # 25.2 V full, 22.597 V at half of the charge, by the model's own curve.
    for volts, refused in ((22.5, False), (22.7, True)):
        for charge in (0.5, Spread(mean=0.6, sd=0.05)):  # two deviations off: half of it
            result = checked(battery=own, charge=charge, BATT_ARM_VOLT=volts)
            assert bool(told(result, "E114")) is refused


def _rally(north_m: float) -> RallyPoint:
    latitude_deg = 47.0 + north_m / METRES_PER_DEGREE_NORTH
    return RallyPoint(latitude_deg=latitude_deg, longitude_deg=8.0, height_above_home_m=0.0)


def test_a_rally_point_nobody_goes_to_is_told() -> None:
    beyond = replace(FLOWN, rally=(_rally(-500.0),))
    [finding] = told(checked(beyond), "E106")
    assert finding.severity is Severity.INFO
    assert not told(checked(replace(FLOWN, rally=(_rally(900.0),))), "E106")


def test_a_rally_point_out_of_reach_is_a_warning() -> None:
    # 60 km at 10 m/s and 320 W are 533 Wh; the battery holds 177.6.
    far = replace(FLOWN, rally=(_rally(60_000.0),))
    [finding] = told(checked(far), "E106")
    assert finding.severity is Severity.WARNING
    assert "cannot be reached" in finding.message


def test_a_rally_point_has_to_be_reached_above_the_reserve() -> None:
    # What is kept back is what is short, watt-hour for watt-hour.
    near = replace(FLOWN, rally=(_rally(900.0),))
    short_wh = []
    for reserve in (0.95, 0.97, 0.99):
        [finding] = told(checked(near, reserve=reserve), "E106")
        short_wh.append(float(re.findall(r"\(([\d.]+) Wh short\)", finding.message)[0]))
    assert np.diff(short_wh) == pytest.approx(
        [0.02 * 177.6] * 2, abs=0.11
    )  # one decimal is printed
    assert not told(checked(near, reserve=0.9), "E106")


@pytest.mark.parametrize(("kind", "told_of"), [(0, 0), (2, 0), (3, 0), (4, 0), (6, 1), (7, 1)])
def test_a_return_by_a_rule_that_is_not_known_is_told_once(kind: int, told_of: int) -> None:
    result = checked(autopilot=Autopilot.PX4, RTL_TYPE=kind)
    said = [f.code for f in result.findings if "RTL_TYPE" in f.message]
    assert said == ["T110"] * told_of


@pytest.mark.parametrize(
    ("throttle", "charge", "payload_kg", "fires"),
    [
        # Full 25.2 V; it ends near 0.3 of the charge, at 17 A about 20.7 V: 1.48 times as much.
        (0.36, 1.0, 0.0, False),
        (0.45, 0.4, 0.0, False),
        (0.52, 0.4, 0.0, True),
        (0.36, 0.4, 3.5, True),  # twice the mass, twice the thrust
    ],
)
def test_a_hover_that_takes_most_of_the_thrust_is_told(
    throttle: float, charge: float, payload_kg: float, *, fires: bool
) -> None:
    own = OWN
    given = ParameterSet(
        source="made.param",
        values={"MOT_THST_HOVER": ParameterValue(throttle)},
        stack=Autopilot.ARDUPILOT,
    )
    result = check(
        mission(takeoff(50), waypoint(100, 50), rtl()),
        SURVEY_QUAD,
        battery=own,
        charge=charge,
        payload_kg=payload_kg,
        parameters=given,
    )
    assert bool(told(result, "E116")) is fires


@pytest.mark.parametrize(("throttle", "fires"), [(0.53, False), (0.55, True)])
def test_the_thrust_of_a_hover_grows_with_the_square_of_the_voltage_lost(
    throttle: float, *, fires: bool
) -> None:
    # Half full at 22 V of 25.1 V, and so large that it stays there: (25.1 / 22)² = 1.3017.
    large = Battery(
        capacity_ah=50_000.0,
        internal_resistance_ohm=0.0,
        ocv_soc=(0.0, 0.5, 1.0),
        ocv_v=(21.0, 22.0, 25.1),
        cutoff_voltage_v=15.0,
    )
    found = told(checked(battery=large, charge=0.5, MOT_THST_HOVER=throttle), "E116")
    assert [one.message.split(" of the thrust")[0] for one in found] == [
        "hovering takes 72 %"
    ] * fires


@pytest.mark.parametrize(
    ("throttle", "severity"),
    [(0.69, None), (0.71, Severity.WARNING), (0.79, Severity.WARNING), (0.81, Severity.ERROR)],
)
def test_without_a_curve_a_hover_is_judged_with_a_full_battery(
    throttle: float, severity: Severity | None
) -> None:
    found = told(checked(battery=LABEL, MOT_THST_HOVER=throttle), "E116")
    assert [one.severity for one in found] == [severity] * (severity is not None)


def test_a_throttle_nobody_measured_tells_nothing() -> None:
    bare = replace(SURVEY_QUAD, parameters=())
    assert not told(check(FLOWN, bare, battery=LABEL, payload_kg=3.0), "E116")


@pytest.mark.parametrize(("throttle", "fires"), [(0.34999999, False), (0.36, True)])
def test_a_default_that_a_file_repeats_says_nothing_of_a_sagging_battery(
    throttle: float, *, fires: bool
) -> None:
    # 25.1 V full, 17.5 V near its end: (25.1 / 17.5)² = 2.06 times 0.36 is 0.74; 0.35 is the default.  A
    # throttle that flights of the model hovered with, 0.36, counts whatever the file repeats.
    sagging = Battery(
        capacity_ah=50_000.0,
        internal_resistance_ohm=0.0,
        ocv_soc=(0.0, 0.5, 1.0),
        ocv_v=(17.0, 17.5, 25.1),
        cutoff_voltage_v=15.0,
    )
    others = [one for one in SURVEY_QUAD.parameters if one[0] != "MOT_THST_HOVER"]
    never_flown = replace(SURVEY_QUAD, parameters=tuple(others))
    for vehicle, is_told in ((never_flown, fires), (SURVEY_QUAD, True)):
        result = checked(vehicle=vehicle, battery=sagging, charge=0.5, MOT_THST_HOVER=throttle)
        assert bool(told(result, "E116")) is is_told


@pytest.mark.parametrize(
    ("parameters", "codes"),
    [
        # PX4's simulation with MPC_THR_MAX at the throttle it hovers with: 0.2 m/s up in place of 3.
        ("MPC_THR_HOVER,0.45\nMPC_THR_MAX,0.5\n", {"E116"}),
        ("MPC_THR_HOVER,0.45\nMPC_THR_MAX,0.9\n", set()),
        ("MPC_THR_HOVER,0.5\nMPC_THR_MAX,0.5\n", {"X904"}),
        ("MPC_THR_HOVER,0.5\nMPC_THR_MAX,0.9\n", set()),
        # A hover may take 0.7 of the greatest throttle: 0.5 of 0.71 in the densest air that the model knows.
        ("MPC_THR_MAX,0.71\n", {"X904"}),
        ("MPC_THR_MAX,0.9\n", set()),
        ("MPC_THR_MAX,0\n", {"X904"}),
        ("MPC_THR_MAX,-1\n", {"X904"}),
    ],
)
def test_px4_hovers_with_what_the_greatest_thrust_leaves(parameters: str, codes: set[str]) -> None:
    one = findings_of(
        PLAIN, Autopilot.PX4, parameters, vehicle=load_vehicle("px4-quad-2kg"), battery=None
    )
    assert {finding.code for finding in one} & {"E116", "X904"} == codes


@pytest.mark.parametrize(
    ("parameters", "codes"),
    [
        # ArduPilot's simulation with 0.2: it arms, and stays on the ground.
        ("MOT_SPIN_MAX,0.1\n", {"E116"}),
        ("MOT_SPIN_MAX,0.15\n", {"E116"}),
        ("MOT_SPIN_MAX,0.5\nMOT_SPIN_MIN,0.95\n", {"E116"}),
        ("MOT_SPIN_MAX,0.2\nMOT_THST_HOVER,0.36\n", {"X904"}),
        # u = 0.5625 leaves 0.35 u + 0.65 u² = 0.4025 of the thrust: 0.8660 of that are 0.3486.
        ("MOT_SPIN_MAX,0.6\nMOT_THST_HOVER,0.349\n", {"X904"}),
        ("MOT_SPIN_MAX,0.6\nMOT_THST_HOVER,0.348\n", set()),
        ("MOT_SPIN_MAX,0.6\nMOT_THST_EXPO,0\n", set()),
        ("MOT_SPIN_MAX,0.9\nMOT_THST_HOVER,0.6\n", set()),
    ],
)
def test_motors_that_may_not_spin_fast_enough_lift_nothing(
    parameters: str, codes: set[str]
) -> None:
    one = findings_of(PLAIN, Autopilot.ARDUPILOT, parameters)
    assert {finding.code for finding in one} & {"E116", "X904"} == codes


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ("MPC_THR_HOVER,0.4\nMPC_THR_MIN,0.4\n", ("T118", Severity.ERROR)),
        ("MPC_THR_HOVER,0.4\nMPC_THR_MIN,0.399\n", ("T118", Severity.WARNING)),
        ("MPC_THR_HOVER,0.4\nMPC_THR_MIN,0.314\n", ("T118", Severity.WARNING)),
        ("MPC_THR_HOVER,0.4\nMPC_THR_MIN,0.313\n", None),
        ("MPC_THR_HOVER,0.5\nMPC_THR_MIN,0.6\n", ("X904", Severity.ERROR)),
        ("MPC_THR_MIN,0.4\n", ("X904", Severity.ERROR)),
        ("MPC_THR_MIN,0.39\n", None),  # 0.5 over 1.2755 is 0.392
        ("MPC_THR_MIN,0.12\n", None),
    ],
)
def test_a_least_thrust_near_the_hover_is_reported(
    parameters: str, told: tuple[str, Severity] | None
) -> None:
    one = findings_of(PLAIN, Autopilot.PX4, parameters)
    found = [(f.code, f.severity) for f in one if f.code in {"T118", "X904"}]
    assert found == ([] if told is None else [told])


def test_px4_averages_its_current_over_50_s() -> None:
    # A step from 2 to 12 A is followed to 1 - 1/e after the time constant.
    mean_a = _mean_current_a(np.full(25, 12.0), 2.0, 2.0)
    assert mean_a[-1] == pytest.approx(12.0 - 10.0 / math.e)


def test_a_failsafe_in_a_landing_that_is_not_the_last_leaves_the_vehicle_there() -> None:
    there = (takeoff(20), waypoint(300, 20), item(21, north(300), 0.0))
    twice = mission(*there, takeoff(20), waypoint(0, 20), item(21, north(0), 0.0))
    whole = checked(twice, MIS_OPTIONS=4, BATT_CAPACITY=8000)
    # In the middle of what the first landing takes.
    left_mah = 8000.0 * 0.5 * (fraction_left(whole, 2) + fraction_left(whole, 3))
    result = checked(
        twice, MIS_OPTIONS=4, BATT_CAPACITY=8000, BATT_LOW_MAH=left_mah, BATT_FS_LOW_ACT=1
    )
    [finding] = told(result, "E103")
    assert finding.severity is Severity.ERROR
    assert finding.item == 3


@pytest.mark.parametrize(
    ("values", "codes"),
    [
        # The second monitor measures the battery that flies, 8 Ah: judged as the first.
        ({"BATT2_CAPACITY": 8000, "BATT2_LOW_MAH": 7900, "BATT2_FS_LOW_ACT": 1}, {"E103"}),
        ({"BATT2_CAPACITY": 8000, "BATT2_LOW_MAH": 100, "BATT2_FS_LOW_ACT": 1}, set()),
        ({"BATT2_CAPACITY": 8000, "BATT2_LOW_MAH": 8001}, {"E114"}),
        ({"BATT2_CAPACITY": 8700, "BATT2_LOW_MAH": 8650, "BATT2_FS_CRT_ACT": 2}, set()),
        # It measures something else: what acts is not checked, what does not is only said.
        ({"BATT2_CAPACITY": 3000, "BATT2_LOW_MAH": 500, "BATT2_FS_LOW_ACT": 2}, {"X904"}),
        ({"BATT2_LOW_VOLT": 10.5}, set()),
        ({"BATT2_MONITOR": 0, "BATT2_LOW_VOLT": 60, "BATT2_FS_LOW_ACT": 2}, set()),
    ],
)
def test_a_further_monitor_acts_as_the_first(values: dict[str, Any], codes: set[str]) -> None:
    result = checked(**({"BATT_MONITOR": 0, "BATT2_MONITOR": 4} | values))
    errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert errors & {"E103", "E114", "X904"} == codes


@pytest.mark.parametrize("action", [1, 3])
def test_a_further_battery_of_px4s_counts_or_is_not_checked(action: int) -> None:
    for capacity, codes in ((8000.0, set()), (3000.0, {"X904"})):
        result = checked(
            autopilot=Autopilot.PX4, BAT2_SOURCE=0, BAT2_CAPACITY=capacity, COM_LOW_BAT_ACT=action
        )
        errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
        assert errors & {"E103", "X904"} == codes
        assert told(result, "E128")


@pytest.mark.parametrize(
    ("cells", "codes"), [(6, set()), (5, {"E114"}), (12, {"E114"})]
)  # of six, 25.1 V full: 5 allow 21.3 V, 12 of 2.1 V each are empty
def test_a_further_battery_of_px4s_keeps_it_from_arming_as_the_first(
    cells: int, codes: set[str]
) -> None:
    assert OWN is not None
    assert OWN.charge_ah is not None
    result = checked(
        autopilot=Autopilot.PX4,
        battery=OWN,
        BAT2_SOURCE=0,
        BAT2_CAPACITY=1000.0 * OWN.charge_ah,
        BAT2_N_CELLS=cells,
    )
    errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert errors & {"E103", "E114", "X904"} == codes


# A lithium-polymer cell without a resistance: 4.19 V full, 3.63 V at a quarter (models/chemistries).  PX4
# takes it for (V - 3.6)/0.45: 7 % are 3.6315 V, a little above that quarter.  Six cells taken for nine are
# 2.8 V each, below empty: it does not arm.
@pytest.mark.parametrize(
    ("values", "charge", "codes"),
    [
        ({"COM_LOW_BAT_ACT": 3}, 1.0, set()),
        ({"COM_LOW_BAT_ACT": 3}, 0.30, {"X904"}),
        ({"COM_LOW_BAT_ACT": 2}, 0.30, {"X904"}),
        ({"COM_LOW_BAT_ACT": 0}, 0.30, set()),
        ({"COM_LOW_BAT_ACT": 3}, 0.70, set()),
        ({"COM_LOW_BAT_ACT": 3, "BAT1_SOURCE": 1}, 0.30, set()),
        ({"COM_LOW_BAT_ACT": 3, "BAT1_SOURCE": -1}, 0.30, set()),
        ({"COM_LOW_BAT_ACT": 3, "BAT1_V_EMPTY": 3.3}, 0.30, set()),
        ({"BAT1_N_CELLS": 9}, 1.0, {"X904"}),
        ({"BAT1_N_CELLS": 9, "BAT1_SOURCE": 1}, 1.0, set()),
    ],
)
def test_a_charge_that_px4_estimates_by_an_assumed_voltage_is_not_checked_where_it_acts(
    values: dict[str, Any], charge: float, codes: set[str]
) -> None:
    result = checked(autopilot=Autopilot.PX4, charge=charge, **values)
    assert result.battery is not None
    assert result.battery.margin_wh > 0.0
    errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert errors & {"E103", "E114", "X904"} == codes


def test_cells_that_px4_counts_wrong_keep_it_from_arming_with_a_known_curve() -> None:
    assert OWN is not None
    cells = 3 * (OWN.cells_in_series or 0)
    assert OWN.cells_in_series
    result = checked(autopilot=Autopilot.PX4, battery=OWN, BAT1_N_CELLS=cells)
    [finding] = told(result, "E114")
    assert "0 % charge" in finding.message


def near_by_px4(values: Mapping[str, float], **given: Any) -> CheckResult:  # noqa: ANN401 - as `check` takes it
    """Return the check of a flight of 100 m by a quadrotor that PX4 flies with parameters."""
    parameters = ParameterSet(
        source="made.params",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=Autopilot.PX4,
    )
    near = mission(takeoff(20), waypoint(50, 20), rtl())
    return check(near, load_vehicle("holybro-x500-v2"), reserve=0.0, parameters=parameters, **given)


# Half a charge of a data sheet's four cells is 3.71 V each.  ``interpolate`` gives what is at BAT1_V_EMPTY or
# below it for 0 %, also where BAT1_V_CHARGED is less: 3.71 V are none of the charge with 4.1 V and 4.05 V, as
# they are with 3.8 V and 4.05 V.  Before 1.16 COM_ARM_BAT_MIN 0 leaves the check of what is critical on;
# since then it is that check.  BAT_EMERGEN_THR above BAT_CRIT_THR is critical too: 24 % are left.
@pytest.mark.parametrize(
    ("values", "target", "codes"),
    [
        ({"BAT1_V_EMPTY": 3.8}, None, {"X904"}),
        ({"BAT1_V_EMPTY": 4.1}, None, {"X904"}),
        ({"BAT1_V_EMPTY": 3.6}, None, set()),
        ({"BAT1_N_CELLS": 12}, "px4-1.15", {"X904"}),
        ({"BAT1_N_CELLS": 12}, "px4-1.16", {"X904"}),
        ({"BAT1_N_CELLS": 12, "COM_ARM_BAT_MIN": 0.0}, "px4-1.15", {"X904"}),
        ({"BAT1_N_CELLS": 12, "COM_ARM_BAT_MIN": 0.0}, None, {"X904"}),
        ({"BAT1_N_CELLS": 12, "COM_ARM_BAT_MIN": 0.0}, "px4-1.16", set()),
        ({"BAT_EMERGEN_THR": 0.25}, None, {"X904"}),
        ({"BAT_EMERGEN_THR": 0.23}, None, set()),
    ],
)
def test_px4_does_not_arm_with_a_critical_battery(
    values: dict[str, float], target: str | None, codes: set[str]
) -> None:
    result = near_by_px4(values, charge=0.5, target=TARGETS.get(target or ""))
    errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert errors & {"E103", "E114", "X904"} == codes


# Above 1.05 BAT1_V_CHARGED a cell PX4 takes the battery for faulty: four full cells of 4.19 V are 16.76 V, of
# three it allows 12.76 V.  3.98 V a cell allow 16.72 V, 4.0 V 16.80 V.
@pytest.mark.parametrize(
    ("values", "fires"),
    [
        ({"BAT1_N_CELLS": 3}, True),
        ({"BAT1_N_CELLS": 3, "BAT1_SOURCE": 1}, False),
        ({"BAT1_N_CELLS": 4}, False),
        ({"BAT1_N_CELLS": 4, "BAT1_V_CHARGED": 3.98}, True),
        ({"BAT1_N_CELLS": 4, "BAT1_V_CHARGED": 4.0}, False),
    ],
)
def test_px4_does_not_arm_with_more_voltage_than_its_cells_have(
    values: dict[str, float],
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    result = near_by_px4(values)
    assert any("BAT1_N_CELLS" in one.message for one in told(result, "X904")) is fires


def test_px4_does_not_arm_with_more_voltage_than_its_cells_have_by_a_known_curve() -> None:
    assert OWN is not None
    assert OWN.cells_in_series
    result = checked(autopilot=Autopilot.PX4, battery=OWN, BAT1_N_CELLS=OWN.cells_in_series - 1)
    assert "over voltage" in told(result, "E114")[0].message
    result = checked(autopilot=Autopilot.PX4, battery=OWN, BAT1_N_CELLS=OWN.cells_in_series)
    assert not told(result, "E114")


# The same cells in a data sheet's battery, whose curve is scaled to what its label holds: a voltmeter sees
# the cells all the same.  Full 4.19 V, four of them 16.76 V, three 12.57 V; half 3.71 V, which PX4 takes for
# (3.71 - 3.6)/0.45 = 24 %.  By the scaled curve they were 16.40, 12.30 V and 7 %.
@pytest.mark.parametrize(
    ("vehicle", "charge", "values", "code"),
    [
        ("holybro-x500-v2", 0.5, {"COM_LOW_BAT_ACT": 3}, None),
        ("holybro-x500-v2", 0.5, {"COM_ARM_BAT_MIN": 0.23}, None),
        ("holybro-x500-v2", 0.5, {"COM_ARM_BAT_MIN": 0.25}, "X904"),
        ("holybro-x500-v2", 0.26, {"COM_LOW_BAT_ACT": 3}, "X904"),
        ("3dr-solo", 1.0, {"BATT_ARM_VOLT": 16.7}, None),
        ("3dr-solo", 1.0, {"BATT_ARM_VOLT": 16.8}, "E114"),
        ("3dr-iris-plus", 1.0, {"BATT_ARM_VOLT": 12.5}, None),
    ],
)
def test_thresholds_in_volts_are_held_against_the_cells_not_against_a_label(
    vehicle: str, charge: float, values: dict[str, float], code: str | None
) -> None:
    model = load_vehicle(vehicle)
    stack = Autopilot(model.reference)
    given = ParameterSet(
        source="made.param",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=stack,
    )
    near = mission(takeoff(20), waypoint(50, 20), rtl())
    result = check(near, model, charge=charge, reserve=0.0, parameters=given)
    errors = {one.code for one in result.findings if one.severity is Severity.ERROR}
    assert errors & {"E103", "E114", "X904"} == ({code} if code else set())


@pytest.mark.parametrize(
    ("wind_m_s", "times", "action", "severity"),
    [
        # against 4 m/s the article's vehicle, which counts no wind, may take half as much again
        (4.0, 1.3, 1.0, Severity.ERROR),
        (4.0, 1.3, 2.0, Severity.WARNING),
        (4.0, 3.0, 1.0, None),
        (0.0, 1.3, 1.0, None),
    ],
)
def test_a_failsafe_acts_by_what_a_model_does_not_count_too(
    wind_m_s: float, times: float, action: float, severity: Severity | None
) -> None:
    vehicle = load_vehicle("falkowski-2023-quadrotor")
    away = mission(takeoff(50), waypoint(1500, 50), waypoint(0, 50), item(21, north(500), 0.0))
    wind = Wind(speed_m_s=wind_m_s, from_deg=0.0)
    used_wh = check(away, vehicle, battery=LABEL, wind=wind).totals.energy_wh
    values = {
        "BATT_CAPACITY": 8000.0,
        "BATT_LOW_MAH": 8000.0 * (1.0 - times * used_wh / LABEL.energy_wh),
        "BATT_FS_LOW_ACT": action,
    }
    given = ParameterSet(
        source="made.param",
        values={name: ParameterValue(value) for name, value in values.items()},
        stack=Autopilot.ARDUPILOT,
    )
    result = check(away, vehicle, battery=LABEL, wind=wind, reserve=0.0, parameters=given)
    found = told(result, "E134")
    assert [one.severity for one in found] == [severity] * (severity is not None)
    assert all("does not count" in one.message for one in found)


@pytest.mark.parametrize(
    ("low_mah", "reserve", "fires"),
    [(6910.0, 0.809, True), (6990.0, 0.809, False), (6910.0, 0.7, False)],
)
def test_a_return_that_begins_anew_in_the_missions_own_waits_again(
    low_mah: float, reserve: float, *, fires: bool
) -> None:
    """Of 177.6 Wh it takes 31.9, 5.9 of them over home for 60 s, 4.7 to land: from 33.9 on below 0.809.

    At 6910 mAh, 24.2 Wh, both are to come again: 34.8 Wh; at 6990 mAh it has just got there, 22.4 Wh: 33.0.
    Flown: 60 s more over home, with a failsafe in the middle of them.
    """
    told = checked(
        reserve=reserve,
        BATT_CAPACITY=8000.0,
        BATT_LOW_MAH=low_mah,
        BATT_FS_LOW_ACT=2.0,
        RTL_LOIT_TIME=60000.0,
    )
    found = ended(told)
    assert bool(found) is fires
    assert all(one.item == 4 and "below the reserve" in one.message for one in found)
