"""What becomes of a fleet when one thing goes otherwise than planned, and who takes over."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import SplitError
from planner.findings import Rule, Severity
from planner.fleet.fleet import LATEST_S, ContingencyKind
from planner.mission.formats.plan import read_plan_text
from planner.service.fleet import FleetFinding, fly_sorties, pack_battery
from planner.service.fleet_separation import RETURN_CROSSES, Encounters, separation_findings
from planner.service.fleet_times import at, job_findings, ready_s, time_findings
from planner.service.separation import SEPARATION_UNCHECKED
from planner.service.split import split_under
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from planner.fleet.charging import Charge
    from planner.fleet.fleet import Fleet, FleetVehicle, Sortie
    from planner.service.fleet import FlownSortie, SortieChecks

HEALTH_LOST = 0.1
"""Of the charge of a new pack: half of the fifth a pack loses until it is retired at 80 %, about what one
loses between two measurements a season apart. [-]"""
_LEAST_HEALTH = 0.01
_MOST_USED_PACKS = 3
"""Packs flown on already that are tried for one start, those that are back first; unused ones come before."""
_MOST_PLANNED_AGAIN = 12
"""Sorties of a fleet that are planned again where the others leave no room: each is tried beside all."""
_SAME_TIME_S = 1e-6

VEHICLE_OUT = Rule(
    "S122 vehicle-out",
    Severity.WARNING,
    summary="What a vehicle flies is not taken over by the others when it is out.",
    why="A motor that does not start in the morning takes its share of the work with it: a plan that counts "
    "on every vehicle fails with any of them.",
    how="Each vehicle that flies is left out.  Its sorties, those of highest priority first, are given to "
    "another vehicle and a pack that suit them, at the first start that is clear of the others and in its "
    "hours: where planned, or once a flight has landed.  A sortie that is too much for their batteries is "
    "split anew where its job has may_split.  What the others fly stays as planned; where that leaves no "
    "room, up to 12 sorties are all planned again.",
    fix="allow more time, add a vehicle or a pack, or equip another vehicle for the job",
)

WEAK_PACK = Rule(
    "S123 weak-pack",
    Severity.WARNING,
    summary="A sortie does not get by on its pack with 10 % less health.",
    why="A pack ends its life at about 80 % of its charge, and few are measured more than once a season.",
    how="The fleet with each pack at 0.1 less of its health (battery_health): every sortie on it, and its "
    "charges in between.  A sortie without a pack: the battery of its model.",
    fix="fly it on the pack that is named, in shorter sorties, or measure the packs more often",
)

LATE_SORTIE = Rule(
    "S124 late-sortie",
    Severity.WARNING,
    summary="A sortie that is late by its tolerance upsets the rest.",
    why="Whoever waits for a vehicle, a pack or a pad is late too; a start cleared to the second is then "
    "another start.",
    how="Each sortie starts start_error_s of [separation] later and takes the p90 of its time, where the "
    "model has a spread; the next sorties on its vehicle and its pack wait for it.  Times, packs, pads and "
    "hours are judged again, and the separation where one waits longer than start_error_s.",
    fix="leave more time between the sorties",
)

RETURN_NOT_HELD = Rule(
    "S125 return-not-clear",
    Severity.WARNING,
    summary="Some returns of a vehicle meet another, or take more than its battery has.",
    why="A failsafe brings a vehicle home at any moment; that is when nobody has time to move the others.",
    how="The returns from every moment of its sorties: near others as in S115, those that stand on the "
    "ground too, and above the reserve.",
    fix="give the vehicles other return heights, places or starts, or shorter sorties",
)

CONTINGENCY_NOT_JUDGED = Rule(
    "S126 contingency-not-judged",
    Severity.WARNING,
    summary="Whether the fleet survives a contingency could not be judged.",
    why="What was not judged is no answer: a plan is not known to survive it.",
    how="No tolerance of time is given, the power of a vehicle is not known, or heights cannot be compared.",
    fix="give start_error_s in [separation], a model with its power, and amsl_m of the pads",
    leaves_open=True,
)

RULES = {
    ContingencyKind.VEHICLE_OUT: VEHICLE_OUT,
    ContingencyKind.WEAK_PACK: WEAK_PACK,
    ContingencyKind.LATE: LATE_SORTIE,
    ContingencyKind.RETURN: RETURN_NOT_HELD,
}


class Takeover(Value):
    """A sortie as it is flown instead; where it is split anew, one of its parts."""

    sortie: str
    vehicle: str
    pack: str | None
    start_s: float
    end_s: float


class Contingency(Value):
    """One thing that goes otherwise, and what becomes of the fleet."""

    kind: ContingencyKind
    subject: str
    """Name of the vehicle, the pack or the sortie."""
    what: str
    """In words: ``kestrel is out``."""
    holds: bool | None
    """Whether all is still flown, clear and within its batteries; ``None``: not judged."""
    why: str = ""
    """What does not hold, or why it is not judged."""
    is_as_planned: bool = False
    """Whether nothing does not hold but what makes the plan itself a no-go."""
    sorties: tuple[str, ...] = ()
    """Those it is about."""
    takeovers: tuple[Takeover, ...] = ()


def contingency_findings(
    fleet: Fleet, contingencies: Sequence[Contingency]
) -> Iterator[FleetFinding]:
    """Yield what does not hold, each alone, and what was not judged, for each reason together.

    An error where the file asks for it.  Of what the plan itself is a no-go for nothing is told again.
    """
    open_: dict[tuple[ContingencyKind, str], list[Contingency]] = {}
    for one in contingencies:
        if one.holds is None:
            open_.setdefault((one.kind, one.why), []).append(one)
        elif not one.holds and not one.is_as_planned:
            message = f"{one.what}: {one.why}"
            if one.takeovers:
                message += f"; {takeover_text(one.takeovers)}"
            yield _told(fleet, RULES[one.kind], one.kind, message)
    for (kind, why), rows in open_.items():
        more = f" and {len(rows) - 1} more" if len(rows) > 1 else ""
        yield _told(fleet, CONTINGENCY_NOT_JUDGED, kind, f"{rows[0].what}{more}: {why}")


def _told(fleet: Fleet, rule: Rule, kind: ContingencyKind, message: str) -> FleetFinding:
    """Return a finding about no sorties: none of them is in another's way."""
    is_asked = kind in fleet.operation.must_survive
    return FleetFinding(
        finding=rule.finding(message, severity=Severity.ERROR if is_asked else None)
    )


def takeover_text(takeovers: Sequence[Takeover]) -> str:
    """Return who flies what instead, in words."""
    return ", ".join(
        f"{one.sortie} by {one.vehicle}{f' on {one.pack}' if one.pack else ''} {at(one.start_s)}"
        for one in takeovers
    )


def judge_contingencies(
    fleet: Fleet,
    checks: SortieChecks,
    flown: Sequence[FlownSortie],
    apart: Sequence[FleetFinding],
    kinds: Collection[ContingencyKind],
) -> tuple[Contingency, ...]:
    """Return what becomes of a fleet, as it is planned, with each thing that may go otherwise.

    Parameters
    ----------
    fleet, checks, flown
        The fleet, and its sorties as they are flown.
    apart : sequence of FleetFinding
        What is found of the distances between them.
    kinds : collection of ContingencyKind
        What may go otherwise.
    """
    judge = _Judge(fleet, checks, flown, apart)
    by_kind = {
        ContingencyKind.VEHICLE_OUT: judge.vehicles_out,
        ContingencyKind.WEAK_PACK: judge.weak_packs,
        ContingencyKind.LATE: judge.late_sorties,
        ContingencyKind.RETURN: judge.returns,
    }
    return tuple(row for kind, rows in by_kind.items() if kind in kinds for row in rows())


class _Judge:
    """A checked fleet, and the check of the same with other sorties or packs."""

    def __init__(
        self,
        fleet: Fleet,
        checks: SortieChecks,
        flown: Sequence[FlownSortie],
        apart: Sequence[FleetFinding],
    ) -> None:
        self._fleet = fleet
        self._checks = checks
        self._flown = flown
        self._apart = apart
        self._setup = fleet.group_setup
        self._encounters = Encounters()
        self._jobs = [*job_findings(fleet, flown)]
        self._planned = {_about(one) for one in self._errors(fleet, apart=apart)}
        """What makes the plan itself a no-go."""
        codes = {one.finding.code for one in apart}
        self._are_all_apart = not codes & {code for code, _ in self._planned}
        self._error_s = 0.0 if fleet.separation is None else fleet.separation.start_error_s
        """Of each start. [s]"""

    def vehicles_out(self) -> Iterator[Contingency]:
        """Yield what becomes of the work without each vehicle."""
        for name in dict.fromkeys(one.sortie.vehicle for one in self._flown):
            lost = [one.sortie for one in self._flown if one.sortie.vehicle == name]
            rest, untaken = self._without(name, lost)
            row = Contingency(
                kind=ContingencyKind.VEHICLE_OUT,
                subject=name,
                what=f"{name} is out",
                holds=False,
                why=untaken,
                sorties=tuple(one.name for one in lost),
                takeovers=tuple(
                    _takeover(one)
                    for one in self._fly(rest)
                    if one.sortie != self._fleet.sorties.get(one.name)
                ),
            )
            if not untaken:
                # Where all were apart, each that is taken over was tried beside all others.
                after = replace(self._fleet, sorties=rest)
                row = self._judged(
                    row, self._errors(after, apart=() if self._are_all_apart else None)
                )
            yield row

    def _without(self, name: str, lost: Sequence[Sortie]) -> tuple[dict[str, Sortie], str]:
        """Return the sorties without a vehicle, and why one of them is not flown any more.

        What others fly stays as planned, else everything is planned again, most urgent first.
        """
        all_ = self._fleet.sorties.values()
        kept = {one.name: one for one in all_ if one.vehicle != name}
        rest, untaken = self._planned_beside(kept, lost, without=name)
        if untaken and len(all_) <= _MOST_PLANNED_AGAIN:
            again, still_untaken = self._planned_beside({}, [*all_], without=name)
            if not still_untaken:
                return again, ""
        return rest, untaken

    def _planned_beside(
        self, kept: Mapping[str, Sortie], more: Sequence[Sortie], *, without: str
    ) -> tuple[dict[str, Sortie], str]:
        rest, untaken = dict(kept), ""
        for sortie in sorted(more, key=self._urgency):
            found = self._first_fit(rest, sortie, without)
            if not isinstance(found, str):
                rest[sortie.name] = found
            elif parts := self._in_parts(rest, sortie, without):
                rest.update(parts)
            else:
                untaken = untaken or f"nobody takes over {sortie.name}: {found}"
        return rest, untaken

    def _in_parts(
        self, rest: Mapping[str, Sortie], sortie: Sortie, without: str
    ) -> Mapping[str, Sortie]:
        """Return a sortie split anew for a battery it is too much for, beside others; empty: it is not.

        For each vehicle and kind of pack, of most energy first: the first split whose parts all fit.
        """
        if not self._fleet.jobs[sortie.job].may_split:
            return {}
        flown = self._fly(rest)
        substitutes = {
            (one.name, pack and self._fleet.packs[pack].group): replace(
                sortie, vehicle=one.name, pack=pack, pad=None
            )
            for one in self._equipped(sortie, without)
            for pack in self._packs(rest, flown, one.name, sortie.pack)
        }
        for one in sorted(substitutes.values(), key=self._checks.battery_wh, reverse=True):
            taken = dict(rest)
            for part in self._split(one):
                found = self._first_fit(taken, part, without)
                if isinstance(found, str):
                    break
                taken[part.name] = found
            else:
                if len(taken) > len(rest):
                    return taken
        return {}

    def _split(self, sortie: Sortie) -> list[Sortie]:
        """Return the parts of a sortie that its vehicle can fly on full packs; empty: it flies it whole."""
        full = None if sortie.pack is None else 1.0
        if self._checks.flown(sortie, full).result.verdict == "go":
            return []
        try:
            split = split_under(self._checks.mission(sortie), self._checks.setup(sortie, full))
        except SplitError:
            return []
        whole, found = self._fleet.mission_of(sortie), []
        kind = sortie.pack and (self._fleet.packs[sortie.pack].group or sortie.pack)
        for number, part in enumerate(split.parts, 1):
            name = f"{sortie.name}-{number:02}of{len(split.parts):02}"
            path = f"{whole} part {number} of {len(split.parts)} for {sortie.vehicle} on {kind}"
            self._checks.give(path, read_plan_text(part.text, source=path))
            found.append(replace(sortie, name=name, mission=path))
        return found

    def weak_packs(self) -> Iterator[Contingency]:
        """Yield what becomes of the sorties with less health of each pack they fly on."""
        groups: dict[tuple[str, bool], list[FlownSortie]] = {}
        for one in self._flown:
            key = (one.sortie.pack, True) if one.sortie.pack else (one.sortie.vehicle, False)
            groups.setdefault(key, []).append(one)
        for (name, is_pack), flown in groups.items():
            row = Contingency(
                kind=ContingencyKind.WEAK_PACK,
                subject=name,
                what=f"{'' if is_pack else 'the battery of '}{name} has "
                f"{quantity.percent(HEALTH_LOST)} less health",
                holds=None,
                sorties=tuple(one.name for one in flown),
            )
            unknown = [one.name for one in flown if one.energy_wh is None]
            if unknown:
                yield replace(row, why=f"the energy of {unknown[0]} is not known")
                continue
            fleet = self._weaker(name) if is_pack else self._weaker_vehicle(name)
            errors = self._errors(fleet, checks=self._checks.of(fleet), apart=self._apart)
            row = self._judged(row, errors)
            if not row.holds and not row.is_as_planned and is_pack:
                instead = (self._on_another_pack(one.sortie) for one in flown)
                row = replace(row, takeovers=tuple(one for one in instead if one is not None))
            yield row

    def late_sorties(self) -> Iterator[Contingency]:
        """Yield what becomes of the rest where each sortie is late by its tolerance."""
        for one in self._flown:
            slow_s = _slow_s(one)
            late_s = self._error_s + slow_s
            row = Contingency(
                kind=ContingencyKind.LATE,
                subject=one.name,
                what=f"{one.name} is {quantity.duration(late_s)} late",
                holds=None,
                sorties=(one.name,),
            )
            if late_s <= 0.0:
                what = f"{one.name} is late"
                yield replace(
                    row, what=what, why="no start_error_s in [separation], no spread of its times"
                )
                continue
            moved_s = self._moved_s(one, late_s)
            moved = self._at_other_starts(moved_s)
            waiting_s = {
                name: by_s - self._error_s
                for name, by_s in moved_s.items()
                if name != one.name and by_s > self._error_s
            }
            # The late one is within the tolerance that all keep apart by.
            errors = self._errors(moved, apart=self._apart)
            if waiting_s:
                errors += self._errors(self._at_other_starts(waiting_s))
            others = [
                f"{name} {quantity.duration(by_s)}"
                for name, by_s in moved_s.items()
                if name != one.name
            ]
            if others:
                row = replace(row, what=f"{row.what}, and then {', '.join(others)}")
            yield self._judged(replace(row, sorties=tuple(moved_s)), errors)

    def returns(self) -> Iterator[Contingency]:
        """Yield whether each vehicle may return at any moment."""
        for name in dict.fromkeys(one.sortie.vehicle for one in self._flown):
            own = [one for one in self._flown if one.sortie.vehicle == name]
            names = tuple(one.name for one in own)
            row = Contingency(
                kind=ContingencyKind.RETURN,
                subject=name,
                what=f"{name} returns from anywhere",
                holds=True,
                sorties=names,
            )
            in_the_way = [
                one
                for one in self._apart
                if one.finding.code == RETURN_CROSSES.code and one.sorties[0] in names
            ]
            open_ = [
                one.finding.message
                for one in self._apart
                if one.finding.code == SEPARATION_UNCHECKED.code and set(one.sorties) & set(names)
            ]
            short = [why for one in own if (why := _return_is_short(one))]
            unknown = [
                f"the energy home of {one.name} is not known"
                for one in own
                if (
                    one.assessment is None
                    or one.assessment.return_plan is None
                    or one.assessment.return_plan.margin_wh is None
                )
            ]
            if in_the_way:
                row = self._judged(row, in_the_way)
            elif short:  # which its own check reports
                row = replace(row, holds=False, why=short[0], is_as_planned=True)
            elif open_ or unknown:
                row = replace(row, holds=None, why=[*open_, *unknown][0])
            yield row

    def _judged(self, row: Contingency, errors: Sequence[FleetFinding]) -> Contingency:
        """Return a contingency with what is wrong then, what is not as planned first."""
        other = [one for one in errors if _about(one) not in self._planned]
        if other or not errors:
            return replace(row, holds=not other, why=other[0].finding.message if other else "")
        finding = errors[0].finding
        why = f"the plan itself is a no-go: {finding.code} {finding.message}"
        return replace(row, holds=False, why=why, is_as_planned=True)

    def _urgency(self, sortie: Sortie) -> tuple[float, float, float, str]:
        job = self._fleet.jobs[sortie.job]
        latest_s = LATEST_S if job.latest_s is None else job.latest_s
        return -job.priority, latest_s, sortie.start_s, sortie.name

    def _fly(self, sorties: Mapping[str, Sortie]) -> tuple[FlownSortie, ...]:
        return fly_sorties(replace(self._fleet, sorties=sorties), self._checks)[0]

    def _errors(
        self,
        fleet: Fleet,
        *,
        checks: SortieChecks | None = None,
        apart: Iterable[FleetFinding] | None = None,
    ) -> list[FleetFinding]:
        """Return what makes a fleet a no-go; with what is found of its distances, where that is known."""
        flown, charges = fly_sorties(fleet, checks or self._checks)
        return self._errors_of(fleet, flown, charges, apart)

    def _errors_of(
        self,
        fleet: Fleet,
        flown: Sequence[FlownSortie],
        charges: Sequence[Charge],
        apart: Iterable[FleetFinding] | None,
    ) -> list[FleetFinding]:
        """Return what makes a fleet that is flown a no-go."""
        if apart is None:
            apart = separation_findings(fleet, flown, self._encounters)
        found = [*time_findings(fleet, flown, charges), *self._jobs, *apart]
        ignored = self._setup.selection.reason
        reported = [one for one in found if not ignored(one.finding, file=fleet.source)]
        own = [
            FleetFinding(finding=finding, sorties=(one.name,))
            for one in flown
            for finding in one.result.findings
        ]
        decisive = (one for one in (*own, *reported) if one.finding.severity >= self._setup.fail_on)
        return sorted(decisive, key=lambda one: -one.finding.severity)

    def _first_fit(self, rest: Mapping[str, Sortie], sortie: Sortie, without: str) -> Sortie | str:
        """Return a sortie where it first fits beside others, else why it does not."""
        job, others = self._fleet.jobs[sortie.job], self._equipped(sortie, without)
        if not others:
            needs = f" with {', '.join(job.needs)}" if job.needs else ""
            return f"there is no other vehicle{needs}"
        others.sort(key=lambda one: one.name != sortie.vehicle)  # who flies it anyway first
        flown, known = self._fly(rest), self._known_errors(rest)
        settled_s = self._fleet.swap_s + 2.0 * self._error_s
        ends_s = {one.name: one.landed_s + settled_s + _slow_s(one) for one in flown}
        openings = {
            (max(start_s, sortie.start_s, vehicle.available_from_s, job.earliest_s), place)
            for place, vehicle in enumerate(others)
            for start_s in (
                sortie.start_s,
                max(ends_s.values(), default=0.0),
                *(ends_s[one.name] for one in flown if one.sortie.vehicle == vehicle.name),
            )
        }
        why = "no vehicle is there in time"
        for start_s, place in sorted(openings):
            vehicle = others[place].name
            pad = sortie.pad if vehicle == sortie.vehicle else None
            for pack in self._packs(rest, flown, vehicle, sortie.pack):
                moved = replace(
                    sortie, vehicle=vehicle, pack=pack, pad=pad, start_s=min(start_s, LATEST_S)
                )
                full = self._checks.flown(moved, None if pack is None else 1.0)
                beside = sorted([*flown, full], key=lambda one: (one.start_s, one.name))
                wrong = self._wrong_beside(beside, known) or self._wrong_with(rest, moved, known)
                if not wrong:
                    return moved
                why = wrong
        return why

    def _equipped(self, sortie: Sortie, without: str) -> list[FleetVehicle]:
        """Return the other vehicles that carry what the job of a sortie needs."""
        needs = set(self._fleet.jobs[sortie.job].needs)
        vehicles = self._fleet.vehicles.values()
        return [one for one in vehicles if one.name != without and needs <= set(one.equipment)]

    def _on_another_pack(self, sortie: Sortie) -> Takeover | None:
        """Return a sortie on the first other pack it can be flown on."""
        rest = {name: one for name, one in self._fleet.sorties.items() if name != sortie.name}
        known = self._known_errors(rest)
        for pack in self._packs(rest, self._fly(rest), sortie.vehicle, sortie.pack):
            moved = replace(sortie, pack=pack)
            if pack != sortie.pack and not self._wrong_with(
                rest, moved, known, is_apart_as_planned=True
            ):
                return _takeover(
                    next(
                        one
                        for one in self._fly({**rest, sortie.name: moved})
                        if one.name == sortie.name
                    )
                )
        return None

    def _packs(
        self,
        rest: Mapping[str, Sortie],
        flown: Sequence[FlownSortie],
        vehicle: str,
        own: str | None,
    ) -> Sequence[str | None]:
        """Return the packs a sortie may be tried on: its own, one unused of each kind, those back first."""
        if own is None:
            return (None,)
        fits = {
            name: pack
            for name, pack in self._fleet.packs.items()
            if not pack.fits or vehicle in pack.fits
        }
        used = {one.pack for one in rest.values()}
        unused = {pack.group: name for name, pack in reversed(fits.items()) if name not in used}
        back = [
            one.sortie.pack
            for one in sorted(flown, key=lambda one: one.end_s)
            if one.sortie.pack in fits
        ]
        first = [own] if own in fits else []
        return [*dict.fromkeys([*first, *unused.values(), *back[:_MOST_USED_PACKS]])]

    def _known_errors(self, rest: Mapping[str, Sortie]) -> set[tuple[str, tuple[str, ...]]]:
        """Return what is wrong with sorties, of their distances as far as they are as planned."""
        unmoved = [
            one
            for one in self._apart
            if all(rest.get(name) == self._fleet.sorties[name] for name in one.sorties)
        ]
        return {
            _about(one) for one in self._errors(replace(self._fleet, sorties=rest), apart=unmoved)
        }

    def _wrong_beside(
        self, flown: Sequence[FlownSortie], known: Collection[tuple[str, tuple[str, ...]]]
    ) -> str:
        """Return what is wrong whatever the packs are charged to: that takes no other check."""
        after = replace(self._fleet, sorties={one.name: one.sortie for one in flown})
        for apart in ((), None):  # distances take longest
            for error in self._errors_of(after, flown, (), apart):
                if _about(error) not in known:
                    return error.finding.message
        return ""

    def _wrong_with(
        self,
        rest: Mapping[str, Sortie],
        sortie: Sortie,
        known: Collection[tuple[str, tuple[str, ...]]],
        *,
        is_apart_as_planned: bool = False,
    ) -> str:
        """Return what is wrong with a sortie beside others that was not without it; empty: nothing."""
        after = replace(self._fleet, sorties={**rest, sortie.name: sortie})
        for apart in ((),) if is_apart_as_planned else ((), None):  # distances take longest
            for error in self._errors(after, apart=apart):
                if _about(error) not in known:
                    return error.finding.message
        return ""

    def _weaker(self, name: str) -> Fleet:
        """Return the fleet with less health of a pack."""
        fleet, pack = self._fleet, self._fleet.packs[name]
        given = pack.settings.get("battery_health")
        battery = pack_battery(fleet, pack)
        health = given or (None if battery is None else battery.health) or 1.0
        settings = {**pack.settings, "battery_health": _less(health)}
        return replace(fleet, packs={**fleet.packs, name: replace(pack, settings=settings)})

    def _weaker_vehicle(self, name: str) -> Fleet:
        """Return the fleet with less health of the battery that a vehicle's model has."""
        fleet, vehicle = self._fleet, self._fleet.vehicles[name]
        battery = vehicle.setup.vehicle.battery
        health = vehicle.setup.battery_health or (None if battery is None else battery.health)
        weaker = replace(vehicle, setup=replace(vehicle.setup, battery_health=_less(health or 1.0)))
        return replace(fleet, vehicles={**fleet.vehicles, name: weaker})

    def _moved_s(self, late: FlownSortie, late_s: float) -> dict[str, float]:
        """Return how much later sorties start where one is late: what needs its vehicle or pack waits. [s]"""
        moved_s = {late.name: late_s}
        for _ in self._flown:
            before = dict(moved_s)
            for key in ("vehicle", "pack"):
                for one, two in self._successions(key):
                    free_s = two.start_s - ready_s(self._fleet, one, two)
                    waits_s = moved_s.get(one.name, 0.0) - max(free_s, 0.0)
                    if waits_s > max(moved_s.get(two.name, 0.0), _SAME_TIME_S):
                        moved_s[two.name] = waits_s
            if moved_s == before:
                break
        return moved_s

    def _successions(self, key: str) -> Iterator[tuple[FlownSortie, FlownSortie]]:
        """Yield every two sorties of which the second is the next on a vehicle or a pack."""
        last: dict[str, FlownSortie] = {}
        for one in self._flown:
            name = getattr(one.sortie, key)
            if name is not None:
                if name in last:
                    yield last[name], one
                last[name] = one

    def _at_other_starts(self, moved_s: Mapping[str, float]) -> Fleet:
        """Return the fleet with sorties that start later."""
        sorties = {
            name: replace(one, start_s=min(one.start_s + moved_s.get(name, 0.0), LATEST_S))
            for name, one in self._fleet.sorties.items()
        }
        return replace(self._fleet, sorties=sorties)


def _takeover(flown: FlownSortie) -> Takeover:
    return Takeover(
        sortie=flown.name,
        vehicle=flown.sortie.vehicle,
        pack=flown.sortie.pack,
        start_s=flown.start_s,
        end_s=flown.end_s,
    )


def _about(found: FleetFinding) -> tuple[str, tuple[str, ...]]:
    return found.finding.code, found.sorties


def _less(health: object) -> float:
    return max(float(health) - HEALTH_LOST, _LEAST_HEALTH)  # type: ignore[arg-type]


def _slow_s(flown: FlownSortie) -> float:
    """Return how much longer a flight takes than predicted, in nine of ten at most. [s]"""
    totals = None if flown.assessment is None else flown.assessment.totals
    if totals is None or totals.time_s_p90 is None:
        return 0.0
    return max(totals.time_s_p90 - totals.time_s, 0.0)


def _return_is_short(flown: FlownSortie) -> str:
    """Return by how much a way home is too long for the battery; empty: it is not."""
    way = None if flown.assessment is None else flown.assessment.return_plan
    if way is None or way.margin_wh is None or way.margin_wh >= 0.0:
        return ""
    return (
        f"the way home of {flown.name} from item {way.tightest_item} is "
        f"{quantity.energy(-way.margin_wh)} short of the reserve"
    )
