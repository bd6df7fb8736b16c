"""A fleet over time: who has what, where all are, what is found of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from textual import on, work
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Static

from planner import quantity
from planner.errors import FleetFileError, MavjouleError, bug_text
from planner.findings import Severity
from planner.report.fleet import fleet_headline, suppressed_findings
from planner.report.text import by_weight, caveat_of, closing_line, finding_message, printable
from planner.service.fleet import check_fleet
from planner.service.fleet_timeline import fleet_timeline
from planner.tui.checked import FileWatch
from planner.tui.details import Summary, finding_details, left_open_text
from planner.tui.rows import MARKS
from planner.tui.widgets.bars import KeyBar, VerdictStrip
from planner.tui.widgets.canvas import Drawing
from planner.tui.widgets.fleet_plots import FleetPlot, fleet_ground, sign
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.panes import DetailsPane, PaneBar
from planner.tui.widgets.row_list import RowList, Table, TableColumn
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from textual.app import ComposeResult
    from textual.timer import Timer

    from planner.findings import Finding
    from planner.service.fleet import FleetResult
    from planner.service.fleet_timeline import FleetTimeline, Track

PANES = {"timeline": "Timeline", "map": "Map", "vehicles": "Vehicles", "found": "Findings"}
"""Panes by id, in the order of their digits."""
WATCH_S = 2.0
"""How often the files are looked at. [s]"""
_STEPS = 100
"""Of the operation, by an arrow."""
_PLAYED_S = 60.0
"""How long the whole operation takes to be played; no slower than it is. [s]"""
_FRAME_S = 0.1


class Found(Value):
    """A finding of a fleet, and when it happens."""

    finding: Finding
    sortie: str = ""
    """Of whose own check it is; empty: it is about the fleet."""
    at_s: float | None = None


def checked_fleet(file: str, given: Mapping[str, Any]) -> FleetResult:
    """Return the check of a fleet file, as the command line makes it.

    Raises FleetFileError, whose text holds every problem of the file.
    """
    from planner.fleet.reader import read_fleet

    return check_fleet(read_fleet(file, given=given))


def fleet_files(result: FleetResult) -> tuple[Path, ...]:
    """Return the files that decide what becomes of a fleet."""
    fleet = result.fleet
    named = [
        fleet.source,
        *(one.mission for one in fleet.jobs.values()),
        *(fleet.mission_of(one) for one in fleet.sorties.values()),
        *(one.setup.vehicle.source for one in fleet.vehicles.values()),
    ]
    return tuple(dict.fromkeys(map(Path, named)))


def fleet_summary(result: FleetResult) -> Summary:
    """Return the verdict and the figures of a fleet in words."""
    return Summary(
        verdict=result.verdict_text,
        is_go=result.verdict == "go",
        file=printable(result.file) + caveat_of(suppressed_findings(result)),
        headline=fleet_headline(result),
        return_plan="",
        closing=closing_line(result.all_findings, suppressed=suppressed_findings(result)),
        not_checked=left_open_text(result.checked),
    )


def found_in(result: FleetResult) -> tuple[Found, ...]:
    """Return what is found of a fleet, then the problems of its sorties; assumptions last."""
    own = [
        Found(finding=one.finding, at_s=one.at_s)
        for one in sorted(result.findings, key=lambda one: -one.finding.severity)
    ]
    of_sorties = [
        Found(finding=finding, sortie=one.name, at_s=one.start_s)
        for one in result.sorties
        for finding in by_weight(one.result.findings)[0]
    ]
    problems = [one for one in own if one.finding.severity > Severity.INFO]
    notes = [one for one in own if one.finding.severity is Severity.INFO]
    return (*problems, *of_sorties, *notes)


def found_table(found: Sequence[Found]) -> Table:
    """Return findings of a fleet as rows: mark, code, time and message."""

    def cells(one: Found) -> tuple[str, ...]:
        when = "" if one.at_s is None else quantity.clock(one.at_s)
        of = f"{one.sortie}: " if one.sortie else ""
        text = f"{of}{finding_message(one.finding)}"
        return MARKS[one.finding.severity], one.finding.code, when, text

    return Table(
        entries=found,
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="code", width=4, is_right=False),
            TableColumn(head="at", width=7),
            TableColumn(head="what was found", width=0, is_right=False),
        ),
        cells_of=cells,
        tone_of=lambda one: one.finding.severity.label,
    )


def vehicle_table(timeline: FleetTimeline, time_s: float) -> Table:
    """Return what each vehicle does at a time: sign, vehicle, sortie, what, height and energy."""

    def cells(entry: tuple[int, Track]) -> tuple[str, ...]:
        number, one = entry
        if one.is_flying(time_s):
            doing = f"item {one.item_at(time_s)}"
        elif time_s < one.start_s:
            doing = f"starts {quantity.clock(one.start_s)}"
        else:
            doing = f"ended {quantity.clock(one.end_s)}"
        return (
            sign(number),
            one.vehicle,
            one.sortie,
            doing,
            quantity.height(one.place_at(time_s)[2]),
            quantity.energy(one.used_at(time_s)),
        )

    return Table(
        entries=[*enumerate(timeline.vehicles_at(time_s))],
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="vehicle", width=12, is_right=False),
            TableColumn(head="sortie", width=12, is_right=False),
            TableColumn(head="now", width=14, is_right=False),
            TableColumn(head="above home", width=10),
            TableColumn(head="used", width=9),
        ),
        cells_of=cells,
        tone_of=lambda entry: "" if entry[1].is_flying(time_s) else "info",
    )


def moment_text(result: FleetResult, timeline: FleetTimeline, time_s: float) -> str:
    """Return a time, and what all together do then: ``5:00 · 2 in the air · 625 W · 35.3 Wh``."""
    flying = sum(one.is_flying(time_s) for one in timeline.vehicles_at(time_s))
    texts = [quantity.clock(time_s), f"{flying} in the air"]
    if result.totals.energy_wh is not None:
        power_w, used_wh = timeline.group_at(time_s)
        texts += [quantity.power(power_w), f"{quantity.energy(used_wh)} used"]
    near = [mark for mark in timeline.marks if abs(mark.at_s - time_s) <= 1.0]
    texts += [f"{mark.finding.code} {', '.join(mark.sorties)}" for mark in near]
    return " · ".join(texts)


class FleetScreen(Screen[None]):
    """A fleet file, checked, and moved in time."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012 - as textual has it
    VERTICAL_BREAKPOINTS = [(0, "-low"), (36, "-high")]  # noqa: RUF012 - as textual has it
    DEFAULT_CSS = """
    FleetScreen #moment { height: 1; padding: 0 1; background: $panel; text-style: bold; }
    FleetScreen #panes { height: 1fr; }
    FleetScreen .pane { height: 1fr; width: 1fr; }
    FleetScreen.-narrow .pane, FleetScreen.-low .pane { display: none; }
    FleetScreen.-narrow .pane.-current, FleetScreen.-low .pane.-current { display: block; }
    FleetScreen.-wide.-high #pane-bar { display: none; }
    FleetScreen.-wide.-high #panes {
        layout: grid; grid-size: 2 2; grid-columns: 1fr 1fr; grid-rows: 1fr 1fr;
    }
    FleetScreen.-wide.-high .pane {
        display: block; border: round $foreground 40%; border-title-color: $foreground; height: 100%;
    }
    FleetScreen #found-list { height: 1fr; }
    FleetScreen #found-details { height: 45%; border-top: solid $foreground 40%; }
    FleetScreen.-wide.-high .pane:focus, FleetScreen.-wide.-high .pane:focus-within {
        border: round $primary; border-title-style: bold;
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left,h", "step(-1)", "Earlier", priority=True),
        Binding("right,l", "step(1)", "Later", priority=True),
        Binding("shift+left,comma", "second(-1)", "A second earlier", show=False),
        Binding("shift+right,full_stop", "second(1)", "A second later", show=False),
        Binding("home", "to(0)", "Beginning", show=False),
        Binding("end", "to(1)", "End", show=False),
        Binding("space", "play", "Play"),
        Binding("n", "finding(1)", "Next finding"),
        Binding("p", "finding(-1)", "Previous finding", show=False),
        *(
            Binding(str(number), f"show_pane('{pane}')", name, show=False)
            for number, (pane, name) in enumerate(PANES.items(), start=1)
        ),
        Binding("r", "recheck", "Check again", show=False),
        Binding("m", "app.missions", "Missions", show=False),
        Binding("question_mark", "app.show_help", "Help"),
        Binding("escape", "app.missions", "Back"),
        Binding("q", "app.quit", "Quit", show=False),
    ]

    def __init__(
        self, file: str, given: Mapping[str, Any], result: FleetResult | None = None
    ) -> None:
        super().__init__()
        self.file = file
        self.result: FleetResult | None = None
        """As it was checked last."""
        self._known = result
        """As the list of missions has it: it is not checked again to be shown."""
        self.time_s = 0.0
        self._given = given
        self._timeline: FleetTimeline | None = None
        self._found: tuple[Found, ...] = ()
        self._watch = FileWatch()
        self._timer: Timer | None = None

    def compose(self) -> ComposeResult:
        """Yield the verdict, the moment, the panes and the keys."""
        yield VerdictStrip(f"Checking {self.file} …", id="verdict", markup=False)
        yield PaneBar(PANES, id="pane-bar")
        yield Static(id="moment")
        with Container(id="panes"):
            yield FleetPlot(id="timeline", classes="pane -current")
            yield GroundMap(id="map", classes="pane")
            yield RowList(_NO_ROWS, empty="Nothing is flown.", id="vehicles", classes="pane")
            with Vertical(id="found", classes="pane"):
                yield RowList(_NO_ROWS, empty="No problem found.", id="found-list")
                yield DetailsPane(id="found-details")
        yield KeyBar()

    def on_mount(self) -> None:
        """Ask for the check."""
        for pane, name in PANES.items():
            self.query_one(f"#{pane}").border_title = name
        self.query_one("#timeline").focus()
        self._watch.follow([Path(self.file)])
        self._check(self._known)
        self.set_interval(WATCH_S, self.watch_files)

    # Checks

    def action_recheck(self) -> None:
        """Check everything again, in the background."""
        self.query_one("#verdict", VerdictStrip).update(Content(f"Checking {self.file} …"))
        self._check(None)

    def watch_files(self) -> None:
        """Check again where a file that decides the verdict was written since."""
        if self._watch.changed():
            self.action_recheck()

    @work(thread=True, exclusive=True, group="check", description="check")
    def _check(self, known: FleetResult | None) -> None:
        try:
            result = known or checked_fleet(self.file, self._given)
            timeline = fleet_timeline(result)
        except FleetFileError as error:
            self.call_later(self._fail, "\n".join(error.problems))
        except (MavjouleError, ValueError) as error:
            self.call_later(self._fail, str(error))
        except Exception as error:  # noqa: BLE001 - in words: a check must not seem to go on
            self.call_later(self._fail, bug_text(error))
        else:
            self.call_later(self._take, result, timeline)

    def _fail(self, problem: str) -> None:
        """Show why there is no verdict; what was found before holds no longer."""
        self.result = self._timeline = None
        self._found = ()
        text = Content.styled("– NO VERDICT", "bold $text-warning")
        body = Content.assemble(text, Content(f"  {printable(self.file)}\n{problem}"))
        self.query_one("#verdict", VerdictStrip).update(body)
        self.query_one("#panes").display = False
        self.query_one("#moment", Static).update("")

    def _take(self, result: FleetResult, timeline: FleetTimeline) -> None:
        self.result, self._timeline, self._found = result, timeline, found_in(result)
        self._watch.follow(fleet_files(result))
        self.query_one("#panes").display = True
        self.query_one("#verdict", VerdictStrip).show(fleet_summary(result))
        self.query_one("#found-list", RowList).show(found_table(self._found))
        self._show_details()
        self.query_one(FleetPlot).show(timeline)
        self.query_one(GroundMap).show(fleet_ground(result, timeline))
        self.move_to(self.time_s)

    # Time

    def move_to(self, time_s: float) -> None:
        """Show another moment in every pane."""
        if self.result is None or self._timeline is None:
            return
        self.time_s = min(max(time_s, 0.0), self._timeline.end_s)
        for drawing in self.query(Drawing):
            drawing.point_at(self.time_s)
        self.query_one("#vehicles", RowList).show(vehicle_table(self._timeline, self.time_s))
        text = moment_text(self.result, self._timeline, self.time_s)
        self.query_one("#moment", Static).update(Content(text))

    def action_step(self, by: int) -> None:
        """Move by a hundredth of the operation."""
        if self._timeline is not None:
            self.move_to(self.time_s + by * self._timeline.end_s / _STEPS)

    def action_second(self, by: int) -> None:
        """Move by a second."""
        self.move_to(self.time_s + by)

    def action_to(self, fraction: int) -> None:
        """Move to the beginning or the end."""
        if self._timeline is not None:
            self.move_to(fraction * self._timeline.end_s)

    def action_finding(self, by: int) -> None:
        """Move to the next finding, or the one before."""
        if self._timeline is None:
            return
        times_s = sorted({mark.at_s for mark in self._timeline.marks})
        ahead = [one for one in times_s if (one - self.time_s) * by > 1e-6]
        if ahead:
            self.move_to(ahead[0] if by > 0 else ahead[-1])

    def action_play(self) -> None:
        """Let time run, or stop it."""
        if self._timer is not None:
            self._timer.stop()
            self._timer = None
        elif self._timeline is not None:
            if self.time_s >= self._timeline.end_s:
                self.move_to(0.0)
            self._timer = self.set_interval(_FRAME_S, self._play)

    def _play(self) -> None:
        if self._timeline is None or self.time_s >= self._timeline.end_s:
            self.action_play()
            return
        self.move_to(self.time_s + _FRAME_S * max(self._timeline.end_s / _PLAYED_S, 1.0))

    @on(Drawing.Moved)
    def _on_moved(self, event: Drawing.Moved) -> None:
        self.move_to(event.time_s)

    @on(RowList.Selected, "#found-list")
    def _show_details(self) -> None:
        at = self.query_one("#found-list", RowList).cursor
        if self.result is not None and at < len(self._found):
            details = finding_details(self._found[at].finding, file=self.result.file)
            self.query_one(DetailsPane).show(details)

    @on(RowList.Chosen, "#found-list")
    def _on_chosen(self, event: RowList.Chosen) -> None:
        at_s = self._found[event.index].at_s
        if at_s is not None:
            self.move_to(at_s)
            self.action_show_pane("timeline")

    # Panes

    def action_show_pane(self, pane: str) -> None:
        """Show a pane, where there is room for one, and go to it."""
        for one in self.query(".pane"):
            one.set_class(one.id == pane, "-current")
        self.query_one(PaneBar).show(pane)
        self.query_one("#found-list" if pane == "found" else f"#{pane}").focus()


_NO_ROWS = Table(entries=(), columns=(), cells_of=lambda _: ())
