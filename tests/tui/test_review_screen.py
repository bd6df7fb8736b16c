"""The review of a mission, driven as a pilot drives it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from reviews import TOO_FAR, checked, review_app, rows_of, settled, text_of, typed, what_if_of
from textual.widgets import Input, Static

from planner import __version__, quantity
from planner.physics.wind import Wind
from planner.report.json import check_json
from planner.service.preflight import CheckResult, check_file
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.panes import PANES, DetailsPane
from planner.tui.widgets.profile_plot import ProfilePlot
from planner.tui.widgets.row_list import RowList
from planner.tui.widgets.what_if_form import WhatIfForm

pytestmark = pytest.mark.asyncio

NARROW, WIDE = (80, 24), (160, 48)


async def test_a_mission_without_changes_is_checked_once() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
    assert screen.now is not None
    assert screen.now is screen.base
    assert screen.now.result.verdict == "no-go"


@pytest.mark.parametrize("size", [NARROW, WIDE])
async def test_one_look_tells_the_verdict_and_why(size: tuple[int, int]) -> None:
    async with review_app().run_test(size=size) as pilot:
        screen = await settled(pilot)
        verdict = text_of(screen, "#verdict")
        assert verdict.startswith("✖ NO-GO")
        assert "short of the 20 % reserve" in verdict
        assert "Tightest return: " in verdict
        codes = [cells[1] for cells in rows_of(screen, "#findings")]
        assert set(codes[:2]) == {"E101", "E102"}
        details = screen.query_one(DetailsPane).details
        assert details is not None
        assert codes[0] in details.title
        assert {"Do", "Why", "How"} <= {label for label, _ in details.parts}


async def test_every_number_is_that_of_the_json_report() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        result = check_file(TOO_FAR, what_if_of(TOO_FAR).setup())
        [mission] = json.loads(check_json([result], version=__version__))["missions"]
        totals, battery, way = mission["totals"], mission["battery"], mission["return"]
        verdict = text_of(screen, "#verdict")
        for text in (
            mission["verdict"].upper(),
            quantity.duration(totals["time_s"]),
            quantity.distance(totals["distance_m"]),
            quantity.energy(totals["energy_wh"]),
            quantity.percent(battery["used_fraction"]),
            quantity.energy(-battery["margin_wh"]),
            f"item {way['tightest_item']}",
            quantity.energy(way["energy_home_wh"]),
        ):
            assert text in verdict
        for cells, segment in zip(rows_of(screen, "#segments"), mission["segments"], strict=True):
            assert cells[0] == str(segment["item"])
            assert cells[1] == segment["state"]
            assert cells[2] == quantity.decimals(segment["start_s"], 1)
            assert cells[4] == quantity.decimals(segment["distance_m"], 1)
            assert cells[5] == quantity.decimals(segment["energy_wh"], 3)
        for cells, item in zip(rows_of(screen, "#items"), mission["items"], strict=True):
            assert cells[2] == item["command"]
            assert cells[3] == quantity.duration(item["arrival_s"])
            assert cells[4] == quantity.energy(item["energy_used_wh"])
        findings = [cells[1] for cells in rows_of(screen, "#findings")]
        left_open = [one["code"] for one in mission["checks"] if one["outcome"] == "not-checked"]
        assert findings == [finding["code"] for finding in mission["findings"]] + left_open


async def test_the_rules_not_checked_follow_the_findings_with_what_they_need() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        signs = [cells[0] for cells in rows_of(screen, "#findings")]
        first = signs.index("–")
        assert set(signs[first:]) == {"–"}
        assert "22 rules not checked" in text_of(screen, "#verdict")
        await pilot.press(*["down"] * first)
        await pilot.pause()
        details = screen.query_one(DetailsPane).details
        assert details is not None
        assert details.title.startswith("– ")
        assert details.title.endswith("(not checked)")
        assert details.tone == "warning"
        assert "Needs" in dict(details.parts)


async def test_the_panes_follow_the_selected_segment() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await pilot.press("4")
        await pilot.pause()
        segments = screen.query_one("#segments", RowList)
        before = segments.cursor
        await pilot.press("down", "down", "down", "down")
        await pilot.pause()
        assert segments.cursor == before + 4
        item = int(rows_of(screen, "#segments")[segments.cursor][0])
        assert screen.query_one("#items", RowList).cursor == item - 1
        details = screen.query_one(DetailsPane).details
        assert details is not None
        assert details.title.startswith(f"Segment {segments.cursor}")


async def test_the_panes_follow_the_cursor_of_the_profile() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await pilot.press("2")
        await pilot.pause()
        await pilot.press("end")
        await pilot.pause()
        last = len(rows_of(screen, "#segments")) - 1
        assert screen.query_one("#segments", RowList).cursor == last


async def test_a_key_turns_the_quantity_over() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        plot = screen.query_one(ProfilePlot)
        seen = []
        for _ in range(5):
            assert plot.picture is not None
            seen.append(plot.picture.name)
            await pilot.press("p")
        assert seen == [
            "altitude above home",
            "ground speed",
            "power",
            "energy",
            "energy left in the battery",
        ]


async def test_a_change_is_checked_and_compared() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await typed(pilot, "battery", "8Ah@14.8V")
        assert text_of(screen, "#verdict").startswith("✔ GO")
        outcome = text_of(screen, "#outcome")
        assert "NO-GO → GO" in outcome
        # 2.8 Ah more at 14.8 V are 41.4 Wh, 80 % of them above the reserve
        assert f"+{quantity.energy(2.8 * 14.8 * 0.8)}" in outcome


async def test_the_suggested_battery_goes() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        rows = screen.query_one("#suggestions", RowList)
        offered = [rows.rows.row(index)[0][1] for index in range(len(rows.rows))]
        [at] = [index for index, text in enumerate(offered) if "battery" in text]
        rows.focus()
        await pilot.pause()
        await pilot.press(*["down"] * at, "enter")
        await settled(pilot)
        assert text_of(screen, "#verdict").startswith("✔ GO")
        assert screen.query_one("#set-battery", Input).value.endswith("@14.8V")


async def test_a_text_that_says_no_value_is_told_and_changes_nothing() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await typed(pilot, "wind", "strong")
        assert "expected speed and the direction" in text_of(screen, "#outcome")
        assert "cannot be checked like this" in text_of(screen, "#verdict")
        assert screen.query_one("#set-wind", Input).has_class("-wrong")


@pytest.mark.parametrize("key", ["c", "s"])
async def test_nothing_is_released_or_saved_of_what_cannot_be_checked(key: str) -> None:
    """The GO before is no answer to a wind without a direction, which may make it a NO-GO."""
    async with review_app().run_test(size=WIDE) as pilot:
        await settled(pilot)
        screen = await typed(pilot, "battery", "8Ah@14.8V")
        assert text_of(screen, "#verdict").startswith("✔ GO")
        await typed(pilot, "wind", "15")
        screen.query_one("#findings").focus()
        await pilot.press(key)
        await pilot.pause()
        assert pilot.app.screen is screen
        await typed(pilot, "wind", "1@0")
        screen.query_one("#findings").focus()
        await pilot.press(key)
        await pilot.pause()
        assert pilot.app.screen is not screen


async def test_an_older_result_is_dropped() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        old = screen.now
        assert old is not None
        await typed(pilot, "payload_kg", "0.2")
        newer = screen.now
        assert newer is not old
        screen.call_later(screen.take, 0, old, old)
        await settled(pilot)
        assert screen.now is newer


async def test_changes_are_taken_back_together() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await typed(pilot, "battery", "8Ah@14.8V")
        screen.query_one(WhatIfForm).action_take_back()
        await settled(pilot)
        assert text_of(screen, "#verdict").startswith("✖ NO-GO")
        assert not screen.query_one("#set-battery", Input).value


async def test_a_file_written_anew_is_checked_again() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        Path(TOO_FAR).write_bytes(Path("survey-vineyard.plan").read_bytes())
        screen.watch_files()
        await settled(pilot)
        verdict = text_of(screen, "#verdict")
        assert verdict.startswith("✔ GO")
        assert "changed" in verdict


async def test_a_key_checks_everything_again() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        before = screen.base
        await pilot.press("r")
        await settled(pilot)
        assert screen.base is not before
        assert screen.base is not None
        assert text_of(screen, "#verdict").startswith("✖ NO-GO")


async def test_a_bug_of_ours_is_told_and_leaves_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        msg = "list index out of range"
        raise IndexError(msg)

    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        monkeypatch.setattr("planner.tui.screens.review.checked", fail)
        await pilot.press("r")
        await settled(pilot)
        verdict = text_of(screen, "#verdict")
        assert verdict.startswith("– NO VERDICT")
        assert "this is a bug in mavjoule, not in your files: IndexError" in verdict


async def test_a_broken_file_is_told_and_not_a_crash() -> None:
    Path("broken.plan").write_text("{", encoding="utf-8")
    async with review_app("broken.plan").run_test(size=NARROW) as pilot:
        screen = await settled(pilot)
        assert text_of(screen, "#verdict").startswith("– NOT CHECKED")
        assert rows_of(screen, "#findings")[0][1] == "X901"
        for key in "1234":
            await pilot.press(key, "down", "right", "escape")
        await pilot.pause()


async def test_a_missing_vehicle_is_told_and_not_a_crash() -> None:
    async with review_app(given={"vehicle": "none.toml"}).run_test(size=NARROW) as pilot:
        screen = await settled(pilot)
        assert "none.toml" in text_of(screen, "#verdict")


async def test_one_pane_at_a_time_on_a_narrow_terminal() -> None:
    async with review_app().run_test(size=NARROW) as pilot:
        screen = await settled(pilot)
        for key, pane in zip("123456", PANES, strict=True):
            await pilot.press(key)
            await pilot.pause()
            assert [name for name in PANES if screen.query_one(f"#{name}").display] == [pane]
            await pilot.press("escape")


async def test_all_panes_at_once_on_a_wide_terminal() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        assert all(screen.query_one(f"#{name}").display for name in PANES)


async def test_the_command_that_says_the_same_is_shown() -> None:
    async with review_app(given={"charge": 0.9}).run_test(size=WIDE) as pilot:
        await settled(pilot)
        await typed(pilot, "wind", "5@270")
        await pilot.press("escape", "y")
        await pilot.pause()
        command = str(pilot.app.screen.query_one("#command", Static).content)
        assert f"mavjoule check {TOO_FAR} --charge 90% --wind 5@270" in command
        assert pilot.app.clipboard == f"mavjoule check {TOO_FAR} --charge 90% --wind 5@270"


async def test_a_speed_tried_is_of_the_mission_once_it_is_saved_at_it() -> None:
    """What the strip says, the commands that are shown come to."""
    async with review_app(given={"charge": 0.9}).run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        await typed(pilot, "speed_m_s", "7.5")
        assert f"{TOO_FAR}, once it is saved at 7.5 m/s" in text_of(screen, "#verdict")
        await pilot.press("escape", "y")
        await pilot.pause()
        saved = f"{Path(TOO_FAR).stem}-7.5-m-s{Path(TOO_FAR).suffix}"
        assert pilot.app.clipboard == (
            f"mavjoule convert {TOO_FAR} {saved} --speed 7.5\nmavjoule check {saved} --charge 90%"
        )


async def test_no_speed_is_offered_where_one_is_asked_for() -> None:
    async with review_app(given={"speed_m_s": 9.0}).run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        texts = [cells[1] for cells in rows_of(screen, "#suggestions")]
        assert texts
        assert not any("level legs" in text for text in texts)


async def test_the_help_is_of_the_pane_in_use() -> None:
    async with review_app().run_test(size=NARROW) as pilot:
        screen = await settled(pilot)
        of_panes = (
            ("1", "Findings", "Choose"),
            ("3", "Map", "Zoom in"),
            ("6", "What if", "Take back all"),  # not typed into its field
        )
        for key, name, own in of_panes:
            await pilot.press(key)
            await pilot.pause()
            await pilot.press("question_mark")
            await pilot.pause()
            text = text_of(pilot.app.screen, "#help")
            assert f"Keys of {name}" in text
            assert own in text.partition("Everywhere")[0]
            assert "Scroll" not in text  # what Textual has besides
            await pilot.press("escape")
            await pilot.pause()
            assert pilot.app.screen is screen


async def test_escape_goes_to_the_findings_and_from_them_to_the_list() -> None:
    async with review_app(".").run_test(size=NARROW) as pilot:
        listed = await checked(pilot)
        await pilot.press("home", "enter")
        screen = await settled(pilot)
        await pilot.press("3", "escape")
        await pilot.pause()
        assert screen.focused is screen.query_one("#findings")
        await pilot.press("escape")
        await pilot.pause()
        assert pilot.app.screen is listed


async def test_the_point_of_no_return_is_marked_at_its_place_and_time() -> None:
    async with review_app().run_test(size=WIDE) as pilot:
        screen = await settled(pilot)
        assert screen.now is not None
        result = screen.now.result
        assert isinstance(result, CheckResult)
        assert result.return_plan is not None
        point = result.return_plan.last_return
        assert point is not None
        assert result.findings[0].code == "E102"
        start_s = result.items[point.item - 2].arrival_s
        # not where the leg begins: that is a minute and more before
        assert start_s is not None
        assert point.time_s - start_s > 60.0
        for drawing in (screen.query_one(ProfilePlot), screen.query_one(GroundMap)):
            assert drawing.cursor_s == pytest.approx(point.time_s, abs=1.0)


async def test_the_header_names_vehicle_battery_and_wind() -> None:
    given = {"wind": Wind(speed_m_s=5.0, from_deg=270.0)}
    async with review_app(given=given).run_test(size=NARROW) as pilot:
        screen = await settled(pilot)
        second = text_of(screen, "#verdict").splitlines()[1]
        assert second == "falkowski-2023-quadrotor, battery 77.0 Wh, wind 5.0 m/s from 270°"
