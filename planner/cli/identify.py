"""``mavjoule identify``: a vehicle model from flight logs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from planner import __version__
from planner.autopilot import Autopilot
from planner.cli.log_conditions import MOST_MASS_KG, given_log_table, log_options
from planner.cli.options import format_option, kind_option, path_option
from planner.cli.output import (
    narrate,
    narrate_seldom,
    refuse_model_file,
    standard_medium,
    write_data,
)
from planner.errors import UsageError
from planner.service.identification import identify_logs
from planner.setting import Choice, Number
from planner.setup import MOST_NOISE_M

if TYPE_CHECKING:
    import datetime as dt
    from collections.abc import Sequence
    from pathlib import Path

    from planner.identify.assembly import IdentificationSettings
    from planner.logs.csv import CsvMapping


@click.command("identify", short_help="Identify a vehicle model from flight logs.")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@path_option("-o", "--output", metavar="MODEL.toml", help="model file to write")
@click.option("--list", "is_listed", is_flag=True, help="only list what each log holds")
@click.option("--name", metavar="NAME", help="name of the model [default: the file's]")
@click.option("--description", metavar="TEXT", help="what a pilot reads about it")
@click.option(
    "--reading", "readings", multiple=True, metavar="TEXT", help="what users of it have to know"
)
@click.option("--base", metavar="NAME|FILE", help="model that gives what the flights do not show")
@log_options
@kind_option(
    "--payload-deviation",
    Number("kg", 0.0, MOST_MASS_KG),
    "standard deviation of a mass that is not known from flight to flight",
    name="payload_deviation_kg",
    default=0.0,
)
@kind_option(
    "--position-noise",
    Number("m", 0.0, MOST_NOISE_M),
    "error of the position in a hover that the model assumes [default: as measured]",
    name="position_noise_m",
)
@kind_option("--capacity", Number("Ah", 0.0, 1000.0, is_open=True), "charge of the full battery")
@click.option("--cells", metavar="N", type=click.IntRange(min=1), help="battery cells in series")
@click.option("--chemistry", metavar="NAME", help="kind of cell, for the curve of its voltage")
@kind_option(
    "--autopilot",
    Choice({"auto": None} | {one.value: one for one in Autopilot}),
    "who shapes the references [default: as the logs say]",
    name="reference",
)
@path_option("--mapping", metavar="FILE.toml", help="columns of a CSV log")
@kind_option(
    "--method",
    Choice({"output-error": "output-error", "arx": "arx"}),
    "fit of responses; arx is the article's, biased by noise",
    default="output-error",
)
@path_option("--plots", metavar="DIR", help="draw figures into a folder")
@kind_option("--plot-format", Choice({"svg": "svg", "png": "png"}), "of them", default="svg")
@click.option("--segments", "with_segments", is_flag=True, help="list every segment of a flight")
@click.option(
    "--force", "is_forced", is_flag=True, help="write over a file that identify has not written"
)
@format_option("text", "json")
def command(
    logs: tuple[str, ...],
    *,
    output: Path | None,
    is_listed: bool,
    mapping: Path | None,
    plots: Path | None,
    plot_format: str,
    with_segments: bool,
    file_format: str,
    **asked: Any,  # noqa: ANN401 - as click reads them
) -> None:
    """Identify a vehicle from flight logs: its power, its motion, its battery.

    LOG is a PX4 .ulg, an ArduPilot .BIN or .log, a telemetry .tlog, or CSV.  A state the flights do
    not show is taken from --base or left out, and reported; nothing is invented.

    Exit codes: 0 a model was made, 2 the logs or the options are unusable.
    """
    csv_mapping = None
    if mapping is not None:
        from planner.logs.csv import read_csv_mapping

        csv_mapping = read_csv_mapping(mapping)
    if is_listed:
        _list_logs(logs, csv_mapping, file_format)
        return
    is_forced = asked.pop("is_forced")
    if output is not None:
        files = (mapping, asked["table"], asked["base"])
        read = [*logs, *(str(one) for one in files if one is not None)]
        refuse_model_file(output, read, command="identify", is_forced=is_forced)
    settings = _settings(output, logs, asked)
    found = identify_logs(
        logs, settings, mapping=csv_mapping, output=output, on_log=narrate, on_step=narrate_seldom()
    )
    if file_format == "json":
        from planner.report.json import identification_json

        file = None if output is None else str(output)
        write_data(identification_json(found, version=__version__, output=file))
    else:
        from planner.report.identification import identification_text

        medium = standard_medium()
        write_data(identification_text(found, medium=medium, with_segments=with_segments))
    if plots is not None:
        from planner.report.plots import identification_figures, write_figures

        figures = identification_figures(found)
        for path in write_figures(figures, plots, file_formats=(plot_format,)):
            narrate(f"drawn: {path}")
    if output is None:
        narrate("no model file is written: name one with -o")
    else:
        narrate(f"the model is in {output}")


def _list_logs(logs: tuple[str, ...], mapping: CsvMapping | None, file_format: str) -> None:
    from planner.logs.files import read_log

    records = [record for log in logs for record in read_log(log, mapping)]
    if file_format == "json":
        from planner.report.json import log_table_json

        write_data(log_table_json(records, version=__version__))
    else:
        from planner.report.identification import log_table_text

        write_data(log_table_text(records, medium=standard_medium()))


def _settings(
    output: Path | None, logs: Sequence[str], asked: dict[str, Any]
) -> IdentificationSettings:
    from planner.identify.assembly import IdentificationSettings, Method
    from planner.identify.battery import PackSettings
    from planner.vehicle.library import load_vehicle
    from planner.vehicle.reader import chemistry_names

    name, base = asked.pop("name"), asked.pop("base")
    cells, chemistry = asked.pop("cells"), asked.pop("chemistry")
    if output is not None:
        if output.suffix != ".toml":
            msg = f"{output}: a model file ends in .toml"
            raise UsageError(msg)
        if name not in {None, output.stem}:
            msg = f"a model called {name} belongs in {name}.toml, not in {output.name}"
            raise UsageError(msg)
        name = output.stem
    if chemistry not in {None, *chemistry_names()}:
        msg = f"--chemistry must be one of {', '.join(chemistry_names())}, got {chemistry}"
        raise UsageError(msg)
    if chemistry is not None and cells is None:
        msg = "--chemistry needs --cells: the curve is that of one cell"
        raise UsageError(msg)
    pack = PackSettings(
        capacity_ah=asked.pop("capacity"), cells_in_series=cells, chemistry=chemistry
    )
    return IdentificationSettings(
        name=name or "unnamed",
        date=_today(),
        version=__version__,
        pack=pack,
        method=Method(asked.pop("method")),
        base=None if base is None else load_vehicle(base),
        logs=given_log_table(asked, logs),
        **asked,
    )


def _today() -> dt.date:
    """Return the day a model is made; SOURCE_DATE_EPOCH names another, for files that can be made again.

    Raises UsageError for one that is no number of seconds (reproducible-builds.org).
    """
    import datetime as dt
    import os

    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    try:
        moment = dt.datetime.fromtimestamp(int(seconds), dt.UTC) if seconds else None
    except (ValueError, OverflowError, OSError) as error:
        msg = f"SOURCE_DATE_EPOCH must be seconds since 1970, got {seconds!r}"
        raise UsageError(msg) from error
    return (moment or dt.datetime.now(dt.UTC)).date()
