"""The page of a fleet, in a browser: the numbers of the JSON, everything over time, and a plan's numbers."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from made_fleet import PACK, SWAP, checked, pad, sortie, vehicles
from page_browser import (
    NEEDS_BROWSER,
    PHONE_PX,
    asked_for,
    at,
    grave_violations,
    messages,
    opened,
    sheets,
    shown,
    until,
)

from planner.cli.main import main
from planner.errors import ExitCode
from planner.fleet.schedule import Objective, Schedule
from planner.report.fleet import fleet_document, flown_with_texts, plan_json
from planner.report.html.fleet import fleet_html, packed_tables
from planner.service.fleet_plan import FleetPlan, PlanRow
from planner.service.fleet_timeline import fleet_timeline

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

    from planner.service.fleet import FleetResult

FLEETS = Path(__file__).parents[2] / "missions" / "fleets"
RIGHT = "\ue014"
"""A key, as WebDriver names it."""
NOW = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)


@pytest.fixture(scope="module")
def result() -> FleetResult:
    """Two vehicles that meet, and a third sortie of the first on the pack of the second."""
    return checked(
        "[operation]\nstart = 2026-05-12T23:59:00+02:00\n",
        pad("one", 0, 0),
        pad("two", 0, 40),
        vehicles("one", "two"),
        "[separation]\nhorizontal_m = 30\n",
        SWAP,
        PACK,
        sortie("first", "one", 0.0),
        sortie("second", "two", 5.0, more='pack = "P"'),
        sortie("third", "one", 600.0, more='pack = "P"'),
    )


@pytest.fixture(scope="module")
def plan(result: FleetResult) -> FleetPlan:
    """A plan of this check, as one would look."""
    rows = [
        PlanRow(
            vehicles=count,
            sorties=count,
            energy_wh=60.0 + 2.0 * count,
            makespan_s=1600.0 / count,
            packs=count,
            largest_sortie_wh=60.0 / count,
            is_in_time=count > 1,
            is_clear=True,
            gap=0.0,
            least_energy_wh=62.5 if count > 1 else None,
        )
        for count in (1, 2, 3)
    ]
    schedule = Schedule(
        departures=(),
        energy_wh=64.0,
        makespan_s=800.0,
        vehicles=2,
        packs=2,
        bound=64.0,
        is_best=True,
    )
    return FleetPlan(
        fleet=result.fleet,
        result=result,
        missions={},
        minimize=Objective.ENERGY,
        schedule=schedule,
        rows=tuple(rows),
    )


@pytest.fixture(scope="module")
def address(result: FleetResult, plan: FleetPlan, tmp_path_factory: pytest.TempPathFactory) -> str:
    path: Path = tmp_path_factory.mktemp("fleet") / "page.html"
    path.write_text(fleet_html(result, version="1", made_at=NOW, plan=plan), encoding="utf-8")
    return path.as_uri()


@NEEDS_BROWSER
def test_the_page_has_the_numbers_of_the_json_and_moves_every_vehicle_in_time(
    browser: Chrome, result: FleetResult, plan: FleetPlan, address: str
) -> None:
    messages(browser)
    assert asked_for(browser, address) <= {address, "about:blank"}
    document = json.loads(plan_json(plan, version="1"))
    told = set()
    for path, value, _ in shown(browser):
        assert float(value) == at(document, path), path
        told.add(path)
    assert {
        "totals.energy_wh",
        "rows.2.makespan_s",
        "rows.2.least_energy_wh",
        "sorties.1.mission.totals.time_s",
    } <= told

    def text(selector: str) -> str:
        return browser.find_element("css selector", selector).text

    assert text("h1").split() == ["✗", "NO-GO", result.file]
    timeline = fleet_timeline(result)
    browser.find_element("css selector", "[data-mark='1']").click()
    first = timeline.marks[0]
    assert first.finding.code in text("output")
    browser.execute_script(
        "const s = document.querySelector('#fleet-time');"
        "s.value = 640; s.dispatchEvent(new Event('input'));"
    )
    there = timeline.tracks[2].place_at(640.0)
    words = text(".now tbody tr")
    assert words.startswith("one third item")
    height_m = float(words.split()[4])
    assert height_m == pytest.approx(there[2], abs=0.6)  # shown in whole metres
    assert "10:40 · time of day 00:09:40 · 1 in the air" in text("output")
    slider = browser.find_element("css selector", "#fleet-time")
    slider.send_keys(RIGHT)
    assert text("output").startswith("10:41 ·")
    slider.send_keys(" ")
    play = browser.find_element("css selector", "[data-play]")
    assert (play.text, play.get_attribute("aria-pressed")) == ("Pause", "true")
    until(browser, "return document.querySelector('#fleet-time').value > 645")
    play.click()
    assert play.text == "Play"
    browser.find_element("css selector", ".sortie-table tbody a").click()
    until(browser, "return document.querySelector('#sortie-0').open")
    assert messages(browser) == []
    assert sheets(browser) <= 4


@NEEDS_BROWSER
def test_axe_finds_nothing_serious_and_a_phone_does_not_scroll_sideways(
    browser: Chrome, address: str
) -> None:
    opened(browser, address, scheme="dark", width=PHONE_PX)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= PHONE_PX
    assert grave_violations(browser) == []


@NEEDS_BROWSER
def test_no_table_is_wider_than_its_box_and_what_flies_is_beside_the_verdict(
    browser: Chrome, result: FleetResult, address: str
) -> None:
    opened(browser, address, width=1280)
    wider = "e => e.scrollWidth > e.clientWidth"
    assert not browser.execute_script(
        f"return [...document.querySelectorAll('.wide')].some({wider})"
    )
    given = [one.text for one in browser.find_elements("css selector", "h1 ~ .given")]
    assert given == [*flown_with_texts(result)] != []


def test_packed_columns_hold_what_they_were_made_of() -> None:
    rows = [
        {"name": "a", "x": 1.25, "y": -3.0, "z": None},
        {"name": "a", "x": 0.5, "y": 4.0, "z": 1.0},
        {"name": "b", "x": 0.5, "y": 4.0, "z": 1.0},
    ]
    assert packed_tables({"t": rows, "empty": []}) == {
        "t": {
            "name": [["a", 2], ["b", 1]],
            "x": [2, 125, -75, 0],
            "y": [0, -3, 7, 0],
            "z": [[None, 1], [1.0, 2]],
        }
    }


def test_a_fleet_that_flies_nothing_has_a_page_without_pictures() -> None:
    empty = checked(pad("one", 0, 0), vehicles("one"))
    page = fleet_html(empty, version="1", made_at=NOW)
    assert "vegaEmbed = " not in page
    assert "S112" in page
    assert fleet_document(empty, version="1")["verdict"] == "no-go"


def test_the_page_is_written_beside_the_report_and_over_no_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fleet = str(FLEETS / "delivery-two-pads.toml")
    page = tmp_path / "page.html"
    assert main(["fleet", "check", fleet, "--report", str(page)]) == ExitCode.NO_GO
    assert "S101" in page.read_text(encoding="utf-8")
    told = capsys.readouterr()
    assert told.out.startswith("NO-GO")
    assert f"the page is in {page}" in told.err
    for refused in ([fleet], [str(page), "--output", str(page)]):
        assert main(["fleet", "check", fleet, "--report", *refused]) == ExitCode.UNUSABLE


def test_the_page_counts_what_is_suppressed_beside_the_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fleet = str(FLEETS / "delivery-two-pads.toml")
    page = tmp_path / "page.html"
    assert main(["fleet", "check", fleet, "--report", str(page)]) == ExitCode.NO_GO
    assert capsys.readouterr().out.splitlines()[0] == f"NO-GO  {fleet}"
    assert "suppressed)" not in page.read_text(encoding="utf-8")
    main(["fleet", "check", fleet, "--report", str(page), "--ignore", "S115,E105"])
    remark = "(2 errors, 1 warning suppressed)"
    assert capsys.readouterr().out.splitlines()[0] == f"NO-GO  {fleet} {remark}"
    assert f"<strong>{remark}</strong>" in page.read_text(encoding="utf-8")
