"""The simulation of a swarm in text, JSON and trace: the same figures, group and agents."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_swarm import formation, search, simulated

from planner.report.swarm import swarm_json, swarm_text, swarm_trace
from planner.report.text import Medium
from planner.service.fleet_timeline import TRACK_ERROR_M
from planner.service.swarm_timeline import HELD, swarm_timeline

if TYPE_CHECKING:
    from collections.abc import Iterator

SEARCH = search(agents=2)


def test_the_group_is_the_sum_of_its_agents() -> None:
    document = json.loads(swarm_json(simulated(SEARCH), version="1"))
    totals, agents = document["totals"], document["agents"]
    for key in ("energy_wh", "distance_m", "stops", "waited_s"):
        assert totals[key] == pytest.approx(sum(one[key] for one in agents), rel=1e-12), key
    assert totals["stops"] > 0
    states = totals["energy_by_state_wh"]
    assert sum(states.values()) == pytest.approx(totals["energy_wh"], rel=1e-9)
    assert set(states) >= {"takeoff", "accelerate", "brake", "land"}
    for one in agents:
        assert one["closest"]["distance_m"] == document["approaches"][0]["distance_m"]
        used = one["battery"]["used_fraction"] * one["battery"]["capacity_wh"]
        assert used == pytest.approx(one["energy_wh"], rel=1e-9)


def test_what_is_over_time_ends_in_the_totals() -> None:
    document = json.loads(swarm_json(simulated(SEARCH), version="1"))
    over, goal = document["over_time"], document["goal"]
    assert {len(column) for column in over.values()} == {361}
    assert over["energy_wh"][-1] == pytest.approx(document["totals"]["energy_wh"], rel=1e-9)
    assert over["goal_fraction"][-1] == goal["fraction"]
    step_s = over["time_s"][1]
    joules = sum(one * step_s for one in over["power_w"])
    assert joules / 3600.0 == pytest.approx(document["totals"]["energy_wh"], rel=1e-9)
    first = next(
        at for at, part in zip(over["time_s"], over["goal_fraction"], strict=True) if part >= 0.5
    )
    assert first - step_s < goal["time_to_50_s"] <= first
    [pair] = document["pairs"]
    nearest = document["approaches"][0]
    assert (pair["least_m"], pair["least_s"]) == (nearest["distance_m"], nearest["time_s"])
    assert min(pair["distance_m"]) == pytest.approx(pair["least_m"], abs=0.5)


def test_the_text_says_what_the_json_says() -> None:
    text = swarm_text(simulated(search(agents=1)), medium=Medium())
    assert "Goal        100 % of the area seen; 50 % after" in text
    assert "0 stops for others" in text
    # nobody to be closest to
    assert next(line for line in text.splitlines() if line.startswith("v0")).strip().endswith("—")


def test_a_swarm_without_an_area_reaches_its_goal_at_home() -> None:
    result = simulated(formation(20.0))
    assert result.coverage is None
    assert result.goal.what == "agents home"
    assert result.goal.time_to_s(1.0) == pytest.approx(result.makespan_s, abs=1e-9)


def test_the_trace_adds_up_to_the_energy_of_each() -> None:
    result = simulated(SEARCH)
    trace = swarm_trace(result)
    assert len({len(column) for column in trace.values()}) == 1
    for row, one in enumerate(result.agents):
        used = np.array(trace["energy_wh"][row :: len(result.agents)])
        assert (np.diff(used) >= 0.0).all()
        assert used[-1] == pytest.approx(one.energy_wh, abs=5e-5)  # four digits
        assert trace["phase"][row :: len(result.agents)][-1] == "landed"
    assert trace["goal_fraction"][-1] == pytest.approx(result.goal.fraction, abs=1e-5)


def test_the_timeline_says_who_gives_way_and_where_agents_are() -> None:
    result = simulated(SEARCH)
    timeline = swarm_timeline(result)
    assert {span.use for row in timeline.rows for span in row.spans} == {"flight", "yield"}
    for row, (track, one) in enumerate(zip(timeline.tracks, result.agents, strict=True)):
        assert track.used_wh[-1] == pytest.approx(one.energy_wh, rel=1e-9)
        flown = result.record.begin_s < track.end_s
        there = [track.place_at(time_s)[:2] for time_s in result.record.begin_s[flown].tolist()]
        away_m = np.hypot(*(np.array(there) - result.record.place_m[flown, row]).T)
        assert away_m.max() < TRACK_ERROR_M
        assert track.place_at(60.0)[2] == pytest.approx(20.0, abs=1e-6)
        assert HELD in track.item
    assert timeline.marks == ()
    [mark] = swarm_timeline(simulated(formation(12.0), policy="none")).marks
    assert mark.sorties == ("a", "b")
    assert mark.rows == (0, 1)


def test_the_json_has_the_keys_that_the_topic_lists() -> None:
    planner = Path(__file__).parents[2] / "planner"
    topic = (planner / "report" / "topics" / "swarm.md").read_text(encoding="utf-8")
    [listed] = [
        json.loads(one)
        for one in re.findall(r"```json\n(.*?)```", topic, re.DOTALL)
        if '"is_clear"' in one
    ]
    document = json.loads(swarm_json(simulated(SEARCH), version="1"))
    assert [*_other_keys(document, listed)] == []


def _other_keys(found: Any, listed: Any, where: str = "") -> Iterator[str]:  # noqa: ANN401 - JSON
    """Yield where the keys of a document are not those listed; a list is as its first."""
    if isinstance(listed, dict) and "takeoff" in listed:
        return  # the states there are
    if isinstance(listed, dict) and "code" in listed:
        assert listed.keys() <= found.keys(), where
    elif isinstance(listed, dict):
        for key in listed.keys() ^ found.keys():
            yield f"{where}.{key}"
        for key in listed.keys() & found.keys():
            yield from _other_keys(found[key], listed[key], f"{where}.{key}")
    elif isinstance(listed, list) and listed:  # nothing is listed of an empty one
        yield from _other_keys(found[0], listed[0], where)


def test_what_faults_led_to_is_in_text_and_json() -> None:
    fault = (
        '[fault.gps]\nkind = "loses-position"\nvehicle = "b"\ndrift_m_s = 0.2\ntoward_deg = 270\n'
    )
    result = simulated(formation(20.0), fault, policy="none")
    text = swarm_text(result, medium=Medium())
    assert "gps  b errs about its position by 0.2 m/s from 0:00 on" in text
    assert "Everyone else: 1 agent, NOT SAFE" in text
    faults = json.loads(swarm_json(result, version="1"))["faults"]
    [outcome] = faults["outcomes"]
    assert (outcome["name"], outcome["kind"], outcome["agents"]) == ("gps", "loses-position", ["b"])
    assert faults["others"] == ["a"]
    assert faults["are_others_safe"] is False
    [hit] = outcome["hits"]
    assert hit["distance_m"] == pytest.approx(
        20.0 - 0.2 * hit["time_s"], abs=0.05
    )  # pads by degrees
    [lost] = outcome["lost"]
    assert lost["agent"] == "b"
    displaced = swarm_trace(result)["displaced_m"]
    assert np.array(displaced, np.float64).max() == pytest.approx(
        0.2 * result.record.begin_s[-1], abs=1e-3
    )
