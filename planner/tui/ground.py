"""The flight from above, in metres east and north of home: what a map draws."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.findings import FlightStretch
    from planner.geo.fence import Fence
    from planner.geo.geodesy import LocalFrame
    from planner.physics.wind import Wind
    from planner.rules.assessment import Assessment


_SAMPLES = 3000
_MOST_ENDS = 50_000
_CORNERS_OF_CIRCLE = 180
_ARROWS = "↓↙←↖↑↗→↘"
"""Where a wind from north, north-east, … blows to."""


class Outline(Value, eq=False):
    """A closed line: a part of the fence."""

    is_inclusion: bool
    east_m: FloatArray
    north_m: FloatArray


class Mark(Value):
    """A place with a letter."""

    letter: str
    name: str
    east_m: float
    north_m: float


class Ground(Value, eq=False):
    """What lies under a flight."""

    time_s: FloatArray
    east_m: FloatArray
    north_m: FloatArray
    """Places of the vehicle at those times. (n,) [m]"""
    outlines: tuple[Outline, ...]
    marks: tuple[Mark, ...]
    frame: LocalFrame
    wind: Wind

    def place_m(self, time_s: float) -> tuple[float, float]:
        """Return where the vehicle is at a time, east and north. [m]"""
        return (
            float(np.interp(time_s, self.time_s, self.east_m)),
            float(np.interp(time_s, self.time_s, self.north_m)),
        )

    def extent_m(self) -> tuple[float, float, float, float]:
        """Return west, south, east and north ends of all there is to draw. [m]"""
        east = np.concatenate(
            [self.east_m, *(o.east_m for o in self.outlines), [m.east_m for m in self.marks]]
        )
        north = np.concatenate(
            [self.north_m, *(o.north_m for o in self.outlines), [m.north_m for m in self.marks]]
        )
        return float(east.min()), float(north.min()), float(east.max()), float(north.max())

    def stretch_m(self, stretch: FlightStretch) -> list[tuple[FloatArray, FloatArray]]:
        """Return the parts of a finding's stretch, east and north of each. (n,) [m]"""
        return [
            self.frame.east_north_m(*zip(*line_deg, strict=True)) for line_deg in stretch.lines_deg
        ]

    def at_m(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return where a place is, east and north. [m]"""
        east_m, north_m = self.frame.east_north_m([latitude_deg], [longitude_deg])
        return float(east_m[0]), float(north_m[0])

    def time_near(self, east_m: float, north_m: float) -> float:
        """Return when the vehicle is nearest to a place. [s]"""
        nearest = np.argmin(np.hypot(self.east_m - east_m, self.north_m - north_m))
        return float(self.time_s[nearest])


def ground(assessment: Assessment | None) -> Ground | None:
    """Return the ground of a flight; ``None`` where nothing is flown."""
    if assessment is None or not assessment.flight.time_s > 0.0:
        return None
    flight, frame = assessment.flight, assessment.route.frame
    time_s = np.linspace(0.0, flight.time_s, _SAMPLES)
    end_s = flight.motion.segments.end_s
    if len(end_s) <= _MOST_ENDS:
        time_s = np.union1d(time_s, np.clip(end_s, 0.0, flight.time_s))
    state = flight.motion.state_at_time(time_s)
    marks = [Mark(letter="H", name="home", east_m=0.0, north_m=0.0)]
    if assessment.mission.rally:
        east_m, north_m = frame.east_north_m(
            [point.latitude_deg for point in assessment.mission.rally],
            [point.longitude_deg for point in assessment.mission.rally],
        )
        marks += [
            Mark(letter="R", name=f"rally point {number}", east_m=east, north_m=north)
            for number, (east, north) in enumerate(
                zip(east_m.tolist(), north_m.tolist(), strict=True), start=1
            )
        ]
    return Ground(
        time_s=time_s,
        east_m=np.asarray(state.east_m, dtype=np.float64),
        north_m=np.asarray(state.north_m, dtype=np.float64),
        outlines=_outlines(assessment.mission.fence, frame),
        marks=tuple(marks),
        frame=frame,
        wind=assessment.setup.wind,
    )


def _outlines(fence: Fence | None, frame: LocalFrame) -> tuple[Outline, ...]:
    if not fence:
        return ()
    found = []
    for polygon in fence.polygons:
        if not polygon.vertices_deg:
            continue
        closed = (*polygon.vertices_deg, polygon.vertices_deg[0])
        east_m, north_m = frame.east_north_m(*zip(*closed, strict=True))
        found.append(Outline(is_inclusion=polygon.inclusion, east_m=east_m, north_m=north_m))
    turn = np.linspace(0.0, 2.0 * math.pi, _CORNERS_OF_CIRCLE + 1)
    for circle in fence.circles:
        centre_e, centre_n = frame.east_north_m(circle.latitude_deg, circle.longitude_deg)
        found.append(
            Outline(
                is_inclusion=circle.inclusion,
                east_m=centre_e + circle.radius_m * np.sin(turn),
                north_m=centre_n + circle.radius_m * np.cos(turn),
            )
        )
    return tuple(found)


def wind_arrow(wind: Wind) -> str:
    """Return an arrow that points where the wind blows to, north being up."""
    return _ARROWS[round(wind.from_deg / 45.0) % 8]


class Scale(Value):
    """How ground becomes dots of a canvas: north up, as many metres across as down."""

    west_m: float
    north_m: float
    m_per_dot: float

    def dots(self, east_m: FloatArray, north_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return places as dots of the canvas, y downwards."""
        return (east_m - self.west_m) / self.m_per_dot, (self.north_m - north_m) / self.m_per_dot

    def about(self, place_m: tuple[float, float], factor: float, width: int, height: int) -> Scale:
        """Return the scale that shows a place in the middle of so many dots, larger by a factor."""
        m_per_dot = self.m_per_dot / factor
        return Scale(
            west_m=place_m[0] - m_per_dot * (width - 1) / 2.0,
            north_m=place_m[1] + m_per_dot * (height - 1) / 2.0,
            m_per_dot=m_per_dot,
        )


def scale_to_fit(extent_m: tuple[float, float, float, float], width: int, height: int) -> Scale:
    """Return the scale that shows an extent in the middle of so many dots, with a border."""
    west_m, south_m, east_m, north_m = extent_m
    across, down = max(width - 5, 1), max(height - 5, 1)
    m_per_dot = max((east_m - west_m) / across, (north_m - south_m) / down, 0.01)
    middle_m = (west_m + east_m) / 2.0, (north_m + south_m) / 2.0
    return Scale(west_m=0.0, north_m=0.0, m_per_dot=m_per_dot).about(middle_m, 1.0, width, height)


def scale_bar_m(m_per_dot: float, dots: int) -> float:
    """Return the longest of 1, 2, 5, 10, … metres that takes at most so many dots. [m]"""
    most_m = m_per_dot * dots
    power = 10.0 ** math.floor(math.log10(most_m))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most_m * (1 + 1e-9))
