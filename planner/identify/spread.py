r"""How far whole flights were from predictions.

Times.  A leg i of flight f takes longer than predicted by

.. math:: d_{fi} = \tau_f p_{fi} + \lambda_{fi},

p its predicted time, τ common to the flight, λ of each leg with its turn or stop; a landing by
:math:`\tau_f p + \delta_f`.  What legs of one flight have in common, by least absolute errors, is taken
from them to tell λ; τ and δ are what whole flights and their landings show beyond that.  Where an item is
said to be done is up to the log: of what one leg loses to the next nothing is left in a whole flight.

Energies.  With the relative error of the energy of all states of one kind k (climbing, level, descending)

.. math:: r_{fk} = \varepsilon_f + w_f \beta_f + \eta_{fk},

the part common to a flight, that which grows with the wind w it was predicted in, and that of each kind are
told apart.  The deviation of a kind from its whole flight holds no common part.  Flights are cut where both
the flown and the predicted one begin an item of the mission, and the energy of an item is divided as the
prediction divides it: where a flight is cut otherwise, what one state loses another gains.

Errors count from zero, so that a bias is part of the spread: the next flight meets it as well.  They are
those of the whole model, fitted to the same flights, and are raised as residuals of p parameters are:
the next flight is off by :math:`\sqrt{(1 + p/n) \sum e^2 / (n - p)}`; p, the sum of the leverages, follows
from how much larger the errors become when each flight is left out: :math:`e_{(f)} = e_f / (1 - h_f)`.

Variances are the likeliest of normal errors and of what is known of all flights beforehand
(`planner.vehicle.repeatability`).  A scale is known by its ratio: its logarithm is taken to be Cauchy
distributed about the one known, as widely as one error would tell it, so that what is known counts as one
error more at most, and hardly where flights say something very different (A. O'Hagan, J. R. Stat. Soc. B 41
(1979) 358).  Of nine flights or more all variances are scaled such that the interval of 80 % reaches to the
error of that rank.
"""

from __future__ import annotations

import contextlib
import math
from collections import defaultdict
from itertools import compress, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import IdentificationError, MavjouleError
from planner.flight.motion.kinematics import STATES, FlightState
from planner.flight.uncertainty import HIGH, LOW, kind_of
from planner.identify.flown_mission import lift_off
from planner.identify.power import (
    identify_power,
    manoeuvre_powers,
    power_of_manoeuvres,
    predicted_powers_w,
)
from planner.identify.ramps import durations_s, fit_ramps, timed_flight
from planner.identify.segments import (
    climb_rate_m_s,
    find_states,
    flown_acceleration,
    record_air_density_kg_m3,
    speed_through_air_m_s,
)
from planner.identify.verification import KnownConditions, begun_in_both, verify_flight
from planner.physics.rotor import Acceleration
from planner.values import Value, field, replace
from planner.vehicle.model import ModelSpread
from planner.vehicle.power import WholeLaw, whole_power_w
from planner.vehicle.priors import multicopter_priors
from planner.vehicle.repeatability import ENERGY_FRACTION, REPEATABILITY, WIND_ENERGY_FRACTION_S_M

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.identify.assembly import IdentificationSettings
    from planner.identify.power import PowerIdentification
    from planner.identify.ramps import TimedFlight
    from planner.identify.segments import MeasuredPower
    from planner.identify.verification import Verification
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import Ramps, VehicleModel
    from planner.vehicle.repeatability import Repeatability


class FlownAndPredicted(Value):
    """One flight and its prediction, from lift-off on."""

    legs_s: Sequence[tuple[float, float]] = ()
    """How long each leg took, and was predicted to take. [s]"""
    landing_s: tuple[float, float] | None = None
    """The same of what follows, with the landing. [s]"""
    flown_energy_j: Mapping[FlightState, float] = field(default_factory=dict)
    """By the kind of the state; empty where the power was not recorded. [J]"""
    predicted_energy_j: Mapping[FlightState, float] = field(default_factory=dict)
    """Of the same kinds. [J]"""
    flown_stops_m: Sequence[float] = ()
    """Stopping distances, one by one. [m]"""
    predicted_stops_m: Sequence[float] = ()
    wind_speed_m_s: float = 0.0
    """Of the wind it was predicted in. [m s⁻¹]"""

    @property
    def time_s(self) -> tuple[float, float] | None:
        """How long all of it took, and was predicted to take; ``None``: nothing was compared. [s]"""
        parts = [*self.legs_s, *([] if self.landing_s is None else [self.landing_s])]
        return (sum(f for f, _ in parts), sum(p for _, p in parts)) if parts else None

    @property
    def energy_error(self) -> float | None:
        """Flown energy over predicted energy, less one. [-]"""
        predicted_j = sum(self.predicted_energy_j.values())
        return sum(self.flown_energy_j.values()) / predicted_j - 1.0 if predicted_j > 0.0 else None

    @property
    def time_error(self) -> float | None:
        """Flown time over predicted time, less one. [-]"""
        whole = self.time_s
        return None if whole is None or not whole[1] > 0.0 else whole[0] / whole[1] - 1.0


_KINDS = tuple(dict.fromkeys(kind_of(state) for state in STATES))


def fit_spread(
    flights: Sequence[FlownAndPredicted],
    *,
    source: str,
    known: Repeatability | None = None,
    time_parameters: float = 0.0,
    energy_parameters: float = 0.0,
) -> ModelSpread:
    """Return how far flights were from their predictions.

    Parameters
    ----------
    flights : sequence of FlownAndPredicted
    source : str
        Which flights, and how they were compared, for the model file.
    known : Repeatability, optional
        What is known of all flights beforehand; counts as one flight.
    time_parameters, energy_parameters : float
        How many numbers of the model the same flights were fitted with.

    Returns
    -------
    ModelSpread
        Standard deviations about zero, rounded up to four decimals, and ``None`` for what no flight shows.

    Raises
    ------
    IdentificationError
        If there is no flight, or nothing is predicted of one.
    """
    timed = [flight for flight in flights if flight.time_error is not None]
    powered = [flight for flight in flights if flight.energy_error is not None]
    if not flights or any(f.time_error is None and f.energy_error is None for f in flights):
        msg = "the spread of a model needs flights and their predictions"
        raise IdentificationError(msg)
    return ModelSpread(
        n_flights=len(flights),
        source=source,
        **_times(timed, time_parameters, known),
        **_energies(powered, energy_parameters, known),
        stopping_distance_fraction=_root_mean_square(
            flown / predicted - 1.0
            for flight in flights
            for flown, predicted in zip(flight.flown_stops_m, flight.predicted_stops_m, strict=True)
            if predicted > 0.0
        ),
    )


def _times(
    flights: Sequence[FlownAndPredicted], parameters: float, known: Repeatability | None
) -> dict[str, Any]:
    """Return the spread of times: of flights, of their legs, and of their landings."""
    if not flights:
        return dict.fromkeys(("time_fraction", "leg_time_s", "landing_time_s"))
    of_legs: list[FloatArray] = []
    for flight in flights:
        flown, predicted = np.array(flight.legs_s).reshape(-1, 2).T
        if float(predicted @ predicted) > 0.0:
            fraction = _weighted_median(flown / predicted - 1.0, predicted)
            of_legs.append(flown - predicted - fraction * predicted)
    legs = _without_outliers(np.concatenate([np.zeros(0), *of_legs]))
    leg_square = _variances(
        np.square(legs),
        np.ones((legs.size, 1)),
        known=[None if known is None else known.leg_s],
        weight=1.0 - len(of_legs) / max(legs.size, 1),
    )
    error = np.array([flight.time_error or 0.0 for flight in flights])
    whole_s = np.array([flight.time_s[1] for flight in flights if flight.time_s is not None])
    lands = np.array([flight.landing_s is not None for flight in flights])
    # few flights in one piece do not tell what landings add from what flights do
    ends = lands & (bool(of_legs) or error.size >= _LEAST_RANKED)
    factors = np.stack([np.ones(error.size), ends / np.square(whole_s)], axis=1)
    besides = np.nan_to_num(leg_square) * [len(f.legs_s) for f in flights] / np.square(whole_s)
    free = _free(error.size, parameters)
    apart = np.array([flight.landing_s is not None and bool(flight.legs_s) for flight in flights])
    parts = [f.landing_s for f, is_apart in zip(flights, apart, strict=True) if is_apart]
    landing, predicted = np.array(parts).reshape(-1, 2).T
    of_landings = _without_outliers(landing - predicted) / whole_s[apart]
    square = _variances(
        np.square(np.concatenate([_without_outliers(error), of_landings])),
        np.concatenate(
            [factors, np.stack([np.square(predicted / whole_s[apart]), factors[apart, 1]], axis=1)]
        ),
        known=[None, None]
        if known is None
        else [known.time_fraction, known.landing_s if ends.any() else None],
        besides=np.concatenate([besides, np.zeros(of_landings.size)]),
        weight=free,
    )
    square *= _ranked(error, free * (factors @ np.nan_to_num(square)), besides)
    square[0] *= _on_the_next(error.size, parameters)
    names = ("time_fraction", "landing_time_s", "leg_time_s")
    return dict(zip(names, map(_rounded_up, np.sqrt([*square, *leg_square])), strict=True))


def _variances(
    squares: FloatArray,
    factors: FloatArray,
    *,
    known: Sequence[float | None],
    besides: FloatArray | float = 0.0,
    weight: float = 1.0,
) -> FloatArray:
    r"""Return the likeliest variances that errors add up from, NaN of those that nothing tells.

    The squares of normal errors are expected to be ``besides`` and ``factors`` times the variances.

    Parameters
    ----------
    squares : (n,) array
    factors : (n, k) array
    known : k numbers
        Standard deviations known beforehand, as well as one error shows them.
    besides : (n,) array, optional
        Variances there are besides.
    weight : float
        Of the errors as evidence: less than one where the model was fitted to them.
    """
    from scipy.optimize import minimize

    shows = factors.any(axis=0) & (weight > 0.0)
    is_known = np.array([one is not None for one in known])
    found = np.where(shows, 0.0, np.nan)
    sought = is_known | (shows & squares.any())
    if not sought.any():
        return found
    factors, is_known = factors[:, sought], is_known[sought]
    start = np.array(
        [
            float(squares.mean() / column.mean()) if deviation is None else deviation**2
            for deviation, column in zip(compress(known, sought), factors.T, strict=True)
        ]
    )
    prior = np.log(start)

    def unlikelihood(logarithms: FloatArray) -> tuple[float, FloatArray]:
        own = np.exp(logarithms)
        variances = besides + factors @ own
        ratios = squares / variances
        off = np.where(is_known, logarithms - prior, 0.0)
        beside = 1.0 + 0.25 * np.square(
            off
        )  # 2 is the deviation that one error's information gives
        value = 0.5 * (weight * np.log(variances) + ratios).sum() + np.log(beside).sum()
        slope = 0.5 * ((weight - ratios) / variances) @ factors * own + 0.5 * off / beside
        return float(value), slope

    best = minimize(
        unlikelihood,
        prior,
        jac=True,
        method="L-BFGS-B",
        bounds=[
            (at - (_LEAST if is_told else _WIDEST), at + _WIDEST)
            for at, is_told in zip(prior, is_known, strict=True)
        ],
        options={"ftol": 0.0, "gtol": 1e-9},
    )
    found[sought] = np.exp(best.x)
    return found


_WIDEST = 30.0
"""Logarithms of variances are within that of where they are begun to be sought. [-]"""
_LEAST = 2.0 * math.log(10.0)
"""No few flights are believed to repeat ten times better than what is known of all. [-]"""
_LEAST_RANKED = 9
"""Of fewer flights the rank that leaves 80 % inside is that of the largest error, or none."""


def _ranked(errors: FloatArray, variances: FloatArray, besides: FloatArray | float = 0.0) -> float:
    """Return by how much variances are to be larger for 80 % of such errors to lie inside.

    Of n errors in units of their deviations the next one, which may be any of n + 1, is below that of
    rank 0.8 (n + 1) in 80 % of all cases, whatever they are distributed by (V. Vovk, A. Gammerman,
    G. Shafer, Algorithmic Learning in a Random World, 2005): a flight far out makes no interval wide.
    Between ranks it is taken in proportion.  Few flights leave what they show by their squares.
    ``besides`` are variances that stay as they are.
    """
    from scipy.special import stdtrit

    if errors.size < _LEAST_RANKED or not (variances > 0.0).all():
        return 1.0
    needed = (np.square(errors / stdtrit(errors.size, HIGH)) - besides) / variances
    return max(float(np.quantile(needed, HIGH - LOW, method="weibull")), 0.0)


def _free(count: int, parameters: float) -> float:
    """Return the part of errors that a model of so many parameters fitted to them leaves free."""
    return max(1.0 - parameters / count, 0.0)


def _on_the_next(count: int, parameters: float) -> float:
    """Return by how much variances are larger for what the parameters make of the next flight."""
    return 1.0 + min(parameters / count, 1.0)


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    """Return the slope through the origin of least absolute errors, of slopes by their lengths."""
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, 0.5 * below[-1])])


_LEAST_ERRORS = 8
"""Of fewer none is told to be an outlier: the median of n is good to 1.2 / √n. [-]"""
_OUTLYING = 2.5
"""Standard deviations, by the median of the errors, beyond which one counts as so far out: a pilot who
waits once does not make every leg uncertain (Huber, Robust Statistics, 1981). [-]"""


def _without_outliers(errors: FloatArray) -> FloatArray:
    if errors.size < _LEAST_ERRORS:
        return errors
    most = _OUTLYING * _DEVIATION_OF_MEDIAN * float(np.median(np.abs(errors)))
    return np.clip(errors, -most, most)


_DEVIATION_OF_MEDIAN = 1.4826
"""Standard deviation of a normal distribution over the median of its errors. [-]"""


def _energies(
    flights: Sequence[FlownAndPredicted], parameters: float, known: Repeatability | None
) -> dict[str, Any]:
    """Return the spread of energies: common to the states of a flight, with the wind, and of each state."""
    from scipy.optimize import nnls

    if not flights:
        return {"energy_fraction": None}
    predicted = _by_kind(flight.predicted_energy_j for flight in flights)
    flown = _by_kind(flight.flown_energy_j for flight in flights)
    fraction = predicted / predicted.sum(axis=1, keepdims=True)
    whole = flown.sum(axis=1) / predicted.sum(axis=1) - 1.0
    # (r_k - r)² = (1 - w_k)² σ_k² + Σ_j≠k w_j² σ_j², for each kind of each flight that has it
    flight, kind = np.nonzero(fraction > 0.0)
    deviation = flown[flight, kind] / predicted[flight, kind] - 1.0 - whole[flight]
    coefficients = np.square(fraction[flight])
    coefficients[np.arange(kind.size), kind] = np.square(1.0 - fraction[flight, kind])
    # a kind of little energy is little known and matters little: weighed by what it is of a flight
    weight = fraction[flight, kind]
    of_kinds, _ = nnls(weight[:, None] * coefficients, weight * np.square(deviation))
    free = _free(whole.size, parameters)
    besides = np.square(fraction) @ of_kinds
    winds = np.square([flight.wind_speed_m_s for flight in flights])
    factors = np.stack([np.ones(whole.size), winds], axis=1)
    square = _variances(
        np.square(whole),
        factors,
        known=[None, None] if known is None else [ENERGY_FRACTION, WIND_ENERGY_FRACTION_S_M],
        besides=besides,
        weight=free,
    )
    ranked = _ranked(whole, free * (factors @ np.nan_to_num(square)) + besides)
    raised = ranked * _on_the_next(whole.size, parameters)
    common, of_wind = map(_rounded_up, np.sqrt(square * [raised, ranked]))
    # fitted to all flights, a kind is off by more on the next, of as many as are free
    of_kinds = np.sqrt(raised * of_kinds / max(free, 1.0 / whole.size))
    deviations = dict(zip(_KINDS, of_kinds, strict=True))
    seen = dict(zip(_KINDS, fraction.any(axis=0), strict=True))
    return {
        "energy_fraction": common,
        "energy_fraction_s_m": of_wind,
        "energy_state_fraction": tuple(
            (state.value, _rounded_up(deviations[kind_of(state)]))
            for state in STATES
            if seen[kind_of(state)]
        ),
    }


def _by_kind(energies_j: Iterable[Mapping[FlightState, float]]) -> FloatArray:
    return np.array([[one.get(kind, 0.0) for kind in _KINDS] for one in energies_j])


def _root_mean_square(fractions: Iterable[float]) -> float | None:
    values = np.array(list(fractions))
    return _rounded_up(float(np.sqrt(np.mean(np.square(values))))) if values.size else None


def _rounded_up(deviation: float) -> float | None:
    """Return a standard deviation with four decimals; ``None`` of NaN."""
    return None if math.isnan(deviation) else math.ceil(1e4 * deviation - 1e-3) / 1e4


def fitted_parameters(errors: Sequence[float], left_out: Sequence[float | None]) -> float:
    """Return how many parameters a model has from flights, by their errors with it and without each.

    The leverage of a flight is 1 - e / e_(f) of linear least squares, between none and one; one where
    there is no model without it.
    """
    return sum(
        1.0
        if without is None
        else float(np.clip(1.0 - own / without, 0.0, 1.0))
        if without
        else 0.0
        for own, without in zip(errors, left_out, strict=True)
    )


_LEAST_FLIGHTS = 2


def left_out_spread(
    model: VehicleModel,
    records: Sequence[FlightRecord],
    steady: Sequence[MeasuredPower],
    settings: IdentificationSettings,
) -> ModelSpread | None:
    """Compare each flight with its prediction, and with that by the power of the others.

    ``None`` where there are fewer than two flights, or none can be compared.
    """
    if len(records) < _LEAST_FLIGHTS:
        return None
    compared: list[FlownAndPredicted] = []
    without: list[FlownAndPredicted | None] = []
    for record in records:
        one = _compare(record, model, settings)
        if one is None:
            continue
        compared.append(one)
        if model.is_power_known and one.energy_error is not None:
            other = _model_without(model, record, steady, settings)
            without.append(None if other is None else _compare(record, other, settings))
    if not compared:
        return None
    how = "from their missions alone"
    if any(one.time_s is None for one in compared):
        how = "from their missions alone, or along the motion flown"
    if broken_off := sum(bool(one.legs_s) and one.landing_s is None for one in compared):
        how += f", {broken_off} up to the last item in the log"
    return fit_spread(
        compared,
        source=f"{len(compared)} flights, predicted {how}; each left out tells how far to trust that",
        known=REPEATABILITY[model.reference],
        energy_parameters=_energy_parameters(compared, without),
    )


def noise_fraction(measured_m: Sequence[float]) -> float | None:
    """Return how far the position noise of a flight is from the median: standard deviation of its logarithm.

    Of one flight what is known of multicopters.  [-]
    """
    off = np.log(measured_m) - math.log(float(np.median(measured_m)))
    (square,) = _variances(
        np.square(off),
        np.ones((off.size, 1)),
        known=[multicopter_priors()["position_noise"].fraction],
        weight=_free(off.size, 1.0),
    )
    return _rounded_up(math.sqrt(square))


def time_errors(
    models: Sequence[VehicleModel],
    records: Sequence[FlightRecord],
    settings: IdentificationSettings,
) -> list[list[float]]:
    """Return flown over predicted times, less one, of flights that all models predict: rows by model. [-]"""
    flights = [[_compare(record, model, settings) for model in models] for record in records]
    rows = [[one.time_error for one in flight if one is not None] for flight in flights]
    known = [[error for error in row if error is not None] for row in rows]
    return [list(row) for row in zip(*(r for r in known if len(r) == len(models)), strict=True)]


def _energy_parameters(
    compared: Sequence[FlownAndPredicted], without: Sequence[FlownAndPredicted | None]
) -> float:
    errors = [e for one in compared if (e := one.energy_error) is not None]
    return fitted_parameters(errors, [None if o is None else o.energy_error for o in without])


def _model_without(
    model: VehicleModel,
    record: FlightRecord,
    steady: Sequence[MeasuredPower],
    settings: IdentificationSettings,
) -> VehicleModel | None:
    own = f"{record.source}#{record.number}"
    power = identify_power(
        [f for f in steady if f.source != own], mass_deviation_kg=settings.payload_deviation_kg
    )
    if not power.is_known:
        return None
    return replace(model, hover=power.hover, cruise=power.cruise, vertical=power.vertical)


def _compare(
    record: FlightRecord, model: VehicleModel, settings: IdentificationSettings
) -> FlownAndPredicted | None:
    """Return a flight and its prediction: from its mission, else along the motion flown."""
    own = settings.conditions_of(record)
    known = KnownConditions(
        payload_kg=own.payload_kg or 0.0,
        temperature_c=own.temperature_c,
        position_noise_m=settings.position_noise_m,  # that of the flight is drawn by itself
    )
    if record.mission_items:
        # what cannot be predicted shows nothing of predictions
        with contextlib.suppress(MavjouleError):
            found = compared_flight(verify_flight(record, model, known))
            if found is not None:
                return found
    return _energy_alone(record, model, settings)


def compared_flight(one: Verification) -> FlownAndPredicted | None:
    """Return a flight with its prediction, cut where both begin an item of the mission.

    Of a log that breaks off, up to the last such item.  ``None`` where it was not flown by its mission.
    """
    if not one.is_of_mission:
        return None
    flown, foreseen = one.flown, one.foreseen
    # how long a flight waits armed on the ground is no part of it
    start_s, foreseen_start_s = (float(one.time_s[lift_off(one)]) for one in (flown, foreseen))
    begin = start_s, foreseen_start_s
    cuts = [begin, *begun_in_both(flown, foreseen, begin)]
    if not one.breaks_off:
        cuts.append((flown.duration_s, foreseen.duration_s))
    parts = [(end[0] - start[0], end[1] - start[1]) for start, end in pairwise(cuts)]
    flown_j: dict[FlightState, float] = defaultdict(float)
    predicted_j: dict[FlightState, float] = defaultdict(float)
    for start, end in pairwise(cuts):
        whole_j = _known_energy_j(flown, start[0], end[0])
        by_kind = _energies_by_kind_j(foreseen, start[1], end[1])
        sum_j = sum(by_kind.values())
        if whole_j is not None and sum_j > 0.0:
            for kind, energy_j in by_kind.items():
                flown_j[kind] += energy_j * whole_j / sum_j
                predicted_j[kind] += energy_j
    stops = [(s.measured_m, s.predicted_m) for s in one.stops if s.predicted_m]
    return FlownAndPredicted(
        legs_s=parts if one.breaks_off else parts[:-1],
        landing_s=None if one.breaks_off else parts[-1],
        flown_energy_j=flown_j,
        predicted_energy_j=predicted_j,
        flown_stops_m=tuple(measured_m for measured_m, _ in stops),
        predicted_stops_m=tuple(predicted_m for _, predicted_m in stops),
        wind_speed_m_s=one.setup.wind.speed_m_s,
    )


_KNOWN = 0.95
"""Fraction of an item that power must be known for. [-]"""
_CLIMBING_M_S = 0.3
"""Slower it is level. [m s⁻¹]"""


def _known_energy_j(record: FlightRecord, begin_s: float, end_s: float) -> float | None:
    within = (record.time_s >= begin_s) & (record.time_s < end_s)
    power_w = record.power_w[within]
    known = np.isfinite(power_w)
    if not within.any() or known.mean() < _KNOWN:
        return None
    return (end_s - begin_s) * float(power_w[known].mean())


def _energies_by_kind_j(
    record: FlightRecord, begin_s: float, end_s: float
) -> dict[FlightState, float]:
    within = (record.time_s >= begin_s) & (record.time_s < end_s)
    climb, power_w = record.climb_m_s[within], record.power_w[within]
    if not within.any() or not np.isfinite(power_w).all():
        return {}
    each_j = (end_s - begin_s) / power_w.size * power_w
    is_of = {
        FlightState.CLIMB: climb > _CLIMBING_M_S,
        FlightState.CRUISE: np.abs(climb) <= _CLIMBING_M_S,
        FlightState.DESCEND: climb < -_CLIMBING_M_S,
    }
    return {kind: float(each_j[where].sum()) for kind, where in is_of.items() if where.any()}


def _energy_alone(
    record: FlightRecord, model: VehicleModel, settings: IdentificationSettings
) -> FlownAndPredicted | None:
    """Return the energy of each kind of state along the motion flown."""
    law, mass_kg = model.cruise, settings.flown_mass_kg(record)
    if not isinstance(law, WholeLaw) or mass_kg is None:
        return None
    speed = speed_through_air_m_s(record)
    temperature_c = settings.conditions_of(record).temperature_c
    density = record_air_density_kg_m3(record, home_temperature_c=temperature_c)
    climb = climb_rate_m_s(record)
    columns = np.stack([speed, climb, record.power_w, density])
    known = np.isfinite(columns).all(axis=0)
    predicted_w = np.zeros(known.size)
    predicted_w[known] = whole_power_w(
        law,
        airspeed_m_s=speed[known],
        climb_rate_m_s=climb[known],
        mass_kg=mass_kg,
        air_density_kg_m3=density[known],
        acceleration=Acceleration(*(np.asarray(a)[known] for a in flown_acceleration(record))),
    )
    flown: dict[FlightState, float] = defaultdict(float)
    predicted: dict[FlightState, float] = defaultdict(float)
    power_w = np.where(known, record.power_w, 0.0)
    for segment in find_states(record):
        kind = kind_of(segment.state)
        flown[kind] += record.step_s * float(power_w[segment.samples].sum())
        predicted[kind] += record.step_s * float(predicted_w[segment.samples].sum())
    if not sum(predicted.values()) > 0.0:
        return None
    return FlownAndPredicted(flown_energy_j=flown, predicted_energy_j=predicted)


def ramp_spread(
    records: Sequence[FlightRecord], settings: IdentificationSettings
) -> ModelSpread | None:
    """Compare each flight with its prediction by the ramps and the power of the others.

    ``None`` where there are no ramps without one of the flights.
    """
    usable: list[tuple[TimedFlight, tuple[MeasuredPower, ...]]] = []
    for record in records:
        with contextlib.suppress(IdentificationError):
            flight = timed_flight(record)
            temperature_c = settings.conditions_of(record).temperature_c
            density = record_air_density_kg_m3(record, home_temperature_c=temperature_c)
            mass_kg = settings.flown_mass_kg(record)
            powers = manoeuvre_powers(record, air_density_kg_m3=density, mass_kg=mass_kg)
            usable.append((flight, powers))
    flights, means = [flight for flight, _ in usable], [powers for _, powers in usable]
    try:
        ramps = fit_ramps(flights)
        others = [fit_ramps([f for f in flights if f is not flight]) for flight in flights]
    except IdentificationError:
        return None
    deviation_kg = settings.payload_deviation_kg
    power, _ = power_of_manoeuvres(means, deviation_kg)
    compared = [_compared(flight, own, ramps, power) for flight, own in usable]
    without = []
    for (flight, own), left in zip(usable, others, strict=True):
        of_others, _ = power_of_manoeuvres([one for one in means if one is not own], deviation_kg)
        without.append(_compared(flight, own, left, of_others))
    has_masses = all(settings.flown_mass_kg(record) is not None for record in records)
    found = fit_spread(
        compared,
        source=(
            f"{len(compared)} flights, predicted from their legs; each left out tells how far to trust "
            f"that{'' if has_masses else '; with unknown loads'}"
        ),
        known=REPEATABILITY[Autopilot.STEP],
        time_parameters=fitted_parameters(
            [one.time_error or 0.0 for one in compared], [one.time_error for one in without]
        ),
        energy_parameters=_energy_parameters(
            compared, [one for one in without if one.energy_error is not None]
        ),
    )
    # A manoeuvre holds several states: what they share is all that is known.  Predicted by the airspeed
    # measured on board, they do not tell what a wind adds; where a stop was commanded these logs do not hold,
    # so that no stopping distance can be compared.
    return replace(
        found, energy_fraction_s_m=None, energy_state_fraction=(), stopping_distance_fraction=None
    )


def _compared(
    flight: TimedFlight, powers: Sequence[MeasuredPower], ramps: Ramps, power: PowerIdentification
) -> FlownAndPredicted:
    durations = list(zip(flight.manoeuvres, durations_s(flight, ramps), strict=True))
    flown_j, predicted_j = 0.0, 0.0
    predicted_w = predicted_powers_w(power, powers) if powers else None
    for mean, power_w in zip(powers, [] if predicted_w is None else predicted_w, strict=False):
        # a manoeuvre that takes longer than predicted takes its power for longer
        middle_s = mean.start_s + 0.5 * mean.duration_s
        own, duration_s = next(
            (m, s) for m, s in reversed(durations) if m.start_s <= middle_s or m is flight.takeoff
        )
        flown_j += mean.power_w * mean.duration_s
        predicted_j += float(power_w) * mean.duration_s * duration_s / own.duration_s
    of_manoeuvres = [(m.duration_s, s) for m, s in durations]
    takeoff, *legs, landing = of_manoeuvres
    has_power = predicted_j > 0.0
    return FlownAndPredicted(
        legs_s=legs,
        # from power on to power off: what it waits before the take-off varies as what it waits at the end
        landing_s=(takeoff[0] + landing[0], takeoff[1] + landing[1]),
        flown_energy_j={FlightState.CRUISE: flown_j} if has_power else {},
        predicted_energy_j={FlightState.CRUISE: predicted_j} if has_power else {},
    )
