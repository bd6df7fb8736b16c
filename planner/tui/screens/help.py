"""The help of what is in use: what it shows, and its keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Static

from planner.report.text import table_lines

if TYPE_CHECKING:
    from collections.abc import Iterator

    from textual.app import ComposeResult
    from textual.screen import Screen

_TEXTS = {
    "findings": (
        "Findings",
        (
            "What is wrong, what to look at, what was assumed (✖ ▲ ·), worst first; then the rules that "
            "could not be checked (–) and what they need. Profile and map go to the place of the selected "
            "one; Enter goes to its explanation."
        ),
    ),
    "details": (
        "Details",
        "What is selected in words: for a finding what to do, why it matters and how it is computed.",
    ),
    "plot": (
        "Profile",
        (
            "One quantity over the time of the flight: altitude, speed, power, energy with the way home, "
            "charge. All panes follow the cursor; ▔ marks what is selected."
        ),
    ),
    "map": (
        "Map",
        (
            "The flight from above, north up: H home, R rally points, ◆ the cursor, ○ the ends of what "
            "is selected, ✖ inside areas to keep out of."
        ),
    ),
    "segments": (
        "Segments",
        "The flight cut into states, a row each: when it begins, how long and far it is, what it takes.",
    ),
    "items": (
        "Items",
        (
            "The mission's items with the time they are reached and the energy used by then; the sign is "
            "that of the worst finding."
        ),
    ),
    "what-if": (
        "What if",
        (
            "Settings to change for a look; blank keeps what the mission is checked with. Below: what a "
            "change makes of the flight, and changes worth a try, each tried already (✔ GO). Files stay as "
            "they are; y gives the command that says the same."
        ),
    ),
    "checklist": (
        "Checklist",
        (
            "Manual items to tick off, what the check was given, and each family of rules: ✔ looked at and "
            "passed, ✖ failed, ▲ to look at, – not checked. A go is released with a name, anything else "
            "is refused with one; mavjoule verify-signoff tells later what has changed."
        ),
    ),
    "missions": (
        "Missions",
        (
            "Missions, fleets and folders with their verdicts, checked again as files change. Enter opens "
            "one."
        ),
    ),
    "timeline": (
        "Timeline",
        "Vehicles, packs, chargers and pads over time, a line each; ✖ where something was found.",
    ),
    "vehicles": ("Vehicles", "Where each vehicle is at the moment of the cursor."),
}
"""Name and text of what may be in use, by the id of its widget."""
_OTHER = ("This screen", "")


class HelpScreen(ModalScreen[None]):
    """A page of help over another screen."""

    DEFAULT_CSS = """
    HelpScreen { align: center middle; background: $background 60%; }
    HelpScreen > VerticalScroll {
        width: 90%; max-width: 84; height: auto; max-height: 90%; padding: 0 2;
        background: $panel; border: round $primary; scrollbar-size-vertical: 1;
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,question_mark,q,enter", "dismiss", "Back")
    ]

    def __init__(self, of: Screen[object]) -> None:
        super().__init__()
        self._title, text = help_of(of)
        parts = [Content(text), *_key_parts(of, self._title)]
        self._content = Content("\n\n").join(part for part in parts if part)

    def compose(self) -> ComposeResult:
        """Yield the page."""
        with VerticalScroll() as page:
            page.border_title = f"Help: {self._title}"
            page.border_subtitle = "Esc: back"
            yield Static(self._content, id="help")

    def on_mount(self) -> None:
        """Let the keys scroll it."""
        self.query_one(VerticalScroll).focus()


def help_of(screen: Screen[object]) -> tuple[str, str]:
    """Return name and text of what is in use on a screen."""
    used = screen.focused
    chain = [] if used is None else [used, *used.ancestors]
    return next((_TEXTS[one.id] for one in chain if one.id in _TEXTS), _OTHER)


def _declared_actions(node: object) -> set[str]:
    """Return the actions of keys that a screen or widget declares beyond Textual's own."""
    own = (one for one in type(node).__mro__ if one.__module__.startswith("planner."))
    bindings = (binding for one in own for binding in vars(one).get("BINDINGS", ()))
    return {binding.action for binding in bindings}


def _key_parts(screen: Screen[object], name: str) -> Iterator[Content]:
    """Yield the keys of what is in use, then those of the screen, each with a heading."""
    own: dict[str, tuple[list[str], str]] = {}
    others: dict[str, tuple[list[str], str]] = {}
    for active in screen.active_bindings.values():
        binding, node = active.binding, active.node
        if not binding.description or binding.action not in _declared_actions(node):
            continue  # those of text fields and scrollbars are as everywhere
        keys = others if node in (screen, screen.app) else own
        entry = keys.setdefault(binding.action, ([], binding.description))
        entry[0].append(screen.app.get_key_display(binding).replace("⏎", "enter"))
    for title, keys in ((f"Keys of {name}", own), ("Everywhere", others)):
        if keys:
            rows = [(" ".join(dict.fromkeys(shown)), text) for shown, text in keys.values()]
            lines = table_lines(rows, alignment="<<")
            yield Content("\n").join([Content.styled(title, "bold"), *map(Content, lines)])
