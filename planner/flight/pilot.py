"""Pilots: who flies a route, returns from any point of it, and stops.

A pilot knows how a vehicle moves, the power what that costs.  There is one for each way of commanding:
steps of the reference (the article), PX4, ArduPilot.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.findings import Rule, Severity
from planner.flight.motion.batches import batches_of
from planner.flight.motion.followed_ground import ClimbLimits, follow_ground
from planner.flight.motion.steps import StepLegs, StepSpeeds, fly_step_references
from planner.flight.power import NO_TRANSIENTS
from planner.flight.returns.destination import ReturnTargets
from planner.mission.commands import Command
from planner.mission.route.stage import StageKind
from planner.mission.route.state import VehicleHabits
from planner.physics.response import farthest_stop_s
from planner.units import GRAVITY_M_S2
from planner.values import Value, replace
from planner.vehicle.model import held_drag

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import numpy.typing as npt
    from typing_extensions import TypeIs

    from planner.arrays import FloatArray, IntArray
    from planner.autopilot import Target
    from planner.findings import Finding
    from planner.flight.motion.kinematics import Motion
    from planner.flight.motion.px4.pilot import Px4Pilot
    from planner.flight.power import Transients
    from planner.geo.terrain import TerrainGrid
    from planner.mission.route.stage import Route
    from planner.physics.wind import Wind
    from planner.setup import Setup
    from planner.vehicle.model import Aloft, Responses, VehicleModel
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.files import ParameterSet
    from planner.vehicle.parameters.resolve import FlightParameters
    from planner.vehicle.parameters.table import Version

NOISE_ASSUMED = Rule(
    "T109 position-noise-assumed",
    Severity.INFO,
    summary="The noise of the vehicle's position was taken from its model.",
    why="PX4 slows its trajectory down while the vehicle is off it: flights of one vehicle took up to "
    "6 % longer with a noisy position than with a quiet one, and wandered 0.2 m/s in a hover.",
    how="With e the mean horizontal error in a hover, E = MPC_XY_ERR_MAX and P = MPC_XY_P time passes "
    "by e/2E more slowly in climbs and descents, by (e/2E)/(1 + v/v0), v0 = 2PE/π, at a speed v, and "
    "by e/E in a landing once it hovers over its place at home; speeding up after a turn takes up to "
    "0.1 s ln((PE + v2)/(PE + v1)) longer.  The distance includes 0.7 P e a second of wandering "
    "(totals.wander_m).",
    fix="give the mean position error of a hover from a log of the vehicle with --position-noise",
)


_CONTINUE_AFTER_LAND, _KEEP_COUNTS = 4, 8
"""Bits of ArduPilot's MIS_OPTIONS."""
_COUNTS_ANEW = (4, 7)
"""The version of ArduCopter from which on a jump counts anew (ArduPilot #29763)."""
_AS_FLOWN = (4, 7)
"""The version of ArduCopter whose circles go by CIRCLE_RATE alone, and whose landings at a place by its
altitude; later ones are not known."""
_BISECTIONS = 60
_FENCE_NAMES = ("FENCE_", "GF_")
"""How ArduPilot's and PX4's parameters of a fence begin."""


class Pilot(Protocol):
    """Who flies."""

    def fly(self, route: Route) -> tuple[Motion, Transients]:
        """Return the motion along a route of at least one stage, and its power transients."""
        ...

    def fly_all(self, routes: Sequence[Route]) -> Iterator[tuple[Motion, Transients]]:
        """Yield the flights along routes, as many as can be in one motion, one after the other.

        The item of a segment is the position of its route.  Hundreds of short flights take little more
        time than one: what a motion takes beside its rows is paid once.
        """
        ...

    def fly_returns(
        self, points_m: FloatArray, targets: ReturnTargets, route: Route
    ) -> tuple[Motion, Transients]:
        """Return the returns from points (n, 3) [m] where it stands still, one after the other.

        The item of a segment is the position of its point.
        """
        ...

    def return_heights_m(self, points_m: FloatArray, targets: ReturnTargets) -> FloatArray:
        """Return the heights above the first home at which returns are flown. (n,) [m]"""
        ...

    def stop(self, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distance and time to stand still, from ground speeds. (n,) [m], (n,) [s]"""
        ...

    def farthest_stop_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far stops get, from ground speeds, before the vehicle swings back. (n,) [m]"""
        ...


CONDITION_NOT_MODELLED = Rule(
    "E108 condition-not-modelled",
    Severity.WARNING,
    summary="A condition was given that this vehicle model does not model.",
    why="Users test an estimator by changing payload or wind and watching the answer (bluerobotics "
    "cockpit #2159).  Where the answer cannot change, the user has to know.",
    how="Wind needs a model with an airspeed term, payload one with a mass, temperature and "
    "pressure a hover law over air density; the age and temperature of a battery need its resistance and "
    "curves.  A payload that is not counted is an error: the flight takes more than predicted.  An unknown "
    "resistance above that of a new battery adds to that of cells of 0.05 ohm for 1 Ah (9 of 10 have less): "
    "an error where that takes the margin, or a cell below its cut-off at the reserve.  Wind, and air at "
    "least 1.1 times thinner than at sea level, are "
    "an error where what they may take is more than the margin of the flight or of the "
    "tightest return: power grows from the ground speed to the airspeed as a recorded survey quadrotor's "
    "(298 W at 8 m/s, 482 W at 15 m/s, the highest identified; with the cube beyond, or the time of flying "
    "no faster than that), and with 1/√density; of an uncertain wind at two standard deviations.  A "
    "step-response model flies the level speeds that a parameter file states; "
    "climbs and descents that are more than 3 % slower than predicted, by it or by the mission, ways and "
    "circles its autopilot takes more than 3 % longer for, by its own laws in calm air (without a file "
    "circles as ArduPilot alone flies them, as it is delivered), and the heights below which landings are "
    "slow cost the longer time at hover power, with what is not counted over it too, an error where that "
    "takes the flight or a return below the reserve.  A file whose names do not say which autopilot it is "
    "of is an error.",
    fix="use a vehicle model that has the missing quantity",
    instead="a model that counts it with --vehicle",
)


def flight_parameters(
    setup: Setup, *, version: Version | None = None, has_rally: bool = True
) -> tuple[FlightParameters | None, list[Finding]]:
    """Return the parameters an autopilot flies with, none for reference steps, and their findings.

    ``version`` is that of the firmware they are for; by default the one they name.  Without rally points
    parameters about them have no finding.

    Raises
    ------
    UsageError
        If the model cannot be flown this way.
    """
    vehicle, flown_by, given = setup.vehicle, setup.flown_by, setup.parameters
    if (flown_by is Autopilot.STEP) is not (vehicle.reference is Autopilot.STEP):
        msg = (
            f"{vehicle.name} answers {vehicle.reference.label}; "
            f"it cannot be flown as {flown_by.label}: give --vehicle a model that is"
        )
        raise UsageError(msg)
    if flown_by is not Autopilot.STEP:
        from planner.vehicle.parameters.resolve import resolve_parameters

        resolved = resolve_parameters(
            flown_by, file=given, model=vehicle, version=version, has_rally=has_rally
        )
        return resolved.values, list(resolved.findings)
    if given is None:
        return None, []
    unused = CONDITION_NOT_MODELLED.finding(
        f"{given.source}: accelerations and corners do not shape the flight: {vehicle.name} answers step "
        "references; its level speeds are flown, what else its autopilot takes longer is counted, returns "
        "are flown at their heights, failsafes and fence judged",
        fix="use a vehicle model that is flown by that autopilot",
    )
    return None, [unused]


def own_parameters_of(
    given: ParameterSet, target: Target | None, *, has_rally: bool
) -> tuple[FlightParameters | None, list[Finding]]:
    """Return what a parameter file says of a vehicle of reference steps, and findings.

    Fence, returns, failsafes and arming need no pilot: they are those of the autopilot the file is of,
    else of the one the mission is for; where neither is known, nothing of it can be judged.
    """
    from planner.vehicle.parameters.resolve import resolve_parameters

    autopilot = given.stack or (None if target is None else target.autopilot)
    if autopilot is None:
        unknown = CONDITION_NOT_MODELLED.finding(
            f"{given.source} may be of PX4 or of ArduPilot: its fence, returns and failsafes are not judged",
            severity=Severity.ERROR,
            fix="give a parameter file of one autopilot, or say with --target whose it is",
        )
        return None, [unknown]
    is_asked = target is not None and target.autopilot is autopilot
    version = target.version if target is not None and is_asked else given.version
    resolved = resolve_parameters(autopilot, file=given, version=version, has_rally=has_rally)
    # What is assumed of flight is not flown.
    reported = [one for one in resolved.findings if one.severity > Severity.INFO]
    return resolved.values, reported


def is_of_ardupilot(parameters: FlightParameters | None) -> TypeIs[ArduPilotParameters]:
    """Return whether parameters are those of ArduPilot."""
    if parameters is None:
        return False  # nothing of an autopilot is imported
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

    return isinstance(parameters, ArduPilotParameters)


def habits_of(parameters: FlightParameters | None, target: Target | None) -> VehicleHabits:
    """Return how a vehicle carries out items, by its parameters and the version it runs."""
    habits = VehicleHabits(
        continues_after=_continues_after(parameters),
        payload_waits_s=_payload_waits_s(parameters),
        keeps_counts=_keeps_jump_counts(parameters, target),
        circles_by_rate=is_4_7(target),
        lands_by_altitude=is_4_7(target),
    )
    if parameters is None:
        return habits
    if not is_of_ardupilot(parameters):
        return replace(habits, looks_from_m=parameters.acceptance_radius_m)
    return replace(
        habits,
        turn_deg_s=math.degrees(parameters.yaw_rate_rad_s),
        circle_radius_m=parameters.circle_radius_m,
        circles_clockwise=parameters.circle_rate_rad_s >= 0.0,
        waypoint_radius_m=parameters.waypoint_radius_m,
        climb_speed_m_s=parameters.climb_speed_m_s,
        descent_speed_m_s=parameters.descent_speed_m_s,
    )


def is_4_7(target: Target | None) -> bool | None:
    """Return whether circles and landings are flown as by 4.7; ``None``: not known, nor of later ones."""
    if target is None or target.version is None or target.version > _AS_FLOWN:
        return None
    return target.version == _AS_FLOWN


def _continues_after(parameters: FlightParameters | None) -> frozenset[StageKind] | None:
    """Return after what landings a mission goes on; ``None``: as the autopilot is delivered."""
    if not is_of_ardupilot(parameters):
        return None
    lands = set()
    if parameters.mission_options & _CONTINUE_AFTER_LAND:
        lands.add(StageKind.LAND)
    if parameters.return_final_altitude_m <= 0.0:
        lands.add(StageKind.RETURN)
    return frozenset(lands)


def _keeps_jump_counts(parameters: FlightParameters | None, target: Target | None) -> bool | None:
    """Return whether ArduPilot keeps the count of a jump that was counted to its end; ``None``: not known."""
    if target is not None and target.version is not None and target.version < _COUNTS_ANEW:
        return True
    if is_of_ardupilot(parameters) and parameters.mission_options & _KEEP_COUNTS:
        return True
    return None if target is None or target.version is None else False


def _payload_waits_s(parameters: FlightParameters | None) -> Mapping[int, float]:
    """Return how long an autopilot waits at items of what a vehicle carries, by their command. [s]

    Notes
    -----
    PX4's ``MissionBlock::item_has_timeout`` and ``is_mission_item_reached_or_completed``: as long as
    MIS_COMMAND_TOUT says, before 1.16 until the gripper has answered but no longer than MIS_PD_TO.
    """
    if parameters is None:
        return {}
    from planner.vehicle.parameters.px4 import DEPLOYMENT_WAIT, Px4Parameters

    if not isinstance(parameters, Px4Parameters):
        return {}
    origin = parameters.origins.get("payload_wait_s")
    waiting = [Command.DO_GRIPPER, Command.DO_WINCH]
    if origin is None or origin.name != DEPLOYMENT_WAIT:
        waiting.append(Command.DO_GIMBAL_MANAGER_PITCHYAW)
    return dict.fromkeys(waiting, parameters.payload_wait_s)


def make_pilot(
    setup: Setup, parameters: FlightParameters | None
) -> StepPilot | ArduPilotPilot | Px4Pilot:
    """Return who flies a vehicle: an autopilot with its parameters, else steps of the reference.

    Of steps the parameters, where they are known, set how high returns are flown and where they wait.
    """
    vehicle = setup.vehicle
    if parameters is None or setup.flown_by is Autopilot.STEP:
        return StepPilot(vehicle=vehicle, parameters=parameters, terrain=setup.terrain)
    from planner.vehicle.parameters.px4 import Px4Parameters

    aloft = setup.aloft
    limit_m_s = airspeed_limit_m_s(vehicle, parameters, aloft)
    if isinstance(parameters, Px4Parameters):
        given_m = setup.position_noise_m
        noise_m = vehicle.position_noise_m if given_m is None else given_m
        if noise_m >= parameters.position_error_max_m:
            msg = (
                f"position noise must be below MPC_XY_ERR_MAX "
                f"({parameters.position_error_max_m:g} m), got {noise_m:g} m: PX4 would stand still"
            )
            raise UsageError(msg)
        from planner.flight.motion.px4.pilot import Px4Pilot

        own_per_s = vehicle.drag_per_s
        return Px4Pilot(
            parameters=parameters,
            wind=setup.wind,
            airspeed_limit_m_s=limit_m_s,
            noise_m=noise_m,
            drag_per_s=None if own_per_s is None else own_per_s / aloft.times_heavier,
            heading_rad=None if setup.heading_deg is None else math.radians(setup.heading_deg),
        )
    return ArduPilotPilot(
        parameters=parameters,
        wind=setup.wind,
        airspeed_limit_m_s=limit_m_s,
        responses=vehicle.responses,
        terrain=setup.terrain,
    )


def make_own_pilot(
    vehicle: VehicleModel, parameters: FlightParameters, *, terrain: TerrainGrid | None
) -> ArduPilotPilot | Px4Pilot:
    """Return who flies a vehicle of reference steps by the laws of its own autopilot, in calm air.

    At the speeds that its parameters state, else at its model's; without the lag, of which the model knows
    nothing.
    """
    from planner.physics.wind import Wind
    from planner.vehicle.parameters.px4 import Px4Parameters

    calm, speeds = Wind(), step_speeds_m_s(vehicle, parameters)
    own = replace(parameters, cruise_speed_m_s=speeds.own_m_s)
    if isinstance(own, Px4Parameters):
        from planner.flight.motion.px4.pilot import Px4Pilot

        return Px4Pilot(parameters=own, wind=calm)
    own = replace(own, return_speed_m_s=speeds.returning_m_s)
    return ArduPilotPilot(parameters=own, wind=calm, airspeed_limit_m_s=None, terrain=terrain)


def make_queue_pilots(
    setup: Setup, own_parameters: FlightParameters | None, target: Target | None
) -> tuple[Pilot, ...]:
    """Return by whose times the queue of a mission may go on, the first as predicted.

    Of a vehicle of reference steps by those of its own autopilot, where it is known; else by the model's or
    by those of ArduPilot as it is delivered, which alone has a queue.
    """
    if setup.flown_by is not Autopilot.STEP:
        return (make_pilot(setup, own_parameters),)
    vehicle, terrain = setup.vehicle, setup.terrain
    if own_parameters is not None:
        return (make_own_pilot(vehicle, own_parameters, terrain=terrain),)
    from planner.vehicle.parameters.resolve import resolve_parameters

    version = None if target is None else target.version
    delivered = resolve_parameters(Autopilot.ARDUPILOT, version=version).values
    return make_pilot(setup, None), make_own_pilot(vehicle, delivered, terrain=terrain)


def step_speeds_m_s(vehicle: VehicleModel, parameters: FlightParameters | None) -> StepSpeeds:
    """Return the level speeds of a vehicle of reference steps: those that are stated, else its model's.

    MPC_XY_VEL_MAX limits commanded ones too.
    """

    def stated_m_s(name: str, else_m_s: float) -> float:
        origin = None if parameters is None else parameters.origins.get(name)
        is_stated = origin is not None and origin.is_file
        return float(getattr(parameters, name)) if is_stated else else_m_s

    most_m_s = stated_m_s("speed_max_m_s", math.inf)
    model_m_s = vehicle.default_speed_m_s or math.inf  # a model of steps has one
    own_m_s = min(stated_m_s("cruise_speed_m_s", model_m_s), most_m_s)
    back_m_s = stated_m_s("return_speed_m_s", own_m_s)
    # RTL_SPEED 0 stands for the speed of missions.
    if back_m_s == getattr(parameters, "cruise_speed_m_s", None):
        back_m_s = own_m_s
    return StepSpeeds(own_m_s=own_m_s, returning_m_s=back_m_s, commanded_m_s=most_m_s)


RATED_WIND = 0.7
"""The most wind over the highest speed: makers rate their vehicles for 0.50 to 0.67. [-]"""


def airspeed_limit_m_s(
    vehicle: VehicleModel,
    parameters: FlightParameters | None,
    aloft: Aloft,
    *,
    is_certain: bool = False,
) -> float | None:
    """Return the highest airspeed of a vehicle with these parameters; ``None``: not known. [m s⁻¹]

    What is heavier leans less against the same drag.  Certain is of more lean and weight what drag by the
    square of the airspeed leaves.

    Where the model does not say at which lean angle it was held, that was the limit of the model's own
    parameters, or the autopilot's default.  A lower limit leaves less: by tan(θ), as drag that grows with
    the airspeed has it, which is the least of what is possible; a higher one is not known to give more.
    """
    lean_rad = None if parameters is None else parameters.lean_angle_max_rad
    limit_m_s = vehicle.airspeed_limit_at(lean_rad, aloft, is_certain=is_certain)
    if limit_m_s is None or parameters is None or vehicle.airspeed_limit_lean_deg is not None:
        return limit_m_s
    return limit_m_s * _fraction_left(vehicle, parameters, aloft.times_heavier)


_STEEPEST_DELIVERED_RAD = math.radians(45.0)
"""MPC_TILTMAX_AIR: the steepest lean that autopilots are delivered with. [rad]"""


def limit_lean_rad(vehicle: VehicleModel, parameters: FlightParameters | None) -> float:
    """Return the lean angle at which a vehicle with these parameters holds `airspeed_limit_m_s`. [rad]

    Where neither parameters nor the model say so, the steepest that autopilots are delivered with: the more
    it leans there, the less wind it holds in a descent.
    """
    held_deg = vehicle.airspeed_limit_lean_deg
    if parameters is None:
        return _STEEPEST_DELIVERED_RAD if held_deg is None else math.radians(held_deg)
    if held_deg is not None:
        return parameters.lean_angle_max_rad
    return min(parameters.lean_angle_max_rad, _held_lean_rad(vehicle, type(parameters)))


def shown_airspeed_m_s(
    vehicle: VehicleModel, parameters: FlightParameters | None, aloft: Aloft
) -> float | None:
    """Return the highest airspeed flights of a model show a vehicle with these parameters to hold. [m s⁻¹]

    Its limit where the model has one, as far as that is certain, else what it was identified at, or flies
    at least where its maker allows a wind: that over `RATED_WIND`.  Less what a lower lean angle takes: as
    above, or as the drag has it that the model gives.  ``None``: the model shows none.
    """
    limit_m_s = airspeed_limit_m_s(vehicle, parameters, aloft, is_certain=True)
    identified = vehicle.valid_for.speed_m_s
    if limit_m_s is not None or identified is None:
        return limit_m_s
    flown_m_s = max(identified.high, (vehicle.wind_max_m_s or 0.0) / RATED_WIND)
    if parameters is None:
        return flown_m_s
    if vehicle.drag_per_s:
        lighter = min(aloft.times_heavier, 1.0)  # that much more for weight is not certain
        lean_m_s2 = GRAVITY_M_S2 * held_drag(parameters.lean_angle_max_rad, lighter)
        return min(flown_m_s, lean_m_s2 / vehicle.drag_per_s)
    return flown_m_s * _fraction_left(vehicle, parameters, aloft.times_heavier)


def _fraction_left(
    vehicle: VehicleModel, parameters: FlightParameters, times_heavier: float
) -> float:
    """Return what is left of an airspeed under another limit of the lean than that of the model, at least."""
    held_rad = _held_lean_rad(vehicle, type(parameters))
    return min(held_drag(parameters.lean_angle_max_rad, times_heavier) / math.tan(held_rad), 1.0)


@lru_cache(maxsize=8)  # rules ask for it again and again
def _held_lean_rad(vehicle: VehicleModel, kind: type[FlightParameters]) -> float:
    """Return the limit of the lean by the model's own parameters, or the autopilot's default. [rad]"""
    from planner.vehicle.parameters.resolve import PARAMETERS_OF, resolve_parameters

    autopilot = next(own for own, theirs in PARAMETERS_OF.items() if theirs is kind)
    return resolve_parameters(autopilot, model=vehicle).values.lean_angle_max_rad


_CLIMBS_M_S, _DESCENDS_M_S = 2.5, 1.5
"""WPNAV_SPEED_UP and WPNAV_SPEED_DN as ArduPilot is delivered: it alone follows the ground. [m s⁻¹]"""


def _numbered(motion: Motion, item: IntArray) -> Motion:
    return replace(motion, segments=replace(motion.segments, item=item))


def _one_by_one(pilot: Pilot, routes: Sequence[Route]) -> Iterator[tuple[Motion, Transients]]:
    """Yield flights along routes each as a motion of its own; its items are its position."""
    for position, route in enumerate(routes):
        motion, transients = pilot.fly(route)
        yield _numbered(motion, np.full_like(motion.segments.item, position)), transients


class StepPilot(Value):
    """Answers steps of the reference with the identified responses, the article's way, or ramps."""

    vehicle: VehicleModel
    parameters: FlightParameters | None = None
    """Those of the vehicle itself; ``None``: returns are flown level."""
    terrain: TerrainGrid | None = None

    def fly(self, route: Route) -> tuple[Motion, Transients]:
        """Return the motion along a route and its power transients."""
        legs = StepLegs.of(
            route.stages,
            speeds=self.speeds,
            over_home=self._over_home(route),
            set_down_s=getattr(self.parameters, "place_delay_s", 0.0),
        )
        motion, transients = self._along(legs)
        limits = ClimbLimits(
            cruise_m_s=self.speeds.own_m_s,
            climb_m_s=getattr(self.parameters, "climb_speed_m_s", _CLIMBS_M_S),
            descent_m_s=getattr(self.parameters, "descent_speed_m_s", _DESCENDS_M_S),
        )
        motion = follow_ground(motion, route, self.terrain, limits)
        if self.parameters is None and route.return_height_m is None:
            motion = replace(motion, findings=(*motion.findings, *_return_heights(route)))
        return motion, transients

    def fly_all(self, routes: Sequence[Route]) -> Iterator[tuple[Motion, Transients]]:
        """Yield the flights along routes, one by one."""
        return _one_by_one(self, routes)

    def fly_returns(
        self, points_m: FloatArray, targets: ReturnTargets, _route: Route
    ) -> tuple[Motion, Transients]:
        """Return level legs home at the height of returns, and landings there."""
        over_home = None
        if self.parameters is not None or targets.stated_height_m is not None:
            wait_s = 0.0 if self.parameters is None else _return_wait_s(self.parameters)
            over_home = self.return_heights_m(points_m, targets), wait_s
        legs = StepLegs.home_from(
            points_m, targets.ground_m, speed_m_s=self.speeds.returning_m_s, over_home=over_home
        )
        return self._along(legs)

    def _over_home(self, route: Route) -> tuple[FloatArray, float] | None:
        """Return the heights of a route's own returns and their wait, where they are known. [m], [s]"""
        returns = route.return_spans
        if self.parameters is None or not returns:
            return None
        places_m = np.array(
            [(0.0, 0.0, 0.0), *((s.east_m, s.north_m, s.height_m) for s in route.stages)]
        )
        first, last = np.array(returns).T
        stages = [route.stages[row] for row in last]
        targets = ReturnTargets(
            ground_m=places_m[1:][last],
            above_ground_m=np.array([one.above_ground_m for one in stages]),
            datum_m=np.array([one.datum_m for one in stages]),
            return_ceiling_m=np.array([one.return_ceiling_m for one in stages], np.float64),
        )
        heights_m = self.return_heights_m(places_m[first], targets)
        return np.repeat(heights_m, last - first + 1), _return_wait_s(self.parameters)

    def _along(self, legs: StepLegs) -> tuple[Motion, Transients]:
        if self.vehicle.ramps is None:
            return fly_step_references(legs, self.vehicle.responses)
        from planner.flight.motion.ramps import fly_ramps

        return fly_ramps(legs, self.vehicle.ramps), NO_TRANSIENTS

    def return_heights_m(self, points_m: FloatArray, targets: ReturnTargets) -> FloatArray:
        """Return the heights of the vehicle's own rule, else at least what the mission states."""
        if self.parameters is None:
            stated_m = targets.stated_height_m
            least_m = -np.inf if stated_m is None else targets.datum_m + stated_m
            return np.maximum(points_m[:, 2], least_m)
        return _return_heights_m(points_m, targets, self.parameters)

    def stop(self, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how the identified response of the speed goes on after a step to zero.

        Its area is the distance; the time grows with the speed, up to twice the residence time.  Ramps
        brake at their own rate.
        """
        if (ramps := self.vehicle.ramps) is not None:
            return self.farthest_stop_m(speed_m_s), speed_m_s / ramps.braking_m_s2
        residence_s = _residence_s(self.vehicle)
        full_m_s = self.vehicle.default_speed_m_s or math.inf
        fraction = np.minimum(speed_m_s / full_m_s, 1.0)
        return speed_m_s * residence_s, 2.0 * residence_s * fraction

    def farthest_stop_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the way up to where the response of the speed first passes zero.

        An underdamped response swings back from there to where `stop` has it stand.
        """
        return _farthest_step_stop_m(self.vehicle, speed_m_s)

    @property
    def speeds(self) -> StepSpeeds:
        """Level speeds it flies at."""
        return step_speeds_m_s(self.vehicle, self.parameters)


class ArduPilotPilot(Value):
    """ArduPilot's Copter with the vehicle's parameters."""

    parameters: ArduPilotParameters
    wind: Wind
    airspeed_limit_m_s: float | None
    """Airspeed at the greatest lean angle; ``None``: not known. [m s⁻¹]"""
    responses: Responses | None = None
    """How the vehicle follows the references; ``None``: without any lag."""
    terrain: TerrainGrid | None = None
    """What is followed; ``None``: not known."""

    def fly(self, route: Route) -> tuple[Motion, Transients]:
        """Return the motion along a route; ArduPilot shapes its references, so nothing rings."""
        from planner.flight.motion.ardupilot.pilot import fly_ardupilot

        motion = fly_ardupilot(
            route.stages,
            self.parameters,
            wind=self.wind,
            airspeed_limit_m_s=self.airspeed_limit_m_s,
            home_latitude_deg=route.frame.latitude_deg,
            responses=self.responses,
        )
        limits = ClimbLimits(
            cruise_m_s=self.parameters.cruise_speed_m_s,
            climb_m_s=self.parameters.climb_speed_m_s,
            descent_m_s=self.parameters.descent_speed_m_s,
        )
        return follow_ground(motion, route, self.terrain, limits), NO_TRANSIENTS

    def fly_all(self, routes: Sequence[Route]) -> Iterator[tuple[Motion, Transients]]:
        """Yield the flights along routes, many at once where they follow no ground that is known."""
        from planner.flight.motion.ardupilot.pilot import fly_ardupilot_flights

        if self.terrain is not None:
            yield from _one_by_one(self, routes)
            return
        for first, some in batches_of(routes):
            motion = fly_ardupilot_flights(
                [route.stages for route in some],
                self.parameters,
                wind=self.wind,
                airspeed_limit_m_s=self.airspeed_limit_m_s,
                home_latitude_deg=some[0].frame.latitude_deg,
                responses=self.responses,
            )
            yield _numbered(motion, motion.segments.item + first), NO_TRANSIENTS

    def fly_returns(
        self, points_m: FloatArray, targets: ReturnTargets, route: Route
    ) -> tuple[Motion, Transients]:
        """Return the returns (RTL) from each point."""
        from planner.flight.motion.ardupilot.pilot import ardupilot_returns

        motion = ardupilot_returns(
            points_m,
            targets,
            self.parameters,
            wind=self.wind,
            airspeed_limit_m_s=self.airspeed_limit_m_s,
            home_latitude_deg=route.frame.latitude_deg,
            responses=self.responses,
        )
        return motion, NO_TRANSIENTS

    def return_heights_m(self, points_m: FloatArray, targets: ReturnTargets) -> FloatArray:
        """Return the heights of RTL_ALT, RTL_CLIMB_MIN and the cone of RTL_CONE_SLOPE."""
        return _return_heights_m(points_m, targets, self.parameters)

    def stop(self, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the distance an S-curve brakes by, and its time."""
        from planner.flight.motion.ardupilot.legs import stopping_distance_m

        speed_response = None if self.responses is None else self.responses.speed
        way_m = stopping_distance_m(speed_m_s, self.parameters, speed_response)
        zero = np.zeros_like(way_m)  # braking it has half the speed on average
        return way_m, np.divide(2.0 * way_m, speed_m_s, out=zero, where=speed_m_s > 0.0)

    def farthest_stop_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the whole way of an S-curve's braking, from its command on, and that of the lag."""
        from planner.flight.motion.ardupilot.legs import braking_distance_m

        lag_s = 0.0
        if self.responses is not None and self.responses.speed is not None:
            lag_s = self.responses.speed.transfer_function.mean_residence_time_s
        return braking_distance_m(speed_m_s, self.parameters) + lag_s * speed_m_s


def _return_heights_m(
    points_m: FloatArray, targets: ReturnTargets, parameters: FlightParameters
) -> FloatArray:
    """Return the heights above home at which an autopilot returns from points (n, 3). (n,) [m]"""
    from planner.vehicle.parameters.px4 import Px4Parameters

    if not isinstance(parameters, Px4Parameters):
        from planner.flight.motion.ardupilot.stages import return_height_m

        place_m = targets.ground_m.copy()
        place_m[:, 2] += targets.above_ground_m
        return return_height_m(
            points_m, place_m, targets.datum_m, targets.return_ceiling_m, parameters
        )
    from planner.flight.motion.px4.moves import heights_of_returns_m

    return heights_of_returns_m(points_m, targets, parameters)


def _return_wait_s(parameters: FlightParameters) -> float:
    """Return how long an autopilot waits over the place a return leads to. [s]"""
    from planner.vehicle.parameters.px4 import Px4Parameters

    if isinstance(parameters, Px4Parameters):
        return max(parameters.return_land_delay_s, 0.0)
    from planner.flight.motion.ardupilot.stages import return_wait_s

    return return_wait_s(parameters)


RETURN_HEIGHT_ASSUMED = Rule(
    "T112 return-height-assumed",
    Severity.INFO,
    summary="The return altitude is unknown: the return is predicted at the height it begins at.",
    why="Autopilots climb to a height of their own before they return; a climb that is not counted "
    "takes energy that is missing later.",
    how="The mission ends in RETURN_TO_LAUNCH, the model is a step-response model and neither parameters "
    "(RTL_RETURN_ALT, RTL_ALT) nor the file (globalRTHHeight of DJI's WPML) give one; returns from anywhere "
    "are predicted level as well.",
    fix="give the vehicle's parameters with --params, or add a waypoint at the height of the return",
)


def _return_heights(route: Route) -> Iterator[Finding]:
    """Yield that the return of a route is flown level, if it has one."""
    for row in route.rows_of(StageKind.RETURN)[:1]:
        height = quantity.height(route.stages[row - 1].height_m if row else 0.0)
        message = f"return altitude unknown: {height} above home assumed"
        yield RETURN_HEIGHT_ASSUMED.finding(message, item=route.stages[row].item)


def _residence_s(vehicle: VehicleModel) -> float:
    """Return the mean residence time of the response of the speed; 0 where there is none. [s]"""
    response = vehicle.responses.speed
    return 0.0 if response is None else response.transfer_function.mean_residence_time_s


def _farthest_step_stop_m(vehicle: VehicleModel, speed_m_s: FloatArray) -> FloatArray:
    """Return the way up to where a vehicle that answers steps first stands, or turns back."""
    if vehicle.ramps is not None:
        return 0.5 * speed_m_s**2 / vehicle.ramps.braking_m_s2
    response = vehicle.responses.speed
    return speed_m_s * (0.0 if response is None else farthest_stop_s(response.transfer_function))


_OVERSHOOT_S2_M = 0.0115
"""Of the square of the speed, as `StopRoom.overshoot_m` has it. [s²/m]"""


class StopRoom(Value):
    """The room a vehicle needs straight ahead to react, and to stop.

    v t_r + s(v) + max(w, 0) t_r: the distance until somebody or something reacts, the farthest it gets
    from then on, and what the part w of the wind that blows ahead carries it meanwhile.
    """

    vehicle: VehicleModel
    parameters: FlightParameters | None
    """``None``: the vehicle answers reference steps."""
    reaction_time_s: float

    def farthest_stop_m(self, speed_m_s: npt.ArrayLike) -> FloatArray:
        """Return how far a stop from ground speeds gets: s(v); what overshoots ends before it. [m]"""
        speed = np.asarray(speed_m_s, np.float64)
        if self.parameters is None:
            return np.asarray(_farthest_step_stop_m(self.vehicle, speed))
        from planner.vehicle.parameters.px4 import Px4Parameters

        if isinstance(self.parameters, Px4Parameters):
            from planner.flight.motion.px4.braking import stopping_distance_m as px4_way_m

            return px4_way_m(speed, self.parameters, self.vehicle.drag_per_s)
        from planner.flight.motion.ardupilot.legs import stopping_distance_m as ardupilot_way_m

        # What answers steps says nothing of the lag behind shaped references.
        is_shaped = self.vehicle.reference is Autopilot.ARDUPILOT
        response = self.vehicle.responses.speed if is_shaped else None
        return ardupilot_way_m(speed, self.parameters, response)

    def overshoot_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far a leg flown at speeds is carried beyond the place it stops at. [m]

        ArduPilot's position controller: flown by builds 1.0 m from 10 m/s, 1.9 m from 13 m/s and 2.4 m from
        15 m/s, whatever the acceleration.  PX4 comes to rest 1.2 m before; steps have it in their response.
        """
        if not is_of_ardupilot(self.parameters):
            return np.zeros_like(speed_m_s)
        return _OVERSHOOT_S2_M * speed_m_s**2

    def needed_m(self, speed_m_s: npt.ArrayLike, tail_wind_m_s: npt.ArrayLike = 0.0) -> FloatArray:
        """Return the room needed straight ahead, from ground speeds in a tail wind. [m]

        Wind against the flight helps nothing.
        """
        speed = np.asarray(speed_m_s, np.float64)
        drift = np.maximum(np.asarray(tail_wind_m_s, np.float64), 0.0)
        return (speed + drift) * self.reaction_time_s + self.farthest_stop_m(speed)

    def fitting_speed_m_s(
        self, room_m: float, *, at_most_m_s: float, tail_wind_m_s: float = 0.0
    ) -> float | None:
        """Return the highest speed below one that fits into a room. [m s⁻¹]

        By bisection; ``None`` where there is not even room for the drift.
        """
        if self.needed_m(0.0, tail_wind_m_s) > room_m:
            return None
        low, high = 0.0, at_most_m_s
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            fits = self.needed_m(middle, tail_wind_m_s) <= room_m
            low, high = (middle, high) if fits else (low, middle)
        return low
