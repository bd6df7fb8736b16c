"""A canvas of braille dots: two by four to a character cell, drawn by array arithmetic."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]

DOTS_ACROSS, DOTS_DOWN = 2, 4
"""Dots of a cell."""
_BRAILLE = 0x2800
# Unicode counts the dots of a cell down the left column, down the right, then the lowest pair.
_WEIGHTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.int64)


class Canvas:
    """Lines and characters on a grid of cells; what is drawn later covers what was there.

    Parameters
    ----------
    columns, rows : int
        Size in cells; at least one each is taken.
    """

    def __init__(self, columns: int, rows: int) -> None:
        self.columns, self.rows = max(columns, 1), max(rows, 1)
        self.width, self.height = self.columns * DOTS_ACROSS, self.rows * DOTS_DOWN
        self._dots = np.zeros((self.height, self.width), dtype=bool)
        self._inks = np.full((self.rows, self.columns), "", dtype=object)
        self._characters: dict[tuple[int, int], str] = {}

    def copy(self) -> Canvas:
        """Return a canvas with the same drawing, to draw on without changing this one."""
        other = Canvas(self.columns, self.rows)
        other._dots = self._dots.copy()
        other._inks = self._inks.copy()
        other._characters = dict(self._characters)
        return other

    def line(self, x: FloatArray, y: FloatArray, ink: str) -> None:
        """Draw a line through points in dots, y downwards; what lies outside is left out.

        Parameters
        ----------
        x, y : ndarray
            Corners of the line, finite. (n,) [dots]
        ink : str
            What the cells it touches are drawn in.
        """
        across, down = np.rint(x), np.rint(y)
        moved = np.ones(len(across), dtype=bool)
        moved[1:] = (np.diff(across) != 0.0) | (np.diff(down) != 0.0)
        across, down = across[moved], down[moved]
        if len(across) < 2:
            self.dots(across, down, ink)
            return
        steps = np.maximum(np.abs(np.diff(across)), np.abs(np.diff(down))).astype(np.int64)
        leg = np.repeat(np.arange(len(steps)), steps)
        begun = np.repeat(np.cumsum(steps) - steps, steps)
        share = (np.arange(len(leg)) - begun) / steps[leg]
        self.dots(
            np.append(across[leg] + share * (across[leg + 1] - across[leg]), across[-1]),
            np.append(down[leg] + share * (down[leg + 1] - down[leg]), down[-1]),
            ink,
        )

    def dots(self, x: FloatArray, y: FloatArray, ink: str) -> None:
        """Draw single dots; those outside are left out. (n,) [dots]"""
        across, down = np.rint(x).astype(np.int64), np.rint(y).astype(np.int64)
        inside = (across >= 0) & (across < self.width) & (down >= 0) & (down < self.height)
        across, down = across[inside], down[inside]
        self._dots[down, across] = True
        self._inks[down // DOTS_DOWN, across // DOTS_ACROSS] = ink

    def write(
        self, column: int, row: int, text: str, ink: str, *, only_blank: bool = False
    ) -> None:
        """Write characters from a cell on, if asked where none is; what lies outside is left out."""
        for at, character in enumerate(text, start=column):
            if only_blank and self._characters.get((row, at), " ") != " ":
                continue
            if 0 <= at < self.columns and 0 <= row < self.rows:
                self._characters[row, at] = character
                self._inks[row, at] = ink

    def runs(self, row: int) -> list[tuple[str, str]]:
        """Return one row as runs of text, each with its ink; blank where nothing was drawn."""
        cells = self._dots[row * DOTS_DOWN : (row + 1) * DOTS_DOWN]
        weights = cells.reshape(DOTS_DOWN, self.columns, DOTS_ACROSS) * _WEIGHTS[:, None, :]
        codes = weights.sum(axis=(0, 2)).tolist()
        found: list[tuple[str, str]] = []
        for column, (code, own_ink) in enumerate(zip(codes, self._inks[row].tolist(), strict=True)):
            plain = chr(_BRAILLE + code) if code else " "
            character, ink = self._characters.get((row, column), plain), own_ink
            if found and found[-1][1] == ink:
                found[-1] = (found[-1][0] + character, ink)
            else:
                found.append((character, ink))
        return found
