"""Wind and thin air that a model says nothing of cost margin, and knowing more is never judged harsher."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from made_missions import mission, rtl, speed, takeoff, waypoint
from thinning import examples

from planner.findings import Severity
from planner.flight.uncounted import _measured_w, situation_ratios
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.declared import Interval
from planner.vehicle.library import load_vehicle
from planner.vehicle.power import CruisePower, MomentumLaw, whole_power_w

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.vehicle.model import VehicleModel

ARTICLE = load_vehicle("falkowski-2023-quadrotor")
"""Identified up to 10 m/s; has no airspeed term and no air density."""
MEASURED = (
    (0.0, 2.0, 10.0 / 3.0, 16.0 / 3.0, 20.0 / 3.0, 8.0, 10.0),
    tuple(131.0 / 353.0 * one for one in (0.0, -22.0, -46.0, -55.0, -31.0, 17.0, 129.0)),
)
"""Power above hover of the recorded survey quadrotor, its speeds over those of the article's, its hover
of 353 W over the article's 119.49 · 100^0.02 = 131 W."""


def flown(
    capacity_wh: float, wind_m_s: float, *, counts: bool = False, **more: float
) -> CheckResult:
    vehicle = ARTICLE
    if counts:
        box = replace(ARTICLE.valid_for, speed_m_s=Interval(low=0.0, high=10.0))
        law = CruisePower(speed_m_s=MEASURED[0], power_above_hover_w=MEASURED[1])
        vehicle = replace(ARTICLE, cruise=law, valid_for=box)
    one = mission(takeoff(100), speed(more.pop("speed_m_s", 5.0)), waypoint(900, 100), rtl())
    return check(
        one,
        vehicle,
        battery=Battery(capacity_wh=capacity_wh),
        wind=Wind(speed_m_s=wind_m_s, from_deg=more.pop("from_deg", 0.0)),
        **more,  # type: ignore[arg-type]  # home_amsl_m alone
    )


def uncounted(result: CheckResult) -> list[tuple[Severity, str]]:
    return [(f.severity, f.message) for f in result.findings if f.code == "E108"]


def test_wind_that_is_not_counted_is_an_error_where_it_may_take_the_margin() -> None:
    calm = flown(100.0, 0.0)
    assert uncounted(calm) == []
    assert calm.battery is not None
    assert calm.return_plan is not None
    assert calm.return_plan.margin_wh is not None
    # 20 % of the 100 Wh are the reserve; so are 20 % of what is just enough.
    least_wh = (80.0 - min(calm.battery.margin_wh, calm.return_plan.margin_wh)) / 0.8
    roomy, tight = (flown(least_wh * times, 4.0) for times in (3.0, 1.01))
    [(severity, message)] = uncounted(roomy)
    assert severity is Severity.WARNING
    assert "it may take" in message
    assert roomy.verdict == "go"
    [(severity, message)] = uncounted(tight)
    assert severity is Severity.ERROR
    assert "above the reserve allow" in message


def test_only_what_returns_fly_beyond_the_identified_airspeed_is_bounded() -> None:
    """Identified to 4 m/s, returns at 10 m/s: the cube of 2.5 on that way home, not on climb and landing.

    No more than 15.6 times the power at 4 m/s for the time of the way, as if all of it were at 10 m/s; from
    over home there is no way.
    """
    vehicle = load_vehicle("arducopter-sitl-quad")
    box = replace(vehicle.valid_for, speed_m_s=Interval(low=0.0, high=4.0))
    slow = mission(takeoff(50), speed(4.0), waypoint(400, 50), rtl())
    result = check(slow, replace(vehicle, valid_for=box))
    a = result.assessment
    assert a is not None
    sample, more_wh = a.returns.sample, a.uncounted.returns_wh
    assert sample is not None
    away_m = np.hypot(*sample.points.place_m[:, :2].T)
    assert more_wh[away_m < 0.1] == pytest.approx(0.0, abs=0.05)
    [cruise] = [row for row in result.segments if row.state.value == "cruise" and row.item == 3]
    bound_w = 2.5**3 * cruise.energy_wh * 3600.0 / cruise.duration_s
    way_wh = bound_w * (away_m / 10.0) / 3600.0
    far = away_m > 200.0
    # It speeds up and brakes besides: in 4 s each, and slower.
    assert (more_wh[far] < way_wh[far] + bound_w * 8.0 / 3600.0).all()
    assert (more_wh[far] > 0.6 * way_wh[far]).all()


def test_a_steady_leg_against_the_wind_takes_what_the_measured_quadrotor_takes() -> None:
    """At 20/3 m/s and 10/3 of wind from 10/15 to 15/15 of its speed: 482 W for 322 W."""
    ratio = _measured_w(np.array([1.0, 10.0 / 15.0, 1.15]))
    assert ratio[0] / ratio[1] == pytest.approx(482.0 / 322.0)
    assert ratio[2] / ratio[0] == pytest.approx(1.520875)  # 1.15³


@pytest.mark.parametrize(
    ("capacity_factor", "severity"), [(3.0, Severity.WARNING), (1.02, Severity.ERROR)]
)
def test_thin_air_that_is_not_counted_costs_margin(
    capacity_factor: float, severity: Severity
) -> None:
    low = flown(100.0, 0.0)
    assert low.battery is not None
    needed_wh = (100.0 - low.battery.margin_wh - 20.0) / 0.8
    # 1.055 kg/m³ at home: 1.16 times thinner than at sea level takes 8 % more.
    high = flown(needed_wh * capacity_factor, 0.0, home_amsl_m=1500.0)
    assert [one for one, _ in uncounted(high)] == [severity]


@pytest.mark.parametrize(("sd", "codes"), [(0.01, set()), (0.2, {"E124"})])
def test_an_uncertain_charge_counts_without_a_spread_of_the_model(
    sd: float, codes: set[str]
) -> None:
    """32 Wh for 14 with the reserve of 20: 18 left are 0.9 of a deviation of 20, 18 of one of 1."""
    charge = Spread(mean=0.32, sd=sd)
    found = flown(100.0, 0.0, charge=charge, reserve=0.1).findings  # type: ignore[arg-type]
    assert {one.code for one in found if one.severity is Severity.ERROR} == codes


@pytest.mark.parametrize(("sd_m_s", "is_short"), [(0.1, False), (3.0, True)])
def test_a_wind_that_is_not_counted_is_bounded_at_two_deviations(
    sd_m_s: float, *, is_short: bool
) -> None:
    wind = Wind(speed_m_s=1.0, from_deg=0.0, speed_sd_m_s=sd_m_s)
    one = mission(takeoff(100), speed(5.0), waypoint(900, 100), rtl())
    result = check(one, ARTICLE, battery=Battery(capacity_wh=25.0), wind=wind)
    assert (Severity.ERROR in {severity for severity, _ in uncounted(result)}) is is_short


@pytest.mark.parametrize(
    ("factor", "capacity_wh", "severity", "says"),
    [
        (1.0, 100.0, Severity.WARNING, ""),
        (1.01, 100.0, Severity.WARNING, "Wh more"),
        (2.0, 100.0, Severity.WARNING, "Wh more"),
        (5.5, 100.0, Severity.WARNING, "Wh more"),
        (7.0, 100.0, Severity.ERROR, "below 3.0 V"),
        (1.5, 16.3, Severity.ERROR, "more than there is above the reserve"),
    ],
)
def test_an_older_battery_that_is_not_counted_costs_margin(
    factor: float, capacity_wh: float, severity: Severity, says: str
) -> None:
    """A cell of 1 Ah has 0.05 ohm at most: 204 W of 100 Wh are 2.04 C, which drop 0.1 V more at twice that.

    V (1 - V / 3.7 V) of 3.7 V is 0.52 V where 3.0 V are left of the 3.61 V at a fifth: 6.1 times.  204 W of
    16.3 Wh are 12.5 C: 0.31 V of 3.7 V take more than 8 % of 12.5 Wh, and 0.49 Wh are above the reserve.
    """
    result = flown(capacity_wh, 0.0, battery_resistance_factor=factor)
    [(found, message)] = uncounted(result)
    assert (found, says in message) == (severity, True)


@settings(max_examples=examples(15), deadline=None)
@given(
    wind_m_s=st.floats(0.0, 9.0),
    from_deg=st.floats(0.0, 360.0),
    speed_m_s=st.floats(2.0, 10.0),
    capacity_wh=st.floats(8.0, 80.0),
)
def test_a_go_without_knowing_the_drag_is_a_go_with_it(
    wind_m_s: float, from_deg: float, speed_m_s: float, capacity_wh: float
) -> None:
    def is_go(wind_m_s: float, *, counts: bool) -> bool:
        more = {"from_deg": from_deg, "speed_m_s": speed_m_s}
        return flown(capacity_wh, wind_m_s, counts=counts, **more).verdict == "go"

    assume(is_go(0.0, counts=True))  # what the drag takes in calm air is another question
    assert not is_go(wind_m_s, counts=False) or is_go(wind_m_s, counts=True)


QUAD = load_vehicle("arducopter-sitl-quad")
"""Momentum theory, identified up to 15.1 m/s."""
STRAIGHT = mission(takeoff(30), waypoint(1500, 30), rtl())
"""North and back, at 10 m/s."""


def judged(
    vehicle: VehicleModel, wind_m_s: float, *, capacity_wh: float = 177.0, from_deg: float = 0.0
) -> CheckResult:
    wind = Wind(speed_m_s=wind_m_s, from_deg=from_deg)
    return check(STRAIGHT, vehicle, battery=Battery(capacity_wh=capacity_wh), wind=wind)


def identified_up_to(top_m_s: float, vehicle: VehicleModel = QUAD) -> VehicleModel:
    box = replace(vehicle.valid_for, speed_m_s=Interval(low=0.0, high=top_m_s))
    return replace(vehicle, valid_for=box)


def ratios(result: CheckResult) -> FloatArray:
    assert result.assessment is not None
    return situation_ratios(result.assessment.flight.power, result.assessment.reach)[0]


def law_w(airspeed_m_s: float) -> float:
    """Return the model's power of level flight at 30 m, by its law alone."""
    result = judged(QUAD, 0.0)
    assert result.assessment is not None
    power = result.assessment.flight.power
    law = QUAD.cruise
    assert isinstance(law, MomentumLaw)
    return float(
        whole_power_w(
            law,
            airspeed_m_s=airspeed_m_s,
            climb_rate_m_s=0.0,
            mass_kg=3.5,
            air_density_kg_m3=power.air_density_kg_m3(30.0),
        )
    )


@pytest.mark.parametrize(
    ("top_m_s", "ground_m_s"),
    [
        (15.0, 10.0),  # 10 m/s against 5 m/s are 15 m/s
        (14.0, 9.0),
        (10.0, 5.0),
        (6.0, 1.0),
    ],
)
def test_beyond_the_identified_airspeed_the_dearer_of_faster_and_later_counts(
    top_m_s: float, ground_m_s: float
) -> None:
    faster = law_w(top_m_s) * (15.0 / top_m_s) ** 3
    later = law_w(top_m_s) * 10.0 / ground_m_s
    expected = max(faster, later) / law_w(15.0)
    # The mission cruises 30 m up; the return a little lower.
    assert ratios(judged(identified_up_to(top_m_s), 5.0)).max() == pytest.approx(
        max(expected, 1.0), rel=2e-3
    )


def test_a_vehicle_whose_limit_is_stated_is_not_counted_slower_than_it_flies() -> None:
    """At 15 m/s held, 13 identified: the power grows, the ground speed stays."""
    held = replace(identified_up_to(13.0), airspeed_limit_m_s=15.0)
    expected = law_w(13.0) * (15.0 / 13.0) ** 3 / law_w(15.0)
    assert ratios(judged(held, 5.0)).max() == pytest.approx(expected, rel=2e-3)


def test_a_limit_that_is_not_sure_counts_less_two_deviations() -> None:
    """15 m/s held within 5 %: 13.5 are sure, 8.5 over ground for 10 against 5 m/s of wind."""
    held = replace(identified_up_to(15.0), airspeed_limit_m_s=15.0, airspeed_limit_fraction=0.05)
    later = law_w(13.5) * 10.0 / 8.5
    assert ratios(judged(held, 5.0)).max() == pytest.approx(later / law_w(15.0), rel=5e-3)
    sure = replace(held, airspeed_limit_fraction=0.0)
    assert ratios(judged(sure, 5.0)).max() == pytest.approx(1.0)


def test_an_ordinary_breeze_is_a_go_with_room_and_an_error_where_it_takes_the_room() -> None:
    for vehicle, capacity_wh in ((ARTICLE, 77.0), (QUAD, 177.0)):
        roomy = judged(vehicle, 6.0, capacity_wh=capacity_wh)
        assert roomy.verdict == "go"
        assert any("it may take" in f.message for f in roomy.findings)
    calm = judged(QUAD, 6.0)
    assert calm.battery is not None
    assert calm.return_plan is not None
    assert calm.return_plan.margin_wh is not None
    least_wh = (177.0 * 0.8 - min(calm.battery.margin_wh, calm.return_plan.margin_wh)) / 0.8
    tight = judged(QUAD, 6.0, capacity_wh=least_wh * 1.02)
    assert ("E105", Severity.ERROR) in {(f.code, f.severity) for f in tight.findings}


def test_a_wind_nobody_has_seen_it_fly_against_may_take_everything() -> None:
    """12 m/s against 10 identified: it is carried along, in every direction but one."""
    for vehicle in (ARTICLE, identified_up_to(10.0)):
        codes = {(f.code, f.severity) for f in judged(vehicle, 12.0, from_deg=34.0).findings}
        counted = "E105" if vehicle.knows_airspeed else "E108"
        assert {("W103", Severity.ERROR), (counted, Severity.ERROR)} <= codes


def test_neither_speed_nor_wind_is_checked_with_a_model_that_names_no_airspeed() -> None:
    box = replace(QUAD.valid_for, speed_m_s=None)
    for limit_m_s, wind_m_s, open_rules in (
        (None, 3.0, {"E105", "W101"}),
        (None, 0.0, {"E105"}),  # 10 m/s are flown
        (12.0, 3.0, set[str]()),
    ):
        vehicle = replace(QUAD, valid_for=box, airspeed_limit_m_s=limit_m_s)
        found = [f.message for f in judged(vehicle, wind_m_s).findings if f.code == "X904"]
        assert {code for code in ("E105", "W101") if any(code in f for f in found)} == open_rules
        assert len(found) == len(open_rules)


@settings(max_examples=examples(10), deadline=None)
@given(
    wind_m_s=st.floats(0.0, 10.0),
    from_deg=st.floats(0.0, 360.0),
    top_m_s=st.floats(5.0, 15.0),
    more_m_s=st.floats(0.0, 6.0),
    capacity_wh=st.floats(30.0, 177.0),
)
def test_a_model_identified_further_is_never_judged_harsher(
    wind_m_s: float, from_deg: float, top_m_s: float, more_m_s: float, capacity_wh: float
) -> None:
    def is_go(vehicle: VehicleModel) -> bool:
        one = judged(vehicle, wind_m_s, capacity_wh=capacity_wh, from_deg=from_deg)
        return one.verdict == "go"

    poor = identified_up_to(top_m_s)
    if is_go(poor):
        assert is_go(identified_up_to(top_m_s + more_m_s))
        assert is_go(replace(poor, airspeed_limit_m_s=top_m_s + more_m_s))
    assert not is_go(replace(poor, valid_for=replace(poor.valid_for, speed_m_s=None))) or is_go(
        poor
    )


@pytest.mark.parametrize(
    ("top_m_s", "severity"), [(9.75, None), (9.5, Severity.WARNING), (5.0, Severity.ERROR)]
)
def test_what_an_autopilot_flies_faster_than_its_model_costs_margin(
    top_m_s: float, severity: Severity | None
) -> None:
    """10 m/s in calm air: at 5 m/s identified it may take eight times the power, or twice the time."""
    wh = {"capacity_wh": 90.0} if severity is Severity.ERROR else {}
    found = [f for f in judged(identified_up_to(top_m_s), 0.0, **wh).findings if f.code == "E105"]
    flown = [f.severity for f in found if "m/s flown" in f.message]
    assert flown == ([] if severity is None else [severity])


def test_a_commanded_speed_that_no_leg_reaches_is_within_the_model() -> None:
    """Legs of 30 m, at 2.5 m/s²: it brakes before it is at 15 m/s."""
    short = mission(
        takeoff(30), speed(18.0), *(waypoint(30.0 * leg, 30) for leg in (1, 2, 3)), rtl()
    )
    battery = Battery(capacity_wh=177.0)
    found = check(short, identified_up_to(12.0), battery=battery).findings
    assert not any(f.code == "E105" and "flown" in f.message for f in found)
