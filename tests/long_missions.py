"""Missions of any length, and how long something takes: for measurements."""

from __future__ import annotations

import json
import time
from statistics import median
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

LEG_M = 120.0


def plan(count: int, *, autopilot: int = 12) -> str:
    """Return a plan of ``count`` items: take-off, a zigzag of legs with a climb each, return."""

    def item(number: int, command: int, *params: float | None) -> dict[str, Any]:
        return {
            "autoContinue": True,
            "command": command,
            "doJumpId": number,
            "frame": 2 if command == 20 else 3,
            "params": list(params),
            "type": "SimpleItem",
        }

    items = [item(1, 22, 0, 0, 0, None, 47.0, 8.0, 50.0)]
    for number in range(2, count):
        latitude_deg = 47.0 + number % 2 * LEG_M / 111_200.0
        items.append(item(number, 16, 0, 0, 0, None, latitude_deg, 8.0, 50.0 + number % 3 * 10.0))
    items.append(item(count, 20, 0, 0, 0, 0, 0, 0, 0))
    return json.dumps(
        {
            "fileType": "Plan",
            "geoFence": {"circles": [], "polygons": [], "version": 2},
            "groundStation": "QGroundControl",
            "mission": {
                "cruiseSpeed": 15,
                "firmwareType": autopilot,
                "hoverSpeed": 5,
                "items": items,
                "plannedHomePosition": [47.0, 8.0, 488.0],
                "vehicleType": 2,
                "version": 2,
            },
            "rallyPoints": {"points": [], "version": 2},
            "version": 1,
        },
        indent=4,
    )


def seconds(work: Callable[[], object], runs: int = 5) -> float:
    """Return the median time of some runs after a warm-up."""
    work()
    times = []
    for _ in range(runs):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return median(times)
