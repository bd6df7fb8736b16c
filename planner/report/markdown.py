"""Text that Markdown shows as it is."""

from __future__ import annotations

_ESCAPES = str.maketrans(
    {character: f"\\{character}" for character in "\\`*_[]<>|#~"} | {"&": "&amp;"}
)


def escaped(text: str) -> str:
    """Return the text with every sign that Markdown or HTML would take for its own escaped."""
    return text.translate(_ESCAPES)
