"""The screen in ASCII."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rich.cells import cell_len

from planner.tui.plain import plain

SNAPSHOTS = Path(__file__).parent / "snapshots"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("⠉⠉⠉", "'''"),  # the upper dots
        ("⣀⣀", "__"),  # the lower dots
        ("⡇⢸", "||"),  # one column of dots
        ("⠔⠊", "//"),  # from lower left to upper right
        ("⠑⢄", "\\\\"),
        ("⣿", "#"),
        ("⠀", " "),
        ("✔ GO", "+ GO"),
        ("NO-GO → GO, 5 °C", "NO-GO > GO, 5 oC"),
        ("Señor Müller, 3 m²", "Senor Muller, 3 m2"),
        ("東", "??"),  # as wide as it was
    ],
)
def test_what_is_drawn_and_written_has_a_like_in_ascii(text: str, expected: str) -> None:
    assert plain(text) == expected


def test_every_braille_character_keeps_its_width_and_is_seen() -> None:
    shown = [plain(chr(0x2800 + dots)) for dots in range(1, 256)]
    assert all(one.isascii() and cell_len(one) == 1 and one != " " for one in shown)


def test_a_review_in_ascii_shows_nothing_else() -> None:
    for shot in ("all-panes-in-ascii", "smallest-in-ascii"):
        svg = (SNAPSHOTS / f"{shot}.svg").read_text(encoding="utf-8")
        shown = "".join(re.findall(r">([^<]+)</text>", svg)).replace("&#160;", " ")
        assert "reserve" in shown
        assert shown.isascii(), {one for one in shown if not one.isascii()}
