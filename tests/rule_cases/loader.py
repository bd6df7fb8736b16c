"""Family L, up to L121: what loaders make of JSON missions."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

from plan_text import (
    LANDING,
    PLAN,
    STRUCTURE_SCAN,
    SURVEY,
    plan_of,
    plan_with,
    plan_without,
    simple_item,
)
from rule_cases.case import RuleCases

from planner.mission.files import read_mission_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding

TAKEOFF = simple_item(22, 3, 0, 0, 0, None, 47.3977, 8.5455, 30, number=1)
THERE = simple_item(16, 3, 5, 0, 0, None, 47.3987, 8.5455, 50, number=2)
LEGACY = {"version": 2, "firmwareType": 12, "plannedHomePosition": [47.39, 8.49, 400], "items": []}


def read(text: str) -> tuple[Finding, ...]:
    """Return what a reader tells of a plan."""
    return read_mission_bytes(text.encode(), source="a.plan").findings


def with_item(*without: str, **changes: object) -> tuple[Finding, ...]:
    """Return what is reported of a plan whose second item is changed."""
    changed = {key: value for key, value in {**THERE, **changes}.items() if key not in without}
    return read(plan_of(TAKEOFF, changed))


def with_complex(raw: dict[str, Any], **changes: object) -> tuple[Finding, ...]:
    """Return what is reported of a plan with a complex item."""
    return read(plan_of(TAKEOFF, {**copy.deepcopy(raw), **changes}))


def survey_without_items(**changes: object) -> dict[str, Any]:
    """Return a survey that holds the path it is drawn with, and no items."""
    survey = copy.deepcopy(SURVEY)
    del survey["TransectStyleComplexItem"]["Items"]
    survey["TransectStyleComplexItem"].update(changes)
    return survey


def drawn_at(north_deg: float) -> dict[str, Any]:
    """Return a survey with one item, drawn with one point."""
    there = {"VisualTransectPoints": [[north_deg, 8.5455]], "Items": [THERE]}
    return survey_without_items(**there)


def jump_to(target: int, *more: dict[str, Any], firmware: int = 12) -> tuple[Finding, ...]:
    """Return what is reported of a plan with a jump."""
    jump = simple_item(177, 2, target, 1, 0, 0, 0, 0, 0, number=9)
    plan = json.loads(plan_of(TAKEOFF, THERE, *more, jump))
    plan["mission"]["firmwareType"] = firmware
    return read(json.dumps(plan))


CASES: Mapping[str, RuleCases] = {
    "L101": RuleCases(
        fires=lambda: read(plan_without("geoFence")),
        boundary=lambda: read(plan_with({"version": 2, "polygons": [], "circles": []}, "geoFence")),
        silent=lambda: read(json.dumps(PLAN)),
    ),
    "L102": RuleCases(
        fires=lambda: read(plan_with(3, "mission", "version")),
        boundary=lambda: read(plan_with(2, "mission", "version")),
        silent=lambda: read(json.dumps(PLAN)),
    ),
    "L103": RuleCases(
        fires=lambda: with_item(Altitude=50.02),
        boundary=lambda: with_item(Altitude=50.01),
        silent=lambda: with_item(Altitude=50.0),
    ),
    "L104": RuleCases(
        fires=lambda: with_item(AltitudeMode=2),
        boundary=lambda: with_item(frame=0, AltitudeMode=3),  # worked out from terrain: AMSL
        silent=lambda: with_item(AltitudeMode=1),
    ),
    "L106": RuleCases(
        fires=lambda: jump_to(1, {**THERE, "doJumpId": 2}),
        boundary=lambda: read(plan_of(TAKEOFF, THERE, {**THERE, "doJumpId": 2})),  # no jump
        silent=lambda: jump_to(1, {**THERE, "doJumpId": 3}),
    ),
    "L107": RuleCases(
        fires=lambda: read(plan_with({"version": 1, "polygons": [[[47.0, 8.0]]]}, "geoFence")),
        boundary=lambda: read(plan_with({"version": 1, "polygons": [], "circles": []}, "geoFence")),
        silent=lambda: read(json.dumps(PLAN)),
    ),
    "L109": RuleCases(
        fires=lambda: with_item(autoContinue=1),
        boundary=lambda: with_item(autoContinue=False),
        silent=lambda: with_item(autoContinue=True),
    ),
    "L110": RuleCases(
        fires=lambda: with_item(params=[0, 0, 0, None], coordinate=[47.3987, 8.5455, 50]),
        boundary=lambda: with_item(params=[0, 0, 0, None, 47.3987, 8.5455, 50]),
        silent=with_item,
    ),
    "L111": RuleCases(
        fires=lambda: with_item(coordinate=[47.3987, 8.5455, 50]),
        boundary=lambda: with_item(params=[0, 0, 0, None], coordinate=[47.3987, 8.5455, 50]),
        silent=with_item,
    ),
    "L112": RuleCases(
        fires=lambda: with_complex(STRUCTURE_SCAN, version=4),
        boundary=lambda: with_complex(STRUCTURE_SCAN, version=3),
        silent=lambda: with_complex(SURVEY, version=9),
    ),
    "L113": RuleCases(
        fires=lambda: with_complex(SURVEY, version=6),
        boundary=lambda: with_complex(SURVEY, version=5),
        silent=lambda: with_complex(STRUCTURE_SCAN),
    ),
    "L114": RuleCases(
        fires=lambda: with_complex(survey_without_items()),
        boundary=lambda: with_complex(survey_without_items(Items=[THERE])),
        silent=lambda: with_complex(SURVEY),
    ),
    "L115": RuleCases(
        fires=lambda: with_complex(STRUCTURE_SCAN),
        boundary=lambda: with_complex(STRUCTURE_SCAN, version=4),  # not expanded: L112
        silent=lambda: with_complex(SURVEY),
    ),
    "L166": RuleCases(
        fires=lambda: with_complex(drawn_at(47.40)),
        boundary=lambda: with_complex(drawn_at(47.3987 + 0.9 / 111_200)),
        silent=lambda: with_complex(drawn_at(47.3987)),
    ),
    "L116": RuleCases(
        fires=lambda: with_complex(LANDING),
        boundary=lambda: with_complex(LANDING, version=9),  # not expanded: L112
        silent=lambda: with_complex(SURVEY),
    ),
    "L117": RuleCases(
        fires=lambda: read(json.dumps(LEGACY)),
        boundary=lambda: read(json.dumps({"mission": LEGACY, "version": 1, "fileType": "Plan"})),
        silent=lambda: read(json.dumps(PLAN)),
    ),
    "L118": RuleCases(
        fires=lambda: with_item("type"),
        boundary=lambda: with_item(type="missionItem"),  # from before plans: L110
        silent=with_item,
    ),
    "L119": RuleCases(
        fires=lambda: read(plan_with(None, "mission", "cruiseSpeed")),
        boundary=lambda: read(plan_with(15.0, "mission", "cruiseSpeed")),
        silent=lambda: read(plan_without("mission", "cruiseSpeed")),
    ),
    "L120": RuleCases(
        fires=lambda: jump_to(3, SURVEY),
        boundary=lambda: jump_to(2, SURVEY),
        silent=lambda: jump_to(2),
    ),
    "L121": RuleCases(
        fires=lambda: jump_to(2),
        boundary=lambda: jump_to(2, firmware=3),
        silent=lambda: read(json.dumps(PLAN)),
    ),
}
