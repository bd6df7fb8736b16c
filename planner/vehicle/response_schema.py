"""The part of the schema that describes identified responses."""

from __future__ import annotations

from planner.physics.response import MAX_ORDER
from planner.vehicle.consistency import motion_problems, power_problems
from planner.vehicle.keys import Key, Kind, Table

RESPONSES = Table(
    name="responses",
    meaning=(
        "Identified responses to a reference, each a transfer function with a delay in a table of "
        'its own.  With reference = "step" both altitude and speed are required.'
    ),
)

_STANDARD_ERRORS = (
    Key(
        name="numerator_standard_error",
        kind=Kind.NUMBERS,
        meaning="standard error of each coefficient of the numerator, in its order",
        required=False,
        at_least=0.0,
        most_count=MAX_ORDER + 1,
    ),
    Key(
        name="denominator_standard_error",
        kind=Kind.NUMBERS,
        meaning="standard error of each coefficient of the denominator; 0 of one that is not fitted",
        required=False,
        at_least=0.0,
        most_count=MAX_ORDER + 1,
    ),
    Key(
        name="delay_standard_error_s",
        kind=Kind.NUMBER,
        unit="s",
        meaning="standard error of the dead time",
        required=False,
        at_least=0.0,
    ),
)


def _response_table(name: str, meaning: str, *, is_power: bool, identified: Key) -> Table:
    window = Key(
        name="window_s",
        kind=Kind.NUMBER,
        unit="s",
        meaning="time from the command over which the response is used; hover power after it",
        above=0.0,
    )
    return Table(
        name=f"responses.{name}",
        meaning=meaning,
        keys=(
            Key(
                name="numerator",
                kind=Kind.NUMBERS,
                meaning="coefficients, highest power of s first",
                least_count=1,
                most_count=MAX_ORDER + 1,
            ),
            Key(
                name="denominator",
                kind=Kind.NUMBERS,
                meaning="coefficients, highest power of s first; third order at most",
                least_count=2,
                most_count=MAX_ORDER + 1,
            ),
            Key(name="delay_s", kind=Kind.NUMBER, unit="s", meaning="dead time", at_least=0.0),
            *_STANDARD_ERRORS,
            Key(
                name="input_gain",
                kind=Kind.NUMBER,
                meaning="the reference is multiplied by this before it enters the model",
            ),
            *((window,) if is_power else ()),
            identified,
        ),
        cross_check=power_problems if is_power else motion_problems,
    )


_IDENTIFIED_STEP = Key(
    name="identified_step_m",
    kind=Kind.NUMBER,
    unit="m",
    meaning="altitude step of the flights it was identified on",
    above=0.0,
)
_IDENTIFIED_SPEED = Key(
    name="identified_speed_m_s",
    kind=Kind.NUMBER,
    unit="m/s",
    meaning="speed command of the flights it was identified on",
    above=0.0,
)

RESPONSE_TABLES = {
    "altitude": _response_table(
        "altitude",
        "Altitude reference [m] to altitude [m].",
        is_power=False,
        identified=_IDENTIFIED_STEP,
    ),
    "climb_power": _response_table(
        "climb_power",
        "Altitude reference [m] to power above hover [W], climbing.",
        is_power=True,
        identified=_IDENTIFIED_STEP,
    ),
    "descent_power": _response_table(
        "descent_power",
        "Altitude reference [m] to power above hover [W], descending.",
        is_power=True,
        identified=_IDENTIFIED_STEP,
    ),
    "speed": _response_table(
        "speed",
        "Speed reference [m/s] to airspeed [m/s].",
        is_power=False,
        identified=_IDENTIFIED_SPEED,
    ),
    "brake_power": _response_table(
        "brake_power",
        "Speed reference [m/s] to power above hover [W], stopping.",
        is_power=True,
        identified=_IDENTIFIED_SPEED,
    ),
}
