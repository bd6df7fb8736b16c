"""``mavjoule models``, ``rules``, ``explain`` and ``help``: what is shipped, checked and to be read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from planner import __version__, catalogue
from planner.catalogue import PX4_EVENTS
from planner.cli.options import data_options, output_option
from planner.cli.output import standard_medium, write_data
from planner.errors import UsageError, nearest_hint
from planner.report.json import rule_json, rules_json
from planner.report.rule_text import rule_text, rules_text

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Rule


@click.command("models", short_help="List the shipped vehicle models, for --vehicle.")
@click.argument("words", metavar="[SEARCH]...", nargs=-1)
@data_options("text", "json")
def models(words: tuple[str, ...], *, file_format: str, output: Path | None) -> None:
    """List the shipped vehicle models, for --vehicle: all, or those whose name or description holds SEARCH.

    SEARCH is what people call a drone: phantom, x500, M300.
    """
    from planner.report.endurance import models_json, models_text
    from planner.service.endurance import list_models

    listed = list_models(words)
    write_data(
        models_json(listed, version=__version__)
        if file_format == "json"
        else models_text(listed, medium=standard_medium(output), describes=bool(words)),
        output=output,
    )


@click.command("rules")
@data_options("text", "json")
def rules(*, file_format: str, output: Path | None) -> None:
    """List the rules: code, severity, name and summary."""
    listed = tuple(catalogue.rules().values())
    write_data(
        rules_json(listed, version=__version__) if file_format == "json" else rules_text(listed),
        output=output,
    )


def _offers(_context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[str]:
    return [text for text in _known() if text.lower().startswith(incomplete.lower())]


@click.command("explain", short_help="Explain a rule, and how to turn it off.")
@click.argument("code", shell_complete=_offers)
@data_options("text", "json")
def explain(code: str, *, file_format: str, output: Path | None) -> None:
    """Explain a rule: its meaning, why, how it is computed, what to do.

    CODE is the rule's code, such as E101, its name, or the name of PX4's event, such as
    navigator_mis_takeoff_missing.
    """
    rule = _rule(code)
    write_data(
        rule_json(rule, version=__version__)
        if file_format == "json"
        else rule_text(rule, medium=standard_medium(output)),
        output=output,
    )


def _topics(context: click.Context, _parameter: click.Parameter, incomplete: str) -> list[str]:
    from planner.report.topics import topic_names

    return [name for name in (*topic_names(), *_commands(context)) if name.startswith(incomplete)]


def _commands(context: click.Context) -> list[str]:
    root = context.find_root()
    return root.command.list_commands(root) if isinstance(root.command, click.Group) else []


@click.command("help", short_help="Show the long tables and texts, by topic.")
@click.argument("topic", required=False, shell_complete=_topics)
@output_option()
@click.pass_context
def help_command(context: click.Context, *, topic: str | None, output: Path | None) -> None:
    """Show a topic: settings, rules, formats, names, fleet and others; without one, list them.

    TOPIC may be a command too: its help, as of --help.
    """
    from planner.report.topics import topic_names, topic_text, topics_text

    if topic is None:
        write_data(topics_text(medium=standard_medium(output)), output=output)
    elif topic in topic_names():
        write_data(topic_text(topic, medium=standard_medium(output)), output=output)
    elif topic in _commands(context) and context.parent is not None:
        main = context.parent
        command = (
            main.command.get_command(main, topic) if isinstance(main.command, click.Group) else None
        )
        if command is not None:
            with click.Context(command, info_name=topic, parent=main) as asked:
                write_data(f"{command.get_help(asked)}\n", output=output)
    else:
        known = (*topic_names(), *_commands(context))
        msg = f"no topic {topic!r}{nearest_hint(topic, known)} (mavjoule help)"
        raise UsageError(msg)


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
