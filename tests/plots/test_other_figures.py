"""Pictures beside those of a flight: the speed curve, verifications, identifications."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_missions import mission, rtl, takeoff, waypoint

import planner
from planner.identify.manoeuvres import Manoeuvre
from planner.identify.responses import ResponseEvidence
from planner.identify.segments import MeasuredPower
from planner.physics.rotor import Rotor, momentum_power_w
from planner.report import plots
from planner.values import field_values
from planner.vehicle.library import load_vehicle
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from pathlib import Path

    from planner.report.plots.picture_files import Chart

CURVE: Any = SimpleNamespace(
    speed_m_s=np.array([2.0, 4.0, 6.0]),
    energy_wh=np.array([30.0, 20.0, 25.0]),
    time_s=np.array([1200.0, 600.0, 420.0]),
    marks=lambda: [(name, SimpleNamespace(speed_m_s=4.0)) for name in ("best range", "as planned")],
)


def rows_of(figure: Chart, panel: int, layer: int) -> list[dict[str, Any]]:
    """Return the rows behind a layer of a panel of a chart."""
    chart = figure.to_dict()
    one = chart["vconcat"][panel] if "vconcat" in chart else chart
    one = one["layer"][layer] if "layer" in one else one
    data = one.get("data", chart.get("data"))
    rows: list[dict[str, Any]] = data.get("values") or chart["datasets"][data["name"]]
    return rows


def texts(figure: Chart, path: Path) -> str:
    plots.write_figure(figure, path)
    return path.read_text(encoding="utf-8")


def test_a_speed_curve_shows_energy_and_time_with_their_units(tmp_path: Path) -> None:
    figure = plots.speed_figure(CURVE)
    svg = texts(figure, tmp_path / "speed.svg")
    for text in ("Cruise speed [m/s]", "Energy [Wh]", "Time [min]", "best range, as planned"):
        assert text in svg
    energy = rows_of(figure, 0, 0)
    assert [row["energy_wh"] for row in energy] == [30.0, 20.0, 25.0]
    assert [row["time_min"] for row in energy] == [20.0, 10.0, 7.0]


def test_a_speed_curve_without_known_energy_shows_the_time_alone() -> None:
    unknown: Any = SimpleNamespace(**{**vars(CURVE), "energy_wh": np.full(3, np.nan)})
    [panel] = plots.speed_figure(unknown).to_dict()["vconcat"]
    assert "Time [min]" in json.dumps(panel)


def test_a_flight_and_its_prediction_are_drawn_over_each_other(tmp_path: Path) -> None:
    time_s = np.arange(10_000) * 0.1
    flown, foreseen = (
        SimpleNamespace(
            time_s=time_s,
            power_w=np.full(10_000, power_w),
            height_above_home_m=np.full(10_000, np.nan),
            ground_speed_m_s=time_s,
        )
        for power_w in (120.0, 125.0)
    )
    figure = plots.verification_figure(
        SimpleNamespace(flown=flown, foreseen=foreseen),  # type: ignore[arg-type]  # all it looks at
        title="log, energy +4.2 %",
    )
    rows = rows_of(figure, 0, 0)
    assert len(rows) <= 2 * 2_000
    assert {(row["flight"], row["power_w"]) for row in rows} == {
        ("flown", 120.0),
        ("predicted", 125.0),
    }
    assert {row["height_above_home_m"] for row in rows} == {None}
    assert max(row["time_s"] for row in rows) == 999.9
    svg = texts(figure, tmp_path / "flight.svg")
    titles = ("Power [W]", "Height above home [m]", "Ground speed [m/s]", "Time [s]", "+4.2 %")
    for text in titles:
        assert text in svg


@pytest.fixture(scope="module")
def found() -> SimpleNamespace:
    """What an identification of the article's vehicle might have found."""
    vehicle = load_vehicle("falkowski-2023-quadrotor")
    response = vehicle.responses.altitude
    assert response is not None
    time_s = np.linspace(0.0, 59.9, 600)
    step = Manoeuvre(
        time_s=time_s,
        reference=np.where(time_s < 5.0, 200.0, 300.0),
        answer=np.where(time_s < 20.0, 150.0, 250.0),
    )
    hovers = [
        MeasuredPower(
            power_w=120.0 + height, error_w=2.0, duration_s=30.0, height_above_home_m=height
        )
        for height in (100.0, 200.0)
    ]
    battery = SimpleNamespace(ocv_soc=(0.0, 1.0), ocv_v=(13.2, 16.8), ocv_error_v=(0.1, 0.1))
    evidence = SimpleNamespace(
        responses=(
            ResponseEvidence(
                name="altitude",
                manoeuvres=(step,),
                transfer_function=response.transfer_function,
                window_s=30.0,
            ),
        ),
        steady=(),
        hovers=hovers,
        battery=battery,
    )
    return SimpleNamespace(model=vehicle, evidence=evidence)


def drawn(found: SimpleNamespace) -> dict[str, Chart]:
    return plots.identification_figures(found)  # type: ignore[arg-type]  # all it looks at


def test_a_manoeuvre_is_drawn_from_its_command_beside_the_answer_of_the_model(
    found: SimpleNamespace, tmp_path: Path
) -> None:
    figure = drawn(found)["altitude"]
    rows = rows_of(figure, 0, 0)
    flown = {row["time_s"]: row["answer"] for row in rows if row["what"] == "flown"}
    model = {row["time_s"]: row["answer"] for row in rows if row["what"] == "model"}
    assert flown[-5.0] == 0.0
    assert flown[20.0] == 100.0  # 150 m before, 250 m from 15 s after the command on
    # The article's G1 answers a step of 100 m with 100 m: its steady gain is 1.
    assert model[50.0] == pytest.approx(100.0, rel=0.02)
    left = {row["time_s"]: row["answer"] for row in rows_of(figure, 1, 1)}
    assert left[20.0] == pytest.approx(100.0 - model[20.0], abs=2e-4)  # of rounding
    [band] = rows_of(figure, 1, 0)
    rms = float(np.sqrt(np.mean(np.square(list(left.values())))))
    assert (band["low"], band["high"]) == pytest.approx((-1.96 * rms, 1.96 * rms))
    svg = texts(figure, tmp_path / "altitude.svg")
    for text in ("Time after the command [s]", "Altitude above rest [m]", "end of the window"):
        assert text in svg


def test_hovers_are_drawn_with_their_errors_on_the_law(
    found: SimpleNamespace, tmp_path: Path
) -> None:
    figures = drawn(found)
    assert set(figures) == {"altitude", "hover", "battery"}
    points = rows_of(figures["hover"], 0, 0)
    assert [(row["x"], row["y"]) for row in points] == [(100.0, 220.0), (200.0, 320.0)]
    assert points[0]["high"] == pytest.approx(220.0 + 1.96 * 2.0)
    # the article's P(H) = 119.49 H^0.02, at 100 m and at 200 m
    left = [row["y"] for row in rows_of(figures["hover"], 1, 0)]
    assert left == pytest.approx([220.0 - 119.49 * 100.0**0.02, 320.0 - 119.49 * 200.0**0.02])
    assert "Height above home [m]" in texts(figures["hover"], tmp_path / "hover.svg")
    assert "Open-circuit voltage [V]" in texts(figures["battery"], tmp_path / "battery.svg")


def test_a_law_is_drawn_with_how_far_it_may_be_off_and_points_with_their_own_load() -> None:
    vehicle = load_vehicle("arducopter-sitl-quad")
    assert isinstance(vehicle.cruise, MomentumLaw)
    rotor, spread = Rotor(**field_values(vehicle.cruise)), vehicle.spread
    assert spread is not None
    # one light and one heavy, each on its own law: nothing is left of either
    steady = [
        MeasuredPower(
            power_w=float(momentum_power_w(v, 0.0, rotor, mass_kg=mass_kg, air_density_kg_m3=1.2)),
            error_w=1.0,
            duration_s=10.0,
            height_above_home_m=50.0,
            airspeed_m_s=v,
            mass_kg=mass_kg,
            air_density_kg_m3=1.2,
        )
        for v, mass_kg in ((0.0, 3.0), (10.0, 4.0))
    ]
    evidence = SimpleNamespace(responses=(), steady=steady, hovers=(), battery=None)
    figure = drawn(SimpleNamespace(model=vehicle, evidence=evidence))["power_over_speed"]
    assert [row["y"] for row in rows_of(figure, 1, 0)] == pytest.approx([0.0, 0.0], abs=1e-9)
    # hovering all that moves the power is its own factor: disk area is at the same hover
    hover = rows_of(figure, 0, 2)[0]
    deviation = dict(spread.law_fraction)["hover"]
    assert hover["high"] / hover["y"] - 1.0 == pytest.approx(1.96 * deviation, rel=0.001)


def test_the_speeds_worth_knowing_are_marked_on_a_curve(tmp_path: Path) -> None:
    made = mission(takeoff(50.0), waypoint(2000.0, 50.0), waypoint(0.0, 50.0), rtl())
    vehicle = planner.load_vehicle("arducopter-sitl-quad")
    curve = planner.predict_speed_curve(
        made, vehicle, from_m_s=4.0, step_m_s=4.0, battery=planner.Battery(capacity_wh=100.0)
    )
    figure = plots.speed_figure(curve)
    svg = texts(figure, tmp_path / "speed.svg")
    names = [name for name, _ in curve.marks()]
    assert {"present", "best endurance", "best range", "fastest that fits"} <= {
        name.removesuffix(" (edge)") for name in names
    }
    assert all(name in svg for name in names)
    layers = len(figure.to_dict()["vconcat"][0]["layer"])
    rules = {row["speed_m_s"] for n in range(1, layers) for row in rows_of(figure, 0, n)}
    assert rules == {round(flown.speed_m_s or 0.0, 3) for _, flown in curve.marks()}
