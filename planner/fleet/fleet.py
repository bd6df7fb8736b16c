"""A fleet: vehicles, packs, chargers and pads, the jobs they share, and the sorties that do them.

Each class declares the keys of its table in a fleet file (`planner.fleet.reader`); times count in
seconds from the beginning of the operation.
"""

import datetime as dt
import math
from collections.abc import Mapping
from enum import StrEnum
from itertools import pairwise

import numpy as np

from planner.errors import described
from planner.selection import FileIgnore
from planner.setup import Setup
from planner.values import Value, brief, field
from planner.vehicle.battery import Battery
from planner.vehicle.declared import (
    NOT_NEGATIVE,
    POSITIVE,
    Annotated,
    Key,
    Part,
    Problems,
    Range,
    curve,
    together_problems,
)

_SEEN = Range(0.1)
"""Nobody knows finer where a vehicle was: lanes and what a vehicle sees. [m]"""
LATEST_S = 7 * 86_400.0
"""An operation takes a week at most. [s]"""
MOST_PACKS = 1000
MOST_LAYERS = 1000
_TIME = Range(0.0, LATEST_S)
_HEIGHT = Range(0.0, 10_000.0)
ASSUMED_HEIGHT_ERROR_M = 2.5
"""Heights above home drift by 2 to 3 m in a flight: a barometer by 0.1 m for each 0.01 hPa of weather."""
_TAPER_FROM, _TAPER_END = 0.8, 0.05
"""Of a charger whose taper is not given: even power up to four fifths of the charge, then falling to where
chargers end, 2 to 7 % of the rate (Battery University BU-409 has 3 %).  At 1C that is 86 min from empty, even
power to the end would be 60: a pack that takes longer than planned is short at its next flight. [-]"""


class ContingencyKind(StrEnum):
    """What may go otherwise than planned."""

    VEHICLE_OUT = "vehicle-out"
    WEAK_PACK = "weak-pack"
    LATE = "late"
    RETURN = "return"


class FleetOperation(Part):
    """The operation as a whole; optional."""

    start: Annotated[dt.datetime | None, Key("when it begins: 0 s of every time in this file")] = (
        None
    )
    latest_s: Annotated[float | None, Key("everything has landed by then", "s", _TIME)] = None
    geoid_height_m: Annotated[
        float | None,
        Key(
            "height of the geoid (sea level) above the WGS 84 ellipsoid there: for exports with heights "
            "above the ellipsoid",
            "m",
            Range(-110.0, 90.0),
        ),
    ] = None
    must_survive: Annotated[
        tuple[str, ...],
        Key(
            "contingencies that are judged without --what-if, and whose findings are errors: "
            f"{', '.join(ContingencyKind)}"
        ),
    ] = ()

    def inconsistencies(self) -> Problems:
        """Yield what is no contingency."""
        for name in self.must_survive:
            if name not in set(ContingencyKind):
                yield (
                    "must_survive",
                    f"must be of {', '.join(ContingencyKind)}, got {described(name)}",
                )


class Separation(Part):
    """How far vehicles keep apart; required of more than one.

    The zone about each vehicle is an upright cylinder.  It is made larger by the position errors of
    both (``position_error_m``), by their height errors, and by the spread of their times, where their
    models have one.
    """

    horizontal_m: Annotated[
        float, Key("distance kept beside each other", "m", Range(0.0, 1e4, excludes_low=True))
    ]
    above_m: Annotated[
        float | None,
        Key("height kept free above a vehicle, horizontal_m where not given", "m", _HEIGHT),
    ] = None
    below_m: Annotated[
        float | None,
        Key(
            "height kept free below a vehicle, for its downwash; above_m where not given",
            "m",
            _HEIGHT,
        ),
    ] = None
    ground_m: Annotated[
        float | None,
        Key(
            "distance kept while both stand, take off or land below min_nav_alt_m; the position errors "
            "of both where not given",
            "m",
            _HEIGHT,
        ),
    ] = None
    min_nav_alt_m: Annotated[
        float,
        Key("height above its take-off or landing place from which a vehicle flies", "m", _HEIGHT),
    ] = 2.5
    height_error_m: Annotated[
        float, Key("how wrong the height of each vehicle may be", "m", Range(0.0, 100.0))
    ] = ASSUMED_HEIGHT_ERROR_M
    start_error_s: Annotated[
        float, Key("each sortie may start so much sooner or later than planned", "s", _TIME)
    ] = 0.0
    may_stop: Annotated[
        bool,
        Key(
            "whether a vehicle may be told to stop anywhere: the farthest point it then reaches, after "
            "reaction_time_s, is kept apart too"
        ),
    ] = False


class Layers(Part):
    """Heights above home that `mavjoule fleet plan` may lift flights to; optional.

    A flight is lifted, never lowered, where it cannot be kept apart by its start, or only later: its
    greatest height is then that of a layer, and every other is raised by the same.
    """

    lowest_m: Annotated[float, Key("lowest layer", "m", _HEIGHT)]
    highest_m: Annotated[float, Key("highest layer", "m", _HEIGHT)]
    step_m: Annotated[float, Key("from layer to layer", "m", POSITIVE)]

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        if self.highest_m < self.lowest_m:
            yield "highest_m", f"is below lowest_m, {self.lowest_m:g}"
        elif (self.highest_m - self.lowest_m) / MOST_LAYERS > self.step_m:
            yield "step_m", f"makes more than {MOST_LAYERS} layers"

    @property
    def heights_m(self) -> tuple[float, ...]:
        """Each layer, from the lowest up. [m]"""
        count = int((self.highest_m - self.lowest_m) / self.step_m + 1e-9) + 1
        return tuple(self.lowest_m + self.step_m * number for number in range(count))


class SwarmAlgorithm(StrEnum):
    """What a swarm does."""

    MISSIONS = "missions"
    SEARCH = "search"
    RANDOM = "random"
    EXCHANGE = "exchange"
    FORMATION = "formation"


class SwarmTask(Part):
    """What `fleet simulate` has all vehicles do as a swarm, in one plane, in place of jobs.

    ``missions`` has every sortie fly its mission as filed, as does a file without this table; ``search``
    shares lanes over the area out, ``random`` flies in directions drawn by a seed from edge to edge of it,
    ``exchange`` sends each vehicle to the pad half the fleet further on, ``formation`` leads all together to
    where the first one shall be, and back.

    Each vehicle, in the order of the file, takes one of the packs left that fit it: the first of those that
    fit the fewest.  A file without packs has each fly on a full battery of its model.
    """

    algorithm: Annotated[SwarmAlgorithm, Key("what the swarm does")]
    height_m: Annotated[
        float | None,
        Key("height of its plane above the first pad; all but missions need it", "m", _HEIGHT),
    ] = None
    south_deg: Annotated[float | None, Key("edge of the area", "°", Range(-90.0, 90.0))] = None
    west_deg: Annotated[float | None, Key("edge of the area", "°", Range(-180.0, 180.0))] = None
    north_deg: Annotated[
        float | None,
        Key("edge of the area; of a formation where its first leads to", "°", Range(-90.0, 90.0)),
    ] = None
    east_deg: Annotated[
        float | None,
        Key("edge of the area; of a formation where its first leads to", "°", Range(-180.0, 180.0)),
    ] = None
    lane_m: Annotated[float | None, Key("from lane to lane of a search", "m", _SEEN)] = None
    search_s: Annotated[
        float | None, Key("for so long a random search lasts before all fly home", "s", _TIME)
    ] = None
    sensor_radius_m: Annotated[
        float | None,
        Key(
            "how far a vehicle sees about the place below it, for what of the area is seen; "
            "half of lane_m where not given",
            "m",
            _SEEN,
        ),
    ] = None

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        needs: dict[SwarmAlgorithm, tuple[str, ...]] = {
            SwarmAlgorithm.SEARCH: ("south_deg", "west_deg", "north_deg", "east_deg", "lane_m"),
            SwarmAlgorithm.RANDOM: ("south_deg", "west_deg", "north_deg", "east_deg", "search_s"),
            SwarmAlgorithm.FORMATION: ("north_deg", "east_deg"),
        }
        is_in_plane = self.algorithm is not SwarmAlgorithm.MISSIONS
        for key in (*(("height_m",) if is_in_plane else ()), *needs.get(self.algorithm, ())):
            if getattr(self, key) is None:
                yield key, f"is missing: {self.algorithm} needs it"
        for low, high in (("south_deg", "north_deg"), ("west_deg", "east_deg")):
            first, last = getattr(self, low), getattr(self, high)
            if first is not None and last is not None and first >= last:
                yield high, f"is not beyond {low}, {first:g}"
        if self.sensor_radius_m is not None and self.south_deg is None:
            yield "sensor_radius_m", "has no area to see"


class Swap(Part):
    """What happens between two flights of a vehicle; required where packs are given."""

    time_s: Annotated[
        float, Key("from landed to ready with another pack, and the pack on a charger", "s", _TIME)
    ]
    carry_m_s: Annotated[
        float | None,
        Key(
            "speed at which a vehicle that has landed elsewhere is brought to where it starts next; a walk, "
            "1.4, where not given",
            "m/s",
            POSITIVE,
        ),
    ] = None


class NamedPart(Part):
    """A part of a fleet that others in the file name."""

    name: str = ""


class Pad(NamedPart):
    """A place to take off from and to land on, for one vehicle at a time."""

    latitude_deg: Annotated[float, Key("where it is", "°", Range(-90.0, 90.0))]
    longitude_deg: Annotated[float, Key("where it is", "°", Range(-180.0, 180.0))]
    amsl_m: Annotated[
        float | None,
        Key(
            "height above sea level; of the home in the mission where not given",
            "m",
            Range(-500.0, 9000.0),
        ),
    ] = None


class Charger(NamedPart):
    """A kind of charger; give its power, its rate, or how long it takes.

    Packs that wait are charged in the order in which they are needed, each until it is full.
    """

    count: Annotated[int, Key("packs charged at the same time", range=Range(1, 1000))] = 1
    packs: Annotated[tuple[str, ...], Key("packs it charges; all where not given")] = ()
    power_w: Annotated[float | None, Key("power into a pack before the taper", "W", POSITIVE)] = (
        None
    )
    c_rate: Annotated[
        float | None,
        Key("charge current over the charge of the pack, before the taper", "1/h", POSITIVE),
    ] = None
    taper_soc: Annotated[
        tuple[float, ...] | None,
        Key(
            "states of charge, rising, at which taper_factor is given; [0.8, 1.0] where not given",
            range=Range(0.0, 1.0),
            count=(1, 100),
            rises=True,
        ),
    ] = None
    taper_factor: Annotated[
        tuple[float, ...] | None,
        Key(
            "power at each taper_soc over the full one, even in between; [1.0, 0.05] where not given",
            range=Range(0.0, 1.0, excludes_low=True),
            count=(1, 100),
        ),
    ] = None
    charge_soc: Annotated[
        tuple[float, ...] | None,
        curve(
            "states of charge a pack passes, from 0 to 1, instead of a power or rate",
            within=Range(0.0, 1.0),
        ),
    ] = None
    charge_s: Annotated[
        tuple[float, ...] | None,
        curve("time at each charge_soc since the pack was empty", "s", NOT_NEGATIVE),
    ] = None
    lowest_c: Annotated[
        float,
        Key(
            "lowest temperature of a pack it may charge: lithium plates out in the cold",
            "°C",
            Range(-60.0, 60.0),
        ),
    ] = 0.0
    air_c: Annotated[
        float | None,
        Key(
            "temperature where it charges; of the air at home where not given",
            "°C",
            Range(-60.0, 60.0),
        ),
    ] = None

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        given = [one for one in ("power_w", "c_rate", "charge_s") if getattr(self, one) is not None]
        if len(given) != 1:
            what = " and ".join(given) if given else "none of them"
            yield "power_w", f"give one of power_w, c_rate and charge_s, got {what}"
        yield from together_problems(self, "charge_soc", "charge_s")
        yield from together_problems(self, "taper_soc", "taper_factor")
        if self.charge_soc is not None and (self.charge_soc[0], self.charge_soc[-1]) != (0.0, 1.0):
            yield "charge_soc", "must begin at 0 and end at 1"
        if self.charge_soc is not None and self.taper_soc is not None:
            yield "taper_soc", "is in charge_s already: give one of them"

    def charge_after(self, battery: Battery, begin: float, time_s: float) -> float:
        """Return the state of charge of a pack after a time on the charger. [-]"""
        if self.charge_time_s(battery, begin) <= time_s:
            return 1.0
        low, high = begin, 1.0
        for _ in range(50):  # to 1e-15
            middle = 0.5 * (low + high)
            is_reached = self.charge_time_s(battery, begin, middle) <= time_s
            low, high = (middle, high) if is_reached else (low, middle)
        return low

    def charges(self, pack: "Pack") -> bool:
        """Return whether it may charge a pack."""
        return not self.packs or pack.name in self.packs or pack.group in self.packs

    def charge_time_s(self, battery: Battery, begin: float, end: float = 1.0) -> float:
        """Return how long a pack takes from a state of charge to another. [s]"""
        if begin >= end:
            return 0.0
        if self.charge_soc is not None and self.charge_s is not None:
            first_s, last_s = np.interp((begin, end), self.charge_soc, self.charge_s)
            return float(last_s - first_s)
        per_s = (
            self.c_rate if self.c_rate is not None else (self.power_w or 0.0) / battery.energy_wh
        ) / 3600.0
        knots = self.taper_soc or (_TAPER_FROM, 1.0)
        factors = self.taper_factor or (1.0, _TAPER_END)
        soc = np.unique(np.clip((begin, *knots, end), begin, end))
        rate = per_s * np.interp(soc, knots, factors, left=1.0)
        # Between two of these the rate is even in the charge: its inverse integrates to a logarithm.
        return math.fsum(
            (b - a) * (math.log(v / u) / (v - u) if abs(v - u) > 1e-9 * u else 1.0 / u)
            for (a, u), (b, v) in pairwise(zip(soc.tolist(), rate.tolist(), strict=True))
        )


class Pack(NamedPart):
    """One battery pack, or ``count`` alike; the settings of a battery are keys too.

    ``battery`` is what a label says, or a table ``[pack.NAME.battery]`` as in a model file; without it the
    pack is that of the model.
    """

    fits: Annotated[tuple[str, ...], Key("vehicles it fits; all where not given")] = ()
    count: Annotated[
        int, Key("so many alike, called NAME-1, NAME-2 …", range=Range(1, MOST_PACKS))
    ] = 1
    battery: Annotated[Battery | None, Key("battery of the pack, as in a model file")] = None
    group: str = ""
    """Name of its table: that of all that are alike."""
    settings: Mapping[str, object] = field(default_factory=dict)
    """Of a check, by key: charge, battery_health and their like."""


class VehicleTable(NamedPart):
    """One vehicle; the settings of `mavjoule check` are keys too, before those of ``[conditions]``."""

    model: Annotated[str, Key("vehicle model: a shipped one by name, or a model file")]
    pad: Annotated[
        str | None, Key("where it takes off; the home of the mission where not given")
    ] = None
    system_id: Annotated[
        int | None, Key("MAVLink system id; of its parameters where not given", range=Range(1, 255))
    ] = None
    equipment: Annotated[tuple[str, ...], Key("what it carries, for the needs of jobs")] = ()
    available_from_s: Annotated[float, Key("it starts no sooner", "s", _TIME)] = 0.0
    available_until_s: Annotated[float | None, Key("it has landed by then", "s", _TIME)] = None
    above_m: Annotated[
        float | None,
        Key("height kept free above it, in place of that of [separation]", "m", _HEIGHT),
    ] = None
    below_m: Annotated[
        float | None,
        Key("height kept free below it, in place of that of [separation]", "m", _HEIGHT),
    ] = None


class FleetVehicle(VehicleTable):
    """One vehicle of a fleet."""

    setup: Setup
    """How it is flown and judged, without a pack."""

    def heights_m(self, separation: Separation) -> tuple[float, float]:
        """Return the heights kept free above and below it. [m]"""
        above_m = separation.horizontal_m if separation.above_m is None else separation.above_m
        below_m = above_m if separation.below_m is None else separation.below_m
        return (
            above_m if self.above_m is None else self.above_m,
            below_m if self.below_m is None else self.below_m,
        )


class Job(NamedPart):
    """Work to be done: a mission, flown once, in one sortie or in several."""

    mission: Annotated[str, Key("mission file")]
    may_split: Annotated[bool, Key("whether it may be flown in several sorties")] = False
    earliest_s: Annotated[float, Key("it starts no sooner", "s", _TIME)] = 0.0
    latest_s: Annotated[float | None, Key("it has ended by then", "s", _TIME)] = None
    priority: Annotated[int, Key("the higher gives way last", range=Range(0, 1000))] = 0
    needs: Annotated[tuple[str, ...], Key("equipment a vehicle must have for it")] = ()
    payload_kg: Annotated[
        float,
        Key("mass carried for it, beyond the vehicle's own payload", "kg", Range(0.0, 1000.0)),
    ] = 0.0

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        if self.latest_s is not None and self.latest_s <= self.earliest_s:
            yield "latest_s", f"is not after earliest_s, {self.earliest_s:g}"


class Sortie(NamedPart):
    """One flight: a job or a part of it, on a vehicle, on a pack, from a pad, at a time."""

    job: Annotated[str, Key("job it does, or does a part of")]
    vehicle: Annotated[str, Key("vehicle that flies it")]
    start_s: Annotated[float, Key("when the mission starts", "s", _TIME)]
    pack: Annotated[
        str | None, Key("pack it flies on; a full one of the model's own where not given")
    ] = None
    pad: Annotated[str | None, Key("where it takes off; that of its vehicle where not given")] = (
        None
    )
    mission: Annotated[
        str | None, Key("file of its part of the job; that of the job where not given")
    ] = None


class FaultKind(StrEnum):
    """What goes wrong in a simulation."""

    KEEPS_COMMAND = "keeps-command"
    LOSES_POSITION = "loses-position"
    BATTERY_DROPS = "battery-drops"
    LINK_LATE = "link-late"
    GUSTS = "gusts"


_OF_FAULT: Mapping[FaultKind, tuple[str, ...]] = {
    FaultKind.KEEPS_COMMAND: (),
    FaultKind.LOSES_POSITION: ("drift_m_s",),
    FaultKind.BATTERY_DROPS: ("charge_left",),
    FaultKind.LINK_LATE: ("late_s",),
    FaultKind.GUSTS: ("wind_m_s",),
}
"""What each needs, beside when it begins."""


class Fault(NamedPart):
    """What goes wrong in `fleet simulate`: who is hit by it, and is everyone else still safe?

    ``keeps-command``: it flies on by its last command and hears no other, at its speed and in its
    direction; the others see where that leads and keep out of its way, as far as they still may. One that
    flies its mission as filed flies on by that, and stops for nobody. ``loses-position``: the place it
    reports and flies by is wrong by more and more, and nobody knows. ``battery-drops``: its battery holds
    less of a sudden; in a table ``[swarm]`` it flies home if its way there needs it, one that flies its
    mission as filed flies on, whatever its failsafes would have it do. ``link-late``: what it has to do for
    others reaches it late. ``gusts``: gusts about a mean wind blow all vehicles, or one, off their places;
    what flying against them takes is counted by the steady power at that airspeed, where the model knows
    one.

    The gusts are first-order Gauss-Markov, with the intensity and length of Dryden's model at low altitude
    (MIL-F-8785C), drawn for each vehicle by itself.  How a model answers gusts nobody has measured: a
    vehicle is carried along by a change of the wind until it has answered it, as late as a command.
    """

    kind: Annotated[FaultKind, Key("what goes wrong")]
    vehicle: Annotated[
        str | None, Key("vehicle it befalls; all of them where not given, by gusts alone")
    ] = None
    at_s: Annotated[float, Key("when it begins", "s", _TIME)] = 0.0
    lasts_s: Annotated[
        float | None,
        Key(
            "for so long a command is kept or a link is late; to the end where not given",
            "s",
            Range(0.0, LATEST_S, excludes_low=True),
        ),
    ] = None
    drift_m_s: Annotated[
        float | None, Key("by which its position errs more and more", "m/s", Range(0.0, 100.0))
    ] = None
    toward_deg: Annotated[
        float | None,
        Key(
            "where a vehicle that has lost its position drifts to, clockwise from north; drawn by the "
            "seed where not given",
            "°",
            Range(0.0, 360.0),
        ),
    ] = None
    charge_left: Annotated[
        float | None,
        Key(
            "what its battery then holds at most, over what was usable at its take-off",
            range=Range(0.0, 1.0),
        ),
    ] = None
    late_s: Annotated[
        float | None, Key("how late it does what it has to do for others", "s", Range(0.0, 60.0))
    ] = None
    wind_m_s: Annotated[
        float | None,
        Key("mean wind 6 m above the ground that the gusts belong to", "m/s", Range(0.0, 60.0)),
    ] = None

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        own = _OF_FAULT[self.kind]
        for key in own:
            if getattr(self, key) is None:
                yield key, f"is missing: {self.kind} needs it"
        others = {key for keys in _OF_FAULT.values() for key in keys} - {*own}
        if self.kind is not FaultKind.LOSES_POSITION:
            others.add("toward_deg")
        if self.kind not in {FaultKind.KEEPS_COMMAND, FaultKind.LINK_LATE}:
            others.add("lasts_s")
        for key in sorted(others):
            if getattr(self, key) is not None:
                yield key, f"is not a key of {self.kind}"
        if self.vehicle is None and self.kind is not FaultKind.GUSTS:
            yield "vehicle", f"is missing: {self.kind} befalls one"

    @property
    def is_drawn(self) -> bool:
        """Whether it is another by another seed."""
        is_adrift = self.kind is FaultKind.LOSES_POSITION and self.toward_deg is None
        return is_adrift or self.kind is FaultKind.GUSTS


class Fleet(Value):
    """All that a fleet file says, by the names it gives; paths are as they are opened."""

    __repr__ = brief

    source: str
    vehicles: Mapping[str, FleetVehicle]
    jobs: Mapping[str, Job]
    packs: Mapping[str, Pack] = field(default_factory=dict)
    chargers: Mapping[str, Charger] = field(default_factory=dict)
    pads: Mapping[str, Pad] = field(default_factory=dict)
    sorties: Mapping[str, Sortie] = field(default_factory=dict)
    """In the order of the file."""
    operation: FleetOperation = FleetOperation()
    separation: Separation | None = None
    """``None``: of a single vehicle."""
    layers: Layers | None = None
    swarm: SwarmTask | None = None
    """``None``: the vehicles do jobs."""
    faults: Mapping[str, Fault] = field(default_factory=dict)
    """What goes wrong in a simulation."""
    swap: Swap | None = None
    """``None``: no packs are given."""
    file_ignores: tuple[FileIgnore, ...] = ()
    """Codes not to report of the missions that meet them; of the fleet itself all are."""
    digest: str = ""
    """SHA-256 of the file."""
    setting_files: tuple[str, ...] = ()
    """What was read of models, parameters, terrain and the like."""

    @property
    def files_read(self) -> tuple[str, ...]:
        """Every file that is read to judge it: its own, those of its settings, all missions."""
        jobs = (one.mission for one in self.jobs.values())
        flown = map(self.mission_of, self.sorties.values())
        return (self.source, *self.setting_files, *jobs, *flown)

    @property
    def group_setup(self) -> Setup:
        """What holds for the whole group, such as ``fail_on``: the setup of each vehicle has it."""
        return next(iter(self.vehicles.values())).setup

    @property
    def widest_separation_m(self) -> float:
        """Most that any two keep beside each other, the errors of both places included. [m]"""
        kept_m = 0.0 if self.separation is None else self.separation.horizontal_m
        return kept_m + 2.0 * max(one.setup.position_margin_m for one in self.vehicles.values())

    @property
    def swap_s(self) -> float:
        """From landed to ready with another pack. [s]"""
        return 0.0 if self.swap is None else self.swap.time_s

    def pad_of(self, sortie: Sortie) -> Pad | None:
        """Return the pad a sortie takes off from; ``None``: the home of its mission."""
        name = sortie.pad or self.vehicles[sortie.vehicle].pad
        return None if name is None else self.pads[name]

    def mission_of(self, sortie: Sortie) -> str:
        """Return the path of the mission a sortie flies."""
        return sortie.mission or self.jobs[sortie.job].mission
