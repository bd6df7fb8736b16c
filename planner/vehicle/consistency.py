"""What must hold between the keys of one table of a model file.

Each function sees a table whose values are right alone, and yields (key, problem).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

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
    yield from _length_problems(raw, "speed_m_s", "power_above_hover_w")


def vertical_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong between the lists of a table over climb rate."""
    yield from _length_problems(raw, "climb_rate_m_s", "power_above_hover_w")


def _length_problems(raw: Mapping[str, Any], first: str, second: str) -> Problems:
    if len(raw[first]) != len(raw[second]):
        yield second, f"has {len(raw[second])} values, {first} has {len(raw[first])}"


def battery_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what does not fit together in a battery."""
    given = {"capacity_ah", "capacity_wh", "nominal_voltage_v"} & set(raw)
    if not given & {"capacity_ah", "capacity_wh"}:
        yield "capacity_ah", "is missing, and capacity_wh as well: give at least one"
    elif given == {"capacity_ah"}:
        yield "nominal_voltage_v", "is missing: capacity_ah alone is no energy"
    elif len(given) == 3:
        product_wh = raw["capacity_ah"] * raw["nominal_voltage_v"]
        if not math.isclose(raw["capacity_wh"], product_wh, rel_tol=_CAPACITY_TOLERANCE):
            yield "capacity_wh", f"is not capacity_ah x nominal_voltage_v = {product_wh:g} Wh"
    if ("ocv_soc" in raw) != ("ocv_v" in raw):
        missing, present = ("ocv_v", "ocv_soc") if "ocv_soc" in raw else ("ocv_soc", "ocv_v")
        yield missing, f"is missing: {present} is given"
    elif "ocv_soc" in raw:
        yield from _length_problems(raw, "ocv_soc", "ocv_v")
        if raw["ocv_soc"][0] != 0.0 or raw["ocv_soc"][-1] != 1.0:
            yield "ocv_soc", "must run from 0 to 1: nothing is extrapolated"
        if raw.get("cutoff_voltage_v", 0.0) >= raw["ocv_v"][-1]:
            yield "cutoff_voltage_v", "must be below the voltage of the full battery"


def validity_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with the box of validity."""
    if not raw:
        yield "*", "is empty: say at least for which speeds and heights the model holds"


def log_problems(raw: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with the list of logs."""
    logs, hashes = raw.get("logs", ()), raw.get("logs_sha256", ())
    if hashes and len(hashes) != len(logs):
        yield "logs_sha256", f"has {len(hashes)} values, logs has {len(logs)}"
    if any(len(entry) != 64 or set(entry) - set("0123456789abcdef") for entry in hashes):
        yield "logs_sha256", "must hold 64 lower-case hexadecimal digits for each log"


def reference_problems(
    reference: Autopilot,
    *,
    has_altitude_response: bool,
    has_speed_response: bool,
    has_default_speed: bool,
    has_parameters: bool,
) -> Problems:
    """Yield (dotted key, problem) for what a way of commanding needs or has no use for."""
    if reference is Autopilot.STEP:
        why = 'is missing: reference = "step" needs it'
        if not has_altitude_response:
            yield "responses.altitude", why
        if not has_speed_response:
            yield "responses.speed", why
        if not has_default_speed:
            yield "speed.default_m_s", why
        if has_parameters:
            yield "parameters", 'has no meaning with reference = "step": no autopilot reads them'
    elif has_default_speed:
        problem = (
            f'has no meaning with reference = "{reference}": the speed is an autopilot parameter, '
            "give it under [parameters]"
        )
        yield "speed", problem


def mass_problems(*, has_density_law: bool, has_mass: bool) -> Problems:
    """Yield (dotted key, problem) where a hover law needs a mass that is not there."""
    if has_density_law and not has_mass:
        yield "mass_kg", 'is missing: law = "density" needs the mass that flies'
