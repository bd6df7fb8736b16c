"""Write the first models of the two simulated vehicles from their logs: a script, not a test.

    python tests/fit_first_models.py arducopter-sitl-quad A.BIN B.BIN C.BIN
    python tests/fit_first_models.py px4-sih-quad A.ulg B.ulg C.ulg

writes ``models/<name>.toml``.  The logs are those of a vertical flight with hovers (A), a level flight
(B) and a sweep of speeds (C).  A first fit takes the steady power alone: samples in which nothing
accelerates, pooled over all logs and weighted so that an hour of hover counts no more than a minute of
cruise.  It knows no dynamics, no uncertainty and no held-out data; `mavjoule identify` does.
"""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from planner.logs.files import read_log
from planner.physics.atmosphere import air_density_kg_m3, standard_temperature_c
from planner.physics.battery import open_circuit_voltage_v
from planner.physics.rotor import momentum_power_w
from planner.units import SECONDS_PER_HOUR
from planner.vehicle.ardupilot_parameters import ArduPilotParameters
from planner.vehicle.chemistry import load_chemistry
from planner.vehicle.parameter_table import parameter_table
from planner.vehicle.px4_parameters import Px4Parameters
from planner.vehicle.shipped import models_root

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.logs.record import FlightRecord

FloatArray: TypeAlias = npt.NDArray[np.float64]

SURVEY_QUAD_KG = 3.5
"""As the flights are described; no log says it."""
SIH_NOISE_M = 0.08
"""Between the 0.31 m measured in noisy flights and the next to nothing of quiet ones."""
STEADY_M_S2 = 0.05
"""Acceleration below which a sample counts as steady. [m s⁻²]"""
AIRBORNE_AFTER_S, AIRBORNE_BEFORE_S = 5.0, 2.5
"""Armed time before lift-off is over, and from touch-down on. [s]"""
STANDING_S = 2.0
"""Armed time in which ArduPilot's motors do not turn yet. [s]"""
FEWEST_IN_BIN = 30
"""A bin of fewer samples is passing through, not steady flight."""

START = {
    "disk_area_m2": 0.5,
    "drag_area_m2": 0.03,
    "induced_factor": 1.5,
    "axial_factor": 1.5,
    "profile_factor": 0.4,
    "profile_speed_factor": 0.3,
}
"""Where the fit begins: a plausible quadrotor."""

CELL = load_chemistry("lipo-ardupilot-sitl")
"""The simulated battery is made of these, six in series."""


def is_steady(record: FlightRecord) -> npt.NDArray[np.bool_]:
    """Return where a flight is in the air, with known power, and nothing accelerates."""
    slow = [
        np.abs(np.gradient(values, record.time_s)) < STEADY_M_S2
        for values in (record.ground_speed_m_s, record.climb_m_s)
    ]
    steady: npt.NDArray[np.bool_] = (
        (record.time_s > AIRBORNE_AFTER_S)
        & (record.time_s < record.duration_s - AIRBORNE_BEFORE_S)
        & np.isfinite(record.power_w)
        & slow[0]
        & slow[1]
    )
    return steady


def density_kg_m3(record: FlightRecord) -> FloatArray:
    """Return the density of the standard air a flight met."""
    home_amsl_m = record.home.altitude_amsl_m
    assert home_amsl_m is not None
    return air_density_kg_m3(
        record.altitude_amsl_m,
        home_amsl_m=home_amsl_m,
        home_temperature_c=standard_temperature_c(home_amsl_m),
    )


def used_ah(record: FlightRecord) -> FloatArray:
    """Return the charge drawn since the beginning of a flight."""
    current_a = np.nan_to_num(record.current_a)
    between = 0.5 * (current_a[1:] + current_a[:-1]) * np.diff(record.time_s)
    return np.concatenate(([0.0], np.cumsum(between))) / SECONDS_PER_HOUR


def fit_momentum(records: Sequence[FlightRecord]) -> tuple[dict[str, float], dict[str, float]]:
    """Return the factors of momentum theory and the figures of their fit."""
    speed, climb, density, power = np.concatenate(
        [
            np.stack([r.ground_speed_m_s, r.climb_m_s, density_kg_m3(r), r.power_w])[
                :, is_steady(r)
            ]
            for r in records
        ],
        axis=1,
    )
    bins = np.round(speed) * 100.0 + np.round(2.0 * climb)
    _, bin_of, counts = np.unique(bins, return_inverse=True, return_counts=True)
    weight = 1.0 / np.sqrt(np.maximum(counts, FEWEST_IN_BIN))[bin_of]

    def error_w(x: FloatArray) -> FloatArray:
        modelled = momentum_power_w(
            speed,
            climb,
            mass_kg=SURVEY_QUAD_KG,
            air_density_kg_m3=density,
            **dict(zip(START, x.tolist(), strict=True)),
        )
        return np.asarray(modelled - power)

    start = list(START.values())
    fit = least_squares(lambda x: error_w(x) * weight, start, x_scale=start)
    error = error_w(fit.x)
    full = [error[bin_of == index].mean() for index in np.flatnonzero(counts > FEWEST_IN_BIN)]
    return dict(zip(START, fit.x.tolist(), strict=True)), {
        "steady_samples": float(len(power)),
        "power_rmse_w": float(np.sqrt(np.mean(error**2))),
        "largest_mean_error_of_a_state_w": float(np.max(np.abs(full))),
    }


def fit_resistance(
    records: Sequence[FlightRecord], full_v: float, capacity_ah: float
) -> tuple[float, float]:
    """Return the resistance in front of the simulator's open-circuit curve, and the error left."""
    curve_v = np.array(CELL.cell_ocv_v) * full_v / CELL.cell_ocv_v[-1]
    drop, current = np.concatenate(
        [
            np.stack(
                [
                    open_circuit_voltage_v(
                        1.0 - used_ah(r) / capacity_ah, ocv_soc=CELL.ocv_soc, ocv_v=curve_v
                    )
                    - r.voltage_v,
                    r.current_a,
                ]
            )[:, is_steady(r)]
            for r in records
        ],
        axis=1,
    )
    resistance = float(current @ drop / (current @ current))
    return resistance, float(np.sqrt(np.mean((drop - resistance * current) ** 2)))


def common_parameters(table: type, logs: Sequence[Mapping[str, float]]) -> list[str]:
    """Return TOML lines of the parameters a flight depends on, where all logs agree."""
    names = [spelling.name for row in parameter_table(table).values() for spelling in row.spellings]
    return [
        f"{name} = {float(np.float32(logs[0][name])):.7g}"
        for name in names
        if all(name in log for log in logs) and len({log[name] for log in logs}) == 1
    ]


def wrapped(values: Sequence[float], digits: int) -> str:
    """Return a TOML list over several lines."""
    lines = [
        ", ".join(f"{value:.{digits}f}" for value in values[start : start + 10])
        for start in range(0, len(values), 10)
    ]
    return "[\n    " + ",\n    ".join(lines) + ",\n]"


def provenance(
    records: Sequence[FlightRecord], *, source: str, readings: Sequence[str]
) -> list[str]:
    """Return the lines of [provenance]; a log is called like its folder, without the autopilot."""
    logs = [Path(record.source) for record in records]
    return [
        "[provenance]",
        f'source = "{source}"',
        'method = "first fit by tests/fit_first_models.py, not an identification"',
        f"date = {datetime.now(UTC).date()}",
        "readings = [",
        *(f'    "{reading}",' for reading in readings),
        "]",
        "logs = [",
        *(f'    "{path.parent.name.partition("-")[2]}{path.suffix}",' for path in logs),
        "]",
        "logs_sha256 = [",
        *(f'    "{record.sha256}",' for record in records),
        "]",
    ]


def survey_quad(name: str, paths: Sequence[Path]) -> list[str]:
    """Return the lines of the model of the simulated survey quadrotor."""
    records = [record for path in paths for record in read_log(path)]
    factors, figures = fit_momentum(records)
    full_v = max(float(np.nanmax(r.voltage_v)) for r in records)
    capacity_ah = records[0].parameters["BATT_CAPACITY"] / 1e3
    resistance, resistance_error_v = fit_resistance(records, full_v, capacity_ah)
    standing_w = max(float(np.nanmax(r.power_w[r.time_s < STANDING_S])) for r in records)
    speed, climb, density, height = np.concatenate(
        [
            np.stack([r.ground_speed_m_s, r.climb_m_s, density_kg_m3(r), r.height_above_home_m])[
                :, is_steady(r)
            ]
            for r in records
        ],
        axis=1,
    )
    scale = full_v / CELL.cell_ocv_v[-1]
    least_charge = min(1.0 - used_ah(r)[-1] / capacity_ah for r in records)
    return [
        "# The survey quadrotor of the simulated ArduPilot flights: 3.5 kg, 8 Ah, 6 cells.",
        "#",
        "# Written by tests/fit_first_models.py from three flights; other flights test it.  The power",
        "# of this vehicle is itself a momentum-theory model added to the simulator: that a model of",
        "# the same form fits it says nothing about real vehicles.",
        "",
        "schema = 1",
        f'name = "{name}"  # must equal the file name',
        'kind = "multicopter"',
        'reference = "ardupilot"',
        (
            'description = "Simulated 3.5 kg survey quadrotor flown by ArduPilot; power by momentum '
            'theory, fitted to three flights in calm air."'
        ),
        f"mass_kg = {SURVEY_QUAD_KG}",
        "",
        "[hover]",
        'law = "of-cruise"',
        "",
        "# Effective values: a disk area and factors that reproduce the power, not measurements of the",
        "# rotors.  Factors are electrical watts for each watt of the ideal disk.",
        "[cruise]",
        'power = "momentum"',
        *(f"{key} = {value:.5g}" for key, value in factors.items()),
        "",
        f"# Armed with standing motors the logs show {standing_w:.1f} W, and no load of avionics.",
        "[loads]",
        "avionics_w = 0.0",
        f"ground_idle_w = {standing_w:.1f}",
        "",
        "[battery]",
        f"capacity_ah = {capacity_ah:g}  # BATT_CAPACITY",
        "cells_in_series = 6",
        f"internal_resistance_ohm = {resistance:.4f}",
        (
            "# The curve of models/chemistries/lipo-ardupilot-sitl.toml, scaled to "
            f"{full_v:.1f} V as the simulator does."
        ),
        f"ocv_soc = {wrapped(CELL.ocv_soc, 4)}",
        f"ocv_v = {wrapped([scale * volts for volts in CELL.cell_ocv_v], 3)}",
        "",
        "[parameters]",
        *common_parameters(ArduPilotParameters, [r.parameters for r in records]),
        "",
        "[valid_for]",
        f"speed_m_s = [0.0, {speed.max():.1f}]",
        f"climb_rate_m_s = [{climb.min():.1f}, {climb.max():.1f}]",
        f"height_above_home_m = [0.0, {height.max():.0f}.0]",
        f"mass_kg = [{SURVEY_QUAD_KG}, {SURVEY_QUAD_KG}]",
        f"air_density_kg_m3 = [{density.min():.3f}, {density.max():.3f}]",
        "",
        *provenance(
            records,
            source="simulated flights A (vertical), B (level) and C (speed sweep) of ArduCopter "
            "4.7.0-dev; standard atmosphere",
            readings=(
                (
                    "Steady samples of all three flights together; no sample that accelerates by more "
                    f"than {STEADY_M_S2} m/s2."
                ),
                (
                    "All flights have one mass and calm air: mass and wind are extrapolated by momentum "
                    "theory."
                ),
                (
                    "The open-circuit curve is the simulator's own; the logs reach from 100 % down to "
                    f"{100 * least_charge:.0f} % of it."
                ),
                "No cut-off voltage is known: the battery counts as empty at the end of its curve.",
            ),
        ),
        "",
        "[provenance.fit]",
        *(f"{key} = {value:.4g}" for key, value in figures.items()),
        f"voltage_rmse_v = {resistance_error_v:.4g}",
    ]


def sih_quad(name: str, paths: Sequence[Path]) -> list[str]:
    """Return the lines of the model of PX4's simulation in hardware, whose power is not recorded."""
    records = [record for path in paths for record in read_log(path)]
    speed = max(float(np.nanmax(r.ground_speed_m_s)) for r in records)
    height = max(float(np.nanmax(r.height_above_home_m)) for r in records)
    return [
        "# The quadrotor of PX4's simulation in hardware (SIH): 1 kg.",
        "#",
        "# Written by tests/fit_first_models.py.  It moves as PX4 flies; its power is not identified,",
        "# because the simulation records none that means anything.",
        "",
        "schema = 1",
        f'name = "{name}"  # must equal the file name',
        'kind = "multicopter"',
        'reference = "px4"',
        (
            'description = "Simulated 1 kg quadrotor flown by PX4: time and distance only, its power '
            'was not identified."'
        ),
        "mass_kg = 1.0",
        f"position_noise_m = {SIH_NOISE_M}  # assumed: see provenance",
        "",
        "[hover]",
        'law = "not-given"',
        "",
        "[cruise]",
        'power = "not-given"',
        "",
        "[parameters]",
        *common_parameters(Px4Parameters, [r.parameters for r in records]),
        "",
        "[valid_for]",
        f"speed_m_s = [0.0, {speed:.1f}]",
        f"height_above_home_m = [0.0, {height:.0f}.0]",
        "",
        *provenance(
            records,
            source="simulated flights A (vertical), B (level) and C (speed sweep) of PX4's 1.17 line",
            readings=(
                "The battery of the simulation is no model of a battery: no power is fitted.",
                (
                    "position_noise_m is assumed.  Hovering in A, B and C the vehicle is 0.31 to 0.39 m "
                    "from its trajectory; other flights of it were quiet.  The value lies between, so "
                    "that either kind is predicted within 2 %, and noisy vertical ones within 6 %; "
                    "0.31 predicts A and B within 1 %."
                ),
            ),
        ),
    ]


def main() -> None:
    name, *paths = sys.argv[1:]
    make = {"arducopter-sitl-quad": survey_quad, "px4-sih-quad": sih_quad}[name]
    lines = make(name, [Path(path) for path in paths])
    (models_root() / f"{name}.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
