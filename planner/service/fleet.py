"""A fleet judged as a whole: every sortie's own check, what they share, how far they keep apart."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import MissionFileError, UsageError
from planner.fleet.charging import PackDay
from planner.fleet.fleet import ContingencyKind, Fleet
from planner.flight.motion.kinematics import STATE_INDEX, STATES, FlightState
from planner.mission.files import read_mission
from planner.mission.items import Home
from planner.presented import Presented
from planner.quantity import mean_of
from planner.selection import exemptions_of
from planner.service.preflight import CheckResult, Verdict, check_read, verdict, verdict_text
from planner.units import wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.findings import Finding
    from planner.fleet.charging import Charge
    from planner.fleet.fleet import Charger, FleetVehicle, Pack, Sortie
    from planner.flight.budget import BatteryBudget
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.rules.ledger import LedgerEntry
    from planner.service.fleet_contingency import Contingency
    from planner.service.preflight import UnreadableMission, VerdictText
    from planner.setup import Setup
    from planner.vehicle.battery import Battery

_LAND = STATE_INDEX[FlightState.LAND]


class FlownSortie(Value):
    """One sortie with the check of its mission, on its vehicle, pack, payload and weather."""

    sortie: Sortie
    result: CheckResult | UnreadableMission
    charge: float | None = None
    """State of charge of its pack at the start; ``None``: no pack is named. [-]"""
    charge_left: float | None = None
    """At the end; ``None``: not known. [-]"""

    @property
    def name(self) -> str:
        """Its name in the fleet file."""
        return self.sortie.name

    @property
    def assessment(self) -> Assessment | None:
        """Everything predicted of it; ``None``: nothing is flown."""
        return self.result.assessment if isinstance(self.result, CheckResult) else None

    @property
    def ways(self) -> list[Assessment]:
        """How it may be flown: as predicted, and as its own autopilot flies where that is known."""
        found = (self.assessment, None if self.assessment is None else self.assessment.own)
        return [one for one in found if one is not None]

    @property
    def as_its_own_flies(self) -> FlownSortie:
        """The sortie as its own autopilot flies it; itself where that is not known."""
        if not isinstance(self.result, CheckResult) or len(self.ways) == 1:
            return self
        return replace(self, result=replace(self.result, assessment=self.ways[-1]))

    @property
    def start_s(self) -> float:
        """When its mission starts. [s]"""
        return self.sortie.start_s

    @property
    def time_s(self) -> float:
        """Duration of the flight; 0 where nothing is flown. [s]"""
        return self.assessment.flight.time_s if self.assessment is not None else 0.0

    @property
    def end_s(self) -> float:
        """When it has landed, as predicted. [s]"""
        return self.start_s + self.time_s

    @property
    def late_s(self) -> float:
        """How much later than predicted it lands, at most, in any way it may be flown. [s]"""
        latest_s = (one.flight.time_s + one.passed_late_s.max(initial=0.0) for one in self.ways)
        return float(max(latest_s, default=0.0)) - self.time_s

    @property
    def lands_s(self) -> float:
        """When it lands at the soonest. [s]"""
        return self.start_s + min((one.flight.time_s for one in self.ways), default=0.0)

    @property
    def landed_s(self) -> float:
        """When it has landed at the latest. [s]"""
        return self.end_s + self.late_s

    @property
    def energy_wh(self) -> float | None:
        """Energy it takes; ``None``: not known. [Wh]"""
        if self.assessment is None or not self.assessment.vehicle.is_power_known:
            return None
        return self.assessment.totals.energy_wh

    @property
    def beyond_wh(self) -> float:
        """What it takes above its prediction, as it is later or its model does not count it (E108). [Wh]"""
        if self.assessment is None:
            return 0.0
        uncounted_wh = self.assessment.uncounted.flown_wh
        return self.assessment.late_wh + (uncounted_wh if math.isfinite(uncounted_wh) else 0.0)

    @property
    def lands(self) -> bool:
        """Whether the flight ends on the ground."""
        if self.assessment is None:
            return False
        return bool(self.assessment.flight.motion.segments.state[-1] == _LAND)


class VehicleTotals(Value):
    """What one vehicle of a fleet flies."""

    vehicle: str
    sorties: int
    time_s: float
    """In the air. [s]"""
    energy_wh: float | None
    """``None``: its power is not known. [Wh]"""


class FleetTotals(Value):
    """The whole operation."""

    vehicles: int
    """That fly."""
    sorties: int
    packs: int
    """That are flown on."""
    energy_wh: float | None
    """Of all sorties whose energy is known; ``None``: of none. [Wh]"""
    is_energy_whole: bool
    """Whether the energy of every sortie is in it."""
    largest_sortie_wh: float | None
    makespan_s: float
    """From the first start to the last landing. [s]"""
    flight_s: float
    """Time in the air of all together. [s]"""
    energy_by_state_wh: Mapping[str, float]
    by_vehicle: tuple[VehicleTotals, ...]


class FleetFinding(Value):
    """A finding about several sorties, or about the fleet."""

    finding: Finding
    sorties: tuple[str, ...] = ()
    """Those it is about; empty: the fleet as a whole."""
    at_s: float | None = None
    """When it happens; ``None``: at no time in particular. [s]"""


class FleetResult(Presented):
    """What the check of a fleet comes to."""

    file: str
    fleet: Fleet
    verdict: Verdict
    sorties: tuple[FlownSortie, ...]
    """In the order of their starts."""
    totals: FleetTotals
    charges: tuple[Charge, ...]
    findings: tuple[FleetFinding, ...]
    """About several sorties or the fleet; those about one are with its check."""
    suppressed: tuple[FleetFinding, ...] = ()
    contingencies: tuple[Contingency, ...] | None = None
    """What becomes of it where one thing goes otherwise; ``None``: nobody asked."""
    checked: tuple[LedgerEntry, ...] = ()
    """What became of each rule about several sorties or the fleet, by its code."""

    @property
    def all_findings(self) -> tuple[Finding, ...]:
        """Every finding, of the sorties too."""
        own = (finding for one in self.sorties for finding in one.result.findings)
        return (*(one.finding for one in self.findings), *own)

    @property
    def is_readable(self) -> bool:
        """Whether the mission of every sortie could be read."""
        return all(one.result.verdict is not None for one in self.sorties)

    @property
    def verdict_text(self) -> VerdictText:
        """The verdict as it is printed."""
        if not self.is_readable:
            return "NOT CHECKED"
        return verdict_text(self.verdict, self.all_findings, self.fleet.group_setup.fail_on)


def check_fleet(
    fleet: Fleet, *, checks: SortieChecks | None = None, what_if: bool = False
) -> FleetResult:
    """Judge a whole fleet: each sortie as `planner.check` does, then all of them together.

    Parameters
    ----------
    fleet : Fleet
        As `planner.read_fleet` returns it.
    checks : SortieChecks, optional
        Of the same vehicles, packs, pads and jobs, with what has been checked already.
    what_if : bool
        Judge contingencies too: each vehicle out, each pack with less health, each sortie late, a return
        of each vehicle.  Those the file names in ``must_survive`` are judged in any case.

    Returns
    -------
    FleetResult
        Verdict, sorties with their checks, totals, charges, findings and contingencies.

    Raises
    ------
    UsageError
        If a vehicle cannot be flown as asked, or no fleet is given.
    """
    from planner.service.fleet_contingency import contingency_findings, judge_contingencies
    from planner.service.fleet_layers import layer_findings
    from planner.service.fleet_ledger import fleet_checks
    from planner.service.fleet_separation import separation_findings
    from planner.service.fleet_times import job_findings, time_findings

    given: object = fleet
    if not isinstance(given, Fleet):
        msg = f"fleet must be planner.read_fleet(path): got {given!r:.60}"
        raise UsageError(msg)
    checks = checks or SortieChecks(fleet)
    flown, charges = fly_sorties(fleet, checks)
    apart = [*separation_findings(fleet, flown)]
    found = [
        *time_findings(fleet, flown, charges),
        *job_findings(fleet, flown),
        *apart,
        *layer_findings(fleet, flown),
    ]
    contingencies = None
    kinds = [one for one in ContingencyKind if what_if or one in fleet.operation.must_survive]
    if kinds:
        contingencies = judge_contingencies(fleet, checks, flown, apart, kinds)
        found += contingency_findings(fleet, contingencies)
    setup = fleet.group_setup
    reported, suppressed = setup.selection.divide([one.finding for one in found], file=fleet.source)
    result = FleetResult(
        file=fleet.source,
        fleet=fleet,
        verdict="go",
        sorties=flown,
        totals=fleet_totals(flown),
        charges=charges,
        findings=_about(reported, found),
        suppressed=_about(suppressed, found),
        contingencies=contingencies,
        checked=fleet_checks(fleet, flown, found, contingencies or ()),
    )
    is_go = result.is_readable and all(one.result.verdict == "go" for one in flown)
    return replace(
        result, verdict=verdict(result.all_findings, setup.fail_on) if is_go else "no-go"
    )


def _about(findings: Sequence[Finding], found: Sequence[FleetFinding]) -> tuple[FleetFinding, ...]:
    """Return findings with the sorties and the time they were found of."""
    known = {replace(one.finding, suppression=""): one for one in found}
    return tuple(replace(known[replace(one, suppression="")], finding=one) for one in findings)


def fly_sorties(
    fleet: Fleet, checks: SortieChecks
) -> tuple[tuple[FlownSortie, ...], tuple[Charge, ...]]:
    """Return every sortie with its check, in the order of the starts, and every charge of a pack.

    A pack has what its last flight left of it and chargers have added since: nothing of the chargers
    depends on a sortie that starts later.
    """
    order = sorted(fleet.sorties.values(), key=lambda one: (one.start_s, one.name))
    needs_s: dict[str, list[float]] = {}
    for sortie in order:
        if sortie.pack is not None:
            needs_s.setdefault(sortie.pack, []).append(sortie.start_s)
    day = PackDay(
        fleet.packs, lambda pack: pack_battery(fleet, pack), usable_chargers(fleet), needs_s
    )
    for pack in fleet.packs.values():
        day.put_down(pack.name, 0.0, mean_of(initial_charge(pack)))
    flown = []
    for sortie in order:
        charge = None if sortie.pack is None else day.take(sortie.pack, sortie.start_s)
        one = checks.flown(sortie, charge)
        flown.append(one)
        if sortie.pack is not None:
            # What is not known is taken for empty: then it is charged the longer.
            day.put_down(sortie.pack, one.landed_s + fleet.swap_s, one.charge_left or 0.0)
    return tuple(flown), day.finish()


def usable_chargers(fleet: Fleet) -> tuple[Charger, ...]:
    """Return the chargers that may charge at the temperature where they stand."""
    return tuple(
        charger
        for charger in fleet.chargers.values()
        if (air_c := charging_temperature_c(fleet, charger)) is None or air_c >= charger.lowest_c
    )


def charging_temperature_c(fleet: Fleet, charger: Charger) -> float | None:
    """Return the temperature where a charger stands; ``None``: nobody says. [°C]"""
    if charger.air_c is not None:
        return charger.air_c
    stated = [one.setup.temperature_c for one in fleet.vehicles.values()]
    known = [mean_of(air_c) for air_c in stated if air_c is not None]
    return min(known) if known else None


def pack_battery(fleet: Fleet, pack: Pack) -> Battery | None:
    """Return the battery of a pack: its own, else that of the model of the first vehicle it fits."""
    if pack.battery is not None:
        return pack.battery
    fits = [one for one in fleet.vehicles.values() if not pack.fits or one.name in pack.fits]
    return fits[0].setup.vehicle.battery if fits else None


def initial_charge(pack: Pack) -> float:
    """Return how full a pack is at the beginning. [-]"""
    charge: float = mean_of(pack.settings.get("charge", 1.0))  # type: ignore[arg-type]
    return charge


def flies_alike(one: FleetVehicle, other: FleetVehicle) -> bool:
    """Return whether two vehicles fly everything alike."""
    return all(
        getattr(one, name) == getattr(other, name)
        for name in ("setup", "pad", "above_m", "below_m")
    )


class SortieChecks:
    """The checks of sorties: missions are read once, and what is flown alike is checked once.

    Parameters
    ----------
    fleet : Fleet
        Vehicles, packs, pads and jobs; its sorties are not looked at.
    missions : mapping, optional
        Missions that are not read from their files, by path.
    """

    def __init__(self, fleet: Fleet, missions: Mapping[str, Mission] | None = None) -> None:
        self._fleet = fleet
        self._missions: dict[str, Mission | MissionFileError] = {}
        self._given = {} if missions is None else missions
        self._checked: dict[tuple[object, ...], CheckResult | UnreadableMission] = {}
        self._firsts: dict[str, FleetVehicle] = {}
        """Vehicles of which each flies otherwise than those before."""

    def of(self, fleet: Fleet) -> SortieChecks:
        """Return the checks of a fleet with other packs or vehicles, sharing what is alike."""
        other = SortieChecks(fleet, self._given)
        other._missions, other._checked = self._missions, self._checked
        other._firsts = self._firsts
        return other

    def flown(self, sortie: Sortie, charge: float | None) -> FlownSortie:
        """Return a sortie with its check, on a pack that is so full."""
        fleet = self._fleet
        path, pad = fleet.mission_of(sortie), fleet.pad_of(sortie)
        pack = None if sortie.pack is None else fleet.packs[sortie.pack]
        key = (
            path,
            None if pad is None else pad.name,
            self._alike(sortie.vehicle),
            fleet.vehicles[sortie.vehicle].setup.battery_health,
            None if pack is None else pack.group,
            None if pack is None else pack.settings.get("battery_health"),
            charge,
            fleet.jobs[sortie.job].payload_kg,
        )
        if key not in self._checked:
            self._checked[key] = check_read(
                lambda: self.mission(sortie), self.setup(sortie, charge), file=path
            )
        result = self._checked[key]
        return FlownSortie(
            sortie=sortie,
            result=result,
            charge=charge,
            charge_left=charge_left(
                result.battery if isinstance(result, CheckResult) else None,
                charge,
                late_wh=_late_wh(result),
            ),
        )

    def _alike(self, name: str) -> str:
        """Return the first vehicle that only its name and its duties tell from another."""
        own = self._fleet.vehicles[name]
        found = next((first for first, one in self._firsts.items() if flies_alike(one, own)), name)
        self._firsts.setdefault(found, own)
        return found

    def setup(self, sortie: Sortie, charge: float | None) -> Setup:
        """Return how a sortie is flown, on a pack that is so full."""
        fleet, pad = self._fleet, self._fleet.pad_of(sortie)
        setup = setup_with(
            fleet.vehicles[sortie.vehicle].setup,
            None if sortie.pack is None else fleet.packs[sortie.pack],
            charge,
            fleet.jobs[sortie.job].payload_kg,
        )
        if met := exemptions_of(fleet.file_ignores, Path(fleet.mission_of(sortie))):
            setup = replace(setup, selection=replace(setup.selection, exemptions=met))
        if pad is not None and pad.amsl_m is not None:
            return replace(setup, home_amsl_m=pad.amsl_m)
        return setup

    def give(self, path: str, mission: Mission) -> None:
        """Take a mission that is in no file for that of a path."""
        self._missions[path] = mission

    def battery_wh(self, sortie: Sortie) -> float:
        """Return the energy of the battery a sortie is flown on, 0 where it is not known. [Wh]"""
        if sortie.pack is None:
            battery = self._fleet.vehicles[sortie.vehicle].setup.vehicle.battery
        else:
            battery = pack_battery(self._fleet, self._fleet.packs[sortie.pack])
        return 0.0 if battery is None else battery.energy_wh

    def mission(self, sortie: Sortie) -> Mission:
        """Return the mission of a sortie, whose home is at its pad.

        Raises MissionFileError if it cannot be read.
        """
        mission, pad = self.written_mission(sortie), self._fleet.pad_of(sortie)
        if pad is None:
            return mission
        # What it was planned from: that of the pad comes with the settings, and rules ask both.
        planned_m = None if mission.home is None else mission.home.altitude_amsl_m
        amsl_m = planned_m if pad.amsl_m is None else planned_m or pad.amsl_m
        home = Home(
            latitude_deg=pad.latitude_deg, longitude_deg=pad.longitude_deg, altitude_amsl_m=amsl_m
        )
        return replace(mission, home=home)

    def written_mission(self, sortie: Sortie) -> Mission:
        """Return the mission of a sortie as its file has it.

        Raises MissionFileError if it cannot be read.
        """
        path = self._fleet.mission_of(sortie)
        if path in self._given:
            return self._given[path]
        if path not in self._missions:
            try:
                self._missions[path] = read_mission(path)
            except MissionFileError as error:
                self._missions[path] = error
        mission = self._missions[path]
        if isinstance(mission, MissionFileError):
            raise mission
        return mission


def setup_with(setup: Setup, pack: Pack | None, charge: float | None, payload_kg: float) -> Setup:
    """Return how a vehicle is flown with a pack and a payload."""
    if payload_kg:
        carried = setup.payload_kg
        setup = replace(
            setup,
            payload_kg=carried + payload_kg
            if isinstance(carried, float | int)
            else replace(carried, mean=carried.mean + payload_kg),
        )
    if pack is None or charge is None:
        return setup
    given = dict(pack.settings)
    if mean_of(given.get("charge", 1.0)) != charge:  # type: ignore[arg-type]
        given["charge"] = charge
    return replace(setup, battery=pack.battery, **given)


def _late_wh(result: CheckResult | UnreadableMission) -> float:
    assessment = result.assessment if isinstance(result, CheckResult) else None
    return 0.0 if assessment is None else assessment.late_wh


def charge_left(
    budget: BatteryBudget | None, charge: float | None, *, late_wh: float = 0.0
) -> float | None:
    """Return the state of charge at the end of a flight begun with one; ``None``: not known. [-]

    ``late_wh`` is what it takes above its prediction, as it is later. [Wh]
    """
    if budget is None or charge is None:
        return None
    left = budget.charge_left_fraction
    left = charge - budget.used_fraction if left is None else left
    return max(left - late_wh / budget.capacity_wh, 0.0)


def fleet_totals(flown: Sequence[FlownSortie]) -> FleetTotals:
    """Return the totals of an operation."""
    known = [one.energy_wh for one in flown if one.energy_wh is not None]
    by_state = np.zeros(len(STATES))
    for one in flown:
        if one.energy_wh is not None and one.assessment is not None:
            flight = one.assessment.flight
            state = flight.motion.segments.state
            by_state += np.bincount(state, wh_from_j(flight.segment_energy_j), len(STATES))
    names = dict.fromkeys(one.sortie.vehicle for one in flown)
    return FleetTotals(
        vehicles=len(names),
        sorties=len(flown),
        packs=len({one.sortie.pack for one in flown} - {None}),
        energy_wh=sum(known) if known else None,
        is_energy_whole=len(known) == len(flown),
        largest_sortie_wh=max(known, default=None),
        makespan_s=_span_s(flown),
        flight_s=sum(one.time_s for one in flown),
        energy_by_state_wh={
            str(state): float(energy_wh)
            for state, energy_wh in zip(STATES, by_state, strict=True)
            if energy_wh
        },
        by_vehicle=tuple(
            _vehicle_totals(name, [one for one in flown if one.sortie.vehicle == name])
            for name in names
        ),
    )


def _span_s(flown: Sequence[FlownSortie]) -> float:
    ends_s = [one.end_s for one in flown]
    return max(ends_s) - min(one.start_s for one in flown) if ends_s else 0.0


def _vehicle_totals(name: str, flown: Sequence[FlownSortie]) -> VehicleTotals:
    energies_wh = [one.energy_wh for one in flown]
    known = [energy_wh for energy_wh in energies_wh if energy_wh is not None]
    return VehicleTotals(
        vehicle=name,
        sorties=len(flown),
        time_s=sum(one.time_s for one in flown),
        energy_wh=sum(known) if len(known) == len(flown) else None,
    )
