"""What a log reports about one flight: columns on one time base, and what was found where."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from planner.findings import Rule, Severity
from planner.values import Value, brief, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.arrays import BoolArray, FloatArray, IntArray, TextArray
    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.logs.series import Series

LOG_DAMAGED = Rule(
    "R101 log-damaged",
    Severity.WARNING,
    summary="Part of a log cannot be read and is left out.",
    why="Logs end in the middle of a message when the battery is pulled, and memory cards lose "
    "sectors; what is left is used, but a model made of it rests on less than the log's length.",
    how="Bytes or rows that are no message of the log's own definitions are counted.",
    fix="copy the log from the vehicle again; if it stays so, read the results with care",
)

BATTERIES_LEFT_OUT = Rule(
    "R106 batteries-left-out",
    Severity.WARNING,
    summary="A log holds the current of more than one battery; only the first is used.",
    why="No log records whether the others feed the motors, share the load or measure the same "
    "current again; the power of the vehicle may be a multiple of the one used.",
    how="Battery monitors other than the first that show more than 0.2 A are counted.",
    fix="if the batteries share the load, do not identify a model from this log",
)


STEP_S = 0.1
"""Time between the samples of a record: the rate autopilots log battery and references at. [s]"""


class LogFormat(StrEnum):
    """The file formats a log comes in."""

    DATAFLASH = "dataflash"
    """ArduPilot's on-board log, binary (``.bin``) or as text (``.log``)."""
    ULOG = "ulog"
    """PX4's on-board log."""
    TLOG = "tlog"
    """MAVLink telemetry with timestamps, as ground stations write it."""
    CSV = "csv"
    """Columns of text, with a mapping of the columns."""


class Boundary(StrEnum):
    """What a flight begins or ends with."""

    ARMING = "arming"
    """The motors were armed, or disarmed: logged as such."""
    POWER = "power"
    """The motors began, or ceased, to draw power: arming is not logged."""
    AIR = "air"
    """Take-off, or landing: neither arming nor power is logged."""
    LOG = "log"
    """The log begins, or ends, with the vehicle armed, in the air or not."""


class LoggedHome(Value):
    """The home of a flight, the origin of its heights and of its local frame."""

    latitude_deg: float | None
    """``None`` for a flight without a global position. [°]"""
    longitude_deg: float | None
    """[°]"""
    altitude_amsl_m: float | None
    """[m AMSL]"""
    found_in: str
    """The message it comes from, or how it was chosen."""


class LoggedItem(Value, kw_only=False):
    """A mission item as the vehicle held it, with MAVLink's seven parameters."""

    item: int
    """From 1, home not counted."""
    command: int
    """MAV_CMD number."""
    frame: int | None
    """MAV_FRAME number; ``None`` where the log has none (ArduPilot before 4.0)."""
    param1: float | None
    param2: float | None
    param3: float | None
    param4: float | None
    latitude_deg: float | None
    longitude_deg: float | None
    altitude_m: float | None
    """In the altitude reference of ``frame``. [m]"""


class LoggedQuantity(Value):
    """A row of the table of what was found where."""

    name: str
    """The column of :class:`FlightRecord`."""
    found_in: str | None
    """Message and fields of the log, or what it is computed from; ``None`` where it is missing."""
    rate_hz: float | None
    """Median rate of the samples in the log; ``None`` where it is missing or known from events."""
    coverage: float
    """Fraction of the flight it is known for, 0 to 1. [-]"""
    absence_cost: str
    """What cannot be done without it; given for every quantity, found or missing."""
    remark: str = ""
    """What is not as it should be: ``BAT.Curr is 0 throughout: no current sensor``."""

    @property
    def is_found(self) -> bool:
        """Whether the log has it at least once."""
        return self.found_in is not None


class FlightRecord(Value, eq=False, weakref=True):
    """One flight, from arming to disarming, the vehicle armed throughout.

    The columns are arrays of one length.  NaN is in a column of numbers wherever the log has
    no value: before the first sample, in a gap, and throughout where the quantity is missing;
    nothing is extrapolated.  Heights and the local frame have their origin at ``home``.

    .. warning:: North, east and **up**: climbs are positive, whatever the sign in the log (NED turns sign).
    """

    __repr__ = brief

    time_s: FloatArray
    """Since the beginning of the flight, every :data:`STEP_S`. [s]"""

    latitude_deg: FloatArray
    longitude_deg: FloatArray
    """In [−180, 180). [°]"""
    altitude_amsl_m: FloatArray
    north_m: FloatArray
    """North of home. [m]"""
    east_m: FloatArray
    height_above_home_m: FloatArray

    velocity_north_m_s: FloatArray
    """Over ground. [m s⁻¹]"""
    velocity_east_m_s: FloatArray
    climb_m_s: FloatArray
    """Vertical speed, positive upwards. [m s⁻¹]"""
    ground_speed_m_s: FloatArray
    airspeed_m_s: FloatArray
    """Horizontal, measured, or from velocity and wind where both are known. [m s⁻¹]"""
    wind_north_m_s: FloatArray
    """Northward velocity of the moving air, as measured or as the autopilot estimates. [m s⁻¹]"""
    wind_east_m_s: FloatArray

    roll_deg: FloatArray
    """Right side down is positive. [°]"""
    pitch_deg: FloatArray
    """Nose up is positive. [°]"""
    yaw_deg: FloatArray
    """Clockwise from north, in [0, 360). [°]"""

    reference_north_m: FloatArray
    """Position the controller was commanded to hold, north of home. [m]"""
    reference_east_m: FloatArray
    reference_height_m: FloatArray
    """Height above home the controller was commanded to hold. [m]"""
    reference_velocity_north_m_s: FloatArray
    reference_velocity_east_m_s: FloatArray
    reference_climb_m_s: FloatArray
    """Positive upwards. [m s⁻¹]"""
    reference_speed_m_s: FloatArray
    """Horizontal speed the controller was commanded to fly, over ground. [m s⁻¹]"""

    voltage_v: FloatArray
    current_a: FloatArray
    power_w: FloatArray
    """Electrical power out of the battery; the mean around each sample where the log has more. [W]"""

    mode: TextArray
    """Flight mode by the autopilot's own name; empty where it is not known."""
    is_landed: BoolArray
    """Whether the vehicle is on the ground."""
    mission_item: IntArray
    """The item being flown, from 1, home not counted; 0 where none is, or none is known."""

    duration_s: float
    """From beginning to end, exactly; the last sample is less than a step before it. [s]"""
    begins_with: Boundary
    ends_with: Boundary
    number: int
    """Which flight of the log it is, from 1."""
    begins_in_log_s: float
    """Beginning of the flight, on the log's own clock. [s]"""

    home: LoggedHome
    mission_items: tuple[LoggedItem, ...]
    """The mission the vehicle held at the end of the flight; empty where it is not logged."""
    parameters: Mapping[str, float]
    """The autopilot's parameters during the flight, by their own names.

    MOT_THST_HOVER, which ArduPilot learns in flight, is the throttle that the hovers of this flight took.
    """
    autopilot: Autopilot | None
    """Whose log it is; ``None`` where it is neither PX4's nor ArduPilot's."""
    firmware: str
    """Name and version as the log has it; empty where it has none."""
    vehicle: str
    """What flew, as far as the log has it (frame, airframe number); empty where it does not."""

    source: str
    """File name as the user gave it."""
    sha256: str
    """Of the file as it is, compressed or not."""
    log_format: LogFormat
    quantities: tuple[LoggedQuantity, ...]
    """A row for every column but the time, in the order of the columns."""
    findings: tuple[Finding, ...] = ()
    """What is odd about this flight or its log; what concerns the whole log, every flight has."""

    def __post_init__(self) -> None:
        lengths = {len(column) for column in self.columns().values()}
        if lengths != {len(self.time_s)}:
            msg = f"the columns of a record must have one length, got {sorted(lengths)}"
            raise ValueError(msg)

    @property
    def step_s(self) -> float:
        """Time between two samples. [s]"""
        return float(self.time_s[1] - self.time_s[0])

    def columns(self) -> dict[str, FloatArray | BoolArray | IntArray | TextArray]:
        """Return the columns by name, time first."""
        values = field_values(self)
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def quantity(self, name: str) -> LoggedQuantity:
        """Return the row of the table about a column."""
        return {row.name: row for row in self.quantities}[name]


_NO_TRACK = "no track: distances and the places of stops are unknown"
_NO_HEIGHT = "climbs, descents and the hover power over height cannot be identified"
_NO_SPEED = "accelerating, cruise and braking cannot be identified"
_NO_AIR = "calm air is assumed: power over speed is that over ground"
_NO_LEAN = "wind cannot be estimated from how the vehicle leans"
_NO_POSITION_REFERENCE = "position errors cannot be separated from the path commanded"
_NO_SPEED_REFERENCE = (
    "the speed response can only be identified against the steps the speed itself suggests"
)
_NO_POWER = "no power and no energy model can be identified, only the motion"

ABSENCE_COSTS: Mapping[str, str] = {
    "latitude_deg": _NO_TRACK,
    "longitude_deg": _NO_TRACK,
    "altitude_amsl_m": "air density is that of the standard atmosphere at the height above home",
    "north_m": _NO_TRACK,
    "east_m": _NO_TRACK,
    "height_above_home_m": _NO_HEIGHT,
    "velocity_north_m_s": "turns and the direction of flight against the wind are unknown",
    "velocity_east_m_s": "turns and the direction of flight against the wind are unknown",
    "climb_m_s": _NO_HEIGHT,
    "ground_speed_m_s": _NO_SPEED,
    "airspeed_m_s": _NO_AIR,
    "wind_north_m_s": _NO_AIR,
    "wind_east_m_s": _NO_AIR,
    "roll_deg": _NO_LEAN,
    "pitch_deg": _NO_LEAN,
    "yaw_deg": _NO_LEAN,
    "reference_north_m": _NO_POSITION_REFERENCE,
    "reference_east_m": _NO_POSITION_REFERENCE,
    "reference_height_m": (
        "the height response can only be identified against the steps the height itself suggests"
    ),
    "reference_velocity_north_m_s": _NO_SPEED_REFERENCE,
    "reference_velocity_east_m_s": _NO_SPEED_REFERENCE,
    "reference_climb_m_s": "the climb rate commanded is known from the height reference only",
    "reference_speed_m_s": _NO_SPEED_REFERENCE,
    "voltage_v": _NO_POWER,
    "current_a": _NO_POWER,
    "power_w": _NO_POWER,
    "mode": "manual flights cannot be distinguished from missions",
    "is_landed": "take-off and landing are found from the heights, to about a second",
    "mission_item": "states cannot be matched with the mission's items",
}
"""Cost by the name of the column, in the order of the columns of a record."""


class LogFile(Value):
    """Which file a recording comes from."""

    source: str
    """File name as the user gave it."""
    sha256: str
    log_format: LogFormat


class Recording(Value, eq=False):
    """Everything a log holds between two restarts of its clock.

    ``series`` holds quantities by the names of the record's columns, as far as the log has them
    directly; the rest is computed.  It may hold these besides, which are no columns:

    ``local_north_m``, ``local_east_m``, ``local_height_m``
        Position in the frame the references are given in, wherever its origin is.
    ``reference_latitude_deg``, ``reference_longitude_deg``, ``reference_altitude_amsl_m``
        References where the log gives them globally.  ``reference_north_m``,
        ``reference_east_m`` and ``reference_height_m`` are in the local frame.
    ``course_deg``
        Direction of the ground speed, where velocities are not logged.
    ``throttle``
        Thrust that ArduPilot asks of its motors, as a fraction of the most: its get_throttle().
    """

    file: LogFile
    begin_s: float
    end_s: float
    series: Mapping[str, Series]
    is_armed: Series | None = None
    """Events 1 and 0; ``None`` where arming is not logged."""
    is_landed: Series | None = None
    """Events 1 and 0; ``None`` where the autopilot's landing detector is not logged."""
    modes: tuple[tuple[float, str], ...] = ()
    """Time and name of each mode entered, in the order of time."""
    modes_found_in: str = ""
    """Message and fields of the modes."""
    mission_item: Series | None = None
    """Events: the item begun, from 1, home not counted; 0 where none is flown any longer."""
    homes: tuple[tuple[float, LoggedHome], ...] = ()
    """Time of each home set, in the order of time."""
    missions: tuple[tuple[float, tuple[LoggedItem, ...]], ...] = ()
    """Time from which each mission is the one on board."""
    parameters: tuple[tuple[float, str, float], ...] = ()
    """Time, name and value of each parameter reported, in the order of the log."""
    autopilot: Autopilot | None = None
    firmware: str = ""
    vehicle: str
    position_jumps: tuple[tuple[float, float], ...] = ()
    """Time and size in metres of each reset of the position estimate, where they are logged."""
    remarks: Mapping[str, str]
    """What to report of a quantity that is not as it should be, by the column's name."""
    findings: tuple[Finding, ...]


def carried_over(runs: Iterable[Recording]) -> tuple[Recording, ...]:
    """Return the runs of one vehicle's clock, each with what a vehicle keeps over a restart.

    Parameters, mission, firmware and frame are reported once; they hold until reported again.
    """
    found: list[Recording] = []
    for run in runs:
        before = found[-1] if found else run
        kept = ((-math.inf, name, value) for _, name, value in before.parameters)
        mission = ((-math.inf, items) for _, items in before.missions[-1:])
        found.append(
            replace(
                run,
                parameters=(*kept, *run.parameters),
                missions=(*mission, *run.missions),
                firmware=run.firmware or before.firmware,
                vehicle=run.vehicle or before.vehicle,
            )
            if found
            else run
        )
    return tuple(found)


AUTO = "AUTO"
"""The mode that flies missions."""

_COPTER_MODES = {
    **dict(enumerate(("STABILIZE", "ACRO", "ALT_HOLD", AUTO, "GUIDED", "LOITER", "RTL", "CIRCLE"))),
    **dict(enumerate(("POSITION", "LAND", "OF_LOITER", "DRIFT"), start=8)),
    **dict(enumerate(("SPORT", "FLIP", "AUTOTUNE", "POSHOLD", "BRAKE", "THROW"), start=13)),
    **dict(enumerate(("AVOID_ADSB", "GUIDED_NOGPS", "SMART_RTL", "FLOWHOLD"), start=19)),
    **dict(enumerate(("FOLLOW", "ZIGZAG", "SYSTEMID", "AUTOROTATE", "AUTO_RTL"), start=23)),
    28: "TURTLE",
}


def copter_mode(number: int) -> str:
    """Return the name of a mode; its number where it has none here."""
    return _COPTER_MODES.get(number, f"mode {number}")


AUTO_MISSION = "AUTO_MISSION"
"""The mode that flies missions."""

_PX4_MODES = {
    **dict(enumerate(("MANUAL", "ALTCTL", "POSCTL", AUTO_MISSION, "AUTO_LOITER", "AUTO_RTL"))),
    6: "POSITION_SLOW",
    8: "ALTITUDE_CRUISE",
    10: "ACRO",
    12: "DESCEND",
    13: "TERMINATION",
    14: "OFFBOARD",
    15: "STAB",
    17: "AUTO_TAKEOFF",
    18: "AUTO_LAND",
    19: "AUTO_FOLLOW_TARGET",
    20: "AUTO_PRECLAND",
    21: "ORBIT",
    22: "AUTO_VTOL_TAKEOFF",
}


def px4_mode(number: int) -> str:
    """Return the name of a mode; its number where it has none here."""
    return _PX4_MODES.get(number, f"mode {number}")


_MAIN_MODES = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STAB"}
_AUTO = 4
_SUB_MODES = {
    2: "AUTO_TAKEOFF",
    3: "AUTO_LOITER",
    4: AUTO_MISSION,
    5: "AUTO_RTL",
    6: "AUTO_LAND",
    8: "AUTO_FOLLOW_TARGET",
    9: "AUTO_PRECLAND",
    10: "AUTO_VTOL_TAKEOFF",
}


def px4_custom_mode(number: int) -> str:
    """Return the name of a mode in a heartbeat.

    The third byte is the main mode, the fourth the sub mode of the automatic ones
    (``px4_custom_mode.h``).
    """
    main, sub = number >> 16 & 255, number >> 24 & 255
    names = _SUB_MODES if main == _AUTO else _MAIN_MODES
    return names.get(sub if main == _AUTO else main, f"mode {main}.{sub}")
