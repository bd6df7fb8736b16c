"""Rules on what the vehicle decides itself: its failsafes by battery and time."""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.budget import MOST_CHANCE_EMPTY, battery_temperature_c
from planner.flight.failsafe import (
    BY_OWN_TRACK,
    LANDS,
    RETURNS,
    STOPS_FLYING,
    TO_LANDING,
    WARNS,
    ardupilot_events,
    battery_profile,
    px4_charge,
    px4_charge_assumed,
    px4_charge_events,
    px4_events,
    px4_highest_v,
    px4_time_events,
    px4_voltage_assumed,
)
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import is_of_ardupilot
from planner.mission.commands import LANDINGS, TAKEOFFS, Command
from planner.mission.route.stage import LANDED_STAGES, RETURN_STAGES, StageKind
from planner.physics.battery import loaded_voltage_v
from planner.quantity import sd_of
from planner.rules.assessment import numbers
from planner.rules.battery import BATTERY_ASSUMED
from planner.rules.battery_arming import ARMING_REFUSED, least_to_arm, profile_of
from planner.rules.declaration import PACK, PARAMETERS, NotEvaluated, judges
from planner.rules.energy import ASSUMED_ERROR, chance_beyond, deviations_beyond, place_along
from planner.rules.lateness import late_returns_of
from planner.rules.returns_anew import (
    held_s,
    landing_later_text,
    later_text,
    return_short_wh,
    way_back,
)
from planner.units import j_from_wh, wh_from_j
from planner.values import replace
from planner.vehicle.pack import high_resistance_ohm, rest_curve
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.flight.failsafe import BatteryProfile, FailsafeEvent
    from planner.flight.returns.path import ReturnPoints
    from planner.mission.items import Mission
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

_REFUSES = -1
"""Stands for what arming does: a refusal is no warning."""
_VOLTAGE_NEEDED = (
    "the battery's open-circuit voltage and resistance, in the vehicle model: PX4 estimates the charge by "
    "voltage"
)
_ENDS = {*RETURN_STAGES, StageKind.LAND}
"""What the vehicle does as it comes down, or flies there."""
_LANDS_ON = 8
"""Bit of FS_OPTIONS: a landing continues (``FailsafeOption::CONTINUE_IF_LANDING``)."""
_ENDS_FLYING = frozenset({LANDS, *STOPS_FLYING.values()})
_SDS_BELOW_UPPER = 1.2816
"""Standard deviations from the mean to what one flight of ten exceeds. [-]"""
_NO_DEVIATION = 1e-12
_SAME_PLACE_M = 5.0
"""Returns that lead no farther from where the vehicle lands end there. [m]"""
_ON_GROUND_M = 0.1
_OVER_M = 1.0
"""So near beside it a landing is at the place, as positions are known. [m]"""
_FLIGHTS = 12
"""Flights looked at between the one of a hundred that takes most and the predicted one."""
_LANDING_SEQUENCE = (Command.DO_LAND_START, *LANDINGS, *TAKEOFFS)
_GOES_DOWN = (STATE_INDEX[FlightState.LAND], STATE_INDEX[FlightState.DESCEND])


FAILSAFE_BEFORE_END = Rule(
    "E103 onboard-failsafe-before-end",
    Severity.ERROR,
    summary="The vehicle's own battery failsafe would end the mission early.",
    why="A failsafe is decided on board, by thresholds no ground station compares with the plan: "
    "returns that come far too early are reported again and again (PX4 #17007: at 32 % while set to 15 "
    "%), and one set to land sets the vehicle down wherever it is (ArduPilot #7333).",
    how="The charge, voltage and time of the predicted flight against the parameters.  PX4: charge below "
    "BAT_LOW_THR, BAT_CRIT_THR, BAT_EMERGEN_THR with COM_LOW_BAT_ACT, counted from BAT1_CAPACITY and "
    "estimated from the open-circuit voltage between BAT1_V_EMPTY and BAT1_V_CHARGED (the one under load and "
    "the drop over BAT1_R_INTERNAL, where that is not negative), whichever is less; where the curve or the "
    "resistance has to be assumed and PX4 would act by that voltage, it is not checked (X904); "
    "RTL_TIME_FACTOR × time to return + RTL_TIME_MARGIN against charge over mean current (50 s, from "
    "BAT_AVRG_CURRENT) with COM_FLTT_LOW_ACT, PX4's own estimate: no wind, no braking (before 1.17 it "
    "returns by default: a warning where neither the action nor the version is known); COM_FLT_TIME_MAX.  "
    "ArduPilot: BATT_CAPACITY less the charge used below BATT_LOW_MAH and BATT_CRT_MAH, voltage under load "
    "(at rest with BATT_FS_VOLTSRC 1) below BATT_LOW_VOLT and BATT_CRT_VOLT for BATT_LOW_TIMER, with "
    "BATT_FS_LOW_ACT and BATT_FS_CRT_ACT (with SRTL_POINTS 0 no SmartRTL); an unknown resistance is taken to "
    "be no more than that of cells of 0.05 ohm for 1 Ah (9 of 10 have less), at the highest power and in the "
    "worst of E134's flights: where the failsafe acts by that, it is not checked (X904).  An error where the "
    "vehicle returns or lands, information where it only warns; in the last landing only what breaks it off: "
    "motors cut, a brake, a return to another place, one that climbs again and for that lands below the "
    "reserve (SmartRTL to the height of the take-off), SmartRTL above that height, which leads back through "
    "all of the flight (ArduPilot: none with FS_OPTIONS 8), and in a return of the mission before it one "
    "that ArduPilot begins anew, its wait too, and for that lands below the reserve, or on which the next "
    "failsafe lands it before it is home; a warning of a return begun anew that ends where it would have, "
    "more than 3 s later, and of a landing where it lands already.  PX4 holds COM_FAIL_ACT_T before it does "
    "either, which counts in time and energy.  Not checked where nothing measures the battery (BATT_MONITOR "
    "0, BAT1_SOURCE -1, CBRK_SUPPLY_CHK 894281).",
    fix="shorten the mission, start with a fuller battery, or set the failsafe to what the battery "
    "can give",
    instead="the vehicle's own parameters with --params",
)


@judges(FAILSAFE_BEFORE_END, BATTERY_ASSUMED, needs=(PACK, PARAMETERS))
def _failsafe_before_end(
    a: Assessment, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding | NotEvaluated]:
    profile = profile_of(a)
    events = _events(a, profile, pack, parameters)
    found = list(first_reported(a, events))
    yield from found
    yield from _unwatched(a, profile, pack, parameters)
    if any(one.severity is Severity.ERROR for one in found):
        return
    if isinstance(parameters, Px4Parameters):
        yield from unwatched_by_px4(a, profile, pack, parameters)
        yield from _returned_by_older_px4(a, profile, pack, parameters)
    cut = list(_cut_anew(a, events, profile, pack, parameters))
    yield from cut or _begun_anew_later(a, events)


def _begun_anew_later(a: Assessment, events: list[FailsafeEvent]) -> Iterator[Finding]:
    """Yield what is begun anew in the last landing or return and ends there, where it takes its time.

    Flown by PX4, RTL_TYPE 1 and RTL_RETURN_ALT 50 m, COM_FLT_TIME_MAX in a landing from 22 m: up to 49 m,
    and down 51 s later; COM_LOW_BAT_ACT 2 in a landing from 20 m: 6 s later; by ArduPilot, RTL_CLIMB_MIN 10 m
    and RTL_LOIT_TIME 30 s, low while it waits over home: 33 s later.
    """
    for event in sorted(events, key=lambda one: (one.segment, one.fraction)):
        kind = a.route.stages[int(a.returns.segment_stage[event.segment])].kind
        comes_down = a.flight.motion.segments.state[event.segment] in _GOES_DOWN
        if not (comes_down or kind in RETURN_STAGES) or (comes_down and _lands_on(a)):
            continue
        returns_on = event.action != LANDS and _returns_on(a, kind)
        if returns_on or not _comes_too_late(a, event):
            continue
        if _stands(_points(a, event), a.route.stages[-1]):
            return
        later = _later(a, event)
        if later:
            found = _reported(a, event, Severity.WARNING)
            yield replace(found, message=f"{found.message}; {later}")
            return


def _later(a: Assessment, event: FailsafeEvent) -> str:
    """Return how much later the vehicle is down by a failsafe of its landing, in words; empty: hardly."""
    if event.action == LANDS:
        return landing_later_text(a, event)
    points = _points(a, event)
    returns = way_back(a, event, points)
    if returns is None:
        return ""
    by_own_track = event.action != RETURNS
    return later_text(a, points, returns, lands_s=a.flight.time_s, by_own_track=by_own_track)


def _cut_anew(
    a: Assessment,
    events: list[FailsafeEvent],
    profile: BatteryProfile,
    pack: Battery,
    parameters: FlightParameters,
) -> Iterator[Finding]:
    """Yield the return that ArduPilot begins anew at the end of a mission, and that the next failsafe ends.

    Flown, RTL_CLIMB_MIN 30 m: BATT_LOW_MAH on the way home, BATT_CRT_MAH planned over home: down 27 m short.
    In a landing at home only what cuts the motors ends it: flown with RTL_CONE_SLOPE 0, 60 m up.
    """
    for event in events if is_of_ardupilot(parameters) else ():
        kind = a.route.stages[int(a.returns.segment_stage[event.segment])].kind
        comes_down = a.flight.motion.segments.state[event.segment] in _GOES_DOWN
        if kind not in _ENDS or (comes_down and _lands_on(a)):
            continue
        cut = _first_on_return(a, event, profile, pack, parameters)
        if cut is not None and (not comes_down or cut.action in STOPS_FLYING.values()):
            found = _reported(a, event, Severity.ERROR)
            yield replace(found, message=found.message + _on_that_return(cut))
            return


def _returned_by_older_px4(
    a: Assessment, profile: BatteryProfile, pack: Battery, parameters: Px4Parameters
) -> Iterator[Finding]:
    """Yield the return by default of versions before the one whose defaults are assumed."""
    origin = parameters.origins.get("return_time_action")
    row = parameter_table(Px4Parameters)["return_time_action"]
    is_known = a.target is not None and a.target.version is not None
    if is_known or origin is None or not origin.is_default or not row.earlier:
        return
    ((major, minor), action), *_ = row.earlier
    older = replace(parameters, return_time_action=int(action))
    if not older.measures_battery:
        return
    for event in px4_time_events(a.returns, profile, pack, older):
        if not _comes_too_late(a, event):
            found = _reported(a, event, Severity.WARNING)
            yield replace(
                found,
                message=f"{found.message}; {row.now.name} is not given and {action:g} by default before "
                f"PX4 {major}.{minor}, and the version is not known",
                fix=f"give {row.now.name} in --params, or the version with --target",
            )


def unwatched_by_px4(
    a: Assessment,
    profile: BatteryProfile,
    pack: Battery,
    parameters: Px4Parameters,
    battery: str = "BAT1",
) -> Iterator[NotEvaluated]:
    """Yield the threshold that acts by a voltage which the battery says too little for."""
    seen = px4_charge_assumed(profile, pack, parameters)
    if seen is None or not parameters.measures_battery:
        return
    voltage_v = px4_voltage_assumed(profile, pack, parameters)
    if voltage_v is not None and voltage_v[0] > px4_highest_v(parameters):
        yield NotEvaluated(
            rule=ARMING_REFUSED,
            asked_by=f"{battery}_N_CELLS of {parameters.battery_cells}",
            needs=_VOLTAGE_NEEDED,
        )
    refused, name = least_to_arm(a, parameters)
    acting = [
        event.parameter
        for event in px4_charge_events(seen, parameters)
        if event.action != WARNS and not _comes_too_late(a, event)
    ]
    if seen[0] < refused <= profile.fraction[0]:
        yield NotEvaluated(
            rule=ARMING_REFUSED,
            asked_by=f"{name} of {quantity.percent(refused)}",
            needs=_VOLTAGE_NEEDED,
        )
    elif acting:
        yield NotEvaluated(
            rule=FAILSAFE_BEFORE_END,
            asked_by=f"{acting[0]}, with COM_LOW_BAT_ACT {parameters.battery_action}",
            needs=_VOLTAGE_NEEDED,
        )


def first_reported(a: Assessment, events: list[FailsafeEvent]) -> Iterator[Finding]:
    """Yield the first that acts, and the first that warns before it."""
    events = _in_time(a, events)
    acting = _first_acting(events)
    warning = next((event for event in events if event.action == WARNS), None)
    if acting is not None:
        yield _reported(a, acting, Severity.ERROR)
    if warning is not None and (
        acting is None or (warning.segment, warning.fraction) < (acting.segment, acting.fraction)
    ):
        yield _reported(a, warning, Severity.INFO)


def _in_time(a: Assessment, events: list[FailsafeEvent]) -> list[FailsafeEvent]:
    """Return those that do not come too late, in flown order."""
    found = [event for event in events if not _comes_too_late(a, event)]
    return sorted(found, key=lambda event: (event.segment, event.fraction))


def _first_acting(events: list[FailsafeEvent]) -> FailsafeEvent | None:
    return next((event for event in events if event.action != WARNS), None)


def _unwatched(
    a: Assessment, profile: BatteryProfile, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding | NotEvaluated]:
    """Yield the thresholds of a parameter file that the battery says too little for."""
    if isinstance(parameters, Px4Parameters) or not parameters.measures_battery:
        return
    at_rest = parameters.battery_voltage_source == 1
    voltage_v = profile.rest_v if at_rest else profile.loaded_v
    low, critical = parameters.battery_low_action, parameters.battery_critical_action
    for name, quantity_name, known, shown, action in (
        ("BATT_LOW_VOLT", "battery_low_v", voltage_v, quantity.voltage, low),
        ("BATT_CRT_VOLT", "battery_critical_v", voltage_v, quantity.voltage, critical),
        ("BATT_ARM_VOLT", "arm_battery_min_v", profile.rest_v, quantity.voltage, _REFUSES),
        ("BATT_LOW_MAH", "battery_low_ah", profile.used_ah, quantity.charge_of_ah, low),
        ("BATT_CRT_MAH", "battery_critical_ah", profile.used_ah, quantity.charge_of_ah, critical),
    ):
        threshold = getattr(parameters, quantity_name)
        origin = parameters.origins.get(quantity_name)
        is_given = origin is not None and origin.is_file
        if known is not None or threshold <= 0.0 or not is_given or not action:
            continue
        if name in {"BATT_LOW_MAH", "BATT_CRT_MAH"} and not parameters.measures_current:
            continue
        is_loaded = name.endswith("_VOLT") and action != _REFUSES and not at_rest
        most_ohm = high_resistance_ohm(pack, battery_temperature_c(a.setup, a.flight))
        if is_loaded and most_ohm and _acts_on_none(a, profile, pack, parameters, most_ohm):
            yield a.finding(
                BATTERY_ASSUMED,
                f"battery resistance assumed to be no more than {quantity.decimals(1000.0 * most_ohm, 0)} "
                f"milliohm, as that of 9 of 10 such batteries: {name} of {shown(threshold)} then acts in no "
                "flight",
            )
            continue
        yield NotEvaluated(
            rule=ARMING_REFUSED if name == "BATT_ARM_VOLT" else FAILSAFE_BEFORE_END,
            asked_by=f"{name} of {shown(threshold)}",
            needs=(
                "the battery's open-circuit voltage and resistance, in the vehicle model"
                if is_loaded
                else "the battery's charge and voltage, such as --battery 5.2Ah@14.8V"
            ),
        )


def _acts_on_none(
    a: Assessment,
    profile: BatteryProfile,
    pack: Battery,
    parameters: ArduPilotParameters,
    resistance_ohm: float,
) -> bool:
    """Return whether no failsafe acts even at the highest power and the greatest error, by a resistance."""
    if profile.rest_v is None:
        return False
    sds = deviations_beyond(MOST_CHANCE_EMPTY)
    uncounted = (one for one, *_ in _uncounted_flight(a, pack))
    worse = (one for one, *_ in _worse_flights(a, pack, parameters, sds))
    for one in (profile, *uncounted, *worse):
        assert one.rest_v is not None  # of the same battery
        highest_w = one.times * a.totals.peak_power_w
        loaded_v = loaded_voltage_v(one.rest_v, highest_w, resistance_ohm=resistance_ohm)
        events = _charge_events(a, replace(one, loaded_v=loaded_v), pack, parameters)
        if _first_acting(_in_time(a, events)) is not None:
            return False
    return True


def _comes_too_late(a: Assessment, event: FailsafeEvent) -> bool:
    """Return whether the vehicle does by then what the failsafe would make it do."""
    number = int(a.returns.segment_stage[event.segment])
    kind = a.route.stages[number].kind
    if (event.action == RETURNS and _returns_on(a, kind)) or (
        event.action == TO_LANDING and _flies_its_landing(a, a.route.stages[number].item)
    ):
        return True
    last = next((last for first, last in a.route.return_spans if first <= number <= last), number)
    # Where it takes off again, the failsafe leaves it on the ground.
    if kind not in _ENDS or last + 1 < len(a.route.stages):
        return False
    state = a.flight.motion.segments.state[event.segment]
    comes_down = kind in LANDED_STAGES and state in _GOES_DOWN
    if event.action == WARNS:
        return comes_down or kind in RETURN_STAGES
    if event.action == LANDS:
        return comes_down or _is_over(_points(a, event), a.route.stages[last])
    if comes_down:
        return _lands_on(a) or _ends_there(a, event, a.route.stages[last])
    returns = event.action == RETURNS and kind in RETURN_STAGES
    return returns and not _begins_anew_short(a, event)


def _returns_on(a: Assessment, kind: StageKind) -> bool:
    """Return whether the vehicle is in a return that another does not begin anew.

    PX4's of the mission: it only warns (``FailsafeBase::getSelectedAction``, from 1.16 on).
    """
    return kind in RETURN_STAGES and not is_of_ardupilot(a.own_parameters)


def _flies_its_landing(a: Assessment, item: int) -> bool:
    """Return whether ArduPilot is in the landing sequence that it would jump to, and goes on.

    A DO_LAND_START or a landing begins one, a take-off ends it (``AP_Mission::start_command``): five of five
    flights as planned, one behind a further take-off back at the DO_LAND_START, 64 % more energy.
    """
    if not a.mission.numbered(Command.DO_LAND_START):
        return False
    is_landing = False
    for number, one in a.mission.numbered(*_LANDING_SEQUENCE):
        if number > item:
            break
        is_landing = one.command not in TAKEOFFS
    return is_landing and not any(a.mission.numbered(Command.DO_JUMP, Command.DO_JUMP_TAG))


def _lands_on(a: Assessment) -> bool:
    return bool(int(numbers(a).get("FS_OPTIONS", 0.0)) & _LANDS_ON)


def _begins_anew_short(a: Assessment, event: FailsafeEvent) -> bool:
    """Return whether a return that a failsafe begins anew during the mission's own ends below the reserve.

    ArduPilot climbs and waits over home once more (``ModeRTL::init``; flown).
    """
    return return_short_wh(a, _points(a, event), a.returns) > 0.0


def _points(a: Assessment, event: FailsafeEvent) -> ReturnPoints:
    """Return the point of the flight at which a failsafe acts."""
    return a.returns.points(np.array([event.segment]), np.array([event.fraction]))


def _ends_there(a: Assessment, event: FailsafeEvent, landing: Stage) -> bool:
    """Return whether a failsafe ends where the vehicle lands already, or on the ground."""
    points = _points(a, event)
    if _stands(points, landing):
        return True
    if event.action in {TO_LANDING, *STOPS_FLYING.values()}:
        return False
    if event.action in BY_OWN_TRACK.values():
        returns = way_back(a, event, points)
        return returns is not None and not return_short_wh(a, points, returns)
    targets = a.returns.destinations.targets(points.stage, a.returns.chosen(points), points.place_m)
    east_m, north_m = targets.ground_m[0, :2]
    is_there = math.hypot(landing.east_m - east_m, landing.north_m - north_m) < _SAME_PLACE_M
    return is_there and not return_short_wh(a, points, way_back(a, event, points) or a.returns)


def _stands(points: ReturnPoints, landing: Stage) -> bool:
    """Return whether a vehicle at a point has landed."""
    return bool(points.place_m[0, 2] - landing.height_m < _ON_GROUND_M)


def _is_over(points: ReturnPoints, landing: Stage) -> bool:
    """Return whether a vehicle at a point is over where it lands: it waits there before it comes down."""
    place_m = points.place_m[0, :2].tolist()
    return math.dist(place_m, (landing.east_m, landing.north_m)) < _OVER_M


def has_landing(mission: Mission) -> bool:
    """Return whether ArduPilot finds a way to land in the mission (``jump_to_landing_sequence``)."""
    return bool(mission.numbered(Command.DO_LAND_START, Command.DO_RETURN_PATH_START))


def _reported(a: Assessment, event: FailsafeEvent, severity: Severity) -> Finding:
    [point] = a.returns.flight_points([(event.segment, event.fraction)])
    points = _points(a, event)
    returns = way_back(a, event, points)
    short_wh = 0.0 if returns is None else return_short_wh(a, points, returns)
    short = f"; that return ends {quantity.energy(short_wh)} below the reserve" if short_wh else ""
    return a.finding(
        FAILSAFE_BEFORE_END,
        f"the vehicle itself {event.action} at {place_along(point)}: {event.reading}{short}",
        severity=severity,
        item=point.item,
    )


FAILSAFE_AT_RISK = Rule(
    "E134 failsafe-at-risk",
    Severity.ERROR,
    summary="The vehicle's own battery failsafe may end the mission early.",
    why="A failsafe that lands in the field acts by what a flight takes, not by what was predicted: one just "
    "beyond the prediction ends nearly half of all flights.",
    how="E103 in the flight of a hundred that takes most, by the model's [spread] (the upper end of its "
    "interval), or standard deviations of 5 % of the energy, and by the charge as given, and in flights "
    "between that and the predicted one: an error where it lands where it is or stops its motors there, or "
    "on the return that it begins, or where SmartRTL has a longer track back than the charge lasts.  A "
    "warning where the vehicle returns in more flights than --risk allows.  COM_FLT_TIME_MAX likewise in the "
    "flight that takes longest, by the interval of its time, or standard deviations of 5 %.  And in the "
    "flight that takes all, and lasts as long, as the model may leave uncounted of wind, air and airspeed "
    "(E105, E108).",
    fix="leave more in the battery: a shorter mission, or a larger or fuller battery",
    instead="--battery or --charge, or the parameters of --params",
)


@judges(FAILSAFE_AT_RISK, needs=(PACK, PARAMETERS))
def _failsafe_at_risk(
    a: Assessment, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding]:
    predicted = profile_of(a)
    events = _events(a, predicted, pack, parameters)
    acts = _first_acting(_in_time(a, events)) is not None
    if acts or any(_cut_anew(a, events, predicted, pack, parameters)):
        return  # E103
    # Of flights that take more, those that take less of it may come home from farther off.
    most = deviations_beyond(MOST_CHANCE_EMPTY)
    for part in np.linspace(1.0, 0.0, _FLIGHTS, endpoint=False).tolist():
        found = list(_acting_in(a, pack, parameters, part * most, part=part))
        if not found:
            break
        errors = [one for one in found if one.severity is Severity.ERROR]
        if errors:
            yield errors[0]
            return
    yield from islice(_acting_in(a, pack, parameters, deviations_beyond(a.setup.risk)), 1)


def _acting_in(
    a: Assessment, pack: Battery, parameters: FlightParameters, sds: float, *, part: float = 1.0
) -> Iterator[Finding]:
    """Yield what acts in flights so many deviations off, and with a part of what is not counted. [-]"""
    so_many = f"as {quantity.percent(chance_beyond(sds))} of flights do"
    worse = _worse_flights(a, pack, parameters, sds)
    flights = [(*one, so_many) for one in worse]
    for profile, longer, words, why in (*_uncounted_flight(a, pack, part), *flights):
        events = _events(a, profile, pack, parameters, longer=longer)
        event = _first_acting(_in_time(a, events))
        if event is None:
            every = _cut_anew(a, events, profile, pack, parameters)
        else:
            cut = _ends_of_return(a, event, profile, pack, parameters)
            ends = event.action in _ENDS_FLYING or cut
            found = _reported(a, event, Severity.ERROR if ends else Severity.WARNING)
            every = iter((replace(found, message=found.message + cut),))
        for found in every:
            yield a.finding(
                FAILSAFE_AT_RISK,
                f"{found.message}; in a flight that {words}, {why}",
                severity=found.severity,
                item=found.item,
            )


def _uncounted_flight(
    a: Assessment, pack: Battery, part: float = 1.0
) -> Iterator[tuple[BatteryProfile, float, str, str]]:
    """Yield the flight that takes a part of what its model does not count, as `_worse_flights`, and why."""
    more_wh, flown_wh = part * a.uncounted.flown_wh, a.totals.energy_wh
    late_s = part * np.cumsum(a.uncounted.late_s)
    if not flown_wh > 0.0 or not math.isfinite(more_wh) or not (more_wh or late_s[-1]):
        return
    more = more_wh / flown_wh
    words = f"takes {quantity.percent(more)} more than predicted"
    if late_s[-1] > 0.0:
        words += f" or lasts {quantity.duration(late_s[-1])} longer"
    hungry = _hungry(a, pack, times=1.0 + more)
    hungry = replace(hungry, later_s=hungry.later_s + np.append(0.0, late_s))
    why = "which its model does not count (E105, E108)"
    yield hungry, 1.0, words, why


def _hungry(a: Assessment, pack: Battery, *, times: float, less: float = 0.0) -> BatteryProfile:
    """Return the battery along a flight that takes more, as `battery_profile` does."""
    return battery_profile(
        a.returns,
        pack,
        a.discharge,
        charge=a.charge,
        times=times,
        less=less,
        later_s=a.lateness.in_all_s,
    )


def _worse_flights(
    a: Assessment, pack: Battery, parameters: FlightParameters, sds: float
) -> Iterator[tuple[BatteryProfile, float, str]]:
    """Yield flights so many deviations off: the battery along each, its time over that predicted, in words.

    One that takes more than predicted, and one that takes longer.
    """
    predicted, totals = profile_of(a), a.totals
    taken = float(predicted.fraction[0] - predicted.fraction[-1])
    if parameters.measures_battery and totals.energy_wh and taken > 0.0:
        of_flight = sds * _error(totals.energy_wh, totals.energy_wh_p90) * taken
        of_charge = sds * sd_of(a.setup.charge)
        # Of all that is as likely, what leaves least: by how much each of the two is off.
        off = max(math.hypot(of_flight, of_charge), _NO_DEVIATION)
        times, less = 1.0 + of_flight**2 / off / taken, of_charge**2 / off
        hungry = _hungry(a, pack, times=times, less=less)
        begun = f", begun at {quantity.percent(a.charge - less)} of the charge" if less else ""
        yield hungry, 1.0, f"takes {quantity.percent(times - 1.0)} more than predicted{begun}"
    if isinstance(parameters, Px4Parameters) and parameters.flight_time_max_s > 0.0:
        later = sds * _error(totals.time_s, totals.time_s_p90)
        yield predicted, 1.0 + later, f"lasts {quantity.percent(later)} longer than predicted"


def _error(mean: float, upper: float | None) -> float:
    """Return the standard deviation of what one flight of ten has more of than ``upper``, or 5 %. [-]"""
    return ASSUMED_ERROR if upper is None else (upper / mean - 1.0) / _SDS_BELOW_UPPER


def _ends_of_return(
    a: Assessment,
    event: FailsafeEvent,
    profile: BatteryProfile,
    pack: Battery,
    parameters: FlightParameters,
) -> str:
    """Return what ends the return that a failsafe begins, in words; empty: nothing."""
    if event.action in BY_OWN_TRACK.values() and way_back(a, event, _points(a, event)) is None:
        left = _at_event(profile.fraction, event)
        back = float(profile.fraction[0]) - left
        return f", and its track back takes {quantity.percent(back)}" if back > left else ""
    cut = _first_on_return(a, event, profile, pack, parameters)
    return "" if cut is None else _on_that_return(cut)


def _at_event(row: FloatArray, event: FailsafeEvent) -> float:
    """Return a value along the flight where a failsafe acts. (s + 1,)"""
    before, after = row[event.segment : event.segment + 2]
    return float(before + event.fraction * (after - before))


def _on_that_return(cut: FailsafeEvent) -> str:
    return f", and on that return {cut.action}: {cut.reading}"


def _first_on_return(
    a: Assessment,
    event: FailsafeEvent,
    profile: BatteryProfile,
    pack: Battery,
    parameters: FlightParameters,
) -> FailsafeEvent | None:
    """Return what ends the return that a failsafe begins before it comes down; ``None``: nothing.

    What cuts the motors does until it is down.
    """
    points = _points(a, event)
    returns = way_back(a, event, points)
    if returns is None or not a.totals.energy_wh:
        return None
    flown = returns.flown(points)
    action = getattr(parameters, "battery_critical_action", None)
    goes_down = () if action in STOPS_FLYING else _GOES_DOWN
    down = [state in goes_down for state in range(flown.state_energy_j.shape[1])]
    late = late_returns_of(a, flown)
    segments = flown.flight.motion.segments
    flies = ~np.isin(segments.state, goes_down)
    late_s = held_s(a) + float(late.climbs_s[flies].sum() + late.ways_s[0])
    late_wh = a.hovered_wh(late_s)
    back_s = float(segments.duration_s[flies].sum()) + late_s
    back_wh = float(flown.energy_wh[0] - wh_from_j(flown.state_energy_j[0, down].sum())) + late_wh
    flown_wh = a.totals.energy_wh + a.late_wh

    def at_return(row: FloatArray) -> FloatArray:
        """Return a value at the start, where the return begins, and where it comes down."""
        there, per_wh = _at_event(row, event), (row[-1] - row[0]) / flown_wh
        return np.array([row[0], there, there + per_wh * back_wh])

    begun_s, fraction = _at_event(profile.time_s, event), at_return(profile.fraction)
    used_ah = profile.used_ah
    rest_v = loaded_v = None
    curve = rest_curve(pack)
    if curve is not None:
        rest_v = np.interp(fraction, curve.state_of_charge, curve.voltage_v)
        if profile.loaded_v is not None and back_s > 0.0:
            power_w = profile.times * j_from_wh(back_wh) / back_s
            last_v = loaded_voltage_v(rest_v[-1], power_w, resistance_ohm=profile.resistance_ohm)
            loaded_v = np.array(
                [profile.loaded_v[0], _at_event(profile.loaded_v, event), float(last_v)]
            )
    returning = replace(
        profile,
        time_s=np.array([0.0, begun_s, begun_s + back_s]),
        later_s=np.zeros(3),
        fraction=fraction,
        used_ah=None if used_ah is None else at_return(used_ah),
        rest_v=rest_v,
        loaded_v=loaded_v,
    )
    cuts = (
        one
        for one in _charge_events(a, returning, pack, parameters)
        if one.action in _ENDS_FLYING and one.segment > 0
    )
    return min(cuts, key=lambda one: one.fraction, default=None)


def _events(
    a: Assessment,
    profile: BatteryProfile,
    pack: Battery,
    parameters: FlightParameters,
    *,
    longer: float = 1.0,
) -> list[FailsafeEvent]:
    """Return what an autopilot decides along a flight, in no order."""
    if isinstance(parameters, Px4Parameters):
        return list(px4_events(a.returns, profile, pack, parameters, longer=longer))
    return _charge_events(a, profile, pack, parameters)


def _charge_events(
    a: Assessment, profile: BatteryProfile, pack: Battery, parameters: FlightParameters
) -> list[FailsafeEvent]:
    """Return what an autopilot decides by the charge and the voltage of a battery, in no order."""
    if isinstance(parameters, Px4Parameters):
        return list(px4_charge_events(px4_charge(profile, pack, parameters), parameters))
    return list(ardupilot_events(profile, parameters, has_landing=has_landing(a.mission)))
