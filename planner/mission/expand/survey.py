"""A ``survey`` of a plan that holds no items: computed from its area as QGroundControl does."""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.geo.geodesy import LocalFrame
from planner.mission.commands import Command, Frame
from planner.mission.items import MOST_ITEMS
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.mission.formats.json_document import JsonFields
    from planner.mission.items import ItemSequence


CLOSEST_SPACING_M = 0.5
"""QGroundControl flies one line where the spacing is less. [m]"""
MOST_CROSSINGS = 5_000_000
"""Lines times edges: bounds memory."""
_SHORTEST_LINE_M = 1e-3
"""A line that only touches a corner is none. [m]"""
_MARGIN_M = 1000.0
"""The first line lies this far outside half the area's greater extent. [m]"""


def make_transects_m(
    outline_m: FloatArray, *, angle_deg: float, spacing_m: float, entry: int
) -> FloatArray:
    """Return the lines of a survey in the order of flight, all in one direction. [k × 2 × 2, m].

    Lines lie ``spacing_m`` apart (one line below ``CLOSEST_SPACING_M``), turned clockwise by
    ``angle_deg`` from north, and are counted from the left; each reaches from the first to the last
    crossing with the outline, in the direction in which the outline's edges come along the first
    line.  ``entry`` is QGroundControl's number: 1 begins at the right, 2 at the bottom, 3 at both.

    Raises ValueError if there are more crossings than ``MOST_CROSSINGS``.
    """
    low, high = outline_m.min(axis=0), outline_m.max(axis=0)
    centre = (low + high) / 2.0
    angle = np.radians(angle_deg)
    across = np.array([np.cos(angle), -np.sin(angle)])
    along = np.array([np.sin(angle), np.cos(angle)])
    vertices = np.column_stack(((outline_m - centre) @ across, (outline_m - centre) @ along))

    offsets = np.zeros(1)
    if spacing_m >= CLOSEST_SPACING_M:
        first = -(np.max(high - low) / 2.0 + _MARGIN_M)
        nearest, last = vertices[:, 0].min(), vertices[:, 0].max()
        numbers = np.arange(
            np.ceil((nearest - first) / spacing_m), np.floor((last - first) / spacing_m) + 1.0
        )
        if len(numbers) * len(vertices) > MOST_CROSSINGS:
            msg = f"{len(numbers):,} lines across {len(vertices):,} edges"
            raise ValueError(msg)
        offsets = first + numbers * spacing_m
    ends = _line_ends(vertices, offsets)
    if len(ends) < 2:  # one line through the middle
        ends = _line_ends(vertices, np.zeros(1))
    transects: FloatArray = centre + ends[..., :1] * across + ends[..., 1:] * along
    return transects[:: -1 if entry & 1 else 1, :: -1 if entry & 2 else 1]


def _line_ends(vertices: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return (across, along) of the two ends of each line that crosses the outline. [k × 2 × 2]."""
    following = np.roll(vertices, -1, axis=0)
    run = (following[:, 0] - vertices[:, 0])[:, None]
    with np.errstate(all="ignore"):  # edges along the lines cross none
        fraction = (offsets - vertices[:, :1]) / run
        crossings = vertices[:, 1:] + fraction * (following[:, 1:] - vertices[:, 1:])
    is_crossed = (fraction >= 0.0) & (fraction <= 1.0) & (run != 0.0)
    lowest = np.where(is_crossed, crossings, np.inf)
    highest = np.where(is_crossed, crossings, -np.inf)
    low, high = lowest.min(axis=0), highest.max(axis=0)
    crossed = high - low > _SHORTEST_LINE_M
    if not crossed.any():
        return np.empty((0, 2, 2))
    # QGroundControl takes the crossing with the earlier edge as a line's beginning, and turns all
    # further lines the way of the first.
    index = int(np.argmax(crossed))
    is_rising = np.argmin(lowest[:, index]) < np.argmax(highest[:, index])
    ends = np.column_stack((low, high) if is_rising else (high, low))
    both = np.stack((np.broadcast_to(offsets[:, None], ends.shape), ends), axis=-1)
    chosen: FloatArray = both[crossed]
    return chosen


def in_alternation(transects_m: FloatArray) -> FloatArray:
    """Return every second line, then the ones between on the way back. [k × 2 × 2, m]."""
    return np.concatenate((transects_m[::2], transects_m[1::2][::-1]))


def to_and_fro(transects_m: FloatArray) -> FloatArray:
    """Return the lines with every second one flown the other way. [k × 2 × 2, m]."""
    flown = transects_m.copy()
    flown[1::2] = flown[1::2, ::-1]
    return flown


def begun_nearest(transects_m: FloatArray, point_m: FloatArray) -> FloatArray:
    """Return the lines in the order and direction that begins nearest to a point.

    QGroundControl looks at three of the four corners only; so does this.
    """
    corners = np.array([transects_m[0, 0], transects_m[0, 1], transects_m[-1, 0]])
    nearest = int(np.argmin(np.hypot(*(corners - point_m).T)))
    if nearest == 2:
        return transects_m[::-1]
    return transects_m[:, ::-1] if nearest == 1 else transects_m


HOVER_AND_CAPTURE_S = 4.0
"""How long QGroundControl waits at each picture. [s]"""
_IMAGE_START_CAPTURE = 2000
_WIDEST_AREA_M = 100_000.0


class PointKind(Enum):
    """What a point of a survey is for."""

    TURN = auto()
    ENTRY = auto()
    PICTURE = auto()
    EXIT = auto()


class SurveyPlan(Value):
    """What a survey is computed from."""

    outline_deg: tuple[tuple[float, float], ...]
    """Latitude and longitude of each vertex. [°]"""
    angle_deg: float
    """Direction of the lines, clockwise from north. [°]"""
    spacing_m: float
    trigger_distance_m: float
    """Distance between pictures, 0 for none. [m]"""
    turn_distance_m: float
    """How far each line is lengthened to turn around. [m]"""
    entry: int
    altitude_m: float
    """Altitude flown at, in the reference of ``frame``. [m]"""
    frame: int
    hovers_for_pictures: bool
    triggers_in_turns: bool
    refly_at_90_deg: bool
    flies_alternately: bool


def read_survey(survey: JsonFields) -> SurveyPlan | None:
    """Return what a survey is computed from, ``None`` if that is not in it."""
    if survey.value.get("version") in (2, 3):
        grid = survey.fields("grid", f"{survey.title}, grid")
        is_relative = grid.truth("relativeAltitude")
        return SurveyPlan(
            outline_deg=read_outline(survey),
            angle_deg=grid.number("angle"),
            spacing_m=grid.length("spacing"),
            trigger_distance_m=survey.length("cameraTriggerDistance"),
            turn_distance_m=grid.length("turnAroundDistance"),
            entry=grid.whole("entryLocation", most=3, default=1),
            altitude_m=grid.length("altitude"),
            frame=Frame.GLOBAL_RELATIVE_ALT if is_relative else Frame.GLOBAL,
            hovers_for_pictures=survey.truth("hoverAndCapture", default=False),
            triggers_in_turns=survey.truth("cameraTriggerInTurnaround", default=True),
            refly_at_90_deg=survey.truth("refly90Degrees", default=False),
            flies_alternately=False,
        )
    if not isinstance(survey.value.get("TransectStyleComplexItem"), dict):
        return None
    transects = survey.fields("TransectStyleComplexItem", f"{survey.title}, transects")
    if not isinstance(transects.value.get("CameraCalc"), dict):
        return None
    camera = transects.fields("CameraCalc", f"{survey.title}, camera")
    return SurveyPlan(
        outline_deg=read_outline(survey),
        angle_deg=survey.number("angle"),
        spacing_m=camera.length("AdjustedFootprintSide"),
        trigger_distance_m=camera.length("AdjustedFootprintFrontal"),
        turn_distance_m=transects.length("TurnAroundDistance"),
        entry=survey.whole("entryLocation", most=3, default=0),
        altitude_m=camera.length("DistanceToSurface"),
        frame=read_frame(transects, camera),
        hovers_for_pictures=transects.truth("HoverAndCapture", default=False),
        triggers_in_turns=transects.truth("CameraTriggerInTurnAround", default=True),
        refly_at_90_deg=transects.truth("Refly90Degrees", default=False),
        flies_alternately=survey.truth("flyAlternateTransects", default=False),
    )


def read_frame(transects: JsonFields, camera: JsonFields) -> int:
    """Return the frame in which a survey's or corridor's altitude counts.

    Where QGroundControl follows terrain, the altitude is its height over terrain; it would write
    the AMSL altitudes it computed, which the file does not hold.
    """
    if "DistanceMode" in camera.value:
        mode = camera.whole("DistanceMode", most=5)
        frames = {1: Frame.GLOBAL_RELATIVE_ALT, 2: Frame.GLOBAL}
        return frames.get(mode, Frame.GLOBAL_TERRAIN_ALT)
    if transects.truth("FollowTerrain", default=False):
        return Frame.GLOBAL_TERRAIN_ALT
    is_relative = camera.truth("DistanceToSurfaceRelative", default=True)
    return Frame.GLOBAL_RELATIVE_ALT if is_relative else Frame.GLOBAL


def read_outline(survey: JsonFields) -> tuple[tuple[float, float], ...]:
    """Return the vertices of the polygon that an item is drawn around, three or more. [°]"""
    outline = tuple(survey.position("polygon", n) for n in range(len(survey.listed("polygon"))))
    if len(outline) < 3:
        corners = quantity.count(len(outline), "vertex", "vertices")
        survey.refuse(f"its polygon has {corners}", "polygon")
    return outline


def outline_frame(vertices_deg: FloatArray) -> tuple[LocalFrame, FloatArray]:
    """Return the local frame at the first of some vertices, and all of them in it. [n × 2, m]."""
    latitude_deg, longitude_deg = vertices_deg[0].tolist()
    frame = LocalFrame(latitude_deg=latitude_deg, longitude_deg=longitude_deg)
    return frame, np.column_stack(frame.east_north_m(*vertices_deg.T))


def add_survey(plan: SurveyPlan, sequence: ItemSequence) -> int:
    """Add the items of a survey and return its number of lines.

    Raises ValueError if the area or the number of lines is beyond what anybody flies.
    """
    frame, outline_m = outline_frame(np.array(plan.outline_deg))
    if np.abs(outline_m).max() > _WIDEST_AREA_M:
        msg = f"an area wider than {_WIDEST_AREA_M / 1000.0:g} km"
        raise ValueError(msg)
    # Beyond a right angle QGroundControl turns the lines back, to keep their order.
    angle_deg = plan.angle_deg
    if abs(angle_deg) > 90.0:
        angle_deg -= float(np.copysign(180.0, angle_deg))
    points: list[tuple[FloatArray, PointKind]] = []
    lines = 0
    for extra_deg in (0.0, 90.0) if plan.refly_at_90_deg else (0.0,):
        transects = make_transects_m(
            outline_m, angle_deg=angle_deg + extra_deg, spacing_m=plan.spacing_m, entry=plan.entry
        )
        if points and len(transects):
            transects = begun_nearest(transects, points[-1][0])
        if plan.flies_alternately:
            transects = in_alternation(transects)
        lines += len(transects)
        for begin, end in to_and_fro(transects):
            points += _line(begin, end, plan)
            if len(points) > MOST_ITEMS:
                msg = f"more than {MOST_ITEMS:,} points"
                raise ValueError(msg)
    if points:
        places_deg = frame.latitude_longitude_deg(*np.array([point for point, _ in points]).T)
        _add_items(plan, np.stack(places_deg).T.tolist(), [kind for _, kind in points], sequence)
    return lines


def _line(
    begin: FloatArray, end: FloatArray, plan: SurveyPlan
) -> list[tuple[FloatArray, PointKind]]:
    """Return the points of one line with what they are for. [m]."""
    length_m = float(np.hypot(*(end - begin)))
    direction = (end - begin) / length_m
    places = [(0.0, PointKind.ENTRY)]
    step_m = plan.trigger_distance_m
    if plan.hovers_for_pictures and 0.0 < step_m < length_m:
        pictures = int(length_m / step_m)
        if pictures > MOST_ITEMS:
            msg = f"more than {MOST_ITEMS:,} points"
            raise ValueError(msg)
        places += [(step_m * n, PointKind.PICTURE) for n in range(1, pictures + 1)]
    places.append((length_m, PointKind.EXIT))
    if plan.turn_distance_m > 0.0:
        places.insert(0, (-plan.turn_distance_m, PointKind.TURN))
        places.append((length_m + plan.turn_distance_m, PointKind.TURN))
    return [(begin + distance_m * direction, kind) for distance_m, kind in places]


def _add_items(
    plan: SurveyPlan,
    places_deg: list[tuple[float, float]],
    kinds: list[PointKind],
    sequence: ItemSequence,
) -> None:
    """Add waypoints and camera commands in the order in which QGroundControl writes them."""
    takes_pictures = plan.trigger_distance_m > 0.0
    hovers = takes_pictures and plan.hovers_for_pictures
    stays_on = takes_pictures and not hovers and plan.triggers_in_turns
    last = len(kinds) - 1
    for index, (place_deg, kind) in enumerate(zip(places_deg, kinds, strict=True)):
        is_picture = hovers and kind is not PointKind.TURN
        hold_s = HOVER_AND_CAPTURE_S if is_picture else 0.0
        position = (*place_deg, plan.altitude_m)
        sequence.add_waypoint(position, frame=plan.frame, hold_s=hold_s)
        if is_picture:
            sequence.add(_IMAGE_START_CAPTURE, 0.0, 0.0, 1.0, None, None, None, None)
        elif takes_pictures and not hovers:
            is_on = kind is PointKind.ENTRY or (stays_on and index == 0)
            is_off = index == last if stays_on else kind is PointKind.EXIT
            if is_on or is_off:
                distance_m = plan.trigger_distance_m if is_on else 0.0
                sequence.add(Command.DO_SET_CAM_TRIGG_DIST, distance_m, 0.0, 1.0)
