"""The check of a fleet, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.fleet.schedule import Objective
from planner.report.json import (
    checks_document,
    envelope,
    finding_document,
    json_text,
    mission_document,
    plain,
    value,
    values,
)
from planner.report.text import (
    by_weight,
    caveat_of,
    closing_line,
    finding_lines,
    given_text,
    given_texts,
    ledger_lines,
    note_lines,
    printable,
    table_lines,
)
from planner.service.fleet_contingency import takeover_text
from planner.service.preflight import CheckResult
from planner.values import field_names, replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.report.json import Document
    from planner.report.text import Medium
    from planner.service.fleet import FleetFinding, FleetResult, FlownSortie
    from planner.service.fleet_contingency import Contingency
    from planner.service.fleet_plan import FleetPlan

_TOTALS = (
    "vehicles",
    "sorties",
    "packs",
    "energy_wh",
    "is_energy_whole",
    "largest_sortie_wh",
    "makespan_s",
    "flight_s",
    "energy_by_state_wh",
)


PLAN_NOTE = (
    "Each row is the fastest with so many; least energy is what they take in time where they need not hurry. "
    "Makespans are of flights as late as each may be. "
    "All keep apart in flight, and on every return where a row does not say otherwise."
)
_WAITED_S = 60.0
"""Between a charge that ends and a start that waited for it, beside the swap: a charge is checked a little
shorter than it is planned. [s]"""
_LESS = {
    Objective.MAKESPAN: "a shorter makespan",
    Objective.ENERGY: "less energy",
    Objective.BATTERIES: "fewer packs",
}
HOLDS = {True: "yes", False: "no", None: "not judged"}


def fleet_text(result: FleetResult, *, medium: Medium) -> str:
    """Return the report of a fleet: the verdict first, then its sorties, then what is wrong."""
    totals = result.totals
    energy = _energy(totals.energy_wh, is_whole=totals.is_energy_whole)
    counts = (
        quantity.count(totals.vehicles, "vehicle"),
        quantity.count(totals.sorties, "sortie", "sorties"),
        quantity.count(totals.packs, "pack"),
    )
    in_air = quantity.duration(totals.flight_s)
    largest = quantity.energy(totals.largest_sortie_wh)
    lines = [
        f"{result.verdict_text}  {printable(result.file)}{caveat_of(suppressed_findings(result))}",
        *(line for given in flown_with_texts(result) for line in medium.wrapped(given, indent=4)),
        "",
        f"  Fleet       {', '.join(counts)}",
        f"  Makespan    {quantity.duration(totals.makespan_s)}; {in_air} in the air",
        f"  Energy      {energy}; largest sortie {largest}",
    ]
    if totals.energy_by_state_wh:
        shares = ", ".join(
            f"{state} {quantity.energy(energy_wh)}"
            for state, energy_wh in totals.energy_by_state_wh.items()
        )
        lines += medium.wrapped(f"  By state    {shares}", indent=14)
    lines.append("")
    heads = ("", "sortie", "vehicle", "pack", "start", "lands", "energy", "charge", "left")
    lines += table_lines([heads, *map(_row, result.sorties)], alignment="<<<<>>>>>")
    if len(totals.by_vehicle) > 1:
        lines.append("")
        rows = [
            (
                one.vehicle,
                quantity.count(one.sorties, "sortie", "sorties"),
                quantity.duration(one.time_s),
                quantity.energy(one.energy_wh),
            )
            for one in totals.by_vehicle
        ]
        lines += table_lines([("vehicle", "", "in the air", "energy"), *rows], alignment="<>>>")
    if result.contingencies is not None:
        lines.append("")
        answers = [
            (one.what, HOLDS[one.holds], takeover_text(one.takeovers))
            for one in result.contingencies
        ]
        lines += table_lines([("what if", "holds", "instead"), *answers], alignment="<<<")
    lines += _finding_lines(result, medium=medium)
    lines += ["", closing_line(result.all_findings, suppressed=suppressed_findings(result))]
    lines += ["", *ledger_lines(result.checked, medium=medium)]
    return "\n".join(lines) + "\n"


def fleet_headline(result: FleetResult) -> str:
    """Return what a fleet takes, in a line."""
    totals = result.totals
    counts = (
        quantity.count(totals.sorties, "sortie", "sorties"),
        quantity.count(totals.vehicles, "vehicle"),
        quantity.duration(totals.makespan_s),
    )
    energy = quantity.energy(totals.energy_wh)
    partly = "" if totals.is_energy_whole or totals.energy_wh is None else ", not of every sortie"
    return f"{counts[0]} on {counts[1]} in {counts[2]}, {energy}{partly}"


def flown_with_texts(result: FleetResult) -> tuple[str, ...]:
    """Return what the verdict holds for: vehicle, battery and wind, of which sorties where they differ.

    How full a pack is at the start of a sortie is a column of their table.
    """
    return given_texts(
        (one.name, given_text(replace(one.result, setup=replace(one.result.setup, charge=1.0))))
        for one in result.sorties
        if isinstance(one.result, CheckResult)
    )


def suppressed_findings(result: FleetResult) -> list[Finding]:
    """Return what is not reported, as asked, of the fleet and of its sorties."""
    own = [one for sortie in result.sorties for one in sortie.result.suppressed]
    return [*(one.finding for one in result.suppressed), *own]


def _finding_lines(result: FleetResult, *, medium: Medium) -> Iterator[str]:
    """Yield what is found of the fleet, then of the sorties; those of which the same is found as one."""
    problems, notes = by_weight([one.finding for one in result.findings])
    if problems or notes:
        yield ""
    for finding in problems:
        yield from finding_lines(finding, file=result.file, medium=medium)
    for finding in notes:
        yield from note_lines(finding, medium=medium)
    alike: dict[tuple[str, tuple[Finding, ...]], list[str]] = {}
    for sortie in result.sorties:
        own, _ = by_weight(sortie.result.findings)
        if own:
            alike.setdefault((sortie.result.file, own), []).append(sortie.name)
    for (file, own), names in alike.items():
        yield ""
        yield from medium.wrapped(f"{', '.join(names)}:", indent=4)
        for finding in own:
            yield from finding_lines(finding, file=file, medium=medium)


def fleet_json(result: FleetResult, *, version: str) -> str:
    """Return the check of a fleet as a JSON document; each mission is as in that of a check."""
    return json_text(fleet_document(result, version=version), indent=2)


def fleet_document(result: FleetResult, *, version: str) -> Document:
    """Return the check of a fleet by the keys of its JSON document."""
    totals = result.totals
    return envelope(version) | {
        "file": value(result, "file"),
        "verdict": result.verdict if result.is_readable else None,
        "verdict_text": result.verdict_text,
        "totals": values(totals, _TOTALS)
        | {"by_vehicle": [values(one, field_names(one)) for one in totals.by_vehicle]},
        "sorties": [_sortie_document(one) for one in result.sorties],
        "contingencies": None
        if result.contingencies is None
        else [_contingency_document(one) for one in result.contingencies],
        "charges": [values(one, field_names(one)) for one in result.charges],
        "checks": checks_document(result.checked),
        "findings": [_finding_document(one) for one in result.findings],
        "suppressed": [
            _finding_document(one) | {"suppression": one.finding.suppression}
            for one in result.suppressed
        ],
    }


def plan_text(plan: FleetPlan, *, medium: Medium) -> str:
    """Return the report of a plan: what so many vehicles take, how good it is, then the check of it."""
    heads = (
        "vehicles",
        "sorties",
        "energy",
        "makespan",
        "packs",
        "largest sortie",
        "least energy",
        "",
    )
    rows = [
        (
            str(row.vehicles),
            str(row.sorties),
            quantity.energy(row.energy_wh),
            quantity.duration(row.makespan_s),
            str(row.packs),
            quantity.energy(row.largest_sortie_wh),
            quantity.energy(row.least_energy_wh),
            ", ".join(plan.marks(row)),
        )
        for row in plan.rows
    ]
    lines = [
        plan_headline(plan),
        "",
        *table_lines([heads, *rows], alignment=">>>>>>><"),
        *medium.wrapped(PLAN_NOTE, indent=0),
        *(
            line
            for text in filter(None, (unused_text(plan), cut_short_text(plan)))
            for line in medium.wrapped(text, indent=0)
        ),
        "",
    ]
    return "\n".join(lines) + "\n" + fleet_text(plan.result, medium=medium)


def plan_headline(plan: FleetPlan) -> str:
    """Return what a plan has least of, and how good that is proven to be."""
    proof = (
        "no plan of these sorties has less"
        if plan.schedule.is_best
        else f"at most {quantity.percent(plan.gap)} above the least of these sorties"
    )
    full = " where every pack is charged full before it flies" if plan.fleet.packs else ""
    late = ", each as late as it may be" if plan.minimize is Objective.MAKESPAN else ""
    return f"Least {plan.minimize}: {plan.amount_text}{late}; {proof}{full}"


def unused_text(plan: FleetPlan) -> str:
    """Return which vehicles do not fly, and why; empty where all do."""
    flown = sorted(plan.fleet.sorties.values(), key=lambda one: one.start_s)
    unused = [name for name in plan.fleet.vehicles if name not in {one.vehicle for one in flown}]
    if not unused:
        return ""
    names = ", ".join(map(printable, unused))
    if plan.minimize is Objective.VEHICLES:
        return f"Not needed: {names}."
    text = f"Not used: {names}. No plan found with more vehicles has {_LESS[plan.minimize]}"
    last = flown[-1]
    if plan.minimize is Objective.MAKESPAN and last.pack is not None:
        full_s = [one.end_s for one in plan.result.charges if one.pack == last.pack]
        if any(0.0 <= last.start_s - end_s <= plan.fleet.swap_s + _WAITED_S for end_s in full_s):
            text += (
                f": {printable(last.name)}, the last to start, waits for pack {printable(last.pack)} "
                "to be charged"
            )
    return f"{text}."


def cut_short_text(plan: FleetPlan) -> str:
    """Return why the search ended before its time; empty where it did not."""
    if not plan.cut_short:
        return ""
    text = f"The search was cut short ({plan.cut_short}): another time it may find another plan."
    last = max((row.vehicles for row in plan.rows), default=0)
    if last < len(plan.fleet.vehicles):
        text += f" The table ends with {quantity.count(last, 'vehicle')}: more were not looked at."
    return text


def plan_json(plan: FleetPlan, *, version: str) -> str:
    """Return a plan as a JSON document: the rows of the numbers of vehicles, and the check of it."""
    document = fleet_document(plan.result, version=version) | {
        "minimize": str(plan.minimize),
        "amount": plain(plan.schedule.amount(plan.minimize)),
        "bound": plain(plan.schedule.bound),
        "gap": plain(plan.gap),
        "is_best": plan.schedule.is_best,
        "cut_short": plan.cut_short,
        "rows": [
            values(row, field_names(row)) | {"marks": [*plan.marks(row)]} for row in plan.rows
        ],
    }
    return json_text(document, indent=2)


def _energy(energy_wh: float | None, *, is_whole: bool) -> str:
    text = quantity.energy(energy_wh)
    return text if is_whole else f"{text}, not of every sortie"


def _row(one: FlownSortie) -> tuple[str, ...]:
    return (
        one.result.verdict_text,
        one.name,
        one.sortie.vehicle,
        one.sortie.pack or quantity.ABSENT,
        quantity.clock(one.start_s),
        quantity.clock(one.end_s) if one.time_s else quantity.ABSENT,
        quantity.energy(one.energy_wh),
        quantity.percent(one.charge),
        quantity.charge_left(one.charge_left),
    )


def _sortie_document(one: FlownSortie) -> Document:
    sortie = one.sortie
    return {
        **values(sortie, ("name", "job", "vehicle", "pack", "pad")),
        "start_s": plain(one.start_s),
        "end_s": plain(one.end_s) if one.time_s else None,
        "charge": plain(one.charge),
        "charge_left": plain(one.charge_left),
        "mission": mission_document(one.result),
    }


def _contingency_document(one: Contingency) -> Document:
    return values(one, ("kind", "subject", "what", "holds", "why")) | {
        "sorties": list(one.sorties),
        "takeovers": [values(each, field_names(each)) for each in one.takeovers],
    }


def _finding_document(one: FleetFinding) -> Document:
    return finding_document(one.finding) | {"sorties": list(one.sorties), "at_s": plain(one.at_s)}
