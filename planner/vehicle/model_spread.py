"""How far whole flights were from their predictions by a model."""

from __future__ import annotations

from planner.frozen import frozen
from planner.vehicle.spread_schema import SPREAD, STATE_NAMES


@frozen
class ModelSpread:
    """Standard deviations of (flown - predicted) / predicted; ``None`` where not known."""

    n_flights: int
    """Flights compared, none of which the model was fitted to."""
    source: str
    """Which flights, and how they were compared."""
    time_fraction: float | None = None
    """Of the time of a flight. [-]"""
    energy_fraction: float | None = None
    """Of its energy, what all states of one flight share. [-]"""
    energy_state_fraction: tuple[tuple[str, float], ...] = ()
    """Of the energy of states by name, independent from state to state. [-]"""
    stopping_distance_fraction: float | None = None
    """Of stopping distances. [-]"""

    def __post_init__(self) -> None:
        SPREAD.refuse(self)
        for state, fraction in self.energy_state_fraction:
            if state not in STATE_NAMES or not 0.0 <= fraction <= 10.0:
                msg = f"energy_state_fraction holds shares by state, got {state} = {fraction}"
                raise ValueError(msg)
