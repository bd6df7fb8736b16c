"""DO_FENCE_ENABLE: the fence counts where it is on, in flown order."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING

import pytest
from fenced_missions import VEHICLES, at, box, findings_of
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, mission, rtl, takeoff, waypoint
from rule_cases.case import found
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.fence import Fence, FencePolygon
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

AROUND = box(-100.0, -100.0, 100.0, 100.0)
CIRCLE = "FENCE_ENABLE,{}\nFENCE_TYPE,2\nFENCE_RADIUS,150\n"
ARDUPILOT = partial(findings_of, autopilot=Autopilot.ARDUPILOT)


def switch(action: float) -> MissionItem:
    """Return DO_FENCE_ENABLE."""
    return item(207, frame=2, params=(action, 0.0, 0.0, 0.0))


ON, OFF, FLOOR_OFF = switch(1.0), switch(0.0), switch(2.0)
OUT = (at(0, 300), at(0, 50))
LANDS = at(0, 50, 0.0, command=21)


def test_a_fence_the_mission_switches_on_is_judged_from_there() -> None:
    off = CIRCLE.format(0)
    assert "F101" not in ARDUPILOT((takeoff(20), *OUT, LANDS), parameters=off)
    assert "F101" in ARDUPILOT((takeoff(20), ON, *OUT, LANDS), parameters=off)
    assert "F101" not in ARDUPILOT((takeoff(20), *OUT, at(0, 0), ON, LANDS), parameters=off)


def test_a_fence_switched_on_outside_is_left_at_once() -> None:
    told = ARDUPILOT((takeoff(20), at(0, 300), ON, at(0, 50), LANDS), parameters=CIRCLE.format(0))
    assert told["F101"].item == 4


# Flown in ArduPilot's SITL, with a floor of 3 m: switched on by the mission it ends the landing at 3 m, with
# FENCE_ACTION 4 in a hover until the battery is empty, with 1 on the way home, where it lands at last; with 2
# it lands.  Switched on by parameters it is off for landings.
AWAY, AT_HOME = LANDS, at(0, 4, 0.0, command=21)


@pytest.mark.parametrize(
    ("action", "switches", "last", "severity"),
    [
        (4, (ON,), rtl(), Severity.ERROR),
        (4, (ON,), AWAY, Severity.ERROR),
        (4, (), rtl(), None),
        (4, (ON, FLOOR_OFF), rtl(), None),
        (4, (ON, OFF), AWAY, None),
        (1, (ON,), AWAY, Severity.ERROR),
        (1, (ON,), rtl(), Severity.WARNING),
        (1, (ON,), AT_HOME, Severity.WARNING),
        (
            3,
            (ON,),
            rtl(),
            Severity.WARNING,
        ),  # up its track, flown from 8 m to the 60 m of the take-off
        (3, (ON,), AT_HOME, Severity.ERROR),  # 4 m beside: back through all of the flight
        (5, (ON,), AT_HOME, Severity.ERROR),
        (2, (ON,), AWAY, None),
        (0, (ON,), AWAY, None),
    ],
)
@pytest.mark.parametrize("enabled", [0, 1])
def test_a_floor_that_the_mission_switches_on_ends_landings_below_it(
    enabled: int,
    action: int,
    switches: tuple[MissionItem, ...],
    last: MissionItem,
    severity: Severity | None,
) -> None:
    floor = f"FENCE_ENABLE,{enabled}\nFENCE_TYPE,8\nFENCE_ALT_MIN,3\nFENCE_ACTION,{action}\n"
    legs = (takeoff(20), at(0, 30), *switches, at(0, 60), last)
    told = ARDUPILOT(legs, parameters=floor).get("F110")
    assert (told and told.severity) == severity
    assert told is None or told.item == len(legs)


@pytest.mark.parametrize(
    ("settings", "last", "later_s"),
    [  # flown: 113.1 s for 103.8 s, 223.1 for 158.8, 127.0 for 98.6, 162.4 for 98.5
        ("", rtl(), 9.3),
        ("RTL_LOIT_TIME,60000\n", rtl(), 64.3),
        ("", AT_HOME, 28.4),
        ("RTL_CONE_SLOPE,10\nRTL_ALT,4500\n", at(0, 4.5, 0.0, command=21), 63.9),
    ],
)
def test_a_floor_has_a_return_begun_anew_as_late_as_flown(
    settings: str, last: MissionItem, later_s: float
) -> None:
    """Within 4 s: the last seconds on the ground, and the stop, are counted differently."""
    floor = "FENCE_TYPE,9\nFENCE_ALT_MIN,5\nFENCE_ACTION,1\n" + settings
    message = ARDUPILOT((takeoff(15), ON, at(0, 90, 15.0), last), parameters=floor)["F110"].message
    [(minutes, seconds)] = re.findall(
        r" lands (?:(\d+) min )?([\d.]+) s later than predicted$", message
    )
    assert 60.0 * float(minutes or 0) + float(seconds) == pytest.approx(later_s, abs=4.0)


@pytest.mark.parametrize(("takeoff_m", "is_told"), [(2.0, True), (4.0, False)])
def test_smartrtl_begun_by_a_floor_above_the_take_off_flies_all_of_it_back(
    takeoff_m: float, *, is_told: bool
) -> None:
    floor = "FENCE_TYPE,8\nFENCE_ALT_MIN,3\nFENCE_ACTION,3\n"
    legs = (takeoff(takeoff_m), at(0, 30), ON, at(0, 60), rtl())
    told = ARDUPILOT(legs, parameters=floor).get("F110")
    assert (told is not None and "by its own track" in told.message) == is_told


def test_a_floor_below_the_ground_ends_no_landing() -> None:
    floor = "FENCE_ENABLE,1\nFENCE_TYPE,8\nFENCE_ALT_MIN,{}\nFENCE_ACTION,4\n"
    for height_m, is_ended in ((0.0, True), (-0.5, False)):
        told = ARDUPILOT((takeoff(20), ON, at(0, 60), AWAY), parameters=floor.format(height_m))
        assert ("F110" in told) == is_ended


def test_a_floor_of_the_mission_stays_on_for_landings_whatever_autoenable_is() -> None:
    """``_min_alt_state`` stays ``MANUALLY_ENABLED``: a take-off in GUIDED resets it, none in AUTO."""
    floor = "FENCE_ENABLE,0\nFENCE_TYPE,8\nFENCE_ALT_MIN,3\nFENCE_ACTION,4\nFENCE_AUTOENABLE,{}\n"
    for automatic in (0, 1, 3):
        given = parameters_from_text(floor.format(automatic).encode(), source="p.param")
        legs = mission(ON, takeoff(20), at(0, 60), rtl())
        result = check(legs, load_vehicle(VEHICLES[Autopilot.ARDUPILOT]), parameters=given)
        assert [one.item for one in result.findings if one.code == "F110"] == [2, 4]


# Flown in ArduPilot's SITL: "Vehicle breaching Min Alt fence" before it arms, or disarmed at once.
@pytest.mark.parametrize(
    ("action", "floor_m", "legs", "is_told"),
    [
        (1, 3.0, (ON, takeoff(20)), True),
        (2, 3.0, (ON, takeoff(20)), True),
        (0, 3.0, (ON, takeoff(20)), False),
        (1, -0.5, (ON, takeoff(20)), False),
        (1, 3.0, (takeoff(20), ON), False),
        (1, 3.0, (ON, OFF, takeoff(20)), False),
        (1, 3.0, (takeoff(20), at(0, 30, 0.0, command=21), ON, takeoff(20)), True),
    ],
)
def test_a_floor_that_is_on_already_ends_a_take_off_below_it(
    action: int, floor_m: float, legs: tuple[MissionItem, ...], *, is_told: bool
) -> None:
    floor = f"FENCE_TYPE,8\nFENCE_ALT_MIN,{floor_m}\nFENCE_ACTION,{action}\nMIS_OPTIONS,4\n"
    told = ARDUPILOT((*legs, at(0, 60), FLOOR_OFF, rtl()), parameters=floor)
    assert ("F110" in told) == is_told


@pytest.mark.parametrize(
    ("slope", "return_cm", "is_ended"), [(3, 6000, False), (0, 6000, True), (0, 200, False)]
)
def test_a_return_that_a_floor_begins_anew_climbs_again_without_a_cone(
    slope: int, return_cm: int, *, is_ended: bool
) -> None:
    floor = "FENCE_TYPE,8\nFENCE_ALT_MIN,5\nFENCE_ACTION,1\n"
    floor += f"RTL_CONE_SLOPE,{slope}\nRTL_ALT,{return_cm}\nRTL_CLIMB_MIN,0\n"
    told = ARDUPILOT((takeoff(20), ON, at(0, 60), rtl()), parameters=floor)
    assert (told["F110"].severity is Severity.ERROR) == is_ended


# Half a turn at 60 °/s lets it off 3 s into a leg at 10 m/s, 30 m of 130 m to the circle; at 5 °/s after
# 36 s, 360 m: outside.  A whole turn at 20 °/s takes 18 s, half of one 9 s, 90 m.
@pytest.mark.parametrize(
    ("rates", "turn", "leaves"),
    [
        ("", (270.0, 0.0, 0.0, 0.0), False),
        ("ATC_SLEW_YAW,500\n", (270.0, 0.0, 0.0, 0.0), True),
        ("ATC_RATE_Y_MAX,5\n", (270.0, 0.0, 0.0, 0.0), True),
        ("ATC_RATE_Y_MAX,5\n", (270.0, 90.0, 0.0, 0.0), True),
        ("", (270.0, 20.0, 0.0, 0.0), False),
        ("", (270.0, 20.0, 1.0, 0.0), True),
    ],
)
def test_a_fence_is_off_behind_a_turn_once_the_vehicle_has_turned(
    rates: str, turn: tuple[float, ...], *, leaves: bool
) -> None:
    heading = item(115, frame=2, params=turn)
    legs = (takeoff(20), at(0, 20), heading, OFF, at(0, 600), LANDS)
    told = ARDUPILOT(legs, parameters=CIRCLE.format(1) + rates)
    assert ("F101" in told) is leaves


# 100 m from rest to rest take 28 s at 0.5 m/s², 17 s the model of reference steps: 250 m off, the fence of
# 150 m goes on after 20 s.
@pytest.mark.parametrize(("acceleration", "leaves"), [(50, True), (250, False)])
def test_a_fence_is_on_by_the_time_the_vehicles_own_legs_take(
    acceleration: int, *, leaves: bool
) -> None:
    wait = item(112, frame=2, params=(20.0, 0.0, 0.0, 0.0))
    legs = (takeoff(20), at(0, 250), wait, ON, at(100, 250), OFF, at(0, 50), LANDS)
    own = f"{CIRCLE.format(0)}WPNAV_ACCEL,{acceleration}\n"
    told = findings_of(legs, autopilot=Autopilot.STEP, parameters=own)
    assert ("F101" in told) is leaves


def test_a_fence_behind_a_turn_is_on_at_once() -> None:
    """It may point there already: the leg back begins outside, and 36 s later would be inside."""
    heading = item(115, frame=2, params=(270.0, 5.0, 0.0, 0.0))
    legs = (takeoff(20), at(0, 300), heading, ON, at(0, 0), LANDS)
    assert "F101" in ARDUPILOT(legs, parameters=CIRCLE.format(0))


@pytest.mark.parametrize("areas", [(), (AROUND,)])
def test_a_fence_the_mission_switches_off_before_leaving_it_is_a_note(
    areas: tuple[FencePolygon, ...],
) -> None:
    on = CIRCLE.format(1).replace("TYPE,2", "TYPE,6")
    told = ARDUPILOT((takeoff(20), OFF, *OUT, LANDS), *areas, parameters=on)
    assert set(told) == {"F111"}
    assert (told["F111"].severity, told["F111"].item) == (Severity.WARNING, 2)
    assert "F101" in ARDUPILOT((takeoff(20), *OUT, OFF, LANDS), *areas, parameters=on)


def test_value_2_switches_the_floor_off_and_nothing_else() -> None:
    given = "FENCE_ENABLE,1\nFENCE_TYPE,10\nFENCE_RADIUS,150\nFENCE_ALT_MIN,15\n"
    low = (at(0, 50, 10.0), LANDS)
    assert set(ARDUPILOT((takeoff(20), *low), parameters=given)) == {"F110"}
    assert ARDUPILOT((takeoff(20), FLOOR_OFF, *low), parameters=given) == {}
    assert "F101" in ARDUPILOT((takeoff(20), FLOOR_OFF, *OUT, LANDS), parameters=given)


@pytest.mark.parametrize("value", range(4))
def test_autoenable_switches_on_nothing_that_the_mission_has_switched_off(value: int) -> None:
    """A take-off in GUIDED alone does (flown with 1: the return climbs past the ceiling)."""
    given = CIRCLE.format(1) + f"FENCE_AUTOENABLE,{value}\n"
    assert "F101" not in ARDUPILOT((OFF, takeoff(20), *OUT, LANDS), parameters=given)
    assert "F101" not in ARDUPILOT((takeoff(20), OFF, *OUT, LANDS), parameters=given)
    # The fence the parameters state is judged, though with 1 it is off.
    assert "F101" in ARDUPILOT((takeoff(20), *OUT, LANDS), parameters=given)


def test_a_ceiling_switched_on_counts_from_the_height_there_is() -> None:
    given = "FENCE_ENABLE,0\nFENCE_TYPE,1\nFENCE_ALT_MAX,60\n"
    high = (takeoff(20), at(0, 50, 80.0))
    assert "F110" in ARDUPILOT((*high, ON, at(0, 80), LANDS), parameters=given)
    assert ARDUPILOT((*high, at(0, 80), ON, LANDS), parameters=given) == {}


def test_px4_has_no_such_item() -> None:
    told = findings_of((takeoff(20), OFF, *OUT, LANDS), AROUND, autopilot=Autopilot.PX4)
    assert "F101" in told


@pytest.mark.parametrize("autopilot", [Autopilot.ARDUPILOT, Autopilot.STEP])
@pytest.mark.parametrize(
    ("parameters", "areas", "is_known"),
    [
        ("", (), False),
        ("WPNAV_SPEED,500\n", (), False),
        ("FENCE_TYPE,2\nWPNAV_SPEED,500\n", (), True),
        ("", (AROUND,), True),
    ],
)
def test_a_fence_switched_on_that_nothing_is_known_of_is_not_checked(
    autopilot: Autopilot,
    parameters: str,
    areas: tuple[FencePolygon, ...],
    is_known: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made = mission(takeoff(20), ON, at(0, 50), rtl(), autopilot=Autopilot.ARDUPILOT)
    made = replace(made, fence=Fence(polygons=areas, circles=()) if areas else None)
    codes = {one.code for one in found(made, autopilot, parameters)}
    assert ("X904" in codes) is not is_known


@settings(deadline=None, max_examples=examples(20))
@given(
    legs=st.lists(
        st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0)), min_size=2, max_size=6
    ),
    off_at=st.integers(0, 6),
    autopilot=st.sampled_from([Autopilot.ARDUPILOT, Autopilot.STEP]),
)
def test_a_flight_is_judged_as_far_as_its_fence_is_on(
    legs: list[tuple[float, float]], off_at: int, autopilot: Autopilot
) -> None:
    places = [(round(east), round(north)) for east, north in legs]
    off_at = min(off_at, len(places))
    items = [at(east, north, params=(1.0, 0.0, 0.0, None)) for east, north in places]
    leaves = [max(abs(east), abs(north)) > 100 for east, north in places]
    if any(90 < max(abs(east), abs(north)) < 110 for east, north in places):
        return  # position error and a cut corner
    flown = (takeoff(20), *items[:off_at], OFF, *items[off_at:], rtl())
    told = findings_of(flown, AROUND, autopilot=autopilot)
    assert ("F101" in told) is any(leaves[:off_at])


@settings(max_examples=examples(12), deadline=None)
@given(
    enable=st.integers(0, 1),
    auto=st.integers(0, 3),
    switches=st.lists(st.sampled_from([None, ON, OFF, FLOOR_OFF]), min_size=2, max_size=2),
)
def test_a_return_keeps_below_the_ceiling_that_is_on_as_it_begins(
    enable: int, auto: int, switches: list[MissionItem | None]
) -> None:
    """``ModeRTL::compute_return_target`` asks ``get_enabled_fences``: RTL_ALT of 300 m, or 60 m less 2 m."""
    # FENCE_AUTOENABLE 1 switches it off on the ground, 3 on as it arms; 2 does nothing in AUTO.
    is_on = auto == 3 or (bool(enable) and auto != 1)
    is_past = bool(enable or auto) and not is_on and switches[0] not in {ON, OFF}
    items = [takeoff(40)]
    for number, one in enumerate(switches, start=1):
        if one is not None:
            items.append(one)
        is_on = {None: is_on, ON: True, OFF: False, FLOOR_OFF: is_on}[one]
        items.append(waypoint(100 * number, 40))
    given = f"FENCE_ENABLE,{enable}\nFENCE_AUTOENABLE,{auto}\nFENCE_TYPE,1\nFENCE_ALT_MAX,60\n"
    done = check(
        mission(*items, rtl()),
        load_vehicle("arducopter-sitl-quad"),
        parameters=parameters_from_text(
            f"{given}FENCE_MARGIN,2\nRTL_ALT,30000\n".encode(), source="p.param"
        ),
    )
    assert done.totals.climb_m == pytest.approx(58.0 if is_on else 300.0, abs=0.5)
    assert bool([one for one in done.findings if one.code == "F110"]) is is_past


RELAUNCHED = (takeoff(10), ON, at(0, 20, 10.0), at(0, 20, 0.0, command=21))


@pytest.mark.parametrize(
    ("enable", "auto", "items", "top_m"),
    [
        # Flown by ArduCopter 4.7 (8264a9b4) with RTL_ALT 95 m, until the return was above its ceiling or held
        # at 58.0 m: FENCE_ALT_MAX 60 less FENCE_MARGIN 2.
        (0, 1, (takeoff(20),), 95.0),
        (0, 2, (takeoff(20),), 95.0),
        (0, 3, (takeoff(20),), 58.0),
        (1, 0, (takeoff(20),), 58.0),
        (1, 1, (takeoff(20),), 95.0),
        (1, 2, (takeoff(20),), 58.0),
        (0, 1, (takeoff(20), ON), 58.0),
        (1, 1, (OFF, takeoff(20)), 95.0),
        # 1 switches off what the mission switches on while the vehicle stands, or lands
        (0, 1, (ON, takeoff(20)), 95.0),
        (0, 2, (ON, takeoff(20)), 58.0),
        (0, 1, (*RELAUNCHED, takeoff(15)), 95.0),
        (0, 2, (*RELAUNCHED, takeoff(15)), 58.0),
    ],
)
def test_what_a_return_climbs_to_by_autoenable(
    enable: int, auto: int, items: tuple[MissionItem, ...], top_m: float
) -> None:
    given = (
        f"FENCE_ENABLE,{enable}\nFENCE_AUTOENABLE,{auto}\nFENCE_TYPE,1\nFENCE_ALT_MAX,60\n"
        "FENCE_MARGIN,2\nRTL_ALT,9500\nMIS_OPTIONS,4\nDISARM_DELAY,20\n"
    )
    done = check(
        mission(*items, waypoint(40, 20), rtl()),
        load_vehicle("arducopter-sitl-quad"),
        parameters=parameters_from_text(given.encode(), source="p.param"),
    )
    landed_m = 10.0 if len(items) > 2 else 0.0
    assert done.totals.climb_m - landed_m == pytest.approx(top_m, abs=0.5)


@pytest.mark.parametrize(
    ("enable", "switches", "top_m", "is_breach"),
    [
        # ArduPilot carries out the second item of its queue when the return has begun, which has chosen its
        # height by then (`ModeRTL::compute_return_target`): 100 m by RTL_ALT, or 60 m less 2 m.
        (0, (item(206, frame=2), ON), 100.0, True),
        (0, (ON,), 58.0, False),
        (0, (ON, item(206, frame=2)), 58.0, False),
        (1, (item(206, frame=2), OFF), 58.0, False),
        (1, (OFF,), 100.0, False),
        (1, (OFF, ON), 100.0, True),
        (0, (item(112, frame=2, params=(2.0, 0.0, 0.0, 0.0)), ON), 100.0, True),
    ],
)
def test_a_return_climbs_by_the_fence_as_its_leg_begins(
    enable: int, switches: tuple[MissionItem, ...], top_m: float, *, is_breach: bool
) -> None:
    given = (
        f"FENCE_ENABLE,{enable}\nFENCE_TYPE,1\nFENCE_ALT_MAX,60\nFENCE_MARGIN,2\nRTL_ALT,10000\n"
    )
    done = check(
        mission(takeoff(40), waypoint(100, 40), *switches, rtl()),
        load_vehicle("arducopter-sitl-quad"),
        parameters=parameters_from_text(given.encode(), source="p.param"),
    )
    assert done.totals.climb_m == pytest.approx(top_m, abs=0.5)
    told = [(one.severity, one.item) for one in done.findings if one.code == "F110"]
    assert told == ([(Severity.ERROR, 3 + len(switches))] if is_breach else [])


@pytest.mark.parametrize(
    ("settings", "switches", "is_told"),
    [
        ("FENCE_ACTION,4\nFENCE_ALT_MIN,3\n", (FLOOR_OFF,), True),
        ("FENCE_ACTION,4\nFENCE_ALT_MIN,0\n", (FLOOR_OFF,), True),
        ("FENCE_ACTION,4\nFENCE_ALT_MIN,-0.1\n", (FLOOR_OFF,), False),
        ("FENCE_ACTION,4\nFENCE_ALT_MIN,3\nRTL_ALT_FINAL,400\n", (FLOOR_OFF,), False),
        ("FENCE_ACTION,1\nFENCE_ALT_MIN,3\n", (FLOOR_OFF,), False),  # lands at home at last
        ("FENCE_ACTION,1\nFENCE_ALT_MIN,3\nRTL_CONE_SLOPE,0\n", (FLOOR_OFF,), True),
        ("FENCE_ACTION,2\nFENCE_ALT_MIN,3\n", (FLOOR_OFF,), False),
    ],
)
def test_a_floor_switched_off_for_the_landing_alone_ends_returns_until_then(
    settings: str, switches: tuple[MissionItem, ...], *, is_told: bool
) -> None:
    legs = (takeoff(20), at(0, 30), ON, at(0, 60), *switches, at(0, 5, 20.0), rtl())
    told = ARDUPILOT(legs, parameters=f"FENCE_ENABLE,0\nFENCE_TYPE,8\n{settings}")
    assert ("F110" in told) == is_told
    if is_told:
        assert (told["F110"].item, told["F110"].severity) == (4, Severity.ERROR)
        assert "a return of the vehicle's own" in told["F110"].message
