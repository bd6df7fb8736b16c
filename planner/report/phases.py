"""How long a flight is in each state, and what that takes."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from planner.flight.state import STATES

if TYPE_CHECKING:
    from planner.service import CheckResult


class Phase(NamedTuple):
    """All segments of one state, or of the whole flight."""

    state: str
    """``total`` for the whole flight."""
    segments: int
    time_s: float
    distance_m: float
    energy_wh: float
    energy_fraction: float | None
    """Of the energy of the flight; ``None`` where it takes none. [-]"""


def flight_phases(result: CheckResult) -> tuple[Phase, ...]:
    """Return the phases a flight has, in the order of the states, and the whole flight at the end."""
    totals = result.totals
    sums: dict[str, list[float]] = {state: [0, 0.0, 0.0, 0.0] for state in STATES}
    for segment in result.segments:
        of_state = sums[segment.state]
        of_state[0] += 1
        of_state[1] += segment.duration_s
        of_state[2] += segment.distance_m
        of_state[3] += segment.energy_wh
    rows: list[tuple[str, float, float, float, float]] = [
        (state, count, time_s, distance_m, energy_wh)
        for state, (count, time_s, distance_m, energy_wh) in sums.items()
        if count
    ]
    rows.append(("total", len(result.segments), totals.time_s, totals.distance_m, totals.energy_wh))
    return tuple(
        Phase(
            state=state,
            segments=int(count),
            time_s=time_s,
            distance_m=distance_m,
            energy_wh=energy_wh,
            energy_fraction=energy_wh / totals.energy_wh if totals.energy_wh else None,
        )
        for state, count, time_s, distance_m, energy_wh in rows
    )
