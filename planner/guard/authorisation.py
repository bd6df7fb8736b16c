"""Arm authorisation: a vehicle asks before it arms, and gets an answer.

PX4 asks with MAV_CMD_ARM_AUTHORIZATION_REQUEST and takes the COMMAND_ACK for the answer
(``ArmAuthorization.cpp``): ``result_param2`` of an acceptance is the time it holds, in which PX4
neither asks again nor listens; of a denial ``progress`` is the reason and ``result_param2`` its item
or code.  IN_PROGRESS does not lengthen its wait.
"""

from __future__ import annotations

import math
import queue
from enum import IntEnum, StrEnum
from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.errors import LinkError, libraries_of
from planner.link.connection import OWN_COMPONENT
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.findings import Finding, Severity
    from planner.link.connection import Connection


ARM_AUTHORISATION_REQUEST = 3001
"""MAV_CMD_ARM_AUTHORIZATION_REQUEST."""
_DEFAULT_WAIT_S = 1.0
"""PX4's own COM_ARM_AUTH_TO. [s]"""
_METHODS = {0: "the first arming waits for the answer", 1: "arm twice: the first time asks"}
"""By COM_ARM_AUTH_MET."""
_TWO_STEPS = 1
_SHORTEST_S = 0
"""An answer that the arming itself waits for is used as it comes: PX4 1.17 arms by one that holds for no
time, and asks again at the next arming. [s]"""
_ENOUGH_WAIT_S = 5.0
"""COM_ARM_AUTH_TO in which mission, fence, rally points and parameters are confirmed on a busy computer
too; 2 s were too short on one. [s]"""
_ARM_AGAIN_S = 5
"""In which a pilot reads that arming was authorised, and arms a second time. [s]"""


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


class ArmRequest(Value):
    """One message in which a vehicle asks."""

    system: int
    component: int
    number: int = 0
    """Counts them; a repetition is a request of its own."""


class ArmAnswer(Value):
    """What a request is answered."""

    result: ArmResult
    text: str
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


class ArmingSettings(Value):
    """How a vehicle is set to ask."""

    is_asking: bool | None
    """Whether it asks this authoriser before it arms; ``None``: unknown, its parameters were not read."""
    wait_s: float
    """How long it waits for an answer. [s]"""
    holds_s: int
    """How long an acceptance has to hold, so that it arms by it. [s]"""
    advice: str
    """What is to be known, and set on the vehicle by its pilot; never empty."""


UNREAD_SETTINGS = ArmingSettings(
    is_asking=None,
    wait_s=_DEFAULT_WAIT_S,
    holds_s=_SHORTEST_S,
    advice="whether the vehicle asks before arming is unknown, its parameters were not read: the verdict "
    "is announced, and a request is answered",
)


def arming_settings(parameters: Mapping[str, float | None], *, authoriser: int) -> ArmingSettings:
    """Return how a vehicle's parameters, by name, make it ask this program's system id."""
    asked = (value for name, value in parameters.items() if name.startswith("COM_ARM_AUTH_"))
    if any(value is not None and not math.isfinite(value) for value in asked):
        return UNREAD_SETTINGS
    wanted, named = parameters.get("COM_ARM_AUTH_REQ"), parameters.get("COM_ARM_AUTH_ID")
    wait_s = parameters.get("COM_ARM_AUTH_TO") or _DEFAULT_WAIT_S
    number = round(parameters.get("COM_ARM_AUTH_MET") or 0.0)
    is_asking = False
    if wanted is None:
        advice = "this autopilot does not ask before arming: the verdict is only announced"
    elif not wanted:
        advice = (
            "the vehicle is not set to ask before arming: the verdict is only announced; it asks "
            f"with COM_ARM_AUTH_REQ 1, COM_ARM_AUTH_ID {authoriser} and COM_ARM_AUTH_TO "
            f"{_ENOUGH_WAIT_S:g}"
        )
    elif named is None or round(named) != authoriser:
        other = "nobody" if named is None else f"system {named:g}"
        advice = (
            f"the vehicle asks {other} before arming, not this program: set COM_ARM_AUTH_ID "
            f"{authoriser}; until then the verdict is only announced"
        )
    else:
        is_asking = True
        method = _METHODS.get(number, "by an unknown method")
        advice = f"the vehicle asks before arming ({method}; it waits {wait_s:g} s)"
        if wait_s < _ENOUGH_WAIT_S:
            advice += f"; set COM_ARM_AUTH_TO {_ENOUGH_WAIT_S:g} for slow links and busy computers"
    holds_s = _ARM_AGAIN_S if number == _TWO_STEPS else _SHORTEST_S
    return ArmingSettings(is_asking=is_asking, wait_s=wait_s, holds_s=holds_s, advice=advice)


_OF_ITEMS = "MALTF"
"""Families about items: mission, altitude, file, time, fence."""
_MOST_CHARACTERS = 50
"""Of one STATUSTEXT."""


class Verdict(StrEnum):
    """What is held of a vehicle on the line."""

    GO = "go"
    NO_GO = "no-go"
    UNKNOWN = "unknown"
    """No verdict: never a go."""


class Judgement(Value):
    """What a check comes to."""

    verdict: Verdict
    text: str
    """One sentence: why it is no go, or what is left of a go."""
    headline: str
    """The same for the pilot's ground station, at most 50 characters."""
    reason: DenialReason = DenialReason.GENERIC
    extra_info: int = 0
    """Item of an invalid waypoint; with a generic reason or the weather the number of the code."""
    code: str = ""
    """Of the worst finding of a no-go."""
    item: int | None = None


def go_judgement(*, margin_wh: float | None) -> Judgement:
    """Return the judgement of a check without objection, which leaves this much above the reserve."""
    left = "" if margin_wh is None else f", {quantity.energy(margin_wh)} above the reserve"
    return Judgement(
        verdict=Verdict.GO, text=f"go{left}", headline=f"mavjoule: GO{left}"[:_MOST_CHARACTERS]
    )


def no_go_judgement(findings: Sequence[Finding], *, fail_on: Severity) -> Judgement:
    """Return the judgement of findings, worst first, of which one is as bad as ``fail_on``.

    Wind is bad weather; a fence without an item to blame is airspace; what an item holds makes it an
    invalid waypoint, numbered as reports count it; all else is generic.
    """
    objections = [finding for finding in findings if finding.severity >= fail_on]
    worst = objections[0]
    family, number = worst.code[0], int(worst.code[1:])
    if family == "W":
        reason, extra = DenialReason.BAD_WEATHER, number
    elif family in _OF_ITEMS and worst.item is not None:
        reason, extra = DenialReason.INVALID_WAYPOINT, worst.item
    elif family == "F":
        reason, extra = DenialReason.AIRSPACE_IN_USE, 0  # it would be a waypoint
    else:
        reason, extra = DenialReason.GENERIC, number
    where = "" if worst.item is None else f" item {worst.item}"
    others = len(objections) - 1
    more = "" if not others else f" (+{others})"
    head = f"mavjoule: NO-GO {worst.code}{where}{more}"
    named = f"mavjoule: NO-GO {worst.code} {worst.name}{where}{more}"
    return Judgement(
        verdict=Verdict.NO_GO,
        text=f"{worst.code} {worst.name}{where}: {worst.message}"
        + (f", and {quantity.count(others, 'more finding')}" if others else ""),
        headline=(named if len(named) <= _MOST_CHARACTERS else head)[:_MOST_CHARACTERS],
        reason=reason,
        extra_info=extra,
        code=worst.code,
        item=worst.item,
    )


def unknown_judgement(why: str) -> Judgement:
    """Return the judgement where no check can be made, for a reason in one sentence."""
    return Judgement(
        verdict=Verdict.UNKNOWN,
        text=why,
        headline=f"mavjoule: NO VERDICT, {why}"[:_MOST_CHARACTERS],
    )


class MavsdkAuthoriser:
    """An `planner.guard.session.Authoriser`; to be closed.

    MAVSDK gets every byte that the line brings, and what it sends goes out through the line's gate:
    there is one line, one system id and one list of what may be sent.
    """

    def __init__(self, connection: Connection) -> None:
        with libraries_of("link"):
            import mavsdk
            from mavsdk.plugins import arm_authorizer_server as plugin
        mavsdk.log_subscribe(lambda *_: True)  # it would talk to standard error
        self._connection = connection
        self._plugin: Any = plugin.arm_authorizer_server
        self._asked: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._number = 0
        configuration = mavsdk.Configuration.create_manual(
            connection.own_system,
            OWN_COMPONENT,
            False,  # noqa: FBT003 - MAVSDK's own; heartbeats are the connection's
        )
        self._mavsdk = mavsdk.Mavsdk(configuration)
        self._mavsdk.add_any_connection("raw://")
        self._mavsdk.subscribe_raw_bytes_to_be_sent(
            lambda frame: connection.send_frame(bytes(frame))
        )
        self._server = self._plugin.ArmAuthorizerServer(self._mavsdk.server_component(0))
        # MAVSDK wants its answers from another thread than its callback's.
        self._server.subscribe_arm_authorization(lambda system, _: self._asked.put(system))
        connection.on_frame = self._mavsdk.pass_received_raw_bytes

    def requests(self) -> tuple[ArmRequest, ...]:
        """Return the requests that came since the last call."""
        found: list[ArmRequest] = []
        vehicle = self._connection.vehicle
        while not self._asked.empty():
            self._asked.get()  # a system id that PX4 leaves 0
            self._number += 1
            found.append(
                ArmRequest(system=vehicle.system, component=vehicle.component, number=self._number)
            )
        return tuple(found)

    def answer(self, answer: ArmAnswer) -> None:
        """Answer a request; `LinkError` where MAVSDK does not send it."""
        try:
            if answer.is_accepted:
                self._server.accept_arm_authorization(answer.valid_for_s)
            else:
                reason = self._plugin.RejectionReason(int(answer.reason))
                is_temporary = answer.result.value == 1
                self._server.reject_arm_authorization(is_temporary, reason, answer.extra_info)
        except self._plugin.ArmAuthorizerServerError as error:
            msg = f"MAVSDK could not send the answer to an arm request: {error}"
            raise LinkError(msg) from error

    def close(self) -> None:
        """Leave the line."""
        self._connection.on_frame = None
        self._server.destroy()
        self._mavsdk.destroy()
