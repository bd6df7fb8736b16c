"""Verifications as JSON, schema 1: keys may be added, never changed; the unit is in the key."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.json_document import envelope, json_text, value, values
from planner.report.json_report import finding_document

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.verification import Verification
    from planner.report.json_document import Document

_FIGURES_KEYS = ("time_s", "energy_wh", "distance_m")
_FRACTION_KEYS = ("time_fraction", "energy_fraction")
_STATE_KEYS = (
    "state",
    "count",
    "fit_percent",
    "energy_fraction",
    "fit_of",
    "predicted_count",
    "time_s",
    "predicted_time_s",
    "energy_wh",
    "predicted_energy_wh",
)
_STOP_KEYS = ("start_s", "speed_m_s", "measured_m", "predicted_m", "item", "predicted_speed_m_s")
_RMS_KEYS = ("height_rms_m", "speed_rms_m_s", "power_rms_w")
_CUT_KEYS = ("cut_before_s", "cut_after_s")


def verification_json(verifications: Sequence[Verification], *, model: str, version: str) -> str:
    """Return all flights of a call as one JSON document."""
    document: Document = {"model": model, "flights": [_flight(one) for one in verifications]}
    return json_text(envelope(version) | document, indent=2)


def _flight(one: Verification) -> Document:
    conditions = one.conditions
    return {
        **values(one, ("log", "flight")),
        "vehicle": one.vehicle_name,
        **values(one, ("mission", "parameters")),
        "conditions": {
            "wind_m_s": value(conditions.wind, "speed_m_s"),
            "wind_from_deg": value(conditions.wind, "from_deg"),
            **values(conditions, ("home_amsl_m", "temperature_c", "payload_kg")),
        },
        "measured": values(one.measured, _FIGURES_KEYS),
        "predicted": values(one.predicted, _FIGURES_KEYS),
        "error": values(one, (*_FRACTION_KEYS, *_RMS_KEYS)),
        "cut": values(one, _CUT_KEYS),
        "states": [values(state, _STATE_KEYS) for state in one.states],
        "stops": [values(stop, _STOP_KEYS) for stop in one.stops],
        "findings": [finding_document(finding) for finding in one.findings],
    }
