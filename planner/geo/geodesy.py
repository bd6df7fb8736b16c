"""Geodesics on the WGS 84 ellipsoid, for arrays of points.

The inverse and the direct problem after T. Vincenty, "Direct and inverse solutions of geodesics
on the ellipsoid with application of nested equations", Survey Review XXIII (176), 1975,
pp. 88–93: right to well under a millimetre wherever a vehicle flies.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.arrays import FloatArray


SEMI_MAJOR_AXIS_M = 6_378_137.0
"""WGS 84 semi-major axis: NGA.STND.0036 version 1.0.0 (2014), table 3.1. [m]"""
FLATTENING = 1.0 / 298.257223563
"""WGS 84 flattening: NGA.STND.0036 version 1.0.0 (2014), table 3.1. [-]"""
SEMI_MINOR_AXIS_M = SEMI_MAJOR_AXIS_M * (1.0 - FLATTENING)
"""b = a (1 − f). [m]"""

_SECOND_ECCENTRICITY_SQUARED = (SEMI_MAJOR_AXIS_M / SEMI_MINOR_AXIS_M) ** 2 - 1.0
# 1e-13 rad are 0.6 µm; 20 km legs need 4 rounds, half the globe about 10.
_TOLERANCE_RAD = 1e-13
_MOST_ROUNDS = 40


def distance_m_and_azimuth_deg(
    from_latitude_deg: npt.ArrayLike,
    from_longitude_deg: npt.ArrayLike,
    to_latitude_deg: npt.ArrayLike,
    to_longitude_deg: npt.ArrayLike,
) -> tuple[FloatArray, FloatArray]:
    r"""Length of the geodesic between points, and its direction where it starts.

    Vincenty's inverse problem.  Pairs so nearly antipodal that the iteration does not converge
    (within some 70 km of the antipode) get the auxiliary sphere's great circle instead, which
    is within 0.6 % of the distance; nothing flies that far.

    The direction is clockwise from north, in [0, 360); 0 where both points are one.  At a pole,
    "north" is the direction of the given meridian carried over the pole. [m], [°]
    """
    start = _reduced_latitude_sin_cos(from_latitude_deg)
    end = _reduced_latitude_sin_cos(to_latitude_deg)
    difference_deg = np.asarray(to_longitude_deg, np.float64) - np.asarray(
        from_longitude_deg, np.float64
    )
    # The short way round; subtracting a whole number of turns keeps small differences exact.
    difference = np.radians(difference_deg - 360.0 * np.round(difference_deg / 360.0))

    longitude = difference
    for _ in range(_MOST_ROUNDS):
        arc = _auxiliary_arc(start, end, longitude)
        # Vincenty's equations 10 and 11.
        c = FLATTENING / 16.0 * arc.cos2_alpha * (4.0 + FLATTENING * (4.0 - 3.0 * arc.cos2_alpha))
        refined = difference + (1.0 - c) * FLATTENING * arc.sin_alpha * (
            arc.sigma
            + c * arc.sin_sigma * (arc.cos_2m + c * arc.cos_sigma * (2.0 * arc.cos_2m**2 - 1.0))
        )
        unsettled = np.abs(refined - longitude) > _TOLERANCE_RAD
        longitude = refined
        if not np.any(unsettled):
            break
    else:
        longitude = np.where(unsettled, difference, longitude)
        arc = _auxiliary_arc(start, end, longitude)

    a, b = _series_a_b(arc.cos2_alpha)
    # Vincenty's equation 19.
    distance = (
        SEMI_MINOR_AXIS_M
        * a
        * (arc.sigma - _sigma_correction(b, arc.sin_sigma, arc.cos_sigma, arc.cos_2m))
    )
    azimuth_deg = _whole_turns_off(np.degrees(np.arctan2(arc.across, arc.ahead)))
    return np.asarray(distance, np.float64), azimuth_deg


def distance_m(
    from_latitude_deg: npt.ArrayLike,
    from_longitude_deg: npt.ArrayLike,
    to_latitude_deg: npt.ArrayLike,
    to_longitude_deg: npt.ArrayLike,
) -> FloatArray:
    """Length of the geodesic between points, as :func:`distance_m_and_azimuth_deg`.

    Examples
    --------
    One minute of latitude at 45°, by definition about a nautical mile:

    >>> print(f"{distance_m(45.0, 7.0, 45.0 + 1 / 60, 7.0):.1f} m")
    1852.2 m
    """
    return distance_m_and_azimuth_deg(
        from_latitude_deg, from_longitude_deg, to_latitude_deg, to_longitude_deg
    )[0]


_LONGEST_DEGREE_M = math.radians(1.0) * SEMI_MAJOR_AXIS_M**2 / SEMI_MINOR_AXIS_M
"""Along the meridian at a pole: no degree of a meridian or a parallel is longer. [m]"""


def most_distance_m(from_deg: tuple[float, float], to_deg: tuple[float, float]) -> float:
    """Return at least the distance between two latitudes and longitudes: in the degrees between them. [m]"""
    across_deg = abs(to_deg[1] - from_deg[1])
    across_deg = min(across_deg, abs(across_deg - 360.0))
    return _LONGEST_DEGREE_M * (abs(to_deg[0] - from_deg[0]) + across_deg)


def latitude_longitude_deg(
    from_latitude_deg: npt.ArrayLike,
    from_longitude_deg: npt.ArrayLike,
    distance_m: npt.ArrayLike,
    azimuth_deg: npt.ArrayLike,
) -> tuple[FloatArray, FloatArray]:
    """Where a geodesic of a length and a direction at its start ends: Vincenty's direct problem.

    All four broadcast; longitudes are in [−180, 180). [°]
    """
    sin_u1, cos_u1 = _reduced_latitude_sin_cos(from_latitude_deg)
    azimuth = np.radians(np.asarray(azimuth_deg, np.float64))
    sin_azimuth, cos_azimuth = np.sin(azimuth), np.cos(azimuth)
    sin_alpha = cos_u1 * sin_azimuth
    cos2_alpha = 1.0 - sin_alpha**2
    sigma_1 = np.arctan2(sin_u1, cos_u1 * cos_azimuth)
    a, b = _series_a_b(cos2_alpha)
    spherical = np.asarray(distance_m, np.float64) / (SEMI_MINOR_AXIS_M * a)

    sigma = spherical
    for _ in range(_MOST_ROUNDS):  # Vincenty's equations 5 to 7
        before, cos_2m = sigma, np.cos(2.0 * sigma_1 + sigma)
        sigma = spherical + _sigma_correction(b, np.sin(sigma), np.cos(sigma), cos_2m)
        if not np.any(np.abs(sigma - before) > _TOLERANCE_RAD):
            break
    sin_sigma, cos_sigma = np.sin(sigma), np.cos(sigma)
    cos_2m = np.cos(2.0 * sigma_1 + sigma)
    # Vincenty's equations 8 to 11.
    latitude = np.arctan2(
        sin_u1 * cos_sigma + cos_u1 * sin_sigma * cos_azimuth,
        (1.0 - FLATTENING)
        * np.hypot(sin_alpha, sin_u1 * sin_sigma - cos_u1 * cos_sigma * cos_azimuth),
    )
    on_sphere = np.arctan2(
        sin_sigma * sin_azimuth, cos_u1 * cos_sigma - sin_u1 * sin_sigma * cos_azimuth
    )
    c = FLATTENING / 16.0 * cos2_alpha * (4.0 + FLATTENING * (4.0 - 3.0 * cos2_alpha))
    difference = on_sphere - (1.0 - c) * FLATTENING * sin_alpha * (
        sigma + c * sin_sigma * (cos_2m + c * cos_sigma * (2.0 * cos_2m**2 - 1.0))
    )
    longitude_deg = np.asarray(from_longitude_deg, np.float64) + np.degrees(difference)
    return (
        np.asarray(np.degrees(latitude), np.float64),
        _whole_turns_off(longitude_deg + 180.0) - 180.0,
    )


def _whole_turns_off(angle_deg: FloatArray) -> FloatArray:
    """Bring angles into [0, 360); the second remainder because −1e-15 % 360.0 is 360.0."""
    return np.asarray(angle_deg % 360.0 % 360.0, np.float64)


class _AuxiliaryArc(Value, kw_only=False, eq=False):
    """The great circle on Vincenty's auxiliary sphere for one guess of the longitude."""

    across: FloatArray
    ahead: FloatArray
    sigma: FloatArray
    sin_sigma: FloatArray
    cos_sigma: FloatArray
    sin_alpha: FloatArray
    cos2_alpha: FloatArray
    cos_2m: FloatArray


def _auxiliary_arc(
    start: tuple[FloatArray, FloatArray], end: tuple[FloatArray, FloatArray], longitude: FloatArray
) -> _AuxiliaryArc:
    """Vincenty's equations 14 to 18, from sine and cosine of the reduced latitudes."""
    (sin_u1, cos_u1), (sin_u2, cos_u2) = start, end
    sin_longitude, cos_longitude = np.sin(longitude), np.cos(longitude)
    across = cos_u2 * sin_longitude
    ahead = cos_u1 * sin_u2 - sin_u1 * cos_u2 * cos_longitude
    sin_sigma = np.hypot(across, ahead)
    cos_sigma = sin_u1 * sin_u2 + cos_u1 * cos_u2 * cos_longitude
    # One point twice has no direction (sin σ = 0), the equator no σm (cos² α = 0); what is put
    # in their places is multiplied by zero later.
    sin_alpha = cos_u1 * across / np.where(sin_sigma == 0.0, 1.0, sin_sigma)
    cos2_alpha = 1.0 - sin_alpha**2
    cos_2m = cos_sigma - 2.0 * sin_u1 * sin_u2 / np.where(cos2_alpha == 0.0, 1.0, cos2_alpha)
    sigma = np.arctan2(sin_sigma, cos_sigma)
    cos_2m = np.clip(cos_2m, -1.0, 1.0)
    return _AuxiliaryArc(across, ahead, sigma, sin_sigma, cos_sigma, sin_alpha, cos2_alpha, cos_2m)


def _reduced_latitude_sin_cos(latitude_deg: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Sine and cosine of the reduced latitude U, tan U = (1 − f) tan φ."""
    latitude = np.radians(np.asarray(latitude_deg, np.float64))
    sine, cosine = (1.0 - FLATTENING) * np.sin(latitude), np.cos(latitude)
    length = np.hypot(sine, cosine)
    return sine / length, cosine / length


def _series_a_b(cos2_alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vincenty's A and B, equations 3 and 4."""
    u2 = cos2_alpha * _SECOND_ECCENTRICITY_SQUARED
    a = 1.0 + u2 / 16384.0 * (4096.0 + u2 * (-768.0 + u2 * (320.0 - 175.0 * u2)))
    b = u2 / 1024.0 * (256.0 + u2 * (-128.0 + u2 * (74.0 - 47.0 * u2)))
    return a, b


def _sigma_correction(
    b: FloatArray, sin_sigma: FloatArray, cos_sigma: FloatArray, cos_2m: FloatArray
) -> FloatArray:
    """Vincenty's Δσ, equation 6."""
    double = 2.0 * cos_2m**2 - 1.0  # cos 4σm
    triple = cos_2m * (4.0 * sin_sigma**2 - 3.0) * (4.0 * cos_2m**2 - 3.0)
    correction: FloatArray = (
        b * sin_sigma * (cos_2m + b / 4.0 * (cos_sigma * double - b / 6.0 * triple))
    )
    return correction


_STEEPEST_DEG = 85.0
"""Beyond it ArduPilot's metres are none, and nobody flies it there. [°]"""


def bow_m(way_m: FloatArray, fraction: FloatArray, latitude_deg: float) -> FloatArray:
    """Return how far a leg is from the straight line of a local frame: (n, 2) east and north. [m]

    Of the way of the whole leg, (n, 2) [m], at fractions of it from 0 to 1, (n,).  With e, n the way, u the
    fraction and k = tan φ / 2R: u (1 − u) k (e n, −e²), to second order of way over radius of the Earth.  At
    47° the middle of a leg of 20 km along a parallel lies 8.4 m south of the straight line: on the parallel.
    """
    latitude = math.radians(max(-_STEEPEST_DEG, min(_STEEPEST_DEG, latitude_deg)))
    bend = math.tan(latitude) / (2.0 * SEMI_MAJOR_AXIS_M)
    east, north = way_m[:, 0], way_m[:, 1]
    weight = fraction * (1.0 - fraction) * bend
    return np.column_stack((weight * east * north, -weight * east**2))


def straight_length_m(tolerance_m: float, latitude_deg: float) -> float:
    """Return the greatest length of a leg that is straight within a tolerance. [m]"""
    latitude = math.radians(min(_STEEPEST_DEG, abs(latitude_deg)))
    bend = math.tan(latitude) / (8.0 * SEMI_MAJOR_AXIS_M)
    return math.sqrt(tolerance_m / bend) if bend > 0.0 else math.inf


class LocalFrame(Value):
    r"""The azimuthal equidistant projection of the WGS 84 ellipsoid about an origin.

    A point at geodesic distance s in direction :math:`\alpha` from the origin lies at east
    :math:`s \sin\alpha`, north :math:`s \cos\alpha`: distance and direction from the origin are
    exact everywhere, across the poles and the antimeridian too.  Between other points distances
    are stretched, crosswise most, by :math:`r^2 / 6R^2` at distance r from the origin:
    0.03 m in a 20 km leg 20 km away, 0.1 m at 35 km, 4 m in 100 km at 100 km, 0.4 % at 1000 km.
    Put the origin where the flying is, and take lengths of far missions from
    :func:`planner.geo.geodesy.leg_length_m`.

    A straight line here is assumed to be what an autopilot flies.  PX4 projects likewise (on a
    sphere): its lines stay within 3 cm of these over 20 km.  ArduPilot scales degrees of
    longitude by the cosine of the mean latitude, so that its lines bow away by up to
    :math:`L^2 \tan(\phi) / 8R` over a leg of length L: at 47° 2 cm in 1 km, 0.5 m in 5 km,
    8.4 m in 20 km.
    """

    latitude_deg: float
    """Latitude of the origin. [°]"""
    longitude_deg: float
    """Longitude of the origin. [°]"""

    def __post_init__(self) -> None:
        if not -90.0 <= self.latitude_deg <= 90.0:  # `not` also refuses NaN
            msg = f"latitude_deg must be in [-90, 90], got {self.latitude_deg}"
            raise ValueError(msg)
        if not math.isfinite(self.longitude_deg):
            msg = f"longitude_deg must be finite, got {self.longitude_deg}"
            raise ValueError(msg)

    def east_north_m(
        self, latitude_deg: npt.ArrayLike, longitude_deg: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return the coordinates of points in this frame."""
        if not np.size(latitude_deg):  # most missions have no rally points and move no home
            return np.zeros(np.shape(latitude_deg)), np.zeros(np.shape(latitude_deg))
        distance, azimuth_deg = distance_m_and_azimuth_deg(
            self.latitude_deg, self.longitude_deg, latitude_deg, longitude_deg
        )
        azimuth = np.radians(azimuth_deg)
        return distance * np.sin(azimuth), distance * np.cos(azimuth)

    def latitude_longitude_deg(
        self, east_m: npt.ArrayLike, north_m: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return latitudes and longitudes of points of this frame, as `latitude_longitude_deg`."""
        east, north = np.asarray(east_m, np.float64), np.asarray(north_m, np.float64)
        return latitude_longitude_deg(
            self.latitude_deg,
            self.longitude_deg,
            np.hypot(east, north),
            np.degrees(np.arctan2(east, north)),
        )
