"""What goes into a guard and what comes out of it, as values."""

from __future__ import annotations

from dataclasses import field
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.authorisation import ArmAnswer, ArmRequest
    from planner.link.judgement import Judgement, Verdict


class Part(StrEnum):
    """A part of what a verdict rests on."""

    MISSION = "mission"
    FENCE = "fence"
    RALLY = "rally points"
    PARAMETERS = "parameters"
    HOME = "home"
    BATTERY = "battery"


READ_PARTS = (Part.MISSION, Part.FENCE, Part.RALLY, Part.PARAMETERS)
"""Parts that the vehicle is asked for; it tells the others by itself."""


@frozen
class GuardSettings:
    """How a guard decides."""

    valid_for_s: int = 10
    """How long an acceptance holds: PX4 does not ask again in this time, nor can be told. [s]"""
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
    answer_share: float = 0.7
    """Share of the time the vehicle waits in which it gets its answer. [-]"""
    retry_s: float = 5.0
    """After which a part that could not be read is tried again. [s]"""
    announce_every_s: float = 10.0
    """Announcements are not closer together, but for urgent ones. [s]"""
    needed: frozenset[Part] = frozenset(Part)
    """Parts without which there is no verdict."""


@frozen
class Heard:
    """Any message of the vehicle."""


@frozen
class Passed:
    """Time has passed."""


@frozen
class Changed:
    """A sign that a part is no longer what was read."""

    part: Part
    why: str
    """Such as: ``MISSION_CURRENT says 12 items``."""


@frozen
class Read:
    """A part was read, confirmed to be as before, or told by the vehicle."""

    part: Part
    fingerprint: str
    """Equal fingerprints are equal parts."""


@frozen
class Unread:
    """A part could not be read."""

    part: Part
    why: str


@frozen
class Judged:
    """The vehicle was checked."""

    fingerprints: Mapping[Part, str]
    """Of the parts that were checked."""
    judgement: Judgement


@frozen
class Asked:
    """The vehicle asks whether it may arm."""

    request: ArmRequest


@frozen
class Status:
    """How the vehicle is set to ask, and whether it has armed."""

    is_asking: bool
    wait_s: float
    """How long it waits for an answer. [s]"""
    is_armed: bool = False


Event: TypeAlias = Heard | Passed | Changed | Read | Unread | Judged | Asked | Status


@frozen
class ReadParts:
    """Read parts, or confirm by less that they are as before."""

    parts: tuple[Part, ...]
    is_urgent: bool = False
    """Whether a request waits for it."""


@frozen
class CheckVehicle:
    """Check what was read; `Judged` is its answer."""


@frozen
class Answer:
    """Answer a request."""

    request: ArmRequest
    answer: ArmAnswer


@frozen
class Announce:
    """Tell the pilot's ground station."""

    severity: int
    """MAV_SEVERITY."""
    text: str
    """At most 50 characters."""


@frozen
class Decision:
    """Something for the log."""

    kind: str
    """``verdict``, ``answer``, ``withdrawn``, ``link`` or ``change``."""
    verdict: Verdict
    text: str
    details: Mapping[str, object] = field(default_factory=dict)


Action: TypeAlias = ReadParts | CheckVehicle | Answer | Announce | Decision


@frozen
class GuardView:
    """What a guard holds at one time, for a status line."""

    verdict: Verdict
    text: str
    age_s: float | None
    """Since the oldest of the parts it rests on was read or confirmed; ``None`` without one. [s]"""
