"""``mavjoule fleet simulate``: exit codes, documents, and what it says."""

from __future__ import annotations

import csv
import json
import signal
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from made_swarm import MODEL, formation, search

from planner.cli.main import main

if TYPE_CHECKING:
    from collections.abc import Callable

SHIPPED = Path(__file__).parents[2] / "missions" / "fleets"


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n" + formation(20.0), encoding="utf-8")
    return file


def test_a_swarm_that_comes_home_apart_is_clear(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "trace.csv"
    assert main(["fleet", "simulate", str(fleet), "--trace", str(trace), "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["is_clear"] is True
    assert [one["name"] for one in document["agents"]] == ["a", "b"]
    assert [one["code"] for one in document["findings"]] == ["S133"]
    rows = list(csv.DictReader(trace.read_text(encoding="utf-8").splitlines()))
    assert {row["agent"] for row in rows} == {"a", "b"}
    assert {row["phase"] for row in rows} >= {"climbs", "flies", "lands"}


def test_a_swarm_that_meets_is_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n" + formation(12.0), encoding="utf-8")
    assert main(["fleet", "simulate", str(file), "--policy", "none"]) == 1
    told = capsys.readouterr().out
    assert told.startswith("NOT CLEAR")
    assert "S128" in told


def test_sorties_are_counted_beside_the_vehicles_of_the_file(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["fleet", "simulate", str(SHIPPED / "survey-two-quads.toml")]) == 0
    said = capsys.readouterr().out
    assert "5 sorties on 2 vehicles: missions" in said
    assert "\nfalkowski-2023-quadrotor, battery 77.0 Wh, wind 3.0 m/s from 270°\n" in said


def test_a_fleet_without_swarm_and_sorties_is_told_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = formation(20.0)
    begin = text.index("[swarm]")
    end = text.index("[swap]")
    job = '[job.j]\nmission = "m.plan"\n'
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n" + text[:begin] + job + text[end:], encoding="utf-8")
    assert main(["fleet", "simulate", str(file)]) == 2
    assert "no table [swarm]" in capsys.readouterr().err


def test_numbers_of_agents_are_compared(fleet: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call = [
        "fleet",
        "simulate",
        str(fleet),
        "--policy",
        "none",
        "--agents",
        "1:2",
        "--workers",
        "1",
    ]
    assert main([*call, "--deadline", "1000"]) == 0
    assert capsys.readouterr().out.startswith(
        "Fewest home by 16:40: 1 agent; least energy: 1 agent, "
    )
    assert main([*call, "--deadline", "10", "--format", "json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert [row["marks"] for row in document["rows"]] == [["too late"], ["too late"]]
    assert [one["code"] for one in document["findings"] if one["severity"] == "error"] == ["S139"]
    for wrong in ("3", "2:1", "1:x", "0"):
        assert main(["fleet", "simulate", str(fleet), "--agents", wrong]) == 2


def test_who_interrupts_a_simulation_gets_what_there_is(
    fleet: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(text: str) -> None:
        if text.startswith("10 s"):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("planner.cli.fleet.narrate_seldom", lambda: stop)
    assert main(["fleet", "simulate", str(fleet)]) == 130
    told = capsys.readouterr().out
    assert told.startswith("NOT CLEAR")
    assert "(cut short)" in told


def test_who_interrupts_it_before_the_first_step_or_while_it_is_written_loses_nothing(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace = tmp_path / "trace.csv"
    call = ["fleet", "simulate", str(fleet), "--policy", "none", "--trace", str(trace)]
    rows = []
    for module, name in (
        ("planner.service.swarm", "simulate_fleet"),
        ("planner.report.swarm", "swarm_text"),
    ):
        made: Callable[..., object] = getattr(import_module(module), name)

        def interrupted(
            *values: object, made: Callable[..., object] = made, **named: object
        ) -> object:
            signal.raise_signal(signal.SIGINT)
            return made(*values, **named)

        with monkeypatch.context() as patch:
            patch.setattr(f"{module}.{name}", interrupted)
            assert main(call) == 130
        rows.append(len(trace.read_text(encoding="utf-8").splitlines()))
    assert 2 <= rows[0] < rows[1]


def test_a_parquet_trace_holds_the_columns_of_the_csv_or_says_what_it_needs(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["fleet", "simulate", str(fleet), "--policy", "none", "--until", "30", "--trace"]
    trace = tmp_path / "trace.parquet"
    if find_spec("pyarrow") is None:
        assert main([*call, str(trace)]) == 2
        assert "pip install 'mavjoule[parquet]'" in capsys.readouterr().err
        assert not trace.exists()
        return
    from pyarrow.parquet import read_table

    assert main([*call, str(trace)]) == 1
    assert main([*call, str(trace.with_suffix(".csv"))]) == 1
    rows = list(csv.DictReader(trace.with_suffix(".csv").read_text(encoding="utf-8").splitlines()))
    table = read_table(trace).to_pylist()
    assert len(table) == len(rows)
    for found, row in zip(table, rows, strict=True):
        assert {key: "" if value is None else str(value) for key, value in found.items()} == row


def test_faults_of_the_file_are_chosen_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "fleet.toml"
    fault = '[fault.gps]\nkind = "loses-position"\nvehicle = "b"\ndrift_m_s = 0.2\n'
    file.write_text("schema = 1\n" + formation(20.0) + fault, encoding="utf-8")
    call = ["fleet", "simulate", str(file), "--policy", "none"]
    assert main(call) == 1
    assert "Faults:" in capsys.readouterr().out
    assert main([*call, "--faults", "none"]) == 0
    assert "Faults:" not in capsys.readouterr().out
    assert main([*call, "--faults", "gpd"]) == 2
    assert "has no [fault.gpd]" in capsys.readouterr().err


def test_findings_are_selected_and_weighed_as_in_a_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "fleet.toml"
    narrow = search(agents=1, more="sensor_radius_m = 2\n")  # lanes of 20 m leave most unseen
    file.write_text("schema = 1\n" + narrow, encoding="utf-8")
    page = tmp_path / "page.html"
    call = ["fleet", "simulate", str(file), "--policy", "none"]
    assert main(call) == 0
    assert "S137" in capsys.readouterr().out
    assert main([*call, "--fail-on", "warning"]) == 1
    assert capsys.readouterr().out.startswith("NOT CLEAR")
    assert main([*call, "--fail-on", "warning", "--ignore", "S137", "--report", str(page)]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"CLEAR  {file} (1 warning suppressed)\n")
    assert "S137" not in told
    assert "Not reported, as asked: 1 warning." in told
    text = page.read_text(encoding="utf-8")
    assert "ignored as S137" in text
    assert "<strong>(1 warning suppressed)</strong>" in text
    assert main([*call, "--select", "S133", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [one["code"] for one in document["findings"]] == ["S133"]
    assert [one["suppression"] for one in document["suppressed"]] == [
        "not among the selected codes S133"
    ]
    assert main([*call, "--select", "S133", "--extend-select", "S137", "--fail-on", "warning"]) == 1
    capsys.readouterr()
    assert main([*call, "--agents", "1", "--workers", "1"]) == 1
    capsys.readouterr()
    numbers = [*call, "--agents", "1", "--workers", "1", "--ignore", "S137", "--format", "json"]
    assert main(numbers) == 0
    document = json.loads(capsys.readouterr().out)
    assert [(one["code"], one["suppression"]) for one in document["suppressed"]] == [
        ("S137", "ignored as S137")
    ]

    settings = 'schema = 1\n[conditions]\nfail_on = "warning"\n'
    file.write_text(settings + narrow, encoding="utf-8")
    assert main(call) == 1
    file.write_text(settings + 'ignore = ["S137"]\n' + narrow, encoding="utf-8")
    assert main(call) == 0


@pytest.mark.parametrize("code", ["S128", "S129", "S130", "S131", "S139"])
def test_what_makes_a_simulation_unclear_is_not_ignored(
    fleet: Path, capsys: pytest.CaptureFixture[str], code: str
) -> None:
    assert main(["fleet", "simulate", str(fleet), "--ignore", code]) == 2
    assert code in capsys.readouterr().err


def test_what_is_left_of_a_pack_that_is_not_full_is_less(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    used = []
    for charge in (1.0, 0.5):
        packs = f"charge = {charge}\n"
        file = tmp_path / "fleet.toml"
        table = f'[swap]\ntime_s = 60\n[pack.P]\nbattery = "77Wh"\ncount = 2\n{packs}'
        file.write_text("schema = 1\n" + formation(20.0, table), encoding="utf-8")
        call = ["fleet", "simulate", str(file), "--policy", "none"]
        assert main([*call, "--format", "json"]) == 0
        agents = json.loads(capsys.readouterr().out)["agents"]
        # without the curve of a battery the charge is that of the energy: 77 Wh when full
        used += [one["energy_wh"] / 77.0 + one["charge_left"] for one in agents]
    assert used == pytest.approx([1.0, 1.0, 0.5, 0.5], abs=1e-12)
    assert main(call) == 0
    left = 0.5 - agents[0]["energy_wh"] / 77.0
    assert f" {100.0 * left:.0f} % " in capsys.readouterr().out


@pytest.mark.parametrize(
    "option", [("--deadline", "10"), ("--goal", "90"), ("--seeds", "3"), ("--workers", "1")]
)
def test_what_only_counts_for_numbers_of_agents_is_refused_without_them(
    fleet: Path, capsys: pytest.CaptureFixture[str], option: tuple[str, str]
) -> None:
    assert main(["fleet", "simulate", str(fleet), *option]) == 2
    said = capsys.readouterr().err
    assert option[0] in said
    assert "--agents" in said


def test_a_trace_is_written_to_a_file_of_columns_alone(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "foo.txt"
    assert main(["fleet", "simulate", str(fleet), "--trace", str(trace)]) == 2
    assert "give a name ending in .csv or .parquet" in capsys.readouterr().err
    assert not trace.exists()


def test_who_has_no_pack_of_the_file_is_told_and_not_clear(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "fleet.toml"
    swap = "[swap]\ntime_s = 60\n"
    call = ["fleet", "simulate", str(file), "--policy", "none"]
    for packs, code, said in (
        ("", 0, "S118 pack-assumed: a and 1 more: no pack is given"),
        (f'{swap}[pack.P]\nbattery = "77Wh"\n', 1, "S143 swarm-no-pack [error] b: no pack is left"),
        (
            f'{swap}[pack.P]\nbattery = "77Wh"\ncount = 2\nfits = ["b"]\n',
            1,
            "S143 swarm-no-pack [error] a: no pack is left",
        ),
    ):
        # the article's model has no battery, this one has
        text = formation(20.0, packs).replace(MODEL, "px4-quad-2kg")
        file.write_text("schema = 1\n" + text, encoding="utf-8")
        assert main(call) == code
        assert said in capsys.readouterr().out
    # the first vehicle leaves the pack that fits all to the second
    packs = f'{swap}[pack.P]\nbattery = "77Wh"\n[pack.Q]\nbattery = "99Wh"\nfits = ["a"]\n'
    file.write_text("schema = 1\n" + formation(20.0, packs), encoding="utf-8")
    assert main([*call, "--format", "json"]) == 0
    agents = json.loads(capsys.readouterr().out)["agents"]
    assert [one["battery"]["capacity_wh"] for one in agents] == [99.0, 77.0]


@pytest.mark.parametrize("line", ["lane_m = 1e-9", "sensor_radius_m = 1e-6"])
def test_lanes_and_sight_have_a_least(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    file = tmp_path / "fleet.toml"
    text = search(more="" if line.startswith("lane") else f"{line}\n")
    if line.startswith("lane"):
        text = text.replace("lane_m = 20", line)
    file.write_text("schema = 1\n" + text, encoding="utf-8")
    assert main(["fleet", "simulate", str(file)]) == 2
    assert "must not be below 0.1" in capsys.readouterr().err
