"""What is shipped, as JSON: the rules of the catalogue and the vehicle models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.catalogue.px4_events import events_of
from planner.report.json_document import envelope, json_text, values
from planner.report.rule_text import way_off

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Rule
    from planner.report.json_document import Document
    from planner.vehicle.model import VehicleModel

_MODEL_KEYS = ("name", "kind", "reference", "description", "mass_kg", "source")
_RULE_KEYS = ("code", "name", "severity", "summary", "why", "how", "example", "fix")


def rules_json(rules: Sequence[Rule], *, version: str) -> str:
    """Return rules of the catalogue as a JSON document."""
    return json_text(envelope(version) | {"rules": [_rule(rule) for rule in rules]}, indent=2)


def rule_json(rule: Rule, *, version: str) -> str:
    """Return one rule as a JSON document."""
    return json_text(envelope(version) | _rule(rule), indent=2)


def models_json(vehicles: Sequence[VehicleModel], *, version: str) -> str:
    """Return vehicle models as a JSON document."""
    models = [
        values(vehicle, _MODEL_KEYS)
        | {"battery_wh": None if vehicle.battery is None else vehicle.battery.energy_wh}
        for vehicle in vehicles
    ]
    return json_text(envelope(version) | {"models": models}, indent=2)


def _rule(rule: Rule) -> Document:
    return values(rule, _RULE_KEYS) | {
        "severity": rule.severity.label,
        "turn_off": way_off(rule),
        "default": rule.is_default,
        "px4_events": list(events_of(rule.code)),
    }
