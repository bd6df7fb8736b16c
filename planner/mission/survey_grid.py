"""The parallel lines of a survey, laid over its area as QGroundControl lays them."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]

CLOSEST_SPACING_M = 0.5
"""QGroundControl flies one line where the spacing is less. [m]"""
MOST_CROSSINGS = 5_000_000
"""Lines times edges: bounds memory."""
_SHORTEST_LINE_M = 1e-3
"""A line that only touches a corner is none. [m]"""
_MARGIN_M = 1000.0
"""The first line lies this far outside half the area's greater extent. [m]"""


class EntryCorner(IntEnum):
    """QGroundControl's numbers for where a survey begins, "top" being where its first line does."""

    TOP_LEFT = 0
    TOP_RIGHT = 1
    BOTTOM_LEFT = 2
    BOTTOM_RIGHT = 3


def make_transects_m(
    outline_m: FloatArray, *, angle_deg: float, spacing_m: float, entry: EntryCorner
) -> FloatArray:
    """Return the lines of a survey in the order of flight, all in one direction.

    Lines lie ``spacing_m`` apart, turned clockwise by ``angle_deg`` from north, and are counted
    from the left; each reaches from the first to the last crossing with the outline.  Their
    direction is that in which the outline's edges come along the first line.

    Parameters
    ----------
    outline_m : ndarray
        East and north of each vertex, not closed. [n × 2, m]
    angle_deg : float
        Direction of the lines, clockwise from north. [°]
    spacing_m : float
        Distance between lines; below ``CLOSEST_SPACING_M`` there is one line. [m]
    entry : EntryCorner
        Where to begin.

    Returns
    -------
    ndarray
        East and north of the ends of each line, empty where no line crosses the area.
        [k × 2 × 2, m]

    Raises
    ------
    ValueError
        If there are more crossings than ``MOST_CROSSINGS``.
    """
    low, high = outline_m.min(axis=0), outline_m.max(axis=0)
    centre = (low + high) / 2.0
    angle = np.radians(angle_deg)
    across = np.array([np.cos(angle), -np.sin(angle)])
    along = np.array([np.sin(angle), np.cos(angle)])
    vertices = np.column_stack(((outline_m - centre) @ across, (outline_m - centre) @ along))

    offsets = np.zeros(1)
    if spacing_m >= CLOSEST_SPACING_M:
        first = -(np.max(high - low) / 2.0 + _MARGIN_M)
        nearest, last = vertices[:, 0].min(), vertices[:, 0].max()
        numbers = np.arange(
            np.ceil((nearest - first) / spacing_m), np.floor((last - first) / spacing_m) + 1.0
        )
        if len(numbers) * len(vertices) > MOST_CROSSINGS:
            msg = f"{len(numbers):,} lines across {len(vertices):,} edges"
            raise ValueError(msg)
        offsets = first + numbers * spacing_m
    ends = _line_ends(vertices, offsets)
    if len(ends) < 2:  # one line through the middle
        ends = _line_ends(vertices, np.zeros(1))
    transects: FloatArray = centre + ends[..., :1] * across + ends[..., 1:] * along
    if entry in {EntryCorner.BOTTOM_LEFT, EntryCorner.BOTTOM_RIGHT}:
        transects = transects[:, ::-1]
    if entry in {EntryCorner.TOP_RIGHT, EntryCorner.BOTTOM_RIGHT}:
        transects = transects[::-1]
    return transects


def _line_ends(vertices: FloatArray, offsets: FloatArray) -> FloatArray:
    """Return (across, along) of the two ends of each line that crosses the outline. [k × 2 × 2]."""
    following = np.roll(vertices, -1, axis=0)
    run = (following[:, 0] - vertices[:, 0])[:, None]
    with np.errstate(
        divide="ignore", invalid="ignore", over="ignore"
    ):  # edges along the lines cross none
        share = (offsets - vertices[:, :1]) / run
        crossings = vertices[:, 1:] + share * (following[:, 1:] - vertices[:, 1:])
    is_crossed = (share >= 0.0) & (share <= 1.0) & (run != 0.0)
    lowest = np.where(is_crossed, crossings, np.inf)
    highest = np.where(is_crossed, crossings, -np.inf)
    low, high = lowest.min(axis=0), highest.max(axis=0)
    crossed = high - low > _SHORTEST_LINE_M
    if not crossed.any():
        return np.empty((0, 2, 2))
    # QGroundControl takes the crossing with the earlier edge as a line's beginning, and turns all
    # further lines the way of the first.
    index = int(np.argmax(crossed))
    if np.argmin(lowest[:, index]) < np.argmax(highest[:, index]):
        ends = np.column_stack((low, high))
    else:
        ends = np.column_stack((high, low))
    both = np.stack((np.broadcast_to(offsets[:, None], ends.shape), ends), axis=-1)
    chosen: FloatArray = both[crossed]
    return chosen


def in_alternation(transects_m: FloatArray) -> FloatArray:
    """Return every second line, then the ones between on the way back. [k × 2 × 2, m]."""
    return np.concatenate((transects_m[::2], transects_m[1::2][::-1]))


def to_and_fro(transects_m: FloatArray) -> FloatArray:
    """Return the lines with every second one flown the other way. [k × 2 × 2, m]."""
    flown = transects_m.copy()
    flown[1::2] = flown[1::2, ::-1]
    return flown


def begun_nearest(transects_m: FloatArray, point_m: FloatArray) -> FloatArray:
    """Return the lines in the order and direction that begins nearest to a point.

    QGroundControl looks at three of the four corners only; so does this.

    Parameters
    ----------
    transects_m : ndarray
        Lines, all in one direction. [k × 2 × 2, m]
    point_m : ndarray
        East and north. [2, m]

    Returns
    -------
    ndarray
        [k × 2 × 2, m]
    """
    corners = np.array([transects_m[0, 0], transects_m[0, 1], transects_m[-1, 0]])
    nearest = int(np.argmin(np.hypot(*(corners - point_m).T)))
    if nearest == 2:
        return transects_m[::-1]
    return transects_m[:, ::-1] if nearest == 1 else transects_m
