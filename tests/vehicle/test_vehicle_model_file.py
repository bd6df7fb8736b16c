"""Bad model files, one per failure: each is refused with its file, its key and what to do."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.errors import VehicleFileError
from planner.flight.motion.kinematics import STATES
from planner.vehicle.model import STATE_NAMES
from planner.vehicle.power import CruisePower
from planner.vehicle.reader import MOST_BYTES, read_vehicle, vehicle_from_toml

if TYPE_CHECKING:
    from planner.vehicle.model import VehicleModel

STEP_MODEL = """\
schema = 1
name = "quad"
kind = "multicopter"
reference = "step"
description = "a quadrotor"
mass_kg = 2.0

[speed]
default_m_s = 8.0

[hover]
law = "altitude-power"
coefficient_w = 150.0
exponent = 0.02
lowest_height_m = 1.0

[responses.altitude]
numerator = [1]
denominator = [1, 2, 1]
delay_s = 0.5
input_gain = 1
identified_step_m = 50

[responses.speed]
numerator = [1.0]
denominator = [1.0, 1.5, 1.0]
delay_s = 0
input_gain = 1.0
identified_speed_m_s = 8

[responses.brake_power]
numerator = [0.1, -1.0]
denominator = [1.0, 0.0, 1.0]
delay_s = 0.5
input_gain = 1.0
window_s = 6.0
identified_speed_m_s = 8

[cruise]
power = "table"
speed_m_s = [0, 5, 10]
power_above_hover_w = [0, -10, 20]

[battery]
capacity_ah = 5.0
nominal_voltage_v = 14.8
cells_in_series = 4
internal_resistance_ohm = 0.02
ocv_soc = [0.0, 0.5, 1.0]
ocv_v = [13.2, 15.0, 16.8]
cutoff_voltage_v = 13.2

[valid_for]
speed_m_s = [0, 10]

[spread]
time_fraction = 0.02
energy_fraction = 0.05
energy_state_fraction = { cruise = 0.02, land = 0.1 }
n_flights = 6
source = "six flights"

[provenance]
source = "invented for a test"
method = "none"
date = 2026-01-02
logs = ["a.ulg"]
logs_sha256 = ["0000000000000000000000000000000000000000000000000000000000000000"]

[provenance.fit]
power_rmse_w = 3.5
"""

DENSITY_HOVER = """\
[hover]
law = "density"
hover_power_w = 353.0
reference_mass_kg = 3.5
reference_density_kg_m3 = 1.225
mass_exponent = 1.5
density_exponent = -0.5
"""

ARDUPILOT_MODEL = (
    """\
schema = 1
name = "quad"
kind = "multicopter"
reference = "ardupilot"
description = "a quadrotor"
mass_kg = 3.5
"""
    + DENSITY_HOVER
    + """\
[cruise]
power = "not-given"
[parameters]
WPNAV_SPEED = 1000
[valid_for]
speed_m_s = [0, 10]
[provenance]
source = "invented for a test"
method = "none"
date = 2026-01-02
"""
)


def read(text: str | bytes, name: str = "quad") -> VehicleModel:
    data = text.encode() if isinstance(text, str) else text
    return vehicle_from_toml(data, name=name, source="hangar/quad.toml")


def problems_of(text: str | bytes, name: str = "quad") -> tuple[str, ...]:
    with pytest.raises(VehicleFileError) as caught:
        read(text, name)
    assert str(caught.value).startswith("hangar/quad.toml")
    return caught.value.problems


def test_the_spread_names_the_states_of_a_flight() -> None:
    assert tuple(STATES) == STATE_NAMES


def test_a_right_file_gives_what_it_says() -> None:
    model = read(STEP_MODEL)
    assert model.name == "quad"
    assert model.mass_kg == 2.0
    assert model.default_speed_m_s == 8.0
    assert model.responses.altitude is not None
    assert model.responses.altitude.denominator == (1.0, 2.0, 1.0)
    assert model.responses.climb_power is None
    assert model.responses.brake_power is not None
    assert model.responses.brake_power.window_s == 6.0
    assert isinstance(model.cruise, CruisePower)
    assert model.cruise.power_above_hover_w == (0.0, -10.0, 20.0)
    assert model.battery is not None
    assert model.battery.energy_wh == pytest.approx(5.0 * 14.8)
    assert model.valid_for.speed_m_s is not None
    assert 10.0 in model.valid_for.speed_m_s
    assert 10.1 not in model.valid_for.speed_m_s
    assert model.spread is not None
    assert model.spread.time_fraction == 0.02
    assert model.spread.energy_state_fraction == (("cruise", 0.02), ("land", 0.1))
    assert model.spread.stopping_distance_fraction is None
    assert model.provenance.fit == (("power_rmse_w", 3.5),)


def test_a_model_of_an_autopilot_carries_its_parameters_and_density_law() -> None:
    model = read(ARDUPILOT_MODEL)
    assert model.parameters == (("WPNAV_SPEED", 1000.0),)
    assert model.default_speed_m_s is None
    assert model.cruise is None


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ("exponent = 0.02", "exponnent = 0.02", "hover.exponnent", "did you mean exponent?"),
        ("exponent = 0.02", "exponnent = 0.02", "hover.exponent", "is missing"),
        ("[battery]", "[batery]", "batery", "did you mean battery?"),
        ("[responses.speed]", "[responses.sped]", "responses.sped", "did you mean speed?"),
        ("[responses.speed]", "[responses.sped]", "responses.speed", '"step" needs it'),
        ("[responses.altitude]", "[responses.climb]", "responses.altitude", '"step" needs it'),
        ("[cruise]", "[vertical]", "cruise", "is missing"),
        ("[valid_for]", "[provenance2]", "valid_for", "is missing"),
        ("speed_m_s = [0, 10]", "", "valid_for.*", "is empty"),
        ("[speed]\ndefault_m_s = 8.0", "", "speed.default_m_s", '"step" needs it'),
        ("mass_kg = 2.0", 'mass_kg = "2 kg"', "mass_kg", "must be a number, got '2 kg'"),
        ("mass_kg = 2.0", "mass_kg = true", "mass_kg", "must be a number, got true"),
        ("mass_kg = 2.0", "mass_kg = nan", "mass_kg", "got nan"),
        ("mass_kg = 2.0", "mass_kg = inf", "mass_kg", "got inf"),
        ("mass_kg = 2.0", "mass_kg = 0", "mass_kg", "greater than 0"),
        ("mass_kg = 2.0", "mass_kg = 1e-320", "mass_kg", "greater than 0"),
        ("mass_kg = 2.0", "mass_kg = 1e300", "mass_kg", "not be above 1e+30"),
        ("mass_kg = 2.0", "mass_kg = 0x" + "f" * 5000, "mass_kg", "out of range"),
        ("mass_kg = 2.0", "", "mass_kg", None),
        ('kind = "multicopter"', 'kind = "airship"', "kind", "one of multicopter"),
        ('kind = "multicopter"', 'kind = ""', "kind", "one of multicopter"),
        ('description = "a quadrotor"', 'description = " "', "description", "empty"),
        ('reference = "step"', 'reference = "inav"', "reference", "one of step, px4, ardupilot"),
        ('reference = "step"', 'reference = "px4"', "speed", "under [parameters]"),
        ('name = "quad"', 'name = "hexa"', "name", "the file is called quad.toml"),
        ('law = "altitude-power"', 'law = "altitude"', "hover.law", "did you mean altitude-power?"),
        ('law = "altitude-power"', "", "hover.law", "one of altitude-power, density"),
        ('law = "altitude-power"', "law = 3", "hover.law", "got 3"),
        ("lowest_height_m = 1.0", "lowest_height_m = 0", "hover.lowest_height_m", "than 0"),
        ("window_s = 6.0", "window_s = 0", "responses.brake_power.window_s", "than 0"),
        ("window_s = 6.0", "window_s = 0.5", "responses.brake_power.window_s", "delay_s"),
        ("window_s = 6.0", "", "responses.brake_power.window_s", "is missing"),
        (
            "identified_step_m = 50",
            "identified_step_m = 50\nwindow_s = 6",
            "responses.altitude.window_s",
            "is not a key",
        ),
        ("delay_s = 0\n", "delay_s = -1\n", "responses.speed.delay_s", "not be below 0"),
        ("[1.0, 1.5, 1.0]", "[1.0, -1.5, 1.0]", "responses.speed.denominator", "unstable"),
        ("[1.0, 1.5, 1.0]", "[1.0, 0.0, 1.0]", "responses.speed.denominator", "unstable"),
        ("[1.0, 0.0, 1.0]", "[1.0, -0.1, 1.0]", "responses.brake_power.denominator", "unstable"),
        ("[1.0, 1.5, 1.0]", "[0.0, 1.5, 1.0]", "responses.speed.denominator", "begin with 0"),
        ("[1.0, 1.5, 1.0]", "[1e-320, 1e29, 1.0]", "responses.speed.denominator", "too far apart"),
        ("[1.0, 1.5, 1.0]", "[1.0]", "responses.speed.denominator", "2 to 4 values"),
        ("[1.0, 1.5, 1.0]", "[1, 4, 6, 4, 1]", "responses.speed.denominator", "2 to 4 values"),
        ("[1.0, 1.5, 1.0]", "[1.0, nan, 1.0]", "responses.speed.denominator", "nan"),
        ("numerator = [1.0]", "numerator = [1, 0, 0, 1]", "responses.speed.numerator", "improper"),
        ("numerator = [1.0]", "numerator = 1.0", "responses.speed.numerator", "list of numbers"),
        ("numerator = [1.0]", "numerator = []", "responses.speed.numerator", "1 to 4 values"),
        ("numerator = [1.0]", "numerator = [0.1]", "responses.speed.input_gain", "end at 0.1"),
        ("input_gain = 1\n", "input_gain = 0\n", "responses.altitude.input_gain", "not be 0"),
        (
            "numerator = [1.0]\n",
            "numerator = [1.0]\nnumerator_standard_error = [0.1, 0.1]\n",
            "responses.speed.numerator_standard_error",
            "has 2 values, numerator has 1",
        ),
        (
            "numerator = [1.0]\n",
            "numerator = [1.0]\ndelay_standard_error_s = -0.1\n",
            "responses.speed.delay_standard_error_s",
            "below 0",
        ),
        (
            'power = "table"',
            "",
            "cruise.power",
            "one of table, momentum, liu, di-franco-buttazzo, not-given",
        ),
        ('power = "table"', 'power = "not-given"', "cruise.speed_m_s", "is not a key"),
        ("speed_m_s = [0, 5, 10]", "speed_m_s = [0, 10, 5]", "cruise.speed_m_s", "5 follows 10"),
        ("speed_m_s = [0, 5, 10]", "speed_m_s = [0, 10]", "cruise.power_above_hover_w", "3 values"),
        ("capacity_ah = 5.0", "", "battery.capacity_ah", "is missing"),
        ("ocv_v = [13.2, 15.0, 16.8]", "", "battery.ocv_v", "is missing"),
        (
            "capacity_ah = 5.0",
            "capacity_ah = 5.0\ncapacity_wh = 100",
            "battery.capacity_wh",
            "= 74 Wh",
        ),
        ("cells_in_series = 4", "cells_in_series = 4.5", "battery.cells_in_series", "whole number"),
        ("ocv_soc = [0.0, 0.5, 1.0]", "", "battery.ocv_soc", "is missing: ocv_v is given"),
        ("ocv_v = [13.2, 15.0, 16.8]", "", "battery.ocv_v", "is missing: ocv_soc is given"),
        ("ocv_soc = [0.0, 0.5, 1.0]", "ocv_soc = [0.1, 0.5, 1.0]", "battery.ocv_soc", "0 to 1"),
        ("ocv_soc = [0.0, 0.5, 1.0]", "ocv_soc = [0.0, 1.0]", "battery.ocv_v", "ocv_soc has 2"),
        ("ocv_v = [13.2, 15.0, 16.8]", "ocv_v = [13.2, 17.0, 16.8]", "battery.ocv_v", "rise"),
        ("cutoff_voltage_v = 13.2", "cutoff_voltage_v = 17", "battery.cutoff_voltage_v", "below"),
        ("speed_m_s = [0, 10]", "speed_m_s = [10, 0]", "valid_for.speed_m_s", "not end below"),
        ("speed_m_s = [0, 10]", "speed_m_s = [0, 5, 10]", "valid_for.speed_m_s", "[lowest"),
        ("date = 2026-01-02", 'date = "2026-01-02"', "provenance.date", "must be a date"),
        ("date = 2026-01-02", "date = 2026-01-02T03:04:05", "provenance.date", "must be a date"),
        ('logs = ["a.ulg"]', 'logs = "a.ulg"', "provenance.logs", "list of texts"),
        ('logs = ["a.ulg"]', "logs = []", "provenance.logs_sha256", "has 1 value, logs has 0"),
        ('["00', '["g0', "provenance.logs_sha256", "hexadecimal"),
        ("time_fraction = 0.02", "time_fraction = -0.02", "spread.time_fraction", "below 0"),
        ("time_fraction = 0.02", "time_fraction = 20", "spread.time_fraction", "above 10"),
        ("time_fraction = 0.02", "time_percent = 2", "spread.time_percent", "is not a key"),
        ("n_flights = 6", "", "spread.n_flights", "is missing"),
        ("n_flights = 6", "n_flights = 0", "spread.n_flights", "below 1"),
        ("{ cruise", "{ glide", "spread.energy_state_fraction.glide", "is not a key"),
        ("land = 0.1 }", 'land = "0" }', "spread.energy_state_fraction.land", "must be a number"),
        (
            "time_fraction = 0.02\nenergy_fraction = 0.05\n",
            "",
            "spread.time_fraction",
            "give one of",
        ),
        ("power_rmse_w = 3.5", 'power_rmse_w = "3"', "provenance.fit.power_rmse_w", "a number"),
        ("[speed]\n", "[parameters]\nWP_SPD = 5\n[speed]\n", "parameters", "no autopilot"),
        ("[speed]\n", "[[speed]]\n", "speed", "must be a table"),
        ("schema = 1", "", "schema", "write schema = 1"),
        ("schema = 1", "schema = 2", "schema", "update mavjoule"),
        ("schema = 1", "schema = 0", "schema", "no such version"),
        ("schema = 1", "schema = 1.0", "schema", "no such version"),
        ("schema = 1", "schema = true", "schema", "no such version"),
        ("schema = 1", "schema = 0x" + "f" * 5000, "schema", "no such version"),
    ],
)
def test_a_wrong_file_is_refused_by_file_and_key(
    old: str, new: str, key: str, says: str | None
) -> None:
    assert old in STEP_MODEL
    changed = STEP_MODEL.replace(old, new, 1)
    if says is None:  # allowed: the article's law does not need it
        read(changed)
        return
    problems = problems_of(changed)
    assert any(
        problem.startswith(f"hangar/quad.toml: {key}: ") and says in problem for problem in problems
    ), problems


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ("mass_kg = 3.5\n", "", "mass_kg", 'law = "density" needs'),
        ("mass_exponent = 1.5", "", "hover.mass_exponent", "is missing"),
        ("density_exponent = -0.5", "density_exponent = 0.5", "hover.density_exponent", "above 0"),
        ("WPNAV_SPEED", "WPNAV_SPED", "parameters.WPNAV_SPED", "did you mean WPNAV_SPEED?"),
        ("WPNAV_SPEED = 1000", "MPC_XY_CRUISE = 5", "parameters.MPC_XY_CRUISE", "of PX4"),
        ("WPNAV_SPEED = 1000", "WPNAV_SPEED = 5", "parameters.WPNAV_SPEED", "cannot be 5 cm/s"),
        ("WPNAV_SPEED = 1000", "WP_SPD = 500", "parameters.WP_SPD", "cannot be 500 m/s"),
        ("WPNAV_SPEED = 1000", 'WP_SPD = "5"', "parameters.WP_SPD", "a number"),
        (
            "WPNAV_SPEED = 1000",
            "WP_SPD = 10\nWPNAV_SPEED = 1000",
            "parameters.WPNAV_SPEED",
            "old name of WP_SPD",
        ),
    ],
)
def test_a_wrong_model_of_an_autopilot_is_refused_by_file_and_key(
    old: str, new: str, key: str, says: str
) -> None:
    assert old in ARDUPILOT_MODEL
    problems = problems_of(ARDUPILOT_MODEL.replace(old, new, 1))
    assert any(
        problem.startswith(f"hangar/quad.toml: {key}: ") and says in problem for problem in problems
    ), problems


def test_a_model_may_hold_parameters_no_prediction_depends_on() -> None:
    model = read(ARDUPILOT_MODEL.replace("WPNAV_SPEED = 1000", "PILOT_ACCEL_Z = 250"))
    assert model.parameters == (("PILOT_ACCEL_Z", 250.0),)


def test_every_problem_of_a_file_is_reported_at_once() -> None:
    text = (
        STEP_MODEL.replace("exponent = 0.02", "exponent = nan")
        .replace("capacity_ah = 5.0", "capacity_ah = -5.0")
        .replace("window_s = 6.0", "windo_s = 6.0")
        .replace('name = "quad"', 'name = "hexa"')
    )
    keys = [problem.split(": ")[1] for problem in problems_of(text)]
    assert keys == [
        "hover.exponent",
        "responses.brake_power.windo_s",
        "responses.brake_power.window_s",
        "battery.capacity_ah",
        "name",
    ]


def test_the_message_of_the_error_counts_the_other_problems() -> None:
    with pytest.raises(VehicleFileError, match=r"exponent.* \(and 1 more problem\)"):
        read(
            STEP_MODEL.replace("exponent = 0.02", "exponent = nan").replace(
                "capacity_ah = 5.0", "capacity_ah = -5.0"
            )
        )


def test_a_syntax_error_has_its_line_and_column() -> None:
    with pytest.raises(VehicleFileError) as caught:
        read(STEP_MODEL.replace("kind =", "kind :"))
    assert caught.value.place is not None
    assert (caught.value.place.line, caught.value.place.column) == (3, 6)
    assert str(caught.value).startswith("hangar/quad.toml:3:6: is not TOML")


def test_a_syntax_error_at_the_end_has_its_line() -> None:
    with pytest.raises(VehicleFileError) as caught:
        read('schema = 1\nname = "quad')
    assert caught.value.place is not None
    assert caught.value.place.line == 2


def test_a_byte_order_mark_and_windows_line_ends_are_read() -> None:
    assert read(b"\xef\xbb\xbf" + STEP_MODEL.replace("\n", "\r\n").encode()) == read(STEP_MODEL)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "schema: is missing"),
        (b"\x00\x01\x02", "not TOML"),
        (b"name = 1\n\xff\xfe", "2:1: is not UTF-8 text"),
        (b"#" * (MOST_BYTES + 1), "larger than 256 KiB"),
        (b"a = " + b"[" * 100_000, "nested too deeply"),
        (b"a = " + b"9" * 5000, "is not TOML"),
        (b"schema = 1\n" + b"\n".join(b"k%d = 1" % n for n in range(5000)), "5000 unknown keys"),
    ],
)
def test_no_bytes_end_in_a_traceback(data: bytes, says: str) -> None:
    assert any(says in problem for problem in problems_of(data))


@given(st.binary(max_size=300))
@settings(max_examples=examples(100), deadline=None)
def test_random_bytes_are_refused(data: bytes) -> None:
    assert problems_of(data)


@given(
    position=st.integers(min_value=0, max_value=len(STEP_MODEL) - 1),
    replacement=st.sampled_from(["", "\n", '"', "[", "]", "=", "-", "9", "e", ".", "\x00", "é"]),
)
@settings(max_examples=examples(200), deadline=None)
def test_a_damaged_file_is_read_or_refused(position: int, replacement: str) -> None:
    damaged = STEP_MODEL[:position] + replacement + STEP_MODEL[position + 1 :]
    problems: tuple[str, ...] = ()
    try:
        name = read(damaged).name
    except VehicleFileError as error:
        problems = error.problems
    assert problems or name == "quad"


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "nothing.toml", tmp_path, Path("a\x00b.toml")):
        with pytest.raises(VehicleFileError, match="cannot be read"):
            read_vehicle(path)


def test_the_name_must_be_that_of_the_file(tmp_path: Path) -> None:
    right, wrong = tmp_path / "quad.toml", tmp_path / "copy of quad.toml"
    right.write_text(STEP_MODEL)
    wrong.write_text(STEP_MODEL)
    assert read_vehicle(right).source == str(right)
    with pytest.raises(VehicleFileError, match=re.escape("the file is called copy of quad.toml")):
        read_vehicle(wrong)


def test_the_corpus_starts_from_valid_toml() -> None:
    assert tomllib.loads(STEP_MODEL)["name"] == tomllib.loads(ARDUPILOT_MODEL)["name"]
