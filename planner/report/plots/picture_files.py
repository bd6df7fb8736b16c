"""Pictures into files: SVG and PNG, made without a browser."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from planner.errors import UsageError, libraries_of
from planner.files import make_output_folder, write_output_files
from planner.flight.motion.kinematics import FlightState

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from types import ModuleType


Chart = Any
"""A chart of Altair, or its data; the library is loaded where it is used."""


def load_altair() -> ModuleType:
    """Return Altair, which builds pictures; without it raise ``UsageError``."""
    return _load("altair")


def load_converter() -> ModuleType:
    """Return vl-convert, which writes pictures without a browser; without it raise ``UsageError``."""
    return _load("vl_convert")


def _load(name: str) -> ModuleType:
    with libraries_of("report"):
        return import_module(name)


def inline_rows(rows: Sequence[dict[str, Any]], **options: str) -> Chart:
    """Return rows as the data of a chart, unchecked: a look at every value costs more than drawing it.

    A tuple is not copied as charts are put together, as often as they are: a list is, row by row.
    """
    data = load_altair().InlineData(values=[], **options)
    data.values = tuple(rows)
    return data


Scheme = Literal["light", "dark", "page"]
"""``page``: the ink is that of the page around the picture, whatever it is."""

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, GREY = "#56B4E9", "#CC79A7", "#F0E442", "#8C8C8C"

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, RED, SKY)
"""What follows each other has different ones; more than these have them again."""
ON_COLOURS = "#000000"
"""Ink on them, whatever the page's is."""

STATE_COLOURS: dict[str, str] = {
    FlightState.TAKEOFF: ORANGE,
    FlightState.CLIMB: YELLOW,
    FlightState.ACCELERATE: GREEN,
    FlightState.CRUISE: SKY,
    FlightState.BRAKE: PURPLE,
    FlightState.HOVER: GREY,
    FlightState.DESCEND: BLUE,
    FlightState.LAND: RED,
}

BACKGROUND: dict[Scheme, str] = {"light": "#ffffff", "dark": "#0d1117", "page": "transparent"}
_INK: dict[Scheme, str] = {"light": "#1f2328", "dark": "#e6edf3", "page": "currentColor"}
_GRID_OPACITY = 0.15
_FRAME_OPACITY = 0.35
FONT = "system-ui, 'Segoe UI', Roboto, 'Noto Sans', Arial, sans-serif"

_LABEL_GAP_PX = 8
"""Between the labels of an axis: those nearer to each other are left out."""


def chart_config(scheme: Scheme) -> dict[str, Any]:
    """Return Vega-Lite's configuration of a scheme."""
    ink = _INK[scheme]
    text = {
        "labelColor": ink,
        "titleColor": ink,
        "labelFontSize": 11,
        "titleFontSize": 12,
        "titleFontWeight": "normal",
    }
    return {
        "background": BACKGROUND[scheme],
        "font": FONT,
        "view": {"stroke": ink, "strokeOpacity": _FRAME_OPACITY},
        "axis": {
            **text,
            "labelSeparation": _LABEL_GAP_PX,
            "domainColor": ink,
            "domainOpacity": _FRAME_OPACITY,
            "gridColor": ink,
            "gridOpacity": _GRID_OPACITY,
            "tickColor": ink,
            "tickOpacity": _FRAME_OPACITY,
        },
        "legend": {
            **text,
            "orient": "bottom",
            "columns": 4,
            "columnPadding": _LEGEND_GAP_PX,
            "symbolStrokeWidth": 2,
            "layout": {"bottom": {"margin": _LEGEND_GAP_PX}},
        },
        "title": {"color": ink, "fontSize": 14, "anchor": "start", "subtitleColor": ink},
        "text": {"color": ink, "fontSize": 11},
        "rule": {"color": ink},
        "point": {"color": ink},
    }


_LEGEND_GAP_PX = 28
"""Room for texts that are wider in the fonts of who looks at a picture than of who wrote it."""
FILE_FORMATS = ("svg", "png")
_PNG_SCALE = 2.0
"""A PNG is made for a dense screen."""


def write_figure(figure: Chart, path: Path | str, *, scheme: Scheme = "light") -> None:
    """Write a picture.

    Parameters
    ----------
    figure : altair.TopLevelMixin
        As the functions of `planner.report.plots` return it.
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
    write_output_files({Path(path): _picture(figure, Path(path), scheme)})


def _picture(figure: Chart, path: Path, scheme: Scheme) -> str | bytes:
    """Return the contents of a picture's file."""
    converter = load_converter()
    chart = figure.to_dict(validate=False) | {"config": chart_config(scheme)}
    match path.suffix.lower():
        case ".svg":
            svg: str = converter.vegalite_to_svg(chart)
            return svg
        case ".png":
            png: bytes = converter.vegalite_to_png(chart, scale=_PNG_SCALE)
            return png
    msg = f"{path}: a picture's file ends in .svg or .png"
    raise UsageError(msg)


def still_svg(spec: dict[str, Any]) -> str:
    """Return a picture as SVG to stand in a page, in the page's ink and without labels of its parts."""
    config = chart_config("page") | {"aria": False}
    svg: str = load_converter().vegalite_to_svg(spec | {"config": config})
    return svg


def write_figures(
    figures: Mapping[str, Chart], folder: Path | str, *, file_formats: Sequence[str] = FILE_FORMATS
) -> tuple[Path, ...]:
    """Write pictures into a folder, which is made where it is not there, and return their files.

    All of them are written or, where one fails, none.

    Parameters
    ----------
    figures : mapping of str to altair.TopLevelMixin
        By the stem of their files.
    folder : Path or str
    file_formats : sequence of str
        ``svg``, ``png``.

    Raises
    ------
    UsageError
        If a format is another, or a library is missing.
    OutputError
        If the folder or a file cannot be written.
    """
    folder = Path(folder)
    make_output_folder(folder, holding="figures")
    paths = [folder / f"{stem}.{ending}" for stem in figures for ending in file_formats]
    write_output_files({path: _picture(figures[path.stem], path, "light") for path in paths})
    return tuple(paths)


def styled(
    column: str,
    title: str,
    curves: Mapping[str, tuple[str, Sequence[int]]],
    **options: Any,  # noqa: ANN401 - of Altair's channels
) -> dict[str, Chart]:
    """Return how curves differ: each of a column's values has a colour and dashes."""
    alt, domain = load_altair(), list(curves)
    colours, dashes = ([style[index] for style in curves.values()] for index in (0, 1))
    return {
        "color": alt.Color(column, **options).title(title).scale(domain=domain, range=colours),
        "strokeDash": alt.StrokeDash(column, **options)
        .title(title)
        .scale(domain=domain, range=dashes),
    }
