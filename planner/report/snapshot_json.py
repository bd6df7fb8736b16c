"""What was read from a vehicle, as JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from planner.report.json_document import envelope, json_text

if TYPE_CHECKING:
    from planner.link.vehicle import VehicleSnapshot


def snapshot_json(snapshot: VehicleSnapshot, version: str) -> str:
    """Return who a vehicle is and what was read from it; SI, the unit in each key."""
    identity, mission = snapshot.identity, snapshot.mission
    firmware = identity.firmware_version
    fence = mission.fence
    document = {
        **envelope(version),
        "address": snapshot.address,
        "vehicle": {
            "system": identity.system,
            "component": identity.component,
            "autopilot": None if identity.autopilot is None else identity.autopilot.value,
            "mav_autopilot": identity.autopilot_number,
            "mav_type": identity.vehicle_type,
            "firmware_version": None if firmware is None else ".".join(map(str, firmware)),
            "firmware_release": identity.firmware_release,
            "uid": identity.uid or None,
        },
        "state": asdict(snapshot.state),
        "counts": {
            "items": len(mission.items),
            "fence_areas": 0 if fence is None else fence.area_count,
            "rally_points": len(mission.rally),
            "parameters": len(snapshot.parameters),
        },
        "findings": [
            {"code": f.code, "name": f.name, "severity": f.severity.label, "message": f.message}
            for f in (*snapshot.findings, *mission.findings)
        ],
    }
    return json_text(document)
