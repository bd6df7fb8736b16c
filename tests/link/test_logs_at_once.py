"""Two calls that download one log at once: it comes whole by one, and the other says why not."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from simulated_vehicles import MemoryLine, memory_line

from planner.autopilot import Autopilot
from planner.errors import OutputError
from planner.link.logs import DownloadedLog, download_logs, fetch_log_list
from planner.link.vehicle import VehicleLink

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable
    from pathlib import Path

CONTENT = b"a log of a simulated vehicle: give --log to have a real one here\n" * 100
HOLDER = """
import sys
from pathlib import Path
from planner.link.logs import _alone
with _alone(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def _download(line: MemoryLine, folder: Path) -> tuple[DownloadedLog, ...]:
    link = VehicleLink(line, name="simulated")
    return download_logs(link, fetch_log_list(link), folder)


class _InterleavedLine(MemoryLine):
    """Does something else once, in the middle of a log."""

    between: Callable[[], object] | None = None
    pieces = 0

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        found = super().receive(timeout_s)
        self.pieces += sum(data[7] == 120 for _, data in found)  # LOG_DATA
        if self.between is not None and self.pieces > 20:
            act, self.between = self.between, None
            act()
        return found


def test_a_second_call_leaves_the_log_to_the_first(tmp_path: Path) -> None:
    first = _InterleavedLine(memory_line(Autopilot.PX4, "no-files")._wire)

    def second() -> None:
        with pytest.raises(OutputError, match="another call downloads this log"):
            _download(memory_line(Autopilot.PX4, "no-files"), tmp_path)

    first.between = second
    (log,) = _download(first, tmp_path)
    assert first.pieces > 20  # it came in between
    assert log.path.read_bytes() == CONTENT
    assert [path.name for path in tmp_path.iterdir()] == [log.path.name]


def test_after_the_first_call_the_second_finds_the_log(tmp_path: Path) -> None:
    for is_new in (True, False):
        (log,) = _download(memory_line(Autopilot.ARDUPILOT), tmp_path)
        assert (log.is_new, log.path.read_bytes()) == (is_new, CONTENT)
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
def test_another_process_is_waited_for_until_it_ends_by_whatever(tmp_path: Path) -> None:
    (name,) = (
        one.name for one in fetch_log_list(VehicleLink(memory_line(Autopilot.PX4), name="s"))
    )
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path / name)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(OutputError, match="another call downloads this log"):
            _download(memory_line(Autopilot.PX4), tmp_path)
        holder.send_signal(signal.SIGKILL)
        holder.wait(10.0)
        (log,) = _download(memory_line(Autopilot.PX4), tmp_path)
        assert log.path.read_bytes() == CONTENT
    finally:
        holder.kill()
        holder.communicate()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(OutputError, match="cannot be written"):
        _download(memory_line(Autopilot.PX4), tmp_path / "file")
