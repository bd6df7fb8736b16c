"""Lines and areas over the 180th meridian, as RFC 7946 has them: its own examples, and others by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from fenced_missions import at
from made_missions import HOME, mission, rtl, takeoff

from planner.report.flight_files import flight_file
from planner.report.map_geometry import area_geometry, line_geometry, line_parts
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle


def test_the_line_of_the_standard_is_cut_as_there() -> None:
    # RFC 7946, 3.1.9: from 45° N, 170° E across the antimeridian to 45° N, 170° W
    parts = line_parts({"longitude_deg": [170.0, -170.0], "latitude_deg": [45.0, 45.0]})
    lines = [[*zip(*part.values(), strict=True)] for part in parts]
    assert line_geometry(lines) == {
        "type": "MultiLineString",
        "coordinates": [[(170.0, 45.0), (180.0, 45.0)], [(-180.0, 45.0), (-170.0, 45.0)]],
    }


def test_values_are_interpolated_on_the_meridian_and_words_go_on() -> None:
    columns: dict[str, list[Any]] = {
        "longitude_deg": [-179.9, 179.7],
        "time_s": [10.0, 18.0],
        "state": ["brake", "hover"],
    }
    first, second = line_parts(columns)
    assert first == {
        "longitude_deg": [-179.9, -180.0],
        "time_s": [10.0, 12.0],
        "state": ["brake"] * 2,
    }
    assert second == {
        "longitude_deg": [180.0, 179.7],
        "time_s": [12.0, 18.0],
        "state": ["brake", "hover"],
    }


def test_the_area_of_the_standard_is_cut_as_there() -> None:
    # RFC 7946, 3.1.9: from 40° N, 170° E to 50° N, 170° W
    outline = [(170.0, 40.0), (-170.0, 40.0), (-170.0, 50.0), (170.0, 50.0), (170.0, 40.0)]
    for way in (outline, outline[::-1]):
        found: Any = area_geometry(way)
        assert found["type"] == "MultiPolygon"
        assert [{*ring} for [ring] in found["coordinates"]] == [
            {(180.0, 40.0), (180.0, 50.0), (170.0, 50.0), (170.0, 40.0)},
            {(-170.0, 40.0), (-170.0, 50.0), (-180.0, 50.0), (-180.0, 40.0)},
        ]
        for [ring] in found["coordinates"]:
            assert ring[0] == ring[-1]
            west = min(range(4), key=lambda index: (ring[index][1], ring[index][0]))
            assert ring[(west + 1) % 4][0] > ring[west][0], "against the clock, from the south-west"


def test_an_area_that_begins_in_the_west_is_cut_too() -> None:
    outline = [(-179.0, 0.0), (-179.0, 1.0), (178.0, 1.0), (178.0, 0.0), (-179.0, 0.0)]
    found: Any = area_geometry(outline)
    assert [{longitude for longitude, _ in ring} for [ring] in found["coordinates"]] == [
        {178.0, 180.0},
        {-179.0, -180.0},
    ]


def test_a_flight_over_the_meridian_stays_whole() -> None:
    # home is 76 m west of the meridian at 47° N, where a degree of longitude has 76.06 km
    def moved(longitude_deg: float) -> float:
        return (longitude_deg - HOME.longitude_deg + 179.999 + 180.0) % 360.0 - 180.0

    home = replace(HOME, longitude_deg=moved(HOME.longitude_deg))
    flown = mission(takeoff(20), at(200, 0), rtl(), home=home)
    items = [
        one if one.longitude_deg is None else replace(one, longitude_deg=moved(one.longitude_deg))
        for one in flown.items
    ]
    flown = replace(flown, items=tuple(items))
    result = check(flown, load_vehicle("falkowski-2023-quadrotor"))
    features = json.loads(flight_file(result, Path("a.geojson")))["features"]
    path = features[0]
    lines = path["geometry"]["coordinates"]
    assert path["geometry"]["type"] == "MultiLineString"
    assert len(lines) == 3, "out and back"
    times_s = path["properties"]["time_s"]
    assert [len(line) for line in lines] == [len(some) for some in times_s]
    assert times_s[0][-1] == times_s[1][0] < times_s[1][-1] == times_s[2][0]
    assert times_s[2][-1] == pytest.approx(result.totals.time_s, abs=1e-3)
    for line in lines:
        assert len({point[0] > 0.0 for point in line}) == 1
