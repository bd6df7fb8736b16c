"""What a guard tells on a terminal: its status in one line, its decisions one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers

if TYPE_CHECKING:
    from planner.link.energy_watch import EnergyState
    from planner.link.guard_session import GuardStatus
    from planner.link.guarding import Decision

_LATE_S = 2.0
"""A vehicle that was not heard for so long is told of. [s]"""


def status_line(status: GuardStatus) -> str:
    """Return ``GO: 31 Wh above the reserve | read 4 s ago | asks before arming``."""
    view = status.view
    age = "" if view.age_s is None else f" | read {numbers.duration(max(view.age_s, 0.0))} ago"
    late = ""
    if status.heard_ago_s > _LATE_S:
        late = f" | not heard for {numbers.duration(status.heard_ago_s)}"
    if status.is_flying:
        energy = "energy not measured" if status.energy is None else energy_text(status.energy)
        return f"in flight: {energy}{late}"
    asks = ""
    if status.arming is not None:
        asks = " | asks before arming" if status.arming.is_asking else " | does not ask"
    armed = " | armed" if status.is_armed else ""
    text = view.text if view.text.startswith(view.verdict.value) else f"{view.verdict}: {view.text}"
    return f"{text}{age}{asks}{armed}{late}"


def energy_text(state: EnergyState) -> str:
    """Return what is left, what it takes to finish and to return, and the point of no return."""
    parts = [
        f"item {state.progress.item}",
        f"{numbers.energy(state.left.energy_wh)} left by {state.left.source}",
        f"{numbers.energy(state.finish_wh)} to finish",
        f"{numbers.energy(state.return_wh)} home",
        f"reserve {numbers.energy(state.reserve_wh)}",
    ]
    if state.ratio is not None:
        parts.append(f"taken {numbers.percent(state.ratio)} of the model")
    if state.is_joined:
        parts.append("its start was not seen")
    if state.lead_s is not None:
        parts.append(f"no return in {numbers.duration(state.lead_s)}")
    return ", ".join(parts)


def decision_text(decision: Decision) -> str:
    """Return a decision in one line."""
    details = decision.details
    match decision.kind:
        case "answer":
            result = str(details["result"]).replace("_", " ")
            held = f" for {details['valid_for_s']} s" if details["result"] == "accepted" else ""
            return f"arm request {result}{held}: {decision.text}"
        case "verdict":
            return f"verdict {decision.verdict}: {decision.text}"
        case _:
            return f"{decision.kind}: {decision.text}"
