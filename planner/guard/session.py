"""A guard on a line: it listens, reads what the guard asks for, and sends what it decides."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING, Protocol

from planner.errors import LinkError, MavjouleError
from planner.guard.authorisation import (
    Judgement,
    Verdict,
    acknowledgement_fields,
    arming_settings,
    unknown_judgement,
)
from planner.guard.energy import Prediction
from planner.guard.flight_follower import FlightFollower
from planner.guard.guard import (
    Announce,
    Answer,
    Asked,
    CheckVehicle,
    Decision,
    Guard,
    Heard,
    Judged,
    Part,
    Passed,
    ReadParts,
    Status,
)
from planner.guard.vehicle_watch import PartReader, VehicleWatch
from planner.link.codec import message
from planner.link.exchange import REQUEST_MESSAGE
from planner.link.snapshot import VehicleReading, make_snapshot
from planner.link.vehicle import BatteryState, VehicleSnapshot
from planner.values import Value, replace

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from planner.guard.authorisation import ArmAnswer, ArmingSettings, ArmRequest
    from planner.guard.energy import EnergyState
    from planner.guard.guard import Action, Event, GuardSettings, GuardView
    from planner.link.codec import Message
    from planner.link.exchange import LinkSettings
    from planner.link.pymavlink_link import PymavlinkLink
    from planner.link.vehicle import VehicleState
Judge = Callable[[VehicleSnapshot], tuple[Judgement, Prediction | None]]
_Checking = tuple[dict[Part, str], Future[tuple[Judgement, Prediction | None]]]


_TURN_S = 0.1
"""So often time passes for the guard. [s]"""
_LOOK_S = 1.0
"""So often the energy is looked at, and the status told. [s]"""
_ASK_S = 5.0
"""So often a message that does not come is asked for. [s]"""
_SET_MESSAGE_INTERVAL = 511
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
    """Everything a status line tells."""

    view: GuardView
    arming: ArmingSettings | None
    """``None`` until the parameters were read."""
    heard_ago_s: float
    is_armed: bool
    is_flying: bool
    energy: EnergyState | None
    """``None`` on the ground, and where nothing is measured."""
    state: VehicleState
    """Battery, home and position as the vehicle tells them."""


class GuardSession:
    """A guard on one line.

    Parameters
    ----------
    link : PymavlinkLink
        Opened to guard, or to read for one that only observes.
    settings : GuardSettings
        How it decides.
    link_settings : LinkSettings
        How patient the line is.
    judge : callable
        Checks what was read.
    on_decision, on_status : callable
        Told each decision as it is made, and the status every second.
    authoriser : Authoriser, optional
        Default this program's own messages.
    executor : Executor, optional
        Where checks run, so that the line is heard meanwhile; default here, in turn.
    lost_after_s : float
        A vehicle that is not heard for so long is lost. [s]
    warn_before_s : float
        How long before the point of no return to warn. [s]
    is_observing : bool
        Whether requests stay unanswered and nothing is announced.
    known : VehicleReading, optional
        What was read of the vehicle just now, for one that only observes.
    """

    def __init__(
        self,
        link: PymavlinkLink,
        settings: GuardSettings,
        link_settings: LinkSettings,
        *,
        judge: Judge,
        on_decision: Callable[[Decision], None],
        on_status: Callable[[GuardStatus], None],
        authoriser: Authoriser | None = None,
        executor: Executor | None = None,
        lost_after_s: float = 30.0,
        warn_before_s: float = 60.0,
        is_observing: bool = False,
        known: VehicleReading | None = None,
    ) -> None:
        self._link = link
        self._connection = link.connection
        self._settings = settings
        self._judge = judge
        self._on_decision = on_decision
        self._on_status = on_status
        self._authoriser = authoriser
        self._is_observing = is_observing
        self._executor = executor
        self._checking: _Checking | None = None
        self._lost_after_s = lost_after_s
        self._watch = VehicleWatch(link.identity, own_system=self._connection.own_system)
        self._reader = PartReader(link, self._watch, link_settings, known=known)
        now_s = self._connection.now_s
        self._guard = Guard(settings, now_s=now_s)
        self._work: deque[ReadParts | CheckVehicle] = deque()
        self._heard_s = now_s
        self._told_s: dict[str, float] = {}
        self._looked_s = self._asked_s = -_LOOK_S
        self._arming: ArmingSettings | None = None
        self._flight = FlightFollower(
            link.connection.telemetry, link.identity, warn_before_s=warn_before_s
        )

    def run(self) -> None:
        """Guard until something stops it.

        Raises
        ------
        LinkError
            If the vehicle is lost, or the line breaks.
        """
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
                self._take_check()
                self._refuse_silence()
        finally:
            connection.on_message = connection.on_turn = None

    def _take_message(self, received: Message) -> None:
        events = list(self._watch.events(received))
        if Heard() in events:
            self._heard_s = self._told_s[received.name] = self._connection.now_s
            events += self._told(received)
        for event in events:
            is_left = self._is_observing or self._authoriser is not None
            if not (isinstance(event, Asked) and is_left):
                self._feed(event)

    def _told(self, received: Message) -> tuple[Event, ...]:
        """Return what a message of the vehicle tells of its state."""
        if received.component != self._link.identity.component:
            return ()
        state = self._connection.telemetry.state()
        match received.name:
            case "HEARTBEAT":
                if bool(state.is_armed) != self._watch.is_armed:
                    self._watch.is_armed = bool(state.is_armed)
                    self._take_arming()
            case "HOME_POSITION" | "GLOBAL_POSITION_INT":
                return self._watch.take_home(state)
            case "BATTERY_STATUS" | "SYS_STATUS":
                return self._watch.take_charge(received)
        return ()

    def _refuse_silence(self) -> None:
        """Raise `LinkError` where the vehicle counts as lost."""
        silent_s = self._connection.now_s - self._heard_s
        if silent_s > self._lost_after_s:
            msg = f"the vehicle was not heard for {silent_s:.0f} s on {self._connection.name}"
            raise LinkError(msg)

    def _take_turn(self) -> None:
        if self._authoriser is not None:
            for request in self._authoriser.requests():
                self._feed(Asked(request=request))
        self._feed(Passed())
        self._look()
        self._refuse_silence()  # within a transfer too, which is as patient as it was told to be

    def _feed(self, event: Event) -> None:
        for action in self._guard.take(event, self._connection.now_s):
            self._act(action)

    def _act(self, action: Action) -> None:
        match action:
            case Answer(request=request, answer=answer):
                if self._authoriser is not None:
                    self._authoriser.answer(answer)
                else:
                    fields = acknowledgement_fields(request, answer)
                    self._connection.send(message("COMMAND_ACK", **fields))
            case Announce(severity=severity, text=text):
                self._announce(severity, text)
            case Decision():
                self._on_decision(action)
            case _:
                self._work.append(action)

    def _do(self, action: ReadParts | CheckVehicle) -> None:
        if isinstance(action, CheckVehicle):
            self._check()
            return
        for event in self._reader.read(action):
            if event.part is Part.PARAMETERS:
                self._set_arming()
            self._feed(event)

    def _set_arming(self) -> None:
        is_bytewise = self._link.identity.is_bytewise
        numbers = {one.name: one.number(is_bytewise=is_bytewise) for one in self._watch.parameters}
        arming = arming_settings(numbers, authoriser=self._connection.own_system)
        if arming != self._arming:
            self._arming = arming
            view = self._guard.view(self._connection.now_s)
            self._on_decision(Decision(kind="arming", verdict=view.verdict, text=arming.advice))
        self._feed_status()

    def _feed_status(self) -> None:
        if self._arming is not None:
            status = Status(
                is_asking=self._arming.is_asking,
                wait_s=self._arming.wait_s,
                is_armed=self._watch.is_armed,
            )
            self._feed(status)

    def _check(self) -> None:
        watch = self._watch
        state = self._connection.telemetry.state()
        checked = {
            part: fingerprint
            for part, fingerprint in watch.fingerprints.items()
            if part in self._settings.needed
        }
        try:
            reading = VehicleReading(
                state=_with_charge(state, watch), lists=watch.lists, parameters=watch.parameters
            )
            snapshot = make_snapshot(self._link.identity, reading, address=self._connection.name)
        except MavjouleError as error:
            self._take_judgement(checked, unknown_judgement(str(error)), None)
            return
        if self._executor is None:
            self._take_judgement(checked, *self._judge(snapshot))
        else:
            self._checking = (checked, self._executor.submit(self._judge, snapshot))

    def _take_judgement(
        self, checked: dict[Part, str], judgement: Judgement, prediction: Prediction | None
    ) -> None:
        self._flight.predict(prediction)
        self._feed(Judged(fingerprints=checked, judgement=judgement))

    def _take_check(self) -> None:
        """Take a check that has come to its end."""
        if self._checking is not None and self._checking[1].done():
            checked, future = self._checking
            self._checking = None
            self._take_judgement(checked, *future.result())

    def _take_arming(self) -> None:
        self._feed_status()
        self._flight.take_arming(is_armed=self._watch.is_armed)

    def _look(self) -> None:
        now_s = self._connection.now_s
        if now_s - self._looked_s < _LOOK_S:
            return
        self._looked_s = now_s
        energy, warnings = self._flight.look(now_s)
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
        if not self._is_observing:
            self._connection.send(message("STATUSTEXT", severity=severity, text=text))

    def _ask_for_streams(self) -> None:
        """Ask the vehicle to send what is followed, where it has not of late."""
        now_s = self._connection.now_s
        if now_s - self._asked_s < _ASK_S:
            return
        self._asked_s = now_s
        for name, (number, interval_s) in _STREAMS.items():
            if now_s - self._told_s.get(name, -math.inf) <= _ASK_S + interval_s:
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
    """Return a state with the charge and the home that a check is about."""
    battery = state.battery or BatteryState()
    return replace(
        state, battery=replace(battery, remaining_fraction=watch.charge), home=watch.home
    )


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
