"""How far models from data sheets are off, on recorded flights of vehicles they were not made from.

Run as::

    python tests/data_sheet_figures.py FLIGHTS

``FLIGHTS`` is the folder of the recorded flights.  Each model is compared as the data sheet makes it, and
narrowed by one flight with the others, for several flights in turn.  The motion of the DJI Matrice 100,
whose autopilot is closed, is that of its shipped model; everything else of it is its data sheet's, and
what hovering costs is found without its own published hovers.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from statistics import median
from unittest import mock

import planner
from planner.autopilot import Autopilot
from planner.identify.log_table import LogConditions, LogTable
from planner.identify.refinement import refine_vehicle
from planner.logs.files import read_log
from planner.setup import read_battery
from planner.values import replace
from planner.vehicle.data_sheet import DataSheet, vehicle_from_data_sheet
from planner.vehicle.parameters.files import read_parameters
from planner.vehicle.priors import fit_hover_cost, published_hovers

_EVERY = 11
"""Of the many flights of the Matrice 100 each eleventh narrows the model of all others."""
_SHEETS = {
    "DJI Matrice 100, 3.715 kg, four rotors of 13 in": (
        "real/matrice-100-missions/*",
        {"mass_kg": 3.715, "battery": "5.7Ah@22.8V", "rotors": 4, "propeller_m": 0.330},
    ),
    "simulated survey quadrotor, 3.5 kg": (
        "ardupilot-S_*",
        {"mass_kg": 3.5, "battery": "8Ah@22.2V", "rotors": 4},
    ),
    "stock simulated quadrotor, 3 kg": (
        "ardupilot-Q_*",
        {"mass_kg": 3.0, "battery": "10Ah@11.1V", "rotors": 4},
    ),
}


def _vehicle(name: str, sheet: dict[str, object]) -> planner.VehicleModel:
    battery = read_battery(str(sheet["battery"]))
    given = {**sheet, "battery": battery}
    others = [one for one in published_hovers() if "matrice-100" not in one.name]
    with mock.patch("planner.vehicle.data_sheet.hover_cost", return_value=fit_hover_cost(others)):
        made = vehicle_from_data_sheet(
            DataSheet(name="sheet", autopilot=Autopilot.ARDUPILOT, **given)  # type: ignore[arg-type]
        )
    if "Matrice" not in name:
        return made
    own = planner.load_vehicle("dji-matrice-100")
    return replace(made, reference=own.reference, ramps=own.ramps, speed=own.speed, parameters=())


def _errors(folder: Path, vehicle: planner.VehicleModel) -> tuple[float, float, bool]:
    """Return the errors of time and energy, and whether the energy flown was in the interval."""
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    parameters = folder / "vehicle.param"
    totals = planner.check(
        planner.read_mission(folder / "mission.plan"),
        vehicle,
        payload_kg=flown.get("payload_kg", 0.0),
        parameters=read_parameters(parameters) if parameters.exists() else None,
        home_amsl_m=flown["home"]["amsl_m"],
        wind=planner.Wind(speed_m_s=flown["wind"]["speed_m_s"], from_deg=flown["wind"]["from_deg"]),
    ).totals
    assert totals.energy_wh_p10 is not None
    assert totals.energy_wh_p90 is not None
    is_inside = totals.energy_wh_p10 <= flown["energy_wh"] <= totals.energy_wh_p90
    time = totals.time_s / flown["time_s"] - 1.0
    return time, totals.energy_wh / flown["energy_wh"] - 1.0, is_inside


def _narrowed(folder: Path, log: Path, vehicle: planner.VehicleModel) -> planner.VehicleModel:
    """Return a model narrowed by one flight."""
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    known = LogTable(of_all=LogConditions(payload_kg=flown.get("payload_kg", 0.0)))
    return refine_vehicle(vehicle, read_log(log), logs=known).model


def _log_of(folder: Path) -> Path | None:
    """Return the log of a flight, which the Matrice 100 keeps in a folder of its own."""
    own = [folder / "flight.BIN", folder.parents[1] / "matrice-100" / f"{folder.name}.csv.gz"]
    return next((path for path in own if path.exists()), None)


def _row(name: str, errors: list[tuple[float, float, bool]]) -> None:
    energy = sorted(abs(one[1]) for one in errors)
    inside = sum(one[2] for one in errors)
    bias = sum(one[1] for one in errors) / len(errors)
    sys.stdout.write(
        f"| {name} | {len(errors)} | {median(energy):.1%} | {bias:+.1%} | {energy[-1]:.1%} "
        f"| {inside} of {len(errors)} ({inside / len(errors):.0%}) |\n"
    )


def main(flights: str) -> None:
    """Write two rows of the table in models/README.md for each vehicle."""
    for name, (pattern, sheet) in _SHEETS.items():
        folders = [
            one for one in sorted(Path(flights).glob(pattern)) if (one / "flown.json").exists()
        ]
        vehicle = _vehicle(name, sheet)
        _row(name, [_errors(folder, vehicle) for folder in folders])
        logged = [(one, log) for one in folders if (log := _log_of(one)) is not None]
        after = []
        for folder, log in logged[:: _EVERY if len(logged) > _EVERY else 1]:
            narrowed = _narrowed(folder, log, vehicle)
            after += [_errors(other, narrowed) for other in folders if other != folder]
        _row("… after `refine` with one flight, on the others", after)


if __name__ == "__main__":
    main(*sys.argv[1:])
