"""The parameters of a simulated vehicle: of each autopilot those that missions depend on."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.values import Value, replace
from planner.vehicle.parameters.resolve import PARAMETERS_OF
from planner.vehicle.parameters.table import SI_PER_UNIT, parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.table import Parameter, Version


INT16, INT32, REAL32 = 4, 6, 9
"""MAV_PARAM_TYPE."""
_MAH_PER_AH = 1000.0
_PX4_ARMING: Mapping[str, float] = {
    "COM_ARM_AUTH_REQ": 0,
    "COM_ARM_AUTH_ID": 10,
    "COM_ARM_AUTH_MET": 0,
    "COM_ARM_AUTH_TO": 1.0,
}
"""Whether arming is asked for, of whom, how, and how long it waits for the answer. [s]"""
_WHOLE_EXTRAS: Mapping[Autopilot, Mapping[str, float]] = {
    Autopilot.PX4: {"MAV_SYS_ID": 1, "SYS_AUTOSTART": 4001},
    Autopilot.ARDUPILOT: {"SYSID_THISMAV": 1, "FRAME_CLASS": 1, "FRAME_TYPE": 1},
}
_SYSTEM_ID = {Autopilot.PX4: "MAV_SYS_ID", Autopilot.ARDUPILOT: "SYSID_THISMAV"}


class VehicleParameter(Value):
    """One parameter, in the unit of its autopilot."""

    name: str
    value: float
    kind: int = REAL32
    """MAV_PARAM_TYPE."""

    def sent_value(self, autopilot: Autopilot) -> float:
        """Return the value as PARAM_VALUE has it: PX4 sends whole numbers byte for byte."""
        if autopilot is Autopilot.PX4 and self.kind == INT32:
            content = struct.pack("<i", int(self.value))
            return float(struct.unpack("<f", content)[0])
        return self.value


def make_parameters(
    autopilot: Autopilot,
    version: Version,
    *,
    given: Mapping[str, float] | None = None,
    battery: Battery | None = None,
    system: int = 1,
    authoriser: int | None = None,
) -> tuple[VehicleParameter, ...]:
    """Return an autopilot's parameters, sorted by name.

    Parameters
    ----------
    autopilot : Autopilot
        PX4 or ArduPilot.
    version : tuple of int
        Major and minor version of the firmware, by which names and units differ.
    given : mapping of str to float, optional
        Values that are not the defaults, and parameters beyond those of missions.
    battery : Battery, optional
        Whose capacity and cells it is told.
    system : int
        MAVLink's system id.
    authoriser : int, optional
        System id of who is asked before it arms; default nobody (PX4 alone).
    """
    rows = parameter_table(PARAMETERS_OF[autopilot]).values()
    found = {
        one.name: one for one in (_default(row, version, whole=_whole(autopilot)) for row in rows)
    }
    for name, value in _WHOLE_EXTRAS[autopilot].items():
        found[name] = VehicleParameter(name=name, value=value, kind=_whole(autopilot))
    if autopilot is Autopilot.PX4:
        for name, value in _PX4_ARMING.items():
            kind = INT32 if isinstance(value, int) else REAL32
            found[name] = VehicleParameter(name=name, value=value, kind=kind)
    values: dict[str, float] = {
        _SYSTEM_ID[autopilot]: system,
        **_battery_values(autopilot, battery),
    }
    if authoriser is not None and autopilot is Autopilot.PX4:
        values |= {"COM_ARM_AUTH_REQ": 1, "COM_ARM_AUTH_ID": authoriser}
    for name, value in {**values, **(given or {})}.items():
        known = found.get(name, VehicleParameter(name=name, value=value))
        found[name] = replace(known, value=value)
    return tuple(found[name] for name in sorted(found))


def parameter_values(parameters: Iterable[VehicleParameter]) -> dict[str, float]:
    """Return the values by name."""
    return {one.name: one.value for one in parameters}


def _default(row: Parameter, version: Version, *, whole: int) -> VehicleParameter:
    spelling, value = row.now, float(row.default)
    since = row.now.since
    if row.formerly is not None and since is not None and version < since:
        spelling = row.formerly
        value = row.default * SI_PER_UNIT[row.now.unit] / SI_PER_UNIT[spelling.unit]
    kind = whole if row.is_choice else REAL32
    return VehicleParameter(name=spelling.name, value=round(value, 6), kind=kind)


def _whole(autopilot: Autopilot) -> int:
    return INT32 if autopilot is Autopilot.PX4 else INT16


def _battery_values(autopilot: Autopilot, battery: Battery | None) -> dict[str, float]:
    if battery is None or battery.charge_ah is None:
        return {}
    capacity_mah = round(battery.charge_ah * _MAH_PER_AH)
    if autopilot is Autopilot.ARDUPILOT:
        return {"BATT_CAPACITY": capacity_mah}
    cells = {} if battery.cells_in_series is None else {"BAT1_N_CELLS": battery.cells_in_series}
    return {"BAT1_CAPACITY": capacity_mah, **cells}
