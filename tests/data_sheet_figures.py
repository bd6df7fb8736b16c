"""How far models from data sheets are off, on the recorded flights of vehicles they were not made from.

Run as ``make sheets FLIGHTS=folder``: writes the table in ``models/README.md``.  Each model is compared as
the data sheet makes it, and narrowed by one flight with the others, for several flights in turn.  The
motion of the DJI Matrice 100, whose autopilot is closed, is that of its shipped model; everything else of
it is its data sheet's, and what hovering costs by mass and rotors is found without its own flight times.
The simulated vehicles have no data sheet but mass and battery; PX4's simulator logs no power.
"""

from __future__ import annotations

import json
import sys
from functools import cache
from pathlib import Path
from statistics import mean, median
from typing import TYPE_CHECKING
from unittest import mock

from readme_table import write_table

import planner
from planner.autopilot import Autopilot
from planner.identify.log_table import LogConditions, LogTable
from planner.identify.refinement import refine_vehicle
from planner.logs.files import read_log
from planner.notation import read_battery
from planner.quantity import percent, signed
from planner.values import Value, replace
from planner.vehicle.data_sheet import DataSheet, drone_sheet, vehicle_from_data_sheet
from planner.vehicle.drones import drone_table
from planner.vehicle.parameters.files import read_parameters
from planner.vehicle.priors import fit_hover_cost, published_hovers

if TYPE_CHECKING:
    from collections.abc import Sequence

_EVERY = 11
"""Of the many flights of the Matrice 100 each eleventh narrows the model of all others."""
_FORWARD_M_S = 3.0
"""Airspeed from which on a steady flight is forward; ArduPilot and PX4 fly missions at 5 to 10. [m/s]"""
_MATRICE_KG = 3.715
"""Of the recorded Matrice 100 with its battery and instruments, without payload. [kg]"""
_MATRICE_1_KG = "dji-matrice-100-tb48d-1kg"
"""The configuration of DJI's table that is nearest to it."""


class Scored(Value):
    """A vehicle by a data sheet, and the flights it is tried on."""

    name: str
    patterns: tuple[str, ...]
    vehicle: planner.VehicleModel
    added_kg: float = 0.0
    """What flew beyond the mass of the sheet, without payload. [kg]"""


class FlightError(Value):
    """Predicted over flown less one, and whether the flown lay between p10 and p90; ``None``: not logged."""

    time: float
    energy: float | None
    is_time_inside: bool
    is_energy_inside: bool | None


def _made(mass_kg: float, battery: str, autopilot: Autopilot) -> planner.VehicleModel:
    return vehicle_from_data_sheet(
        DataSheet(
            name="sheet",
            mass_kg=mass_kg,
            battery=read_battery(battery),
            rotors=4,
            autopilot=autopilot,
        )
    )


@cache
def scored() -> tuple[Scored, ...]:
    """Return the vehicles by their data sheets."""
    table = drone_table()
    timed = drone_sheet(table.named(_MATRICE_1_KG), date=table.date)
    assert timed.mass_kg is not None
    plain = replace(timed, mass_kg=_MATRICE_KG, hover=None)
    missions = ("real/matrice-100-missions/*",)
    others = [one for one in published_hovers() if "matrice-100" not in one.name]
    with mock.patch("planner.vehicle.data_sheet.hover_cost", return_value=fit_hover_cost(others)):
        by_rotors = vehicle_from_data_sheet(plain)
    return (
        Scored(name="DJI Matrice 100 by mass and rotors", patterns=missions, vehicle=by_rotors),
        Scored(
            name="DJI Matrice 100 by DJI's flight time with 1 kg",
            patterns=missions,
            vehicle=vehicle_from_data_sheet(timed),
            added_kg=_MATRICE_KG - timed.mass_kg,
        ),
        Scored(
            name="ArduPilot, survey quad of 3.5 kg (simulated)",
            patterns=("ardupilot-S_*",),
            vehicle=_made(3.5, "8Ah@22.2V", Autopilot.ARDUPILOT),
        ),
        Scored(
            name="ArduPilot, stock quad of 3 kg (simulated)",
            patterns=("ardupilot-[NQR]_*",),
            vehicle=_made(3.0, "10Ah@11.1V", Autopilot.ARDUPILOT),
        ),
        Scored(
            name="PX4, quad of 1 kg (simulated)",
            patterns=("px4-*",),
            vehicle=_made(1.0, "3S2200", Autopilot.PX4),
        ),
    )


def error_of(folder: Path, one: Scored) -> FlightError:
    """Return how far the prediction of a flight is off."""
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    parameters = next(folder.glob("vehicle.param*"), None)
    totals = planner.check(
        planner.read_mission(folder / "mission.plan"),
        one.vehicle,
        payload_kg=(flown.get("payload_kg") or 0.0) + one.added_kg,
        parameters=None if parameters is None else read_parameters(parameters),
        home_amsl_m=flown["home"]["amsl_m"],
        wind=planner.Wind(speed_m_s=flown["wind"]["speed_m_s"], from_deg=flown["wind"]["from_deg"]),
    ).totals
    energy_wh = flown["energy_wh"]
    assert totals.energy_wh_p10 is not None
    assert totals.energy_wh_p90 is not None
    assert totals.time_s_p10 is not None
    assert totals.time_s_p90 is not None
    return FlightError(
        time=totals.time_s / flown["time_s"] - 1.0,
        energy=energy_wh and totals.energy_wh / energy_wh - 1.0,
        is_time_inside=totals.time_s_p10 <= flown["time_s"] <= totals.time_s_p90,
        is_energy_inside=energy_wh and totals.energy_wh_p10 <= energy_wh <= totals.energy_wh_p90,
    )


def narrowed(one: Scored, folder: Path, log: Path) -> tuple[Scored, bool]:
    """Return the vehicle with its model narrowed by one flight, and whether that flew forward."""
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    payload_kg = (flown.get("payload_kg") or 0.0) + one.added_kg
    known = LogTable(of_all=LogConditions(payload_kg=payload_kg))
    refined = refine_vehicle(one.vehicle, read_log(log), logs=known)
    flew_forward = any(steady.airspeed_m_s >= _FORWARD_M_S for steady in refined.power.steady)
    return replace(one, vehicle=refined.model), flew_forward


def log_of(folder: Path) -> Path | None:
    """Return the log of a flight, which the Matrice 100 keeps in a folder of its own."""
    own = [folder / "flight.BIN", folder.parents[1] / "matrice-100" / f"{folder.name}.csv.gz"]
    return next((path for path in own if path.exists()), None)


def rows_of(one: Scored, folders: Sequence[Path]) -> list[str]:
    """Return the rows of a vehicle: as the sheet has it, and narrowed by one flight.

    An ordinary flight goes forward; those that only climb and hover have a row of their own.
    """
    rows = [row_of(one.name, [error_of(folder, one) for folder in folders])]
    logged = [(folder, log) for folder in folders if (log := log_of(folder)) is not None]
    after: dict[bool, list[FlightError]] = {True: [], False: []}
    for folder, log in logged[:: _EVERY if len(logged) > _EVERY else 1]:
        refined, flew_forward = narrowed(one, folder, log)
        after[flew_forward] += [error_of(other, refined) for other in folders if other != folder]
    names = {
        True: "… after `refine` with one flight, on the others",
        False: "… after `refine` with one that only climbs and hovers",
    }
    return [*rows, *(row_of(names[kind], errors) for kind, errors in after.items() if errors)]


def row_of(name: str, errors: Sequence[FlightError]) -> str:
    """Return a row of the table."""
    count = len(errors)
    time = [error.time for error in errors]
    energy = [error.energy for error in errors if error.energy is not None]
    cells = [name, str(count)]
    if energy:
        inside = sum(bool(error.is_energy_inside) for error in errors)
        cells += [*_figures(energy), f"{inside} of {count}"]
    else:
        cells += ["—"] * 4
    cells += [*_figures(time)[:2], f"{sum(error.is_time_inside for error in errors)} of {count}"]
    return f"| {' | '.join(cells)} |"


def _figures(errors: Sequence[float]) -> list[str]:
    sizes = [abs(error) for error in errors]
    return [percent(median(sizes)), signed(mean(errors), percent), percent(max(sizes))]


def main(flights: str) -> None:
    """Write the table into the README of the models, and to standard output."""
    head = (
        "| vehicle | flights | energy: median error | bias | worst | inside 80 % "
        "| time: median error | bias | inside 80 % |"
    )
    lines = [head, "|---|---|---|---|---|---|---|---|---|"]
    for one in scored():
        folders = sorted(
            path.parent
            for pattern in one.patterns
            for path in Path(flights).glob(f"{pattern}/flown.json")
        )
        lines += rows_of(one, folders)
    write_table("sheets", lines)


if __name__ == "__main__":
    main(*sys.argv[1:])
