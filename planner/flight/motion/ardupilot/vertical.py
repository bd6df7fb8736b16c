"""What ArduPilot flies straight up and down without an S-curve: take-offs, landings, changes of height.

The vertical position controller shapes its own targets here (``AC_PosControl``, ``AP_Math/control.cpp``):
it accelerates by WP_ACC_Z and slows down along a square root of the way left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import FlightState, hold, make_vertical, quotient
from planner.units import GRAVITY_M_S2

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Manoeuvres
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_VERTICAL_JERK_M_S3 = 5.0
"""PSC_JERK_D (before 4.7 PSC_JERK_Z), its default. [m s⁻³]"""
_HEIGHT_GAIN_PER_S = 1.0
"""PSC_D_POS_P (before 4.7 PSC_POSZ_P), its default. [s⁻¹]"""
BRAKING_SHARE = 0.5
"""``shape_pos_vel_accel`` plans to stop with half the acceleration. [-]"""
_DONE_SPEED_SHARE = 0.1
"""A take-off is complete within the stopping distance of this share of the climb speed. [-]"""
_HEIGHT_REACHED_M = 0.05
"""``loiter_to_alt_run`` is done so near to its height. [m]"""
_LOWEST_SLOW_HEIGHT_M = 1.0
"""``land_run_vertical_control`` takes LAND_ALT_LOW for this at least. [m]"""
_LANDED_S = 1.6
"""From touch-down until landed: motors fall to their lower limit (0.6 s as recorded), stay there for
``LAND_DETECTOR_TRIGGER_SEC`` 1.0. [s]"""
_PLACED_S = 0.5
"""``placed_check_duration_ms``: a load must stand so long before it is let go. [s]"""


def height_gain_per_s(parameters: ArduPilotParameters) -> float:
    """Return the gain k = J/2A with which ``shape_pos_vel_accel`` approaches a height. [s⁻¹]"""
    return 0.5 * _VERTICAL_JERK_M_S3 / parameters.vertical_acceleration_m_s2


def takeoff(
    key: IntArray,
    start_m: FloatArray,
    end_height_m: FloatArray,
    climb_m_s: FloatArray,
    parameters: ArduPilotParameters,
    *,
    from_ground: bool,
) -> Manoeuvres:
    """Return take-offs straight up to heights above home; ``key`` is their place in the flight.

    Notes
    -----
    ``_AutoTakeoff::run``.  On the ground: 2 s after arming, or MOT_SAFE_TIME with MOT_SAFE_DISARM,
    MOT_SPOOL_TIME of spooling up to idle, then the throttle rises by 1/TKOFF_SLEW_TIME until the vehicle
    accelerates by WP_ACC_Z/2, at MOT_THST_HOVER (1 + WP_ACC_Z/2g).  By default it lifts off after 3.24 s.
    """
    none = np.zeros(len(key))
    throttle = parameters.hover_throttle * (
        1.0 + 0.5 * parameters.vertical_acceleration_m_s2 / GRAVITY_M_S2
    )
    idle_s = (parameters.held_back_s + parameters.spool_up_s) * from_ground
    thrust_s = parameters.takeoff_slew_s * min(throttle, 1.0) * from_ground
    low = start_m[:, 2]
    durations, rises, speeds = _climb(end_height_m - low, climb_m_s, parameters)
    return make_vertical(
        key,
        FlightState.TAKEOFF if from_ground else FlightState.CLIMB,
        place_m=start_m,
        height_m=(low, low, *(low + rise for rise in rises)),
        climb_m_s=(none, none, *speeds),
        duration_s=(none + idle_s, none + thrust_s, *durations),
        grounded=(0,),
    )


def _climb(
    rise_m: FloatArray, climb_m_s: FloatArray, parameters: ArduPilotParameters
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """Return durations, rises and speeds of climbs to a height: speed up, climb, slow down.

    The controller aims at v(e) = sqrt(2 b (e − b/2k²)), e the way left, b half the acceleration A and
    k = J/2A, and follows it δ = A b/J faster, for its acceleration answers an error of speed by J/A.
    Hence dv/dt = −b (1 + δ/v) down to v = b/k, and e falls exponentially with k below.  It is over when
    e is the stopping distance from a tenth of the climb speed.
    """
    full = parameters.vertical_acceleration_m_s2
    braking = BRAKING_SHARE * full
    gain = height_gain_per_s(parameters)
    ahead = full * braking / _VERTICAL_JERK_M_S3
    linear = braking / gain
    # V²/2A to speed up, V²/2b + b/2k² to slow down.
    root = np.sqrt(np.maximum(rise_m - 0.5 * linear / gain, 0.0))
    peak = np.minimum(climb_m_s, root * np.sqrt(2.0 / (1.0 / full + 1.0 / braking)))
    gained = 0.5 * peak**2 / full
    left = np.minimum(0.5 * peak**2 / braking + 0.5 * linear / gain, rise_m - gained)
    knee = np.minimum(peak, linear)
    done = 0.5 * (_DONE_SPEED_SHARE * climb_m_s) ** 2 / full
    last = np.minimum(gain * done, knee)
    slow_s = (peak - knee - ahead * np.log((peak + ahead) / (knee + ahead))) / braking
    slow_s += np.log((knee + ahead) / (last + ahead)) / gain
    steady_s = quotient(np.maximum(rise_m - gained - left, 0.0), peak)
    zero = np.zeros_like(peak)
    return (
        (peak / full, steady_s, slow_s),
        (zero, gained, rise_m - left, rise_m),
        (zero, peak, peak, zero),
    )


def landing(
    key: IntArray,
    start_m: FloatArray,
    ground_m: FloatArray,
    parameters: ArduPilotParameters,
    *,
    commanded_m_s: FloatArray | float = np.nan,
    level_m: FloatArray | float,
    wait_s: FloatArray | float = 0.0,
) -> Manoeuvres:
    """Return landings, down to the ground and until disarmed, or until a wait on the ground is over.

    Notes
    -----
    ``Mode::land_run_vertical_control``: down by LAND_SPD_HIGH, else by ``commanded_m_s``, or WP_SPD_DN
    where that is NaN; slower along the square root of the height above LAND_ALT_LOW; never slower than
    LAND_SPD.  That height is above ``level_m``.  Below, on the ground, 1.6 s until the landing is detected
    and MOT_SPOOL_TIM_DN until the motors stand still.
    """
    slow = parameters.land_speed_m_s
    high = np.full(len(key), parameters.land_high_speed_m_s)
    if parameters.land_high_speed_m_s == parameters.descent_speed_m_s:
        high = np.where(np.isnan(commanded_m_s), high, commanded_m_s)
    ground_m = np.minimum(ground_m, start_m[:, 2])  # on higher ground it stands already
    height = start_m[:, 2] - ground_m
    slow_m = level_m + max(parameters.land_slow_height_m, _LOWEST_SLOW_HEIGHT_M)
    above = np.maximum(start_m[:, 2] - slow_m, 0.0)
    approach = _approach(above, np.maximum(high, slow), slow, parameters.vertical_acceleration_m_s2)
    durations, ways, speeds = _until(height, *approach)
    none = np.zeros(len(key))
    rest_s = np.maximum(height - ways[-1], 0.0) / slow
    top = start_m[:, 2]
    return make_vertical(
        key,
        FlightState.LAND,
        place_m=start_m,
        # Touching down takes the speed away in no time.
        height_m=(*(top - way for way in ways), ground_m, ground_m, ground_m),
        climb_m_s=(*(-speed for speed in speeds), -speeds[-1], none, none),
        duration_s=(*durations, rest_s, none, none + _LANDED_S + parameters.spool_down_s + wait_s),
        grounded=(6,),
    )


def landing_level_m(
    ground_m: FloatArray,
    datum_m: FloatArray,
    parameters: ArduPilotParameters,
    *,
    named_m: FloatArray | float = np.nan,
    is_named: BoolArray | bool = False,
) -> FloatArray:
    """Return the heights above home that landings take for that of the ground, at most. (n,) [m]

    ``named_m`` are those of the altitudes of their items, NaN where these do not count, and ``is_named``
    whether they are known to.

    Notes
    -----
    ``Mode::get_alt_above_ground_cm``: the ground, or home (``datum_m``) where there is neither a rangefinder
    nor terrain data ("Assume the Earth is flat"); TERRAIN_ENABLE gives none by itself.
    ``ModeAuto::get_alt_above_ground_cm`` of 4.7: the item, within the reach of no rangefinder.  The longer
    landing counts.
    """
    own_m = ground_m if parameters.rangefinder_type else np.maximum(ground_m, datum_m)
    alone = is_named & ~np.isnan(named_m) & (not parameters.rangefinder_type)
    return np.where(alone, named_m, np.fmax(own_m, named_m))


def landing_speed_m_s(height_m: FloatArray, parameters: ArduPilotParameters) -> FloatArray:
    """Return how fast a landing descends at heights above what it takes for the ground. [m s⁻¹]"""
    slow, a = parameters.land_speed_m_s, parameters.vertical_acceleration_m_s2
    left_m = np.maximum(height_m - max(parameters.land_slow_height_m, _LOWEST_SLOW_HEIGHT_M), 0.0)
    linear_m = a / _HEIGHT_GAIN_PER_S**2
    root = np.sqrt(2.0 * a * np.maximum(left_m - 0.5 * linear_m, 0.0))
    wanted = np.where(left_m < linear_m, _HEIGHT_GAIN_PER_S * left_m, root)
    return np.clip(wanted, slow, max(parameters.land_high_speed_m_s, slow))


def change_of_height(
    key: IntArray,
    start_m: FloatArray,
    end_height_m: FloatArray,
    speed_m_s: FloatArray,
    parameters: ArduPilotParameters,
    *,
    state: FlightState,
) -> Manoeuvres:
    """Return climbs or descents at a rate, within 5 cm, as LOITER_TO_ALT has them."""
    change = end_height_m - start_m[:, 2]
    sign, size = np.sign(change), np.abs(change)
    durations, ways, speeds = _approach(
        size,
        speed_m_s,
        _HEIGHT_GAIN_PER_S * _HEIGHT_REACHED_M,
        parameters.vertical_acceleration_m_s2,
    )
    zero = np.zeros_like(size)
    ways = (*(np.minimum(way, size) for way in ways[:-1]), size)
    return make_vertical(
        key,
        state,
        place_m=start_m,
        height_m=tuple(start_m[:, 2] + sign * way for way in ways),
        climb_m_s=(*(sign * speed for speed in speeds[:-1]), zero),
        duration_s=durations,
    )


def _approach(
    way_m: FloatArray, speed_m_s: FloatArray, last_m_s: float, acceleration_m_s2: float
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """Return durations, ways and speeds towards a height, the speed ending at ``last_m_s``.

    ``sqrt_controller`` with gain k: v = sqrt(2 A (e − A/2k²)) with e left to go, and k e where that is
    below A/k.  Four pieces: speed up by A, go on, slow down by A, slow down exponentially.
    """
    a, k = acceleration_m_s2, _HEIGHT_GAIN_PER_S
    linear = a / k
    # The speed at which speeding up meets the curve: v²/2A + e(v) = way.
    on_root = np.sqrt(a * np.maximum(way_m - 0.5 * linear / k, 0.0))
    on_line = np.sqrt(linear**2 + 2.0 * a * way_m) - linear
    peak = np.minimum(speed_m_s, np.where(on_root >= linear, on_root, on_line))
    peak = np.maximum(peak, last_m_s)
    knee = np.maximum(np.minimum(peak, linear), last_m_s)
    gained = 0.5 * peak**2 / a
    rooted = 0.5 * (peak**2 - knee**2) / a
    lined = (knee - last_m_s) / k
    # e(v) at the peak: what is left when slowing down begins.
    left = rooted + knee / k
    steady = np.maximum(way_m - gained - left, 0.0)
    zero = np.zeros_like(peak)
    last = zero + last_m_s
    return (
        (peak / a, steady / peak, (peak - knee) / a, np.log(knee / last_m_s) / k),
        (zero, gained, gained + steady, gained + steady + rooted, gained + steady + rooted + lined),
        (zero, peak, peak, knee, last),
    )


def _until(
    height_m: FloatArray,
    durations_s: tuple[FloatArray, ...],
    ways_m: tuple[FloatArray, ...],
    speeds_m_s: tuple[FloatArray, ...],
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """Return an approach as far as the ground, so far below where it begins."""
    lasts, ways, speeds = list(durations_s), list(ways_m), list(speeds_m_s)
    for piece in range(len(durations_s)):
        way, entered = ways_m[piece + 1] - ways_m[piece], speeds[piece]
        flown = np.clip(height_m - ways_m[piece], 0.0, way)
        fraction = np.where(flown < way, quotient(flown, way), 1.0)
        begin, end = speeds_m_s[piece], speeds_m_s[piece + 1]
        if piece == len(durations_s) - 1:  # its speed falls with the way, exponentially
            left = begin + fraction * (end - begin)
            taken = np.log(begin / left) / _HEIGHT_GAIN_PER_S
        else:
            left = np.sqrt(begin**2 + fraction * (end**2 - begin**2))
            taken = quotient(2.0 * flown, begin + left)
        is_begun = (flown > 0.0) | (way == 0.0)
        lasts[piece] = np.where(fraction < 1.0, taken, durations_s[piece])
        ways[piece + 1] = np.minimum(ways_m[piece + 1], height_m)
        speeds[piece + 1] = np.where(is_begun, left, entered)
    return tuple(lasts), tuple(ways), tuple(speeds)


def set_down(
    key: IntArray,
    start_m: FloatArray,
    down_m: FloatArray,
    climb_m_s: FloatArray,
    parameters: ArduPilotParameters,
    *,
    is_placed: BoolArray,
) -> tuple[Manoeuvres, Manoeuvres, Manoeuvres]:
    """Return how loads are set down on the ground, so far below: descents, waits, climbs back.

    One that is not placed is carried back up at once, where its vehicle gives up.

    ``key`` is the place of the descents in the flight; waits and climbs follow.

    Notes
    -----
    ``PayloadPlace::run``: down by PLDP_SPEED_DN or LAND_SPD, at most WP_SPD_DN, until the load stands
    for 0.5 s; PLDP_DELAY; then back up.
    """
    down = min(parameters.place_descent_speed_m_s, parameters.descent_speed_m_s)
    a = parameters.vertical_acceleration_m_s2
    high, zero, down_m = start_m[:, 2], np.zeros(len(key)), np.maximum(down_m, 0.0)
    gained = np.minimum(0.5 * down**2 / a, down_m)
    fast = np.sqrt(2.0 * a * gained)
    descent = make_vertical(
        key,
        FlightState.DESCEND,
        place_m=start_m,
        height_m=(high, high - gained, high - down_m),
        climb_m_s=(zero, -fast, -fast),
        duration_s=(fast / a, (down_m - gained) / down),
    )
    low = np.column_stack((start_m[:, :2], high - down_m))
    placed_s = np.where(is_placed, _PLACED_S + parameters.place_delay_s, 0.0)
    wait = hold(key + 1, FlightState.HOVER, place_m=low, duration_s=placed_s)
    return descent, wait, takeoff(key + 2, low, high, climb_m_s, parameters, from_ground=False)
