"""A vehicle model: what was identified about one vehicle, as a value that declares its own file."""

import datetime as dt
import math
from enum import StrEnum
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from planner.autopilot import Autopilot
from planner.physics.response import MAX_ORDER, StepResponse, TransferFunction
from planner.units import GRAVITY_M_S2
from planner.values import Value, brief
from planner.vehicle.battery import Battery
from planner.vehicle.declared import (
    NOT_NEGATIVE,
    POSITIVE,
    Annotated,
    Draft,
    Interval,
    Key,
    Named,
    Part,
    Problems,
    Range,
    length_problems,
    shown,
)
from planner.vehicle.power import (
    MASS_LAWS,
    AltitudeLaw,
    CruisePower,
    DensityLaw,
    DiFrancoButtazzoLaw,
    LiuLaw,
    MomentumLaw,
    VerticalPower,
    WholeLaw,
)

NOT_GIVEN, OF_CRUISE = "not-given", "of-cruise"
"""What a file writes where it has no law: that there is none, or that hover is in the cruise law."""
HOVER_WITHOUT_LAW = (
    f"is {OF_CRUISE} with a [cruise] law that knows hover (momentum, liu or di-franco-buttazzo), or "
    f"{NOT_GIVEN} with [cruise] {NOT_GIVEN} as well and [vertical] left out: neither holds here"
)
STATE_NAMES = ("takeoff", "climb", "accelerate", "cruise", "brake", "hover", "descend", "land")
"""The flight states, in the order of flights."""
LAW_FACTORS = {
    "hover": "hover power",
    "profile_ratio": "blade drag over induced power",
    "profile_speed_factor": "growth of blade drag with speed",
    "axial_factor": "power for each watt of climb",
    "drag_area_m2": "drag area",
    "disk_area_m2": "disk area at the same hover",
    "internal_resistance_ohm": "battery resistance",
}
"""What of a model by momentum theory is uncertain before any flight, in words: the power of hover as a whole,
coefficients of the law, and the battery."""
TABLE = Key("")
"""Of a table that the text of its class describes."""

NO_LEAN_THRUST = 0.8
"""Fraction of the thrust from which on a hover leaves ArduPilot no lean: its
AC_ATTITUDE_CONTROL_ANGLE_LIMIT_THROTTLE_MAX. [-]"""
_STEADY_GAIN_TOLERANCE = 0.05
"""How far the steady value of a motion model may be from its command. [-]"""
_UNDAMPED_TOLERANCE = 1e-9
"""Real part over magnitude up to which a pole counts as lying on the imaginary axis. [-]"""
_FRACTION = Range(0.0, 10.0)

_Coefficients: TypeAlias = tuple[float, ...]


class ManoeuvreResponse(Part, dict=True):
    """How the vehicle, or its power, answers a step of one reference."""

    numerator: Annotated[
        _Coefficients, Key("coefficients, highest power of s first", count=(1, MAX_ORDER + 1))
    ]
    denominator: Annotated[
        _Coefficients,
        Key(
            "coefficients, highest power of s first; third order at most", count=(2, MAX_ORDER + 1)
        ),
    ]
    delay_s: Annotated[float, Key("dead time", "s", NOT_NEGATIVE)]
    numerator_standard_error: Annotated[
        _Coefficients | None,
        Key(
            "standard error of each coefficient of the numerator, in its order",
            range=NOT_NEGATIVE,
            count=(0, MAX_ORDER + 1),
        ),
    ] = None
    denominator_standard_error: Annotated[
        _Coefficients | None,
        Key(
            "standard error of each coefficient of the denominator; 0 of one that is not fitted",
            range=NOT_NEGATIVE,
            count=(0, MAX_ORDER + 1),
        ),
    ] = None
    delay_standard_error_s: Annotated[
        float | None, Key("standard error of the dead time", "s", NOT_NEGATIVE)
    ] = None
    input_gain: Annotated[
        float, Key("the reference is multiplied by this before it enters the model")
    ]

    @cached_property
    def transfer_function(self) -> TransferFunction:
        """From the scaled reference to the answer, with its delay."""
        return TransferFunction(
            numerator=self.numerator, denominator=self.denominator, delay_s=self.delay_s
        )

    @cached_property
    def unit_step(self) -> StepResponse:
        """Answer to a step of the reference by one unit, input gain included."""
        return StepResponse(system=self.transfer_function, amplitude=self.input_gain)

    def inconsistencies(self) -> Problems:
        """Yield what makes this no usable transfer function."""
        if self.denominator[0] == 0.0:
            yield "denominator", "must not begin with 0: that is the highest power of s"
            return
        if len(np.trim_zeros(self.numerator, "f")) > len(self.denominator):
            yield "numerator", "has a higher power of s than the denominator: improper"
            return
        damping = self._least_damping()
        if damping is None:
            yield "denominator", "has coefficients too far apart to find its roots"
        # a power model is used over its window only, so it may ring; a motion model may not
        elif damping < _UNDAMPED_TOLERANCE * (-1.0 if isinstance(self, PowerResponse) else 1.0):
            yield "denominator", "is unstable: a root of it is not left of the imaginary axis"
        if self.input_gain == 0.0:
            yield "input_gain", "must not be 0"
        for name in ("numerator", "denominator"):
            if getattr(self, f"{name}_standard_error") is not None:
                yield from length_problems(self, name, f"{name}_standard_error")

    def _least_damping(self) -> float | None:
        """Return the least -Re(p)/|p| of all poles; ``None`` where they overflow."""
        with np.errstate(all="ignore"):  # what overflows is seen by not being finite
            scaled = np.asarray(self.denominator, dtype=np.float64) / self.denominator[0]
            if not np.isfinite(scaled).all():
                return None
            poles = np.roots(scaled)
            damping = -poles.real / np.maximum(np.abs(poles), np.finfo(np.float64).tiny)
        return float(damping.min()) if np.isfinite(damping).all() else None


class MotionResponse(ManoeuvreResponse):
    """A response that describes motion: it settles on its command."""

    def inconsistencies(self) -> Problems:
        """Yield what makes this no usable response of motion."""
        problems = list(super().inconsistencies())
        yield from problems
        gain = 1.0 if problems else self.input_gain * self.numerator[-1] / self.denominator[-1]
        if not abs(gain - 1.0) <= _STEADY_GAIN_TOLERANCE:
            problem = (
                f"makes a command of 1 end at {gain:.4g}: input_gain x numerator / denominator at "
                f"s = 0 must be 1 within {_STEADY_GAIN_TOLERANCE:.0%}"
            )
            yield "input_gain", problem


class PowerResponse(ManoeuvreResponse):
    """A response that describes power above hover power, used over a window."""

    window_s: Annotated[
        float,
        Key(
            "time from the command over which the response is used; hover power after it",
            "s",
            POSITIVE,
        ),
    ]

    def inconsistencies(self) -> Problems:
        """Yield what makes this no usable response of power."""
        yield from super().inconsistencies()
        if not self.window_s > self.delay_s:
            yield "window_s", "must be longer than delay_s: it counts from the command"


_STEP = Key("altitude step of the flights it was identified on", "m", POSITIVE)
_SPEED = Key("speed command of the flights it was identified on", "m/s", POSITIVE)


class AltitudeResponse(MotionResponse):
    """Altitude reference [m] to altitude [m]; G1 of the article."""

    identified_step_m: Annotated[float, _STEP]


class VerticalPowerResponse(PowerResponse):
    """Altitude reference [m] to power above hover [W]; G2 and G3 of the article."""

    identified_step_m: Annotated[float, _STEP]


class SpeedResponse(MotionResponse):
    """Speed reference [m/s] to airspeed [m/s]; G4 of the article."""

    identified_speed_m_s: Annotated[float, _SPEED]


class BrakePowerResponse(PowerResponse):
    """Speed reference [m/s] to power above hover [W], stopping; G5 of the article."""

    identified_speed_m_s: Annotated[float, _SPEED]


class Responses(Part):
    """Identified responses to a reference, each a transfer function with a delay in a table of its own.

    With reference = "step" both altitude and speed are required.
    """

    altitude: Annotated[AltitudeResponse | None, TABLE] = None
    climb_power: Annotated[
        VerticalPowerResponse | None,
        Key("Altitude reference [m] to power above hover [W], climbing; G2 of the article."),
    ] = None
    descent_power: Annotated[
        VerticalPowerResponse | None,
        Key("Altitude reference [m] to power above hover [W], descending; G3 of the article."),
    ] = None
    speed: Annotated[SpeedResponse | None, TABLE] = None
    brake_power: Annotated[BrakePowerResponse | None, TABLE] = None


class Ramps(Part):
    """How a vehicle flies whose autopilot is closed, each time from rest to rest.

    Each command is a step, answered by ramps of constant acceleration.  With reference = "step",
    instead of responses of altitude and speed.
    """

    start_s: Annotated[float, Key("from starting the motors to lift-off", "s", NOT_NEGATIVE)]
    climb_m_s: Annotated[float, Key("speed of climbs", "m/s", POSITIVE)]
    climb_wait_s: Annotated[
        float, Key("standstill between a climb and a level leg", "s", NOT_NEGATIVE)
    ]
    acceleration_m_s2: Annotated[
        float, Key("from standstill to speed, up and level", "m/s²", POSITIVE)
    ]
    braking_m_s2: Annotated[float, Key("from speed to standstill, up and level", "m/s²", POSITIVE)]
    turn_wait_s: Annotated[float, Key("standstill between two level legs", "s", NOT_NEGATIVE)]
    descent_m_s: Annotated[float, Key("speed of descents, positive", "m/s", POSITIVE)]
    landing_m_s: Annotated[
        float, Key("speed of the last part of a landing, positive", "m/s", POSITIVE)
    ]
    landing_height_m: Annotated[float, Key("height at which that part begins", "m", NOT_NEGATIVE)]
    stop_s: Annotated[float, Key("from touch-down to standing motors", "s", NOT_NEGATIVE)]


class Loads(Part):
    """What draws power besides flying; optional.

    Without this table nothing is added in the air, and the seconds on the ground with turning rotors
    cost hover power.
    """

    avionics_w: Annotated[
        float,
        Key(
            "avionics and payload electronics, added to every power of this file", "W", NOT_NEGATIVE
        ),
    ]
    ground_idle_w: Annotated[
        float,
        Key("motors before lift-off and after touch-down, avionics not counted", "W", NOT_NEGATIVE),
    ]


class ValidFor(Part):
    """The box in which the model holds; outside it the planner says so or refuses."""

    speed_m_s: Annotated[Interval | None, Key("airspeed", "m/s", NOT_NEGATIVE)] = None
    height_above_home_m: Annotated[Interval | None, Key("height above home", "m")] = None
    hover_height_above_home_m: Annotated[
        Interval | None, Key("heights at which hover power was measured", "m")
    ] = None
    altitude_step_m: Annotated[
        Interval | None, Key("altitude change commanded at once", "m", NOT_NEGATIVE)
    ] = None
    climb_rate_m_s: Annotated[Interval | None, Key("climb rate, descent negative", "m/s")] = None
    mass_kg: Annotated[Interval | None, Key("mass with payload", "kg", NOT_NEGATIVE)] = None
    air_density_kg_m3: Annotated[Interval | None, Key("air density", "kg/m³", NOT_NEGATIVE)] = None

    def inconsistencies(self) -> Problems:
        """Yield the problem of a box without sides."""
        if all(getattr(self, name) is None for name in self.__struct_fields__):
            yield "*", "is empty: say at least for which speeds and heights the model holds"


class ModelSpread(Part):
    """How far whole flights were from their predictions by this model; optional.

    Each is one standard deviation of flown less predicted, fractions over what was predicted.  Without
    this table nothing is known about the spread of a prediction.  After few flights the spread of a
    prediction is that of Student's t with n_flights degrees of freedom, at least two.
    """

    time_fraction: Annotated[
        float | None, Key("of the time of a flight, what all its legs share", range=_FRACTION)
    ] = None
    leg_time_s: Annotated[
        float | None,
        Key("of the time of each leg besides, with its turn or stop", "s", NOT_NEGATIVE),
    ] = None
    landing_time_s: Annotated[
        float | None,
        Key("of the time of a landing besides, until the motors stop", "s", NOT_NEGATIVE),
    ] = None
    energy_fraction: Annotated[
        float | None, Key("of its energy, what all states of one flight share", range=_FRACTION)
    ] = None
    energy_fraction_s_m: Annotated[
        float | None,
        Key("of its energy besides, for each m/s of wind: 0 where not given", "s/m", _FRACTION),
    ] = None
    stopping_distance_fraction: Annotated[
        float | None, Key("of stopping distances", range=_FRACTION)
    ] = None
    position_noise_fraction: Annotated[
        float | None,
        Key(
            "of position_noise_m, as standard deviation of its logarithm: what slows PX4 down in a flight",
            range=_FRACTION,
        ),
    ] = None
    n_flights: Annotated[int, Key("flights compared", range=Range(1))]
    source: Annotated[str, Key("which flights, and how they were compared")]
    energy_state_fraction: Annotated[
        Named,
        Key(
            "Of the energy of each state, besides what all states of one flight share: the same error "
            "for all that climb, all that are level and all that descend, independent between the "
            "three; optional.",
            range=_FRACTION,
            choices=STATE_NAMES,
        ),
    ] = ()

    law_fraction: Annotated[
        Named,
        Key(
            "Of what the [cruise] law by momentum theory and the battery were taken from where no flight "
            "told it, as standard deviations of logarithms: what mavjoule vehicle refine narrows; optional.",
            range=_FRACTION,
            choices=tuple(LAW_FACTORS),
        ),
    ] = ()
    law_correlation: Annotated[
        tuple[float, ...],
        Key(
            "correlation of each of law_fraction but the battery's with each before it, in its order; "
            "none where not given",
            range=Range(-1.0, 1.0),
        ),
    ] = ()

    def inconsistencies(self) -> Problems:
        """Yield the problem of a spread of nothing, and of legs without flights."""
        names = ("time_fraction", "energy_fraction", "stopping_distance_fraction")
        if all(getattr(self, name) is None for name in names):
            yield names[0], f"is missing: give one of {', '.join(names)} at least"
        for name in ("leg_time_s", "landing_time_s"):
            if self.time_fraction is None and getattr(self, name) is not None:
                yield name, "has no meaning without time_fraction"
        of_law = sum(name != "internal_resistance_ohm" for name, _ in self.law_fraction)
        pairs = of_law * (of_law - 1) // 2
        if self.law_correlation and len(self.law_correlation) != pairs:
            problem = f"must hold {pairs} numbers, of each pair of {of_law}"
            yield "law_correlation", f"{problem}, got {len(self.law_correlation)}"
        elif self.law_correlation and not _can_be(self.law_correlation, of_law):
            yield "law_correlation", "contradicts itself: no numbers are correlated so"


def _can_be(correlation: tuple[float, ...], size: int) -> bool:
    """Return whether numbers can be correlated so: the matrix of which these lie beneath the diagonal."""
    import numpy as np

    matrix = np.eye(size)
    matrix[np.tril_indices(size, -1)] = correlation
    return bool(np.linalg.eigvalsh(matrix)[0] > 0.0)  # of the lower half


class Basis(StrEnum):
    """What the numbers of a model rest on."""

    IDENTIFIED = "identified"
    """Flights of the vehicle."""
    REFINED = "refined"
    """A data sheet or theory, and flights."""
    ARTICLE = "article"
    DATA_SHEET = "data-sheet"
    """A published figure of the hover."""
    THEORY = "theory"
    """Mass and rotors alone."""

    @property
    def is_flown(self) -> bool:
        """Whether flights of the vehicle are in it."""
        return self not in {Basis.DATA_SHEET, Basis.THEORY}

    @property
    def is_sheet(self) -> bool:
        """Whether masses and air it is held to lift are those of a data sheet, not of flights."""
        return not self.is_flown or self is Basis.REFINED


class Provenance(Part):
    """Where the numbers come from."""

    source: Annotated[str, Key("article, or whose vehicle and flights")]
    basis: Annotated[
        Basis | None,
        Key(
            "what the numbers rest on: flights, a data sheet narrowed by flights, an article, a data "
            "sheet, theory"
        ),
    ] = None
    method: Annotated[str, Key("how the numbers were found")]
    date: Annotated[dt.date, Key("day the model file was made")]
    readings: Annotated[
        tuple[str, ...], Key("decisions taken where the source can be read in more than one way")
    ] = ()
    logs: Annotated[tuple[str, ...], Key("names of the flight logs used")] = ()
    logs_sha256: Annotated[tuple[str, ...], Key("SHA-256 of each log, in hexadecimal")] = ()
    fit: Annotated[
        Named, Key("Figures of the fit by name, for example power_rmse_w; optional.")
    ] = ()

    def inconsistencies(self) -> Problems:
        """Yield what is wrong with the list of logs."""
        if self.logs_sha256:
            yield from length_problems(self, "logs", "logs_sha256")
        if any(len(one) != 64 or set(one) - set("0123456789abcdef") for one in self.logs_sha256):
            yield "logs_sha256", "must hold 64 lower-case hexadecimal digits for each log"


class Speed(Part):
    """Speed the vehicle flies at when a mission commands none.

    Required with reference = "step"; refused otherwise, where it is an autopilot parameter.
    """

    default_m_s: Annotated[float, Key("speed", "m/s", POSITIVE)]


_FAR_DRAG = 2.0
"""Times the drag at which an airspeed was held, up to which its exponent tells another. [-]"""


class Aloft(Value):
    """What flies, and in what air."""

    times_heavier: float = 1.0
    """Its mass over that of its model. [-]"""
    air_density_kg_m3: float | None = None
    """``None``: not known, as that of the model."""


def held_drag(lean_rad: float, times_heavier: float) -> float:
    """Return the drag that a vehicle holds leaning in level flight, over the weight of its model. [-]

    Its rotors hold its weight too: m g tan(θ).
    """
    return math.tan(lean_rad) * times_heavier


class VehicleModel(Part):
    """What was identified about one vehicle."""

    __repr__ = brief

    source: str
    """Where the model was read from, as it is shown to users."""
    name: Annotated[str, Key("must equal the file name without .toml")]
    kind: Annotated[str, Key("kind of vehicle", choices=("multicopter",))]
    reference: Annotated[
        Autopilot, Key("who shapes the reference the model answers: step (nobody), px4, ardupilot")
    ]
    description: Annotated[str, Key("one or two sentences for a pilot")]
    reference_assumed: Annotated[
        bool,
        Key(
            "whether nobody said which autopilot it is: a mission or parameters of another are flown by that"
        ),
    ] = False
    mass_kg: Annotated[
        float | None, Key("take-off mass with battery, without payload", "kg", POSITIVE)
    ] = None
    mass_max_kg: Annotated[
        float | None, Key("highest take-off mass its maker allows, payload in it", "kg", POSITIVE)
    ] = None
    ceiling_amsl_m: Annotated[
        float | None,
        Key("altitude up to which its maker lets it take off with mass_kg", "m", POSITIVE),
    ] = None
    wind_max_m_s: Annotated[
        float | None,
        Key("highest wind its maker allows, also to take off and land in", "m/s", POSITIVE),
    ] = None
    thrust_max_n: Annotated[
        float | None,
        Key(
            "thrust of all rotors at full throttle, with a full battery, in air of 1.225 kg/m³",
            "N",
            POSITIVE,
        ),
    ] = None
    airspeed_limit_m_s: Annotated[
        float | None,
        Key(
            "highest airspeed the vehicle can hold, at its lean limit: as it was held, or as the lean "
            "of its flights tells within 3 %",
            "m/s",
            POSITIVE,
        ),
    ] = None
    airspeed_limit_lean_deg: Annotated[
        float | None,
        Key(
            "lean angle at which that airspeed was held: with another limit of the lean angle "
            "it is another",
            "°",
            Range(1.0, 80.0),
        ),
    ] = None
    airspeed_limit_air_density_kg_m3: Annotated[
        float | None,
        Key(
            "density of the air that airspeed was held in: in denser air the vehicle holds less, by the root "
            "of the ratio",
            "kg/m³",
            Range(0.3, 1.6),
        ),
    ] = None
    airspeed_limit_fraction: Annotated[
        float | None,
        Key(
            "standard deviation of that airspeed, relative: what is sure is two less",
            "-",
            Range(0.0, 0.4),
        ),
    ] = None
    drag_exponent: Annotated[
        float | None, Key("power of the airspeed that the drag goes by", "-", Range(1.0, 2.0))
    ] = None
    position_noise_m: Annotated[
        float,
        Key(
            "mean error of the position in a hover, where none is given; slows PX4 down",
            "m",
            Range(0.0, 1.5),
        ),
    ] = 0.0
    drag_per_s: Annotated[
        float | None,
        Key(
            "deceleration by the air over airspeed, for PX4, whose trajectory waits for a vehicle that "
            "lags by it",
            "1/s",
            Range(0.0, 5.0),
        ),
    ] = None
    speed: Annotated[Speed | None, TABLE] = None
    hover: Annotated[
        AltitudeLaw | DensityLaw | None,
        Key(
            "",
            absent={
                OF_CRUISE: (
                    "Hover power is that of the [cruise] law at rest: for a law that knows it, which "
                    "are momentum, liu and di-franco-buttazzo."
                ),
                NOT_GIVEN: (
                    "The power of the vehicle was not identified: time and distance are predicted, "
                    "energy is not, and no mission is a go (E109).  Needs power = "
                    '"not-given" under [cruise].'
                ),
            },
        ),
    ]
    responses: Annotated[Responses, TABLE] = Responses()
    ramps: Annotated[Ramps | None, TABLE] = None
    cruise: Annotated[
        CruisePower | MomentumLaw | LiuLaw | DiFrancoButtazzoLaw | None,
        Key(
            "",
            absent={
                NOT_GIVEN: (
                    "The source of the model gives no cruise power: the planner takes hover power "
                    "and says so in a finding."
                )
            },
        ),
    ]
    vertical: Annotated[VerticalPower | None, TABLE] = None
    loads: Annotated[Loads | None, TABLE] = None
    battery: Annotated[Battery | None, TABLE] = None
    parameters: Annotated[
        Named,
        Key(
            "Autopilot parameters by their own names and in their own units, for example WPNAV_SPEED "
            '= 1000; used where no parameter file is given.  Only with reference = "px4" or '
            '"ardupilot".'
        ),
    ] = ()
    valid_for: Annotated[ValidFor, TABLE]
    spread: Annotated[ModelSpread | None, TABLE] = None
    provenance: Annotated[Provenance, TABLE]

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together; drafts stand for what is wrong in itself."""
        if self.reference is Autopilot.STEP:
            yield from _step_problems(self)
        elif isinstance(self.reference, Autopilot):
            yield from _autopilot_problems(self)
        yield from _power_problems(self)
        yield from _lift_problems(self)

    @property
    def default_speed_m_s(self) -> float | None:
        """Speed where a mission commands none; ``None`` where it is an autopilot parameter. [m/s]"""
        return None if self.speed is None else self.speed.default_m_s

    def airspeed_limit_at(
        self, lean_rad: float | None, aloft: Aloft, *, is_certain: bool = False
    ) -> float | None:
        """Return the highest airspeed at a greatest lean angle; as it was held, where that is not known.

        In air of another density it is another by the root of that: the drag of a body goes by ρV², that of
        rotors, which turn by 1/√ρ faster for one thrust, by √ρ V.  Of the exponents that are possible, 1 to
        2, the one that gives less airspeed counts where none is known, or it has to be certain.
        """
        held_deg, limit_m_s = self.airspeed_limit_lean_deg, self.airspeed_limit_m_s
        held_kg_m3, flown_kg_m3 = self.airspeed_limit_air_density_kg_m3, aloft.air_density_kg_m3
        if limit_m_s is not None and held_kg_m3 is not None and flown_kg_m3 is not None:
            limit_m_s *= math.sqrt(held_kg_m3 / flown_kg_m3)
        if limit_m_s is None or held_deg is None or lean_rad is None:
            return limit_m_s
        drag = held_drag(lean_rad, aloft.times_heavier) / math.tan(math.radians(held_deg))
        exponent = self.drag_exponent or (2.0 if drag > 1.0 else 1.0)
        if drag > (1.0 if is_certain else _FAR_DRAG):
            exponent = 2.0  # one found at less lean is not known there
        return float(limit_m_s * drag ** (1.0 / exponent))

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
        return isinstance(self.hover, MASS_LAWS) or isinstance(self.cruise, MASS_LAWS)

    @property
    def knows_air_density(self) -> bool:
        """Whether the power depends on the density of the air."""
        return isinstance(self.hover, DensityLaw) or isinstance(self.cruise, MomentumLaw)

    @property
    def knows_acceleration(self) -> bool:
        """Whether the power depends on how the velocity changes."""
        return isinstance(self.cruise, MomentumLaw)


def _lift_problems(model: VehicleModel) -> Problems:
    """Yield a take-off mass that the same file says does not fly."""
    own_kg = model.mass_kg
    if not isinstance(own_kg, float):
        return
    if isinstance(model.mass_max_kg, float) and model.mass_max_kg < own_kg:
        yield "mass_max_kg", f"must not be below mass_kg, {own_kg:g}, got {model.mass_max_kg:g}"
    if isinstance(model.thrust_max_n, float) and model.thrust_max_n <= own_kg * GRAVITY_M_S2:
        yield (
            "thrust_max_n",
            f"must be above {own_kg * GRAVITY_M_S2:.3g}, the weight of mass_kg, got {model.thrust_max_n:g}",
        )


def _step_problems(model: VehicleModel) -> Problems:
    """Yield what a model of step references needs, or has no use for."""
    why = 'is missing: reference = "step" needs it'
    motion = {name: getattr(model.responses, name) for name in ("altitude", "speed")}
    if model.ramps is None:
        yield from ((f"responses.{name}", why) for name in motion if motion[name] is None)
    elif any(response is not None for response in motion.values()):
        yield "ramps", "has no meaning beside responses of altitude or speed: give one of both"
    if model.speed is None:
        yield "speed.default_m_s", why
    if model.parameters:
        yield "parameters", 'has no meaning with reference = "step": no autopilot reads them'


def _autopilot_problems(model: VehicleModel) -> Problems:
    """Yield what a model of an autopilot's references has no use for, or what is no parameter."""
    from planner.vehicle.parameters.resolve import parameter_problems

    why = f'has no meaning with reference = "{model.reference}"'
    if model.ramps is not None:
        yield "ramps", f"{why}: the autopilot has its own"
    if model.speed is not None:
        yield "speed", f"{why}: it is an autopilot parameter, give it under [parameters]"
    parameters: Any = model.parameters
    if not isinstance(parameters, Draft):
        for name, problem in parameter_problems(model.reference, dict(parameters)):
            yield f"parameters.{shown(name)}", problem


def _power_problems(model: VehicleModel) -> Problems:
    """Yield where hover, cruise, climb and mass do not fit together."""
    laws = (model.hover, model.cruise)
    has_whole = isinstance(model.cruise, WholeLaw)
    has_none = model.cruise is None and model.vertical is None
    if laws[0] is None and not has_whole and not has_none and not isinstance(laws[1], Draft):
        yield "hover.law", HOVER_WITHOUT_LAW
    if has_whole and model.vertical is not None:
        yield "vertical", "has no meaning here: the [cruise] law of this file knows the climb"
    configs = [law.__struct_config__ for law in laws if isinstance(law, MASS_LAWS)]
    if configs and model.mass_kg is None:
        needing = " and ".join(f'{config.tag_field} = "{config.tag}"' for config in configs)
        yield "mass_kg", f"is missing: {needing} needs the mass that flies"
