"""Mission items that no file holds: made one after the other for a complex item."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planner.mission.commands import Command, Frame
from planner.mission.items import MissionItem

if TYPE_CHECKING:
    from planner.findings import Place


@dataclass(slots=True, kw_only=True)
class ItemSequence:
    """The items of one complex item, numbered on; all of them stand at its place in the file."""

    first_number: int
    """Number of the first item in flown order, which is its jump id too, as ground stations do."""
    place: Place
    items: list[MissionItem] = field(default_factory=list)

    def add(
        self,
        command: int,
        *parameters: float | None,
        frame: int = Frame.MISSION,
        position: tuple[float, float, float | None] | None = None,
    ) -> None:
        """Add an item.

        Parameters
        ----------
        command : int
            MAV_CMD number.
        *parameters : float or None
            All seven, or the first four where there is a position; the rest is 0.
        frame : int
            MAV_FRAME number.
        position : tuple of float, optional
            Latitude [°], longitude [°] and altitude [m] of the frame.
        """
        values = [*parameters, *(0.0,) * (7 - len(parameters))]
        if position is not None:
            values[4:] = position
        self.items.append(
            MissionItem(
                command=int(command),
                frame=frame,
                param1=values[0],
                param2=values[1],
                param3=values[2],
                param4=values[3],
                latitude_deg=values[4],
                longitude_deg=values[5],
                altitude_m=values[6],
                jump_id=self.first_number + len(self.items),
                place=self.place,
            )
        )

    def add_waypoint(
        self,
        latitude_deg: float,
        longitude_deg: float,
        altitude_m: float,
        *,
        frame: int,
        hold_s: float = 0.0,
    ) -> None:
        """Add a waypoint with free yaw.

        Parameters
        ----------
        latitude_deg, longitude_deg : float
            Its place. [°]
        altitude_m : float
            Altitude in the reference of ``frame``. [m]
        frame : int
            MAV_FRAME number.
        hold_s : float
            How long to stay there. [s]
        """
        position = (latitude_deg, longitude_deg, altitude_m)
        self.add(Command.NAV_WAYPOINT, hold_s, 0.0, 0.0, None, frame=frame, position=position)
