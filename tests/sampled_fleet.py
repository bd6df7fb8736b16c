"""Drawn fleets, and how near their sorties come by samples: an oracle of the search in time."""

from __future__ import annotations

import math
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from made_fleet import checked, pad, place, sortie, up, vehicles
from made_missions import mission, rtl

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.service.fleet import FleetResult, FlownSortie

RATE_HZ = 20.0
HORIZONTAL_M, VERTICAL_M, LOW_M = 8.0, 5.0, 2.5
MODELS = ("arducopter-sitl-quad", "falkowski-2023-quadrotor")


def drawn_fleet(seed: int) -> FleetResult:
    """Two to four sorties of drawn places, heights and starts, and the check of all of them."""
    draw = np.random.default_rng(seed)
    count = int(draw.integers(2, 5))
    missions, tables = {}, []
    for number in range(count):
        north, east = draw.uniform(-60.0, 60.0, 2).tolist()
        height = float(draw.uniform(10.0, 25.0))
        corners = draw.uniform(-120.0, 120.0, (3, 2)).tolist()
        places = [place(corner[0], corner[1], height) for corner in corners]
        missions[f"job{number}"] = mission(up(height), *places, rtl())
        name = f"v{number}"
        tables += [
            pad(name, north, east),
            vehicles(name, more="position_error_m = 0", model=MODELS[number % 2]),
            sortie(f"s{number}", name, float(draw.integers(0, 60)), job=f"job{number}"),
        ]
    separation = (
        f"[separation]\nhorizontal_m = {HORIZONTAL_M}\nabove_m = {VERTICAL_M}\nheight_error_m = 0\n"
        f"min_nav_alt_m = {LOW_M}\nground_m = 0\n"
    )
    return checked(separation, *tables, **missions)


def misjudged(result: FleetResult) -> list[tuple[str, str, float]]:
    """Return pairs of sorties judged otherwise than by samples, with how much too near they come. [m]

    Both count while one of them flies, higher than ``LOW_M`` over where it takes off, either as early or late
    as the spread of its model has it.  What is not reported
    is never too near by a centimetre; what is, is so in a sample, or by half a metre, flown between two, not.
    """
    reported = {
        frozenset(one.sorties) for one in result.findings if one.finding.code in {"S101", "S114"}
    }
    wrong = []
    for first, second in combinations(result.sorties, 2):
        lack_m = _lack_m(first, second, result)
        is_reported = frozenset((first.name, second.name)) in reported
        if (lack_m < -0.5) if is_reported else (lack_m > 0.01):
            wrong.append((first.name, second.name, lack_m))
    return wrong


def _lack_m(first: FlownSortie, second: FlownSortie, result: FleetResult) -> float:
    """Return how much too near two come, either of them as early or late as its model has it. [m]"""
    most = math.ceil(RATE_HZ * sum(_fraction(one) * one.time_s for one in (first, second)))
    count = math.ceil(RATE_HZ * max(first.end_s, second.end_s))
    time_s = np.arange(-most, count + most) / RATE_HZ
    one, two = (_places_m(flown, result, time_s) for flown in (first, second))
    inner = slice(most, most + count)
    least_m = -np.inf
    for shift in range(-most, most + 1):
        apart = one[inner] - two[most + shift : most + shift + count]
        beside = HORIZONTAL_M - np.hypot(apart[:, 0], apart[:, 1])
        above = VERTICAL_M - np.abs(apart[:, 2])
        heights_m = np.maximum(one[inner, 2], two[most + shift : most + shift + count, 2])
        late_s = sum(
            _fraction(flown) * np.clip(at_s - flown.start_s, 0.0, flown.time_s)
            for flown, at_s in ((first, time_s[inner]), (second, time_s[inner] + shift / RATE_HZ))
        )
        counts = (heights_m > LOW_M + 0.1) & (abs(shift) / RATE_HZ <= late_s)
        lack_m = np.where(counts, np.minimum(beside, above), -np.inf)
        least_m = max(least_m, float(lack_m.max()))
    return least_m


def _fraction(flown: FlownSortie) -> float:
    """Return how much of its time a flight may be sooner or later, by the spread of its model. [-]"""
    assert flown.assessment is not None
    totals = flown.assessment.totals
    if totals.time_s_p10 is None or totals.time_s_p90 is None:
        return 0.0
    return max(totals.time_s - totals.time_s_p10, totals.time_s_p90 - totals.time_s) / totals.time_s


def _places_m(flown: FlownSortie, result: FleetResult, time_s: FloatArray) -> FloatArray:
    """Return east, north and height above the pads at times of the operation. (n, 3) [m]"""
    assessment = flown.assessment
    common = result.sorties[0].assessment
    assert assessment is not None
    assert common is not None
    motion = assessment.flight.motion
    own_s = np.clip(time_s - flown.start_s, 0.0, flown.time_s)
    state = motion.state_at_time(own_s)
    latitude, longitude = assessment.route.frame.latitude_longitude_deg(state.east_m, state.north_m)
    east, north = common.route.frame.east_north_m(latitude, longitude)
    return np.stack((east, north, state.height_m), axis=1)
