"""Which cases of long tests ``make test`` leaves out, so that it takes ten minutes; ``make whole`` runs all.

`LONG` holds how many cases it runs of tests that take long, none of some.  Those of property tests draw
fewer examples instead.  ``make long`` measures anew which they are.
"""

from __future__ import annotations

import json
import resource
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Mapping, Sequence

LONG = Path(__file__).with_name("long_tests.json")
LONG_S = 0.6
"""Tests whose cases take longer in all are thinned to that. [s, of the processor]"""
SHORT_S = 0.2
"""Unless each case takes less: every one may be another reason for a verdict. [s, of the processor]"""
WHOLE = ("tests/project/", "tests/rules/test_wrong_go_classes.py")
"""What is never thinned: the house itself, and the classes of wrong verdicts."""
ALL_EXAMPLES = 100
_BEGUN_S = pytest.StashKey[float]()
_TOOK = "processor_s"


def examples(count: int) -> int:
    """Return of how many examples a test is drawn that takes ``count`` in full, by the profile in use."""
    return max(count * settings().max_examples // ALL_EXAMPLES, 2)


def whole_test(case: str) -> str:
    """Return the test that a case is of, without its parameters."""
    return case.split("[", 1)[0]


def thinned(cases: Iterable[pytest.Item]) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the cases that are run, evenly spread over those of their tests, and those left out."""
    kept_of: dict[str, int] = json.loads(LONG.read_text(encoding="utf-8"))
    of_test: dict[str, list[pytest.Item]] = defaultdict(list)
    for case in cases:
        of_test[whole_test(case.nodeid)].append(case)
    run: list[pytest.Item] = []
    left_out: list[pytest.Item] = []
    for test, own in of_test.items():
        kept = min(kept_of.get(test, len(own)), len(own))
        places = {place * len(own) // kept for place in range(kept)}
        for place, case in enumerate(own):
            (run if place in places else left_out).append(case)
    return run, left_out


class Measuring:
    """Takes the processor time of every case, and writes down which tests take long."""

    def __init__(self) -> None:
        self._took_s: dict[str, list[float]] = defaultdict(list)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Generator[None]:
        """Note when a case begins."""
        item.stash[_BEGUN_S] = _processor_s()
        return (yield)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_teardown(self, item: pytest.Item) -> Generator[None]:
        """Add what a case took to its report."""
        try:
            return (yield)
        finally:
            item.user_properties.append((_TOOK, _processor_s() - item.stash[_BEGUN_S]))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collect what cases took."""
        took = dict(report.user_properties).get(_TOOK)
        if report.when == "teardown" and isinstance(took, float):
            self._took_s[whole_test(report.nodeid)].append(took)

    def write(self) -> None:
        """Write `LONG` anew, of all tests there are."""
        kept_of = long_tests(self._took_s)
        LONG.write_text(json.dumps(kept_of, indent=2) + "\n", encoding="utf-8")


def long_tests(took_s: Mapping[str, Sequence[float]]) -> dict[str, int]:
    """Return how many cases are run of tests that take long, by what each took; of a module one at least."""
    kept_of = {
        test: int(len(own) * LONG_S / sum(own))
        for test, own in sorted(took_s.items())
        if sum(own) > max(LONG_S, SHORT_S * len(own)) and not test.startswith(WHOLE)
    }
    of_module: dict[str, list[str]] = defaultdict(list)
    for test in took_s:
        of_module[test.split("::", 1)[0]].append(test)
    for own in of_module.values():
        if not any(kept_of.get(test, 1) for test in own):
            shortest = min(own, key=lambda test: sum(took_s[test]) / len(took_s[test]))
            kept_of[shortest] = 1
    return kept_of


def _processor_s() -> float:
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in usages)
