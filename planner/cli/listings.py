"""``mavjoule models``, ``rules`` and ``explain``: what is shipped, and what is checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from planner import __version__, catalogue
from planner.catalogue import PX4_EVENTS
from planner.cli.options import format_option
from planner.cli.output import standard_medium, write_data
from planner.errors import UsageError, nearest_hint
from planner.report.identification import models_text
from planner.report.json import models_json, rule_json, rules_json
from planner.report.rule_text import rule_text, rules_text
from planner.vehicle.library import load_vehicle, model_names

if TYPE_CHECKING:
    from planner.findings import Rule


@click.command("models")
@format_option("text", "json")
def models(*, file_format: str) -> None:
    """List the shipped vehicle models, for --vehicle."""
    vehicles = [load_vehicle(name) for name in model_names()]
    write_data(
        models_json(vehicles, version=__version__)
        if file_format == "json"
        else models_text(vehicles, medium=standard_medium())
    )


@click.command("rules")
@format_option("text", "json")
def rules(*, file_format: str) -> None:
    """List the rules: code, severity, name and summary."""
    listed = tuple(catalogue.rules().values())
    write_data(
        rules_json(listed, version=__version__) if file_format == "json" else rules_text(listed)
    )


def _offers(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[str]:
    return [text for text in _known() if text.lower().startswith(incomplete.lower())]


@click.command("explain", short_help="Explain a rule, and how to turn it off.")
@click.argument("code", shell_complete=_offers)
@format_option("text", "json")
def explain(code: str, *, file_format: str) -> None:
    """Explain a rule: its meaning, why, how it is computed, what to do.

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
    known = _known()
    name = code.upper() if code.upper() in known else code.lower()
    if name not in known:
        msg = f"no rule {code!r}{nearest_hint(code, known)} (mavjoule rules)"
        raise UsageError(msg)
    return catalogue.rule(known[name])


def _known() -> dict[str, str]:
    entries = catalogue.entries()
    return (
        {code: code for code in entries}
        | {entry.name: code for code, entry in entries.items()}
        | dict(PX4_EVENTS)
    )
