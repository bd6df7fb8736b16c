"""Batches: routes that are flown as one motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.mission.route.stage import Route

_MOST_TOGETHER = 4000
"""Stages of flights that are flown as one motion, which then takes some ten megabytes."""


def batches_of(routes: Sequence[Route]) -> Iterator[tuple[int, Sequence[Route]]]:
    """Yield routes that are flown as one motion, with the position of the first."""
    first, stages = 0, 0
    for position, route in enumerate(routes):
        if first < position and stages + len(route.stages) > _MOST_TOGETHER:
            yield first, routes[first:position]
            first, stages = position, 0
        stages += len(route.stages)
    if first < len(routes):
        yield first, routes[first:]
