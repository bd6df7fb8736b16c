r"""Open-circuit voltage over charge and internal resistance, from voltage, current and charge.

.. math:: V_t = E(s_t) - R\, I_t, \qquad s_t = s_0 - Q_t / C,

with E linear between knots and rising with the state of charge s: linear least squares with bounds.
Slow recovery of the cells is not modelled; it is noise with a memory here, and the error of R counts
it as such.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from planner import quantity
from planner.errors import IdentificationError
from planner.findings import Rule, Severity
from planner.identify.segments import SegmentUse, StateOutcome
from planner.identify.uncertainty import (
    Estimate,
    Noise,
    fit_noise,
    least_squares_covariance,
    rounded,
)
from planner.units import SECONDS_PER_HOUR
from planner.values import Value, replace
from planner.vehicle.battery import Battery
from planner.vehicle.pack import ASSUMED_CHEMISTRY, LITHIUM_ION
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.identify.log_table import LogConditions
    from planner.logs.record import FlightRecord


KNOTS = 6
"""Points of the curve over the charge that was used."""
_LEAST_CURRENT_VARIATION = 0.02
"""Of the mean current, beside what goes with the charge: less shows no resistance. [-]"""
_LEAST_RISE_V = 1e-3
"""Between two knots: a curve must rise. [V]"""


class BatteryFit(Value):
    """What one or more discharges show of a battery."""

    ocv_soc: tuple[float, ...]
    """States of charge within what was used, rising. [-]"""
    ocv_v: tuple[float, ...]
    """Open-circuit voltage at each, rising. [V]"""
    ocv_error_v: tuple[float, ...]
    """Standard error of each. [V]"""
    internal_resistance_ohm: Estimate
    """Of the whole battery. [Ω]"""
    noise: Noise
    """What was left over. [V]"""


def fit_battery(
    voltage_v: npt.ArrayLike,
    current_a: npt.ArrayLike,
    charge_used_ah: npt.ArrayLike,
    *,
    capacity_ah: float,
    knots: int = KNOTS,
) -> BatteryFit:
    """Fit open-circuit voltage and internal resistance to one discharge.

    Voltage under load, current, and charge taken since the battery was full [Ah] are evenly
    sampled. The curve covers the charge that was used, no more.

    Raises IdentificationError if too little charge was used, more than the battery holds, or the
    current hardly varies.
    """
    from scipy.optimize import lsq_linear

    voltage = np.asarray(voltage_v, dtype=np.float64)
    current = np.asarray(current_a, dtype=np.float64)
    soc = 1.0 - np.asarray(charge_used_ah, dtype=np.float64) / capacity_ah
    low, high = float(soc.min()), float(soc.max())
    if low < 0.0:
        msg = f"more charge was used than {capacity_ah:g} Ah hold: the capacity or the current is wrong"
        raise IdentificationError(msg)
    if high - low < 0.02 or voltage.size < 10 * knots:
        msg = f"only {high - low:.1%} of the charge was used: too little for a curve over charge"
        raise IdentificationError(msg)
    at = np.linspace(low, high, knots)
    spacing = at[1] - at[0]
    # columns: voltage at the lowest knot, then the rise over each interval
    rises = np.clip((soc[:, None] - at[:-1]) / spacing, 0.0, 1.0)
    curve = np.concatenate([np.ones((soc.size, 1)), rises], axis=1)
    explained = curve @ np.linalg.lstsq(curve, current)[0]
    if np.std(current - explained) < _LEAST_CURRENT_VARIATION * np.abs(current).mean():
        msg = "the current hardly varies: fly climbs or stops to measure the internal resistance"
        raise IdentificationError(msg)
    design = np.concatenate([curve, -current[:, None]], axis=1)
    bounds = ([-np.inf, *[_LEAST_RISE_V] * (knots - 1), 0.0], np.full(knots + 1, np.inf))
    found = np.asarray(lsq_linear(design, voltage, bounds=bounds).x)
    noise = fit_noise([voltage - design @ found], parameters=found.size)
    covariance = least_squares_covariance([(1.0, design, noise)])
    to_knots = np.tril(np.ones((knots, knots)))
    of_knots = to_knots @ covariance[:knots, :knots] @ to_knots.T
    return BatteryFit(
        ocv_soc=tuple(at.tolist()),
        ocv_v=tuple((to_knots @ found[:knots]).tolist()),
        ocv_error_v=tuple(np.sqrt(np.diagonal(of_knots)).tolist()),
        internal_resistance_ohm=Estimate(
            name="internal_resistance_ohm",
            value=float(found[-1]),
            error=float(np.sqrt(covariance[-1, -1])),
        ),
        noise=noise,
    )


CAPACITY_PARAMETERS = ("BATT_CAPACITY", "BAT1_CAPACITY", "BAT_CAPACITY")
"""Where ArduPilot and PX4 keep the charge of the full battery. [mAh]"""
_CELL_PARAMETERS = ("BAT1_N_CELLS", "BAT_N_CELLS")
_SAME_CHARGE = 0.01
"""States of charge that are one point of a curve. [-]"""
_NOT_FULL = 0.98
"""Voltage at the start, over the highest of all flights, below which a battery was not full. [-]"""
_FULL_CELL_V = (4.0, 4.4)
"""What a cell has at the start of a flight that began full: 4.05 V of PX4's, 4.35 V of high voltage. [V]"""
_LEAST_CELL_V = 3.55
"""Below it a cell has a tenth of its charge, with which nobody begins a flight. [V]"""
_CELL_COUNTS = (*range(1, 9), 10, 12, 14)
"""Cells in series of batteries that multicopters fly."""
_ROUNDING_AH = 5e-4
"""A capacity is a whole number of mAh."""
_THINNED_S = 0.5
"""Samples taken for the fit: the noise has a memory, more of them add nothing. [s]"""


class PackSettings(Value):
    """What no log holds about a battery."""

    capacity_ah: float | None = None
    """Charge of the full battery; left out, as in the autopilot's parameters. [Ah]"""
    cells_in_series: int | None = None
    chemistry: str | None = None
    """Kind of cell whose open-circuit curve is scaled to the flights."""


class BatteryIdentification(Value):
    """What the discharges show."""

    battery: Battery | None
    outcome: StateOutcome
    fit: BatteryFit | None = None
    readings: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


CAPACITY_OF_FIRMWARE = Rule(
    "I112 capacity-of-firmware",
    Severity.WARNING,
    summary="The capacity of the battery is the one that ArduPilot begins with.",
    why="BATT_CAPACITY is 3300 mAh until somebody sets it.  Of a battery of another capacity the curve over "
    "its charge is as wrong, and with it what a voltage at the start, a reserve and a failsafe by voltage "
    "mean.",
    how="BATT_CAPACITY of the logs is 3300 mAh, and neither --capacity nor levels before and after the "
    "flights are given.",
    fix="give --capacity with the charge on the battery's label",
)


NOT_FULL_AT_START = Rule(
    "I113 not-full-at-start",
    Severity.WARNING,
    summary="No flight began with a full battery.",
    why="A charge is read off the voltage at rest by the curve of the flights.  Where the highest voltage "
    "they began with counts as full, half a battery is planned as a whole one.",
    how="The highest voltage at the start of a flight, over the number of cells (--cells, BAT1_N_CELLS, "
    "else 1 to 8, 10, 12 or 14), is not from 4.0 to 4.4 V, and no level is given: the charge there is taken "
    "to be that of a resting cell, of the kind of cell with the lower one where none is given.",
    fix="log a flight from a full battery, or give the levels before and after the flights in a table",
)


class ChargeAtStart(Value):
    """The charge of a battery at the highest voltage that flights began with."""

    charge: float
    """[-]"""
    cells: int
    cell_v: float

    @classmethod
    def of(cls, highest_v: float, cells: int | None, kind: str | None) -> ChargeAtStart | None:
        """Return a charge that is not full; ``None``: it is, or may be."""
        from planner.vehicle.reader import load_chemistry

        counts = _CELL_COUNTS if cells is None else (cells,)
        low_v, high_v = _FULL_CELL_V
        if any(low_v <= highest_v / count <= high_v for count in counts):
            return None
        begun = [count for count in counts if _LEAST_CELL_V <= highest_v / count < low_v]
        if not begun:
            return None
        cell_v = highest_v / begun[0]
        kinds = (ASSUMED_CHEMISTRY, LITHIUM_ION) if kind is None else (kind,)
        curves = map(load_chemistry, kinds)
        charge = min(float(np.interp(cell_v, one.cell_ocv_v, one.ocv_soc)) for one in curves)
        return cls(charge=charge, cells=begun[0], cell_v=cell_v)

    @property
    def finding(self) -> Finding:
        """That no flight began full, and what is assumed."""
        return NOT_FULL_AT_START.finding(
            f"no flight began with a full battery: {quantity.decimals(self.cell_v, 2)} V a cell of "
            f"{self.cells} are taken for {quantity.percent(self.charge)} of the charge"
        )


def _start_reading(charge: float) -> str:
    began = "a full battery" if charge == 1.0 else f"{charge:.0%} of the charge"
    return f"Every flight that began within 2 % of the highest voltage began with {began}."


def capacity_set_ah(record: FlightRecord) -> float | None:
    """Return the capacity that somebody set in the autopilot of a flight; ``None``: nobody did. [Ah]"""
    found_ah = _parameter([record], CAPACITY_PARAMETERS, 1e-3)
    return None if _of_firmware([record]) else found_ah


def _of_firmware(records: Sequence[FlightRecord]) -> tuple[Finding, ...]:
    """Return the finding of a capacity that nobody set."""
    begins_ah = ArduPilotParameters().battery_capacity_ah
    found_ah = _parameter(records, CAPACITY_PARAMETERS[:1], 1e-3)
    if found_ah is None or abs(found_ah - begins_ah) > _ROUNDING_AH:
        return ()
    message = (
        f"battery of {quantity.charge_of_ah(found_ah)}: BATT_CAPACITY as ArduPilot begins with it"
    )
    return (CAPACITY_OF_FIRMWARE.finding(message),)


def charge_used_ah(record: FlightRecord) -> FloatArray:
    """Return the charge drawn since the beginning of a flight, (n,) [Ah]."""
    current_a = np.nan_to_num(record.current_a)  # a gap draws nothing that is known
    between = 0.5 * (current_a[1:] + current_a[:-1]) * np.diff(record.time_s)
    return np.concatenate(([0.0], np.cumsum(between))) / SECONDS_PER_HOUR


_LEAST_LEVELS = 5
"""Flights with levels, under which levels in whole percent say next to nothing of a capacity."""


def capacity_of_levels(drops: Sequence[float], charges_ah: Sequence[float]) -> Estimate | None:
    """Return the charge of the full battery, from what its level fell by and the charge drawn meanwhile.

    The median of the slopes between all pairs of flights whose charges are a quarter of their range apart
    (Theil 1950, Sen 1968): what each flight draws outside its log lowers all levels alike.  Its error is
    that of the median of as many slopes as there are flights, by their absolute deviation.

    ``None`` for too few flights, or levels that do not fall with the charge.  [Ah]
    """
    if len(drops) < _LEAST_LEVELS:
        return None
    one, other = np.triu_indices(len(drops), 1)
    apart_ah = np.subtract(*np.array(charges_ah)[[other, one]])
    far = np.abs(apart_ah) > 0.25 * np.ptp(charges_ah)
    slopes = np.subtract(*np.array(drops)[[other, one]])[far] / apart_ah[far]
    slope = float(np.median(slopes)) if slopes.size else 0.0
    if not slope > 0.0:
        return None
    # of a normal variable the median errs by 1.2533 σ / √n, and its absolute deviation is 0.6745 σ
    deviation = float(np.median(np.abs(slopes - slope))) / 0.6745
    error = 1.2533 * deviation / np.sqrt(len(drops)) / slope**2
    return Estimate(name="capacity_ah", value=1.0 / slope, error=float(error))


def _of_each_battery(noted: Sequence[tuple[float, float, str | None]]) -> Iterator[Estimate]:
    """Yield the capacity of each battery that has a name and flights enough."""
    for name in sorted({name for *_, name in noted if name is not None}):
        drops, charges_ah = zip(*((d, ah) for d, ah, own in noted if own == name), strict=True)
        if (found := capacity_of_levels(drops, charges_ah)) is not None:
            yield replace(found, name=f"capacity_ah of {name}")


def _levels(conditions: Sequence[LogConditions]) -> list[tuple[float, float] | None]:
    """Return the levels of the battery before and after each flight, where they were noted. [-]"""
    return [
        None
        if own.level_start_percent is None or own.level_end_percent is None
        else (0.01 * own.level_start_percent, 0.01 * own.level_end_percent)
        for own in conditions
    ]


def identify_battery(
    records: Sequence[FlightRecord],
    settings: PackSettings,
    conditions: Sequence[LogConditions] = (),
) -> BatteryIdentification:
    """Identify capacity, open-circuit curve and resistance, as far as the flights show them.

    Where the levels of the battery before and after the flights are known, they give the capacity; with
    that of the new battery in the settings, what is left of it.
    """
    from planner.vehicle.reader import load_chemistry

    levels = _levels(conditions) if conditions else [None] * len(records)
    segments = _discharges(records, levels)
    names = [own.battery for own in conditions] or [None] * len(records)
    used = [
        (record, level, name)
        for record, level, name, segment in zip(records, levels, names, segments, strict=True)
        if segment.is_used
    ]
    if not used:
        return _nothing("no flight has voltage and current", segments)
    noted = [
        (lv[0] - lv[1], float(charge_used_ah(r)[-1]), name)
        for r, lv, name in used
        if lv is not None
    ]
    measured = capacity_of_levels([drop for drop, *_ in noted], [ah for _, ah, _ in noted])
    of_levels = () if measured is None else (measured, *_of_each_battery(noted))
    new_ah = settings.capacity_ah or _parameter(records, CAPACITY_PARAMETERS, 1e-3)
    capacity_ah = new_ah if measured is None else rounded(measured.value, 3)
    if capacity_ah is None:
        return _nothing("battery capacity unknown: give --capacity", segments)
    cells = (
        settings.cells_in_series or round(_parameter(records, _CELL_PARAMETERS, 1.0) or 0) or None
    )
    thin = [
        slice(None, None, max(1, round(_THINNED_S / (r.time_s[1] - r.time_s[0])))) for r, *_ in used
    ]
    start = ChargeAtStart.of(_highest_v(records), cells, settings.chemistry)
    begun = 1.0 if start is None else start.charge
    before_ah = [(1.0 - (begun if lv is None else lv[0])) * capacity_ah for _, lv, _ in used]
    columns = [
        np.stack([r.voltage_v, r.current_a, charge_used_ah(r) + before])[:, t]
        for (r, *_), t, before in zip(used, thin, before_ah, strict=True)
    ]
    voltage, current, charge = (
        np.concatenate([c[i, np.isfinite(c).all(axis=0)] for c in columns]) for i in range(3)
    )
    try:
        fit = fit_battery(voltage, current, charge, capacity_ah=capacity_ah)
    except IdentificationError as error:
        return _nothing(str(error), segments)
    of_voltage: dict[str, Any]
    capacity = [] if measured is None else [_capacity_reading(measured, new_ah, len(noted))]
    if settings.chemistry is not None and cells is not None:
        # V = k E(s) - R I with the curve E of the kind of cell, by linear least squares
        cell = load_chemistry(settings.chemistry)
        ocv_soc, curve_v = cell.ocv_soc, cells * np.array(cell.cell_ocv_v)
        open_v = np.interp(1.0 - charge / capacity_ah, ocv_soc, curve_v)
        design = np.stack([open_v, -current], axis=-1)
        found = np.linalg.lstsq(design, voltage)[0]
        left = voltage - design @ found
        noise = fit_noise([left], parameters=2)
        errors = np.sqrt(np.diagonal(least_squares_covariance([(1.0, design, noise)]))).tolist()
        scale, resistance_ohm = float(found[0]), max(float(found[1]), 0.0)
        low = 1.0 - float(charge.max()) / capacity_ah
        rms = float(np.sqrt(np.mean(left**2)))
        ocv_v = tuple(round(float(v), 3) for v in scale * curve_v)
        of_voltage = {"ocv_soc": ocv_soc, "ocv_v": ocv_v}
        estimates: tuple[Estimate, ...] = (
            Estimate(name="internal_resistance_ohm", value=resistance_ohm, error=errors[1]),
            Estimate(name="voltage_scale", value=scale, error=errors[0]),
        )
        summary = (
            f"{cells} {settings.chemistry} cells with the voltage times {scale:.4f}, "
            f"{resistance_ohm * 1e3:.0f} mohm; used down to {low:.0%}"
        )
        readings: tuple[str, ...] = (
            (
                f"The open-circuit curve has the shape of {settings.chemistry} cells, scaled to the "
                f"flights, which used the charge down to {low:.0%}; below that only the shape is known."
            ),
            _start_reading(begun),
            "No cut-off voltage is known: the battery counts as empty at the end of its curve.",
        )
    else:
        estimates, rms = (fit.internal_resistance_ohm,), fit.noise.deviation
        resistance_ohm = estimates[0].value
        (ocv_soc, ocv_v), kind = _continued(fit, settings.chemistry)
        of_voltage, low = {"ocv_soc": ocv_soc, "ocv_v": ocv_v}, fit.ocv_soc[0]
        summary = (
            f"{resistance_ohm * 1e3:.0f} mohm, {fit.ocv_v[0]:.1f} V to {fit.ocv_v[-1]:.1f} V open-circuit; "
            f"used down to {low:.0%}"
        )
        readings = (
            (
                f"The open-circuit voltage is known down to {low:.0%} of the charge only; below that it is "
                f"taken to fall as that of {kind} cells: name the kind of cell and the number of them."
            ),
            _start_reading(begun),
            "No cut-off voltage is known: the battery counts as empty at the end of its curve.",
        )
    not_shown = () if resistance_ohm > estimates[0].error else ("internal_resistance_ohm",)
    return BatteryIdentification(
        battery=Battery(
            capacity_ah=rounded(new_ah or capacity_ah),
            health=None if new_ah is None or measured is None else _health(measured, new_ah),
            cells_in_series=cells,
            internal_resistance_ohm=None if not_shown else rounded(resistance_ohm, 4),
            **of_voltage,
        ),
        outcome=StateOutcome(
            name="battery",
            summary=f"{capacity_ah:g} Ah, {summary}",
            unit="V",
            estimates=(*estimates, *of_levels),
            segments=segments,
            rms=rms,
            not_shown=not_shown,
        ),
        fit=fit,
        readings=(*capacity, *readings),
        findings=(
            *(_of_firmware(records) if settings.capacity_ah is None and measured is None else ()),
            *(() if start is None or None not in [lv for _, lv, _ in used] else (start.finding,)),
        ),
    )


def _continued(
    fit: BatteryFit, kind: str | None
) -> tuple[tuple[tuple[float, ...], tuple[float, ...]], str]:
    """Return the curve over all of the charge, and the kind of cell it goes on as beyond what was used.

    Of kinds that are possible that which holds least.  Held at the mean of what was used, the upper half of
    a discharge promises 6 % too much: flown so, planned to 95 %, a vehicle fell.
    """
    kinds = (ASSUMED_CHEMISTRY, LITHIUM_ION) if kind is None else (kind,)
    curves = [(_continued_as(fit, one), one) for one in kinds]
    return min(curves, key=lambda one: float(np.trapezoid(one[0][1], one[0][0])))


def _continued_as(fit: BatteryFit, kind: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return states of charge and open-circuit voltages that go on as those of a kind of cell. [-], [V]"""
    from planner.vehicle.reader import load_chemistry

    cell, low, high = load_chemistry(kind), fit.ocv_soc[0], fit.ocv_soc[-1]
    soc = np.array(cell.ocv_soc)
    cell_v = np.array(cell.cell_ocv_v)
    low_v, high_v = np.interp((low, high), soc, cell_v)
    below, above = soc < low - _SAME_CHARGE, soc > high + _SAME_CHARGE
    used = np.array(fit.ocv_soc)
    # All of the charge has a curve, to its very ends.
    used[0], used[-1] = low if below.any() else 0.0, high if above.any() else 1.0
    voltage_v = np.concatenate(
        (fit.ocv_v[0] / low_v * cell_v[below], fit.ocv_v, fit.ocv_v[-1] / high_v * cell_v[above])
    )
    of_charge = np.concatenate((soc[below], used, soc[above]))
    return tuple(of_charge.round(4).tolist()), tuple(voltage_v.round(4).tolist())


def _capacity_reading(measured: Estimate, new_ah: float | None, flights: int) -> str:
    what = "the capacity is that" if new_ah is None else "what is left of the new battery is"
    return (
        f"{what[0].upper()}{what[1:]} by the levels noted before and after {flights} flights: "
        f"{measured.value:.3g} ± {measured.error:.2g} Ah."
    )


def _health(measured: Estimate, new_ah: float) -> float:
    return min(round(measured.value / new_ah, 3), 1.0)


def _discharges(
    records: Sequence[FlightRecord], levels: Sequence[tuple[float, float] | None]
) -> tuple[SegmentUse, ...]:
    first_v = [_first_known(r.voltage_v) for r in records]
    highest = _highest_v(records)
    rows = []
    for record, volts, level in zip(records, first_v, levels, strict=True):
        refusal = ""
        if volts is None:
            refusal = "no voltage"
        elif not np.isfinite(record.current_a).any():
            refusal = "no current"
        elif level is None and volts < _NOT_FULL * highest:
            refusal = f"began with less than {_NOT_FULL:.0%} of the highest voltage: not full"
        rows.append(SegmentUse.within(record, what="discharge", refusal=refusal))
    return tuple(rows)


def _highest_v(records: Sequence[FlightRecord]) -> float:
    """Return the highest voltage that a flight began with. [V]"""
    first_v = (_first_known(r.voltage_v) for r in records)
    return max((v for v in first_v if v is not None), default=0.0)


def _first_known(column: FloatArray) -> float | None:
    known = column[np.isfinite(column)]
    return float(known[0]) if known.size else None


def _parameter(
    records: Sequence[FlightRecord], names: Sequence[str], factor: float
) -> float | None:
    """Return a parameter that is positive and the same in all logs that have it."""
    values = {r.parameters[name] for r in records for name in names if name in r.parameters}
    value = factor * values.pop() if len(values) == 1 else 0.0
    return value if value > 0.0 else None


def _nothing(why: str, segments: tuple[SegmentUse, ...]) -> BatteryIdentification:
    return BatteryIdentification(
        battery=None, outcome=StateOutcome.left_out("battery", why, segments)
    )
