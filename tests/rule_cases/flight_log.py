"""Family R, up to R108, and R206: what the records of flights tell or do not."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import made_flight as made
from dataflash_writer import DataflashWriter, copter_log
from rule_cases.case import RuleCases
from ulog_writer import px4_log

from planner.logs.files import read_log

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.findings import Finding
    from planner.logs.record import FlightRecord

PLACE = (made.LATITUDE_DEG, made.LONGITUDE_DEG)


def records_of(log: DataflashWriter | bytes) -> tuple[FlightRecord, ...]:
    """Return the flights in a log."""
    content = log if isinstance(log, bytes) else log.content()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "flight.bin"
        path.write_bytes(content)
        return read_log(path)


def reported(log: DataflashWriter | bytes) -> tuple[Finding, ...]:
    """Return what is reported of the flights in a log."""
    return tuple(finding for record in records_of(log) for finding in record.findings)


@cache
def as_made() -> tuple[Finding, ...]:
    return reported(copter_log())


def ending(name: str, *values: float) -> tuple[Finding, ...]:
    """Return what is reported of the made flight with one more message before its end."""
    log = copter_log()
    log.add(name, round(59.95e6), *values)
    return reported(log)


def between(add: Callable[[DataflashWriter], None], after_s: float) -> tuple[Finding, ...]:
    """Return what is reported of the made flight with messages put in behind a time."""
    log = copter_log()
    before = len(copter_log().messages)
    add(log)
    inserted, log.messages[before:] = log.messages[before:], []
    at = int(before * (after_s - made.BEGIN_S) / (made.END_S - made.BEGIN_S))
    log.messages[at:at] = inserted
    return reported(log)


def back(from_s: float, by_s: float) -> tuple[Finding, ...]:
    """Return what is reported where a clock goes back and, a message on, is right again."""

    def stray(log: DataflashWriter) -> None:
        for time_s in (from_s, from_s - by_s):
            log.add("POS", round(time_s * 1e6), *PLACE, 420.0, 20.0, 20.0)

    return between(stray, from_s)


def armed(up_to_m: float) -> tuple[Finding, ...]:
    """Return what is reported of an arming behind the made flight that rises by so much."""
    log = copter_log()
    for tenth in range(700, 801):
        if tenth in {710, 790}:
            log.add("ARM", tenth * 100_000, int(tenth == 710), 0)
        height_m = up_to_m if 740 <= tenth < 760 else 0.0
        log.add("POS", tenth * 100_000, *PLACE, 400.0 + height_m, height_m, height_m)
    return reported(log)


def sent(height_m: float) -> tuple[Finding, ...]:
    """Return what is reported of a mission that is sent in flight, its waypoint at a height."""

    def upload(log: DataflashWriter) -> None:
        for number, command, north_deg in (
            (0, 16, 0.0),
            (1, 22, 0.0),
            (2, 16, 0.001),
            (3, 21, 0.0),
        ):
            log.add(
                *("CMD", 30_000_000, 4, number, command, 0.0, 0.0, 0.0, 0.0),
                *(PLACE[0] + north_deg, PLACE[1], height_m if number == 2 else 20.0, 3),
            )

    return between(upload, 30.0)


def damaged(at: str) -> tuple[Finding, ...]:
    """Return what is reported of bytes that are no messages: in the middle, or never written."""
    messages = copter_log().messages
    if at == "end":
        return reported(b"".join(messages) + b"\xff" * 4096)
    half = len(messages) // 2
    return reported(b"".join(messages[:half]) + b"\x55" * 500 + b"".join(messages[half:]))


CASES: Mapping[str, RuleCases] = {
    "R101": RuleCases(
        fires=lambda: damaged("middle"), boundary=lambda: damaged("end"), silent=as_made
    ),
    "R102": RuleCases(
        fires=lambda: reported(copter_log(gap_s=(24.0, 25.3))),
        boundary=lambda: reported(copter_log(gap_s=(24.0, 25.0))),
        silent=lambda: reported(copter_log(gap_s=(24.0, 24.9))),
    ),
    "R103": RuleCases(
        fires=lambda: back(32.0, 1.25), boundary=lambda: back(32.0, 1.0), silent=as_made
    ),
    "R104": RuleCases(
        fires=lambda: reported(copter_log(begins_s=made.TAKEOFF_S + 0.1)),
        boundary=lambda: reported(copter_log(begins_s=made.TAKEOFF_S - 0.1)),
        silent=as_made,
    ),
    "R105": RuleCases(
        fires=lambda: armed(0.0),
        boundary=lambda: armed(1.0),
        fires_at_boundary=True,
        silent=lambda: armed(1.1),
    ),
    "R106": RuleCases(
        fires=lambda: ending("BAT", 1, 12.0, 12.0, 0.21, 0.0),
        boundary=lambda: ending("BAT", 1, 12.0, 12.0, 0.2 - 1e-8, 0.0),  # in single precision
        silent=lambda: ending("BAT", 1, 12.0, 12.0, 0.0, 0.0),
    ),
    "R107": RuleCases(
        fires=lambda: reported(px4_log(jump_s=30.0, jump_m=(1.01, 0.0)).content()),
        boundary=lambda: reported(px4_log(jump_s=30.0, jump_m=(1.0, 0.0)).content()),
        silent=lambda: reported(px4_log().content()),
    ),
    "R108": RuleCases(
        fires=lambda: ending("POS", 90.1, 8.0, 400.0, 0.0, 0.0),
        boundary=lambda: ending("POS", 90.0, 8.0, 400.0, 0.0, 0.0),
        silent=as_made,
    ),
    "R206": RuleCases(
        fires=lambda: sent(30.0),
        boundary=lambda: sent(20.0),
        silent=as_made,  # the same again
    ),
}
