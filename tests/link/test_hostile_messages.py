"""Bytes and values that no vehicle sends neither crash nor fill anything."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from hostile_frames import hostile_frames
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples
from virtual_vehicle import wire_item

from planner.errors import LinkError
from planner.guard.authorisation import unknown_judgement
from planner.guard.decision import GuardSettings
from planner.guard.session import GuardSession, GuardStatus
from planner.link.connection import Purpose
from planner.link.logs import fetch_log_list
from planner.link.mission import MissionKind
from planner.link.telemetry import Telemetry
from planner.link.transfers import LinkSettings
from planner.link.vehicle import VehicleLink
from planner.link.wire import Codec, Message, message

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

_FRAMES = [
    Codec(1, 1).encode(message("MISSION_COUNT", count=3)),
    Codec(1, 1).encode(message("STATUSTEXT", severity=2, text="x" * 50)),
    Codec(1, 1).encode(message("PARAM_VALUE", param_id="A", param_value=1.0, param_count=3)),
]


@given(
    st.lists(
        st.one_of(st.binary(max_size=60), st.sampled_from(_FRAMES).map(lambda f: f[:-3])),
        max_size=20,
    )
)
@settings(max_examples=examples(40), deadline=None)
def test_after_any_bytes_a_whole_frame_is_understood_again(pieces: list[bytes]) -> None:
    codec = Codec(0, 0)
    for piece in pieces:
        codec.decode(piece)
    # What came before may swallow frames, but not more than the longest one has bytes (280).
    found = [one.name for _ in range(30) for one in codec.decode(_FRAMES[0])]
    assert "MISSION_COUNT" in found


@given(st.sampled_from([math.nan, math.inf, -math.inf, -1.0]), st.floats())
def test_a_wind_that_is_no_number_is_no_wind(speed: float, direction: float) -> None:
    telemetry = Telemetry()
    fields = {"speed": speed, "direction": direction, "speed_z": 0.0}
    telemetry.take(Message(name="WIND", fields=fields, system=1, component=1))
    assert telemetry.state().wind is None


def test_a_vehicle_that_talks_without_end_is_not_listened_to_without_end() -> None:
    telemetry = Telemetry()
    said = Message(name="STATUSTEXT", fields={"severity": 2, "text": "again"})
    for _ in range(5000):
        telemetry.take(said)
    assert len(telemetry.take_texts()) == 200


_SAID = (
    *("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK", "MISSION_REQUEST", "MISSION_REQUEST_INT"),
    *("MISSION_CURRENT", "PARAM_VALUE", "LOG_ENTRY", "LOG_DATA", "FILE_TRANSFER_PROTOCOL"),
    *("COMMAND_ACK", "COMMAND_LONG", "AUTOPILOT_VERSION", "HOME_POSITION", "SYS_STATUS"),
    *("BATTERY_STATUS", "GLOBAL_POSITION_INT", "EXTENDED_SYS_STATE", "WIND", "WIND_COV"),
    *("STATUSTEXT", "EVENT", "CURRENT_EVENT_SEQUENCE"),
)
_STEP_S = 0.05


class _HostileLine:
    """A vehicle that sends heartbeats and whatever was drawn, over and over."""

    def __init__(self, autopilot: int, frames: list[bytes]) -> None:
        beat = message("HEARTBEAT", type=2, autopilot=autopilot, mavlink_version=3)
        self._beat = Codec(1, 1).encode(beat)
        word = message("COMMAND_ACK", command=512, result=2, target_system=245)
        self._word = Codec(1, 1).encode(word)
        self._frames = frames
        self._number = 0

    def now_s(self) -> float:
        return self._number * _STEP_S

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        self._number += 1
        assert self._number < 40_000, "it goes on without end"
        if self._number % 20 == 1:
            return [("it", self._beat + self._word)]
        if not self._frames or timeout_s <= 0.0:
            return []
        return [("it", self._frames[self._number % len(self._frames)])]

    def send(self, data: bytes, peer: Hashable | None = None) -> None:
        pass

    def close(self) -> None:
        pass


class _OverError(Exception):
    """The time of a test is up."""


def _guard(link: VehicleLink) -> None:
    until_s = link.connection.now_s + 20.0

    def tell(_: GuardStatus) -> None:
        if link.connection.now_s > until_s:
            raise _OverError

    GuardSession(
        link,
        GuardSettings(),
        judge=lambda _: (unknown_judgement("nothing is checked"), None),
        on_decision=lambda _: None,
        on_status=tell,
    ).run()


@pytest.mark.parametrize("autopilot", [3, 12])
@given(
    frames=st.lists(
        hostile_frames(_SAID, sender=(1, 1), targets=(0, 245, 245, 190, 9)), max_size=30
    ),
    what=st.sampled_from(["lists", "parameters", "state", "logs", "upload", "guard"]),
)
@settings(max_examples=examples(40), deadline=None)
def test_whatever_a_vehicle_sends_a_command_ends_in_time_with_a_word(
    autopilot: int, frames: list[bytes], what: str
) -> None:
    purpose = {"upload": Purpose.UPLOAD, "guard": Purpose.GUARD}.get(what, Purpose.READ)
    impatient = LinkSettings(reply_timeout_s=0.3, retries=2)
    item = wire_item()
    try:
        link = VehicleLink(
            _HostileLine(autopilot, frames), name="hostile", settings=impatient, purpose=purpose
        )
        acts: dict[str, Callable[[], object]] = {
            "lists": lambda: [link.fetch_items(kind) for kind in MissionKind],
            "parameters": link.fetch_parameters,
            "state": link.fetch_state,
            "logs": lambda: fetch_log_list(link),
            "upload": lambda: link.upload_items(MissionKind.MISSION, [item] * 3),
            "guard": lambda: _guard(link),
        }
        acts[what]()
    except (LinkError, _OverError):
        pass  # in a sentence
