"""``mavjoule identify``: logs in, a model out, and a sentence for everything that stands in the way."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from dataflash_writer import copter_log
from ulog_writer import px4_log

from planner.cli.main import main
from planner.vehicle.reader import read_vehicle

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def copter(tmp_path: Path) -> str:
    """A flight of ArduPilot: up 20 m, 5 m/s north and back down, by its name."""
    (tmp_path / "copter.BIN").write_bytes(copter_log().content())
    return "copter.BIN"


def test_a_model_is_written_and_the_strict_reader_reads_it(
    copter: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", copter, "-o", "quad.toml", "--mass", "2"]) == 0
    out, err = capsys.readouterr()
    model = read_vehicle(tmp_path / "quad.toml")
    assert model.name == "quad"
    assert model.reference == "ardupilot"
    assert model.mass_kg == 2.0
    assert dict(model.parameters) == {"WPNAV_SPEED": 500.0}
    assert model.provenance.logs == ("copter.BIN",)
    assert "quad" in out
    assert "reading copter.BIN" in err
    assert "the model is in quad.toml" in err


def test_json_tells_every_state_with_its_segments(
    copter: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", copter, "--mass", "2", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == 1
    assert document["model"]["file"] is None
    by_name = {state["name"]: state for state in document["states"]}
    assert {"altitude", "speed", "battery"} <= by_name.keys()
    assert by_name["battery"]["status"] == "left-out"
    assert "--capacity" in by_name["battery"]["said"]
    assert any(finding["code"] == "I102" for finding in document["findings"])


def test_a_log_without_a_current_sensor_gives_motion_only_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p.ulg").write_bytes(px4_log(current_a=0.05).content())
    assert main(["identify", "p.ulg", "-o", "p.toml"]) == 0
    model = read_vehicle(tmp_path / "p.toml")
    assert not model.is_power_known
    out = capsys.readouterr().out
    assert "no current sensor" in out
    assert "I105 mass-unknown" in out


def test_the_base_model_gives_what_the_flights_do_not_tell(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "c.BIN").write_bytes(copter_log(current_a=0.05).content())
    assert main(["identify", "c.BIN", "-o", "c.toml", "--base", "arducopter-sitl-quad"]) == 0
    model = read_vehicle(tmp_path / "c.toml")
    assert model.is_power_known
    assert model.battery is not None
    assert "I103 state-of-base" in capsys.readouterr().out


def test_a_log_is_listed_with_what_each_quantity_costs(
    copter: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", "--list", copter]) == 0
    out = capsys.readouterr().out
    assert "BAT.Volt × Curr" in out
    assert "calm air is assumed" in out
    assert main(["identify", "--list", copter, "--format", "json"]) == 0
    flights = json.loads(capsys.readouterr().out)["flights"]
    assert {row["name"] for row in flights[0]["quantities"]} >= {"power_w", "airspeed_m_s"}


def test_columns_are_read_by_a_mapping(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = ["t,h"] + [f"{i / 10},{min(i / 10, 20 - i / 10)}" for i in range(201)]
    (tmp_path / "l.csv").write_text("\n".join(rows), encoding="utf-8")
    (tmp_path / "m.toml").write_text(
        'schema = 1\n[columns]\ntime_s = { column = "t" }\nheight_above_home_m = { column = "h" }\n',
        encoding="utf-8",
    )
    assert main(["identify", "--list", "l.csv", "--mapping", "m.toml"]) == 0
    assert "height_above_home_m" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nothing.BIN", "-o", "x.toml"], "nothing.BIN: cannot be read"),
        (["garbage.BIN", "-o", "x.toml"], "garbage.BIN: is not a known kind of log"),
        (["copter.BIN", "-o", "x.json"], "ends in .toml"),
        (["copter.BIN", "-o", "x.toml", "--name", "y"], "belongs in y.toml"),
        (["copter.BIN", "-o", "x.toml", "--chemistry", "lead"], "--chemistry must be one of"),
        (["copter.BIN", "-o", "x.toml", "--chemistry", "lipo"], "needs --cells"),
        (["copter.BIN", "-o", "x.toml", "--base", "px4-sih-quad"], "cannot be their base model"),
        (["copter.BIN", "-o", "nowhere/x.toml"], "cannot be written"),
        (["copter.BIN", "-o", "x.toml", "--mass", "0"], "--mass"),
        (["copter.BIN", "p.ulg", "-o", "x.toml"], "different autopilots"),
        (
            ["copter.BIN", "-o", "x.toml", "--autopilot", "step"],
            "do not show how the vehicle moves",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(
    arguments: list[str],
    sentence: str,
    copter: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert copter in arguments or arguments[0] != copter
    (tmp_path / "garbage.BIN").write_bytes(bytes(range(256)) * 8)
    (tmp_path / "p.ulg").write_bytes(px4_log().content())
    assert main(["identify", *arguments]) == 2
    err = capsys.readouterr().err
    assert sentence in err
    assert "bug in mavjoule" not in err
    assert not (tmp_path / "x.toml").exists()


def test_several_flights_of_one_log_are_all_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = copter_log(boot_s=0.0)
    log = copter_log(boot_s=100.0, writer=log)
    (tmp_path / "two.BIN").write_bytes(log.content())
    assert main(["identify", "two.BIN", "-o", "two.toml", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [flight["number"] for flight in document["flights"]] == [1, 2]
    assert len(read_vehicle(tmp_path / "two.toml").provenance.logs) == 1


def test_a_table_says_what_flew_and_a_made_file_can_be_made_again(
    copter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "logs.csv").write_text("log,payload_g,mass_kg\ncopter.BIN,500,2\n")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")  # 14 November 2023
    asked = ["identify", copter, "--table", "logs.csv", "-o", "quad.toml"]
    assert main(asked) == 0
    first = (tmp_path / "quad.toml").read_bytes()
    model = read_vehicle(tmp_path / "quad.toml")
    assert model.mass_kg == 2.0
    assert model.valid_for.mass_kg is not None
    assert (model.valid_for.mass_kg.low, model.valid_for.mass_kg.high) == (2.0, 2.5)
    assert model.provenance.date.isoformat() == "2023-11-14"
    assert main(asked) == 0
    assert (tmp_path / "quad.toml").read_bytes() == first
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    capsys.readouterr()
    assert main(asked) == 2
    assert "SOURCE_DATE_EPOCH must be seconds since 1970" in capsys.readouterr().err
