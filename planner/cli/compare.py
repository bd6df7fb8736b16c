"""``mavjoule compare``: two checks side by side."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

import click

from planner import __version__
from planner.cli.configuration import files_read, mission_settings
from planner.cli.options import (
    CHECK_GROUPS,
    MISSION_PATH,
    GroupedCommand,
    data_options,
    given_settings,
    page_option,
    setting_options,
)
from planner.cli.output import refuse_output_file, refuse_page, standard_medium, write_data
from planner.errors import ExitCode, UsageError
from planner.service.comparison import compare_files
from planner.service.preflight import bugs_of
from planner.setup import Setup

if TYPE_CHECKING:
    from pathlib import Path


@click.command("compare", cls=GroupedCommand, short_help="Show two checks side by side.")
@click.argument("mission_a", metavar="A", type=MISSION_PATH)
@click.argument("mission_b", metavar="[B]", required=False, type=MISSION_PATH)
@click.option(
    "--b",
    "options_b",
    metavar="OPTIONS",
    default="",
    help="options for B alone, as one text: --b '--wind 8@270 --payload 0.3'",
)
@setting_options(*CHECK_GROUPS)
@data_options("text", "json")
@page_option("both checks")
def command(
    mission_a: str,
    mission_b: str | None,
    *,
    options_b: str,
    file_format: str,
    output: Path | None,
    report: Path | None,
    **options: object,
) -> ExitCode:
    """Show two checks side by side: two missions, or one with two vehicles or in two winds.

    The options hold for both; those in --b for B alone, over the others.  Without B the mission is A
    again.

    Nothing is judged: the exit code is 0 for missions that can be read, 2 for others, and 1 where
    mavjoule itself fails.
    """
    if mission_b is None and not options_b.strip():
        msg = "a mission is compared with another one, or with itself and other options: give B or --b"
        raise UsageError(msg)
    other = mission_a if mission_b is None else mission_b
    if mission_a == other == "-":
        msg = "standard input can be read once: give a file"
        raise UsageError(msg)
    given = given_settings(options)
    settings_a = mission_settings(mission_a, given)
    settings_b = mission_settings(other, given | _settings_of_b(options_b))
    read = files_read((mission_a, other), settings_a, settings_b)
    refuse_output_file(output, read)
    refuse_page(report, read, output=output)
    comparison = compare_files(mission_a, Setup.of(settings_a), other, Setup.of(settings_b))
    with bugs_of(f"{mission_a}, {other}"):
        from planner.report.comparison import comparison_json, comparison_text

        own = ("", options_b.strip())
        text = (
            comparison_json(comparison, options=own, version=__version__)
            if file_format == "json"
            else comparison_text(comparison, options=own, medium=standard_medium(output))
        )
        write_data(text, output=output)
        if report is not None:
            from planner.cli.check_output import write_page
            from planner.report.html.comparison import comparison_section

            section = comparison_section(comparison.a, comparison.b, options=own)
            both = (comparison.a, comparison.b)
            title = "Two checks side by side"
            write_page(both, report, sections=[section], title=title, names=("A", "B"))
    return ExitCode.GO


def _settings_of_b(text: str) -> dict[str, object]:
    try:
        words = shlex.split(text)
    except ValueError as error:
        msg = f"--b: {error}: {text}"
        raise UsageError(msg) from error
    found: dict[str, object] = {}

    @click.command("--b", add_help_option=False)
    @setting_options(*CHECK_GROUPS)
    def own(**options: object) -> None:
        found.update(given_settings(options))

    try:
        own.main(args=words, prog_name="--b", standalone_mode=False)
    except click.ClickException as error:
        msg = f"--b: {error.format_message()}"
        raise UsageError(msg) from error
    return found
