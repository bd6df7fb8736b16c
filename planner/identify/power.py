"""Power of a vehicle from its flights: one law of everything, tables, or means over manoeuvres."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import IdentificationError
from planner.identify.power_laws import (
    LEAST_AIRSPEEDS,
    LOWEST_HEIGHT_M,
    HoverFit,
    SteadyMap,
    cell_of,
    fit_altitude_law,
    fit_cruise_curve,
    fit_density_law,
    fit_steady_map,
    mean_powers_w,
)
from planner.identify.ramps import timed_flight
from planner.identify.segments import (
    MeasuredPower,
    SegmentUse,
    StateOutcome,
    flown_parts,
    speed_through_air_m_s,
)
from planner.identify.uncertainty import Estimate, rounded, told_fit_percent
from planner.physics.rotor import Rotor
from planner.values import Value, field_values, replace
from planner.vehicle.power import (
    AltitudeLaw,
    CruisePower,
    DensityLaw,
    MomentumLaw,
    VerticalPower,
    WholeLaw,
    hover_power_w,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.identify.ramps import TimedChange
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import Loads, VehicleModel
    from planner.vehicle.power import CruiseLaw, HoverLaw


_EVERY = 4
"""Of as many steady flights of one cell the last is held out from the fit that is tested."""
_MOVING_M_S = 1.0
_CLIMBING_M_S = 0.3


class PowerIdentification(Value, eq=False):
    """What the steady flight shows of the power."""

    hover: HoverLaw | None = None
    cruise: CruiseLaw | None = None
    vertical: VerticalPower | None = None
    loads: Loads | None = None
    outcomes: tuple[StateOutcome, ...] = ()
    steady_map: SteadyMap | None = None
    readings: tuple[str, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether there is any power."""
        return self.hover is not None or self.cruise is not None


def identify_power(
    steady: Sequence[MeasuredPower],
    *,
    refusals: Sequence[SegmentUse] = (),
    mass_deviation_kg: float = 0.0,
    is_wind_known: bool = False,
) -> PowerIdentification:
    """Identify the steady power by momentum theory, else by tables.

    ``mass_deviation_kg`` is the standard deviation of a mass that is not known from flight to
    flight; ``is_wind_known`` says that speeds through the air are known, not those over ground alone.
    """
    if not steady:
        why = refusals[0].refusal if refusals else "no flight is steady for 3 s"
        return PowerIdentification(outcomes=(StateOutcome.left_out("hover", why, refusals),))
    hovers = [f for f in steady if cell_of(f) == (0, 0)]
    # in a wind nothing is at rest: then two airspeeds have to do, for tables begin at a hover; speeds over
    # ground, of ways with the wind, are none: two of them gave a law by which a go fell
    least = 2 if is_wind_known and not hovers else LEAST_AIRSPEEDS
    try:
        return _by_momentum_theory(steady, tuple(refusals), mass_deviation_kg, least=least)
    except IdentificationError as error:
        return _by_tables(steady, hovers, tuple(refusals), str(error))


def _by_momentum_theory(
    steady: Sequence[MeasuredPower],
    refusals: tuple[SegmentUse, ...],
    mass_deviation_kg: float,
    *,
    least: int,
) -> PowerIdentification:
    fitted = fit_steady_map(steady, mass_deviation_kg=mass_deviation_kg, least=least)
    is_held = _held_out(steady)
    held = [f for f, h in zip(steady, is_held, strict=True) if h]
    tested = fitted
    if held:
        try:
            tested = fit_steady_map(
                [f for f, h in zip(steady, is_held, strict=True) if not h],
                mass_deviation_kg=mass_deviation_kg,
                least=least,
            )
        except IdentificationError:
            held = []
    judged = held or list(steady)
    measured = np.array([f.power_w for f in judged])
    errors = tested.residuals_w(judged)
    unknown = ", ".join(fitted.from_prior)
    doubt = f"; not shown by the flights: {unknown}" if unknown else ""
    if mass_deviation_kg > 0.0:
        doubt = f", the mass of each flight not known to {mass_deviation_kg:g} kg{doubt}"
    outcome = StateOutcome(
        name="steady power",
        summary=(
            "momentum theory over airspeed, climb rate and air density, "
            f"{quantity.count(len(steady), 'steady span')} in "
            f"{quantity.count(fitted.cells, 'cell')}{doubt}"
        ),
        unit="W",
        estimates=fitted.estimates,
        segments=(*refusals, *_segments(steady, is_held)),
        fit_percent=told_fit_percent(measured, measured + errors),
        rms=float(np.sqrt(np.mean(errors**2))),
        not_shown=fitted.from_prior,
    )
    masses = {f.mass_kg for f in steady}
    readings = [
        (
            "Disk area and factors are effective values that reproduce the power, not measurements "
            "of the rotors; factors are electrical watts for each watt of the ideal disk."
        ),
        "The load of the avionics is contained in the power: the logs do not separate it.",
    ]
    if len(masses) == 1:
        readings.append(
            "All flights have one mass: another one is extrapolated by momentum theory."
        )
    if unknown:
        readings.append(
            f"The flights do not show {unknown}: held at what is usual for multirotors."
        )
    return PowerIdentification(
        cruise=fitted.law, outcomes=(outcome,), steady_map=fitted, readings=tuple(readings)
    )


def _by_tables(
    steady: Sequence[MeasuredPower],
    hovers: Sequence[MeasuredPower],
    refusals: tuple[SegmentUse, ...],
    why: str,
) -> PowerIdentification:
    """Hover law, table over airspeed and table over climb rate, each where the flights have it."""
    if not hovers:
        left_out = StateOutcome.left_out("hover", "no flight hovers", refusals)
        return PowerIdentification(outcomes=(left_out,))
    hover, hover_outcome, readings = identify_hover(hovers, refusals)
    moving = [f for f in steady if f.airspeed_m_s >= _MOVING_M_S]
    level = [f for f in moving if abs(f.climb_rate_m_s) < _CLIMBING_M_S]
    vertical = [
        f for f in steady if f.airspeed_m_s < _MOVING_M_S and abs(f.climb_rate_m_s) >= _CLIMBING_M_S
    ]
    cruise_law, cruise_outcome = identify_cruise(level, hover_powers_w(hover, level))
    vertical_law, vertical_outcome = _climbs(
        list(zip(vertical, hover_powers_w(hover, vertical), strict=True))
    )
    return PowerIdentification(
        hover=hover,
        cruise=cruise_law,
        vertical=vertical_law,
        outcomes=(hover_outcome, cruise_outcome, vertical_outcome),
        readings=(*readings, f"No law of power over mass, speed and climb together: {why}."),
    )


def identify_hover(
    hovers: Sequence[MeasuredPower], refusals: tuple[SegmentUse, ...] = ()
) -> tuple[HoverLaw, StateOutcome, tuple[str, ...]]:
    """Fit hover power over mass and density where they are known, else over height.

    Returns the law, how it was found, and what was decided.
    """
    powers = np.array([h.power_w for h in hovers])
    count = quantity.count(len(hovers), "hover")
    readings: tuple[str, ...] = ()
    has_mass = all(h.mass_kg is not None and h.air_density_kg_m3 is not None for h in hovers)
    summary = f"{'over mass and air density' if has_mass else 'P = K H^z'}, from {count}"
    try:
        fit: HoverFit[AltitudeLaw] | HoverFit[DensityLaw] = (
            fit_density_law(hovers) if has_mass else fit_altitude_law(hovers)
        )
        if fit.exponents_from_theory:
            names = ", ".join(fit.exponents_from_theory)
            readings = (f"The hovers do not show {names}: of momentum theory.",)
    except IdentificationError:
        if has_mass:
            raise
        fit, summary = _constant_hover(hovers), f"constant, from {count} at one height"
        readings = ("All hovers are at one height: hover power is taken to be constant.",)
    predicted = np.array(hover_powers_w(fit.law, hovers))
    outcome = StateOutcome(
        name="hover",
        summary=summary,
        unit="W",
        estimates=fit.estimates,
        segments=(*refusals, *_segments(hovers, _held_out(hovers))),
        rms=float(np.sqrt(np.mean((predicted - powers) ** 2))),
        not_shown=fit.exponents_from_theory,
    )
    return fit.law, outcome, readings


def _constant_hover(hovers: Sequence[MeasuredPower]) -> HoverFit[AltitudeLaw]:
    weights = np.array([h.duration_s for h in hovers])
    power_w = float(np.average([h.power_w for h in hovers], weights=weights))
    error_w = float(np.sqrt(np.sum((weights * [h.error_w for h in hovers]) ** 2)) / weights.sum())
    return HoverFit(
        law=AltitudeLaw(
            coefficient_w=rounded(power_w), exponent=0.0, lowest_height_m=LOWEST_HEIGHT_M
        ),
        estimates=(Estimate(name="coefficient_w", value=power_w, error=error_w),),
    )


def hover_powers_w(law: HoverLaw, flights: Sequence[MeasuredPower]) -> list[float]:
    """Return hover power at the height, mass and density of each flight. [W]"""
    return [
        float(
            hover_power_w(
                law,
                height_above_home_m=f.height_above_home_m,
                mass_kg=f.mass_kg,
                air_density_kg_m3=f.air_density_kg_m3 or 0.0,
            )
        )
        for f in flights
    ]


def predicted_powers_w(
    model: PowerIdentification | VehicleModel, flights: Sequence[MeasuredPower]
) -> FloatArray | None:
    """Return the power predicted for flights, each with its own mass and air; ``None``: it has none. [W]"""
    avionics_w = 0.0 if model.loads is None else model.loads.avionics_w
    if isinstance(model.cruise, MomentumLaw):
        return avionics_w + mean_powers_w(Rotor(**field_values(model.cruise)), flights)
    if model.hover is None or isinstance(model.cruise, WholeLaw):
        return None
    total = avionics_w + np.array(hover_powers_w(model.hover, flights))
    if isinstance(model.cruise, CruisePower):
        total += model.cruise.above_hover_w(np.array([one.airspeed_m_s for one in flights]))
    if model.vertical is not None:
        total += model.vertical.above_hover_w(np.array([one.climb_rate_m_s for one in flights]))
    return total


def identify_cruise(
    cruises: Sequence[MeasuredPower], hover_powers_w: Sequence[float]
) -> tuple[CruisePower | None, StateOutcome]:
    """Fit a table of cruise power above hover over airspeed.

    ``hover_powers_w`` are at the height, mass and density of each. Returns the table, if there is
    one, and how it was found, or why not.
    """
    segments = _segments(cruises)
    try:
        curve = fit_cruise_curve(cruises, hover_powers_w)
    except IdentificationError as error:
        return None, StateOutcome.left_out("cruise", str(error), segments)
    law = CruisePower(
        speed_m_s=tuple(round(v, 3) for v in curve.speed_m_s),
        power_above_hover_w=tuple(round(p, 3) for p in curve.power_above_hover_w),
    )
    return law, StateOutcome(
        name="cruise",
        summary=(
            f"table over {quantity.count(len(curve.speed_m_s) - 1, 'airspeed')}, from "
            f"{quantity.count(len(cruises), 'cruise')}"
        ),
        unit="W",
        estimates=tuple(
            Estimate(name=f"above hover at {speed:.1f} m/s", value=power, error=error)
            for speed, power, error in zip(
                curve.speed_m_s[1:], curve.power_above_hover_w[1:], curve.error_w[1:], strict=True
            )
        ),
        segments=segments,
        rms=curve.smoothing_w,
    )


def _climbs(
    flights: Sequence[tuple[MeasuredPower, float]],
) -> tuple[VerticalPower | None, StateOutcome]:
    """Return a table of power above hover over climb rate: the mean of each cell."""
    if not flights:
        return None, StateOutcome.left_out("vertical", "no steady climb or descent")
    cells: dict[int, list[tuple[MeasuredPower, float]]] = {}
    for flight, hover_w in flights:
        cells.setdefault(cell_of(flight)[1], []).append((flight, hover_w))
    cells.pop(0, None)
    rows = [(0.0, 0.0, 0.0)]
    for own in cells.values():
        weights = np.array([f.duration_s for f, _ in own])
        rate = float(np.average([f.climb_rate_m_s for f, _ in own], weights=weights))
        above = np.array([f.power_w - w for f, w in own])
        mean = float(np.average(above, weights=weights))
        error = float(np.mean([f.error_w for f, _ in own]) / np.sqrt(len(own)))
        if len(own) > 1:
            error = max(error, float(above.std(ddof=1) / np.sqrt(len(own))))
        rows.append((rate, mean, error))
    rows.sort()
    law = VerticalPower(
        climb_rate_m_s=tuple(round(rate, 3) for rate, _, _ in rows),
        power_above_hover_w=tuple(round(power, 3) for _, power, _ in rows),
    )
    return law, StateOutcome(
        name="vertical",
        summary=(
            f"table over {quantity.count(len(rows) - 1, 'climb rate')}, from {len(flights)} climbs and "
            "descents"
        ),
        unit="W",
        estimates=tuple(
            Estimate(name=f"above hover at {rate:+.1f} m/s", value=power, error=error)
            for rate, power, error in rows
            if rate != 0.0
        ),
        segments=_segments([f for f, _ in flights]),
    )


def _held_out(flights: Sequence[MeasuredPower]) -> list[bool]:
    """Hold out every fourth span of a cell; of all, where hardly a cell was flown so often."""
    seen: Counter[tuple[int, int]] = Counter()
    held = []
    for cell in map(cell_of, flights):
        seen[cell] += 1
        held.append(seen[cell] % _EVERY == 0)
    if sum(held) * 10 < len(held):
        return [(number + 1) % _EVERY == 0 for number in range(len(flights))]
    return held


def _segments(
    flights: Sequence[MeasuredPower], is_held_out: Sequence[bool] = ()
) -> tuple[SegmentUse, ...]:
    return tuple(
        SegmentUse(
            log=flight.source.rpartition("#")[0],
            flight=int(flight.source.rpartition("#")[2] or 0),
            start_s=flight.start_s,
            duration_s=flight.duration_s,
            what=f"{flight.airspeed_m_s:.1f} m/s level, {flight.climb_rate_m_s:+.1f} m/s up",
            is_held_out=is_held,
        )
        for flight, is_held in zip(flights, is_held_out or [False] * len(flights), strict=True)
    )


_CLIMBED = 0.95
"""Fraction of a climb after which it slows down. [-]"""
_LEAST_LEGS = 4
_KNOTS = 5
"""Of the table over airspeed, hover counted: a parabola between them is a straight line to 1 W."""
_KNOWN = 0.9
"""Fraction of a manoeuvre that power and airspeed must be known for. [-]"""


def manoeuvre_powers(
    record: FlightRecord, *, air_density_kg_m3: FloatArray, mass_kg: float | None
) -> tuple[MeasuredPower, ...]:
    """Return the mean power of each manoeuvre of a flight.

    Climb, legs and both halves of the descent, ground time left out; none where the flight has no
    such manoeuvres or power is not known.
    """
    try:
        flight = timed_flight(record)
    except IdentificationError:
        return ()
    spans = [
        _climb(record, flight.takeoff),
        *((leg.start_s, leg.start_s + leg.duration_s, 0.0) for leg in flight.legs),
        *_descent_halves(record, flight.landing),
    ]
    airspeed = speed_through_air_m_s(record)
    found = []
    for begin_s, end_s, rise_m in spans:
        part = (record.time_s >= begin_s) & (record.time_s < end_s)
        known = part & np.isfinite(record.power_w) & np.isfinite(airspeed)
        if known.sum() < _KNOWN * max(part.sum(), 1):
            continue
        found.append(
            MeasuredPower.over(
                record,
                known,
                duration_s=end_s - begin_s,
                height_above_home_m=float(np.nanmean(record.height_above_home_m[part])),
                airspeed_m_s=float(airspeed[known].mean()),
                climb_rate_m_s=rise_m / (end_s - begin_s),
                air_density_kg_m3=float(np.nanmean(air_density_kg_m3[part])),
                mass_kg=mass_kg,
                start_s=begin_s,
                parts=flown_parts(record, known),
            )
        )
    return tuple(found)


_Span = tuple[float, float, float]
"""Beginning, end and rise. [s], [s], [m]"""


def _climb(record: FlightRecord, change: TimedChange) -> _Span:
    """Return a take-off from lift-off until hardly anything is left to climb."""
    begin_s = change.start_s + change.ground_s
    end_s = change.start_s + change.duration_s
    part = (record.time_s >= begin_s) & (record.time_s < end_s)
    times_s, above_m = record.time_s[part], record.height_above_home_m[part]
    up = np.flatnonzero(above_m >= _CLIMBED * change.rise_m)
    end_s = float(times_s[up[0]]) if up.size else end_s
    return begin_s, end_s, _CLIMBED * change.rise_m


def _descent_halves(record: FlightRecord, change: TimedChange) -> tuple[_Span, _Span]:
    """Return both halves of a landing by height, of which the lower one is the slower."""
    end_s = change.start_s + change.duration_s - change.ground_s
    part = (record.time_s >= change.start_s) & (record.time_s < end_s)
    times_s, height_m = record.time_s[part], record.height_above_home_m[part]
    half_m = float(height_m[np.isfinite(height_m)][-1]) - 0.5 * change.rise_m
    low = np.flatnonzero(height_m < half_m)
    middle_s = float(times_s[low[0]]) if low.size else 0.5 * (change.start_s + end_s)
    rise_m = 0.5 * change.rise_m
    return (change.start_s, middle_s, rise_m), (middle_s, end_s, rise_m)


def at_mean_load(flights: Sequence[Sequence[MeasuredPower]]) -> tuple[MeasuredPower, ...]:
    """Return the powers of flights with unknown loads, each flight brought to the mean of all."""
    known = [flight for flight in flights if flight]
    if not known:
        return ()
    levels = [
        float(np.average([p.power_w for p in flight], weights=[p.duration_s for p in flight]))
        for flight in known
    ]
    mean_w = float(np.mean(levels))
    return tuple(
        replace(power, power_w=power.power_w * mean_w / level)
        for flight, level in zip(known, levels, strict=True)
        for power in flight
    )


def power_of_manoeuvres(
    flights: Sequence[Sequence[MeasuredPower]],
    mass_deviation_kg: float,
    refusals: tuple[SegmentUse, ...] = (),
) -> tuple[PowerIdentification, tuple[MeasuredPower, ...]]:
    """Identify the power from the manoeuvres of flights: by their masses, else at the mean load.

    Returns it with the powers it was identified from.
    """
    means = tuple(power for flight in flights for power in flight)
    if all(power.mass_kg is not None for power in means):
        power = identify_power(means, refusals=refusals, mass_deviation_kg=mass_deviation_kg)
        return power, means
    means = at_mean_load(flights)
    power = identify_manoeuvre_power(means, refusals)
    reading = "Loads are unknown: each flight is brought to the mean power of all flights."
    return replace(power, readings=(*power.readings, reading)), means


def identify_manoeuvre_power(
    means: Sequence[MeasuredPower], refusals: tuple[SegmentUse, ...] = ()
) -> PowerIdentification:
    r"""Identify the power of flights whose mass is not known, from the means over manoeuvres.

    A parabola :math:`P = P_0 + c V^2` through the level legs gives hover power, the same at every height,
    and cruise power over the airspeed; where flights left out are described no better by it than by one
    power, that is taken.  The mean powers of climbs, and of the faster and the slower half of
    the descents, less the parabola, give the power over the climb rate.

    There are no laws with fewer than four level legs.
    """
    level = [m for m in means if m.climb_rate_m_s == 0.0]
    if len(level) < _LEAST_LEGS:
        summary = f"too few level legs with power and airspeed: {len(level)}"
        outcome = StateOutcome.left_out("hover", summary, refusals)
        return PowerIdentification(outcomes=(outcome,))
    speeds = np.array([m.airspeed_m_s for m in level])
    powers = np.array([m.power_w for m in level])
    (growth, hover_w), covariance = np.polyfit(speeds**2, powers, 1, cov="unscaled")
    residuals = powers - hover_w - growth * speeds**2
    scatter = float(residuals @ residuals) / (len(level) - 2)
    growth_error, hover_error = np.sqrt(np.diagonal(covariance) * scatter)
    is_flat = _is_flat(level) or abs(growth) < growth_error
    if is_flat:
        growth, hover_w = 0.0, float(powers.mean())
        residuals = powers - hover_w
        hover_error = float(powers.std(ddof=1) / np.sqrt(len(level)))
    knots = np.linspace(0.0, float(speeds.max()), _KNOTS)
    rates, excess = _vertical_w(means, float(hover_w), float(growth))
    outcome = StateOutcome(
        name="steady power",
        summary=(
            f"{'the same at every airspeed' if is_flat else 'parabola over airspeed'}, table over "
            f"climb rate, from {quantity.count(len(means), 'manoeuvre')}"
        ),
        unit="W",
        estimates=(
            Estimate(name="hover_w", value=float(hover_w), error=float(hover_error)),
            Estimate(name="growth_w_s2_m2", value=float(growth), error=float(growth_error)),
        ),
        segments=(*refusals, *_segments(means)),
        fit_percent=told_fit_percent(powers, powers - residuals),
        rms=float(np.sqrt(np.mean(residuals**2))),
    )
    return PowerIdentification(
        hover=AltitudeLaw(
            coefficient_w=rounded(float(hover_w), 5), exponent=0.0, lowest_height_m=LOWEST_HEIGHT_M
        ),
        cruise=CruisePower(
            speed_m_s=tuple(rounded(v, 5) for v in knots.tolist()),
            power_above_hover_w=tuple(rounded(w, 5) for w in (growth * knots**2 + 0.0).tolist()),
        ),
        vertical=VerticalPower(climb_rate_m_s=rates, power_above_hover_w=excess) if rates else None,
        outcomes=(outcome,),
        readings=("No mass is known: the power does not depend on the height or on the payload.",),
    )


def _is_flat(level: Sequence[MeasuredPower]) -> bool:
    """Whether one power describes the legs of flights left out better than a parabola does."""
    sources = np.array([leg.source for leg in level])
    squares = np.array([leg.airspeed_m_s for leg in level]) ** 2
    powers = np.array([leg.power_w for leg in level])
    errors = {0: 0.0, 1: 0.0}
    for source in set(sources.tolist()):
        own = sources == source
        for degree in errors:
            if len(set(squares[~own].tolist())) <= degree:
                return True
            law = np.polyfit(squares[~own], powers[~own], degree)
            errors[degree] += float(np.sum((powers[own] - np.polyval(law, squares[own])) ** 2))
    return errors[0] <= errors[1]


def _vertical_w(
    means: Sequence[MeasuredPower], hover_w: float, growth: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return climb rates, rising, and the power above that of level flight at each. [m/s], [W]"""
    climbs = [m for m in means if m.climb_rate_m_s > 0.0]
    descents = sorted((m for m in means if m.climb_rate_m_s < 0.0), key=lambda m: m.climb_rate_m_s)
    half = len(descents) // 2
    table = {0.0: 0.0}
    for group in (descents[:half], descents[half:], climbs):
        if group:
            rate = rounded(float(np.mean([m.climb_rate_m_s for m in group])), 5)
            above = [m.power_w - hover_w - growth * m.airspeed_m_s**2 for m in group]
            table[rate] = rounded(float(np.mean(above)), 5)
    if len(table) == 1:
        return (), ()
    rates = tuple(sorted(table))
    return rates, tuple(table[rate] for rate in rates)
