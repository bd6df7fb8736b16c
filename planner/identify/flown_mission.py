"""What a flight is predicted from, from its log: mission, parameters, wind."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import FlightState
from planner.identify.segments import find_states
from planner.logs.record import AUTO, AUTO_MISSION, Boundary, LoggedItem
from planner.mission.commands import Command, command_name
from planner.mission.items import (
    Home,
    Mission,
    MissionFormat,
    MissionItem,
    VehicleEvidence,
    VehicleKind,
)
from planner.mission.parts import UNLOADING
from planner.physics.wind import Wind
from planner.setup import MOST_NOISE_M
from planner.values import Value, field_values, replace
from planner.vehicle.parameters.files import ParameterSet, ParameterValue

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Finding
    from planner.logs.record import FlightRecord
    from planner.mission.route.stage import Route


_RELATIVE_FRAME = 3
"""MAV_FRAME_GLOBAL_RELATIVE_ALT."""
_LEAST_WIND_FRACTION = 0.5
"""Fraction of the time in the air the wind must be known for. [-]"""
_HORIZONTAL = frozenset((FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE))
_VERSION = re.compile(r"(\d+)\.(\d+)")
_NOTHING = LoggedItem(0, 197, 2, *[None] * 7)
"""DO_SET_ROI_NONE, for an item that is not logged, so that the others keep their numbers."""


def flown_mission(record: FlightRecord) -> Mission:
    """Return the mission of a flight, from its log alone.

    Home is where the vehicle was armed; items that are not logged do nothing, which is a finding.

    Raises LogFileError if the log holds no mission.
    """
    if not record.mission_items:
        msg = "holds no mission: give the one flown with --mission"
        raise LogFileError(msg, source=record.source)
    logged = {item.item: item for item in record.mission_items}
    numbers = range(1, max(logged) + 1)
    return Mission(
        source=record.source,
        file_format=MissionFormat.PLAN,
        items=tuple(_item(logged.get(number, _NOTHING), number) for number in numbers),
        home=flown_home(record),
        autopilot=record.autopilot,
        vehicle=VehicleEvidence(
            kind=VehicleKind.MULTICOPTER, is_certain=True, reason="it is the mission of a log"
        ),
        findings=tuple(_findings(record, [n for n in numbers if n not in logged])),
    )


LOAD_LET_GO = Rule(
    "I114 load-let-go",
    Severity.WARNING,
    summary="A payload is given for all of a flight that may have put it down on the way.",
    why="The flight without it counts as one with it: a hover took 409 W of 545 (a delivery of 1 kg by a "
    "vehicle of 3 kg), and a flight that carries it all the way 16 % more than predicted.",
    how="A log with a payload whose mission has NAV_PAYLOAD_PLACE, a gripper, a winch, an actuator, a servo, "
    "a relay, an auxiliary function or a sprayer, or that stood on the ground between parts of its flight.",
    fix="use flights that carry one payload all the way, or give none for those that hardly carried it",
)


def loads_let_go(record: FlightRecord, payload_kg: float | None) -> Iterator[Finding]:
    """Yield that a payload may not have been carried all the way."""
    if not payload_kg:
        return
    lets_go = sorted({one.command for one in record.mission_items} & UNLOADING)
    in_air = np.flatnonzero(~record.is_landed)
    stood = in_air.size and record.is_landed[in_air[0] : in_air[-1]].any()
    if not lets_go and not stood:
        return
    does = f"its mission has {command_name(lets_go[0])}" if lets_go else "it landed on the way"
    yield LOAD_LET_GO.finding(
        f"{record.source}: {quantity.mass(payload_kg)} of payload count all the way, but {does}"
    )


def flown_home(record: FlightRecord) -> Home | None:
    """Return where a flight began; ``None`` for one without a global position."""
    home = record.home
    if home.latitude_deg is None or home.longitude_deg is None:
        return None
    return Home(
        latitude_deg=home.latitude_deg,
        longitude_deg=home.longitude_deg,
        altitude_amsl_m=home.altitude_amsl_m,
    )


def _item(item: LoggedItem, number: int) -> MissionItem:
    values = field_values(item)
    del values["item"]
    frame = _RELATIVE_FRAME if item.frame is None else item.frame
    return MissionItem(**{**values, "frame": frame, "jump_id": number})


MISSION_INCOMPLETE = Rule(
    "R202 mission-untold",
    Severity.WARNING,
    summary="A log holds only part of its mission.",
    why="Items that are not logged may change speeds, wait or jump; the prediction lacks them.",
    how="PX4 logs the items with a place when it begins them; numbers left out in between are others, "
    "of which changes of speed are read from the speeds it then flies by.  ArduPilot before 4.0 logs "
    "no altitude frames; heights above home are assumed.",
    fix="give the mission with --mission",
)


def _findings(record: FlightRecord, missing: list[int]) -> Iterator[Finding]:
    if missing:
        more = " is" if len(missing) == 1 else f" and {len(missing) - 1} more are"
        yield MISSION_INCOMPLETE.finding(
            f"{record.source}: item {missing[0]}{more} not in the log: predicted without"
        )
    if any(item.frame is None for item in record.mission_items):
        yield MISSION_INCOMPLETE.finding(
            f"{record.source}: no altitude frames in the log: heights above home assumed"
        )


def record_parameters(record: FlightRecord) -> ParameterSet | None:
    """Return the autopilot's parameters during a flight; ``None`` where the log holds none."""
    if not record.parameters or record.autopilot not in {Autopilot.PX4, Autopilot.ARDUPILOT}:
        return None
    version = _VERSION.search(record.firmware)
    return ParameterSet(
        source=record.source,
        values={name: ParameterValue(value) for name, value in record.parameters.items()},
        stack=record.autopilot,
        version=None if version is None else (int(version[1]), int(version[2])),
    )


def flown_wind(record: FlightRecord) -> Wind | None:
    """Return the mean wind in the air; ``None`` where the log does not hold it."""
    in_air = ~record.is_landed
    north, east = record.wind_north_m_s[in_air], record.wind_east_m_s[in_air]
    known = np.isfinite(north) & np.isfinite(east)
    if not known.any() or known.mean() < _LEAST_WIND_FRACTION:
        return None
    to_north, to_east = float(north[known].mean()), float(east[known].mean())
    return Wind(
        speed_m_s=float(np.hypot(to_north, to_east)),
        from_deg=float(np.degrees(np.arctan2(-to_east, -to_north)) % 360.0),
    )


_MEAN_OVER_MEDIAN = math.sqrt(math.pi / 2.0) / math.sqrt(2.0 * math.log(2.0))
"""Of Rayleigh's distribution, that of lengths of normal errors. [-]"""


def flown_position_noise_m(record: FlightRecord) -> float:
    """Return the mean horizontal error of the position that PX4 slows its time down by.

    Taken while the vehicle hovers or moves only vertically, where the reference does not move: of errors
    to the north and to the east alike and normal, by their median, which a vehicle that still comes back
    to a place it overshot does not raise.

    0 for other autopilots, and where references are not logged. [m]
    """
    if record.autopilot is not Autopilot.PX4:
        return 0.0
    error = np.hypot(
        record.reference_north_m - record.north_m, record.reference_east_m - record.east_m
    )
    still = np.zeros(error.size, dtype=np.bool_)
    for segment in find_states(record):
        still[segment.samples] |= segment.state not in _HORIZONTAL
    errors = error[still & np.isfinite(error)]
    noise_m = _MEAN_OVER_MEDIAN * float(np.median(errors)) if errors.size else 0.0
    return min(noise_m, MOST_NOISE_M)


def flown_heading_deg(record: FlightRecord) -> float | None:
    """Return the heading before the take-off; ``None`` where the record has none of it. [°]"""
    before = np.flatnonzero(~record.is_landed)
    on_ground = record.yaw_deg[: before[0] if before.size else None]
    headings = on_ground[np.isfinite(on_ground)]
    return float(headings[-1]) if headings.size else None


_NAMED = 5


PARAMETERS_DIFFER = Rule(
    "I104 parameters-differ",
    Severity.WARNING,
    summary="Autopilot parameters differ between the flights a model is made of.",
    why="The vehicle flew in two ways; a model with one of them would be wrong for the other.",
    how="Parameters that predictions depend on are compared between the logs.",
    fix="give --params with the parameters of the day to check, or identify from like flights",
)


_HOVER_THROTTLE = "MOT_THST_HOVER"
_SAME_HOVER = 1.25
"""Hover throttles of one vehicle are within this ratio: as the voltage of one battery falls. [-]"""


def flown_parameters(
    records: Sequence[FlightRecord], autopilot: Autopilot, times_heavier: Sequence[float]
) -> tuple[tuple[tuple[str, float], ...], tuple[Finding, ...]]:
    """Return the parameters the flights have in common, of those a prediction depends on.

    They have their own names and units. Findings name what differs from flight to flight: that is
    left to the parameter file of the day.  The hover throttle is that of the model's mass, the highest
    of flights that hardly differ in it.

    Parameters
    ----------
    records : sequence of FlightRecord
    autopilot : Autopilot
    times_heavier : sequence of float
        The mass of each flight over that of the model. [-]
    """
    from planner.vehicle.parameters.resolve import PARAMETERS_OF
    from planner.vehicle.parameters.table import parameter_table

    common: list[tuple[str, float]] = []
    differing: list[str] = []
    for row in parameter_table(PARAMETERS_OF[autopilot]).values():
        for spelling in row.spellings:
            values = [r.parameters[spelling.name] for r in records if spelling.name in r.parameters]
            if spelling.name == _HOVER_THROTTLE and len(values) == len(records):
                values = _hover_throttles(values, times_heavier)
            if not values or not row.is_possible(spelling.si(values[-1])):
                continue
            if len(set(values)) > 1:
                differing.append(spelling.name)
            elif len(values) == len(records):
                common.append((spelling.name, float(f"{float(np.float32(values[0])):.7g}")))
                break  # a log may hold the old name beside the new one
    if not differing:
        return tuple(common), ()
    more = f" and {len(differing) - _NAMED} more" if len(differing) > _NAMED else ""
    return tuple(common), (
        PARAMETERS_DIFFER.finding(
            "different between flights, left out of the model: "
            f"{', '.join(differing[:_NAMED])}{more}"
        ),
    )


def _hover_throttles(flown: Sequence[float], times_heavier: Sequence[float]) -> list[float]:
    """Return the hover throttles of flights with the mass of the model, as one where they hardly differ."""
    own = [value / times for value, times in zip(flown, times_heavier, strict=True)]
    highest = max(own)
    return [highest] * len(own) if highest <= _SAME_HOVER * min(own) else own


_MISSION_MODES = (AUTO, AUTO_MISSION, "AUTO_TAKEOFF")
_RETURNS = ("RTL", "AUTO_RTL", "AUTO_LAND", "LAND", "SMART_RTL")
"""Modes a mission that asks for a return or a landing may end in."""
_LEAST_S = 2.0
"""A shorter time in another mode is a switch passed over. [s]"""


class FlownWindow(Value):
    """What is compared of a record."""

    flown: FlightRecord
    before_s: float
    """Left out before. [s]"""
    after_s: float
    """Left out after. [s]"""
    findings: tuple[Finding, ...]
    is_begun_running: bool = False
    """Whether the mission was begun with the motors running: what they take to be is no part of it."""
    breaks_off: bool = False
    """Whether the log ends in the air before the mission does: its last item is recorded in part."""


OFF_GROUND_M = 1.0
"""Height above home at which flights are seen to have taken off, whatever lands a log reports. [m]"""


def lift_off(record: FlightRecord) -> int:
    """Return the sample at which a flight is off the ground; the first where it never is."""
    return int(np.argmax(record.height_above_home_m > OFF_GROUND_M))


MISSION_LEFT = Rule(
    "R201 mission-left",
    Severity.WARNING,
    summary="Part of a flight was not flown by its mission.",
    why="A flight by a pilot, or by a failsafe in the middle of a mission, cannot be predicted from "
    "the mission: its errors are not the model's.",
    how="The vehicle was in the air for more than 2 s in a mode that flies no mission; a return is "
    "part of a mission that asks for one.",
    fix="verify with flights that kept to their missions",
)


FLIGHT_CUT = Rule(
    "R205 flight-cut",
    Severity.INFO,
    summary="Only part of the time armed is compared with the prediction.",
    why="Waiting on the ground before a mission, and what follows one that ends in the air, is not "
    "part of it.",
    how="The flight begins where the mission begins if that is on the ground, of several times the last, "
    "and ends with it if the mission does not land; reported from more than 2 s on.  Motors that run already "
    "are not waited for: of the prediction counts as much on the ground as was flown.  Where a log ends in "
    "the air in the middle of its mission, both are compared up to the last item that both begin in the air.",
    fix="nothing",
)


BROKEN_OFF_EARLY = Rule(
    "R209 broken-off-early",
    Severity.WARNING,
    summary="A log breaks off before half of its mission is flown.",
    why="What was not recorded is no error of the prediction, and a take-off and a leg say little of how far "
    "whole flights are from it.",
    how="The log ends in the air in the middle of its mission, and the last item that the flight and its "
    "prediction both begin in the air is due in the first half of the predicted time, or there is none.  "
    "Such a flight tells nothing of the times of the model.",
    fix="verify with flights recorded to their ends",
)


BEGUN_IN_AIR = Rule(
    "R207 mission-begun-in-air",
    Severity.WARNING,
    summary="A mission was begun in the air.",
    why="The prediction takes off from the ground: times and energies are not of the same flight.",
    how="The vehicle is more than 1 m up, or in the air where heights are not known, when the mode that "
    "flies missions is entered first.",
    fix="verify with flights whose mission takes off",
)


def flown_window(record: FlightRecord, mission: Mission, route: Route) -> FlownWindow:
    """Return the part of a flight to compare with the prediction of its mission.

    It begins with the record, or with the mission where that began on the ground later, of more than one
    time the last; it ends with the record, or with the mission where that ends in the air.
    """
    in_mission = np.isin(record.mode, _MISSION_MODES)
    if not in_mission.any():
        message = f"{record.source}: no mission was flown in {record.duration_s:.1f} s of flight"
        left = (MISSION_LEFT.finding(message),) if np.any(record.mode != "") else ()
        return FlownWindow(flown=record, before_s=0.0, after_s=0.0, findings=left)
    findings: list[Finding] = []
    first, last = np.flatnonzero(in_mission)[[0, -1]].tolist()
    height = record.height_above_home_m
    has_flown = np.logical_or.accumulate(
        np.where(np.isfinite(height), height > OFF_GROUND_M, ~record.is_landed)
    )
    on_ground = np.flatnonzero(in_mission & ~np.append(False, in_mission[:-1]) & ~has_flown)
    begin = int(on_ground[-1]) if on_ground.size else 0
    if not on_ground.size:
        message = (
            f"{record.source}: the mission was begun in the air, after {record.time_s[first]:.1f} s"
        )
        findings.append(BEGUN_IN_AIR.finding(message))
    ends_in_air = route.ends_in_air
    end = last + 1 if ends_in_air else record.time_s.size
    flown = cut_record(record, begin, end)
    before_s = float(record.time_s[begin])
    after_s = record.duration_s - before_s - flown.duration_s
    breaks_off = (
        end == record.time_s.size
        and record.ends_with is Boundary.LOG
        and not bool(record.is_landed[-1])
    )
    cut = [(before_s, "before"), (after_s, "after")]
    left_out = " and ".join(f"{time_s:.1f} s {where}" for time_s, where in cut if time_s > _LEAST_S)
    if left_out:
        findings.append(FLIGHT_CUT.finding(f"{record.source}: {left_out} the mission are left out"))
    findings += _left(flown, mission)
    return FlownWindow(
        flown=flown,
        before_s=before_s,
        after_s=max(after_s, 0.0),
        findings=tuple(findings),
        is_begun_running=begin > 0,
        breaks_off=breaks_off,
    )


def cut_record(record: FlightRecord, begin: int, end: int) -> FlightRecord:
    """Return the samples of a flight from one to before another."""
    if begin == 0 and end == record.time_s.size:
        return record
    begin_s = float(record.time_s[begin])
    end_s = record.duration_s if end == record.time_s.size else float(record.time_s[end - 1])
    columns = {name: column[begin:end] for name, column in record.columns().items()}
    return replace(
        record,
        **{**columns, "time_s": record.time_s[begin:end] - begin_s},
        duration_s=end_s - begin_s,
        begins_in_log_s=record.begins_in_log_s + begin_s,
    )


def _left(flown: FlightRecord, mission: Mission) -> list[Finding]:
    """Return what was flown in modes that no mission flies in, in one finding."""
    elsewhere = ~np.isin(flown.mode, (*_MISSION_MODES, "")) & ~flown.is_landed
    returns = [
        number
        for number, item in enumerate(mission.items, start=1)
        if item.command == Command.NAV_RETURN_TO_LAUNCH
    ]
    if returns:
        # Where the log holds no items, a return is taken to be the one that is asked for.
        is_due = np.maximum.accumulate(flown.mission_item) >= returns[0] - 1
        asked_for = is_due | ~flown.mission_item.any()
        elsewhere &= ~(np.isin(flown.mode, _RETURNS) & asked_for)
    lost_s = float(elsewhere.sum()) * flown.step_s
    if lost_s <= _LEAST_S:
        return []
    modes = ", ".join(dict.fromkeys(flown.mode[elsewhere].tolist()))
    since_s = float(flown.time_s[np.flatnonzero(elsewhere)[0]])
    return [
        MISSION_LEFT.finding(
            f"{flown.source}: {modes} was flown for {lost_s:.1f} s from {since_s:.1f} s on: "
            "not predicted by the mission"
        )
    ]
