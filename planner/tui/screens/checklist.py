"""The checklist: findings beside what a person has to look at; and its sign-off."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import events, on
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Input, Static

from planner import __version__, catalogue, quantity
from planner.errors import MavjouleError, OutputError, UsageError
from planner.files import write_output_file
from planner.findings import Severity
from planner.report.json import checks_document, envelope, json_text, values
from planner.report.text import finding_tally, left_unchecked, printable
from planner.service.preflight import CheckResult
from planner.tui.checked import file_sha256
from planner.tui.details import summary
from planner.tui.rows import LEFT_OPEN, MARKS, finding_line
from planner.tui.widgets.bars import KeyBar, VerdictStrip
from planner.tui.widgets.row_list import RowList, Table, TableColumn
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

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

    ``done`` are positions of manual items, ``opened`` families that the user opened, or closed where
    they failed.
    """
    return Table(
        entries=(*_manual_lines(checked, done), *_automatic_lines(checked, opened)),
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


def _automatic_lines(checked: Checked, opened: frozenset[str]) -> Iterator[ChecklistRow]:
    findings = checked.result.findings
    counts = Counter(finding.code[0] for finding in findings)
    left_open = left_unchecked(checked.result.checked)
    for family in (*AUTOMATIC_FAMILIES, *sorted(set(counts) - set(AUTOMATIC_FAMILIES))):
        unchecked = [entry for entry in left_open if entry.code[0] == family]
        own = [finding for finding in findings if finding.code[0] == family]
        worst = max((finding.severity for finding in own), default=Severity.INFO)
        has_failed = worst > Severity.INFO
        yield ChecklistRow(
            sign=f" {MARKS[worst] if has_failed else LEFT_OPEN if unchecked else '✔'}",
            text=f"{catalogue.FAMILIES.get(family, family)}: {finding_tally(own) or 'nothing found'}"
            + (f", {quantity.count(len(unchecked), 'rule')} not checked" if unchecked else ""),
            tone=worst.label if has_failed else "warning" if unchecked else "",
            family=family,
        )
        if has_failed is not (family in opened):
            for one in own:
                text, tone = f"  {finding_line(one)}", one.severity.label
                yield ChecklistRow(sign="", text=text, tone=tone, family=family)
            for entry in unchecked:
                text = f"  {LEFT_OPEN} {entry.code} {entry.name}: not checked, needs {entry.needs}"
                yield ChecklistRow(sign="", text=text, tone="warning", family=family)


def sign_off_paths(file: str) -> tuple[Path, ...]:
    """Return the sign-offs of a mission that are there, the first one first."""
    found: list[Path] = []
    while (path := _sign_off_path(file, len(found) + 1)).exists() or path.is_symlink():
        found.append(path)
    return tuple(found)


def _sign_off_path(file: str, number: int) -> Path:
    """Return where a sign-off of a mission goes: beside it, each to a file of its own."""
    return Path(f"{file}.signoff.json" if number == 1 else f"{file}.signoff-{number}.json")


def _reserved_path(file: str) -> Path:
    """Return a new file for a sign-off, made here: no other one is ever written over."""
    while True:
        path = _sign_off_path(file, len(sign_off_paths(file)) + 1)
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            continue  # someone else signed at this moment
        except OSError as error:
            msg = f"{path}: cannot be written: {error.strerror or error}"
            raise OutputError(msg) from error
        return path


def write_sign_off(checked: Checked, *, done: frozenset[int], who: str, at: datetime) -> Path:
    """Write that a person has gone through the checklist of a mission, at a time with its zone.

    The file is a new one beside the mission; those signed before stay.

    Raises
    ------
    UsageError
        If the name is missing, manual items are open, or the file is no longer the one checked.
    OutputError
        If it cannot be written.
    """
    items = manual_items(checked)
    open_items = [item for position, item in enumerate(items) if position not in done]
    problem = ""
    if not who.strip():
        problem = "name missing: type who signs"
    elif open_items:
        problem = f"not ticked off: {open_items[0].section}: {open_items[0].prompt}"
    elif checked.snapshot is not None:
        problem = "a mission on a vehicle may change: save it as a file and sign that"
    elif checked.sha256 is None or file_sha256(checked.file) != checked.sha256:
        problem = "the mission file changed after the check: check it again first"
    if problem:
        raise UsageError(problem)
    result = checked.result
    document = {
        "mission": checked.file,
        "mission_sha256": checked.sha256,
        "verdict": result.verdict,
        "signed_by": who.strip(),
        "signed_at": at.isoformat(timespec="seconds"),
        "command": checked.what_if.command_line(checked.file),
        "vehicle": result.setup.vehicle.name if isinstance(result, CheckResult) else None,
        "manual": [
            {"section": item.section, "prompt": item.prompt, "done": True} for item in items
        ],
        "findings": [values(one, _SIGNED) for one in result.findings],
        "suppressed": [values(one, _SIGNED) for one in result.suppressed],
        "checks": checks_document(result.checked),
    }
    text = json_text(envelope(__version__) | document, indent=2)
    path = _reserved_path(checked.file)
    try:
        write_output_file(path, text)
    except OutputError:
        path.unlink(missing_ok=True)
        raise
    return path


_SIGNED = ("code", "severity", "item", "message")
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
        brief = summary(self._checked.result)
        note = "with your changes" if self._checked.what_if.changes else ""
        self.query_one(VerdictStrip).show(brief, note=note)
        self.query_one("#who").border_title = f"Sign off this {brief.verdict}"
        self.query_one("#checklist").focus()

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
            path = write_sign_off(
                self._checked, done=self._done, who=event.value, at=datetime.now(UTC)
            )
        except MavjouleError as error:
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            self.app.notify(f"Signed: {path}", markup=False)
            self.dismiss()
