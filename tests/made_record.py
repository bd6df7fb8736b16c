"""Flight records made from a few columns, everything else unknown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from simulated_experiment import STEP_S, Flown

from planner.logs.record import Boundary, FlightRecord, LogFormat, LoggedHome
from planner.values import field_names

if TYPE_CHECKING:
    from planner.arrays import FloatArray


def make_record(*, is_landed: npt.NDArray[np.bool_], **columns: FloatArray) -> FlightRecord:
    """Return a record at 10 Hz with the columns given; numbers that are not given are NaN."""
    samples = is_landed.size
    unknown = {
        name: np.full(samples, np.nan)
        for name in field_names(FlightRecord)
        if FlightRecord.__annotations__[name] == "FloatArray"
    }
    known = {"time_s": np.arange(float(samples)) * STEP_S, "is_landed": is_landed, **columns}
    return FlightRecord(
        **{**unknown, **known},  # type: ignore[arg-type]  # all of them are columns
        mode=np.full(samples, "AUTO"),
        mission_item=np.zeros(samples, dtype=np.int64),
        duration_s=samples * STEP_S,
        begins_with=Boundary.ARMING,
        ends_with=Boundary.ARMING,
        number=1,
        begins_in_log_s=0.0,
        home=LoggedHome(
            latitude_deg=None, longitude_deg=None, altitude_amsl_m=None, found_in="nowhere"
        ),
        mission_items=(),
        parameters={},
        autopilot=None,
        firmware="",
        vehicle="",
        source="made",
        sha256="0" * 64,
        log_format=LogFormat.CSV,
        quantities=(),
    )


def record_of(flown: Flown, *, is_vertical: bool) -> FlightRecord:
    """Return the record of a simulated experiment, standing on the ground before and after it.

    A vertical flight is on the ground until its first step and again 40 s after its last.
    """
    landed = np.zeros(flown.time_s.size, dtype=np.bool_)
    if is_vertical:
        steps = np.flatnonzero(flown.steps)
        landed[: steps[0]] = True
        landed[steps[-1] + round(40.0 / STEP_S) :] = True
    names = ("reference_height_m", "reference_speed_m_s")
    told = dict.fromkeys(names, np.zeros(flown.time_s.size))
    told["reference_height_m" if is_vertical else "reference_speed_m_s"] = flown.reference
    if not is_vertical:
        told["reference_height_m"] = np.full(flown.time_s.size, 200.0)
    return make_record(
        is_landed=landed,
        height_above_home_m=flown.altitude_m,
        ground_speed_m_s=flown.speed_m_s,
        power_w=np.where(landed, 0.0, flown.power_w),
        **told,
    )
