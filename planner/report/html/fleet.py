"""A fleet as a page: verdict, findings, what was checked, and everything over time with a slider."""

from __future__ import annotations

from collections import defaultdict
from itertools import groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner import catalogue, quantity
from planner.report.figures import KEY_FIGURES, ShownFigure, shown_figure
from planner.report.fleet import (
    HOLDS,
    PLAN_NOTE,
    cut_short_text,
    fleet_document,
    fleet_headline,
    flown_with_texts,
    plan_headline,
    suppressed_findings,
    unused_text,
)
from planner.report.html.mission import FindingView, add_time_layers, finding_view, zoomable
from planner.report.html.page import page_json, page_text, refuse_without_libraries, template
from planner.report.plots.fleet import (
    FleetTables,
    fleet_panels,
    make_fleet_tables,
    numbers_figures,
    vehicle_colour,
)
from planner.report.plots.picture_files import still_svg
from planner.report.rule_text import explanation
from planner.report.tables import named_rows
from planner.report.text import by_weight, caveat_of, checked_text, closing_line, printable
from planner.rules.ledger import Outcome
from planner.service.fleet_contingency import takeover_text
from planner.service.fleet_timeline import TRACK_ERROR_ENERGY, TRACK_ERROR_M, fleet_timeline

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from datetime import datetime

    from planner.findings import Finding
    from planner.report.json import Document
    from planner.report.plots.picture_files import Chart
    from planner.report.tables import Row
    from planner.rules.ledger import LedgerEntry
    from planner.service.fleet import FleetResult, FlownSortie
    from planner.service.fleet_plan import FleetPlan
    from planner.service.fleet_timeline import FleetTimeline

_TITLES = {
    "timeline": "Who has what, and when",
    "map": "Map",
    "power": "Power of the group",
    "energy": "Energy of the group",
    "separation": "Distance of the closest pairs",
    "numbers-energy": "Energy against vehicles",
    "numbers-makespan": "Makespan against vehicles",
}
_STILL_SORTIES = 8
"""A page of more of them has no pictures for readers without JavaScript: it would be half as large again."""
_STILLS = ("timeline", "map")
_CARDS = (
    ("vehicles", "Vehicles", "{:.0f}".format),
    ("sorties", "Sorties", "{:.0f}".format),
    ("packs", "Packs", "{:.0f}".format),
    ("makespan_s", "Makespan", quantity.duration),
    ("energy_wh", "Energy", quantity.energy),
    ("largest_sortie_wh", "Largest sortie", quantity.energy),
)
_NUMBERS = (
    *(_CARDS[at] for at in (0, 1, 4, 3, 2, 5)),
    ("least_energy_wh", "Least energy", quantity.energy),
)
_DIGITS = 3
"""After the point, of the numbers of a table at most."""
_SORTIE_FIGURES = (
    ("start_s", quantity.clock),
    ("end_s", quantity.clock),
    ("charge", quantity.percent),
    ("charge_left", quantity.charge_left),
)


def fleet_html(
    result: FleetResult, *, version: str, made_at: datetime, plan: FleetPlan | None = None
) -> str:
    """Return the check of a fleet as a page; of a plan also what more or fewer vehicles take.

    Raises
    ------
    UsageError
        If a library of ``mavjoule[report]`` is missing.
    """
    refuse_without_libraries()
    timeline = fleet_timeline(result)
    document = fleet_document(result, version=version)
    tables = make_fleet_tables(result, timeline) if timeline.tracks else None
    charts, stills, payload = (
        ({}, {}, {}) if tables is None else moving_charts(tables, fleet_panels(tables))
    )
    numbers = {} if plan is None else numbers_figures(plan)
    specs = {name: figure.to_dict(validate=False) for name, figure in numbers.items()}
    views = [
        (finding_view(one.finding, number, has_place=False), one)
        for number, one in enumerate(result.findings)
    ]
    sorties = [_sortie_view(one, document, number) for number, one in enumerate(result.sorties)]
    ledger = [*_ledger([("the fleet", result.checked)]), *_ledger(_sortie_ledgers(result))]
    section = template("fleet.html.j2").module.fleet(
        {
            "verdict": result.verdict_text,
            "file": printable(result.file),
            "headline": fleet_headline(result),
            "remark": caveat_of(suppressed_findings(result)).strip(),
            "given": flown_with_texts(result),
            "cards": _figures(document["totals"], "totals", _CARDS),
            "closing": closing_line(result.all_findings, suppressed=suppressed_findings(result)),
            "problems": [one for one in views if one[1].finding in by_weight(_findings(result))[0]],
            "notes": [one for one in views if one[1].finding in by_weight(_findings(result))[1]],
            "suppressed": [
                (finding_view(one.finding, -1, has_place=False), printable(one.finding.suppression))
                for one in result.suppressed
            ],
            "clock": quantity.clock,
            "checked": checked_text(result.checked),
            "ledger": ledger,
            "not_checked": _not_checked(ledger),
            "charts": {name: _TITLES[name] for name in charts},
            "stills": stills,
            "end_s": max(int(timeline.end_s), 1),
            "vehicles": [*dict.fromkeys(one.vehicle for one in timeline.tracks)],
            "has_marks": bool(timeline.marks),
            "error_m": f"{TRACK_ERROR_M:g}",
            "error_energy": f", and {quantity.percent(TRACK_ERROR_ENERGY)} of the energy of a sortie,",
            "over_time": "The fleet over time",
            "separation": _separation_text(result),
            "heads": [one.label for one in KEY_FIGURES],
            "sorties": sorties,
            "alike": _alike(sorties),
            "states": [
                (state, energy_wh, quantity.energy(energy_wh))
                for state, energy_wh in result.totals.energy_by_state_wh.items()
            ],
            "by_vehicle": [
                (number, one, quantity.duration(one.time_s), quantity.energy(one.energy_wh))
                for number, one in enumerate(result.totals.by_vehicle)
            ],
            "contingencies": [
                (one.what, HOLDS[one.holds], one.why, takeover_text(one.takeovers))
                for one in result.contingencies or ()
            ],
            "plan": None if plan is None else _plan_view(plan, specs),
            "rules": rule_views(result.all_findings),
            "payload": page_json(payload | {"start": _start(result)}),
        }
    )
    return page_text(
        title=f"{result.verdict_text} {printable(Path(result.file).name)}",
        version=version,
        made_at=made_at,
        has_charts=bool(charts or specs),
        sections=[section],
    )


def moving_charts(
    tables: FleetTables, panels: Mapping[str, Chart]
) -> tuple[dict[str, Any], dict[str, str], dict[str, Any]]:
    """Return the charts, their stills for readers without JavaScript, and what the script reads."""
    specs = {name: panel.to_dict(validate=False) for name, panel in panels.items()}
    stills = {}
    if len(tables.timeline.tracks) <= _STILL_SORTIES:
        rows = dict(tables.tables)
        stills = {
            name: still_svg(specs[name] | {"datasets": named_rows(specs[name], rows)})
            for name in _STILLS
            if name in specs
        }
    for name, spec in specs.items():
        if name == "map":
            spec["layer"] += _vehicle_layers(spec, tables)
        else:
            add_time_layers(spec)
        spec["datasets"] = spec.get("datasets", {})
    return specs, stills, {"charts": specs, **_payload(tables.timeline, tables)}


def _vehicle_layers(spec: dict[str, Any], tables: FleetTables) -> list[dict[str, Any]]:
    """Return what the page moves on the map of a fleet, and let it be zoomed."""
    place = zoomable(spec)
    colour = vehicle_colour(tables).to_dict()
    point = {"type": "point", "filled": True, "size": 190, "opacity": 1.0, "strokeWidth": 2}
    text = {"type": "text", "align": "left", "dx": 11, "fontWeight": "bold"}
    return [
        {
            "name": name,
            "data": {"name": "vehicles"},
            "mark": {**mark, "clip": True},
            "encoding": {**place, **encoding},
        }
        for name, mark, encoding in (
            ("vehicle", {**point, "stroke": "currentColor"}, {"color": colour}),
            ("vehicle_name", text, {"text": {"field": "name", "type": "nominal"}}),
        )
    ]


def _payload(timeline: FleetTimeline, tables: FleetTables) -> dict[str, Any]:
    return {
        "tables": packed_tables(tables.tables),
        "end_s": timeline.end_s,
        "marks": [
            {"at_s": round(mark.at_s, 1), "text": f"{mark.finding.code} {', '.join(mark.sorties)}"}
            for mark in timeline.marks
        ],
    }


def packed_tables(tables: Mapping[str, Sequence[Row]]) -> dict[str, object]:
    """Return rows as columns that take little room: texts once for as long as they stay the same.

    Numbers are whole ones of their last digit, each but the first as the difference to the one before.
    """
    return {
        name: {column: _packed([row[column] for row in rows]) for column in rows[0]}
        for name, rows in tables.items()
        if rows
    }


def _packed(column: Sequence[Any]) -> list[Any]:
    """Return the digits after the point and the differences of numbers, or texts with their counts."""
    if any(not isinstance(one, float | int) for one in column):
        return [[one, len([*same])] for one, same in groupby(column)]
    whole = [round(one * 10**_DIGITS) for one in column]
    digits = next(
        kept
        for kept in range(_DIGITS + 1)
        if all(one % 10 ** (_DIGITS - kept) == 0 for one in whole)
    )
    short = [one // 10 ** (_DIGITS - digits) for one in whole]
    return [digits, *(after - before for before, after in pairwise([0, *short]))]


def _start(result: FleetResult) -> str | None:
    """Return the time of day at which the operation begins, as the file gives it."""
    start = result.fleet.operation.start
    return None if start is None else start.isoformat()


def _findings(result: FleetResult) -> list[Finding]:
    return [one.finding for one in result.findings]


def _separation_text(result: FleetResult) -> str:
    """Return what the fleet keeps apart by, and what its picture shows of it."""
    separation = result.fleet.separation
    if separation is None:
        return ""
    above_m = separation.horizontal_m if separation.above_m is None else separation.above_m
    below_m = above_m if separation.below_m is None else separation.below_m
    text = f"{quantity.height(separation.horizontal_m)} beside each other, or "
    text += quantity.height(max(above_m, below_m))
    return (
        f"Required: {text} above each other and the errors of both heights. Distances are those beside each "
        "other less the errors of position, heights counting in proportion; solid: the least there may be by "
        "the start errors and the spread of times, dashed: as planned. Returns are judged apart from this."
    )


def _figures(
    document: object, path: str, shown: Iterable[tuple[str, str, Any]]
) -> list[ShownFigure]:
    """Return the numbers of a part of the document that are known."""
    assert isinstance(document, dict)
    return [
        ShownFigure(label, text(document[key]), f"{path}.{key}", document[key])
        for key, label, text in shown
        if document[key] is not None
    ]


def _sortie_view(one: FlownSortie, document: Document, number: int) -> dict[str, Any]:
    """Return a sortie as a row of the table, and as a part of the page."""
    sorties = document["sorties"]
    assert isinstance(sorties, list)  # by the contract of the JSON report
    own: Document = sorties[number]
    mission = own["mission"]
    assert isinstance(mission, dict)
    numbers = [shown_figure(mission, figure) for figure in KEY_FIGURES]
    problems, notes = by_weight(one.result.findings)
    return {
        "number": number,
        "name": one.name,
        "verdict": one.result.verdict_text,
        "vehicle": one.sortie.vehicle,
        "pack": one.sortie.pack or quantity.ABSENT,
        "pad": one.sortie.pad,
        "job": one.sortie.job,
        "file": printable(one.result.file),
        "times": [
            (f"sorties.{number}.{key}", own[key], text(own[key]))  # type: ignore[arg-type]
            for key, text in _SORTIE_FIGURES
        ],
        "numbers": [
            None if shown is None else shown._replace(path=f"sorties.{number}.mission.{shown.path}")
            for shown in numbers
        ],
        "closing": closing_line(one.result.findings, suppressed=one.result.suppressed),
        "problems": _views(problems),
        "notes": _views(notes),
    }


def _alike(
    sorties: Sequence[dict[str, Any]],
) -> list[tuple[list[dict[str, Any]], list[FindingView]]]:
    """Return the sorties that have problems, those together whose rules are the same."""
    groups: defaultdict[tuple[str, ...], list[dict[str, Any]]] = defaultdict(list)
    for one in sorties:
        if one["problems"]:
            groups[tuple(view.finding.code for view in one["problems"])].append(one)
    return [(of, of[0]["problems"]) for of in groups.values()]


def _views(findings: Sequence[Finding]) -> list[FindingView]:
    return [finding_view(one, number, has_place=False) for number, one in enumerate(findings)]


def _sortie_ledgers(result: FleetResult) -> list[tuple[str, Sequence[LedgerEntry]]]:
    return [(one.name, one.result.checked) for one in result.sorties]


def _ledger(ledgers: Sequence[tuple[str, Sequence[LedgerEntry]]]) -> list[tuple[LedgerEntry, str]]:
    """Return what became of each rule, and of which sorties; what was not checked first."""
    names: defaultdict[LedgerEntry, list[str]] = defaultdict(list)
    for name, entries in ledgers:
        for entry in entries:
            names[entry].append(name)
    rows = [
        (entry, ", ".join(of) if len(ledgers) == 1 or len(of) < len(ledgers) else "all sorties")
        for entry, of in names.items()
    ]
    order = (Outcome.NOT_CHECKED, Outcome.CHECKED, Outcome.NOT_APPLICABLE)
    return sorted(rows, key=lambda row: (order.index(row[0].outcome), row[0].code))


def _not_checked(ledger: Sequence[tuple[LedgerEntry, str]]) -> list[tuple[str, str, str]]:
    """Return what was missing, of which sorties, and the rules that need it."""
    rules: defaultdict[tuple[str, str], list[str]] = defaultdict(list)
    for entry, of in ledger:
        if entry.outcome is Outcome.NOT_CHECKED:
            rules[entry.needs, of].append(f"{entry.code} {entry.name}")
    return [(needs, of, ", ".join(names)) for (needs, of), names in rules.items()]


def rule_views(findings: Sequence[Finding]) -> list[tuple[str, str, tuple[tuple[str, str], ...]]]:
    """Return what each rule that found something says."""
    names = {one.code: one.name for one in findings}
    return [
        (code, names[code], (("What", rule.summary), *explanation(rule)))
        for code in sorted(names)
        if code in catalogue.entries()
        for rule in [catalogue.rule(code)]
    ]


def _plan_view(plan: FleetPlan, specs: dict[str, Any]) -> dict[str, Any]:
    """Return what so many vehicles take, as a table and as pictures."""
    return {
        "headline": plan_headline(plan),
        "cut_short": cut_short_text(plan),
        "unused": unused_text(plan),
        "note": PLAN_NOTE,
        "rows": [
            {
                "marks": ", ".join(plan.marks(row)),
                "numbers": [
                    (
                        ShownFigure(label, text(value), f"rows.{number}.{key}", value)
                        if (value := getattr(row, key)) is not None
                        else None
                    )
                    for key, label, text in _NUMBERS
                ],
            }
            for number, row in enumerate(plan.rows)
        ],
        "heads": [label for _, label, _ in _NUMBERS],
        "charts": {name: _TITLES[name] for name in specs},
        "stills": {name: still_svg(spec) for name, spec in specs.items()},
        "payload": page_json(specs),
    }
