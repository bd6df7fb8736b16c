"""Where the command line writes: data to standard output or a file, narration to standard error."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, TypeVar

from planner.errors import OutputError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from planner.report.text import Medium

TRACEBACK_VARIABLE = "MAVJOULE_TRACEBACK"
_SILENCE_S = 2.0
"""What takes less needs no report."""
One = TypeVar("One")

_CSV, _PARQUET = ".csv", ".parquet"
_PAGES = frozenset({".html", ".htm", ".xhtml", ""})
STANDARD_OUTPUT = Path("-")
"""What stands for standard output among files."""
_WIDEST = 100
"""Lines of text longer than this are hard to read, however wide the terminal."""


def standard_medium(output: Path | None = None) -> Medium:
    """Return what a text report is written on: standard output, or a plain file."""
    from planner.report.text import Medium

    if output is not None or sys.stdout is None or not sys.stdout.isatty():
        return Medium()
    import shutil

    return Medium(
        width=min(shutil.get_terminal_size().columns, _WIDEST),
        is_coloured=not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb",
    )


def refuse_columns(path: Path) -> None:
    """Raise ``UsageError`` where a file of this name cannot hold columns: its suffix, or no pyarrow."""
    suffix = path.suffix.lower()
    if path != STANDARD_OUTPUT and suffix not in {_CSV, _PARQUET}:
        msg = f"{path}: the suffix decides the format: give a name ending in {_CSV} or {_PARQUET}"
        raise UsageError(msg)
    if suffix == _PARQUET:
        from planner.report.columns import load_parquet

        load_parquet()


def write_columns(columns: Mapping[str, Iterable[object]], path: Path) -> None:
    """Write columns of equal length: as Parquet where the suffix says so, else as CSV."""
    from planner.report.columns import columns_csv, columns_parquet

    if path.suffix.lower() == _PARQUET:
        from planner.files import write_output_bytes

        write_output_bytes(path, columns_parquet(columns))
    else:
        write_data(columns_csv(columns), output=path)


def write_data(text: str, *, output: Path | None = None) -> None:
    """Write a report to a file, or to standard output, which ``-`` is too.

    A reader that has gone away, as ``head`` does, is no error: the verdict stands.

    Raises OutputError if the report cannot be written.
    """
    if output is not None and output != STANDARD_OUTPUT:
        from planner.files import write_output_file

        write_output_file(output, text)
        return
    _clear_status()
    if sys.stdout is None:  # closed by the caller, who then wants only the exit code
        return
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        _silence_standard_output()
    except OSError as error:
        _silence_standard_output()
        msg = f"standard output: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error


def refuse_output_file(
    output: Path | None, inputs: Sequence[str], *, made: Sequence[Path | None] = ()
) -> None:
    """Raise where a file could not be written at the end of a call, before its work is done.

    Raises UsageError if it would take the place of what this call reads, and OutputError if it cannot
    be written where it is; ``made`` are folders that the call makes before.
    """
    if output is None or output == STANDARD_OUTPUT:
        return
    refuse_input_file(output, inputs)
    if output.parent not in made:
        from planner.files import refuse_unwritable

        refuse_unwritable(output)


def refuse_input_file(output: Path, inputs: Iterable[str]) -> None:
    """Raise UsageError where a file that is written would take the place of what this call reads."""
    from planner.files import is_among

    if is_among(output, inputs):
        msg = f"{output} is read in this call: give another file to write to"
        raise UsageError(msg)


def refuse_model_file(
    output: Path, inputs: Sequence[str], *, command: str, is_forced: bool
) -> None:
    """Raise where a model could not be written, as `refuse_output_file` does.

    Raises UsageError, too, where a file is there that this command has not written: another model, which
    a run again does not bring back.
    """
    refuse_output_file(output, inputs)
    if is_forced or not output.is_file():
        return
    with suppress(OSError), output.open("rb") as file:
        first = file.readline(200)
        if not first or first.startswith(f"# Written by mavjoule {command} ".encode()):
            return
    msg = (
        f"{output} exists, and mavjoule {command} has not written it: give another file, or --force"
    )
    raise UsageError(msg)


def refuse_page(
    report: Path | None,
    inputs: Sequence[str],
    *,
    output: Path | None = None,
    made: Sequence[Path | None] = (),
) -> None:
    """Raise where a page beside the output could not be written, as `refuse_output_file` does."""
    if report is None:
        return
    from planner.report.html.page import refuse_without_libraries

    if output is not None and output.resolve() == report.resolve():
        msg = "--output and --report name the same file: give them one each"
        raise UsageError(msg)
    refuse_output_file(report, inputs, made=made)
    refuse_page_name(report)
    refuse_without_libraries()


def refuse_page_name(report: Path) -> None:
    """Raise ``UsageError`` where the name of a page promises another format than HTML."""
    if report.suffix.lower() not in _PAGES:
        msg = f"{report}: --report writes a page of HTML: give a name that ends in .html"
        raise UsageError(msg)


def progress(done: Iterable[One], *, of: int, label: str) -> Iterator[One]:
    """Yield what so many jobs come to, and show whoever waits at a terminal how many are done."""
    show_step = narrate_seldom()
    try:
        for number, one in enumerate(done, start=1):
            show_step(f"{label} {number} of {of}")
            yield one
    finally:
        _clear_status()


def narrate(text: str) -> None:
    """Report something on standard error, on one line, as long as someone listens."""
    from planner.report.text import printable

    _clear_status()
    with suppress(OSError):
        print(f"mavjoule: {printable(text)}", file=sys.stderr)  # noqa: T201 - the only print


def show_traceback(text: str) -> None:
    """Show where a bug is on standard error, where someone asks for it."""
    if text and os.environ.get(TRACEBACK_VARIABLE):
        with suppress(OSError):
            sys.stderr.write(text)


class StatusLine:
    """One line on standard error that changes, where that is a terminal; what else is written clears it."""

    is_shown: ClassVar[bool] = False

    def __init__(self) -> None:
        self.is_terminal = sys.stderr is not None and sys.stderr.isatty()

    def show(self, text: str) -> None:
        """Show a text in place of the one before, on a terminal."""
        if self.is_terminal:
            StatusLine.is_shown = bool(text)
            with suppress(OSError):
                sys.stderr.write(f"\r\x1b[K{text}")
                sys.stderr.flush()

    def narrate(self, text: str) -> None:
        """Report something on a line of its own, in place of the text."""
        self.show("")
        narrate(text)


def narrate_seldom() -> Callable[[str], None]:
    """Return what shows a step on a terminal, once someone has waited for two seconds."""
    from time import monotonic

    line, since_s = StatusLine(), monotonic()

    def show_step(text: str) -> None:
        if monotonic() - since_s >= _SILENCE_S:
            line.show(text)

    return show_step


def _clear_status() -> None:
    if StatusLine.is_shown:
        StatusLine().show("")


def _silence_standard_output() -> None:
    # The interpreter flushes standard output at exit and would complain once more.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
