"""How far a flight has come: the measured place put on the predicted flight, and what is ahead of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.flight.returns.path import Returns

_SAMPLES = 400
"""Points looked at along what is flown for one item. [-]"""
_CLOCK_M_S = 0.1
"""A second by the clock counts as much as this distance: it only tells alike places apart. [m s⁻¹]"""
_BACK_S = 3.0
"""A place may turn out to be so much earlier than the one before. [s]"""


class MeasuredPlace(Value):
    """Where a vehicle is, and which item it flies to."""

    item: int
    """From 1, home not counted."""
    latitude_deg: float
    longitude_deg: float
    height_above_home_m: float


class Progress(Value):
    """A place on a predicted flight, and the energy of what is ahead, by the model."""

    item: int
    time_s: float
    """Of the predicted flight. [s]"""
    off_track_m: float
    """From the nearest place of the predicted flight. [m]"""
    used_wh: float
    """Energy of the predicted flight until here. [Wh]"""
    finish_wh: float
    """Energy from here to the end, back onto the track included. [Wh]"""
    finish_s: float
    return_wh: float
    """Energy to stop, return to where the vehicle itself would, and land. [Wh]"""
    return_s: float
    destination: int
    """0 for home, n for rally point n, below 0 as in `planner.flight.returns.destination`."""


def flight_progress(
    returns: Returns,
    place: MeasuredPlace,
    *,
    before: Progress | None = None,
    elapsed_s: float = 0.0,
) -> Progress:
    """Return where on a predicted flight a measured place is.

    Parameters
    ----------
    returns : Returns
        The predicted flight and its returns.
    place : MeasuredPlace
        As the vehicle tells it.
    before : Progress, optional
        The progress before: among places that are alike, as in a hover, the one that fits the time
        since then is taken, else the earliest; a lap that is over does not come again.
    elapsed_s : float
        Time since then. [s]

    Notes
    -----
    The nearest of points along what is flown for the item.  The way back onto the track costs as
    much a metre as the whole flight does on the mean.
    """
    route, flight = returns.route, returns.flight
    east, north = route.frame.east_north_m([place.latitude_deg], [place.longitude_deg])
    place_m = np.array([float(east[0]), float(north[0]), place.height_above_home_m])
    after_s = 0.0 if before is None else max(before.time_s - _BACK_S, 0.0)
    begin_s, end_s = _window(returns, place.item, after_s)
    time_s = np.linspace(begin_s, end_s, _SAMPLES)
    state = flight.motion.state_at_time(time_s)
    along_m = np.column_stack((state.east_m, state.north_m, state.height_m))
    away_m = np.sqrt(np.square(along_m - place_m).sum(axis=1))
    fits_s = begin_s if before is None else before.time_s + elapsed_s
    at = int(np.argmin(np.square(away_m) + np.square(_CLOCK_M_S * (time_s - fits_s))))
    segment, fraction = returns.at(time_s[at : at + 1])
    points = returns.points(segment, fraction)
    # The vehicle stops and turns back where it is, not where the prediction has it.
    stand_m = points.stop_m - points.place_m + place_m
    chosen = returns.destinations.chosen(place_m[None, :], points.stage)
    return_s, return_wh = returns.fly(stand_m, points.stage, chosen)
    length_m = float(flight.motion.segments.distance_m.sum())
    total_wh, used_wh = float(returns.used_wh[-1]), float(points.used_wh[0])
    off_m = float(away_m[at])
    back_wh = off_m * total_wh / length_m if length_m > 0.0 else 0.0
    return Progress(
        item=place.item,
        time_s=float(time_s[at]),
        off_track_m=off_m,
        used_wh=used_wh,
        finish_wh=total_wh - used_wh + back_wh,
        finish_s=flight.time_s - float(time_s[at]),
        return_wh=float(points.stop_wh[0] + return_wh[0]),
        return_s=float(points.stop_s[0] + return_s[0]),
        destination=int(chosen[0]),
    )


def _window(returns: Returns, item: int, after_s: float) -> tuple[float, float]:
    """Return from when to when an item is flown for the next time [s]."""
    items = np.array([stage.item for stage in returns.route.stages])[returns.segment_stage]
    end_s = returns.start_s + returns.flight.motion.segments.duration_s
    ahead = end_s > after_s
    same = np.flatnonzero(ahead & (items == item))
    if not len(same):  # an item that only sets something: what is flown next
        same = np.flatnonzero(ahead & (items > item))
    if not len(same):
        return min(after_s, float(end_s[-1])), float(end_s[-1])
    first = int(same[0])
    last = first
    while last + 1 < len(items) and items[last + 1] == items[first]:
        last += 1
    return max(float(returns.start_s[first]), after_s), float(end_s[last])
