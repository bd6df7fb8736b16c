"""The extras of the installation: declared once more in the package, to be named where one is missing."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.main import main
from planner.errors import EXTRAS, missing_library

if TYPE_CHECKING:
    import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DISTRIBUTIONS = {"serial": "pyserial", "vl_convert": "vl-convert-python"}
"""Modules that are called otherwise than what is installed."""


def test_every_extra_is_known_by_its_modules() -> None:
    asked = {
        extra: {re.split("[>=<]", one)[0] for one in listed}
        for extra, listed in PROJECT["optional-dependencies"].items()
        if extra != "all"
    }
    assert asked == {
        extra: {DISTRIBUTIONS.get(module, module) for module in modules}
        for extra, modules in EXTRAS.items()
    }


def test_all_extras_are_installed_by_one_name() -> None:
    assert PROJECT["optional-dependencies"]["all"] == [f"mavjoule[{','.join(sorted(EXTRAS))}]"]


def test_a_command_names_the_extra_it_lacks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in [name for name in sys.modules if name.split(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "scipy", None)
    fleet = ROOT / "missions" / "fleets" / "search-by-four.toml"
    assert main(["fleet", "simulate", str(fleet)]) == 2
    assert capsys.readouterr().err == (
        "mavjoule: scipy is not installed: pip install 'mavjoule[fleet]'\n"
    )


def test_a_module_of_our_own_that_is_missing_stays_a_bug() -> None:
    assert missing_library(ModuleNotFoundError("no", name="planner.gone")) is None
    assert missing_library(ValueError()) is None


def test_the_readme_names_every_extra() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    _, _, named = readme.partition("Extras bring ")
    named, _, _ = named.partition("`pip install")
    assert set(re.findall(r"`(\w+)`(?:\s\(|,)", re.sub(r"\([^)]*\)", "()", named))) == EXTRAS.keys()
