"""The article's vehicle flown by sampling: every response simulated with ``control`` at 50 Hz.

Another implementation of the same rules, to test the closed form against and to race it with.  It
simulates; it knows nothing of ``planner.physics`` or ``planner.flight``.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import control
import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray


SAMPLE_S = 0.02
HORIZON_S = 120.0
MODEL_FILE = Path(__file__).parents[1] / "models" / "falkowski-2023-quadrotor.toml"


class Manoeuvre(Value, kw_only=False, dict=True):
    """A climb or descent by ``size`` metres from ``height_m``, or a level leg of ``size`` metres."""

    kind: str
    size: float
    height_m: float
    speed_m_s: float = 10.0


class Flown(Value, kw_only=False, dict=True):
    """What a manoeuvre took."""

    duration_s: float
    distance_m: float
    energy_j: float


class SampledVehicle:
    """The model file's numbers as ``control`` systems."""

    def __init__(self, path: Path = MODEL_FILE) -> None:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
        self.hover = raw["hover"]
        self.responses: dict[str, Any] = raw["responses"]

    def simulate(self, name: str, time_s: FloatArray, reference: FloatArray) -> FloatArray:
        """Return the answer of one response to a sampled reference, delay by shifting."""
        response = self.responses[name]
        system = control.tf(response["numerator"], response["denominator"])
        shift = round(response["delay_s"] / SAMPLE_S)
        delayed = np.concatenate((np.zeros(shift), reference))[: len(reference)]
        answer = control.forced_response(system, time_s, response["input_gain"] * delayed)
        return np.asarray(answer.outputs, dtype=np.float64)

    def hover_power_w(self, height_m: FloatArray) -> FloatArray:
        """Return K H^z, held below the lowest height."""
        held = np.maximum(height_m, self.hover["lowest_height_m"])
        return np.asarray(self.hover["coefficient_w"] * held ** self.hover["exponent"])

    def fly(self, manoeuvre: Manoeuvre) -> Flown:
        """Return what a manoeuvre takes, by sampling."""
        if manoeuvre.kind == "level":
            return self._level(manoeuvre)
        return self._vertical(manoeuvre)

    def _vertical(self, manoeuvre: Manoeuvre) -> Flown:
        time_s = np.arange(0.0, HORIZON_S, SAMPLE_S)
        name = "climb_power" if manoeuvre.size > 0.0 else "descent_power"
        step = float(np.clip(manoeuvre.size, -100.0, 100.0))
        reference = np.full_like(time_s, step)
        height = self.simulate("altitude", time_s, reference)
        extra = self.simulate(name, time_s, reference)
        window_s = self.responses[name]["window_s"]
        rate = np.gradient(height, SAMPLE_S)
        peak = int(np.argmax(np.abs(rate)))
        pause_s = (manoeuvre.size - step) / rate[peak]
        away = np.flatnonzero(np.abs(height - step) > 1.0)
        end = int(away[-1]) + 1
        before = manoeuvre.height_m + height
        after = before + manoeuvre.size - step
        pausing = manoeuvre.height_m + height[peak] + np.linspace(0.0, manoeuvre.size - step, 500)
        hover_j = (
            np.trapezoid(self.hover_power_w(before[: peak + 1]), dx=SAMPLE_S)
            + np.trapezoid(self.hover_power_w(after[peak : end + 1]), dx=SAMPLE_S)
            + self.hover_power_w(pausing).mean() * pause_s
        )
        inside = time_s <= window_s
        extra_j = np.trapezoid(extra[inside], dx=SAMPLE_S) + extra[peak] * pause_s
        return Flown(end * SAMPLE_S + pause_s, 0.0, float(hover_j + extra_j))

    def _level(self, manoeuvre: Manoeuvre) -> Flown:
        speed = self.responses["speed"]
        steady = speed["input_gain"] * speed["numerator"][-1] / speed["denominator"][-1]
        pulse_s = manoeuvre.size / (manoeuvre.speed_m_s * steady)
        time_s = np.arange(0.0, pulse_s + 60.0, SAMPLE_S)
        step = self.simulate("speed", time_s, np.full_like(time_s, manoeuvre.speed_m_s))
        reference = np.where(time_s < pulse_s, manoeuvre.speed_m_s, 0.0)
        flown = self.simulate("speed", time_s, reference)
        lasting = np.flatnonzero(np.abs(step - step[-1]) > 0.02 * manoeuvre.speed_m_s * steady)
        stop_s = (int(lasting[-1]) + 1) * SAMPLE_S
        braking_s = np.arange(0.0, self.responses["brake_power"]["window_s"], SAMPLE_S)
        brake = self.simulate(
            "brake_power", braking_s, np.full_like(braking_s, -manoeuvre.speed_m_s)
        )
        reached = min(1.0, float(flown.max()) / (manoeuvre.speed_m_s * steady))
        full = pulse_s > stop_s
        brake_j = np.trapezoid(brake, dx=SAMPLE_S) * (1.0 if full else reached)
        duration_s = pulse_s + stop_s
        hover_w = float(self.hover_power_w(np.array([manoeuvre.height_m]))[0])
        return Flown(
            duration_s,
            float(np.trapezoid(flown, dx=SAMPLE_S)),
            hover_w * duration_s + float(brake_j),
        )
