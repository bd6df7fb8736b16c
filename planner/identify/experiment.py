"""The article's two flights, and a sweep of speeds, as missions of a vehicle that is to be identified.

Vertical: up and down in equal steps, with a hover at each height.  Horizontal: out and back at one speed,
with a hover at each end.  K. Falkowski, M. Duda, Sensors 2023, 23(23), 9378, section 3, with 100 m steps
to 400 m and 10 m/s.  The sweep gives what the article has not: power over the airspeed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.geo.geodesy import latitude_longitude_deg
from planner.mission.commands import Command, Frame
from planner.mission.items import Home, Mission, MissionFormat, MissionItem, numbered_in_order
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_LEAST_CRUISE_S = 15.0
"""Held at a speed for less, its power is not told from that of speeding up. [s]"""
_STOPS_S = 10.0
"""Speeding up and braking together take as long as so much of the speed flown. [s]"""

LOGGED: Mapping[Autopilot, str] = {
    Autopilot.ARDUPILOT: (
        "DataFlash (.BIN) with LOG_BITMASK as delivered, 176126: ATT, CTUN, PSC, GPS, BAT, MODE and CMD; "
        "BATT_MONITOR 4, so that current is logged as well as voltage, and BATT_AMP_PERVLT calibrated"
    ),
    Autopilot.PX4: (
        "ULog (.ulg) with SDLOG_PROFILE 1, as delivered: vehicle_local_position, trajectory_setpoint, "
        "vehicle_attitude and battery_status; a power module that measures current, calibrated "
        "(BAT1_A_PER_V)"
    ),
}
"""What identification needs in the log of an autopilot."""


class ExperimentSettings(Value):
    """Where and how far the flights of an experiment go."""

    home: Home
    autopilot: Autopilot
    height_m: float = 100.0
    """Highest level above home; the horizontal flights are at half of it. [m]"""
    levels: int = 4
    """Steps from the ground to it. [-]"""
    hold_s: float = 60.0
    """Hover at each level. [s]"""
    speed_m_s: float = 10.0
    """Of the horizontal flight, and the fastest of the sweep. [m/s]"""
    speeds: int = 5
    """Of the sweep, equal steps from 0. [-]"""
    leg_m: float = 300.0
    """Way out and way back; of the sweep, with the fastest. [m]"""
    bearing_deg: float = 0.0
    """Of the way out, from north over east. [°]"""
    pause_s: float = 20.0
    """Hover at each end of a leg. [s]"""


class ExperimentFlight(Value):
    """One flight of an experiment."""

    name: str
    """Of its file, without the suffix."""
    mission: Mission
    course: str
    """What is flown."""
    shows: str
    """What is identified from it."""


def make_experiment(settings: ExperimentSettings) -> tuple[ExperimentFlight, ...]:
    """Return the vertical flight, the horizontal one and the sweep of speeds.

    Raises UsageError if a leg is too short to hold its speed.
    """
    leg_s = settings.leg_m / settings.speed_m_s
    cruise_s = leg_s - _STOPS_S
    if cruise_s < _LEAST_CRUISE_S:
        needed_m = math.ceil(settings.speed_m_s * (_STOPS_S + _LEAST_CRUISE_S))
        msg = (
            f"a leg of {settings.leg_m:g} m is too short to hold {settings.speed_m_s:g} m/s for "
            f"{_LEAST_CRUISE_S:g} s: give --leg {needed_m} or a lower --speed"
        )
        raise UsageError(msg)
    step_m = settings.height_m / settings.levels
    rising = [step_m * level for level in range(1, settings.levels + 1)]
    heights = (*rising, *rising[-2::-1])
    speeds = [settings.speed_m_s * n / settings.speeds for n in range(1, settings.speeds + 1)]
    listed = "-".join(f"{round(height, 1):g}" for height in (0.0, *heights, 0.0))
    at = f"{round(0.5 * settings.height_m, 1):g} m above home, {settings.pause_s:g} s at each end"
    swept = ", ".join(f"{round(speed, 1):g}" for speed in speeds)
    return (
        ExperimentFlight(
            name="vertical",
            mission=_mission(settings, _vertical(settings, heights)),
            course=f"{listed} m, {settings.hold_s:g} s at each height",
            shows="hover power over height, climb and descent (G1, G2, G3)",
        ),
        ExperimentFlight(
            name="horizontal",
            mission=_mission(settings, _horizontal(settings, [settings.speed_m_s])),
            course=f"{settings.leg_m:g} m out and back at {settings.speed_m_s:g} m/s, {at}",
            shows="speeding up and braking (G4, G5), cruise power",
        ),
        ExperimentFlight(
            name="speed-sweep",
            mission=_mission(settings, _horizontal(settings, speeds)),
            course=f"out and back at {swept} m/s, {round(leg_s, 1):g} s each way, {at}",
            shows="power over airspeed",
        ),
    )


def _vertical(settings: ExperimentSettings, heights: tuple[float, ...]) -> Iterator[MissionItem]:
    yield _item(Command.NAV_TAKEOFF, settings, height_m=heights[0])
    for height_m in heights:
        yield _item(Command.NAV_WAYPOINT, settings, height_m=height_m, hold_s=settings.hold_s)


def _horizontal(settings: ExperimentSettings, speeds: list[float]) -> Iterator[MissionItem]:
    height_m, pause_s = 0.5 * settings.height_m, settings.pause_s
    yield _item(Command.NAV_TAKEOFF, settings, height_m=height_m)
    yield _item(Command.NAV_WAYPOINT, settings, height_m=height_m, hold_s=pause_s)
    for speed_m_s in speeds:
        yield MissionItem(
            int(Command.DO_CHANGE_SPEED),
            int(Frame.MISSION),
            1.0,
            speed_m_s,
            -1.0,
            0.0,
            0.0,
            0.0,
            0.0,
        )
        way_m = settings.leg_m * speed_m_s / settings.speed_m_s  # all legs take as long
        for away_m in (way_m, 0.0):
            yield _item(
                Command.NAV_WAYPOINT, settings, height_m=height_m, hold_s=pause_s, away_m=away_m
            )


def _item(
    command: Command,
    settings: ExperimentSettings,
    *,
    height_m: float = 0.0,
    hold_s: float = 0.0,
    away_m: float = 0.0,
) -> MissionItem:
    home = settings.home
    latitude_deg, longitude_deg = latitude_longitude_deg(
        home.latitude_deg, home.longitude_deg, away_m, settings.bearing_deg
    )
    return MissionItem(
        int(command),
        int(Frame.GLOBAL_RELATIVE_ALT),
        *(hold_s, 0.0, 0.0, None),
        *(round(float(latitude_deg), 7), round(float(longitude_deg), 7), height_m),  # as it is sent
    )


def _mission(settings: ExperimentSettings, flown: Iterator[MissionItem]) -> Mission:
    return Mission(
        source="experiment",
        file_format=MissionFormat.PLAN,
        items=numbered_in_order([*flown, _item(Command.NAV_LAND, settings)]),
        home=settings.home,
        autopilot=settings.autopilot,
    )
