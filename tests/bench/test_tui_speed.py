"""What the terminal UI costs: opening it, and moving through a mission of any length."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import pytest
from long_missions import plan, seconds
from reviews import review_app, settled

if TYPE_CHECKING:
    from planner.tui.app import ReviewApp

pytestmark = pytest.mark.bench

SMALL = Path(__file__).parents[2] / "missions" / "survey-vineyard.plan"
STEPS = 60

OPEN = """
import asyncio
from planner.cli.configuration import mission_settings
from planner.tui.app import ReviewApp
from planner.tui.what_if import WhatIf
async def main():
    def what_if_of(file):
        return WhatIf(settings=mission_settings(file, {{}}), given={{}}, changes={{}})
    app = ReviewApp(({file!r},), what_if_of)
    async with app.run_test(size=(120, 40)) as pilot:
        while app.screen.now is None:
            await asyncio.sleep(0.001)
asyncio.run(main())
"""


def _interpreter_s(code: str) -> float:
    return seconds(lambda: subprocess.run([sys.executable, "-c", code], check=True), runs=5)


def test_opening() -> None:
    """The issue asks for at most 1.5 times ``import textual.app`` plus the check itself."""
    textual_s = _interpreter_s("import textual.app")
    check_s = _interpreter_s(
        f"from planner.cli.main import main; main(['check', {str(SMALL)!r}, '--output', '/dev/null'])"
    )
    bare_s = _interpreter_s("pass")
    imported_s = _interpreter_s("import planner.tui.app")
    open_s = _interpreter_s(OPEN.format(file=str(SMALL)))
    print(
        f"\nimport textual.app {1e3 * textual_s:.0f} ms, check {1e3 * (check_s - bare_s):.0f} ms more; "
        f"import planner.tui.app {1e3 * imported_s:.0f} ms; open and checked {1e3 * open_s:.0f} ms: "
        f"{open_s / (textual_s + check_s - bare_s):.2f} times the two"
    )


async def _step_s(app: ReviewApp, keys: tuple[str, ...]) -> float:
    """Return the median time of a step down a list, all panes following."""
    async with app.run_test(size=(160, 48)) as pilot:
        await settled(pilot)
        await pilot.press(*keys)
        await pilot.pause()
        times = []
        for _ in range(STEPS):
            begun = time.perf_counter()
            await pilot.press("down")
            times.append(time.perf_counter() - begun)
        return median(times)


@pytest.mark.asyncio
@pytest.mark.parametrize("keys", [("4",), ("5",)], ids=["segments", "items"])
async def test_moving_through_ten_thousand_items(keys: tuple[str, ...], tmp_path: Path) -> None:
    """The issue asks for a frame time of at most 1.5 times that of a small mission."""
    times = []
    for count in (70, 10_000):
        (tmp_path / "bench.plan").write_text(plan(count), encoding="utf-8")
        times.append(await _step_s(review_app(str(tmp_path / "bench.plan")), keys))
    small_s, large_s = times
    print(
        f"\na step through 10,000 items {1e3 * large_s:.1f} ms, through 70 {1e3 * small_s:.1f} ms: "
        f"{large_s / small_s:.2f} times"
    )
