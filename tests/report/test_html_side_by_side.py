"""The page of two checks side by side, in a browser."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest
from made_missions import mission, rtl, takeoff, waypoint
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
from planner.physics.wind import Wind
from planner.report.comparison import comparison_json
from planner.report.html.comparison import comparison_section
from planner.report.html.page import check_html
from planner.report.json import check_json
from planner.service.comparison import Comparison, compare_results
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

pytestmark = NEEDS_BROWSER


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    """One mission in calm air and in a wind."""
    made = mission(takeoff(40.0), waypoint(900.0, 40.0), waypoint(100.0, 40.0), rtl())
    vehicle = planner.load_vehicle("arducopter-sitl-quad")
    calm, windy = (
        planner.check(made, vehicle, wind=Wind(speed_m_s=wind, from_deg=0.0), battery=battery)
        for wind, battery in ((0.0, Battery(capacity_wh=60.0)), (4.0, Battery(capacity_wh=50.0)))
    )
    return compare_results(calm, windy)


@pytest.fixture(scope="module")
def address(comparison: Comparison, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("two") / "page.html"
    page = check_html(
        [comparison.a, comparison.b],
        version="1",
        made_at=datetime(2026, 1, 2, tzinfo=UTC),
        sections=[comparison_section(comparison.a, comparison.b)],
        title="Two checks side by side",
        names=("A", "B"),
    )
    path.write_text(page, encoding="utf-8")
    return path.as_uri()


def test_every_number_of_the_page_is_that_of_the_json(
    browser: Chrome, comparison: Comparison, address: str
) -> None:
    document = json.loads(comparison_json(comparison, version="1"))
    for row in document["states"]:
        for side in "ab":
            document[side].setdefault("states", {})[row["state"]] = row[side]
    for side in "ab":
        document[side]["states"]["total"] = document[side]["totals"]
    checked = json.loads(check_json([comparison.a, comparison.b], version="1"))
    opened(browser, address)
    numbers = {path: float(value) for path, value, _ in shown(browser)}
    for path, value in numbers.items():
        side, _, rest = path.partition(".")
        if side == "missions":
            assert value == at(checked, path), path
            continue
        told = at(document["b"], rest) if side == "difference" else at(document[side], rest)
        if side == "difference":
            told -= at(document["a"], rest)
        # the energy of a state is a sum, which adds up in another order to another last digit
        assert value == pytest.approx(told, rel=1e-12, abs=1e-12 if "states" in path else 0.0), path
    assert len([path for path in numbers if path.startswith("difference.")]) > 15
    differences = document["difference"]
    assert numbers["difference.totals.energy_wh"] == differences["energy_wh"]
    assert numbers["difference.battery.margin_wh"] == differences["margin_wh"]


def test_both_open_with_their_pictures_in_the_order_given(
    browser: Chrome, comparison: Comparison, address: str
) -> None:
    messages(browser)
    assert asked_for(browser, address) <= {address, "about:blank"}
    heads = browser.find_elements("css selector", "details.mission h2")
    assert [head.text.partition(":")[0] for head in heads] == ["A", "B"]
    for number, head in enumerate(heads):
        head.click()
        until(browser, f"return document.querySelector('#mission-{number}').dataset.drawn")
    assert len(browser.find_elements("css selector", ".chart svg")) == 10
    assert comparison.a.file == comparison.b.file
    assert messages(browser) == []


@pytest.mark.parametrize(("scheme", "width"), [("dark", 0), ("light", PHONE_PX)])
def test_axe_finds_nothing_serious(browser: Chrome, address: str, scheme: str, width: int) -> None:
    opened(browser, address, scheme=scheme, width=width)
    if width:
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    assert grave_violations(browser, is_unfolded=False) == []  # each is as any check's


def test_it_prints_to_two_sheets(browser: Chrome, address: str) -> None:
    opened(browser, address)
    assert sheets(browser) <= 2
