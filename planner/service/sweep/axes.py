"""The axes of a sweep: what varies, and over which values or by which distribution.

Every setting of `planner.setup.Setup` can vary, by the name of its option: ``payload=0,0.25kg,0.5``,
``charge=100%:60%:10%``, ``temperature=normal(15,5)``; so can the parts of the wind, ``wind=0:12:1``,
``wind-from=0:315:45`` and ``gust``.
"""

from __future__ import annotations

import re
from collections import Counter
from decimal import Decimal
from functools import cache
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.errors import UsageError, nearest_hint
from planner.findings import Severity
from planner.quantity import Spread, mean_of
from planner.setting import Bearing, Fraction, Group, Kind, Number, Setting, Switch, declared
from planner.setup import Setup
from planner.units import FASTEST_M_S
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from planner.arrays import FloatArray

WIND_M_S = Setting(
    Number("m/s", 0.0, FASTEST_M_S), Group.FLIGHT, "speed of the wind", key="wind_m_s", field="wind"
)
WIND_FROM_DEG = Setting(
    Bearing(), Group.FLIGHT, "where the wind blows from", key="wind_from_deg", field="wind"
)
GUST_M_S = Setting(
    Number("m/s", 0.0, FASTEST_M_S), Group.FLIGHT, "gusts of the wind", key="gust_m_s", field="wind"
)
"""As fast as two standard deviations over the mean, by which the rules judge."""
MISSION = Setting(Kind(), Group.FLIGHT, "the mission", key="mission")
WIND_PARTS: Mapping[str, Setting] = {
    "wind": WIND_M_S,
    "wind-from": WIND_FROM_DEG,
    "gust": GUST_M_S,
    "wind-gust": GUST_M_S,
}
"""Parts of the wind by the names they vary under; ``wind=5@270,8@90`` are whole winds."""
MOST_VALUES = 100_000
"""On one axis."""
_SEPARATE = frozenset(
    {"select", "extend_select", "ignore", "baseline", "per_file_ignores", "trace"}
)
"""Settings that are no condition of a flight: what is reported is one choice for a whole sweep."""
_LEAST_INSIDE = 0.01
"""Of what a distribution draws, that the setting has to allow. [-]"""
_CALL = re.compile(r"(\w+)\s*\((.*)\)")
_ON_GRID = Decimal("1e-9")
"""A range ends this near its last step. [-]"""


class Law(Value, kw_only=False):
    """A law of distribution: its parameters in words, how many draw, which are impossible."""

    parameters: str
    count: int
    draw: Callable[..., FloatArray]
    is_possible: Callable[..., bool]


LAWS: Mapping[str, Law] = {
    "normal": Law(
        "MEAN,SD", 2, lambda r, n, mean, sd: r.normal(mean, sd, n), lambda _, sd: sd >= 0.0
    ),
    "uniform": Law(
        "LOW,HIGH", 2, lambda r, n, low, high: r.uniform(low, high, n), lambda low, high: low < high
    ),
    "triangular": Law(
        "LOW,MODE,HIGH",
        3,
        lambda r, n, low, mode, high: r.triangular(low, mode, high, n),
        lambda low, mode, high: low <= mode <= high and low < high,
    ),
    "weibull": Law(
        "SHAPE,SCALE",
        2,
        lambda r, n, shape, scale: scale * r.weibull(shape, n),
        lambda shape, scale: shape > 0.0 and scale > 0.0,
    ),
}


class Distribution(Value):
    """What draws of a quantity come from."""

    law: str
    parameters: tuple[float, ...]

    def __str__(self) -> str:
        return f"{self.law}({','.join(map(quantity.exact, self.parameters))})"


class Axis(Value):
    """One thing that varies."""

    key: str
    """Of what varies: the head of its column, with the unit."""
    name: str
    """As it was asked for."""
    values: tuple[Any, ...] = ()
    """As the setting's kind reads them, each once; empty where they are drawn."""
    distribution: Distribution | None = None
    """What they are drawn from."""

    @property
    def setting(self) -> Setting:
        """What varies, or a part of it."""
        return varying()[self.key]

    @property
    def text(self) -> str:
        """What reads back as the axis."""
        if self.distribution is not None:
            return f"{self.name}={self.distribution}"
        return f"{self.name}={','.join(self.shown(value) for value in self.values)}"

    def shown(self, value: object) -> str:
        """Return a value as it is written, without its unit."""
        return quantity.ABSENT if value is None else str(self.setting.kind.text(value))

    def cell(self, value: object) -> float | str | None:
        """Return a value in the column of the axis: a number where it is one, else its text."""
        if value is None or isinstance(value, str):
            return value
        if isinstance(value, int | float) and not isinstance(value, bool | Severity):
            return float(value)
        return str(self.setting.kind.text(value))

    def draws(self, count: int) -> tuple[float, ...]:
        """Return so many draws; the same for the same axis, whatever else varies.

        They are drawn from the part of the distribution that the setting allows; directions go round.

        Raises ``UsageError`` where that is less than a hundredth of it.
        """
        assert self.distribution is not None
        law = LAWS[self.distribution.law]
        content = f"{self.key} {self.distribution}".encode()
        random = np.random.default_rng(np.random.SeedSequence(list(sha256(content).digest())))
        kind = self.setting.kind
        assert isinstance(kind, Number)  # what is drawn is a number
        if self.key == WIND_FROM_DEG.key:
            return tuple((law.draw(random, count, *self.distribution.parameters) % 360.0).tolist())
        found: list[float] = []
        drawn = 0
        while len(found) < count:
            batch = law.draw(random, max(count, 1000), *self.distribution.parameters).tolist()
            drawn += len(batch)
            found += (one for one in batch if not kind.refusal(one))
            if len(found) < _LEAST_INSIDE * drawn:
                msg = f"--vary {self.text}: less than 1 % of it is {kind.range_text}"
                raise UsageError(msg)
        return tuple(found[:count])


def read_axis(text: str) -> Axis:
    """Return the axis of ``wind=0:12:1``, ``payload=0,0.25,0.5`` or ``temperature=normal(15,5)``.

    Raises
    ------
    UsageError
        If nothing of that name varies, or a value is not one of it.
    """
    name, equals, values = text.partition("=")
    if not equals or not values.strip():
        msg = f"--vary {text}: expected NAME=VALUES, such as wind=0:12:1 or payload=0,0.25,0.5"
        raise UsageError(msg)
    return make_axis(name.strip(), values)


def make_axis(name: str, values: str | Sequence[object]) -> Axis:
    """Return an axis by name, of values as text or as they are.

    Raises UsageError as `read_axis` does.
    """
    setting = _varying(name, values)
    if isinstance(values, str):
        try:
            made = _read_values(setting, name, values.strip())
        except ValueError as error:
            msg = f"--vary {name}={values}: {error}"
            raise UsageError(msg) from error
    else:
        made = Axis(
            key=setting.key, name=name, values=tuple(_given(setting, one) for one in values)
        )
    if made.distribution is None and not 0 < len(made.values) <= MOST_VALUES:
        msg = f"--vary {name}: expected 1 to {MOST_VALUES} values, got {len(made.values)}"
        raise UsageError(msg)
    shown = Counter(made.shown(value) for value in made.values)
    if twice := next((one for one, count in shown.items() if count > 1), None):
        msg = f"--vary {name}: {twice} is given twice"
        raise UsageError(msg)
    for value in made.values:
        if refused := setting.kind.refusal(value):
            msg = f"--vary {name}: expected {refused}, got {value!r}"
            raise UsageError(msg)
    return made


@cache
def varying() -> Mapping[str, Setting]:
    """Return everything that varies, by the key of its column."""
    settings = [one for one in declared(Setup) if one.key not in _SEPARATE]
    return {one.key: one for one in (MISSION, WIND_M_S, WIND_FROM_DEG, GUST_M_S, *settings)}


def varying_names() -> Iterator[str]:
    """Yield the name of everything that varies, as the options are called."""
    yield from ("mission", "wind", "wind-from", "gust")
    for setting in varying().values():
        if setting.option and setting.key != "wind":
            yield _option_name(setting)


def _option_name(setting: Setting) -> str:
    return setting.option.partition("/")[0].removeprefix("--")


def _varying(name: str, values: str | Sequence[object]) -> Setting:
    """Return what varies under a name: an option, a key, or the end of one option alone."""
    wanted = name.removeprefix("--").replace("_", "-")
    is_whole = (
        "@" in values
        if isinstance(values, str)
        else any(not isinstance(one, int | float) for one in values)
    )
    if wanted in WIND_PARTS and not (wanted == "wind" and is_whole):
        return WIND_PARTS[wanted]
    for part in (MISSION, WIND_M_S, WIND_FROM_DEG, GUST_M_S):
        if wanted == part.key.replace("_", "-"):
            return part
    settings = [one for one in varying().values() if one.option]
    for one in settings:
        if wanted in {_option_name(one), one.key.replace("_", "-")}:
            return one
    ending = [one for one in settings if _option_name(one).endswith(f"-{wanted}")]
    if len(ending) == 1:
        return ending[0]
    if ending:
        names = " or ".join(_option_name(one) for one in ending)
        msg = f"--vary {name}: write {names}"
        raise UsageError(msg)
    msg = (
        f"--vary {name}: no setting of a check has this name{nearest_hint(wanted, varying_names())}"
    )
    raise UsageError(msg)


def _given(setting: Setting, value: object) -> object:
    """Return a value of a script as the kind of its setting reads it."""
    if isinstance(value, str):
        try:
            return setting.kind.read(value)
        except ValueError as error:
            msg = f"--vary {setting.key}: {error}"
            raise UsageError(msg) from error
    return value


def _read_values(setting: Setting, name: str, text: str) -> Axis:
    kind = setting.kind
    if isinstance(kind, Number) and (call := _CALL.fullmatch(text)):
        return Axis(
            key=setting.key, name=name, distribution=_read_distribution(kind, *call.groups())
        )
    if isinstance(kind, Switch):
        return Axis(key=setting.key, name=name, values=tuple(map(_read_switch, text.split(","))))
    parts = [part.strip() for part in text.split(",")]
    if not all(parts):
        msg = "a value is missing beside a comma"
        raise ValueError(msg)
    values: list[Any] = []
    for part in parts:
        if isinstance(kind, Number) and part.count(":") == 2:
            values += _range(kind, part)
        elif isinstance(kind, Number) and ":" in part:
            msg = f"a range is FROM:TO:STEP, such as 0:12:1, got {part!r}"
            raise ValueError(msg)
        else:
            values.append(kind.read(_whole_fraction(kind, part, parts)))
    return Axis(key=setting.key, name=name, values=tuple(values))


def _read_switch(text: str) -> bool:
    try:
        return {"true": True, "yes": True, "false": False, "no": False}[text.strip().lower()]
    except KeyError:
        msg = f"expected yes or no, got {text!r}"
        raise ValueError(msg) from None


def _whole_fraction(kind: object, part: str, parts: Sequence[str]) -> str:
    """Return the ``1`` of ``1,0.8`` as all of it: beside fractions below 1 it is not 1 %."""
    is_bare = part == "1" and isinstance(kind, Fraction) and not any("%" in one for one in parts)
    return "1.0" if is_bare and len(parts) > 1 else part


def _range(kind: Number, text: str) -> Iterator[float]:
    """Yield the values of ``FIRST:LAST:STEP``, both ends among them.

    Raises ``ValueError`` where the steps do not lead to the last.
    """
    first, last, step = (
        Decimal(repr(mean_of(kind.read_one(_whole_fraction(kind, part.strip(), text.split(":"))))))
        for part in text.split(":")
    )
    if not step:
        msg = f"the step of {text} is 0"
        raise ValueError(msg)
    step = abs(step) if last >= first else -abs(step)
    count = (last - first) / step
    if abs(count - round(count)) > _ON_GRID:
        reached = first + step * int(count)
        msg = f"steps of {abs(step)} from {first} lead to {reached}, not to {last}"
        raise ValueError(msg)
    if count >= MOST_VALUES:
        msg = f"{text} are more than {MOST_VALUES} values"
        raise ValueError(msg)
    for number in range(round(count) + 1):
        yield float(first + number * step)


def _read_distribution(kind: Number, law: str, parameters: str) -> Distribution:
    known = LAWS.get(law)
    if known is None:
        forms = ", ".join(f"{name}({one.parameters})" for name, one in LAWS.items())
        msg = f"expected {forms}, got {law}(…){nearest_hint(law, LAWS)}"
        raise ValueError(msg)
    # Of a Weibull's shape there is no unit; what has one is read as the setting's values are.
    numbers = tuple(
        quantity.read_number(one) if law == "weibull" and not i else kind.read_one(one.strip())
        for i, one in enumerate(parameters.split(","))
    )
    if len(numbers) != known.count or not known.is_possible(*numbers):
        msg = f"expected {law}({known.parameters}), got {law}({parameters})"
        raise ValueError(msg)
    return Distribution(law=law, parameters=numbers)


def number_of(value: object) -> float | None:
    """Return the number of a value that has one, for the statistics; ``None``: it has none."""
    if isinstance(value, Spread):
        return value.mean
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else None  # type: ignore[arg-type] # it is a number
