"""Missions of other programs: read where they can mean one thing, else refused in a sentence."""

from __future__ import annotations

import io
import json
import math
import zipfile
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.errors import MissionFileError
from planner.findings import Severity
from planner.mission.commands import Command, Frame
from planner.mission.files import read_mission_bytes
from planner.service.preflight import check
from planner.values import replace
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
RING = "<LinearRing><coordinates>7.99,46.99 8.01,46.99 8.01,47.01 7.99,46.99</coordinates></LinearRing>"
AREA = (
    "<Placemark><name>Fence</name><Polygon><outerBoundaryIs>"
    f"{RING}</outerBoundaryIs></Polygon></Placemark>"
)
MOVED = "</coordinates><altitudeOffset>-9</altitudeOffset>"
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


def group(name: str, *, first: int, last: int, trigger: str = "reachPoint", more: str = "") -> str:
    return (
        f"<wpml:actionGroup><wpml:actionGroupStartIndex>{first}</wpml:actionGroupStartIndex>"
        f"<wpml:actionGroupEndIndex>{last}</wpml:actionGroupEndIndex><wpml:actionTrigger>"
        f"<wpml:actionTriggerType>{trigger}</wpml:actionTriggerType></wpml:actionTrigger><wpml:action>"
        f"<wpml:actionActuatorFunc>{name}</wpml:actionActuatorFunc>{more}</wpml:action></wpml:actionGroup>"
    )


def dji(mode: str = "relativeToStartPoint", end: str = "autoLand") -> str:
    marks = [
        WAYPOINT.format(longitude=8.001, index=1, height=40, speed=7, action=""),
        WAYPOINT.format(longitude=8.0, index=0, height=30, speed=5, action=HOVER),
    ]
    return DJI.format(mode=mode, end=end, marks="".join(marks))


def drawn(kind: str, coordinates: object, **properties: object) -> str:
    """Return GeoJSON of a line and something else."""
    line = {"type": "LineString", "coordinates": [[8, 47, 450], [8.002, 47, 460]]}
    features = [
        {"type": "Feature", "properties": {}, "geometry": line},
        {
            "type": "Feature",
            "properties": properties,
            "geometry": {"type": kind, "coordinates": coordinates},
        },
        {"type": "Feature", "geometry": None},
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def sided(name: str, **properties: bool | str) -> str:
    """Return GeoJSON of a line and an area that states which side of it is flown on."""
    ring = [[8, 47], [8.01, 47], [8.01, 47.01], [8, 47]]
    return drawn("Polygon", [ring], name=name, **properties)


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
        (line().replace("</coordinates>", MOVED), "'Dam' is moved by -9 m"),
        (line(more=line()[line().index("<Placemark>") : line().index("</Document>")]), "2 lines (Dam, Dam)"),
        (LINE.split("<Placemark>", maxsplit=1)[0] + AREA + "</Document></kml>", "no line (1 polygon"),
        ("<kml><Document>", "XML that is broken here"),
        ("<kml>" + "<a>" * 200 + "</a>" * 200 + "</kml>", "nested deeper than 100"),
        ('<!DOCTYPE kml [<!ENTITY a "aaaa">]><kml>&a;</kml>', "without them"),
        (dji(mode="WGS84"), "heights above the ellipsoid"),
        (dji(mode="realTimeFollowSurface"), "as its radar finds it"),
        (dji(end="dance"), "ends with 'dance'"),
        (dji().replace("wpml:executeHeight>", "wpml:height>"), "without a route to execute"),
        (dji().replace("index>1<", "index>0<"), "two waypoints with the index 0"),
        (dji().replace("index>1<", "index>0.5<"), "index is 0.5: waypoints are counted from 0"),
        (dji().replace(">12<", ">-12<"), "hoverTime is -12 s: give 0 or more"),
        (dji().replace(HOVER, group("zoom", first=1, last=0)), "actions from waypoint 1 to 0: there is no"),
        (dji().replace(HOVER, group("zoom", first=2, last=3)), "actions from waypoint 2 to 3: there is no"),
        (LITCHI.replace("(m)", "(ft)"), "export it in metres"),
        (LITCHI + "47,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n47,8,here,0,0,0,0,0,-1,0,-1,0,0,5\n", "x:3:1: altitude"),
        (LITCHI + "47,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n47,8,30,0,0,0,0,0,-1,0,-1,0,1,5\n", "above the ground"),
        (LITCHI + "47,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n47,8,30,0,0,0,0,0,-1,0,-1,0,0,0\n", "x:3:1: waypoint 2"),
        (LITCHI, "without a point to fly to"),
        (LITCHI + "97,8,30,0,0,0,0,0,-1,0,-1,0,0,5\n", "x:2:1: point 1: 97, 8 is no place"),
        ('{"type": "LineString", "coordinates": [[8, 47], [8.1, 47]]}', "point 1 of the line has no alt"),
        ('{"type": "MultiLineString", "coordinates": [[], []]}', "GeoJSON with 2 lines"),
        ('{"type": "MultiLineString", "coordinates": true}', "GeoJSON with no lines"),
        ('{"type": "LineString", "coordinates": [[8, 47, "up"]]}', "no list of positions"),
        ('{"type": "FeatureCollection", "features": 7}', "GeoJSON with no lines"),
        ('{"type": "Feature", "geometry": {"type": {}}}', "a geometry '{}': draw it"),
        ('{"type": "GeometryCollection", "geometries": [{"type": "Curve"}]}', "a geometry 'Curve': draw it"),
        (drawn("Point", [8, 47], name="Mast", radius=80), "a circle 'Mast': draw it as a polygon"),
        (drawn("MultiPolygon", []), "an area with fewer than three corners"),
        (drawn("Polygon", [[[8, 47], [8.01, 47], [8, 47]]]), "an area with fewer than three corners"),
        (drawn("Polygon", [[[8, 47], [8.01, 97], [8, 47.1]]]), "or one that is no place"),
        (line(more=AREA.replace("8.01,46.99 8.01,47.01 ", "8.01,46.99 ")), "three corners"),
        (line(more=AREA.replace("8.01,47.01", "8.01,nan")), "or one that is no place"),
        (line(more=AREA.replace("outerBoundaryIs", "innerBoundaryIs")), "a polygon with 0 outer rings"),
        (line(more=f"<Placemark>{RING}</Placemark>"), "a ring that is neither a line to fly nor a polygon"),
        (sided("Area", inclusion="no"), "an area 'Area' of inclusion 'no': give true"),
        (sided("Area", inclusion=True, is_inclusion=False), "an area 'Area' of inclusion 'True'"),
        (sided("No-fly", is_inclusion=True), "an area 'No-fly' of is_inclusion 'True'"),
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
        {"type": "Feature", "properties": {"name": "Fence"},
         "geometry": {"type": "Polygon", "coordinates": [ring]}},
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


def with_config(text: str, **settings: str) -> str:
    more = "".join(f"<wpml:{name}>{value}</wpml:{name}>" for name, value in settings.items())
    return text.replace("<wpml:missionConfig>", f"<wpml:missionConfig>{more}")


def test_djis_way_from_its_take_off_place_is_flown() -> None:
    # 0.01 degrees of latitude are 1,112 m; the last point is 76 m east of the first, which is home else.
    place = "46.99,8.0,512.3"
    template = with_config(
        "<kml><wpml:missionConfig></wpml:missionConfig></kml>", takeOffRefPoint=place
    )
    template = template.replace("<kml>", '<kml xmlns:wpml="http://www.dji.com/wpmz/1.0.2">')
    route = with_config(dji(end="goHome"), flyToWaylineMode="safely", globalTransitionalSpeed="2")
    mission = read(packed(wpmz__template_kml=template, wpmz__waylines_wpml=route))
    assert mission.home is not None
    assert (mission.home.latitude_deg, mission.home.longitude_deg) == (46.99, 8.0)
    assert mission.home.altitude_amsl_m is None
    assert flown(mission)[0] == (
        Command.NAV_TAKEOFF,
        46.99,
        8.0,
        30.0,
    )  # safely: as high as the first
    assert [one.param2 for one in mission.items if one.command == Command.DO_CHANGE_SPEED] == [
        2,
        5,
        7,
    ]
    far, near = (
        check(one, load_vehicle("falkowski-2023-quadrotor"), battery=Battery(capacity_wh=500.0))
        for one in (mission, read(dji(end="goHome")))
    )
    by_hand_m = 1112.0 + math.hypot(1112.0, 76.0) - 76.0
    assert far.totals.distance_m - near.totals.distance_m == pytest.approx(by_hand_m, abs=5.0)
    assert "M107" in {one.code for one in near.findings}
    assert "M107" not in {one.code for one in far.findings}


@pytest.mark.parametrize("place", ["", "0.000000,0.000000,0.000000"])
def test_a_take_off_place_that_is_not_given_is_assumed_and_reported(place: str) -> None:
    mission = read(with_config(dji(), takeOffRefPoint=place))
    assert mission.home is None
    assert "home at the first point" in mission.findings[0].message


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            {"takeOffRefPoint": "113.9,22.5,10"},
            "the place of the take-off: 113.9, 22.5 is no place",
        ),
        ({"takeOffRefPoint": "47.0"}, "expected latitude, longitude"),
        ({"takeOffRefPoint": "47.0,east,1"}, "expected a number, got 'east'"),
        ({"globalTransitionalSpeed": "0"}, "way to the first point at 0 m/s"),
    ],
)
def test_a_beginning_that_cannot_be_flown_is_refused(settings: dict[str, str], said: str) -> None:
    assert said in refusal(with_config(dji(), **settings))


def test_dji_climbs_before_it_returns_and_stops_where_its_turns_do() -> None:
    stops = dji(end="goHome").replace(
        "<wpml:waypointSpeed>7",
        "<wpml:waypointTurnMode>toPointAndStopWithDiscontinuityCurvature</wpml:waypointTurnMode>"
        "<wpml:waypointSpeed>7",
    )
    high = with_config(stops, globalRTHHeight="100")
    low = with_config(stops, globalRTHHeight="50")
    both = (packed(wpmz__template_kml=high, wpmz__waylines_wpml=one) for one in (stops, low))
    every: list[str | bytes] = [high, *both]
    for data in every:
        mission = read(data)
        assert flown(mission)[-2:] == [
            (Command.NAV_WAYPOINT, 47.0, 8.001, 100.0),
            (Command.NAV_RETURN_TO_LAUNCH, 0.0, 0.0, 0.0),
        ]
    assert [one.param1 for one in mission.items if one.command == Command.NAV_WAYPOINT] == [
        12,
        1,
        0,
    ]


def test_djis_return_height_is_that_of_returns_from_anywhere() -> None:
    """The model climbs 60 m at no more than 5 m/s on 130 W: 0.43 Wh at least, and down again."""
    low, high = (with_config(dji(end="goHome"), globalRTHHeight=text) for text in ("40", "100"))
    vehicle, pack = load_vehicle("falkowski-2023-quadrotor"), Battery(capacity_wh=77.0)
    stated, level, higher = (
        check(read(text), vehicle, battery=pack) for text in (low, dji(end="goHome"), high)
    )
    assert [
        any(one.code == "T112" for one in each.findings) for each in (stated, level, higher)
    ] == [False, True, False]
    plans = [each.assessment.returns.sample for each in (stated, level, higher) if each.assessment]
    least_wh, level_wh, higher_wh = (float(one.energy_wh.min()) for one in plans if one)
    assert least_wh >= level_wh
    assert higher_wh - level_wh > 2.0 * 0.43


def test_a_group_of_djis_actions_acts_at_each_of_its_points() -> None:
    hover = group("hover", first=0, last=1, more="<wpml:hoverTime>40</wpml:hoverTime>")
    mission = read(dji().replace(HOVER, hover))
    assert [one.param1 for one in mission.items if one.command == Command.NAV_WAYPOINT] == [40, 40]
    flying = group("takePhoto", first=0, last=1, trigger="multipleTiming")
    assert read(dji().replace(HOVER, flying)).unstated_wait_s == 0.0
    slow = dji().replace("<wpml:index>", "<wpml:useGlobalSpeed>1</wpml:useGlobalSpeed><wpml:index>")
    slow = slow.replace("<Folder>", "<Folder><wpml:autoFlightSpeed>0.3</wpml:autoFlightSpeed>")
    assert {one.param2 for one in read(slow).items if one.command == Command.DO_CHANGE_SPEED} == {
        0.3
    }


@pytest.mark.parametrize(
    ("name", "trigger", "each_s"),
    [
        ("takePhoto", "reachPoint", 6.0),
        ("zoom", "reachPoint", 0.0),
        ("orientedShoot", "reachPoint", 18.0),
        ("panoShot", "reachPoint", float("inf")),
        ("juggle", "reachPoint", float("inf")),
        ("juggle", "betweenAdjacentPoints", 0.0),
    ],
)
def test_what_djis_actions_may_take_is_bounded(name: str, trigger: str, each_s: float) -> None:
    mission = read(dji().replace(HOVER, group(name, first=0, last=1, trigger=trigger)))
    assert mission.unstated_wait_s == 2 * each_s


@pytest.mark.parametrize(("action", "wait_s"), [(1, 6.0), (5, 6.0), (0, 0.0), (99, float("inf"))])
def test_what_litchis_actions_may_take_is_bounded(action: int, wait_s: float) -> None:
    row = f"47,8,30,0,0,0,0,0,{action},0,-1,0,0,5\n"
    assert read(LITCHI + row).unstated_wait_s == wait_s


def test_holes_and_areas_called_no_fly_are_stayed_out_of() -> None:
    hole = AREA.replace(
        "</Polygon>",
        "<innerBoundaryIs><LinearRing><coordinates>7.999,46.999 8.0,46.999 8.0,47.0 7.999,46.999"
        "</coordinates></LinearRing></innerBoundaryIs></Polygon>",
    )
    mission = read(line(more=hole))
    assert mission.fence is not None
    assert [area.inclusion for area in mission.fence.polygons] == [True, False]
    assert "1 area as the fence to stay out of" in mission.findings[0].message
    named = AREA.replace("Fence", "No-Fly hospital")
    kept_out = read(line(more=named)).fence
    assert kept_out is not None
    assert not kept_out.polygons[0].inclusion
    assert "with a hole" in refusal(line(more=hole.replace("Fence", "NFZ")))
    ring = [[7.9, 46.9], [8.1, 46.9], [8.1, 47.1], [7.9, 46.9]]
    area = {"type": "Polygon", "coordinates": [ring]}
    features = [
        {"type": "Feature", "properties": {"name": "keep out"}, "geometry": area},
        {"type": "LineString", "coordinates": [[8.0, 47.0, 450], [8.002, 47.0, 460]]},
    ]  # fmt: skip
    fence = read(json.dumps({"type": "FeatureCollection", "features": features})).fence
    assert fence is not None
    assert not fence.polygons[0].inclusion


@pytest.mark.parametrize(
    ("wait_s", "severity"), [(60.0, Severity.WARNING), (1800.0, Severity.ERROR)]
)
def test_what_is_not_stated_costs_margin(wait_s: float, severity: Severity) -> None:
    # The article's quadrotor hovers on 130 W: 60 s are 2.2 Wh, half an hour 65 Wh of 77 with a fifth kept.
    mission = replace(read(dji()), unstated_wait_s=wait_s)
    vehicle, pack = load_vehicle("falkowski-2023-quadrotor"), Battery(capacity_wh=77.0)
    [finding] = [
        one for one in check(mission, vehicle, battery=pack).findings if one.code == "E131"
    ]
    assert finding.severity is severity


def test_actions_that_last_nobody_knows_how_long_are_an_error() -> None:
    mission = replace(read(dji()), unstated_wait_s=float("inf"))
    vehicle, pack = load_vehicle("falkowski-2023-quadrotor"), Battery(capacity_wh=77.0)
    found = [
        one
        for one in check(mission, vehicle, battery=pack).findings
        if one.code in {"E131", "M107"}
    ]
    assert [(one.code, one.severity) for one in found] == [
        ("E131", Severity.ERROR),
        ("M107", Severity.WARNING),
    ]


@pytest.mark.parametrize(("margin_wh", "is_short"), [(4.2, False), (3.0, True)])
def test_an_unknown_home_costs_the_way_in_sight(margin_wh: float, *, is_short: bool) -> None:
    # 1,000 m at the model's 10 m/s and 130 W are 3.6 Wh.
    vehicle = load_vehicle("falkowski-2023-quadrotor")
    mission = read(dji(end="goHome").replace(HOVER, ""))
    flight_wh = check(mission, vehicle, battery=Battery(capacity_wh=500.0)).totals.energy_wh
    assert flight_wh is not None
    pack = Battery(capacity_wh=(flight_wh + margin_wh) / 0.8)
    result = check(mission, vehicle, battery=pack)
    own = [one.severity for one in result.findings if one.code == "M107"]
    assert (Severity.ERROR in own) is is_short


@pytest.mark.parametrize(
    ("name", "properties", "is_inside"),
    [
        ("Fence", {}, True),
        ("Area", {"inclusion": False}, False),
        ("Area", {"is_inclusion": False, "inclusion": None}, False),
        ("Area", {"inclusion": True}, True),
        ("No-fly", {}, False),
        ("No-fly", {"inclusion": False}, False),
    ],
)
def test_an_area_of_geojson_says_which_side_of_it_is_flown_on(
    name: str,
    properties: dict[str, bool],
    is_inside: bool,  # noqa: FBT001 - a table of cases
) -> None:
    fence = read(sided(name, **properties)).fence
    assert fence is not None
    assert [polygon.inclusion for polygon in fence.polygons] == [is_inside]


def areas(text: str) -> list[tuple[bool, int]]:
    """Return which side of each area is flown on, and how many corners it has."""
    fence = read(text).fence
    return [(one.inclusion, len(one.vertices_deg)) for one in (fence.polygons if fence else ())]


def test_no_area_of_a_drawing_is_left_out() -> None:
    """Programs write MultiPolygon for one area, and do not always close a ring."""
    ring = [[8, 47], [8.01, 47], [8.01, 47.01], [8, 47]]
    assert areas(drawn("MultiPolygon", [[ring], [ring]], name="no-fly")) == [(False, 3)] * 2
    assert areas(drawn("MultiPolygon", [[ring, ring]], name="Fence")) == [(True, 3), (False, 3)]
    assert areas(drawn("Polygon", [ring[:-1]], inclusion=True)) == [(True, 3)]
    assert areas(line(more=AREA.replace(" 7.99,46.99<", "<"))) == [(True, 3)]
    twice = AREA.replace("</Polygon>", f"<innerBoundaryIs>{RING}{RING}</innerBoundaryIs></Polygon>")
    assert areas(line(more=twice)) == [(True, 3), (False, 3), (False, 3)]


@settings(max_examples=examples(30), deadline=None)
@given(
    ring=st.lists(
        st.tuples(st.floats(7.0, 9.0), st.floats(46.0, 48.0)), min_size=3, max_size=9, unique=True
    ),
    is_closed=st.booleans(),
    name=st.sampled_from(["Fence", "no-fly zone"]),
)
def test_an_area_is_the_same_however_it_is_drawn(
    ring: list[tuple[float, float]], name: str, *, is_closed: bool
) -> None:
    drawn_ring = [*ring, ring[0]] if is_closed else ring
    text = " ".join(f"{east!r},{north!r},0" for east, north in drawn_ring)
    start, end = RING.index("<coordinates>") + len("<coordinates>"), RING.index("</coordinates>")
    in_kml = AREA.replace("Fence", name).replace(RING, RING[:start] + text + RING[end:])
    corners = tuple((north, east) for east, north in ring)
    for drawing in (
        drawn("Polygon", [drawn_ring], name=name),
        drawn("MultiPolygon", [[drawn_ring]], Name=name),
        line(more=in_kml),
    ):
        fence = read(drawing).fence
        assert fence is not None
        [area] = fence.polygons
        assert (area.inclusion, area.vertices_deg) == (name == "Fence", corners)


@pytest.mark.parametrize("words", ["NFZ_1", "stay out", "Obstacle", "No-flight zone"])
def test_an_area_is_stayed_out_of_wherever_its_drawing_says_so(words: str) -> None:
    ring = [[8, 47], [8.01, 47], [8.01, 47.01], [8, 47]]
    assert areas(drawn("Polygon", [ring], Name="Dam", sort=words)) == [(False, 3)]
    area = AREA.replace("Fence", "Dam")
    for around in (
        f"<Folder><name>{words}</name>{area}</Folder>",
        area.replace("<Polygon>", f"<description>{words}</description><Polygon>"),
        area.replace("<Polygon>", f"<ExtendedData><value>{words}</value></ExtendedData><Polygon>"),
    ):
        assert areas(line(more=around)) == [(False, 3)]
    # an area called the one within what is called the other
    assert areas(line(more=f"<Folder><name>{words}</name>{AREA}</Folder>")) == []
    beside = f"<Folder><Placemark><name>{words}</name></Placemark>{AREA}</Folder>"
    assert areas(line(more=beside)) == [(True, 3)]


@pytest.mark.parametrize(
    ("words", "is_known"),
    [
        ("Fence", True),
        ("Survey boundary", True),
        ("FlightArea", True),
        ("AOI", True),
        ("no flight", True),
        ("Zone 1", False),
        ("Sperrgebiet", True),
        ("", False),
        # parts of words, the contrary, both
        ("Transmission line", False),
        ("Permission required", False),
        ("Flying not permitted", False),
        ("outside flight area", False),
        ("Obstacle-free zone", False),
        ("Stay inside (no flight outside)", False),
        ("Airport boundary", False),
        ("MoD defence site", False),
        ("Survey 2020", False),
        ("Unrestricted flight area", True),
        ("Volcano flight area", True),
        ("Geofence_2", True),
        ("Boundary 1", True),
    ],
)
def test_an_area_that_says_nothing_of_its_side_is_not_checked(
    words: str, *, is_known: bool
) -> None:
    ring = [[7.9, 46.9], [8.1, 46.9], [8.1, 47.1], [7.9, 47.1], [7.9, 46.9]]
    for text in (line(more=AREA.replace("Fence", words)), drawn("Polygon", [ring], name=words)):
        found = [(one.code, one.severity) for one in read(text).findings if one.code == "F115"]
        assert found == [("F115", Severity.ERROR)] * (not is_known)
    assert "F115" not in {one.code for one in read(sided("", inclusion=True)).findings}


def test_what_is_drawn_beside_the_line_and_not_taken_is_counted() -> None:
    mark = "<Placemark><Point><coordinates>8,47</coordinates></Point></Placemark>"
    [found] = read(line(more=f"{mark}{mark}<NetworkLink/>")).findings
    assert found.message.endswith("; 2 points and 1 network link left out")
    [found] = read(drawn("Point", [8, 47], name="Mast")).findings
    assert found.message.endswith("; 1 point left out")
