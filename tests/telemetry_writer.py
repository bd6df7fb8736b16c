"""A writer of telemetry logs with pymavlink's packers, for the tests of the reader."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

import made_flight as made
from pymavlink.dialects.v20 import ardupilotmega as mavlink

EPOCH_S = 1_700_000_000.0
"""The ground station's clock when the made flight begins."""


@dataclass(slots=True)
class TelemetryWriter:
    """The frames of a log so far."""

    frames: list[bytes] = field(default_factory=list)

    def add(self, stamp_s: float, message: Any, *, system: int = 1, component: int = 1) -> None:  # noqa: ANN401 - pymavlink has no types
        """Write a message as it arrived at a time of the ground station's clock."""
        frame = message.pack(mavlink.MAVLink(None, srcSystem=system, srcComponent=component))
        self.frames.append(struct.pack(">Q", round(stamp_s * 1e6)) + bytes(frame))

    def content(self) -> bytes:
        """Return the log."""
        return b"".join(self.frames)


def copter_telemetry(
    *,
    system: int = 1,
    current_ca: int | None = None,
    boot_s: float = 0.0,
    epoch_s: float = EPOCH_S,
    writer: TelemetryWriter | None = None,
    vz_is_up: bool = False,
    mav_autopilot: int = 3,
) -> TelemetryWriter:
    """Return the made flight as ArduCopter sends it, at five messages of a kind a second.

    Parameters
    ----------
    system : int, optional
        System id of the vehicle.
    current_ca : int, optional
        What the current sensor always shows, instead of what flows. [cA]
    boot_s : float, optional
        Time since boot when the made flight begins.
    epoch_s : float, optional
        The ground station's clock then.
    writer : TelemetryWriter, optional
        A log to go on with.
    vz_is_up : bool, optional
        Whether climbs are positive, as ArduCopter sent them before 3.6.
    mav_autopilot : int, optional
        Who it is by its heartbeats; default ArduPilot.
    """
    log = writer or TelemetryWriter()
    log.add(
        epoch_s, mavlink.MAVLink_param_value_message(b"WPNAV_SPEED", 500.0, 9, 1, 0), system=system
    )
    for moment in made.moments(5.0):
        now_ms = round((moment.time_s + boot_s) * 1e3)
        is_armed = made.ARMED_S <= moment.time_s < made.DISARMED_S
        shown_ca = round(moment.current_a * 100) if current_ca is None else current_ca
        messages = [
            mavlink.MAVLink_global_position_int_message(
                now_ms,
                round(moment.latitude_deg * 1e7),
                round(made.LONGITUDE_DEG * 1e7),
                round((made.GROUND_AMSL_M + moment.height_m) * 1e3),
                round(moment.height_m * 1e3),
                round(moment.speed_m_s * 100),
                0,
                round((1 if vz_is_up else -1) * moment.climb_m_s * 100),
                0,
            ),
            mavlink.MAVLink_heartbeat_message(
                2, mav_autopilot, 128 if is_armed else 0, 3, 4 if moment.is_airborne else 3, 3
            ),
            mavlink.MAVLink_sys_status_message(
                0, 0, 0, 0, round(made.VOLTAGE_V * 1e3), shown_ca, 50, 0, 0, 0, 0, 0, 0
            ),
            mavlink.MAVLink_mission_current_message(1 if moment.time_s < 10.0 else 2),
        ]
        for message in messages:
            log.add(epoch_s + moment.time_s, message, system=system)
        log.add(
            epoch_s + moment.time_s,
            mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3),
            system=255,
            component=190,
        )
    return log
