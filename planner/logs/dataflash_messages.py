"""The messages of a DataFlash log as columns, whether it is binary or text."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Self

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.logs.record import BoolArray, FloatArray, IntArray

_ATTITUDE_ESTIMATE = ("TimeUS", "TimeMS", "C", "VN", "VE", "VD")
_WIND_ESTIMATE = ("TimeUS", "TimeMS", "C", "VWN", "VWE")
_BATTERY = ("TimeUS", "TimeMS", "Inst", "Instance", "Volt", "Curr")
_COMMAND = (
    *("TimeUS", "TimeMS", "CTot", "CNum", "CId", "Frame", "Lat", "Lng", "Alt"),
    *("Prm1", "Prm2", "Prm3", "Prm4"),
)

WANTED: Mapping[str, frozenset[str]] = {
    name: frozenset(fields)
    for name, fields in {
        "ARM": ("TimeUS", "ArmState"),
        "ARSP": ("TimeUS", "TimeMS", "I", "Airspeed"),
        "ATT": ("TimeUS", "TimeMS", "Roll", "Pitch", "Yaw"),
        "BAT": _BATTERY,
        "BAT2": _BATTERY,
        "CMD": _COMMAND,
        "CTUN": ("TimeUS", "TimeMS", "Alt", "DAlt", "CRt", "DCRt"),
        "CURR": _BATTERY,
        "CUR2": _BATTERY,
        "EKF1": _ATTITUDE_ESTIMATE,
        "EKF2": _WIND_ESTIMATE,
        "EV": ("TimeUS", "TimeMS", "Id"),
        "GPS": (
            *("TimeUS", "T", "TimeMS", "I", "Status", "Lat", "Lng", "Alt", "RelAlt"),
            *("Spd", "GCrs", "VZ"),
        ),
        "MISE": _COMMAND,
        "MODE": ("TimeUS", "TimeMS", "Mode", "ModeNum"),
        "MSG": ("TimeUS", "TimeMS", "Message"),
        "NKF1": _ATTITUDE_ESTIMATE,
        "NKF2": _WIND_ESTIMATE,
        "NTUN": (
            *("TimeUS", "TimeMS", "DPosX", "DPosY", "PosX", "PosY", "DVelX", "DVelY"),
            *("VelX", "VelY"),
        ),
        "ORGN": ("TimeUS", "TimeMS", "Type", "Lat", "Lng", "Alt"),
        "PARM": ("TimeUS", "TimeMS", "Name", "Value"),
        "POS": ("TimeUS", "TimeMS", "Lat", "Lng", "Alt", "RelHomeAlt", "RelAlt"),
        "PSC": ("TimeUS", "TPX", "TPY", "PX", "PY", "TVX", "TVY", "VX", "VY"),
        "PSCZ": ("TimeUS", "TPZ", "PZ", "DVZ", "TVZ", "VZ"),
        "PSCN": ("TimeUS", "TPN", "PN", "DVN", "VN"),
        "PSCE": ("TimeUS", "TPE", "PE", "DVE", "VE"),
        "PSCD": ("TimeUS", "TPD", "PD", "DVD", "VD"),
        "STAT": ("TimeUS", "Armed"),
        "XKF1": _ATTITUDE_ESTIMATE,
        "XKF2": _WIND_ESTIMATE,
    }.items()
}
"""The fields used, by message; all names any firmware has had."""


@frozen
class MessageFormat:
    """The definition of a message: its FMT."""

    name: str
    letters: str
    """A letter for the type of each field."""
    fields: tuple[str, ...]


@frozen(eq=False)
class MessageTable:
    """All messages of one name, as columns of the wanted fields."""

    message: MessageFormat
    places: IntArray
    """Byte or line of each in the log, rising."""
    numbers: Mapping[str, FloatArray]
    """In the unit the format letter gives: c and e are hundredths, L is degrees."""
    texts: Mapping[str, tuple[str, ...]]

    def letter(self, field: str) -> str:
        """Return the type of a field."""
        return self.message.letters[self.message.fields.index(field)]

    def rows(self, chosen: BoolArray) -> Self:
        """Return some of the messages."""
        return replace(
            self,
            places=self.places[chosen],
            numbers={field: values[chosen] for field, values in self.numbers.items()},
            texts={
                field: tuple(text for text, is_in in zip(texts, chosen, strict=True) if is_in)
                for field, texts in self.texts.items()
            },
        )

    def time_s(self) -> FloatArray | None:
        """Return the messages' own times since boot; ``None`` where they have none. [s]"""
        if "TimeUS" in self.numbers:
            return self.numbers["TimeUS"] * 1e-6
        if "T" in self.numbers:  # beside TimeMS of old GPS messages, which is the satellites' time
            return self.numbers["T"] * 1e-3
        if "TimeMS" in self.numbers and self.message.name != "GPS":
            return self.numbers["TimeMS"] * 1e-3
        return None


@frozen(eq=False)
class DataflashLog:
    """The wanted messages of a log."""

    tables: Mapping[str, MessageTable]
    size: int
    """Bytes or lines of the log."""
    unit: str
    """``bytes`` or ``lines``."""
    unreadable: int
    """How many of them are no messages."""
    first_unreadable: int | None
    """The first of them."""
    stopped_by: str = ""
    """Why nothing behind a place was read, where that is so."""

    def between(self, begin: int, end: int) -> Mapping[str, MessageTable]:
        """Return the messages from one place to before another, tables without any left out."""
        tables = {
            name: table.rows((table.places >= begin) & (table.places < end))
            for name, table in self.tables.items()
        }
        return {name: table for name, table in tables.items() if len(table.places)}


def message_format(name: str, letters: str, columns: str) -> MessageFormat:
    """Return the definition of a message from the texts of its FMT."""
    fields = tuple(field.strip() for field in columns.split(",")) if columns.strip() else ()
    return MessageFormat(name=name.strip(), letters=letters.strip(), fields=fields)
