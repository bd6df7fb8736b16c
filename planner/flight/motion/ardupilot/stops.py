r"""How the vehicle comes to a stop: along its shaped reference, and behind it where that is known.

The autopilot shapes what it asks for; how the vehicle follows that was perhaps identified as a transfer
function G of steady gain 1 with a mean residence time τ.  Braking is cubic pieces of time, so that the
answer is exact (`planner.physics.response`): with v the reference and y the vehicle,

.. math:: y = G v, \qquad \int_t^\infty y\,dt' = \int_0^\infty v\,dt' + \tau v(0) - \int_0^t y\,dt',

the way left at a time t after braking began, for a vehicle that has cruised before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.speed_ramps import speed_ramps

if TYPE_CHECKING:
    from planner.flight.motion.ardupilot.legs import Legs
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.physics.response import TransferFunction
    from planner.vehicle.model import ManoeuvreResponse, Responses
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

BRAKING_FRACTION = 0.97
"""A stop counts from where the speed has fallen to this fraction of the cruise. [-]"""
_SHORTEST_RISE_S = 0.2
"""``calc_scurve_jerk_and_snap``: half the snap of a time constant of 0.1 s at least. [s]"""
_BISECTIONS = 30
"""Halvings of some ten seconds: to a hundred-millionth of one."""
_RESIDENCES = 20.0
"""After so many mean residence times a response has ended. [-]"""


def jerk_rise_s(parameters: ArduPilotParameters) -> float:
    """Return the time in which the jerk of an S-curve rises to its limit. [s]

    Notes
    -----
    ``calc_scurve_jerk_and_snap``: snap = J π / 4 max(ATC_INPUT_TC, 0.1), and
    ``calculate_path``: t_j = J π / 2 snap; that is twice the time constant.
    """
    return max(2.0 * parameters.attitude_time_constant_s, _SHORTEST_RISE_S)


def stopping_distance_m(
    speed_m_s: FloatArray,
    parameters: ArduPilotParameters,
    response: ManoeuvreResponse | None = None,
) -> FloatArray:
    """Return the way from 97 % of a speed to standing still, as stops are measured. (n,) [m]

    Parameters
    ----------
    speed_m_s : ndarray
        Speeds, zero or more. (n,) [m s⁻¹]
    parameters : ArduPilotParameters
        The vehicle's parameters.
    response : ManoeuvreResponse, optional
        How the speed follows its reference; default without any lag.

    Notes
    -----
    The S-curve's braking from v lasts T and takes v T/2.  The speed has fallen by 3 % after
    t = t_j/2 + sqrt(0.06 v/J), the way by then is v t − J (t − t_j/2)³/6.
    """
    speed = np.asarray(speed_m_s, np.float64)
    if response is not None:
        different, where = np.unique(speed, return_inverse=True)
        return _followed_stop_m(different, parameters, response)[where]
    full = np.ones(speed.shape)
    ramps = speed_ramps(
        speed,
        acceleration_m_s2=full * parameters.acceleration_m_s2,
        jerk_m_s3=full * parameters.jerk_m_s3,
        jerk_rise_s=full * jerk_rise_s(parameters),
    )
    lost = (1.0 - BRAKING_FRACTION) * speed
    since = np.sqrt(2.0 * lost / np.where(ramps.jerk_m_s3 > 0.0, ramps.jerk_m_s3, 1.0))
    before = speed * (ramps.rest_s + since) - ramps.jerk_m_s3 * since**3 / 6.0
    way: FloatArray = 0.5 * speed * ramps.duration_s - before
    return way


def _followed_stop_m(
    speed: FloatArray, parameters: ArduPilotParameters, response: ManoeuvreResponse
) -> FloatArray:
    """Return the ways of a vehicle that follows its braking reference with a lag. (n,) [m]"""
    from planner.physics.response import Edge, ShapedResponse

    system = response.transfer_function
    full = np.ones(speed.shape)
    ramps = speed_ramps(
        speed,
        acceleration_m_s2=full * parameters.acceleration_m_s2,
        jerk_m_s3=full * parameters.jerk_m_s3,
        jerk_rise_s=full * jerk_rise_s(parameters),
    )
    jerk = ramps.jerk_m_s3 / _steady_gain(system)
    begun, steady = ramps.rest_s, ramps.rest_s + ramps.jerk_s
    eased = steady + ramps.steady_s
    lost = ShapedResponse(
        system=system,
        edges=(
            Edge(jerk, begun, order=2),
            Edge(-jerk, steady, order=2),
            Edge(-jerk, eased, order=2),
            Edge(jerk, eased + ramps.jerk_s, order=2),
        ),
    )
    late_s = system.mean_residence_time_s
    low, high = 0.0 * speed, ramps.duration_s + _RESIDENCES * late_s
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        braking = lost.value(middle) >= (1.0 - BRAKING_FRACTION) * speed
        low, high = np.where(braking, low, middle), np.where(braking, middle, high)
    way: FloatArray = speed * (0.5 * ramps.duration_s + late_s - high) + lost.integral(high)
    return way


def settling_waits_s(
    legs: Legs, responses: Responses | None, parameters: ArduPilotParameters
) -> FloatArray:
    """Return how long after its reference the vehicle is within WP_RADIUS of where legs stop. (n,) [s]

    Parameters
    ----------
    legs : Legs
        Any; nothing is waited for where the end is passed.
    responses : Responses or None
        How the vehicle follows speed and altitude; level legs wait for the first, steep ones for the
        second, and for nothing where it was not identified.
    parameters : ArduPilotParameters
        The vehicle's parameters.

    Notes
    -----
    ``AC_WPNav``: a waypoint that is no corner is reached when the S-curve has ended and the vehicle is
    within the radius.
    """
    waits = np.zeros(len(legs.key))
    if responses is None:
        return waits
    stops = (legs.half_overlap_s == 0.0) & (legs.corner_speed_m_s == 0.0)
    steep = np.abs(legs.direction[:, 2]) > np.hypot(legs.direction[:, 0], legs.direction[:, 1])
    for response, some in ((responses.speed, ~steep), (responses.altitude, steep)):
        rows = np.flatnonzero(stops & some & legs.direction.any(axis=1))
        if response is not None and len(rows):
            waits[rows] = _waits_s(
                legs, rows, response.transfer_function, parameters.waypoint_radius_m
            )
    return waits


def _waits_s(legs: Legs, rows: IntArray, system: TransferFunction, radius_m: float) -> FloatArray:
    """Return the waits of some legs that stop, each begun at rest. (rows,) [s]"""
    from planner.physics.response import Edge, ShapedResponse

    curves = legs.curves
    phases = curves.phases()
    start, jerk = phases.start_s[rows], phases.jerk_m_s3[rows]
    steps = np.diff(jerk, axis=1, prepend=0.0) / _steady_gain(system)
    followed = ShapedResponse(
        system=system,
        edges=(
            Edge(curves.start_m_s[rows]),
            *(Edge(step, begin, order=2) for begin, step in zip(start.T, steps.T, strict=True)),
        ),
    )
    length, end = curves.length_m[rows], curves.duration_s[rows]
    low, high = end, end + _RESIDENCES * system.mean_residence_time_s
    late = np.abs(length - followed.integral(end)) > radius_m
    for _ in range(_BISECTIONS if late.any() else 0):
        middle = 0.5 * (low + high)
        near = np.abs(length - followed.integral(middle)) <= radius_m
        low, high = np.where(near, low, middle), np.where(near, middle, high)
    return np.where(late, high - end, 0.0)


def _steady_gain(system: TransferFunction) -> float:
    """Return what a response is divided by, so that the vehicle arrives where it is sent. [-]"""
    return system.dc_gain or 1.0
