"""The predicted flight, as the simulated vehicle flies it: where it is and what is left, over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.physics.battery import loaded_voltage_v
from planner.values import Value
from planner.vehicle.pack import rest_curve

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.flight.budget import Discharge
    from planner.flight.prediction import Flight, Trace
    from planner.mission.route.stage import Route
    from planner.vehicle.battery import Battery


_J_PER_WH = 3600.0


class FlownState(Value):
    """A vehicle at one time of its flight."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    height_above_home_m: float
    north_m_s: float = 0.0
    east_m_s: float = 0.0
    climb_m_s: float = 0.0
    item: int = 0
    """Item of the mission that is flown, from 1; 0 on the ground."""
    power_w: float = 0.0
    energy_used_wh: float = 0.0
    state_of_charge: float | None = None
    """``None`` where no battery is known. [-]"""
    voltage_v: float | None = None
    current_a: float | None = None
    charge_used_ah: float | None = None


class FlownMission(Value, eq=False):
    """A prediction that can be asked for any time."""

    flight: Flight
    route: Route
    trace: Trace
    battery: Battery | None
    charge: float
    """State of charge at the start. [-]"""
    used_wh: FloatArray
    """Energy used at each sample of the trace. [Wh]"""
    charge_wh: FloatArray
    """Energy used at the ends of the segments, for the charge. [Wh]"""
    charge_left: FloatArray
    """State of charge there. [-]"""
    resistance_ohm: float | None

    @property
    def duration_s(self) -> float:
        """How long the flight takes. [s]"""
        return self.flight.time_s

    def state_at(self, time_s: float) -> FlownState:
        """Return the state at a time of the flight [s]; before it and after the end it is still."""
        at = np.array([min(max(time_s, 0.0), self.duration_s)])
        state = self.flight.motion.state_at_time(at)
        latitude, longitude = self.route.frame.latitude_longitude_deg(state.east_m, state.north_m)
        is_flying = 0.0 <= time_s < self.duration_s
        power_w = float(self.flight.power_w(at)[0]) if is_flying else 0.0
        used_wh = float(np.interp(at[0], self.trace.time_s, self.used_wh))
        left, voltage_v = self._battery_at(used_wh, power_w)
        capacity_ah = None if self.battery is None else self.battery.charge_ah
        segment = min(
            int(np.searchsorted(self.flight.motion.segments.end_s, at[0], side="right")),
            len(self.flight.motion.segments.item) - 1,
        )
        return FlownState(
            latitude_deg=float(latitude[0]),
            longitude_deg=float(longitude[0]),
            altitude_amsl_m=float(state.height_m[0]) + self.route.home_amsl_m,
            height_above_home_m=float(state.height_m[0]),
            north_m_s=float(state.north_m_s[0]) if is_flying else 0.0,
            east_m_s=float(state.east_m_s[0]) if is_flying else 0.0,
            climb_m_s=float(state.climb_m_s[0]) if is_flying else 0.0,
            item=int(self.flight.motion.segments.item[segment]) if is_flying else 0,
            power_w=power_w,
            energy_used_wh=used_wh,
            state_of_charge=left,
            voltage_v=voltage_v,
            current_a=None if not voltage_v else power_w / voltage_v,
            charge_used_ah=(
                None if left is None or capacity_ah is None else (self.charge - left) * capacity_ah
            ),
        )

    def _battery_at(self, used_wh: float, power_w: float) -> tuple[float | None, float | None]:
        """Return charge and voltage; an empty battery stays at 0."""
        battery = self.battery
        if battery is None:
            return None, None
        left = max(0.0, float(np.interp(used_wh, self.charge_wh, self.charge_left)))
        curve = rest_curve(battery)
        if curve is None or self.resistance_ohm is None:
            return left, battery.voltage_v
        open_v = np.interp(left, curve.state_of_charge, curve.voltage_v)
        loaded_v = loaded_voltage_v(open_v, power_w, resistance_ohm=self.resistance_ohm)
        return left, float(loaded_v)


def fly_prediction(
    flight: Flight,
    route: Route,
    trace: Trace,
    *,
    battery: Battery | None,
    discharge: Discharge | None,
    charge: float,
    temperature_c: float,
) -> FlownMission:
    """Return one prediction as a flight that can be asked for any time."""
    steps_s = np.diff(trace.time_s)
    mean_w = 0.5 * (trace.power_w[1:] + trace.power_w[:-1])
    used_wh = np.concatenate(([0.0], np.cumsum(steps_s * mean_w))) / _J_PER_WH
    ends_wh = np.interp(flight.motion.segments.end_s, trace.time_s, used_wh)
    left = np.full(len(ends_wh), charge)
    if discharge is not None:
        left = discharge.state_of_charge
    elif battery is not None:
        left = charge - ends_wh / battery.energy_wh
    return FlownMission(
        flight=flight,
        route=route,
        trace=trace,
        battery=battery,
        charge=charge,
        used_wh=used_wh,
        charge_wh=np.concatenate(([0.0], ends_wh)),
        charge_left=np.concatenate(([charge], left)),
        resistance_ohm=None if battery is None else battery.resistance_ohm(temperature_c),
    )
