"""The rules are found where they are declared, whatever other threads do meanwhile."""

from __future__ import annotations

import threading
import time
from importlib import import_module

from planner.rules.declaration import Check
from planner.rules.registry import SUBJECTS, checks_of

_TRIED_S = 0.3
_NAMES = 2000


def test_a_module_that_another_thread_adds_to_is_read_whole() -> None:
    """Warnings of numpy in a worker add ``__warningregistry__`` to the module that they come from.

    Read item by item, its names change on the way: RuntimeError, and a check that failed (X905).
    """
    names, is_over = vars(import_module("planner.rules.energy")), threading.Event()
    expected = checks_of("energy")

    def add_and_remove() -> None:
        while not is_over.is_set():
            for number in range(_NAMES):
                names[f"_added_{number}"] = number
            for number in range(_NAMES):
                del names[f"_added_{number}"]

    other = threading.Thread(target=add_and_remove)
    other.start()
    try:
        end_s = time.monotonic() + _TRIED_S
        while time.monotonic() < end_s:
            assert checks_of.__wrapped__("energy") == expected
    finally:
        is_over.set()
        other.join()


def test_every_module_of_a_subject_declares_checks() -> None:
    assert all(isinstance(one, Check) for subject in SUBJECTS for one in checks_of(subject))
    assert all(checks_of(subject) for subject in SUBJECTS)
