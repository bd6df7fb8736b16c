"""mavjoule: a MAVLink mission energy planner and pre-flight checker.

The public names below are resolved on first use, so that ``import planner`` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.autopilot import Autopilot, Target
    from planner.errors import MavjouleError
    from planner.findings import Finding, Place, Severity
    from planner.logs.csv import CsvMapping, read_csv_mapping
    from planner.logs.files import read_log
    from planner.logs.record import FlightRecord
    from planner.mission.convert import mission_at_speed
    from planner.mission.files import read_mission, write_mission
    from planner.mission.items import Mission
    from planner.physics.wind import Wind
    from planner.quantity import Spread
    from planner.selection import Selection
    from planner.service import CheckResult, check, check_together
    from planner.service.comparison import Comparison, compare_results
    from planner.service.speed import SpeedCurve, predict_speed_curve
    from planner.service.split import Split, split_mission, write_split
    from planner.setup import Reserve, Setup
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
    "CsvMapping",
    "Finding",
    "FlightRecord",
    "MavjouleError",
    "Mission",
    "Place",
    "Reserve",
    "Selection",
    "Setup",
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
    "Comparison": "planner.service.comparison",
    "CsvMapping": "planner.logs.csv",
    "Finding": "planner.findings",
    "FlightRecord": "planner.logs.record",
    "MavjouleError": "planner.errors",
    "Mission": "planner.mission.items",
    "Place": "planner.findings",
    "Reserve": "planner.setup",
    "Selection": "planner.selection",
    "Severity": "planner.findings",
    "Setup": "planner.setup",
    "SpeedCurve": "planner.service.speed",
    "Split": "planner.service.split",
    "Spread": "planner.quantity",
    "Target": "planner.autopilot",
    "VehicleModel": "planner.vehicle.model",
    "Wind": "planner.physics.wind",
    "compare_results": "planner.service.comparison",
    "check": "planner.service",
    "check_together": "planner.service",
    "load_vehicle": "planner.vehicle.library",
    "mission_at_speed": "planner.mission.convert",
    "predict_speed_curve": "planner.service.speed",
    "read_csv_mapping": "planner.logs.csv",
    "read_log": "planner.logs.files",
    "read_mission": "planner.mission.files",
    "read_profile": "planner.site_profile",
    "split_mission": "planner.service.split",
    "write_mission": "planner.mission.files",
    "write_split": "planner.service.split",
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
