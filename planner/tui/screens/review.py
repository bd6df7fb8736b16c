"""The review of one mission: verdict, findings, pictures, tables, what if."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.content import Content
from textual.screen import ModalScreen, Screen
from textual.widgets import Input, Static
from textual.worker import get_current_worker

from planner import quantity
from planner.errors import MavjouleError, bug_text
from planner.tui.checked import WATCH_S, FileWatch, checked, deciding_files
from planner.tui.details import checked_summary, differences
from planner.tui.widgets.bars import KeyBar, VerdictStrip
from planner.tui.widgets.panes import PANES, PaneBar, Panes
from planner.tui.widgets.profile_plot import ProfilePlot
from planner.tui.widgets.what_if_form import WhatIfForm

if TYPE_CHECKING:
    from collections.abc import Callable

    from textual.app import ComposeResult

    from planner.tui.checked import Checked
    from planner.tui.details import Summary
    from planner.tui.screens.search import Hit
    from planner.tui.suggestions import Suggestion
    from planner.tui.what_if import WhatIf


LAYOUT = """
ReviewScreen .pane { height: 1fr; width: 1fr; }
ReviewScreen Panes { height: 1fr; }

ReviewScreen.-narrow .pane, ReviewScreen.-low .pane { display: none; }
ReviewScreen.-narrow .pane.-current, ReviewScreen.-low .pane.-current { display: block; }
ReviewScreen.-narrow #findings, ReviewScreen.-low #findings { height: 2fr; max-height: 40%; }
ReviewScreen.-narrow #details, ReviewScreen.-low #details {
    border-top: solid $foreground 40%;
    border-title-color: $foreground;
    height: 3fr;
}
ReviewScreen.-narrow #details.-small, ReviewScreen.-low #details.-small {
    height: 40%;
    max-height: 7;
    dock: bottom;
}

ReviewScreen.-wide.-high #pane-bar { display: none; }
ReviewScreen.-wide.-high Panes {
    layout: grid;
    grid-size: 3 3;
    grid-columns: 1.2fr 1fr 42;
    grid-rows: 1fr 1fr 1fr;
}
ReviewScreen.-wide.-high .pane {
    display: block;
    border: round $foreground 40%;
    border-title-color: $foreground;
    height: 100%;
    max-height: 100%;
}
ReviewScreen.-wide.-high .pane:focus, ReviewScreen.-wide.-high .pane:focus-within {
    border: round $primary;
    border-title-style: bold;
}
ReviewScreen.-wide.-high #what-if { row-span: 3; }
"""


class ReviewScreen(Screen[None]):
    """One look at one mission; its settings are asked for again when the configuration changes."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (132, "-wide")]  # noqa: RUF012 - as textual has it
    VERTICAL_BREAKPOINTS = [(0, "-low"), (36, "-high")]  # noqa: RUF012 - as textual has it
    DEFAULT_CSS = LAYOUT
    BINDINGS: ClassVar[list[BindingType]] = [
        *(
            Binding(str(number), f"show_pane('{pane}')", name, show=False)
            for number, (pane, name) in enumerate(PANES.items(), start=1)
        ),
        Binding("w", "show_pane('what-if')", "What if"),
        Binding("p", "turn_picture", "Next quantity", show=False),
        Binding("y", "copy_command", "Command"),
        Binding("s", "save", "Save"),
        Binding("c", "checklist", "Checklist"),
        Binding("slash", "find", "Find"),
        Binding("m", "missions", "Missions"),
        Binding("f", "whole_flight", "Flight figures", show=False),
        Binding("r", "recheck", "Check again", show=False),
        Binding("escape", "back", "Back", show=False),
        Binding("question_mark", "app.show_help", "Help"),
        Binding("q", "app.quit", "Quit"),
    ]

    def __init__(self, file: str, what_if_of: Callable[[str], WhatIf]) -> None:
        super().__init__()
        self.file = file
        self.what_if = what_if_of(file)
        self.base: Checked | None = None
        """The mission as it is; ``None`` until it is checked as it is now."""
        self.now: Checked | None = None
        """With what is changed, as it was checked last."""
        self._what_if_of = what_if_of
        self._asked = 0
        self._problem = ""
        """Why what is asked for now could not be checked."""
        self._files = FileWatch()
        self._note = ""
        self._going = 0
        """How many of the changes that were tried make it go."""

    # What is shown

    def compose(self) -> ComposeResult:
        """Yield the verdict, the panes and the keys."""
        yield VerdictStrip(f"Checking {self.file} …", id="verdict", markup=False)
        yield PaneBar(PANES, id="pane-bar")
        yield Panes()
        yield KeyBar()

    def on_mount(self) -> None:
        """Ask for the first check."""
        self.action_recheck()
        self.query_one("#findings").focus()
        self.set_interval(WATCH_S, self.watch_files)

    def show_checked(self, base: Checked, now: Checked) -> None:
        """Show a mission in every pane."""
        self.base, self.now, self._problem = base, now, ""
        self.show_verdict()
        self.query_one(Panes).show(now)
        self._show_form(differences(base.result, now.result) if now is not base else ())

    def _show_form(self, lines: tuple[tuple[str, str], ...]) -> None:
        form = self.query_one(WhatIfForm)
        form.show_settings(self.what_if, self._reported)
        form.show_outcome(lines, problem=self._problem)
        self.call_after_refresh(form.fill)  # the verdict is to be seen first

    @property
    def _reported(self) -> dict[str, str]:
        return {} if self.now is None else self.now.reported

    def show_verdict(self, *notes: str) -> None:
        """Show the verdict, and what is under way or changed."""
        if self.now is None:
            return
        changed = "with your changes" if self.now is not self.base else ""
        going = f"{quantity.count(self._going, 'change')} would make it a GO: press w"
        texts = (changed, self._note, going if self._going else "", *notes)
        note = "; ".join(filter(None, texts))
        self.query_one("#verdict", VerdictStrip).show(self.summary(self.now), note=note)

    def summary(self, now: Checked) -> Summary:
        """Return the summary at the top: no verdict where that of the last check may not hold."""
        brief = checked_summary(now)
        why = self.unknown()
        if not why:
            return brief
        return brief.without_verdict(f"{why}; last verdict: {brief.verdict}")

    def unknown(self) -> str:
        """Return why there is no verdict of what is asked for; empty where there is one."""
        if self._problem:
            return f"cannot be checked like this: {self._problem}"
        return "" if self.base is not None else "checking the change"

    # Checks

    def action_recheck(self) -> None:
        """Check everything again, in the background."""
        self.ask(None)

    def ask(self, base: Checked | None) -> None:
        """Ask for a check in the background; ``base`` is the mission as it is, where known."""
        self._asked, self._going = self._asked + 1, 0
        self._files.follow(deciding_files(self.file, self.what_if))
        self.show_verdict("checking …")
        self._check(self.what_if, self._asked, base)

    @work(thread=True, exclusive=True, group="check", description="check")
    def _check(self, what_if: WhatIf, number: int, base: Checked | None) -> None:
        try:
            if base is None:
                base = self.checked(what_if.with_changes({}))
            now = self.checked(what_if) if what_if.changes else base
        except (MavjouleError, ValueError) as error:
            self.call_later(self.fail, number, str(error))
        except Exception as error:  # noqa: BLE001 - in words: a check must not seem to go on
            self.call_later(self.fail, number, bug_text(error))
        else:
            self.call_later(self.take, number, base, now)

    def checked(self, what_if: WhatIf) -> Checked:
        """Return the mission as it is now, checked; called in a thread."""
        return checked(self.file, what_if)

    def take(self, number: int, base: Checked, now: Checked) -> None:
        """Show a check that is done, if it is the one asked for last."""
        if number == self._asked:
            self.show_checked(base, now)
            self.call_after_refresh(self._suggest, now, number)

    def fail(self, number: int, problem: str) -> None:
        """Show why a check could not be made."""
        if number != self._asked:
            return
        self._problem = problem
        if self.now is None:
            self.query_one("#verdict", VerdictStrip).update(problem)
        self.show_verdict()
        self._show_form(())

    # A change that cannot be tried, for whatever reason, is not offered; the verdict stands.
    @work(thread=True, exclusive=True, group="suggest", description="suggest", exit_on_error=False)
    def _suggest(self, now: Checked, number: int) -> None:
        from planner.tui.suggestions import suggestions

        worker = get_current_worker()
        found: tuple[Suggestion, ...] = ()
        self.call_later(self._offer, number, found)
        for suggestion in suggestions(now):
            if worker.is_cancelled:
                return
            found = (*found, suggestion)
            self.call_later(self._offer, number, found)

    def _offer(self, number: int, found: tuple[Suggestion, ...]) -> None:
        if number != self._asked:
            return
        self.query_one(WhatIfForm).show_suggestions(found)
        if self.now is not None and self.now.result.verdict == "no-go":
            self._going = sum(suggestion.is_go for suggestion in found)
            self.show_verdict()

    @on(WhatIfForm.SettingsTyped)
    def _change(self, event: WhatIfForm.SettingsTyped) -> None:
        what_if = self.what_if.with_changes(event.changes)
        if what_if.changes != self.what_if.changes:
            self.what_if = what_if
            self.ask(self.base)

    @on(WhatIfForm.Suggested)
    def _try(self, event: WhatIfForm.Suggested) -> None:
        if event.suggestion.split is not None and self.now is not None:
            from planner.tui.screens.save import SplitScreen

            self.app.push_screen(SplitScreen(event.suggestion.split, self.now))
            return
        changes = {**self.what_if.changes, **dict(event.suggestion.changes)}
        self.what_if = self.what_if.with_changes(changes)
        self.query_one(WhatIfForm).show_settings(self.what_if, self._reported)
        self.ask(self.base)

    def watch_files(self) -> None:
        """Check again where a file that decides the verdict was written since."""
        changed = self._files.changed()
        if not changed:
            return
        self.base = None
        self._note = f"{changed[0].name} changed and was checked again"
        try:
            self.what_if = self._what_if_of(self.file).with_changes(self.what_if.changes)
        except MavjouleError as error:
            self._asked += 1
            self.fail(self._asked, str(error))
        else:
            self.ask(self.base)

    # Keys

    def action_show_pane(self, pane: str) -> None:
        """Show a pane, where there is room for one, and go to it."""
        self.query_one(PaneBar).show(pane)
        self.query_one(Panes).show_pane(pane)

    def action_turn_picture(self) -> None:
        """Show the next quantity over time."""
        self.query_one(ProfilePlot).action_turn(1)

    def action_whole_flight(self) -> None:
        """Show the figures of the whole flight."""
        self.query_one(Panes).show_flight()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 - given by textual
        """Return whether a key does anything now: a slash that is typed is text."""
        return action != "find" or not isinstance(self.focused, Input)

    def action_find(self) -> None:
        """Find an item or a finding by number, code or text."""
        from planner.tui.screens.search import SearchScreen

        panes = self.query_one(Panes)

        def go(hit: Hit | None) -> None:
            if hit is not None:
                self.query_one(PaneBar).show(panes.go_to(hit))

        self.app.push_screen(SearchScreen(panes.find), go)

    def action_back(self) -> None:
        """Go from what is in use to the findings, and from them to the list this was opened from."""
        findings = self.query_one("#findings")
        if self.focused is not findings:
            if self.is_wide:
                findings.focus()
            else:
                self.action_show_pane("findings")
        elif len(self.app.screen_stack) > 1:
            self.action_missions()

    @property
    def is_wide(self) -> bool:
        """Whether all panes are shown at once."""
        return self.has_class("-wide") and self.has_class("-high")

    def action_copy_command(self) -> None:
        """Show the command that says the same, and give it to the terminal's clipboard."""
        command = self.command_line()
        self.app.copy_to_clipboard(command)
        self.app.push_screen(CommandLineScreen(command))

    def command_line(self) -> str:
        """Return the commands that say the same."""
        return self.what_if.file_commands(self.file)

    def action_save(self) -> None:
        """Save the report, the figures or the mission."""
        from planner.tui.screens.save import SaveScreen

        if (now := self._verdict_asked_for()) is not None:
            self.app.push_screen(SaveScreen(now))

    def action_checklist(self) -> None:
        """Go through what is to be looked at before take-off."""
        from planner.tui.screens.checklist import ChecklistScreen

        if (now := self._verdict_asked_for()) is not None:
            self.app.push_screen(ChecklistScreen(now))

    def _verdict_asked_for(self) -> Checked | None:
        """Return the check of what is asked for now; where there is none, tell why.

        The last one is no answer to a change that it was made without.
        """
        now, why = self.now, self.unknown()
        if now is None:
            return None
        if not why and now.what_if.changes != self.what_if.changes:
            why = "checking the change"
        if why:
            self.notify(f"No verdict: {why}", severity="warning", markup=False)
            return None
        return now

    def action_missions(self) -> None:
        """Go to the list of missions."""
        self.app.call_later(self.app.run_action, "missions")


class CommandLineScreen(ModalScreen[None]):
    """Shows a command; any of Enter, Escape and q goes back."""

    DEFAULT_CSS = """
    CommandLineScreen { align: center middle; background: $background 60%; }
    CommandLineScreen > Vertical {
        width: 90%; height: auto; padding: 1 2; background: $panel; border: round $primary;
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,enter,q,y", "dismiss", "Back")]

    def __init__(self, command: str) -> None:
        super().__init__()
        self.command = command

    def compose(self) -> ComposeResult:
        """Yield the command and what became of it."""
        with Vertical():
            yield Static(Content.styled("The same check as a command:", "bold"))
            yield Static(Content(f"\n{self.command}\n"), id="command")
            yield Static("Copied to the clipboard if the terminal allows it. Enter: back")
