"""The page in a browser: its numbers are the JSON's, it fetches nothing, and everyone can use it."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

import pytest
from page_browser import (
    NEEDS_BROWSER,
    PHONE_PX,
    WAIT_S,
    asked_for,
    at,
    grave_violations,
    messages,
    opened,
    sheets,
    shown,
    until,
)

from planner import quantity
from planner.geo.tiles import read_tile_server
from planner.physics.wind import Wind
from planner.report.figures import FIGURES
from planner.report.html.page import check_html
from planner.report.json import check_json
from planner.report.plots.picture_files import GREEN
from planner.service.preflight import check_file
from planner.setup import Setup
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

    from planner.service.preflight import CheckResult, UnreadableMission

    Result = CheckResult | UnreadableMission

MISSIONS = Path(__file__).resolve().parents[2] / "missions"
END, ENTER = "\ue010", "\ue007"
"""Keys, as WebDriver names them."""
ATTACK = "<script>document.title='taken'<x>.plan"
"""What a file may be called where no slash is allowed."""

pytestmark = NEEDS_BROWSER


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey in a fence that its eastern turns cross, with a rally point, and a broken file."""
    folder = tmp_path_factory.mktemp("missions")
    plan = json.loads((MISSIONS / "survey-vineyard.plan").read_text(encoding="utf-8"))
    [polygon] = plan["geoFence"]["polygons"]
    east_deg = max(corner[1] for corner in polygon["polygon"])
    for corner in polygon["polygon"]:
        corner[1] -= 0.0016 if corner[1] == east_deg else 0.0
    home = plan["mission"]["plannedHomePosition"]
    plan["rallyPoints"]["points"].append([home[0] + 0.0005, home[1], 40.0])
    (folder / ATTACK).write_text(json.dumps(plan), encoding="utf-8")
    (folder / "broken.plan").write_text(
        "{'</script><script>document.title=1</script>': ", encoding="utf-8"
    )
    return folder


def checked(path: Path, *, battery: bool = True, wind_m_s: float = 4.0) -> Result:
    return check_file(
        path,
        Setup(
            load_vehicle(),
            battery=Battery(capacity_wh=77.0) if battery else None,
            wind=Wind(speed_m_s=wind_m_s, from_deg=200.0),
        ),
    )


@pytest.fixture(scope="module")
def survey(folder: Path) -> Result:
    return checked(folder / ATTACK)


def written(folder: Path, *results: Result) -> str:
    """Write the page of results, and return its address."""
    path = folder / f"page-{len(results)}-{abs(hash(results[0].file))}.html"
    made_at = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)
    path.write_text(check_html(results, version="1.2.3", made_at=made_at), encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def address(folder: Path, survey: Result) -> str:
    return written(folder, survey)


def test_every_number_of_the_page_is_that_of_the_json(
    browser: Chrome, survey: Result, address: str
) -> None:
    document = json.loads(check_json([survey], version="1.2.3"))
    opened(browser, address)
    basis = browser.find_element("css selector", ".basis").text
    assert all(told in basis for told in ("77.0 Wh", "wind 4.0 m/s from 200°", "falkowski"))
    texts = {one.path: one.text for _, members in FIGURES for one in members}
    found = shown(browser)
    for path, value, text in found:
        assert float(value) == at(document, path), path
        key = path.split(".", 2)[2]
        assert text == texts[key](float(value))
    told = {path for path, _, _ in found}
    for section in ("totals", "battery", "return", "conditions"):
        for key, value in document["missions"][0][section].items():
            if value is not None and not ("_sd_" in key and value == 0.0):
                assert f"missions.0.{section}.{key}" in told
    assert len(told) > 30


def test_states_add_up_to_the_segments_of_the_json(
    browser: Chrome, survey: Result, address: str
) -> None:
    segments = json.loads(check_json([survey], version="1"))["missions"][0]["segments"]
    opened(browser, address)
    rows = browser.execute_script(
        "return [...document.querySelectorAll('tr[data-phase]')].map(row => [row.dataset.phase,"
        "Object.fromEntries([...row.querySelectorAll('data')]"
        ".map(one => [one.dataset.column, [one.value, one.textContent]]))])"
    )
    assert {row[0] for row in rows} == {one["state"] for one in segments} | {"total"}
    for state, columns in rows:
        own = [one for one in segments if state in {one["state"], "total"}]
        assert int(columns["segments"][0]) == len(own)
        for column, key in (
            ("time_s", "duration_s"),
            ("distance_m", "distance_m"),
            ("energy_wh", "energy_wh"),
        ):
            value, text = columns[column]
            assert float(value) == pytest.approx(sum(one[key] for one in own), rel=1e-9)
            if column == "energy_wh":
                assert text == quantity.energy(float(value))


def test_long_tables_hold_every_row_of_the_json(
    browser: Chrome, survey: Result, address: str
) -> None:
    mission = json.loads(check_json([survey], version="1"))["missions"][0]
    opened(browser, address)
    for name in ("segments", "items"):
        assert opened_table(browser, name) == [
            [quantity.ABSENT if value is None else value for value in row.values()]
            for row in mission[name]
        ]


def opened_table(browser: Chrome, name: str) -> object:
    """Open a long table and return its rows."""
    from selenium.webdriver.support.wait import WebDriverWait

    details = browser.find_element("css selector", f"details[data-long={name}]")
    details.find_element("css selector", "summary").click()
    WebDriverWait(browser, WAIT_S).until(lambda _: details.get_attribute("data-filled") == "true")
    return browser.execute_script(
        "return [...arguments[0].querySelectorAll('tbody tr')].map(row => [...row.cells]"
        ".map(cell => cell.firstElementChild ? Number(cell.firstElementChild.value)"
        " : cell.textContent))",
        details,
    )


def test_the_page_says_nothing_to_the_console_and_asks_nobody(
    browser: Chrome, address: str
) -> None:
    messages(browser)
    asked = asked_for(browser, address)
    assert address in asked, "requests are seen"
    assert {url for url in asked if not url.startswith(("file:", "about:", "data:"))} == set()
    assert {url for url in asked if url.startswith("file:")} == {address}
    assert messages(browser) == []


def test_a_base_map_is_fetched_only_where_it_is_asked_for(
    browser: Chrome, folder: Path, survey: Result
) -> None:
    from selenium.webdriver.support.wait import WebDriverWait

    asked: list[str] = []

    class Tiles(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_response(200)
            self.send_header("Content-Type", "image/svg+xml")
            self.send_header("Access-Control-Allow-Origin", "*")  # as those of OpenStreetMap
            self.end_headers()
            square = '<rect width="256" height="256" fill="#9c9"/>'
            svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="256" height="256">{square}</svg>'
            self.wfile.write(svg.encode())

        def log_message(self, *_: object) -> None: ...

    with ThreadingHTTPServer(("127.0.0.1", 0), Tiles) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        host = f"http://127.0.0.1:{server.server_port}"
        path = folder / "tiles.html"
        page = check_html(
            [survey],
            version="1",
            made_at=datetime(2026, 1, 2, tzinfo=UTC),
            server=read_tile_server(f"{host}/{{z}}/{{x}}/{{y}}.svg#<b>Me</b>"),
        )
        path.write_text(page, encoding="utf-8")
        messages(browser)
        opened(browser, path.as_uri())
        tiles = browser.execute_script(
            "return [...document.querySelectorAll('.map image')].map(one =>"
            " [one.getAttribute('href'), one.getBoundingClientRect().width,"
            " one.getBoundingClientRect().height])"
        )
        until(browser, "return [...document.querySelectorAll('.map image')].length > 3")
        WebDriverWait(browser, WAIT_S).until(lambda _: len(asked) >= len(tiles))
        server.shutdown()
    assert 4 <= len(tiles) <= 36
    assert {href for href, _, _ in tiles} == {f"{host}{path}" for path in asked}
    # A tile is a square, and together they cover the map of 864 by 648 px.
    assert all(abs(width / height - 1.0) < 0.02 for _, width, height in tiles)
    assert sum(width * height for _, width, height in tiles) > 864 * 648
    assert browser.find_element("css selector", ".attribution").text == "Base map: <b>Me</b>"
    assert messages(browser) == []


def test_nothing_of_a_file_becomes_part_of_the_page(
    browser: Chrome, folder: Path, survey: Result, address: str
) -> None:
    opened(browser, address)
    assert browser.title == f"{survey.file} · mavjoule"
    assert browser.find_element("css selector", "h1 .file").text == survey.file
    assert browser.execute_script("return document.querySelectorAll('x').length") == 0
    broken = checked(folder / "broken.plan")
    opened(browser, written(folder, broken))
    assert browser.title == f"{broken.file} · mavjoule"
    assert browser.find_element("css selector", ".verdict").text.endswith("NOT CHECKED")
    assert "X901" in browser.find_element("css selector", ".finding").text
    assert messages(browser) == []


def test_a_policy_lets_no_other_script_run(browser: Chrome, address: str) -> None:
    opened(browser, address)
    browser.execute_script(
        "const script = document.createElement('script');"
        "script.textContent = \"document.title = 'taken'\"; document.body.append(script);"
    )
    assert browser.title != "taken"
    assert any("Content Security Policy" in message for message in messages(browser))


def test_a_click_on_a_finding_shows_its_place(
    browser: Chrome, survey: Result, address: str
) -> None:
    opened(browser, address)
    [number] = [n for n, finding in enumerate(survey.findings) if finding.code == "F101"]
    marks = ".chart.map .focus_marks path"
    assert browser.find_elements("css selector", marks) == []
    button = browser.find_element("css selector", f"button.show[data-finding='{number}']")
    button.click()
    assert button.get_attribute("aria-pressed") == "true"
    card = browser.find_element("css selector", f"#mission-0-finding-{number}")
    assert "shown" in (card.get_attribute("class") or "")
    stretch = survey.findings[number].stretch
    assert stretch is not None
    shown_parts = until(browser, f"return document.querySelectorAll('{marks}').length")
    assert shown_parts == len(stretch.parts_deg)  # a line for each part outside the fence
    assert until(browser, "return document.querySelectorAll('.power .focus_marks path').length")
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    until(browser, f"return document.querySelectorAll('{marks}').length === 0")


def test_the_slider_tells_the_flight_at_its_time(
    browser: Chrome, survey: Result, address: str
) -> None:
    opened(browser, address)
    slider = browser.find_element("css selector", "input[type=range]")
    slider.send_keys(END)
    text = browser.find_element("css selector", "output").text
    document = json.loads(check_json([survey], version="1"))["missions"][0]
    assert f"{document['totals']['time_s'] / 60.0:.2f} min" in text
    assert f"{document['totals']['energy_wh']:.2f} Wh used" in text
    assert "land" in text
    for chart in ("map", "altitude", "power", "energy"):
        assert until(
            browser, f"return document.querySelectorAll('.{chart} .cursor_marks > *').length"
        )


def test_the_map_can_be_zoomed_with_the_keyboard_and_back(browser: Chrome, address: str) -> None:
    opened(browser, address)
    label = (
        "return [...document.querySelectorAll('.map .role-axis-label text')]"
        ".map(one => one.textContent).sort().join()"
    )
    before = browser.execute_script(label)
    zoom_in, _, whole = browser.find_elements("css selector", "[data-zoom]")
    bar = (
        "return [...document.querySelectorAll('.map .mark-text.role-mark text')]"
        ".map(one => one.textContent).find(text => /^[0-9]+ k?m$/.test(text))"
    )
    assert browser.execute_script(bar) == "50 m"
    zoom_in.send_keys(ENTER)
    until(browser, f"{label} !== '{before}'")
    zoom_in.send_keys(ENTER)
    until(browser, f"{bar} === '20 m'")
    whole.send_keys(ENTER)
    until(browser, f"{label} === '{before}'")


def test_pictures_over_time_are_zoomed_together_about_the_cursor(
    browser: Chrome, address: str
) -> None:
    opened(browser, address)
    labels = (
        "['altitude', 'speed', 'power', 'energy'].map(name => [...document.querySelector("
        "`.${name} .role-axis-label`).querySelectorAll('text')]"
        ".filter(one => one.getAttribute('opacity') !== '0')"
        ".map(one => Number(one.textContent)).sort((one, other) => one - other).join())"
    )
    before = browser.execute_script(f"return {labels}")
    zoom_in, _, whole = browser.find_elements("css selector", "[data-span]")
    zoom_in.send_keys(ENTER)
    is_before = f"{labels}.map((one, index) => one === {json.dumps(before)}[index])"
    until(browser, f"return !{is_before}.includes(true)")
    zoomed = browser.execute_script(f"return {labels}")
    for one, other in zip(zoomed, before, strict=True):
        assert float(one.split(",")[0]) == 0.0
        assert float(one.split(",")[-1]) < 0.6 * float(other.split(",")[-1])
    whole.send_keys(ENTER)
    until(browser, f"return !{is_before}.includes(false)")


def test_marks_of_the_map_tell_what_happens_at_their_place(
    browser: Chrome, survey: Result, address: str
) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    opened(browser, address)
    document = json.loads(check_json([survey], version="1"))["missions"][0]
    texts = browser.execute_script(
        "return [...document.querySelectorAll('.map svg text')].map(one => one.textContent)"
    )
    assert {"tightest", "1, 19, H", "R1", "Return lands with", "reserve + over 25 %"} <= {*texts}
    seventh = document["items"][6]
    detail = (
        f"{quantity.clock(seventh['arrival_s'])} · {quantity.energy(seventh['energy_used_wh'])}"
    )
    assert f"{detail} · 60 m" in texts
    home = browser.execute_script(
        "return [...document.querySelectorAll('.map .mark-symbol path')]"
        f".find(one => one.getAttribute('fill') === '{GREEN}'"
        " && !one.closest('.role-legend'))"
    )
    ActionChains(browser).move_to_element(home).perform()
    shown_text = until(
        browser,
        "const tip = document.querySelector('#vg-tooltip-element.visible td.value');"
        "return tip && tip.innerText",
    )
    lines = str(shown_text).split("\n")
    assert [line.split(" · ")[0] for line in lines] == ["Take-off 1", "Return 19", "Home"]
    assert lines[0].endswith("60 m above home, 275 m AMSL")


@pytest.mark.parametrize(("scheme", "width"), [("dark", 0), ("light", PHONE_PX)])
def test_axe_finds_nothing_more_than_minor_and_pictures_take_the_ink_of_the_page(
    browser: Chrome, address: str, scheme: str, width: int
) -> None:
    opened(browser, address, scheme=scheme, width=width)
    if width:
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    ink = "return getComputedStyle(document.querySelector('{}')).{}"
    label = browser.execute_script(ink.format(".map .role-axis-label text", "fill"))
    assert label == browser.execute_script(ink.format("body", "color"))
    assert grave_violations(browser) == []


def test_on_paper_tables_are_open_and_controls_are_gone(browser: Chrome, address: str) -> None:
    opened(browser, address)
    assert sheets(browser) in {3, 4}
    unopened = "return document.querySelectorAll('details.printed:not([open])').length"
    before = browser.execute_script(unopened)
    browser.execute_script("dispatchEvent(new Event('beforeprint'))")
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert browser.execute_script(unopened) == 0
    rows = "return document.querySelectorAll('[data-long=items] tbody tr').length"
    assert browser.execute_script(rows) == 19
    controls = ".cursor, .zoom, button.show, .skip"
    assert browser.execute_script(
        f"return [...document.querySelectorAll('{controls}')]"
        ".every(one => getComputedStyle(one).display === 'none')"
    )
    margins = (
        "return [...document.styleSheets].flatMap(sheet => [...sheet.cssRules])"
        ".filter(rule => rule.media && rule.media.mediaText === 'print')"
        ".some(rule => rule.cssText.includes('counter(pages)'))"
    )
    assert browser.execute_script(margins), "pages are numbered"
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    browser.execute_script("dispatchEvent(new Event('afterprint'))")
    assert browser.execute_script(unopened) == before > 2


def test_many_missions_are_led_by_the_worst_and_each_opens_from_its_row(
    browser: Chrome, folder: Path, survey: Result
) -> None:
    fine = checked(MISSIONS / "survey-vineyard.plan", wind_m_s=0.0)
    results = [fine, survey, checked(folder / "broken.plan")]
    address = written(folder, *results)
    opened(browser, address)
    assert (
        browser.find_element("css selector", "h1").text
        == "3 missions: 1 GO, 1 NO-GO, 1 NOT CHECKED"
    )
    given = [one.text for one in browser.find_elements("css selector", ".part > .given")]
    assert [one.rpartition(": ")[2] for one in given] == [fine.file, survey.file]
    assert "no wind" in given[0]
    files = (
        "return [...document.querySelectorAll('#overview tbody th')].map(one => one.textContent)"
    )
    names = [result.file for result in results]
    assert browser.execute_script(files) == [names[1], names[2], names[0]]
    document = json.loads(check_json(results, version="1"))
    for path, value, _ in shown(browser):
        assert float(value) == at(document, path)
    heads = browser.find_elements("css selector", "#overview thead button")
    heads[4].click()  # energy, least first; what has none stands last
    assert browser.execute_script(files)[2] == names[2]
    heads[0].click()
    assert browser.execute_script(files) == [names[1], names[2], names[0]]
    browser.find_element("link text", names[0]).click()
    until(browser, "return document.querySelector('#mission-0').open")
    until(browser, "return document.querySelector('#mission-0').dataset.drawn")
    assert messages(browser) == []
    assert grave_violations(browser, is_unfolded=False) == []  # each is as any check's
    clipped = (
        "const one = document.querySelector('#overview').parentElement;"
        "return one.scrollWidth - one.clientWidth"
    )
    for width in (400, 1280):
        opened(browser, address, width=width)
        assert browser.execute_script(clipped) <= 0, f"nothing is clipped at {width} px"
