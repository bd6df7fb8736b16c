"""Fleets whose models are of reference steps, as the autopilots of their missions fly them.

Judge is the model of ArduPilot's own motion, or geometry by hand.
"""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import METRES_PER_DEGREE_EAST, checked, pad, place, sortie, up, vehicles
from made_missions import HOME, item, mission, north
from made_swarm import simulated
from made_trajectories import straight

from planner.autopilot import Autopilot
from planner.fleet.approach import closest_approach
from planner.fleet.trajectory import Pace
from planner.service.fleet_separation import members
from planner.service.fleet_volumes import fleet_volumes
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem
    from planner.service.fleet import FleetResult

STEP, OWN = "falkowski-2023-quadrotor", "arducopter-sitl-quad"
EXACT = "[conditions]\nposition_error_m = 0\n"


def land(metres_north: float, metres_east: float) -> MissionItem:
    """A landing so far from home."""
    east_deg = HOME.longitude_deg + metres_east / METRES_PER_DEGREE_EAST
    return item(21, north(metres_north), 0.0, longitude_deg=east_deg)


def of_ardupilot(*items: MissionItem) -> Mission:
    """A plan that says whose it is."""
    return replace(mission(*items), autopilot=Autopilot.ARDUPILOT)


def flown(
    models: tuple[str, str],
    starts_s: tuple[float, float],
    pads_m: tuple[tuple[float, float], tuple[float, float]],
    ways: tuple[Mission, Mission],
    apart_m: float = 10.0,
) -> FleetResult:
    """The check of two, each from its pad, that keep a distance exactly."""
    tables = [
        table
        for name, model, start_s, at_m in zip("ab", models, starts_s, pads_m, strict=True)
        for table in (
            pad(name, *at_m),
            vehicles(name, model=model),
            sortie(f"of-{name}", name, start_s, job=name),
        )
    ]
    keep = f"[separation]\nhorizontal_m = {apart_m}\nstart_error_s = 0\nheight_error_m = 0\n"
    return checked(keep, EXACT, *tables, a=ways[0], b=ways[1])


def codes(result: FleetResult) -> set[str]:
    """What is found of distances between them in the air."""
    return {one.finding.code for one in result.findings} & {"S101", "S114", "S104"}


BOTH = [(STEP, STEP), (OWN, OWN), (STEP, OWN), (OWN, STEP)]

# (20 m, 12 m high) to (300 m, 60 m): in the middle 160 m east, 36 m high.
RISES = of_ardupilot(up(12), place(0, 20, 12), place(0, 300, 60), land(0, 300))


@pytest.mark.parametrize("models", BOTH)
@pytest.mark.parametrize(("height_m", "found"), [(36.0, True), (90.0, False)])
def test_who_climbs_along_a_leg_meets_who_hovers_in_its_middle(
    models: tuple[str, str], height_m: float, *, found: bool
) -> None:
    hovers = of_ardupilot(up(height_m), place(-80, 160, height_m), place(0, 160, height_m, 90.0))
    hovers = replace(hovers, items=(*hovers.items, land(-80, 160)))
    result = flown(models, (0.0, 0.0), ((0.0, 0.0), (-80.0, 160.0)), (RISES, hovers))
    assert codes(result) == ({"S101"} if found else set())


def lanes(metres_north: float) -> Mission:
    """Seven lanes of 200 m, 100 m from each other."""
    corners = [
        (metres_north + 100.0 * lane, east_m)
        for lane in range(7)
        for east_m in ((0.0, 200.0) if lane % 2 == 0 else (200.0, 0.0))
    ]
    return of_ardupilot(up(40), *(place(*one, 40) for one in corners[1:]), land(*corners[-1]))


# ArduPilot's model has a spread of times, by which two side by side may be 30 m from each other's place.
@pytest.mark.parametrize(
    ("models", "behind_s"),
    [(BOTH[0], 0.0), (BOTH[0], 30.0), (BOTH[0], 60.0), (BOTH[1], 30.0), (BOTH[1], 60.0)],
)
def test_two_alike_on_lanes_beside_each_other_keep_their_distance(
    models: tuple[str, str], behind_s: float
) -> None:
    """The second flies 30 m north of the first, later over places of it: 300 m behind.

    The first passes 12 corners, each up to 4 s sooner than its model.
    """
    result = flown(
        models, (0.0, behind_s), ((0.0, 0.0), (30.0, 0.0)), (lanes(0.0), lanes(30.0)), 25.0
    )
    assert codes(result) == set()


def passed_s(result: FleetResult, name: str, metres_north: float) -> float:
    """When a sortie is first nearest to a place so far north of home, since its start."""
    [one] = [one for one in result.sorties if one.name == name]
    assert one.assessment is not None
    frame, motion = one.assessment.route.frame, one.assessment.flight.motion
    east_m, north_m = frame.east_north_m(
        np.array(north(metres_north)), np.array(HOME.longitude_deg)
    )
    time_s = np.arange(0.0, one.time_s, 0.1)
    place_m = motion.state_at_time(time_s).place_m
    return float(time_s[np.argmin(np.hypot(place_m[:, 0] - east_m, place_m[:, 1] - north_m))])


# Ten places on a line that the model stops at, ArduPilot at none.
LINE = of_ardupilot(up(40), *(place(60.0 * n, 0, 40) for n in range(1, 11)), land(600, 0))
ACROSS = of_ardupilot(up(40), place(300, -300, 40), land(300, -300))


def test_who_stops_nowhere_is_met_where_its_autopilot_is() -> None:
    def beside(models: tuple[str, str], start_s: float) -> FleetResult:
        return flown(models, (0.0, start_s), ((0.0, 0.0), (300.0, 300.0)), (LINE, ACROSS))

    plain = beside((OWN, OWN), 0.0)
    start_s = round(passed_s(plain, "of-a", 300.0) - passed_s(plain, "of-b", 300.0), 1)
    for models in BOTH:
        result = beside(models, start_s)
        assert codes(result) == {"S101"}
        [found] = [one for one in result.findings if one.finding.code == "S101"]
        assert found.at_s == pytest.approx(passed_s(plain, "of-a", 300.0), abs=3.0)
        # 120 m behind the one, by more than that ahead of where the model is.
        assert codes(beside(models, start_s + 12.0)) == set()


def test_what_a_fleet_flies_is_in_its_volumes_as_its_autopilots_fly() -> None:
    from shapely import Point, Polygon

    begin = dt.datetime(2026, 5, 12, 8, tzinfo=dt.UTC)
    at = "start = 2026-05-12T08:00:00Z\ngeoid_height_m = 0.0\n"
    tables = [f"[operation]\n{at}", "[separation]\nhorizontal_m = 10\n", EXACT, pad("a", 0, 0)]
    flies = sortie("of-a", "a", 0.0, job="a")
    own, step = (
        checked(*tables, vehicles("a", model=model), flies, a=RISES) for model in (OWN, STEP)
    )
    [intent] = fleet_volumes(step)
    [sorted_] = own.sorties
    assert sorted_.assessment is not None
    motion, frame = sorted_.assessment.flight.motion, sorted_.assessment.route.frame
    for time_s in np.linspace(1.0, sorted_.time_s - 1.0, 60).tolist():
        [[east_m, north_m, height_m]] = motion.state_at_time(np.array([time_s])).place_m.tolist()
        where = frame.latitude_longitude_deg(np.array(east_m), np.array(north_m))
        assert any(
            Polygon(one.vertices_deg).contains(Point(*map(float, where)))
            and one.lower_m <= 400.0 + height_m <= one.upper_m
            and one.start <= begin + dt.timedelta(seconds=time_s) <= one.end
            for one in intent.volumes
        )


# The whole way against 7 m/s of wind, which one that holds 10 m/s comes forward in at 3 m/s: who flies so
# many seconds behind is then 3 m behind for each.
@pytest.mark.parametrize(
    ("behind_s", "are_alike", "too_near"),
    [(6.0, True, True), (8.0, True, False), (8.0, False, True), (60.0, False, True)],
)
def test_who_is_late_for_want_of_airspeed_is_followed_as_much_later(
    behind_s: float, *, are_alike: bool, too_near: bool
) -> None:
    whole_s, parts = 60.0, 240
    way = straight(*((t, 10.0 * t, 0.0, 40.0) for t in np.linspace(0.0, whole_s, parts + 1)))
    passed_s = np.clip(np.stack((way.start_s, way.end_s), axis=1), 0.0, whole_s)
    pace = Pace(flown_by=(), passed_s=np.zeros((2, 1))) if are_alike else None
    whole = replace(way, late_s=passed_s * (10.0 / 3.0 - 1.0), pace=pace)
    one = whole.parts(np.flatnonzero(~way.is_rest))
    nearest = closest_approach(one, one, second_later_s=behind_s, within_m=20.0)
    assert (nearest is not None) is too_near
    if are_alike and nearest is not None:
        # Parts of a quarter of a second are late by 0.6 s more at their ends.
        assert nearest.distance_m == pytest.approx(3.0 * behind_s, abs=3.0 * 2.0 * 0.6)


def test_only_who_flies_the_same_pace_is_late_as_much() -> None:
    quick = Pace(flown_by=("g1",), passed_s=np.array([[10.0, 20.0], [0.0, 5.0]]))
    assert quick.is_that_of(replace(quick, passed_s=quick.passed_s + 0.05))
    assert not quick.is_that_of(replace(quick, passed_s=quick.passed_s + 0.2))
    assert not quick.is_that_of(replace(quick, passed_s=quick.passed_s[:, :1]))
    assert not quick.is_that_of(replace(quick, flown_by=("g2",)))


def test_two_of_a_fleet_are_alike_with_one_model_and_one_way() -> None:
    alike, other = (
        flown((STEP, STEP), (0.0, 60.0), ((0.0, 0.0), (0.0, 40.0)), (LINE, way))
        for way in (
            of_ardupilot(up(40), *(place(60.0 * n, 40, 40) for n in range(1, 11)), land(600, 40)),
            ACROSS,
        )
    )
    for result, expected in ((alike, True), (other, False)):
        assert result.fleet.separation is not None
        one, two = members(result.fleet, result.fleet.separation, result.sorties)
        for first, second in ((one.trajectory, two.trajectory), (one.own, two.own)):
            assert first is not None
            assert second is not None
            assert first.pace is not None
            assert second.pace is not None
            assert first.pace.is_that_of(second.pace) is expected


def test_who_gives_way_is_simulated_as_its_autopilot_flies_too() -> None:
    """ArduPilot lands the last 10 m at 0.5 m/s: 20 s, some 10 s more than the model."""
    way = of_ardupilot(up(40), place(100, 0, 40), land(100, 0))
    tables = ("[separation]\nhorizontal_m = 10\n", pad("a", 0, 0), pad("b", 0, 200))
    two = (vehicles("a", model=STEP), vehicles("b", model=OWN))
    flies = (sortie("of-a", "a", 0.0, job="a"), sortie("of-b", "b", 0.0, job="b"))
    ways = {"a": way, "b": of_ardupilot(up(20), place(0, 230, 20), land(0, 230))}
    [one] = [each for each in checked(*tables, *two, *flies, **ways).sorties if each.name == "of-a"]
    predicted_s, own_s = (each.flight.time_s for each in one.ways)
    assert own_s > predicted_s + 3.0
    for limit_s, late in ((0.5 * (predicted_s + own_s), True), (own_s + 1.0, False)):
        hours = f"[operation]\nlatest_s = {limit_s!r}\n"
        found = simulated(*tables, *two, *flies, hours, policy="stop", **ways).findings
        said = [each.message for each in found if each.code == "S138"]
        assert bool(said) is late
        assert all(each.endswith("(as its own autopilot flies)") for each in said)
        at_last = {f.finding.code for f in checked(*tables, *two, *flies, hours, **ways).findings}
        assert ("S111" in at_last) is late


def test_no_swarm_that_gives_way_is_clear_while_nobody_knows_how_late_it_is() -> None:
    """A circle of 5 m radius at 10 m/s is 2 g: ArduPilot flies it slower; whose the plan is nobody says."""
    circles = mission(
        up(20), item(18, north(100), 20.0, params=(20.0, 0.0, 5.0, 0.0)), land(100, 0)
    )
    tables = ("[separation]\nhorizontal_m = 10\n", pad("a", 0, 0), vehicles("a", model=STEP))
    for way, open_ in ((circles, True), (mission(up(20), place(100, 0, 20), land(100, 0)), False)):
        flies = sortie("of-a", "a", 0.0, job="a")
        found = simulated(*tables, flies, policy="stop", a=replace(way, autopilot=None)).findings
        assert ("S127" in {one.code for one in found}) is open_
