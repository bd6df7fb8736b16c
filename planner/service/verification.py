"""Predictions compared with what was flown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from planner.identify.assembly import IdentificationSettings
    from planner.identify.calibration import Calibration
    from planner.identify.log_table import LogTable
    from planner.identify.verification import KnownConditions, Verification
    from planner.logs.csv import CsvMapping
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel


OWN_SPREAD, OTHER_FLIGHTS = "the model's own spread", "the other flights"


def calibrate_verified(
    vehicle: VehicleModel, done: Sequence[Verification]
) -> dict[str, tuple[Calibration, ...]]:
    """Return how often flights lie in intervals, by what the intervals come from.

    From the spread of the model as it stands, where it has one: a fair test where the model was not
    identified from these flights.  And from the errors of the other flights, each left out in turn.

    Raises UsageError if there are fewer than two flights to compare.
    """
    from planner.flight.uncertainty import spread_at_noise
    from planner.identify.calibration import calibrate
    from planner.identify.spread import compared_flight
    from planner.vehicle.repeatability import REPEATABILITY

    flights = [compared_flight(one) for one in done]
    if any(flight is None for flight in flights):
        lost = [one.log for one, flight in zip(done, flights, strict=True) if flight is None]
        msg = f"{', '.join(lost)}: not flown by the mission, nothing to compare: leave it out"
        raise UsageError(msg)
    kept = [flight for flight in flights if flight is not None]
    sources = {OTHER_FLIGHTS: calibrate(kept, known=REPEATABILITY[done[0].setup.flown_by])}
    if vehicle.spread is not None:
        spreads = [
            spread_at_noise(vehicle.spread, vehicle, one.setup.position_noise_m) for one in done
        ]
        sources = {OWN_SPREAD: calibrate(kept, spreads=spreads), **sources}
    return sources


def verify_logs(
    vehicle: VehicleModel,
    paths: Iterable[Path | str],
    known: KnownConditions | None = None,
    *,
    mapping: CsvMapping | None = None,
    left_out: IdentificationSettings | None = None,
    table: LogTable | None = None,
) -> Iterator[Verification]:
    """Predict the flights in logs from their missions alone, and compare with what was flown.

    With ``left_out``, each log is predicted by a model that was identified from the others with these
    settings, instead of by the model given.  A table has what is known of single logs: payload, temperature,
    and mass where it is not the model's.

    Raises LogFileError if a log cannot be read, or holds no mission and none is given.
    Raises MissionFileError if a mission cannot be predicted.
    Raises UsageError if the model cannot be flown as the logs were.
    """
    from planner.identify.verification import KnownConditions, verify_flight
    from planner.logs.files import read_log

    known = known or KnownConditions()

    def known_of(record: FlightRecord) -> KnownConditions:
        return known if table is None else known.beside(table.of(record.source), vehicle)

    if left_out is not None:
        from planner.identify.identification import verify_left_out

        yield from verify_left_out([read_log(path, mapping) for path in paths], left_out, known_of)
        return
    for path in paths:
        for record in read_log(path, mapping):
            yield verify_flight(record, vehicle, known_of(record))
