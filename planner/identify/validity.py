"""The box an identified model holds in: what was flown, and no more."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import IdentificationError
from planner.identify.commands import Answer
from planner.vehicle.keys import Interval
from planner.vehicle.model import ValidFor

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.assembly import Parts
    from planner.identify.settings import IdentificationSettings
    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_SHORT_SHARE = 0.005
"""By which the mean of what was flown falls short of what was commanded. [-]"""
_DENSITY_MARGIN = 0.01
"""Share by which the air may be thinner or denser than in the flights. [-]"""


def flown_box(
    records: Sequence[FlightRecord],
    parts: Parts,
    settings: IdentificationSettings,
    *,
    mass_kg: float | None,
) -> ValidFor:
    """Return the box of what was flown, no larger.

    Parameters
    ----------
    records : sequence of FlightRecord
        The flights.
    parts : Parts
        What was found.
    settings : IdentificationSettings
        Payload and reference.
    mass_kg : float or None
        Mass without payload; ``None`` where the power does not depend on it. [kg]

    Raises
    ------
    IdentificationError
        If neither a speed nor a height is known.
    """
    flown = [~r.is_landed for r in records]
    heights = _known([r.height_above_home_m for r in records], flown)
    steady = parts.steady
    speeds = [f.airspeed_m_s for f in steady]
    climbs = [f.climb_rate_m_s for f in steady]
    ramps = None if parts.ramps is None else parts.ramps.ramps
    if not steady or ramps is not None:  # means over manoeuvres are below the speeds flown in them
        speeds += [
            float(np.percentile(own, 99.0))
            for r, f in zip(records, flown, strict=True)
            if (own := _known([r.ground_speed_m_s], [f])).size
        ]
    if ramps is not None:
        climbs += [-ramps.descent_m_s, ramps.climb_m_s]
    speed = Interval(low=0.0, high=_outward(max(speeds), 0.1)) if speeds else None
    height = (
        Interval(
            low=min(0.0, -_outward(-float(heights.min()), 1.0)),
            high=_outward(float(heights.max()), 1.0),
        )
        if heights.size
        else None
    )
    if speed is None and height is None:
        msg = "the flights tell neither speed nor height: nothing is known of where a model would hold"
        raise IdentificationError(msg)
    is_mapped = parts.power.steady_map is not None or parts.power.vertical is not None
    densities = [f.air_density_kg_m3 for f in steady if f.air_density_kg_m3 is not None]
    hovers = [h.height_above_home_m for h in parts.hovers]
    steps = [
        abs(float(m.reference[-1] - m.reference[0]))
        for r in parts.responses
        if r.evidence is not None and r.evidence.name == Answer.ALTITUDE.value
        for m in r.evidence.manoeuvres
    ]
    is_stepped = settings.reference is Autopilot.STEP
    return ValidFor(
        speed_m_s=speed,
        height_above_home_m=height,
        hover_height_above_home_m=_interval(hovers, 1.0),
        altitude_step_m=(
            Interval(low=0.0, high=round(max(steps), 1)) if steps and is_stepped else None
        ),
        climb_rate_m_s=_interval(climbs, 0.1) if is_mapped else None,
        mass_kg=(
            Interval(
                low=mass_kg - settings.payload_deviation_kg,
                high=mass_kg + settings.payload_kg + settings.payload_deviation_kg,
            )
            if mass_kg is not None
            else None
        ),
        air_density_kg_m3=(
            Interval(
                low=round(min(densities) * (1.0 - _DENSITY_MARGIN), 4),
                high=round(max(densities) * (1.0 + _DENSITY_MARGIN), 4),
            )
            if densities and mass_kg is not None
            else None
        ),
    )


def _known(columns: Sequence[FloatArray], where: Sequence[npt.NDArray[np.bool_]]) -> FloatArray:
    joined = np.concatenate([c[w] for c, w in zip(columns, where, strict=True)])
    known: FloatArray = joined[np.isfinite(joined)]
    return known


def _interval(values: Sequence[float], step: float) -> Interval | None:
    if not values:
        return None
    return Interval(low=-_outward(-min(values), step), high=_outward(max(values), step))


def _outward(value: float, step: float) -> float:
    """Round up, away from what was flown: a mean falls a little short of its command."""
    beyond = value + _SHORT_SHARE * abs(value)
    return round(math.ceil(beyond / step - 1e-9) * step, 6)
