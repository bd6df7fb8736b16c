"""Multicopters by their published figures: mass, battery, rotors, one figure of the hover.

They are data, in ``models/priors/drones.toml``, each figure with its source and the page it was compared
with.  From those with a published flight time follows what hovering costs (`planner.vehicle.priors`);
those marked as models are the library of common drones that ``make drones`` writes.
"""

import datetime as dt
import tomllib
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from planner.autopilot import Autopilot
from planner.values import Value
from planner.vehicle.battery import Battery
from planner.vehicle.declared import POSITIVE, Annotated, Key, Part, Problems, Range
from planner.vehicle.figures import HoverFigure, read_hover
from planner.vehicle.reader import SCHEMA_VERSION, Reading, models_root

FIGURES = {
    "mass": "take-off mass",
    "battery": "battery",
    "propeller": "rotors and propellers",
    "hover": "figure of the hover",
    "limits": "limits of its maker",
}
"""What a source may be of, in words."""


class FigureSource(Part):
    """Where a figure comes from."""

    text: Annotated[str, Key("whose figure it is, and of which configuration")]
    page: Annotated[
        str | None, Key("page it was compared with; without one it stands as remembered")
    ] = None

    def __str__(self) -> str:
        """Return the source in words."""
        if self.page is None:
            return f"{self.text} (as remembered, compared with no page)"
        return f"{self.text} (compared with {self.page})"


class FigureSources(Part):
    """The source of each figure."""

    mass: Annotated[FigureSource | None, Key("of the take-off mass")] = None
    battery: Annotated[FigureSource, Key("of charge and voltage")]
    propeller: Annotated[FigureSource | None, Key("of the rotors and their diameter")] = None
    hover: Annotated[FigureSource | None, Key("of the figure of the hover")] = None
    limits: Annotated[FigureSource | None, Key("of what its maker allows")] = None


class PublishedDrone(Part):
    """A multicopter, or one configuration of it, by its published figures."""

    name: Annotated[str, Key("of the drone, and of its model")]
    description: Annotated[str, Key("of the vehicle, for a pilot")]
    is_model: Annotated[bool, Key("whether the library has a model of it")]
    flown_by: Annotated[
        str, Key("autopilot, or maker whose own it is", choices=("px4", "ardupilot", "dji"))
    ]
    flown_by_others: Annotated[
        bool, Key("whether its frame is sold without an autopilot, or flown by others as well")
    ] = False
    mass_kg: Annotated[
        float | None, Key("take-off mass with battery, without payload", "kg", POSITIVE)
    ] = None
    mass_max_kg: Annotated[
        float | None,
        Key("highest take-off mass its maker allows; unknown without it", "kg", POSITIVE),
    ] = None
    ceiling_amsl_m: Annotated[
        float | None,
        Key("height up to which its maker lets it take off with that of mass_kg", "m", POSITIVE),
    ] = None
    wind_max_m_s: Annotated[
        float | None,
        Key("highest wind its maker allows, also to take off and land in", "m/s", POSITIVE),
    ] = None
    charge_ah: Annotated[float, Key("of all batteries together", "Ah", POSITIVE)]
    voltage_v: Annotated[float, Key("energy over charge", "V", POSITIVE)]
    rotors: Annotated[int, Key("propellers; two on one arm count twice", range=Range(3, 16))]
    propeller_m: Annotated[float | None, Key("their diameter", "m", POSITIVE)] = None
    hover: Annotated[
        str | None, Key("one figure of the hover: 18A, 260W, 22min, 25min max (longest flight)")
    ] = None
    sources: Annotated[FigureSources, Key("")]

    def inconsistencies(self) -> Problems:
        """Yield figures without a source, and sources of none."""
        for name, key in (("mass", "mass_kg"), ("propeller", "propeller_m"), ("hover", "hover")):
            if (getattr(self, key) is None) is not (getattr(self.sources, name) is None):
                yield key, f"and sources.{name} belong together: give both or neither"
        limits = (self.mass_max_kg, self.ceiling_amsl_m, self.wind_max_m_s)
        if any(one is not None for one in limits) is not (self.sources.limits is not None):
            yield (
                "mass_max_kg",
                "ceiling_amsl_m or wind_max_m_s, and sources.limits, belong together",
            )

    @property
    def battery(self) -> Battery:
        """The battery as its label has it."""
        return Battery(capacity_ah=self.charge_ah, nominal_voltage_v=self.voltage_v)

    @property
    def figure(self) -> HoverFigure | None:
        """The figure of the hover."""
        return None if self.hover is None else read_hover(self.hover)

    @property
    def autopilot(self) -> Autopilot | None:
        """Who shapes its flight; ``None``: an autopilot of its maker's."""
        return None if self.flown_by == "dji" else Autopilot(self.flown_by)

    @property
    def remembered(self) -> frozenset[str]:
        """Which of the figures were compared with no page, by the names in `FIGURES`."""
        return frozenset(name for name, source in self._sources() if source.page is None)

    @property
    def notes(self) -> tuple[str, ...]:
        """Each figure with its source, in words."""
        shown = {
            "mass": f"{self.mass_kg} kg",
            "battery": f"{self.charge_ah} Ah at {self.voltage_v} V",
            "propeller": f"{self.rotors} of {self.propeller_m} m",
            "hover": self.hover,
            "limits": ", ".join(self._limits()),
        }
        return tuple(f"{FIGURES[name]} {shown[name]}: {source}" for name, source in self._sources())

    def _limits(self) -> Iterator[str]:
        if self.mass_max_kg is not None:
            yield f"take-off mass {self.mass_max_kg} kg at most"
        if self.ceiling_amsl_m is not None:
            yield f"take-off up to {self.ceiling_amsl_m:g} m"
        if self.wind_max_m_s is not None:
            yield f"wind up to {self.wind_max_m_s:g} m/s"

    def _sources(self) -> list[tuple[str, FigureSource]]:
        found = ((name, getattr(self.sources, name)) for name in FIGURES)
        return [(name, source) for name, source in found if source is not None]


class DroneTable(Value):
    """The drones, and the day their figures were gathered."""

    date: dt.date
    drones: tuple[PublishedDrone, ...]

    def named(self, name: str) -> PublishedDrone:
        """Return the drone of a name."""
        return next(one for one in self.drones if one.name == name)


@lru_cache(maxsize=1)
def drone_table() -> DroneTable:
    """Return the published multicopters.

    Raises
    ------
    ValueError
        If their file is not as it must be: a mistake in what is shipped.
    """
    path = models_root() / "priors" / "drones.toml"
    document: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    version, day = document.pop("schema", None), document.pop("date", None)
    reading = Reading()
    drones = [
        reading.part(PublishedDrone, raw | {"name": name}, f"{name}.")
        for name, raw in document.items()
    ]
    if version != SCHEMA_VERSION or not isinstance(day, dt.date) or reading.problems:
        msg = f"{path.name}: schema {version}, date {day}, {reading.problems}"
        raise ValueError(msg)
    held = tuple(one for one in drones if isinstance(one, PublishedDrone))
    return DroneTable(date=day, drones=held)
