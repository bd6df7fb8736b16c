"""Options of click commands: those of the settings, as they are declared, and those of the output."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner.setting import Group, Switch
from planner.setup import settings
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from click.shell_completion import CompletionItem

    from planner.setting import Kind

    Command = Callable[..., Any]

MISSION_PATH = click.Path(readable=False)
"""A mission's path as text, completed by a shell; whether it can be read is a finding."""
CHECK_GROUPS = (Group.FLIGHT, Group.BATTERY, Group.JUDGEMENT)
"""What decides how a mission is flown and whether it is a go."""


class KindType(click.ParamType[object]):
    """The text of an option, read as its kind is written."""

    name = "setting"

    def __init__(self, kind: Kind) -> None:
        self.kind = kind

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> object:
        """Return the value of the text; fail with the reader's sentence."""
        if not isinstance(value, str):
            return value
        try:
            return self.kind.read(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)

    def shell_complete(
        self,
        ctx: click.Context,  # noqa: ARG002 - given by click
        param: click.Parameter,  # noqa: ARG002 - given by click
        incomplete: str,
    ) -> list[CompletionItem]:
        """Return what a shell offers for the text so far: files, then the setting's choices."""
        from click.shell_completion import CompletionItem

        offers = [CompletionItem(incomplete, type="file")] if self.kind.is_file else []
        before, comma, start = "", "", incomplete
        if self.kind.is_repeated:
            before, comma, start = incomplete.rpartition(",")
        return offers + [
            CompletionItem(f"{before}{comma}{choice}")
            for choice in self.kind.choices()
            if choice.lower().startswith(start.lower())
        ]


def kind_option(
    option: str,
    kind: Kind,
    help: str,  # noqa: A002 - as click's
    *,
    name: str = "",
    default: object = None,
    metavar: str = "",
) -> Callable[[Command], Command]:
    """Return a decorator that adds an option, read as its kind is written."""
    shown = "" if default is None else f" [default: {kind.text(default)}]"
    return click.option(
        *filter(None, (option, name)),
        type=KindType(kind),
        metavar=metavar or kind.metavar,
        default=default,
        help=f"{help}{shown}",
    )


def path_option(
    *names: str,
    metavar: str = "FILE",
    **more: Any,  # noqa: ANN401 - as of `click.option`
) -> Callable[[Command], Command]:
    """Return a decorator that adds an option that names a file or a folder."""
    return click.option(*names, metavar=metavar, type=click.Path(path_type=Path), **more)


def setting_option(
    key: str,
    *,
    name: str | None = None,
    option: str | None = None,
    help: str | None = None,  # noqa: A002 - as click's
    unset: str | None = None,
) -> Callable[[Command], Command]:
    """Return a decorator that adds the option of a setting, with no default.

    ``name`` is that of the command's parameter, by default the key; option, help and unset are those of
    this command, where they are otherwise than declared.
    """
    setting = settings()[key]
    asked = {"option": option, "help": help, "unset": unset}
    setting = replace(setting, **{one: text for one, text in asked.items() if text is not None})
    short = ("-o",) if setting.option == "--output" else ()
    names = (*short, setting.option, name or key)
    if isinstance(setting.kind, Switch):
        return click.option(*names, default=None, help=setting.help_text)
    return click.option(
        *names,
        type=KindType(setting.kind),
        metavar=setting.metavar,
        multiple=setting.kind.is_repeated,
        help=setting.help_text,
    )


def setting_options(*groups: Group, without: Iterable[str] = ()) -> Callable[[Command], Command]:
    """Return a decorator that adds an option for each setting of some groups."""
    keys = [
        key
        for group in groups
        for key, setting in settings().items()
        if setting.group is group and setting.option and key not in without
    ]

    def decorate(command: Command) -> Command:
        for key in reversed(keys):
            command = setting_option(key)(command)
        return command

    return decorate


_FIRST = (
    "vehicle",
    "battery",
    "charge",
    "reserve",
    "wind",
    "payload_kg",
    "params",
    "terrain",
    "format",
    "report",
)
"""Options that matter first, by their parameters."""
_HEADS = {
    Group.FLIGHT: "How it is flown",
    Group.BATTERY: "The battery",
    Group.JUDGEMENT: "What makes it a go, and what is reported",
    Group.FLEET: "Missions flown at the same time",
    Group.REPORT: "Reports and pictures",
}
_MOST_USED, _LINE, _OTHERS = "Most used", "The line to a vehicle", "Other options"


class GroupedCommand(click.Command):
    """A command whose help has its options in groups, those that matter first at the top."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options into the help."""
        groups: dict[str, list[tuple[str, str]]] = {
            head: [] for head in (_MOST_USED, *_HEADS.values(), _LINE, _OTHERS)
        }
        listed = sorted(
            self.get_params(ctx),
            key=lambda one: _FIRST.index(one.name) if one.name in _FIRST else len(_FIRST),
        )
        for parameter in listed:
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                groups[_head(parameter)].append(record)
        for head, records in groups.items():
            if records:
                with formatter.section(head):
                    formatter.write_dl(records)


def _head(parameter: click.Parameter) -> str:
    from planner.cli.link import LINK_OPTIONS  # which imports this module

    if parameter.name in _FIRST:
        return _MOST_USED
    if parameter.name in LINK_OPTIONS:
        return _LINE
    setting = settings().get(parameter.name or "")
    if setting is not None:
        return _HEADS[setting.group]
    return _OTHERS


def given_settings(options: Mapping[str, object]) -> dict[str, Any]:
    """Return what the command line sets, by key: what is absent leaves room for a configuration."""
    declared = settings()
    given: dict[str, Any] = {}
    for key, value in options.items():
        if key not in declared:
            continue
        if isinstance(value, tuple) and declared[key].kind.is_repeated:
            if value:  # one tuple for each time
                given[key] = tuple(one for several in value for one in several)
        elif value is not None:
            given[key] = value
    return given


def option_words(key: str, value: object) -> list[str]:
    """Return the words of a command line that set a value.

    Raises ValueError if no text of an option is this value.
    """
    setting = settings()[key]
    several = value if isinstance(value, tuple) and setting.kind.is_file else (value,)
    return [word for one in several for word in (setting.option, setting.kind.text(one))]


def command_text(words: Sequence[str]) -> str:
    """Return words as one types them in the shell of this system."""
    if os.name == "nt":
        import subprocess

        return subprocess.list2cmdline(words)
    import shlex

    return shlex.join(words)


def format_option(*formats: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--format``, the first of the formats being the default."""
    return click.option(
        "--format",
        "file_format",
        type=click.Choice(formats),
        default=formats[0],
        metavar="|".join(formats),
        help=f"format of the output [default: {formats[0]}]",
    )


def data_options(*formats: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--format`` and ``--output``, for a command that prints data."""
    output = output_option()
    return lambda command: format_option(*formats)(output(command))


def output_option() -> Callable[[Command], Command]:
    """Return a decorator that adds ``--output``."""
    return path_option("-o", "--output", help="write to a file instead of standard output")


def page_option(holding: str) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--report`` for a page beside the output of a command."""
    return path_option(
        "--report",
        metavar="FILE.html",
        help=f"write {holding}, side by side and each with its pictures, as a page as well",
    )
