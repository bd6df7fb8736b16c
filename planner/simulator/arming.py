"""Arming, as a simulated vehicle does it by itself: PX4 asks before (ArmAuthorization.cpp).

Arming is simulated, and only this vehicle's own: no message of a ground station ever arms it.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.wire import message
from planner.mission.commands import Command, Support, support
from planner.simulator.servers import NEVER_S
from planner.simulator.setup import parameter_values
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.link.mission import WireItem
    from planner.link.wire import Message
    from planner.simulator.setup import VehicleSetup


ARM_AUTHORIZATION_REQUEST = 3001
"""MAV_CMD_ARM_AUTHORIZATION_REQUEST."""
_ACCEPTED, _TEMPORARILY_REJECTED, _DENIED, _IN_PROGRESS = 0, 1, 2, 5
"""MAV_RESULT."""
_INFO, _CRITICAL = 6, 2
"""MAV_SEVERITY."""
_REASONS = dict(
    enumerate(
        ("generic", "no reason", "invalid waypoint", "timeout", "airspace in use", "bad weather")
    )
)
"""MAV_ARM_AUTH_DENIED_REASON."""
_NUMBERED = frozenset({2, 4})
"""Reasons whose second value is the number of an item."""


_AGAIN_S = 0.5
_REPEATS = 3
"""PX4 asks again, by the same command, as long as nobody has answered (MavlinkCommandSender)."""
_TWO_STEPS = 1
"""COM_ARM_AUTH_MET: the first arming asks, and another one arms."""
_DEFAULT_WAIT_S = 1.0


class ArmingState(Enum):
    """How far a vehicle is with arming."""

    DISARMED = "disarmed"
    ASKING = "asking"
    DENIED = "denied"
    ARMED = "armed"


class Arming:
    """Asks whom the parameters COM_ARM_AUTH_* name, and honours the answer."""

    def __init__(self, setup: VehicleSetup) -> None:
        values = parameter_values(setup.parameters)
        self._setup = setup
        self._is_asked = setup.autopilot is Autopilot.PX4 and bool(values.get("COM_ARM_AUTH_REQ"))
        self._authoriser = int(values.get("COM_ARM_AUTH_ID", 0))
        self._has_two_steps = values.get("COM_ARM_AUTH_MET") == _TWO_STEPS
        self._wait_s = values.get("COM_ARM_AUTH_TO", _DEFAULT_WAIT_S)
        self._approved_until_s = -NEVER_S
        self._gives_up_s = NEVER_S
        self._asks_again_s = NEVER_S
        self._repeats = 0
        self.state = ArmingState.DISARMED
        self.denial: tuple[int, int] | None = None
        """MAV_ARM_AUTH_DENIED_REASON and what goes with it, of the last denial that had one."""
        self.authorised_s: float | None = None
        """For how long the last answer let it arm. [s]"""

    @property
    def deadline_s(self) -> float:
        """When it asks again, or gives up. [s]"""
        return min(self._gives_up_s, self._asks_again_s)

    def request(self, now_s: float) -> tuple[Message, ...]:
        """Try to arm; without an authoriser, or as long as its last answer holds, it succeeds."""
        if self.state in {ArmingState.ASKING, ArmingState.ARMED}:
            return ()
        self.denial = None
        if not self._is_asked or now_s <= self._approved_until_s:
            self._settle(ArmingState.ARMED)
            return (self._setup.text(_INFO, "SIMULATED: armed"),)
        self.state = ArmingState.ASKING
        self._gives_up_s = now_s + self._wait_s
        self._repeats = 0
        asked = (self._question(now_s),)
        if self._has_two_steps:
            return (*asked, self._setup.text(_INFO, "SIMULATED: asking whether to arm"))
        return asked

    def disarm(self) -> tuple[Message, ...]:
        """Disarm, landed."""
        self.state = ArmingState.DISARMED
        return (self._setup.text(_INFO, "SIMULATED: landed and disarmed"),)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers; anyone's answer counts (PX4)."""
        if (
            self.state is not ArmingState.ASKING
            or received.name != "COMMAND_ACK"
            or received["command"] != ARM_AUTHORIZATION_REQUEST
            or received["target_system"] != self._setup.system
        ):
            return ()
        self._asks_again_s = NEVER_S
        match received["result"]:
            case result if result == _ACCEPTED:
                return self._approved(received["result_param2"], now_s)
            case result if result == _IN_PROGRESS:
                return ()  # which lengthens nothing
            case result if result == _TEMPORARILY_REJECTED:
                return self._denied("Arming denied by authorizer: wait")
        self.denial = (received["progress"], received["result_param2"])
        reason, extra = self.denial
        text = f"Arming denied: {_REASONS.get(reason, f'reason {reason}')}"
        if reason in _NUMBERED:
            text += f" {extra}"
        return self._denied(text)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask the authoriser again, or give up waiting for it."""
        if now_s < self._gives_up_s:
            self._repeats += 1
            return (self._question(now_s),)
        return self._denied("Arming denied: no answer by authorizer")

    def _question(self, now_s: float) -> Message:
        self._asks_again_s = NEVER_S if self._repeats == _REPEATS else now_s + _AGAIN_S
        return message(
            "COMMAND_LONG",
            target_system=self._authoriser,
            target_component=0,
            command=ARM_AUTHORIZATION_REQUEST,
            confirmation=self._repeats,
        )

    def _approved(self, valid_s: int, now_s: float) -> tuple[Message, ...]:
        """Arm, or have it done by another try; landed again, the approval still holds."""
        self.authorised_s = float(valid_s)
        self._approved_until_s = now_s + valid_s
        if self._has_two_steps:
            self._settle(ArmingState.DISARMED)
            return (self._setup.text(_INFO, "SIMULATED: arming authorised, arm again"),)
        self._settle(ArmingState.ARMED)
        return (self._setup.text(_INFO, "SIMULATED: arming authorised, armed"),)

    def _denied(self, text: str) -> tuple[Message, ...]:
        self._settle(ArmingState.DENIED)
        return (self._setup.text(_CRITICAL, text),)

    def _settle(self, state: ArmingState) -> None:
        self.state = state
        self._gives_up_s = self._asks_again_s = NEVER_S


_TAKEOFF, _LANDING, _BOTH, _BOTH_OR_NONE = 1, 2, 3, 4
"""MIS_TKO_LAND_REQ."""
_LANDINGS = frozenset({Command.NAV_LAND})
"""A return is none."""


class Rejection(Value):
    """Why a vehicle will not fly a mission."""

    text: str
    """Its text; empty where there is only an event."""
    event: str = ""
    """Name of its event; empty where there is none."""
    item: int | None = None
    """What the event is about, from 1."""


def rejection(items: Sequence[WireItem], setup: VehicleSetup) -> Rejection | None:
    """Return why a vehicle will not fly the mission it holds; ``None`` where it will.

    ArduPilot reports nothing at this time: it looks at its mission when it arms.
    """
    wrong = setup.misbehaviour
    if wrong.rejection or wrong.event:
        return Rejection(text=wrong.rejection, event=wrong.event)
    if setup.autopilot is not Autopilot.PX4 or not items:
        return None
    for number, item in enumerate(items, 1):
        known = support(item.command, setup.autopilot, frame=item.frame, version=setup.version[:2])
        if known is Support.BLOCKS_ARMING:
            text = f"Mission rejected: item {number}: unsupported cmd: {item.command}"
            return Rejection(text=text, event="navigator_mis_unsup_cmd", item=number)
    return _missing(items, int(parameter_values(setup.parameters).get("MIS_TKO_LAND_REQ", 0)))


def _missing(items: Sequence[WireItem], required: int) -> Rejection | None:
    """Return what MIS_TKO_LAND_REQ asks for and the mission has not."""
    has_takeoff = any(item.command == Command.NAV_TAKEOFF for item in items)
    has_landing = any(item.command in _LANDINGS for item in items)
    text, event = "", ""
    if required == _TAKEOFF and not has_takeoff:
        text, event = "Takeoff waypoint required.", "takeoff_missing"
    elif required == _LANDING and not has_landing:
        text, event = "Landing waypoint/pattern required.", "land_missing"
    elif required == _BOTH and not (has_takeoff and has_landing):
        text, event = "Takeoff or Landing item missing.", "takeoff_or_land_missing"
    elif required == _BOTH_OR_NONE and has_takeoff and not has_landing:
        text, event = "Add Landing item or remove Takeoff.", "add_land_or_rm_to"
    elif required == _BOTH_OR_NONE and has_landing and not has_takeoff:
        text, event = "Add Takeoff item or remove Landing.", "add_to_or_rm_land"
    if not text:
        return None
    return Rejection(text=f"Mission rejected: {text}", event=f"navigator_mis_{event}")
