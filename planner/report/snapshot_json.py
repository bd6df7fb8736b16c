"""What was read from a vehicle, as JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from planner.report.json_document import json_text

if TYPE_CHECKING:
    from planner.link.vehicle import VehicleSnapshot


def snapshot_json(snapshot: VehicleSnapshot) -> str:
    """Return who a vehicle is and what was read from it; SI, the unit in each key."""
    return json_text(snapshot_document(snapshot))


def snapshot_document(snapshot: VehicleSnapshot) -> dict[str, Any]:
    """Return the object that `snapshot_json` writes."""
    identity, mission = snapshot.identity, snapshot.mission
    version = identity.firmware_version
    fence = mission.fence
    return {
        "schema": 1,
        "address": snapshot.address,
        "vehicle": {
            "system": identity.system,
            "component": identity.component,
            "autopilot": None if identity.autopilot is None else identity.autopilot.value,
            "mav_autopilot": identity.autopilot_number,
            "mav_type": identity.vehicle_type,
            "firmware_version": None if version is None else ".".join(map(str, version)),
            "firmware_release": identity.firmware_release,
            "uid": identity.uid or None,
        },
        "state": asdict(snapshot.state),
        "counts": {
            "items": len(mission.items),
            "fence_areas": 0 if fence is None else len(fence.polygons) + len(fence.circles),
            "rally_points": len(mission.rally),
            "parameters": len(snapshot.parameters),
        },
        "findings": [
            {"code": f.code, "name": f.name, "severity": f.severity.label, "message": f.message}
            for f in (*snapshot.findings, *mission.findings)
        ],
    }
