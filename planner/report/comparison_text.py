"""What two missions do not have in common, for reading."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers
from planner.report.plain_text import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.live import MissionComparison
    from planner.mission.difference import Difference


def comparison_text(comparison: MissionComparison) -> str:
    """Return every difference, a line for each, and how many matter."""
    lines = difference_lines(comparison.differences)
    matter = sum(one.matters for one in comparison.differences)
    pair = f"{comparison.first} and {comparison.second}"
    if matter:
        lines.append(f"{numbers.count(matter, 'difference')} between {pair}")
    else:
        lines.append(f"{pair} are the same mission")
    return "".join(f"{line}\n" for line in lines)


def difference_lines(differences: Sequence[Difference]) -> list[str]:
    """Return a line for each difference, those that matter first."""
    ordered = sorted(differences, key=lambda one: not one.matters)
    return [printable(f"{one.kind.value}: {one.message}") for one in ordered]
