"""Which reader a file gets, and that none of them ends in a traceback."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import pytest
from dataflash_writer import copter_log
from hypothesis import given, settings
from hypothesis import strategies as st
from telemetry_writer import copter_telemetry
from thinning import examples
from ulog_writer import px4_log

from planner.errors import LogFileError
from planner.logs import files as log_files
from planner.logs.files import read_log

if TYPE_CHECKING:
    from pathlib import Path

WHOLE = log_files._recordings
SOUND = {
    "bin": copter_log().content(),
    "ulg": px4_log().content(),
    "tlog": copter_telemetry().content(),
}
MAGIC = {
    "ulg": b"ULog\x01\x12\x35\x00",
    "bin": b"\xa3\x95\x80",
    "text": b"FMT, ",
    "gz": b"\x1f\x8b",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


def test_the_record_names_its_file_by_content(tmp_path: Path) -> None:
    path = tmp_path / "any name at all"
    path.write_bytes(SOUND["bin"])
    [record] = read_log(path)
    assert record.source == str(path)
    assert record.sha256 == hashlib.sha256(SOUND["bin"]).hexdigest()


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "is empty"),
        (b"\x00" * 1000, "is not a known kind of log"),
        (b"just some words", "is not a known kind of log"),
        (b"\xf4\x01,\x93;\x02\xff" * 300, "is not a known kind of log"),
        (b"%PDF-1.7 and more\n", "is not a known kind of log"),
        (b'{"fileType": "Plan", "items": []}\n', "name them with --mapping"),
    ],
)
def test_what_is_no_log_is_refused_in_a_sentence(tmp_path: Path, content: bytes, told: str) -> None:
    (tmp_path / "x").write_bytes(content)
    with pytest.raises(LogFileError, match=told):
        read_log(tmp_path / "x")


def test_what_is_no_file_is_refused_in_a_sentence(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nothing", "with a \x00 zero"):
        with pytest.raises(LogFileError):
            read_log(path)


def _read_or_refuse(folder: Path, content: bytes) -> None:
    path = folder / "log"
    path.write_bytes(content)
    try:
        records = read_log(path)
    except LogFileError:
        return
    assert records
    for record in records:
        assert 0.0 <= record.duration_s < 86_400.0


@given(magic=st.sampled_from([b"", *MAGIC.values()]), rest=st.binary(max_size=400))
@settings(max_examples=examples(150), deadline=None)
def test_random_bytes_are_read_or_refused(folder: Path, magic: bytes, rest: bytes) -> None:
    _read_or_refuse(folder, magic + rest)


@given(
    kind=st.sampled_from(sorted(SOUND)),
    changes=st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=40)), max_size=8),
    kept=st.floats(0.1, 1.0),
)
@settings(max_examples=examples(60), deadline=None)
def test_damaged_logs_are_read_or_refused(
    folder: Path, kind: str, changes: list[tuple[float, bytes]], kept: float
) -> None:
    content = bytearray(SOUND[kind])
    for where, overwritten in changes:
        # Half of the damage falls on the definitions at the beginning.
        at = int(where**3 * len(content))
        content[at : at + len(overwritten)] = overwritten
    _read_or_refuse(folder, bytes(content[: int(kept * len(content))]))


def test_a_log_that_is_cut_off_while_it_is_read_is_read_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(SOUND["bin"])
    expected = read_log(path)

    def cut(*given: Any) -> Any:  # noqa: ANN401 - as it comes
        path.write_bytes(b"")  # of what is read in place nothing is there any more: SIGBUS
        return WHOLE(*given)

    monkeypatch.setattr("planner.logs.files._recordings", cut)
    [record], [known] = read_log(path), expected
    assert record.time_s.tolist() == known.time_s.tolist()
