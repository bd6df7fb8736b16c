"""Watching a vehicle on the line: everything it holds, as it changes, and nothing said to it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import TYPE_CHECKING, Protocol

from planner.errors import MavjouleError, UsageError
from planner.guard.guard import (
    GuardSettings,
    Part,
)
from planner.guard.session import GuardSession
from planner.link.snapshot import make_snapshot, read_vehicle
from planner.live import open_link
from planner.live_guard import judge_vehicle
from planner.values import replace

if TYPE_CHECKING:
    from threading import Event

    from planner.guard.authorisation import Judgement
    from planner.guard.energy import Prediction
    from planner.guard.session import GuardStatus
    from planner.link.vehicle import VehicleSnapshot
    from planner.live import LinkRequest
    from planner.setup import Setup

_REOPEN_S = 2.0
"""Until a line that broke is opened again. [s]"""


class Watcher(Protocol):
    """Is told what a vehicle does; from any thread."""

    def progress(self, what: str, done: int, count: int | None) -> None:
        """Take how far what is read at first is."""

    def received(self, snapshot: VehicleSnapshot) -> None:
        """Take everything that was read, again whenever some of it changed."""

    def told(self, status: GuardStatus) -> None:
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
    tell: Watcher,
    is_charge_given: bool = False,
) -> None:
    """Watch a vehicle until it is enough; only requests to tell something go out.

    Parameters
    ----------
    request : LinkRequest
        Which vehicle.
    check : Setup
        What its flight is predicted with.
    is_over : threading.Event
        Set when it is enough; looked at whenever something is told.
    tell : Watcher
        Who is told.
    is_charge_given : bool
        Whether the charge of the check was meant, and is not to be the vehicle's.

    Raises
    ------
    UsageError
        If a library is missing.
    """
    while not is_over.is_set():
        try:
            _watch_once(request, check, is_over, tell, is_charge_given=is_charge_given)
        except UsageError:
            raise
        except MavjouleError as error:
            tell.lost(str(error))
            is_over.wait(_REOPEN_S)
        except _OverError:
            return


def _watch_once(
    request: LinkRequest,
    check: Setup,
    is_over: Event,
    tell: Watcher,
    *,
    is_charge_given: bool,
) -> None:
    def go_on() -> None:
        if is_over.is_set():
            raise _OverError

    def judge(snapshot: VehicleSnapshot) -> tuple[Judgement, Prediction | None]:
        tell.received(snapshot)
        return judge_vehicle(snapshot, check, is_charge_given=is_charge_given)

    def tell_status(status: GuardStatus) -> None:
        go_on()
        tell.told(status)

    def tell_progress(what: str, done: int, count: int | None) -> None:
        go_on()
        tell.progress(what, done, count)

    settings = GuardSettings()
    if is_charge_given:
        settings = replace(settings, needed=settings.needed - {Part.BATTERY})
    with ExitStack() as stack:
        link = stack.enter_context(open_link(request, on_progress=tell_progress))
        known = read_vehicle(link)
        tell.received(make_snapshot(link.identity, known, address=request.address.text))
        executor = ThreadPoolExecutor(1)
        stack.callback(executor.shutdown, wait=False, cancel_futures=True)
        GuardSession(
            link,
            settings,
            request.settings,
            judge=judge,
            on_decision=lambda _: None,
            on_status=tell_status,
            executor=executor,
            is_observing=True,
            known=known,
        ).run()
