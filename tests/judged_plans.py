"""Plans of drawn fleets, and a small judge of its own: packs, chargers, pads, times, separation at 20 Hz."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from made_fleet import pad, place, up, vehicles
from made_missions import mission, rtl
from sampled_fleet import misjudged

from planner.errors import FleetPlanError
from planner.fleet.reader import read_fleet
from planner.mission.files import write_mission
from planner.service.fleet import check_fleet
from planner.service.fleet_plan import plan_fleet, write_plan

if TYPE_CHECKING:
    from planner.fleet.schedule import Objective
    from planner.service.fleet import FleetResult

SWAP_S, FULL_CHARGE_S, PACK_WH, LATEST_S = 60.0, 3600.0, 120.0, 20_000.0
_LATE_S = 0.01
"""Times in a plan are whole milliseconds, of each flight and each charge."""


def planned_fleet(seed: int, minimize: Objective) -> FleetResult | str:
    """Return the check of what the plan of a drawn fleet writes, or why there is none."""
    draw = np.random.default_rng(seed)
    jobs, count = int(draw.integers(1, 5)), int(draw.integers(1, 4))
    packs, places = int(draw.integers(1, 5)), int(draw.integers(1, 3))
    with TemporaryDirectory() as name:
        folder = Path(name)
        text = f"schema = 1\n[operation]\nlatest_s = {LATEST_S}\n[swap]\ntime_s = {SWAP_S}\n"
        text += "[separation]\nhorizontal_m = 8\nabove_m = 5\nheight_error_m = 0\n"
        text += "min_nav_alt_m = 2.5\nground_m = 0\n"
        text += f'[pack.P]\nbattery = "{PACK_WH:g}Wh"\ncount = {packs}\n'
        text += (
            f"[charger.C]\ncount = {places}\ncharge_soc = [0, 1]\ncharge_s = [0, {FULL_CHARGE_S}]\n"
        )
        for number in range(count):
            text += pad(f"v{number}", 0.0, 40.0 * number)
            text += vehicles(f"v{number}", more="position_error_m = 0")
        for number in range(jobs):
            height = float(draw.uniform(15.0, 30.0))
            corners = draw.uniform(-150.0, 150.0, (3, 2)).tolist()
            ways = [place(north, east, height) for north, east in corners]
            write_mission(mission(up(height), *ways, rtl()), folder / f"j{number}.plan")
            text += f'[job.j{number}]\nmission = "j{number}.plan"\n'
            if draw.random() < 0.3:
                text += f"earliest_s = {int(draw.integers(0, 300))}\n"
        (folder / "fleet.toml").write_text(text, encoding="utf-8")
        try:
            plan = plan_fleet(
                read_fleet(folder / "fleet.toml"), minimize=minimize, folder=folder / "out"
            )
        except FleetPlanError as error:
            return str(error)
        return check_fleet(read_fleet(write_plan(plan, folder / "out")))


def faults(result: FleetResult) -> list[str]:
    """Return what is wrong with a checked plan by the clock, the packs and samples of all tracks."""
    found = [
        f"{one} {two} {lack_m:.2f} m"
        for one, two, lack_m in misjudged(result)
        if result.fleet.sorties[one].vehicle != result.fleet.sorties[two].vehicle
    ]
    if result.verdict != "go":
        found.append(f"no-go: {[one.code for one in result.all_findings]}")
    fleet = result.fleet
    flown_jobs = sorted(one.sortie.job for one in result.sorties)
    if flown_jobs != sorted(fleet.jobs):
        found.append(f"jobs {flown_jobs}")
    by_pack: dict[str | None, list[tuple[float, float, float]]] = {}
    for one in result.sorties:
        if one.start_s < fleet.jobs[one.sortie.job].earliest_s or one.end_s > LATEST_S:
            found.append(f"{one.name} out of its hours")
        taken = 1.0 - (one.charge_left or 0.0)
        by_pack.setdefault(one.sortie.pack, []).append((one.start_s, one.end_s, taken))
    for name in fleet.vehicles:
        own = sorted((o.start_s, o.end_s) for o in result.sorties if o.sortie.vehicle == name)
        found += [name for a, b in pairwise(own) if b[0] < a[1] + SWAP_S - _LATE_S]
    places = fleet.chargers["C"].count
    charges = []
    for pack, flights in by_pack.items():
        for (_, end_s, taken), (start_s, _, _) in pairwise(sorted(flights)):
            ready_s, needed_s = end_s + SWAP_S, FULL_CHARGE_S * taken
            if start_s < ready_s + needed_s - _LATE_S:
                found.append(f"pack {pack} has {start_s - ready_s:.1f} s of {needed_s:.1f} s")
            charges.append((ready_s, start_s, needed_s))
    found += _overfull(charges, places)
    return found


def _overfull(charges: list[tuple[float, float, float]], places: int) -> list[str]:
    """Return windows of time in which the chargers cannot give what has to be charged in them."""
    found = []
    for from_s, _, _ in charges:
        for _, until_s, _ in charges:
            inside = [needed for a, b, needed in charges if a >= from_s and b <= until_s]
            if sum(inside) > places * max(until_s - from_s, 0.0) + _LATE_S * len(inside):
                found.append(f"chargers from {from_s:.0f} to {until_s:.0f} s")
    return found
