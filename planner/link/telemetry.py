"""What a vehicle's own messages say of it, gathered as they come."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.link.vehicle import (
    BatteryState,
    EventRecord,
    StatusText,
    VehiclePosition,
    VehicleState,
    WindEstimate,
)
from planner.mission.items import Home

if TYPE_CHECKING:
    from planner.link.codec import Message

_NO_VOLTAGE_MV = 65_535
_NO_CURRENT_CA = -1
_NO_TEMPERATURE_CC = 32_767
_ARMED = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
_LANDED_STATES = {1: True, 2: False, 3: False, 4: False}
"""By MAV_LANDED_STATE; 0 is unknown."""
_MOST_CHUNKS = 16
_MOST_TEXTS = 200
"""Texts kept; a vehicle that says more says nothing new."""


class Telemetry:
    """The latest of each message that tells the vehicle's state."""

    def __init__(self) -> None:
        self._latest: dict[str, Message] = {}
        self._chunks: dict[int, dict[int, str]] = {}
        self._texts: list[StatusText] = []
        self.texts_said = 0
        """How many texts came so far."""
        self.events = EventRecord()
        """What PX4 reports by number."""

    def take(self, received: Message) -> None:
        """Take a message of the vehicle's autopilot."""
        if received.name == "STATUSTEXT":
            self._take_text(received)
        elif received.name in {"EVENT", "CURRENT_EVENT_SEQUENCE"}:
            self.events.take(received)
        elif received.name == "BATTERY_STATUS" and received["id"] != 0:
            return
        else:
            self._latest[received.name] = received

    def latest(self, name: str) -> Message | None:
        """Return the latest message of a name."""
        return self._latest.get(name)

    def forget(self, name: str) -> None:
        """Forget the latest message of a name, so that the next one is known to be new."""
        self._latest.pop(name, None)

    def take_texts(self) -> tuple[StatusText, ...]:
        """Return what the vehicle said since this was asked, in its order."""
        texts = tuple(self._texts)
        self._texts.clear()
        return texts

    def texts_after(self, said: int) -> tuple[StatusText, ...]:
        """Return the texts that came after so many, of those not taken yet."""
        number = min(self.texts_said - said, len(self._texts))
        return tuple(self._texts[len(self._texts) - number :])

    def state(self) -> VehicleState:
        """Return what is known now."""
        heartbeat = self._latest.get("HEARTBEAT")
        landed = self._latest.get("EXTENDED_SYS_STATE")
        return VehicleState(
            home=self._home(),
            battery=self._battery(),
            position=self._position(),
            wind=self._wind(),
            is_armed=None if heartbeat is None else bool(heartbeat["base_mode"] & _ARMED),
            is_landed=None if landed is None else _LANDED_STATES.get(landed["landed_state"]),
        )

    def _home(self) -> Home | None:
        home = self._latest.get("HOME_POSITION")
        if home is None or not _is_place(home["latitude"], home["longitude"]):
            return None
        return Home(
            latitude_deg=home["latitude"] / 1e7,
            longitude_deg=home["longitude"] / 1e7,
            altitude_amsl_m=home["altitude"] / 1e3,
        )

    def _position(self) -> VehiclePosition | None:
        position = self._latest.get("GLOBAL_POSITION_INT")
        if position is None or not _is_place(position["lat"], position["lon"]):
            return None
        return VehiclePosition(
            latitude_deg=position["lat"] / 1e7,
            longitude_deg=position["lon"] / 1e7,
            altitude_amsl_m=position["alt"] / 1e3,
            height_above_home_m=position["relative_alt"] / 1e3,
        )

    def _battery(self) -> BatteryState | None:
        status, system = self._latest.get("BATTERY_STATUS"), self._latest.get("SYS_STATUS")
        if status is None and system is None:
            return None
        remaining, voltage_v, current_a, temperature_c, consumed_ah = None, None, None, None, None
        if system is not None:
            remaining = _fraction(system["battery_remaining"])
            if 0 < system["voltage_battery"] < _NO_VOLTAGE_MV:
                voltage_v = system["voltage_battery"] / 1e3
            if system["current_battery"] != _NO_CURRENT_CA:
                current_a = system["current_battery"] / 1e2
        if status is not None:
            cells_mv = [mv for mv in status["voltages"] if mv != _NO_VOLTAGE_MV]
            cells_mv += [mv for mv in status.fields.get("voltages_ext", ()) if mv]
            if any(cells_mv):
                voltage_v = sum(cells_mv) / 1e3
            if status["current_battery"] != _NO_CURRENT_CA:
                current_a = status["current_battery"] / 1e2
            if status["temperature"] != _NO_TEMPERATURE_CC:
                temperature_c = status["temperature"] / 1e2
            if status["current_consumed"] >= 0:
                consumed_ah = status["current_consumed"] / 1e3
            told = _fraction(status["battery_remaining"])
            remaining = remaining if told is None else told
        return BatteryState(
            remaining_fraction=remaining,
            voltage_v=voltage_v,
            current_a=current_a,
            temperature_c=temperature_c,
            consumed_ah=consumed_ah,
        )

    def _wind(self) -> WindEstimate | None:
        wind, estimate = self._latest.get("WIND_COV"), self._latest.get("WIND")
        if wind is not None and math.isfinite(wind["wind_x"]) and math.isfinite(wind["wind_y"]):
            # WIND_COV says where the air goes, north and east.
            from_deg = math.degrees(math.atan2(-wind["wind_y"], -wind["wind_x"])) % 360.0
            return WindEstimate(
                speed_m_s=math.hypot(wind["wind_x"], wind["wind_y"]), from_deg=from_deg
            )
        if estimate is None:
            return None
        speed_m_s, direction_deg = estimate["speed"], estimate["direction"]
        if not (math.isfinite(direction_deg) and math.isfinite(speed_m_s) and speed_m_s >= 0.0):
            return None
        # ArduPilot's WIND says where it comes from.
        return WindEstimate(speed_m_s=speed_m_s, from_deg=direction_deg % 360.0)

    def _take_text(self, received: Message) -> None:
        text: str = received["text"]
        number, chunk = received.fields.get("id", 0), received.fields.get("chunk_seq", 0)
        if number and (len(text) == 50 or chunk):
            chunks = self._chunks.setdefault(number, {})
            chunks[chunk] = text
            if len(text) == 50 and len(chunks) < _MOST_CHUNKS:
                return
            text = "".join(chunks[key] for key in sorted(chunks))
            del self._chunks[number]
        # A tab at the end is PX4's sign that the same comes as an event.
        said = StatusText(severity=received["severity"], text=text.rstrip())
        if len(self._texts) < _MOST_TEXTS:
            self.texts_said += 1
            self._texts.append(said)


def _is_place(latitude: int, longitude: int) -> bool:
    """Return whether degrees times 10⁷ are a place; 0, 0 stands for none."""
    is_known = latitude != 0 or longitude != 0
    return is_known and abs(latitude) <= 900_000_000 and abs(longitude) <= 1_800_000_000


def _fraction(percent: int) -> float | None:
    return percent / 100.0 if 0 <= percent <= 100 else None
