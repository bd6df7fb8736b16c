"""Quantities as text, against what a pilot would write by hand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner import quantity

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.mark.parametrize(
    ("duration_s", "text"),
    [
        (0.0, "0.0 s"),
        (4.24, "4.2 s"),
        (9.96, "10 s"),
        (32.4, "32 s"),
        (59.6, "1 min 00 s"),
        (692.4, "11 min 32 s"),
        (3599.7, "1 h 00 min 00 s"),
        (3932.0, "1 h 05 min 32 s"),
        (-32.4, "-32 s"),
    ],
)
def test_durations_read_as_a_clock_would_say_them(duration_s: float, text: str) -> None:
    assert quantity.duration(duration_s) == text


@pytest.mark.parametrize(
    ("distance_m", "text"),
    [
        (0.0, "0 m"),
        (2.46, "2.5 m"),
        (431.6, "432 m"),
        (999.4, "999 m"),
        (999.6, "1.00 km"),
        (4321.0, "4.32 km"),
        (12_345.0, "12.3 km"),
        (123_456.0, "123 km"),
    ],
)
def test_distances_change_to_kilometres_at_one(distance_m: float, text: str) -> None:
    assert quantity.distance(distance_m) == text


@pytest.mark.parametrize(
    ("energy_wh", "text"),
    [
        (0.0, "0.00 Wh"),
        (24.06, "24.1 Wh"),
        (9.994, "9.99 Wh"),
        (9.996, "10.0 Wh"),
        (99.96, "100 Wh"),
        (-9.7, "-9.70 Wh"),
        (0.004, "< 0.01 Wh"),
        (-0.004, "> -0.01 Wh"),
    ],
)
def test_energies_have_three_digits_and_never_lose_their_sign(energy_wh: float, text: str) -> None:
    assert quantity.energy(energy_wh) == text


@pytest.mark.parametrize(
    ("fraction", "text"),
    [
        (0.0, "0 %"),
        (0.0004, "< 0.1 %"),
        (0.042, "4.2 %"),
        (0.2, "20 %"),
        (0.3125, "31 %"),
        (1.43, "143 %"),
    ],
)
def test_shares_read_as_percent(fraction: float, text: str) -> None:
    assert quantity.percent(fraction) == text


def test_bearings_have_three_digits_and_wrap_at_north() -> None:
    assert [quantity.bearing(value) for value in (0.0, 7.4, 270.0, 359.7, 360.0)] == [
        "000°",
        "007°",
        "270°",
        "000°",
        "000°",
    ]


@pytest.mark.parametrize(
    ("speed_m_s", "text"),
    [
        (5.0, "5.0 m/s"),
        (0.051, "0.1 m/s"),
        (0.049, "0.05 m/s"),
        (0.03, "0.03 m/s"),
        (-0.002, "-0.002 m/s"),
        (1e-9, "0.0 m/s"),
        (0.0, "0.0 m/s"),
    ],
)
def test_a_slow_speed_is_not_none(speed_m_s: float, text: str) -> None:
    assert quantity.speed(speed_m_s) == text


def test_nothing_counts_as_minus_zero() -> None:
    assert quantity.decimals(-0.04, 1) == "0.0"


def test_a_count_agrees_with_its_noun() -> None:
    assert [quantity.count(n, "error") for n in (0, 1, 2)] == ["0 errors", "1 error", "2 errors"]
    assert quantity.count(0.5, "turn") == "0.5 turns"
    assert quantity.count(1.0, "turn") == "1 turn"
    assert [quantity.count(n, "vertex", "vertices") for n in (1, 2)] == ["1 vertex", "2 vertices"]


FORMATTERS: tuple[Callable[[float | None], str], ...] = (
    quantity.energy,
    quantity.charge,
    quantity.power,
    quantity.distance,
    quantity.height,
    quantity.speed,
    quantity.bearing,
    quantity.temperature,
    quantity.mass,
    quantity.percent,
    quantity.duration,
)


@pytest.mark.parametrize("formatter", FORMATTERS, ids=lambda formatter: formatter.__name__)
def test_what_is_absent_or_no_number_is_a_dash(formatter: Callable[[float | None], str]) -> None:
    assert formatter(None).startswith("—")
    assert formatter(math.nan).startswith("—")
    assert formatter(math.inf).startswith("—")


@settings(deadline=None, max_examples=examples(200))
@given(energy_wh=st.floats(min_value=-1e5, max_value=1e5).filter(lambda value: value != 0.0))
def test_an_energy_that_is_not_zero_is_not_written_as_zero(energy_wh: float) -> None:
    text = quantity.energy(energy_wh)
    assert any(digit in text for digit in "123456789")
    assert ("-" in text) == (energy_wh < 0.0)


@settings(deadline=None, max_examples=examples(200))
@given(energy_wh=st.floats(min_value=0.1, max_value=1e5))
def test_an_energy_is_rounded_by_less_than_half_a_percent(energy_wh: float) -> None:
    # three digits: at most half a unit of the third; below 1 Wh half a hundredth of a Wh
    written = float(quantity.energy(energy_wh).removesuffix(" Wh"))
    assert abs(written - energy_wh) <= max(0.005 * energy_wh, 0.005) * (1.0 + 1e-9)


def test_a_chance_is_never_none_and_never_sure() -> None:
    assert quantity.chance(0.0) == "< 0.1 %"
    assert quantity.chance(0.031) == "3.1 %"
    assert quantity.chance(0.5) == "50 %"
    assert quantity.chance(1.0) == "> 99.9 %"
    assert quantity.chance(None) == quantity.ABSENT


def test_a_number_beyond_sense_is_short() -> None:
    assert quantity.power(1e300) == "1e+300 W"
    assert quantity.height(-2.5e9) == "-2.5e+09 m"
    assert quantity.decimals(999_999_999.0, 0) == "999999999"
    assert len(quantity.duration(1e300)) < 30


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [
        (60.1, 60.0, "just over 60 m"),
        (59.9, 60.0, "just under 60 m"),
        (60.0, 60.0, "60 m"),
        (61.0, 60.0, "61 m"),
    ],
)
def test_a_value_that_reads_as_its_limit_says_on_which_side_it_is(
    value: float, limit: float, text: str
) -> None:
    assert quantity.beside(value, limit, quantity.height) == text


def test_a_difference_that_rounds_to_nothing_has_no_sign() -> None:
    shown = [quantity.signed(by_m, quantity.height) for by_m in (1e-9, 0.06, -12.0)]
    assert shown == ["0.0 m", "+0.1 m", "-12 m"]
