"""A landing approach in a text file, and parameters that say what flies it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PX4, found, vehicle_of

from planner.findings import Severity
from planner.mission.items import MissionFormat
from planner.mission.vehicle_kind import vehicle_evidence
from planner.service.preflight import check
from planner.values import replace

if TYPE_CHECKING:
    from planner.autopilot import Autopilot


@pytest.mark.parametrize(
    ("parameters", "target", "severity"),
    [
        ("", None, Severity.WARNING),  # the model is one of ArduCopter's
        ("BATT_MONITOR,4\n", None, Severity.ERROR),
        ("WPNAV_SPEED,800\n", None, Severity.WARNING),
        ("FRAME_CLASS,1\n", None, Severity.WARNING),
        ("Q_FRAME_CLASS,1\n", None, Severity.ERROR),
        *(
            (f"{one},1\n", None, Severity.WARNING)
            for one in ("RTL_ALT", "MOT_THST_HOVER", "FS_THR_ENABLE")
        ),
        *(
            (f"{one},1\n", None, Severity.ERROR)
            for one in ("RTL_ALTITUDE", "Q_M_THST_HOVER", "THR_FAILSAFE")
        ),
        ("", "arducopter-4.6", Severity.WARNING),
        ("BATT_MONITOR,4\n", "arducopter-4.6", Severity.WARNING),
    ],
)
def test_a_landing_approach_is_a_copters_where_its_parameters_or_the_target_are(
    parameters: str, target: str | None, severity: Severity
) -> None:
    start = item(189, frame=2, params=(0.0, 0.0, 0.0, 0.0))
    one = mission(takeoff(20), waypoint(300, 20), start, waypoint(100, 20), item(21, north(0), 0.0))
    text = replace(one, file_format=MissionFormat.WPL, vehicle=vehicle_evidence(one.items))
    told = [
        f.severity for f in found(text, ARDUPILOT, parameters, target=target) if f.code == "M111"
    ]
    assert told == [severity]


@pytest.mark.parametrize(
    ("model", "autopilot", "severity"),
    [
        (ARDUPILOT, PX4, Severity.ERROR),
        (PX4, ARDUPILOT, Severity.WARNING),
        (PX4, None, Severity.ERROR),
        (ARDUPILOT, None, Severity.WARNING),
    ],
)
def test_a_landing_approach_is_a_copters_by_what_flies_it_not_by_the_model(
    model: Autopilot, autopilot: Autopilot | None, severity: Severity
) -> None:
    start = item(189, frame=2, params=(0.0, 0.0, 0.0, 0.0))
    one = mission(takeoff(20), waypoint(300, 20), start, waypoint(100, 20), item(21, north(0), 0.0))
    text = replace(one, file_format=MissionFormat.WPL, vehicle=vehicle_evidence(one.items))
    result = check(text, vehicle_of(model), autopilot=autopilot)
    assert [one.severity for one in result.findings if one.code == "M111"] == [severity]
