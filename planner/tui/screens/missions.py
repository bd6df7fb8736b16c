"""Missions to choose from, each checked in the background."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Footer, Static
from textual.worker import get_current_worker

from planner.errors import MavjouleError
from planner.tui.checked import check_what_if, file_stamp
from planner.tui.mission_list import (
    EntryRows,
    entries_given,
    entries_of,
    preview,
    tally_text,
)
from planner.tui.widgets.details_pane import DetailsPane
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
    """A list of missions with their verdicts, and what is told about the selected one."""

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
        self._stamps: dict[str, tuple[int, int] | None] = {}

    def compose(self) -> ComposeResult:
        """Yield the list, the preview and the keys."""
        yield Static(id="tally")
        yield RowList(self._rows(), empty="No missions here.", id="missions")
        yield DetailsPane(id="preview")
        yield Footer()

    def on_mount(self) -> None:
        """Check everything."""
        self.query_one("#missions").focus()
        self._show()
        self._check_changed()
        self.set_interval(WATCH_S, self._check_changed)

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

    def _check_changed(self) -> None:
        """Check what is new or was written since, if no check is under way."""
        if any(worker.group == "missions" and worker.is_running for worker in self.workers):
            return
        stamps = {one.path: file_stamp(one.path) for one in self._entries if not one.is_folder}
        changed = [path for path, stamp in stamps.items() if self._stamps.get(path, ()) != stamp]
        self._stamps.update(stamps)
        if changed:
            self._check(changed)

    @work(thread=True, exclusive=True, group="missions", exit_on_error=False)
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
            what_if = self._what_if_of(entry.path)
        except MavjouleError as error:
            self.notify(str(error), severity="error", markup=False)
        else:
            self.app.push_screen(ReviewScreen(entry.path, what_if))

    def action_up(self) -> None:
        """Go to the folder above."""
        if self._folder is not None:
            self._go_to(self._folder / "..")

    def _go_to(self, folder: Path) -> None:
        self._folder = folder.resolve()
        self._entries = entries_of(self._folder)
        self.workers.cancel_group(self, "missions")
        self._stamps.clear()
        self.query_one("#missions", RowList).select(0)
        self._show()
        self._check_all()

    def action_recheck(self) -> None:
        """Check everything again."""
        self._results.clear()
        self._stamps.clear()
        self._show()
        self._check_all()

    def _check_all(self) -> None:
        paths = [one.path for one in self._entries if not one.is_folder]
        self._stamps = {path: file_stamp(path) for path in paths}
        if paths:
            self._check(paths)
