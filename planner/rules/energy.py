"""Rules on energy: the reserve, the return, the battery."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.returns.destination import ALONG, HERE, HOME, LANDING
from planner.quantity import mean_of
from planner.rules.declaration import BUDGET, DISCHARGE, PACK, POWER, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, Discharge
    from planner.flight.power import SteadyPower
    from planner.flight.returns.path import FlightPoint
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery

_SAME_SHORTFALL = 0.05
"""E102 leaves its shortfall to E101 where they differ by no more than this fraction. [-]"""
_AT_THE_END = 0.995
"""A point this far along its leg is at its end. [-]"""
_LEAST_VOLTAGE, _MOST_VOLTAGE = 0.85, 1.18
"""Of the vehicle's own battery: one cell of six fewer, or more, is outside. [-]"""
_COLD_C, _TOO_COLD_C = 0.0, -10.0
"""Below the first a lithium battery gives noticeably less than its label says, below the second by how
much is unknown."""

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
    "return rules and land there.  Computed at 128 points of the flight and again around the tightest "
    "(to 0.1 %); take-off, and stages that land, are left to E101.  Fires where the least margin is "
    "negative and names the last point from which a return keeps the reserve; the shortfall is left to "
    "E101 where it is the same (to 5 %).  A return leads where the vehicle's would: home, as "
    "DO_SET_HOME has moved it, or a rally point.",
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
        message += f"; beyond {place_along(empty)} the battery is empty before"
    if budget.margin_wh >= 0.0 or way.margin_wh < (1.0 + _SAME_SHORTFALL) * budget.margin_wh:
        worst = f"item {way.tightest_item}" if way.tightest is None else place_along(way.tightest)
        message += (
            f"; from {worst} the return takes {quantity.energy(way.energy_home_wh)} "
            f"({quantity.energy(-way.margin_wh)} short)"
        )
    yield a.finding(
        RETURN_BELOW_RESERVE, message, item=way.tightest_item if turn is None else turn.item
    )


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
    "prediction itself stays above it.  Not computed where the model has no [spread].",
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
    limit = (
        f"below the {reserve_name(budget)} reserve; --risk allows {quantity.percent(a.setup.risk)}"
    )
    landing = budget.below_reserve_probability
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


VOLTAGE_LOW = Rule(
    "E104 loaded-voltage-low",
    Severity.ERROR,
    summary="Under load the voltage falls below the cut-off before the energy is used up.",
    why="A battery with a third of its energy left can fall below its cut-off the moment power is "
    "drawn: a vehicle landed itself at 3.5 V a cell with 30 % left (ArduPilot #5395).",
    how="V = (E + sqrt(E² − 4 R P)) / 2 at the highest power of each segment, E from the charge left, "
    "R at the temperature and age of the battery; fires where V is below cutoff_voltage_v, or where no "
    "current gives the power.",
    fix="fly a shorter or slower mission, start with a fuller battery, or use one of less resistance",
    instead="--battery or --charge",
)


@judges(VOLTAGE_LOW, needs=(PACK, DISCHARGE))
def _voltage_low(a: Assessment, pack: Battery, discharge: Discharge) -> Iterator[Finding]:
    cutoff_v, lowest_v = pack.cutoff_voltage_v, discharge.lowest_voltage_v
    if not discharge.can_deliver:
        message = (
            f"the battery cannot deliver the power needed: {_volts(lowest_v)} left at its terminals"
        )
    elif cutoff_v is not None and lowest_v < cutoff_v:
        lowest = quantity.beside(lowest_v, cutoff_v, _volts)
        message = f"{lowest} under load; the cut-off is {_volts(cutoff_v)}"
    else:
        return
    yield a.finding(VOLTAGE_LOW, message, item=a.item_of(discharge.lowest_voltage_segment))


def _volts(voltage_v: float) -> str:
    return f"{quantity.decimals(voltage_v, 1)} V"


DISCHARGE_RATE_HIGH = Rule(
    "E110 discharge-rate-high",
    Severity.WARNING,
    summary="The flight draws more current than the battery is rated for.",
    why="Beyond its rate a battery heats up, sags and ages, and its predicted voltage does not hold.",
    how="Highest predicted current over the charge of the new battery, above its max_c_rate.",
    fix="use a battery of more charge or a higher rate, or fly slower and lighter",
    instead="--battery",
)


@judges(DISCHARGE_RATE_HIGH, needs=(BUDGET, DISCHARGE, PACK))
def _discharge_rate_high(
    a: Assessment, budget: BatteryBudget, discharge: Discharge, pack: Battery
) -> Iterator[Finding]:
    rate, rated = budget.highest_c_rate, pack.max_c_rate
    if rate is None or rated is None or rate <= rated:
        return
    yield a.finding(
        DISCHARGE_RATE_HIGH,
        f"{quantity.beside(rate, rated, _c_rate)} ({quantity.decimals(discharge.highest_current_a, 0)} A); "
        f"the battery is rated for {_c_rate(rated)}",
        item=a.item_of(discharge.highest_current_segment),
    )


def _c_rate(rate: float) -> str:
    return f"{quantity.decimals(rate, 1)} C"


BATTERY_VOLTAGE_DIFFERS = Rule(
    "E121 battery-voltage-differs",
    Severity.ERROR,
    summary="The battery has another voltage than the vehicle's own.",
    why="A battery of fewer cells does not turn the rotors fast enough, one of more burns the speed "
    "controllers; usually the battery of another vehicle was typed.",
    how="Nominal voltage of the battery over that of the model's own: less than 0.85 or more than "
    "1.18, so that one cell of six fewer is outside and another chemistry of as many cells is not.",
    fix="give the battery that flies, or ignore the code where the vehicle is made for both",
    instead="--battery",
)


@judges(BATTERY_VOLTAGE_DIFFERS, needs=(PACK,))
def _battery_voltage_differs(a: Assessment, pack: Battery) -> Iterator[Finding]:
    own_v = None if a.vehicle.battery is None else a.vehicle.battery.voltage_v
    given_v = pack.voltage_v
    if own_v is None or given_v is None or _LEAST_VOLTAGE <= given_v / own_v <= _MOST_VOLTAGE:
        return
    yield a.finding(
        BATTERY_VOLTAGE_DIFFERS,
        f"battery of {_volts(given_v)}; that of {a.vehicle.name} has {_volts(own_v)}",
    )


BATTERY_COLD = Rule(
    "E122 battery-cold",
    Severity.WARNING,
    summary="The battery is colder than any temperature its data cover.",
    why="A lithium battery gives less the colder it is, and its voltage breaks down under load; the "
    "energy on its label is that of a warm one.",
    how="The temperature given for the battery, else for the air, below 0 °C and below the "
    "temperatures at which its resistance is known; an error below −10 °C.  Not checked without a "
    "temperature.",
    fix="keep the battery warm and give --battery-temperature, or allow for the cold with "
    "--battery-health",
    instead="--battery-temperature",
)


@judges(BATTERY_COLD, needs=(PACK,))
def _battery_cold(a: Assessment, pack: Battery) -> Iterator[Finding]:
    battery_c = a.setup.battery_temperature_c
    air_c = a.setup.temperature_c
    degrees_c = battery_c if battery_c is not None or air_c is None else mean_of(air_c)
    if degrees_c is None:
        return  # the standard atmosphere is no forecast
    known_c = pack.resistance_temperature_c
    coldest_c = _COLD_C if known_c is None else min(known_c[0], _COLD_C)
    if degrees_c >= coldest_c:
        return
    whose = "" if battery_c is not None else " (assumed as cold as the air)"
    known = (
        "its capacity in the cold is unknown"
        if known_c is None
        else f"its resistance is known from {quantity.temperature(known_c[0])} up"
    )
    yield a.finding(
        BATTERY_COLD,
        f"battery at {quantity.temperature(degrees_c)}{whose}: {known}",
        severity=Severity.ERROR if degrees_c < min(coldest_c, _TOO_COLD_C) else None,
    )
