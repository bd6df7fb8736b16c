"""Logs off a vehicle: whole, in order, going on where a download broke off."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import LinkError
from planner.link.chunks import ChunkStream
from planner.link.file_transfer import (
    _HEAD,
    FileDownload,
    FilePacket,
    FileRefusedError,
    FolderListing,
    Operation,
)
from planner.link.log_transfer import LogDownload, LogListing, VehicleLog
from planner.link.message import Message
from planner.link.settings import LinkSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.link.message import Transfer

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


class _Files:
    """A file server; it knows /log/a.bin and the folder it is in."""

    def __init__(self) -> None:
        self.is_open = False

    def __call__(self, request: Message) -> list[Message]:  # noqa: PLR0911 - one for each answer
        payload = bytes(request["payload"])
        number, _, operation, size, _, _, offset = _HEAD.unpack_from(payload)
        content = payload[_HEAD.size : _HEAD.size + size]
        ack = {"number": number + 1, "operation": Operation.ACK, "answered": operation}
        nak: dict[str, Any] = ack | {"operation": Operation.NAK}
        if operation == Operation.LIST_DIRECTORY:
            if content != b"/log":
                return [_answer(FilePacket(**nak, content=bytes([10])))]
            if offset:
                return [_answer(FilePacket(**nak, content=bytes([6])))]
            listed = f"D.\0D2026\0Fa.bin\t{len(CONTENT)}\0Fb.txt\t12\0".encode()
            return [_answer(FilePacket(**ack, content=listed))]
        if operation == Operation.OPEN_FILE_RO:
            if content != b"/log/a.bin":
                return [_answer(FilePacket(**nak, content=bytes([10])))]
            self.is_open = True
            return [_answer(FilePacket(**ack, content=len(CONTENT).to_bytes(4, "little")))]
        if operation == Operation.TERMINATE_SESSION:
            self.is_open = False
        if not self.is_open:
            return [_answer(FilePacket(**nak, content=bytes([4])))]
        if operation == Operation.READ_FILE:
            return [_answer(FilePacket(**ack, offset=offset, content=CONTENT[offset:][:size]))]
        if operation == Operation.BURST_READ_FILE:
            pieces = range(offset, min(offset + 10 * size, len(CONTENT)), size)
            return [
                _answer(
                    FilePacket(
                        **(ack | {"number": number + 1 + n}),
                        offset=at,
                        content=CONTENT[at : at + size],
                        is_last=at == pieces[-1],
                    )
                )
                for n, at in enumerate(pieces)
            ]
        return []


def _answer(packet: FilePacket) -> Message:
    head = _HEAD.pack(
        packet.number,
        packet.session,
        packet.operation,
        len(packet.content),
        packet.answered,
        int(packet.is_last),
        packet.offset,
    )
    payload = (head + packet.content).ljust(251, b"\0")
    return Message(name="FILE_TRANSFER_PROTOCOL", fields={"payload": payload})


@given(seed=st.integers(0, 10**6), start=st.integers(0, len(CONTENT)))
@settings(max_examples=15, deadline=None)
def test_the_log_protocol_brings_a_log_whole_through_loss(seed: int, start: int) -> None:
    got = bytearray(CONTENT[:start])
    _run(LogDownload(LOG, start, got.extend, LinkSettings()), _log_data, loss=0.2, seed=seed)
    assert bytes(got) == CONTENT


@given(seed=st.integers(0, 10**6), start=st.integers(0, len(CONTENT)))
@settings(max_examples=15, deadline=None)
def test_the_file_protocol_brings_a_file_whole_through_loss(seed: int, start: int) -> None:
    got = bytearray(CONTENT[:start])
    download = FileDownload("/log/a.bin", start, got.extend, LinkSettings())
    _run(download, _Files(), loss=0.2, seed=seed)
    assert bytes(got) == CONTENT


def test_a_folder_is_listed_with_sizes() -> None:
    listing = FolderListing("/log", LinkSettings())
    _run(listing, _Files(), loss=0.2, seed=4)
    assert listing.files == {"a.bin": len(CONTENT), "b.txt": 12}
    assert listing.folders == ["2026"]


def test_a_folder_and_a_file_that_are_not_there_are_refused() -> None:
    with pytest.raises(FileRefusedError, match="no folder /nowhere"):
        _run(FolderListing("/nowhere", LinkSettings()), _Files(), loss=0.0, seed=1)
    download = FileDownload("/nothing", 0, bytearray().extend, LinkSettings())
    with pytest.raises(FileRefusedError, match="does not open /nothing"):
        _run(download, _Files(), loss=0.0, seed=1)


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
