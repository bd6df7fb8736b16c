from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

import pytest
from plan_text import PLAN, SURVEY, plan_of, plan_with, plan_without, simple_item

from planner.autopilot import Autopilot
from planner.errors import MissionFileError
from planner.findings import Finding, Place, Severity
from planner.geo.fence import FenceCircle, FencePolygon, RallyPoint
from planner.mission.formats.plan import PlanDocument, read_plan_text
from planner.mission.items import Home, Mission, VehicleKind

if TYPE_CHECKING:
    from collections.abc import Sequence


def read(text: str) -> Mission:
    return read_plan_text(text, source="a.plan")


def codes(mission: Mission) -> list[str]:
    return [finding.code for finding in mission.findings]


def only_finding(mission: Mission) -> Finding:
    [finding] = mission.findings
    return finding


def refusal(text: str) -> MissionFileError:
    with pytest.raises(MissionFileError) as caught:
        read(text)
    return caught.value


def waypoint(number: int = 1, **changes: Any) -> dict[str, Any]:  # noqa: ANN401 (JSON)
    return simple_item(16, 3, 0, 0, 0, None, 47.4, 8.5, 50, number=number) | changes


def test_a_plan_as_qgroundcontrol_writes_it_is_read_without_a_finding() -> None:
    mission = read(json.dumps(PLAN, indent=4))
    assert mission.findings == ()
    assert [item.command for item in mission.items] == [22, 16, 16, 206, 16, 20]
    assert [item.jump_id for item in mission.items] == [1, 2, 3, 4, 5, 6]
    assert mission.home == Home(latitude_deg=47.3977, longitude_deg=8.5455, altitude_amsl_m=488.0)
    assert mission.autopilot is Autopilot.PX4
    assert mission.vehicle_kind is VehicleKind.MULTICOPTER


def test_an_item_has_its_seven_parameters_frame_and_place() -> None:
    item = read(json.dumps(PLAN, indent=1)).items[1]
    assert (item.param1, item.param2, item.param3, item.param4) == (5.0, 0.0, 0.0, None)
    assert (item.latitude_deg, item.longitude_deg, item.altitude_m) == (47.3987, 8.5455, 50.0)
    assert (item.frame, item.autocontinue) == (3, True)
    assert all(type(value) is float for value in (item.param1, item.altitude_m))
    lines = json.dumps(PLAN, indent=1).split("\n")
    openings = [n for n, line in enumerate(lines, 1) if line == "   {"]
    assert item.place == Place(openings[1], 4)


def test_fence_and_rally_points_are_read_with_their_places() -> None:
    text = json.dumps(PLAN)
    mission = read(text)
    assert mission.fence is not None
    assert mission.fence.polygons == (
        FencePolygon(
            inclusion=True,
            vertices_deg=((47.39, 8.53), (47.39, 8.56), (47.41, 8.56), (47.41, 8.53)),
            place=Place(1, text.index('"polygons": [{') + 14),
        ),
    )
    assert mission.fence.circles == (
        FenceCircle(
            inclusion=False,
            latitude_deg=47.395,
            longitude_deg=8.54,
            radius_m=30.5,
            place=Place(1, text.index('"circles": [{') + 13),
        ),
    )
    assert mission.fence.breach_return_deg_m == (47.3977, 8.5455, 40.0)
    assert mission.rally[1] == RallyPoint(
        latitude_deg=47.4,
        longitude_deg=8.55,
        height_above_home_m=30.0,
        place=Place(1, text.index("[47.4, 8.55, 30]") + 1),
    )


def test_the_document_keeps_everything_and_says_where_each_item_comes_from() -> None:
    text = plan_with({"mine": [1, 2]}, "mission", "unknownKey")
    document = read(text).document
    assert isinstance(document, PlanDocument)
    assert document.origins == (0, 1, 2, 2, 3, 4)
    assert document.json.root["mission"]["unknownKey"] == {"mine": [1, 2]}
    assert document.json.origin.text == text


def test_the_display_altitude_is_compared_and_never_used() -> None:
    mission = read(plan_of(waypoint(), waypoint(2, Altitude=2), waypoint(3, Altitude=2)))
    assert [item.altitude_m for item in mission.items] == [50.0, 50.0, 50.0]
    finding = only_finding(mission)
    assert (finding.code, finding.item, finding.severity) == ("L103", 2, Severity.WARNING)
    assert "item 2 is shown at 2 m and flown at 50 m (and 1 more)" in finding.message


@pytest.mark.parametrize(
    ("frame", "mode", "severity"),
    [
        (3, 1, None),
        (0, 2, None),
        (10, 4, None),
        (0, 3, None),
        (3, 0, Severity.INFO),
        (0, 0, Severity.WARNING),
        (3, 2, Severity.WARNING),
        (0, 1, Severity.WARNING),
        (3, 3, Severity.WARNING),
        (0, 4, Severity.WARNING),
        (3, "1", None),
    ],
)
def test_the_altitude_mode_is_compared_with_the_frame(
    frame: int, mode: object, severity: Severity | None
) -> None:
    mission = read(plan_of(waypoint(frame=frame, AltitudeMode=mode)))
    assert mission.items[0].frame == frame
    assert [f.severity for f in mission.findings if f.code == "L104"] == (
        [] if severity is None else [severity]
    )


def test_an_altitude_computed_from_terrain_is_compared_with_its_sum() -> None:
    item = waypoint(frame=0, AltitudeMode=3, Altitude=12, AMSLAltAboveTerrain=50)
    assert codes(read(plan_of(item))) == []
    assert codes(read(plan_of(item | {"AMSLAltAboveTerrain": 62}))) == ["L103"]


def test_a_height_above_terrain_that_is_not_worked_out_yet_is_kept() -> None:
    waiting = waypoint(1) | {"frame": 0, "Altitude": 30, "AltitudeMode": 3}
    waiting["params"] = [0, 0, 0, None, 47.4, 8.55, None]
    [item] = read(plan_of(waiting)).items
    assert (item.altitude_m, item.unresolved_agl_m) == (None, 30.0)
    [other] = read(plan_of(waiting | {"AltitudeMode": 2})).items
    assert other.unresolved_agl_m is None


def test_a_null_altitude_or_place_is_not_specified() -> None:
    params = [0, 0, 0, None, None, None, None]
    item = read(plan_of(waypoint(params=params, Altitude=None))).items[0]
    assert (item.latitude_deg, item.longitude_deg, item.altitude_m) == (None, None, None)


@pytest.mark.parametrize(
    ("home", "expected"),
    [
        ([None, None, None], None),
        ([47.0, None, 3.0], None),
        ([47.0, 8.0, None], Home(latitude_deg=47, longitude_deg=8, altitude_amsl_m=None)),
    ],
)
def test_a_home_with_nulls_is_as_unknown_as_it_says(
    home: list[float | None], expected: Home | None
) -> None:
    assert read(plan_with(home, "mission", "plannedHomePosition")).home == expected


@pytest.mark.parametrize(
    ("firmware", "autopilot"), [(3, Autopilot.ARDUPILOT), (12, Autopilot.PX4), (0, None), (8, None)]
)
def test_the_firmware_type_names_the_autopilot(firmware: int, autopilot: Autopilot | None) -> None:
    assert read(plan_with(firmware, "mission", "firmwareType")).autopilot is autopilot


@pytest.mark.parametrize(
    ("vehicle_type", "kind"),
    [
        (13, VehicleKind.MULTICOPTER),
        (1, VehicleKind.FIXED_WING),
        (22, VehicleKind.VTOL),
        (10, VehicleKind.ROVER),
        (0, None),
    ],
)
def test_the_vehicle_type_names_the_kind(vehicle_type: int, kind: VehicleKind | None) -> None:
    assert read(plan_with(vehicle_type, "mission", "vehicleType")).vehicle_kind is kind


def test_missing_sections_are_read_around_and_told_in_one_finding() -> None:
    plan = {key: PLAN[key] for key in ("fileType", "version", "mission")}
    mission = read(json.dumps(plan))
    assert len(mission.items) == 6
    assert mission.fence is None
    finding = only_finding(mission)
    assert finding.code == "L101"
    assert "groundStation, geoFence, rallyPoints missing" in finding.message
    assert "no fence can be checked" in finding.message


@pytest.mark.parametrize(
    "path",
    [
        ("fileType",),
        ("version",),
        ("mission", "firmwareType"),
        ("mission", "plannedHomePosition"),
        ("rallyPoints", "version"),
    ],
)
def test_a_missing_key_that_qgroundcontrol_requires_is_told(path: tuple[str, ...]) -> None:
    finding = read(plan_without(*path)).findings[0]
    assert finding.code == "L101"
    assert f"{'.'.join(path)} missing" in finding.message


def test_another_mission_version_is_read_and_told() -> None:
    finding = only_finding(read(plan_with(7, "mission", "version")))
    assert finding.code == "L102"
    assert "of version 7, read as version 2: MAVSDK refuses it" in finding.message


def test_missing_jump_ids_matter_only_to_a_jump() -> None:
    first, second = waypoint(1), waypoint(2)
    del second["doJumpId"]
    jump = simple_item(177, 2, 1, 3, 0, 0, 0, 0, 0, number=3)
    mission = read(plan_of(first, second))
    assert [item.jump_id for item in mission.items] == [1, None]
    assert codes(mission) == []
    assert codes(read(plan_of(first, second, jump))) == ["L106", "L121"]


def test_items_that_share_a_jump_id_are_told_where_there_is_a_jump() -> None:
    jump = simple_item(177, 2, 1, 3, 0, 0, 0, 0, 0, number=1)
    finding = read(plan_of(waypoint(1), waypoint(2), jump)).findings[0]
    assert finding.code == "L106"
    assert "items 1 and 3 both have doJumpId 1" in finding.message


@pytest.mark.parametrize("version", [1, None])
def test_an_old_fence_is_passed_over_and_told(version: int | None) -> None:
    fence: dict[str, Any] = {"polygon": [[47.0, 8.0], [47.1, 8.0], [47.1, 8.1]]}
    if version is not None:
        fence["version"] = version
    mission = read(plan_with(fence, "geoFence"))
    assert mission.fence is None
    assert codes(mission) == ["L107"]


@pytest.mark.parametrize("key", ["geofence", "GeoFence", "geo_fence", "fence", "rallypoints"])
@pytest.mark.parametrize("is_inside", [False, True])
def test_a_fence_where_no_loader_looks_is_told(key: str, *, is_inside: bool) -> None:
    plan = copy.deepcopy(PLAN)
    section = plan["mission"] if is_inside else plan
    section[key] = {"version": 2, "circles": []}
    assert codes(read(json.dumps(plan))) == []
    section[key]["circles"] = [{"circle": {"center": [47.0, 8.0], "radius": 20.0}}]
    assert codes(read(json.dumps(plan))) == ["L107"]


@pytest.mark.parametrize("key", ["polygon", "Polygons", "Circles", "areas"])
def test_areas_of_a_fence_that_no_loader_looks_for_are_told(key: str) -> None:
    fence = {"version": 2, "circles": [], "polygons": []}
    assert codes(read(plan_with(fence | {key: []}, "geoFence"))) == []
    assert codes(read(plan_with(fence | {key: [[47.0, 8.0]]}, "geoFence"))) == ["L107"]


def test_an_old_fence_with_nothing_in_it_is_nothing_to_tell() -> None:
    assert codes(read(plan_with({"version": 1, "circles": []}, "geoFence"))) == []


@pytest.mark.parametrize(
    ("polygon", "circle"),
    [([[47.0, 8.0], [47.1, 8.0]], None), (None, {"center": [47.0, 8.0], "radius": 0})],
)
def test_a_fence_area_that_encloses_nothing_is_left_out_and_told(
    polygon: list[list[float]] | None, circle: dict[str, Any] | None
) -> None:
    fence: dict[str, Any] = {"version": 2, "polygons": [], "circles": []}
    if polygon is not None:
        fence["polygons"] = [{"version": 1, "inclusion": True, "polygon": polygon}]
    if circle is not None:
        fence["circles"] = [{"version": 1, "inclusion": True, "circle": circle}]
    mission = read(plan_with(fence, "geoFence"))
    assert not mission.fence
    assert codes(mission) == ["L164"]


@pytest.mark.parametrize(("written", "read_as"), [(0, False), (1, True)])
def test_a_number_for_autocontinue_is_understood_and_told(written: int, read_as: bool) -> None:  # noqa: FBT001 (a parameter of the test)
    mission = read(plan_of(waypoint(autoContinue=written)))
    assert mission.items[0].autocontinue is read_as
    assert codes(mission) == ["L109"]


def test_half_a_character_in_an_item_is_passed_over_or_refused_with_its_place() -> None:
    # JSON can hold "\\ud800", which no encoding of text can.
    plan = copy.deepcopy(PLAN)
    plan["mission"]["items"][0] |= {"note \ud800": 1}
    places = [
        (one.command, one.latitude_deg, one.altitude_m) for one in read(json.dumps(PLAN)).items
    ]
    read_past = read(json.dumps(plan)).items
    assert [(one.command, one.latitude_deg, one.altitude_m) for one in read_past] == places
    plan["mission"]["items"][0] |= {"autoContinue": "\ud800"}
    with pytest.raises(MissionFileError, match="item 1: 'autoContinue' is the text"):
        read(json.dumps(plan))


def test_a_missing_autocontinue_is_true_and_told() -> None:
    item = waypoint()
    del item["autoContinue"]
    mission = read(plan_of(item))
    assert mission.items[0].autocontinue is True
    assert codes(mission) == ["L109"]


def test_a_coordinate_beside_seven_params_of_zeros_is_the_place() -> None:
    item = waypoint(params=[1, 0, 0, 0, 0, 0, 0], coordinate=[47.1, 8.2, 50], Altitude=50)
    mission = read(plan_of(item))
    assert (mission.items[0].latitude_deg, mission.items[0].altitude_m) == (47.1, 50.0)
    assert codes(mission) == ["L111"]


def test_a_coordinate_that_contradicts_the_params_is_refused() -> None:
    error = refusal(plan_of(waypoint(coordinate=[47.1, 8.2, 50])))
    assert "two different places" in error.message


def test_an_item_of_four_params_and_a_coordinate_is_read() -> None:
    item = waypoint(params=[1, 0, 0, 0], coordinate=[47.1, 8.2, 50])
    mission = read(plan_of(item))
    assert (mission.items[0].param1, mission.items[0].longitude_deg) == (1.0, 8.2)
    assert codes(mission) == ["L110"]


def test_an_item_without_a_type_is_read_and_told() -> None:
    mission = read(plan_of(waypoint(type=None)))
    assert len(mission.items) == 1
    assert codes(mission) == ["L118"]


def test_whole_numbers_written_with_a_point_are_numbers() -> None:
    item = read(plan_of(waypoint(command=16.0, frame=3.0, doJumpId=4.0))).items[0]
    assert (item.command, item.frame, item.jump_id) == (16, 3, 4)


ITEM = ("mission", "items", 1)


@pytest.mark.parametrize(
    ("value", "path", "sentence"),
    [
        (42, ("version",), "its version is 42, expected 1"),
        ("Mission", ("fileType",), "the file type is the text 'Mission', expected 'Plan'"),
        ([], ("mission",), "'mission' is a list of 0, expected an object"),
        ({}, ("mission", "items"), "'items' is an object, expected a list"),
        ("x", (*ITEM,), "element 2 of 'items' is the text 'x'"),
        ("16", (*ITEM, "command"), "item 2: 'command' is the text '16', expected a number"),
        (16.5, (*ITEM, "command"), "item 2: 'command' is 16.5, expected a whole number"),
        (-1, (*ITEM, "frame"), "item 2: 'frame' is -1, expected a whole number from 0 to 255"),
        (None, (*ITEM, "frame"), "item 2: 'frame' is null, expected a number"),
        ([0] * 6, (*ITEM, "params"), "item 2: 'params' must be a list of 7 values"),
        ("x", (*ITEM, "params"), "item 2: 'params' must be a list of 7 values"),
        (
            "5",
            (*ITEM, "params", 0),
            "its parameter 1 is the text '5', expected a number of at most",
        ),
        (True, (*ITEM, "params", 3), "its parameter 4 is true, expected a number of at most"),
        (1e39, (*ITEM, "params", 1), "its parameter 2 is"),
        (90.5, (*ITEM, "params", 4), "its latitude is 90.5, expected from -90 to 90°"),
        (1e308, (*ITEM, "params", 4), "its latitude is a number beyond all measure"),
        (473977000, (*ITEM, "params", 4), "this looks like degrees × 10⁷"),
        (-180.5, (*ITEM, "params", 5), "its longitude is -180.5, expected from -180 to 180°"),
        (1e6, (*ITEM, "params", 6), "its altitude is 1000000, expected within 100 km"),
        (10**400, (*ITEM, "params", 6), "its altitude is a number beyond all measure"),
        ("yes", (*ITEM, "autoContinue"), "'autoContinue' is the text 'yes', expected true or"),
        ("x", (*ITEM, "doJumpId"), "'doJumpId' is the text 'x', expected a number"),
        ([1, 2], ("mission", "plannedHomePosition"), "must be [latitude, longitude, altitude]"),
        (
            [95, 8, 0],
            ("mission", "plannedHomePosition"),
            "'plannedHomePosition' element 1 is 95, expected degrees from -90 to 90",
        ),
        ("x", ("mission", "firmwareType"), "'firmwareType' is the text 'x', expected a number"),
        (3, ("geoFence", "version"), "the fence is of version 3, expected 2"),
        (None, ("geoFence",), "'geoFence' is null, expected an object"),
        ({}, ("geoFence", "polygons"), "'polygons' is an object, expected a list"),
        (1, ("geoFence", "polygons", 0), "'polygons' element 1 must be an object"),
        ("yes", ("geoFence", "polygons", 0, "inclusion"), "fence polygon 1: 'inclusion' is the"),
        (
            [47.0],
            ("geoFence", "polygons", 0, "polygon", 2),
            "fence polygon 1: 'polygon' element 3 is a list of 1, expected [latitude, longitude]",
        ),
        ("30", ("geoFence", "circles", 0, "circle", "radius"), "fence circle 1: 'radius' is the"),
        (2, ("rallyPoints", "points", 1), "rally point 2 must be [latitude, longitude, altitude]"),
        (1, ("rallyPoints", "points"), "'points' is 1, expected a list"),
    ],
)
def test_a_value_that_cannot_be_understood_is_refused_with_its_place(
    value: object, path: Sequence[str | int], sentence: str
) -> None:
    text = plan_with(value, *path)
    error = refusal(text)
    assert sentence in error.message
    assert error.place is not None
    marked = text.split("\n")[error.place.line - 1][error.place.column - 1 :]
    written = json.dumps(value, indent=1).split("\n", maxsplit=1)[0]
    # The place is that of the value, or of a value inside it.
    assert marked.startswith(written[:1]) or isinstance(value, list)


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        (("mission",), "the plan has no section 'mission'"),
        (("mission", "items"), "'items' is missing"),
        ((*ITEM, "command"), "item 2: 'command' is missing"),
        ((*ITEM, "frame"), "item 2: 'frame' is missing"),
        ((*ITEM, "params"), "item 2: 'params' must be a list of 7 values"),
        (("geoFence", "polygons", 0, "inclusion"), "'inclusion' is missing"),
        (("geoFence", "circles", 0, "circle"), "'circle' is missing"),
        (("rallyPoints", "points"), "'points' is missing"),
    ],
)
def test_a_key_without_which_nothing_is_known_is_refused_as_missing(
    path: Sequence[str | int], sentence: str
) -> None:
    error = refusal(plan_without(*path))
    assert sentence in error.message
    assert error.place is not None


@pytest.mark.parametrize("text", ["[]", "3", '"Plan"', '{"name": "my workout"}', "{}"])
def test_json_that_is_no_plan_is_refused_as_such(text: str) -> None:
    assert "this is JSON but not a plan" in refusal(text).message


def test_an_item_of_no_known_type_is_refused() -> None:
    error = refusal(plan_of({"type": "Hover", "seconds": 3}))
    assert "item 1: its type is the text 'Hover' and it has no command" in error.message


def test_more_items_than_mavlink_can_send_are_refused() -> None:
    survey = copy.deepcopy(SURVEY)
    survey["TransectStyleComplexItem"]["Items"] = [{}] * 65_535
    assert "more than 65,535 items" in refusal(plan_of(waypoint(), survey)).message


def test_a_do_item_with_numbers_where_others_have_a_place_is_not_refused() -> None:
    item = simple_item(203, 2, 0, 0, 0, 0, 1000, 2000, 0, number=1)
    assert read(plan_of(item)).items[0].latitude_deg == 1000.0
