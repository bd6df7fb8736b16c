"""Where each parameter of a flight comes from, and what is said about it."""

from __future__ import annotations

import math

import pytest

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import ParameterSet, parameters_from_text
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.resolve import ResolvedParameters, resolve_parameters
from planner.vehicle.parameters.table import OriginKind, Parameter, parameter_table


def file_of(text: str) -> ParameterSet:
    return parameters_from_text(text.encode(), source="vehicle.param")


def resolved(text: str, autopilot: Autopilot = Autopilot.ARDUPILOT) -> ResolvedParameters:
    return resolve_parameters(autopilot, file=file_of(text))


def messages(result: ResolvedParameters, code: str) -> list[tuple[Severity, str]]:
    return [(found.severity, found.message) for found in result.findings if found.code == code]


def test_the_file_comes_before_the_model_and_the_model_before_the_default() -> None:
    step_model = load_vehicle()
    model = replace(
        step_model,
        reference=Autopilot.ARDUPILOT,
        speed=None,
        parameters=(("WPNAV_SPEED", 800.0), ("WP_ACC", 1.5)),
    )
    values = resolve_parameters(
        Autopilot.ARDUPILOT, file=file_of("RTL_ALT,2000\nWPNAV_SPEED,500\n"), model=model
    ).values
    assert isinstance(values, ArduPilotParameters)
    assert (values.cruise_speed_m_s, values.acceleration_m_s2) == (5.0, 1.5)
    assert values.climb_speed_m_s == 2.5
    origins = {name: origin.kind for name, origin in values.origins.items()}
    assert origins["cruise_speed_m_s"] is OriginKind.FILE
    assert origins["acceleration_m_s2"] is OriginKind.MODEL
    assert origins["climb_speed_m_s"] is OriginKind.DEFAULT
    assert str(values.origins["cruise_speed_m_s"]) == "WPNAV_SPEED, vehicle.param line 2"
    assert str(values.origins["climb_speed_m_s"]) == "WP_SPD_UP, default"


def test_parameters_of_a_model_for_another_autopilot_are_left_alone() -> None:
    model = replace(
        load_vehicle(), reference=Autopilot.PX4, speed=None, parameters=(("MPC_XY_CRUISE", 8.0),)
    )
    values = resolve_parameters(Autopilot.ARDUPILOT, model=model).values
    assert all(origin.kind is OriginKind.DEFAULT for origin in values.origins.values())


def test_every_quantity_has_an_origin() -> None:
    for autopilot, parameters in (
        (Autopilot.PX4, Px4Parameters),
        (Autopilot.ARDUPILOT, ArduPilotParameters),
    ):
        values = resolve_parameters(autopilot).values
        assert set(values.origins) == set(parameter_table(parameters))


def test_assumed_defaults_are_one_finding_that_counts_them() -> None:
    result = resolve_parameters(Autopilot.ARDUPILOT)
    [(severity, message)] = messages(result, "P101")
    # less PLND_STRICT and OA_OPTIONS, behind PLND_ENABLED and OA_TYPE
    count = len(parameter_table(ArduPilotParameters)) - 2
    assert severity is Severity.INFO
    assert f"WP_SPD, WP_SPD_UP, WP_SPD_DN and {count - 3} more parameters" in message


@pytest.mark.parametrize(("enabled", "is_assumed"), [(0, False), (1, True)])
@pytest.mark.parametrize(
    ("switch", "switched"), [("PLND_ENABLED", "PLND_STRICT"), ("OA_TYPE", "OA_OPTIONS")]
)
def test_what_a_vehicle_has_not_while_it_is_switched_off_is_not_assumed(
    switch: str, switched: str, enabled: int, *, is_assumed: bool
) -> None:
    """ArduPilot lists no parameters of a library that its first one switches off."""
    rows = parameter_table(ArduPilotParameters).values()
    values = {row.now.name: row.default for row in rows if row.now.name != switched}
    values[switch] = enabled
    text = "\n".join(f"{name},{value}" for name, value in values.items())
    given = parameters_from_text(text.encode(), source="vehicle.param")
    found = messages(resolve_parameters(Autopilot.ARDUPILOT, file=given), "P101")
    assert bool(found) is is_assumed


def test_defaults_about_rally_points_are_reported_where_there_are_some() -> None:
    rows = parameter_table(ArduPilotParameters).values()
    text = "\n".join(
        f"{row.now.name},{row.default}" for row in rows if not row.now.name.startswith("RALLY_")
    )
    given = parameters_from_text(text.encode(), source="vehicle.param")
    [(_, message)] = messages(resolve_parameters(Autopilot.ARDUPILOT, file=given), "P101")
    assert "RALLY_LIMIT_KM, RALLY_INCL_HOME" in message
    without = resolve_parameters(Autopilot.ARDUPILOT, file=given, has_rally=False)
    assert without.findings == ()
    assert {q for q in without.values.origins if q.startswith("rally_")} == {
        "rally_limit_m",
        "rally_includes_home",
    }


def test_a_complete_file_leaves_nothing_to_say() -> None:
    for autopilot, parameters in (
        (Autopilot.PX4, Px4Parameters),
        (Autopilot.ARDUPILOT, ArduPilotParameters),
    ):
        rows = parameter_table(parameters).values()
        text = "\n".join(f"{row.now.name},{row.default}" for row in rows)
        assert resolved(text, autopilot).findings == ()


def test_a_mission_at_5_m_s_is_the_same_by_the_old_and_the_new_name() -> None:
    # WPNAV_SPEED = 500 cm/s and WP_SPD = 5 m/s
    assert resolved("WPNAV_SPEED,500\n").values == resolved("WP_SPD,5\n").values


def test_both_names_with_different_values_are_an_error_and_the_new_one_is_used() -> None:
    result = resolved("WPNAV_SPEED,500\nWP_SPD,10\n")
    assert isinstance(result.values, ArduPilotParameters)
    assert result.values.cruise_speed_m_s == 10.0
    [(severity, message)] = messages(result, "P102")
    assert severity is Severity.ERROR
    assert message == (
        "WPNAV_SPEED = 500 cm/s (line 1) and WP_SPD = 10 m/s (line 2) disagree: WP_SPD is used"
    )


def test_both_names_with_the_same_value_are_a_warning() -> None:
    [(severity, message)] = messages(resolved("WPNAV_SPEED,500\nWP_SPD,5\n"), "P102")
    assert severity is Severity.WARNING
    assert "mean the same" in message


def test_the_version_of_the_file_decides_between_two_names() -> None:
    for version, speed_m_s in (("4.6.3", 5.0), ("4.7.0", 10.0)):
        values = resolved(f"# Version: {version}\nWPNAV_SPEED,500\nWP_SPD,10\n").values
        assert isinstance(values, ArduPilotParameters)
        assert values.cruise_speed_m_s == speed_m_s


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("WP_SPD,500", "WP_SPD = 500 m/s (line 1)"),
        ("WPNAV_SPEED,5", "WPNAV_SPEED = 5 cm/s (line 1)"),
        ("WPNAV_SPEED,-500", "WPNAV_SPEED = -500 cm/s (line 1)"),
        ("WPNAV_SPEED,nan", "WPNAV_SPEED = not a number (line 1)"),
    ],
)
def test_an_impossible_value_is_an_error_and_the_default_is_assumed(line: str, shown: str) -> None:
    result = resolved(line)
    assert isinstance(result.values, ArduPilotParameters)
    assert result.values.cruise_speed_m_s == 10.0
    assert result.values.origins["cruise_speed_m_s"].kind is OriginKind.DEFAULT
    [(severity, message)] = messages(result, "P105")
    assert severity is Severity.ERROR
    assert message == f"{shown} is not possible: default 10 m/s used"


@pytest.mark.parametrize("line", ["PILOT_ACC_Z,250", "LOIT_SPEED,99999", "MIS_RESTART,-1"])
def test_a_parameter_no_prediction_depends_on_is_left_alone(line: str) -> None:
    result = resolved(f"WP_SPD,5\n{line}\n")
    assert {found.code for found in result.findings} == {"P101"}
    assert line.partition(",")[0] not in {origin.name for origin in result.values.origins.values()}


def test_several_impossible_values_are_one_finding() -> None:
    [(_, message)] = messages(resolved("WP_SPD,500\nWP_ACC,-1\nRTL_ALT,-1\n"), "P105")
    assert message.endswith(", and 2 more parameters")


@pytest.mark.parametrize("line", ["PLDP_DELAY,3e38", "RTL_LOIT_TIME,3e38", "FENCE_RADIUS,2e7"])
def test_no_time_or_way_is_beyond_all_measure(line: str) -> None:
    [(severity, _)] = messages(resolved(f"WP_SPD,5\n{line}\n"), "P105")
    assert severity is Severity.ERROR


def test_a_fraction_is_no_choice() -> None:
    assert messages(resolved("FENCE_ACTION,1.5\n"), "P105")


def test_a_file_of_another_autopilot_is_an_error() -> None:
    result = resolved("MPC_XY_CRUISE,8\n")
    [(severity, message)] = messages(result, "P106")
    assert severity is Severity.ERROR
    assert "PX4" in message
    assert "ArduPilot" in message
    assert result.values == ArduPilotParameters()


def test_a_file_that_could_be_of_either_is_taken_as_it_is() -> None:
    assert not messages(resolved("SERVO1_MIN,1100\n"), "P106")


@pytest.mark.parametrize(
    ("text", "whose"),
    [
        ("TECS_CLMB_MAX,5\nRTL_ALTITUDE,100\nBATT_CAPACITY,5000\n", "ArduPlane"),
        ("AIRSPEED_MIN,12\nBATT_CAPACITY,5000\n", "ArduPlane"),
        ("ATC_STR_RAT_P,0.2\nBATT_CAPACITY,5000\n", "Rover"),
        ("TECS_CLMB_MAX,5\nWPNAV_SPEED,500\n", ""),
        ("ARSPD_TYPE,1\nBATT_CAPACITY,5000\n", ""),
        ("TECS_CLMB_MAX,5\nRTL_ALTITUDE,100\n", "ArduPlane"),  # nothing in it that Copter knows
        ("CRUISE_SPEED,2\nCRUISE_THROTTLE,50\n", "Rover"),
        ("FLTMODE1,10\nKFF_RDDRMIX,0.5\n", "ArduPlane"),
        ("RLL2SRV_TCONST,0.45\nSIMPLE,0\n", "ArduPlane"),
        ("FS_THR_ENABLE,1\nLOIT_VELX_P,5\nLOIT_MAX_POSX,0.15\n", "Blimp"),
        ("LOIT_SPEED,500\nLOIT_ACC_MAX,500\n", ""),
        ("JS_GAIN_DEFAULT,0.5\nSURFACE_DEPTH,-10\n", "ArduSub"),
        ("FRAME_CONFIG,1\nWPNAV_SPEED,50\nPILOT_SPEED_UP,50\n", "ArduSub"),  # Sub has those, too
        ("FRAME_CLASS,1\nWPNAV_SPEED,500\nPILOT_SPEED_UP,250\n", ""),
    ],
)
def test_parameters_of_another_vehicle_of_ardupilots_are_not_a_copters(
    text: str, whose: str
) -> None:
    said = messages(resolved(text), "P106")
    assert len(said) == bool(whose)
    assert all(f"holds parameters of {whose}" in message for _, message in said)


def test_an_overruled_value_is_a_warning_with_both_values() -> None:
    result = resolved("MPC_XY_CRUISE,15\nMPC_XY_VEL_MAX,12\n", Autopilot.PX4)
    assert isinstance(result.values, Px4Parameters)
    assert result.values.cruise_speed_m_s == 12.0
    assert result.values.origins["cruise_speed_m_s"].name == "MPC_XY_VEL_MAX"
    [(severity, message)] = messages(result, "P107")
    assert severity is Severity.WARNING
    assert message == (
        "MPC_XY_CRUISE, vehicle.param line 1: 15 m/s is overruled by MPC_XY_VEL_MAX, 12 m/s is flown"
    )


def test_values_as_px4_itself_overwrote_them_are_not_called_overruled() -> None:
    # single precision, as a file from the vehicle holds it: lerp(1, 25, 0.6²) = 9.64
    text = "SYS_VEHICLE_RESP,0.600000023841857910\nMPC_JERK_AUTO,9.640000343322753906\n"
    assert not messages(resolved(text, Autopilot.PX4), "P107")


def test_a_file_that_repeats_itself_says_so_in_the_result() -> None:
    assert messages(resolved("RTL_ALT,1500\nRTL_ALT,3000\n"), "P104")


def test_step_references_have_no_parameters() -> None:
    with pytest.raises(ValueError, match="no parameters"):
        resolve_parameters(Autopilot.STEP)


@pytest.mark.parametrize(
    ("text", "fires"),
    [
        # More than 30 times the default of 15 m, and a hundredth of it is not.
        ("RTL_ALT_M,450\n", False),
        ("RTL_ALT_M,451\n", True),
        ("RTL_ALT_M,1500\n", True),
        ("RTL_ALT,15\n", True),
        ("RTL_ALT,49\n", True),
        ("RTL_ALT,50\n", False),
        ("RTL_ALT,0\n", False),  # as high as it is
        ("RTL_ALT,3000\n", False),
        ("WPNAV_SPEED,10\n", True),
        ("WPNAV_SPEED,50\n", False),
        ("LAND_ALT_LOW_M,1000\n", True),
        ("LAND_SPD_HIGH_MS,50\n", True),  # 0 by default: WP_SPD_DN is usual
        ("RTL_CLIMB_MIN_M,200\n", True),
        ("WPNAV_JERK,100\n", False),  # the same unit under both names
        ("WPNAV_RADIUS,200\n", False),
        ("WPNAV_RADIUS,6\n", True),
    ],
)
def test_a_value_that_looks_like_the_other_unit_is_an_error(
    text: str,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    found = messages(resolved(text), "P108")
    assert [severity for severity, _ in found] == [Severity.ERROR] * fires
    if fires:
        assert "is used as given; in the unit of " in found[0][1]


def test_no_default_of_either_name_is_suspected() -> None:
    for row in parameter_table(ArduPilotParameters).values():
        for spelling in row.spellings:
            value = row.now.si(row.default) / spelling.si(1.0)
            assert not messages(resolved(f"{spelling.name},{value:.9g}\n"), "P108"), spelling.name


@pytest.mark.parametrize("row", parameter_table(ArduPilotParameters).values(), ids=str)
def test_a_factor_of_a_hundred_never_slips_through(row: Parameter) -> None:
    """A usual value in the unit of the other name is refused, suspected or not rescaled at all."""
    if row.formerly is None or row.formerly.unit == row.now.unit or row.default == 0.0:
        return
    for right, wrong in ((row.formerly, row.now), (row.now, row.formerly)):
        value = row.now.si(row.default) / right.si(1.0)
        result = resolved(f"{wrong.name},{value:.9g}\n")
        assert messages(result, "P105") or messages(result, "P108"), wrong.name


@pytest.mark.parametrize(
    ("text", "version", "unknown"),
    [
        ("WPNAV_SPEED,500\n", None, ""),
        ("WPNAV_SPEED,500\n", (4, 6), ""),
        ("WPNAV_SPEED,500\n", (4, 7), "does not know WPNAV_SPEED (line 1): it is WP_SPD there"),
        ("WP_SPD,5\n", (4, 7), ""),
        # A build on the way to 4.7 has the names of 4.6: its file says which version, and has them.
        ("# Stack: ArduPilot\n# Version: 4.7.0 dev\n1\t1\tWPNAV_SPEED\t500\t9\n", (4, 7), ""),
        ("WP_SPD,5\n", (4, 6), "does not know WP_SPD (line 1): it is WPNAV_SPEED there"),
        ("RTL_LOIT_TIME,5000\n", (4, 7), ""),
    ],
)
def test_a_name_that_the_version_asked_for_does_not_know_is_warned_of(
    text: str, version: tuple[int, int] | None, unknown: str
) -> None:
    result = resolve_parameters(Autopilot.ARDUPILOT, file=file_of(text), version=version)
    found = messages(result, "P109")
    assert [severity for severity, _ in found] == [Severity.WARNING] * bool(unknown)
    if unknown:
        assert unknown in found[0][1]


def test_the_version_asked_for_decides_between_an_old_and_a_new_name() -> None:
    text = "WPNAV_SPEED,500\nWP_SPD,8\n"
    for version, speed_m_s in (((4, 6), 5.0), ((4, 7), 8.0)):
        result = resolve_parameters(Autopilot.ARDUPILOT, file=file_of(text), version=version)
        assert isinstance(result.values, ArduPilotParameters)
        assert result.values.cruise_speed_m_s == speed_m_s


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("WPNAV_SPEEED", "WPNAV_SPEED"),  # one letter too many
        ("WPNAV_SPED", "WPNAV_SPEED"),  # one too few
        ("WPNAV_SPEAD", "WPNAV_SPEED"),  # a wrong one
        ("WPNAV_SPEDE", "WPNAV_SPEED"),  # two that changed places
        ("WPNAVSPEED", "WPNAV_SPEED"),
        ("BATT2_CAPACITY", None),  # another battery
        ("WPNAV_SPEED2", None),
        ("WPNAV_SPEDD_X", None),
        ("WPNAV_TER_MARGIN", None),  # of the vehicle, and nothing to a mission
        ("WPNAV_SPEED", None),
        ("MPC_XY_CRUISE", None),  # of the other autopilot
    ],
)
def test_a_name_a_letter_away_from_one_that_counts_is_an_error(
    name: str, meant: str | None
) -> None:
    result = resolve_parameters(
        Autopilot.ARDUPILOT, file=replace(file_of(f"{name},500\n"), stack=None)
    )
    said = [f"{name} = 500 (line 1) is unknown: did you mean {meant}?"] if meant else []
    assert messages(result, "P110") == [(Severity.ERROR, one) for one in said]


def test_a_name_near_one_that_is_in_the_file_as_well_is_left_alone() -> None:
    assert not messages(resolved("WPNAV_SPEED,500\nWPNAV_SPEEED,500\n"), "P110")
    both = messages(resolved("WPNAV_SPEEED,500\nRTL_ATL,500\n"), "P110")
    assert [message for _, message in both] == [
        "WPNAV_SPEEED = 500 (line 1) is unknown: did you mean WPNAV_SPEED?, and 1 more parameter"
    ]


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_no_name_that_counts_is_a_slip_of_another(autopilot: Autopilot) -> None:
    from planner.vehicle.parameters.resolve import PARAMETERS_OF

    names = {
        spelling.name
        for row in parameter_table(PARAMETERS_OF[autopilot]).values()
        for spelling in row.spellings
    }
    for name in names:
        result = resolve_parameters(autopilot, file=file_of(f"{name},1\n"))
        assert not messages(result, "P110"), name


@pytest.mark.parametrize(
    ("autopilot", "text", "rate_deg_s"),
    [
        (Autopilot.PX4, "MC_YAWRATE_MAX,10\n", 10.0),
        (Autopilot.PX4, "MC_YAWRATE_MAX,45\nMPC_YAWRAUTO_MAX,30\n", 30.0),
        (Autopilot.PX4, "MPC_YAWRAUTO_MAX,300\n", 200.0),  # the default of MC_YAWRATE_MAX
        (Autopilot.ARDUPILOT, "ATC_RATE_Y_MAX,5\n", 5.0),
        (Autopilot.ARDUPILOT, "ATC_RATE_Y_MAX,0\nATC_SLEW_YAW,9000\n", 90.0),
        (Autopilot.ARDUPILOT, "ATC_RATE_Y_MAX,100\nATC_SLEW_YAW,9000\n", 90.0),
    ],
)
def test_a_vehicle_turns_no_faster_than_its_attitude_is_let(
    autopilot: Autopilot, text: str, rate_deg_s: float
) -> None:
    values = resolve_parameters(autopilot, file=file_of(text)).values
    assert math.degrees(values.yaw_rate_rad_s) == pytest.approx(rate_deg_s)


def test_defaults_are_those_of_the_version() -> None:
    # PX4 1.15's mission_params.c: MIS_PD_TO 5 s; 1.16 has MIS_COMMAND_TOUT 0 s in its place (PX4 #23960);
    # multicopter_autonomous_params.c of 1.16: MPC_YAWRAUTO_MAX 45; module.yaml of 1.17: 60.
    def at(version: tuple[int, int] | None, text: str = "MPC_XY_CRUISE\t7\n") -> Px4Parameters:
        values = resolve_parameters(Autopilot.PX4, file=file_of(text), version=version).values
        assert isinstance(values, Px4Parameters)
        return values

    waits = {version: at(version).payload_wait_s for version in ((1, 15), (1, 16), (1, 17), None)}
    assert waits == {(1, 15): 5.0, (1, 16): 0.0, (1, 17): 0.0, None: 0.0}
    assert at((1, 15)).origins["payload_wait_s"].name == "MIS_PD_TO"
    assert at((1, 16)).yaw_rate_rad_s == pytest.approx(0.7854, abs=1e-4)
    assert at((1, 17)).yaw_rate_rad_s == pytest.approx(1.0472, abs=1e-4)
    # A file that names its version needs no target; what it says goes before any default.
    named = "# Version: 1.15.4\n1\t1\tMPC_XY_CRUISE\t7\t9\n"
    assert at(None, named).return_time_action == 3
    assert at(None, named + "1\t1\tCOM_FLTT_LOW_ACT\t1\t6\n").return_time_action == 1


@pytest.mark.parametrize(
    ("text", "version", "corner_m_s2"),
    [
        ("", (4, 3), 5.0),
        ("", (4, 4), 2.5),
        ("", (4, 5), 5.0),
        ("", None, 5.0),
        ("WPNAV_ACCEL,150\nWPNAV_ACCEL_C,0\n", (4, 4), 1.5),
        ("WPNAV_ACCEL,150\nWPNAV_ACCEL_C,200\n", (4, 4), 2.0),
        ("WPNAV_ACCEL,150\nWPNAV_ACCEL_C,0\n", (4, 5), 3.0),
    ],
)
def test_corners_of_ardupilot_4_4_are_accelerated_in_no_more_than_legs(
    text: str, version: tuple[int, int] | None, corner_m_s2: float
) -> None:
    """A 0 meant WPNAV_ACCEL itself (#22431), before and after twice of it (#25928)."""
    file = file_of(text) if text else None
    values = resolve_parameters(Autopilot.ARDUPILOT, file=file, version=version).values
    assert isinstance(values, ArduPilotParameters)
    assert values.corner_acceleration_m_s2 == pytest.approx(corner_m_s2)
