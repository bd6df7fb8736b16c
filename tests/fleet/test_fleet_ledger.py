"""What became of each rule about a fleet: nothing that was not looked at counts as checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_fleet import OUT, PACK, SEPARATION, SWAP, checked, pad, sortie, vehicles

from planner.report.fleet import fleet_text
from planner.report.text import Medium
from planner.rules.ledger import Outcome
from planner.values import replace

if TYPE_CHECKING:
    from planner.service.fleet import FleetResult

BOTH = (SEPARATION, sortie("first", "one", 0.0), sortie("second", "two", 400.0))


def outcomes(result: FleetResult) -> dict[str, tuple[Outcome, str]]:
    return {entry.code: (entry.outcome, entry.needs) for entry in result.checked}


@pytest.mark.parametrize(
    ("tables", "code", "outcome", "needs"),
    [
        ((vehicles("one", "two"), *BOTH), "S101", Outcome.CHECKED, ""),
        ((vehicles("one", "two"), *BOTH), "S102", Outcome.NOT_CHECKED, "system_id"),
        (
            (vehicles("one", more="system_id = 1"), vehicles("two", more="system_id = 2"), *BOTH),
            "S102",
            Outcome.CHECKED,
            "",
        ),
        ((vehicles("one", "two"), *BOTH), "S105", Outcome.NOT_CHECKED, "pack"),
        ((vehicles("one", "two"), *BOTH), "S109", Outcome.CHECKED, ""),
        ((vehicles("one", "two"), *BOTH), "S117", Outcome.NOT_APPLICABLE, "layers"),
        ((vehicles("one", "two"), *BOTH), "S122", Outcome.NOT_APPLICABLE, "--what-if"),
        (
            (vehicles("one"), SWAP, PACK, sortie("first", "one", 0.0, more='pack = "P"')),
            "S106",
            Outcome.CHECKED,
            "",
        ),
        (
            (vehicles("one"), SWAP, PACK, sortie("first", "one", 0.0, more='pack = "P"')),
            "S115",
            Outcome.NOT_APPLICABLE,
            "several vehicles",
        ),
        (
            ("[operation]\nmust_survive = ['late']\n", vehicles("one", "two"), *BOTH),
            "S124",
            Outcome.CHECKED,
            "",
        ),
    ],
)
def test_a_rule_is_checked_only_where_all_it_needs_is_there(
    tables: tuple[str, ...], code: str, outcome: Outcome, needs: str
) -> None:
    result = checked(pad("one", 0, 0), pad("two", 0, 80), *tables)
    found = outcomes(result)[code]
    assert found[0] is outcome
    assert needs in found[1]
    assert bool(found[1]) is (outcome is not Outcome.CHECKED)


def test_without_the_height_of_a_home_no_separation_is_checked() -> None:
    nowhere = (pad("one", 0, 0) + pad("two", 0, 80)).replace("amsl_m = 400\n", "")
    assert OUT.home is not None
    unknown = replace(OUT, home=replace(OUT.home, altitude_amsl_m=0.0))
    found = outcomes(checked(nowhere, vehicles("one", "two"), *BOTH, out=unknown))
    for code in ("S101", "S114", "S115", "S116"):
        assert found[code][0] is Outcome.NOT_CHECKED
    assert found["S108"][0] is Outcome.CHECKED


def test_the_report_says_what_was_not_checked() -> None:
    result = checked(pad("one", 0, 0), pad("two", 0, 80), vehicles("one", "two"), *BOTH)
    text = fleet_text(result, medium=Medium())
    # what the verdict holds for, beside it
    assert text.splitlines()[1] == "arducopter-sitl-quad, battery 178 Wh, no wind"  # 8 Ah at 22.2 V
    assert "not checked (needs system_id of every vehicle): S102 duplicate-sysid" in text
