"""Pieces: the parts of moves collected kind by kind, and put into flown order as one motion."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import PolynomialLaw
from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.laws import BrakeLaw, SettlingLaw
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray, MotionLaw

PAUSE, RAMP, CRUISE, BRAKE, HOLD, SLOTS = range(6)
"""Segments a move may have, in flown order."""
ORDERS = 24
"""Pieces a move may have at most."""

_CUBIC, _BRAKE, _SETTLING = range(3)
_SHORTEST_S = 1e-9
"""Shorter pieces are left out. [s]"""


@frozen(eq=False)
class Places(Columns):
    """Where pieces belong, as columns of length k."""

    move: IntArray
    order: IntArray
    """Place among the pieces of its move."""
    slot: IntArray
    """Segment of its move."""
    duration_s: FloatArray
    """In the time of PX4's trajectory. [s]"""
    pace: FloatArray
    """Seconds of that per second of flight. [-]"""


@frozen(eq=False)
class Lines(Columns):
    """Straight parts of moves, cubic in time, as columns of length k."""

    place_m: FloatArray
    """Where each begins. (k, 3) [m]"""
    direction: FloatArray
    """Unit vectors. (k, 3)"""
    speed_m_s: FloatArray
    acceleration_m_s2: FloatArray
    jerk_m_s3: FloatArray


@frozen(eq=False)
class _Collected:
    """Pieces of one kind, in the order they were added."""

    law: int
    places: Places
    flight_s: FloatArray
    distance_m: FloatArray
    climb_m: FloatArray
    is_grounded: bool


@dataclass(slots=True)
class Pieces:
    """Pieces while they are collected; those of no duration are left out."""

    parts: list[_Collected] = field(default_factory=list)
    coefficients: list[FloatArray] = field(default_factory=list)
    brakes: list[BrakeLaw] = field(default_factory=list)
    settlings: list[SettlingLaw] = field(default_factory=list)

    def add_lines(self, places: Places, lines: Lines, *, is_grounded: bool = False) -> None:
        """Add straight pieces."""
        kept = np.flatnonzero(places.duration_s > _SHORTEST_S)
        if not len(kept):
            return
        places, lines = places.select(kept), lines.select(kept)
        t, pace = places.duration_s, places.pace
        v, a, j = lines.speed_m_s, lines.acceleration_m_s2, lines.jerk_m_s3
        way = t * (v + t * (0.5 * a + j * t / 6.0))
        coefficients = np.empty((len(kept), 3, 4))
        coefficients[..., 0] = lines.place_m
        for power, value in enumerate((v * pace, 0.5 * a * pace**2, j * pace**3 / 6.0), start=1):
            coefficients[..., power] = lines.direction * value[:, None]
        self.coefficients.append(coefficients)
        level = np.hypot(lines.direction[:, 0], lines.direction[:, 1])
        climb = way * lines.direction[:, 2]
        self._add(_CUBIC, places, np.abs(way) * level, climb, is_grounded=is_grounded)

    def add_cubics(self, places: Places, coefficients: FloatArray) -> None:
        """Add curved pieces by their rising powers of time. (k, 3, 4)"""
        kept = np.flatnonzero(places.duration_s > _SHORTEST_S)
        if not len(kept):
            return
        places, c = places.select(kept), coefficients[kept]
        t = places.duration_s[:, None]
        moved = t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3]))
        # Control points of the cubic's Bézier form: its length lies between chord and polygon.
        first = c[..., 1] * t / 3.0
        last = (c[..., 1] + t * (2.0 * c[..., 2] + 3.0 * t * c[..., 3])) * t / 3.0
        polygon = _level(first) + _level(last) + _level(moved - first - last)
        self.coefficients.append(c * places.pace[:, None, None] ** np.arange(4.0))
        self._add(_CUBIC, places, 0.5 * (polygon + _level(moved)), moved[:, 2])

    def add_brakes(self, places: Places, law: BrakeLaw, way_m: FloatArray) -> None:
        """Add pieces of braking over ways, by rows of a law. (k,)"""
        kept = np.flatnonzero(places.duration_s > _SHORTEST_S)
        if not len(kept):
            return
        places, way = places.select(kept), way_m[kept]
        rows = {f.name: getattr(law, f.name)[kept] for f in fields(law)}
        rows["rate"] = rows["rate"] * places.pace
        self.brakes.append(BrakeLaw(**rows))
        direction = rows["direction"]
        self._add(_BRAKE, places, way * _level(direction), way * direction[:, 2])

    def add_settlings(self, places: Places, law: SettlingLaw) -> None:
        """Add pieces that settle exponentially, by rows of a law. (k,)"""
        kept = np.flatnonzero(places.duration_s > _SHORTEST_S)
        if not len(kept):
            return
        places = places.select(kept)
        pace = places.pace[:, None]
        paced = SettlingLaw(
            coefficients=law.coefficients[kept] * pace[..., None] ** np.arange(4.0),
            amplitude_m=law.amplitude_m[kept],
            rate_per_s=law.rate_per_s[kept] * pace[..., None],
        )
        self.settlings.append(paced)
        rows = np.arange(len(kept))
        before = paced.state_at(rows, np.zeros(len(kept)))
        after = paced.state_at(rows, places.duration_s / places.pace)
        self._add(
            _SETTLING,
            places,
            np.hypot(after.east_m - before.east_m, after.north_m - before.north_m),
            after.height_m - before.height_m,
        )

    def _add(
        self,
        law: int,
        places: Places,
        distance_m: FloatArray,
        climb_m: FloatArray,
        *,
        is_grounded: bool = False,
    ) -> None:
        self.parts.append(
            _Collected(
                law=law,
                places=places,
                flight_s=places.duration_s / places.pace,
                distance_m=distance_m,
                climb_m=climb_m,
                is_grounded=is_grounded,
            )
        )

    def laws(self) -> tuple[MotionLaw, ...]:
        """Return the laws of all pieces."""
        cubics = np.concatenate(self.coefficients) if self.coefficients else np.zeros((0, 3, 4))
        return (
            PolynomialLaw(coefficients=cubics),
            BrakeLaw.joined(self.brakes),
            SettlingLaw.joined(self.settlings),
        )


def _level(vectors: FloatArray) -> FloatArray:
    """Return the horizontal lengths of vectors."""
    return np.hypot(vectors[..., 0], vectors[..., 1])


@frozen(eq=False)
class Ordered:
    """Pieces in flown order, and the segments they make."""

    segment: IntArray
    """Segment each piece belongs to. (p,)"""
    law: IntArray
    row: IntArray
    duration_s: FloatArray
    is_grounded: BoolArray
    segment_move: IntArray
    """Move each segment belongs to. (n,)"""
    segment_slot: IntArray
    segment_s: FloatArray
    segment_distance_m: FloatArray
    segment_climb_m: FloatArray


def in_flown_order(pieces: Pieces) -> Ordered:
    """Return collected pieces in flown order, with their segments."""
    parts = pieces.parts
    counts = [len(part.flight_s) for part in parts]
    law = np.repeat([part.law for part in parts], counts)
    row = np.empty(len(law), dtype=np.intp)
    for kind in (_CUBIC, _BRAKE, _SETTLING):
        of_kind = law == kind
        row[of_kind] = np.arange(of_kind.sum())
    move = np.concatenate([part.places.move for part in parts])
    order = np.concatenate([part.places.order for part in parts])
    slot = np.concatenate([part.places.slot for part in parts])
    flown = np.argsort(move * ORDERS + order, kind="stable")
    key = (move * SLOTS + slot)[flown]
    begins = np.concatenate(([True], key[1:] != key[:-1]))
    segment = np.cumsum(begins) - 1
    count = int(segment[-1]) + 1
    duration = np.concatenate([part.flight_s for part in parts])[flown]
    distance = np.concatenate([part.distance_m for part in parts])[flown]
    climb = np.concatenate([part.climb_m for part in parts])[flown]
    return Ordered(
        segment=segment,
        law=law[flown],
        row=row[flown],
        duration_s=duration,
        is_grounded=np.repeat([part.is_grounded for part in parts], counts)[flown],
        segment_move=key[begins] // SLOTS,
        segment_slot=key[begins] % SLOTS,
        segment_s=np.bincount(segment, duration, minlength=count).astype(np.float64),
        segment_distance_m=np.bincount(segment, distance, minlength=count).astype(np.float64),
        segment_climb_m=np.bincount(segment, climb, minlength=count).astype(np.float64),
    )
