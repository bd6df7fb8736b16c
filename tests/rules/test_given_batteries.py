"""Batteries given by a label: completed from the model's own, weighed, and none that cannot be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import HOME, mission, rtl, takeoff, waypoint
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Finding, Severity
from planner.notation import read_battery
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import ModelSpread
from planner.vehicle.pack import flown_pack
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.mission.items import Mission

QUAD = load_vehicle("arducopter-sitl-quad")
"""3.5 kg; its battery: 8 Ah, 6 cells, 22.25 V in the mean, 31.13 milliohm, 178 Wh."""
ARTICLE = load_vehicle("falkowski-2023-quadrotor")
"""Neither mass nor battery; hovers at 119.49 · 10^0.02 = 125 W at 10 m."""
OWN = QUAD.battery
PLAIN = mission(takeoff(30), waypoint(1000, 30), rtl())
BOTH = (Autopilot.ARDUPILOT, Autopilot.PX4)
FEW = settings(max_examples=examples(8), deadline=None)


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Out along a line and back by a return, 20 to 60 m up."""
    height_m = draw(st.floats(20.0, 60.0))
    places_m = draw(st.lists(st.floats(50.0, 2500.0), min_size=1, max_size=4))
    return mission(takeoff(height_m), *(waypoint(north, height_m) for north in places_m), rtl())


def flown(
    label: str | None,
    parameters: str = "",
    *,
    of: Mission = PLAIN,
    by: Autopilot = Autopilot.ARDUPILOT,
    reserve: float = 0.2,
) -> CheckResult:
    """Return the check of a flight with a labelled battery."""
    return check(
        of,
        QUAD,
        autopilot=by,
        battery=None if label is None else read_battery(label),
        reserve=reserve,
        parameters=parameters_from_text(parameters.encode(), source="p.param")
        if parameters
        else None,
    )


def told(result: CheckResult, code: str) -> list[Finding]:
    return [one for one in result.findings if one.code == code]


def error_codes(result: CheckResult) -> set[str]:
    return {one.code for one in result.findings if one.severity is Severity.ERROR}


def test_twice_the_charge_of_the_own_cells_has_half_the_resistance_and_the_same_voltage() -> None:
    assert OWN is not None
    assert OWN.voltage_v is not None
    twice = Battery(capacity_ah=16.0, nominal_voltage_v=OWN.voltage_v)
    battery = flown_pack(twice, OWN).battery
    assert battery is not None
    assert battery.internal_resistance_ohm == pytest.approx(0.03113 / 2.0)
    assert battery.cells_in_series == 6
    assert battery.ocv_v == pytest.approx(OWN.ocv_v)
    assert battery.energy_wh == pytest.approx(2.0 * OWN.energy_wh)


def test_an_energy_has_the_charge_it_makes_at_the_own_voltage() -> None:
    assert OWN is not None
    battery = flown_pack(Battery(capacity_wh=0.5 * OWN.energy_wh), OWN).battery
    assert battery is not None
    assert battery.charge_ah == pytest.approx(4.0)
    assert battery.internal_resistance_ohm == pytest.approx(2.0 * 0.03113)


@pytest.mark.parametrize(
    ("voltage_v", "cells"),
    [(3.7, 1), (11.1, 3), (14.4, 4), (14.8, 4), (15.2, 4), (22.2, 6), (44.4, 12), (12.8, None)],
)
def test_without_an_own_battery_the_voltage_means_the_cells(
    voltage_v: float, cells: int | None
) -> None:
    pack = flown_pack(Battery(capacity_ah=5.0, nominal_voltage_v=voltage_v), None)
    assert pack.battery is not None
    assert pack.battery.cells_in_series == cells
    assert pack.battery.energy_wh == pytest.approx(5.0 * voltage_v)
    assert bool(pack.assumed) is (cells is not None)


# Six cells of iron phosphate, 3.2 V each, are none of lithium-polymer with 0.86 times the voltage: of theirs
# nothing is known, so a threshold in volts that acts is not checked.  PX4 takes 3.2 V a cell for empty.
@pytest.mark.parametrize(
    ("autopilot", "parameters", "volts", "is_open"),
    [
        (Autopilot.ARDUPILOT, "BATT_LOW_VOLT,20.4\nBATT_FS_LOW_ACT,2\n", 19.2, True),
        (Autopilot.ARDUPILOT, "BATT_ARM_VOLT,21\n", 19.2, True),
        (Autopilot.ARDUPILOT, "BATT_LOW_VOLT,20.4\nBATT_FS_LOW_ACT,2\n", 21.6, False),
        (Autopilot.ARDUPILOT, "WPNAV_SPEED,1000\n", 19.2, False),
        (Autopilot.PX4, "BAT1_N_CELLS,6\n", 19.2, True),
        (Autopilot.PX4, "BAT1_N_CELLS,6\nBAT1_V_EMPTY,2.9\nBAT1_V_CHARGED,3.4\n", 19.2, False),
    ],
)
def test_voltages_of_cells_of_another_kind_are_not_those_of_the_models_own(
    autopilot: Autopilot,
    parameters: str,
    volts: float,
    is_open: bool,  # noqa: FBT001 - a table of cases
) -> None:
    result = flown(f"8Ah@{volts}V", parameters, by=autopilot)
    assert ("X904" in error_codes(result)) is is_open


@pytest.mark.parametrize(
    ("label", "kind"),
    [
        ("5Ah@14.4V", "li-ion"),
        ("5Ah@21.6V", "li-ion"),
        ("5Ah@14.8V", "lipo"),
        ("5Ah@15.4V", "lipo"),
    ],
)
def test_a_cell_of_3_6_volts_is_a_lithium_ion_cell(label: str, kind: str) -> None:
    pack = flown_pack(read_battery(label), None)
    assert pack.battery is not None
    assert pack.battery.chemistry == kind
    assert ("lithium-ion" in pack.assumed) is (kind == "li-ion")
    # A tenth of the charge left: 3.32 V of 3.70 in the mean there, 3.57 of 3.78 here.
    circuit = pack.battery.circuit(20.0)
    if circuit is not None:
        assert circuit.open_circuit_v(0.1) / circuit.open_circuit_v(0.5) < 0.97


@pytest.mark.parametrize(
    ("cells_v", "mean", "expected"),
    [
        (None, 11.9, []),
        (None, 12.1, [Severity.WARNING]),
        (14.4, 11.9, []),  # lithium-ion
        (14.4, 12.1, [Severity.ERROR]),
        (14.8, 12.1, []),  # lithium-polymer
    ],
)
def test_a_battery_is_judged_by_its_kind_and_by_what_bears_most_where_that_is_unknown(
    cells_v: float | None, mean: float, expected: list[Severity]
) -> None:
    one = mission(takeoff(20), waypoint(20, 20, hold_s=300.0), rtl())
    mean_w = check(one, ARTICLE, battery=Battery(capacity_wh=77.0)).totals.mean_power_w
    energy_wh = mean_w / mean
    battery = Battery(capacity_wh=energy_wh)
    if cells_v is not None:
        battery = Battery(capacity_ah=energy_wh / cells_v, nominal_voltage_v=cells_v)
    found = told(check(one, ARTICLE, battery=battery), "E110")
    assert [f.severity for f in found] == expected


@pytest.mark.parametrize("label", [None, "8Ah@22.2V", "178Wh"])
@pytest.mark.parametrize(
    ("parameters", "code"),
    [
        ("BATT_LOW_VOLT,24.5\nBATT_FS_LOW_ACT,2\n", "E103"),
        ("BATT_LOW_MAH,7800\nBATT_FS_LOW_ACT,2\nBATT_CAPACITY,8000\n", "E103"),
        ("BATT_ARM_VOLT,25.6\n", "E114"),
    ],
)
def test_a_failsafe_acts_however_the_battery_is_written(
    label: str | None, parameters: str, code: str
) -> None:
    assert code in error_codes(flown(label, parameters))


@pytest.mark.parametrize(
    ("by", "parameters"),
    [
        (Autopilot.ARDUPILOT, "BATT_LOW_MAH,7800\nBATT_FS_LOW_ACT,2\nBATT_CAPACITY,8000\n"),
        (Autopilot.ARDUPILOT, "BATT_ARM_VOLT,25.6\n"),
        (Autopilot.PX4, "BAT_CRIT_THR,0.95\nCOM_LOW_BAT_ACT,3\n"),
        (Autopilot.PX4, "COM_ARM_BAT_MIN,1.0\nBAT1_V_CHARGED,4.5\n"),
    ],
)
def test_a_battery_that_nothing_measures_has_no_failsafe(by: Autopilot, parameters: str) -> None:
    off = "BATT_MONITOR,0\n" if by is Autopilot.ARDUPILOT else "BAT1_SOURCE,-1\n"
    result = flown("8Ah@22.2V", parameters + off, by=by)
    assert not error_codes(result) & {"E103", "E114", "X904"}
    if "MAH" in parameters or "CRIT" in parameters:
        assert "E103" in error_codes(flown("8Ah@22.2V", parameters, by=by))


@pytest.mark.parametrize(("by_v", "is_checked"), [(-0.1, True), (0.1, False)])
def test_a_failsafe_by_voltage_is_checked_by_poor_cells_where_no_resistance_is_known(
    by_v: float, *, is_checked: bool
) -> None:
    label = read_battery("5.2Ah@4S")
    bare = check(PLAIN, ARTICLE, battery=label, temperature_c=20.0)
    # One flight of a hundred takes 2.326 x 5 % more; four cells of 0.05 ohm for 1 Ah, at 20 °C.
    times, resistance_ohm = 1.0 + 2.326 * 0.05, 4 * 0.05 / 5.2
    left = 1.0 - times * bare.totals.energy_wh / (5.2 * 14.8)
    assert 0.75 < left < 0.9  # 3.93 to 4.08 V a cell (models/chemistries/lipo.toml)
    rest_v = 4.0 * (3.93 + (left - 0.75) * (4.08 - 3.93) / (0.9 - 0.75))
    loaded_v = (
        rest_v + math.sqrt(rest_v**2 - 4.0 * resistance_ohm * times * bare.totals.peak_power_w)
    ) / 2.0
    # 0.1 V: the landing, in which a failsafe that lands changes nothing, takes 1 % of the charge, 0.04 V.
    text = f"BATT_MONITOR,4\nBATT_FS_LOW_ACT,1\nBATT_LOW_VOLT,{loaded_v + by_v:.2f}\n"
    result = check(
        PLAIN,
        ARTICLE,
        battery=label,
        temperature_c=20.0,
        parameters=parameters_from_text(text.encode(), source="p.param"),
    )
    assert bool(told(result, "X904")) is not is_checked
    assert any("38 milliohm" in one.message for one in told(result, "E125")) is is_checked


def test_a_threshold_nobody_acts_on_asks_for_no_check() -> None:
    bare = replace(QUAD, battery=None)
    for action, is_asked in ((0, False), (2, True)):
        text = f"BATT_LOW_VOLT,24\nBATT_FS_LOW_ACT,{action}\n"
        result = check(
            PLAIN,
            bare,
            battery=read_battery("8Ah@22.2V"),
            parameters=parameters_from_text(text.encode(), source="p.param"),
        )
        assert bool(told(result, "X904")) is is_asked


def test_a_larger_battery_is_carried_and_a_smaller_one_is_no_lighter() -> None:
    assert OWN is not None
    # 175 Wh more at 175 Wh/kg are 1 kg; momentum theory: power by mass to 3/2, 1.46 times.
    own, more, less = (flown(f"{OWN.energy_wh + by:.3f}Wh") for by in (0.0, 175.0, -100.0))
    assert more.assessment is not None
    assert more.assessment.flight.power.mass_kg == pytest.approx(4.5, abs=1e-4)
    assert more.totals.energy_wh > 1.3 * own.totals.energy_wh
    assert less.totals.energy_wh == own.totals.energy_wh
    assert any("1.00 kg heavier" in one.message for one in told(more, "E125"))


@pytest.mark.parametrize(
    ("label", "is_possible"),
    [
        ("77Wh", True),
        ("5.2Ah@14.8V", True),
        ("5.2Ah@148V", False),
        ("770Wh", False),
        ("7700Wh", False),
        # 125.12 W for 2.1 h are 262.8 Wh.
        ("262Wh", True),
        ("264Wh", False),
    ],
)
def test_no_battery_lasts_longer_than_a_multicopter_ever_flew(
    label: str, *, is_possible: bool
) -> None:
    result = check(PLAIN, ARTICLE, battery=read_battery(label))
    assert ("E123" not in error_codes(result)) is is_possible
    assert (result.verdict == "go") is is_possible


@pytest.mark.parametrize("health", [None, 0.8, 0.23])
def test_an_impossible_battery_is_none_for_being_worn(health: float | None) -> None:
    quad = load_vehicle("dji-matrice-100")
    result = check(PLAIN, quad, battery=read_battery("4000Wh"), battery_health=health)
    assert "E123" in error_codes(result)


@pytest.mark.parametrize(
    ("share", "home_amsl_m", "severity"),
    [
        # 1.225 kg/m³ over 0.9569 kg/m³ at 2500 m (ISO 2533): a power √ of that, 1.1315 times as great.
        (1.130, None, Severity.ERROR),
        (1.133, None, Severity.WARNING),
        (1.130, 0.0, None),
        (1.130, 400.0, None),
    ],
)
def test_where_home_is_unknown_the_battery_lasts_in_thin_air(
    share: float, home_amsl_m: float | None, severity: Severity | None
) -> None:
    made = replace(PLAIN, home=replace(HOME, altitude_amsl_m=None))
    need_wh = check(PLAIN, ARTICLE, battery=Battery(capacity_wh=100.0)).totals.energy_wh
    # 30 m up the air has 1.2215 kg/m³, which the model does not count.
    pack = Battery(capacity_wh=1.25 * share * need_wh * math.sqrt(1.225 / 1.2215))
    result = check(made, ARTICLE, battery=pack, reserve=0.2, home_amsl_m=home_amsl_m)
    found = [one.severity for one in result.findings if one.code == "X909"]
    assert found == ([] if severity is None else [severity])


@pytest.mark.parametrize(("climb_cm_s", "severities"), [(500, []), (30, [Severity.ERROR])])
def test_what_the_vehicle_takes_longer_takes_of_the_margin_for_thin_air(
    climb_cm_s: int, severities: list[Severity]
) -> None:
    """A third more lasts up to 4500 m, 1.256 times; 30 m up at 0.3 m/s take 75 s more, 2.6 of 3.1 Wh."""
    made = replace(PLAIN, home=replace(HOME, altitude_amsl_m=None))
    need_wh = check(PLAIN, ARTICLE, battery=Battery(capacity_wh=100.0)).totals.energy_wh
    given = parameters_from_text(f"WPNAV_SPEED_UP,{climb_cm_s}\n".encode(), source="p.param")
    pack = Battery(capacity_wh=1.25 * 1.33 * need_wh)
    result = check(made, ARTICLE, battery=pack, reserve=0.2, parameters=given)
    found = [one.severity for one in result.findings if one.code == "X909"]
    assert found == severities


@pytest.mark.parametrize("spread", [None, 0.05, 0.10])
@pytest.mark.parametrize(("off", "severity"), [(-0.02, Severity.ERROR), (0.02, Severity.WARNING)])
def test_where_home_is_unknown_no_flight_of_a_hundred_ends_empty_in_thin_air(
    spread: float | None, off: float, severity: Severity
) -> None:
    """Of 1.1315 times the power one in a hundred takes 2.326 standard deviations more, of 5 % without any."""
    made = replace(PLAIN, home=replace(HOME, altitude_amsl_m=None))
    bare = replace(ARTICLE, spread=None)
    need_wh = check(PLAIN, bare, battery=Battery(capacity_wh=100.0)).totals.energy_wh
    vehicle = bare
    if spread is not None:
        sample = ModelSpread(
            time_fraction=0.0, energy_fraction=spread, n_flights=100, source="made"
        )
        vehicle = replace(ARTICLE, spread=sample)
    share = 1.1315 * math.sqrt(1.2215 / 1.225) * (1.0 + 2.326 * (spread or 0.05))
    pack = Battery(capacity_wh=(share + off) * need_wh)
    found = {
        one.code: one.severity
        for one in check(made, vehicle, battery=pack, reserve=0.0).findings
        if one.code in {"X909", "E101", "E124"}
    }
    assert found == {"X909": severity}


def test_a_battery_of_ten_thousand_volts_for_small_rotors_is_a_slip() -> None:
    bare = replace(ARTICLE, mass_kg=2.0)
    for volts, is_possible in ((99.9, True), (100.1, False)):
        battery = Battery(capacity_ah=0.5, nominal_voltage_v=volts)
        codes = error_codes(check(PLAIN, bare, battery=battery))
        assert ("E123" not in codes) is is_possible


@pytest.mark.parametrize(("mean", "is_error"), [(19.9, False), (20.1, True)])
def test_no_lithium_polymer_battery_bears_20_c_until_empty(mean: float, *, is_error: bool) -> None:
    # A hover whose power hardly varies: its peak is far below the 36 C of seconds.
    one = mission(takeoff(20), waypoint(20, 20, hold_s=300.0), rtl())
    mean_w = check(one, ARTICLE, battery=Battery(capacity_wh=77.0)).totals.mean_power_w
    found = check(one, ARTICLE, battery=Battery(capacity_wh=mean_w / mean))
    assert ("E110" in error_codes(found)) is is_error


@FEW
@given(one=missions(), by=st.sampled_from(BOTH), times=st.sampled_from((10.0, 100.0)))
def test_no_mission_goes_with_ten_times_the_energy_of_the_own_battery(
    one: Mission, by: Autopilot, times: float
) -> None:
    label = f"{178.0 * times:.0f}Wh"
    assert flown(label, of=one, by=by).verdict == "no-go"
    ten = Battery(capacity_wh=77.0 * times)
    assert check(one, ARTICLE, battery=ten).verdict == "no-go"


@FEW
@given(one=missions(), by=st.sampled_from(BOTH), left=st.floats(0.0, 0.3))
def test_no_mission_goes_that_may_end_with_an_empty_battery(
    one: Mission, by: Autopilot, left: float
) -> None:
    bare = replace(QUAD, battery=None, spread=None)
    for vehicle, autopilot in ((bare, by), (ARTICLE, None)):
        need_wh = check(
            one, vehicle, autopilot=autopilot, battery=Battery(capacity_wh=150.0)
        ).totals.energy_wh
        battery = Battery(capacity_wh=need_wh * (1.0 + left))
        result = check(one, vehicle, autopilot=autopilot, battery=battery, reserve=0.0)
        chance = 0.5 * math.erfc(left / 0.05 / math.sqrt(2.0))
        if result.verdict == "go":
            assert chance <= 0.01
        if chance > 0.01:
            assert error_codes(result) & {"E102", "E124"}


@FEW
@given(one=missions(), by=st.sampled_from(BOTH), volts=st.floats(20.0, 24.0))
def test_a_label_of_the_own_battery_is_judged_as_the_own_battery(
    one: Mission, by: Autopilot, volts: float
) -> None:
    assert OWN is not None
    text = f"BATT_LOW_VOLT,{volts:.2f}\nBATT_FS_LOW_ACT,2\n" if by is Autopilot.ARDUPILOT else ""
    own = flown(None, text, of=one, by=by)
    same = flown(f"{OWN.energy_wh!r}Wh", text, of=one, by=by)
    assert error_codes(same) == error_codes(own)
    assert same.totals == own.totals
    assert same.battery == own.battery
