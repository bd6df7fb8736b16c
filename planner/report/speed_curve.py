"""Energy and time of a mission over its speed, as text, JSON and CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.report.columns import columns_csv
from planner.report.json import (
    checks_document,
    envelope,
    finding_document,
    json_text,
    setup_document,
    value,
    values,
)
from planner.report.text import (
    example_remark,
    not_checked_text,
    printable,
    settings_lines,
    table_lines,
)
from planner.rules.wind import known_text
from planner.service.speed import MARKS, FlownSpeed
from planner.values import field_names

if TYPE_CHECKING:
    from planner.service.speed import SpeedCurve

_KEYS = field_names(FlownSpeed)[:-1]
_HEADS = (
    ("speed", "time", "energy", "per km", "mean", "above reserve", "verdict"),
    ("m/s", "", "Wh", "Wh", "W", "Wh", ""),
)
_WORTH_REPORTING = 0.01
_ALIGNMENT = ">>>>>><"


def speed_curve_text(curve: SpeedCurve) -> str:
    """Return the curve as a table and the speeds worth knowing as another."""
    vehicle = f"{printable(curve.vehicle_name)} ({printable(curve.vehicle_source)})"
    head = f"{printable(curve.file)} over the speed of its level legs, flown by {vehicle}"
    lines = [f"{head}{example_remark(curve.whole)}", *settings_lines(curve.whole.setup), ""]
    lines += table_lines([*_HEADS, *map(_row, curve.points)], alignment=_ALIGNMENT)
    marks = [(name, *_row(flown, digits=2)) for name, flown in curve.marks()]
    heads = (("", *head) for head in _HEADS)
    lines += ["", *table_lines([*heads, *marks], alignment=f"<{_ALIGNMENT}")]
    lines += ["", *(f"{line}." for line in _remarks(curve))]
    return "\n".join(lines) + "\n"


def speed_curve_json(curve: SpeedCurve, *, version: str) -> str:
    """Return the curve as a JSON document."""
    identified = curve.identified_m_s
    return json_text(
        envelope(version)
        | {
            "file": value(curve, "file"),
            "vehicle": {
                "name": value(curve, "vehicle_name"),
                "source": value(curve, "vehicle_source"),
            },
            **setup_document(curve.whole),
            "identified_m_s": None if identified is None else [identified.low, identified.high],
            "is_power_over_speed_known": curve.is_power_over_speed_known,
            "points": [_document(flown) for flown in curve.points],
            "marks": {
                name: None if (flown := getattr(curve, name)) is None else _document(flown)
                for name in MARKS
            },
            "marks_at_edge": list(curve.edges()),
            "checks": checks_document(curve.whole.checked),
            "findings": [finding_document(finding) for finding in curve.findings],
        },
        indent=2,
    )


def speed_curve_csv(curve: SpeedCurve) -> str:
    """Return the points of the curve as CSV, with the keys of the JSON as heads."""
    columns = {key: [getattr(flown, key) for flown in curve.points] for key in _KEYS}
    return columns_csv(columns | {"against": [" ".join(flown.against) for flown in curve.points]})


def _document(flown: FlownSpeed) -> dict[str, object]:
    return values(flown, _KEYS) | {"against": list(flown.against)}


def _row(flown: FlownSpeed, *, digits: int = 1) -> tuple[str, ...]:
    return (
        "several" if flown.speed_m_s is None else quantity.decimals(flown.speed_m_s, digits),
        quantity.duration(flown.time_s),
        quantity.decimals(flown.energy_wh, 2),
        quantity.decimals(flown.energy_wh_per_km, 2),
        quantity.decimals(flown.mean_power_w, 0),
        quantity.decimals(flown.margin_wh, 1),
        " ".join((flown.verdict_text, *flown.against)),
    )


def _remarks(curve: SpeedCurve) -> list[str]:
    """Return what has to be known to read the tables."""
    remarks: list[str] = []
    if not curve.is_power_over_speed_known:
        remarks.append(
            f"{curve.vehicle_name} has no airspeed term in its power: only the time changes, "
            "best endurance and best range are unknown"
        )
    elif (saved := _saved(curve)) is not None and curve.best_range is not None:
        speed = f"{quantity.decimals(curve.best_range.speed_m_s, 2)} m/s"
        fraction = quantity.percent(saved) if saved >= _WORTH_REPORTING else "less than 1 %"
        remarks.append(f"At {speed} the mission uses {fraction} less energy than at its own speeds")
    remarks += [_edge_remark(curve, name) for name in curve.edges()]
    if remark := not_checked_text(curve.whole.checked):
        remarks.append(remark)
    if curve.present.fits is None:
        remarks.append("Battery unknown: give --battery to see which speeds it allows")
    elif curve.fastest_fitting is None:
        remarks.append("No speed looked at is certain to fit the battery")
    elif curve.fastest_clear is None:
        remarks.append("No speed makes the mission a GO with room to the fence")
    if (identified := curve.identified_m_s) is not None:
        known = known_text(curve.whole.setup.vehicle)
        remarks.append(
            f"{known[0].upper()}{known[1:]} from {quantity.decimals(identified.low, 1)} to "
            f"{quantity.speed(identified.high)} through the air: E105 reports speeds outside"
        )
    else:
        remarks.append("The model does not state the speeds it holds for")
    return remarks


def _edge_remark(curve: SpeedCurve, name: str) -> str:
    """Return that a best speed is only the edge of the search, and whether the battery lasts there."""
    flown: FlownSpeed = getattr(curve, name)
    is_slowest = flown.speed_m_s == curve.points[0].speed_m_s
    limit = "slowest" if is_slowest else "fastest"
    option = "--from" if is_slowest else "--to"
    called = MARKS[name].capitalize()
    at = f"{quantity.decimals(flown.speed_m_s, 2)} m/s is the {limit} speed looked at ({option})"
    if name.startswith("fastest"):
        return f"{called}: {at}, a faster one may do as well"
    text = f"{called} is not found: {at}"
    if flown.fits is False:
        text += f", and the battery does not last for the {quantity.duration(flown.time_s)} there"
    return text


def _saved(curve: SpeedCurve) -> float | None:
    """Return the fraction of its energy that the mission would save at its best speed."""
    best, present = curve.best_range, curve.present
    if best is None or best.energy_wh is None or not present.energy_wh:
        return None
    return 1.0 - best.energy_wh / present.energy_wh
