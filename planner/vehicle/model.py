"""A vehicle model: what was identified about one vehicle, as a value."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.frozen import frozen
from planner.physics.response import StepResponse
from planner.vehicle.consistency import mass_problems, power_problems_together, reference_problems
from planner.vehicle.power import MASS_LAWS, CruisePower, DensityLaw, MomentumLaw, WholeLaw
from planner.vehicle.power_schema import LOADS
from planner.vehicle.ramp_schema import RAMPS
from planner.vehicle.response_schema import RESPONSE_TABLES
from planner.vehicle.schema import PROVENANCE, TOP, VALID_FOR
from planner.vehicle.spread_schema import SPREAD, STATE_NAMES

if TYPE_CHECKING:
    import datetime as dt

    from planner.physics.response import TransferFunction
    from planner.vehicle.battery import Battery
    from planner.vehicle.keys import Interval
    from planner.vehicle.power import CruiseLaw, HoverLaw, VerticalPower


@frozen
class ManoeuvreResponse:
    """How the vehicle, or its power, answers a step of one reference."""

    transfer_function: TransferFunction
    """From the scaled reference to the answer, with its delay."""
    input_gain: float
    """The reference is multiplied by this before it enters the transfer function. [-]"""
    window_s: float | None = None
    """Time from the command over which a power response is used; ``None`` for motion. [s]"""
    identified_step_m: float | None = None
    """Altitude step it was identified on; ``None`` for answers to a speed. [m]"""
    identified_speed_m_s: float | None = None
    """Speed command it was identified on; ``None`` for answers to an altitude. [m/s]"""
    numerator_standard_error: tuple[float, ...] | None = None
    """Of each coefficient, in its order; ``None`` where the method tells none."""
    denominator_standard_error: tuple[float, ...] | None = None
    """Of each coefficient; 0 of one that is not fitted."""
    delay_standard_error_s: float | None = None

    @property
    def unit_step(self) -> StepResponse:
        """Answer to a step of the reference by one unit, input gain included."""
        return StepResponse(system=self.transfer_function, amplitude=self.input_gain)

    @property
    def numerator(self) -> tuple[float, ...]:
        """Coefficients of the numerator, highest power of s first."""
        return self.transfer_function.numerator

    @property
    def denominator(self) -> tuple[float, ...]:
        """Coefficients of the denominator, highest power of s first."""
        return self.transfer_function.denominator

    @property
    def delay_s(self) -> float:
        """Dead time [s]."""
        return self.transfer_function.delay_s


@frozen
class Responses:
    """The identified responses, each ``None`` where the model does not have it.

    A model of step references has at least altitude and speed.  Powers are above hover power.
    """

    altitude: ManoeuvreResponse | None = None
    """Altitude reference [m] to altitude [m]; G1 of the article."""
    climb_power: ManoeuvreResponse | None = None
    """Altitude reference [m] to power [W], climbing; G2."""
    descent_power: ManoeuvreResponse | None = None
    """Altitude reference [m] to power [W], descending; G3."""
    speed: ManoeuvreResponse | None = None
    """Speed reference [m/s] to airspeed [m/s]; G4."""
    brake_power: ManoeuvreResponse | None = None
    """Speed reference [m/s] to power [W], stopping; G5."""

    def __post_init__(self) -> None:
        for name, table in RESPONSE_TABLES.items():
            if (response := getattr(self, name)) is not None:
                table.refuse(response)


@frozen
class Ramps:
    """How a vehicle of a closed autopilot flies from place to place, each time from rest to rest."""

    start_s: float
    """From starting the motors to lift-off. [s]"""
    climb_m_s: float
    climb_wait_s: float
    """Standstill between a climb and a level leg. [s]"""
    acceleration_m_s2: float
    braking_m_s2: float
    turn_wait_s: float
    """Standstill between two level legs. [s]"""
    descent_m_s: float
    """Positive. [m s⁻¹]"""
    landing_m_s: float
    """Speed of the last part of a landing, positive. [m s⁻¹]"""
    landing_height_m: float
    """Height at which that part begins. [m]"""
    stop_s: float
    """From touch-down to standing motors. [s]"""

    def __post_init__(self) -> None:
        RAMPS.refuse(self)


@frozen
class Loads:
    """What draws power besides flying."""

    avionics_w: float
    """Avionics and payload electronics, added to every power of the model. [W]"""
    ground_idle_w: float
    """Motors before lift-off and after touch-down, avionics not counted. [W]"""

    def __post_init__(self) -> None:
        LOADS.refuse(self)


@frozen
class ValidFor:
    """The box in which a model holds; ``None`` where the model does not say."""

    speed_m_s: Interval | None = None
    """Airspeed. [m/s]"""
    height_above_home_m: Interval | None = None
    """Height above home. [m]"""
    hover_height_above_home_m: Interval | None = None
    """Heights above home at which hover power was measured. [m]"""
    altitude_step_m: Interval | None = None
    """Altitude change commanded at once. [m]"""
    climb_rate_m_s: Interval | None = None
    """Climb rate, descent negative. [m/s]"""
    mass_kg: Interval | None = None
    """Mass with payload. [kg]"""
    air_density_kg_m3: Interval | None = None
    """Air density. [kg m⁻³]"""

    def __post_init__(self) -> None:
        VALID_FOR.refuse(self)


@frozen
class Provenance:
    """Where the numbers of a model come from."""

    source: str
    method: str
    date: dt.date
    """Day the model file was made."""
    readings: tuple[str, ...] = ()
    """Decisions taken where the source can be read in more than one way."""
    logs: tuple[str, ...] = ()
    """Names of the flight logs used."""
    logs_sha256: tuple[str, ...] = ()
    """SHA-256 of each log, in hexadecimal."""
    fit: tuple[tuple[str, float], ...] = ()
    """Figures of the fit by name, in the order of the file."""

    def __post_init__(self) -> None:
        PROVENANCE.refuse(self)


@frozen
class VehicleModel:
    """What was identified about one vehicle."""

    name: str
    """Also the stem of the model's file."""
    source: str
    """Where the model was read from, as it is shown to users."""
    kind: str
    """Kind of vehicle: ``multicopter``."""
    reference: Autopilot
    """Who shapes the references the model answers."""
    description: str
    hover: HoverLaw | None
    """``None`` where the cruise law knows hover as well, or the power was not identified."""
    responses: Responses
    valid_for: ValidFor
    provenance: Provenance
    cruise: CruiseLaw | None = None
    """``None`` where the source of the model gives no cruise power."""
    ramps: Ramps | None = None
    """How it flies where its own autopilot shapes the way; in place of responses."""
    vertical: VerticalPower | None = None
    loads: Loads | None = None
    """``None``: nothing is added in the air, and turning rotors on the ground cost hover power."""
    battery: Battery | None = None
    airspeed_limit_m_s: float | None = None
    """Highest airspeed the vehicle can hold, at its lean limit; ``None``: not known. [m s⁻¹]"""
    position_noise_m: float = 0.0
    """Mean horizontal error of the position in a hover, where none is given. [m]"""
    mass_kg: float | None = None
    """Take-off mass with battery, without payload. [kg]"""
    default_speed_m_s: float | None = None
    """Speed where a mission commands none; ``None`` where it is an autopilot parameter. [m/s]"""
    parameters: tuple[tuple[str, float], ...] = ()
    """Autopilot parameters by their own names and in their own units."""
    spread: ModelSpread | None = None
    """``None``: nothing is known about how far flights are from predictions."""

    def __post_init__(self) -> None:
        TOP.refuse(self)
        problems = [
            *reference_problems(
                self.reference,
                has_altitude_response=self.responses.altitude is not None,
                has_speed_response=self.responses.speed is not None,
                has_ramps=self.ramps is not None,
                has_default_speed=self.default_speed_m_s is not None,
                has_parameters=bool(self.parameters),
            ),
            *power_problems_together(
                is_hover_of_cruise=self.hover is None and self.cruise is not None,
                is_hover_known=self.hover is not None or self.cruise is not None,
                is_cruise_whole=isinstance(self.cruise, WholeLaw),
                is_cruise_known=self.cruise is not None,
                has_vertical=self.vertical is not None,
            ),
            *mass_problems(
                needing=[
                    name
                    for name, law in (("hover", self.hover), ("cruise", self.cruise))
                    if isinstance(law, (DensityLaw, *MASS_LAWS))
                ],
                has_mass=self.mass_kg is not None,
            ),
        ]
        if self.reference is not Autopilot.STEP:
            from planner.vehicle.parameters.resolve import parameter_problems

            problems += parameter_problems(self.reference, dict(self.parameters))
        if problems:
            raise ValueError("; ".join(f"{key} {problem}" for key, problem in problems))

    @property
    def is_power_known(self) -> bool:
        """Whether the power of the vehicle was identified at all."""
        return self.hover is not None or self.cruise is not None

    @property
    def knows_airspeed(self) -> bool:
        """Whether the power depends on the airspeed, and so on the wind."""
        if isinstance(self.cruise, CruisePower):
            return len(set(self.cruise.power_above_hover_w)) > 1
        return self.cruise is not None

    @property
    def knows_mass(self) -> bool:
        """Whether the power depends on the mass, and so on the payload."""
        return isinstance(self.hover, DensityLaw) or isinstance(self.cruise, MASS_LAWS)

    @property
    def knows_air_density(self) -> bool:
        """Whether the power depends on the density of the air."""
        return isinstance(self.hover, DensityLaw) or isinstance(self.cruise, MomentumLaw)


@frozen
class ModelSpread:
    """Standard deviations of (flown - predicted) / predicted; ``None`` where not known."""

    n_flights: int
    """Flights compared, none of which the model was fitted to."""
    source: str
    """Which flights, and how they were compared."""
    time_fraction: float | None = None
    """Of the time of a flight. [-]"""
    energy_fraction: float | None = None
    """Of its energy, what all states of one flight share. [-]"""
    energy_state_fraction: tuple[tuple[str, float], ...] = ()
    """Of the energy of states by name, independent from state to state. [-]"""
    stopping_distance_fraction: float | None = None
    """Of stopping distances. [-]"""

    def __post_init__(self) -> None:
        SPREAD.refuse(self)
        for state, fraction in self.energy_state_fraction:
            if state not in STATE_NAMES or not 0.0 <= fraction <= 10.0:
                msg = f"energy_state_fraction holds shares by state, got {state} = {fraction}"
                raise ValueError(msg)
