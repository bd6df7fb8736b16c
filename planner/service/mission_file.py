"""Mission files checked, and reasons why one cannot be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.errors import MissionFileError, NoMissionFileError, OtherVehicleError
from planner.findings import Rule, Severity
from planner.mission.files import read_mission
from planner.service.judgement import check
from planner.service.result import UnreadableMission
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from planner.mission.items import Mission
    from planner.service.request import CheckRequest
    from planner.service.result import CheckResult
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.files import ParameterSet


def read_request(
    request: CheckRequest, *, parameters: ParameterSet | None = None
) -> tuple[VehicleModel, dict[str, Any]]:
    """Return the vehicle of a request and what it asks for, as `planner.check` takes it.

    Parameters
    ----------
    request : CheckRequest
        What missions are checked against.
    parameters : ParameterSet, optional
        The vehicle's own, where the request names no file of them.

    Raises
    ------
    InputError, UsageError
        If a file it names is unusable.
    """
    vehicle = load_vehicle(request.vehicle)
    if request.parameters is not None:
        from planner.vehicle.parameters.files import read_parameters

        parameters = read_parameters(request.parameters)
    terrain = None
    if request.terrain:
        from planner.geo.terrain import read_terrain

        terrain = read_terrain(*request.terrain)
    profile = None
    if request.profile is not None:
        from planner.site_profile import read_profile

        profile = read_profile(request.profile)
    selection = request.selection
    if request.baseline is not None:
        from planner.selection import read_baseline

        selection = replace(selection, baseline=read_baseline(request.baseline))
    return vehicle, {
        "battery": request.battery,
        "charge": request.charge,
        "reserve": request.reserve,
        "risk": request.risk,
        "wind": request.conditions.wind,
        "payload_kg": request.conditions.payload_spread_kg,
        "temperature_c": request.conditions.temperature_spread_c,
        "position_noise_m": request.conditions.position_noise_m,
        "battery_health": request.conditions.battery_health,
        "battery_resistance_factor": request.conditions.battery_resistance_factor,
        "battery_temperature_c": request.conditions.battery_temperature_c,
        "reaction_time_s": request.conditions.reaction_time_s,
        "position_error_m": request.conditions.position_error_m,
        "home_amsl_m": request.conditions.home_amsl_m,
        "speed_m_s": request.speed_m_s,
        "autopilot": request.autopilot,
        "parameters": parameters,
        "terrain": terrain,
        "clearance_m": request.clearance_m,
        "target": request.target,
        "profile": profile,
        "selection": selection,
        "fail_on": request.fail_on,
        "with_trace": request.with_trace,
    }


def check_file(path: Path | str, request: CheckRequest) -> CheckResult | UnreadableMission:
    """Read a mission and check it; one that cannot be read is a result too.

    Raises
    ------
    InputError, UsageError
        If the vehicle or the request is unusable: no mission could be checked with it.
    """
    return check_read(lambda: read_mission(path), request, file=str(path))


FILE_UNREADABLE = Rule(
    "X901 file-unreadable",
    Severity.ERROR,
    summary="The mission file could not be read.",
    why="A mission that cannot be read cannot be judged; it is never a 'go'.",
    how="The reader refused the file; the message gives where and why.  The exit code is 2.",
    fix="correct the file, or save it again with the program that wrote it",
)


def check_read(
    read: Callable[[], Mission],
    request: CheckRequest,
    *,
    file: str,
    parameters: ParameterSet | None = None,
) -> CheckResult | UnreadableMission:
    """Check a mission wherever it comes from; one that cannot be read is a result too.

    Parameters
    ----------
    read : callable
        Returns the mission, or raises ``MissionFileError``.
    request : CheckRequest
        What it is checked against.
    file : str
        What the result calls the mission, where it cannot be read.
    parameters : ParameterSet, optional
        The vehicle's own, where the request names no file of them.

    Raises
    ------
    InputError, UsageError
        If the vehicle or the request is unusable: no mission could be checked with it.
    """
    vehicle, options = read_request(request, parameters=parameters)
    try:
        return check(read(), vehicle, **options)
    except MissionFileError as error:
        fix = None
        if isinstance(error, OtherVehicleError):
            fix = "give a multicopter's mission"
        elif isinstance(error, NoMissionFileError):
            fix = "give the path of a mission file that can be read"
        # The report names the file and the place itself.
        message = str(error) if error.source != file else error.message
        if error.source == file and error.key is not None:
            message = f"{error.key}: {message}"
        finding = FILE_UNREADABLE.finding(message, place=error.place, fix=fix)
        return UnreadableMission(file=file, findings=(finding,))
