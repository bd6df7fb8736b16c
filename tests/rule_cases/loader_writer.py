"""Family L, from L201: what a mission loses in another file, and in parts."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING

from made_missions import HOME, item, jump, mission, rtl, takeoff, waypoint
from plan_text import PLAN, SURVEY, plan_of, simple_item
from rule_cases.case import ARDUPILOT, PLAIN, RuleCases, vehicle_of

from planner.geo.fence import Fence
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.items import Home, MissionFormat
from planner.service.split import split_mission
from planner.values import replace
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem

TAKEOFF = simple_item(22, 3, 0, 0, 0, 0, 47.4, 8.5, 30, number=1)
VERTEX = item(5001, 47.0, 0.0, params=(3.0, 0.0, 0.0, 0.0))
PARACHUTE = item(208, frame=2, params=(0.0, 0.0, 0.0, 0.0))
SERVO = item(183, frame=2, params=(1.0, 1500.0, 0.0, 0.0))
TEXT = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1\n1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1\n"
)


def read(text: str) -> Mission:
    return read_mission_bytes(text.encode(), source="a.plan")


def as_text(one: Mission) -> tuple[Finding, ...]:
    """Return what a mission loses in text."""
    return convert_mission(one, MissionFormat.WPL).findings


def as_plan(one: Mission) -> tuple[Finding, ...]:
    """Return what a mission loses in a plan."""
    return convert_mission(one, MissionFormat.PLAN).findings


def without(*sections: str) -> Mission:
    """Return the plan without some of its sections."""
    return read(json.dumps({key: value for key, value in PLAN.items() if key not in sections}))


def with_home(home: Home | None) -> tuple[Finding, ...]:
    """Return what a mission from a home loses in text."""
    return as_text(replace(PLAIN, home=home))


def parts(*items: MissionItem, capacity_wh: float = 56.0) -> tuple[Finding, ...]:
    """Return what is reported of the parts of two flights to 1.5 km."""
    flown = (takeoff(40), waypoint(1500, 40), *items)
    battery = Battery(capacity_wh=capacity_wh)
    return split_mission(mission(*flown), vehicle_of(ARDUPILOT), battery=battery).findings


STRANGE = {"type": "ComplexItem", "complexItemType": "spiral", "version": 1}
FAR_AGAIN = (waypoint(0, 40), waypoint(1500, 40), rtl())
TRIGGER = item(206, frame=2, params=(20.0, 0.0, 1.0, 0.0))

CASES: Mapping[str, RuleCases] = {
    "L201": RuleCases(
        fires=lambda: as_text(read(json.dumps(PLAN))),
        boundary=lambda: as_text(without("geoFence", "rallyPoints")),
        silent=lambda: as_plan(read(json.dumps(PLAN))),
    ),
    "L213": RuleCases(
        fires=lambda: as_plan(read(TEXT)),
        boundary=lambda: as_plan(replace(read(TEXT), fence=Fence())),  # known to be none
        silent=lambda: as_text(read(TEXT)),
    ),
    "L202": RuleCases(
        fires=lambda: as_text(read(json.dumps(PLAN))),
        boundary=lambda: as_plan(read(json.dumps(PLAN))),
        silent=lambda: as_text(read(plan_of(TAKEOFF))),
    ),
    "L203": RuleCases(
        fires=lambda: as_text(read(plan_of(STRANGE, TAKEOFF))),
        boundary=lambda: as_plan(read(plan_of(STRANGE, TAKEOFF))),
        silent=lambda: as_text(read(plan_of(copy.deepcopy(SURVEY), TAKEOFF))),
    ),
    "L204": RuleCases(
        fires=lambda: as_text(read(json.dumps(PLAN))),
        boundary=lambda: as_text(PLAIN),
        silent=lambda: as_plan(read(json.dumps(PLAN))),
    ),
    "L205": RuleCases(
        fires=lambda: with_home(replace(HOME, altitude_amsl_m=None)),
        boundary=lambda: with_home(replace(HOME, altitude_amsl_m=0.0)),
        silent=lambda: with_home(HOME),
    ),
    "L206": RuleCases(
        fires=lambda: as_plan(read(f"{TEXT}# there\n")),
        boundary=lambda: as_plan(read(f"{TEXT}\n")),
        silent=lambda: as_plan(read(TEXT)),
    ),
    "L207": RuleCases(
        fires=lambda: as_text(mission(takeoff(30), VERTEX, waypoint(10, 30))),
        boundary=lambda: as_plan(mission(takeoff(30), VERTEX, waypoint(10, 30))),
        silent=lambda: as_text(PLAIN),
    ),
    "L208": RuleCases(
        fires=lambda: as_text(mission(takeoff(30), jump(4, 1), rtl())),
        boundary=lambda: as_text(mission(takeoff(30), jump(3, 1), rtl())),
        silent=lambda: as_text(mission(takeoff(30), jump(1, 1), rtl())),
    ),
    "L209": RuleCases(
        fires=lambda: parts(waypoint(0, 40), jump(2, 1), rtl()),
        boundary=lambda: parts(*FAR_AGAIN),
        silent=lambda: parts(rtl()),
    ),
    "L210": RuleCases(
        fires=lambda: parts(TRIGGER, waypoint(-1500, 40), rtl()),
        boundary=lambda: parts(waypoint(-1500, 40), rtl()),
        silent=lambda: parts(TRIGGER, rtl(), capacity_wh=100.0),
    ),
    "L211": RuleCases(
        fires=lambda: parts(waypoint(0, 40)),
        boundary=lambda: parts(waypoint(0, 40), rtl()),
        silent=lambda: parts(waypoint(0, 40), item(21, HOME.latitude_deg, 0.0)),
    ),
    "L212": RuleCases(
        fires=lambda: parts(SERVO, *FAR_AGAIN),
        boundary=lambda: parts(SERVO, *FAR_AGAIN, capacity_wh=200.0),  # in a single part
        silent=lambda: parts(*FAR_AGAIN),
    ),
    "L214": RuleCases(
        fires=lambda: parts(PARACHUTE, *FAR_AGAIN),
        boundary=lambda: parts(*FAR_AGAIN[:2], PARACHUTE, *FAR_AGAIN[2:]),  # in the last part
        silent=lambda: parts(*FAR_AGAIN),
    ),
}
