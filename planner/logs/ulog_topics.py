"""The topics of a ULog as columns, and which topic and field tells which quantity.

Names of PX4 from 1.8 on; sources: the message definitions of PX4 and recorded logs of 1.9, 1.15
and 1.17.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.logs.attitude import euler_angles_deg
from planner.logs.series import Series
from planner.logs.source import sources

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.logs.record import FloatArray
    from planner.logs.source import Source

TOPICS = (
    "actuator_armed",
    "airspeed",
    "airspeed_validated",
    "battery_status",
    "estimator_wind",
    "home_position",
    "mission_result",
    "navigator_mission_item",
    "position_setpoint_triplet",
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


@frozen(eq=False)
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


_DEG_E7 = 1e-7
_MM = 1e-3
_GPS = "vehicle_gps_position", "sensor_gps"
_WINDS = "wind", "estimator_wind", "wind_estimate"


def _of(topics: tuple[str, ...], field: str) -> tuple[str, ...]:
    return tuple(f"{topic}.{field}" for topic in topics)


_QUANTITIES: Mapping[str, tuple[Source, ...]] = {
    "latitude_deg": (
        *sources("vehicle_global_position.lat", valid="lat_lon_valid"),
        *sources(*_of(_GPS, "latitude_deg")),
        *sources(*_of(_GPS, "lat"), unit=_DEG_E7),
    ),
    "longitude_deg": (
        *sources("vehicle_global_position.lon", valid="lat_lon_valid"),
        *sources(*_of(_GPS, "longitude_deg")),
        *sources(*_of(_GPS, "lon"), unit=_DEG_E7),
    ),
    "altitude_amsl_m": (
        *sources("vehicle_global_position.alt", valid="alt_valid"),
        *sources(*_of(_GPS, "altitude_msl_m")),
        *sources(*_of(_GPS, "alt"), unit=_MM),
    ),
    "velocity_north_m_s": (
        *sources("vehicle_local_position.vx", valid="v_xy_valid"),
        *sources(*_of(_GPS, "vel_n_m_s"), valid="vel_ned_valid"),
    ),
    "velocity_east_m_s": (
        *sources("vehicle_local_position.vy", valid="v_xy_valid"),
        *sources(*_of(_GPS, "vel_e_m_s"), valid="vel_ned_valid"),
    ),
    "climb_m_s": (
        *sources("vehicle_local_position.vz", unit=-1.0, valid="v_z_valid"),
        *sources(*_of(_GPS, "vel_d_m_s"), unit=-1.0, valid="vel_ned_valid"),
    ),
    "reference_velocity_north_m_s": sources(
        "trajectory_setpoint.velocity[0]",
        "trajectory_setpoint.vx",
        "vehicle_local_position_setpoint.vx",
    ),
    "reference_velocity_east_m_s": sources(
        "trajectory_setpoint.velocity[1]",
        "trajectory_setpoint.vy",
        "vehicle_local_position_setpoint.vy",
    ),
    "reference_climb_m_s": sources(
        "trajectory_setpoint.velocity[2]",
        "trajectory_setpoint.vz",
        "vehicle_local_position_setpoint.vz",
        unit=-1.0,
    ),
    "airspeed_m_s": sources("airspeed_validated.true_airspeed_m_s", "airspeed.true_airspeed_m_s"),
    "wind_north_m_s": sources(*_of(_WINDS, "windspeed_north")),
    "wind_east_m_s": sources(*_of(_WINDS, "windspeed_east")),
}
"""Where each quantity stands, the best place first.

References are the path as it is shaped (trajectory_setpoint); the local setpoint has the
correction of the position error on top, and is taken only where the other is not logged.
"""

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
    for name, places in _QUANTITIES.items():
        for source in places:
            topic = topics.get(source.message)
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
