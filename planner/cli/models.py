"""``mavjoule models``: the vehicle models that are shipped."""

from __future__ import annotations

import click

from planner import __version__
from planner.cli.format_option import format_option
from planner.cli.output import standard_medium, write_data
from planner.report.identification import models_text
from planner.report.json import models_json
from planner.vehicle.library import load_vehicle, model_names


@click.command("models")
@format_option("text", "json")
def command(*, file_format: str) -> None:
    """List the shipped vehicle models, for --vehicle."""
    vehicles = [load_vehicle(name) for name in model_names()]
    write_data(
        models_json(vehicles, version=__version__)
        if file_format == "json"
        else models_text(vehicles, medium=standard_medium())
    )
