"""Every rule is declared once, reported by something, and tried where it fires, beside and on its limit.

The cases are by subject in tests/rule_cases; a rule without them does not pass.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from generate_catalogue import CASES, declared, example

from planner import catalogue
from planner.findings import Severity
from planner.selection import Baseline, Exemption, KnownFinding, Selection, write_baseline

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from planner.findings import Finding

CODES = sorted(CASES)

GRAVE = re.compile(
    r"\b(PX4|ArduPilot|vehicle) (refuses|does not (start|arm|continue)|will not|cannot)\b"
    r"|\bnever (lands|continues|ends)\b|\bends in the air\b|\bover 100 %|\bcannot (hover|lift|fly)\b"
    r"|\bthe battery is empty\b|\bcannot be (checked|flown|judged)\b"
    r"|(?<!\d)(1\d[1-9]|1[1-9]\d|[2-9]\d\d|\d{4,}) % of the (battery|charge|thrust)\b"
)
EXCEPTIONS: dict[str, str] = {
    "L211": "mavjoule split adds the return itself",
    "A112": "says how ArduPilot follows the ground; whether it clears it is A104's and A116's",
}
"""Rules whose words are grave and whose matter is not, each with the reason."""
CANNOT_WORK = re.compile(
    GRAVE.pattern
    + r"|\b(refuses|refused|does not arm|not arm|does not start|does not take off|holds? no more)\b"
    r"|\bnot enough\b|\bempty\b|\b(takes|holds) (at most )?\d"
)
FLIGHT = "AEFMPTWX"
"""Families about one flight."""
TASTE = {
    "M111": "a multicopter may fly what looks like an aircraft's: the fix says to ignore it then"
}
"""Errors that somebody who knows better may accept, each with the reason."""


def test_every_rule_is_declared_once_and_has_its_three_cases() -> None:
    entries = catalogue.entries()
    assert {code: (entry.name, entry.module) for code, entry in entries.items()} == declared()
    assert list(entries) == CODES
    assert len({entry.name for entry in entries.values()}) == len(CODES)


def test_the_texts_of_a_rule_are_sentences_and_its_fix_is_none() -> None:
    for rule in catalogue.rules().values():
        for text in (rule.summary, rule.why, rule.how):
            assert text.endswith("."), rule.code
            assert not re.search(r"[a-z0-9)]\. [A-Z]|[^.?!:]  |\b(\w+) \1\b", text), rule.code
        for text in (rule.fix, catalogue.entries()[rule.code].example):
            assert not text.endswith("."), rule.code


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_reported_where_its_text_says_and_its_example_is_its_message(
    code: str, tmp_path: Path
) -> None:
    findings = list(CASES[code].fires())
    assert list(_miscounted(*(one.message for one in findings if one.code == code))) == []
    assert _too_mild(findings) == []
    assert _accepted(findings, tmp_path) == []
    assert catalogue.entries()[code].example == example(code, findings), "make rules"


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_silent_about_what_is_near_and_right(code: str) -> None:
    findings = CASES[code].silent()
    assert [finding.message for finding in findings if finding.code == code] == []
    assert _too_mild(findings) == []


@pytest.mark.parametrize("code", CODES)
def test_a_rule_takes_its_limit_as_its_text_says(code: str, tmp_path: Path) -> None:
    findings = CASES[code].boundary()
    found = [finding.message for finding in findings if finding.code == code]
    assert bool(found) is CASES[code].fires_at_boundary, found
    assert _too_mild(findings) == []
    assert _accepted(findings, tmp_path) == []


def test_a_rule_whose_summary_says_that_it_cannot_work_is_an_error() -> None:
    rules = [catalogue.rule(code) for code in catalogue.entries()]
    mild = {
        rule.code
        for rule in rules
        if GRAVE.search(rule.summary) and rule.severity is not Severity.ERROR
    }
    assert mild - set(EXCEPTIONS) == set()


def test_a_rule_whose_text_says_that_a_flight_cannot_work_names_what_to_give_instead() -> None:
    without = {
        code
        for code, rule in catalogue.rules().items()
        if code[0] in FLIGHT
        and code not in TASTE
        and rule.severity is Severity.ERROR
        and CANNOT_WORK.search(f"{rule.summary} {rule.why}")
        and not rule.instead
    }
    assert without == set()


def _accepted(findings: Iterable[Finding], folder: Path) -> list[tuple[str, str]]:
    """Return the errors that say what cannot work and that some setting accepts."""
    return [
        (one.code, one.message)
        for one in findings
        if one.severity is Severity.ERROR
        and CANNOT_WORK.search(one.message)
        and one.code[0] in FLIGHT
        and one.code not in TASTE
        and (
            write_baseline(folder / "known.json", [("a.plan", one)]) != (0, 1)
            or any(
                each.reason(one, file=str(folder / "a.plan")) is not None
                for each in _accepting(one, folder)
            )
        )
    ]


def _accepting(one: Finding, folder: Path) -> Iterator[Selection]:
    """Yield each way in which settings may accept a finding, a baseline written by hand among them."""
    known = KnownFinding(
        file="a.plan",
        item=one.item or 0,
        code=one.code,
        severity=one.severity.label,
        message=one.message,
    )
    yield Selection(select=("Z",))
    yield Selection(ignore=(one.code[0], one.code))
    yield Selection(exemptions=(Exemption(codes=(one.code,), origin="[per_file_ignores]"),))
    yield Selection(baseline=Baseline(source="b", folder=folder, known=frozenset({known})))


def _too_mild(findings: Iterable[Finding]) -> list[tuple[str, str]]:
    """Return the findings that say what cannot work and are no errors."""
    return [
        (one.code, one.message)
        for one in findings
        if GRAVE.search(one.message)
        and one.severity is not Severity.ERROR
        and one.code not in EXCEPTIONS
    ]


def _miscounted(*messages: str) -> Iterator[str]:
    """Yield ``1 parts`` and the like, but not ``item 1 takes``."""
    for message in messages:
        for word, counted in re.findall(
            r"(\w*)[ (]*(?<![\w.,/])(1 (?:more |[A-Z]+ )?[a-z]{3,}s)\b", message
        ):
            if word not in _NUMBERED:
                yield counted


_NUMBERED = {"item", "point", "polygon", "circle", "flight", "vertex", "instance", "line"}
