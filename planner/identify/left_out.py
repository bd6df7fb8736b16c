"""Leave one out: each log's flights predicted by a model identified from all other logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.identify.identification import identify_vehicle
from planner.identify.verification import verify_flight
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.identify.assembly import IdentificationSettings
    from planner.identify.verification import KnownConditions, Verification
    from planner.logs.record import FlightRecord


def verify_left_out(
    logs: Sequence[Sequence[FlightRecord]],
    settings: IdentificationSettings,
    known: KnownConditions,
) -> Iterator[Verification]:
    """Identify a vehicle from all logs but one, and verify on that one, for each in turn.

    Parameters
    ----------
    logs : sequence of sequence of FlightRecord
        The flights, log by log.
    settings : IdentificationSettings
        What no log tells; its base gives what the other logs do not tell, which is then said.
    known : KnownConditions
        What the logs do not tell of the flights, or tell wrongly.

    Yields
    ------
    Verification
        One for every flight, with what was found when the others were identified.

    Raises
    ------
    UsageError
        If there is one log only.
    """
    if len(logs) < 2:
        msg = "leaving one log out needs two logs at least"
        raise UsageError(msg)
    for number, flights in enumerate(logs):
        others = [record for n, log in enumerate(logs) if n != number for record in log]
        identified = identify_vehicle(others, settings)
        for record in flights:
            verified = verify_flight(record, identified.model, known)
            own = [f for f in identified.findings if f.code.startswith("I")]
            yield replace(verified, findings=(*verified.findings, *own))
