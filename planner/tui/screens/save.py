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
from planner.files import write_output_file
from planner.mission.convert import mission_at_speed
from planner.mission.files import write_mission
from planner.report.json import check_json
from planner.report.split import flown_text
from planner.report.text import Medium, check_text, finding_message, headline, printable
from planner.service.conversion import convert_file
from planner.tui.rows import MARKS

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from planner.service.split import Split
    from planner.tui.checked import Checked


MISSION_SUFFIXES = frozenset({".plan", ".waypoints"})


def default_name(checked: Checked) -> str:
    """Return the name that is offered for the report of a mission: beside it."""
    if checked.snapshot is not None:
        return "vehicle.report.txt"
    return str(Path(checked.file).with_suffix(".report.txt"))


def parts_folder(checked: Checked) -> str:
    """Return the folder that is offered for the parts of a mission: beside it."""
    if checked.snapshot is not None:
        return "vehicle-parts"
    file = Path(checked.file)
    return str(file.with_name(f"{file.stem}-parts"))


def save_parts(split: Split, folder: Path, *, replace: bool = False) -> str:
    """Save the flights of a split: all of them, or none.

    Parameters
    ----------
    split : Split
        As it was shown.
    folder : Path
        Where to; made where it is not there.
    replace : bool
        Whether to write over parts that are there.

    Returns
    -------
    str
        What was done, in a sentence.

    Raises
    ------
    UsageError
        If there are parts already, or parts of another split would be left over.
    OutputError
        If a part cannot be written.
    """
    from planner.service.split import write_split

    write_split(split, folder, force=replace)
    return f"{quantity.count(len(split.parts), 'part')} in {folder}"


def save(checked: Checked, name: str, *, replace: bool = False) -> str:
    """Save a review: its report, or the mission as it was tried.

    A speed that was tried is commanded in the mission that is saved.

    Parameters
    ----------
    checked : Checked
        What is reviewed.
    name : str
        The file to write; its suffix says what.
    replace : bool
        Whether to write over a file that is there; the mission itself is never written over.

    Returns
    -------
    str
        What was done, in a sentence.

    Raises
    ------
    UsageError
        If the suffix says nothing, the file is there, or it is one that was read.
    MavjouleError
        If it cannot be written.
    """
    path = Path(name.strip()).expanduser()
    suffix = path.suffix.lower()
    if suffix not in {".txt", ".json", ".html", *MISSION_SUFFIXES}:
        msg = "expected .txt, .json or .html for the report, .plan or .waypoints for the mission"
        raise UsageError(msg)
    if path.exists():
        if _is_read(checked, path):
            msg = f"{path} is an input of this review: choose another name"
            raise UsageError(msg)
        if not replace:
            msg = f"{path} exists: press Enter again to overwrite it"
            raise OverwriteError(msg)
    if suffix in MISSION_SUFFIXES:
        return _save_mission(checked, path)
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


class OverwriteError(UsageError):
    """The file exists; asked a second time, it is overwritten."""


def _is_read(checked: Checked, path: Path) -> bool:
    settings = checked.what_if.values()
    read = [
        checked.file,
        *(str(settings[key]) for key in ("vehicle", "params", "profile") if key in settings),
    ]
    return any(Path(one).exists() and path.samefile(one) for one in read)


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


class SplitScreen(ModalScreen[None]):
    """The flights of a split, and the field for the folder they are saved in."""

    DEFAULT_CSS = """
    SplitScreen { align: center middle; background: $background 60%; }
    SplitScreen > Vertical {
        width: 96%; max-width: 120; height: 96%; max-height: 30; padding: 0 1;
        background: $panel; border: round $primary;
    }
    SplitScreen VerticalScroll { height: 1fr; }
    SplitScreen #problem { color: $text-warning; height: auto; max-height: 2; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Back")]

    def __init__(self, split: Split, checked: Checked) -> None:
        super().__init__()
        self._split = split
        self._checked = checked
        self._asked = ""
        """The folder with parts in it that the user was warned of."""

    def compose(self) -> ComposeResult:
        """Yield the flights and the field."""
        with Vertical():
            with VerticalScroll():
                yield Static(_split_content(self._split), id="parts")
            yield Static("Save the parts in this folder (Enter: save, Escape: back)")
            yield Input(parts_folder(self._checked), id="folder")
            yield Static(id="problem")

    def on_mount(self) -> None:
        """Put the keyboard into the field."""
        self.query_one("#folder").focus()

    @on(Input.Submitted)
    def _save(self, event: Input.Submitted) -> None:
        folder = Path(event.value.strip()).expanduser()
        if any(folder.glob("part-*.plan")) and event.value != self._asked:
            self._asked = event.value
            message = f"{folder} already holds parts: press Enter again to overwrite them"
            self.query_one("#problem", Static).update(Content(message))
            return
        try:
            done = save_parts(self._split, folder, replace=event.value == self._asked)
        except MavjouleError as error:
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            self.app.notify(f"Saved {done}", markup=False)
            self.dismiss()


def _split_content(split: Split) -> Content:
    """Return the flights, and what is other than in the mission."""
    flights = quantity.count(len(split.parts), "flight")
    whole = quantity.energy(split.whole.totals.energy_wh)
    lines = [Content.styled(f"{flights} instead of one of {whole}", "bold")]
    for part in split.parts:
        name = printable(Path(part.file).name)
        verdict = part.result.verdict.upper()
        lines.append(Content(f"✔ {verdict}  {name}  {flown_text(part)}"))
        lines.append(Content(f"      {headline(part.result)}"))
    lines += [
        Content(f"{MARKS[one.severity]} {one.code} {finding_message(one)}")
        for one in split.findings
    ]
    return Content("\n").join(lines)
