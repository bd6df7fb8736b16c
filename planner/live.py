"""The use cases with a vehicle on the line, called alike by the command line and by scripts."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING

from planner import numbers
from planner.catalogue.vehicle import CHARGE_NOT_TOLD, CONDITIONS_FROM_VEHICLE
from planner.errors import OutputError, UsageError
from planner.frozen import frozen
from planner.link.pymavlink_link import open_vehicle
from planner.link.settings import LinkSettings
from planner.link.snapshot import fetch_snapshot, parameter_set, parameter_text
from planner.mission.conversion import convert_mission
from planner.mission.items import MissionFormat
from planner.output_file import write_output_files
from planner.service import check_read

if TYPE_CHECKING:
    from pathlib import Path

    from planner.link.address import LinkAddress
    from planner.link.pymavlink_link import OnProgress
    from planner.link.vehicle import VehicleSnapshot
    from planner.service import CheckRequest, CheckResult, UnreadableMission


@frozen
class LinkRequest:
    """Which vehicle to speak to, and how patiently."""

    address: LinkAddress
    settings: LinkSettings = LinkSettings()
    system: int | None = None
    """System id; ``None``: the only vehicle on the line."""


def _silent(what: str, done: int, count: int | None) -> None:
    """Hear of progress and say nothing."""


def fetch_vehicle(request: LinkRequest, *, on_progress: OnProgress = _silent) -> VehicleSnapshot:
    """Return everything that a vehicle tells of itself.

    Raises
    ------
    LinkError
        If no vehicle answers, or a transfer stalls.
    UsageError
        If a library is missing.
    """
    link = open_vehicle(
        request.address,
        settings=request.settings,
        system=request.system,
        on_progress=on_progress,
    )
    with closing(link):
        return fetch_snapshot(link, address=request.address.text)


def refuse_existing(*paths: Path) -> None:
    """Raise ``UsageError`` where one of the files is there already."""
    for path in paths:
        if path.exists():
            msg = f"{path} is there already: give --force to replace it, or another name"
            raise UsageError(msg)


def write_snapshot(snapshot: VehicleSnapshot, plan: Path, parameters: Path) -> None:
    """Write what was read from a vehicle: both files or none.

    Parameters
    ----------
    snapshot : VehicleSnapshot
        As `fetch_vehicle` returns it.
    plan, parameters : Path
        A plan with mission, fence, rally points and home, and QGroundControl's parameter file.

    Raises
    ------
    OutputError
        If one cannot be written; the other is as it was before then.
    """
    if plan.resolve() == parameters.resolve():
        msg = f"{plan}: plan and parameters need a file each"
        raise OutputError(msg)
    conversion = convert_mission(snapshot.mission, MissionFormat.PLAN)
    write_output_files({plan: conversion.text, parameters: parameter_text(snapshot)})


def check_vehicle(
    snapshot: VehicleSnapshot,
    request: CheckRequest,
    *,
    is_charge_given: bool = False,
) -> CheckResult | UnreadableMission:
    """Check the mission on a vehicle with its own parameters, charge and home.

    Parameters
    ----------
    snapshot : VehicleSnapshot
        As `fetch_vehicle` returns it.
    request : CheckRequest
        What it names counts more than what the vehicle says.
    is_charge_given : bool
        Whether the charge of the request was meant, and is not its default.
    """
    identity, state = snapshot.identity, snapshot.state
    findings = list(snapshot.findings)
    taken: list[str] = []
    if not is_charge_given:
        told = None if state.battery is None else state.battery.remaining_fraction
        if told is None:
            message = "the vehicle does not tell its charge: a full battery is assumed"
            findings.append(CHARGE_NOT_TOLD.finding(message))
        else:
            request = replace(request, charge=told)
            taken.append(f"charge {told * 100:.0f} %")
    conditions = request.conditions
    home = snapshot.mission.home
    if conditions.home_amsl_m is None and home is not None and home.altitude_amsl_m is not None:
        taken.append(f"home {home.altitude_amsl_m:.1f} m AMSL")
    parameters = None
    if request.parameters is None and snapshot.parameters:
        parameters = parameter_set(snapshot)
        taken.append(numbers.count(len(snapshot.parameters), "parameter"))
    if taken:
        message = f"taken from {identity.label}: {', '.join(taken)}"
        findings.append(CONDITIONS_FROM_VEHICLE.finding(message))
    if request.autopilot is None and identity.autopilot is not None:
        request = replace(request, autopilot=identity.autopilot)
    mission = replace(snapshot.mission, findings=(*snapshot.mission.findings, *findings))
    return check_read(lambda: mission, request, file=snapshot.address, parameters=parameters)
