"""``mavjoule sweep``."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from planner.cli.main import main
from planner.errors import ExitCode

ARGUMENTS = (
    *("--battery", "12Wh", "--vary", "wind=0,4", "--vary", "wind-from=0"),
    *("--vary", "charge=100%,50%"),
)


def test_a_sweep_answers_and_writes_a_row_for_each_case(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", mission, *ARGUMENTS, "-o", "out.csv"]) == ExitCode.GO
    out, err = capsys.readouterr()
    # 6.8 Wh are needed; 9.6 Wh are above the reserve with a full battery, 3.6 Wh with half of it.
    # The wind is not counted by this model: with 4 m/s there may be less than 2.8 Wh left.
    assert out.startswith("GO in 1 of 4 cases (25 %)\n")
    assert "charge: no value is a GO in every case; in the best case only at 1\n" in out
    assert "4 rows written to out.csv" in err
    rows = list(csv.DictReader(Path("out.csv").read_text(encoding="utf-8").splitlines()))
    assert [(row["wind_m_s"], row["charge"], row["verdict"]) for row in rows] == [
        ("0.0", "1.0", "go"),
        ("0.0", "0.5", "no-go"),
        ("4.0", "1.0", "no-go"),
        ("4.0", "0.5", "no-go"),
    ]
    assert rows[1]["breaks_first"] == "E102", "the return is what is short first"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--vary", "wnid=3"], "no setting of a check has this name"),
        ([], "nothing varies: give --vary"),
        (["--vary", "wind=1,2", "-o", "a.xlsx"], "is written to a .parquet or .csv file"),
        (["--weather", "none.csv"], "none.csv: cannot be read"),
        (["--vary", "wind=3"], "--vary wind has a wind, and nothing says where it blows from"),
        (["--vary", "mission=none.plan"], "none.plan: no such file"),
        (
            ["--vary", "payload=1,2", "-o", "folder.csv"],
            "folder.csv: cannot be written: Is a directory",
        ),
        (
            ["--vary", "payload=1,2", "-o", "a.csv", "--report", "./a.csv"],
            "--output and --report name the same file",
        ),
    ],
)
def test_what_cannot_be_swept_is_refused_in_one_sentence(
    mission: str, arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("folder.csv").mkdir()
    assert main(["sweep", mission, *arguments]) == ExitCode.UNUSABLE
    out, err = capsys.readouterr()
    assert out == ""
    assert sentence in err
    assert err.count("\n") == 1


def test_a_mission_that_cannot_be_read_is_refused(broken: str) -> None:
    assert main(["sweep", broken, *ARGUMENTS]) == ExitCode.UNUSABLE


@pytest.mark.parametrize(
    ("head", "times"),
    [
        ("time,", ("a,", "b,")),
        ("time,", ("01.06.2025 12:00,", "2025-06-01T13:00,")),
        ("time,", ("1717243200,", "1717246800,")),
        ("", ("", "")),
    ],
)
def test_weather_without_iso_times_is_swept_and_not_counted_by_month(
    mission: str, head: str, times: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [f"{head}wind [m/s],wind direction [deg]", f"{times[0]}0,90", f"{times[1]}4,90"]
    Path("weather.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    arguments = ["sweep", mission, "--battery", "12Wh", "--weather", "weather.csv"]
    assert main([*arguments, "-o", "out.csv"]) == ExitCode.GO
    out, err = capsys.readouterr()
    assert " of 2 " in out
    assert "weather.csv: times are not all ISO 8601" in err
    assert len(Path("out.csv").read_text(encoding="utf-8").splitlines()) == 3


def test_missions_vary_by_name(mission: str, capsys: pytest.CaptureFixture[str]) -> None:
    other = Path("other.plan")
    other.write_bytes(Path(mission).read_bytes())
    given = ["sweep", mission, "--battery", "12Wh", "--vary", f"mission={mission},other.plan"]
    assert main(given) == ExitCode.GO
    assert " of 2 cases" in capsys.readouterr().out


def test_settings_that_came_with_missions_are_named(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mavjoule.toml").write_text('battery = "12Wh"\nrisk = 0.3\n', encoding="utf-8")
    other = Path("site", "other.plan")
    other.parent.mkdir()
    other.write_bytes(Path(mission).read_bytes())
    given = ["sweep", mission, "--vary", f"mission={mission},{other}"]
    assert main(given) == ExitCode.GO
    assert "settings from mavjoule.toml: battery 12Wh, risk 30%\n" in capsys.readouterr().out
    Path("site", "mavjoule.toml").write_text('battery = "12Wh"\nrisk = 0.3\n', encoding="utf-8")
    varied = ["sweep", mission, "--vary", "battery=12Wh,77Wh"]
    assert main(varied) == ExitCode.GO
    assert "settings from mavjoule.toml: risk 30%\n" in capsys.readouterr().out
    assert main([*given, "--risk", "5%"]) == ExitCode.GO
    both = f"settings from mavjoule.toml, {Path('site', 'mavjoule.toml')}: battery 12Wh\n"
    assert both in capsys.readouterr().out


def test_what_was_done_of_another_sweep_is_put_aside_and_named_before_anything_is_done(
    mission: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    call = ["sweep", mission, *ARGUMENTS, "-o", "out.csv"]
    parts, aside = Path("out.csv.parts"), Path("out.csv.parts.1")
    with monkeypatch.context() as patch:
        patch.setattr("planner.cli.sweep._narrate_before", stop)  # all is checked, nothing written
        assert main(call) == ExitCode.INTERRUPTED
    done = {path.name: path.read_bytes() for path in parts.iterdir()}
    assert len(done) > 1
    capsys.readouterr()
    other = [*call[:-2], "--vary", "payload=0,0.1", "-o", "out.csv"]
    with monkeypatch.context() as patch:
        patch.setattr("planner.service.sweep.engines.CoresEngine.run", stop)
        assert main(other) == ExitCode.INTERRUPTED
    assert (
        "what varies changed since this sweep was broken off: begun anew; what was done is in "
        "out.csv.parts.1: as out.csv.parts it goes on"
    ) in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in aside.iterdir()} == done
    assert main(other) == ExitCode.GO
    assert not parts.exists()
    aside.rename(parts)
    capsys.readouterr()
    assert main(call) == ExitCode.GO
    assert "4 cases of before" in capsys.readouterr().err
