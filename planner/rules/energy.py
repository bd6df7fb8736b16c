"""Rules on energy: the reserve, the return, and how well the power is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import FlightStretch, Rule, Severity
from planner.flight.budget import MOST_CHANCE_EMPTY
from planner.flight.returns.destination import ALONG, HERE, HOME, LANDING
from planner.quantity import sd_of
from planner.rules.assessment import Margin
from planner.rules.declaration import BUDGET, POWER, judges
from planner.vehicle.model import Basis

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.flight.power import SteadyPower
    from planner.flight.returns.path import FlightPoint
    from planner.rules.assessment import Assessment

_SAME_SHORTFALL = 0.05
"""E102 leaves its shortfall to E101 where they differ by no more than this fraction. [-]"""
_AT_THE_END = 0.995
"""A point this far along its leg is at its end. [-]"""
LEAST_RISK = 1e-6
"""No smaller chance is asked about: no sample shows it. [-]"""
ASSUMED_ERROR = 0.05
"""Standard deviation of flown over predicted energy where a model says none: 196 flights of a Matrice 100
were predicted within 4 % with mass and wind known, within 7.4 % with one constant power. [-]"""

_HIGHEST_HOME_M = 2500.0
"""One person in a hundred lives higher (Tremblay and Ainslie, PNAS 118, 2021). [m AMSL]"""
_ALTITUDES_M = np.arange(0.0, 4501.0, 20.0)
"""Up to where models are extrapolated. [m AMSL]"""

BATTERY_UNKNOWN = Rule(
    "E100 battery-unknown",
    Severity.ERROR,
    summary="No battery given: the margin cannot be judged.",
    why="A mission without a battery cannot be judged; a guessed one would be a wrong 'go'.",
    how="Neither --battery nor the vehicle model's [battery] gives a capacity.",
    fix='give --battery, for example "5.2Ah@14.8V" or 77Wh',
    instead="--battery",
    leaves_open=True,
)


RESERVE_BELOW_MINIMUM = Rule(
    "E101 reserve-below-minimum",
    Severity.ERROR,
    summary="The flight would land below the reserve.",
    why="Autopilots find out in the air that they cannot return: low-battery returns that trigger too "
    "late, or far too early, are among the most reported failures (PX4 #17007, ArduPilot #2390).",
    how="margin = capacity × charge − capacity × reserve − energy of the whole flight, from the start "
    "of the take-off to disarmed; fires where the margin is negative.  The finding is at the item "
    "during which the reserve is first used, and gives how far below it a battery starts.",
    fix="shorten or split the mission, or use a larger or fuller battery",
    instead="--battery, --charge or --reserve",
)


@judges(BATTERY_UNKNOWN, needs=(POWER,))
def _battery_unknown(a: Assessment, _power: SteadyPower) -> Iterator[Finding]:
    if a.battery is None:
        yield a.finding(
            BATTERY_UNKNOWN,
            f"no battery given; the flight needs {quantity.energy(a.totals.energy_wh)}",
        )


@judges(RESERVE_BELOW_MINIMUM, needs=(BUDGET,))
def _reserve_below_minimum(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    if budget.margin_wh >= 0.0:
        return
    needed_wh = a.totals.energy_wh
    available_wh = budget.margin_wh + needed_wh
    reserve = f"the {reserve_name(budget)} reserve"
    available = (
        f"only {quantity.energy(available_wh)} is available above {reserve}"
        if available_wh >= 0.0
        else f"the battery starts {quantity.energy(-available_wh)} below {reserve}"
    )
    yield a.finding(
        RESERVE_BELOW_MINIMUM,
        f"needs {quantity.energy(needed_wh)}; {available} ({quantity.energy(-budget.margin_wh)} short)",
        item=next(
            (
                arrival.item
                for arrival in a.items
                if arrival.energy_used_wh is not None and arrival.energy_used_wh > available_wh
            ),
            None,
        ),
    )


RETURN_BELOW_RESERVE = Rule(
    "E102 no-return-point",
    Severity.ERROR,
    summary="From some point of the flight, an immediate return would land below the reserve.",
    why="A mission may end above its reserve and still pass points from which the vehicle cannot "
    "return with it: a point of no return (QGroundControl #11262, ArduPilot #2390).",
    how="margin = energy left at the point − reserve − energy to stop, fly home by the vehicle's own "
    "return rules and land there.  Flown from 128 points of the flight or more, and interpolated along "
    "legs around the tightest (to 0.1 %); take-off, landings and the way home are left to E101.  Fires where "
    "the least margin is negative and names the last point from which a return keeps the reserve; the "
    "shortfall is left to E101 where it is the same (to 5 %).  A return leads where the vehicle's would: "
    "home, as DO_SET_HOME has moved it, or a rally point.",
    fix="bring the far end of the mission nearer, or use a larger or fuller battery",
    instead="--battery, --charge or --reserve",
)


@judges(RETURN_BELOW_RESERVE, needs=(BUDGET,))
def _return_below_reserve(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    way = a.return_plan
    if way is None or way.margin_wh is None or way.margin_wh >= 0.0:
        return
    turn, empty = way.last_return, way.last_return_empty
    goal = f"flying {destination_name(way.destination)}"
    reserve = f"the {reserve_name(budget)} reserve"
    if turn is None:
        message = f"no point of return: from everywhere {goal} lands below {reserve}"
    else:
        message = (
            f"point of no return: {place_along(turn)} ({quantity.clock(turn.time_s)}): beyond it, {goal} "
            f"lands below {reserve}"
        )
    if empty is not None and (turn is None or place_along(empty) != place_along(turn)):
        message += f"; beyond {place_along(empty)} the battery is empty before it is there"
    if budget.margin_wh >= 0.0 or way.margin_wh < (1.0 + _SAME_SHORTFALL) * budget.margin_wh:
        worst = f"item {way.tightest_item}" if way.tightest is None else place_along(way.tightest)
        message += (
            f"; from {worst} the return takes {quantity.energy(way.energy_home_wh)} "
            f"({quantity.energy(-way.margin_wh)} short)"
        )
    at = turn or way.tightest
    yield a.finding(
        RETURN_BELOW_RESERVE,
        message,
        item=way.tightest_item if turn is None else turn.item,
        stretch=None if at is None else _spot(at),
    )


def _spot(point: FlightPoint) -> FlightStretch:
    """Return a point of a flight as what a picture shows of a finding."""
    return FlightStretch(start_deg=point.place_deg, end_deg=point.place_deg, distance_m=0.0)


def reserve_name(budget: BatteryBudget) -> str:
    """Return the reserve as it was given: ``20 %``, ``12.0 Wh``, ``3 min 00 s of hover``."""
    if budget.reserve is None:
        return quantity.percent(budget.reserve_fraction)
    return str(budget.reserve)


def place_along(point: FlightPoint) -> str:
    """Return a point of a flight in words: ``120 m into the leg to item 7``."""
    if point.along_m < _AT_THE_END * point.leg_m:
        return f"{quantity.distance(point.along_m)} into the leg to item {point.item}"
    return f"item {point.item}"


def destination_name(destination: int) -> str:
    """Return where a return leads in words: ``home``, ``to rally point 2``."""
    if destination > HOME:
        return f"to rally point {destination}"
    return {
        LANDING: "to the mission's landing",
        ALONG: "back along the mission",
        HERE: "down where it is",
    }.get(destination, "home")


RESERVE_AT_RISK = Rule(
    "E119 reserve-at-risk",
    Severity.WARNING,
    summary="The prediction keeps the reserve, but the chance that a flight does not is high.",
    why="No two flights use the same energy: recorded flights differ from their predictions by a few "
    "percent, and the wind is never quite the forecast.  A margin smaller than that is luck.",
    how="10,000 samples of the wind, payload, temperature and charge as given (5±2@270±20) and of the "
    "errors in the [spread] of the vehicle model; fires where the fraction that lands, or that could "
    "not return from some point, below the reserve exceeds --risk (5 % by default) while the "
    "prediction itself stays above it.  Of a flight that is later by its parameters (E108), by standard "
    "deviations of 5 % too, as E124.  Not computed where the model has no [spread].",
    fix="leave more margin: a shorter mission, or a larger or fuller battery",
    instead="--battery, --charge or --reserve",
)


@judges(RESERVE_AT_RISK, needs=(BUDGET,))
def _reserve_at_risk(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    if budget.below_reserve_probability is None or budget.margin_wh < 0.0:
        return  # the model has no spread, or E101 reports worse
    way, returning = a.return_plan, None
    if way is not None and way.margin_wh is not None and way.margin_wh >= 0.0:
        returning = way.below_reserve_probability
    back = a.return_margin(counts_uncounted=False)
    landing = budget.below_reserve_probability
    if a.late_wh > 0.0:
        late = Margin(budget.margin_wh, a.late_wh, 0.0)
        landing = max(landing, _chance_short(a, late, budget))
    if returning is not None and back is not None and back.late_wh > 0.0:
        returning = max(returning, _chance_short(a, back, budget))
    limit = (
        f"below the {reserve_name(budget)} reserve; --risk allows {quantity.percent(a.setup.risk)}"
    )
    if landing > a.setup.risk:
        chance = quantity.beside(landing, a.setup.risk, quantity.chance)
        yield a.finding(RESERVE_AT_RISK, f"{chance} chance of landing {limit}")
    elif way is not None and returning is not None and returning > a.setup.risk:
        chance = quantity.beside(returning, a.setup.risk, quantity.chance)
        yield a.finding(
            RESERVE_AT_RISK,
            f"{chance} chance that a return from some point ends {limit}",
            item=way.tightest_item,
        )


EMPTY_AT_RISK = Rule(
    "E124 empty-at-risk",
    Severity.ERROR,
    summary="The battery may be empty before the vehicle has landed, or before it is home.",
    why="A reserve that is used is a warning; an empty battery is a vehicle lost.  With --reserve 0% a "
    "flight that lands with 1 % left was a go.",
    how="The chance that the energy needed exceeds all the battery holds, for the flight and for the "
    "return from where it is tightest, each with what it takes longer by its parameters (E108): more "
    "than 1 %.  By the 10,000 samples of E119 where the model "
    "has a [spread], else by standard deviations of 5 % of the energy and of the charge as given, and by "
    "each other condition two standard deviations off, one flight in 44, alone and with the others, as of a "
    "wind that slows the vehicle.  Left to E101 and E102 where the prediction itself is below the reserve.",
    fix="leave more in the battery: a shorter mission, or a larger or fuller battery",
    instead="--battery or --charge",
)


@judges(EMPTY_AT_RISK, needs=(BUDGET,))
def _empty_at_risk(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    way = a.return_plan
    is_assumed = budget.empty_probability is None
    landing = budget.empty_probability
    flown = Margin(budget.margin_wh, a.late_wh, 0.0)
    if landing is None or flown.late_wh > 0.0:
        landing = max(landing or 0.0, _chance_short(a, flown, budget, beyond_wh=budget.reserve_wh))
    returning = None if way is None else way.empty_probability
    back = a.return_margin(counts_uncounted=False)
    if back is not None and (returning is None or back.late_wh > 0.0):
        empty = _chance_short(a, back, budget, beyond_wh=budget.reserve_wh)
        returning = max(returning or 0.0, empty)
    by = "" if not is_assumed else f"; an error of {quantity.percent(ASSUMED_ERROR)} assumed"
    if landing > MOST_CHANCE_EMPTY and budget.margin_wh >= 0.0:
        chance = quantity.beside(landing, MOST_CHANCE_EMPTY, quantity.chance)
        yield a.finding(
            EMPTY_AT_RISK,
            f"{chance} chance that the battery is empty before the landing: "
            f"{quantity.energy(flown.left_wh + budget.reserve_wh)} left{by}",
        )
    elif (
        way is not None
        and back is not None
        and (way.margin_wh or 0.0) >= 0.0
        and (returning or 0.0) > MOST_CHANCE_EMPTY
    ):
        chance = quantity.beside(returning or 0.0, MOST_CHANCE_EMPTY, quantity.chance)
        yield a.finding(
            EMPTY_AT_RISK,
            f"{chance} chance that the battery is empty before a return has landed: "
            f"{quantity.energy(back.left_wh + budget.reserve_wh)} left{by}",
            item=way.tightest_item,
        )


def off_the_mean(a: Assessment, other: Assessment, note: str, *, sds: float) -> Iterator[Finding]:
    """Yield what conditions come to so many standard deviations off their mean, where they are not drawn.

    That is of a model without a spread, in a wind that slows the vehicle, as samples are flown as fast as in
    the mean wind, and in one that the model does not count.  Less is left the farther off, and the more so,
    so that in between at least as much is left as on the straight.
    """
    if a.battery is None:
        return
    left_wh, off_wh = a.left_wh, other.left_wh
    is_slowed = other.setup.wind != a.setup.wind and other.returns.slowed is not None
    uncounted_wh, off_uncounted_wh = (
        [margin.uncounted_wh for margin in one.margins] for one in (a, other)
    )
    is_drawn = (
        a.battery.empty_probability is not None
        and uncounted_wh == off_uncounted_wh
        and not is_slowed
    )
    if is_drawn or left_wh < 0.0 or off_wh >= 0.0:
        return
    note = f"{note}, which slows the vehicle" if is_slowed else note
    allowed = deviations_beyond(a.setup.risk) / sds
    if off_wh + a.battery.reserve_wh < 0.0:
        yield a.finding(
            EMPTY_AT_RISK,
            f"the battery may be empty before the landing, or before a return has landed ({note})",
        )
    elif left_wh + allowed * (off_wh - left_wh) < 0.0:
        below = f"may end {quantity.energy(-off_wh)} below the {reserve_name(a.battery)} reserve"
        yield a.finding(RESERVE_AT_RISK, f"{below} ({note})")


def deviations_beyond(chance: float) -> float:
    """Return how many standard deviations above the mean so many flights are, of a normal distribution."""
    from statistics import NormalDist  # asked in few checks; it takes long to import

    return NormalDist().inv_cdf(1.0 - min(max(chance, LEAST_RISK), 1.0 - LEAST_RISK))


def chance_beyond(sds: float) -> float:
    """Return which part of flights is so many standard deviations above the mean, as above."""
    return 0.5 * math.erfc(sds / math.sqrt(2.0))


def _chance_short(
    a: Assessment, margin: Margin, budget: BatteryBudget, *, beyond_wh: float = 0.0
) -> float:
    """Return the chance that a flight takes more than a margin, and so much beyond it.

    By the error assumed, and that of the charge.
    """
    taken_wh = budget.above_reserve_wh - margin.left_wh
    error_wh = math.hypot(ASSUMED_ERROR * taken_wh, sd_of(a.setup.charge) * budget.capacity_wh)
    if error_wh <= 0.0:
        return 0.0
    return chance_beyond((margin.left_wh + beyond_wh) / error_wh)


AIR_UNKNOWN = Rule(
    "X909 air-unknown",
    Severity.WARNING,
    summary="The altitude of home is unknown: power is counted in the air of sea level.",
    why="Thin air takes more power: 6 % more at 1000 m, 14 % at 2500 m.  A file without an altitude, or with "
    "the 0 that programs write who do not know it, had the best margin there is.",
    how="No altitude of home from the file, --home-amsl or --terrain, and none that A105 asks for.  The "
    "energy of the flight, and of the tightest return with the way there, and what is not counted of both "
    "(E108), grows with 1/√ρ of the standard air at most, and with it the chance of an empty battery (E124); "
    "not where the margin lasts up to 4500 m, and that chance stays below 1 %; an error where not up to "
    "2500 m: one person in a hundred lives higher (Tremblay and Ainslie, PNAS 2021).",
    fix="give the altitude of the take-off place with --home-amsl (0 where it is at sea level)",
    instead="--home-amsl or --terrain",
    leaves_open=True,
)


@judges(AIR_UNKNOWN, needs=(BUDGET,))
def _air_unknown(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    if a.route.knows_home_amsl or a.route.amsl_items:
        return
    needed_wh, available_wh = most_needed_wh(a, budget), budget.above_reserve_wh
    air = a.flight.power.air_density_kg_m3(np.array([0.0, *_ALTITUDES_M]))
    grown = np.sqrt(air[0] / air[1:])
    lasts = needed_wh * grown <= available_wh
    are_safe = _are_safe(a, budget, grown)
    if are_safe.any():  # else E124 fires at sea level
        lasts &= are_safe
    if lasts.all() or not lasts.any():
        return  # it lasts anywhere, or nowhere: E101, E102
    up_to_m = float(_ALTITUDES_M[lasts].max())
    yield a.finding(
        AIR_UNKNOWN,
        "altitude of home unknown: power counted in the air of sea level; the battery lasts up to a home "
        f"at {quantity.height(up_to_m)} AMSL",
        severity=None if up_to_m >= _HIGHEST_HOME_M else Severity.ERROR,
    )


def _are_safe(a: Assessment, budget: BatteryBudget, factors: FloatArray) -> BoolArray:
    """Return whether E124 does not fire where all takes so many times as much. (n,)"""
    sampled, above_wh = budget.empty_factor, budget.above_reserve_wh
    assumed = [Margin(budget.margin_wh, a.late_wh, 0.0), a.return_margin(counts_uncounted=False)]
    taken_wh = [
        above_wh - one.left_wh
        for one in assumed
        if one is not None and (sampled is None or one.late_wh > 0.0)
    ]

    def is_safe(factor: float) -> bool:
        grown = [Margin(above_wh - factor * wh, 0.0, 0.0) for wh in taken_wh]
        chances = [_chance_short(a, one, budget, beyond_wh=budget.reserve_wh) for one in grown]
        return max(chances, default=0.0) <= MOST_CHANCE_EMPTY and factor <= (sampled or math.inf)

    return np.array([is_safe(factor) for factor in factors.tolist()])


def most_needed_wh(a: Assessment, budget: BatteryBudget) -> float:
    """Return the energy of the flight, or of the way there and the return that leaves least, at most. [Wh]"""
    return budget.above_reserve_wh - a.left_wh


MODEL_NOT_FLOWN = Rule(
    "E130 model-not-flown",
    Severity.INFO,
    summary="The energy rests on a data sheet or on theory: no flight of the vehicle is in its model.",
    why="Published figures are of another day, load and battery, and mass and rotors alone leave the power "
    "uncertain by a sixth: keep a margin that holds what one flight in ten takes.",
    how="The model's [provenance] says basis = data-sheet or theory; the energy that nine flights of ten "
    "stay below is that of its [spread] and of the conditions as given.",
    fix="log one ordinary flight, then mavjoule vehicle refine MODEL LOG",
)
_SHEETS = {Basis.DATA_SHEET: "a data sheet", Basis.THEORY: "mass and rotors alone"}


@judges(MODEL_NOT_FLOWN, needs=(BUDGET,))
def _model_not_flown(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    basis, high_wh = a.vehicle.provenance.basis, a.totals.energy_wh_p90
    if basis not in _SHEETS or high_wh is None:
        return
    left_wh = budget.above_reserve_wh - high_wh
    left = f"{quantity.energy(abs(left_wh))} {'above' if left_wh >= 0.0 else 'short of'}"
    yield a.finding(
        MODEL_NOT_FLOWN,
        f"energy by {_SHEETS[basis]}, no flight of {a.vehicle.name}: one flight in ten takes "
        f"{quantity.energy(high_wh)} or more, {left} the {reserve_name(budget)} reserve; mavjoule vehicle "
        "refine narrows it by one log",
    )
