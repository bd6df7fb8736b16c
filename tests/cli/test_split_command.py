"""``mavjoule split``."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import planner
from planner.cli.main import main

ACROSS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t50.0\t20.0\t200\t1
1\t0\t3\t22\t0\t0\t0\t0\t50.0\t20.0\t100\t1
2\t0\t3\t16\t0\t0\t0\t0\t50.01\t20.0\t100\t1
3\t0\t3\t16\t0\t0\t0\t0\t49.99\t20.0\t100\t1
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""
"""1.1 km north, 2.2 km south over home, back."""
FITS = ["--battery", "15Wh"]


@pytest.fixture
def across() -> str:
    Path("across.waypoints").write_text(ACROSS, encoding="utf-8")
    return "across.waypoints"


def test_parts_are_written_and_each_is_a_go(
    across: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", across, *FITS]) == 1
    assert main(["split", across, *FITS, "-o", "parts", "--format", "json"]) == 0
    said = capsys.readouterr().out
    document = json.loads(said[said.index("{") :])
    names = [part["file"] for part in document["parts"]]
    assert names == [str(Path("parts", f"part-0{n}.plan")) for n in range(1, len(names) + 1)]
    assert len(names) > 1
    assert main(["check", *names, *FITS]) == 0
    assert all(len(planner.read_mission(name).items) > 2 for name in names)


def test_the_table_says_what_each_part_flies(
    across: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["split", across, *FITS]) == 0
    said = capsys.readouterr()
    assert "GO    part" not in said.out
    assert f"GO  {Path('across-parts', 'part-01.plan')}  item" in said.out
    assert "parts written to across-parts" in said.err


def test_settings_that_came_with_the_mission_are_named(
    across: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mavjoule.toml").write_text('battery = "60Wh"\nreserve = 0.0\n', encoding="utf-8")
    assert main(["split", across, "--vehicle", "falkowski-2023-quadrotor"]) == 0
    assert "\nsettings from mavjoule.toml: battery 60Wh, reserve 0%\n" in capsys.readouterr().out


def test_a_mission_no_leg_of_which_fits_ends_in_1_and_writes_nothing(
    across: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["split", across, "--battery", "7Wh"]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert "not even the shortest flight to item 2 is a go" in said.err
    assert not Path("across-parts").exists()


def test_parts_that_are_there_are_kept(across: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["split", across, *FITS]) == 0
    assert main(["split", across, *FITS]) == 2
    assert "--force" in capsys.readouterr().err
    assert main(["split", across, *FITS, "--force"]) == 0


def test_a_broken_mission_is_unusable(broken: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["split", broken]) == 2
    assert capsys.readouterr().err.startswith("mavjoule: broken.plan:1:")


def test_a_speed_is_written_into_the_parts(across: str) -> None:
    assert main(["split", across, "--battery", "17Wh", "--speed", "8"]) == 0
    for name in Path("across-parts").iterdir():
        commanded = [one.param2 for one in planner.read_mission(name).items if one.command == 178]
        assert commanded == [8.0]


def test_the_parts_are_shown_on_a_page(across: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["split", across, *FITS, "--report", "page.html"]) == 0
    assert "the page is in page.html" in capsys.readouterr().err
    page = Path("page.html").read_text(encoding="utf-8")
    assert "flights instead of one" in page
    assert page.count('data-mission="') == len(list(Path("across-parts").iterdir()))


@pytest.mark.parametrize("where", ["across.waypoints", str(Path("across-parts", "part-01.plan"))])
def test_a_page_takes_the_place_of_no_mission(across: str, where: str) -> None:
    before = Path(across).read_bytes()
    assert main(["split", across, *FITS, "--report", where]) == 2
    assert Path(across).read_bytes() == before
    assert not Path("across-parts").exists()


def test_a_refusal_says_by_how_much_the_shortest_flight_is_short(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, "--battery", "77Wh", "--reserve", "0%", "--format", "json"]) == 0
    [checked] = json.loads(capsys.readouterr().out)["missions"]
    needed_wh = checked["totals"]["energy_wh"]
    charge = f"{100.0 * needed_wh / 3.0 / 77.0:.4f}%"  # not enough to get up and down again
    asked = ["--battery", "77Wh", "--charge", charge, "--reserve", "0%"]
    assert main(["split", mission, *asked]) == 1
    told = re.search(
        r"it takes ([\d.]+) Wh, the battery has ([\d.]+) Wh above the reserve: ([\d.]+) Wh short",
        capsys.readouterr().err,
    )
    assert told is not None
    takes_wh, has_wh, short_wh = map(float, told.groups())
    assert has_wh == pytest.approx(needed_wh / 3.0, abs=0.005)
    assert short_wh == pytest.approx(takes_wh - has_wh, abs=0.011)
