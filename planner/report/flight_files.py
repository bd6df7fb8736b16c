"""A predicted flight as a file for maps: KML, GeoJSON, GPX and CZML, with times and energy.

Positions are WGS 84, altitudes above mean sea level.  A flight has no day yet: its take-off starts at
`EPOCH` in formats whose times are those of a calendar.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, NamedTuple

from planner.errors import UsageError
from planner.flight.prediction import sample_trace, used_energy_wh
from planner.report.map_geometry import area_geometry, line_geometry, line_parts, one_or_all
from planner.report.tables import fence_outlines, item_rows, joined_places, place_rows, point_rows
from planner.report.text import headline, printable
from planner.service.separation import known_home_amsl_m

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import PurePath

    from planner.report.json import Document
    from planner.report.tables import Row
    from planner.rules.assessment import Assessment
    from planner.service.preflight import CheckResult

EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
"""When the take-off starts, where a format asks for a date."""
_MOST_SAMPLES = 5_000
_DEGREE_DIGITS, _METRE_DIGITS, _SECOND_DIGITS, _WH_DIGITS = 7, 2, 3, 3
_NAMESPACE = "urn:mavjoule:flight"
_TIMES = f"times count from {EPOCH:%Y-%m-%dT%H:%M:%SZ}, the start of the take-off"
_DATUM = "altitudes are above mean sea level"


class _Track(NamedTuple):
    """Samples of a flight, one list for each quantity."""

    time_s: list[float]
    longitude_deg: list[float]
    latitude_deg: list[float]
    altitude_amsl_m: list[float]
    speed_m_s: list[float]
    energy_used_wh: list[float]
    """Empty where the power of the vehicle is not known."""
    item: list[int]
    state: list[str]

    @property
    def coordinates(self) -> list[tuple[float, float, float]]:
        """Longitude, latitude [°] and altitude [m AMSL]."""
        return [*zip(self.longitude_deg, self.latitude_deg, self.altitude_amsl_m, strict=True)]


class _Flight(NamedTuple):
    """What of a result is written."""

    name: str
    description: str
    track: _Track
    places: list[Row]
    """Items, home, rally points and those the return decides on."""
    areas: list[tuple[bool, list[tuple[float, float]]]]
    """Of the fence: whether to stay inside, and longitude and latitude of its closed outline. [°]"""


def refuse_flight_file(path: PurePath) -> None:
    """Raise ``UsageError`` where a file of this name cannot be written: its suffix, or a missing library."""
    suffix = path.suffix.lower()
    if suffix not in _WRITERS:
        msg = f"{path}: the suffix decides the format: give a name ending in {', '.join(_WRITERS)}"
        raise UsageError(msg)
    if suffix == ".kml":
        import simplekml  # noqa: F401 - only whether it is there
    if suffix == ".gpx":
        import gpxpy  # noqa: F401 - only whether it is there


def flight_file(result: CheckResult, path: PurePath) -> str:
    """Return the predicted flight of a result in the format that the suffix of a file names.

    Raises
    ------
    UsageError
        If the suffix is none of ``.kml``, ``.geojson``, ``.gpx``, ``.czml``, if nothing is flown, if the
        altitude of home is not known, or if a library of ``mavjoule[export]`` is missing.
    """
    refuse_flight_file(path)
    if result.assessment is None:
        msg = f"{result.file}: nothing is flown, so there is no flight to write"
        raise UsageError(msg)
    if known_home_amsl_m(result.assessment) is None:
        msg = f"{path}: holds altitudes above mean sea level, and that of home is not known: give --home-amsl"
        raise UsageError(msg)
    return _WRITERS[path.suffix.lower()](_flight(result, result.assessment))


def _flight(result: CheckResult, assessment: Assessment) -> _Flight:
    frame = assessment.route.frame
    areas = []
    for is_inside, east_m, north_m in fence_outlines(assessment):
        latitude_deg, longitude_deg = frame.latitude_longitude_deg(east_m, north_m)
        corners = zip(
            longitude_deg.round(_DEGREE_DIGITS).tolist(),
            latitude_deg.round(_DEGREE_DIGITS).tolist(),
            strict=True,
        )
        areas.append((is_inside, [*corners]))
    return _Flight(
        name=printable(result.file),
        description=f"{result.verdict_text}: {headline(result)}. Predicted by mavjoule; {_DATUM}; {_TIMES}.",
        track=_track(assessment),
        places=joined_places(item_rows(assessment) + place_rows(assessment)) + point_rows(result),
        areas=areas,
    )


def _track(assessment: Assessment) -> _Track:
    trace = sample_trace(assessment.flight, assessment.route, most_samples=_MOST_SAMPLES)
    used_wh: list[float] = []
    if assessment.vehicle.is_power_known:
        used = used_energy_wh(assessment.flight, trace.time_s, trace.power_w)
        used_wh = used.round(_WH_DIGITS).tolist()
    return _Track(
        time_s=trace.time_s.round(_SECOND_DIGITS).tolist(),
        longitude_deg=trace.longitude_deg.round(_DEGREE_DIGITS).tolist(),
        latitude_deg=trace.latitude_deg.round(_DEGREE_DIGITS).tolist(),
        altitude_amsl_m=trace.altitude_amsl_m.round(_METRE_DIGITS).tolist(),
        speed_m_s=trace.ground_speed_m_s.round(_METRE_DIGITS).tolist(),
        energy_used_wh=used_wh,
        item=trace.item.tolist(),
        state=list(trace.state),
    )


def _at(time_s: float) -> datetime:
    return EPOCH + timedelta(seconds=time_s)


def _date(time_s: float) -> str:
    return _at(time_s).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _kml(flight: _Flight) -> str:
    """Return a track with times and arrays of speed and energy, as OGC KML 2.2 with Google's extension."""
    import simplekml

    kml = simplekml.Kml(name=flight.name, open=1)
    kml.document.description = flight.description
    track = flight.track
    arrays = {"speed_m_s": track.speed_m_s, "energy_used_wh": track.energy_used_wh}
    schema = kml.newschema(name="flight")
    drawn = kml.newgxtrack(name="Predicted flight", altitudemode=simplekml.AltitudeMode.absolute)
    drawn.newwhen([_date(time_s) for time_s in track.time_s])
    drawn.newgxcoord(track.coordinates)
    drawn.style.linestyle.width = 3
    drawn.style.linestyle.color = "ffb27200"
    drawn.extendeddata.schemadata.schemaurl = schema.id
    for name, values in arrays.items():
        if values:
            schema.newgxsimplearrayfield(name=name, type=simplekml.Types.float)
            drawn.extendeddata.schemadata.newgxsimplearraydata(name, values)
    for place in flight.places:
        point = kml.newpoint(name=place["short"], description=place["label"])
        point.coords = [(place["longitude_deg"], place["latitude_deg"])]
        if "time_min" in place:
            point.timestamp.when = _date(60.0 * place["time_min"])
    for number, (is_inside, corners) in enumerate(flight.areas, 1):
        area = kml.newpolygon(name=f"Fence {number}: {'stay inside' if is_inside else 'keep out'}")
        area.outerboundaryis = corners
        area.style.polystyle.fill = 0
        area.style.linestyle.color = "ff005ed5"
    text: str = kml.kml()
    return text


def _geojson(flight: _Flight) -> str:
    """Return features by RFC 7946: the flight with a value of each quantity per position, places, fence."""
    parts = line_parts({name: values for name, values in flight.track._asdict().items() if values})
    places = ("longitude_deg", "latitude_deg", "altitude_amsl_m")
    features: list[Document] = [
        _feature(
            line_geometry(
                [[*zip(*(part[name] for name in places), strict=True)] for part in parts]
            ),
            name=flight.name,
            kind="flight",
            description=flight.description,
            **{
                name: one_or_all([part[name] for part in parts])
                for name in parts[0]
                if name not in places
            },
        )
    ]
    for place in flight.places:
        where = [place["longitude_deg"], place["latitude_deg"]]
        told = {key: place[key] for key in ("kind", "label")}
        if "time_min" in place:
            told["time_s"] = round(60.0 * place["time_min"], _SECOND_DIGITS)
        features.append(
            _feature({"type": "Point", "coordinates": where}, name=place["short"], **told)
        )
    for is_inside, corners in flight.areas:
        features.append(_feature(area_geometry(corners), kind="fence", is_inclusion=is_inside))
    return json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False) + "\n"


def _feature(geometry: Document, **properties: object) -> Document:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _gpx(flight: _Flight) -> str:
    """Return a track of GPX 1.1 with times, and waypoints; speed and energy as extensions."""
    from xml.etree.ElementTree import Element  # made here, never read

    from gpxpy import gpx

    document = gpx.GPX()
    document.creator = "mavjoule"
    document.name, document.description = flight.name, flight.description
    document.nsmap["mavjoule"] = _NAMESPACE
    track = flight.track
    segment = gpx.GPXTrackSegment()
    for index, (longitude_deg, latitude_deg, altitude_m) in enumerate(track.coordinates):
        point = gpx.GPXTrackPoint(
            latitude_deg, longitude_deg, elevation=altitude_m, time=_at(track.time_s[index])
        )
        for values in ("speed_m_s", "energy_used_wh"):
            if column := getattr(track, values):
                element = Element(f"{{{_NAMESPACE}}}{values}")
                element.text = str(column[index])
                point.extensions.append(element)
        segment.points.append(point)
    drawn = gpx.GPXTrack(name="Predicted flight")
    drawn.segments.append(segment)
    document.tracks.append(drawn)
    for place in flight.places:
        document.waypoints.append(
            gpx.GPXWaypoint(
                place["latitude_deg"],
                place["longitude_deg"],
                name=place["short"],
                description=place["label"],
                time=_at(60.0 * place["time_min"]) if "time_min" in place else None,
            )
        )
    text: str = document.to_xml(version="1.1")
    return text


def _czml(flight: _Flight) -> str:
    """Return packets for Cesium: the flight moves, its path and energy are sampled, places stand still.

    Cesium's heights are above the ellipsoid: they are those above mean sea level here, which is said in
    the description.
    """
    track = flight.track
    interval = f"{_date(0.0)}/{_date(track.time_s[-1])}"
    sampled = [
        number
        for time_s, place in zip(track.time_s, track.coordinates, strict=True)
        for number in (time_s, *place)
    ]
    moving: Document = {
        "id": "flight",
        "name": flight.name,
        "description": flight.description,
        "availability": interval,
        "position": {"epoch": _date(0.0), "cartographicDegrees": sampled},
        "point": {"pixelSize": 10, "color": {"rgba": [230, 159, 0, 255]}},
        "path": {"width": 3, "material": {"solidColor": {"color": {"rgba": [0, 114, 178, 255]}}}},
    }
    properties = {
        name: {
            "epoch": _date(0.0),
            "number": [
                number for pair in zip(track.time_s, values, strict=True) for number in pair
            ],
        }
        for name, values in (
            ("speed_m_s", track.speed_m_s),
            ("energy_used_wh", track.energy_used_wh),
        )
        if values
    }
    packets: list[Document] = [
        {
            "id": "document",
            "name": flight.name,
            "version": "1.0",
            "clock": {"interval": interval, "currentTime": _date(0.0), "multiplier": 10},
        },
        moving | {"properties": properties},
    ]
    packets += [
        {
            "id": f"place-{number}",
            "name": place["short"],
            "description": place["label"],
            "position": {"cartographicDegrees": [place["longitude_deg"], place["latitude_deg"], 0]},
            "point": {"pixelSize": 6, "heightReference": "CLAMP_TO_GROUND"},
            "label": {"text": place["short"], "heightReference": "CLAMP_TO_GROUND"},
        }
        for number, place in enumerate(flight.places, 1)
    ]
    packets += [
        {
            "id": f"fence-{number}",
            "name": "stay inside" if is_inside else "keep out",
            "polyline": {
                "clampToGround": True,
                "width": 2,
                "positions": {
                    "cartographicDegrees": [value for corner in corners for value in (*corner, 0)]
                },
            },
        }
        for number, (is_inside, corners) in enumerate(flight.areas, 1)
    ]
    return json.dumps(packets, allow_nan=False) + "\n"


_WRITERS: dict[str, Callable[[_Flight], str]] = {
    ".kml": _kml,
    ".geojson": _geojson,
    ".gpx": _gpx,
    ".czml": _czml,
}
