"""The article's two experiments, simulated by ``control`` with its own models and with noise.

Vertical: 0-100-200-300-400-300-200-100-0 m with a hover at each level.  Horizontal: 10 m/s out and
back at 200 m.  Sampled at 10 Hz; noise of 5 W on the power, 0.3 m on the altitude, 0.2 m/s on the
speed.  It knows nothing of ``planner.physics`` or ``planner.identify``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import control
import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray


STEP_S = 0.1
POWER_NOISE_W = 5.0
ALTITUDE_NOISE_M = 0.3
SPEED_NOISE_M_S = 0.2
HOVER_COEFFICIENT_W, HOVER_EXPONENT = 119.49, 0.02
LEVELS_M = (0.0, 100.0, 200.0, 300.0, 400.0, 300.0, 200.0, 100.0, 0.0)
LEVEL_S = 120.0
LEG_S = 60.0
FIRST_S = 20.0


class Model(Value, kw_only=False, dict=True):
    """One of the article's models, as printed, with the input gain that G4 needs."""

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    delay_s: float
    window_s: float | None = None
    """For power: delay and one damped period, after which it adds nothing. [s]"""
    input_gain: float = 1.0

    @property
    def figures(self) -> dict[str, float]:
        """What identification is to find."""
        *_, b0 = self.numerator
        _, a1, a0 = self.denominator
        return {
            "steady_gain": self.input_gain * b0 / a0,
            "natural_frequency_rad_s": float(np.sqrt(a0)),
            "damping_ratio": float(a1 / (2.0 * np.sqrt(a0))),
            "delay_s": self.delay_s,
        }

    def answer(self, steps: FloatArray) -> FloatArray:
        """Answer to steps of the reference, given at each sample, that are held."""
        system = control.sample_system(control.tf(self.numerator, self.denominator), STEP_S, "zoh")
        time_s = np.arange(steps.size) * STEP_S
        unit = control.forced_response(system, time_s, np.ones(steps.size)).outputs
        unit = np.concatenate([np.zeros(round(self.delay_s / STEP_S)), unit])[: steps.size]
        if self.window_s is not None:
            unit = np.where(time_s <= self.window_s, unit, 0.0)
        total = np.zeros(steps.size)
        for position in np.flatnonzero(steps):
            size = self.input_gain * steps[position]
            total[position:] += size * unit[: steps.size - position]
        return total


G1 = Model((0.03071,), (1.0, 0.2923, 0.03071), 2.9)
G2 = Model((0.07023, 0.02383), (1.0, 0.006887, 0.06957), 0.2, window_s=24.0235)
G3 = Model((0.09489, -0.00001339), (1.0, 0.228, 0.05344), 0.5, window_s=31.7430)
G4 = Model((0.03569,), (1.0, 0.935, 0.3588), 0.6, input_gain=10.0)
G5 = Model((0.02583, -0.3294), (1.0, 1.905e-10, 0.2492), 0.6, window_s=13.1865)


class Flown(Value, kw_only=False, dict=True):
    """One simulated flight: a reference with its steps, and what was logged."""

    time_s: FloatArray
    reference: FloatArray
    altitude_m: FloatArray
    speed_m_s: FloatArray
    power_w: FloatArray

    @property
    def steps(self) -> FloatArray:
        """Change of the reference at each sample."""
        return np.diff(self.reference, prepend=self.reference[0])


def hover_power_w(altitude_m: FloatArray) -> FloatArray:
    """Return the article's equation 5, held below 1 m."""
    return np.asarray(HOVER_COEFFICIENT_W * np.maximum(altitude_m, 1.0) ** HOVER_EXPONENT)


def fly_vertically(generator: np.random.Generator, *, noise: float = 1.0) -> Flown:
    """Fly the vertical experiment; the noise is scaled by a factor."""
    durations = [FIRST_S, *[LEVEL_S] * (len(LEVELS_M) - 1)]
    reference = np.concatenate(
        [np.full(round(s / STEP_S), m) for s, m in zip(durations, LEVELS_M, strict=True)]
    )
    steps = np.diff(reference, prepend=reference[0])
    altitude = G1.answer(steps)
    power = (
        hover_power_w(altitude)
        + G2.answer(np.maximum(steps, 0.0))
        + G3.answer(np.minimum(steps, 0.0))
    )
    return _logged(reference, altitude, np.zeros(steps.size), power, generator, noise)


def fly_horizontally(generator: np.random.Generator, *, noise: float = 1.0) -> Flown:
    """Fly the horizontal experiment; its cruise power is that of hover."""
    leg = np.full(round(LEG_S / STEP_S), 10.0)
    pause = np.zeros(round(LEG_S / STEP_S))
    first = np.zeros(round(FIRST_S / STEP_S))
    reference = np.concatenate([first, leg, pause, leg, pause])
    steps = np.diff(reference, prepend=reference[0])
    altitude = np.full(steps.size, 200.0)
    power = hover_power_w(altitude) + G5.answer(np.minimum(steps, 0.0))
    return _logged(reference, altitude, G4.answer(steps), power, generator, noise)


def _logged(
    reference: FloatArray,
    altitude: FloatArray,
    speed: FloatArray,
    power: FloatArray,
    generator: np.random.Generator,
    noise: float,
) -> Flown:
    """Add noise to what was flown."""
    samples = reference.size
    return Flown(
        time_s=np.arange(float(samples)) * STEP_S,
        reference=reference,
        altitude_m=altitude + noise * ALTITUDE_NOISE_M * generator.standard_normal(samples),
        speed_m_s=speed + noise * SPEED_NOISE_M_S * generator.standard_normal(samples),
        power_w=power + noise * POWER_NOISE_W * generator.standard_normal(samples),
    )
