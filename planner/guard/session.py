"""A guard on a line: it listens, reads what the guard asks for, and sends what it decides."""

from __future__ import annotations

import hashlib
import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from planner.autopilot import Autopilot
from planner.errors import LinkError, MavjouleError, bug_text
from planner.guard.authorisation import (
    ARM_AUTHORISATION_REQUEST,
    UNREAD_SETTINGS,
    ArmRequest,
    Judgement,
    Verdict,
    acknowledgement_fields,
    arming_settings,
    unknown_judgement,
)
from planner.guard.decision import (
    Announce,
    AnswerRequest,
    ArmingStatus,
    ArmRequested,
    CheckVehicle,
    Decision,
    Guard,
    Judged,
    MessageHeard,
    PartChanged,
    PartRead,
    PartUnread,
    ReadParts,
    TimePassed,
    VehiclePart,
    Withdraw,
)
from planner.guard.energy import FlightFollower, Prediction
from planner.link.connection import TwoVehiclesError
from planner.link.mission import MissionKind
from planner.link.snapshot import VehicleReading, VehicleSnapshot, make_snapshot, with_limits
from planner.link.telemetry import BatteryState, homes_apart_m
from planner.link.transfers import REQUEST_MESSAGE, ParameterHashRequest
from planner.link.wire import message
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from concurrent.futures import Executor

    from planner.guard.authorisation import ArmAnswer, ArmingSettings
    from planner.guard.decision import Action, Event, GuardSettings, GuardView
    from planner.guard.energy import EnergyState, EnergyWarning
    from planner.link.mission import WireItem
    from planner.link.parameters import WireParameter
    from planner.link.telemetry import VehicleIdentity, VehicleState
    from planner.link.transfers import LinkSettings
    from planner.link.vehicle import VehicleLink
    from planner.link.wire import Message
    from planner.mission.items import Home


T = TypeVar("T")
_PARTS = {kind: VehiclePart(kind.label) for kind in MissionKind}
KINDS = {part: kind for kind, part in _PARTS.items()}
LIST_IDS = {
    MissionKind.MISSION: "mission_id",
    MissionKind.FENCE: "fence_id",
    MissionKind.RALLY: "rally_points_id",
}
"""Fields of MISSION_CURRENT that identify the lists (PX4)."""
_ACCEPTED = 0
_COUNTERS = ("STAT_", "LND_FLIGHT_T", "COM_FLIGHT_UUID", "_HASH_CHECK", "BARO")
"""Beginnings of parameters that autopilots set themselves, in which no flight differs."""
_SAME_VOLTAGE = 0.02
"""A voltage that changes by less is that of the same battery at the same charge: what servos and the \
noise of its measurement come to; a cell of twelve more or fewer is 8 %. [-]"""
_MOVED_M = 2.0
"""A home that moves by less is the same. [m]"""


class VehicleWatch:
    """Turns the messages of one vehicle into events, and keeps what was read of it."""

    def __init__(
        self, identity: VehicleIdentity, *, own_system: int, counts_charge: bool = True
    ) -> None:
        self._identity = identity
        self._system = identity.system
        self._own_system = own_system
        self._requests = 0
        self._current: Mapping[str, Any] | None = None
        self._charges: dict[str, float] = {}
        self._counts_charge = counts_charge
        self.lists: dict[MissionKind, tuple[WireItem, ...] | None] = {}
        self.parameters: tuple[WireParameter, ...] = ()
        self._content_of: dict[str, bytes] = {}
        self.home: Home | None = None
        """Where the vehicle will return to once it has armed here."""
        self.charge: float | None = None
        """State of charge: as it is on the ground, as it was at arming in the air. [-]"""
        self.voltage_v: float | None = None
        """Likewise, but for what the voltage of one and the same battery wanders by. [V]"""
        self.before_arming: BatteryState | None = None
        """As it was measured when the vehicle was last disarmed."""
        self.fingerprints: dict[VehiclePart, str] = {}
        self.is_armed = False

    def take_list(self, kind: MissionKind, items: tuple[WireItem, ...] | None) -> PartRead:
        """Keep a list that was read."""
        self.lists[kind] = items
        if kind is MissionKind.MISSION and self._identity.has_home_slot and items:
            items = items[1:]  # home is a part of its own, and moves
        return self._read(_PARTS[kind], repr(items))

    def take_parameters(self, parameters: tuple[WireParameter, ...]) -> PartRead:
        """Keep the parameters that were read."""
        self.parameters = parameters
        self._content_of = {one.name: one.content for one in parameters}
        lasting = sorted(
            (one.name, one.content, one.kind)
            for one in parameters
            if not one.name.startswith(_COUNTERS)
        )
        return self._read(VehiclePart.PARAMETERS, repr(lasting))

    def take_home(self, state: VehicleState) -> tuple[Event, ...]:
        """Keep the home that the vehicle reports now, or will set when it arms."""
        home = state.home_at_arming
        if home is None:
            return ()
        if self.home is None or homes_apart_m(self.home, home) > _MOVED_M:
            self.home = home
        return (self._read(VehiclePart.HOME, repr(self.home)),)

    def take_battery(self, received: Message, state: VehicleState) -> tuple[Event, ...]:
        """Keep charge and voltage that a SYS_STATUS or the first battery's BATTERY_STATUS reports."""
        percent = received["battery_remaining"]
        if received.fields.get("id", 0) != 0 or state.is_armed is None:
            return ()  # of another battery, or one of which nobody knows whether it is under load
        voltage_v = None if state.battery is None else state.battery.voltage_v
        if state.is_armed is False:
            self.before_arming = state.battery
        # In the air the battery at the start is what the check is about.
        if 0 <= percent <= 100:
            self._charges[received.name] = percent / 100.0
            if self.charge is None or not self.is_armed:
                self.charge = min(self._charges.values())
        elif self._counts_charge:
            return ()
        known_v = self.voltage_v
        if voltage_v is not None and (
            known_v is None
            or (not self.is_armed and abs(voltage_v - known_v) > _SAME_VOLTAGE * known_v)
        ):
            self.voltage_v = voltage_v
        charge = self.charge if self._counts_charge else None
        return (self._read(VehiclePart.BATTERY, repr((charge, self.voltage_v))),)

    def events(self, received: Message) -> tuple[Event, ...]:
        """Return what a message of anybody on the line means."""
        if received.system != self._system:
            return self._others(received)
        if received.component != self._identity.component:
            return ()  # a camera, or a companion: not who arms
        events: list[Event] = [MessageHeard()]
        target = received.fields.get("target_system", 0)
        match received.name:
            case "COMMAND_LONG":
                if received["command"] == ARM_AUTHORISATION_REQUEST and target in {
                    0,
                    self._own_system,
                }:
                    self._requests += 1
                    request = ArmRequest(
                        system=received.system, component=received.component, number=self._requests
                    )
                    events.append(ArmRequested(request=request))
            case "MISSION_ACK" | "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                if target not in {0, self._own_system}:
                    events += _list_changed(received, "the vehicle answers another station")
            case "MISSION_CURRENT":
                events += self._counted(received)
            case "PARAM_VALUE":
                events += self._valued(received)
        return tuple(events)

    def _others(self, received: Message) -> tuple[Event, ...]:
        """Return what a message of another station to the vehicle means."""
        if received.system == self._own_system:
            return ()
        if received.fields.get("target_system", 0) not in {0, self._system}:
            return ()
        if received.name in {"MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST"}:
            return _list_changed(received, f"system {received.system} sends one")
        if received.name == "PARAM_SET":
            why = f"system {received.system} sets {received['param_id']}"
            return (PartChanged(part=VehiclePart.PARAMETERS, why=why),)
        return ()

    def _counted(self, received: Message) -> tuple[Event, ...]:
        """Return what another number of items, or another list, than before means."""
        now, before = received.fields, self._current
        self._current = now
        if before is None:
            return ()
        changed = [
            PartChanged(part=_PARTS[kind], why=f"MISSION_CURRENT reports another {kind.label}")
            for kind, name in LIST_IDS.items()
            if now.get(name, 0) != before.get(name, 0)
        ]
        total = now.get("total", 0)  # autopilots count differently
        if total != before.get("total", 0):
            why = f"MISSION_CURRENT reports {total} items"
            changed.append(PartChanged(part=VehiclePart.MISSION, why=why))
        return tuple(changed)

    def _valued(self, received: Message) -> tuple[Event, ...]:
        name, known = received["param_id"], self._content_of.get(received["param_id"])
        if known in {None, received["param_bytes"]} or name.startswith(_COUNTERS):
            return ()
        self._content_of[name] = received["param_bytes"]
        return (PartChanged(part=VehiclePart.PARAMETERS, why=f"{name} was set"),)

    def _read(self, part: VehiclePart, content: str) -> PartRead:
        fingerprint = hashlib.sha256(content.encode()).hexdigest()
        self.fingerprints[part] = fingerprint
        return PartRead(part=part, fingerprint=fingerprint)


def _list_changed(received: Message, why: str) -> tuple[Event, ...]:
    kind = received.fields.get("mission_type", 0)
    if received.name == "MISSION_ACK" and received["type"] != _ACCEPTED:
        return ()
    parts = tuple(_PARTS.values()) if kind == 255 else ()
    if kind in set(MissionKind):
        parts = (_PARTS[MissionKind(kind)],)
    return tuple(PartChanged(part=part, why=why) for part in parts)


_RETRIES = 5
"""Of what a vehicle may not have."""
_LATE = 3.0
"""An answer so many round trips old is lost. [-]"""


class PartReader:
    """Reads from one vehicle, and remembers what shows that nothing has changed.

    What is known of it, because it was read just now, is not read again at once.
    """

    def __init__(
        self,
        link: VehicleLink,
        watch: VehicleWatch,
        settings: LinkSettings,
        *,
        known: VehicleReading | None = None,
    ) -> None:
        self._link = link
        self._connection = link.connection
        self._watch = watch
        self._settings = settings
        self._lists = {} if known is None else dict(known.lists)
        self._parameters = None if known is None else known.parameters
        self._ids: dict[MissionKind, int] = {}
        self._hash: bytes | None = None
        self._has_hash = link.identity.autopilot is Autopilot.PX4
        self._round_trip_s: float | None = None

    def read(self, asked: ReadParts) -> Iterator[PartRead | PartUnread]:
        """Yield what became of each part, as it is read."""
        settings = self._settings
        if asked.is_urgent and self._round_trip_s is not None:
            # Someone waits: what is lost is asked for again as soon as it is late.
            late_s = max(_LATE * self._round_trip_s, settings.shortest_timeout_s)
            settings = replace(settings, reply_timeout_s=min(late_s, settings.reply_timeout_s))
        for part in asked.parts:
            try:
                if part not in KINDS:
                    yield self._read_parameters(settings)
                elif self._is_confirmed(KINDS[part], settings):
                    yield self._watch.take_list(KINDS[part], self._watch.lists[KINDS[part]])
                else:
                    yield self._read_list(KINDS[part], settings)
            except TwoVehiclesError:
                raise
            except LinkError as error:
                yield PartUnread(part=part, why=str(error))

    def _is_confirmed(self, kind: MissionKind, settings: LinkSettings) -> bool:
        """Return whether a list is as it was read, by the number that the vehicle has for it."""
        known = self._ids.get(kind)
        if not (known and self._link.has_echo):
            return False
        began_s = self._connection.now_s
        is_confirmed = self._link.has_list(kind, known, settings)
        self._note_round_trip(began_s, answers=1)
        return is_confirmed

    def _note_round_trip(self, began_s: float, *, answers: int) -> None:
        """Note how long each of several answers took: with nothing lost it is the least."""
        took_s = (self._connection.now_s - began_s) / answers
        self._round_trip_s = (
            took_s if self._round_trip_s is None else min(self._round_trip_s, took_s)
        )

    def _read_list(self, kind: MissionKind, settings: LinkSettings) -> PartRead:
        if kind in self._lists:
            return self._watch.take_list(kind, self._lists.pop(kind))
        began_s = self._connection.now_s
        items, list_id = self._link.fetch_list(kind, settings)
        self._note_round_trip(began_s, answers=1 + len(items or ()))
        self._ids[kind] = list_id
        if list_id:
            self._link.answers_echo()
        return self._watch.take_list(kind, items)

    def _read_parameters(self, settings: LinkSettings) -> PartRead:
        if self._parameters is not None:
            known, self._parameters = self._parameters, None
            return self._watch.take_parameters(known)
        content: bytes | None = None
        if self._has_hash:
            # The hash comes first: what is set while the parameters are read makes it differ.
            question = ParameterHashRequest(
                settings, retries=_RETRIES, is_fresh=bool(self._link.has_echo)
            )
            self._connection.run(question)
            content = question.content
            self._has_hash = content is not None or self._hash is not None
        if content is None or content != self._hash:
            self._watch.take_parameters(self._link.fetch_parameters())
            self._hash = content
        return self._watch.take_parameters(self._watch.parameters)


Judge = Callable[[VehicleSnapshot], tuple[Judgement, Prediction | None]]
_Checking = tuple[dict[VehiclePart, str], Future[tuple[Judgement, Prediction | None]]]


_TURN_S = 0.1
"""So often time passes for the guard. [s]"""
_LOOK_S = 1.0
"""So often the energy is looked at, and the status reported. [s]"""
_ASK_S = 5.0
"""So often a message that does not come is asked for. [s]"""
_SET_MESSAGE_INTERVAL = 511
_WARNING = 4
"""MAV_SEVERITY_WARNING."""
_STREAMS = {
    "SYS_STATUS": (1, 1.0),
    "GLOBAL_POSITION_INT": (33, 0.5),
    "MISSION_CURRENT": (42, 1.0),
    "BATTERY_STATUS": (147, 1.0),
    "HOME_POSITION": (242, 5.0),
    "EXTENDED_SYS_STATE": (245, 1.0),
}
"""Messages that are followed: number and interval [s]."""


class Authoriser(Protocol):
    """Hears requests and sends answers, instead of this program's own messages."""

    def requests(self) -> tuple[ArmRequest, ...]:
        """Return the requests that came since the last call."""

    def answer(self, answer: ArmAnswer) -> None:
        """Answer a request."""


class GuardStatus(Value):
    """Everything a status line shows."""

    view: GuardView
    arming: ArmingSettings | None
    """``None`` until the parameters were read."""
    heard_ago_s: float
    is_armed: bool
    is_flying: bool
    energy: EnergyState | None
    """``None`` on the ground, and where nothing is measured."""
    state: VehicleState
    """Battery, home and position as the vehicle reports them."""


class GuardSession:
    """A guard on one line.

    Requests are heard and answered by this program's own messages, or by an authoriser.  Checks run in
    an executor, so that the line is heard meanwhile, or here, in turn.
    """

    def __init__(
        self,
        link: VehicleLink,
        settings: GuardSettings,
        *,
        judge: Judge,
        on_decision: Callable[[Decision], None],
        on_status: Callable[[GuardStatus], None],
        authoriser: Authoriser | None = None,
        executor: Executor | None = None,
        known: VehicleReading | None = None,
    ) -> None:
        self._link = link
        self._connection = link.connection
        self._settings = settings
        self._judge = judge
        self._on_decision = on_decision
        self._on_status = on_status
        self._authoriser = authoriser
        self._executor = executor
        self._checking: _Checking | None = None
        self._watch = VehicleWatch(
            link.identity,
            own_system=self._connection.own_system,
            counts_charge=settings.counts_charge,
        )
        self._reader = PartReader(link, self._watch, link.settings, known=known)
        now_s = self._connection.now_s
        self._guard = Guard(settings, now_s=now_s)
        self._work: deque[ReadParts | CheckVehicle] = deque()
        self._heard_s = now_s
        self._received_s: dict[str, float] = {}
        self._looked_s = self._asked_s = -_LOOK_S
        self._arming: ArmingSettings | None = None
        self._failure = ""
        self._terrain_pending: int | None = None
        self._terrain_s = now_s
        self._flight = FlightFollower(
            link.connection.telemetry, link.identity, warn_before_s=settings.warn_before_s
        )

    def run(self) -> None:
        """Guard until something stops it: `LinkError` where the vehicle is lost, or the line breaks."""
        connection = self._connection
        connection.on_message = self._take_message
        connection.on_turn = self._take_turn
        connection.longest_wait_s = _TURN_S
        try:
            while True:
                self._ask_for_streams()
                if self._work:
                    self._do(self._work.popleft())
                else:
                    connection.listen(_TURN_S)
                    self._look_for_terrain()
                self._take_check()
                self._refuse_silence()
        finally:
            connection.on_message = connection.on_turn = None

    def _take_message(self, received: Message) -> None:
        events = list(self._watch.events(received))
        if MessageHeard() in events:
            self._heard_s = self._received_s[received.name] = self._connection.now_s
            events += self._reported(received)
        for event in events:
            is_left = self._settings.is_observing or self._authoriser is not None
            if not (isinstance(event, ArmRequested) and is_left):
                self._feed(event)

    def _reported(self, received: Message) -> tuple[Event, ...]:
        state = self._connection.telemetry.state()
        match received.name:
            case "HEARTBEAT":
                if bool(state.is_armed) != self._watch.is_armed:
                    self._watch.is_armed = bool(state.is_armed)
                    self._feed_status()
                    is_armed = self._watch.is_armed
                    self._follow(lambda: self._flight.take_arming(is_armed=is_armed), None)
            case "HOME_POSITION" | "GLOBAL_POSITION_INT":
                return self._watch.take_home(state)
            case "BATTERY_STATUS" | "SYS_STATUS":
                return self._watch.take_battery(received, state)
        return ()

    def _refuse_silence(self) -> None:
        """Raise `LinkError` where the vehicle counts as lost."""
        silent_s = self._connection.now_s - self._heard_s
        if silent_s > self._settings.lost_after_s:
            msg = f"the vehicle was not heard for {silent_s:.0f} s on {self._connection.name}"
            raise LinkError(msg)

    def _take_turn(self) -> None:
        if self._authoriser is not None:
            for request in self._authoriser.requests():
                self._feed(ArmRequested(request=request))
        self._feed(TimePassed())
        self._look()
        self._refuse_silence()  # within a transfer too, which is as patient as its settings

    def _feed(self, event: Event) -> None:
        for action in self._guard.take(event, self._connection.now_s):
            self._act(action)

    def _act(self, action: Action) -> None:
        match action:
            case AnswerRequest(request=request, answer=answer):
                if self._authoriser is not None:
                    self._authoriser.answer(answer)
                else:
                    self._acknowledge(request, answer)
            case Withdraw(request=request, answer=answer):
                if not self._settings.is_observing:
                    self._acknowledge(request, answer)
            case Announce(severity=severity, text=text):
                self._announce(severity, text)
            case Decision():
                self._on_decision(action)
            case _:
                self._work.append(action)

    def _acknowledge(self, request: ArmRequest, answer: ArmAnswer) -> None:
        self._connection.send(message("COMMAND_ACK", **acknowledgement_fields(request, answer)))

    def _do(self, action: ReadParts | CheckVehicle) -> None:
        if isinstance(action, CheckVehicle):
            self._check()
            return
        for event in self._reader.read(action):
            if event.part is VehiclePart.PARAMETERS:
                self._set_arming(is_read=isinstance(event, PartRead))
            self._feed(event)

    def _set_arming(self, *, is_read: bool) -> None:
        if not is_read and self._arming is not None:
            return  # what was read before is the latest that is known
        is_bytewise = self._link.identity.is_bytewise
        numbers = {one.name: one.number(is_bytewise=is_bytewise) for one in self._watch.parameters}
        arming = UNREAD_SETTINGS
        if is_read:
            arming = arming_settings(numbers, authoriser=self._connection.own_system)
        if arming != self._arming:
            self._arming = arming
            view = self._guard.view(self._connection.now_s)
            self._on_decision(Decision(kind="arming", verdict=view.verdict, text=arming.advice))
        self._feed_status()

    def _feed_status(self) -> None:
        if self._arming is not None:
            status = ArmingStatus(
                is_asking=bool(self._arming.is_asking),
                wait_s=self._arming.wait_s,
                holds_s=self._arming.holds_s,
                is_armed=self._watch.is_armed,
            )
            self._feed(status)

    def _check(self) -> None:
        watch = self._watch
        state = self._connection.telemetry.state()
        checked = dict(watch.fingerprints)
        try:
            reading = VehicleReading(
                state=_with_charge(state, watch), lists=watch.lists, parameters=watch.parameters
            )
            snapshot = make_snapshot(self._link.identity, reading, address=self._connection.name)
            snapshot = with_limits(snapshot, self._link, snapshot.mission.items)
        except MavjouleError as error:
            self._take_judgement(checked, unknown_judgement(str(error)), None)
            return
        self._terrain_pending, self._terrain_s = snapshot.terrain_pending, self._connection.now_s
        if self._executor is None:
            self._take_judgement(checked, *self._judge(snapshot))
        else:
            self._checking = (checked, self._executor.submit(self._judge, snapshot))

    def _look_for_terrain(self) -> None:
        """Check again once a vehicle that waits for terrain has it: a ground station may be sending it."""
        now_s = self._connection.now_s
        if self._terrain_pending and not self._checking and now_s - self._terrain_s >= _ASK_S:
            self._terrain_s = now_s
            if self._link.fetch_terrain_pending() == 0:
                self._work.append(CheckVehicle())

    def _take_judgement(
        self, checked: dict[VehiclePart, str], judgement: Judgement, prediction: Prediction | None
    ) -> None:
        self._follow(lambda: self._flight.predict(prediction), None)
        self._feed(Judged(fingerprints=checked, judgement=judgement))

    def _follow(self, step: Callable[[], T], instead: T) -> T:
        """Return what a step in following the flight comes to; a bug in it never ends the guard."""
        try:
            return step()
        except Exception as error:  # noqa: BLE001 - whoever guards a vehicle goes on
            text = f"the energy in flight is not followed: {bug_text(error)}"
            if text != self._failure:
                self._failure = text
                self._announce(_WARNING, "mavjoule: energy in flight not followed")
                verdict = self._guard.view(self._connection.now_s).verdict
                self._on_decision(Decision(kind="energy", verdict=verdict, text=text))
            return instead

    def _take_check(self) -> None:
        if self._checking is not None and self._checking[1].done():
            checked, future = self._checking
            self._checking = None
            self._take_judgement(checked, *future.result())

    def _look(self) -> None:
        now_s = self._connection.now_s
        if now_s - self._looked_s < _LOOK_S:
            return
        self._looked_s = now_s
        nothing: tuple[EnergyState | None, tuple[EnergyWarning, ...]] = (None, ())
        energy, warnings = self._follow(lambda: self._flight.look(now_s), nothing)
        for warning in warnings:
            self._announce(warning.severity, warning.headline)
            details = {"concern": warning.concern.value, **_energy_details(energy)}
            self._on_decision(
                Decision(kind="energy", verdict=Verdict.NO_GO, text=warning.text, details=details)
            )
        self._on_status(
            GuardStatus(
                view=self._guard.view(now_s),
                arming=self._arming,
                heard_ago_s=now_s - self._heard_s,
                is_armed=self._watch.is_armed,
                is_flying=self._flight.is_flying,
                energy=energy,
                state=self._connection.telemetry.state(),
            )
        )

    def _announce(self, severity: int, text: str) -> None:
        if not self._settings.is_observing:
            self._connection.send(message("STATUSTEXT", severity=severity, text=text))

    def _ask_for_streams(self) -> None:
        """Ask the vehicle to send what is followed, where it has not of late."""
        now_s = self._connection.now_s
        if now_s - self._asked_s < _ASK_S:
            return
        self._asked_s = now_s
        for name, (number, interval_s) in _STREAMS.items():
            if now_s - self._received_s.get(name, -math.inf) <= _ASK_S + interval_s:
                continue
            interval = message(
                "COMMAND_LONG",
                command=_SET_MESSAGE_INTERVAL,
                param1=float(number),
                param2=1e6 * interval_s,
            )
            self._connection.send(interval)
            once = message("COMMAND_LONG", command=REQUEST_MESSAGE, param1=float(number))
            self._connection.send(once)


def _with_charge(state: VehicleState, watch: VehicleWatch) -> VehicleState:
    """Return a state with the battery and the home that a check is about."""
    battery = replace(
        state.battery or BatteryState(),
        remaining_fraction=watch.charge,
        voltage_v=watch.voltage_v,
        current_a=None,  # of now, as in the air; on the ground next to nothing flows
    )
    return replace(state, battery=battery, before_arming=watch.before_arming, home=watch.home)


def _energy_details(state: EnergyState | None) -> dict[str, object]:
    if state is None:
        return {}
    return {
        "left_wh": round(state.left.energy_wh, 2),
        "left_by": state.left.source,
        "finish_wh": round(state.finish_wh, 2),
        "return_wh": round(state.return_wh, 2),
        "reserve_wh": round(state.reserve_wh, 2),
        "lead_s": None if state.lead_s is None else round(state.lead_s, 1),
        "ratio": None if state.ratio is None else round(state.ratio, 3),
        "item": state.progress.item,
    }
