"""Snapshots of the screen: what it looked like, not what is true.

Run this file to take them anew after a change that is meant to show.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent / "snapshots"
SHOTS = {
    "energy-of-a-no-go": ("crossing-too-far.plan", (80, 24), ("p", "p", "p", "2"), False),
    "map-of-a-survey": ("survey-vineyard.plan", (80, 24), ("3",), False),
    "fleet-in-time": ("fleets/delivery-two-pads.toml", (80, 24), ("n", "n"), False),
    "smallest": ("crossing-too-far.plan", (60, 16), ("p", "p", "p", "2"), False),
    "smallest-in-ascii": ("survey-vineyard.plan", (60, 16), ("3",), True),
    "energy-in-ascii": ("crossing-too-far.plan", (80, 24), ("p", "p", "p", "2"), True),
    "what-if": ("crossing-too-far.plan", (80, 24), ("6",), False),
    "all-panes": ("crossing-too-far.plan", (140, 42), ("p", "p", "p"), False),
    "all-panes-in-ascii": ("crossing-too-far.plan", (140, 42), (), True),
}
"""Mission, size of the terminal, keys, and whether it is drawn in ASCII, by name."""


async def screenshot(
    mission: str,
    size: tuple[int, int],
    keys: tuple[str, ...],
    is_ascii: bool = False,  # noqa: FBT001, FBT002 - as in the table
) -> str:
    from reviews import checked, review_app

    async with review_app(mission, is_ascii=is_ascii).run_test(size=size) as pilot:
        await checked(pilot)
        for key in keys:
            await pilot.press(key)
        await checked(pilot)
        return pilot.app.export_screenshot()


@pytest.mark.asyncio
@pytest.mark.parametrize("name", SHOTS)
async def test_the_screen_looks_as_it_did(name: str) -> None:
    shutil.copytree(FOLDER.parents[2] / "missions" / "fleets", "fleets")
    taken = (FOLDER / f"{name}.svg").read_text(encoding="utf-8")
    assert await screenshot(*SHOTS[name]) == taken, f"run {Path(__file__).name} if this is meant"


def _take() -> None:
    root = FOLDER.parents[2]
    sys.path.insert(0, str(root / "tests"))
    samples = Path(tempfile.mkdtemp()) / "missions"
    shutil.copytree(root / "missions", samples)
    with (samples / "mavjoule.toml").open("a", encoding="utf-8") as settings:
        settings.write('vehicle = "falkowski-2023-quadrotor"\n')
    os.chdir(samples)
    FOLDER.mkdir(exist_ok=True)
    for name, shot in SHOTS.items():
        text = asyncio.run(screenshot(*shot))
        (FOLDER / f"{name}.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    _take()
