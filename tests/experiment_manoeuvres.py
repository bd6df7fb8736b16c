"""The simulated experiment cut by its own timetable into what is identified."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from simulated_experiment import (
    FIRST_S,
    G1,
    G2,
    G3,
    G4,
    G5,
    LEVEL_S,
    LEVELS_M,
    STEP_S,
    fly_horizontally,
    fly_vertically,
)

from planner.identify.manoeuvres import Manoeuvre
from planner.identify.power_laws import fit_altitude_law
from planner.identify.segments import MeasuredPower
from planner.identify.uncertainty import mean_with_error
from planner.vehicle.power import hover_power_w

if TYPE_CHECKING:
    from simulated_experiment import Flown

    from planner.arrays import FloatArray


TRUTH = {"G1": G1, "G2": G2, "G3": G3, "G4": G4, "G5": G5}
SETTLED_S = 40.0
"""After a step nothing changes any more: G3 rings longest, for 32 s."""
BEFORE_S = 15.0
MOTION_S = 60.0


def cut(flown: Flown, answer: FloatArray, sign: float, after_s: float) -> list[Manoeuvre]:
    """Return the steps of one sign, with some time before and after each."""
    found = []
    before, after = round(BEFORE_S / STEP_S), round(after_s / STEP_S)
    for position in np.flatnonzero(flown.steps * sign > 0.0):
        part = slice(position - before, position + after + 1)
        found.append(
            Manoeuvre(
                time_s=flown.time_s[part],
                reference=flown.reference[part],
                answer=answer[part],
                source="simulated",
            )
        )
    return found


def hovers(flown: Flown) -> list[MeasuredPower]:
    """Return the mean powers at the levels of a vertical flight, the ground left out."""
    starts = FIRST_S + LEVEL_S * np.arange(len(LEVELS_M) - 1)
    found = []
    for start_s, level_m in zip(starts, LEVELS_M[1:], strict=True):
        part = slice(round((start_s + SETTLED_S) / STEP_S), round((start_s + LEVEL_S) / STEP_S))
        if level_m > 0.0:
            height_m = float(flown.altitude_m[part].mean())
            mean_w, error_w = mean_with_error([flown.power_w[part]])
            found.append(
                MeasuredPower(
                    power_w=mean_w,
                    error_w=error_w,
                    duration_s=STEP_S * (part.stop - part.start),
                    height_above_home_m=height_m,
                )
            )
    return found


def manoeuvres(seed: int, *, noise: float = 1.0, flights: int = 1) -> dict[str, list[Manoeuvre]]:
    """Return what each model is identified from, out of as many flights of each kind."""
    generator = np.random.default_rng(seed)
    found: dict[str, list[Manoeuvre]] = {name: [] for name in TRUTH}
    for _ in range(flights):
        up_down = fly_vertically(generator, noise=noise)
        law = fit_altitude_law(hovers(up_down)).law
        hover_w = hover_power_w(
            law, height_above_home_m=up_down.altitude_m, mass_kg=None, air_density_kg_m3=1.2
        )
        above_w = up_down.power_w - hover_w
        found["G1"] += cut(up_down, up_down.altitude_m, 1.0, MOTION_S)
        found["G1"] += cut(up_down, up_down.altitude_m, -1.0, MOTION_S)
        found["G2"] += cut(up_down, above_w, 1.0, _window_s("G2"))
        found["G3"] += cut(up_down, above_w, -1.0, _window_s("G3"))
        out_back = fly_horizontally(generator, noise=noise)
        found["G4"] += cut(out_back, out_back.speed_m_s, 1.0, 0.75 * MOTION_S)
        found["G4"] += cut(out_back, out_back.speed_m_s, -1.0, 0.75 * MOTION_S)
        found["G5"] += cut(out_back, out_back.power_w, -1.0, _window_s("G5"))
    return found


def _window_s(name: str) -> float:
    window_s = TRUTH[name].window_s
    assert window_s is not None
    return window_s
