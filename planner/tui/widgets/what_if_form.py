"""Settings to change in place, what comes of it, and changes worth a try."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.content import Content
from textual.message import Message
from textual.widgets import Input, Static

from planner.tui.suggestions import Suggestion, suggestion_table
from planner.tui.what_if import WhatIf, form_settings
from planner.tui.widgets.row_list import RowList

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.timer import Timer

DEBOUNCE_S = 0.12
"""A blink: what is typed faster is taken together."""


class _SettingInput(Input):
    """A field in which ``?`` is the key of help, as everywhere: no setting holds one."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("question_mark", "app.show_help", "Help", priority=True)
    ]

    def check_consume_key(self, key: str, character: str | None) -> bool:
        """Return whether a key is typed into the field."""
        return character != "?" and super().check_consume_key(key, character)


class WhatIfForm(VerticalScroll):
    """One line a setting; blank keeps what the mission is checked with."""

    DEFAULT_CSS = """
    WhatIfForm {
        background: $surface;
        scrollbar-size-vertical: 1;
        & Horizontal, & Vertical { height: auto; }
        & .labels { width: 12; padding: 0 0 0 1; }
        & Input { width: 1fr; background: $boost; }
        & Input:focus { background: $panel; }
        & Input.-wrong { color: $text-error; text-style: underline; }
        & .outcome { padding: 1 1 0 1; width: 1fr; }
        & RowList { height: auto; max-height: 6; min-height: 2; margin-top: 1; }
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("down", "app.focus_next", "Next field", show=False),
        Binding("up", "app.focus_previous", "Previous field", show=False),
        Binding("ctrl+z", "take_back", "Take back all"),
        Binding("escape", "screen.back", "Back"),
    ]

    @dataclass
    class SettingsTyped(Message):
        """Settings were changed; blank ones as they were."""

        changes: dict[str, str]

    @dataclass
    class Suggested(Message):
        """A suggestion was chosen."""

        suggestion: Suggestion

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options, can_focus=False)
        self._timer: Timer | None = None
        self._is_filled = False
        self._what_if: WhatIf | None = None
        self._reported: Mapping[str, str] = {}
        self._outcome = Content("")
        self._suggestions: tuple[Suggestion, ...] = ()

    def fill(self) -> None:
        """Make the fields, the outcome and the suggestions, if they are not there yet."""
        if self._is_filled:
            return
        self._is_filled = True
        shown = form_settings()
        fields = [
            _SettingInput(id=f"set-{one.key}", compact=True, select_on_focus=False) for one in shown
        ]
        labels = Static("\n".join(one.label for one in shown), classes="labels", markup=False)
        rows = suggestion_table(self._suggestions)
        self.mount(
            Horizontal(labels, Vertical(*fields)),
            Static(self._outcome, classes="outcome", id="outcome"),
            RowList(rows, empty="", id="suggestions"),
        )
        self.call_after_refresh(self._show_all)

    def _show_all(self) -> None:
        if self._what_if is not None:
            self.show_settings(self._what_if, self._reported)
        self.show_suggestions(self._suggestions)

    def show_settings(self, what_if: WhatIf, reported: Mapping[str, str]) -> None:
        """Show what the fields hold, and what holds while they are blank."""
        self._what_if, self._reported = what_if, reported
        for setting, field in zip(form_settings(), self.query(Input), strict=False):
            key = setting.key
            field.placeholder = what_if.hint(setting, reported)
            is_other = field.value.strip() != what_if.changes.get(key, "")
            if is_other and self._timer is None:  # else what is being typed is kept
                with field.prevent(Input.Changed):
                    field.value = what_if.changes.get(key, "")
            field.set_class(bool(what_if.problem(key)), "-wrong")

    def show_outcome(self, lines: tuple[tuple[str, str], ...], problem: str = "") -> None:
        """Show differences to the mission as it is, or what is wrong with a text."""
        if problem:
            self._outcome = Content.styled(f"✖ {problem}", "$text-error")
        elif lines:
            self._outcome = Content("\n").join(
                Content.assemble(Content.styled(f"{label:<9}", "bold"), Content(text))
                for label, text in lines
            )
        else:
            text = "Type a change: it is checked as you type."
            self._outcome = Content.styled(text, "$text-muted")
        for outcome in self.query("#outcome").results(Static):
            outcome.update(self._outcome)

    def show_suggestions(self, found: tuple[Suggestion, ...]) -> None:
        """Show what is worth a try."""
        self._suggestions = found
        for rows in self.query("#suggestions").results(RowList):
            rows.show(suggestion_table(found))
            rows.display = bool(found)
            rows.styles.height = len(found) + 1

    def focus_first(self) -> None:
        """Put the keyboard into the first field."""
        if self._is_filled:
            self.query(Input).first().focus()
        else:
            self.fill()
            self.call_after_refresh(self.focus_first)

    def action_take_back(self) -> None:
        """Take all changes back."""
        self.post_message(self.SettingsTyped({}))

    @on(Input.Changed)
    def _wait_for_more(self, event: Input.Changed) -> None:
        event.stop()
        if self._timer is not None:
            self._timer.stop()
        self._timer = self.set_timer(DEBOUNCE_S, self._say)

    @on(Input.Submitted)
    def _say_now(self, event: Input.Submitted) -> None:
        event.stop()
        if self._timer is not None:
            self._timer.stop()
        self._say()

    def _say(self) -> None:
        self._timer = None
        fields = {
            one.key: self.query_one(f"#set-{one.key}", Input).value for one in form_settings()
        }
        self.post_message(self.SettingsTyped(fields))

    @on(RowList.Chosen, "#suggestions")
    def _suggest(self, event: RowList.Chosen) -> None:
        event.stop()
        self.post_message(self.Suggested(self._suggestions[event.index]))

    @on(RowList.Selected, "#suggestions")
    def _keep(self, event: RowList.Selected) -> None:
        event.stop()
