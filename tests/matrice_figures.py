"""Figures of the Matrice 100 on missions reconstructed from its flights, each left out of its model.

Run as (``make matrice FLIGHTS=folder``)::

    python tests/matrice_figures.py LOGS TABLE MISSIONS

``LOGS`` is the folder of the flight logs, ``TABLE`` that of `mavjoule identify --table`, ``MISSIONS`` holds a
folder for each mission, called like its log, with ``mission.plan`` and ``flown.json`` (time, energy, wind,
home, payload).  Each is predicted from mission, wind, payload and a model whose power and ramps are those
of all other flights; what is written stands in ``models/README.md``.
"""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from readme_table import write_table

import planner
from planner.errors import IdentificationError, LogFileError
from planner.identify.log_table import read_log_table
from planner.identify.power import manoeuvre_powers
from planner.identify.power_laws import fit_steady_map, mean_powers_w
from planner.identify.ramps import TimedFlight, fit_ramps, timed_flight
from planner.identify.segments import MeasuredPower, record_air_density_kg_m3
from planner.logs.files import read_log
from planner.physics.rotor import Rotor
from planner.values import Value, field_values, replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray


class Flight(Value):
    """What a log shows of power and ramps."""

    powers: tuple[MeasuredPower, ...]
    timed: TimedFlight | None


class Row(Value):
    """Relative errors of one mission, and what tells it apart."""

    name: str
    payload_g: int
    height_m: int
    speed_m_s: int
    wind_m_s: float
    time: float
    energy: float


def read_flights(logs: Path, table: Path, mass_kg: float) -> dict[str, Flight]:
    """Return the flights of a folder by the stems of their logs; what holds none is left out."""
    known = read_log_table(table)
    flights = {}
    for path in sorted(logs.glob("*.csv.gz")):
        with contextlib.suppress(LogFileError):
            [record] = read_log(path)
            timed = None
            with contextlib.suppress(IdentificationError):
                timed = timed_flight(record)
            powers = manoeuvre_powers(
                record,
                air_density_kg_m3=record_air_density_kg_m3(record),
                mass_kg=mass_kg + (known.of(str(path)).payload_kg or 0.0),
            )
            flights[path.name.split(".")[0]] = Flight(powers=powers, timed=timed)
    return flights


def row_of(folder: Path, vehicle: planner.VehicleModel, flights: dict[str, Flight]) -> Row:
    """Return the errors of a mission predicted by the other flights."""
    others = [flight for name, flight in flights.items() if name != folder.name]
    without = replace(
        vehicle,
        cruise=fit_steady_map([power for flight in others for power in flight.powers]).law,
        ramps=fit_ramps([flight.timed for flight in others if flight.timed is not None]),
    )
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    wind = flown["wind"]
    totals = planner.check(
        planner.read_mission(folder / "mission.plan"),
        without,
        wind=planner.Wind(speed_m_s=wind["speed_m_s"], from_deg=wind["from_deg"]),
        home_amsl_m=flown["home"]["amsl_m"],
        payload_kg=flown["payload_kg"],
    ).totals
    return Row(
        name=folder.name,
        payload_g=round(1000.0 * flown["payload_kg"]),
        height_m=25 * round(flown["altitude_m"] / 25.0),
        speed_m_s=round(flown["commanded_speed_m_s"]),
        wind_m_s=wind["speed_m_s"],
        time=totals.time_s / flown["time_s"] - 1.0,
        energy=totals.energy_wh / flown["energy_wh"] - 1.0,
    )


def table_lines(rows: list[Row]) -> list[str]:
    """Return the table: all missions, then each payload, speed and height."""
    groups = [("all", rows)]
    for name, unit in (("payload_g", "g"), ("speed_m_s", "m/s"), ("height_m", "m")):
        for value in sorted({getattr(row, name) for row in rows}):
            chosen = [row for row in rows if getattr(row, name) == value]
            groups.append((f"{value} {unit}", chosen))
    lines = [
        "| missions | number | energy: median error | p90 | bias | time: median error | bias |",
        "|---|---|---|---|---|---|---|",
    ]
    for label, chosen in groups:
        energy, time = (
            100.0 * np.array([getattr(r, n) for r in chosen]) for n in ("energy", "time")
        )
        lines.append(
            f"| {label} | {len(chosen)} | {np.median(np.abs(energy)):.1f} % | "
            f"{np.percentile(np.abs(energy), 90):.1f} % | {energy.mean():+.1f} % | "
            f"{np.median(np.abs(time)):.1f} % | {time.mean():+.1f} % |"
        )
    return lines


def level_lines(flights: dict[str, Flight], wind_m_s: dict[str, float]) -> list[str]:
    """Return by what the law of all flights errs in level legs: over height, wind, and a flight's time."""
    law = fit_steady_map([power for flight in flights.values() for power in flight.powers]).law
    rotor = Rotor(**field_values(law))
    means, within, winds_m_s = [], [], []
    for name, flight in flights.items():
        legs = [power for power in flight.powers if power.climb_rate_m_s == 0.0]
        if not legs:
            continue
        errors = 100.0 * (mean_powers_w(rotor, legs) / [leg.power_w for leg in legs] - 1.0)
        columns = np.array(
            [
                (leg.height_above_home_m, leg.start_s + 0.5 * leg.duration_s, leg.airspeed_m_s)
                for leg in legs
            ]
        )
        weights = np.array([leg.duration_s for leg in legs])
        rows = np.column_stack((errors, columns, columns[:, 2] ** 2))
        mean = np.average(rows, axis=0, weights=weights)
        means.append(mean)
        winds_m_s.append(wind_m_s.get(name, np.nan))
        within.append(np.sqrt(weights)[:, None] * (rows - mean))
    height = np.array(means)[:, 1] / 100.0
    slope, covariance = np.polyfit(height, np.array(means)[:, 0], 1, cov=True)
    parts = [(rows[:, 2:] / [300.0, 1.0, 1.0], rows[:, 0]) for rows in within]
    inverse = np.linalg.inv(sum(x.T @ x for x, _ in parts))
    effects = inverse @ sum(x.T @ y for x, y in parts)
    # legs of one flight share errors: each flight is one
    scores = np.array([x.T @ (y - x @ effects) for x, y in parts])
    error = float(np.sqrt((inverse @ (scores.T @ scores) @ inverse)[0, 0]))
    has_wind = np.isfinite(winds_m_s)
    known = np.array(means)[has_wind]
    blown, blown_deviation = _effect(
        np.column_stack((np.array(winds_m_s)[has_wind], known[:, 3], known[:, 4])), known[:, 0]
    )
    return [
        f"{blown:+.2f} ± {blown_deviation:.2f} % for each m/s of wind in level legs at one airspeed,",
        (
            f"level legs of {len(means)} flights, predicted over flown: {slope[0]:+.1f} ± "
            f"{np.sqrt(covariance[0, 0]):.1f} % for 100 m of height,"
        ),
        f"{effects[0]:+.1f} ± {error:.1f} % for 300 s within a flight at one airspeed",
    ]


def wind_line(rows: list[Row]) -> str:
    """Return how the energy error of missions goes with the wind, and with the height besides."""
    columns = np.array([(row.wind_m_s, row.height_m / 100.0) for row in rows])
    errors = 100.0 * np.array([row.energy for row in rows])
    wind, wind_deviation = _effect(columns, errors)
    height, height_deviation = _effect(columns[:, ::-1], errors)
    mean_m_s = {
        height_m: np.mean([row.wind_m_s for row in rows if row.height_m == height_m])
        for height_m in sorted({row.height_m for row in rows})
    }
    winds = ", ".join(f"{mean:.1f} m/s at {height_m} m" for height_m, mean in mean_m_s.items())
    return (
        f"missions, predicted over flown: {wind:+.2f} ± {wind_deviation:.2f} % for each m/s of wind, "
        f"besides {height:+.1f} ± {height_deviation:.1f} % for 100 m of height; mean wind {winds}"
    )


def _effect(columns: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Return the effect of the first of some columns, with its standard error."""
    design = np.column_stack((columns, np.ones(errors.size)))
    effects, [squares], *_ = np.linalg.lstsq(design, errors)
    variance = squares / (errors.size - design.shape[1])
    return float(effects[0]), float(np.sqrt(variance * np.linalg.inv(design.T @ design)[0, 0]))


def main(logs: str, table: str, missions: str) -> None:
    """Write the table into the README of the models, and the worst missions to standard output."""
    vehicle = planner.load_vehicle("dji-matrice-100")
    assert vehicle.mass_kg is not None
    flights = read_flights(Path(logs), Path(table), vehicle.mass_kg)
    folders = sorted(path.parent for path in Path(missions).glob("*/flown.json"))
    rows = [row_of(folder, vehicle, flights) for folder in folders]
    lines = table_lines(rows)
    write_table("matrice", lines)
    worst = sorted(rows, key=lambda row: -abs(row.energy))[:5]
    more = [wind_line(rows), *level_lines(flights, {row.name: row.wind_m_s for row in rows})]
    more += [f"{r.name}: energy {r.energy:+.1%}, time {r.time:+.1%}" for r in worst]
    sys.stdout.write("\n".join(more) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
