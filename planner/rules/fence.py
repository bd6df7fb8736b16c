"""Rules on the fence: what is wrong with it, and where a flight leaves it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.catalogue.fence import LOITER_CROSSES, PATH_CROSSES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.findings import Finding
    from planner.geo.path import Barrier
    from planner.rules.assessment import Assessment
    from planner.rules.fenced_flight import FencedFlight

_ONE_PLACE_M = 1e-3
"""Parts of the path no farther from each other go on: rounding of sums. [m]"""


def is_fenced(a: Assessment) -> bool:
    """Return whether there is a fence: areas of the mission, or limits of the parameters."""
    if a.mission.fence:
        return True
    if a.fence_parameters is None:
        return False
    from planner.rules.fence_settings import limits_from_parameters

    return bool(limits_from_parameters(a.fence_parameters))


def check_fence(a: Assessment) -> Iterator[Finding]:
    """Yield what is wrong with the fence, and with the flight inside it."""
    if not is_fenced(a):
        return
    fence = a.mission.fence
    if a.fence_parameters is not None:
        from planner.rules.fence_heights import check_fence_heights

        yield from check_fence_heights(a)
    if fence:
        from planner.rules.fence_alone import check_enforcement, check_size

        yield from check_size(a.autopilot, fence)
        yield from check_enforcement(a.fence_parameters)
    yield from _check_flight(a)


def _check_flight(a: Assessment) -> Iterator[Finding]:
    """Yield what is wrong with the areas of the fence, with home, rally points and the flight."""
    from planner.rules.fence_alone import check_places
    from planner.rules.fence_returns import check_returns, unchecked_returns
    from planner.rules.fenced_flight import make_fenced_flight
    from planner.rules.stop_buffer import check_stop_buffer

    flown = make_fenced_flight(a)
    yield from flown.area.findings
    yield from unchecked_returns(a)
    barriers = [barrier for barrier in flown.area.barriers if not flown.is_clear_of(barrier)]
    if not barriers:
        return
    home = a.route.frame
    yield from check_places(
        flown.frame,
        barriers,
        home_deg=(home.latitude_deg, home.longitude_deg),
        rally=a.mission.rally,
    )
    crossing, findings = _crossings(flown, barriers)
    yield from findings
    yield from check_stop_buffer(flown, barriers, crossing)
    yield from check_returns(flown, barriers, crossing)


def _crossings(flown: FencedFlight, barriers: list[Barrier]) -> tuple[set[int], list[Finding]]:
    """Return the groups of legs that are outside somewhere, and the findings on the flight."""
    from planner.rules.fence_returns import own_return

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
        leg, _, _, number = min(pieces_of_rule)
        before_m = flown.along_path_m
        stretch = flown.flown_stretch(
            _joined(
                (before_m[leg] + start, before_m[leg] + end)
                for leg, start, end, _ in pieces_of_rule
            )
        )
        item = int(flown.path.item[leg])
        items = {int(flown.path.item[one[0]]) for one in pieces_of_rule}
        others = len({one[3] for one in pieces_of_rule}) - 1
        findings.append(
            rule.finding(
                f"{'the way home' if own_return(flown.assessment, item) else what} is beyond "
                f"{barriers[number].label}"
                + (f", and later beyond {quantity.count(others, 'other area')}" if others else "")
                + f"; {quantity.distance(stretch.distance_m)} lie outside the fence"
                + (f", at {quantity.count(len(items), 'item')}" if len(items) > 1 else ""),
                item=item,
                place=flown.place(item),
                stretch=stretch,
            )
        )
    return crossing, findings


def _joined(pieces_m: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return parts of a path in order, those joined that go on over a corner or overlap. [m]"""
    parts: list[tuple[float, float]] = []
    for start_m, end_m in sorted(pieces_m):
        if parts and start_m <= parts[-1][1] + _ONE_PLACE_M:
            parts[-1] = (parts[-1][0], max(parts[-1][1], end_m))
        else:
            parts.append((start_m, end_m))
    return parts
