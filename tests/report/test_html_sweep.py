"""The page of a sweep, and a year of weather over a route."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from weather_year import HOURS, weather_year

import planner
from planner.report.html.sweep import sweep_html
from planner.report.sweep import sweep_text
from planner.report.text import Medium
from planner.service.sweep.engines import CoresEngine
from planner.service.sweep.sweep import sweep
from planner.service.sweep.tally import MONTH
from planner.setup import Setup
from planner.values import replace

if TYPE_CHECKING:
    from planner.service.sweep.sweep import Sweep

ROUTE = Path(__file__).resolve().parents[2] / "missions" / "delivery-fjord.waypoints"
EVERY = 1461
"""Of the hours of the year: six of them, in six months."""


@pytest.fixture(scope="module")
def year(tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    file = tmp_path_factory.mktemp("weather") / "year.csv"
    file.write_text(weather_year(every=EVERY), encoding="utf-8")
    return sweep(
        planner.read_mission(ROUTE),
        Setup.of({"vehicle": "dji-matrice-100"}),
        vary={"battery": ["6Ah@22.2V", "12Ah@22.2V"]},
        weather=file,
        engine=CoresEngine(1),
    )


def test_the_year_has_an_hour_each() -> None:
    text = weather_year()
    assert text.count("\n") == HOURS + 1
    assert text.splitlines()[-1].startswith("2025-12-31T23:00,")


def test_a_year_of_weather_says_which_hours_fly_by_month(year: Sweep) -> None:
    columns = year.columns()
    assert len(columns["time"]) == 2 * 6
    assert sorted(set(columns["time"])) == sorted(
        line.split(",")[0] for line in weather_year(every=EVERY).splitlines()[1:]
    )
    by_month = {label: (go, checked) for label, go, checked in year.tally.shares(MONTH)}
    for month, (go, checked) in by_month.items():
        rows = [i for i, time in enumerate(columns["time"]) if time.startswith(month)]
        assert (go, checked) == (sum(columns["verdict"][i] == "go" for i in rows), len(rows))
    assert "month" in sweep_text(year, medium=Medium())


def test_the_page_of_a_sweep_has_its_maps_and_runs_nothing_else(year: Sweep) -> None:
    missions = {"<script>x</script>": next(iter(year.plan.missions.values()))}
    hostile = replace(year, plan=replace(year.plan, missions=missions))
    page = sweep_html(hostile, version="0", made_at=datetime(2026, 1, 1, tzinfo=UTC))
    assert "Share of GO over month and battery [%]" in page
    assert "<script>x" not in page
    assert "&lt;script&gt;x" in page
