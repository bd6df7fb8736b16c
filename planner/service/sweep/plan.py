"""The plan of a sweep: everything its results follow from, with a mark of its content."""

from __future__ import annotations

from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from planner import __version__
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.fleet.fleet import Fleet
    from planner.mission.items import Mission
    from planner.service.sweep.cases import Cases
    from planner.service.sweep.weather import MeasuredWeather
    from planner.setup import Setup


class SweepPlan(Value, dict=True):
    """What is swept: missions, the setup they have in common, and the cases."""

    missions: Mapping[str, Mission]
    """By their names; one, or what the axis ``mission`` goes through."""
    setup: Setup
    cases: Cases
    loaded: Mapping[str, Mapping[str, Any]] = {}
    """What files hold that an axis names, by its key and the name."""
    weather: MeasuredWeather | None = None
    fleet: Fleet | None = None
    """That is judged as a whole, with the missions of its sorties; ``None``: missions are."""

    @cached_property
    def marks(self) -> dict[str, str]:
        """A mark of the content of each part: what differs has another."""
        varied = [(axis.text, axis.values) for axis in self.cases.axes]
        points = [(block.points, block.times) for block in self.cases.blocks]
        setup = replace(self.setup, settings_file=None)  # its path depends on who calls from where
        return {
            "mavjoule": program_mark(),
            "the missions": _mark((self.missions, self.fleet)),
            "the settings": _mark((setup, [list(one.items()) for one in self.loaded.values()])),
            "what varies": _mark((varied, points, self.cases.unchecked_times)),
        }

    @cached_property
    def mark(self) -> str:
        """A mark of everything the results follow from."""
        return _mark(self.marks)


@cache
def program_mark() -> str:
    """Return a mark of the program that makes the results: its version and its source."""
    package = Path(__file__).parents[2]
    digest = sha256(__version__.encode())
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"


def _mark(content: object) -> str:
    plain = msgspec.to_builtins(content, enc_hook=_plain, str_keys=True)
    data = msgspec.json.encode(plain, order="deterministic")
    return sha256(data).hexdigest()[:32]


def _plain(content: object) -> object:
    """Return what JSON has no form of: arrays by their bytes, others by what they hold."""
    import numpy as np

    if isinstance(content, np.ndarray):
        return [str(content.dtype), list(content.shape), content.tobytes().hex()]
    if isinstance(content, np.generic):
        return content.item()
    if isinstance(content, Path):
        return str(content)
    return [type(content).__qualname__, vars(content)]
