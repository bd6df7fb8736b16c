"""Rules of a profile: what a site asks of parameters, heights, distances and items."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.catalogue.site import (
    ITEM_REQUIRED_BY_SITE,
    PARAMETER_NOT_AS_EXPECTED,
    TOO_FAR_FOR_SITE,
    TOO_HIGH_FOR_SITE,
)
from planner.errors import nearest_hint
from planner.geo.geodesy import distance_m
from planner.mission.commands import command_name
from planner.vehicle.parameters.resolve import PARAMETERS_OF
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.site_profile import ExpectedValue
    from planner.vehicle.parameters.files import ParameterSet
    from planner.vehicle.parameters.table import Spelling


def check_expected_values(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for each parameter that is not as the profile asks."""
    profile, given = a.profile, a.given_parameters
    if profile is None or not profile.expected:
        return
    if given is None:
        yield PARAMETER_NOT_AS_EXPECTED.finding(
            f"{profile.source} asks for {quantity.count(len(profile.expected), 'parameter')}, none is "
            "known",
            fix="give the vehicle's parameters with --params",
        )
        return
    spellings = _spellings(given)
    for expected in profile.expected:
        said = _not_as_expected(expected, given, spellings)
        if said is not None:
            yield PARAMETER_NOT_AS_EXPECTED.finding(f"{said}, {profile.source} asks for {expected}")


def _spellings(given: ParameterSet) -> Mapping[str, tuple[Spelling, ...]]:
    """Return every spelling of a quantity by each of its names."""
    if given.stack is None or given.stack not in PARAMETERS_OF:
        return {}
    rows = parameter_table(PARAMETERS_OF[given.stack]).values()
    return {spelling.name: row.spellings for row in rows for spelling in row.spellings}


def _not_as_expected(
    expected: ExpectedValue, given: ParameterSet, spellings: Mapping[str, tuple[Spelling, ...]]
) -> str | None:
    """Return what a parameter is, where that is not as expected."""
    names = spellings.get(expected.name, ())
    present = next(
        (
            name
            for name in (expected.name, *(spelling.name for spelling in names))
            if name in given.values
        ),
        None,
    )
    if present is None:
        return (
            f"{expected.name} is not in {given.source}{nearest_hint(expected.name, given.values)}"
        )
    entry = given.values[present]
    if entry.value is None:
        return f"{present} holds no number"
    value = entry.value
    if present != expected.name:
        units = {spelling.name: spelling.si(1.0) for spelling in names}
        value *= units[present] / units[expected.name]
    if expected.holds(value):
        return None
    line = "" if entry.line is None else f" (line {entry.line})"
    as_named = "" if present == expected.name else f", that is {expected.name} = {value:.6g}"
    return f"{present} = {entry.value:.6g}{line}{as_named}"


def check_height(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the flight is higher than the profile allows."""
    profile, extremes = a.profile, a.flight.extremes
    limit_m = None if profile is None else profile.max_height_above_home_m
    if profile is None or limit_m is None or extremes is None:
        return
    heights_m = [stage.height_m for stage in a.route.stages]
    # A return may climb higher than every place; rounding of files is no breach.
    highest_m = max(*heights_m, extremes.highest_m)
    if highest_m <= limit_m + 0.05:
        return
    item = a.route.stages[int(np.argmax(heights_m))].item
    yield TOO_HIGH_FOR_SITE.finding(
        f"{quantity.beside(highest_m, limit_m, quantity.height)} above home, {profile.source} allows "
        f"{quantity.height(limit_m)}",
        item=item,
        place=a.mission.items[item - 1].place,
    )


def check_distance(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the mission or what belongs to it is farther away than allowed."""
    profile = a.profile
    if profile is None or profile.max_distance_m is None:
        return
    route, mission, limit_m = a.route, a.mission, profile.max_distance_m
    start = (route.frame.latitude_deg, route.frame.longitude_deg)
    origin, origin_name = start, "home"
    if profile.latitude_deg is not None and profile.longitude_deg is not None:
        origin, origin_name = (profile.latitude_deg, profile.longitude_deg), "the site"
    stages = route.frame.latitude_longitude_deg(
        [stage.east_m for stage in route.stages], [stage.north_m for stage in route.stages]
    )
    places = [("home", None, *start)]
    places += [
        (f"item {stage.item}", stage.item, latitude, longitude)
        for stage, latitude, longitude in zip(
            route.stages, *(column.tolist() for column in stages), strict=True
        )
    ]
    places += [
        (f"rally point {number}", None, point.latitude_deg, point.longitude_deg)
        for number, point in enumerate(mission.rally, start=1)
    ]
    if mission.fence is not None:
        places += [
            (f"a corner of fence polygon {number}", None, *vertex)
            for number, polygon in enumerate(mission.fence.polygons, start=1)
            if polygon.inclusion
            for vertex in polygon.vertices_deg
        ]
        places += [
            (
                f"the centre of fence circle {number}",
                None,
                circle.latitude_deg,
                circle.longitude_deg,
            )
            for number, circle in enumerate(mission.fence.circles, start=1)
            if circle.inclusion
        ]
    away_m = distance_m(*origin, [place[2] for place in places], [place[3] for place in places])
    farthest = int(np.argmax(away_m))
    if away_m[farthest] <= limit_m:
        return
    what, item = places[farthest][:2]
    away = quantity.beside(float(away_m[farthest]), limit_m, quantity.distance)
    beyond = int((away_m > limit_m).sum())
    more = f", and {quantity.count(beyond - 1, 'more place')}" if beyond > 1 else ""
    yield TOO_FAR_FOR_SITE.finding(
        f"{what} is {away} from {origin_name}{more}; "
        f"{profile.source} allows {quantity.distance(limit_m)}",
        item=item,
        place=None if item is None else mission.items[item - 1].place,
    )


def check_required_items(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the mission lacks an item that the profile asks for."""
    profile = a.profile
    if profile is None:
        return
    held = {command_name(item.command) for item in a.mission.items}
    missing = [name for name in profile.required_items if name not in held]
    if missing:
        yield ITEM_REQUIRED_BY_SITE.finding(
            f"{profile.source} asks for {', '.join(missing)}, the mission has none"
        )


SITE_CHECKS: tuple[Callable[[Assessment], Iterator[Finding]], ...] = (
    check_expected_values,
    check_height,
    check_distance,
    check_required_items,
)
