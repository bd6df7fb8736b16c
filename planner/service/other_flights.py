"""The other ways in which a mission may be flown: a go has to hold for each of them."""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from planner import quantity
from planner.autopilot import Autopilot, Target
from planner.flight.reach import GUST_SDS
from planner.quantity import mean_of, sd_of
from planner.service.preparation import prepare
from planner.setting import Number
from planner.setup import settings
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.rules.assessment import Assessment
    from planner.service.preparation import Preparation
    from planner.setup import Setup

    OtherFlight: TypeAlias = tuple[Preparation, str]
    """What another flight is predicted from, and when it is flown, in words."""


def other_flights(
    prepared: Preparation, assessment: Assessment, *, at_own_speeds: bool
) -> Iterator[OtherFlight]:
    """Yield the other flights of a mission by the same vehicle on the same day.

    With speeds that may be carried out, or not, the other way; with terrain that ArduPilot may know; over the
    ground of overlapping terrain files; at the speeds of the file, where it was predicted at another.
    """
    for other in prepared.route.others:
        yield replace(prepared, route=other.route), other.note
    yield from _over_known_terrain(prepared)
    yield from _over_other_ground(prepared, assessment)
    if at_own_speeds:
        yield from _at_own_speeds(prepared)


def _over_known_terrain(prepared: Preparation) -> Iterator[OtherFlight]:
    """Yield the flight where ArduPilot knows the terrain, by which it flies to a landing.

    Whether it does no parameter says: TERRAIN_ENABLE allows it.
    """
    terrain = prepared.setup.terrain
    if terrain is None or not getattr(prepared.parameters, "terrain_enable", 0):
        return
    from planner.flight.motion.followed_ground import following_to_land

    route = following_to_land(prepared.route, terrain)
    if route is not None:
        note = "with terrain data, by which ArduPilot flies to the landing"
        yield replace(prepared, route=route), note


def _over_other_ground(prepared: Preparation, assessment: Assessment) -> Iterator[OtherFlight]:
    """Yield the flight by the ground of each of overlapping terrain files that did not count."""
    terrain = prepared.setup.terrain
    if terrain is None or len(terrain.tiles) == 1:
        return
    from planner.rules.overlapping_terrain import others_around

    for other in others_around(assessment, terrain):
        setup = replace(prepared.setup, terrain=other.grid)
        yield prepare(prepared.mission, setup), f"by the ground of {other.source}"


def _at_own_speeds(prepared: Preparation) -> Iterator[OtherFlight]:
    """Yield the flight at the speeds a mission commands, which the vehicle flies."""
    if prepared.setup.speed_m_s is None:
        return
    from planner.mission.convert import SPEED_REPLACED

    if any(one.code == SPEED_REPLACED.code for one in prepared.findings):
        setup = replace(prepared.setup, speed_m_s=None)
        yield prepare(prepared.mission, setup), "at the speeds of the file, which are flown"


def flown_by(autopilot: Autopilot, setup: Setup) -> Setup:
    """Return a setup with an autopilot named: whose rules count for reference steps, else who flies."""
    if setup.flown_by is Autopilot.STEP:
        return replace(setup, target=Target(autopilot=autopilot))
    return replace(setup, autopilot=autopilot)


_BACKWARD_DEG = 180.0


def off_their_means(setup: Setup) -> Iterator[tuple[Setup, str, float]]:
    """Yield a setup with each uncertain condition off its mean, that in words, and by how many deviations.

    Then with all of them as far as makes two deviations together: limits may be near that no condition
    reaches alone.
    """
    worse = _worse_ends(setup)
    for ends in worse:
        for end in ends:
            other, words = end(setup, GUST_SDS)
            yield other, f"at {words}, two standard deviations from the mean", GUST_SDS
    if len(worse) > 1:
        sds = GUST_SDS / math.sqrt(len(worse))
        for ends_of_all in product(*worse):
            other, said = setup, []
            for end in ends_of_all:
                other, words = end(other, sds)
                said.append(words)
            each = f"each {quantity.decimals(sds, 1)} standard deviations from the mean"
            yield other, f"at {' and '.join(said)}, {each}", GUST_SDS
    wind = setup.wind
    if wind.from_sd_deg and wind.speed_m_s:
        for sds, many in ((1.0, "one standard deviation"), (GUST_SDS, "two standard deviations")):
            for side in (sds, -sds):
                if sds * wind.from_sd_deg <= _BACKWARD_DEG:  # farther off it is another's
                    from_deg = (wind.from_deg + side * wind.from_sd_deg) % 360.0
                    turned = replace(wind, from_deg=from_deg, from_sd_deg=0.0)
                    note = f"at wind from {from_deg:.0f}°, {many} from the mean"
                    yield replace(setup, wind=turned), note, sds


_End: TypeAlias = "Callable[[Setup, float], tuple[Setup, str]]"
"""Moves an uncertain condition so many deviations to one side; with what it is then, in words."""


def _worse_ends(setup: Setup) -> list[tuple[_End, ...]]:
    """Return the sides of each uncertain condition that may be the worse one."""

    def heavier(one: Setup, sds: float) -> tuple[Setup, str]:
        kg = _in_range("payload_kg", mean_of(setup.payload_kg) + sds * sd_of(setup.payload_kg))
        return replace(one, payload_kg=kg), f"{quantity.mass(kg)} of payload"

    def emptier(one: Setup, sds: float) -> tuple[Setup, str]:
        charge = max(mean_of(setup.charge) - sds * sd_of(setup.charge), 0.0)
        return replace(one, charge=charge), f"{quantity.percent(charge)} of the charge"

    def warmer(one: Setup, sds: float) -> tuple[Setup, str]:
        mean_c, sd_c = mean_of(setup.temperature_c or 0.0), sd_of(setup.temperature_c)
        air_c = _in_range("temperature_c", mean_c + sds * sd_c)
        return replace(one, temperature_c=air_c), quantity.temperature(air_c)

    def stronger(one: Setup, sds: float) -> tuple[Setup, str]:
        wind = setup.wind
        speed_m_s = max(wind.speed_m_s + sds * wind.speed_sd_m_s, 0.0)
        other = replace(wind, speed_m_s=speed_m_s, speed_sd_m_s=0.0)
        return replace(one, wind=other), f"{quantity.speed(speed_m_s)} of wind"

    def back(end: _End) -> _End:
        return lambda one, sds: end(one, -sds)

    return [
        ends
        for sd, ends in (
            (sd_of(setup.payload_kg), (heavier,)),
            (sd_of(setup.charge), (emptier,)),
            # thin air, or a cold battery; a wind against it, or from behind that is missed
            (sd_of(setup.temperature_c), (warmer, back(warmer))),
            (setup.wind.speed_sd_m_s, (stronger, back(stronger))),
        )
        if sd
    ]


def _in_range(key: str, number: float) -> float:
    """Return a number of a setting, or the nearest that may be given: no air is warmer than that."""
    kind = settings()[key].kind
    assert isinstance(kind, Number)
    return min(max(number, kind.low), kind.high)
