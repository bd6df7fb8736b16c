"""The share of recorded flights whose time and energy lie between p10 and p90; not in the gate.

Run as a program: ``python tests/measure_coverage.py MODEL LOG...``.  Each flight is predicted from its
mission alone; the spread for it is fitted to the other flights (leave one out), so that no flight is
judged by itself.  The model must not have been identified on these flights.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from scipy.stats import t

from planner.identify.spread import FlownAndPredicted, fit_spread
from planner.identify.verification import KnownConditions
from planner.service.verification import verify_logs
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.verification import Figures, Verification


def coverage(verifications: Sequence[Verification]) -> list[str]:
    """Return a line for time and energy: how many flights lie between p10 and p90."""
    flights = [_compared(one) for one in verifications]
    lines = []
    for name in ("time", "energy"):
        inside = count = 0
        for index, one in enumerate(verifications):
            spread = fit_spread(flights[:index] + flights[index + 1 :], source="the others")
            fraction = spread.time_fraction if name == "time" else spread.energy_fraction
            flown, predicted = _figure(one.measured, name), _figure(one.predicted, name)
            if flown is None or predicted is None or fraction is None:
                continue
            half = float(t.ppf(0.9, spread.n_flights)) * fraction
            count += 1
            inside += abs(flown / predicted - 1.0) <= half
        lines.append(f"{name}: {inside} of {count} flights between p10 and p90 (8 of 10 expected)")
    return lines


def _compared(one: Verification) -> FlownAndPredicted:
    flown, predicted = one.measured.energy_wh, one.predicted.energy_wh
    has_power = flown is not None and predicted is not None
    # the whole flight as one state: states are told apart where models are identified
    return FlownAndPredicted(
        flown_time_s=one.measured.time_s,
        predicted_time_s=one.predicted.time_s,
        flown_energy_j={"cruise": flown} if has_power and flown is not None else {},
        predicted_energy_j={"cruise": predicted} if has_power and predicted is not None else {},
    )


def _figure(figures: Figures, name: str) -> float | None:
    return figures.time_s if name == "time" else figures.energy_wh


if __name__ == "__main__":
    model, *logs = sys.argv[1:]
    compared = list(verify_logs(load_vehicle(model), logs, KnownConditions()))
    if len(compared) < 2:
        sys.exit("one flight has no others to take its spread from: give two logs or more")
    for line in coverage(compared):
        print(line)  # noqa: T201 - a measurement is printed
