"""A vehicle in virtual time that tells its state by itself, and asks before it arms."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from virtual_vehicle import VirtualVehicle, wire_item

from planner.link.mission import MissionKind
from planner.link.wire import Message, message

if TYPE_CHECKING:
    from collections.abc import Callable

HOME = (500_000_000, 200_000_000, 200_000)
OUT_AND_BACK = (
    wire_item(command=22, x=HOME[0], y=HOME[1], z=100.0, param4=math.nan),
    wire_item(z=100.0, x=500_050_000, y=HOME[1], param4=math.nan),
    wire_item(command=20, frame=2, x=0, y=0, z=0.0),
)
"""Up to 100 m, 556 m north (0.005° x 111.2 km), back and down."""
ASKING = {
    "MPC_XY_CRUISE": (7.0, 9),
    "COM_ARM_AUTH_REQ": (1.0, 6),
    "COM_ARM_AUTH_ID": (245.0, 6),
    "COM_ARM_AUTH_TO": (2.0, 9),
}
HASH = "_HASH_CHECK"
_REQUEST = message("COMMAND_LONG", target_system=245, command=3001)


@dataclass
class GuardedVehicle(VirtualVehicle):
    """Does at each time what its script says."""

    script: list[tuple[float, Callable[[GuardedVehicle], None]]] = field(default_factory=list)
    """By time, what happens on the vehicle; in order. [s]"""
    energy_consumed_hj: int = -1
    place: tuple[int, int, int] = (*HOME[:2], 0)
    """Latitude, longitude, height above home in mm."""
    sequence: int = 0
    is_armed: bool = False
    has_hash: bool = True
    state_s: float = 0.0
    answers: list[tuple[float, Message]] = field(default_factory=list)
    texts: list[tuple[float, int, str]] = field(default_factory=list)
    outbox: list[Message] = field(default_factory=list)
    is_silent: bool = False

    def ask(self) -> None:
        """Ask whether it may arm."""
        self.outbox.append(_REQUEST)

    def tick(self, now_s: float) -> list[Message]:
        while self.script and self.script[0][0] <= now_s:
            self.script.pop(0)[1](self)
        if self.is_silent:
            return []
        said = [one for one in super().tick(now_s) if one.name != "HEARTBEAT"]
        if now_s >= self.state_s:
            self.state_s = now_s + 0.5
            said += self._state()
        said += self.outbox
        self.outbox = []
        return said

    def take(self, one: Message, now_s: float) -> list[Message]:
        if self.is_silent:
            return []
        if one.name == "COMMAND_ACK":
            self.answers.append((now_s, one))
        elif one.name == "STATUSTEXT":
            self.texts.append((now_s, one["severity"], one["text"]))
        return super().take(one, now_s)

    def results(self) -> list[int]:
        """Return the results of the answers so far."""
        return [one["result"] for _, one in self.answers]

    def _answers(self) -> dict[int, Message]:
        answers = super()._answers()
        answers[147] = message(
            "BATTERY_STATUS",
            battery_remaining=self.battery_remaining,
            voltages=[self.voltage_mv, *[65_535] * 9],
            voltages_ext=[0] * 4,
            temperature=2150,
            current_battery=-1,
            current_consumed=-1,
            energy_consumed=self.energy_consumed_hj,
        )
        latitude, longitude, height_mm = self.place
        answers[33] = message(
            "GLOBAL_POSITION_INT",
            lat=latitude,
            lon=longitude,
            alt=HOME[2] + height_mm,
            relative_alt=height_mm,
        )
        answers[245] = message("EXTENDED_SYS_STATE", landed_state=2 if height_mm else 1)
        total = len(self.lists[MissionKind.MISSION])
        answers[42] = message("MISSION_CURRENT", seq=self.sequence, total=total)
        return answers

    def _state(self) -> list[Message]:
        answers = self._answers()
        beat = message(
            "HEARTBEAT",
            type=2,
            autopilot=self.autopilot,
            base_mode=128 if self.is_armed else 0,
            custom_mode=(4 << 16) | (4 << 24),
            system_status=4 if self.is_armed else 3,
            mavlink_version=3,
        )
        return [beat, *(answers[number] for number in (147, 33, 245, 42, 242) if number in answers)]

    def _on_param_request_read(self, one: Message, now_s: float) -> list[Message]:
        if one["param_id"] != HASH:
            return super()._on_param_request_read(one, now_s)
        if not self.has_hash:
            return []
        digest = float(hash(tuple(sorted(self.parameters.items()))) % 1_000_000)
        return [message("PARAM_VALUE", param_id=HASH, param_value=digest, param_type=9)]


def guarded(**changes: object) -> GuardedVehicle:
    """Return a vehicle with a mission and home, that asks system 245."""
    vehicle = GuardedVehicle(home=HOME, parameters=dict(ASKING), battery_remaining=95)
    vehicle.lists[MissionKind.MISSION] = OUT_AND_BACK
    for name, value in changes.items():
        setattr(vehicle, name, value)
    return vehicle
