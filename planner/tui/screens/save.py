"""Asks for the name of a file to save a review in."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from planner.errors import MavjouleError
from planner.tui.saving import OverwriteError, default_name, save

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from planner.tui.checked import Checked


class SaveScreen(ModalScreen[None]):
    """One field; the suffix says what is saved."""

    DEFAULT_CSS = """
    SaveScreen { align: center middle; background: $background 60%; }
    SaveScreen > Vertical {
        width: 90%; max-width: 90; height: auto; padding: 1 2; background: $panel;
        border: round $primary;
    }
    SaveScreen #problem { color: $text-warning; height: auto; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Back")]

    def __init__(self, checked: Checked) -> None:
        super().__init__()
        self._checked = checked
        self._asked = ""
        """The existing file that the user was warned of."""

    def compose(self) -> ComposeResult:
        """Yield the field and what may be written."""
        with Vertical():
            yield Static(Content.styled("Save as", "bold"))
            yield Input(default_name(self._checked), id="name")
            yield Static(
                ".txt, .json, .html: the report.  .plan or .waypoints: the mission, at the speed tried."
            )
            yield Static(id="problem")

    @on(Input.Submitted)
    def _save(self, event: Input.Submitted) -> None:
        try:
            done = save(self._checked, event.value, replace=event.value == self._asked)
        except OverwriteError as error:
            self._asked = event.value
            self.query_one("#problem", Static).update(Content(str(error)))
        except MavjouleError as error:
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            self.app.notify(f"Saved {done}", markup=False)
            self.dismiss()
