"""Logs off a vehicle: whole, in order, going on where a download broke off."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest
from file_servers import ArdupilotFiles, Px4Files
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.errors import LinkError
from planner.link.files import (
    _HEAD,
    ChunkStream,
    FileDownload,
    FileNumbers,
    FilePacket,
    FileRefusedError,
    FolderListing,
    Operation,
)
from planner.link.logs import LogDownload, LogListing, VehicleLog
from planner.link.transfers import LinkSettings
from planner.link.wire import Message

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.link.transfers import Transfer

CONTENT = random.Random(3).randbytes(20_001)
LOG = VehicleLog(name="a.bin", size_bytes=len(CONTENT), number=4)


def _run(
    transfer: Transfer, serve: Callable[[Message], list[Message]], *, loss: float, seed: int
) -> None:
    """Run a transfer against a server, in time that passes only while nothing comes."""
    drawn = random.Random(seed)
    now_s = 0.0
    sent = list(transfer.begin(now_s))
    for _ in range(200_000):
        if transfer.is_done:
            return
        answers = [
            answer
            for request in sent
            if drawn.random() >= loss
            for answer in serve(request)
            if drawn.random() >= loss
        ]
        drawn.shuffle(answers)
        sent = []
        for answer in answers:
            now_s += 0.001
            sent += transfer.feed(answer, now_s)
        if not sent and not transfer.is_done:
            now_s = transfer.deadline_s
            sent = list(transfer.expire(now_s))
    pytest.fail("the transfer goes on without end")


def _log_data(request: Message) -> list[Message]:
    if request.name != "LOG_REQUEST_DATA":
        return []
    start, end = request["ofs"], min(request["ofs"] + request["count"], len(CONTENT))
    return [
        Message(
            name="LOG_DATA",
            fields={"id": 4, "ofs": at, "count": len(part), "data": part.ljust(90, b"\0")},
        )
        for at in range(start, end, 90)
        for part in [CONTENT[at : min(at + 90, end)]]
    ]


FILES = {
    "/log/2026/b.bin": bytes(7),
    "/log/a.bin": CONTENT,
    "/log/b.txt": b"no log of it",
    "/log/c.bin": CONTENT[::-1],
}
STACKS = pytest.mark.parametrize("stack", [Px4Files, ArdupilotFiles])


def _download(path: str, got: bytearray, numbers: FileNumbers, *, start: int = 0) -> FileDownload:
    return FileDownload(path, start, got.extend, LinkSettings(), numbers)


@given(seed=st.integers(0, 10**6), start=st.integers(0, len(CONTENT)))
@settings(max_examples=examples(15), deadline=None)
def test_the_log_protocol_brings_a_log_whole_through_loss(seed: int, start: int) -> None:
    got = bytearray(CONTENT[:start])
    _run(LogDownload(LOG, start, got.extend, LinkSettings()), _log_data, loss=0.2, seed=seed)
    assert bytes(got) == CONTENT


@STACKS
@given(seed=st.integers(0, 10**6), start=st.integers(0, len(CONTENT)))
@settings(max_examples=examples(10), deadline=None)
def test_the_file_protocol_brings_files_whole_through_loss(
    stack: type[Px4Files | ArdupilotFiles], seed: int, start: int
) -> None:
    server, numbers = stack(FILES), FileNumbers(seed & 0xFFFF)
    got, second = bytearray(CONTENT[:start]), bytearray()
    _run(_download("/log/a.bin", got, numbers, start=start), server, loss=0.2, seed=seed)
    # Its end may have been lost: it is still open, and PX4 opens one.
    _run(_download("/log/c.bin", second, numbers), server, loss=0.2, seed=seed)
    assert bytes(got) == CONTENT
    assert bytes(second) == CONTENT[::-1]


def test_a_log_of_20_mb_comes_whole_though_the_numbers_of_its_pieces_wrap() -> None:
    """83,683 pieces of 239 bytes: their 16-bit numbers come around, and half around before (7.8 MB)."""
    large = random.Random(4).randbytes(20_000_000)
    numbers, written = FileNumbers(60_000), bytearray()
    download = _download("/log/a.bin", written, numbers)
    # What ArduPilot answers, without the objects of its server: those take seconds.
    payload_at: dict[Operation, Callable[[int], list[tuple[bytes, int, bool]]]] = {
        Operation.OPEN_FILE_RO: lambda _: [(len(large).to_bytes(4, "little"), 0, False)],
        Operation.BURST_READ_FILE: lambda start: [
            (large[at : at + 239], at, at == start + 1999 * 239)
            for at in range(start, min(start + 2000 * 239, len(large)), 239)
        ],
        Operation.TERMINATE_SESSION: lambda _: [],
    }
    sent, now_s = list(download.begin(0.0)), 0.0
    while sent:
        number, _, operation, *_, offset = _HEAD.unpack_from(bytes(sent.pop()["payload"]))
        for later, (piece, at, is_last) in enumerate(payload_at[Operation(operation)](offset), 1):
            now_s += 0.001
            head = _HEAD.pack((number + later) & 0xFFFF, 1, 128, len(piece), operation, is_last, at)
            answer = Message(name="FILE_TRANSFER_PROTOCOL", fields={"payload": head + piece})
            sent += download.feed(answer, now_s)
    assert download.is_done
    assert written == large


@STACKS
def test_a_folder_is_listed_with_sizes(stack: type[Px4Files | ArdupilotFiles]) -> None:
    listing = FolderListing("/log", LinkSettings(), FileNumbers(65_533))
    _run(listing, stack(FILES), loss=0.2, seed=4)
    assert listing.files == {"a.bin": len(CONTENT), "b.txt": 12, "c.bin": len(CONTENT)}
    assert listing.folders == ["2026"]


@STACKS
def test_after_a_folder_that_is_not_there_another_one_is_found(
    stack: type[Px4Files | ArdupilotFiles],
) -> None:
    # PX4 repeats what it said last to whoever asks by the same number.
    server, numbers = stack(FILES), FileNumbers(7)
    with pytest.raises(FileRefusedError, match="no folder /nowhere"):
        _run(FolderListing("/nowhere", LinkSettings(), numbers), server, loss=0.0, seed=1)
    listing = FolderListing("/log", LinkSettings(), numbers)
    _run(listing, server, loss=0.0, seed=1)
    assert listing.folders == ["2026"]


def test_a_long_folder_takes_one_session_of_ardupilot() -> None:
    files = {f"/log/{number}.bin": b"" for number in range(40)}
    server = ArdupilotFiles(files)
    listing = FolderListing("/log", LinkSettings(), FileNumbers(0))
    _run(listing, server, loss=0.0, seed=1)
    assert len(listing.files) == 40
    assert len(server.sessions) == 1


def test_a_file_that_another_program_left_open_is_opened_all_the_same() -> None:
    server, got = Px4Files(FILES, is_open=True), bytearray()
    _run(_download("/log/a.bin", got, FileNumbers(0)), server, loss=0.0, seed=1)
    assert bytes(got) == CONTENT


@STACKS
def test_a_file_that_is_closed_under_our_hands_is_opened_again(
    stack: type[Px4Files | ArdupilotFiles],
) -> None:
    server, got = stack(FILES), bytearray()

    def forgetful(request: Message) -> list[Message]:
        if len(server.requests) in {4, 9}:
            server.answers(FilePacket(number=0, operation=Operation.RESET_SESSIONS))
        return server(request)

    _run(_download("/log/a.bin", got, FileNumbers(100)), forgetful, loss=0.0, seed=1)
    assert bytes(got) == CONTENT
    assert server.requests.count(Operation.OPEN_FILE_RO) >= 3


def test_a_vehicle_that_never_opens_is_given_up() -> None:
    class _Full(Px4Files):
        def answers(self, asked: FilePacket) -> list[FilePacket]:
            self.opened = b""
            said = super().answers(asked)
            self.opened = b""
            return said

    download = _download("/log/a.bin", bytearray(), FileNumbers(0))
    with pytest.raises(FileRefusedError, match="is another ground station reading files"):
        _run(download, _Full(FILES), loss=0.0, seed=1)


def test_a_file_that_is_not_there_is_refused() -> None:
    download = _download("/nothing", bytearray(), FileNumbers(0))
    with pytest.raises(FileRefusedError, match="does not open /nothing"):
        _run(download, Px4Files(FILES), loss=0.0, seed=1)


def test_a_list_that_is_never_complete_stalls() -> None:
    def claiming(_: Message) -> list[Message]:
        fields = {"id": 1, "num_logs": 3, "last_log_num": 3, "size": 9, "time_utc": 0}
        return [Message(name="LOG_ENTRY", fields=fields)]

    with pytest.raises(LinkError, match="list of logs stalled at 1 of 3"):
        _run(LogListing(LinkSettings()), claiming, loss=0.0, seed=1)


def test_a_file_that_is_longer_than_it_can_be_read_stalls() -> None:
    claimed = VehicleLog(name="a.bin", size_bytes=len(CONTENT) + 5, number=4)
    download = LogDownload(claimed, 0, bytearray().extend, LinkSettings())
    with pytest.raises(LinkError, match="stalled at 20001 of 20006 bytes; what came is kept"):
        _run(download, _log_data, loss=0.0, seed=1)


def test_a_list_of_no_logs_is_empty() -> None:
    listing = LogListing(LinkSettings())
    listing.begin(0.0)
    fields = {"id": 0, "num_logs": 0, "last_log_num": 0, "size": 0, "time_utc": 0}
    listing.feed(Message(name="LOG_ENTRY", fields=fields), 0.1)
    assert listing.is_done
    assert listing.sizes == {}


@given(st.lists(st.tuples(st.integers(0, 300), st.integers(0, 60)), max_size=40))
def test_pieces_in_any_order_are_written_in_order_and_once(pieces: list[tuple[int, int]]) -> None:
    whole = bytes(range(256))
    written = bytearray()
    stream = ChunkStream(len(whole), 0, written.extend)
    for offset, length in pieces:
        stream.take(offset, whole[offset : offset + length])
        assert bytes(written) == whole[: stream.offset]
