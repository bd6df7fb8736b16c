"""The numbers of the page: each is one of the JSON report, under the same path, as text."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from planner import numbers
from planner.rules.energy import destination_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.report.json_document import Document


class Quantity(NamedTuple):
    """A number of the JSON report, and how it is told."""

    path: str
    """Keys in the document of a mission, joined by a dot."""
    label: str
    text: Callable[[float | None], str]


class Shown(NamedTuple):
    """A number as the page shows it."""

    label: str
    text: str
    path: str
    value: float | None


def _voltage(value: float | None) -> str:
    return numbers.ABSENT if value is None else f"{numbers.decimals(value, 1)} V"


def _rate(value: float | None) -> str:
    return numbers.ABSENT if value is None else f"{numbers.decimals(value, 1)} C"


def _degrees(value: float | None) -> str:
    return numbers.ABSENT if value is None else f"{numbers.decimals(value, 6)}°"


def _item(value: float | None) -> str:
    return numbers.ABSENT if value is None else f"item {value:.0f}"


def _destination(value: float | None) -> str:
    return numbers.ABSENT if value is None else destination_name(int(value))


def _plain(value: float | None) -> str:
    return numbers.ABSENT if value is None else f"{value:g}"


def _of_point(point: str, label: str, *, known: tuple[str, ...] = ()) -> tuple[Quantity, ...]:
    """Return what is told of a point of the flight; the contract calls some of it otherwise."""
    told = (
        ("item", f"{label} from", _item),
        ("time_s", f"{label}, after", numbers.duration),
        ("along_m", f"{label}, along its leg", numbers.distance),
        ("leg_m", f"{label}, whole leg", numbers.distance),
        ("latitude_deg", f"{label}, latitude", _degrees),
        ("longitude_deg", f"{label}, longitude", _degrees),
    )
    return tuple(
        Quantity(f"return.{point}_{key}", name, text)
        for key, name, text in told
        if f"{point}_{key}" not in known
    )


FIGURES: tuple[tuple[str, tuple[Quantity, ...]], ...] = (
    (
        "Flight",
        (
            Quantity("totals.time_s", "Time", numbers.duration),
            Quantity("totals.time_s_p10", "8 of 10 flights: from", numbers.duration),
            Quantity("totals.time_s_p90", "8 of 10 flights: to", numbers.duration),
            Quantity("totals.distance_m", "Distance", numbers.distance),
            Quantity("totals.wander_m", "of it wandered", numbers.distance),
            Quantity("totals.climb_m", "Climb", numbers.height),
            Quantity("totals.descent_m", "Descent", numbers.height),
        ),
    ),
    (
        "Energy",
        (
            Quantity("totals.energy_wh", "Energy", numbers.energy),
            Quantity("totals.energy_wh_p10", "8 of 10 flights: from", numbers.energy),
            Quantity("totals.energy_wh_p90", "8 of 10 flights: to", numbers.energy),
            Quantity("totals.charge_mah", "Charge", numbers.charge),
            Quantity("totals.charge_mah_p10", "8 of 10 flights: from", numbers.charge),
            Quantity("totals.charge_mah_p90", "8 of 10 flights: to", numbers.charge),
            Quantity("totals.mean_power_w", "Mean power", numbers.power),
            Quantity("totals.peak_power_w", "Peak power", numbers.power),
        ),
    ),
    (
        "Battery",
        (
            Quantity("battery.capacity_wh", "Full", numbers.energy),
            Quantity("battery.usable_wh", "At the start", numbers.energy),
            Quantity("battery.used_fraction", "Used", numbers.percent),
            Quantity("battery.reserve_fraction", "Reserve, share of it", numbers.percent),
            Quantity("battery.reserve_wh", "Reserve", numbers.energy),
            Quantity("battery.margin_wh", "Left above the reserve", numbers.energy),
            Quantity(
                "battery.below_reserve_probability", "Chance to land below it", numbers.chance
            ),
            Quantity("battery.hover_left_s", "Hover left at landing", numbers.duration),
            Quantity("battery.charge_left_fraction", "Charge left", numbers.percent),
            Quantity("battery.lowest_voltage_v", "Lowest voltage", _voltage),
            Quantity("battery.highest_c_rate", "Highest discharge rate", _rate),
        ),
    ),
    (
        "Way home",
        (
            Quantity("return.tightest_item", "Tightest from", _item),
            *_of_point("tightest", "Tightest", known=("tightest_item",)),
            Quantity("return.energy_home_wh", "Energy to get home", numbers.energy),
            Quantity("return.time_home_s", "Time to get home", numbers.duration),
            Quantity("return.margin_wh", "Left above the reserve", numbers.energy),
            Quantity(
                "return.below_reserve_probability", "Chance to get home below it", numbers.chance
            ),
            Quantity("return.destination", "Leads", _destination),
            *_of_point("last_return", "Last return"),
            *_of_point("last_return_empty", "Last return at all"),
        ),
    ),
    (
        "Conditions",
        (
            Quantity("conditions.wind_m_s", "Wind", numbers.speed),
            Quantity("conditions.wind_sd_m_s", "Wind, give or take", numbers.speed),
            Quantity("conditions.wind_from_deg", "Wind from", numbers.bearing),
            Quantity("conditions.wind_from_sd_deg", "Wind from, give or take [°]", _plain),
            Quantity("conditions.wind_reference_height_m", "Wind given at", numbers.height),
            Quantity("conditions.wind_shear_exponent", "Exponent of the wind's growth", _plain),
            Quantity("conditions.wind_roughness_length_m", "Roughness length [m]", _plain),
            Quantity("conditions.home_amsl_m", "Home above sea level", numbers.height),
            Quantity("conditions.temperature_c", "Air at home", numbers.temperature),
            Quantity(
                "conditions.temperature_sd_c", "Air at home, give or take", numbers.temperature
            ),
            Quantity("conditions.payload_kg", "Payload", numbers.mass),
            Quantity("conditions.payload_sd_kg", "Payload, give or take", numbers.mass),
            Quantity("conditions.position_noise_m", "Position noise [m]", _plain),
            Quantity("conditions.reaction_time_s", "Reaction time", numbers.duration),
            Quantity("conditions.position_error_m", "Position error", numbers.height),
            Quantity("conditions.battery_health", "Battery health", numbers.percent),
            Quantity("conditions.battery_resistance_factor", "Battery resistance factor", _plain),
            Quantity("conditions.battery_temperature_c", "Battery", numbers.temperature),
        ),
    ),
)
"""What the page tells of a mission, in tables; what is not known is left out."""

_SPREAD = "_sd_"
"""In the name of a standard deviation, of which none is told by leaving it out."""

SEGMENT_DIGITS = {
    "start_s": 1,
    "duration_s": 1,
    "distance_m": 1,
    "climb_m": 1,
    "speed_m_s": 1,
    "energy_wh": 3,
    "stopping_distance_m": 1,
    "stopping_distance_m_p90": 1,
    "arrival_s": 1,
    "energy_used_wh": 3,
}
"""Decimals of the columns of long tables, whose heads name the unit."""


def shown_figures(document: Document) -> tuple[tuple[str, tuple[Shown, ...]], ...]:
    """Return the tables of a mission's document, each with its title; empty ones are left out."""
    tables = [
        (
            title,
            tuple(shown for one in members if (shown := shown_number(document, one)) is not None),
        )
        for title, members in (*FIGURES, ("More", _untold(document)))
    ]
    return tuple((title, rows) for title, rows in tables if rows)


def _untold(document: Document) -> tuple[Quantity, ...]:
    """Return what the document knows and no table names: a key that is new has no words yet."""
    told = {one.path for _, members in FIGURES for one in members}
    paths = [
        f"{section}.{key}"
        for section in ("totals", "battery", "return", "conditions")
        if isinstance(found := document[section], dict)
        for key in found
    ]
    return tuple(
        Quantity(path, path.partition(".")[2], _plain) for path in paths if path not in told
    )


def shown_number(document: Document, quantity: Quantity) -> Shown | None:
    """Return a number of a mission's document; ``None`` where it is not known, or is no spread."""
    found = number_at(document, quantity.path)
    if found is None or (found == 0.0 and _SPREAD in quantity.path):
        return None
    return Shown(quantity.label, quantity.text(found), quantity.path, found)


def number_at(document: Document, path: str) -> float | None:
    """Return the number at a path of keys; ``None`` where there is none."""
    found: object = document
    for key in path.split("."):
        found = found.get(key) if isinstance(found, dict) else None
    return found if isinstance(found, int | float) else None
