"""Pictures into files: SVG and PNG, made without a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.output_file import make_output_folder, write_output_bytes, write_output_file
from planner.plots.library import load_converter
from planner.plots.theme import chart_config

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.plots.library import Chart
    from planner.plots.theme import Scheme

FILE_FORMATS = ("svg", "png")
_PNG_SCALE = 2.0
"""A PNG is made for a dense screen."""


def write_figure(figure: Chart, path: Path | str, *, scheme: Scheme = "light") -> None:
    """Write a picture.

    Parameters
    ----------
    figure : altair.TopLevelMixin
        As the functions of `planner.plots` return it.
    path : Path or str
        Ends in ``.svg`` or ``.png``.
    scheme : str
        ``light`` or ``dark``; a dark one gets a dark background.

    Raises
    ------
    UsageError
        If the suffix is another, or a library is missing.
    OutputError
        If the file cannot be written.
    """
    path = Path(path)
    converter = load_converter()
    chart = figure.to_dict(validate=False) | {"config": chart_config(scheme)}
    match path.suffix.lower():
        case ".svg":
            write_output_file(path, converter.vegalite_to_svg(chart))
        case ".png":
            write_output_bytes(path, converter.vegalite_to_png(chart, scale=_PNG_SCALE))
        case _:
            msg = f"{path}: a picture's file ends in .svg or .png"
            raise UsageError(msg)


def still_svg(figure: Chart) -> str:
    """Return a picture as SVG to stand in a page, in the page's ink and without labels of its parts.

    Raises
    ------
    UsageError
        If a library is missing.
    """
    config = chart_config("page") | {"aria": False}
    svg: str = load_converter().vegalite_to_svg(figure.to_dict(validate=False) | {"config": config})
    return svg


def write_figures(
    figures: Mapping[str, Chart],
    folder: Path | str,
    *,
    file_formats: Sequence[str] = FILE_FORMATS,
    scheme: Scheme = "light",
) -> tuple[Path, ...]:
    """Write pictures into a folder, which is made where it is not there, and return their files.

    Parameters
    ----------
    figures : mapping of str to altair.TopLevelMixin
        By the stem of their files.
    folder : Path or str
        Where to.
    file_formats : sequence of str
        ``svg``, ``png``.
    scheme : str
        ``light`` or ``dark``.

    Raises
    ------
    UsageError
        If a format is another, or a library is missing.
    OutputError
        If the folder or a file cannot be written.
    """
    folder = Path(folder)
    make_output_folder(folder, holding="figures")
    paths = []
    for stem, figure in figures.items():
        for file_format in file_formats:
            path = folder / f"{stem}.{file_format}"
            write_figure(figure, path, scheme=scheme)
            paths.append(path)
    return tuple(paths)
