"""Values that no multirotor shows are left out before anything is made of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.catalogue.flight_log import VALUES_IMPOSSIBLE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
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
    kept = dict(recording.series)
    findings: list[Finding] = []
    for name, series in recording.series.items():
        limit = next(limit for end, limit in _LIMITS.items() if name.endswith(end))
        possible = np.abs(series.values) <= limit
        if np.all(possible):
            continue
        worst = series.values[np.argmax(np.abs(series.values))]
        findings.append(
            VALUES_IMPOSSIBLE.finding(
                f"{recording.file.source}: {numbers.count(int(np.sum(~possible)), 'impossible value')} "
                f"of {series.found_in} left out, such as {worst:.6g}"
            )
        )
        kept[name] = replace(series, time_s=series.time_s[possible], values=series.values[possible])
    return replace(
        recording,
        series={name: series for name, series in kept.items() if len(series)},
        findings=(*recording.findings, *findings),
    )
