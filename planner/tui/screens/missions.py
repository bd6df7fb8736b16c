"""Missions to choose from: files and folders, each checked in the background."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Static
from textual.worker import get_current_worker

from planner import quantity
from planner.errors import FleetFileError, MavjouleError, bug_text
from planner.findings import Severity
from planner.fleet.reader import is_fleet_file
from planner.mission.folder import is_mission
from planner.report.fleet import fleet_headline
from planner.report.text import by_weight, headline, printable
from planner.service.fleet import FleetResult
from planner.service.preflight import CheckResult, UnreadableMission, check_file
from planner.tui.checked import FileWatch, deciding_files
from planner.tui.details import Details, summary
from planner.tui.rows import LEFT_OPEN, MARKS, NOT_CHECKED, finding_line
from planner.tui.screens.fleet import FleetScreen, checked_fleet, fleet_files, fleet_summary
from planner.tui.widgets.bars import KeyBar
from planner.tui.widgets.panes import DetailsPane
from planner.tui.widgets.row_list import RowList, Table, TableColumn
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from textual.app import ComposeResult

    from planner.tui.what_if import WhatIf


FLEET_SUFFIX = ".toml"
"""What fleet files are called, as are models and settings, which hold other tables."""
MOST_LISTED = 2000


Outcome = CheckResult | UnreadableMission | FleetResult | str
"""Of a check; a text says why a mission could not be checked."""


class MissionEntry(Value):
    """A mission, or a folder that may hold some."""

    path: str
    name: str
    is_folder: bool = False
    is_fleet: bool = False


def entries_of(folder: Path) -> tuple[MissionEntry, ...]:
    """Return the missions and fleets of a folder and its folders, the way up last.

    Hidden ones are left out; what cannot be read holds nothing.
    """
    try:
        inside = sorted(folder.iterdir(), key=lambda path: path.name.lower())
    except OSError:
        inside = []
    seen = [path for path in inside if not path.name.startswith(".")][:MOST_LISTED]
    missions = [path for path in seen if path.is_file() and is_mission(path)]
    missions += [
        path for path in seen if path.suffix.lower() == FLEET_SUFFIX and is_fleet_file(path)
    ]
    folders = [path for path in seen if path.is_dir()]
    return (
        *(_entry(str(path), path.name) for path in (*missions, *folders)),
        _entry(str(folder / ".."), ".."),
    )


def _entry(path: str, name: str) -> MissionEntry:
    is_folder = Path(path).is_dir()
    return MissionEntry(
        path=path,
        name=printable(name) + ("/" if is_folder else ""),
        is_folder=is_folder,
        is_fleet=not is_folder and Path(path).suffix.lower() == FLEET_SUFFIX,
    )


def entries_given(paths: Sequence[str]) -> tuple[MissionEntry, ...]:
    """Return the missions and folders that are named; of a single folder what it holds."""
    if len(paths) == 1 and Path(paths[0]).is_dir():
        return entries_of(Path(paths[0]))
    return tuple(_entry(path, path) for path in paths)


def mission_table(entries: Sequence[MissionEntry], results: Mapping[str, Outcome]) -> Table:
    """Return missions as rows: sign, name as wide as it needs, verdict, what the flight takes."""
    widest = max((len(entry.name) for entry in entries), default=0)

    def cells(entry: MissionEntry) -> tuple[str, ...]:
        result = results.get(entry.path)
        if entry.is_folder:
            return "▸", entry.name, "", "folder"
        if result is None:
            return "…", entry.name, "", "checking"
        if isinstance(result, str):
            return MARKS[Severity.ERROR], entry.name, "NO-GO", printable(result)
        sign = (
            "✔" if _is_go(result) else _OPEN_SIGNS.get(result.verdict_text, MARKS[Severity.ERROR])
        )
        return sign, entry.name, result.verdict_text, _headline(result)

    return Table(
        entries=entries,
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="mission", width=min(max(widest, 7), 36), is_right=False),
            TableColumn(head="verdict", width=11, is_right=False),
            TableColumn(head="", width=0, is_right=False),
        ),
        cells_of=cells,
        tone_of=lambda entry: _tone(results.get(entry.path)),
    )


def _headline(result: CheckResult | UnreadableMission | FleetResult) -> str:
    return fleet_headline(result) if isinstance(result, FleetResult) else headline(result)


_OPEN_SIGNS = {NOT_CHECKED: LEFT_OPEN}


def _tone(result: Outcome | None) -> str:
    if result is None or _is_go(result):
        return ""
    return "warning" if _is_left_open(result) else "error"


def _is_left_open(result: Outcome) -> bool:
    return not isinstance(result, str) and result.verdict_text == NOT_CHECKED


def _is_go(result: Outcome) -> bool:
    return not isinstance(result, str) and result.verdict == "go"


def preview(entry: MissionEntry, result: Outcome | None) -> Details:
    """Return what is shown of a mission before it is opened."""
    if entry.is_folder or result is None:
        return Details(title=entry.name)
    if isinstance(result, str):
        return Details(title=entry.name, tone="error", parts=(("", printable(result)),))
    if isinstance(result, FleetResult):
        brief, found = fleet_summary(result), result.all_findings
    else:
        brief, found = summary(result), result.findings
    problems = dict.fromkeys(map(finding_line, by_weight(found)[0]))
    texts = (
        brief.given,
        brief.headline,
        brief.return_plan,
        *problems,
        brief.closing,
        brief.not_checked,
    )
    return Details(
        title=f"{brief.verdict}  {entry.name}",
        tone=_tone(result),
        parts=tuple(("", text) for text in texts if text),
    )


def tally_text(entries: Sequence[MissionEntry], results: Mapping[str, Outcome]) -> str:
    """Return how many missions are checked and go, in a line."""
    missions = [entry for entry in entries if not entry.is_folder]
    done = [results[entry.path] for entry in missions if entry.path in results]
    going, left_open = sum(map(_is_go, done)), sum(map(_is_left_open, done))
    text = (
        f"{quantity.count(len(missions), 'mission')}: {going} GO, "
        f"{len(done) - going - left_open} NO-GO"
    )
    text += f", {left_open} {NOT_CHECKED}" if left_open else ""
    left = len(missions) - len(done)
    return f"{text}, {left} being checked" if left else text


WATCH_S = 2.0
"""How often the files are looked at. [s]"""


class MissionsScreen(Screen[None]):
    """A list of missions with their verdicts, and a preview of the selected one."""

    DEFAULT_CSS = """
    MissionsScreen #tally { height: 1; padding: 0 1; background: $panel; text-style: bold; }
    MissionsScreen #missions { height: 1fr; }
    MissionsScreen #preview { height: 40%; border-top: solid $foreground 40%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("r", "recheck", "Check again"),
        Binding("backspace", "up", "Folder up"),
        Binding("escape", "back", "Back", show=False),
        Binding("question_mark", "app.show_help", "Help"),
        Binding("q", "app.quit", "Quit"),
    ]

    def __init__(self, paths: Sequence[str], what_if_of: Callable[[str], WhatIf]) -> None:
        super().__init__()
        self._entries = entries_given(paths)
        self._folder = Path(paths[0]) if len(paths) == 1 and Path(paths[0]).is_dir() else None
        self._what_if_of = what_if_of
        self._results: dict[str, Outcome] = {}
        self._watch = FileWatch()
        self._left: list[Path] = []
        """The folders that were left for others, the last one last."""

    def compose(self) -> ComposeResult:
        """Yield the list, the preview and the keys."""
        yield Static(id="tally")
        yield RowList(mission_table((), {}), empty="No missions here.", id="missions")
        yield DetailsPane(id="preview")
        yield KeyBar()

    def on_mount(self) -> None:
        """Check everything."""
        self.query_one("#missions").focus()
        self._show()
        self._check_all()
        self.set_interval(WATCH_S, self.watch_files)

    def _show(self) -> None:
        rows = mission_table(self._entries, self._results)
        self.query_one("#missions", RowList).show(rows)
        self.query_one("#tally", Static).update(tally_text(self._entries, self._results))
        self._show_preview()

    def _show_preview(self) -> None:
        at = self.query_one("#missions", RowList).cursor
        if at < len(self._entries):
            entry = self._entries[at]
            self.query_one(DetailsPane).show(preview(entry, self._results.get(entry.path)))

    def watch_files(self) -> None:
        """Check what is new or was written since, if no check is under way."""
        if any(worker.group == "missions" and worker.is_running for worker in self.workers):
            return
        if self._folder is not None and (entries := entries_of(self._folder)) != self._entries:
            self._entries = entries
            self._show()
        changed = {str(path) for path in self._watch.changed()}
        self._follow()
        paths = self._paths()
        if not changed <= set(paths):
            self.action_recheck()  # a model, a profile or the configuration decides for all
        elif todo := [path for path in paths if path in changed or path not in self._results]:
            self._check(todo)

    def _paths(self) -> list[str]:
        return [one.path for one in self._entries if not one.is_folder]

    def _follow(self) -> None:
        """Look at the missions, and at what decides the verdict of the first."""
        paths = self._paths()
        files = [Path(path) for path in paths]
        for path in paths[:1]:
            with suppress(MavjouleError):
                files += deciding_files(path, self._what_if_of(path))
        for result in self._results.values():
            files += fleet_files(result) if isinstance(result, FleetResult) else ()
        self._watch.follow(files)

    @work(thread=True, exclusive=True, group="missions", description="check")
    def _check(self, paths: Sequence[str]) -> None:
        worker = get_current_worker()
        for path in paths:
            if worker.is_cancelled:
                return
            try:
                result = self._checked(path)
            except FleetFileError as error:
                result = "; ".join(error.problems)
            except (MavjouleError, ValueError) as error:
                result = str(error)
            except Exception as error:  # noqa: BLE001 - the other missions are checked still
                result = bug_text(error)
            self.call_later(self._take, path, result)

    def _checked(self, path: str) -> Outcome:
        what_if = self._what_if_of(path)
        if Path(path).suffix.lower() == FLEET_SUFFIX:
            return checked_fleet(path, what_if.given)
        return check_file(path, what_if.setup())

    def _take(self, path: str, result: Outcome) -> None:
        self._results[path] = result
        self._follow()
        self._show()

    @on(RowList.Selected, "#missions")
    def _on_selected(self) -> None:
        self._show_preview()

    @on(RowList.Chosen, "#missions")
    def _on_chosen(self, event: RowList.Chosen) -> None:
        self._open(self._entries[event.index])

    def _open(self, entry: MissionEntry) -> None:
        from planner.tui.screens.review import ReviewScreen

        if entry.is_folder:
            self._go_to(Path(entry.path))
            return
        try:
            if entry.is_fleet:
                known = self._results.get(entry.path)
                given = self._what_if_of(entry.path).given
                result = known if isinstance(known, FleetResult) else None
                self.app.push_screen(FleetScreen(entry.path, given, result))
            else:
                self.app.push_screen(ReviewScreen(entry.path, self._what_if_of))
        except MavjouleError as error:
            self.notify(str(error), severity="error", markup=False)

    def action_up(self) -> None:
        """Go to the folder above."""
        if self._folder is not None:
            self._go_to(self._folder / "..")

    def action_back(self) -> None:
        """Go to the folder this was entered from, or to the review."""
        if self._left:
            self._go_to(self._left.pop(), is_back=True)
        elif len(self.app.screen_stack) > 1:
            self.app.pop_screen()

    def _go_to(self, folder: Path, *, is_back: bool = False) -> None:
        if self._folder is not None and not is_back:
            self._left.append(self._folder)
        self._folder = folder.resolve()
        self._entries = entries_of(self._folder)
        self.workers.cancel_group(self, "missions")
        self.query_one("#missions", RowList).select(0)
        self._show()
        self._check_all()

    def action_recheck(self) -> None:
        """Check everything again."""
        self._results.clear()
        self._show()
        self._check_all()

    def _check_all(self) -> None:
        self._follow()
        if paths := self._paths():
            self._check(paths)
