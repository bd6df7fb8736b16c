"""The figures of a flight, declared once: place in the JSON report, label and how each is written."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from planner import quantity
from planner.rules.energy import destination_name
from planner.setup import conditions

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.report.json import Document


class Figure(NamedTuple):
    """A number of the JSON report, its label and how it is written."""

    path: str
    """Keys in the document of a mission, joined by a dot."""
    label: str
    text: Callable[[float | None], str]


class ShownFigure(NamedTuple):
    """A number as the page shows it."""

    label: str
    text: str
    path: str
    value: float | None


def _voltage(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{quantity.decimals(value, 1)} V"


def _rate(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{quantity.decimals(value, 1)} C"


def _degrees(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{quantity.decimals(value, 6)}°"


def _item(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"item {value:.0f}"


def _destination(value: float | None) -> str:
    return quantity.ABSENT if value is None else destination_name(int(value)).removeprefix("to ")


def _unformatted(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{value:g}"


def _of_point(point: str, label: str, *, known: tuple[str, ...] = ()) -> tuple[Figure, ...]:
    """Return the figures of a point of the flight, but those the JSON has under another key."""
    keys = (
        ("item", f"{label} from", _item),
        ("time_s", f"{label}, after", quantity.duration),
        ("along_m", f"{label}, along its leg", quantity.distance),
        ("leg_m", f"{label}, whole leg", quantity.distance),
        ("latitude_deg", f"{label}, latitude", _degrees),
        ("longitude_deg", f"{label}, longitude", _degrees),
    )
    return tuple(
        Figure(f"return.{point}_{key}", name, text)
        for key, name, text in keys
        if f"{point}_{key}" not in known
    )


FIGURES: tuple[tuple[str, tuple[Figure, ...]], ...] = (
    (
        "Flight",
        (
            Figure("totals.time_s", "Time", quantity.duration),
            Figure("totals.time_s_p10", "8 of 10 flights: from", quantity.duration),
            Figure("totals.time_s_p90", "8 of 10 flights: to", quantity.duration),
            Figure("totals.distance_m", "Distance", quantity.distance),
            Figure("totals.wander_m", "Extra path from position noise", quantity.distance),
            Figure("totals.climb_m", "Climb", quantity.height),
            Figure("totals.descent_m", "Descent", quantity.height),
        ),
    ),
    (
        "Energy",
        (
            Figure("totals.energy_wh", "Energy", quantity.energy),
            Figure("totals.energy_wh_p10", "8 of 10 flights: from", quantity.energy),
            Figure("totals.energy_wh_p90", "8 of 10 flights: to", quantity.energy),
            Figure("totals.charge_mah", "Charge", quantity.charge),
            Figure("totals.charge_mah_p10", "8 of 10 flights: from", quantity.charge),
            Figure("totals.charge_mah_p90", "8 of 10 flights: to", quantity.charge),
            Figure("totals.mean_power_w", "Mean power", quantity.power),
            Figure("totals.peak_power_w", "Peak power", quantity.power),
        ),
    ),
    (
        "Battery",
        (
            Figure("battery.capacity_wh", "Capacity", quantity.energy),
            Figure("battery.usable_wh", "Available at take-off", quantity.energy),
            Figure("battery.used_fraction", "Battery used", quantity.percent),
            Figure(
                "battery.reserve_fraction", "Reserve, fraction of the capacity", quantity.percent
            ),
            Figure("battery.reserve_wh", "Reserve", quantity.energy),
            Figure("battery.margin_wh", "Above the reserve", quantity.energy),
            Figure(
                "battery.below_reserve_probability", "Chance of landing below it", quantity.chance
            ),
            Figure("battery.hover_left_s", "Hover left at landing", quantity.duration),
            Figure("battery.charge_left_fraction", "Charge left", quantity.percent),
            Figure("battery.lowest_voltage_v", "Lowest voltage", _voltage),
            Figure("battery.highest_c_rate", "Highest discharge rate", _rate),
        ),
    ),
    (
        "Return",
        (
            Figure("return.tightest_item", "Tightest from", _item),
            *_of_point("tightest", "Tightest", known=("tightest_item",)),
            Figure("return.energy_home_wh", "Energy to return", quantity.energy),
            Figure("return.time_home_s", "Time to return", quantity.duration),
            Figure("return.margin_wh", "Return above the reserve", quantity.energy),
            Figure(
                "return.below_reserve_probability", "Chance of returning below it", quantity.chance
            ),
            Figure("return.destination", "Returns to", _destination),
            *_of_point("last_return", "Point of no return, reserve kept"),
            *_of_point("last_return_empty", "Point of no return, battery emptied"),
        ),
    ),
    (
        "Conditions",
        tuple(Figure(f"conditions.{row.key}", row.label, row.shown) for row, _ in conditions(None)),
    ),
)
"""The figures of a flight, in tables; those not known are left out."""

_BY_PATH = {figure.path: figure for _, members in FIGURES for figure in members}


def figures_at(*paths: str) -> tuple[Figure, ...]:
    """Return the figures at paths of keys."""
    return tuple(_BY_PATH[path] for path in paths)


KEY_FIGURES = figures_at(
    "totals.time_s",
    "totals.distance_m",
    "totals.energy_wh",
    "battery.used_fraction",
    "battery.margin_wh",
    "return.margin_wh",
)
"""What a pilot asks for first."""


_SPREAD = "_sd_"
"""In the key of a standard deviation: left out where it is zero."""


def shown_figures(document: Document) -> tuple[tuple[str, tuple[ShownFigure, ...]], ...]:
    """Return the tables of a mission's document, each with its title; empty ones are left out."""
    tables = [
        (
            title,
            tuple(shown for one in members if (shown := shown_figure(document, one)) is not None),
        )
        for title, members in (*FIGURES, ("More", _unlabelled(document)))
    ]
    return tuple((title, rows) for title, rows in tables if rows)


def _unlabelled(document: Document) -> tuple[Figure, ...]:
    """Return what the document knows and no table names: a key that is new has no label yet."""
    paths = [
        f"{section}.{key}"
        for section in ("totals", "battery", "return", "conditions")
        if isinstance(found := document[section], dict)
        for key in found
    ]
    return tuple(
        Figure(path, path.partition(".")[2], _unformatted) for path in paths if path not in _BY_PATH
    )


def shown_figure(document: Document, figure: Figure) -> ShownFigure | None:
    """Return a number of a mission's document; ``None`` where it is not known, or is no spread."""
    found = number_at(document, figure.path)
    if found is None or (found == 0.0 and _SPREAD in figure.path):
        return None
    return ShownFigure(figure.label, figure.text(found), figure.path, found)


def number_at(document: Document, path: str) -> float | None:
    """Return the number at a path of keys; ``None`` where there is none."""
    found: object = document
    for key in path.split("."):
        found = found.get(key) if isinstance(found, dict) else None
    return found if isinstance(found, int | float) else None
