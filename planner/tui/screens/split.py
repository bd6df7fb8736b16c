"""A mission as flights that fit: shown, and saved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from planner import quantity
from planner.errors import MavjouleError
from planner.report.split import flown_text
from planner.report.text import headline, printable, said
from planner.tui.rows import MARKS
from planner.tui.saving import parts_folder, save_parts

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from planner.service.split import Split
    from planner.tui.checked import Checked


class SplitScreen(ModalScreen[None]):
    """The flights of a split, and the field for the folder they are saved in."""

    DEFAULT_CSS = """
    SplitScreen { align: center middle; background: $background 60%; }
    SplitScreen > Vertical {
        width: 96%; max-width: 120; height: 96%; max-height: 30; padding: 0 1;
        background: $panel; border: round $primary;
    }
    SplitScreen VerticalScroll { height: 1fr; }
    SplitScreen #problem { color: $text-warning; height: auto; max-height: 2; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "dismiss", "Back")]

    def __init__(self, split: Split, checked: Checked) -> None:
        super().__init__()
        self._split = split
        self._checked = checked
        self._asked = ""
        """The folder with parts in it that the user was warned of."""

    def compose(self) -> ComposeResult:
        """Yield the flights and the field."""
        with Vertical():
            with VerticalScroll():
                yield Static(_shown(self._split), id="parts")
            yield Static("Save the parts in this folder (Enter: save, Escape: back)")
            yield Input(parts_folder(self._checked), id="folder")
            yield Static(id="problem")

    def on_mount(self) -> None:
        """Put the keyboard into the field."""
        self.query_one("#folder").focus()

    @on(Input.Submitted)
    def _save(self, event: Input.Submitted) -> None:
        folder = Path(event.value.strip()).expanduser()
        if any(folder.glob("part-*.plan")) and event.value != self._asked:
            self._asked = event.value
            message = f"{folder} already holds parts: press Enter again to overwrite them"
            self.query_one("#problem", Static).update(Content(message))
            return
        try:
            done = save_parts(self._split, folder, replace=event.value == self._asked)
        except MavjouleError as error:
            self.query_one("#problem", Static).update(Content(str(error)))
        else:
            self.app.notify(f"Saved {done}", markup=False)
            self.dismiss()


def _shown(split: Split) -> Content:
    """Return the flights, and what is other than in the mission."""
    flights = quantity.count(len(split.parts), "flight")
    whole = quantity.energy(split.whole.totals.energy_wh)
    lines = [Content.styled(f"{flights} instead of one of {whole}", "bold")]
    for part in split.parts:
        name = printable(Path(part.file).name)
        verdict = part.result.verdict.upper()
        lines.append(Content(f"✔ {verdict}  {name}  {flown_text(part)}"))
        lines.append(Content(f"      {headline(part.result)}"))
    lines += [Content(f"{MARKS[one.severity]} {one.code} {said(one)}") for one in split.findings]
    return Content("\n").join(lines)
