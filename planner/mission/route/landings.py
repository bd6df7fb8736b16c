"""Returns and landings, and the height of the ground they go by."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import RELATIVE_FRAMES, TERRAIN_FRAMES, Command
from planner.mission.route.position import is_amsl
from planner.mission.route.stage import Stage, StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.mission.takers import NAME_IT
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import MissionItem
    from planner.mission.route.state import MissionState

_SAME_HOME_M = 0.5
"""So near, and as high, a home is the one before. [m]"""


def land(state: MissionState, item: MissionItem) -> None:
    """Land at a place: the flight is over."""
    state.remark_gate("how PX4 lands behind a CONDITION_GATE")
    state.move_to(item)
    state.height_m = state.ground_m()
    is_here = not item.names_place
    slowed_m_s = lands_at_m_s(state, StageKind.LAND, is_here=is_here)
    stage = state.stage(
        StageKind.LAND,
        yaw_deg=item.param4,
        is_here=is_here,
        datum_m=state.datum_m,
        named_ground_m=named_ground_m(state, item),
        lands_by_name=_lands_by_name(state, item),
    )
    state.add(replace(stage, lands_at_m_s=slowed_m_s))
    _remark_named_ground(state, state.stages[-1])
    state.is_over = True


def _remark_named_ground(state: MissionState, landing: Stage) -> None:
    """Tell that a landing is slow from far above the ground."""
    named_m = landing.named_ground_m
    if named_m is None:
        return
    above_m = named_m - max(landing.height_m, landing.datum_m)
    if above_m <= 0.0:
        return
    by, older = ("", "") if landing.lands_by_name else (" from 4.7 on", "; the longer counts")
    height = quantity.height(above_m)
    state.remark(
        ITEM_NOT_MODELLED,
        f"a landing with an altitude {height} above the ground: ArduCopter{by} takes it for that of the "
        f"ground and is slow from 10 m (LAND_ALT_LOW) above it{older}",
        severity=Severity.INFO,
    )


def named_ground_m(state: MissionState, item: MissionItem) -> float | None:
    """Return the height of the ground of a landing by the altitude of its item; ``None``: none counts.

    Notes
    -----
    ``ModeAuto::get_alt_above_ground_cm`` of ArduCopter from 4.7 on (ArduPilot #30195): without a
    rangefinder a landing at a place goes by its height above that item, in its own frame.  Before by that
    above the terrain, or above home, as a return and a load set down (``PayloadPlace``) do still.
    """
    by_altitude = state.habits.lands_by_altitude is not False
    if state.dialect is Autopilot.PX4 or not by_altitude or not item.names_place:
        return None
    if item.altitude_m is None:
        return None
    if item.frame in TERRAIN_FRAMES:
        ground_m = state.known_ground_m()
        return item.altitude_m + (state.datum_m if ground_m is None else ground_m)
    if not is_amsl(item.frame, state.dialect):
        return item.altitude_m + state.datum_m
    if state.number not in state.amsl_items:
        state.amsl_items.append(state.number)
    return item.altitude_m - (state.home_amsl_m or 0.0)


def _lands_by_name(state: MissionState, item: MissionItem) -> bool:
    """Return whether a landing is known to go by its altitude: above terrain only with its data."""
    return state.habits.lands_by_altitude is True and item.frame not in TERRAIN_FRAMES


def lands_at_m_s(state: MissionState, kind: StageKind, *, is_here: bool = False) -> float | None:
    """Return the descent speed commanded during a return, or a landing where the vehicle is.

    A landing elsewhere starts from the parameters again when it gets there (``ModeAuto::land_start``).
    """
    lands = kind is StageKind.RETURN or (kind is StageKind.LAND and is_here)
    return state.descent_speed_m_s if lands and state.is_descent_late else None


def return_home(state: MissionState, _item: MissionItem) -> None:
    """Return and land: the flight is over."""
    state.latitude_deg, state.longitude_deg = state.home_deg
    state.height_m = state.home_ground_m()
    above_m = state.datum_m - state.height_m
    state.add(replace(returning(state), above_ground_m=above_m, datum_m=state.datum_m))
    _remark_late_return(state)
    state.is_over = True


def _remark_late_return(state: MissionState) -> None:
    """Tell what the queue changes of a return on ArduPilot alone, where it is not known who flies."""
    is_late = state.is_speed_late or state.is_climb_late or state.is_descent_late
    leads_elsewhere = any(
        one.command is Command.DO_SET_HOME and not one.conditions and _is_elsewhere(state, item)
        for one, item in state.waiting
    )
    is_open = state.dialect is not Autopilot.PX4 and not state.flies_as_ardupilot
    if is_open and (is_late or leads_elsewhere):
        does = "leads to the home before" if leads_elsewhere else "is flown at their speeds"
        state.remark(
            ITEM_NOT_MODELLED,
            "ArduPilot carries out all DO_ items before a return but the first when it has begun: it "
            f"{does}, as predicted, with PX4 not so; {NAME_IT}",
            severity=Severity.ERROR if leads_elsewhere else None,
        )


def _is_elsewhere(state: MissionState, item: MissionItem) -> bool:
    """Return whether a DO_SET_HOME names another place, or height, than that of the present home."""
    if item.sets_home_here:
        return True
    there = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
    up_m = item.altitude_m or 0.0
    if item.altitude_m is not None and item.frame not in RELATIVE_FRAMES:
        up_m -= state.datum_m + (state.home_amsl_m or 0.0)
    return float(distance_m(*state.home_deg, *there)) > _SAME_HOME_M or abs(up_m) > _SAME_HOME_M


def returning(state: MissionState) -> Stage:
    """Return a return at the speeds set in the vehicle, or those the mission commands later.

    It starts from the parameters again (``ModeRTL::init``).
    """
    return replace(
        state.stage(StageKind.RETURN),
        speed_m_s=state.speed_m_s if state.is_speed_late else None,
        climb_speed_m_s=state.climb_speed_m_s if state.is_climb_late else None,
        descent_speed_m_s=None,
        lands_at_m_s=lands_at_m_s(state, StageKind.RETURN),
    )


def set_down(state: MissionState, item: MissionItem) -> None:
    """Lower a load to the ground."""
    state.move_to(item)
    above_m = state.height_m - state.ground_m()
    deepest_m = max(item.param1 or 0.0, 0.0)
    stage = state.stage(StageKind.SET_DOWN, above_ground_m=above_m)
    state.add(replace(stage, gives_up_m=deepest_m))
    known = state.known_ground_m() is not None
    level = "" if known else "touch the ground at home's level and to "
    message = f"NAV_PAYLOAD_PLACE: the load is assumed to {level}weigh nothing"
    state.remark(ITEM_NOT_MODELLED, message)
