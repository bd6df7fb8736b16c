"""A fleet for other programs: tracks as GeoJSON, KML and CZML, volumes as ASTM F3548-21 has them."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np

from planner.errors import UsageError
from planner.files import write_output_files
from planner.report.json import envelope, json_text, plain, value, values
from planner.report.map_geometry import line_geometry, line_parts, one_or_all
from planner.report.text import printable, well_formed
from planner.service.fleet_timeline import TRACK_ERROR_M, fleet_timeline
from planner.service.fleet_volumes import fleet_volumes, operation_geoid_m, operation_start
from planner.service.separation import known_home_amsl_m
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.geo.geodesy import LocalFrame
    from planner.report.json import Document
    from planner.service.fleet import FleetResult, FlownSortie
    from planner.service.fleet_timeline import Track
    from planner.service.fleet_volumes import Intent, Volume4D

_KML = "http://www.opengis.net/kml/2.2"
_GX = "http://www.google.com/kml/ext/2.2"
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Of vehicles: told apart by those who do not see red or green (Okabe and Ito 2008)."""


class _Course(Value, eq=False):
    """A track on the globe."""

    flown: FlownSortie
    colour: str
    time_s: list[float]
    longitude_deg: list[float]
    latitude_deg: list[float]
    amsl_m: list[float] | None
    """``None``: the altitude of its home is not known."""
    used_wh: list[float] | None


def write_exports(
    result: FleetResult,
    *,
    tracks: Sequence[Path] = (),
    volumes: Path | None = None,
    start: dt.datetime | None = None,
    geoid_height_m: float | None = None,
) -> None:
    """Write tracks and volumes of a fleet: all of the files or, where one cannot be made, none.

    Parameters
    ----------
    result : FleetResult
        As `planner.check_fleet` returns it.
    tracks : sequence of Path
        Files of the tracks, whose endings say what they are: ``.geojson``, ``.kml`` or ``.czml``.
    volumes : Path, optional
        File of the volumes, JSON as ASTM F3548-21 has them.
    start : datetime, optional
        When the operation begins, with its offset; by default ``start`` of its ``[operation]``.
    geoid_height_m : float, optional
        Height of the geoid above the WGS 84 ellipsoid there, for heights above the ellipsoid; by default
        ``geoid_height_m`` of its ``[operation]``. [m]

    Raises
    ------
    UsageError
        If an ending is another, or a format needs what is not known: the start, the geoid, an altitude.
    OutputError
        If a file cannot be written.
    """
    begin = operation_start(result.fleet, start)
    geoid_m = operation_geoid_m(result.fleet, geoid_height_m)
    writers = {".geojson": _geojson, ".kml": _kml, ".czml": _czml}
    contents: dict[Path, str] = {}
    courses = _courses(result) if tracks else []
    for path in tracks:
        writer = writers.get(path.suffix.lower())
        if writer is None:
            msg = f"{path}: tracks are written to files that end in {', '.join(writers)}"
            raise UsageError(msg)
        contents[path] = writer(result, courses, begin, geoid_m)
    if volumes is not None:
        if volumes in contents:
            msg = f"{volumes} is asked for twice: give the volumes another file"
            raise UsageError(msg)
        intents = fleet_volumes(result, start=begin, geoid_height_m=geoid_m)
        contents[volumes] = _volumes_json(result, intents, geoid_m)
    write_output_files(contents)


def _courses(result: FleetResult) -> list[_Course]:
    """Return the tracks of the sorties that fly."""
    timeline = fleet_timeline(result)
    flown = {one.name: one for one in result.sorties}
    vehicles = [*dict.fromkeys(one.vehicle for one in timeline.tracks)]
    return [
        _course(timeline.frame, one, flown[one.sortie], vehicles.index(one.vehicle))
        for one in timeline.tracks
    ]


def _course(frame: LocalFrame | None, track: Track, flown: FlownSortie, vehicle: int) -> _Course:
    assert frame is not None  # something is flown
    assert flown.assessment is not None
    latitude_deg, longitude_deg = frame.latitude_longitude_deg(*track.place_m.T[:2])
    home_amsl_m = known_home_amsl_m(flown.assessment)
    is_known = bool(np.isfinite(track.used_wh).all())
    return _Course(
        flown=flown,
        colour=_COLOURS[vehicle % len(_COLOURS)],
        time_s=track.time_s.round(3).tolist(),
        longitude_deg=longitude_deg.round(7).tolist(),
        latitude_deg=latitude_deg.round(7).tolist(),
        amsl_m=None
        if home_amsl_m is None
        else (track.place_m[:, 2] + home_amsl_m).round(2).tolist(),
        used_wh=track.used_wh.round(3).tolist() if is_known else None,
    )


def _about(one: FlownSortie) -> Document:
    """Return what is written of a sortie beside its track."""
    sortie = one.sortie
    return {
        "sortie": value(one, "name"),
        **values(sortie, ("job", "vehicle", "pack")),
        "verdict": one.result.verdict_text,
        "start_s": plain(one.start_s),
        "end_s": plain(one.end_s) if one.time_s else None,
        "energy_wh": plain(one.energy_wh),
    }


def _geojson(
    result: FleetResult,
    courses: Sequence[_Course],
    begin: dt.datetime | None,
    geoid_m: float | None,
) -> str:
    """Return tracks as RFC 7946 has them; sorties without one have no geometry.

    A third coordinate is a height above the ellipsoid there: it is left out where that is not known.
    """
    flown = {one.flown.name: one for one in courses}
    features = []
    for sortie in result.sorties:
        course = flown.get(sortie.name)
        about = _about(sortie)
        geometry: Document | None = None
        if course is not None:
            columns = {"longitude_deg": course.longitude_deg, "latitude_deg": course.latitude_deg}
            told = {
                "times_s": course.time_s,
                "altitudes_amsl_m": course.amsl_m,
                "energies_wh": course.used_wh,
            }
            if course.amsl_m is not None and geoid_m is not None:
                columns["height_m"] = [round(amsl_m + geoid_m, 2) for amsl_m in course.amsl_m]
            given = {name: column for name, column in told.items() if column is not None}
            parts = line_parts(columns | given)
            geometry = line_geometry(
                [[*zip(*(part[name] for name in columns), strict=True)] for part in parts]
            )
            for name, column in told.items():
                about[name] = None if column is None else one_or_all([part[name] for part in parts])
            if begin is not None:
                about["coordTimes"] = one_or_all(
                    [[_instant(begin, time_s) for time_s in part["times_s"]] for part in parts]
                )
        features.append({"type": "Feature", "geometry": geometry, "properties": about})
    document: Document = {
        "type": "FeatureCollection",
        "verdict": result.verdict_text,
        "track_error_m": TRACK_ERROR_M,
        "features": features,
    }
    return json_text(document)


def _kml(
    result: FleetResult,
    courses: Sequence[_Course],
    begin: dt.datetime | None,
    geoid_m: float | None,  # noqa: ARG001 - altitudes of KML count from the sea
) -> str:
    """Return tracks with their times and energies as KML 2.3 has them, in Google's namespace."""
    begin = _known(begin, "KML")
    ET.register_namespace("", _KML)
    ET.register_namespace("gx", _GX)
    root = ET.Element(f"{{{_KML}}}kml")
    document = ET.SubElement(root, f"{{{_KML}}}Document")
    _text(document, "name", f"{result.file} ({result.verdict_text})")
    schema = ET.SubElement(document, f"{{{_KML}}}Schema", {"id": "flight"})
    field = ET.SubElement(
        schema, f"{{{_GX}}}SimpleArrayField", {"name": "used_wh", "type": "float"}
    )
    _text(field, "displayName", "Energy used [Wh]")
    for course in courses:
        mark = ET.SubElement(document, f"{{{_KML}}}Placemark")
        one = course.flown
        _text(mark, "name", f"{one.name} ({one.sortie.vehicle})")
        style = ET.SubElement(ET.SubElement(mark, f"{{{_KML}}}Style"), f"{{{_KML}}}LineStyle")
        red, green, blue = (course.colour[at : at + 2] for at in (1, 3, 5))
        _text(style, "color", f"ff{blue}{green}{red}")
        _text(style, "width", "2")
        data = ET.SubElement(mark, f"{{{_KML}}}ExtendedData")
        for key, given in _about(one).items():
            item = ET.SubElement(data, f"{{{_KML}}}Data", {"name": key})
            _text(item, "value", "" if given is None else str(given))
        track = ET.SubElement(mark, f"{{{_GX}}}Track")
        _text(track, "altitudeMode", "absolute")
        for time_s in course.time_s:
            _text(track, "when", _instant(begin, time_s))
        for point in zip(
            course.longitude_deg, course.latitude_deg, _altitudes(course, "KML"), strict=True
        ):
            _text(track, "coord", " ".join(f"{number:.7f}" for number in point), namespace=_GX)
        if course.used_wh is not None:
            own = ET.SubElement(track, f"{{{_KML}}}ExtendedData")
            own = ET.SubElement(own, f"{{{_KML}}}SchemaData", {"schemaUrl": "#flight"})
            own = ET.SubElement(own, f"{{{_GX}}}SimpleArrayData", {"name": "used_wh"})
            for used_wh in course.used_wh:
                _text(own, "value", f"{used_wh:.3f}", namespace=_GX)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, "unicode") + "\n"


def _text(parent: ET.Element, tag: str, text: str, *, namespace: str = _KML) -> None:
    ET.SubElement(parent, f"{{{namespace}}}{tag}").text = printable(text)


def _czml(
    result: FleetResult,
    courses: Sequence[_Course],
    begin: dt.datetime | None,
    geoid_m: float | None,
) -> str:
    """Return tracks as Cesium moves them; its heights are above the ellipsoid."""
    begin = _known(begin, "CZML")
    if geoid_m is None:
        msg = (
            "CZML has heights above the WGS 84 ellipsoid: give --geoid-height, the height of the geoid "
            "(sea level) above it there, or geoid_height_m in [operation]"
        )
        raise UsageError(msg)
    spans = [(one.time_s[0], one.time_s[-1]) for one in courses] or [(0.0, 0.0)]
    whole = _interval(begin, min(first for first, _ in spans), max(last for _, last in spans))
    packets: list[Document] = [
        {
            "id": "document",
            "name": f"{well_formed(result.file)} ({result.verdict_text})",
            "version": "1.0",
            "clock": {
                "interval": whole,
                "currentTime": whole.partition("/")[0],
                "multiplier": 10,
                "range": "CLAMPED",
            },
        }
    ]
    for course in courses:
        epoch = _instant(begin, 0.0)
        heights_m = [round(one + geoid_m, 2) for one in _altitudes(course, "CZML")]
        columns = (course.time_s, course.longitude_deg, course.latitude_deg, heights_m)
        red, green, blue = (int(course.colour[at : at + 2], 16) for at in (1, 3, 5))
        colour = {"rgba": [red, green, blue, 255]}
        properties: Document = {key: given for key, given in _about(course.flown).items() if given}
        if course.used_wh is not None:
            pairs = zip(course.time_s, course.used_wh, strict=True)
            properties["used_wh"] = {
                "epoch": epoch,
                "number": [number for pair in pairs for number in pair],
            }
        packets.append(
            {
                "id": value(course.flown, "name"),
                "name": value(course.flown.sortie, "vehicle"),
                "availability": _interval(begin, course.time_s[0], course.time_s[-1]),
                "position": {
                    "epoch": epoch,
                    "interpolationAlgorithm": "LINEAR",
                    "interpolationDegree": 1,
                    "cartographicDegrees": [
                        number for row in zip(*columns, strict=True) for number in row
                    ],
                },
                "path": {"width": 2, "material": {"solidColor": {"color": colour}}},
                "point": {"pixelSize": 8, "color": colour},
                "label": {
                    "text": value(course.flown.sortie, "vehicle"),
                    "pixelOffset": {"cartesian2": [0, -16]},
                },
                "properties": properties,
            }
        )
    return json_text(packets)  # type: ignore[arg-type]


def _known(begin: dt.datetime | None, what: str) -> dt.datetime:
    if begin is None:
        msg = f"{what} has dates: give --start-time, such as 2026-05-12T08:00:00Z, or start in [operation]"
        raise UsageError(msg)
    return begin


def _altitudes(course: _Course, what: str) -> list[float]:
    if course.amsl_m is None:
        msg = (
            f"{what} has altitudes: that of the home of {course.flown.name} is not known; give its pad an "
            "amsl_m"
        )
        raise UsageError(msg)
    return course.amsl_m


def _volumes_json(result: FleetResult, intents: Sequence[Intent], geoid_m: float | None) -> str:
    """Return volumes by the keys of the API of ASTM F3548-21 (astm-utm/Protocol, utm.yaml 1.0.0).

    Of each state the OperationalIntentDetails: off-nominal volumes belong to no accepted intent, and a
    contingent one has no others.
    """
    from planner import __version__

    return json_text(
        envelope(__version__)
        | {
            "standard": "ASTM F3548-21",
            "file": value(result, "file"),
            "verdict_text": result.verdict_text,
            "geoid_height_m": plain(geoid_m),
            "operational_intents": [
                {
                    **_about(one.flown),
                    "details": {
                        "Accepted": _details(one.volumes, ()),
                        "Contingent": _details((), one.return_volumes)
                        if one.return_volumes
                        else None,
                    },
                }
                for one in intents
            ],
        }
    )


def _details(volumes: Sequence[Volume4D], off_nominal: Sequence[Volume4D]) -> Document:
    return {
        "volumes": [_volume(one) for one in volumes],
        "off_nominal_volumes": [_volume(one) for one in off_nominal],
        "priority": 0,  # others are given by an authority
    }


def _volume(one: Volume4D) -> Document:
    def altitude(metres: float) -> Document:
        return {"value": round(metres, 2), "reference": "W84", "units": "M"}

    return {
        "volume": {
            "outline_polygon": {
                "vertices": [{"lat": lat, "lng": lng} for lat, lng in one.vertices_deg]
            },
            "altitude_lower": altitude(one.lower_m),
            "altitude_upper": altitude(one.upper_m),
        },
        "time_start": {"value": _rfc3339(one.start), "format": "RFC3339"},
        "time_end": {"value": _rfc3339(one.end), "format": "RFC3339"},
    }


def _interval(begin: dt.datetime, first_s: float, last_s: float) -> str:
    return f"{_instant(begin, first_s)}/{_instant(begin, last_s)}"


def _instant(begin: dt.datetime, time_s: float) -> str:
    try:
        return _rfc3339(begin + dt.timedelta(seconds=time_s))
    except OverflowError as error:
        msg = f"no calendar has the times of an operation that begins {begin.isoformat()}"
        raise UsageError(msg) from error


def _rfc3339(instant: dt.datetime) -> str:
    return instant.isoformat(timespec="milliseconds").replace("+00:00", "Z")
