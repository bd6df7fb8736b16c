"""Battery failsafes as the autopilot on board decides them, replayed along a predicted flight."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.flight.returns.destination import ALONG, LANDING
from planner.units import wh_from_j
from planner.values import Value
from planner.vehicle.pack import ASSUMED_CHEMISTRY, LIPO_CELL_V, is_of_another_kind, rest_curve
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.reader import load_chemistry

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray
    from planner.flight.budget import Discharge
    from planner.flight.returns.path import Returns
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

_SECONDS_PER_HOUR = 3600.0
_MEAN_CURRENT_S = 50.0
"""Time constant of PX4's mean current (``lib/battery/battery.cpp``). [s]"""
_ESTIMATE_STEP_S = 2.0
"""PX4 estimates the time of a return this often. [s]"""
_MOST_ESTIMATES = 20_000
_COUNTS_ITSELF = 1
"""BAT1_SOURCE: an external battery, which reports its own charge (``module.yaml`` of lib/battery)."""
_OVER_VOLTAGE = 1.05
"""Of BAT1_V_CHARGED a cell: above it PX4 takes the battery for faulty (``Battery::determineFaults``). [-]"""
WARNS, RETURNS, LANDS = "warns", "returns", "lands where it is"
TO_LANDING = "flies to the mission's landing"
STOPS_FLYING = {5: "cuts its motors", 7: "brakes, or lands"}
"""What ArduPilot does that ends a landing in the air."""
BY_OWN_TRACK = {3: "returns by its own track", 4: "returns by its own track, or lands"}
"""What it does that leads back through all of the flight (SmartRTL)."""
_PX4_TIME_ACTIONS = {1: WARNS, 3: RETURNS}
"""COM_FLTT_LOW_ACT (PX4, ``commander_params.c``: 0 none, 1 warning, 3 return)."""
_ARDUPILOT_ACTIONS = {0: WARNS, 1: LANDS, 2: RETURNS, **BY_OWN_TRACK, 6: TO_LANDING, **STOPS_FLYING}
"""BATT_FS_LOW_ACT and BATT_FS_CRT_ACT (``AP_BattMonitor_Params.cpp``, values of Copter)."""
_WITHOUT_SMART_RETURN = {BY_OWN_TRACK[3]: RETURNS, BY_OWN_TRACK[4]: LANDS}
"""What these do where SRTL_POINTS 0 switches SmartRTL off (``Copter::set_mode_SmartRTL_or_RTL``)."""

_ARDUPILOT_PRIORITIES = {action: rank for rank, action in enumerate((5, 1, 2, 4, 3, 0))}
"""Ranks of these, the highest first; what is not among them comes last (``Copter.h``)."""
_LOW = "LOW"


class FailsafeEvent(Value):
    """One decision of the autopilot on board."""

    parameter: str
    """What sets its threshold."""
    action: str
    """What the vehicle does: ``returns``, ``lands where it is``, ``warns`` …"""
    reading: str
    """What it sees, and the threshold: ``7 % of the charge is left, BAT_CRIT_THR is 7 %``."""
    segment: int
    fraction: float
    """Of the time of the segment that has passed. [-]"""


class BatteryProfile(Value, eq=False):
    """The battery along a flight, at its start and at the end of each of s segments."""

    time_s: FloatArray
    """(s + 1,)"""
    used_ah: FloatArray | None
    """Charge taken since the start; ``None`` where only energies are known. (s + 1,) [Ah]"""
    fraction: FloatArray
    """Of the full charge that is left. (s + 1,) [-]"""
    rest_v: FloatArray | None
    """Open-circuit voltage as a voltmeter sees it; ``None``: the curve is not known. (s + 1,) [V]"""
    loaded_v: FloatArray | None
    """Under load; ``None`` where the resistance is not known. (s + 1,) [V]"""
    resistance_ohm: float
    """That the drop under load comes of; 0 where it is not known. [Ω]"""
    is_curve_assumed: bool
    """Whether the voltages are those of a kind of cell, not of this battery."""
    later_s: FloatArray
    """How much later than predicted the vehicle is there. (s + 1,) [s]"""
    times: float = 1.0
    """What the flight takes over what is predicted. [-]"""


def battery_profile(
    returns: Returns,
    battery: Battery,
    discharge: Discharge | None,
    *,
    charge: float,
    times: float = 1.0,
    less: float = 0.0,
    later_s: FloatArray | None = None,
) -> BatteryProfile:
    """Return the battery along a flight: by its curve where that is known, else by its energy.

    Predicted from a charge; ``times`` is what the flight takes over what is predicted, from so much ``less``.
    [-]  What segments take longer, ``later_s``, takes the power of a hover. (s,) [s]
    """
    rest_v = loaded_v = None
    resistance_ohm = 0.0
    if discharge is None:
        predicted = charge - returns.used_wh / battery.energy_wh
    else:
        predicted = np.concatenate(([charge], discharge.state_of_charge))
    late_s = np.zeros(len(predicted))
    if later_s is not None and later_s.any():
        late_s[1:] = np.cumsum(later_s)
    late_wh = wh_from_j(returns.flight.hover_near_home_w * late_s)
    fraction = charge - less - times * (charge - predicted + late_wh / battery.energy_wh)
    curve = rest_curve(battery)
    if curve is not None:
        rest_v = np.interp(fraction, curve.state_of_charge, curve.voltage_v)
        if discharge is not None and battery.ocv_soc is not None and battery.ocv_v is not None:
            of_label_v = np.interp(predicted, battery.ocv_soc, battery.ocv_v)
            loaded_v = rest_v.copy()
            loaded_v[1:] += times * (discharge.voltage_v - of_label_v[1:])  # so much more current
            resistance_ohm = float(np.max(discharge.packs.circuits[discharge.pack].resistance_ohm))
    full_ah = battery.charge_ah
    return BatteryProfile(
        time_s=np.append(returns.start_s, returns.flight.time_s),
        used_ah=None if full_ah is None else (fraction[0] - fraction) * full_ah,
        fraction=fraction,
        rest_v=rest_v,
        loaded_v=loaded_v,
        resistance_ohm=resistance_ohm,
        is_curve_assumed=curve is not None and curve.is_assumed,
        later_s=late_s,
        times=times,
    )


def px4_events(
    returns: Returns,
    profile: BatteryProfile,
    battery: Battery,
    parameters: Px4Parameters,
    *,
    longer: float = 1.0,
) -> Iterator[FailsafeEvent]:
    """Yield what PX4 decides along a flight, in no order; ``longer`` is its time over that predicted. [-]

    ``battery.cpp``: the charge is the lesser of what the count leaves, if BAT1_CAPACITY is set, and what
    the voltage says between BAT1_V_EMPTY and BAT1_V_CHARGED; one that neither knows is taken as it is.
    ``failsafe.cpp``: low warns; critical and emergency do as COM_LOW_BAT_ACT says.
    """
    if parameters.flight_time_max_s > 0.0:
        flown_s = longer * (profile.time_s + profile.later_s)
        found = _first_below(-flown_s, -parameters.flight_time_max_s)
        if found is not None:
            limit = quantity.duration(parameters.flight_time_max_s)
            reading = f"COM_FLT_TIME_MAX ends a flight after {limit}"
            yield _event("COM_FLT_TIME_MAX", RETURNS, reading, found)
    if parameters.measures_battery:
        yield from px4_charge_events(px4_charge(profile, battery, parameters), parameters)
        yield from px4_time_events(returns, profile, battery, parameters)


PX4_BATTERY_ACTIONS = {1: (RETURNS, RETURNS), 2: (LANDS, LANDS), 3: (RETURNS, LANDS)}
"""What PX4 does at a critical and at an emergency charge by COM_LOW_BAT_ACT, where it does more than warn
(``fromBatteryWarningActParam``; 1 is in no list any more, and does so all the same)."""


def px4_charge_events(seen: FloatArray, parameters: Px4Parameters) -> Iterator[FailsafeEvent]:
    """Yield what PX4 decides by the fraction of the charge that it sees. (s + 1,) [-]"""
    critical, emergency = PX4_BATTERY_ACTIONS.get(parameters.battery_action, (WARNS, WARNS))
    for name, threshold, action in (
        ("BAT_LOW_THR", parameters.battery_low_fraction, WARNS),
        ("BAT_CRIT_THR", parameters.battery_critical_fraction, critical),
        ("BAT_EMERGEN_THR", parameters.battery_emergency_fraction, emergency),
    ):
        found = _first_below(seen, threshold)
        if found is not None:
            percent = quantity.percent(threshold)
            reading = f"{percent} of the charge is left as PX4 counts it, {name} is {percent}"
            yield _event(name, action, reading, found)


def px4_charge(profile: BatteryProfile, battery: Battery, parameters: Px4Parameters) -> FloatArray:
    """Return the fraction of the charge that PX4 sees. (s + 1,) [-]"""
    seen = profile.fraction
    if parameters.battery_capacity_ah > 0.0 and profile.used_ah is not None:
        seen = profile.fraction[0] - profile.used_ah / parameters.battery_capacity_ah
    cells = parameters.battery_cells or battery.cells_in_series
    if profile.rest_v is None or profile.loaded_v is None or profile.is_curve_assumed or not cells:
        return seen  # a curve that is assumed says little of what PX4 sees
    return np.minimum(
        seen, _by_voltage(_uncovered_v(profile, cells, parameters) / cells, parameters)
    )


def px4_charge_assumed(
    profile: BatteryProfile, battery: Battery, parameters: Px4Parameters
) -> FloatArray | None:
    """Return the charge PX4 sees by a voltage that has to be assumed, if any has. (s + 1,) [-]"""
    voltage_v = px4_voltage_assumed(profile, battery, parameters)
    if voltage_v is None:
        return None
    cells = parameters.battery_cells or battery.cells_in_series
    assert cells  # else no voltage is assumed
    return np.minimum(profile.fraction, _by_voltage(voltage_v / cells, parameters))


def px4_voltage_assumed(
    profile: BatteryProfile, battery: Battery, parameters: Px4Parameters
) -> FloatArray | None:
    """Return the open-circuit voltage of a battery whose curve or resistance has to be assumed. (s + 1,) [V]

    That is the curve of its kind of cell, not scaled to what its label says, or a curve of its own; ``None``
    where nothing has to be assumed, or PX4 does not go by the voltage: it does not know the cells, or the
    battery counts itself.
    """
    cells = parameters.battery_cells or battery.cells_in_series
    is_known = profile.rest_v is not None and profile.loaded_v is not None
    is_known = is_known and not profile.is_curve_assumed
    if is_known or not cells or parameters.battery_source == _COUNTS_ITSELF:
        return None
    if profile.rest_v is not None:
        return _uncovered_v(profile, cells, parameters)
    if is_of_another_kind(battery):
        return np.full_like(
            profile.fraction, battery.voltage_v
        )  # as flat as the curve of such cells
    kind = load_chemistry(battery.chemistry or ASSUMED_CHEMISTRY)
    own = battery.cells_in_series or (battery.voltage_v or LIPO_CELL_V * cells) / LIPO_CELL_V
    return np.interp(profile.fraction, kind.ocv_soc, kind.cell_ocv_v) * own


def _uncovered_v(profile: BatteryProfile, cells: int, parameters: Px4Parameters) -> FloatArray:
    """Return the open-circuit voltage as PX4 works it out from the one under load. (s + 1,) [V]

    ``Battery::calculateStateOfChargeVoltageBased`` adds the drop over BAT1_R_INTERNAL, of a cell, where that
    is not negative; else it estimates the resistance, and is taken to find it.
    """
    assert profile.rest_v is not None
    own_ohm = parameters.battery_cell_resistance_ohm
    if own_ohm < 0.0 or profile.loaded_v is None or not profile.resistance_ohm:
        return profile.rest_v
    current_a = (profile.rest_v - profile.loaded_v) / profile.resistance_ohm
    return profile.loaded_v + own_ohm * cells * current_a


def px4_highest_v(parameters: Px4Parameters) -> float:
    """Return the voltage above which PX4 takes a battery for faulty, where it counts cells. [V]"""
    if not parameters.battery_cells or parameters.battery_source == _COUNTS_ITSELF:
        return math.inf
    return _OVER_VOLTAGE * parameters.battery_cells * parameters.battery_full_cell_v


def _by_voltage(cell_v: FloatArray, parameters: Px4Parameters) -> FloatArray:
    """Return the charge that the open-circuit voltage of a cell means to PX4: its ``interpolate``. [-]"""
    empty_v, full_v = parameters.battery_empty_cell_v, parameters.battery_full_cell_v
    if full_v <= empty_v:
        return np.where(cell_v <= empty_v, 0.0, 1.0)
    return np.clip((cell_v - empty_v) / (full_v - empty_v), 0.0, 1.0)


def px4_time_events(
    returns: Returns, profile: BatteryProfile, battery: Battery, parameters: Px4Parameters
) -> Iterator[FailsafeEvent]:
    """Yield the return that PX4 begins because the charge it measures will not last for it."""
    action = _PX4_TIME_ACTIONS.get(parameters.return_time_action)
    voltage_v: FloatArray | float | None = battery.voltage_v
    if action is None or parameters.battery_capacity_ah <= 0.0 or voltage_v is None:
        return
    flight = returns.flight
    step_s = max(_ESTIMATE_STEP_S, flight.time_s / _MOST_ESTIMATES)
    time_s = np.arange(0.0, flight.time_s, step_s)
    if profile.loaded_v is not None:
        voltage_v = np.interp(time_s, profile.time_s, profile.loaded_v)
    current_a = profile.times * flight.power_w(time_s) / voltage_v
    left_s = (
        np.interp(time_s, profile.time_s, px4_charge(profile, battery, parameters))
        * parameters.battery_capacity_ah
        * _SECONDS_PER_HOUR
        / _mean_current_a(current_a, step_s, parameters.battery_mean_current_a)
    )
    needed_s = px4_safe_return_s(returns, time_s, parameters)
    short = np.flatnonzero(needed_s >= left_s)
    if not len(short):
        return
    at = int(short[0])
    segment = int(np.searchsorted(returns.start_s, time_s[at], side="right")) - 1
    duration_s = float(flight.motion.segments.duration_s[segment])
    fraction = float(time_s[at] - returns.start_s[segment]) / max(duration_s, 1e-9)
    left, needed = (quantity.duration(float(one[at])) for one in (left_s, needed_s))
    reading = (
        f"{left} of charge by PX4's own estimate, {needed} to return, RTL_TIME_FACTOR and "
        "RTL_TIME_MARGIN counted in"
    )
    yield _event("COM_FLTT_LOW_ACT", action, reading, (segment, min(fraction, 1.0)))


def px4_safe_return_s(
    returns: Returns, time_s: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the time PX4 itself estimates for a return at times of a flight. (n,) [s]

    ``RtlTimeEstimator`` of a multicopter: up at MPC_Z_V_AUTO_UP, home at MPC_XY_CRUISE, down at
    MPC_Z_V_AUTO_DN, RTL_LAND_DELAY; no wind, no acceleration, no slow landing; times RTL_TIME_FACTOR,
    plus RTL_TIME_MARGIN.
    """
    segment = np.searchsorted(returns.start_s, time_s, side="right") - 1
    state = returns.flight.motion.state_at_time(time_s)
    place_m = state.place_m
    stage = returns.segment_stage[segment]
    destination = returns.destinations.chosen(place_m, stage)
    targets = returns.destinations.targets(stage, destination, place_m)
    height_m = returns.pilot.return_heights_m(place_m, targets)
    way = targets.ground_m - place_m
    return_s = (
        (height_m - place_m[:, 2]) / parameters.climb_speed_m_s
        + np.hypot(way[:, 0], way[:, 1]) / parameters.cruise_speed_m_s
        + (height_m - targets.ground_m[:, 2]) / parameters.descent_speed_m_s
        + max(parameters.return_land_delay_s, 0.0)
    )
    safe_s = parameters.return_time_factor * return_s + parameters.return_time_margin_s
    # Of returns that follow items of the mission PX4 estimates no time (``calc_rtl_time_estimate``).
    return np.where((destination == LANDING) | (destination == ALONG), 0.0, safe_s)


def _mean_current_a(current_a: FloatArray, step_s: float, start_a: float) -> FloatArray:
    """Return the exponential mean of a current from a value on. (n,) [A]"""
    gain = 1.0 - np.exp(-step_s / _MEAN_CURRENT_S)
    mean_a = np.empty(len(current_a))
    level = start_a
    for index, current in enumerate(current_a.tolist()):
        level += gain * (current - level)
        mean_a[index] = level
    return mean_a


def ardupilot_events(
    profile: BatteryProfile,
    parameters: ArduPilotParameters,
    *,
    has_landing: bool,
    monitor: str = "BATT",
) -> Iterator[FailsafeEvent]:
    """Yield what ArduPilot decides along a flight by one of its monitors, in no order.

    Where the mission has no landing that it finds, it returns instead of flying there.
    What is low does nothing behind what was critical, and that acts behind what was low only with as high a
    priority, also where the first only warned or came too late (``AP_BattMonitor::check_failsafes``; flown:
    a brake never did).
    """
    seen = list(_ardupilot_events(profile, parameters, monitor, has_landing=has_landing))
    low, critical = (
        [(event.segment, event.fraction) for which, event in seen if (which == _LOW) is is_low]
        for is_low in (True, False)
    )
    ranks = [
        _ARDUPILOT_PRIORITIES.get(action, len(_ARDUPILOT_PRIORITIES))
        for action in (parameters.battery_low_action, parameters.battery_critical_action)
    ]
    for which, event in seen:
        at = event.segment, event.fraction
        if which == _LOW:
            acts = all(at < one for one in critical)  # of both at once the critical one counts
        else:
            acts = ranks[1] <= ranks[0] or all(at <= one for one in low)
        if acts:
            yield event


def _ardupilot_events(
    profile: BatteryProfile, parameters: ArduPilotParameters, monitor: str, *, has_landing: bool
) -> Iterator[tuple[str, FailsafeEvent]]:
    """Yield what ArduPilot sees, with the name of the threshold.

    ``AP_BattMonitor_Backend::update_failsafes``: what BATT_CAPACITY leaves is counted from full when
    the vehicle is switched on, whatever the charge; a voltage must be low for BATT_LOW_TIMER.
    """
    if not parameters.measures_battery:
        return
    at_rest = parameters.battery_voltage_source == 1
    voltage_v = profile.rest_v if at_rest else profile.loaded_v
    own, hold_s = parameters, parameters.battery_low_timer_s
    kind = "at rest" if at_rest else "under load"
    for which, charge_ah, low_v, action in _ardupilot_thresholds(parameters):
        does = _ARDUPILOT_ACTIONS.get(action, WARNS)
        if not parameters.smart_return_points:
            does = _WITHOUT_SMART_RETURN.get(does, does)
        if does == TO_LANDING and not has_landing:
            does = RETURNS
        if charge_ah > 0.0 and profile.used_ah is not None:
            found = _first_below(own.battery_capacity_ah - profile.used_ah, charge_ah)
            if found is not None:
                name, limit = f"{monitor}_{which}_MAH", quantity.charge_of_ah(charge_ah)
                reading = f"{limit} of {monitor}_CAPACITY are left, {name} is {limit}"
                yield which, _event(name, does, reading, found)
        if low_v > 0.0 and hold_s > 0.0 and voltage_v is not None:
            found = _first_below_for(profile.time_s, voltage_v, low_v, hold_s)
            if found is not None:
                name, volts = f"{monitor}_{which}_VOLT", quantity.decimals(low_v, 1)
                reading = f"below {volts} V {kind} for {quantity.duration(hold_s)}: {name}"
                yield which, _event(name, does, reading, found)


def own_landing(parameters: FlightParameters | None) -> tuple[str, float | None]:
    """Return which battery failsafe brings a hovering vehicle down, and the charge it leaves.

    Returns
    -------
    name : str
        The parameter with its value; empty where no failsafe acts.
    fraction : float or None
        Of the full charge that is left then; ``None`` where only a voltage decides. [-]
    """
    if parameters is None or not parameters.measures_battery:
        return "", 0.0
    if isinstance(parameters, Px4Parameters):
        lands = {LANDS} if parameters.return_land_delay_s < 0.0 else {LANDS, RETURNS}
        for name, threshold, action in zip(
            ("BAT_CRIT_THR", "BAT_EMERGEN_THR"),
            (parameters.battery_critical_fraction, parameters.battery_emergency_fraction),
            PX4_BATTERY_ACTIONS.get(parameters.battery_action, (WARNS, WARNS)),
            strict=True,
        ):
            if action in lands:
                return f"{name} ({quantity.percent(threshold)})", threshold
        return "", 0.0
    # Termination (5) falls, a brake (7) hovers; returns land unless RTL_ALT_FINAL ends them in the air.
    landing = {1} if parameters.return_final_altitude_m > 0.0 else {1, 2, 3, 4, 6}
    watched = []
    for which, charge_ah, low_v, does in _ardupilot_thresholds(parameters):
        if does not in landing:
            continue
        if charge_ah > 0.0 and parameters.battery_capacity_ah > 0.0:
            of_charge = f"BATT_{which}_MAH ({quantity.charge_of_ah(charge_ah)})"
            return of_charge, charge_ah / parameters.battery_capacity_ah
        if low_v > 0.0 and parameters.battery_low_timer_s > 0.0:
            watched.append(f"BATT_{which}_VOLT ({quantity.decimals(low_v, 1)} V)")
    return (watched[0], None) if watched else ("", 0.0)


def _ardupilot_thresholds(
    parameters: ArduPilotParameters,
) -> tuple[tuple[str, float, float, int], ...]:
    """Return name, charge left, voltage and action of ArduPilot's two thresholds. [Ah], [V]

    A charge counts only where the current is measured (``check_failsafe_types``): else it is 0.
    """
    own, counts = parameters, float(parameters.measures_current)
    low_ah, critical_ah = counts * own.battery_low_ah, counts * own.battery_critical_ah
    return (
        ("LOW", low_ah, own.battery_low_v, own.battery_low_action),
        ("CRT", critical_ah, own.battery_critical_v, own.battery_critical_action),
    )


def _event(parameter: str, action: str, reading: str, found: tuple[int, float]) -> FailsafeEvent:
    """Return the decision at a segment and a fraction of it."""
    segment, fraction = found
    return FailsafeEvent(
        parameter=parameter, action=action, reading=reading, segment=segment, fraction=fraction
    )


def _first_below(values: FloatArray, threshold: float) -> tuple[int, float] | None:
    """Return segment and fraction of its time at which values first are below a threshold.

    ``values`` are those at the start and at the end of each segment, straight in between.
    """
    below = np.flatnonzero(values < threshold)
    if not len(below):
        return None
    at = int(below[0])
    if at == 0:
        return 0, 0.0
    before, after = float(values[at - 1]), float(values[at])
    return at - 1, (before - threshold) / (before - after)


def _first_below_for(
    time_s: FloatArray, values: FloatArray, threshold: float, hold_s: float
) -> tuple[int, float] | None:
    """Return where values have been below a threshold for a time without a break."""
    if values.min() >= threshold:
        return None
    since: float | None = None
    for segment, ((before, after), (begin_s, end_s)) in enumerate(
        zip(pairwise(values.tolist()), pairwise(time_s.tolist()), strict=True)
    ):
        crossed_s = end_s
        if (before >= threshold) != (after >= threshold):
            crossed_s = begin_s + (threshold - before) / (after - before) * (end_s - begin_s)
        if since is None and min(before, after) < threshold:
            since = begin_s if before < threshold else crossed_s
        if since is not None:
            until_s = crossed_s if after >= threshold else end_s
            if until_s - since >= hold_s:
                fraction = (since + hold_s - begin_s) / max(end_s - begin_s, 1e-9)
                return segment, min(max(fraction, 0.0), 1.0)
            if after >= threshold:
                since = None
    return None
