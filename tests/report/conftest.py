"""A check made by hand, which every report is tried on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from page_browser import CHROMIUM, DRIVER, FLAGS

from planner.findings import Place
from planner.flight.budget import BatteryBudget, Totals
from planner.flight.motion.kinematics import FlightState
from planner.flight.prediction import ItemArrival, Segment
from planner.flight.returns.tightest import ReturnPlan
from planner.physics.wind import Wind
from planner.rules.model import CRUISE_POWER_ASSUMED, MODEL_OUTSIDE_ENVELOPE
from planner.service.preflight import FILE_UNREADABLE, CheckResult, UnreadableMission
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Iterator

    from selenium.webdriver import Chrome


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chrome]:
    """A headless Chromium, one for all pages."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM or ""
    for flag in (*FLAGS, f"user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture
def flown() -> CheckResult:
    """A flight of three segments that goes, with a warning and an assumption."""
    return CheckResult(
        file="site.plan",
        verdict="go",
        setup=Setup(
            replace(load_vehicle(), name="quad", source="models/quad.toml"),
            position_noise_m=0.0,
            wind=Wind(speed_m_s=5.0, from_deg=270.0),
            home_amsl_m=488.0,
            temperature_c=15.0,
            payload_kg=0.5,
        ),
        totals=Totals(
            time_s=692.4,
            distance_m=4321.0,
            climb_m=120.0,
            descent_m=120.0,
            energy_wh=24.06,
            charge_mah=1625.7,
            mean_power_w=125.1,
            peak_power_w=206.9,
        ),
        battery=BatteryBudget(
            capacity_wh=77.0,
            usable_wh=69.3,
            used_fraction=24.06 / 77.0,
            reserve_fraction=0.2,
            reserve_wh=15.4,
            margin_wh=69.3 - 15.4 - 24.06,
        ),
        return_plan=ReturnPlan(tightest_item=2, energy_home_wh=10.25, margin_wh=31.2),
        segments=(
            Segment(
                index=0,
                item=1,
                state=FlightState.TAKEOFF,
                start_s=0.0,
                duration_s=30.4,
                distance_m=0.0,
                climb_m=120.0,
                speed_m_s=7.2,
                energy_wh=1.56,
                stopping_distance_m=None,
            ),
            Segment(
                index=1,
                item=2,
                state=FlightState.CRUISE,
                start_s=30.4,
                duration_s=600.0,
                distance_m=4321.0,
                climb_m=0.0,
                speed_m_s=10.0,
                energy_wh=20.0,
                stopping_distance_m=26.4,
            ),
            Segment(
                index=2,
                item=3,
                state=FlightState.LAND,
                start_s=630.4,
                duration_s=62.0,
                distance_m=0.0,
                climb_m=-120.0,
                speed_m_s=3.0,
                energy_wh=2.5,
                stopping_distance_m=None,
            ),
        ),
        items=(
            ItemArrival(item=1, command="NAV_TAKEOFF", arrival_s=30.4, energy_used_wh=1.56),
            ItemArrival(item=2, command="NAV_WAYPOINT", arrival_s=630.4, energy_used_wh=21.56),
            ItemArrival(item=3, command="NAV_LAND", arrival_s=None, energy_used_wh=None),
        ),
        findings=(
            MODEL_OUTSIDE_ENVELOPE.finding(
                "12.0 m/s is commanded, the model was identified up to 10.0 m/s",
                item=2,
                place=Place(line=41, column=9),
            ),
            CRUISE_POWER_ASSUMED.finding("cruise power is taken as hover power over 4.3 km"),
        ),
    )


@pytest.fixture
def unreadable() -> UnreadableMission:
    """A mission file that cannot be read."""
    message = "broken.plan:3:7: this is not JSON"
    return UnreadableMission(
        file="broken.plan",
        findings=(FILE_UNREADABLE.finding(message, place=Place(line=3, column=7)),),
    )
