"""Figures of a verification: power, height and speed, flown and predicted, as the article's Fig. 10."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.report.verification_text import error_text, flight_label

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from planner.identify.verification import Verification

_ROWS = (
    ("power_w", "power [W]"),
    ("height_above_home_m", "height above home [m]"),
    ("ground_speed_m_s", "ground speed [m/s]"),
)


def verification_figure(one: Verification) -> Figure:
    """Return a flight and its prediction, one over the other, over the time since they began.

    Parameters
    ----------
    one : Verification
        What to draw.

    Returns
    -------
    Figure
        Three panels: power, height and speed.

    Raises
    ------
    UsageError
        If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        msg = "figures need matplotlib: pip install 'mavjoule[identify]'"
        raise UsageError(msg) from error

    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    panels = figure.subplots(len(_ROWS), 1, sharex=True)
    for panel, (column, label) in zip(panels, _ROWS, strict=True):
        for record, name, style in (
            (one.flown, "flown", {"color": "0.6", "linewidth": 1.0}),
            (one.foreseen, "predicted", {"color": "tab:blue", "linewidth": 1.5}),
        ):
            panel.plot(record.time_s, getattr(record, column), label=name, **style)
        panel.set_ylabel(label)
        panel.grid(visible=True, alpha=0.3)
    panels[0].legend(loc="upper right")
    panels[-1].set_xlabel("time [s]")
    energy = "" if one.energy_fraction is None else f", energy {error_text(one.energy_fraction)}"
    figure.suptitle(f"{flight_label(one)}: time {error_text(one.time_fraction)}{energy}")
    return figure


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure as the suffix of its path says; the same figure gives the same bytes.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "mavjoule"}):
        metadata = {"Date": None} if path.suffix == ".svg" else {}
        figure.savefig(path, metadata=metadata)
