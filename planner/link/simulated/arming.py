"""Arming, as a simulated vehicle does it by itself: PX4 asks its authoriser before (arm_auth.cpp).

Arming is simulated, and only this vehicle's own: no message of a ground station ever arms it.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.message import message
from planner.link.simulated.parameters import parameter_values
from planner.link.simulated.server import NEVER_S

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.simulated.setup import VehicleSetup

ARM_AUTHORIZATION_REQUEST = 3001
"""MAV_CMD_ARM_AUTHORIZATION_REQUEST."""
_ACCEPTED, _TEMPORARILY_REJECTED, _DENIED, _IN_PROGRESS = 0, 1, 2, 5
"""MAV_RESULT."""
_INFO, _CRITICAL = 6, 2
"""MAV_SEVERITY."""
_REASONS = {
    0: "generic",
    1: "no reason",
    2: "invalid waypoint",
    3: "timeout",
    4: "airspace in use",
    5: "bad weather",
}
"""MAV_ARM_AUTH_DENIED_REASON."""
_NUMBERED = frozenset({2, 4})
"""Reasons whose second value is the number of an item."""


class ArmingState(Enum):
    """How far a vehicle is with arming."""

    DISARMED = "disarmed"
    ASKING = "asking"
    """For the authoriser's answer."""
    DENIED = "denied"
    ARMED = "armed"


class Arming:
    """Asks whoever has to be asked, and honours the answer.

    Parameters
    ----------
    setup : VehicleSetup
        Whose parameters COM_ARM_AUTH_* say whether and whom to ask.
    """

    def __init__(self, setup: VehicleSetup) -> None:
        values = parameter_values(setup.parameters)
        self._setup = setup
        self._is_asked = setup.autopilot is Autopilot.PX4 and bool(values.get("COM_ARM_AUTH_REQ"))
        self._authoriser = int(values.get("COM_ARM_AUTH_ID", 0))
        self._timeout_s = values.get("COM_ARM_AUTH_TO", 2.0)
        self.state = ArmingState.DISARMED
        self.denial: tuple[int, int] | None = None
        """MAV_ARM_AUTH_DENIED_REASON and what goes with it, of the last denial that had one."""
        self.authorised_s: float | None = None
        """For how long the last answer let it arm. [s]"""
        self.deadline_s = NEVER_S

    def request(self, now_s: float) -> tuple[Message, ...]:
        """Try to arm; without an authoriser it succeeds at once."""
        if self.state in {ArmingState.ASKING, ArmingState.ARMED}:
            return ()
        self.denial = None
        if not self._is_asked:
            self.state = ArmingState.ARMED
            return (self._setup.text(_INFO, "SIMULATED: armed"),)
        self.state = ArmingState.ASKING
        self.deadline_s = now_s + self._timeout_s
        return (
            message(
                "COMMAND_LONG",
                target_system=self._authoriser,
                target_component=0,
                command=ARM_AUTHORIZATION_REQUEST,
                param1=float(self._setup.system),
            ),
        )

    def disarm(self) -> tuple[Message, ...]:
        """Disarm, landed."""
        self.state = ArmingState.DISARMED
        return (self._setup.text(_INFO, "SIMULATED: landed and disarmed"),)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        if (
            self.state is not ArmingState.ASKING
            or received.name != "COMMAND_ACK"
            or received["command"] != ARM_AUTHORIZATION_REQUEST
            or received.system != self._authoriser
        ):
            return ()
        match received["result"]:
            case result if result == _ACCEPTED:
                self._settle(ArmingState.ARMED)
                self.authorised_s = float(received["result_param2"])
                return (self._setup.text(_INFO, "SIMULATED: arming authorised, armed"),)
            case result if result == _IN_PROGRESS:
                self.deadline_s = now_s + self._timeout_s
                return ()
            case result if result == _TEMPORARILY_REJECTED:
                return self._denied("Arming denied by authorizer: wait")
        self.denial = (received["progress"], received["result_param2"])
        reason, extra = self.denial
        text = f"Arming denied: {_REASONS.get(reason, f'reason {reason}')}"
        if reason in _NUMBERED:
            text += f" {extra}"
        return self._denied(text)

    def expire(self, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every server
        """Give up waiting for the authoriser."""
        return self._denied("Arming denied: no answer by authorizer")

    def _denied(self, text: str) -> tuple[Message, ...]:
        self._settle(ArmingState.DENIED)
        return (self._setup.text(_CRITICAL, text),)

    def _settle(self, state: ArmingState) -> None:
        self.state = state
        self.deadline_s = NEVER_S
