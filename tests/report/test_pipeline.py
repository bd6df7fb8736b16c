"""Where a pipeline finds a mission, and how it knows a finding again."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.findings import Finding, Place, Severity
from planner.report.pipeline import fingerprints, pipeline_path
from planner.values import replace

SHORT = Finding(
    code="E101",
    name="reserve-below-minimum",
    severity=Severity.ERROR,
    message="needs 24.1 Wh, 15.4 Wh are there: short by 8.7 Wh",
    item=7,
    place=Place(line=41, column=9),
)


@pytest.mark.parametrize(
    ("file", "path"),
    [
        ("site.plan", "site.plan"),
        ("./deep//site.plan", "deep/site.plan"),
        ("deep/../site.plan", "site.plan"),
        ("/repository/deep/site.plan", "deep/site.plan"),
        ("/elsewhere/site.plan", "/elsewhere/site.plan"),
        ("/repository-2/site.plan", "/repository-2/site.plan"),
        ("../site.plan", "../site.plan"),
        ("-", "-"),
    ],
)
def test_a_path_counts_from_the_folder_of_the_call(file: str, path: str) -> None:
    assert pipeline_path(file, folder=Path("/repository")) == path


def test_a_fingerprint_outlives_numbers_lines_and_severity() -> None:
    later = replace(
        SHORT,
        message="needs 25.9 Wh, 15.4 Wh are there: short by 10.5 Wh",
        place=Place(line=50, column=1),
        severity=Severity.WARNING,
        fix="else",
    )
    assert fingerprints([SHORT], path="a.plan") == fingerprints([later], path="a.plan")


@pytest.mark.parametrize(
    "other",
    [
        replace(SHORT, code="E102"),
        replace(SHORT, item=8),
        replace(SHORT, item=None),
        replace(SHORT, message="needs 24.1 Wh, 15.4 Wh are there: lacks 8.7 Wh"),
    ],
    ids=["code", "item", "no item", "words"],
)
def test_a_fingerprint_tells_findings_apart(other: Finding) -> None:
    assert fingerprints([SHORT], path="a.plan") != fingerprints([other], path="a.plan")


def test_a_fingerprint_tells_files_apart() -> None:
    assert fingerprints([SHORT], path="a.plan") != fingerprints([SHORT], path="b.plan")


def test_findings_that_agree_in_everything_are_counted() -> None:
    first, second = fingerprints([SHORT, replace(SHORT, place=None)], path="a.plan")
    assert first != second
    assert first.removesuffix(":1") == second.removesuffix(":2")


def test_a_file_name_that_is_no_text_has_a_fingerprint() -> None:
    [mark] = fingerprints([SHORT], path="caf\udce9.plan")
    assert mark.isascii()
