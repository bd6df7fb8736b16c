"""What is read on the screen can be read: in every theme, and without its colours."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree as ET

import pytest
from reviews import SURVEY, TOO_FAR, TOO_SMALL, missions_shown, review_app, settled, what_if_of
from textual.containers import Vertical

from planner.findings import Severity
from planner.service.preflight import CheckResult
from planner.tui.app import HIGH_CONTRAST, THEMES
from planner.tui.checked import checked
from planner.tui.details import Summary
from planner.tui.rows import MARKS, finding_table, item_table
from planner.tui.screens.checklist import checklist_table
from planner.tui.screens.missions import entries_given, mission_table
from planner.tui.screens.search import hit_table, hits
from planner.tui.suggestions import suggestion_table, suggestions
from planner.tui.widgets.bars import verdict_line
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.profile_plot import ProfilePlot

if TYPE_CHECKING:
    from collections.abc import Iterator

    from textual.geometry import Region
    from textual.pilot import Pilot

    from planner.tui.widgets.row_list import Table
LEAST_TEXT, LEAST_TEXT_HIGH, LEAST_DRAWING = 4.5, 7.0, 3.0
"""WCAG 2.2: 1.4.3, 1.4.6 and 1.4.11."""
SIZES = [(80, 24), (142, 42)]
CELL = 12.2, 24.4
"""Width and height of a character in a screenshot."""
BRAILLE = range(0x2800, 0x2900)


class Shown(NamedTuple):
    """A run of characters as it is shown."""

    text: str
    colour: str
    ground: str

    @property
    def contrast(self) -> float:
        """The ratio of WCAG 2.2."""
        light, dark = sorted((_luminance(self.colour), _luminance(self.ground)), reverse=True)
        return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    """Return the relative luminance of WCAG 2.2 of ``#rrggbb``."""
    shares = [int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]
    linear = [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def shown(svg: str, region: Region | None) -> Iterator[Shown]:
    """Yield what a screenshot shows."""
    fills = dict(re.findall(r"\.(terminal-\d+-r\d+) \{ fill: (#[0-9a-f]{6})", svg))
    root = ET.fromstring(svg)
    namespace = "{http://www.w3.org/2000/svg}"
    grounds: dict[int, list[tuple[float, float, str]]] = {}
    for one in root.iter(f"{namespace}rect"):
        if one.get("shape-rendering") == "crispEdges":
            left, width = float(one.get("x", 0)), float(one.get("width", 0))
            row = round(float(one.get("y", 0)) / CELL[1])
            grounds.setdefault(row, []).append((left, left + width, one.get("fill", "")))
    for one in root.iter(f"{namespace}text"):
        colour = fills.get(one.get("class", ""))
        if colour is None or not (one.text or "").strip():
            continue
        x, y = float(one.get("x", 0)) + 1.0, float(one.get("y", 0)) - CELL[1] / 2.0
        row = int(y / CELL[1])
        if region is not None and not region.contains(int(x / CELL[0]), row):
            continue
        under = [fill for left, right, fill in grounds[row] if left <= x < right]
        yield Shown(
            text=(one.text or "").replace("\xa0", " ").strip(),
            colour=colour,
            ground=under[-1] or "",
        )


def unreadable(svg: str, theme: str, region: Region | None = None) -> list[Shown]:
    """Return what is too faint, in a part of the screen."""
    least = LEAST_TEXT_HIGH if theme == HIGH_CONTRAST.name else LEAST_TEXT
    found = []
    for one in shown(svg, region):
        is_text = any(character.isalnum() for character in one.text)
        is_drawn = any(ord(character) in BRAILLE for character in one.text)
        if one.contrast < (least if is_text else LEAST_DRAWING if is_drawn else 0.0):
            found.append(one)
    return found


def test_the_contrast_of_black_and_white_is_that_of_the_standard() -> None:
    assert Shown("a", "#ffffff", "#000000").contrast == pytest.approx(21.0)
    # the grey that WCAG's own examples call just enough on white
    assert Shown("a", "#767676", "#ffffff").contrast == pytest.approx(4.54, abs=0.01)


async def unreadable_in_themes(
    pilot: Pilot[None], region: Region | None = None
) -> set[tuple[str, Shown]]:
    """Return what is too faint in any theme, with the theme."""
    found = set()
    for theme in THEMES:
        pilot.app.theme = theme
        await pilot.pause()
        svg = pilot.app.export_screenshot()
        found |= {(theme, one) for one in unreadable(svg, theme, region)}
    return found


@pytest.mark.asyncio
@pytest.mark.parametrize("size", SIZES, ids=str)
async def test_everything_on_the_review_can_be_read(size: tuple[int, int]) -> None:
    async with review_app(TOO_FAR).run_test(size=size) as pilot:
        await settled(pilot)
        found = set()
        for keys in ("1", "2 p p p", "3", "4 down", "5", "6", "escape"):
            await pilot.press(*keys.split())
            await settled(pilot)
            found |= await unreadable_in_themes(pilot)
    assert found == set()


@pytest.mark.asyncio
async def test_everything_on_the_other_screens_can_be_read() -> None:
    async with review_app(".").run_test(size=(100, 30)) as pilot:
        await missions_shown(pilot)
        found = await unreadable_in_themes(pilot)
        await pilot.press("enter")
        await settled(pilot)
        for key in ("c", "space"):
            await pilot.press(key)
            await pilot.pause()
            found |= await unreadable_in_themes(pilot)
    assert found == set()


@pytest.mark.asyncio
async def test_what_lies_over_the_review_can_be_read() -> None:
    async with review_app(SURVEY, given=TOO_SMALL).run_test(size=(100, 30)) as pilot:
        await settled(pilot)
        found = set()
        for keys in ("slash e 1", "s enter", "y"):
            await pilot.press(*keys.split())
            await pilot.pause()
            region = pilot.app.screen.query_one(Vertical).region
            found |= await unreadable_in_themes(pilot, region)
            await pilot.press("escape")
            await pilot.pause()
    assert found == set()


def test_every_severity_has_a_sign_of_its_own() -> None:
    assert set(MARKS) == set(Severity)
    assert len({mark for mark in MARKS.values() if mark.strip()}) == len(Severity)


def test_no_row_is_told_apart_by_its_colour_alone() -> None:
    one = checked(TOO_FAR, what_if_of(TOO_FAR))
    assert isinstance(one.result, CheckResult)
    entries = entries_given([TOO_FAR, SURVEY, "new.plan", "."])
    results = {TOO_FAR: one.result, SURVEY: checked(SURVEY, what_if_of(SURVEY)).result}
    offered = tuple(suggestions(one))
    tables: list[Table] = [
        finding_table(one.result.findings),
        item_table(one.result),
        hit_table(hits(one.result, one.result.findings, "e")),
        mission_table(entries, results),
        checklist_table(one, done=frozenset(), opened=frozenset()),
        suggestion_table(offered),
    ]
    for rows in tables:
        tones: dict[str, set[str]] = {}
        for index in range(len(rows)):
            (sign, text, *_), tone = rows.row(index)
            tones.setdefault(sign.strip() or text.strip()[:1], set()).add(tone)
        assert all(len(tone) == 1 for tone in tones.values()), (type(rows), tones)


@pytest.mark.parametrize("verdict", ["GO", "NO-GO", "NO VERDICT"])
def test_each_verdict_has_its_sign_and_its_words(verdict: str) -> None:
    signs = {"GO": "✔", "NO-GO": "✖", "NO VERDICT": "–"}
    said = Summary(
        verdict=verdict, is_go=verdict == "GO", file="a", headline="", return_plan="", closing=""
    )
    assert verdict_line(said).plain == f"{signs[verdict]} {verdict}  a"


@pytest.mark.asyncio
async def test_the_stretch_in_question_has_signs_on_map_and_profile() -> None:
    async with review_app(TOO_FAR).run_test(size=(160, 48)) as pilot:
        screen = await settled(pilot)
        await pilot.press("4", "end", "up", "up")
        await settled(pilot)
        drawn = {
            kind: "".join(
                screen.query_one(kind).render_line(y).text
                for y in range(screen.query_one(kind).size.height)
            )
            for kind in (GroundMap, ProfilePlot)
        }
        assert "○" in drawn[GroundMap]
        assert "▔" in drawn[ProfilePlot]
