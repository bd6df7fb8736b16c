"""``mavjoule speed``: energy and time over cruise speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from planner import __version__
from planner.cli.configuration import mission_settings
from planner.cli.format_option import data_options
from planner.cli.options import MISSION_PATH, SettingType, given_settings, setting_options
from planner.cli.output import narrate, refuse_overwriting, write_data
from planner.cli.requests import check_request
from planner.cli.settings import BUDGET_SETTINGS, FLIGHT_SETTINGS, SETTINGS
from planner.errors import ExitCode
from planner.fixes.speed import predict_file_speed_curve

if TYPE_CHECKING:
    from planner.fixes.speed_curve import SpeedCurve

_SPEED = SettingType(SETTINGS["speed_m_s"])
_OTHER_SETTINGS = tuple(
    setting for setting in (*FLIGHT_SETTINGS, *BUDGET_SETTINGS) if setting.key != "speed_m_s"
)


@click.command("speed")
@click.argument("mission", type=MISSION_PATH)
@click.option(
    "--from", "from_m_s", metavar="M_S", type=_SPEED, help="slowest speed over ground [default: 1]"
)
@click.option(
    "--to",
    "to_m_s",
    metavar="M_S",
    type=_SPEED,
    help="fastest speed over ground [default: the fastest the model was identified at, or the "
    "vehicle's limit]",
)
@click.option(
    "--step",
    "step_m_s",
    metavar="M_S",
    type=_SPEED,
    help="between two rows [default: a fifteenth of the range]",
)
@setting_options(_OTHER_SETTINGS)
@data_options("text", "json", "csv")
@click.option(
    "--plots",
    metavar="DIR",
    type=click.Path(path_type=Path),
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

    Nothing is judged: the exit code is 0 for every mission that can be read, and 2 otherwise.
    """
    refuse_overwriting(output, (mission,))
    settings = mission_settings(mission, given_settings(options))
    settings.pop("speed_m_s", None)  # a range is looked at, not the one speed of a configuration
    curve = predict_file_speed_curve(
        mission, check_request(settings), from_m_s=from_m_s, to_m_s=to_m_s, step_m_s=step_m_s
    )
    from planner.report import speed_curve

    match file_format:
        case "json":
            text = speed_curve.speed_curve_json(curve, version=__version__)
        case "csv":
            text = speed_curve.speed_curve_csv(curve)
        case _:
            text = speed_curve.speed_curve_text(curve)
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
