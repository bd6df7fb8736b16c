"""Returns and landings that a failsafe or a fence begins while the vehicle lands or returns already."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.flight.failsafe import BY_OWN_TRACK, RETURNS
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import make_pilot
from planner.flight.returns.path import Returns
from planner.mission.route.stage import StageKind
from planner.rules.lateness import late_returns_of
from planner.values import field_names, replace
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.flight.failsafe import FailsafeEvent
    from planner.flight.returns.path import ReturnPoints
    from planner.rules.assessment import Assessment

_GOES_WITHOUT_SAYING_S = 3.0
"""What is later down by less need not be told. [s]"""
_SAME_TRACK_M = 2.0
"""So near to an earlier part of its track SmartRTL leaves out what is between (SRTL_ACCURACY). [m]"""


def held_s(a: Assessment) -> float:
    """Return how long the vehicle holds before it does what a failsafe says: of PX4, COM_FAIL_ACT_T. [s]

    Notes
    -----
    ``FailsafeBase::getSelectedAction``: any action but a hold, and what cuts the motors, is delayed so long
    in Hold, once.  Flown by COM_FLT_TIME_MAX and by the battery alike.
    """
    own = a.own_parameters
    return own.failsafe_hold_s if isinstance(own, Px4Parameters) else 0.0


def later_text(
    a: Assessment, points: ReturnPoints, returns: Returns, *, lands_s: float, by_own_track: bool
) -> str:
    """Return how much later a return from a point of a landing is down than that would be; empty: hardly."""
    flown = returns.flown(points)
    back_s = flown.time_s + late_returns_of(a, flown).in_all_s
    later_s = float((points.time_s + back_s)[0]) + held_s(a) - lands_s
    return _later_text(later_s, up_to="up to " if by_own_track else "")


def landing_later_text(a: Assessment, event: FailsafeEvent) -> str:
    """Return how much later the vehicle is down that a failsafe lands where it lands; empty: hardly.

    It holds first, and waits no longer over home.  Flown, PX4, in a landing: 6.3 s later; in the landing of
    a return: 5.8 s.
    """
    segments = a.flight.motion.segments
    left_s = segments.duration_s[event.segment :].copy()
    left_s[0] *= 1.0 - event.fraction
    hovers = segments.state[event.segment :] == STATE_INDEX[FlightState.HOVER]
    return _later_text(held_s(a) - float(left_s[hovers].sum()))


def _later_text(later_s: float, *, up_to: str = "") -> str:
    if later_s <= _GOES_WITHOUT_SAYING_S:
        return ""
    return f"it lands {up_to}{quantity.duration(later_s)} later than predicted"


def way_back(a: Assessment, event: FailsafeEvent, points: ReturnPoints) -> Returns | None:
    """Return the returns of which a failsafe begins one from a point; ``None``: none that is known."""
    if event.action == RETURNS:
        return _chosen_before(a.returns)
    if event.action in BY_OWN_TRACK.values() and closes_its_track(a, points.place_m[0]):
        return up_its_track(a)
    return None


def _chosen_before(returns: Returns) -> Returns:
    """Return the returns to the mission's landing as high as PX4 chooses before it is there.

    ``RTL::setRtlTypeAndDestination`` keeps the height of where the landing became the return's place, which
    is taken as far away as home is.  Flown with RTL_TYPE 3: from a landing at 22 m up to the 40 m of
    RTL_RETURN_ALT, 50 s later down.
    """
    landing = returns.destinations.landing
    if landing is None or landing.height_chosen_m is not None:
        return returns
    landing = replace(landing, height_chosen_m=(0.0, 0.0, 0.0))
    return _otherwise(returns, destinations=replace(returns.destinations, landing=landing))


def _otherwise(returns: Returns, **changes: object) -> Returns:
    """Return other returns from the same flight: what a sweep remembers of these is not theirs."""
    own = {name: getattr(returns, name) for name in field_names(Returns)}
    return Returns(**(own | changes))


def up_its_track(a: Assessment) -> Returns:
    """Return the returns of SmartRTL over home: up to the top of the climb there, and down.

    Both parts of its track lie on one line there, and the loop may be closed anywhere on it: of 13 flights
    6 were down on the spot, 7 climbed from 2 to 8 m up to the 20 to 60 m of their take-off.
    """
    assert isinstance(a.own_parameters, ArduPilotParameters)
    own = replace(
        a.own_parameters,
        return_altitude_m=_first_climb_m(a),
        return_climb_min_m=0.0,
        return_cone_slope=0.0,
        return_loiter_s=0.0,
    )
    return _otherwise(a.returns, pilot=make_pilot(a.setup, own))


def closes_its_track(a: Assessment, place_m: FloatArray) -> bool:
    """Return whether SmartRTL stays over home from a place: where the take-off led through.

    Notes
    -----
    ``AP_SmartRTL`` closes a loop where two parts of the track meet, in height too; else it leads back through
    all of the flight, to where it was armed.  Flown: event 40 m up in the descent over home, take-off item
    10 m: back along all waypoints, 816 m.
    """
    first = a.route.stages[0]
    is_above_home = math.dist(place_m[:2], (first.east_m, first.north_m)) < _SAME_TRACK_M
    return (
        first.kind is StageKind.TAKEOFF and is_above_home and bool(place_m[2] <= _first_climb_m(a))
    )


def _first_climb_m(a: Assessment) -> float:
    """Return how high the flight climbs over home before it leaves, by whatever items. [m]"""
    first, *later = a.route.stages
    top_m = first.height_m
    for stage in later:
        if math.dist((stage.east_m, stage.north_m), (first.east_m, first.north_m)) > _SAME_TRACK_M:
            break
        top_m = max(top_m, stage.height_m)
    return top_m


def return_short_wh(a: Assessment, points: ReturnPoints, returns: Returns) -> float:
    """Return how far a return from a point lands below the reserve, and below the flight as planned. [Wh]

    A return begun just above the ground may climb as high as any: ``ModeRTL::compute_return_target`` with
    RTL_CONE_SLOPE 0.
    """
    if a.battery is None:
        return 0.0
    flown = returns.flown(points)
    late_wh = a.late_return_wh(flown, late_returns_of(a, flown)) + a.hovered_wh(held_s(a))
    needed_wh = float((points.used_wh + flown.energy_wh + late_wh)[0])
    return max(needed_wh - max(a.battery.above_reserve_wh, a.totals.energy_wh + a.late_wh), 0.0)
