"""Dots of a canvas, counted by hand."""

from __future__ import annotations

import numpy as np

from planner.tui.widgets.canvas import Canvas


def _text(canvas: Canvas, row: int = 0) -> str:
    return "".join(text for text, _ in canvas.runs(row))


def test_a_level_line_fills_one_row_of_dots() -> None:
    canvas = Canvas(3, 1)
    canvas.line(np.array([0.0, 5.0]), np.array([0.0, 0.0]), "curve")
    assert _text(canvas) == "⠉⠉⠉"  # U+2809 has dots 1 and 4, the upper two


def test_an_upright_line_fills_one_column_of_dots() -> None:
    canvas = Canvas(1, 2)
    canvas.line(np.array([1.0, 1.0]), np.array([0.0, 7.0]), "curve")
    assert [_text(canvas, row) for row in (0, 1)] == ["⢸", "⢸"]  # dots 4, 5, 6 and 8


def test_a_slope_has_no_gap() -> None:
    canvas = Canvas(4, 2)
    canvas.line(np.array([0.0, 7.0]), np.array([7.0, 0.0]), "curve")
    dots = sum(
        (ord(character) - 0x2800).bit_count()
        for row in (0, 1)
        for character in _text(canvas, row)
        if character != " "
    )
    assert dots == 8  # one for each of the eight steps, both ends among them


def test_what_lies_outside_is_left_out() -> None:
    canvas = Canvas(2, 1)
    canvas.line(np.array([-10.0, -2.0]), np.array([1.0, 1.0]), "curve")
    canvas.write(1, 0, "abc", "mark")
    canvas.write(0, 5, "x", "mark")
    assert _text(canvas) == " a"


def test_what_is_written_later_covers_what_was_there() -> None:
    canvas = Canvas(1, 1)
    canvas.dots(np.array([0.0]), np.array([0.0]), "curve")
    canvas.write(0, 0, "H", "mark")
    assert canvas.runs(0) == [("H", "mark")]


def test_a_copy_leaves_its_original_alone() -> None:
    canvas = Canvas(1, 1)
    other = canvas.copy()
    other.write(0, 0, "x", "mark")
    assert canvas.runs(0) == [(" ", "")]
