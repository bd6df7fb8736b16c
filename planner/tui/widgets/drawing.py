"""A widget that shows a canvas, drawn again only when what is on it changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from rich.segment import Segment as Run
from textual.strip import Strip
from textual.widget import Widget

if TYPE_CHECKING:
    from textual import events
    from textual.app import RenderResult

    from planner.tui.canvas import Canvas

VEHICLE = "▲"
"""Where the vehicle on the line is."""
INKS = ("curve", "second", "limit", "cursor", "axis", "inclusion", "exclusion", "mark", "stretch")


class Drawing(Widget, can_focus=True):
    """A canvas in inks; a class of its own says what is on it."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {f"drawing--{ink}" for ink in INKS}
    DEFAULT_CSS = """
    Drawing {
        background: $surface;
        color: $foreground;
        & > .drawing--curve { color: $text-primary; }
        & > .drawing--second { color: $text-accent; }
        & > .drawing--limit { color: $text-error; }
        & > .drawing--cursor { color: $foreground; text-style: bold; }
        & > .drawing--axis { color: $text-muted; }
        & > .drawing--inclusion { color: $text-success; }
        & > .drawing--exclusion { color: $text-error; }
        & > .drawing--mark { color: $foreground; text-style: bold; }
        & > .drawing--stretch { color: $text-error; text-style: bold; }
    }
    """

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - textual's
        super().__init__(id=id, classes=classes)
        self._still: Canvas | None = None
        self._shown: Canvas | None = None

    def still_canvas(self, columns: int, rows: int) -> Canvas:
        """Return what stays while the cursor moves."""
        raise NotImplementedError

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw what moves with the cursor."""
        raise NotImplementedError

    def redraw(self) -> None:
        """Draw everything again."""
        self._still = None
        self.move_cursor()

    def move_cursor(self) -> None:
        """Draw the cursor again."""
        self._shown = None
        self.refresh()

    def on_resize(self, event: events.Resize) -> None:  # noqa: ARG002 - given by textual
        """Draw for the new size."""
        self.redraw()

    def render(self) -> RenderResult:
        """Return nothing: the lines are rendered one by one."""
        return ""

    def render_line(self, y: int) -> Strip:
        """Return a row of the canvas."""
        if self._shown is None:
            if self._still is None:
                self._still = self.still_canvas(self.size.width, self.size.height)
            self._shown = self._still.copy()
            self.draw_cursor(self._shown)
        if y >= self._shown.rows:
            return Strip.blank(self.size.width, self.rich_style)
        runs = [
            Run(
                text,
                self.get_component_rich_style(f"drawing--{ink}") if ink else self.rich_style,
            )
            for text, ink in self._shown.runs(y)
        ]
        return Strip(runs, self.size.width)
