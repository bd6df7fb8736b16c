"""What a reader makes of a log, whatever its format: one run of one clock, in native samples."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.logs.record import LogFormat, LoggedHome, LoggedItem
    from planner.logs.series import Series


@frozen
class LogFile:
    """Which file a recording comes from."""

    source: str
    """File name as the user gave it."""
    sha256: str
    log_format: LogFormat


@frozen(eq=False)
class Recording:
    """Everything a log tells between two restarts of its clock.

    ``series`` holds quantities by the names of the record's columns, as far as the log has them
    directly; the rest is computed.  It may hold these besides, which are no columns:

    ``local_north_m``, ``local_east_m``, ``local_height_m``
        Position in the frame the references are given in, wherever its origin is.
    ``reference_latitude_deg``, ``reference_longitude_deg``, ``reference_altitude_amsl_m``
        References where the log gives them globally.  ``reference_north_m``,
        ``reference_east_m`` and ``reference_height_m`` are in the local frame.
    ``course_deg``
        Direction of the ground speed, where velocities are not logged.
    """

    file: LogFile
    begin_s: float
    end_s: float
    series: Mapping[str, Series]
    is_armed: Series | None
    """Events 1 and 0; ``None`` where arming is not logged."""
    is_landed: Series | None
    """Events 1 and 0; ``None`` where the autopilot's landing detector is not logged."""
    modes: tuple[tuple[float, str], ...]
    """Time and name of each mode entered, in the order of time."""
    modes_found_in: str
    """Message and fields of the modes."""
    mission_item: Series | None
    """Events: the item begun, from 1, home not counted; 0 where none is flown any longer."""
    homes: tuple[tuple[float, LoggedHome], ...]
    """Time of each home set, in the order of time."""
    missions: tuple[tuple[float, tuple[LoggedItem, ...]], ...]
    """Time from which each mission is the one on board."""
    parameters: tuple[tuple[float, str, float], ...]
    """Time, name and value of each parameter told, in the order of the log."""
    autopilot: Autopilot | None
    firmware: str
    vehicle: str
    position_jumps: tuple[tuple[float, float], ...]
    """Time and size in metres of each reset of the position estimate, where they are logged."""
    remarks: Mapping[str, str]
    """What is to be said of a quantity that is not as it should be, by the column's name."""
    findings: tuple[Finding, ...]


def carried_over(runs: Iterable[Recording]) -> tuple[Recording, ...]:
    """Return the runs of one vehicle's clock, each with what a vehicle keeps over a restart.

    Parameters, mission, firmware and frame are told once; they hold until they are told anew.
    """
    found: list[Recording] = []
    for run in runs:
        if not found:
            found.append(run)
            continue
        before = found[-1]
        kept = tuple((-math.inf, name, value) for _, name, value in before.parameters)
        mission = tuple((-math.inf, items) for _, items in before.missions[-1:])
        found.append(
            replace(
                run,
                parameters=(*kept, *run.parameters),
                missions=(*mission, *run.missions),
                firmware=run.firmware or before.firmware,
                vehicle=run.vehicle or before.vehicle,
            )
        )
    return tuple(found)
