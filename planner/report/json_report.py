"""Results as JSON, schema 1: keys may be added, never changed; the unit is in the key."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from planner.report.plain_text import well_formed
from planner.service import CheckResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding, Rule
    from planner.service import UnreadableMission
    from planner.vehicle.model import VehicleModel

    Document = dict[str, object]

SCHEMA = 1

SEGMENT_KEYS = (
    "index",
    "item",
    "state",
    "start_s",
    "duration_s",
    "distance_m",
    "climb_m",
    "speed_m_s",
    "energy_wh",
    "stopping_distance_m",
)
"""The keys of a segment, in JSON and as columns of a table."""

_TOTALS_KEYS = (
    "time_s",
    "distance_m",
    "climb_m",
    "descent_m",
    "energy_wh",
    "charge_mah",
    "mean_power_w",
    "peak_power_w",
    "energy_wh_p10",
    "energy_wh_p90",
)
_BATTERY_KEYS = ("capacity_wh", "usable_wh", "used_fraction", "reserve_fraction", "margin_wh")
_RETURN_KEYS = ("tightest_item", "energy_home_wh", "margin_wh")
_ITEM_KEYS = ("item", "command", "arrival_s", "energy_used_wh")
_MODEL_KEYS = ("name", "kind", "reference", "description", "mass_kg", "source")
_RULE_KEYS = ("code", "name", "severity", "summary", "why", "how", "example", "fix")


def check_json(results: Sequence[CheckResult | UnreadableMission], *, version: str) -> str:
    """Return all missions of a call as one JSON document."""
    missions = [_mission(result) for result in results]
    return _text(_envelope(version) | {"missions": missions}, indent=2)


def check_json_lines(results: Sequence[CheckResult | UnreadableMission], *, version: str) -> str:
    """Return one JSON document per line and mission, each complete in itself."""
    return "".join(_text(_envelope(version) | _mission(result)) for result in results)


def segments_json(result: CheckResult, *, version: str) -> str:
    """Return the decomposition of one mission as a JSON document."""
    mission = _mission(result)
    keys = ("file", "vehicle", "conditions", "segments")
    return _text(_envelope(version) | {key: mission[key] for key in keys}, indent=2)


def rules_json(rules: Sequence[Rule], *, version: str) -> str:
    """Return rules of the catalogue as a JSON document."""
    return _text(_envelope(version) | {"rules": [_rule(rule) for rule in rules]}, indent=2)


def rule_json(rule: Rule, *, version: str) -> str:
    """Return one rule as a JSON document."""
    return _text(_envelope(version) | _rule(rule), indent=2)


def models_json(vehicles: Sequence[VehicleModel], *, version: str) -> str:
    """Return vehicle models as a JSON document."""
    models = [
        _values(vehicle, _MODEL_KEYS)
        | {"battery_wh": None if vehicle.battery is None else vehicle.battery.energy_wh}
        for vehicle in vehicles
    ]
    return _text(_envelope(version) | {"models": models}, indent=2)


def _rule(rule: Rule) -> Document:
    return _values(rule, _RULE_KEYS) | {"severity": rule.severity.label}


def _envelope(version: str) -> Document:
    return {"schema": SCHEMA, "tool": {"name": "mavjoule", "version": version}}


def _mission(result: CheckResult | UnreadableMission) -> Document:
    # What is unknown keeps its keys: scripts meet null, not a missing key.
    flown = result if isinstance(result, CheckResult) else None
    conditions = _value(flown, "conditions")
    wind = _value(conditions, "wind")
    return {
        "file": well_formed(result.file),
        "verdict": result.verdict,
        "vehicle": {
            "name": _value(flown, "vehicle_name"),
            "source": _value(flown, "vehicle_source"),
        },
        "conditions": {
            "wind_m_s": _value(wind, "speed_m_s"),
            "wind_from_deg": _value(wind, "from_deg"),
            **_values(conditions, ("home_amsl_m", "temperature_c", "payload_kg")),
        },
        "totals": _values(_value(flown, "totals"), _TOTALS_KEYS),
        "battery": _values(_value(flown, "battery"), _BATTERY_KEYS),
        "return": _values(_value(flown, "way_home"), _RETURN_KEYS),
        "segments": [_values(one, SEGMENT_KEYS) for one in (flown.segments if flown else ())],
        "items": [_values(one, _ITEM_KEYS) for one in (flown.items if flown else ())],
        "findings": [_finding(finding) for finding in result.findings],
        "suppressed": [_finding(finding) for finding in (flown.suppressed if flown else ())],
    }


def _finding(finding: Finding) -> Document:
    return {
        "code": finding.code,
        "name": finding.name,
        "severity": finding.severity.label,
        "item": finding.item,
        "line": _value(finding.place, "line"),
        "column": _value(finding.place, "column"),
        "message": well_formed(finding.message),
        "fix": well_formed(finding.fix),
    }


def _values(source: object | None, keys: Sequence[str]) -> Document:
    """Return the named attributes; all ``None`` where there is nothing to take them from."""
    return {key: _value(source, key) for key in keys}


def _value(source: object | None, key: str) -> object:
    value = None if source is None else getattr(source, key)
    # JSON has no NaN and no infinity: what is not a number is absent.
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text(document: Document, *, indent: int | None = None) -> str:
    # ASCII only, so that no console code page can break the document.
    return json.dumps(document, ensure_ascii=True, allow_nan=False, indent=indent) + "\n"
