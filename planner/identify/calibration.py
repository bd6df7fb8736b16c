"""How often flights lie in the intervals predicted for them, and how narrow these are.

Of intervals from p10 to p90, 80 % of many flights lie inside: the coverage.  Any coverage can be had by
wide intervals, so that their half width stands beside it, over the median error: the sharpness, 1.9
for a normal distribution (1.2816 / 0.6745), more where an interval is wider than its errors ask for
(T. Gneiting, F. Balabdaoui, A. E. Raftery, J. R. Stat. Soc. B 69 (2007) 243).  Few flights show neither
well, so what chance alone makes of as many stands beside both.
"""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UsageError
from planner.flight.motion.kinematics import STATE_INDEX, STATES
from planner.flight.uncertainty import HIGH, LOW, sample_errors, spread_in_wind
from planner.identify.spread import fit_spread
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import FlightState
    from planner.identify.spread import FlownAndPredicted
    from planner.vehicle.model import ModelSpread
    from planner.vehicle.repeatability import Repeatability

TIME, ENERGY = "time", "energy"
OF_FLIGHTS = (TIME, ENERGY)
OF_PARTS = ("leg", "landing", "energy climbing", "energy level", "energy descending")
_NINE_OF_TEN = (0.05, 0.95)
_KIND_NAMES = {"climb": OF_PARTS[2], "cruise": OF_PARTS[3], "descend": OF_PARTS[4]}


class FlightInterval(Value):
    """What was flown of one flight or part of it, and from where to where it was predicted to lie."""

    of: str
    """One of ``OF_FLIGHTS`` and ``OF_PARTS``."""
    flight: int
    """Which of the flights, from 0."""
    error: float
    """Flown over predicted, less one. [-]"""
    low: float
    """p10 over predicted, less one. [-]"""
    high: float

    @property
    def is_inside(self) -> bool:
        """Whether what was flown lies in it."""
        return self.low <= self.error <= self.high

    @property
    def half_width(self) -> float:
        """Half of what lies between p10 and p90. [-]"""
        return 0.5 * (self.high - self.low)


class Calibration(Value):
    """Intervals of one quantity, and what came of them."""

    of: str
    intervals: tuple[FlightInterval, ...]

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.intervals)

    @property
    def inside(self) -> int:
        """In how many of them lies what was flown."""
        return sum(one.is_inside for one in self.intervals)

    @property
    def inside_by_chance(self) -> tuple[int, int]:
        """The fewest and the most that lie inside in nine draws of ten where 80 % of many do.

        Of independent flights; the legs of one share its pace.
        """
        from scipy.special import bdtr

        at_most = bdtr(np.arange(self.count + 1), self.count, HIGH - LOW)
        low, high = np.searchsorted(at_most, _NINE_OF_TEN)
        return int(low), int(high)

    @property
    def coverage(self) -> float:
        """Fraction of them: 0.8 is right. [-]"""
        return self.inside / self.count

    @property
    def half_width(self) -> float:
        """Median half width. [-]"""
        return median(one.half_width for one in self.intervals)

    @property
    def median_error(self) -> float:
        """Median size of the errors. [-]"""
        return median(abs(one.error) for one in self.intervals)

    @property
    def sharpness(self) -> float | None:
        """Half width over error, both in the median; ``None`` without any error. [-]"""
        return self.half_width / self.median_error if self.median_error else None

    @property
    def sharpness_by_chance(self) -> tuple[float, float]:
        """Between what the sharpness lies in nine draws of ten, of normal errors whose spread is known.

        The median of n numbers drawn evenly from 0 to 1 is Beta((n + 1)/2, (n + 1)/2) distributed; of an
        even n, the mean of two, nearly as the one of the same variance n/4(n + 1)(n + 2).
        """
        from scipy.special import betaincinv, ndtri

        of_even = 0.5 + 1.0 / self.count
        half = 0.5 * (self.count + 1) + (0.0 if self.count % 2 else of_even)
        least, most = ndtri(HIGH) / ndtri(0.5 + 0.5 * betaincinv(half, half, _NINE_OF_TEN[::-1]))
        return float(least), float(most)


def calibrate(
    flights: Sequence[FlownAndPredicted],
    *,
    spreads: Sequence[ModelSpread] | None = None,
    known: Repeatability | None = None,
) -> tuple[Calibration, ...]:
    """Return how often flights, and their parts, lie in the intervals predicted for them.

    Parameters
    ----------
    flights : sequence of FlownAndPredicted
    spreads : sequence of ModelSpread, optional
        What the interval of each flight comes from; by default the others.
    known : Repeatability, optional
        What is known of all flights beforehand, in fitting to the others.

    Returns
    -------
    tuple of Calibration
        One for each quantity that was compared; none for flights that do not show it.

    Raises
    ------
    UsageError
        If there is no other flight to take the intervals from.
    """
    if spreads is None and len(flights) < 2:
        msg = "intervals of one flight come from others: give two logs or more"
        raise UsageError(msg)
    found: list[FlightInterval] = []
    for number, flight in enumerate(flights):
        others = [*flights[:number], *flights[number + 1 :]]
        own = spreads[number] if spreads else fit_spread(others, source="the others", known=known)
        found += _intervals(number, flight, spread_in_wind(own, flight.wind_speed_m_s))
    groups = {name: [one for one in found if one.of == name] for name in (*OF_FLIGHTS, *OF_PARTS)}
    return tuple(Calibration(of=name, intervals=tuple(own)) for name, own in groups.items() if own)


def _intervals(
    number: int, flight: FlownAndPredicted, spread: ModelSpread
) -> Iterator[FlightInterval]:
    errors = sample_errors(spread)

    def one(name: str, flown: float, predicted: float, sampled: FloatArray) -> FlightInterval:
        low, high = np.quantile(sampled, (LOW, HIGH)) / predicted - 1.0
        error = flown / predicted - 1.0
        return FlightInterval(of=name, flight=number, error=error, low=float(low), high=float(high))

    whole = flight.time_s
    if whole is not None and spread.time_fraction is not None:
        landings = int(flight.landing_s is not None)
        sampled_s = errors.times_s(whole[1], legs=len(flight.legs_s), landings=landings)
        yield one(TIME, *whole, sampled_s)
        for flown_s, predicted_s in flight.legs_s:
            if predicted_s > 0.0:
                sampled_s = errors.times_s(predicted_s, legs=1, landings=0)
                yield one("leg", flown_s, predicted_s, sampled_s)
        if flight.landing_s is not None and flight.legs_s and flight.landing_s[1] > 0.0:
            sampled_s = errors.times_s(flight.landing_s[1], legs=0, landings=1)
            yield one("landing", *flight.landing_s, sampled_s)
    if flight.energy_error is not None and spread.energy_fraction is not None:
        flown_j, predicted_j = flight.flown_energy_j, flight.predicted_energy_j
        sums = sum(flown_j.values()), sum(predicted_j.values())
        yield one(ENERGY, *sums, errors.energies_j(_by_state_j(predicted_j)))
        for kind, energy_j in predicted_j.items():
            if energy_j > 0.0 and len(predicted_j) > 1:
                sampled_j = errors.energies_j(_by_state_j({kind: energy_j}))
                yield one(_KIND_NAMES[kind.value], flown_j[kind], energy_j, sampled_j)


def _by_state_j(by_kind_j: Mapping[FlightState, float]) -> FloatArray:
    by_state_j = np.zeros(len(STATES))
    for kind, energy_j in by_kind_j.items():
        by_state_j[STATE_INDEX[kind]] = energy_j
    return by_state_j
