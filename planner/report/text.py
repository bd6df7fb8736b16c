"""The report of a check as a pilot reads it: the verdict first, then why, then the figures."""

from __future__ import annotations

import math
import re
import textwrap
from collections import Counter, defaultdict
from contextlib import suppress
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Finding, Severity
from planner.flight.motion.kinematics import STATES
from planner.rules.energy import destination_name, place_along, reserve_name
from planner.rules.ledger import Outcome
from planner.service.preflight import CheckResult
from planner.setup import UNNAMED, basis_text, conditions_text
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from planner.flight.budget import BatteryBudget, Totals
    from planner.flight.returns.tightest import ReturnPlan
    from planner.rules.ledger import LedgerEntry
    from planner.service.preflight import UnreadableMission
    from planner.setup import Setup


class Phase(Value, kw_only=False):
    """All segments of one state, or of the whole flight."""

    state: str
    """``total`` for the whole flight."""
    segments: int
    time_s: float
    distance_m: float
    energy_wh: float
    energy_fraction: float | None
    """Of the energy of the flight; ``None`` where it takes none. [-]"""


def flight_phases(result: CheckResult) -> tuple[Phase, ...]:
    """Return the phases a flight has, in the order of the states, and the whole flight at the end."""
    totals, whole = result.totals, (0, 0.0, 0.0, 0.0)
    sums = dict.fromkeys(map(str, STATES), whole)
    for one in result.segments:
        count, time_s, distance_m, energy_wh = sums[one.state]
        sums[one.state] = (
            count + 1,
            time_s + one.duration_s,
            distance_m + one.distance_m,
            energy_wh + one.energy_wh,
        )
    whole = (len(result.segments), totals.time_s, totals.distance_m, totals.energy_wh)
    rows = [
        *((state, of_state) for state, of_state in sums.items() if of_state[0]),
        ("total", whole),
    ]
    return tuple(
        Phase(state, *of_state, of_state[-1] / totals.energy_wh if totals.energy_wh else None)
        for state, of_state in rows
    )


def printable(text: str) -> str:
    """Return the text on one line, with everything that cannot be printed written as an escape."""
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


def well_formed(text: str) -> str:
    """Return the text with lone surrogates, which no encoding takes, shown as ``�``.

    They come from file names that are no UTF-8 and from careless JSON.
    """
    with suppress(UnicodeEncodeError):
        text.encode()  # a page has millions of characters: looking at each takes half a second
        return text
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if "\ud800" <= character <= "\udfff" else character
        for character in text
    )


_STYLES = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.INFO: "dim"}
_INDENT = 4


def finding_lines(finding: Finding, *, file: str, medium: Medium) -> list[str]:
    """Return ``site.plan:41:9: E101 reserve-below-minimum [error] item 7: …`` and its fix."""
    head = f"{printable(file)}:"
    if finding.place is not None:
        head += f"{finding.place.line}:{finding.place.column}:"
    text = f"{head} {label(finding)} [{finding.severity.label}] {finding_message(finding)}"
    first, *rest = medium.wrapped(text, indent=_INDENT)
    first = first.replace(
        f" {finding.code} ", f" {medium.paint(finding.code, _STYLES[finding.severity])} ", 1
    )
    lines = [first, *rest]
    if finding.fix:
        fix = f"{' ' * _INDENT}fix: {printable(finding.fix)}"
        lines += medium.wrapped(fix, indent=_INDENT + 5)
    return lines


def note_lines(finding: Finding, *, medium: Medium) -> list[str]:
    """Return a finding of severity info as a note, without file and fix."""
    return medium.wrapped(f"  {label(finding)}: {finding_message(finding)}", indent=_INDENT)


def by_weight(findings: Sequence[Finding]) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """Return the errors and warnings, and the assumptions."""
    return (
        tuple(finding for finding in findings if finding.severity > Severity.INFO),
        tuple(finding for finding in findings if finding.severity is Severity.INFO),
    )


def finding_tally(findings: Sequence[Finding]) -> str:
    """Return how many findings there are of each severity: ``1 error, 2 assumptions``."""
    nouns = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "assumption"}
    counts = Counter(finding.severity for finding in findings)
    return ", ".join(
        quantity.count(counts[severity], noun)
        for severity, noun in nouns.items()
        if counts[severity]
    )


def closing_line(findings: Sequence[Finding], *, suppressed: Sequence[Finding]) -> str:
    """Return ``Found 1 error. 2 assumptions.``, and what is suppressed."""
    problems, notes = by_weight(findings)
    text = f"Found {finding_tally(problems)}." if problems else "No problem found."
    if suppressed:
        text += f" Not reported, as asked: {finding_tally(suppressed)}."
    return f"{text} {finding_tally(notes)}." if notes else text


def label(finding: Finding) -> str:
    """Return what a finding is called: ``E101 reserve-below-minimum``."""
    return f"{finding.code} {finding.name}"


def finding_message(finding: Finding) -> str:
    """Return the message of a finding, safe to print, with its item."""
    message = printable(finding.message)
    item = f"item {finding.item}"
    if finding.item is None or (item in message and re.search(rf"\b{item}\b", message)):
        return message
    return f"{item}: {message}"


def table_lines(rows: Sequence[Sequence[str]], *, alignment: str) -> list[str]:
    """Return equally long rows as lines, two blanks between columns.

    ``alignment`` has a letter per column: ``<`` left, ``>`` right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            f"{cell:{side}{width}}"
            for cell, side, width in zip(row, alignment, widths, strict=True)
        ).rstrip()
        for row in rows
    ]


_LABEL_WIDTH = 12
_MOST_EXCEPTIONS = 3
"""So many missions are named as those that a note is not of."""


def check_text(results: Sequence[CheckResult | UnreadableMission], *, medium: Medium) -> str:
    """Return the report of all missions of a call; several end in a summary, a line each, worst first."""
    blocks = [_mission_lines(result, medium=medium) for result in results]
    if len(results) > 1:
        blocks.append(_summary_lines(results, medium=medium))
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def headline(result: CheckResult | UnreadableMission) -> str:
    """Return what a flight takes and leaves, in one line without the verdict."""
    if not isinstance(result, CheckResult):
        return "the mission cannot be checked"
    totals, battery = result.totals, result.battery
    way = f"{quantity.duration(totals.time_s)}, {quantity.distance(totals.distance_m)}"
    if not result.segments:
        return "nothing is flown"
    if math.isnan(totals.energy_wh):
        return f"{way}; energy unknown"
    flown = f"{way}, {quantity.energy(totals.energy_wh)}"
    if battery is None:
        return f"{flown}; battery unknown"
    return f"{flown}: {quantity.percent(battery.used_fraction)} of the battery, {_left(battery)}"


def given_text(result: CheckResult) -> str:
    """Return what a verdict holds for: vehicle, battery and wind."""
    pack = result.setup.flown_pack.battery  # that of a flight, or what it would be
    capacity_wh = None if pack is None else pack.energy_wh
    if result.battery is not None:
        capacity_wh = result.battery.capacity_wh
    return printable(basis_text(result.setup, capacity_wh=capacity_wh))


def given_texts(given: Iterable[tuple[str, str]]) -> tuple[str, ...]:
    """Return what verdicts hold for, by names; of which where it differs."""
    names: dict[str, list[str]] = {}
    for name, text in given:
        names.setdefault(text, []).append(printable(name))
    if len(names) == 1:
        return (*names,)
    return tuple(f"{text}: {', '.join(of)}" for text, of in names.items())


def badness(result: CheckResult | UnreadableMission) -> tuple[float, ...]:
    """Return what missions are sorted by, worst first: verdict, errors, what is left, warnings."""
    errors, warnings = (
        sum(finding.severity is severity for finding in result.findings)
        for severity in (Severity.ERROR, Severity.WARNING)
    )
    battery = result.battery if isinstance(result, CheckResult) else None
    return (
        ("NO-GO", "NOT CHECKED", "GO").index(result.verdict_text),
        -errors,
        math.inf if battery is None or math.isnan(battery.margin_wh) else battery.margin_wh,
        -warnings,
    )


def reason_text(result: CheckResult | UnreadableMission) -> str:
    """Return why a mission is no GO: what its verdict comes from; nothing for a GO."""
    if not isinstance(result, CheckResult):
        return "; ".join(f"{one.code} {printable(one.message)}" for one in result.findings)
    deciding = [one for one in result.findings if one.severity >= result.setup.fail_on]
    return ", ".join(dict.fromkeys(map(label, deciding)))


def check_concise(results: Sequence[CheckResult | UnreadableMission]) -> str:
    """Return a line for each mission and each finding, ``file:line:column: …`` as editors read it.

    Several end in the notes that are the same for nearly all of them, once, and in how many go.
    """
    notes = [list(_concise_notes(result)) for result in results]
    shared = _shared_notes(results, notes) if len(results) > 1 else {}
    lines = []
    for result, some in zip(results, notes, strict=True):
        file = printable(result.file)
        given = f" ({given_text(result)})" if isinstance(result, CheckResult) else ""
        verdict = f"{result.verdict_text}{caveat([result])}"
        lines.append(f"{file}:1:1: {verdict}: {headline(result)}{given}")
        for finding in by_weight(result.findings)[0]:
            text = f"{label(finding)}: {finding_message(finding)}"
            lines.append(f"{file}:{_concise_place(finding)}: {finding.severity.label}: {text}")
        lines += [f"{file}:{place}: note: {text}" for place, text in some if text not in shared]
    if len(results) > 1:
        lines += [f"{whose}: note: {text}" for text, whose in shared.items()]
        lines.append(f"{tally(results)}{caveat(results)}")
    return "\n".join(lines) + "\n"


def _concise_notes(result: CheckResult | UnreadableMission) -> Iterator[tuple[str, str]]:
    """Yield assumptions and what was not checked, each with its place in the file."""
    for finding in by_weight(result.findings)[1]:
        yield _concise_place(finding), f"{label(finding)}: {finding_message(finding)}"
    for needs, rules in not_checked(result.checked):
        yield "1:1", f"not checked (needs {needs}): {rules}"


def _shared_notes(
    results: Sequence[CheckResult | UnreadableMission], notes: Sequence[list[tuple[str, str]]]
) -> dict[str, str]:
    """Return the notes that nearly all missions checked have, each with whose they are."""
    files_of: defaultdict[str, list[str]] = defaultdict(list)
    checked = [printable(one.file) for one in results if isinstance(one, CheckResult)]
    for result, some in zip(results, notes, strict=True):
        for text in dict.fromkeys(text for _, text in some):
            files_of[text].append(printable(result.file))
    shared = {}
    for text, files in files_of.items():
        others = [file for file in checked if file not in files]
        if len(files) > 1 and len(others) <= min(_MOST_EXCEPTIONS, len(files) // 2):
            but = f" but {', '.join(others)}" if others else ""
            shared[text] = f"all {quantity.count(len(checked), 'mission')}{but}"
    return shared


def _concise_place(finding: Finding) -> str:
    return "1:1" if finding.place is None else f"{finding.place.line}:{finding.place.column}"


def figure_texts(result: CheckResult) -> list[tuple[str, str]]:
    """Return what a flight takes, leaves and meets, each with its label: ``Flight``, ``Energy``, …"""
    figures = [("Flight", _flight(result.totals)), ("Energy", _energy(result.totals))]
    if result.battery is not None:
        figures.append(("Battery", _battery(result.battery, ends_in_air=_ends_in_air(result))))
    if result.return_plan is not None:
        figures.append(("Return", _return_plan(result.return_plan)))
    vehicle = result.setup.vehicle
    figures += [
        (
            "Vehicle",
            f"{printable(vehicle.name)} ({printable(vehicle.source)}){example_remark(result)}",
        ),
        ("Conditions", conditions_text(result.setup)),
    ]
    if (file := result.setup.settings_file) is not None:
        figures.append(("Settings", printable(str(file))))
    return figures


def settings_lines(setup: Setup) -> list[str]:
    """Return the line that names what a configuration file has set; none where it has set nothing."""
    file = setup.settings_file
    return [] if file is None else [f"settings {printable(str(file))}"]


def example_remark(result: CheckResult | UnreadableMission) -> str:
    """Return the remark that a prediction needs whose vehicle nobody named; else nothing."""
    if not isinstance(result, CheckResult) or result.setup.is_vehicle_named:
        return ""
    return f": {UNNAMED}"


def tally(results: Sequence[CheckResult | UnreadableMission]) -> str:
    """Return how many missions go, in a line: ``2 missions: 1 GO, 1 NO-GO``."""
    counts = Counter(result.verdict_text for result in results)
    missions = quantity.count(len(results), "mission")
    text = f"{missions}: {counts['GO']} GO, {counts['NO-GO']} NO-GO"
    return text + (f", {counts['NOT CHECKED']} NOT CHECKED" if counts["NOT CHECKED"] else "")


def caveat(results: Sequence[CheckResult | UnreadableMission]) -> str:
    """Return the remark that verdicts need which were reached by not looking; else nothing."""
    return caveat_of([finding for result in results for finding in result.suppressed])


def caveat_of(suppressed: Sequence[Finding]) -> str:
    """Return the remark that a verdict needs beside which these are not reported; else nothing."""
    grave, _ = by_weight(suppressed)
    return f" ({finding_tally(grave)} suppressed)" if grave else ""


def checked_text(checked: Sequence[LedgerEntry]) -> str:
    """Return how much was checked: ``74 rules checked, 3 not checked, 31 not applicable.``"""
    if not checked:
        return ""
    counts = Counter(entry.outcome for entry in checked)
    text = f"{quantity.count(counts[Outcome.CHECKED], 'rule')} checked"
    if counts[Outcome.NOT_CHECKED]:
        text += f", {counts[Outcome.NOT_CHECKED]} not checked"
    return f"{text}, {counts[Outcome.NOT_APPLICABLE]} not applicable."


def left_unchecked(checked: Sequence[LedgerEntry]) -> tuple[LedgerEntry, ...]:
    """Return the rules that were not checked, though they apply."""
    return tuple(entry for entry in checked if entry.outcome is Outcome.NOT_CHECKED)


def not_checked(checked: Sequence[LedgerEntry]) -> tuple[tuple[str, str], ...]:
    """Return what is missing for rules that were not checked, each with the rules that need it."""
    rules: defaultdict[str, list[str]] = defaultdict(list)
    for entry in left_unchecked(checked):
        rules[entry.needs].append(f"{entry.code} {entry.name}")
    return tuple((needs, ", ".join(names)) for needs, names in rules.items())


def not_checked_text(checked: Sequence[LedgerEntry]) -> str:
    """Return ``3 rules not checked: needs terrain: --terrain``; nothing where all were."""
    missing = not_checked(checked)
    if not missing:
        return ""
    count = quantity.count(len(left_unchecked(checked)), "rule")
    return f"{count} not checked: needs {'; '.join(needs for needs, _ in missing)}"


def ledger_lines(checked: Sequence[LedgerEntry], *, medium: Medium) -> list[str]:
    """Return how much was checked, and a line for each thing that is missing for the rest."""
    lines = [text] if (text := checked_text(checked)) else []
    for needs, rules in not_checked(checked):
        lines += medium.wrapped(f"  not checked (needs {needs}): {rules}", indent=_INDENT)
    return lines


def statistics_text(results: Sequence[CheckResult | UnreadableMission], *, medium: Medium) -> str:
    """Return the verdicts of a call, a line per mission, and how often each rule fired."""
    lines = _summary_lines(results, medium=medium)
    return "\n".join([*lines, "", *statistics_lines(count_codes(results))]) + "\n"


def _mission_lines(result: CheckResult | UnreadableMission, *, medium: Medium) -> list[str]:
    lines = [f"{_verdict(result, medium)}  {printable(result.file)}{caveat([result])}"]
    lines += medium.wrapped(given_text(result)) if isinstance(result, CheckResult) else []
    lines += medium.wrapped(headline(result))
    findings, notes = by_weight(result.findings)
    if findings:
        lines.append("")
    for finding in findings:
        lines += finding_lines(finding, file=result.file, medium=medium)
    if isinstance(result, CheckResult):
        lines += ["", *_figure_lines(result, medium=medium), "", *_phase_lines(result)]
    closing = closing_line(result.findings, suppressed=result.suppressed)
    lines += ["", f"{closing.removesuffix('.')}:" if notes else closing]
    for note in notes:
        lines += note_lines(note, medium=medium)
    if ledger := ledger_lines(result.checked, medium=medium):
        lines += ["", *ledger]
    if notes or ledger:
        lines.append("")
    if result.findings:
        lines.append(f"More about a code: mavjoule explain {result.findings[0].code}")
    return lines


def _verdict(result: CheckResult | UnreadableMission, medium: Medium, width: int = 0) -> str:
    text = f"{result.verdict_text:<{width}}"
    styles = {"GO": "green", "NOT CHECKED": "yellow"}
    return medium.paint(text, styles.get(result.verdict_text, "red"))


def _left(battery: BatteryBudget) -> str:
    name = reserve_name(battery)
    is_hover = battery.reserve is not None and battery.reserve.hover_s is not None
    reserve = f"the reserve of {name}" if is_hover else f"the {name} reserve"
    return margin_text(battery.margin_wh, reserve)


def margin_text(margin_wh: float, reserve: str) -> str:
    """Return a margin in words: ``4.20 Wh above the 20 % reserve``, ``1.30 Wh short of …``."""
    if margin_wh < 0.0:
        return f"{quantity.energy(-margin_wh)} short of {reserve}"
    return f"{quantity.energy(margin_wh)} above {reserve}"


def _figure_lines(result: CheckResult, *, medium: Medium) -> list[str]:
    return [
        line
        for label, text in figure_texts(result)
        for line in medium.wrapped(f"{label:<{_LABEL_WIDTH}}{text}", indent=_LABEL_WIDTH)
    ]


def _spread(low: float | None, high: float | None, shown: Callable[[float | None], str]) -> str:
    return "" if None in {low, high} else f" (8 of 10 flights: {shown(low)} to {shown(high)})"


def _flight(totals: Totals) -> str:
    spread = _spread(totals.time_s_p10, totals.time_s_p90, quantity.duration)
    return (
        f"{quantity.duration(totals.time_s)}{spread}, {quantity.distance(totals.distance_m)}, "
        f"climb {quantity.height(totals.climb_m)}, descent {quantity.height(totals.descent_m)}"
    )


def _energy(totals: Totals) -> str:
    spread = _spread(totals.energy_wh_p10, totals.energy_wh_p90, quantity.energy)
    if not spread and not math.isnan(totals.energy_wh):
        spread = " (no error bar: this model was never compared with other flights)"
    text = f"{quantity.energy(totals.energy_wh)}{spread}"
    if totals.charge_mah is not None:
        text += f", {quantity.charge(totals.charge_mah)}"
    return (
        f"{text}, mean {quantity.power(totals.mean_power_w)}, "
        f"peak {quantity.power(totals.peak_power_w)}"
    )


def _ends_in_air(result: CheckResult) -> bool:
    return result.assessment is not None and result.assessment.route.ends_in_air


def _battery(battery: BatteryBudget, *, ends_in_air: bool) -> str:
    chance = battery.below_reserve_probability
    text = (
        f"{quantity.energy(battery.capacity_wh)} full, "
        f"{quantity.energy(battery.usable_wh)} at the start"
        f"{'' if battery.charge_left_fraction is None else ' less losses in it'}, "
        f"{quantity.percent(battery.used_fraction)} used"
    )
    if battery.hover_left_s is not None:
        end = "the last item, where it stays in the air" if ends_in_air else "landing"
        text += f", {quantity.duration(battery.hover_left_s)} of hover left at {end}"
    if battery.charge_left_fraction is not None and battery.lowest_voltage_v is not None:
        left = quantity.charge_left(battery.charge_left_fraction)
        text += f", {left} of the charge left, lowest {quantity.voltage(battery.lowest_voltage_v)}"
    return text if chance is None else f"{text}; {_chance(chance)} to land below the reserve"


def _return_plan(plan: ReturnPlan) -> str:
    text = f"tightest from {tightest_text(plan)}"
    if plan.time_home_s is not None:
        text += f" in {quantity.duration(plan.time_home_s)}"
    if plan.margin_wh is None:
        return text
    text = f"{text}, {margin_text(plan.margin_wh, 'the reserve')}"
    chance = plan.below_reserve_probability
    return text if chance is None else f"{text}; {_chance(chance)} to get home below it"


def tightest_text(plan: ReturnPlan, then: str = ": ") -> str:
    """Return ``item 7: 13.4 Wh to get home``."""
    where = f"item {plan.tightest_item}" if plan.tightest is None else place_along(plan.tightest)
    goal = destination_name(plan.destination)
    return f"{where}{then}{quantity.energy(plan.energy_home_wh)} to get {goal}"


def _chance(probability: float) -> str:
    return f"{quantity.chance(probability)} chance"


def _phase_lines(result: CheckResult) -> list[str]:
    rows = [
        (
            phase.state,
            str(phase.segments),
            quantity.duration(phase.time_s),
            quantity.distance(phase.distance_m),
            quantity.energy(phase.energy_wh),
            quantity.percent(phase.energy_fraction),
        )
        for phase in flight_phases(result)
    ]
    heads = ("Phase", "count", "time", "distance", "energy", "of total")
    return table_lines([heads, *rows], alignment="<>>>>>")


def _summary_lines(
    results: Sequence[CheckResult | UnreadableMission], *, medium: Medium
) -> list[str]:
    lines = [tally(results)]
    width = max(len(result.verdict_text) for result in results)
    for result in sorted(results, key=badness):
        verdict = f"  {result.verdict_text:<{width}}"
        said = [headline(result)] if isinstance(result, CheckResult) else []
        if reason := reason_text(result):
            said.append(reason)
        text = f"{verdict}  {printable(result.file)}{caveat([result])}: {'; '.join(said)}"
        first, *rest = medium.wrapped(text, indent=width + 4)
        lines += [first.replace(verdict, f"  {_verdict(result, medium, width)}", 1), *rest]
    return lines


_CODES = {"bold": "1", "red": "1;31", "yellow": "33", "green": "1;32", "dim": "2"}


class Medium(Value):
    """A terminal, or a file or pipe, which has neither width nor colour."""

    width: int | None = None
    """Columns to wrap text at; ``None``: one line each, for other programs to read."""
    is_coloured: bool = False

    def paint(self, text: str, style: str) -> str:
        """Return the text in a style of ``bold``, ``red``, ``yellow``, ``green`` or ``dim``."""
        return f"\x1b[{_CODES[style]}m{text}\x1b[0m" if self.is_coloured else text

    def wrapped(self, text: str, *, indent: int = 0) -> list[str]:
        """Return a text as lines; those after the first are indented.

        The text is not to be painted: colour codes would count as columns.
        """
        if self.width is None:
            return [text]
        return textwrap.wrap(
            text,
            width=max(self.width, 40),
            subsequent_indent=" " * indent,
            break_long_words=False,
            break_on_hyphens=False,
        )


class CodeCount(Value, kw_only=False):
    """The findings of one rule and severity in all missions of a call."""

    code: str
    name: str
    severity: Severity
    count: int
    """How many are reported."""
    suppressed: int
    """How many are not."""
    missions: int
    """In how many missions there are any."""


def count_codes(results: Sequence[CheckResult | UnreadableMission]) -> tuple[CodeCount, ...]:
    """Return what was found by rule and severity: worst first, then most, then by code."""
    reported = Counter(_key(finding) for result in results for finding in result.findings)
    suppressed = Counter(_key(finding) for result in results for finding in result.suppressed)
    missions: defaultdict[tuple[str, str, Severity], set[int]] = defaultdict(set)
    for index, result in enumerate(results):
        for finding in (*result.findings, *result.suppressed):
            missions[_key(finding)].add(index)
    counts = [
        CodeCount(*key, reported[key], suppressed[key], len(where))
        for key, where in missions.items()
    ]
    return tuple(sorted(counts, key=lambda one: (-one.severity, -one.count, one.code)))


def statistics_lines(counts: Sequence[CodeCount]) -> list[str]:
    """Return counts as an aligned table; none where nothing was found."""
    if not counts:
        return ["Nothing was found."]
    heads = ("count", "not reported", "missions", "code", "severity", "name")
    rows = [
        (
            *map(str, (one.count, one.suppressed, one.missions)),
            one.code,
            one.severity.label,
            one.name,
        )
        for one in counts
    ]
    return table_lines([heads, *rows], alignment=">>><<<")


def _key(finding: Finding) -> tuple[str, str, Severity]:
    return finding.code, finding.name, finding.severity
