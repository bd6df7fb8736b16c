"""The option ``--format``, alone: what needs no more than it starts at once."""

from __future__ import annotations

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
