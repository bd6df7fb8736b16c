"""What a flight is predicted from, as its log tells it: mission, parameters, wind."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.catalogue.verification import MISSION_UNTOLD
from planner.errors import LogFileError
from planner.flight.conditions import MOST_NOISE_M
from planner.flight.state import FlightState
from planner.identify.states import find_states
from planner.mission.items import (
    Home,
    Mission,
    MissionFormat,
    MissionItem,
    VehicleEvidence,
    VehicleKind,
)
from planner.physics.wind import Wind
from planner.vehicle.parameters.files import (
    ParameterSet,
    ParameterValue,
)

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.logs.record import FlightRecord, LoggedItem

_RELATIVE_FRAME = 3
"""MAV_FRAME_GLOBAL_RELATIVE_ALT."""
_LEAST_WIND_SHARE = 0.5
"""Share of the time in the air the wind must be known for. [-]"""
_HORIZONTAL = frozenset((FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE))
_VERSION = re.compile(r"(\d+)\.(\d+)")
_NOTHING = MissionItem(
    command=197,
    frame=2,
    param1=None,
    param2=None,
    param3=None,
    param4=None,
    latitude_deg=None,
    longitude_deg=None,
    altitude_m=None,
)
"""DO_SET_ROI_NONE, for an item that is not logged, so that the others keep their numbers."""


def flown_mission(record: FlightRecord) -> Mission:
    """Return the mission of a flight, from its log alone.

    Parameters
    ----------
    record : FlightRecord
        A flight whose log holds the mission.

    Returns
    -------
    Mission
        Home is where the vehicle was armed; items that are not logged do nothing, which is told.

    Raises
    ------
    LogFileError
        If the log holds no mission.
    """
    if not record.mission_items:
        msg = "holds no mission: give the one flown with --mission"
        raise LogFileError(msg, source=record.source)
    told = {item.item: item for item in record.mission_items}
    numbers = range(1, max(told) + 1)
    return Mission(
        source=record.source,
        file_format=MissionFormat.PLAN,
        items=tuple(_item(told.get(number)) for number in numbers),
        home=flown_home(record),
        autopilot=record.autopilot,
        vehicle=VehicleEvidence(
            kind=VehicleKind.MULTICOPTER, is_certain=True, reason="it is the mission of a log"
        ),
        findings=tuple(_findings(record, [n for n in numbers if n not in told])),
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


def _item(item: LoggedItem | None) -> MissionItem:
    if item is None:
        return _NOTHING
    return MissionItem(
        command=item.command,
        frame=_RELATIVE_FRAME if item.frame is None else item.frame,
        param1=item.param1,
        param2=item.param2,
        param3=item.param3,
        param4=item.param4,
        latitude_deg=item.latitude_deg,
        longitude_deg=item.longitude_deg,
        altitude_m=item.altitude_m,
    )


def _findings(record: FlightRecord, missing: list[int]) -> list[Finding]:
    found = []
    if missing:
        which = f"item {missing[0]}"
        which += " is" if len(missing) == 1 else f" and {len(missing) - 1} more are"
        found.append(
            MISSION_UNTOLD.finding(f"{record.source}: {which} not in the log: taken to do nothing")
        )
    if any(item.frame is None for item in record.mission_items):
        found.append(
            MISSION_UNTOLD.finding(
                f"{record.source}: the log tells no altitude frames: heights above home are assumed"
            )
        )
    return found


def flown_parameters(record: FlightRecord) -> ParameterSet | None:
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
    """Return the mean wind in the air; ``None`` where the log does not tell it."""
    in_air = ~record.is_landed
    north, east = record.wind_north_m_s[in_air], record.wind_east_m_s[in_air]
    known = np.isfinite(north) & np.isfinite(east)
    if not known.any() or known.mean() < _LEAST_WIND_SHARE:
        return None
    to_north, to_east = float(north[known].mean()), float(east[known].mean())
    return Wind(
        speed_m_s=float(np.hypot(to_north, to_east)),
        from_deg=float(np.degrees(np.arctan2(-to_east, -to_north)) % 360.0),
    )


def flown_position_noise_m(record: FlightRecord) -> float:
    """Return the mean horizontal error of the position that PX4 slows its time down by.

    Taken while the vehicle hovers or moves only vertically, where the reference stands still.

    Returns
    -------
    float
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
    return min(float(errors.mean()), MOST_NOISE_M) if errors.size else 0.0
