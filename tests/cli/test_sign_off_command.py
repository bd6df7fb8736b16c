"""``mavjoule verify-signoff``: what has changed since a check was signed."""

from __future__ import annotations

import json
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from planner.cli.configuration import mission_settings
from planner.cli.main import main
from planner.notation import read_battery
from planner.report.sign_off import write_sign_off
from planner.service.preflight import check_file
from planner.setup import Setup

if TYPE_CHECKING:
    from collections.abc import Mapping

MISSIONS = Path(__file__).parents[2] / "missions"
MISSION = "survey-vineyard.plan"
AT = datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC)


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work beside a copy of a mission with settings and a model of its own."""
    site = tmp_path / "site"
    site.mkdir()
    shutil.copy(MISSIONS / MISSION, site)
    shutil.copy(MISSIONS.parent / "models" / "falkowski-2023-quadrotor.toml", site / "own.toml")
    model = site / "own.toml"
    text = model.read_text(encoding="utf-8")
    model.write_text(text.replace('"falkowski-2023-quadrotor"', '"own"'), encoding="utf-8")
    (site / "mavjoule.toml").write_text('battery = "77Wh"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)


def signed(given: Mapping[str, object] | None = None) -> str:
    """Sign a check from the folder above."""
    mission = f"site/{MISSION}"
    values = mission_settings(mission, {"vehicle": "site/own.toml"} | dict(given or {}))
    shown = check_file(mission, Setup.of(values))
    path = write_sign_off(shown, values, command="", manual=(), who="Ada", at=AT)
    return str(path)


def changes(file: str, capsys: pytest.CaptureFixture[str]) -> dict[str, list[str]]:
    """Return what is reported as changed: kind and subjects."""
    capsys.readouterr()
    assert main(["verify-signoff", file, "--format", "json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["is_valid"] is False
    found: dict[str, list[str]] = {}
    for one in document["changes"]:
        found.setdefault(one["kind"], []).append(one["subject"])
    return found


def test_a_release_of_which_nothing_changed_is_valid_wherever_the_folder_is(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = signed()
    assert main(["verify-signoff", file]) == 0
    told = capsys.readouterr().out
    assert "GO, released by Ada at 2026-05-04T03:02:01+00:00" in told
    assert "nothing has changed" in told
    assert "VALID: the flight is released" in told
    Path("site").rename("elsewhere")
    monkeypatch.chdir("elsewhere")
    assert main(["verify-signoff", Path(file).name]) == 0


def test_each_input_that_changes_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    file = signed()
    for name in (MISSION, "own.toml", "mavjoule.toml"):
        path = Path("site") / name
        before = path.read_bytes()
        path.write_bytes(before + b"\n")
        [subject] = changes(file, capsys)["input"]
        assert subject.endswith(name)
        path.write_bytes(before)
    assert main(["verify-signoff", file]) == 0


def test_a_smaller_battery_changes_verdict_figures_and_findings(
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = signed()
    Path("site/mavjoule.toml").write_text('battery = "15Wh"\n', encoding="utf-8")
    found = changes(file, capsys)
    assert found["verdict"] == ["verdict"]
    assert "Battery, Capacity" in found["figure"]
    assert "Flight, Time" not in found["figure"]
    assert any(one.startswith("E101 ") for one in found["finding"])
    assert main(["verify-signoff", file]) == 1
    told = capsys.readouterr().out
    assert "verdict: GO when signed, NO-GO now" in told
    assert "Battery, Capacity: 77.0 Wh when signed, 15.0 Wh now" in told
    assert "NOT VALID" in told


def test_a_mission_that_is_gone_is_no_verdict(capsys: pytest.CaptureFixture[str]) -> None:
    file = signed()
    Path("site", MISSION).unlink()
    found = changes(file, capsys)
    assert "verdict" in found
    assert "figure" not in found  # there are none now


def test_a_refusal_is_never_valid(capsys: pytest.CaptureFixture[str]) -> None:
    file = signed({"battery": read_battery("15Wh")})
    assert main(["verify-signoff", file]) == 1
    told = capsys.readouterr().out
    assert "NO-GO, refused by Ada" in told
    assert "nothing has changed" in told
    assert "NOT VALID: it was refused" in told


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "is not a sign-off"),
        ("{}", "is not a sign-off"),
        ('{"signed_by": 3}', "is not a sign-off"),
    ],
)
def test_what_is_no_sign_off_is_refused_in_a_sentence(
    text: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("other.json").write_text(text, encoding="utf-8")
    assert main(["verify-signoff", "other.json"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("mavjoule: other.json: ")
    assert why in told


def test_a_setting_that_is_none_is_refused_with_its_key(capsys: pytest.CaptureFixture[str]) -> None:
    file = Path(signed())
    document = json.loads(file.read_text(encoding="utf-8"))
    document["settings"]["winds"] = "5@270"
    file.write_text(json.dumps(document), encoding="utf-8")
    assert main(["verify-signoff", str(file)]) == 2
    assert "settings.winds: not a setting of this version" in capsys.readouterr().err
