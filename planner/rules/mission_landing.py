"""Rules on PX4's own returns to the mission's landing (RTL_TYPE 1 and 3), which fly other than predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.returns.destination import LANDING, SETTING_NOT_FOLLOWED
from planner.rules.clearance import STRAIGHT_M, clearance_of
from planner.rules.declaration import PX4, NotEvaluated, judges
from planner.rules.terrain_returns import RETURN_BELOW_TERRAIN
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters

_LAND = STATE_INDEX[FlightState.LAND]
_STEPS = 100
_WORTH_SAYING_M = 3.0
_REACHED = 0.8
"""Of the way that a vehicle flies at its speed while it sinks; flown 129 m of 126 m from 30 m up."""
_NEAR_M = 10.0
"""So near to its landing a vehicle does not come down anywhere else. [m]"""
_PLACE_BEFORE = "set RTL_TYPE to 0, or put DO_LAND_START and a waypoint before the landing"


class _ToLanding(Value, eq=False):
    """n returns to the mission's landing, as PX4 flies them."""

    stage: IntArray
    """Of the route, that they begin in. (n,)"""
    begins_m: FloatArray
    """Height above home where they begin. (n,) [m]"""
    begins_at_m: FloatArray
    """East and north of there. (n, 2) [m]"""
    climbs_to_m: FloatArray
    """Height above home below which they climb, to it. (n,) [m]"""
    predicted_m: FloatArray
    """Height above home they are predicted at. (n,) [m]"""
    way_m: FloatArray
    """To the landing. (n,) [m]"""
    lands: Stage


def _returns_to_landing(a: Assessment) -> _ToLanding | None:
    """Return the returns to the mission's landing; ``None`` where there are none.

    PX4 chooses the height of such a return where its type becomes that, not where it begins
    (``RTL::setRtlTypeAndDestination``): standing at home, or where the landing becomes the nearest place.
    """
    landing, sampled = a.returns.destinations.landing, a.returns.sampled
    if landing is None or sampled is None:
        return None
    flown = a.returns.places(*sampled)
    place_m, stop_m = (np.vstack((np.zeros(3), one)) for one in (flown.place_m, flown.stop_m))
    stage = np.append(0, flown.stage)
    leads = a.returns.destinations.chosen(place_m, stage) == LANDING
    changes = leads & ~np.append(False, leads[:-1])
    chosen_at = np.maximum.accumulate(np.where(changes, np.arange(len(leads)), 0))
    # It stands at home, or is landing there.
    leads &= np.append(False, a.flight.motion.segments.state[flown.segment] != _LAND)
    stage, stop_m, chosen_m = stage[leads], stop_m[leads], place_m[chosen_at][leads]
    if not len(stage):
        return None
    lands = landing.stages[-1]
    targets = a.returns.destinations.targets(stage, LANDING, stop_m)
    height_m = a.returns.pilot.return_heights_m
    return _ToLanding(
        stage=stage,
        begins_m=stop_m[:, 2],
        begins_at_m=stop_m[:, :2],
        climbs_to_m=height_m(chosen_m, targets),
        predicted_m=height_m(stop_m, targets),
        way_m=np.hypot(lands.east_m - stop_m[:, 0], lands.north_m - stop_m[:, 1]),
        lands=lands,
    )


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _sinks_on_its_way(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding | NotEvaluated]:
    """Report returns that climb and then sink all the way to the mission's landing.

    ``RtlDirectMissionLand::setActiveMissionItems`` climbs, then takes the landing; the move to above it is
    left out then (``handleLanding``: only of ``WORK_ITEM_TYPE_DEFAULT``).  Flown with 1.17.
    """
    landing = a.returns.destinations.landing
    found = None if landing is None or len(landing.stages) > 1 else _returns_to_landing(a)
    if landing is None or found is None:
        return
    # What flies at that height may be a little lower.
    climbs = found.begins_m < found.climbs_to_m + parameters.altitude_acceptance_m
    sinks = climbs & (found.way_m > parameters.acceptance_radius_m)
    if not sinks.any():
        return
    cruise_m_s = parameters.cruise_speed_m_s
    speed_m_s = min(landing.speed_m_s or cruise_m_s, cruise_m_s)
    sinking_m = np.maximum(
        found.climbs_to_m - found.lands.height_m, parameters.altitude_acceptance_m
    )
    reach_m = _REACHED * speed_m_s * _sinking_s(sinking_m, parameters)
    # As it sinks at first, all of the way.
    sunk_m = parameters.descent_speed_m_s * found.way_m / (_REACHED * speed_m_s)
    lower_m = np.minimum(sunk_m, sinking_m)
    worst = int(np.where(sinks, found.way_m - reach_m, -np.inf).argmax())
    short_m = float(found.way_m[worst] - reach_m[worst])
    asked, way_m = f"RTL_TYPE {parameters.return_type}", float(found.way_m[worst])
    is_short = short_m > 0.0 and way_m > _NEAR_M
    if is_short:
        comes_down = f"it touches the ground up to {quantity.distance(short_m)} short of it"
    else:
        comes_down = f"up to {quantity.height(float(lower_m[worst]))} lower than predicted"
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"{asked}: a return from here climbs to {quantity.height(float(found.climbs_to_m[worst]))}, then "
        f"sinks while it flies to the mission's landing, {quantity.distance(way_m)} away: {comes_down}",
        item=a.route.stages[int(found.stage[worst])].item,
        severity=Severity.ERROR if is_short else None,
        fix=_PLACE_BEFORE,
    )
    if is_short or a.setup.terrain is None:
        return
    lowest_m = found.climbs_to_m - lower_m
    if not _is_above_ground(a, a.setup.terrain, found, sinks, lowest_m):
        yield NotEvaluated(
            rule=RETURN_BELOW_TERRAIN,
            asked_by=f"{asked}, which sinks on its way to the landing,",
            needs="DO_LAND_START and a waypoint before the landing, or RTL_TYPE 0",
        )


def _is_above_ground(
    a: Assessment, terrain: TerrainGrid, found: _ToLanding, sinks: BoolArray, lowest_m: FloatArray
) -> bool:
    """Return whether returns that sink keep --clearance, all of their ways as low as they end. (n,) [m]"""
    from planner.flight.path import FlightLines

    start_m = np.column_stack((found.begins_at_m, lowest_m))[sinks]
    end_m = start_m.copy()
    end_m[:, :2] = found.lands.east_m, found.lands.north_m
    lines = FlightLines(start_m=start_m, end_m=end_m, owner=np.arange(len(start_m))).cut(STRAIGHT_M)
    clearance = clearance_of(a, terrain, lines, led_m=np.full(len(lines.owner), np.inf))
    least_m, _, _ = clearance.extremes_m()
    return bool((clearance.is_known & (least_m >= clearance.asked_m)).all())


def _sinking_s(height_m: FloatArray, parameters: Px4Parameters) -> FloatArray:
    """Return the times a landing takes from heights over the ground down to it. (n,) [s]"""
    from planner.flight.motion.px4.landing import DescentProfile

    steps = (np.arange(_STEPS) + 0.5) / _STEPS
    speed_m_s = DescentProfile.of(parameters).speed_m_s(height_m[:, None] * steps)
    return np.asarray(height_m * (1.0 / speed_m_s).mean(axis=1))


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _height_chosen_elsewhere(
    a: Assessment, parameters: Px4Parameters
) -> Iterator[Finding | NotEvaluated]:
    """Report returns to the mission's landing at another height than where they begin would choose."""
    found = _returns_to_landing(a)
    if found is None:
        return
    flown_m = np.maximum(found.begins_m, found.climbs_to_m)
    higher_m = flown_m - found.predicted_m
    asked = f"RTL_TYPE {parameters.return_type}"
    for is_higher, row in ((True, int(higher_m.argmax())), (False, int(higher_m.argmin()))):
        off_m = abs(float(higher_m[row]))
        if bool(higher_m[row] > 0.0) is not is_higher or off_m < _WORTH_SAYING_M:
            continue
        # A climb takes no more than twice the power of a hover.
        needed_wh = a.hovered_wh(
            2.0 * off_m / parameters.climb_speed_m_s + off_m / parameters.descent_speed_m_s
        )
        is_short = is_higher and needed_wh > a.left_wh
        yield a.finding(
            SETTING_NOT_FOLLOWED,
            f"{asked}: a return from here to the mission's landing is flown at "
            f"{quantity.height(float(flown_m[row]))}, predicted at "
            f"{quantity.height(float(found.predicted_m[row]))}: PX4 chose the height where that became its "
            "return",
            item=a.route.stages[int(found.stage[row])].item,
            severity=Severity.ERROR if is_short else None,
            fix="set RTL_TYPE to 0",
        )
        if not is_higher and a.setup.terrain is not None:
            yield NotEvaluated(
                rule=RETURN_BELOW_TERRAIN,
                asked_by=f"{asked}, which returns lower than predicted,",
                needs="RTL_TYPE 0",
            )
