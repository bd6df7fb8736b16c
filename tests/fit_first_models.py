"""Write the first models of the two simulated vehicles from their logs: a script, not a test.

    python tests/fit_first_models.py ardupilot-sitl-quad A.BIN B.BIN C.BIN
    python tests/fit_first_models.py px4-sih-quad A.ulg B.ulg C.ulg

writes ``models/<name>.toml``.  The logs are those of a vertical flight with hovers (A), a level flight
(B) and a sweep of speeds (C).  A first fit takes the steady power alone: samples in which nothing
accelerates, pooled over all logs and weighted so that an hour of hover counts no more than a minute of
cruise.  It knows no dynamics, no uncertainty and no held-out data; `mavjoule identify` does.
"""

from __future__ import annotations

import hashlib
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
from pymavlink import DFReader
from pyulog import ULog
from scipy.optimize import least_squares

from planner.physics.atmosphere import air_density_kg_m3, standard_temperature_c
from planner.physics.battery import open_circuit_voltage_v
from planner.physics.rotor import momentum_power_w
from planner.vehicle.ardupilot_parameters import ArduPilotParameters
from planner.vehicle.parameter_table import parameter_table
from planner.vehicle.px4_parameters import Px4Parameters
from planner.vehicle.shipped import models_root

if TYPE_CHECKING:
    from collections.abc import Sequence

FloatArray: TypeAlias = npt.NDArray[np.float64]

SURVEY_QUAD_KG = 3.5
"""As the flights are described; no log says it."""
STEADY_M_S2 = 0.05
"""Acceleration below which a sample counts as steady. [m s⁻²]"""
AIRBORNE_AFTER_S, AIRBORNE_BEFORE_S = 5.0, 2.5
"""Armed time before lift-off is over, and from touch-down on. [s]"""
STANDING_S = 2.0
"""Armed time in which ArduPilot's motors do not turn yet. [s]"""
FEWEST_IN_BIN = 30
"""A bin of fewer samples is passing through, not steady flight."""

LAWS = ("disk_area_m2", "drag_area_m2", "induced_factor", "axial_factor", "profile_factor")
START = (0.5, 0.03, 1.5, 1.5, 0.4, 0.3)
"""Where the fit begins, in the order of ``LAWS`` and profile_speed_factor: a plausible quadrotor."""

# ArduPilot, libraries/SITL/SIM_Battery.cpp, soc_table: volts of a cell over percent of charge.  The
# rows below 1.3 %, where it drops to nothing, are left out and 0 % has the 2.5 V of 1.2 %.
SITL_SOC = (
    (0.0, 0.013, 0.015, 0.02, 0.0385, 0.0769, 0.1154, 0.1538, 0.1923, 0.2308, 0.2692, 0.3077)
    + (0.3462, 0.3846, 0.4231, 0.4615, 0.5, 0.5385, 0.5769, 0.6154, 0.6538, 0.6923, 0.7308)
    + (0.7692, 0.8077, 0.8462, 0.8846, 0.9231, 0.9615, 1.0)
)
SITL_CELL_V = (
    (2.5, 2.7, 2.8, 2.977, 3.091, 3.165, 3.218, 3.296, 3.379, 3.462, 3.503, 3.543)
    + (3.588, 3.636, 3.679, 3.715, 3.742, 3.783, 3.801, 3.833, 3.854, 3.887, 3.908)
    + (3.943, 3.987, 4.039, 4.071, 4.085, 4.112, 4.173)
)


@dataclass(frozen=True, kw_only=True)
class Log:
    """One flight, sampled where the battery was logged."""

    time_s: FloatArray
    """Since arming. (n,)"""
    speed_m_s: FloatArray
    climb_m_s: FloatArray
    height_m: FloatArray
    voltage_v: FloatArray
    current_a: FloatArray
    used_ah: FloatArray
    armed_s: float
    home_amsl_m: float
    parameters: dict[str, float]

    @property
    def power_w(self) -> FloatArray:
        return self.voltage_v * self.current_a

    @property
    def density_kg_m3(self) -> FloatArray:
        return air_density_kg_m3(
            self.height_m + self.home_amsl_m,
            home_amsl_m=self.home_amsl_m,
            home_temperature_c=standard_temperature_c(self.home_amsl_m),
        )

    @property
    def is_steady(self) -> npt.NDArray[np.bool_]:
        airborne = (self.time_s > AIRBORNE_AFTER_S) & (
            self.time_s < self.armed_s - AIRBORNE_BEFORE_S
        )
        slow = [
            np.abs(np.gradient(values, self.time_s)) < STEADY_M_S2
            for values in (self.speed_m_s, self.climb_m_s)
        ]
        steady: npt.NDArray[np.bool_] = airborne & slow[0] & slow[1]
        return steady


def read_dataflash(path: Path) -> Log:
    """Return a flight of ArduPilot; the simulator's own motion, without the estimator's noise."""
    wanted = {
        "BAT": ("TimeUS", "Volt", "Curr", "CurrTot"),
        "SIM2": ("TimeUS", "VN", "VE", "VD", "PD"),
    }
    rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in wanted}
    arming: list[float] = []
    parameters: dict[str, float] = {}
    home_amsl_m = 0.0
    log = DFReader.DFReader_binary(str(path))
    while (message := log.recv_match(type=[*wanted, "ARM", "PARM", "ORGN"])) is not None:
        kind = message.get_type()
        if kind in wanted:
            rows[kind].append(tuple(getattr(message, key) for key in wanted[kind]))
        elif kind == "ARM":
            arming.append(message.TimeUS / 1e6)
        elif kind == "PARM":
            parameters[message.Name] = message.Value
        else:
            home_amsl_m = message.Alt
    battery, motion = (np.array(rows[name]) for name in wanted)
    battery = battery[(battery[:, 0] / 1e6 >= arming[0]) & (battery[:, 0] / 1e6 <= arming[-1])]
    north, east, down, place = (
        np.interp(battery[:, 0], motion[:, 0], motion[:, column]) for column in (1, 2, 3, 4)
    )
    return Log(
        time_s=battery[:, 0] / 1e6 - arming[0],
        speed_m_s=np.hypot(north, east),
        climb_m_s=-down,
        height_m=-place,
        voltage_v=battery[:, 1],
        current_a=battery[:, 2],
        used_ah=battery[:, 3] / 1e3,
        armed_s=arming[-1] - arming[0],
        home_amsl_m=home_amsl_m,
        parameters=parameters,
    )


def fit_momentum(logs: Sequence[Log]) -> tuple[FloatArray, dict[str, float]]:
    """Return the factors of momentum theory and the figures of their fit."""
    speed, climb, density, power = (
        np.concatenate([getattr(log, name)[log.is_steady] for log in logs])
        for name in ("speed_m_s", "climb_m_s", "density_kg_m3", "power_w")
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
            **dict(zip((*LAWS, "profile_speed_factor"), x, strict=True)),
        )
        return np.asarray(modelled - power)

    fit = least_squares(lambda x: error_w(x) * weight, START, x_scale=np.abs(START))
    error = error_w(fit.x)
    full = [error[bin_of == index].mean() for index in np.flatnonzero(counts > FEWEST_IN_BIN)]
    return fit.x, {
        "steady_samples": float(len(power)),
        "power_rmse_w": float(np.sqrt(np.mean(error**2))),
        "largest_mean_error_of_a_state_w": float(np.max(np.abs(full))),
    }


def fit_resistance(logs: Sequence[Log], full_v: float, capacity_ah: float) -> tuple[float, float]:
    """Return the resistance in front of the simulator's open-circuit curve, and the error left."""
    drops, currents = [], []
    curve_v = np.array(SITL_CELL_V) * full_v / SITL_CELL_V[-1]
    for log in logs:
        steady = log.is_steady
        charge = 1.0 - log.used_ah[steady] / capacity_ah
        drops.append(
            open_circuit_voltage_v(charge, ocv_soc=SITL_SOC, ocv_v=curve_v) - log.voltage_v[steady]
        )
        currents.append(log.current_a[steady])
    drop, current = np.concatenate(drops), np.concatenate(currents)
    resistance = float(current @ drop / (current @ current))
    return resistance, float(np.sqrt(np.mean((drop - resistance * current) ** 2)))


def common_parameters(table: type, logs: Sequence[dict[str, float]]) -> list[str]:
    """Return TOML lines of the parameters a flight depends on, where all logs agree."""
    names = [
        spelling.name for row in parameter_table(table).values() for spelling in row.spellings
    ]
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


def provenance(paths: Sequence[Path], *, source: str, readings: Sequence[str]) -> list[str]:
    """Return the lines of [provenance]; a log is called like its folder, without the autopilot."""
    hashes = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    return [
        "[provenance]",
        f'source = "{source}"',
        'method = "first fit by tests/fit_first_models.py, not an identification"',
        f"date = {datetime.now(UTC).date()}",
        "readings = [",
        *(f'    "{reading}",' for reading in readings),
        "]",
        "logs = [",
        *(f'    "{path.parent.name.partition("-")[2]}{path.suffix}",' for path in paths),
        "]",
        "logs_sha256 = [",
        *(f'    "{value}",' for value in hashes),
        "]",
    ]


def survey_quad(name: str, paths: Sequence[Path]) -> list[str]:
    """Return the lines of the model of the simulated survey quadrotor."""
    logs = [read_dataflash(path) for path in paths]
    factors, figures = fit_momentum(logs)
    full_v = max(float(log.voltage_v[0]) for log in logs)
    capacity_ah = logs[0].parameters["BATT_CAPACITY"] / 1e3
    resistance, resistance_error_v = fit_resistance(logs, full_v, capacity_ah)
    standing_w = max(float(log.power_w[log.time_s < STANDING_S].max()) for log in logs)
    steady = [(log, log.is_steady) for log in logs]
    speed, climb, density, height = (
        np.concatenate([getattr(log, key)[keep] for log, keep in steady])
        for key in ("speed_m_s", "climb_m_s", "density_kg_m3", "height_m")
    )
    laws = zip((*LAWS, "profile_speed_factor"), factors, strict=True)
    curve_v = [volts * full_v / SITL_CELL_V[-1] for volts in SITL_CELL_V]
    least_charge = min(1.0 - log.used_ah[-1] / capacity_ah for log in logs)
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
        'description = "Simulated 3.5 kg survey quadrotor flown by ArduPilot; power by momentum '
        'theory, fitted to three flights in calm air."',
        f"mass_kg = {SURVEY_QUAD_KG}",
        "",
        "[hover]",
        'law = "of-cruise"',
        "",
        "# Effective values: a disk area and factors that reproduce the power, not measurements of the",
        "# rotors.  Factors are electrical watts for each watt of the ideal disk.",
        "[cruise]",
        'power = "momentum"',
        *(f"{key} = {value:.5g}" for key, value in laws),
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
        "# ArduPilot's simulated cell (libraries/SITL/SIM_Battery.cpp, soc_table) times "
        f"{full_v / SITL_CELL_V[-1]:.4f}.",
        f"ocv_soc = {wrapped(SITL_SOC, 4)}",
        f"ocv_v = {wrapped(curve_v, 3)}",
        "",
        "[parameters]",
        *common_parameters(ArduPilotParameters, [log.parameters for log in logs]),
        "",
        "[valid_for]",
        f"speed_m_s = [0.0, {speed.max():.1f}]",
        f"climb_rate_m_s = [{climb.min():.1f}, {climb.max():.1f}]",
        f"height_above_home_m = [0.0, {height.max():.0f}.0]",
        f"mass_kg = [{SURVEY_QUAD_KG}, {SURVEY_QUAD_KG}]",
        f"air_density_kg_m3 = [{density.min():.3f}, {density.max():.3f}]",
        "",
        *provenance(
            paths,
            source="simulated flights A (vertical), B (level) and C (speed sweep) of ArduCopter "
            "4.7.0-dev; standard atmosphere",
            readings=(
                "Steady samples of all three flights together; no sample that accelerates by more "
                f"than {STEADY_M_S2} m/s2.",
                "All flights have one mass and calm air: mass and wind are extrapolated by momentum "
                "theory.",
                "The open-circuit curve is the simulator's own; the logs reach from 100 % down to "
                f"{100 * least_charge:.0f} % of it.",
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
    logs = [ULog(str(path), ["vehicle_local_position"]) for path in paths]
    positions: list[Any] = [log.get_dataset("vehicle_local_position").data for log in logs]
    speed = max(float(np.hypot(data["vx"], data["vy"]).max()) for data in positions)
    height = max(float((-data["z"]).max()) for data in positions)
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
        'description = "Simulated 1 kg quadrotor flown by PX4: time and distance only, its power '
        'was not identified."',
        "mass_kg = 1.0",
        "",
        "[hover]",
        'law = "not-given"',
        "",
        "[cruise]",
        'power = "not-given"',
        "",
        "[parameters]",
        *common_parameters(Px4Parameters, [log.initial_parameters for log in logs]),
        "",
        "[valid_for]",
        f"speed_m_s = [0.0, {speed:.1f}]",
        f"height_above_home_m = [0.0, {height:.0f}.0]",
        "",
        *provenance(
            paths,
            source="simulated flights A (vertical), B (level) and C (speed sweep) of PX4's 1.17 line",
            readings=("The battery of the simulation is no model of a battery: no power is fitted.",),
        ),
    ]


def main() -> None:
    name, *paths = sys.argv[1:]
    make = {"ardupilot-sitl-quad": survey_quad, "px4-sih-quad": sih_quad}[name]
    lines = make(name, [Path(path) for path in paths])
    (models_root() / f"{name}.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
