"""What the product needs of a vehicle, and the values that come of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from planner.autopilot import Autopilot
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.link.mission_kind import MissionKind
    from planner.link.mission_transfer import UploadOutcome, WireItem
    from planner.link.parameter_transfer import WireParameter
    from planner.link.vehicle_events import VehicleEvent
    from planner.mission.items import Home, Mission

AUTOPILOTS = {3: Autopilot.ARDUPILOT, 12: Autopilot.PX4}
"""By MAV_AUTOPILOT."""
_BYTEWISE, _CAST = 1 << 4, 1 << 17
"""MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE and _C_CAST."""
_RELEASES = {0: "dev", 64: "alpha", 128: "beta", 192: "rc", 255: ""}
"""FIRMWARE_VERSION_TYPE."""


@frozen
class VehicleIdentity:
    """Who is on the line."""

    system: int
    component: int
    autopilot_number: int
    """MAV_AUTOPILOT."""
    vehicle_type: int
    """MAV_TYPE."""
    firmware_version: tuple[int, int, int] | None = None
    firmware_release: str = ""
    """``dev``, ``rc`` and the like; empty for a release."""
    firmware_hash: str = ""
    uid: str = ""
    """The autopilot's own number in hexadecimal digits; empty where it sends none."""
    capabilities: int | None = None
    """MAV_PROTOCOL_CAPABILITY; ``None`` where the vehicle did not say."""

    @property
    def autopilot(self) -> Autopilot | None:
        """Its firmware; ``None`` where it is none that missions are predicted for."""
        return AUTOPILOTS.get(self.autopilot_number)

    @property
    def is_bytewise(self) -> bool:
        """Whether whole parameters stand bytewise in their messages."""
        said = (self.capabilities or 0) & (_BYTEWISE | _CAST)
        if said in {_BYTEWISE, _CAST}:
            return said == _BYTEWISE
        return self.autopilot is Autopilot.PX4

    @property
    def has_home_slot(self) -> bool:
        """Whether the first item of its mission is home, as ArduPilot has it."""
        return self.autopilot is Autopilot.ARDUPILOT

    @property
    def label(self) -> str:
        """In the words of a message: ``PX4 1.17.0 (system 1)``."""
        name = f"MAV_AUTOPILOT {self.autopilot_number}"
        if self.autopilot is not None:
            name = self.autopilot.label
        if self.firmware_version is not None:
            name += f" {'.'.join(map(str, self.firmware_version))}{self.firmware_release}"
        return f"{name} (system {self.system})"


def firmware_release(kind: int) -> str:
    """Return ``rc`` for 192; the number where it is between two kinds."""
    return _RELEASES.get(kind, f"type {kind}")


@frozen
class BatteryState:
    """The first battery, as the vehicle measures it."""

    remaining_fraction: float | None = None
    """State of charge, 0 to 1. [-]"""
    voltage_v: float | None = None
    current_a: float | None = None
    temperature_c: float | None = None
    consumed_ah: float | None = None
    """Since it was switched on. [Ah]"""
    capacity_ah: float | None = None
    """By the autopilot's parameters. [Ah]"""


@frozen
class VehiclePosition:
    """Where the vehicle is."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    height_above_home_m: float


@frozen
class WindEstimate:
    """The wind, as the vehicle takes it to be."""

    speed_m_s: float
    from_deg: float
    """Where it blows from. [°]"""


@frozen
class StatusText:
    """One STATUSTEXT, its chunks put together."""

    severity: int
    """MAV_SEVERITY: 0 emergency to 7 debug."""
    text: str


@frozen
class VehicleState:
    """What a vehicle says of itself at one time."""

    home: Home | None = None
    battery: BatteryState | None = None
    position: VehiclePosition | None = None
    wind: WindEstimate | None = None
    is_armed: bool | None = None
    """``None`` where no heartbeat was heard."""
    is_landed: bool | None = None
    """``None`` where it does not say."""

    @property
    def hazard(self) -> str:
        """Why nothing on it may be changed now, such as ``it is armed``; empty where it may."""
        if self.is_armed is None:
            return "it does not say whether it is armed"
        found = ["armed"] * self.is_armed + ["in the air"] * (self.is_landed is False)
        return f"it is {' and '.join(found)}" if found else ""


@frozen
class VehicleSnapshot:
    """Everything that was read from a vehicle."""

    address: str
    """The normalised address."""
    identity: VehicleIdentity
    state: VehicleState
    mission: Mission
    """Mission, fence and rally points, home as the vehicle has it."""
    parameters: tuple[WireParameter, ...]
    findings: tuple[Finding, ...] = ()
    """What has to be known about it."""


class VehicleLink(Protocol):
    """What the product needs of a vehicle; `planner.errors.LinkError` where the line fails."""

    @property
    def identity(self) -> VehicleIdentity:
        """Who is on the line."""

    def fetch_items(self, kind: MissionKind) -> tuple[WireItem, ...] | None:
        """Return one list of items; ``None`` where the vehicle knows no such list."""

    def upload_items(
        self, kind: MissionKind, items: Sequence[WireItem]
    ) -> tuple[UploadOutcome, str]:
        """Replace one list of items; the text says why it was rejected."""

    def fetch_parameters(self) -> tuple[WireParameter, ...]:
        """Return every parameter."""

    def fetch_state(self) -> VehicleState:
        """Return what the vehicle says of itself."""

    def listen(self, duration_s: float) -> tuple[StatusText, ...]:
        """Return the texts that the vehicle sends in a time [s], and those not taken before."""

    def fetch_events(self) -> tuple[VehicleEvent, ...]:
        """Return the events that the vehicle reported and that were not taken before."""

    def has_no_mission(self) -> bool:
        """Return whether the vehicle says that it has no mission that it would fly."""

    def is_heard(self, timeout_s: float) -> bool:
        """Return whether the vehicle sends another heartbeat within a time."""

    def close(self) -> None:
        """Close the line."""
