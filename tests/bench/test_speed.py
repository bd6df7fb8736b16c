"""What has to be fast, measured as ratios in one run: ``make bench`` prints them.

These are measurements, not tests: nothing here fails on a slow machine.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from long_missions import LEG_M, plan, seconds
from sampled_flight import Manoeuvre, SampledVehicle

from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.items import MissionFormat
from planner.report.plots.picture_files import inline_rows, load_altair
from planner.service.preflight import check
from planner.service.split import split_mission
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.vehicle.model import VehicleModel

pytestmark = pytest.mark.bench

MISSIONS = Path(__file__).parents[2] / "missions"
BATTERY = Battery(capacity_ah=5.2, nominal_voltage_v=14.8)
VEHICLE = load_vehicle("falkowski-2023-quadrotor")


def check_of(
    count: int, vehicle: VehicleModel = VEHICLE, *, autopilot: int = 12
) -> Callable[[], object]:
    text = plan(count, autopilot=autopilot)
    mission = read_mission_bytes(text.encode(), source="bench.plan")
    return lambda: check(mission, vehicle, battery=BATTERY)


@pytest.mark.parametrize("count", [10, 100])
def test_closed_form_against_sampling(count: int) -> None:
    """The whole check; the issue asks for 100 and 500 times."""
    mission = read_mission_bytes(plan(count).encode(), source="bench.plan")
    vehicle = SampledVehicle()
    manoeuvres = [
        Manoeuvre(
            "level" if s.climb_m == 0.0 else "climb" if s.climb_m > 0.0 else "descent",
            LEG_M if s.climb_m == 0.0 else s.climb_m,
            50.0,
        )
        for s in check(mission, VEHICLE, battery=BATTERY).segments
        if s.climb_m != 0.0 or s.state == "accelerate"
    ]
    sampled_s = seconds(lambda: [vehicle.fly(m) for m in manoeuvres], runs=1)
    closed_s = seconds(lambda: check(mission, VEHICLE, battery=BATTERY))
    print(
        f"\n{count} items, {len(manoeuvres)} manoeuvres: closed form {1e3 * closed_s:.1f} ms, "
        f"control.forced_response at 50 Hz {1e3 * sampled_s:.0f} ms: "
        f"{sampled_s / closed_s:.0f} times"
    )


def test_a_picture_against_its_rows() -> None:
    """What it takes to draw rows that a picture carries itself, to its specification."""
    alt = load_altair()
    rows = [{"time_s": 0.1 * row, "answer": 0.5, "what": "flown"} for row in range(10_000)]

    def draw() -> object:
        chart = alt.Chart(inline_rows(rows)).mark_line().encode(x="time_s:Q", y="answer:Q")
        return chart.properties(title="answer").to_dict(validate=False)

    drawn_s, written_s = seconds(draw), seconds(lambda: json.dumps(rows))
    print(
        f"\npicture of 10,000 rows {1e3 * drawn_s:.0f} ms: "
        f"{drawn_s / written_s:.1f} times writing them as JSON"
    )


def test_cost_over_items() -> None:
    thousand_s, ten_thousand_s = (seconds(check_of(n), runs=3) for n in (1_000, 10_000))
    print(
        f"\ncheck of 1,000 items {1e3 * thousand_s:.0f} ms, of 10,000 {1e3 * ten_thousand_s:.0f} ms: "
        f"{ten_thousand_s / thousand_s:.1f} times for 10 times the items"
    )


@pytest.mark.parametrize(("name", "autopilot"), [("arducopter-sitl-quad", 3), ("px4-sih-quad", 12)])
def test_an_autopilots_flight_against_reading_it(name: str, autopilot: int) -> None:
    """The issue asks for 30 ms on 1,000 items, and for a cost that grows with the items alone."""
    vehicle = load_vehicle(name)
    text = plan(1_000, autopilot=autopilot)
    loads_s = seconds(lambda: json.loads(text))
    thousand_s, ten_thousand_s = (
        seconds(check_of(count, vehicle, autopilot=autopilot)) for count in (1_000, 10_000)
    )
    print(
        f"\n{name}, check of 1,000 items {1e3 * thousand_s:.0f} ms, "
        f"{thousand_s / loads_s:.0f} times json.loads of them; "
        f"of 10,000 {ten_thousand_s / thousand_s:.1f} times that"
    )


def test_reading_against_json() -> None:
    """The issue asks for less than 5 times ``json.loads`` on 10,000 items."""
    text = plan(10_000)
    data = text.encode()
    loads_s = seconds(lambda: json.loads(text))
    read_s = seconds(lambda: read_mission_bytes(data, source="bench.plan"))
    print(
        f"\n10,000 items, {len(data) / 1e6:.1f} MB: json.loads {1e3 * loads_s:.0f} ms, "
        f"read_mission {1e3 * read_s:.0f} ms: {read_s / loads_s:.2f} times"
    )


def test_reading_rows_against_splitting_them() -> None:
    """The issue asks for 5 µs an item."""
    mission = read_mission_bytes(plan(10_000).encode(), source="bench.plan")
    text = convert_mission(mission, MissionFormat.WPL).text
    data, rows = text.encode(), text.splitlines()[1:]
    split_s = seconds(lambda: [[float(field) for field in row.split("\t")] for row in rows])
    read_s = seconds(lambda: read_mission_bytes(data, source="bench.waypoints"))
    print(
        f"\n10,000 rows: read_mission {1e6 * read_s / len(rows):.1f} µs a row, "
        f"{read_s / split_s:.1f} times making numbers of its fields"
    )


def test_splitting_against_checking() -> None:
    """The issue asks for 1 s for a mission of 1,000 items."""
    mission = read_mission_bytes(plan(1_000, autopilot=3).encode(), source="bench.plan")
    # without a battery of its own any other weighs nothing
    vehicle = replace(load_vehicle("arducopter-sitl-quad"), battery=None)
    whole = check(mission, vehicle)
    battery = Battery(capacity_wh=0.3 * whole.totals.energy_wh / 0.8)
    check_s = seconds(lambda: check(mission, vehicle, battery=battery))
    split_s = seconds(lambda: split_mission(mission, vehicle, battery=battery), runs=1)
    print(
        f"\n1,000 items: split {1e3 * split_s:.0f} ms, {split_s / check_s:.0f} times the check "
        f"of them in one flight"
    )


@pytest.mark.parametrize("name", ["inspection-pylon.plan", "survey-vineyard.plan"])
def test_start_to_end_of_the_command(name: str) -> None:
    """The issue asks for 3 times ``import numpy``; the survey has a fence, and so loads shapely."""

    def numpy() -> object:
        return subprocess.run([sys.executable, "-c", "import numpy"], check=True)

    def command() -> object:
        return subprocess.run(
            [
                sys.executable,
                "-c",
                "from planner.cli.main import main; main()",
                "check",
                str(MISSIONS / name),
            ],
            stdout=subprocess.DEVNULL,
            check=False,
        )

    numpy_s, command_s = seconds(numpy, runs=9), seconds(command, runs=9)
    print(
        f"\nmavjoule check {name} {1e3 * command_s:.0f} ms, import numpy {1e3 * numpy_s:.0f} ms: "
        f"{command_s / numpy_s:.2f} times"
    )
