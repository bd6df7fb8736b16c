"""What a check draws and writes beside its report: ``--report`` and ``--plots``."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import pytest

from planner.cli.main import main


def test_a_page_is_written_beside_the_report(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, "--battery", "77Wh", "--report", "page.html"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("GO")
    assert "page.html" in err
    page = Path("page.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>")
    assert hashlib.sha256(Path(mission).read_bytes()).hexdigest() in page


def test_several_missions_share_a_page(mission: str, broken: str) -> None:
    assert main(["check", mission, broken, "--battery", "77Wh", "--report", "page.html"]) == 2
    assert 'id="overview"' in Path("page.html").read_text(encoding="utf-8")


def test_pictures_are_drawn_as_svg_and_png(mission: str) -> None:
    assert main(["check", mission, "--battery", "77Wh", "--plots", "drawn"]) == 0
    names = {f"{name}.{kind}" for kind in ("svg", "png") for name in _PICTURES}
    assert {path.name for path in Path("drawn").iterdir()} == names


_PICTURES = ("map", "altitude", "speed", "power", "energy")


def test_pictures_of_what_is_not_flown_are_not_drawn(
    broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", broken, "--plots", "drawn"]) == 2
    assert "nothing is drawn" in capsys.readouterr().err
    assert not Path("drawn").exists()


def test_pictures_of_two_missions_are_refused(
    mission: str, broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, broken, "--plots", "drawn"]) == 2
    assert "--plots takes a single mission" in capsys.readouterr().err


def test_a_page_does_not_take_the_place_of_another_file(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = Path(mission).read_bytes()
    assert main(["check", mission, "--report", mission]) == 2
    assert main(["check", mission, "--report", "one", "--output", "one"]) == 2
    assert "--output and --report name the same file" in capsys.readouterr().err
    assert Path(mission).read_bytes() == before
    assert not Path("one").exists()


@pytest.mark.parametrize("option", ["--report", "--plots"])
def test_a_missing_library_is_told_before_anything_is_checked(
    mission: str, option: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "altair", None)  # an import of it fails
    assert main(["check", mission, option, "somewhere"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "pip install 'mavjoule[report]'" in err
    assert not Path("somewhere").exists()
