"""Write the pictures of the README (`make pictures`): the verdict, the terminal UI and the page.

They stand in `.ci/pictures`, which neither the wheel nor the archive of the sources holds: `planner`,
`models` and `missions` are shipped to users, who have no use for them.
"""

from __future__ import annotations

import asyncio
import os
import re
import shutil
import sys
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / ".ci" / "pictures"
TOO_FAR = "missions/crossing-too-far.plan"
SURVEY = "missions/survey-vineyard.plan"
VEHICLE = "falkowski-2023-quadrotor"
COLUMNS = 104
SCREEN = (112, 36)


def verdict_svg() -> str:
    """Return what a check prints on a terminal, down to its conditions."""
    from rich.console import Console
    from rich.text import Text

    from planner.report.text import Medium, check_text

    printed = check_text([_result(TOO_FAR)], medium=Medium(width=COLUMNS, is_coloured=True))
    console = Console(record=True, width=COLUMNS, file=StringIO(), force_terminal=True)
    command = f"$ mavjoule check {TOO_FAR} --vehicle {VEHICLE}"
    console.print(Text.from_ansi(f"{command}\n{printed.partition(chr(10) + 'Phase')[0]}"))
    return console.export_svg(title="mavjoule check", unique_id="verdict")


def review_svg() -> str:
    """Return the screen of the terminal UI with a mission under review."""
    from tui.test_snapshots import screenshot

    text = asyncio.run(screenshot(Path(TOO_FAR).name, SCREEN, ()))
    return re.sub(r"terminal-\d+", "review", text)


def report_svg() -> str:
    """Return the map of the page, and its altitude, power and energy beside it."""
    from planner.report.plots import mission_figures
    from planner.report.plots.picture_files import write_figures

    figures = mission_figures(_result(SURVEY))
    with TemporaryDirectory() as folder:
        names = ("map", "altitude", "power", "energy")
        asked = {name: figures[name] for name in names}
        write_figures(asked, Path(folder), file_formats=("svg",))
        pictures = [Path(folder, f"{name}.svg").read_text(encoding="utf-8") for name in names]
    sizes = [re.findall(r'viewBox="0 0 (\d+) (\d+)"', one)[0] for one in pictures]
    map_width, map_height = map(int, sizes[0])
    top, placed = 0, [pictures[0]]
    for name, picture, (_, height) in zip(names[1:], pictures[1:], sizes[1:], strict=True):
        # what one picture clips by must not be what another does
        own = re.sub(r"(id=\"|url\(#)", rf"\1{name}-", picture)
        placed.append(own.replace("<svg ", f'<svg x="{map_width}" y="{top}" ', 1))
        top += int(height)
    width = map_width + max(int(one) for one, _ in sizes[1:])
    height = max(map_height, top)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}"><rect width="{width}" height="{height}" fill="#ffffff"/>'
        f"{''.join(placed)}</svg>\n"
    )


def _result(mission: str) -> CheckResult:
    from planner.cli.configuration import mission_settings
    from planner.mission.files import read_mission
    from planner.service.preflight import check_mission
    from planner.setup import Setup

    setup = Setup.of(mission_settings(mission, {"vehicle": VEHICLE}))
    return check_mission(read_mission(mission), setup)


def main() -> None:
    """Write every picture."""
    sys.path.insert(0, str(ROOT / "tests"))
    PICTURES.mkdir(exist_ok=True)
    os.chdir(ROOT)
    for name, make in (("verdict", verdict_svg), ("report", report_svg)):
        (PICTURES / f"{name}.svg").write_text(make(), encoding="utf-8")
    with TemporaryDirectory() as folder:
        missions = Path(folder, "missions")
        shutil.copytree(ROOT / "missions", missions)
        with (missions / "mavjoule.toml").open("a", encoding="utf-8") as settings:
            settings.write(f'vehicle = "{VEHICLE}"\n')
        os.chdir(missions)
        (PICTURES / "review.svg").write_text(review_svg(), encoding="utf-8")
        os.chdir(ROOT)


if __name__ == "__main__":
    main()
