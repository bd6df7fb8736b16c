"""The guard: decides whether a vehicle may arm, from what happens on the line, in any order.

It opens no line and reads no clock: it is fed events with their times and returns what is to be done.
A request is accepted only where every part that the verdict rests on was read, nothing has changed
since by any sign, the check of exactly these parts is a go, and the vehicle has confirmed them at the
time of the request.  Whatever else is the case is a rejection that says why.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.frozen import frozen
from planner.link.authorisation import ArmAnswer, ArmResult, DenialReason
from planner.link.guarding import (
    READ_PARTS,
    Announce,
    Answer,
    Asked,
    Changed,
    CheckVehicle,
    Decision,
    GuardSettings,
    GuardView,
    Heard,
    Judged,
    Passed,
    Read,
    ReadParts,
    Status,
    Unread,
)
from planner.link.judgement import Verdict
from planner.link.readings import Readings

if TYPE_CHECKING:
    from planner.link.authorisation import ArmRequest
    from planner.link.guarding import Action, Event

_CRITICAL, _ERROR, _WARNING, _NOTICE = 2, 3, 4, 5
"""MAV_SEVERITY."""
_SEVERITIES = {Verdict.GO: _NOTICE, Verdict.NO_GO: _ERROR, Verdict.UNKNOWN: _WARNING}
_SETTLED_S = 2.0
"""Without a verdict for a shorter time is no change of it. [s]"""
_MOST_PENDING = 16
"""Requests held at a time; a vehicle repeats one about three times."""


@frozen
class _Obstacle:
    """What stands against accepting a request."""

    verdict: Verdict
    text: str
    headline: str
    may_pass: bool = False
    """Whether it may be gone within the time the vehicle waits."""
    reason: DenialReason = DenialReason.GENERIC
    extra_info: int = 0
    key: object = None
    """Equal for what is the same to a pilot."""


class Guard:
    """The state of a guarded vehicle.

    Parameters
    ----------
    settings : GuardSettings
        How it decides.
    now_s : float
        Any clock that never goes back. [s]
    """

    def __init__(self, settings: GuardSettings, *, now_s: float) -> None:
        self._settings = settings
        self._readings = Readings(settings)
        self._judged: Judged | None = None
        self._is_checking = False
        self._is_asking = False
        self._wait_s = 1.0
        self._is_armed = False
        self._heard_s = now_s
        self._pending: list[tuple[ArmRequest, float]] = []
        self._accepted: tuple[float, object] | None = None
        self._unknown_since_s = now_s
        self._told_key: object = None
        self._announced: dict[object, float] = {}
        self._announced_key: object = None
        self._announced_s = -math.inf

    def take(self, event: Event, now_s: float) -> tuple[Action, ...]:
        """Return what is to be done about an event, in this order.

        Parameters
        ----------
        event : Event
            What has happened.
        now_s : float
            When, not before the event before. [s]
        """
        actions: list[Action] = []
        match event:
            case Heard():
                actions += self._hear(now_s)
            case Changed(part=part, why=why):
                self._readings.notice(part, why, now_s)
            case Read(part=part, fingerprint=fingerprint):
                self._readings.read(part, fingerprint, now_s)
            case Unread(part=part, why=why):
                self._readings.failed(part, why, now_s)
            case Judged():
                self._judged, self._is_checking = event, False
            case Asked(request=request):
                actions += self._hear(now_s)
                actions += self._hold(request, now_s)
            case Status(is_asking=is_asking, wait_s=wait_s, is_armed=is_armed):
                self._is_asking, self._wait_s, self._is_armed = is_asking, wait_s, is_armed
            case Passed():
                pass
        actions += self._decide(now_s)
        actions += self._tell(now_s)
        actions += self._work(now_s)
        return tuple(actions)

    def view(self, now_s: float) -> GuardView:
        """Return what is held now."""
        obstacle = self._obstacle(now_s)
        return GuardView(
            verdict=Verdict.GO if obstacle is None else obstacle.verdict,
            text=self._text(obstacle),
            age_s=self._readings.age_s(now_s),
        )

    def _text(self, obstacle: _Obstacle | None) -> str:
        if obstacle is not None:
            return obstacle.text
        return "" if self._judged is None else self._judged.judgement.text

    def _hear(self, now_s: float) -> list[Action]:
        silent_s, self._heard_s = now_s - self._heard_s, now_s
        if silent_s <= self._settings.silence_s:
            return []
        why = f"the link was silent for {silent_s:.0f} s"
        for part in READ_PARTS:
            self._readings.notice(part, why, now_s)
        return [Decision(kind="link", verdict=Verdict.UNKNOWN, text=why)]

    def _hold(self, request: ArmRequest, now_s: float) -> list[Action]:
        self._pending.append((request, now_s))
        if len(self._pending) <= _MOST_PENDING:
            return []
        oldest, _ = self._pending.pop(0)
        answer = _rejection("more requests came than can be answered", is_lasting=False)
        return [Answer(request=oldest, answer=answer)]

    def _obstacle(self, now_s: float) -> _Obstacle | None:
        silent_s = now_s - self._heard_s
        if silent_s > self._settings.silence_s:
            return _unknown(f"the vehicle was not heard for {silent_s:.0f} s", key="silent")
        unread = self._readings.objection(now_s)
        if unread is not None:
            key = "reading" if unread.may_pass else unread.text
            return _unknown(unread.text, key=key, may_pass=unread.may_pass)
        if self._judged is None or self._judged.fingerprints != self._readings.fingerprints():
            return _unknown("the vehicle is being checked", key="checking", may_pass=True)
        judgement = self._judged.judgement
        if judgement.verdict is Verdict.GO:
            return None
        return _Obstacle(
            verdict=judgement.verdict,
            text=judgement.text,
            headline=judgement.headline,
            reason=judgement.reason,
            extra_info=judgement.extra_info,
            key=(judgement.verdict, judgement.code, judgement.item),
        )

    def _decide(self, now_s: float) -> list[Action]:
        """Answer the requests that can be, and withdraw what no longer holds."""
        obstacle = self._obstacle(now_s)
        actions: list[Action] = []
        waiting: list[tuple[ArmRequest, float]] = []
        for request, asked_s in self._pending:
            answer = self._answer(obstacle, asked_s, now_s)
            if answer is None:
                waiting.append((request, asked_s))
                continue
            actions += self._answered(request, answer, obstacle, now_s)
        self._pending = waiting
        return actions + self._withdrawal(obstacle, now_s)

    def _answer(self, obstacle: _Obstacle | None, asked_s: float, now_s: float) -> ArmAnswer | None:
        """Return the answer to a request; ``None`` while it is waited for."""
        in_time = now_s < asked_s + self._settings.answer_share * self._wait_s
        if obstacle is None:
            if self._readings.confirmed_since(asked_s - self._settings.confirmed_s):
                assert self._judged is not None  # else there were an obstacle
                return ArmAnswer(
                    result=ArmResult.ACCEPTED,
                    text=self._judged.judgement.text,
                    valid_for_s=self._settings.valid_for_s,
                )
            late = (
                "the vehicle could not be read again before it stops waiting: arm once more; a slow "
                "link needs a longer COM_ARM_AUTH_TO, or --confirm-within"
            )
            return None if in_time else _rejection(late, is_lasting=False)
        if obstacle.may_pass and in_time:
            return None
        return _rejection(
            obstacle.text,
            is_lasting=obstacle.verdict is Verdict.NO_GO,
            reason=obstacle.reason,
            extra_info=obstacle.extra_info,
        )

    def _answered(
        self, request: ArmRequest, answer: ArmAnswer, obstacle: _Obstacle | None, now_s: float
    ) -> list[Action]:
        verdict = Verdict.GO if obstacle is None else obstacle.verdict
        details: dict[str, object] = {
            "result": answer.result.name.lower(),
            "system": request.system,
            "component": request.component,
        }
        if answer.is_accepted:
            details["valid_for_s"] = answer.valid_for_s
        else:
            details |= {"reason": answer.reason.name.lower(), "extra_info": answer.extra_info}
        actions: list[Action] = [
            Answer(request=request, answer=answer),
            Decision(kind="answer", verdict=verdict, text=answer.text, details=details),
        ]
        if answer.is_accepted:
            self._accepted = (now_s + answer.valid_for_s, self._readings.mark())
            return actions
        head = "mavjoule: arm once more" if obstacle is None else obstacle.headline
        severity = _ERROR if answer.result is ArmResult.DENIED else _WARNING
        # PX4 names a reason at most: the ground station is told which.
        return actions + self._announcement(severity, head, now_s)

    def _withdrawal(self, obstacle: _Obstacle | None, now_s: float) -> list[Action]:
        """Say that an acceptance that still holds for the vehicle holds no longer for us."""
        if self._accepted is None:
            return []
        until_s, mark = self._accepted
        if now_s > until_s:
            self._accepted = None
            return []
        if self._is_armed:
            return []  # PX4 arms again by it after landing, as long as it holds
        is_no_go = obstacle is not None and obstacle.verdict is Verdict.NO_GO
        if obstacle is None or not (is_no_go or mark != self._readings.mark()):
            return []
        self._accepted = None
        text = f"an authorisation given is withdrawn, do not arm: {obstacle.text}"
        decision = Decision(kind="withdrawn", verdict=obstacle.verdict, text=text)
        head = "mavjoule: DO NOT ARM, go withdrawn"
        return [decision, *self._announcement(_CRITICAL, head, now_s)]

    def _tell(self, now_s: float) -> list[Action]:
        """Log a change of the verdict; announce it where the vehicle does not ask."""
        obstacle = self._obstacle(now_s)
        if obstacle is None or obstacle.verdict is not Verdict.UNKNOWN:
            self._unknown_since_s = now_s
        verdict = Verdict.GO if obstacle is None else obstacle.verdict
        unknown_s = now_s - self._unknown_since_s
        if verdict is Verdict.UNKNOWN and unknown_s < _SETTLED_S:
            return []
        key = verdict if obstacle is None else (verdict, obstacle.key)
        actions: list[Action] = []
        judgement = None if self._judged is None else self._judged.judgement
        if key != self._told_key:
            self._told_key = key
            details: dict[str, object] = {}
            if verdict is Verdict.NO_GO and judgement is not None:
                details = {"code": judgement.code, "item": judgement.item}
            text = self._text(obstacle)
            actions.append(Decision(kind="verdict", verdict=verdict, text=text, details=details))
        every_s = self._settings.announce_every_s
        may_announce = now_s - self._announced_s >= every_s
        is_settled = verdict is not Verdict.UNKNOWN or unknown_s >= every_s
        if not self._is_asking and key != self._announced_key and may_announce and is_settled:
            self._announced_key = key
            head = "" if judgement is None else judgement.headline
            head = head if obstacle is None else obstacle.headline
            actions += self._announcement(_SEVERITIES[verdict], head, now_s)
        return actions

    def _announcement(self, severity: int, text: str, now_s: float) -> list[Action]:
        """Announce a text, unless it was just announced."""
        if now_s - self._announced.get(text, -math.inf) < self._settings.announce_every_s:
            return []
        self._announced = {
            said: said_s
            for said, said_s in self._announced.items()
            if now_s - said_s < self._settings.announce_every_s
        }
        self._announced[text] = self._announced_s = now_s
        return [Announce(severity=severity, text=text)]

    def _work(self, now_s: float) -> list[Action]:
        """Return what is to be read and checked."""
        if now_s - self._heard_s > self._settings.silence_s:
            return []
        actions: list[Action] = []
        since_s = None
        if self._pending:
            since_s = min(asked_s for _, asked_s in self._pending) - self._settings.confirmed_s
        parts = self._readings.due(now_s, confirmed_since_s=since_s)
        if parts:
            actions.append(ReadParts(parts=parts, is_urgent=bool(self._pending)))
        if (
            not self._is_checking
            and self._readings.is_complete
            and (self._judged is None or self._judged.fingerprints != self._readings.fingerprints())
        ):
            self._is_checking = True
            actions.append(CheckVehicle())
        return actions


def _unknown(text: str, *, key: object, may_pass: bool = False) -> _Obstacle:
    return _Obstacle(
        verdict=Verdict.UNKNOWN,
        text=text,
        headline=f"mavjoule: NO VERDICT, {text}"[:50],
        may_pass=may_pass,
        key=key,
    )


def _rejection(
    text: str,
    *,
    is_lasting: bool,
    reason: DenialReason = DenialReason.GENERIC,
    extra_info: int = 0,
) -> ArmAnswer:
    return ArmAnswer(
        result=ArmResult.DENIED if is_lasting else ArmResult.TEMPORARILY_REJECTED,
        text=text,
        reason=reason,
        extra_info=extra_info,
    )
