"""The command line that makes the same check."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Static

if TYPE_CHECKING:
    from textual.app import ComposeResult


class CommandLineScreen(ModalScreen[None]):
    """Shows a command; any of Enter, Escape and q goes back."""

    DEFAULT_CSS = """
    CommandLineScreen { align: center middle; background: $background 60%; }
    CommandLineScreen > Vertical {
        width: 90%; height: auto; padding: 1 2; background: $panel; border: round $primary;
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,enter,q,y", "dismiss", "Back"),
    ]

    def __init__(self, command: str) -> None:
        super().__init__()
        self.command = command

    def compose(self) -> ComposeResult:
        """Yield the command and what became of it."""
        with Vertical():
            yield Static(Content.styled("The same check as a command:", "bold"))
            yield Static(Content(f"\n{self.command}\n"), id="command")
            yield Static("Copied to the clipboard if the terminal allows it. Enter: back")
