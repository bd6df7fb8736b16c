"""A vehicle model for a pilot: what is in it, what is assumed, what it can do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.report.json import envelope, finding_document, json_text, value, values
from planner.report.text import printable, table_lines
from planner.service.endurance import RESERVE
from planner.values import field_names
from planner.vehicle.model import Basis

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.identify.refinement import Refinement
    from planner.report.text import Medium
    from planner.service.endurance import Endurance, LevelFlight, LoadedHover
    from planner.vehicle.model import ModelSpread

_BAR, _EIGHTHS = "\u2588", " \u258f\u258e\u258d\u258c\u258b\u258a\u2589"
_LONGEST_BAR, _SHORTEST_BAR = 30, 8
"""Columns of the longest bar beside a table; where a terminal has less room, there are none."""
_LOAD_HEADS = (("payload", "power", "hover"), ("kg", "W", ""))
_MODEL_KEYS = ("name", "kind", "reference", "description", "mass_kg", "source")
_HEADS = (("speed", "power", "per km", "endurance", "range"), ("m/s", "W", "Wh", "", ""))


_LIST_HEADS = (("model", "mass", "battery", "hover", "provenance"),)
_BASES = {
    Basis.IDENTIFIED: "identified",
    Basis.REFINED: "data sheet, narrowed by flights",
    Basis.ARTICLE: "article",
    Basis.DATA_SHEET: "data sheet",
    Basis.THEORY: "theory",
}


def models_text(listed: Sequence[Endurance], *, medium: Medium, describes: bool) -> str:
    """Return models as a table, with the description of each below where it is asked for."""
    rows = [*_LIST_HEADS, *map(_listed_row, listed)]
    lines = [
        medium.paint(line, "bold") if row == 0 else line
        for row, line in enumerate(table_lines(rows, alignment="<>>><"))
    ]
    if describes:
        for one in listed:
            described = f"{one.vehicle.name}: {printable(one.vehicle.description)}"
            lines += ["", *medium.wrapped(described, indent=2)]
    lines += [
        "",
        *medium.wrapped(
            "Hover in calm standard air at sea level, on a full battery down to a charge of "
            f"{quantity.percent(RESERVE)}. mavjoule vehicle show MODEL tells more of one."
        ),
    ]
    return "\n".join(lines) + "\n"


def _listed_row(one: Endurance) -> tuple[str, ...]:
    battery, hover = one.vehicle.battery, one.hover
    basis = one.vehicle.provenance.basis
    return (
        one.vehicle.name,
        quantity.mass(one.vehicle.mass_kg),
        quantity.energy(None if battery is None else battery.energy_wh),
        quantity.duration(None if hover is None else hover.endurance_s),
        quantity.ABSENT if basis is None else _BASES[basis],
    )


def models_json(listed: Sequence[Endurance], *, version: str) -> str:
    """Return the same as a JSON document."""
    models = [
        values(one.vehicle, _MODEL_KEYS)
        | {
            "battery_wh": None if one.vehicle.battery is None else one.vehicle.battery.energy_wh,
            "hover_time_s": None if one.hover is None else one.hover.endurance_s,
            "hover_power_w": None if one.hover is None else one.hover.power_w,
            "basis": one.vehicle.provenance.basis,
        }
        for one in listed
    ]
    return json_text(envelope(version) | {"models": models}, indent=2)


def endurance_text(shown: Endurance, *, medium: Medium) -> str:
    """Return a model as a pilot reads it: what flies, how long, how far, and what is assumed."""
    vehicle = shown.vehicle
    lines = [medium.paint(printable(vehicle.name), "bold")]
    lines += medium.wrapped(printable(vehicle.description))
    lines += ["", *(line for name, text in _facts(shown) for line in _fact(name, text, medium))]
    if shown.speeds:
        table = table_lines([*_HEADS, *map(_row, shown.speeds)], alignment=">>>>>")
        ranges = _bars([one.range_m for one in shown.speeds], table, medium)
        lines += ["", *_beside(table, ranges, len(_HEADS))]
    if shown.loads:
        table = table_lines([*_LOAD_HEADS, *map(_load_row, shown.loads)], alignment=">>>")
        times = _bars([one.flight.endurance_s for one in shown.loads], table, medium)
        lines += ["", *_beside(table, times, len(_LOAD_HEADS))]
    if shown.speeds:
        lines += medium.wrapped(
            f"Calm standard air at sea level, down to a charge of {quantity.percent(RESERVE)}."
        )
    readings = vehicle.provenance.readings
    if readings:
        lines += ["", medium.paint("Assumed, or to be known", "bold")]
        for reading in readings:
            lines += medium.wrapped(f"- {printable(reading)}", indent=2)
    return "\n".join(lines) + "\n"


def refinement_text(refined: Refinement, *, medium: Medium) -> str:
    """Return what flights told of a model: each factor before and after, and the hover it has now."""
    rows = [("", "before", "after", "changed by")] + [
        (
            one.label,
            f"± {quantity.percent(one.before)}",
            f"± {quantity.percent(one.after)}",
            quantity.signed(one.value - 1.0, quantity.percent),
        )
        for one in refined.power.factors
    ]
    flights = quantity.count(refined.power.flights, "flight")
    lines = [
        medium.paint(printable(refined.model.name), "bold"),
        *medium.wrapped(
            f"{flights}, {quantity.count(len(refined.power.steady), 'steady part')}: {_steady(refined)}"
        ),
        "",
        *table_lines(rows, alignment="<>>>"),
        "",
    ]
    limit_m_s, lean_deg = refined.model.airspeed_limit_m_s, refined.model.airspeed_limit_lean_deg
    if limit_m_s is not None and lean_deg is not None:
        lines += medium.wrapped(
            f"Airspeed held to {quantity.speed(limit_m_s)} at {quantity.decimals(lean_deg, 0)}° of lean."
        )
    for finding in refined.findings:
        lines += medium.wrapped(
            f"{finding.severity} {finding.code} {finding.name}: {printable(finding.message)}",
            indent=2,
        )
    spread = refined.model.spread
    if spread is not None:
        lines += medium.wrapped(f"Energy, standard deviations now: {_energy_off(spread)}.")
    return "\n".join(lines) + "\n"


_KINDS = {"cruise": "level", "climb": "climbing", "descend": "descending"}
"""States whose power errs alike, in words."""


def _energy_off(spread: ModelSpread) -> str:
    """Return how far energies may be off: of hover, and of the states that are off by more."""
    shared = spread.energy_fraction
    if shared is None:
        return quantity.percent(None)
    of_states = dict(spread.energy_state_fraction)
    beside = [
        f"{words} {quantity.percent(math.hypot(shared, of_states[state]))}"
        for state, words in _KINDS.items()
        if of_states.get(state)
    ]
    return ", ".join([f"{'hover ' if beside else ''}{quantity.percent(shared)}", *beside])


def refinement_json(refined: Refinement, *, version: str) -> str:
    """Return the same as a JSON document."""
    model, power = refined.model, refined.power
    document = envelope(version) | {
        "vehicle": {"name": value(model, "name"), "source": value(model, "source")},
        "n_flights": power.flights,
        "steady": [
            values(
                one,
                ("source", "power_w", "duration_s", "airspeed_m_s", "climb_rate_m_s", "mass_kg"),
            )
            | {"residual_w": residual_w}
            for one, residual_w in zip(power.steady, power.residuals_w.tolist(), strict=True)
        ],
        "factors": [
            {
                "name": one.name,
                "changed_by_fraction": one.value - 1.0,
                "before_fraction": one.before,
                "after_fraction": one.after,
            }
            for one in power.factors
        ],
        "birge_ratio": power.birge_ratio,
        "spread": None
        if model.spread is None
        else values(model.spread, ("time_fraction", "energy_fraction", "n_flights", "source")),
        "findings": [finding_document(one) for one in refined.findings],
    }
    return json_text(document, indent=2)


def _steady(refined: Refinement) -> str:
    speeds = [one.airspeed_m_s for one in refined.power.steady]
    climbs = [one.climb_rate_m_s for one in refined.power.steady]
    return (
        f"airspeeds {quantity.decimals(min(speeds), 1)} to {quantity.speed(max(speeds))}, "
        f"climb rates {quantity.decimals(min(climbs), 1)} to {quantity.speed(max(climbs))}"
    )


def endurance_json(shown: Endurance, *, version: str) -> str:
    """Return the same as a JSON document."""
    vehicle = shown.vehicle
    document = envelope(version) | {
        "vehicle": {"name": value(vehicle, "name"), "source": value(vehicle, "source")},
        "mass_kg": shown.mass_kg,
        "battery_wh": None if vehicle.battery is None else vehicle.battery.energy_wh,
        "reserve_fraction": RESERVE,
        "spread": None
        if vehicle.spread is None
        else values(vehicle.spread, ("time_fraction", "energy_fraction", "n_flights", "source")),
        "speeds": [_document(one) for one in shown.speeds],
        "loads": [{"payload_kg": one.payload_kg} | _document(one.flight) for one in shown.loads],
        "longest": None if shown.longest is None else _document(shown.longest),
        "farthest": None if shown.farthest is None else _document(shown.farthest),
        "provenance": values(vehicle.provenance, ("source", "method", "readings")),
    }
    return json_text(document, indent=2)


def _document(flight: LevelFlight) -> dict[str, object]:
    derived = {name: getattr(flight, name) for name in ("energy_wh_per_km", "range_m")}
    return values(flight, field_names(flight)) | derived


def _fact(name: str, text: str, medium: Medium) -> list[str]:
    return medium.wrapped(f"{name:<13}{text}", indent=13)


def _facts(shown: Endurance) -> Iterator[tuple[str, str]]:
    vehicle = shown.vehicle
    yield "mass", quantity.mass(shown.mass_kg)
    battery = vehicle.battery
    if battery is not None:
        cells = "" if battery.cells_in_series is None else f"{battery.cells_in_series} cells"
        parts = [quantity.energy(battery.energy_wh), cells, battery.chemistry or ""]
        yield "battery", ", ".join(filter(None, parts))
    else:
        yield "battery", "none in the model: give --battery with every check"
    yield "flown by", vehicle.reference.label
    if shown.hover is None:
        yield "power", "not identified: no energy is predicted, and no mission is a go"
    else:
        yield "hover", _with_time(shown.hover)
    if shown.longest is not None and shown.longest.speed_m_s > 0.0:
        at = quantity.speed(shown.longest.speed_m_s)
        yield "longest", f"{_with_time(shown.longest)} at {at}"
    if shown.farthest is not None and shown.farthest.range_m is not None:
        at = quantity.speed(shown.farthest.speed_m_s)
        yield "farthest", f"{quantity.distance(shown.farthest.range_m)} at {at}"
    if vehicle.spread is not None:
        energy, time = _energy_off(vehicle.spread), vehicle.spread.time_fraction
        yield (
            "spread",
            (
                f"energy {energy}; time {quantity.percent(time)} (standard deviations): "
                f"{vehicle.spread.source}"
            ),
        )
    limits = vehicle.valid_for.speed_m_s
    if limits is not None:
        yield "holds for", f"airspeeds up to {quantity.speed(limits.high)}"
    yield "made from", vehicle.provenance.source


def _with_time(flight: LevelFlight) -> str:
    power = quantity.power(flight.power_w)
    return (
        power if flight.endurance_s is None else f"{quantity.duration(flight.endurance_s)}, {power}"
    )


def _load_row(one: LoadedHover) -> tuple[str, ...]:
    return (
        quantity.decimals(one.payload_kg, 2),
        quantity.decimals(one.flight.power_w, 0),
        quantity.duration(one.flight.endurance_s),
    )


def _bars(lengths: Sequence[float | None], table: Sequence[str], medium: Medium) -> list[str]:
    """Return a bar for each number, in the room beside a table; nothing where there is no terminal."""
    room = 0 if medium.width is None else medium.width - max(map(len, table)) - 2
    longest = max((one for one in lengths if one is not None), default=0.0)
    if room < _SHORTEST_BAR or not longest > 0.0:
        return [""] * len(lengths)
    unit = 8 * min(room, _LONGEST_BAR) / longest
    bars = []
    for one in lengths:
        whole, rest = divmod(round(unit * (one or 0.0)), 8)
        bars.append((_BAR * whole + _EIGHTHS[rest]).rstrip())
    return bars


def _beside(table: Sequence[str], bars: Sequence[str], heads: int) -> list[str]:
    width = max(map(len, table))
    rows = zip(table[heads:], bars, strict=True)
    return [*table[:heads], *(f"{row:<{width}}  {bar}".rstrip() for row, bar in rows)]


def _row(flight: LevelFlight) -> tuple[str, ...]:
    return (
        quantity.decimals(flight.speed_m_s, 1),
        quantity.decimals(flight.power_w, 0),
        quantity.decimals(flight.energy_wh_per_km, 1),
        quantity.duration(flight.endurance_s),
        quantity.distance(flight.range_m),
    )
