"""The library of shipped models."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from planner.errors import UsageError, VehicleFileError
from planner.service.endurance import list_models
from planner.vehicle.library import DEFAULT_MODEL, load_vehicle, model_names
from planner.vehicle.reader import models_root, vehicle_from_toml

if TYPE_CHECKING:
    from pathlib import Path

    from planner.vehicle.model import VehicleModel


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


def test_a_model_is_read_again_where_its_file_has_changed_or_is_another(tmp_path: Path) -> None:
    text = (models_root() / f"{DEFAULT_MODEL}.toml").read_text(encoding="utf-8")
    path, other = (tmp_path / folder / f"{DEFAULT_MODEL}.toml" for folder in ("own", "other"))
    for one in (path, other):
        one.parent.mkdir()
        one.write_text(text, encoding="utf-8")
    before = load_vehicle(path)
    assert load_vehicle(path) is before
    assert load_vehicle(other).source == str(other)
    path.write_text(
        text.replace("description = ", 'description = "changed"  # ', 1), encoding="utf-8"
    )
    assert load_vehicle(path).description == "changed"
    path.write_text("schema = 1", encoding="utf-8")
    for _ in range(2):
        with pytest.raises(VehicleFileError):
            load_vehicle(path)


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("falkowski-2032-quadrotor", DEFAULT_MODEL),
        ("x500", "holybro-x500-v2"),
        ("Mavic 2", "dji-mavic-2-pro"),
        ("astro", "freefly-astro or freefly-astro-max"),
    ],
)
def test_an_unknown_name_is_told_the_nearest(name: str, nearest: str) -> None:
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle(name)
    assert f"did you mean {nearest}?" in str(caught.value)
    assert "mavjoule models lists them" in str(caught.value)


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("phantom", ["dji-phantom-4-rtk"]),
        ("X-500", ["holybro-x500-v2"]),
        ("m300", ["dji-matrice-300-rtk"]),
        ("mavic 2", ["dji-mavic-2-pro"]),
        ("freefly astro", ["freefly-astro", "freefly-astro-max"]),
    ],
)
def test_models_are_found_by_what_people_call_them(words: str, names: list[str]) -> None:
    assert [one.vehicle.name for one in list_models(words.split())] == names


def test_a_search_for_no_model_says_what_to_do() -> None:
    with pytest.raises(UsageError, match=r"'holybro-x5000'; did you mean holybro-x500-v2\?"):
        list_models(["holybro-x5000"])


def test_a_check_reads_no_model_but_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def noted(data: bytes, *, name: str, source: str) -> VehicleModel:
        read.append(name)
        return vehicle_from_toml(data, name=name, source=source)

    monkeypatch.setattr("planner.vehicle.library.vehicle_from_toml", noted)
    load_vehicle("holybro-x500-v2")
    assert read == ["holybro-x500-v2"]


@pytest.mark.parametrize(
    "name", ["", "no-such-thing", "../pyproject", "nowhere/quad.toml", "a\x00"]
)
def test_what_is_no_model_is_an_error_of_the_file(name: str) -> None:
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle(name)
    assert caught.value.problems
