"""The spread of a prediction: what is sampled, what is interpolated, and what comes out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import HOME, item, mission, north, rtl, speed, takeoff
from scipy.stats import binom, t

from planner.autopilot import Autopilot
from planner.flight import uncertainty
from planner.flight.motion.kinematics import STATES
from planner.flight.pilot import make_pilot
from planner.flight.prediction import predict_flight, segment_energies_j
from planner.flight.returns.destination import make_destinations
from planner.flight.returns.path import Returns, make_returns
from planner.flight.returns.tightest import sweep_returns
from planner.flight.uncertainty import (
    SAMPLES,
    UnknownSamples,
    kind_of,
    predict_energy_band,
    predict_scenarios,
    sample_charge,
    sample_unknowns,
    spread_at_airspeeds,
    spread_at_noise,
)
from planner.mission.route.route import make_route
from planner.physics.rotor import Rotor, momentum_power_w
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.service.preflight import CheckResult, check
from planner.setup import Setup
from planner.values import field_values, replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import Basis, ModelSpread
from planner.vehicle.parameters.resolve import resolve_parameters
from planner.vehicle.power import CruisePower, MomentumLaw
from planner.vehicle.repeatability import REPEATABILITY

if TYPE_CHECKING:
    from planner.vehicle.model import VehicleModel

EXACT = ModelSpread(n_flights=5, source="made", energy_fraction=0.0)
MANY = 1_000_000
"""Flights with which Student's t is the normal distribution."""
SURVEYOR = replace(load_vehicle("arducopter-sitl-quad"), spread=EXACT, battery=None)
ROWS = mission(
    takeoff(40),
    *(
        item(16, north(60.0 + 20.0 * row), 40, longitude_deg=HOME.longitude_deg + east)
        for row in range(6)
        for east in ((0.0, 0.002) if row % 2 else (0.002, 0.0))
    ),
    rtl(),
)
WINDY = Wind(speed_m_s=5.0, from_deg=270.0, speed_sd_m_s=2.0, from_sd_deg=20.0)
NORMAL_P90 = 1.2815515655446004
"""90th percentile of the normal distribution."""


def flown(setup: Setup) -> Returns:
    vehicle, parameters = setup.vehicle, None
    if vehicle.reference is not Autopilot.STEP:
        parameters = resolve_parameters(vehicle.reference, file=None, model=vehicle).values
    route = make_route(ROWS, dialect=vehicle.reference, home_amsl_m=None, terrain=None)
    pilot = make_pilot(setup, parameters)
    flight = predict_flight(route, setup, pilot)
    destinations = make_destinations(ROWS, route, parameters, terrain=None)
    return make_returns(route, flight, pilot, destinations)


def sampled_setup(setup: Setup, samples: UnknownSamples, index: int) -> Setup:
    east, north_m_s = float(samples.wind_east_m_s[index]), float(samples.wind_north_m_s[index])
    return replace(
        setup,
        wind=Wind(
            speed_m_s=math.hypot(east, north_m_s),
            from_deg=math.degrees(math.atan2(-east, -north_m_s)),
        ),
        payload_kg=float(samples.load_kg[index]),
        temperature_c=float(samples.temperature_c[index]),
    )


def checked(
    vehicle: VehicleModel,
    *,
    spread: ModelSpread | None,
    capacity_wh: float = 200.0,
    charge: float | Spread = 1.0,
    payload_kg: float | Spread = 0.0,
    wind: Wind | None = None,
    risk: float = 0.05,
) -> CheckResult:
    return check(
        ROWS,
        replace(vehicle, spread=spread),
        battery=Battery(capacity_wh=capacity_wh),
        charge=charge,
        payload_kg=payload_kg,
        wind=wind or Wind(),
        risk=risk,
    )


@pytest.mark.parametrize(
    ("wind", "within"),
    [
        # as documented: momentum theory within 0.1 %
        (WINDY, 1e-3),
        (Wind(speed_m_s=0.0, from_deg=270.0, speed_sd_m_s=3.0, from_sd_deg=180.0), 1e-3),
        (Wind(speed_m_s=10.0, from_deg=0.0, speed_sd_m_s=3.0, from_sd_deg=90.0), 2e-3),
    ],
)
def test_interpolated_energies_are_those_of_flying_each_draw_again(
    wind: Wind, within: float
) -> None:
    setup = Setup(
        SURVEYOR,
        wind=wind,
        home_amsl_m=HOME.altitude_amsl_m,
        temperature_c=Spread(mean=15.0, sd=5.0),
        payload_kg=Spread(mean=0.5, sd=0.1),
    )
    returns = flown(setup)
    flight = returns.flight
    found = predict_scenarios(returns, setup, spread=EXACT).energy_wh
    samples = sample_unknowns(EXACT, setup, flight.power)
    assert found is not None
    farthest = [int(samples.wind_east_m_s.argmax()), int(samples.wind_north_m_s.argmin())]
    for index in [*range(0, SAMPLES, 1000), *farthest]:
        again = flown(sampled_setup(setup, samples, index)).flight
        power = replace(again.power, wind=sampled_setup(setup, samples, index).wind)
        along_wh = (
            next(segment_energies_j(flight.motion, flight.transients, (power,))).sum() / 3600.0
        )
        assert found[index] == pytest.approx(along_wh, rel=within)
        if float(np.hypot(samples.wind_east_m_s[index], samples.wind_north_m_s[index])) < 10.0:
            # below its airspeed limit the vehicle flies the same motion in every wind
            assert found[index] == pytest.approx(again.energy_j / 3600.0, rel=within)


@pytest.mark.parametrize("name", ["falkowski-2023-quadrotor", "arducopter-sitl-quad"])
def test_the_returns_of_a_sweep_keep_the_energies_by_state_of_flying_them_again(name: str) -> None:
    returns = flown(Setup(load_vehicle(name)))
    sweep = sweep_returns(returns)
    assert sweep is not None
    points = returns.points(sweep.segment, sweep.fraction)
    _, [again_j] = returns.fly_by_state(
        points.stop_m, points.stage, sweep.destination, powers=[returns.flight.power]
    )
    assert returns.sample is not None
    sampled = np.isin(sweep.time_s, returns.sample.points.time_s)
    assert 0 < sampled.sum() < len(sampled)
    # the same arithmetic in another batch
    np.testing.assert_allclose(sweep.after_stop_j[sampled], again_j[sampled], rtol=1e-9, atol=1e-6)
    whole_wh = sweep.stop_wh + again_j.sum(axis=1) / 3600.0
    np.testing.assert_allclose(sweep.return_wh[sampled], whole_wh[sampled], rtol=1e-9)
    # 0.1 % of the energy looked for: what the sweep leaves open between the points it flies from
    np.testing.assert_allclose(sweep.return_wh, whole_wh, atol=1e-3 * sweep.sum_wh.max())


def test_a_table_of_powers_with_corners_is_interpolated_as_documented() -> None:
    table = CruisePower(speed_m_s=(0.0, 5.0, 10.0), power_above_hover_w=(0.0, -20.0, 30.0))
    quad = replace(load_vehicle("falkowski-2023-quadrotor"), cruise=table, spread=EXACT)
    setup = Setup(quad, wind=WINDY, home_amsl_m=HOME.altitude_amsl_m)
    returns = flown(setup)
    flight = returns.flight
    found = predict_scenarios(returns, setup, spread=EXACT).energy_wh
    samples = sample_unknowns(EXACT, setup, flight.power)
    assert found is not None
    errors = []
    for index in range(0, SAMPLES, 100):
        wind = Wind(
            speed_m_s=float(np.hypot(samples.wind_east_m_s[index], samples.wind_north_m_s[index])),
            from_deg=math.degrees(
                math.atan2(-samples.wind_east_m_s[index], -samples.wind_north_m_s[index])
            ),
        )
        power = replace(flight.power, wind=wind)
        along_j = next(segment_energies_j(flight.motion, flight.transients, (power,))).sum()
        errors.append(found[index] * 3600.0 / along_j - 1.0)
    assert np.std(errors) < 0.005
    assert np.abs(errors).max() < 0.012


def test_without_any_spread_of_the_energy_every_draw_is_the_prediction() -> None:
    result = checked(SURVEYOR, spread=EXACT)
    totals = result.totals
    assert totals.energy_wh_p10 == pytest.approx(totals.energy_wh, rel=1e-12)
    assert totals.energy_wh_p90 == pytest.approx(totals.energy_wh, rel=1e-12)
    assert totals.time_s_p10 is None  # the model says nothing about times
    assert result.battery is not None
    assert result.battery.below_reserve_probability == 0.0
    assert result.return_plan is not None
    assert result.return_plan.below_reserve_probability == 0.0


def test_a_px4_is_on_the_ground_for_longer_or_shorter_until_it_knows() -> None:
    """From 2 s sooner, without a range sensor, to 8 s later, most often as predicted: a triangle."""
    spread = ModelSpread(n_flights=MANY, source="made", time_fraction=1e-9)
    vehicle = replace(load_vehicle("px4-sih-quad"), spread=spread, position_noise_m=0.0)
    totals = check(ROWS, vehicle).totals
    # F = (x + 2)²/(2 · 10) up to 0, 1 − (8 − x)²/(8 · 10) beyond; within three standard deviations of 10 000.
    assert totals.time_s_p10 is not None
    assert totals.time_s_p90 is not None
    assert totals.time_s_p10 - totals.time_s == pytest.approx(math.sqrt(0.1 * 20) - 2.0, abs=0.06)
    assert totals.time_s_p90 - totals.time_s == pytest.approx(8.0 - math.sqrt(0.1 * 80), abs=0.12)


def test_time_energy_charge_and_stops_spread_as_the_model_says() -> None:
    spread = ModelSpread(
        n_flights=MANY,
        source="made",
        time_fraction=0.02,
        energy_fraction=0.05,
        stopping_distance_fraction=0.1,
    )
    vehicle = replace(SURVEYOR, spread=spread)
    result = check(
        ROWS, vehicle, battery=Battery(capacity_ah=10.0, nominal_voltage_v=20.0), reserve=0.1
    )
    totals = result.totals
    # the 90th percentile of 10 000 samples is good to 0.017 standard deviations; four times that
    within = 4.0 * 0.017

    def at(sigma: float, mean: float, sd: float) -> object:
        return pytest.approx(mean * (1.0 + sigma * sd), abs=within * sd * mean)

    assert totals.time_s_p90 == at(NORMAL_P90, totals.time_s, 0.02)
    assert totals.time_s_p10 == at(-NORMAL_P90, totals.time_s, 0.02)
    assert totals.energy_wh_p90 == at(NORMAL_P90, totals.energy_wh, 0.05)
    assert totals.charge_mah is not None
    assert totals.charge_mah_p90 == at(NORMAL_P90, totals.charge_mah, 0.05)
    stopping = [s for s in result.segments if s.stopping_distance_m is not None]
    assert stopping
    for segment in stopping:
        assert segment.stopping_distance_m is not None
        assert segment.stopping_distance_m_p90 == at(NORMAL_P90, segment.stopping_distance_m, 0.1)


def test_errors_of_states_of_one_kind_are_the_same_and_of_three_kinds_independent() -> None:
    first = checked(SURVEYOR, spread=EXACT)
    by_kind = {
        kind: sum(s.energy_wh for s in first.segments if kind_of(s.state) is kind)
        for kind in {kind_of(state) for state in STATES}
    }
    assert len(by_kind) == 3
    spread = replace(
        EXACT, n_flights=MANY, energy_state_fraction=tuple((str(state), 0.1) for state in STATES)
    )
    totals = checked(SURVEYOR, spread=spread).totals
    sd_wh = 0.1 * math.sqrt(sum(wh * wh for wh in by_kind.values()))
    assert totals.energy_wh_p90 == pytest.approx(
        totals.energy_wh + NORMAL_P90 * sd_wh, abs=0.07 * sd_wh
    )


def test_a_wind_adds_to_the_spread_of_energies_in_proportion_to_it() -> None:
    """A fourth of a percent for each m/s, in 4 m/s of it known exactly: √(1 + 1) %."""
    spread = replace(EXACT, n_flights=MANY, energy_fraction=0.01, energy_fraction_s_m=0.0025)
    for wind, sd in ((Wind(), 0.01), (Wind(speed_m_s=4.0, from_deg=270.0), 0.01 * math.sqrt(2.0))):
        totals = checked(SURVEYOR, wind=wind, spread=spread).totals
        sd_wh = sd * totals.energy_wh
        expected_wh = totals.energy_wh + NORMAL_P90 * sd_wh
        assert totals.energy_wh_p90 == pytest.approx(expected_wh, abs=0.07 * sd_wh)


def test_legs_and_landings_add_their_own_times() -> None:
    """13 legs of 0.5 s each, and one landing of 2 s: one standard deviation is √(13 · 0.25 + 4) s."""
    spread = ModelSpread(
        n_flights=MANY, source="made", time_fraction=0.0, leg_time_s=0.5, landing_time_s=2.0
    )
    totals = check(ROWS, replace(SURVEYOR, spread=spread)).totals
    sd_s = math.sqrt(13 * 0.5**2 + 2.0**2)
    assert totals.time_s_p90 == pytest.approx(totals.time_s + NORMAL_P90 * sd_s, abs=0.07 * sd_s)
    assert totals.time_s_p10 == pytest.approx(totals.time_s - NORMAL_P90 * sd_s, abs=0.07 * sd_s)


def test_times_are_spread_as_the_noise_of_the_position_that_a_px4_waits_for() -> None:
    """In proportion to it, down to what flights without noise show."""
    spread = ModelSpread(
        n_flights=MANY, source="made", time_fraction=0.02, leg_time_s=0.4, landing_time_s=2.4
    )
    vehicle = replace(load_vehicle("px4-sih-quad"), position_noise_m=0.4)
    still = REPEATABILITY[Autopilot.PX4]
    assert spread_at_noise(spread, vehicle, None) == spread
    assert spread_at_noise(spread, vehicle, 0.4) == spread
    assert spread_at_noise(spread, vehicle, 0.8).landing_time_s == pytest.approx(4.8, rel=1e-12)
    quiet = spread_at_noise(spread, vehicle, 0.0)
    assert quiet.time_fraction == pytest.approx(still.time_fraction, rel=1e-12)
    assert quiet.leg_time_s == pytest.approx(still.leg_s, rel=1e-12)
    assert quiet.landing_time_s == pytest.approx(still.landing_s, rel=1e-12)
    half = spread_at_noise(spread, vehicle, 0.2).time_fraction
    assert half == pytest.approx(math.sqrt(0.01**2 + 0.75 * 0.005**2), rel=1e-12)
    none = replace(spread, landing_time_s=None)
    assert spread_at_noise(none, vehicle, 0.0).landing_time_s is None
    # nobody else's time waits
    assert spread_at_noise(spread, SURVEYOR, 0.8) == spread


def test_the_noise_of_the_position_is_drawn_where_nobody_measured_it() -> None:
    """Its logarithm is normal: one flight of ten meets exp(0.5 · 1.28) times as much of it, or more."""
    vehicle = load_vehicle("px4-sih-quad")
    spread = ModelSpread(
        n_flights=MANY,
        source="made",
        time_fraction=1e-9,
        landing_time_s=0.0,
        position_noise_fraction=0.5,
    )
    vehicle = replace(vehicle, spread=spread, position_noise_m=0.2)
    for noise_m in (None, 0.2):
        totals = check(ROWS, vehicle, position_noise_m=noise_m, heading_deg=0.0).totals
        still = check(ROWS, vehicle, position_noise_m=0.0, heading_deg=0.0).totals
        waits_s = totals.time_s - still.time_s
        assert waits_s > 0.01 * totals.time_s
        most_s = totals.time_s + waits_s * math.expm1(0.5 * NORMAL_P90)
        # 10 000 samples show the 90th percentile to 0.017 standard deviations; time lost in proportion to
        # 1 / (1 - noise) is up to 5 % more than in proportion to the noise
        assert totals.time_s_p90 == pytest.approx(most_s, abs=0.05 * waits_s)
    measured = check(ROWS, vehicle, position_noise_m=0.25, heading_deg=0.0).totals
    assert measured.time_s_p90 == pytest.approx(measured.time_s, rel=1e-6)


@pytest.mark.parametrize(
    ("n_flights", "freedom", "deviations"),
    # for 1.282 standard deviations, by a table of Student's t; what is known beforehand is one flight more
    [(3, 3, 1.638), (2, 2, 1.886), (1, 2, 1.886)],
)
def test_few_flights_make_a_wider_spread_by_students_t(
    n_flights: int, freedom: int, deviations: float
) -> None:
    few = replace(EXACT, energy_fraction=0.05, n_flights=n_flights)
    totals = checked(SURVEYOR, spread=few).totals
    assert t.ppf(0.9, freedom) == pytest.approx(deviations, abs=5e-4)
    assert totals.energy_wh_p90 == pytest.approx(
        totals.energy_wh * (1.0 + deviations * 0.05), rel=0.05 * 0.1
    )


def test_the_chance_below_the_reserve_is_that_of_the_normal_distribution() -> None:
    need_wh = checked(SURVEYOR, spread=None).totals.energy_wh
    spread = replace(EXACT, energy_fraction=0.05, n_flights=MANY)
    # the margin is two standard deviations: 2.28 % land below it
    result = checked(SURVEYOR, spread=spread, capacity_wh=need_wh * 1.1 / 0.8)
    assert result.battery is not None
    chance = result.battery.below_reserve_probability
    low, high = binom.interval(0.9999, SAMPLES, 0.02275)
    assert chance is not None
    assert low <= chance * SAMPLES <= high


def test_the_charge_at_the_start_counts_in_the_chance() -> None:
    need_wh = checked(SURVEYOR, spread=None).totals.energy_wh
    capacity_wh = need_wh / 0.5
    # 70 % less the reserve of 20 % is the need: what the charge is below 70 %, the margin is
    half = checked(
        SURVEYOR, spread=EXACT, capacity_wh=capacity_wh, charge=Spread(mean=0.7, sd=0.02)
    )
    sure = checked(
        SURVEYOR, spread=EXACT, capacity_wh=capacity_wh, charge=Spread(mean=0.8, sd=0.02)
    )
    assert half.battery is not None
    assert sure.battery is not None
    # five standard deviations of the share of 10 000 samples
    assert half.battery.below_reserve_probability == pytest.approx(0.5, abs=0.025)
    assert sure.battery.below_reserve_probability == 0.0


def test_a_charge_with_a_spread_meets_the_curve_of_the_battery() -> None:
    # 2 % of the charge of the battery's own curve, at some 22.6 V x 8 Ah: about 3.6 Wh
    vehicle = replace(load_vehicle("arducopter-sitl-quad"), spread=EXACT)
    setup = Setup(vehicle, home_amsl_m=HOME.altitude_amsl_m, charge=Spread(mean=0.8, sd=0.02))
    returns = flown(setup)
    result = check(ROWS, vehicle, charge=Spread(mean=0.8, sd=0.02))
    assert result.battery is not None
    assert vehicle.battery is not None
    margin_wh = predict_scenarios(
        returns, setup, spread=EXACT, battery=vehicle.battery, budget=result.battery
    ).margin_wh
    assert margin_wh is not None
    assert np.mean(margin_wh) == pytest.approx(result.battery.margin_wh, abs=0.2)
    assert np.std(margin_wh) == pytest.approx(0.02 * 8.0 * 22.6, rel=0.08)


def test_the_margin_at_every_charge_sampled_is_that_of_a_flight_begun_with_it() -> None:
    # From 60 to 100 %, at a resistance that makes the end of the battery depend on its curve.
    steep = Battery(
        capacity_ah=8.0,
        internal_resistance_ohm=0.06,
        ocv_soc=(0.0, 0.1, 0.3, 0.6, 0.8, 1.0),
        ocv_v=(18.0, 21.0, 21.8, 22.6, 23.5, 25.2),
    )
    charge = Spread(mean=0.8, sd=0.05)
    setup = Setup(SURVEYOR, home_amsl_m=HOME.altitude_amsl_m, charge=charge)
    result = check(ROWS, SURVEYOR, battery=steep, charge=charge)
    returns = flown(setup)
    assert result.battery is not None
    margin_wh = predict_scenarios(
        returns, setup, spread=EXACT, battery=steep, budget=result.battery
    ).margin_wh
    assert margin_wh is not None
    samples = sample_charge(EXACT, setup)
    for index in [int(samples.argmin()), int(samples.argmax()), *range(0, SAMPLES, 1000)]:
        begun = check(
            ROWS, SURVEYOR, battery=steep, charge=float(samples[index]), reserve=0.0
        ).battery
        assert begun is not None
        above_wh = margin_wh[index] + result.battery.reserve_wh
        assert above_wh == pytest.approx(begun.margin_wh, abs=0.02)


def test_the_returns_that_are_tightest_in_a_wind_sampled_are_looked_at() -> None:
    # Recorded in still air a metre takes 482 W / 15 m/s on the mission's way home and 322 W / 10 m/s on a
    # return: the same.  With the wind the faster is the cheaper, and the return is tightest from the far
    # end; against it, from the end of the way.
    fast = mission(
        takeoff(40),
        speed(15.0),
        item(16, north(3000.0), 40),
        item(16, north(30.0), 40),
        item(21, north(0.0), 0.0),
    )
    battery = Battery(capacity_wh=200.0)
    wind = Wind(speed_m_s=0.0, from_deg=0.0, speed_sd_m_s=1.0)
    assessment = check(fast, SURVEYOR, battery=battery, wind=wind).assessment
    assert assessment is not None
    assert assessment.battery is not None
    margin_wh = predict_scenarios(
        assessment.returns,
        assessment.setup,
        spread=EXACT,
        battery=battery,
        budget=assessment.battery,
    ).return_margin_wh
    assert margin_wh is not None
    samples = sample_unknowns(EXACT, assessment.setup, assessment.flight.power)
    near_home = set()
    for index in range(0, SAMPLES, 500):
        north_m_s = float(samples.wind_north_m_s[index])
        blows = Wind(speed_m_s=abs(north_m_s), from_deg=180.0 if north_m_s > 0.0 else 0.0)
        way = check(fast, SURVEYOR, battery=battery, wind=blows).return_plan
        assert way is not None
        assert way.margin_wh is not None
        # the stop before the return is that of mean conditions: 6 s at 15 m/s, where 1 m/s is 30 W
        assert margin_wh[index] == pytest.approx(way.margin_wh, abs=6.0 * 30.0 / 3600.0 * 2.0)
        assert way.tightest is not None
        near_home.add(way.tightest.latitude_deg < north(1500.0))
    assert near_home == {True, False}


def test_more_spread_of_the_payload_widens_the_energy_and_none_leaves_it() -> None:
    def width(payload: float | Spread) -> float:
        totals = checked(SURVEYOR, spread=EXACT, payload_kg=payload).totals
        assert totals.energy_wh_p90 is not None
        assert totals.energy_wh_p10 is not None
        return totals.energy_wh_p90 - totals.energy_wh_p10

    assert width(0.5) == pytest.approx(0.0, abs=1e-9)
    assert width(Spread(mean=0.5, sd=0.0)) == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < width(Spread(mean=0.5, sd=0.05)) < width(Spread(mean=0.5, sd=0.1))


def test_a_payload_is_never_sampled_below_nothing() -> None:
    setup = Setup(
        SURVEYOR,
        payload_kg=Spread(mean=0.0, sd=0.5),
        charge=Spread(mean=0.99, sd=0.1),
        home_amsl_m=HOME.altitude_amsl_m,
    )
    flight = flown(setup).flight
    samples = sample_unknowns(EXACT, setup, flight.power)
    assert samples.load_kg.min() == 0.0
    assert sample_charge(EXACT, setup).max() == 1.0


def test_a_wind_sampled_below_zero_blows_the_other_way() -> None:
    setup = Setup(
        SURVEYOR,
        wind=Wind(speed_m_s=0.0, from_deg=270.0, speed_sd_m_s=2.0),
        home_amsl_m=HOME.altitude_amsl_m,
    )
    flight = flown(setup).flight
    samples = sample_unknowns(EXACT, setup, flight.power)
    # mean and standard deviation of 10 000 samples of 0 ± 2 m/s, to four standard errors
    assert samples.wind_east_m_s.mean() == pytest.approx(0.0, abs=0.08)
    assert samples.wind_east_m_s.std() == pytest.approx(2.0, abs=0.06)
    assert np.abs(samples.wind_north_m_s).max() < 1e-9


def test_the_answer_is_always_the_same_and_chunks_do_not_change_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spread = replace(EXACT, energy_fraction=0.05)
    first = checked(SURVEYOR, spread=spread, wind=WINDY)
    assert checked(SURVEYOR, spread=spread, wind=WINDY).totals == first.totals
    monkeypatch.setattr(uncertainty, "_MOST_ROWS", 37)
    again = checked(SURVEYOR, spread=spread, wind=WINDY)
    # sums of products in another order
    assert again.totals.energy_wh_p90 == pytest.approx(first.totals.energy_wh_p90, rel=1e-12)
    assert again.return_plan == first.return_plan


def test_a_way_home_can_be_too_long_though_the_landing_is_not() -> None:
    there = mission(takeoff(40), item(16, north(1500.0), 40))
    vehicle = replace(SURVEYOR, spread=replace(EXACT, energy_fraction=0.05, n_flights=MANY))
    calm = check(there, vehicle, battery=Battery(capacity_wh=1000.0))
    assert calm.return_plan is not None
    assert calm.return_plan.margin_wh is not None
    out_and_back_wh = 800.0 - calm.return_plan.margin_wh
    # the way home from the far end is just met: every second flight does not
    result = check(there, vehicle, battery=Battery(capacity_wh=out_and_back_wh / 0.8))
    assert result.battery is not None
    assert result.return_plan is not None
    assert result.battery.below_reserve_probability == 0.0
    assert result.return_plan.below_reserve_probability == pytest.approx(0.5, abs=0.025)


def test_energies_flown_as_the_model_says_lie_between_p10_and_p90_in_eight_of_ten_cases() -> None:
    """Coverage: truth sampled from the model's own spread and from the wind's, by other means."""
    spread = ModelSpread(
        n_flights=6,
        source="made",
        energy_fraction=0.04,
        energy_state_fraction=(("cruise", 0.05), ("land", 0.1)),
    )
    wind = Wind(speed_m_s=4.0, from_deg=200.0, speed_sd_m_s=1.0, from_sd_deg=15.0)
    vehicle = replace(SURVEYOR, spread=spread)
    totals = checked(vehicle, spread=spread, wind=wind).totals
    assert totals.energy_wh_p10 is not None
    assert totals.energy_wh_p90 is not None
    setup = Setup(vehicle, wind=wind, home_amsl_m=HOME.altitude_amsl_m)
    flight = flown(setup).flight
    random = np.random.default_rng(80)
    count, inside = 400, 0
    of_states = {**dict.fromkeys(map(str, STATES), 0.0), **dict(spread.energy_state_fraction)}
    for _ in range(count):
        blows = Wind(
            speed_m_s=abs(4.0 + random.standard_normal()),
            from_deg=200.0 + 15.0 * random.standard_normal(),
        )
        power = replace(flight.power, wind=blows)
        own_j = next(segment_energies_j(flight.motion, flight.transients, (power,)))
        error = np.array([of_states[state] * random.standard_t(6) for state in STATES])
        whole_j = (own_j * (1.0 + error[flight.motion.segments.state])).sum()
        whole_j *= 1.0 + 0.04 * random.standard_t(6)
        inside += totals.energy_wh_p10 <= whole_j / 3600.0 <= totals.energy_wh_p90
    low, high = binom.interval(0.999, count, 0.8)
    assert low <= inside <= high


def test_a_model_without_spread_says_nothing_about_it() -> None:
    result = checked(SURVEYOR, spread=None, wind=WINDY)
    assert result.totals.energy_wh_p10 is None
    assert result.battery is not None
    assert result.battery.below_reserve_probability is None
    [finding] = [f for f in result.findings if f.code == "E108"]
    assert "± of wind not drawn" in finding.message


def test_a_vehicle_of_unknown_power_has_a_spread_of_its_time_alone() -> None:
    quad = replace(
        load_vehicle("px4-sih-quad"),
        spread=ModelSpread(n_flights=9, source="made", time_fraction=0.01, energy_fraction=0.1),
    )
    result = check(ROWS, quad)
    assert result.totals.time_s_p90 is not None
    assert result.totals.time_s_p90 > result.totals.time_s
    assert result.totals.energy_wh_p90 is None


def test_a_long_mission_looks_at_the_stages_whose_way_home_is_tightest() -> None:
    rows = mission(
        takeoff(40),
        *(
            item(16, north(100.0), 40, longitude_deg=HOME.longitude_deg + east)
            for east in (0.002, 0.008, 0.014, 0.02, 0.016, 0.012, 0.008, 0.004, 0.002, 0.001)
        ),
        *(item(16, north(100.0 + 10.0 * i), 40) for i in range(8)),
        rtl(),
    )
    vehicle = replace(SURVEYOR, spread=replace(EXACT, energy_fraction=0.02, n_flights=MANY))
    calm = check(rows, vehicle, battery=Battery(capacity_wh=1000.0), wind=WINDY)
    assert calm.return_plan is not None
    assert calm.return_plan.margin_wh is not None
    need_wh = 800.0 - calm.return_plan.margin_wh
    result = check(rows, vehicle, battery=Battery(capacity_wh=need_wh / 0.8), wind=WINDY)
    assert result.return_plan is not None
    assert result.return_plan.below_reserve_probability is not None
    # in the mean conditions the tightest way home is just met; the wind makes more of it than less
    assert 0.4 < result.return_plan.below_reserve_probability < 0.7


def test_the_band_along_a_flight_widens_with_its_energy_and_ends_at_the_totals() -> None:
    # An error common to the flight alone: one flight of ten takes 1.28 standard deviations more.
    spread = replace(EXACT, n_flights=MANY, energy_fraction=0.1)
    vehicle = replace(SURVEYOR, spread=spread)
    setup = Setup(vehicle, home_amsl_m=400.0, position_noise_m=0.0)
    returns = flown(setup)
    segments = np.arange(len(returns.used_wh) - 1)
    band = predict_energy_band(returns, setup, segments, spread=spread)
    assert band is not None
    used_wh = returns.used_wh[1:]
    # as many samples place a percentile as in the tests of the totals
    assert band[1] / used_wh == pytest.approx(1.0 + 0.1 * NORMAL_P90, rel=5e-3)
    assert band[0] / used_wh == pytest.approx(1.0 - 0.1 * NORMAL_P90, rel=5e-3)


def test_the_band_of_a_check_ends_at_its_totals_in_any_wind() -> None:
    result = check(ROWS, load_vehicle("arducopter-sitl-quad"), wind=WINDY)
    assessment = result.assessment
    assert assessment is not None
    assert assessment.vehicle.spread is not None
    count = len(result.segments)
    band = predict_energy_band(
        assessment.returns,
        assessment.setup,
        np.array([0, count - 1]),
        spread=assessment.vehicle.spread,
    )
    assert band is not None
    assert (band[0][-1], band[1][-1]) == (result.totals.energy_wh_p10, result.totals.energy_wh_p90)
    assert band[1][0] - band[0][0] < band[1][1] - band[0][1]


def test_without_a_spread_of_its_energy_there_is_no_band() -> None:
    setup = Setup(SURVEYOR, home_amsl_m=400.0, position_noise_m=0.0)
    silent = replace(EXACT, energy_fraction=None, time_fraction=0.1)
    returns = flown(setup)
    assert predict_energy_band(returns, setup, np.array([0]), spread=silent) is None


@pytest.mark.parametrize(
    ("basis", "speed_m_s", "is_wider"),
    [
        (Basis.REFINED, 15.0, True),
        (Basis.REFINED, 10.0, False),  # the spread is of 5 and 10 m/s
        (Basis.DATA_SHEET, 15.0, False),
    ],
)
def test_beyond_the_speeds_a_spread_is_of_energies_are_as_uncertain_as_the_drag(
    basis: Basis, speed_m_s: float, *, is_wider: bool
) -> None:
    # no flight has shown the drag area, half of it either way
    spread = replace(
        EXACT,
        law_fraction=(("drag_area_m2", 0.5),),
        energy_state_fraction=(("climb", 0.04), ("cruise", 0.06)),
    )
    vehicle = replace(SURVEYOR, spread=spread, provenance=replace(SURVEYOR.provenance, basis=basis))
    one = mission(
        takeoff(40), speed(speed_m_s), item(16, north(8000.0), 40), item(21, north(8000.0), 0.0)
    )
    parameters = resolve_parameters(vehicle.reference, file=None, model=vehicle).values
    route = make_route(one, dialect=vehicle.reference, home_amsl_m=None, terrain=None)
    setup = Setup(vehicle)
    flight = predict_flight(route, setup, make_pilot(setup, parameters))
    found = spread_at_airspeeds(spread, flight)
    assert dict(found.energy_state_fraction)["climb"] == 0.04
    if not is_wider:
        assert found == spread
        return
    assert isinstance(vehicle.cruise, MomentumLaw)
    rotor = Rotor(**field_values(vehicle.cruise))

    def share(airspeed_m_s: float) -> float:
        """Return by how much the power grows with the drag area, both relative."""
        more, less = (
            momentum_power_w(
                airspeed_m_s,
                0.0,
                rotor._replace(drag_area_m2=times * rotor.drag_area_m2),
                mass_kg=vehicle.mass_kg or 0.0,
                air_density_kg_m3=1.225,
            )
            for times in (1.01, 0.99)
        )
        return float((more - less) / (more + less) / 0.01)

    beyond = math.sqrt((0.5 * share(15.0)) ** 2 - (0.5 * share(10.0)) ** 2)
    expected = math.hypot(0.06, beyond)
    assert dict(found.energy_state_fraction)["cruise"] == pytest.approx(expected, rel=0.03)
