"""A ``StructureScan`` of a plan: laps around a structure, expanded as QGroundControl does."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.commands import Command, Frame
from planner.mission.expand.survey import outline_frame, read_outline
from planner.mission.formats.json_document import LARGEST_LENGTH_M
from planner.mission.items import MOST_ITEMS

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.mission.formats.json_document import JsonFields
    from planner.mission.items import ItemSequence


MOST_LAYERS = 10_000
_FARTHEST_VERTEX_M = 1e6
"""Where the edges beside a spike are nearly parallel, they meet as far away as one likes. [m]"""
_DO_SET_ROI_WPNEXT_OFFSET = 196
_DO_SET_ROI_NONE = 197


STRUCTURE_SCAN_EXPANDED = Rule(
    "L115 structure-scan-expanded",
    Severity.INFO,
    summary="A structure scan is expanded as QGroundControl does on upload.",
    why="The file holds the structure, not the items: the vertex where the scan begins is not saved, "
    "and QGroundControl counts the layers again when it loads the file.  Some of its versions also "
    "read the entrance altitude wrongly, as 0 m.",
    how="The outline is moved outward by the distance to the surface; one lap per layer, from the "
    "first vertex, the first half a layer from the top or bottom: 4 + layers (n + 3) items.  A warning "
    "where the layers in the file are not those QGroundControl will count; the more are flown.  An error "
    "where it cannot count them: AdjustedFootprintFrontal is 0 or less.",
    fix="check the altitudes after loading the plan in QGroundControl, before the upload",
    instead="a plan whose layers have a height",
)


def add_structure_scan(scan: JsonFields, sequence: ItemSequence) -> None:
    """Add the items of a structure scan: 4 + layers (n + 3) for an outline of n vertices."""
    camera = scan.fields("CameraCalc", f"{scan.title}, camera")
    written = scan.whole("Layers", least=1, most=MOST_LAYERS)
    layer_m = camera.length("AdjustedFootprintFrontal")
    top_m, bottom_m = scan.length("StructureHeight"), scan.length("ScanBottomAlt")
    counted = _counted_layers(top_m - bottom_m, layer_m)
    layers = written if counted is None else max(written, counted)
    from_top = scan.truth("StartFromTop")
    outline = read_outline(scan)
    if 4 + layers * (len(outline) + 3) > MOST_ITEMS:
        scan.refuse(f"more than {MOST_ITEMS:,} items: MAVLink can send no more", "Layers")
    if layers * abs(layer_m) > LARGEST_LENGTH_M:
        height = f"{quantity.count(layers, 'layer')} of {layer_m:g} m"
        scan.refuse(f"{height}: higher than anybody flies", "Layers")
    path, is_moved = _flown_outline(np.array(outline), camera.length("DistanceToSurface"))

    def go_to(vertex: tuple[float, float], height_m: float) -> None:
        sequence.add_waypoint((*vertex, height_m), frame=Frame.GLOBAL_RELATIVE_ALT)

    entrance_m = scan.length("EntranceAltitude")
    go_to(path[0], entrance_m)
    sequence.add(
        _DO_SET_ROI_WPNEXT_OFFSET, 0.0, 0.0, 0.0, 0.0, scan.number("GimbalPitch"), 0.0, 90.0
    )
    step_m = -layer_m if from_top else layer_m
    altitude_m = (top_m if from_top else bottom_m) + step_m / 2.0
    trigger_m = camera.length("AdjustedFootprintSide")
    for _ in range(layers):
        go_to(path[0], altitude_m)
        sequence.add(Command.DO_SET_CAM_TRIGG_DIST, trigger_m, 0.0, 1.0)
        for vertex in (*path[1:], path[0]):
            go_to(vertex, altitude_m)
        sequence.add(Command.DO_SET_CAM_TRIGG_DIST)
        altitude_m += step_m
    sequence.add(_DO_SET_ROI_NONE)
    go_to(path[0], entrance_m)

    message = (
        f"{scan.title}: {len(sequence.items)} items computed, {quantity.count(layers, 'lap')} of "
        f"{len(path)} vertices from the first vertex, which QGroundControl does not save"
    )
    severity = None
    if counted is None:
        severity = Severity.ERROR
        message += (
            f"; the layers are {layer_m:g} m high, of which QGroundControl counts nobody knows how many: "
            "those of the file are predicted"
        )
    elif written != counted:
        severity = Severity.WARNING
        message += (
            f"; the file has {quantity.count(written, 'layer')}, QGroundControl will count "
            f"{quantity.count(counted, 'layer')} when it loads it: the more are predicted"
        )
    if not is_moved:
        severity = Severity.WARNING
        message += (
            "; two of its edges are in line, so that QGroundControl fails to move the outline "
            "outward and flies along the structure itself"
        )
    sequence.remark(STRUCTURE_SCAN_EXPANDED, message, severity=severity)


def _counted_layers(height_m: float, layer_m: float) -> int | None:
    """Return the layers that QGroundControl counts; ``None`` where it divides by nothing.

    Notes
    -----
    ``StructureScanComplexItem::_recalcLayerInfo``: the height of the surface over that of a layer, rounded
    up, one at least.
    """
    if layer_m <= 0.0:
        return None
    return max(math.ceil(min(max(height_m, 0.0) / layer_m, MOST_ITEMS)), 1)


def _flown_outline(
    vertices_deg: FloatArray, distance_m: float
) -> tuple[list[tuple[float, float]], bool]:
    """Return the outline moved outward, clockwise [°], and whether it could be moved.

    It cannot where two neighbouring edges are exactly in line: the offset edges have no one point
    in common.
    """
    frame, points_m = outline_frame(vertices_deg)
    following_m = np.roll(points_m, -1, axis=0)
    # Shoelace formula, positive anticlockwise.
    if np.sum(points_m[:, 0] * following_m[:, 1] - following_m[:, 0] * points_m[:, 1]) > 0.0:
        vertices_deg, points_m = vertices_deg[::-1], points_m[::-1]
        following_m = np.roll(points_m, -1, axis=0)
    along = following_m - points_m
    lengths = np.hypot(along[:, 0], along[:, 1])
    before = np.roll(along, 1, axis=0)
    crossing = before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0]
    if np.any(lengths == 0.0) or np.any(crossing == 0.0):
        return list(map(tuple, vertices_deg.tolist())), False
    # Clockwise, the outside is to the left: the direction (e, n) turned to (−n, e).
    starts = points_m + distance_m * np.column_stack((-along[:, 1], along[:, 0])) / lengths[:, None]
    earlier = np.roll(starts, 1, axis=0)
    # Where the offset edge before meets the offset edge after each vertex: earlier + t before.
    gap = starts - earlier
    with np.errstate(over="ignore", invalid="ignore"):
        t = (gap[:, 0] * along[:, 1] - gap[:, 1] * along[:, 0]) / crossing
        moved = earlier + t[:, None] * before
    if not np.all(np.abs(moved) < _FARTHEST_VERTEX_M):  # also catches NaN
        return list(map(tuple, vertices_deg.tolist())), False
    latitudes, longitudes = frame.latitude_longitude_deg(moved[:, 0], moved[:, 1])
    return list(zip(latitudes.tolist(), longitudes.tolist(), strict=True)), True
