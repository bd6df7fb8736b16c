"""The verdict in words and the figures a pilot asks for first; and what a change makes of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.figures import figures_at, number_at
from planner.report.json import figures
from planner.report.text import against, caveat, closing_line, headline, printable
from planner.rules.energy import destination_name, place_along
from planner.service import CheckResult
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.flight.returns.tightest import ReturnPlan
    from planner.service import UnreadableMission


_CHANGED = tuple(
    zip(
        ("Time", "Energy", "Margin", "Return"),
        figures_at("totals.time_s", "totals.energy_wh", "battery.margin_wh", "return.margin_wh"),
        strict=True,
    )
)
"""What a change is judged by, with labels that fit a narrow pane."""


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
    before, after = figures(base), figures(now)
    for name, figure in _CHANGED:
        was, then = number_at(before, figure.path), number_at(after, figure.path)
        text = _arrow([figure.text(was), figure.text(then)])
        if was is not None and then is not None:
            changed = "no change" if was == then else quantity.signed(then - was, figure.text)
            text += f" ({changed})"
        lines.append((name, text))
    return tuple(lines)


def _arrow(texts: Sequence[str]) -> str:
    return texts[0] if texts[0] == texts[1] else " → ".join(texts)
