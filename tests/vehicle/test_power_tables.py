"""The power and the battery of model files: what each table gives, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import VehicleFileError
from planner.vehicle.battery import Battery
from planner.vehicle.declared import InvalidValueError
from planner.vehicle.model import Loads, VehicleModel
from planner.vehicle.power import (
    CruisePower,
    DiFrancoButtazzoLaw,
    LiuLaw,
    MomentumLaw,
    VerticalPower,
    whole_power_w,
)
from planner.vehicle.reader import chemistry_names, load_chemistry, vehicle_from_toml

HEAD = """\
schema = 1
name = "quad"
kind = "multicopter"
reference = "ardupilot"
description = "a quadrotor"
mass_kg = 1.5
"""
TAIL = """\
[valid_for]
speed_m_s = [0, 10]
[provenance]
source = "invented for a test"
method = "none"
date = 2026-01-02
"""
DENSITY = """\
[hover]
law = "density"
hover_power_w = 180.0
reference_mass_kg = 1.5
reference_density_kg_m3 = 1.225
mass_exponent = 1.5
density_exponent = -0.5
"""
OF_CRUISE = '[hover]\nlaw = "of-cruise"\n'
UNKNOWN = '[hover]\nlaw = "not-given"\n'
NO_CRUISE = '[cruise]\npower = "not-given"\n'
TABLE = '[cruise]\npower = "table"\nspeed_m_s = [2, 6]\npower_above_hover_w = [-5, 12]\n'
MOMENTUM = """\
[cruise]
power = "momentum"
disk_area_m2 = 0.2
drag_area_m2 = 0.02
induced_factor = 1.6
axial_factor = 1.5
profile_factor = 0.3
profile_speed_factor = 0.1
"""
LIU = """\
[cruise]
power = "liu"
k1 = 0.8554
k2_sqrt_kg_m = 0.3051
c2_sqrt_m_kg = 0.3177
c4_kg_m = 0.0296
c5_kg_m = 0.0279
"""
DI_FRANCO = """\
[cruise]
power = "di-franco-buttazzo"
coefficients = [2.0, -12.0, 220.0]
climb_power_w = 250
climb_speed_m_s = 2
descent_power_w = 200
descent_speed_m_s = 1
"""
VERTICAL = "[vertical]\nclimb_rate_m_s = [-1, 2]\npower_above_hover_w = [-10, 60]\n"
LOADS = "[loads]\navionics_w = 8\nground_idle_w = 3\n"
BATTERY = """\
[battery]
cell_capacity_ah = 2.5
cells_in_series = 4
cells_in_parallel = 2
cell_resistance_ohm = 0.02
chemistry = "lipo"
cutoff_voltage_v = 14.0
max_c_rate = 10
health = 0.9
resistance_age_factor = 1.5
"""


def read(*tables: str, head: str = HEAD) -> VehicleModel:
    text = head + "".join(tables) + TAIL
    return vehicle_from_toml(text.encode(), name="quad", source="hangar/quad.toml")


def problems_of(*tables: str, head: str = HEAD) -> tuple[str, ...]:
    with pytest.raises(VehicleFileError) as caught:
        read(*tables, head=head)
    return caught.value.problems


@pytest.mark.parametrize(
    ("tables", "law", "knows"),
    [
        ((OF_CRUISE, MOMENTUM), MomentumLaw, (True, True, True)),
        ((OF_CRUISE, LIU), LiuLaw, (True, True, False)),
        ((OF_CRUISE, DI_FRANCO), DiFrancoButtazzoLaw, (True, False, False)),
        ((DENSITY, LIU), LiuLaw, (True, True, True)),
        ((DENSITY, TABLE, VERTICAL), CruisePower, (True, True, True)),
        ((DENSITY, NO_CRUISE), type(None), (False, True, True)),
        ((UNKNOWN, NO_CRUISE), type(None), (False, False, False)),
    ],
)
def test_a_file_says_which_law_holds_and_what_it_knows(
    tables: tuple[str, ...], law: type, knows: tuple[bool, bool, bool]
) -> None:
    model = read(*tables)
    assert isinstance(model.cruise, law)
    assert (model.knows_airspeed, model.knows_mass, model.knows_air_density) == knows
    assert model.is_power_known is (tables[0] is not UNKNOWN)


def test_a_rotor_as_good_as_the_ideal_one_is_taken() -> None:
    # 0.75 + 0.25 is 1 exactly, in binary too
    ideal = MOMENTUM.replace("1.6", "0.75").replace("0.3", "0.25")
    law = read(OF_CRUISE, ideal).cruise
    assert isinstance(law, MomentumLaw)
    assert law.induced_factor + law.profile_factor == 1.0
    [problem] = problems_of(OF_CRUISE, ideal.replace("0.25", "0.2499"))
    assert "better than ideal" in problem


@pytest.mark.parametrize("power_w", [-1.0, 0.0])
def test_power_above_hover_may_be_given_where_nothing_moves_if_it_is_none(power_w: float) -> None:
    table = TABLE.replace("[2, 6]", "[0, 6]").replace("[-5, 12]", f"[{power_w}, 0]")
    if power_w:
        [problem] = problems_of(DENSITY, table)
        assert "must be 0 where speed_m_s is 0, got -1" in problem
    else:
        law = read(DENSITY, table).cruise
        assert isinstance(law, CruisePower)
        assert law.above_hover_w(np.array([0.0, 3.0, 9.0])).tolist() == [0.0, 0.0, 0.0]


def test_a_curve_may_end_with_any_hover_power_above_none() -> None:
    law = read(OF_CRUISE, DI_FRANCO.replace("220.0", "0.5")).cruise
    assert isinstance(law, DiFrancoButtazzoLaw)
    assert float(law.power_w(0.0, 0.0)) == 0.5


def test_loads_and_the_airspeed_limit_are_what_the_file_says() -> None:
    model = read(OF_CRUISE, MOMENTUM, LOADS, head=HEAD + "airspeed_limit_m_s = 14\n")
    assert model.loads == Loads(avionics_w=8.0, ground_idle_w=3.0)
    assert model.airspeed_limit_m_s == 14.0
    assert read(OF_CRUISE, MOMENTUM).airspeed_limit_m_s is None


@pytest.mark.parametrize(
    ("tables", "key", "says"),
    [
        ((OF_CRUISE, TABLE), "hover.law", "momentum, liu or di-franco-buttazzo"),
        ((OF_CRUISE, NO_CRUISE), "hover.law", "momentum, liu or di-franco-buttazzo"),
        ((UNKNOWN, MOMENTUM), "hover.law", "not-given as well"),
        ((UNKNOWN, NO_CRUISE, VERTICAL), "hover.law", "[vertical] left out"),
        ((OF_CRUISE, MOMENTUM, VERTICAL), "vertical", "knows the climb"),
        ((OF_CRUISE, MOMENTUM.replace("0.2\n", "0\n")), "cruise.disk_area_m2", "greater than 0"),
        ((OF_CRUISE, MOMENTUM.replace("1.6", "0.6")), "cruise.induced_factor", "better than ideal"),
        ((OF_CRUISE, MOMENTUM.replace("1.6", "nan")), "cruise.induced_factor", "nan"),
        ((OF_CRUISE, MOMENTUM.replace("axial", "axal")), "cruise.axal_factor", "axial_factor?"),
        ((OF_CRUISE, LIU.replace("k1 = 0.8554", "")), "cruise.k1", "is missing"),
        ((OF_CRUISE, LIU.replace("0.3051", "0")), "cruise.k2_sqrt_kg_m", "greater than 0"),
        ((OF_CRUISE, DI_FRANCO.replace("220.0", "0")), "cruise.coefficients", "hover power"),
        ((OF_CRUISE, DI_FRANCO.replace("= 1\n", "= -1\n")), "cruise.descent_speed_m_s", "than 0"),
        ((DENSITY, TABLE.replace("[2, 6]", "[0, 6]")), "cruise.power_above_hover_w", "at rest"),
        ((DENSITY, TABLE, VERTICAL.replace("-1, 2", "0, 2")), "vertical.power_above_hover_w", "0"),
        ((OF_CRUISE, MOMENTUM, "[loads]\navionics_w = 8\n"), "loads.ground_idle_w", "is missing"),
        ((OF_CRUISE, MOMENTUM, LOADS.replace("8", "-8")), "loads.avionics_w", "below 0"),
    ],
)
def test_power_that_does_not_fit_together_is_refused(
    tables: tuple[str, ...], key: str, says: str
) -> None:
    problems = problems_of(*tables)
    assert any(p.startswith(f"hangar/quad.toml: {key}: ") and says in p for p in problems), problems


@pytest.mark.parametrize(
    ("tables", "law"),
    [((OF_CRUISE, MOMENTUM), 'power = "momentum"'), ((OF_CRUISE, LIU), 'power = "liu"')],
)
def test_a_law_that_lifts_a_mass_needs_it(tables: tuple[str, ...], law: str) -> None:
    [problem] = problems_of(*tables, head=HEAD.replace("mass_kg = 1.5\n", ""))
    assert "mass_kg" in problem
    assert law in problem


def test_a_pack_of_cells_is_read_in_series_and_in_parallel() -> None:
    battery = read(OF_CRUISE, MOMENTUM, BATTERY).battery
    assert battery is not None
    assert battery.new_charge_ah == pytest.approx(5.0)
    assert battery.charge_ah == pytest.approx(4.5)  # at 90 % health
    assert battery.ocv_v is not None
    assert battery.ocv_v[-1] == pytest.approx(4 * 4.19)
    # 0.02 Ω x 4 / 2, half as much again for its age; the chemistry is warm at 20 °C
    assert battery.resistance_ohm(20.0) == pytest.approx(0.06)
    assert battery.resistance_ohm(40.0) == pytest.approx(0.06)
    assert battery.resistance_ohm(5.0) == pytest.approx(0.06 * 1.44)
    assert battery.resistance_ohm(-20.0) == pytest.approx(0.06 * 1.44)
    # Trapezes under the seven points of the cell: 3.78025 V in the mean
    assert battery.energy_wh == pytest.approx(4.5 * 4 * 3.78025)


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ('"lipo"', '"lippo"', "battery.chemistry", "did you mean lipo"),
        ("cells_in_series = 4\n", "", "battery.cells_in_series", "needs it"),
        ("cell_capacity_ah = 2.5", "", "battery.capacity_ah", "is missing"),
        ("health", "capacity_ah = 5\nhealth", "battery.cell_capacity_ah", "give one"),
        (
            "health",
            "internal_resistance_ohm = 0.1\nhealth",
            "battery.cell_resistance_ohm",
            "give one",
        ),
        ("0.9", "1.1", "battery.health", "not be above 1"),
        ("0.9", "0", "battery.health", "greater than 0"),
        ("1.5", "0.5", "battery.resistance_age_factor", "not be below 1"),
        ("14.0", "17", "battery.cutoff_voltage_v", "below the voltage"),
        ("= 10", "= 0", "battery.max_c_rate", "greater than 0"),
        (
            "health",
            "resistance_temperature_c = [0, 20]\nhealth",
            "battery.resistance_factor",
            "is missing",
        ),
        (
            "health",
            "resistance_temperature_c = [0, 20]\nresistance_factor = [1.5]\nhealth",
            "battery.resistance_factor",
            "has 1 value",
        ),
        (
            "health",
            "resistance_temperature_c = [20, 0]\nresistance_factor = [1.5, 1]\nhealth",
            "battery.resistance_temperature_c",
            "0 follows 20",
        ),
    ],
)
def test_a_battery_that_does_not_fit_together_is_refused(
    old: str, new: str, key: str, says: str
) -> None:
    assert old in BATTERY
    problems = problems_of(OF_CRUISE, MOMENTUM, BATTERY.replace(old, new, 1))
    assert any(p.startswith(f"hangar/quad.toml: {key}: ") and says in p for p in problems), problems


def test_a_charge_without_voltage_or_curve_is_no_energy() -> None:
    problems = problems_of(OF_CRUISE, MOMENTUM, "[battery]\ncapacity_ah = 5\n")
    assert any("battery.nominal_voltage_v" in problem for problem in problems)


def test_a_curve_of_its_own_goes_before_that_of_the_chemistry() -> None:
    own = BATTERY + "ocv_soc = [0, 1]\nocv_v = [13, 17]\n"
    battery = read(OF_CRUISE, MOMENTUM, own).battery
    assert battery is not None
    assert battery.ocv_v == (13.0, 17.0)
    assert battery.resistance_factor is not None  # of this the file says nothing


@pytest.mark.parametrize("name", chemistry_names())
def test_every_shipped_kind_of_cell_loads_and_names_its_source(name: str) -> None:
    chemistry = load_chemistry(name)
    assert chemistry.name == name
    assert chemistry.source
    # Between the cut-off and the full charge of every lithium cell with a carbon anode.
    assert 2.4 < chemistry.cell_ocv_v[0] < 3.6
    assert 4.0 < chemistry.cell_ocv_v[-1] < 4.25


def test_the_curve_of_chen_and_rincon_mora_is_their_equation() -> None:
    chemistry = load_chemistry("lipo-2006")
    soc = np.array(chemistry.ocv_soc)
    equation = (
        -1.031 * np.exp(-35.0 * soc) + 3.685 + 0.2156 * soc - 0.1178 * soc**2 + 0.3201 * soc**3
    )
    assert chemistry.cell_ocv_v == pytest.approx(equation, abs=1e-4)  # four decimals are written


@pytest.mark.parametrize("factor", [float("nan"), -1.0, 0.0, float("inf"), 1.1])
def test_only_a_curve_is_scaled_to_a_label(factor: float) -> None:
    with pytest.raises(InvalidValueError, match="label_factor must be positive, and needs ocv_v"):
        Battery(capacity_wh=60.0, label_factor=factor)


def test_a_label_keeps_its_meaning() -> None:
    label, energy = Battery(capacity_ah=5.2, nominal_voltage_v=14.8), Battery(capacity_wh=77.0)
    assert label.energy_wh == pytest.approx(76.96)
    assert (label.charge_ah, label.voltage_v) == (5.2, 14.8)
    assert (energy.energy_wh, energy.charge_ah, energy.voltage_v) == (77.0, None, None)
    assert label.resistance_ohm(20.0) is None


def test_a_table_starts_at_hover_and_saves_no_more_than_was_seen() -> None:
    cruise = CruisePower(speed_m_s=(2.0, 6.0, 8.0), power_above_hover_w=(-5.0, 3.0, 9.0))
    at = np.array([0.0, 1.0, 2.0, 7.0, 10.0])
    # half way to -5 W at 1 m/s; beyond 8 m/s 3 W more for each m/s, as between 6 and 8
    assert cruise.above_hover_w(at) == pytest.approx([0.0, -2.5, -5.0, 6.0, 15.0])
    vertical = VerticalPower(climb_rate_m_s=(-2.0, 1.0), power_above_hover_w=(-20.0, 30.0))
    rates = np.array([-5.0, -1.0, 0.0, 3.0])
    assert vertical.above_hover_w(rates) == pytest.approx([-20.0, -10.0, 0.0, 90.0])
    falling = CruisePower(speed_m_s=(2.0, 6.0), power_above_hover_w=(-5.0, -9.0))
    assert falling.above_hover_w(np.array([20.0])) == pytest.approx([-9.0])


def test_a_law_that_lifts_a_mass_is_not_asked_without_one() -> None:
    law = read(OF_CRUISE, LIU).cruise
    assert isinstance(law, LiuLaw)
    with pytest.raises(ValueError, match="mass"):
        whole_power_w(
            law, airspeed_m_s=0.0, climb_rate_m_s=0.0, mass_kg=None, air_density_kg_m3=1.2
        )
