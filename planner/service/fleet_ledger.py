"""What became of each rule about a fleet: checked, not checked for want of something, or not applicable."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.rules.ledger import LedgerEntry, Outcome
from planner.service import fleet_contingency as what_if
from planner.service import fleet_layers as layers
from planner.service import fleet_separation as apart
from planner.service import fleet_times as times
from planner.service import separation
from planner.service.fleet_separation import known_system_ids

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Rule
    from planner.fleet.fleet import Fleet
    from planner.service.fleet import FleetFinding, FlownSortie
    from planner.service.fleet_contingency import Contingency

_APART = (separation.SEPARATION, apart.DOWNWASH, apart.RETURN_CROSSES, apart.GROUND_SEPARATION)
_PACKS = (times.PACK_CLASH, times.PACK_NOT_FULL, times.PACK_NOT_CHARGED)
_ALWAYS = (
    times.VEHICLE_CLASH,
    times.SORTIE_UNSUITED,
    times.OUT_OF_HOURS,
    times.JOB_NOT_FLOWN,
    times.UNKNOWN_ENERGY,
    times.PACK_ASSUMED,
    times.TIMES_UNKNOWN,
)


def fleet_checks(
    fleet: Fleet,
    flown: Sequence[FlownSortie],
    found: Sequence[FleetFinding],
    contingencies: Sequence[Contingency],
) -> tuple[LedgerEntry, ...]:
    """Return an entry for each rule about a fleet, by its code."""
    entries = (*_entries(fleet, flown, found), *_contingency_entries(contingencies))
    return tuple(sorted(entries, key=lambda entry: entry.code))


def _contingency_entries(contingencies: Sequence[Contingency]) -> Iterator[LedgerEntry]:
    for kind, rule in what_if.RULES.items():
        own = [one for one in contingencies if one.kind is kind]
        open_ = [one for one in own if one.holds is None]
        if not own:
            yield _entry(rule, Outcome.NOT_APPLICABLE, "--what-if")
        else:
            outcome = Outcome.NOT_CHECKED if open_ else Outcome.CHECKED
            yield _entry(rule, outcome, open_[0].why if open_ else "")


def _entries(
    fleet: Fleet, flown: Sequence[FlownSortie], found: Sequence[FleetFinding]
) -> Iterator[LedgerEntry]:
    vehicles = {one.sortie.vehicle for one in flown}
    several = Outcome.CHECKED if len(vehicles) > 1 else Outcome.NOT_APPLICABLE
    together = "several vehicles that fly" if several is Outcome.NOT_APPLICABLE else ""
    open_ = (separation.SEPARATION_UNCHECKED.code, times.TIMES_UNKNOWN.code)
    unchecked = any(one.finding.code in open_ for one in found)
    yield _entry(separation.SEPARATION_UNCHECKED, several, together)
    for rule in _APART:
        if unchecked:
            needs = "every sortie flown when it is said to, and the altitude of every home"
            yield _entry(rule, Outcome.NOT_CHECKED, needs)
        else:
            yield _entry(rule, several, together)
    if several is Outcome.CHECKED and len(known_system_ids(fleet, flown)) < len(vehicles):
        needs = "system_id of every vehicle"
        yield _entry(separation.DUPLICATE_SYSTEM_ID, Outcome.NOT_CHECKED, needs)
    else:
        yield _entry(separation.DUPLICATE_SYSTEM_ID, several, together)
    without = [one for one in flown if one.sortie.pack is None]
    for rule in _PACKS:
        needs = "a pack of every sortie" if without else ""
        yield _entry(rule, Outcome.NOT_CHECKED if without else Outcome.CHECKED, needs)
    homeless = [one for one in flown if fleet.pad_of(one.sortie) is None]
    needs = "a pad of every sortie" if homeless else ""
    yield _entry(times.PAD_OCCUPIED, Outcome.NOT_CHECKED if homeless else Outcome.CHECKED, needs)
    for rule in _ALWAYS:
        yield _entry(rule, Outcome.CHECKED, "")
    for rule in (layers.LAYER_STEP, layers.NOT_LIFTED):
        if fleet.layers is None:
            yield _entry(rule, Outcome.NOT_APPLICABLE, "[layers]")
        else:
            yield _entry(rule, several, together)
    if any(one.sortie.mission is not None for one in flown):
        yield _entry(layers.LIFTED, Outcome.CHECKED, "")
    else:
        yield _entry(layers.LIFTED, Outcome.NOT_APPLICABLE, "a sortie with a mission of its own")


def _entry(rule: Rule, outcome: Outcome, needs: str) -> LedgerEntry:
    return LedgerEntry(code=rule.code, name=rule.name, outcome=outcome, needs=needs)
