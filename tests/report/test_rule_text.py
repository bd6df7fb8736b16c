"""Rules as text."""

from __future__ import annotations

import re
from pathlib import Path

from planner import catalogue
from planner.autopilot import TARGETS, TARGETS_SHOWN
from planner.findings import Rule, Severity
from planner.mission.takers import BOTH, NAME_IT
from planner.report.rule_text import rule_text, rules_text, way_off
from planner.report.text import Medium
from planner.service.preflight import FILE_UNREADABLE
from planner.values import replace

_NAMED = re.compile(r"--target ((?:px4|ardu)[a-z0-9.-]*[a-z0-9])")

RULE = Rule(
    "Z101 made-up",
    Severity.WARNING,
    summary="It says something.",
    why="Because.",
    how="By hand.",
    fix="do it right",
)


def test_a_rule_is_explained_in_full_with_the_way_to_turn_it_off() -> None:
    assert rule_text(RULE, medium=Medium()).splitlines() == [
        "Z101 made-up [warning]",
        "It says something.",
        "",
        "Why:      Because.",
        "",
        "How:      By hand.",
        "",
        "Fix:      do it right",
        "",
        f"Turn off: {way_off(RULE)}",
    ]


def test_the_ways_to_turn_a_rule_off_are_made_from_its_code() -> None:
    assert way_off(RULE) == (
        '--ignore Z101, or ignore = ["Z101"] in mavjoule.toml; for one file or item, under '
        '[per_file_ignores], "site.plan" = ["Z101"] or "site.plan#12" = ["Z101"]; for what is '
        "there already, --baseline."
    )


def test_a_rule_that_takes_part_in_every_verdict_names_what_to_give_instead() -> None:
    kept_on = replace(RULE, instead="--battery", severity=Severity.ERROR)
    assert way_off(kept_on) == "not possible: it takes part in every verdict; give --battery"
    warning = way_off(replace(kept_on, severity=Severity.WARNING))
    assert warning.startswith("--ignore Z101")
    assert warning.endswith("its errors take part in every verdict: give --battery")


def test_that_a_file_cannot_be_read_cannot_be_turned_off() -> None:
    assert way_off(FILE_UNREADABLE).startswith("not possible")


def test_the_list_of_rules_has_a_line_each_under_its_family() -> None:
    off = replace(RULE, title="M105 other", is_default=False)
    assert rules_text([off, RULE]).splitlines() == [
        "M: mission structure",
        "  M105  warning, off  other    It says something.",
        "        = navigator_mis_unsup_cmd",
        "        = navigator_mis_vtol_items",
        "",
        "Z: others",
        "  Z101  warning       made-up  It says something.",
        "",
        "off: asked only where --select or --extend-select names it",
        "= an event of PX4",
    ]


def test_a_rule_that_is_off_says_how_to_turn_it_on() -> None:
    off = rule_text(replace(RULE, is_default=False), medium=Medium())
    assert "Turn on:  --extend-select Z101" in off


def test_every_target_that_is_advised_can_be_typed() -> None:
    package = Path(catalogue.__file__).parent
    texts = [rule_text(rule, medium=Medium()) for rule in catalogue.rules().values()]
    texts += [path.read_text("utf-8") for path in package.rglob("*.py")]
    texts += [path.read_text("utf-8") for path in (package / "report" / "topics").glob("*.md")]
    named = {name for text in [*texts, NAME_IT] for name in _NAMED.findall(text)}
    assert {"px4-1.16", "px4-1.17", "arducopter-4.7"} <= named <= TARGETS.keys()
    assert f"name who flies it (--target {' or '.join(TARGETS_SHOWN)}, or --params)" == NAME_IT
    assert [TARGETS[name].autopilot for name in TARGETS_SHOWN] == [*BOTH]
