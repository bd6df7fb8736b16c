"""What results answer to scripts and notebooks; `planner.presented` asks for it."""

from __future__ import annotations

import json
from functools import partial, singledispatch
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import __version__, quantity
from planner.errors import MissingLibraryError, UsageError
from planner.findings import Severity
from planner.identify.assembly import Identification
from planner.identify.verification import Verification
from planner.report.comparison import comparison_json, comparison_text
from planner.report.endurance import endurance_json, endurance_text
from planner.report.figures import KEY_FIGURES, shown_figure
from planner.report.fleet import fleet_json, fleet_text, plan_json, plan_text
from planner.report.identification import identification_text, verification_text
from planner.report.json import ITEM_KEYS, SEGMENT_KEYS, json_text, mission_document
from planner.report.speed_curve import speed_curve_json, speed_curve_text
from planner.report.split import split_json, split_text
from planner.report.swarm import numbers_json, numbers_text, swarm_json, swarm_text
from planner.report.sweep import sweep_text
from planner.report.tables import fence_outlines, place_rows
from planner.report.text import (
    Medium,
    by_weight,
    caveat,
    closing_line,
    finding_message,
    given_text,
    headline,
    label,
    not_checked_text,
    printable,
)
from planner.service.comparison import Comparison
from planner.service.endurance import Endurance
from planner.service.fleet import FleetResult
from planner.service.fleet_plan import FleetPlan
from planner.service.preflight import CheckResult, UnreadableMission
from planner.service.speed import SpeedCurve
from planner.service.split import Split
from planner.service.swarm import SwarmResult
from planner.service.swarm_agents import SwarmNumbers
from planner.service.sweep.sweep import Sweep

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from planner.arrays import FloatArray
    from planner.presented import Presented, Shown
    from planner.report.json import Document
    from planner.rules.assessment import Assessment

_LIBRARIES = ("pandas", "polars")
_COLUMNS = {"segments": SEGMENT_KEYS, "items": ITEM_KEYS}
_COLOURS = {"GO": "#1a7f37", "NO-GO": "#cf222e", "NOT CHECKED": "#9a6700"}
"""Of the verdicts; each is seen on a light and on a dark page."""
_MARKS = {Severity.ERROR: "✖", Severity.WARNING: "▲"}
_MOST_FINDINGS = 8
_MAP_PX = 260
_SAMPLES = 600
"""Times at which the path of the map is looked at."""


@singledispatch
def result_document(result: Presented) -> Document:
    """Return what the JSON report of a command holds of its result."""
    write: Callable[..., str] = _WRITERS[type(result)]
    document: Document = json.loads(write(result, version=__version__))
    return document


_WRITERS: dict[type, Callable[..., str]] = {
    Comparison: comparison_json,
    Endurance: endurance_json,
    FleetPlan: plan_json,
    FleetResult: fleet_json,
    SpeedCurve: speed_curve_json,
    Split: split_json,
    SwarmNumbers: numbers_json,
    SwarmResult: swarm_json,
}


@result_document.register(CheckResult)
@result_document.register(UnreadableMission)
def _(result: CheckResult | UnreadableMission) -> Document:
    return mission_document(result)


def result_json(result: Presented, *, indent: int | None) -> str:
    """Return `result_document` as text."""
    return json_text(result_document(result), indent=indent)


def result_frame(
    result: CheckResult | UnreadableMission, table: str, *, library: str | None
) -> Any:  # noqa: ANN401 - of a library that is not needed otherwise
    """Return the segments or the items of a check as a data frame.

    Raises MissingLibraryError if no library of data frames is installed, or not the one asked for.
    Raises UsageError if there is no such table or library.
    """
    _refuse_unknown("table", table, _COLUMNS)
    rows: Any = mission_document(result)[table]
    return data_frame(
        {key: [_cell(row[key]) for row in rows] for key in _COLUMNS[table]}, library=library
    )


def data_frame(
    columns: Mapping[str, list[Any]], *, library: str | None, numbers: Collection[str] = ()
) -> Any:  # noqa: ANN401 - as above
    """Return columns as a data frame; those of numbers are that where none is known too.

    Raises errors as `result_frame` does.
    """
    if library is not None:
        _refuse_unknown("library", library, _LIBRARIES)
    for name in _LIBRARIES if library is None else (library,):
        try:
            frames = import_module(name)
        except ModuleNotFoundError as error:
            if error.name != name:
                raise
            continue
        if name == "pandas":
            return frames.DataFrame(dict(columns)).astype(dict.fromkeys(numbers, "float64"))
        of_numbers = dict.fromkeys(numbers, frames.Float64)
        return frames.DataFrame(dict(columns), schema_overrides=of_numbers)
    needed = "pandas or polars" if library is None else library
    msg = f"a data frame needs {needed}: pip install {library or _LIBRARIES[0]}"
    raise MissingLibraryError(msg)


def _refuse_unknown(name: str, asked: str, known: Collection[str]) -> None:
    if asked not in known:
        msg = f"{name} must be one of {', '.join(known)}: got {asked!r:.60}"
        raise UsageError(msg)


def _cell(value: object) -> object:
    """Return a value as a data frame holds it: a name without the class that knows its like."""
    return str(value) if isinstance(value, str) else value


@singledispatch
def result_html(result: Shown) -> str:
    """Return a result as a notebook shows it, without scripts and outer files: what its command prints."""
    text = _TEXTS[type(result)](result)
    return f"<pre style='line-height:1.3'>{escape(text)}</pre>"


_TEXTS: dict[type, Callable[[Any], str]] = {
    Comparison: partial(comparison_text, options=("", ""), medium=Medium()),
    Endurance: partial(endurance_text, medium=Medium()),
    FleetPlan: partial(plan_text, medium=Medium()),
    FleetResult: partial(fleet_text, medium=Medium()),
    Identification: partial(identification_text, medium=Medium(), with_segments=False),
    SpeedCurve: speed_curve_text,
    Split: partial(split_text, medium=Medium()),
    SwarmNumbers: partial(numbers_text, medium=Medium()),
    SwarmResult: partial(swarm_text, medium=Medium()),
    Sweep: partial(sweep_text, medium=Medium()),
    Verification: lambda one: verification_text([one], medium=Medium()),
}


@result_html.register(CheckResult)
@result_html.register(UnreadableMission)
def _(result: CheckResult | UnreadableMission) -> str:
    """Return verdict, figures, findings and a small map of a check."""
    document = mission_document(result)
    colour = _COLOURS[result.verdict_text]
    figures = [one for path in KEY_FIGURES if (one := shown_figure(document, path)) is not None]
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(one.label)}</th>"
        f"<td style='text-align:right'>{escape(one.text)}</td></tr>"
        for one in figures
    )
    problems, _ = by_weight(result.findings)
    lines = [
        f"<li>{_MARKS[one.severity]} <b>{escape(label(one))}</b> {escape(finding_message(one))}</li>"
        for one in problems[:_MOST_FINDINGS]
    ]
    if len(problems) > _MOST_FINDINGS:
        lines.append(f"<li>and {len(problems) - _MOST_FINDINGS} more in .findings</li>")
    closing = closing_line(result.findings, suppressed=result.suppressed)
    if missing := not_checked_text(result.checked):
        closing += f" {missing[:1].upper()}{missing[1:]}."
    assessment = result.assessment if isinstance(result, CheckResult) else None
    given = given_text(result) if isinstance(result, CheckResult) else ""
    picture = "" if assessment is None else _map_svg(assessment)
    return (
        "<div style='max-width:60em'>"
        f"<div><b style='color:{colour}'>{result.verdict_text}</b> "
        f"<b>{escape(printable(result.file) + caveat([result]))}</b></div>"
        f"<div>{escape(given)}</div><div>{escape(headline(result))}</div>"
        "<div style='display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start'>"
        f"<table>{cells}</table>{picture}</div>"
        f"<ul style='list-style:none;padding-left:0'>{''.join(lines)}</ul>"
        f"<div>{escape(closing)}</div></div>"
    )


def _map_svg(assessment: Assessment) -> str:
    """Return the path, the fence, home and a scale as a picture, north up."""
    flight = assessment.flight
    state = flight.motion.state_at_time(np.linspace(0.0, flight.time_s, _SAMPLES))
    outlines = fence_outlines(assessment)
    homes = place_rows(assessment)
    lines = [(state.east_m, state.north_m), *((east_m, north_m) for _, east_m, north_m in outlines)]
    low_m, high_m = (
        [float(pick([pick(line[axis]) for line in lines])) for axis in (0, 1)]
        for pick in (min, max)
    )
    extent_m = max(high_m[0] - low_m[0], high_m[1] - low_m[1], 1.0)
    px_per_m = (_MAP_PX - 20.0) / extent_m

    def points(east_m: FloatArray, north_m: FloatArray) -> str:
        x = 10.0 + (east_m - low_m[0]) * px_per_m
        y = 10.0 + (high_m[1] - north_m) * px_per_m
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))

    height = 40.0 + (high_m[1] - low_m[1]) * px_per_m
    shapes = [
        f"<polygon points='{points(east_m, north_m)}' fill='none' "
        f"stroke='{'#1a7f37' if is_inclusion else '#cf222e'}' stroke-dasharray='4 3'/>"
        for is_inclusion, east_m, north_m in outlines
    ]
    path = points(np.asarray(state.east_m), np.asarray(state.north_m))
    shapes.append(f"<polyline points='{path}' fill='none' stroke='#0969da' stroke-width='1.5'/>")
    for row in homes:
        x, y = points(np.array([row["east_m"]]), np.array([row["north_m"]])).split(",")
        letter = escape(str(row["short"])[:1])
        shapes.append(f"<text x='{x}' y='{y}' font-size='12' fill='currentColor'>{letter}</text>")
    spans_m = (high - low for low, high in zip(low_m, high_m, strict=True))
    scale = f"north up, {' × '.join(map(quantity.distance, spans_m))}"
    shapes.append(
        f"<text x='10' y='{height - 8.0:.0f}' font-size='11' fill='currentColor'>{scale}</text>"
    )
    return (
        f"<svg role='img' aria-label='path over ground' width='{_MAP_PX}' height='{height:.0f}' "
        f"style='max-width:100%'>{''.join(shapes)}</svg>"
    )
