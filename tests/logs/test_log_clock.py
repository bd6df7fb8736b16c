"""The clock of a log: strays are left out, restarts cut it, untimed messages follow it."""

from __future__ import annotations

import numpy as np

from planner.logs.series import Clock


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
