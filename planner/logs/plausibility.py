"""Values that no multirotor shows are left out before anything is made of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.catalogue.flight_log import VALUES_IMPOSSIBLE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.logs.recording import Recording

_LIMITS: Mapping[str, float] = {
    "latitude_deg": 90.0,
    "_deg": 720.0,
    "_m_s": 300.0,
    "_amsl_m": 20e3,
    "height_m": 20e3,
    "_home_m": 20e3,
    "_m": 20e6,
    "_v": 2e3,
    "_a": 5e3,
    "_w": 1e6,
}
"""Greatest absolute values by the end of a quantity's name, the first that fits; metres that are
no heights are as far as half around the Earth."""


_PLACE = ("latitude_deg", "longitude_deg")
_NONE = np.zeros(0, np.bool_)


def plausible(recording: Recording) -> Recording:
    """Return a recording without impossible values, and with a finding where there were some.

    Parameters
    ----------
    recording : Recording
        As it was read.

    Returns
    -------
    Recording
        The same where everything is possible.
    """
    possible = {
        name: np.abs(series.values) <= _limit(name) for name, series in recording.series.items()
    }
    findings = []
    for name, series in recording.series.items():
        if np.all(possible[name]):
            continue
        worst = series.values[np.argmax(np.abs(series.values))]
        impossible = numbers.count(int(np.sum(~possible[name])), "impossible value")
        findings.append(
            VALUES_IMPOSSIBLE.finding(
                f"{recording.file.source}: {impossible} of {series.found_in} left out, such as "
                f"{worst:.6g}"
            )
        )
    latitude, longitude = (possible.get(name, _NONE) for name in _PLACE)
    if len(latitude) == len(longitude):  # half a place is none
        possible |= dict.fromkeys(_PLACE, latitude & longitude)
    kept = {
        name: replace(
            series, time_s=series.time_s[possible[name]], values=series.values[possible[name]]
        )
        for name, series in recording.series.items()
        if np.any(possible[name])
    }
    return replace(recording, series=kept, findings=(*recording.findings, *findings))


def _limit(name: str) -> float:
    return next(limit for end, limit in _LIMITS.items() if name.endswith(end))
