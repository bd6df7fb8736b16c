"""The verdict and the figures at the top."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content
from textual.widgets import Static

if TYPE_CHECKING:
    from planner.tui.verdict import Summary


class VerdictStrip(Static):
    """GO or NO-GO in words, what the flight takes and leaves, and the tightest return."""

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
    }
    """

    def show(self, summary: Summary, *, note: str = "") -> None:
        """Show another summary; the note tells what is under way or changed."""
        self.set_class(summary.is_go, "-go")
        self.set_class(not summary.is_go, "-no-go")
        first = verdict_line(summary)
        if note:
            first = Content.assemble(first, Content.styled(f"  {note}", "italic"))
        lines = [first, Content(summary.headline)]
        lines += (
            [Content(summary.return_plan)] if summary.return_plan else [Content(summary.closing)]
        )
        self.update(Content("\n").join(lines))


def verdict_line(summary: Summary) -> Content:
    """Return the verdict with its sign, and what it is of."""
    sign = "✔" if summary.is_go else "✖" if summary.verdict == "NO-GO" else "?"
    style = "bold $text-success" if summary.is_go else "bold $text-error"
    said = Content.styled(f"{sign} {summary.verdict}", style)
    return Content.assemble(said, Content(f"  {summary.file}"))
