"""Ways that the autopilot of a parameter file flies, judged beside those of a model of reference steps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from made_missions import METRES_PER_DEGREE_NORTH, item, mission, north, rtl, takeoff, waypoint
from made_terrain import ground, hill, pole
from rule_cases.case import PLENTY, found

from planner.autopilot import Autopilot, Target
from planner.findings import Severity
from planner.geo.fence import Fence, FenceCircle
from planner.rules.own_ways import DELIVERED_RADIUS_M
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import ModelSpread
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.resolve import resolve_parameters

if TYPE_CHECKING:
    from planner.findings import Finding

EAST_PER_M = 1.0 / (METRES_PER_DEGREE_NORTH * math.cos(math.radians(47.0)))
TURNS = mission(
    takeoff(40),
    waypoint(200, 40),
    item(16, north(200), 40.0, longitude_deg=8.0 + 200 * EAST_PER_M),
    rtl(),
)
"""A right angle 200 m north of home, to the right."""
SHARP = {
    "ArduPilot": "WPNAV_SPEED,1000\nWPNAV_RADIUS,{radius}00\n",
    "PX4": "MPC_XY_CRUISE,10\nNAV_ACC_RAD,{radius}\n",
}


def left_open(told: tuple[Finding, ...]) -> set[str]:
    """Return the codes of rules that are left open as the autopilot flies another way."""
    return {one.about for one in told if one.code == "X904" and " flies it (" in one.message}


def inside(by_m: float, radius_m: float) -> FenceCircle:
    """Return an exclusion on the bisector of the corner, so far inside it."""
    aside_m = by_m / math.sqrt(2.0)
    return FenceCircle(
        inclusion=False,
        latitude_deg=north(200 - aside_m),
        longitude_deg=8.0 + aside_m * EAST_PER_M,
        radius_m=radius_m,
    )


# The legs pass 6 m inside the corner at 4.2 m: 3.2 m from a circle of 1 m.  A turn that begins 10 or 20 m
# before the waypoint cuts the corner by at most 7 or 14 m, and by 1.4 m where it begins 2 m before.
@pytest.mark.parametrize("by_m", [6.0, -6.0])
@pytest.mark.parametrize(
    ("of", "radius", "cuts"),
    [("ArduPilot", 10, True), ("ArduPilot", 2, False), ("PX4", 20, True), ("PX4", 2, False)],
)
def test_an_exclusion_inside_a_corner_that_the_autopilot_cuts_is_not_checked(
    of: str, radius: int, by_m: float, *, cuts: bool
) -> None:
    fenced = replace(TURNS, fence=Fence(circles=(inside(by_m, 1.0),)))
    told = found(fenced, parameters=SHARP[of].format(radius=radius))
    assert not {one.code for one in told} & {"F101"}
    assert bool(left_open(told) & {"F101", "F102"}) is (cuts and by_m > 0.0)


def test_a_known_spread_of_stops_leaves_no_corner_out() -> None:
    spread = ModelSpread(stopping_distance_fraction=0.1, n_flights=9, source="made")
    model = replace(load_vehicle("falkowski-2023-quadrotor"), spread=spread)
    given = parameters_from_text(SHARP["ArduPilot"].format(radius=10).encode(), source="p.param")
    fenced = replace(TURNS, fence=Fence(circles=(inside(6.0, 1.0),)))
    told = check(fenced, model, battery=PLENTY, parameters=given).findings
    assert left_open(told) & {"F101", "F102"}


# The radius of an item counts for PX4 alone; ArduPilot cuts by what WPNAV_RADIUS lets it, 2 m.
@pytest.mark.parametrize("says", ["file", "target", "neither"])
@pytest.mark.parametrize(
    ("autopilot", "radius", "cuts"),
    [(Autopilot.PX4, 20.0, True), (Autopilot.PX4, 2.0, False), (Autopilot.ARDUPILOT, 20.0, False)],
)
def test_the_autopilot_that_a_mission_is_for_cuts_corners_without_a_parameter_file(
    autopilot: Autopilot, radius: float, says: str, *, cuts: bool
) -> None:
    within = [replace(one, param2=radius) for one in TURNS.items[1:3]]
    turns = mission(TURNS.items[0], *within, TURNS.items[3])
    fenced = replace(turns, fence=Fence(circles=(inside(6.0, 1.0),)))
    if says == "file":
        fenced = replace(fenced, autopilot=autopilot)
    told = found(fenced, target=Target(autopilot) if says == "target" else None)
    assert bool(left_open(told)) is (cuts and says != "neither")


# The bound under which nothing is flown a second time.
@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_no_autopilot_has_a_larger_radius_as_it_is_delivered(autopilot: Autopilot) -> None:
    delivered = resolve_parameters(autopilot).values
    of = "acceptance_radius_m" if autopilot is Autopilot.PX4 else "waypoint_radius_m"
    assert getattr(delivered, of) == DELIVERED_RADIUS_M


def test_no_fence_is_near_a_corner_while_it_is_off() -> None:
    parameters = "FENCE_ENABLE,1\nFENCE_TYPE,4\n" + SHARP["ArduPilot"].format(radius=10)
    for is_on in (1, 0):
        switch = item(207, None, None, frame=2, params=(float(is_on), 0.0, 0.0, 0.0))
        switched = mission(TURNS.items[0], switch, *TURNS.items[1:])
        fenced = replace(switched, fence=Fence(circles=(inside(6.0, 1.0),)))
        told = found(fenced, parameters=parameters)
        assert bool(left_open(told)) is bool(is_on)


# ArduPilot cuts the corner by at most 7 m: 6.1 m inside it, 4.3 m from both legs, is within 2.5 m of that.
@pytest.mark.parametrize(("radius", "is_open"), [(10, True), (2, False)])
def test_ground_as_high_where_a_corner_is_cut_is_not_checked(radius: int, *, is_open: bool) -> None:
    terrain, _ = pole(4.3, 195.7, columns=801)
    told = found(TURNS, parameters=SHARP["ArduPilot"].format(radius=radius), terrain=terrain)
    assert not [one for one in told if one.code == "A102"]
    assert ("A102" in left_open(told)) is is_open


# From 12 m at 20 m to 60 m at 300 m a leg straight in space is 12 + 48 · 130 / 280 = 34.3 m up over the ridge
# at 150 m, the model, which climbs in place, 60 m.  The ridge is as wide as two cells, 10 m to both sides.
# Every autopilot flies it so: a text that is for none is asked, too.
@pytest.mark.parametrize("parameters", ["WPNAV_SPEED,1000\nRTL_ALT,6000\n", ""])
@pytest.mark.parametrize(("ridge_m", "is_open"), [(38.0, True), (24.0, False)])
def test_ground_as_high_as_the_autopilot_climbs_along_a_leg_is_not_checked(
    ridge_m: float, parameters: str, *, is_open: bool
) -> None:
    rising = mission(takeoff(12), waypoint(20, 12), waypoint(300, 60), rtl())
    terrain = ground(ridge_m, at_m=150.0)
    told = found(rising, parameters=parameters, terrain=terrain)
    assert not [one for one in told if one.code == "A102"]
    assert ("A102" in left_open(told)) is is_open


# Half-way along a leg of 250 m from 12 to 60 m ArduPilot is 36 m up, and returns from there no higher where
# RTL_ALT is 15 m: over a pole of 40 m half-way home.  The model climbs in place and returns at 60 m.
@pytest.mark.parametrize(("return_m", "is_open"), [(15, True), (50, False)])
def test_ground_as_high_under_returns_from_a_leg_that_climbs_is_not_checked(
    return_m: int, *, is_open: bool
) -> None:
    terrain, east_m = pole(62.0, 149.0, columns=801)
    rising = mission(
        takeoff(12),
        waypoint(298, 12),
        item(16, north(298), 60.0, longitude_deg=8.0 + 4.0 * east_m * EAST_PER_M),
        rtl(),
    )
    parameters = f"WPNAV_SPEED,1000\nRTL_ALT,{return_m}00\n"
    told = found(rising, parameters=parameters, terrain=terrain)
    assert not [one for one in told if one.code in {"A102", "A104"}]
    assert ("A104" in left_open(told)) is is_open


# The own autopilot follows a hill, too: 20 m above one of 30 m it is above all ground, returns included.
@pytest.mark.parametrize(("follows", "is_open"), [(10, False), (3, True)])
def test_the_own_autopilot_follows_the_ground_under_its_legs(
    follows: int, *, is_open: bool
) -> None:
    legs = [item(16, north(metres), 20.0, frame=follows) for metres in (20.0, 480.0)]
    told = found(
        mission(takeoff(20), *legs, rtl()),
        parameters="TERRAIN_ENABLE,1\nRTL_ALT,6000\n",
        terrain=hill(30.0),
    )
    codes = {one.code for one in told if one.severity is Severity.ERROR}
    assert bool(codes & {"A102", "A104", "X904"}) is is_open


# It flies home at the speed of its missions where RTL_SPEED is 0, and not at the default of another vehicle.
@pytest.mark.parametrize(
    ("parameters", "speed_m_s"),
    [("", None), ("RTL_ALT,1500\n", None), ("RTL_SPEED,500\n", 5.0), ("WPNAV_SPEED,600\n", 6.0)],
)
def test_the_own_autopilot_returns_at_the_speed_of_the_model(
    parameters: str, speed_m_s: float | None
) -> None:
    vehicle = load_vehicle("dji-matrice-100")
    given = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    asked = replace(TURNS, autopilot=Autopilot.ARDUPILOT)
    assessment = check(asked, vehicle, battery=PLENTY, parameters=given).assessment
    assert assessment is not None
    motion = assessment.own_motion
    assert motion is not None
    returning = motion.segment_stage == len(assessment.route.stages) - 1
    assert motion.segments.speed_m_s[returning].max() == pytest.approx(
        speed_m_s or vehicle.default_speed_m_s
    )
