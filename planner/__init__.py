"""mavjoule: a MAVLink mission energy planner and pre-flight checker.

The public names below are resolved on first use, so that ``import planner`` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.autopilot import Autopilot, Target
    from planner.errors import MavjouleError
    from planner.findings import Finding, Place, Severity
    from planner.fixes.comparison import Comparison, compare_results
    from planner.fixes.speed import predict_speed_curve
    from planner.fixes.speed_curve import SpeedCurve
    from planner.fixes.split import Split, split_mission, write_split
    from planner.flight.budget import Reserve
    from planner.flight.conditions import Conditions, Spread
    from planner.logs.csv import (
        CsvMapping,
        read_csv_mapping,
    )
    from planner.logs.files import read_log
    from planner.logs.record import FlightRecord
    from planner.mission.convert import mission_at_speed
    from planner.mission.files import read_mission, write_mission
    from planner.mission.items import Mission
    from planner.physics.wind import Wind
    from planner.selection import Selection
    from planner.service import CheckResult, check, check_together
    from planner.site_profile import read_profile
    from planner.vehicle.battery import Battery
    from planner.vehicle.library import load_vehicle
    from planner.vehicle.model import VehicleModel

__version__ = "0.1.0"

__all__ = [
    "Autopilot",
    "Battery",
    "CheckResult",
    "Comparison",
    "Conditions",
    "CsvMapping",
    "Finding",
    "FlightRecord",
    "MavjouleError",
    "Mission",
    "Place",
    "Reserve",
    "Selection",
    "Severity",
    "SpeedCurve",
    "Split",
    "Spread",
    "Target",
    "VehicleModel",
    "Wind",
    "__version__",
    "check",
    "check_together",
    "compare_results",
    "load_vehicle",
    "mission_at_speed",
    "predict_speed_curve",
    "read_csv_mapping",
    "read_log",
    "read_mission",
    "read_profile",
    "split_mission",
    "write_mission",
    "write_split",
]

_HOMES = {
    "Autopilot": "planner.autopilot",
    "Battery": "planner.vehicle.battery",
    "CheckResult": "planner.service",
    "Comparison": "planner.fixes.comparison",
    "Conditions": "planner.flight.conditions",
    "CsvMapping": "planner.logs.csv",
    "Finding": "planner.findings",
    "FlightRecord": "planner.logs.record",
    "MavjouleError": "planner.errors",
    "Mission": "planner.mission.items",
    "Place": "planner.findings",
    "Reserve": "planner.flight.budget",
    "Selection": "planner.selection",
    "Severity": "planner.findings",
    "SpeedCurve": "planner.fixes.speed_curve",
    "Split": "planner.fixes.split",
    "Spread": "planner.flight.conditions",
    "Target": "planner.autopilot",
    "VehicleModel": "planner.vehicle.model",
    "Wind": "planner.physics.wind",
    "compare_results": "planner.fixes.comparison",
    "check": "planner.service",
    "check_together": "planner.service",
    "load_vehicle": "planner.vehicle.library",
    "mission_at_speed": "planner.mission.convert",
    "predict_speed_curve": "planner.fixes.speed",
    "read_csv_mapping": "planner.logs.csv",
    "read_log": "planner.logs.files",
    "read_mission": "planner.mission.files",
    "read_profile": "planner.site_profile",
    "split_mission": "planner.fixes.split",
    "write_mission": "planner.mission.files",
    "write_split": "planner.fixes.split",
}


def __getattr__(name: str) -> object:
    """Import the module a public name lives in, at its first use."""
    from importlib import import_module

    home = _HOMES.get(name)
    if home is None:
        msg = f"module 'planner' has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
