"""What every test shares: a gate that gives the same answer twice."""

import gc
import os

from hypothesis import settings

# pymavlink's mavutil and mavwp ask for it at different times; set in between, they contradict
# each other (mavwp then makes MISSION_ITEMs with a field that mavutil's dialect has not).
os.environ["MAVLINK20"] = "1"

# Two processes of tests share two cores: threads of their matrices, all small, only wait for each other.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

# The gate draws the same examples every time; look further with --hypothesis-profile=explore.
settings.register_profile("explore", deadline=None)
settings.register_profile("gate", derandomize=True, deadline=None)
settings.load_profile("gate")

# What collecting makes stays to the end: looking for garbage in it took a third of collecting.
gc.disable()


def pytest_collection_finish() -> None:
    """Look for garbage from here on, in what tests make."""
    gc.freeze()
    gc.enable()
