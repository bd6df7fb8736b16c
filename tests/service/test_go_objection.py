"""What arming and uploading rest on besides the verdict."""

from __future__ import annotations

import pytest
from made_missions import mission, rtl, takeoff, waypoint

import planner
from planner.findings import Rule, Severity
from planner.service.preflight import CheckResult, check_mission
from planner.service.vehicle import go_objection
from planner.setup import Setup
from planner.values import replace

QUAD = planner.load_vehicle("arducopter-sitl-quad")
HIDDEN = Rule("E199 hidden", Severity.ERROR, summary="", why="", how="", fix="").finding("hidden")


def result() -> CheckResult:
    return check_mission(mission(takeoff(20), waypoint(100, 20), rtl()), Setup(QUAD))


def test_a_go_with_energy_at_landing_and_on_the_way_home_is_one() -> None:
    assert result().verdict == "go"
    assert go_objection(result()) == ""


@pytest.mark.parametrize("margin_wh", [-0.01, -1.58, float("-inf"), float("nan")])
@pytest.mark.parametrize("part", ["battery", "return_plan"])
def test_a_margin_below_the_reserve_is_an_objection_whatever_the_verdict(
    part: str, margin_wh: float
) -> None:
    short = replace(result(), **{part: replace(getattr(result(), part), margin_wh=margin_wh)})
    where = "at landing" if part == "battery" else "on the way home"
    assert where in go_objection(short)


def test_an_unnamed_vehicle_and_a_suppressed_error_are_objections() -> None:
    unnamed = replace(result(), setup=replace(result().setup, is_vehicle_named=False))
    assert go_objection(unnamed) == "no vehicle is named"
    assert "battery" in go_objection(replace(result(), battery=None))
    hidden = replace(result(), suppressed=(HIDDEN,))
    assert "E199" in go_objection(hidden)
    assert go_objection(hidden, consented={"E199"}) == ""


def test_a_mission_that_is_not_flown_asks_for_a_vehicle_too() -> None:
    nothing = mission(waypoint(0, 0), home=None)
    nothing = replace(nothing, items=())
    for is_named in (True, False):
        setup = replace(Setup(QUAD), is_vehicle_named=is_named)
        codes = [one.code for one in check_mission(nothing, setup).findings]
        assert ("X903" in codes) is not is_named
        assert "M108" in codes
