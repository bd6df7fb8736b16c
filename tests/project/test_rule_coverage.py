"""Every rule is tried three times: where it fires, where it does not, and on its limit.

The cases stand by family in tests/rule_cases; a rule without them does not pass.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from planner import catalogue

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rule_cases.case import RuleCases

FAMILIES = sorted(
    path.stem
    for path in (Path(__file__).parents[1] / "rule_cases").glob("*.py")
    if path.stem != "case"
)
BY_FAMILY = {name: import_module(f"rule_cases.{name}").CASES for name in FAMILIES}
CASES: dict[str, RuleCases] = {
    code: cases for family in BY_FAMILY.values() for code, cases in family.items()
}
CODES = sorted(CASES)


def test_every_rule_of_the_catalogue_has_its_three_cases_once() -> None:
    assert set(CASES) ^ set(catalogue.rules()) == set()
    assert len(CASES) == sum(len(family) for family in BY_FAMILY.values())


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_told_where_its_text_says(code: str) -> None:
    findings = [finding for finding in CASES[code].fires() if finding.code == code]
    assert findings
    assert list(_miscounted(*(finding.message for finding in findings))) == []


@pytest.mark.parametrize("code", CODES)
def test_a_rule_keeps_quiet_about_what_is_near_and_right(code: str) -> None:
    assert [finding.message for finding in CASES[code].silent() if finding.code == code] == []


@pytest.mark.parametrize("code", CODES)
def test_a_rule_takes_its_limit_as_its_text_says(code: str) -> None:
    told = [finding.message for finding in CASES[code].boundary() if finding.code == code]
    assert bool(told) is CASES[code].fires_at_boundary, told


def _miscounted(*messages: str) -> Iterator[str]:
    """Yield ``1 parts`` and the like, but not ``item 1 takes``."""
    for message in messages:
        for word, counted in re.findall(
            r"(\w*)[ (]*(?<![\w.,/])(1 (?:more |[A-Z]+ )?[a-z]{3,}s)\b", message
        ):
            if word not in _NUMBERED:
                yield counted


_NUMBERED = {"item", "point", "polygon", "circle", "flight", "vertex", "instance", "line"}
