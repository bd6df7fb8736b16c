from __future__ import annotations

from pathlib import Path

import pytest

import planner
from planner.cli.main import main


def test_a_mission_is_written_and_nothing_goes_to_standard_output(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", mission, "there.plan"]) == 0
    assert main(["convert", "there.plan", "back.waypoints"]) == 0
    said = capsys.readouterr()
    assert said.out == ""
    assert (
        "mavjoule: there.plan: L213 areas-taken-for-none [warning] the text does not say"
        in said.err
    )
    assert "mavjoule: 3 items of out.waypoints written to there.plan" in said.err.splitlines()
    assert "mavjoule: back.waypoints: L204 keys-not-written [info] " in said.err
    first, second = (planner.read_mission(name).items for name in (mission, "back.waypoints"))
    assert first == second


def test_a_mission_is_not_written_over_itself(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = Path(mission).read_bytes()
    assert main(["convert", mission, f"./{mission}"]) == 2
    assert "give another file to write to" in capsys.readouterr().err
    assert Path(mission).read_bytes() == before


@pytest.mark.parametrize("target", ["there.kml", "no/such/folder/there.plan"])
def test_a_target_that_cannot_be_written_is_a_sentence(
    target: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", mission, target]) == 2
    assert capsys.readouterr().err.startswith(f"mavjoule: {target}: ")


def test_a_broken_mission_is_a_sentence(broken: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", broken, "there.plan"]) == 2
    assert capsys.readouterr().err.startswith("mavjoule: broken.plan:1:")
    assert not Path("there.plan").exists()


def test_a_file_that_exists_is_written_over_only_by_force(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("there.plan").write_text("mine", encoding="utf-8")
    assert main(["convert", mission, "there.plan"]) == 2
    assert capsys.readouterr().err == (
        "mavjoule: there.plan exists: give another file, or --force to overwrite it\n"
    )
    assert Path("there.plan").read_text(encoding="utf-8") == "mine"
    assert main(["convert", "--force", mission, "there.plan"]) == 0
    assert len(planner.read_mission("there.plan").items) == 3


def test_a_mission_is_written_with_another_speed_and_flies_as_checked_with_it(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", mission, "slow.waypoints", "--speed", "6"]) == 0
    vehicle = planner.load_vehicle("falkowski-2023-quadrotor")
    asked = planner.check(planner.read_mission(mission), vehicle, speed_m_s=6.0)
    written = planner.check(planner.read_mission("slow.waypoints"), vehicle)
    assert written.totals == asked.totals
    capsys.readouterr()
    assert main(["convert", mission, "none.plan", "--speed", "0"]) == 2
    assert "above 0 and at most 100 m/s" in capsys.readouterr().err


def test_what_made_a_mission_a_no_go_and_is_not_written_is_no_success(
    capsys: pytest.CaptureFixture[str],
) -> None:
    # An area of which nothing says whether to stay in or out, which a plan would have to.
    ring = "8.001,47.001,0 8.002,47.001,0 8.002,47.002,0 8.001,47.001,0"
    Path("area.kml").write_text(
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><LineString>'
        "<altitudeMode>absolute</altitudeMode><coordinates>8,47,450 8,47.001,450</coordinates>"
        "</LineString></Placemark><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>"
        f"{ring}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></Document></kml>",
        encoding="utf-8",
    )
    assert main(["convert", "area.kml", "area.plan"]) == 1
    assert "F115" in capsys.readouterr().err
    assert Path("area.plan").exists()
