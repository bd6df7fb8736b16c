"""The panes of one flight, each following what is selected in another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from textual import on
from textual.containers import Container, VerticalScroll
from textual.content import Content
from textual.widgets import Static

from planner.report.text import left_unchecked
from planner.service.preflight import CheckResult, UnreadableMission
from planner.tui import details
from planner.tui.rows import finding_table, item_table, segment_table
from planner.tui.widgets.canvas import Drawing
from planner.tui.widgets.ground_map import GroundMap
from planner.tui.widgets.profile_plot import (
    ProfilePlot,
    item_at,
    item_span_s,
    segment_at,
    segment_span_s,
)
from planner.tui.widgets.row_list import RowList, Table
from planner.tui.widgets.what_if_form import WhatIfForm

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.app import ComposeResult

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.rules.ledger import LedgerEntry
    from planner.tui.checked import Checked
    from planner.tui.details import Details
    from planner.tui.screens.search import Hit


PANES = {
    "findings": "Findings",
    "plot": "Profile",
    "map": "Map",
    "segments": "Segments",
    "items": "Items",
    "what-if": "What if",
}
"""Panes by id, in the order of their digits."""


class PaneBar(Static):
    """One line; a click shows the pane, and so does its digit."""

    DEFAULT_CSS = """
    PaneBar {
        height: 1;
        background: $panel;
        padding: 0 1;
        link-style: none;
        link-color: $foreground;
    }
    """

    def __init__(self, panes: Mapping[str, str], **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options)
        self._panes = panes
        self._current = next(iter(panes))

    def show(self, current: str) -> None:
        """Show the names of the panes, and which one is shown."""
        self._current = current
        names = [f"{number} {name}" for number, name in enumerate(self._panes.values(), start=1)]
        widths = [len(name) + 2 for name in names]  # a blank before and after, where there is room
        gap = " " if sum(widths) <= self.content_size.width else ""
        parts = []
        for pane, name in zip(self._panes, names, strict=True):
            part = Content.from_markup(f"[@click=screen.show_pane('{pane}')]{gap}{name} [/]")
            parts.append(part.stylize("bold reverse") if pane == current else part)
        self.update(Content("").join(parts))

    def on_resize(self) -> None:
        """Show the names in the room there is."""
        self.show(self._current)


_STYLES = {"error": "bold $text-error", "warning": "bold $text-warning"}


class DetailsPane(VerticalScroll):
    """A heading and labelled paragraphs; scrolls."""

    DEFAULT_CSS = """
    DetailsPane {
        background: $surface;
        scrollbar-size-vertical: 1;
        & > Static { width: 1fr; min-height: 100%; padding: 0 1; }
    }
    """
    can_focus: ClassVar[bool] = True  # type: ignore[misc] # scrolled by keys

    details: Details | None = None

    def compose(self) -> ComposeResult:
        """Yield the text."""
        yield Static(id="details-text")

    def show(self, details: Details) -> None:
        """Show the details of another thing."""
        if details == self.details:
            return
        self.details = details
        lines = [Content.styled(details.title, _STYLES.get(details.tone, "bold"))]
        for label, text in details.parts:
            head = Content.styled(f"{label}  ", "bold") if label else Content("")
            lines.append(Content.assemble(head, Content(text)))
        content, body = Content("\n").join(lines), self.query_one("#details-text", Static)
        # Every widget of the screen is laid out again only where the text needs other room.
        width, room = body.content_size.width, self.container_size.height
        fits = width > 0 and body.size.height == max(content.get_height({}, width), room)
        body.update(content, layout=not fits)
        self.scroll_home(animate=False)


_UNCHECKED = "Not checked yet."
_NOTHING = UnreadableMission(file="", findings=())
"""What is shown until the first check is done."""


class Panes(Container):
    """Findings, profile, map, tables, what if and details: one at a time, or all at once."""

    current = "findings"
    """The pane that is shown where there is room for one."""
    _shown: Checked | None = None
    _urgent: tuple[Finding, ...] = ()

    def compose(self) -> ComposeResult:
        """Yield the panes; what the form holds follows when the first check is done."""
        yield RowList(finding_table(()), empty=_UNCHECKED, id="findings", classes="pane -current")
        yield ProfilePlot(id="plot", classes="pane")
        yield WhatIfForm(id="what-if", classes="pane")
        yield DetailsPane(id="details", classes="pane -current")
        yield GroundMap(id="map", classes="pane")
        yield RowList(segment_table(_NOTHING), empty=_UNCHECKED, id="segments", classes="pane")
        yield RowList(item_table(_NOTHING), empty=_UNCHECKED, id="items", classes="pane")

    def on_mount(self) -> None:
        """Name the panes."""
        for number, (pane, name) in enumerate(PANES.items(), start=1):
            self.query_one(f"#{pane}").border_title = f"{number} {name}"
        self.query_one("#details").border_title = "Details"

    def show_pane(self, pane: str) -> None:
        """Show a pane where there is room for one, and go to it."""
        self.current = pane
        for name in PANES:
            self.query_one(f"#{name}").set_class(name == pane, "-current")
        with_details = pane in {"findings", "segments", "items"}
        self.query_one("#details").set_class(with_details, "-current")
        self.query_one("#details").set_class(pane != "findings", "-small")
        if pane == "what-if":
            self.call_after_refresh(self.query_one(WhatIfForm).focus_first)
        else:
            self.call_after_refresh(self.query_one(f"#{pane}").focus)

    def show(self, now: Checked) -> None:
        """Show a flight in every pane."""
        is_first, self._shown = self._shown is None, now
        result = now.result
        findings = self.query_one("#findings", RowList)
        findings.show(self._finding_rows(), empty="No problem found.")
        segments = self.query_one("#segments", RowList)
        segments.show(segment_table(result), empty="Nothing is flown.")
        self.query_one("#items", RowList).show(item_table(result), empty="No items.")
        self.query_one(ProfilePlot).show(now.pictures)
        self.query_one(GroundMap).show(now.ground)
        if is_first or self.screen.focused is findings:
            if self._findings:
                self._select_row(findings.cursor)
            else:
                self.show_flight()

    def show_urgent(self, urgent: tuple[Finding, ...]) -> None:
        """Show findings of this moment before those of the check; the same one stays selected."""
        if urgent == self._urgent:
            return
        rows = self.query_one("#findings", RowList)
        moved, self._urgent = len(urgent) - len(self._urgent), urgent
        rows.show(self._finding_rows())
        rows.select(rows.cursor + moved)

    def show_flight(self) -> None:
        """Show the figures of the whole flight."""
        if self._shown is not None:
            self.query_one(DetailsPane).show(details.flight_details(self._shown.result))

    def find(self, text: str) -> tuple[Hit, ...]:
        """Return what a text finds among findings and items."""
        from planner.tui.screens.search import hits

        return () if self._shown is None else hits(self._shown.result, self._findings, text)

    def go_to(self, hit: Hit) -> str:
        """Put every pane on what was found; return the pane that is shown then.

        Profile and map stay where they are in use: they show where it is.
        """
        stays = self.current in {"plot", "map"}
        pane = "items" if hit.finding is None else "findings"
        row = (hit.item or 1) - 1 if hit.finding is None else hit.finding
        rows = self.query_one(f"#{pane}", RowList)
        rows.select(row)
        self.show_pane(self.current if stays else pane)
        rows.post_message(RowList.Selected(rows, row))
        return self.current

    # The thing in question: a moment, a segment, an item, a finding

    @property
    def _case(self) -> Assessment | None:
        return None if self._shown is None else self._shown.assessment

    @property
    def _result(self) -> CheckResult | None:
        """What is flown; ``None`` where nothing is."""
        result = None if self._shown is None else self._shown.result
        return result if isinstance(result, CheckResult) and result.assessment is not None else None

    @property
    def _findings(self) -> tuple[Finding, ...]:
        return (*self._urgent, *(() if self._shown is None else self._shown.result.findings))

    @property
    def _left_open(self) -> tuple[LedgerEntry, ...]:
        """The rules that were not checked, which follow the findings."""
        return () if self._shown is None else left_unchecked(self._shown.result.checked)

    def _finding_rows(self) -> Table:
        return finding_table(self._findings, self._left_open)

    def _select_row(self, index: int) -> None:
        """Put every pane on a finding, or show a rule that was not checked."""
        behind = index - len(self._findings)
        if behind < 0:
            self.select_finding(self._findings[index])
        elif behind < len(self._left_open):
            entry = self._left_open[behind]
            self.query_one(DetailsPane).show(details.left_open_details(entry))

    @on(RowList.Selected, "#findings")
    def _on_finding(self, event: RowList.Selected) -> None:
        self._select_row(event.index)

    @on(RowList.Chosen, "#findings")
    def _look_at_finding(self) -> None:
        self.query_one("#details").focus()

    def select_finding(self, finding: Finding) -> None:
        """Put every pane on a finding."""
        file = "" if self._shown is None else self._shown.file
        self.query_one(DetailsPane).show(details.finding_details(finding, file=file))
        assessment = self._case
        span_s = None
        if assessment is not None and finding.item is not None:
            span_s = item_span_s(assessment, finding.item)
            ground = None if self._shown is None else self._shown.ground
            if span_s is not None and finding.stretch is not None and ground is not None:
                span_s = ground.stretch_span_s(finding.stretch, span_s)
            if span_s is not None:
                self._point_at(span_s[0], but="findings")
            self.query_one("#items", RowList).select(finding.item - 1)
        self.query_one(ProfilePlot).mark(span_s)
        stretch = finding.stretch
        self.query_one(GroundMap).mark(stretch, span_s if stretch is None else None)

    @on(RowList.Selected, "#segments")
    def _on_segment(self, event: RowList.Selected) -> None:
        assessment, result = self._case, self._result
        if assessment is not None and result is not None:
            self.query_one(DetailsPane).show(details.segment_details(result, event.index))
            self._mark(segment_span_s(assessment, event.index), but="segments")

    @on(RowList.Selected, "#items")
    def _on_item(self, event: RowList.Selected) -> None:
        assessment, result = self._case, self._result
        if assessment is None or result is None:
            return
        self.query_one(DetailsPane).show(details.item_details(result, event.index + 1))
        span_s = item_span_s(assessment, event.index + 1)
        if span_s is not None:
            self._mark(span_s, but="items")

    @on(Drawing.Moved)
    def _on_moment(self, event: Drawing.Moved) -> None:
        assessment, result = self._case, self._result
        if assessment is not None and result is not None:
            self._point_at(event.time_s)
            segment = segment_at(assessment, event.time_s)
            self.query_one(DetailsPane).show(details.segment_details(result, segment))

    def _mark(self, span_s: tuple[float, float], *, but: str) -> None:
        self._point_at(span_s[0], but=but)
        self.query_one(ProfilePlot).mark(span_s)
        self.query_one(GroundMap).mark(None, span_s)

    def _point_at(self, time_s: float, *, but: str = "") -> None:
        """Put every pane but one on a moment."""
        assessment = self._case
        if assessment is None:
            return
        self.query_one(ProfilePlot).point_at(time_s)
        self.query_one(GroundMap).point_at(time_s)
        if but != "segments":
            self.query_one("#segments", RowList).select(segment_at(assessment, time_s))
        if but not in {"items", "findings"}:
            self.query_one("#items", RowList).select(item_at(assessment, time_s) - 1)
