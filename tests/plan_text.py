"""A realistic plan for tests, written by hand, to be changed in one place at a time."""

from __future__ import annotations

import copy
import json
from typing import Any

HOME = [47.3977, 8.5455, 488.0]


def simple_item(command: int, frame: int, *params: float | None, number: int) -> dict[str, Any]:
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": params[6],
        "AltitudeMode": 1 if frame == 3 else 2,
        "autoContinue": True,
        "command": command,
        "doJumpId": number,
        "frame": frame,
        "params": list(params),
        "type": "SimpleItem",
    }


SURVEY: dict[str, Any] = {
    "type": "ComplexItem",
    "complexItemType": "survey",
    "version": 5,
    "angle": 0,
    "entryLocation": 0,
    "flyAlternateTransects": False,
    "splitConcavePolygons": False,
    "polygon": [[47.398, 8.545], [47.398, 8.546], [47.399, 8.546], [47.399, 8.545]],
    "TransectStyleComplexItem": {
        "version": 2,
        "CameraCalc": {
            "version": 2,
            "CameraName": "Manual (no camera specs)",
            "DistanceMode": 1,
            "DistanceToSurface": 50,
            "AdjustedFootprintSide": 25,
            "AdjustedFootprintFrontal": 20,
        },
        "CameraShots": 2,
        "CameraTriggerInTurnAround": True,
        "HoverAndCapture": False,
        "Refly90Degrees": False,
        "TurnAroundDistance": 10,
        "VisualTransectPoints": [[47.398, 8.545]],
        "Items": [
            {
                "autoContinue": True,
                "command": 16,
                "doJumpId": 3,
                "frame": 3,
                "params": [0, 0, 0, None, 47.398, 8.545, 50],
                "type": "SimpleItem",
            },
            {
                "autoContinue": True,
                "command": 206,
                "doJumpId": 4,
                "frame": 2,
                "params": [20, 0, 1, 0, 0, 0, 0],
                "type": "SimpleItem",
            },
        ],
    },
}

STRUCTURE_SCAN: dict[str, Any] = {
    "type": "ComplexItem",
    "complexItemType": "StructureScan",
    "version": 3,
    "EntranceAltitude": 60,
    "GimbalPitch": 0,
    "Layers": 2,
    "ScanBottomAlt": 10,
    "StartFromTop": True,
    "StructureHeight": 30,
    "CameraCalc": {
        "version": 2,
        "AdjustedFootprintFrontal": 10,
        "AdjustedFootprintSide": 25,
        "DistanceToSurface": 20,
    },
    "polygon": [[0.0, 0.0], [0.001, 0.0], [0.001, 0.001], [0.0, 0.001]],
}

LANDING: dict[str, Any] = {
    "type": "ComplexItem",
    "complexItemType": "fwLandingPattern",
    "version": 2,
    "altitudesAreRelative": True,
    "landCoordinate": [47.4, 8.55, 0],
    "landingApproachCoordinate": [47.41, 8.55, 40],
    "loiterClockwise": False,
    "loiterRadius": 75,
    "stopTakingPhotos": True,
    "stopVideoPhotos": True,
    "useLoiterToAlt": True,
    "valueSetIsDistance": True,
}

PLAN: dict[str, Any] = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "QGroundControl",
    "mission": {
        "version": 2,
        "plannedHomePosition": HOME,
        "firmwareType": 12,
        "vehicleType": 2,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "globalPlanAltitudeMode": 1,
        "items": [
            simple_item(22, 3, 0, 0, 0, None, 47.3977, 8.5455, 30, number=1),
            simple_item(16, 3, 5, 0, 0, None, 47.3987, 8.5455, 50, number=2),
            SURVEY,
            simple_item(16, 0, 0, 0, 0, None, 47.3987, 8.5465, 540, number=5),
            {
                "autoContinue": True,
                "command": 20,
                "doJumpId": 6,
                "frame": 2,
                "params": [0, 0, 0, 0, 0, 0, 0],
                "type": "SimpleItem",
            },
        ],
    },
    "geoFence": {
        "version": 2,
        "polygons": [
            {
                "version": 1,
                "inclusion": True,
                "polygon": [[47.39, 8.53], [47.39, 8.56], [47.41, 8.56], [47.41, 8.53]],
            }
        ],
        "circles": [
            {"version": 1, "inclusion": False, "circle": {"center": [47.395, 8.54], "radius": 30.5}}
        ],
        "breachReturn": [47.3977, 8.5455, 40],
    },
    "rallyPoints": {"version": 2, "points": [[47.399, 8.545, 25], [47.4, 8.55, 30]]},
}


def plan_with(value: object, *path: str | int) -> str:
    """The plan's text with one value put in at a path."""
    plan = copy.deepcopy(PLAN)
    target: Any = plan
    for step in path[:-1]:
        target = target[step]
    target[path[-1]] = value
    return json.dumps(plan, indent=1)


def plan_without(*path: str | int) -> str:
    """The plan's text with one key left out."""
    plan = copy.deepcopy(PLAN)
    target: Any = plan
    for step in path[:-1]:
        target = target[step]
    del target[path[-1]]
    return json.dumps(plan, indent=1)


def plan_of(*items: dict[str, Any]) -> str:
    """The plan's text with other items."""
    return plan_with(list(items), "mission", "items")
