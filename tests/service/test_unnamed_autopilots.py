"""Where nobody says who flies, a go holds whoever does."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.autopilot import Autopilot, Target
from planner.findings import Severity
from planner.mission.files import read_mission_bytes
from planner.mission.takers import BOTH, NAME_IT
from planner.notation import read_battery
from planner.selection import Selection
from planner.service.preflight import CheckResult, check_mission
from planner.service.sweep.sweep import sweep
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.mission.items import Mission

STEPS, LIKE_ARDUPILOT, LIKE_PX4 = "falkowski-2023-quadrotor", "dji-f450", "holybro-x500-v2"
"""One of reference steps, and two that only assume who flies them."""
ORDINARY = ("3 22 0 0 0 0 47.4 8.5 20", "3 16 0 0 0 nan 47.4 8.5013286 20")
PLACE, RETURN = "3 16 0 0 0 nan 47.4008993 8.5013286 20", "2 20 0 0 0 0 0 0 0"
FLOWN_OTHERWISE = {
    "a loop without end on PX4": (*ORDINARY, PLACE, "2 177 2 -2 0 0 0 0 0", RETURN),
    "rounds that PX4 counts to 65,535": (*ORDINARY, PLACE, "2 177 2 40000 0 0 0 0 0", RETURN),
    "a time of day": (*ORDINARY, "2 93 -1 14 30 0 0 0 0", PLACE, RETURN),
    "a hold below 0": (ORDINARY[0], "3 19 -60 0 0 0 47.4 8.5013286 20", PLACE, RETURN),
    "a home in whole degrees": (*ORDINARY, "2 179 0 0 0 0 47.4 8.5006643 488", PLACE, RETURN),
    "a climb that PX4 flies as the speed": (
        *ORDINARY,
        "2 178 2 0.5 -1 0 0 0 0",
        "3 16 0 0 0 nan 47.4089932 8.5013286 100",
        RETURN,
    ),
    "a queue that ArduPilot drops": (
        *ORDINARY,
        "2 178 1 0.3 -1 0 0 0 0",
        "2 178 1 8 -1 0 0 0 0",
        ORDINARY[1],
        "3 16 0 0 0 nan 47.4179864 8.5013286 20",
        RETURN,
    ),
    "a load that is carried on": (
        *ORDINARY,
        "3 94 1 -1 0 0 47.4004497 8.5013286 20",
        PLACE,
        RETURN,
    ),
}
MAKES_NO_DIFFERENCE = (
    PLACE,
    "3 16 3 0 0 nan 47.4004 8.5013286 30",
    "3 19 10 0 0 0 47.4004 8.501 25",
    "2 178 1 4 -1 0 0 0 0",
    "2 201 0 0 0 0 47.4 8.5 0",
    "2 206 20 0 0 0 0 0 0",
)


def mission_of(*rows: str) -> Mission:
    """Return a text mission, whose file does not say who flies it."""
    lines = ["QGC WPL 110", "0 1 0 16 0 0 0 0 47.4 8.5 488 1"]
    lines += [f"{number} 0 {row} 1" for number, row in enumerate(rows, start=1)]
    return read_mission_bytes("\n".join(lines).replace(" ", "\t").encode(), source="a.waypoints")


@cache
def flown_by(name: str) -> Setup:
    battery = read_battery("4S5000") if name == STEPS else None
    return Setup(vehicle=load_vehicle(name), battery=battery)


def checked(mission: Mission, name: str, by: Autopilot | None = None) -> CheckResult:
    """Return the check of a mission by a model, with an autopilot named or none."""
    setup = flown_by(name)
    if by is not None and name == STEPS:
        setup = replace(setup, target=Target(autopilot=by))
    elif by is not None:
        setup = replace(setup, autopilot=by)
    return check_mission(mission, setup)


@pytest.mark.parametrize("name", [STEPS, LIKE_ARDUPILOT, LIKE_PX4])
@pytest.mark.parametrize("rows", FLOWN_OTHERWISE.values(), ids=FLOWN_OTHERWISE)
def test_what_one_of_both_does_not_fly_is_no_go(rows: tuple[str, ...], name: str) -> None:
    mission = mission_of(*rows)
    named = {by: checked(mission, name, by).verdict for by in BOTH}
    assert "no-go" in named.values()
    assert checked(mission, name).verdict == "no-go"


@pytest.mark.parametrize("name", [STEPS, LIKE_ARDUPILOT, LIKE_PX4])
def test_an_ordinary_mission_is_go_whoever_flies_it(name: str) -> None:
    mission = mission_of(*ORDINARY, *MAKES_NO_DIFFERENCE, RETURN)
    for by in (None, *BOTH):
        assert checked(mission, name, by).verdict == "go"


def test_what_the_file_commands_is_asked_of_the_other_at_another_speed_too() -> None:
    mission = mission_of(*FLOWN_OTHERWISE["a climb that PX4 flies as the speed"])
    asked = replace(flown_by(LIKE_ARDUPILOT), speed_m_s=8.0)
    errors = [
        one for one in check_mission(mission, asked).findings if one.severity is Severity.ERROR
    ]
    assert "at the speeds of the file, which are flown" in errors[0].message
    assert "flown by PX4" in errors[0].message


@pytest.mark.parametrize("vary", ["speed=4,8", "charge=0.9,0.95"])
def test_no_case_of_a_sweep_is_go_that_one_of_both_does_not_fly(vary: str) -> None:
    mission = mission_of(*FLOWN_OTHERWISE["a hold below 0"])
    found = sweep(mission, flown_by(LIKE_PX4), vary=[vary])
    assert list(found.columns()["verdict"]) == ["no-go", "no-go"]


def test_who_does_not_fly_it_is_told_and_what_to_do() -> None:
    mission = mission_of(*FLOWN_OTHERWISE["a time of day"])
    [one] = [one for one in checked(mission, LIKE_PX4).findings if one.severity is Severity.ERROR]
    assert one.message == (
        f"waits in the air until 14:30:00 UTC: not counted (flown by ArduPilot); {NAME_IT}"
    )


def test_a_warning_of_one_of_both_decides_where_warnings_do() -> None:
    # PX4 flies no faster than MPC_XY_VEL_MAX, ArduPilot as fast as it is told: T103 is of PX4 alone.
    mission = mission_of(*ORDINARY, "2 178 1 40 -1 0 0 0 0", PLACE, RETURN)
    strict = replace(
        flown_by(LIKE_ARDUPILOT), fail_on=Severity.WARNING, selection=Selection(ignore=("L150",))
    )
    by_px4, by_ardupilot = (
        check_mission(mission, replace(strict, autopilot=by)).verdict for by in BOTH
    )
    assert (by_px4, by_ardupilot) == ("no-go", "go")
    unnamed = check_mission(mission, strict)
    assert unnamed.verdict == "no-go"
    assert [one.code for one in unnamed.findings if one.severity is Severity.WARNING] == ["T103"]
    assert check_mission(mission, replace(strict, fail_on=Severity.ERROR)).verdict == "go"


@pytest.mark.parametrize("fail_on", [Severity.ERROR, Severity.WARNING])
def test_a_warning_that_is_turned_off_hides_no_error_of_the_other(fail_on: Severity) -> None:
    # PX4 does not hold and says so; ArduPilot holds for 65,476 s, which no selection turns off.
    mission = mission_of(ORDINARY[0], "3 16 -60 0 0 nan 47.4 8.5013286 20", PLACE, RETURN)
    quiet = Selection(ignore=("T102", "L150"))
    asked = replace(flown_by(LIKE_PX4), fail_on=fail_on, selection=quiet)
    assert check_mission(mission, replace(asked, autopilot=Autopilot.PX4)).verdict == "go"
    found = check_mission(mission, asked)
    assert [one.code for one in found.findings if one.severity is Severity.ERROR] == ["T102"]


def test_who_refuses_the_upload_is_nobody_to_name() -> None:
    # PX4 takes no PAYLOAD_PLACE: ArduPilot flies it, and carries the load on
    mission = mission_of(*FLOWN_OTHERWISE["a load that is carried on"])
    [one] = [one for one in checked(mission, STEPS).findings if one.code == "T122"]
    assert one.message.endswith("(flown by ArduPilot)")


@settings(max_examples=examples(10), deadline=None)
@given(
    rows=st.lists(
        st.sampled_from(
            sorted({row for rows in FLOWN_OTHERWISE.values() for row in rows[1:-1]})
            + list(MAKES_NO_DIFFERENCE)
        ),
        min_size=1,
        max_size=5,
    ),
    name=st.sampled_from([STEPS, LIKE_ARDUPILOT, LIKE_PX4]),
)
def test_a_go_holds_whoever_flies(rows: list[str], name: str) -> None:
    mission = mission_of(ORDINARY[0], *rows, PLACE, RETURN)
    unnamed = checked(mission, name)
    assert unnamed.assessment is not None
    if unnamed.verdict == "go":
        for by in unnamed.assessment.may_fly:
            assert checked(mission, name, by).verdict == "go"
