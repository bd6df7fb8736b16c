"""Swarms made in code: agents with models of their own, and fleet files that hold a swarm."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from made_fleet import pad, vehicles

from planner.fleet.reader import read_fleet
from planner.fleet.swarm.dynamics import Dynamics
from planner.fleet.swarm.simulation import Agent
from planner.mission.files import write_mission
from planner.physics.response import TransferFunction
from planner.service.swarm import SwarmResult, simulate_fleet

if TYPE_CHECKING:
    from planner.fleet.fleet import Fleet
    from planner.fleet.swarm.algorithms import Algorithm
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
