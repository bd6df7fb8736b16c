"""mavjoule: a MAVLink mission energy planner and pre-flight checker.

The public names below are resolved on first use, so that ``import planner`` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.autopilot import Autopilot
    from planner.errors import MavjouleError
    from planner.findings import Finding, Place, Severity
    from planner.flight.conditions import Conditions
    from planner.physics.wind import Wind
    from planner.service import CheckResult

__version__ = "0.1.0"

__all__ = [
    "Autopilot",
    "CheckResult",
    "Conditions",
    "Finding",
    "MavjouleError",
    "Place",
    "Severity",
    "Wind",
    "__version__",
]

_HOMES = {
    "Autopilot": "planner.autopilot",
    "CheckResult": "planner.service",
    "Conditions": "planner.flight.conditions",
    "Finding": "planner.findings",
    "MavjouleError": "planner.errors",
    "Place": "planner.findings",
    "Severity": "planner.findings",
    "Wind": "planner.physics.wind",
}


def __getattr__(name: str) -> object:
    """Import the module a public name lives in, at its first use."""
    from importlib import import_module  # noqa: PLC0415 - only when a name is asked for

    home = _HOMES.get(name)
    if home is None:
        msg = f"module 'planner' has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted(__all__)
