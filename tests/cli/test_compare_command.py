"""``mavjoule compare``."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest

from planner.cli.main import main

if TYPE_CHECKING:
    from pathlib import Path


def test_the_options_of_b_are_over_those_of_both(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    both = ["--vehicle", "arducopter-sitl-quad", "--wind", "2@0", "--format", "json"]
    assert main(["compare", mission, *both, "--b", "--wind 8@0 --reserve 30%"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["a"]["battery"]["reserve_fraction"] == 0.2
    assert document["b"]["battery"]["reserve_fraction"] == 0.3
    assert document["b"]["vehicle"]["name"] == "arducopter-sitl-quad"
    assert document["difference"]["energy_wh"] == pytest.approx(
        document["b"]["totals"]["energy_wh"] - document["a"]["totals"]["energy_wh"]
    )
    assert document["difference"]["energy_wh"] > 0.0
    assert document["b"]["options"] == "--wind 8@0 --reserve 30%"


def test_two_vehicles_side_by_side(mission: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["compare", mission, "--battery", "77Wh", "--b", "--vehicle arducopter-sitl-quad"])
        == 0
    )
    said = capsys.readouterr()
    assert f"B  {mission} --vehicle arducopter-sitl-quad\n" in said.out
    for name in ("verdict", "time", "energy", "above the reserve", "cruise", "Only in A"):
        assert f"\n{name} " in said.out or f"\n{name}\n" in said.out
    assert said.err == ""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "give B or --b"),
        (["--b", "--wind fast"], "expected speed and the direction"),
        (["--b", "--wind '8@270"], "--b: No closing quotation"),
        (["--b", "--nothing 3"], "--b: No such option"),
        (["no-such.plan"], "no-such.plan: no such file"),
    ],
)
def test_what_cannot_be_compared_is_a_sentence(
    arguments: list[str], said: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", mission, *arguments]) == 2
    shown = capsys.readouterr()
    assert said in shown.err
    assert shown.out == ""


def test_a_page_sets_both_side_by_side(
    mission: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "both.html"
    options = ["--vehicle", "arducopter-sitl-quad", "--b", "--wind 8@0", "--format", "json"]
    assert main(["compare", mission, *options, "--report", str(page)]) == 0
    difference = json.loads(capsys.readouterr().out)["difference"]["energy_wh"]
    text = page.read_text("utf-8")
    assert ">Compared</h2>" in text
    values = [float(value) for value in re.findall(r'<data value="([-+0-9.e]+)"', text)]
    assert any(value == pytest.approx(difference, rel=1e-9) for value in values)


def test_a_page_does_not_take_the_place_of_a_mission(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", mission, "--b", "--wind 8@0", "--report", mission]) == 2
    assert "is read in this call" in capsys.readouterr().err
