"""Results as JSON, schema 1: keys may be added, never changed; the unit is in the key."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

import msgspec

from planner.catalogue import entries, events_of
from planner.findings import Severity
from planner.flight.budget import Totals
from planner.flight.prediction import ItemArrival, Segment, Segments
from planner.report.rule_text import way_off
from planner.report.text import count_codes, well_formed
from planner.service.preflight import CheckResult
from planner.setup import conditions
from planner.values import field_names, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from datetime import datetime

    from planner.findings import Finding, Rule
    from planner.guard.decision import Decision
    from planner.identify.assembly import Identification
    from planner.identify.calibration import Calibration
    from planner.identify.segments import StateOutcome
    from planner.identify.verification import Verification
    from planner.link.snapshot import VehicleSnapshot
    from planner.logs.record import FlightRecord
    from planner.rules.ledger import LedgerEntry
    from planner.service.preflight import UnreadableMission
    from planner.service.vehicle import MissionComparison
Document = dict[str, object]
SCHEMA = 1
_VERIFICATION_CONDITIONS = frozenset(
    {"wind_m_s", "wind_from_deg", "home_amsl_m", "temperature_c", "payload_kg"}
)


def envelope(version: str) -> Document:
    """Return what every document begins with."""
    return {"schema": SCHEMA, "tool": {"name": "mavjoule", "version": version}}


def values(source: object | None, keys: Sequence[str]) -> Document:
    """Return the named attributes; all ``None`` where there is nothing to take them from."""
    if source is None:
        return dict.fromkeys(keys)
    return {key: plain(getattr(source, key)) for key in keys}


def value(source: object | None, key: str) -> object:
    """Return a named attribute as JSON can hold it; ``None`` where there is nothing."""
    return plain(None if source is None else getattr(source, key))


def plain(found: object) -> object:
    """Return what JSON can hold: it has no NaN and no infinity, so what is not a number is absent."""
    if isinstance(found, float):
        return found if math.isfinite(found) else None
    if isinstance(found, Severity):
        return found.label
    return well_formed(found) if isinstance(found, str) else found


def json_text(document: Document, *, indent: int | None = None) -> str:
    """Return a document as text, on one line where no indent is given."""
    try:
        text = msgspec.json.encode(document, enc_hook=_as_number).decode()
    except UnicodeEncodeError:  # a lone surrogate; Python's encoder takes six times as long
        text = json.dumps(document, allow_nan=False)
    text = msgspec.json.format(text, indent=0 if indent is None else indent)
    # ASCII only, so that no console code page can break the document.
    return f"{text if text.isascii() else _OTHERS.sub(_escaped, text)}\n"


_OTHERS = re.compile(r"[^\x00-\x7f]+")


def _escaped(match: re.Match[str]) -> str:
    return json.dumps(match[0])[1:-1]


def _as_number(found: object) -> float:
    """Return a number of numpy's as one of Python's; raise ``TypeError`` for what JSON cannot hold."""
    if isinstance(found, float):
        return float(found)
    msg = f"JSON cannot hold {found!r}"
    raise TypeError(msg)


SEGMENT_KEYS = field_names(Segment)
_ARRIVAL_KEYS = tuple(name for name in field_names(ItemArrival) if name != "later")
ITEM_KEYS = (*_ARRIVAL_KEYS, "pass")
"""The keys of a segment and of an item, in JSON and as columns of a table."""
_BATTERY_KEYS = (
    "capacity_wh",
    "usable_wh",
    "used_fraction",
    "reserve_fraction",
    "margin_wh",
    "charge_left_fraction",
    "lowest_voltage_v",
    "highest_c_rate",
    "reserve_wh",
    "hover_left_s",
    "below_reserve_probability",
    "empty_probability",
)
_RETURN_KEYS = (
    "tightest_item",
    "energy_home_wh",
    "margin_wh",
    "time_home_s",
    "destination",
    "below_reserve_probability",
    "empty_probability",
)
_POINT_KEYS = ("item", "time_s", "along_m", "leg_m", "latitude_deg", "longitude_deg")


def check_json(
    results: Sequence[CheckResult | UnreadableMission],
    *,
    version: str,
    with_statistics: bool = False,
    left_out: Sequence[str] | None = None,
) -> str:
    """Return all missions of a call as one JSON document.

    If asked with a count of each code; of folders with their files that are no missions.
    """
    document: Document = {"missions": [mission_document(result) for result in results]}
    if left_out is not None:
        document["left_out"] = list(left_out)
    if with_statistics:
        counts = count_codes(results)
        document["statistics"] = [values(one, field_names(one)) for one in counts]
    return json_text(envelope(version) | document, indent=2)


def check_json_lines(
    results: Sequence[CheckResult | UnreadableMission],
    *,
    version: str,
    left_out: Sequence[str] | None = None,
) -> str:
    """Return one JSON document per line and mission, each complete in itself, as `check_json` has it."""
    more: Document = {} if left_out is None else {"left_out": list(left_out)}
    return "".join(
        json_text(envelope(version) | mission_document(result) | more) for result in results
    )


def segments_json(result: CheckResult, *, version: str) -> str:
    """Return the decomposition of one mission as a JSON document."""
    mission = mission_document(result)
    keys = ("file", "vehicle", "is_vehicle_named", "settings_file", "conditions", "segments")
    return json_text(envelope(version) | {key: mission[key] for key in keys}, indent=2)


def figures(result: CheckResult | UnreadableMission) -> Document:
    """Return what a flight takes, leaves and needs to get home, as the keys of the contract."""
    flown = result if isinstance(result, CheckResult) else None
    way = None if flown is None else flown.return_plan
    return {
        "totals": values(value(flown, "totals"), field_names(Totals)),
        "battery": values(value(flown, "battery"), _BATTERY_KEYS),
        "return": values(way, _RETURN_KEYS)
        | {
            f"{point}_{key}": value(getattr(way, point, None), key)
            for point in ("tightest", "last_return", "last_return_empty")
            for key in _POINT_KEYS
            if f"{point}_{key}" not in _RETURN_KEYS
        },
    }


def mission_document(result: CheckResult | UnreadableMission) -> Document:
    """Return one mission under the keys of the contract."""
    # What is unknown keeps its keys: scripts meet null, not a missing key.
    flown = result if isinstance(result, CheckResult) else None
    setup = None if flown is None else flown.setup
    vehicle = None if setup is None else setup.vehicle
    return {
        "file": value(result, "file"),
        "verdict": result.verdict,
        "verdict_text": result.verdict_text,
        "vehicle": values(vehicle, ("name", "source")),
        **setup_document(result),
        "conditions": {row.key: plain(number) for row, number in conditions(setup)},
        "parameters": _parameters(flown),
        **figures(result),
        "segments": _segments(flown.segments) if flown else [],
        "items": [row for one in (flown.items if flown else ()) for row in _passes(one)],
        "checks": checks_document(result.checked),
        **found_document(result.findings, result.suppressed),
    }


def _segments(segments: Sequence[Segment]) -> list[Document]:
    if not isinstance(segments, Segments):  # none
        return [values(one, SEGMENT_KEYS) for one in segments]
    columns = map(_plain_column, segments.columns().values())
    return [dict(zip(SEGMENT_KEYS, row, strict=True)) for row in zip(*columns, strict=True)]


def _plain_column(column: list[Any]) -> list[Any]:
    """Return each as of `plain`: finite numbers, which have a finite sum, are it already."""
    try:
        is_plain = math.isfinite(sum(column))
    except TypeError:  # texts, or some are absent
        is_plain = False
    return column if is_plain else [*map(plain, column)]


def _passes(arrival: ItemArrival) -> Iterator[Document]:
    """Yield a row of every pass of an item, the first as number 1."""
    yield values(arrival, _ARRIVAL_KEYS) | {"pass": 1}
    for number, (arrival_s, energy_wh, left_s) in enumerate(arrival.later, 2):
        again = replace(arrival, arrival_s=arrival_s, energy_used_wh=energy_wh, left_s=left_s)
        yield values(again, _ARRIVAL_KEYS) | {"pass": number}


def setup_document(result: CheckResult | UnreadableMission) -> Document:
    """Return whether the vehicle was named, and the file that has set something, with what."""
    setup = result.setup if isinstance(result, CheckResult) else None
    file = None if setup is None else setup.settings_file
    return {
        "is_vehicle_named": value(setup, "is_vehicle_named"),
        "settings_file": {
            "path": value(file, "path"),
            "values": {} if file is None else {key: plain(text) for key, text in file.values},
        },
    }


def checks_document(checked: Sequence[LedgerEntry]) -> list[Document]:
    """Return what became of each rule."""
    return list[Document](msgspec.to_builtins(checked))


def _parameters(result: CheckResult | None) -> Document:
    """Return what the autopilot was taken to fly with, each value with where it comes from."""
    flown_with = None if result is None else result.parameters
    if flown_with is None:
        return {}
    return {
        quantity: {"value": value(flown_with, quantity), "origin": str(origin)}
        for quantity, origin in flown_with.origins.items()
    }


def found_document(findings: Iterable[Finding], suppressed: Iterable[Finding]) -> Document:
    """Return what is reported, and what is not as asked, under their keys."""
    return {
        "findings": [finding_document(one) for one in findings],
        "suppressed": [
            finding_document(one) | {"suppression": value(one, "suppression")} for one in suppressed
        ],
    }


def finding_document(finding: Finding) -> Document:
    """Return a finding under the keys of the contract; a stretch only where one is meant."""
    return (
        values(finding, ("code", "name", "severity", "item"))
        | values(finding.place, ("line", "column"))
        | values(finding, ("message", "fix"))
        | stretch_document(finding)
    )


def stretch_document(finding: Finding) -> Document:
    """Return the stretch of ground of a finding under its key; nothing where none is meant."""
    stretch = finding.stretch
    if stretch is None:
        return {}
    return {
        "stretch": {
            "start_deg": list(stretch.start_deg),
            "end_deg": list(stretch.end_deg),
            "distance_m": value(stretch, "distance_m"),
            "parts_deg": [[list(point) for point in line] for line in stretch.lines_deg],
        }
    }


_DIFFERENCE_KEYS = ("part", "number", "field", "first", "second", "kind", "matters", "message")


def comparison_json(comparison: MissionComparison, version: str) -> str:
    """Return every difference as an object; ``number`` counts from 1 in its part."""
    return json_text(
        {
            **envelope(version),
            "first": comparison.first,
            "second": comparison.second,
            "is_same": comparison.is_same,
            "differences": [values(one, _DIFFERENCE_KEYS) for one in comparison.differences],
        }
    )


def decision_json(decision: Decision, *, address: str, at: datetime, version: str) -> str:
    """Return a decision about the vehicle at an address, at a time with its zone, as one line."""
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


_STATE_KEYS = ("name", "status", "unit", "fit_percent", "rms", "whiteness")
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
_FINDING_KEYS = ("code", "name", "message", "fix", "severity")
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
            "findings": [values(finding, _FINDING_KEYS) for finding in found.findings],
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
            "findings": [values(finding, _FINDING_KEYS) for finding in record.findings],
        }
        for record in records
    ]
    return json_text(envelope(version) | {"flights": flights}, indent=2)


def _state(outcome: StateOutcome) -> Document:
    return values(outcome, _STATE_KEYS) | {
        "said": outcome.summary,
        "segments_used": outcome.used,
        "segments_held_out": outcome.held_out,
        "estimates": [values(estimate, _ESTIMATE_KEYS) for estimate in outcome.estimates],
        "segments": [values(segment, _SEGMENT_KEYS) for segment in outcome.segments],
        "output_error": None if outcome.refined is None else _state(outcome.refined),
    }


def snapshot_json(snapshot: VehicleSnapshot, version: str) -> str:
    """Return who a vehicle is and what was read from it; SI, the unit in each key."""
    identity, mission = snapshot.identity, snapshot.mission
    firmware = identity.firmware_version
    fence = mission.fence
    document = {
        **envelope(version),
        "address": snapshot.address,
        "vehicle": {
            "system": identity.system,
            "component": identity.component,
            "autopilot": None if identity.autopilot is None else identity.autopilot.value,
            "mav_autopilot": identity.autopilot_number,
            "mav_type": identity.vehicle_type,
            "firmware_version": None if firmware is None else ".".join(map(str, firmware)),
            "firmware_release": identity.firmware_release,
            "uid": identity.uid or None,
        },
        "state": msgspec.to_builtins(snapshot.state),
        "counts": {
            "items": len(mission.items),
            "fence_areas": 0 if fence is None else fence.area_count,
            "rally_points": len(mission.rally),
            "parameters": len(snapshot.parameters),
        },
        "findings": [
            values(one, ("code", "name", "severity", "message"))
            for one in (*snapshot.findings, *mission.findings)
        ],
    }
    return json_text(document)


_FIGURES_KEYS = ("time_s", "energy_wh", "distance_m")
_FRACTION_KEYS = ("time_fraction", "energy_fraction")
_COMPARED_KEYS = (
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
_STOP_KEYS = (
    *("start_s", "speed_m_s", "measured_m", "predicted_m", "item", "predicted_speed_m_s"),
    *("measured_farthest_m", "predicted_farthest_m"),
)
_PART_KEYS = ("part", "time_s", "predicted_time_s")
_RMS_KEYS = ("height_rms_m", "speed_rms_m_s", "power_rms_w")
_CUT_KEYS = ("cut_before_s", "cut_after_s")


def verification_json(verifications: Sequence[Verification], *, model: str, version: str) -> str:
    """Return all flights of a call as one JSON document."""
    document: Document = {"model": model, "flights": [_flight(one) for one in verifications]}
    return json_text(envelope(version) | document, indent=2)


_CALIBRATION_KEYS = (
    "of",
    "count",
    "inside",
    "inside_by_chance",
    "coverage",
    "half_width",
    "median_error",
    "sharpness",
    "sharpness_by_chance",
)
_INTERVAL_KEYS = ("error", "low", "high", "is_inside")


def calibration_json(
    sources: Mapping[str, Sequence[Calibration]],
    verifications: Sequence[Verification],
    *,
    model: str,
    version: str,
) -> str:
    """Return how often flights lay in their intervals as one JSON document."""
    calibrations = [
        {
            "intervals_from": name,
            "quantities": [
                {
                    **values(row, _CALIBRATION_KEYS),
                    "intervals": [
                        {
                            **values(verifications[one.flight], ("log", "flight")),
                            **values(one, _INTERVAL_KEYS),
                        }
                        for one in row.intervals
                    ],
                }
                for row in rows
            ],
        }
        for name, rows in sources.items()
    ]
    document: Document = {"model": model, "calibrations": calibrations}
    return json_text(envelope(version) | document, indent=2)


def _flight(one: Verification) -> Document:
    return {
        **values(one, ("log", "flight")),
        "vehicle": one.vehicle_name,
        **values(one, ("mission", "parameters")),
        "conditions": {
            row.key: plain(number)
            for row, number in conditions(one.setup)
            if row.key in _VERIFICATION_CONDITIONS
        },
        "measured": values(one.measured, _FIGURES_KEYS),
        "predicted": values(one.predicted, _FIGURES_KEYS),
        "error": values(one, (*_FRACTION_KEYS, *_RMS_KEYS)),
        "cut": values(one, _CUT_KEYS),
        "parts": [values(part, _PART_KEYS) for part in one.parts],
        "states": [values(state, _COMPARED_KEYS) for state in one.states],
        "stops": [values(stop, _STOP_KEYS) for stop in one.stops],
        "findings": [finding_document(finding) for finding in one.findings],
    }


_RULE_KEYS = ("code", "name", "severity", "summary", "why", "how", "fix")


def rules_json(rules: Sequence[Rule], *, version: str) -> str:
    """Return rules of the catalogue as a JSON document."""
    return json_text(envelope(version) | {"rules": [_rule(rule) for rule in rules]}, indent=2)


def rule_json(rule: Rule, *, version: str) -> str:
    """Return one rule as a JSON document."""
    return json_text(envelope(version) | _rule(rule), indent=2)


def _rule(rule: Rule) -> Document:
    return values(rule, _RULE_KEYS) | {
        "example": entries()[rule.code].example,
        "turn_off": way_off(rule),
        "default": rule.is_default,
        "px4_events": list(events_of(rule.code)),
    }
