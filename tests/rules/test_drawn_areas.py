"""What the areas of a drawing hold a flight to: what is certain of them, and what nothing settles."""

from __future__ import annotations

import json
import math

import pytest

from planner.findings import Severity
from planner.mission.files import read_mission_bytes
from planner.service.preflight import check
from planner.vehicle.library import load_vehicle

QUAD = load_vehicle("arducopter-sitl-quad")
EAST_M = 111_194.9 * math.cos(math.radians(47.0))
"""Of a degree, to a thousandth."""
AROUND, WEST, EAST, BESIDE = (-50.0, 250.0), (-50.0, 76.0), (76.0, 250.0), (300.0, 500.0)
NEAR, FAR = (-51.0, 100.0), (20.0, 250.0)
"""From where to where areas reach east of home: around the whole flight, its halves, none of it. [m]"""


def box(east_m: tuple[float, float]) -> list[list[list[float]]]:
    west, east = (8.0 + one / EAST_M for one in east_m)
    return [[[west, 46.999], [east, 46.999], [east, 47.001], [west, 47.001], [west, 46.999]]]


def feature(kind: str, coordinates: object, **properties: object) -> dict[str, object]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def errors(*areas: tuple[str, tuple[tuple[float, float], ...]], **properties: object) -> set[str]:
    """Return the errors of a flight 152 m east and back, beside areas of one part or more."""
    line = feature("LineString", [[8, 47, 450], [8.002, 47, 460]])
    drawn = [
        feature("MultiPolygon", [box(part) for part in parts], name=name, **properties)
        for name, parts in areas
    ]
    text = json.dumps({"type": "FeatureCollection", "features": [line, *drawn]})
    mission = read_mission_bytes(text.encode(), source="x.geojson")
    found = check(mission, QUAD, home_amsl_m=430.0).findings
    return {one.code for one in found if one.severity is Severity.ERROR}


@pytest.mark.parametrize(
    "areas",
    [
        [("Flight area", (AROUND,))],
        # parts of one, and what is called alike
        [("Flight area", (WEST, EAST))],
        [("Flight area 1", (WEST,)), ("Flight area 2", (EAST,))],
        [("Flight area 1", ((-50.0, 89.0),)), ("Flight area 2", (FAR,))],
        [("Flight area", (AROUND, BESIDE))],
        # no flight is in both
        [("Flight area", (AROUND,)), ("Geofence", (BESIDE,))],
        [("Geofence", (BESIDE,)), ("Flight area", ((300.0, 400.0),)), ("Flight area", (AROUND,))],
        # around what is around the flight
        [("Flight area", (AROUND,)), ("Geofence", ((-99.0, 299.0),))],
        # where the work is holds nobody where something else does, nor inside it
        [("Geofence", (AROUND,)), ("Survey area", (WEST,))],
        [("Survey area", (AROUND,))],
        [("AOI", (WEST, EAST))],
        [("no-fly", (BESIDE,)), ("Flight area", (AROUND,))],
    ],
)
def test_a_flight_keeps_what_is_drawn(areas: list[tuple[str, tuple[tuple[float, float]]]]) -> None:
    assert errors(*areas) == set()


@pytest.mark.parametrize(
    "areas",
    [
        [("Geofence", (AROUND,)), ("Flight area", (WEST,))],
        # one far away has nothing to do with it, and one within another is no part of it
        [("Geofence", (AROUND,)), ("Flight area", (WEST,)), ("Flight area, site 2", (BESIDE,))],
        [("Geofence", (AROUND,)), ("Flight area", (WEST,)), ("Danger-free", (BESIDE,))],
        [("Geofence 1", (AROUND,)), ("Geofence 2", (WEST,))],
        [("Geofence 2", (WEST,)), ("Geofence 1", (AROUND,))],
        # nor one that lies in it but for its edge, or as much in it as beside it
        [("Geofence 1", (AROUND,)), ("Geofence 2", (NEAR,))],
        [("Geofence 1", ((-50.0, 91.0),)), ("Geofence 2", (FAR,))],
        [("Survey area", (WEST,))],
        [("Survey area", (WEST,)), ("Field boundary", (BESIDE,))],
        [("House", (BESIDE,))],
        [("House", (AROUND,)), ("Flight area", (AROUND,))],
    ],
)
def test_what_nothing_settles_is_not_checked(
    areas: list[tuple[str, tuple[tuple[float, float]]]],
) -> None:
    assert errors(*areas) == {"F115"}


@pytest.mark.parametrize(
    "areas",
    [
        [("Flight area", (WEST,))],
        [("Flight area 1", (WEST,)), ("Flight area 2", (BESIDE,))],
        [("Flight area", (WEST,)), ("Survey area", (AROUND,))],
        [("Flight area", (AROUND,)), ("no-fly", (EAST,))],
        [("Survey area", (AROUND,)), ("no-fly", (EAST,))],
    ],
)
def test_a_flight_that_breaks_what_is_certain_is_told_so(
    areas: list[tuple[str, tuple[tuple[float, float]]]],
) -> None:
    found = errors(*areas)
    assert "F101" in found
    assert "F115" not in found


def test_parts_that_state_their_side_are_one_area() -> None:
    assert errors(("", (WEST, EAST)), inclusion=True) == set()
    assert "F101" in errors(("", (WEST, BESIDE)), inclusion=True)
