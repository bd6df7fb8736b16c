"""What every JSON document of this program has in common: its envelope, and what a number may be."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from planner.report.plain_text import well_formed

if TYPE_CHECKING:
    from collections.abc import Sequence

    Document = dict[str, object]

SCHEMA = 1


def envelope(version: str) -> Document:
    """Return what every document begins with."""
    return {"schema": SCHEMA, "tool": {"name": "mavjoule", "version": version}}


def values(source: object | None, keys: Sequence[str]) -> Document:
    """Return the named attributes; all ``None`` where there is nothing to take them from."""
    return {key: value(source, key) for key in keys}


def value(source: object | None, key: str) -> object:
    """Return a named attribute as JSON can hold it; ``None`` where there is nothing."""
    found = None if source is None else getattr(source, key)
    if isinstance(found, float) and not math.isfinite(found):
        return None  # JSON has no NaN and no infinity: what is not a number is absent
    return well_formed(found) if isinstance(found, str) else found


def json_text(document: Document, *, indent: int | None = None) -> str:
    """Return a document as text, on one line where no indent is given."""
    # ASCII only, so that no console code page can break the document.
    return json.dumps(document, ensure_ascii=True, allow_nan=False, indent=indent) + "\n"
