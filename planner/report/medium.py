"""What a text report is written on: its width, and whether it has colours."""

from __future__ import annotations

import textwrap

from planner.values import Value

_CODES = {"bold": "1", "red": "1;31", "yellow": "33", "green": "1;32", "dim": "2"}


class Medium(Value):
    """A terminal, or a file or pipe, which has neither width nor colour."""

    width: int | None = None
    """Columns to wrap text at; ``None``: one line each, for other programs to read."""
    is_coloured: bool = False

    def paint(self, text: str, style: str) -> str:
        """Return the text in a style of ``bold``, ``red``, ``yellow``, ``green`` or ``dim``."""
        return f"\x1b[{_CODES[style]}m{text}\x1b[0m" if self.is_coloured else text

    def wrapped(self, text: str, *, indent: int = 0) -> list[str]:
        """Return a text as lines; those after the first are indented.

        The text is not to be painted: colour codes would count as columns.
        """
        if self.width is None:
            return [text]
        return textwrap.wrap(
            text,
            width=max(self.width, 40),
            subsequent_indent=" " * indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
