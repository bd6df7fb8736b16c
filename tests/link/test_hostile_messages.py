"""Bytes and values that no vehicle sends neither crash nor fill anything."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from planner.link.codec import Codec
from planner.link.message import Message, message
from planner.link.telemetry import Telemetry

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
@settings(max_examples=40, deadline=None)
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
