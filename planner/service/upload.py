"""The use case of putting a mission on a vehicle, after its check, with all that is lost reported."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import UsageError
from planner.findings import Rule, Severity
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.snapshot import fetch_snapshot
from planner.link.upload import upload_mission
from planner.link.vehicle import open_link, silent
from planner.service.vehicle import check_vehicle, go_objection
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from planner.findings import Finding
    from planner.link.snapshot import VehicleSnapshot
    from planner.link.upload import UploadResult
    from planner.link.vehicle import LinkRequest, OnProgress
    from planner.mission.items import Mission
    from planner.service.preflight import CheckResult, UnreadableMission
    from planner.setup import Setup


class Upload(Value):
    """A mission that was checked for a vehicle, and what became of it there."""

    check: CheckResult | UnreadableMission
    """With the vehicle's own parameters, charge and home."""
    result: UploadResult | None
    """``None`` where it was not sent."""
    spans_s: Mapping[str, float] = {}
    """How long each part of it took by the line's clock, in their order. [s]"""


class UploadProposal(Value):
    """What is to be sent, before it is."""

    snapshot: VehicleSnapshot
    check: CheckResult | UnreadableMission
    replaced: tuple[str, ...]
    """What is put in place of another, such as ``8 items`` and ``a fence of 2 areas``."""
    removed: tuple[str, ...]
    """What the vehicle has and the mission has not."""

    @property
    def objection(self) -> str:
        """Why it is not to be sent without force; empty where it is a go beyond doubt."""
        # Whoever ignores V106 has agreed to lose the vehicle's fence.
        return go_objection(self.check, consented=frozenset({FENCE_REMOVED.code}))


class UploadOptions(Value):
    """How a mission is sent."""

    listen_s: float | None = None
    """How long the vehicle is listened to afterwards; ``None``: until it has taken the mission. [s]"""
    keeps_areas: bool = False
    """Whether the vehicle keeps its fence and rally points where the mission has none; it is checked
    with them then."""
    is_forced: bool = False
    """Whether it is sent to a vehicle that is armed or in the air, too."""


def send_mission(
    mission: Mission,
    request: LinkRequest,
    setup: Setup,
    *,
    may_send: Callable[[UploadProposal], bool],
    options: UploadOptions,
    is_charge_given: bool = False,
    on_progress: OnProgress = silent,
) -> Upload:
    """Check a mission with what a vehicle reports, and send it there if it may be.

    What the vehicle reports counts as in `check_vehicle`.  ``may_send`` is asked once, with the
    verdict and what is lost; nothing is sent without its yes.

    Raises
    ------
    LinkError
        If no vehicle answers, or a transfer breaks; the message names what is on the vehicle then.
    UsageError
        If vehicle or battery are not named, the vehicle is armed or in the air, or does not report
        it, or an item cannot be sent.
    """
    setup.require_named("upload")
    with open_link(request, purpose=Purpose.UPLOAD, on_progress=on_progress) as link:
        began_s = [link.opened_s, link.connection.now_s]
        snapshot = fetch_snapshot(link, mission)
        began_s.append(link.connection.now_s)
        if not options.is_forced:
            _refuse_hazard(snapshot)
        kept = tuple(_removed(mission, snapshot)) if options.keeps_areas else ()
        mission = _with_kept(mission, snapshot.mission, kept)
        fence = None if mission.fence is None else mission.fence.as_held
        found = (*mission.findings, *check_removal(mission, snapshot))
        judged = replace(mission, fence=fence, findings=found)
        check = check_vehicle(snapshot, setup, mission=judged, is_charge_given=is_charge_given)
        proposal = UploadProposal(
            snapshot=snapshot,
            check=check,
            replaced=_replaced(mission, snapshot.mission, kept),
            removed=tuple(_removed(mission, snapshot).values()),
        )
        began_s.append(link.connection.now_s)
        if not may_send(proposal):
            return Upload(check=check, result=None)
        began_s.append(link.connection.now_s)
        if not options.is_forced:
            # Looked at last of all: it may have been armed during the question.
            _refuse_hazard(replace(snapshot, state=link.fetch_state(is_whole=False)))
        sent = upload_mission(
            link,
            mission,
            listen_s=options.listen_s,
            kept=kept,
            has_home=snapshot.state.home is not None,
        )
        parts = ("vehicle found", "read", "checked", "confirmed")
        spans_s = {
            part: end - start for part, (start, end) in zip(parts, pairwise(began_s), strict=True)
        }
        return Upload(check=check, result=sent, spans_s={**spans_s, **sent.spans_s})


FENCE_REMOVED = Rule(
    "V106 fence-removed",
    Severity.ERROR,
    summary="The vehicle has a fence, and the mission to be sent has none.",
    why="A mission is sent with its fence and rally points, as ground stations do: without one, the "
    "vehicle flies without its fence from then on.  Text files hold no fence beside a mission.",
    how="mavjoule upload compares what was read from the vehicle with the mission.",
    fix="give --keep-fence to leave it there, or --ignore V106 to have it removed",
)

RALLY_REMOVED = Rule(
    "V107 rally-removed",
    Severity.WARNING,
    summary="The vehicle has rally points, and the mission to be sent has none.",
    why="It returns home from then on, and not to the nearest of them.",
    how="mavjoule upload compares what was read from the vehicle with the mission.",
    fix="give --keep-fence to leave them there, or add them to the mission",
)


def check_removal(mission: Mission, snapshot: VehicleSnapshot) -> tuple[Finding, ...]:
    """Return what is lost of a vehicle's fence and rally points where a mission is sent."""
    rules = {MissionKind.FENCE: FENCE_REMOVED, MissionKind.RALLY: RALLY_REMOVED}
    return tuple(
        rules[kind].finding(
            f"{snapshot.identity.label} has {held} and the mission has none: "
            "sending it removes the vehicle's"
        )
        for kind, held in _removed(mission, snapshot).items()
    )


def _refuse_hazard(snapshot: VehicleSnapshot) -> None:
    if hazard := snapshot.state.hazard:
        msg = (
            f"nothing was sent to {snapshot.identity.label}, {hazard}: land and disarm it, or give "
            "--force"
        )
        raise UsageError(msg)


def _areas(held: Mission) -> dict[MissionKind, str]:
    """Return ``a fence of 2 areas`` and ``3 rally points``, what a vehicle has of them."""
    found = {}
    if held.fence is not None:  # one of broken areas alone, too
        count = quantity.count(held.fence.area_count, "area")
        found[MissionKind.FENCE] = f"a fence of {count}"
    if held.rally:
        found[MissionKind.RALLY] = quantity.count(len(held.rally), "rally point")
    return found


def _removed(mission: Mission, snapshot: VehicleSnapshot) -> dict[MissionKind, str]:
    """Return what the vehicle has of fence and rally points, and the mission has not."""
    fence = mission.fence
    has_fence = fence is not None and (bool(fence) or fence.breach_return_deg_m is not None)
    has = {MissionKind.FENCE: has_fence, MissionKind.RALLY: bool(mission.rally)}
    return {kind: held for kind, held in _areas(snapshot.mission).items() if not has[kind]}


def _with_kept(mission: Mission, held: Mission, kept: Collection[MissionKind]) -> Mission:
    """Return a mission with what stays on the vehicle, and what is wrong with that."""
    if MissionKind.FENCE in kept:
        mission = replace(mission, fence=held.fence)
    if MissionKind.RALLY in kept:
        mission = replace(mission, rally=held.rally)
    return replace(mission, findings=(*mission.findings, *held.findings)) if kept else mission


def _replaced(mission: Mission, held: Mission, kept: Collection[MissionKind]) -> tuple[str, ...]:
    areas = _areas(held)
    if held.fence == mission.fence:
        areas.pop(MissionKind.FENCE, None)
    left = (label for kind, label in areas.items() if kind not in kept)
    return (quantity.count(len(held.items), "item"), *left)
