"""Family F: fences and rally points."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fenced_missions import at, box, circle, degrees, findings_of, rally
from made_missions import HOME, rtl, takeoff
from rule_cases.case import ARDUPILOT, PLAIN, PX4, STEP, RuleCases, found

from planner.geo.fence import Fence, FencePolygon
from planner.mission.items import MissionFormat
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding
    from planner.geo.fence import FenceCircle
    from planner.mission.items import MissionItem

NORTH = (takeoff(20), at(0, 400), rtl())
SHORT = (takeoff(20), at(0, 100), rtl())
CORNER = at(200, 200, params=(5.0, 0.0, 0.0, None))
"""A hold, so that ArduPilot does not turn before the place."""
AROUND_A_WALL = (takeoff(20), at(0, 200), CORNER, at(0, 200), rtl())
CIRCLE = (takeoff(20), at(0, 0, command=18, params=(1.0, 0.0, 200.0, None)), rtl())
AROUND = box(-400.0, -400.0, 400.0, 400.0)
NOTHING_M = 1e-6
"""What is lost between metres and degrees is far less. [m]"""


def reported(
    items: tuple[MissionItem, ...],
    *areas: FencePolygon | FenceCircle,
    **more: Any,  # noqa: ANN401 - whatever findings_of takes
) -> Iterable[Finding]:
    """Return what the rules of fences say of a mission."""
    return findings_of(items, *areas, **more).values()


def beside(clear_m: float) -> Iterable[Finding]:
    """Return what is reported of a leg so far beside the edge of its area."""
    return reported(NORTH, box(-100.0, -100.0, clear_m, 500.0))


def loitering(clear_m: float) -> Iterable[Finding]:
    """Return what is reported of a circle of 200 m beside an exclusion."""
    return reported(CIRCLE, box(200.0 + clear_m, -20.0, 260.0, 20.0, inclusion=False))


def apart(gap_m: float) -> Iterable[Finding]:
    """Return what is reported of two inclusions, one of which begins so far behind the other."""
    return reported(SHORT, box(-200, -200, 200, 200), box(200.0 + gap_m, -200, 900, 200))


def as_text(parameters: str) -> Iterable[Finding]:
    """Return what is reported of a mission in a text file, which has no place for a fence."""
    return found(replace(PLAIN, file_format=MissionFormat.WPL), ARDUPILOT, parameters)


def led_around(clear_m: float, oa_type: int = 1) -> Iterable[Finding]:
    """Return what is reported where ArduPilot plans its path, of a leg so far beside the edge."""
    area = box(-100.0, -100.0, clear_m, 500.0)
    given = f"OA_TYPE,{oa_type}\nOA_MARGIN_MAX,8\n"
    return reported(NORTH, area, autopilot=ARDUPILOT, parameters=given)


def predicted(room_m: float) -> Iterable[Finding]:
    """Return what is reported where PX4 predicts to be 219.07 m out: see tests/rules/test_px4_fence.py."""
    return reported(
        (takeoff(20), at(0, 200), rtl()),
        box(-400.0, -400.0, 400.0, room_m),
        autopilot=PX4,
        parameters="GF_PREDICT,1\nGF_ACTION,3\nMPC_XY_CRUISE,10\n",
        position_error_m=0.0,
        position_noise_m=0.0,
    )


def returned_before(wall_m: float) -> Iterable[Finding]:
    """Return what PX4 reports of an item 300 m out, behind the return, in an area up to a wall."""
    return reported((*SHORT, at(0, 300)), box(-400.0, -400.0, 400.0, wall_m), autopilot=PX4)


def behind(wall_m: float) -> Iterable[Finding]:
    """Return what is reported of a wall up to so far north; the return passes its corner at 100 m."""
    wall = box(100.0, -300.0, 300.0, wall_m, inclusion=False)
    return reported(AROUND_A_WALL, wall, autopilot=ARDUPILOT, position_error_m=0.0)


def ring(corners: int) -> FencePolygon:
    """Return a polygon of 400 m radius."""
    turns = [2.0 * math.pi * i / corners for i in range(corners)]
    return FencePolygon(
        inclusion=True,
        vertices_deg=tuple(degrees(400 * math.cos(a), 400 * math.sin(a)) for a in turns),
    )


CASES: Mapping[str, RuleCases] = {
    "F101": RuleCases(
        fires=lambda: beside(-0.01), boundary=lambda: beside(0.0), silent=lambda: beside(0.01)
    ),
    "F102": RuleCases(
        fires=lambda: beside(2.49),
        boundary=lambda: beside(2.5 + NOTHING_M),
        silent=lambda: beside(2.51),
    ),
    "F103": RuleCases(
        fires=lambda: reported(SHORT, AROUND, rally_points=(rally(400.01, 0.0),)),
        boundary=lambda: reported(SHORT, AROUND, rally_points=(rally(400.0, 0.0),)),
        silent=lambda: reported(SHORT, AROUND, rally_points=(rally(399.99, 0.0),)),
    ),
    "F104": RuleCases(
        fires=lambda: reported(SHORT, box(-200.0, 0.01, 200.0, 400.0)),
        boundary=lambda: reported(SHORT, box(-200.0, -NOTHING_M, 200.0, 400.0)),
        silent=lambda: reported(SHORT, box(-200.0, -0.01, 200.0, 400.0)),
    ),
    "F105": RuleCases(
        fires=lambda: reported(SHORT, circle(0.0, 50.0, -200.0)),
        boundary=lambda: reported(SHORT, circle(0.0, 50.0, 0.0)),
        fires_at_boundary=True,
        silent=lambda: reported(SHORT, circle(0.0, 50.0, 200.0)),
    ),
    "F106": RuleCases(
        fires=lambda: apart(0.01), boundary=lambda: apart(-0.0201), silent=lambda: apart(-1.0)
    ),
    "F107": RuleCases(
        fires=lambda: loitering(-0.06),
        boundary=lambda: loitering(0.05),  # what its chords may differ from a circle
        silent=lambda: loitering(0.5),
    ),
    "F108": RuleCases(
        fires=lambda: behind(100.01),
        boundary=lambda: behind(100.0 - 0.001),
        silent=lambda: behind(99.9),
    ),
    "F109": RuleCases(
        fires=lambda: found(replace(PLAIN, home=None, fence=Fence(polygons=(AROUND,), circles=()))),
        boundary=lambda: found(
            replace(
                PLAIN,
                home=replace(HOME, altitude_amsl_m=None),
                fence=Fence(polygons=(AROUND,), circles=()),
            )
        ),
        silent=lambda: found(replace(PLAIN, home=None)),
    ),
    "F113": RuleCases(
        fires=lambda: led_around(7.9),
        boundary=lambda: led_around(8.0 + 0.01),
        silent=lambda: led_around(7.9, oa_type=0),
    ),
    "F110": RuleCases(
        fires=lambda: reported(
            (takeoff(20), at(0, 100, 60.1), rtl()), autopilot=PX4, parameters="GF_MAX_VER_DIST,60\n"
        ),
        boundary=lambda: reported(
            (takeoff(20), at(0, 100, 60.0), rtl()), autopilot=PX4, parameters="GF_MAX_VER_DIST,60\n"
        ),
        fires_at_boundary=True,
        silent=lambda: reported(
            (takeoff(20), at(0, 100, 57.9), rtl()), autopilot=PX4, parameters="GF_MAX_VER_DIST,60\n"
        ),
    ),
    "F111": RuleCases(
        fires=lambda: reported(SHORT, AROUND, autopilot=PX4, parameters="GF_ACTION,0\n"),
        boundary=lambda: reported(SHORT, AROUND, autopilot=PX4, parameters="GF_ACTION,1\n"),
        fires_at_boundary=True,
        silent=lambda: reported(SHORT, AROUND, autopilot=PX4, parameters="GF_ACTION,2\n"),
    ),
    "F114": RuleCases(
        fires=lambda: as_text("FENCE_ENABLE,1\nFENCE_TOTAL,6\nFENCE_RADIUS,1000\n"),
        boundary=lambda: as_text("FENCE_ENABLE,1\nFENCE_TOTAL,0\nFENCE_RADIUS,1000\n"),
        silent=lambda: found(PLAIN, ARDUPILOT, "FENCE_ENABLE,1\nFENCE_TOTAL,6\nRALLY_TOTAL,1\n"),
    ),
    "F116": RuleCases(
        fires=lambda: predicted(219.0),
        boundary=lambda: predicted(219.15),
        silent=lambda: predicted(220.0),
    ),
    "F117": RuleCases(
        fires=lambda: returned_before(299.9),
        boundary=lambda: returned_before(300.0),
        silent=lambda: returned_before(300.1),
    ),
    "F112": RuleCases(
        fires=lambda: reported(SHORT, ring(256), autopilot=ARDUPILOT),
        boundary=lambda: reported(SHORT, ring(255), autopilot=ARDUPILOT),
        silent=lambda: reported(SHORT, ring(256), autopilot=STEP),
    ),
}
