"""The recipes of ``mavjoule help recipes`` run as they are written."""

from __future__ import annotations

import doctest
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from dataflash_writer import copter_log

if TYPE_CHECKING:
    import pytest

ROOT = Path(__file__).parents[2]
RECIPES = ROOT / "planner" / "report" / "topics" / "recipes.md"


def test_the_recipes_run_as_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "missions", "missions")
    Path("cruise.BIN").write_bytes(copter_log().content())
    text = RECIPES.read_text(encoding="utf-8")
    recipes = doctest.DocTestParser().get_doctest(text, {}, RECIPES.name, str(RECIPES), 0)
    told: list[str] = []
    done = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(recipes, out=told.append)
    assert done.attempted > 20
    assert not done.failed, "".join(told)
