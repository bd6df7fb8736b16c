"""Vehicle models as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.report.medium import Medium
    from planner.vehicle.model import VehicleModel


def models_text(vehicles: Sequence[VehicleModel], *, medium: Medium) -> str:
    """Return models by name, each with what it is and what it carries."""
    blocks = []
    for vehicle in vehicles:
        battery_wh = None if vehicle.battery is None else vehicle.battery.energy_wh
        facts = (
            f"{vehicle.kind}, references: {vehicle.reference}, "
            f"mass {numbers.mass(vehicle.mass_kg)}, battery {numbers.energy(battery_wh)}"
        )
        blocks += [
            medium.paint(vehicle.name, "bold"),
            *medium.wrapped(f"  {vehicle.description}", indent=2),
            *medium.wrapped(f"  {facts}", indent=2),
        ]
    return "\n".join(blocks) + "\n"
