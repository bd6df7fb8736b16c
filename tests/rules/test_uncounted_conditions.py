"""Wind and thin air that a model does not count cost margin, and knowing them is never judged harsher."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from made_missions import mission, rtl, speed, takeoff, waypoint

from planner.findings import Severity
from planner.physics.wind import Wind
from planner.rules.model import _measured_w
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.declared import Interval
from planner.vehicle.library import load_vehicle
from planner.vehicle.power import CruisePower

ARTICLE = load_vehicle("falkowski-2023-quadrotor")
"""Identified up to 10 m/s; has no airspeed term and no air density."""
MEASURED = (
    (0.0, 2.0, 10.0 / 3.0, 16.0 / 3.0, 20.0 / 3.0, 8.0, 10.0),
    (0.0, -22.0, -46.0, -55.0, -31.0, 17.0, 129.0),
)
"""Power above hover of the recorded survey quadrotor, its speeds over those of the article's."""


def flown(
    capacity_wh: float, wind_m_s: float, *, counts: bool = False, **more: float
) -> CheckResult:
    vehicle = ARTICLE
    if counts:
        box = replace(ARTICLE.valid_for, speed_m_s=Interval(low=0.0, high=10.0))
        # Beyond what is identified the table holds its last value.
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


@settings(max_examples=30, deadline=None)
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
