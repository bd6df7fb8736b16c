"""What a vehicle says against a mission that it has taken: texts, events, and what it holds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.link.vehicle import StatusText
    from planner.link.vehicle_events import VehicleEvent

_ERROR, _WARNING = 3, 4
"""MAV_SEVERITY; greater numbers are less."""
_REJECTION = re.compile(
    r"reject|refus|infeasible|not feasible|mission.*(invalid|denied|fail|unsupported)|"
    r"invalid mission|prearm: .*(mission|waypoint|fence|rally|item)|"
    # PX4's feasibility check names no mission in these.
    r"geofence (violation|breach|requires|invalid)|first waypoint too far|"
    r"waypoint and gate too close",
    re.IGNORECASE,
)
_ADVICE = frozenset({"navigator_mis_correct_glide_slope"})
"""What comes after a rejection, to mend it."""


def objections(texts: Sequence[StatusText], events: Sequence[VehicleEvent]) -> tuple[str, ...]:
    """Return what is said against a mission, each once; PX4 says most of it as text and as event.

    Parameters
    ----------
    texts, events : sequence of StatusText and of VehicleEvent
        What the vehicle said once it had the mission.
    """
    said = [one.text for one in texts if is_rejection(one)]
    if not said:
        said = [_event_text(one) for one in events if is_event_rejection(one)]
    return tuple(dict.fromkeys(said))


def is_rejection(said: StatusText) -> bool:
    """Return whether a text of the vehicle refuses a mission."""
    return said.severity <= _WARNING and _REJECTION.search(said.text) is not None


def is_event_rejection(event: VehicleEvent) -> bool:
    """Return whether an event refuses a mission: PX4's warnings leave it accepted."""
    return event.severity <= _ERROR and event.name not in {"", *_ADVICE}


def _event_text(event: VehicleEvent) -> str:
    where = "" if event.item is None else f" at item {event.item}"
    return f"{event.name}{where} (mavjoule explain {event.name})"
