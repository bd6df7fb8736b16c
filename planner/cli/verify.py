"""``mavjoule verify``: a model against the flights in logs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner import __version__, quantity
from planner.cli.options import (
    data_options,
    given_settings,
    kind_option,
    path_option,
    setting_option,
)
from planner.cli.output import narrate, progress, refuse_output_file, standard_medium, write_data
from planner.errors import ExitCode
from planner.mission.files import read_mission
from planner.service.verification import calibrate_verified, verify_logs
from planner.setting import Fraction
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.identify.assembly import IdentificationSettings
    from planner.identify.calibration import Calibration
    from planner.identify.log_table import LogTable
    from planner.identify.verification import KnownConditions, Verification
    from planner.report.text import Medium
    from planner.vehicle.model import VehicleModel


@click.command("verify", short_help="Predict the flights in logs, and compare.")
@click.argument("model", metavar="MODEL")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(readable=False))
@path_option("--mission", help="mission flown [default: the log's]")
@path_option("--params", help="autopilot parameters [default: the log's]")
@path_option("--mapping", metavar="FILE.toml", help="which column of a CSV log is which")
@setting_option("wind", unset="the log's, else none")
@setting_option("home_amsl_m", unset="the log's")
@setting_option("temperature_c")
@setting_option("payload_kg")
@path_option(
    "--table",
    metavar="FILE.csv",
    help="payload, temperature and mass of each log, a row each, units in the heads",
)
@kind_option("--fail-on-time", Fraction(), "exit with 1 at a larger error of time")
@kind_option(
    "--fail-on-energy",
    Fraction(),
    "exit with 1 at a larger error of energy, or where the energy is unknown",
)
@click.option(
    "--leave-one-out",
    is_flag=True,
    help="predict each log by a model identified from the others; MODEL gives what they do not show",
)
@click.option(
    "--calibration",
    is_flag=True,
    help="how often flights lie in the intervals predicted for them, and how narrow these are",
)
@path_option("--plots", metavar="FOLDER", help="draw power, height and speed of every flight")
@data_options("text", "json")
def command(
    model: str,
    logs: tuple[str, ...],
    *,
    mission: Path | None,
    params: Path | None,
    mapping: Path | None,
    plots: Path | None,
    file_format: str,
    output: Path | None,
    **options: Any,  # noqa: ANN401 - as click reads them
) -> ExitCode:
    """Predict the flights in logs from their missions, and compare with what was flown.

    MODEL is the name of a shipped vehicle model or a model file.  Mission, parameters, wind and
    altitude come from the log where they are not given; nothing of how it was flown does.

    Exit codes: 0 every flight was compared, 1 an error is larger than asked for, 2 unusable input
    or usage.
    """
    table: Path | None = options["table"]
    read = [
        *logs,
        model,
        *(str(path) for path in (mission, params, mapping, table) if path is not None),
    ]
    refuse_output_file(output, read)
    known = _known(mission, params, given_settings(options))
    vehicle = load_vehicle(model)
    csv_mapping = None
    if mapping is not None:
        from planner.logs.csv import read_csv_mapping

        csv_mapping = read_csv_mapping(mapping)
    log_table = None
    if table is not None:
        from planner.identify.log_table import read_log_table

        log_table = read_log_table(table)
        log_table.refuse_strangers(logs)
    done = list(
        verify_logs(
            vehicle,
            progress(logs, of=len(logs), label="verifying"),
            known,
            mapping=csv_mapping,
            left_out=_settings(vehicle, log_table) if options["leave_one_out"] else None,
            table=log_table,
        )
    )
    report = partial(_calibration, vehicle) if options["calibration"] else _comparison
    medium = None if file_format == "json" else standard_medium(output)
    text = report(done, plots, model=model, medium=medium)
    write_data(text, output=output)
    return _exit_code(done, options["fail_on_time"], options["fail_on_energy"])


def _known(mission: Path | None, params: Path | None, given: dict[str, Any]) -> KnownConditions:
    from planner.identify.verification import KnownConditions
    from planner.vehicle.parameters.files import read_parameters

    return KnownConditions(
        mission=None if mission is None else read_mission(mission),
        parameters=None if params is None else read_parameters(params),
        **given,
    )


def _settings(vehicle: VehicleModel, table: LogTable | None) -> IdentificationSettings:
    """Return how the models of leaving one out are identified: as the one given, which is the base."""
    import datetime as dt

    from planner.identify.assembly import IdentificationSettings
    from planner.identify.log_table import LogTable

    return IdentificationSettings(
        logs=table or LogTable(),
        name=vehicle.name,
        date=dt.datetime.now(dt.UTC).date(),
        version=__version__,
        reference=vehicle.reference,
        base=vehicle,
    )


def _draw(done: Sequence[Verification], folder: Path) -> None:
    from planner.report.identification import flight_errors, flight_label
    from planner.report.plots import verification_figure, write_figures

    figures = {
        f"{number:02d}-{Path(one.log).stem}-{one.flight}": verification_figure(
            one, title=f"{flight_label(one)}: {flight_errors(one)}"
        )
        for number, one in enumerate(done, start=1)
    }
    write_figures(figures, folder, file_formats=("svg",))
    narrate(f"{len(done)} drawn in {folder}")


def _comparison(
    done: Sequence[Verification], plots: Path | None, *, model: str, medium: Medium | None
) -> str:
    """Return each flight and its prediction, as JSON where there is no medium; drawn, if asked."""
    from planner.report.identification import verification_text
    from planner.report.json import verification_json

    if plots is not None:
        _draw(done, plots)
    if medium is None:
        return verification_json(done, model=model, version=__version__)
    return verification_text(done, medium=medium)


def _calibration(
    vehicle: VehicleModel,
    done: Sequence[Verification],
    plots: Path | None,
    *,
    model: str,
    medium: Medium | None,
) -> str:
    """Return how often flights lie in their intervals, as JSON where there is no medium."""
    from planner.report.identification import calibration_text
    from planner.report.json import calibration_json

    sources = calibrate_verified(vehicle, done)
    if plots is not None:
        _draw_intervals(sources, done, plots)
    if medium is None:
        return calibration_json(sources, done, model=model, version=__version__)
    return calibration_text(sources, medium=medium)


def _draw_intervals(
    sources: Mapping[str, Sequence[Calibration]], done: Sequence[Verification], folder: Path
) -> None:
    from planner.report.identification import flight_label
    from planner.report.plots import calibration_figure, write_figures

    labels = [flight_label(one) for one in done]
    figures = {
        f"calibration-{name.replace(' ', '-')}": calibration_figure(rows, labels, title=name)
        for name, rows in sources.items()
    }
    write_figures(figures, folder, file_formats=("svg",))
    narrate(f"{len(figures)} drawn in {folder}")


def _exit_code(
    done: Sequence[Verification], most_time: float | None, most_energy: float | None
) -> ExitCode:
    """Return whether every flight is as near as asked, and say which is not."""
    code = ExitCode.GO
    for one in done:
        for what, off, most in (
            ("time", one.time_fraction, most_time),
            ("energy", one.energy_fraction, most_energy),
        ):
            if most is None or (off is not None and abs(off) <= most):
                continue
            error = "not known" if off is None else quantity.percent(off)
            limit = quantity.exact_percent(most)
            narrate(f"{one.log}: error of {what} {error}, --fail-on-{what} {limit}")
            code = ExitCode.NO_GO
    return code
