"""The verdict in words and the figures a pilot asks for first; and what a change makes of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.report.text import against, caveat, closing_line, headline, printable
from planner.rules.energy import destination_name, place_along
from planner.service import CheckResult
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.flight.returns.tightest import ReturnPlan
    from planner.service import UnreadableMission


class Summary(Value):
    """What is said at the top."""

    verdict: str
    """``GO`` or ``NO-GO``."""
    is_go: bool
    file: str
    headline: str
    """What the flight takes and leaves."""
    return_plan: str
    """The tightest return; empty where none is known."""
    closing: str
    """How much was found."""


def summary(result: CheckResult | UnreadableMission) -> Summary:
    """Return the verdict and the figures of a flight in words."""
    way = result.return_plan if isinstance(result, CheckResult) else None
    return Summary(
        verdict=result.verdict.upper(),
        is_go=result.verdict == "go",
        file=printable(result.file) + caveat([result]),
        headline=headline(result),
        return_plan="" if way is None else _tightest(way),
        closing=closing_line(result.findings, suppressed=result.suppressed),
    )


def _tightest(way: ReturnPlan) -> str:
    where = f"item {way.tightest_item}" if way.tightest is None else place_along(way.tightest)
    text = (
        f"Tightest return: {where}, {quantity.energy(way.energy_home_wh)} to get "
        f"{destination_name(way.destination)}"
    )
    return text if way.margin_wh is None else f"{text}, {against(way.margin_wh, 'the reserve')}"


def differences(
    base: CheckResult | UnreadableMission, now: CheckResult | UnreadableMission
) -> tuple[tuple[str, str], ...]:
    """Return what a change makes of a flight, each figure with its label.

    Parameters
    ----------
    base, now : CheckResult or UnreadableMission
        Without and with the change.

    Returns
    -------
    tuple of (str, str)
        Label, and the figures before and after with their difference.
    """
    lines = [("Verdict", _arrow([base.verdict.upper(), now.verdict.upper()]))]
    if not (isinstance(base, CheckResult) and isinstance(now, CheckResult)):
        return tuple(lines)
    was, then = base.totals, now.totals
    pairs: list[tuple[str, float | None, float | None, Callable[[float | None], str]]] = [
        ("Time", was.time_s, then.time_s, quantity.duration),
        ("Energy", was.energy_wh, then.energy_wh, quantity.energy),
        ("Margin", _margin_wh(base), _margin_wh(now), quantity.energy),
        ("Return", _return_wh(base), _return_wh(now), quantity.energy),
    ]
    for name, before, after, shown in pairs:
        if before is None or after is None or math.isnan(before) or math.isnan(after):
            lines.append((name, _arrow([shown(before), shown(after)])))
        else:
            changed = signed(after - before, shown)
            lines.append((name, f"{_arrow([shown(before), shown(after)])} ({changed})"))
    return tuple(lines)


def signed(value: float, shown: Callable[[float | None], str]) -> str:
    """Return a difference with its sign: ``+5.20 Wh``, ``−12 s``, ``±0 s``."""
    if value == 0.0:
        return "no change"
    return f"{'+' if value > 0.0 else '−'}{shown(abs(value))}"


def _arrow(texts: Sequence[str]) -> str:
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)


def _margin_wh(result: CheckResult) -> float | None:
    return None if result.battery is None else result.battery.margin_wh


def _return_wh(result: CheckResult) -> float | None:
    return None if result.return_plan is None else result.return_plan.margin_wh
