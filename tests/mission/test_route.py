"""What a mission asks for, by the rules of formats.md part c."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint
from thinning import examples

from planner.autopilot import Autopilot
from planner.errors import MissionFileError, OtherVehicleError
from planner.findings import Severity
from planner.mission.items import Home, MissionFormat, MissionItem, VehicleEvidence, VehicleKind
from planner.mission.route.route import make_route
from planner.mission.route.stage import Route, StageKind
from planner.mission.route.state import VehicleHabits
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.geo.terrain import MaskedHeights

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT


def route(
    *items: MissionItem, dialect: Autopilot | None = None, home_amsl_m: float | None = None
) -> Route:
    return make_route(mission(*items), dialect=dialect, home_amsl_m=home_amsl_m)


def codes(found: Route) -> list[str]:
    return [finding.code for finding in found.findings if finding.code != "X902"]


def heights(found: Route) -> list[float]:
    return [stage.height_m for stage in found.stages]


def test_a_plain_mission_is_laid_out_in_metres_about_home() -> None:
    found = route(takeoff(50), waypoint(1000, 80, hold_s=5), rtl())
    assert [s.kind for s in found.stages] == [StageKind.TAKEOFF, StageKind.GO, StageKind.RETURN]
    assert found.stages[1].north_m == pytest.approx(1000.0, abs=1.0)
    assert found.stages[1].east_m == pytest.approx(0.0, abs=1e-6)
    assert found.stages[1].hold_s == 5.0
    assert heights(found) == [50.0, 80.0, 0.0]
    assert codes(found) == []


def test_amsl_altitudes_count_from_the_altitude_of_home() -> None:
    found = route(takeoff(50), item(16, north(100), 480.0, frame=0), rtl())
    assert found.stages[1].height_m == 80.0
    moved = route(takeoff(50), item(16, north(100), 480.0, frame=0), rtl(), home_amsl_m=430.0)
    assert moved.stages[1].height_m == 50.0


def test_amsl_altitudes_without_a_home_altitude_are_said() -> None:
    home = Home(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=None)
    found = make_route(mission(takeoff(50), item(16, north(9), 480.0, frame=5), rtl(), home=home))
    assert "A105" in codes(found)


def test_speeds_are_carried_along_and_each_autopilot_reads_them_its_own_way() -> None:
    items = (takeoff(9), speed(7.0), waypoint(9, 9), speed(3.0, kind=2.0), waypoint(1, 9), rtl())
    ardupilot = route(*items, dialect=ARDUPILOT).stages
    # A return is flown, and climbs, at the speeds set in the vehicle.
    assert [s.speed_m_s for s in ardupilot] == [None, 7.0, 7.0, None]
    assert [s.climb_speed_m_s for s in ardupilot] == [None, None, 3.0, None]
    # PX4 does not look at the type of a speed.
    assert [s.speed_m_s for s in route(*items, dialect=PX4).stages] == [None, 7.0, 3.0, None]


def test_a_speed_of_zero_or_less_resets_px4_and_means_nothing_to_ardupilot() -> None:
    items = (takeoff(9), speed(7.0), waypoint(9, 9), speed(-2.0), waypoint(1, 9), rtl())
    assert [s.speed_m_s for s in route(*items, dialect=PX4).stages] == [None, 7.0, None, None]
    assert [s.speed_m_s for s in route(*items, dialect=ARDUPILOT).stages] == [None, 7.0, 7.0, None]


def test_altitude_zero_keeps_the_height_on_ardupilot_and_is_zero_on_px4() -> None:
    items = (takeoff(20), waypoint(100, 0), rtl())
    assert heights(route(*items, dialect=ARDUPILOT))[1] == 20.0
    assert heights(route(*items, dialect=PX4))[1] == 0.0


def test_a_loiter_to_altitude_zero_goes_down_to_it() -> None:
    # ModeAuto::do_loiter_to_alt: the place by loc_from_cmd, the altitude by the item itself; in simulation
    # from 30 m to 0 m.
    items = (takeoff(30), waypoint(100, 30), item(31, north(200), 0.0), rtl())
    for dialect in (ARDUPILOT, PX4, None):
        found = route(*items, dialect=dialect)
        assert heights(found)[:3] == [30.0, 30.0, 0.0]
        assert codes(found) == []


def test_altitude_zero_in_the_air_is_told_where_it_does_not_mean_as_before() -> None:
    items = (takeoff(20), waypoint(100, 0), rtl())
    assert codes(route(*items, dialect=ARDUPILOT)) == []
    assert codes(route(*items, dialect=PX4)) == ["A111"]
    unknown = route(*items)
    assert codes(unknown) == ["A111"]
    assert heights(unknown)[1] == 20.0
    # Whoever flies it may lead it to the ground, and nothing below looks there.
    assert [one.severity for one in unknown.findings if one.code == "A111"] == [Severity.ERROR]
    assert codes(route(takeoff(20), waypoint(100, 0.001), rtl())) == []


def test_an_amsl_altitude_that_is_not_above_home_is_an_error() -> None:
    """Home lies at 400 m AMSL: 50 m in frame 0 is 350 m under it."""
    found = route(takeoff(50), item(16, north(100), 50.0, frame=0), rtl())
    [finding] = [f for f in found.findings if f.code == "A107"]
    assert finding.item == 2
    assert "350 m below home" in finding.message
    assert codes(route(takeoff(50), item(16, north(100), 400.1, frame=0), rtl())) == []
    assert codes(route(takeoff(50), item(16, north(100), 400.0, frame=5), rtl())) == ["A107"]


def test_zero_latitude_and_longitude_mean_here_and_not_so_to_px4() -> None:
    items = (takeoff(20), waypoint(100, 20), item(21, 0.0, 0.0, longitude_deg=0.0))
    ardupilot = route(*items, dialect=ARDUPILOT)
    assert ardupilot.stages[-1].north_m == pytest.approx(100.0, abs=0.1)
    assert codes(ardupilot) == []
    px4 = route(*items, dialect=PX4)
    assert px4.stages[-1].north_m == pytest.approx(100.0, abs=0.1)
    assert codes(px4) == ["M110"]


@pytest.mark.parametrize(
    ("command", "else_told"),
    [
        *((command, [Severity.ERROR]) for command in (16, 17, 19, 21)),
        (179, []),  # T102: with a height it is no "here"
        (22, [Severity.INFO]),  # texts of Mission Planner have every take-off there
    ],
)
def test_a_place_at_zero_zero_is_an_error_where_px4_flies_there(
    command: int, else_told: list[Severity]
) -> None:
    """PX4 flies to the Gulf of Guinea, 5000 km away, and no energy of that is in the totals."""
    odd = item(command, 0.0, 20.0, longitude_deg=0.0)
    items = (odd, rtl()) if command == 22 else (takeoff(20), waypoint(50, 20), odd, rtl())
    severities = {
        dialect: [f.severity for f in route(*items, dialect=dialect).findings if f.code == "M110"]
        for dialect in (PX4, ARDUPILOT, None)
    }
    assert severities[PX4] == [Severity.ERROR]
    assert severities[ARDUPILOT] == []
    assert severities[None] == else_told


@pytest.mark.parametrize("command", [16, 21])
def test_what_only_ardupilot_may_fly_is_read_as_it_does(command: int) -> None:
    # PX4 refuses the upload of a return in frame 3: 0°, 0° is "here", and altitude 0 is "as before".
    odd = item(command, 0.0, 20.0, longitude_deg=0.0)
    home = replace(item(20, frame=3), param4=0.0)
    found = route(takeoff(20), waypoint(50, 20), odd, waypoint(100, 0.0), home).findings
    assert not {"M110", "A111"} & {f.code for f in found}


def test_ardupilot_takes_off_where_it_stands_px4_flies_to_the_takeoffs_place() -> None:
    items = (item(22, north(30), 20.0), waypoint(100, 20), rtl())
    assert route(*items, dialect=ARDUPILOT).stages[0].north_m == pytest.approx(0.0, abs=1e-9)
    assert route(*items, dialect=PX4).stages[0].north_m == pytest.approx(30.0, abs=0.05)


def test_ardupilot_holds_whole_seconds() -> None:
    items = (takeoff(20), waypoint(100, 20, hold_s=2.7), rtl())
    assert route(*items, dialect=ARDUPILOT).stages[1].hold_s == 2.0
    assert route(*items, dialect=PX4).stages[1].hold_s == 2.7


def test_ardupilot_says_what_it_keeps_of_a_hold() -> None:
    half = waypoint(100, 20, hold_s=2.5)
    assert codes(route(takeoff(20), half, rtl(), dialect=ARDUPILOT)) == ["M113"]
    assert codes(route(takeoff(20), half, rtl(), dialect=PX4)) == []
    with pytest.raises(MissionFileError, match="ArduPilot cannot keep a hold of 65536 s"):
        route(takeoff(20), waypoint(100, 20, hold_s=65_536), rtl(), dialect=ARDUPILOT)


def test_a_heading_of_zero_turns_px4_north() -> None:
    def heading(yaw_deg: float | None) -> MissionItem:
        return item(16, north(9), 20.0, params=(0.0, 0.0, 0.0, yaw_deg))

    items = (takeoff(20), heading(0.0), heading(None), rtl())
    px4 = route(*items, dialect=PX4)
    assert [stage.yaw_deg for stage in px4.stages] == [None, 0.0, None, None]
    assert codes(px4) == ["M114"]
    assert codes(route(*items, dialect=ARDUPILOT)) == []


@pytest.mark.parametrize("exit_way", [None, 0.0, 1.0])
def test_a_loiter_to_a_height_turns_px4_north_whatever_its_fourth_parameter(
    exit_way: float | None,
) -> None:
    # Flown: 3.2 s from east to north, before the next place was flown to.
    loiter = item(31, north(90), 20.0, params=(0.0, 0.0, 0.0, exit_way))
    assert route(takeoff(20), loiter, rtl(), dialect=PX4).stages[1].yaw_deg == 0.0


def test_px4_refuses_a_takeoff_that_is_not_the_first_place() -> None:
    items = (waypoint(100, 40), takeoff(40), rtl())
    assumed, px4 = (f for f in route(*items, dialect=PX4).findings if f.code == "M101")
    assert (assumed.severity, px4.severity) == (Severity.WARNING, Severity.ERROR)
    assert "PX4 refuses" in px4.message
    [ardupilot] = [f for f in route(*items, dialect=ARDUPILOT).findings if f.code == "M101"]
    assert ardupilot.severity is Severity.ERROR


def test_a_text_mission_names_no_vehicle_and_it_is_said_what_is_inferred() -> None:
    text = replace(mission(takeoff(20), rtl()), file_format=MissionFormat.WPL)
    assert codes(make_route(text)) == ["M115"]
    fixed_wing = replace(text, vehicle=evidence(VehicleKind.FIXED_WING, is_certain=False))
    assert codes(make_route(fixed_wing)) == ["M111"]


def test_a_mission_without_takeoff_gets_one_and_says_so() -> None:
    found = route(waypoint(100, 40), rtl())
    assert [s.kind for s in found.stages] == [StageKind.TAKEOFF, StageKind.GO, StageKind.RETURN]
    assert found.stages[0].height_m == 40.0
    assert found.stages[0].north_m == pytest.approx(0.0, abs=1e-9)
    assert codes(found) == ["M101"]


def test_a_mission_without_a_landing_ends_in_the_air() -> None:
    assert route(takeoff(20), waypoint(100, 20)).ends_in_air
    assert not route(takeoff(20), waypoint(100, 20), rtl()).ends_in_air
    endless = route(takeoff(20), waypoint(100, 20), jump(2, -1.0))
    assert not endless.ends_in_air


def test_items_behind_the_landing_are_not_flown_and_said() -> None:
    found = route(takeoff(20), rtl(), waypoint(100, 20), waypoint(200, 20))
    assert len(found.stages) == 2
    [finding] = [f for f in found.findings if f.code == "T104"]
    assert finding.item == 3
    assert "2 items from 3 on" in finding.message


LANDING = item(21, north(90), 0.0)
WAIT = item(93, frame=2, params=(5.0, -1.0, -1.0, -1.0))


@pytest.mark.parametrize(
    ("dialect", "after", "severity"),
    [
        # It flies there from the ground, low over what is between: tried, 5 m away at 0.8 m.
        (Autopilot.PX4, waypoint(400, 20), Severity.ERROR),
        (Autopilot.PX4, waypoint(92.1, 20), Severity.ERROR),
        (Autopilot.PX4, takeoff(20), Severity.ERROR),
        (Autopilot.PX4, item(31, north(90), 20.0), Severity.ERROR),
        (Autopilot.PX4, item(211, frame=2, params=(1.0, 0.0, 0.0, 0.0)), Severity.INFO),
        (Autopilot.ARDUPILOT, waypoint(400, 20), Severity.ERROR),
        (Autopilot.ARDUPILOT, takeoff(20), Severity.ERROR),
    ],
)
def test_what_is_not_predicted_after_a_landing_is_not_left_out_in_silence(
    dialect: Autopilot, after: MissionItem, severity: Severity
) -> None:
    found = route(takeoff(20), LANDING, after, dialect=dialect)
    [finding] = [f for f in found.findings if f.code == "T104"]
    assert finding.severity is severity
    # A mission with a second take-off it refuses (M101).
    is_flown = severity is Severity.ERROR and after != takeoff(20)
    assert ("at a slant" in finding.message) is (dialect is Autopilot.PX4 and is_flown)


@pytest.mark.parametrize(
    ("before", "what"),
    [
        (LANDING, "fly what follows item 2 as a mission of its own"),
        (rtl(), "fly what follows item 2 as a mission of its own"),
        (waypoint(90, 20), "remove the take-off: PX4 climbs to the next item without it"),
    ],
)
@pytest.mark.parametrize("dialect", [Autopilot.PX4, None])
def test_two_findings_of_a_second_take_off_advise_the_same(
    dialect: Autopilot | None, before: MissionItem, what: str
) -> None:
    found = route(takeoff(20), before, takeoff(20), waypoint(400, 20), rtl(), dialect=dialect)
    told = {f.code: f for f in found.findings if f.code in {"M101", "T104"}}
    assert (told["M101"].item, told["M101"].fix) == (3, what)
    landed = told.get("T104")
    assert landed is None or "PX4 flies on" not in landed.message


@pytest.mark.parametrize(
    "first",
    [waypoint(90, 20), waypoint(91.9, 20), item(22, north(90), 20.0), item(19, north(90), 20.0)],
)
@pytest.mark.parametrize("before", [(), (WAIT,), (jump(5, 1), WAIT)])
def test_px4_takes_off_again_from_where_it_has_landed(
    first: MissionItem, before: tuple[MissionItem, ...]
) -> None:
    made = route(
        takeoff(20), LANDING, *before, first, waypoint(0, 20), rtl(), dialect=Autopilot.PX4
    )
    assert not [f for f in made.findings if f.code == "T104"]
    assert [stage.kind for stage in made.stages[1:4]] == ["land", "takeoff", "go"]
    assert made.stages[1].hold_s == (5.0 if len(before) == 1 else 0.0)
    assert made.stages[2].north_m == pytest.approx(91.0, abs=1.01)
    assert made.stages[-1].kind == "return"


@pytest.mark.parametrize(
    ("after", "stages"),
    [
        ((jump(1, 5),), 18),  # six laps
        ((takeoff(20), waypoint(50, 20), rtl()), 6),
        ((WAIT, takeoff(20), rtl()), 5),
        ((waypoint(50, 20),), 3),
        ((item(21, 0.0, 0.0),), 3),
    ],
)
def test_ardupilot_takes_off_again_after_a_return(
    after: tuple[MissionItem, ...], stages: int
) -> None:
    # Tried in its simulation: "Mission: 4 Jump 1/1 / Mission: 1 Takeoff", with MIS_OPTIONS 0.
    made = route(takeoff(20), waypoint(90, 20), rtl(), *after, dialect=Autopilot.ARDUPILOT)
    assert len(made.stages) == stages
    left_out = [f.severity for f in made.findings if f.code == "T104"]
    assert left_out == ([Severity.INFO] if stages == 3 else [])


@pytest.mark.parametrize(
    ("goes_on", "behind", "severity"),
    [
        # It disarms 90 m away, though file and MIS_OPTIONS 4 say that it comes home.
        (True, (item(16, north(0), 20.0), rtl()), Severity.ERROR),
        (False, (item(16, north(0), 20.0), rtl()), Severity.ERROR),
        (True, (rtl(),), Severity.ERROR),
        (False, (item(177, frame=2, params=(1.0, 1.0, 0.0, 0.0)), rtl()), Severity.ERROR),
        (True, (item(206, frame=2),), Severity.INFO),  # no place to go to
    ],
)
def test_a_landing_that_goes_on_to_no_take_off_leaves_the_vehicle_there(
    goes_on: bool,  # noqa: FBT001 - a table of cases
    behind: tuple[MissionItem, ...],
    severity: Severity,
) -> None:
    made = make_route(
        mission(takeoff(20), item(21, north(90), 0.0), *behind),
        dialect=Autopilot.ARDUPILOT,
        habits=VehicleHabits(continues_after=frozenset({StageKind.LAND} if goes_on else ())),
    )
    assert [f.severity for f in made.findings if f.code == "T104"] == [severity]


# A landed vehicle of PX4's does not begin a return (PX4 #20044).  49 m from home somebody waits beside it.
@pytest.mark.parametrize(
    ("away_m", "dialect", "severity"),
    [
        (90, Autopilot.PX4, Severity.ERROR),
        (49, Autopilot.PX4, Severity.INFO),
        (90, None, Severity.ERROR),
    ],
)
def test_a_return_behind_a_landing_elsewhere_is_flown_by_neither_autopilot(
    away_m: float, dialect: Autopilot | None, severity: Severity
) -> None:
    made = make_route(mission(takeoff(20), item(21, north(away_m), 0.0), rtl()), dialect=dialect)
    assert [f.severity for f in made.findings if f.code == "T104"] == [severity]


def test_items_behind_the_landing_that_a_jump_has_led_past_are_flown() -> None:
    items = (takeoff(20), jump(5, 1), item(21, 0.0, 0.0), item(16, north(9), 20.0), waypoint(9, 9))
    found = route(*items, jump(3, 1))
    assert [s.item for s in found.stages] == [1, 5, 3]


def test_a_zero_takeoff_is_an_error() -> None:
    assert "A106" in codes(route(takeoff(0), waypoint(9, 20), rtl()))


@pytest.mark.parametrize("command", [16, 19, 82])
@pytest.mark.parametrize(
    ("dialect", "hold_s", "severity"),
    [
        # Flown with -3 s: hovers, as 65533 s does.  -0.9 is a whole number without a sign: 0.
        *((ARDUPILOT, s, Severity.ERROR) for s in (-3.0, -1.0)),
        (ARDUPILOT, -0.9, Severity.WARNING),
        (None, -1.0, Severity.ERROR),
        (PX4, -3.0, Severity.WARNING),
    ],
)
def test_a_hold_below_zero_lasts_hours_on_some_boards_of_ardupilot(
    command: int, dialect: Autopilot | None, hold_s: float, severity: Severity
) -> None:
    held = item(command, north(40), 20.0, params=(hold_s, 0.0, 0.0, None))
    found = route(takeoff(20), held, rtl(), dialect=dialect)
    assert found.stages[1].hold_s == 0.0
    told = [one.severity for one in found.findings if "is predicted as 0 s" in one.message]
    assert told == [severity]


@pytest.mark.parametrize("kind", [4.0, -1.0])
@pytest.mark.parametrize("dialect", [ARDUPILOT, None])
def test_a_speed_of_no_type_may_be_flown_as_the_level_one(
    kind: float, dialect: Autopilot | None
) -> None:
    found = route(takeoff(20), speed(3.0, kind=kind), waypoint(100, 20), rtl(), dialect=dialect)
    assert found.stages[1].speed_m_s is None
    told = [one.severity for one in found.findings if "no speed type" in one.message]
    assert told == [Severity.ERROR]


def test_an_empty_mission_holds_no_flight() -> None:
    assert codes(route()) == ["M108"]
    assert codes(route(item(206, frame=2))) == ["M108"]


def test_cameras_and_places_to_look_at_cost_nothing_and_are_not_mentioned() -> None:
    found = route(
        takeoff(20), item(206, frame=2), item(195, north(50), 0.0), waypoint(9, 20), rtl()
    )
    assert [s.item for s in found.stages] == [1, 4, 5]
    assert codes(found) == []


def test_an_item_that_is_not_modelled_is_said_once_with_its_count() -> None:
    winch = item(42600, frame=2)
    found = route(takeoff(20), winch, winch, waypoint(9, 20), rtl())
    [finding] = [f for f in found.findings if f.code == "T102"]
    assert finding.item == 2
    assert "DO_WINCH" in finding.message
    assert "and 1 more" in finding.message


def test_the_distances_conditions_wait_for_cost_no_time() -> None:
    found = route(takeoff(20), item(112, params=(30.0, 0.0, 0.0, 0.0)), waypoint(9, 20), rtl())
    assert [s.hold_s for s in found.stages] == [0.0, 0.0, 0.0]


def test_a_delay_in_the_air_is_flown_and_on_the_ground_only_said() -> None:
    delay = item(93, params=(60.0, -1.0, -1.0, -1.0), frame=2)
    air = route(takeoff(20), delay, rtl())
    assert air.stages[1].kind is StageKind.DELAY
    assert air.stages[1].hold_s == 60.0
    ground = route(delay, takeoff(20), rtl())
    assert [s.kind for s in ground.stages] == [StageKind.TAKEOFF, StageKind.RETURN]
    assert codes(ground) == ["T107"]
    # it is in seconds already
    assert "in seconds" not in ground.findings[0].fix


def test_a_delay_until_a_time_of_day_cannot_be_counted() -> None:
    found = route(takeoff(20), item(93, params=(-1.0, 14.0, 30.0, -1.0), frame=2), rtl())
    [finding] = [f for f in found.findings if f.code == "T107"]
    assert "14:30:--" in finding.message
    # PX4 looks at the seconds only, and takes none for none.
    px4 = route(takeoff(20), item(93, params=(-1.0, 14.0, 30.0, -1.0), frame=2), rtl(), dialect=PX4)
    [finding] = [f for f in px4.findings if f.code == "T107"]
    assert finding.message == "PX4 has no time of day: it does not wait until 14:30:-- UTC"
    nothing = item(93, params=(0.0, -1.0, -1.0, -1.0), frame=2)
    assert codes(route(takeoff(20), nothing, rtl(), dialect=PX4)) == []


def test_an_unlimited_loiter_ends_the_prediction_as_an_error() -> None:
    found = route(takeoff(20), item(17, north(50), 20.0), waypoint(9, 20), rtl())
    assert [s.kind for s in found.stages] == [StageKind.TAKEOFF, StageKind.LOITER]
    assert "T101" in codes(found)


def test_circles_carry_turns_and_radius() -> None:
    circle = item(18, north(200), 30.0, params=(3.0, 0.0, -25.0, 0.0))
    stage = route(takeoff(20), circle, rtl()).stages[1]
    assert stage.kind is StageKind.CIRCLE
    assert (stage.turns, stage.radius_m) == (3.0, -25.0)


@pytest.mark.parametrize(
    ("turns", "radius_m", "kept_turns", "kept_radius_m"),
    [
        (3.0, -25.0, 3.0, -25.0),
        (0.5, 30.0, 0.5, 30.0),
        (2.5, 30.0, 2.0, 30.0),
        (300.0, 30.0, 255.0, 30.0),
        (1.0, -47.9, 1.0, -47.0),
        (1.0, 1234.0, 1.0, 1230.0),
        (1.0, 9000.0, 1.0, 2550.0),
    ],
)
def test_ardupilot_keeps_turns_and_radius_in_8_bits_each(
    turns: float, radius_m: float, kept_turns: float, kept_radius_m: float
) -> None:
    circle = item(18, north(200), 30.0, params=(turns, 0.0, radius_m, 0.0))
    found = route(takeoff(20), circle, rtl(), dialect=ARDUPILOT)
    assert (found.stages[1].turns, found.stages[1].radius_m) == (kept_turns, kept_radius_m)
    changed = (turns, radius_m) != (kept_turns, kept_radius_m)
    assert [code for code in codes(found) if code != "T102"] == (["M113"] if changed else [])


def test_a_circle_without_a_radius_has_that_of_the_one_before() -> None:
    # ArduCopter's `ModeAuto::circle_movetoedge_start` sets none of 0; AC_Circle keeps the one it has.
    def circle(north_m: float, radius_m: float) -> MissionItem:
        return item(18, north(north_m), 30.0, params=(1.0, 0.0, radius_m, 0.0))

    items = (takeoff(20), circle(100, 0.0), circle(200, -25.0), circle(300, 0.0), circle(400, 9.0))
    before = VehicleHabits(circles_by_rate=False)
    flown = make_route(mission(*items, circle(500, 0.0), rtl()), dialect=ARDUPILOT, habits=before)
    radii_m = [one.radius_m for one in flown.stages if one.kind is StageKind.CIRCLE]
    assert radii_m == [10.0, -25.0, 25.0, 9.0, 9.0]
    told = [(one.item, one.message) for one in flown.findings if one.code == "T102"]
    assert [number for number, _ in told] == [2]  # that of all three
    assert "predicted is a circle of CIRCLE_RADIUS" in told[0][1]
    flown = make_route(mission(takeoff(20), *items[2:], rtl()), dialect=ARDUPILOT, habits=before)
    told = [(one.item, one.message) for one in flown.findings if one.code == "T102"]
    assert [number for number, _ in told] == [3]
    assert "ArduPilot flies the 25 m of the circle before" in told[0][1]
    again = route(
        takeoff(20), circle(100, 0.0), circle(200, 30.0), jump(2, 1), rtl(), dialect=ARDUPILOT
    )
    radii_m = [one.radius_m for one in again.stages if one.kind is StageKind.CIRCLE]
    assert radii_m == [10.0, 30.0, 30.0, 30.0]


@pytest.mark.parametrize(
    ("by_rate", "clockwise", "radii_m", "told"),
    [
        # `AC_Circle::get_rate_degs` of 4.7 is CIRCLE_RATE; flown with 4.7.0-dev: clockwise, then on the spot.
        (True, True, [20.0, 0.0, 30.0], [(2, Severity.WARNING)]),
        (True, False, [-20.0, 0.0, -30.0], [(4, Severity.WARNING)]),
        (False, True, [-20.0, 20.0, 30.0], [(3, Severity.WARNING)]),
        (None, True, [-20.0, 20.0, 30.0], [(2, Severity.ERROR), (3, Severity.WARNING)]),
    ],
)
def test_only_arducopter_4_7_circles_by_its_parameter(
    *, by_rate: bool | None, clockwise: bool, radii_m: list[float], told: list[tuple[int, Severity]]
) -> None:
    habits = VehicleHabits(circles_by_rate=by_rate, circles_clockwise=clockwise)

    def circle(north_m: float, radius_m: float, turns: float = 1.0) -> MissionItem:
        return item(18, north(north_m), 30.0, params=(turns, 0.0, radius_m, 0.0))

    items = (takeoff(20), circle(100, -20.0, 0.5), circle(200, 0.0), circle(300, 30.0), rtl())
    flown = make_route(mission(*items), dialect=ARDUPILOT, habits=habits)
    assert [one.radius_m for one in flown.stages if one.kind is StageKind.CIRCLE] == radii_m
    assert [(one.item, one.severity) for one in flown.findings if one.code == "T102"] == told


@pytest.mark.parametrize(("turns", "severity"), [(1.0, Severity.WARNING), (0.5, Severity.ERROR)])
def test_a_part_of_a_turn_to_an_unknown_side_is_no_go(turns: float, severity: Severity) -> None:
    # Whole turns lead round all of it either way, and end where they began.
    circle = item(18, north(200), 30.0, params=(turns, 0.0, -25.0, 0.0))
    found = route(takeoff(20), circle, rtl(), dialect=ARDUPILOT).findings
    assert [one.severity for one in found if one.code == "T102"] == [severity]


LAND_HERE, LAND_THERE = item(21, 0.0, 0.0, longitude_deg=0.0), item(21, north(100), 0.0)


@pytest.mark.parametrize(
    ("turns", "radius_m", "east_m", "north_m"),
    [
        # Begun from the south, at its nearest point.
        (1.0, 40.0, 0.0, 120.0),
        (0.25, 40.0, -40.0, 160.0),  # clockwise, seen from above: to the west
        (0.25, -40.0, 40.0, 160.0),
        (0.5, 40.0, 0.0, 200.0),
        (0.0, 40.0, 0.0, 120.0),
    ],
)
def test_behind_a_circle_the_vehicle_is_on_it(
    turns: float, radius_m: float, east_m: float, north_m: float
) -> None:
    # Flown in ArduPilot's SITL: it lands at 0°, 0° 7 m beside that place, not at the centre.
    circle = item(18, north(160), 20.0, params=(turns, 0.0, radius_m, 0.0))
    here = item(16, 0.0, 20.0, longitude_deg=0.0)
    for last in (LAND_HERE, here):
        stages = route(takeoff(20), waypoint(100, 20), circle, last, dialect=ARDUPILOT).stages
        assert (stages[2].east_m, stages[2].north_m) == pytest.approx((0.0, 160.0), abs=0.1)
        assert (stages[3].east_m, stages[3].north_m) == pytest.approx((east_m, north_m), abs=0.5)


@pytest.mark.parametrize(
    ("queue", "last", "expected"),
    [
        # ArduPilot carries out the first item of its queue before a return or a landing takes its speeds from
        # the parameters, the others afterwards (`ModeRTL::init`, `ModeAuto::land_start`).
        ((speed(0.8, kind=3.0),), rtl(), None),
        ((speed(5.0), speed(0.8, kind=3.0)), rtl(), 0.8),
        ((speed(0.8, kind=3.0), speed(5.0)), rtl(), None),
        ((speed(5.0), speed(0.8, kind=3.0)), LAND_HERE, 0.8),
        ((speed(0.8, kind=3.0),), LAND_HERE, None),
        ((speed(5.0), speed(0.8, kind=3.0)), LAND_THERE, None),  # it lands when it has got there
    ],
)
def test_a_descent_speed_behind_another_item_is_that_of_a_landing_that_has_begun(
    queue: tuple[MissionItem, ...], last: MissionItem, expected: float | None
) -> None:
    stages = route(takeoff(20), waypoint(50, 20), *queue, last, dialect=ARDUPILOT).stages
    assert stages[-1].lands_at_m_s == expected
    assert (
        route(takeoff(20), waypoint(50, 20), *queue, last, dialect=PX4).stages[-1].lands_at_m_s
        is None
    )


@pytest.mark.parametrize(
    ("queue", "returns_at_m_s", "told"),
    [
        ((item(203, frame=2), speed(1.0)), 1.0, [Severity.WARNING]),
        ((speed(1.0), item(203, frame=2)), None, []),  # the first, before it returns
        ((item(203, frame=2), item(179, north(9), 0.0, frame=3)), None, [Severity.ERROR]),
        ((item(179, north(9), 0.0, frame=3), item(203, frame=2)), None, []),
        # Less than half a metre off it is the home that there is.
        ((item(203, frame=2), item(179, north(0.4), 0.4, frame=3)), None, []),
        ((item(203, frame=2), item(179, north(0.6), 0.0, frame=3)), None, [Severity.ERROR]),
        ((item(203, frame=2), item(179, north(0), 0.6, frame=3)), None, [Severity.ERROR]),
    ],
)
def test_where_it_is_not_known_who_flies_a_return_is_flown_as_ardupilots_queue_has_it_and_told(
    queue: tuple[MissionItem, ...], returns_at_m_s: float | None, told: list[Severity]
) -> None:
    items = (takeoff(20), waypoint(50, 20), *queue, rtl())
    found = route(*items)
    assert found.stages[-1].speed_m_s == returns_at_m_s
    assert [one.severity for one in found.findings if "before a return" in one.message] == told
    for known in (ARDUPILOT, PX4):
        messages = [one.message for one in route(*items, dialect=known).findings]
        assert not [one for one in messages if "before a return" in one]


@pytest.mark.parametrize(("turns", "kept"), [(1.5, 1.0), (1.0, 1.0), (0.5, 0.5)])
def test_where_it_is_not_known_who_flies_turns_are_kept_as_ardupilot_does(
    turns: float, kept: float
) -> None:
    turning = item(18, north(100), 20.0, params=(turns, 0.0, 40.0, 0.0), frame=3)
    found = route(takeoff(20), waypoint(50, 20), turning, rtl())
    assert found.stages[2].turns == kept
    assert ("M113" in codes(found)) is (kept != turns)


@pytest.mark.parametrize(
    ("first", "height_m", "dialect", "is_here"),
    [
        # ArduCopter takes the present place for a first parameter of 1, or where all three numbers are 0
        # (`ModeAuto::do_set_home`, `Location::initialised`).
        (0.0, 50.0, ARDUPILOT, False),
        (0.0, 50.0, None, False),
        (1.0, 50.0, ARDUPILOT, True),
        (0.0, 0.0, ARDUPILOT, True),
    ],
)
def test_a_home_with_a_height_but_no_place_is_not_here(
    first: float, height_m: float, dialect: Autopilot | None, *, is_here: bool
) -> None:
    home = item(179, 0.0, height_m, longitude_deg=0.0, params=(first, 0.0, 0.0, 0.0))
    flown = route(takeoff(20), waypoint(500, 20), home, waypoint(800, 20), rtl(), dialect=dialect)
    told = [one.severity for one in flown.findings if "DO_SET_HOME at 0°, 0°" in one.message]
    assert told == ([] if is_here else [Severity.ERROR])
    assert flown.stages[-1].north_m == pytest.approx(500.0 if is_here else 0.0, abs=1.0)


@pytest.mark.parametrize(
    ("first", "frame", "dialect", "acts"),
    [
        # ``MavlinkMissionManager::parse_mavlink_mission_item`` takes x and y of frame 2 as they are, which
        # hold whole numbers.  Flown, 47.4° sent as 47°: home 50 km off.
        (0.0, 2, PX4, True),
        (1.0, 2, PX4, False),
        (0.0, 3, PX4, False),  # refused (M105)
        (0.0, 2, ARDUPILOT, False),  # Mission Planner and MAVProxy send it times 1e7 all the same
    ],
)
def test_a_home_in_frame_2_is_sent_in_whole_degrees(
    first: float, frame: int, dialect: Autopilot, *, acts: bool
) -> None:
    home = item(179, north(100), 0.0, params=(first, 0.0, 0.0, 0.0), frame=frame)
    flown = route(takeoff(20), waypoint(50, 20), home, waypoint(80, 20), rtl(), dialect=dialect)
    told = [one.severity for one in flown.findings if "in whole degrees" in one.message]
    assert told == [Severity.ERROR] * acts


def test_a_home_moved_into_the_air_does_not_lift_the_ground() -> None:
    """The landing would be some 50 m too short, on the side that runs a battery dry."""
    here = item(179, params=(1.0, 0.0, 0.0, 0.0), frame=2)
    found = route(takeoff(50), waypoint(100, 50, hold_s=1), here, waypoint(200, 10), rtl())
    assert heights(found) == [50.0, 50.0, 60.0, 0.0]
    assert found.stages[3].north_m == pytest.approx(100.0, abs=0.1)
    [finding] = [f for f in found.findings if f.code == "T102"]
    assert "DO_SET_HOME" in finding.message
    assert codes(route(here, takeoff(50), rtl())) == []


def test_a_home_moved_in_a_relative_frame_lies_above_the_one_before() -> None:
    moved = item(179, north(500), 40.0, params=(0.0, 0.0, 0.0, 0.0), frame=3)
    found = route(takeoff(50), moved, waypoint(600, 50), rtl())
    assert found.stages[1].height_m == pytest.approx(90.0)
    assert found.stages[2].height_m == pytest.approx(40.0)
    again = route(takeoff(50), moved, moved, waypoint(600, 50), rtl(), dialect=PX4)
    assert again.stages[1].height_m == pytest.approx(130.0)


def test_a_second_home_moved_in_a_relative_frame_lies_above_the_first_one_moved() -> None:
    first = item(179, north(500), 40.0, frame=3)
    second = item(179, north(700), 25.0, frame=3)
    found = route(takeoff(50), first, waypoint(600, 50), second, waypoint(800, 50), rtl())
    assert found.stages[2].height_m == pytest.approx(50.0 + 40.0 + 25.0)
    assert found.stages[3].height_m == pytest.approx(65.0)


@pytest.mark.parametrize(
    ("begun_m", "onward", "is_told"),
    [
        # AC_Circle::get_closest_point_on_circle: straight behind; flown in SITL, east where it came from.
        (100.0, (item(21, 0.0, 0.0, longitude_deg=0.0),), True),
        (101.0, (item(21, 0.0, 0.0, longitude_deg=0.0),), False),
        (100.0, (item(179, params=(1.0, 0.0, 0.0, 0.0), frame=2), rtl()), True),
        (100.0, (item(21, north(140), 0.0),), False),
        (100.0, (waypoint(200, 20), item(21, 0.0, 0.0, longitude_deg=0.0)), False),
        (100.0, (rtl(),), False),
    ],
)
def test_here_behind_a_circle_begun_at_its_centre_is_no_go(
    begun_m: float,
    onward: tuple[MissionItem, ...],
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    circle = item(18, north(100), 20.0, params=(1.0, 0.0, 40.0, 0.0))
    items = (takeoff(20), waypoint(begun_m, 20), circle, *onward)
    for dialect in (ARDUPILOT, None):
        found = [f for f in route(*items, dialect=dialect).findings if "centre" in f.message]
        assert [f.severity for f in found] == [Severity.ERROR] * is_told


LAND_THERE, LAND_HERE = item(21, north(140), 0.0), item(21, 0.0, 0.0, longitude_deg=0.0)


@pytest.mark.parametrize(
    ("up_m", "behind", "onward", "is_told"),
    [
        # Flown in SITL: home set 60 m up, both climb to 120 m first.
        (60.0, (), LAND_THERE, True),
        (60.0, (), rtl(), True),
        (60.0, (item(203, frame=2),), rtl(), True),  # carried out later, in the same loop
        (60.0, (), LAND_HERE, False),
        # Flown too: behind a waypoint do_nav_wp takes the height of the place before, which is kept.
        (60.0, (), waypoint(140, 0), False),
        (60.0, (), waypoint(140, 20), False),
        (60.0, (item(93, params=(1.0, 0.0, 0.0, 0.0), frame=2),), rtl(), False),  # a delay
        (-20.0, (), rtl(), True),
        (0.4, (), rtl(), False),
    ],
)
def test_what_keeps_its_height_right_behind_a_home_moved_up_climbs_by_as_much(
    up_m: float,
    behind: tuple[MissionItem, ...],
    onward: MissionItem,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    home = item(179, north(100), up_m, frame=3)
    items = (takeoff(60), waypoint(100, 60, hold_s=2), home, *behind, onward)
    for dialect, told in ((ARDUPILOT, is_told), (None, is_told), (PX4, False)):
        found = [f for f in route(*items, dialect=dialect).findings if "comes next" in f.message]
        assert [f.severity for f in found] == [Severity.ERROR] * told


@pytest.mark.parametrize(
    ("queue", "dialect", "leads_to_m", "begins"),
    [
        # Flown in SITL: behind another item home is set when the return has begun, to the old one.
        ((), ARDUPILOT, 150.0, 2),
        ((item(203, frame=2),), ARDUPILOT, 0.0, 2),
        ((item(203, frame=2), waypoint(90, 20)), ARDUPILOT, 150.0, 3),  # a queue of its own
        ((item(203, frame=2),), None, 0.0, 2),
        ((item(203, frame=2),), PX4, 150.0, 2),  # one after the other
    ],
)
def test_a_home_behind_another_item_of_the_queue_is_set_when_the_return_has_begun(
    queue: tuple[MissionItem, ...], dialect: Autopilot | None, leads_to_m: float, begins: int
) -> None:
    home = item(179, north(150), 0.0, frame=3)
    found = route(takeoff(20), waypoint(80, 20), *queue, home, rtl(), dialect=dialect)
    assert found.stages[-1].north_m == pytest.approx(leads_to_m, abs=0.5)
    [moved] = found.moved_homes
    assert moved.first_stage == begins
    assert moved.north_m == pytest.approx(150.0, abs=0.5)
    assert not found.held  # nothing holds it back


@pytest.mark.parametrize(
    ("queue", "heights_m"),
    [
        ((), [30.0, 30.0, 50.0, 50.0]),
        # Flown in SITL: 20.2 m at the next place, 49.3 m at that behind it.
        ((item(203, frame=2),), [30.0, 30.0, 20.0, 50.0]),
    ],
)
def test_a_place_keeps_the_height_above_the_home_that_counts_when_its_leg_begins(
    queue: tuple[MissionItem, ...], heights_m: list[float]
) -> None:
    here = item(179, params=(1.0, 0.0, 0.0, 0.0), frame=2)
    places = (waypoint(160, 20, hold_s=3), waypoint(200, 20, hold_s=2), rtl())
    found = route(takeoff(30), waypoint(60, 30, hold_s=2), *queue, here, *places, dialect=ARDUPILOT)
    assert heights(found)[:4] == heights_m
    assert found.stages[-1].north_m == pytest.approx(60.0, abs=0.5)  # where that leg began


def test_a_moved_home_moves_the_return_and_the_heights_above_home() -> None:
    moved = item(179, north(500), 440.0, params=(0.0, 0.0, 0.0, 0.0), frame=0)
    found = route(takeoff(50), moved, waypoint(600, 50), rtl())
    assert found.stages[1].height_m == pytest.approx(90.0)  # 50 m above a home 40 m higher
    assert found.stages[2].north_m == pytest.approx(500.0, abs=0.5)
    assert found.stages[2].height_m == pytest.approx(40.0)


def test_terrain_altitudes_without_terrain_are_taken_above_home_and_said() -> None:
    found = route(takeoff(20), item(16, north(9), 30.0, frame=10), rtl())
    assert found.stages[1].height_m == 30.0
    assert codes(found) == ["A108"]


class Slope:
    """Terrain that rises one metre for each of the latitude's 1e-5 degrees beyond home's."""

    cell_m = 10.0

    def height_amsl_m(self, latitude_deg: FloatArray, _longitude_deg: FloatArray) -> MaskedHeights:
        return np.ma.masked_array(400.0 + (np.asarray(latitude_deg) - 47.0) * 1e5)


def test_terrain_altitudes_with_terrain_follow_it_and_landings_reach_it() -> None:
    found = make_route(
        mission(takeoff(20), item(16, 47.001, 30.0, frame=10), item(21, 47.002, 0.0)),
        terrain=Slope(),  # type: ignore[arg-type]  # as much of a grid as a route asks for
    )
    assert found.stages[1].height_m == pytest.approx(130.0)
    assert found.stages[2].height_m == pytest.approx(200.0)
    assert codes(found) == []


class Hill:
    """Level ground with a cone on it: 50 m high, its foot 111.2 m from its top at 47.001°."""

    cell_m = 1.0

    def height_amsl_m(self, latitude_deg: FloatArray, _longitude_deg: FloatArray) -> MaskedHeights:
        rise = 1.0 - np.abs(np.asarray(latitude_deg) - 47.001) * 1e3
        return np.ma.masked_array(400.0 + 50.0 * np.maximum(rise, 0.0))


def over_the_hill(frame: int, dialect: Autopilot | None) -> list[str]:
    made = mission(takeoff(60), item(16, 47.002, 60.0, frame=frame), rtl())
    found = make_route(made, dialect=dialect, terrain=Hill())  # type: ignore[arg-type]  # as much of a grid as is asked
    return [f.message for f in found.findings if f.code == "A112"]


def test_ground_that_is_followed_and_is_not_straight_is_told() -> None:
    [message] = over_the_hill(10, ARDUPILOT)
    # 50 m on 0.001° of latitude, 111.2 m: 45 %
    assert "up to 50 m off the line" in message
    assert "45 % steep" in message
    assert over_the_hill(3, ARDUPILOT) == []
    assert over_the_hill(10, None) == []


def test_ground_in_a_straight_line_is_not_told() -> None:
    made = mission(takeoff(20), item(16, 47.001, 30.0, frame=10), item(16, 47.002, 30.0, frame=10))
    found = make_route(made, dialect=ARDUPILOT, terrain=Slope())  # type: ignore[arg-type]  # as much of a grid as is asked
    assert "A112" not in codes(found)


@pytest.mark.parametrize(("angle", "longer"), [(180.0, "1.57"), (-90.0, "1.11"), (270.0, "3.33")])
def test_an_arc_is_flown_straight_and_how_much_longer_it_is_is_told(
    angle: float, longer: str
) -> None:
    # θ/2 over sin θ/2: π/2 for half a circle, 0.785/0.707, 2.356/0.707
    arc = item(36, north(300), 50.0, params=(angle, 0.0, 0.0, None))
    found = route(takeoff(50), waypoint(100, 50), arc, rtl(), dialect=ARDUPILOT)
    [told] = [f for f in found.findings if f.code == "T102"]
    assert f"{longer} times as long" in told.message
    assert found.stages[2].north_m == pytest.approx(300.0, abs=0.5)


@pytest.mark.parametrize(
    ("enable", "dialect", "expected"),
    [
        (1.0, ARDUPILOT, [("T108", Severity.ERROR)]),
        (0.0, ARDUPILOT, []),
        (-1.0, ARDUPILOT, [("T108", Severity.ERROR)]),  # kept as 65535 on some boards
        (1.0, None, [("T102", Severity.ERROR)]),
    ],
)
def test_handing_over_to_a_companion_never_ends_by_itself(
    enable: float, dialect: Autopilot | None, expected: list[tuple[str, Severity]]
) -> None:
    guided = item(92, params=(enable, 0.0, 0.0, 0.0), frame=2)
    found = route(takeoff(50), waypoint(100, 50), guided, rtl(), dialect=dialect)
    assert [(f.code, f.severity) for f in found.findings if f.code != "X902"] == expected
    fixes = [f.fix for f in found.findings if f.code == "T108"]
    assert all("NAV_GUIDED_ENABLE" in fix and "autoContinue" not in fix for fix in fixes)


def test_an_item_without_altitude_cannot_be_flown() -> None:
    found = route(takeoff(20), item(16, north(9), None), rtl())
    assert found.stages[1].height_m == 20.0
    assert codes(found) == ["A109"]


def test_an_altitude_left_to_the_terrain_is_computed_where_it_is_known() -> None:
    """47.001° lies 100 m up the slope, at 500 m AMSL: 30 m above it is 130 m above home."""
    waiting = replace(item(16, 47.001, None, frame=0), unresolved_agl_m=30.0)
    made = mission(takeoff(20), waiting, rtl())
    found = make_route(made, terrain=Slope())  # type: ignore[arg-type]  # as much of a grid as is asked
    assert found.stages[1].height_m == pytest.approx(130.0)
    assert codes(found) == ["A110"]
    without = make_route(made)
    assert without.stages[1].height_m == 20.0
    assert codes(without) == ["A109"]


def test_an_amsl_altitude_below_home_is_right_where_the_ground_falls() -> None:
    """46.999° lies 100 m down the slope, at 300 m AMSL."""
    above = mission(takeoff(20), item(16, 46.999, 330.0, frame=0), rtl())
    assert codes(make_route(above, terrain=Slope())) == []  # type: ignore[arg-type]  # as much of a grid as is asked
    under = mission(takeoff(20), item(16, 46.999, 290.0, frame=0), rtl())
    assert codes(make_route(under, terrain=Slope())) == ["A107"]  # type: ignore[arg-type]  # as much of a grid as is asked


def test_an_unknown_frame_is_an_error() -> None:
    assert "A103" in codes(route(takeoff(20), item(16, north(9), 10.0, frame=1), rtl()))


def test_autocontinue_off_stops_px4_for_ever_and_not_ardupilot() -> None:
    held = item(16, north(9), 20.0, autocontinue=False)
    assert codes(route(takeoff(20), held, rtl(), dialect=PX4)) == ["T108"]
    assert codes(route(takeoff(20), held, rtl(), dialect=ARDUPILOT)) == []
    [unknown] = [f for f in route(takeoff(20), held, rtl()).findings if f.code == "T108"]
    assert unknown.severity is Severity.ERROR
    turns = replace(item(18, north(9), 20.0, params=(1.0, 0.0, 9.0, 0.0)), autocontinue=False)
    assert "T108" not in codes(
        route(takeoff(20), turns, rtl())
    )  # PX4 refuses circles: ArduPilot flies it


def test_after_the_end_there_is_nothing_for_px4_to_continue_to() -> None:
    land = item(21, north(9), 0.0)
    for end in (land, rtl()):
        last = replace(end, autocontinue=False)
        assert codes(route(takeoff(20), waypoint(9, 20), last, dialect=PX4)) == []
    held = replace(land, autocontinue=False)
    assert "T108" in codes(route(takeoff(20), held, takeoff(20), rtl(), dialect=PX4))


def test_without_home_the_flight_starts_at_the_first_place() -> None:
    found = make_route(mission(takeoff(20), waypoint(100, 20), rtl(), home=None))
    assert found.stages[1].north_m == pytest.approx(100.0, abs=0.1)
    assert "M107" in codes(found)


def test_a_mission_without_any_place_says_so() -> None:
    here = item(22, 0.0, 20.0, longitude_deg=0.0)
    assert codes(make_route(mission(here, rtl(), home=None))) == ["M107", "M110"]


@pytest.mark.parametrize(
    "bad",
    [
        waypoint(10, 20, hold_s=1e9),
        waypoint(10, 1e9),
        waypoint(10, 10_001),
        speed(1e308),
        item(93, params=(1e300, 0.0, 0.0, 0.0)),
        item(18, 47.0, 10.0, params=(1e300, 0.0, 5.0, 0.0)),
        item(16, 91.0, 10.0, frame=2),
        item(16, 300.0, 10.0, frame=2),
        item(16, 47.0, 10.0, longitude_deg=-181.0, frame=1),
        item(179, 177.0, 400.0, params=(0.0, 0.0, 0.0, 0.0), frame=2),
    ],
)
def test_numbers_no_vehicle_can_fly_are_refused_with_the_item(bad: MissionItem) -> None:
    for home in (HOME, None):
        with pytest.raises(MissionFileError, match="item 2"):
            make_route(mission(takeoff(20), bad, rtl(), home=home))


@pytest.mark.parametrize(
    ("latitude_deg", "altitude_m", "sentence"),
    [
        (47.0, 65_535.0, "home is at 65535 m AMSL"),
        (47.0, -501.0, "home is at -501 m AMSL"),
        (177.0, 500.0, "home is at 177°, 8°: not a place on Earth"),
    ],
)
def test_a_home_where_nobody_stands_is_refused(
    latitude_deg: float, altitude_m: float, sentence: str
) -> None:
    home = Home(latitude_deg=latitude_deg, longitude_deg=8.0, altitude_amsl_m=altitude_m)
    with pytest.raises(MissionFileError, match=sentence):
        make_route(mission(takeoff(20), rtl(), home=home))


def test_a_wrong_altitude_of_home_is_put_right_by_hand() -> None:
    home = Home(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=65_535.0)
    assert (
        make_route(mission(takeoff(20), rtl(), home=home), home_amsl_m=400.0).home_amsl_m == 400.0
    )


def evidence(kind: VehicleKind, *, is_certain: bool) -> VehicleEvidence:
    return VehicleEvidence(kind=kind, is_certain=is_certain, reason="it looks like one")


@pytest.mark.parametrize(("turns", "is_error"), [(-3.0, True), (0.0, False), (3.0, False)])
def test_turns_below_zero_are_what_the_board_makes_of_them(turns: float, *, is_error: bool) -> None:
    # cmd.p1 = MIN(255, packet.param1), into 16 bits without a sign: 0 on ARM, 253 turns of 255 m on x86.
    circle = item(18, north(200), 30.0, params=(turns, 0.0, 25.0, 0.0))
    flown = mission(takeoff(30), circle, rtl())
    for dialect, told in ((ARDUPILOT, is_error), (None, is_error), (PX4, False)):
        said = [f for f in make_route(flown, dialect=dialect).findings if f.code == "T102"]
        assert [f.severity for f in said if "without a sign" in f.message] == [
            Severity.ERROR
        ] * told


@pytest.mark.parametrize("kind", sorted(set(VehicleKind) - {VehicleKind.MULTICOPTER}))
def test_missions_of_other_vehicles_are_refused_with_what_tells_them(kind: VehicleKind) -> None:
    told = evidence(kind, is_certain=True)
    with pytest.raises(OtherVehicleError, match=f"{kind}.*looks like one.*multicopters only"):
        make_route(mission(takeoff(20), rtl(), vehicle=told))


def test_a_mission_that_is_probably_another_vehicles_is_flown_with_a_warning() -> None:
    told = evidence(VehicleKind.FIXED_WING, is_certain=False)
    assert "M111" in codes(make_route(mission(takeoff(20), rtl(), vehicle=told)))
    multicopter = evidence(VehicleKind.MULTICOPTER, is_certain=True)
    assert codes(make_route(mission(takeoff(20), rtl(), vehicle=multicopter))) == []


def test_an_endless_mission_carries_its_lap() -> None:
    found = route(takeoff(20), waypoint(100, 20), waypoint(0, 20), jump(2, -1))
    assert found.lap is not None
    assert found.lap.item == 4
    assert found.stages[found.lap.first_stage].item == 2
    assert [s.item for s in found.stages] == [1, 2, 3, 2, 3]
    assert not found.ends_in_air


@settings(deadline=None, max_examples=examples(60))
@given(
    st.lists(
        st.builds(
            item,
            st.sampled_from([16, 17, 18, 19, 20, 21, 22, 31, 82, 93, 94, 112, 177, 178, 179, 206]),
            st.one_of(st.none(), st.floats(46.9, 47.1), st.just(0.0)),
            st.one_of(st.none(), st.floats(-100, 500)),
            params=st.tuples(*[st.one_of(st.none(), st.floats(-5, 20))] * 4),
            frame=st.sampled_from([0, 2, 3, 5, 6, 10, 11]),
        ),
        max_size=12,
    ),
    st.sampled_from([None, PX4, ARDUPILOT]),
)
def test_any_items_make_a_route_of_finite_stages(
    items: list[MissionItem], dialect: Autopilot | None
) -> None:
    found = route(*items, dialect=dialect)
    for stage in found.stages:
        assert np.isfinite([stage.east_m, stage.north_m, stage.height_m, stage.hold_s]).all()
        assert stage.hold_s >= 0.0
        assert 1 <= stage.item <= len(items)
    assert set(found.reached) <= set(range(1, len(items) + 1))


def test_heights_count_from_home() -> None:
    assert HOME.altitude_amsl_m == route(takeoff(20), rtl()).home_amsl_m


def test_an_unknown_altitude_of_home_is_taken_from_the_terrain() -> None:
    home = Home(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=None)
    made = mission(takeoff(20), item(16, 47.001, 530.0, frame=0), rtl(), home=home)
    found = make_route(made, terrain=Slope())  # type: ignore[arg-type]  # as much of a grid as is asked
    assert found.home_amsl_m == 400.0
    assert found.stages[1].height_m == pytest.approx(130.0)
    assert codes(found) == []


@pytest.mark.parametrize("dialect", [PX4, ARDUPILOT, None])
@pytest.mark.parametrize(("command", "is_told"), [(16, True), (21, True), (19, True), (22, False)])
def test_what_is_no_place_is_here_to_neither_autopilot(
    dialect: Autopilot | None,
    command: int,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    odd = item(command, None, 20.0)
    items = (odd, rtl()) if command == 22 else (takeoff(20), waypoint(50, 20), odd, rtl())
    found = [f.severity for f in route(*items, dialect=dialect).findings if f.code == "M110"]
    assert found == [Severity.ERROR] * is_told


def test_a_waypoint_without_position_is_said_and_taken_as_here() -> None:
    found = route(takeoff(20), item(16, None, 20.0), rtl())
    assert codes(found) == ["M110"]
    assert found.findings[0].severity is Severity.ERROR
    assert found.stages[1].north_m == pytest.approx(0.0, abs=1e-9)


def test_a_return_or_a_landing_alone_is_no_flight() -> None:
    assert codes(route(rtl())) == ["M108"]
    assert codes(route(item(21, 47.0, 0.0))) == ["M108"]


def test_a_second_takeoff_behind_a_landing_is_an_error() -> None:
    items = (takeoff(20), item(21, north(50), 0.0), takeoff(20), waypoint(900, 20), rtl())
    [finding] = [f for f in route(*items).findings if f.code == "T104"]
    assert finding.severity is Severity.ERROR


@pytest.mark.parametrize(
    ("dialect", "before", "severity"),
    [
        (ARDUPILOT, (takeoff(20), waypoint(100, 20)), Severity.ERROR),
        (None, (takeoff(20), waypoint(100, 20)), Severity.ERROR),
        (Autopilot.PX4, (takeoff(20), waypoint(100, 20)), Severity.WARNING),  # it does not wait
        (ARDUPILOT, (), Severity.ERROR),  # on the ground its motors idle
        (Autopilot.PX4, (), Severity.WARNING),
    ],
)
def test_a_wait_until_a_time_of_day_is_no_go(
    dialect: Autopilot | None, before: tuple[MissionItem, ...], severity: Severity
) -> None:
    wait = item(93, frame=2, params=(-1.0, 14.0, 30.0, 0.0))
    found = route(*before, wait, takeoff(30), waypoint(200, 20), rtl(), dialect=dialect)
    assert [one.severity for one in found.findings if one.code == "T107"] == [severity]


def test_ardupilot_stops_before_a_jump_to_what_is_not_flown_and_looks_on_behind_it() -> None:
    # AP_Mission::get_next_nav_cmd; on a build it stood before both laps: 24.7 s where 17 s were predicted.
    def unseen(*items: MissionItem, dialect: Autopilot = ARDUPILOT) -> list[int]:
        stages = route(*items, dialect=dialect).stages
        return [at for at, stage in enumerate(stages) if stage.is_next_unseen]

    first = (takeoff(20), speed(4.0), waypoint(60, 20), waypoint(0, 20))
    assert unseen(*first, jump(2, 2), rtl()) == [2, 4]
    assert unseen(*first, jump(2, 2)) == [2, 4]
    assert unseen(*first, jump(3, 2), rtl()) == []
    assert unseen(*first, jump(2, 2), waypoint(90, 20), rtl()) == []
    assert unseen(*first, jump(2, 2), rtl(), dialect=PX4) == []


@pytest.mark.parametrize(
    ("up_m", "hold_s", "onward", "told"),
    [
        (40.0, 0.0, waypoint(900, 20), [Severity.ERROR]),
        (-40.0, 0.0, waypoint(900, 20), [Severity.WARNING]),  # it flies higher than predicted
        (0.4, 0.0, waypoint(900, 20), []),
        (40.0, 0.9, waypoint(900, 20), [Severity.ERROR]),  # kept as 0 s
        (40.0, 1.0, waypoint(900, 20), []),  # it stops, and plans anew
        (40.0, 0.0, item(16, north(900), 480.0, frame=0), []),  # above the sea
        (40.0, 0.0, rtl(), []),
    ],
)
def test_a_home_that_moves_up_behind_a_place_flown_through_is_not_that_of_the_next_leg(
    up_m: float, hold_s: float, onward: MissionItem, told: list[Severity]
) -> None:
    # ModeAuto::set_next_wp has handed the leg on before DO_SET_HOME is carried out.
    moved = item(179, north(100), up_m, frame=3)
    items = (takeoff(20), waypoint(100, 20, hold_s=hold_s), moved, onward, rtl())
    # So, too, where it is not known who flies.
    for dialect, expected in ((ARDUPILOT, told), (None, told), (PX4, [])):
        found = [f for f in route(*items, dialect=dialect).findings if "flown through" in f.message]
        assert [f.severity for f in found] == expected


@pytest.mark.parametrize(
    ("behind", "hold_s", "target", "elsewhere"),
    [
        (waypoint(900, 20), 0.0, 2, True),  # ArduPilot #31021
        (item(82, north(900), 20.0), 0.0, 2, True),
        (item(19, north(900), 20.0), 0.0, 2, True),
        (waypoint(900, 20), 1.0, 2, False),  # it stops there, and plans anew
        (waypoint(900, 20), 0.0, 3, False),  # a place
        (item(18, north(900), 20.0), 0.0, 2, False),
        (rtl(), 0.0, 2, False),
    ],
)
def test_ardupilot_flies_to_the_place_behind_a_jump_to_what_is_none(
    behind: MissionItem,
    hold_s: float,
    target: int,
    elsewhere: bool,  # noqa: FBT001 - a table of cases
) -> None:
    loop = (speed(4.0), waypoint(60, 20), waypoint(0, 20, hold_s=hold_s), jump(target, 2))
    items = (takeoff(20), *loop, behind, rtl())
    assert ("T124" in codes(route(*items, dialect=ARDUPILOT))) is elsewhere
    assert ("T124" in codes(route(*items))) is elsewhere  # of a text, which may be ArduPilot's
    assert "T124" not in codes(route(*items, dialect=PX4))


@pytest.mark.parametrize(
    ("comes", "elsewhere"),
    [(rtl(), False), (item(21, north(0), 0.0), True), (waypoint(60, 20), True)],
)
def test_a_return_drops_the_leg_that_ardupilot_planned_ahead(
    comes: MissionItem,
    elsewhere: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # The jump leads over item 6 to what comes; the place behind the jump is planned ahead.
    camera = item(206, frame=2)
    items = (takeoff(20), waypoint(60, 20), waypoint(0, 20), jump(6, 1), waypoint(900, 20), camera)
    assert ("T124" in codes(route(*items, comes, rtl(), dialect=ARDUPILOT))) is elsewhere


GATE = item(4501, 47.01, 20.0)


@pytest.mark.parametrize("dialect", [PX4, None])
@pytest.mark.parametrize("end", [rtl(), item(21, north(300.0), 0.0)])
def test_a_gate_is_no_place_of_the_way(dialect: Autopilot | None, end: MissionItem) -> None:
    """PX4 flies straight to the next place (``Mission::setActiveMissionItems``), as without the gate."""
    ahead, behind = (takeoff(20), waypoint(100, 20)), (waypoint(200, 20), end)
    without, gated = (route(*ahead, *gate, *behind, dialect=dialect) for gate in ((), (GATE,)))
    assert [replace(one, item=0) for one in gated.stages] == [
        replace(one, item=0) for one in without.stages
    ]
    assert [f.severity for f in gated.findings if f.code == "T102"] == [Severity.WARNING]


@pytest.mark.parametrize(
    "behind", [(speed(3.0), waypoint(200, 20), rtl()), (item(21, north(300.0), 0.0),)]
)
def test_what_px4_does_as_it_passes_a_gate_is_not_predicted(
    behind: tuple[MissionItem, ...],
) -> None:
    found = route(takeoff(20), waypoint(100, 20), GATE, *behind, dialect=PX4).findings
    assert [f.severity for f in found if f.code == "T102"] == [Severity.WARNING, Severity.ERROR]
    # at a place it is known again where the speed counts from
    late = (waypoint(150, 20), speed(3.0), waypoint(200, 20), rtl())
    found = route(takeoff(20), waypoint(100, 20), GATE, *late, dialect=PX4).findings
    assert [f.severity for f in found if f.code == "T102"] == [Severity.WARNING]


@pytest.mark.parametrize(
    ("hold_s", "exit_by", "onward", "is_told"),
    [
        # Flown by a build of PX4: 0 s and 40 m lead 39 m past the place, at 1.3 m/s.
        (0.0, 1.0, waypoint(200, 20), True),
        (3.9, 90.0, waypoint(200, 20), True),
        (4.0, 1.0, waypoint(200, 20), False),  # at rest: flown straight on
        (0.0, 0.0, waypoint(200, 20), False),
        (0.0, None, waypoint(200, 20), False),
        (0.0, 1.0, rtl(), False),  # no next place
    ],
)
def test_px4_leaves_a_short_loiter_by_a_tangent(
    hold_s: float,
    exit_by: float | None,
    onward: MissionItem,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    loiter = item(19, north(100), 20.0, params=(hold_s, 0.0, 40.0, exit_by))
    items = (takeoff(20), loiter, onward, waypoint(300, 20), rtl())
    told = [one for one in route(*items, dialect=PX4).findings if "tangent" in one.message]
    assert [(one.severity, one.item) for one in told] == [(Severity.ERROR, 3)] * is_told
    for dialect in (ARDUPILOT, None):
        assert not [f for f in route(*items, dialect=dialect).findings if "tangent" in f.message]


@pytest.mark.parametrize(
    ("dialect", "loop", "repeats", "is_told"),
    [
        # Flown by a build of PX4: two of four such missions did not take off, one hovered for 300 s.
        (PX4, (item(93, params=(3.0, -1.0, -1.0, -1.0), frame=2),), 2.0, True),
        (PX4, (speed(3.0),), 1.0, True),
        (PX4, (speed(3.0),), 0.0, False),  # not taken
        (PX4, (waypoint(50, 20), speed(3.0)), 2.0, False),
        # A gate is no place to it.  Flown: 0 m, disarmed after 13 s.
        (PX4, (item(4501, north(150), 20.0),), 3.0, True),
        (ARDUPILOT, (speed(3.0),), 1.0, False),
        (None, (speed(3.0),), 1.0, True),  # PX4 may fly it
        (None, (item(82, north(150), 20.0),), 1.0, False),  # refused by PX4
    ],
)
def test_px4_jumps_back_over_a_place_or_does_not_fly_on(
    dialect: Autopilot | None,
    loop: tuple[MissionItem, ...],
    repeats: float,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    jump = item(177, params=(3.0, repeats, 0.0, 0.0), frame=2)
    found = route(
        takeoff(20), waypoint(100, 20), *loop, jump, waypoint(200, 20), rtl(), dialect=dialect
    )
    told = [(one.severity, one.item) for one in found.findings if one.code == "M121"]
    assert told == [(Severity.ERROR, 3 + len(loop))] * is_told


@pytest.mark.parametrize(
    ("forward", "back", "is_told"), [(1.0, 1.0, True), (0.0, 1.0, False), (1.0, 0.0, False)]
)
def test_px4_looks_past_the_place_that_a_forward_jump_leads_over(
    forward: float,
    back: float,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    """Its look takes the jump forward each time, past the waypoint.  Flown: 0 m, disarmed after 31 s."""
    jumps = (
        item(177, params=(to, n, 0.0, 0.0), frame=2) for to, n in ((6.0, forward), (3.0, back))
    )
    over, again = jumps
    items = (
        takeoff(20),
        waypoint(50, 20),
        over,
        waypoint(100, 20),
        speed(3.0),
        speed(4.0),
        again,
        rtl(),
    )
    told = [one.item for one in route(*items, dialect=PX4).findings if one.code == "M121"]
    assert told == [3] * is_told


@pytest.mark.parametrize(
    ("between", "reset", "is_told"),
    [
        # Flown by a build of PX4: 161 s at 0.5 m/s, and 92.8 s predicted at its own speed.
        ((), -2.0, True),
        ((), 5.0, False),
        ((waypoint(150, 20),), -2.0, False),
    ],
)
def test_px4_takes_no_speed_back_at_once(
    between: tuple[MissionItem, ...],
    reset: float,
    is_told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    items = (takeoff(20), speed(0.5), *between, speed(reset), waypoint(200, 20), rtl())
    told = [one for one in route(*items, dialect=PX4).findings if "own speed" in one.message]
    assert [one.severity for one in told] == [Severity.ERROR] * is_told
    assert not [f for f in route(*items, dialect=ARDUPILOT).findings if "own speed" in f.message]


@pytest.mark.parametrize("dialect", [ARDUPILOT, None])
@pytest.mark.parametrize(
    ("spline_hold_s", "delay", "swings"),
    [
        # Flown: into the ground with -1; with 0, and behind a hold, as predicted.
        (0.0, (5.0, -1.0, -1.0, -1.0), True),
        (0.0, (0.0, 0.0, 0.0, 1.0), True),
        (0.0, (5.3, 12.0, 30.0, 0.0), True),
        (0.0, (5.0, 0.0, 0.0, 0.0), False),
        (1.0, (5.0, -1.0, -1.0, -1.0), False),
        (0.9, (5.0, -1.0, -1.0, -1.0), True),  # kept as 0 s
        # The lowest byte of 1.3 as a float, 0x66, has the bit of places above terrain, that of 5.3, 0x9A,
        # not: flown, the one stops ArduCopter, the other is flown as predicted.
        (0.0, (1.3, 0.0, 0.0, 0.0), True),
        (0.0, (5.3, 0.0, 0.0, 0.0), False),
    ],
)
def test_a_spline_before_a_delay_that_reads_as_an_altitude_is_an_error(
    dialect: Autopilot | None, spline_hold_s: float, delay: tuple[float, ...], *, swings: bool
) -> None:
    spline = item(82, north(60), 25.0, params=(spline_hold_s, 0.0, 0.0, 0.0))
    camera = item(206, frame=2, params=(5.0, 0.0, 1.0, 0.0))
    waits = item(93, frame=2, params=delay)
    found = route(takeoff(25), spline, camera, waits, waits, rtl(), dialect=dialect).findings
    told = [one for one in found if one.code == "T102" and "spline" in one.message]
    assert [(one.item, one.severity) for one in told] == [(4, Severity.ERROR)] * swings


@pytest.mark.parametrize(("seconds", "told"), [(5.0, False), (1.3, True)])
def test_a_spline_above_terrain_is_not_led_to_a_place_that_is_not(
    seconds: float, *, told: bool
) -> None:
    # AC_WPNav::set_spline_destination has no tangent where only one of the two counts from the terrain.
    waits = item(93, frame=2, params=(seconds, -1.0, -1.0, -1.0))
    flown = route(takeoff(25), item(82, north(60), 25.0, frame=10), waits, rtl(), dialect=ARDUPILOT)
    assert any("behind a spline" in one.message for one in flown.findings) is told


@pytest.mark.parametrize(
    ("after", "swing"),
    [
        # Flown: 60 m of spline at 25 m; 4/27 of what is above it, within four lengths of the spline.
        (item(21, north(120), 100.0), "11 m"),
        (item(21, None, 60.0), "5.2 m"),
        (item(22, None, 60.0), "5.2 m"),
        (item(94, None, 60.0), "5.2 m"),
        (item(92, None, 60.0), "5.2 m"),
        (item(21, north(120), 1000.0), "36 m"),
        (item(22, north(120), 25.0), "8.9 m"),
        (item(21, None, 28.38), "0.5 m"),  # 27/8 m above it lead 0.5 m down
        (item(21, None, 28.37), None),
        (item(21, north(120), 0.0), None),
        (item(20, None, 60.0), None),
        (item(31, None, 60.0), None),  # predicted as flown
        (item(18, None, 60.0, params=(1.0, 0.0, 20.0, 0.0)), None),
    ],
)
def test_a_spline_before_an_altitude_it_leads_on_to_is_an_error(
    after: MissionItem, swing: str | None
) -> None:
    flown = route(takeoff(25), item(82, north(60), 25.0), after, dialect=ARDUPILOT).findings
    told = [one.message for one in flown if one.code == "T102" and "behind a spline" in one.message]
    assert len(told) == (swing is not None)
    assert all(f"up to {swing} up or down" in message for message in told)
    terrain = route(takeoff(25), item(82, north(60), 25.0, frame=10), after, dialect=ARDUPILOT)
    assert not any("behind a spline" in one.message for one in terrain.findings)


@pytest.mark.parametrize(
    ("height_m", "altitude_m", "severity"),
    [
        # 4/27 of it: 15 m lead 2.2 m down or up; 33.7 m and 33.8 m 4.99 m and 5.01 m.
        (50.0, 35.0, Severity.WARNING),
        (50.0, 16.3, Severity.WARNING),
        (50.0, 16.2, Severity.ERROR),
        (12.3, 27.3, Severity.WARNING),
        (12.1, 27.1, Severity.ERROR),  # 9.9 m above the ground
    ],
)
def test_a_little_swing_high_up_is_a_warning(
    height_m: float, altitude_m: float, severity: Severity
) -> None:
    items = (takeoff(height_m), item(82, north(60), height_m), item(21, north(120), altitude_m))
    told = [one for one in route(*items, dialect=ARDUPILOT).findings if "a spline" in one.message]
    assert [one.severity for one in told] == [severity]


@pytest.mark.parametrize(("dialect", "stops"), [(ARDUPILOT, True), (None, True), (PX4, False)])
@pytest.mark.parametrize("command", [16, 82])
def test_ardupilot_stops_between_places_above_home_and_above_terrain(
    command: int, dialect: Autopilot | None, *, stops: bool
) -> None:
    frames = (10, 3, 3, 10, 11)
    camera = item(206, frame=2, params=(5.0, 0.0, 1.0, 0.0))
    places = [item(command, north(60 * n), 25.0, frame=f) for n, f in enumerate(frames, start=1)]
    found = route(takeoff(25), places[0], camera, *places[1:], rtl(), dialect=dialect)
    flown = [one.is_next_unseen for one in found.stages[1:6]]
    assert flown == [stops, False, stops, False, False]
    landing = item(21, north(120), 0.0)
    found = route(takeoff(25), places[0], landing, dialect=dialect)
    assert found.stages[1].is_next_unseen is stops
