"""Missions to choose from, each checked in the background."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Static
from textual.worker import get_current_worker

from planner.errors import MavjouleError, bug_text
from planner.tui.checked import check_what_if
from planner.tui.mission_list import (
    EntryRows,
    entries_given,
    entries_of,
    preview,
    tally_text,
)
from planner.tui.watched import FileWatch, deciding_files
from planner.tui.widgets.details_pane import DetailsPane
from planner.tui.widgets.key_bar import KeyBar
from planner.tui.widgets.row_list import RowList

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from textual.app import ComposeResult

    from planner.service import CheckResult, UnreadableMission
    from planner.tui.mission_list import Entry
    from planner.tui.what_if import WhatIf

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
        Binding("question_mark", "app.toggle_help", "Keys"),
        Binding("q", "app.quit", "Quit"),
    ]

    @dataclass
    class Checked(Message, bubble=False):
        """One mission was checked; a text says why it could not be."""

        path: str
        result: CheckResult | UnreadableMission | str

    def __init__(self, paths: Sequence[str], what_if_of: Callable[[str], WhatIf]) -> None:
        super().__init__()
        self._entries = entries_given(paths)
        self._folder = Path(paths[0]) if len(paths) == 1 and Path(paths[0]).is_dir() else None
        self._what_if_of = what_if_of
        self._results: dict[str, CheckResult | UnreadableMission | str] = {}
        self._watch = FileWatch()

    def compose(self) -> ComposeResult:
        """Yield the list, the preview and the keys."""
        yield Static(id="tally")
        yield RowList(self._rows(), empty="No missions here.", id="missions")
        yield DetailsPane(id="preview")
        yield KeyBar()

    def on_mount(self) -> None:
        """Check everything."""
        self.query_one("#missions").focus()
        self._show()
        self._check_all()
        self.set_interval(WATCH_S, self.watch_files)

    def _rows(self) -> EntryRows:
        return EntryRows(entries=self._entries, results=dict(self._results))

    def _show(self) -> None:
        rows = self._rows()
        self.query_one("#missions", RowList).show(rows)
        self.query_one("#tally", Static).update(tally_text(rows))
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
        self._watch.follow(files)

    @work(thread=True, exclusive=True, group="missions", description="check")
    def _check(self, paths: Sequence[str]) -> None:
        worker = get_current_worker()
        for path in paths:
            if worker.is_cancelled:
                return
            try:
                result: CheckResult | UnreadableMission | str = check_what_if(
                    path, self._what_if_of(path)
                )
            except (MavjouleError, ValueError) as error:
                result = str(error)
            except Exception as error:  # noqa: BLE001 - the other missions are checked still
                result = bug_text(error)
            self.post_message(self.Checked(path, result))

    @on(Checked)
    def _take(self, event: MissionsScreen.Checked) -> None:
        self._results[event.path] = event.result
        self._show()

    @on(RowList.Selected, "#missions")
    def _on_selected(self) -> None:
        self._show_preview()

    @on(RowList.Chosen, "#missions")
    def _on_chosen(self, event: RowList.Chosen) -> None:
        self._open(self._entries[event.index])

    def _open(self, entry: Entry) -> None:
        from planner.tui.screens.review import ReviewScreen

        if entry.is_folder:
            self._go_to(Path(entry.path))
            return
        try:
            self.app.push_screen(ReviewScreen(entry.path, self._what_if_of))
        except MavjouleError as error:
            self.notify(str(error), severity="error", markup=False)

    def action_up(self) -> None:
        """Go to the folder above."""
        if self._folder is not None:
            self._go_to(self._folder / "..")

    def _go_to(self, folder: Path) -> None:
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
