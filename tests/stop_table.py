"""How far recorded stops went beside how far they were predicted to go; not in the gate.

Run as ``make stops FLIGHTS=folder``: writes the table in ``models/README.md``.  The flights in the logs are
predicted from mission, parameters and wind alone; a stop and its prediction are measured alike, both to where
the vehicle comes to rest and to the farthest it gets.
"""

from __future__ import annotations

import sys
from pathlib import Path
from statistics import median

from calibration_table import FAMILIES, vehicle_of
from readme_table import write_table

from planner.service.verification import verify_logs

SHORT = 0.05
"""Predicted shorter by more is told by name. [-]"""


def main(folder: str) -> None:
    """Write the table into the README of the models, and to standard output."""
    flights = Path(folder)
    heads = (
        "vehicle",
        "stops",
        "from",
        *_heads("rest"),
        "more than 5 % short",
        *_heads("farthest"),
    )
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    for label, pattern, model, how in FAMILIES:
        logs = sorted(flights.glob(f"{pattern}/flight.*"))
        if not logs:
            continue
        rest, farthest, speeds = [], [], []
        for one in verify_logs(vehicle_of(model, how, flights), logs):
            for stop in one.stops:
                if not stop.predicted_m or not stop.predicted_farthest_m:
                    continue
                speeds.append(stop.speed_m_s)
                rest.append(stop.predicted_m / stop.measured_m - 1.0)
                assert stop.measured_farthest_m is not None
                farthest.append(stop.predicted_farthest_m / stop.measured_farthest_m - 1.0)
                if rest[-1] < -SHORT:
                    sys.stderr.write(
                        f"{one.log} item {stop.item} at {stop.start_s:.0f} s from {stop.speed_m_s:.1f} m/s: "
                        f"{stop.predicted_m:.2f} m for {stop.measured_m:.2f} m\n"
                    )
        if rest:
            short = sum(error < -SHORT for error in rest)
            lines.append(
                f"| {label} | {len(rest)} | {min(speeds):.0f} to {max(speeds):.0f} m/s | "
                f"{_figures(rest)} | {short} | {_figures(farthest)} |"
            )
    write_table("stops", lines)


def _heads(measure: str) -> tuple[str, str, str]:
    return f"{measure}: median error", "shortest", "longest"


def _figures(errors: list[float]) -> str:
    values = (median(errors), min(errors), max(errors))
    return " | ".join(f"{100.0 * value:+.1f} %" for value in values)


if __name__ == "__main__":
    main(*sys.argv[1:])
