"""Figures of a model on missions reconstructed from real flights: a folder for each mission.

Run as::

    python tests/matrice_figures.py MODEL FOLDER MEAN_POWER_W

``FOLDER`` holds a folder for each mission, with ``mission.plan`` and ``flown.json`` (time, energy, wind,
home, commanded speed).  Each is predicted from mission, wind and model alone.  ``MEAN_POWER_W`` is the
mean power of the flights the model was identified on: what that power says for the predicted time
stands beside the model's energy.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path
from statistics import median

import planner
from planner.geo.geodesy import distance_m
from planner.mission.commands import Command
from planner.units import wh_from_j
from planner.values import Value


class Row(Value, kw_only=False, dict=True):
    """Relative errors of one mission."""

    speed_m_s: float
    time: float
    energy: float
    mean_power: float
    by_distance: float
    is_time_inside: bool | None
    """Whether the time flown lies between p10 and p90; ``None`` where the model tells no spread."""
    is_energy_inside: bool | None


def row_of(folder: Path, vehicle: planner.VehicleModel, mean_power_w: float) -> Row:
    """Return the errors of a mission."""
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    mission = planner.read_mission(folder / "mission.plan")
    wind = flown["wind"]
    totals = planner.check(
        mission,
        vehicle,
        wind=planner.Wind(speed_m_s=wind["speed_m_s"], from_deg=wind["from_deg"]),
        home_amsl_m=flown["home"]["amsl_m"],
    ).totals
    places = [
        (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        for item in mission.items
        if item.command in {Command.NAV_TAKEOFF, Command.NAV_WAYPOINT, Command.NAV_LAND}
    ]
    way_m = sum(float(distance_m(*one, *other)) for one, other in pairwise(places))
    speed_m_s = flown["commanded_speed_m_s"]
    return Row(
        speed_m_s=speed_m_s,
        time=totals.time_s / flown["time_s"] - 1.0,
        energy=totals.energy_wh / flown["energy_wh"] - 1.0,
        mean_power=wh_from_j(mean_power_w * totals.time_s) / flown["energy_wh"] - 1.0,
        by_distance=way_m / speed_m_s / flown["time_s"] - 1.0,
        is_time_inside=_is_inside(flown["time_s"], totals.time_s_p10, totals.time_s_p90),
        is_energy_inside=_is_inside(flown["energy_wh"], totals.energy_wh_p10, totals.energy_wh_p90),
    )


def _is_inside(flown: float, low: float | None, high: float | None) -> bool | None:
    return None if low is None or high is None else low <= flown <= high


def main(model: str, folder: str, mean_power_w: float) -> None:
    """Write the figures to standard output."""
    sys.stdout.write("\n".join(figure_lines(model, folder, mean_power_w)) + "\n")


def figure_lines(model: str, folder: str, mean_power_w: float) -> list[str]:
    """Return the figures, a line for each speed and one for all."""
    vehicle = planner.load_vehicle(model)
    folders = sorted(path.parent for path in Path(folder).glob("*/flown.json"))
    rows = [row_of(path, vehicle, mean_power_w) for path in folders]
    lines = ["speed      n    time (median)    energy (median)  mean power x time  distance/speed"]
    for speed_m_s in [*sorted({row.speed_m_s for row in rows}), None]:
        chosen = [row for row in rows if speed_m_s is None or row.speed_m_s == speed_m_s]
        errors = [
            100.0 * median(abs(getattr(row, name)) for row in chosen)
            for name in ("time", "energy", "mean_power", "by_distance")
        ]
        energy_bias = 100.0 * median(row.energy for row in chosen)
        bias = 100.0 * median(row.time for row in chosen)
        label = "all" if speed_m_s is None else f"{speed_m_s:g} m/s"
        lines.append(
            f"{label:7} {len(chosen):4} {errors[0]:6.2f} % {bias:+6.2f} % {errors[1]:7.2f} % "
            f"{energy_bias:+6.2f} % "
            f"{errors[2]:16.2f} % {errors[3]:13.1f} %"
        )
    time, energy = (100.0 * max(abs(getattr(r, n)) for r in rows) for n in ("time", "energy"))
    return [
        *lines,
        f"largest errors: time {time:.1f} %, energy {energy:.1f} %",
        *(
            f"{name} between p10 and p90: {sum(inside)} of {len(inside)} (8 of 10 expected)"
            for name in ("time", "energy")
            if (inside := [i for r in rows if (i := getattr(r, f"is_{name}_inside")) is not None])
        ),
    ]


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
