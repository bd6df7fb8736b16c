"""What each command does to the flight is what its class says, for every command there is."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
from pymavlink.dialects.v20 import ardupilotmega, common

import planner
from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.mission.commands import (
    EFFECTS,
    Command,
    CommandEffect,
    Support,
    command_effect,
    command_name,
    load_command_table,
    support,
)
from planner.mission.route.route import make_route
from planner.mission.route.stage import FenceAction, Route, StageKind
from planner.mission.route.state import VehicleHabits
from planner.values import replace
from planner.vehicle.parameters.files import ParameterSet, ParameterValue

if TYPE_CHECKING:
    from planner.mission.items import MissionItem

DIALECTS = {
    number: entry.name.removeprefix("MAV_CMD_")
    for dialect in (common, ardupilotmega)
    for number, entry in dialect.enums["MAV_CMD"].items()
    if not entry.name.endswith("_ENUM_END")
}
"""Every command of both dialects, by pymavlink."""
TAKEOFF, LEG = takeoff(20.0), waypoint(300.0, 40.0)

FLOWN = {
    Command.NAV_WAYPOINT: (item(16, north(100), 30.0), StageKind.GO),
    Command.NAV_SPLINE_WAYPOINT: (item(82, north(100), 30.0), StageKind.SPLINE),
    Command.NAV_LOITER_UNLIM: (item(17, north(100), 30.0), StageKind.LOITER),
    Command.NAV_LOITER_TIME: (
        item(19, north(100), 30.0, params=(9.0, 0.0, 0.0, 0.0)),
        StageKind.LOITER,
    ),
    Command.NAV_LOITER_TURNS: (
        item(18, north(100), 30.0, params=(2.0, 0.0, 9.0, 0.0)),
        StageKind.CIRCLE,
    ),
    Command.NAV_LOITER_TO_ALT: (item(31, north(100), 30.0), StageKind.CHANGE_HEIGHT),
    Command.NAV_RETURN_TO_LAUNCH: (rtl(), StageKind.RETURN),
    Command.NAV_LAND: (item(21, north(100), 0.0), StageKind.LAND),
    Command.NAV_TAKEOFF: (item(22, north(0), 30.0), StageKind.TAKEOFF),
    Command.NAV_DELAY: (item(93, params=(9.0, -1.0, -1.0, -1.0), frame=2), StageKind.DELAY),
}
CHANGING = {
    Command.DO_CHANGE_SPEED: item(178, params=(1.0, 3.0, -1.0, 0.0), frame=2),
    Command.DO_SET_HOME: item(179, north(50), 400.0, frame=0),
}
"""Commands that change the stages behind them."""
FLOWN_AS_MULTICOPTERS = {Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND}
"""ArduCopter takes them for a take-off and a landing."""
JUMPING = {Command.DO_JUMP, Command.JUMP_TAG, Command.DO_JUMP_TAG}


def flown(*items: MissionItem, dialect: Autopilot | None = Autopilot.ARDUPILOT) -> Route:
    return make_route(mission(*items), dialect=dialect)


def findings(route: Route, code: str) -> list[str]:
    return [finding.message for finding in route.findings if finding.code == code]


def test_every_command_is_in_one_class() -> None:
    named = Counter(name for names in EFFECTS.values() for name in names.split())
    assert [name for name, times in named.items() if times > 1] == []
    assert set(named) <= set(DIALECTS.values())
    assert CommandEffect.NOT_MODELLED not in EFFECTS  # which is what every other one is
    by_name = {name: effect for effect, names in EFFECTS.items() for name in names.split()}
    for number, name in DIALECTS.items():
        assert command_effect(number) is by_name.get(name, CommandEffect.NOT_MODELLED)


def test_every_modelled_command_has_a_case_here() -> None:
    modelled = {n for n in DIALECTS if command_effect(n) is CommandEffect.MODELLED}
    assert modelled == FLOWN.keys() | CHANGING.keys() | JUMPING | {Command.DO_FENCE_ENABLE}


@pytest.mark.parametrize("command", sorted(FLOWN))
def test_a_modelled_command_is_a_stage_of_its_own_kind(command: Command) -> None:
    one, kind = FLOWN[command]
    route = flown(TAKEOFF, one, LEG, rtl())
    assert [stage.kind for stage in route.stages if stage.item == 2] == [kind]
    assert findings(route, "T102") == []


@pytest.mark.parametrize("command", sorted(CHANGING))
def test_a_modelled_command_without_a_stage_changes_those_behind_it(command: Command) -> None:
    behind = flown(TAKEOFF, CHANGING[command], LEG, rtl()).stages[1:]
    without = flown(TAKEOFF, item(206, frame=2), LEG, rtl()).stages[1:]
    assert [stage.item for stage in behind] == [stage.item for stage in without]
    assert behind != without


def test_jumps_by_id_and_by_tag_lead_back() -> None:
    by_id = item(177, params=(2.0, 1.0, 0.0, 0.0), frame=2)
    assert flown(TAKEOFF, LEG, by_id, rtl()).reached == (1, 2, 3, 2, 3, 4)
    tag = item(600, params=(7.0, 0.0, 0.0, 0.0), frame=2)
    by_tag = item(601, params=(7.0, 1.0, 0.0, 0.0), frame=2)
    assert flown(TAKEOFF, tag, LEG, by_tag, rtl()).reached == (1, 2, 3, 4, 2, 3, 4, 5)


def test_switches_of_the_fence_count_from_the_next_stage() -> None:
    route = flown(TAKEOFF, item(207, frame=2, params=(1.0, 0.0, 0.0, 0.0)), LEG, rtl())
    [switched] = route.fence_switches
    assert (switched.first_stage, switched.action, switched.item) == (1, FenceAction.ON, 2)


@pytest.mark.parametrize("command", sorted(DIALECTS))
def test_any_other_command_is_without_effect_or_told_with_what_is_assumed(command: int) -> None:
    effect = command_effect(command)
    if effect is CommandEffect.MODELLED:
        return
    route = flown(TAKEOFF, item(command, frame=2), LEG, rtl(), dialect=None)
    told = findings(route, "T102")
    if effect is CommandEffect.NO_EFFECT:
        assert told == []
        assert [stage.item for stage in route.stages] == [1, 3, 4]
        return
    if command not in FLOWN_AS_MULTICOPTERS:
        [message] = told
        assert command_name(command) in message
        assert "assumed" in message or "taken" in message


def test_no_command_ardupilot_takes_is_passed_over_in_silence() -> None:
    quiet = {CommandEffect.MODELLED, CommandEffect.NO_EFFECT}
    for number in load_command_table().commands:
        if support(number, Autopilot.ARDUPILOT) is not Support.ACCEPTED:
            continue
        if command_effect(number) in quiet:
            continue
        odd = item(number, north(200), 50.0, params=(1.0, 0.0, 0.0, 0.0))
        made = mission(takeoff(50), waypoint(100, 50), odd, rtl())
        found = make_route(made, dialect=Autopilot.ARDUPILOT)
        flown = any(stage.item == 3 for stage in found.stages)
        told = any(finding.item == 3 for finding in found.findings)
        assert told or flown, number


STAYS_A_WARNING = {
    "CONDITION_GATE",
    "DO_GRIPPER",
    "DO_WINCH",
    "DO_SPRAYER",
    "DO_SEND_SCRIPT_MESSAGE",
    "DO_AUX_FUNCTION",  # that does nothing, as here
    "DO_PARACHUTE",  # switched off, as here
    "DO_AUTOTUNE_ENABLE",
    "NAV_PAYLOAD_PLACE",  # flown down and up, its load is not known
    "NAV_ARC_WAYPOINT",  # of 0°, as here
}
"""The vehicle flies on as if they were not there."""


@pytest.mark.parametrize("command", [*sorted(DIALECTS), 50_001])
def test_what_is_not_modelled_is_no_go_where_the_vehicle_may_fly_otherwise(command: int) -> None:
    if command_effect(command) in {CommandEffect.MODELLED, CommandEffect.NO_EFFECT}:
        return
    if command in FLOWN_AS_MULTICOPTERS:
        return
    route = flown(TAKEOFF, item(command, frame=2), LEG, rtl(), dialect=None)
    [finding] = [one for one in route.findings if one.code == "T102"]
    is_warning = DIALECTS.get(command) in STAYS_A_WARNING
    assert finding.severity is (Severity.WARNING if is_warning else Severity.ERROR)


@pytest.mark.parametrize(
    ("does", "flies_on"), [(0.0, True), (1.0, True), (2.0, False), (None, False)]
)
def test_a_parachute_is_no_go_where_it_is_released(does: float | None, *, flies_on: bool) -> None:
    chute = item(208, frame=2, params=(does, 0.0, 0.0, 0.0))
    route = flown(TAKEOFF, chute, LEG, rtl(), dialect=Autopilot.ARDUPILOT)
    [finding] = [one for one in route.findings if one.code == "T102"]
    assert (finding.severity is Severity.WARNING) is flies_on


@pytest.mark.parametrize("function", range(200))
def test_an_auxiliary_function_is_no_go_but_for_what_the_vehicle_carries(function: int) -> None:
    # AUX_FUNC of RC_Channel.h: trigger, sprayer, gripper, mounts, relays, gear, sound, winch, video, log …
    carried = {0, 9, 15, 19, 27, 28, 29, 30, *range(34, 37), 44, 45, 66, 67, 94, 102, 113, 163, 164}
    carried |= {*range(166, 170), 171, 174, 175, 177}
    calls = item(218, frame=2, params=(float(function), 2.0, 0.0, 0.0))
    route = flown(TAKEOFF, calls, LEG, rtl(), dialect=Autopilot.ARDUPILOT)
    [finding] = [one for one in route.findings if one.code == "T102"]
    assert (finding.severity is Severity.WARNING) is (function in carried)


@pytest.mark.parametrize(
    ("angle_deg", "severity"), [(0.0, Severity.WARNING), (-90.0, Severity.ERROR)]
)
def test_an_arc_flown_straight_is_no_go(angle_deg: float, severity: Severity) -> None:
    arc = item(36, north(100), 30.0, params=(angle_deg, 0.0, 0.0, 0.0))
    found = make_route(mission(TAKEOFF, arc, rtl()), dialect=Autopilot.ARDUPILOT).findings
    assert [one.severity for one in found if one.code == "T102"] == [severity]


def test_what_the_autopilot_skips_is_no_go_only_where_it_is_not_known_who_flies() -> None:
    go_around = item(191, frame=2, params=(0.0, 0.0, 0.0, 0.0))
    for dialect, severity in ((Autopilot.ARDUPILOT, Severity.WARNING), (None, Severity.ERROR)):
        found = make_route(mission(TAKEOFF, go_around, LEG, rtl()), dialect=dialect).findings
        assert [one.severity for one in found if one.code == "T102"] == [severity]


WITHOUT_MOTION = {
    Autopilot.ARDUPILOT: {
        # "do-commands always return true for verify"
        "AP_Mission::verify_command": """
            DO_SET_RELAY DO_REPEAT_RELAY DO_SET_SERVO DO_REPEAT_SERVO DO_DIGICAM_CONFIGURE
            DO_DIGICAM_CONTROL DO_SET_CAM_TRIGG_DIST DO_SET_RESUME_REPEAT_DIST
            DO_GIMBAL_MANAGER_PITCHYAW IMAGE_START_CAPTURE IMAGE_STOP_CAPTURE VIDEO_START_CAPTURE
            VIDEO_STOP_CAPTURE SET_CAMERA_ZOOM SET_CAMERA_FOCUS SET_CAMERA_SOURCE
        """,
        # "do commands (always return true)"; a place to look at turns the vehicle, not its way
        "ModeAuto::verify_command": """
            DO_SET_ROI DO_SET_ROI_LOCATION DO_SET_ROI_NONE DO_MOUNT_CONTROL DO_GUIDED_LIMITS
            DO_LAND_START DO_RETURN_PATH_START
        """,
        # They hold back the DO_ commands behind them, not the navigation command that is flown.
        "AP_Mission::advance_current_do_cmd": "CONDITION_DELAY CONDITION_DISTANCE CONDITION_YAW",
    },
    Autopilot.PX4: {
        # "Action Commands that doesn't have timeout completes instantaneously": return true
        "MissionBlock::is_mission_item_reached_or_completed": """
            DO_SET_ACTUATOR DO_LAND_START DO_TRIGGER_CONTROL DO_DIGICAM_CONTROL IMAGE_START_CAPTURE
            IMAGE_STOP_CAPTURE VIDEO_START_CAPTURE VIDEO_STOP_CAPTURE DO_CONTROL_VIDEO
            DO_MOUNT_CONFIGURE DO_MOUNT_CONTROL DO_GIMBAL_MANAGER_CONFIGURE NAV_ROI DO_SET_ROI
            DO_SET_ROI_LOCATION DO_SET_ROI_WPNEXT_OFFSET DO_SET_ROI_NONE DO_SET_CAM_TRIGG_DIST
            OBLIQUE_SURVEY DO_SET_CAM_TRIGG_INTERVAL SET_CAMERA_MODE SET_CAMERA_FOCUS
            SET_CAMERA_SOURCE
        """,
        # Waits MIS_COMMAND_TOUT, which is 0 unless it is set.
        "MissionBlock::item_has_timeout": "DO_GIMBAL_MANAGER_PITCHYAW",
    },
}
"""Where the autopilots' sources say that a command neither moves nor holds the vehicle."""
REFUSED = {Support.REFUSED, Support.BLOCKS_ARMING}


@pytest.mark.parametrize("autopilot", WITHOUT_MOTION)
def test_every_command_is_flown_told_refused_or_without_motion_by_the_source(
    autopilot: Autopilot,
) -> None:
    still = {name for names in WITHOUT_MOTION[autopilot].values() for name in names.split()}
    frames = (2, 3) if autopilot is Autopilot.PX4 else (3,)
    for number, name in DIALECTS.items():
        if support(number, autopilot) in REFUSED:
            assert name not in still
            continue
        if command_effect(number) is CommandEffect.NO_EFFECT:
            assert name in still, f"no source says that {name} does not move {autopilot.label}"
        for frame in frames:
            if support(number, autopilot, frame=frame) in REFUSED:
                continue
            # Laps of a jump, a circle of two turns, a wait of 2 s, a speed of 3 m/s.
            first = 1.0 if number == Command.DO_CHANGE_SPEED else 2.0
            one = item(number, north(200), 55.0, params=(first, 3.0, 0.0, 0.0), frame=frame)
            tags = item(600, params=(2.0, 0.0, 0.0, 0.0), frame=2)
            route = flown(TAKEOFF, tags, one, LEG, rtl(), dialect=autopilot)
            plain = flown(TAKEOFF, tags, item(206, frame=2), LEG, rtl(), dialect=autopilot)
            told = [finding for finding in route.findings if finding.item == 3]
            has_effect = (
                # A region of interest only turns PX4, which tests/rules/test_needed_heading.py asks for.
                [replace(stage, yaw_deg=None, looks_m=None) for stage in route.stages]
                != [replace(stage, yaw_deg=None, looks_m=None) for stage in plain.stages]
                or len(route.reached) > len(plain.reached)
                or route.fence_switches != plain.fence_switches
            )
            if name in still:
                assert not told, name
                assert not has_effect, name
            else:
                # A tag is where jumps lead to: by itself it is nothing.
                assert told or has_effect or number == Command.JUMP_TAG, (name, frame)


@pytest.mark.parametrize(
    ("command", "settings", "wait_s"),
    [
        # MissionBlock::item_has_timeout: flown by PX4 with 5 s, the gimbal's item took 5.04 s.
        (1000, {"MIS_COMMAND_TOUT": 5.0}, 5.0),
        (211, {"MIS_COMMAND_TOUT": 5.0}, 5.0),
        (42600, {"MIS_COMMAND_TOUT": 5.0}, 5.0),
        (205, {"MIS_COMMAND_TOUT": 5.0}, 0.0),
        (1000, {"MIS_COMMAND_TOUT": 0.0}, 0.0),
        (211, {"MIS_PD_TO": 4.0}, 4.0),
        (1000, {"MIS_PD_TO": 4.0}, 0.0),
    ],
)
def test_px4_waits_for_what_it_carries(
    command: int, settings: dict[str, float], wait_s: float
) -> None:
    given = ParameterSet(
        source="px4.params",
        values={name: ParameterValue(value) for name, value in settings.items()},
        stack=Autopilot.PX4,
    )
    vehicle = planner.load_vehicle("px4-sih-quad")

    def time_s(*items: MissionItem) -> float:
        result = planner.check(mission(*items), vehicle, parameters=given, position_noise_m=0.0)
        assert result.totals is not None
        return result.totals.time_s

    # Before the landing the vehicle nearly stands: what is left to fly is flown within the wait.
    place, land = waypoint(60.0, 20.0), item(21, north(60), 0.0)
    moves_nothing = time_s(TAKEOFF, place, land)
    carries = time_s(TAKEOFF, place, item(command, frame=2), land)
    assert carries - moves_nothing == pytest.approx(wait_s, abs=0.05)


def test_a_wait_for_the_load_is_only_in_the_air() -> None:
    waits = {int(Command.DO_GRIPPER): 5.0}
    grip = item(211, frame=2, params=(1.0, 0.0, 0.0, 0.0))
    held = [
        make_route(
            mission(*items, rtl()),
            dialect=Autopilot.PX4,
            habits=VehicleHabits(payload_waits_s=waits),
        ).stages
        for items in ((grip, TAKEOFF, LEG), (TAKEOFF, LEG, grip))
    ]
    assert [[stage.hold_s for stage in stages] for stages in held] == [
        [0.0] * 3,
        [0.0, 0.0, 5.0, 0.0],
    ]
