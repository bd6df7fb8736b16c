"""Decisions of a guard as JSON lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.json_document import envelope, json_text

if TYPE_CHECKING:
    from datetime import datetime

    from planner.link.guarding import Decision


def decision_json(decision: Decision, *, address: str, at: datetime, version: str) -> str:
    """Return a decision as one line.

    Parameters
    ----------
    decision : Decision
        What was decided.
    address : str
        The vehicle's.
    at : datetime
        When, with its time zone.
    version : str
        Of this program.
    """
    document = {
        **envelope(version),
        "time": at.isoformat(timespec="milliseconds"),
        "vehicle": address,
        "kind": decision.kind,
        "verdict": decision.verdict.value,
        "text": decision.text,
        **decision.details,
    }
    return json_text(document)
