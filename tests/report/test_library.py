"""What results answer to scripts and notebooks."""

from __future__ import annotations

import json
import shutil
import sys
from functools import cache
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any

import pytest

import planner
from planner.cli.main import main
from planner.report.json import ITEM_KEYS, SEGMENT_KEYS

if TYPE_CHECKING:
    from pathlib import Path

    from planner.presented import FrameLibrary

MISSION = "missions/survey-vineyard.plan"
FAR = "missions/crossing-too-far.plan"
VEHICLE = "falkowski-2023-quadrotor"


@cache
def checked(file: str = MISSION) -> planner.CheckResult:
    vehicle = planner.load_vehicle("falkowski-2023-quadrotor")
    battery = planner.Battery(capacity_wh=77.0)
    return planner.check(planner.read_mission(file), vehicle, battery=battery)


def test_a_script_gets_the_document_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--vehicle", "falkowski-2023-quadrotor", "--battery", "77Wh", "--format", "json"]
    assert main(["check", MISSION, *options]) == 0
    [printed] = json.loads(capsys.readouterr().out)["missions"]
    own = checked().to_dict()
    assert own["totals"] == printed["totals"]
    assert own["segments"] == printed["segments"]
    assert own.keys() == printed.keys()
    assert json.loads(checked().to_json()) == json.loads(checked().to_json(indent=None))


@pytest.mark.parametrize(
    "value",
    [
        checked(),
        planner.read_mission(MISSION),
        planner.load_vehicle("px4-quad-2kg"),
        checked().setup,
        planner.read_fleet("missions/fleets/search-by-four.toml"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_large_is_shown_in_a_line(value: object) -> None:
    shown = repr(value)
    assert shown.startswith(f"<{type(value).__name__} ")
    assert len(shown) < 300
    assert "\n" not in shown


def test_a_severity_is_its_name_and_may_be_given_by_it() -> None:
    assert f"{planner.Severity.WARNING}" == "warning"
    assert repr(planner.Severity.WARNING) == "Severity.WARNING"
    mission, vehicle = planner.read_mission(MISSION), planner.load_vehicle()
    named: Any = "warning"
    assert planner.Setup(vehicle, fail_on=named).fail_on is planner.Severity.WARNING
    wrong: Any = "fatal"
    with pytest.raises(planner.MavjouleError, match="fail_on must be "):
        planner.check(mission, vehicle, fail_on=wrong)


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_segments_and_items_are_data_frames(library: FrameLibrary) -> None:
    pytest.importorskip(library)
    result = checked()
    segments = result.to_dataframe(library=library)
    assert type(segments).__module__.split(".")[0] == library
    assert tuple(segments.columns) == SEGMENT_KEYS
    assert segments.shape[0] == len(result.segments)
    assert sum(segments["energy_wh"]) == pytest.approx(result.totals.energy_wh)
    assert {type(state) for state in segments["state"]} == {str}
    items = result.to_dataframe("items", library=library)
    assert tuple(items.columns) == ITEM_KEYS
    assert next(iter(items["command"])) == "NAV_TAKEOFF"


def test_a_library_of_data_frames_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("pandas", "polars"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(planner.MavjouleError, match="needs pandas or polars: pip install pandas"):
        checked().to_dataframe()
    with pytest.raises(planner.MavjouleError, match="needs polars: pip install polars"):
        checked().to_dataframe(library="polars")
    table: Any = "legs"
    with pytest.raises(planner.MavjouleError, match="table must be one of segments, items"):
        checked().to_dataframe(table)


class Page(HTMLParser):
    """The tags and the text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002
        self.tags.append(tag)
        self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002
        self.tags.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def test_a_notebook_shows_verdict_figures_findings_and_a_map() -> None:
    page = Page(checked(FAR)._repr_html_())
    text = "".join(page.texts)
    assert not page.open
    assert {"table", "svg", "polyline"} <= set(page.tags)
    assert not {"script", "img", "link", "style"} & set(page.tags)  # nothing from elsewhere
    assert text.startswith("NO-GO")
    assert "Energy73.2 Wh" in text
    assert "E101 reserve-below-minimum" in text


def test_a_notebook_shows_of_other_results_what_their_command_prints(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    asked = ["sweep", FAR, "--vehicle", VEHICLE, "--battery", "77Wh", "--vary", "payload=0,0.5"]
    main([*asked, "--workers", "1", "-o", str(tmp_path / "sweep.csv")])
    printed = capsys.readouterr().out
    mission, battery = planner.read_mission(FAR), planner.Battery(capacity_wh=77.0)
    setup = planner.Setup(vehicle=planner.load_vehicle(VEHICLE), battery=battery)
    swept = planner.sweep(mission, setup, vary={"payload": "0,0.5"})
    page = Page(swept._repr_html_())
    assert page.tags == ["pre"]
    shown = "".join(page.texts)
    assert shown.partition("\n")[0] == printed.partition("\n")[0]
    assert "payload" in shown
    both = planner.compare_results(checked(), checked(FAR))
    for other in (planner.predict_endurance(setup.vehicle), both):
        assert not Page(other._repr_html_()).open


def test_every_result_is_shown_in_a_notebook() -> None:
    from planner.presented import Presented, Shown
    from planner.report.library import _TEXTS, _WRITERS

    assert _WRITERS.keys() <= _TEXTS.keys()
    assert _TEXTS.keys() - _WRITERS.keys() == {
        one for one in Shown.__subclasses__() if not issubclass(one, Presented)
    }


def test_a_file_name_is_no_markup(tmp_path: Path) -> None:
    file = tmp_path / "<b>&.plan"
    shutil.copy(MISSION, file)
    page = Page(checked(str(file))._repr_html_())
    assert "<b>&.plan" in "".join(page.texts)


def test_every_result_has_a_document() -> None:
    from planner.report.library import _WRITERS

    assert {planner.SpeedCurve, planner.FleetResult, planner.SwarmResult} <= set(_WRITERS)
    quad = planner.load_vehicle("px4-quad-2kg")
    assert planner.predict_endurance(quad).to_dict()["schema"] == 1
