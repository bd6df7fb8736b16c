"""Rules on the fence: what is wrong with it, and where a flight leaves it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers
from planner.autopilot import Autopilot
from planner.catalogue.fence import (
    FENCE_OFF,
    FENCE_TOO_LARGE,
    HOME_OUTSIDE,
    LOITER_CROSSES,
    PATH_CROSSES,
    RALLY_OUTSIDE,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.checks.case import Case
    from planner.checks.fenced_flight import FencedFlight
    from planner.findings import Finding
    from planner.geo.barrier import Barrier
    from planner.geo.fence import Fence

_PX4_POINTS = 64
"""Points PX4 stores (``DM_KEY_FENCE_POINTS_MAX``); 16 on small boards."""
_ARDUPILOT_VERTICES = 255
"""ArduPilot counts the vertices of a polygon in one byte."""


def check_fence(case: Case) -> Iterator[Finding]:
    """Yield what is wrong with the fence, and with the flight inside it."""
    fence = case.mission.fence
    if case.parameters is None:
        limited = False
    else:
        from planner.checks.fence_settings import limits_from_parameters

        limited = bool(limits_from_parameters(case.parameters))
    if not fence and not limited:
        return
    if limited:
        from planner.checks.fence_heights import check_fence_heights

        yield from check_fence_heights(case)
    if fence:
        yield from _check_size(case.autopilot, fence)
        yield from _check_enforcement(case)
    yield from _check_flight(case)


def _check_flight(case: Case) -> Iterator[Finding]:
    """Yield what is wrong with the areas of the fence, with home, rally points and the flight."""
    from planner.checks.fence_returns import check_returns, unchecked_returns
    from planner.checks.fenced_flight import make_fenced_flight
    from planner.checks.stop_buffer import check_stop_buffer

    flown = make_fenced_flight(case)
    yield from flown.area.findings
    yield from unchecked_returns(case)
    barriers = [barrier for barrier in flown.area.barriers if not flown.is_clear_of(barrier)]
    if not barriers:
        return
    yield from _check_places(flown, barriers)
    crossing, findings = _crossings(flown, barriers)
    yield from findings
    yield from check_stop_buffer(flown, barriers, crossing)
    yield from check_returns(flown, barriers, crossing)


def _check_size(autopilot: Autopilot, fence: Fence) -> Iterator[Finding]:
    """Yield a finding where the autopilot cannot hold all of a fence."""
    if autopilot is Autopilot.PX4:
        points = sum(len(p.vertices_deg) for p in fence.polygons) + len(fence.circles)
        if points > _PX4_POINTS:
            yield FENCE_TOO_LARGE.finding(f"the fence has {points} points, PX4 holds {_PX4_POINTS}")
    elif autopilot is Autopilot.ARDUPILOT:
        for polygon in fence.polygons:
            if len(polygon.vertices_deg) > _ARDUPILOT_VERTICES:
                yield FENCE_TOO_LARGE.finding(
                    f"a polygon of the fence has {len(polygon.vertices_deg)} vertices, ArduPilot "
                    f"counts to {_ARDUPILOT_VERTICES}",
                    place=polygon.place,
                )
                return


def _check_enforcement(case: Case) -> Iterator[Finding]:
    """Yield a finding where the parameters leave the fence without effect."""
    if case.parameters is None:
        return
    from planner.checks.fence_settings import why_not_enforced

    reason = why_not_enforced(case.parameters)
    if reason is not None:
        yield FENCE_OFF.finding(reason)


def _check_places(flown: FencedFlight, barriers: list[Barrier]) -> Iterator[Finding]:
    """Yield findings where home or a rally point is outside."""
    for index, place in enumerate(flown.targets_m):
        distance_m = [float(barrier.signed_distance_m(place[None])[0]) for barrier in barriers]
        if min(distance_m) >= 0.0:
            continue
        worst = distance_m.index(min(distance_m))
        message = f"{numbers.distance(-distance_m[worst])} beyond {barriers[worst].label}"
        if index == 0:
            yield HOME_OUTSIDE.finding(
                f"home is {message}", stretch=flown.stretch(place, place, -distance_m[worst])
            )
        else:
            yield RALLY_OUTSIDE.finding(
                f"rally point {index} is {message}",
                place=flown.case.mission.rally[index - 1].place,
                stretch=flown.stretch(place, place, -distance_m[worst]),
            )


def _crossings(flown: FencedFlight, barriers: list[Barrier]) -> tuple[set[int], list[Finding]]:
    """Return the groups of legs that are outside somewhere, and the findings on the flight."""
    from planner.checks.fence_returns import own_return

    crossing: set[int] = set()
    found: list[tuple[int, float, float, int]] = []
    for number, barrier in enumerate(barriers):
        chosen = flown.legs_near(barrier)
        if not len(chosen):
            continue
        pieces = barrier.stretches_outside(flown.legs(chosen))
        legs = chosen[pieces.leg].tolist()
        crossing.update(flown.group[legs].tolist())
        starts_m, ends_m = pieces.start_m.tolist(), pieces.end_m.tolist()
        found += zip(legs, starts_m, ends_m, [number] * len(legs), strict=True)
    findings = []
    for rule, what, of_circle in (
        (PATH_CROSSES, "the flight to here", False),
        (LOITER_CROSSES, "the loiter circle", True),
    ):
        pieces_of_rule = [one for one in found if flown.path.is_circle[one[0]] == of_circle]
        if not pieces_of_rule:
            continue
        leg, start_m, _, number = min(pieces_of_rule)
        last_leg, _, end_m, _ = max(pieces_of_rule)
        outside_m = sum(end - start for _, start, end, _ in pieces_of_rule)
        item = int(flown.path.item[leg])
        items = {int(flown.path.item[one[0]]) for one in pieces_of_rule}
        others = len({one[3] for one in pieces_of_rule}) - 1
        findings.append(
            rule.finding(
                f"{'the way home' if own_return(flown.case, item) else what} is beyond "
                f"{barriers[number].label}"
                + (f", and later beyond {numbers.count(others, 'other area')}" if others else "")
                + f"; {numbers.distance(outside_m)} lie outside the fence"
                + (f", at {numbers.count(len(items), 'item')}" if len(items) > 1 else ""),
                item=item,
                place=flown.place(item),
                stretch=flown.stretch(
                    flown.along_m(leg, start_m), flown.along_m(last_leg, end_m), outside_m
                ),
            )
        )
    return crossing, findings
