"""The terminal of a review: what it can show, and that a review ends with it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from planner.cli.terminal import shows_braille

_DEAF = """
import signal, time
from planner.cli.terminal import end_with_terminal
signal.signal(signal.SIGHUP, signal.SIG_IGN)
signal.signal(signal.SIGTERM, signal.SIG_IGN)
end_with_terminal(grace_s=0.01)
print("watches", flush=True)
time.sleep(60.0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends its programs itself")
def test_a_program_whose_terminal_closes_ends_even_where_signals_do_not_end_it() -> None:
    import pty

    terminal, inside = pty.openpty()
    busy = subprocess.Popen(
        [sys.executable, "-c", _DEAF], stdin=inside, stdout=subprocess.PIPE, text=True
    )
    assert busy.stdout is not None
    os.close(inside)
    with busy.stdout:
        assert busy.stdout.readline() == "watches\n"
        assert busy.poll() is None  # a terminal that is open ends nothing
        os.close(terminal)
        assert busy.wait(30.0) == 130


@pytest.mark.parametrize(
    ("environment", "is_shown"),
    [
        ({"TERM": "xterm-256color", "LANG": "en_GB.UTF-8"}, True),
        ({"TERM": "tmux-256color", "LC_ALL": "C.utf8"}, True),
        ({"TERM": "linux", "LANG": "en_GB.UTF-8"}, False),  # its font has no Braille
        ({"TERM": "vt220", "LANG": "en_GB.UTF-8"}, False),
        ({"TERM": "xterm", "LANG": "de_DE.ISO-8859-1"}, False),
        ({"TERM": "xterm", "LC_ALL": "C", "LANG": "en_GB.UTF-8"}, False),  # the first that is set
        ({"TERM": "xterm", "LC_ALL": "", "LC_CTYPE": "C.UTF-8", "LANG": "C"}, True),
        ({"TERM": "xterm"}, False),  # no locale is that of C
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such variables")
def test_braille_is_shown_where_terminal_and_locale_have_it(
    environment: dict[str, str],
    is_shown: bool,  # noqa: FBT001 - a parameter of the test
) -> None:
    assert shows_braille(environment) is is_shown
