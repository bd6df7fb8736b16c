"""The JSON contract: keys and types other programs rely on."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest
from made_missions import jump, mission, rtl, takeoff, waypoint

from planner.report.json import check_json, check_json_lines, segments_json
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission

# The schema as the interface promises it: every key, and the JSON types it may have.
NUMBER, TEXT, NOTHING = (int, float), str, type(None)
SCHEMA: dict[str, object] = {
    "file": TEXT,
    "verdict": TEXT,
    "vehicle": {"name": TEXT, "source": TEXT},
    "conditions": {
        "wind_m_s": NUMBER,
        "wind_from_deg": NUMBER,
        "home_amsl_m": NUMBER,
        "temperature_c": NUMBER,
        "payload_kg": NUMBER,
        "wind_reference_height_m": (*NUMBER, NOTHING),
        "wind_shear_exponent": (*NUMBER, NOTHING),
        "wind_roughness_length_m": (*NUMBER, NOTHING),
        "battery_health": (*NUMBER, NOTHING),
        "battery_resistance_factor": (*NUMBER, NOTHING),
        "battery_temperature_c": (*NUMBER, NOTHING),
    },
    "totals": {
        "time_s": NUMBER,
        "distance_m": NUMBER,
        "climb_m": NUMBER,
        "descent_m": NUMBER,
        "energy_wh": NUMBER,
        "charge_mah": NUMBER,
        "mean_power_w": NUMBER,
        "peak_power_w": NUMBER,
        "energy_wh_p10": (*NUMBER, NOTHING),
        "energy_wh_p90": (*NUMBER, NOTHING),
    },
    "battery": {
        "capacity_wh": NUMBER,
        "usable_wh": NUMBER,
        "used_fraction": NUMBER,
        "reserve_fraction": NUMBER,
        "margin_wh": NUMBER,
    },
    "return": {"tightest_item": int, "energy_home_wh": NUMBER, "margin_wh": NUMBER},
    "segments": [
        {
            "index": int,
            "item": int,
            "state": TEXT,
            "start_s": NUMBER,
            "duration_s": NUMBER,
            "distance_m": NUMBER,
            "climb_m": NUMBER,
            "speed_m_s": NUMBER,
            "energy_wh": NUMBER,
            "stopping_distance_m": (*NUMBER, NOTHING),
        }
    ],
    "items": [
        {
            "item": int,
            "command": TEXT,
            "arrival_s": (*NUMBER, NOTHING),
            "energy_used_wh": (*NUMBER, NOTHING),
            "pass": int,
        }
    ],
    "findings": [
        {
            "code": TEXT,
            "name": TEXT,
            "severity": TEXT,
            "item": (int, NOTHING),
            "line": (int, NOTHING),
            "column": (int, NOTHING),
            "message": TEXT,
            "fix": TEXT,
        }
    ],
}


def _missing(document: object, schema: object, where: str = "") -> list[str]:
    """Return the places where a document is not of a schema; more keys are allowed."""
    if isinstance(schema, dict):
        assert isinstance(document, dict), where
        problems = [f"{where}.{key} is missing" for key in schema if key not in document]
        for key in schema.keys() & document.keys():
            problems += _missing(document[key], schema[key], f"{where}.{key}")
        return problems
    if isinstance(schema, list):
        assert isinstance(document, list), where
        return [
            problem
            for index, one in enumerate(document)
            for problem in _missing(one, schema[0], f"{where}[{index}]")
        ]
    assert isinstance(schema, type | tuple)
    return [] if isinstance(document, schema) else [f"{where} is {document!r}"]


def _keys(document: object) -> object:
    if isinstance(document, dict):
        return {key: _keys(value) for key, value in document.items()}
    return None


def test_every_promised_key_is_there_with_its_type(flown: CheckResult) -> None:
    document = json.loads(check_json([flown], version="1.2.3"))
    assert document["schema"] == 1
    assert document["tool"] == {"name": "mavjoule", "version": "1.2.3"}
    [mission] = document["missions"]
    assert _missing(mission, SCHEMA) == []
    assert len(mission["segments"]) == 3
    assert len(mission["items"]) == 3


def test_values_are_those_of_the_result_unrounded(flown: CheckResult) -> None:
    [mission] = json.loads(check_json([flown], version="1"))["missions"]
    assert mission["verdict"] == "go"
    assert mission["vehicle"] == {"name": "quad", "source": "models/quad.toml"}
    assert mission["conditions"]["wind_from_deg"] == 270.0
    assert mission["totals"]["energy_wh"] == 24.06
    assert mission["battery"]["margin_wh"] == 69.3 - 15.4 - 24.06
    known = {key: found for key, found in mission["return"].items() if found is not None}
    assert known == {
        "tightest_item": 2,
        "energy_home_wh": 10.25,
        "margin_wh": 31.2,
        "destination": 0,
    }
    assert [segment["state"] for segment in mission["segments"]] == ["takeoff", "cruise", "land"]
    assert mission["findings"][0] == {
        "code": "E105",
        "name": "model-outside-envelope",
        "severity": "warning",
        "item": 2,
        "line": 41,
        "column": 9,
        "message": "12.0 m/s is commanded, the model was identified up to 10.0 m/s",
        "fix": flown.findings[0].fix,
    }


def test_what_is_unknown_keeps_its_keys_and_is_null(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    without = replace(flown, battery=None, return_plan=None)
    whole, reduced, broken = json.loads(check_json([flown, without, unreadable], version="1"))[
        "missions"
    ]
    assert _keys(reduced) == _keys(broken) == _keys(whole)
    assert set(reduced["battery"].values()) == {None}
    assert set(reduced["return"].values()) == {None}
    assert set(broken["totals"].values()) == {None}
    assert broken["verdict"] is None
    assert (broken["segments"], broken["items"]) == ([], [])
    assert [finding["code"] for finding in broken["findings"]] == ["X901"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_number_that_json_does_not_know_is_written(flown: CheckResult, value: float) -> None:
    broken = replace(flown, totals=replace(flown.totals, peak_power_w=value))
    text = check_json([broken], version="1")
    assert json.loads(text)["missions"][0]["totals"]["peak_power_w"] is None
    assert "NaN" not in text
    assert "Infinity" not in text


def test_json_lines_hold_one_complete_document_per_mission(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    lines = check_json_lines([flown, unreadable], version="1.2.3").splitlines()
    documents = [json.loads(line) for line in lines]
    assert [document["file"] for document in documents] == ["site.plan", "broken.plan"]
    for document in documents:
        assert document["schema"] == 1
        assert document["tool"]["version"] == "1.2.3"
    assert _missing(documents[0], SCHEMA) == []


def test_segments_alone_are_those_of_the_whole_report(flown: CheckResult) -> None:
    alone = json.loads(segments_json(flown, version="1"))
    [mission] = json.loads(check_json([flown], version="1"))["missions"]
    assert alone["schema"] == 1
    assert alone["segments"] == mission["segments"]
    assert "findings" not in alone


def test_a_file_name_that_is_no_text_still_makes_valid_json(flown: CheckResult) -> None:
    text = check_json([replace(flown, file="caf\udce9.plan")], version="1")
    assert text.isascii()
    assert json.loads(text)["missions"][0]["file"] == "caf\N{REPLACEMENT CHARACTER}.plan"


def test_every_pass_of_a_loop_is_listed() -> None:
    looped = mission(takeoff(50), waypoint(100, 50), waypoint(200, 50), jump(2, 2.0), rtl())
    once = mission(takeoff(50), waypoint(100, 50), waypoint(200, 50), rtl())
    vehicle = load_vehicle("arducopter-sitl-quad")
    [document] = json.loads(check_json([check(looped, vehicle)], version="0"))["missions"]
    passes = [(row["pass"], row["arrival_s"]) for row in document["items"] if row["item"] == 2]
    assert [number for number, _ in passes] == [1, 2, 3]
    assert passes == sorted(passes, key=lambda row: row[1])
    [plain] = json.loads(check_json([check(once, vehicle)], version="0"))["missions"]
    firsts = {row["item"]: row["arrival_s"] for row in document["items"] if row["pass"] == 1}
    assert firsts[2] == next(row["arrival_s"] for row in plain["items"] if row["item"] == 2)
    # Energy only grows along the flight, over the passes of all items.
    flown = sorted(
        (row["arrival_s"], row["energy_used_wh"]) for row in document["items"] if row["arrival_s"]
    )
    assert [energy for _, energy in flown] == sorted(energy for _, energy in flown)
