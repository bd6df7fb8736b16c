"""What the product has to say about a mission: rules and the findings they make."""

from __future__ import annotations

from enum import IntEnum

from planner.values import Value, replace


class Severity(IntEnum):
    """How bad a finding is; ordered, so that ``ERROR > WARNING > INFO``."""

    INFO = 0
    WARNING = 1
    ERROR = 2

    @property
    def label(self) -> str:
        """The lower-case name used in every output format."""
        return self.name.lower()

    def __str__(self) -> str:
        """Return the name, as it is written everywhere."""
        return self.label

    def __repr__(self) -> str:
        """Return the name as a script writes it."""
        return f"Severity.{self.name}"


class Place(Value, kw_only=False, gc=False):
    """A place in a text file, both counted from 1."""

    line: int
    column: int


class FlightStretch(Value):
    """The stretch of ground a finding is about, for maps and pictures; a spot begins where it ends."""

    start_deg: tuple[float, float]
    """Latitude and longitude where it begins. [°]"""
    end_deg: tuple[float, float]
    """Latitude and longitude where it ends. [°]"""
    distance_m: float
    """What the finding is about, along it: way outside a fence, room needed, return. [m]"""
    parts_deg: tuple[tuple[tuple[float, float], ...], ...] = ()
    """Latitudes and longitudes along each part, where there are several or one that bends; the
    first begins and ends where the stretch does, ``distance_m`` is of all. [°]"""

    @property
    def lines_deg(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """What to draw: latitudes and longitudes along each part. [°]"""
        return self.parts_deg or ((self.start_deg, self.end_deg),)


class Finding(Value):
    """One thing a user has to know before flying."""

    code: str
    """Stable code such as ``E101``; never renumbered, never reused."""
    name: str
    """Stable kebab-case name of the rule."""
    severity: Severity
    message: str
    """One sentence with the numbers that made the rule fire."""
    fix: str = ""
    """What to do about it; empty where nothing can be done."""
    item: int | None = None
    """Mission item from 1 in flown order, home not counted; ``None`` where none applies."""
    place: Place | None = None
    """Where in the mission file."""
    stretch: FlightStretch | None = None
    """Where over ground; ``None`` where no one stretch is meant."""
    about: str = ""
    """Code of the rule that could not be evaluated; empty where it is about nothing but itself."""
    of_flight: str = ""
    """The part of the message that depends on how long this flight is; empty where none does."""
    suppression: str = ""
    """Why it is not reported, though it was found; empty where it is reported."""


class Rule(Value, kw_only=False):
    """What is checked, why, and how to live with it."""

    title: str
    """Code and name: ``E101 reserve-below-minimum``; stable, never renumbered, never reused."""
    severity: Severity
    summary: str
    """One line: what the rule says."""
    why: str
    """Why it is bad to ignore, with the incident or source."""
    how: str
    """How it is computed: formula and inputs."""
    fix: str
    """How to make it go away honestly."""
    is_default: bool = True
    """Whether it is evaluated without being selected by its code."""
    instead: str = ""
    """The option to give instead of ignoring it: where there is one, no setting switches its errors off."""
    leaves_open: bool = False
    """Whether it fires where something could not be checked, rather than where something is wrong."""

    @property
    def code(self) -> str:
        """The first letter tells the family."""
        return self.title.partition(" ")[0]

    @property
    def name(self) -> str:
        """In kebab-case."""
        return self.title.partition(" ")[2]

    def finding(
        self,
        message: str,
        *,
        fix: str | None = None,
        item: int | None = None,
        place: Place | None = None,
        severity: Severity | None = None,
        stretch: FlightStretch | None = None,
        about: str = "",
        of_flight: str = "",
    ) -> Finding:
        """Return a finding of this rule; ``fix`` and ``severity`` default to the rule's own."""
        return Finding(
            code=self.code,
            name=self.name,
            severity=self.severity if severity is None else severity,
            message=message,
            fix=self.fix if fix is None else fix,
            item=item,
            place=place,
            stretch=stretch,
            about=about,
            of_flight=of_flight,
        )


class Remarks:
    """Findings by rule: the first of each with its place, and how many more there are."""

    def __init__(self) -> None:
        self._first: dict[tuple[str, Severity], Finding] = {}
        self._count: dict[tuple[str, Severity], int] = {}

    def add(
        self,
        rule: Rule,
        message: str,
        *,
        item: int | None = None,
        place: Place | None = None,
        severity: Severity | None = None,
        fix: str | None = None,
    ) -> None:
        """Add one occurrence of a rule; only the first of each rule and severity is kept."""
        finding = rule.finding(message, item=item, place=place, severity=severity, fix=fix)
        key = (finding.code, finding.severity)
        self._first.setdefault(key, finding)
        self._count[key] = self._count.get(key, 0) + 1

    def findings(self) -> tuple[Finding, ...]:
        """Return one finding for each rule and severity, in the order in which they came up."""
        return tuple(
            finding
            if self._count[key] == 1
            else replace(finding, message=f"{finding.message} (and {self._count[key] - 1} more)")
            for key, finding in self._first.items()
        )
