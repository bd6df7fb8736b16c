"""``mavjoule verify`` over logs made by hand."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from dataflash_writer import copter_log

from planner.cli.main import main

MODEL = "arducopter-sitl-quad"


@pytest.fixture
def log() -> str:
    Path("flight.bin").write_bytes(copter_log().content())
    return "flight.bin"


@pytest.fixture
def mission(mission: str) -> str:
    """The mission of conftest from where the log was flown, not from a thousand kilometres away."""
    path = Path(mission)
    text = path.read_text(encoding="utf-8").replace("\t50.0", "\t47.0").replace("\t20.0", "\t8.0")
    path.write_text(text, encoding="utf-8")
    return mission


def test_a_log_is_compared_from_itself_alone(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", MODEL, log, "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == 1
    assert document["model"] == MODEL
    [flight] = document["flights"]
    assert flight["log"] == log
    for part in ("measured", "predicted"):
        assert set(flight[part]) == {"time_s", "energy_wh", "distance_m"}
    measured, predicted = flight["measured"], flight["predicted"]
    assert measured["time_s"] == pytest.approx(50.0)  # made_flight: armed 5 s to 55 s
    assert flight["error"]["time_fraction"] == pytest.approx(
        predicted["time_s"] / measured["time_s"] - 1.0
    )
    assert flight["error"]["energy_fraction"] == pytest.approx(
        predicted["energy_wh"] / measured["energy_wh"] - 1.0
    )
    assert {"state", "count", "fit_percent", "energy_fraction"} <= set(flight["states"][0])
    for stop in flight["stops"]:
        assert {"start_s", "speed_m_s", "measured_m", "predicted_m"} <= set(stop)


def test_a_mission_and_a_wind_given_take_the_place_of_the_logs(
    log: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["verify", MODEL, log, "--mission", mission, "--wind", "4@90", "--format", "json"]
    assert main(arguments) == 0
    [flight] = json.loads(capsys.readouterr().out)["flights"]
    assert flight["mission"] == mission
    assert flight["conditions"]["wind_m_s"] == 4.0
    # SQUARE of conftest goes 100 m up and 556 m out and back; the flight in the log is far shorter.
    assert flight["error"]["time_fraction"] > 1.0


def test_errors_above_a_threshold_exit_with_one_and_say_so(
    log: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", MODEL, log, "--mission", mission, "--fail-on-time", "5%"]) == 1
    assert main(["verify", MODEL, log, "--mission", mission, "--fail-on-energy", "10%"]) == 1
    told = capsys.readouterr().err
    assert f"mavjoule: {log}: error of time " in told
    assert "%, --fail-on-time 5%\n" in told
    assert f"mavjoule: {log}: error of energy " in told
    assert "%, --fail-on-energy 10%\n" in told


def test_the_text_names_the_errors_and_the_flights(
    log: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", MODEL, log, log]) == 0
    out = capsys.readouterr().out
    assert "Time" in out
    assert "median error" in out


def test_plots_are_drawn_into_a_folder(log: str) -> None:
    assert main(["verify", MODEL, log, "--plots", "drawn"]) == 0
    [path] = Path("drawn").iterdir()
    assert "Ground speed [m/s]" in path.read_text(encoding="utf-8")


def test_unusable_input_is_refused_in_a_sentence(
    log: str, broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", MODEL, "missing.bin"]) == 2
    assert main(["verify", MODEL, broken]) == 2
    assert main(["verify", "no-such-model", log]) == 2
    assert main(["verify", MODEL, log, "--mission", broken]) == 2
    assert main(["verify", MODEL, log, "--params", "missing.param"]) == 2
    assert main(["verify", "px4-sih-quad", log]) == 2
    err = capsys.readouterr().err
    assert "Traceback" not in err
    assert "this is a bug" not in err
    assert main(["verify", MODEL]) == 2


def test_leaving_one_out_needs_two_logs(log: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", MODEL, log, "--leave-one-out"]) == 2
    assert "two logs" in capsys.readouterr().err


def test_each_log_is_predicted_by_a_model_of_the_others(
    log: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("second.bin").write_bytes(copter_log().content())
    arguments = ["verify", MODEL, log, "second.bin", "--leave-one-out", "--format", "json"]
    assert main(arguments) == 0
    first, second = json.loads(capsys.readouterr().out)["flights"]
    assert (first["log"], second["log"]) == (log, "second.bin")
    # The same flight twice: the model of either predicts the other alike.
    assert first["predicted"] == second["predicted"]
    assert any(finding["code"].startswith("I") for finding in first["findings"])


def test_the_calibration_tells_how_often_flights_lie_in_their_intervals(
    log: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify", MODEL, log, "--calibration"]) == 2
    assert "two logs" in capsys.readouterr().err
    assert main(["verify", MODEL, log, log, "--calibration", "--plots", "drawn"]) == 0
    out = capsys.readouterr().out
    assert "Intervals from the model's own spread" in out
    assert "Intervals from the other flights" in out
    assert len(list(Path("drawn").iterdir())) == 2
    assert main(["verify", MODEL, log, log, "--calibration", "--format", "json"]) == 0
    _, others = json.loads(capsys.readouterr().out)["calibrations"]
    time = next(row for row in others["quantities"] if row["of"] == "time")
    assert time["count"] == 2
    assert time["inside"] == sum(one["is_inside"] for one in time["intervals"])
    assert all(
        (one["low"] <= one["error"] <= one["high"]) is one["is_inside"] for one in time["intervals"]
    )


def test_each_log_is_verified_with_what_a_table_says_of_it(
    log: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("other.bin").write_bytes(copter_log().content())
    Path("table.csv").write_text(
        "log,payload_g,temperature_c,mass_kg\nother.bin,500,30,3.5\nflight.bin,0,10,3.75\n",
        encoding="utf-8",
    )
    logs = ["verify", MODEL, log, "other.bin", "--format", "json"]
    assert main([*logs, "--table", "table.csv", "--payload", "1"]) == 0
    heavy, loaded = json.loads(capsys.readouterr().out)["flights"]
    for flight, payload_kg, temperature_c in ((heavy, 0.25, 10.0), (loaded, 0.5, 30.0)):
        # the model weighs 3.5 kg
        assert flight["conditions"]["payload_kg"] == pytest.approx(payload_kg)
        assert flight["conditions"]["temperature_c"] == temperature_c
    assert loaded["predicted"]["energy_wh"] > heavy["predicted"]["energy_wh"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("log,payload_kg\nother.bin,0.5\n", "no row for flight.bin"),
        ("log,mass_kg\nflight.bin,2\n", "2 kg are less than the 3.5 kg"),
    ],
)
def test_a_table_that_does_not_fit_the_logs_is_refused(
    log: str, text: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("table.csv").write_text(text, encoding="utf-8")
    assert main(["verify", MODEL, log, "--table", "table.csv"]) == 2
    assert message in capsys.readouterr().err
