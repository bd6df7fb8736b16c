"""The altitude of a landing, which ArduCopter from 4.7 on takes for that of the ground there.

Flown with ArduCopter 4.7.0-dev of 31 December 2025 in simulation, LAND_SPEED 0.5 m/s, WPNAV_SPEED_DN 1.5 m/s,
LAND_ALT_LOW 10 m, home at 400 m.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
from made_terrain import ground, slope

from planner.autopilot import TARGETS
from planner.findings import Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.service.preflight import assess, check
from planner.service.preparation import prepare
from planner.setup import Setup
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission, MissionItem
    from planner.service.preflight import CheckResult

COPTER = load_vehicle("arducopter-sitl-quad")
STEP = load_vehicle("falkowski-2023-quadrotor")
NEWER, OLDER = "arducopter-4.7", "arducopter-4.6"
SLACK_S = 1.6
"""So much less than predicted the two landings took that no altitude changes: 71.5 s of 72.6 s, 61.6 s of
63.1 s."""


def judged(
    made: Mission,
    target: str | None = None,
    parameters: str = "",
    *,
    terrain: TerrainGrid | None = None,
) -> CheckResult:
    given = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    return check(
        made,
        COPTER,
        battery=Battery(capacity_wh=170.0),
        parameters=given,
        terrain=terrain,
        target=None if target is None else TARGETS[target],
    )


def landing(metres_north: float, altitude_m: float, *, frame: int = 3) -> MissionItem:
    return item(21, north(metres_north), altitude_m, frame=frame)


def landing_here(altitude_m: float) -> MissionItem:
    return item(21, 0.0, altitude_m, longitude_deg=0.0)


def landing_from(height_m: float, land: MissionItem) -> Mission:
    return mission(takeoff(height_m), waypoint(40, height_m), land)


@pytest.mark.parametrize(
    ("height_m", "land", "flown_s"),
    [
        (25, landing(70, 0.0), 71.5),
        (25, landing(70, 12.0), 88.2),
        (25, landing(70, 25.0), 91.1),
        (60, landing(70, 60.0), 174.7),
        (25, landing_here(12.0), 61.6),
        (25, landing(40, 0.0, frame=0), 47.3),
        (25, landing(40, -20.0), 47.4),
    ],
)
def test_a_landing_takes_as_long_as_flown(
    height_m: float, land: MissionItem, flown_s: float
) -> None:
    predicted_s = judged(landing_from(height_m, land), NEWER).totals.time_s
    assert predicted_s == pytest.approx(flown_s, abs=SLACK_S)


def test_a_landing_at_the_height_of_the_mission_is_slow_all_the_way() -> None:
    """From 100 m, flown in 308.4 s.

    90 m at 0.5 m/s instead of 1.5 m/s are 120 s more, less speeding up and slowing down by 1 m/s² and 1 s in
    between: (1.5 m/s)²/2 of the way at half that speed, and from 1.5 m/s down to 0.5 m/s.
    """
    high, level = (
        mission(takeoff(100), waypoint(222, 100), landing(0, altitude_m))
        for altitude_m in (100.0, 0.0)
    )
    times_s = {
        (name, target): judged(made, target).totals.time_s
        for name, made in (("high", high), ("level", level))
        for target in (NEWER, None, OLDER)
    }
    assert times_s["high", NEWER] == pytest.approx(308.4, abs=SLACK_S)
    assert times_s["high", NEWER] - times_s["level", NEWER] == pytest.approx(118.5, abs=1.5)
    assert times_s["high", None] == times_s["high", NEWER]  # the longer counts
    assert times_s["high", OLDER] == times_s["level", OLDER] == times_s["level", NEWER]


@pytest.mark.parametrize(
    ("altitude_m", "frame", "target", "told"),
    [
        # It slows down along v = h − 10 m, h above the altitude: to 1.1 times 0.5 m/s in 10.55 m.
        (-10.5, 3, NEWER, None),
        (-10.6, 3, NEWER, Severity.WARNING),
        (-10.95, 3, NEWER, Severity.WARNING),
        (-11.05, 3, NEWER, Severity.ERROR),  # 1 m/s
        (-11.05, 3, None, Severity.ERROR),
        (-11.05, 3, OLDER, None),
        (389.5, 0, NEWER, None),
        (388.9, 0, NEWER, Severity.ERROR),
        (0.0, 0, None, Severity.ERROR),
    ],
)
def test_a_landing_below_the_ground_is_not_slowed_down(
    altitude_m: float, frame: int, target: str | None, told: Severity | None
) -> None:
    result = judged(landing_from(25, landing(40, altitude_m, frame=frame)), target)
    found = [one.severity for one in result.findings if one.code == "T120"]
    assert found == ([] if told is None else [told])
    assert (result.verdict == "no-go") is (told is Severity.ERROR)


def test_a_rangefinder_or_no_place_leaves_the_altitude_out() -> None:
    below = landing_from(25, landing(40, -20.0))
    assert judged(below, NEWER, "RNGFND1_TYPE,8\n").verdict == "go"
    assert judged(landing_from(25, landing_here(-20.0)), NEWER).verdict == "go"


@pytest.mark.parametrize(
    ("altitude_m", "target", "codes"),
    [
        # 200 m down a slope of -5° the ground is 17.5 m above home, 1.5 m/s fast where home counts.
        (0.0, NEWER, {"T117"}),
        (17.5, NEWER, set()),
        (17.5, OLDER, {"T117"}),
        (17.5, None, {"T117"}),
    ],
)
def test_the_altitude_of_the_ground_slows_a_landing_on_a_hill(
    altitude_m: float, target: str, codes: set[str]
) -> None:
    made = mission(takeoff(60), waypoint(100, 60), landing(200, altitude_m))
    result = judged(made, target, terrain=slope(-5.0))
    assert {one.code for one in result.findings if one.code in {"T117", "T120"}} == codes


def test_the_altitude_of_ground_below_home_is_right_where_the_terrain_has_it() -> None:
    """17.5 m below home: slow from 10 m above that, not from 10 m above home, 17.5 m (2 − 1/1.5) s later."""
    made = mission(takeoff(60), waypoint(100, 60), landing(200, -17.5))
    newer, unknown = (judged(made, target, terrain=slope(5.0)) for target in (NEWER, None))
    assert not [one for one in newer.findings if one.code == "T120"]
    assert unknown.totals.time_s - newer.totals.time_s == pytest.approx(23.3, abs=0.2)


def test_a_landing_above_terrain_counts_from_the_ground_or_from_home() -> None:
    """Known ground at the level of home: an altitude of 12 m above it is one of 12 m above home."""
    above, level = (
        judged(landing_from(25, landing(70, 12.0, frame=frame)), NEWER, terrain=ground(0.0))
        for frame in (10, 3)
    )
    assert above.totals.time_s == pytest.approx(level.totals.time_s, abs=0.1)


def test_a_return_goes_by_home_alone() -> None:
    made = mission(takeoff(60), waypoint(100, 60), rtl())
    assert judged(made, NEWER).totals.time_s == judged(made, OLDER).totals.time_s


@pytest.mark.parametrize(
    ("target", "lands_s"),
    # 100 m at 0.5 m/s, as ArduCopter is delivered; else as the model has it.
    [(NEWER, 200.0), (None, 200.0), (OLDER, None), ("px4-1.16", None)],
)
def test_a_step_response_model_takes_as_long_as_its_autopilot(
    target: str | None, lands_s: float | None
) -> None:
    made = mission(takeoff(100), waypoint(222, 100), landing(0, 100.0))
    setup = Setup(vehicle=STEP, target=None if target is None else TARGETS[target])
    assessed = assess(prepare(made, setup))
    assert assessed is not None
    columns = assessed.flight.motion.segments
    model_s = float(columns.duration_s[columns.state == STATE_INDEX[FlightState.LAND]].sum())
    longer_s = float(assessed.lateness.climbs_s.sum())
    assert longer_s == (0.0 if lands_s is None else pytest.approx(lands_s - model_s, abs=1.0))


@pytest.mark.parametrize(
    ("altitude_m", "frame", "target", "told"),
    [
        (-20.0, 3, None, True),
        (0.0, 3, None, False),
        (0.0, 0, NEWER, True),
        (0.0, 10, NEWER, False),
        (-20.0, 3, OLDER, False),
    ],
)
def test_a_landing_that_only_a_failsafe_leads_to_is_judged_too(
    altitude_m: float, frame: int, target: str | None, *, told: bool
) -> None:
    start = item(189, frame=2, params=(0.0, 0.0, 0.0, 0.0))
    flown = (takeoff(25), waypoint(100, 25), rtl())
    made = mission(*flown, start, waypoint(50, 25), landing(40, altitude_m, frame=frame))
    found = [one.item for one in judged(made, target).findings if one.code == "T120"]
    assert found == [6] * told
