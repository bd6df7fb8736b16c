"""What identification found, state by state: for the model, and for who has to trust it."""

from __future__ import annotations

from enum import StrEnum
from statistics import NormalDist
from typing import TYPE_CHECKING

from planner.values import Value

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.identify.battery import BatteryFit
    from planner.identify.manoeuvres import Manoeuvre
    from planner.identify.steady import MeasuredPower, SteadyMap
    from planner.logs.record import FlightRecord
    from planner.physics.response import TransferFunction
    from planner.vehicle.model import VehicleModel


class FitStatus(StrEnum):
    """What became of a state."""

    IDENTIFIED = "identified"
    """The flights tell it."""
    BASE = "base"
    """The flights do not tell it: taken from the base model."""
    LEFT_OUT = "left-out"
    """The flights do not tell it, and no base model does."""


class SegmentUse(Value):
    """A stretch of a flight, and what it was used for."""

    log: str
    """File name."""
    flight: int
    """Which flight of the log, from 1."""
    start_s: float
    """In the flight. [s]"""
    duration_s: float
    """[s]"""
    what: str
    """The state, and how far or fast: ``climb 100 m``."""
    refusal: str = ""
    """Why it was not used; empty where it was."""
    is_held_out: bool = False
    """Whether the fit that is tested was made without it."""
    fit_percent: float | None = None
    """How well the model describes it. [%]"""

    @property
    def is_used(self) -> bool:
        """Whether the model rests on it, or was tested on it."""
        return not self.refusal


class StateOutcome(Value):
    """What was found about one state."""

    name: str
    """``altitude``, ``speed``, ``climb_power`` …, ``hover``, ``cruise``, ``vertical``, ``battery``."""
    status: FitStatus
    said: str
    """What was identified by which law, or why it was not."""
    unit: str = ""
    """Of the residuals."""
    estimates: tuple[Estimate, ...] = ()
    segments: tuple[SegmentUse, ...] = ()
    """Every stretch that was looked at."""
    fit_percent: float | None = None
    """On segments held out, by a fit without them. [%]"""
    rms: float | None = None
    """Root mean square of the residuals of those. [unit]"""
    whiteness: float | None = None
    """Median chance that white noise has residuals of such a memory. [-]"""

    @property
    def used(self) -> int:
        """Number of segments the model rests on."""
        return sum(s.is_used for s in self.segments)

    @property
    def held_out(self) -> int:
        """Number of segments the model was tested on."""
        return sum(s.is_held_out for s in self.segments)

    def refusals(self) -> tuple[tuple[str, int], ...]:
        """Return the reasons for which segments were not used, each with their number."""
        counts: dict[str, int] = {}
        for segment in self.segments:
            if segment.refusal:
                counts[segment.refusal] = counts.get(segment.refusal, 0) + 1
        return tuple(sorted(counts.items(), key=lambda pair: -pair[1]))


class ResponseEvidence(Value, eq=False):
    """Manoeuvres beside the model that was fitted to them: what a figure shows."""

    name: str
    manoeuvres: tuple[Manoeuvre, ...]
    transfer_function: TransferFunction
    window_s: float | None


class Evidence(Value, eq=False):
    """What the model rests on, for figures."""

    records: tuple[FlightRecord, ...]
    steady: tuple[MeasuredPower, ...]
    hovers: tuple[MeasuredPower, ...]
    responses: tuple[ResponseEvidence, ...]
    steady_map: SteadyMap | None
    battery: BatteryFit | None


class Identification(Value, eq=False):
    """A model made of flights, and how."""

    model: VehicleModel
    states: tuple[StateOutcome, ...]
    findings: tuple[Finding, ...]
    evidence: Evidence
    remarks: tuple[str, ...]
    """Comments for the top of the model file."""

    def state(self, name: str) -> StateOutcome:
        """Return the outcome of a state by its name.

        Raises
        ------
        KeyError
            If there is none of that name.
        """
        for outcome in self.states:
            if outcome.name == name:
                return outcome
        raise KeyError(name)


class Estimate(Value):
    """A number that was measured, and how well."""

    name: str
    value: float
    error: float
    """Standard error, in the unit of the value."""

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the interval that holds the truth with a probability, errors taken as normal."""
        half = NormalDist().inv_cdf(0.5 + 0.5 * confidence) * self.error
        return self.value - half, self.value + half
