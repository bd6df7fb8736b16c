"""The ``mavjoule`` command as it is started: Ctrl-C while it is being imported is no traceback either."""

from __future__ import annotations

import sys

_INTERRUPTED = 130
"""`planner.errors.ExitCode.INTERRUPTED`, which may not be imported yet."""


def main() -> int:
    """Run the command line with the words of the process, and return its exit code."""
    try:
        from planner.cli.main import main as run

        return run()
    except KeyboardInterrupt:
        return _INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
