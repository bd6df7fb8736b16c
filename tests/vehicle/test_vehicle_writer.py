"""Model files as they are written: the strict reader reads back the same model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.errors import OutputError, UsageError
from planner.values import replace
from planner.vehicle.declared import Interval, InvalidValueError, KeyKind, declared
from planner.vehicle.library import load_vehicle, model_names
from planner.vehicle.model import Responses, VehicleModel
from planner.vehicle.reader import read_vehicle, vehicle_from_toml
from planner.vehicle.writer import vehicle_text, write_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from planner.vehicle.declared import Field, Part


@pytest.mark.parametrize("name", model_names())
def test_every_shipped_model_is_read_back_as_it_was_written(name: str, tmp_path: Path) -> None:
    model = load_vehicle(name)
    path = tmp_path / f"{name}.toml"
    write_vehicle(path, model, remarks=("One line.", "", "Another."))
    assert replace(read_vehicle(path), source=model.source) == model
    assert path.read_text(encoding="utf-8").startswith("# One line.\n#\n# Another.\n\nschema = 1\n")


@settings(max_examples=examples(30), deadline=None)
@given(
    text=st.text(min_size=1, max_size=40).filter(str.strip),
    low=st.floats(0.0, 1e9),
    value=st.floats(-1e30, 1e30),
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


def values(field: Field) -> st.SearchStrategy[Any]:
    """Values that a field alone allows; those of several together may still be refused."""
    key = field.key
    low, high = max(key.range.low, -1e6), min(key.range.high, 1e6)
    figures = st.floats(low, high).filter(lambda one: key.range.problem(one) is None)
    texts = st.text(min_size=1, max_size=9).filter(str.strip)
    lists = st.lists(figures, min_size=max(key.count[0], 1), max_size=4, unique=key.rises)
    kinds: dict[KeyKind, st.SearchStrategy[Any]] = {
        KeyKind.TEXT: st.sampled_from(key.choices) if key.choices else texts,
        KeyKind.TEXTS: st.lists(texts, max_size=3).map(tuple),
        KeyKind.INTEGER: st.integers(int(low), int(high)),
        KeyKind.NUMBER: figures,
        KeyKind.NUMBERS: lists.map(lambda one: tuple(sorted(one) if key.rises else one)),
        KeyKind.INTERVAL: st.tuples(figures, figures).map(
            lambda two: Interval(low=min(two), high=max(two))
        ),
        KeyKind.DATE: st.dates(),
        KeyKind.NAMED: st.dictionaries(
            st.sampled_from(key.choices) if key.choices else texts, figures, max_size=3
        ).map(lambda one: tuple(one.items())),
    }
    if field.kind is not None:
        return kinds[field.kind]
    return st.one_of([parts(part) for part in field.parts])


def parts(part: type[Part]) -> st.SearchStrategy[Part | None]:
    """Parts with any of their fields; ``None`` for those that do not fit together."""
    wanted: dict[str, st.SearchStrategy[Any]] = {}
    free: dict[str, st.SearchStrategy[Any]] = {}
    for name, field in declared(part).items():
        if name == "chemistry":  # the reader fills in its curves
            continue
        (wanted if field.is_required else free)[name] = values(field)

    def made(held: dict[str, Any]) -> Part | None:
        try:
            return part(**held)
        except InvalidValueError:
            return None

    return st.fixed_dictionaries(wanted, optional=free).map(made)


@settings(max_examples=examples(40), deadline=None)
@given(data=st.data())
def test_any_parts_that_fit_together_are_read_back_as_they_were_written(
    data: st.DataObject,
) -> None:
    names = ("ramps", "vertical", "loads", "battery", "valid_for", "spread", "provenance")
    fields = declared(VehicleModel)
    drawn = {name: data.draw(values(fields[name])) for name in names}
    model = load_vehicle("falkowski-2023-quadrotor")
    kept = {name: part for name, part in drawn.items() if part is not None}
    changed = replace(model, **({"responses": Responses()} if "ramps" in kept else {}), **kept)
    text = vehicle_text(changed)
    assert vehicle_from_toml(text.encode(), name=model.name, source=model.source) == changed


def test_a_file_that_is_not_called_like_its_model_is_refused(tmp_path: Path) -> None:
    model = load_vehicle()
    with pytest.raises(UsageError, match=r"falkowski-2023-quadrotor\.toml, not mine\.toml"):
        write_vehicle(tmp_path / "mine.toml", model)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_an_error_of_the_output(tmp_path: Path) -> None:
    model = load_vehicle()
    with pytest.raises(OutputError, match="cannot be written"):
        write_vehicle(tmp_path / "nowhere" / f"{model.name}.toml", model)
