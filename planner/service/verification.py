"""Predictions compared with what was flown."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from planner.identify.assembly import IdentificationSettings
    from planner.identify.verification import KnownConditions, Verification
    from planner.logs.csv import CsvMapping
    from planner.vehicle.model import VehicleModel


def verify_logs(
    vehicle: VehicleModel,
    paths: Iterable[Path | str],
    known: KnownConditions,
    *,
    mapping: CsvMapping | None = None,
    left_out: IdentificationSettings | None = None,
) -> Iterator[Verification]:
    """Predict the flights in logs from their missions alone, and compare with what was flown.

    With ``left_out``, each log is predicted by a model that was identified from the others with these
    settings, instead of by the model given.

    Raises LogFileError if a log cannot be read, or holds no mission and none is given.
    Raises MissionFileError if a mission cannot be predicted.
    Raises UsageError if the model cannot be flown as the logs were.
    """
    from planner.identify.verification import verify_flight
    from planner.logs.files import read_log

    if left_out is not None:
        from planner.identify.identification import verify_left_out

        yield from verify_left_out([read_log(path, mapping) for path in paths], left_out, known)
        return
    for path in paths:
        for record in read_log(path, mapping):
            yield verify_flight(record, vehicle, known)
