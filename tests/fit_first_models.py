"""First fits of the shipped autopilot models, until ``mavjoule identify`` makes them.

    python tests/fit_first_models.py OUT_DIR LOG...

Fits momentum theory (``planner.physics.rotor``) to the electrical power in ArduPilot logs of one
vehicle, all logs together, by least squares over every airborne sample, and writes
``OUT_DIR/arducopter-sitl-quad.toml``.  It is a fit of steady power to whole flights, not an
identification: no transients, no spread.
"""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from planner.logs.files import read_log
from planner.physics.atmosphere import air_density_kg_m3, standard_temperature_c
from planner.physics.rotor import momentum_power_w

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

NAME = "arducopter-sitl-quad"
MASS_KG = 3.5  # the simulated frame's own mass, as the list of the recorded flights gives it
CELLS = 6
CAPACITY_AH = 8.0
KEYS = (
    "disk_area_m2",
    "drag_area_m2",
    "induced_factor",
    "axial_factor",
    "profile_factor",
    "profile_speed_factor",
)
# Start and bounds: a 3.5 kg quadrotor of ordinary build; none of them is reached by the fit.
START = (0.4, 0.03, 1.5, 1.3, 0.3, 0.05)
LOWEST = (0.02, 0.0, 0.5, 0.0, 0.0, 0.0)
HIGHEST = (3.0, 0.5, 4.0, 4.0, 4.0, 2.0)
AIRBORNE_M = 2.0
IDLE_BELOW_M = 0.3


def samples(records: list[FlightRecord]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return speed, climb rate, air density and power of every airborne sample, calm air assumed."""
    columns: list[tuple[FloatArray, ...]] = []
    for record in records:
        home_m = record.home.altitude_amsl_m
        assert home_m is not None
        density = air_density_kg_m3(
            record.altitude_amsl_m,
            home_amsl_m=home_m,
            home_temperature_c=standard_temperature_c(home_m),
        )
        speed = np.hypot(record.velocity_north_m_s, record.velocity_east_m_s)
        rows = (speed, record.climb_m_s, density, record.power_w)
        known = np.all(np.isfinite(rows), axis=0) & (record.height_above_home_m > AIRBORNE_M)
        columns.append(tuple(row[known] for row in rows))
    speed, climb, density, power = (np.concatenate(part) for part in zip(*columns, strict=True))
    return speed, climb, density, power


def fit(records: list[FlightRecord]) -> tuple[dict[str, float], float]:
    """Return the factors of momentum theory and the root mean square of what they leave. [W]"""
    speed, climb, density, power = samples(records)

    def residuals(x: FloatArray) -> FloatArray:
        predicted = momentum_power_w(
            speed,
            climb,
            mass_kg=MASS_KG,
            air_density_kg_m3=density,
            **dict(zip(KEYS, x.tolist(), strict=True)),
        )
        return np.asarray(predicted - power)

    # Transients are larger than the noise: the loss grows slowly beyond 5 W.
    found = least_squares(
        residuals, START, bounds=(LOWEST, HIGHEST), loss="soft_l1", f_scale=5.0, x_scale=START
    )
    rmse_w = float(np.sqrt(np.mean(residuals(found.x) ** 2)))
    return dict(zip(KEYS, found.x.tolist(), strict=True)), rmse_w


def idle_w(records: list[FlightRecord]) -> float:
    """Return the median power on the ground with turning rotors: armed and not yet lifted off."""
    power = np.concatenate(
        [r.power_w[(r.time_s < 2.0) & (r.height_above_home_m < IDLE_BELOW_M)] for r in records]
    )
    return float(np.nanmedian(power))


def model_text(records: list[FlightRecord]) -> str:
    """Return the model file."""
    law, rmse_w = fit(records)
    fastest = max(float(np.nanmax(r.ground_speed_m_s)) for r in records)
    highest = max(float(np.nanmax(r.height_above_home_m)) for r in records)
    factors = "\n".join(f"{key} = {value:.5g}" for key, value in law.items())
    logs = ", ".join(f'"{Path(r.source).parent.name}/{Path(r.source).name}"' for r in records)
    hashes = ", ".join(f'"{r.sha256}"' for r in records)
    return f'''# The survey quad of ArduPilot's simulator: 3.5 kg, 8 Ah 6S.  Its electrical power is a
# momentum-theory model added to the simulator, so that a law of the same form fits it too easily.
# A first fit by tests/fit_first_models.py; `mavjoule identify` is to replace it.

schema = 1
name = "{NAME}"
kind = "multicopter"
reference = "ardupilot"
description = "Survey quad of ArduPilot's simulator, 3.5 kg; first fit of momentum theory to {len(records)} flights."
mass_kg = {MASS_KG}

[hover]
law = "of-cruise"

[cruise]
power = "momentum"
{factors}

[loads]
avionics_w = 0.0                # not told apart from the motors by the logs
ground_idle_w = {idle_w(records):.1f}            # armed, before lift-off

[battery]
capacity_ah = {CAPACITY_AH}
nominal_voltage_v = {CELLS * 3.7:.1f}        # {CELLS} cells of 3.7 V

[valid_for]
speed_m_s = [0.0, {fastest:.0f}.0]
height_above_home_m = [0.0, {highest:.0f}.0]
mass_kg = [{MASS_KG}, {MASS_KG}]

[provenance]
source = "ArduCopter in simulation (SITL), unmodified but for the electrical power"
method = "first fit by tests/fit_first_models.py: least squares of steady power over whole flights; not an identification"
date = {datetime.now(tz=UTC).date().isoformat()}
logs = [{logs}]
logs_sha256 = [{hashes}]

[provenance.fit]
power_rmse_w = {rmse_w:.2f}
'''


def main(arguments: list[str]) -> None:
    """Write the model of the logs given."""
    folder, *logs = arguments
    records = [record for log in logs for record in read_log(log)]
    Path(folder, f"{NAME}.toml").write_text(model_text(records), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
