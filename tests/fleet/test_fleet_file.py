"""Fleet files: what they say, and every problem of one at once."""

from __future__ import annotations

import datetime as dt
import math
from typing import TYPE_CHECKING

import pytest

import planner
from planner.errors import FleetFileError
from planner.fleet.fleet import Charger, Layers
from planner.fleet.reader import MOST_BYTES, read_fleet
from planner.vehicle.battery import Battery
from planner.vehicle.declared import InvalidValueError

if TYPE_CHECKING:
    from pathlib import Path

WHOLE = """
schema = 1

[operation]
start = 2026-05-12T08:00:00+02:00
latest_s = 3600

[conditions]
wind = "3@270"
reserve = "25%"

[separation]
horizontal_m = 10

[layers]
lowest_m = 40
highest_m = 80
step_m = 15

[swap]
time_s = 120

[pad.north]
latitude_deg = 48.39
longitude_deg = 15.5

[vehicle.alpha]
model = "falkowski-2023-quadrotor"
pad = "north"
payload_kg = 0.2
wind = "4@90"

[vehicle.beta]
model = "falkowski-2023-quadrotor"

[pack.A]
battery = "5.2Ah@14.8V"
charge = "90%"
count = 3

[pack.B]
fits = ["alpha"]

[pack.B.battery]
capacity_wh = 77

[charger.bench]
c_rate = 1
packs = ["A-1", "A-2"]

[job.survey]
mission = "survey.plan"

[sortie.first]
job = "survey"
vehicle = "alpha"
pack = "A-2"
start_s = 10
"""


def problems_of(folder: Path, text: str) -> list[str]:
    """What is wrong with a file, each without the name of the file."""
    file = folder / "fleet.toml"
    file.write_text(text)
    with pytest.raises(FleetFileError) as caught:
        read_fleet(file)
    return [problem.removeprefix(f"{file}: ") for problem in caught.value.problems]


def test_a_fleet_is_what_its_file_says(tmp_path: Path) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text(WHOLE)
    fleet = planner.read_fleet(file)
    assert fleet.operation.start == dt.datetime(2026, 5, 12, 6, tzinfo=dt.UTC)
    assert [*fleet.packs] == ["A-1", "A-2", "A-3", "B"]
    assert fleet.packs["A-2"].battery == Battery(capacity_ah=5.2, nominal_voltage_v=14.8)
    assert fleet.packs["A-2"].settings == {"charge": 0.9}
    assert fleet.layers is not None
    assert fleet.layers.heights_m == (40.0, 55.0, 70.0)
    bench = fleet.chargers["bench"]
    assert [bench.charges(pack) for pack in fleet.packs.values()] == [True, True, False, False]
    sortie = fleet.sorties["first"]
    assert fleet.mission_of(sortie) == str(tmp_path / "survey.plan")
    assert fleet.pad_of(sortie) == fleet.pads["north"]


def test_a_vehicle_is_flown_as_its_table_says_then_as_the_conditions_say(tmp_path: Path) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text(WHOLE)
    alpha, beta = read_fleet(file).vehicles.values()
    assert (alpha.setup.wind.speed_m_s, beta.setup.wind.speed_m_s) == (4.0, 3.0)
    assert (alpha.setup.reserve, alpha.setup.payload_kg) == (0.25, 0.2)
    typed = read_fleet(file, given={"reserve": 0.3}).vehicles["alpha"]
    assert typed.setup.reserve == 0.3


def test_every_problem_is_named_at_once(tmp_path: Path) -> None:
    broken = """
schema = 1
colour = 1
[conditions]
wid = 3
reserve = "much"
[vehicle.alpha]
model = "falkowski"
paad = "north"
params = "none.param"
[vehicle."../b"]
model = "falkowski-2023-quadrotor"
pad = "south"
[pack.B.battery]
capacity_w = 77
[charger.bench]
c_rate = 1
power_w = 3
[job.survey]
latest_s = nan
[sortie.one]
job = "surve"
vehicle = "alpha"
start_s = -1
[sortie.two]
job = "surve"
vehicle = "alpha"
start_s = 1
"""
    found = problems_of(tmp_path, broken)
    keys = [problem.partition(": ")[0] for problem in found]
    assert sorted(keys) == sorted(
        [
            "colour",
            "conditions.reserve",
            "conditions.wid",
            "vehicle.alpha.paad",
            "vehicle.alpha.model",
            "vehicle.alpha.params",
            "vehicle.../b",
            "vehicle.../b.pad",
            "pack.B.battery.capacity_w",
            "charger.bench.power_w",
            "job.survey.latest_s",
            "job.survey.mission",
            "sortie.one.start_s",
            "sortie.one.job",
            "sortie.two.job",
            "separation",
            "swap",
        ]
    )
    assert "sortie.two.job: there is none called 'surve'; did you mean survey?" in found
    assert "vehicle.alpha.paad: is not a key of this file; did you mean pad?" in found


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "schema = 2\n",
            "schema: 2 is newer than this program, which reads schema 1: update mavjoule",
        ),
        ("", "schema: is missing: write schema = 1 at the top of the file"),
        ("schema = 1\n", "vehicle: is missing: the file needs a table [vehicle.NAME]"),
        ("schema = 1\nvehicle = 3\n", "vehicle: must be a table [vehicle], got 3"),
        ("schema = 1\n[vehicle]\na = 3\n", "vehicle.a: must be a table [vehicle.a], got 3"),
        (
            "schema = 1\n[operation]\nstart = 2026-05-12T08:00:00\n",
            "operation.start: must be a date and time with its offset, got 2026-05-12 08:00:00",
        ),
        (
            WHOLE.replace("[swap]\ntime_s = 120", ""),
            "swap: is missing: say how long it takes to change a pack",
        ),
        (WHOLE + "output = 3\n", "sortie.first.output: is not a key of this file"),
        (
            WHOLE.replace('wind = "3@270"', 'report = "x.html"'),
            "conditions.report: is not a key of this file",
        ),
    ],
)
def test_a_problem_is_named_with_its_key(tmp_path: Path, text: str, problem: str) -> None:
    assert any(one.startswith(problem) for one in problems_of(tmp_path, text))


def test_a_file_that_is_no_fleet_is_refused(tmp_path: Path) -> None:
    assert problems_of(tmp_path, "schema = ")[0].endswith("is not TOML: Invalid value")
    large = problems_of(tmp_path, "#" * (MOST_BYTES + 1))
    assert large[0].endswith("is larger than 4096 KiB: this is not a fleet file")
    with pytest.raises(FleetFileError, match="is a folder, not a file"):
        read_fleet(tmp_path)


def test_a_charge_takes_longer_towards_its_end() -> None:
    """By hand: the integral of 1 / rate over the charge, at 1C of a pack of 77 Wh."""
    pack = Battery(capacity_wh=77.0)
    even = Charger(c_rate=1.0, taper_soc=(1.0,), taper_factor=(1.0,))
    assert even.charge_time_s(pack, 0.25) == pytest.approx(2700.0)
    # even up to 80 %, then from 1 to 0.05 over a fifth: 0.2 ln(20) / 0.95 hours
    assumed = 3600.0 * (0.8 + 0.2 * math.log(20.0) / 0.95)
    assert Charger(c_rate=1.0).charge_time_s(pack, 0.0) == pytest.approx(assumed)
    assert Charger(power_w=38.5).charge_time_s(pack, 0.0) == pytest.approx(2.0 * assumed)
    table = Charger(charge_soc=(0.0, 0.5, 1.0), charge_s=(0.0, 1000.0, 3600.0))
    assert table.charge_time_s(pack, 0.25) == pytest.approx(3100.0)
    assert table.charge_time_s(pack, 0.25, 0.75) == pytest.approx(1800.0)
    assert table.charge_time_s(pack, 1.0) == 0.0


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"c_rate": 1.0, "power_w": 3.0},
        {"c_rate": 1.0, "taper_soc": (0.8,)},
        {"charge_soc": (0.1, 1.0), "charge_s": (0.0, 3600.0)},
        {"charge_soc": (0.0, 1.0), "charge_s": (3600.0, 0.0)},
        {"c_rate": 1.0, "taper_soc": (0.8, 1.0), "taper_factor": (1.0, 0.0)},
    ],
)
def test_a_charger_that_does_not_fit_together_is_refused(given: dict[str, object]) -> None:
    with pytest.raises(InvalidValueError):
        Charger(**given)  # type: ignore[arg-type]


def test_layers_end_above_where_they_begin() -> None:
    with pytest.raises(InvalidValueError, match="highest_m is below lowest_m"):
        Layers(lowest_m=60.0, highest_m=40.0, step_m=10.0)
