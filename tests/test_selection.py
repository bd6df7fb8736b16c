"""Which findings are reported: each way to turn one off, and its negation."""

from __future__ import annotations

import pytest

from planner.findings import Finding, Severity
from planner.selection import Exemption, Selection


def _finding(code: str, *, item: int | None = None, severity: int = 1) -> Finding:
    return Finding(
        code=code, name="made-up", severity=Severity(severity), message="so it is", item=item
    )


E107, E105, F102 = _finding("E107", severity=2), _finding("E105", item=3), _finding("F102", item=3)


def _reported(selection: Selection, *findings: Finding) -> list[str]:
    reported, suppressed = selection.divide(findings, file="site.plan")
    assert len(reported) + len(suppressed) == len(findings), "none is dropped"
    assert all(finding.suppression for finding in suppressed), "each says why"
    assert not any(finding.suppression for finding in reported)
    return [finding.code for finding in reported]


def test_as_it_stands_everything_is_reported() -> None:
    assert _reported(Selection(), E107, E105, F102) == ["E107", "E105", "F102"]


@pytest.mark.parametrize(
    ("selection", "codes"),
    [
        (Selection(select=("E",)), ["E107", "E105"]),
        (Selection(select=("F102", "E107")), ["E107", "F102"]),
        (Selection(ignore=("E1",)), ["F102"]),
        (Selection(select=("E",), ignore=("E105",)), ["E107"]),
        (Selection(select=("E",), extend_select=("F",)), ["E107", "E105", "F102"]),
        (Selection(ignore=("E",), extend_select=("E105",)), ["E105", "F102"]),
        (Selection(extend_select=("F",)), ["E107", "E105", "F102"]),
    ],
)
def test_codes_are_chosen_by_their_beginning(selection: Selection, codes: list[str]) -> None:
    assert _reported(selection, E107, E105, F102) == codes


def test_an_exemption_of_an_item_holds_for_that_item_alone() -> None:
    selection = Selection(exemptions=(Exemption(codes=("F1",), item=3, origin="here"),))
    assert _reported(selection, F102) == []
    assert _reported(selection, _finding("F102", item=4)) == ["F102"]
    assert _reported(selection, _finding("F102")) == ["F102"]
    assert _reported(selection, E105) == ["E105"]


def test_an_exemption_of_a_file_holds_for_every_item_and_for_none() -> None:
    selection = Selection(exemptions=(Exemption(codes=("F1",), origin="here"),))
    assert _reported(selection, F102, _finding("F102"), E105) == ["E105"]


def test_an_exemption_is_stronger_than_extend_select() -> None:
    selection = Selection(
        extend_select=("F",), exemptions=(Exemption(codes=("F102",), origin="here"),)
    )
    assert _reported(selection, F102) == []


def test_the_reason_names_what_turned_the_finding_off() -> None:
    def reason(selection: Selection) -> str:
        [suppressed] = selection.divide([F102], file="site.plan")[1]
        return suppressed.suppression

    assert reason(Selection(select=("E",))) == "not among the selected codes E"
    assert reason(Selection(ignore=("A", "F1"))) == "ignored as F1"
    exemption = Exemption(codes=("F102",), item=3, origin="site.plan#3 in mavjoule.toml")
    assert reason(Selection(exemptions=(exemption,))) == "ignored by site.plan#3 in mavjoule.toml"


def test_both_parts_stand_worst_first_then_by_item() -> None:
    findings = [F102, _finding("E105", item=1), E107, _finding("X902", severity=0)]
    reported, _ = Selection().divide(findings, file="site.plan")
    assert [finding.code for finding in reported] == ["E107", "E105", "F102", "X902"]
    _, suppressed = Selection(select=("Z",)).divide(findings, file="site.plan")
    assert [finding.code for finding in suppressed] == ["E107", "E105", "F102", "X902"]
