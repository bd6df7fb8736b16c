"""JSON text as Python values that know where in the text they stand.

Strict where leniency would hide something: a repeated key, ``NaN`` and ``Infinity``, numbers too
large for a double and absurd nesting are refused, each with its line and column.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from json.decoder import scanstring
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from planner.catalogue.loader_text import FILE_ENCODING
from planner.errors import MissionFileError
from planner.findings import Place

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    import numpy.typing as npt

    from planner.findings import Finding

DEEPEST_NESTING = 64
"""Plans nest about 8 deep."""
LONGEST_INTEGER = 4000
"""Python converts no more than 4300 digits."""

_DIGIT_BLOCK = 150
"""A run of 300 digits, more than a double holds, covers a whole aligned block of this length."""
_ESCAPE = re.compile(r"\\.", re.DOTALL)
_SPACE = re.compile(r"[ \t\n\r]*")
_NUMBER = re.compile(
    r'"(?:[^"\\]|\\.)*"|(-?Infinity|NaN|-?[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)', re.DOTALL
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JsonDocument:
    """A parsed JSON text; its values are not to be changed."""

    source: str
    """File name as the user gave it."""
    text: str
    """The text, without a byte order mark."""
    root: Any
    """Its value, made of ``dict``, ``list``, ``str``, ``int``, ``float``, ``bool`` and ``None``."""
    findings: tuple[Finding, ...]
    starts: Mapping[int, int]
    """Offset of the opening brace of each object, by the object's ``id``."""
    line_ends: npt.NDArray[np.intp]
    """Offset of each line feed. [n]"""

    def place(self, container: dict[str, Any], *path: str | int) -> Place:
        """Return where an object of this document, or a value inside it, begins.

        Parameters
        ----------
        container : dict
            An object of this document: the very one, not an equal one.
        *path : str or int
            Keys and indexes that lead from it to the value.  Where the path breaks off, the place
            of the last value there is.

        Returns
        -------
        Place
        """
        return _place(self.line_ends, self._offset(container, *path))

    def places(self, objects: Iterable[dict[str, Any]]) -> tuple[Place, ...]:
        """Return where each of many objects of this document begins."""
        offsets = np.array([self.starts[id(each)] for each in objects], np.intp)
        lines = np.searchsorted(self.line_ends, offsets)
        # Before the first line feed there is, as it were, one at offset −1.
        columns = offsets - np.concatenate(([-1], self.line_ends))[lines]
        return tuple(map(Place, (lines + 1).tolist(), columns.tolist()))

    def element_places(self, container: dict[str, Any], *path: str | int) -> tuple[Place, ...]:
        """Return where each element of a list inside an object of this document begins."""
        offset = self._offset(container, *path)
        return tuple(_place(self.line_ends, at) for _, at in _members(self.text, offset))

    def refuse(self, message: str, container: dict[str, Any], *path: str | int) -> NoReturn:
        """Raise the error about an object of this document or a value inside it."""
        raise MissionFileError(message, source=self.source, place=self.place(container, *path))

    def _offset(self, container: dict[str, Any], *path: str | int) -> int:
        offset = self.starts[id(container)]
        for step in path:
            inner = next((at for key, at in _members(self.text, offset) if key == step), None)
            if inner is None:
                break
            offset = inner
        return offset


def describe(value: object) -> str:
    """Return what a JSON value is, in words: ``the text 'abc'``, ``a list of 3``."""
    if isinstance(value, str):
        return f"the text '{value[:40]}'"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, int | float):
        return f"{value:.17g}" if abs(value) < 1e300 else "a number beyond all measure"
    return f"a list of {len(value)}" if isinstance(value, list) else "an object"


def parse_json(text: str, *, source: str) -> JsonDocument:
    """Parse a JSON text, keeping the place of every object.

    Parameters
    ----------
    text : str
        The whole text; a byte order mark before it gives a finding.
    source : str
        Its file name, for messages.

    Returns
    -------
    JsonDocument

    Raises
    ------
    MissionFileError
        With line and column, if the text is not JSON, repeats a key inside an object, holds
        ``NaN``, ``Infinity`` or a number beyond a double's range, or nests deeper than
        ``DEEPEST_NESTING``.
    """
    findings: tuple[Finding, ...] = ()
    if text.startswith("\ufeff"):
        text = text.removeprefix("\ufeff")
        message = "the JSON text begins with a byte order mark: other loaders refuse it"
        findings = (FILE_ENCODING.finding(message, place=Place(1, 1)),)
    codes = _codes(text)
    line_ends = np.flatnonzero(codes == ord("\n"))

    def refuse(message: str, offset: int) -> NoReturn:
        raise MissionFileError(message, source=source, place=_place(line_ends, offset))

    offsets, depths = _brackets(text, codes)
    if depths.max(initial=0) > DEEPEST_NESTING:
        msg = f"brackets nest deeper than {DEEPEST_NESTING}: no mission does"
        refuse(msg, int(offsets[np.argmax(depths > DEEPEST_NESTING)]))

    closed: list[dict[str, Any]] = []
    repeating: list[int] = []

    def keep(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        value = dict(pairs)
        if len(value) != len(pairs):
            repeating.append(len(closed))
        closed.append(value)
        return value

    try:
        root = json.loads(
            text,
            object_pairs_hook=keep,
            parse_float=_finite if _may_overflow(codes) else None,
            parse_constant=_finite,
        )
    except json.JSONDecodeError as error:
        refuse(_explain(error), error.pos)
    except _NumberTokenError as error:
        msg = f"{error.token[:40]} is no finite number: write null where a value is not known"
        refuse(msg, _number_offset(text, error.token))
    except RecursionError:
        refuse("brackets nest too deep: no mission does", 0)
    except ValueError:  # an integer of more digits than Python converts
        refuse(f"a number of more than {LONGEST_INTEGER} digits", _long_integer_offset(text))

    starts = _object_starts(codes, offsets)
    if repeating:
        at, key = _repeated_key(text, starts[repeating[0]])
        refuse(f"the key '{key[:40]}' stands twice in one object: which one counts?", at)
    return JsonDocument(
        source=source,
        text=text,
        root=root,
        findings=findings,
        starts=dict(zip(map(id, closed), starts, strict=True)),
        line_ends=line_ends,
    )


class _NumberTokenError(Exception):
    """A number that is not finite."""

    def __init__(self, token: str) -> None:
        super().__init__(token)
        self.token = token


def _finite(token: str) -> float:
    value = float(token)
    if not math.isfinite(value):
        raise _NumberTokenError(token)
    return value


def _codes(text: str) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint32]:
    """Return the text's code points, one per character. [n]"""
    if text.isascii():
        return np.frombuffer(text.encode("ascii"), np.uint8)
    return np.frombuffer(text.encode("utf-32-le", "surrogatepass"), np.uint32)


def _place(line_ends: npt.NDArray[np.intp], offset: int) -> Place:
    line = int(np.searchsorted(line_ends, offset))
    start = 0 if line == 0 else int(line_ends[line - 1]) + 1
    return Place(line + 1, offset - start + 1)


def _brackets(
    text: str, codes: npt.NDArray[np.uint8] | npt.NDArray[np.uint32]
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the offset of every bracket outside strings, and the depth after it. [n], [n]"""
    if "\\" in text:  # blank out escapes, so that every quote left begins or ends a string
        codes = _codes(_ESCAPE.sub("__", text))
    folded = codes | 0x20  # makes [ into { and ] into }
    is_bracket = (folded == ord("{")) | (folded == ord("}"))
    marks = np.flatnonzero(is_bracket | (codes == ord('"')))
    is_quote = codes[marks] == ord('"')
    offsets = marks[~is_quote & (np.cumsum(is_quote) % 2 == 0)]
    depths = np.cumsum(np.where(folded[offsets] == ord("{"), 1, -1))
    return offsets, depths


def _object_starts(
    codes: npt.NDArray[np.uint8] | npt.NDArray[np.uint32], offsets: npt.NDArray[np.intp]
) -> list[int]:
    """Return the offset of each object's opening brace, in the order in which objects close.

    At one depth opening and closing braces take turns, so sorted by depth they pair off one to
    one; the parser calls its hook in the order of the closing ones.
    """
    braces = offsets[(codes[offsets] == ord("{")) | (codes[offsets] == ord("}"))]
    is_opening = codes[braces] == ord("{")
    depths = np.cumsum(np.where(is_opening, 1, -1))
    openings = braces[is_opening][np.argsort(depths[is_opening], kind="stable")]
    closing_order = np.argsort(depths[~is_opening], kind="stable")
    starts = np.empty_like(openings)
    starts[closing_order] = openings
    found: list[int] = starts.tolist()
    return found


def _may_overflow(codes: npt.NDArray[np.uint8] | npt.NDArray[np.uint32]) -> bool:
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
    is_object = text[offset] == "{"
    decoder = json.JSONDecoder()
    at = _skip_space(text, offset + 1)
    index = 0
    while text[at] not in "}]":
        key: str | int = index
        if is_object:
            key, at = scanstring(text, at + 1)
            at = _skip_space(text, _skip_space(text, at) + 1)  # past the colon
        yield key, at
        _, at = decoder.raw_decode(text, at)
        at = _skip_space(text, at)
        if text[at] == ",":
            at = _skip_space(text, at + 1)
        index += 1


def _skip_space(text: str, at: int) -> int:
    match = _SPACE.match(text, at)
    return at if match is None else match.end()


def _repeated_key(text: str, offset: int) -> tuple[int, str]:
    """Return the offset of the value that comes with an object's first repeated key, and the key."""
    seen: set[str | int] = set()
    for key, at in _members(text, offset):
        if key in seen:
            return at, str(key)
        seen.add(key)
    return offset, ""


def _number_offset(text: str, token: str) -> int:
    """Return where a number token first stands outside strings."""
    return next(match.start() for match in _NUMBER.finditer(text) if match.group(1) == token)


def _long_integer_offset(text: str) -> int:
    return next(
        match.start()
        for match in _NUMBER.finditer(text)
        if match.group(1) and len(match.group(1)) > LONGEST_INTEGER
    )


def _explain(error: json.JSONDecodeError) -> str:
    """Return what is wrong with the text, in a sentence."""
    rest = error.doc[error.pos : error.pos + 20].split("\n")[0].strip()
    before = error.doc[: error.pos].rstrip()[-1:]
    # The standard library's sentences differ between its versions: only their gist is used.
    kind = error.msg.lower()
    if not error.doc.strip():
        return "the file is empty"
    if "control character" in kind:
        return "a text holds a line break or another control character"
    if "escape" in kind:
        return "a text holds a backslash that JSON does not know"
    if "unterminated" in kind:
        return "a text that begins here is not closed: the file may be cut off"
    if not error.doc[error.pos :].strip():
        return "the JSON ends too early: the file is cut off"
    if "extra data" in kind:
        return f"'{rest}' follows the end of the JSON: only one value may stand in a file"
    if before == "," and rest[:1] in {"}", "]"} or "trailing comma" in kind:
        return "a comma stands before a closing bracket: JSON allows none there"
    if rest.startswith(("//", "/*", "#")):
        return "JSON has no comments: delete this one"
    if "property name" in kind:
        return f"expected a key in double quotes, found '{rest}'"
    if "':'" in kind:
        return f"expected a colon after the key, found '{rest}'"
    if "','" in kind:
        return f"expected a comma or a closing bracket, found '{rest}'"
    return f"expected a value, found '{rest}'"
