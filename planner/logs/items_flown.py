"""Which item of a mission is flown when."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.logs.series import Series

if TYPE_CHECKING:
    from planner.logs.record import FloatArray


def items_flown(
    told_s: FloatArray,
    items: FloatArray,
    modes: tuple[tuple[float, str], ...],
    mission_mode: str,
    found_in: str,
) -> Series:
    """Return the items flown, from those current: an item stays current in other modes too.

    Parameters
    ----------
    told_s : ndarray
        When each item was told to be current. [s]
    items : ndarray
        Items, from 1.
    modes : tuple
        Time and name of each mode entered.
    mission_mode : str
        The mode that flies missions.
    found_in : str
        Message and field of the items.

    Returns
    -------
    Series
        Events; 0 outside the mission mode.
    """
    current = Series.of(told_s, items, found_in, is_event=True)
    entered_s = np.array([time_s for time_s, _ in modes])
    is_mission = np.array([False, *(name == mission_mode for _, name in modes)])
    times = np.union1d(told_s, entered_s)
    is_flown = is_mission[np.searchsorted(entered_s, times, side="right")]
    flown = np.where(is_flown, np.nan_to_num(current.at(times), nan=0.0), 0.0)
    return Series.of(times, flown, found_in, is_event=True)
