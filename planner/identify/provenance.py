"""Where the numbers of an identified model come from, for its file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.identify.outcome import Status
from planner.vehicle.model import Provenance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.autopilot import Autopilot
    from planner.identify.outcome import StateOutcome
    from planner.identify.settings import IdentificationSettings
    from planner.logs.record import FlightRecord


def made_description(records: Sequence[FlightRecord], reference: Autopilot) -> str:
    """Return a description for a pilot, where none is given."""
    names = ", ".join(sorted({r.vehicle for r in records if r.vehicle})) or "Multicopter"
    minutes = sum(r.duration_s for r in records) / 60.0
    flights = f"{len(records)} flight" + ("s" if len(records) > 1 else "")
    return f"{names}, {reference.label}; identified from {flights} of {minutes:.0f} min."


def made_provenance(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    outcomes: Sequence[StateOutcome],
    readings: Sequence[str],
) -> Provenance:
    """Return logs, method and figures of the fit.

    Parameters
    ----------
    records : sequence of FlightRecord
        The flights.
    settings : IdentificationSettings
        Date, version and method.
    outcomes : sequence of StateOutcome
        What was found about each state.
    readings : sequence of str
        What was decided.
    """
    files = {record.sha256: record.source for record in records}
    firmware = ", ".join(sorted({r.firmware for r in records if r.firmware}))
    vehicle = ", ".join(sorted({r.vehicle for r in records if r.vehicle}))
    told = " of ".join(part for part in (firmware, vehicle) if part)
    source = f"{numbers.count(len(records), 'flight')} in {numbers.count(len(files), 'log')}" + (
        f", {told}" if told else ""
    )
    fit: list[tuple[str, float]] = [("flights", float(len(records)))]
    for outcome in outcomes:
        if outcome.status is not Status.IDENTIFIED:
            continue
        name = outcome.name.replace(" ", "_")
        fit.append((f"{name}_segments", float(outcome.used)))
        if outcome.fit_percent is not None:
            fit.append((f"{name}_fit_percent", round(outcome.fit_percent, 2)))
        if outcome.rms is not None:
            unit = {"W": "w", "m": "m", "m/s": "m_s", "V": "v"}.get(outcome.unit, "")
            fit.append((f"{name}_rmse_{unit}".rstrip("_"), float(f"{outcome.rms:.4g}")))
    return Provenance(
        source=source,
        method=f"mavjoule identify {settings.version}, {settings.method}",
        date=settings.date,
        readings=tuple(readings),
        logs=tuple(_log_name(path) for path in files.values()),
        logs_sha256=tuple(files),
        fit=tuple(fit),
    )


def _log_name(path: str) -> str:
    """Return a log's name with its folder's: logs of one logger are often called alike."""
    parts = Path(path).parts
    return "/".join(parts[-2:])


def made_remarks(
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
    outcomes: Sequence[StateOutcome],
) -> tuple[str, ...]:
    """Return comments for the top of the file: each state with its numbers and their errors."""
    minutes = sum(r.duration_s for r in records) / 60.0
    flights = numbers.count(len(records), "flight")
    lines = [
        f"Written by mavjoule identify {settings.version} from {flights}, {minutes:.0f} min.",
        "",
    ]
    for outcome in outcomes:
        lines.append(f"{outcome.name}: {outcome.said}")
        lines += [
            f"    {e.name} = {e.value:.6g} +- {e.error:.2g}"
            for e in outcome.estimates
            if np.isfinite(e.error)
        ]
    return tuple(lines)
