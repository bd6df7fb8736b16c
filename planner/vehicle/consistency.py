"""What must hold between the keys of one table of a model file.

Each function sees a table whose values are right alone, and yields (key, problem).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    Problems = Iterator[tuple[str, str]]

_STEADY_GAIN_TOLERANCE = 0.05
"""How far the steady value of a motion model may be from its command. [-]"""
_CAPACITY_TOLERANCE = 0.02
"""How far capacity_wh may be from capacity_ah times nominal_voltage_v: rounding on a label. [-]"""
_UNDAMPED_TOLERANCE = 1e-9
"""Real part over magnitude up to which a pole counts as lying on the imaginary axis. [-]"""


def _response_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what makes numerator and denominator no usable transfer function."""
    numerator, denominator = raw["numerator"], raw["denominator"]
    if denominator[0] == 0.0:
        yield "denominator", "must not begin with 0: that is the highest power of s"
        return
    if len(np.trim_zeros(numerator, "f")) > len(denominator):
        yield "numerator", "has a higher power of s than the denominator: improper"
        return
    damping = _least_damping(denominator)
    if damping is None:
        yield "denominator", "has coefficients too far apart to find its roots"
    # a power model is used over its window only, so it may ring; a motion model may not
    elif damping < (-_UNDAMPED_TOLERANCE if "window_s" in raw else _UNDAMPED_TOLERANCE):
        yield "denominator", "is unstable: a root of it is not left of the imaginary axis"
    if raw["input_gain"] == 0.0:
        yield "input_gain", "must not be 0"
    for name in ("numerator", "denominator"):
        if f"{name}_standard_error" in raw:
            yield from _length_problems(raw, name, f"{name}_standard_error")


def _least_damping(denominator: Sequence[float]) -> float | None:
    """Return the least -Re(p)/|p| of all poles; ``None`` where they overflow."""
    with np.errstate(all="ignore"):  # what overflows is told by not being finite
        scaled = np.asarray(denominator, dtype=np.float64) / denominator[0]
        if not np.isfinite(scaled).all():
            return None
        poles = np.roots(scaled)
        damping = -poles.real / np.maximum(np.abs(poles), np.finfo(np.float64).tiny)
    return float(damping.min()) if np.isfinite(damping).all() else None


def motion_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with a response that describes motion: it must settle on its command."""
    problems = list(_response_problems(raw))
    yield from problems
    if not problems:
        gain = raw["input_gain"] * raw["numerator"][-1] / raw["denominator"][-1]
        if not abs(gain - 1.0) <= _STEADY_GAIN_TOLERANCE:
            problem = (
                f"makes a command of 1 end at {gain:.4g}: input_gain x numerator / denominator at "
                f"s = 0 must be 1 within {_STEADY_GAIN_TOLERANCE:.0%}"
            )
            yield "input_gain", problem


def power_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with a response that describes power: it is used over a window only."""
    yield from _response_problems(raw)
    if not raw["window_s"] > raw["delay_s"]:
        yield "window_s", "must be longer than delay_s: it counts from the command"


def cruise_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong between the lists of a cruise table."""
    yield from _curve_problems(raw, "speed_m_s")


def vertical_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong between the lists of a table over climb rate."""
    yield from _curve_problems(raw, "climb_rate_m_s")


def _curve_problems(raw: Mapping[str, Any], rates: str) -> Problems:
    """Yield what is wrong with a curve of power above hover: it is none at rest."""
    powers = "power_above_hover_w"
    problems = list(_length_problems(raw, rates, powers))
    yield from problems
    for rate, power_w in () if problems else zip(raw[rates], raw[powers], strict=True):
        if rate == 0.0 and power_w != 0.0:
            yield powers, f"must be 0 where {rates} is 0, got {power_w:g}: at rest it is hover"


def momentum_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong between the factors of momentum theory."""
    if raw["induced_factor"] + raw["profile_factor"] < 1.0:
        yield "induced_factor", "and profile_factor are less than 1 together: better than ideal"


def polynomial_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with a polynomial of power over speed."""
    if not raw["coefficients"][-1] > 0.0:
        yield "coefficients", "must end with hover power, greater than 0"


def _length_problems(raw: Mapping[str, Any], first: str, second: str) -> Problems:
    if len(raw[first]) != len(raw[second]):
        yield (
            second,
            f"has {quantity.count(len(raw[second]), 'value')}, {first} has {len(raw[first])}",
        )


def battery_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what does not fit together in a battery; its chemistry has been looked up before."""
    yield from _capacity_problems(raw)
    yield from _pair_problems(raw, "internal_resistance_ohm", "cell_resistance_ohm")
    for cell in ("chemistry", "cell_resistance_ohm"):
        if cell in raw and "cells_in_series" not in raw:
            yield "cells_in_series", f"is missing: {cell} needs it"
    yield from _together_problems(raw, "resistance_temperature_c", "resistance_factor")
    if not {"ocv_soc", "ocv_v"} & set(raw):
        return
    problems = list(_together_problems(raw, "ocv_soc", "ocv_v"))
    yield from problems or _open_circuit_problems(raw, "ocv_soc")
    if "ocv_v" in raw and raw.get("cutoff_voltage_v", 0.0) >= raw["ocv_v"][-1]:
        yield "cutoff_voltage_v", "must be below the voltage of the full battery"


def _capacity_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with charge, energy and nominal voltage."""
    yield from _pair_problems(raw, "capacity_ah", "cell_capacity_ah")
    charge_ah = raw.get("capacity_ah")
    if charge_ah is None and "cell_capacity_ah" in raw:
        charge_ah = raw["cell_capacity_ah"] * raw.get("cells_in_parallel", 1)
    if charge_ah is None and "capacity_wh" not in raw:
        yield "capacity_ah", "is missing, and capacity_wh as well: give at least one"
    elif charge_ah is not None and not {"capacity_wh", "nominal_voltage_v", "ocv_v"} & set(raw):
        yield "nominal_voltage_v", "is missing: a charge alone is no energy"
    elif charge_ah is not None and {"capacity_wh", "nominal_voltage_v"} <= set(raw):
        product_wh = charge_ah * raw["nominal_voltage_v"]
        if not math.isclose(raw["capacity_wh"], product_wh, rel_tol=_CAPACITY_TOLERANCE):
            yield "capacity_wh", f"is not capacity_ah x nominal_voltage_v = {product_wh:g} Wh"
    if "ocv_v" in raw and charge_ah is None and "nominal_voltage_v" not in raw:
        yield "capacity_ah", "is missing: an open-circuit curve runs over the charge"


def chemistry_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what does not fit together in a kind of cell."""
    problems = list(_length_problems(raw, "ocv_soc", "cell_ocv_v"))
    yield from problems or _open_circuit_problems(raw, "ocv_soc")
    yield from _together_problems(raw, "resistance_temperature_c", "resistance_factor")


def _open_circuit_problems(raw: Mapping[str, Any], soc: str) -> Problems:
    if raw[soc][0] != 0.0 or raw[soc][-1] != 1.0:
        yield soc, "must run from 0 to 1: nothing is extrapolated"


def _pair_problems(raw: Mapping[str, Any], whole: str, cell: str) -> Problems:
    """Yield the problem where a battery is described twice."""
    if whole in raw and cell in raw:
        yield cell, f"is given and {whole} as well: give one"


def _together_problems(raw: Mapping[str, Any], first: str, second: str) -> Problems:
    """Yield what is wrong with two lists of which neither means anything alone."""
    if (first in raw) != (second in raw):
        missing, present = (second, first) if first in raw else (first, second)
        yield missing, f"is missing: {present} is given"
    elif first in raw:
        yield from _length_problems(raw, first, second)


def validity_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with the box of validity."""
    if not raw:
        yield "*", "is empty: say at least for which speeds and heights the model holds"


def log_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with the list of logs."""
    logs, hashes = raw.get("logs", ()), raw.get("logs_sha256", ())
    if hashes and len(hashes) != len(logs):
        yield "logs_sha256", f"has {quantity.count(len(hashes), 'value')}, logs has {len(logs)}"
    if any(len(entry) != 64 or set(entry) - set("0123456789abcdef") for entry in hashes):
        yield "logs_sha256", "must hold 64 lower-case hexadecimal digits for each log"


def reference_problems(
    reference: Autopilot,
    *,
    has_altitude_response: bool,
    has_speed_response: bool,
    has_ramps: bool,
    has_default_speed: bool,
    has_parameters: bool,
) -> Problems:
    """Yield (dotted key, problem) for what a way of commanding needs or has no use for."""
    if reference is Autopilot.STEP:
        why = 'is missing: reference = "step" needs it'
        if not has_altitude_response and not has_ramps:
            yield "responses.altitude", why
        if not has_speed_response and not has_ramps:
            yield "responses.speed", why
        if has_ramps and (has_altitude_response or has_speed_response):
            yield "ramps", "has no meaning beside responses of altitude or speed: give one of both"
        if not has_default_speed:
            yield "speed.default_m_s", why
        if has_parameters:
            yield "parameters", 'has no meaning with reference = "step": no autopilot reads them'
        return
    if has_ramps:
        yield "ramps", f'has no meaning with reference = "{reference}": the autopilot has its own'
    if has_default_speed:
        problem = (
            f'has no meaning with reference = "{reference}": the speed is an autopilot parameter, '
            "give it under [parameters]"
        )
        yield "speed", problem


def power_problems_together(
    *,
    is_hover_of_cruise: bool,
    is_hover_known: bool,
    is_cruise_whole: bool,
    is_cruise_known: bool,
    has_vertical: bool,
) -> Problems:
    """Yield (dotted key, problem) where hover, cruise and climb do not fit together.

    A cruise law is whole where it gives all the power, hover and climb included.
    """
    if is_hover_of_cruise and not is_cruise_whole:
        problem = (
            "is of-cruise, but the [cruise] of this file is no law that knows hover: "
            "momentum, liu or di-franco-buttazzo"
        )
        yield "hover.law", problem
    if not is_hover_known and (is_cruise_known or has_vertical):
        yield (
            "hover.law",
            "is not-given: then [cruise] must be not-given as well, and [vertical] left out",
        )
    if is_cruise_whole and has_vertical:
        yield "vertical", "has no meaning here: the [cruise] law of this file knows the climb"


def mass_problems(*, needing: Sequence[str], has_mass: bool) -> Problems:
    """Yield (dotted key, problem) where laws need a mass that is not there."""
    if needing and not has_mass:
        yield "mass_kg", f"is missing: {' and '.join(needing)} needs the mass that flies"
