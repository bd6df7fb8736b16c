"""Family L, from L150: what loaders make of text missions and of files."""

from __future__ import annotations

import gzip
import json
from typing import TYPE_CHECKING

from rule_cases.case import RuleCases

from planner.mission.files import read_mission_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding

HEADER = "QGC WPL 110"
HOME = "0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1"
TAKEOFF = "1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1"
THERE = "2\t0\t3\t16\t0\t0\t0\t0\t47.001\t8\t30\t1"
RALLY = "2\t0\t{frame}\t5100\t0\t0\t0\t0\t47.001\t8\t{altitude}\t1"


def read(*lines: str, header: str = HEADER, name: str = "a.waypoints") -> tuple[Finding, ...]:
    """Return what a reader tells of rows of text."""
    text = "".join(f"{line}\n" for line in (header, *lines))
    return read_mission_bytes(text.encode(), source=name).findings


def fence(said: int, *corners: str) -> tuple[Finding, ...]:
    """Return what is reported of fence rows that announce a number of vertices."""
    return read(
        HOME,
        TAKEOFF,
        *(f"{n}\t0\t0\t5001\t{said}\t0\t0\t0\t{at}\t0\t1" for n, at in enumerate(corners, start=2)),
    )


def rally(frame: int, *, home: str = HOME) -> tuple[Finding, ...]:
    """Return what is reported of a rally row in a frame."""
    return read(home, TAKEOFF, RALLY.format(frame=frame, altitude=450))


def as_bytes(data: bytes) -> tuple[Finding, ...]:
    return read_mission_bytes(data, source="a.waypoints").findings


def as_drawn(name: str) -> tuple[Finding, ...]:
    """Return what a reader tells of GeoJSON with a line and an area about it."""
    ring = [[7.9, 46.9], [8.1, 46.9], [8.1, 47.1], [7.9, 46.9]]
    geometries = (
        {"type": "LineString", "coordinates": [[8, 47, 450], [8.002, 47, 460]]},
        {"type": "Polygon", "coordinates": [ring]},
    )
    features = [
        {"type": "Feature", "properties": {"name": name}, "geometry": one} for one in geometries
    ]
    return as_bytes(json.dumps({"type": "FeatureCollection", "features": features}).encode())


TEXT = f"{HEADER}\n{HOME}\n{TAKEOFF}\n{THERE}\n"
CORNERS = ("47\t8", "47.1\t8", "47.1\t8.1")

CASES: Mapping[str, RuleCases] = {
    "L150": RuleCases(
        fires=lambda: read(HOME, TAKEOFF, header="QGC WPL  110"),
        boundary=lambda: as_bytes(TEXT.replace("\n", "\r\n").encode()),
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L151": RuleCases(
        fires=lambda: read(HOME, TAKEOFF.replace("\t", " ")),
        boundary=lambda: read(HOME, f"{TAKEOFF}\t1"),  # 13 fields: L155
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L152": RuleCases(
        fires=lambda: read("0\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1"),
        boundary=lambda: read("0\t0\t3\t16\t0\t0\t0\t0\t47\t8\t0\t1", THERE),  # altitude zero
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L153": RuleCases(
        fires=lambda: read(HOME, TAKEOFF, THERE.replace("2\t0", "3\t0", 1)),
        boundary=lambda: read(TAKEOFF, THERE),  # from 1: the home row is left out
        silent=lambda: read(HOME, TAKEOFF, THERE),
    ),
    "L154": RuleCases(
        fires=lambda: read(HOME, "1\t0\t3\t22\t0\t0\t0\tnan\t47\t8\t30\t1"),
        boundary=lambda: read(HOME, "1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1"),
        silent=lambda: read(HOME, TAKEOFF, THERE),
    ),
    "L155": RuleCases(
        fires=lambda: read(HOME, f"{TAKEOFF}\t1"),
        boundary=lambda: read(HOME, TAKEOFF),
        silent=lambda: read(HOME, f"{TAKEOFF} # go"),
    ),
    "L156": RuleCases(
        fires=lambda: fence(3, *CORNERS),
        boundary=lambda: read("0\t0\t0\t5001\t1\t0\t0\t0\t47\t8\t0\t1"),  # none but them: L157
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L157": RuleCases(
        fires=lambda: read("0\t0\t3\t5100\t0\t0\t0\t0\t47\t8\t50\t1"),
        boundary=lambda: rally(3),
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L158": RuleCases(
        fires=lambda: read("0\t0\t3\t5100\t0\t0\t0\t0\tnan\t8\t50\t1"),
        boundary=lambda: rally(3),
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L159": RuleCases(
        fires=lambda: rally(10),
        boundary=lambda: rally(0),  # AMSL, and the altitude of home is known
        silent=lambda: rally(3),
    ),
    "L160": RuleCases(
        fires=lambda: read(HOME, TAKEOFF, THERE.replace("\t3\t16", "\t10\t16")),
        boundary=lambda: read(HOME, TAKEOFF, THERE.replace("\t3\t16", "\t6\t16")),
        silent=lambda: read(HOME, TAKEOFF, THERE),
    ),
    "L161": RuleCases(
        fires=lambda: read(HOME, TAKEOFF, name="a.plan"),
        boundary=lambda: read(HOME, TAKEOFF, name="a.abc"),  # says nothing
        silent=lambda: read(HOME, TAKEOFF, name="a.TXT"),
    ),
    "L162": RuleCases(
        fires=lambda: as_bytes(TEXT.encode("utf-8-sig")),
        boundary=lambda: as_bytes(f"{TEXT}# Übung\n".encode()),
        silent=lambda: as_bytes(TEXT.encode()),
    ),
    "L164": RuleCases(
        fires=lambda: fence(2, *CORNERS[:2]),
        boundary=lambda: fence(3, *CORNERS),
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "L165": RuleCases(
        fires=lambda: as_bytes(b"latitude,longitude,altitude(m)\n47,8,30\n47.001,8,30\n"),
        boundary=lambda: as_bytes(
            b"latitude,longitude,altitude(m)\n47,8,30\n"
        ),  # one point will do
        fires_at_boundary=True,
        silent=lambda: read(HOME, TAKEOFF),
    ),
    "F115": RuleCases(
        fires=lambda: as_drawn("Zone 1"),
        boundary=lambda: as_drawn("Fence"),
        silent=lambda: as_drawn("no-fly zone"),
    ),
    "L163": RuleCases(
        fires=lambda: as_bytes(gzip.compress(TEXT.encode())),
        boundary=lambda: read(HOME, TAKEOFF, name="a.gz"),
        silent=lambda: as_bytes(TEXT.encode()),
    ),
}
