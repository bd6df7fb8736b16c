"""Arm authorisation: a vehicle asks before it arms, and gets an answer.

PX4 asks with MAV_CMD_ARM_AUTHORIZATION_REQUEST and takes the COMMAND_ACK for the answer
(``ArmAuthorization.cpp``): ``result_param2`` of an acceptance is the time it holds, in which PX4 does
not ask again and cannot be told otherwise; of a denial ``progress`` is the reason and
``result_param2`` what goes with it.  IN_PROGRESS does not lengthen its wait.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

ARM_AUTHORISATION_REQUEST = 3001
"""MAV_CMD_ARM_AUTHORIZATION_REQUEST."""
_DEFAULT_WAIT_S = 1.0
"""PX4's own COM_ARM_AUTH_TO. [s]"""
_METHODS = {0: "the first arming waits for the answer", 1: "arm twice: the first time asks"}
"""By COM_ARM_AUTH_MET."""


class DenialReason(IntEnum):
    """MAV_ARM_AUTH_DENIED_REASON."""

    GENERIC = 0
    NONE = 1
    INVALID_WAYPOINT = 2
    TIMEOUT = 3
    AIRSPACE_IN_USE = 4
    BAD_WEATHER = 5


class ArmResult(IntEnum):
    """The values of MAV_RESULT that answer a request."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2


@frozen
class ArmRequest:
    """One message in which a vehicle asks."""

    system: int
    """Who asks."""
    component: int
    number: int = 0
    """Counts them; a repetition is a request of its own."""


@frozen
class ArmAnswer:
    """What a request is answered."""

    result: ArmResult
    text: str
    """Why, in one sentence."""
    valid_for_s: int = 0
    """How long an acceptance holds. [s]"""
    reason: DenialReason = DenialReason.GENERIC
    extra_info: int = 0
    """Item of an invalid waypoint; with a generic reason or the weather the number of the code."""

    @property
    def is_accepted(self) -> bool:
        """Whether the vehicle may arm."""
        return self.result is ArmResult.ACCEPTED


def acknowledgement_fields(request: ArmRequest, answer: ArmAnswer) -> dict[str, int]:
    """Return the fields of the COMMAND_ACK that answers a request."""
    is_accepted = answer.is_accepted
    return {
        "command": ARM_AUTHORISATION_REQUEST,
        "result": int(answer.result),
        "progress": 0 if is_accepted else int(answer.reason),
        "result_param2": answer.valid_for_s if is_accepted else answer.extra_info,
        "target_system": request.system,
        "target_component": request.component,
    }


@frozen
class ArmingSettings:
    """How a vehicle is set to ask."""

    is_asking: bool
    """Whether it asks this authoriser before it arms."""
    wait_s: float
    """How long it waits for an answer. [s]"""
    advice: str
    """What is to be known, and set on the vehicle by its pilot; never empty."""


def arming_settings(parameters: Mapping[str, float | None], *, authoriser: int) -> ArmingSettings:
    """Return how a vehicle is set to ask.

    Parameters
    ----------
    parameters : mapping of str to float
        All of the vehicle's parameters by their names.
    authoriser : int
        System id of this program on the line.
    """
    wanted = parameters.get("COM_ARM_AUTH_REQ")
    if wanted is None:
        return ArmingSettings(
            is_asking=False,
            wait_s=_DEFAULT_WAIT_S,
            advice="this autopilot does not ask before arming: the verdict is only announced",
        )
    named = parameters.get("COM_ARM_AUTH_ID")
    wait_s = parameters.get("COM_ARM_AUTH_TO") or _DEFAULT_WAIT_S
    if not wanted:
        advice = (
            "the vehicle is not set to ask before arming: the verdict is only announced; it asks "
            f"with COM_ARM_AUTH_REQ 1 and COM_ARM_AUTH_ID {authoriser}"
        )
        return ArmingSettings(is_asking=False, wait_s=wait_s, advice=advice)
    if named is None or round(named) != authoriser:
        other = "nobody" if named is None else f"system {named:g}"
        advice = (
            f"the vehicle asks {other} before arming, not this program: set COM_ARM_AUTH_ID "
            f"{authoriser}; until then the verdict is only announced"
        )
        return ArmingSettings(is_asking=False, wait_s=wait_s, advice=advice)
    method = _METHODS.get(round(parameters.get("COM_ARM_AUTH_MET") or 0.0), "by an unknown method")
    advice = f"the vehicle asks before arming ({method}; it waits {wait_s:g} s)"
    return ArmingSettings(is_asking=True, wait_s=wait_s, advice=advice)
