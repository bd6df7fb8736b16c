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
    PaneBar { height: 1; background: $panel; padding: 0 1; }
    """

    def show(self, names: Mapping[str, str], current: str) -> None:
        """Show the names of the panes by id, and which one is shown."""
        parts = []
        for number, (pane, name) in enumerate(names.items(), start=1):
            style = "bold reverse" if pane == current else ""
            text = f"[@click=screen.show_pane('{pane}')] {number} {name} [/]"
            parts.append(
                Content.from_markup(text).stylize(style) if style else Content.from_markup(text)
            )
        self.update(Content("").join(parts))
