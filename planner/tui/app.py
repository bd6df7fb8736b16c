"""The application, and its themes: light, dark and high contrast."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from textual.app import App, SystemCommand
from textual.binding import Binding, BindingType
from textual.theme import Theme

from planner.errors import ExitCode
from planner.tui.plain import AsciiFilter
from planner.tui.screens.fleet import FleetScreen
from planner.tui.screens.missions import FLEET_SUFFIX, MissionsScreen
from planner.tui.screens.review import ReviewScreen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from textual.filter import LineFilter
    from textual.screen import Screen

    from planner.link.vehicle import LinkRequest
    from planner.tui.screens.live import LiveScreen
    from planner.tui.what_if import WhatIf


HIGH_CONTRAST = Theme(
    name="mavjoule-high-contrast",
    primary="#00ffff",
    secondary="#ffffff",
    accent="#ffff00",
    warning="#ffff00",
    error="#ff9a9a",
    success="#00ff00",
    foreground="#ffffff",
    background="#000000",
    surface="#000000",
    panel="#202020",
    boost="#303030",
    dark=True,
    text_alpha=1.0,
    variables={
        "block-cursor-background": "#ffff00",
        "block-cursor-foreground": "#000000",
        "footer-key-foreground": "#ffff00",
        "text-muted": "#ffffff",
        "text-error": "#ff9a9a",
        "text-warning": "#ffff00",
        "text-success": "#00ff00",
    },
)
LIGHT = Theme(
    name="mavjoule-light",
    primary="#004578",
    secondary="#0178d4",
    accent="#8f4700",
    warning="#8f4700",
    error="#b0002e",
    success="#1c6b34",
    foreground="#181818",
    background="#e8e8e8",
    surface="#f4f4f4",
    panel="#dcdcdc",
    boost="#e4e4e4",
    dark=False,
    variables={"text-muted": "#484848"},
)
DARK = "textual-dark"
THEMES = (DARK, LIGHT.name, HIGH_CONTRAST.name)
"""The themes a key turns through; the palette offers all that Textual has."""


class ReviewApp(App[None]):
    """Reviews missions, folders of them, a fleet, or the vehicle on a link; ``what_if_of`` has settings."""

    TITLE = "mavjoule review"
    CSS = """
    Input > .input--placeholder { color: $text-muted; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("t", "turn_theme", "Theme", show=False)]

    def __init__(
        self,
        missions: Sequence[str],
        what_if_of: Callable[[str], WhatIf],
        *,
        link: LinkRequest | None = None,
        is_ascii: bool = False,
    ) -> None:
        super().__init__()
        self._plain = AsciiFilter(enabled=is_ascii)
        self.register_theme(LIGHT)
        self.register_theme(HIGH_CONTRAST)
        self.missions = tuple(missions)
        self.what_if_of = what_if_of
        self.link = link
        self.live: LiveScreen | None = None
        """The review of the vehicle."""

    async def run_async(self, **options: Any) -> None:  # noqa: ANN401 - of App
        """Run until it is left; a signal to end leaves it as its key does."""
        loop = asyncio.get_running_loop()
        for name in ("SIGTERM", "SIGHUP"):
            # Whoever ignores one wants it so; not everything that runs an application takes signals.
            with suppress(AttributeError, NotImplementedError, RuntimeError, ValueError):
                number = getattr(signal, name)
                if signal.getsignal(number) is not signal.SIG_IGN:
                    loop.add_signal_handler(number, self.exit, None, ExitCode.INTERRUPTED)
        await super().run_async(**options)

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return what is done to lines before they are shown."""
        return [*super().get_line_filters(), *([self._plain] if self._plain.enabled else [])]

    def get_default_screen(self) -> Screen[None]:
        """Return the mission, the list of them, the fleet, or the vehicle."""
        [first, *others] = self.missions
        if self.link is not None:
            from planner.tui.screens.live import LiveScreen

            self.live = LiveScreen(self.link, self.what_if_of)
            return self.live
        if not others and Path(first).suffix.lower() == FLEET_SUFFIX:
            return FleetScreen(first, self.what_if_of(first).given)
        if others or Path(first).is_dir():
            return MissionsScreen(self.missions, self.what_if_of)
        return ReviewScreen(first, self.what_if_of)

    def action_missions(self) -> None:
        """Go from a review to the list of missions, of its folder where none was given."""
        review = self.screen
        if not isinstance(review, ReviewScreen | FleetScreen):
            return
        if len(self.screen_stack) > 1:
            self.pop_screen()
        else:
            folder = str(Path(review.file).parent)
            self.push_screen(MissionsScreen((folder,), self.what_if_of))

    def action_turn_theme(self) -> None:
        """Take the next of the themes."""
        at = THEMES.index(self.theme) if self.theme in THEMES else -1
        self.theme = THEMES[(at + 1) % len(THEMES)]

    def action_show_help(self) -> None:
        """Show the help of what is in use."""
        from planner.tui.screens.help import HelpScreen

        self.push_screen(HelpScreen(self.screen))

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """Return what the palette offers: Textual's own, and the screen's keys by their names."""
        yield from super().get_system_commands(screen)
        for active in screen.active_bindings.values():
            one = active.binding
            if active.node is screen and one.description:
                run = partial(self.call_later, screen.run_action, one.action)
                yield SystemCommand(one.description, f"key {one.key}", run)
