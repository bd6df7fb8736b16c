"""Fleets made in code: their file and missions are written, read and checked."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from made_missions import HOME, METRES_PER_DEGREE_NORTH, item, mission, north, rtl

from planner.fleet.reader import read_fleet
from planner.mission.files import write_mission
from planner.service.fleet import check_fleet
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.writer import write_vehicle

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem
    from planner.service.fleet import FleetResult
    from planner.vehicle.model import VehicleModel

METRES_PER_DEGREE_EAST = (
    METRES_PER_DEGREE_NORTH * math.cos(math.radians(HOME.latitude_deg)) * 1.0025
)
"""On the ellipsoid the circle of latitude is wider than cos φ of the meridian: N/M is 1.0031 at 47°."""


def place(
    metres_north: float, metres_east: float, height_m: float, hold_s: float = 0.0
) -> MissionItem:
    """A waypoint so far from home, held for a time."""
    return item(
        16,
        north(metres_north),
        height_m,
        params=(hold_s, 0.0, 0.0, None),
        longitude_deg=HOME.longitude_deg + metres_east / METRES_PER_DEGREE_EAST,
    )


def up(height_m: float) -> MissionItem:
    """A take-off wherever the vehicle stands."""
    return item(22, None, height_m)


OUT = mission(up(20), place(100, 0, 20), rtl())
"""20 m up, 100 m north and back."""


def pad(name: str, metres_north: float, metres_east: float) -> str:
    """A table of a pad so far from home."""
    return (
        f"[pad.{name}]\nlatitude_deg = {north(metres_north)!r}\n"
        f"longitude_deg = {HOME.longitude_deg + metres_east / METRES_PER_DEGREE_EAST!r}\namsl_m = 400\n"
    )


def sortie(name: str, vehicle: str, start_s: float, *, more: str = "", job: str = "out") -> str:
    """A table of a sortie."""
    return f'[sortie.{name}]\njob = "{job}"\nvehicle = "{vehicle}"\nstart_s = {start_s!r}\n{more}\n'


def vehicles(*names: str, more: str = "", model: str = "arducopter-sitl-quad") -> str:
    """Tables of vehicles of one model, each from the pad of its name."""
    return "".join(
        f'[vehicle.{name}]\nmodel = "{model}"\npad = "{name}"\n{more}\n' for name in names
    )


def unpowered() -> VehicleModel:
    """A vehicle whose power nobody has measured."""
    own = load_vehicle("arducopter-sitl-quad")
    return replace(own, name="unpowered", hover=None, cruise=None, vertical=None)


SEPARATION = "[separation]\nhorizontal_m = 5\n"
SWAP = "[swap]\ntime_s = 60\n"
PACK = '[pack.P]\nbattery = "170Wh"\n'


@cache
def checked(*tables: str, what_if: bool = False, **missions: Mission) -> FleetResult:
    """Return the check of a fleet of tables; a job for each mission, called like it."""
    with TemporaryDirectory() as folder:
        jobs = ""
        for name, one in (missions or {"out": OUT}).items():
            write_mission(one, Path(folder) / f"{name}.plan")
            if f"[job.{name}]" not in "".join(tables) and not name.startswith("part_"):
                jobs += f'[job.{name}]\nmission = "{name}.plan"\n'
        if "unpowered.toml" in "".join(tables):
            write_vehicle(Path(folder) / "unpowered.toml", unpowered())
        file = Path(folder) / "fleet.toml"
        file.write_text("schema = 1\n" + jobs + "\n".join(tables), encoding="utf-8")
        return check_fleet(read_fleet(file), what_if=what_if)
