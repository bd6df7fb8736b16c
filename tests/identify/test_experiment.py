"""The flights of an experiment: the article's courses, in files that read back."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from planner.cli.main import main
from planner.mission.files import read_mission

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import MissionItem

HOME = ("--home", "52.1", "21.0", "--home-amsl", "100")
DEGREE_M = 111_267.0
"""Of latitude at 52.1° on the ellipsoid of WGS84: 111132.95 − 559.85 cos 2φ + 1.18 cos 4φ. [m]"""


def items_of(path: Path) -> tuple[MissionItem, ...]:
    return read_mission(path).items


def test_the_article_s_two_flights_are_flown(tmp_path: Path) -> None:
    folder = tmp_path / "quad"
    size = ["--height", "400", "--levels", "4", "--hold", "120", "--direction", "0"]
    assert main(["experiment", "-o", str(folder), *HOME, *size]) == 0
    vertical = items_of(folder / "vertical.plan")
    assert [item.command for item in vertical] == [22, *[16] * 7, 21]
    assert [item.altitude_m for item in vertical[1:8]] == [100, 200, 300, 400, 300, 200, 100]
    assert {item.param1 for item in vertical[1:8]} == {120.0}
    assert {(item.latitude_deg, item.longitude_deg) for item in vertical} == {(52.1, 21.0)}
    horizontal = items_of(folder / "horizontal.plan")
    assert [item.command for item in horizontal] == [22, 16, 178, 16, 16, 21]
    assert (horizontal[2].param1, horizontal[2].param2) == (1.0, 10.0)
    assert {item.altitude_m for item in horizontal if item.command == 16} == {200.0}
    out_deg = horizontal[3].latitude_deg
    assert out_deg is not None
    assert (out_deg - 52.1) * DEGREE_M == pytest.approx(300.0, abs=0.05)
    assert horizontal[3].longitude_deg == pytest.approx(21.0, abs=1e-9)
    assert horizontal[4].latitude_deg == 52.1
    home = read_mission(folder / "vertical.plan").home
    assert home is not None
    assert home.altitude_amsl_m == 100.0


def test_every_speed_of_the_sweep_is_held_as_long(tmp_path: Path) -> None:
    size = ["--speed", "8", "--leg", "240", "--direction", "90", "--autopilot", "px4"]
    assert main(["experiment", "-o", str(tmp_path), *HOME, *size]) == 0
    sweep = items_of(tmp_path / "speed-sweep.plan")
    speeds = [item.param2 for item in sweep if item.command == 178]
    assert speeds == pytest.approx([1.6, 3.2, 4.8, 6.4, 8.0])
    east_m = [
        (item.longitude_deg - 21.0) * 111_320.0 * math.cos(math.radians(52.1))
        for item in sweep[2:-1]
        if item.command == 16 and item.longitude_deg is not None
    ]
    # 30 s at each; the sphere's degree of longitude is 0.2 % short of the ellipsoid's
    assert east_m[0::2] == pytest.approx([48.0, 96.0, 144.0, 192.0, 240.0], rel=3e-3)
    assert east_m[1::2] == pytest.approx([0.0] * 5, abs=0.02)


@pytest.mark.parametrize(
    ("vehicle", "battery"), [("arducopter-sitl-quad", "200Wh"), ("px4-quad-2kg", "150Wh")]
)
def test_they_are_a_go_for_who_can_fly_them(
    vehicle: str, battery: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["experiment", "-o", str(tmp_path), *HOME]) == 0
    out = capsys.readouterr().out
    assert "LOG_BITMASK" in out
    assert f" -o {tmp_path}.toml --mass" in " ".join(out.split())
    files = [str(path) for path in sorted(tmp_path.glob("*.plan"))]
    assert len(files) == 3
    assert main(["check", *files, "--vehicle", vehicle, "--battery", battery]) == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--leg", "200"], "too short to hold 10 m/s for 15 s: give --leg 250"),
        (["--home", "91", "0"], "91"),
        (["--levels", "1"], "levels"),
    ],
)
def test_what_cannot_be_flown_is_refused(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["experiment", "-o", str(tmp_path / "new"), *HOME, *options]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_missions_that_are_there_are_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "horizontal.plan").write_text("mine", encoding="utf-8")
    assert main(["experiment", "-o", str(tmp_path), *HOME]) == 2
    assert "horizontal.plan exists already" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["horizontal.plan"]
    assert main(["experiment", "-o", str(tmp_path), *HOME, "--force"]) == 0
    assert len(items_of(tmp_path / "horizontal.plan")) == 6
