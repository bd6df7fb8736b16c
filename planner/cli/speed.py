"""``mavjoule speed``: energy and time over cruise speed."""

from __future__ import annotations

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
    path_option,
    setting_option,
    setting_options,
)
from planner.cli.output import narrate, refuse_output_file, write_data
from planner.errors import ExitCode
from planner.mission.files import read_mission
from planner.service.preflight import bugs_of
from planner.service.speed import speed_curve
from planner.setup import Setup

if TYPE_CHECKING:
    from pathlib import Path

    from planner.service.speed import SpeedCurve


@click.command("speed", cls=GroupedCommand)
@click.argument("mission", type=MISSION_PATH)
@setting_option(
    "speed_m_s", name="from_m_s", option="--from", help="slowest speed over ground", unset="1"
)
@setting_option(
    "speed_m_s",
    name="to_m_s",
    option="--to",
    help="fastest speed over ground",
    unset="the fastest the model was identified at, or the vehicle's limit",
)
@setting_option(
    "speed_m_s",
    name="step_m_s",
    option="--step",
    help="between two rows",
    unset="a fifteenth of the range",
)
@setting_options(*CHECK_GROUPS, without={"speed_m_s"})
@data_options("text", "json", "csv")
@path_option(
    "--plots",
    metavar="DIR",
    help="draw the curve into a folder, as SVG and PNG (needs mavjoule[report])",
)
def command(
    mission: str,
    *,
    from_m_s: float | None,
    to_m_s: float | None,
    step_m_s: float | None,
    file_format: str,
    output: Path | None,
    plots: Path | None,
    **options: object,
) -> ExitCode:
    """Show energy and time of a mission over its cruise speed.

    With the speeds of best endurance (least mean power) and best range (least energy), the fastest
    the battery does for, and the fastest that is a go and has room to stop before the fence.

    Nothing is judged: the exit code is 0 for every mission that can be read, 2 for others, and 1
    where mavjoule itself fails.
    """
    settings = mission_settings(mission, given_settings(options))
    refuse_output_file(output, files_read((mission,), settings), made=(plots,))
    settings.pop("speed_m_s", None)  # a range, not the one speed of a configuration
    with bugs_of(mission):
        curve = speed_curve(
            read_mission(mission),
            Setup.of(settings),
            from_m_s=from_m_s,
            to_m_s=to_m_s,
            step_m_s=step_m_s,
        )
        from planner.report import speed_curve as report

        match file_format:
            case "json":
                text = report.speed_curve_json(curve, version=__version__)
            case "csv":
                text = report.speed_curve_csv(curve)
            case _:
                text = report.speed_curve_text(curve)
        if plots is not None:
            _draw(curve, plots)
        write_data(text, output=output)
    return ExitCode.GO


def _draw(curve: SpeedCurve, folder: Path) -> None:
    if any(flown.energy_wh is None for flown in curve.points):
        narrate(f"the energy is not known: nothing is drawn into {folder}")
        return
    from planner.report.plots import speed_figure, write_figures

    for path in write_figures({"speed": speed_figure(curve)}, folder):
        narrate(f"wrote {path}")
