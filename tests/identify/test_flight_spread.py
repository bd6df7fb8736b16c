"""How far flights were from predictions, found again from flights of a known spread."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import IdentificationError
from planner.identify.spread import FlownAndPredicted, fit_spread

PREDICTED_J = {"climb": 10e3, "cruise": 60e3, "hover": 20e3, "land": 10e3}


def flights(
    count: int, *, common: float, states: dict[str, float], time: float = 0.0, seed: int = 1
) -> list[FlownAndPredicted]:
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        shared = common * random.standard_normal()
        own = {name: states.get(name, 0.0) * random.standard_normal() for name in PREDICTED_J}
        found.append(
            FlownAndPredicted(
                flown_time_s=300.0 * (1.0 + time * random.standard_normal()),
                predicted_time_s=300.0,
                flown_energy_j={
                    name: energy_j * (1.0 + shared + own[name])
                    for name, energy_j in PREDICTED_J.items()
                },
                predicted_energy_j=PREDICTED_J,
            )
        )
    return found


def test_what_flights_share_and_what_each_state_has_are_separated() -> None:
    states = {"climb": 0.08, "cruise": 0.03, "hover": 0.05, "land": 0.1}
    spread = fit_spread(flights(2000, common=0.04, states=states, time=0.02), source="made")
    assert spread.n_flights == 2000
    # a standard deviation from 2000 flights is good to 1/sqrt(4000) = 1.6 %; four times that, and
    # twice it for the parts, which are differences of such
    assert spread.time_fraction == pytest.approx(0.02, rel=0.065)
    assert spread.energy_fraction == pytest.approx(0.04, rel=0.13)
    assert dict(spread.energy_state_fraction) == {
        name: pytest.approx(fraction, rel=0.13) for name, fraction in states.items()
    }


def test_a_bias_is_part_of_the_spread() -> None:
    always = FlownAndPredicted(
        flown_time_s=103.0,
        predicted_time_s=100.0,
        flown_energy_j={"cruise": 950.0},
        predicted_energy_j={"cruise": 1000.0},
        flown_stops_m=(11.0, 9.0),
        predicted_stops_m=(10.0, 10.0),
    )
    spread = fit_spread([always, always], source="made")
    assert spread.time_fraction == pytest.approx(0.03, abs=1e-9)
    assert spread.energy_fraction == pytest.approx(0.05, abs=1e-9)
    assert spread.energy_state_fraction == (("cruise", 0.0),)
    assert spread.stopping_distance_fraction == pytest.approx(0.1, abs=1e-9)


def test_what_was_not_recorded_is_absent() -> None:
    timed = FlownAndPredicted(
        flown_time_s=90.0, predicted_time_s=100.0, flown_energy_j={}, predicted_energy_j={}
    )
    spread = fit_spread([timed], source="made")
    assert spread.time_fraction == pytest.approx(0.1, abs=1e-9)
    assert spread.energy_fraction is None
    assert spread.stopping_distance_fraction is None


def test_no_flight_tells_nothing() -> None:
    with pytest.raises(IdentificationError, match="needs flights"):
        fit_spread([], source="made")
