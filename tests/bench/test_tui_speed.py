"""What the terminal UI costs: opening it, and moving through a mission of any length."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import pytest
from long_missions import plan
from reviews import review_app, settled

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.tui.app import ReviewApp

pytestmark = pytest.mark.bench

SMALL = Path(__file__).parents[2] / "missions" / "survey-vineyard.plan"
STEPS = 60

VEHICLE = ("--vehicle", "falkowski-2023-quadrotor")
RUN = "import sys; from planner.cli.main import main; sys.exit(main(sys.argv[1:]))"
SIZES = {"one pane": (40, 120), "all panes": (48, 160)}
"""Rows and columns of the terminal."""
ROUNDS = 5


def _run_s(*arguments: str) -> float:
    begun = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, stderr=subprocess.DEVNULL)
    return time.perf_counter() - begun


def _open_s(size: tuple[int, int]) -> float:
    """Return the time from the start of the process until the verdict is on a terminal."""
    import fcntl
    import pty
    import struct
    import termios

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color", "PYTHONUTF8": "1"}
    begun = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-c", RUN, "review", str(SMALL), *VEHICLE],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=environment,
        start_new_session=True,
    ) as process:
        os.close(theirs)
        shown = b""
        while "✔ GO".encode() not in shown:
            shown += os.read(ours, 1 << 16)
        taken = time.perf_counter() - begun
        process.kill()
    os.close(ours)
    return taken


@pytest.mark.skipif(sys.platform == "win32", reason="there is no pty")
def test_opening() -> None:
    """The issue asks for at most 1.5 times ``import textual.app`` plus the check itself."""
    check = ["-c", RUN, "check", str(SMALL), *VEHICLE, "--output", os.devnull]
    works: dict[str, Callable[[], float]] = {
        "pass": partial(_run_s, "-c", "pass"),
        "textual": partial(_run_s, "-c", "import textual.app"),
        "check": partial(_run_s, *check),
        **{name: partial(_open_s, size) for name, size in SIZES.items()},
    }
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(ROUNDS + 1):  # in turn, so that another load on the machine meets all alike
        for name, work in works.items():
            times[name].append(work())
    least = {name: min(taken[1:]) for name, taken in times.items()}
    both_s = least["textual"] + least["check"] - least["pass"]
    print(
        f"\nimport textual.app {1e3 * least['textual']:.0f} ms, check "
        f"{1e3 * (least['check'] - least['pass']):.0f} ms more; verdict on the terminal: "
        + ", ".join(
            f"{name} {1e3 * least[name]:.0f} ms, {least[name] / both_s:.2f} times the two"
            for name in SIZES
        )
    )


async def _step_s(app: ReviewApp, keys: tuple[str, ...]) -> float:
    """Return the median time of a step down a list, all panes following.

    Of the processor: the pilot waits for more than the frame.
    """
    async with app.run_test(size=(160, 48)) as pilot:
        await settled(pilot)
        await pilot.press(*keys)
        await pilot.pause()
        times = []
        for _ in range(STEPS):
            begun = time.process_time()
            await pilot.press("down")
            times.append(time.process_time() - begun)
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
