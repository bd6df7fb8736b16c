"""Family T: time, and items whose effect is not known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fenced_missions import degrees, rally
from made_missions import item, jump, mission, north, rtl, speed, takeoff, waypoint
from made_terrain import slope
from rule_cases.altitude import landing_at
from rule_cases.case import ARDUPILOT, PLAIN, PX4, RuleCases, found

from planner.mission.route.order import flown_order
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem


def returning(*items: MissionItem) -> Mission:
    """Return a flight to 100 m north that goes on so and returns."""
    return mission(takeoff(20), waypoint(100, 20), *items, rtl())


CAMERA = item(206, frame=2)


def looping(*items: MissionItem) -> tuple[Finding, ...]:
    """Return what is reported of a loop that ends so, on ArduPilot."""
    return found(
        mission(takeoff(20), waypoint(100, 20), *items, waypoint(50, 20), rtl()), ARDUPILOT
    )


def placing(most_m: float) -> Mission:
    """Return a mission that lowers a load, at most so far."""
    return returning(item(94, north(100), 0.0, params=(most_m, 0.0, 0.0, 0.0)))


def at_speed(speed_m_s: float) -> Mission:
    """Return a flight at a commanded speed."""
    return mission(takeoff(20), speed(speed_m_s), waypoint(500, 20), rtl())


def turning_away(speed_m_s: float, radius_m: float) -> Mission:
    """Return a mission that turns by 45° where it is so far before a waypoint."""
    first = item(16, north(100.0), 20.0, params=(0.0, radius_m, 0.0, None))
    latitude_deg, longitude_deg = degrees(60.0, 160.0)
    second = item(16, latitude_deg, 20.0, longitude_deg=longitude_deg)
    return mission(takeoff(20), speed(speed_m_s), first, second, rtl())


def reached_within(radius_m: float) -> Mission:
    """Return a flight to 100 m and to 200 m north, the farther one reached within so much."""
    there = item(16, north(200.0), 20.0, params=(0.0, radius_m, 0.0, None))
    return mission(takeoff(20), waypoint(100, 20), there, rtl())


def delay(seconds: float, hour: float = -1.0) -> MissionItem:
    return item(93, frame=2, params=(seconds, hour, 30.0 if hour >= 0.0 else -1.0, -1.0))


def condition(command: int, value: float) -> MissionItem:
    return item(command, frame=2, params=(value, 0.0, 0.0, 0.0))


def jumping(repeats: int) -> tuple[Finding, ...]:
    """Return what is reported of two items flown so often again, and none behind them."""
    return flown_order(mission(takeoff(20), jump(1, repeats)).items, ARDUPILOT).findings


WITH_RALLY = replace(PLAIN, rally=(rally(0.0, 50.0),))


def waiting_first(seconds: float, parameters: str = "AUTO_OPTIONS,3\n") -> Iterable[Finding]:
    """Return what is reported of a wait before the take-off."""
    return found(mission(delay(seconds), *PLAIN.items), ARDUPILOT, parameters)


CASES: Mapping[str, RuleCases] = {
    "T101": RuleCases(
        fires=lambda: found(returning(jump(2, -1)), ARDUPILOT),
        shown=lambda: found(mission(takeoff(20), waypoint(100, 20), waypoint(0, 20), jump(2, -1))),
        boundary=lambda: found(returning(jump(2, 0)), ARDUPILOT),
        silent=lambda: found(returning(jump(2, 1)), ARDUPILOT),
    ),
    "T102": RuleCases(
        fires=lambda: found(returning(item(94, north(100), 0.0)), ARDUPILOT),
        boundary=lambda: found(
            returning(item(183, frame=2, params=(1.0, 1500.0, 0.0, 0.0))), ARDUPILOT
        ),
        silent=lambda: found(PLAIN, ARDUPILOT),
    ),
    "T103": RuleCases(
        fires=lambda: found(at_speed(12.1), PX4),
        boundary=lambda: found(at_speed(12.0), PX4),
        silent=lambda: found(at_speed(12.1), ARDUPILOT),
    ),
    "T104": RuleCases(
        fires=lambda: found(mission(takeoff(20), rtl(), waypoint(100, 20))),
        # What stands behind the return is reached by a jump around it, and led back from.
        boundary=lambda: found(
            mission(takeoff(20), jump(4, 1), rtl(), waypoint(100, 20), jump(3, 1))
        ),
        silent=lambda: found(PLAIN),
    ),
    "T106": RuleCases(
        fires=lambda: jumping(10_001),
        boundary=lambda: jumping(10_000),  # 20,000 items again
        silent=lambda: jumping(9_999),
    ),
    "T107": RuleCases(
        fires=lambda: found(returning(delay(0.0, 14.0)), ARDUPILOT, "RTL_LOIT_TIME,60000\n"),
        # Half a turn at 45 °/s takes 4 s.
        boundary=lambda: found(PLAIN, ARDUPILOT, "RTL_LOIT_TIME,4000\nATC_RATE_WPY_MAX,45\n"),
        silent=lambda: found(returning(delay(30.0)), ARDUPILOT, "RTL_LOIT_TIME,60000\n"),
    ),
    "T108": RuleCases(
        fires=lambda: found(returning(replace(waypoint(200, 20), autocontinue=False)), PX4),
        boundary=lambda: found(
            returning(item(92, frame=2, params=(0.0, 0.0, 0.0, 0.0))), ARDUPILOT
        ),
        silent=lambda: found(returning(replace(waypoint(200, 20), autocontinue=False)), ARDUPILOT),
    ),
    # Above 10 m it descends by 1 m/s a metre: 0.55 m/s, 1.1 times LAND_SPEED, 10.55 m above home.
    "T117": RuleCases(
        fires=lambda: found(landing_at(122), ARDUPILOT, terrain=slope(-5.0)),
        boundary=lambda: found(landing_at(120), ARDUPILOT, terrain=slope(-5.0)),
        silent=lambda: found(landing_at(122), ARDUPILOT, "RNGFND1_TYPE,8\n", terrain=slope(-5.0)),
    ),
    "T118": RuleCases(  # 0.4 over (4.19 / 3.71)² is 0.3136
        fires=lambda: found(PLAIN, PX4, "MPC_THR_HOVER,0.4\nMPC_THR_MIN,0.4\n"),
        boundary=lambda: found(PLAIN, PX4, "MPC_THR_HOVER,0.4\nMPC_THR_MIN,0.3135\n"),
        silent=lambda: found(PLAIN, PX4, "MPC_THR_HOVER,0.16\nMPC_THR_MIN,0.12\n"),
    ),
    "T120": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "LAND_SPEED,201\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "LAND_SPEED,200\n"),
        silent=lambda: found(PLAIN, PX4, "MPC_LAND_SPEED,1.5\n"),
    ),
    "T122": RuleCases(  # 20 m above the ground
        fires=lambda: found(placing(19.9), ARDUPILOT),
        boundary=lambda: found(placing(20.0), ARDUPILOT),
        silent=lambda: found(placing(0.0), ARDUPILOT),
    ),
    "T126": RuleCases(
        # 200 m north of a place 100 m north of home, which is reached from 2 m: 102 m.
        fires=lambda: found(reached_within(102.1), PX4),
        boundary=lambda: found(reached_within(101.9), PX4),
        silent=lambda: found(reached_within(102.1), ARDUPILOT),
    ),
    "T125": RuleCases(
        # Flown by a build of PX4: at 8 m/s 85 s longer, at 5 m/s not.
        fires=lambda: found(turning_away(8.0, 20.0), PX4),
        boundary=lambda: found(turning_away(5.0, 20.0), PX4),
        silent=lambda: found(turning_away(8.0, 5.0), PX4),
    ),
    "T119": RuleCases(
        # It is armed with a heading nobody knows and returns from where it is home.
        fires=lambda: found(mission(takeoff(20), waypoint(100, 20), waypoint(0, 20), rtl()), PX4),
        silent=lambda: found(
            mission(takeoff(20), waypoint(100, 20), waypoint(0, 20), rtl()), PX4, heading_deg=0.0
        ),
        boundary=lambda: found(
            # Beyond RTL_MIN_DIST, 10 m, and 3 m more a return does not ask for it.
            mission(takeoff(20), waypoint(100, 20), waypoint(14, 20), rtl()),
            PX4,
        ),
    ),
    "T109": RuleCases(
        fires=lambda: found(PLAIN, PX4),
        boundary=lambda: found(PLAIN, PX4, position_noise_m=0.0),
        silent=lambda: found(PLAIN, PX4, position_noise_m=0.3),
    ),
    "T110": RuleCases(
        fires=lambda: found(PLAIN, PX4, "COM_DISARM_LAND,-1\n"),
        boundary=lambda: found(PLAIN, PX4, "COM_DISARM_LAND,0\n"),
        silent=lambda: found(PLAIN, PX4, "COM_DISARM_LAND,2\n"),
    ),
    "T111": RuleCases(
        fires=lambda: found(at_speed(6.0), PX4, speed_m_s=5.9),
        boundary=lambda: found(
            mission(takeoff(20), speed(6.0), waypoint(500, 20), item(21, north(500), 0.0)),
            PX4,
            speed_m_s=6.0,
        ),
        silent=lambda: found(at_speed(6.0), PX4),
    ),
    "T113": RuleCases(
        fires=lambda: found(PLAIN, PX4, "RTL_TYPE,5\n"),
        boundary=lambda: found(WITH_RALLY, PX4, "RTL_TYPE,5\n"),
        silent=lambda: found(PLAIN, PX4, "RTL_TYPE,0\n"),
    ),
    "T121": RuleCases(
        fires=lambda: waiting_first(10.0),
        boundary=lambda: waiting_first(9.9),
        silent=lambda: waiting_first(60.0, "DISARM_DELAY,0\nAUTO_OPTIONS,3\n"),
    ),
    "T112": RuleCases(
        fires=lambda: found(PLAIN),
        boundary=lambda: found(mission(takeoff(20), waypoint(100, 20), item(21, north(100), 0.0))),
        silent=lambda: found(PLAIN, ARDUPILOT),
    ),
    "T124": RuleCases(
        fires=lambda: looping(speed(2.0), waypoint(0, 20), jump(3, 1)),
        boundary=lambda: looping(speed(2.0), waypoint(0, 20, hold_s=1.0), jump(3, 1)),
        silent=lambda: looping(speed(2.0), waypoint(0, 20), jump(4, 1)),
    ),
    "T123": RuleCases(
        fires=lambda: looping(CAMERA, jump(2, 2), speed(2.0)),
        boundary=lambda: looping(CAMERA, jump(2, -1), speed(2.0)),  # never over
        silent=lambda: looping(jump(2, 2), speed(2.0)),
    ),
    "T115": RuleCases(
        fires=lambda: found(
            returning(condition(112, 1000.0), speed(2.0), waypoint(300, 20)), ARDUPILOT
        ),
        # What stands before the condition is carried out at once.
        boundary=lambda: found(
            returning(speed(2.0), condition(112, 1000.0), waypoint(300, 20)), ARDUPILOT
        ),
        silent=lambda: found(
            returning(condition(112, 1000.0), waypoint(300, 20), speed(2.0)), ARDUPILOT
        ),
    ),
}
