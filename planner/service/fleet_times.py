"""What the sorties of a fleet share: packs, vehicles, pads, chargers and the hours of the day."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.fleet.fleet import LATEST_S
from planner.fleet.separation import SAME_HOME_M
from planner.fleet.trajectory import AT_REST_S
from planner.geo.geodesy import LocalFrame
from planner.rules.left_open import IN_SIGHT_M
from planner.service.fleet import FleetFinding, charging_temperature_c, usable_chargers
from planner.service.separation import uncounted_wait
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.fleet.charging import Charge
    from planner.fleet.fleet import Fleet
    from planner.service.fleet import FlownSortie

PAD_RADIUS_M = 5.0
"""A vehicle this near to the middle of a pad stands on it: the position error of a landing, 2.5 m, and as
much again for the vehicle. [m]"""
_FULL = 0.995
_AT_HAND_M = 20.0
"""A vehicle that lands so near to its next start is put there while its pack is changed. [m]"""
_WALK_M_S = 1.4
"""Of a pedestrian. [m/s]"""

PACK_CLASH = Rule(
    "S105 pack-clash",
    Severity.ERROR,
    summary="Two sorties need one battery pack at the same time.",
    why="Whoever is at the field finds no pack in the rack, takes the nearest one, and flies a battery "
    "nobody checked.",
    how="A sortie has its pack from its start until it has landed and the pack is changed ([swap] time_s), "
    "and is brought to where it is flown next, as vehicles are (S108), if that is more than 500 m away.",
    fix="give one of them another pack, or start it later",
    instead="another pack, or another start",
)

PACK_NOT_FULL = Rule(
    "S106 pack-not-full",
    Severity.WARNING,
    summary="A pack is not fully charged when its sortie starts.",
    why="A schedule that counts on full packs is short by what the chargers have not put back yet; the last "
    "fifth takes as long as half of the rest.",
    how="The charge the last flight left, and what the chargers add until the start, by their power and "
    "their taper; a free charger takes the pack that is needed next.  The sortie is checked with what is in "
    "the pack: whether that is enough is E101's to say.  Fires below 99.5 %.",
    fix="start the sortie later, or add a pack or a charger",
)

PACK_NOT_CHARGED = Rule(
    "S107 pack-not-charged",
    Severity.WARNING,
    summary="No charger may charge a pack that is flown again.",
    why="Charging lithium cells below freezing plates metal on them, and most chargers refuse to.",
    how="The air where the charger stands (its air_c, else the lowest temperature of the conditions) is "
    "below its lowest_c, 0 °C where not given, or no charger takes the pack.  It is counted with what the "
    "flight before left.",
    fix="charge indoors and give the charger's air_c, or plan with more packs",
)

VEHICLE_CLASH = Rule(
    "S108 vehicle-clash",
    Severity.ERROR,
    summary="A vehicle is to start before it is back and ready.",
    why="The sortie cannot start when the others count on it: everything after it is late, and no "
    "separation that was checked holds.",
    how="The sorties of one vehicle, each until it has landed, the pack is changed ([swap] time_s) and the "
    "vehicle is carried, at a walk of 1.4 m/s or by carry_m_s of [swap], to a start more than 20 m from "
    "there; a warning where that is more than 500 m away and no carry_m_s says that anybody does.  Without "
    "a pack and a [swap] its flights are counted on one battery: an error where they take more than is above "
    "the reserve, a warning else.  Fires too by its own available_from_s and available_until_s.",
    fix="start the sortie later, or give it to another vehicle",
    instead="another start, or another vehicle",
)

PAD_OCCUPIED = Rule(
    "S109 pad-occupied",
    Severity.ERROR,
    summary="A pad is to be used while another vehicle stands on it.",
    why="A vehicle that comes down on another wrecks both; one that finds its pad taken lands where nobody "
    "planned.",
    how="A vehicle stands on the pad it starts from, and on one within 5 m of which it landed, between its "
    "flights; on a pad that several use it is put as long before its start as a swap takes ([swap] time_s), "
    "and cleared away as long after its landing.",
    fix="give the vehicles a pad each, or start one after the other has left",
    instead="a pad each, or another start",
)

SORTIE_UNSUITED = Rule(
    "S110 sortie-unsuited",
    Severity.ERROR,
    summary="A sortie is given to a vehicle or a pack that cannot fly it.",
    why="A camera that is not there takes no pictures, and a pack that does not fit flies nothing.",
    how="needs of the job against equipment of the vehicle; fits of the pack against the vehicle.",
    fix="give the sortie to a vehicle and a pack that suit it",
    instead="a vehicle and a pack that suit it",
)

OUT_OF_HOURS = Rule(
    "S111 out-of-hours",
    Severity.ERROR,
    summary="A sortie is flown outside the times of its job, or after the operation has to end.",
    why="Permits, daylight and the people who wait for it have hours.",
    how="Start against earliest_s of the job, landing against latest_s of the job and of [operation].",
    fix="start it at another time, or add a vehicle",
)

JOB_NOT_FLOWN = Rule(
    "S112 job-not-flown",
    Severity.ERROR,
    summary="A job of the fleet file has no sortie, or none of it flies a part of its mission.",
    why="A plan that leaves work out looks like one that does it all.",
    how="Every job needs a [sortie]; where its sorties fly files of their own, each waypoint of the job's "
    "mission is in one of them, to 1 m.",
    fix="plan its sorties, or take the job out of the file",
    leaves_open=True,
)

UNKNOWN_ENERGY = Rule(
    "S113 fleet-energy-incomplete",
    Severity.WARNING,
    summary="The energy of the group is not that of every sortie.",
    why="A sum that leaves vehicles out makes plans look better than they are.",
    how="The power of a vehicle is not identified, or its mission is not flown.",
    fix="give the vehicle a model with its power",
)


NOTHING_PLANNED = Rule(
    "S132 nothing-planned",
    Severity.ERROR,
    summary="The fleet has no sorties: there is nothing to judge.",
    why="What nobody flies is clear of everything; that says nothing about what will be flown.",
    how="No table [sortie.NAME] in the file.",
    fix="plan the jobs with mavjoule fleet plan, or simulate a swarm with mavjoule fleet simulate",
    instead="a fleet with sorties",
    leaves_open=True,
)


PACK_ASSUMED = Rule(
    "S118 pack-assumed",
    Severity.INFO,
    summary="A sortie or an agent has no pack: a full battery of the vehicle's model is assumed.",
    why="Nobody has checked that there is a pack, or that it is charged in time.",
    how="No pack in [sortie.NAME], or a [swarm] without any [pack.NAME]: each is checked with the battery of "
    "its model, full.",
    fix="give the packs as [pack.NAME], and each sortie its pack",
)


TIMES_UNKNOWN = Rule(
    "S127 times-unknown",
    Severity.ERROR,
    summary="When a sortie flies is not known: it waits for what its times do not count.",
    why="Everything between sorties is judged by their times: one that waits on the ground flies when the "
    "others are said to be gone.",
    how="T107 at a NAV_DELAY of its mission: until a time of day, or on the ground before the take-off.  "
    "Fires where there are other sorties, or hours to keep.  In a simulation of those that give way also "
    "where a step-response model may be later (E108: circles) and nobody says by whose laws it flies.",
    fix="take the wait out of the mission, and start the sortie later in the fleet file",
    instead="a mission without the wait",
    leaves_open=True,
)


def time_findings(
    fleet: Fleet, flown: Sequence[FlownSortie], charges: Sequence[Charge]
) -> Iterator[FleetFinding]:
    """Yield what is wrong with who flies what, when and on what."""
    if not flown:
        message = "no sorties: nothing was judged"
        yield FleetFinding(finding=NOTHING_PLANNED.finding(message))
    yield from pack_clashes(fleet, flown)
    yield from _packs(fleet, flown, charges)
    yield from vehicle_clashes(fleet, flown)
    yield from pad_clashes(fleet, flown)
    yield from unsuited(fleet, flown)
    yield from too_early(fleet, flown)
    yield from _too_late(fleet, flown)
    yield from _unknown_times(fleet, flown)
    without = [one for one in flown if one.sortie.pack is None and one.energy_wh is not None]
    names = tuple(one.name for one in without)
    for finding in pack_assumed(names):
        yield FleetFinding(finding=finding, sorties=names)
    unknown = [one for one in flown if one.energy_wh is None]
    if unknown:
        names = tuple(one.name for one in unknown)
        message = (
            f"energy of the group without {_names(names)}: "
            f"{quantity.count(len(flown) - len(unknown), 'sortie')} of {len(flown)} counted"
        )
        yield FleetFinding(finding=UNKNOWN_ENERGY.finding(message), sorties=names)


def at(time_s: float) -> str:
    """Return a time of the operation as messages have it: ``at 12:30``."""
    return f"at {quantity.clock(time_s)}"


def pack_assumed(names: Sequence[str]) -> Iterator[Finding]:
    """Yield what is found of sorties or agents without a pack, if there are any."""
    if names:
        message = f"{_names(names)}: no pack is given, a full battery of the model is assumed"
        yield PACK_ASSUMED.finding(message)


def _names(names: Sequence[str]) -> str:
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"{names[0]}{more}"


def _grouped(flown: Iterable[FlownSortie], key: str) -> Mapping[str, list[FlownSortie]]:
    """Return the sorties that have something in common, by what it is called."""
    groups: dict[str, list[FlownSortie]] = {}
    for one in flown:
        name = getattr(one.sortie, key)
        if name is not None:
            groups.setdefault(name, []).append(one)
    return groups


def ready_s(fleet: Fleet, one: FlownSortie, two: FlownSortie) -> float:
    """Return when the vehicle of a sortie is ready for its next: changed, and brought there. [s]"""
    return one.landed_s + fleet.swap_s + carry_s(fleet, carried_m(one, two))


def carry_s(fleet: Fleet, away_m: float) -> float:
    """Return how long it takes to bring a vehicle so far, away from where it landed. [s]"""
    given = None if fleet.swap is None else fleet.swap.carry_m_s
    return away_m / (given or _WALK_M_S)


def carried_m(one: FlownSortie, two: FlownSortie) -> float:
    """Return how far it is from where a sortie lands to where the next starts; 0: it is at hand. [m]"""
    return float(carries_m((one, two))[0, 1])


def carries_m(flown: Sequence[FlownSortie]) -> FloatArray:
    """Return how far it is from where each sortie lands to where each starts; 0: it is at hand. [m]

    One that does not land, or flies nothing, is carried nowhere.
    """
    frames = (one.assessment.route.frame for one in flown if one.assessment is not None)
    frame = next(frames, None)
    place_m = np.full((2, len(flown), 2), np.nan)
    for row, one in enumerate(flown):
        if frame is not None and one.assessment is not None:
            place_m[0, row] = _place_m(one, frame, 0.0)
            if one.lands:
                place_m[1, row] = _place_m(one, frame, one.time_s)
    start_m, end_m = place_m
    away_m = np.hypot(*(end_m[:, None] - start_m).T).T
    return np.where(away_m > _AT_HAND_M, away_m, 0.0)


def pack_clashes(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield packs that two sorties need at once."""
    for name, sorties in _grouped(flown, "pack").items():
        for one, two in pairwise(sorties):
            free_s = _pack_free_s(fleet, one, two)
            if two.start_s < free_s:
                message = (
                    f"pack {name} is needed by {two.name} {at(two.start_s)} and is in {one.name} "
                    f"until {quantity.clock(free_s)}"
                )
                yield FleetFinding(
                    finding=PACK_CLASH.finding(message),
                    sorties=(one.name, two.name),
                    at_s=two.start_s,
                )


def _pack_free_s(fleet: Fleet, one: FlownSortie, two: FlownSortie) -> float:
    """Return when the pack of a sortie is free for its next; over a field a swap brings it. [s]"""
    is_far = carried_m(one, two) > IN_SIGHT_M
    return ready_s(fleet, one, two) if is_far else one.landed_s + fleet.swap_s


def _packs(
    fleet: Fleet, flown: Sequence[FlownSortie], charges: Sequence[Charge]
) -> Iterator[FleetFinding]:
    usable = usable_chargers(fleet)
    cold = [one for one in fleet.chargers.values() if one not in usable]
    for name, sorties in _grouped(flown, "pack").items():
        if any(two.start_s < _pack_free_s(fleet, one, two) for one, two in pairwise(sorties)):
            continue
        short = [one for one in sorties if one.charge is not None and one.charge < _FULL]
        for one in short:
            full = next((c for c in charges if c.pack == name and c.end_s == one.start_s), None)
            charge = quantity.percent(one.charge)
            message = f"pack {name} is at {charge} when {one.name} starts {at(one.start_s)}"
            if full is not None:
                message += f": on the charger since {quantity.clock(full.start_s)}"
            yield FleetFinding(
                finding=PACK_NOT_FULL.finding(message), sorties=(one.name,), at_s=one.start_s
            )
        again = [one for one in short if one is not sorties[0]]
        if again and not any(one.charges(fleet.packs[name]) for one in usable):
            message = f"pack {name} is flown again by {again[0].name} and no charger takes it"
            taking = [one for one in cold if one.charges(fleet.packs[name])]
            if taking:
                air_c = charging_temperature_c(fleet, taking[0])
                message = (
                    f"pack {name} is not charged for {again[0].name}: charger {taking[0].name} charges "
                    f"from {quantity.temperature(taking[0].lowest_c)} up, it is "
                    f"{quantity.temperature(air_c)} there"
                )
            yield FleetFinding(
                finding=PACK_NOT_CHARGED.finding(message),
                sorties=(again[0].name,),
                at_s=again[0].start_s,
            )


def vehicle_clashes(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield vehicles that are not where and when their next sortie starts, or on the battery of the last."""
    for name, sorties in _grouped(flown, "vehicle").items():
        for one, two in pairwise(sorties):
            for finding in _clashes(fleet, name, one, two):
                yield FleetFinding(finding=finding, sorties=(one.name, two.name), at_s=two.start_s)
        if fleet.swap is None:
            yield from _battery_kept(name, sorties)


def _clashes(fleet: Fleet, name: str, one: FlownSortie, two: FlownSortie) -> Iterator[Finding]:
    """Yield what keeps a vehicle from its next sortie."""
    away_m, from_s = carried_m(one, two), ready_s(fleet, one, two)
    carry_m_s = None if fleet.swap is None else fleet.swap.carry_m_s
    if two.start_s < (swapped_s := one.landed_s + fleet.swap_s):
        yield VEHICLE_CLASH.finding(
            f"{two.name} starts {at(two.start_s)}; {name} is back from {one.name} and ready {at(swapped_s)}"
        )
    elif one.assessment is not None and not one.lands:
        yield VEHICLE_CLASH.finding(
            f"{two.name} cannot start: {one.name} leaves {name} in the air, without a landing",
            fix="end the mission before with a landing or a return",
        )
    elif two.start_s < from_s:
        how = "at a walk" if carry_m_s is None else f"at {quantity.speed(carry_m_s)}"
        yield VEHICLE_CLASH.finding(
            f"{two.name} starts {at(two.start_s)}, {quantity.distance(away_m)} from where {one.name} lands; "
            f"carried there {how}, {name} is ready {at(from_s)}"
        )
    elif away_m > IN_SIGHT_M and carry_m_s is None:
        yield VEHICLE_CLASH.finding(
            f"{one.name} lands {quantity.distance(away_m)} from where {two.name} starts: somebody has to "
            f"bring {name} there",
            fix="give carry_m_s in [swap] if somebody does, or land where the next sortie starts",
            severity=Severity.WARNING,
        )


def _battery_kept(name: str, sorties: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield sorties of a vehicle that fly on with one battery: nobody says that it is changed."""
    used_wh = 0.0
    for one, two in pairwise(sorties):
        used_wh += (one.energy_wh or 0.0) + one.beyond_wh
        if two.sortie.pack is not None or used_wh == 0.0:
            continue
        budget = None if two.assessment is None else two.assessment.battery
        left_wh = 0.0 if budget is None else budget.margin_wh - two.beyond_wh - used_wh
        message = (
            f"{two.name} starts with the battery that {one.name} has flown on: no [swap] says that "
            f"{name} has another"
        )
        below = (
            f", and together they take {quantity.energy(-left_wh)} more than is above the reserve"
        )
        finding = VEHICLE_CLASH.finding(
            message + below * (left_wh < 0.0),
            fix="give [swap] time_s if somebody changes it, and the packs",
            severity=Severity.ERROR if left_wh < 0.0 else Severity.WARNING,
        )
        yield FleetFinding(finding=finding, sorties=(one.name, two.name), at_s=two.start_s)


def _too_late(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield who lands after the hours of its vehicle, its job or the operation."""
    for one in flown:
        job, name = fleet.jobs[one.sortie.job], one.sortie.vehicle
        until_s = fleet.vehicles[name].available_until_s
        if until_s is not None and one.landed_s > until_s:
            message = f"{one.name} lands {_at_latest(one)}; {name} is there until {quantity.clock(until_s)}"
            yield FleetFinding(
                finding=VEHICLE_CLASH.finding(message), sorties=(one.name,), at_s=until_s
            )
        limits = [(f"job {job.name}", job.latest_s), ("the operation", fleet.operation.latest_s)]
        for what, latest_s in limits:
            if latest_s is not None and one.landed_s > latest_s:
                message = (
                    f"{one.name} lands {_at_latest(one)}, {what} ends at {quantity.clock(latest_s)} "
                    f"({quantity.duration(one.landed_s - latest_s)} late)"
                )
                yield FleetFinding(
                    finding=OUT_OF_HOURS.finding(message), sorties=(one.name,), at_s=latest_s
                )


def _at_latest(one: FlownSortie) -> str:
    """Return when a sortie lands, in words."""
    later = one.late_s > 0.0
    return at(one.landed_s) + " at the latest (E105, E108, or as its own autopilot flies)" * later


def too_early(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield who starts before the hours of its vehicle or its job."""
    for one in flown:
        job, name = fleet.jobs[one.sortie.job], one.sortie.vehicle
        from_s = fleet.vehicles[name].available_from_s
        if one.start_s < from_s:
            message = f"{one.name} starts {at(one.start_s)}; {name} is there from {quantity.clock(from_s)}"
            yield FleetFinding(
                finding=VEHICLE_CLASH.finding(message), sorties=(one.name,), at_s=one.start_s
            )
        if one.start_s < job.earliest_s:
            message = (
                f"{one.name} starts {at(one.start_s)}, job {job.name} not before "
                f"{quantity.clock(job.earliest_s)}"
            )
            yield FleetFinding(
                finding=OUT_OF_HOURS.finding(message), sorties=(one.name,), at_s=one.start_s
            )


class Stand(Value):
    """How long a vehicle stands about one of its flights."""

    before_s: float
    """At the place where it takes off. [s]"""
    after_s: float
    """At the place where it ended. [s]"""


def stands(fleet: Fleet, flown: Sequence[FlownSortie]) -> Mapping[str, Stand]:
    """Return how long vehicles stand before and after each sortie, by its name."""
    users: dict[str, set[str]] = {}
    for one in flown:
        if (pad := fleet.pad_of(one.sortie)) is not None:
            users.setdefault(pad.name, set()).add(one.sortie.vehicle)
    swap_s = fleet.swap_s
    found = {}
    for sorties in _grouped(flown, "vehicle").values():
        ends_s = [-AT_REST_S, *(one.landed_s for one in sorties[:-1])]
        starts_s = [*(one.start_s for one in sorties[1:]), AT_REST_S]
        for one, before_s, next_s in zip(sorties, ends_s, starts_s, strict=True):
            pad = fleet.pad_of(one.sortie)
            longest_s = np.inf
            if pad is not None and len(users[pad.name]) > 1:
                longest_s = swap_s
            found[one.name] = Stand(
                before_s=min(max(one.start_s - before_s, 0.0), longest_s),
                after_s=min(max(next_s - one.end_s, 0.0), one.late_s + longest_s),
            )
    return found


def pad_clashes(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield pads that two vehicles stand on, or come down on, at the same time."""
    told: set[tuple[str, str, str]] = set()
    for name, of_pad in pad_stays(fleet, flown).items():
        of_pad.sort(key=lambda stay: (stay.from_s, stay.until_s, stay.flown.name))
        for number, stay in enumerate(of_pad):
            one = stay.flown
            for later in of_pad[number + 1 :]:
                two = later.flown
                if later.from_s >= stay.until_s or one.sortie.vehicle == two.sortie.vehicle:
                    continue
                pair = (name, min(one.name, two.name), max(one.name, two.name))
                if pair in told:
                    continue
                told.add(pair)
                until = "the end" if stay.until_s > LATEST_S else quantity.clock(stay.until_s)
                message = (
                    f"pad {name}: {two.sortie.vehicle} ({two.name}) needs it from "
                    f"{quantity.clock(max(later.from_s, 0.0))}, {one.sortie.vehicle} ({one.name}) "
                    f"stands there until {until}"
                )
                yield FleetFinding(
                    finding=PAD_OCCUPIED.finding(message),
                    sorties=(one.name, two.name),
                    at_s=max(later.from_s, 0.0),
                )


class Stay(Value):
    """A vehicle on a pad."""

    from_s: float
    until_s: float
    flown: FlownSortie


def pad_stays(fleet: Fleet, flown: Sequence[FlownSortie]) -> dict[str, list[Stay]]:
    """Return who stands on each pad and when, by its name; flights in between are not stays."""
    stays: dict[str, list[Stay]] = {}
    stand_of = stands(fleet, flown)
    for one, landing in zip(flown, landing_pads(fleet, flown), strict=True):
        stand, pad = stand_of[one.name], fleet.pad_of(one.sortie)
        if pad is not None:
            stay = Stay(from_s=one.start_s - stand.before_s, until_s=one.start_s, flown=one)
            stays.setdefault(pad.name, []).append(stay)
        if landing is not None:
            stay = Stay(from_s=one.lands_s, until_s=one.end_s + stand.after_s, flown=one)
            stays.setdefault(landing, []).append(stay)
    return stays


def landing_pads(fleet: Fleet, flown: Sequence[FlownSortie]) -> list[str | None]:
    """Return the pads that sorties end on, by name; ``None``: on none."""
    found: list[str | None] = [None] * len(flown)
    if not fleet.pads:
        return found
    pads = [*fleet.pads.values()]
    frame = LocalFrame(latitude_deg=pads[0].latitude_deg, longitude_deg=pads[0].longitude_deg)
    place_m = np.stack(
        frame.east_north_m(
            np.array([pad.latitude_deg for pad in pads]),
            np.array([pad.longitude_deg for pad in pads]),
        ),
        axis=-1,
    )
    for number, one in enumerate(flown):
        if one.lands:
            landing_m = _place_m(one, frame, one.time_s)
            away_m = np.hypot(*(place_m - landing_m).T)
            nearest = int(np.argmin(away_m))
            if away_m[nearest] <= PAD_RADIUS_M:
                found[number] = pads[nearest].name
    return found


def _place_m(one: FlownSortie, frame: LocalFrame, own_s: float) -> FloatArray:
    """Return where a flight is at a time after its start, east and north. [m]"""
    assert one.assessment is not None  # something is flown
    state = one.assessment.flight.motion.state_at_time(np.array([own_s]))
    there = one.assessment.route.frame.latitude_longitude_deg(state.east_m, state.north_m)
    return np.asarray(np.stack(frame.east_north_m(*there), axis=-1)[0])


def unsuited(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield sorties that their vehicle or their pack cannot fly."""
    for one in flown:
        sortie = one.sortie
        vehicle = fleet.vehicles[sortie.vehicle]
        for need in fleet.jobs[sortie.job].needs:
            if need not in vehicle.equipment:
                message = (
                    f"{one.name}: job {sortie.job} needs {need}, {vehicle.name} does not carry it"
                )
                yield FleetFinding(finding=SORTIE_UNSUITED.finding(message), sorties=(one.name,))
        pack = None if sortie.pack is None else fleet.packs[sortie.pack]
        if pack is not None and pack.fits and vehicle.name not in pack.fits:
            message = (
                f"{one.name}: pack {pack.name} fits {', '.join(pack.fits)}, not {vehicle.name}"
            )
            yield FleetFinding(finding=SORTIE_UNSUITED.finding(message), sorties=(one.name,))


def _unknown_times(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    for one in flown:
        latest_s = fleet.operation.latest_s or fleet.jobs[one.sortie.job].latest_s
        wait = uncounted_wait(one.result)
        if wait and (len(flown) > 1 or latest_s is not None):
            message = f"{one.name} {wait}; no time and no separation of it is checked"
            yield FleetFinding(finding=TIMES_UNKNOWN.finding(message), sorties=(one.name,))


def job_findings(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield the jobs that are not flown, or not whole; who flies them when makes no difference."""
    by_job = _grouped(flown, "job")
    for name, job in fleet.jobs.items():
        sorties = by_job.get(name, [])
        if not sorties:
            message = f"job {name} has no sortie"
            yield FleetFinding(
                finding=JOB_NOT_FLOWN.finding(
                    message, fix="add a [sortie.NAME] for it, or take the job out of the file"
                )
            )
        elif all(one.sortie.mission not in {None, job.mission} for one in sorties):
            missing = _places_left_out(job.mission, sorties)
            if missing:
                message = (
                    f"job {name}: {quantity.count(len(missing), 'item')} of its mission in none of its "
                    f"sorties, item {missing[0]} first"
                )
                yield FleetFinding(
                    finding=JOB_NOT_FLOWN.finding(message),
                    sorties=tuple(one.name for one in sorties),
                )


def _places_left_out(mission: str, sorties: Sequence[FlownSortie]) -> list[int]:
    """Return the items of a mission at whose place no sortie of its job flies."""
    from planner.errors import MissionFileError
    from planner.mission.commands import Command
    from planner.mission.files import read_mission

    try:
        items = read_mission(mission).items
    except MissionFileError:
        return []  # each sortie has a file of its own that is checked
    flown = [
        (item.latitude_deg, item.longitude_deg)
        for one in sorties
        if one.assessment is not None
        for item in one.assessment.mission.items
        if item.latitude_deg is not None and item.longitude_deg is not None
    ]
    if not flown:
        return []  # each of them says itself that it flies nothing
    frame = LocalFrame(latitude_deg=flown[0][0], longitude_deg=flown[0][1])
    there_m = np.stack(frame.east_north_m(*np.array(flown).T), axis=-1)
    missing = []
    for number, item in enumerate(items, 1):
        if item.command != Command.NAV_WAYPOINT:
            continue
        if item.latitude_deg is None or item.longitude_deg is None:
            continue
        own_m = np.array(frame.east_north_m(item.latitude_deg, item.longitude_deg))
        if np.hypot(*(there_m - own_m).T).min() > SAME_HOME_M:
            missing.append(number)
    return missing
