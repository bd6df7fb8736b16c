"""What identification found, as JSON, schema 1: keys may be added, never changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.json_document import envelope, json_text, value, values

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.identify.outcome import Identification, StateOutcome
    from planner.logs.record import FlightRecord
    from planner.report.json_document import Document

_STATE_KEYS = ("name", "status", "said", "unit", "fit_percent", "rms", "whiteness")
_SEGMENT_KEYS = (
    "log",
    "flight",
    "start_s",
    "duration_s",
    "what",
    "is_used",
    "is_held_out",
    "refusal",
    "fit_percent",
)
_ESTIMATE_KEYS = ("name", "value", "error")
_FINDING_KEYS = ("code", "name", "message", "fix")
_FLIGHT_KEYS = ("source", "sha256", "number", "duration_s", "firmware", "vehicle")
_QUANTITY_KEYS = ("name", "found_in", "rate_hz", "coverage", "remark", "absence_cost")


def identification_json(found: Identification, *, version: str, output: str | None) -> str:
    """Return an identification as a JSON document."""
    model = values(found.model, ("name", "reference", "description", "mass_kg"))
    return json_text(
        envelope(version)
        | {
            "model": model | {"file": output},
            "flights": [values(record, _FLIGHT_KEYS) for record in found.evidence.records],
            "states": [_state(outcome) for outcome in found.states],
            "findings": [_finding(finding) for finding in found.findings],
        },
        indent=2,
    )


def log_table_json(records: Sequence[FlightRecord], *, version: str) -> str:
    """Return what the flights of logs tell as a JSON document."""
    flights = [
        values(record, _FLIGHT_KEYS)
        | {
            "begins_with": record.begins_with.value,
            "ends_with": record.ends_with.value,
            "parameters": len(record.parameters),
            "mission_items": len(record.mission_items),
            "quantities": [values(row, _QUANTITY_KEYS) for row in record.quantities],
            "findings": [_finding(finding) for finding in record.findings],
        }
        for record in records
    ]
    return json_text(envelope(version) | {"flights": flights}, indent=2)


def _state(outcome: StateOutcome) -> Document:
    return values(outcome, _STATE_KEYS) | {
        "segments_used": outcome.used,
        "segments_held_out": outcome.held_out,
        "estimates": [values(estimate, _ESTIMATE_KEYS) for estimate in outcome.estimates],
        "segments": [values(segment, _SEGMENT_KEYS) for segment in outcome.segments],
    }


def _finding(finding: Finding) -> Document:
    return values(finding, _FINDING_KEYS) | {"severity": value(finding.severity, "label")}
