"""What if: settings changed for a look, over those of the mission; and the command that says it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.cli.requests import check_request
from planner.cli.setting_text import command_text, option_arguments, setting_text
from planner.cli.settings import SETTINGS
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.service import CheckRequest

LABELS = {
    "wind": "Wind",
    "payload_kg": "Payload kg",
    "temperature_c": "Air °C",
    "battery": "Battery",
    "charge": "Charge",
    "reserve": "Reserve",
    "speed_m_s": "Speed m/s",
    "vehicle": "Vehicle",
    "params": "Parameters",
}
"""The settings that can be changed in place, by key, as they are labelled."""

_UNSET = {
    "wind": "none; 5@270",
    "payload_kg": "none",
    "temperature_c": "standard",
    "battery": "the model's; 5.2Ah@14.8V",
    "charge": "100%",
    "reserve": "20%",
    "speed_m_s": "the mission's",
    "vehicle": "the article's quadrotor",
    "params": "none; a file",
}
"""What holds where neither the mission's settings nor the user say."""

FIELDS = tuple(key for key in LABELS if key in SETTINGS)
"""The settings that can be changed, in the order they are shown."""


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
        """Return the settings by key, those changed as they are typed.

        Raises
        ------
        ValueError
            If a text does not say a value; one sentence with the label of its field.
        """
        values = dict(self.settings)
        for key, text in self.changes.items():
            try:
                values[key] = SETTINGS[key].read(text)
            except ValueError as error:
                msg = f"{LABELS[key]}: {error}"
                raise ValueError(msg) from error
        return values

    def problem(self, key: str) -> str:
        """Return what is wrong with the text of one field; empty where it says a value."""
        try:
            SETTINGS[key].read(self.changes.get(key) or "") if key in self.changes else None
        except ValueError as error:
            return str(error)
        return ""

    def request(self) -> CheckRequest:
        """Return what the mission is checked against.

        Raises
        ------
        ValueError
            If a text does not say a value.
        """
        return check_request(self.values())

    def hint(self, key: str) -> str:
        """Return what holds while a field is left blank."""
        if key not in self.settings:
            return _UNSET[key]
        try:
            return setting_text(key, self.settings[key])
        except ValueError:
            return "as set"

    def command_line(self, file: str) -> str:
        """Return the command that says the same of the same file, for the shell at hand."""
        words = ["mavjoule", "check", file]
        for key, value in self.given.items():
            if key not in self.changes:
                words += option_arguments(SETTINGS[key].option, key, value)
        for key, text in self.changes.items():
            words += [SETTINGS[key].option, text]
        return command_text(words)
