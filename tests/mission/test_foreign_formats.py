"""Missions of other programs: read where they can mean one thing, else refused in a sentence."""

from __future__ import annotations

import io
import json
import zipfile
from typing import TYPE_CHECKING

import pytest

from planner.errors import MissionFileError
from planner.findings import Severity
from planner.mission.commands import Command, Frame
from planner.mission.files import read_mission_bytes
from planner.service.preflight import check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.mission.items import Mission

LINE = (
    '<?xml version="1.0" encoding="UTF-16"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document>'
    "<Placemark><name>Dam</name><LineString><altitudeMode>{mode}</altitudeMode>"
    "<coordinates>\n8.0,47.0,{height} 8.001,47.0,60\n8.001,47.001,60 </coordinates></LineString>"
    "</Placemark>{more}</Document></kml>"
)
AREA = (
    "<Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>7.99,46.99 8.01,46.99 8.01,47.01 "
    "7.99,46.99</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>"
)
WAYPOINT = (
    "<Placemark><Point><coordinates>\n{longitude},47.0\n</coordinates></Point><wpml:index>{index}"
    "</wpml:index><wpml:executeHeight>{height}</wpml:executeHeight><wpml:waypointSpeed>{speed}"
    "</wpml:waypointSpeed>{action}</Placemark>"
)
HOVER = (
    "<wpml:actionGroup><wpml:action><wpml:actionActuatorFunc>hover</wpml:actionActuatorFunc>"
    "<wpml:actionActuatorFuncParam><wpml:hoverTime>12</wpml:hoverTime></wpml:actionActuatorFuncParam>"
    "</wpml:action><wpml:action><wpml:actionActuatorFunc>takePhoto</wpml:actionActuatorFunc>"
    "</wpml:action></wpml:actionGroup>"
)
DJI = (
    '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:wpml="http://www.dji.com/wpmz/1.0.2"><Document>'
    "<wpml:missionConfig><wpml:finishAction>{end}</wpml:finishAction><wpml:takeOffSecurityHeight>20"
    "</wpml:takeOffSecurityHeight></wpml:missionConfig><Folder><wpml:executeHeightMode>{mode}"
    "</wpml:executeHeightMode>{marks}</Folder></Document></kml>"
)
LITCHI = (
    "latitude,longitude,altitude(m),heading(deg),curvesize(m),rotationdir,gimbalmode,gimbalpitchangle,"
    "actiontype1,actionparam1,actiontype2,actionparam2,altitudemode,speed(m/s)\n"
)


def line(mode: str = "absolute", height: str = "50", more: str = "") -> str:
    return LINE.format(mode=mode, height=height, more=more)


def dji(mode: str = "relativeToStartPoint", end: str = "autoLand") -> str:
    marks = [
        WAYPOINT.format(longitude=8.001, index=1, height=40, speed=7, action=""),
        WAYPOINT.format(longitude=8.0, index=0, height=30, speed=5, action=HOVER),
    ]
    return DJI.format(mode=mode, end=end, marks="".join(marks))


def packed(**files: str) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, text in files.items():
            archive.writestr(name.replace("__", "/").replace("_", "."), text)
    return data.getvalue()


def read(data: str | bytes, name: str = "x") -> Mission:
    return read_mission_bytes(data.encode() if isinstance(data, str) else data, source=name)


def refusal(data: str | bytes) -> str:
    with pytest.raises(MissionFileError) as caught:
        read(data)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def flown(mission: Mission) -> list[tuple[int, float | None, float | None, float | None]]:
    return [
        (one.command, one.latitude_deg, one.longitude_deg, one.altitude_m)
        for one in mission.items
        if one.command != Command.DO_CHANGE_SPEED
    ]


@pytest.mark.parametrize(
    ("mode", "frame"), [("absolute", Frame.GLOBAL), ("relativeToGround", Frame.GLOBAL_TERRAIN_ALT)]
)
def test_the_one_line_of_a_kml_is_flown(mode: str, frame: Frame) -> None:
    for data in (line(mode, more=AREA), packed(doc_kml=line(mode, more=AREA))):
        mission = read(data)
        assert flown(mission) == [
            (Command.NAV_TAKEOFF, 47.0, 8.0, 50.0),
            (Command.NAV_WAYPOINT, 47.0, 8.0, 50.0),
            (Command.NAV_WAYPOINT, 47.0, 8.001, 60.0),
            (Command.NAV_WAYPOINT, 47.001, 8.001, 60.0),
            (Command.NAV_RETURN_TO_LAUNCH, 0.0, 0.0, 0.0),
        ]
        assert {one.frame for one in mission.items[:-1]} == {frame}
        assert mission.fence is not None
        [area] = mission.fence.polygons
        assert area.inclusion
        assert area.vertices_deg == ((46.99, 7.99), (46.99, 8.01), (47.01, 8.01))
        [finding] = mission.findings
        assert (finding.code, finding.severity) == ("L165", Severity.WARNING)
        for told in ("'Dam'", "home at the first point", "a return home", "1 area as the fence"):
            assert told in finding.message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (line("clampToGround"), "'Dam' has no altitudes to fly at (altitudeMode clampToGround)"),
        (line().replace("8.001,47.001,60", "8.001,47.001"), "point 3 of the line 'Dam' has no altitude"),
        (line(height="high"), "expected a number, got 'high'"),
        (line(height="nan"), "point 1"),
        (line(more=line()[line().index("<Placemark>") : line().index("</Document>")]), "2 lines (Dam, Dam)"),
        (LINE.split("<Placemark>", maxsplit=1)[0] + AREA + "</Document></kml>", "no line (1 polygon"),
        ("<kml><Document>", "XML that is broken here"),
        ("<kml>" + "<a>" * 200 + "</a>" * 200 + "</kml>", "nested deeper than 100"),
        ('<!DOCTYPE kml [<!ENTITY a "aaaa">]><kml>&a;</kml>', "without them"),
        (dji(mode="WGS84"), "heights above the ellipsoid"),
        (dji(mode="realTimeFollowSurface"), "as its radar finds it"),
        (dji(end="dance"), "ends with 'dance'"),
        (dji().replace("wpml:executeHeight>", "wpml:height>"), "without a route to execute"),
        (LITCHI.replace("(m)", "(ft)"), "export it in metres"),
        (LITCHI + "47,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n47,8,here,0,0,0,0,0,-1,0,-1,0,0,5\n", "x:3:1: altitude"),
        (LITCHI + "47,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n47,8,30,0,0,0,0,0,-1,0,-1,0,1,5\n", "above the ground"),
        (LITCHI + "47,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n47,8,30,0,0,0,0,0,-1,0,-1,0,0,0\n", "x:3:1: waypoint 2"),
        (LITCHI, "without a point to fly to"),
        (LITCHI + "97,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n", "x:2:1: point 1: 97, 8 is no place"),
        ('{"type": "LineString", "coordinates": [[8, 47], [8.1, 47]]}', "point 1 of the line has no alt"),
        ('{"type": "MultiLineString", "coordinates": [[], []]}', "GeoJSON with 2 lines"),
        ('{"type": "LineString", "coordinates": [[8, 47, "up"]]}', "no list of positions"),
        ('{"type": "FeatureCollection", "features": 7}', "GeoJSON with no lines"),
        ('{"type": "Feature", "geometry": {"type": {}}}', "GeoJSON with no lines"),
    ],
)  # fmt: skip
def test_what_may_mean_more_than_one_thing_is_refused(text: str, said: str) -> None:
    assert said in refusal(text)


def test_djis_waypoints_are_flown_in_their_order_with_their_hovers_and_end() -> None:
    for data in (dji(), packed(wpmz__template_kml="<kml/>", wpmz__waylines_wpml=dji())):
        mission = read(data)
        assert flown(mission) == [
            (Command.NAV_TAKEOFF, 47.0, 8.0, 20.0),
            (Command.NAV_WAYPOINT, 47.0, 8.0, 30.0),
            (Command.NAV_WAYPOINT, 47.0, 8.001, 40.0),
            (Command.NAV_LAND, 47.0, 8.001, 0.0),
        ]
        assert mission.items[1].param1 == 12.0
        speeds = [one.param2 for one in mission.items if one.command == Command.DO_CHANGE_SPEED]
        assert speeds == [5.0, 7.0]
        [finding] = mission.findings
        assert "no time for takePhoto" in finding.message
    assert flown(read(dji(end="noAction")))[-1][0] == Command.NAV_LOITER_UNLIM
    assert flown(read(dji(end="gotoFirstWaypoint")))[-1][1:] == (47.0, 8.0, 30.0)


def test_litchis_waypoints_stay_as_long_as_they_say() -> None:
    rows = "47,8,30,0,5,0,0,0,0,2500,1,0,0,4\n47.001,8,35,0,0,0,0,0,-1,0,-1,0,0,4\n\n"
    mission = read(LITCHI + rows, name="mission.csv")
    assert flown(mission)[:3] == [
        (Command.NAV_TAKEOFF, 47.0, 8.0, 30.0),
        (Command.NAV_WAYPOINT, 47.0, 8.0, 30.0),
        (Command.NAV_WAYPOINT, 47.001, 8.0, 35.0),
    ]
    assert mission.items[1].param1 == 2.5
    assert [one.place.line for one in mission.items[1:4] if one.place is not None] == [2, 2, 3]
    [finding] = mission.findings
    for told in ("each speed from its waypoint on", "straight legs", "camera and gimbal"):
        assert told in finding.message


def test_a_geojson_line_is_checked_like_any_mission() -> None:
    shape = {"type": "LineString", "coordinates": [[8.0, 47.0, 450], [8.002, 47.0, 460]]}
    ring = [[7.9, 46.9], [8.1, 46.9], [8.1, 47.1], [7.9, 46.9]]
    features = [
        {"type": "Feature", "properties": {}, "geometry": shape},
        {"type": "Feature", "properties": None, "geometry": {"type": "Polygon", "coordinates": [ring]}},
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [8, 47]}},
    ]  # fmt: skip
    mission = read(json.dumps({"type": "FeatureCollection", "features": features}))
    assert mission.fence is not None
    result = check(
        mission,
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=77.0),
        home_amsl_m=400.0,
    )
    # Up 50 m, 152 m east and 10 m up (a degree is 111.2 km × cos 47°), and back.
    assert result.totals.distance_m == pytest.approx(2 * 152.0, abs=2.0)
    assert result.totals.climb_m >= 60.0
    assert "L165" in {finding.code for finding in result.findings}
