"""Profiles: what they ask for, and what is wrong with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, jump, mission, north, rtl, takeoff, waypoint

from planner.errors import ProfileFileError
from planner.findings import Severity
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.quantity import Spread
from planner.selection import Selection
from planner.service.preflight import check
from planner.site_profile import read_profile
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Finding
    from planner.mission.items import Mission

COPTER = load_vehicle("arducopter-sitl-quad")
GOOD = mission(takeoff(20), waypoint(500, 60), rtl())


def of(
    code: str, tmp_path: Path, profile: str, *, one: Mission = GOOD, parameters: str = ""
) -> list[Finding]:
    path = tmp_path / "site.toml"
    path.write_text(profile, encoding="utf-8")
    given = parameters_from_text(parameters.encode(), source="p.param") if parameters else None
    result = check(
        one,
        COPTER,
        battery=Battery(capacity_wh=170.0),
        parameters=given,
        profile=read_profile(path),
    )
    return [finding for finding in result.findings if finding.code == code]


@pytest.mark.parametrize(
    ("expected", "given", "fires"),
    [
        ("RTL_ALT = 3000", "RTL_ALT,3000\n", False),
        ("RTL_ALT = 3000", "RTL_ALT,2999\n", True),
        ("RTL_ALT = 3000", "RTL_ALT_M,30\n", False),  # the same under its new name
        ("RTL_ALT_M = 30", "RTL_ALT,3000\n", False),
        ("RTL_ALT = 3000", "RTL_ALT_M,3000\n", True),  # never a factor of 100
        ("RTL_ALT = 3000", "WPNAV_SPEED,500\n", True),  # not in the file
        ("BATT_LOW_VOLT = [13.8, 14.4]", "BATT_LOW_VOLT,13.8\nRTL_ALT,1500\n", False),
        ("BATT_LOW_VOLT = [13.8, 14.4]", "BATT_LOW_VOLT,13.79\nRTL_ALT,1500\n", True),
        ("BATT_LOW_VOLT = [13.8, 14.4]", "BATT_LOW_VOLT,14.41\nRTL_ALT,1500\n", True),
        ("WPNAV_SPEED = {value = 500, tolerance = 20}", "WPNAV_SPEED,520\n", False),
        ("WPNAV_SPEED = {value = 500, tolerance = 20}", "WPNAV_SPEED,521\n", True),
        # Vehicles hold single precision: 0.1 is 0.100000001.
        ("MOT_SPIN_ARM = 0.1", "MOT_SPIN_ARM,0.100000001\nRTL_ALT,1500\n", False),
        ("SERIAL1_PROTOCOL = 2", "SERIAL1_PROTOCOL,1\nRTL_ALT,1500\n", True),
    ],
)
def test_parameters_are_held_to_what_a_profile_asks(
    tmp_path: Path,
    expected: str,
    given: str,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    found = of("P103", tmp_path, f"[expect.params]\n{expected}\n", parameters=given)
    assert [finding.severity for finding in found] == [Severity.ERROR] * fires
    if fires:
        assert f"{tmp_path / 'site.toml'} expects " in found[0].message


def test_expected_parameters_without_a_file_of_parameters_are_an_error(tmp_path: Path) -> None:
    [finding] = of("P103", tmp_path, "[expect.params]\nRTL_ALT = 1500\nFENCE_ENABLE = 1\n")
    assert "expects 2 values" in finding.message


@pytest.mark.parametrize(("limit_m", "fires"), [(61, False), (60, False), (59.9, True)])
def test_a_flight_above_the_height_of_a_site_is_an_error(
    tmp_path: Path,
    limit_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    found = of("A114", tmp_path, f"[site]\nmax_height_above_home_m = {limit_m}\n")
    assert [(f.severity, f.item) for f in found] == [(Severity.ERROR, 2)] * fires


@pytest.mark.parametrize(("limit_m", "fires"), [(80.1, False), (79.9, True)])
def test_a_return_above_the_height_of_a_site_is_an_error_though_the_mission_lands_itself(
    tmp_path: Path,
    limit_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    lands = mission(takeoff(20), waypoint(500, 60), item(21, north(500)))
    profile, given = f"[site]\nmax_height_above_home_m = {limit_m}\n", "RTL_ALT,8000\n"
    found = of("A114", tmp_path, profile, one=lands, parameters=given)
    assert [one.severity for one in found] == [Severity.ERROR] * fires
    assert all("on the return from item" in one.message for one in found)


@pytest.mark.parametrize(("limit_m", "fires"), [(501, False), (499, True)])
def test_a_mission_beyond_the_distance_of_a_site_is_an_error(
    tmp_path: Path,
    limit_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    profile = f"[site]\nmax_distance_m = {limit_m}\n"
    found = of("M122", tmp_path, profile)
    assert [(f.severity, f.item) for f in found] == [(Severity.ERROR, 2)] * fires
    if fires:
        assert "item 2 is 500 m from home" in found[0].message


@pytest.mark.parametrize(("limit_m", "fires"), [(1001, False), (999, True)])
def test_a_home_that_is_not_known_may_be_500_m_away(
    tmp_path: Path, limit_m: float, *, fires: bool
) -> None:
    profile = f"[site]\nmax_distance_m = {limit_m}\n"
    found = of("M122", tmp_path, profile, one=replace(GOOD, home=None))
    assert [f.severity for f in found] == [Severity.ERROR] * fires
    # Of a site with a place of its own nothing counts from home.
    placed = profile + f"latitude_deg = {north(0)}\nlongitude_deg = 8.0\n"
    assert of("M122", tmp_path, placed, one=replace(GOOD, home=None)) == []


def test_an_ignored_error_switches_off_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "site.toml"
    path.write_text("[site]\nmax_distance_m = 499\n", encoding="utf-8")
    for ignored in ((), ("M122",)):
        result = check(
            GOOD,
            COPTER,
            battery=Battery(capacity_wh=170.0),
            payload_kg=Spread(mean=2.0, sd=1.5),
            profile=read_profile(path) if ignored else None,
            selection=Selection(ignore=ignored),
        )
        assert "E116" in {one.code for one in result.findings if one.severity is Severity.ERROR}


@pytest.mark.parametrize(
    ("limits", "severity"),
    [
        ("max_distance_m = 1000", Severity.ERROR),
        ("max_height_above_home_m = 100", Severity.ERROR),
        ('required_items = ["NAV_TAKEOFF"]', Severity.WARNING),
    ],
)
def test_splines_flown_straight_are_not_held_to_the_limits_of_a_site(
    tmp_path: Path, limits: str, severity: Severity
) -> None:
    path = tmp_path / "site.toml"
    path.write_text(f"[site]\n{limits}\n", encoding="utf-8")
    curved = mission(takeoff(20), waypoint(200, 60), item(82, north(300), 60), rtl())
    steps = load_vehicle("falkowski-2023-quadrotor")
    result = check(curved, steps, battery=Battery(capacity_wh=77.0), profile=read_profile(path))
    [found] = [one for one in result.findings if one.code == "T102"]
    assert found.severity is severity
    assert ("the limits of the site cannot be checked" in found.message) is (
        severity is Severity.ERROR
    )


def test_distances_count_from_the_place_of_the_site_and_for_rally_and_fence(tmp_path: Path) -> None:
    place = f"[site]\nlatitude_deg = {north(250)}\nlongitude_deg = 8.0\nmax_distance_m = 300\n"
    assert of("M122", tmp_path, place) == []
    rally = RallyPoint(latitude_deg=north(780), longitude_deg=8.0, height_above_home_m=20.0)
    # It is where the mission's own return leads, from item 2 on nearer than home.
    [finding] = of("M122", tmp_path, place, one=replace(GOOD, rally=(rally,)))
    assert "item 3 is 530 m from the site; " in finding.message
    assert finding.message.endswith("allows 300 m (1 more place too far)")
    corners = ((north(-100), 7.999), (north(2250), 8.0), (north(-100), 8.001))
    fence = Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=corners),))
    [finding] = of("M122", tmp_path, place, one=replace(GOOD, fence=fence))
    assert "a corner of fence polygon 1 is 2.00 km" in finding.message
    # What is kept out of may be anywhere; of areas to stay in the second is too far.
    centres = [(250.0, False), (2250.0, False), (250.0, True), (1250.0, True)]
    circles = tuple(
        FenceCircle(inclusion=inside, latitude_deg=north(m), longitude_deg=8.0, radius_m=200.0)
        for m, inside in centres
    )
    [finding] = of("M122", tmp_path, place, one=replace(GOOD, fence=Fence(circles=circles[2:])))
    assert "the far edge of fence circle 2 is 1.20 km from the site" in finding.message
    assert of("M122", tmp_path, place, one=replace(GOOD, fence=Fence(circles=circles[:3]))) == []
    far = replace(rally, latitude_deg=north(1250))
    near = replace(rally, latitude_deg=north(250))
    landing = mission(takeoff(20), waypoint(500, 60), item(21, north(0), 0.0))
    beside = replace(landing, rally=(near, far))
    [finding] = of("M122", tmp_path, place, one=beside)
    assert "rally point 2 is 1.00 km from the site" in finding.message


@pytest.mark.parametrize(("limit_m", "fires"), [(231, False), (220, True)])
def test_a_circle_is_as_far_as_it_is_flown(tmp_path: Path, limit_m: float, *, fires: bool) -> None:
    """Of 80 m about a place 150 m away: 230 m, less what the vehicle cuts inside."""
    circle = item(18, north(150), 30.0, params=(2.0, 0.0, 80.0, 0.0))
    profile = f"[site]\nmax_distance_m = {limit_m}\n"
    found = of("M122", tmp_path, profile, one=mission(takeoff(30), circle, rtl()))
    assert [(f.severity, f.item) for f in found] == [(Severity.ERROR, 2)] * fires
    assert all("the way of item 2 is 22" in one.message for one in found)


def test_items_that_a_site_requires_are_missed(tmp_path: Path) -> None:
    profile = '[site]\nrequired_items = ["NAV_TAKEOFF", "MAV_CMD_NAV_LAND"]\n'
    [finding] = of("M123", tmp_path, profile)
    assert "no NAV_LAND in what is flown" in finding.message
    lands = mission(takeoff(20), waypoint(500, 60), item(21, north(0), 0.0))
    assert of("M123", tmp_path, profile, one=lands) == []
    # behind a return that lands, or a loop without end, nothing is flown
    for last in (rtl(), jump(2, -1)):
        behind = mission(takeoff(20), waypoint(500, 60), last, item(21, north(0), 0.0))
        assert len(of("M123", tmp_path, profile, one=behind)) == 1
    marked = '[site]\nrequired_items = ["DO_LAND_START"]\n'
    starts = mission(takeoff(20), waypoint(500, 60), rtl(), item(189, north(0), 0.0))
    assert of("M123", tmp_path, marked, one=starts) == []


@pytest.mark.parametrize(
    ("profile", "problem"),
    [
        ("[sites]\n", "sites is not a table of a profile; did you mean site?"),
        ("[site]\nmax_distance = 3\n", "did you mean max_distance_m?"),
        ("[site]\nmax_distance_m = 0\n", "must be greater than 0"),
        ("[site]\nlatitude_deg = 47\n", "latitude_deg and longitude_deg"),
        ('[site]\nrequired_items = ["NAV_TAKEOF"]\n', "did you mean NAV_TAKEOFF?"),
        ('[expect.params]\nRTL_ALT = "high"\n', "RTL_ALT must be a number"),
        ("[expect.params]\nRTL_ALT = [2, 1]\n", "RTL_ALT must be a number"),
        ("[expect.params]\nRTL_ALT = {value = 1, of = 2}\n", "RTL_ALT must be a number"),
        ("[expect.params]\nRTL_ALT = nan\n", "RTL_ALT must be a number"),
        ("[expect.params]\nRTL_ALT = true\n", "RTL_ALT must be a number"),
        ("[expect.parameters]\nRTL_ALT = 1\n", "expect.parameters is not a table"),
        ("site = 3\n", "must be tables"),
        ("[site\n", "is not TOML"),
    ],
)
def test_a_profile_that_is_none_is_refused_in_a_sentence(
    tmp_path: Path, profile: str, problem: str
) -> None:
    path = tmp_path / "site.toml"
    path.write_text(profile, encoding="utf-8")
    with pytest.raises(ProfileFileError) as raised:
        read_profile(path)
    assert problem in str(raised.value)


def test_a_profile_of_random_bytes_is_refused_in_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "site.toml"
    path.write_bytes(b"\xf4\x01\x93")
    with pytest.raises(ProfileFileError, match="is not UTF-8 text: this is not a profile"):
        read_profile(path)


def test_a_profile_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProfileFileError, match="cannot be read"):
        read_profile(tmp_path / "none.toml")


def test_manual_items_are_read_by_section_in_the_order_written(tmp_path: Path) -> None:
    path = tmp_path / "site.toml"
    path.write_text(
        '[manual]\nAirframe = ["Props", "Strap"]\nSite = ["Notice"]\n', encoding="utf-8"
    )
    items = [(one.section, one.prompt) for one in read_profile(path).manual]
    assert items == [("Airframe", "Props"), ("Airframe", "Strap"), ("Site", "Notice")]


@pytest.mark.parametrize(
    ("text", "told"),
    [("manual = 3", "table of sections"), ('[manual]\nA = "one"', "manual.A must be a list")],
)
def test_manual_items_of_another_shape_are_refused(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "site.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ProfileFileError, match=told):
        read_profile(path)
