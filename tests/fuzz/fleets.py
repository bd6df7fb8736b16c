"""The fuzz target of what is done with a fleet: judged with its contingencies, planned, simulated.

An input is a fleet file; its first line is a comment that says what is done with it.
"""

from __future__ import annotations

import json
import shutil
from random import Random
from typing import TYPE_CHECKING

from fuzz.mutation import mutated
from fuzz.pipeline import refuse_constant, sound_plan
from fuzz.target import FOLDER, Target

from planner.fleet.reader import read_fleet
from planner.fleet.schedule import Objective, Patience
from planner.fleet.swarm.policies import POLICIES
from planner.report.fleet import fleet_json, fleet_text, plan_json, plan_text
from planner.report.swarm import swarm_json, swarm_text
from planner.report.text import Medium
from planner.service.fleet import check_fleet
from planner.service.fleet_plan import plan_fleet, write_plan
from planner.service.swarm import simulate_fleet

if TYPE_CHECKING:
    from planner.fleet.fleet import Fleet

_ACTS = ("judge", "plan", "simulate")
_DAMAGED = 0.2
_EFFORT_S, _LONGEST_SEARCH_S, _SIMULATED_S = 0.05, 2.0, 30.0
_MISSIONS = 3


def _made(draw: Random) -> bytes:
    """Return a fleet of some vehicles, packs and jobs, mostly as people write them."""
    names = "abc"[: draw.choice((1, 2, 2, 3))]
    jobs = [f"j{number}" for number in range(draw.choice((1, 2, 3)))]
    act = draw.choice(_ACTS)
    lines = [f"# {act} {draw.choice([*Objective])} {draw.choice([*POLICIES])}", "schema = 1"]
    lines += ["[operation]", "start = 2026-05-12T08:00:00+02:00"]
    lines += [f"latest_s = {draw.choice((60, 600, 3600))}"] * (draw.random() < 0.5)
    lines += ['must_survive = ["vehicle-out", "weak-pack", "late", "return"]'] * (
        draw.random() < 0.2
    )
    lines += ["[conditions]", f'wind = "{draw.choice(("0", "3@270", "5@0"))}"']
    lines += ["[separation]", f"horizontal_m = {draw.choice((1, 10, 60))}"]
    lines += [f"start_error_s = {draw.choice((0, 2, 30))}"] * (draw.random() < 0.5)
    if draw.random() < 0.5:
        lines += [
            "[layers]",
            "lowest_m = 40",
            f"highest_m = {draw.choice((40, 80))}",
            "step_m = 15",
        ]
    lines += ["[swap]", f"time_s = {draw.choice((0, 60, 600))}"]
    for number, name in enumerate(names):
        east = 8.0 + number * draw.choice((0.0, 1e-5, 4e-4))
        lines += [f"[pad.{name}]", "latitude_deg = 47.0", f"longitude_deg = {east!r}"]
        lines += ["amsl_m = 400", f"[vehicle.{name}]", f'pad = "{name}"']
        lines += ['model = "falkowski-2023-quadrotor"']
        lines += [f"available_until_s = {draw.choice((1, 900))}"] * (draw.random() < 0.1)
    battery = draw.choice(("5.2Ah@14.8V", "5.2Ah@14.8V", "20Wh", "0.1Wh"))
    lines += ["[pack.P]", f'battery = "{battery}"', f"count = {draw.choice((1, 2, 4))}"]
    lines += [f'charge = "{draw.choice((100, 60, 0))}%"'] * (draw.random() < 0.3)
    if draw.random() < 0.4:
        lines += ["[charger.c]", f"c_rate = {draw.choice((0.01, 1, 5))}"]
    for job in jobs:
        lines += [f"[job.{job}]", f'mission = "{draw.randrange(_MISSIONS)}.plan"']
        lines += [f"may_split = {draw.choice(('true', 'false'))}"] * (draw.random() < 0.4)
        lines += [f"earliest_s = {draw.choice((0, 300, 9000))}"] * (draw.random() < 0.3)
    if act == "simulate" and draw.random() < 0.7:
        algorithm = draw.choice(("formation", "search"))
        lines += ["[swarm]", f'algorithm = "{algorithm}"', f"height_m = {draw.choice((1, 20, 90))}"]
        reach = draw.choice((1e-6, 5e-4, 2e-3))
        lines += [f"north_deg = {47.0 + reach!r}", f"east_deg = {8.0 + reach!r}"]
        if algorithm == "search":
            lines += ["south_deg = 47.0", "west_deg = 8.0", f"lane_m = {draw.choice((5, 20, 500))}"]
    elif act != "plan":
        packs = ("P",) if lines[lines.index("[pack.P]") + 2] == "count = 1" else ("P-1", "P-2")
        for number, job in enumerate(jobs):
            lines += [f"[sortie.s{number}]", f'job = "{job}"', f'vehicle = "{draw.choice(names)}"']
            lines += [f'pack = "{draw.choice(packs)}"', f"start_s = {300 * number}"]
    data = "\n".join(lines).encode()
    return mutated([data], draw) if draw.random() < _DAMAGED else data


def _run(data: bytes) -> None:
    """Do with a fleet what its first line says; the missions of its jobs are always there."""
    folder = FOLDER / "fleets"
    if not folder.exists():
        folder.mkdir()
        for number in range(_MISSIONS):
            (folder / f"{number}.plan").write_text(sound_plan(Random(number)))
    path = folder / "fleet.toml"
    path.write_bytes(data)
    fleet = read_fleet(path)
    first, _, _ = data.decode("utf-8", "replace").partition("\n")
    _, act, minimize, policy = (f"{first} - - - -").split()[:4]
    if act == "plan":
        _plan(fleet, minimize if minimize in {*Objective} else Objective.ENERGY)
    elif act == "simulate":
        result = simulate_fleet(
            fleet, policy=policy if policy in POLICIES else None, until_s=_SIMULATED_S
        )
        swarm_text(result, medium=Medium()).encode()
        json.loads(swarm_json(result, version="1"), parse_constant=refuse_constant)
    else:
        judged = check_fleet(fleet, what_if=True)
        fleet_text(judged, medium=Medium()).encode()
        json.loads(fleet_json(judged, version="1"), parse_constant=refuse_constant)


def _plan(fleet: Fleet, minimize: str) -> None:
    """Plan a fleet, write the plan, and judge what was written: a plan is a go."""
    folder = FOLDER / "fleets" / "day"
    shutil.rmtree(folder, ignore_errors=True)
    made = plan_fleet(
        fleet,
        minimize=minimize,
        folder=folder,
        effort_s=_EFFORT_S,
        patience=Patience(_LONGEST_SEARCH_S),
    )
    plan_text(made, medium=Medium()).encode()
    json.loads(plan_json(made, version="1"), parse_constant=refuse_constant)
    judged = check_fleet(read_fleet(write_plan(made, folder)))
    assert judged.verdict == "go", [one.finding.message for one in judged.findings]
    assert {one.sortie.job for one in judged.sorties} == {*fleet.jobs}


def target() -> Target:
    """Return the target."""
    return Target("fleets", [_made(Random(1))], _run, make=_made)
