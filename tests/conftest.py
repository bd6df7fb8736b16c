"""What every test shares: a gate that gives the same answer twice."""

from __future__ import annotations

import gc
import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings
from thinning import ALL_EXAMPLES, Measuring, thinned

if TYPE_CHECKING:
    from collections.abc import Generator

HERE = Path(__file__).resolve().parent
WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")
WORKERS = os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")

# pymavlink's mavutil and mavwp ask for it at different times; set in between, they contradict
# each other (mavwp then makes MISSION_ITEMs with a field that mavutil's dialect has not).
os.environ["MAVLINK20"] = "1"

# Two processes of tests share two cores: threads of their matrices, all small, only wait for each other.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

# The gate draws the same examples every time; look further with --hypothesis-profile=explore.
settings.register_profile("explore", deadline=None)
settings.register_profile("whole", derandomize=True, deadline=None, max_examples=ALL_EXAMPLES)
settings.register_profile("thinned", derandomize=True, deadline=None, max_examples=12)
settings.load_profile("whole")

# What collecting makes stays to the end: looking for garbage in it took a third of collecting.
gc.disable()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the gate leave out what takes long, and what that is be measured."""
    parser.addoption("--thinned", action="store_true", help="leave out most cases of long tests")
    parser.addoption("--measured", action="store_true", help="write down which tests take long")


def pytest_configure(config: pytest.Config) -> None:
    """Draw few examples where tests are thinned."""
    if config.getoption("--thinned"):
        settings.load_profile("thinned")
    if config.getoption("--measured"):
        config.pluginmanager.register(Measuring(), Measuring.__name__)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write down which tests take long, where that was measured."""
    measuring = session.config.pluginmanager.get_plugin(Measuring.__name__)
    if measuring is not None and not WORKER:
        measuring.write()


def pytest_collection_finish() -> None:
    """Look for garbage from here on, in what tests make."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let each worker begin to collect in another room: what one has compiled, the others read."""
    report = yield
    if WORKER and isinstance(collector, pytest.Directory) and collector.path == HERE:
        files = [len(list(room.path.rglob("test_*.py"))) for room in report.result]
        before = sum(files) * int(WORKER.removeprefix("gw")) / int(WORKERS)
        first = sum(sum(files[: room + 1]) <= before for room in range(len(files)))
        report.result = report.result[first:] + report.result[:first]
    return report


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Order tests as they stand, wherever collecting began: workers have to agree on it."""
    if WORKER:
        items.sort(key=lambda item: item.path)
    if config.getoption("--thinned"):
        items[:], left_out = thinned(items)
        config.hook.pytest_deselected(items=left_out)
