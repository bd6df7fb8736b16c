"""Mappings of CSV files whose columns are known."""

from __future__ import annotations

from planner.logs.csv_mapping import Axes, CsvMapping, Orientation, column_source

AIRDATA = CsvMapping(
    name="airdata",
    vehicle="",
    columns={
        name: column_source(name, column, unit, sign)
        for name, column, unit, sign in (
            ("time_s", "time(millisecond)", "ms", 1),
            ("latitude_deg", "latitude", "deg", 1),
            ("longitude_deg", "longitude", "deg", 1),
            ("height_above_home_m", "height_above_takeoff(feet)", "ft", 1),
            ("altitude_amsl_m", "altitude_above_seaLevel(feet)", "ft", 1),
            ("velocity_north_m_s", "xSpeed(mph)", "mph", 1),
            ("velocity_east_m_s", "ySpeed(mph)", "mph", 1),
            ("climb_m_s", "zSpeed(mph)", "mph", -1),
            ("ground_speed_m_s", "speed(mph)", "mph", 1),
            ("yaw_deg", "compass_heading(degrees)", "deg", 1),
            ("pitch_deg", "pitch(degrees)", "deg", 1),
            ("roll_deg", "roll(degrees)", "deg", 1),
            ("voltage_v", "voltage(v)", "V", 1),
            ("current_a", "current(A)", "A", 1),
            ("mode", "flycState", None, 1),
        )
    },
)
"""DJI flights as AirData exports them in feet and miles: velocities north, east, down."""

MATRICE_100 = CsvMapping(
    name="matrice-100",
    vehicle="DJI Matrice 100",
    columns={
        name: column_source(name, column, unit, sign)
        for name, column, unit, sign in (
            ("time_s", "time", "s", 1),
            ("longitude_deg", "position_x", "deg", 1),
            ("latitude_deg", "position_y", "deg", 1),
            ("altitude_amsl_m", "position_z", "m", 1),
            ("velocity_forward_m_s", "velocity_x", "m/s", 1),
            ("velocity_right_m_s", "velocity_y", "m/s", -1),
            ("airspeed_m_s", "wind_speed", "m/s", 1),
            ("voltage_v", "battery_voltage", "V", 1),
            ("current_a", "battery_current", "A", 1),
        )
    },
    orientation=Orientation(
        columns=("orientation_w", "orientation_x", "orientation_y", "orientation_z"),
        axes=Axes.FLU_ENU,
    ),
)
"""The flights of Rodrigues et al. 2021 (Sci. Data 8:155): an anemometer rides on the vehicle.

That the velocities are along the body's axes, forward and left, and the quaternion turns to east,
north, up, was found by comparing both with the track.
"""

KNOWN_MAPPINGS = (AIRDATA, MATRICE_100)
