"""How often flights lie in their intervals: of flights whose spread is known, as often as promised."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from planner.errors import UsageError
from planner.flight.motion.kinematics import FlightState
from planner.identify.calibration import Calibration, FlightInterval, calibrate
from planner.identify.spread import FlownAndPredicted
from planner.values import replace
from planner.vehicle.model import ModelSpread

COUNT = 200
TRUE = ModelSpread(
    n_flights=1_000_000,
    source="made",
    time_fraction=0.01,
    leg_time_s=0.5,
    landing_time_s=2.0,
    energy_fraction=0.02,
)


def made_flights() -> list[FlownAndPredicted]:
    random = np.random.default_rng(20)
    flights = []
    for _ in range(COUNT):
        slow, needs = 1.0 + 0.01 * random.standard_normal(), 1.0 + 0.02 * random.standard_normal()
        flights.append(
            FlownAndPredicted(
                legs_s=[(slow * s + 0.5 * random.standard_normal(), s) for s in (20.0, 50.0, 30.0)],
                landing_s=(slow * 40.0 + 2.0 * random.standard_normal(), 40.0),
                flown_energy_j={FlightState.CRUISE: needs * 9e4},
                predicted_energy_j={FlightState.CRUISE: 9e4},
            )
        )
    return flights


@pytest.mark.parametrize("spread", [TRUE, None])
def test_flights_of_a_known_spread_lie_in_their_intervals_as_often_as_promised(
    spread: ModelSpread | None,
) -> None:
    found = {
        one.of: one
        for one in calibrate(made_flights(), spreads=None if spread is None else [spread] * COUNT)
    }
    assert set(found) == {"time", "energy", "leg", "landing"}
    for one in found.values():
        assert one.count == (3 * COUNT if one.of == "leg" else COUNT)
        # three legs of a flight share its pace: as many flights as that counts for
        low, high = binom.interval(0.999, COUNT, 0.8)
        assert low <= one.coverage * COUNT <= high
        # 1.2816 over 0.6745, the median of 200 good to 0.0886
        assert one.sharpness == pytest.approx(1.9, rel=0.27)


def test_an_interval_is_where_the_errors_of_the_model_put_it() -> None:
    flight = FlownAndPredicted(
        flown_energy_j={FlightState.CRUISE: 110.0}, predicted_energy_j={FlightState.CRUISE: 100.0}
    )
    (energy,) = calibrate([flight], spreads=[TRUE])
    (interval,) = energy.intervals
    assert interval.error == pytest.approx(0.1, rel=1e-12)
    # 10 000 samples show the 90th percentile to 0.017 standard deviations
    assert interval.high == pytest.approx(1.2816 * 0.02, abs=4 * 0.017 * 0.02)
    assert interval.low == pytest.approx(-1.2816 * 0.02, abs=4 * 0.017 * 0.02)
    assert not interval.is_inside
    assert energy.coverage == 0.0


def test_an_interval_of_energy_is_wider_in_a_wind() -> None:
    """By 0.6 % for each m/s beside 2 %: √(2² + 3²) % in 5 m/s."""
    spread = replace(TRUE, energy_fraction_s_m=0.006)
    widths = []
    for speed_m_s in (0.0, 5.0):
        flight = FlownAndPredicted(
            flown_energy_j={FlightState.CRUISE: 100.0},
            predicted_energy_j={FlightState.CRUISE: 100.0},
            wind_speed_m_s=speed_m_s,
        )
        (energy,) = calibrate([flight], spreads=[spread])
        widths.append(energy.half_width)
    assert widths[1] / widths[0] == pytest.approx(math.hypot(2.0, 3.0) / 2.0, rel=1e-9)


def test_what_chance_makes_of_few_flights() -> None:
    """Of six at 0.8: 1.7 % leave two or fewer inside, 9.9 % three or fewer, 26 % all six."""
    six = Calibration(
        of="time",
        intervals=(FlightInterval(of="time", flight=0, error=0.0, low=-0.1, high=0.1),) * 6,
    )
    assert six.inside_by_chance == (3, 6)


@pytest.mark.parametrize("count", [5, 6, 25, 87])
def test_how_wide_right_intervals_look_by_chance(count: int) -> None:
    """As drawn 20 000 times: the ends are good to 1 %, of the median of two in the middle to 2 %."""
    drawn = np.abs(np.random.default_rng(4).standard_normal((20_000, count)))
    expected = np.quantile(1.2816 / np.median(drawn, axis=1), (0.05, 0.95))
    one = FlightInterval(of="time", flight=0, error=0.0, low=-0.1, high=0.1)
    found = Calibration(of="time", intervals=(one,) * count).sharpness_by_chance
    assert found == pytest.approx(expected, rel=0.03)


def test_one_flight_has_no_others_to_take_intervals_from() -> None:
    with pytest.raises(UsageError, match="two logs"):
        calibrate(made_flights()[:1])
