"""Which missions and items a key of ``[per_file_ignores]`` means."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.cli.main import main
from planner.selection import make_file_ignore

SITE = Path("/site")


def _meets(key: str, mission: str) -> bool:
    ignore = make_file_ignore(key, ("F102",), configuration=SITE / "mavjoule.toml")
    return ignore.meets(SITE / mission)


@pytest.mark.parametrize(
    ("key", "mission", "met"),
    [
        ("a.plan", "a.plan", "met"),
        ("a.plan", "deep/er/a.plan", "met"),
        ("a.plan", "b.plan", "passed by"),
        ("a.plan", "aa.plan", "passed by"),
        ("*.plan", "deep/a.plan", "met"),
        ("*.plan", "a.waypoints", "passed by"),
        ("*.plan", "a.plan/b", "passed by"),
        ("deep/a.plan", "deep/a.plan", "met"),
        ("deep/a.plan", "a.plan", "passed by"),
        ("deep/a.plan", "er/deep/a.plan", "passed by"),
        ("deep/*", "deep/a.plan", "met"),
        ("deep/*", "deep/er/a.plan", "passed by"),
        ("deep/**", "deep/er/a.plan", "met"),
        ("deep/**/a.plan", "deep/a.plan", "met"),
        ("deep/**/a.plan", "deep/e/r/a.plan", "met"),
        ("**/er/*", "deep/er/a.plan", "met"),
        ("**/er/*", "deep/a.plan", "passed by"),
        ("[ab].plan", "b.plan", "met"),
        ("A.plan", "a.plan", "passed by"),
        ("a.plan#12", "a.plan", "met"),
        ("a.plan#12", "a.plan#12", "passed by"),
        ("odd#name.plan", "odd#name.plan", "met"),
    ],
)
def test_a_key_means_these_missions(key: str, mission: str, met: str) -> None:
    assert _meets(key, mission) is (met == "met")


def test_a_number_after_the_sign_is_an_item() -> None:
    def item(key: str) -> int | None:
        return make_file_ignore(key, (), configuration=SITE / "mavjoule.toml").exemption.item

    assert item("a.plan#12") == 12
    assert item("a.plan") is None
    assert item("a.plan#home") is None


def test_a_configuration_ignores_by_file_and_by_item(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path(mission).read_text(encoding="utf-8")
    Path("deep").mkdir()
    for path in ("deep/a.waypoints", "deep/b.waypoints"):
        Path(path).write_text(text, encoding="utf-8")
    # A battery of 5 Wh makes E102 at item 2 and E101 at item 3; E107 has no item.
    Path("mavjoule.toml").write_text(
        """
        battery = "5Wh"
        vehicle = "falkowski-2023-quadrotor"
        [per-file-ignores]
        "deep/*" = ["E107"]
        "a.waypoints#3" = ["T112"]
        "b.waypoints#2" = ["T112", "E1"]
        """,
        encoding="utf-8",
    )
    assert main(["check", mission]) == 1
    out = capsys.readouterr().out
    assert "E107" in out
    assert "T112 return" in out
    assert main(["check", "deep/a.waypoints"]) == 1
    out = capsys.readouterr().out
    assert "E107 " not in out
    assert "T112 return" not in out
    assert "Not reported, as asked: 2 assumptions." in out
    assert main(["check", "deep/b.waypoints"]) == 1
    out = capsys.readouterr().out
    assert "E102" in out, "no file switches an error of energy off"
    assert "T112 return" in out, "of another item"


def test_a_mission_without_a_flight_is_never_made_a_go(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = ("0\t1\t0\t16\t0\t0\t0\t0\t50.0\t20.0\t200\t1", "1\t0\t3\t206" + "\t0" * 7 + "\t1")
    text = "\n".join(("QGC WPL 110", *rows, ""))
    (tmp_path / "none.waypoints").write_text(text, encoding="utf-8")
    for codes in ("M", "E,T,M1"):
        assert main(["check", "none.waypoints", "--ignore", codes]) == 1
        assert "M108 nothing-to-fly [error]" in capsys.readouterr().out
    assert main(["check", "none.waypoints", "--select", "T"]) == 1
