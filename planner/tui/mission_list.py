"""The missions to choose from: files and folders, each with its verdict once it is checked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Severity
from planner.report.text import headline, printable
from planner.tui.details import Details
from planner.tui.rows import MARKS, Column, finding_line
from planner.tui.verdict import summary
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.service import CheckResult, UnreadableMission

SUFFIXES = frozenset({".plan", ".waypoints", ".mission"})
"""What mission files are called; a file that is named by the user may be called anything."""
MOST_LISTED = 2000


class Entry(Value):
    """A mission, or a folder that may hold some."""

    path: str
    name: str
    is_folder: bool = False


def entries_of(folder: Path) -> tuple[Entry, ...]:
    """Return the missions of a folder and its folders, the way up first.

    Hidden ones are left out; what cannot be read holds nothing.
    """
    try:
        inside = sorted(folder.iterdir(), key=lambda path: path.name.lower())
    except OSError:
        inside = []
    up = Entry(path=str(folder / ".."), name="../", is_folder=True)
    seen = [path for path in inside if not path.name.startswith(".")][:MOST_LISTED]
    missions = [
        Entry(path=str(path), name=printable(path.name))
        for path in seen
        if path.suffix.lower() in SUFFIXES and path.is_file()
    ]
    folders = [
        Entry(path=str(path), name=f"{printable(path.name)}/", is_folder=True)
        for path in seen
        if path.is_dir()
    ]
    return (*missions, *folders, up)


def entries_given(paths: Sequence[str]) -> tuple[Entry, ...]:
    """Return the missions and folders that are named; of a single folder what it holds."""
    if len(paths) == 1 and Path(paths[0]).is_dir():
        return entries_of(Path(paths[0]))
    return tuple(
        Entry(
            path=path,
            name=printable(path) + ("/" if Path(path).is_dir() else ""),
            is_folder=Path(path).is_dir(),
        )
        for path in paths
    )


class EntryRows(Value, eq=False):
    """Missions as rows: sign, name, verdict with what the flight takes and leaves."""

    entries: tuple[Entry, ...]
    results: Mapping[str, CheckResult | UnreadableMission | str]
    """By path; a text says why a mission could not be checked."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """Heads and widths; the names as wide as they need."""
        widest = max((len(entry.name) for entry in self.entries), default=0)
        return (
            Column(head="", width=1),
            Column(head="mission", width=min(max(widest, 7), 36), is_right=False),
            Column(head="verdict", width=7, is_right=False),
            Column(head="", width=0, is_right=False),
        )

    def __len__(self) -> int:
        return len(self.entries)

    def cells(self, index: int) -> tuple[str, ...]:
        """Return sign, name, verdict and figures."""
        entry = self.entries[index]
        if entry.is_folder:
            return "▸", entry.name, "", "folder"
        result = self.results.get(entry.path)
        if result is None:
            return "…", entry.name, "", "checking"
        if isinstance(result, str):
            return MARKS[Severity.ERROR], entry.name, "NO-GO", printable(result)
        sign = "✔" if result.verdict == "go" else MARKS[Severity.ERROR]
        return sign, entry.name, result.verdict.upper(), headline(result)

    def tone(self, index: int) -> str:
        """Return ``error`` for a no-go."""
        result = self.results.get(self.entries[index].path)
        if result is None:
            return ""
        return "" if not isinstance(result, str) and result.verdict == "go" else "error"


def preview(entry: Entry, result: CheckResult | UnreadableMission | str | None) -> Details:
    """Return what is shown of a mission before it is opened."""
    if entry.is_folder or result is None:
        return Details(title=entry.name)
    if isinstance(result, str):
        return Details(title=entry.name, tone="error", parts=(("", printable(result)),))
    said = summary(result)
    parts = [("", said.headline)]
    if said.return_plan:
        parts.append(("", said.return_plan))
    parts += [("", finding_line(f)) for f in result.findings if f.severity > Severity.INFO]
    parts.append(("", said.closing))
    return Details(
        title=f"{said.verdict}  {entry.name}",
        tone="" if said.is_go else "error",
        parts=tuple(parts),
    )


def tally_text(rows: EntryRows) -> str:
    """Return how many missions are checked and go, in a line."""
    missions = [entry for entry in rows.entries if not entry.is_folder]
    done = [rows.results[entry.path] for entry in missions if entry.path in rows.results]
    going = sum(not isinstance(one, str) and one.verdict == "go" for one in done)
    text = f"{quantity.count(len(missions), 'mission')}: {going} GO, {len(done) - going} NO-GO"
    left = len(missions) - len(done)
    return f"{text}, {left} being checked" if left else text
