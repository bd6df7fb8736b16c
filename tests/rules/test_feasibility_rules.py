"""What PX4's feasibility check and ArduPilot's arming check refuse, and what failsafes find."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint

from planner import catalogue
from planner.autopilot import TARGETS, Autopilot, Target
from planner.catalogue import PX4_EVENTS
from planner.errors import UsageError
from planner.findings import Severity
from planner.geo.fence import RallyPoint
from planner.mission.commands import Support, support
from planner.mission.formats.wpl import TEXT_NO_HOME_ROW
from planner.mission.items import MissionFormat
from planner.mission.takers import NAME_IT
from planner.physics.wind import Wind
from planner.rules.ledger import Outcome
from planner.selection import Selection
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.declared import Interval
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem
    from planner.vehicle.model import VehicleModel

COPTER = load_vehicle("arducopter-sitl-quad")
PX4 = load_vehicle("px4-sih-quad")
STEP = load_vehicle("falkowski-2023-quadrotor")
OF = {Autopilot.PX4: PX4, Autopilot.ARDUPILOT: COPTER, Autopilot.STEP: STEP}
GATE = 4501
LAND = item(21, HOME.latitude_deg, 0.0)
LAND_START = item(189, frame=2, params=(0.0, 0.0, 0.0, 0.0))


def of(
    code: str,
    one: Mission,
    autopilot: Autopilot,
    parameters: str = "",
    *,
    target: Target | None = None,
    wind: Wind | None = None,
    selection: Selection | None = None,
) -> list[Finding]:
    result = check(
        one,
        OF[autopilot],
        battery=Battery(capacity_wh=170.0),
        parameters=parameters_from_text(parameters.encode(), source="p.param")
        if parameters
        else None,
        target=target,
        wind=wind or Wind(),
        selection=selection or Selection(),
    )
    return [finding for finding in result.findings if finding.code == code]


@pytest.mark.parametrize(
    ("required", "items", "missing"),
    [
        (0, "", ""),
        (1, "", "NAV_TAKEOFF"),
        (1, "T", ""),
        (2, "T", "NAV_LAND"),
        (2, "TR", "NAV_LAND"),  # a return is no landing
        (2, "L", ""),
        (3, "", "NAV_TAKEOFF and NAV_LAND"),
        (3, "TL", ""),
        (4, "", ""),
        (4, "TL", ""),
        (4, "TR", "NAV_LAND"),
        (4, "L", "NAV_TAKEOFF"),
        (5, "T", "NAV_LAND"),
        (5, "", ""),
    ],
)
def test_px4_refuses_without_what_mis_tko_land_req_asks_for(
    required: int, items: str, missing: str
) -> None:
    """PX4's ``checkTakeoffLandAvailable`` for a multicopter on the ground, case by case."""
    made = [takeoff(20)] * ("T" in items) + [waypoint(100, 20)]
    made += [LAND] * ("L" in items) + [rtl()] * ("R" in items)
    found = of("M116", mission(*made), Autopilot.PX4, f"MIS_TKO_LAND_REQ,{required}\n")
    assert len(found) == bool(missing)
    if missing:
        assert found[0].severity is Severity.ERROR
        assert f"without {missing}" in found[0].message


@pytest.mark.parametrize(
    ("bits", "missing"),
    [
        (0, ""),
        (0b1000, ""),  # take-off
        (0b1000000, ""),  # return
        (0b1, "NAV_LAND"),
        (0b100, "DO_LAND_START"),
        (0b100000, "a rally point within 300 m of home"),
        (0b1001001, "NAV_LAND"),
        (0b10010, "NAV_VTOL_LAND, NAV_VTOL_TAKEOFF"),
    ],
)
def test_ardupilot_does_not_arm_without_what_arming_mis_items_asks_for(
    bits: int, missing: str
) -> None:
    made = mission(takeoff(20), waypoint(100, 20), rtl())
    found = of("M116", made, Autopilot.ARDUPILOT, f"ARMING_MIS_ITEMS,{bits}\n")
    assert len(found) == bool(missing)
    if missing:
        assert f"without {missing}: ARMING_MIS_ITEMS" in found[0].message


@pytest.mark.parametrize(
    ("metres", "parameters", "fires"),
    [
        (299.0, "", False),
        (301.0, "", True),
        (301.0, "RALLY_LIMIT_KM,0.5\n", False),
        (9000.0, "RALLY_LIMIT_KM,0\n", False),
    ],
)
def test_a_rally_point_near_home_satisfies_arming_mis_items(
    metres: float,
    parameters: str,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    point = RallyPoint(latitude_deg=north(-metres), longitude_deg=8.0, height_above_home_m=20.0)
    made = replace(mission(takeoff(20), waypoint(100, 20), rtl()), rally=(point,))
    found = of("M116", made, Autopilot.ARDUPILOT, f"ARMING_MIS_ITEMS,32\n{parameters}")
    assert len(found) == fires


@pytest.mark.parametrize("items", [(LAND,), (speed(5.0), LAND)])
def test_a_mission_that_begins_with_a_landing_is_no_flight(items: tuple[MissionItem, ...]) -> None:
    """PX4 refuses it by name (navigator_mis_starts_w_landing)."""
    [finding] = of("M108", mission(*items, takeoff(20), waypoint(100, 20)), Autopilot.PX4)
    assert finding.severity is Severity.ERROR
    assert of("M108", mission(takeoff(20), waypoint(50, 20), *items), Autopilot.PX4) == []


@pytest.mark.parametrize(("metres", "fires"), [(899.0, False), (901.0, True)])
def test_a_first_place_beyond_mis_dist_1wp_is_told(
    metres: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made = mission(waypoint(metres, 20), waypoint(0, 20), rtl())
    found = of("M104", made, Autopilot.PX4, "MIS_DIST_1WP,900\n")
    assert [(f.severity, f.item) for f in found] == [(Severity.WARNING, 1)] * fires
    refused = of("M104", made, Autopilot.PX4, "MIS_DIST_1WP,900\n", target=TARGETS["px4-1.15"])
    assert [f.severity for f in refused] == [Severity.ERROR] * fires
    assert of("M104", made, Autopilot.PX4, "MIS_DIST_1WP,0\n") == []
    assert of("M104", made, Autopilot.ARDUPILOT) == []


@pytest.mark.parametrize(
    ("metres", "ardupilot", "px4"),
    [
        (9_990.0, None, None),
        (10_010.0, Severity.WARNING, None),
        (99_900.0, Severity.WARNING, None),
        (100_100.0, Severity.ERROR, Severity.ERROR),
    ],
)
def test_a_home_nowhere_near_the_mission_is_told(
    metres: float, ardupilot: Severity | None, px4: Severity | None
) -> None:
    # 111,185 m to a degree of latitude north of 47°, to 0.05 %.
    places = [item(16, 47.0 + share * metres / 111_185.0, 20.0) for share in (1.0, 1.01)]
    made = mission(takeoff(20), *places, rtl())
    for autopilot, severity in ((Autopilot.ARDUPILOT, ardupilot), (Autopilot.PX4, px4)):
        found = of("M124", made, autopilot)
        assert [f.severity for f in found] == ([] if severity is None else [severity])


@pytest.mark.parametrize(("metres", "fires"), [(50.0, True), (49.96, True), (49.94, False)])
def test_a_gate_at_the_next_waypoint_is_never_passed(
    metres: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # Flown by 1.17: at the place of the next waypoint it hovers there for ever, 10 cm before it is passed.
    gate = item(GATE, north(metres), 20.0)
    made = mission(takeoff(20), waypoint(20, 20), gate, waypoint(50, 20), rtl())
    found = of("M119", made, Autopilot.PX4)
    assert [(f.severity, f.item) for f in found] == [(Severity.ERROR, 3)] * fires
    # Another gate between is no place.
    other = item(GATE, north(30.0), 20.0)
    made = mission(takeoff(20), gate, other, waypoint(50, 20), rtl())
    assert [f.item for f in of("M119", made, Autopilot.PX4)] == [2] * fires


def test_a_gate_at_the_waypoint_before_it_is_passed_at_once() -> None:
    # Flown by 1.17 (60.1 s predicted, 61.0 s flown): it takes the mission, and passes the gate.
    gate = item(GATE, north(50.0), 20.0)
    made = mission(takeoff(20), waypoint(50, 20), gate, gate, waypoint(100, 20), rtl())
    assert not of("M119", made, Autopilot.PX4)


@pytest.mark.parametrize(
    ("items", "fires"),
    [
        ((LAND_START, LAND), False),
        ((LAND_START, waypoint(50, 20), rtl()), False),
        ((waypoint(50, 20), LAND_START, waypoint(60, 20)), True),
        ((LAND, LAND_START), True),
    ],
)
def test_a_landing_sequence_without_a_landing_is_warned_of(
    items: tuple[MissionItem, ...],
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made = mission(takeoff(20), waypoint(100, 20), *items)
    assert len(of("M106", made, Autopilot.ARDUPILOT)) == fires


@pytest.mark.parametrize(
    ("east_m", "parameters", "fires"),
    [
        (299.0, "", False),
        (301.0, "", True),
        (301.0, "RALLY_LIMIT_KM,0.5\n", False),
        (9000.0, "RALLY_LIMIT_KM,0\n", False),
    ],
)
def test_a_rally_point_that_ardupilot_never_uses_is_warned_of(
    east_m: float,
    parameters: str,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # A degree of longitude at 47° has 76,055 m on WGS 84: off the end of the leg at home, which is
    # nearer than the rally point from everywhere.
    point = RallyPoint(
        latitude_deg=north(0), longitude_deg=8.0 + east_m / 76055.0, height_above_home_m=20.0
    )
    made = replace(mission(takeoff(20), waypoint(500, 20), rtl()), rally=(point,))
    assert len(of("M118", made, Autopilot.ARDUPILOT, parameters)) == fires
    assert of("M118", made, Autopilot.PX4) == []


@pytest.mark.parametrize(("north_m", "fires"), [(801.0, True), (799.0, False)])
def test_a_rally_point_beyond_the_limit_is_not_used_though_home_is_farther(
    north_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    """300 m on from the landing at 500 m."""
    point = RallyPoint(latitude_deg=north(north_m), longitude_deg=8.0, height_above_home_m=20.0)
    land = item(21, north(500), 0.0)
    made = replace(mission(takeoff(20), waypoint(500, 20), land), rally=(point,))
    assert len(of("M118", made, Autopilot.ARDUPILOT)) == fires


@pytest.mark.parametrize(("radius_m", "fires"), [(30.0, True), (240.0, False)])
def test_a_rally_point_is_looked_for_from_the_far_side_of_a_circle(
    radius_m: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    """500 m north, beyond the limit of 300 m from the centre at 100 m, which is nearer to home.

    The far side of the wide circle is 160 m from it and 340 m from home.
    """
    point = RallyPoint(latitude_deg=north(500), longitude_deg=8.0, height_above_home_m=20.0)
    circle = item(18, north(100), 20.0, params=(1.0, 0.0, radius_m, 0.0))
    made = replace(mission(takeoff(20), circle, rtl()), rally=(point,))
    assert len(of("M118", made, Autopilot.ARDUPILOT)) == fires


@pytest.mark.parametrize(("commanded", "fires"), [(12.0, False), (12.1, True)])
def test_a_speed_that_px4_does_not_fly_is_warned_of(
    commanded: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made = mission(takeoff(20), speed(commanded), waypoint(500, 20), rtl())
    found = of("T103", made, Autopilot.PX4)
    assert [(f.severity, f.item) for f in found] == [(Severity.WARNING, 2)] * fires
    assert of("T103", made, Autopilot.PX4, "MPC_XY_VEL_MAX,13\n") == []


@pytest.mark.parametrize(("commanded", "fires"), [(0.09, True), (0.1, False)])
def test_a_speed_that_ardupilot_does_not_take_is_an_error(commanded: float, *, fires: bool) -> None:
    made = mission(takeoff(20), speed(commanded), waypoint(5, 20), rtl())
    found = of("T103", made, Autopilot.ARDUPILOT)
    assert [(f.severity, f.item) for f in found] == [(Severity.ERROR, 2)] * fires


@pytest.mark.parametrize(("wind_m_s", "fires"), [(8.0, False), (8.1, True)])
def test_wind_above_com_wind_max_is_warned_of(
    wind_m_s: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    made, wind = mission(takeoff(20), waypoint(500, 20), rtl()), Wind(speed_m_s=wind_m_s)
    assert len(of("W104", made, Autopilot.PX4, "COM_WIND_MAX,8\n", wind=wind)) == fires
    assert of("W104", made, Autopilot.PX4, wind=wind) == []


@pytest.mark.parametrize(("wind_m_s", "fires"), [(6.9, False), (7.1, True)])
@pytest.mark.parametrize("autopilot", [Autopilot.STEP, Autopilot.ARDUPILOT, Autopilot.PX4])
def test_wind_near_the_highest_speed_of_a_model_is_an_error(
    autopilot: Autopilot,
    wind_m_s: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    """0.7 of the 10 m/s that the article's vehicle was identified up to."""
    box = replace(OF[autopilot].valid_for, speed_m_s=Interval(low=0.0, high=10.0))
    made = mission(takeoff(100), waypoint(500, 100), rtl())
    result = check(
        made,
        replace(OF[autopilot], valid_for=box),
        battery=Battery(capacity_wh=170.0),
        wind=Wind(speed_m_s=wind_m_s),
    )
    found = [one for one in result.findings if one.code == "W103"]
    assert [finding.severity for finding in found] == [Severity.ERROR] * fires


def test_an_endless_jump_round_nothing_is_told_as_what_it_is() -> None:
    made = mission(takeoff(20), waypoint(50, 20), speed(3.0), jump(3, -1.0), rtl())
    [finding] = of("M121", made, Autopilot.ARDUPILOT)
    assert (finding.severity, finding.item) == (Severity.ERROR, 4)
    assert of("T101", made, Autopilot.ARDUPILOT) == []
    flies = mission(takeoff(20), waypoint(50, 20), jump(2, -1.0), rtl())
    assert of("M121", flies, Autopilot.ARDUPILOT) == []
    assert of("T101", flies, Autopilot.ARDUPILOT)


def test_a_landing_at_a_height_is_told_only_where_it_is_asked_for() -> None:
    made = mission(takeoff(20), waypoint(50, 20), item(21, HOME.latitude_deg, 12.0))
    assert of("M120", made, Autopilot.ARDUPILOT) == []
    for selection in (Selection(extend_select=("M120",)), Selection(select=("M",))):
        assert len(of("M120", made, Autopilot.ARDUPILOT, selection=selection)) == 1
    level = mission(takeoff(20), waypoint(50, 20), LAND)
    asked = Selection(extend_select=("M120",))
    assert of("M120", level, Autopilot.ARDUPILOT, selection=asked) == []


def test_a_speed_that_px4_does_not_fly_is_not_held_against_the_model() -> None:
    """The model was identified up to MPC_XY_VEL_MAX, which is what is flown."""
    made = mission(takeoff(20), speed(25.0), waypoint(500, 20), rtl())
    assert not any("flown" in f.message for f in of("E105", made, Autopilot.PX4))
    assert any("m/s flown" in f.message for f in of("E105", made, Autopilot.ARDUPILOT))


def test_ardupilot_does_not_start_a_mission_without_a_take_off_on_the_ground() -> None:
    made = mission(waypoint(50, 20), rtl())
    [finding] = of("M101", made, Autopilot.ARDUPILOT)
    assert "on the ground ArduPilot does not start it" in finding.message
    assert "ArduPilot" not in of("M101", made, Autopilot.PX4)[0].message


def test_altitudes_amsl_over_an_unknown_home_are_no_go() -> None:
    home = replace(HOME, altitude_amsl_m=None)
    made = mission(takeoff(20), item(16, north(100), 15.0, frame=0), rtl(), home=home)
    [finding] = of("A105", made, Autopilot.ARDUPILOT)
    assert finding.severity is Severity.ERROR


def test_a_target_decides_whose_rules_count_for_reference_steps() -> None:
    made = mission(takeoff(100), item(82, north(100), 100.0, params=(0.0,) * 4), rtl())
    assert of("M105", made, Autopilot.STEP) == []  # ArduPilot takes it, and alone may fly it
    refused = of("M105", made, Autopilot.STEP, target=TARGETS["px4-1.16"])
    assert [finding.severity for finding in refused] == [Severity.ERROR]
    assert of("M105", made, Autopilot.STEP, target=TARGETS["arducopter-4.6"]) == []


_WAIT = item(112, params=(5.0, 0.0, 0.0, 0.0), frame=2)
_SPLINE = item(82, north(100), 20.0, params=(0.0,) * 4)
_PLACES = (takeoff(20), waypoint(100, 20))
_ROW = TEXT_NO_HOME_ROW.finding("the first row is not home", item=1)
_HOMELESS: dict[str, Any] = {"file_format": MissionFormat.WPL, "findings": (_ROW,)}


# Neither the file nor --target says who flies it: what one of both does not fly is an error until that is
# said, but of one that refuses the upload, which shows at the desk.
@pytest.mark.parametrize(
    ("code", "made", "by_px4", "by_ardupilot"),
    [
        ("M101", mission(waypoint(50, 20), rtl()), False, True),
        ("M101", mission(*_PLACES, takeoff(30), rtl()), True, False),
        ("M105", mission(*_PLACES, _WAIT, rtl()), True, False),
        ("M128", mission(takeoff(2.9), waypoint(100, 20), rtl()), True, False),
        ("M129", replace(mission(*_PLACES, rtl()), **_HOMELESS), False, True),
    ],
)
def test_what_one_autopilot_does_not_fly_is_an_error_until_one_is_named(
    code: str, made: Mission, *, by_px4: bool, by_ardupilot: bool
) -> None:
    for by, is_refused in ((Autopilot.PX4, by_px4), (Autopilot.ARDUPILOT, by_ardupilot)):
        named = of(code, made, Autopilot.STEP, target=Target(autopilot=by))
        assert any(one.severity is Severity.ERROR for one in named) is is_refused
    [unnamed] = of(code, made, Autopilot.STEP)
    assert unnamed.severity is Severity.ERROR
    assert unnamed.message.endswith(f"; {NAME_IT}")
    foreign = replace(made, file_format=MissionFormat.FOREIGN, findings=())
    assert all(one.severity < Severity.ERROR for one in of(code, foreign, Autopilot.STEP))


@pytest.mark.parametrize(
    ("items", "codes"),
    [
        ((*_PLACES, _SPLINE, rtl()), []),
        ((takeoff(3.0), waypoint(100, 20), rtl()), []),
        # PX4 refuses the spline; ArduPilot, which would take it, does not start or refuses the place.
        ((_SPLINE, rtl()), ["M101"]),
        ((*_PLACES, replace(_SPLINE, param4=None), rtl()), ["M105", "M112"]),
        ((*_PLACES, _SPLINE, *(waypoint(100, 20),) * 645, rtl()), []),
        ((*_PLACES, _SPLINE, *(waypoint(100, 20),) * 646, rtl()), ["M126"]),
        ((*_PLACES, *(waypoint(100, 20),) * 647, rtl()), []),
    ],
)
def test_an_autopilot_that_refuses_the_upload_is_not_the_one_that_flies(
    items: tuple[MissionItem, ...], codes: list[str]
) -> None:
    checked = check(mission(*items), STEP, battery=Battery(capacity_wh=170.0))
    told = [one for one in checked.findings if one.severity is Severity.ERROR]
    assert sorted(one.code for one in told if one.code[0] == "M") == codes
    assert not any("name who flies it" in one.message for one in told)


@pytest.mark.parametrize(
    ("count", "severity", "holds"),
    [
        (500, None, ""),
        (501, None, ""),  # ArduPilot holds them
        (649, None, ""),
        (
            650,
            Severity.WARNING,
            "PX4 holds 500 without an SD card, ArduPilot holds 649 beside home",
        ),
        (
            2000,
            Severity.WARNING,
            "PX4 holds 500 without an SD card, ArduPilot holds 649 beside home",
        ),
        (2001, Severity.ERROR, "PX4 holds 2000, ArduPilot holds 649 beside home"),
    ],
)
def test_more_items_than_either_autopilot_holds_are_told_where_neither_is_named(
    count: int, severity: Severity | None, holds: str
) -> None:
    made = mission(*_PLACES, *(waypoint(100, 20),) * (count - 3), rtl())
    found = [(one.severity, one.message) for one in of("M126", made, Autopilot.STEP)]
    assert found == ([] if severity is None else [(severity, f"{count} items; {holds}")])


# Asked of PX4, of ArduPilot, or of both where neither is named; of neither for another maker's file.
_ASKED = {
    "M104": "P",
    "M105": "PA",
    "M112": "A",
    "M118": "PA",
    "M119": "P",
    "M128": "P",
    "M129": "A",
}


def test_what_both_autopilots_were_asked_is_checked() -> None:
    made = mission(*_PLACES, rtl())
    by_upload = mission(*_PLACES, _SPLINE, rtl())  # PX4 refuses it: who is left is asked alone
    foreign = replace(made, file_format=MissionFormat.FOREIGN)
    for one, asked in ((made, "PA"), (by_upload, "A"), (foreign, "")):
        outcomes = outcomes_of(one, STEP)
        checked = {code for code in _ASKED if outcomes[code] is Outcome.CHECKED}
        assert checked == {code for code, by in _ASKED.items() if set(by) & set(asked)}
    assumed = replace(COPTER, reference_assumed=True)
    assert outcomes_of(made, COPTER)["M128"] is Outcome.NOT_APPLICABLE
    assert outcomes_of(made, assumed)["M128"] is Outcome.CHECKED


def outcomes_of(made: Mission, vehicle: VehicleModel) -> dict[str, Outcome]:
    checked = check(made, vehicle, battery=Battery(capacity_wh=170.0)).checked
    return {entry.code: entry.outcome for entry in checked}


def test_a_target_decides_which_commands_are_known() -> None:
    arc = 36
    for version, answer in (((4, 6), Support.REFUSED), ((4, 7), Support.ACCEPTED)):
        assert support(arc, Autopilot.ARDUPILOT, version=version) is answer
    assert support(arc, Autopilot.ARDUPILOT) is Support.UNKNOWN


def test_the_target_of_another_autopilot_is_a_mistake() -> None:
    made = mission(takeoff(20), waypoint(50, 20), rtl())
    with pytest.raises(UsageError, match=r"PX4 1\.16.*flown as ArduPilot"):
        of("M105", made, Autopilot.ARDUPILOT, target=TARGETS["px4-1.16"])


def test_every_event_of_px4_is_told_by_a_rule_there_is() -> None:
    assert set(PX4_EVENTS.values()) <= set(catalogue.rules())


@pytest.mark.parametrize(
    ("jumps", "repeats", "severity"),
    [
        (15, 1.0, None),
        (16, 1.0, Severity.WARNING),
        (100, 1.0, Severity.WARNING),
        (101, 1.0, Severity.ERROR),
        (16, 0.0, Severity.WARNING),  # counted, though never taken
    ],
)
def test_more_jumps_than_ardupilot_counts_are_told(
    jumps: int, repeats: float, severity: Severity | None
) -> None:
    # Items 2, 4, 6 … are waypoints, each followed by a jump back to it.
    pairs = [
        one
        for number in range(jumps)
        for one in (waypoint(10.0 + number, 20), jump(2 + 2 * number, repeats))
    ]
    found = of("M125", mission(takeoff(20), *pairs, rtl()), Autopilot.ARDUPILOT)
    assert [finding.severity for finding in found] == [severity] * (severity is not None)
    if found:
        assert found[0].item == 33  # the sixteenth
        most = "15 on small boards" if severity is Severity.WARNING else "100"
        assert found[0].message == f"{jumps} jumps with a count; ArduPilot takes at most {most}"
    assert of("M125", mission(takeoff(20), *pairs, rtl()), Autopilot.PX4) == []


# fmt: off
BEFORE_TAKEOFF = {
    93: True, 178: True, 179: True, 189: True, 195: True, 197: True, 206: True, 530: True, 1000: True,
    187: False, 211: False, 42600: False, 16: False, 22: False,
}
# fmt: on
"""Commands tried before NAV_TAKEOFF on a build of PX4 1.17: whether it took the mission."""


@pytest.mark.parametrize(("command", "goes"), BEFORE_TAKEOFF.items())
def test_px4_takes_no_take_off_behind_what_it_counts_as_a_place(command: int, goes: bool) -> None:  # noqa: FBT001 - a table
    first = takeoff(15) if command == 22 else item(command, north(0), 15.0)
    made = mission(first, takeoff(20), waypoint(100, 20), rtl())
    refused = [f for f in of("M101", made, Autopilot.PX4) if f.severity is Severity.ERROR]
    assert [f.item for f in refused] == [2] * (not goes)
    assert all("PX4 refuses" in f.message for f in refused)
    # nor does it behind a landing, which begins a second flight
    again = mission(
        takeoff(20),
        item(21, north(50), 0.0),
        takeoff(20),
        waypoint(100, 20),
        item(21, north(0), 0.0),
    )
    assert [f.item for f in of("M101", again, Autopilot.PX4)] == [3]
    assert not of("M101", again, Autopilot.ARDUPILOT)


@pytest.mark.parametrize(
    ("code", "made", "assumed", "other"),
    [
        ("M101", mission(waypoint(50, 20), rtl()), Autopilot.PX4, Autopilot.ARDUPILOT),
        ("M101", mission(*_PLACES, takeoff(30), rtl()), Autopilot.ARDUPILOT, Autopilot.PX4),
        ("M105", mission(*_PLACES, _WAIT, rtl()), Autopilot.ARDUPILOT, Autopilot.PX4),
        (
            "M128",
            mission(takeoff(2.9), waypoint(100, 20), rtl()),
            Autopilot.ARDUPILOT,
            Autopilot.PX4,
        ),
        (
            "M110",
            mission(*_PLACES, item(16, 0.0, 20.0, longitude_deg=0.0), rtl()),
            Autopilot.ARDUPILOT,
            Autopilot.PX4,
        ),
        (
            "M121",
            mission(*_PLACES, speed(3.0), jump(3, 5.0), waypoint(90, 20), rtl()),
            Autopilot.ARDUPILOT,
            Autopilot.PX4,
        ),
    ],
)
def test_an_autopilot_that_the_model_only_assumes_is_not_named(
    code: str, made: Mission, assumed: Autopilot, other: Autopilot
) -> None:
    def errors(one: Mission, *, is_assumed: bool) -> list[str]:
        vehicle = replace(OF[assumed], reference_assumed=is_assumed)
        found = check(one, vehicle, battery=Battery(capacity_wh=170.0)).findings
        return [f.message for f in found if f.code == code and f.severity is Severity.ERROR]

    assert errors(made, is_assumed=False) == []
    [message] = errors(made, is_assumed=True)
    assert message.endswith(f"; {NAME_IT}")
    for by, count in ((assumed, 0), (other, 1)):
        assert len(errors(replace(made, autopilot=by), is_assumed=True)) == count


@pytest.mark.parametrize(
    ("height_m", "version", "refuses"),
    [
        (2.9, None, True),
        (2.9, (1, 16), True),
        (3.0, (1, 16), False),
        (2.9, (1, 17), False),
        (0.2, (1, 17), False),
        (-1.0, (1, 17), True),
    ],
)
def test_from_px4_1_17_on_a_take_off_may_be_low(
    height_m: float, version: tuple[int, int] | None, *, refuses: bool
) -> None:
    made = mission(takeoff(height_m), waypoint(100, 20), rtl())
    target = Target(Autopilot.PX4, version)
    assert len(of("M128", made, Autopilot.PX4, target=target)) == refuses
