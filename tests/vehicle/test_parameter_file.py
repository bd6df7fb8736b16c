"""Parameter files of every known form, and what is refused in them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.autopilot import Autopilot
from planner.errors import ParameterFileError
from planner.findings import Severity
from planner.vehicle.parameters.files import ParameterSet, parameters_from_text, read_parameters

QGROUNDCONTROL = """\
# Onboard parameters for Vehicle 1
#
# Stack: PX4 Pro
# Vehicle: Multi-Rotor
# Version: 1.17.0 dev
#
# Vehicle-Id Component-Id Name Value Type
1\t1\tMPC_XY_CRUISE\t8.000000000000000000\t9
1\t1\tMPC_YAW_MODE\t4\t6
1\t154\tMNT_RC_IN_MODE\t1\t6
"""


def read(text: str | bytes) -> ParameterSet:
    data = text.encode() if isinstance(text, str) else text
    return parameters_from_text(data, source="vehicle.param")


def value_of(parameters: ParameterSet, name: str) -> float | None:
    return parameters.values[name].value


def test_qgroundcontrol_files_say_whose_they_are() -> None:
    parameters = read(QGROUNDCONTROL)
    assert parameters.stack is Autopilot.PX4
    assert parameters.version == (1, 17)
    assert value_of(parameters, "MPC_XY_CRUISE") == 8.0
    assert parameters.values["MPC_XY_CRUISE"].line == 8
    assert value_of(parameters, "MPC_YAW_MODE") == 4.0


def test_parameters_of_other_components_are_not_the_vehicle_s() -> None:
    assert "MNT_RC_IN_MODE" not in read(QGROUNDCONTROL).values


def test_a_qgroundcontrol_file_of_ardupilot_is_recognised() -> None:
    text = "# Stack: ArduPilot\n# Version: 4.6.2\n1\t1\tWPNAV_SPEED\t500.0\t9\n"
    parameters = read(text)
    assert (parameters.stack, parameters.version) == (Autopilot.ARDUPILOT, (4, 6))


@pytest.mark.parametrize(
    "text",
    [
        "WPNAV_SPEED,500\nRTL_ALT,1500\n",
        "WPNAV_SPEED, 500\r\nRTL_ALT, 1500\r\n",
        "#NOTE: saved on the field\nWPNAV_SPEED 500\n\nRTL_ALT\t1500.000",
        "WPNAV_SPEED      500.000000\nRTL_ALT          1500.000000 # higher than the trees\n",
        "\ufeffWPNAV_SPEED,5e2\nRTL_ALT,1.5E+3\n",
        "WPNAV_SPEED 500 @READONLY\nRTL_ALT 0x5DC\n",
    ],
)
def test_every_form_of_a_line_means_the_same(text: str) -> None:
    parameters = read(text)
    assert value_of(parameters, "WPNAV_SPEED") == 500.0
    assert value_of(parameters, "RTL_ALT") == 1500.0
    assert parameters.stack is Autopilot.ARDUPILOT
    assert parameters.version is None
    assert parameters.findings == ()


@pytest.mark.parametrize(
    ("names", "stack"),
    [
        (("RC1_MIN", "SIM_GPS_USED", "MAV_TYPE"), None),  # groups that both have
        (("FS_THR_ENABLE",), Autopilot.ARDUPILOT),
        (("RC1_MIN", "RC7_OPTION"), Autopilot.ARDUPILOT),
        (("FLTMODE1", "RTL_OPTIONS"), Autopilot.ARDUPILOT),
        (("SENS_BOARD_ROT", "RC1_MIN"), Autopilot.PX4),
        (("EKF2_AID_MASK",), Autopilot.PX4),
        (("EK3_ENABLE",), Autopilot.ARDUPILOT),
        (("ARMING_CHECK", "COM_RC_LOSS_T"), None),
        (("ARMING_CHECK", "FS_OPTIONS", "MPC_XY_CRUISE"), Autopilot.PX4),  # a name that is read
    ],
)
def test_names_that_are_not_read_say_whose_they_are_by_their_group(
    names: tuple[str, ...], stack: Autopilot | None
) -> None:
    assert read("".join(f"{name},1\n" for name in names)).stack is stack


def test_a_parameter_without_a_number_has_no_value() -> None:
    parameters = read("1\t1\tMPC_XY_CRUISE\tnan\t9\n1\t1\tNAV_ACC_RAD\t-inf\t9\n")
    assert value_of(parameters, "MPC_XY_CRUISE") is None
    assert value_of(parameters, "NAV_ACC_RAD") is None


def test_a_repeated_parameter_is_one_finding_with_both_lines() -> None:
    parameters = read("RTL_ALT,1500\nWPNAV_SPEED,500\nRTL_ALT,3000\nWPNAV_SPEED,600\n")
    assert value_of(parameters, "RTL_ALT") == 3000.0
    [finding] = parameters.findings
    assert (finding.code, finding.severity) == ("P104", Severity.WARNING)
    assert "RTL_ALT is 1500 in line 1 and 3000 in line 3" in finding.message
    assert "1 more" in finding.message


def test_parameters_of_two_vehicles_are_an_error_where_they_differ() -> None:
    def rows(*columns: str) -> ParameterSet:
        return read("".join(f"{one}\n" for one in columns))

    [finding] = rows("1\t1\tFENCE_ENABLE\t1\t2", "2\t1\tFENCE_ENABLE\t0\t2").findings
    assert (finding.code, finding.severity) == ("P104", Severity.ERROR)
    assert "vehicles 1 and 2" in finding.message
    assert rows("1\t1\tFENCE_ENABLE\t1\t2", "2\t1\tFENCE_ENABLE\t1\t2").findings == ()
    [finding] = rows("1\t1\tFENCE_ENABLE\t1\t2", "1\t1\tFENCE_ENABLE\t0\t2").findings
    assert finding.severity is Severity.WARNING
    # Of another component, such as a gimbal, nothing is taken.
    assert rows("1\t1\tFENCE_ENABLE\t1\t2", "1\t154\tFENCE_ENABLE\t0\t2").findings == ()


def test_a_parameter_repeated_with_the_same_value_is_no_finding() -> None:
    assert read("RTL_ALT,1500\nRTL_ALT,1500.0\n").findings == ()


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("WPNAV_SPEED,500\nRTL_ALT\n", 2, "is not a parameter"),
        ("WPNAV_SPEED,500\nRTL_ALT,0,5\n", 2, "is not a parameter"),
        ("rtl_alt,1500\n", 1, "is not a parameter"),
        ("A_NAME_OF_SEVENTEEN,1\n", 1, "is not a parameter"),
        ("WPNAV_SPEED,fast\n", 1, "must be a number, got 'fast'"),
        ("WPNAV_SPEED,1_000\n", 1, "must be a number"),
        ("WPNAV_SPEED,٣\n", 1, "must be a number"),
        ("# nothing\n\n", None, "holds no parameter"),
        ("", None, "holds no parameter"),
        ('{"fileType": "Plan"}', 1, "is not a parameter"),
        ("QGC WPL 110\n", 1, "is not a parameter"),
    ],
)
def test_a_wrong_line_is_refused_with_its_number(text: str, line: int | None, says: str) -> None:
    with pytest.raises(ParameterFileError) as caught:
        read(text)
    assert str(caught.value).startswith("vehicle.param")
    assert says in str(caught.value)
    assert (None if caught.value.place is None else caught.value.place.line) == line


def test_binary_and_huge_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterFileError, match="not UTF-8"):
        read(b"WPNAV_SPEED,500\n\xff\xfe\x00")
    with pytest.raises(ParameterFileError, match="larger than 4096 KiB"):
        read(b"#" * (1 << 22) + b"\nRTL_ALT,1500")
    for path in (tmp_path, tmp_path / "nothing.param", Path("a\x00.param")):
        with pytest.raises(ParameterFileError, match="cannot be read"):
            read_parameters(path)


@given(st.binary(max_size=200))
@settings(max_examples=examples(150), deadline=None)
def test_random_bytes_are_refused_or_hold_a_parameter(data: bytes) -> None:
    found: object = None
    try:
        found = read(data).values
    except ParameterFileError as error:
        found = error.message
    assert found


@given(
    st.dictionaries(
        st.from_regex(r"[A-Z][A-Z0-9_]{0,15}", fullmatch=True),
        st.floats(-3.4e38, 3.4e38),  # parameters are 32-bit floats
        min_size=1,
        max_size=20,
    ),
    st.sampled_from(["{},{}", "{} {}", "1\t1\t{}\t{}\t9"]),
)
@settings(max_examples=examples(80), deadline=None)
def test_what_is_written_is_read_again(values: dict[str, float], form: str) -> None:
    text = "\n".join(form.format(name, value) for name, value in values.items())
    assert {name: entry.value for name, entry in read(text).values.items()} == values
