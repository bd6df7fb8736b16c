"""The eight flight states of the article's Figure 1."""

from __future__ import annotations

from enum import StrEnum


class FlightState(StrEnum):
    """What a vehicle does during one segment of its flight."""

    TAKEOFF = "takeoff"
    CLIMB = "climb"
    ACCELERATE = "accelerate"
    CRUISE = "cruise"
    BRAKE = "brake"
    HOVER = "hover"
    DESCEND = "descend"
    LAND = "land"


STATES = tuple(FlightState)
"""The states in a fixed order; columns of segments hold positions in it."""

STATE_INDEX = {state: index for index, state in enumerate(STATES)}
