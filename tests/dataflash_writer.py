"""A writer of DataFlash logs, from the description of the format, for the tests of the reader."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import made_flight as made

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_HEADER = b"\xa3\x95"
_KINDS = {
    "b": "b", "B": "B", "M": "B", "h": "h", "H": "H", "c": "h", "C": "H", "i": "i", "I": "I",
    "e": "i", "E": "I", "L": "i", "f": "f", "d": "d", "q": "q", "Q": "Q", "n": "4s", "N": "16s",
    "Z": "64s",
}  # fmt: skip
_FACTORS = {"c": 100, "C": 100, "e": 100, "E": 100, "L": 10_000_000}


@dataclass(slots=True)
class DataflashWriter:
    """The messages of a log so far."""

    messages: list[bytes] = field(default_factory=list)
    _types: dict[str, tuple[int, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._format(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def define(self, name: str, letters: str, columns: str) -> None:
        """Write the definition of a message."""
        kind = 129 + len(self._types)
        self._types[name] = kind, letters
        self._format(kind, name, letters, columns)

    def add(self, name: str, *values: float | str) -> None:
        """Write a message, its values in whole units."""
        kind, letters = self._types[name]
        self.messages.append(_HEADER + bytes([kind]) + struct.pack(_layout(letters), *(
            value.encode() if isinstance(value, str)
            else value if letter in "fd"
            else round(value * _FACTORS.get(letter, 1))
            for letter, value in zip(letters, values, strict=True)
        )))  # fmt: skip

    def _format(self, kind: int, name: str, letters: str, columns: str) -> None:
        length = 3 + struct.calcsize(_layout(letters))
        body = (kind, length, name.encode(), letters.encode(), columns.encode())
        self.messages.append(_HEADER + bytes([128]) + struct.pack(_layout("BBnNZ"), *body))

    def content(self) -> bytes:
        """Return the log."""
        return b"".join(self.messages)


def _layout(letters: str) -> str:
    return "<" + "".join(_KINDS[letter] for letter in letters)


def copter_log(
    *,
    current_a: float | None = None,
    begins_s: float = made.BEGIN_S,
    gap_s: tuple[float, float] | None = None,
    boot_s: float = 0.0,
    writer: DataflashWriter | None = None,
    throttle: Callable[[made.Moment], float] = lambda _: 0.0,
    hover_throttles: Sequence[tuple[float, float]] = (),
) -> DataflashWriter:
    """Return the made flight as Copter 4 logs it by default.

    Parameters
    ----------
    current_a : float, optional
        What the current sensor always shows, instead of what flows.
    begins_s : float, optional
        Where the log begins.
    gap_s : tuple of float, optional
        From when to when nothing is logged.
    boot_s : float, optional
        Added to every time.
    writer : DataflashWriter, optional
        A log to go on with.
    throttle : function of a moment, optional
        What the motors are asked for.
    hover_throttles : sequence of tuples, optional
        When MOT_THST_HOVER is logged, and its value.
    """
    log = writer or _copter_definitions()
    begin_us = round((begins_s + boot_s) * 1e6)
    log.add("MSG", begin_us, "ArduCopter V4.6.1 (abcdef01)")
    log.add("MSG", begin_us, "Frame: QUAD/X")
    log.add("PARM", begin_us, "WPNAV_SPEED", 500.0)
    for number, command, north_deg in ((0, 16, 0.0), (1, 22, 0.0), (2, 16, 0.001), (3, 21, 0.0)):
        log.add(
            *("CMD", begin_us, 4, number, command, 0.0, 0.0, 0.0, 0.0),
            *(made.LATITUDE_DEG + north_deg, made.LONGITUDE_DEG, 20.0, 3),
        )
    log.add("MODE", begin_us, 3, 3, 1)
    for moment in made.moments():
        if moment.time_s < begins_s or (gap_s and gap_s[0] < moment.time_s < gap_s[1]):
            continue
        _add_moment(log, moment, current_a, boot_s)
        now = round((moment.time_s + boot_s) * 1e6)
        for at_s, value in hover_throttles:
            if moment.time_s <= at_s < moment.time_s + 0.0999:
                log.add("PARM", round((at_s + boot_s) * 1e6), "MOT_THST_HOVER", value)
        log.add("CTUN", now, throttle(moment), 0.39, moment.height_m)
    return log


def _copter_definitions() -> DataflashWriter:
    log = DataflashWriter()
    log.define("MSG", "QZ", "TimeUS,Message")
    log.define("PARM", "QNf", "TimeUS,Name,Value")
    log.define("CMD", "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame")
    log.define("MISE", "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame")
    log.define("MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn")
    log.define("ARM", "QBI", "TimeUS,ArmState,ArmChecks")
    log.define("EV", "QB", "TimeUS,Id")
    log.define("ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    log.define("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    log.define("XKF1", "QBccCfff", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD")
    log.define("XKF2", "QBcc", "TimeUS,C,VWN,VWE")
    log.define("ATT", "Qffffff", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw")
    log.define("PSCN", "Qfffff", "TimeUS,TPN,PN,DVN,TVN,VN")
    log.define("PSCE", "Qfffff", "TimeUS,TPE,PE,DVE,TVE,VE")
    log.define("PSCD", "Qfffff", "TimeUS,TPD,PD,DVD,TVD,VD")
    log.define("CTUN", "Qfff", "TimeUS,ThO,ThH,DAlt")
    log.define("BAT", "QBffff", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot")
    return log


def _add_moment(
    log: DataflashWriter, moment: made.Moment, current_a: float | None, boot_s: float
) -> None:
    now = round((moment.time_s + boot_s) * 1e6)
    north, height = moment.north_m, moment.height_m
    if moment.time_s == made.ARMED_S:
        log.add("ARM", now, 1, 0)
        log.add("ORGN", now, 1, made.LATITUDE_DEG, made.LONGITUDE_DEG, made.GROUND_AMSL_M)
    if moment.time_s == made.DISARMED_S:
        log.add("ARM", now, 0, 0)
    for at_s, item in ((10.0, 2), (40.0, 3)):
        if moment.time_s == at_s:
            log.add("MISE", now, 4, item, 16, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3)
    if moment.time_s in {made.TAKEOFF_S, made.LANDED_S}:
        log.add("EV", now, 28 if moment.time_s == made.TAKEOFF_S else 18)
    log.add(
        *("POS", now, moment.latitude_deg, made.LONGITUDE_DEG),
        *(made.GROUND_AMSL_M + height, height, height),
    )
    for core in (0, 1):  # the second core tells something else
        log.add("XKF1", now, core, 0.0, 0.0, 0.0, moment.speed_m_s + core, core, -moment.climb_m_s)
        log.add("XKF2", now, core, 0.0, 0.0)
    log.add("ATT", now, 0.0, 1.0, 0.0, -4.0, 0.0, 359.0 if moment.time_s % 0.2 < 0.05 else 1.0)
    # The estimator's origin lies 3 m south, 4 m west of home and 2 m below it.
    log.add("PSCN", now, north + 3.5, north + 3.0, moment.speed_m_s, 9.0, moment.speed_m_s)
    log.add("PSCE", now, 4.5, 4.0, 0.0, 9.0, 0.0)
    log.add("PSCD", now, -height - 2.25, -height - 2.0, -moment.climb_m_s, 9.0, -moment.climb_m_s)
    shown_a = moment.current_a if current_a is None else current_a
    log.add("BAT", now, 0, made.VOLTAGE_V, made.VOLTAGE_V, shown_a, 0.0)
    log.add("BAT", now, 1, 12.0, 12.0, 0.0, 0.0)
