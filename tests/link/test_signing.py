"""Signed lines: our own signing against pymavlink's, and what is refused on one.

MAVSDK 4.1 has no signing to try it on: neither its Python classes nor its library know of it.
"""

from __future__ import annotations

import json
import os
import socket
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_vehicles import MemoryLine, free_port, request, vehicle, wire
from thinning import examples

from planner.autopilot import Autopilot
from planner.cli.main import main
from planner.errors import LinkError, OutputError, UsageError
from planner.link.address import LinkAddress, LinkKind
from planner.link.mission import MissionKind
from planner.link.signing import Signer, open_signer, read_signing_key
from planner.link.transfers import LinkSettings
from planner.link.vehicle import LinkRequest, VehicleLink, open_link
from planner.link.wire import Codec, load_dialect, message
from planner.service.simulation import make_simulated_wire, open_simulation
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Hashable
    from pathlib import Path

KEY = bytes(range(32))
OTHER = bytes(32 * [7])
NOW_S = 1_800_000_000.0
NOW = int((NOW_S - 1_420_070_400) * 100_000)
"""In units of 10 µs since 2015."""
POSIX = pytest.mark.skipif(os.name != "posix", reason="Windows has no modes")


def _key_file(folder: Path, content: bytes = KEY, mode: int = 0o600) -> Path:
    path = folder / "key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


def _signer(key: bytes = KEY, *, at_s: float = NOW_S, kept: Path | None = None) -> Signer:
    return Signer(key, kept=kept, now_s=lambda: at_s)


def _pymavlink(key: bytes = KEY, timestamp: int = NOW, system: int = 1) -> Any:  # noqa: ANN401 - it has no types
    made = load_dialect().MAVLink(None, srcSystem=system, srcComponent=1)
    made.signing.secret_key = key
    made.signing.timestamp = timestamp
    made.signing.link_id = 3
    made.signing.sign_outgoing = True
    made.robust_parsing = True
    return made


def _frame(mav: Any, count: int = 5) -> bytes:  # noqa: ANN401 - as above
    return bytes(load_dialect().MAVLink_mission_count_message(245, 190, count, 0).pack(mav))


def _names(codec: Codec, data: bytes) -> list[str]:
    return [one.name for one in codec.decode(data)]


def test_pymavlink_takes_what_we_sign_and_we_take_what_it_signs() -> None:
    ours, theirs = Codec(245, 190, _signer()), _pymavlink()
    for number in range(3):
        sent = ours.encode(message("MISSION_COUNT", count=number, opaque_id=number))
        (received,) = theirs.parse_buffer(sent)
        assert (received.get_type(), received.count) == ("MISSION_COUNT", number)
        assert theirs.signing.goodsig_count == number + 1
        (back,) = ours.decode(_frame(theirs, number))
        assert (back.name, back["count"]) == ("MISSION_COUNT", number)


def test_what_pymavlink_refuses_we_refuse() -> None:
    signed = _frame(_pymavlink())
    unsigned = Codec(1, 1).encode(message("MISSION_COUNT", count=5))
    first = load_dialect().MAVLink_mission_count_message(245, 190, 5, 0)
    version_1 = bytes(first.pack(load_dialect().MAVLink(None, srcSystem=1), force_mavlink1=True))
    broken = {
        "unsigned": unsigned,
        "version 1": version_1,
        "another key": _frame(_pymavlink(OTHER)),
        "another link": signed[:-13] + b"\x09" + signed[-12:],
        "another time": signed[:-12] + b"\xff" + signed[-11:],
        "another signature": signed[:-1] + bytes([signed[-1] ^ 1]),
    }
    for why, frame in broken.items():
        ours, theirs = Codec(245, 190, _signer()), _pymavlink(timestamp=NOW)
        assert _names(ours, frame) == [], why
        assert ours.refused == 1, why
        assert [one.get_type() for one in theirs.parse_buffer(frame)] == ["BAD_DATA"], why
        # A forgery does not make the true frame old; pymavlink's forged times do.
        assert _names(ours, signed) == ["MISSION_COUNT"], why


@given(number=st.integers(0, 10**6), position=st.integers(0, 10**6), change=st.integers(1, 255))
@settings(max_examples=examples(60), deadline=None)
def test_no_byte_of_a_signed_frame_may_differ(number: int, position: int, change: int) -> None:
    frame = bytearray(_frame(_pymavlink(), number % 60_000))
    frame[position % len(frame)] ^= change
    assert _names(Codec(245, 190, _signer()), bytes(frame)) == []


def test_a_frame_counts_once_and_never_after_a_later_one() -> None:
    theirs = _pymavlink()
    frames = [_frame(theirs) for _ in range(3)]
    ours = Codec(245, 190, _signer())
    assert _names(ours, frames[1]) == ["MISSION_COUNT"]
    assert _names(ours, frames[1] + frames[0]) == []
    assert _names(ours, frames[2]) == ["MISSION_COUNT"]


@pytest.mark.parametrize(("age_s", "is_taken"), [(59.9, True), (60.1, False)])
def test_the_first_frame_of_a_sender_may_be_a_minute_old(age_s: float, *, is_taken: bool) -> None:
    # https://mavlink.io/en/guide/message_signing.html: "more than 1 minute ... behind"
    old = _frame(_pymavlink(timestamp=NOW - round(age_s * 1e5)))
    assert bool(_names(Codec(245, 190, _signer()), old)) is is_taken


def test_who_hears_a_later_time_sends_later_ones() -> None:
    signer = _signer()
    ahead = NOW + 10**9
    assert _names(Codec(245, 190, signer), _frame(_pymavlink(timestamp=ahead)))
    assert signer.following() > ahead


def test_times_grow_whatever_the_clock_does_and_however_it_ended(tmp_path: Path) -> None:
    kept, times = tmp_path / "key.times", []
    for at_s, is_closed in ((NOW_S, True), (NOW_S - 1e6, False), (NOW_S - 2e6, True), (0.0, False)):
        signer = _signer(at_s=at_s, kept=kept)
        times += [signer.following() for _ in range(1000)]
        if is_closed:
            signer.close()
    assert all(one < other for one, other in pairwise(times))
    assert times[0] >= NOW


def test_a_frame_of_an_earlier_call_is_not_taken_again(tmp_path: Path) -> None:
    kept, frame = tmp_path / "key.times", _frame(_pymavlink())
    first = _signer(kept=kept)
    assert _names(Codec(245, 190, first), frame) == ["MISSION_COUNT"]
    first.close()
    assert _names(Codec(245, 190, _signer(kept=kept)), frame) == []
    assert json.loads(kept.read_text())["links"] == {"3:1:1": NOW}


def test_two_calls_at_once_lose_no_time_of_each_other(tmp_path: Path) -> None:
    kept = tmp_path / "key.times"
    one, other = _signer(kept=kept), _signer(kept=kept)
    assert _names(Codec(245, 190, one), _frame(_pymavlink()))
    assert _names(Codec(245, 190, other), _frame(_pymavlink(system=2)))
    one.close()
    other.close()
    assert set(json.loads(kept.read_text())["links"]) == {"3:1:1", "3:2:1"}


def test_times_that_cannot_be_kept_are_told_before_anything_is_sent(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"key\.times: cannot be written"):
        _signer(kept=tmp_path / "no such folder" / "key.times")
    (tmp_path / "key.times").write_text("{", encoding="utf-8")
    with pytest.raises(UsageError, match="holds no times of signed frames"):
        _signer(kept=tmp_path / "key.times")


def test_a_key_is_32_bytes_or_64_digits(tmp_path: Path) -> None:
    for content in (KEY, KEY.hex().encode(), KEY.hex().upper().encode() + b"\n"):
        assert read_signing_key(_key_file(tmp_path, content)) == KEY
    for content in (b"", KEY[:-1], KEY + b"\n", KEY.hex().encode()[:-2], b"g" * 64, b"0" * 9999):
        with pytest.raises(UsageError, match="expected a key of 32 bytes or 64 hexadecimal digits"):
            read_signing_key(_key_file(tmp_path, content))
    with pytest.raises(UsageError, match="a key of zeros is none"):
        read_signing_key(_key_file(tmp_path, bytes(32)))
    with pytest.raises(UsageError, match="cannot be read: No such file"):
        read_signing_key(tmp_path / "none")
    assert open_signer(None) is None


@POSIX
@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o620, 0o660])
def test_a_key_that_others_may_use_is_none(tmp_path: Path, mode: int) -> None:
    with pytest.raises(UsageError, match=rf"\(mode {mode:04o}\): make it yours alone by chmod 600"):
        read_signing_key(_key_file(tmp_path, mode=mode))
    assert read_signing_key(_key_file(tmp_path, mode=0o400)) == KEY


class _SpoofedLine(MemoryLine):
    """Somebody without the key speaks in between, from the vehicle's own address and another one."""

    frames: tuple[bytes, ...] = ()
    heard: tuple[bytes, ...] = ()

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        found = super().receive(timeout_s)
        self.heard += tuple(data for _, data in found)
        peers = {peer for peer, _ in found}
        replayed = self.heard[-3:-1] if len(self.heard) > 3 else ()
        return [
            *found,
            *((peer, one) for peer in (*peers, "other") for one in (*self.frames, *replayed)),
        ]


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_on_a_signed_line_nobody_without_the_key_is_heard(
    autopilot: Autopilot, tmp_path: Path
) -> None:
    asked = replace(request(autopilot), signing_key=_key_file(tmp_path))
    line = _SpoofedLine(make_simulated_wire(vehicle(autopilot), asked))
    full = message("SYS_STATUS", battery_remaining=1, voltage_battery=1)
    count = message("MISSION_COUNT", count=1, mission_type=0)
    forged = Codec(1, 1, _signer(OTHER))
    line.frames = (Codec(1, 1).encode(full), Codec(1, 1).encode(count), forged.encode(full))
    link = VehicleLink(line, name="signed", signer=_signer(at_s=line.now_s() + 1.9e9))
    assert len(link.fetch_items(MissionKind.MISSION) or ()) >= 4
    battery = link.fetch_state().battery
    assert battery is not None
    assert battery.remaining_fraction == 1.0
    assert len(link.fetch_parameters()) == len(vehicle(autopilot).setup.parameters)


def test_a_vehicle_without_the_key_is_told_from_one_that_is_not_there() -> None:
    impatient = LinkSettings(heartbeat_timeout_s=3.0)
    with pytest.raises(LinkError, match=r"signed by the key: \d+ other messages were refused"):
        VehicleLink(
            MemoryLine(wire(Autopilot.PX4)), name="unsigned", settings=impatient, signer=_signer()
        )


def test_a_signed_vehicle_over_udp_is_read_with_its_key_alone(tmp_path: Path) -> None:
    key = _key_file(tmp_path)
    port = free_port(socket.SOCK_DGRAM)
    theirs = LinkAddress(kind=LinkKind.UDP_SEND, host="127.0.0.1", port=port)
    ours = LinkAddress(kind=LinkKind.UDP_LISTEN, host="127.0.0.1", port=port)
    asked = replace(request(Autopilot.PX4), signing_key=key)
    runner, _ = open_simulation(vehicle(Autopilot.PX4), asked, theirs)
    with runner:
        with open_link(LinkRequest(address=ours, signing_key=key)) as link:
            assert len(link.fetch_items(MissionKind.MISSION) or ()) == 4
        impatient = LinkSettings(reply_timeout_s=0.05, retries=2)
        with (
            pytest.raises(LinkError, match=r"needs --signing-key"),
            open_link(LinkRequest(address=ours, settings=impatient)),
        ):
            pass


def test_mavutil_reads_a_signed_vehicle(tmp_path: Path) -> None:
    from pymavlink import mavutil

    port = free_port(socket.SOCK_STREAM)
    address = LinkAddress(kind=LinkKind.TCP_LISTEN, host="127.0.0.1", port=port)
    asked = replace(request(Autopilot.ARDUPILOT), signing_key=_key_file(tmp_path))
    runner, _ = open_simulation(vehicle(Autopilot.ARDUPILOT), asked, address)
    with runner:
        line = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", source_system=247)
        try:
            line.setup_signing(KEY)
            line.mav.heartbeat_send(6, 8, 0, 0, 4)
            line.mav.mission_request_list_send(1, 1, 0)
            count = line.recv_match(type="MISSION_COUNT", blocking=True, timeout=5.0)
            assert count.count == 5
            assert count.get_signed()
            line.disable_signing()
            line.mav.mission_request_list_send(1, 1, 0)
            assert line.recv_match(type="MISSION_COUNT", blocking=True, timeout=0.5) is None
        finally:
            line.close()


def test_a_key_that_is_none_ends_a_command_before_the_line_is_opened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key = str(_key_file(tmp_path, b"secret"))
    plan = str(tmp_path / "a.plan")
    for command in (
        ["fetch", "udpin:127.0.0.1:1", "-o", plan],
        ["guard", "udpin:127.0.0.1:1", "--vehicle", "arducopter-sitl-quad"],
        ["logs", "udpin:127.0.0.1:1"],
    ):
        assert main([*command, "--signing-key", key]) == 2
        said = capsys.readouterr().err
        assert "expected a key of 32 bytes" in said
        assert "secret" not in said
    key = str(_key_file(tmp_path))
    guard = ["guard", "udpin:127.0.0.1:1", "--vehicle", "arducopter-sitl-quad"]
    assert main([*guard, "--signing-key", key, "--authoriser", "mavsdk"]) == 2
    assert "MAVSDK signs no messages" in capsys.readouterr().err
