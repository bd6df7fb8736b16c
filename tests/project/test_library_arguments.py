"""The library's options of a wrong type or out of range: one clear sentence each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_missions import mission, rtl, takeoff, waypoint

import planner
from planner.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

MISSION = mission(takeoff(30), waypoint(200, 30), rtl())
VEHICLE = planner.load_vehicle("falkowski-2023-quadrotor")
NUMBERS = (
    "charge",
    "reserve",
    "risk",
    "payload_kg",
    "temperature_c",
    "pressure_hpa",
    "position_noise_m",
    "heading_deg",
    "battery_health",
    "battery_resistance_factor",
    "battery_temperature_c",
    "reaction_time_s",
    "position_error_m",
    "home_amsl_m",
    "speed_m_s",
    "clearance_m",
)
OBJECTS = (
    "battery",
    "wind",
    "autopilot",
    "parameters",
    "terrain",
    "target",
    "profile",
    "selection",
    "fail_on",
    "with_trace",
)
UNLIKE: tuple[Any, ...] = ("5", b"5", [5.0], {}, object(), np.array([1.0, 2.0]), 1j)
"""Of no type that any option takes."""
NOT_FINITE = (float("nan"), float("inf"), float("-inf"))


def test_the_table_names_every_option() -> None:
    from inspect import signature

    named = {"mission", "vehicle", *NUMBERS, *OBJECTS}
    assert set(signature(planner.check).parameters) == named


@pytest.mark.parametrize("use", [planner.check, planner.check_together])
def test_the_help_of_a_use_case_tells_each_argument_by_its_public_name(
    use: Callable[..., object],
) -> None:
    from inspect import getdoc, signature

    text = getdoc(use) or ""
    for name in signature(use).parameters:
        assert f"\n{name} : " in text
    assert "Setup" not in text
    assert getattr(planner, use.__name__) is use


@pytest.mark.parametrize("name", [*NUMBERS, *OBJECTS])
@pytest.mark.parametrize("value", UNLIKE, ids=lambda value: type(value).__name__)
def test_an_option_of_a_wrong_type_is_a_usage_error(name: str, value: object) -> None:
    options: dict[str, Any] = {name: value}
    with pytest.raises(UsageError, match=rf"^{name} must be "):
        planner.check(MISSION, VEHICLE, **options)


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [*NOT_FINITE, True])
def test_a_number_that_is_none_is_a_usage_error(name: str, value: float) -> None:
    options: dict[str, Any] = {name: value}
    with pytest.raises(UsageError, match=rf"^{name} must be "):
        planner.check(MISSION, VEHICLE, **options)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("wind", 5),
        ("battery", 77),
        ("autopilot", "px4"),
        ("fail_on", 2),
        ("fail_on", None),
        ("with_trace", 1),
        ("charge", None),
        ("reserve", None),
        ("payload_kg", None),
        ("clearance_m", None),
        ("clearance_m", -1.0),
        ("charge", 1.5),
        ("risk", -0.1),
        ("speed_m_s", 0.0),
        ("home_amsl_m", 20_000.0),
        ("payload_kg", -0.5),
    ],
)
def test_a_value_that_looks_nearly_right_is_a_usage_error(name: str, value: object) -> None:
    options: dict[str, Any] = {name: value}
    with pytest.raises(UsageError):
        planner.check(MISSION, VEHICLE, **options)


def test_a_path_or_a_name_is_neither_mission_nor_vehicle() -> None:
    path: Any = "survey.plan"
    name: Any = "px4-sih-quad"
    with pytest.raises(UsageError, match=r"mission must be planner\.read_mission\(path\)"):
        planner.check(path, VEHICLE)
    with pytest.raises(UsageError, match=r"vehicle must be planner\.load_vehicle\(name\)"):
        planner.check(MISSION, name)


def test_numbers_of_numpy_and_whole_ones_are_numbers() -> None:
    given: dict[str, Any] = {"reserve": np.float32(0.25), "payload_kg": np.int64(0)}
    result = planner.check(MISSION, VEHICLE, charge=1, **given)
    assert result.totals.energy_wh == planner.check(MISSION, VEHICLE).totals.energy_wh


@pytest.mark.parametrize("flown", [planner.predict_speed_curve, planner.split_mission])
def test_the_other_uses_of_a_check_refuse_as_it_does(flown: Any) -> None:  # noqa: ANN401 - both
    with pytest.raises(UsageError, match="wind must be"):
        flown(MISSION, VEHICLE, wind=5)
    with pytest.raises(UsageError, match="vehicle must be"):
        flown(MISSION, "px4-sih-quad")


@pytest.mark.parametrize("name", ["from_m_s", "to_m_s", "step_m_s"])
def test_a_range_of_speeds_of_no_numbers_is_a_usage_error(name: str) -> None:
    options: dict[str, Any] = {name: "5"}
    with pytest.raises(UsageError, match=rf"^{name} must be a number"):
        planner.predict_speed_curve(MISSION, VEHICLE, **options)


def test_a_speed_to_write_that_is_no_number_is_a_usage_error() -> None:
    fast: Any = "5"
    with pytest.raises(UsageError, match="a speed must be a number"):
        planner.mission_at_speed(MISSION, fast)
    with pytest.raises(UsageError, match="speed_m_s must be a number"):
        planner.split_mission(MISSION, VEHICLE, speed_m_s=fast)
