"""``mavjoule identify``: a vehicle model from flight logs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from planner import __version__
from planner.autopilot import Autopilot
from planner.cli.options import FiniteRange, format_option
from planner.cli.output import (
    narrate,
    narrate_seldom,
    refuse_overwriting,
    standard_medium,
    write_data,
)
from planner.errors import ExitCode, UsageError
from planner.service.identification import identify_logs

if TYPE_CHECKING:
    from planner.identify.assembly import IdentificationSettings
    from planner.logs.csv import CsvMapping
    from planner.vehicle.model import VehicleModel

_PATH = click.Path(path_type=Path)
_POSITIVE = FiniteRange(min=0.0, min_open=True)


@click.command("identify", short_help="Identify a vehicle model from flight logs.")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@click.option("-o", "--output", metavar="MODEL.toml", type=_PATH, help="model file to write")
@click.option("--list", "is_listed", is_flag=True, help="only say what each log tells, and stop")
@click.option("--name", metavar="NAME", help="name of the model [default: the file's]")
@click.option("--description", metavar="TEXT", help="what a pilot reads about it")
@click.option(
    "--reading", "readings", multiple=True, metavar="TEXT", help="what users of it have to know"
)
@click.option("--base", metavar="NAME|FILE", help="model that gives what the flights do not tell")
@click.option("--mass", metavar="KG", type=_POSITIVE, help="mass with battery, without payload")
@click.option(
    "--payload",
    metavar="KG",
    type=FiniteRange(min=0.0),
    default=0.0,
    help="mass carried beyond it in the flights",
)
@click.option(
    "--payload-deviation",
    metavar="KG",
    type=FiniteRange(min=0.0),
    default=0.0,
    help="standard deviation of a mass that is not known from flight to flight",
)
@click.option(
    "--temperature", metavar="C", type=FiniteRange(-90.0, 60.0), help="air at home in the flights"
)
@click.option(
    "--position-noise",
    metavar="M",
    type=FiniteRange(min=0.0, max=1.5),
    default=0.0,
    help="error of the position in a hover that the model assumes",
)
@click.option("--capacity", metavar="AH", type=_POSITIVE, help="charge of the full battery")
@click.option("--cells", metavar="N", type=click.IntRange(min=1), help="battery cells in series")
@click.option("--chemistry", metavar="NAME", help="kind of cell, for the curve of its voltage")
@click.option(
    "--autopilot",
    type=click.Choice(["auto", *(a.value for a in Autopilot)]),
    default="auto",
    metavar="auto|step|px4|ardupilot",
    help="who shapes the references [default: as the logs say]",
)
@click.option("--mapping", metavar="FILE.toml", type=_PATH, help="columns of a CSV log")
@click.option(
    "--method",
    type=click.Choice(["output-error", "arx"]),
    default="output-error",
    metavar="output-error|arx",
    help="fit of responses [default: output-error]; arx is the article's, biased by noise",
)
@click.option("--plots", metavar="DIR", type=_PATH, help="draw figures into a folder")
@click.option(
    "--plot-format",
    type=click.Choice(["svg", "png"]),
    default="svg",
    metavar="svg|png",
    help="of them",
)
@click.option("--segments", "with_segments", is_flag=True, help="list every segment of a flight")
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
    **options: object,
) -> ExitCode:
    """Identify a vehicle from flight logs: its power, its motion, its battery.

    LOG is a PX4 .ulg, an ArduPilot .BIN or .log, a telemetry .tlog, or CSV.  A state the flights do
    not tell is taken from --base or left out, and said; nothing is invented.

    Exit codes: 0 a model was made, 2 the logs or the options are unusable.
    """
    csv_mapping = None
    if mapping is not None:
        from planner.logs.csv import read_csv_mapping

        csv_mapping = read_csv_mapping(mapping)
    if is_listed:
        _list_logs(logs, csv_mapping, file_format)
        return ExitCode.GO
    refuse_overwriting(output, logs)
    settings = _settings(output, options)
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
    return ExitCode.GO


def _list_logs(logs: tuple[str, ...], mapping: CsvMapping | None, file_format: str) -> None:
    from planner.logs.files import read_log

    records = [record for log in logs for record in read_log(log, mapping)]
    if file_format == "json":
        from planner.report.json import log_table_json

        write_data(log_table_json(records, version=__version__))
    else:
        from planner.report.identification import log_table_text

        write_data(log_table_text(records, medium=standard_medium()))


def _settings(output: Path | None, options: dict[str, object]) -> IdentificationSettings:
    """Return what was asked for."""
    import datetime as dt

    from planner.identify.assembly import IdentificationSettings, Method
    from planner.identify.battery import PackSettings
    from planner.vehicle.library import load_vehicle
    from planner.vehicle.reader import chemistry_names

    name = options["name"]
    if output is not None:
        if output.suffix != ".toml":
            msg = f"{output}: a model file ends in .toml"
            raise UsageError(msg)
        if name not in {None, output.stem}:
            msg = f"a model called {name} stands in {name}.toml, not in {output.name}"
            raise UsageError(msg)
        name = output.stem
    chemistry = options["chemistry"]
    if chemistry not in {None, *chemistry_names()}:
        msg = f"--chemistry must be one of {', '.join(chemistry_names())}, got {chemistry}"
        raise UsageError(msg)
    if chemistry is not None and options["cells"] is None:
        msg = "--chemistry needs --cells: the curve is that of one cell"
        raise UsageError(msg)
    base: VehicleModel | None = None
    if options["base"] is not None:
        base = load_vehicle(str(options["base"]))
    autopilot = str(options["autopilot"])
    return IdentificationSettings(
        name=str(name or "unnamed"),
        date=dt.datetime.now(dt.UTC).date(),
        version=__version__,
        description=None if options["description"] is None else str(options["description"]),
        readings=tuple(options["readings"]),  # type: ignore[arg-type]  # texts, by click
        reference=None if autopilot == "auto" else Autopilot(autopilot),
        mass_kg=options["mass"],  # type: ignore[arg-type]  # a number or None, by click
        payload_kg=options["payload"],  # type: ignore[arg-type]  # a number, by click
        payload_deviation_kg=options["payload_deviation"],  # type: ignore[arg-type]  # as the payload
        temperature_c=options["temperature"],  # type: ignore[arg-type]  # as the mass
        position_noise_m=options["position_noise"],  # type: ignore[arg-type]  # as the payload
        pack=PackSettings(
            capacity_ah=options["capacity"],  # type: ignore[arg-type]  # as the mass
            cells_in_series=options["cells"],  # type: ignore[arg-type]  # as the mass
            chemistry=None if chemistry is None else str(chemistry),
        ),
        method=Method(str(options["method"])),
        base=base,
    )
