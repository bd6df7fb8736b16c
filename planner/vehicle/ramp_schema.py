"""The part of the schema that describes vehicles flying ramps of their own from place to place."""

from __future__ import annotations

from planner.vehicle.keys import Key, Kind, Table


def _key(name: str, unit: str, meaning: str, *, may_be_zero: bool = False) -> Key:
    return Key(
        name=name,
        kind=Kind.NUMBER,
        unit=unit,
        meaning=meaning,
        at_least=0.0 if may_be_zero else None,
        above=None if may_be_zero else 0.0,
    )


RAMPS = Table(
    name="ramps",
    meaning=(
        "How a vehicle flies whose autopilot is closed: each command is a step, answered by ramps of "
        'constant acceleration, and each leg ends standing still.  With reference = "step", instead '
        "of responses of altitude and speed."
    ),
    keys=(
        _key("start_s", "s", "from starting the motors to lift-off", may_be_zero=True),
        _key("climb_m_s", "m/s", "speed of climbs"),
        _key("climb_wait_s", "s", "standstill between a climb and a level leg", may_be_zero=True),
        _key("acceleration_m_s2", "m/s²", "from standstill to speed, up and level"),
        _key("braking_m_s2", "m/s²", "from speed to standstill, up and level"),
        _key("turn_wait_s", "s", "standstill between two level legs", may_be_zero=True),
        _key("descent_m_s", "m/s", "speed of descents"),
        _key("landing_m_s", "m/s", "speed of the last part of a landing"),
        _key("landing_height_m", "m", "height at which that part begins", may_be_zero=True),
        _key("stop_s", "s", "from touch-down to standing motors", may_be_zero=True),
    ),
)
