"""Reader of ArduPilot's DataFlash logs, binary and text, to recordings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.catalogue.flight_log import LOG_DAMAGED
from planner.errors import LogFileError
from planner.logs import dataflash_events as events
from planner.logs.clock import Clock
from planner.logs.dataflash_binary import read_binary
from planner.logs.dataflash_quantities import other_batteries, quantity_series
from planner.logs.dataflash_text import read_text
from planner.logs.recording import Recording, carried_over

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from mmap import mmap

    from planner.findings import Finding
    from planner.logs.dataflash_messages import DataflashLog, MessageTable
    from planner.logs.record import FloatArray
    from planner.logs.recording import LogFile


def dataflash_recordings(data: mmap, file: LogFile, *, is_binary: bool) -> tuple[Recording, ...]:
    """Return what a DataFlash log tells, a recording for each run of its clock.

    Parameters
    ----------
    data : mmap
        The file.
    file : LogFile
        Which it is.
    is_binary : bool
        Whether it is the binary form, else the text form.

    Returns
    -------
    tuple of Recording
        One, unless the autopilot was restarted while logging.

    Raises
    ------
    LogFileError
        If it holds no message with a time.
    """
    log = read_binary(data) if is_binary else read_text(data)
    own_times = {name: table.time_s() for name, table in log.tables.items()}
    timed = {name: times for name, times in own_times.items() if times is not None}
    if not timed:
        msg = "holds no message with a time that ArduPilot 3.1 or newer would log"
        raise LogFileError(msg, source=file.source)
    clock = Clock.of(
        np.concatenate([log.tables[name].places for name in timed]),
        np.concatenate(list(timed.values())),
    )
    findings = (*_damage(log, file.source), *clock.findings(file.source))
    recordings: list[Recording] = []
    for begin, end in clock.runs():
        tables = {
            name: table.rows(clock.is_in_time(table.places)) if name in timed else table
            for name, table in log.between(begin, end).items()
        }
        recordings.append(_recording(tables, clock, file, findings))
    return carried_over(recordings)


def _recording(
    tables: Mapping[str, MessageTable],
    clock: Clock,
    file: LogFile,
    findings: tuple[Finding, ...],
) -> Recording:
    times: dict[str, FloatArray] = {}
    for name, table in tables.items():
        own = table.time_s()
        times[name] = clock.time_at_s(table.places) if own is None else own
    series, remarks = quantity_series(tables, times)
    firmware, frame = events.firmware_and_frame(tables)
    entered = events.modes(tables, times, firmware)
    every = np.concatenate([np.empty(0), *(values for values in times.values())])
    return Recording(
        file=file,
        begin_s=float(np.min(every, initial=np.inf)),
        end_s=float(np.max(every, initial=-np.inf)),
        series=series,
        is_armed=events.armed_events(tables, times),
        is_landed=events.landed_events(tables, times),
        modes=entered,
        modes_found_in="MODE.Mode",
        mission_item=events.mission_item_events(tables, times, entered),
        homes=events.homes(tables, times),
        missions=events.missions(tables, times),
        parameters=events.parameters(tables, times),
        autopilot=Autopilot.ARDUPILOT,
        firmware=firmware,
        vehicle=frame,
        position_jumps=(),
        remarks=remarks,
        findings=(*findings, *other_batteries(tables, file.source)),
    )


def _damage(log: DataflashLog, source: str) -> Iterator[Finding]:
    if not log.unreadable:
        return
    why = f" ({log.stopped_by}; nothing behind it is read)" if log.stopped_by else ""
    yield LOG_DAMAGED.finding(
        f"{source}: {log.unreadable} of {log.size} {log.unit}, the first at "
        f"{log.first_unreadable}, are no messages: left out{why}"
    )
