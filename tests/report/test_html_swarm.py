"""The page of a simulated swarm, in a browser: the numbers of the JSON, and every agent over time."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_swarm import fleet_of, formation, search, simulated
from page_browser import NEEDS_BROWSER, PHONE_PX, asked_for, at, messages, opened, sheets, shown

from planner.cli.main import main
from planner.report.html.swarm import numbers_html, swarm_html
from planner.report.plots.swarm import make_swarm_tables, thinned_timeline
from planner.report.swarm import numbers_json, swarm_json
from planner.service.swarm_agents import NumbersLimits, simulate_numbers
from planner.service.swarm_timeline import swarm_timeline
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

    from selenium.webdriver import Chrome

NOW = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("swarm")


@NEEDS_BROWSER
def test_the_page_has_the_numbers_of_the_json_and_moves_every_agent(
    browser: Chrome, folder: Path
) -> None:
    result = simulated(search(agents=2), policy="none")
    page = folder / "page.html"
    page.write_text(swarm_html(result, version="1", made_at=NOW), encoding="utf-8")
    address = page.as_uri()
    messages(browser)
    assert asked_for(browser, address) <= {address, "about:blank"}
    document = json.loads(swarm_json(result, version="1"))
    told = {path for path, _, _ in shown(browser)}
    for path, value, _ in shown(browser):
        assert float(value) == at(document, path), path
    assert {"totals.energy_wh", "goal.fraction", "agents.1.closest.distance_m"} <= told
    assert "totals.energy_by_state_wh.brake" in told

    def text(selector: str) -> str:
        return browser.find_element("css selector", selector).text

    half_s = result.goal.time_to_s(0.5)
    assert half_s is not None
    browser.execute_script(
        "const s = document.querySelector('#fleet-time');"
        f"s.value = {round(half_s)}; s.dispatchEvent(new Event('input'));"
    )
    # a second, and a span of the power, of a flight of two minutes
    [part] = [one for one in text("output").split(" · ") if "of the area seen" in one]
    assert float(part.split()[0]) == pytest.approx(50.0, abs=2.0)
    assert text(".now tbody tr").startswith("v0 flies 20 m")
    seen = browser.execute_script(
        "return document.querySelectorAll('[data-chart=map] .mark-rect path').length"
    )
    assert 0 < seen < len(make_swarm_tables(result, swarm_timeline(result)).tables["seen"])
    assert messages(browser) == []
    assert sheets(browser) <= 3
    opened(browser, address, scheme="dark", width=PHONE_PX)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= PHONE_PX
    # at the start agents stand on pads of their names, 30 m apart
    boxes = browser.execute_script(
        "return [...document.querySelectorAll('[data-chart=map] svg text')]"
        ".filter((one) => /^v\\d$/.test(one.textContent)).map((one) => one.getBoundingClientRect())"
    )
    assert len(boxes) >= 4  # of them two in the legend
    for one, other in combinations(boxes, 2):
        beside = one["right"] <= other["left"] + 1 or other["right"] <= one["left"] + 1
        above = one["bottom"] <= other["top"] + 6 or other["bottom"] <= one["top"] + 6
        assert beside or above


@NEEDS_BROWSER
def test_the_page_of_numbers_has_those_of_its_json(browser: Chrome, folder: Path) -> None:
    numbers = simulate_numbers(
        fleet_of(formation(20.0)), (1, 2), policy="none", limits=NumbersLimits(deadline_s=100.0)
    )
    page = folder / "numbers.html"
    page.write_text(numbers_html(numbers, version="1", made_at=NOW), encoding="utf-8")
    opened(browser, page.as_uri(), width=PHONE_PX)
    document = json.loads(numbers_json(numbers, version="1"))
    for path, value, _ in shown(browser):
        assert float(value) == at(document, path), path
    never = replace(numbers.runs[0], seed=1, time_to_90_s=math.inf)  # its number has no mean
    page.write_text(
        numbers_html(replace(numbers, runs=(*numbers.runs, never)), version="1", made_at=NOW),
        encoding="utf-8",
    )
    opened(browser, page.as_uri())
    assert "NaN" not in browser.find_element("css selector", "body").text
    opened(browser, page.as_uri(), width=PHONE_PX)
    assert "fewest in time, least energy" in browser.find_element("css selector", ".numbers").text
    assert browser.execute_script("return document.documentElement.scrollWidth") <= PHONE_PX
    assert messages(browser) == []


def test_a_swarm_that_meets_shows_where_and_is_not_clear() -> None:
    page = swarm_html(simulated(formation(12.0), policy="none"), version="1", made_at=NOW)
    assert "✗ NOT CLEAR" in page
    assert "Show S128 at" in page
    assert "What was not looked at" in page


def test_tracks_of_many_points_are_thinned_to_what_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = swarm_timeline(simulated(search(agents=2)))
    assert thinned_timeline(whole)[1] == 1.0
    monkeypatch.setattr("planner.report.plots.swarm._MOST_POINTS", 60)
    few, error_m = thinned_timeline(whole)
    assert sum(len(one.time_s) for one in few.tracks) <= 60
    assert error_m > 1.0
    for one, other in zip(whole.tracks, few.tracks, strict=True):
        there = np.array([other.place_at(time_s) for time_s in one.time_s.tolist()])
        # the thinned track of the whole is itself within 1 m of the flight
        assert np.linalg.norm(there - one.place_m, axis=1).max() <= error_m - 1.0 + 1e-9


def test_the_page_is_written_beside_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fleet, page = tmp_path / "fleet.toml", tmp_path / "page.html"
    fleet.write_text("schema = 1\n" + formation(20.0), encoding="utf-8")
    call = ["fleet", "simulate", str(fleet), "--policy", "none", "--report", str(page)]
    assert main(call) == 0
    assert f"the page is in {page}" in capsys.readouterr().err
    assert "CLEAR" in page.read_text(encoding="utf-8")
    assert main([*call[:-1], str(fleet)]) == 2
    assert main([*call, "--agents", "1", "--trace", str(tmp_path / "t.csv")]) == 2
