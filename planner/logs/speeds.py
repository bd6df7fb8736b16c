"""How the vehicle and the air moved, and how the vehicle was told to move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.logs.grid import Column, Grid

_CALM_M_S = 1e-6
"""An autopilot that estimates no wind logs exactly none. [m s⁻¹]"""


def speed_columns(grid: Grid) -> dict[str, Column]:
    """Return velocities and speeds, of the vehicle, its references and the wind, and the airspeed.

    What is logged directly is taken; a horizontal speed is the length of its velocity where that
    is known; the airspeed is the velocity through the wind where it is not measured.
    """
    names = (
        "velocity_north_m_s",
        "velocity_east_m_s",
        "climb_m_s",
        "ground_speed_m_s",
        "airspeed_m_s",
        "reference_velocity_north_m_s",
        "reference_velocity_east_m_s",
        "reference_climb_m_s",
        "reference_speed_m_s",
    )
    found = {name: grid.column(name) for name in names}
    columns = {name: column for name, column in found.items() if column is not None}
    for name, column in _velocity_by_course(grid, columns).items():
        columns[name] = columns[name].else_from(column) if name in columns else column
    columns |= _length(grid, columns, "velocity", "ground_speed_m_s")
    columns |= _length(grid, columns, "reference_velocity", "reference_speed_m_s")
    columns |= _wind(grid)
    if "airspeed_m_s" not in columns:
        columns |= _airspeed(grid, columns)
    return columns


def _velocity_by_course(grid: Grid, columns: dict[str, Column]) -> dict[str, Column]:
    speed, course = columns.get("ground_speed_m_s"), grid.column("course_deg")
    if speed is None or course is None:
        return {}
    direction = np.radians(course.values)
    found_in = f"{speed.found_in}, {course.found_in}"
    return {
        "velocity_north_m_s": grid.together(
            speed.values * np.cos(direction), found_in, speed, course
        ),
        "velocity_east_m_s": grid.together(
            speed.values * np.sin(direction), found_in, speed, course
        ),
    }


def _length(grid: Grid, columns: dict[str, Column], what: str, name: str) -> dict[str, Column]:
    """Return the length of a horizontal velocity, where both components are known."""
    north, east = columns.get(f"{what}_north_m_s"), columns.get(f"{what}_east_m_s")
    if north is None or east is None:
        return {}
    length = grid.together(np.hypot(north.values, east.values), north.found_in, north, east)
    if not length.is_known:
        return {}
    return {name: length.else_from(columns[name]) if name in columns else length}


def _wind(grid: Grid) -> dict[str, Column]:
    """Return the wind; an estimate of exactly none throughout is no estimate."""
    north, east = grid.column("wind_north_m_s"), grid.column("wind_east_m_s")
    if north is None or east is None:
        return {}
    speeds = np.hypot(north.values, east.values)
    if not np.any(speeds > _CALM_M_S):
        return {}
    return {"wind_north_m_s": north, "wind_east_m_s": east}


def _airspeed(grid: Grid, columns: dict[str, Column]) -> dict[str, Column]:
    names = ("velocity_north_m_s", "velocity_east_m_s", "wind_north_m_s", "wind_east_m_s")
    if not all(name in columns for name in names):
        return {}
    north, east, wind_north, wind_east = (columns[name] for name in names)
    speed = np.hypot(north.values - wind_north.values, east.values - wind_east.values)
    found_in = f"{north.found_in}, {wind_north.found_in}"
    return {"airspeed_m_s": grid.together(speed, found_in, north, wind_north)}
