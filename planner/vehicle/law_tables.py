"""Which table of a model file holds which law of power."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.vehicle.power import (
    AltitudeLaw,
    CruisePower,
    DensityLaw,
    DiFrancoButtazzoLaw,
    LiuLaw,
    MomentumLaw,
)
from planner.vehicle.power_schema import (
    ALTITUDE_LAW,
    CRUISE,
    CRUISE_NOT_GIVEN,
    DENSITY_LAW,
    DI_FRANCO_BUTTAZZO,
    HOVER_NOT_GIVEN,
    HOVER_OF_CRUISE,
    LIU,
    MOMENTUM,
)

if TYPE_CHECKING:
    from typing import Any

    from planner.vehicle.keys import Table
    from planner.vehicle.power import CruiseLaw, HoverLaw

MASS_TABLES = (DENSITY_LAW, MOMENTUM, LIU)
"""Laws that need the mass."""
WHOLE_TABLES = (MOMENTUM, LIU, DI_FRANCO_BUTTAZZO)
"""Laws that give all the power of the motors, hover and climb included."""

_HOVER_LAWS: tuple[tuple[Table, type[HoverLaw]], ...] = (
    (ALTITUDE_LAW, AltitudeLaw),
    (DENSITY_LAW, DensityLaw),
)
_CRUISE_LAWS: tuple[tuple[Table, type[CruiseLaw]], ...] = (
    (CRUISE, CruisePower),
    (MOMENTUM, MomentumLaw),
    (LIU, LiuLaw),
    (DI_FRANCO_BUTTAZZO, DiFrancoButtazzoLaw),
)


def hover_law(table: Table, values: dict[str, Any]) -> HoverLaw | None:
    """Return the law of a hover table with its values; ``None`` where it names none."""
    return next((law(**values) for known, law in _HOVER_LAWS if known is table), None)


def cruise_law(table: Table, values: dict[str, Any]) -> CruiseLaw | None:
    """Return the law of a cruise table with its values; ``None`` where it names none."""
    return next((law(**values) for known, law in _CRUISE_LAWS if known is table), None)


def hover_table(hover: HoverLaw | None, cruise: CruiseLaw | None) -> Table:
    """Return the table that holds a hover law, or says where the power of hover comes from."""
    if hover is None:
        return HOVER_NOT_GIVEN if cruise is None else HOVER_OF_CRUISE
    return next(table for table, law in _HOVER_LAWS if type(hover) is law)


def cruise_table(cruise: CruiseLaw | None) -> Table:
    """Return the table that holds a cruise law."""
    if cruise is None:
        return CRUISE_NOT_GIVEN
    return next(table for table, law in _CRUISE_LAWS if type(cruise) is law)
