"""A fleet over time on the terminal: the same verdict and numbers as the check of it, moved by keys."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest
from reviews import checked, missions_shown, review_app, rows_of, text_of

from planner.cli.main import main
from planner.errors import ExitCode
from planner.quantity import clock
from planner.tui.screens.fleet import FleetScreen
from planner.tui.screens.missions import MissionsScreen
from planner.tui.widgets.bars import VerdictStrip
from planner.tui.widgets.fleet_plots import FleetPlot
from planner.tui.widgets.ground_map import GroundMap

FLEETS = Path(__file__).parents[2] / "missions" / "fleets"


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    """A delivery round whose two vehicles meet, in a folder beside its missions."""
    folder = tmp_path / "round"
    folder.mkdir()
    for file in ("delivery-two-pads.toml", "parcel-clinic.plan", "parcel-island.plan"):
        shutil.copy(FLEETS / file, folder)
    (folder / "model.toml").write_text('name = "no fleet"', encoding="utf-8")
    return folder / "delivery-two-pads.toml"


def drawn(screen: FleetScreen, selector: str) -> str:
    """Return what a drawing shows."""
    plot = screen.query_one(selector, FleetPlot if selector == "#timeline" else GroundMap)
    return "\n".join(plot.render_line(y).text for y in range(plot.size.height))


@pytest.mark.asyncio
async def test_a_fleet_is_listed_opened_moved_in_time_and_left(fleet: Path) -> None:
    async with review_app(str(fleet.parent)).run_test(size=(80, 24)) as pilot:
        missions = await missions_shown(pilot)
        verdicts = {cells[1]: cells[2] for cells in rows_of(missions, "#missions")}
        assert verdicts["delivery-two-pads.toml"] == "NO-GO"
        assert "model.toml" not in verdicts
        await pilot.press("end", "up", "enter")
        screen = await checked(pilot)
        assert isinstance(screen, FleetScreen)
        result = screen.result
        assert result is not None
        assert "NO-GO" in str(screen.query_one(VerdictStrip).content)
        [terne, _] = rows_of(screen, "#vehicles")
        assert terne[:4] == ("1", "terne", "clinic", "item 1")
        assert drawn(screen, "#timeline").splitlines()[0].count("✖") == 3
        # wherever the line of the moment is, names are whole
        plot = screen.query_one("#timeline", FleetPlot)
        whole = set()
        for percent in range(0, 100, 4):
            plot.point_at(percent / 100.0 * plot.end_s)
            whole.add(drawn(screen, "#timeline").count("clinic"))
        assert len(whole) == 1
        plot.point_at(0.0)
        await pilot.press("n", "n", "n")
        [near] = [one for one in result.findings if one.finding.code == "S101"]
        assert screen.time_s == near.at_s
        assert near.at_s is not None
        assert text_of(screen, "#moment").startswith(f"{clock(near.at_s)} · 2 in the air")
        assert "S101 clinic, island" in text_of(screen, "#moment")
        await pilot.press("3", "right", "comma")  # lists scroll by no arrow of theirs
        end_s = screen.query_one("#timeline", FleetPlot).end_s
        assert end_s == math.ceil(max(one.end_s for one in result.sorties) + 240.0)
        assert screen.time_s == pytest.approx(near.at_s + end_s / 100.0 - 1.0)
        await pilot.press("2")
        assert {"1", "2", "✖", "H"} <= set(drawn(screen, "#map"))
        await pilot.press("4", "enter")
        assert screen.time_s == near.at_s
        await pilot.press("1", "end")
        ended = [f"ended {clock(one.end_s)}" for one in result.sorties]
        assert [cells[3] for cells in rows_of(screen, "#vehicles")] == ended
        for size in ((60, 16), (140, 42)):
            await pilot.resize_terminal(*size)
            await pilot.pause()
            assert "in flight" in drawn(screen, "#timeline")
            assert screen.query_one("#map").display is (size[0] > 100)
        await pilot.press("escape")
        await pilot.pause()
        assert isinstance(pilot.app.screen, MissionsScreen)


@pytest.mark.asyncio
async def test_every_problem_of_a_fleet_file_is_told_and_none_of_its_old_verdict(
    fleet: Path,
) -> None:
    fleet.write_text("schema = 1\nnonsense = 1\n[pad.x]\n", encoding="utf-8")
    async with review_app(str(fleet)).run_test(size=(80, 24)) as pilot:
        screen = await checked(pilot)
        told = text_of(screen, "#verdict")
        assert told.startswith("– NO VERDICT")
        assert "nonsense" in told
        assert "pad.x" in told
        await pilot.press("right", "n", "space", "end", "4", "enter", "escape")
        await pilot.pause()
        assert isinstance(pilot.app.screen, MissionsScreen)


def test_what_a_fleet_says_of_each_vehicle_is_no_option_of_its_review(
    fleet: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planner.cli.review._refuse_terminal", lambda *_: None)
    told = ["review", str(fleet), "--vehicle", "falkowski-2023-quadrotor"]
    assert main(told) == ExitCode.UNUSABLE
    assert "--vehicle is not for a fleet" in capsys.readouterr().err
