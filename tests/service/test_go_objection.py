"""What stands before an acceptance and an upload, beside the verdict."""

from __future__ import annotations

import math

import pytest
from made_missions import mission, rtl, takeoff, waypoint

from planner.findings import Severity
from planner.service.preflight import CheckResult, check_mission
from planner.service.vehicle import go_objection
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

GO = mission(takeoff(40.0), waypoint(200.0, 40.0), rtl())


def _result() -> CheckResult:
    setup = Setup.of({"vehicle": "arducopter-sitl-quad", "battery": Battery(capacity_wh=200.0)})
    result = check_mission(GO, setup)
    assert isinstance(result, CheckResult)
    return result


def test_a_go_with_energy_to_spare_has_no_objection() -> None:
    assert go_objection(_result()) == ""


@pytest.mark.parametrize("margin_wh", [-0.01, -1.58, math.nan, -math.inf])
def test_a_go_without_a_margin_is_none(margin_wh: float) -> None:
    result = _result()
    assert result.battery is not None
    short = replace(result, battery=replace(result.battery, margin_wh=margin_wh))
    assert "at landing is not enough" in go_objection(short)


def test_a_go_of_no_battery_or_of_no_vehicle_that_was_named_is_none() -> None:
    result = _result()
    assert go_objection(replace(result, battery=None)) == "no battery is known"
    unnamed = replace(result, setup=replace(result.setup, is_vehicle_named=False))
    assert go_objection(unnamed) == "no vehicle is named"
    assert Setup(load_vehicle()).vehicle.name  # the article's, which nobody named


def test_a_go_with_an_error_that_is_not_reported_is_none() -> None:
    result = _result()
    finding = replace(result.findings[0], severity=Severity.ERROR, suppression="ignored as X")
    hidden = replace(result, suppressed=(finding,))
    assert go_objection(hidden).endswith("is ignored as X")
    assert go_objection(hidden, consented={finding.code}) == ""
