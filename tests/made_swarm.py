"""Swarms made in code: agents with models of their own, and fleet files that hold a swarm."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from made_fleet import pad, place, sortie, up, vehicles
from made_missions import item, mission, rtl

from planner.fleet.reader import read_fleet
from planner.fleet.swarm.algorithms import Waypoints
from planner.fleet.swarm.dynamics import Dynamics
from planner.fleet.swarm.faults import SwarmFaults
from planner.fleet.swarm.simulation import Agent, AgentPhase, Swarm
from planner.fleet.swarm.zones import distances_m, near_pairs
from planner.mission.files import write_mission
from planner.physics.response import TransferFunction
from planner.service.swarm import SwarmResult, simulate_fleet
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.fleet.fleet import Fault, Fleet
    from planner.fleet.swarm.algorithms import Algorithm
    from planner.fleet.swarm.policies import Policy
    from planner.mission.items import Mission

G4 = TransferFunction(numerator=(0.3588,), denominator=(1.0, 0.935, 0.3588), delay_s=0.6)
"""The article's speed response, scaled to unit gain."""
AT_ONCE = TransferFunction(numerator=(1.0,), denominator=(1.0,))


def agent(
    name: str, east_m: float, north_m: float, *, speed_m_s: float = 5.0, start_s: float = 0.0
) -> Agent:
    """An agent that moves as the article's vehicle does."""
    return Agent(
        name=name,
        dynamics=Dynamics(response=G4),
        speed_m_s=speed_m_s,
        east_m=east_m,
        north_m=north_m,
        start_s=start_s,
    )


def on_circle(count: int, radius_m: float = 200.0) -> tuple[list[Agent], list[np.ndarray]]:
    """Agents on a circle, and the way of each to the other side."""
    angle = 2.0 * np.pi * np.arange(count) / count
    places = radius_m * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    agents = [agent(f"a{row}", *place) for row, place in enumerate(places.tolist())]
    return agents, [-place[None] for place in places]


PACKS = '[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\ncount = 2\n'


def formation(apart_m: float, packs: str | None = None) -> str:
    """Two vehicles so far beside each other that go 100 m north together, and back."""
    pads = pad("a", 0, 0) + pad("b", 0, apart_m)
    task = (
        f'[swarm]\nalgorithm = "formation"\nheight_m = 20\n'
        f"north_deg = {NORTH_DEG!r}\neast_deg = {EAST_DEG!r}\n"
    )
    given = PACKS if packs is None else packs
    return (
        "[separation]\nhorizontal_m = 10\n" + pads + task + given + vehicles("a", "b", model=MODEL)
    )


MODEL = "falkowski-2023-quadrotor"


def _degrees(north_m: float, east_m: float) -> tuple[float, float]:
    """A place so far from the first pad."""
    table = dict(line.split(" = ") for line in pad("x", north_m, east_m).splitlines()[1:])
    return float(table["latitude_deg"]), float(table["longitude_deg"])


NORTH_DEG, EAST_DEG = _degrees(100.0, 0.0)


def fleet_of(*tables: str) -> Fleet:
    """Return the fleet of tables."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "fleet.toml"
        file.write_text("schema = 1\n" + "\n".join(tables), encoding="utf-8")
        return read_fleet(file)


@cache
def simulated(
    *tables: str,
    policy: str | None = None,
    until_s: float | None = None,
    algorithm: Algorithm | None = None,
    **missions: Mission,
) -> SwarmResult:
    """Return the simulation of a fleet of tables; a job for each mission, called like it."""
    with TemporaryDirectory() as folder:
        jobs = ""
        for name, one in missions.items():
            write_mission(one, Path(folder) / f"{name}.plan")
            jobs += f'[job.{name}]\nmission = "{name}.plan"\n'
        file = Path(folder) / "fleet.toml"
        file.write_text("schema = 1\n" + jobs + "\n".join(tables), encoding="utf-8")
        return simulate_fleet(read_fleet(file), algorithm=algorithm, policy=policy, until_s=until_s)


def search(*, agents: int = 2, packs: str | None = None, more: str = "") -> str:
    """Vehicles 30 m apart south of an area of 80 m by 60 m, searched in lanes of 20 m."""
    names = [f"v{number}" for number in range(agents)]
    pads = "".join(pad(name, 0, 30.0 * number) for number, name in enumerate(names))
    (south, west), (north, east) = _degrees(20.0, 0.0), _degrees(80.0, 80.0)
    task = (
        '[swarm]\nalgorithm = "search"\nheight_m = 20\nlane_m = 20\n'
        f"south_deg = {south!r}\nwest_deg = {west!r}\nnorth_deg = {north!r}\neast_deg = {east!r}\n{more}"
    )
    given = packs or f'[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\ncount = {agents}\n'
    return "[separation]\nhorizontal_m = 10\n" + pads + task + given + vehicles(*names, model=MODEL)


FLOWN_BY = ("falkowski-2023-quadrotor", "px4-sih-quad", "arducopter-sitl-quad")


def drawn_missions(
    seed: int, *, most: int = 8, models: tuple[str, ...] = FLOWN_BY
) -> tuple[str, dict[str, Mission]]:
    """Vehicles, each of which flies to places drawn in one area, most at one height; starts are drawn too."""
    draw = np.random.default_rng(seed)
    count = int(draw.integers(2, most + 1))
    size_m = 100.0 * np.sqrt(count)
    pads: list[tuple[float, float]] = []
    while len(pads) < count:
        north_m, east_m = draw.uniform(0.0, size_m, 2).tolist()
        if all(np.hypot(north_m - n, east_m - e) > 25.0 for n, e in pads):
            pads.append((north_m, east_m))
    tables = "[separation]\nhorizontal_m = 10\n"
    missions = {}
    for number, (north_m, east_m) in enumerate(pads):
        height_m = float(draw.choice([30.0, 30.0, 30.0, 45.0]))
        places = []
        for _ in range(int(draw.integers(1, 4))):
            there = draw.uniform(0.0, size_m, 2).tolist()
            places.append(place(there[0], there[1], height_m, float(draw.choice([0.0, 5.0]))))
        home = place(north_m, east_m, 0.0)
        down = item(21, home.latitude_deg, 0.0, longitude_deg=home.longitude_deg)
        end = rtl() if draw.random() < 0.5 else down
        missions[f"m{number}"] = mission(up(height_m), *places, end)
        start_s = round(float(draw.choice([0.0, draw.uniform(0.0, 60.0)])), 2)
        name = f"v{number}"
        tables += pad(name, north_m, east_m) + vehicles(name, model=str(draw.choice(models)))
        tables += sortie(f"s{number}", name, start_s, job=f"m{number}")
    return tables, missions


SEPARATION_M = 10.0


def least_m(swarm: Swarm) -> tuple[float, float]:
    """Run a swarm; return the least distance of places at the ticks, and of zones. [m]"""
    places, zones = np.inf, np.inf
    for step in swarm.run():
        there = np.flatnonzero((step.phase > AgentPhase.WAITS) & (step.phase < AgentPhase.LANDED))
        if len(there) > 1:
            apart = step.place_m[there, None] - step.place_m[None, there]
            distance = np.hypot(apart[..., 0], apart[..., 1])
            places = min(places, float(distance[np.triu_indices(len(there), 1)].min()))
        own = swarm.zones
        first, second = near_pairs(own, 2.0 * SEPARATION_M, swarm.is_there)
        if len(first):
            zones = min(zones, float(distances_m(own.select(first), own.select(second)).min()))
    return places, zones


def with_faults(
    agents: Sequence[Agent],
    ways: Sequence[np.ndarray],
    policy: Policy,
    *faults: Fault,
    seed: int = 0,
    until_s: float = 900.0,
) -> Swarm:
    """Agents that fly along ways of their own until something goes wrong."""
    names = [one.name for one in agents]
    return Swarm(
        agents,
        Waypoints(ways),
        policy,
        separation_m=SEPARATION_M,
        until_s=until_s,
        faults=lambda stack: SwarmFaults(faults, names, stack, height_m=30.0, seed=seed),
    )


def drawn_swarm(seed: int, policy: Policy, *faults: Fault, most: int) -> Swarm:
    """Agents with delays up to 1.5 s and overshoots up to 30 %, or shaped, that go to drawn places."""
    draw = np.random.default_rng(seed)
    count = int(draw.integers(2, most + 1))
    size_m = 60.0 * np.sqrt(count)
    starts, goals = (_apart(draw, count, size_m) for _ in range(2))
    agents = [
        replace(
            agent(f"a{row}", *start, speed_m_s=float(draw.uniform(2.0, 12.0))),
            dynamics=_drawn_dynamics(draw),
            landing_s=5.0,
        )
        for row, start in enumerate(starts)
    ]
    ways = [np.array([goal]) for goal in goals]
    return with_faults(agents, ways, policy, *faults, seed=seed)


def _apart(draw: np.random.Generator, count: int, size_m: float) -> list[tuple[float, float]]:
    places: list[tuple[float, float]] = []
    while len(places) < count:
        east, north = draw.uniform(0.0, size_m, 2).tolist()
        if all(np.hypot(east - e, north - n) > 1.2 * SEPARATION_M for e, n in places):
            places.append((east, north))
    return places


def _drawn_dynamics(draw: np.random.Generator) -> Dynamics:
    delay_s, frequency = draw.uniform(0.0, 1.5), draw.uniform(0.4, 2.0)
    if draw.random() < 0.3:
        lag = TransferFunction(numerator=(1.0,), denominator=(draw.uniform(0.05, 1.0), 1.0))
        return Dynamics(response=lag, acceleration_m_s2=draw.uniform(1.0, 5.0))
    # an overshoot of o belongs to a damping of -ln o / √(π² + ln² o)
    overshoot = np.log(draw.uniform(0.01, 0.3))
    damping = -overshoot / np.hypot(np.pi, overshoot)
    return Dynamics(
        response=TransferFunction(
            numerator=(frequency**2,),
            denominator=(1.0, 2.0 * damping * frequency, frequency**2),
            delay_s=delay_s,
        )
    )
