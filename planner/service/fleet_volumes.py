"""The sorties of a fleet as operational intents of ASTM F3548-21: volumes for others to keep clear of."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.fleet.fleet import Separation
from planner.fleet.volumes import flight_volumes, return_volumes
from planner.service.fleet_separation import members, return_flights
from planner.service.separation import known_home_amsl_m, uncounted_curve, uncounted_wait
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.fleet.fleet import Fleet
    from planner.fleet.volumes import Volume
    from planner.geo.geodesy import LocalFrame
    from planner.service.fleet import FleetResult, FlownSortie

GEOID_LOWEST_M, GEOID_HIGHEST_M = -110.0, 90.0
"""Sea level is 107 m below the ellipsoid south of India and 86 m above it off New Guinea (EGM2008). [m]"""
MOST_VERTICES = 10_000
"""Of all volumes of an intent: OiMaxVertices of ASTM F3548-21."""
_LONGEST_S = 60.0
"""A volume of a minute: of a survey at 8 m/s two lanes and the turn, and an hour has 60 of them. [s]"""
_RETURNS = 24
"""Intervals of a flight whose returns have a volume each."""
_LEAST_RETURNS = 2
_DATUM_ERROR_M = 1.0
"""By how much geoids of different years lie apart. [m]"""
_ROUNDING = dt.timedelta(milliseconds=1)
_ASSUMED = Separation(horizontal_m=1.0)
"""Stands in for the errors of a single vehicle, whose file has none."""
_DIGITS = 7


class Volume4D(Value):
    """An outline, altitudes and times."""

    vertices_deg: tuple[tuple[float, float], ...]
    """Latitude and longitude of each corner, the first not repeated. [°]"""
    lower_m: float
    """Above the WGS 84 ellipsoid. [m]"""
    upper_m: float
    start: dt.datetime
    """In UTC."""
    end: dt.datetime


class Intent(Value):
    """One sortie as an operational intent."""

    flown: FlownSortie
    volumes: tuple[Volume4D, ...]
    """While it flies as planned, in the order of time."""
    return_volumes: tuple[Volume4D, ...]
    """While it returns, by when that is begun."""


def fleet_volumes(
    result: FleetResult, *, start: dt.datetime | None = None, geoid_height_m: float | None = None
) -> tuple[Intent, ...]:
    """Return volumes that contain every sortie of a fleet at every time, and every return.

    Each is grown by the errors of position, height and time of the fleet's separation, by the spread of
    the model's times, and by stops where vehicles may be told to stop anywhere.

    Parameters
    ----------
    result : FleetResult
        As `planner.check_fleet` returns it.
    start : datetime, optional
        When the operation begins, with its offset; by default ``start`` of its ``[operation]``.
    geoid_height_m : float, optional
        Height of the geoid, which altitudes above sea level count from, above the WGS 84 ellipsoid there;
        by default ``geoid_height_m`` of its ``[operation]``. [m]

    Raises
    ------
    UsageError
        If either is not known, or a sortie has no volumes: it does not fly, never lands, or its home has
        no known altitude.
    """
    fleet = result.fleet
    begin = operation_start(fleet, start)
    geoid_m = operation_geoid_m(fleet, geoid_height_m)
    if begin is None:
        msg = "volumes have dates: give --start-time, such as 2026-05-12T08:00:00Z, or start in [operation]"
        raise UsageError(msg)
    if geoid_m is None:
        msg = (
            "volumes have heights above the WGS 84 ellipsoid: give --geoid-height, the height of the geoid "
            "(sea level) above it there, or geoid_height_m in [operation]"
        )
        raise UsageError(msg)
    return tuple(_intent(fleet, one, begin, geoid_m) for one in result.sorties)


def operation_start(fleet: Fleet, given: dt.datetime | None) -> dt.datetime | None:
    """Return when an operation begins, in UTC; ``None``: nobody says.

    Raises UsageError if it has no offset.
    """
    start = fleet.operation.start if given is None else given
    if start is None:
        return None
    if start.tzinfo is None:
        msg = f"start must have its offset, such as 2026-05-12T08:00:00Z: got {start.isoformat()}"
        raise UsageError(msg)
    return start.astimezone(dt.UTC)


def operation_geoid_m(fleet: Fleet, given: float | None) -> float | None:
    """Return the height of the geoid above the ellipsoid; ``None``: nobody says. [m]

    Raises UsageError if there is no such place.
    """
    geoid_m = fleet.operation.geoid_height_m if given is None else given
    if geoid_m is not None and not GEOID_LOWEST_M <= geoid_m <= GEOID_HIGHEST_M:
        msg = (
            f"geoid_height_m must be from {GEOID_LOWEST_M:g} to {GEOID_HIGHEST_M:g} m: "
            f"got {geoid_m:g}"
        )
        raise UsageError(msg)
    return geoid_m


def _intent(fleet: Fleet, one: FlownSortie, begin: dt.datetime, geoid_m: float) -> Intent:
    assessment = one.assessment
    if assessment is None or one.time_s <= 0.0:
        msg = f"{one.name} has no volumes: nothing of it is flown"
        raise UsageError(msg)
    if wait := uncounted_wait(one.result) or uncounted_curve(one.result):
        msg = f"{one.name} has no volumes: it {wait}"
        raise UsageError(msg)
    if not one.lands:
        msg = f"{one.name} has no volumes: it ends in the air; end its mission with a landing or a return"
        raise UsageError(msg)
    home_amsl_m = known_home_amsl_m(assessment)
    if home_amsl_m is None:
        msg = f"{one.name} has no volumes: the altitude of its home is not known; give its pad an amsl_m"
        raise UsageError(msg)
    separation = fleet.separation or _ASSUMED
    [member] = members(fleet, separation, [one])
    frame = assessment.route.frame
    flown = [one for one in (member.trajectory, member.own) if one is not None]
    returns = [return_flights(way, each, frame) for way, each in zip(one.ways, flown, strict=True)]
    place = _Place(
        frame=frame,
        above_m=home_amsl_m + geoid_m,
        error_m=separation.height_error_m + _DATUM_ERROR_M,
        begin=begin + dt.timedelta(seconds=one.start_s),
        error_s=separation.start_error_s,
    )
    longest_s, count = _LONGEST_S, _RETURNS
    while True:
        found = Intent(
            flown=one,
            volumes=place.volumes(
                volume
                for each in flown
                for volume in flight_volumes(each.reach, longest_s=longest_s)
            ),
            return_volumes=place.volumes(
                volume for each in returns for volume in return_volumes(each, count=count)
            ),
        )
        both = (*found.volumes, *found.return_volumes)
        is_fewest = longest_s > one.time_s and count <= _LEAST_RETURNS
        if is_fewest or sum(len(each.vertices_deg) for each in both) <= MOST_VERTICES:
            return found
        longest_s, count = 2.0 * longest_s, max(count // 2, _LEAST_RETURNS)


class _Place(Value):
    """Where and when the volumes of a flight are, and by how much they are larger than it."""

    frame: LocalFrame
    above_m: float
    """Height of its home above the ellipsoid. [m]"""
    error_m: float
    begin: dt.datetime
    error_s: float

    def volumes(self, several: Iterable[Volume]) -> tuple[Volume4D, ...]:
        """Return volumes as others see them."""
        return tuple(map(self._volume, several))

    def _volume(self, one: Volume) -> Volume4D:
        latitude_deg, longitude_deg = self.frame.latitude_longitude_deg(*one.outline_m.T)
        corners = zip(
            latitude_deg.round(_DIGITS).tolist(), longitude_deg.round(_DIGITS).tolist(), strict=True
        )
        try:
            start = self.begin + dt.timedelta(seconds=one.start_s - self.error_s) - _ROUNDING
            end = self.begin + dt.timedelta(seconds=one.end_s + self.error_s) + _ROUNDING
        except OverflowError as error:
            msg = (
                f"no calendar has the volumes of an operation that begins {self.begin.isoformat()}"
            )
            raise UsageError(msg) from error
        return Volume4D(
            vertices_deg=tuple(dict.fromkeys(corners)),
            lower_m=self.above_m + one.low_m - self.error_m,
            upper_m=self.above_m + one.high_m + self.error_m,
            start=start,
            end=end,
        )
