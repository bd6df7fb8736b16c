"""Ramps and powers of vehicles that log no references, from flights made of known ones."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.autopilot import Autopilot
from planner.errors import IdentificationError
from planner.flight.motion.ramps import fly_ramps
from planner.flight.motion.steps import StepLegs, StepSpeeds
from planner.identify.assembly import IdentificationSettings
from planner.identify.identification import identify_vehicle
from planner.identify.power import at_mean_load, identify_manoeuvre_power, manoeuvre_powers
from planner.identify.ramps import fit_ramps, identify_ramps, timed_flight
from planner.identify.segments import MeasuredPower
from planner.identify.spread import ramp_spread
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.model import Ramps
from planner.vehicle.power import AltitudeLaw, CruisePower
from planner.vehicle.reader import vehicle_from_toml
from planner.vehicle.writer import vehicle_text

if TYPE_CHECKING:
    from planner.logs.record import FlightRecord

SETTINGS = IdentificationSettings(name="closed", date=dt.date(2026, 1, 2), version="1")
TRUTH = Ramps(
    start_s=5.0,
    climb_m_s=3.0,
    climb_wait_s=2.0,
    acceleration_m_s2=2.0,
    braking_m_s2=3.0,
    turn_wait_s=4.0,
    descent_m_s=2.5,
    landing_m_s=1.0,
    landing_height_m=10.0,
    stop_s=2.0,
)


def _flown(height_m: float, speed_m_s: float, seed: int, ramps: Ramps = TRUTH) -> FlightRecord:
    """Return a flight out, across and down again as a logger with noise records it."""
    stages = [
        Stage(kind=kind, item=1, east_m=east, north_m=north, height_m=height, speed_m_s=speed_m_s)
        for kind, east, north, height in (
            (StageKind.TAKEOFF, 0.0, 0.0, height_m),
            (StageKind.GO, 0.0, 130.0, height_m),
            (StageKind.GO, 150.0, 130.0, height_m),
            (StageKind.GO, 0.0, 0.0, height_m),
            (StageKind.LAND, 0.0, 0.0, 0.0),
        )
    ]
    motion = fly_ramps(StepLegs.of(stages, speeds=StepSpeeds(speed_m_s, speed_m_s)), ramps)
    time_s = np.arange(0.0, float(motion.segments.duration_s.sum()), 0.1)
    state = motion.state_at_time(time_s)
    noise = np.random.default_rng(seed)
    record = make_record(
        is_landed=state.height_m < 0.05,
        height_above_home_m=state.height_m + noise.normal(0.0, 0.02, time_s.size),
        ground_speed_m_s=np.abs(state.ground_speed_m_s + noise.normal(0.0, 0.05, time_s.size)),
        power_w=np.full(time_s.size, 500.0) + 30.0 * state.climb_m_s,
    )
    return replace(record, duration_s=float(motion.segments.duration_s.sum()))


@pytest.fixture(scope="module")
def records() -> list[FlightRecord]:
    flights = [(25.0, 4.0), (50.0, 8.0), (75.0, 12.0), (100.0, 6.0), (40.0, 10.0)]
    return [_flown(height, speed, seed) for seed, (height, speed) in enumerate(flights)]


def test_ramps_come_back_from_the_durations_they_make(records: list[FlightRecord]) -> None:
    ramps = identify_ramps(records).ramps
    assert ramps is not None
    assert ramps.climb_m_s == pytest.approx(3.0, rel=0.02)
    assert ramps.descent_m_s == pytest.approx(2.5, rel=0.02)
    assert ramps.landing_m_s == pytest.approx(1.0, rel=0.05)
    assert ramps.turn_wait_s == pytest.approx(4.0, abs=0.3)
    inverse = 1.0 / ramps.acceleration_m_s2 + 1.0 / ramps.braking_m_s2
    assert inverse == pytest.approx(1.0 / 2.0 + 1.0 / 3.0, rel=0.1)
    assert ramps.start_s == pytest.approx(5.0, abs=0.2)  # a sample, and 0.02 m of noise
    assert ramps.stop_s == pytest.approx(2.0, abs=0.2)
    assert ramps.start_s + ramps.climb_wait_s == pytest.approx(7.0, abs=0.6)
    assert ramps.landing_height_m == pytest.approx(10.0, abs=1.5)


def test_predicted_durations_hold_for_a_flight_left_out(records: list[FlightRecord]) -> None:
    outcome = identify_ramps(records).outcome
    assert outcome.rms is not None
    assert outcome.rms < 0.7  # s, of manoeuvres of 15 to 60 s
    assert outcome.fit_percent is not None
    assert outcome.fit_percent > 90.0


def test_a_wait_within_its_own_error_is_not_shown(records: list[FlightRecord]) -> None:
    """Of waits of 0, 12, 0, 0.5 and 9 s the median is 0.5 s, and 4.5 s without some one flight."""
    flights = [(25.0, 4.0), (50.0, 8.0), (75.0, 12.0), (100.0, 6.0), (40.0, 10.0)]
    waits_s = (0.0, 12.0, 0.0, 0.5, 9.0)
    dawdled = [
        _flown(*flight, seed, replace(TRUTH, turn_wait_s=wait_s))
        for seed, (flight, wait_s) in enumerate(zip(flights, waits_s, strict=True))
    ]
    assert identify_ramps(dawdled).outcome.not_shown == ("turn_wait_s",)
    assert identify_ramps(records).outcome.not_shown == ()
    found = identify_vehicle(dawdled, SETTINGS).findings
    [finding] = [one for one in found if one.code == "I107" and "ramps" in one.message]
    assert "turn_wait_s" in finding.message


def test_too_few_flights_or_one_height_are_refused(records: list[FlightRecord]) -> None:
    with pytest.raises(IdentificationError, match="too few"):
        fit_ramps([timed_flight(record) for record in records[:2]])
    same = [_flown(50.0, speed, 7) for speed in (4.0, 8.0, 12.0)]
    with pytest.raises(IdentificationError, match="one height"):
        fit_ramps([timed_flight(record) for record in same])


def test_a_flight_without_legs_is_refused_with_its_reason(records: list[FlightRecord]) -> None:
    hover = replace(records[0], ground_speed_m_s=np.zeros(records[0].time_s.size))
    rising = np.linspace(0.0, 60.0, records[1].time_s.size)
    aloft = replace(records[1], height_above_home_m=records[1].height_above_home_m + rising)
    blind = replace(records[0], ground_speed_m_s=np.full(records[0].time_s.size, np.nan))
    for record, why in (
        (hover, "no level leg"),
        (aloft, "climbs or descends between its legs"),
        (blind, "not known"),
    ):
        with pytest.raises(IdentificationError, match=why):
            timed_flight(record)


def test_powers_of_manoeuvres_are_their_means(records: list[FlightRecord]) -> None:
    [record] = records[3:4]
    airspeed = np.full(record.time_s.size, 5.0)
    density = np.full(record.time_s.size, 1.2)
    powers = manoeuvre_powers(
        replace(record, airspeed_m_s=airspeed), air_density_kg_m3=density, mass_kg=3.7
    )
    climb, *legs, upper, lower = powers
    # 500 W and 30 W for each m/s of the mean climb rate, by construction.
    for power in (climb, upper, lower):
        assert power.power_w == pytest.approx(500.0 + 30.0 * power.climb_rate_m_s, abs=3.0)
    assert climb.climb_rate_m_s == pytest.approx(3.0, rel=0.05)
    assert [leg.power_w for leg in legs] == pytest.approx([500.0] * 3, abs=2.0)
    assert upper.climb_rate_m_s < lower.climb_rate_m_s < 0.0


def test_a_model_without_references_or_mass_predicts_its_own_flights(
    records: list[FlightRecord],
) -> None:
    calm = [replace(r, airspeed_m_s=r.ground_speed_m_s, sha256="0" * 64) for r in records]
    model = identify_vehicle(calm, SETTINGS).model
    assert model.ramps is not None
    assert model.mass_kg is None
    assert isinstance(model.hover, AltitudeLaw)
    assert model.hover.coefficient_w == pytest.approx(500.0, rel=0.02)
    assert model.vertical is not None
    # 30 W for each m/s by construction.
    rates, watts = model.vertical.climb_rate_m_s, model.vertical.power_above_hover_w
    assert watts == pytest.approx([30.0 * rate for rate in rates], abs=8.0)
    text = vehicle_text(model)
    assert vehicle_from_toml(text.encode(), name="closed", source=model.source) == model


def test_unknown_loads_are_taken_out_before_a_law_is_fitted() -> None:
    def power(power_w: float) -> MeasuredPower:
        return MeasuredPower(
            power_w=power_w, error_w=1.0, duration_s=10.0, height_above_home_m=20.0
        )

    light = (power(440.0), power(460.0))
    heavy = (power(572.0), power(598.0))  # 1.3 times as much
    brought = [p.power_w for p in at_mean_load((light, heavy))]
    mean = 0.5 * (450.0 + 585.0)
    assert brought[:2] == pytest.approx([440.0 * mean / 450.0, 460.0 * mean / 450.0])
    assert brought[2:] == pytest.approx(brought[:2])


def test_unknown_loads_are_in_the_spread(records: list[FlightRecord]) -> None:
    loads = np.array([0.9, 1.0, 1.1, 0.9, 1.1])
    loaded = [
        replace(r, airspeed_m_s=r.ground_speed_m_s, power_w=r.power_w * load)
        for r, load in zip(records, loads, strict=True)
    ]
    spread = ramp_spread(loaded, SETTINGS)
    assert spread is not None
    assert spread.n_flights == 5
    # each flight by the mean load of the others
    apart = [load / np.delete(loads, i).mean() - 1.0 for i, load in enumerate(loads)]
    assert spread.energy_fraction == pytest.approx(np.sqrt(np.mean(np.square(apart))), abs=0.012)
    # durations are predicted to 0.7 s of 15 to 60 s
    assert spread.time_fraction is not None
    assert spread.time_fraction < 0.02
    model = identify_vehicle([replace(r, sha256="0" * 64) for r in loaded], SETTINGS).model
    assert model.spread == spread


def test_too_few_flights_have_no_spread(records: list[FlightRecord]) -> None:
    assert ramp_spread(records[:3], SETTINGS) is None  # without one of them two are left


@pytest.mark.parametrize(("growth", "is_flat"), [(0.0, True), (0.5, False)])
def test_power_grows_with_the_speed_where_flights_left_out_say_so(
    growth: float, *, is_flat: bool
) -> None:
    random = np.random.default_rng(8)

    def leg(flight: int, speed_m_s: float) -> MeasuredPower:
        return MeasuredPower(
            power_w=500.0 + growth * speed_m_s**2 + random.normal(0.0, 5.0),
            error_w=1.0,
            duration_s=20.0,
            height_above_home_m=30.0,
            airspeed_m_s=speed_m_s,
            source=f"{flight}.csv#1",
        )

    legs = [leg(flight, speed) for flight in range(6) for speed in (3.0, 7.0, 11.0)]
    found = identify_manoeuvre_power(legs)
    assert isinstance(found.cruise, CruisePower)
    at_11_m_s = found.cruise.power_above_hover_w[-1]
    # 60 W at 11 m/s: told to 5 W / sqrt(6) and as much of the hover
    assert at_11_m_s == (0.0 if is_flat else pytest.approx(60.5, abs=10.0))


def test_each_step_is_reported_before_it_is_done(records: list[FlightRecord]) -> None:
    steps: list[str] = []
    hashed = [replace(r, sha256="0" * 64) for r in records]
    identify_vehicle(hashed, SETTINGS, on_step=steps.append)
    assert [step.split()[0] for step in steps] == ["cutting"] * 5 + ["fitting", "predicting"]


def test_flights_that_tell_neither_speed_nor_height_make_no_model() -> None:
    landed = np.arange(600) < 50
    blind = replace(make_record(is_landed=landed), autopilot=Autopilot.ARDUPILOT)
    with pytest.raises(IdentificationError, match="neither speed nor height"):
        identify_vehicle([blind], SETTINGS)
