"""``mavjoule verify-signoff``: a signed check made anew, and what has changed since."""

from __future__ import annotations

from pathlib import Path

import click

from planner.cli.configuration import files_read, mission_settings
from planner.cli.options import data_options
from planner.cli.output import refuse_output_file, write_data
from planner.errors import ExitCode
from planner.service.preflight import bugs_of


@click.command("verify-signoff", short_help="Make a signed check anew and say what has changed.")
@click.argument("sign_off", metavar="FILE", type=click.Path(path_type=Path))
@data_options("text", "json")
def command(sign_off: Path, *, file_format: str, output: Path | None) -> ExitCode:
    """Make a signed check anew and say what has changed.

    FILE is what the checklist of mavjoule review writes, MISSION.signoff.json.  Its inputs are looked
    for from its own folder, and settings files as mavjoule check finds them now.  Inputs, verdict,
    figures and findings are compared.

    The hashes show that an input has changed since, not who signed: the file is not signed
    cryptographically, and whoever may write it can write another.

    Exit codes: 0 released and nothing has changed, 1 refused or changed, 2 unusable input.
    """
    from planner.report.sign_off import (
        read_sign_off,
        sign_off_json,
        sign_off_text,
        signed_settings,
        verified_sign_off,
    )

    signed = read_sign_off(sign_off)
    mission = str(sign_off.parent / signed.mission)
    settings = mission_settings(mission, signed_settings(sign_off, signed))
    then = (str(sign_off.parent / one.file) for one in signed.inputs)
    refuse_output_file(output, (str(sign_off), *then, *files_read((mission,), settings)))
    with bugs_of(str(sign_off)):
        verified = verified_sign_off(sign_off, signed, settings)
        text = (sign_off_json if file_format == "json" else sign_off_text)(verified)
    write_data(text, output=output)
    return ExitCode.GO if verified.is_valid else ExitCode.NO_GO
