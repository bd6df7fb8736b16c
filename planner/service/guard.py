"""The use case of guarding a vehicle: the check of what is on it, whenever that changes."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Protocol

from planner.errors import LinkError, MavjouleError, UsageError, bug_text
from planner.findings import Severity
from planner.guard.authorisation import go_judgement, no_go_judgement, unknown_judgement
from planner.guard.decision import GuardSettings
from planner.guard.energy import Prediction
from planner.guard.session import GuardSession
from planner.link.connection import Purpose
from planner.link.snapshot import make_snapshot, read_vehicle
from planner.link.vehicle import open_link
from planner.service.preflight import CheckResult, UnreadableMission
from planner.service.vehicle import check_vehicle, go_objection
from planner.setup import basis_text
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable
    from threading import Event

    from planner.guard.authorisation import Judgement
    from planner.guard.decision import Decision
    from planner.guard.session import Authoriser, GuardStatus
    from planner.link.snapshot import VehicleSnapshot
    from planner.link.vehicle import LinkRequest
    from planner.setup import Setup


_REOPEN_S = 2.0
"""Until a line that broke is opened again. [s]"""


class GuardRequest(Value):
    """How to guard a vehicle."""

    settings: GuardSettings = GuardSettings()
    is_charge_given: bool = False
    """Whether the charge of the setup was given, and is not to be the vehicle's."""
    uses_mavsdk: bool = False
    """Whether MAVSDK answers requests, and not this program's own messages."""
    keeps_waiting: bool = False


def guard_vehicle(
    request: LinkRequest,
    check: Setup,
    guard: GuardRequest,
    *,
    on_decision: Callable[[Decision], None],
    on_status: Callable[[GuardStatus], None],
    on_lost: Callable[[str], None] = lambda _: None,
) -> None:
    """Guard a vehicle until something stops it.

    Each decision is reported, every second the status, and why a vehicle was lost that is waited for.

    Raises
    ------
    LinkError
        If the vehicle is lost, and is not waited for.
    InputError, UsageError
        If the vehicle model is unusable, vehicle or battery are not named, or a library is missing.
    """
    check.require_named("guard")
    if guard.uses_mavsdk and request.signing_key is not None:
        msg = "MAVSDK signs no messages: leave --authoriser mavsdk away, or --signing-key"
        raise UsageError(msg)
    while True:
        try:
            with open_link(request, purpose=Purpose.GUARD) as link, ExitStack() as stack:
                authoriser: Authoriser | None = None
                if guard.uses_mavsdk:
                    from planner.guard.authorisation import MavsdkAuthoriser

                    authoriser = stack.enter_context(closing(MavsdkAuthoriser(link.connection)))
                GuardSession(
                    link,
                    replace(guard.settings, counts_charge=not guard.is_charge_given),
                    judge=lambda snapshot: judge_vehicle(
                        snapshot, check, is_charge_given=guard.is_charge_given
                    ),
                    on_decision=on_decision,
                    on_status=on_status,
                    authoriser=authoriser,
                    executor=_executor(stack),
                ).run()
        except LinkError as error:
            if not guard.keeps_waiting:
                raise
            on_lost(str(error))
            time.sleep(_REOPEN_S)


def _executor(stack: ExitStack) -> ThreadPoolExecutor:
    executor = ThreadPoolExecutor(1)
    stack.callback(executor.shutdown, wait=False, cancel_futures=True)
    return executor


def judge_vehicle(
    snapshot: VehicleSnapshot, check: Setup, *, is_charge_given: bool = False
) -> tuple[Judgement, Prediction | None]:
    """Return what the check of a vehicle comes to, and the flight that it predicts; never fails."""
    try:
        return _judged(snapshot, check, is_charge_given=is_charge_given)
    except MavjouleError as error:
        return unknown_judgement(str(error)), None
    except Exception as error:  # noqa: BLE001 - whoever guards a vehicle goes on
        return unknown_judgement(bug_text(error)), None


def _judged(
    snapshot: VehicleSnapshot, check: Setup, *, is_charge_given: bool
) -> tuple[Judgement, Prediction | None]:
    result = check_vehicle(snapshot, check, is_charge_given=is_charge_given)
    if isinstance(result, UnreadableMission):
        return no_go_judgement(result.findings, fail_on=check.fail_on), None
    battery, assessment = result.battery, result.assessment
    prediction = None
    if battery is not None and assessment is not None and assessment.pack is not None:
        prediction = Prediction(
            returns=assessment.returns,
            battery=assessment.pack,
            charge=assessment.charge,
            usable_wh=battery.usable_wh,
            reserve_wh=battery.reserve_wh,
            temperature_c=assessment.flight.power.home_temperature_c,
        )
    judgement = _judgement(result)
    given = basis_text(result.setup, capacity_wh=None if battery is None else battery.capacity_wh)
    return replace(judgement, text=f"{judgement.text} ({given})"), prediction


def _judgement(result: CheckResult) -> Judgement:
    if result.verdict == "no-go":
        return no_go_judgement(result.findings, fail_on=result.setup.fail_on)
    hidden = [one for one in result.suppressed if one.severity is Severity.ERROR]
    if hidden:  # asked not to be reported, and no reason to let a vehicle arm
        return no_go_judgement(hidden, fail_on=Severity.ERROR)
    if objection := go_objection(result):
        return unknown_judgement(objection)
    return go_judgement(margin_wh=None if result.battery is None else result.battery.margin_wh)


class Watcher(Protocol):
    """Receives what a vehicle does; from any thread."""

    def progress(self, what: str, done: int, count: int | None) -> None:
        """Take how far what is read at first is."""

    def received(self, snapshot: VehicleSnapshot) -> None:
        """Take everything that was read, again whenever some of it changed."""

    def reported(self, status: GuardStatus) -> None:
        """Take what holds, every second."""

    def lost(self, why: str) -> None:
        """Take why the vehicle is waited for."""


class _OverError(Exception):
    """Nobody watches any more."""


def watch_vehicle(
    request: LinkRequest,
    check: Setup,
    *,
    is_over: Event,
    watcher: Watcher,
    is_charge_given: bool = False,
) -> None:
    """Watch a vehicle until it is over; only requests for messages go out.

    `UsageError` where a library is missing; a vehicle that is lost is waited for.
    """

    def raise_if_over() -> None:
        if is_over.is_set():
            raise _OverError

    def judge(snapshot: VehicleSnapshot) -> tuple[Judgement, Prediction | None]:
        watcher.received(snapshot)
        return judge_vehicle(snapshot, check, is_charge_given=is_charge_given)

    def report_status(status: GuardStatus) -> None:
        raise_if_over()
        watcher.reported(status)

    def report_progress(what: str, done: int, count: int | None) -> None:
        raise_if_over()
        watcher.progress(what, done, count)

    settings = GuardSettings(is_observing=True, counts_charge=not is_charge_given)
    while not is_over.is_set():
        try:
            with open_link(request, on_progress=report_progress) as link, ExitStack() as stack:
                known = read_vehicle(link)
                watcher.received(make_snapshot(link.identity, known, address=request.address.text))
                GuardSession(
                    link,
                    settings,
                    judge=judge,
                    on_decision=lambda _: None,
                    on_status=report_status,
                    executor=_executor(stack),
                    known=known,
                ).run()
        except UsageError:
            raise
        except MavjouleError as error:
            watcher.lost(str(error))
            is_over.wait(_REOPEN_S)
        except _OverError:
            return
