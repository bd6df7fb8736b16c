"""Which moment, segment and item of a flight belong together: what links the panes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.rules.assessment import Assessment


def segment_at(assessment: Assessment, time_s: float) -> int:
    """Return the segment that is flown at a time."""
    end_s = assessment.flight.motion.segments.end_s
    return min(int(np.searchsorted(end_s, time_s, side="right")), len(end_s) - 1)


def segment_span_s(assessment: Assessment, segment: int) -> tuple[float, float]:
    """Return when a segment begins and ends. [s]"""
    columns = assessment.flight.motion.segments
    end_s = float(columns.end_s[segment])
    return end_s - float(columns.duration_s[segment]), end_s


def item_at(assessment: Assessment, time_s: float) -> int:
    """Return the item that is flown for at a time."""
    return int(assessment.flight.motion.segments.item[segment_at(assessment, time_s)])


def item_span_s(assessment: Assessment, item: int) -> tuple[float, float] | None:
    """Return when an item is first flown for, begin and end; ``None`` where it never is. [s]

    An item that only sets something is a moment.
    """
    of_item = np.flatnonzero(assessment.flight.motion.segments.item == item)
    if len(of_item):
        apart = np.flatnonzero(np.diff(of_item) > 1)
        last = of_item[apart[0]] if len(apart) else of_item[-1]
        return segment_span_s(assessment, int(of_item[0]))[0], segment_span_s(
            assessment, int(last)
        )[1]
    arrival_s = assessment.items[item - 1].arrival_s if 0 < item <= len(assessment.items) else None
    return None if arrival_s is None else (arrival_s, arrival_s)
