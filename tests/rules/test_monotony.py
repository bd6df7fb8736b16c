"""What may never make a flight look cheaper, for any mission and any vehicle that flies it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from typing import Any

    from planner.mission.items import Mission
    from planner.service.preflight import CheckResult
    from planner.vehicle.model import VehicleModel

ARTICLE = load_vehicle("falkowski-2023-quadrotor")
SURVEYOR = replace(load_vehicle("arducopter-sitl-quad"), battery=None)
MATRICE = replace(load_vehicle("dji-matrice-100"), battery=None)
FLOWN = (
    (ARTICLE, Autopilot.STEP),
    (SURVEYOR, Autopilot.ARDUPILOT),
    (SURVEYOR, Autopilot.PX4),
    (MATRICE, MATRICE.reference),
)
PACK = Battery(
    capacity_ah=20.0,
    cells_in_series=6,
    internal_resistance_ohm=0.02,
    ocv_soc=(0.0, 0.1, 0.5, 0.9, 1.0),
    ocv_v=(19.8, 21.4, 22.3, 24.5, 25.1),
    resistance_temperature_c=(-10.0, 0.0, 20.0),
    resistance_factor=(3.0, 2.0, 1.0),
)
ROUNDING_WH = 1e-6
"""Energies are sums of thousands of parts."""

flights = st.sampled_from(FLOWN)
many = settings(max_examples=examples(12), deadline=None)


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Draw a flight that climbs, goes somewhere at a speed, waits, and comes home or does not."""
    height_m = draw(st.floats(10.0, 90.0))
    items = [takeoff(height_m), speed(draw(st.floats(2.0, 10.0)))]
    items += [
        waypoint(
            draw(st.floats(-900.0, 900.0)),
            draw(st.floats(10.0, 90.0)),
            hold_s=draw(st.sampled_from((0.0, 10.0))),
        )
        for _ in range(draw(st.integers(1, 3)))
    ]
    return mission(*items, *([rtl()] if draw(st.booleans()) else []))


def flown(one: Mission, by: tuple[VehicleModel, Autopilot], **given_: Any) -> CheckResult:  # noqa: ANN401 - whatever check takes
    vehicle, autopilot = by
    return check(one, vehicle, autopilot=autopilot, **({"battery": PACK} | given_))


def margins_wh(result: CheckResult) -> tuple[float, float]:
    """Return what is left above the reserve after the flight, and after the tightest return."""
    assert result.battery is not None
    assert result.return_plan is not None
    assert result.return_plan.margin_wh is not None
    return result.battery.margin_wh, result.return_plan.margin_wh


def no_better(worse: CheckResult, better: CheckResult) -> None:
    """Assert that one flight takes no less energy than another, and leaves no more."""
    assert worse.totals.energy_wh >= better.totals.energy_wh - ROUNDING_WH
    leaves_no_more(worse, better)


def leaves_no_more(worse: CheckResult, better: CheckResult) -> None:
    # The tightest point of a flight is found to a thousandth of what its return takes.
    for one, other, slack in zip(
        margins_wh(worse), margins_wh(better), (ROUNDING_WH, 0.05), strict=True
    ):
        assert one <= other + slack


@many
@given(one=missions(), by=flights, kg=st.floats(0.0, 1.5), more=st.floats(0.0, 1.0))
def test_more_payload_never_takes_less(
    one: Mission, by: tuple[VehicleModel, Autopilot], kg: float, more: float
) -> None:
    no_better(flown(one, by, payload_kg=kg + more), flown(one, by, payload_kg=kg))


@many
@given(one=missions(), by=flights, kg=st.floats(0.0, 3.0), sd=st.floats(0.01, 1.5))
def test_what_goes_with_an_uncertain_load_passes_no_limit_two_deviations_off(
    one: Mission, by: tuple[VehicleModel, Autopilot], kg: float, sd: float
) -> None:
    if flown(one, by, payload_kg=Spread(mean=kg, sd=sd)).verdict == "go":
        found = flown(one, by, payload_kg=kg + 2.0 * sd).findings
        errors = {finding.code for finding in found if finding.severity is Severity.ERROR}
        assert not errors & {"E104", "E108", "E110", "E116", "E120"}


@many
@given(one=missions(), by=flights, m_s=st.floats(0.0, 8.0), sd=st.floats(0.1, 3.0))
def test_what_goes_in_an_uncertain_wind_passes_no_limit_two_deviations_off(
    one: Mission, by: tuple[VehicleModel, Autopilot], m_s: float, sd: float
) -> None:
    uncertain = Wind(speed_m_s=m_s, from_deg=200.0, speed_sd_m_s=sd)
    if flown(one, by, wind=uncertain).verdict == "go":
        found = flown(one, by, wind=Wind(speed_m_s=m_s + 2.0 * sd, from_deg=200.0)).findings
        errors = {finding.code for finding in found if finding.severity is Severity.ERROR}
        assert not errors & {"E103", "E104", "E110", "E114", "E116", "E120"}


@many
@given(
    one=missions(),
    m_s=st.floats(0.0, 6.0),
    sd=st.floats(0.5, 2.0),
    part=st.floats(1.0, 1.6),
    sds=st.sampled_from((-2.0, 2.0)),
)
def test_what_goes_without_a_spread_of_the_model_lands_two_deviations_off(
    one: Mission, m_s: float, sd: float, part: float, sds: float
) -> None:
    """With a battery that holds less than, or more than, what the flight takes in the mean wind."""
    by = (replace(SURVEYOR, spread=None), Autopilot.ARDUPILOT)
    mean = flown(one, by, wind=Wind(speed_m_s=m_s, from_deg=200.0))
    label = Battery(capacity_wh=part * mean.totals.energy_wh)
    wind = Wind(speed_m_s=m_s, from_deg=200.0, speed_sd_m_s=sd)
    if flown(one, by, wind=wind, battery=label, reserve=0.0).verdict == "go":
        other = Wind(speed_m_s=max(m_s + sds * sd, 0.0), from_deg=200.0)
        left = flown(one, by, wind=other, battery=label, reserve=0.0).battery
        assert left is not None
        assert left.margin_wh >= 0.0


@many
@given(one=missions(), by=flights, c=st.floats(-20.0, 40.0), more=st.floats(0.0, 15.0))
def test_hotter_air_never_takes_less(
    one: Mission, by: tuple[VehicleModel, Autopilot], c: float, more: float
) -> None:
    hotter, colder = (
        flown(one, by, temperature_c=air_c, battery_temperature_c=20.0) for air_c in (c + more, c)
    )
    no_better(hotter, colder)


@many
@given(one=missions(), by=flights, m=st.floats(0.0, 3000.0), more=st.floats(0.0, 1000.0))
def test_a_higher_home_never_takes_less(
    one: Mission, by: tuple[VehicleModel, Autopilot], m: float, more: float
) -> None:
    higher, lower = (
        flown(one, by, home_amsl_m=home_m, temperature_c=10.0, battery_temperature_c=20.0)
        for home_m in (m + more, m)
    )
    no_better(higher, lower)


@many
@given(
    one=missions(),
    by=flights,
    health=st.floats(0.5, 1.0),
    lost=st.floats(0.0, 0.3),
    age=st.floats(1.0, 2.0),
    colder_c=st.floats(0.0, 25.0),
)
def test_a_worn_or_cold_battery_never_leaves_more(
    one: Mission,
    by: tuple[VehicleModel, Autopilot],
    health: float,
    lost: float,
    age: float,
    colder_c: float,
) -> None:
    better = flown(one, by, battery_health=health, battery_temperature_c=15.0)
    for worn in (
        {"battery_health": health - lost, "battery_temperature_c": 15.0},
        {"battery_health": health, "battery_resistance_factor": age, "battery_temperature_c": 15.0},
        {"battery_health": health, "battery_temperature_c": 15.0 - colder_c},
    ):
        worse = flown(one, by, **worn)
        assert worse.totals.energy_wh == better.totals.energy_wh
        leaves_no_more(worse, better)


@many
@given(one=missions(), by=flights, scale=st.floats(1.0, 100.0))
def test_capacity_changes_shares_and_no_energy(
    one: Mission, by: tuple[VehicleModel, Autopilot], scale: float
) -> None:
    small, large = (
        flown(one, by, battery=Battery(capacity_wh=200.0 * times)) for times in (1.0, scale)
    )
    assert large.totals == small.totals
    assert [s.energy_wh for s in large.segments] == [s.energy_wh for s in small.segments]
    assert small.battery is not None
    assert large.battery is not None
    assert large.battery.used_fraction * scale == pytest.approx(small.battery.used_fraction)


@many
@given(wind_m_s=st.floats(0.5, 6.0), from_deg=st.sampled_from((0.0, 180.0)), by=flights)
def test_out_and_back_along_the_wind_never_takes_less(
    wind_m_s: float, from_deg: float, by: tuple[VehicleModel, Autopilot]
) -> None:
    """Power over airspeed is convex in each model, and an autopilot holds its ground speed."""
    there = mission(
        takeoff(50), speed(6.0), waypoint(3000, 50), waypoint(0, 50), item(21, north(0), 0.0)
    )
    windy = flown(there, by, wind=Wind(speed_m_s=wind_m_s, from_deg=from_deg))
    calm = flown(there, by)
    # A stop begun with the wind takes other power than one against it: 0.3 % of the way.
    assert windy.totals.energy_wh >= 0.997 * calm.totals.energy_wh


@pytest.mark.parametrize("by", FLOWN, ids=["article", "ardupilot", "px4", "matrice"])
def test_whether_the_wind_comes_on_the_way_out_or_back_is_all_the_same(
    by: tuple[VehicleModel, Autopilot],
) -> None:
    far = mission(takeoff(50), waypoint(20_000, 50), waypoint(0, 50), item(21, north(0), 0.0))
    there, back = (
        flown(far, by, wind=Wind(speed_m_s=5.0, from_deg=from_deg)).totals.energy_wh
        for from_deg in (0.0, 180.0)
    )
    # Only the two stops are begun in another wind.
    assert there == pytest.approx(back, rel=0.005)
