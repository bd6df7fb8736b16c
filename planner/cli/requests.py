"""Requests: what settings, wherever they were given, ask of a check and of its report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cli.settings import FLEET_SETTINGS, REPORT_SETTINGS
from planner.errors import UsageError
from planner.flight.conditions import Conditions, divided
from planner.selection import Selection
from planner.service import CheckRequest
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.cli.setting import Setting


def check_request(values: Mapping[str, Any]) -> CheckRequest:
    """Return the request that settings by key make; the defaults are the request's own."""
    conditions = {
        key: values[key]
        for key in (
            "wind",
            "home_amsl_m",
            "position_noise_m",
            "battery_health",
            "battery_resistance_factor",
            "battery_temperature_c",
            "reaction_time_s",
            "position_error_m",
        )
        if key in values
    }
    for key, sd_key in (("temperature_c", "temperature_sd_c"), ("payload_kg", "payload_sd_kg")):
        if key in values:
            conditions[key], conditions[sd_key] = divided(values[key])
    if (profile := values.get("wind_profile")) is not None:
        conditions["wind"] = replace(
            values.get("wind", profile),
            reference_height_m=profile.reference_height_m,
            shear_exponent=profile.shear_exponent,
            roughness_length_m=profile.roughness_length_m,
        )
    own = {
        key: values[key]
        for key in (
            "vehicle",
            "speed_m_s",
            "target",
            "clearance_m",
            "profile",
            "battery",
            "charge",
            "reserve",
            "risk",
            "baseline",
            "fail_on",
        )
        if key in values
    }
    selection = {key: values[key] for key in ("select", "extend_select", "ignore") if key in values}
    autopilot = values.get("autopilot", "auto")
    return CheckRequest(
        **own,
        autopilot=None if autopilot == "auto" else autopilot,
        parameters=values.get("params"),
        terrain=values.get("terrain", ()),
        with_trace="trace" in values,
        conditions=Conditions(**conditions),
        selection=Selection(**selection, exemptions=values.get("per_file_ignores", ())),
    )


class ReportRequest(Value):
    """Where the report of a call goes, and how."""

    format: str = "text"
    output: Path | None = None
    """``None``: standard output."""
    trace: Path | None = None
    """``None``: none is written."""
    report: Path | None = None
    """``None``: no page is written."""
    plots: Path | None = None
    """``None``: none are drawn."""
    statistics: bool = False
    exit_zero: bool = False


def report_request(missions: Sequence[Mapping[str, Any]]) -> ReportRequest:
    """Return what holds for a whole call, from the settings of each of its missions.

    Raises
    ------
    UsageError
        If the configurations of two missions see it differently.
    """
    common = _common_values(missions, REPORT_SETTINGS)
    if common.get("output") == Path("-"):
        del common["output"]  # standard output, by its usual name
    return ReportRequest(**common)


def fleet_request(missions: Sequence[Mapping[str, Any]]) -> dict[str, float] | None:
    """Return what holds for missions that fly at the same time; ``None``: they do not.

    Raises
    ------
    UsageError
        If the configurations of two missions see it differently.
    """
    common = _common_values(missions, FLEET_SETTINGS)
    return common if "separation_m" in common else None


def _common_values(
    missions: Sequence[Mapping[str, Any]], settings: Sequence[Setting]
) -> dict[str, Any]:
    """Return settings that must be the same for every mission of a call."""
    common: dict[str, Any] = {}
    for setting in settings:
        values = {values.get(setting.key) for values in missions}
        if len(values) > 1:
            msg = (
                f"the configurations of these missions disagree about {setting.key}: "
                f"give {setting.option}, or check them one by one"
            )
            raise UsageError(msg)
        if (value := values.pop()) is not None:
            common[setting.key] = value
    return common
