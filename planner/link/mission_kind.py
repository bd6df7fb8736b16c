"""The three lists of items a vehicle keeps."""

from __future__ import annotations

from enum import IntEnum


class MissionKind(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2

    @property
    def label(self) -> str:
        """In the words of a message: ``rally points``."""
        return ("mission", "fence", "rally points")[self.value]


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


BUSY = frozenset({MissionResult.ERROR, MissionResult.DENIED, MissionResult.OPERATION_CANCELLED})
"""Answers that may be another one when asked again."""


def result_name(number: int) -> str:
    """Return ``INVALID_PARAM4`` for 9; the number itself where MAVLink knows none."""
    try:
        return MissionResult(number).name
    except ValueError:
        return f"MAV_MISSION_RESULT {number}"
