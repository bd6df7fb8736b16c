"""The names of the panes, where there is room for one at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content
from textual.widgets import Static

if TYPE_CHECKING:
    from collections.abc import Mapping


class PaneBar(Static):
    """One line; a click shows the pane, and so does its digit."""

    DEFAULT_CSS = """
    PaneBar {
        height: 1;
        background: $panel;
        padding: 0 1;
        link-style: none;
        link-color: $foreground;
    }
    """

    def __init__(self, names: Mapping[str, str], *, id: str | None = None) -> None:  # noqa: A002 - textual's
        super().__init__(_names(names, next(iter(names))), id=id)

    def show(self, names: Mapping[str, str], current: str) -> None:
        """Show the names of the panes by id, and which one is shown."""
        self.update(_names(names, current))


def _names(names: Mapping[str, str], current: str) -> Content:
    parts = []
    for number, (pane, name) in enumerate(names.items(), start=1):
        part = Content.from_markup(f"[@click=screen.show_pane('{pane}')] {number} {name} [/]")
        parts.append(part.stylize("bold reverse") if pane == current else part)
    return Content("").join(parts)
