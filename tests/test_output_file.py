"""Files written whole or not at all."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any

import pytest

from planner.errors import OutputError
from planner.files import write_output_file, write_output_files


def test_a_text_replaces_the_one_before_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    write_output_file(path, "first\n")
    write_output_file(path, "°second\n")
    assert path.read_bytes() == "°second\n".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_a_text_that_cannot_be_written_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "report.json"
    path.write_text("old", encoding="utf-8")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OutputError, match=r"report\.json: cannot be written: No space left"):
        write_output_file(path, "new")
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="No such file or directory"):
        write_output_file(tmp_path / "nowhere" / "report.json", "text")


def test_a_link_is_followed_and_stays(tmp_path: Path) -> None:
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    real.write_text("old", encoding="utf-8")
    link.symlink_to(real)
    write_output_file(link, "new")
    assert link.is_symlink()
    assert real.read_text(encoding="utf-8") == "new"


def test_a_device_is_written_to_and_not_replaced() -> None:
    write_output_file(Path(os.devnull), "text")
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps no permission bits")
def test_the_permissions_of_a_replaced_file_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "shared.plan"
    path.write_text("old", encoding="utf-8")
    path.chmod(0o640)
    write_output_file(path, "new")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


CALLS = (
    *((Path, name) for name in ("open", "replace", "chmod", "hardlink_to", "exists", "is_file")),
    *((os, name) for name in ("fsync", "open", "close", "urandom")),
)
"""Every call to the system on the way of a file to its place."""


def _failing_at(number: int, error: BaseException, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Make one of the calls fail, counted over all of them; return the count."""
    seen = [0]

    def failing(whole: Any) -> Any:  # noqa: ANN401 - whatever is called
        def call(*given: Any, **more: Any) -> Any:  # noqa: ANN401 - as above
            seen[0] += 1
            if seen[0] == number:
                raise error
            return whole(*given, **more)

        return call

    for owner, name in CALLS:
        monkeypatch.setattr(owner, name, failing(getattr(owner, name)))
    return seen


@pytest.mark.parametrize(
    "error",
    [OSError(28, "No space left on device"), PermissionError(13, "denied"), KeyboardInterrupt()],
)
@pytest.mark.parametrize("names", [["a.plan"], ["a.plan", "a.params"]], ids=len)
@pytest.mark.parametrize("is_new", [True, False])
def test_of_a_pair_both_are_old_or_both_are_new_whatever_call_fails(
    tmp_path: Path, *, names: list[str], is_new: bool, error: BaseException
) -> None:
    new = {tmp_path / name: f"new {name}" for name in names}
    old = {} if is_new else dict.fromkeys(new, "old")
    failed, number = 0, 0
    while True:
        number += 1
        for path in new:
            path.unlink(missing_ok=True)
        for path, text in old.items():
            path.write_text(text, encoding="utf-8")
        with pytest.MonkeyPatch.context() as patch:
            seen = _failing_at(number, error, patch)
            try:
                write_output_files(new)
            except (OutputError, KeyboardInterrupt):
                failed += 1
            was_reached = seen[0] >= number
        found = {path: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
        assert found in (old, new), f"call {number}"
        if not was_reached:
            break
    assert failed >= 6 * len(names), "each is opened, synced, asked for and put in its place"


def test_a_pair_on_a_file_system_without_links_is_put_back_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, other = tmp_path / "a", tmp_path / "b"
    for path in (one, other):
        path.write_text("old", encoding="utf-8")

    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    whole, count = Path.replace, [0]

    def replace(path: Path, target: Path) -> Path:
        count[0] += 1
        if count[0] == 2:
            raise OSError(5, "Input/output error")
        return whole(path, target)

    monkeypatch.setattr(Path, "hardlink_to", refuse)
    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(OutputError, match="b: cannot be written: Input/output error"):
        write_output_files({one: "new", other: "new"})
    assert {path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == {"old"}
