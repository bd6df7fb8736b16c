"""Findings that are known, and everything that makes one another finding."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from planner.errors import BaselineFileError, OutputError
from planner.findings import Finding, Place, Severity
from planner.selection import Selection, read_baseline, write_baseline
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

BUFFER = Finding(
    code="M122",
    name="too-far-for-site",
    severity=Severity.ERROR,
    message="the stop takes 21.4 m, the fence is 14.0 m away",
    item=6,
    place=Place(line=41, column=9),
)

REST = '"code": "M122", "severity": "error", "message": "so it is"'


def _knows(folder: Path, finding: Finding, *, file: str | None = None) -> bool:
    baseline = read_baseline(folder / "known.json")
    return baseline.holds(finding, file=file or str(folder / "site.plan"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder whose baseline knows one finding of ``site.plan``."""
    assert write_baseline(tmp_path / "known.json", [(str(tmp_path / "site.plan"), BUFFER)]) == (
        1,
        0,
    )
    return tmp_path


def test_a_finding_that_was_written_is_known(folder: Path) -> None:
    assert _knows(folder, BUFFER)


def test_a_finding_that_moved_in_the_file_is_still_known(folder: Path) -> None:
    assert _knows(folder, replace(BUFFER, place=Place(line=99, column=1), fix="else"))


@pytest.mark.parametrize(
    "other",
    [
        replace(BUFFER, message="the stop takes 21.5 m, the fence is 14.0 m away"),
        replace(BUFFER, severity=Severity.WARNING),
        replace(BUFFER, item=7),
        replace(BUFFER, item=None),
        replace(BUFFER, code="A114"),
    ],
    ids=["a number", "the severity", "the item", "no item", "the code"],
)
def test_a_finding_that_changed_is_not_known(folder: Path, other: Finding) -> None:
    assert not _knows(folder, other)


def test_a_finding_is_known_of_its_own_file_from_wherever_it_is_named(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not _knows(folder, BUFFER, file=str(folder / "other.plan"))
    (folder / "deep").mkdir()
    monkeypatch.chdir(folder / "deep")
    assert _knows(folder, BUFFER, file="../site.plan")
    assert not _knows(folder, BUFFER, file="site.plan")


def test_a_mission_from_standard_input_has_its_own_place(tmp_path: Path) -> None:
    write_baseline(tmp_path / "known.json", [("-", BUFFER)])
    assert _knows(tmp_path, BUFFER, file="-")
    assert not _knows(tmp_path, BUFFER)


def test_an_error_of_energy_is_never_known(tmp_path: Path) -> None:
    path = tmp_path / "known.json"
    short = replace(BUFFER, code="E101", message="short by 2.8 Wh")
    outside = replace(short, code="E105", severity=Severity.WARNING)
    found = [(str(tmp_path / "site.plan"), one) for one in (short, outside, BUFFER)]
    assert write_baseline(path, found) == (2, 1)
    document = json.loads(path.read_text(encoding="utf-8"))
    assert [one["code"] for one in document["known"]] == ["E105", "M122"]
    assert _knows(tmp_path, outside)
    # Not even where someone has written it in.
    document["known"].append(
        document["known"][0] | {"code": "E101", "severity": "error", "message": short.message}
    )
    path.write_text(json.dumps(document), encoding="utf-8")
    assert not _knows(tmp_path, short)


def test_what_is_known_is_not_reported_but_told_with_its_reason(folder: Path) -> None:
    baseline = read_baseline(folder / "known.json")
    worse = replace(BUFFER, message="the stop takes 30.0 m, the fence is 14.0 m away")
    reported, suppressed = Selection(baseline=baseline).divide(
        [BUFFER, worse], file=str(folder / "site.plan")
    )
    assert reported == (worse,)
    assert suppressed == (replace(BUFFER, suppression=f"known from {folder / 'known.json'}"),)


def test_a_baseline_is_sorted_text_with_paths_from_its_folder(tmp_path: Path) -> None:
    found = [(str(tmp_path / "b" / "x.plan"), BUFFER), (str(tmp_path / "a.plan"), BUFFER)]
    path = tmp_path / "known.json"
    write_baseline(path, found)
    text = path.read_text(encoding="utf-8")
    assert [one["file"] for one in json.loads(text)["known"]] == ["a.plan", "b/x.plan"]
    write_baseline(path, reversed(found))
    assert path.read_text(encoding="utf-8") == text


def test_a_baseline_that_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        write_baseline(tmp_path / "nowhere" / "known.json", [("-", BUFFER)])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{", "is not JSON"),
        ("[" * 100_000, "is not a baseline"),
        ("[]", "is not a baseline"),
        ("{}", "is not a baseline"),
        ('{"schema": 2, "known": []}', "is not a baseline"),
        ('{"schema": 1, "known": 1}', "is not a baseline"),
        ('{"schema": 1, "known": [1]}', "is not a baseline"),
        ('{"schema": 1, "known": [{"file": "a"}]}', "is not a baseline"),
        (f'{{"schema": 1, "known": [{{"file": 1, "item": 0, {REST}}}]}}', "is not a baseline"),
        (f'{{"schema": 1, "known": [{{"file": "a", "item": [], {REST}}}]}}', "is not a baseline"),
    ],
    ids=range(10),
)
def test_a_file_that_is_no_baseline_is_refused_in_a_sentence(
    tmp_path: Path, text: str, sentence: str
) -> None:
    path = tmp_path / "known.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BaselineFileError, match=sentence) as caught:
        read_baseline(path)
    assert str(caught.value).startswith(str(path))


def test_a_baseline_that_is_no_text_or_is_not_there_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "known.json"
    with pytest.raises(BaselineFileError, match="cannot be read"):
        read_baseline(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BaselineFileError, match="is not JSON"):
        read_baseline(path)
