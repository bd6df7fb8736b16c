"""Family M: the structure of a mission, what autopilots refuse, what a site asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fenced_missions import FRAME, rally
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PLAIN, PX4, RuleCases, found

from planner.geo.geodesy import distance_m
from planner.mission.formats.wpl import TEXT_NO_HOME_ROW
from planner.mission.items import Home, MissionFormat
from planner.mission.vehicle_kind import vehicle_evidence
from planner.selection import Selection
from planner.site_profile import SiteProfile
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem

LAND = item(21, HOME.latitude_deg, 0.0)
LAND_START = item(189, frame=2, params=(0.0, 0.0, 0.0, 0.0))
DELAY = item(93, frame=2, params=(1.0, -1.0, -1.0, -1.0))


def then(*items: MissionItem) -> Mission:
    """Return a flight to 100 m north that goes on so."""
    return mission(takeoff(20), waypoint(100, 20), *items)


def returning(*items: MissionItem) -> Mission:
    """Return the same with a return at its end."""
    return then(*items, rtl())


def near_null_island(longitude_deg: float) -> Mission:
    """Return a flight from 0° north, 0.0005° east to a waypoint on the equator."""
    home = Home(latitude_deg=0.0, longitude_deg=0.0005, altitude_amsl_m=0.0)
    start = item(22, 0.0, 20.0, longitude_deg=0.0005)
    return mission(start, item(16, 0.0, 20.0, longitude_deg=longitude_deg), rtl(), home=home)


def pitched(pitch_deg: float) -> Mission:
    """Return a flight that ends in the air and whose take-off has a pitch."""
    items = (
        item(22, HOME.latitude_deg, 20.0, params=(pitch_deg, 0.0, 0.0, None)),
        waypoint(100, 20),
    )
    return mission(*items, vehicle=vehicle_evidence(items))


def heading(heading_deg: float | None) -> Mission:
    """Return a flight to a waypoint with a heading."""
    return returning(item(16, north(200), 20.0, params=(0.0, 0.0, 0.0, heading_deg)))


def circle(radius_m: float) -> Mission:
    """Return a flight with one turn."""
    return returning(item(18, north(200), 20.0, params=(1.0, 0.0, radius_m, 0.0)))


def with_rally(east_m: float, limit_m: float) -> tuple[Finding, ...]:
    """Return what ArduPilot's check tells of a rally point beside the flight."""
    one = replace(PLAIN, rally=(rally(east_m, 50.0),))
    return found(one, ARDUPILOT, f"RALLY_LIMIT_KM,{limit_m / 1000.0!r}\n")


def required(items: str) -> tuple[Finding, ...]:
    """Return what PX4's check tells where take-off and landing are asked for, both or neither."""
    made = [takeoff(20)] * ("T" in items) + [waypoint(100, 20)] + [LAND] * ("L" in items)
    return found(mission(*made), PX4, "MIS_TKO_LAND_REQ,4\n")


def first_place(limit_m: float) -> tuple[Finding, ...]:
    """Return what PX4's check tells of a first place 900 m away."""
    return found(mission(waypoint(900, 20), rtl()), PX4, f"MIS_DIST_1WP,{limit_m!r}\n")


def gate(metres: float) -> tuple[Finding, ...]:
    """Return what PX4's check tells of a gate so far before the next waypoint, at 50 m."""
    return found(
        mission(takeoff(20), item(4501, north(50.0 - metres), 20.0), waypoint(50, 20), rtl()), PX4
    )


def landing_at(altitude_m: float, *, asked: bool) -> tuple[Finding, ...]:
    """Return what is reported of a landing at an altitude."""
    selection = Selection(extend_select=("M120",)) if asked else None
    return found(then(item(21, HOME.latitude_deg, altitude_m)), selection=selection)


def site(max_distance_m: float | None = None, *required_items: str) -> tuple[Finding, ...]:
    """Return what a profile has to say of a flight to 100 m north."""
    profile = SiteProfile(
        source="site.toml", max_distance_m=max_distance_m, required_items=required_items
    )
    return found(PLAIN, profile=profile)


def far_away(metres: float) -> tuple[Finding, ...]:
    """Return what is reported of a mission so far north of home."""
    latitude_deg = float(FRAME.latitude_longitude_deg(0.0, metres)[0])
    return found(mission(takeoff(20), item(16, latitude_deg, 20.0), rtl()))


FIRST_M = float(distance_m(HOME.latitude_deg, HOME.longitude_deg, north(900), HOME.longitude_deg))
FARTHEST_M = float(
    distance_m(HOME.latitude_deg, HOME.longitude_deg, north(100), HOME.longitude_deg)
)
TEXT = replace(PLAIN, file_format=MissionFormat.WPL)
HOMELESS = replace(TEXT, findings=(TEXT_NO_HOME_ROW.finding("the first row is not home", item=1),))


def with_jumps(count: int) -> tuple[Finding, ...]:
    """Return what ArduPilot's rules tell of so many waypoints, each with a jump back to it."""
    pairs = [
        one
        for number in range(count)
        for one in (waypoint(10.0 + number, 20), jump(2 + 2 * number, 1.0))
    ]
    return found(mission(takeoff(20), *pairs, rtl()), ARDUPILOT)


def _items(count: int, parameters: str = "") -> Iterable[Finding]:
    """Return what is found in a mission of so many items: rounds of 10 m."""
    places = [waypoint(10.0 * (number % 2), 20) for number in range(count - 2)]
    return found(mission(takeoff(20), *places, rtl()), ARDUPILOT, parameters)


CASES: Mapping[str, RuleCases] = {
    "M101": RuleCases(
        fires=lambda: found(mission(waypoint(100, 20), rtl())),
        boundary=lambda: found(mission(speed(5.0), takeoff(20), waypoint(100, 20), rtl())),
        silent=lambda: found(PLAIN),
    ),
    "M126": RuleCases(
        fires=lambda: _items(650),
        boundary=lambda: _items(649),  # and home: 650 on ArduCopter
        silent=lambda: _items(650, "BRD_SD_MISSION,64\n"),
    ),
    "M128": RuleCases(
        fires=lambda: found(mission(takeoff(2.9), waypoint(100, 20), rtl()), PX4),
        boundary=lambda: found(mission(takeoff(3.0), waypoint(100, 20), rtl()), PX4),
        silent=lambda: found(
            mission(takeoff(2.9), waypoint(100, 20), rtl()), PX4, "NAV_ACC_RAD,1\n"
        ),
    ),
    "M129": RuleCases(
        fires=lambda: found(HOMELESS, ARDUPILOT),
        boundary=lambda: found(TEXT, ARDUPILOT),
        silent=lambda: found(HOMELESS, PX4),
    ),
    "M130": RuleCases(
        fires=lambda: found(PLAIN, PX4, "MPC_XY_VEL_P_ACC,0\n"),
        boundary=lambda: found(PLAIN, PX4, "MPC_XY_VEL_P_ACC,0.001\n"),
        silent=lambda: found(PLAIN, PX4, "MPC_XY_VEL_I_ACC,0.1\n"),
    ),
    "M132": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "CHUTE_ENABLED,1\nCHUTE_CRT_SINK,1.4\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "CHUTE_ENABLED,1\nCHUTE_CRT_SINK,1.876\n"),
        silent=lambda: found(PLAIN, ARDUPILOT, "CHUTE_ENABLED,1\nCHUTE_CRT_SINK,2\n"),
    ),
    "M131": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "TKOFF_RPM_MIN,1000\nSERIAL1_PROTOCOL,2\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "TKOFF_RPM_MIN,0\nSERIAL1_PROTOCOL,2\n"),
        silent=lambda: found(PLAIN, ARDUPILOT, "MOT_SPOOL_TIME,0.5\nDISARM_DELAY,10\n"),
    ),
    "M127": RuleCases(
        fires=lambda: found(PLAIN, ARDUPILOT, "PILOT_SPEED_UP,0\n"),
        boundary=lambda: found(PLAIN, ARDUPILOT, "MOT_SPIN_MIN,0.3\n"),
        silent=lambda: found(PLAIN, ARDUPILOT, "PILOT_SPEED_UP,0\nARMING_CHECK,0\n"),
    ),
    "M102": RuleCases(
        fires=lambda: found(then()),
        boundary=lambda: found(PLAIN, ARDUPILOT, "RTL_ALT_FINAL,0\n"),
        silent=lambda: found(then(LAND)),
    ),
    "M103": RuleCases(
        fires=lambda: found(returning(jump(5, 1))),
        boundary=lambda: found(returning(jump(4, 1))),  # the last item there is
        silent=lambda: found(returning(jump(2, 1))),
    ),
    "M104": RuleCases(
        fires=lambda: first_place(FIRST_M - 0.001),
        boundary=lambda: first_place(FIRST_M),
        fires_at_boundary=True,
        silent=lambda: first_place(FIRST_M + 0.001),
    ),
    "M105": RuleCases(
        fires=lambda: found(returning(item(82, north(200), 20.0)), PX4),
        boundary=lambda: found(returning(item(16, north(200), 20.0, frame=6)), PX4),
        silent=lambda: found(returning(item(82, north(200), 20.0)), ARDUPILOT),
    ),
    "M106": RuleCases(
        fires=lambda: found(then(LAND, LAND_START), ARDUPILOT),
        boundary=lambda: found(then(LAND_START, LAND), ARDUPILOT),
        silent=lambda: found(returning(LAND_START, waypoint(50, 20)), ARDUPILOT),
    ),
    "M107": RuleCases(
        fires=lambda: found(replace(PLAIN, home=None)),
        boundary=lambda: found(replace(PLAIN, home=replace(HOME, altitude_amsl_m=None))),
        silent=lambda: found(PLAIN),
    ),
    "M108": RuleCases(
        fires=lambda: found(mission(DELAY, rtl())),
        boundary=lambda: found(mission(takeoff(20), rtl())),
        silent=lambda: found(PLAIN),
    ),
    "M109": RuleCases(
        fires=lambda: found(replace(PLAIN, autopilot=PX4), ARDUPILOT),
        boundary=lambda: found(replace(PLAIN, autopilot=None), ARDUPILOT),
        silent=lambda: found(replace(PLAIN, autopilot=ARDUPILOT), ARDUPILOT),
    ),
    "M110": RuleCases(
        fires=lambda: found(near_null_island(0.0), PX4),
        boundary=lambda: found(near_null_island(1e-7), PX4),  # the least a mission can say
        silent=lambda: found(near_null_island(0.0), ARDUPILOT),
    ),
    "M111": RuleCases(
        fires=lambda: found(pitched(15.0)),
        boundary=lambda: found(pitched(5.0)),
        fires_at_boundary=True,
        silent=lambda: found(pitched(4.9)),
    ),
    "M112": RuleCases(
        fires=lambda: found(
            returning(item(93, frame=2, params=(1.0, None, -1.0, -1.0))), ARDUPILOT
        ),
        boundary=lambda: found(heading(None), ARDUPILOT),
        silent=lambda: found(returning(item(93, frame=2, params=(1.0, None, -1.0, -1.0))), PX4),
    ),
    "M113": RuleCases(
        fires=lambda: found(circle(256.0), ARDUPILOT),
        boundary=lambda: found(circle(255.0), ARDUPILOT),
        silent=lambda: found(circle(260.0), ARDUPILOT),
    ),
    "M114": RuleCases(
        fires=lambda: found(heading(0.0), PX4),
        boundary=lambda: found(heading(0.001), PX4),
        silent=lambda: found(heading(None), PX4),
    ),
    "M115": RuleCases(
        fires=lambda: found(TEXT),
        boundary=lambda: found(replace(pitched(15.0), file_format=MissionFormat.WPL)),
        silent=lambda: found(PLAIN),
    ),
    "M116": RuleCases(
        fires=lambda: required("T"), boundary=lambda: required(""), silent=lambda: required("TL")
    ),
    "M118": RuleCases(
        fires=lambda: with_rally(300.1, 300.0),
        boundary=lambda: with_rally(300.0, 300.0),
        silent=lambda: with_rally(299.9, 300.0),
    ),
    "M119": RuleCases(
        fires=lambda: gate(0.049),
        boundary=lambda: gate(0.0501),  # 5 cm to the tenth of a millimetre of the test's own metres
        silent=lambda: gate(1.0),
    ),
    "M120": RuleCases(
        fires=lambda: landing_at(12.0, asked=True),
        boundary=lambda: landing_at(0.0, asked=True),
        silent=lambda: landing_at(12.0, asked=False),
    ),
    "M121": RuleCases(
        fires=lambda: found(returning(speed(3.0), jump(3, -1)), ARDUPILOT),
        boundary=lambda: found(returning(DELAY, jump(3, -1)), ARDUPILOT),
        silent=lambda: found(returning(speed(3.0), jump(2, -1)), ARDUPILOT),
    ),
    "M122": RuleCases(
        fires=lambda: site(FARTHEST_M - 0.001),
        boundary=lambda: site(FARTHEST_M),
        silent=lambda: site(FARTHEST_M + 0.001),
    ),
    "M123": RuleCases(
        fires=lambda: site(None, "NAV_LAND"),
        boundary=lambda: site(None, "NAV_RETURN_TO_LAUNCH"),
        silent=lambda: site(None),
    ),
    "M124": RuleCases(
        fires=lambda: far_away(10_001.0),
        boundary=lambda: far_away(10_000.0 + 1e-8),
        fires_at_boundary=True,
        silent=lambda: far_away(9_999.0),
    ),
    "M125": RuleCases(
        fires=lambda: with_jumps(16), boundary=lambda: with_jumps(15), silent=lambda: with_jumps(1)
    ),
}
