"""What was not checked, what flies and what a file has set: named in every face of a result."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from planner.cli.check_output import rendered
from planner.errors import ExitCode
from planner.report.comparison import comparison_json, comparison_text
from planner.report.github import github_summary
from planner.report.html.page import check_html
from planner.report.sarif import check_sarif
from planner.report.split import split_json, split_text
from planner.report.text import Medium
from planner.rules.ledger import LedgerEntry, Outcome
from planner.rules.model import NO_VEHICLE
from planner.service.comparison import compare_results
from planner.service.split import Split, SplitPart
from planner.setup import FORMATS, Output, SettingsFile
from planner.tui.checked import Checked
from planner.tui.details import flight_details, left_open_details, summary
from planner.tui.rows import finding_table
from planner.tui.screens.checklist import checklist_table
from planner.tui.screens.missions import MissionEntry, mission_table, preview
from planner.tui.what_if import WhatIf
from planner.tui.widgets.bars import verdict_line
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.service.preflight import CheckResult

OPEN = LedgerEntry(
    code="A102", name="below-terrain", outcome=Outcome.NOT_CHECKED, needs="terrain: --terrain"
)
LEDGER = (
    LedgerEntry(code="A101", name="item-below-home", outcome=Outcome.CHECKED),
    OPEN,
    LedgerEntry(
        code="F101",
        name="fence-breach",
        outcome=Outcome.NOT_APPLICABLE,
        needs="a fence in the mission or the parameters",
    ),
)
PLAIN = Medium()
NOWHERE = Path("/repository")


@pytest.fixture
def partly(flown: CheckResult) -> CheckResult:
    """The flight, of which one rule was not checked."""
    return replace(flown, checked=LEDGER)


def _page(result: CheckResult) -> str:
    from datetime import UTC, datetime

    return check_html([result], version="1.2.3", made_at=datetime(2026, 11, 22, tzinfo=UTC))


def _split(result: CheckResult) -> Split:
    part = SplitPart(
        file="part-01.plan",
        first_item=1,
        last_item=3,
        begins_m=None,
        ends_m=None,
        flown_twice_m=0.0,
        first_own_item=1,
        last_own_item=3,
        text="",
        result=result,
    )
    return Split(file="site.plan", whole=result, parts=(part,), findings=())


def _review(result: CheckResult) -> str:
    """Return everything the terminal UI says of a result."""
    entry = MissionEntry(path="site.plan", name="site.plan")
    table = mission_table([entry], {"site.plan": result})
    findings = finding_table(result.findings, [one for one in result.checked if one is OPEN])
    shown = Checked(
        file="site.plan",
        what_if=WhatIf(settings={}, given={}, changes={}),
        sha256=None,
        result=result,
    )
    checklist = checklist_table(shown, done=frozenset(), opened=frozenset("A"))
    brief = summary(result)
    return "\n".join(
        map(
            str,
            (
                verdict_line(brief),
                brief,
                flight_details(result),
                preview(entry, result),
                *(table.row(row)[0] for row in range(len(table))),
                *(findings.row(row)[0] for row in range(len(findings))),
                *(checklist.row(row)[0] for row in range(len(checklist))),
            ),
        )
    )


def _rendered(name: str) -> Callable[[CheckResult], str]:
    return lambda result: rendered([result], Output(format=name), exit_code=ExitCode.GO)


FACES: dict[str, Callable[[CheckResult], str]] = {
    **{name: _rendered(name) for name in FORMATS},
    "summary of a workflow": lambda result: github_summary([result], folder=NOWHERE),
    "page": _page,
    "comparison": lambda result: comparison_text(compare_results(result, result), medium=PLAIN),
    "comparison as JSON": lambda result: comparison_json(
        compare_results(result, result), version="1.2.3"
    ),
    "split": lambda result: split_text(_split(result), medium=PLAIN),
    "split as JSON": lambda result: split_json(_split(result), version="1.2.3"),
    "review": _review,
}


@pytest.mark.parametrize("face", FACES)
def test_what_was_not_checked_and_what_it_needs_is_in_every_face(
    partly: CheckResult, flown: CheckResult, face: str
) -> None:
    text = FACES[face](partly)
    assert "terrain: --terrain" in text
    if face != "split":  # its lines have room for what is missing alone
        assert "A102" in text
    assert "terrain: --terrain" not in FACES[face](flown)


@pytest.mark.parametrize("face", FACES)
def test_a_prediction_for_nobodys_vehicle_is_labelled_in_every_face(
    flown: CheckResult, face: str
) -> None:
    finding = NO_VEHICLE.finding("no vehicle named: predicted for quad, which is not your drone")
    setup = replace(flown.setup, is_vehicle_named=False)
    text = FACES[face](replace(flown, setup=setup, findings=(finding,), verdict="no-go"))
    says = ("no vehicle named", "No vehicle named", '"is_vehicle_named": false')
    assert any(one in text for one in says)
    if face != "sarif":  # it holds the catalogue
        assert not any(one in FACES[face](flown) for one in says)


@pytest.mark.parametrize(
    "face", ["text", "json", "json-lines", "page", "comparison", "comparison as JSON", "review"]
)
def test_what_a_file_has_set_is_named_in_every_face_that_pilots_read(
    flown: CheckResult, face: str
) -> None:
    file = SettingsFile(
        path="/site/mavjoule.toml", values=(("battery", "4000Wh"), ("ignore", "M109"))
    )
    text = FACES[face](replace(flown, setup=replace(flown.setup, settings_file=file)))
    for word in ("/site/mavjoule.toml", "battery", "4000Wh", "ignore", "M109"):
        assert word in text


def test_a_rule_not_checked_is_a_skipped_case_and_never_a_passed_one(partly: CheckResult) -> None:
    from xml.etree import ElementTree as ET

    root = ET.fromstring(FACES["junit"](partly))
    [case] = [one for one in root.iter("testcase") if "A102" in one.attrib["name"]]
    assert [child.tag for child in case] == ["skipped"]
    assert next(iter(root)).attrib["skipped"] == "1"


def test_sarif_notifies_of_a_rule_not_checked_by_its_place_in_the_catalogue(
    partly: CheckResult,
) -> None:
    from sarif_kit.validate import validation_errors

    from planner import catalogue

    rules = catalogue.rules()
    text = check_sarif(
        [partly], rules=rules, version="1.2.3", exit_code=ExitCode.GO, folder=NOWHERE
    )
    log = json.loads(text)
    assert validation_errors(log) == []
    [run] = log["runs"]
    [note] = run["invocations"][0]["toolConfigurationNotifications"]
    assert note["associatedRule"] == {"id": "A102", "index": list(rules).index("A102")}
    assert [one["code"] for one in run["properties"]["missions"][0]["checks"]] == [
        "A101",
        "A102",
        "F101",
    ]


def test_not_checked_has_a_sign_and_a_colour_of_its_own(flown: CheckResult) -> None:
    finding = NO_VEHICLE.finding("no vehicle named: predicted for quad, which is not your drone")
    left_open = replace(flown, verdict="no-go", findings=(finding,))
    entry = MissionEntry(path="site.plan", name="site.plan")
    table = mission_table([entry], {"site.plan": left_open})
    assert table.row(0)[0][0] == "–"
    assert table.tone_of(entry) == "warning"
    assert str(verdict_line(summary(left_open))).startswith("– NOT CHECKED")
    assert left_open_details(OPEN).tone == "warning"
    coloured = Medium(width=80, is_coloured=True)
    from planner.report.text import check_text

    assert check_text([left_open], medium=coloured).startswith("\x1b[33mNOT CHECKED")


def test_the_checklist_ticks_no_family_of_which_a_rule_was_not_checked(partly: CheckResult) -> None:
    lines = _review(partly).splitlines()
    [altitude] = [line for line in lines if "altitude and terrain" in line]
    assert "–" in altitude
    assert "✔" not in altitude
    assert "1 not checked" in altitude
