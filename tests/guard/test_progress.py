"""The measured place of a vehicle on its predicted flight, and the energy ahead of it."""

from __future__ import annotations

import numpy as np
import pytest
from made_missions import HOME, jump, mission, north, rtl, takeoff, waypoint

from planner.flight.prediction import sample_trace
from planner.flight.returns.tightest import sweep_returns
from planner.guard.energy import Progress, flight_progress
from planner.link.telemetry import VehiclePosition
from planner.service.preflight import check
from planner.vehicle.library import load_vehicle

QUAD = load_vehicle("arducopter-sitl-quad")
OUT_AND_BACK = mission(takeoff(50.0), waypoint(1000.0, 50.0), waypoint(2000.0, 50.0), rtl())


def at(item: int, metres_north: float, *, east_deg: float = 0.0) -> tuple[int, VehiclePosition]:
    return item, VehiclePosition(
        latitude_deg=north(metres_north),
        longitude_deg=HOME.longitude_deg + east_deg,
        altitude_amsl_m=50.0,
        height_above_home_m=50.0,
    )


def test_a_place_on_the_track_is_found_with_the_energy_used_by_then() -> None:
    home = check(OUT_AND_BACK, QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    progress = flight_progress(home, *at(3, 1500.0))
    trace = sample_trace(home.flight, home.route)
    here = (trace.item == 3) & (trace.latitude_deg <= north(1500.0))
    row = int(np.flatnonzero(here)[-1])
    assert progress.time_s == pytest.approx(float(trace.time_s[row]), abs=1.0)
    # the trace's power integrated, within the way between two of the points looked at
    until = slice(0, row + 1)
    used_wh = float(np.trapezoid(trace.power_w[until], trace.time_s[until])) / 3600.0
    assert progress.used_wh == pytest.approx(used_wh, rel=0.01)
    assert progress.off_track_m < 3.0
    total_wh = home.flight.energy_j / 3600.0
    assert progress.used_wh + progress.finish_wh == pytest.approx(total_wh, rel=2e-3)


def test_the_way_home_is_that_of_the_point_of_the_flight() -> None:
    home = check(OUT_AND_BACK, QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    progress = flight_progress(home, *at(3, 1500.0))
    segment = int(np.searchsorted(home.start_s, progress.time_s, side="right")) - 1
    share = (progress.time_s - home.start_s[segment]) / home.flight.motion.segments.duration_s[
        segment
    ]
    points = home.points(np.array([segment]), np.array([share]))
    time_s, way_wh = home.fly(points.stop_m, points.stage, 0)
    # a metre or two of track between the sample and the place
    assert progress.return_wh == pytest.approx(float(points.stop_wh[0] + way_wh[0]), rel=0.01)
    assert progress.return_s == pytest.approx(float(points.stop_s[0] + time_s[0]), rel=0.01)
    assert progress.destination == 0


def test_a_vehicle_off_its_track_needs_more_to_finish() -> None:
    home = check(OUT_AND_BACK, QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    on, off = (flight_progress(home, *at(3, 1500.0, east_deg=east)) for east in (0.0, 0.01))
    # 0.01° of longitude at 47° are 0.01 · 111.32 km · cos 47° = 759 m
    assert off.off_track_m == pytest.approx(760.0, rel=0.01)
    mean_wh_m = home.flight.energy_j / 3600.0 / home.flight.motion.segments.distance_m.sum()
    assert off.finish_wh - on.finish_wh == pytest.approx(760.0 * mean_wh_m, rel=0.02)


def test_in_a_hover_the_clock_says_how_far_it_is() -> None:
    items = (takeoff(50.0), waypoint(500.0, 50.0, hold_s=100.0), waypoint(900.0, 50.0), rtl())
    home = check(mission(*items), QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    first = flight_progress(home, *at(2, 500.0))
    later = flight_progress(home, *at(2, 500.0), before=first, elapsed_s=60.0)
    assert later.time_s - first.time_s == pytest.approx(60.0, abs=1.0)
    hover_w = 353.0  # measured of this vehicle: 353 W
    assert first.finish_wh - later.finish_wh == pytest.approx(hover_w * 60.0 / 3600.0, rel=0.05)


def test_the_first_sight_of_a_hover_counts_all_of_it() -> None:
    items = (takeoff(50.0), waypoint(500.0, 50.0, hold_s=100.0), rtl())
    home = check(mission(*items), QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    progress = flight_progress(home, *at(2, 500.0))
    stage_end_s = float(home.start_s[np.flatnonzero(home.segment_stage == 2)[0]])
    assert stage_end_s - progress.time_s > 99.0


def test_a_lap_that_was_flown_does_not_come_again() -> None:
    items = (takeoff(50.0), waypoint(500.0, 50.0), waypoint(1000.0, 50.0), jump(2, 2.0), rtl())
    home = check(mission(*items), QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    before: Progress | None = None
    times = []
    for item, metres in ((3, 800.0), (2, 800.0), (3, 800.0), (2, 800.0), (3, 800.0)):
        before = flight_progress(home, *at(item, metres), before=before, elapsed_s=60.0)
        times.append(before.time_s)
    assert times == sorted(times)
    assert np.diff(times).min() > 10.0  # 200 m there and 200 m back, or 300 m, at 10 m/s


def test_an_item_that_only_sets_something_stands_for_what_is_flown_next() -> None:
    items = (takeoff(50.0), waypoint(500.0, 50.0), jump(2, 1.0), waypoint(900.0, 50.0), rtl())
    home = check(mission(*items), QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    assert flight_progress(home, *at(3, 700.0)).off_track_m < 5.0


@pytest.mark.parametrize("share", [0.6, 0.75, 0.9])
def test_the_point_of_no_return_is_that_of_the_check(share: float) -> None:
    home = check(OUT_AND_BACK, QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    sweep = sweep_returns(home)
    assert sweep is not None
    available_wh = share * float(sweep.sum_wh.max())
    row = sweep.last_below(available_wh)
    assert row is not None
    progress = flight_progress(home, *at(2, 100.0))
    lead_s = sweep.lead_s(progress.time_s, progress.used_wh, available_wh - progress.used_wh)
    assert lead_s is not None
    last_s, beyond_s = sweep.time_s[row : row + 2]
    assert last_s <= progress.time_s + lead_s <= beyond_s


def test_with_enough_for_every_return_there_is_no_such_point() -> None:
    home = check(OUT_AND_BACK, QUAD).assessment.returns  # type: ignore[union-attr] # it is flown
    progress = flight_progress(home, *at(2, 100.0))
    sweep = sweep_returns(home)
    assert sweep is not None
    assert sweep.lead_s(progress.time_s, progress.used_wh, 1e6) is None
    assert sweep.lead_s(progress.time_s, progress.used_wh, 0.0) == 0.0
