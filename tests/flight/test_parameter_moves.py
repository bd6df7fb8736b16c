"""One parameter changed in the vehicle's file moves the whole flight as the autopilot's law says.

Pencil and paper for speed, acceleration, jerk, radius, landing speed and the height of a return, of both
autopilots, through the whole of a check; the tests of their motions hold each law by itself.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from made_missions import HOME, item, mission, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.service.preflight import check
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

COPTER, PX4 = load_vehicle("arducopter-sitl-quad"), load_vehicle("px4-sih-quad")
"""Their parameters are the autopilots' defaults."""


def longer_s(autopilot: Autopilot, line: str, items: tuple[MissionItem, ...]) -> float:
    """Return how much longer a mission takes with one line of a parameter file."""
    changed = parameters_from_text(line.encode(), source="p.param")
    without, with_it = (
        check(
            mission(*items, autopilot=autopilot),
            COPTER if autopilot is Autopilot.ARDUPILOT else PX4,
            parameters=parameters,
            position_noise_m=0.0,
        ).totals.time_s
        for parameters in (None, changed)
    )
    return with_it - without


OUT_AND_BACK = (takeoff(50.0), waypoint(1000.0, 50.0, hold_s=1.0), rtl())
"""Two level legs of 1000 m, each from rest to rest, and a landing from 50 m."""
DOG_LEG = (
    takeoff(50.0),
    waypoint(1000.0, 50.0),
    item(16, HOME.latitude_deg + 1000.0 / 111_176.0, 50.0, longitude_deg=8.0131),
    rtl(),
)
"""One right corner of 90° between legs of 1 km."""
LOW_RETURN = (takeoff(20.0), waypoint(200.0, 20.0), rtl())


@pytest.mark.parametrize(
    ("line", "items", "expected_s"),
    [
        # A leg takes L/V + V/A + A/J and what does not change; ArduPilot's kilometre north is 1.3 m
        # longer at 47°.
        ("WPNAV_SPEED,800", OUT_AND_BACK, 2 * (1000 / 8 + 8 / 2.5 - 1000 / 10 - 10 / 2.5)),
        ("WPNAV_ACCEL,100", OUT_AND_BACK, 2 * (10 / 1.0 + 1.0 / 1 - 10 / 2.5 - 2.5 / 1)),
        # And the centimetre that heights are rounded to before a return, half of it overlapped.
        (
            "WPNAV_JERK,2",
            OUT_AND_BACK,
            2 * (2.5 / 2 - 2.5 / 1) - 4 * (0.01 * 0.3 / 8) ** 0.25 * (1 - 0.5**0.25),
        ),
        # Half the overlap is (6 R / (2 J sin θ/2))^(1/3) and a constant; the corner saves twice that.
        (
            "WPNAV_RADIUS,50",
            DOG_LEG,
            2 * (math.cbrt(6 * 2.0 / math.sqrt(2)) - math.cbrt(6 * 0.5 / math.sqrt(2))),
        ),
        # v = e + 0.5 m/s from 10.0 m down to LAND_SPD: (10 + v)/v and the logarithm of slowing down.
        (
            "LAND_SPEED,30",
            OUT_AND_BACK,
            10.3 / 0.3 - 10.5 / 0.5 + math.log(1 / 0.3) - math.log(1 / 0.5),
        ),
        # A climb of 10 m takes rise/V + V/A_z + A_z/J + t_j + 0.37 s, of which 2.6 s overlap with the way
        # home, and replaces the start of that, 0.3 s, and half a centimetre's curve; and 10 m more down.  In
        # the turn between them some of the lag of the lean is lost, 0.2 s: half of it, to half of it.
        (
            "RTL_ALT,3000",
            LOW_RETURN,
            10 / 2.5
            + 2.5
            + 1
            + 0.3
            + 0.37
            - 2.6
            - 0.3
            - 4 * (0.01 * 0.3 / 8) ** 0.25
            + 0.1
            + 10 / 1.5,
        ),
    ],
    ids=["speed", "acceleration", "jerk", "radius", "landing speed", "return height"],
)
def test_ardupilots_flight_moves_by_its_laws(
    line: str, items: tuple[MissionItem, ...], expected_s: float
) -> None:
    # 0.05 s: how the vehicle of this model follows its references.
    assert longer_s(Autopilot.ARDUPILOT, line, items) == pytest.approx(
        expected_s, rel=0.01, abs=0.05
    )


def px4_leg_s(v: float = 5.0, *, a: float = 3.0, j: float = 4.0, r: float = 2.0) -> float:
    """1000 m from rest to within r of a stop: the way, what a ramp costs, and what braking costs."""
    return 1000.0 / v + v / (2.0 * a) + a / (2.0 * j) + px4_stop_s(v, a=a, j=j, r=r)


def px4_stop_s(v: float, *, a: float, j: float, r: float) -> float:
    """What it costs to brake to within r of a stop, by the law of the source: u² + b u = 2 a d."""
    b = 4.0 * a**2 / j
    brake_m = (v**2 + b * v) / (2.0 * a)
    last = 0.5 * (-b + math.sqrt(b**2 + 8.0 * a * r))
    return (v - last) / a + 2.0 * a / j * math.log(v / last) - brake_m / v


THERE_AND_DOWN = (
    takeoff(50.0),
    waypoint(1000.0, 50.0, hold_s=1.0),
    item(21, HOME.latitude_deg + 1000.0 / 111_176.0, 0.0),
)
"""One level leg of 1000 m from rest to rest, and a landing there."""


@pytest.mark.parametrize(
    ("line", "items", "expected_s"),
    [
        ("MPC_XY_CRUISE,8", THERE_AND_DOWN, px4_leg_s(8.0) - px4_leg_s()),
        ("MPC_ACC_HOR,2", THERE_AND_DOWN, px4_leg_s(a=2.0) - px4_leg_s()),
        # The take-off stops as well: from 3 m/s with 4 m/s² to within 0.8 m.
        (
            "MPC_JERK_AUTO,2",
            THERE_AND_DOWN,
            px4_leg_s(j=2.0)
            - px4_leg_s()
            + px4_stop_s(3.0, a=4.0, j=2.0, r=0.8)
            - px4_stop_s(3.0, a=4.0, j=4.0, r=0.8),
        ),
        ("NAV_ACC_RAD,5", THERE_AND_DOWN, px4_leg_s(r=5.0) - px4_leg_s()),
        # Below 10 m from 1.5 m/s to the landing speed at 5 m, e-folding; 4 m at that speed.
        (
            "MPC_LAND_SPEED,0.5",
            THERE_AND_DOWN,
            4 / 0.5 - 4 / 0.7 + math.log(3.0) / 0.2 - math.log(1.5 / 0.7) / 0.16,
        ),
        # 30 m more up at 3 m/s and down at 1.5 m/s.
        ("RTL_RETURN_ALT,60", LOW_RETURN, 30 / 3.0 + 30 / 1.5),
    ],
    ids=["speed", "acceleration", "jerk", "radius", "landing speed", "return height"],
)
def test_px4s_flight_moves_by_its_laws(
    line: str, items: tuple[MissionItem, ...], expected_s: float
) -> None:
    # 0.35 s: crawling begins by slowing down, ramps need not be whole.
    assert longer_s(Autopilot.PX4, line, items) == pytest.approx(expected_s, rel=0.01, abs=0.35)
