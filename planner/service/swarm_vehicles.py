"""What a check finds of the vehicles of a swarm, its weather and its pads: a simulation takes it as given."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.pilot import CONDITION_NOT_MODELLED
from planner.geo.geodesy import latitude_longitude_deg
from planner.mission.commands import Command, Frame
from planner.mission.items import Home, Mission, MissionFormat, MissionItem, numbered_in_order
from planner.rules.battery import (
    BATTERY_COLD,
    BATTERY_IMPOSSIBLE,
    BATTERY_VOLTAGE_DIFFERS,
    DISCHARGE_RATE_HIGH,
)
from planner.rules.battery_arming import ARMING_REFUSED
from planner.rules.lift import ABOVE_CEILING, HOVER_THROTTLE_HIGH, LIFT_UNKNOWN
from planner.rules.model import MODEL_OUTSIDE_ENVELOPE, NO_VEHICLE
from planner.rules.wind import NO_HEADWAY, WIND_BEYOND_MODEL, WIND_LIMIT
from planner.service.fleet_separation import GROUND_SEPARATION
from planner.service.preflight import CheckResult, check_mission
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.fleet.fleet import Fleet, Pad
    from planner.service.preflight import UnreadableMission
    from planner.setup import Setup

_HEADINGS = 8
"""Of a flight that stands for all an agent may do: into the wind, with it and across."""
_LEG_S = 30.0
"""Of such a flight: longer than speeding up and braking. [s]"""
_TOUCH_M = 0.5
"""Two vehicles whose middles are nearer than that touch, however well their places are known. [m]"""
_MATTERS = frozenset(
    rule.code
    for rule in (
        ABOVE_CEILING,
        ARMING_REFUSED,
        BATTERY_COLD,
        BATTERY_IMPOSSIBLE,
        BATTERY_VOLTAGE_DIFFERS,
        CONDITION_NOT_MODELLED,
        DISCHARGE_RATE_HIGH,
        HOVER_THROTTLE_HIGH,
        LIFT_UNKNOWN,
        MODEL_OUTSIDE_ENVELOPE,
        NO_HEADWAY,
        NO_VEHICLE,
        WIND_BEYOND_MODEL,
        WIND_LIMIT,
    )
)
"""Codes of rules about vehicle, battery and weather: their warnings count too."""
LEFT_OUT: Mapping[str, tuple[str, ...]] = {
    "fences": ("F", "L107", "L156", "L164"),
    "terrain": ("A102", "A104", "A117", "A119", "E127", "T117", "X910"),
    "voltages": ("E104",),
    "returns": ("E102", "E106", "E129", "T110", "T113"),
    "the autopilot's failsafes": ("E103", "E134"),
    "site profiles": ("A114", "M122", "M123", "P103"),
    "how far the conditions may be off": ("E119", "E124"),
}
"""What a simulation does not look at, and the codes, or the family, of the rules about it."""
_JUDGED = ("E100", "E101", "E109", "T107")
"""Codes of what a simulation judges itself, of what is flown in it: S131 and S127."""
_OF_NO_FLIGHT = ("X904", "X909")
"""Codes that depend on the energy of a mission, or on terrain, which a flight that stands for it has not."""

SWARM_VEHICLE = Rule(
    "S142 swarm-vehicle-unsuited",
    Severity.ERROR,
    summary="A vehicle of a simulated swarm is flown with what its model does not know, or cannot do, or "
    "does not fly its mission as simulated.",
    why="Agents move, stop and draw power by their models: beyond these nobody knows whether they keep apart "
    "and come home.  A mission that its autopilot does not start, or flies otherwise, is not what was "
    "simulated.",
    how="What a check finds of vehicle, battery and weather (lift, wind, range of the model) on a flight of "
    "eight headings at the height and the speed of the swarm, or on the mission as filed, as severe as "
    "there; and every other error of that check, but for what S133 names and what the simulation judges "
    "itself.",
    fix="give a model that knows what is flown, or fly with less load, less wind or slower",
    instead="a model that knows it, or what the model knows",
)


class VehicleCheck(NamedTuple):
    """What a check comes to of one agent."""

    name: str
    result: CheckResult | UnreadableMission
    is_filed: bool = False
    """Whether it flies that mission itself, not one that stands for what it does."""

    @property
    def uncounted(self) -> float:
        """What flights may take beyond their energy, as its model does not know. [-]"""
        if not isinstance(self.result, CheckResult) or self.result.assessment is None:
            return 0.0
        assessment = self.result.assessment
        energy_wh = assessment.totals.energy_wh
        return assessment.uncounted.flown_wh / energy_wh if energy_wh > 0.0 else 0.0


def check_vehicle(setup: Setup, pad: Pad, *, height_m: float, speed_m_s: float) -> CheckResult:
    """Check a vehicle on a flight that stands for all an agent may do: eight legs all round."""
    home = Home(pad.latitude_deg, pad.longitude_deg, pad.amsl_m)
    items = [_item(Command.NAV_TAKEOFF, home, height_m)]
    place = (home.latitude_deg, home.longitude_deg)
    for number in range(_HEADINGS):
        angle_deg = 360.0 * number / _HEADINGS
        latitude_deg, longitude_deg = latitude_longitude_deg(*place, _LEG_S * speed_m_s, angle_deg)
        place = float(latitude_deg), float(longitude_deg)
        items.append(_item(Command.NAV_WAYPOINT, home, height_m, place))
    items.append(_item(Command.NAV_RETURN_TO_LAUNCH, home, 0.0, (0.0, 0.0)))
    mission = Mission(
        source="swarm", file_format=MissionFormat.PLAN, items=numbered_in_order(items), home=home
    )
    return check_mission(mission, replace(setup, terrain=None))


def _item(
    command: Command, home: Home, height_m: float, place: tuple[float, float] | None = None
) -> MissionItem:
    latitude_deg, longitude_deg = place or (home.latitude_deg, home.longitude_deg)
    is_return = command is Command.NAV_RETURN_TO_LAUNCH
    frame = Frame.MISSION if is_return else Frame.GLOBAL_RELATIVE_ALT
    return MissionItem(
        int(command), int(frame), 0.0, 0.0, 0.0, None, latitude_deg, longitude_deg, height_m
    )


def vehicle_findings(checks: Iterable[VehicleCheck]) -> Iterator[Finding]:
    """Yield what was found of agents, each finding once for all it is made of."""
    found: dict[tuple[str, Severity, str | None], list[str]] = {}
    for one in checks:
        for finding in _found_of(one):
            names = found.setdefault(finding, [])
            if one.name not in names:
                names.append(one.name)
    for (message, severity, fix), names in found.items():
        yield SWARM_VEHICLE.finding(f"{', '.join(names)}: {message}", severity=severity, fix=fix)


def _found_of(check: VehicleCheck) -> Iterator[tuple[str, Severity, str | None]]:
    """Yield message, severity and remedy of each finding that matters; ``None``: the remedy of the rule."""
    if not isinstance(check.result, CheckResult):
        first = check.result.findings[0]
        yield first.message, Severity.ERROR, first.fix
        return
    for finding in check.result.findings:
        message, is_of_vehicle = finding.message, finding.code in _MATTERS
        if is_of_vehicle and finding.severity >= Severity.WARNING:
            if not check.is_filed:  # places and energy are those of a flight that nobody flies
                message = message.replace(f" at item {finding.item}", "")
            if not check.is_filed or finding.severity is Severity.WARNING:  # alike of all sorties
                message = message.replace(finding.of_flight, "")
        elif finding.severity < Severity.ERROR or not _changes_flight(finding, check):
            continue
        elif check.is_filed and finding.item is not None:
            message = f"item {finding.item}: {message}"
        yield (
            f"{message} ({finding.code})",
            finding.severity,
            None if is_of_vehicle else finding.fix,
        )


def _changes_flight(finding: Finding, check: VehicleCheck) -> bool:
    """Return whether an error means that something else is flown than what is simulated."""
    if not check.is_filed and finding.code in _OF_NO_FLIGHT:
        return False
    code = (
        finding.about or finding.code
    )  # of what could not be judged it depends whether that matters
    left_out = (one for codes in LEFT_OUT.values() for one in codes)
    return not code.startswith((*left_out, *_JUDGED))


class PadStay(NamedTuple):
    """One agent on the ground, from when until when."""

    name: str
    vehicle: str
    place_m: FloatArray
    """East and north. (2,) [m]"""
    begin_s: float
    end_s: float
    moves_s: float
    """When it takes off, or lands. [s]"""
    error_m: float
    """How wrong its place may be. [m]"""


def ground_findings(fleet: Fleet, stays: Sequence[PadStay]) -> Iterator[Finding]:
    """Yield agents that take off or land beside others on the ground: S116, as of missions."""
    separation = fleet.separation
    ground_m = None if separation is None else separation.ground_m
    for one, other in combinations(stays, 2):
        begin_s, end_s = max(one.begin_s, other.begin_s), min(one.end_s, other.end_s)
        moves_s = [stay.moves_s for stay in (one, other) if begin_s <= stay.moves_s <= end_s]
        errors_m = one.error_m + other.error_m
        required_m = max(errors_m if ground_m is None else ground_m, _TOUCH_M)
        apart_m = float(np.hypot(*(one.place_m - other.place_m)))
        if one.vehicle == other.vehicle or not moves_s or apart_m >= required_m:
            continue
        yield GROUND_SEPARATION.finding(
            f"{one.name} and {other.name}: {quantity.beside(apart_m, required_m, quantity.distance)} "
            f"apart on the ground at {quantity.clock(min(moves_s))}; {quantity.distance(required_m)} required"
        )
