"""The keys that can be pressed now, in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content
from textual.widgets import Static

if TYPE_CHECKING:
    from textual.screen import Screen

_LAST = 2
"""Keys at the end that are shown whatever else there is no room for."""


class KeyBar(Static):
    """Keys with what they do; a click presses one."""

    DEFAULT_CSS = """
    KeyBar {
        dock: bottom;
        height: 1;
        padding: 0 1;
        background: $panel;
        text-wrap: nowrap;
        link-style: none;
        link-color: $foreground;
    }
    """

    def on_mount(self) -> None:
        """Follow the keys of what is in use."""
        self.screen.bindings_updated_signal.subscribe(self, self._show)

    def on_resize(self) -> None:
        """Show as many keys as there is room for."""
        self._show(self.screen)

    def _show(self, screen: Screen[object]) -> None:
        shown: dict[str, Content] = {}
        for active in screen.active_bindings.values():
            binding = active.binding
            if binding.show and binding.action not in shown:
                key = self.app.get_key_display(binding)
                press = f"[@click=app.simulate_key('{binding.key}')]"
                shown[binding.action] = Content.from_markup(
                    f"{press}[bold reverse]$key[/] $what[/]", key=key, what=binding.description
                )
        parts = list(shown.values())
        while len(parts) > _LAST and _taken(parts) > self.size.width > 0:
            del parts[-1 - _LAST]  # the help, which tells all keys, and the way out stay
        self.update(Content("  ").join(parts))


def _taken(parts: list[Content]) -> int:
    return sum(part.cell_length for part in parts) + 2 * (len(parts) - 1)
