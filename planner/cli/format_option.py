"""The options ``--format`` and ``--output``, alone: what needs no more than them starts at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable

    Command = Callable[..., Any]


def format_option(*formats: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--format``, the first of the formats being the default."""
    return click.option(
        "--format",
        "file_format",
        type=click.Choice(formats),
        default=formats[0],
        metavar="|".join(formats),
        help=f"format of the output [default: {formats[0]}]",
    )


def data_options(*formats: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--format`` and ``--output``, for a command that prints data."""

    def decorate(command: Command) -> Command:
        output = click.option(
            "--output",
            metavar="FILE",
            type=click.Path(path_type=Path),
            help="write to a file instead of standard output",
        )
        return format_option(*formats)(output(command))

    return decorate
