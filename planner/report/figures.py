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


def _number(digits: int, unit: str) -> Callable[[float | None], str]:
    return lambda value: (
        quantity.ABSENT if value is None else f"{quantity.decimals(value, digits)}{unit}"
    )


def _item(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"item {value:.0f}"


def _destination(value: float | None) -> str:
    return quantity.ABSENT if value is None else destination_name(int(value)).removeprefix("to ")


def _unformatted(value: float | None) -> str:
    return quantity.ABSENT if value is None else f"{value:g}"


_Row = tuple[str, str, "Callable[[float | None], str]"]
"""Key, label and how the number is written."""


def _of_point(point: str, label: str) -> tuple[_Row, ...]:
    """Return the figures of a point of the flight."""
    return (
        (f"{point}_item", f"{label} from", _item),
        (f"{point}_time_s", f"{label}, after", quantity.duration),
        (f"{point}_along_m", f"{label}, along its leg", quantity.distance),
        (f"{point}_leg_m", f"{label}, whole leg", quantity.distance),
        (f"{point}_latitude_deg", f"{label}, latitude", _number(6, "°")),
        (f"{point}_longitude_deg", f"{label}, longitude", _number(6, "°")),
    )


_TABLES: dict[tuple[str, str], tuple[_Row, ...]] = {
    ("Flight", "totals"): (
        ("time_s", "Time", quantity.duration),
        ("time_s_p10", "8 of 10 flights: from", quantity.duration),
        ("time_s_p90", "8 of 10 flights: to", quantity.duration),
        ("distance_m", "Distance", quantity.distance),
        ("wander_m", "Extra path beside the legs", quantity.distance),
        ("climb_m", "Climb", quantity.height),
        ("descent_m", "Descent", quantity.height),
    ),
    ("Energy", "totals"): (
        ("energy_wh", "Energy", quantity.energy),
        ("energy_wh_p10", "8 of 10 flights: from", quantity.energy),
        ("energy_wh_p90", "8 of 10 flights: to", quantity.energy),
        ("charge_mah", "Charge", quantity.charge),
        ("charge_mah_p10", "8 of 10 flights: from", quantity.charge),
        ("charge_mah_p90", "8 of 10 flights: to", quantity.charge),
        ("mean_power_w", "Mean power", quantity.power),
        ("peak_power_w", "Peak power", quantity.power),
    ),
    ("Battery", "battery"): (
        ("capacity_wh", "Capacity", quantity.energy),
        ("usable_wh", "Available at take-off", quantity.energy),
        ("used_fraction", "Battery used", quantity.percent),
        ("reserve_fraction", "Reserve, fraction of the capacity", quantity.percent),
        ("reserve_wh", "Reserve", quantity.energy),
        ("margin_wh", "Above the reserve", quantity.energy),
        ("below_reserve_probability", "Chance of landing below it", quantity.chance),
        ("empty_probability", "Chance of landing with none left", quantity.chance),
        ("hover_left_s", "Hover left at the end", quantity.duration),
        ("charge_left_fraction", "Charge left", quantity.charge_left),
        ("lowest_voltage_v", "Lowest voltage", _number(1, " V")),
        ("highest_c_rate", "Highest discharge rate", _number(1, " C")),
    ),
    ("Return", "return"): (
        *_of_point("tightest", "Tightest"),
        ("energy_home_wh", "Energy to return", quantity.energy),
        ("time_home_s", "Time to return", quantity.duration),
        ("margin_wh", "Return above the reserve", quantity.energy),
        ("below_reserve_probability", "Chance of returning below it", quantity.chance),
        ("empty_probability", "Chance of returning with none left", quantity.chance),
        ("destination", "Returns to", _destination),
        *_of_point("last_return", "Point of no return, reserve kept"),
        *_of_point("last_return_empty", "Point of no return, battery emptied"),
    ),
    ("Conditions", "conditions"): tuple(
        (row.key, row.label, row.shown) for row, _ in conditions(None)
    ),
}
FIGURES: tuple[tuple[str, tuple[Figure, ...]], ...] = tuple(
    (title, tuple(Figure(f"{section}.{key}", label, text) for key, label, text in rows))
    for (title, section), rows in _TABLES.items()
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
        (title, tuple(filter(None, (shown_figure(document, one) for one in members))))
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
