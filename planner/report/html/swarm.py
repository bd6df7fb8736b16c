"""A simulated swarm as a page: who did what, all of it over time with a slider, or numbers of agents."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.report.figures import ShownFigure
from planner.report.html.fleet import moving_charts, rule_views
from planner.report.html.mission import finding_view
from planner.report.html.page import page_json, page_text, refuse_without_libraries, template
from planner.report.plots.picture_files import still_svg
from planner.report.plots.swarm import (
    make_swarm_tables,
    numbers_panels,
    swarm_panels,
    thinned_timeline,
)
from planner.report.swarm import (
    NUMBERS_CUT_SHORT,
    agent_end,
    marks_text,
    numbers_document,
    numbers_headline,
    numbers_note,
    others_text,
    outcome_text,
    reached_text,
    swarm_document,
    swarm_given_texts,
    swarm_headline,
)
from planner.report.text import by_weight, caveat_of, closing_line, printable
from planner.service.swarm_faults import fault_text
from planner.service.swarm_timeline import swarm_timeline

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from datetime import datetime

    from planner.findings import Finding
    from planner.service.swarm import SwarmResult
    from planner.service.swarm_agents import SwarmNumbers

    Shown = Callable[[float], str]

_TITLES = {
    "timeline": "Who flies, and who gives way",
    "map": "Map",
    "goal": "What is reached of the goal",
    "power": "Power of the group",
    "energy": "Energy of the group",
    "separation": "Distance of the closest pairs",
    "agents-energy": "Energy against agents",
    "agents-makespan": "Makespan against agents",
    "agents-goal": "Time to 90 % of the goal against agents",
}
_CARDS: tuple[tuple[str, str, Shown], ...] = (
    ("totals.makespan_s", "Makespan", quantity.duration),
    ("totals.energy_wh", "Energy", quantity.energy),
    ("goal.fraction", "Goal reached", reached_text),
    ("goal.time_to_90_s", "90 % of the goal after", quantity.duration),
    ("totals.stops", "Stops for others", "{:.0f}".format),
    ("totals.waited_s", "Waiting", quantity.duration),
)
_OF_AGENT: tuple[tuple[str, str, Shown], ...] = (
    ("time_s", "In the air", quantity.duration),
    ("distance_m", "Distance", quantity.distance),
    ("energy_wh", "Energy", quantity.energy),
    ("battery.margin_wh", "Above the reserve", quantity.energy),
    ("stops", "Stops", "{:.0f}".format),
    ("waited_s", "Waited", quantity.duration),
    ("closest.distance_m", "Closest", quantity.distance),
    ("closest.time_s", "At", quantity.clock),
)
_OF_NUMBER: tuple[tuple[str, str, Shown], ...] = (
    ("agents", "Agents", "{:.0f}".format),
    ("runs", "Runs", "{:.0f}".format),
    ("clear", "Clear", "{:.0f}".format),
    ("energy_wh_mean", "Energy", quantity.energy),
    ("energy_wh_p10", "p10", quantity.energy),
    ("energy_wh_p90", "p90", quantity.energy),
    ("makespan_s_mean", "Makespan", quantity.clock),
    ("makespan_s_p10", "p10", quantity.clock),
    ("makespan_s_p90", "p90", quantity.clock),
    ("time_to_50_s_mean", "50 % of the goal", quantity.clock),
    ("time_to_90_s_mean", "90 %", quantity.clock),
    ("time_to_100_s_mean", "100 %", quantity.clock),
    ("waited_s_mean", "Waited", quantity.clock),
)


def swarm_html(result: SwarmResult, *, version: str, made_at: datetime) -> str:
    """Return a simulation as a page.

    Raises
    ------
    UsageError
        If a library of ``mavjoule[report]`` is missing.
    """
    refuse_without_libraries()
    timeline, error_m = thinned_timeline(swarm_timeline(result))
    document = swarm_document(result, timeline, version=version)
    charts: dict[str, Any] = {}
    stills: dict[str, str] = {}
    payload: dict[str, Any] = {"start": None}
    if timeline.tracks:
        tables = make_swarm_tables(result, timeline)
        charts, stills, moving = moving_charts(tables, swarm_panels(tables, result))
        payload |= moving | {"goal": f"of the {result.goal.what}"}
    at_s = {id(mark.finding): mark.at_s for mark in timeline.marks}
    states = list(result.energy_by_state_wh)
    verdict = "CLEAR" if result.is_clear else "NOT CLEAR"
    cut = "; cut short" if result.is_cut_short else ""
    section = template("swarm.html.j2").module.swarm(
        _found(result.findings, at_s, result.suppressed)
        | {
            "is_clear": result.is_clear,
            "verdict": verdict,
            "file": printable(result.file),
            "headline": f"{swarm_headline(result)}{cut}",
            "given": swarm_given_texts(result),
            "cards": [one for one in _numbers(document, "", _CARDS) if one is not None],
            "faults": [
                (one.name, fault_text(one.fault), outcome_text(one))
                for one in (result.faults.outcomes if result.faults else ())
            ],
            "others": others_text(result.faults) if result.faults else "",
            "notes": _views(by_weight(result.findings)[1]),
            "charts": {name: _TITLES[name] for name in charts},
            "stills": stills,
            "end_s": max(int(timeline.end_s), 1),
            "vehicles": [one.vehicle for one in timeline.tracks],
            "sorties": (),
            "over_time": "The swarm over time",
            "has_marks": bool(timeline.marks),
            "error_m": f"{error_m:g}",
            "error_energy": "",
            "separation": _separation_text(result),
            "heads": ["Agent", *(label for _, label, _ in _OF_AGENT), "Vehicle"],
            "agents": [
                {
                    "name": one.name,
                    "numbers": _numbers(document, f"agents.{row}.", _OF_AGENT),
                    "vehicle": ", ".join(filter(None, (one.vehicle, agent_end(one)))),
                }
                for row, one in enumerate(result.agents)
            ],
            "states": states,
            "by_state": [
                (
                    name,
                    _numbers(document, path, [(state, state, quantity.energy) for state in states]),
                )
                for name, path in (
                    *(
                        (one.name, f"agents.{row}.energy_by_state_wh.")
                        for row, one in enumerate(result.agents)
                    ),
                    ("all", "totals.energy_by_state_wh."),
                )
            ],
            "payload": page_json(payload),
        }
    )
    return page_text(
        title=f"{verdict} {printable(Path(result.file).name)}",
        version=version,
        made_at=made_at,
        has_charts=bool(charts),
        sections=[section],
    )


def _separation_text(result: SwarmResult) -> str:
    required = quantity.distance(result.separation_m)
    text = f"Required: {required} beside each other, the errors of both places included."
    if result.record.height_m is None:
        return text
    return f"{text} Distances are through the air: one far enough above another may be nearer."


def numbers_html(numbers: SwarmNumbers, *, version: str, made_at: datetime) -> str:
    """Return what numbers of agents take as a page.

    Raises
    ------
    UsageError
        If a library of ``mavjoule[report]`` is missing.
    """
    refuse_without_libraries()
    document = numbers_document(numbers, version=version)
    specs = {name: panel.to_dict(validate=False) for name, panel in numbers_panels(numbers).items()}
    is_clear = bool(numbers.chosen)
    section = template("swarm.html.j2").module.numbers(
        _found(numbers.findings, {}, numbers.suppressed)
        | {
            "is_clear": is_clear,
            "verdict": "CLEAR" if is_clear else "NOT CLEAR",
            "file": printable(numbers.file),
            "headline": numbers_headline(numbers),
            "given": (),
            "note": numbers_note(numbers),
            "cut_short": NUMBERS_CUT_SHORT if numbers.is_cut_short else "",
            "heads": [label for _, label, _ in _OF_NUMBER],
            "rows": [
                {
                    "numbers": _numbers(document, f"rows.{number}.", _OF_NUMBER),
                    "marks": marks_text(numbers, row),
                }
                for number, row in enumerate(numbers.rows)
            ],
            "notes": _views(by_weight(numbers.findings)[1]),
            "charts": {name: _TITLES[name] for name in specs},
            "stills": {name: still_svg(spec) for name, spec in specs.items()},
            "payload": page_json(specs),
        }
    )
    return page_text(
        title=f"Numbers of agents: {printable(Path(numbers.file).name)}",
        version=version,
        made_at=made_at,
        has_charts=bool(specs),
        sections=[section],
    )


def _found(
    findings: Sequence[Finding], at_s: dict[int, float], suppressed: Sequence[Finding] = ()
) -> dict[str, Any]:
    """Return what a page shows of findings, and when each is."""
    problems, _ = by_weight(findings)
    return {
        "closing": closing_line(findings, suppressed=suppressed),
        "remark": caveat_of(suppressed).strip(),
        "problems": [
            (view, at_s.get(id(one))) for view, one in zip(_views(problems), problems, strict=True)
        ],
        "suppressed": [
            (finding_view(one, -1, has_place=False), printable(one.suppression))
            for one in suppressed
        ],
        "clock": quantity.clock,
        "rules": rule_views(findings),
    }


def _views(findings: Sequence[Finding]) -> list[Any]:
    return [finding_view(one, number, has_place=False) for number, one in enumerate(findings)]


def _numbers(
    document: object, path: str, shown: Sequence[tuple[str, str, Shown]]
) -> list[ShownFigure | None]:
    """Return numbers of the document, ``None`` for those it has not."""
    found: list[ShownFigure | None] = []
    for key, label, text in shown:
        value: Any = document
        for part in f"{path}{key}".split("."):
            value = value[int(part)] if isinstance(value, list) else (value or {}).get(part)
        known = None if value is None else ShownFigure(label, text(value), f"{path}{key}", value)
        found.append(known)
    return found
