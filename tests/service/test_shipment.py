"""Results on their way to another process: small, and what comes out of them there is the same."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from long_missions import plan

from planner.findings import Severity
from planner.mission.files import read_mission, read_mission_bytes
from planner.service.preflight import CheckResult, check
from planner.values import field_names, replace
from planner.vehicle.library import load_vehicle

MISSIONS = Path(__file__).parents[2] / "missions"


def shipped(result: CheckResult) -> CheckResult:
    again = pickle.loads(pickle.dumps(result))
    assert isinstance(again, CheckResult)
    return again


@pytest.mark.parametrize("name", ["inspection-pylon.plan", "delivery-fjord.waypoints"])
@pytest.mark.parametrize("model", ["px4-quad-2kg", "arducopter-sitl-quad"])
def test_a_shipped_result_holds_all_that_was_found_and_predicted(name: str, model: str) -> None:
    result = check(read_mission(MISSIONS / name), load_vehicle(model), with_trace=True)
    for again in (shipped(result), shipped(shipped(result))):
        for field in field_names(CheckResult):
            if field not in {"segments", "assessment", "trace"}:
                assert getattr(again, field) == getattr(result, field), field
        assert [*again.segments] == [*result.segments]
        assert again.assessment is not None
        assert result.assessment is not None
        assert again.assessment.findings == result.assessment.findings
        assert again.trace is not None
        assert result.trace is not None
        assert (again.trace.power_w == result.trace.power_w).all()
    only = replace(
        again, findings=tuple(one for one in again.findings if one.severity is Severity.ERROR)
    )
    assert only.segments[0] == result.segments[0]


def test_a_result_of_a_thousand_items_is_no_more_than_20_kb_to_ship() -> None:
    mission = read_mission_bytes(plan(1000).encode(), source="long.plan")
    assert len(pickle.dumps(check(mission, load_vehicle("falkowski-2023-quadrotor")))) <= 20_000


def test_a_result_of_nothing_flown_is_shipped_whole() -> None:
    nothing = replace(read_mission(MISSIONS / "inspection-pylon.plan"), items=())
    result = check(nothing, load_vehicle("px4-quad-2kg"))
    assert shipped(result) == result
