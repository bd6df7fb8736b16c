"""Files written whole or not at all."""

from __future__ import annotations

import os
import stat
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from faulty_system import Command, faults_found, run

from planner.cli.guard import DecisionLog
from planner.errors import OutputError
from planner.files import refuse_unwritable, write_output_file, write_output_files
from planner.guard.authorisation import Verdict
from planner.guard.decision import Decision

if TYPE_CHECKING:
    from collections.abc import Callable


def test_a_text_replaces_the_one_before_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    write_output_file(path, "first\n")
    write_output_file(path, "°second\n")
    assert path.read_bytes() == "°second\n".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_program_left_is_taken_away_an_hour_later(tmp_path: Path) -> None:
    killed = Command("write", partial(_written, tmp_path / "a.json"), {})
    run(killed, tmp_path / "folder", at=2, fault="SIGKILL")
    [left] = tmp_path.glob(".mavjoule-*.part")
    kept = left.with_suffix(".before")
    kept.write_text("what was replaced", encoding="utf-8")
    write_output_file(tmp_path / "b.json", "while another may still write")
    assert left.exists()
    for one in (left, kept):
        os.utime(one, (0.0, time.time() - 3601.0))
    write_output_file(tmp_path / "b.json", "later")
    assert not left.exists()
    assert kept.exists()


def _written(path: Path) -> int:
    write_output_file(path, "text")
    return 0


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


NEW = {"a.plan": "new plan " * 2000, "b.params": "new parameters\n"}
"""The first is longer than a buffer: it is written by more than one call."""


def _ends(act: Callable[[], None]) -> int:
    """Return the exit code of a command that does this."""
    try:
        act()
    except OutputError:
        return 2
    return 0


def _write(*names: str) -> None:
    write_output_files({Path(name): NEW[name] for name in names})


def _append() -> None:
    log = DecisionLog(Path("guard.log"), address="udp:127.0.0.1:14550")
    log.add(Decision(kind="verdict", verdict=Verdict.GO, text="go"))


OLD = dict.fromkeys(NEW, b"old")
WRITERS = (
    Command("one", partial(_ends, partial(_write, "a.plan")), {"a.plan": b"old"}),
    Command("pair", partial(_ends, partial(_write, *NEW)), OLD, pairs=[tuple(NEW)]),
    Command(
        "half new pair",
        partial(_ends, partial(_write, *NEW)),
        {"b.params": b"old"},
        pairs=[tuple(NEW)],
    ),
    Command(
        "log", partial(_ends, _append), {"guard.log": b"{}\n"}, appends=frozenset({"guard.log"})
    ),
)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows forks no processes")
@pytest.mark.parametrize("writer", WRITERS, ids=lambda one: one.name)
def test_whatever_call_ends_a_writer_its_files_are_old_or_new(
    tmp_path: Path, writer: Command
) -> None:
    # Whole commands, and all of them, are tried by make fuzz.
    whole = run(writer, tmp_path / "folder", at=1_000_000, fault="none")
    assert whole.code == 0
    assert faults_found(writer, whole, whole, "none") == []
    for fault in ("SIGKILL", "SIGINT after") if writer.pairs else ("full disk", "read-only"):
        at, codes = 1, set[int]()
        while (ended := run(writer, tmp_path / "folder", at=at, fault=fault)).is_reached:
            assert faults_found(writer, whole, ended, fault) == [], f"{fault} at call {at}"
            codes.add(ended.code)
            at += 1
        # It is opened, written, synced and put in its place, and its folder is synced.
        assert at > (3 if writer.appends else 6)
        assert codes - {0} or writer.appends, "who is stopped does not say that it is done"


def test_a_pair_whose_second_cannot_be_placed_is_put_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, other = tmp_path / "a", tmp_path / "b"
    for path in (one, other):
        path.write_text("old", encoding="utf-8")

    whole, count = Path.replace, [0]

    def replace(path: Path, target: Path) -> Path:
        count[0] += 1
        if count[0] == 4:  # two are put aside, one is placed
            raise OSError(5, "Input/output error")
        return whole(path, target)

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(OutputError, match="b: cannot be written: Input/output error"):
        write_output_files({one: "new", other: "new"})
    assert {path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == {"old"}


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="pipes have no names here")
def test_a_pipe_behind_a_link_is_written_to() -> None:
    """As ``-o /dev/stdout | jq`` and ``-o >(jq)`` are: what the link leads to has no name."""
    reads, writes = os.pipe()
    try:
        path = Path(f"/dev/fd/{writes}")
        refuse_unwritable(path)
        write_output_file(path, "a report\n")
        assert os.read(reads, 100) == b"a report\n"
    finally:
        os.close(reads)
        os.close(writes)
