"""Results as JSON, schema 1: keys may be added, never changed; the unit is in the key."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.json_document import envelope, json_text, value, values
from planner.report.statistics import count_codes
from planner.service import CheckResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.report.json_document import Document
    from planner.service import UnreadableMission

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
    "stopping_distance_m_p90",
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
    "time_s_p10",
    "time_s_p90",
    "charge_mah_p10",
    "charge_mah_p90",
    "wander_m",
)
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
)
_CONDITION_KEYS = (
    "home_amsl_m",
    "temperature_c",
    "payload_kg",
    "position_noise_m",
    "reaction_time_s",
    "position_error_m",
    "battery_health",
    "battery_resistance_factor",
    "battery_temperature_c",
    "payload_sd_kg",
    "temperature_sd_c",
)
_RETURN_KEYS = (
    "tightest_item",
    "energy_home_wh",
    "margin_wh",
    "time_home_s",
    "destination",
    "below_reserve_probability",
)
_POINT_KEYS = ("item", "time_s", "along_m", "leg_m", "latitude_deg", "longitude_deg")
_COUNT_KEYS = ("code", "name", "severity", "count", "suppressed", "missions")
ITEM_KEYS = ("item", "command", "arrival_s", "energy_used_wh")


def check_json(
    results: Sequence[CheckResult | UnreadableMission],
    *,
    version: str,
    with_statistics: bool = False,
) -> str:
    """Return all missions of a call as one JSON document, if asked with a count of each code."""
    document: Document = {"missions": [mission_document(result) for result in results]}
    if with_statistics:
        document["statistics"] = [
            values(one, _COUNT_KEYS) | {"severity": one.severity.label}
            for one in count_codes(results)
        ]
    return json_text(envelope(version) | document, indent=2)


def check_json_lines(results: Sequence[CheckResult | UnreadableMission], *, version: str) -> str:
    """Return one JSON document per line and mission, each complete in itself."""
    return "".join(json_text(envelope(version) | mission_document(result)) for result in results)


def segments_json(result: CheckResult, *, version: str) -> str:
    """Return the decomposition of one mission as a JSON document."""
    mission = mission_document(result)
    keys = ("file", "vehicle", "conditions", "segments")
    return json_text(envelope(version) | {key: mission[key] for key in keys}, indent=2)


def figures(result: CheckResult | UnreadableMission) -> Document:
    """Return what a flight takes, leaves and needs to get home, as the keys of the contract."""
    flown = result if isinstance(result, CheckResult) else None
    way = None if flown is None else flown.way_home
    return {
        "totals": values(value(flown, "totals"), _TOTALS_KEYS),
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
    conditions = value(flown, "conditions")
    wind = value(conditions, "wind")
    return {
        "file": value(result, "file"),
        "verdict": result.verdict,
        "vehicle": {
            "name": value(flown, "vehicle_name"),
            "source": value(flown, "vehicle_source"),
        },
        "conditions": {
            "wind_m_s": value(wind, "speed_m_s"),
            "wind_from_deg": value(wind, "from_deg"),
            "wind_reference_height_m": value(wind, "reference_height_m"),
            "wind_shear_exponent": value(wind, "shear_exponent"),
            "wind_roughness_length_m": value(wind, "roughness_length_m"),
            "wind_sd_m_s": value(wind, "speed_sd_m_s"),
            "wind_from_sd_deg": value(wind, "from_sd_deg"),
            **values(conditions, _CONDITION_KEYS),
        },
        "parameters": _parameters(flown),
        **figures(result),
        "segments": [values(one, SEGMENT_KEYS) for one in (flown.segments if flown else ())],
        "items": [values(one, ITEM_KEYS) for one in (flown.items if flown else ())],
        "findings": [finding_document(finding) for finding in result.findings],
        "suppressed": [
            finding_document(finding) | {"suppression": value(finding, "suppression")}
            for finding in result.suppressed
        ],
    }


def _parameters(result: CheckResult | None) -> Document:
    """Return what the autopilot was taken to fly with, each value with where it comes from."""
    flown_with = None if result is None else result.parameters
    if flown_with is None:
        return {}
    return {
        quantity: {"value": value(flown_with, quantity), "origin": str(origin)}
        for quantity, origin in flown_with.origins.items()
    }


def finding_document(finding: Finding) -> Document:
    """Return a finding under the keys of the contract; a stretch only where one is meant."""
    document: Document = {
        "code": finding.code,
        "name": finding.name,
        "severity": finding.severity.label,
        "item": finding.item,
        "line": value(finding.place, "line"),
        "column": value(finding.place, "column"),
        "message": value(finding, "message"),
        "fix": value(finding, "fix"),
    }
    return document | stretch_document(finding)


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
