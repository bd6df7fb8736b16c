from __future__ import annotations

import copy
import json
import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_text import LANDING, STRUCTURE_SCAN, SURVEY, plan_of, simple_item
from thinning import examples

from planner.errors import MissionFileError
from planner.findings import Severity
from planner.geo.geodesy import distance_m
from planner.mission.expand.survey import (
    begun_nearest,
    in_alternation,
    make_transects_m,
    to_and_fro,
)
from planner.mission.formats.plan import read_plan_text

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem

TAKEOFF = simple_item(22, 3, 0, 0, 0, None, 47.3977, 8.5455, 30, number=1)


def read(*items: dict[str, Any]) -> Mission:
    return read_plan_text(plan_of(*items), source="a.plan")


def refusal(*items: dict[str, Any]) -> MissionFileError:
    with pytest.raises(MissionFileError) as caught:
        read(*items)
    return caught.value


def without(item: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in item.items() if key not in keys}


def survey_without_items(**transect_changes: Any) -> dict[str, Any]:  # noqa: ANN401 (JSON)
    survey = copy.deepcopy(SURVEY)
    transects = without(survey["TransectStyleComplexItem"], "Items")
    survey["TransectStyleComplexItem"] = transects | transect_changes
    return survey


def waypoints(mission: Mission) -> list[MissionItem]:
    return [item for item in mission.items if item.command == 16]


def position(item: MissionItem) -> tuple[float, float]:
    assert item.latitude_deg is not None
    assert item.longitude_deg is not None
    return item.latitude_deg, item.longitude_deg


# Items in the file


@pytest.mark.parametrize(("kind", "version"), [("survey", 4), ("survey", 5), ("CorridorScan", 2)])
def test_embedded_items_are_used_as_they_are_each_with_its_place(kind: str, version: int) -> None:
    survey = SURVEY | {"complexItemType": kind, "version": version}
    text = plan_of(TAKEOFF, survey)
    mission = read_plan_text(text, source="a.plan")
    assert mission.findings == ()
    assert [item.command for item in mission.items] == [22, 16, 206]
    assert [item.jump_id for item in mission.items] == [1, 3, 4]
    lines = text.split("\n")
    for item, inner in zip(
        mission.items[1:], SURVEY["TransectStyleComplexItem"]["Items"], strict=True
    ):
        assert item.place is not None
        rest = "\n".join(lines[item.place.line - 1 :])[item.place.column - 1 :]
        assert json.JSONDecoder().raw_decode(rest)[0] == inner


@pytest.mark.parametrize(
    ("kind", "version"),
    [("survey", 9), ("survey", "ComplexItem"), ("spiral", 1), ("CorridorScan", None)],
)
def test_embedded_items_are_used_whatever_the_version_and_it_is_told(
    kind: str, version: object
) -> None:
    mission = read(TAKEOFF, SURVEY | {"complexItemType": kind, "version": version})
    assert len(mission.items) == 3
    [finding] = mission.findings
    assert (finding.code, finding.severity, finding.item) == ("L113", Severity.WARNING, 2)
    assert "QGroundControl refuses the file" in finding.message


@pytest.mark.parametrize(
    "item",
    [
        {"type": "ComplexItem", "complexItemType": "spiral", "version": 1},
        {"type": "ComplexItem", "complexItemType": 3, "version": 1},
        {"type": "ComplexItem"},
        STRUCTURE_SCAN | {"version": 2},
        LANDING | {"version": 7},
        without(SURVEY, "TransectStyleComplexItem"),
        SURVEY | {"TransectStyleComplexItem": {"test": 0}},
        without(SURVEY, "TransectStyleComplexItem") | {"complexItemType": "CorridorScan"},
    ],
)
def test_what_cannot_be_expanded_is_left_out_with_an_error(item: dict[str, Any]) -> None:
    mission = read(TAKEOFF, item)
    assert len(mission.items) == 1
    found = [(finding.code, finding.severity) for finding in mission.findings]
    assert ("L112", Severity.ERROR) in found


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"TransectStyleComplexItem": {"Items": 3}}, "'Items' is 3, expected a list"),
        ({"TransectStyleComplexItem": {"Items": [3]}}, "element 1 of 'Items' is 3"),
        ({"TransectStyleComplexItem": {"Items": [{}]}}, "item 2: 'command' is missing"),
    ],
)
def test_embedded_items_that_make_no_sense_are_refused(
    changes: dict[str, Any], sentence: str
) -> None:
    error = refusal(TAKEOFF, SURVEY | changes)
    assert sentence in error.message
    assert error.place is not None


# Structure scan: a square of 111 m at the equator, 20 m away, 2 layers of 10 m from the top


def test_a_structure_scan_has_four_and_n_plus_three_items_per_layer() -> None:
    mission = read(TAKEOFF, STRUCTURE_SCAN, simple_item(20, 2, *(0,) * 7, number=20))
    # 4 + 2 · (4 + 3) = 18: entrance, ROI, two laps of 5 waypoints with trigger on and off, ROI
    # none, exit.
    lap = [16, 206, 16, 16, 16, 16, 206]
    assert [item.command for item in mission.items] == [22, 16, 196, *lap, *lap, 197, 16, 20]
    assert [item.jump_id for item in mission.items[1:19]] == list(range(2, 20))
    assert {item.frame for item in waypoints(mission)} == {3}


def test_a_structure_scan_goes_down_from_half_a_layer_below_the_top() -> None:
    altitudes = [item.altitude_m for item in waypoints(read(STRUCTURE_SCAN))]
    assert altitudes == [60.0, *[25.0] * 5, *[15.0] * 5, 60.0]


def test_a_structure_scan_may_begin_at_the_bottom() -> None:
    altitudes = [
        item.altitude_m for item in waypoints(read(STRUCTURE_SCAN | {"StartFromTop": False}))
    ]
    assert altitudes == [60.0, *[15.0] * 5, *[25.0] * 5, 60.0]


@pytest.mark.parametrize("turned", [False, True])
def test_a_structure_scan_flies_clockwise_outside_the_outline(turned: bool) -> None:  # noqa: FBT001 (a parameter of the test)
    polygon = STRUCTURE_SCAN["polygon"][:: -1 if turned else 1]
    lap = waypoints(read(STRUCTURE_SCAN | {"polygon": polygon}))[1:6]
    assert (lap[0].latitude_deg, lap[0].longitude_deg) == (
        lap[4].latitude_deg,
        lap[4].longitude_deg,
    )
    # One arc second is 30.92 m along the equator and 30.71 m along a meridian there (WGS 84):
    # 20 m are 1.7966e-4° and 1.8087e-4°.
    corners = {(round(lat, 6), round(lon, 6)) for lat, lon in map(position, lap)}
    assert corners == {
        (-0.000181, -0.00018),
        (0.001181, -0.00018),
        (0.001181, 0.00118),
        (-0.000181, 0.00118),
    }
    turns = sum(
        (there[1] - here[1]) * (there[0] + here[0]) for here, there in pairwise(map(position, lap))
    )
    assert turns > 0.0  # clockwise seen from above


def test_layers_that_qgroundcontrol_will_count_otherwise_are_told() -> None:
    assert [f.severity for f in read(STRUCTURE_SCAN).findings] == [Severity.INFO]
    # (30 − 10) / 10 = 2 layers, the file says 3.
    [finding] = read(STRUCTURE_SCAN | {"Layers": 3}).findings
    assert (finding.code, finding.severity) == ("L115", Severity.WARNING)
    assert "will count 2 layers" in finding.message


@pytest.mark.parametrize(("written", "flown"), [(1, 2), (2, 2), (3, 3)])
def test_of_two_counts_of_layers_the_greater_is_flown(written: int, flown: int) -> None:
    # QGroundControl sends the 2 layers it counts; a file sent as it is has those it names.
    items = read(STRUCTURE_SCAN | {"Layers": written}).items
    assert len(items) == 4 + flown * (4 + 3)


def layered(height_m: float, layer_m: float) -> dict[str, Any]:
    camera = STRUCTURE_SCAN["CameraCalc"] | {"AdjustedFootprintFrontal": layer_m}
    heights = {"StructureHeight": height_m, "ScanBottomAlt": 0.0, "Layers": 1}
    return STRUCTURE_SCAN | heights | {"CameraCalc": camera}


def test_layers_however_thin_are_counted_or_refused() -> None:
    # StructureScanComplexItem::_recalcLayerInfo: max(ceil(height / layer), 1).
    assert len(read(layered(1.0, 0.01)).items) == 4 + 100 * (4 + 3)
    assert "more than 65,535 items" in refusal(TAKEOFF, layered(100.0, 0.01)).message
    assert "more than 65,535 items" in refusal(TAKEOFF, layered(1.0, 1e-300)).message
    for nothing_m in (0.0, -1.0):
        [finding] = read(layered(100.0, nothing_m)).findings
        assert (finding.code, finding.severity) == ("L115", Severity.ERROR)


def surveyed(**changes: Any) -> list[str]:  # noqa: ANN401 (JSON)
    """Return the codes of a survey flown at 47.3987° north, 8.5455° east, 50 m above home."""
    here = simple_item(16, 3, 0, 0, 0, None, 47.3987, 8.5455, 50, number=2)
    camera = {"DistanceToSurface": 50, "DistanceMode": 1}
    held = {"Items": [here], "VisualTransectPoints": [[47.3987, 8.5455]], "CameraCalc": camera}
    return [f.code for f in read(TAKEOFF, survey_without_items(**held | changes)).findings]


@pytest.mark.parametrize(("metres", "told"), [(0.9, 0), (1.1, 1)])
def test_a_survey_drawn_elsewhere_than_its_items_lead_is_told(metres: float, told: int) -> None:
    # A degree of latitude is 111.2 km there.
    point = [47.3987 + metres / 111_200, 8.5455]
    found = surveyed(VisualTransectPoints=[[47.3987, 8.5455], point])
    assert found.count("L166") == told


@pytest.mark.parametrize(
    ("shown_m", "mode", "told"), [(50.009, 1, 0), (50.011, 1, 1), (120, 1, 1), (120, 4, 0)]
)
def test_a_survey_shown_at_another_height_is_told(shown_m: float, mode: int, told: int) -> None:
    camera = {"DistanceToSurface": shown_m, "DistanceMode": mode}
    assert surveyed(CameraCalc=camera).count("L166") == told


def test_an_outline_with_edges_in_line_is_not_moved_and_told() -> None:
    polygon = [[0.0, 0.0], [0.001, 0.0], [0.002, 0.0], [0.002, 0.001], [0.0, 0.001]]
    mission = read(STRUCTURE_SCAN | {"polygon": polygon})
    assert (mission.items[0].latitude_deg, mission.items[0].longitude_deg) == (0.0, 0.0)
    assert "along the structure itself" in mission.findings[0].message


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"Layers": 10_000}, "more than 65,535 items"),
        ({"Layers": 1e9}, "'Layers' is 1000000000, expected a whole number from 1 to 10000"),
        ({"Layers": "2"}, "'Layers' is the text '2', expected a number"),
        ({"polygon": [[0, 0], [1, 1]]}, "its polygon has 2 vertices"),
        ({"polygon": [[0, 0], [1, 1], [91, 0]]}, "'polygon' element 3 element 1 is 91"),
        ({"CameraCalc": None}, "'CameraCalc' is null, expected an object"),
        ({"EntranceAltitude": 1e9}, "'EntranceAltitude' is 1000000000, expected a length"),
    ],
)
def test_a_structure_scan_beyond_measure_is_refused(changes: dict[str, Any], sentence: str) -> None:
    error = refusal(TAKEOFF, STRUCTURE_SCAN | changes)
    assert error.message.startswith("item 2 (StructureScan)")
    assert sentence in error.message


# Landing patterns


def test_a_landing_pattern_stops_the_camera_approaches_and_lands() -> None:
    mission = read(TAKEOFF, LANDING)
    assert [item.command for item in mission.items] == [22, 189, 206, 2001, 2501, 31, 21]
    approach, land = mission.items[-2:]
    assert (approach.latitude_deg, approach.longitude_deg, approach.altitude_m) == (47.41, 8.55, 40)
    assert (approach.param1, approach.param2, approach.param4) == (1.0, -75.0, 1.0)
    assert (land.frame, land.latitude_deg, land.altitude_m) == (3, 47.4, 0.0)
    assert [(f.code, f.severity) for f in mission.findings] == [("L116", Severity.INFO)]


def test_a_landing_pattern_may_approach_along_a_straight_line_at_its_own_speed() -> None:
    pattern = LANDING | {
        "altitudesAreRelative": False,
        "finalApproachSpeed": 9,
        "stopTakingPhotos": False,
        "stopVideoPhotos": False,
        "useDoChangeSpeed": True,
        "useLoiterToAlt": False,
    }
    items = read(pattern).items
    assert [item.command for item in items] == [189, 178, 16, 21]
    assert items[1].param2 == 9.0
    assert items[2].param4 is None
    assert items[2].frame == 0


def test_a_vtol_landing_pattern_ends_in_a_vtol_landing() -> None:
    pattern = LANDING | {"complexItemType": "vtolLandingPattern", "version": 1}
    assert read(pattern).items[-1].command == 85


@pytest.mark.parametrize(
    ("loiter", "land", "frame", "severity"),
    [
        (True, True, 3, Severity.INFO),
        (False, False, 0, Severity.INFO),
        (True, False, 3, Severity.WARNING),
    ],
)
def test_a_landing_pattern_of_version_one_has_two_references(
    loiter: bool,  # noqa: FBT001 (a parameter of the test)
    land: bool,  # noqa: FBT001 (as above)
    frame: int,
    severity: Severity,
) -> None:
    pattern = without(LANDING, "altitudesAreRelative", "landingApproachCoordinate") | {
        "version": 1,
        "loiterCoordinate": [47.41, 8.55, 40],
        "loiterAltitudeRelative": loiter,
        "landAltitudeRelative": land,
    }
    mission = read(pattern)
    assert mission.items[-1].frame == frame
    assert mission.items[-2].altitude_m == 40.0
    assert max(finding.severity for finding in mission.findings) is severity


# Surveys without items


def test_a_survey_without_items_is_flown_along_the_path_it_is_drawn_with() -> None:
    drawn = [[47.398, 8.545], [47.399, 8.545]]
    mission = read(TAKEOFF, survey_without_items(VisualTransectPoints=drawn))
    assert [(i.latitude_deg, i.longitude_deg, i.altitude_m) for i in mission.items[1:]] == [
        (47.398, 8.545, 50.0),
        (47.399, 8.545, 50.0),
    ]
    [finding] = mission.findings
    assert (finding.code, finding.severity) == (
        "L114",
        Severity.ERROR,
    )  # no ground station loads it


@pytest.mark.parametrize(
    ("camera", "transects", "frame"),
    [
        ({"DistanceMode": 1}, {}, 3),
        ({"DistanceMode": 2}, {}, 0),
        ({"DistanceMode": 3}, {}, 10),
        ({"DistanceMode": 4}, {}, 10),
        ({"DistanceToSurfaceRelative": True}, {"FollowTerrain": False}, 3),
        ({"DistanceToSurfaceRelative": False}, {"FollowTerrain": False}, 0),
        ({"DistanceToSurfaceRelative": False}, {"FollowTerrain": True}, 10),
    ],
)
def test_a_survey_flies_at_the_altitude_reference_of_its_camera(
    camera: dict[str, Any], transects: dict[str, Any], frame: int
) -> None:
    survey = survey_without_items(**transects)
    old = without(survey["TransectStyleComplexItem"]["CameraCalc"], "DistanceMode")
    survey["TransectStyleComplexItem"]["CameraCalc"] = old | camera
    assert read(survey).items[0].frame == frame


def older_survey(**changes: Any) -> dict[str, Any]:  # noqa: ANN401 (JSON)
    # 0.001° are 110.57 m north and 111.32 m east at the equator (WGS 84).
    grid = {
        "altitude": 50,
        "angle": 0,
        "entryLocation": 0,
        "relativeAltitude": True,
        "spacing": 60,
        "turnAroundDistance": 10,
    }
    return {
        "type": "ComplexItem",
        "complexItemType": "survey",
        "version": 3,
        "cameraTriggerDistance": 30,
        "cameraTriggerInTurnaround": False,
        "fixedValueIsAltitude": True,
        "manualGrid": True,
        "grid": grid | changes.pop("grid", {}),
        "polygon": [[0.0, 0.0], [0.0, 0.001], [0.001, 0.001], [0.001, 0.0]],
    } | changes


def test_an_older_survey_is_computed_line_by_line() -> None:
    mission = read(TAKEOFF, older_survey())
    # Two lines: turn, entry, trigger on, exit, trigger off, turn.
    line = [16, 16, 206, 16, 206, 16]
    assert [item.command for item in mission.items[1:]] == line * 2
    assert [item.param1 for item in mission.items if item.command == 206] == [30, 0, 30, 0]
    assert [item.jump_id for item in mission.items] == list(range(1, 14))
    points = waypoints(mission)
    # Across a rectangle along its meridians: 110.57 m, and 10 m before and after.
    for turn, entry, exit_, turn_back in (points[:4], points[4:]):
        lengths = [
            float(distance_m(*position(a), *position(b)))
            for a, b in ((turn, entry), (entry, exit_), (exit_, turn_back))
        ]
        assert lengths == pytest.approx([10.0, 110.574, 10.0], abs=0.01)
    [finding] = mission.findings
    assert (finding.code, finding.item) == ("L114", 2)
    assert "2 lines 60 m apart" in finding.message


@pytest.mark.parametrize("spacing_m", [0, -3])
def test_a_survey_without_a_spacing_says_that_it_is_one_line(spacing_m: int) -> None:
    [finding] = read(TAKEOFF, older_survey(grid={"spacing": spacing_m})).findings
    assert f"a single line: its spacing is {spacing_m} m" in finding.message
    assert "apart" not in finding.message


def test_a_camera_that_stays_on_is_switched_at_the_ends_and_each_entry() -> None:
    mission = read(older_survey(cameraTriggerInTurnaround=True))
    commands = [item.command for item in mission.items]
    assert commands == [16, 206, 16, 206, 16, 16, 16, 16, 206, 16, 16, 206]
    assert [item.param1 for item in mission.items if item.command == 206] == [30, 30, 30, 0]


def test_hovering_for_pictures_stops_four_seconds_at_each() -> None:
    mission = read(older_survey(hoverAndCapture=True, grid={"turnAroundDistance": 0}))
    # 110.57 m: pictures at entry, after 30, 60 and 90 m, and at the exit, on 2 lines.
    assert [item.command for item in mission.items] == [16, 2000] * 10
    assert {item.param1 for item in waypoints(mission)} == {4.0}


def test_a_survey_that_is_flown_again_across_has_lines_of_both_directions() -> None:
    mission = read(older_survey(refly90Degrees=True, cameraTriggerDistance=0))
    assert len(mission.items) == 4 * 4


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"polygon": [[0, 0], [1, 1]]}, "its polygon has 2 vertices"),
        ({"polygon": [[0, 0], [0, 10], [10, 0]]}, "wider than 100 km"),
        ({"hoverAndCapture": True, "cameraTriggerDistance": 1e-9}, "more than 65,535 points"),
        ({"grid": 3}, "'grid' is 3, expected an object"),
        ({"cameraTriggerDistance": "x"}, "'cameraTriggerDistance' is the text 'x'"),
    ],
)
def test_a_survey_beyond_measure_is_refused(changes: dict[str, Any], sentence: str) -> None:
    survey = older_survey() | changes
    assert sentence in refusal(survey).message


def test_a_survey_of_many_corners_and_narrow_lines_is_refused() -> None:
    ring = [[0.4 * math.sin(t), 0.4 * math.cos(t)] for t in np.linspace(0.0, 6.28, 200)]
    survey = older_survey(polygon=ring, grid={"spacing": 0.5})
    assert "lines across 200 edges" in refusal(survey).message


SQUARE_M = np.array([[0.0, 0.0], [0.0, 100.0], [100.0, 100.0], [100.0, 0.0]])


def test_lines_are_counted_from_the_left_at_the_spacing_from_far_outside() -> None:
    lines = make_transects_m(SQUARE_M, angle_deg=0.0, spacing_m=40.0, entry=0)
    # The first line lies at 50 − (50 + 1000) = −1000 m; further ones every 40 m: 0, 40, 80.
    assert lines[:, 0, 0].tolist() == [0.0, 40.0, 80.0]
    assert np.abs(lines[:, 1] - lines[:, 0]).tolist() == [[0.0, 100.0]] * 3


def test_the_entry_corner_turns_the_order_and_the_direction_of_lines() -> None:
    lines = {
        entry: make_transects_m(SQUARE_M, angle_deg=0.0, spacing_m=40.0, entry=entry)
        for entry in range(4)
    }
    begin = lines[0]
    assert lines[1].tolist() == begin[::-1].tolist()
    assert lines[2].tolist() == begin[:, ::-1].tolist()
    assert lines[3].tolist() == begin[::-1, ::-1].tolist()


@pytest.mark.parametrize("spacing_m", [0.0, -3.0, 5000.0])
def test_a_spacing_that_gives_no_two_lines_gives_one_through_the_middle(spacing_m: float) -> None:
    lines = make_transects_m(SQUARE_M, angle_deg=90.0, spacing_m=spacing_m, entry=0)
    assert sorted(lines[0].round(9).tolist()) == [[0.0, 50.0], [100.0, 50.0]]


def test_orders_of_flight() -> None:
    lines = np.arange(20.0).reshape(5, 2, 2)
    assert in_alternation(lines)[:, 0, 0].tolist() == [0.0, 8.0, 16.0, 12.0, 4.0]
    assert to_and_fro(lines)[:, 0, 0].tolist() == [0.0, 6.0, 8.0, 14.0, 16.0]
    assert begun_nearest(lines, np.array([2.0, 3.0]))[0, 0].tolist() == [2.0, 3.0]
    assert begun_nearest(lines, np.array([16.0, 17.0]))[0, 0].tolist() == [16.0, 17.0]


@settings(max_examples=examples(40), deadline=None)
@given(
    angle_deg=st.floats(-90.0, 180.0),
    spacing_m=st.floats(1.0, 30.0),
    width_m=st.floats(40.0, 500.0),
    height_m=st.floats(40.0, 500.0),
)
def test_lines_of_a_rectangle_cover_its_area(
    angle_deg: float, spacing_m: float, width_m: float, height_m: float
) -> None:
    outline = np.array([[0.0, 0.0], [width_m, 0.0], [width_m, height_m], [0.0, height_m]])
    lines = make_transects_m(outline, angle_deg=angle_deg, spacing_m=spacing_m, entry=0)
    lengths = np.hypot(*(lines[:, 1] - lines[:, 0]).T)
    # The sum of lengths times the spacing is the midpoint rule for the area: off by no more than
    # one spacing times the longest line at each of its two sides.
    assert lengths.sum() * spacing_m == pytest.approx(
        width_m * height_m, abs=2.0 * spacing_m * lengths.max()
    )
    # All lie inside the area, and all go one way.
    assert np.all((lines >= -1e-6) & (lines <= np.array([width_m, height_m]) + 1e-6))
    directions = (lines[:, 1] - lines[:, 0]) / lengths[:, None]
    assert np.allclose(directions, directions[0], atol=1e-4)


def test_an_empty_list_of_items_is_none_at_all() -> None:
    # QGroundControl builds the items of a survey anew where it has loaded none.
    rebuilt = read(TAKEOFF, survey_without_items(Items=[]))
    without_any = read(TAKEOFF, survey_without_items())
    assert rebuilt.items == without_any.items
    assert len(rebuilt.items) > 1
    assert rebuilt.findings == without_any.findings
