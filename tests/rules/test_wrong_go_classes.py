"""No fault is a go: drawn missions with each class's fault made by construction, and their twins without it.

Those of settings files (20) lie in a folder beside the mission.  A long campaign:
``MAVJOULE_EXAMPLES=200 pytest tests/rules/test_wrong_go_classes.py``.
"""

from __future__ import annotations

import os
from math import radians, tan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import pytest
from fenced_missions import at, box
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import HOME, item, mission, rtl, speed, takeoff
from made_terrain import ground, slope
from px4_quad import PX4_QUAD

from planner.autopilot import Autopilot
from planner.cli.configuration import mission_settings, typed_settings
from planner.errors import ConfigurationError, UsageError
from planner.findings import Severity
from planner.geo.fence import Fence
from planner.mission.items import MissionFormat
from planner.mission.vehicle_kind import vehicle_evidence
from planner.notation import read_battery
from planner.physics.wind import Wind
from planner.selection import Selection
from planner.service.preflight import check, check_mission
from planner.setting import Setting
from planner.setup import Setup
from planner.values import Value, replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.mission.items import Mission, MissionItem
    from planner.service.preflight import CheckResult
    from planner.setting import Setting
    from planner.vehicle.model import VehicleModel

EXAMPLES = int(os.environ.get("MAVJOULE_EXAMPLES", "2"))
"""Of each class and autopilot; the first is the plainest flight."""
STEP, PX4, ARDUPILOT = Autopilot.STEP, Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = (PX4, ARDUPILOT)
ALL = (STEP, PX4, ARDUPILOT)
VEHICLES = {
    STEP: load_vehicle("falkowski-2023-quadrotor"),
    PX4: PX4_QUAD,
    ARDUPILOT: load_vehicle("arducopter-sitl-quad"),
}
PARAMETERS = {
    STEP: "",
    PX4: "MPC_XY_CRUISE,6\nRTL_RETURN_ALT,30\nCOM_LOW_BAT_ACT,3\nGF_ACTION,3\n",
    ARDUPILOT: "WPNAV_SPEED,600\nRTL_ALT,3000\nBATT_FS_LOW_ACT,2\nBATT_LOW_VOLT,21\n",
}
MOST_AIRSPEED_M_S = {STEP: 12.0, PX4: 12.1, ARDUPILOT: 15.1}
"""Where the models end at the latest (``valid_for.speed_m_s``; the article flew calm air, to 12 m/s)."""


class Case(Value):
    """What is checked: a mission, how it is flown, and whatever else ``check`` takes."""

    items: tuple[MissionItem, ...]
    by: Autopilot
    parameters: str
    given: dict[str, Any] = {}  # noqa: RUF012 - values are frozen
    fence: Fence | None = None
    home_amsl_m: float | None = HOME.altitude_amsl_m
    is_text: bool = False
    vehicle: VehicleModel | None = None
    """``None``: that of who flies it."""

    def with_given(self, **more: Any) -> Case:  # noqa: ANN401 - whatever check takes
        return replace(self, given=self.given | more)

    @property
    def mission(self) -> Mission:
        items = tuple(replace(one, jump_id=None) for one in self.items)
        home = replace(HOME, altitude_amsl_m=self.home_amsl_m)
        made = replace(mission(*items, home=home, autopilot=self.by), fence=self.fence)
        if self.is_text:  # which names no autopilot
            evidence = vehicle_evidence(items)
            return replace(made, file_format=MissionFormat.WPL, autopilot=None, vehicle=evidence)
        return made

    def check(self) -> CheckResult:
        text = self.parameters.encode()
        return check(
            self.mission,
            self.vehicle or VEHICLES[self.by],
            autopilot=self.by,
            parameters=parameters_from_text(text, source="p.param") if text else None,
            **self.given,
        )


@st.composite
def flights(draw: st.DrawFn, by: Autopilot) -> Case:
    """A small flight in a light breeze, well within what every vehicle can."""
    height_m = draw(st.floats(15.0, 40.0))
    count = draw(st.integers(1, 3))
    side = st.floats(30.0, 140.0)
    places = [
        at(draw(side) * draw(st.sampled_from((-1.0, 1.0))), draw(side), height_m)
        for _ in range(count)
    ]
    wind = Wind(speed_m_s=draw(st.floats(0.0, 2.0)), from_deg=draw(st.floats(0.0, 359.0)))
    return Case(
        items=(takeoff(height_m), *places, rtl()),
        by=by,
        parameters=PARAMETERS[by],
        given={"battery": read_battery("77Wh")} if by is STEP else {"wind": wind},
    )


def as_it_is(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    return case


def battery_of(case: Case, wh: float) -> Case:
    return case.with_given(battery=read_battery(f"{wh:.3f}Wh"))


def too_high_to_arm(case: Case, share: float) -> Case:
    """Six cells have 25.2 V at most: the vehicle's demand is above, the battery a mere energy."""
    rows = f"BATT_ARM_VOLT,{25.3 + 2.0 * share:.2f}\n"
    return battery_of(replace(case, parameters=case.parameters + rows), 150.0)


def overloaded(case: Case, share: float) -> Case:
    """1.3 to 3 times the own mass as payload: hovering takes 2.3 times the thrust or more."""
    mass_kg = VEHICLES[case.by].mass_kg
    assert mass_kg is not None
    return case.with_given(payload_kg=mass_kg * (1.3 + 1.7 * share))


def hovering_in_wind(case: Case, share: float) -> Case:
    """It only climbs, stands and lands, in more wind than it can fly against."""
    first = case.items[0]
    stand = at(0.0, 0.0, first.altitude_m or 0.0, params=(5.0, 0.0, 0.0, None))
    wind = Wind(speed_m_s=MOST_AIRSPEED_M_S[case.by] + 1.0 + 5.0 * share, from_deg=90.0)
    land = at(0.0, 0.0, 0.0, command=21)
    return replace(case, items=(first, stand, land)).with_given(wind=wind)


def _hovering_in_gusts(case: Case, mean_m_s: float, gust_m_s: float) -> Case:
    still = hovering_in_wind(case, 0.0)
    sd_m_s = (gust_m_s - mean_m_s) / 2.0  # a gust is two deviations
    return still.with_given(wind=Wind(speed_m_s=mean_m_s, from_deg=90.0, speed_sd_m_s=sd_m_s))


def hovering_in_gusts(case: Case, share: float) -> Case:
    """The mean is half of what it can fly against, the gusts are more."""
    most_m_s = MOST_AIRSPEED_M_S[case.by]
    return _hovering_in_gusts(case, 0.5 * most_m_s, most_m_s + 1.0 + 5.0 * share)


def hovering_in_light_gusts(case: Case, share: float) -> Case:
    most_m_s = MOST_AIRSPEED_M_S[case.by]
    return _hovering_in_gusts(case, 0.2 * most_m_s, (0.3 + 0.2 * share) * most_m_s)


def overloaded_by_steps(case: Case, share: float) -> Case:
    """Up to 3 times the own mass as payload, of a model of steps that knows its mass."""
    vehicle = load_vehicle("dji-matrice-100")
    assert vehicle.mass_kg is not None
    case = replace(case, vehicle=vehicle)
    return case.with_given(payload_kg=vehicle.mass_kg * (1.3 + 1.7 * share))


def downwind_and_away(case: Case, share: float) -> Case:
    """Lands down more wind than it is to hover in; the return needs more airspeed than was flown."""
    height_m = case.items[0].altitude_m or 0.0
    wind = Wind(speed_m_s=MOST_AIRSPEED_M_S[case.by] - 0.7 + 0.7 * share, from_deg=180.0)
    down = (at(0.0, 700.0, height_m), at(0.0, 700.0, 0.0, command=21))
    return replace(case, items=(case.items[0], speed(3.0), *down)).with_given(wind=wind)


def _down_the_wind(case: Case, wind_m_s: float, away_m: float, back_m_s: float) -> Case:
    """Land far down a wind well below what the vehicle holds; returns go at ``back_m_s`` over ground."""
    height_m = case.items[0].altitude_m or 0.0
    speeds = {
        PX4: f"MPC_XY_CRUISE,{back_m_s}\n",
        ARDUPILOT: f"WPNAV_SPEED,{100.0 * back_m_s:.0f}\n",
    }
    there = (at(0.0, away_m, height_m), at(0.0, away_m, 0.0, command=21))
    case = replace(case, items=(case.items[0], speed(5.0), *there), parameters=speeds[case.by])
    return case.with_given(wind=Wind(speed_m_s=wind_m_s, from_deg=180.0))


def home_against_the_wind(case: Case, share: float) -> Case:
    """The way out meets less than 0.7 of the airspeed that was flown, the way home 1.5 times it and more."""
    most_m_s = MOST_AIRSPEED_M_S[case.by]
    return _down_the_wind(
        case, (0.6 + 0.1 * share) * most_m_s, 3000.0 + 500.0 * share, 0.9 * most_m_s
    )


def home_in_a_breeze(case: Case, share: float) -> Case:
    """The way home meets 0.7 to 0.9 of it."""
    most_m_s = MOST_AIRSPEED_M_S[case.by]
    return _down_the_wind(case, 0.2 * share * most_m_s, 1000.0, 0.7 * most_m_s)


def _with_return_of(case: Case, times: float, *, reserve: float = 0.2) -> Case:
    """Land so far off that out and home take ``times`` the energy above the reserve."""
    height_m = case.items[0].altitude_m or 0.0
    there = (at(0.0, 1500.0, height_m), at(0.0, 1500.0, 0.0, command=21))
    case = replace(case, items=(case.items[0], *there)).with_given(reserve=reserve)
    capacity_wh = 60.0
    for _ in range(3):  # a lighter one takes less
        out = battery_of(case, capacity_wh).check().return_plan
        assert out is not None
        assert out.margin_wh is not None
        capacity_wh -= out.margin_wh / (1.0 - reserve)
    return battery_of(case, capacity_wh / times)


def short_on_the_way_home(case: Case, share: float) -> Case:
    """The mission, which lands away, is flown above the reserve; its return would end below."""
    return _with_return_of(case, 1.02 + 0.1 * share)


def home_with_hardly_anything(case: Case, share: float) -> Case:
    """The mission lands with half of the battery; a return would leave 0.2 to 1 % of it.  No reserve."""
    return _with_return_of(case, 0.998 - 0.008 * share, reserve=0.0)


def enough_for_the_way_home(case: Case, share: float) -> Case:
    return _with_return_of(case, 0.75 + 0.1 * share)


def _slow_then_fast(case: Case, delay_s: float) -> Case:
    first, *_ = case.items
    height_m = first.altitude_m or 0.0
    wait = item(112, params=(delay_s, 0.0, 0.0, 0.0), frame=2)
    legs = (at(0.0, 30.0, height_m), wait, speed(6.0), at(0.0, 1000.0, height_m))
    rows = case.parameters or "WPNAV_SPEED,600\n"
    return replace(case, items=(first, speed(0.5), *legs, rtl()), parameters=rows)


def speed_held_back(case: Case, share: float) -> Case:
    """970 m at 0.5 m/s take half an hour, the wait takes longer; the pack holds 22 minutes of hovering."""
    return _slow_then_fast(case, 2500.0 + 500.0 * share)


def speed_soon(case: Case, share: float) -> Case:
    return _slow_then_fast(case, 20.0 * share)


def _switched(case: Case, share: float, switch: float) -> Case:
    farthest_m = 20.0 + 8.0 * share  # of a drawn place's 42 m or more
    rows = f"FENCE_ENABLE,0\nFENCE_TYPE,2\nFENCE_ACTION,1\nFENCE_RADIUS,{farthest_m:.0f}\n"
    fence = item(207, params=(switch, 0.0, 0.0, 0.0), frame=2)
    items = (case.items[0], fence, *case.items[1:])
    return replace(case, items=items, parameters=case.parameters + rows)


def fence_switched_on(case: Case, share: float) -> Case:
    return _switched(case, share, 1.0)


def fence_stays_off(case: Case, share: float) -> Case:
    return _switched(case, share, 0.0)


def never_lands(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    return replace(case, items=case.items[:-1])


def _over_ground(case: Case, ridge_m: float) -> Case:
    height_m = case.items[0].altitude_m or 0.0
    ways = (at(0.0, 150.0, height_m), at(0.0, 350.0, height_m), at(0.0, 350.0, 0.0, command=21))
    over = replace(case, items=(case.items[0], *ways))
    return over.with_given(terrain=ground(ridge_m, at_m=250.0))


def over_a_ridge(case: Case, share: float) -> Case:
    """20 m of ground between two places rise to the height of flight or above it."""
    return _over_ground(case, (case.items[0].altitude_m or 0.0) + 10.0 * share)


def home_behind_a_ridge(case: Case, share: float) -> Case:
    """It passes a ridge 30 m above it and lands behind: from there it returns at 30 m, or nobody knows."""
    ridge_m = 25.5 + 30.0 * share
    first, *_ = case.items
    high = replace(case, items=(replace(first, altitude_m=ridge_m + 30.0), *case.items[1:]))
    return _over_ground(high, ridge_m)


def over_level_ground(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    return _over_ground(case, 0.0)


def heights_of_nowhere(case: Case, share: float) -> Case:
    """Heights above sea level, no height of home."""
    first, *ways, last = case.items
    over = tuple(replace(one, frame=0, altitude_m=30.0 + 300.0 * share) for one in ways)
    return replace(case, items=(first, *over, last), home_amsl_m=None)


def impossible_pack(case: Case, share: float) -> Case:
    """The energy of 5 to 50 packs of 1 kg."""
    return battery_of(case, 1000.0 + 9000.0 * share)


def _using(case: Case, used: float) -> Case:
    """Hold at a place for as long as takes the part of the pack that is to be used."""

    def held(hold_s: float) -> Case:
        first, place, *more = case.items
        return replace(case, items=(first, replace(place, param1=hold_s), *more))

    short = held(60.0).check()
    assert short.battery is not None
    hover_w = 60.0 * (held(120.0).check().totals.energy_wh - short.totals.energy_wh)
    missing_wh = used * short.battery.capacity_wh - short.totals.energy_wh
    return held(60.0 + 3600.0 * missing_wh / hover_w)


def nothing_left(case: Case, share: float) -> Case:
    """97 to 101 % of the pack are used, no reserve is asked for."""
    return _using(case, 0.97 + 0.04 * share).with_given(reserve=0.0)


def half_left(case: Case, share: float) -> Case:
    return _using(case, 0.4 + 0.1 * share).with_given(reserve=0.0)


def _wind_action(case: Case, wind_m_s: float, limit_m_s: float) -> Case:
    rows = f"COM_WIND_MAX,{limit_m_s:.2f}\nCOM_WIND_MAX_ACT,3\n"
    wind = Wind(speed_m_s=wind_m_s, from_deg=200.0)
    return replace(case, parameters=case.parameters + rows).with_given(wind=wind)


def wind_action(case: Case, share: float) -> Case:
    return _wind_action(case, 6.0, 3.0 + 2.0 * share)


def wind_action_far_off(case: Case, share: float) -> Case:
    return _wind_action(case, 2.0, 3.0 + 2.0 * share)


def _ended_after(case: Case, time_s: float) -> Case:
    rows = f"COM_FLT_TIME_MAX,{time_s:.0f}\n"
    return replace(case, parameters=case.parameters + rows)


def ended_by_the_clock(case: Case, share: float) -> Case:
    """On the way out: on the way home, that of the mission, it goes on."""
    arrival_s = case.check().items[-2].arrival_s
    assert arrival_s is not None
    return _ended_after(case, (0.1 + 0.8 * share) * arrival_s)


def home_before_the_clock(case: Case, share: float) -> Case:
    return _ended_after(case, (1.5 + share) * case.check().totals.time_s)


def _of_accuracy(case: Case, limit_m: float, share: float) -> Case:
    rows = f"COM_POS_LOW_EPH,{limit_m:.2f}\nCOM_POS_LOW_ACT,{2 + round(3.0 * share)}\n"
    return replace(case, parameters=case.parameters + rows).with_given(position_error_m=3.0)


def too_wrong_a_position(case: Case, share: float) -> Case:
    return _of_accuracy(case, 1.0 + 1.9 * share, share)


def a_position_as_right_as_asked(case: Case, share: float) -> Case:
    return _of_accuracy(case, 3.1 + share, share)


def _landing_on(case: Case, slope_deg: float) -> Case:
    height_m = case.items[0].altitude_m or 0.0
    there = (at(0.0, 60.0, height_m), at(0.0, 60.0, -60.0 * tan(radians(slope_deg)), command=21))
    return replace(case, items=(case.items[0], *there)).with_given(terrain=slope(slope_deg))


def landing_on_a_slope(case: Case, share: float) -> Case:
    return _landing_on(case, 16.0 + 20.0 * share)


def landing_on_hardly_a_slope(case: Case, share: float) -> Case:
    return _landing_on(case, 3.0 * share)


def _beside_a_line(case: Case, room_m: float) -> Case:
    east_m = 150.0
    height_m = case.items[0].altitude_m or 0.0
    ways = (at(0.0, 60.0, height_m), at(east_m, 60.0, height_m))
    fence = Fence(polygons=(box(-400.0, -400.0, east_m + room_m, 400.0),))
    return replace(case, items=(case.items[0], *ways, rtl()), fence=fence)


def on_the_line(case: Case, share: float) -> Case:
    """On the line to half a metre inside it: positions are wrong by more."""
    return _beside_a_line(case, 0.5 * share)


def beside_a_zone(case: Case, share: float) -> Case:
    """The same, of ground that is kept out of."""
    case = _beside_a_line(case, 0.0)
    zone = box(150.0 + 0.5 * share, -400.0, 400.0, 400.0, inclusion=False)
    return replace(case, fence=Fence(polygons=(zone,)))


def far_from_the_line(case: Case, share: float) -> Case:
    return _beside_a_line(case, 60.0 + share)


def take_off_second(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    up, *rest = case.items
    return replace(case, items=(at(0.0, 50.0, up.altitude_m or 0.0), up, *rest))


def crowded(case: Case, share: float) -> Case:
    """More than any autopilot holds: photos by hand, in which nothing else is wrong."""
    photos = (item(203, frame=2),) * (2001 + round(100.0 * share))
    return replace(case, items=(*case.items[:1], *photos, *case.items[1:]))


def without_take_off(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    return replace(case, items=case.items[1:])


def too_low_a_take_off(case: Case, share: float) -> Case:
    """PX4 refuses a take-off within its acceptance radius and a metre of the ground: 10 m + 1 m."""
    low = replace(case.items[0], altitude_m=0.5 + 10.0 * share)
    return replace(
        case, items=(low, *case.items[1:]), parameters=case.parameters + "NAV_ACC_RAD,10\n"
    )


def too_low_for_px4(case: Case, share: float) -> Case:
    """Of nobody's mission: within 2 m + 1 m, as PX4 is delivered."""
    low = replace(case.items[0], altitude_m=0.5 + 2.4 * share)
    return replace(case, items=(low, *case.items[1:]))


def by_the_gulf_of_guinea(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    """What means "here" to ArduPilot alone."""
    first, place, *rest = case.items
    return replace(
        case, items=(first, place, replace(place, latitude_deg=0.0, longitude_deg=0.0), *rest)
    )


def over_terrain_unknown(case: Case, share: float) -> Case:
    first, *ways, last = case.items
    over = tuple(replace(one, frame=10, altitude_m=20.0 + 20.0 * share) for one in ways)
    rows = "TERRAIN_ENABLE,0\n"
    return replace(case, items=(first, *over, last), parameters=case.parameters + rows)


def far_beyond_chemistry(case: Case, share: float) -> Case:
    """A pack of 2 to 4 Wh: hovering alone takes 30 times its energy in an hour, or more."""
    return battery_of(case, 2.0 + 2.0 * share)


def at_the_margin_in_wind(case: Case, share: float) -> Case:
    """The article's model does not know wind; its flight ends a thousandth above the reserve of 20 %."""
    return _using(case, 0.799).with_given(wind=Wind(speed_m_s=4.0 + 4.0 * share, from_deg=0.0))


def ignored(case: Case, share: float) -> Case:
    return _using(case, 0.85 + 0.5 * share).with_given(selection=Selection(ignore=("E1",)))


def slowed_by_parameters(case: Case, share: float) -> Case:
    """At 0.3 m/s, not the article's 6 m/s, 1 km out and home is two hours."""
    far = at(0.0, 1000.0, case.items[0].altitude_m or 0.0)
    rows = f"MPC_XY_CRUISE,{0.3 + 0.2 * share:.2f}\nMPC_XY_VEL_MAX,0.5\n"
    return replace(case, items=(case.items[0], far, rtl()), parameters=rows)


def far_out(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    far = at(0.0, 1000.0, case.items[0].altitude_m or 0.0)
    return replace(case, items=(case.items[0], far, rtl()))


def without_a_vehicle(case: Case, share: float) -> Case:  # noqa: ARG001 - of one form with faults
    return case.with_given(is_vehicle_named=False)


class WrongGo(Value, kw_only=False):
    """A class of issue 15: how its fault is made, and the same without it where that is no plain flight."""

    number: int
    fault: Callable[[Case, float], Case]
    by: tuple[Autopilot, ...]
    codes: str
    """One of these rules is to say it, or each joined by +: another one may have come by accident."""
    twin: Callable[[Case, float], Case] = as_it_is
    words: str = ""
    """In the message of that rule."""


CLASSES = (
    WrongGo(1, without_a_vehicle, ALL, "X903"),
    WrongGo(2, too_high_to_arm, (ARDUPILOT, STEP), "E114 X904"),
    WrongGo(3, overloaded, BOTH, "E116"),
    WrongGo(3, overloaded_by_steps, (STEP,), "E116 E120"),
    WrongGo(4, hovering_in_wind, ALL, "W103"),
    WrongGo(4, hovering_in_gusts, ALL, "W103", hovering_in_light_gusts),
    WrongGo(5, downwind_and_away, BOTH, "E105+W103"),
    WrongGo(5, home_against_the_wind, BOTH, "E105", home_in_a_breeze, "on the return from item"),
    WrongGo(5, short_on_the_way_home, ALL, "E102", enough_for_the_way_home),
    WrongGo(6, speed_held_back, (ARDUPILOT, STEP), "E101", speed_soon),
    WrongGo(7, fence_switched_on, (ARDUPILOT, STEP), "F101", fence_stays_off),
    WrongGo(8, never_lands, ALL, "M102"),
    WrongGo(9, over_a_ridge, ALL, "A102", over_level_ground),
    WrongGo(9, home_behind_a_ridge, ALL, "A104 X904", over_level_ground, "a return from"),
    WrongGo(9, landing_on_a_slope, ALL, "A117", landing_on_hardly_a_slope),
    WrongGo(10, heights_of_nowhere, ALL, "A105"),
    WrongGo(11, impossible_pack, ALL, "E123"),
    WrongGo(12, nothing_left, ALL, "E101 E102 E104 E124", half_left),
    WrongGo(
        12,
        home_with_hardly_anything,
        ALL,
        "E124",
        enough_for_the_way_home,
        "before a return has landed",
    ),
    WrongGo(13, wind_action, (PX4, STEP), "W104", wind_action_far_off),
    WrongGo(13, ended_by_the_clock, (PX4, STEP), "E103", home_before_the_clock),
    WrongGo(13, too_wrong_a_position, (PX4, STEP), "T114", a_position_as_right_as_asked),
    WrongGo(14, on_the_line, ALL, "F101 F102", far_from_the_line),
    WrongGo(14, beside_a_zone, ALL, "F101 F102", far_from_the_line),
    WrongGo(15, without_take_off, (ARDUPILOT, STEP), "M101"),
    WrongGo(15, take_off_second, ALL, "M101"),
    WrongGo(15, crowded, ALL, "M126"),
    WrongGo(15, too_low_a_take_off, (PX4, STEP), "M128"),
    WrongGo(15, too_low_for_px4, (STEP,), "M128", words="name who flies it"),
    WrongGo(15, by_the_gulf_of_guinea, (PX4, STEP), "M110"),
    WrongGo(15, over_terrain_unknown, (ARDUPILOT,), "A118"),
    WrongGo(16, far_beyond_chemistry, ALL, "E110"),
    WrongGo(17, at_the_margin_in_wind, (STEP,), "E101 E102 E108"),
    WrongGo(18, ignored, ALL, "E101"),
    WrongGo(19, slowed_by_parameters, (STEP,), "E101 E108", far_out),
)
TRIED = [
    pytest.param(one, by, id=f"{one.number}-{one.fault.__name__}-{by}")
    for one in CLASSES
    for by in one.by
]
TWINS = list({(one.twin, by): (one.twin, by) for one in CLASSES for by in one.by})
shares = st.floats(0.0, 1.0)
few = settings(max_examples=EXAMPLES, deadline=None, derandomize=EXAMPLES == 2)


def errors(result: CheckResult) -> list[str]:
    return [f"{f.code} {f.message}" for f in result.findings if f.severity is Severity.ERROR]


@pytest.mark.parametrize(("one", "by"), TRIED)
@few
@given(data=st.data(), share=shares)
def test_a_fault_is_never_a_go(
    one: WrongGo, by: Autopilot, data: st.DataObject, share: float
) -> None:
    case = one.fault(data.draw(flights(by)), share)
    result = case.check()
    assert result.verdict == "no-go"
    told = {text.split()[0] for text in errors(result) if one.words in text}
    assert any(set(codes.split("+")) <= told for codes in one.codes.split())


@pytest.mark.parametrize(("twin", "by"), TWINS, ids=[f"{twin.__name__}-{by}" for twin, by in TWINS])
@few
@given(data=st.data(), share=shares)
def test_the_same_without_the_fault_is_a_go(
    twin: Callable[[Case, float], Case], by: Autopilot, data: st.DataObject, share: float
) -> None:
    result = twin(data.draw(flights(by)), share).check()
    assert errors(result) == []
    assert result.verdict == "go"


def delivered(case: Case, share: float) -> Case:
    """Land, wait and take off again, as MIS_OPTIONS 4 lets it."""
    first, place, *_ = case.items
    wait = item(93, frame=2, params=(1.0 + 8.0 * share, 0.0, 0.0, 0.0))
    down = replace(place, command=21, altitude_m=0.0)
    items = (first, place, down, wait, replace(place, command=22), at(30.0, 30.0, 20.0), rtl())
    return replace(
        case, items=items, parameters=case.parameters + "MIS_OPTIONS,4\nDISARM_DELAY,60\n"
    )


def delayed(case: Case, share: float) -> Case:
    """Conditions that are met, or that nothing waits for."""
    first, *ways, last = case.items
    waits = (
        item(112, frame=2, params=(20.0 * share, 0.0, 0.0, 0.0)),
        item(114, frame=2, params=(1.0 + 20.0 * share, 0.0, 0.0, 0.0)),
        item(115, frame=2, params=(90.0, 0.0, 0.0, 0.0)),
        item(203, frame=2, params=(0.0,) * 4),
    )
    rows = case.parameters or "WPNAV_SPEED,600\n"
    return replace(case, items=(first, *waits, *ways, last), parameters=rows)


def slowed_too_late(case: Case, share: float) -> Case:
    """A slow speed held back until the waypoint behind it is reached, and dropped there.

    At it the way of 2 km would take more than an hour.
    """
    first, *_, last = case.items
    late = (item(112, frame=2, params=(500.0 + 500.0 * share, 0.0, 0.0, 0.0)), speed(0.5))
    ways = [at(0.0, north_m, first.altitude_m or 0.0) for north_m in (1000.0, 0.0)]
    rows = case.parameters or "WPNAV_SPEED,600\n"
    return replace(case, items=(first, *late, *ways, last), parameters=rows)


def fence_switched_off(case: Case, share: float) -> Case:
    """A fence that most of the way is beyond, and that is on as it arms."""
    case = _switched(case, share, 0.0)
    return replace(case, parameters=case.parameters.replace("FENCE_ENABLE,0", "FENCE_ENABLE,1"))


def battery_not_measured(case: Case, share: float) -> Case:
    """Failsafes at voltages that it is below from the beginning, of a monitor that is off."""
    rows = f"BATT_MONITOR,0\nBATT_LOW_VOLT,{25.3 + share:.1f}\nBATT_FS_LOW_ACT,2\n"
    return replace(case, parameters=case.parameters.replace("BATT_LOW_VOLT,21\n", "") + rows)


def in_an_ordinary_breeze(case: Case, share: float) -> Case:
    """3.5 to 6 % beyond the airspeed that was flown, on the way north."""
    most_m_s = MOST_AIRSPEED_M_S[case.by]
    wind_m_s = (1.035 + 0.025 * share) * most_m_s - 0.63 * most_m_s
    speeds = {
        PX4: f"MPC_XY_CRUISE,{0.63 * most_m_s:.2f}\n",
        ARDUPILOT: f"WPNAV_SPEED,{63.0 * most_m_s:.0f}\n",
    }
    first, *_, last = case.items
    north = at(0.0, 200.0 + 100.0 * share, first.altitude_m or 0.0)
    wind = Wind(speed_m_s=wind_m_s, from_deg=0.0)
    flown = replace(case, items=(first, north, last), parameters=speeds[case.by])
    return flown.with_given(wind=wind)


def with_a_pitch(case: Case, share: float) -> Case:
    """As Mission Planner writes take-offs into its texts."""
    first, *rest = case.items
    return replace(case, items=(replace(first, param1=5.0 + 15.0 * share), *rest), is_text=True)


def with_a_pitch_and_a_landing(case: Case, share: float) -> Case:
    """As a plane could come down, too: from a place 60 to 160 m before the landing; ArduCopter knows it."""
    place = at(0.0, 60.0 + 100.0 * share, case.items[0].altitude_m or 0.0)
    pitched = with_a_pitch(case, share)
    return replace(pitched, items=(pitched.items[0], place, at(0.0, 0.0, 0.0, command=21)))


def with_parameters_of_no_matter(case: Case, share: float) -> Case:
    rows = f"LOG_BITMASK,{share * 65535:.0f}\nSERIAL3_BAUD,57\nNTF_LED_BRIGHT,{3 * share:.0f}\n"
    px4 = f"SDLOG_MODE,{2 * share:.0f}\nMAV_0_RATE,1200\nMNT_RANGE_YAW,360\n"
    return replace(case, parameters=case.parameters + (px4 if case.by is PX4 else rows))


HARMLESS = (
    (delivered, (ARDUPILOT,)),
    (delayed, (ARDUPILOT, STEP)),
    (slowed_too_late, (ARDUPILOT, STEP)),
    (fence_switched_off, (ARDUPILOT, STEP)),
    (battery_not_measured, (ARDUPILOT, STEP)),
    (in_an_ordinary_breeze, BOTH),
    (with_a_pitch, ALL),
    (with_a_pitch_and_a_landing, (STEP, PX4)),
    (with_parameters_of_no_matter, ALL),
)
"""What was a no-go once, though it flies well."""


@pytest.mark.parametrize(
    ("harmless", "by"),
    [pytest.param(one, by, id=f"{one.__name__}-{by}") for one, some in HARMLESS for by in some],
)
@few
@given(data=st.data(), share=shares)
def test_what_does_no_harm_is_a_go(
    harmless: Callable[[Case, float], Case], by: Autopilot, data: st.DataObject, share: float
) -> None:
    result = harmless(data.draw(flights(by)), share).check()
    assert errors(result) == []
    assert result.verdict == "go"


FAVOURS = (
    'battery = "4000Wh"',
    'battery_health = "100%"',
    "battery_resistance_factor = 0.1",
    'charge = "100%"',
    "reserve = 0",
    "risk = 1.0",
    'fail_on = "error"',
    'select = "T"',
    'ignore = "E"',
    'ignore = "E1"',
    'ignore = "M,W,T,P,A1,F1"',
    '[per_file_ignores]\n"*" = "M"',
    "home_amsl_m = -400",
    "payload_kg = 0",
    'wind = "0"',
    'temperature_c = "30"',
    'vehicle = "falkowski-2023-quadrotor"',
    'autopilot = "auto"',
    "reaction_time_s = 0",
    "position_error_m = 0",
)
"""What a settings file may hold that makes a hopeless mission look better."""
OF_REPORTS = ('format = "json"', "statistics = true")


class Folder(Value, kw_only=False):
    """Where a mission lies, and what its settings file holds."""

    name: str
    lines: tuple[str, ...]
    is_above: bool
    """Whether the file lies in the folder above that of the mission."""

    @property
    def keys(self) -> set[str]:
        return {line.strip("[").split(" ")[0].split("]")[0] for line in self.lines}

    def of(self, folder: Path) -> str:
        """Write the file, and return the path of the mission."""
        below = folder / "site"
        below.mkdir()
        head = "[tool.mavjoule]\n" if self.name == "pyproject.toml" else ""
        lines = "\n".join(self.lines)
        if head:
            lines = lines.replace("[per_file_ignores]", "[tool.mavjoule.per_file_ignores]")
        (folder if self.is_above else below).joinpath(self.name).write_text(head + lines)
        return str(below / "out.plan")


def folders(lines: tuple[str, ...]) -> st.SearchStrategy[Folder]:
    """Files of some lines, no key twice, tables last."""
    some = st.lists(st.sampled_from(lines), min_size=1, unique_by=lambda line: line.split(" ")[0])
    return st.builds(
        Folder,
        st.sampled_from(("mavjoule.toml", "pyproject.toml")),
        some.map(lambda drawn: tuple(sorted(drawn, key=lambda line: line.startswith("[")))),
        st.booleans(),
    )


def typed(case: Case) -> dict[str, Any]:
    """Return what is typed beside a mission: vehicle, battery and who flies it."""
    return {"vehicle": VEHICLES[case.by], "battery": read_battery("77Wh"), "autopilot": case.by}


def as_typed(setting: Setting, value: Any) -> Any:  # noqa: ANN401 - of any setting
    return (
        value if setting.key == "vehicle" and not isinstance(value, str) else setting.loaded(value)
    )


@pytest.mark.parametrize("by", ALL)
@few
@given(data=st.data(), share=shares)
def test_a_settings_file_beside_it_never_makes_a_go_of_a_hopeless_mission(
    by: Autopilot, data: st.DataObject, share: float
) -> None:
    """Class 20: 1.5 to 2.1 times what the battery holds, and a file that looks away."""
    plain = replace(data.draw(flights(by)), parameters="").with_given(battery=read_battery("77Wh"))
    case, beside = _using(plain, 1.5 + 0.6 * share), data.draw(folders(FAVOURS))
    with TemporaryDirectory() as folder:
        path = beside.of(Path(folder))
        if untyped := beside.keys - typed(case).keys():
            for command in ("upload", "guard"):
                with pytest.raises((UsageError, ConfigurationError)):
                    typed_settings(path, typed(case), command=command)
        try:
            values = mission_settings(path, typed(case))
        except ConfigurationError:
            return  # what may not be ignored at all
    result = check_mission(case.mission, Setup.of(values, loaded=as_typed))
    assert result.verdict == "no-go"
    assert any(text.startswith("E101") for text in errors(result))
    assert (result.setup.settings_file is not None) == bool(untyped)


@pytest.mark.parametrize("by", ALL)
@few
@given(data=st.data())
def test_a_file_that_sets_how_reports_look_keeps_a_good_mission_a_go(
    by: Autopilot, data: st.DataObject
) -> None:
    case, beside = data.draw(flights(by)), data.draw(folders(OF_REPORTS))
    with TemporaryDirectory() as folder:
        values = typed_settings(beside.of(Path(folder)), typed(case), command="upload")
    assert errors(check_mission(case.mission, Setup.of(values, loaded=as_typed))) == []
