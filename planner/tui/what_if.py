"""What if: settings changed for a look, over those of the mission; and the command that says it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cli.options import command_text, option_words
from planner.mission.files import WRITTEN_SUFFIXES
from planner.setup import SETTINGS_FILE, Setup, settings
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.setting import Setting


def form_settings() -> tuple[Setting, ...]:
    """Return the settings that can be changed in place, those about the day before those of files."""
    labelled = [setting for setting in settings().values() if setting.label]
    return tuple(sorted(labelled, key=lambda setting: setting.kind.is_file))


class WhatIf(Value):
    """The settings of one mission, and what is changed for a look."""

    settings: Mapping[str, Any]
    """By key, from the command line and the configuration."""
    given: Mapping[str, Any]
    """Those of them that the command line gave."""
    changes: Mapping[str, str]
    """By key, as typed; blank where nothing is changed."""

    def changed(self, key: str, text: str) -> WhatIf:
        """Return the settings with one changed; blank text takes the change back."""
        return self.with_changes({**self.changes, key: text})

    def with_changes(self, changes: Mapping[str, str]) -> WhatIf:
        """Return the settings with these changes and no others."""
        kept = {key: text.strip() for key, text in changes.items() if text.strip()}
        return WhatIf(settings=self.settings, given=self.given, changes=kept)

    def values(self) -> dict[str, Any]:
        """Return the settings by key; a changed one that is no value raises ``ValueError``."""
        values = dict(self.settings)
        for key, text in self.changes.items():
            setting = settings()[key]
            try:
                values[key] = setting.kind.read(text)
            except ValueError as error:
                msg = f"{setting.label}: {error}"
                raise ValueError(msg) from error
        if (file := values.get(SETTINGS_FILE)) is not None:
            values[SETTINGS_FILE] = file.without(self.changes)
        return values

    def problem(self, key: str) -> str:
        """Return what is wrong with the text of one field; empty where it says a value."""
        if key in self.changes:
            try:
                settings()[key].kind.read(self.changes[key])
            except ValueError as error:
                return str(error)
        return ""

    def setup(self) -> Setup:
        """Return what the mission is checked under; a file it names may be unusable."""
        return Setup.of(self.values())

    def hint(self, setting: Setting, reported: Mapping[str, str]) -> str:
        """Return what holds while a field is left blank: what is set, or reported by a vehicle, by key."""
        if setting.key not in self.settings:
            return reported.get(setting.key) or setting.example or setting.unset
        try:
            return setting.kind.text(self.settings[setting.key])
        except ValueError:
            return "as set"

    def file_commands(self, file: str) -> str:
        """Return the commands that say the same of a mission file, a line each.

        A speed that is tried is that of a mission which is saved first: the file flies its own.
        """
        speed = self.changes.get("speed_m_s")
        if speed is None:
            return self.command_line(file)
        there = Path(file)
        suffix = there.suffix if there.suffix.lower() in WRITTEN_SUFFIXES else ".plan"
        saved = str(there.with_name(f"{there.stem}-{speed}-m-s{suffix}"))
        as_saved = WhatIf(
            settings=self.settings,
            given={key: value for key, value in self.given.items() if key != "speed_m_s"},
            changes={key: text for key, text in self.changes.items() if key != "speed_m_s"},
        )
        convert = command_text(["mavjoule", "convert", file, saved, "--speed", speed])
        return f"{convert}\n{as_saved.command_line(saved)}"

    def command_line(self, file: str) -> str:
        """Return the command that says the same of the same file, for the shell at hand."""
        words = ["mavjoule", "check", file]
        for key, value in self.given.items():
            if key not in self.changes:
                words += option_words(key, value)
        for key, text in self.changes.items():
            words += [settings()[key].option, text]
        return command_text(words)
