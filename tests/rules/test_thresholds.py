"""Numbers that rules compare with, tried on both sides; more of them are in rule_cases."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

import pytest
from fenced_missions import at, degrees, rally
from made_missions import HOME, item, jump, mission, north, rtl, takeoff, waypoint
from made_terrain import ground
from rule_cases.case import ARDUPILOT, PLAIN, PLENTY, PX4, STEP, found, vehicle_of
from rule_cases.energy import of_voltage
from rule_cases.fence import SHORT, reported, ring
from rule_cases.mission import far_away

from planner.autopilot import TARGETS
from planner.findings import Severity
from planner.flight.returns.path import FlightPoint
from planner.geo.geodesy import LocalFrame
from planner.physics.wind import Wind
from planner.rules.energy import place_along
from planner.service.preflight import check
from planner.site_profile import SiteProfile
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.declared import Interval

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from planner.findings import Finding
    from planner.flight.prediction import Extremes
    from planner.mission.items import Mission

INFO, WARNING, ERROR = Severity.INFO, Severity.WARNING, Severity.ERROR
UP_AND_DOWN = mission(takeoff(20), waypoint(100, 20), waypoint(300, 120), waypoint(600, 20), rtl())
TINY = 1e-9


@cache
def extremes() -> Extremes:
    """Return the extremes of that flight as ArduPilot's vehicle flies it."""
    assessment = check(UP_AND_DOWN, vehicle_of(ARDUPILOT)).assessment
    assert assessment is not None
    assert assessment.flight.extremes is not None
    return assessment.flight.extremes


@cache
def air_kg_m3(*, highest: bool) -> float:
    """Return the density of the air at its highest, or its lowest, point."""
    assessment = check(UP_AND_DOWN, vehicle_of(ARDUPILOT)).assessment
    assert assessment is not None
    box = extremes()
    height_m = box.highest_m if highest else box.lowest_m
    return float(assessment.flight.power.air_density_kg_m3(height_m))


def identified(
    *,
    speed_m_s: float | None = None,
    climb_m_s: float | None = None,
    density_kg_m3: tuple[float, float] | None = None,
) -> tuple[Finding, ...]:
    """Return what is found where the model was identified to so much and no more."""
    quad = vehicle_of(ARDUPILOT)
    box = replace(
        quad.valid_for,
        speed_m_s=speed_m_s and Interval(low=0.0, high=speed_m_s),
        climb_rate_m_s=climb_m_s and Interval(low=-climb_m_s, high=climb_m_s),
        air_density_kg_m3=density_kg_m3 and Interval(low=density_kg_m3[0], high=density_kg_m3[1]),
    )
    return found(UP_AND_DOWN, ARDUPILOT, vehicle=replace(quad, valid_for=box))


def to_height(height_m: float) -> Mission:
    return mission(takeoff(100), waypoint(100, height_m), waypoint(200, height_m), rtl())


def climbing(height_m: float) -> Mission:
    """Return a flight that climbs so far above 100 m, and ends there."""
    return mission(takeoff(100), waypoint(100, 100 + height_m))


def planned_at(home_m: float) -> tuple[Finding, ...]:
    """Return what is found of a home that the grid has at 400 m."""
    home = replace(HOME, altitude_amsl_m=home_m)
    one = mission(takeoff(20), waypoint(100, 20), rtl(), home=home)
    return found(one, terrain=ground(0.0))


def counted_jumps(count: int) -> tuple[Finding, ...]:
    # each to its own place: in each other they would be flown 2 ** count times
    rounds = (one for at in range(count) for one in (waypoint(9, 20), jump(2 * at + 2, 1)))
    return found(mission(takeoff(20), *rounds, rtl()), ARDUPILOT)


NEARER = mission(takeoff(100), waypoint(1000, 100), item(21, north(20), 0.0))
"""Lands 20 m nearer to its farthest place than a return from there would."""


def falling_short(times: float) -> tuple[Finding, ...]:
    """Return what is found where a return is short of so many times what the mission is short of."""
    result = check(NEARER, vehicle_of(STEP), battery=PLENTY, reserve=0.0)
    assert result.return_plan is not None
    assert result.return_plan.margin_wh is not None
    need_wh = result.totals.energy_wh
    return_wh = PLENTY.energy_wh - result.return_plan.margin_wh
    # return_wh - capacity = times (need_wh - capacity)
    capacity_wh = (times * need_wh - return_wh) / (times - 1.0)
    return found(NEARER, battery=Battery(capacity_wh=capacity_wh), reserve=0.0)


HEAD_WIND = Wind(speed_m_s=5.0, from_deg=0.0)


def against_the_wind(times: float) -> tuple[Finding, ...]:
    """Return what is found where the article's vehicle has so many times the airspeed it is known to."""
    article = vehicle_of(STEP)
    one = mission(takeoff(100), waypoint(600, 100), rtl())
    assessment = check(one, article, wind=HEAD_WIND).assessment
    assert assessment is not None
    assert assessment.flight.extremes is not None
    fastest_m_s = assessment.flight.extremes.airspeed_m_s.value
    box = replace(article.valid_for, speed_m_s=Interval(low=0.0, high=fastest_m_s / times))
    return found(one, vehicle=replace(article, valid_for=box), wind=HEAD_WIND)


def begun_at(metres: float, target: str = "px4-1.16") -> tuple[Finding, ...]:
    """Return what PX4's rules tell of a first place so far away, where no parameters are known."""
    latitude_deg = degrees(0.0, metres)[0]
    return found(mission(item(16, latitude_deg, 20.0), rtl()), target=TARGETS[target])


def beside_the_mission(metres: float) -> tuple[Finding, ...]:
    """Return what ArduPilot's rules tell of a rally point, where no parameters are known."""
    one = replace(PLAIN, rally=(rally(metres, 50.0),))
    return found(one, target=TARGETS["arducopter-4.6"])


def below_a_ceiling(height_m: float) -> Iterable[Finding]:
    items = (takeoff(20), at(0, 100, height_m), rtl())
    return reported(items, autopilot=PX4, parameters="GF_MAX_VER_DIST,60\n")


def returning_below_a_ceiling(height_m: float) -> Iterable[Finding]:
    items = (takeoff(20), at(0, 100), at(0, 100, 0.0, command=21))
    given = f"GF_MAX_VER_DIST,60\nRTL_RETURN_ALT,{height_m}\n"
    return reported(items, autopilot=PX4, parameters=given)


def above_a_floor(height_m: float) -> Iterable[Finding]:
    items = (takeoff(20), at(0, 100, height_m), at(0, 100, 0.0, command=21))
    given = "FENCE_ENABLE,1\nFENCE_ACTION,1\nFENCE_TYPE,8\nFENCE_ALT_MIN,15\n"
    return reported(items, autopilot=ARDUPILOT, parameters=given)


CASES: tuple[
    tuple[
        str, str, Callable[[float], Iterable[Finding]], float, list[Severity], float, list[Severity]
    ],
    ...,
] = (
    # code, words of the message, findings of a value, inside with severities, outside likewise
    # that model knows 403 m; half a metre more, and 3 % that a height overshoots, are silent: 415.605 m
    (
        "E105",
        "m above home",
        lambda m: found(to_height(m), ARDUPILOT),
        415.6,
        [],
        415.61,
        [WARNING],
    ),
    # it knows −1 m, and is silent about half a metre less
    ("E105", "m below home", lambda m: found(to_height(m), ARDUPILOT), -1.5, [], -1.51, [WARNING]),
    ("E105", "identified step", lambda m: found(climbing(m)), 100.49, [], 100.51, [WARNING]),
    ("E105", "airspeed of", against_the_wind, 1.03 - TINY, [], 1.03 + TINY, [WARNING]),
    (
        "E105",
        "m/s flown; .* up to",
        lambda x: identified(speed_m_s=extremes().ground_speed_m_s.value / x),
        *(1.03 - TINY, [], 1.03 + TINY, [WARNING]),
    ),
    (
        "E105",
        "climb rate",
        lambda x: identified(climb_m_s=extremes().climb_m_s.value / x),
        *(1.03 - TINY, [], 1.03 + TINY, [WARNING]),
    ),
    (
        "E105",
        "climb rate of 2",
        lambda x: identified(climb_m_s=extremes().climb_m_s.value / x),
        *(2.0 - TINY, [WARNING], 2.0 + TINY, [ERROR]),
    ),
    (
        "E105",
        "air of",
        lambda x: identified(density_kg_m3=(air_kg_m3(highest=True) / x, 2.0)),
        *(0.98 + TINY, [], 0.98 - TINY, [INFO]),
    ),
    (
        "E105",
        "air of",
        lambda x: identified(density_kg_m3=(0.5, air_kg_m3(highest=False) / x)),
        *(1.02 - TINY, [], 1.02 + TINY, [INFO]),
    ),
    # 1.225 kg/m³ over that of the standard atmosphere is 1.1 at 982 m, 20 m above home.
    ("E108", "thinner", lambda m: found(PLAIN, home_amsl_m=m), 958.0, [], 965.0, [WARNING]),
    ("E102", "the return takes", falling_short, 1.05 - 1e-6, [], 1.05 + 1e-6, [ERROR]),
    ("E121", "", of_voltage, 6 * 3.9 - TINY, [], 6 * 3.9 + TINY, [ERROR]),
    (
        "A114",
        "",
        lambda m: found(
            to_height(100), PX4, profile=SiteProfile(source="s", max_height_above_home_m=m)
        ),
        *(100.0 - 0.045, [], 100.0 - 0.051, [ERROR]),
    ),
    ("A115", "", planned_at, 409.9, [], 410.1, [WARNING]),
    ("M104", "", begun_at, 9_999.0, [], 10_001.0, [WARNING]),
    ("M104", "", lambda minor: begun_at(10_001.0, f"px4-1.{minor}"), 16, [WARNING], 15, [ERROR]),
    ("M118", "", beside_the_mission, 299.9, [], 300.1, [WARNING]),
    ("M124", "", far_away, 99_999.0, [WARNING], 100_001.0, [ERROR]),
    ("M125", "", lambda n: counted_jumps(int(n)), 100, [WARNING], 101, [ERROR]),
    # 0.5 m, the accuracy of heights, and 2 m, FENCE_MARGIN, less 1 cm each.
    ("F110", "", below_a_ceiling, 59.5098, [WARNING], 59.5102, [ERROR]),
    ("F110", "", below_a_ceiling, 58.0098, [], 58.0102, [WARNING]),
    ("F110", "a return climbs", returning_below_a_ceiling, 59.5098, [WARNING], 59.5102, [ERROR]),
    ("F110", "a return climbs", returning_below_a_ceiling, 58.0098, [], 58.0102, [WARNING]),
    ("F110", "", above_a_floor, 15.4902, [WARNING], 15.4898, [ERROR]),
    ("F110", "", above_a_floor, 16.9902, [], 16.9898, [WARNING]),
    (
        "F112",
        "; PX4 holds 64$",
        lambda n: reported(SHORT, ring(int(n)), autopilot=PX4),
        64,
        [],
        65,
        [WARNING],
    ),
)


@pytest.mark.parametrize(("code", "words", "of", "inside", "silent", "outside", "fires"), CASES)
def test_a_rule_changes_its_mind_at_its_number(
    code: str,
    words: str,
    of: Callable[[float], Iterable[Finding]],
    inside: float,
    silent: list[Severity],
    outside: float,
    fires: list[Severity],
) -> None:
    for value, severities in ((inside, silent), (outside, fires)):
        findings = [one for one in of(value) if one.code == code and re.search(words, one.message)]
        assert [one.severity for one in findings] == severities, value


@pytest.mark.parametrize(
    ("along_m", "words"), [(994.9, "995 m into the leg to item 2"), (995.0, "item 2")]
)
def test_a_point_near_the_end_of_its_leg_is_at_its_item(along_m: float, words: str) -> None:
    frame = LocalFrame(latitude_deg=47.0, longitude_deg=8.0)
    point = FlightPoint(
        item=2, time_s=0.0, along_m=along_m, leg_m=1000.0, east_m=0.0, north_m=0.0, frame=frame
    )
    assert point.place_deg == pytest.approx((47.0, 8.0))
    assert place_along(point) == words
