"""The simulated vehicle: its protocols, its mission, and the flight of it over time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.mission import LIST_FILES, MissionKind, mission_of_lists
from planner.link.parameters import PARAMETER_FILE, STORAGE_FILE
from planner.link.wire import message
from planner.mission.items import Mission
from planner.simulator.arming import Arming, ArmingState, rejection
from planner.simulator.files import FileServer
from planner.simulator.flown import FlownMission, FlownState
from planner.simulator.missions import MissionServer
from planner.simulator.servers import NEVER_S, EventServer, LogServer, ParameterServer
from planner.simulator.setup import packed_parameters
from planner.simulator.telemetry import Situation, TelemetryServer

if TYPE_CHECKING:
    from collections import deque

    from planner.link.wire import Message
    from planner.simulator.arming import Rejection
    from planner.simulator.servers import Server
    from planner.simulator.setup import VehicleSetup
Predict = Callable[[Mission], FlownMission | None]


_STORAGE_B = 16_384
"""Of most boards of ArduPilot's. [B]"""
_WARNING, _CRITICAL = 4, 2
"""MAV_SEVERITY."""
INTRODUCTION = "SIMULATED VEHICLE by mavjoule: nothing flies"


class SimulatedVehicle:
    """A vehicle that answers as a real one, flies what is predicted, and has no line of its own.

    It flies what ``predict`` returns of a mission with its items and home, where that is not ``None``,
    ``speed_up`` times as fast as the clock.
    """

    def __init__(
        self, setup: VehicleSetup, predict: Predict = lambda _: None, *, speed_up: float = 1.0
    ) -> None:
        self._predict = predict
        self._speed_up = speed_up
        self._began_s: float | None = None
        self._flown: FlownMission | None = None
        self._flown_change = -1
        self._took_off_s: float | None = None
        self._is_complete = False
        self._arm_at_s = NEVER_S
        self._retry_s: float | None = None
        self._partners: set[int] = set()
        self._item = 0
        self.setup = setup
        self.missions = MissionServer(setup)
        self.arming = Arming(setup)
        self._events = EventServer(is_reporting=setup.autopilot is Autopilot.PX4)
        self._telemetry = TelemetryServer(self._situation, setup.autopilot)
        self._servers: tuple[Server, ...] = (
            self.missions,
            ParameterServer(setup),
            LogServer(setup),
            self.arming,
            self._events,
            self._telemetry,
        )
        if setup.misbehaviour.has_files:
            self._servers += (FileServer(setup.autopilot, self._files()),)

    def _files(self) -> dict[str, Callable[[], bytes]]:
        """Return its files by path: logs, and what ArduPilot makes up of what it holds."""
        files: dict[str, Callable[[], bytes]] = {
            log.path: partial(bytes, log.content) for log in self.setup.logs
        }
        if self.setup.autopilot is Autopilot.PX4:
            return files
        files[STORAGE_FILE] = partial(bytes, _STORAGE_B)
        files[PARAMETER_FILE] = partial(packed_parameters, self.setup.parameters)
        for kind, path in LIST_FILES.items():
            files[path] = partial(self.missions.packed, kind)
        return files

    @property
    def acts(self) -> deque[Message]:
        """What ground stations sent that would move, set or arm a real vehicle."""
        return self._telemetry.acts

    @property
    def deadline_s(self) -> float:
        """When `expire` is to be called, unless something came before. [s]"""
        return min(self._arm_at_s, *(server.deadline_s for server in self._servers))

    @property
    def is_flying(self) -> bool:
        """Whether it is between take-off and landing."""
        return self._took_off_s is not None

    def mission(self) -> Mission:
        """Return the mission, fence and rally points that it holds."""
        lists = {kind: tuple(items) for kind, items in self.missions.lists.items()}
        return mission_of_lists(
            lists, self.setup.identity, home=self.setup.home, source="simulated vehicle"
        )

    def arm_at(self, time_s: float, *, retry_s: float | None = None) -> None:
        """Have it try to arm at a time by the clock, and fly its mission if it may.

        It tries again after ``retry_s``, as long as it did not arm.
        """
        self._arm_at_s = time_s
        self._retry_s = retry_s

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message, and return what is sent for it."""
        sent = list(self._introduced(received.system))
        setup = self.setup
        if received.system == setup.system and received.component == setup.component:
            return ()  # its own name: a twin on the line
        if received.fields.get("target_system", 0) not in {0, setup.system}:
            return tuple(sent)
        if received.fields.get("target_component", 0) not in {0, setup.component}:
            return tuple(sent)
        changes = dict(self.missions.changes)
        for server in self._servers:
            sent += server.feed(received, now_s)
        changed = {kind for kind in MissionKind if self.missions.changes[kind] != changes[kind]}
        if MissionKind.MISSION in changed:
            self._is_complete = False
        # PX4 judges its mission again in another fence.
        is_px4 = setup.autopilot is Autopilot.PX4
        if changed & {MissionKind.MISSION, *([MissionKind.FENCE] if is_px4 else [])}:
            sent += self._objections()
        sent += self._followed(now_s)
        return tuple(sent)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send what is due at a time."""
        sent: list[Message] = []
        if self._began_s is None:
            self._began_s = now_s
            sent.append(self.setup.text(_WARNING, INTRODUCTION))
        if self._arm_at_s <= now_s:
            self._arm_at_s = NEVER_S if self._retry_s is None else now_s + self._retry_s
            sent += self._try_to_arm(now_s)
        for server in self._servers:
            if server.deadline_s <= now_s:
                sent += server.expire(now_s)
        sent += self._followed(now_s)
        return tuple(sent)

    def state_at(self, now_s: float) -> FlownState:
        """Return where it is, and what is left, at a time of the clock. [s]"""
        flown = self._prediction()
        if flown is not None:
            if self._is_complete:
                return flown.state_at(flown.duration_s)
            return flown.state_at(self._flight_time_s(now_s) if self.is_flying else -1.0)
        home = self.setup.home
        return FlownState(
            latitude_deg=home.latitude_deg,
            longitude_deg=home.longitude_deg,
            altitude_amsl_m=home.altitude_amsl_m or 0.0,
            height_above_home_m=0.0,
        )

    def _introduced(self, system: int) -> tuple[Message, ...]:
        if system in self._partners:
            return ()
        self._partners.add(system)
        return (self.setup.text(_WARNING, INTRODUCTION),)

    def _objections(self) -> tuple[Message, ...]:
        why = self._rejection()
        if why is None:
            return ()
        text = f"{why.text}\t" if why.event else why.text  # PX4's sign that there is an event too
        texts = self.setup.texts(_CRITICAL, text) if why.text else ()
        return texts + (self._events.report(why.event, item=why.item) if why.event else ())

    def _rejection(self) -> Rejection | None:
        items = self.missions.lists[MissionKind.MISSION][self.setup.first_item :]
        return rejection(items, self.setup) if items else None

    def _prediction(self) -> FlownMission | None:
        change = sum(self.missions.changes.values())
        if self._flown_change != change and not self.is_flying:
            self._flown_change = change
            self._flown = self._predict(self.mission())
        return self._flown

    def _try_to_arm(self, now_s: float) -> tuple[Message, ...]:
        if objections := self._objections():
            return objections
        if self._prediction() is None:
            return (self.setup.text(_CRITICAL, "Arming denied: no mission that can be flown"),)
        return self.arming.request(now_s)

    def _flight_time_s(self, now_s: float) -> float:
        return 0.0 if self._took_off_s is None else (now_s - self._took_off_s) * self._speed_up

    def _followed(self, now_s: float) -> tuple[Message, ...]:
        """Take off once armed, report the items that are reached, disarm at the end."""
        if self.arming.state is not ArmingState.ARMED:
            return ()
        if self._took_off_s is None:
            self._arm_at_s = NEVER_S
            self._took_off_s = now_s
            self._is_complete = False
            self._item = 0
        flown = self._flown
        assert flown is not None  # nothing arms without a flight
        time_s = self._flight_time_s(now_s)
        item = flown.state_at(time_s).item
        sent: tuple[Message, ...] = ()
        first = self.setup.first_item
        if item and item != self._item:
            if self._item:
                sent += (message("MISSION_ITEM_REACHED", seq=self._item - 1 + first),)
            self._item = item
            self.missions.current = item - 1 + first
        if time_s >= flown.duration_s:
            sent += (message("MISSION_ITEM_REACHED", seq=self._item - 1 + first),)
            self._took_off_s = None
            self._is_complete = True
            sent += self.arming.disarm()
        return sent

    def _situation(self, now_s: float) -> Situation:
        return Situation(
            setup=self.setup,
            state=self.state_at(now_s),
            boot_s=0.0 if self._began_s is None else now_s - self._began_s,
            is_armed=self.arming.state is ArmingState.ARMED,
            is_flying=self.is_flying,
            is_complete=self._is_complete,
            current=self.missions.current,
            total=len(self.missions.lists[MissionKind.MISSION]),
            list_ids=(
                self.missions.list_id(MissionKind.MISSION),
                self.missions.list_id(MissionKind.FENCE),
                self.missions.list_id(MissionKind.RALLY),
            ),
            has_fence=bool(self.missions.lists[MissionKind.FENCE]),
            is_rejected=self.setup.autopilot is Autopilot.PX4 and self._rejection() is not None,
        )
