"""A flat frame, east and north in metres, about one place on the Earth."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.geo import geodesy

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.geo.geodesy import FloatArray


@frozen
class LocalFrame:
    r"""The azimuthal equidistant projection of the WGS 84 ellipsoid about an origin.

    A point at geodesic distance s in direction :math:`\alpha` from the origin lies at east
    :math:`s \sin\alpha`, north :math:`s \cos\alpha`: distance and direction from the origin are
    exact everywhere, across the poles and the antimeridian too.  Between other points distances
    are stretched, crosswise most, by :math:`r^2 / 6R^2` at distance r from the origin:
    0.03 m in a 20 km leg 20 km away, 0.1 m at 35 km, 4 m in 100 km at 100 km, 0.4 % at 1000 km.
    Put the origin where the flying is, and take lengths of far missions from
    :func:`planner.geo.geodesy.leg_length_m`.

    A straight line here is taken for what an autopilot flies.  PX4 projects likewise (on a
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
        """Return the coordinates of points in this frame.

        Parameters
        ----------
        latitude_deg, longitude_deg : array_like
            The points; both broadcast. [°]

        Returns
        -------
        east_m, north_m : ndarray
            East and north of the origin. [m]
        """
        distance, azimuth_deg = geodesy.distance_m_and_azimuth_deg(
            self.latitude_deg, self.longitude_deg, latitude_deg, longitude_deg
        )
        azimuth = np.radians(azimuth_deg)
        return distance * np.sin(azimuth), distance * np.cos(azimuth)

    def latitude_longitude_deg(
        self, east_m: npt.ArrayLike, north_m: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return the positions of points of this frame, the inverse of :meth:`east_north_m`.

        Parameters
        ----------
        east_m, north_m : array_like
            East and north of the origin; both broadcast. [m]

        Returns
        -------
        latitude_deg : ndarray
            Latitude. [°]
        longitude_deg : ndarray
            Longitude, in [−180, 180). [°]
        """
        east, north = np.asarray(east_m, np.float64), np.asarray(north_m, np.float64)
        return geodesy.latitude_longitude_deg(
            self.latitude_deg,
            self.longitude_deg,
            np.hypot(east, north),
            np.degrees(np.arctan2(east, north)),
        )
