"""Files that could not be written at the end are refused before anything is done."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.cli.main import main

MISSION = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t50.0\t20.0\t200\t1
1\t0\t3\t22\t0\t0\t0\t0\t50.0\t20.0\t30\t1
2\t0\t3\t16\t0\t0\t0\t0\t50.001\t20.0\t30\t1
3\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""
FLEET = '[vehicle.x]\nmodel = "missing-model"\n'


@pytest.fixture(autouse=True)
def _files() -> None:
    Path("m.waypoints").write_text(MISSION, encoding="utf-8")
    Path("fleet.toml").write_text(FLEET, encoding="utf-8")
    Path("folder.html").mkdir()


@pytest.mark.parametrize("file", ["nowhere/x.html", "folder.html", "m.waypoints/x.html"])
@pytest.mark.parametrize(
    "call",
    [
        "check m.waypoints --report",
        "check m.waypoints --output",
        "segments m.waypoints --output",
        "speed m.waypoints --output",
        "split m.waypoints --report",
        "compare m.waypoints --b --speed=3 --report",
        "compare m.waypoints --b --speed=3 --output",
        "sweep m.waypoints --vary wind=0,5 --report",
        "fleet check fleet.toml --report",
        "fleet plan fleet.toml -o parts --report",
        "fleet simulate fleet.toml --report",
        "fleet simulate fleet.toml --agents 1:3 --output",
    ],
)
def test_a_file_that_cannot_be_written_is_refused_at_once(
    call: str, file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    # nothing is checked before: neither the verdict nor the model that is missing is told
    assert main([*call.split(), file]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"mavjoule: {file}: cannot be written: ")
    assert len(said.err.splitlines()) == 1


def test_files_in_a_folder_that_the_call_makes_are_written() -> None:
    options = ["--vehicle", "px4-quad-2kg", "--battery", "6Ah@22.2V"]
    plots = ["--plots", "pictures", "--output", "pictures/curve.csv", "--format", "csv"]
    assert main(["speed", "m.waypoints", *options, *plots]) == 0
    assert Path("pictures", "curve.csv").read_text("utf-8").count("\n") > 2
    page = ["--report", "parts/page.html", "-o", "parts"]
    assert main(["split", "m.waypoints", *options, *page]) in {0, 1}
    assert Path("parts", "page.html").exists() == Path("parts").exists()


def test_a_device_is_written_to() -> None:
    assert main(["segments", "m.waypoints", "--output", "/dev/null"]) == 0
