"""``mavjoule vehicle``: two commands from a data sheet to a verdict."""

from __future__ import annotations

import io
import json
import sys
from typing import TYPE_CHECKING

import pytest
from dataflash_writer import copter_log

from planner import quantity
from planner.cli.main import main
from planner.errors import ExitCode
from planner.report.endurance import endurance_text
from planner.report.plots import endurance_figures
from planner.report.text import Medium
from planner.service.endurance import predict_endurance
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from pathlib import Path

_FLOWN = ["--mass", "2kg", "--propeller", "13in"]
"""Of the made flight: 160 W are little for 2 kg."""
_SHEET = ["--mass", "1.6kg", "--battery", "4S5200", "--rotors", "4", "--propeller", "10in"]


def test_two_commands_lead_from_a_data_sheet_to_a_verdict(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["vehicle", "new", "-o", "mine.toml", *_SHEET, "--hover", "18A"]) == ExitCode.GO
    shown = capsys.readouterr()
    assert "hover        1" in shown.out
    assert "Assumed" in shown.out
    assert "--vehicle mine.toml" in shown.err
    assert main(["check", mission, "--vehicle", "mine.toml"]) == ExitCode.GO
    assert "GO" in capsys.readouterr().out


def test_a_battery_of_other_cells_in_a_settings_file_is_named_with_the_file(
    mission: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    sheet = [*_SHEET, "--battery", "3S5000"]
    assert main(["vehicle", "new", "-o", "mine.toml", *sheet]) == ExitCode.GO
    (tmp_path / "mavjoule.toml").write_text('battery = "5.2Ah@14.8V"\n', encoding="utf-8")
    capsys.readouterr()
    assert main(["check", mission, "--vehicle", "mine.toml"]) == ExitCode.NO_GO
    out = capsys.readouterr().out
    assert "battery of 14.8 V from " in out
    assert "goes before " in out
    assert main(["check", mission, "--vehicle", "mine.toml", "--battery", "3S5000"]) == ExitCode.GO


@pytest.mark.parametrize(
    ("own", "is_told"), [("4S4200", False), ("4S4100", True)], ids=["1.24 times", "1.27 times"]
)
def test_a_larger_battery_in_a_settings_file_is_warned_of(
    own: str, mission: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, *, is_told: bool
) -> None:
    # the samples' settings have 5.2 Ah, and a racer of 1.3 Ah was a go on four times its battery
    assert main(["vehicle", "new", "-o", "mine.toml", *_SHEET, "--battery", own]) == ExitCode.GO
    (tmp_path / "mavjoule.toml").write_text('battery = "5.2Ah@14.8V"\n', encoding="utf-8")
    capsys.readouterr()
    main(["check", mission, "--vehicle", "mine.toml", "--format", "json"])
    [checked] = json.loads(capsys.readouterr().out)["missions"]
    told = [one for one in checked["findings"] if one["code"] == "E125"]
    warned = [one["message"] for one in told if one["severity"] == "warning"]
    assert bool(warned) is is_told
    assert all("battery of 77.0 Wh from " in one and "that of mine has" in one for one in warned)


def test_the_ceiling_of_the_maker_bounds_the_air_it_flies_in() -> None:
    assert main(["vehicle", "new", "-o", "mine.toml", *_SHEET, "--ceiling", "3000"]) == ExitCode.GO
    air = load_vehicle("mine.toml").valid_for.air_density_kg_m3
    assert air is not None
    assert air.low == pytest.approx(0.909, abs=5e-4)  # the standard atmosphere's table at 3000 m


def test_a_model_is_not_written_over(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["vehicle", "new", "-o", "mine.toml", *_SHEET]) == ExitCode.GO
    before = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    assert main(["vehicle", "new", "-o", "mine.toml", "--battery", "6S9000"]) == ExitCode.UNUSABLE
    assert "exists already" in capsys.readouterr().err
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == before


def test_without_a_terminal_nothing_is_asked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "new", "-o", "mine.toml"]) == ExitCode.UNUSABLE
    assert "give --mass, --battery" in capsys.readouterr().err


def test_on_a_terminal_what_cannot_fly_is_asked_again_with_the_answers_kept(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    # 16 kg on four propellers of 10 in: corrected to 1.6 kg, everything else kept, the hover skipped
    typed = ["16kg", "4S5200", "four", "4", "10x4.5", "", "", "1.6kg", "", "", "", "", ""]
    monkeypatch.setattr(sys, "stdin", Terminal("\n".join(typed) + "\n"))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(["vehicle", "new", "-o", "mine.toml"]) == ExitCode.GO
    told = capsys.readouterr().err
    assert "expected 3 to 16 rotors" in told
    assert "774 N for each m²" in told
    vehicle = load_vehicle("mine.toml")
    assert vehicle.mass_kg == 1.6
    assert vehicle.battery is not None
    assert vehicle.battery.cells_in_series == 4


def test_a_model_is_shown_with_what_it_can_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vehicle", "show", "arducopter-sitl-quad", "--format", "json"]) == ExitCode.GO
    document = json.loads(capsys.readouterr().out)
    hover, *_ = document["speeds"]
    # down to 20 % of the charge; the upper part of it has the higher voltage, some is lost as heat
    taken_wh = hover["endurance_s"] * hover["power_w"] / 3600.0
    assert 0.75 * document["battery_wh"] < taken_wh < 0.85 * document["battery_wh"]
    assert document["farthest"]["speed_m_s"] > document["longest"]["speed_m_s"] > 0.0


def test_a_payload_shortens_the_hover(capsys: pytest.CaptureFixture[str]) -> None:
    times = []
    for payload in ("0", "0.5"):
        main(["vehicle", "show", "arducopter-sitl-quad", "--payload", payload, "--format", "json"])
        times.append(json.loads(capsys.readouterr().out)["speeds"][0]["endurance_s"])
    # more than in proportion to the mass: (4.0 / 3.5) ** 1.5 of the motors' power
    assert times[1] < times[0] * (3.5 / 4.0)


def test_the_hover_is_told_over_the_payload(capsys: pytest.CaptureFixture[str]) -> None:
    main(["vehicle", "new", "-o", "mine.toml", *_SHEET, "--hover", "260W"])
    capsys.readouterr()
    assert main(["vehicle", "show", "mine.toml", "--format", "json"]) == ExitCode.GO
    first, *_, last = json.loads(capsys.readouterr().out)["loads"]
    # from 1.6 kg to 1.33 times that, in three digits, which nearly all multicopters lift; P = 6 W + c m^1.5
    assert (first["payload_kg"], last["payload_kg"]) == (0.0, pytest.approx(0.54))
    assert last["power_w"] - 6.0 == pytest.approx(
        (first["power_w"] - 6.0) * (2.14 / 1.6) ** 1.5, rel=1e-3
    )
    assert last["endurance_s"] < first["endurance_s"] / (2.14 / 1.6) ** 1.4


def test_a_terminal_shows_range_and_hover_as_bars() -> None:
    vehicle = load_vehicle("arducopter-sitl-quad")
    shown = predict_endurance(vehicle)
    rows = endurance_text(shown, medium=Medium(width=80)).splitlines()
    barred = [row for row in rows if "\u2588" in row]
    farthest = max(barred, key=lambda row: row.count("\u2588"))
    assert shown.farthest is not None
    assert quantity.distance(shown.farthest.range_m) in farthest
    assert max(map(len, rows)) <= 80
    # neither a pipe nor a narrow terminal has room for them
    assert "\u2588" not in endurance_text(shown, medium=Medium())
    assert "\u2588" not in endurance_text(shown, medium=Medium(width=50))


def test_range_and_hover_are_drawn_where_they_are_known() -> None:
    shown = predict_endurance(load_vehicle("arducopter-sitl-quad"))
    drawn = endurance_figures(replace(shown, loads=()))
    assert list(drawn) == ["range"]
    [rows] = drawn["range"].to_dict()["datasets"].values()
    assert [row["x"] for row in rows] == [one.speed_m_s for one in shown.speeds]
    assert shown.farthest is not None
    assert shown.farthest.range_m is not None
    assert max(row["y"] for row in rows) >= 1e-3 * shown.farthest.range_m
    unknown = replace(shown, speeds=(), loads=())
    assert endurance_figures(unknown) == {}


def test_a_log_narrows_the_model_in_place(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    main(["vehicle", "new", "-o", "mine.toml", *_SHEET, *_FLOWN])
    before = load_vehicle("mine.toml").spread
    assert main(["vehicle", "refine", "mine.toml", "flight.bin"]) == ExitCode.GO
    told = capsys.readouterr().out
    assert "changed by" in told
    # it draws 160 W at any speed and climb rate, which no rotor does
    assert "times as wide" in told
    assert "Energy, standard deviations now: hover " in told
    # what level flight saves is not shown by a flight at 5 m/s alone
    off = {name: float(told.split(f"{name} ")[-1].split(" %")[0]) for name in ("hover", "level")}
    assert off["level"] > off["hover"]
    after = load_vehicle("mine.toml").spread
    assert before is not None
    assert after is not None
    assert (after.energy_fraction or 1.0) < 0.9 * (before.energy_fraction or 0.0)


def test_what_a_log_told_is_there_for_programs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    main(["vehicle", "new", "-o", "mine.toml", *_SHEET, *_FLOWN])
    capsys.readouterr()
    asked = ["vehicle", "refine", "mine.toml", "flight.bin", "--format", "json"]
    assert main(asked) == ExitCode.GO
    told = json.loads(capsys.readouterr().out)
    after = load_vehicle("mine.toml").spread
    assert after is not None
    assert told["schema"] == 1
    assert told["n_flights"] == 1
    assert {one["name"]: one["after_fraction"] for one in told["factors"]} == pytest.approx(
        dict(after.law_fraction), rel=0.01
    )
    assert {one["code"] for one in told["findings"]} == {"I110", "I115"}  # made to fly one way
    assert told["birge_ratio"] > 1.0
    assert {one["power_w"] for one in told["steady"]} == {160.0}


def test_a_payload_of_a_log_that_is_not_given_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    main(["vehicle", "new", "-o", "mine.toml", *_SHEET])
    asked = ["vehicle", "refine", "mine.toml", "flight.bin", "--payload", "fligth.bin=0.25kg"]
    assert main(asked) == ExitCode.UNUSABLE
    assert "did you mean flight.bin" in capsys.readouterr().err


def test_a_shipped_model_is_narrowed_into_a_file_of_ones_own(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["vehicle", "refine", "holybro-x500-v2", "flight.bin"]) == ExitCode.UNUSABLE
    assert "holybro-x500-v2 is a shipped model: name the file" in capsys.readouterr().err


def _refined(*asked: str) -> tuple[float, float]:
    """Return the mean and deviation that the made flight gives the hover, by what is said of its log."""
    main(["vehicle", "new", "-o", "mine.toml", "--force", *_SHEET, *_FLOWN])
    assert main(["vehicle", "refine", "mine.toml", "flight.bin", *asked]) == ExitCode.GO
    model = load_vehicle("mine.toml")
    assert isinstance(model.cruise, MomentumLaw)
    return model.cruise.induced_factor, model.cruise.profile_factor


def test_mass_and_payload_of_a_log_are_said_alike_by_option_and_by_table(tmp_path: Path) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    (tmp_path / "logs.csv").write_text("log,payload_g,temperature_f\nflight.bin,200,50\n")
    of_table = _refined("--table", "logs.csv")
    of_log = ("--payload", "flight.bin=200g", "--temperature", "flight.bin=10")
    assert _refined(*of_log) == of_table
    assert _refined("--payload", "0.2", "--temperature", "10") == of_table
    assert _refined("--mass", "flight.bin=2.2kg", "--temperature", "10") == of_table
    # the same power carries a tenth more: less of it for each kg
    assert of_table[0] < _refined("--temperature", "10")[0]


def test_identify_with_a_data_sheet_as_base_narrows_it_as_refine_does(tmp_path: Path) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    narrowed = _refined()
    main(["vehicle", "new", "-o", "sheet.toml", *_SHEET, *_FLOWN])
    asked = ["identify", "flight.bin", "--base", "sheet.toml", "-o", "found.toml"]
    assert main(asked) == ExitCode.GO
    found, refined = load_vehicle("found.toml"), load_vehicle("mine.toml")
    assert isinstance(found.cruise, MomentumLaw)
    assert (found.cruise.induced_factor, found.cruise.profile_factor) == narrowed
    assert found.spread is not None
    assert refined.spread is not None
    assert found.spread.law_fraction == refined.spread.law_fraction
    assert found.spread.energy_fraction == refined.spread.energy_fraction
    # and goes on being narrowed, by other flights alone
    assert main(["vehicle", "refine", "found.toml", "flight.bin"]) == ExitCode.UNUSABLE


def test_a_payload_said_twice_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    main(["vehicle", "new", "-o", "mine.toml", *_SHEET])
    asked = ["vehicle", "refine", "mine.toml", "flight.bin", "--payload", "0.2", "--payload", "0.3"]
    assert main(asked) == ExitCode.UNUSABLE
    assert "--payload is given twice for all logs" in capsys.readouterr().err


def test_a_payload_that_the_propellers_cannot_carry_on_the_power_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "flight.bin").write_bytes(copter_log().content())
    main(["vehicle", "new", "-o", "mine.toml", *_SHEET, "--mass", "2kg"])
    before = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    asked = ["vehicle", "refine", "mine.toml", "flight.bin", "--payload", "0.5"]
    # 2.5 kg on 0.203 m2 of disk: 24.5 N x 7.03 m/s = 172 W, the log has 160 W with the avionics
    assert main(asked) == ExitCode.UNUSABLE
    assert "need without any loss" in capsys.readouterr().err
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == before
