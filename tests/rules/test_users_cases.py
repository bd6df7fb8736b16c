"""Missions that users sent to their projects, each with what it must lead to here.

Numbers of threads: see the explanation of each rule.  Of the others, 1 and 2 (a long leg past a small
exclusion, the rim of a loiter), 5 (rally point outside) and 6 (inclusions apart) are in
test_fence_flight.py, 11 (absurd payload and capacity) in test_margins.py and 17 (PX4's own estimate of
a return) in test_failsafe_rules.py.
"""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.errors import OtherVehicleError
from planner.findings import Severity
from planner.geo.geodesy import LocalFrame
from planner.mission.files import read_mission
from planner.physics.wind import Wind
from planner.service.preflight import check
from planner.service.separation import check_together
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from planner.mission.items import Mission, MissionItem
    from planner.service.preflight import CheckResult, UnreadableMission

STEP = load_vehicle("falkowski-2023-quadrotor")
COPTER = replace(load_vehicle("arducopter-sitl-quad"), battery=None)
PX4 = load_vehicle("px4-sih-quad")
BATTERY = Battery(capacity_wh=250.0)


def checked(one: Mission, vehicle: str = "step", parameters: str = "") -> CheckResult:
    return check(
        one,
        {"step": STEP, "ardupilot": COPTER, "px4": PX4}[vehicle],
        battery=BATTERY,
        parameters=parameters_from_text(parameters.encode(), source="p.param")
        if parameters
        else None,
    )


def codes(result: CheckResult | UnreadableMission, severity: Severity) -> set[str]:
    return {finding.code for finding in result.findings if finding.severity is severity}


def test_case_3_text_with_three_altitude_references_is_warned_of(tmp_path: Path) -> None:
    rows = [(0, 16, 47.0, 8.0, 400.0), (3, 22, 47.0, 8.0, 20.0), (3, 16, 47.001, 8.0, 30.0)]
    rows += [(0, 16, 47.002, 8.0, 430.0), (10, 16, 47.003, 8.0, 30.0), (3, 20, 0.0, 0.0, 0.0)]
    lines = ["QGC WPL 110"]
    lines += [
        "\t".join(map(str, (n, 0, frame, command, 0, 0, 0, 0, lat, lon, alt, 1)))
        for n, (frame, command, lat, lon, alt) in enumerate(rows)
    ]
    path = tmp_path / "mixed.waypoints"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = [f for f in checked(read_mission(path)).findings if f.code == "A101"]
    assert [(f.severity, f.item) for f in found] == [(Severity.WARNING, 3)]
    assert "from the terrain (1, first at item 4)" in found[0].message


@pytest.mark.parametrize("vehicle", ["step", "ardupilot", "px4"])
@pytest.mark.parametrize(
    ("target", "repeats", "code", "message"),
    [
        (3, 1.0, "M103", "jumps to itself"),
        (9, 1.0, "M103", "no item 9"),
        (2, -1.0, "T101", "endless loop"),
    ],
)
def test_case_4_a_jump_to_itself_to_nowhere_or_for_ever_is_an_error(
    vehicle: str, target: int, repeats: float, code: str, message: str
) -> None:
    result = checked(mission(takeoff(20), waypoint(100, 20), jump(target, repeats), rtl()), vehicle)
    [finding] = [f for f in result.findings if f.code == code]
    assert finding.severity is Severity.ERROR
    assert finding.item == 3
    assert message in finding.message
    assert result.verdict == "no-go"


def test_case_7_old_and_new_names_of_a_speed_fly_the_same() -> None:
    one = mission(takeoff(20), waypoint(400, 20), rtl(), autopilot=Autopilot.ARDUPILOT)
    old, new = (checked(one, "ardupilot", text) for text in ("WPNAV_SPEED,500\n", "WP_SPD,5\n"))
    assert old.totals == new.totals
    default = checked(one, "ardupilot")
    assert old.totals.time_s > default.totals.time_s + 30.0  # 400 m at 5 for 10 m/s, there and back


def east(metres: float) -> float:
    """Return the longitude so many metres east of home, to 0.3 %."""
    return 8.0 + metres / (111_320.0 * math.cos(math.radians(47.0)))


def places(result: CheckResult, time_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return east, north and height at times, in the frame of home."""
    assert result.assessment is not None
    state = result.assessment.flight.motion.state_at_time(time_s)
    there = result.assessment.route.frame.latitude_longitude_deg(state.east_m, state.north_m)
    frame = LocalFrame(latitude_deg=HOME.latitude_deg, longitude_deg=HOME.longitude_deg)
    return np.stack((*frame.east_north_m(*there), state.height_m))


@pytest.mark.parametrize("vehicle", ["step", "ardupilot", "px4"])
def test_case_8_a_crossing_late_and_between_samples_is_an_error(vehicle: str) -> None:
    """EGO-Planner-v2 #60, Swarm-Formation #35: north side by side, then each to the other's side."""

    def crossing(start_m: float, end_m: float) -> Mission:
        start_deg, end_deg = east(start_m), east(end_m)
        return mission(
            item(22, HOME.latitude_deg, 20.0, longitude_deg=start_deg),
            item(16, north(900), 20.0, longitude_deg=start_deg),
            item(21, north(840), 0.0, longitude_deg=end_deg),
            home=replace(HOME, longitude_deg=start_deg),
        )

    results = [checked(crossing(0, 300), vehicle), checked(crossing(300, 0), vehicle)]
    end_s = results[0].totals.time_s
    fine_s, sampled_s = np.arange(0.0, end_s, 0.01), np.arange(0.0, end_s, 1.0)
    fine_m, sampled_m = (
        np.linalg.norm(places(results[0], at_s) - places(results[1], at_s), axis=0)
        for at_s in (fine_s, sampled_s)
    )
    separation_m = 0.9 * float(sampled_m.min())  # who looks once a second sees nothing
    assert fine_m.min() < 0.2 < separation_m
    assert 0.5 * end_s < fine_s[np.argmin(fine_m)]
    for one in check_together(results, separation_m=separation_m):
        [finding] = [f for f in one.findings if f.code == "S101"]
        assert (finding.severity, finding.item) == (Severity.ERROR, 3)
        assert one.verdict == "no-go"
    apart = check_together(results, separation_m=separation_m, starts_s=(0.0, 30.0))
    assert [codes(one, Severity.ERROR) & {"S101"} for one in apart] == [set(), set()]


def test_case_9_vehicles_on_the_ground_a_metre_apart_are_no_conflict() -> None:
    """skybrush-io/viewer #16: four in a square of 1 m, one after the other, 1.5 m to be kept."""
    grid = []
    for number in range(4):
        home = replace(
            HOME, latitude_deg=north(float(number // 2)), longitude_deg=east(float(number % 2))
        )
        level_m = 20.0 + 5.0 * number
        up = item(22, home.latitude_deg, level_m, longitude_deg=home.longitude_deg)
        away = item(16, north(100), level_m, longitude_deg=home.longitude_deg)
        grid.append(checked(mission(up, away, rtl(), home=home), "ardupilot"))
    starts_s = (0.0, 10.0, 20.0, 30.0)
    together = check_together(grid, separation_m=1.5, starts_s=starts_s)
    assert [f.message for one in together for f in one.findings if f.code[0] == "S"] == []
    counted = check_together(grid, separation_m=1.5, starts_s=starts_s, min_nav_alt_m=0.0)
    assert all("S101" in codes(one, Severity.ERROR) for one in counted)


@pytest.mark.parametrize("vehicle", ["step", "ardupilot", "px4"])
def test_case_10_a_home_on_another_continent_is_an_error_and_its_way_is_told(vehicle: str) -> None:
    """MissionPlanner #1947: a survey in the south, home left in the north of another project."""
    there = [item(16, -35.3629 + 0.001 * n, 20.0, longitude_deg=149.1651) for n in range(2)]
    result = checked(mission(takeoff(20), *there, rtl()), vehicle)
    [finding] = [f for f in result.findings if f.code == "M124"]
    assert (finding.severity, finding.item) == (Severity.ERROR, 3)  # the northern of both
    said = re.match(r"home is (\d+) km from the nearest place of the mission", finding.message)
    assert said is not None
    assert float(said[1]) == pytest.approx(great_circle_km(47.0, 8.0, -35.3629, 149.1651), rel=0.01)
    assert result.verdict == "no-go"


def great_circle_km(from_lat: float, from_lon: float, to_lat: float, to_lon: float) -> float:
    """Return the haversine distance on a sphere of 6,371 km."""
    north_rad = math.radians(to_lat - from_lat)
    east_rad = math.radians(to_lon - from_lon)
    cosines = math.cos(math.radians(from_lat)) * math.cos(math.radians(to_lat))
    half = math.sin(0.5 * north_rad) ** 2 + cosines * math.sin(0.5 * east_rad) ** 2
    return 2.0 * 6371.0 * math.asin(math.sqrt(half))


@pytest.mark.parametrize("from_deg", [0.0, 180.0])
def test_case_12_out_and_back_in_wind_costs_more_than_in_calm(from_deg: float) -> None:
    """Whichever way the wind blows: the leg against it costs more than the other one saves."""
    far = mission(takeoff(50), waypoint(5000, 50), waypoint(0, 50), item(21, north(0), 0.0))
    wind = Wind(speed_m_s=5.0, from_deg=from_deg)
    calm, windy = (check(far, COPTER, battery=BATTERY, wind=blows) for blows in (Wind(), wind))
    legs = [
        sum(s.energy_wh for s in windy.segments if s.item == number)
        - sum(s.energy_wh for s in calm.segments if s.item == number)
        for number in (2, 3)
    ]
    against, along = legs if from_deg == 0.0 else reversed(legs)
    assert against > 0.0 > along
    assert against > -along
    assert windy.totals.energy_wh > calm.totals.energy_wh
    # The article's model knows no power over airspeed: the wind is not counted, and that is said.
    article = check(far, STEP, battery=BATTERY, wind=wind)
    assert article.totals.energy_wh == check(far, STEP, battery=BATTERY).totals.energy_wh
    assert "E108" in codes(article, Severity.WARNING)


def _vtol(tmp_path: Path, **items: object) -> Path:
    path = tmp_path / "vtol.plan"
    path.write_text(
        json.dumps(
            {
                "fileType": "Plan",
                "version": 1,
                "groundStation": "QGroundControl",
                "geoFence": {"version": 2, "polygons": [], "circles": []},
                "rallyPoints": {"version": 2, "points": []},
                "mission": {
                    "version": 2,
                    "firmwareType": 12,
                    "plannedHomePosition": [47.0, 8.0, 400.0],
                    "cruiseSpeed": 15,
                    "hoverSpeed": 5,
                    **items,
                },
            }
        ),
        encoding="utf-8",
    )
    return path


def _simple(command: int, *params: float | None, number: int) -> dict[str, object]:
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": 3,
        "params": params,
        "autoContinue": True,
        "doJumpId": number,
    }


def test_case_13_a_vtol_mission_is_not_timed_as_a_multicopters(tmp_path: Path) -> None:
    items = [
        _simple(84, 0, 0, 0, None, 47.0, 8.0, 30, number=1),
        _simple(16, 0, 0, 0, None, 47.05, 8.0, 80, number=2),
        _simple(85, 0, 0, 0, None, 47.0, 8.0, 0, number=3),
    ]
    for vehicle_type in (20, 0):  # stated, and told by its items alone
        one = read_mission(_vtol(tmp_path, vehicleType=vehicle_type, items=items))
        with pytest.raises(OtherVehicleError, match="VTOL"):
            checked(one)


@pytest.mark.parametrize(
    ("vehicle", "loiter", "least_s"),
    [
        ("step", item(19, north(100), 20.0, params=(90.0, 0.0, 0.0, None)), 90.0),
        ("px4", item(19, north(100), 20.0, params=(90.0, 0.0, 0.0, None)), 90.0),
        ("ardupilot", item(19, north(100), 20.0, params=(90.0, 0.0, 0.0, 0.0)), 90.0),
        # 3 turns of 20 m are 377 m: at 10 m/s and more, and 18 s each at CIRCLE_RATE 20 °/s.
        ("ardupilot", item(18, north(100), 20.0, params=(3.0, 0.0, 20.0, 0.0)), 54.0),
        ("step", item(18, north(100), 20.0, params=(3.0, 0.0, 20.0, 0.0)), 37.0),
    ],
)
def test_case_14_loitering_adds_its_time(vehicle: str, loiter: MissionItem, least_s: float) -> None:
    plain = checked(mission(takeoff(20), waypoint(100, 20), rtl()), vehicle)
    waits = checked(mission(takeoff(20), loiter, rtl()), vehicle)
    assert waits.totals.time_s > plain.totals.time_s + least_s - 5.0  # the stop is there already


@pytest.mark.parametrize("vehicle", ["step", "ardupilot", "px4"])
@pytest.mark.parametrize(("height_m", "fires"), [(0.0, True), (0.1, False), (-1.0, True)])
def test_case_15_a_take_off_to_nothing_is_an_error(
    vehicle: str,
    height_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    one = mission(takeoff(height_m), waypoint(100, 20), rtl())
    assert ("A106" in codes(checked(one, vehicle), Severity.ERROR)) is fires


def test_case_16_a_landing_pattern_of_an_aircraft_loads_and_is_not_a_multicopters(
    tmp_path: Path,
) -> None:
    pattern = {
        "type": "ComplexItem",
        "complexItemType": "fwLandingPattern",
        "version": 2,
        "landCoordinate": [47.0, 8.0, 0.0],
        "landingApproachCoordinate": [47.01, 8.0, 40.0],
        "altitudesAreRelative": True,
        "loiterClockwise": True,
        "loiterRadius": 75,
        "useLoiterToAlt": True,
        "stopTakingPhotos": True,
        "stopVideoPhotos": True,
    }
    takeoff_item = _simple(22, 15, 0, 0, None, 47.0, 8.0, 30, number=1)
    one = read_mission(_vtol(tmp_path, vehicleType=1, items=[takeoff_item, pattern]))
    assert 21 in {i.command for i in one.items}
    with pytest.raises(OtherVehicleError, match="fixed-wing"):
        checked(one)


def test_case_16_a_corridor_loads_and_is_flown(tmp_path: Path) -> None:
    inner = [
        _simple(16, 0, 0, 0, None, 47.0 + 0.001 * n, 8.0, 40, number=1 + n) for n in range(1, 4)
    ]
    corridor = {
        "type": "ComplexItem",
        "complexItemType": "CorridorScan",
        "version": 2,
        "CorridorWidth": 50,
        "EntryPoint": 0,
        "polyline": [[47.001, 8.0], [47.003, 8.0]],
        "TransectStyleComplexItem": {
            "version": 1,
            "CameraCalc": {"version": 1, "DistanceToSurface": 40},
            "TurnAroundDistance": 0,
            "CameraTriggerInTurnAround": True,
            "HoverAndCapture": False,
            "Refly90Degrees": False,
            "FollowTerrain": False,
            "VisualTransectPoints": [],
            "Items": inner,
        },
    }
    takeoff_item = _simple(22, 0, 0, 0, None, 47.0, 8.0, 30, number=1)
    home = _simple(20, 0, 0, 0, 0, 0, 0, 0, number=5) | {"frame": 2}
    one = read_mission(_vtol(tmp_path, vehicleType=2, items=[takeoff_item, corridor, home]))
    result = checked(one, "px4")
    assert [arrival.command for arrival in result.items].count("NAV_WAYPOINT") == 3
    # 0.003° of latitude and back: 2 x 333.5 m.
    way_m = result.totals.distance_m - result.totals.wander_m
    assert way_m == pytest.approx(667.0, abs=5.0)


def test_what_is_good_in_all_of_this_is_told_nothing() -> None:
    """The rules of these cases keep quiet about a mission without any of it."""
    one = mission(takeoff(20), speed(5.0), waypoint(300, 30), waypoint(300, 60), rtl())
    for vehicle in ("step", "ardupilot", "px4"):
        result = checked(replace(one, autopilot=None), vehicle)
        told = codes(result, Severity.ERROR) | codes(result, Severity.WARNING)
        assert told <= {"E109", "E105"}  # the PX4 model's power; climbs longer than the step's
