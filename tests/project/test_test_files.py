"""No test stands where pytest does not look."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
FILES = [path for path in TESTS.rglob("*.py") if "__pycache__" not in path.parts]


def test_every_file_that_holds_tests_is_named_so_that_it_is_collected() -> None:
    holding = [
        path
        for path in FILES
        if re.search(r"^\s*(async )?def test_|^class Test", path.read_text("utf-8"), re.MULTILINE)
    ]
    assert len(holding) > 10
    assert [str(path) for path in holding if not path.name.startswith("test_")] == []


def test_every_file_named_as_a_test_holds_one() -> None:
    empty = [
        str(path)
        for path in FILES
        if path.name.startswith("test_")
        and not re.search(r"^\s*(async )?def test_", path.read_text("utf-8"), re.MULTILINE)
    ]
    assert empty == []


def test_no_two_files_share_a_name() -> None:
    names = Counter(path.name for path in FILES if path.name != "conftest.py")
    assert [name for name, number in names.items() if number > 1] == []
