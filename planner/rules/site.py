"""Rules of a profile: what a site asks of parameters, heights, distances and items."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import nearest_hint
from planner.findings import Rule, Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import command_name, is_navigation
from planner.rules.declaration import EXTREMES, PROFILE, judges
from planner.rules.left_open import IN_SIGHT_M
from planner.rules.terrain_following import tops_over_terrain_m
from planner.rules.terrain_posts import heights_by_posts_m
from planner.vehicle.parameters.resolve import PARAMETERS_OF
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.prediction import Extremes
    from planner.rules.assessment import Assessment
    from planner.site_profile import ExpectedValue, SiteProfile
    from planner.vehicle.parameters.files import ParameterSet
    from planner.vehicle.parameters.table import Spelling

_ROUNDING_M = 0.05
"""Rounding of files is no breach. [m]"""
PATH_SLACK_M = 1.0
"""Recorded flights come up to 0.8 m past places they stop at. [m]"""

PARAMETER_NOT_AS_EXPECTED = Rule(
    "P103 expected-value",
    Severity.ERROR,
    summary="A parameter of the vehicle differs from the site profile.",
    why="Clubs write such checkers by hand for every site (MAVProxy #629, its cmac_check): failsafes "
    "and return heights are set on the vehicle, and forgotten there.",
    how="[expect.params] of --profile against the parameters of --params, under the old or the new "
    "name, compared in SI; a parameter missing from the file differs too.",
    fix="set the parameter on the vehicle, or correct the profile",
)


@judges(PARAMETER_NOT_AS_EXPECTED, needs=(PROFILE,))
def _parameter_not_as_expected(a: Assessment, profile: SiteProfile) -> Iterator[Finding]:
    given = a.setup.parameters
    if given is None:
        if profile.expected:
            yield a.finding(
                PARAMETER_NOT_AS_EXPECTED,
                f"no parameters given; {profile.source} expects "
                f"{quantity.count(len(profile.expected), 'value')}",
                fix="give the vehicle's parameters with --params",
            )
        return
    spellings = _spellings(given)
    for expected in profile.expected:
        actual = _not_as_expected(expected, given, spellings)
        if actual is not None:
            yield a.finding(
                PARAMETER_NOT_AS_EXPECTED, f"{actual}; {profile.source} expects {expected}"
            )


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
        return f"{expected.name} is missing from {given.source}{nearest_hint(expected.name, given.values)}"
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


TOO_HIGH_FOR_SITE = Rule(
    "A114 too-high-for-site",
    Severity.ERROR,
    summary="The flight is higher above home than the site profile allows.",
    why="The limit of a permit is in neither the vehicle nor the mission.",
    how="The greatest height of the predicted flight, and of the returns from anywhere on it, more than "
    "5 cm above max_height_above_home_m.",
    fix="fly lower",
)


@judges(TOO_HIGH_FOR_SITE, needs=(PROFILE, EXTREMES))
def _too_high_for_site(
    a: Assessment, profile: SiteProfile, _extremes: Extremes
) -> Iterator[Finding]:
    limit_m, reach = profile.max_height_above_home_m, a.reach
    heights_m = [stage.height_m for stage in a.route.stages]
    highest_m, item, where = max(heights_m), a.route.stages[int(np.argmax(heights_m))].item, ""
    row = int(reach.height_m.argmax())
    if reach.height_m[row] > highest_m + _ROUNDING_M:  # a return may climb higher than every place
        highest_m, item = float(reach.height_m[row]), int(reach.item[row])
        where = f" {reach.where(row)}"
    for stage, tops_m, over in _tops_over_ground_m(a):
        if (top_m := float(tops_m.max(initial=-np.inf))) > highest_m:
            highest_m, where = top_m, over
            item = a.route.stages[int(stage[tops_m.argmax()])].item
    if limit_m is not None and highest_m > limit_m + _ROUNDING_M:
        yield a.finding(
            TOO_HIGH_FOR_SITE,
            f"{quantity.beside(highest_m, limit_m, quantity.height)} above home{where}; {profile.source} "
            f"allows {quantity.height(limit_m)}",
            item=item,
        )


def _tops_over_ground_m(a: Assessment) -> Iterator[tuple[IntArray, FloatArray, str]]:
    """Yield stages, the heights above home of what follows the ground there, and what that is. (n,), (n,)"""
    stage, (_, most_m) = heights_by_posts_m(a)
    yield stage, most_m, " over the ground"
    sample = a.returns.sample
    if sample is not None:
        tops_m = tops_over_terrain_m(a, sample.points, sample.destination)
        yield sample.points.stage, tops_m, " on a return over the ground"


TOO_FAR_FOR_SITE = Rule(
    "M122 too-far-for-site",
    Severity.ERROR,
    summary="The mission, its fence or a rally point is farther away than the site profile allows.",
    why="The mission of another site is the usual slip (MAVProxy #629: mission, rally, fence near).",
    how="Distance from the place of the site, else from home, of home, every stage, rally point, "
    "corner and far edge of areas to stay inside, beyond max_distance_m; and of the path, circles and curves "
    "as they are flown, beyond 1 m more.  A home that the file does not tell may be 500 m from the first "
    "place, as far as a small multicopter is seen.",
    fix="check that this is the mission of this site",
)


@judges(TOO_FAR_FOR_SITE, needs=(PROFILE,))
def _too_far_for_site(a: Assessment, profile: SiteProfile) -> Iterator[Finding]:
    if profile.max_distance_m is None:
        return
    route, mission, limit_m = a.route, a.mission, profile.max_distance_m
    start = (route.frame.latitude_deg, route.frame.longitude_deg)
    origin = _origin_deg(a, profile)
    origin_name = "home" if origin == start else "the site"
    if mission.home is None and profile.latitude_deg is None:
        in_sight = quantity.distance(IN_SIGHT_M)
        origin_name = f"the first place (no home in the file: it may be {in_sight} farther)"
        limit_m -= IN_SIGHT_M
    stages = route.frame.latitude_longitude_deg(
        [stage.east_m for stage in route.stages], [stage.north_m for stage in route.stages]
    )
    places: list[tuple[str, int | None, float, float]] = [("home", None, *start)]
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
    radii_m: list[float] = []
    if mission.fence is not None:
        places += [
            (f"a corner of fence polygon {number}", None, *vertex)
            for number, polygon in enumerate(mission.fence.polygons, start=1)
            if polygon.inclusion
            for vertex in polygon.vertices_deg
        ]
        held_in = [
            (number, circle)
            for number, circle in enumerate(mission.fence.circles, start=1)
            if circle.inclusion
        ]
        places += [
            (f"the far edge of fence circle {number}", None, one.latitude_deg, one.longitude_deg)
            for number, one in held_in
        ]
        radii_m = [one.radius_m for _, one in held_in]
    away_m = distance_m(*origin, [place[2] for place in places], [place[3] for place in places])
    away_m[len(places) - len(radii_m) :] += radii_m
    farthest = int(np.argmax(away_m))
    what, item = places[farthest][:2]
    farthest_m, beyond = float(away_m[farthest]), int((away_m > limit_m).sum())
    path_m = path_distances_m(a, profile)
    point = int(np.argmax(path_m))
    if path_m[point] > max(farthest_m, limit_m) + PATH_SLACK_M:
        item = int(a.path.item[max(point - 1, 0)])
        what, farthest_m, beyond = f"the way of item {item}", float(path_m[point]), beyond + 1
    if not beyond:
        return
    away = quantity.beside(farthest_m, profile.max_distance_m, quantity.distance)
    more = f" ({quantity.count(beyond - 1, 'more place')} too far)" if beyond > 1 else ""
    yield a.finding(
        TOO_FAR_FOR_SITE,
        f"{what} is {away} from {origin_name}; {profile.source} allows "
        f"{quantity.distance(profile.max_distance_m)}{more}",
        item=item,
    )


def _origin_deg(a: Assessment, profile: SiteProfile) -> tuple[float, float]:
    """Return where distances of a site count from: its own place, else home. [°]"""
    if profile.latitude_deg is not None and profile.longitude_deg is not None:
        return profile.latitude_deg, profile.longitude_deg
    return a.route.frame.latitude_deg, a.route.frame.longitude_deg


def path_distances_m(a: Assessment, profile: SiteProfile) -> FloatArray:
    """Return how far each point of the path is from the place of a site, else from home. (n + 1,) [m]"""
    places_deg = a.route.frame.latitude_longitude_deg(a.path.east_m, a.path.north_m)
    return np.asarray(distance_m(*_origin_deg(a, profile), *places_deg))


ITEM_REQUIRED_BY_SITE = Rule(
    "M123 item-required-by-site",
    Severity.ERROR,
    summary="The mission lacks an item that the site profile requires.",
    why="A file keeps the habits of a club or an operation better than heads do.",
    how="required_items of --profile by name against the commands of the mission; of what is flown to, those "
    "the flight reaches.",
    fix="add the item, or correct the profile",
)


@judges(ITEM_REQUIRED_BY_SITE, needs=(PROFILE,))
def _item_required_by_site(a: Assessment, profile: SiteProfile) -> Iterator[Finding]:
    reached = set(a.route.reached)
    held = {
        command_name(item.command)
        for number, item in enumerate(a.mission.items, start=1)
        if number in reached or not is_navigation(item.command)
    }
    missing = [name for name in profile.required_items if name not in held]
    if missing:
        yield a.finding(
            ITEM_REQUIRED_BY_SITE,
            f"no {' and no '.join(missing)} in what is flown; {profile.source} requires it",
        )
