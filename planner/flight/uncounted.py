r"""What a flight may take, at most, where its model says nothing: in wind, in air, beyond its airspeeds.

Power beyond the airspeed :math:`V_k` up to which a model was identified is bounded by

.. math:: P(V) \le P(V_k)\,(V / V_k)^3,

because no part of the power of level flight grows faster: drag takes :math:`D V \sim V^3`, induced power
falls until the thrust is all drag, then :math:`T^2 / V \sim V^3`, profile power :math:`1 + k \mu^2` grows
with the square of the speed and with :math:`T^{3/2} \sim V^3` at most (J. G. Leishman, Principles of
Helicopter Aerodynamics, 2nd edition, 2006, chapter 5).

Or the vehicle is at the limit of its lean there: it flies at :math:`V_k`, which it was seen to hold,
and later arrives.  Of both the dearer counts.  What lies between, an airspeed :math:`V_l` held on the
way, is not dearer: :math:`V_l^3 / (V_l - w)` has its only extremum at :math:`V_l = 1.5\,w`, a minimum.
No airspeed is too far beyond for that: the lean is limited, and with it the thrust, 1/cos 30° of the weight,
which rule E116 asks for.

A model without an airspeed term gives no power over airspeed: it grows from the ground speed to the
airspeed as that of the quadrotor it was measured on, both over the highest identified speed.  In air
that is not counted all power at one thrust grows with :math:`1 / \sqrt\rho`: induced power does, and of
blades that turn faster profile power too.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.motion.headway import SLOWEST_M_S, headway_m_s
from planner.flight.motion.kinematics import (
    QUADRATURE_WEIGHTS,
    STATE_INDEX,
    FlightState,
    KinematicState,
)
from planner.flight.reach import SituationKind, situations_flown
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.physics.wind import Wind
from planner.units import j_from_wh, wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Flight
    from planner.flight.reach import Situations
    from planner.flight.returns.path import FlownReturns
    from planner.vehicle.model import VehicleModel

_MEASURED_SPEED = np.array([0.0, 3.0, 5.0, 8.0, 10.0, 12.0, 15.0]) / 15.0
_MEASURED_W = np.array([353.0, 331.0, 307.0, 298.0, 322.0, 370.0, 482.0])
"""Power of the recorded survey quadrotor over the fraction of its highest airspeed, 15 m/s. [-], [W]"""
_ROUNDING = 1e-9
"""An airspeed this little over one that is held is that one. [-]"""
_HOVER = STATE_INDEX[FlightState.HOVER]


class Uncounted(Value, eq=False):
    """What a flight may take above its prediction, whatever it flies on."""

    segments_wh: FloatArray
    """Of each segment of the flight, at most; infinite where the vehicle may not come forward. (s,) [Wh]"""
    late_s: FloatArray
    """How much longer each may last, at most, where the vehicle holds no such airspeed. (s,) [s]"""
    returns_wh: FloatArray
    """Of each return from the points looked at, at most. (n,) [Wh]"""
    returns_worst: FloatArray
    """Fraction of the power in the worst situation of each. (n,) [-]"""
    returns_longer: float
    """Fraction of the time of a return, as `late_s`. [-]"""

    @classmethod
    def of(
        cls,
        flight: Flight,
        reach: Situations,
        shown_m_s: float | None = None,
        *,
        later_s: FloatArray,
        back: FlownReturns | None = None,
    ) -> Uncounted:
        """Return what a flight may take in all situations it may come to, and the returns looked at.

        ``shown_m_s`` is the highest airspeed its model shows it to hold; default what it was identified at.
        ``later_s`` is what its segments take longer than predicted, at the power of a hover and so many
        times more of it as the worst of their situations. (s,) [s]
        """
        motion, count = flight.motion, len(later_s)
        more, longer = (one - 1.0 for one in situation_ratios(flight.power, reach, shown_m_s))
        late_s, returned = np.zeros(count), 0 if back is None else len(back.destination)
        if not (more.any() or longer.any()):
            return cls(
                segments_wh=np.zeros(count),
                late_s=late_s,
                returns_wh=np.zeros(returned),
                returns_worst=np.zeros(returned),
                returns_longer=0.0,
            )
        of_mission, mission_longer = (
            one[reach.kind == SituationKind.MISSION].reshape(flight.node_power_w.shape)
            for one in (more, longer)
        )
        of_returns = more[reach.kind == SituationKind.RETURN]
        segments_j, returns_j = np.full(count, np.inf), np.full(returned, np.inf)
        worst_of_returns = np.full(returned, np.inf)
        if np.isfinite(more).all():
            segments_j, worst = _added_j(flight, of_mission, motion.piece_segment, count)
            segments_j += flight.hover_near_home_w * later_s * worst
            late_s = _lost_s(motion, mission_longer)
            if back is not None:
                of_pieces = of_returns.reshape(back.flight.node_power_w.shape)
                returns_j, worst_of_returns = _added_j(
                    back.flight, of_pieces, back.piece_point, returned
                )
                stops = np.maximum(worst_of_returns, worst[back.points.segment])
                returns_j += j_from_wh(back.points.stop_wh) * stops
        return cls(
            segments_wh=np.asarray(wh_from_j(segments_j), np.float64),
            late_s=late_s,
            returns_wh=np.asarray(wh_from_j(returns_j), np.float64),
            returns_worst=worst_of_returns,
            returns_longer=float(longer[reach.kind == SituationKind.RETURN].max(initial=0.0)),
        )

    @property
    def flown_wh(self) -> float:
        """What the flight may take above its prediction, at most; infinite as its segments. [Wh]"""
        return float(self.segments_wh.sum())

    def returned_wh(self, segment: IntArray, late_wh: FloatArray) -> FloatArray:
        """Return what the returns may take more, with the flight up to the segments' ends. (n,) [Wh]

        ``late_wh`` is what each takes for being later than predicted. (n,) [Wh]
        """
        if not math.isfinite(self.flown_wh):
            return np.full(len(segment), np.inf)
        back_wh = self.returns_wh + late_wh * self.returns_worst
        return np.asarray(np.cumsum(self.segments_wh)[segment] + back_wh)


def _added_j(
    flight: Flight, more: FloatArray, owner: IntArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return what pieces take more by the fractions at their nodes (p, k), and the worst of these. [J], [-]

    Of each owner (p,), of so many. (n,), (n,)
    """
    added_w = np.maximum(flight.node_power_w, 0.0) * more
    pieces_j = added_w @ QUADRATURE_WEIGHTS * flight.motion.piece_duration_s
    worst = np.zeros(count)
    np.maximum.at(worst, owner, more.max(axis=1))
    return np.asarray(np.bincount(owner, pieces_j, count), np.float64), worst


def situation_ratios(
    power: SteadyPower, reach: Situations, shown_m_s: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return the power and the time that situations may take over those predicted, at least 1. (n,), (n,) [-]

    Time lost against the wind, or for want of lean, is counted as power too.
    """
    more, longer = _airspeed_ratios(power, reach, shown_m_s)
    if not power.vehicle.knows_air_density:
        density = power.air_density_kg_m3(reach.height_m)
        more = more * np.sqrt(np.maximum(SEA_LEVEL_DENSITY_KG_M3 / density, 1.0))
    return more, longer


def late_segments_s(
    motion: Motion, vehicle: VehicleModel, wind: Wind, shown_m_s: float | None
) -> FloatArray:
    """Return how much longer the segments of a motion may last for want of airspeed, at most. (s,) [s]

    As `Uncounted.late_s`; none where it may not come forward at all, which E105 and E108 report.
    """
    longer = _late_ratios(vehicle, wind, situations_flown(motion), shown_m_s) - 1.0
    if not np.isfinite(longer).all():
        return np.zeros(len(motion.segments.item))
    return _lost_s(motion, longer.reshape(motion.nodes.state.height_m.shape))


def _lost_s(motion: Motion, longer: FloatArray) -> FloatArray:
    """Return how much longer segments last, by the fractions at the nodes of their pieces. (s,) [s]"""
    pieces_s = longer @ QUADRATURE_WEIGHTS * motion.piece_duration_s
    sums_s = np.bincount(motion.piece_segment, pieces_s, len(motion.segments.item))
    return np.asarray(sums_s, np.float64)


def _late_ratios(
    vehicle: VehicleModel, wind: Wind, reach: Situations, shown_m_s: float | None
) -> FloatArray:
    """Return the time that situations may take over that predicted, for want of airspeed. (n,) [-]"""
    longer, limit = np.ones(len(reach.item)), vehicle.valid_for.speed_m_s
    if limit is None or limit.high <= 0.0:
        return longer
    held_m_s = held_airspeed_m_s(vehicle, limit.high, shown_m_s)
    if _is_within(vehicle, wind, reach, limit.high, held_m_s):
        return longer
    air_m_s, ground_m_s = reach.airspeed_m_s(wind), reach.ground_speed_m_s
    late = np.flatnonzero((air_m_s > held_m_s * (1.0 + _ROUNDING)) & (ground_m_s > 0.0))
    if len(late):
        slower_m_s = headway_m_s(
            np.stack((reach.east_m_s, reach.north_m_s), axis=1)[late],
            reach.height_m[late, None],
            wind=wind,
            airspeed_limit_m_s=held_m_s,
        )
        times = np.full(len(late), np.inf)
        comes = slower_m_s > SLOWEST_M_S
        times[comes] = ground_m_s[late][comes] / slower_m_s[comes]
        longer[late] = np.maximum(times, 1.0)
    return longer


def held_airspeed_m_s(
    vehicle: VehicleModel, identified_m_s: float, shown_m_s: float | None
) -> float:
    """Return the highest airspeed a vehicle is sure to hold: its limit less two deviations. [m s⁻¹]"""
    limit_m_s, fraction = vehicle.airspeed_limit_m_s, vehicle.airspeed_limit_fraction
    if shown_m_s is None:
        shown_m_s = identified_m_s if limit_m_s is None else limit_m_s
    return shown_m_s * (1.0 if limit_m_s is None else 1.0 - 2.0 * (fraction or 0.0))


def _is_within(
    vehicle: VehicleModel, wind: Wind, reach: Situations, identified_m_s: float, held_m_s: float
) -> bool:
    """Return whether there is no wind, and no speed beyond those identified and held.

    Reference steps overshoot within the flights that their responses were identified on.
    """
    is_step = vehicle.reference is Autopilot.STEP
    is_identified = is_step or bool(reach.ground_speed_m_s.max() <= identified_m_s)
    return not wind.speed_m_s > 0.0 and is_identified and held_m_s >= identified_m_s


def _airspeed_ratios(
    power: SteadyPower, reach: Situations, shown_m_s: float | None
) -> tuple[FloatArray, FloatArray]:
    vehicle, limit = power.vehicle, power.vehicle.valid_for.speed_m_s
    more = np.ones(len(reach.item))
    if limit is None or limit.high <= 0.0:
        return more, more
    held_m_s = held_airspeed_m_s(vehicle, limit.high, shown_m_s)
    if _is_within(vehicle, power.wind, reach, limit.high, held_m_s):
        return more, more
    air_m_s, ground_m_s = reach.airspeed_m_s(power.wind), reach.ground_speed_m_s
    longer = _late_ratios(vehicle, power.wind, reach, shown_m_s)
    flown_m_s = air_m_s if vehicle.airspeed_limit_m_s is None else np.minimum(air_m_s, held_m_s)
    is_seen = vehicle.knows_airspeed & (flown_m_s <= limit.high)
    rows = np.flatnonzero(~is_seen | (longer > 1.0))
    if not len(rows):
        return more, longer
    # Of the others nothing is to be added.
    reach, is_seen, times = reach.select(rows), is_seen[rows], longer[rows]
    air_m_s, ground_m_s, flown_m_s = air_m_s[rows], ground_m_s[rows], flown_m_s[rows]
    predicted_w = (
        _steady_w(power, reach, air_m_s)
        if vehicle.knows_airspeed
        else _measured_w(ground_m_s / limit.high)
    )

    def at(airspeed_m_s: FloatArray) -> FloatArray:
        over = np.maximum(airspeed_m_s / limit.high, 1.0)
        if vehicle.knows_airspeed:
            known_w = _steady_w(power, reach, np.minimum(airspeed_m_s, limit.high))
            return np.asarray(known_w * over**3 / predicted_w)
        return np.asarray(_measured_w(airspeed_m_s / limit.high) / predicted_w)

    own = np.where(is_seen, 1.0, np.maximum(at(flown_m_s), 1.0))
    late = np.flatnonzero(times > 1.0)
    if len(late):
        held_w = at(np.minimum(air_m_s, held_m_s))
        own[late] = np.maximum(own[late], held_w[late] * times[late])
    more[rows] = own
    return more, longer


def _steady_w(power: SteadyPower, reach: Situations, airspeed_m_s: FloatArray) -> FloatArray:
    """Return the steady power of the model at airspeeds, with the climbs of situations. (n,) [W]"""
    zero = np.zeros(len(airspeed_m_s))
    state = KinematicState(
        east_m=zero,
        north_m=zero,
        height_m=reach.height_m,
        east_m_s=airspeed_m_s,
        north_m_s=zero,
        climb_m_s=reach.climb_m_s,
    )
    calm = replace(power, wind=Wind())
    watts = calm.power_w(state, np.full(len(zero), _HOVER), zero)
    return np.maximum(watts, np.finfo(np.float64).tiny)


def _measured_w(speed: FloatArray) -> FloatArray:
    """Return the power of that quadrotor at fractions of its highest airspeed; as drag beyond. (n,) [W]"""
    within_w = np.interp(speed, _MEASURED_SPEED, _MEASURED_W)
    return np.asarray(within_w * np.maximum(speed, 1.0) ** 3)
