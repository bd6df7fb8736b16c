from __future__ import annotations

import os
import queue
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO

import pytest
from simulated_vehicles import free_port

from planner.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
RUN = (sys.executable, "-c", "import sys; from planner.cli.main import main; sys.exit(main())")
DEADLINE_S = 30.0


def _pass_on(stream: IO[str], lines: queue.Queue[str]) -> None:
    for line in stream:
        lines.put(line)


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent another way there")
@pytest.mark.parametrize(
    ("stack", "name"), [("px4", "PX4 1.16.0"), ("arducopter", "ArduPilot 4.6.0")]
)
def test_it_speaks_until_it_is_interrupted(mission: str, stack: str, name: str) -> None:
    port = free_port(socket.SOCK_DGRAM)
    url = f"udpout:127.0.0.1:{port}"
    with subprocess.Popen(
        [*RUN, "simulate", mission, "--as", stack, "--url", url, "--battery", "77Wh"],
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    ) as process:
        assert process.stderr is not None
        lines: queue.Queue[str] = queue.Queue()
        reader = threading.Thread(target=_pass_on, args=(process.stderr, lines))
        reader.start()
        try:
            said = [lines.get(timeout=DEADLINE_S)]
            while "SIMULATED" not in said[-1]:
                said.append(lines.get(timeout=DEADLINE_S))
            fetched = main(["fetch", f"udpin:127.0.0.1:{port}", "-o", "fetched.plan"])
        finally:
            process.send_signal(signal.SIGINT)
            try:
                code = process.wait(DEADLINE_S)
            finally:
                process.kill()  # started in the background, SIGINT is ignored: nothing waits for ever
            reader.join(DEADLINE_S)
    assert fetched == 0
    assert code == 130
    text = "".join(said)
    assert f"simulating {name} (system 1) with 3 items" in text
    assert f"mavjoule fetch udpin:127.0.0.1:{port} -o fetched.plan" in text
    assert main(["check", "fetched.plan", "--battery", "77Wh"]) in {0, 1}


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--url", "nowhere"], "is not an address of a vehicle"),
        (["--faults", "rain=1"], "rain=1"),
        (["--as", "px4", "--target", "arducopter-4.6"], "is not firmware"),
        (["--log", "missing.bin"], "missing.bin"),
    ],
)
def test_what_makes_no_sense_is_refused(
    mission: str, arguments: list[str], what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", mission, *arguments]) == 2
    assert what in capsys.readouterr().err


def test_a_line_that_is_taken_ends_in_three(mission: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["simulate", mission, "--url", f"tcpin:127.0.0.1:{port}"]) == 3
