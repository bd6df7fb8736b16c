"""Flights with a path planner round obstacles, as flown by ArduCopter 4.7.0-dev in SITL."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from ardupilot_missions import DEFAULTS, go, home, stage, takeoff, time_s, took_s

from planner.autopilot import Autopilot
from planner.flight.motion.ardupilot.pilot import fly_ardupilot, fly_ardupilot_flights
from planner.mission.route.stage import StageKind
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.resolve import resolve_parameters

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion
    from planner.mission.route.stage import Stage

CORNER = takeoff(10.0), go(0.0, 60.0, 10.0), go(60.0, 60.0, 10.0), home()
LANES = (
    takeoff(20.0),
    *(go(east, north, 20.0) for east, north in ((0, 150), (60, 150), (60, 0), (120, 0))),
    *(go(east, north, 20.0) for east, north in ((120, 150), (180, 150), (180, 0))),
    home(),
)
CURVED = (
    takeoff(10.0),
    go(0.0, 40.0, 10.0),
    stage(StageKind.SPLINE, 20.0, 80.0, 10.0),
    stage(StageKind.SPLINE, 60.0, 60.0, 10.0),
    go(60.0, 20.0, 10.0),
    home(),
)


def planned(oa_type: int, options: int = 1) -> ArduPilotParameters:
    """The parameters of a file with a path planner."""
    text = f"OA_TYPE,{oa_type}\nOA_OPTIONS,{options}\n"
    file = parameters_from_text(text.encode(), source="vehicle.param")
    values = resolve_parameters(Autopilot.ARDUPILOT, file=file).values
    assert isinstance(values, ArduPilotParameters)
    return values


def flown(stages: tuple[Stage, ...], parameters: ArduPilotParameters) -> Motion:
    return fly_ardupilot(stages, parameters, airspeed_limit_m_s=10.24)


def longer_s(stages: tuple[Stage, ...], parameters: ArduPilotParameters) -> float:
    return time_s(flown(stages, parameters)) - time_s(flown(stages, DEFAULTS))


@pytest.mark.parametrize(
    ("oa_type", "options", "corner_s", "curved_s"),
    [
        # flown 94.9 and 95.4, 94.6 and 94.4 s for 83.7; 113.9 for 93.5
        (1, 1, 11.2, 20.4),
        (2, 1, 10.9, 20.4),
        (3, 1, 10.9, 20.4),
        (1, 5, 8.1, 9.5),
        (2, 5, 0.0, 0.0),
        (3, 4, 0.0, 0.0),
        (0, 1, 0.0, 0.0),
    ],
)
def test_a_path_planner_costs_a_stop_at_every_waypoint(
    oa_type: int, options: int, corner_s: float, curved_s: float
) -> None:
    own = planned(oa_type, options)
    assert longer_s(CORNER, own) == pytest.approx(corner_s, abs=0.9 * (corner_s > 0.0))
    assert longer_s(CURVED, own) == pytest.approx(curved_s, abs=0.9 * (curved_s > 0.0))


def test_lanes_with_a_path_planner_take_what_was_flown() -> None:
    # 215.3 and 216.3 s, without 176.0; from waypoint to waypoint the mean of both.
    motion = flown(LANES, planned(1))
    assert time_s(motion) == pytest.approx(215.8, rel=0.015)
    legs_s = [took_s(motion, at) for at in range(2, 8)]
    assert legs_s == pytest.approx([14.96, 23.90, 14.58, 23.25, 15.18, 22.83], abs=0.7)
    # It stands 1.1 to 1.9 s before a leg whose next is known, 0 to 1 s before the last.
    assert motion.wait_spread_s is not None
    assert motion.wait_spread_s.max() == pytest.approx(0.7 * 3.0, abs=0.2)
    assert flown(LANES, planned(1, 5)).wait_spread_s is None


def test_a_leg_that_is_planned_anew_climbs_at_the_speed_of_the_vehicle() -> None:
    # Commanded 4 m/s, flown 2.50; with OA_TYPE 0 3.87.
    there = go(0.0, 80.0, 10.0, hold=1.0)
    up = tuple(stage(StageKind.GO, 0.0, 80.0, 30.0, climb=climb, hold=1.0) for climb in (None, 4.0))

    def rose_s(own: ArduPilotParameters, last: Stage) -> float:
        return took_s(flown((takeoff(10.0), there, last), own), 2)

    assert rose_s(planned(1), up[1]) == pytest.approx(rose_s(planned(1), up[0]))
    for own in (planned(0), planned(1, 5)):
        assert rose_s(own, up[1]) < rose_s(own, up[0]) - 1.2


def test_a_return_stops_at_its_height_where_a_path_planner_is_on() -> None:
    # Flown from a stop at 10 m to 60 m away at RTL_ALT 15: on its way home after 8.2 s, without after 4.1.
    for_all = takeoff(10.0), go(60.0, 60.0, 10.0, hold=1.0)
    alone_s = [time_s(flown(for_all, own)) for own in (planned(1), DEFAULTS)]
    back_s = [time_s(flown((*for_all, home()), own)) for own in (planned(1), DEFAULTS)]
    more_s = (back_s[0] - alone_s[0]) - (back_s[1] - alone_s[1])
    assert more_s == pytest.approx(4.1, abs=0.6)
    both = fly_ardupilot_flights([(*for_all, home())] * 2, planned(1), airspeed_limit_m_s=10.24)
    assert time_s(both) == pytest.approx(2.0 * back_s[0], abs=1e-6)
