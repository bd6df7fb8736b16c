"""Every rule is declared once, reported by something, and tried where it fires, beside and on its limit.

The cases are by subject in tests/rule_cases; a rule without them does not pass.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from generate_catalogue import CASES, declared, example

from planner import catalogue

if TYPE_CHECKING:
    from collections.abc import Iterator

CODES = sorted(CASES)


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
def test_a_rule_is_reported_where_its_text_says_and_its_example_is_its_message(code: str) -> None:
    assert (
        list(_miscounted(*(one.message for one in CASES[code].fires() if one.code == code))) == []
    )
    assert catalogue.entries()[code].example == example(code), "make rules"


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_silent_about_what_is_near_and_right(code: str) -> None:
    assert [finding.message for finding in CASES[code].silent() if finding.code == code] == []


@pytest.mark.parametrize("code", CODES)
def test_a_rule_takes_its_limit_as_its_text_says(code: str) -> None:
    found = [finding.message for finding in CASES[code].boundary() if finding.code == code]
    assert bool(found) is CASES[code].fires_at_boundary, found


def _miscounted(*messages: str) -> Iterator[str]:
    """Yield ``1 parts`` and the like, but not ``item 1 takes``."""
    for message in messages:
        for word, counted in re.findall(
            r"(\w*)[ (]*(?<![\w.,/])(1 (?:more |[A-Z]+ )?[a-z]{3,}s)\b", message
        ):
            if word not in _NUMBERED:
                yield counted


_NUMBERED = {"item", "point", "polygon", "circle", "flight", "vertex", "instance", "line"}
