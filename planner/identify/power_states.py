"""Steady power of a vehicle from its steady flight: one law of everything, or tables state by state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.errors import IdentificationError
from planner.identify.cruise import fit_cruise_curve
from planner.identify.estimate import Estimate
from planner.identify.hover import fit_altitude_law, fit_density_law
from planner.identify.outcome import SegmentUse, StateOutcome, Status
from planner.identify.quality import fit_percent
from planner.identify.steady_map import SteadyMap, cell_of, fit_steady_map
from planner.vehicle.power import (
    AltitudeLaw,
    CruisePower,
    VerticalPower,
    hover_power_w,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.steady import SteadyPower
    from planner.vehicle.power import CruiseLaw, HoverLaw

_EVERY = 4
"""Of as many steady flights of one cell the last is held out from the fit that is tested."""
_MOVING_M_S = 1.0
_CLIMBING_M_S = 0.3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PowerIdentification:
    """What the steady flight tells about the power."""

    hover: HoverLaw | None = None
    cruise: CruiseLaw | None = None
    vertical: VerticalPower | None = None
    outcomes: tuple[StateOutcome, ...] = ()
    steady_map: SteadyMap | None = None
    readings: tuple[str, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether there is any power."""
        return self.hover is not None or self.cruise is not None


def identify_power(
    steady: Sequence[SteadyPower],
    *,
    refusals: Sequence[SegmentUse] = (),
    mass_deviation_kg: float = 0.0,
) -> PowerIdentification:
    """Identify the steady power by momentum theory, else by tables.

    Parameters
    ----------
    steady : sequence of SteadyPower
        Steady flight of all flights.
    refusals : sequence of SegmentUse
        Flights that tell no power, each with the reason.
    mass_deviation_kg : float
        Standard deviation of a mass that is not known from flight to flight. [kg]

    Returns
    -------
    PowerIdentification
        Laws of power, as far as the flights tell.
    """
    if not steady:
        why = refusals[0].refusal if refusals else "no flight is steady for 3 s"
        outcome = StateOutcome(
            name="hover", status=Status.LEFT_OUT, said=why, segments=tuple(refusals)
        )
        return PowerIdentification(outcomes=(outcome,))
    try:
        return _by_momentum_theory(steady, tuple(refusals), mass_deviation_kg)
    except IdentificationError as error:
        return _by_tables(steady, tuple(refusals), str(error))


def _by_momentum_theory(
    steady: Sequence[SteadyPower], refusals: tuple[SegmentUse, ...], mass_deviation_kg: float
) -> PowerIdentification:
    fitted = fit_steady_map(steady, mass_deviation_kg=mass_deviation_kg)
    is_held = _held_out(steady)
    held = [f for f, h in zip(steady, is_held, strict=True) if h]
    tested = fitted
    if held:
        try:
            tested = fit_steady_map(
                [f for f, h in zip(steady, is_held, strict=True) if not h],
                mass_deviation_kg=mass_deviation_kg,
            )
        except IdentificationError:
            held = []
    judged = held or list(steady)
    measured = np.array([f.power_w for f in judged])
    errors = tested.residuals_w(judged)
    payload = ""
    if mass_deviation_kg > 0.0:
        payload = f", the mass of each flight not known to {mass_deviation_kg:g} kg"
    doubt = ""
    if fitted.from_prior:
        doubt = f"; not told by the flights: {', '.join(fitted.from_prior)}"
    outcome = StateOutcome(
        name="steady power",
        status=Status.IDENTIFIED,
        said=(
            "momentum theory over airspeed, climb rate and air density, "
            f"{numbers.count(len(steady), 'steady stretch', 'steady stretches')} in "
            f"{numbers.count(fitted.cells, 'cell')}{payload}{doubt}"
        ),
        unit="W",
        estimates=fitted.estimates,
        segments=(*refusals, *_segments(steady, is_held)),
        fit_percent=fit_percent(measured, measured + errors),
        rms=float(np.sqrt(np.mean(errors**2))),
    )
    masses = {f.mass_kg for f in steady}
    readings = [
        (
            "Disk area and factors are effective values that reproduce the power, not measurements "
            "of the rotors; factors are electrical watts for each watt of the ideal disk."
        ),
        "The load of the avionics is contained in the power: the logs do not tell it apart.",
    ]
    if len(masses) == 1:
        readings.append(
            "All flights have one mass: another one is extrapolated by momentum theory."
        )
    if fitted.from_prior:
        readings.append(
            f"The flights do not tell {', '.join(fitted.from_prior)}: held at what is usual for "
            "multirotors."
        )
    return PowerIdentification(
        cruise=fitted.law, outcomes=(outcome,), steady_map=fitted, readings=tuple(readings)
    )


def _by_tables(
    steady: Sequence[SteadyPower], refusals: tuple[SegmentUse, ...], why: str
) -> PowerIdentification:
    """Hover law, table over airspeed and table over climb rate, each where the flights have it."""
    hovers = [f for f in steady if cell_of(f) == (0, 0)]
    if not hovers:
        outcome = StateOutcome(
            name="hover", status=Status.LEFT_OUT, said="no flight hovers", segments=refusals
        )
        return PowerIdentification(outcomes=(outcome,))
    hover, hover_outcome, readings = identify_hover(hovers, refusals)
    at_hover = [
        float(
            hover_power_w(
                hover,
                height_above_home_m=f.height_above_home_m,
                mass_kg=f.mass_kg,
                air_density_kg_m3=f.air_density_kg_m3 or 0.0,
            )
        )
        for f in steady
    ]
    level = [
        (f, w)
        for f, w in zip(steady, at_hover, strict=True)
        if abs(f.climb_rate_m_s) < _CLIMBING_M_S and f.airspeed_m_s >= _MOVING_M_S
    ]
    vertical = [
        (f, w)
        for f, w in zip(steady, at_hover, strict=True)
        if abs(f.climb_rate_m_s) >= _CLIMBING_M_S and f.airspeed_m_s < _MOVING_M_S
    ]
    cruise_law, cruise_outcome = identify_cruise([f for f, _ in level], [w for _, w in level])
    vertical_law, vertical_outcome = _climbs(vertical)
    return PowerIdentification(
        hover=hover,
        cruise=cruise_law,
        vertical=vertical_law,
        outcomes=(hover_outcome, cruise_outcome, vertical_outcome),
        readings=(*readings, f"No law of power over mass, speed and climb together: {why}."),
    )


def identify_hover(
    hovers: Sequence[SteadyPower], refusals: tuple[SegmentUse, ...] = ()
) -> tuple[HoverLaw, StateOutcome, tuple[str, ...]]:
    """Fit hover power over mass and density where they are known, else over height.

    Parameters
    ----------
    hovers : sequence of SteadyPower
        One at least.
    refusals : tuple of SegmentUse
        Hovers that were not used.

    Returns
    -------
    law : AltitudeLaw or DensityLaw
        The law.
    outcome : StateOutcome
        How it was found.
    readings : tuple of str
        What was decided.
    """
    powers = np.array([h.power_w for h in hovers])
    is_held = _held_out(hovers)
    segments = (*refusals, *_segments(hovers, is_held))
    readings: tuple[str, ...] = ()
    law: HoverLaw
    estimates: tuple[Estimate, ...]
    if all(h.mass_kg is not None and h.air_density_kg_m3 is not None for h in hovers):
        of_density = fit_density_law(hovers)
        law, estimates = of_density.law, of_density.estimates
        said = f"over mass and air density, from {numbers.count(len(hovers), 'hover')}"
        if of_density.exponents_from_theory:
            names = ", ".join(of_density.exponents_from_theory)
            readings = (f"The hovers do not tell {names}: of momentum theory.",)
    else:
        try:
            of_height = fit_altitude_law(hovers)
            law, estimates = of_height.law, of_height.estimates
            said = f"P = K H^z, from {numbers.count(len(hovers), 'hover')}"
        except IdentificationError:
            weights = np.array([h.duration_s for h in hovers])
            power_w = float(np.average(powers, weights=weights))
            error_w = float(np.sqrt(np.sum((weights * [h.error_w for h in hovers]) ** 2)))
            law = AltitudeLaw(
                coefficient_w=float(f"{power_w:.6g}"), exponent=0.0, lowest_height_m=1.0
            )
            error_w /= float(weights.sum())
            estimates = (Estimate(name="coefficient_w", value=power_w, error=error_w),)
            said = f"constant, from {numbers.count(len(hovers), 'hover')} at one height"
            readings = ("All hovers are at one height: hover power is taken to be constant.",)
    predicted = np.array(
        [
            float(
                hover_power_w(
                    law,
                    height_above_home_m=h.height_above_home_m,
                    mass_kg=h.mass_kg,
                    air_density_kg_m3=h.air_density_kg_m3 or 0.0,
                )
            )
            for h in hovers
        ]
    )
    outcome = StateOutcome(
        name="hover",
        status=Status.IDENTIFIED,
        said=said,
        unit="W",
        estimates=estimates,
        segments=segments,
        rms=float(np.sqrt(np.mean((predicted - powers) ** 2))),
    )
    return law, outcome, readings


def identify_cruise(
    cruises: Sequence[SteadyPower],
    hover_powers_w: Sequence[float],
    refusals: tuple[SegmentUse, ...] = (),
) -> tuple[CruisePower | None, StateOutcome]:
    """Fit a table of cruise power above hover over airspeed.

    Parameters
    ----------
    cruises : sequence of SteadyPower
        Steady level flights.
    hover_powers_w : sequence of float
        Hover power at the height, mass and density of each. [W]
    refusals : tuple of SegmentUse
        Cruises that were not used.

    Returns
    -------
    law : CruisePower or None
        The table, if there is one.
    outcome : StateOutcome
        How it was found, or why not.
    """
    segments = (*refusals, *_segments(cruises, [False] * len(cruises)))
    try:
        curve = fit_cruise_curve(cruises, hover_powers_w)
    except IdentificationError as error:
        return None, StateOutcome(
            name="cruise", status=Status.LEFT_OUT, said=str(error), segments=segments
        )
    law = CruisePower(
        speed_m_s=tuple(round(v, 3) for v in curve.speed_m_s),
        power_above_hover_w=tuple(round(p, 3) for p in curve.power_above_hover_w),
    )
    return law, StateOutcome(
        name="cruise",
        status=Status.IDENTIFIED,
        said=(
            f"table over {numbers.count(len(curve.speed_m_s) - 1, 'airspeed')}, from "
            f"{numbers.count(len(cruises), 'cruise')}"
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
    flights: Sequence[tuple[SteadyPower, float]],
) -> tuple[VerticalPower | None, StateOutcome]:
    """Return a table of power above hover over climb rate: the mean of each cell."""
    if not flights:
        why = "no steady climb or descent"
        return None, StateOutcome(name="vertical", status=Status.LEFT_OUT, said=why)
    cells: dict[int, list[tuple[SteadyPower, float]]] = {}
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
        status=Status.IDENTIFIED,
        said=(
            f"table over {numbers.count(len(rows) - 1, 'climb rate')}, from {len(flights)} climbs and "
            "descents"
        ),
        unit="W",
        estimates=tuple(
            Estimate(name=f"above hover at {rate:+.1f} m/s", value=power, error=error)
            for rate, power, error in rows
            if rate != 0.0
        ),
        segments=_segments([f for f, _ in flights], [False] * len(flights)),
    )


def _held_out(flights: Sequence[SteadyPower]) -> list[bool]:
    """Hold out every fourth stretch of a cell; of all, where hardly a cell was flown so often."""
    seen: dict[tuple[int, int], int] = {}
    held = []
    for flight in flights:
        cell = cell_of(flight)
        seen[cell] = seen.get(cell, 0) + 1
        held.append(seen[cell] % _EVERY == 0)
    if sum(held) * 10 < len(held):
        return [(number + 1) % _EVERY == 0 for number in range(len(flights))]
    return held


def _segments(
    flights: Sequence[SteadyPower], is_held_out: Sequence[bool]
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
        for flight, is_held in zip(flights, is_held_out, strict=True)
    )
