"""Rules on the battery: what it is, and whether it gives what is asked of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.budget import flight_battery
from planner.quantity import mean_of
from planner.rules.declaration import BUDGET, DISCHARGE, PACK, PARAMETERS, POWER, judges
from planner.rules.energy import most_needed_wh
from planner.units import MILLIAMPERE_HOURS_PER_AMPERE_HOUR
from planner.values import replace
from planner.vehicle.pack import LITHIUM_ION, chemistry_of, fits_voltage, lowest_voltage_v
from planner.vehicle.reader import load_chemistry

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, Discharge
    from planner.flight.power import SteadyPower
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.resolve import FlightParameters

_MOST_PACK_FRACTION = 2.0 / 3.0
"""Of the take-off mass that can be battery: a third is left for frame, motors and rotors. [-]"""
_RECORD_H = 4.5
"""No multicopter flew longer on a battery: the record was 4 h 21 min in 2026, before it 3 h 11 min. [h]"""
_USUAL_H = 2.1
"""The record until 2025, 2 h 6 min 7 s: more is not believed of a vehicle nobody described. [h]"""
_MOST_VOLTS, _LARGE_W = 100.0, 10_000.0
"""Speed controllers for multicopters end at 24 cells, 91 V nominal; those beyond lift people."""
_WORN = 0.8
"""Of its label, what a lithium battery holds when it counts as worn out. [-]"""
_COLD_C, _TOO_COLD_C = 0.0, -10.0
"""Below the first a lithium battery gives noticeably less than its label says, below the second by how
much is unknown."""
_IN_THE_COLD = ((-20.0, -10.0, 0.0, 25.0), (0.6, 0.75, 0.8, 1.0))
"""Of its charge what a cell gives at least at each temperature (Samsung SDI, specification of the
INR18650-15L, 7.5, at 6.7 C). [°C], [-]"""
_MUCH_MORE = 1.25
"""Energy of a battery over that of the model's own, above which it is that of another vehicle. [-]"""

VOLTAGE_LOW = Rule(
    "E104 loaded-voltage-low",
    Severity.ERROR,
    summary="Under load the voltage falls below the cut-off before the energy is used up.",
    why="A battery with a third of its energy left can fall below its cut-off the moment power is "
    "drawn: a vehicle landed itself at 3.5 V a cell with 30 % left (ArduPilot #5395).",
    how="V = (E + sqrt(E² − 4 R P)) / 2 at the highest power of each segment of the flight, of holds at "
    "any point of it and of the returns from there, E from the charge left, R at the temperature and age "
    "of the battery; fires where V is below cutoff_voltage_v, or where no current gives the power.  Of a "
    "battery that states no cut-off, 3.0 V a cell of lithium-polymer, 2.5 V of lithium-ion "
    "(models/chemistries).  What a step-response model takes for being later (E108) is taken before.",
    fix="fly a shorter or slower mission, start with a fuller battery, or use one of less resistance",
    instead="--battery or --charge",
)


@judges(VOLTAGE_LOW, needs=(PACK, DISCHARGE))
def _voltage_low(a: Assessment, pack: Battery, discharge: Discharge) -> Iterator[Finding]:
    cutoff_v, assumed = pack.cutoff_voltage_v, ""
    if cutoff_v is None:
        cutoff_v = lowest_voltage_v(pack)
        assumed = f", as of {chemistry_of(pack).name} cells: the battery states none"
    low, late = _low_voltage(a, discharge, cutoff_v), ""
    late_wh = _latest_wh(a) if low is None else 0.0
    if late_wh > 0.0:
        charge = max(a.charge - late_wh / pack.energy_wh, 0.0)
        later = flight_battery(a.flight, replace(a.setup, charge=charge)).discharge
        if later is not None:
            low = _low_voltage(replace(a, discharge=later), later, cutoff_v)
            late = f", with the {quantity.energy(late_wh)} that it may take for being later (E108)"
    if low is not None:
        message, item = low
        limit = f"the cut-off is {quantity.voltage(cutoff_v)}{assumed}"
        yield a.finding(VOLTAGE_LOW, f"{message}{late}; {limit}", item=item)


def _latest_wh(a: Assessment) -> float:
    """Return the most that the flight, or a return with the way there, takes for being later. [Wh]"""
    sample = a.returns.sample
    back_wh = 0.0
    if sample is not None:
        back_wh = float(a.late_return_wh(sample, a.late_returns).max(initial=0.0))
    return max(a.late_wh, back_wh)


def _low_voltage(a: Assessment, discharge: Discharge, cutoff_v: float) -> tuple[str, int] | None:
    """Return what the voltage falls to under load, and at which item; ``None``: not below the cut-off."""
    lowest_v, item = discharge.lowest_voltage_v, a.item_of(discharge.lowest_voltage_segment)
    can_deliver, where = discharge.can_deliver, ""
    is_well = can_deliver and lowest_v >= cutoff_v
    returning = a.return_discharge if is_well and not a.returns_stay_above(cutoff_v) else None
    sample = a.returns.sample
    if returning is not None and sample is not None:
        # First what cannot be delivered, then the lowest.
        worst = np.lexsort((returning.lowest_voltage_v, returning.can_deliver))[0]
        can_deliver = bool(returning.can_deliver[worst])
        lowest_v = float(returning.lowest_voltage_v[worst])
        item = a.item_of(sample.points.segment[worst])
        where = " on the return from here"
    if not can_deliver:
        power = f"the battery cannot deliver the power needed{where}"
        return f"{power}: {quantity.voltage(lowest_v)} left at its terminals", item
    if lowest_v < cutoff_v:
        return f"{quantity.beside(lowest_v, cutoff_v, quantity.voltage)} under load{where}", item
    return None


DISCHARGE_RATE_HIGH = Rule(
    "E110 discharge-rate-high",
    Severity.WARNING,
    summary="The flight draws more current than the battery is rated for.",
    why="Beyond its rate a battery heats up, sags and ages, and its predicted voltage does not hold; "
    "beyond what any battery gives the vehicle falls down.",
    how="Highest predicted current while there is charge left over the charge of the new battery (of a "
    "battery of which only the energy is known, power over energy), above its max_c_rate: a warning.  An "
    "error where it is also above the most that any battery of its kind of cell gives (36 C for "
    "lithium-polymer, 20 C for lithium-ion), or its mean above what one bears until it is empty (20 C and 12 "
    "C) and above the rate: limits and sources in models/chemistries.  Of an unknown kind the limits of "
    "lithium-polymer are an error; without a rate, those of lithium-ion a warning.",
    fix="use a battery of more charge or a higher rate, or fly slower and lighter",
    instead="--battery",
)


@judges(DISCHARGE_RATE_HIGH, needs=(BUDGET, PACK))
def _discharge_rate_high(a: Assessment, budget: BatteryBudget, pack: Battery) -> Iterator[Finding]:
    peak, mean = budget.highest_c_rate, a.totals.mean_power_w / pack.new_energy_wh
    if peak is None:
        peak = a.totals.peak_power_w / pack.new_energy_wh
    rated = pack.max_c_rate
    discharge = a.discharge
    current = (
        "" if discharge is None else f" ({quantity.decimals(discharge.highest_current_a, 0)} A)"
    )
    item = None if discharge is None else a.item_of(discharge.highest_current_segment)
    kinds = [(chemistry_of(pack), Severity.ERROR, "no battery of its kind {} more than {}")]
    if pack.chemistry is None and rated is None:
        kinds.append(
            (
                load_chemistry(LITHIUM_ION),
                Severity.WARNING,
                "its kind is unknown, and one of lithium-ion cells {} at most {}",
            )
        )
    for kind, severity, than in kinds:
        for rate, most, where, gives in (
            (peak, kind.peak_c_rate, current, "gives"),
            (mean, kind.sustained_c_rate, " in the mean", "bears"),
        ):
            if most is not None and rate > max(most, rated or 0.0):
                yield a.finding(
                    DISCHARGE_RATE_HIGH,
                    f"{quantity.beside(rate, most, _c_rate)}{where}; "
                    + than.format(gives, _c_rate(most)),
                    severity=severity,
                    item=item,
                )
                return
    if rated is not None and peak > rated:
        yield a.finding(
            DISCHARGE_RATE_HIGH,
            f"{quantity.beside(peak, rated, _c_rate)}{current}; the battery is rated for "
            f"{_c_rate(rated)}",
            item=item,
        )


def _c_rate(rate: float) -> str:
    return f"{quantity.decimals(rate, 1)} C"


BATTERY_VOLTAGE_DIFFERS = Rule(
    "E121 battery-voltage-differs",
    Severity.ERROR,
    summary="The battery has another voltage than the vehicle's own.",
    why="A battery of fewer cells does not turn the rotors fast enough, one of more burns the speed "
    "controllers; usually the battery of another vehicle was typed.  A vehicle on the line that measures "
    "another voltage has another battery than the check counts with, or an empty one.",
    how="Nominal voltage of the battery over that of the model's own: less than 0.85 or more than "
    "1.18, so that one cell of six fewer is outside and another chemistry of as many cells is not; and more "
    "than 3.9 V for each of its cells, which no label has: one cell more, or the voltage when full typed for "
    "the nominal one.  Likewise the voltage that a vehicle on the line measures, with the drop over the "
    "battery's resistance, over the open-circuit voltage at the charge it reports (the nominal voltage where "
    "the battery has no curve), and above 4.4 V a cell.",
    fix="give the battery that flies with --battery, or the model of the vehicle it is made for",
    instead="--battery",
)


@judges(BATTERY_VOLTAGE_DIFFERS, needs=(PACK,))
def _battery_voltage_differs(a: Assessment, pack: Battery) -> Iterator[Finding]:
    own = a.vehicle.battery
    if own is None or fits_voltage(pack, own):
        return
    own_v, given_v = own.voltage_v, pack.voltage_v
    assert own_v is not None  # without them it fits
    assert given_v is not None
    path = _settings_with_battery(a)
    origin = "" if path is None else f" from {path}"
    yield a.finding(
        BATTERY_VOLTAGE_DIFFERS,
        f"battery of {quantity.voltage(given_v)}{origin}; that of {a.vehicle.name} has "
        f"{quantity.voltage(own_v)}",
        fix=None if path is None else _name_battery(path),
    )


def _settings_with_battery(a: Assessment) -> str | None:
    """Return the settings file that the battery is from; ``None``: it is from none."""
    file = a.setup.settings_file
    return None if file is None or "battery" not in dict(file.values) else str(file.path)


def _name_battery(path: str) -> str:
    return f"give the battery that flies with --battery: it goes before {path}"


CAPACITY_SETTING_DIFFERS = Rule(
    "P111 capacity-setting-differs",
    Severity.WARNING,
    summary="The vehicle is set to a battery of another capacity than the check counts with.",
    why="The charge that the vehicle reports, and its failsafes by charge, are counted from this setting: "
    "set too large it reports half a battery that is empty; set by hand to the battery that is in, the "
    "check counts with another one.",
    how="BATT_CAPACITY, BAT1_CAPACITY of --params or of the vehicle on the line, alone and together with "
    "the other batteries it measures, below 0.8 or above 1.25 times the charge of the battery: a lithium "
    "battery counts as worn out at 80 % of its label, and setting and model may each be of the label or of "
    "the worn one.  Not where the vehicle measures no battery, or the setting is 0 or less.",
    fix="set the capacity to that of the battery that flies, or give --battery the one that does",
)


@judges(CAPACITY_SETTING_DIFFERS, needs=(PACK, PARAMETERS))
def _capacity_setting_differs(
    a: Assessment, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding]:
    origin, set_ah = parameters.origins["battery_capacity_ah"], parameters.battery_capacity_ah
    is_set = origin.is_file and parameters.measures_battery and set_ah > 0.0
    if not is_set or pack.charge_ah is None:
        return
    numbers = {} if a.setup.parameters is None else a.setup.parameters.numbers()
    all_ah = set_ah + sum(_other_capacities_ah(numbers))
    least_ah, most_ah = _WORN * pack.charge_ah, pack.charge_ah / _WORN
    if any(least_ah <= one_ah <= most_ah for one_ah in (set_ah, all_ah)):
        return
    set_to, held = (quantity.charge_of_ah(one_ah) for one_ah in (set_ah, pack.charge_ah))
    yield a.finding(
        CAPACITY_SETTING_DIFFERS, f"{origin.name} is {set_to}; the battery of this check has {held}"
    )


def _other_capacities_ah(numbers: Mapping[str, float]) -> Iterator[float]:
    """Yield the capacities of the second to ninth battery, as far as the vehicle measures them."""
    for number in range(2, 10):
        ardupilot_mah = numbers.get(f"BATT{number}_CAPACITY", 0.0)
        px4_mah = numbers.get(f"BAT{number}_CAPACITY", 0.0)
        if numbers.get(f"BATT{number}_MONITOR", 0.0) > 0.0:
            yield max(ardupilot_mah, 0.0) / MILLIAMPERE_HOURS_PER_AMPERE_HOUR
        if numbers.get(f"BAT{number}_SOURCE", -1.0) >= 0.0:
            yield max(px4_mah, 0.0) / MILLIAMPERE_HOURS_PER_AMPERE_HOUR


BATTERY_COLD = Rule(
    "E122 battery-cold",
    Severity.WARNING,
    summary="The battery is colder than any temperature its data cover.",
    why="A lithium battery gives less the colder it is, and its voltage breaks down under load; the "
    "energy on its label is that of a warm one.",
    how="The temperature given for the battery, else for the air, below 0 °C and below the "
    "temperatures at which its resistance is known.  An error below −10 °C, and where what a cell gives at "
    "least at that temperature (80 % at 0 °C, 75 % at −10 °C: Samsung SDI, INR18650-15L) is empty before the "
    "landing or before the tightest return has landed.  Not checked without a temperature.",
    fix="keep the battery warm, and give its temperature with --battery-temperature",
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
    least, told = float(np.interp(degrees_c, *_IN_THE_COLD)), ""
    left_wh = math.inf
    if a.battery is not None:
        left_wh = least * a.battery.usable_wh - most_needed_wh(a, a.battery)
        kept = f"with {quantity.percent(least)} of its energy, what a cell gives at least,"
        if left_wh < 0.0:
            told = f"; {kept} it is empty before the landing or a return"
        elif left_wh < a.battery.reserve_wh:
            short_wh = a.battery.reserve_wh - left_wh
            told = (
                f"; {kept} the landing or a return is {quantity.energy(short_wh)} below the reserve"
            )
    yield a.finding(
        BATTERY_COLD,
        f"battery at {quantity.temperature(degrees_c)}{whose}: {known}{told}",
        severity=Severity.ERROR
        if left_wh < 0.0 or degrees_c < min(coldest_c, _TOO_COLD_C)
        else None,
    )


BATTERY_IMPOSSIBLE = Rule(
    "E123 battery-impossible",
    Severity.ERROR,
    summary="No such battery flies on such a vehicle.",
    why="A slip of the unit or of a digit, mAh as Ah or 4000 Wh for 400, makes every flight a go.",
    how="The least mass of the battery, its energy over that of the best battery of its kind of cell "
    "(380 Wh/kg for lithium-polymer, models/chemistries), above two thirds of the model's take-off "
    "mass; hover of the full battery, as new, at the vehicle's power above 4.5 h, the record of battery "
    "multicopters being 4 h 21 min, and above 2.1 h for a battery given to a model that knows neither "
    "its mass nor a battery of its own; more than 100 V where a hover takes less than 10 kW.",
    fix="correct the battery; one that is right stands in the [battery] of the vehicle model, with its "
    "mass in mass_kg",
    instead="--battery",
)


@judges(BATTERY_IMPOSSIBLE, needs=(POWER, PACK))
def _battery_impossible(a: Assessment, _power: SteadyPower, pack: Battery) -> Iterator[Finding]:
    vehicle, kind = a.vehicle, chemistry_of(pack)
    highest_wh_kg, mass_kg = kind.highest_wh_kg, vehicle.mass_kg
    least_kg = 0.0 if highest_wh_kg is None else pack.new_energy_wh / highest_wh_kg
    is_counted = a.setup.flown_pack.is_own or (
        vehicle.knows_mass and mass_kg is not None and vehicle.battery is not None
    )
    longest_h = _RECORD_H if is_counted or mass_kg is not None else _USUAL_H
    hover_w = a.flight.hover_near_home_w
    hover_h = pack.new_energy_wh / hover_w if hover_w > 0.0 else 0.0
    holds = quantity.energy(pack.new_energy_wh)
    if mass_kg is not None and least_kg > _MOST_PACK_FRACTION * mass_kg:
        message = (
            f"battery of {holds} weighs {quantity.mass(least_kg)} or more; {vehicle.name} weighs "
            f"{quantity.mass(mass_kg)} in all"
        )
    elif hover_h > longest_h:
        message = (
            f"battery of {holds} would hover {quantity.duration(3600.0 * hover_h)} at "
            f"{quantity.power(hover_w)}; no such multicopter hovers longer than "
            f"{quantity.duration(3600.0 * longest_h)}"
        )
    elif (pack.voltage_v or 0.0) > _MOST_VOLTS and hover_w < _LARGE_W:
        message = (
            f"battery of {quantity.voltage(pack.voltage_v or 0.0)} for a hover at {quantity.power(hover_w)}; "
            f"multicopters of less than {quantity.power(_LARGE_W)} have at most "
            f"{quantity.voltage(_MOST_VOLTS)}"
        )
    else:
        return
    yield a.finding(BATTERY_IMPOSSIBLE, message)


BATTERY_ASSUMED = Rule(
    "E125 battery-assumed",
    Severity.INFO,
    summary="What the battery is made of, weighs or holds was assumed.",
    why="A label names energy, charge or voltage; failsafes look at volts under load, and a larger "
    "battery has to be lifted.",
    how="A battery given as --battery 8Ah@22.2V or 177Wh has the cells of the model's own, its curve "
    "scaled to the voltage and its resistance to the charge, where the voltage fits; without such a "
    "battery the cells in series that its voltage means, lithium-ion up to 3.65 V a cell and "
    "lithium-polymer above.  What it holds more than the model's "
    "own it weighs more, by the typical energy over mass of its kind of cell (175 Wh/kg, "
    "models/chemistries); a smaller one is taken to weigh as much.  A charge given as a voltage, --charge "
    "16.2V, is read off the curve of its kind of cell: it has to be measured without load.  A warning where "
    "a settings file has a battery of more than 1.25 times the energy of the model's own: it may be another "
    "vehicle's.",
    fix="put the battery that flies into the [battery] of the vehicle model, its mass into mass_kg",
)


@judges(BATTERY_ASSUMED, needs=(PACK,))
def _battery_assumed(a: Assessment, pack: Battery) -> Iterator[Finding]:
    flown, own, path = a.setup.flown_pack, a.vehicle.battery, _settings_with_battery(a)
    if path is not None and own is not None and own.new_energy_wh > 0.0:
        times = pack.new_energy_wh / own.new_energy_wh
        if times > _MUCH_MORE:
            yield a.finding(
                BATTERY_ASSUMED,
                f"battery of {quantity.energy(pack.new_energy_wh)} from {path}; that of {a.vehicle.name} has "
                f"{quantity.energy(own.new_energy_wh)}",
                severity=Severity.WARNING,
                fix=_name_battery(path),
            )
    if flown.assumed:
        yield a.finding(BATTERY_ASSUMED, f"battery assumed to have {flown.assumed}")
    if a.setup.rest_voltage_v is not None:
        yield a.finding(
            BATTERY_ASSUMED,
            f"charge of {quantity.percent(a.charge)} taken from {quantity.exact(a.setup.rest_voltage_v)} V "
            "without load, by the curve of the battery's cells",
        )
    if flown.added_kg > 0.0 and a.vehicle.mass_kg is not None:
        more_wh = pack.new_energy_wh - (0.0 if own is None else own.new_energy_wh)
        yield a.finding(
            BATTERY_ASSUMED,
            f"battery {quantity.mass(flown.added_kg)} heavier than the model's own for "
            f"{quantity.energy(more_wh)} more: counted in the take-off mass",
        )
