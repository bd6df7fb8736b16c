"""Settings as options of click commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from planner.cli.setting import Kind, Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from click.shell_completion import CompletionItem

    Command = Callable[..., Any]

MISSION_PATH = click.Path(readable=False)
"""A mission's path as text, completed by a shell; whether it can be read is a finding."""


class SettingType(click.ParamType[object]):
    """The text of an option, read as its setting reads it."""

    name = "setting"

    def __init__(self, setting: Setting) -> None:
        self.setting = setting

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> object:
        """Return the value of the text; fail with the reader's sentence."""
        if not isinstance(value, str):
            return value
        try:
            return self.setting.read(value)
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

        offers = []
        if self.setting.kind in {Kind.PATH, Kind.PATHS, Kind.MODEL}:
            offers.append(CompletionItem(incomplete, type="file"))
        before, comma, start = "", "", incomplete
        if self.setting.kind is Kind.TEXTS:
            before, comma, start = incomplete.rpartition(",")
        return offers + [
            CompletionItem(f"{before}{comma}{choice}")
            for choice in self.setting.choices()
            if choice.lower().startswith(start.lower())
        ]


def setting_options(settings: Sequence[Setting]) -> Callable[[Command], Command]:
    """Return a decorator that adds an option for each setting, none of them with a default."""

    def decorate(command: Command) -> Command:
        for setting in reversed(settings):
            command = _option(setting)(command)
        return command

    return decorate


def given_settings(options: Mapping[str, object]) -> dict[str, object]:
    """Return what the command line sets, by key: what is absent leaves room for a configuration."""
    given: dict[str, object] = {}
    for key, value in options.items():
        if isinstance(value, tuple):  # a repeatable option: one tuple for each time
            if value:
                given[key] = tuple(one for several in value for one in several)
        elif value is not None:
            given[key] = value
    return given


def _option(setting: Setting) -> Callable[[Command], Command]:
    if setting.kind is Kind.SWITCH:
        return click.option(setting.option, setting.key, default=None, help=setting.meaning)
    return click.option(
        setting.option,
        setting.key,
        type=SettingType(setting),
        metavar=setting.metavar,
        multiple=setting.kind in {Kind.TEXTS, Kind.PATHS},
        help=setting.meaning,
    )
