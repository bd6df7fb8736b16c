"""A predicted flight as KML, GeoJSON, GPX and CZML: read back, it is the flight of the result."""

from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

import gpxpy
import pytest
from fenced_missions import at, box
from made_missions import mission, rtl, takeoff

from planner.errors import UsageError, missing_library
from planner.geo.fence import Fence
from planner.report.flight_files import EPOCH, flight_file
from planner.report.tables import make_tables
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from datetime import datetime

KML = "{http://www.opengis.net/kml/2.2}"
GX = "{http://www.google.com/kml/ext/2.2}"


@pytest.fixture(scope="module")
def flown() -> CheckResult:
    """Named as an attack would; 3 km out and back on a battery that is too small, in a fence."""
    fence = Fence(polygons=(box(-400, -400, 400, 3_400),))
    return check(
        replace(
            mission(takeoff(50), at(0, 3_000), rtl()), fence=fence, source="<b>&\x1b]]></name>.plan"
        ),
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=18.0),
    )


def written(result: CheckResult, suffix: str) -> str:
    return flight_file(result, Path(f"flight{suffix}"))


def test_kml_holds_the_flight_with_its_times_and_energies(flown: CheckResult) -> None:
    document = ET.fromstring(written(flown, ".kml"))
    [track] = document.iter(f"{GX}Track")
    times = [when.text or "" for when in track.iter(f"{KML}when")]
    places = [(coord.text or "").split() for coord in track.iter(f"{GX}coord")]
    arrays = {
        array.get("name"): [float(value.text or "") for value in array]
        for array in track.iter(f"{GX}SimpleArrayData")
    }
    assert len(times) == len(places) == len(arrays["energy_used_wh"]) == len(arrays["speed_m_s"])
    assert times == sorted(times)
    assert times[0] == "2000-01-01T00:00:00.000Z"
    assert arrays["energy_used_wh"][-1] == pytest.approx(flown.totals.energy_wh, abs=1e-3)
    heights = [float(place[2]) for place in places]
    assert flown.assessment is not None
    home_m = flown.assessment.route.home_amsl_m
    assert max(heights) - home_m == pytest.approx(50.0, abs=0.5)
    names = [name.text for name in document.iter(f"{KML}name")]
    assert {"no return", "tightest", "1, 3, H", "Fence 1: stay inside"} <= {*names}


def test_gpx_is_read_by_its_library(flown: CheckResult) -> None:
    document = gpxpy.parse(written(flown, ".gpx"))
    [track] = document.tracks
    points = track.segments[0].points
    times: list[datetime] = [point.time for point in points if point.time is not None]
    assert times[0] == EPOCH
    assert (times[-1] - EPOCH).total_seconds() == pytest.approx(flown.totals.time_s, abs=1e-3)
    assert points[-1].extensions[1].tag == "{urn:mavjoule:flight}energy_used_wh"
    used_wh = float(points[-1].extensions[1].text or "")
    assert used_wh == pytest.approx(flown.totals.energy_wh, abs=1e-3)
    assert track.length_2d() == pytest.approx(6_000.0, rel=0.005)
    assert "2" in [point.name for point in document.waypoints]


def test_geojson_has_a_value_of_each_quantity_per_position(flown: CheckResult) -> None:
    document = json.loads(written(flown, ".geojson"))
    flight, *others = document["features"]
    count = len(flight["geometry"]["coordinates"])
    for name in ("time_s", "energy_used_wh", "speed_m_s", "item", "state"):
        assert len(flight["properties"][name]) == count
    kinds = {one["properties"]["kind"] for one in others}
    assert {"home", "item", "point of no return", "tightest return", "fence"} <= kinds
    [fence] = [one for one in others if one["properties"]["kind"] == "fence"]
    [ring] = fence["geometry"]["coordinates"]
    assert ring[0] == ring[-1]
    # RFC 7946: outer rings turn against the clock, from the south-west first to the east.
    lowest = min(range(len(ring) - 1), key=lambda index: (ring[index][1], ring[index][0]))
    assert ring[(lowest + 1) % (len(ring) - 1)][0] > ring[lowest][0]


def test_czml_moves_the_vehicle_over_the_time_of_the_flight(flown: CheckResult) -> None:
    document, moving, *_ = json.loads(written(flown, ".czml"))
    assert (document["id"], document["version"]) == ("document", "1.0")
    samples = moving["position"]["cartographicDegrees"]
    assert len(samples) % 4 == 0
    assert samples[-4] == pytest.approx(flown.totals.time_s, abs=1e-3)
    energy = moving["properties"]["energy_used_wh"]["number"]
    assert energy[-1] == pytest.approx(flown.totals.energy_wh, abs=1e-3)


def test_without_a_known_power_there_is_no_energy_to_write() -> None:
    result = check(mission(takeoff(20), at(0, 50), rtl()), load_vehicle("px4-sih-quad"))
    for suffix in (".kml", ".geojson", ".gpx", ".czml"):
        text = written(result, suffix)
        assert "energy_used_wh" not in text
        assert "NaN" not in text


def test_altitudes_above_an_unknown_home_are_not_written() -> None:
    items = mission(takeoff(20), at(0, 50), rtl())
    assert items.home is not None
    unknown = replace(items, home=replace(items.home, altitude_amsl_m=None))
    result = check(unknown, load_vehicle("falkowski-2023-quadrotor"))
    with pytest.raises(UsageError, match="give --home-amsl"):
        written(result, ".kml")
    labels = [row["label"] for row in make_tables(result).marks]
    assert "Home · altitude not known" in labels[0]
    assert not any("AMSL" in label for label in labels)


def test_another_suffix_and_a_missing_library_are_refused(
    flown: CheckResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(UsageError, match=r"flight\.shp: .* \.kml, \.geojson, \.gpx, \.czml"):
        written(flown, ".shp")
    monkeypatch.setitem(sys.modules, "simplekml", None)
    with pytest.raises(ModuleNotFoundError) as caught:
        written(flown, ".kml")
    assert "mavjoule[export]" in str(missing_library(caught.value))
