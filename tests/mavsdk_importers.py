"""MAVSDK's importers, which need a vehicle to be asked for: one that says no more than it is there."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mission_raw import MissionRaw
from pymavlink.dialects.v20 import common as mavlink

from planner.autopilot import Autopilot

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_QUADROTOR = 2
_AUTOPILOTS = {Autopilot.PX4: 12, Autopilot.ARDUPILOT: 3}


@contextmanager
def mavsdk_importers() -> Iterator[Mapping[Autopilot, MissionRaw]]:
    """Yield an importer for a vehicle of each autopilot; both vehicles on one link without an end."""
    found = threading.Semaphore(0)
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    mavsdk = Mavsdk(configuration)
    try:
        mavsdk.subscribe_on_new_system(lambda *_: found.release())
        mavsdk.add_any_connection("raw://")
        for number, autopilot in enumerate(_AUTOPILOTS.values(), start=1):
            link = mavlink.MAVLink(None, srcSystem=number, srcComponent=1)
            heartbeat = link.heartbeat_encode(_QUADROTOR, autopilot, 0x81, 0, 3)
            mavsdk.pass_received_raw_bytes(heartbeat.pack(link))
        assert all(found.acquire(timeout=10.0) for _ in _AUTOPILOTS)
        systems = {system.get_system_id(): system for system in mavsdk.get_systems()}
        yield {
            autopilot: MissionRaw(systems[number])
            for number, autopilot in enumerate(_AUTOPILOTS, start=1)
        }
    finally:
        mavsdk.destroy()
