"""The review of one mission: verdict, findings, pictures, tables, what if."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Footer
from textual.worker import get_current_worker

from planner import numbers
from planner.errors import MavjouleError
from planner.service import CheckResult, UnreadableMission
from planner.tui import details, pointer
from planner.tui.checked import checked, file_stamp
from planner.tui.rows import finding_rows, item_rows, segment_rows
from planner.tui.suggestions import suggestions
from planner.tui.verdict import differences, summary
from planner.tui.widgets.details_pane import DetailsPane
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.pane_bar import PaneBar
from planner.tui.widgets.profile_plot import ProfilePlot
from planner.tui.widgets.row_list import RowList
from planner.tui.widgets.verdict_strip import VerdictStrip
from planner.tui.widgets.what_if_form import WhatIfForm

if TYPE_CHECKING:
    from collections.abc import Iterator

    from textual.app import ComposeResult

    from planner.checks.case import Case
    from planner.findings import Finding
    from planner.tui.checked import Checked
    from planner.tui.suggestions import Suggestion
    from planner.tui.verdict import Summary
    from planner.tui.what_if import WhatIf

PANES = {
    "findings": "Findings",
    "plot": "Profile",
    "map": "Map",
    "segments": "Segments",
    "items": "Items",
    "what-if": "What if",
}
"""Panes by id, in the order of their digits."""

_NOTHING = UnreadableMission(file="", findings=())
"""What is shown until the first check is done."""

WATCH_S = 1.0
"""How often the file is looked at. [s]"""


class ReviewScreen(Screen[None]):
    """One look at one mission."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (132, "-wide")]  # noqa: RUF012 - as textual has it
    VERTICAL_BREAKPOINTS = [(0, "-low"), (36, "-high")]  # noqa: RUF012 - as textual has it
    PANES: ClassVar[dict[str, str]] = PANES
    CSS_PATH = "review.tcss"
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
        Binding("m", "missions", "Missions"),
        Binding("f", "whole_flight", "Flight figures", show=False),
        Binding("r", "recheck", "Check again", show=False),
        Binding("escape", "leave_field", "Leave the field", show=False),
        Binding("question_mark", "app.toggle_help", "Keys"),
        Binding("q", "app.quit", "Quit"),
    ]

    @dataclass
    class Done(Message, bubble=False):
        """A check is done."""

        number: int
        base: Checked
        now: Checked

    @dataclass
    class Failed(Message, bubble=False):
        """A check could not be made."""

        number: int
        problem: str

    @dataclass
    class Suggested(Message, bubble=False):
        """Changes were tried."""

        number: int
        found: tuple[Suggestion, ...]

    def __init__(self, file: str, what_if: WhatIf) -> None:
        super().__init__()
        self.file = file
        self.what_if = what_if
        self.base: Checked | None = None
        """The mission as it is."""
        self.now: Checked | None = None
        """With what is changed."""
        self._asked = 0
        self._pane = "findings"
        self._stamp = file_stamp(file)
        self._note = ""

    # What is shown

    def compose(self) -> ComposeResult:
        """Yield the panes."""
        empty = finding_rows(_NOTHING)
        yield VerdictStrip(id="verdict")
        yield PaneBar(id="pane-bar")
        with Container(id="panes"):
            yield RowList(empty, empty="All checks passed.", id="findings", classes="pane")
            yield ProfilePlot(id="plot", classes="pane")
            yield WhatIfForm(id="what-if", classes="pane")
            yield DetailsPane(id="details", classes="pane")
            yield GroundMap(id="map", classes="pane")
            yield RowList(
                segment_rows(_NOTHING), empty="Nothing is flown.", id="segments", classes="pane"
            )
            yield RowList(item_rows(_NOTHING), empty="No items.", id="items", classes="pane")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        """Name the panes and ask for the first check."""
        for number, (pane, name) in enumerate(PANES.items(), start=1):
            self.query_one(f"#{pane}").border_title = f"{number} {name}"
        self.query_one("#details").border_title = "Details"
        self._show_panes()
        self.query_one("#verdict", VerdictStrip).update(f"Checking {self.file} …")
        self.query_one(WhatIfForm).show_settings(self.what_if)
        self.query_one("#findings").focus()
        self.set_interval(WATCH_S, self.watch_file)
        self.action_recheck()

    def _show_panes(self) -> None:
        self.query_one(PaneBar).show(PANES, self._pane)
        for pane in PANES:
            self.query_one(f"#{pane}").set_class(pane == self._pane, "-current")
        with_details = self._pane in {"findings", "segments", "items"}
        self.query_one("#details").set_class(with_details, "-current")
        self.query_one("#details").set_class(self._pane != "findings", "-small")

    def show_checked(self, base: Checked, now: Checked) -> None:
        """Show a mission in every pane."""
        first = self.now is None
        self.base, self.now = base, now
        result = now.result
        self._show_verdict()
        self.query_one("#findings", RowList).show(finding_rows(result))
        self.query_one("#segments", RowList).show(segment_rows(result))
        self.query_one("#items", RowList).show(item_rows(result))
        self.query_one(ProfilePlot).show(now.pictures)
        self.query_one(GroundMap).show(now.ground)
        form = self.query_one(WhatIfForm)
        form.show_settings(self.what_if)
        form.show_outcome(differences(base.result, result) if now is not base else ())
        rows = self.query_one("#findings", RowList)
        if first or self.focused is rows:
            if result.findings:
                self._select_finding(result.findings[rows.cursor])
            else:
                self.action_whole_flight()

    def _show_verdict(self, *notes: str) -> None:
        if self.now is None:
            return
        changed = "with your changes" if self.now is not self.base else ""
        note = "; ".join(text for text in (changed, self._note, *notes) if text)
        self.query_one("#verdict", VerdictStrip).show(self.summary(self.now), note=note)

    def summary(self, now: Checked) -> Summary:
        """Return what is said at the top."""
        return summary(now.result)

    # Checks

    def action_recheck(self) -> None:
        """Check again, in the background."""
        self._asked += 1
        self._show_verdict("checking …")
        self._check(self.what_if, self._asked, self.base)

    @work(thread=True, exclusive=True, group="check", exit_on_error=False)
    def _check(self, what_if: WhatIf, number: int, base: Checked | None) -> None:
        try:
            if base is None:
                base = self.checked(what_if.with_changes({}))
            now = self.checked(what_if) if what_if.changes else base
        except (MavjouleError, ValueError) as error:
            self.post_message(self.Failed(number, str(error)))
        else:
            self.post_message(self.Done(number, base, now))

    def checked(self, what_if: WhatIf) -> Checked:
        """Return the mission as it is now, checked; called in a thread."""
        return checked(self.file, what_if)

    @on(Done)
    def _take(self, event: ReviewScreen.Done) -> None:
        if event.number == self._asked:
            self.show_checked(event.base, event.now)
            self._suggest(event.now, event.number)

    @on(Failed)
    def _tell(self, event: ReviewScreen.Failed) -> None:
        if event.number != self._asked:
            return
        self.query_one(WhatIfForm).show_settings(self.what_if)
        self.query_one(WhatIfForm).show_outcome((), problem=event.problem)
        if self.now is None:
            self.query_one("#verdict", VerdictStrip).update(event.problem)
        self._show_verdict("not checked with what is typed")

    @work(thread=True, exclusive=True, group="suggest", exit_on_error=False)
    def _suggest(self, now: Checked, number: int) -> None:
        worker = get_current_worker()
        found: tuple[Suggestion, ...] = ()
        self.post_message(self.Suggested(number, found))
        try:
            for suggestion in self.suggestions(now):
                if worker.is_cancelled:
                    return
                found = (*found, suggestion)
                self.post_message(self.Suggested(number, found))
        except (MavjouleError, ValueError):
            return  # a suggestion that cannot be tried is none

    def suggestions(self, now: Checked) -> Iterator[Suggestion]:
        """Yield the changes worth a try; called in a thread."""
        return suggestions(now)

    @on(Suggested)
    def _offer(self, event: ReviewScreen.Suggested) -> None:
        if event.number == self._asked:
            self.query_one(WhatIfForm).show_suggestions(event.found)
            if self.now is not None and self.now.result.verdict == "no-go":
                going = sum(suggestion.is_go for suggestion in event.found)
                made = numbers.count(going, "change")
                self._show_verdict(f"{made} would make it go: w" if going else "")

    @on(WhatIfForm.Changed)
    def _change(self, event: WhatIfForm.Changed) -> None:
        what_if = self.what_if.with_changes(event.changes)
        if what_if.changes != self.what_if.changes:
            self.what_if = what_if
            self.action_recheck()

    @on(WhatIfForm.Suggested)
    def _try(self, event: WhatIfForm.Suggested) -> None:
        changes = {**self.what_if.changes, **dict(event.suggestion.changes)}
        self.what_if = self.what_if.with_changes(changes)
        self.query_one(WhatIfForm).show_settings(self.what_if)
        self.action_recheck()

    def watch_file(self) -> None:
        """Check again where the file was written since."""
        stamp = file_stamp(self.file)
        if stamp != self._stamp:
            self._stamp, self.base = stamp, None
            self._note = "the file changed and was checked again"
            self.action_recheck()

    # The thing in question: a moment, a segment, an item, a finding

    @property
    def _case(self) -> Case | None:
        return None if self.now is None else self.now.case

    @on(RowList.Selected, "#findings")
    def _on_finding(self, event: RowList.Selected) -> None:
        if self.now is not None and event.index < len(self.now.result.findings):
            self._select_finding(self.now.result.findings[event.index])

    @on(RowList.Chosen, "#findings")
    def _look_at_finding(self) -> None:
        self.query_one("#details").focus()

    def _select_finding(self, finding: Finding) -> None:
        self.query_one(DetailsPane).show(details.finding_details(finding, file=self.file))
        case = self._case
        span_s = None
        if case is not None and finding.item is not None:
            span_s = pointer.item_span_s(case, finding.item)
            if span_s is not None:
                self._point_at(span_s[0], but="findings")
            self.query_one("#items", RowList).select(finding.item - 1)
        self.query_one(ProfilePlot).mark(span_s)
        stretch = finding.stretch
        self.query_one(GroundMap).mark(stretch, span_s if stretch is None else None)

    @on(RowList.Selected, "#segments")
    def _on_segment(self, event: RowList.Selected) -> None:
        case = self._case
        if case is None or self.now is None or not isinstance(self.now.result, CheckResult):
            return
        self.query_one(DetailsPane).show(details.segment_details(self.now.result, event.index))
        self._mark(pointer.segment_span_s(case, event.index), but="segments")

    @on(RowList.Selected, "#items")
    def _on_item(self, event: RowList.Selected) -> None:
        case = self._case
        if case is None or self.now is None or not isinstance(self.now.result, CheckResult):
            return
        self.query_one(DetailsPane).show(details.item_details(self.now.result, event.index + 1))
        span_s = pointer.item_span_s(case, event.index + 1)
        if span_s is not None:
            self._mark(span_s, but="items")

    @on(ProfilePlot.Moved)
    @on(GroundMap.Moved)
    def _on_moment(self, event: ProfilePlot.Moved | GroundMap.Moved) -> None:
        case = self._case
        if case is None or self.now is None or not isinstance(self.now.result, CheckResult):
            return
        self._point_at(event.time_s)
        segment = pointer.segment_at(case, event.time_s)
        self.query_one(DetailsPane).show(details.segment_details(self.now.result, segment))

    def _mark(self, span_s: tuple[float, float], *, but: str) -> None:
        self._point_at(span_s[0], but=but)
        self.query_one(ProfilePlot).mark(span_s)
        self.query_one(GroundMap).mark(None, span_s)

    def _point_at(self, time_s: float, *, but: str = "") -> None:
        """Put every pane but one on a moment."""
        case = self._case
        if case is None:
            return
        self.query_one(ProfilePlot).point_at(time_s)
        self.query_one(GroundMap).point_at(time_s)
        if but != "segments":
            self.query_one("#segments", RowList).select(pointer.segment_at(case, time_s))
        if but not in {"items", "findings"}:
            self.query_one("#items", RowList).select(pointer.item_at(case, time_s) - 1)

    # Keys

    def action_show_pane(self, pane: str) -> None:
        """Show a pane, where there is room for one, and go to it."""
        self._pane = pane
        self._show_panes()
        if pane == "what-if":
            self.call_after_refresh(self.query_one(WhatIfForm).focus_first)
        else:
            self.call_after_refresh(self.query_one(f"#{pane}").focus)

    def action_turn_picture(self) -> None:
        """Show the next quantity over time."""
        self.query_one(ProfilePlot).action_turn(1)

    def action_whole_flight(self) -> None:
        """Show the figures of the whole flight."""
        if self.now is not None:
            self.query_one(DetailsPane).show(details.flight_details(self.now.result))

    def action_leave_field(self) -> None:
        """Go from the field in use to the findings."""
        if self.is_wide:
            self.query_one("#findings").focus()
        else:
            self.action_show_pane("findings")

    @property
    def is_wide(self) -> bool:
        """Whether all panes are shown at once."""
        return self.has_class("-wide") and self.has_class("-high")

    def action_copy_command(self) -> None:
        """Show the command that says the same, and give it to the terminal's clipboard."""
        from planner.tui.screens.command_line import CommandLineScreen

        command = self.what_if.command_line(self.file)
        self.app.copy_to_clipboard(command)
        self.app.push_screen(CommandLineScreen(command))

    def action_save(self) -> None:
        """Save the report, the figures or the mission."""
        from planner.tui.screens.save import SaveScreen

        if self.now is not None:
            self.app.push_screen(SaveScreen(self.now))

    def action_checklist(self) -> None:
        """Go through what is to be looked at before take-off."""
        from planner.tui.screens.checklist import ChecklistScreen

        if self.now is not None:
            self.app.push_screen(ChecklistScreen(self.now))

    def action_missions(self) -> None:
        """Go to the list of missions."""
        self.app.call_later(self.app.run_action, "missions")
