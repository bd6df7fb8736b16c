"""The use cases with a vehicle on the line, called alike by the command line and by scripts."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import OutputError, UsageError
from planner.files import write_output_files
from planner.findings import Rule, Severity
from planner.link.mission import MissionKind, mission_of_lists
from planner.link.snapshot import fetch_mark, fetch_snapshot, parameter_set, parameter_text
from planner.link.telemetry import homes_apart_m
from planner.link.vehicle import open_link, silent
from planner.mission.commands import TERRAIN_FRAMES
from planner.mission.compare import compare_missions
from planner.mission.convert import convert_mission
from planner.mission.items import MissionFormat
from planner.quantity import mean_of
from planner.rules.altitude import planned_elsewhere
from planner.rules.battery import BATTERY_VOLTAGE_DIFFERS
from planner.service.preflight import CheckResult, check_read
from planner.values import Value, replace
from planner.vehicle.pack import measured_voltage_fits, rest_curve
from planner.vehicle.parameters.table import parameter_names

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

    from planner.findings import Finding
    from planner.link.logs import DownloadedLog, VehicleLog
    from planner.link.snapshot import VehicleSnapshot
    from planner.link.telemetry import BatteryState
    from planner.link.vehicle import LinkRequest, OnProgress
    from planner.mission.compare import Difference
    from planner.mission.items import Home, Mission
    from planner.service.preflight import UnreadableMission
    from planner.setup import Setup
    from planner.vehicle.battery import Battery
    from planner.vehicle.pack import ShownCharge


def fetch_vehicle(request: LinkRequest, *, on_progress: OnProgress = silent) -> VehicleSnapshot:
    """Return everything that a vehicle reports of itself."""
    with open_link(request, on_progress=on_progress) as link:
        return fetch_snapshot(link)


def refuse_existing(*paths: Path) -> None:
    """Raise ``UsageError`` where one of the files is there already."""
    for path in paths:
        if path.exists():
            msg = f"{path} exists: give --force to replace it, or another name"
            raise UsageError(msg)


def write_snapshot(snapshot: VehicleSnapshot, plan: Path, parameters: Path) -> None:
    """Write what was read from a vehicle: plan and QGroundControl's parameter file, or neither.

    `OutputError` where one cannot be written; the other is as it was before then.
    """
    if plan.resolve() == parameters.resolve():
        msg = f"{plan}: plan and parameters need a file each"
        raise OutputError(msg)
    mark = fetch_mark(snapshot, _now())
    conversion = convert_mission(replace(snapshot.mission, fetched=mark), MissionFormat.PLAN)
    write_output_files({plan: conversion.text, parameters: parameter_text(snapshot, mark)})


def _now() -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


CONDITIONS_FROM_VEHICLE = Rule(
    "V101 conditions-from-vehicle",
    Severity.INFO,
    summary="Charge, heading, home and parameters are the vehicle's own.",
    why="The verdict holds for the vehicle as it is now: a changed battery or a new home requires "
    "another check.",
    how="Mission, fence, rally points, parameters, battery, heading and home are read over MAVLink.",
    fix="give --charge or --heading to check with others; fetch the mission and check the file with --params "
    "or --home-amsl",
)

SETTING_NOT_USED = Rule(
    "V110 setting-not-used",
    Severity.WARNING,
    summary="A parameter file or an altitude of home was given that is not the vehicle's.",
    why="The vehicle flies by what it holds: a parameter file of the morning, or of its sister, says nothing "
    "of how it returns, what its failsafes do and where its fence is.",
    how="--params, where the vehicle's own parameters were read and the file has another value of one that a "
    "check reads; --home-amsl more than 0.5 m off the home that the vehicle reports, from which it counts "
    "heights above sea level.  The vehicle's own count in any case.",
    fix="leave it away, or fetch the mission and check the file with it",
)
_SAME_LEVEL_M = 0.5
"""Homes that differ by less in height are one. [m]"""
_NAMED = 3
"""Parameters that are named, at most."""
_SAME_NUMBER = 1e-6
"""Numbers this near are one: vehicles hold them in single precision. [-]"""

CHARGE_NOT_TOLD = Rule(
    "V102 charge-not-told",
    Severity.WARNING,
    summary="The vehicle does not report the charge of its battery.",
    why="The check then assumes a full battery, which is not measured.",
    how="Neither BATTERY_STATUS nor SYS_STATUS holds a battery_remaining from 0 to 100.",
    fix="measure the battery and give --charge; set the battery's capacity in the autopilot",
)

CHARGE_BELOW_GIVEN = Rule(
    "V109 charge-below-given",
    Severity.ERROR,
    summary="The vehicle reports less charge than the check was told.",
    why="A charge typed in the morning is that of another battery by noon; a guard that goes on by it lets "
    "half empty batteries take off.",
    how="The charge of --charge against battery_remaining of BATTERY_STATUS or SYS_STATUS, and against what "
    "the voltage says of a disarmed vehicle (V115); 10 % of the full charge less is allowed, as estimates by "
    "voltage are off.",
    fix="leave --charge away, so that the vehicle's own counts, or correct what the autopilot takes for full "
    "and empty",
    instead="the charge that the vehicle reports, without --charge",
)
CHARGE_BY_VOLTAGE = Rule(
    "V115 charge-by-voltage",
    Severity.WARNING,
    summary="The voltage of the vehicle's battery says clearly less charge than the vehicle does.",
    why="ArduPilot counts from 100 % whenever it is switched on: a half-used battery that was plugged in is "
    "a full one to it (AP_BattMonitor.cpp, capacity_remaining_pct: BATT_CAPACITY less what was counted).",
    how="Disarmed (a guard: before it armed), the voltage of BATTERY_STATUS or SYS_STATUS, with the drop of "
    "the current over the battery's resistance, is read on the open-circuit curve, as that of --charge "
    "24.0V is.  More than 10 % of the full charge below battery_remaining, or below the full battery that is "
    "assumed without it, it counts.  Granted before: 1 % of the voltage, which voltmeters, the cold and a "
    "flight just landed take off; and, where the curve is only that of a kind of cell, as with a label, that "
    "it is the other kind, lithium-ion or lithium-polymer.  Not of a battery without a curve; another "
    "battery is E121.",
    fix="charge the battery, or, where it is full, calibrate the voltage that the autopilot measures "
    "(BATT_VOLT_MULT, BAT1_V_DIV)",
)
_CHARGE_SLACK = 0.1
"""A charge estimated by voltage is as far off without anything being wrong. [-]"""


def check_vehicle(
    snapshot: VehicleSnapshot,
    setup: Setup,
    *,
    mission: Mission | None = None,
    is_charge_given: bool = False,
) -> CheckResult | UnreadableMission:
    """Check a mission, by default the one on the vehicle, with the vehicle's own conditions.

    Its parameters and home count more than what the setup names (`SETTING_NOT_USED`), its charge and heading
    less; a charge only if it was given and is not the default.
    """
    identity, state = snapshot.identity, snapshot.state
    findings = [*snapshot.findings, *_unused_settings(snapshot, setup)]
    if setup.battery is None and setup.vehicle.battery is None:
        findings += check_capacity(snapshot)
    taken: list[str] = []
    unlike = check_voltage(snapshot, setup)
    findings += unlike
    shown = None if unlike else _shown_charge(snapshot, setup)
    if is_charge_given:
        findings += _check_charge(snapshot, shown, mean_of(setup.charge))
    else:
        charge, told = _told_charge(snapshot, shown)
        findings += told
        if charge is not None:
            setup = replace(setup, charge=charge)
            taken.append(f"charge {charge * 100:.0f} %")
    position = state.position
    if setup.heading_deg is None and not state.is_armed and position is not None:
        setup = replace(setup, heading_deg=position.heading_deg)
        taken += [] if position.heading_deg is None else [f"heading {position.heading_deg:.0f}°"]
    home = snapshot.mission.home
    if home is not None and home.altitude_amsl_m is not None:
        setup = replace(setup, home_amsl_m=None)
        taken.append(f"home {home.altitude_amsl_m:.1f} m AMSL{_moved(home, state.home)}")
    if snapshot.parameters:
        setup = replace(setup, parameters=parameter_set(snapshot))
        taken.append(quantity.count(len(snapshot.parameters), "parameter"))
    if taken:
        message = f"taken from {identity.label}: {', '.join(taken)}"
        findings.append(CONDITIONS_FROM_VEHICLE.finding(message))
    own = snapshot.mission if mission is None else mission
    findings += check_terrain(own, snapshot)
    judged = replace(own, findings=(*own.findings, *findings))
    if mission is not None and setup.home_amsl_m is None and home is not None:
        elsewhere = planned_elsewhere(mission.home, home)
        judged = replace(judged, home=home, findings=(*judged.findings, *elsewhere))
    file = snapshot.address if mission is None else mission.source
    return check_read(lambda: judged, setup, file=file)


def _unused_settings(snapshot: VehicleSnapshot, setup: Setup) -> Iterator[Finding]:
    """Yield what the setup names and the vehicle reports otherwise, but for its charge."""
    vehicle, home, given = snapshot.identity.label, snapshot.mission.home, setup.parameters
    if given is not None and snapshot.parameters:
        from planner.vehicle.parameters.resolve import PARAMETERS_OF

        held = parameter_set(snapshot)
        own, typed = held.numbers(), given.numbers()
        table = None if held.stack is None else PARAMETERS_OF.get(held.stack)
        read = frozenset[str]() if table is None else parameter_names(table)
        others = [
            f"{name} {own[name]:g} ({typed[name]:g})"
            for name in sorted(own.keys() & typed.keys() & read)
            if not math.isclose(own[name], typed[name], rel_tol=_SAME_NUMBER)
        ]
        if others:
            more = f" and {len(others) - _NAMED} more" if len(others) > _NAMED else ""
            yield SETTING_NOT_USED.finding(
                f"{given.source} is not used: {vehicle} holds {', '.join(others[:_NAMED])}{more}"
            )
    typed_m, own_m = setup.home_amsl_m, None if home is None else home.altitude_amsl_m
    if typed_m is not None and own_m is not None and abs(typed_m - own_m) > _SAME_LEVEL_M:
        yield SETTING_NOT_USED.finding(
            f"--home-amsl {quantity.height(typed_m)} is not used: {vehicle} reports its home at "
            f"{quantity.height(own_m)} AMSL"
        )


def _reported_charge(snapshot: VehicleSnapshot) -> float | None:
    battery = snapshot.state.battery
    return None if battery is None else battery.remaining_fraction


def _check_charge(
    snapshot: VehicleSnapshot, shown: ShownCharge | None, given: float
) -> Iterator[Finding]:
    """Yield that a vehicle reports less charge than was given, or its voltage says so."""
    vehicle, typed, least = snapshot.identity.label, quantity.percent(given), given - _CHARGE_SLACK
    reported = _reported_charge(snapshot)
    if reported is not None and reported < least:
        message = f"{vehicle} reports {quantity.percent(reported)} charge, --charge is {typed}"
        yield CHARGE_BELOW_GIVEN.finding(message)
    elif shown is not None and shown.most < least:
        message = f"{vehicle} measures {_by_voltage(shown)}; --charge is {typed}"
        yield CHARGE_BELOW_GIVEN.finding(message)


def _told_charge(
    snapshot: VehicleSnapshot, shown: ShownCharge | None
) -> tuple[float | None, tuple[Finding, ...]]:
    """Return the charge that a vehicle tells, ``None`` for none, and what is wrong with it."""
    vehicle, reported = snapshot.identity.label, _reported_charge(snapshot)
    full = 1.0 if reported is None else reported
    if shown is not None and shown.most < full - _CHARGE_SLACK:
        but = (
            "reports no charge" if reported is None else f"reports {quantity.percent(full)} charge"
        )
        message = f"{vehicle} {but}, but measures {_by_voltage(shown)}, which counts"
        return shown.charge, (CHARGE_BY_VOLTAGE.finding(message),)
    if reported is None:
        message = "charge not reported by the vehicle: full battery assumed"
        return None, (CHARGE_NOT_TOLD.finding(message),)
    return reported, ()


def _by_voltage(shown: ShownCharge) -> str:
    return (
        f"{quantity.voltage(shown.voltage_v)} without load, {quantity.percent(shown.charge)} by the curve of "
        "its battery"
    )


def _shown_charge(snapshot: VehicleSnapshot, setup: Setup) -> ShownCharge | None:
    """Return what the voltage says of the charge while the motors stand; ``None``: nothing."""
    measured, flown = snapshot.state.battery_at_rest, setup.flown_pack
    if measured is None or measured.voltage_v is None or flown.battery is None:
        return None
    return flown.charge_shown(_rest_voltage_v(measured.voltage_v, measured, flown.battery))


def _rest_voltage_v(voltage_v: float, measured: BatteryState, pack: Battery) -> float:
    """Return a voltage without what a current drops: on the ground next to nothing flows. [V]"""
    return voltage_v + (measured.current_a or 0.0) * (pack.new_resistance_ohm or 0.0)


def _moved(home: Home, reported: Home | None) -> str:
    if reported is None or home == reported:
        return ""
    return f" where it stands, {quantity.distance(homes_apart_m(home, reported))} from the home it reports"


def go_objection(
    result: CheckResult | UnreadableMission, *, consented: Collection[str] = ()
) -> str:
    """Return why a result is no go to act on; empty where it is one.

    What is to arm a vehicle, or to be put on it, rests on more than the verdict: a vehicle and a battery
    that are named, energy above the reserve at landing and on the way home, and no error that was asked
    not to be reported, but for the codes whose consequence was consented to.
    """
    if not isinstance(result, CheckResult) or result.verdict != "go":
        return f"the verdict is {result.verdict_text}"
    if not result.setup.is_vehicle_named:
        return "no vehicle is named"
    if result.battery is None:
        return "no battery is known"
    plan = result.return_plan
    for where, margin_wh in (
        ("at landing", result.battery.margin_wh),
        ("on the way home", 0.0 if plan is None or plan.margin_wh is None else plan.margin_wh),
    ):
        if not margin_wh >= 0.0:  # NaN too
            return f"{quantity.energy(margin_wh)} above the reserve {where} is not enough"
    hidden = [
        one
        for one in result.suppressed
        if one.severity is Severity.ERROR and one.code not in consented
    ]
    return f"{hidden[0].code} {hidden[0].name} is {hidden[0].suppression}" if hidden else ""


CAPACITY_NOT_TAKEN = Rule(
    "V108 capacity-not-taken",
    Severity.INFO,
    summary="The vehicle's battery capacity setting is not used as the battery's.",
    why="BAT1_CAPACITY and BATT_CAPACITY are settings: the firmware's 3.3 Ah as often as the "
    "battery's, worn or not, and without a voltage no energy.",
    how="No battery is given, the model has none, and the parameter is above 0.",
    fix="give --battery with the label's figures, such as 5.2Ah@14.8V",
)


def check_capacity(snapshot: VehicleSnapshot) -> tuple[Finding, ...]:
    """Return that the capacity which a vehicle is set to is not the battery's, where it reports one."""
    battery = snapshot.state.battery
    if battery is None or battery.capacity_ah is None:
        return ()
    voltage = "" if battery.voltage_v is None else f", now at {quantity.voltage(battery.voltage_v)}"
    message = (
        f"{snapshot.identity.label} is set to {battery.capacity_ah:g} Ah{voltage}: not used as the "
        "battery, whose nominal voltage is unknown"
    )
    return (CAPACITY_NOT_TAKEN.finding(message),)


TERRAIN_MISSING = Rule(
    "X910 terrain-missing",
    Severity.ERROR,
    summary="The mission counts heights from terrain that the vehicle does not have.",
    why="ArduPilot does not arm for such a mission ('PreArm: waiting for terrain data'); in the air it "
    "reports 'Terrain data missing', and its terrain failsafe returns.",
    how="Items in frame 10 or 11, and blocks of terrain that the vehicle waits for (TERRAIN_REPORT) around "
    "it and its mission.  Only of a vehicle on the line.",
    fix="connect a ground station that sends it terrain, or put the terrain files on its card",
    instead="a vehicle that has the terrain",
)


def check_terrain(mission: Mission, snapshot: VehicleSnapshot) -> tuple[Finding, ...]:
    """Return that a vehicle has not the terrain that a mission's heights are counted from."""
    over = [n for n, item in enumerate(mission.items, 1) if item.frame in TERRAIN_FRAMES]
    if not (over and snapshot.terrain_pending):
        return ()
    blocks = quantity.count(snapshot.terrain_pending, "block")
    message = (
        f"{quantity.count(len(over), 'item')} above terrain; {snapshot.identity.label} waits for {blocks} "
        "of terrain: it will not arm"
    )
    return (TERRAIN_MISSING.finding(message, item=over[0], place=mission.items[over[0] - 1].place),)


def check_voltage(snapshot: VehicleSnapshot, setup: Setup) -> tuple[Finding, ...]:
    """Return that the vehicle measures another voltage than the battery of the check has at its charge."""
    measured, pack = snapshot.state.battery, setup.flown_pack.battery
    if measured is None or measured.voltage_v is None or pack is None:
        return ()
    charge = measured.remaining_fraction
    if charge is None:
        charge = mean_of(setup.charge)
    curve = rest_curve(pack)
    expected_v = pack.voltage_v if curve is None else curve.at(charge)
    rest_v = _rest_voltage_v(measured.voltage_v, measured, pack)
    if expected_v is None or measured_voltage_fits(rest_v, expected_v, pack):
        return ()
    message = (
        f"{snapshot.identity.label} measures {quantity.voltage(measured.voltage_v)}; the battery "
        f"of this check has {quantity.voltage(expected_v)} at {quantity.percent(charge)}"
    )
    return (BATTERY_VOLTAGE_DIFFERS.finding(message),)


class MissionComparison(Value):
    """A mission, and another one that ought to be the same."""

    first: str
    """The file it was meant by."""
    second: str
    """The other file, or the vehicle's normalised address."""
    differences: tuple[Difference, ...]

    @property
    def is_same(self) -> bool:
        """Whether the same flight comes of both."""
        return not any(one.matters for one in self.differences)


def compare_with_vehicle(
    mission: Mission, request: LinkRequest, *, on_progress: OnProgress = silent
) -> MissionComparison:
    """Return what differs between a mission and the one on a vehicle, home left out."""
    with open_link(request, on_progress=on_progress) as link:
        lists = {kind: link.fetch_items(kind) for kind in MissionKind}
        name = request.address.text
        read = mission_of_lists(lists, link.identity, home=mission.home, source=name)
        return MissionComparison(
            first=mission.source,
            second=name,
            differences=compare_missions(mission, read, autopilot=link.identity.autopilot),
        )


def compare_files(first: Mission, second: Mission) -> MissionComparison:
    """Return what differs between the missions of two files, home left out."""
    return MissionComparison(
        first=first.source,
        second=second.source,
        differences=compare_missions(first, second, autopilot=None),
    )


class FetchedLogs(Value):
    """The logs of a vehicle."""

    listed: tuple[VehicleLog, ...]
    downloaded: tuple[DownloadedLog, ...]


def fetch_logs(
    request: LinkRequest,
    *,
    names: Sequence[str] = (),
    is_all: bool = False,
    folder: Path,
    is_replacing: bool = False,
    on_progress: OnProgress = silent,
) -> FetchedLogs:
    """List the logs of a vehicle, and download those of some names, or all.

    Raises LinkError if the vehicle does not answer, or a transfer stalls; what came is kept.
    Raises UsageError if the vehicle has no log of a name.
    Raises OutputError if a file cannot be written.
    """
    from planner.link.logs import download_logs, fetch_log_list

    with open_link(request, on_progress=on_progress) as link:
        listed = fetch_log_list(link)
        known = {log.name for log in listed}
        for name in names:
            if name not in known:
                msg = f"the vehicle has no log {name}: see mavjoule logs {request.address.text}"
                raise UsageError(msg)
        wanted = [log for log in listed if is_all or log.name in names]
        return FetchedLogs(
            listed=listed, downloaded=download_logs(link, wanted, folder, is_replacing=is_replacing)
        )
