"""Rules about what files leave open, and what it may take at most.

A mission's: where it takes off, how long another maker's drone waits; a battery's: its resistance.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState
from planner.flight.motion.px4.headings import TURNS_FIRST
from planner.flight.motion.px4.moves import SHORTEST_L1_M
from planner.flight.motion.px4.pilot import HEADING_ASSUMED
from planner.flight.motion.px4.weaving import WEAVES
from planner.flight.pilot import CONDITION_NOT_MODELLED
from planner.flight.prediction import HOVER_HEIGHT_M
from planner.flight.returns.destination import SETTING_NOT_FOLLOWED
from planner.mission.commands import Command
from planner.mission.route.route import HOME_UNKNOWN
from planner.mission.route.stage import StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.rules.assessment import numbers
from planner.rules.declaration import (
    ARDUPILOT,
    BUDGET,
    FENCE,
    PACK,
    PROFILE,
    PX4,
    TERRAIN,
    NotEvaluated,
    judges,
)
from planner.units import wh_from_j
from planner.vehicle.pack import LIPO_CELL_V, chemistry_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters

IN_SIGHT_M = 500.0
"""How far from its first place a mission without a home is taken to begin: as far as a small multicopter is
seen. [m]"""

ACTIONS_NOT_COUNTED = Rule(
    "E131 actions-not-counted",
    Severity.WARNING,
    summary="What a drone does at its points takes time that is not predicted.",
    why="DJI's and Litchi's missions stop for photos, recordings and turns; the file says of hovers only how "
    "long they are.",
    how="6 s for each photo, beginning and end of a recording, turn of the gimbal or of the vehicle, at the "
    "power of a hover: DJI's waypoint missions go on with the next action after that "
    "(DJIWaypointActionType).  An error where the margin does not hold it, and where nothing says how long "
    "an action lasts: panoramas, scans, hovers that no point triggers, unknown actions.",
    fix="write the mission as a plan (mavjoule convert), with a hold at each point, and check that",
    instead="a mission with its holds",
)


@judges(ACTIONS_NOT_COUNTED)
def _actions_not_counted(a: Assessment) -> Iterator[Finding]:
    wait_s = a.mission.unstated_wait_s
    if not wait_s > 0.0:
        return
    if math.isinf(wait_s):
        message = "actions at points last nobody knows how long: not counted"
        yield a.finding(ACTIONS_NOT_COUNTED, message, severity=Severity.ERROR)
        return
    needed_wh = wh_from_j(a.flight.hover_near_home_w * wait_s)
    short = _short_of_reserve(a, needed_wh)
    yield a.finding(
        ACTIONS_NOT_COUNTED,
        f"actions at points may take {quantity.duration(wait_s)} and {quantity.energy(needed_wh)} more than "
        f"predicted{short}",
        severity=Severity.ERROR if short else None,
    )


def _short_of_reserve(a: Assessment, needed_wh: float) -> str:
    """Return in words how far what is not predicted goes below the reserve; empty: it does not.

    What is short as predicted is that of E101 and E102.
    """
    if any(one.predicted_wh < 0.0 for one in a.margins):
        return ""
    short_wh = needed_wh - a.left_wh
    if not math.isfinite(short_wh) and short_wh > 0.0:
        return "; nothing is left for it above the reserve"
    return f"; {quantity.energy(short_wh)} short of the reserve" * (short_wh > 0.0)


@judges(CONDITION_NOT_MODELLED, needs=(BUDGET, PACK))
def _resistance_not_counted(
    a: Assessment, budget: BatteryBudget, pack: Battery
) -> Iterator[Finding]:
    """Report the age of a battery whose resistance nobody knows: what it may take is that of poor cells."""
    factor = a.setup.battery_resistance_factor
    if a.discharge is not None or factor is None:
        return
    plan, kind = a.return_plan, chemistry_of(pack)
    back_wh = budget.margin_wh if plan is None or plan.margin_wh is None else plan.margin_wh
    drawn_wh = max(a.totals.energy_wh, budget.above_reserve_wh - back_wh)
    drop = _voltage_lost(a, pack, factor - 1.0)
    taken_wh = drop / (1.0 - drop) * drawn_wh
    rest_v = float(np.interp(budget.reserve_fraction, kind.ocv_soc, kind.cell_ocv_v))
    is_low = (1.0 - drop) * rest_v < (kind.lowest_cell_v or 0.0)
    is_short = taken_wh > 0.0 and bool(_short_of_reserve(a, taken_wh))
    may = f"; it may take {quantity.energy(taken_wh)} more" if taken_wh > 0.0 else ""
    if is_short and not is_low:
        may += " than there is above the reserve"
    if is_low:
        may = f"; under load its cells may fall below {quantity.voltage(kind.lowest_cell_v or 0.0)}"
    yield a.finding(
        CONDITION_NOT_MODELLED,
        "battery resistance not counted: the battery has no open-circuit voltage or no resistance"
        + may,
        severity=Severity.ERROR if is_low or is_short else None,
        fix="use a vehicle model whose battery has both",
    )


def _voltage_lost(a: Assessment, pack: Battery, added: float) -> float:
    """Return the part of its voltage that a battery loses at the highest power by added resistance.

    A current in C through the resistance of a cell of 1 Ah drops as much as that of any cell: 9 of 10 have
    no more than the prior's.  ``added`` is over that of the new battery. [-]
    """
    from planner.vehicle.priors import multicopter_priors

    sample = a.returns.sample
    highest_w = max(a.totals.peak_power_w, 0.0 if sample is None else sample.demand[0])
    cell_v = LIPO_CELL_V
    if pack.cells_in_series is not None and pack.voltage_v is not None:
        cell_v = pack.voltage_v / pack.cells_in_series
    drop = added * multicopter_priors()["cell_resistance"].high * highest_w / pack.new_energy_wh
    return 0.5 * (1.0 - math.sqrt(max(1.0 - 4.0 * max(drop, 0.0) / cell_v, 0.0)))


@judges(HOME_UNKNOWN, needs=(BUDGET,))
def _home_unknown(a: Assessment, _budget: BatteryBudget) -> Iterator[Finding]:
    speed_m_s = getattr(a.own_parameters, "cruise_speed_m_s", a.setup.vehicle.default_speed_m_s)
    wait_s = a.mission.unstated_wait_s
    if a.mission.home is not None or not speed_m_s or math.isinf(wait_s):
        return
    hover_w = a.flight.hover_near_home_w
    mean_w = a.totals.mean_power_w or hover_w
    way_wh = wh_from_j(max(hover_w, mean_w) * 2.0 * IN_SIGHT_M / speed_m_s)
    waited_wh = wh_from_j(hover_w * wait_s)
    left_wh, short = a.left_wh - waited_wh, _short_of_reserve(a, way_wh + waited_wh)
    if not short:
        if way_wh > 0.0 and 0.0 <= left_wh < math.inf:
            farthest = quantity.distance(IN_SIGHT_M * left_wh / way_wh)
            yield a.finding(
                HOME_UNKNOWN,
                f"no home in the file: the battery lasts for a take-off up to {farthest} from the first "
                "place; from farther away it is not checked",
            )
        return
    yield a.finding(
        HOME_UNKNOWN,
        f"no home in the file: from {quantity.distance(IN_SIGHT_M)} away the way there and back takes "
        f"{quantity.energy(way_wh)} more{short}",
        severity=Severity.ERROR,
    )


_REQUIRED = 2
"""A precision landing that searches for its target (PX4, ``PrecLandMode::Required``)."""


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _target_searched(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding | NotEvaluated]:
    """Report landings that search for a target: ``PrecLand::run_state_search``, no longer than so often.

    ``switch_to_state_search`` climbs to PLD_SRCH_ALT; where the time is up the vehicle lands from there.
    """
    landings = a.mission.numbered(Command.NAV_LAND)
    searching = {number for number, item in landings if item.param2 == _REQUIRED}
    items = [one.item for one in a.route.stages if searching and one.item in searching]
    by_return = parameters.return_precision_landing == _REQUIRED
    if not items and not by_return:
        return
    search_s = parameters.target_searches * parameters.target_search_s
    from_m = [
        before.height_m for before, stage in pairwise(a.route.stages) if stage.item in searching
    ]
    from_m += [parameters.return_descend_altitude_m] * by_return
    lowest_m, climb_m_s = min(from_m, default=0.0), parameters.climb_speed_m_s
    up_m = min(parameters.target_search_height_m - lowest_m, climb_m_s * search_s)
    up_m = max(up_m, 0.0)
    hover_w = a.flight.hover_near_home_w
    longer_s = search_s + up_m / parameters.descent_speed_m_s
    more_w = max(_climb_w(a, climb_m_s) - hover_w, 0.0)
    needed_wh = wh_from_j(hover_w * longer_s + more_w * up_m / climb_m_s)
    short = _short_of_reserve(a, needed_wh)
    asked = "RTL_PLD_MD 2" if by_return else "NAV_LAND with a precision landing that is required"
    climbs = f"climbs by {quantity.height(up_m)} and " if up_m > 0.0 else ""
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"{asked}: where it sees no target it {climbs}searches for it, up to {quantity.duration(longer_s)}"
        + f" and {quantity.energy(needed_wh)}" * math.isfinite(needed_wh)
        + f" that are not predicted{short}",
        item=items[0] if items else None,
        severity=Severity.ERROR if short else None,
    )
    if up_m > 0.0:
        yield from _searched_too_high(a, max(from_m, default=0.0), lowest_m + up_m)


_OPPORTUNISTIC = 1
"""A precision landing that goes on where it sees no target (``PrecLandMode::Opportunistic``)."""
_ON_ITS_PLACE_M = 3.0
"""How far from its place a landing is still on it: an estimate of a position is no better. [m]"""


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _target_missed(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report landings that come down beside their place: ``PrecLand::run_state_start``.

    Without a target in sight, the vehicle lands where it is as its place counts as reached
    (``switch_to_state_fallback``): flown with NAV_ACC_RAD 15, 13 m short of it.
    """
    radius_m = parameters.acceptance_radius_m
    if radius_m <= _ON_ITS_PLACE_M:
        return
    for number, item in a.mission.numbered(Command.NAV_LAND):
        if item.param2 == _OPPORTUNISTIC:
            yield a.finding(
                SETTING_NOT_FOLLOWED,
                "NAV_LAND with an opportunistic precision landing: where it sees no target it lands where it "
                f"is by then, up to {quantity.distance(radius_m)} (NAV_ACC_RAD) short of its place",
                item=number,
                fix="set NAV_ACC_RAD to 2, or the second parameter of NAV_LAND to 0",
            )


def _climb_w(a: Assessment, climb_m_s: float) -> float:
    """Return the power of a climb low over home. [W]"""
    place_m = np.array([[0.0], [0.0], [HOVER_HEIGHT_M]])
    zero = np.zeros(1)
    state = KinematicState.of(place_m, (zero, zero, np.array([climb_m_s])))
    climbing = np.array([STATE_INDEX[FlightState.CLIMB]])
    return float(a.flight.power.power_w(state, climbing, zero)[0])


def _searched_too_high(a: Assessment, from_m: float, top_m: float) -> Iterator[NotEvaluated]:
    """Yield the limits of height that a search for a target climbs beyond."""
    from planner.rules.fence_height import FENCE_HEIGHT
    from planner.rules.fence_settings import limits_in_use
    from planner.rules.site import TOO_HIGH_FOR_SITE

    profile = a.setup.profile
    for rule, limit_m in (
        (FENCE_HEIGHT, limits_in_use(a.route, a.own_parameters).ceiling_m),
        (TOO_HIGH_FOR_SITE, None if profile is None else profile.max_height_above_home_m),
    ):
        if limit_m is not None and from_m <= limit_m < top_m:
            yield NotEvaluated(
                rule=rule,
                asked_by=f"PLD_SRCH_ALT, {quantity.height(top_m)} above home",
                needs=f"one below {quantity.height(limit_m)}",
            )


_NONE_SEEN_S = 7.0
"""``FAILSAFE_INIT_TIMEOUT_MS`` of AC_PrecLand_StateMachine.cpp. [s]"""


@judges(SETTING_NOT_FOLLOWED, needs=(ARDUPILOT,))
def _target_lost(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Report landings that wait for a target (``AC_PrecLand_StateMachine::get_target_lost_actions``).

    Where it sees none at all it stands in the air first (``get_failsafe_actions``): flown 7.0 s.
    """
    strictness = parameters.precision_strictness if parameters.precision_landing else 0
    if not strictness:
        return
    hovers, short = strictness > 1, ""
    then = "then stays in the air"
    if not hovers:
        needed_wh = wh_from_j(a.flight.hover_near_home_w * _NONE_SEEN_S)
        short = _short_of_reserve(a, needed_wh)
        then = (
            f"where it sees none it stands in the air for {quantity.duration(_NONE_SEEN_S)} first"
            + f", which takes {quantity.energy(needed_wh)}" * math.isfinite(needed_wh)
            + f"; neither is predicted{short}"
        )
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"PLND_STRICT {strictness}: a landing that loses its target climbs and tries again, and {then}",
        severity=Severity.ERROR if hovers or short else None,
        fix="set PLND_STRICT to 0, or PLND_ENABLED to 0 where no target is set up",
    )


_GAINS = {
    **dict.fromkeys(("PSC_NE_VEL_P", "PSC_VELXY_P"), 2.0),
    **dict.fromkeys(("PSC_NE_VEL_I", "PSC_VELXY_I"), 1.0),
    **dict.fromkeys(("PSC_NE_POS_P", "PSC_POSXY_P"), 1.0),
    **dict.fromkeys(("PSC_D_POS_P", "PSC_POSZ_P"), 1.0),
    **dict.fromkeys(("PSC_D_VEL_P", "PSC_VELZ_P"), 5.0),
    **dict.fromkeys(("PSC_JERK_D", "PSC_JERK_Z"), 5.0),
}
"""Gains of the way and the height that are taken at their defaults, as ArduCopter calls them from 4.7 on and
before."""
_WEAK = 0.8
"""Of a default, from which on a gain changes no flight by more than predictions are good to. [-]"""
_WAITS = 0.1
"""Of the energy of a flight: with a stop every 30 m and gains of 1 and 0.3 a build flew 8 % longer. [-]"""


@judges(SETTING_NOT_FOLLOWED, needs=(ARDUPILOT,))
def _gains_not_read(a: Assessment, _parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Report weak gains, with which a vehicle takes longer to its stops and heights."""
    given = numbers(a)
    weak = [name for name, default in _GAINS.items() if given.get(name, default) < _WEAK * default]
    if not weak:
        return
    needed_wh = _WAITS * a.totals.energy_wh
    short = _short_of_reserve(a, needed_wh)
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"{', '.join(f'{name} {given[name]:g}' for name in weak)}: predicted with the defaults; with weaker "
        f"gains stops and heights take longer, which may take {quantity.energy(needed_wh)} more{short}",
        severity=Severity.ERROR if short else None,
    )


_TUNES_SPEED, _TUNING = 10.0, 219.0
"""TUNE of the speed of waypoints, and the RCx_OPTION of the knob that tunes."""


@judges(SETTING_NOT_FOLLOWED, needs=(ARDUPILOT,))
def _speed_by_knob(a: Assessment, _parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Report a knob that sets the speed: flown with TUNE_MIN 100, 140.4 s for 78.6."""
    given = numbers(a)
    if given.get("TUNE") != _TUNES_SPEED:
        return
    knobs = [n for n in range(1, 17) if given.get(f"RC{n}_OPTION") == _TUNING]
    by = f"RC{knobs[0]}_OPTION 219" if knobs else "RC6, before RCx_OPTION 219 chose it"
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"TUNE 10: the knob of {by} sets the speed of waypoints between TUNE_MIN and TUNE_MAX, which is not "
        "predicted",
        severity=Severity.ERROR if knobs else None,
        fix="set TUNE to 0",
    )


_HELD_UP = frozenset({StageKind.GO, StageKind.LOITER, StageKind.CHANGE_HEIGHT})
"""Kinds of stages whose descents NAV_MIN_GND_DIST ends."""
_MEASURES_NO_CURRENT = frozenset({0.0, 3.0})
"""BATT_MONITOR of none, and of a voltage alone."""


@judges(SETTING_NOT_FOLLOWED, needs=(PX4,))
def _descents_stopped(a: Assessment, _parameters: Px4Parameters) -> Iterator[Finding]:
    """Report descents that PX4 stops above the place they lead to, where its range finder says so.

    Flown with NAV_MIN_GND_DIST 12: 10.7 m for a place at 5 m, which counts as reached there
    (``MissionBlock::mission_item_reached``'s "Terrain collision risk, descent is stopped").
    """
    least_m = numbers(a).get("NAV_MIN_GND_DIST", -1.0)
    if least_m <= 0.0:
        return
    from planner.rules.terrain_following import ends_above_ground_m

    stages, above_m = a.route.stages, ends_above_ground_m(a)
    low = [
        row
        for row, stage in enumerate(stages)
        if row
        and stage.kind in _HELD_UP
        and stage.height_m < stages[row - 1].height_m
        and above_m[row] < least_m
    ]
    if low:
        items = len({stages[row].item for row in low})
        others = f", and at {quantity.count(items - 1, 'more item')}" if items > 1 else ""
        yield a.finding(
            SETTING_NOT_FOLLOWED,
            f"NAV_MIN_GND_DIST {least_m:g}: with a range finder PX4 sinks no lower above the ground; "
            f"predicted down to {quantity.height(float(above_m[low[0]]))}{others}",
            item=stages[low[0]].item,
            fix="fly higher than NAV_MIN_GND_DIST, or set it to -1",
        )


@judges(SETTING_NOT_FOLLOWED, needs=(ARDUPILOT, BUDGET))
def _throttle_limited(
    a: Assessment, _parameters: ArduPilotParameters, budget: BatteryBudget
) -> Iterator[Finding | NotEvaluated]:
    """Report a limit of current that the flight passes: it takes thrust away.

    ``AP_MotorsMulticopter::get_current_limit_max_throttle``: down to MOT_THST_HOVER and a fifth of the rest.
    """
    values = numbers(a)
    limit_a = values.get("MOT_BAT_CURR_MAX", 0.0)
    if limit_a <= 0.0 or values.get("BATT_MONITOR") in _MEASURES_NO_CURRENT:
        return
    asked = f"MOT_BAT_CURR_MAX {limit_a:g}"
    voltage_v = budget.lowest_voltage_v or (a.pack.voltage_v if a.pack else None)
    if voltage_v is None:
        yield NotEvaluated(
            rule=SETTING_NOT_FOLLOWED, asked_by=asked, needs="a battery whose voltage is known"
        )
        return
    hover_a, peak_a = a.flight.hover_near_home_w / voltage_v, a.totals.peak_power_w / voltage_v
    if peak_a <= limit_a:
        return
    hovers = hover_a < limit_a
    most_a = quantity.decimals(peak_a if hovers else hover_a, 0)
    yield a.finding(
        SETTING_NOT_FOLLOWED,
        f"{asked}: {'the flight' if hovers else 'a hover'} takes up to {most_a} A: ArduPilot takes thrust "
        + ("away, and climbs more slowly" if hovers else "away, and may not hold its height"),
        severity=None if hovers else Severity.ERROR,
        fix="set MOT_BAT_CURR_MAX to 0, or above what the flight takes",
    )


@judges(ITEM_NOT_MODELLED, needs=(PX4,))
def _waits_on_the_way(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report waits behind a LOITER_TO_ALT left on its tangent: PX4 flies there meanwhile."""
    told: set[int] = set()
    for loiter, wait in pairwise(a.route.stages):
        radius_m = abs(loiter.radius_m) or parameters.loiter_radius_m
        is_left = loiter.kind is StageKind.CHANGE_HEIGHT and loiter.leaves_on_tangent
        waits = wait.kind is StageKind.DELAY and wait.hold_s > 0.0
        if is_left and waits and wait.item not in {*told, loiter.item}:  # a jump's rounds are its
            told.add(wait.item)
            yield a.finding(
                ITEM_NOT_MODELLED,
                f"NAV_DELAY behind LOITER_TO_ALT with parameter 4 above 0: PX4 flies on to its tangent, "
                f"{quantity.distance(radius_m)} from its place, meanwhile, which is not predicted",
                severity=Severity.ERROR,
                item=wait.item,
                fix="give LOITER_TO_ALT 0 as parameter 4, or put NAV_DELAY before it",
            )


@judges(ITEM_NOT_MODELLED, needs=(PX4,))
def _flies_on_turning(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report a LOITER_TO_ALT passed from afar at which PX4 turns from a heading that is not known.

    It flies on towards its place for as long.  Flown, armed towards it: no wait, and 26 m beside.
    """
    turning = {one.item for one in a.flight.motion.findings if one.code == HEADING_ASSUMED.code}
    for item, reached in _passed_from_afar(a, parameters):
        if item in turning:
            turning.discard(item)
            yield a.finding(
                ITEM_NOT_MODELLED,
                f"{reached}, and PX4 flies on to its place while it turns to its heading, for a time that is "
                "not known (T119)",
                severity=Severity.ERROR if _is_limited_sideways(a) else Severity.WARNING,
                item=item,
                fix="give --heading, or LOITER_TO_ALT a radius (parameter 2) of 5 m or less",
            )


@judges(ITEM_NOT_MODELLED, needs=(PX4,))
def _left_turning_first(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Report LOITER_TO_ALT passed from afar by PX4 that turns to its heading first, hardly moving.

    Of 53 drawn flights with MPC_YAW_MODE 4 five were 4 to 15 m beside what was predicted, and T125 silent.
    """
    passed = next(_passed_from_afar(a, parameters), None)
    if parameters.yaw_mode == TURNS_FIRST and passed is not None:
        item, reached = passed
        yield a.finding(
            ITEM_NOT_MODELLED,
            f"{reached}, and MPC_YAW_MODE 4 turns to the next heading first: where PX4 flies from there is "
            "certain to some 15 m only",
            severity=Severity.ERROR if _is_limited_sideways(a) else Severity.WARNING,
            item=item,
            fix="give LOITER_TO_ALT a radius (parameter 2) of 5 m or less, or set MPC_YAW_MODE 0",
        )


def _passed_from_afar(a: Assessment, parameters: Px4Parameters) -> Iterator[tuple[int, str]]:
    """Yield each LOITER_TO_ALT that counts as reached farther away than legs are steered for, and that."""
    for stage in a.route.stages_of(StageKind.CHANGE_HEIGHT):
        radius_m = abs(stage.radius_m) or parameters.loiter_radius_m
        if radius_m > SHORTEST_L1_M:
            yield (
                stage.item,
                f"LOITER_TO_ALT counts as reached within {quantity.distance(radius_m)}",
            )


@judges(ITEM_NOT_MODELLED, needs=(PX4,))
def _either_way(a: Assessment, _parameters: Px4Parameters) -> Iterator[Finding]:
    """Report legs that may be flown in two ways, of which that not predicted is judged by nothing."""
    open_items = {
        one.item
        for one in a.flight.motion.findings
        if one.code == WEAVES.code and one.severity is Severity.WARNING
    }
    if not _is_limited_sideways(a):
        return
    for item in sorted(filter(None, open_items)):
        yield a.finding(
            ITEM_NOT_MODELLED,
            "PX4 may fly to this place in two ways (T125): that which is not predicted is not checked",
            severity=Severity.ERROR,
            item=item,
            fix="as T125 says",
        )


def _is_limited_sideways(a: Assessment) -> bool:
    """Return whether it matters where on the map a flight is: a ceiling alone is the same everywhere."""
    limits = FENCE.of(a)
    is_ceiling = limits is not None and limits.distance_m is None and not a.mission.fence
    if is_ceiling and a.route.fence_switched_on is None:
        return any(one is not None for one in (TERRAIN.of(a), PROFILE.of(a)))
    return _is_limited(a)


def _is_limited(a: Assessment) -> bool:
    return any(one is not None for one in (FENCE.of(a), TERRAIN.of(a), PROFILE.of(a)))


@judges(ITEM_NOT_MODELLED)
def _thrown_past_a_turn(a: Assessment) -> Iterator[Finding]:
    """Report splines at whose turn where the vehicle flies is a matter of chance."""
    motion = a.flight.motion
    if motion.beside is None or not len(motion.beside.chance_s):
        return
    begins = np.searchsorted(motion.segments.start_s, motion.beside.chance_s, side="right") - 1
    is_limited = _is_limited(a)
    yield a.finding(
        ITEM_NOT_MODELLED,
        "the spline turns faster than the vehicle can: its target stands still while it leans fully, and how "
        "far it flies on is not predicted" + (", nor is that checked" if is_limited else ""),
        severity=Severity.ERROR if is_limited else None,
        item=int(motion.segments.item[begins[0]]),
        fix="give the waypoint before the turn a hold of 1 s, or fly slower",
    )


GRAB, _GRABS_ENABLED = 1, ("GRIP_ENABLE", "PD_GRIPPER_EN")


@judges(ITEM_NOT_MODELLED)
def _picked_up(a: Assessment) -> Iterator[Finding]:
    """Report a load picked up on the way, of which no mass is given."""
    values = numbers(a)
    if quantity.mean_of(a.setup.payload_kg) or any(
        values.get(name) == 0.0 for name in _GRABS_ENABLED
    ):
        return
    grippers = a.mission.numbered(Command.DO_GRIPPER)
    grabs = {number for number, item in grippers if int(item.param2 or 0.0) == GRAB}
    first, flying = a.route.stages[0].item, False
    for number in a.route.reached if grabs else ():
        flying |= number == first
        if flying and number in grabs:
            yield a.finding(
                ITEM_NOT_MODELLED,
                "DO_GRIPPER picks up a load on the way: its mass is not known, and it is carried from there",
                severity=Severity.ERROR,
                item=number,
                fix="give the mass of the load with --payload",
            )
            return
