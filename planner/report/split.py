"""A mission split into flights that fit, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.figures import figures_at, number_at
from planner.report.json import (
    checks_document,
    envelope,
    figures,
    finding_document,
    json_text,
    setup_document,
    value,
    values,
)
from planner.report.text import (
    example_remark,
    finding_lines,
    not_checked_text,
    printable,
    settings_lines,
    table_lines,
)

if TYPE_CHECKING:
    from planner.report.json import Document
    from planner.report.text import Medium
    from planner.service.split import Split, SplitPart

_AT_START_M = 0.05
"""A leg taken up nearer to its beginning than this is flown from its beginning on. [m]"""
_SHOWN = figures_at("totals.time_s", "totals.energy_wh", "battery.margin_wh", "return.margin_wh")
_PART_KEYS = (
    "file",
    "first_item",
    "last_item",
    "begins_m",
    "ends_m",
    "flown_twice_m",
    "first_own_item",
    "last_own_item",
)


def split_text(split: Split, *, medium: Medium) -> str:
    """Return a line for each part, and what is other than in the mission."""
    flights = flights_text(split, energy=quantity.energy(split.whole.totals.energy_wh))
    lines = [flights, *settings_lines(split.whole.setup), ""]
    heads = ("", "file", "flies", *(one.label.lower() for one in _SHOWN))
    rows = [_row(part) for part in split.parts]
    lines += table_lines([heads, *rows], alignment="<<<>>>>")
    time_s, energy_wh = together(split).values()
    lines += ["", f"together {quantity.duration(time_s)} and {quantity.energy(energy_wh)}"]
    if split.findings:
        lines.append("")
    for finding in split.findings:
        lines += finding_lines(finding, file=split.file, medium=medium)
    remarks: dict[str, list[str]] = {}
    for part in split.parts:
        remark = not_checked_text(part.result.checked)
        remarks.setdefault(remark, []).append(printable(part.file))
    for remark, files in remarks.items():
        names = "every part" if len(files) == len(split.parts) else ", ".join(files)
        lines += medium.wrapped(f"{names}: {remark}", indent=4) if remark else []
    return "\n".join(lines) + "\n"


def split_json(split: Split, *, version: str) -> str:
    """Return the parts as a JSON document."""
    return json_text(
        envelope(version)
        | {
            "file": value(split, "file"),
            **setup_document(split.whole),
            "together": together(split),
            "whole": {"verdict": split.whole.verdict, **figures(split.whole)},
            "parts": [
                part_document(part)
                | {"findings": [finding_document(finding) for finding in part.result.findings]}
                for part in split.parts
            ],
            "findings": [finding_document(finding) for finding in split.findings],
        },
        indent=2,
    )


def part_document(part: SplitPart) -> Document:
    """Return the figures of a part, as the keys of the JSON."""
    return values(part, _PART_KEYS) | {
        "verdict": part.result.verdict,
        **figures(part.result),
        "checks": checks_document(part.result.checked),
    }


def together(split: Split) -> dict[str, float]:
    """Return the time and the energy of all parts together, as the keys of the JSON."""
    totals = [part.result.totals for part in split.parts]
    return {
        "time_s": sum(one.time_s for one in totals),
        "energy_wh": sum(one.energy_wh for one in totals),
    }


def flights_text(split: Split, *, energy: str = "") -> str:
    """Return how many flights a mission became: ``site.plan: 3 flights instead of one of 24 Wh``."""
    of = f" of {energy}" if energy else ""
    count = len(split.parts)
    flights = f"one flight{of} is enough" if count == 1 else f"{count} flights instead of one{of}"
    return f"{printable(split.file)}: {flights}{example_remark(split.whole)}"


def _row(part: SplitPart) -> tuple[str, ...]:
    document = figures(part.result)
    numbers = (one.text(number_at(document, one.path)) for one in _SHOWN)
    return (part.result.verdict_text, printable(part.file), flown_text(part), *numbers)


def flown_text(part: SplitPart) -> str:
    """Return which items of the mission a part flies: ``items 7 (from 120 m) to 9``."""
    from_start = part.begins_m is None or part.begins_m < _AT_START_M
    begins = "" if from_start else f" (from {quantity.distance(part.begins_m)})"
    ends = "" if part.ends_m is None else f" (up to {quantity.distance(part.ends_m)})"
    if part.first_item == part.last_item:
        return f"item {part.first_item}{begins}{ends}"
    return f"items {part.first_item}{begins} to {part.last_item}{ends}"
