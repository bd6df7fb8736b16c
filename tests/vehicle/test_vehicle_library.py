"""The library of shipped models."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from planner.errors import VehicleFileError
from planner.vehicle.library import DEFAULT_MODEL, load_vehicle, model_names
from planner.vehicle.reader import models_root

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("name", model_names())
def test_every_shipped_model_loads(name: str) -> None:
    model = load_vehicle(name)
    assert model.name == name
    assert model.source == f"models/{name}.toml"


def test_the_default_model_is_shipped() -> None:
    assert DEFAULT_MODEL in model_names()
    assert load_vehicle().name == DEFAULT_MODEL


def test_a_path_is_read_as_a_file(tmp_path: Path) -> None:
    path = tmp_path / f"{DEFAULT_MODEL}.toml"
    path.write_bytes((models_root() / f"{DEFAULT_MODEL}.toml").read_bytes())
    for given in (path, str(path)):
        assert load_vehicle(given).source == str(path)


def test_an_unknown_name_lists_the_shipped_ones_and_the_nearest() -> None:
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle("falkowski-2032-quadrotor")
    assert f"did you mean {DEFAULT_MODEL}?" in str(caught.value)
    assert all(name in str(caught.value) for name in model_names())


@pytest.mark.parametrize(
    "name", ["", "no-such-thing", "../pyproject", "nowhere/quad.toml", "a\x00"]
)
def test_what_is_no_model_is_an_error_of_the_file(name: str) -> None:
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle(name)
    assert caught.value.problems
