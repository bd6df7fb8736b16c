"""Vehicles identified from flight logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from planner.identify.assembly import Identification, IdentificationSettings
    from planner.identify.log_table import LogTable
    from planner.identify.refinement import Refinement
    from planner.logs.csv import CsvMapping
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel


def identify_logs(
    paths: Sequence[Path | str],
    settings: IdentificationSettings,
    *,
    mapping: CsvMapping | None = None,
    output: Path | None = None,
    on_log: Callable[[str], None] = lambda _: None,
    on_step: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Identify a vehicle from its flight logs and write the model file.

    ``on_log`` is called with what is done next, ``on_step`` with the steps of it, of which there are many.

    Raises LogFileError if a log cannot be read.
    Raises IdentificationError if the flights do not show enough for any model.
    Raises UsageError if the base model answers another reference.
    Raises OutputError if the model file cannot be written.
    """
    from planner import quantity
    from planner.identify.identification import identify_vehicle
    from planner.logs.files import read_log

    records: list[FlightRecord] = []
    for number, path in enumerate(paths, start=1):
        on_log(f"reading {path}" + (f" ({number} of {len(paths)})" if len(paths) > 1 else ""))
        records += read_log(path, mapping)
    on_log(f"identifying {settings.name} from {quantity.count(len(records), 'flight')}")
    identification = identify_vehicle(records, settings, on_step=on_step)
    if output is not None:
        from planner.vehicle.writer import write_vehicle

        write_vehicle(output, identification.model, remarks=identification.remarks)
    return identification


def refine_logs(
    vehicle: VehicleModel,
    paths: Sequence[str],
    *,
    logs: LogTable,
    on_log: Callable[[str], None] = lambda _: None,
) -> Refinement:
    """Return a model narrowed by the flights in logs; ``logs`` tells what these do not hold.

    Raises UsageError if the model has nothing to narrow.
    Raises LogFileError if a log cannot be read.
    Raises IdentificationError if no flight holds power in steady flight.
    """
    from planner.identify.refinement import refine_vehicle
    from planner.logs.files import read_log

    records: list[FlightRecord] = []
    for number, path in enumerate(paths, start=1):
        on_log(f"reading {path}" + (f" ({number} of {len(paths)})" if len(paths) > 1 else ""))
        records += read_log(path)
    return refine_vehicle(vehicle, records, logs=logs)
