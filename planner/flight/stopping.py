"""How far a vehicle goes on before it stands still, once something has gone wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.flight.motion.kinematics import FloatArray
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.resolve import FlightParameters

_BISECTIONS = 60


@frozen
class StopRoom:
    """The room a vehicle needs straight ahead to be told to stop, and to stop.

    Notes
    -----
    v t_r + s(v) + max(w, 0) t_r: the way until somebody or something reacts, the way from then to
    standing still, and what the part w of the wind that blows ahead carries it meanwhile.
    """

    vehicle: VehicleModel
    parameters: FlightParameters | None
    """``None``: the vehicle answers reference steps."""
    reaction_time_s: float

    def stopping_distance_m(self, speed_m_s: npt.ArrayLike) -> FloatArray:
        """Return the way from speeds to standing still, told to stop: s(v). [m]

        Parameters
        ----------
        speed_m_s : array_like
            Ground speeds, zero or more. [m s⁻¹]
        """
        speed = np.asarray(speed_m_s, np.float64)
        if self.parameters is None:
            response = self.vehicle.responses.speed
            # A model of step references has one: __post_init__ of the model sees to it.
            residence_s = (
                0.0 if response is None else response.transfer_function.mean_residence_time_s
            )
            way: FloatArray = speed * residence_s
            return way
        if isinstance(self.parameters, Px4Parameters):
            from planner.flight.motion.px4.speeds import stopping_distance_m as px4_way_m

            return px4_way_m(speed, self.parameters)
        from planner.flight.motion.ardupilot.stops import stopping_distance_m as ardupilot_way_m

        return ardupilot_way_m(speed, self.parameters, self.vehicle.responses.speed)

    def needed_m(self, speed_m_s: npt.ArrayLike, tail_wind_m_s: npt.ArrayLike = 0.0) -> FloatArray:
        """Return the room needed straight ahead. [m]

        Parameters
        ----------
        speed_m_s : array_like
            Ground speeds, zero or more. [m s⁻¹]
        tail_wind_m_s : array_like
            Part of the wind that blows ahead; against the flight it helps nothing. [m s⁻¹]
        """
        speed = np.asarray(speed_m_s, np.float64)
        drift = np.maximum(np.asarray(tail_wind_m_s, np.float64), 0.0)
        return (speed + drift) * self.reaction_time_s + self.stopping_distance_m(speed)

    def fitting_speed_m_s(
        self, room_m: float, *, at_most_m_s: float, tail_wind_m_s: float = 0.0
    ) -> float | None:
        """Return the highest speed whose needed room is there, by bisection.

        Parameters
        ----------
        room_m : float
            Room ahead. [m]
        at_most_m_s : float
            A speed that needs more room. [m s⁻¹]
        tail_wind_m_s : float
            Part of the wind that blows ahead. [m s⁻¹]

        Returns
        -------
        float or None
            ``None`` where there is not even room for the drift. [m s⁻¹]
        """
        if self.needed_m(0.0, tail_wind_m_s) > room_m:
            return None
        low, high = 0.0, at_most_m_s
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if self.needed_m(middle, tail_wind_m_s) <= room_m:
                low = middle
            else:
                high = middle
        return low
