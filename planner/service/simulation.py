"""A simulated vehicle that flies what the planner predicts, for tests, demos and trying things out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import LogFileError, MavjouleError
from planner.flight.budget import battery_temperature_c
from planner.link.signing import Signer, read_signing_key
from planner.mission.items import Home
from planner.service.preflight import check_mission
from planner.simulator.faults import Faults
from planner.simulator.flown import fly_prediction
from planner.simulator.setup import FIRMWARE, StoredLog, make_parameters, make_setup
from planner.simulator.vehicle import SimulatedVehicle
from planner.simulator.wire import SimulatedWire, SimulationRunner
from planner.values import Value, replace

if TYPE_CHECKING:
    from pathlib import Path

    from planner.link.address import LinkAddress
    from planner.mission.items import Mission
    from planner.setup import Setup
    from planner.simulator.flown import FlownMission


_LOG_PATHS = {
    Autopilot.PX4: "/fs/microsd/log/2026-01-{:02d}/12_00_00.ulg",
    Autopilot.ARDUPILOT: "/APM/LOGS/{:08d}.BIN",
}
_LOG_CONTENT = b"a log of a simulated vehicle: give --log to have a real one here\n" * 100
_FIRST_LOG_S = 1_767_268_800
"""2026-01-01 12:00 UTC. [s since 1970]"""
_DAY_S = 86_400


class SimulationRequest(Value):
    """What is simulated."""

    autopilot: Autopilot
    setup: Setup
    """The model that flies, and in what conditions."""
    speed_up: float = 1.0
    """Seconds of flight in a second of the clock. [-]"""
    faults: Faults = Faults()
    system: int = 1
    authoriser: int | None = None
    """System id of who is asked before it arms (PX4); ``None``: nobody."""
    logs: tuple[Path, ...] = ()
    """Flight logs that it is to have; none: one that holds nothing of use."""
    signing_key: Path | None = None
    """File with the key that it signs by, and hears nothing without; ``None``: it signs nothing."""


def make_simulated_vehicle(mission: Mission, request: SimulationRequest) -> SimulatedVehicle:
    """Return a vehicle that flies a mission, until another is uploaded.

    Raises InputError or UsageError if the model, the parameters or a log is unusable, or an item cannot
    be sent.
    """
    autopilot = request.autopilot
    model = request.setup.vehicle
    given = dict(model.parameters) if model.reference is autopilot else {}
    if request.setup.parameters is not None:
        given |= request.setup.parameters.numbers()
    target = request.setup.target
    version = FIRMWARE[autopilot]
    if target is not None and target.autopilot is autopilot and target.version is not None:
        version = (*target.version, 0)
    setup = make_setup(
        mission,
        autopilot,
        home=_home(mission, request),
        parameters=make_parameters(
            autopilot,
            version[:2],
            given=given,
            battery=request.setup.flown_pack.battery,
            system=request.system,
            authoriser=request.authoriser,
        ),
        system=request.system,
        version=version,
    )
    wind = request.setup.wind
    setup = replace(
        setup,
        logs=_read_logs(request),
        wind=wind if wind.speed_m_s > 0.0 else None,
        misbehaviour=request.faults.vehicle,
    )
    return SimulatedVehicle(
        setup, lambda held: predict_flown(held, request), speed_up=request.speed_up
    )


def make_simulated_wire(vehicle: SimulatedVehicle, request: SimulationRequest) -> SimulatedWire:
    """Return a vehicle at the end of a line with the faults that are asked for."""
    key = request.signing_key
    return SimulatedWire(
        vehicle,
        request.faults.line,
        predict=lambda held: predict_flown(held, request),
        signer=None if key is None else Signer(read_signing_key(key)),
    )


def open_simulation(
    vehicle: SimulatedVehicle, request: SimulationRequest, address: LinkAddress
) -> tuple[SimulationRunner, SimulatedWire]:
    """Return a vehicle on a real line.

    `LinkError` where the line cannot be opened, `UsageError` where pymavlink is not installed.
    """
    wire = make_simulated_wire(vehicle, request)
    return SimulationRunner(wire, address), wire


def predict_flown(mission: Mission, request: SimulationRequest) -> FlownMission | None:
    """Return the predicted flight of a mission; ``None`` where there is none to fly."""
    setup = request.setup
    if setup.vehicle.reference is Autopilot.STEP:  # the model's own way, whoever it speaks as
        setup = replace(setup, autopilot=None, target=None, with_trace=True)
    else:
        setup = replace(setup, autopilot=request.autopilot, with_trace=True)
    try:
        result = check_mission(mission, setup)
    except MavjouleError:
        return None
    assessment = result.assessment
    if assessment is None or result.trace is None:
        return None
    return fly_prediction(
        assessment.flight,
        assessment.route,
        result.trace,
        battery=assessment.pack,
        discharge=assessment.discharge,
        charge=assessment.charge,
        temperature_c=battery_temperature_c(assessment.setup, assessment.flight),
    )


def _home(mission: Mission, request: SimulationRequest) -> Home | None:
    """Return where the predicted flight begins; ``None`` where nothing is flown."""
    flown = predict_flown(mission, request)
    if flown is None:
        return None
    start = flown.state_at(0.0)
    return Home(
        latitude_deg=round(start.latitude_deg, 7),
        longitude_deg=round(start.longitude_deg, 7),
        altitude_amsl_m=flown.route.home_amsl_m,
    )


def _read_logs(request: SimulationRequest) -> tuple[StoredLog, ...]:
    contents = [_read_log(log) for log in request.logs] or [_LOG_CONTENT]
    return tuple(
        StoredLog(
            path=_LOG_PATHS[request.autopilot].format(number),
            content=content,
            time_utc_s=_FIRST_LOG_S + (number - 1) * _DAY_S,
        )
        for number, content in enumerate(contents, 1)
    )


def _read_log(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        msg = f"cannot be read: {error.strerror or error}"
        raise LogFileError(msg, source=str(path)) from error
