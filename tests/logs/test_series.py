"""Samples on a common time base; the clock of a log: strays left out, restarts that cut it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.logs.series import Clock, Series


def test_samples_are_sorted_and_what_is_no_number_is_left_out() -> None:
    series = Series.of([3.0, 1.0, 2.0, np.nan, 2.5], [30.0, 10.0, np.inf, 5.0, 25.0], "X.y")
    assert series.time_s.tolist() == [1.0, 2.5, 3.0]
    assert series.values.tolist() == [10.0, 25.0, 30.0]


def test_of_equal_times_the_last_counts() -> None:
    series = Series.of([1.0, 1.0, 2.0], [5.0, 7.0, 9.0], "X.y")
    assert series.at(np.array([1.0])).tolist() == [7.0]


def test_between_neighbours_it_is_a_straight_line() -> None:
    series = Series.of([0.0, 0.4, 0.8], [0.0, 4.0, 0.0], "X.y")
    assert series.at(np.array([0.1, 0.4, 0.6])) == pytest.approx([1.0, 4.0, 2.0])


def test_an_angle_goes_the_short_way_round() -> None:
    series = Series.of([0.0, 1.0], [350.0, 10.0], "X.yaw", period=360.0)
    assert series.at(np.array([0.5])) % 360.0 == pytest.approx(0.0)


def test_a_gap_is_longer_than_a_second_and_three_intervals() -> None:
    fast = Series.of([0.0, 0.1, 0.2, 1.3, 1.4], np.zeros(5), "X.y")
    assert np.isnan(fast.at(np.array([0.2, 0.7, 1.3]))).tolist() == [False, True, False]
    slow = Series.of([0.0, 1.0, 2.0, 4.5, 5.5], np.zeros(5), "X.y")
    assert np.isfinite(slow.at(np.array([3.0]))).tolist() == [True]


def test_ends_are_known_for_one_interval_more() -> None:
    series = Series.of([1.0, 1.2], [5.0, 6.0], "X.y")
    known = np.isfinite(series.at(np.array([0.75, 0.85, 1.35, 1.45])))
    assert known.tolist() == [False, True, True, False]


def test_an_event_holds_until_the_next() -> None:
    series = Series.of([1.0, 100.0], [1.0, 0.0], "X.y", is_event=True)
    assert series.at(np.array([0.5, 1.0, 99.9, 100.0])).tolist() == pytest.approx(
        [np.nan, 1.0, 1.0, 0.0], nan_ok=True
    )
    assert series.rate_hz is None


def test_of_nothing_nothing_is_known() -> None:
    assert np.isnan(Series.of([], [], "X.y").at(np.array([0.0, 1.0]))).all()


def test_the_mean_around_a_sample_keeps_the_integral_of_a_fast_signal() -> None:
    # A hundred samples a second, ten of them around each sample of the record but the first.
    power = np.random.default_rng(1).uniform(0.0, 500.0, 200)
    series = Series.of(np.arange(200) * 0.01 + 0.005, power, "X.y")
    means = series.mean_at(np.linspace(0.0, 1.9, 20))
    assert means[1:] == pytest.approx(power[5:195].reshape(19, 10).mean(axis=1))


def test_a_slow_signal_is_not_averaged() -> None:
    series = Series.of([0.0, 1.0], [0.0, 10.0], "X.y")
    assert series.mean_at(np.array([0.0, 0.1, 0.2])) == pytest.approx([0.0, 1.0, 2.0])


def _clock(times: list[float]) -> Clock:
    return Clock.of(np.arange(len(times), dtype=np.int64), np.array(times))


def test_a_steady_clock_is_one_run_of_everything() -> None:
    clock = _clock([1.0, 2.0, 3.0, 2.5, 4.0])  # half a second back is how logs are written
    assert (clock.restarts, clock.strays) == ((), 0)
    [(begin, end)] = clock.runs()
    assert begin == 0
    assert end > 4


def test_a_message_from_the_future_is_a_stray() -> None:
    clock = _clock([*range(10), 1e9, *range(10, 20)])
    assert (clock.restarts, clock.strays) == ((), 1)
    assert 10 not in clock.places


def test_a_message_from_the_past_is_a_stray() -> None:
    for times in ([*range(10, 20), 0.0, *range(20, 30)], [*range(10, 20), 0.0]):
        clock = _clock(times)
        assert (clock.restarts, clock.strays) == ((), 1), times


def test_many_from_the_past_are_a_restart() -> None:
    clock = _clock([*range(100, 120), *range(20)])
    assert (clock.restarts, clock.strays) == ((20,), 0)
    assert [run[0] for run in clock.runs()] == [0, 20]


def test_untimed_messages_have_the_time_of_the_one_before() -> None:
    clock = Clock.of(np.array([10, 20, 30]), np.array([1.0, 2.0, 3.0]))
    assert clock.time_at_s(np.array([5, 10, 25, 99])).tolist() == [1.0, 1.0, 2.0, 3.0]
