"""Rules on whether the vehicle arms with its battery."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.failsafe import px4_charge, px4_highest_v
from planner.rules.arming import is_checked
from planner.rules.arming_checks import BATTERY
from planner.rules.declaration import PACK, PARAMETERS, judges
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.failsafe import BatteryProfile
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

_ARMS_BY_ITS_OWN = (1, 16)
"""The version from which COM_ARM_BAT_MIN is in place of BAT_CRIT_THR."""

ARMING_REFUSED = Rule(
    "E114 battery-refused-at-arming",
    Severity.ERROR,
    summary="The vehicle would not arm with this battery.",
    why="A vehicle that refuses to arm on the field costs the day.",
    how="PX4: charge at the start below COM_ARM_BAT_MIN, or BAT_CRIT_THR and BAT_EMERGEN_THR where that is "
    "negative (both before 1.16, and where the version is not known), or a voltage above 1.05 BAT1_V_CHARGED "
    "for each of BAT1_N_CELLS.  ArduPilot: "
    "open-circuit voltage at the start below BATT_ARM_VOLT, BATT_LOW_VOLT or BATT_CRT_VOLT, BATT_CAPACITY "
    "below BATT_ARM_MAH, BATT_LOW_MAH or BATT_CRT_MAH, whatever the action, where ARMING_CHECK "
    "and ARMING_SKIPCHK leave the check of the battery on.",
    fix="charge the battery, or correct the parameter",
    instead="--charge, or the parameters of --params",
)


@judges(ARMING_REFUSED, needs=(PACK, PARAMETERS))
def _arming_refused(
    a: Assessment, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding]:
    is_px4 = isinstance(parameters, Px4Parameters)
    if not parameters.measures_battery or not (is_px4 or is_checked(a, BATTERY)):
        return
    profile = profile_of(a)
    if isinstance(parameters, Px4Parameters):
        yield from not_armed_by_px4(a, profile, pack, parameters, "BAT1")
        return
    yield from not_armed_with(a, profile, parameters, "BATT")


def not_armed_by_px4(
    a: Assessment, profile: BatteryProfile, pack: Battery, parameters: Px4Parameters, battery: str
) -> Iterator[Finding]:
    """Yield why PX4 does not arm, by one of its batteries."""
    seen_v, highest_v = profile.rest_v, px4_highest_v(parameters)
    if seen_v is not None and not profile.is_curve_assumed and seen_v[0] > highest_v:
        yield a.finding(
            ARMING_REFUSED,
            f"PX4 does not arm at {quantity.decimals(float(seen_v[0]), 1)} V: with {battery}_N_CELLS "
            f"{parameters.battery_cells} that is over voltage",
        )
    least, name = least_to_arm(a, parameters)
    charge = float(px4_charge(profile, pack, parameters)[0])
    if charge < least:
        by = "" if battery == "BAT1" else f" of {battery}"
        yield a.finding(
            ARMING_REFUSED,
            f"PX4 does not arm at {quantity.beside(charge, least, quantity.percent)} charge{by}: {name} is "
            f"{quantity.percent(least)}",
        )


def not_armed_with(
    a: Assessment, profile: BatteryProfile, parameters: ArduPilotParameters, monitor: str
) -> Iterator[Finding]:
    """Yield why ArduPilot does not arm, by one of its monitors."""
    for name in ("arm_battery_min_v", "battery_low_v", "battery_critical_v"):
        least_v, spelt = getattr(parameters, name), stated_name(parameters, name)
        if spelt and profile.rest_v is not None and profile.rest_v[0] < least_v:
            yield a.finding(
                ARMING_REFUSED,
                f"ArduPilot does not arm at {quantity.voltage(float(profile.rest_v[0]))}: {spelt} is "
                f"{quantity.voltage(least_v)}",
            )
            break
    yield from never_armed_with(a, parameters, monitor)


def never_armed_with(
    a: Assessment, parameters: ArduPilotParameters, monitor: str
) -> Iterator[Finding]:
    """Yield why ArduPilot does not arm with one of its monitors, whatever battery it is on."""
    for name in ("arm_battery_min_ah", "battery_low_ah", "battery_critical_ah"):
        least_ah, spelt = getattr(parameters, name), stated_name(parameters, name)
        is_counted = parameters.measures_current or name == "arm_battery_min_ah"
        if spelt and is_counted and parameters.battery_capacity_ah < least_ah:
            yield a.finding(
                ARMING_REFUSED,
                f"ArduPilot never arms: {spelt} is {quantity.charge_of_ah(least_ah)}, {monitor}_CAPACITY "
                f"{quantity.charge_of_ah(parameters.battery_capacity_ah)}",
            )
            break


def stated_name(parameters: ArduPilotParameters, name: str) -> str:
    """Return the name of a parameter that is stated; empty where its default is assumed."""
    origin = parameters.origins.get(name)
    return "" if origin is None or origin.is_default else origin.name


def least_to_arm(a: Assessment, parameters: Px4Parameters) -> tuple[float, str]:
    """Return the charge PX4 arms with at least, and what says so. [-]

    ``BatteryChecks::checkAndReport``: below what is critical or an emergency it does not; COM_ARM_BAT_MIN
    is in place of that where it is not negative, before 1.16 beside it.
    """
    set_to = (parameters.arm_battery_min_fraction, "COM_ARM_BAT_MIN")
    critical = max(
        (parameters.battery_critical_fraction, "BAT_CRIT_THR"),
        (parameters.battery_emergency_fraction, "BAT_EMERGEN_THR"),
    )
    version = None if a.target is None else a.target.version
    if set_to[0] >= 0.0 and version is not None and version >= _ARMS_BY_ITS_OWN:
        return set_to
    return max(critical, set_to)


def profile_of(a: Assessment) -> BatteryProfile:
    """Return charge and voltage over the flight, of a battery that is known."""
    profile = a.battery_profile
    assert profile is not None  # as of a pack: see the needs of these rules
    return profile
