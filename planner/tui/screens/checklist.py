"""The checklist: findings beside what a person has to look at; and its sign-off."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, ClassVar

from textual import events, on
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Input, Static

from planner import catalogue, quantity
from planner.errors import MavjouleError, UsageError
from planner.findings import Severity
from planner.notation import wind_text
from planner.report.sign_off import decision_of, write_sign_off
from planner.report.text import finding_tally, left_unchecked, printable
from planner.rules.ledger import Outcome
from planner.tui.checked import WATCH_S, FileWatch, deciding_files
from planner.tui.details import checked_summary
from planner.tui.rows import LEFT_OPEN, MARKS, finding_line
from planner.tui.widgets.bars import KeyBar, VerdictStrip
from planner.tui.widgets.row_list import RowList, Table, TableColumn
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from textual.app import ComposeResult

    from planner.site_profile import ManualItem
    from planner.tui.checked import Checked


AUTOMATIC_FAMILIES = "EFAWMTPX"
"""Families of rules a mission is judged by, those that ground it most often first."""


class ChecklistRow(Value):
    """One line of the checklist."""

    sign: str
    text: str
    tone: str = ""
    manual: int | None = None
    """Which manual item; ``None`` where none."""
    family: str = ""
    """Which family of rules opens and closes here."""


def manual_items(checked: Checked) -> tuple[ManualItem, ...]:
    """Return what the profile asks a person to look at."""
    profile = None if checked.assessment is None else checked.assessment.setup.profile
    return () if profile is None else profile.manual


def checklist_table(checked: Checked, *, done: frozenset[int], opened: frozenset[str]) -> Table:
    """Return the checklist: only what failed is spread out.

    A tick is of what was looked at; what nothing was given for, or no rule could judge, has a dash.
    ``done`` are positions of manual items, ``opened`` families that the user opened, or closed where
    they failed.
    """
    return Table(
        entries=(
            *_manual_lines(checked, done),
            *_given_lines(checked),
            *_automatic_lines(checked, opened),
        ),
        columns=(
            TableColumn(head="", width=3, is_right=False),
            TableColumn(head="before take-off", width=0, is_right=False),
        ),
        cells_of=lambda line: (line.sign, line.text),
        tone_of=lambda line: line.tone,
    )


def _manual_lines(checked: Checked, done: frozenset[int]) -> Iterator[ChecklistRow]:
    items = manual_items(checked)
    if not items:
        text = "No manual items: add them under [manual] in a --profile file."
        yield ChecklistRow(sign="", text=text, tone="info")
    for position, item in enumerate(items):
        yield ChecklistRow(
            sign="[x]" if position in done else "[ ]",
            text=f"{printable(item.section)}: {printable(item.prompt)}",
            tone="" if position in done else "warning",
            manual=position,
        )


def _given_lines(checked: Checked) -> Iterator[ChecklistRow]:
    """Yield what the check was told, and what nobody told it."""
    assessment = checked.assessment
    if assessment is None:
        return
    given = checked.what_if.values()
    setup, fence = assessment.setup, assessment.mission.fence
    battery = None if assessment.battery is None else assessment.battery.capacity_wh
    lines = (
        ("Vehicle", setup.vehicle.name if setup.is_vehicle_named else "", "an example is flown"),
        ("Battery", "" if battery is None else quantity.energy(battery), "no verdict without it"),
        (
            "Wind",
            wind_text(setup.wind) if "wind" in given or setup.wind.speed_m_s else "",
            "calm assumed",
        ),
        ("Parameters", "" if setup.parameters is None else setup.parameters.source, "defaults"),
        (
            "Terrain",
            "" if setup.terrain is None else "heights of the ground given",
            "level ground assumed",
        ),
        ("Fence", quantity.count(fence.area_count, "area") if fence else "", "none in the mission"),
    )
    for name, text, instead in lines:
        yield ChecklistRow(
            sign=f" {'✔' if text else LEFT_OPEN}",
            text=f"{name}: {printable(text) if text else f'not given, {instead}'}",
            tone="" if text else "warning",
        )


def _not_given(checked: Checked) -> dict[str, str]:
    """Return what the rules of a family look at and nobody gave, by the family."""
    assessment = checked.assessment
    if assessment is None:
        return {}
    setup = assessment.setup
    given = {
        "W": ("no wind given", "wind" in checked.what_if.values() or setup.wind.speed_m_s),
        "P": ("no parameters given", setup.parameters is not None),
        "F": ("no fence in the mission", assessment.mission.fence),
    }
    return {family: text for family, (text, is_given) in given.items() if not is_given}


def _automatic_lines(checked: Checked, opened: frozenset[str]) -> Iterator[ChecklistRow]:
    findings = checked.result.findings
    entries = checked.result.checked
    missing = _not_given(checked)
    known = {one.code[0] for one in findings} | {one.code[0] for one in entries}
    others = known - set(AUTOMATIC_FAMILIES)
    for family in (*AUTOMATIC_FAMILIES, *sorted(others)):
        unchecked = [entry for entry in left_unchecked(entries) if entry.code[0] == family]
        looked_at = sum(
            entry.outcome is Outcome.CHECKED for entry in entries if entry.code[0] == family
        )
        own = [finding for finding in findings if finding.code[0] == family]
        worst = max((finding.severity for finding in own), default=Severity.INFO)
        has_failed = worst > Severity.INFO
        is_passed = looked_at > 0 and not unchecked and family not in missing
        is_idle = not (looked_at or unchecked or own or family in missing)
        texts = [finding_tally(own) or ("nothing found" if looked_at else "no rule applies")]
        if looked_at:
            texts.append(f"{quantity.count(looked_at, 'rule')} checked")
        if unchecked:
            texts.append(f"{len(unchecked)} not checked")
        if family in missing:
            texts.append(missing[family])
        yield ChecklistRow(
            sign=""
            if is_idle
            else f" {MARKS[worst] if has_failed else '✔' if is_passed else LEFT_OPEN}",
            text=f"{catalogue.FAMILIES.get(family, family)}: {', '.join(texts)}",
            tone=worst.label if has_failed else "" if is_passed or is_idle else "warning",
            family=family,
        )
        if has_failed is not (family in opened):
            for one in own:
                text, tone = f"  {finding_line(one)}", one.severity.label
                yield ChecklistRow(sign="", text=text, tone=tone, family=family)
            for entry in unchecked:
                text = f"  {LEFT_OPEN} {entry.code} {entry.name}: not checked, needs {entry.needs}"
                yield ChecklistRow(sign="", text=text, tone="warning", family=family)


def sign(checked: Checked, *, done: frozenset[int], who: str, at: datetime) -> Path:
    """Write that a person has gone through the checklist of a mission, at a time with its zone.

    Raises
    ------
    UsageError
        If the name is missing, manual items of a go are open, an input is no longer the one checked, or a
        speed is tried that the file does not fly.
    OutputError
        If it cannot be written.
    """
    if checked.snapshot is not None:
        msg = "a mission on a vehicle may change: save it as a file and sign that"
        raise UsageError(msg)
    if checked.tried_speed:
        msg = f"the file flies its own speeds: save the mission at {checked.tried_speed} and sign that"
        raise UsageError(msg)
    items = manual_items(checked)
    return write_sign_off(
        checked.result,
        checked.what_if.values(),
        command=checked.what_if.command_line(checked.file),
        manual=[(item, position in done) for position, item in enumerate(items)],
        who=who,
        at=at,
    )


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
        Binding("question_mark", "app.show_help", "Help"),
    ]

    def __init__(self, checked: Checked) -> None:
        super().__init__()
        self._checked = checked
        self._done: frozenset[int] = frozenset()
        self._opened: frozenset[str] = frozenset()
        self._files = FileWatch()
        if checked.snapshot is None:
            self._files.follow(deciding_files(checked.file, checked.what_if))

    def compose(self) -> ComposeResult:
        """Yield the list, and the field for the name."""
        yield VerdictStrip(id="verdict")
        yield RowList(self._rows(), empty="", id="checklist")
        yield Static(id="problem")
        yield Input(placeholder=_TO_SIGN, id="who")
        yield KeyBar()

    def on_mount(self) -> None:
        """Show the verdict that would be signed."""
        brief = checked_summary(self._checked)
        note = "with your changes" if self._checked.what_if.changes else ""
        self.query_one(VerdictStrip).show(brief, note=note)
        is_go = decision_of(self._checked.result) == "released"
        self.query_one("#who").border_title = (
            "Release this GO for flight" if is_go else f"Refuse this {brief.verdict}"
        )
        self.query_one("#checklist").focus()
        self.set_interval(WATCH_S, self.watch_files)

    def watch_files(self) -> None:
        """Show no verdict any more where a file that decides it was written since."""
        if changed := self._files.changed():
            why = f"{changed[0].name} changed since it was checked: go back, and through what is found now"
            gone = checked_summary(self._checked).without_verdict(why)
            self.query_one(VerdictStrip).show(gone, note="")
            self.query_one("#who").border_title = "Nothing to sign"

    @on(events.DescendantFocus, "#who")
    def _ask_name(self) -> None:
        self.query_one("#who", Input).placeholder = "your name, then Enter"

    @on(events.DescendantBlur, "#who")
    def _say_key(self) -> None:
        self.query_one("#who", Input).placeholder = _TO_SIGN

    def _rows(self) -> Table:
        return checklist_table(self._checked, done=self._done, opened=self._opened)

    @on(RowList.Chosen)
    def action_tick(self) -> None:
        """Tick a manual item off or on; open or close a family."""
        rows = self.query_one("#checklist", RowList)
        line: ChecklistRow = rows.rows.entries[rows.cursor]
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
            path = sign(self._checked, done=self._done, who=event.value, at=datetime.now(UTC))
        except MavjouleError as error:
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            decision = decision_of(self._checked.result)
            self.app.notify(f"Signed as {decision}: {path}", markup=False)
            self.dismiss()
