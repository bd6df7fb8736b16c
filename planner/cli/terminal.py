"""The terminal a review runs on: whether it can show one, in which characters, and how it ends."""

from __future__ import annotations

import os
import select
import shutil
import sys
import time
from threading import Thread
from typing import TYPE_CHECKING, Any

from planner.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Mapping

LEAST_COLUMNS, LEAST_ROWS = 60, 16
"""A smaller terminal cannot show one pane."""
_WITHOUT_BRAILLE = frozenset({"linux", "ansi", "cons25", "hft"})
_OLD_TERMINALS = ("vt1", "vt2", "vt3", "vt4", "vt5")
"""What consoles and serial terminals call themselves: their fonts hold no Braille."""
_STANDARD_INPUT = 0
_GRACE_S = 1.5
"""How long a command may take to end by itself once its terminal is closed. [s]"""


def why_unusable() -> str:
    """Return why no terminal UI can be shown here; empty where one can."""
    size = shutil.get_terminal_size()
    streams = (sys.stdin, sys.stdout, sys.stderr)  # Textual draws on the last
    if not all(stream is not None and stream.isatty() for stream in streams):
        return "the terminal UI needs a terminal"
    if os.environ.get("TERM") in {"dumb", "unknown"}:
        return f"the terminal UI cannot be shown on TERM={os.environ['TERM']}"
    if size.columns < LEAST_COLUMNS or size.lines < LEAST_ROWS:
        return (
            f"the terminal has {size.columns} × {size.lines} characters, the terminal UI needs "
            f"{LEAST_COLUMNS} × {LEAST_ROWS}"
        )
    return ""


def shows_braille(environment: Mapping[str, str]) -> bool:
    """Return whether locale and terminal of an environment show Braille and box characters.

    The locale is that of LC_ALL, else of LC_CTYPE, else of LANG, as tmux and other programs read it:
    Python itself takes the locale C for one of UTF-8.  Windows has none of them, and shows Unicode.
    """
    term = environment.get("TERM", "")
    if term in _WITHOUT_BRAILLE or term.startswith(_OLD_TERMINALS):
        return False
    names = ("LC_ALL", "LC_CTYPE", "LANG")
    locale = next((environment[name] for name in names if environment.get(name)), "")
    return sys.platform == "win32" or "utf8" in locale.lower().replace("-", "")


def end_with_terminal(*, grace_s: float = _GRACE_S) -> None:
    """End this process once the terminal on standard input is closed, whatever it is doing then.

    An interruption ends most of it in time.  One that comes while Textual starts or stops is lost or
    leaves its input thread behind, which reads the dead terminal without a pause; a signal cannot
    end that.
    """
    make_poll = getattr(select, "poll", None)  # Windows lacks it, and ends its programs itself
    if make_poll is not None and os.isatty(_STANDARD_INPUT):
        Thread(target=_end_when_closed, args=(make_poll(), grace_s), daemon=True).start()


def _end_when_closed(
    poll: Any,  # noqa: ANN401 - a select.poll, a name that Windows lacks
    grace_s: float,
) -> None:
    poll.register(_STANDARD_INPUT, 0)  # that it is closed is always reported
    [(_, event)] = poll.poll()
    if event & select.POLLHUP:
        time.sleep(grace_s)
        os._exit(ExitCode.INTERRUPTED)
