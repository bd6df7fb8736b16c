"""Lines in ASCII, for terminals and locales that show no Braille, boxes or signs."""

from __future__ import annotations

import unicodedata
from functools import lru_cache
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.segment import Segment
from textual.filter import LineFilter

if TYPE_CHECKING:
    from textual.color import Color

_SIGNS = {
    **dict.fromkeys("─━═┄┈╌–—−―▔▁▂▃‾", "-"),
    **dict.fromkeys("│┃║┆┊╎▏▕▎▍▌▐", "|"),
    **dict.fromkeys("╭╮╰╯┌┐└┘├┤┬┴┼╶╴╵╷", "+"),
    **dict.fromkeys("█▇▆▅▄▓▒░▀", "#"),
    **dict.fromkeys("‘’‚", "'"),
    **dict.fromkeys("“”„", '"'),
    **dict.fromkeys("·•⁃○●∙", "."),
    **dict.fromkeys("→▶▸⟶", ">"),
    **dict.fromkeys("←◀◂", "<"),
    **dict.fromkeys("↑▲△↗↖⇧", "^"),
    **dict.fromkeys("↓▼▽↘↙", "v"),
    "✔": "+",
    "✖": "x",
    "✗": "x",
    "×": "x",
    "◆": "@",
    "…": ".",
    "°": "o",
    "µ": "u",
    "≤": "<",
    "≥": ">",
    "≈": "~",
    "±": "~",
    "⚠": "!",
}
_BRAILLE = 0x2800
_ROWS = (0x09, 0x12, 0x24, 0xC0)
"""The dots of a Braille character by its rows, from the top."""
_LEFT, _RIGHT = 0x47, 0xB8


def _of_dots(code: int) -> str:
    """Return the ASCII character that looks most like the dots of a Braille character."""
    if not code:
        return " "
    rows = [bool(code & row) for row in _ROWS]
    is_left, is_right = bool(code & _LEFT), bool(code & _RIGHT)
    dots = code.bit_count()
    if dots > 5:
        return "#"
    if sum(rows) == 1:  # a level line, or a single dot
        return "'" if rows[0] else "_" if rows[3] else "-"
    if not (is_left and is_right):
        return "|" if dots > 2 or sum(rows) > 2 else ":"
    left, right = (_mean_row(code & side) for side in (_LEFT, _RIGHT))
    if abs(left - right) < 0.5:
        return "#" if dots > 4 else "=" if dots == 4 else "-"
    return "/" if left > right else "\\"


def _mean_row(code: int) -> float:
    """Return the mean row of dots, counted from the top."""
    rows = [row for row, dots in enumerate(_ROWS) for _ in range((code & dots).bit_count())]
    return sum(rows) / len(rows)


@lru_cache(4096)
def _plain_character(character: str) -> str:
    code = ord(character)
    if code < 128:
        return character
    if 0 <= code - _BRAILLE < 256:
        return _of_dots(code - _BRAILLE)
    known = _SIGNS.get(character)
    if known is None:  # é is e, ² is 2
        letters = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
        known = letters if len(letters) == 1 else "?"
    return known * cell_len(character)


def plain(text: str) -> str:
    """Return a text in ASCII, as wide as it was."""
    return text if text.isascii() else "".join(map(_plain_character, text))


class AsciiFilter(LineFilter):
    """Shows every line in ASCII."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:  # noqa: ARG002 - given by textual
        """Return the runs of a line in ASCII."""
        return [Segment(plain(text), style, control) for text, style, control in segments]
