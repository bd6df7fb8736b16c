"""Tables in ``models/README.md`` that the scripts in this folder write."""

from __future__ import annotations

import sys
from pathlib import Path

README = Path(__file__).parents[1] / "models" / "README.md"


def write_table(name: str, lines: list[str]) -> None:
    """Write lines between the marks of that name, and to standard output."""
    text = README.read_text(encoding="utf-8")
    mark = f"<!-- {name} begins -->\n\n"
    begin, end = text.index(mark) + len(mark), text.index(f"\n<!-- {name} ends -->")
    README.write_text(text[:begin] + "\n".join(lines) + "\n" + text[end:], encoding="utf-8")
    sys.stdout.write("\n".join(lines) + "\n")
