"""The ``mavjoule`` command: its sub-commands, and what every way to fail ends in."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click

from planner import __version__
from planner.cli.output import TRACEBACK_VARIABLE, narrate, show_traceback, write_data
from planner.errors import (
    CheckFailedError,
    ExitCode,
    MavjouleError,
    OutputError,
    UsageError,
    bug_text,
    missing_library,
    nearest_hint,
)
from planner.workers import search_seldom

if TYPE_CHECKING:
    from collections.abc import Sequence

COMMANDS = {
    "check": "check",
    "segments": "check:segments",
    "review": "review",
    "speed": "speed",
    "split": "split",
    "fleet": "fleet",
    "sweep": "sweep",
    "compare": "compare",
    "convert": "convert",
    "experiment": "experiment",
    "identify": "identify",
    "verify": "verify",
    "verify-signoff": "sign_off",
    "simulate": "simulate",
    "fetch": "downloads:fetch",
    "guard": "guard",
    "diff": "downloads:diff",
    "upload": "upload",
    "logs": "downloads:logs",
    "vehicle": "vehicle",
    "models": "listings:models",
    "rules": "listings:rules",
    "explain": "listings:explain",
    "help": "listings:help_command",
}
"""Sub-commands in the order of the help, each with its module here, and its name there where that
is not ``command``."""


class LazyGroup(click.Group):
    """A group whose commands are imported when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - given by click
        """Return the names of the commands, the main one first."""
        return list(COMMANDS)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is asked for and its words; refuse one that does not exist."""
        name = args[0]
        if name not in COMMANDS and not name.startswith("-") and not ctx.resilient_parsing:
            msg = f"no command {name!r}{nearest_hint(name, COMMANDS)}"
            raise click.UsageError(msg, ctx)
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - given by click
        """Return a command by its name."""
        if cmd_name not in COMMANDS:
            return None
        module, _, name = COMMANDS[cmd_name].partition(":")
        command: click.Command = getattr(import_module(f"planner.cli.{module}"), name or "command")
        return command


@click.command(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit codes: 0 go, 1 no-go or not checked, 2 unusable input, usage or configuration, 3 link "
    "failed, 130 interrupted.",
)
@click.version_option(__version__, prog_name="mavjoule", message="%(prog)s %(version)s")
def cli() -> None:
    """Plan the energy of a drone mission and check it before anyone arms."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; nothing ends in a traceback.

    ``arguments`` come without the program's name, and are the process's own where absent.
    """
    # Matrices here are small: threads only wait for each other.  Numpy looks once, at its import.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _search_seldom()
    _tolerate_any_character()
    _stop_as_by_ctrl_c()
    if os.environ.get("_MAVJOULE_COMPLETE", "").startswith("fish"):
        _offer_lists_in_fish()
    try:
        done = cli.main(
            args=None if arguments is None else list(arguments),
            prog_name="mavjoule",
            standalone_mode=False,
        )
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return ExitCode.UNUSABLE
    except click.ClickException as error:
        narrate(f"{error.format_message()}{_where_help_is(error)}")
        return ExitCode.UNUSABLE
    except (click.Abort, KeyboardInterrupt):
        return ExitCode.INTERRUPTED
    except Exception as error:  # noqa: BLE001 - a pilot reads a sentence, not in a traceback
        return _reported(error)
    return ExitCode(done or ExitCode.GO)


def _offer_lists_in_fish() -> None:
    """Have fish cut an offer at its first comma only: of ``F,E101`` click's script leaves ``F``."""
    from click.shell_completion import FishComplete, add_completion_class

    class ListComplete(FishComplete):
        source_template = FishComplete.source_template.replace("split", "split --max 1")

    add_completion_class(ListComplete, "fish")


def _reported(error: Exception) -> ExitCode:
    """Report what a command ended in, and return its exit code."""
    known = error if isinstance(error, MavjouleError) else _of_surroundings(error)
    if known is None or isinstance(known, CheckFailedError):
        _show_bug(error)
    if known is not None:
        narrate(str(known))
        return known.exit_code
    narrate(f"{bug_text(error)}; set {TRACEBACK_VARIABLE}=1 to see where, and please report it")
    return CheckFailedError.exit_code


def _of_surroundings(error: Exception) -> MavjouleError | None:
    """Return what an error says of where the command runs; ``None``: nothing."""
    if isinstance(error, OSError):
        try:
            Path.cwd()
            write_data("")  # click has written the help by itself
        except FileNotFoundError:
            return UsageError("the folder this was called from is gone: call it from another")
        except OutputError as unwritten:
            return unwritten
    return missing_library(error)


def _search_seldom() -> None:
    search_seldom()
    atexit.register(gc.freeze)


def _stop_as_by_ctrl_c() -> None:
    """Make what ends a program from outside leave nothing half done, as an interruption does."""
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        number = getattr(signal, name, None)
        # Whoever set it otherwise wants it so: nohup lets a program outlive its terminal.
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            with suppress(ValueError):  # only the main thread may
                signal.signal(number, signal.default_int_handler)


def _where_help_is(error: click.ClickException) -> str:
    context = getattr(error, "ctx", None)
    return "" if context is None else f" (see {context.command_path} --help)"


def _show_bug(error: Exception) -> None:
    from traceback import format_exception

    show_traceback("".join(format_exception(error)))


def _tolerate_any_character() -> None:
    # A console that lacks a sign such as ° shows a substitute, instead of breaking the report.
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")
