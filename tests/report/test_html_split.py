"""The page of a split mission, in a browser: who flies what, with the numbers of the JSON."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
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

import planner
from planner.report.html.page import check_html
from planner.report.html.split import split_section
from planner.report.json import check_json
from planner.report.split import flights_text, split_json
from planner.service.split import Split, split_mission, write_split
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from pathlib import Path

    from selenium.webdriver import Chrome

pytestmark = NEEDS_BROWSER

ATTACK = "</script><script>document.title='taken'</script><x>\".plan"


@pytest.fixture(scope="module")
def split() -> Split:
    """Five lines with a camera on, in as many flights as it takes."""
    lines = [
        one
        for number in range(5)
        for metres in (100.0, 1300.0)[:: 1 if number % 2 else -1]
        for one in (
            item(16, north(metres), 50.0, longitude_deg=8.0 + 0.0004 * number),
            item(206, params=(20.0, 0.0, 1.0, 0.0), frame=2),
        )
    ]
    whole = mission(takeoff(40.0), waypoint(100.0, 50.0), *lines, rtl())
    made = split_mission(
        whole,
        planner.load_vehicle("arducopter-sitl-quad"),
        battery=Battery(capacity_wh=60.0),
        folder=ATTACK,
    )
    assert len(made.parts) > 2
    return made


@pytest.fixture(scope="module")
def address(split: Split, tmp_path_factory: pytest.TempPathFactory) -> str:
    path: Path = tmp_path_factory.mktemp("split") / "page.html"
    page = check_html(
        [part.result for part in split.parts],
        version="1",
        made_at=datetime(2026, 1, 2, tzinfo=UTC),
        sections=[split_section(split)],
        title=flights_text(split),
    )
    path.write_text(page, encoding="utf-8")
    return path.as_uri()


def test_every_number_of_the_page_is_that_of_the_json(
    browser: Chrome, split: Split, address: str
) -> None:
    document = json.loads(split_json(split, version="1"))
    checked = json.loads(check_json([part.result for part in split.parts], version="1"))
    opened(browser, address)
    told = set()
    for path, value, _ in shown(browser):
        source = checked if path.startswith("missions.") else document
        assert float(value) == at(source, path), path
        told.add(path)
    for number in range(len(split.parts)):
        for key in ("totals.time_s", "totals.energy_wh", "battery.margin_wh", "return.margin_wh"):
            assert f"parts.{number}.{key}" in told
    assert {"together.time_s", "together.energy_wh"} <= told
    energies = [part["totals"]["energy_wh"] for part in document["parts"]]
    assert document["together"]["energy_wh"] == pytest.approx(sum(energies), rel=1e-12)


def test_each_part_has_a_row_a_number_on_the_map_and_a_bar(
    browser: Chrome, split: Split, address: str
) -> None:
    opened(browser, address)
    assert browser.find_element("css selector", "h1").text == flights_text(split)
    texts = (
        "return [...document.querySelectorAll('.split .chart.{} text')].map(one => one.textContent)"
    )
    numbers = {str(number) for number in range(1, len(split.parts) + 1)}
    rows = browser.find_elements("css selector", ".parts tbody th a")
    assert [row.text for row in rows] == sorted(numbers)
    assert numbers <= set(browser.execute_script(texts.format("map")))
    assert numbers <= set(browser.execute_script(texts.format("energy")))
    rows[1].click()
    until(browser, "return document.querySelector('#mission-1').open")
    until(browser, "return document.querySelector('#mission-1').dataset.drawn")


def test_the_page_says_nothing_asks_nobody_and_runs_nothing_of_a_name(
    browser: Chrome, split: Split, address: str
) -> None:
    messages(browser)
    assert asked_for(browser, address) <= {address, "about:blank"}
    assert browser.title == f"{flights_text(split)} · mavjoule"
    assert browser.execute_script("return document.querySelectorAll('x').length") == 0
    files = browser.find_elements("css selector", "details.mission .file")
    assert [one.text for one in files] == [part.file for part in split.parts]
    assert messages(browser) == []


@pytest.mark.parametrize(("scheme", "width"), [("light", PHONE_PX)])
def test_axe_finds_nothing_serious(browser: Chrome, address: str, scheme: str, width: int) -> None:
    opened(browser, address, scheme=scheme, width=width)
    assert grave_violations(browser, is_unfolded=False) == []  # the parts are as any check's


def test_it_prints_to_two_sheets_and_does_not_scroll_sideways_on_a_phone(
    browser: Chrome, address: str
) -> None:
    opened(browser, address, width=PHONE_PX)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= PHONE_PX
    opened(browser, address)
    assert sheets(browser) <= 2


def test_a_mission_that_fits_is_one_part(browser: Chrome, tmp_path: Path) -> None:
    whole = mission(takeoff(40.0), waypoint(100.0, 50.0), waypoint(200.0, 50.0), rtl())
    made = split_mission(
        whole,
        planner.load_vehicle("arducopter-sitl-quad"),
        battery=Battery(capacity_wh=60.0),
        folder=tmp_path,
    )
    write_split(made, tmp_path)
    page = check_html(
        [part.result for part in made.parts],
        version="1",
        made_at=datetime(2026, 1, 2, tzinfo=UTC),
        sections=[split_section(made)],
        title=flights_text(made),
    )
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    opened(browser, (tmp_path / "page.html").as_uri())
    heads = browser.find_elements("css selector", "h1")
    assert [one.text for one in heads] == ["made.plan: one flight is enough"]
