"""The cases of a sweep: every combination of what varies, each condition once, by its number.

A case is found from its number alone, so that a million of them take no room.  What changes a flight
most changes slowest: neighbours share the mission, the route and the motion, and differ in the battery.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError
from planner.service.sweep.axes import GUST_M_S, MISSION, WIND_FROM_DEG, WIND_M_S, Axis
from planner.service.sweep.weather import distinct
from planner.setting import Group, declared
from planner.setup import RestVoltage, Setup
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.physics.wind import Wind
    from planner.service.sweep.weather import MeasuredWeather
    from planner.setting import Setting

Point = tuple[Any, ...]
_WIND = (WIND_M_S, WIND_FROM_DEG, GUST_M_S)
_IN_THE_AIR = ("wind", "temperature_c", "pressure_hpa", "payload_kg")
"""Fields that change the power along a motion, and seldom the motion."""
MOST_CASES = 10**9


class Block(Value):
    """Axes that vary together: each point gives all of them a value."""

    axes: tuple[Axis, ...]
    points: tuple[Point, ...]
    times: tuple[tuple[str, ...], ...] | None = None
    """When each point was measured, once or more often; ``None``: these are no rows of weather."""


class Cases(Value, dict=True):
    """Every case of a sweep: the product of its blocks, the slowest first."""

    blocks: tuple[Block, ...]
    unchecked_times: tuple[str, ...] = ()
    """Rows of weather with a gap, which nothing can be said of."""

    def __len__(self) -> int:
        return math.prod(len(block.points) for block in self.blocks)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """Everything that varies, the slowest first."""
        return tuple(axis for block in self.blocks for axis in block.axes)

    @property
    def combination_count(self) -> int:
        """Cases there would be if equal conditions were not one: every value with every other."""
        count = 1
        for block in self.blocks:
            listed = [len(axis.values) for axis in block.axes if axis.values]
            if block.times is not None:
                count *= sum(map(len, block.times))
            else:
                count *= math.prod(listed) if listed else len(block.points)
        return count

    @property
    def row_count(self) -> int:
        """Rows of the table: a case for each time its weather was measured, and each that has a gap."""
        rows = 1
        for block in self.blocks:
            rows *= len(block.points) if block.times is None else sum(map(len, block.times))
        others = math.prod(len(block.points) for block in self.blocks if block.times is None)
        return rows + len(self.unchecked_times) * others

    @cached_property
    def strides(self) -> tuple[int, ...]:
        """How many cases follow one another before each block changes."""
        return tuple(
            math.prod(len(after.points) for after in self.blocks[position + 1 :])
            for position in range(len(self.blocks))
        )

    def places(self, number: int) -> tuple[int, ...]:
        """Return the position of a case in each block."""
        return tuple(
            number // stride % len(block.points)
            for block, stride in zip(self.blocks, self.strides, strict=True)
        )

    def values(self, number: int) -> dict[str, Any]:
        """Return what varies in a case, by the key of its column; ``None``: as it is without."""
        return {
            axis.key: value
            for block, place in zip(self.blocks, self.places(number), strict=True)
            for axis, value in zip(block.axes, block.points[place], strict=True)
        }


def make_cases(
    axes: Sequence[Axis], *, draws: int | None = None, weather: MeasuredWeather | None = None
) -> Cases:
    """Return the cases over some axes.

    Parameters
    ----------
    axes : sequence of Axis
        In any order.
    draws : int, optional
        How many are drawn of axes with a distribution, together.
    weather : MeasuredWeather, optional
        Measured rows, each one a condition.

    Raises
    ------
    UsageError
        If axes exclude one another, draws and distributions do not go together, or nothing varies.
    """
    _refuse_twice(axes, weather)
    drawn = [axis for axis in axes if axis.distribution is not None]
    if bool(drawn) != (draws is not None):
        msg = (
            f"{drawn[0].text} is drawn: say how often with --draws"
            if drawn
            else "--draws needs something to draw, such as --vary wind=weibull(2,5)"
        )
        raise UsageError(msg)
    blocks = []
    unchecked: tuple[str, ...] = ()
    listed = [axis for axis in axes if axis.distribution is None]
    windy = [axis for part in _WIND for axis in listed if axis.key == part.key]
    blocks += [
        Block(axes=(one,), points=tuple((v,) for v in one.values))
        for one in listed
        if one not in windy
    ]
    if windy:
        blocks.append(_wind_block(windy))
    if drawn and draws is not None:
        points = zip(*(axis.draws(draws) for axis in drawn), strict=True)
        blocks.append(Block(axes=tuple(drawn), points=tuple(points)))
    if weather is not None:
        block, unchecked = _weather_block(weather)
        blocks.append(block)
    if not blocks:
        msg = "nothing varies: give --vary, such as --vary wind=0:12:1, or --weather"
        raise UsageError(msg)
    cases = Cases(
        blocks=tuple(
            sorted(blocks, key=lambda block: min(_slowness(a.setting) for a in block.axes))
        ),
        unchecked_times=unchecked,
    )
    if (count := math.prod(len(block.points) for block in blocks)) > MOST_CASES:
        msg = f"{count} cases are more than {MOST_CASES}: sweep over parts of them"
        raise UsageError(msg)
    return cases


def refuse_undirected(cases: Cases, setup: Setup) -> None:
    """Refuse a wind that nothing says where it blows from: as a check does, no direction is guessed.

    Raises
    ------
    UsageError
        If a wind or gust above 0 varies, and neither an axis, nor the weather, nor the setup has a direction.
    """
    keys = [axis.key for axis in cases.axes]
    if WIND_FROM_DEG.key in keys or setup.wind.speed_m_s or setup.wind.from_deg:
        return
    for block in cases.blocks:
        for at, axis in enumerate(block.axes):
            if axis.key not in {WIND_M_S.key, GUST_M_S.key} or not any(p[at] for p in block.points):
                continue
            what = f"--vary {axis.name}" if block.times is None else "the weather"
            msg = (
                f"{what} has a wind, and nothing says where it blows from: vary that too, such as --vary "
                "wind-from=0:315:45, or give it with --wind 5@270, whose speed is then what varies"
            )
            raise UsageError(msg)


def _refuse_twice(axes: Sequence[Axis], weather: MeasuredWeather | None) -> None:
    keys: dict[str, str] = {}
    if weather is not None:
        keys = dict.fromkeys(weather.keys, "--weather")
    for axis in axes:
        whole = "wind" if axis.setting.field == "wind" and axis.key != "wind" else ""
        if (
            axis.key in keys
            or (axis.key == "wind" and any(p.key in keys for p in _WIND))
            or whole in keys
        ):
            other = keys.get(axis.key) or keys.get(whole) or "another axis"
            msg = f"--vary {axis.name} varies what {other} varies already"
            raise UsageError(msg)
        keys[axis.key] = f"--vary {axis.name}"


def _slowness(setting: Setting) -> tuple[int, int]:
    """Return the rank of what varies: the mission, how it is flown, the air, the battery, the judgement."""
    if setting.key == MISSION.key:
        return (0, 0)
    keys = [one.key for one in declared(Setup)]
    position = keys.index(setting.key) if setting.key in keys else 0
    if setting.field in _IN_THE_AIR:
        return (2, _IN_THE_AIR.index(setting.field))
    return ({Group.FLIGHT: 1, Group.BATTERY: 3}.get(setting.group, 4), position)


def is_calm(speed_m_s: float | None, gust_m_s: float | None = None) -> bool:
    """Return whether the air stands still: it has no direction then."""
    return not speed_m_s and not gust_m_s


def _wind_block(axes: Sequence[Axis]) -> Block:
    """Return the winds of parts that vary: calm has one direction, which is none."""
    winds: dict[Point, None] = {}
    for point in product(*(axis.values for axis in axes)):
        by_part = dict(zip((axis.key for axis in axes), point, strict=True))
        if WIND_M_S.key in by_part and is_calm(by_part[WIND_M_S.key], by_part.get(GUST_M_S.key)):
            by_part |= {key: None for key in by_part if key == WIND_FROM_DEG.key}
        winds[tuple(by_part.values())] = None
    return Block(axes=tuple(axes), points=tuple(winds))


def _weather_block(weather: MeasuredWeather) -> tuple[Block, tuple[str, ...]]:
    """Return the different rows of weather, and the times of those with a gap."""
    keys = weather.keys
    speed = keys.index(WIND_M_S.key)
    direction = keys.index(WIND_FROM_DEG.key) if WIND_FROM_DEG.key in keys else None
    gust = keys.index(GUST_M_S.key) if GUST_M_S.key in keys else None
    canonical: list[Point] = []
    times: list[str] = []
    gaps: list[str] = []
    for time, row in zip(weather.times, weather.rows, strict=True):
        values = list(row)
        calm = values[speed] == 0.0 and is_calm(
            values[speed], None if gust is None else values[gust]
        )
        if calm and direction is not None:
            values[direction] = None
        if any(one is None for i, one in enumerate(values) if not (calm and i == direction)):
            gaps.append(time)
            continue
        canonical.append(tuple(values))
        times.append(time)
    found = distinct(canonical)
    if not found:
        msg = f"{weather.source}: every row has a gap: nothing can be checked"
        raise UsageError(msg)
    block = Block(
        axes=tuple(Axis(key=key, name=key) for key in keys),
        points=tuple(found),
        times=tuple(tuple(times[at] for at in places) for places in found.values()),
    )
    return block, tuple(gaps)


def case_setup(base: Setup, values: Mapping[str, Any]) -> Setup:
    """Return the setup of a case: the common one with what varies in it.

    Values are those of fields, so that a file has been read for them.

    Raises UsageError if one is out of its range.
    """
    fields: dict[str, Any] = {}
    for setting in declared(Setup):
        if setting.key not in values:
            continue
        value = values[setting.key]
        if setting.into is not None:
            value = setting.into(fields.get(setting.field, getattr(base, setting.field)), value)
        elif setting.key == "wind":  # its profile is another setting
            own = base.wind
            value = replace(
                value,
                reference_height_m=own.reference_height_m,
                shear_exponent=own.shear_exponent,
                roughness_length_m=own.roughness_length_m,
            )
        elif setting.key == "vehicle":
            fields["is_vehicle_named"] = True
        fields[setting.field] = value
    if any(part.key in values for part in _WIND):
        fields["wind"] = _with_parts(fields.get("wind", base.wind), values)
    at_rest_v = base.rest_voltage_v
    if "charge" in fields:
        at_rest_v = fields["rest_voltage_v"] = None
    if isinstance(fields.get("charge"), RestVoltage):
        at_rest_v = fields.pop("charge").voltage_v
    setup = replace(base, **fields) if fields else base
    # A voltage is the charge of one battery, and another charge of the next.
    return setup if at_rest_v is None else setup.charged_to(at_rest_v)


def _with_parts(wind: Wind, values: Mapping[str, Any]) -> Wind:
    speed_m_s = values.get(WIND_M_S.key, wind.speed_m_s)
    from_deg = values.get(WIND_FROM_DEG.key, wind.from_deg)
    gust_m_s = values.get(GUST_M_S.key)
    sd_m_s = wind.speed_sd_m_s
    if gust_m_s is not None:
        sd_m_s = 0.5 * max(gust_m_s - speed_m_s, 0.0)
    return replace(
        wind,
        speed_m_s=speed_m_s,
        from_deg=0.0 if from_deg is None else from_deg,
        speed_sd_m_s=sd_m_s,
    )
