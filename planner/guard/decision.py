"""The guard: decides whether a vehicle may arm, from what happens on the line, in any order.

It opens no line and reads no clock: it is fed events with their times and returns what is to be done.
A request is accepted only where every part that the verdict rests on was read, nothing has changed
since by any sign, the check of exactly these parts is a go, and the vehicle has confirmed them at the
time of the request.  Whatever else is the case is a rejection with its reason.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from planner.guard.authorisation import ArmAnswer, ArmResult, Verdict, unknown_judgement
from planner.values import Value, field

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.guard.authorisation import ArmRequest, Judgement


class VehiclePart(StrEnum):
    """A part of what a verdict rests on."""

    MISSION = "mission"
    FENCE = "fence"
    RALLY = "rally points"
    PARAMETERS = "parameters"
    HOME = "home"
    BATTERY = "battery"


READ_PARTS = (VehiclePart.MISSION, VehiclePart.FENCE, VehiclePart.RALLY, VehiclePart.PARAMETERS)
"""Parts that the vehicle is asked for; it reports the others by itself."""


class GuardSettings(Value):
    """How a guard decides."""

    valid_for_s: int | None = None
    """How long an acceptance holds: PX4 does not ask again in this time, nor does it listen; ``None``: no
    longer than the vehicle needs to arm by it. [s]"""
    silence_s: float = 5.0
    """A vehicle that is not heard for so long may have changed meanwhile. [s]"""
    debounce_s: float = 0.5
    """Changes closer together than this are one. [s]"""
    longest_debounce_s: float = 3.0
    """So long after the first of them they are looked at, whatever still comes. [s]"""
    oldest_s: float = 60.0
    """What was read is read again after this time; nothing rests on what is twice as old. [s]"""
    confirmed_s: float = 0.0
    """A request is accepted only on what was read, or confirmed, after it, or so shortly before. [s]"""
    answer_fraction: float = 0.7
    """Fraction of the time the vehicle waits in which it gets its answer. [-]"""
    retry_s: float = 5.0
    """After which a part that could not be read is tried again. [s]"""
    announce_every_s: float = 10.0
    """Announcements are not closer together, but for urgent ones. [s]"""
    lost_after_s: float = 30.0
    """A vehicle that is not heard for so long is lost. [s]"""
    warn_before_s: float = 60.0
    """How long before the point of no return to warn. [s]"""
    is_observing: bool = False
    """Whether requests stay unanswered and nothing is announced."""
    counts_charge: bool = True
    """Whether the verdict rests on the charge that the vehicle reports, and not on one that was given."""


class MessageHeard(Value):
    """Any message of the vehicle."""


class TimePassed(Value):
    """Time has passed."""


class PartChanged(Value):
    """A sign that a part is no longer what was read."""

    part: VehiclePart
    why: str
    """Such as: ``MISSION_CURRENT counts 12 items``."""


class PartRead(Value):
    """A part was read, confirmed to be as before, or reported by the vehicle."""

    part: VehiclePart
    fingerprint: str
    """Equal fingerprints are equal parts."""


class PartUnread(Value):
    """A part could not be read."""

    part: VehiclePart
    why: str


class Judged(Value):
    """The vehicle was checked."""

    fingerprints: Mapping[VehiclePart, str]
    judgement: Judgement


class ArmRequested(Value):
    """The vehicle asks whether it may arm."""

    request: ArmRequest


class ArmingStatus(Value):
    """How the vehicle is set to ask, and whether it has armed."""

    is_asking: bool
    wait_s: float
    """How long it waits for an answer. [s]"""
    holds_s: int = 0
    """How long an acceptance has to hold, so that it arms by it. [s]"""
    is_armed: bool = False


Event: TypeAlias = (
    MessageHeard
    | TimePassed
    | PartChanged
    | PartRead
    | PartUnread
    | Judged
    | ArmRequested
    | ArmingStatus
)


class ReadParts(Value):
    """Read parts, or confirm by less that they are as before."""

    parts: tuple[VehiclePart, ...]
    is_urgent: bool = False


class CheckVehicle(Value):
    """Check what was read; `Judged` is its answer."""


class AnswerRequest(Value):
    """Answer a request."""

    request: ArmRequest
    answer: ArmAnswer


class Withdraw(Value):
    """Answer a request that was accepted once more, by a rejection, whether it is heard or not."""

    request: ArmRequest
    answer: ArmAnswer


class Announce(Value):
    """Send a text to the pilot's ground station."""

    severity: int
    """MAV_SEVERITY."""
    text: str
    """At most 50 characters."""


class Decision(Value):
    """Something for the log."""

    kind: str
    """``verdict``, ``answer``, ``withdrawn``, ``link`` or ``change``."""
    verdict: Verdict
    text: str
    details: Mapping[str, object] = field(default_factory=dict)


Action: TypeAlias = ReadParts | CheckVehicle | AnswerRequest | Withdraw | Announce | Decision


class GuardView(Value):
    """What a guard holds at one time, for a status line."""

    verdict: Verdict
    text: str
    age_s: float | None
    """Since the oldest of the parts it rests on was read or confirmed; ``None`` without one. [s]"""


_STALE_FACTOR = 2.0
"""Nothing rests on what is so many times as old as it should be."""
_PLURAL = frozenset({VehiclePart.PARAMETERS, VehiclePart.RALLY})


class _Obstacle(Value):
    """Why a request is not accepted."""

    judgement: Judgement
    key: object
    """Equal for what is the same to a pilot."""
    may_pass: bool = False
    """Whether it may be gone within the time the vehicle waits."""


def _unknown(text: str, *, key: object, may_pass: bool = False) -> _Obstacle:
    return _Obstacle(judgement=unknown_judgement(text), key=key, may_pass=may_pass)


class _PartReading:
    """One part."""

    def __init__(self) -> None:
        self.fingerprint: str | None = None
        self.began_s = -math.inf
        """When the latest successful reading began. [s]"""
        self.notices = 0
        """Signs of a change so far."""
        self.notices_read = 0
        """How many there were when the latest successful reading began."""
        self.why = ""
        self.first_notice_s = self.notice_s = -math.inf
        self.failure = ""
        self.failed_s = -math.inf
        self.asked: tuple[float, int] | None = None
        """When the present reading began, and how many notices there were."""

    @property
    def is_unread(self) -> bool:
        """Whether the part is not as it was read, for all that is known."""
        return self.fingerprint is None or self.notices_read < self.notices or bool(self.failure)


class Readings:
    """What is known of the parts, without each of which there is no verdict."""

    def __init__(self, settings: GuardSettings) -> None:
        self._settings = settings
        self._of = {part: _PartReading() for part in VehiclePart}

    def notice(self, part: VehiclePart, why: str, now_s: float) -> None:
        """Take a sign that a part has changed."""
        reading = self._of[part]
        if reading.notices_read == reading.notices:
            reading.first_notice_s = now_s
        reading.notices += 1
        reading.notice_s = now_s
        reading.why = why

    def read(self, part: VehiclePart, fingerprint: str, now_s: float) -> None:
        """Take a part that was asked for, or reported by the vehicle; others are passed over."""
        reading = self._of[part]
        if part in READ_PARTS:
            if reading.asked is None:
                return
            reading.began_s, reading.notices_read = reading.asked
        else:
            reading.began_s, reading.notices_read = now_s, reading.notices
        reading.asked = None
        reading.fingerprint = fingerprint
        reading.failure = ""

    def failed(self, part: VehiclePart, why: str, now_s: float) -> None:
        """Take it that a part could not be read."""
        reading = self._of[part]
        reading.asked = None
        reading.failure = why
        reading.failed_s = now_s

    @property
    def is_complete(self) -> bool:
        """Whether every part is as it was read, for all that is known."""
        return not any(reading.is_unread for reading in self._of.values())

    def fingerprints(self) -> dict[VehiclePart, str]:
        """Return the fingerprints of the parts that were read."""
        known = ((part, reading.fingerprint) for part, reading in self._of.items())
        return {part: fingerprint for part, fingerprint in known if fingerprint is not None}

    def mark(self) -> object:
        """Return a value that changes with any part that is read, or any sign of a change of one."""
        return tuple((self._of[p].fingerprint, self._of[p].notices) for p in READ_PARTS)

    def age_s(self, now_s: float) -> float | None:
        """Return the age of the oldest part; ``None`` while one was never read [s]."""
        age_s = now_s - min(reading.began_s for reading in self._of.values())
        return age_s if math.isfinite(age_s) else None

    def confirmed_since(self, since_s: float) -> bool:
        """Return whether every part that is asked for was read from a time on."""
        return all(self._of[part].began_s >= since_s for part in READ_PARTS)

    def obstacle(self, now_s: float) -> _Obstacle | None:
        """Return why no verdict can rest on the parts; ``None`` where one can."""
        oldest_s = _STALE_FACTOR * self._settings.oldest_s
        for part, reading in self._of.items():
            be = "are" if part in _PLURAL else "is"
            have = "have" if part in _PLURAL else "has"
            may_pass = reading.asked is not None
            if reading.failure:
                text, may_pass = f"the {part} could not be read: {reading.failure}", False
            elif reading.fingerprint is None:
                text = f"the {part} {have} not been read yet"
            elif reading.is_unread:
                text = f"the {part} may have changed and {be} read again ({reading.why})"
                may_pass = True
            elif now_s - reading.began_s > oldest_s:
                text = f"the {part} {have} not been heard of for more than {oldest_s:g} s"
            else:
                continue
            return _unknown(text, key="reading" if may_pass else text, may_pass=may_pass)
        return None

    def due(self, now_s: float, *, confirmed_since_s: float | None) -> tuple[VehiclePart, ...]:
        """Return the parts to ask for now; they then count as asked for.

        A request waits for every part to have been read since ``confirmed_since_s``. [s]
        """
        parts = tuple(
            part for part in READ_PARTS if self._is_due(self._of[part], now_s, confirmed_since_s)
        )
        for part in parts:
            self._of[part].asked = (now_s, self._of[part].notices)
        return parts

    def _is_due(self, reading: _PartReading, now_s: float, confirmed_since_s: float | None) -> bool:
        settings = self._settings
        if reading.asked is not None:
            return False
        if reading.failure:
            return now_s - reading.failed_s >= settings.retry_s
        if confirmed_since_s is not None and reading.began_s < confirmed_since_s:
            return True
        if reading.notices_read < reading.notices:
            return (
                confirmed_since_s is not None
                or now_s - reading.notice_s >= settings.debounce_s
                or now_s - reading.first_notice_s >= settings.longest_debounce_s
            )
        return reading.fingerprint is None or now_s - reading.began_s >= settings.oldest_s


_ALERT, _CRITICAL, _ERROR, _WARNING, _NOTICE = 1, 2, 3, 4, 5
"""MAV_SEVERITY."""
_SEVERITIES = {Verdict.GO: _NOTICE, Verdict.NO_GO: _ERROR, Verdict.UNKNOWN: _WARNING}
_SETTLED_S = 2.0
"""Without a verdict for a shorter time is no change of it. [s]"""
_INSIST_S = 1.0
"""So often it is said that an acceptance is withdrawn, while the vehicle may arm by it. [s]"""
_ARMED_SEEN_S = 2.0
"""After which a vehicle that has armed is known to have: two heartbeats. [s]"""
_WITHDRAWN = "mavjoule: DO NOT ARM, go withdrawn"
_MOST_PENDING = 16
"""Requests held at a time; a vehicle repeats one about three times."""


class _Acceptance(Value):
    """A request that was accepted."""

    request: ArmRequest
    until_s: float
    """The latest at which the vehicle arms by it. [s]"""
    mark: object
    """What it rests on."""


class Guard:
    """The state of a guarded vehicle, by any clock that never goes back."""

    def __init__(self, settings: GuardSettings, *, now_s: float) -> None:
        self._settings = settings
        self._readings = Readings(settings)
        self._judged: Judged | None = None
        self._is_checking = False
        self._is_asking = False
        self._wait_s = 1.0
        self._holds_s = 0
        self._is_armed = False
        self._heard_s = now_s
        self._pending: list[tuple[ArmRequest, float]] = []
        self._accepted: _Acceptance | None = None
        self._withdrawn: _Acceptance | None = None
        self._insisted_s = -math.inf
        self._unknown_since_s = now_s
        self._reported_key: object = None
        self._announced: dict[object, float] = {}
        self._announced_key: object = None
        self._announced_s = -math.inf

    def take(self, event: Event, now_s: float) -> tuple[Action, ...]:
        """Return what is to be done about an event, in this order."""
        actions: list[Action] = []
        match event:
            case MessageHeard():
                actions += self._hear(now_s)
            case PartChanged(part=part, why=why):
                self._readings.notice(part, why, now_s)
            case PartRead(part=part, fingerprint=fingerprint):
                self._readings.read(part, fingerprint, now_s)
            case PartUnread(part=part, why=why):
                self._readings.failed(part, why, now_s)
            case Judged():
                self._judged, self._is_checking = event, False
            case ArmRequested(request=request):
                actions += self._hear(now_s)
                actions += self._hold(request, now_s)
            case ArmingStatus():
                self._is_asking, self._is_armed = event.is_asking, event.is_armed
                self._wait_s, self._holds_s = event.wait_s, event.holds_s
            case TimePassed():
                pass
        actions += self._decide(now_s)
        actions += self._report(now_s)
        actions += self._work(now_s)
        return tuple(actions)

    def view(self, now_s: float) -> GuardView:
        """Return what is held now."""
        obstacle = self._obstacle(now_s)
        return GuardView(
            verdict=Verdict.GO if obstacle is None else obstacle.judgement.verdict,
            text=self._text(obstacle),
            age_s=self._readings.age_s(now_s),
        )

    def _text(self, obstacle: _Obstacle | None) -> str:
        if obstacle is not None:
            return obstacle.judgement.text
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
        answer = _rejection(unknown_judgement("more requests came than can be answered"))
        return [AnswerRequest(request=oldest, answer=answer)]

    def _obstacle(self, now_s: float) -> _Obstacle | None:
        silent_s = now_s - self._heard_s
        if silent_s > self._settings.silence_s:
            return _unknown(f"the vehicle was not heard for {silent_s:.0f} s", key="silent")
        if (unread := self._readings.obstacle(now_s)) is not None:
            return unread
        if self._judged is None or self._judged.fingerprints != self._readings.fingerprints():
            return _unknown("the vehicle is being checked", key="checking", may_pass=True)
        judgement = self._judged.judgement
        if judgement.verdict is Verdict.GO:
            return None
        same = (judgement.verdict, judgement.code, judgement.item)
        return _Obstacle(judgement=judgement, key=same)

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
            if answer.is_accepted:
                # It reached the vehicle while it waited, or not at all.
                until_s = asked_s + self._wait_s + answer.valid_for_s
                self._accepted = _Acceptance(
                    request=request, until_s=until_s, mark=self._readings.mark()
                )
                self._withdrawn = None
        self._pending = waiting
        return actions + self._withdrawal(obstacle, now_s)

    def _answer(self, obstacle: _Obstacle | None, asked_s: float, now_s: float) -> ArmAnswer | None:
        """Return the answer to a request; ``None`` while it is waited for."""
        in_time = now_s < asked_s + self._settings.answer_fraction * self._wait_s
        if obstacle is None:
            if self._readings.confirmed_since(asked_s - self._settings.confirmed_s):
                assert self._judged is not None  # else there were an obstacle
                return ArmAnswer(
                    result=ArmResult.ACCEPTED,
                    text=self._judged.judgement.text,
                    valid_for_s=self._valid_for_s,
                )
            late = (
                "the vehicle could not be read again before it stops waiting: arm once more; a slow "
                "link needs a longer COM_ARM_AUTH_TO, or --confirm-within"
            )
            return None if in_time else _rejection(unknown_judgement(late))
        if obstacle.may_pass and in_time:
            return None
        return _rejection(obstacle.judgement)

    @property
    def _valid_for_s(self) -> int:
        given_s = self._settings.valid_for_s
        return self._holds_s if given_s is None else given_s

    def _answered(
        self, request: ArmRequest, answer: ArmAnswer, obstacle: _Obstacle | None, now_s: float
    ) -> list[Action]:
        verdict = Verdict.GO if obstacle is None else obstacle.judgement.verdict
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
            AnswerRequest(request=request, answer=answer),
            Decision(kind="answer", verdict=verdict, text=answer.text, details=details),
        ]
        if answer.is_accepted:
            return actions
        head = "mavjoule: arm once more" if obstacle is None else obstacle.judgement.headline
        severity = _ERROR if answer.result is ArmResult.DENIED else _WARNING
        # PX4 names a reason at most: the ground station gets the code.
        return actions + self._announcement(severity, head, now_s)

    def _withdrawal(self, obstacle: _Obstacle | None, now_s: float) -> list[Action]:
        """Withdraw an acceptance that still holds for the vehicle, but no longer for us."""
        accepted = self._accepted
        if accepted is None:
            return self._insistence(now_s)
        if now_s > accepted.until_s:
            self._accepted = None
            return []
        if self._is_armed:
            return []  # PX4 arms again by it after landing, as long as it holds
        is_no_go = obstacle is not None and obstacle.judgement.verdict is Verdict.NO_GO
        if obstacle is None or not (is_no_go or accepted.mark != self._readings.mark()):
            return []
        self._accepted, self._withdrawn, self._insisted_s = None, accepted, now_s
        text = f"authorisation withdrawn: do not arm ({obstacle.judgement.text})"
        return [
            # PX4 is deaf to it while it holds the acceptance; whoever else asks may not be.
            Withdraw(request=accepted.request, answer=_rejection(obstacle.judgement)),
            Decision(kind="withdrawn", verdict=obstacle.judgement.verdict, text=text),
            Announce(severity=_CRITICAL, text=_WITHDRAWN),
        ]

    def _insistence(self, now_s: float) -> list[Action]:
        """Say again that an acceptance is withdrawn, and that the vehicle has armed by it."""
        withdrawn = self._withdrawn
        if withdrawn is None:
            return []
        if self._is_armed:
            self._withdrawn = None
            text = "the vehicle has armed by an authorisation that was withdrawn: disarm it"
            return [
                Decision(kind="withdrawn", verdict=Verdict.NO_GO, text=text),
                Announce(severity=_ALERT, text="mavjoule: ARMED ON A WITHDRAWN GO, DISARM"),
            ]
        if now_s > withdrawn.until_s + _ARMED_SEEN_S:
            self._withdrawn = None
        if now_s > withdrawn.until_s or now_s - self._insisted_s < _INSIST_S:
            return []
        self._insisted_s = now_s
        return [Announce(severity=_CRITICAL, text=_WITHDRAWN)]

    def _report(self, now_s: float) -> list[Action]:
        """Log a change of the verdict; announce it where the vehicle does not ask."""
        obstacle = self._obstacle(now_s)
        if obstacle is None or obstacle.judgement.verdict is not Verdict.UNKNOWN:
            self._unknown_since_s = now_s
        verdict = Verdict.GO if obstacle is None else obstacle.judgement.verdict
        unknown_s = now_s - self._unknown_since_s
        if verdict is Verdict.UNKNOWN and unknown_s < _SETTLED_S:
            return []
        key = verdict if obstacle is None else (verdict, obstacle.key)
        actions: list[Action] = []
        judgement = None if self._judged is None else self._judged.judgement
        if key != self._reported_key:
            self._reported_key = key
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
            head = head if obstacle is None else obstacle.judgement.headline
            actions += self._announcement(_SEVERITIES[verdict], head, now_s)
        return actions

    def _announcement(self, severity: int, text: str, now_s: float) -> list[Action]:
        """Announce a text, unless it was just announced."""
        if now_s - self._announced.get(text, -math.inf) < self._settings.announce_every_s:
            return []
        self._announced = {
            text: text_s
            for text, text_s in self._announced.items()
            if now_s - text_s < self._settings.announce_every_s
        }
        self._announced[text] = self._announced_s = now_s
        return [Announce(severity=severity, text=text)]

    def _work(self, now_s: float) -> list[Action]:
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


def _rejection(why: Judgement) -> ArmAnswer:
    is_lasting = why.verdict is Verdict.NO_GO
    return ArmAnswer(
        result=ArmResult.DENIED if is_lasting else ArmResult.TEMPORARILY_REJECTED,
        text=why.text,
        reason=why.reason,
        extra_info=why.extra_info,
    )
