"""JSON text as Python values with their places in the text.

Strict where leniency would hide something: a repeated key, ``NaN`` and ``Infinity``, numbers too
large for a double and absurd nesting are refused, each with its line and column.
"""

from __future__ import annotations

import math
import re
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import msgspec
import numpy as np

from planner.errors import MissionFileError
from planner.findings import Place
from planner.mission.formats.exchange import FILE_ENCODING
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from json import JSONDecodeError

    import numpy.typing as npt

    from planner.findings import Finding

    Codes = npt.NDArray[np.uint8] | npt.NDArray[np.uint32]
    Offsets = npt.NDArray[np.intp]


DEEPEST_NESTING = 64
"""Plans nest about 8 deep."""
LONGEST_INTEGER = 4000
"""Python converts no more than 4300 digits."""

_DIGIT_BLOCK = 150
"""A run of 300 digits, more than a double holds, covers a whole aligned block of this length."""
_SPACES = frozenset(" \t\n\r")
_NUMBER = r'(?s)"(?:[^"\\]|\\.)*"|(-?Infinity|NaN|-?[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)'
_SENTENCES = (
    ("control character", "a text holds a line break or another control character"),
    ("escape", "a text holds a backslash that JSON does not know"),
    ("unterminated", "a text that begins here is not closed: the file may be cut off"),
    ("extra data", "'{rest}' follows the end of the JSON: a file holds one value only"),
    ("property name", "expected a key in double quotes, found '{rest}'"),
    ("':'", "expected a colon after the key, found '{rest}'"),
    ("','", "expected a comma or a closing bracket, found '{rest}'"),
    ("", "expected a value, found '{rest}'"),
)
"""What the standard library's messages are about; their wording differs between its versions."""


class SourceText(Value, eq=False, dict=True):
    """A text and where its lines end."""

    source: str
    """File name as the user gave it."""
    text: str
    """Without a byte order mark."""

    @cached_property
    def codes(self) -> Codes:
        """The text's code points, one per character. [n]"""
        return _codes(self.text)

    @cached_property
    def line_ends(self) -> Offsets:
        """Offset of each line feed. [n]"""
        return np.flatnonzero(self.codes == ord("\n"))

    def count(self, character: str) -> int:
        """Return how often a character occurs: of what is frequent faster than `str.count`."""
        return int(np.count_nonzero(self.codes == ord(character)))

    def place(self, offset: int) -> Place:
        """Return the line and column of a character."""
        line = int(np.searchsorted(self.line_ends, offset))
        start = 0 if line == 0 else int(self.line_ends[line - 1]) + 1
        return Place(line + 1, offset - start + 1)

    def refuse(self, message: str, offset: int) -> NoReturn:
        """Raise the error about an offset."""
        raise MissionFileError(message, source=self.source, place=self.place(offset))


class JsonDocument(Value, eq=False, dict=True):
    """A parsed JSON text; its values are not to be changed."""

    origin: SourceText
    root: Any
    """Its value, made of ``dict``, ``list``, ``str``, ``int``, ``float``, ``bool`` and ``None``."""
    findings: tuple[Finding, ...]
    objects: Sequence[dict[str, Any]]
    """All of it, in the order in which they open."""
    is_clean: bool
    """Whether every brace opens or closes an object: none stands in a text."""

    @cached_property
    def starts(self) -> Mapping[int, int]:
        """Offset of the opening brace of each object, by the object's ``id``."""
        codes = self.origin.codes
        is_opening = codes == ord("{")
        if self.is_clean:
            braces = np.flatnonzero(is_opening)
        else:
            offsets, _ = _brackets(self.origin)
            braces = offsets[is_opening[offsets]]
        return dict(zip(map(id, self.objects), braces.tolist(), strict=True))

    def place(self, container: dict[str, Any], *path: str | int) -> Place:
        """Return where an object of this document (not an equal one), or a value inside it, begins.

        Where the path of keys and indexes breaks off, the place of the last value there is.
        """
        return self.origin.place(self._offset(container, *path))

    def places(self, objects: Iterable[dict[str, Any]]) -> tuple[Place, ...]:
        """Return where each of many objects of this document begins."""
        offsets = np.array([self.starts[id(each)] for each in objects], np.intp)
        lines = np.searchsorted(self.origin.line_ends, offsets)
        # Before the first line feed there is, as it were, one at offset −1.
        columns = offsets - np.concatenate(([-1], self.origin.line_ends))[lines]
        return tuple(map(Place, (lines + 1).tolist(), columns.tolist()))

    def element_places(self, container: dict[str, Any], *path: str | int) -> tuple[Place, ...]:
        """Return where each element of a list inside an object of this document begins."""
        offset = self._offset(container, *path)
        return tuple(self.origin.place(at) for _, at in _members(self.origin.text, offset))

    def refuse(self, message: str, container: dict[str, Any], *path: str | int) -> NoReturn:
        """Raise the error about an object of this document or a value inside it."""
        self.origin.refuse(message, self._offset(container, *path))

    def _offset(self, container: dict[str, Any], *path: str | int) -> int:
        offset = self.starts[id(container)]
        for step in path:
            members = _members(self.origin.text, offset)
            inner = next((at for key, at in members if key == step), None)
            if inner is None:
                break
            offset = inner
        return offset


def describe(value: object) -> str:
    """Return what a JSON value is, in words: ``the text 'abc'``, ``a list of 3``."""
    if isinstance(value, str):
        return f"the text '{value[:40]}'"
    if value is None or isinstance(value, bool):
        return {None: "null", False: "false", True: "true"}[value]
    if isinstance(value, int | float):
        return f"{value:.17g}" if abs(value) < 1e300 else "a number beyond all measure"
    return f"a list of {len(value)}" if isinstance(value, list) else "an object"


def parse_json(text: str, *, source: str) -> JsonDocument:
    """Parse a JSON text, keeping the place of every object; a byte order mark gives a finding."""
    findings: tuple[Finding, ...] = ()
    if text.startswith("\ufeff"):
        text = text.removeprefix("\ufeff")
        message = "the JSON text begins with a byte order mark: other loaders refuse it"
        findings = (FILE_ENCODING.finding(message, place=Place(1, 1)),)
    origin = SourceText(source=source, text=text)
    try:
        root = msgspec.json.decode(text)
        inside = _contents(root, in_lists_of_values=False)
    except (msgspec.MsgspecError, RecursionError, ValueError):
        inside = None
    # As many colons as keys: no key comes twice.  As many brackets as lists and objects: no text holds
    # one, and no list begins with a value and goes on with them.
    is_clean = (
        inside is not None
        and inside.depth < DEEPEST_NESTING
        and origin.count(":") == inside.keys
        and origin.count("[") == inside.lists
        and origin.count("{") == len(inside.objects)
    )
    if inside is None or not is_clean:
        offsets, depths = _brackets(origin)
        if depths.max(initial=0) > DEEPEST_NESTING:
            message = f"brackets nest deeper than {DEEPEST_NESTING}: no mission does"
            origin.refuse(message, int(offsets[np.argmax(depths > DEEPEST_NESTING)]))
        root = _load(origin)
        inside = _contents(root, in_lists_of_values=True)
    return JsonDocument(
        origin=origin, root=root, findings=findings, objects=inside.objects, is_clean=is_clean
    )


class _Contents(Value, kw_only=False, eq=False):
    """What a JSON value holds."""

    objects: list[dict[str, Any]]
    """In the order in which they open, itself the first where it is one."""
    keys: int
    lists: int
    depth: int


def _contents(root: object, *, in_lists_of_values: bool) -> _Contents:
    """Return what a JSON value holds, in lists that begin with no list or object where asked for."""
    objects: list[dict[str, Any]] = []
    keys = lists = deepest = 0

    def look_into(value: Any, depth: int) -> None:  # noqa: ANN401 (whatever JSON holds)
        nonlocal keys, lists, deepest
        deepest = max(deepest, depth)
        for inner in value:
            kind = type(inner)
            if kind is dict:
                objects.append(inner)
                keys += len(inner)
                look_into(inner.values(), depth + 1)
            elif kind is list:
                lists += 1
                if in_lists_of_values or (inner and type(inner[0]) in _CONTAINERS):
                    look_into(inner, depth + 1)

    look_into((root,), 0)
    return _Contents(objects, keys, lists, deepest)


_CONTAINERS = frozenset({dict, list})


def _load(origin: SourceText) -> Any:  # noqa: ANN401 (whatever JSON holds)
    """Return the value of a text, or refuse it."""
    closed = 0
    repeating: list[int] = []

    def keep(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        nonlocal closed
        value = dict(pairs)
        if len(value) != len(pairs):
            repeating.append(closed)
        closed += 1
        return value

    import json

    try:
        root = json.loads(
            origin.text,
            object_pairs_hook=keep,
            parse_float=_finite if _may_overflow(origin.codes) else None,
            parse_constant=_finite,
        )
    except json.JSONDecodeError as error:
        origin.refuse(_explain(error), error.pos)
    except _NotFiniteError as error:
        token = error.args[0]
        message = f"{token[:40]} is not a finite number: write null where a value is not known"
        origin.refuse(message, _number_offset(origin.text, lambda number: number == token))
    except RecursionError:
        origin.refuse("brackets nest too deep: no mission does", 0)
    except ValueError:  # an integer of more digits than Python converts
        message = f"a number of more than {LONGEST_INTEGER} digits"
        offset = _number_offset(origin.text, lambda number: len(number) > LONGEST_INTEGER)
        origin.refuse(message, offset)
    if repeating:
        at, key = _repeated_key(origin.text, _object_starts(origin)[repeating[0]])
        origin.refuse(f"the key '{key[:40]}' appears twice in one object: which one counts?", at)
    return root


class _NotFiniteError(Exception):
    """A number that is not finite, as it is written."""


def _finite(token: str) -> float:
    value = float(token)
    if not math.isfinite(value):
        raise _NotFiniteError(token)
    return value


def _codes(text: str) -> Codes:
    """Return the text's code points, one per character. [n]."""
    if text.isascii():
        return np.frombuffer(text.encode("ascii"), np.uint8)
    return np.frombuffer(text.encode("utf-32-le", "surrogatepass"), np.uint32)


def _brackets(origin: SourceText) -> tuple[Offsets, Offsets]:
    """Return the offset of every bracket outside strings, and the depth after it. [n], [n]."""
    text, codes = origin.text, origin.codes
    if "\\" in text:  # blank out escapes, so that every quote left begins or ends a string
        codes = _codes(re.sub(r"(?s)\\.", "__", text))
    folded = codes | 0x20  # makes [ into { and ] into }
    is_bracket = (folded == ord("{")) | (folded == ord("}"))
    marks = np.flatnonzero(is_bracket | (codes == ord('"')))
    is_quote = codes[marks] == ord('"')
    offsets = marks[~is_quote & (np.cumsum(is_quote) % 2 == 0)]
    depths = np.cumsum(np.where(folded[offsets] == ord("{"), 1, -1))
    return offsets, depths


def _object_starts(origin: SourceText) -> list[int]:
    """Return the offset of each object's opening brace, in the order in which objects close.

    At one depth opening and closing braces take turns, so sorted by depth they pair off one to
    one; the parser calls its hook in the order of the closing ones.
    """
    codes, (offsets, _) = origin.codes, _brackets(origin)
    braces = offsets[(codes[offsets] == ord("{")) | (codes[offsets] == ord("}"))]
    is_opening = codes[braces] == ord("{")
    depths = np.cumsum(np.where(is_opening, 1, -1))
    openings = braces[is_opening][np.argsort(depths[is_opening], kind="stable")]
    starts = np.empty_like(openings)
    starts[np.argsort(depths[~is_opening], kind="stable")] = openings
    found: list[int] = starts.tolist()
    return found


def _may_overflow(codes: Codes) -> bool:
    """Return whether any number may be beyond a double: has a positive exponent or 300 digits."""
    inner = np.flatnonzero((codes[1:-1] | 0x20) == ord("e")) + 1
    if np.any((codes[inner - 1] - ord("0") < 10) & (codes[inner + 1] != ord("-"))):
        return True
    whole = len(codes) // _DIGIT_BLOCK * _DIGIT_BLOCK
    digits = (codes[:whole] - ord("0")) < 10
    return bool(digits.reshape(-1, _DIGIT_BLOCK).all(axis=1).any())


def _members(text: str, offset: int) -> Iterator[tuple[str | int, int]]:
    """Yield the keys or indexes of the object or list at an offset, with their values' offsets.

    The text is JSON: it has been parsed before.
    """
    if text[offset] not in "{[":
        return
    from json import JSONDecoder

    decoder, is_object = JSONDecoder(), text[offset] == "{"
    at = _skip_space(text, offset + 1)
    index = 0
    while text[at] not in "}]":
        key: str | int = index
        if is_object:
            key, at = decoder.raw_decode(text, at)
            at = _skip_space(text, _skip_space(text, at) + 1)  # past the colon
        yield key, at
        _, at = decoder.raw_decode(text, at)
        at = _skip_space(text, at)
        if text[at] == ",":
            at = _skip_space(text, at + 1)
        index += 1


def _skip_space(text: str, at: int) -> int:
    while text[at : at + 1] in _SPACES:
        at += 1
    return at


def _repeated_key(text: str, offset: int) -> tuple[int, str]:
    """Return the first key that an object repeats, and the offset of what comes with it then."""
    seen: set[str | int] = set()
    for key, at in _members(text, offset):
        if key in seen:
            return at, str(key)
        seen.add(key)
    return offset, ""


def _number_offset(text: str, is_meant: Callable[[str], bool]) -> int:
    """Return where the first such number begins outside strings."""
    matches = re.finditer(_NUMBER, text)
    return next(match.start() for match in matches if match.group(1) and is_meant(match.group(1)))


def _explain(error: JSONDecodeError) -> str:
    """Return what is wrong with the text, in a sentence."""
    kind = error.msg.lower()
    before = error.doc[: error.pos].rstrip()[-1:]
    rest = error.doc[error.pos : error.pos + 20].split("\n")[0].strip()
    if not error.doc.strip():
        return "the file is empty"
    if not error.doc[error.pos :].strip():
        return "the JSON ends too early: the file is cut off"
    if "trailing comma" in kind or (before == "," and rest[:1] in {"}", "]"}):
        return "comma before a closing bracket: JSON allows none there"
    if rest.startswith(("//", "/*", "#")):
        return "JSON has no comments: delete this one"
    return next(sentence for gist, sentence in _SENTENCES if gist in kind).format(rest=rest)


LARGEST_NUMBER = 3.4e38
"""MAVLink sends numbers in 32 bits."""
LARGEST_LENGTH_M = 100_000.0
"""Beyond it a length or an altitude is a mistake. [m]"""

_NUMBER_TYPES = frozenset({int, float})


class JsonFields(Value):
    """An object of a document together with what it is called in messages."""

    document: JsonDocument
    value: dict[str, Any]
    title: str
    """As in "the fence", "item 7 (survey)"."""

    def refuse(self, message: str, *path: str | int) -> NoReturn:
        """Raise the error about this object or a value inside it."""
        self.document.refuse(f"{self.title}: {message}", self.value, *path)

    def place(self, *path: str | int) -> Place:
        """Return where this object or a value inside it begins."""
        return self.document.place(self.value, *path)

    def _refuse_value(self, expected: str, *path: str | int) -> NoReturn:
        value = self._at(path)
        name = " element ".join(f"'{s}'" if isinstance(s, str) else str(s + 1) for s in path)
        self.refuse(f"{name} is {describe(value)}, expected {expected}", *path)

    def _at(self, path: tuple[str | int, ...]) -> Any:  # noqa: ANN401 (whatever JSON holds)
        value: Any = self.value
        for step in path:
            value = value[step]
        return value

    def required(self, key: str) -> Any:  # noqa: ANN401 (whatever JSON holds)
        """Return a value that has to be there, whatever it is."""
        if key not in self.value:
            self.refuse(f"'{key}' is missing")
        return self.value[key]

    def fields(self, key: str, title: str) -> JsonFields:
        """Return the fields of an object inside this one."""
        value = self.required(key)
        if not isinstance(value, dict):
            self._refuse_value("an object", key)
        return JsonFields(document=self.document, value=value, title=title)

    def listed(self, key: str) -> list[Any]:
        """Return a list."""
        value = self.required(key)
        if not isinstance(value, list):
            self._refuse_value("a list", key)
        return value

    def objects(self, key: str) -> tuple[list[dict[str, Any]], tuple[Place, ...]]:
        """Return a list of objects, and where each begins."""
        values = self.listed(key)
        for index, value in enumerate(values):
            if type(value) is not dict:
                message = f"element {index + 1} of '{key}' is {describe(value)}"
                self.refuse(message, key, index)
        return values, self.document.places(values)

    def number(self, key: str, default: float | None = None) -> float:
        """Return a number; with a default it need not be there."""
        if default is not None and key not in self.value:
            return default
        self.required(key)
        return self._within(LARGEST_NUMBER, "a number", key)

    def length(self, key: str) -> float:
        """Return a length no longer than anybody flies; it may be negative. [m]."""
        self.required(key)
        return self._within(LARGEST_LENGTH_M, "a length in metres", key)

    def whole(self, key: str, *, least: int = 0, most: int, default: int | None = None) -> int:
        """Return a whole number of a range; with a default it need not be there."""
        number = self.number(key, default)
        if not (least <= number <= most and number == int(number)):
            self._refuse_value(f"a whole number from {least} to {most}", key)
        return int(number)

    def truth(self, key: str, default: bool | None = None) -> bool:  # noqa: FBT001 (as dict.get)
        """Return ``true`` or ``false``; with a default it need not be there."""
        if default is not None and key not in self.value:
            return default
        value = self.required(key)
        if not isinstance(value, bool):
            self._refuse_value("true or false", key)
        return value

    def position(self, *path: str | int) -> tuple[float, float]:
        """Return (latitude, longitude) [°] of a list that begins with them."""
        value = self._at(path)
        if not isinstance(value, list) or len(value) < 2:
            self._refuse_value("[latitude, longitude]", *path)
        latitude_deg, longitude_deg = (
            self._within(most, f"degrees from -{most:g} to {most:g}", *path, index)
            for index, most in enumerate((90.0, 180.0))
        )
        return latitude_deg, longitude_deg

    def altitude(self, *path: str | int) -> float | None:
        """Return an altitude, ``None`` for null. [m]."""
        if self._at(path) is None:
            return None
        return self._within(LARGEST_LENGTH_M, "an altitude in metres", *path)

    def _within(self, most: float, expected: str, *path: str | int) -> float:
        """Return a number of at most some size."""
        value = self._at(path)
        if type(value) not in _NUMBER_TYPES or abs(value) > LARGEST_NUMBER:
            self._refuse_value("a number", *path)
        if abs(value) > most:
            is_scaled = most <= 180.0 and abs(value) > 1e5
            hint = " (this looks like degrees × 10⁷)" if is_scaled else ""
            self._refuse_value(expected + hint, *path)
        return float(value)
