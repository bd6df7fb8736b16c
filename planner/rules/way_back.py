"""The speed of PX4's own returns back along the mission (RTL_TYPE 2 and 4), which PX4 leaves open."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState
from planner.flight.prediction import HOVER_HEIGHT_M
from planner.flight.returns.destination import ALONG, SETTING_NOT_FOLLOWED
from planner.mission.route.stage import StageKind
from planner.rules.declaration import PX4, judges
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.mission.route.stage import ReturnPath
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters

_OTHER_M_S = 0.1
_ONE_SPEED = "command one speed for the whole mission, or set RTL_TYPE to 0"


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _speed_back_open(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report ways back at a speed that PX4 may take from another item than predicted."""
    asked = f"RTL_TYPE {parameters.return_type}"
    for stage in a.route.stages_of(StageKind.RETURN):
        predicted_m_s, other_m_s = _speeds_m_s(stage.return_path, parameters)
        if other_m_s:
            yield a.finding(
                SETTING_NOT_FOLLOWED,
                f"{asked}: the mission's own return is flown at {quantity.speed(other_m_s[0])} or, as "
                f"predicted, at {quantity.speed(predicted_m_s)}: which of them PX4 takes is not known",
                item=stage.item,
                severity=Severity.ERROR,
                fix=_ONE_SPEED,
            )
            return
    along, sampled = a.returns.destinations.along, a.returns.sampled
    if sampled is None or not any(path.other_speeds_m_s for path in along):
        return
    points = a.returns.places(*sampled)
    leads = a.returns.destinations.chosen(points.place_m, points.stage) == ALONG
    open_ways: list[tuple[int, float, float, float]] = []
    for row in np.flatnonzero(leads).tolist():
        path = along[int(points.stage[row])]
        predicted_m_s, other_m_s = _speeds_m_s(path, parameters)
        if other_m_s:
            way_m = _way_m(path, *points.stop_m[row, :2].tolist())
            open_ways += [(row, way_m, predicted_m_s, one) for one in other_m_s]
    if not open_ways:
        return
    way_m, flown_m_s, other = np.array(open_ways)[:, 1:].T
    # Slower it is held up in the air as long as a hover would be: no level flight takes more at less speed.
    later_wh = a.hovered_wh(1.0) * way_m * (1.0 / other - 1.0 / flown_m_s)
    faster_wh = wh_from_j(
        way_m * (_level_w(a, other)[1] / other - _level_w(a, flown_m_s)[0] / flown_m_s)
    )
    more_wh = np.maximum(np.where(other < flown_m_s, later_wh, faster_wh), 0.0)
    worst = int(np.nan_to_num(more_wh).argmax())
    most_wh = float(more_wh[worst])
    is_short = most_wh > a.left_wh
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"{asked}: a return from here goes back along the mission at {quantity.speed(float(other[worst]))} "
        f"or, as predicted, at {quantity.speed(float(flown_m_s[worst]))}"
        + (f": up to {quantity.energy(most_wh)} more" if most_wh > 0.0 else "")
        + (f", {quantity.energy(most_wh - a.left_wh)} short of the reserve" if is_short else ""),
        item=a.route.stages[int(points.stage[open_ways[worst][0]])].item,
        severity=Severity.ERROR if is_short else None,
        fix=_ONE_SPEED,
    )


def _speeds_m_s(
    path: ReturnPath | None, parameters: Px4Parameters
) -> tuple[float, tuple[float, ...]]:
    """Return the speed of a way back as predicted, and others it may be flown at. [m/s]"""
    own_m_s, most_m_s = parameters.cruise_speed_m_s, parameters.speed_max_m_s
    if path is None:
        return own_m_s, ()
    predicted_m_s = min(path.speed_m_s or own_m_s, most_m_s)
    others = {min(one or own_m_s, most_m_s) for one in path.other_speeds_m_s}
    return predicted_m_s, tuple(
        one for one in sorted(others) if abs(one - predicted_m_s) > _OTHER_M_S
    )


def _way_m(path: ReturnPath, east_m: float, north_m: float) -> float:
    """Return the length over ground of a way back from a place. [m]"""
    places = [(east_m, north_m), *((one.east_m, one.north_m) for one in path.stages)]
    return sum(math.dist(*two) for two in pairwise(places))


def _level_w(a: Assessment, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least and the most power of level flight low over home, by its direction. (n,) [W]"""
    count = len(speed_m_s)
    place_m = np.zeros((3, count))
    place_m[2] = HOVER_HEIGHT_M
    cruising = np.full(count, STATE_INDEX[FlightState.CRUISE])
    power_w = [
        a.flight.power.power_w(
            KinematicState.of(place_m, (east * speed_m_s, north * speed_m_s, np.zeros(count))),
            cruising,
            speed_m_s,
        )
        for east, north in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    ]
    return np.min(power_w, axis=0), np.max(power_w, axis=0)
