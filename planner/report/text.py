"""The report of a check as a pilot reads it: the verdict first, then why, then the figures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import numbers
from planner.findings import Severity
from planner.report.finding_text import closing_line, finding_lines, note_lines
from planner.report.finding_text import tally as finding_tally
from planner.report.phases import flight_phases
from planner.report.plain_text import printable
from planner.report.table import table_lines
from planner.rules.energy import destination_name, place_along, reserve_name
from planner.service import CheckResult

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.flight.budget import BatteryBudget, ReturnBudget, Totals
    from planner.flight.conditions import Conditions
    from planner.physics.wind import Wind
    from planner.report.medium import Medium
    from planner.service import UnreadableMission

_LABEL_WIDTH = 12


def check_text(results: Sequence[CheckResult | UnreadableMission], *, medium: Medium) -> str:
    """Return the report of all missions of a call; several end in a summary, a line each."""
    blocks = [_mission_lines(result, medium=medium) for result in results]
    if len(results) > 1:
        blocks.append(_summary_lines(results, medium=medium))
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def headline(result: CheckResult | UnreadableMission) -> str:
    """Return what a flight takes and leaves, in one line without the verdict."""
    if not isinstance(result, CheckResult):
        return "the mission cannot be checked"
    totals, battery = result.totals, result.battery
    way = f"{numbers.duration(totals.time_s)}, {numbers.distance(totals.distance_m)}"
    if not result.segments:
        return "nothing is flown"
    if math.isnan(totals.energy_wh):
        return f"{way}; the energy is not known"
    flown = f"{way}, {numbers.energy(totals.energy_wh)}"
    if battery is None:
        return f"{flown}; no battery is known"
    return f"{flown}: {numbers.percent(battery.used_fraction)} of the battery, {_left(battery)}"


def figure_texts(result: CheckResult) -> list[tuple[str, str]]:
    """Return what a flight takes, leaves and meets, each with its label: ``Flight``, ``Energy``, …"""
    figures = [("Flight", _flight(result.totals)), ("Energy", _energy(result.totals))]
    if result.battery is not None:
        figures.append(("Battery", _battery(result.battery)))
    if result.way_home is not None:
        figures.append(("Way home", _way_home(result.way_home)))
    figures += [
        ("Vehicle", f"{printable(result.vehicle_name)} ({printable(result.vehicle_source)})"),
        ("Conditions", _conditions(result)),
    ]
    return figures


def tally(results: Sequence[CheckResult | UnreadableMission]) -> str:
    """Return how many missions go, in a line: ``2 missions: 1 GO, 1 NO-GO``."""
    going = sum(result.verdict == "go" for result in results)
    missions = numbers.count(len(results), "mission")
    return f"{missions}: {going} GO, {len(results) - going} NO-GO"


def caveat(results: Sequence[CheckResult | UnreadableMission]) -> str:
    """Return the remark that verdicts need which were reached by not looking; else nothing."""
    grave = [
        finding
        for result in results
        for finding in result.suppressed
        if finding.severity > Severity.INFO
    ]
    return f" (not counting {finding_tally(grave)})" if grave else ""


def statistics_text(results: Sequence[CheckResult | UnreadableMission], *, medium: Medium) -> str:
    """Return the verdicts of a call, a line per mission, and how often each rule fired."""
    from planner.report.statistics import count_codes, statistics_lines

    lines = _summary_lines(results, medium=medium)
    return "\n".join([*lines, "", *statistics_lines(count_codes(results))]) + "\n"


def _mission_lines(result: CheckResult | UnreadableMission, *, medium: Medium) -> list[str]:
    lines = [f"{_verdict(result, medium)}  {printable(result.file)}{caveat([result])}"]
    lines += medium.wrapped(headline(result))
    findings = [finding for finding in result.findings if finding.severity > Severity.INFO]
    notes = [finding for finding in result.findings if finding.severity is Severity.INFO]
    if findings:
        lines.append("")
    for finding in findings:
        lines += finding_lines(finding, file=result.file, medium=medium)
    if isinstance(result, CheckResult):
        lines += ["", *_figure_lines(result, medium=medium), "", *_phase_lines(result)]
    if notes:
        lines += ["", "Assumed"]
    for note in notes:
        lines += note_lines(note, medium=medium)
    lines += ["", closing_line(result.findings, suppressed=result.suppressed)]
    if result.findings:
        lines.append(f"More about a code: mavjoule explain {result.findings[0].code}")
    return lines


def _verdict(result: CheckResult | UnreadableMission, medium: Medium, width: int = 0) -> str:
    text = f"{result.verdict.upper():<{width}}"
    return medium.paint(text, "green" if result.verdict == "go" else "red")


def _left(battery: BatteryBudget) -> str:
    if battery.reserve is None or battery.reserve.hover_s is None:
        return against(battery.margin_wh, f"the {reserve_name(battery)} reserve")
    return against(battery.margin_wh, f"the reserve of {reserve_name(battery)}")


def against(margin_wh: float, reserve: str) -> str:
    """Return a margin in words: ``4.20 Wh above the 20 % reserve``, ``1.30 Wh short of …``."""
    if margin_wh < 0.0:
        return f"{numbers.energy(-margin_wh)} short of {reserve}"
    return f"{numbers.energy(margin_wh)} above {reserve}"


def _figure_lines(result: CheckResult, *, medium: Medium) -> list[str]:
    return [
        line
        for label, text in figure_texts(result)
        for line in medium.wrapped(f"{label:<{_LABEL_WIDTH}}{text}", indent=_LABEL_WIDTH)
    ]


def _flight(totals: Totals) -> str:
    spread = ""
    if totals.time_s_p10 is not None and totals.time_s_p90 is not None:
        low, high = numbers.duration(totals.time_s_p10), numbers.duration(totals.time_s_p90)
        spread = f" (8 of 10 flights: {low} to {high})"
    return (
        f"{numbers.duration(totals.time_s)}{spread}, {numbers.distance(totals.distance_m)}, "
        f"climb {numbers.height(totals.climb_m)}, descent {numbers.height(totals.descent_m)}"
    )


def _energy(totals: Totals) -> str:
    text = numbers.energy(totals.energy_wh)
    if totals.energy_wh_p10 is not None and totals.energy_wh_p90 is not None:
        low, high = numbers.energy(totals.energy_wh_p10), numbers.energy(totals.energy_wh_p90)
        text += f" (8 of 10 flights: {low} to {high})"
    elif not math.isnan(totals.energy_wh):
        text += " (its spread is not known)"
    if totals.charge_mah is not None:
        text += f", {numbers.charge(totals.charge_mah)}"
    return (
        f"{text}, mean {numbers.power(totals.mean_power_w)}, "
        f"peak {numbers.power(totals.peak_power_w)}"
    )


def _battery(battery: BatteryBudget) -> str:
    hover = ""
    if battery.hover_left_s is not None:
        hover = f", {numbers.duration(battery.hover_left_s)} of hover left at landing"
    chance = battery.below_reserve_probability
    text = (
        f"{numbers.energy(battery.capacity_wh)} full, "
        f"{numbers.energy(battery.usable_wh)} at the start, "
        f"{numbers.percent(battery.used_fraction)} used{hover}"
    )
    if battery.charge_left_fraction is not None and battery.lowest_voltage_v is not None:
        left = numbers.percent(max(battery.charge_left_fraction, 0.0))
        text += (
            f", {left} of the charge left, lowest {numbers.decimals(battery.lowest_voltage_v, 1)} V"
        )
    return text if chance is None else f"{text}; {_chance(chance)} to land below the reserve"


def _way_home(way_home: ReturnBudget) -> str:
    where = f"item {way_home.tightest_item}"
    if way_home.tightest is not None:
        where = place_along(way_home.tightest)
    goal = destination_name(way_home.destination)
    text = f"tightest from {where}: {numbers.energy(way_home.energy_home_wh)} to get {goal}"
    if way_home.time_home_s is not None:
        text += f" in {numbers.duration(way_home.time_home_s)}"
    if way_home.margin_wh is None:
        return text
    text = f"{text}, {against(way_home.margin_wh, 'the reserve')}"
    chance = way_home.below_reserve_probability
    return text if chance is None else f"{text}; {_chance(chance)} to get home below it"


def _chance(probability: float) -> str:
    return f"{numbers.chance(probability)} chance"


def _conditions(result: CheckResult) -> str:
    conditions = result.conditions
    payload_kg = conditions.payload_kg
    payload = _give_or_take(numbers.mass, payload_kg, conditions.payload_sd_kg)
    return ", ".join(
        (
            _wind(conditions.wind),
            _give_or_take(
                numbers.temperature, conditions.temperature_c, conditions.temperature_sd_c
            ),
            f"home {numbers.height(conditions.home_amsl_m)} AMSL",
            f"payload {payload}" if payload_kg or conditions.payload_sd_kg else "no payload",
            *_battery_conditions(conditions),
        )
    )


def _wind(wind: Wind) -> str:
    if not (wind.speed_m_s or wind.speed_sd_m_s):
        return "no wind"
    speed = _give_or_take(numbers.speed, wind.speed_m_s, wind.speed_sd_m_s)
    text = f"wind {speed} from {numbers.bearing(wind.from_deg)}"
    if wind.from_sd_deg:
        text += f" ± {numbers.decimals(wind.from_sd_deg, 0)}°"
    if wind.reference_height_m is None:
        return text
    text += f" at {numbers.height(wind.reference_height_m)}"
    if wind.shear_exponent is not None:
        return f"{text} (power law, exponent {wind.shear_exponent:g})"
    return f"{text} (logarithmic law, roughness {wind.roughness_length_m:g} m)"


def _battery_conditions(conditions: Conditions) -> Iterator[str]:
    """Yield what is said of the age and the temperature of the battery."""
    if conditions.battery_health is not None:
        yield f"battery health {numbers.percent(conditions.battery_health)}"
    if conditions.battery_resistance_factor is not None:
        yield f"battery resistance {conditions.battery_resistance_factor:g} times the new one's"
    if conditions.battery_temperature_c is not None:
        yield f"battery at {numbers.temperature(conditions.battery_temperature_c)}"


def _give_or_take(shown: Callable[[float | None], str], mean: float | None, sd: float) -> str:
    """Return a quantity with its standard deviation, where it has one."""
    return f"{shown(mean)} ± {shown(sd)}" if sd else shown(mean)


def _phase_lines(result: CheckResult) -> list[str]:
    rows = [
        (
            phase.state,
            str(phase.segments),
            numbers.duration(phase.time_s),
            numbers.distance(phase.distance_m),
            numbers.energy(phase.energy_wh),
            numbers.percent(phase.energy_fraction),
        )
        for phase in flight_phases(result)
    ]
    heads = ("Phase", "count", "time", "distance", "energy", "share")
    return table_lines([heads, *rows], alignment="<>>>>>")


def _summary_lines(
    results: Sequence[CheckResult | UnreadableMission], *, medium: Medium
) -> list[str]:
    lines = [tally(results)]
    width = max(len(result.verdict) for result in results)
    for result in results:
        verdict = f"  {result.verdict.upper():<{width}}"
        text = f"{verdict}  {printable(result.file)}{caveat([result])}: {headline(result)}"
        first, *rest = medium.wrapped(text, indent=width + 4)
        lines += [first.replace(verdict, f"  {_verdict(result, medium, width)}", 1), *rest]
    return lines
