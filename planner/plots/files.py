"""Pictures into files: SVG and PNG, made without a browser."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.errors import UsageError
from planner.output_file import write_output_bytes, write_output_file
from planner.plots.theme import chart_config

if TYPE_CHECKING:
    from pathlib import Path

    from planner.plots.theme import Scheme

PIXELS_PER_POINT = 2.0
"""A PNG is made for a dense screen."""


def write_figure(figure: Any, path: Path, *, scheme: Scheme = "light") -> None:  # noqa: ANN401 - Altair is untyped here
    """Write a picture.

    Parameters
    ----------
    figure : altair.TopLevelMixin
        As the functions of `planner.plots` return it.
    path : Path
        Ends in ``.svg`` or ``.png``.
    scheme : str
        ``light`` or ``dark``; a dark one gets a dark background.

    Raises
    ------
    UsageError
        If the suffix is another.
    OutputError
        If the file cannot be written.
    """
    import vl_convert

    config = chart_config(scheme) | {"background": "#ffffff" if scheme == "light" else "#0d1117"}
    chart = figure.to_dict() | {"config": config}
    match path.suffix.lower():
        case ".svg":
            write_output_file(path, vl_convert.vegalite_to_svg(chart))
        case ".png":
            write_output_bytes(path, vl_convert.vegalite_to_png(chart, scale=PIXELS_PER_POINT))
        case _:
            msg = f"{path}: a picture's file ends in .svg or .png"
            raise UsageError(msg)
