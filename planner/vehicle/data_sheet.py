"""A model of a vehicle that nobody has flown for it: from its data sheet, or one figure of its hover.

What the sheet gives is taken, what it does not give comes from `planner.vehicle.priors`, and how far
both may be off makes the spread of the model: a go by such a model needs a margin that holds it.
"""

from __future__ import annotations

import datetime as dt
import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3, standard_density_kg_m3
from planner.physics.rotor import Rotor, hover_induced_velocity_m_s
from planner.units import GRAVITY_M_S2, JOULES_PER_WATT_HOUR, MILLIAMPERE_HOURS_PER_AMPERE_HOUR
from planner.values import Value, field, replace
from planner.vehicle.battery import Battery
from planner.vehicle.declared import Interval
from planner.vehicle.figures import HoverFigure, HoverKind
from planner.vehicle.law_factors import LawSpread, energy_fractions
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import (
    NO_LEAN_THRUST,
    Basis,
    Loads,
    ModelSpread,
    Provenance,
    ValidFor,
    VehicleModel,
)
from planner.vehicle.pack import (
    FULL_LIPO_CELL_V,
    LIPO_CELL_V,
    LITHIUM_ION,
    MOST_LITHIUM_ION_V,
    cells_of_full_voltage,
    cells_of_voltage,
    chemistry_of,
    pack_of_label,
)
from planner.vehicle.parameters.resolve import kept_parameters
from planner.vehicle.power import MomentumLaw
from planner.vehicle.priors import (
    disk_area_m2,
    hover_cost,
    hover_impossible,
    ideal_hover_w,
    multicopter_priors,
    timed_power_w,
)
from planner.vehicle.reader import load_chemistry
from planner.vehicle.repeatability import DAY_FRACTION

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.vehicle.drones import PublishedDrone
    from planner.vehicle.figures import MotorTable
    from planner.vehicle.parameters.files import ParameterSet
    from planner.vehicle.priors import Prior

_DISK_LOADING_N_M2 = (8.0, 500.0)
"""Weight over disk area of anything that flies: racers have 120, indoor flyers 20 to 40. [N/m²]"""
_UNUSUAL_DISK = 1.5
"""Times the range of 8 of 10 multicopters, beyond which it is worth a word: 5-inch racers of 0.6 kg have
120 N/m². [-]"""
_MOST_PACK = 0.7
"""Battery over take-off mass beyond which nothing is left for motors and frame: records of endurance
have 0.6 to 0.65. [-]"""
_COSTLIEST = 3.0
"""Hover power over that of published multicopters with such propellers, beyond which a figure is in
another unit, or of another vehicle: the worst of them is 1.25 times the mean. [-]"""
_CHEAPEST = 1.5
"""Usual hover power over a figure, from which on the figure is worth a word: more than three times what
published multicopters are apart. [-]"""
_MOST_AVIONICS = 0.1
"""Of the hover power. [-]"""
_THRUST_AGREES = 1.5
"""How far the thrust by throttle and motor table may be from the weight: batteries, props and curves
explain a third, not more. [-]"""
_FASTEST_M_S = 15.0
"""Up to which momentum theory with an estimated drag is held to say something. [m/s]"""
_LEAN_DEG = 20.0
"""Lean in steady flight up to which it is. [°]"""
_THRUST_EXPO = 0.65
"""ArduPilot's default curve of thrust over throttle (MOT_THST_EXPO)."""
_LIGHTEST = 0.8
"""Of the take-off mass: a camera off. [-]"""
_DENSEST_KG_M3 = 1.35
_HEIGHT_RANGE = Interval(low=-1.0, high=500.0)
_DJI_MOTION = "dji-matrice-100"
"""Whose ramps other vehicles of DJI fly by: the one of which flights were measured."""


class DataSheet(Value):
    """What is known of a vehicle without its flights; what is ``None`` is assumed, and said to be."""

    name: str
    """Of the model; also the stem of its file."""
    mass_kg: float | None = None
    """Take-off mass with battery, without payload. [kg]"""
    mass_max_kg: float | None = None
    """Highest take-off mass its maker allows. [kg]"""
    ceiling_amsl_m: float | None = None
    """Height up to which its maker lets it take off with the take-off mass. [m]"""
    wind_max_m_s: float | None = None
    """Highest wind its maker allows. [m s⁻¹]"""
    battery: Battery | None = None
    chemistry: str | None = None
    rotors: int | None = None
    """Propellers; two on one arm count twice."""
    propeller_m: float | None = None
    """Their diameter. [m]"""
    hover: HoverFigure | None = None
    motor: MotorTable | None = None
    """Beside a hover throttle it tells the power as well; the thrust always."""
    autopilot: Autopilot | None = None
    is_autopilot_assumed: bool = False
    """Whether it may be another as well: frames are sold without."""
    moves_like: VehicleModel | None = None
    """A model whose ramps it flies, where its autopilot is its maker's own."""
    parameters: ParameterSet | None = None
    description: str | None = None
    source: str = ""
    """Who says so: a data sheet, its address."""
    notes: tuple[str, ...] = ()
    """Where each figure comes from."""
    remembered: frozenset[str] = frozenset()
    """Quantities of the power whose figures were compared with no page: mass, disk, hover."""
    date: dt.date = field(default_factory=dt.date.today)
    """Day the model is made."""


def drone_sheet(drone: PublishedDrone, *, date: dt.date) -> DataSheet:
    """Return the data sheet of a published drone; of DJI's own autopilots only one was ever measured."""
    remembered = drone.remembered
    is_timed = drone.figure is not None and "battery" in remembered
    quantities = {"mass": "mass", "propeller": "disk", "hover": "hover"}
    figures = {quantities[name] for name in remembered & quantities.keys()}
    return DataSheet(
        name=drone.name,
        mass_kg=drone.mass_kg,
        mass_max_kg=drone.mass_max_kg,
        ceiling_amsl_m=drone.ceiling_amsl_m,
        wind_max_m_s=drone.wind_max_m_s,
        battery=drone.battery,
        rotors=drone.rotors,
        propeller_m=drone.propeller_m,
        hover=drone.figure,
        autopilot=drone.autopilot,
        is_autopilot_assumed=drone.flown_by_others,
        moves_like=load_vehicle(_DJI_MOTION) if drone.autopilot is None else None,
        description=drone.description,
        source=f"published figures of the {drone.description.partition(',')[0]}",
        notes=drone.notes,
        remembered=frozenset(figures | ({"hover"} if is_timed else set())),
        date=date,
    )


def vehicle_from_data_sheet(sheet: DataSheet) -> VehicleModel:
    """Return a complete model of a vehicle nobody has logged, with a spread that holds what is assumed.

    Power is that of momentum theory with the rotors of the sheet; hovering takes what its figure of the
    hover says, else what published multicopters with such propellers take.  Motion is the autopilot's.

    Raises
    ------
    UsageError
        If the sheet lacks what nothing can be assumed for, or what it says cannot fly.
    """
    return _Sheet(sheet).model()


class _Sheet:
    """A data sheet with what is assumed beside it: quantities, how far each may be off, and why."""

    def __init__(self, sheet: DataSheet) -> None:
        self.sheet = sheet
        self.priors = multicopter_priors()
        self.fractions: dict[str, float] = {}
        """Standard deviation of the logarithm of each quantity the power depends on."""
        self.readings: list[str] = [*sheet.notes]
        self.parameters = {} if sheet.parameters is None else sheet.parameters.numbers()
        self.is_autopilot_assumed = False
        self.autopilot = self._autopilot()
        self.battery = self._battery()
        self.mass_kg = self._mass_kg()
        self.rotors = 4 if sheet.rotors is None else sheet.rotors
        if sheet.rotors is None:
            self.readings.append("4 rotors: assumed, as most multicopters have")
        self.propeller_m = self._propeller_m()
        self._refuse_what_cannot_be()
        self.thrust_max_n = self._thrust_max_n()
        self.quantities = self._quantities()
        self._doubt_what_is_remembered()

    def _doubt_what_is_remembered(self) -> None:
        """Widen how far figures may be off that were compared with no page."""
        prior, names = self.priors["remembered"], sorted(self.sheet.remembered)
        for name in names:
            self.fractions[name] = math.hypot(self.fractions.get(name, 0.0), prior.fraction)
        if names:
            self.readings.append(
                f"{', '.join(names)}: as remembered, {prior.low:g} to {prior.high:g} times that; "
                f"{prior.source}"
            )

    def _assume(self, name: str, prior: Prior, *, why: str = "") -> float:
        """Take a prior for a quantity, and say so."""
        self.fractions[name] = prior.fraction
        self.readings.append(f"{why}: {prior}" if why else str(prior))
        return prior.value

    def _autopilot(self) -> Autopilot:
        asked, given = self.sheet.autopilot, self.sheet.parameters
        stack = None if given is None else given.stack
        if given is not None and stack is not None and asked not in {None, stack}:
            msg = f"{given.source} holds parameters of {stack.label}: give the vehicle's own"
            raise UsageError(msg)
        like = self.sheet.moves_like
        if like is not None:
            if like.ramps is None or like.speed is None or asked is not None or given is not None:
                msg = (
                    f"{like.name}: a vehicle moves like a model with [ramps], and has then neither "
                    "autopilot nor parameters"
                )
                raise UsageError(msg)
            speed = quantity.speed(like.speed.default_m_s)
            self.readings.append(
                f"moves like {like.name}: from rest to rest at each waypoint, at {speed} where the "
                "mission commands no speed; waypoints that its own app flies in curves take less"
            )
            return like.reference
        if asked is Autopilot.STEP:
            msg = (
                "no data sheet says how a vehicle without PX4 or ArduPilot moves: identify it from a "
                f"log, or let it move like another (--moves-like {_DJI_MOTION})"
            )
            raise UsageError(msg)
        flown_by = asked or stack or Autopilot.ARDUPILOT
        self.is_autopilot_assumed = self.sheet.is_autopilot_assumed or not (asked or stack)
        if self.is_autopilot_assumed:
            other = Autopilot.PX4 if flown_by is Autopilot.ARDUPILOT else Autopilot.ARDUPILOT
            self.readings.append(
                f"flown by {flown_by.label}: assumed; a mission or parameters of {other.label} are flown by "
                f"{other.label}"
            )
        return flown_by

    @property
    def _may_be_px4(self) -> bool:
        """Whether what only PX4 shows of a vehicle counts."""
        return self.autopilot is Autopilot.PX4 or self.is_autopilot_assumed

    def _told_cells(self) -> tuple[int, str] | None:
        """Return the number of cells the parameters tell, and which of them."""
        for name, cell_v in (("BAT1_N_CELLS", 1.0), ("MOT_BAT_VOLT_MAX", FULL_LIPO_CELL_V)):
            value = self.parameters.get(name, 0.0)
            if value >= 1.0:
                return round(value / cell_v), name
        return None

    def _labelled(self, told: tuple[int, str] | None) -> Battery | None:
        """Return the battery of the sheet, or the one its parameters tell."""
        given = self.sheet.parameters
        if self.sheet.battery is not None:
            return self.sheet.battery
        charge_mah = self.parameters.get("BATT_CAPACITY", self.parameters.get("BAT1_CAPACITY", 0.0))
        if given is None or charge_mah <= 0.0 or told is None:
            return None
        charge_ah = charge_mah / MILLIAMPERE_HOURS_PER_AMPERE_HOUR
        cells, name = told
        self.readings.append(
            f"battery of {charge_ah:g} Ah, {cells} cells by {name}: {given.source}"
        )
        return Battery(capacity_ah=charge_ah, nominal_voltage_v=LIPO_CELL_V * cells)

    def _battery(self) -> Battery | None:
        told = self._told_cells()
        given = self._labelled(told)
        if given is None:
            self.readings.append("no battery given: every check asks for --battery")
            return None
        if given.voltage_v is None or given.new_charge_ah is None:
            msg = "the battery is given by its energy alone: give charge and cells, such as 4S5200"
            raise UsageError(msg)
        volts = quantity.voltage(given.voltage_v)
        cells = cells_of_voltage(given.voltage_v)
        full = cells_of_full_voltage(given.voltage_v)
        mah = quantity.exact(round(MILLIAMPERE_HOURS_PER_AMPERE_HOUR * given.new_charge_ah, 3))
        if cells is None:
            what = "not that of a number of lithium cells of 3.6 to 3.85 V"
            if full is not None:
                what = f"that of {quantity.count(full, 'full cell')}, not their nominal voltage"
            msg = f"{volts} is {what}: give the battery as {full or 4}S{mah}"
            raise UsageError(msg)
        is_lithium_ion = given.voltage_v / cells <= MOST_LITHIUM_ION_V
        if full is not None and is_lithium_ion and self.sheet.chemistry is None:
            msg = (
                f"{volts} is that of {full} full cells or of {cells} lithium-ion cells: give the battery as "
                f"{full}S{mah}, or --chemistry {LITHIUM_ION}"
            )
            raise UsageError(msg)
        if told is not None and told[0] != cells:
            msg = f"a battery of {volts} has {cells} cells, {told[1]} says {told[0]}: correct one of them"
            raise UsageError(msg)
        pack = pack_of_label(given, self.sheet.chemistry)
        assert pack.chemistry is not None
        assert pack.ocv_v is not None
        if self.sheet.chemistry is None:
            self.readings.append(f"{cells} cells of {pack.chemistry}: as {volts} mean")
        of_1_ah_ohm = self._assume("resistance", self.priors["cell_resistance"])
        kind = load_chemistry(pack.chemistry)
        return replace(
            pack,
            nominal_voltage_v=_rounded(given.voltage_v, 5),
            ocv_v=tuple(round(one, 3) for one in pack.ocv_v),
            internal_resistance_ohm=_rounded(cells * of_1_ah_ohm / given.new_charge_ah, 3),
            resistance_temperature_c=kind.resistance_temperature_c,
            resistance_factor=kind.resistance_factor,
        )

    def _mass_kg(self) -> float:
        if self.sheet.mass_kg is not None:
            return self.sheet.mass_kg
        if self.battery is None:
            msg = "give the take-off mass: without a battery nothing says how heavy the vehicle is"
            raise UsageError(msg)
        prior = self.priors["battery_energy_per_mass"]
        per_kg = self._assume("mass", prior, why="take-off mass not given")
        return _rounded(self.battery.energy_wh / per_kg, 3)

    def _propeller_m(self) -> float:
        if self.sheet.propeller_m is not None:
            return self.sheet.propeller_m
        prior = self.priors["disk_loading"]
        loading = self._assume("disk", prior, why="propellers not given")
        area_m2 = self.mass_kg * GRAVITY_M_S2 / loading
        return _rounded(math.sqrt(area_m2 / self.rotors * 4.0 / math.pi), 3)

    @property
    def _rotors_text(self) -> str:
        return f"{quantity.count(self.rotors, 'rotor')} of {self.propeller_m:.3g} m"

    def _refuse_what_cannot_be(self) -> None:
        area_m2 = disk_area_m2(self.rotors, self.propeller_m)
        loading = self.mass_kg * GRAVITY_M_S2 / area_m2
        low, high = _DISK_LOADING_N_M2
        usual = self.priors["disk_loading"]
        if not low <= loading <= high:
            each = quantity.decimals(loading, 0 if loading >= 10.0 else 1)
            msg = (
                f"{self.mass_kg:.4g} kg on {self._rotors_text} is {each} N for each m² of disk, "
                f"multicopters have {usual.low:g} to {usual.high:g}: are {self.mass_kg:g} kg and "
                f"{self.propeller_m:.3g} m of diameter what is meant?"
            )
            raise UsageError(msg)
        if not usual.low / _UNUSUAL_DISK <= loading <= usual.high * _UNUSUAL_DISK:
            self.readings.append(
                f"{self.mass_kg:.4g} kg on {self._rotors_text} is {quantity.decimals(loading, 0)} N for each "
                f"m² of disk, 8 of 10 multicopters have {usual.low:g} to {usual.high:g}: compare mass and "
                "diameter with the sheet"
            )
        if self.sheet.mass_max_kg is not None and self.sheet.mass_max_kg < self.mass_kg:
            msg = (
                f"the take-off mass of {quantity.mass(self.mass_kg)} is above the highest that its maker "
                f"allows, {quantity.mass(self.sheet.mass_max_kg)}: correct one of them"
            )
            raise UsageError(msg)
        if self.battery is None:
            return
        energy, whole = quantity.energy(self.battery.energy_wh), quantity.mass(self.mass_kg)
        highest_wh_kg = chemistry_of(self.battery).highest_wh_kg
        assert highest_wh_kg is not None  # a chemistry that is judged by has it
        least_kg = self.battery.energy_wh / highest_wh_kg
        if least_kg > _MOST_PACK * self.mass_kg:
            msg = (
                f"a battery of {energy} weighs {quantity.mass(least_kg)} at least, the vehicle {whole} in "
                "all: is the charge in mAh, the mass in kg?"
            )
            raise UsageError(msg)

    def _quantities(self) -> dict[str, float]:
        """Return what the power depends on."""
        ideal_w = ideal_hover_w(self.mass_kg, self.rotors, self.propeller_m)
        usual = hover_cost()
        hover_w = self._hover_w()
        if hover_w is None:
            self.fractions["hover"] = usual.fraction
            hover_w = usual.at(self.propeller_m) * ideal_w
            self.readings.append(
                f"no figure of the hover: {usual.at(self.propeller_m):.3g} electrical watts for each ideal "
                f"one, as {usual.count} published flight times have it by the size of propellers; each size "
                f"is off by {quantity.percent(usual.fraction)} (standard deviation) from what the others say "
                "(models/priors/drones.toml)"
            )
        self._assume("avionics", self.priors["avionics"])
        self._refuse_hover(hover_w, ideal_w)
        self._doubt_hover(hover_w, ideal_w)
        priors = self.priors
        return {
            "mass": self.mass_kg,
            "disk": disk_area_m2(self.rotors, self.propeller_m),
            "hover": hover_w,
            "avionics": self._avionics_w(hover_w),
            "profile_ratio": self._assume("profile_ratio", priors["profile_ratio"]),
            "profile_speed_factor": self._assume(
                "profile_speed_factor", priors["profile_speed_factor"]
            ),
            "axial_factor": self._assume("axial_factor", priors["axial_factor"]),
            "drag": self._assume("drag", priors["drag_per_mass"]) * self.mass_kg ** (2.0 / 3.0),
        }

    def _avionics_w(self, hover_w: float) -> float:
        """Return the power of the avionics of a vehicle that hovers on so much. [W]"""
        return min(self.priors["avionics"].value, _MOST_AVIONICS * hover_w)

    def _hover_w(self) -> float | None:
        """Return the hover power that a figure of the sheet means; ``None`` where there is none. [W]"""
        figure, motor, battery = self.sheet.hover, self.sheet.motor, self.battery
        throttle = self.parameters.get("MOT_THST_HOVER") or self.parameters.get("MPC_THR_HOVER")
        if figure is None and motor is not None and throttle:
            figure = HoverFigure(kind=HoverKind.THROTTLE, value=throttle)
        if figure is None:
            return None
        if figure.kind is HoverKind.THROTTLE:
            return self._motor_hover_w(figure, motor)
        what = f"{figure.kind.label} of {figure}"
        off = self._assume("hover", self.priors[figure.prior], why=what)
        if figure.kind is HoverKind.POWER:
            return figure.value * off
        if battery is None or battery.voltage_v is None:
            msg = f"a {what} is no power without the battery: give it"
            raise UsageError(msg)
        if figure.kind is HoverKind.CURRENT:
            loaded_v = battery.voltage_v - figure.value * (battery.new_resistance_ohm or 0.0)
            if loaded_v < 0.5 * battery.voltage_v:
                msg = f"a {what} takes more than half of the battery's voltage: correct one of them"
                raise UsageError(msg)
            return figure.value * off * loaded_v
        return off * timed_power_w(battery.energy_wh, figure.value)

    def _thrust_max_n(self) -> float | None:
        """Return the thrust at full throttle by what the sheet says, the least of it; none if nothing. [N]"""
        motor, weight_n = self.sheet.motor, self.mass_kg * GRAVITY_M_S2
        if motor is None:
            return None
        most_n, figure = self.rotors * motor.thrust_n, self.sheet.hover
        if most_n <= weight_n:
            msg = (
                f"{self.rotors} motors of {quantity.mass(most_n / GRAVITY_M_S2)} of thrust in all do not "
                f"lift {quantity.mass(self.mass_kg)}: correct one of them"
            )
            raise UsageError(msg)
        if figure is not None and figure.kind is HoverKind.THROTTLE:
            most_n = min(most_n, weight_n / figure.value)
        return _rounded(most_n, 4)

    def _motor_hover_w(self, figure: HoverFigure, motor: MotorTable | None) -> float:
        """Return the hover power by the throttle and the motor's table: P goes by T^1.5. [W]

        A throttle is a fraction of the most thrust (MOT_THST_HOVER) or of the signal to the motors, which
        give (1 - e) u + e u² of that: both readings are let pass.
        """
        if motor is None:
            msg = (
                f"a hover throttle of {figure} needs the motor at full throttle: give --motor, such as "
                "1250g@310W"
            )
            raise UsageError(msg)
        expo = self.parameters.get("MOT_THST_EXPO", _THRUST_EXPO)
        most_kg = self.rotors * motor.thrust_n / GRAVITY_M_S2
        low_kg = most_kg * ((1.0 - expo) * figure.value + expo * figure.value**2)
        high_kg = most_kg * figure.value
        if not low_kg / _THRUST_AGREES <= self.mass_kg <= _THRUST_AGREES * high_kg:
            msg = (
                f"{self.rotors} motors of {quantity.mass(most_kg)} of thrust in all carry "
                f"{quantity.mass(low_kg)} to {quantity.mass(high_kg)} at {figure} throttle, the vehicle "
                f"weighs {quantity.mass(self.mass_kg)}: correct one of them"
            )
            raise UsageError(msg)
        off = self._assume("hover", self.priors["motor_table"], why=f"hover throttle of {figure}")
        return self.rotors * motor.power_w * float((self.mass_kg / most_kg) ** 1.5) * off

    def _refuse_hover(self, hover_w: float, ideal_w: float) -> None:
        given = self.sheet.hover
        kind = HoverKind.POWER if given is None else given.kind
        hovering = f"hovering on {quantity.power(hover_w)}"
        if kind is not HoverKind.POWER:
            hovering += f" ({given})"
        carrying = f"{self._rotors_text} to carry {quantity.mass(self.mass_kg)}"
        beside = {HoverKind.POWER: "", HoverKind.THROTTLE: "the motor, "}.get(kind, "the battery, ")
        correct = f"correct the figure, {beside}the mass or the propellers"
        least_w = ideal_w + self._avionics_w(hover_w)
        if hover_w < least_w:
            msg = (
                f"{hovering} is less than the {quantity.power(least_w)} of {carrying} without any loss, "
                f"avionics in it: {correct}"
            )
            raise UsageError(msg)
        cost = (hover_w - self._avionics_w(hover_w)) / ideal_w
        if does := hover_impossible(_rounded(cost, 4)):
            msg = f"{hovering} with {carrying} {does}: {correct}"
            raise UsageError(msg)
        usual_w = hover_cost().at(self.propeller_m) * ideal_w
        if hover_w > _COSTLIEST * usual_w:
            times = f"{hover_w / usual_w:.1f} times the {quantity.power(usual_w)}"
            msg = (
                f"{hovering} is {times} that published multicopters take with {carrying}: {correct}"
            )
            raise UsageError(msg)
        if self.battery is None:
            return
        lasts_s = JOULES_PER_WATT_HOUR * self.battery.energy_wh / hover_w
        most_rate = chemistry_of(self.battery).sustained_c_rate
        if most_rate is not None and lasts_s * most_rate < JOULES_PER_WATT_HOUR:
            msg = (
                f"{hovering} empties {quantity.energy(self.battery.energy_wh)} in "
                f"{quantity.duration(lasts_s)}, faster than any battery bears: is the charge in mAh?"
            )
            raise UsageError(msg)

    def _doubt_hover(self, hover_w: float, ideal_w: float) -> None:
        """Say of a figure that it is better than multicopters are, and doubt it by as much.

        The figure or what it is compared with is wrong, nobody knows which: the spread holds both.
        """
        usual_w = hover_cost().at(self.propeller_m) * ideal_w
        if hover_w >= usual_w / _CHEAPEST:
            return
        doubt = math.log(usual_w / hover_w)
        self.fractions["hover"] = max(self.fractions.get("hover", 0.0), doubt)
        self.readings.append(
            f"hovering on {quantity.power(hover_w)} is {quantity.percent(hover_w / usual_w)} of what "
            f"published multicopters take with {self._rotors_text} to carry {quantity.mass(self.mass_kg)}: "
            "taken to be off by as much; check the figure, and log a flight before its energies are relied on"
        )

    def _rotor(self, given: Mapping[str, float]) -> Rotor:
        """Return the rotor of which the hover takes what the quantities say."""
        thrust_n = given["mass"] * GRAVITY_M_S2
        ideal_w = thrust_n * float(
            hover_induced_velocity_m_s(
                thrust_n, SEA_LEVEL_DENSITY_KG_M3, disk_area_m2=given["disk"]
            )
        )
        cost = (given["hover"] - given["avionics"]) / ideal_w
        return Rotor(
            disk_area_m2=given["disk"],
            drag_area_m2=given["drag"],
            induced_factor=cost / (1.0 + given["profile_ratio"]),
            axial_factor=given["axial_factor"],
            profile_factor=cost * given["profile_ratio"] / (1.0 + given["profile_ratio"]),
            profile_speed_factor=given["profile_speed_factor"],
        )

    def _spread(self) -> ModelSpread:
        """Return how far energies may be off: what all states share is that of hover."""
        of = self.fractions
        hover = of.get("hover", 0.0)
        if self.sheet.hover is None:
            # without a figure of the hover its power follows the mass^1.5 and the disk^-0.5 assumed
            hover = math.hypot(hover, 1.5 * of.get("mass", 0.0), 0.5 * of.get("disk", 0.0))
        known = {
            "hover": hover,
            "profile_ratio": of["profile_ratio"],
            "profile_speed_factor": of["profile_speed_factor"],
            "axial_factor": of["axial_factor"],
            "drag_area_m2": of["drag"],
            "disk_area_m2": of.get("disk", 0.0),
        }
        known = {name: round(one, 4) for name, one in known.items() if one}
        energy = energy_fractions(
            self._rotor(self.quantities),
            LawSpread(names=tuple(known), covariance=np.diag(np.square(list(known.values())))),
            mass_kg=self.mass_kg,
            avionics_w=self.quantities["avionics"],
        )
        cost = hover_cost()
        time = "time" if self.sheet.moves_like is None else "moves_like"
        return ModelSpread(
            time_fraction=round(self.priors[time].fraction, 4),
            energy_fraction=round(math.hypot(energy.shared, DAY_FRACTION), 4),
            energy_state_fraction=energy.of_states(),
            position_noise_fraction=round(self.priors["position_noise"].fraction, 4)
            if self._may_be_px4
            else None,
            law_fraction=(*known.items(), *self._resistance_fraction()),
            n_flights=cost.sizes,
            source="no flight: how far the data sheet and what is assumed beside it may be off, by "
            f"{cost.count} published flight times and models/priors",
        )

    def _resistance_fraction(self) -> Iterator[tuple[str, float]]:
        if self.battery is not None:
            yield "internal_resistance_ohm", round(self.fractions["resistance"], 4)

    def model(self) -> VehicleModel:
        """Return the model."""
        sheet, given, priors = self.sheet, self.quantities, self.priors
        spread = self._spread()
        rotor = self._rotor(given)
        like = sheet.moves_like
        noise_m, drag_per_s = 0.0, None
        if like is None:
            noise_m = self._assume("position_noise", priors["position_noise"])
        if self._may_be_px4:
            drag_per_s = self._assume("drag_per_s", priors["drag_per_s"])
        idle = self._assume("ground_idle", priors["ground_idle"])
        valid_for = self._valid_for()
        off = quantity.percent(spread.energy_fraction)
        facts = f"{self.mass_kg:.4g} kg on {self._rotors_text}, from its data sheet"
        return VehicleModel(
            name=sheet.name,
            source=f"{sheet.name}.toml",
            kind="multicopter",
            reference=self.autopilot,
            reference_assumed=self.is_autopilot_assumed,
            description=sheet.description
            or f"{facts}: nobody logged a flight, energies may be off by {off}.",
            mass_kg=self.mass_kg,
            mass_max_kg=sheet.mass_max_kg,
            ceiling_amsl_m=sheet.ceiling_amsl_m,
            wind_max_m_s=sheet.wind_max_m_s,
            thrust_max_n=self.thrust_max_n,
            position_noise_m=noise_m,
            drag_per_s=drag_per_s,
            speed=None if like is None else like.speed,
            ramps=None if like is None else like.ramps,
            hover=None,
            cruise=MomentumLaw(
                **{name: _rounded(value, 4) for name, value in rotor._asdict().items()}
            ),
            loads=Loads(
                avionics_w=_rounded(given["avionics"], 3),
                ground_idle_w=_rounded(idle * given["hover"], 3),
            ),
            battery=self.battery,
            parameters=kept_parameters(self.autopilot, self.parameters) if self.parameters else (),
            valid_for=valid_for,
            spread=spread,
            provenance=Provenance(
                source=sheet.source or "its data sheet",
                basis=Basis.THEORY if sheet.hover is None else Basis.DATA_SHEET,
                method="momentum theory with the hover of the data sheet; no flight",
                date=sheet.date,
                readings=tuple(self.readings),
            ),
        )

    def _valid_for(self) -> ValidFor:
        """Return the box in which theory is held to say something, and the vehicle to lift.

        Nobody flew it: what its maker allows, else what nearly all multicopters lift with control left.
        """
        weight_n, drag_area_m2 = self.mass_kg * GRAVITY_M_S2, self.quantities["drag"]
        leaning_n = weight_n * math.tan(math.radians(_LEAN_DEG))
        leaning_m_s = math.sqrt(leaning_n / (0.5 * SEA_LEVEL_DENSITY_KG_M3 * drag_area_m2))
        induced_m_s = float(
            hover_induced_velocity_m_s(
                weight_n, SEA_LEVEL_DENSITY_KG_M3, disk_area_m2=self.quantities["disk"]
            )
        )
        thrust = self.priors["thrust_ratio"]
        lifted = NO_LEAN_THRUST * thrust.low
        heaviest_kg, thinnest_kg_m3 = self.sheet.mass_max_kg, SEA_LEVEL_DENSITY_KG_M3 / lifted
        if heaviest_kg is None:
            heaviest_kg = _rounded(lifted * self.mass_kg, 3)
            self.readings.append(
                f"highest take-off mass not stated: {heaviest_kg:g} kg, of the {thrust}"
            )
        if self.sheet.ceiling_amsl_m is not None:
            thinnest_kg_m3 = standard_density_kg_m3(self.sheet.ceiling_amsl_m)
        return ValidFor(
            speed_m_s=Interval(low=0.0, high=round(min(leaning_m_s, _FASTEST_M_S), 1)),
            height_above_home_m=_HEIGHT_RANGE,
            climb_rate_m_s=Interval(low=-round(0.5 * induced_m_s, 1), high=round(induced_m_s, 1)),
            mass_kg=Interval(low=_rounded(_LIGHTEST * self.mass_kg, 3), high=heaviest_kg),
            air_density_kg_m3=Interval(low=_rounded(thinnest_kg_m3, 3), high=_DENSEST_KG_M3),
        )


def _rounded(value: float, digits: int) -> float:
    """Return a number of so many digits: more is not known of it."""
    return float(f"{value:.{digits}g}")
