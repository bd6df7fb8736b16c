"""Saves a review under a name, and the parts of a split mission in a folder."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from planner import __version__, quantity
from planner.errors import MavjouleError, UsageError
from planner.files import is_among, write_output_file
from planner.mission.convert import mission_at_speed
from planner.mission.files import write_mission
from planner.report.json import check_json
from planner.report.split import flown_text
from planner.report.text import Medium, check_text, headline, printable
from planner.service.conversion import convert_file
from planner.setup import files_named
from planner.tui.rows import finding_line

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from planner.service.split import Split
    from planner.tui.checked import Checked


MISSION_SUFFIXES = frozenset({".plan", ".waypoints"})


def _offered(checked: Checked, ending: str) -> str:
    """Return the name that is offered: beside the mission."""
    file = Path("vehicle" if checked.snapshot is not None else checked.file)
    return str(file.with_name(f"{file.stem}{ending}"))


class OverwriteError(UsageError):
    """The file exists; asked a second time, it is overwritten."""


def save_parts(split: Split, name: str, *, replace: bool = False) -> str:
    """Save the flights of a split, all or none, in a folder; return what was done, in a sentence.

    Parts that are there, or would be left over of another split, raise ``UsageError``.
    """
    from planner.service.split import write_split

    folder = Path(name.strip()).expanduser()
    if not replace and any(folder.glob("part-*.plan")):
        msg = f"{folder} already holds parts: press Enter again to overwrite them"
        raise OverwriteError(msg)
    write_split(split, folder, force=replace)
    return f"{quantity.count(len(split.parts), 'part')} in {folder}"


def save(checked: Checked, name: str, *, replace: bool = False) -> str:
    """Save a review: its report or, by the suffix, the mission; return what was done, in a sentence.

    A speed that was tried is commanded in the mission that is saved; a file that was read is never
    written over.  There is no report of a speed that is tried: the file flies its own.

    A suffix of nothing, a file that is there or was read, and a report of such a speed raise ``UsageError``.
    """
    path = Path(name.strip()).expanduser()
    suffix = path.suffix.lower()
    if suffix not in {".txt", ".json", ".html", *MISSION_SUFFIXES}:
        msg = "expected .txt, .json or .html for the report, .plan or .waypoints for the mission"
        raise UsageError(msg)
    if is_among(path, (checked.file, *files_named(checked.what_if.values()))):
        msg = f"{path} is an input of this review: choose another name"
        raise UsageError(msg)
    if path.exists() and not replace:
        msg = f"{path} exists: press Enter again to overwrite it"
        raise OverwriteError(msg)
    if suffix in MISSION_SUFFIXES:
        return _save_mission(checked, path)
    if checked.tried_speed:
        msg = f"the file flies its own speeds: save the mission at {checked.tried_speed}, then its report"
        raise UsageError(msg)
    results = [checked.result]
    if suffix == ".json":
        write_output_file(path, check_json(results, version=__version__))
    elif suffix == ".html":
        from planner.report.html.page import check_html

        sha256 = {} if checked.sha256 is None else {checked.file: checked.sha256}
        page = check_html(results, version=__version__, made_at=datetime.now(UTC), sha256=sha256)
        write_output_file(path, page)
    else:
        command = checked.what_if.command_line(checked.file)
        write_output_file(path, f"{check_text(results, medium=Medium())}\n$ {command}\n")
    return f"{path}: the report"


def _save_mission(checked: Checked, path: Path) -> str:
    speed_m_s = checked.what_if.values().get("speed_m_s")
    if checked.snapshot is None:
        done = convert_file(checked.file, path, speed_m_s=speed_m_s)
        items, losses = done.items, done.losses
    else:
        mission = checked.snapshot.mission
        if speed_m_s is not None:
            mission = mission_at_speed(mission, speed_m_s)
        items, losses = len(mission.items), write_mission(mission, path)
    flown = "" if speed_m_s is None else f" at {quantity.speed(speed_m_s)}"
    lost = f"; {quantity.count(len(losses), 'difference')} in this format" if losses else ""
    return f"{path}: the mission{flown}, {quantity.count(items, 'item')}{lost}"


class _SaveDialog(ModalScreen[None]):
    """A field that says where to; what exists is overwritten when asked a second time."""

    DEFAULT_CSS = """
    _SaveDialog { align: center middle; background: $background 60%; }
    _SaveDialog > Vertical { background: $panel; border: round $primary; }
    _SaveDialog #problem { color: $text-warning; height: auto; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Back")]
    _asked = ""
    """What exists, as the user was warned."""

    def save(self, name: str, *, replace: bool) -> str:
        """Save under a name; return what was done."""
        raise NotImplementedError

    def on_mount(self) -> None:
        """Put the keyboard into the field."""
        self.query_one(Input).focus()

    @on(Input.Submitted)
    def _save(self, event: Input.Submitted) -> None:
        try:
            done = self.save(event.value, replace=event.value == self._asked)
        except MavjouleError as error:
            if isinstance(error, OverwriteError):
                self._asked = event.value
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            self.app.notify(f"Saved {done}", markup=False)
            self.dismiss()


class SaveScreen(_SaveDialog):
    """One field; the suffix says what is saved."""

    DEFAULT_CSS = "SaveScreen > Vertical { width: 90%; max-width: 90; height: auto; padding: 1 2; }"

    def __init__(self, checked: Checked) -> None:
        super().__init__()
        self._checked = checked

    def compose(self) -> ComposeResult:
        """Yield the field and what may be written."""
        with Vertical():
            yield Static(Content.styled("Save as", "bold"))
            yield Input(_offered(self._checked, ".report.txt"), id="name")
            yield Static(
                ".txt, .json, .html: the report.  .plan or .waypoints: the mission, at the speed tried."
            )
            yield Static(id="problem")

    def save(self, name: str, *, replace: bool) -> str:
        """Save the report or the mission."""
        return save(self._checked, name, replace=replace)


class SplitScreen(_SaveDialog):
    """The flights of a split, and the field for the folder they are saved in."""

    DEFAULT_CSS = """
    SplitScreen > Vertical {
        width: 96%; max-width: 120; height: 96%; max-height: 30; padding: 0 1;
    }
    SplitScreen VerticalScroll { height: 1fr; }
    SplitScreen #problem { max-height: 2; }
    """

    def __init__(self, split: Split, checked: Checked) -> None:
        super().__init__()
        self._split = split
        self._folder = _offered(checked, "-parts")

    def compose(self) -> ComposeResult:
        """Yield the flights and the field."""
        with Vertical():
            with VerticalScroll():
                yield Static(_split_content(self._split), id="parts")
            yield Static("Save the parts in this folder (Enter: save, Escape: back)")
            yield Input(self._folder, id="folder")
            yield Static(id="problem")

    def save(self, name: str, *, replace: bool) -> str:
        """Save the parts."""
        return save_parts(self._split, name, replace=replace)


def _split_content(split: Split) -> Content:
    """Return the flights, and what is other than in the mission."""
    flights = quantity.count(len(split.parts), "flight")
    whole = quantity.energy(split.whole.totals.energy_wh)
    lines = [Content.styled(f"{flights} instead of one of {whole}", "bold")]
    for part in split.parts:
        name, verdict = printable(Path(part.file).name), part.result.verdict_text
        lines.append(Content(f"✔ {verdict}  {name}  {flown_text(part)}"))
        lines.append(Content(f"      {headline(part.result)}"))
    lines += [Content(finding_line(one)) for one in split.findings]
    return Content("\n").join(lines)
