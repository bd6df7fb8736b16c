"""A ``survey`` of a plan that holds no items: computed from its area as QGroundControl does."""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.frozen import frozen
from planner.geo.local_frame import LocalFrame
from planner.mission.commands import Command, Frame
from planner.mission.item_sequence import ItemSequence
from planner.mission.items import MOST_ITEMS
from planner.mission.survey_grid import (
    EntryCorner,
    begun_nearest,
    in_alternation,
    make_transects_m,
    to_and_fro,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.findings import Place
    from planner.mission.items import MissionItem
    from planner.mission.json_fields import JsonFields

    FloatArray = npt.NDArray[np.float64]

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


@frozen
class SurveyPlan:
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
    entry: EntryCorner
    altitude_m: float
    """Altitude flown at, in the reference of ``frame``. [m]"""
    frame: int
    hovers_for_pictures: bool
    triggers_in_turns: bool
    refly_at_90_deg: bool
    flies_alternately: bool


def read_survey(survey: JsonFields) -> SurveyPlan | None:
    """Return what a survey of version 4 or 5 is computed from, ``None`` if it does not say.

    Raises
    ------
    MissionFileError
        If something in it is of the wrong type.
    """
    if not isinstance(survey.value.get("TransectStyleComplexItem"), dict):
        return None
    transects = survey.fields("TransectStyleComplexItem", f"{survey.title}, transects")
    if not isinstance(transects.value.get("CameraCalc"), dict):
        return None
    camera = transects.fields("CameraCalc", f"{survey.title}, camera")
    return SurveyPlan(
        outline_deg=_read_outline(survey),
        angle_deg=survey.number("angle"),
        spacing_m=camera.length("AdjustedFootprintSide"),
        trigger_distance_m=camera.length("AdjustedFootprintFrontal"),
        turn_distance_m=transects.length("TurnAroundDistance"),
        entry=EntryCorner(survey.whole("entryLocation", most=3, default=0)),
        altitude_m=camera.length("DistanceToSurface"),
        frame=read_frame(transects, camera),
        hovers_for_pictures=transects.truth("HoverAndCapture", default=False),
        triggers_in_turns=transects.truth("CameraTriggerInTurnAround", default=True),
        refly_at_90_deg=transects.truth("Refly90Degrees", default=False),
        flies_alternately=survey.truth("flyAlternateTransects", default=False),
    )


def read_older_survey(survey: JsonFields) -> SurveyPlan:
    """Return what a survey of version 2 or 3 is computed from.

    Raises
    ------
    MissionFileError
        If something in it is missing or of the wrong type.
    """
    grid = survey.fields("grid", f"{survey.title}, grid")
    is_relative = grid.truth("relativeAltitude")
    entry = grid.whole("entryLocation", most=3, default=int(EntryCorner.TOP_RIGHT))
    return SurveyPlan(
        outline_deg=_read_outline(survey),
        angle_deg=grid.number("angle"),
        spacing_m=grid.length("spacing"),
        trigger_distance_m=survey.length("cameraTriggerDistance"),
        turn_distance_m=grid.length("turnAroundDistance"),
        entry=EntryCorner(entry),
        altitude_m=grid.length("altitude"),
        frame=Frame.GLOBAL_RELATIVE_ALT if is_relative else Frame.GLOBAL,
        hovers_for_pictures=survey.truth("hoverAndCapture", default=False),
        triggers_in_turns=survey.truth("cameraTriggerInTurnaround", default=True),
        refly_at_90_deg=survey.truth("refly90Degrees", default=False),
        flies_alternately=False,
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


def _read_outline(survey: JsonFields) -> tuple[tuple[float, float], ...]:
    outline = tuple(survey.position("polygon", n) for n in range(len(survey.listed("polygon"))))
    if len(outline) < 3:
        survey.refuse(
            f"its polygon has {numbers.count(len(outline), 'vertex', 'vertices')}", "polygon"
        )
    return outline


def make_survey_items(
    plan: SurveyPlan, place: Place, *, first_number: int
) -> tuple[list[MissionItem], int]:
    """Return the items of a survey and its number of lines.

    Parameters
    ----------
    plan : SurveyPlan
        What to compute it from.
    place : Place
        Where the survey stands in the file.
    first_number : int
        Number of its first item in flown order.

    Raises
    ------
    ValueError
        If the area or the number of lines is beyond what anybody flies.
    """
    outline = np.array(plan.outline_deg)
    frame = LocalFrame(latitude_deg=float(outline[0, 0]), longitude_deg=float(outline[0, 1]))
    outline_m = np.column_stack(frame.east_north_m(outline[:, 0], outline[:, 1]))
    if np.abs(outline_m).max() > _WIDEST_AREA_M:
        msg = f"an area wider than {_WIDEST_AREA_M / 1000.0:g} km"
        raise ValueError(msg)
    # Beyond a right angle QGroundControl turns the lines back, to keep their order.
    angle_deg = plan.angle_deg
    if abs(angle_deg) > 90.0:
        angle_deg -= float(np.copysign(180.0, angle_deg))
    points: list[tuple[float, float]] = []
    kinds: list[PointKind] = []
    lines = 0
    for extra_deg in (0.0, 90.0) if plan.refly_at_90_deg else (0.0,):
        transects = make_transects_m(
            outline_m,
            angle_deg=angle_deg + extra_deg,
            spacing_m=plan.spacing_m,
            entry=plan.entry,
        )
        if extra_deg and points and len(transects):
            transects = begun_nearest(transects, np.array(points[-1]))
        if plan.flies_alternately:
            transects = in_alternation(transects)
        lines += len(transects)
        for begin, end in to_and_fro(transects):
            line = _line(begin, end, plan)
            if len(points) + len(line) > MOST_ITEMS:
                msg = f"more than {MOST_ITEMS:,} points"
                raise ValueError(msg)
            points += [point for point, _ in line]
            kinds += [kind for _, kind in line]
    if not points:
        return [], 0
    latitudes, longitudes = frame.latitude_longitude_deg(*np.array(points).T)
    positions = zip(latitudes.tolist(), longitudes.tolist(), strict=True)
    return _items(plan, list(positions), kinds, place, first_number), lines


def _line(
    begin: FloatArray, end: FloatArray, plan: SurveyPlan
) -> list[tuple[tuple[float, float], PointKind]]:
    """Return the points of one line with what they are for. [m]."""
    length_m = float(np.hypot(*(end - begin)))
    direction = (end - begin) / length_m

    def point(distance_m: float) -> tuple[float, float]:
        east_m, north_m = begin + distance_m * direction
        return float(east_m), float(north_m)

    line = [(point(0.0), PointKind.ENTRY)]
    step_m = plan.trigger_distance_m
    if plan.hovers_for_pictures and 0.0 < step_m < length_m:
        pictures = int(length_m / step_m)
        if pictures > MOST_ITEMS:
            msg = f"more than {MOST_ITEMS:,} points"
            raise ValueError(msg)
        line += [(point(step_m * n), PointKind.PICTURE) for n in range(1, pictures + 1)]
    line.append((point(length_m), PointKind.EXIT))
    if plan.turn_distance_m > 0.0:
        line.insert(0, (point(-plan.turn_distance_m), PointKind.TURN))
        line.append((point(length_m + plan.turn_distance_m), PointKind.TURN))
    return line


def _items(
    plan: SurveyPlan,
    positions: list[tuple[float, float]],
    kinds: list[PointKind],
    place: Place,
    first_number: int,
) -> list[MissionItem]:
    """Return waypoints and camera commands in the order in which QGroundControl writes them."""
    takes_pictures = plan.trigger_distance_m > 0.0
    hovers = takes_pictures and plan.hovers_for_pictures
    stays_on = takes_pictures and not hovers and plan.triggers_in_turns
    sequence = ItemSequence(first_number=first_number, place=place)
    last = len(positions) - 1
    for index, (position, kind) in enumerate(zip(positions, kinds, strict=True)):
        is_picture = hovers and kind is not PointKind.TURN
        sequence.add_waypoint(
            *position,
            plan.altitude_m,
            frame=plan.frame,
            hold_s=HOVER_AND_CAPTURE_S if is_picture else 0.0,
        )
        if is_picture:
            sequence.add(_IMAGE_START_CAPTURE, 0.0, 0.0, 1.0, None, None, None, None)
        elif takes_pictures and not hovers:
            is_on = kind is PointKind.ENTRY or (stays_on and index == 0)
            is_off = index == last if stays_on else kind is PointKind.EXIT
            if is_on or is_off:
                distance_m = plan.trigger_distance_m if is_on else 0.0
                sequence.add(Command.DO_SET_CAM_TRIGG_DIST, distance_m, 0.0, 1.0)
    return sequence.items
