"""The library of shipped models: in the wheel and in a checkout alike."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import VehicleFileError, nearest_hint, shortened
from planner.vehicle.reader import models_root, read_vehicle, vehicle_from_toml

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.vehicle.model import VehicleModel

DEFAULT_MODEL = "falkowski-2023-quadrotor"
"""The article's quadrotor, used where no vehicle is named."""


@cache
def model_names() -> tuple[str, ...]:
    """Return the names of the shipped models, sorted."""
    return tuple(sorted(one.stem for one in models_root().iterdir() if one.suffix == ".toml"))


def is_named_by(model: VehicleModel, words: Iterable[str]) -> bool:
    """Return whether name and description of a model hold all words, as people write them: x-500, M300."""
    told = _bare(f"{model.name} {model.description}")
    return all(_bare(word) in told for word in words)


def _bare(text: str) -> str:
    """Return letters and digits alone."""
    return re.sub(r"[^a-z0-9]", "", text.lower())


def load_vehicle(name_or_path: str | Path = DEFAULT_MODEL) -> VehicleModel:
    """Load a shipped model by its name, or a model file by its path.

    Parameters
    ----------
    name_or_path : str or Path
        Text that ends in ``.toml`` or contains a path separator is a path; other text is a name.

    Returns
    -------
    VehicleModel
        The model; the ``source`` of a shipped one is ``models/<name>.toml`` on every machine.

    Raises
    ------
    VehicleFileError
        If there is no such model, or anything in its file is wrong.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or text.endswith(".toml") or Path(text).name != text:
        return read_vehicle(name_or_path)
    names = model_names()
    if text not in names:
        alike = [name for name in names if _bare(text) and _bare(text) in _bare(name)]
        hint = f"; did you mean {' or '.join(alike)}?" if alike else nearest_hint(text, names)
        msg = (
            f"is not a shipped model{hint} (mavjoule models lists them; the path of a model file ends in "
            ".toml)"
        )
        source = f"vehicle {shortened(text) if text else repr(text)}"
        raise VehicleFileError(msg, source=source)
    data = (models_root() / f"{text}.toml").read_bytes()
    return vehicle_from_toml(data, name=text, source=f"models/{text}.toml")
