"""What a setting is: one thing a user can set, declared once, and how its value is written.

A setting is declared beside the field of the value that holds it (`planner.setup`).  The command
line, the configuration file, the fields of the terminal UI, the ``conditions`` of the JSON, the rows
of the reports and the tables of the README iterate over the declarations.
"""

from __future__ import annotations

import math
import re
from enum import Enum
from functools import cache
from inspect import Parameter, Signature
from numbers import Real
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Concatenate,
    ParamSpec,
    Self,
    TypeGuard,
    TypeVar,
    dataclass_transform,
)

import msgspec

from planner.errors import UsageError, described, is_number, nearest_hint
from planner.quantity import (
    PLUS_MINUS,
    Spread,
    exact,
    exact_percent,
    read_fraction,
    read_in,
    read_number,
)
from planner.selection import FileIgnore, make_file_ignore
from planner.units import (
    FREEZING_F,
    KELVINS_PER_FAHRENHEIT,
    LENGTH_UNITS_M,
    MASS_UNITS_KG,
    SPEED_UNITS_M_S,
    TIME_UNITS_S,
)
from planner.values import Value, ValueType, force_setattr, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from planner.selection import Exemption

P = ParamSpec("P")
Subject = TypeVar("Subject")
Outcome = TypeVar("Outcome")
_ENDINGS = tuple(f"_{unit}" for unit in ("m_s", "m", "s", "c", "kg", "deg", "hpa"))
"""What keys end in and options do not."""
_UNITS = {"m/s": SPEED_UNITS_M_S, "m": LENGTH_UNITS_M, "kg": MASS_UNITS_KG, "s": TIME_UNITS_S}
"""Units that are read for a setting, by the one it counts in."""
_COMPASS = tuple("N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW".split())  # noqa: SIM905 - read at a glance
"""Points of the compass, 22.5° apart."""
SettingValue = Any
"""The value of a setting: each kind has its own."""


class Kind:
    """How the values of a setting are written: text that is read, and text that reads back."""

    holds = "text"
    """What the key of a TOML file holds, in the words of the documentation."""
    is_repeated = False
    """Whether its option may be given several times; its values are tuples then."""
    is_file = False
    metavar = ""
    """What its option takes, for the help."""
    made_by = "a number"
    """What a script gives that has a value of a wrong type."""

    def read(self, text: str) -> SettingValue:
        """Return the value of a text; raise ``ValueError`` with a sentence."""
        return text

    def text(self, value: SettingValue) -> str:
        """Return the text that reads back as a value; raise ``ValueError`` where there is none."""
        return str(value)

    def choices(self) -> Iterable[str]:
        """Return what a shell offers."""
        return ()

    def from_toml(self, raw: object, file: Path) -> SettingValue:  # noqa: ARG002 - paths count from it
        """Return the value of what TOML holds; raise ``ValueError`` with a sentence."""
        if isinstance(raw, str) and "text" in self.holds:
            return self.read(raw)
        if is_number(raw) and "number" in self.holds:
            return self.read(repr(raw))
        raise self.wrong(raw)

    def wrong(self, raw: object) -> ValueError:
        """Return the error for what TOML holds."""
        got = "an empty text" if raw == "" else described(raw)
        return ValueError(f"must be {self.holds}, got {got}")

    def refusal(self, value: SettingValue) -> str:  # noqa: ARG002 - those with a range need it
        """Return what a value of the right type must be; empty where it is."""
        return ""


class Number(Kind):
    """A number with its unit in a range, perhaps not known exactly: ``0.5``, ``0.5kg``, ``0.5±0.1``.

    An open range does not hold the least; the hint is asked of whoever gives more than the greatest.
    """

    def __init__(
        self,
        unit: str,
        low: float,
        high: float,
        *,
        is_open: bool = False,
        with_spread: bool = False,
        hint: str = "",
    ) -> None:
        self.unit, self.low, self.high = unit, low, high
        self.is_open, self.with_spread, self.hint = is_open, with_spread, hint
        self.holds = "text or number" if with_spread else "number"
        self.metavar = unit.upper().replace("/", "_")
        if with_spread:
            self.made_by = "a number, or planner.Spread(mean=…, sd=…)"

    @property
    def range_text(self) -> str:
        """The range in words: ``0 to 100 s``, ``above 0 and at most 100 m/s``."""
        unit = "°C" if self.unit == "C" else self.unit
        low, high = self.low, self.high
        words = f"above {low:g} and at most {high:g}" if self.is_open else f"{low:g} to {high:g}"
        return f"{words} {unit}".rstrip()

    def read(self, text: str) -> float | Spread:
        """Return the number, or the number and its standard deviation."""
        parts = (
            [part.strip() for part in re.split(PLUS_MINUS, text)] if self.with_spread else [text]
        )
        if len(parts) > 2 or (len(parts) == 2 and not all(parts)):
            msg = f"expected a value and its standard deviation, such as 5±2, got {text!r}"
            raise ValueError(msg)
        mean, *sd = self.read_parts(parts)
        if sd and not 0.0 <= sd[0] <= self.high - self.low:
            msg = f"expected a standard deviation of 0 to {self.high - self.low:g}, got {text!r}"
            raise ValueError(msg)
        if refused := self.refusal(mean):
            hint = f": {self.hint}" if self.hint and mean > self.high else ""
            msg = f"expected {refused}, got {text!r}{hint}"
            raise ValueError(msg)
        return Spread(mean=mean, sd=sd[0]) if sd and sd[0] else mean

    def read_parts(self, parts: list[str]) -> list[float]:
        """Return a number, or a number and its standard deviation, whose unit counts for both."""
        return [
            self.read_one(part) for part in with_unit_of_other(parts, _UNITS.get(self.unit, ()))
        ]

    def read_one(self, text: str) -> float:
        """Return a single number."""
        units = _UNITS.get(self.unit)
        return read_number(text, unit=self.unit) if units is None else read_in(text, units)

    def write_one(self, value: float) -> str:
        """Return a single number as text."""
        return exact(value)

    def text(self, value: float | Spread) -> str:
        """Return what reads back as a value."""
        if isinstance(value, Spread):
            return f"{self.write_one(value.mean)}±{self.write_one(value.sd)}"
        return self.write_one(value)

    def refusal(self, value: SettingValue) -> str:
        """Return the range, where a value is outside."""
        if type(value) is not float and not isinstance(value, Real | Spread):
            return ""
        mean = value.mean if isinstance(value, Spread) else float(value)
        inside = self.low < mean if self.is_open else self.low <= mean
        return "" if inside and mean <= self.high else self.range_text


def with_unit_of_other(parts: Sequence[str], units: Iterable[str]) -> list[str]:
    """Return a number and its standard deviation with the unit that one of both has."""
    ends = [
        next(
            (one for one in sorted(units, key=len, reverse=True) if part.lower().endswith(one)), ""
        )
        for part in parts
    ]
    return [
        part if end else f"{part}{''.join(ends)}" for part, end in zip(parts, ends, strict=True)
    ]


class Temperature(Number):
    """A temperature in °C, or in °F where it says so: ``15``, ``15±5``, ``59F``, ``59±9 °F``."""

    def __init__(self, *, with_spread: bool = False) -> None:
        super().__init__("C", -90.0, 60.0, with_spread=with_spread)

    def read_parts(self, parts: list[str]) -> list[float]:
        """Return a temperature, or one and its standard deviation: a difference. [°C, K]"""
        return [
            self._difference(part, zero_f=0.0 if number else FREEZING_F)
            for number, part in enumerate(with_unit_of_other(parts, ("f", "c")))
        ]

    def _difference(self, text: str, *, zero_f: float) -> float:
        """Return how far a temperature is from what counts as zero. [K]"""
        if not text.lower().endswith("f"):
            return self.read_one(text)
        return (read_number(text, unit="F") - zero_f) * KELVINS_PER_FAHRENHEIT


class Bearing(Number):
    """A direction, clockwise from north, in degrees or by its point of the compass: ``270``, ``W``."""

    def __init__(self, *, with_spread: bool = False) -> None:
        super().__init__("deg", 0.0, 360.0, with_spread=with_spread)

    def read_one(self, text: str) -> float:
        """Return a single direction. [°]"""
        point = text.strip().upper()
        if point in _COMPASS:
            return 360.0 * _COMPASS.index(point) / len(_COMPASS)
        try:
            return super().read_one(text.replace("°", ""))
        except ValueError:
            msg = f"expected degrees or a point of the compass such as NW, got {text!r}"
            raise ValueError(msg) from None


class Fraction(Number):
    """A fraction from 0 to 1, as a percentage: ``20%``, ``0.2``, ``95±2%``."""

    def __init__(self, *, is_open: bool = False, with_spread: bool = False) -> None:
        super().__init__("", 0.0, 1.0, is_open=is_open, with_spread=with_spread)
        self.holds, self.metavar = "text or number", "FRACTION"

    @property
    def range_text(self) -> str:
        """The range in words."""
        return "a fraction above 0 and at most 1" if self.is_open else "a fraction from 0 to 1"

    def read_parts(self, parts: list[str]) -> list[float]:
        """Return a fraction, or two, where 95±2% is 95 % ± 2 %."""
        if parts[-1].endswith("%") and not parts[0].endswith("%"):
            if 0.0 < read_number(parts[0]) < 1.0:
                written = "±".join(parts)
                msg = f"{written!r} is ambiguous: write a percent sign behind both, or behind none"
                raise ValueError(msg)
            parts[0] += "%"
        return super().read_parts(parts)

    def read_one(self, text: str) -> float:
        """Return a fraction."""
        return read_fraction(text)

    def write_one(self, value: float) -> str:
        """Return a fraction as a percentage."""
        return exact_percent(value)

    def text(self, value: float | Spread) -> str:
        """Return what reads back as a value."""
        if isinstance(value, Spread) and not self.write_one(value.mean).endswith("%"):
            return f"{value.mean!r}±{value.sd!r}"
        return super().text(value)


class Form(Kind):
    """A value with a form of its own, read and written by a pair of functions."""

    def __init__(
        self, read: Callable[[str], Any], text: Callable[[Any], str], holds: str = "text"
    ) -> None:
        self._read, self._text = read, text
        self.holds = holds

    def read(self, text: str) -> SettingValue:
        """Return the value of a text."""
        return self._read(text)

    def text(self, value: SettingValue) -> str:
        """Return what reads back as a value."""
        return self._text(value)


class Choice(Kind):
    """One of a few values, each with its name."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.values = values
        self.metavar = "|".join(values)

    def read(self, text: str) -> SettingValue:
        """Return the value of a name."""
        if text not in self.values:
            hint = nearest_hint(text, self.values)
            msg = f"expected one of {', '.join(self.values)}, got {text!r}{hint}"
            raise ValueError(msg)
        return self.values[text]

    def text(self, value: object) -> str:
        """Return the name of a value."""
        return next(name for name, one in self.values.items() if one == value)

    def choices(self) -> Iterable[str]:
        """Return the names."""
        return self.values


class Switch(Kind):
    """On or off."""

    holds = "true or false"

    def text(self, value: object) -> str:
        """Return what TOML holds of it."""
        return str(value).lower()

    def from_toml(self, raw: object, file: Path) -> bool:
        """Return what TOML holds."""
        return raw if isinstance(raw, bool) else super().from_toml(raw, file)


class File(Kind):
    """A path, in a file counted from its folder."""

    holds = "path"
    is_file = True
    metavar = "FILE"

    def read(self, text: str) -> SettingValue:
        """Return the path."""
        return Path(text)

    def from_toml(self, raw: object, file: Path) -> SettingValue:
        """Return the path counted from the folder of the file."""
        if isinstance(raw, str) and raw:
            return self.read(self.beside(raw, file.parent))
        raise self.wrong(raw)

    def beside(self, text: str, folder: Path) -> str:
        """Return a path counted from a folder."""
        return str(folder / text)


class Files(File):
    """Paths."""

    holds = "path or list of paths"
    is_repeated = True

    def read(self, text: str) -> tuple[Path, ...]:
        """Return the path, as one of several."""
        return (Path(text),)

    def text(self, value: SettingValue) -> str:
        """Return a path, or several with commas."""
        return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)

    def from_toml(self, raw: object, file: Path) -> SettingValue:
        """Return the paths counted from the folder of the file."""
        if isinstance(raw, list) and raw and all(isinstance(one, str) and one for one in raw):
            return tuple(file.parent / one for one in raw)
        return super().from_toml(raw, file)


class NameOrFile(File):
    """The name of what is shipped, or the path of a file that ends as it must."""

    def __init__(self, holds: str, suffix: str, names: Callable[[], Iterable[str]]) -> None:
        self.holds, self._suffix, self._names = holds, suffix, names

    def read(self, text: str) -> str:
        """Return the name or path as it is."""
        return text

    def choices(self) -> Iterable[str]:
        """Return the names."""
        return self._names()

    def beside(self, text: str, folder: Path) -> str:
        """Return a path counted from a folder, and a name as it is."""
        is_path = text.endswith(self._suffix) or Path(text).name != text
        return str(folder / text) if is_path else text


class Codes(Kind):
    """Codes of rules or their beginnings, separated by commas."""

    holds = "text or list of texts"
    is_repeated = True
    metavar = "CODES"

    def __init__(self, known: Callable[[], Iterable[str]]) -> None:
        self._known = known

    def read(self, text: str) -> tuple[str, ...]:
        """Return the codes."""
        codes = tuple(code.strip().upper() for code in text.split(",") if code.strip())
        known = tuple(self._known())
        for code in codes:
            if not any(rule.startswith(code) for rule in known):
                msg = f"no rule's code begins with {code!r}{nearest_hint(code, known)} (mavjoule rules)"
                raise ValueError(msg)
        return codes

    def text(self, value: tuple[str, ...]) -> str:
        """Return the codes with commas."""
        return ",".join(value)

    def choices(self) -> Iterable[str]:
        """Return every code."""
        return self._known()

    def from_toml(self, raw: object, file: Path) -> tuple[str, ...]:  # noqa: ARG002 - as the others
        """Return the codes of a text or a list."""
        if isinstance(raw, str):
            return self.read(raw)
        if isinstance(raw, list) and all(isinstance(one, str) for one in raw):
            return self.read(",".join(raw))
        raise self.wrong(raw)


class IgnoredCodes(Codes):
    """Codes of rules to ignore: none of those that take part in every verdict.

    Parameters
    ----------
    known : callable
        Returns every code.
    kept_on : callable
        Returns what to give instead of ignoring a rule, by the codes that cannot be ignored.
    """

    def __init__(
        self, known: Callable[[], Iterable[str]], kept_on: Callable[[], Mapping[str, str]]
    ) -> None:
        super().__init__(known)
        self._kept_on = kept_on

    def read(self, text: str) -> tuple[str, ...]:
        """Return the codes."""
        codes = super().read(text)
        kept_on = self._kept_on()
        for code in codes:
            if code in kept_on:
                msg = f"{code} cannot be ignored: it takes part in every verdict; give {kept_on[code]}"
                raise ValueError(msg)
        return codes


class CodesByFile(IgnoredCodes):
    """A table of codes by the pattern of a mission's path."""

    holds = "table of codes by file"

    def text(self, value: SettingValue) -> str:
        """Return the codes that are ignored of one mission, each with its item."""
        exemptions: tuple[Exemption, ...] = value
        return ",".join(
            code if one.item is None else f"{code}#{one.item}"
            for one in exemptions
            for code in one.codes
        )

    def from_toml(self, raw: object, file: Path) -> SettingValue:
        """Return what the table ignores."""
        if not isinstance(raw, dict):
            raise self.wrong(raw)
        return tuple(self._ignore(key, codes, file) for key, codes in raw.items())

    def _ignore(self, key: str, raw: object, file: Path) -> FileIgnore:
        try:
            codes = IgnoredCodes(self._known, self._kept_on).from_toml(raw, file)
            return make_file_ignore(key, codes, configuration=file)
        except ValueError as error:
            msg = f"{key!r}: {error}"
            raise ValueError(msg) from error


class Group(Enum):
    """What a setting decides; commands take settings by group."""

    FLIGHT = "how a mission is flown"
    BATTERY = "what flies it"
    JUDGEMENT = "whether it is a go"
    FLEET = "missions that are flown at the same time"
    REPORT = "where the report of a call goes, and how"


class Row(Value, kw_only=False):
    """One number of a setting in the ``conditions`` of the JSON and the tables of the reports."""

    key: str
    label: str
    shown: Callable[[float | None], str]
    of: Callable[[Any], float | None] = lambda value: value
    """The number, from the value of the setting."""


class Setting(Value, kw_only=False):
    """One thing a user can set."""

    kind: Kind
    group: Group
    help: str
    option: str = ""
    """Name on the command line, by default the key without its unit; empty where it has none."""
    is_option: bool = True
    metavar: str = ""
    """By default that of the kind."""
    unset: str = ""
    """What holds where it is not given, for the help and the terminal UI."""
    key: str = ""
    """Key of the configuration, with its unit; by default the name of the field."""
    field: str = ""
    """The field that holds it; given by the class it is declared in."""
    made_by: str = ""
    """What a script gives that has a value of a wrong type; by default as of the kind."""
    load: Callable[[Any], Any] | None = None
    """From what is written to what the field holds, where that is read from a file."""
    into: Callable[[Any, Any], Any] | None = None
    """The value of the field with that of this setting, where it is one of several of a field."""
    label: str = ""
    """Short name of its field in the terminal UI; empty: it has none there."""
    example: str = ""
    """In that field while it is empty; by default what holds."""
    is_none_unset: bool = False
    """Whether a script may give ``None`` for the default."""
    in_file: bool = True
    """Whether it may stand in a configuration; nothing may there that names what is written."""
    rows: tuple[Row, ...] = ()
    phrase: Callable[[Any], str] | None = None
    """A value in the one line about the conditions of a flight."""

    def loaded(self, written: Any) -> Any:  # noqa: ANN401 - each kind has its own
        """Return what the field holds of what is written."""
        return written if self.load is None else self.load(written)

    @property
    def help_text(self) -> str:
        """The help with what holds where it is not given."""
        return f"{self.help} [default: {self.unset}]" if self.unset else self.help


def is_finite_number(value: object) -> bool:
    """Return whether a value is a number, of numpy or Python, and neither NaN nor infinite."""
    try:
        return _is_number(value) and math.isfinite(value)
    except OverflowError:  # a whole number beyond any float
        return False


def _is_number(value: object) -> TypeGuard[float]:
    kind = type(value)
    return kind is float or kind is int or (isinstance(value, Real) and kind is not bool)


class _Field(Value):
    default: object
    settings: tuple[Setting, ...]


def setting(
    *declared: Any,  # noqa: ANN401 - as of `Setting`
    default: Any = msgspec.NODEFAULT,  # noqa: ANN401 - of the field's type
    also: tuple[Setting, ...] = (),
    **more: Any,  # noqa: ANN401 - as of `Setting`
) -> Any:  # noqa: ANN401 - what the field holds
    """Return a field that is set by a setting, and perhaps by others, declared as `Setting`."""
    return _Field(default=default, settings=(Setting(*declared, **more), *also))


class _DeclaredType(ValueType):
    """Takes the settings of the fields out of their declarations."""

    def __new__(
        mcls,
        name: str,
        bases: tuple[type, ...],
        namespace: dict[str, Any],
        **options: Any,  # noqa: ANN401 - those of `msgspec.Struct`
    ) -> ValueType:
        fields = {key: one for key, one in namespace.items() if isinstance(one, _Field)}
        settings = dict(*(vars(base)["_settings"] for base in bases if "_settings" in vars(base)))
        for key, one in fields.items():
            namespace.pop(key)
            if one.default is not msgspec.NODEFAULT:
                namespace[key] = one.default
            settings[key] = tuple(_whole(declared, key) for declared in one.settings)
        return super().__new__(mcls, name, bases, namespace | {"_settings": settings}, **options)


def _whole(setting: Setting, field: str) -> Setting:
    """Return a setting with what follows from its field and its kind."""
    key = setting.key or field
    unit = next((one for one in _ENDINGS if key.endswith(one)), "")
    option = setting.option or f"--{key.removesuffix(unit)}".replace("_", "-")
    if isinstance(setting.kind, Switch):
        option += option.replace("--", "/--no-")
    return replace(
        setting,
        field=field,
        key=key,
        option=option if setting.is_option else "",
        metavar=setting.metavar or setting.kind.metavar,
        made_by=setting.made_by or setting.kind.made_by,
    )


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(setting,))
class Declared(Value, metaclass=_DeclaredType):
    """A value whose fields are declared as settings, and refused by their declarations."""

    _settings: ClassVar[Mapping[str, tuple[Setting, ...]]]

    def __post_init__(self) -> None:
        for name, (setting, types, default) in _fields(type(self)).items():
            value = getattr(self, name)
            if value is default:
                continue
            if value is None and setting.is_none_unset:
                force_setattr(self, name, default)
            elif type(value) is str and value in getattr(setting.kind, "values", ()):  # by its name
                force_setattr(self, name, setting.kind.read(value))
            elif problem := _problem(setting, types, value):
                msg = f"{name} must be {problem}"
                raise UsageError(msg)

    @classmethod
    def of(
        cls, values: Mapping[str, Any], *, loaded: Callable[[Setting, Any], Any] = Setting.loaded
    ) -> Self:
        """Return what settings by key make; what is absent or ``None`` is as it is by default.

        ``loaded`` returns what a field holds of what is written; ``None``: as it is by default.

        Raises
        ------
        InputError
            If a file that a setting names is unusable.
        UsageError
            If a value is out of its range.
        """
        fields: dict[str, Any] = {}
        for setting in declared(cls):
            if (value := values.get(setting.key)) is None:
                continue
            if (value := loaded(setting, value)) is None:
                continue
            if setting.into is not None:
                default = _fields(cls)[setting.field][2]
                value = setting.into(fields.get(setting.field, default), value)
            fields[setting.field] = value
        return cls(**fields)


@cache
def declared(cls: type[Declared]) -> tuple[Setting, ...]:
    """Return the settings of a value, in the order they are declared in."""
    return tuple(setting for several in cls._settings.values() for setting in several)


@cache
def _fields(cls: type[Declared]) -> dict[str, tuple[Setting, frozenset[str], object]]:
    """Return the first setting of each field, the names of its types, and its default."""
    names, values = cls.__struct_fields__, cls.__struct_defaults__
    defaults = dict(zip(reversed(names), reversed(values), strict=False))
    types = {
        name: re.sub(r"\[.*?\]", "", annotation).replace("None", "NoneType").split(" | ")
        for base in reversed(cls.__mro__)
        for name, annotation in vars(base).get("__annotations__", {}).items()
    }
    return {
        name: (several[0], frozenset(types[name]), defaults.get(name, msgspec.NODEFAULT))
        for name, several in cls._settings.items()
    }


@cache
def _is_of(bases: tuple[type, ...], types: frozenset[str]) -> bool:
    """Return whether a type with these bases is one of some."""
    return any(base.__name__ in types for base in bases)


def _problem(setting: Setting, types: frozenset[str], value: SettingValue) -> str:
    """Return what a value must be, and what it is; empty where it is right."""
    if _is_number(value) and "float" in types:
        if not is_finite_number(value):
            return f"a finite number, got {value!r}"
    elif not _is_of(type(value).__mro__, types):
        shown = repr(value) if len(repr(value)) <= 60 else f"a {type(value).__name__}"
        return f"{setting.made_by}: got {shown}"
    refused = setting.kind.refusal(value)
    return f"{refused}, got {value!r}" if refused else ""


Made = TypeVar("Made", bound=Declared)


def taking_settings(
    name: str, use: Callable[[Subject, Made], Outcome], make: Callable[P, Made]
) -> Callable[Concatenate[Subject, P], Outcome]:
    """Return a use case, by its public name, that takes the fields of a declared value as keywords."""

    def call(subject: Subject, /, *args: P.args, **settings: P.kwargs) -> Outcome:
        return use(subject, make(*args, **settings))

    cls: SettingValue = make
    subject_name, settings_name = use.__code__.co_varnames[:2]
    parameters = [Parameter(subject_name, Parameter.POSITIONAL_ONLY)]
    told = []
    for field, (setting, types, default) in _fields(cls).items():
        is_given = default is msgspec.NODEFAULT
        is_positional = field in cls.__match_args__
        parameters.append(
            Parameter(
                field,
                Parameter.POSITIONAL_OR_KEYWORD if is_positional else Parameter.KEYWORD_ONLY,
                default=Parameter.empty if is_given else default,
            )
        )
        kinds = " or ".join(sorted(types - {"NoneType"}))
        told.append(
            f"{field} : {kinds}{'' if is_given else ', optional'}\n        {setting.help_text}"
        )
    before, _, after = (use.__doc__ or "").partition(f"{settings_name} : ")
    _, end, after = after.partition("\n\n")
    call.__doc__ = before + "\n    ".join(told) + end + after
    call.__name__ = call.__qualname__ = name
    call.__module__ = use.__module__
    vars(call)["__signature__"] = Signature(parameters)
    return call
