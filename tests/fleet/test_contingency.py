"""What becomes of a fleet where one thing goes otherwise: who is out, weak, late, or on the way home."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from made_fleet import OUT, PACK, SEPARATION, SWAP, checked, pad, place, sortie, up, vehicles
from made_missions import mission, rtl

from planner.cli.main import main
from planner.mission.files import write_mission

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import Mission
    from planner.service.fleet_contingency import Contingency

PADS = pad("a", 0, 0) + pad("b", 0, 200)
TWO = SEPARATION + PADS + vehicles("a", "b")
ON_P = 'pack = "P"'


def rows(*tables: str, **missions: Mission) -> dict[str, Contingency]:
    """What becomes of a fleet, by kind and name."""
    result = checked(*tables, what_if=True, **missions)
    assert result.contingencies is not None
    return {f"{one.kind} {one.subject}": one for one in result.contingencies}


def test_nobody_asks_and_nothing_is_judged() -> None:
    assert checked(TWO, sortie("s1", "a", 0.0)).contingencies is None


def test_another_vehicle_takes_over_once_it_is_back_and_ready() -> None:
    both = sortie("s1", "a", 0.0), sortie("s2", "b", 0.0, job="far")
    far = mission(up(20), place(100, 200, 20), rtl())
    found = rows(TWO, SWAP, *both, out=OUT, far=far)
    planned = {one.name: one for one in checked(TWO, SWAP, *both, out=OUT, far=far).sorties}
    out = found["vehicle-out a"]
    [taken] = out.takeovers
    assert out.holds
    assert (out.sorties, taken.sortie, taken.vehicle) == (("s1",), "s1", "b")
    other = planned["s2"].assessment
    assert other is not None
    # its landing, a swap of 60 s, and what its model may be slower by
    slow_s = (other.totals.time_s_p90 or 0.0) - other.totals.time_s
    assert taken.start_s == pytest.approx(planned["s2"].end_s + 60.0 + slow_s)


def test_a_vehicle_that_is_not_equipped_takes_nothing_over() -> None:
    camera = '[job.out]\nmission = "out.plan"\nneeds = ["camera"]\n'
    tables = SEPARATION + PADS + vehicles("a", more='equipment = ["camera"]') + vehicles("b")
    out = rows(camera, tables, sortie("s1", "a", 0.0), out=OUT)["vehicle-out a"]
    assert (out.holds, out.takeovers) == (False, ())
    assert out.why == "nobody takes over s1: there is no other vehicle with camera"


def test_what_leaves_no_room_beside_the_plan_is_planned_again() -> None:
    """The job of the vehicle that is out is due before the other is back from its own, which is not."""
    [alone] = checked(SEPARATION + PADS + vehicles("b"), sortie("s1", "b", 0.0)).sorties
    due = f'[job.due]\nmission = "due.plan"\nlatest_s = {alone.time_s + 20.0!r}\n'
    sorties = sortie("s1", "a", 0.0, job="due"), sortie("s2", "b", 0.0, job="far")
    far = mission(up(20), place(100, 200, 20), rtl())
    out = rows(TWO, due, *sorties, due=OUT, far=far)["vehicle-out a"]
    assert out.holds
    assert [one.sortie for one in out.takeovers] == ["s1", "s2"]
    assert out.takeovers[0].start_s == 0.0
    assert out.takeovers[1].start_s > out.takeovers[0].end_s


LONG = mission(up(20), *(place(100.0 * n, 0, 20, 120.0) for n in range(1, 6)), rtl())
"""Some 13 min: more than half of 46 Wh, 34.3 Wh are taken by 16 min of hovering."""


@pytest.mark.parametrize("may_split", ["true", "false"])
def test_what_is_too_much_for_the_other_battery_is_split_anew(may_split: str) -> None:
    tables = SEPARATION + PADS + SWAP + vehicles("a", "b", model="falkowski-2023-quadrotor")
    packs = '[pack.P]\nbattery = "77Wh"\nfits = ["a"]\n'
    packs += '[pack.Q]\nbattery = "27Wh"\ncount = 3\nfits = ["b"]\n'
    job = f'[job.far]\nmission = "far.plan"\nmay_split = {may_split}\n'
    out = rows(tables, packs, job, sortie("s1", "a", 0.0, job="far", more=ON_P), far=LONG)[
        "vehicle-out a"
    ]
    if may_split == "false":
        assert out.why.startswith("nobody takes over s1: ")
        assert out.takeovers == ()
        return
    assert out.holds
    first, second = out.takeovers
    assert (first.sortie, first.vehicle, first.pack) == ("s1-01of02", "b", "Q-1")
    assert (second.sortie, second.vehicle, second.pack) == ("s1-02of02", "b", "Q-2")
    # the swap of 60 s, and what its model may be slower by
    assert second.start_s >= first.end_s + 60.0


def test_the_other_pack_is_named_where_one_is_too_weak() -> None:
    hover = mission(up(20), place(50, 0, 20, 900.0), rtl())
    tables = pad("a", 0, 0) + vehicles("a", model="falkowski-2023-quadrotor") + SWAP
    packs = '[pack.P]\nbattery = "46Wh"\n[pack.Q]\nbattery = "77Wh"\n'
    weak = rows(tables, packs, sortie("s1", "a", 0.0, more=ON_P), out=hover)["weak-pack P"]
    # 34.3 Wh are taken: 46 Wh leave 25 %, 41.4 Wh 17 %
    assert weak.holds is False
    assert [one.pack for one in weak.takeovers] == ["Q"]
    health = packs.replace('"46Wh"\n', '"46Wh"\nbattery_health = "90%"\n')
    told = checked(tables, health, sortie("s1", "a", 0.0, more=ON_P), out=hover)
    assert told.verdict == "no-go"  # as the check with that health says


def test_who_waits_for_a_late_one_is_late_too() -> None:
    [alone] = checked(pad("a", 0, 0) + vehicles("a"), sortie("s1", "a", 0.0)).sorties
    assert alone.assessment is not None
    slow_s = (alone.assessment.totals.time_s_p90 or 0.0) - alone.time_s
    again_s = alone.time_s + 60.0 + 4.0
    tables = "[separation]\nhorizontal_m = 5\nstart_error_s = 10\n" + pad("a", 0, 0)
    tables += vehicles("a") + SWAP + sortie("s1", "a", 0.0) + sortie("s2", "a", again_s)
    # 4 s are left in between, so 10 s and the spread of the first delay the second by 6 s and it
    limit_s = again_s + alone.time_s + 6.0 + slow_s
    for latest_s, holds in ((limit_s - 0.1, False), (limit_s + 0.1, True)):
        found = rows(tables, f"[operation]\nlatest_s = {latest_s!r}\n")["late s1"]
        assert found.holds is holds
        assert found.sorties == ("s1", "s2")


def test_a_no_go_is_not_told_twice() -> None:
    near = SEPARATION + pad("a", 0, 0) + pad("b", 0, 8) + vehicles("a", "b")
    result = checked(near, sortie("s1", "a", 0.0), sortie("s2", "b", 0.0), what_if=True)
    assert result.contingencies is not None
    late = next(one for one in result.contingencies if one.subject == "s1")
    assert (late.holds, late.is_as_planned) == (False, True)
    assert late.why.startswith("the plan itself is a no-go: S1")
    assert not {one.finding.code for one in result.findings} & {"S123", "S124"}


def test_what_the_file_must_survive_is_an_error_without_being_asked_for() -> None:
    asked = '[operation]\nmust_survive = ["vehicle-out"]\n'
    result = checked(pad("a", 0, 0) + vehicles("a"), asked, sortie("s1", "a", 0.0))
    assert result.verdict == "no-go"
    assert {one.finding.code for one in result.findings} == {"S118", "S122"}
    assert result.contingencies is not None
    assert {one.kind.value for one in result.contingencies} == {"vehicle-out"}


def test_what_was_too_near_as_planned_may_be_clear_as_it_is_taken_over() -> None:
    """With one of the two out the other flies both, one after the other."""
    head_on = mission(up(20), place(100, 0, 20), place(100, 200, 20), rtl())
    back = mission(up(20), place(100, 200, 20), place(100, 0, 20), place(100, 200, 20), rtl())
    both = sortie("s1", "a", 0.0, job="there"), sortie("s2", "b", 0.0, job="back")
    found = rows(TWO, *both, there=head_on, back=back)
    assert found["vehicle-out a"].holds
    assert found["vehicle-out b"].holds
    assert found["late s1"].is_as_planned


def test_the_ledger_says_which_contingencies_were_judged() -> None:
    tables = pad("a", 0, 0) + vehicles("a", model="falkowski-2023-quadrotor") + SWAP
    asked = '[operation]\nmust_survive = ["late", "weak-pack"]\n[pack.P]\nbattery = "77Wh"\n'
    result = checked(tables, asked, sortie("s1", "a", 0.0, more=ON_P))
    ledger = {one.code: (one.outcome.value, one.needs) for one in result.checked}
    assert ledger["S122"] == ledger["S125"] == ("not-applicable", "--what-if")
    assert ledger["S123"] == ("checked", "")
    assert ledger["S124"][0] == "not-checked"
    assert ledger["S124"][1].startswith("no start_error_s")


def test_what_cannot_be_judged_and_must_be_survived_is_never_a_go() -> None:
    tables = pad("a", 0, 0) + vehicles("a", model="falkowski-2023-quadrotor")
    asked = '[operation]\nmust_survive = ["late"]\n'
    result = checked(tables, asked, sortie("s1", "a", 0.0))
    assert (result.verdict, result.verdict_text) == ("no-go", "NOT CHECKED")


def test_rows_are_shown_and_are_in_the_document(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_mission(OUT, tmp_path / "out.plan")
    file = tmp_path / "fleet.toml"
    first = sortie("s1", "a", 0.0, more=ON_P)
    text = 'schema = 1\n[job.out]\nmission = "out.plan"\n' + TWO + SWAP + PACK + first
    file.write_text(text)
    assert main(["fleet", "check", str(file), "--what-if"]) == 0
    shown = capsys.readouterr().out
    lines = [" ".join(line.split()) for line in shown.splitlines()]
    assert "a is out yes s1 by b on P at 0:00" in lines
    assert main(["fleet", "check", str(file), "--what-if", "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    out, weak, *_ = document["contingencies"]
    assert (out["kind"], out["subject"], out["holds"]) == ("vehicle-out", "a", True)
    assert out["takeovers"][0]["pack"] == "P"
    assert weak["what"] == "P has 10 % less health"
    assert main(["fleet", "check", str(file), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["contingencies"] is None
    file.write_text(text + '[operation]\nmust_survive = ["storm"]\n')
    assert main(["fleet", "check", str(file)]) == 2
    assert "operation.must_survive: must be of vehicle-out, weak-pack" in capsys.readouterr().err
