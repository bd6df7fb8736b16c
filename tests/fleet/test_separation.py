"""Which heights of two missions are compared, and who is in whose way."""

from __future__ import annotations

import math

import pytest
from made_missions import HOME, METRES_PER_DEGREE_NORTH, item, mission, north, rtl, takeoff
from rule_cases.case import PLAIN
from rule_cases.swarm import moved, together
from sampled_fleet import drawn_fleet, misjudged

from planner.mission.items import Mission, MissionFormat
from planner.values import replace


def east(one: Mission, metres: float) -> Mission:
    """Return a mission so many metres farther east."""
    by_deg = metres / METRES_PER_DEGREE_NORTH / math.cos(math.radians(HOME.latitude_deg))
    home = one.home or HOME
    return replace(
        one,
        source="other.plan",
        home=replace(home, longitude_deg=home.longitude_deg + by_deg),
        items=tuple(
            replace(each, longitude_deg=each.longitude_deg + by_deg) if each.longitude_deg else each
            for each in one.items
        ),
    )


@pytest.mark.parametrize(
    ("apart_m", "altitude_amsl_m", "is_too_near"),
    [
        (10.0, 400.0, True),  # side by side
        (10.0, 430.0, False),  # 30 m above the other, as its home is
        (10.0, 0.0, True),  # not known: compared above home
        (0.99, 430.0, True),  # one place has one altitude, whatever the files say
        (1.01, 430.0, False),
    ],
)
def test_heights_count_above_the_sea_where_homes_differ(
    apart_m: float, altitude_amsl_m: float, *, is_too_near: bool
) -> None:
    other = moved(PLAIN, apart_m)
    other = replace(other, home=replace(other.home or HOME, altitude_amsl_m=altitude_amsl_m))
    found = together(PLAIN, other, separation_m=20.0)
    assert any(finding.code == "S101" for finding in found) is is_too_near


@pytest.mark.parametrize(
    ("starts_s", "when"), [((0, 900), "before its start"), ((900, 0), "after its end")]
)
def test_a_vehicle_that_stands_is_in_the_way_of_one_that_flies_over_it(
    starts_s: tuple[float, float], when: str
) -> None:
    """PLAIN is 20 m above a vehicle that only hops to 6 m, 50 m north of its home."""
    hop = moved(mission(takeoff(6), item(21, HOME.latitude_deg, 0.0)), 50.0)
    for separation_m, count in ((19.9, 0), (20.1, 1)):
        found = together(PLAIN, hop, separation_m=separation_m, starts_s=starts_s)
        told = [finding.message for finding in found if finding.code == "S101"]
        assert len(told) == count
        assert all(message.endswith(f"other.plan {when}") for message in told)


def test_several_that_come_too_near_are_one_finding() -> None:
    from planner.service.preflight import check
    from planner.service.separation import check_together
    from planner.vehicle.library import load_vehicle

    vehicle = load_vehicle("arducopter-sitl-quad")
    results = [check(moved(PLAIN, metres), vehicle) for metres in (0.0, 3.0, 7.0)]
    for one, nearest in zip(
        check_together(results, separation_m=20.0), ("3.0", "3.0", "4.0"), strict=True
    ):
        [finding] = [finding for finding in one.findings if finding.code == "S101"]
        assert finding.message.startswith(
            f"{nearest} m from other.plan, 20 m required by --separation: "
        )
        assert finding.message.endswith("; too near to other.plan as well")


@pytest.mark.parametrize(
    ("name", "severity"), [("falkowski-2023-quadrotor", "error"), ("arducopter-sitl-quad", "")]
)
def test_a_spline_that_is_predicted_straight_keeps_nobody_apart(name: str, severity: str) -> None:
    from planner.service.preflight import check
    from planner.service.separation import check_together
    from planner.vehicle.library import load_vehicle

    curve = mission(takeoff(20), item(82, north(100), 20.0), item(82, north(200), 20.0), rtl())
    results = [check(one, load_vehicle(name)) for one in (curve, moved(PLAIN, 500.0))]
    for one in check_together(results, separation_m=20.0):
        found = [f for f in one.findings if f.code == "S104"]
        assert [f.severity.label for f in found] == [severity] * bool(severity)
        assert all("flies the spline of item 2 as a curve" in f.message for f in found)


@pytest.mark.parametrize(
    ("beside_m", "amsl_m", "severities"),
    [(4.0, 0.0, ["error"]), (6.0, 0.0, ["warning"]), (4.0, 430.0, [])],
)
def test_heights_that_cannot_be_compared_keep_nobody_apart(
    beside_m: float, amsl_m: float, severities: list[str]
) -> None:
    # 5 m are kept. from the other.
    other = mission(takeoff(50), item(16, north(100), 50.0), rtl())
    other = east(replace(other, home=replace(HOME, altitude_amsl_m=amsl_m)), beside_m)
    told = [f for f in together(PLAIN, other) if f.code == "S104"]
    assert [f.severity.label for f in told] == severities
    assert ["seen from above" in f.message for f in told] == [one == "error" for one in severities]


@pytest.mark.parametrize(
    ("away_m", "kind", "severities"),
    [
        (490.0, MissionFormat.PLAN, ["error"]),
        (520.0, MissionFormat.PLAN, ["warning"]),
        (490.0, MissionFormat.FOREIGN, ["warning"]),
    ],
)
def test_a_way_from_an_unknown_home_may_pass_whoever_is_in_sight(
    away_m: float, kind: MissionFormat, severities: list[str]
) -> None:
    one = replace(PLAIN, home=None, file_format=kind)
    told = together(one, east(PLAIN, away_m))
    assert [f.severity.label for f in told if f.code == "S104"] == severities


@pytest.mark.parametrize(("later_s", "severity"), [(300.0, "error"), (900.0, "warning")])
def test_a_way_from_an_unknown_home_passes_nobody_who_has_long_landed(
    later_s: float, severity: str
) -> None:
    # A flight takes some 90 s, a way of 500 m no more than 500 s.
    one = replace(PLAIN, home=None)
    told = together(one, east(PLAIN, 490.0), starts_s=(0.0, later_s))
    assert [f.severity.label for f in told if f.code == "S104"] == [severity]


def test_a_mission_that_flies_nothing_is_told_of_on_both_sides() -> None:
    nothing = mission(rtl())
    assert [f.message for f in together(PLAIN, nothing) if f.code == "S104"] == [
        "made.plan flies nothing: no separation from it is checked"
    ]
    assert [f.message for f in together(nothing, PLAIN) if f.code == "S104"] == [
        "nothing is flown: the separation from the other missions is not checked"
    ]


@pytest.mark.parametrize("seed", [0, 3, 10])
def test_a_drawn_fleet_is_judged_as_by_samples_of_its_tracks(seed: int) -> None:
    assert misjudged(drawn_fleet(seed)) == []


@pytest.mark.parametrize(
    ("away_m", "height_m", "wind_m_s", "is_too_near"),
    [
        (23.0, 20.0, 9.3, True),
        (27.0, 20.0, 9.3, False),
        (23.0, 20.0, 8.9, False),  # W105 is silent
        (13.0, 20.0, 0.0, False),
        (23.0, 31.0, 9.3, False),  # the circle stays level
    ],
)
def test_a_circle_that_the_wind_widens_is_so_much_nearer_to_others(
    away_m: float, height_m: float, wind_m_s: float, *, is_too_near: bool
) -> None:
    """Three quarters of 20 m are 15 m, and 10 m are kept; it hovers so far beside the circle.

    The vehicle flies a metre or two inside of the circle its target is on.
    """
    from planner.physics.wind import Wind
    from planner.service.preflight import check
    from planner.service.separation import check_together
    from planner.vehicle.library import load_vehicle

    vehicle = load_vehicle("arducopter-sitl-quad")
    there = item(18, north(300), 20.0, params=(2.0, 0.0, 20.0, 0.0))
    circles = mission(takeoff(20), there, rtl())
    wait = item(19, HOME.latitude_deg, height_m, params=(120.0, 0.0, 0.0, 0.0))
    hovers = mission(takeoff(height_m), wait, item(21, HOME.latitude_deg, 0.0))
    wind = Wind(speed_m_s=wind_m_s, from_deg=90.0)
    results = [check(one, vehicle, wind=wind) for one in (circles, moved(hovers, 320.0 + away_m))]
    for one in check_together(results, separation_m=10.0):
        found = [f.message for f in one.findings if f.code == "S101"]
        assert bool(found) is is_too_near
        assert all(
            "may be up to 15 m beside its path there: the wind widens its circle (W105)" in each
            for each in found
        )
