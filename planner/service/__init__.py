"""The use cases, called alike by the command line, the terminal UI and scripts.

The names below are resolved on first use: a check does not load what identifies vehicles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.service.conversion import ConversionResult, convert_file
    from planner.service.identification import identify_logs
    from planner.service.judgement import check, verdict
    from planner.service.mission_file import check_file, check_read, read_request
    from planner.service.request import DEFAULT_VEHICLE, CheckRequest
    from planner.service.result import CheckResult, UnreadableMission, Verdict
    from planner.service.together import check_together
    from planner.service.verification import verify_logs

__all__ = [
    "DEFAULT_VEHICLE",
    "CheckRequest",
    "CheckResult",
    "ConversionResult",
    "UnreadableMission",
    "Verdict",
    "check",
    "check_file",
    "check_read",
    "check_together",
    "convert_file",
    "identify_logs",
    "read_request",
    "verdict",
    "verify_logs",
]

_HOMES = {
    "DEFAULT_VEHICLE": "request",
    "CheckRequest": "request",
    "CheckResult": "result",
    "ConversionResult": "conversion",
    "UnreadableMission": "result",
    "Verdict": "result",
    "check": "judgement",
    "check_file": "mission_file",
    "check_read": "mission_file",
    "check_together": "together",
    "convert_file": "conversion",
    "identify_logs": "identification",
    "read_request": "mission_file",
    "verdict": "judgement",
    "verify_logs": "verification",
}


def __getattr__(name: str) -> object:
    """Import the module a use case lives in, at its first use."""
    from importlib import import_module

    home = _HOMES.get(name)
    if home is None:
        msg = f"module 'planner.service' has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(f"planner.service.{home}"), name)


def __dir__() -> list[str]:
    """Return the names of the use cases."""
    return sorted(__all__)
