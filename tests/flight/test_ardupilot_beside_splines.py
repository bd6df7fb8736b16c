"""Splines of ArduPilot are judged where they are flown: beside their curve, as the vehicle follows late."""

from __future__ import annotations

import numpy as np
import pytest
from fenced_missions import at, box, findings_of
from made_missions import HOME, item, mission, rtl, speed
from made_missions import takeoff as takeoff_to

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.flight.path import flown_path
from planner.geo.fence import Fence
from planner.mission.route.route import make_route
from planner.service.preflight import check
from planner.service.separation import check_together
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import parameters_from_text

LIMIT_M_S = 10.24
"""Airspeed at 30° of the vehicle that was flown."""


SPLINES = (
    takeoff_to(20),
    at(-3.3, -15.8, params=(3.0, 0.0, 0.0, 0.0)),
    at(-13.5, -27.4, command=82, params=(2.0, 0.0, 0.0, 0.0)),
    at(-36.0, -45.9, command=82, params=(2.0, 0.0, 0.0, 0.0)),
    at(-45.8, -65.6, command=82),
    at(-118.3, 14.8),
    rtl(),
)
LATE = "ATC_INPUT_TC,0.35\nWPNAV_JERK,12\n"


@pytest.mark.parametrize(
    ("airspeed_limit_m_s", "within_m"), [(LIMIT_M_S, 1.0), (None, 2.5)], ids=["drag", "no drag"]
)
def test_a_spline_is_judged_where_it_is_flown(
    airspeed_limit_m_s: float | None, within_m: float
) -> None:
    # Flown 3.1 m outside the curve: the vehicle leaves the spline from the north-east for the north-west.
    flown_m = np.array(
        [[-33.9, -71.2], [-35.0, -73.6], [-36.7, -75.0], [-39.1, -73.6], [-42.2, -69.7]]
    )
    parameters = ArduPilotParameters(attitude_time_constant_s=0.35, jerk_m_s3=12.0)
    stages = make_route(mission(*SPLINES), dialect=Autopilot.ARDUPILOT).stages
    motion = fly_ardupilot(stages, parameters, airspeed_limit_m_s=airspeed_limit_m_s)
    path = flown_path(motion)
    place_m = np.column_stack((path.east_m, path.north_m))
    away_m = np.hypot(*(flown_m[:, None] - place_m).transpose(2, 0, 1)).min(axis=1)
    assert float(away_m.max()) < within_m
    # Where the drag is not known, within the position error.  It lands at home, and times are the target's.
    assert place_m[-1] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert motion.beside is not None
    at_s = motion.beside.time_s
    target = motion.state_at_time(at_s)
    target_m = np.column_stack((target.east_m, target.north_m))
    target_away_m = np.hypot(*(flown_m[:, None] - target_m).transpose(2, 0, 1)).min(axis=1)
    assert float(target_away_m.max()) > 2.5


def test_a_fence_beside_a_spline_is_breached_as_flown() -> None:
    # The curve ends 2.9 m from it, more than the position may be wrong; flown: "Polygon fence breached".
    area = box(-60.0, -100.0, -20.0, -74.9, inclusion=False)
    found = findings_of(SPLINES, area, autopilot=Autopilot.ARDUPILOT, parameters=LATE)
    assert "F101" in found
    # Farther off than what it swings out and what its position may be wrong there is room.
    area = box(-60.0, -100.0, -20.0, -80.0, inclusion=False)
    found = findings_of(SPLINES, area, autopilot=Autopilot.ARDUPILOT, parameters=LATE)
    assert "F101" not in found


@pytest.mark.parametrize(("separation_m", "is_too_near"), [(9.0, True), (5.0, False)])
def test_another_vehicle_beside_a_spline_is_as_near_as_flown(
    separation_m: float, *, is_too_near: bool
) -> None:
    # Flown at 8.0 m from it; the curve ends 10.9 m from it.
    vehicle = load_vehicle("arducopter-sitl-quad")
    given = parameters_from_text(LATE.encode(), source="p.param")
    there = at(-36.7, -83.0, command=19, params=(400.0, 0.0, 0.0, 0.0))
    home = replace(HOME, latitude_deg=there.latitude_deg, longitude_deg=there.longitude_deg)
    hovers = replace(mission(takeoff_to(20), there, rtl()), home=home)
    results = [check(one, vehicle, parameters=given) for one in (mission(*SPLINES), hovers)]
    for one in check_together(results, separation_m=separation_m, starts_s=(100.0, 0.0)):
        assert ("S101" in {f.code for f in one.findings}) is is_too_near


TURNS_BACK = (
    takeoff_to(20),
    at(0.0, 60.0),
    *(at(*place, command=82) for place in ((10.0, 90.0), (25.0, 40.0), (50.0, 80.0))),
    at(50.0, 0.0),
    rtl(),
)


@pytest.mark.parametrize(
    ("given", "is_fenced", "severities"),
    [
        (LATE, False, [Severity.WARNING]),
        (LATE, True, [Severity.ERROR]),
        ("ATC_INPUT_TC,0.15\n", True, []),
    ],
    ids=["no fence", "a fence", "the defaults"],
)
def test_how_far_it_is_thrown_past_a_turn_is_told_as_not_predicted(
    given: str, severities: list[Severity], *, is_fenced: bool
) -> None:
    # Flown by ArduCopter 4.7.0-dev with ATC_INPUT_TC 0.35 and WPNAV_JERK 12: 5.4 m beyond what is predicted,
    # through a fence; with the defaults 0.7 m.
    fence = Fence(polygons=(box(-500.0, -500.0, 500.0, 500.0),)) if is_fenced else None
    result = check(
        replace(mission(*TURNS_BACK), fence=fence),
        load_vehicle("arducopter-sitl-quad"),
        parameters=parameters_from_text(given.encode(), source="p.param"),
    )
    told = [one for one in result.findings if "turns faster" in one.message]
    assert [(one.code, one.severity, one.item) for one in told] == [
        ("T102", severity, 5) for severity in severities
    ]


def test_a_spline_ends_towards_the_end_of_a_leg_on_which_the_speed_changes() -> None:
    # Flown by ArduCopter 4.7.0-dev: 10 m beside a spline towards where CONDITION_DELAY is over, 99.1 s.
    made = mission(
        takeoff_to(14),
        at(36.7, -25.9, 11.0),
        at(53.4, -10.5, 11.0, params=(3.0, 0.0, 0.0, 0.0)),
        at(64.7, 9.4, 11.0, command=82),
        at(39.4, 6.9, 11.0, command=82),
        speed(1.5, 0.0),
        item(112, frame=2, params=(4.0, 0.0, 0.0, 0.0)),
        speed(8.0),
        at(27.7, -65.7, 9.0),
        at(14.6, -67.2, 9.0),
        at(10.2, -47.0, 0.0, command=21),
    )
    parameters = ArduPilotParameters(
        attitude_time_constant_s=0.2, jerk_m_s3=12.0, cruise_speed_m_s=4.5, descent_speed_m_s=0.5
    )
    stages = make_route(made, dialect=Autopilot.ARDUPILOT).stages
    path = flown_path(fly_ardupilot(stages, parameters, airspeed_limit_m_s=LIMIT_M_S))
    away_m = np.hypot(path.east_m - 46.8, path.north_m - 20.4)
    assert away_m.min() < 1.0
