"""How far flights were from predictions, found again from flights of a known spread."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import t as student_t

from planner.autopilot import Autopilot
from planner.errors import IdentificationError
from planner.flight.motion.kinematics import FlightState
from planner.identify.spread import FlownAndPredicted, fit_spread, fitted_parameters, noise_fraction
from planner.vehicle.repeatability import (
    ENERGY_FRACTION,
    REPEATABILITY,
    WIND_ENERGY_FRACTION_S_M,
    Repeatability,
)

PREDICTED_J = {FlightState.CLIMB: 20e3, FlightState.CRUISE: 60e3, FlightState.DESCEND: 20e3}
LEGS_S = (20.0, 40.0, 60.0, 30.0, 50.0)
LANDING_S = 40.0


def flights(
    count: int,
    *,
    common: float = 0.0,
    kinds: dict[FlightState, float] | None = None,
    time: float = 0.0,
    leg_s: float = 0.0,
    landing_s: float = 0.0,
) -> list[FlownAndPredicted]:
    random = np.random.default_rng(1)
    found = []
    for _ in range(count):
        shared = common * random.standard_normal()
        own = {
            kind: (kinds or {}).get(kind, 0.0) * random.standard_normal() for kind in PREDICTED_J
        }
        slow = 1.0 + time * random.standard_normal()
        found.append(
            FlownAndPredicted(
                legs_s=[(slow * s + leg_s * random.standard_normal(), s) for s in LEGS_S],
                landing_s=(slow * LANDING_S + landing_s * random.standard_normal(), LANDING_S),
                flown_energy_j={
                    kind: energy_j * (1.0 + shared + own[kind])
                    for kind, energy_j in PREDICTED_J.items()
                },
                predicted_energy_j=PREDICTED_J,
            )
        )
    return found


def one_flight(error: float, wind_speed_m_s: float = 0.0) -> FlownAndPredicted:
    return FlownAndPredicted(
        flown_energy_j={FlightState.CRUISE: 1e4 * (1.0 + error)},
        predicted_energy_j={FlightState.CRUISE: 1e4},
        wind_speed_m_s=wind_speed_m_s,
    )


def test_what_flights_share_and_what_each_kind_of_state_has_are_separated() -> None:
    kinds = {FlightState.CLIMB: 0.08, FlightState.CRUISE: 0.06, FlightState.DESCEND: 0.1}
    spread = fit_spread(flights(2000, common=0.04, kinds=kinds), source="made")
    assert spread.n_flights == 2000
    # a standard deviation from 2000 flights is good to 1/sqrt(4000) = 1.6 %; four times that, and
    # twice it for the parts, which are differences of such
    assert spread.energy_fraction == pytest.approx(0.04, rel=0.13)
    found = dict(spread.energy_state_fraction)
    for states, kind in (
        (("takeoff", "climb"), FlightState.CLIMB),
        (("accelerate", "cruise", "brake", "hover"), FlightState.CRUISE),
        (("descend", "land"), FlightState.DESCEND),
    ):
        for state in states:
            assert found[state] == pytest.approx(kinds[kind], rel=0.13)


def test_times_of_flights_of_legs_and_of_landings_are_separated() -> None:
    spread = fit_spread(flights(2000, time=0.02, leg_s=0.5, landing_s=3.0), source="made")
    # as above; the slope of five legs by least absolute errors takes some of theirs with it, and what
    # scatters more than 2.5 standard deviations is cut, 2 % of the variance of a normal distribution
    assert spread.time_fraction == pytest.approx(0.02, rel=0.13)
    assert spread.leg_time_s == pytest.approx(0.5, rel=0.13)
    assert spread.landing_time_s == pytest.approx(3.0, rel=0.13)


def test_a_pilot_who_waits_once_does_not_make_every_leg_uncertain() -> None:
    made = flights(20, leg_s=0.5)
    (flown_s, predicted_s), *rest = made[0].legs_s
    waited = FlownAndPredicted(
        legs_s=[(flown_s + 60.0, predicted_s), *rest], landing_s=made[0].landing_s
    )
    spread = fit_spread([waited, *made[1:]], source="made")
    # one of a hundred legs counts as 2.5 standard deviations instead of 120
    assert spread.leg_time_s == pytest.approx(0.5, rel=0.3)


@pytest.mark.parametrize("count", [9, 199])
def test_the_interval_of_80_percent_ends_at_the_error_of_its_rank(count: int) -> None:
    """Of errors without a variance, too: rank 8 of 9 flights and the next, 160 of 199 and the next."""
    errors = 0.01 * np.random.default_rng(3).standard_cauchy(count)
    made = [
        FlownAndPredicted(
            landing_s=(100.0 * (1.0 + error), 100.0),
            flown_energy_j={FlightState.CRUISE: 1e4 * (1.0 + error)},
            predicted_energy_j={FlightState.CRUISE: 1e4},
        )
        for error in errors
    ]
    spread = fit_spread(made, source="made")
    assert spread.time_fraction is not None
    assert spread.landing_time_s is not None
    assert spread.energy_fraction is not None
    # flights that last equally long do not tell what of it their landings are
    whole = math.hypot(spread.time_fraction, spread.landing_time_s / 100.0)
    for deviation in (whole, spread.energy_fraction):
        half_width = deviation * student_t.ppf(0.9, count)
        assert np.sum(np.abs(errors) <= half_width) == round(0.8 * (count + 1))


def test_what_one_leg_loses_to_the_next_makes_no_flight_uncertain() -> None:
    """Where an item is said to be done is up to the log: its seconds are one leg's or the next one's."""
    made = flights(20, leg_s=0.1)
    first, second, *rest = made[0].legs_s
    moved = [(first[0] + 5.0, first[1]), (second[0] - 5.0, second[1]), *rest]
    shifted = FlownAndPredicted(legs_s=moved, landing_s=made[0].landing_s)
    spread = fit_spread([shifted, *made[1:]], source="made")
    assert spread.time_fraction is not None
    assert spread.time_fraction < 0.1 * math.sqrt(5.0) / 240.0  # what the legs make of a flight


def test_few_flights_that_agree_by_chance_leave_a_tenth_of_what_is_known_of_all() -> None:
    known = Repeatability(time_fraction=0.5, leg_s=10.0, landing_s=40.0)
    spread = fit_spread(flights(3), source="made", known=known)
    assert spread.time_fraction == pytest.approx(0.05, abs=1e-4)
    assert spread.leg_time_s == pytest.approx(1.0, abs=1e-4)
    assert spread.landing_time_s == pytest.approx(4.0, abs=1e-4)
    assert spread.energy_fraction == pytest.approx(0.1 * ENERGY_FRACTION, abs=1e-4)


@pytest.mark.parametrize("error", [0.001, 0.006, 0.02, 0.2])
def test_what_is_known_counts_as_one_error_more_at_most(error: float) -> None:
    """Of n errors: S / u = n + x / (1 + x² / 4), x the logarithm of u over the one known; 1 where x is 2."""
    made = [one_flight(sign * error) for sign in (1.0, -1.0, 1.0, 1.0, -1.0)]
    found = fit_spread(made, source="made", known=REPEATABILITY[Autopilot.STEP]).energy_fraction
    assert found is not None

    def lacks(deviation: float) -> float:
        x = 2.0 * math.log(deviation / ENERGY_FRACTION)
        return 5.0 * (error / deviation) ** 2 - 5.0 - x / (1.0 + 0.25 * x * x)

    # rounded up to four decimals
    assert lacks(found - 1e-4) > 0.0 > lacks(found + 1e-6)
    assert math.sqrt(5.0 / 6.0) * error <= found <= math.sqrt(5.0 / 4.0) * error + 1e-4


def test_what_a_wind_adds_makes_no_calm_flight_uncertain() -> None:
    random = np.random.default_rng(11)
    winds = random.uniform(0.0, 8.0, 2000)
    errors = 0.02 * random.standard_normal(2000) + 0.008 * winds * random.standard_normal(2000)
    made = [one_flight(error, wind) for error, wind in zip(errors.tolist(), winds, strict=True)]
    spread = fit_spread(made, source="made")
    # as above: four times 1.6 %, and twice it for the parts
    assert spread.energy_fraction == pytest.approx(0.02, rel=0.13)
    assert spread.energy_fraction_s_m == pytest.approx(0.008, rel=0.13)


def test_calm_flights_leave_what_is_known_of_all_winds() -> None:
    made = [one_flight(0.001), one_flight(-0.001)]
    known = REPEATABILITY[Autopilot.ARDUPILOT]
    assert fit_spread(made, source="made").energy_fraction_s_m is None
    found = fit_spread(made, source="made", known=known).energy_fraction_s_m
    assert found == pytest.approx(WIND_ENERGY_FRACTION_S_M, abs=1e-4)


def test_a_model_fitted_to_the_same_flights_is_off_by_more_on_others() -> None:
    """Of a line fitted to points the sum of the leverages is its parameters, and so is the spread's raise."""
    random = np.random.default_rng(5)
    design = np.stack([np.ones(12), random.uniform(0.0, 1.0, 12)], axis=1)
    values = random.standard_normal(12)

    def errors(rows: np.ndarray) -> np.ndarray:
        return np.asarray(values - design @ np.linalg.lstsq(design[rows], values[rows])[0])

    own = errors(np.arange(12))
    without = [errors(np.delete(np.arange(12), one))[one] for one in range(12)]
    assert fitted_parameters(own.tolist(), without) == pytest.approx(2.0, abs=1e-9)
    assert fitted_parameters([0.01], [None]) == 1.0
    made = flights(50, common=0.04)
    plain = fit_spread(made, source="made").energy_fraction
    raised = fit_spread(made, source="made", energy_parameters=10.0).energy_fraction
    assert plain is not None
    # residual variance over n - p instead of n, and the parameters' own share on the next flight
    assert raised == pytest.approx(plain * math.sqrt(50.0 / 40.0 * (1.0 + 10.0 / 50.0)), abs=1e-4)


def test_a_bias_is_part_of_the_spread() -> None:
    always = FlownAndPredicted(
        legs_s=[(51.5, 50.0), (51.5, 50.0)],
        flown_energy_j={FlightState.CRUISE: 950.0},
        predicted_energy_j={FlightState.CRUISE: 1000.0},
        flown_stops_m=(11.0, 9.0),
        predicted_stops_m=(10.0, 10.0),
    )
    spread = fit_spread([always, always], source="made")
    assert spread.time_fraction == pytest.approx(0.03, abs=1e-9)
    assert spread.energy_fraction == pytest.approx(0.05, abs=1e-9)
    assert dict(spread.energy_state_fraction)["cruise"] == 0.0
    assert spread.stopping_distance_fraction == pytest.approx(0.1, abs=1e-9)


def test_the_noise_of_one_flight_is_as_uncertain_as_that_of_any_multicopter() -> None:
    # 0.05 to 0.2 m hold eight of ten: ln 4 over twice 1.2816
    known = math.log(4.0) / (2.0 * 1.2815515655)
    assert noise_fraction([0.1]) == pytest.approx(known, abs=1e-4)
    # many that scatter by 0.2 tell their own
    random = np.random.default_rng(7)
    many = 0.1 * np.exp(0.2 * random.standard_normal(400))
    assert noise_fraction(many.tolist()) == pytest.approx(0.2, rel=4.0 / math.sqrt(800.0))


def test_what_was_not_recorded_is_absent() -> None:
    timed = FlownAndPredicted(landing_s=(90.0, 100.0))
    spread = fit_spread([timed], source="made")
    assert spread.time_fraction == pytest.approx(0.1, abs=1e-9)
    assert spread.landing_time_s is None  # a whole flight in one piece tells nothing of its end
    assert spread.energy_fraction is None
    assert spread.stopping_distance_fraction is None


def test_no_flight_tells_nothing() -> None:
    with pytest.raises(IdentificationError, match="needs flights"):
        fit_spread([], source="made")
    with pytest.raises(IdentificationError, match="needs flights"):
        fit_spread([FlownAndPredicted()], source="made")
