"""Models from data sheets: what they say of hover, how sure they are, and what is refused.

Expected powers come by hand from the actuator disk, P = (m g)^1.5 / sqrt(2 rho A).
"""

from __future__ import annotations

import datetime as dt
import math
import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_missions import mission, rtl, takeoff, waypoint
from scipy.optimize import brentq

import planner
from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.notation import read_battery
from planner.physics.rotor import Rotor, momentum_power_w
from planner.service.endurance import predict_endurance
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.data_sheet import DataSheet, vehicle_from_data_sheet
from planner.vehicle.figures import read_hover, read_mass, read_motor, read_propeller, read_rotors
from planner.vehicle.pack import flown_pack
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.power import LiuLaw, MomentumLaw, whole_power_w
from planner.vehicle.priors import (
    PublishedHover,
    disk_area_m2,
    fit_hover_cost,
    hover_cost,
    ideal_hover_w,
    multicopter_priors,
    published_hovers,
)
from planner.vehicle.reader import models_root
from planner.vehicle.writer import write_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from planner.vehicle.model import VehicleModel

_IDEAL_W = (1.6 * 9.80665) ** 1.5 / math.sqrt(2.0 * 1.225 * 4.0 * math.pi * 0.127**2)
"""Of 1.6 kg on four rotors of 10 inches at sea level: 88.2 W."""


def _vehicle(**given: Any) -> VehicleModel:  # noqa: ANN401 - any field of a sheet
    known: dict[str, Any] = {
        "name": "mine",
        "mass_kg": 1.6,
        "battery": read_battery("4S5200"),
        "rotors": 4,
        "propeller_m": 0.254,
        "date": dt.date(2026, 11, 23),
    }
    return vehicle_from_data_sheet(DataSheet(**(known | given)))


def _hover_w(vehicle: VehicleModel) -> float:
    """Return the hover power 50 m above sea level, where the air is 0.5 % thinner."""
    hover = predict_endurance(vehicle).hover
    assert hover is not None
    return hover.power_w


def test_the_hover_of_the_sheet_is_the_hover_of_the_model() -> None:
    # the motors take 0.24 % more at 50 m: 0.995 ** -0.5
    assert _hover_w(_vehicle(hover=read_hover("260W"))) == pytest.approx(260.0, rel=0.005)
    # 17.5 A at 14.8 V of the label, less 17.5 A x 19.2 milliohm
    assert _hover_w(_vehicle(hover=read_hover("17.5A"))) == pytest.approx(253.1, rel=0.005)


@pytest.mark.parametrize("label", ["4S5200", "5.2Ah@15.2V", "5Ah@14.4V"])
def test_a_battery_is_the_same_in_the_sheet_and_beside_the_model(label: str) -> None:
    label_wh = {"4S5200": 76.96, "5.2Ah@15.2V": 79.04, "5Ah@14.4V": 72.0}[label]
    given = read_battery(label)
    own = _vehicle(battery=given).battery
    beside = flown_pack(given, None).battery
    for pack in (own, beside, flown_pack(given, own).battery):
        assert pack is not None
        # the curve holds what the label says as well: charge times its mean voltage
        assert pack.ocv_v is not None
        assert pack.ocv_soc is not None
        mean_v = float(np.trapezoid(pack.ocv_v, pack.ocv_soc))
        assert (pack.new_charge_ah or 0.0) * mean_v == pytest.approx(label_wh, rel=1e-3)
        assert pack.energy_wh == pytest.approx(label_wh, rel=1e-3)


def test_a_flight_time_takes_the_share_of_the_battery_that_is_assumed() -> None:
    vehicle = _vehicle(hover=read_hover("18min"))
    assert vehicle.battery is not None
    share = multicopter_priors()["hover_time"].value
    by_hand_w = share * vehicle.battery.energy_wh / 0.3
    assert _hover_w(vehicle) == pytest.approx(by_hand_w, rel=0.005)


def test_an_advertised_longest_flight_time_is_not_that_of_the_hover() -> None:
    priors = multicopter_priors()
    by_hand = priors["hover_longest"].value / priors["hover_time"].value
    longest, hovered = (_vehicle(hover=read_hover(text)) for text in ("18 min max", "18min"))
    assert _hover_w(longest) / _hover_w(hovered) == pytest.approx(by_hand, rel=0.005)
    assert "longest flight time of 18min max" in " ".join(longest.provenance.readings)


def test_figures_as_remembered_make_the_model_less_sure() -> None:
    told = _vehicle(hover=read_hover("18min")).spread
    remembered = _vehicle(hover=read_hover("18min"), remembered=frozenset({"hover"})).spread
    assert told is not None
    assert remembered is not None
    assert told.energy_fraction is not None
    more = multicopter_priors()["remembered"].fraction
    assert remembered.energy_fraction == pytest.approx(
        math.hypot(told.energy_fraction, more), rel=0.01
    )


def test_a_throttle_takes_the_power_of_the_motor_at_the_weight() -> None:
    vehicle = _vehicle(hover=read_hover("40%"), motor=read_motor("1250g@310W"))
    off = multicopter_priors()["motor_table"].value
    assert _hover_w(vehicle) == pytest.approx(off * 4 * 310.0 * (1.6 / 5.0) ** 1.5, rel=0.005)


def test_without_a_figure_it_hovers_like_published_multicopters_of_its_size() -> None:
    cost = hover_cost()
    assert _hover_w(_vehicle()) == pytest.approx(cost.at(0.254) * _IDEAL_W, rel=0.005)
    # a Crazyflie 2.1 is in none of the figures: 27 g on four rotors of 45 mm hover 7 min on 0.25 Ah
    # of 3.7 V (its data sheet), that is 7.9 W for 1.09 ideal ones
    assert cost.at(0.045) == pytest.approx(7.2, rel=0.2)


def test_80_percent_of_published_hovers_are_where_those_of_other_sizes_expect_them() -> None:
    hovers, inside = published_hovers(), 0
    for size in {one.propeller_m for one in hovers}:
        cost = fit_hover_cost([one for one in hovers if one.propeller_m != size])
        # the middle 80 % of Student's t with 12 degrees of freedom, by its table
        widest = 1.356 * cost.fraction
        own = [one for one in hovers if one.propeller_m == size]
        inside += sum(abs(math.log(one.cost / cost.at(size))) < widest for one in own)
    assert 0.75 <= inside / len(hovers) <= 0.90
    assert hover_cost().fraction < 0.15  # wider, and the size of a propeller would say nothing


def _saved(times: dict[str, Any], profile_ratio: float) -> float:
    """Return the least power of level flight over that of the hover, by the likeliest of all else."""
    prior = multicopter_priors()
    mass_kg = times["mass_kg"]
    area_m2 = mass_kg * 9.80665 / prior["disk_loading"].value
    propeller_m = times.get("propeller_m", math.sqrt(area_m2 / math.pi))
    cost = hover_cost().at(propeller_m)
    avionics_w = prior["avionics"].value
    hover_w = cost * ideal_hover_w(mass_kg, 4, propeller_m)
    avionics_w = min(avionics_w, 0.1 * hover_w)
    cost *= 1.0 - avionics_w / hover_w
    rotor = Rotor(
        disk_area_m2=disk_area_m2(4, propeller_m),
        drag_area_m2=prior["drag_per_mass"].value * mass_kg ** (2.0 / 3.0),
        induced_factor=cost / (1.0 + profile_ratio),
        axial_factor=prior["axial_factor"].value,
        profile_factor=cost * profile_ratio / (1.0 + profile_ratio),
        profile_speed_factor=prior["profile_speed_factor"].value,
    )
    speed_m_s = np.linspace(0.0, 15.0, 31)
    power_w = avionics_w + momentum_power_w(
        speed_m_s, 0.0, rotor, mass_kg=mass_kg, air_density_kg_m3=1.225
    )
    return float(power_w.min() / power_w[0])


def test_published_flight_times_say_what_forward_flight_saves() -> None:
    path = models_root() / "priors" / "flight_times.toml"
    drones = tomllib.loads(path.read_text(encoding="utf-8"))
    assert drones.pop("schema") == 1
    logs = []
    for times in drones.values():
        saves = times["hover_min"] / times["longest_min"]
        logs.append(brentq(lambda x, t=times, s=saves: _saved(t, math.exp(x)) - s, -3.0, 3.0))
    prior = multicopter_priors()["profile_ratio"]
    assert prior.value == pytest.approx(math.exp(np.mean(logs)), rel=0.02)
    assert prior.fraction == pytest.approx(np.std(logs, ddof=1), rel=0.05)


def test_an_iris_saves_in_forward_flight_what_was_measured() -> None:
    # the law that Liu, Sengupta and Kurzhanskiy fitted to flights of theirs (ICUAS 2017)
    measured = LiuLaw(
        k1=0.8554, k2_sqrt_kg_m=0.3051, c2_sqrt_m_kg=0.3177, c4_kg_m=0.0296, c5_kg_m=0.0279
    )
    speed_m_s = np.linspace(0.0, 12.0, 25)
    power_w = measured.power_w(speed_m_s, 0.0, 1.28)
    saves = float(power_w.min() / power_w[0])
    iris = planner.load_vehicle("3dr-iris-plus")
    assert isinstance(iris.cruise, MomentumLaw)
    assert iris.spread is not None
    own_w = whole_power_w(
        iris.cruise, airspeed_m_s=speed_m_s, climb_rate_m_s=0.0, mass_kg=1.28, air_density_kg_m3=1.2
    )
    off = math.log(float(own_w.min() / own_w[0]) / saves)
    # within the middle 80 % of what the model says of level flight beside hover
    assert abs(off) < 1.28 * dict(iris.spread.energy_state_fraction)["cruise"]


def test_hovers_on_one_law_leave_no_spread() -> None:
    def hover(propeller_m: float, off: float = 1.0) -> PublishedHover:
        cost = off * (1.4 + 0.25 / propeller_m)
        return PublishedHover(name="one", propeller_m=propeller_m, cost=cost)

    sizes = (0.15, 0.25, 0.4, 0.8)
    cost = fit_hover_cost([hover(size) for size in sizes])
    assert cost.constant == pytest.approx(1.4)
    assert cost.per_diameter_m == pytest.approx(0.25)
    assert cost.fraction == pytest.approx(0.0, abs=1e-9)
    # two of one size, 10 % dearer and cheaper, count as one: of four sizes that alone is far off
    pair = [hover(0.25, 1.1), hover(0.25, 0.9)]
    apart = fit_hover_cost([hover(size) for size in (*sizes, 0.3, 0.5, 0.6) if size != 0.25] + pair)
    assert apart.sizes == 7
    assert apart.fraction == pytest.approx(0.1 / math.sqrt(7.0), rel=0.05)


def test_less_is_known_the_wider_the_spread() -> None:
    def fraction(**given: Any) -> float:  # noqa: ANN401 - any field of a sheet
        spread = _vehicle(**given).spread
        assert spread is not None
        assert spread.energy_fraction is not None
        return spread.energy_fraction

    measured, timed = fraction(hover=read_hover("260W")), fraction(hover=read_hover("18min"))
    no_hover, no_propeller = fraction(), fraction(propeller_m=None)
    assert measured < timed < no_hover < no_propeller < fraction(propeller_m=None, mass_kg=None)


def test_what_is_assumed_is_listed_with_its_source() -> None:
    readings = " ".join(_vehicle().provenance.readings)
    for word in ("flown by ArduPilot", "drag area", "avionics", "published", "Leishman"):
        assert word in readings
    assert "published" not in " ".join(_vehicle(hover=read_hover("260W")).provenance.readings)


def test_the_file_reads_back_as_the_model(tmp_path: Path) -> None:
    vehicle = _vehicle(autopilot=Autopilot.PX4)
    write_vehicle(tmp_path / "mine.toml", vehicle)
    read = planner.load_vehicle(tmp_path / "mine.toml")
    assert (read.cruise, read.battery, read.spread) == (
        vehicle.cruise,
        vehicle.battery,
        vehicle.spread,
    )


def test_parameters_give_autopilot_battery_speed_and_throttle() -> None:
    text = b"WPNAV_SPEED,800\nBATT_CAPACITY,5200\nMOT_BAT_VOLT_MAX,16.8\nMOT_THST_HOVER,0.4\n"
    parameters = parameters_from_text(text, source="my.param")
    vehicle = _vehicle(battery=None, parameters=parameters, motor=read_motor("1250g@310W"))
    assert vehicle.reference is Autopilot.ARDUPILOT
    assert ("WPNAV_SPEED", 800.0) in vehicle.parameters
    assert vehicle.battery is not None
    assert (vehicle.battery.capacity_ah, vehicle.battery.cells_in_series) == (5.2, 4)
    assert "motor's table" in " ".join(vehicle.provenance.readings)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"mass_kg": 1600.0}, "are 1600 kg and 0.254 m of diameter what is meant"),
        ({"mass_kg": 0.016}, "for each m² of disk"),
        ({"battery": read_battery("520Ah@14.8V")}, "weighs 20.3 kg at least"),
        ({"battery": read_battery("0.52Ah@14.8V")}, "faster than any battery bears"),
        ({"battery": read_battery("5.2Ah@16.8V")}, "4 full cells, not their nominal voltage"),
        ({"battery": read_battery("77Wh")}, "give charge and cells"),
        # 88.2 W of the ideal disk; the avionics have 6 W, of so little a tenth
        ({"hover": read_hover("80W")}, "80 W is less than the 94 W"),
        ({"hover": read_hover("90min")}, "less than the 93 W"),
        ({"hover": read_hover("94W")}, "less than the 94 W"),
        # 88.2 W over 0.75 and 6 W are 123.6 W
        (
            {"hover": read_hover("123W")},
            "of the battery's power into lift; no multicopter reaches 75 %",
        ),
        ({"hover": read_hover("2000A")}, "more than half of the battery's voltage"),
        ({"battery": read_battery("5.2Ah@12.6V")}, "that of 3 full cells.*as 3S5200"),
        ({"battery": read_battery("5.2Ah@25.2V")}, "6 full cells or of 7 lithium-ion cells"),
        ({"motor": read_motor("390g@60W")}, r"4 motors of 1\.56 kg of thrust in all do not lift"),
        ({"mass_max_kg": 1.5}, "above the highest that its maker allows"),
        ({"hover": read_hover("2600W")}, "times the"),
        ({"hover": read_hover("38%")}, "needs the motor"),
        ({"hover": read_hover("38%"), "motor": read_motor("4500g@900W")}, "correct one of them"),
        ({"battery": None, "hover": read_hover("18A")}, "no power without the battery"),
        ({"battery": None, "mass_kg": None}, "give the take-off mass"),
        ({"autopilot": Autopilot.STEP}, "identify it from a"),
        (
            {"moves_like": planner.load_vehicle("px4-quad-2kg")},
            r"moves like a model with \[ramps\]",
        ),
    ],
)
def test_what_cannot_fly_is_refused_with_the_physics(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        _vehicle(**given)


def test_a_hover_power_may_be_in_kilowatts() -> None:
    assert read_hover("4kW") == read_hover("4 KW") == read_hover("4000W")
    with pytest.raises(ValueError, match="expected a current"):
        read_hover("4kA")


def test_a_hover_that_few_have_is_taken_with_a_word() -> None:
    word = "of what published multicopters take"
    assert word in " ".join(_vehicle(hover=read_hover("130W")).provenance.readings)
    assert word not in " ".join(_vehicle(hover=read_hover("180W")).provenance.readings)


def test_a_hover_better_than_published_ones_is_doubted_by_as_much() -> None:
    # 1.6 kg on four of 10 in: an ideal disk of 88 W, published multicopters 1.332 + 0.2740 / 0.254 = 2.41
    # times that, 211 W, from which 130 W are a factor of 1.62, and 180 W one of 1.17
    assert _hover_doubt("130W") == pytest.approx(math.log(211.0 / 130.0), abs=0.01)
    # from two thirds of the usual on, 141 W, a figure is as sure as any
    assert _hover_doubt("145W") == _hover_doubt("180W") < 0.1


def _hover_doubt(figure: str) -> float:
    spread = _vehicle(hover=read_hover(figure)).spread
    assert spread is not None
    return dict(spread.law_fraction)["hover"]


def test_a_throttle_is_of_the_thrust_or_of_the_signal() -> None:
    # 1.6 kg under 5 kg of thrust: 32 % of it, the signal of u with 0.35 u + 0.65 u^2 = 0.32 is 48 %
    motor = read_motor("1250g@310W")
    watts = {_hover_w(_vehicle(hover=read_hover(text), motor=motor)) for text in ("32%", "48%")}
    assert len(watts) == 1
    for text in ("20%", "75%"):  # 1 kg at most, 3.1 kg at least
        with pytest.raises(UsageError, match=r"the vehicle weighs 1\.60 kg"):
            _vehicle(hover=read_hover(text), motor=motor)


@pytest.mark.parametrize(
    ("given", "most_kg"),
    [
        ({"motor": "1250g@310W"}, 5.0),  # four of them
        ({"motor": "1250g@310W", "hover": "18A"}, 5.0),
        (
            {"motor": "1250g@310W", "hover": "40%"},
            4.0,
        ),  # 1.6 kg are 40 % of it, less than the motors'
        ({"motor": "1250g@310W", "hover": "28%"}, 5.0),  # of 5.7 kg: the motors have less
        ({"hover": "18A"}, None),
    ],
)
def test_the_thrust_of_the_motors_is_kept(given: dict[str, str], most_kg: float | None) -> None:
    read = {"motor": read_motor, "hover": read_hover}
    vehicle = _vehicle(**{name: read[name](text) for name, text in given.items()})
    if most_kg is None:
        assert vehicle.thrust_max_n is None
    else:
        assert vehicle.thrust_max_n == pytest.approx(most_kg * 9.80665, rel=1e-3)  # four digits


def test_a_vehicle_is_held_to_lift_what_its_maker_says_or_what_nearly_all_do() -> None:
    # 1 / 0.6 of the thrust at take-off, of which 0.8 leaves the lean that ArduPilot needs: 1.33 times
    unknown = _vehicle().valid_for
    assert unknown.mass_kg is not None
    assert unknown.mass_kg.high == pytest.approx(1.6 * 0.8 / 0.6, rel=5e-3)
    assert unknown.air_density_kg_m3 is not None
    assert unknown.air_density_kg_m3.low == pytest.approx(1.225 * 0.6 / 0.8, rel=5e-3)
    # 0.819 kg/m³ at 4000 m by the standard atmosphere's table
    stated = _vehicle(mass_max_kg=2.5, ceiling_amsl_m=4000.0).valid_for
    assert stated.mass_kg is not None
    assert stated.mass_kg.high == 2.5
    assert stated.air_density_kg_m3 is not None
    assert stated.air_density_kg_m3.low == pytest.approx(0.819, abs=5e-4)


def test_propellers_that_few_have_are_taken_with_a_word() -> None:
    # 1.6 kg on four of 4 in: 484 N/m², where one multicopter in ten has more than 110
    word = "N for each m² of disk, 8 of 10 multicopters have"
    assert word in " ".join(_vehicle(propeller_m=0.1016, hover=None).provenance.readings)
    assert word not in " ".join(_vehicle().provenance.readings)


def test_cells_that_parameters_contradict_are_refused() -> None:
    parameters = parameters_from_text(b"BAT1_N_CELLS,6\nMPC_XY_CRUISE,5\n", source="my.params")
    with pytest.raises(UsageError, match="has 4 cells, BAT1_N_CELLS says 6"):
        _vehicle(parameters=parameters)


def test_units_that_people_write_are_read() -> None:
    assert read_mass("3500g") == read_mass("3.5") == read_mass("3.5 kg") == pytest.approx(3.5)
    assert read_mass("2lb") == pytest.approx(0.90718474)
    assert read_propeller("10in") == read_propeller("10") == read_propeller("254mm")
    assert read_propeller("10x4.5") == read_propeller("10 inch") == read_propeller('10x4.5"')
    assert read_battery("4S5200") == read_battery("5200mAh@4S") == read_battery("4S5.2Ah")
    assert read_battery("4S5200@14.8V") == read_battery("4S5200")
    assert read_battery("4S5200@15.2V") == read_battery("5.2Ah@15.2V")
    with pytest.raises(ValueError, match=r"4 cells in series have 14\.2 to 15\.6 V, not 11\.1 V"):
        read_battery("4S5200@11.1V")
    for text, reader in (
        ("3 stone", read_mass),
        ("18", read_hover),
        ("0W", read_hover),
        ("120%", read_hover),
        ("1600", read_mass),
        ("1,6kg", read_mass),
        ("1045", read_propeller),
        ("0", read_rotors),
        ("-4", read_rotors),
        ("3.5", read_rotors),
        ("four", read_rotors),
    ):
        with pytest.raises(ValueError, match=r"expected|above 0|below 100|write"):
            reader(text)


# 2 km at the 5 m/s that PX4 flies as delivered (MPC_XY_CRUISE), or at 10 m/s of ArduPilot (WPNAV_SPEED).
@pytest.mark.parametrize(
    ("sheet_says", "asked", "mission_says", "parameters", "flown_by"),
    [
        (None, None, Autopilot.PX4, "", Autopilot.PX4),
        (None, None, None, "MPC_XY_CRUISE,5\n", Autopilot.PX4),
        (None, None, Autopilot.ARDUPILOT, "", Autopilot.ARDUPILOT),
        (None, None, None, "", Autopilot.ARDUPILOT),
        (None, Autopilot.ARDUPILOT, Autopilot.PX4, "", Autopilot.ARDUPILOT),
        (Autopilot.ARDUPILOT, None, Autopilot.PX4, "", Autopilot.ARDUPILOT),
    ],
)
def test_an_assumed_autopilot_gives_way_to_the_one_that_is_named(
    sheet_says: Autopilot | None,
    asked: Autopilot | None,
    mission_says: Autopilot | None,
    parameters: str,
    flown_by: Autopilot,
) -> None:
    out = mission(takeoff(30), waypoint(2000, 30), waypoint(2100, 30), rtl())
    given = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    result = check(
        replace(out, autopilot=mission_says),
        _vehicle(autopilot=sheet_says),
        battery=read_battery("4000Wh"),
        parameters=given,
        autopilot=asked,
    )
    begin_s, end_s = (one.arrival_s or 0.0 for one in result.items[:2])
    assert end_s - begin_s == pytest.approx(400.0 if flown_by is Autopilot.PX4 else 200.0, rel=0.06)
    told = [one.message for one in result.findings if one.code == "M109"]
    is_silent = mission_says in {None, flown_by} and flown_by is Autopilot.ARDUPILOT
    assert bool(told) is not is_silent


# Frames that are sold without an autopilot, or flown by others as well; products keep theirs.
@pytest.mark.parametrize("written_for", [Autopilot.PX4, Autopilot.ARDUPILOT])
@pytest.mark.parametrize(
    ("name", "flown_by"),
    [
        ("dji-f450", None),
        ("3dr-iris-plus", None),
        ("racer-5-inch", None),
        ("holybro-x500-v2", None),
        ("holybro-s500-v2", None),
        ("3dr-solo", Autopilot.ARDUPILOT),
        ("arducopter-sitl-quad", Autopilot.ARDUPILOT),
        ("freefly-astro", Autopilot.PX4),
        ("yuneec-h520", Autopilot.PX4),
        ("px4-quad-2kg", Autopilot.PX4),
    ],
)
def test_frames_without_an_autopilot_are_flown_by_that_of_the_mission(
    name: str, flown_by: Autopilot | None, written_for: Autopilot
) -> None:
    out = replace(mission(takeoff(30), waypoint(200, 30), rtl()), autopilot=written_for)
    result = check(out, planner.load_vehicle(name), battery=read_battery("4000Wh"))
    assert result.setup.flown_by is (flown_by or written_for)


def test_a_model_whose_autopilot_is_assumed_has_what_px4_shows_of_a_vehicle() -> None:
    # 20 lanes of 25 m at the 5 m/s of PX4: its lag behind their turns takes time by the drag.
    lanes = [waypoint(25 * (n % 2), 30) for n in range(40)]
    survey = replace(mission(takeoff(30), *lanes, rtl()), autopilot=Autopilot.PX4)
    assumed, stated = (
        check(survey, _vehicle(autopilot=asked), battery=read_battery("4000Wh"))
        for asked in (None, Autopilot.PX4)
    )
    assert assumed.totals == stated.totals
