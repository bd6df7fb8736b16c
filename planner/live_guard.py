"""The use case of guarding a vehicle: the check of what is on it, whenever that changes."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING

from planner.errors import LinkError, MavjouleError
from planner.guard.authorisation import (
    go_judgement,
    no_go_judgement,
    unknown_judgement,
)
from planner.guard.energy import Prediction
from planner.guard.guard import (
    GuardSettings,
    Part,
)
from planner.guard.session import GuardSession
from planner.link.parameters import Purpose
from planner.live import check_vehicle, open_link, silent
from planner.service import UnreadableMission
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.guard.authorisation import Judgement
    from planner.guard.guard import Decision
    from planner.guard.session import (
        Authoriser,
        GuardStatus,
    )
    from planner.link.pymavlink_link import OnProgress
    from planner.link.vehicle import VehicleSnapshot
    from planner.live import LinkRequest
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
    lost_after_s: float = 30.0
    keeps_waiting: bool = False
    """Whether a vehicle that is lost is waited for."""
    warn_before_s: float = 60.0


def guard_vehicle(
    request: LinkRequest,
    check: Setup,
    guard: GuardRequest,
    *,
    on_decision: Callable[[Decision], None],
    on_status: Callable[[GuardStatus], None],
    on_lost: Callable[[str], None] = lambda _: None,
    on_progress: OnProgress = silent,
) -> None:
    """Guard a vehicle until something stops it.

    Parameters
    ----------
    request : LinkRequest
        Which vehicle.
    check : Setup
        What its mission is checked against; its own parameters, charge and home are used.
    guard : GuardRequest
        How to guard it.
    on_decision : callable
        Told each decision.
    on_status : callable
        Told every second what is held.
    on_lost : callable
        Told why a vehicle is waited for that was lost.
    on_progress : callable
        Told how far what is read is.

    Raises
    ------
    LinkError
        If the vehicle is lost, and is not waited for.
    InputError, UsageError
        If the vehicle model is unusable, or a library is missing.
    """
    while True:
        try:
            _guard_once(
                request,
                check,
                guard,
                on_decision=on_decision,
                on_status=on_status,
                on_progress=on_progress,
            )
        except LinkError as error:
            if not guard.keeps_waiting:
                raise
            on_lost(str(error))
            time.sleep(_REOPEN_S)


def _guard_once(
    request: LinkRequest,
    check: Setup,
    guard: GuardRequest,
    *,
    on_decision: Callable[[Decision], None],
    on_status: Callable[[GuardStatus], None],
    on_progress: OnProgress,
) -> None:
    settings = guard.settings
    if guard.is_charge_given:
        settings = replace(settings, needed=settings.needed - {Part.BATTERY})
    with ExitStack() as stack:
        link = stack.enter_context(
            open_link(request, purpose=Purpose.GUARD, on_progress=on_progress)
        )
        authoriser: Authoriser | None = None
        if guard.uses_mavsdk:
            from planner.guard.authorisation import MavsdkAuthoriser

            authoriser = stack.enter_context(closing(MavsdkAuthoriser(link.connection)))
        executor = ThreadPoolExecutor(1)
        stack.callback(executor.shutdown, wait=False, cancel_futures=True)
        session = GuardSession(
            link,
            settings,
            request.settings,
            judge=lambda snapshot: judge_vehicle(
                snapshot, check, is_charge_given=guard.is_charge_given
            ),
            on_decision=on_decision,
            on_status=on_status,
            authoriser=authoriser,
            executor=executor,
            lost_after_s=guard.lost_after_s,
            warn_before_s=guard.warn_before_s,
        )
        session.run()


def judge_vehicle(
    snapshot: VehicleSnapshot, check: Setup, *, is_charge_given: bool = False
) -> tuple[Judgement, Prediction | None]:
    """Return what the check of a vehicle comes to, and the flight that it predicts.

    Parameters
    ----------
    snapshot : VehicleSnapshot
        Everything read of the vehicle.
    check : Setup
        What it is checked against.
    is_charge_given : bool
        Whether the charge of the request was meant.
    """
    try:
        result = check_vehicle(snapshot, check, is_charge_given=is_charge_given)
    except MavjouleError as error:
        return unknown_judgement(str(error)), None
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
    if result.verdict == "no-go":
        return no_go_judgement(result.findings, fail_on=check.fail_on), prediction
    margin_wh = None if battery is None else battery.margin_wh
    return go_judgement(margin_wh=margin_wh), prediction
