"""What a sweep comes to, as text: shares of GO, limits, what breaks first, what moves the margin."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import catalogue, quantity
from planner.report.text import printable, settings_lines, table_lines
from planner.service.sweep.axes import WIND_PARTS
from planner.service.sweep.tally import LONGEST
from planner.setting import declared
from planner.setup import Setup
from planner.values import replace

if TYPE_CHECKING:
    from planner.report.text import Medium
    from planner.service.sweep.sweep import Sweep, SweepProgress
    from planner.service.sweep.tally import AxisScale, Limit, Tally

_BAR = 30
_MOST_BREAKS = 8
_MOST_LIMITS = 40
_UNITS = {"_m_s": "m/s", "_deg": "°", "_kg": "kg", "_c": "°C", "_m": "m", "_s": "s", "_hpa": "hPa"}
_NAMES = {
    "wind_m_s": "wind",
    "wind_from_deg": "wind from",
    "gust_m_s": "gusts",
    "temperature_c": "temperature",
    "pressure_hpa": "pressure",
}


def sweep_text(sweep: Sweep, *, medium: Medium) -> str:
    """Return the answer of a sweep."""
    tally = sweep.tally
    lines = [medium.paint(headline(sweep), "bold"), *remarks(sweep), ""]
    for scale in tally.scales:
        if len(scale.labels) > 1:
            lines += [*_shares(tally, scale), ""]
    if limits := limit_lines(tally):
        lines += ["GO, whatever else varies:", *(f"  {one}" for one in limits), ""]
    if rows := break_rows(tally):
        table = table_lines(rows, alignment="<<>")
        lines += ["what breaks first, in cases:", *(f"  {line}" for line in table), ""]
    if swings := [*_tornado(tally)]:
        lines += ["mean margin at the worst and the best value:", *swings, ""]
    return "\n".join(lines[:-1]) + "\n"


def headline(sweep: Sweep) -> str:
    """Return how many cases are a GO, and how they were worked out."""
    go, every, unchecked = sweep.tally.counts.tolist()
    share = sweep.tally.go_share
    text = f"GO in {go} of {every - unchecked} cases"
    if share is not None:
        text += f" ({quantity.percent(share)})"
    if unchecked:
        text += f"; {unchecked} NOT CHECKED"
    return text


def remarks(sweep: Sweep) -> list[str]:
    """Return what was swept, and what it took."""
    tally = sweep.tally
    missions = ", ".join(printable(name) for name in sweep.plan.missions)
    every = sweep.plan.cases.combination_count
    worked = f"{quantity.count(every, 'combination')}: {quantity.count(tally.checks, 'check')}"
    if every > tally.checks:
        worked += f", {every - tally.checks} saved where conditions are equal"
    if 0 < tally.flights < tally.checks:
        worked += f"; {quantity.count(tally.flights, 'flight')} predicted for all of them"
    what = f"{missions}, {printable(sweep.plan.setup.vehicle.name)}"
    if (fleet := sweep.plan.fleet) is not None:
        sorties = quantity.count(len(fleet.sorties), "sortie")
        what = f"{printable(fleet.source)}, {sorties} of {quantity.count(len(fleet.vehicles), 'vehicle')}"
    setup = sweep.plan.setup
    if (file := setup.settings_file) is not None:
        setup = replace(
            setup, settings_file=file.without([axis.key for axis in sweep.plan.cases.axes])
        )
    lines = [what, worked, *settings_lines(setup)]
    if weather := sweep.plan.weather:
        lines.append(f"weather of {printable(weather.source)}, {len(weather.times)} rows")
        if weather.unused:
            lines.append(f"not counted: {', '.join(map(printable, weather.unused))}")
    return lines


def name_of(key: str) -> str:
    """Return what varies in words, without its unit."""
    if key in _NAMES:
        return _NAMES[key]
    setting = next((one for one in declared(Setup) if one.key == key), None)
    return key if setting is None else setting.option.removeprefix("--").replace("-", " ")


def unit_of(key: str) -> str:
    """Return the unit of a column, empty where it has none."""
    known = {one.key for one in WIND_PARTS.values()} | {one.key for one in declared(Setup)}
    return next((unit for end, unit in _UNITS.items() if key in known and key.endswith(end)), "")


def value_text(key: str, label: str) -> str:
    """Return a value of a column with its unit."""
    unit = unit_of(key)
    return f"{printable(label)}{'' if unit in {'', '°'} else ' '}{unit}"


def _shares(tally: Tally, scale: AxisScale) -> list[str]:
    unit = unit_of(scale.key)
    head = f"{name_of(scale.key)}{f' [{unit}]' if unit else ''}"
    rows = []
    for label, go, checked in tally.shares(scale.key):
        share = go / checked if checked else None
        bar = "" if share is None else "█" * round(_BAR * share)
        rows.append((f"  {printable(label)}", quantity.percent(share), f"{go}/{checked}", bar))
    return [head, *table_lines(rows, alignment=">>><")]


def limit_lines(tally: Tally) -> list[str]:
    """Return how far each axis goes, and by direction of the wind where that matters."""
    found = list(tally.limits())
    lines = [_limit_text(one) for one in found if one.within is None]
    by_key: dict[str, list[Limit]] = {}
    for one in found:
        if one.within is not None:
            by_key.setdefault(one.key, []).append(one)
    for key, several in by_key.items():
        if len({(one.every, one.best) for one in several}) > 1:
            lines += [_limit_text(one) for one in several if one.key == key]
    return lines[:_MOST_LIMITS]


def _limit_text(limit: Limit) -> str:
    unit, name = unit_of(limit.key), name_of(limit.key)
    where = ""
    if limit.within is not None:
        where = f" from {limit.within[1]}{unit_of(limit.within[0])}"

    def reach(value: float | None) -> str:
        if value is None:
            return "at no value"
        if value == limit.last:
            return "at every value"
        side = "up to" if limit.is_upper else "down to"
        if value == limit.first:  # "up to −5 °C" reads as if all that is colder had been checked
            side = "only at"
        number = quantity.exact(value)
        if len(number) > LONGEST:
            number = quantity.decimals(value, 2)
        return f"{side} {number}{f' {unit}' if unit else ''}"

    if limit.every is None and limit.best is not None:
        return (
            f"{name}{where}: no value is a GO in every case; in the best case {reach(limit.best)}"
        )
    if limit.every == limit.best:
        return f"{name}{where}: {reach(limit.every)}"
    return f"{name}{where}: {reach(limit.every)} in every case, {reach(limit.best)} in the best"


def break_rows(tally: Tally) -> list[tuple[str, str, str]]:
    """Return what breaks first: code, name, in how many cases; the most frequent first."""
    names = {code: entry.name for code, entry in catalogue.entries().items()}
    return [
        (code, names.get(code, ""), str(count))
        for code, count in tally.breaks.most_common(_MOST_BREAKS)
    ]


def _tornado(tally: Tally) -> list[str]:
    rows = [
        (
            f"  {name_of(one.key)}",
            quantity.energy(one.width_wh),
            f"{quantity.energy(one.worst_wh)} at {value_text(one.key, one.worst)}",
            f"{quantity.energy(one.best_wh)} at {value_text(one.key, one.best)}",
        )
        for one in tally.swings()
        if one.width_wh > 0.0
    ]
    return table_lines(rows, alignment="<><<") if rows else []


def progress_text(progress: SweepProgress) -> str:
    """Return how far a sweep is, how fast it goes and what it takes yet."""
    text = f"{progress.done} of {progress.total} cases, {progress.rate:.0f} a second"
    left_s = progress.left_s
    return text if left_s is None else f"{text}, {quantity.duration(left_s)} left"
