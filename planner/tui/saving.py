"""What can be saved of a review, by the suffix of the file's name."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from planner import (
    __version__,
    quantity,
    service,
)
from planner.errors import UsageError
from planner.files import write_output_file
from planner.mission.convert import mission_at_speed
from planner.mission.files import write_mission
from planner.report.json import check_json
from planner.report.medium import Medium
from planner.report.text import check_text

if TYPE_CHECKING:
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
        done = service.convert_file(checked.file, path, speed_m_s=speed_m_s)
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
