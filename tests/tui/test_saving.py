"""What is saved of a review, and what is not written over."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from reviews import TOO_FAR, review_app, settled, what_if_of

from planner.errors import UsageError
from planner.mission.files import read_mission
from planner.service.preflight import CheckResult
from planner.tui.checked import checked
from planner.tui.screens.save import OverwriteError, save


def test_the_report_ends_in_the_command_that_says_the_same() -> None:
    what_if = what_if_of(TOO_FAR).changed("battery", "8Ah@14.8V")
    save(checked(TOO_FAR, what_if), "report.txt")
    text = Path("report.txt").read_text(encoding="utf-8")
    assert text.startswith(f"GO  {TOO_FAR}")
    assert text.endswith(f"$ mavjoule check {TOO_FAR} --battery 8Ah@14.8V\n")


def test_the_figures_are_json() -> None:
    save(checked(TOO_FAR, what_if_of(TOO_FAR)), "report.json")
    document = json.loads(Path("report.json").read_text(encoding="utf-8"))
    assert document["missions"][0]["verdict"] == "no-go"


def test_the_mission_is_saved_in_another_format() -> None:
    save(checked(TOO_FAR, what_if_of(TOO_FAR)), "other.waypoints")
    assert len(read_mission("other.waypoints").items) == len(read_mission(TOO_FAR).items)


def test_a_speed_that_was_tried_is_in_the_mission_that_is_saved() -> None:
    what_if = what_if_of(TOO_FAR).changed("speed_m_s", "7.5")
    tried = checked(TOO_FAR, what_if).result
    said = save(checked(TOO_FAR, what_if), "slower.plan")
    saved = checked("slower.plan", what_if_of("slower.plan")).result
    assert "at 7.5 m/s" in said
    assert isinstance(tried, CheckResult)
    assert isinstance(saved, CheckResult)
    # one flight, from the route and from the file: the same arithmetic
    assert saved.totals.time_s == pytest.approx(tried.totals.time_s, rel=1e-9)


@pytest.mark.parametrize("name", ["report.txt", "report.json", "report.html"])
def test_no_report_says_of_the_file_what_it_comes_to_at_a_speed_tried(name: str) -> None:
    """The file flies its own speeds: `mavjoule check --speed` tells its errors at those too."""
    tried = checked(TOO_FAR, what_if_of(TOO_FAR).changed("speed_m_s", "7.5"))
    with pytest.raises(UsageError, match=r"save the mission at 7\.5 m/s, then its report"):
        save(tried, name)
    assert not Path(name).exists()


def test_the_report_is_a_page() -> None:
    save(checked(TOO_FAR, what_if_of(TOO_FAR)), "report.html")
    assert "NO-GO" in Path("report.html").read_text(encoding="utf-8")


def test_a_name_that_says_nothing_is_refused() -> None:
    with pytest.raises(UsageError, match=r"expected \.txt"):
        save(checked(TOO_FAR, what_if_of(TOO_FAR)), "report")


def test_the_mission_itself_is_never_written_over() -> None:
    before = Path(TOO_FAR).read_bytes()
    with pytest.raises(UsageError, match="another name"):
        save(checked(TOO_FAR, what_if_of(TOO_FAR)), f"./{TOO_FAR}", replace=True)
    assert Path(TOO_FAR).read_bytes() == before


def test_a_file_that_is_there_is_written_over_when_asked_twice() -> None:
    Path("report.txt").write_text("mine", encoding="utf-8")
    one = checked(TOO_FAR, what_if_of(TOO_FAR))
    with pytest.raises(OverwriteError):
        save(one, "report.txt")
    assert Path("report.txt").read_text(encoding="utf-8") == "mine"
    save(one, "report.txt", replace=True)
    assert Path("report.txt").read_text(encoding="utf-8").startswith("NO-GO")


@pytest.mark.asyncio
async def test_a_key_asks_for_the_name_and_saves() -> None:
    async with review_app().run_test(size=(80, 24)) as pilot:
        await settled(pilot)
        await pilot.press("s")
        await pilot.pause()
        await pilot.press("enter")
        await pilot.pause()
    assert Path("crossing-too-far.report.txt").read_text(encoding="utf-8").startswith("NO-GO")
