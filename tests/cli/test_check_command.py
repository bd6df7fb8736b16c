"""``mavjoule check`` and its neighbours from end to end."""

from __future__ import annotations

import csv
import gzip
import io
import json
import os
import shlex
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

import planner
from planner.cli.main import main

RUN = (sys.executable, "-c", "import sys; from planner.cli.main import main; sys.exit(main())")


def _json(capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    document = json.loads(capsys.readouterr().out)
    assert isinstance(document, dict)
    return document


def _missions(document: dict[str, object]) -> list[dict[str, dict[str, float]]]:
    missions = document["missions"]
    assert isinstance(missions, list)
    return missions


def test_json_comes_out_as_one_document_with_nothing_else(
    mission: str, broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, broken, "--battery", "77Wh", "--format", "json"]) == 2
    said = capsys.readouterr()
    document = json.loads(said.out)
    assert [one["verdict"] for one in document["missions"]] == ["go", None]
    assert document["tool"]["version"] == planner.__version__
    assert said.err == ""


def test_many_missions_are_told_the_same_by_one_process_and_by_two(
    mission: str, broken: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []
    for cores in (1, 2):
        monkeypatch.setattr("planner.cli.check.core_count", lambda cores=cores: cores)
        missions = [*[mission] * 10, broken, *[mission] * 9]
        assert main(["check", *missions, "--battery", "77Wh", "--format", "json"]) == 2
        told.append(_json(capsys))
    assert told[0] == told[1]
    assert [number for number, one in enumerate(_missions(told[0])) if not one["verdict"]] == [10]


def test_the_command_line_and_the_library_get_the_same_numbers(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", mission, "--battery", "77Wh", "--reserve", "25%", "--format", "json"])
    [told] = _missions(_json(capsys))
    result = planner.check(
        planner.read_mission(mission),
        planner.load_vehicle("falkowski-2023-quadrotor"),
        battery=planner.Battery(capacity_wh=77.0),
        reserve=0.25,
    )
    assert result.battery is not None
    assert told["totals"]["energy_wh"] == result.totals.energy_wh
    assert told["battery"]["margin_wh"] == result.battery.margin_wh
    assert len(told["segments"]) == len(result.segments)


def test_a_mission_comes_from_standard_input(mission: str) -> None:
    done = subprocess.run(
        [*RUN, "check", "-", "--battery", "77Wh"],
        input=Path(mission).read_bytes(),
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.decode().splitlines()[0] == "GO  -"


def test_a_report_goes_to_a_file_and_the_verdict_to_standard_error(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", mission, "--battery", "77Wh", "--format", "json", "--output", "a.json"]
    assert main(arguments) == 0
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == "mavjoule: 1 mission: 1 GO, 0 NO-GO; the report is in a.json\n"
    assert json.loads(Path("a.json").read_text(encoding="utf-8"))["schema"] == 1


@pytest.mark.parametrize("name", ["a.pdf", "a.csv", "a.HTML.txt"])
def test_a_page_under_the_name_of_another_format_is_refused(
    name: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in (["check", mission], ["compare", mission, mission], ["split", mission]):
        assert main([*command, "--battery", "77Wh", "--report", name]) == 2
        assert "give a name that ends in .html" in capsys.readouterr().err
        assert not Path(name).exists()


@pytest.mark.usefixtures("mission")
def test_nothing_flown_is_judged_for_the_battery_of_the_model(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("empty.waypoints").write_text("QGC WPL 110\n", encoding="utf-8")
    main(["check", "empty.waypoints", "--vehicle", "arducopter-sitl-quad"])
    assert (
        capsys.readouterr().out.splitlines()[1] == "arducopter-sitl-quad, battery 178 Wh, no wind"
    )


def test_the_configuration_of_each_mission_holds_for_it_alone(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path(mission).read_text(encoding="utf-8")
    for folder, battery in (("small", "5Wh"), ("large", "77Wh")):
        Path(folder).mkdir()
        Path(folder, "a.waypoints").write_text(text, encoding="utf-8")
        Path(folder, "mavjoule.toml").write_text(f'battery = "{battery}"', encoding="utf-8")
    assert main(["check", "small/a.waypoints", "large/a.waypoints", "--format", "json"]) == 1
    small, large = _missions(_json(capsys))
    assert small["battery"]["capacity_wh"] == 5.0
    assert large["battery"]["capacity_wh"] == 77.0


def test_an_ignored_finding_is_counted_but_neither_reported_nor_judged(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    warned = ["check", mission, "--battery", "77Wh", "--temperature", "20", "--fail-on", "warning"]
    assert main(warned) == 1
    assert "E108 condition" in capsys.readouterr().out
    assert main([*warned, "--ignore", "x9, e1"]) == 0
    out = capsys.readouterr().out
    assert "E108 condition" not in out
    assert "X902 no-terrain-data: " not in out, "still in the list of what was not checked"
    assert "(1 warning suppressed)" in out.splitlines()[0]
    assert main([*warned, "--select", "X", "--format", "json"]) == 0
    [told] = json.loads(capsys.readouterr().out)["missions"]
    assert {finding["code"] for finding in told["findings"]} == {"X902"}
    assert {"E107", "E108"} <= {finding["code"] for finding in told["suppressed"]}


@pytest.mark.parametrize("way", [("--ignore", "E1"), ("--select", "W")])
def test_no_selection_makes_a_battery_suffice(
    mission: str, way: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, "--battery", "5Wh", *way]) == 1
    assert "E101" in capsys.readouterr().out


def test_ignoring_an_error_of_energy_is_refused_with_what_addresses_it(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, "--battery", "5Wh", "--ignore", "M109,E101"]) == 2
    assert "E101 cannot be ignored" in (said := capsys.readouterr().err)
    assert "--battery, --charge or --reserve" in said


def test_without_a_vehicle_nothing_is_a_go(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mavjoule.toml").write_text("reserve = 0.2\n", encoding="utf-8")  # the nearest; names none
    assert main(["check", mission, "--battery", "77Wh"]) == 1
    out = capsys.readouterr().out
    assert out.startswith("NOT CHECKED  out.waypoints")
    assert "X903 no-vehicle [error]" in out


def test_a_file_that_is_not_there_or_a_folder_is_named_once_and_nothing_to_mend(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert Path(mission).exists()
    Path("empty").mkdir()
    assert main(["check", "missing.plan", "empty", "--battery", "77Wh"]) == 2
    out = capsys.readouterr().out
    assert "missing.plan: X901 file-unreadable [error] no such file" in out
    assert "empty: X901 file-unreadable [error] this is a folder" in out
    assert out.count("fix: give the path of a mission file that can be read") == 2
    assert "mend the file" not in out


def test_parameters_that_change_nothing_are_not_taken_in_silence(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine.param").write_text("WPNAV_SPEED,500\n", encoding="utf-8")
    main(["check", mission, "--battery", "77Wh", "--params", "mine.param"])
    assert (
        "mine.param: accelerations and corners do not shape the flight" in capsys.readouterr().out
    )
    assert main(["check", mission, "--battery", "77Wh", "--params", "missing.param"]) == 2
    assert "missing.param: cannot be read" in capsys.readouterr().err


def test_a_trace_is_written_as_csv_and_ends_where_the_flight_does(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", mission, "--battery", "77Wh", "--trace", "t.csv", "--format", "json"]
    assert main(arguments) == 0
    [told] = json.loads(capsys.readouterr().out)["missions"]
    rows = list(csv.DictReader(io.StringIO(Path("t.csv").read_text(encoding="utf-8"))))
    assert float(rows[0]["time_s"]) == 0.0
    assert float(rows[-1]["time_s"]) == pytest.approx(told["totals"]["time_s"], abs=1e-6)
    assert rows[0]["state"] == "takeoff"
    assert rows[-1]["state"] == "land"
    times_s = [float(row["time_s"]) for row in rows]
    assert times_s == sorted(times_s)


def test_a_trace_called_parquet_is_parquet_or_refused_before_anything_is_checked(
    mission: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ["check", mission, "--battery", "77Wh", "--trace"]
    if find_spec("pyarrow") is not None:
        assert main([*asked, "t.csv"]) == main([*asked, "t.Parquet"]) == 0
        from pyarrow.parquet import read_table

        with Path("t.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        table = read_table("t.Parquet").to_pylist()
        assert [float(row["time_s"]) for row in rows] == [row["time_s"] for row in table]
        assert rows[0].keys() == table[0].keys()
    capsys.readouterr()
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert main([*asked, "u.parquet"]) == 2
    assert capsys.readouterr() == (
        "",
        "mavjoule: pyarrow is not installed: pip install 'mavjoule[parquet]'\n",
    )


def test_a_trace_has_no_altitudes_above_a_home_of_unknown_altitude() -> None:
    rows = (  # a home at 0 m, as programs write that do not know it
        "0\t1\t0\t16\t0\t0\t0\t0\t47.4\t8.5\t0\t1",
        "1\t0\t3\t22\t0\t0\t0\t0\t47.4\t8.5\t20\t1",
        "2\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1",
    )
    Path("up.waypoints").write_text("\n".join(("QGC WPL 110", *rows, "")), encoding="utf-8")
    asked = ["check", "up.waypoints", "--vehicle", "dji-f450", "--exit-zero", "--trace"]
    assert main([*asked, "t.csv"]) == main([*asked, "k.csv", "--home-amsl", "300"]) == 0
    unknown, known = (_trace_rows(name) for name in ("t.csv", "k.csv"))
    assert {row["altitude_amsl_m"] for row in unknown} == {""}
    heights_m = [float(row["height_above_home_m"]) for row in unknown]
    assert max(heights_m) >= 19.5
    above_m = [float(row["altitude_amsl_m"]) - 300.0 for row in known]
    assert above_m == pytest.approx([float(row["height_above_home_m"]) for row in known])
    if find_spec("pyarrow") is not None:
        assert main([*asked, "t.parquet"]) == 0
        from pyarrow.parquet import read_table

        table = read_table("t.parquet")
        assert table.column("altitude_amsl_m").null_count == len(table) == len(unknown)
        assert str(table.schema.field("altitude_amsl_m").type) == "double"


def _trace_rows(name: str) -> list[dict[str, str]]:
    with Path(name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_trace_is_of_one_mission(mission: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", mission, mission, "--trace", "t.csv"]) == 2
    assert "--trace" in capsys.readouterr().err
    assert not Path("t.csv").exists()


def test_segments_are_told_as_text_json_and_csv_alike(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["segments", mission, "--format", "json"])
    segments = _json(capsys)["segments"]
    assert isinstance(segments, list)
    main(["segments", mission, "--format", "csv"])
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    main(["segments", mission])
    lines = capsys.readouterr().out.splitlines()
    assert [row["state"] for row in rows] == [segment["state"] for segment in segments]
    assert [float(row["energy_wh"]) for row in rows] == [one["energy_wh"] for one in segments]
    assert len(lines) == len(segments) + 2
    assert segments[0]["state"] == "takeoff"
    assert segments[-1]["state"] == "land"


def test_models_rules_and_explanations_are_told_as_json_too(
    capsys: pytest.CaptureFixture[str],
) -> None:
    main(["models", "--format", "json"])
    models = _json(capsys)["models"]
    assert isinstance(models, list)
    assert "falkowski-2023-quadrotor" in [model["name"] for model in models]
    main(["rules", "--format", "json"])
    rules = _json(capsys)["rules"]
    assert isinstance(rules, list)
    [listed] = [rule for rule in rules if rule["code"] == "E101"]
    main(["explain", "e101", "--format", "json"])
    explained = _json(capsys)
    assert {key: explained[key] for key in listed} == listed
    assert explained["severity"] == "error"


def test_every_model_that_is_listed_can_be_flown(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["models", "--format", "json"])
    models = _json(capsys)["models"]
    assert isinstance(models, list)
    # The models of the library differ in numbers alone: one flies for all of them.
    flown = [m for m in models if m["basis"] in {"identified", "article"}]
    for model in [*flown, next(m for m in models if m["name"] == "holybro-x500-v2")]:
        options = ["--vehicle", model["name"], "--battery", "150Wh", "--format", "json"]
        code = main(["check", mission, *options])
        missions = _json(capsys)["missions"]
        assert isinstance(missions, list)
        checked = missions[0]
        unknown = [f for f in checked["findings"] if f["code"] == "E109"]
        # A model whose power was not identified is flown, but never a go.
        assert code == bool(unknown)
        assert (checked["totals"]["energy_wh"] is None) is bool(unknown)
        assert checked["totals"]["time_s"] > 0.0


def test_a_reader_that_leaves_changes_neither_verdict_nor_quiet(mission: str) -> None:
    process = subprocess.Popen(
        [*RUN, "check", *[mission] * 20, "--battery", "5Wh", "--format", "json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    process.stdout.close()  # gone before anything is written
    _, said = process.communicate()
    assert (process.returncode, said) == (1, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs the device that is always full")
@pytest.mark.parametrize("last", [("--battery", "77Wh"), ("--help",)])
def test_a_full_disk_is_a_sentence_and_no_verdict(mission: str, last: tuple[str, ...]) -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [*RUN, "check", mission, *last], stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 2
    assert done.stderr.decode() == (
        "mavjoule: standard output: cannot be written: No space left on device\n"
    )


@pytest.mark.skipif(not Path("/dev/stdin").exists(), reason="needs the file that standard input is")
def test_a_file_under_dev_is_no_serial_line(mission: str) -> None:
    with Path(mission).open("rb") as opened:
        done = subprocess.run(
            [*RUN, "check", "/dev/stdin", "--battery", "77Wh"],
            stdin=opened,
            capture_output=True,
            check=False,
        )
    assert b"/dev/stdin\n" in done.stdout
    assert b"connecting" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="nobody deletes the folder of a program there")
def test_a_call_from_a_folder_that_is_gone_is_told_so(mission: str, tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    script = f"cd {gone} && rmdir {gone} && exec {shlex.join(RUN)} check ../{Path(mission).name}"
    done = subprocess.run(["/bin/sh", "-c", script], capture_output=True, check=False)
    assert done.returncode == 2
    assert b"the folder this was called from is gone" in done.stderr


def test_a_console_without_the_signs_we_use_gets_substitutes(mission: str) -> None:
    done = subprocess.run(
        [*RUN, "check", mission, "--battery", "77Wh", "--wind", "1@0"],
        env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"},
        capture_output=True,
        check=False,
    )
    assert done.returncode in {0, 1}, done.stderr
    assert b"from 000?" in done.stdout  # the degree sign


def test_the_version_is_the_package_s(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"mavjoule {planner.__version__}\n"


def test_a_rule_is_explained_by_the_name_of_px4s_event(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "navigator_mis_takeoff_missing"]) == 0
    assert capsys.readouterr().out.startswith("M116 required-item-missing [error]")
    assert main(["explain", "navigator_mis_takeof_missing"]) == 2
    assert "did you mean navigator_mis_takeoff_missing?" in capsys.readouterr().err


def test_rules_say_whether_they_are_asked_by_default(capsys: pytest.CaptureFixture[str]) -> None:
    main(["rules", "--format", "json"])
    rules = _json(capsys)["rules"]
    assert isinstance(rules, list)
    assert [rule["code"] for rule in rules if not rule["default"]] == ["M120"]
    [required] = [rule for rule in rules if rule["code"] == "M116"]
    assert "navigator_mis_land_missing" in required["px4_events"]


def test_a_target_that_is_not_known_is_one_sentence(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, "--target", "arducopter-4.77"]) == 2
    error = capsys.readouterr().err
    assert "did you mean arducopter-4.7?" in error
    assert len(error.splitlines()) == 1
    assert (
        main(["check", mission, "--vehicle", "arducopter-sitl-quad", "--target", "px4-1.16"]) == 2
    )
    assert "PX4 1.16" in capsys.readouterr().err


def test_a_profile_judges_from_the_command_line(
    mission: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "site.toml").write_text("[site]\nmax_height_above_home_m = 90\n", encoding="utf-8")
    assert main(["check", mission, "--profile", "site.toml", "--format", "json"]) == 1
    assert '"code": "A114"' in capsys.readouterr().out
    assert main(["check", mission, "--profile", "none.toml"]) == 2
    assert "none.toml: cannot be read" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["check", "segments"])
def test_a_hyphen_is_standard_output(
    command: str, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main([command, mission, "--format", "json"])
    plain = capsys.readouterr()
    main([command, mission, "--format", "json", "--output", "-"])
    assert capsys.readouterr() == plain
    assert not Path("-").exists()


@pytest.fixture
def site(mission: str) -> Path:
    """A folder with three missions, one of them in a folder of its own, and files that are none."""
    folder = Path("site")
    (folder / "old").mkdir(parents=True)
    (folder / ".hidden").mkdir()
    text = Path(mission).read_bytes()
    for name in ("b.waypoints", "a.waypoints", "old/c.waypoints", ".hidden/d.waypoints"):
        (folder / name).write_bytes(text)
    (folder / "notes.txt").write_text("no mission", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    ("excluded", "left"),
    [
        ((), ["a.waypoints", "b.waypoints", "old/c.waypoints"]),
        (("old",), ["a.waypoints", "b.waypoints"]),
        (("site/old/*", "a.*"), ["b.waypoints"]),
        (("**/c.waypoints", "b.waypoints"), ["a.waypoints"]),
        (("*/c.plan",), ["a.waypoints", "b.waypoints", "old/c.waypoints"]),
    ],
)
def test_a_folder_stands_for_the_missions_in_it_but_those_excluded(
    site: Path, excluded: tuple[str, ...], left: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    options = [word for pattern in excluded for word in ("--exclude", pattern)]
    assert main(["check", "site", *options, "--battery", "77Wh", "--format", "json"]) == 0
    out, err = capsys.readouterr()
    files = [Path(one["file"]) for one in json.loads(out)["missions"]]
    assert files == [site / name for name in left]
    gone = f", {3 - len(left)} excluded" if len(left) < 3 else ""
    count = f"{len(left)} mission{'' if len(left) == 1 else 's'}"
    unmet = "mavjoule: --exclude */c.plan leaves out no mission\n" if "*/c.plan" in excluded else ""
    assert (
        err
        == f"mavjoule: site: {count}{gone}, 1 other file (notes.txt), 1 hidden left out\n{unmet}"
    )


def test_what_a_folder_leaves_out_by_itself_is_said(
    site: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (site / ".git").mkdir()
    (site / ".e.waypoints").write_bytes((site / "a.waypoints").read_bytes())
    (site / ".DS_Store").write_bytes(b"no mission")
    (site / "elsewhere").symlink_to("old", target_is_directory=True)
    main(["check", "site", "--battery", "77Wh", "--format", "concise"])
    out, err = capsys.readouterr()
    assert "elsewhere" not in out
    assert err == (
        "mavjoule: site: 3 missions, 1 other file (notes.txt), 2 hidden left out, "
        "1 link to folders not followed\n"
    )


def test_where_every_mission_is_excluded_nothing_is_green(
    site: Path, mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(site), mission, "--exclude", "*.waypoints"]) == 2
    assert "--exclude *.waypoints leaves no mission" in capsys.readouterr().err
    assert main(["check", str(site), "--exclude", "../x"]) == 2
    assert "with forward slashes, such as *.plan" in capsys.readouterr().err


def test_a_charge_is_given_by_the_voltage_without_load(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["check", mission, "--battery", "5200mAh@4S", "--format", "json", "--charge"]
    # 4.05 V a cell are 0.8 of the way from 3.93 V at 75 % to 4.08 V at 90 % (models/chemistries/lipo.toml)
    usable_wh = {}
    for charge in ("16.2V", "87%"):
        assert main([*asked, charge]) == 0
        [checked] = json.loads(capsys.readouterr().out)["missions"]
        usable_wh[charge] = checked["battery"]["usable_wh"]
        told = [one["message"] for one in checked["findings"] if one["code"] == "E125"]
        assert ("charge of 87 % taken from 16.2 V" in told[-1]) is (charge == "16.2V")
    assert usable_wh["16.2V"] == pytest.approx(usable_wh["87%"], rel=1e-9)
    for charge, why in (("17.1V", "16.8 V when full"), ("13V", "14.0 V when empty")):
        assert main([*asked, charge]) == 2
        assert why in capsys.readouterr().err
    assert main(["check", mission, "--battery", "77Wh", "--charge", "16.2V"]) == 2
    assert "give --battery with cells" in capsys.readouterr().err


def test_vehicle_battery_and_wind_stand_below_the_verdict(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", mission, "--battery", "77Wh", "--charge", "90%", "--wind", "5@270"])
    verdict, given, *_ = capsys.readouterr().out.splitlines()
    assert verdict.startswith("GO  ")
    assert given == "falkowski-2023-quadrotor, battery 77.0 Wh at 90 %, wind 5.0 m/s from 270°"


def test_a_folder_holds_the_missions_that_are_called_as_other_files_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in (
        ("flight.txt", "QGC WPL 110\n"),
        ("notes.txt", "Fly the QGC plan on Monday.\n"),
        ("flight.json", '{"fileType": "Plan"}'),
        ("settings.json", "{}"),
        ("flight.wpl", ""),
    ):
        (tmp_path / name).write_text(text)
    main(["check", str(tmp_path), "--format", "json"])
    out, err = capsys.readouterr()
    files = [Path(one["file"]).name for one in json.loads(out)["missions"]]
    assert files == ["flight.json", "flight.txt", "flight.wpl"]
    left_out = [Path(one).name for one in json.loads(out)["left_out"]]
    assert left_out == ["notes.txt", "settings.json"]
    assert "3 missions, 2 other files (notes.txt, settings.json)" in err
    main(["check", str(tmp_path), "--format", "json-lines"])
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [[Path(one).name for one in line["left_out"]] for line in lines] == [left_out] * 3
    main(["check", str(tmp_path), "--format", "sarif"])
    [run] = json.loads(capsys.readouterr().out)["runs"]
    told = run["invocations"][0]["toolExecutionNotifications"]
    assert [one["level"] for one in told] == ["note"] * 2
    uris = [one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for one in told]
    assert [Path(uri).name for uri in uris] == left_out
    main(["check", str(tmp_path / "flight.txt"), "--format", "sarif"])
    [run] = json.loads(capsys.readouterr().out)["runs"]
    assert "toolExecutionNotifications" not in run["invocations"][0]


def test_a_folder_holds_the_missions_of_every_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever a check reads as a mission alone; maps of areas and other tables are none."""
    line, area = "<kml><LineString/></kml>", "<kml><Polygon/></kml>"
    packed = {"a.plan.gz": b"{}", "b.kml.gz": line.encode(), "x.csv.gz": b"time,voltage\n"}
    for name, content in packed.items():
        (tmp_path / name).write_bytes(gzip.compress(content))
    for name, inner, text in (
        ("c.kmz", "doc.kml", line),
        ("d.kmz", "wpmz/waylines.wpml", "<kml xmlns:wpml='x'><wpml:a/></kml>"),
        ("x.kmz", "doc.kml", area),
        ("e.zip", "survey.plan", "{}"),
        ("x.zip", "photo.jpg", ""),
    ):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr(inner, text)
    for name, text in (
        ("f.kml", line),
        ("g.geojson", '{"type": "LineString"}'),
        ("h.csv", "latitude,longitude,altitude(m),heading(deg)\n"),
        ("x.kml", area),
        ("x.geojson", '{"type": "Polygon"}'),
        ("x.csv", "time,voltage\n"),
        ("x.gz", "not packed"),
        ("i.plan.gz", "damaged"),
    ):
        (tmp_path / name).write_text(text)
    main(["check", str(tmp_path), "--format", "json"])
    out, err = capsys.readouterr()
    files = [Path(one["file"]).name for one in json.loads(out)["missions"]]
    expected = [
        "a.plan.gz",
        "b.kml.gz",
        "c.kmz",
        "d.kmz",
        "e.zip",
        "f.kml",
        "g.geojson",
        "h.csv",
        "i.plan.gz",
    ]
    assert files == expected
    others = "x.csv, x.csv.gz, x.geojson, x.gz, x.kml, x.kmz, x.zip"
    assert f"9 missions, 7 other files ({others})" in err
