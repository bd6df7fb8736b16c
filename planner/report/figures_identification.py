"""Figures of an identification, as the article's 3 to 9: what was flown beside what the model says.

Matplotlib is imported here and nowhere else; it draws without a display.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.errors import OutputError, UsageError
from planner.identify.manoeuvre import simulated_answers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from planner.identify.battery import BatteryFit
    from planner.identify.outcome import Identification, ResponseEvidence
    from planner.identify.steady import SteadyPower
    from planner.vehicle.model import VehicleModel

    Axes = Any  # matplotlib ships types only from 3.8 on, and is optional

_WIDTH_IN, _HEIGHT_IN = 7.0, 4.3
_MEASURED, _MODELLED = "0.55", "#c0392b"
_LABELS = {
    "altitude": "altitude above rest, m",
    "speed": "speed above rest, m/s",
    "climb_power": "power above hover, W",
    "descent_power": "power above hover, W",
    "brake_power": "power above hover, W",
}
_MOST_CURVES = 12
"""Manoeuvres drawn in one figure: more hide each other."""


def draw_identification(
    found: Identification, folder: Path, *, file_format: str = "svg"
) -> tuple[Path, ...]:
    """Draw the figures of an identification into a folder.

    Parameters
    ----------
    found : Identification
        What was found.
    folder : Path
        Made where it is not there.
    file_format : str
        ``svg`` or ``png``.

    Returns
    -------
    tuple of Path
        The files drawn.

    Raises
    ------
    UsageError
        If matplotlib is not installed.
    OutputError
        If a file cannot be written.
    """
    evidence = found.evidence
    drawn: list[tuple[str, Callable[[Axes], None]]] = [
        (response.name, lambda axes, r=response: _draw_response(axes, r))  # type: ignore[misc]  # mypy cannot infer a lambda with a default
        for response in evidence.responses
    ]
    if evidence.steady:
        drawn.append(
            ("power_over_speed", lambda axes: _draw_speed(axes, evidence.steady, found.model))
        )
        if any(abs(f.climb_rate_m_s) > 0.3 for f in evidence.steady):
            drawn.append(("power_over_climb", lambda axes: _draw_climb(axes, evidence.steady)))
    if evidence.hovers:
        drawn.append(("hover", lambda axes: _draw_hover(axes, evidence.hovers, found.model)))
    battery = evidence.battery
    if battery is not None:
        drawn.append(("battery", lambda axes: _draw_battery(axes, battery)))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return tuple(
            _saved(
                draw,
                f"{found.model.name}: {name.replace('_', ' ')}",
                folder / f"{name}.{file_format}",
            )
            for name, draw in drawn
        )
    except OSError as error:
        msg = f"{folder}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error


def _saved(draw: Callable[[Axes], None], title: str, path: Path) -> Path:
    """Draw one figure into a file."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        msg = "figures need matplotlib: pip install 'mavjoule[identify]'"
        raise UsageError(msg) from error
    figure = Figure(figsize=(_WIDTH_IN, _HEIGHT_IN), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    draw(axes)
    axes.set_title(title, fontsize="medium")
    axes.grid(visible=True, alpha=0.3)
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    return path


def _draw_response(axes: Axes, response: ResponseEvidence) -> None:
    """Figures 3 to 7: each manoeuvre from its command on, and the model's answer."""
    chosen = response.manoeuvres[:_MOST_CURVES]
    answers = simulated_answers(response.transfer_function, chosen)
    for number, (manoeuvre, answer) in enumerate(zip(chosen, answers, strict=True)):
        time_s = manoeuvre.time_s - manoeuvre.command_s
        measured = manoeuvre.answer - manoeuvre.answer_before
        first = number == 0
        axes.plot(
            time_s, measured, color=_MEASURED, linewidth=0.8, label="flown" if first else None
        )
        axes.plot(time_s, answer, color=_MODELLED, linewidth=1.2, label="model" if first else None)
    if response.window_s is not None:
        axes.axvline(response.window_s, color="0.3", linestyle=":", label="end of the window")
    axes.set_xlabel("time after the command, s")
    axes.set_ylabel(_LABELS[response.name])
    axes.legend()


def _draw_hover(axes: Axes, hovers: Sequence[SteadyPower], model: VehicleModel) -> None:
    """Figure 8: mean power at each level and the law over height."""
    from planner.vehicle.hover_law import AltitudeLaw, hover_power_w

    heights = np.array([h.height_above_home_m for h in hovers])
    axes.errorbar(
        heights,
        [h.power_w for h in hovers],
        yerr=[1.96 * h.error_w for h in hovers],
        fmt="o",
        color=_MEASURED,
        label="hovers, 95 %",
    )
    if isinstance(model.hover, AltitudeLaw):
        at = np.linspace(max(1.0, 0.8 * heights.min()), 1.1 * heights.max(), 100)
        law_w = hover_power_w(
            model.hover, height_above_home_m=at, mass_kg=None, air_density_kg_m3=1.0
        )
        axes.plot(at, law_w, color=_MODELLED, label="law")
    axes.set_xlabel("height above home, m")
    axes.set_ylabel("power, W")
    axes.legend()


def _draw_speed(axes: Axes, steady: Sequence[SteadyPower], model: VehicleModel) -> None:
    """Figure 9: power of level flight over airspeed."""
    level = [f for f in steady if abs(f.climb_rate_m_s) < 0.3]
    axes.plot(
        [f.airspeed_m_s for f in level],
        [f.power_w for f in level],
        "o",
        color=_MEASURED,
        label="steady level flight",
    )
    _draw_law(axes, level, model)
    axes.set_xlabel("airspeed, m/s")
    axes.set_ylabel("power, W")
    axes.legend()


def _draw_law(axes: Axes, level: Sequence[SteadyPower], model: VehicleModel) -> None:
    """Draw the law of power over airspeed at the mean density of the flights."""
    from planner.vehicle.cruise_law import WholeLaw, whole_power_w

    law = model.cruise
    if not level or not isinstance(law, WholeLaw):
        return
    at = np.linspace(0.0, max(f.airspeed_m_s for f in level), 100)
    densities = [f.air_density_kg_m3 or 0.0 for f in level]
    masses = [f.mass_kg or 0.0 for f in level]
    power_w = whole_power_w(
        law,
        airspeed_m_s=at,
        climb_rate_m_s=np.zeros(at.size),
        mass_kg=float(np.mean(masses)),
        air_density_kg_m3=float(np.mean(densities)),
    )
    axes.plot(at, power_w, color=_MODELLED, label="law")


def _draw_climb(axes: Axes, steady: Sequence[SteadyPower]) -> None:
    """Power of vertical flight over climb rate."""
    vertical = [f for f in steady if f.airspeed_m_s < 1.0]
    axes.plot(
        [f.climb_rate_m_s for f in vertical], [f.power_w for f in vertical], "o", color=_MEASURED
    )
    axes.set_xlabel("climb rate, m/s")
    axes.set_ylabel("power, W")


def _draw_battery(axes: Axes, battery: BatteryFit) -> None:
    """Open-circuit voltage over the charge that was used."""
    axes.errorbar(
        battery.ocv_soc,
        battery.ocv_v,
        yerr=[1.96 * e for e in battery.ocv_error_v],
        color=_MODELLED,
        marker="o",
    )
    axes.set_xlabel("state of charge")
    axes.set_ylabel("open-circuit voltage, V")
