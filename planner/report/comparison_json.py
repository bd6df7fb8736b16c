"""What two missions do not have in common, as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.json_document import envelope, json_text, value

if TYPE_CHECKING:
    from planner.live import MissionComparison

_KEYS = ("part", "number", "field", "first", "second", "kind", "matters", "message")


def comparison_json(comparison: MissionComparison, version: str) -> str:
    """Return every difference as an object; ``number`` counts from 1 in its part."""
    return json_text(
        {
            **envelope(version),
            "first": comparison.first,
            "second": comparison.second,
            "is_same": comparison.is_same,
            "differences": [
                {key: value(one, key) for key in _KEYS} for one in comparison.differences
            ],
        }
    )
