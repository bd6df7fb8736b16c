"""The battery of a vehicle identified from flights."""

from __future__ import annotations

from planner.vehicle.battery import Battery

FLOWN = Battery(
    capacity_ah=8.0,
    cells_in_series=3,
    internal_resistance_ohm=0.0072,
    ocv_soc=(0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0),
    ocv_v=(10.499, 10.709, 10.889, 11.129, 11.789, 12.239, 12.569),
)
"""As `identify` wrote it of two flights; 11.34 V in the mean.  ArduCopter SITL with 11.299 V had 50 % and
fell on a flight that 66 % (8Ah@11.1V beside it) would have borne."""
