"""The part of the schema that says how far predictions by the model were from flights."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.vehicle.keys import Key, Kind, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

STATE_NAMES = ("takeoff", "climb", "accelerate", "cruise", "brake", "hover", "descend", "land")
"""The flight states, in the order of flights."""

_FRACTIONS = ("time_fraction", "energy_fraction", "stopping_distance_fraction")


def _fraction(name: str, meaning: str) -> Key:
    return Key(
        name=name, kind=Kind.NUMBER, meaning=meaning, required=False, at_least=0.0, at_most=10.0
    )


def _something_known(raw: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    if not any(name in raw for name in _FRACTIONS):
        yield _FRACTIONS[0], f"is missing: give one of {', '.join(_FRACTIONS)} at least"


SPREAD = Table(
    name="spread",
    meaning=(
        "How far whole flights were from their predictions by this model, each one standard "
        "deviation of (flown - predicted) / predicted; optional.  Without it nothing is said about "
        "the spread of a prediction.  With few flights behind it the spread of a prediction is that "
        "of Student's t with n_flights degrees of freedom."
    ),
    keys=(
        _fraction("time_fraction", "of the time of a flight"),
        _fraction("energy_fraction", "of its energy, what all states of one flight share"),
        _fraction("stopping_distance_fraction", "of stopping distances"),
        Key(
            name="n_flights",
            kind=Kind.INTEGER,
            meaning="flights compared, none of which the model was fitted to",
            at_least=1,
        ),
        Key(name="source", kind=Kind.TEXT, meaning="which flights, and how they were compared"),
    ),
    cross_check=_something_known,
)

STATE_SPREAD = Table(
    name="spread.energy_state_fraction",
    meaning=(
        "Standard deviation of the energy of each state over the prediction, besides what all "
        "states of one flight share: independent from state to state; optional."
    ),
    keys=tuple(_fraction(name, f"of {name}") for name in STATE_NAMES),
)
