"""Family E: energy, the battery, what the model knows."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from fenced_missions import rally
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint
from made_terrain import ground
from rule_cases.case import ARDUPILOT, PLAIN, PLENTY, PX4, STEP, RuleCases, found, vehicle_of

from planner.physics.wind import Wind
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import Basis, ModelSpread, Responses
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.service.preflight import CheckResult
    from planner.vehicle.model import VehicleModel

OUT_AND_BACK = mission(takeoff(100), waypoint(1000, 100), rtl())
ONE_WAY = mission(takeoff(100), waypoint(1000, 100))
PACK = Battery(
    capacity_ah=5.0,
    cells_in_series=6,
    internal_resistance_ohm=0.04,
    ocv_soc=(0.0, 0.5, 1.0),
    ocv_v=(21.0, 22.3, 25.1),
    cutoff_voltage_v=15.0,
)
SPREAD = ModelSpread(n_flights=1_000_000, source="made", energy_fraction=0.05)
CAUTIOUS = replace(vehicle_of(STEP), spread=SPREAD)
LAGGING = Responses(speed=vehicle_of(STEP).responses.speed)
NEED_WH = check(OUT_AND_BACK, vehicle_of(STEP), battery=PLENTY).totals.energy_wh


def of_basis(basis: Basis) -> VehicleModel:
    """Return a model of PX4's with power and spread that rests on something."""
    model = load_vehicle("px4-quad-2kg")
    return replace(model, provenance=replace(model.provenance, basis=basis))


def hovering_at(efficiency: float, *, basis: Basis = Basis.THEORY) -> tuple[Finding, ...]:
    """Return what is reported of a model whose hover is so near that of the ideal disk."""
    model = of_basis(basis)
    assert isinstance(model.cruise, MomentumLaw)
    law = replace(model.cruise, induced_factor=1.0 / efficiency - 0.2, profile_factor=0.2)
    return found(OUT_AND_BACK, PX4, vehicle=replace(model, cruise=law))


def slowing_to(speed_m_s: float) -> tuple[Finding, ...]:
    """Return what is reported where 8 m/s become less at a waypoint that is flown through."""
    legs = takeoff(20), speed(8.0), waypoint(100, 20), speed(speed_m_s), waypoint(400, 20), rtl()
    return found(mission(*legs), ARDUPILOT)


def of_capacity(share_of_need: float) -> tuple[Finding, ...]:
    """Return what is reported with a battery of so much of the energy needed, and no reserve."""
    return found(OUT_AND_BACK, battery=Battery(capacity_wh=NEED_WH * share_of_need), reserve=0.0)


def over_ridge(rise_m: float, autopilot: Autopilot = STEP) -> tuple[Finding, ...]:
    """Return what is reported of a flight that keeps its height above a ridge."""
    there = item(16, north(900.0), 30.0, frame=10)
    one = mission(takeoff(30), there, item(21, north(900.0)), autopilot=ARDUPILOT)
    return found(one, autopilot, terrain=ground(rise_m))


RIDGE_M, HOVER_W = 40.0, 353.0
"""The hover is that of the recordings. [m], [W]"""


def over_ground(
    grid: TerrainGrid, extra_wh: float, parameters: str = "RTL_ALT_TYPE,1\n"
) -> tuple[Finding, ...]:
    """Return what is reported of a flight 900 m north whose returns have so much to spare. [Wh]"""
    one = mission(takeoff(60), waypoint(900.0, 60), item(21, north(900.0)), autopilot=ARDUPILOT)
    given = parameters_from_text(f"{parameters}BATT_MONITOR,0\n".encode(), source="p.param")

    def judged(capacity_wh: float) -> CheckResult:
        return check(
            one,
            vehicle_of(ARDUPILOT),
            battery=Battery(capacity_wh=capacity_wh),
            reserve=0.0,
            parameters=given,
            terrain=grid,
        )

    capacity_wh = 170.0
    for _ in range(4):  # a smaller battery loses more
        way = judged(capacity_wh).return_plan
        assert way is not None
        capacity_wh += extra_wh - (way.margin_wh or 0.0)
    return judged(capacity_wh).findings


def followed_wh(climbed_m: float, hover_s: float) -> float:
    """Return the energy of climbs, with m g over an efficiency of 0.5, and of a hover. [Wh]"""
    mass_kg = vehicle_of(ARDUPILOT).mass_kg or 0.0
    return (mass_kg * 9.80665 / 0.5 * climbed_m + HOVER_W * hover_s) / 3600.0


def over_ridge_and_back(covered: float, follows: int = 1) -> tuple[Finding, ...]:
    """Return what is reported where the margin of a return covers so much of what a ridge takes.

    It climbs 40 m at 2.5 m/s and descends them at 1.5 m/s: both sides are 10 m long, for which 10 m/s are
    predicted.
    """
    extra_wh = followed_wh(RIDGE_M, RIDGE_M / 2.5 - 1.0 + RIDGE_M / 1.5 - 1.0)
    return over_ground(ground(RIDGE_M), covered * extra_wh, f"RTL_ALT_TYPE,{follows}\n")


@cache
def return_wh() -> float:
    """Return the energy that reaching the far end and returning from it takes. [Wh]"""
    way = check(ONE_WAY, vehicle_of(STEP), battery=PLENTY, reserve=0.0).return_plan
    assert way is not None
    assert way.margin_wh is not None
    return PLENTY.energy_wh - way.margin_wh


def one_way(margin_wh: float) -> tuple[Finding, ...]:
    """Return what is reported of a flight that ends so far from being unable to return."""
    return found(ONE_WAY, battery=Battery(capacity_wh=return_wh() + margin_wh), reserve=0.0)


def at_most_s(longer_s: float) -> tuple[Finding, ...]:
    """Return what PX4's check tells where it may fly so much longer than the flight takes."""
    quad = vehicle_of(ARDUPILOT)
    time_s = check(ONE_WAY, quad, autopilot=PX4).totals.time_s
    return found(ONE_WAY, PX4, f"COM_FLT_TIME_MAX,{time_s + longer_s!r}\n", vehicle=quad)


def lands_at(times: float) -> tuple[Finding, ...]:
    """Return what PX4's check tells where it lands at what so many times the way out would leave."""
    quad = replace(vehicle_of(ARDUPILOT), spread=None)
    items = check(PLAIN, quad, autopilot=PX4, battery=PLENTY).items
    used_wh = next(one.energy_used_wh or 0.0 for one in items if one.item == 2)
    left = 1.0 - times * used_wh / PLENTY.energy_wh
    text = f"BAT_CRIT_THR,{left!r}\nBAT_LOW_THR,0.01\nBAT_EMERGEN_THR,0.005\nCOM_LOW_BAT_ACT,2\n"
    return found(PLAIN, PX4, text, vehicle=quad)


@cache
def with_pack() -> CheckResult:
    """Return the check of a flight with a battery whose curve is known."""
    return check(PLAIN, vehicle_of(ARDUPILOT), battery=PACK)


def lowest_v() -> float:
    """Return the lowest voltage under load of that flight and of the returns from it. [V]"""
    assessment = with_pack().assessment
    assert assessment is not None
    assert assessment.discharge is not None
    assert assessment.return_discharge is not None
    returns_v = assessment.return_discharge.lowest_voltage_v
    return min(assessment.discharge.lowest_voltage_v, float(returns_v.min()))


def highest_rate() -> float:
    """Return its highest current over the charge. [1/h]"""
    budget = with_pack().battery
    assert budget is not None
    assert budget.highest_c_rate is not None
    return budget.highest_c_rate


def hover_throttle(share: float) -> tuple[Finding, ...]:
    """Return what is reported where a hover takes such a share of the thrust, whatever the charge."""
    stiff = replace(PACK, ocv_v=(25.1 - 2e-12, 25.1 - 1e-12, 25.1), internal_resistance_ohm=0.0)
    # At sea level the air is no thinner than that the model is known in.
    given = f"MOT_THST_HOVER,{share!r}\n"
    return found(PLAIN, ARDUPILOT, given, battery=stiff, home_amsl_m=0.0)


def at_speed(speed_m_s: float) -> tuple[Finding, ...]:
    """Return what is reported of a flight at a speed; hover power is known from 70 m up."""
    return found(mission(takeoff(100), speed(speed_m_s), waypoint(900, 100), rtl()))


def charged(fraction: float, **values: float) -> tuple[Finding, ...]:
    """Return what PX4's check tells of a battery that is not full."""
    text = "".join(f"{name},{value!r}\n" for name, value in values.items())
    quad = vehicle_of(ARDUPILOT)
    return found(PLAIN, PX4, text, vehicle=quad, charge=fraction)


def with_rally(north_m: float) -> tuple[Finding, ...]:
    """Return what is reported of a rally point on the line of flight."""
    one = replace(mission(takeoff(20), waypoint(200, 20), rtl()), rally=(rally(0.0, north_m),))
    return found(one, ARDUPILOT)


@cache
def below_reserve() -> float:
    """Return the chance to land below the reserve with a margin of one standard deviation. [-]"""
    budget = check(OUT_AND_BACK, CAUTIOUS, battery=Battery(capacity_wh=NEED_WH * 1.05 / 0.8))
    assert budget.battery is not None
    assert budget.battery.below_reserve_probability is not None
    return budget.battery.below_reserve_probability


def at_risk(more: float) -> tuple[Finding, ...]:
    """Return what is reported where so much more than the chance there is may be taken."""
    battery = Battery(capacity_wh=NEED_WH * 1.05 / 0.8)
    return found(OUT_AND_BACK, battery=battery, vehicle=CAUTIOUS, risk=below_reserve() + more)


def lifting(times: float) -> tuple[Finding, ...]:
    """Return what is reported of so many times the mass of a model that knows no thrust, in its air."""
    quad = vehicle_of(ARDUPILOT)
    untold = tuple(one for one in quad.parameters if one[0] != "MOT_THST_HOVER")
    known = replace(
        quad, valid_for=replace(quad.valid_for, air_density_kg_m3=None), parameters=untold
    )
    assert quad.mass_kg is not None
    # 1.225 kg/m³ at the highest point, 20 m up: a warmer day than the standard one at sea level.
    return found(
        PLAIN, ARDUPILOT, vehicle=known, payload_kg=(times - 1.0) * quad.mass_kg, home_amsl_m=-20.0
    )


def from_altitude(home_m: float) -> tuple[Finding, ...]:
    """Return what is reported of a take-off of a vehicle whose maker allows it up to 1,000 m."""
    return found(
        PLAIN,
        ARDUPILOT,
        vehicle=replace(vehicle_of(ARDUPILOT), ceiling_amsl_m=1000.0),
        home_amsl_m=home_m,
    )


def with_share_of_voltage(share: float) -> tuple[Finding, ...]:
    """Return what is reported of a battery with such a share of the voltage of the vehicle's own."""
    own = vehicle_of(ARDUPILOT).battery
    assert own is not None
    assert own.voltage_v is not None
    return of_voltage(share * own.voltage_v)


def of_voltage(voltage_v: float) -> tuple[Finding, ...]:
    """Return what is reported of a battery with a voltage; the vehicle's own has six cells."""
    battery = Battery(capacity_ah=100.0, nominal_voltage_v=voltage_v)
    return found(PLAIN, ARDUPILOT, battery=battery)


def set_to(share: float, others: str = "") -> tuple[Finding, ...]:
    """Return what is reported of a vehicle set to such a share of the charge of its 8 Ah battery."""
    battery = Battery(capacity_ah=8.0, nominal_voltage_v=22.2)
    return found(PLAIN, ARDUPILOT, f"BATT_CAPACITY,{share * 8000.0!r}\n{others}", battery=battery)


# One flight of a hundred is 2.3263 standard deviations beyond its prediction.
ONE_OF_A_HUNDRED = 1.0 + 0.05 * 2.3263478740


def labelled(charge_ah: float, voltage_v: float) -> tuple[Finding, ...]:
    """Return what is reported of a battery given by its label, to a model without one."""
    return found(PLAIN, battery=Battery(capacity_ah=charge_ah, nominal_voltage_v=voltage_v))


def weighing(fraction: float) -> tuple[Finding, ...]:
    """Return what is reported of a battery that is such a fraction of the model's 3.5 kg at 380 Wh/kg."""
    return found(PLAIN, ARDUPILOT, battery=Battery(capacity_wh=fraction * 3.5 * 380.0))


CASES: Mapping[str, RuleCases] = {
    "E100": RuleCases(
        fires=lambda: found(PLAIN, battery=None),
        boundary=lambda: found(PLAIN, battery=Battery(capacity_wh=0.001)),
        silent=lambda: found(PLAIN),
    ),
    "E101": RuleCases(
        fires=lambda: of_capacity(1.0 - 1e-6),
        shown=lambda: found(OUT_AND_BACK, battery=Battery(capacity_wh=NEED_WH)),
        boundary=lambda: of_capacity(1.0),
        silent=lambda: of_capacity(1.0 + 1e-6),
    ),
    "E102": RuleCases(
        fires=lambda: one_way(-0.001),
        shown=lambda: one_way(-1.0),
        boundary=lambda: one_way(1e-9),
        silent=lambda: one_way(0.001),
    ),
    "E128": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "BATT2_MONITOR,4\nBATT2_LOW_VOLT,14\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "BATT2_MONITOR,0\nBATT2_LOW_VOLT,14\n"),
        silent=lambda: found(PLAIN, PX4, "BAT2_SOURCE,-1\n"),
    ),
    "E103": RuleCases(
        fires=lambda: at_most_s(-0.01),
        boundary=lambda: at_most_s(0.0),
        silent=lambda: at_most_s(0.01),
    ),
    "E134": RuleCases(
        fires=lambda: lands_at(1.65),
        boundary=lambda: lands_at(1.8),  # 1.116 times is where it comes down at home
        silent=lambda: lands_at(2.5),
    ),
    "E104": RuleCases(
        fires=lambda: found(
            PLAIN, ARDUPILOT, battery=replace(PACK, cutoff_voltage_v=lowest_v() + 0.01)
        ),
        boundary=lambda: found(
            PLAIN, ARDUPILOT, battery=replace(PACK, cutoff_voltage_v=lowest_v())
        ),
        silent=lambda: found(
            PLAIN, ARDUPILOT, battery=replace(PACK, cutoff_voltage_v=lowest_v() - 0.01)
        ),
    ),
    "E105": RuleCases(
        fires=lambda: at_speed(10.1), boundary=lambda: at_speed(10.0), silent=lambda: at_speed(9.9)
    ),
    "E106": RuleCases(
        fires=lambda: with_rally(-1.0),
        boundary=lambda: with_rally(0.0),  # as near as home: ArduPilot takes the rally point
        silent=lambda: with_rally(1.0),
    ),
    "E107": RuleCases(
        fires=lambda: found(OUT_AND_BACK),
        # 20 m are flown in one acceleration and one stop.
        boundary=lambda: found(mission(takeoff(100), waypoint(20, 100), rtl())),
        silent=lambda: found(PLAIN, ARDUPILOT),
    ),
    "E108": RuleCases(
        fires=lambda: found(OUT_AND_BACK, wind=Wind(speed_m_s=0.1)),
        boundary=lambda: found(OUT_AND_BACK, wind=Wind(speed_m_s=0.0)),
        silent=lambda: found(PLAIN, ARDUPILOT, wind=Wind(speed_m_s=0.1)),
    ),
    "E109": RuleCases(
        fires=lambda: found(PLAIN, PX4),
        boundary=lambda: found(OUT_AND_BACK),  # only the power of a cruise is not known: E107
        silent=lambda: found(PLAIN, ARDUPILOT),
    ),
    "E110": RuleCases(
        fires=lambda: found(
            PLAIN, ARDUPILOT, battery=replace(PACK, max_c_rate=highest_rate() - 0.01)
        ),
        boundary=lambda: found(PLAIN, ARDUPILOT, battery=replace(PACK, max_c_rate=highest_rate())),
        silent=lambda: found(PLAIN, ARDUPILOT, battery=PACK),
    ),
    "E111": RuleCases(
        fires=lambda: found(PLAIN, PX4, vehicle=replace(vehicle_of(PX4), responses=LAGGING)),
        boundary=lambda: found(PLAIN, PX4, vehicle=replace(vehicle_of(PX4), responses=Responses())),
        silent=lambda: found(
            PLAIN, ARDUPILOT, vehicle=replace(vehicle_of(ARDUPILOT), responses=LAGGING)
        ),
    ),
    "E114": RuleCases(
        fires=lambda: charged(0.5, COM_ARM_BAT_MIN=0.501, BAT1_V_EMPTY=3.0),
        boundary=lambda: charged(0.5, COM_ARM_BAT_MIN=0.5, BAT1_V_EMPTY=3.0),
        silent=lambda: charged(0.5, COM_ARM_BAT_MIN=0.499, BAT1_V_EMPTY=3.0),
    ),
    "E116": RuleCases(
        fires=lambda: hover_throttle(0.701),
        boundary=lambda: hover_throttle(0.7 - 1e-12),
        silent=lambda: hover_throttle(0.699),
    ),
    "E119": RuleCases(
        fires=lambda: at_risk(-1e-9),
        shown=lambda: at_risk(0.05 - below_reserve()),
        boundary=lambda: at_risk(0.0),
        silent=lambda: at_risk(0.01),
    ),
    "E120": RuleCases(
        # A third heavier than the 3.5 kg of the model, in air as thin as it knows.
        fires=lambda: lifting(1.34),
        boundary=lambda: lifting(1.33 - 1e-9),
        silent=lambda: lifting(1.0),
    ),
    "E133": RuleCases(
        fires=lambda: from_altitude(1001.0),
        boundary=lambda: from_altitude(1000.0),
        silent=lambda: from_altitude(400.0),
    ),
    "E121": RuleCases(
        fires=lambda: with_share_of_voltage(0.849),
        boundary=lambda: with_share_of_voltage(0.85 + 1e-12),
        silent=lambda: with_share_of_voltage(1.0),
    ),
    "P111": RuleCases(
        fires=lambda: set_to(1.251),
        boundary=lambda: set_to(1.25 - 1e-9),
        silent=lambda: set_to(1.0),
    ),
    "E122": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, temperature_c=-0.1),
        boundary=lambda: found(PLAIN, ARDUPILOT, temperature_c=0.0),
        silent=lambda: found(PLAIN, ARDUPILOT, temperature_c=-0.1, battery_temperature_c=20.0),
    ),
    "E123": RuleCases(
        fires=lambda: weighing(0.667),
        boundary=lambda: weighing(2.0 / 3.0 - 1e-9),
        silent=lambda: weighing(0.666),
    ),
    "E124": RuleCases(
        fires=lambda: of_capacity(ONE_OF_A_HUNDRED - 1e-6),
        shown=lambda: of_capacity(1.05),
        boundary=lambda: of_capacity(ONE_OF_A_HUNDRED + 1e-9),
        silent=lambda: of_capacity(1.12),
    ),
    "E125": RuleCases(
        fires=lambda: labelled(5.2, 14.8),
        # Four cells of 3.9 V are the highest that is one; 15.7 V are neither four nor five.
        boundary=lambda: labelled(5.2, 15.7),
        silent=lambda: found(PLAIN),
    ),
    # 125 W of hover are 1.56 kg at 80 W/kg: 30.7 J a metre at an efficiency of 0.5; 1 % of 5.68 Wh are 6.7 m.
    "E127": RuleCases(
        fires=lambda: over_ridge(7.0),
        boundary=lambda: over_ridge(6.5),
        silent=lambda: over_ridge(7.0, ARDUPILOT),
    ),
    "E131": RuleCases(
        fires=lambda: found(replace(PLAIN, unstated_wait_s=6.0)),
        boundary=lambda: found(replace(PLAIN, unstated_wait_s=0.0)),
        silent=lambda: found(PLAIN),
    ),
    "E130": RuleCases(
        fires=lambda: found(OUT_AND_BACK, PX4, vehicle=of_basis(Basis.DATA_SHEET)),
        boundary=lambda: found(OUT_AND_BACK, PX4, vehicle=of_basis(Basis.REFINED)),
        silent=lambda: found(OUT_AND_BACK, PX4, vehicle=of_basis(Basis.ARTICLE)),
    ),
    "E132": RuleCases(
        fires=lambda: hovering_at(0.751),
        boundary=lambda: hovering_at(0.75 - 1e-9),
        silent=lambda: hovering_at(0.751, basis=Basis.REFINED),
    ),
    "E129": RuleCases(
        fires=lambda: over_ridge_and_back(0.99),
        boundary=lambda: over_ridge_and_back(1.01),
        silent=lambda: over_ridge_and_back(0.99, follows=0),
    ),
    # Straight on from 8 m/s the change comes in the middle of 0.4 s of 2.5 m/s²: 7.5 m/s are reached.
    "E126": RuleCases(
        fires=lambda: slowing_to(7.34),
        boundary=lambda: slowing_to(7.351),
        silent=lambda: slowing_to(7.36),
    ),
}
