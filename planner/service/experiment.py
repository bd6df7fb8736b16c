"""The flights of an experiment, written as missions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.files import make_output_folder, write_output_files
from planner.identify.experiment import make_experiment
from planner.mission.convert import convert_mission
from planner.mission.items import MissionFormat

if TYPE_CHECKING:
    from pathlib import Path

    from planner.identify.experiment import ExperimentFlight, ExperimentSettings


def write_experiment(
    settings: ExperimentSettings, folder: Path, *, force: bool = False
) -> dict[Path, ExperimentFlight]:
    """Write every flight of an experiment as a plan, or none; return them by their files.

    Raises UsageError if a leg is too short to hold its speed, or such a file is there already.
    Raises OutputError if a file cannot be written.
    """
    flights = {folder / f"{flight.name}.plan": flight for flight in make_experiment(settings)}
    there = [path for path in flights if path.exists()]
    if there and not force:
        msg = f"{there[0]} exists already: give another folder, or --force"
        raise UsageError(msg)
    texts = {
        path: convert_mission(flight.mission, MissionFormat.PLAN).text
        for path, flight in flights.items()
    }
    make_output_folder(folder, holding="missions")
    write_output_files(texts)
    return flights
