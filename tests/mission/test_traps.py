"""Every trap of mission files in the wild, one small file for each: what is read, what is told.

The numbers are those of the list of traps the formats were studied with.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from plan_text import PLAN, STRUCTURE_SCAN, SURVEY, plan_with, simple_item

from planner.autopilot import Autopilot
from planner.errors import MissionFileError
from planner.mission.files import read_mission_bytes
from planner.mission.route.route import make_route
from planner.service.preflight import check
from planner.values import Value
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.service.preflight import CheckResult

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
VEHICLES = {PX4: "px4-sih-quad", ARDUPILOT: "arducopter-sitl-quad"}
JUDGED = frozenset({"M105", "M112", "T101"})
"""Told by the rules that judge a whole case, to which others may come."""
NO_TERRAIN = "X902"

HOME_ROW = "0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5455\t488\t1"
TAKEOFF_ROW = "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t20\t1"
WAYPOINT_ROW = "2\t0\t3\t16\t0\t0\t0\t0\t47.3987\t8.5455\t30\t1"
RTL_ROW = "3\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1"


class Trap(Value, dict=True):
    """A file, who flies it, and what has to come out of it."""

    number: int
    says: str
    content: str | bytes
    flown_by: Autopilot = PX4
    codes: frozenset[str]
    """Every finding that reading and following the file brings about, and some of the judgement."""
    commands: tuple[int, ...]
    word: str = ""
    """Stands in the message of a finding."""
    heights_m: tuple[float, ...] | None = None
    """Above home, at the end of each stage."""
    also: Callable[[Mission, Route], bool] = lambda _mission, _route: True


class Refusal(Value, dict=True):
    """A file that is no multicopter's mission, and the sentence about it."""

    number: int
    says: str
    content: str | bytes
    sentence: str


def rows(*lines: str, header: str = "QGC WPL 110", end: str = "\n") -> str:
    return end.join((header, *lines)) + end


def changed(row: str, **fields: object) -> str:
    """Return a row with some fields changed, by the names below."""
    names = (
        "seq",
        "current",
        "frame",
        "command",
        "p1",
        "p2",
        "p3",
        "p4",
        "lat",
        "lon",
        "alt",
        "go",
    )
    values = dict(zip(names, row.split("\t"), strict=True)) | fields
    return "\t".join(map(str, values.values()))


def plan(*items: dict[str, Any], firmware: int = 12) -> str:
    """Return a plan without fence and rally points that goes up, does the items and returns."""
    takeoff = simple_item(22, 3, 0, 0, 0, None, 47.3977, 8.5455, 20, number=1)
    back = PLAN["mission"]["items"][-1] | {"doJumpId": 90}
    mission = PLAN["mission"] | {"items": [takeoff, *items, back], "firmwareType": firmware}
    fence = {"version": 2, "circles": [], "polygons": []}
    rally = {"version": 2, "points": []}
    return json.dumps(PLAN | {"mission": mission, "geoFence": fence, "rallyPoints": rally})


def going(altitude: float | None = 30, *, frame: int = 3, number: int = 2, **keys: object) -> Any:  # noqa: ANN401 (an element of a JSON list)
    """Return a waypoint of a plan, some keys of it written otherwise."""
    item = simple_item(16, frame, 0, 0, 0, None, 47.3987, 8.5455, altitude, number=number)
    return item | keys


def doing(command: int, *params: float, number: int, frame: int = 2) -> dict[str, Any]:
    """Return an item of a plan that has no place."""
    values = [*params, *(0,) * (7 - len(params))]
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": frame,
        "params": values,
        "autoContinue": True,
        "doJumpId": number,
    }


def fences(mission: Mission) -> list[bool]:
    assert mission.fence is not None
    polygons = [polygon.inclusion for polygon in mission.fence.polygons]
    return polygons + [circle.inclusion for circle in mission.fence.circles]


LAPS = (going(), going(40, number=3), doing(177, 2, -1, number=4))
OLD_FILE = {
    "MAV_AUTOPILOT": 12,
    "complexItems": [],
    "groundStation": "QGroundControl",
    "items": [
        {"type": "missionItem", "command": command, "frame": 3, "id": number, "autoContinue": True}
        | {f"param{n}": 0 for n in range(1, 5)}
        | {"coordinate": [47.3977, 8.5455, 20]}
        for number, command in enumerate((22, 21), start=1)
    ],
    "plannedHomePosition": None,
    "version": "1.0",
}
HOME_AS_ITEM = {"type": "missionItem", "coordinate": [47.3977, 8.5455, 488]}
MANY = 1000

TRAPS = (
    Trap(
        number=1,
        says="the altitude shown is not the one flown",
        content=plan(going(14, Altitude=2)),
        codes=frozenset({"L103"}),
        word="shown at 2 m and flown at 14 m",
        commands=(22, 16, 20),
        heights_m=(20, 14, 0),
    ),
    Trap(
        number=2,
        says="altitude mode 0 meant relative in 2018",
        content=plan(going(AltitudeMode=0)),
        codes=frozenset({"L104"}),
        word="mode 0",
        commands=(22, 16, 20),
        heights_m=(20, 30, 0),
    ),
    Trap(
        number=3,
        says="the frame disagrees with the altitude mode",
        content=plan(going(AltitudeMode=2)),
        codes=frozenset({"L104"}),
        word="shown as AMSL (mode 2) and flown above home (frame 3)",
        commands=(22, 16, 20),
        heights_m=(20, 30, 0),
    ),
    Trap(
        number=4,
        says="null for heading, altitude and home",
        content=plan(going(None, Altitude=30)).replace(
            "[47.3977, 8.5455, 488.0]", "[null, null, null]"
        ),
        codes=frozenset({"A109", "M107"}),
        word="no altitude",
        commands=(22, 16, 20),
        heights_m=(20, 20, 0),
        also=lambda mission, _: mission.home is None and mission.items[1].param4 is None,
    ),
    Trap(
        number=5,
        says="the items of a survey stand inside it",
        content=plan(going(), SURVEY),
        codes=frozenset(),
        commands=(22, 16, 16, 206, 20),
        heights_m=(20, 30, 50, 0),
    ),
    Trap(
        number=6,
        says="a structure scan holds no items",
        content=plan(STRUCTURE_SCAN),
        codes=frozenset({"L115"}),
        # 4 + layers · (vertices + 3) items: the entrance, the place to look at, two laps, the exit.
        commands=(22, 16, 196, *(16, 206, 16, 16, 16, 16, 206) * 2, 197, 16, 20),
    ),
    Trap(
        number=7,
        says="jump ids count the items inside complex ones, and may stand twice",
        content=plan(going(), SURVEY, going(number=5), doing(177, 5, 1, number=5)),
        codes=frozenset({"L106", "L121"}),
        word="items 5 and 6 both have doJumpId 5",
        commands=(22, 16, 16, 206, 16, 177, 20),
        also=lambda _, route: route.reached == (1, 2, 3, 4, 5, 6, 5, 6, 7),
    ),
    Trap(
        number=8,
        says="a jump for ever",
        content=plan(*LAPS),
        codes=frozenset({"L121", "T101"}),
        word="endless loop: one lap takes",
        commands=(22, 16, 16, 177, 20),
        also=lambda _, route: route.reached == (1, 2, 3, 4, 2, 3, 4),
    ),
    Trap(
        number=9,
        says="items behind the return that a failsafe reaches",
        content=rows(
            HOME_ROW,
            TAKEOFF_ROW,
            RTL_ROW,
            "3\t0\t3\t189\t0\t0\t0\t0\t0\t0\t0\t1",
            "4\t0\t3\t21\t0\t0\t0\t0\t47.3987\t8.5455\t0\t1",
        ).replace(RTL_ROW, changed(RTL_ROW, seq=2)),
        flown_by=ARDUPILOT,
        codes=frozenset({"M115", "T104"}),
        word="2 items from 3 on after the end of the flight at item 2: not flown, "
        "reached by a failsafe only",
        commands=(22, 20, 189, 21),
        also=lambda _, route: route.reached == (1, 2),
    ),
    Trap(
        number=10,
        says="no home row: loaders swallow the take-off",
        content=rows(*(changed(row, seq=n) for n, row in enumerate((TAKEOFF_ROW, RTL_ROW)))),
        flown_by=ARDUPILOT,
        codes=frozenset({"L152", "M107", "M115"}),
        word="QGroundControl takes it as home and drops it",
        commands=(22, 20),
    ),
    Trap(
        number=11,
        says="blanks between the fields",
        content=rows(
            *(row.replace("\t", "  ") for row in (HOME_ROW, TAKEOFF_ROW, RTL_ROW))
        ).replace("3  0", "2 \t0"),
        flown_by=ARDUPILOT,
        codes=frozenset({"L151", "M115"}),
        word="QGroundControl refuses this file: not 12 fields between tabs in 3 rows",
        commands=(22, 20),
    ),
    Trap(
        number=12,
        says="nan and null for numbers",
        content=rows(HOME_ROW, TAKEOFF_ROW, changed(WAYPOINT_ROW, p1="nan", p4="null"), RTL_ROW),
        flown_by=ARDUPILOT,
        codes=frozenset({"L154", "M112", "M115"}),
        word="ArduPilot refuses NAV_WAYPOINT with parameter 1 not set",
        commands=(22, 16, 20),
        also=lambda mission, _: mission.items[1].param4 is None,
    ),
    Trap(
        number=13,
        says="comments and blank lines",
        content=rows(HOME_ROW, "# up", TAKEOFF_ROW, "", WAYPOINT_ROW + "\t# over there", RTL_ROW),
        flown_by=ARDUPILOT,
        codes=frozenset({"L151", "M115"}),
        word="2 comments, 1 blank line",
        commands=(22, 16, 20),
    ),
    Trap(
        number=14,
        says="byte order mark, CRLF, a blank behind the header",
        content=b"\xef\xbb\xbf"
        + rows(
            HOME_ROW, TAKEOFF_ROW, WAYPOINT_ROW, RTL_ROW, header="QGC WPL 110 ", end="\r\n"
        ).encode(),
        flown_by=ARDUPILOT,
        codes=frozenset({"L150", "L162", "M115"}),
        word="byte order mark",
        commands=(22, 16, 20),
    ),
    Trap(
        number=15,
        says="a broken header",
        content=rows(HOME_ROW, TAKEOFF_ROW, WAYPOINT_ROW, RTL_ROW, header="QGC WP L110"),
        flown_by=ARDUPILOT,
        codes=frozenset({"L150", "M115"}),
        word="'QGC WP L110'",
        commands=(22, 16, 20),
    ),
    Refusal(
        number=16,
        says="another format under the same suffix",
        content='<?xml version="1.0"?><MISSION><MISSIONITEM no="1" action="WAYPOINT"/></MISSION>',
        sentence="this is a MultiWii or iNav mission",
    ),
    Trap(
        number=17,
        says="JSON from before plans",
        content=json.dumps(OLD_FILE | {"plannedHomePosition": HOME_AS_ITEM}),
        codes=frozenset({"L117"}),
        word="QGroundControl no longer opens it",
        commands=(22, 21),
        heights_m=(20, 0),
    ),
    Refusal(
        number=18,
        says="a version that nobody reads",
        content=plan_with(42, "version"),
        sentence="its version is 42, expected 1",
    ),
    Trap(
        number=19,
        says="sections are missing, and the place stands beside seven zeros",
        content=json.dumps(
            {
                key: value
                for key, value in json.loads(
                    plan(going(coordinate=[47.3987, 8.5455, 30], params=[0] * 7))
                ).items()
                if key not in {"geoFence", "rallyPoints"}
            }
        ),
        codes=frozenset({"L101", "L111", "M114"}),
        word="geoFence, rallyPoints missing: QGroundControl refuses the file",
        commands=(22, 16, 20),
        heights_m=(20, 30, 0),
    ),
    Trap(
        number=20,
        says="a fence of version 1 is passed over",
        content=json.dumps(
            json.loads(plan(going())) | {"geoFence": {"version": 1, "polygon": [[1, 1]]}}
        ),
        codes=frozenset({"L107"}),
        word="every loader ignores",
        commands=(22, 16, 20),
        also=lambda mission, _: mission.fence is None,
    ),
    Trap(
        number=21,
        says="a landing at 0, 0 means here",
        content=plan(going(), simple_item(21, 3, 0, 0, 0, None, 0, 0, 0, number=3)),
        codes=frozenset({"M110", "T104"}),
        word="NAV_LAND at 0°, 0°: PX4 flies to that place; predicted as 'here'",
        commands=(22, 16, 21, 20),
        also=lambda _, route: route.stages[2].north_m == route.stages[1].north_m,
    ),
    Trap(
        number=22,
        says="altitude 0 means as before to ArduPilot",
        content=rows(HOME_ROW, TAKEOFF_ROW, changed(WAYPOINT_ROW, alt=0), RTL_ROW),
        flown_by=ARDUPILOT,
        codes=frozenset({"M115"}),
        commands=(22, 16, 20),
        heights_m=(20, 20, 0),
    ),
    Trap(
        number=23,
        says="an AMSL altitude that was meant above home",
        content=rows(HOME_ROW, TAKEOFF_ROW, changed(WAYPOINT_ROW, frame=0, alt=50), RTL_ROW),
        flown_by=ARDUPILOT,
        codes=frozenset({"A107", "M115"}),
        word="50 m AMSL, 438 m below home",
        commands=(22, 16, 20),
        heights_m=(20, 50 - 488, 0),
    ),
    Trap(
        number=24,
        says="a speed in the place of its type",
        content=rows(
            HOME_ROW,
            TAKEOFF_ROW,
            "2\t0\t3\t178\t15\t4\t0\t0\t0\t0\t0\t1",
            changed(WAYPOINT_ROW, seq=3),
            changed(RTL_ROW, seq=4),
        ),
        flown_by=ARDUPILOT,
        codes=frozenset({"M115", "T102"}),
        word="no speed type 15; speed unchanged",
        commands=(22, 178, 16, 20),
        also=lambda _, route: route.stages[1].speed_m_s is None,
    ),
    Trap(
        number=25,
        says="delays on the ground, in the air and until a time of day",
        content=rows(
            HOME_ROW,
            "1\t0\t3\t93\t60\t-1\t-1\t-1\t0\t0\t0\t1",
            changed(TAKEOFF_ROW, seq=2),
            "3\t0\t3\t93\t30\t-1\t-1\t-1\t0\t0\t0\t1",
            "4\t0\t3\t93\t-1\t14\t30\t-1\t0\t0\t0\t1",
            changed(RTL_ROW, seq=5),
        ),
        flown_by=ARDUPILOT,
        codes=frozenset({"M115", "T107"}),
        word="waits in the air until 14:30:-- UTC: not counted",
        commands=(93, 22, 93, 93, 20),
        also=lambda _, route: [stage.hold_s for stage in route.stages] == [0.0, 30.0, 0.0],
    ),
    Trap(
        number=26,
        says="altitudes above terrain",
        content=rows(HOME_ROW, TAKEOFF_ROW, changed(WAYPOINT_ROW, frame=10), RTL_ROW),
        flown_by=ARDUPILOT,
        codes=frozenset({"A108", "L160", "M115"}),
        word="above unknown terrain",
        commands=(22, 16, 20),
        heights_m=(20, 30, 0),
    ),
    Trap(
        number=27,
        says="fence and rally rows among the items",
        content=rows(
            HOME_ROW,
            TAKEOFF_ROW,
            *(
                f"{n}\t0\t3\t5001\t3\t0\t0\t0\t{latitude}\t{longitude}\t0\t1"
                for n, (latitude, longitude) in enumerate(
                    ((47.3, 8.4), (47.5, 8.4), (47.4, 8.7)), start=2
                )
            ),
            "5\t0\t3\t5100\t0\t0\t0\t0\t47.3987\t8.5455\t25\t1",
            changed(RTL_ROW, seq=6),
        ),
        flown_by=ARDUPILOT,
        codes=frozenset({"L156", "M115"}),
        word="3 fence rows and 1 rally row inside the mission",
        commands=(22, 20),
        also=lambda mission, _: fences(mission) == [True] and len(mission.rally) == 1,
    ),
    Trap(
        number=28,
        says="a fence of areas to keep out of alone",
        content=json.dumps(
            json.loads(plan(going()))
            | {"geoFence": PLAN["geoFence"] | {"polygons": [], "breachReturn": [47.4, 8.54, 30]}}
        ),
        codes=frozenset(),
        commands=(22, 16, 20),
        also=lambda mission, _: fences(mission) == [False],
    ),
    Refusal(
        number=29,
        says="another vehicle's mission",
        content=plan(going()).replace('"vehicleType": 2', '"vehicleType": 1'),
        sentence="this is a fixed-wing mission (the file has vehicleType 1",
    ),
    Trap(
        number=30,
        says="autoContinue is off",
        content=plan(going(autoContinue=False)),
        codes=frozenset({"T108"}),
        word="PX4 holds here",
        commands=(22, 16, 20),
    ),
    Trap(
        number=31,
        says="heading 0 where none was meant",
        content=plan(going(params=[0, 0, 0, 0, 47.3987, 8.5455, 30])),
        codes=frozenset({"M114"}),
        word="PX4 turns north",
        commands=(22, 16, 20),
        also=lambda _, route: route.stages[1].yaw_deg == 0.0,
    ),
    Trap(
        number=32,
        says="a command that MAVLink does not know",
        content=plan(going(), doing(50_001, 1, number=3)),
        codes=frozenset({"M105", "T102"}),
        word="MAV_CMD 50001 is not modelled: 0 s and 0 Wh are assumed",
        commands=(22, 16, 50_001, 20),
    ),
    Trap(
        number=33,
        says="a long file with characters beyond ASCII",
        content=plan(*(going(number=n) for n in range(2, MANY))).replace(
            "QGroundControl", "Bodenstation Zürich ✈"
        ),
        codes=frozenset(),
        commands=(22, *(16,) * (MANY - 2), 20),
    ),
)


def checked(mission: Mission, flown_by: Autopilot) -> CheckResult:
    return check(mission, load_vehicle(VEHICLES[flown_by]), battery=Battery(capacity_wh=500.0))


def test_every_trap_has_a_file() -> None:
    assert [trap.number for trap in TRAPS] == list(range(1, 34))


@pytest.mark.parametrize("trap", TRAPS, ids=lambda trap: f"{trap.number:02} {trap.says}")
def test_a_trap_is_seen_and_said(trap: Trap | Refusal) -> None:
    content = trap.content if isinstance(trap.content, bytes) else trap.content.encode()
    if isinstance(trap, Refusal):
        with pytest.raises(MissionFileError) as caught:
            make_route(read_mission_bytes(content, source="a file"))
        assert trap.sentence in str(caught.value)
        return
    mission = read_mission_bytes(content, source="a file")
    assert tuple(item.command for item in mission.items) == trap.commands
    route = make_route(mission, dialect=trap.flown_by)
    findings = checked(mission, trap.flown_by).findings
    told = {finding.code for finding in (*mission.findings, *route.findings)}
    assert told == (trap.codes - JUDGED) | {NO_TERRAIN}
    assert trap.codes <= {finding.code for finding in findings}
    assert any(trap.word in finding.message for finding in findings)
    if trap.heights_m is not None:
        heights_m = [stage.height_m for stage in route.stages]
        assert heights_m == pytest.approx(list(trap.heights_m), abs=1e-9)
    assert trap.also(mission, route)
