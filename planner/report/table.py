"""Rows of text aligned in columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def table_lines(rows: Sequence[Sequence[str]], *, alignment: str) -> list[str]:
    """Return rows as lines, two blanks between columns.

    Parameters
    ----------
    rows : sequence of sequences of str
        Heads and cells, all rows equally long.
    alignment : str
        One letter per column: ``<`` left, ``>`` right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            f"{cell:{side}{width}}"
            for cell, side, width in zip(row, alignment, widths, strict=True)
        ).rstrip()
        for row in rows
    ]
