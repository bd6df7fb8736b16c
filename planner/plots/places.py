"""Places of a mission on the ground about its home: items, home, rally points, fence, findings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.findings import Severity
from planner.geo.fence import FencePolygon

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.geo.fence import FenceCircle
    from planner.geo.local_frame import LocalFrame
    from planner.rules.assessment import Assessment
    from planner.service import CheckResult

Row = dict[str, Any]

_CIRCLE_POINTS = 72
_EDGE_POINTS = 8
"""Fence edges are straight in degrees, thus bent in metres."""
_MOST_ITEMS = 1_500
"""Of more items only some are marked, evenly chosen: the path shows the others."""


def item_rows(assessment: Assessment) -> list[Row]:
    """Return the places of the items that are flown, a row each, but for a great many."""
    frame = assessment.route.frame
    stages = {stage.item: stage for stage in assessment.route.stages}
    chosen = list(stages)[:: 1 + len(stages) // _MOST_ITEMS]
    stages = {item: stages[item] for item in chosen}
    latitude_deg, longitude_deg = frame.latitude_longitude_deg(
        np.array([stage.east_m for stage in stages.values()]),
        np.array([stage.north_m for stage in stages.values()]),
    )
    return [
        _place("item", f"item {item}: {stage.kind}", frame, latitude, longitude)
        | {"item": item, "short": str(item)}
        for (item, stage), latitude, longitude in zip(
            stages.items(), latitude_deg.tolist(), longitude_deg.tolist(), strict=True
        )
    ]


def place_rows(assessment: Assessment) -> list[Row]:
    """Return home and the rally points, a row each."""
    frame = assessment.route.frame
    home = _place("home", "home", frame, frame.latitude_deg, frame.longitude_deg)
    rally = [
        _place(
            "rally point", f"rally point {number}", frame, place.latitude_deg, place.longitude_deg
        )
        | {"short": f"R{number}"}
        for number, place in enumerate(assessment.mission.rally, start=1)
    ]
    return [home | {"short": "H"}, *rally]


def fence_rows(assessment: Assessment) -> list[Row]:
    """Return the outlines of the fence's areas, closed, a row per point."""
    fence, frame = assessment.mission.fence, assessment.route.frame
    if fence is None:
        return []
    areas: tuple[FencePolygon | FenceCircle, ...] = (*fence.polygons, *fence.circles)
    rows: list[Row] = []
    for number, area in enumerate(areas, start=1):
        east_m, north_m = _outline(area, frame)
        rows += [
            {
                "area": number,
                "kind": "stay inside" if area.inclusion else "keep out",
                "order": order,
                "east_m": round(east, 1),
                "north_m": round(north, 1),
            }
            for order, (east, north) in enumerate(
                zip(east_m.tolist(), north_m.tolist(), strict=True)
            )
        ]
    return rows


def stretch_rows(result: CheckResult) -> list[Row]:
    """Return where over ground findings are, a row per point; ``finding`` counts as in the result."""
    if result.assessment is None:
        return []
    frame = result.assessment.route.frame
    return [
        {
            "finding": number,
            "code": finding.code,
            "part": part,
            "order": order,
            **_metres(frame, *point_deg),
        }
        for number, finding in enumerate(result.findings)
        if finding.severity > Severity.INFO and finding.stretch is not None
        for part, line_deg in enumerate(finding.stretch.lines_deg)
        for order, point_deg in enumerate(line_deg)
    ]


def _outline(area: FencePolygon | FenceCircle, frame: LocalFrame) -> tuple[FloatArray, FloatArray]:
    if isinstance(area, FencePolygon):
        corners = np.array([*area.vertices_deg, area.vertices_deg[0]])
        steps = np.linspace(0.0, len(corners) - 1, (len(corners) - 1) * _EDGE_POINTS + 1)
        whole = np.arange(len(corners))
        return frame.east_north_m(
            np.interp(steps, whole, corners[:, 0]), np.interp(steps, whole, corners[:, 1])
        )
    turn = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS + 1)
    east_m, north_m = frame.east_north_m(area.latitude_deg, area.longitude_deg)
    return east_m + area.radius_m * np.sin(turn), north_m + area.radius_m * np.cos(turn)


def _metres(frame: LocalFrame, latitude_deg: float, longitude_deg: float) -> Row:
    east_m, north_m = frame.east_north_m(latitude_deg, longitude_deg)
    return {"east_m": round(float(east_m), 1), "north_m": round(float(north_m), 1)}


def _place(
    kind: str, label: str, frame: LocalFrame, latitude_deg: float, longitude_deg: float
) -> Row:
    return {
        "kind": kind,
        "label": label,
        **_metres(frame, latitude_deg, longitude_deg),
        "latitude_deg": round(latitude_deg, 7),
        "longitude_deg": round(longitude_deg, 7),
    }
