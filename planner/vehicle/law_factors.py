r"""How far a law by momentum theory may be off, and what that does to the power of each steady flight.

A law is taken apart into factors that flights tell one by one: what hovering takes; how that is divided
between blades and induced flow; the area of the disks, at the same hover; the other coefficients.  How far
each may be off is the standard deviation of its logarithm, so that with the slopes :math:`g_s` of the
logarithm of the power of a steady flight s the variance of the latter is :math:`g_s^T C g_s`.
"""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from planner.physics.rotor import Rotor, momentum_power_w
from planner.values import Value, field_values
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.arrays import FloatArray
    from planner.vehicle.model import ModelSpread, VehicleModel

THEORY_FRACTION = 0.03
"""How far momentum theory is from the mean power of one steady flight, relative: between 1 and 3 % in
the fits of the shipped models. [-]"""
STATE_FLIGHTS = {
    "takeoff": "climb",
    "climb": "climb",
    "accelerate": "cruise",
    "cruise": "cruise",
    "brake": "cruise",
    "descend": "descend",
    "land": "descend",
}
"""Which steady flights say how far the energy of a state may be off, besides that of hover."""
STEADY_FLIGHTS = {
    "hover": [(0.0, 0.0)],
    "cruise": [(5.0, 0.0), (10.0, 0.0)],
    "climb": [(0.0, 2.5)],
    "descend": [(0.0, -1.5)],
}
"""Airspeeds and climb rates at which that is looked at: the default speeds of PX4 and ArduPilot. [m/s]"""
_STEP = 1e-4
"""Of a logarithm, for a slope. [-]"""


def moved_rotor(rotor: Rotor, logarithms: Mapping[str, float]) -> Rotor:
    """Return a rotor with its factors multiplied, given by the logarithms of what they are multiplied by."""
    factor = {name: math.exp(one) for name, one in logarithms.items()}
    disk = factor.get("disk_area_m2", 1.0)
    # of a larger disk the ideal power is less: the same hover takes more for each watt of that
    hover = factor.get("hover", 1.0) * math.sqrt(disk)
    induced, profile = rotor.induced_factor, rotor.profile_factor
    moved_profile = factor.get("profile_ratio", 1.0) * profile
    kept = (induced + profile) / (induced + moved_profile)
    return rotor._replace(
        disk_area_m2=rotor.disk_area_m2 * disk,
        induced_factor=induced * kept * hover,
        profile_factor=moved_profile * kept * hover,
        profile_speed_factor=rotor.profile_speed_factor * factor.get("profile_speed_factor", 1.0),
        axial_factor=rotor.axial_factor * factor.get("axial_factor", 1.0),
        drag_area_m2=rotor.drag_area_m2 * factor.get("drag_area_m2", 1.0),
    )


class LawSpread(Value, eq=False):
    """How far the factors of a law may be off."""

    names: tuple[str, ...]
    covariance: FloatArray
    """Of their logarithms. [-]"""

    @classmethod
    def of_model(cls, spread: ModelSpread) -> LawSpread:
        """Return what the spread of a model says of its law."""
        known = {name: of for name, of in spread.law_fraction if name in MOVED}
        deviations = np.array(list(known.values()))
        correlation = np.eye(len(known))
        if spread.law_correlation:
            rows, columns = np.tril_indices(len(known), -1)
            correlation[rows, columns] = correlation[columns, rows] = spread.law_correlation
        return cls(names=tuple(known), covariance=correlation * np.outer(deviations, deviations))

    @classmethod
    def of_fit(cls, rotor: Rotor, log_covariance: FloatArray) -> LawSpread:
        """Return that of a law whose numbers were fitted, by the covariance of their logarithms."""
        numbers = rotor._fields[: len(log_covariance)]
        of = np.eye(len(numbers))
        row = {name: of[numbers.index(name)] for name in numbers}
        share = rotor.profile_factor / (rotor.induced_factor + rotor.profile_factor)
        induced, profile, disk = (
            row[name] for name in ("induced_factor", "profile_factor", "disk_area_m2")
        )
        # the inverse of what `moved_rotor` does
        told = {
            "hover": (1.0 - share) * induced + share * profile - 0.5 * disk,
            "profile_ratio": profile - induced,
        }
        slopes = np.array([told.get(name, row.get(name)) for name in MOVED])
        return cls(names=MOVED, covariance=slopes @ log_covariance @ slopes.T)

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of each logarithm. [-]"""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def law_fraction(self) -> tuple[tuple[str, float], ...]:
        """What a model file holds of it."""
        rounded = (float(f"{one:.3g}") for one in self.deviations.tolist())
        return tuple(zip(self.names, rounded, strict=True))

    @property
    def law_correlation(self) -> tuple[float, ...]:
        """What a model file holds of it besides; nothing where nothing is correlated."""
        correlation = self.covariance / np.outer(self.deviations, self.deviations)
        found = correlation[np.tril_indices(len(self.names), -1)].tolist()
        return (
            tuple(round(one, 5) for one in found) if any(abs(one) > 1e-3 for one in found) else ()
        )


MOVED = (
    "hover",
    "profile_ratio",
    "profile_speed_factor",
    "axial_factor",
    "drag_area_m2",
    "disk_area_m2",
)
"""Factors of a law that `moved_rotor` knows."""


class EnergyFractions(Value):
    """How far the power by a law may be off, as standard deviations."""

    shared: float
    """Of hover, which all states share. [-]"""
    beside: Mapping[str, float]
    """Of each steady flight besides. [-]"""

    def of_states(self, theory: float = THEORY_FRACTION) -> tuple[tuple[str, float], ...]:
        """Return how far the energy of each state may be off besides, what theory is off by in it."""
        return tuple(
            (state, round(math.hypot(self.beside[flight], theory), 4))
            for state, flight in STATE_FLIGHTS.items()
        )


def _log_slopes(
    rotor: Rotor,
    law: LawSpread,
    airspeed_m_s: FloatArray,
    climb_rate_m_s: FloatArray,
    *,
    mass_kg: float,
    air_density_kg_m3: float,
    avionics_w: float,
) -> FloatArray:
    """Return the slopes of the logarithm of power over those of the factors. (n, factors)"""

    def log_powers(logarithms: FloatArray) -> FloatArray:
        power = momentum_power_w(
            airspeed_m_s,
            climb_rate_m_s,
            moved_rotor(rotor, dict(zip(law.names, logarithms.tolist(), strict=True))),
            mass_kg=mass_kg,
            air_density_kg_m3=air_density_kg_m3,
        )
        return np.log(power + avionics_w)

    steps = _STEP * np.eye(len(law.names))
    return np.stack([log_powers(one) - log_powers(-one) for one in steps], axis=-1) / (2 * _STEP)


def power_deviations(
    rotor: Rotor,
    law: LawSpread,
    airspeed_m_s: FloatArray,
    climb_rate_m_s: FloatArray,
    *,
    mass_kg: float,
    air_density_kg_m3: float,
    avionics_w: float,
) -> FloatArray:
    """Return how far the power of each steady flight may be off, relative, as standard deviations. (n,)"""
    slopes = _log_slopes(
        rotor,
        law,
        airspeed_m_s,
        climb_rate_m_s,
        mass_kg=mass_kg,
        air_density_kg_m3=air_density_kg_m3,
        avionics_w=avionics_w,
    )
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", slopes, law.covariance, slopes)))


def energy_fractions(
    rotor: Rotor, law: LawSpread, *, mass_kg: float, avionics_w: float
) -> EnergyFractions:
    """Return how far the power by a law may be off, by how far its factors are.

    Of flights at several speeds it is the root mean square.
    """
    speed_m_s, climb_m_s = np.concatenate([np.array(one) for one in STEADY_FLIGHTS.values()]).T
    slopes = _log_slopes(
        rotor,
        law,
        speed_m_s,
        climb_m_s,
        mass_kg=mass_kg,
        air_density_kg_m3=SEA_LEVEL_DENSITY_KG_M3,
        avionics_w=avionics_w,
    )
    beside = slopes - slopes[0]
    variances = iter(np.einsum("ij,jk,ik->i", beside, law.covariance, beside).tolist())
    return EnergyFractions(
        shared=float(np.sqrt(slopes[0] @ law.covariance @ slopes[0])),
        beside={
            name: math.sqrt(sum(islice(variances, len(flights))) / len(flights))
            for name, flights in STEADY_FLIGHTS.items()
        },
    )


def level_fractions(vehicle: VehicleModel, airspeed_m_s: FloatArray) -> FloatArray:
    """Return how far the power of level flight by a narrowable model may be off, beside hover's. (n,) [-]"""
    law, spread = vehicle.cruise, vehicle.spread
    assert isinstance(law, MomentumLaw)
    assert spread is not None
    of = LawSpread.of_model(spread)
    speed_m_s = np.concatenate([[0.0], airspeed_m_s])
    slopes = _log_slopes(
        Rotor(**field_values(law)),
        of,
        speed_m_s,
        np.zeros(len(speed_m_s)),
        mass_kg=vehicle.mass_kg or 0.0,
        air_density_kg_m3=SEA_LEVEL_DENSITY_KG_M3,
        avionics_w=0.0 if vehicle.loads is None else vehicle.loads.avionics_w,
    )
    beside = slopes[1:] - slopes[0]
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", beside, of.covariance, beside)))


def is_narrowable(vehicle: VehicleModel) -> bool:
    """Whether flights can narrow the power of a model: it is momentum theory, and says how uncertain."""
    spread = vehicle.spread
    return (
        isinstance(vehicle.cruise, MomentumLaw)
        and vehicle.mass_kg is not None
        and spread is not None
        and bool(spread.law_fraction)
    )
