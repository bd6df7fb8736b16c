"""No command writes over a file that it reads, by whatever name it is called."""

from __future__ import annotations

import shlex
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest
from dataflash_writer import copter_log

from planner.cli.configuration import mission_settings
from planner.cli.main import main
from planner.report.sign_off import write_sign_off
from planner.service.preflight import check_file
from planner.setup import Setup

MODELS = Path(__file__).resolve().parents[2] / "models"
FLEET = """
schema = 1
[conditions]
profile = "site.toml"
[separation]
horizontal_m = 10
[swap]
time_s = 60
[vehicle.quad]
model = "own.toml"
params = "own.param"
[pack.A]
battery = "77Wh"
[job.near]
mission = "out.waypoints"
[sortie.first]
job = "near"
vehicle = "quad"
pack = "A"
mission = "part.waypoints"
start_s = 10
"""
KEY = "ab" * 32
SIGNED = "out.waypoints.signoff.json"


@pytest.fixture(scope="module")
def made() -> dict[Path, bytes]:
    """What `make_inputs` has made once, for every folder of this module's tests."""
    return {}


@pytest.fixture(autouse=True)
def inputs(mission: str, made: dict[Path, bytes]) -> dict[Path, bytes]:
    """Every file of a folder, with what is in it."""
    if not made:
        make_inputs(mission)
        made |= {path: path.read_bytes() for path in Path().iterdir()}
    for path, content in made.items():
        path.write_bytes(content)
    Path("key").chmod(0o600)
    return dict(made)


def make_inputs(mission: str) -> None:
    """Write everything that a call may read into the current folder."""
    shutil.copy(mission, "part.waypoints")
    own = (MODELS / "falkowski-2023-quadrotor.toml").read_text(encoding="utf-8")
    for name in ("own", "b"):
        renamed = own.replace('"falkowski-2023-quadrotor"', f'"{name}"')
        Path(f"{name}.toml").write_text(renamed, encoding="utf-8")
    Path("mavjoule.toml").write_text('vehicle = "own.toml"\n', encoding="utf-8")
    Path("site.toml").write_text("", encoding="utf-8")
    Path("own.param").write_text("WPNAV_SPEED,500\n", encoding="utf-8")
    Path("fleet.toml").write_text(FLEET, encoding="utf-8")
    Path("weather.csv").write_text("time,wind speed [m/s],wind direction [deg]\n1,2,3\n", "utf-8")
    Path("logs.csv").write_text("log,mass [kg]\nflight.bin,2\n", encoding="utf-8")
    Path("flight.bin").write_bytes(copter_log().content())
    Path("key").write_text(KEY, encoding="utf-8")
    assert main(["check", mission, "--write-baseline", "base.json"]) in {0, 1}
    values = mission_settings(mission, {"params": Path("own.param")})
    shown = check_file(mission, Setup.of(values))
    at = datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC)
    write_sign_off(shown, values, command="", manual=(), who="Ada", at=at)


@pytest.mark.parametrize(
    ("call", "read"),
    [
        ("check out.waypoints --params own.param --baseline base.json --output", "out.waypoints"),
        ("check out.waypoints --params own.param --baseline base.json --output", "own.param"),
        ("check out.waypoints --params own.param --baseline base.json --output", "own.toml"),
        ("check out.waypoints --params own.param --baseline base.json --report", "base.json"),
        ("check out.waypoints --profile site.toml --report", "site.toml"),
        ("check out.waypoints --report", "mavjoule.toml"),
        # every value is given otherwise: it was read all the same
        ("check out.waypoints --vehicle b.toml --output", "mavjoule.toml"),
        ("check out.waypoints --write-baseline", "own.toml"),
        ("segments out.waypoints --output", "own.toml"),
        ("speed out.waypoints --params own.param --output", "own.param"),
        ("split out.waypoints --report", "own.toml"),
        ("compare out.waypoints --b '--vehicle b.toml' --output", "b.toml"),
        ("compare out.waypoints part.waypoints --b '--vehicle b.toml' --report", "part.waypoints"),
        ("compare out.waypoints --b '--vehicle b.toml' --report", "own.toml"),
        ("sweep out.waypoints --vary wind=0,5 --report", "own.toml"),
        ("sweep out.waypoints --vary vehicle=own.toml,b.toml --report", "b.toml"),
        ("sweep out.waypoints --weather weather.csv --output", "weather.csv"),
        ("sweep fleet.toml --vary wind=0,5 --report", "part.waypoints"),
        ("fleet check fleet.toml --output", "fleet.toml"),
        ("fleet check fleet.toml --output", "part.waypoints"),
        ("fleet check fleet.toml --report", "out.waypoints"),
        ("fleet check fleet.toml --baseline base.json --output", "base.json"),
        ("fleet plan fleet.toml -o day --report", "own.param"),
        ("fleet simulate fleet.toml --report", "own.toml"),
        ("fleet simulate fleet.toml --output", "site.toml"),
        ("vehicle show own.toml --output", "own.toml"),
        ("vehicle new --mass 2kg --moves-like own.toml --force --output", "own.toml"),
        ("vehicle refine own.toml flight.bin --table logs.csv --force --output", "logs.csv"),
        ("identify flight.bin --table logs.csv --force --output", "logs.csv"),
        ("identify flight.bin --mass 2 --base own.toml --force --output", "own.toml"),
        ("verify own.toml flight.bin --output", "own.toml"),
        (f"verify-signoff {SIGNED} --output", "out.waypoints"),
        (f"verify-signoff {SIGNED} --output", "own.param"),
        (f"verify-signoff {SIGNED} --output", "mavjoule.toml"),
        ("diff out.waypoints part.waypoints --output", "part.waypoints"),
        ("convert part.waypoints --force --output", "part.waypoints"),
        ("guard udp:127.0.0.1:1 --vehicle own.toml --battery 77Wh --log", "own.toml"),
        ("guard udp:127.0.0.1:1 --vehicle b.toml --battery 9Wh --signing-key key --log", "key"),
    ],
)
def test_what_a_call_reads_is_never_written_over(
    call: str, read: str, inputs: dict[Path, bytes], capsys: pytest.CaptureFixture[str]
) -> None:
    if call.startswith("guard"):  # obeys only what is typed
        Path("mavjoule.toml").unlink()
        del inputs[Path("mavjoule.toml")]
    Path("folder").mkdir()
    Path("link").symlink_to(read)
    for name, why in (
        (read, "is read in this call"),
        (f"folder/../{read}", "is read in this call"),
        ("link", "is read in this call"),
        (f"missing/../{read}", "No such file or directory"),
    ):
        if name == "link" and call.startswith(("sweep", "vehicle", "identify", "convert")):
            continue  # the name decides what is written
        capsys.readouterr()
        assert main([*shlex.split(call), name]) == 2
        said = capsys.readouterr().err
        # That no input has the name of a page may be said first.
        assert why in said or (call.endswith("--report") and "ends in .html" in said)
        assert {path: path.read_bytes() for path in inputs} == inputs


def test_a_way_through_a_folder_that_is_not_there_leads_to_no_file(
    inputs: dict[Path, bytes], capsys: pytest.CaptureFixture[str]
) -> None:
    """To the system it does not; "exists, give --force" was asked of another file than was written."""
    shutil.copy("out.waypoints", "other.waypoints")
    parts = Path("parts")
    parts.mkdir()
    Path(parts, "vertical.plan").write_text("flown", encoding="utf-8")
    for call in (
        "convert out.waypoints missing/../other.waypoints",
        "vehicle new --mass 2kg -o missing/../b.toml",
        "fetch udp:127.0.0.1:1 -o missing/../other.plan --params missing/../own.param",
        "experiment --home 50 20 -o missing/../parts",
        "segments out.waypoints -o missing/../new.txt",
    ):
        capsys.readouterr()
        assert main(call.split()) == 2
        assert "cannot be written: No such file or directory" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in inputs} == inputs
    assert Path(parts, "vertical.plan").read_text(encoding="utf-8") == "flown"
    assert not Path("new.txt").exists()
    assert not Path("missing").exists()


def test_two_reports_do_not_take_each_others_place(capsys: pytest.CaptureFixture[str]) -> None:
    Path("folder").mkdir()
    both = ["--output", "report.html", "--report", "folder/../report.html"]
    assert main(["check", "out.waypoints", *both]) == 2
    assert "--output and --report name the same file" in capsys.readouterr().err


def test_a_baseline_is_made_anew_in_its_place() -> None:
    again = ["check", "out.waypoints", "--baseline", "base.json", "--write-baseline", "base.json"]
    assert main(again) in {0, 1}


@pytest.mark.parametrize(
    ("call", "file"),
    [
        ("identify flight.bin --mass 2 -o", "b.toml"),
        ("vehicle refine sheet.toml flight.bin -o", "b.toml"),
    ],
)
def test_a_model_of_other_making_is_replaced_only_by_force(
    call: str, file: str, inputs: dict[Path, bytes], capsys: pytest.CaptureFixture[str]
) -> None:
    sheet = "--mass 1.6kg --battery 4S5200 --rotors 4 --propeller 10in"
    assert main(["vehicle", "new", *sheet.split(), "-o", "sheet.toml"]) == 0
    capsys.readouterr()
    assert main([*call.split(), file]) == 2
    assert f"{file} exists, and mavjoule" in capsys.readouterr().err
    assert Path(file).read_bytes() == inputs[Path(file)]
    assert main([*call.split(), file, "--force"]) == 0
    # its own, of a run before, and a file with nothing in it are
    assert main([*call.split(), file]) == 0
    Path("empty.toml").touch()
    assert main([*call.split(), "empty.toml"]) == 0
