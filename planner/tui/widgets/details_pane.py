"""What is said about the selected thing."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual.containers import VerticalScroll
from textual.content import Content
from textual.widgets import Static

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from planner.tui.details import Details

_STYLES = {"error": "bold $text-error", "warning": "bold $text-warning"}


class DetailsPane(VerticalScroll):
    """A heading and labelled paragraphs; scrolls."""

    DEFAULT_CSS = """
    DetailsPane {
        background: $surface;
        scrollbar-size-vertical: 1;
        & > Static { width: 1fr; padding: 0 1; }
    }
    """
    can_focus: ClassVar[bool] = True  # type: ignore[misc] # scrolled by keys

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - textual's
        super().__init__(id=id, classes=classes)
        self.details: Details | None = None

    def compose(self) -> ComposeResult:
        """Yield the text."""
        yield Static(id="details-text")

    def show(self, details: Details) -> None:
        """Show what is said about another thing."""
        if details == self.details:
            return
        self.details = details
        lines = [Content.styled(details.title, _STYLES.get(details.tone, "bold"))]
        for label, text in details.parts:
            head = Content.styled(f"{label}  ", "bold") if label else Content("")
            lines.append(Content.assemble(head, Content(text)))
        self.query_one("#details-text", Static).update(Content("\n").join(lines))
        self.scroll_home(animate=False)
