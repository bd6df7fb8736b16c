"""``mavjoule vehicle``: a model of one's own drone, and what is in a model."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planner import __version__
from planner.autopilot import Autopilot
from planner.cli.log_conditions import given_log_table, log_options
from planner.cli.options import KindType, data_options, format_option, kind_option, path_option
from planner.cli.output import (
    narrate,
    refuse_model_file,
    refuse_output_file,
    standard_medium,
    write_data,
)
from planner.errors import UsageError
from planner.files import is_among
from planner.notation import battery_text, read_battery
from planner.setting import Choice, Form, Number
from planner.setup import settings
from planner.values import replace
from planner.vehicle.reader import chemistry_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from planner.setting import Kind
    from planner.vehicle.model import VehicleModel

_AUTOPILOTS = {one.value: one for one in (Autopilot.ARDUPILOT, Autopilot.PX4)}


def _later(name: str) -> Callable[[str], Any]:
    """Return a reader of `planner.vehicle.figures`, imported where it is used."""

    def read(text: str) -> Any:  # noqa: ANN401 - each has its own
        from planner.vehicle import figures

        return getattr(figures, name)(text)

    return read


_KINDS: dict[str, tuple[str, Kind, str, str]] = {
    "mass_kg": ("--mass", Form(_later("read_mass"), str), "3.5kg", "take-off mass with battery"),
    "mass_max_kg": (
        "--mass-max",
        Form(_later("read_mass"), str),
        "5kg",
        "highest take-off mass its maker allows, payload in it",
    ),
    "ceiling_amsl_m": (
        "--ceiling",
        Number("m", 100.0, 9000.0),
        "3000",
        "height above sea level up to which its maker lets it take off",
    ),
    "battery": (
        "--battery",
        Form(read_battery, battery_text),
        "4S5200",
        "battery: 4S5200 or 5.2Ah@14.8V",
    ),
    "rotors": (
        "--rotors",
        Form(_later("read_rotors"), str),
        "4",
        "number of propellers, two on one arm counted as two",
    ),
    "propeller_m": (
        "--propeller",
        Form(_later("read_propeller"), str),
        "10in",
        "diameter of the propellers",
    ),
    "hover": (
        "--hover",
        Form(_later("read_hover"), str),
        "18A",
        (
            "one figure of the hover: 18A (current), 260W (power), 22min (hover time), 25min max (longest "
            "flight time as advertised) or 38% (throttle)"
        ),
    ),
    "motor": (
        "--motor",
        Form(_later("read_motor"), str),
        "1250g@310W",
        "thrust and power of one motor at full throttle: what it lifts, and the power at a hover throttle",
    ),
    "autopilot": (
        "--autopilot",
        Choice(_AUTOPILOTS),
        "ardupilot",
        "autopilot: ardupilot or px4; for a maker's own, as DJI's, see --moves-like",
    ),
}
"""What a data sheet may say: option, how it is written, an example, in words."""
_ASKED = ("mass_kg", "battery", "rotors", "propeller_m", "hover", "autopilot")
"""What is asked of whoever gives nothing; each may be skipped."""


@click.group("vehicle", short_help="Make a model of one's own drone, and show a model.")
def command() -> None:
    """Make a model of one's own drone from its data sheet, and show what is in a model."""


def _sheet_options(function: Callable[..., Any]) -> Callable[..., Any]:
    for key, (option, kind, example, words) in reversed(_KINDS.items()):
        metavar = example if isinstance(kind, Form) else kind.metavar or "N"
        function = kind_option(option, kind, words, name=key, metavar=metavar)(function)
    return function


@command.command("new", short_help="Make a model from a data sheet.")
@path_option("-o", "--output", metavar="MODEL.toml", required=True, help="the model")
@_sheet_options
@click.option(
    "--chemistry",
    type=click.Choice(chemistry_names()),
    metavar="NAME",
    help="kind of cell [default: as the voltage means]",
)
@click.option(
    "--moves-like",
    "moves_like",
    metavar="MODEL",
    help="model whose ramps it flies, where its autopilot is its maker's own: dji-matrice-100",
)
@path_option("--params", help="the autopilot's parameters: speeds, cells, hover throttle")
@click.option("--description", metavar="TEXT", help="of the vehicle, for a pilot")
@click.option("--source", metavar="TEXT", help="who says so: the data sheet, its address")
@click.option("--force", is_flag=True, help="write over a model that is there already")
def new(
    *,
    output: Path,
    moves_like: str | None,
    params: Path | None,
    force: bool,
    **given: Any,  # noqa: ANN401 - as each option is read
) -> None:
    """Make a model of a drone that no flight was logged of.

    Without options it asks, where it runs on a terminal.  Every number may be left out: what is
    assumed instead, and how far that may be off, stands in the model and makes its energies uncertain.
    Flight logs narrow it: mavjoule vehicle refine MODEL.toml LOG...

    Exit codes: 0 the model is written, 2 what the sheet says cannot fly, or the file cannot be written.
    """
    from planner.report.endurance import endurance_text
    from planner.service.endurance import predict_endurance
    from planner.vehicle.data_sheet import DataSheet, vehicle_from_data_sheet
    from planner.vehicle.library import load_vehicle
    from planner.vehicle.parameters.files import read_parameters
    from planner.vehicle.writer import write_vehicle

    if output.suffix != ".toml":
        msg = f"{output}: a model is a file that ends in .toml"
        raise UsageError(msg)
    files = (params, moves_like)
    refuse_output_file(output, [str(one) for one in files if one is not None])
    if output.exists() and not force:
        msg = f"{output} exists already: give another name, or --force"
        raise UsageError(msg)
    sheet = {name: value for name, value in given.items() if value is not None}
    parameters = None if params is None else read_parameters(params)
    like = None if moves_like is None else load_vehicle(moves_like)

    def made(sheet: Mapping[str, Any]) -> VehicleModel:
        return vehicle_from_data_sheet(
            DataSheet(name=output.stem, parameters=parameters, moves_like=like, **sheet)
        )

    vehicle = made(sheet) if sheet or params is not None else _asked(made)
    write_vehicle(output, vehicle, remarks=(f"Written by mavjoule vehicle new {__version__}.",))
    write_data(endurance_text(predict_endurance(vehicle), medium=standard_medium()))
    narrate(f"{output} written: mavjoule check MISSION --vehicle {output}")


def _asked(made: Callable[[Mapping[str, Any]], VehicleModel]) -> VehicleModel:
    """Return what is made of the answers of whoever sits at the terminal; ask again for what cannot be."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        asked = ", ".join(_KINDS[key][0] for key in _ASKED)
        msg = f"nothing is known of the vehicle: give {asked}, what of it you know"
        raise UsageError(msg)
    narrate("What the data sheet says; Enter where it says nothing:")
    texts: dict[str, str] = {}
    while True:
        answers = dict(_ask(texts))
        try:
            return made(answers)
        except UsageError as error:
            narrate(str(error))
            narrate(f"Once more; Enter keeps an answer, {_DROPPED} drops it:")


_DROPPED = "-"


def _ask(texts: dict[str, str]) -> Iterator[tuple[str, object]]:
    """Yield what was answered, and keep its text; where there is one it is offered again."""
    for key in _ASKED:
        _, kind, example, words = _KINDS[key]
        answer = click.prompt(
            f"  {words}" if example in words else f"  {words}, such as {example}",
            default=texts.get(key, ""),
            show_default=key in texts,
            value_proc=partial(_answer, kind),
            err=True,
        )
        texts.pop(key, None)
        if answer is not None:
            texts[key], value = answer
            yield key, value


def _answer(kind: Kind, text: str) -> tuple[str, object] | None:
    """Return what was answered, as text and as read; ``None`` where nothing was."""
    text = text.strip()
    if text in {"", _DROPPED}:
        return None
    return text, KindType(kind).convert(text, None, None)


@command.command("refine", short_help="Narrow a model by the logs of ordinary flights.")
@click.argument("model", metavar="MODEL")
@click.argument("logs", metavar="LOG...", nargs=-1, required=True)
@path_option(
    "-o",
    "--output",
    metavar="MODEL.toml",
    help="the narrowed model [default: the file that MODEL is]",
)
@click.option("--force", is_flag=True, help="write over a file that refine has not written")
@log_options
@format_option("text", "json")
def refine(
    model: str,
    logs: tuple[str, ...],
    *,
    output: Path | None,
    force: bool,
    file_format: str,
    **asked: Any,  # noqa: ANN401 - as click reads them
) -> None:
    """Narrow a model from a data sheet by the logs of ordinary flights.

    What the flights tell replaces what was assumed, as far as they tell it; the rest stays as it was,
    and nothing gets less certain.  Hover, forward flight, a landing will do.  MODEL is the path of a model
    file, or the name of a shipped model, which stays as it is: give -o.

    Exit codes: 0 the model is written, 2 the model or the logs are unusable.
    """
    from planner.report.endurance import refinement_json, refinement_text
    from planner.service.identification import refine_logs
    from planner.vehicle.library import load_vehicle, model_names
    from planner.vehicle.writer import write_vehicle

    if output is None and model in model_names():
        msg = f"{model} is a shipped model: name the file of the narrowed one with -o"
        raise UsageError(msg)
    output = output or Path(model)
    read = [*logs, *(str(one) for one in (asked["table"],) if one is not None)]
    is_own = is_among(output, [model])  # narrowed where it is
    refuse_model_file(output, read, command="vehicle refine", is_forced=force or is_own)
    vehicle = replace(load_vehicle(model), name=output.stem)
    refined = refine_logs(vehicle, logs, logs=given_log_table(asked, logs), on_log=narrate)
    write_vehicle(
        output, refined.model, remarks=(f"Written by mavjoule vehicle refine {__version__}.",)
    )
    write_data(
        refinement_json(refined, version=__version__)
        if file_format == "json"
        else refinement_text(refined, medium=standard_medium())
    )
    narrate(f"the narrowed model is in {output}")


@command.command("show", short_help="Show what is in a model, and what it can do.")
@click.argument("vehicle", metavar="MODEL")
@kind_option(
    "--payload",
    settings()["payload_kg"].kind,
    "carried beyond the take-off mass",
    name="payload_kg",
    default=0.0,
)
@data_options("text", "json")
@path_option(
    "--plots",
    metavar="DIR",
    help="draw range over speed and hover over payload, as SVG and PNG (needs mavjoule[report])",
)
def show(
    *, vehicle: str, payload_kg: float, file_format: str, output: Path | None, plots: Path | None
) -> None:
    """Show a model: what is in it, what is assumed, how long it hovers, how far it goes at each speed.

    MODEL is the name of a shipped model or the path of a model file.
    """
    from planner.report.endurance import endurance_json, endurance_text
    from planner.service.endurance import predict_endurance
    from planner.vehicle.library import load_vehicle

    refuse_output_file(output, (vehicle,))
    shown = predict_endurance(load_vehicle(vehicle), payload_kg=payload_kg)
    write_data(
        endurance_json(shown, version=__version__)
        if file_format == "json"
        else endurance_text(shown, medium=standard_medium(output)),
        output=output,
    )
    if plots is None:
        return
    from planner.report.plots import endurance_figures, write_figures

    figures = endurance_figures(shown)
    if not figures:
        narrate(
            f"{vehicle} knows neither its battery nor its power over the speed: nothing is drawn"
        )
    for path in write_figures(figures, plots):
        narrate(f"drawn: {path}")
