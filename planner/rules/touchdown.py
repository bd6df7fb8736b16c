"""Rules on how fast a vehicle meets the ground that it lands on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.pilot import habits_of
from planner.flight.returns.destination import HERE
from planner.mission.commands import LANDINGS, RELATIVE_FRAMES, TERRAIN_FRAMES, Command
from planner.mission.route.position import ground_amsl_m
from planner.mission.route.stage import LANDED_STAGES, StageKind
from planner.rules.declaration import ARDUPILOT, PARAMETERS, TERRAIN, judges
from planner.rules.terrain_following import reach_down_m

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found
    from planner.vehicle.parameters.resolve import FlightParameters

_FASTER, _TOO_FAST_M_S = 1.1, 2.0
"""Over the speed of landing, and in all: LAND_SPEED is documented from 0.3 m/s to 2 m/s. [-], [m s⁻¹]"""
_SLOWED_WITHIN_M, _HEIGHTS = 50.0, 501
"""What it takes to slow down from 20 m/s by 4 m/s², and at how many heights speeds are looked up. [m], [-]"""

_LANDING_STARTS = (Command.DO_LAND_START, Command.DO_RETURN_PATH_START)

LANDS_FAST = Rule(
    "T117 lands-fast",
    Severity.ERROR,
    summary="The vehicle may touch the ground before it has slowed down.",
    why="An autopilot that does not measure the ground slows a landing down by its height above home: on a "
    "hill it comes down at the speed of its descent (tried in ArduPilot's simulation, 50 m above home: 'SIM "
    "Hit ground at 4.97 m/s').",
    how="The speed of the descent at the height above home of the ground of --terrain, where the mission "
    "lands or a return leads: ArduPilot without a rangefinder that looks down "
    "(Mode::get_alt_above_ground_cm; TERRAIN_ENABLE gives no data by itself), and PX4, whose range sensor no "
    "parameter names.  ArduCopter 4.7 (--target) by the altitude of a NAV_LAND with a place, where that is "
    "above home.  A warning where it is above 1.1 times LAND_SPEED or MPC_LAND_SPEED; an error above "
    "2 m/s, the most that ArduPilot's LAND_SPEED may be set to.",
    fix="lower the descent speed (LAND_SPEED_HIGH or WPNAV_SPEED_DN, MPC_Z_V_AUTO_DN) to that of the "
    "landing, or land no more than 10 m (LAND_ALT_LOW, MPC_LAND_ALT2 5 m) higher than home",
    instead="the parameters of --params",
)


@judges(LANDS_FAST, needs=(PARAMETERS, TERRAIN))
def _lands_fast(
    a: Assessment, parameters: FlightParameters, _terrain: TerrainGrid
) -> Iterator[Found]:
    places, stages = a.returns.destinations, a.route.stages
    landing = np.array(a.route.rows_of(*LANDED_STAGES), np.intp)
    ground_m = np.array([stages[row].height_m for row in landing.tolist()])
    named_m = [stages[r].named_ground_m if stages[r].lands_by_name else None for r in landing]
    level_m = np.fmax(places.home_datum_m[places.home_of(landing)], np.array(named_m, np.float64))
    above_m = ground_m - level_m
    item: list[int | None] = [stages[row].item for row in landing.tolist()]
    sample = a.returns.sample
    if sample is not None:
        home = np.flatnonzero(sample.destination != HERE)
        targets = places.targets(sample.points.stage, sample.destination, sample.points.stop_m)
        above_m = np.append(above_m, (targets.ground_m[:, 2] - targets.datum_m)[home])
        item += [None] * len(home)
    if not len(above_m):
        return
    worst = int(above_m.argmax())
    if ARDUPILOT.of(a) is not None and reach_down_m(a) is not None:
        return
    speed_m_s, slow_m_s = _touch_down_m_s(parameters, float(above_m[worst]))
    if speed_m_s <= _FASTER * slow_m_s:
        return
    lands = "lands" if item[worst] is not None else "a return lands"
    height = quantity.height(float(above_m[worst]))
    yield a.finding(
        LANDS_FAST,
        f"{lands} {height} above home, where the autopilot may still descend at "
        f"{quantity.speed(speed_m_s)}: it slows down by its height above home",
        item=item[worst],
        severity=None if speed_m_s > _TOO_FAST_M_S else Severity.WARNING,
    )


_HARD_M_S = 1.0
"""Faster than 1.1 times LAND_SPEED only from here on an error: PX4 lands at 0.7 m/s as delivered. [m s⁻¹]"""

LANDS_HARD = Rule(
    "T120 lands-hard",
    Severity.ERROR,
    summary="The parameters, or the altitude of a landing, have the vehicle touch level ground too fast.",
    why="It breaks its landing gear, or falls over with its rotors turning: at the end of the mission, and "
    "on each return.",
    how="The speed at which it comes down to the height of home, by LAND_SPEED (LAND_SPD_MS from 4.7 on), or "
    "MPC_LAND_SPEED and the limits above it, without what a range sensor would take off; on PX4 no slower "
    "than MPC_ACC_UP_MAX can make it between MPC_LAND_ALT1, MPC_LAND_ALT2 and the ground: an error above "
    "2 m/s, the most that ArduPilot's LAND_SPEED may be set to.  A vehicle that does not land is not "
    "judged.  From 4.7 on ArduCopter without a rangefinder that looks down takes the altitude of a NAV_LAND "
    "with a place for that of the ground (ModeAuto::get_alt_above_ground_cm, #30195): an error above "
    "1 m/s where it does not slow down for that, a warning above 1.1 times LAND_SPEED, above ground of "
    "--terrain or level with home, unless --target is an older version; landings behind DO_LAND_START that "
    "only a failsafe leads to, too.  "
    "Flown, 20 m below home: 'SIM Hit ground at 1.50 m/s'.",
    fix="set LAND_SPEED to 0.5 m/s, MPC_LAND_SPEED to 0.7 m/s, as delivered",
    instead="the parameters of --params",
)


@judges(LANDS_HARD, needs=(PARAMETERS,))
def _lands_hard(a: Assessment, parameters: FlightParameters) -> Iterator[Found]:
    speed_m_s, _ = _touch_down_m_s(parameters, 0.0)
    if speed_m_s > _TOO_FAST_M_S + 1e-6:  # files write it in single precision
        yield a.finding(
            LANDS_HARD,
            f"touches the ground at {quantity.speed(speed_m_s)}; vehicles stand "
            f"{quantity.speed(_TOO_FAST_M_S)} at most",
        )
    if ARDUPILOT.of(a) is not None and reach_down_m(a) is None:
        yield from _by_its_altitude(a, parameters)


def _by_its_altitude(a: Assessment, parameters: FlightParameters) -> Iterator[Finding]:
    """Yield the landings that ArduCopter, from 4.7 on, does not slow down, for want of altitude."""
    flown = [
        (stage.item, stage.height_m - stage.named_ground_m, stage.height_m - stage.datum_m)
        for stage in a.route.stages_of(StageKind.LAND)
        if stage.named_ground_m is not None
    ]
    is_named = habits_of(parameters, a.target).lands_by_altitude
    for item, below_m, above_home_m in (*flown, *_landings_of_failsafes(a, is_named=is_named)):
        by_name_m_s, slow_m_s = _touch_down_m_s(parameters, below_m)
        by_home_m_s, _ = _touch_down_m_s(parameters, above_home_m)  # else T117
        if not by_name_m_s > _FASTER * slow_m_s >= by_home_m_s:
            continue
        by, older = ("", "") if is_named else (" from 4.7 on", "; --target for an older version")
        yield a.finding(
            LANDS_HARD,
            f"touches the ground at {quantity.speed(by_name_m_s)}: ArduCopter{by} takes the altitude of the "
            f"landing for that of the ground, which is {quantity.height(below_m)} higher",
            item=item,
            severity=None if by_name_m_s > _HARD_M_S else Severity.WARNING,
            fix=f"give the landing the altitude of the ground, 0 above home where that is level{older}",
        )


def _landings_of_failsafes(
    a: Assessment, *, is_named: bool | None
) -> Iterator[tuple[int, float, float]]:
    """Yield items of landings that only a failsafe or a pilot leads to, and how high their ground is.

    Above their altitude and above home [m]; ``AP_Mission::jump_to_landing_sequence``.
    """
    if is_named is False or not a.mission.numbered(*_LANDING_STARTS):
        return
    terrain, route = a.setup.terrain, a.route
    for number, item in a.mission.numbered(*LANDINGS):
        if number in route.reached or not item.names_place or item.altitude_m is None:
            continue
        latitude_deg, longitude_deg = item.latitude_deg or 0.0, item.longitude_deg or 0.0
        amsl_m = None if terrain is None else ground_amsl_m(terrain, latitude_deg, longitude_deg)
        ground_m = 0.0 if amsl_m is None else amsl_m - route.ground_datum_m
        named_m = item.altitude_m
        if item.frame in TERRAIN_FRAMES:
            named_m += ground_m
        elif item.frame not in RELATIVE_FRAMES:
            named_m -= route.home_amsl_m
        yield number, ground_m - named_m, ground_m


def _touch_down_m_s(parameters: FlightParameters, above_m: float) -> tuple[float, float]:
    """Return how fast a vehicle may meet ground so high above home, and how fast it should. [m s⁻¹]"""
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

    slow_m_s, height_m = parameters.land_speed_m_s, np.array([above_m])
    if isinstance(parameters, ArduPilotParameters):
        from planner.flight.motion.ardupilot.vertical import landing_speed_m_s

        return float(landing_speed_m_s(height_m, parameters)[0]), slow_m_s
    from planner.flight.motion.px4.landing import DescentProfile

    before_m = np.linspace(0.0, _SLOWED_WITHIN_M, _HEIGHTS)
    speed_m_s = DescentProfile.of(parameters).speed_m_s(above_m + before_m)
    # From each height it is no slower at the ground than the acceleration upwards allows.
    squared = speed_m_s**2 - 2.0 * parameters.acceleration_up_m_s2 * before_m
    return math.sqrt(max(float(squared.max()), 0.0)), slow_m_s
