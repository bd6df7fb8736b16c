"""What missions cover, walked item by item apart from our own router: places flown with their state.

A sample is a place on a straight leg, with what the camera, the gimbal, the outputs and the speed are
set to there; a deed is an item that does something once, with the place it is done at; a curve is a
spline or a circle, with all the places that bend it.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.mission.items import Mission, MissionItem

_METRES = 111_200.0
_GOING = {16, 19, 82, 18, 31, 21}
_SPLINE, _CIRCLE = 82, 18
_STATE = {
    178: "speed",
    206: "trigger",
    195: "roi",
    201: "roi",
    197: "roi",
    205: "mount",
    1000: "mount",
    115: "yaw",
}
_STATE |= {2500: "video", 2501: "video", 183: "servo", 181: "relay"}
_DEEDS = {203, 2000, 2001, 211}
_OFF = {("trigger", 0.0), ("roi", None), ("video", None)}


class Sample(NamedTuple):
    """A place flown over, and the state it is flown over with."""

    east_m: float
    north_m: float
    height_m: float
    state: frozenset[tuple[str, object]]


def legs(mission: Mission) -> Iterator[tuple[tuple[float, float, float], ...]]:
    """Yield nothing but the straight legs a mission's waypoints make, without state."""
    for start, end, _ in _legs(mission):
        yield (start, end)


def samples(mission: Mission, *, every_m: float) -> list[Sample]:
    """Return places along every leg that is not the return."""
    found = []
    for start, end, state in _legs(mission):
        length = math.dist(start[:2], end[:2])
        count = max(int(length / every_m), 1)
        for number in range(count + 1):
            share = number / count
            place = [a + share * (b - a) for a, b in zip(start, end, strict=True)]
            found.append(Sample(place[0], place[1], place[2], state))
    return found


def deeds(mission: Mission) -> list[tuple[int, float | None, int, int]]:
    """Return what is done once: command, first parameter and place to the metre."""
    done = []
    for item, place in _walk(mission):
        if item.command in _DEEDS and (item.command != 2000 or item.param3 == 1.0):
            done.append((item.command, item.param1, round(place[0]), round(place[1])))
    return done


class Curve(NamedTuple):
    """A spline or a circle."""

    what: tuple[float | None, ...]
    """Command, first parameter and radius."""
    bent_by: tuple[tuple[float, float, float], ...]
    """The places before it, its own, and the one after, those that shape it."""
    state: frozenset[tuple[str, object]]


def curves(mission: Mission) -> list[Curve]:
    """Return the splines and circles of a mission in flown order.

    A spline leaves along the whole of the straight leg before it, or as the spline before arrives, and
    arrives towards the place after it, unless the vehicle stops there; a circle begins at its edge on
    the way from the place before, and the leg after it begins there too.
    """
    flown = [
        (item, place, state)
        for item, place, state in _with_state(mission)
        if item.command in _GOING or item.command in {20, 22}
    ]
    found = []
    for number, (item, _, state) in enumerate(flown):
        if item.command not in {_SPLINE, _CIRCLE}:
            continue
        first = number - 1
        if item.command == _SPLINE:
            while first > 0 and _is_passed(flown[first][0]):
                first -= 1
                if flown[first + 1][0].command != _SPLINE:
                    break
        # the way home leads nowhere that a place of the mission is bent by
        after = flown[number + 1 : number + 2]
        last = number + sum(one.command in _GOING for one, *_ in after)
        found.append(
            Curve(
                (item.command, item.param1, item.param3),
                tuple(place for _, place, _ in flown[first : last + 1]),
                state,
            )
        )
    return found


def is_same_curve(one: Curve, other: Curve, *, within_m: float) -> bool:
    """Return whether two curves are bent by the same places and flown with the same state."""
    return (
        one.what == other.what
        and one.state == other.state
        and len(one.bent_by) == len(other.bent_by)
        and all(
            math.dist(a, b) <= within_m for a, b in zip(one.bent_by, other.bent_by, strict=True)
        )
    )


def _is_passed(item: MissionItem) -> bool:
    return item.command in {16, _SPLINE} and not item.param1


def uncovered(
    wanted: Iterable[Sample], flown: Iterable[Sample], *, within_m: float
) -> list[Sample]:
    """Return the samples at whose place no other lies with the same state."""
    places = defaultdict(list)
    for one in flown:
        places[one.state].append(one[:3])
    arrays = {state: np.array(of) for state, of in places.items()}
    return [
        one
        for one in wanted
        if one.state not in arrays
        or not (np.abs(arrays[one.state] - one[:3]) <= within_m).all(axis=1).any()
    ]


def _place(mission: Mission, item: MissionItem) -> tuple[float, float, float]:
    home = mission.home
    assert home is not None
    north = (item.latitude_deg - home.latitude_deg) * _METRES  # type: ignore[operator]  # given
    east = (item.longitude_deg - home.longitude_deg) * _METRES  # type: ignore[operator]  # given
    east *= math.cos(math.radians(home.latitude_deg))
    height = item.altitude_m or 0.0
    return (east, north, height - (home.altitude_amsl_m or 0.0) if item.frame == 0 else height)


def _walk(mission: Mission) -> Iterator[tuple[MissionItem, tuple[float, float, float]]]:
    """Yield the items in flown order with where the vehicle is when each is done."""
    place, at, taken = (0.0, 0.0, 0.0), 0, dict[int, int]()
    while at < len(mission.items):
        item = mission.items[at]
        if item.command in _GOING and item.latitude_deg is not None:
            place = _place(mission, item)
        elif item.command == 22:
            place = (place[0], place[1], item.altitude_m or 0.0)
        yield item, place
        if item.command in {20, 21}:
            return
        if item.command == 177 and taken.get(at, 0) < (item.param2 or 0.0):
            taken[at] = taken.get(at, 0) + 1
            at = int(item.param1 or 1.0) - 1
        else:
            at += 1


def _legs(
    mission: Mission,
) -> Iterator[
    tuple[tuple[float, float, float], tuple[float, float, float], frozenset[tuple[str, object]]]
]:
    here: tuple[float, float, float] | None = None
    for item, place, state in _with_state(mission):
        if item.command in _GOING or item.command == 22:
            if here is not None:
                yield here, place, state
            here = place


def _with_state(
    mission: Mission,
) -> Iterator[tuple[MissionItem, tuple[float, float, float], frozenset[tuple[str, object]]]]:
    """Yield the items in flown order with the place and what is set on the way to it."""
    state: dict[str, object] = {}
    for item, place in _walk(mission):
        if item.command in _STATE:
            name = _STATE[item.command]
            if name in {"servo", "relay"}:
                state[f"{name} {item.param1}"] = item.param2
            elif item.command in {197, 2501}:
                state[name] = None
            elif name == "roi":
                state[name] = (item.latitude_deg, item.longitude_deg)
            else:
                state[name] = item.param2 if name == "speed" else item.param1
        yield item, place, frozenset(state.items()) - _OFF
