"""A judgement: what a check of the vehicle on the line comes to, and the reason that fits a denial."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from planner import numbers
from planner.frozen import frozen
from planner.link.authorisation import DenialReason

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding, Severity

_OF_ITEMS = "MALTF"
"""Families about what an item says: mission, altitude, file, time, fence."""
_MOST_CHARACTERS = 50
"""Of one STATUSTEXT."""


class Verdict(StrEnum):
    """What is held of a vehicle on the line."""

    GO = "go"
    NO_GO = "no-go"
    UNKNOWN = "unknown"
    """Nothing can be said: never a go."""


@frozen
class Judgement:
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
    """Return the judgement of a check without objection.

    Parameters
    ----------
    margin_wh : float or None
        Energy left above the reserve. [Wh]
    """
    left = "" if margin_wh is None else f", {numbers.energy(margin_wh)} above the reserve"
    return Judgement(
        verdict=Verdict.GO, text=f"go{left}", headline=f"mavjoule: GO{left}"[:_MOST_CHARACTERS]
    )


def no_go_judgement(findings: Sequence[Finding], *, fail_on: Severity) -> Judgement:
    """Return the judgement of a check with objections.

    Parameters
    ----------
    findings : sequence of Finding
        Worst first, at least one as bad as ``fail_on``.
    fail_on : Severity
        From which severity on a finding is an objection.

    Notes
    -----
    Wind is bad weather; a fence without an item to blame is airspace; what an item says makes it an
    invalid waypoint, told as reports count it; all else is generic.
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
        + (f", and {numbers.count(others, 'objection')} more" if others else ""),
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
