"""Pages of hostile files, in a browser: whatever they hold is text; and readers without scripts."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, rtl, takeoff, waypoint
from page_browser import NEEDS_BROWSER, asked_for, messages, opened, sheets

import planner
from planner.report.html.comparison import comparison_section
from planner.report.html.page import check_html
from planner.service.preflight import UnreadableMission, check_file
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import ParameterSet, ParameterValue

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

    from planner.service.preflight import CheckResult

    Result = CheckResult | UnreadableMission

pytestmark = NEEDS_BROWSER

EVIL = (
    "</script><script>document.title='taken'</script>"
    "\"'><img src=x onerror=\"document.title='taken'\"><x-evil onclick='1'>"
    "</style></title></noscript></textarea><!-- {{ 7 * 7 }} ${1} \\u003cscript>"
)
"""Ends every kind of element and attribute a text of the page stands in."""
MADE_AT = datetime(2026, 1, 2, tzinfo=UTC)


@pytest.fixture(scope="module")
def hostile() -> CheckResult:
    """A flight of which every name that a file gives is hostile."""
    ours = planner.load_vehicle("arducopter-sitl-quad")
    logs = (EVIL,) * len(ours.provenance.logs)
    origin = replace(ours.provenance, source=EVIL, method=EVIL, logs=logs, readings=(EVIL,))
    vehicle = replace(ours, name=EVIL, source=EVIL, description=EVIL, provenance=origin)
    made = mission(takeoff(40.0), waypoint(300.0, 40.0), waypoint(0.0, 40.0), rtl())
    values = {"WPNAV_SPEED": ParameterValue(800.0), "WPNAV_SPEEED": ParameterValue(900.0)}
    return planner.check(
        replace(made, source=EVIL),
        vehicle,
        battery=Battery(capacity_wh=60.0),
        parameters=ParameterSet(source=EVIL, values=values, stack=planner.Autopilot.ARDUPILOT),
    )


@pytest.fixture(scope="module")
def unreadable(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A plan that holds hostile text wherever a plan holds text, and cannot be read for it."""
    path = tmp_path_factory.mktemp("hostile") / "hostile.plan"
    element = {"type": "ComplexItem", "complexItemType": EVIL, "version": 1, EVIL: EVIL}
    plan = {
        "fileType": "Plan",
        "groundStation": EVIL,
        "version": 1,
        EVIL: EVIL,
        "mission": {
            "items": [element],
            "plannedHomePosition": [47.0, 8.0, EVIL],
            "firmwareType": EVIL,
            "version": 2,
        },
        "geoFence": {"version": 2, "circles": [], "polygons": []},
        "rallyPoints": {"version": 2, "points": []},
    }
    path.write_text(json.dumps(plan), encoding="utf-8")
    result = check_file(path, Setup(load_vehicle()))
    assert isinstance(result, UnreadableMission)
    return result


@pytest.fixture(scope="module")
def complex_kind(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A plan whose complex item is of a hostile kind, which a finding names."""
    path = tmp_path_factory.mktemp("kind") / "kind.plan"
    folder = Path(__file__).resolve().parents[2] / "missions"
    plan = json.loads((folder / "survey-vineyard.plan").read_text(encoding="utf-8"))
    plan["mission"]["items"].insert(1, {"type": "ComplexItem", "complexItemType": EVIL})
    path.write_text(json.dumps(plan), encoding="utf-8")
    result = check_file(path, Setup(load_vehicle(), battery=Battery(capacity_wh=60.0)))
    assert any("</script>" in finding.message for finding in result.findings)
    return result


def address_of(folder: Path, page: str) -> str:
    path = folder / "page.html"
    path.write_text(page, encoding="utf-8")
    return path.as_uri()


@pytest.mark.parametrize("fixture", ["hostile", "unreadable", "complex_kind"])
def test_every_name_of_a_file_is_text_on_the_page(
    browser: Chrome, tmp_path: Path, request: pytest.FixtureRequest, fixture: str
) -> None:
    result = request.getfixturevalue(fixture)
    page = check_html([result], version=EVIL, made_at=MADE_AT, sha256={result.file: EVIL})
    messages(browser)
    address = address_of(tmp_path, page)
    assert asked_for(browser, address) <= {address, "about:blank"}
    assert browser.title == f"{result.file} · mavjoule"
    assert browser.execute_script("return document.querySelectorAll('x-evil, img').length") == 0
    for summary in browser.find_elements("css selector", "summary"):
        browser.execute_script("arguments[0].parentElement.open = true", summary)
    assert browser.title == f"{result.file} · mavjoule"
    assert messages(browser) == []


def test_the_names_are_told_as_they_are(
    browser: Chrome, tmp_path: Path, hostile: CheckResult
) -> None:
    opened(browser, address_of(tmp_path, check_html([hostile], version="1", made_at=MADE_AT)))
    texts = browser.execute_script(
        "return [...document.querySelectorAll('.origin dd')].map(one => one.textContent)"
    )
    assert texts.count(EVIL) >= 6  # mission, model, file, description, source, method
    assert browser.find_element("css selector", "h1 .file").get_attribute("textContent") == EVIL


def test_names_and_titles_of_sections_are_text(
    browser: Chrome, tmp_path: Path, hostile: CheckResult
) -> None:
    section = comparison_section(hostile, hostile)
    page = check_html(
        [hostile, hostile],
        version="1",
        made_at=MADE_AT,
        sections=[section],
        title=EVIL,
        names=(EVIL, EVIL),
    )
    messages(browser)
    opened(browser, address_of(tmp_path, page))
    assert browser.title == f"{EVIL} · mavjoule"
    assert browser.execute_script("return document.querySelectorAll('x-evil, img').length") == 0
    assert messages(browser) == []


def test_no_column_of_an_overview_is_cut_off_in_print(
    browser: Chrome, tmp_path: Path, hostile: CheckResult
) -> None:
    later = replace(hostile, file="a-long-name-of-a-mission-for-the-second-field.plan")
    page = check_html([later, later], version="1", made_at=MADE_AT)
    opened(browser, address_of(tmp_path, page))
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    a4_px = {"width": 690, "height": 1000, "deviceScaleFactor": 1, "mobile": False}  # 182 mm
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", a4_px)
    width = "return document.querySelector('#overview').scrollWidth"
    try:
        assert browser.execute_script(width) <= 690
        assert sheets(browser) == 1
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def test_without_scripts_the_pictures_stand_still(
    browser: Chrome, tmp_path: Path, hostile: CheckResult
) -> None:
    page = check_html([hostile], version="1", made_at=MADE_AT)
    opened(browser, address_of(tmp_path, page), scripts=False)
    try:
        stills = browser.find_elements("css selector", ".still > svg")
        assert [one.is_displayed() for one in stills] == [True] * 5
        assert not any(
            one.is_displayed()
            for one in browser.find_elements("css selector", ".cursor, .zoom, button.show")
        )
        words = browser.find_element("css selector", ".chart.energy .still").text
        assert "Energy [Wh]" in words
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


def test_a_page_of_many_says_where_pictures_are_without_scripts(hostile: CheckResult) -> None:
    page = check_html([hostile, hostile], version="1", made_at=MADE_AT)
    assert page.count("The pictures need JavaScript") == 2
    assert 'class="still"' not in page


def test_a_command_nobody_knows_is_a_number_on_the_page(browser: Chrome, tmp_path: Path) -> None:
    made = mission(takeoff(40.0), item(50_001, None), waypoint(300.0, 40.0), rtl())
    result = planner.check(made, planner.load_vehicle("arducopter-sitl-quad"))
    opened(browser, address_of(tmp_path, check_html([result], version="1", made_at=MADE_AT)))
    assert "50001" in browser.find_element("css selector", "body").text
