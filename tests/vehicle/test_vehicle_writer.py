"""Model files as they are written: the strict reader reads back the same model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from planner.errors import OutputError, UsageError
from planner.vehicle.declared import Interval
from planner.vehicle.library import load_vehicle, model_names
from planner.vehicle.reader import read_vehicle, vehicle_from_toml
from planner.vehicle.writer import vehicle_text, write_vehicle

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("name", model_names())
def test_every_shipped_model_is_read_back_as_it_was_written(name: str, tmp_path: Path) -> None:
    model = load_vehicle(name)
    path = tmp_path / f"{name}.toml"
    write_vehicle(path, model, remarks=("One line.", "", "Another."))
    assert replace(read_vehicle(path), source=model.source) == model
    assert path.read_text(encoding="utf-8").startswith("# One line.\n#\n# Another.\n\nschema = 1\n")


@settings(max_examples=30, deadline=None)
@given(
    text=st.text(min_size=1, max_size=40).filter(str.strip),
    low=st.floats(0.0, 1e9),
    value=st.floats(-1e300, 1e300),
)
def test_any_text_and_any_number_survive(text: str, low: float, value: float) -> None:
    text = text.encode("utf-8", "replace").decode()
    model = load_vehicle("falkowski-2023-quadrotor")
    changed = replace(
        model,
        description=text,
        valid_for=replace(model.valid_for, mass_kg=Interval(low=low, high=low + 1.0)),
        provenance=replace(model.provenance, readings=(text,), fit=((text, value),)),
    )
    data = vehicle_text(changed).encode()
    assert vehicle_from_toml(data, name=model.name, source=model.source) == changed


def test_a_file_that_is_not_called_like_its_model_is_refused(tmp_path: Path) -> None:
    model = load_vehicle()
    with pytest.raises(UsageError, match=r"falkowski-2023-quadrotor\.toml, not mine\.toml"):
        write_vehicle(tmp_path / "mine.toml", model)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_an_error_of_the_output(tmp_path: Path) -> None:
    model = load_vehicle()
    with pytest.raises(OutputError, match="cannot be written"):
        write_vehicle(tmp_path / "nowhere" / f"{model.name}.toml", model)
