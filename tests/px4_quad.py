"""A quadrotor that PX4 flies and whose power is known: what a data sheet says of a 2 kg frame of 500 mm.

Four propellers of 10 inch have 4 · π · 0.127² = 0.203 m² of disk: 19.1 N at 1.225 kg/m³ take 119 W ideally;
it hovers 18 minutes on 5 Ah of four cells (74 Wh), which is 235 W, 1.98 times that.
"""

from __future__ import annotations

from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.declared import Interval
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import ModelSpread
from planner.vehicle.power import MomentumLaw
from planner.vehicle.reader import load_chemistry

_LIPO = load_chemistry("lipo")
_BARE = load_vehicle("px4-sih-quad")
PX4_QUAD = replace(
    _BARE,
    mass_kg=1.95,
    cruise=MomentumLaw(
        disk_area_m2=0.203,
        drag_area_m2=0.03,
        induced_factor=1.5,
        axial_factor=1.5,
        profile_factor=0.48,
        profile_speed_factor=0.25,
    ),
    battery=Battery(
        capacity_ah=5.0,
        cells_in_series=4,
        internal_resistance_ohm=0.02,
        ocv_soc=_LIPO.ocv_soc,
        ocv_v=tuple(4.0 * one for one in _LIPO.cell_ocv_v),
        cutoff_voltage_v=13.2,
        max_c_rate=25.0,
    ),
    spread=ModelSpread(
        time_fraction=0.02, energy_fraction=0.05, n_flights=10, source="as others of its kind"
    ),
    valid_for=replace(_BARE.valid_for, speed_m_s=Interval(low=0.0, high=12.1)),
)
