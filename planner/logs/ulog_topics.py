"""The topics of a ULog as columns, and which topic and field tells which quantity.

Names of PX4 from 1.8 on; sources: the message definitions of PX4 and recorded logs of 1.9, 1.15
and 1.17.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.logs.attitude import euler_angles_deg
from planner.logs.series import Series

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.logs.record import FloatArray

TOPICS = (
    "actuator_armed",
    "airspeed",
    "airspeed_validated",
    "battery_status",
    "estimator_wind",
    "home_position",
    "mission_result",
    "navigator_mission_item",
    "sensor_gps",
    "trajectory_setpoint",
    "vehicle_attitude",
    "vehicle_global_position",
    "vehicle_gps_position",
    "vehicle_land_detected",
    "vehicle_local_position",
    "vehicle_local_position_setpoint",
    "vehicle_status",
    "wind",
    "wind_estimate",
)
"""What is read of a log; the rest stays on the disk."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Topic:
    """The samples of one instance of a topic."""

    name: str
    instance: int
    time_s: FloatArray
    """Since boot. [s]"""
    fields: Mapping[str, FloatArray]

    def series(
        self,
        field: str,
        *,
        unit: float = 1.0,
        period: float | None = None,
        valid: str | None = None,
    ) -> Series | None:
        """Return a field as a series; ``None`` where it is missing or never known.

        Parameters
        ----------
        field : str
            Name of the field.
        unit : float, optional
            The field times this is in the column's unit.
        period : float, optional
            360 for angles.
        valid : str, optional
            Field that says which samples are valid, where the topic has it.
        """
        values = self.fields.get(field)
        if values is None:
            return None
        values = values * unit
        if valid is not None and valid in self.fields:
            values = np.where(self.fields[valid] != 0.0, values, np.nan)
        series = Series.of(self.time_s, values, f"{self.name}.{field}", period=period)
        return series if len(series) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    topic: str
    field: str
    unit: float = 1.0
    valid: str | None = None


_DEG_E7 = 1e-7
_MM = 1e-3

_QUANTITIES: Mapping[str, tuple[_Source, ...]] = {
    "latitude_deg": (
        _Source(topic="vehicle_global_position", field="lat", valid="lat_lon_valid"),
        _Source(topic="vehicle_gps_position", field="latitude_deg"),
        _Source(topic="sensor_gps", field="latitude_deg"),
        _Source(topic="vehicle_gps_position", field="lat", unit=_DEG_E7),
        _Source(topic="sensor_gps", field="lat", unit=_DEG_E7),
    ),
    "longitude_deg": (
        _Source(topic="vehicle_global_position", field="lon", valid="lat_lon_valid"),
        _Source(topic="vehicle_gps_position", field="longitude_deg"),
        _Source(topic="sensor_gps", field="longitude_deg"),
        _Source(topic="vehicle_gps_position", field="lon", unit=_DEG_E7),
        _Source(topic="sensor_gps", field="lon", unit=_DEG_E7),
    ),
    "altitude_amsl_m": (
        _Source(topic="vehicle_global_position", field="alt", valid="alt_valid"),
        _Source(topic="vehicle_gps_position", field="altitude_msl_m"),
        _Source(topic="sensor_gps", field="altitude_msl_m"),
        _Source(topic="vehicle_gps_position", field="alt", unit=_MM),
        _Source(topic="sensor_gps", field="alt", unit=_MM),
    ),
    "velocity_north_m_s": (
        _Source(topic="vehicle_local_position", field="vx", valid="v_xy_valid"),
        _Source(topic="vehicle_gps_position", field="vel_n_m_s", valid="vel_ned_valid"),
    ),
    "velocity_east_m_s": (
        _Source(topic="vehicle_local_position", field="vy", valid="v_xy_valid"),
        _Source(topic="vehicle_gps_position", field="vel_e_m_s", valid="vel_ned_valid"),
    ),
    "climb_m_s": (
        _Source(topic="vehicle_local_position", field="vz", unit=-1.0, valid="v_z_valid"),
        _Source(topic="vehicle_gps_position", field="vel_d_m_s", unit=-1.0, valid="vel_ned_valid"),
    ),
    "reference_velocity_north_m_s": (
        _Source(topic="trajectory_setpoint", field="velocity[0]"),
        _Source(topic="trajectory_setpoint", field="vx"),
        _Source(topic="vehicle_local_position_setpoint", field="vx"),
    ),
    "reference_velocity_east_m_s": (
        _Source(topic="trajectory_setpoint", field="velocity[1]"),
        _Source(topic="trajectory_setpoint", field="vy"),
        _Source(topic="vehicle_local_position_setpoint", field="vy"),
    ),
    "reference_climb_m_s": (
        _Source(topic="trajectory_setpoint", field="velocity[2]", unit=-1.0),
        _Source(topic="trajectory_setpoint", field="vz", unit=-1.0),
        _Source(topic="vehicle_local_position_setpoint", field="vz", unit=-1.0),
    ),
    "airspeed_m_s": (
        _Source(topic="airspeed_validated", field="true_airspeed_m_s"),
        _Source(topic="airspeed", field="true_airspeed_m_s"),
    ),
    "wind_north_m_s": tuple(
        _Source(topic=topic, field="windspeed_north")
        for topic in ("wind", "estimator_wind", "wind_estimate")
    ),
    "wind_east_m_s": tuple(
        _Source(topic=topic, field="windspeed_east")
        for topic in ("wind", "estimator_wind", "wind_estimate")
    ),
}
"""Where each quantity stands, the best place first."""

_PERIODS = {"longitude_deg": 360.0}


def quantity_series(topics: Mapping[str, Topic]) -> dict[str, Series]:
    """Return the quantities that stand in the topics as they are.

    Parameters
    ----------
    topics : mapping
        The first instance of each topic, by name.

    Returns
    -------
    dict
        Series by the names of columns.
    """
    series: dict[str, Series] = {}
    for name, sources in _QUANTITIES.items():
        for source in sources:
            topic = topics.get(source.topic)
            found = topic and topic.series(
                source.field, unit=source.unit, period=_PERIODS.get(name), valid=source.valid
            )
            if found:
                series[name] = found
                break
    return series | _attitude(topics.get("vehicle_attitude"))


def _attitude(topic: Topic | None) -> dict[str, Series]:
    """Return roll, pitch and yaw of a quaternion from body to north-east-down."""
    names = [f"q[{index}]" for index in range(4)]
    if topic is None or not set(names) <= topic.fields.keys():
        return {}
    roll_deg, pitch_deg, yaw_deg = euler_angles_deg(*(topic.fields[name] for name in names))
    found_in = f"{topic.name}.q"
    return {
        "roll_deg": Series.of(topic.time_s, roll_deg, found_in, period=360.0),
        "pitch_deg": Series.of(topic.time_s, pitch_deg, found_in),
        "yaw_deg": Series.of(topic.time_s, yaw_deg, found_in, period=360.0),
    }
