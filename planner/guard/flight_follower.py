"""The flight of a vehicle on the line: its telemetry held against the flight that was predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.guard.energy import BatteryReading, EnergyWatch
from planner.guard.progress import MeasuredPlace

if TYPE_CHECKING:
    from planner.guard.energy import EnergyState, EnergyWarning, Prediction
    from planner.link.telemetry import Telemetry
    from planner.link.vehicle import VehicleIdentity, VehicleState


_HECTOJOULES_PER_WH = 36.0
"""BATTERY_STATUS counts energy in them."""
_FLYING_M = 1.0
"""Height from which a vehicle that does not tell is in the air. [m]"""
_PX4_MISSION, _ARDUPILOT_AUTO = (4 << 16) | (4 << 24), 3
"""Custom mode of a vehicle that flies its mission."""


class FlightFollower:
    """Follows a vehicle from its arming to its landing.

    Parameters
    ----------
    telemetry : Telemetry
        What the vehicle tells.
    identity : VehicleIdentity
        Who it is.
    warn_before_s : float
        How long before the point of no return to warn. [s]
    """

    def __init__(
        self, telemetry: Telemetry, identity: VehicleIdentity, *, warn_before_s: float
    ) -> None:
        self._telemetry = telemetry
        self._identity = identity
        self._warn_before_s = warn_before_s
        self._prediction: Prediction | None = None
        self._start: BatteryReading | None = None
        self._watch: EnergyWatch | None = None
        self._was_on_ground = False
        self.is_flying = False
        """At the last look."""

    def predict(self, prediction: Prediction | None) -> None:
        """Take what a check predicts, of this flight too where it has begun."""
        self._prediction = prediction
        if self._watch is not None:
            if not self._was_on_ground:
                self._start = self._battery_reading()
            self._begin()

    def take_arming(self, *, is_armed: bool) -> None:
        """Take it that the vehicle has armed or disarmed."""
        self._watch, self._start = None, None
        if is_armed:
            self._start = self._battery_reading()
            self._begin()

    def look(self, now_s: float) -> tuple[EnergyState | None, tuple[EnergyWarning, ...]]:
        """Return the energy in flight, and the warnings that are new; none on the ground.

        Parameters
        ----------
        now_s : float
            Time by any clock. [s]
        """
        state = self._telemetry.state()
        self.is_flying = _is_flying(state)
        self._was_on_ground |= state.is_armed is False
        position = state.position
        if not self.is_flying or position is None:
            return None, ()
        if self._watch is None:  # it was in the air before us
            self._start = self._battery_reading()
            self._begin()
        if self._watch is None:
            return None, ()
        place = MeasuredPlace(
            item=self._present_item(),
            latitude_deg=position.latitude_deg,
            longitude_deg=position.longitude_deg,
            height_above_home_m=position.height_above_home_m,
        )
        return self._watch.take(
            place, self._battery_reading(), now_s, is_on_mission=self._is_on_mission()
        )

    def _begin(self) -> None:
        if self._prediction is not None and self._start is not None:
            self._watch = EnergyWatch(
                self._prediction,
                start=self._start,
                warn_before_s=self._warn_before_s,
                is_joined=not self._was_on_ground,
            )

    def _present_item(self) -> int:
        current = self._telemetry.latest("MISSION_CURRENT")
        number = 1 if current is None else int(current["seq"])
        return max(number if self._identity.has_home_slot else number + 1, 1)

    def _is_on_mission(self) -> bool:
        beat = self._telemetry.latest("HEARTBEAT")
        wanted = _ARDUPILOT_AUTO if self._identity.has_home_slot else _PX4_MISSION
        return beat is not None and bool(beat["custom_mode"] == wanted)

    def _battery_reading(self) -> BatteryReading:
        battery = self._telemetry.state().battery
        if battery is None:
            return BatteryReading()
        status = self._telemetry.latest("BATTERY_STATUS")
        energy_hj = -1 if status is None else status["energy_consumed"]
        return BatteryReading(
            remaining_fraction=battery.remaining_fraction,
            consumed_ah=battery.consumed_ah,
            consumed_wh=energy_hj / _HECTOJOULES_PER_WH if energy_hj >= 0 else None,
            voltage_v=battery.voltage_v,
            current_a=battery.current_a,
        )


def _is_flying(state: VehicleState) -> bool:
    if not state.is_armed:
        return False
    if state.is_landed is not None:
        return not state.is_landed
    return state.position is not None and state.position.height_above_home_m > _FLYING_M
