"""The use cases, called alike by the command line, the terminal UI and scripts.

The names below are resolved on first use: a check does not load what identifies vehicles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.service.conversion import ConversionResult, convert_file
    from planner.service.identification import identify_logs
    from planner.service.preflight import (
        CheckResult,
        UnreadableMission,
        Verdict,
        check,
        check_file,
        check_mission,
        check_read,
        verdict,
    )
    from planner.service.together import check_together, keep_apart
    from planner.service.verification import verify_logs

__all__ = [
    "CheckResult",
    "ConversionResult",
    "UnreadableMission",
    "Verdict",
    "check",
    "check_file",
    "check_mission",
    "check_read",
    "check_together",
    "convert_file",
    "identify_logs",
    "keep_apart",
    "verdict",
    "verify_logs",
]

_HOMES = {
    "CheckResult": "preflight",
    "ConversionResult": "conversion",
    "UnreadableMission": "preflight",
    "Verdict": "preflight",
    "check": "preflight",
    "check_file": "preflight",
    "check_mission": "preflight",
    "check_read": "preflight",
    "check_together": "together",
    "convert_file": "conversion",
    "identify_logs": "identification",
    "keep_apart": "together",
    "verdict": "preflight",
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
    return __all__
