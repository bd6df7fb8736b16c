r"""The wind as a vector, and how its speed grows with the height above the ground.

Two laws of the surface layer are known,

.. math:: U(h) = U_r (h / h_r)^a, \qquad U(h) = U_r \frac{\ln(h / z_0)}{\ln(h_r / z_0)},

the power law and the logarithmic law with roughness length :math:`z_0` (IEC 61400-1, normal wind
profile; a = 0.2 there).  Without either the wind is the same at every height.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    import numpy.typing as npt


class Wind(Value):
    """A steady horizontal wind, at every height the same or with a profile."""

    speed_m_s: float = 0.0
    """At the reference height, if there is one. [m s⁻¹]"""
    from_deg: float = 0.0
    """Direction it blows from, clockwise from north. [°]"""
    reference_height_m: float | None = None
    """Height above ground at which the speed holds; ``None``: at every height. [m]"""
    shear_exponent: float | None = None
    """Exponent of the power law. [-]"""
    roughness_length_m: float | None = None
    """Roughness length of the logarithmic law. [m]"""
    ground_below_m: float = 0.0
    """How far ground that is flown over lies below home, where a terrain is known; for the profile. [m]"""
    speed_sd_m_s: float = 0.0
    """Standard deviation of the speed; for the spread of a prediction alone. [m s⁻¹]"""
    from_sd_deg: float = 0.0
    """Standard deviation of the direction. [°]"""

    def __post_init__(self) -> None:
        for name in ("from_deg", "ground_below_m"):
            if not math.isfinite(getattr(self, name)):
                msg = f"wind {name} must be a number, got {getattr(self, name)}"
                raise ValueError(msg)
        for name in ("speed_m_s", "speed_sd_m_s", "from_sd_deg"):
            if not 0.0 <= getattr(self, name) < math.inf:
                msg = f"wind {name} must be zero or more, got {getattr(self, name)}"
                raise ValueError(msg)
        profiles = [self.shear_exponent, self.roughness_length_m]
        if profiles.count(None) != (2 if self.reference_height_m is None else 1):
            msg = (
                "a wind profile has reference_height_m and one of shear_exponent and "
                "roughness_length_m; a wind without profile has none of them"
            )
            raise ValueError(msg)
        if self.reference_height_m is not None and not 0.0 < self.reference_height_m < math.inf:
            msg = f"wind reference_height_m must be positive, got {self.reference_height_m}"
            raise ValueError(msg)
        if self.shear_exponent is not None and not 0.0 <= self.shear_exponent <= 1.0:
            msg = f"wind shear_exponent must be 0 to 1, got {self.shear_exponent}"
            raise ValueError(msg)
        if self.roughness_length_m is not None and not (
            0.0 < self.roughness_length_m < (self.reference_height_m or 0.0)
        ):
            msg = (
                "wind roughness_length_m must be positive and below reference_height_m, "
                f"got {self.roughness_length_m}"
            )
            raise ValueError(msg)

    @property
    def east_m_s(self) -> float:
        """Eastward component of the moving air. [m s⁻¹]"""
        return -self.speed_m_s * math.sin(math.radians(self.from_deg))

    @property
    def north_m_s(self) -> float:
        """Northward component of the moving air. [m s⁻¹]"""
        return -self.speed_m_s * math.cos(math.radians(self.from_deg))

    def speed_factor(self, height_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the speed at heights above home over that at the reference height. [-]

        At the height of home the profiles have no wind.  Below it the ground lies lower, how much is not
        asked: the profile as far above as below, up to the wind that is given.  Nor does the air stand
        still over lower ground at the height of home: as high above the lowest that is known, up to the wind
        that is given.

        Examples
        --------
        Four times the height, at an exponent of one half, has twice the wind:

        >>> wind = Wind(speed_m_s=5.0, reference_height_m=10.0, shear_exponent=0.5)
        >>> print(f"{wind.speed_factor(40.0):.1f}")
        2.0
        """
        height = np.asarray(height_m, dtype=np.float64)
        if self.reference_height_m is None:
            return np.ones(height.shape)
        above_ground_m = np.maximum(-height, height + self.ground_below_m)
        height = np.maximum(height, np.minimum(above_ground_m, self.reference_height_m))
        if self.shear_exponent is not None:
            ratio = height / self.reference_height_m
            return np.asarray(ratio**self.shear_exponent)
        roughness_m = self.roughness_length_m
        assert roughness_m is not None  # __post_init__ has asked for one of the two
        logarithm = np.log(np.maximum(height, roughness_m) / roughness_m)
        return np.asarray(logarithm / math.log(self.reference_height_m / roughness_m))
