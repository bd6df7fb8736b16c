"""Plans and missions of every kind that hypothesis makes."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, TypeVar

from hypothesis import strategies as st
from plan_text import LANDING, STRUCTURE_SCAN, SURVEY

from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.commands import Command, has_location, load_command_table
from planner.mission.items import Home, MissionItem
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable

AREA_COMMANDS = {5000, 5001, 5002, 5003, 5004, 5100}
COMMANDS = sorted(set(load_command_table().commands) - AREA_COMMANDS - {Command.DO_JUMP})
LOCATED = [command for command in COMMANDS if has_location(command)]


def reals(limit: float) -> st.SearchStrategy[float]:
    """Numbers with every digit a double has, and whole ones."""
    return st.one_of(
        st.floats(-limit, limit, allow_subnormal=False),
        st.integers(-int(limit), int(limit)).map(float),
    )


LATITUDES = reals(90.0)
LONGITUDES = reals(180.0)
ALTITUDES = reals(20_000.0)
PARAMETERS = st.one_of(st.none(), reals(1e6))
UNKNOWN = st.dictionaries(
    st.text(min_size=1, max_size=6).map(lambda text: f"x-{text}"),
    st.recursive(
        st.one_of(st.none(), st.booleans(), st.integers(-9, 9), reals(9.0), st.text(max_size=6)),
        lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(), inner)),
        max_leaves=4,
    ),
    max_size=2,
)
"""Keys that no loader knows, with whatever JSON can hold."""


T = TypeVar("T")


def made(kind: Callable[..., T]) -> Callable[..., T]:
    """Return what makes values of a kind, without its types: hypothesis would look for all of them."""
    return lambda **fields: kind(**fields)  # noqa: PLW0108 - the inner function hides the types


ITEMS = st.builds(
    made(MissionItem),
    command=st.one_of(st.sampled_from(LOCATED), st.sampled_from(COMMANDS), st.just(50_001)),
    frame=st.sampled_from([0, 2, 3, 5, 6, 10, 11]),
    param1=PARAMETERS,
    param2=PARAMETERS,
    param3=PARAMETERS,
    param4=PARAMETERS,
    latitude_deg=st.one_of(st.none(), LATITUDES),
    longitude_deg=st.one_of(st.none(), LONGITUDES),
    altitude_m=st.one_of(st.none(), ALTITUDES),
    autocontinue=st.booleans(),
)


@st.composite
def item_lists(draw: st.DrawFn) -> tuple[MissionItem, ...]:
    """Items numbered from 1, with jumps among them that lead somewhere."""
    items = draw(st.lists(ITEMS, min_size=1, max_size=8))
    for at in draw(st.lists(st.integers(0, len(items)), max_size=2)):
        items.insert(at, _JUMP)
    return tuple(
        _numbered(item, number, target=float(draw(st.integers(1, len(items)))))
        for number, item in enumerate(items, start=1)
    )


_JUMP = MissionItem(
    command=Command.DO_JUMP,
    frame=2,
    param1=None,
    param2=3.0,
    param3=0.0,
    param4=0.0,
    latitude_deg=0.0,
    longitude_deg=0.0,
    altitude_m=0.0,
)


def _numbered(item: MissionItem, number: int, *, target: float) -> MissionItem:
    if item is _JUMP:
        return replace(item, jump_id=number, param1=target)
    return replace(item, jump_id=number)


HOMES = st.one_of(
    st.none(),
    st.builds(
        made(Home),
        latitude_deg=LATITUDES.filter(lambda value: value != 0.0),
        longitude_deg=LONGITUDES,
        altitude_amsl_m=st.one_of(st.none(), ALTITUDES),
    ),
)
FENCES = st.builds(
    made(Fence),
    polygons=st.lists(
        st.builds(
            made(FencePolygon),
            inclusion=st.booleans(),
            vertices_deg=st.lists(st.tuples(LATITUDES, LONGITUDES), min_size=3, max_size=5).map(
                tuple
            ),
        ),
        max_size=3,
    ).map(tuple),
    circles=st.lists(
        st.builds(
            made(FenceCircle),
            inclusion=st.booleans(),
            latitude_deg=LATITUDES,
            longitude_deg=LONGITUDES,
            radius_m=st.floats(0.5, 1e5),
        ),
        max_size=2,
    ).map(tuple),
    breach_return_deg_m=st.one_of(st.none(), st.tuples(LATITUDES, LONGITUDES, ALTITUDES)),
)
RALLY_POINTS = st.lists(
    st.builds(
        made(RallyPoint),
        latitude_deg=LATITUDES,
        longitude_deg=LONGITUDES,
        height_above_home_m=ALTITUDES,
    ),
    max_size=3,
).map(tuple)


@st.composite
def plans(draw: st.DrawFn) -> dict[str, Any]:
    """Plans that QGroundControl opens: every kind of item, fence and rally, unknown keys."""
    elements = draw(st.lists(st.one_of(_simple_elements(), _complex_elements()), max_size=6))
    return {
        "fileType": "Plan",
        "version": 1,
        "groundStation": draw(st.text(max_size=5)),
        "mission": {
            "version": 2,
            "firmwareType": draw(st.sampled_from([0, 3, 12])),
            "vehicleType": draw(st.sampled_from([0, 1, 2, 14, 20, 99])),
            "hoverSpeed": 5,
            "plannedHomePosition": draw(
                st.one_of(
                    st.just([None, None, None]),
                    st.tuples(LATITUDES, LONGITUDES, st.one_of(st.none(), ALTITUDES)).map(list),
                )
            ),
            "items": [element | draw(UNKNOWN) for element in elements],
        }
        | draw(UNKNOWN),
        "geoFence": _fence_section(draw(FENCES)) | draw(UNKNOWN),
        "rallyPoints": {"version": 2, "points": draw(st.lists(_POINTS, max_size=2))},
    } | draw(UNKNOWN)


_POINTS = st.tuples(LATITUDES, LONGITUDES, ALTITUDES).map(list)


@st.composite
def _simple_elements(draw: st.DrawFn) -> dict[str, Any]:
    item = draw(ITEMS)
    values = (item.param1, item.param2, item.param3, item.param4)
    element: dict[str, Any] = {
        "type": "SimpleItem",
        "command": item.command,
        "frame": item.frame,
        "autoContinue": item.autocontinue,
        "params": [*values, item.latitude_deg, item.longitude_deg, item.altitude_m],
    }
    if draw(st.booleans()):
        element["doJumpId"] = draw(st.integers(1, 900))
    if item.altitude_m is not None and draw(st.booleans()):  # a copy that may say otherwise
        copies = {"Altitude": draw(ALTITUDES), "AltitudeMode": draw(st.integers(0, 4))}
        element |= copies | {"AMSLAltAboveTerrain": None}
    return element


@st.composite
def _complex_elements(draw: st.DrawFn) -> dict[str, Any]:
    kind = draw(st.sampled_from(["survey", "CorridorScan", "StructureScan", "landing"]))
    if kind == "landing":
        return copy.deepcopy(LANDING)
    if kind == "StructureScan":
        return copy.deepcopy(STRUCTURE_SCAN)
    element = copy.deepcopy(SURVEY)
    if kind == "CorridorScan":
        element |= {"complexItemType": kind, "version": 2}
    else:
        element["version"] = draw(st.sampled_from([4, 5]))
    inner = draw(st.lists(_simple_elements(), min_size=1, max_size=4))
    element["TransectStyleComplexItem"]["Items"] = inner
    return element


def _fence_section(fence: Fence) -> dict[str, Any]:
    section: dict[str, Any] = {
        "version": 2,
        "polygons": [
            {
                "version": 1,
                "inclusion": one.inclusion,
                "polygon": [list(v) for v in one.vertices_deg],
            }
            for one in fence.polygons
        ],
        "circles": [
            {
                "version": 1,
                "inclusion": one.inclusion,
                "circle": {"center": [one.latitude_deg, one.longitude_deg], "radius": one.radius_m},
            }
            for one in fence.circles
        ],
    }
    if fence.breach_return_deg_m is not None:
        section["breachReturn"] = list(fence.breach_return_deg_m)
    return section
