"""The verdict at the top, and the keys at the bottom."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content
from textual.widgets import Static

from planner.tui.rows import LEFT_OPEN, NOT_CHECKED

if TYPE_CHECKING:
    from textual.screen import Screen

    from planner.tui.details import Summary


_LAST = 2
"""Keys at the end that are shown whatever else there is no room for."""


_HIGH = 20
"""Rows of a terminal that has room for the whole summary."""


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


class VerdictStrip(Static):
    """GO, NO-GO or NOT CHECKED in words, of what, what the flight takes and leaves, the tightest return."""

    DEFAULT_CSS = """
    VerdictStrip {
        height: auto;
        min-height: 3;
        padding: 0 1;
        background: $panel;
        color: $foreground;
        border-left: thick $foreground;
        &.-go { border-left: thick $success; }
        &.-no-go { border-left: thick $error; }
        &.-not-checked { border-left: thick $warning; }
    }
    """

    _summary: Summary | None = None
    _note = ""

    def show(self, summary: Summary, *, note: str = "") -> None:
        """Show another summary; the note tells what is under way or changed."""
        self._summary, self._note = summary, note
        is_open = summary.verdict == NOT_CHECKED
        self.set_class(summary.is_go, "-go")
        self.set_class(is_open, "-not-checked")
        self.set_class(not (summary.is_go or is_open), "-no-go")
        first = verdict_line(summary)
        if note:
            first = Content.assemble(first, Content.styled(f"  {note}", "italic"))
        last = summary.return_plan or summary.closing
        texts = [summary.given, summary.headline, last]
        if self.app.size.height < _HIGH:  # what is left out the figures of the flight tell
            texts.pop()
        if summary.not_checked:
            texts[-1] = f"{texts[-1].rstrip('.')}. {summary.not_checked}"
        self.update(Content("\n").join([first, *map(Content, filter(None, texts))]))

    def on_resize(self) -> None:
        """Show as much as there is room for."""
        if self._summary is not None:
            self.show(self._summary, note=self._note)


def verdict_line(summary: Summary) -> Content:
    """Return the verdict with its sign, and what it is of."""
    sign = "✔" if summary.is_go else "✖" if summary.verdict == "NO-GO" else LEFT_OPEN
    styles = {NOT_CHECKED: "bold $text-warning"}
    style = (
        "bold $text-success" if summary.is_go else styles.get(summary.verdict, "bold $text-error")
    )
    verdict = Content.styled(f"{sign} {summary.verdict}", style)
    return Content.assemble(verdict, Content(f"  {summary.file}"))
