"""Setups of typed settings; a model that was read once is not read again for each input."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from planner.setup import Setup
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.setting import Setting
    from planner.vehicle.model import VehicleModel


@cache
def _vehicle(name: str) -> VehicleModel:
    return load_vehicle(name)


def _loaded(setting: Setting, written: Any) -> Any:  # noqa: ANN401 - numbers, names, models
    return _vehicle(str(written)) if setting.key == "vehicle" else setting.loaded(written)


def setup_of(values: Mapping[str, Any]) -> Setup:
    """Return what settings make."""
    return Setup.of(values, loaded=_loaded)
