"""Tracks and volumes of a fleet for other programs: they hold what is flown, as their schemas have it."""

from __future__ import annotations

import datetime as dt
import json
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree as ET

import jsonschema
import numpy as np
import pytest
import shapely
from made_fleet import OUT, SWAP, checked, pad, place, sortie, up, vehicles
from made_missions import mission, rtl

import planner
from planner.cli.main import main
from planner.errors import UsageError
from planner.mission.files import write_mission
from planner.report.fleet_exports import write_exports
from planner.service.fleet_volumes import MOST_VERTICES, fleet_volumes
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

    from planner.arrays import FloatArray
    from planner.service.fleet import FleetResult, FlownSortie
    from planner.service.fleet_volumes import Volume4D

START = dt.datetime(2026, 5, 12, 8, tzinfo=dt.timezone(dt.timedelta(hours=2)))
GEOID_M = 46.0
START_ERROR_S, POSITION_ERROR_M, HEIGHT_ERROR_M = 5.0, 3.0, 2.0
TIME = {
    "type": "object",
    "required": ["value", "format"],
    "properties": {
        "value": {"type": "string", "pattern": r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z$"},
        "format": {"enum": ["RFC3339"]},
    },
}
ALTITUDE = {
    "type": "object",
    "required": ["value", "reference", "units"],
    "properties": {
        "value": {"type": "number", "minimum": -8000, "maximum": 100000},
        "reference": {"enum": ["W84"]},
        "units": {"enum": ["M"]},
    },
}
POINT = {
    "type": "object",
    "required": ["lat", "lng"],
    "properties": {
        "lat": {"type": "number", "minimum": -90, "maximum": 90},
        "lng": {"type": "number", "minimum": -180, "maximum": 180},
    },
}
VOLUME = {
    "type": "object",
    "required": ["volume", "time_start", "time_end"],
    "properties": {
        "volume": {
            "type": "object",
            "required": ["outline_polygon", "altitude_lower", "altitude_upper"],
            "not": {"required": ["outline_circle"]},
            "properties": {
                "outline_polygon": {
                    "type": "object",
                    "required": ["vertices"],
                    "properties": {
                        "vertices": {
                            "type": "array",
                            "minItems": 3,
                            "uniqueItems": True,
                            "items": POINT,
                        }
                    },
                },
                "altitude_lower": ALTITUDE,
                "altitude_upper": ALTITUDE,
            },
        },
        "time_start": TIME,
        "time_end": TIME,
    },
}
DETAILS = {
    "type": "object",
    "properties": {
        "volumes": {"type": "array", "items": VOLUME},
        "off_nominal_volumes": {"type": "array", "items": VOLUME},
        "priority": {"type": "integer"},
    },
}
"""OperationalIntentDetails and what it holds, after utm.yaml of astm-utm/Protocol, 1.0.0, with what its
descriptions ask for: times and altitudes of each volume, vertices of which none is twice."""


@cache
def fleet() -> FleetResult:
    """Two vehicles around corners, one of them later, with errors of everything."""
    tables = f"[separation]\nhorizontal_m = 20\nstart_error_s = {START_ERROR_S}\n"
    tables += f"height_error_m = {HEIGHT_ERROR_M}\n"
    tables += f"[conditions]\nposition_error_m = {POSITION_ERROR_M}\nwind = '4@240'\n"
    around = mission(up(30), place(200, 0, 30), place(200, 150, 60, 70.0), place(0, 150, 40), rtl())
    return checked(
        tables,
        SWAP,
        pad("a", 0, 0) + pad("b", -300, 0),
        vehicles("a") + vehicles("b", model="px4-quad-2kg"),
        sortie("s1", "a", 30.0, job="around"),
        sortie("s2", "b", 0.0, job="south"),
        around=around,
        south=mission(up(20), place(-400, 50, 20), rtl()),
    )


class Box(NamedTuple):
    """A volume, its outline east and north of home."""

    volume: Volume4D
    outline: shapely.Polygon


def boxes(volumes: tuple[Volume4D, ...], one: FlownSortie) -> list[Box]:
    """The volumes of a sortie in the frame of its home."""
    assert one.assessment is not None
    frame = one.assessment.route.frame
    corners = (frame.east_north_m(*np.array(each.vertices_deg).T) for each in volumes)
    return [
        Box(each, shapely.Polygon(np.stack(corner, axis=-1)))
        for each, corner in zip(volumes, corners, strict=True)
    ]


def is_inside(several: list[Box], one: FlownSortie, place_m: FloatArray, at_s: float) -> bool:
    """Whether a place, east, north and above home, is inside a volume at a time of the operation."""
    assert one.assessment is not None
    instant = START + dt.timedelta(seconds=at_s)
    height_m = place_m[2] + one.assessment.route.home_amsl_m + GEOID_M
    return any(
        volume.start <= instant <= volume.end
        and volume.lower_m <= height_m <= volume.upper_m
        and outline.covers(shapely.Point(place_m[:2]))
        for volume, outline in several
    )


def off(place_m: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A place as far from another as its errors allow, in some direction."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    beside_m = POSITION_ERROR_M * np.array([np.cos(angle), np.sin(angle)])
    return np.append(place_m[:2] + beside_m, place_m[2] + rng.choice([-1.0, 1.0]) * HEIGHT_ERROR_M)


def test_every_moment_of_a_flight_is_in_a_volume_with_all_its_errors() -> None:
    rng = np.random.default_rng(18)
    for intent in fleet_volumes(fleet(), start=START, geoid_height_m=GEOID_M):
        one, several = intent.flown, boxes(intent.volumes, intent.flown)
        assert one.assessment is not None
        totals = one.assessment.totals
        assert totals.time_s_p90 is not None
        for time_s in np.append(rng.uniform(0.0, one.time_s, 150), [0.0, one.time_s]):
            state = one.assessment.flight.motion.state_at_time(np.array([time_s]))
            late_s = rng.uniform(-1.0, 1.0) * (totals.time_s_p90 / totals.time_s - 1.0) * time_s
            at_s = one.start_s + time_s + late_s + rng.choice([-1.0, 1.0]) * START_ERROR_S
            assert is_inside(several, one, off(state.place_m[0], rng), at_s), time_s


def test_every_return_is_in_a_volume_with_all_its_errors() -> None:
    rng = np.random.default_rng(6)
    for intent in fleet_volumes(fleet(), start=START, geoid_height_m=GEOID_M):
        one, several = intent.flown, boxes(intent.return_volumes, intent.flown)
        assert one.assessment is not None
        returns = one.assessment.returns
        sample = returns.sample
        assert sample is not None
        first_s, last_s = sample.points.time_s[[0, -1]]
        points = returns.points(*returns.at(rng.uniform(first_s, last_s, 40)))
        flown = returns.flown(points)
        motion = flown.flight.motion
        begun_s = np.concatenate(([0.0], np.cumsum(motion.piece_duration_s)))
        for piece in rng.integers(0, len(motion.piece_duration_s), 200).tolist():
            row = int(flown.piece_point[piece])
            own = np.flatnonzero(flown.piece_point == row)
            time_s = rng.uniform(begun_s[piece], begun_s[piece + 1])
            state = motion.state_at_time(np.array([time_s]))
            since_s = points.time_s[row] + points.stop_s[row] + time_s - begun_s[own[0]]
            at_s = one.start_s + since_s + rng.choice([-1.0, 1.0]) * START_ERROR_S
            assert is_inside(several, one, off(state.place_m[0], rng), at_s), (row, since_s)


def test_volumes_are_as_their_schema_has_them(tmp_path: Path) -> None:
    file = tmp_path / "volumes.json"
    write_exports(fleet(), volumes=file, start=START, geoid_height_m=GEOID_M)
    document = json.loads(file.read_text())
    assert [one["sortie"] for one in document["operational_intents"]] == ["s2", "s1"]
    for intent in document["operational_intents"]:
        accepted, contingent = intent["details"]["Accepted"], intent["details"]["Contingent"]
        for details in (accepted, contingent):
            jsonschema.validate(details, DETAILS)
        # what an accepted intent must not have, and a contingent one neither
        assert (len(accepted["off_nominal_volumes"]), len(contingent["volumes"])) == (0, 0)
        assert accepted["volumes"]
        assert contingent["off_nominal_volumes"]
        count = 0
        for one in (*accepted["volumes"], *contingent["off_nominal_volumes"]):
            volume = one["volume"]
            assert volume["altitude_lower"]["value"] < volume["altitude_upper"]["value"]
            assert one["time_start"]["value"] < one["time_end"]["value"]
            vertices = [(at["lng"], at["lat"]) for at in volume["outline_polygon"]["vertices"]]
            assert shapely.Polygon(vertices).is_valid  # edges do not cross
            count += len(vertices)
        assert count <= MOST_VERTICES
    first = document["operational_intents"][1]["details"]["Accepted"]["volumes"][0]
    # 8:00 +02:00, started at 30 s, up to 5 s sooner; by the spread of times and to round some milliseconds
    begin = dt.datetime.fromisoformat(first["time_start"]["value"])
    assert 4.95 < (begin - START).total_seconds() - 20.0 < 5.0
    # 400 m above the sea, 46 m above the ellipsoid; 2 m of height error, 1 m of the geoid
    assert first["volume"]["altitude_lower"]["value"] == pytest.approx(400 + 46 - 3, abs=0.02)


def test_tracks_are_where_and_when_the_flights_are(tmp_path: Path) -> None:
    files = [tmp_path / f"fleet.{end}" for end in ("geojson", "kml", "czml")]
    write_exports(fleet(), tracks=files, start=START, geoid_height_m=GEOID_M)
    [_, feature] = json.loads(files[0].read_text())["features"]
    about = feature["properties"]
    one = fleet().sorties[1]
    assert one.assessment is not None
    assert (about["sortie"], about["verdict"]) == ("s1", "GO")
    points = np.array(feature["geometry"]["coordinates"])
    times_s = np.array(about["times_s"])
    east_m, north_m = one.assessment.route.frame.east_north_m(points[:, 1], points[:, 0])
    truth = one.assessment.flight.motion.state_at_time(np.linspace(0.0, one.time_s, 500))
    along_s = np.linspace(0.0, one.time_s, 500) + one.start_s
    got_m = np.stack([np.interp(along_s, times_s, column) for column in (east_m, north_m)], axis=-1)
    assert np.hypot(*(got_m - truth.place_m[:, :2]).T).max() < 1.0 + 0.02  # and the digits
    assert points[:, 2] == pytest.approx(np.array(about["altitudes_amsl_m"]) + GEOID_M, abs=0.011)
    assert about["energies_wh"][-1] == pytest.approx(one.energy_wh, abs=1e-3)
    assert about["coordTimes"][0] == "2026-05-12T06:00:30.000Z"

    names = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
    track = ET.parse(files[1]).getroot().findall(".//gx:Track", names)[1]
    coords = [[*map(float, (at.text or "").split())] for at in track.findall("gx:coord", names)]
    whens = [at.text for at in track.findall("k:when", names)]
    used = [float(at.text or "") for at in track.findall(".//gx:value", names)]
    assert whens == about["coordTimes"]
    assert used == about["energies_wh"]
    assert np.array(coords)[:, :2].tolist() == points[:, :2].tolist()
    assert [at[2] for at in coords] == about["altitudes_amsl_m"]  # KML counts from the sea

    document, *packets = json.loads(files[2].read_text())
    assert document["clock"]["interval"].startswith("2026-05-12T06:00:00.000Z/")
    moved = np.array(packets[1]["position"]["cartographicDegrees"]).reshape(-1, 4)
    assert moved[:, 0].tolist() == about["times_s"]
    assert moved[:, 1:].tolist() == points.tolist()
    assert packets[1]["position"]["epoch"] == "2026-05-12T06:00:00.000Z"


def test_heights_are_left_out_of_a_track_where_the_geoid_is_not_known(tmp_path: Path) -> None:
    file = tmp_path / "fleet.geojson"
    write_exports(fleet(), tracks=[file])
    about = json.loads(file.read_text())["features"][1]
    assert {len(point) for point in about["geometry"]["coordinates"]} == {2}
    assert about["properties"]["altitudes_amsl_m"][0] == 400.0
    assert "coordTimes" not in about["properties"]


ENDS_IN_AIR = mission(up(20), place(100, 0, 20))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"geoid_height_m": 46.0}, "volumes have dates: give --start-time"),
        ({"start": START}, "heights above the WGS 84 ellipsoid: give --geoid-height"),
        ({"start": START, "geoid_height_m": 460.0}, "must be from -110 to 90 m: got 460"),
        ({"start": START.replace(tzinfo=None), "geoid_height_m": 46.0}, "must have its offset"),
        (
            {"start": dt.datetime(9999, 12, 31, 23, 59, tzinfo=dt.UTC), "geoid_height_m": 46.0},
            "no calendar has",
        ),
    ],
)
def test_volumes_are_refused_without_what_they_need(given: dict[str, Any], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        fleet_volumes(fleet(), **given)


def test_a_flight_without_an_end_has_no_volumes() -> None:
    result = checked(pad("a", 0, 0), vehicles("a"), sortie("s1", "a", 0.0), out=ENDS_IN_AIR)
    with pytest.raises(UsageError, match="s1 has no volumes: it ends in the air"):
        planner.fleet_volumes(result, start=START, geoid_height_m=0.0)


def test_an_altitude_that_is_not_known_is_not_made_up(tmp_path: Path) -> None:
    home = OUT.home
    assert home is not None
    nowhere = replace(OUT, home=replace(home, altitude_amsl_m=0.0))
    table = pad("a", 0, 0).replace("amsl_m = 400\n", "")
    result = checked(table, vehicles("a"), sortie("s1", "a", 0.0), out=nowhere)
    with pytest.raises(UsageError, match="the altitude of its home is not known"):
        fleet_volumes(result, start=START, geoid_height_m=0.0)
    with pytest.raises(UsageError, match="KML has altitudes: that of the home of s1 is not known"):
        write_exports(result, tracks=[tmp_path / "x.kml"], start=START)


def test_the_command_writes_all_files_or_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_mission(OUT, tmp_path / "out.plan")
    file, track, volumes = (tmp_path / name for name in ("f.toml", "t.geojson", "v.json"))
    operation = "[operation]\nstart = 2026-05-12T08:00:00+02:00\n"
    text = 'schema = 1\n[job.out]\nmission = "out.plan"\n' + pad("a", 0, 0) + vehicles("a")
    file.write_text(text + operation + sortie("s1", "a", 0.0))
    given = ["fleet", "check", str(file), "--export", str(track), "--volumes", str(volumes)]
    assert main(given) == 2
    assert "give --geoid-height" in capsys.readouterr().err
    assert not track.exists()
    assert main([*given, "--geoid-height", "46"]) == 0
    assert json.loads(volumes.read_text())["geoid_height_m"] == 46.0
    assert json.loads(track.read_text())["features"][0]["properties"]["sortie"] == "s1"
    assert main([*given[:4], str(tmp_path / "t.gpx")]) == 2
    assert "end in .geojson, .kml, .czml" in capsys.readouterr().err
    assert main([*given[:4], str(tmp_path / "out.plan")]) == 2
    assert main([*given[:3], "--start-time", "2026-05-12T08:00:00"]) == 2
    assert "expected a date and time with its offset" in capsys.readouterr().err
