"""From logs to a model file: the article's experiment, simulated with noise, comes back."""

from __future__ import annotations

import datetime as dt
import json
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record, record_of
from simulated_experiment import (
    G1,
    G2,
    G3,
    G4,
    G5,
    HOVER_COEFFICIENT_W,
    HOVER_EXPONENT,
    fly_horizontally,
    fly_vertically,
)

from planner.cli.main import main
from planner.identify.assembly import IdentificationSettings, Method
from planner.identify.identification import _loads, identify_vehicle
from planner.report.identification import identification_text
from planner.report.text import Medium
from planner.values import replace
from planner.vehicle.power import AltitudeLaw, CruisePower
from planner.vehicle.reader import read_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from simulated_experiment import Flown

TRUTH = {"altitude": G1, "climb_power": G2, "descent_power": G3, "speed": G4, "brake_power": G5}
FLIGHTS = 2
MAPPING = """schema = 1
name = "experiment"
[columns]
time_s = { column = "t" }
height_above_home_m = { column = "h" }
ground_speed_m_s = { column = "v" }
reference_height_m = { column = "h_ref" }
reference_speed_m_s = { column = "v_ref" }
power_w = { column = "P" }
is_landed = { column = "landed" }
"""


def csv_text(flown: Flown, *, is_vertical: bool) -> str:
    """Return a flight as a logger writes it; on the ground until the first step up."""
    landed = np.zeros(flown.time_s.size)
    height_ref, speed_ref = np.full(flown.time_s.size, 200.0), flown.reference
    if is_vertical:
        steps = np.flatnonzero(flown.steps)
        landed[: steps[0]] = 1.0
        landed[steps[-1] + 400 :] = 1.0
        height_ref, speed_ref = flown.reference, np.zeros(flown.time_s.size)
    power = np.where(landed > 0.0, 0.0, flown.power_w)
    columns = (
        flown.time_s,
        flown.altitude_m,
        flown.speed_m_s,
        height_ref,
        speed_ref,
        power,
        landed,
    )
    rows = (
        "{:.1f},{:.3f},{:.3f},{:g},{:g},{:.2f},{:.0f}".format(*row)
        for row in zip(*columns, strict=False)
    )
    return "t,h,v,h_ref,v_ref,P,landed\n" + "\n".join(rows) + "\n"


@pytest.fixture(scope="module")
def identified(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, dict[str, dict[str, object]]]:
    """The folder with the model of two flights of each kind, and the report by state."""
    folder = tmp_path_factory.mktemp("experiment")
    generator = np.random.default_rng(20231)
    logs = []
    for number in range(FLIGHTS):
        for name, flown, is_vertical in (
            ("up", fly_vertically(generator), True),
            ("out", fly_horizontally(generator), False),
        ):
            path = folder / f"{name}{number}.csv"
            path.write_text(csv_text(flown, is_vertical=is_vertical), encoding="utf-8")
            logs.append(str(path))
    (folder / "map.toml").write_text(MAPPING, encoding="utf-8")
    options = ["--mapping", str(folder / "map.toml"), "--format", "json"]
    with pytest.MonkeyPatch.context() as patch:
        written: list[str] = []
        patch.setattr("planner.cli.identify.write_data", written.append)
        figures = ["--plots", str(folder / "figures")]
        assert main(["identify", *logs, "-o", str(folder / "quad.toml"), *options, *figures]) == 0
    document = json.loads(written[0])
    return folder, {state["name"]: state for state in document["states"]}


@pytest.mark.parametrize("name", TRUTH)
def test_every_response_comes_back_within_its_stated_errors(
    name: str, identified: tuple[Path, dict[str, dict[str, object]]]
) -> None:
    state = identified[1][name]
    assert state["status"] == "identified"
    estimates = state["estimates"]
    assert isinstance(estimates, list)
    found = {row["name"]: (row["value"], row["error"]) for row in estimates}
    truth = dict(TRUTH[name].figures)
    if name == "brake_power" and "b1" not in found:
        # a zero hidden by 5 W of noise acts as so much delay: b1 / |b0|
        truth["delay_s"] += 0.02583 / 0.3294
    for figure, value in truth.items():
        measured, error = found[figure]
        # 20 figures within 4 standard errors; an undamped pair ends at the bound of its damping
        assert abs(measured - value) < 4.0 * error + 0.004, figure


def test_the_file_holds_the_standard_error_of_every_coefficient(
    identified: tuple[Path, dict[str, dict[str, object]]],
) -> None:
    model = read_vehicle(identified[0] / "quad.toml")
    for name in TRUTH:
        response = getattr(model.responses, name)
        estimates = identified[1][name]["estimates"]
        assert isinstance(estimates, list)
        told = {row["name"]: row["error"] for row in estimates}
        of_denominator = response.denominator_standard_error
        assert of_denominator[0] == 0.0  # the leading one is not fitted
        for written, key in (
            (response.numerator_standard_error[-1], "b0"),
            (of_denominator[1], "a1"),
            (of_denominator[2], "a0"),
            (response.delay_standard_error_s, "delay_s"),
        ):
            assert written == pytest.approx(told[key], rel=0.005)  # three digits are written


def test_motion_comes_back_within_three_percent(
    identified: tuple[Path, dict[str, dict[str, object]]],
) -> None:
    model = read_vehicle(identified[0] / "quad.toml")
    for name, truth in (("altitude", G1), ("speed", G4)):
        response = getattr(model.responses, name)
        a1, a0 = response.denominator[1:]
        assert a0**0.5 == pytest.approx(truth.figures["natural_frequency_rad_s"], rel=0.03)
        assert 0.5 * a1 / a0**0.5 == pytest.approx(truth.figures["damping_ratio"], rel=0.03)
        assert response.delay_s == pytest.approx(truth.delay_s, rel=0.03)
        assert response.numerator[-1] / a0 == pytest.approx(truth.figures["steady_gain"], rel=0.03)


def test_hover_power_comes_back(identified: tuple[Path, dict[str, dict[str, object]]]) -> None:
    model = read_vehicle(identified[0] / "quad.toml")
    assert isinstance(model.hover, AltitudeLaw)
    assert model.hover.exponent == pytest.approx(HOVER_EXPONENT, abs=0.002)
    assert model.hover.coefficient_w == pytest.approx(HOVER_COEFFICIENT_W, rel=0.01)


def test_windows_end_with_one_damped_period(
    identified: tuple[Path, dict[str, dict[str, object]]],
) -> None:
    model = read_vehicle(identified[0] / "quad.toml")
    for name in ("climb_power", "descent_power", "brake_power"):
        # a period is known as well as the frequency: a few percent
        window_s = getattr(model.responses, name).window_s
        assert window_s == pytest.approx(TRUTH[name].window_s, rel=0.08)


def test_the_model_is_flown_with_what_was_commanded(
    identified: tuple[Path, dict[str, dict[str, object]]],
) -> None:
    model = read_vehicle(identified[0] / "quad.toml")
    assert model.reference == "step"
    assert model.default_speed_m_s == 10.0
    assert model.valid_for.altitude_step_m is not None
    assert model.valid_for.altitude_step_m.high == 100.0
    assert len(model.provenance.logs) == 2 * FLIGHTS
    assert model.battery is None


def test_segments_are_held_out_and_described(
    identified: tuple[Path, dict[str, dict[str, object]]],
) -> None:
    for name in ("altitude", "speed"):
        state = identified[1][name]
        assert isinstance(state["segments_held_out"], int)
        assert state["segments_held_out"] >= 2
        assert isinstance(state["fit_percent"], float)
        # noise of 0.3 m on steps of 100 m, of 0.2 m/s on 10 m/s: residuals of 2 % and less
        assert state["fit_percent"] > 90.0


def test_the_way_of_the_article_finds_its_models_and_is_warned_of() -> None:
    # 0.5 W of noise on the power: every response of the article from its two flights, ground and all
    generator = np.random.default_rng(5)
    up_down = record_of(fly_vertically(generator, noise=0.1), is_vertical=True)
    out_back = record_of(fly_horizontally(generator, noise=0.1), is_vertical=False)
    settings = IdentificationSettings(
        name="arx", date=dt.date(2026, 1, 1), version="0", method=Method.ARX
    )
    found = identify_vehicle([up_down, out_back], settings)
    [warning] = [f for f in found.findings if f.code == "I101"]
    assert "altitude" in warning.message
    # four steps up and four down, of which one begins and one ends on the ground
    used = {"altitude": 8, "climb_power": 4, "descent_power": 4, "speed": 4, "brake_power": 2}
    for name, manoeuvres in used.items():
        outcome = found.state(name)
        assert outcome.used == manoeuvres
        assert outcome.fit_percent is not None
        assert outcome.fit_percent >= 85.0
        # no error is claimed; the default stands beside it, with its own
        assert all(math.isnan(estimate.error) for estimate in outcome.estimates)
        assert outcome.refined is not None
        assert outcome.refined.fit_percent is not None
        assert outcome.refined.fit_percent >= 85.0
    text = identification_text(found, medium=Medium(), with_segments=False)
    assert text.count("ARX  output error") == 5
    assert found.state("altitude").estimates[3].name == "delay_s"
    # of 9,100 samples every one counts: every other one has no 2.9 s
    assert found.state("altitude").estimates[3].value == pytest.approx(2.9)


def test_a_stop_from_a_cruise_dearer_than_hover_keeps_its_energy() -> None:
    # 3 W for each m/s on top of hover: from 10 m/s on the power falls with the speed, to hover
    generator = np.random.default_rng(6)
    up_down = record_of(fly_vertically(generator), is_vertical=True)
    out_back = record_of(fly_horizontally(generator), is_vertical=False)
    random = np.random.default_rng(7)
    power_w = (
        132.85 + 3.0 * out_back.ground_speed_m_s + random.normal(0.0, 5.0, out_back.time_s.size)
    )
    settings = IdentificationSettings(name="dear", date=dt.date(2026, 1, 1), version="0")
    found = identify_vehicle([up_down, replace(out_back, power_w=power_w)], settings)
    assert found.model.responses.brake_power is None
    assert "+30 W more than hover" in found.state("brake_power").summary
    assert isinstance(found.model.cruise, CruisePower)
    # at half of the speed half of it: the stop costs 3 W/(m/s) times its length, as it was flown
    above_w = found.model.cruise.above_hover_w(np.array([10.0]))
    assert float(above_w[0]) == pytest.approx(30.0, abs=2.0)  # 5 W over 400 samples, hover alike


def test_every_state_is_drawn(identified: tuple[Path, dict[str, dict[str, object]]]) -> None:
    drawn = {path.stem for path in (identified[0] / "figures").glob("*.svg")}
    assert drawn >= {*TRUTH, "hover", "power_over_speed"}


@pytest.mark.parametrize(
    ("before", "idle_w"),
    [
        ([12.0] * 50, 12.0),  # 5 s of idle, of which the last two spool up
        ([12.0] * 10, 12.0),
        ([89.0, 150.0, 250.0, 374.0], 89.0),  # the log begins while it does: the least of it
    ],
)
def test_motors_that_spool_up_are_no_idle(before: list[float], idle_w: float) -> None:
    ramp = np.linspace(12.0, 350.0, 20).tolist() if len(before) > 4 else []
    ground, flown = np.array(before + ramp), np.full(600, 350.0)
    is_landed = np.repeat([True, False], [ground.size, flown.size])
    record = make_record(is_landed=is_landed, power_w=np.concatenate([ground, flown]))
    found = _loads([record])
    assert found is not None
    assert found.ground_idle_w == pytest.approx(idle_w)
    assert _loads([replace(record, is_landed=np.zeros(is_landed.size, np.bool_))]) is None
