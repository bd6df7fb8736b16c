"""``mavjoule explain``: one rule in full."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from planner import __version__, catalogue
from planner.catalogue.px4_events import PX4_EVENTS
from planner.cli.format_option import format_option
from planner.cli.output import standard_medium, write_data
from planner.errors import UsageError, nearest_hint
from planner.report.json import rule_json
from planner.report.rule_text import rule_text

if TYPE_CHECKING:
    from planner.findings import Rule


def _offers(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[str]:
    rules = catalogue.rules()
    known = [*rules, *(rule.name for rule in rules.values()), *PX4_EVENTS]
    return [text for text in known if text.lower().startswith(incomplete.lower())]


@click.command("explain", short_help="Explain a rule, and how to turn it off.")
@click.argument("code", shell_complete=_offers)
@format_option("text", "json")
def command(code: str, *, file_format: str) -> None:
    """Explain a rule: what it says, why, how it is computed, what to do.

    CODE is the rule's code, such as E101, its name, or the name of PX4's event, such as
    navigator_mis_takeoff_missing.
    """
    rule = _rule(code)
    write_data(
        rule_json(rule, version=__version__)
        if file_format == "json"
        else rule_text(rule, medium=standard_medium())
    )


def _rule(code: str) -> Rule:
    rules = catalogue.rules()
    names = {rule.name: rule for rule in rules.values()}
    of_event = PX4_EVENTS.get(code.lower(), code)
    rule = rules.get(of_event.upper()) or names.get(code.lower())
    if rule is None:
        hint = nearest_hint(code, [*rules, *names, *PX4_EVENTS])
        msg = f"there is no rule {code!r}{hint} (mavjoule rules)"
        raise UsageError(msg)
    return rule
