"""Flight logs from files, recognised by their content."""

from __future__ import annotations

import hashlib
import mmap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import LogFileError
from planner.logs.csv import NO_KNOWN_LOG, csv_recordings, looks_like_csv
from planner.logs.dataflash import HEADER, dataflash_recordings
from planner.logs.dataflash import MAGIC as DATAFLASH_TEXT
from planner.logs.flights import flight_record, flight_spans, plausible
from planner.logs.record import LogFile, LogFormat
from planner.logs.tlog import is_tlog, tlog_recordings
from planner.logs.ulog import ulog_recordings
from planner.logs.ulog_messages import MAGIC as ULOG_MAGIC

if TYPE_CHECKING:
    from planner.logs.csv import CsvMapping
    from planner.logs.record import FlightRecord, Recording


_MOST_COPIED = 256 << 20
"""A log of no more bytes is copied: of one that is read in place, what another program cuts off meanwhile
ends this one by SIGBUS.  Flights of an hour at full rates make half as much."""


def read_log(path: str | Path, mapping: CsvMapping | None = None) -> tuple[FlightRecord, ...]:
    """Read a flight log.

    Parameters
    ----------
    path : str or Path
        ArduPilot's DataFlash (binary or text), PX4's ULog, MAVLink telemetry, or CSV of a known
        kind; recognised by its content.
    mapping : CsvMapping, optional
        For CSV of any other kind: which column is which quantity.

    Returns
    -------
    tuple of FlightRecord
        The flights in it, in the order they were flown; at least one.

    Raises
    ------
    LogFileError
        If it cannot be read, is no log, or holds no flight.
    """
    path = Path(path)
    source = str(path)
    try:
        if "\x00" in source:
            msg = "is not a file name: it holds a zero byte"
            raise LogFileError(msg, source=source)
        if path.exists() and not path.is_file():
            msg = "is not a file"
            raise LogFileError(msg, source=source)
        with path.open("rb") as file:
            if not (size := path.stat().st_size):
                msg = "is empty"
                raise LogFileError(msg, source=source)
            # Not closed by hand, which fails where an error holds arrays over it and hides that error.
            if size > _MOST_COPIED:
                data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            else:
                data = mmap.mmap(-1, size)
                if file.readinto(data) != size:
                    msg = "became shorter while it was read"
                    raise LogFileError(msg, source=source)
            digest = hashlib.sha256(data).hexdigest()
            # What is no number or no possible one is sorted out value by value.
            with np.errstate(invalid="ignore", over="ignore"):
                recordings = _recordings(data, source, digest, mapping)
    except OSError as error:
        msg = f"cannot be read: {error.strerror or error}"
        raise LogFileError(msg, source=source) from error
    return _flights([plausible(recording) for recording in recordings], source)


def _recordings(
    data: mmap.mmap, source: str, sha256: str, mapping: CsvMapping | None
) -> tuple[Recording, ...]:
    """Return what a log holds by the reader its first bytes ask for."""

    def file(log_format: LogFormat) -> LogFile:
        return LogFile(source=source, sha256=sha256, log_format=log_format)

    if data[: len(ULOG_MAGIC)] == ULOG_MAGIC:
        return ulog_recordings(data, file(LogFormat.ULOG))
    if is_tlog(data):
        return tlog_recordings(data, file(LogFormat.TLOG))
    is_binary = data[: len(HEADER)] == HEADER
    if is_binary or data[: len(DATAFLASH_TEXT)] == DATAFLASH_TEXT:
        return dataflash_recordings(data, file(LogFormat.DATAFLASH), is_binary=is_binary)
    if mapping is not None or looks_like_csv(data):
        return csv_recordings(file(LogFormat.CSV), mapping)
    raise LogFileError(NO_KNOWN_LOG, source=source)


def _flights(recordings: list[Recording], source: str) -> tuple[FlightRecord, ...]:
    records: list[FlightRecord] = []
    is_armed = False
    for recording in recordings:
        spans, left_out = flight_spans(recording)
        is_armed |= bool(left_out)
        for span in spans:
            records.append(flight_record(recording, span, len(records) + 1, left_out))
    if not records:
        why = (
            "the vehicle is armed but never leaves the ground" if is_armed else "nothing takes off"
        )
        msg = f"holds no flight: {why}"
        raise LogFileError(msg, source=source)
    return tuple(records)
