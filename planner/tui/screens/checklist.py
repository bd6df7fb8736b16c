"""The checklist of a mission, and its sign-off."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, ClassVar

from textual import events, on
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Input, Static

from planner.errors import MavjouleError
from planner.tui.checklist import ChecklistRows, checklist_rows, write_sign_off
from planner.tui.verdict import summary
from planner.tui.widgets.key_bar import KeyBar
from planner.tui.widgets.row_list import RowList
from planner.tui.widgets.verdict_strip import VerdictStrip

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from planner.tui.checked import Checked

_TO_SIGN = "n to sign"


class ChecklistScreen(Screen[None]):
    """Manual items to tick off beside what was checked; signed with a name."""

    DEFAULT_CSS = """
    ChecklistScreen #checklist { height: 1fr; }
    ChecklistScreen #who { border: round $foreground 40%; border-title-color: $foreground; }
    ChecklistScreen #problem { height: auto; padding: 0 1; color: $text-warning; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "tick", "Tick off, open"),
        Binding("n", "sign", "Sign"),
        Binding("escape", "back", "Back"),
        Binding("question_mark", "app.toggle_help", "Keys"),
    ]

    def __init__(self, checked: Checked) -> None:
        super().__init__()
        self._checked = checked
        self._done: frozenset[int] = frozenset()
        self._opened: frozenset[str] = frozenset()

    def compose(self) -> ComposeResult:
        """Yield the list, and the field for the name."""
        yield VerdictStrip(id="verdict")
        yield RowList(self._rows(), empty="", id="checklist")
        yield Static(id="problem")
        yield Input(placeholder=_TO_SIGN, id="who")
        yield KeyBar()

    def on_mount(self) -> None:
        """Show the verdict that would be signed."""
        said = summary(self._checked.result)
        note = "with your changes" if self._checked.what_if.changes else ""
        self.query_one(VerdictStrip).show(said, note=note)
        self.query_one("#who").border_title = f"Sign off this {said.verdict}"
        self.query_one("#checklist").focus()

    @on(events.DescendantFocus, "#who")
    def _ask_name(self) -> None:
        self.query_one("#who", Input).placeholder = "your name, then Enter"

    @on(events.DescendantBlur, "#who")
    def _say_key(self) -> None:
        self.query_one("#who", Input).placeholder = _TO_SIGN

    def _rows(self) -> ChecklistRows:
        return checklist_rows(self._checked, done=self._done, opened=self._opened)

    @on(RowList.Chosen)
    def action_tick(self) -> None:
        """Tick a manual item off or on; open or close a family."""
        rows = self.query_one("#checklist", RowList)
        line = self._rows().lines[rows.cursor]
        if line.manual is not None:
            self._done ^= {line.manual}
        elif line.family:
            self._opened ^= {line.family}
        rows.show(self._rows())

    def action_sign(self) -> None:
        """Go to the field for the name."""
        self.query_one("#who").focus()

    def action_back(self) -> None:
        """Go from the name to the list, and from the list back to the review."""
        if self.focused is self.query_one("#who"):
            self.query_one("#checklist").focus()
        else:
            self.dismiss()

    @on(Input.Submitted, "#who")
    def _sign(self, event: Input.Submitted) -> None:
        try:
            path = write_sign_off(
                self._checked, done=self._done, who=event.value, at=datetime.now(UTC)
            )
        except MavjouleError as error:
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            self.app.notify(f"Signed: {path}", markup=False)
            self.dismiss()
