"""``--terrain`` from the command line and the configuration, with a grid made here."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest
import rasterio
from made_missions import item, mission, rtl, takeoff

from planner.cli.main import main
from planner.mission.files import write_mission
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def slope(tmp_path: Path) -> Path:
    """A grid that rises 100 m for each hundredth of a degree of latitude, 400 m at 47° north."""
    latitude_deg = 47.05 - (np.arange(100) + 0.5) * 0.001
    heights = 400.0 + (latitude_deg - 47.0) * 1e4
    grid = np.repeat(heights[:, None], 100, axis=1).astype(np.float32)
    path = tmp_path / "slope.tif"
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=100,
        height=100,
        count=1,
        dtype="float32",
        crs="EPSG:4326",
        transform=rasterio.Affine(0.001, 0.0, 7.95, 0.0, -0.001, 47.05),
    ) as raster:
        raster.write(grid, 1)
    return path


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "terrain.plan"
    # 0.01° north the ground is 100 m higher: 30 m above it are 130 m above home.
    write_mission(mission(takeoff(20), item(16, 47.01, 30.0, frame=10), rtl()), path)
    return path


def climb_m(capsys: pytest.CaptureFixture[str]) -> float:
    found: float = json.loads(capsys.readouterr().out)["missions"][0]["totals"]["climb_m"]
    return found


def test_terrain_heights_follow_the_ground(
    plan: Path, slope: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", str(plan), "--battery", "200Wh", "--format", "json", "--terrain", str(slope)])
    assert climb_m(capsys) == pytest.approx(130.0, abs=0.5)  # float32 heights, half a cell


def test_an_altitude_that_qgroundcontrol_left_open_is_worked_out(
    tmp_path: Path, slope: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    waiting = replace(item(16, 47.01, None, frame=0), unresolved_agl_m=30.0)
    path = tmp_path / "open.plan"
    write_mission(mission(takeoff(20), waiting, rtl()), path)
    options = ["check", str(path), "--battery", "200Wh", "--format", "json"]
    main([*options, "--terrain", str(slope)])
    [checked] = json.loads(capsys.readouterr().out)["missions"]
    assert checked["totals"]["climb_m"] == pytest.approx(130.0, abs=0.5)
    assert "A110" in {finding["code"] for finding in checked["findings"]}
    main(options)
    [checked] = json.loads(capsys.readouterr().out)["missions"]
    assert checked["verdict"] == "no-go"
    assert "A109" in {finding["code"] for finding in checked["findings"]}


def test_a_clearance_is_asked_for_from_the_command_line(
    tmp_path: Path, slope: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0.004° north the ground is 40 m up: a waypoint 60 m above home is 20 m over it."""
    path = tmp_path / "low.plan"
    write_mission(mission(takeoff(60), item(16, 47.004, 60.0), rtl()), path)
    options = ["check", str(path), "--battery", "200Wh", "--format", "json"]
    for clearance, fires in (("19", False), ("21", True)):
        main([*options, "--terrain", str(slope), "--clearance", clearance])
        [checked] = json.loads(capsys.readouterr().out)["missions"]
        found = [f for f in checked["findings"] if f["code"] == "A102"]
        assert bool(found) is fires
    assert "--clearance" in found[0]["message"]
    assert main([*options, "--clearance", "-3"]) == 2


def test_heights_of_an_hgt_file_are_as_good(
    plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The grid of 1 by 1 degree is named by its corner: 400 m at 47° north, 10 m per 0.001°."""
    rows = 47.0 + np.linspace(1.0, 0.0, 1201)
    grid = np.repeat((400.0 + (rows - 47.0) * 1e4)[:, None], 1201, axis=1)
    path = tmp_path / "N47E008.hgt"
    grid.round().astype(">i2").tofile(path)
    main(["check", str(plan), "--battery", "200Wh", "--format", "json", "--terrain", str(path)])
    assert climb_m(capsys) == pytest.approx(130.0, abs=1.0)  # whole metres


def test_terrain_stands_in_the_configuration(
    plan: Path, slope: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (plan.parent / "mavjoule.toml").write_text(f'terrain = ["{slope.name}"]\nbattery = "200Wh"\n')
    main(["check", str(plan), "--format", "json"])
    assert climb_m(capsys) == pytest.approx(130.0, abs=0.5)


def test_an_unreadable_grid_is_a_sentence(plan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(plan), "--terrain", str(plan)]) == 2
    assert "terrain.plan" in capsys.readouterr().err
