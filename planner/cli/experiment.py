"""``mavjoule experiment``: the flights a vehicle is identified from, as missions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from planner import quantity
from planner.autopilot import Autopilot
from planner.cli.options import KindType, kind_option, path_option, setting_option
from planner.cli.output import narrate, standard_medium, write_data
from planner.mission.items import Home
from planner.setting import Bearing, Choice, Number

_AUTOPILOTS = {one.value: one for one in (Autopilot.ARDUPILOT, Autopilot.PX4)}


@click.command("experiment", short_help="Write the missions to identify a vehicle from.")
@path_option(
    "-o", "--output", "folder", metavar="DIR", required=True, help="where they are written"
)
@click.option(
    "--home",
    metavar="LAT LON",
    nargs=2,
    type=(KindType(Number("°", -85.0, 85.0)), KindType(Number("°", -180.0, 180.0))),
    required=True,
    help="where the vehicle takes off and lands, in degrees",
)
@setting_option("home_amsl_m", unset="left open")
@kind_option("--autopilot", Choice(_AUTOPILOTS), "that flies them", default=Autopilot.ARDUPILOT)
@kind_option(
    "--height", Number("m", 10.0, 500.0), "of the highest level", name="height_m", default=100.0
)
@click.option(
    "--levels",
    metavar="N",
    type=click.IntRange(2, 10),
    default=4,
    help="steps from the ground to it [default: 4]",
)
@kind_option("--hold", Number("s", 20.0, 600.0), "hover at each level", name="hold_s", default=60.0)
@kind_option("--speed", Number("m/s", 1.0, 30.0), "of the legs", name="speed_m_s", default=10.0)
@kind_option("--leg", Number("m", 50.0, 2000.0), "length of a leg", name="leg_m", default=300.0)
@kind_option("--direction", Bearing(), "of the way out", name="bearing_deg", default=0.0)
@click.option("--force", is_flag=True, help="write over missions that are there already")
def command(
    *,
    folder: Path,
    home: tuple[float, float],
    home_amsl_m: float | None,
    force: bool,
    **asked: Any,  # noqa: ANN401 - as click reads them
) -> None:
    """Write the missions to identify a vehicle from: the article's two flights and a sweep of speeds.

    vertical.plan climbs and descends in steps with a hover at each, horizontal.plan flies out and
    back, speed-sweep.plan does so at five speeds.  They are flown in calm air; the command says what
    has to be in their logs.

    Exit codes: 0 they are written, 2 the options do not fit together or a file cannot be written.
    """
    from planner.identify.experiment import LOGGED, ExperimentSettings
    from planner.service.experiment import write_experiment

    settings = ExperimentSettings(home=Home(*home, home_amsl_m), **asked)
    flights = write_experiment(settings, folder, force=force)
    medium = standard_medium()
    lines = []
    for path, flight in flights.items():
        lines += [medium.paint(str(path), "bold"), *medium.wrapped(f"  {flight.course}", indent=2)]
        lines += medium.wrapped(f"  for {flight.shows}", indent=2)
    next_steps = (
        f"check them: mavjoule check {folder}/*.plan, with a model as like the vehicle as there is",
        "fly them in less than 2 m/s of wind, with a full battery each",
        f"log: {LOGGED[settings.autopilot]}",
        f"then: mavjoule identify LOG... -o {_model_file(folder)} --mass KG --cells N --capacity AH",
    )
    lines.append("")
    for step in next_steps:
        lines += medium.wrapped(step, indent=2)
    write_data("\n".join(lines) + "\n")
    narrate(f"{quantity.count(len(flights), 'mission')} written to {folder}")


def _model_file(folder: Path) -> Path:
    """Return a name for the model beside the folder of its flights; in this one where that has no name."""
    return folder.with_name(f"{folder.name}.toml") if folder.name.strip(".") else Path("model.toml")
