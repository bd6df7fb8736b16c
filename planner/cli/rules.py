"""``mavjoule rules``: what is checked."""

from __future__ import annotations

import click

from planner import __version__, catalogue
from planner.cli.format_option import format_option
from planner.cli.output import write_data
from planner.report.json import rules_json
from planner.report.rule_text import rules_text


@click.command("rules")
@format_option("text", "json")
def command(*, file_format: str) -> None:
    """List the rules: code, severity, name and what each says."""
    rules = tuple(catalogue.rules().values())
    write_data(
        rules_json(rules, version=__version__) if file_format == "json" else rules_text(rules)
    )
