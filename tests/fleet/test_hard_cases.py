"""What goes wrong with fleets elsewhere, and what the user is told; the rest is in the files beside this."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import OUT, SEPARATION, SWAP, checked, pad, place, sortie, up, vehicles
from made_missions import item, mission, north, rtl

import planner
from planner.errors import FleetFileError
from planner.fleet.reader import read_fleet
from planner.fleet.writer import fleet_file_text
from planner.mission.files import write_mission
from planner.service.preflight import CheckResult
from planner.service.separation import check_together
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.writer import write_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import Mission, MissionItem
    from planner.service.fleet import FleetResult

PADS = pad("a", 0, 0) + pad("b", 0, 200)
START = dt.datetime(2026, 5, 12, tzinfo=dt.UTC)
TWO = SEPARATION + PADS + vehicles("a", "b")
TO_B = mission(up(20), place(100, 0, 20), place(100, 200, 20), rtl())
TO_A = mission(up(20), place(100, 200, 20), place(100, 0, 20), place(100, 200, 20), rtl())
"""Towards each other along one line."""


def both(tables: str, first: Mission, second: Mission = TO_A, second_s: float = 0.0) -> FleetResult:
    """Two sorties of two vehicles."""
    sorties = sortie("s1", "a", 0.0, job="first"), sortie("s2", "b", second_s, job="second")
    return checked(tables, *sorties, first=first, second=second)


def told(result: FleetResult, code: str) -> list[str]:
    """What is told of the fleet as a whole by a rule."""
    return [one.finding.message for one in result.findings if one.finding.code == code]


def test_homes_at_different_heights_are_compared_above_the_sea() -> None:
    """Both fly 20 m above their own homes; 5 m and the errors of both heights, 5 m, are kept."""
    for amsl_m, is_clear in ((409, False), (411, True)):
        other = pad("b", 0, 200).replace("amsl_m = 400", f"amsl_m = {amsl_m}")
        tables = SEPARATION + pad("a", 0, 0) + other + vehicles("a", "b")
        result = both(tables, TO_B)
        assert (not told(result, "S101") and not told(result, "S114")) is is_clear, amsl_m


def test_heights_above_the_sea_and_above_home_are_compared() -> None:
    for amsl_m, is_clear in ((420.0, False), (431.0, True)):
        level = mission(
            *(
                replace(one, frame=0, altitude_m=amsl_m)
                for one in (place(100, 0, 0), place(100, 200, 0))
            ),
            rtl(),
        )
        result = both(TWO, replace(level, items=(up(31.0), *level.items)))
        assert (not told(result, "S101") and not told(result, "S114")) is is_clear, amsl_m


def test_heights_above_ground_nobody_knows_are_not_checked() -> None:
    above_ground = replace(place(100, 100, 20), frame=10)
    away = mission(up(20), place(-100, 200, 20), rtl())
    result = both(TWO, mission(up(20), above_ground, rtl()), away)
    assert (result.verdict, result.verdict_text) == ("no-go", "NOT CHECKED")


@pytest.mark.parametrize(
    ("way", "item_number"),
    [
        ([item(82, north(100), 20.0), place(100, 200, 20)], 3),
        ([place(100, 0, 20), item(18, north(100), 20.0, params=(2.0, 0.0, 20.0, 0.0))], 3),
        (
            [
                place(100, 0, 20),
                item(178, None, 0.0, params=(1.0, 3.0, 0.0, 0.0)),
                place(100, 200, 20),
            ],
            4,
        ),
        (
            [
                place(50, 0, 20),
                place(90, 0, 20),
                item(177, None, 0.0, params=(2.0, 3.0, 0.0, 0.0)),
                place(100, 200, 20),
            ],
            5,
        ),
    ],
    ids=["spline", "turns", "speed", "jump"],
)
def test_what_is_flown_is_what_is_kept_apart(way: list[MissionItem], item_number: int) -> None:
    """The other comes to where the first is at that time, wherever its jumps and turns have brought it."""
    first = mission(up(20), *way, rtl())
    alone = checked(pad("a", 0, 0), vehicles("a"), sortie("s1", "a", 0.0), out=first).sorties[0]
    assert alone.assessment is not None
    segments = alone.assessment.flight.motion.segments
    own = segments.item == item_number
    start_s = float((segments.end_s - segments.duration_s)[own].min())
    there = alone.assessment.flight.motion.state_at_time(
        segments.end_s[own][-1:] * 0.5 + start_s * 0.5
    )
    waits = mission(
        up(20), place(float(there.north_m[0]), float(there.east_m[0]), 20, 600.0), rtl()
    )
    [message] = told(both(TWO, first, waits), "S101") or told(both(TWO, first, waits), "S114")
    assert f"items {item_number} and" in message


def test_one_that_loiters_for_ever_blocks_its_place_for_ever() -> None:
    result = both(TWO, mission(up(20), item(17, north(100), 20.0)), second_s=5000.0)
    assert result.verdict == "no-go"
    [message] = told(result, "S101")
    assert "1:24:" in message


@pytest.mark.parametrize(
    ("params", "said", "verdict_text"),
    [
        # Alone it is a no-go already: its motors idle for nobody knows how long (T107).
        ((-1.0, 9.0, 0.0, 0.0), "until 09:00:00 UTC", "NO-GO"),
        ((30.0, -1.0, -1.0, -1.0), "waits 30 s", "NOT CHECKED"),
    ],
)
def test_one_whose_times_are_not_known_is_never_clear(
    params: tuple[float, ...], said: str, verdict_text: str
) -> None:
    waits = mission(item(93, None, 0.0, params=params), up(20), place(100, 0, 20), rtl())
    away = mission(up(20), place(-100, 200, 20), rtl())
    result = both(TWO, waits, away)
    alone = [one.result.verdict for one in result.sorties]
    assert alone == ["no-go" if verdict_text == "NO-GO" else "go", "go"]
    assert (result.verdict, result.verdict_text) == ("no-go", verdict_text)
    [message] = told(result, "S127")
    assert said in message
    with pytest.raises(planner.errors.UsageError, match="s1 has no volumes: it waits"):
        planner.fleet_volumes(result, geoid_height_m=0.0, start=START)
    flown = [one.result for one in result.sorties if isinstance(one.result, CheckResult)]
    for one in check_together(flown, separation_m=5.0):
        assert {(f.code, f.severity.label) for f in one.findings} >= {("S104", "error")}


def test_one_waiting_alone_with_no_hours_to_keep_is_its_own_business() -> None:
    waits = mission(item(93, None, 0.0, params=(30.0, -1.0, -1.0, -1.0)), *OUT.items)
    alone = pad("a", 0, 0), vehicles("a"), sortie("s1", "a", 0.0)
    assert not told(checked(*alone, out=waits), "S127")
    assert told(checked(*alone, "[operation]\nlatest_s = 900\n", out=waits), "S127")


def test_wind_stronger_than_the_vehicle_is_a_no_go_of_the_fleet() -> None:
    result = both(TWO + '[conditions]\nwind = "25@0"\n', OUT)
    assert result.verdict == "no-go"
    assert all("W103" in {f.code for f in one.result.findings} for one in result.sorties)


@pytest.mark.parametrize(
    ("wind", "first", "is_too_near"),
    [("0@0", "s1", False), ("4@0", "", True), ("6@0", "s2", False)],
)
def test_wind_changes_who_arrives_first_and_who_meets(
    tmp_path: Path, wind: str, first: str, *, is_too_near: bool
) -> None:
    """Of 12 m/s through the air a wind of 6 leaves one 6, and the other, across it, the 10 it asks."""
    limited = replace(load_vehicle("arducopter-sitl-quad"), name="limited", airspeed_limit_m_s=12.0)
    write_vehicle(tmp_path / "limited.toml", limited)
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 200, -260)
    tables += vehicles("a", "b", model=f"{tmp_path}/limited.toml")
    tables += f'[conditions]\nwind = "{wind}"\n'
    against = mission(up(20), place(400, 0, 20), item(21, None, 0.0))
    across = mission(up(20), place(200, 200, 20), item(21, None, 0.0))
    result = both(tables, against, across)
    assert bool(told(result, "S101")) is is_too_near
    when_s = {}
    for one, axis, crossing_m in zip(
        result.sorties, ("north_m", "east_m"), (200.0, 260.0), strict=True
    ):
        assert one.assessment is not None
        time_s = np.arange(0.0, one.time_s, 0.1)
        along_m = getattr(one.assessment.flight.motion.state_at_time(time_s), axis)
        when_s[one.name] = float(time_s[np.argmax(along_m > crossing_m)])
    if first:
        assert min(when_s, key=lambda name: when_s[name]) == first


@pytest.mark.parametrize(("altitude_cm", "is_clear"), [(2900, False), (3050, True)])
def test_returns_that_differ_in_height_pass_over_who_is_in_the_way(
    tmp_path: Path, altitude_cm: int, *, is_clear: bool
) -> None:
    """Over one that hovers at 20 m: 5 m and the errors of both heights, 5 m."""
    (tmp_path / "a.param").write_text(f"RTL_ALT,{altitude_cm}\n")
    round_it = mission(
        up(20), place(0, 60, 20), place(200, 60, 20), place(200, 0, 20), item(21, north(200), 0.0)
    )
    hover = mission(up(20), place(100, 0, 20, 600.0), rtl())
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 100, -60) + vehicles("b")
    tables += vehicles("a", more=f'params = "{tmp_path}/a.param"')
    result = both(tables, round_it, hover)
    assert (told(result, "S115") == []) is is_clear
    assert (result.verdict == "go") is is_clear


def test_the_spread_of_times_counts_as_errors_of_the_starts_do() -> None:
    """One leaves where the other comes to 25 s later, after 10 min: a spread of 4 % is more, none is not."""
    long = mission(up(20), place(100, 0, 20, 600.0), place(200, 0, 20), rtl())
    beside = mission(up(20), place(100, 60, 20, 600.0), place(200, 0, 20), rtl())
    for model, is_clear in (("falkowski-2023-quadrotor", True), ("px4-quad-2kg", False)):
        tables = SEPARATION + pad("a", 0, 0) + pad("b", 0, 60) + vehicles("a", "b", model=model)
        assert (told(both(tables, long, beside, 25.0), "S101") == []) is is_clear, model


def test_px4_and_ardupilot_are_kept_apart_in_one_fleet() -> None:
    tables = SEPARATION + PADS + vehicles("a") + vehicles("b", model="px4-quad-2kg")
    result = both(tables, TO_B)
    flown_by = {one.assessment.setup.flown_by.value for one in result.sorties if one.assessment}
    assert flown_by == {"ardupilot", "px4"}
    assert told(result, "S101") or told(result, "S114")


def test_a_vehicle_with_a_downwash_of_its_own_needs_more_below_it() -> None:
    """The upper asks for 12 m below it in place of 5 m; both heights may be wrong by 2.5 m."""
    high = mission(up(33), place(100, 200, 33), place(100, 0, 33), place(100, 200, 33), rtl())
    for more, is_clear in (("", True), ("below_m = 12\n", False)):
        tables = SEPARATION + PADS + vehicles("a") + vehicles("b", more=more)
        result = both(tables, TO_B, high)
        assert (told(result, "S114") == []) is is_clear


def test_one_that_stands_on_the_track_of_a_take_off_is_told() -> None:
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 0, 3) + vehicles("a", "b")
    result = both(tables, OUT, mission(up(20), place(100, 3, 20), rtl()), 500.0)
    [message] = told(result, "S116")
    assert message.startswith("s1 (a) and s2 (b) are 3.0 m apart near the ground")


def test_the_same_file_flown_twice_by_one_vehicle_is_two_sorties() -> None:
    tables = pad("a", 0, 0) + vehicles("a") + SWAP
    result = checked(tables, sortie("s1", "a", 0.0), sortie("s2", "a", 500.0))
    assert (result.verdict, result.totals.sorties) == ("go", 2)


def test_a_fleet_file_that_changes_while_it_is_planned_is_not_written_over_another(
    tmp_path: Path,
) -> None:
    write_mission(OUT, tmp_path / "out.plan")
    file = tmp_path / "fleet.toml"
    file.write_text(
        'schema = 1\n[job.out]\nmission = "out.plan"\n' + pad("a", 0, 0) + vehicles("a")
    )
    fleet = read_fleet(file)
    assert "[pad.a]" in fleet_file_text(fleet, tmp_path)
    file.write_text(file.read_text() + "available_from_s = 60\n")
    with pytest.raises(FleetFileError, match="has changed since it was read"):
        fleet_file_text(fleet, tmp_path)


def test_a_plan_in_another_folder_names_what_lies_beside_the_fleet_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the folder of the file itself too, where its paths are as short as names."""
    monkeypatch.chdir(tmp_path)
    write_mission(OUT, tmp_path / "out.plan")
    (tmp_path / "a.param").write_text("RTL_ALT,3000\n")
    tables = pad("a", 0, 0) + vehicles("a", more='params = "a.param"')
    (tmp_path / "fleet.toml").write_text(
        'schema = 1\n[job.out]\nmission = "out.plan"\n' + tables, encoding="utf-8"
    )
    written = fleet_file_text(read_fleet("fleet.toml"), "planned")
    assert 'params = "../a.param"' in written
    assert 'mission = "../out.plan"' in written
    assert 'model = "arducopter-sitl-quad"' in written
