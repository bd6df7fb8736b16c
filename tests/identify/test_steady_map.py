"""Momentum theory fitted to steady flight, and steady flight found in a record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from made_record import make_record

from planner.errors import IdentificationError
from planner.identify.power import identify_power
from planner.identify.power_laws import fit_steady_map, mean_powers_w
from planner.identify.segments import (
    FlownPart,
    MeasuredPower,
    flown_acceleration,
    flown_parts,
    record_air_density_kg_m3,
    steady_flight,
)
from planner.physics.rotor import Acceleration, Rotor, momentum_power_w
from planner.values import field_values, replace
from planner.vehicle.law_factors import LawSpread, energy_fractions, moved_rotor
from planner.vehicle.model import ModelSpread
from planner.vehicle.power import AltitudeLaw, CruisePower, MomentumLaw

LAW = Rotor(
    disk_area_m2=0.4,
    drag_area_m2=0.05,
    induced_factor=1.5,
    axial_factor=1.3,
    profile_factor=0.3,
    profile_speed_factor=0.15,
)
CELLS = [(v, 0.0) for v in (0.0, 3.0, 6.0, 9.0, 12.0, 15.0)] + [(0.0, 2.0), (0.0, -1.5)]


def flights(
    noise_w: float = 0.0, *, mass_kg: float = 2.5, source: str = "a#1", law: Rotor = LAW
) -> list[MeasuredPower]:
    generator = np.random.default_rng(7)
    return [
        MeasuredPower(
            power_w=float(
                momentum_power_w(speed, climb, law, mass_kg=mass_kg, air_density_kg_m3=1.18)
            )
            + noise_w * float(generator.standard_normal()),
            error_w=max(noise_w, 0.1),
            duration_s=20.0,
            height_above_home_m=50.0,
            airspeed_m_s=speed,
            climb_rate_m_s=climb,
            air_density_kg_m3=1.18,
            mass_kg=2.5,
            source=source,
        )
        for speed, climb in CELLS
        for _ in range(4)
    ]


def test_the_power_comes_back_within_the_share_the_priors_may_move_it() -> None:
    found = fit_steady_map(flights())
    # the priors pull, but by far less than the 1 % to which the law is believed
    for flight in flights():
        [error] = found.residuals_w([flight])
        assert abs(error) < 0.01 * flight.power_w
    assert found.cells == len(CELLS)


def test_speeds_over_ground_of_flights_one_way_do_not_move_the_power_of_others() -> None:
    # 6 m/s behind another flight of the same vehicle: what it flies at 9 m/s looks like 15 m/s
    blown = [
        replace(one, airspeed_m_s=one.airspeed_m_s + 6.0, source="b#1")
        for one in flights()
        if one.airspeed_m_s >= 6.0
    ]
    mixed = fit_steady_map([*flights(), *(replace(one, is_one_way=True) for one in blown)])
    for flight in flights():
        [error] = mixed.residuals_w([flight])
        assert abs(error) < 0.01 * flight.power_w  # as without it, above
    assert mixed.behind_m_s["b#1"] == pytest.approx(6.0, abs=0.5)
    # taken for the airspeed it is, it says that 15 m/s cost a tenth less
    [error] = fit_steady_map([*flights(), *blown]).residuals_w(
        [one for one in flights() if one.airspeed_m_s == 15.0][:1]
    )
    assert error < -0.05 * max(one.power_w for one in flights())


def test_the_numbers_come_back_within_their_errors() -> None:
    found = fit_steady_map(flights(noise_w=1.0))
    for estimate in found.estimates:
        assert abs(estimate.value - getattr(LAW, estimate.name)) < 3.0 * estimate.error


def test_a_manoeuvre_takes_the_mean_power_of_what_was_flown_in_it() -> None:
    # Half of it hovering, half at 12 m/s: 6 m/s in the mean, where the power is least.
    parts = (FlownPart(0.0, 0.0, 0.0, 0.0, 0.0), FlownPart(12.0, 0.0, 2.0, 0.0, 0.0))
    [still] = flights()[:1]
    speeding = Acceleration(along_m_s2=2.0, across_m_s2=0.0, up_m_s2=0.0)
    hover_w, fast_w = (
        float(momentum_power_w(v, 0.0, LAW, mass_kg=2.5, air_density_kg_m3=1.18, acceleration=a))
        for v, a in ((0.0, None), (12.0, speeding))
    )
    both = replace(still, airspeed_m_s=6.0, parts=parts)
    watts = mean_powers_w(LAW, [still, both, still])
    assert watts == pytest.approx([hover_w, 0.5 * (hover_w + fast_w), hover_w])


def test_the_seconds_of_a_record_hold_how_it_speeds_up_and_turns() -> None:
    # 20 s at 2 m/s² to the east, then 10 s of a circle at 40 m/s, 0.1 rad/s: 4 m/s² across
    time_s = np.arange(0.0, 30.0, 0.1)
    angle = 0.1 * np.maximum(time_s - 20.0, 0.0)
    speed = np.minimum(2.0 * time_s, 40.0)
    record = make_record(
        is_landed=np.zeros(time_s.size, dtype=bool),
        ground_speed_m_s=speed,
        velocity_east_m_s=speed * np.cos(angle),
        velocity_north_m_s=speed * np.sin(angle),
        climb_m_s=0.5 * time_s,
    )
    parts = flown_parts(record, record.time_s >= 0.0)
    assert len(parts) == 29
    for second, one in enumerate(parts):
        assert one.up_m_s2 == pytest.approx(0.5)
        assert one.climb_rate_m_s == pytest.approx(0.5 * (second + 0.5))
        expected = (2.0, 0.0) if second < 20 else (0.0, 4.0)
        # the chord of 0.1 rad is 0.04 % shorter than its arc
        assert (one.along_m_s2, one.across_m_s2) == pytest.approx(expected, abs=0.002)
    # the same at every sample, away from where it ends to speed up; half a second aside of it both mix
    found = flown_acceleration(record)
    speeds_up, turns = (time_s > 1.0) & (time_s < 19.0), (time_s > 21.0) & (time_s < 29.0)
    for which, changes in ((speeds_up, (2.0, 0.0, 0.5)), (turns, (0.0, 4.0, 0.5))):
        along, across, up = (np.asarray(one)[which] for one in found)
        for one, value in zip((along, np.abs(across), up), changes, strict=True):
            assert one == pytest.approx(np.full(one.size, value), abs=0.01)


def test_hovers_in_number_do_not_drown_one_cruise() -> None:
    few = flights()
    [hover, *_] = few
    many = [*few, *[hover] * 500]
    fast = next(f for f in few if f.airspeed_m_s == 15.0)
    [error] = fit_steady_map(many).residuals_w([fast])
    assert abs(error) < 0.01 * fast.power_w


def test_flights_that_nowhere_hover_have_a_power_by_theory() -> None:
    # a survey at one speed in the wind: an airspeed upwind and one downwind, and climbs and holds in it
    windy = [f for f in flights(noise_w=1.0) if f.airspeed_m_s in {3.0, 9.0}]
    law = identify_power(windy, is_wind_known=True).cruise
    assert isinstance(law, MomentumLaw)
    rotor = Rotor(**field_values(law))
    for airspeed, within in ((3.0, 0.01), (9.0, 0.01), (0.0, 0.08)):
        own, true = (
            momentum_power_w(airspeed, 0.0, one, mass_kg=2.5, air_density_kg_m3=1.18)
            for one in (rotor, LAW)
        )
        assert own == pytest.approx(true, rel=within)
    one_speed = [f for f in windy if f.airspeed_m_s == 9.0]
    assert not identify_power(one_speed, is_wind_known=True).is_known
    # over ground, two ways with the wind are no two airspeeds
    assert not identify_power(windy).is_known


def test_flights_that_hover_better_than_ideal_make_no_law() -> None:
    with pytest.raises(IdentificationError, match="better than ideal"):
        fit_steady_map([replace(f, power_w=0.4 * f.power_w) for f in flights()])


def test_a_vortex_ring_is_found_where_descents_show_it() -> None:
    with_ring = flights(noise_w=1.0, law=LAW._replace(vortex_ring_factor=1.0))
    assert fit_steady_map(with_ring).law.vortex_ring_factor == 1.0
    assert fit_steady_map(flights(noise_w=1.0)).law.vortex_ring_factor == 0.0
    level = [f for f in with_ring if f.climb_rate_m_s >= 0.0]
    assert fit_steady_map(level).law.vortex_ring_factor == 0.0


def test_many_flights_that_differ_tell_more_than_one() -> None:
    # thirty level flights 4 % apart, whose mean is right, beside one of a descent that is 8 % wrong
    apart = [0.96, 1.04]
    level = [
        replace(f, power_w=f.power_w * apart[n % 2])
        for f in flights()
        if f.climb_rate_m_s == 0.0
        for n in range(8)
    ]
    descent = next(f for f in flights() if f.climb_rate_m_s < 0.0)
    errors = {}
    for count in (1, len(level)):
        wrong = replace(descent, power_w=0.92 * descent.power_w)
        found = fit_steady_map([*level, *[wrong] * count])
        hover = next(f for f in flights() if f.airspeed_m_s == 0.0)
        errors[count] = abs(found.residuals_w([hover])[0]) / hover.power_w
    assert errors[1] < 0.005
    assert errors[1] < errors[len(level)]


def test_as_many_kinds_of_flight_as_numbers_tell_nearly_as_much_as_one_more() -> None:
    # Each 6 % off by turns.  Of six numbers the priors hold some: six cells leave the rest over.  The seventh
    # is a climb, which tells little of the others.
    def off(cells: int) -> list[MeasuredPower]:
        kept = CELLS[:cells]
        return [
            replace(one, power_w=one.power_w * (1.0 + 0.06 * (-1.0) ** place))
            for place, cell in enumerate(kept)
            for one in flights(noise_w=0.1)
            if (one.airspeed_m_s, one.climb_rate_m_s) == cell
        ]

    by_six, by_seven = (fit_steady_map(off(cells)) for cells in (6, 7))
    assert (by_six.cells, by_seven.cells) == (6, 7)
    for six, seven in zip(by_six.estimates, by_seven.estimates, strict=True):
        assert six.error < 1.25 * seven.error


def test_unknown_payloads_are_separated_from_the_law() -> None:
    light = flights(mass_kg=2.3, source="light#1")
    heavy = flights(mass_kg=2.7, source="heavy#1")
    found = fit_steady_map([*light, *heavy], mass_deviation_kg=0.2)
    difference = found.beyond_kg["heavy#1"] - found.beyond_kg["light#1"]
    assert difference == pytest.approx(0.4, rel=0.1)  # the prior pulls both together a little
    assert max(abs(found.residuals_w([*light, *heavy]))) < 0.015 * 250.0


def test_what_the_flights_do_not_show_is_reported_to_come_from_the_prior() -> None:
    slow = [f for f in flights() if f.airspeed_m_s <= 6.0 and f.climb_rate_m_s == 0.0]
    found = fit_steady_map(slow)
    assert "drag_area_m2" in found.from_prior
    assert "axial_factor" in found.from_prior


def test_too_few_airspeeds_or_no_mass_are_refused() -> None:
    with pytest.raises(IdentificationError, match="at 3 airspeeds"):
        fit_steady_map([f for f in flights() if f.airspeed_m_s <= 3.0])
    with pytest.raises(IdentificationError, match="needs the mass"):
        fit_steady_map([replace(f, mass_kg=None) for f in flights()])


def test_without_a_mass_the_power_is_tabled_state_by_state() -> None:
    found = identify_power([replace(f, mass_kg=None) for f in flights()])
    assert isinstance(found.hover, AltitudeLaw)
    hover_w = float(momentum_power_w(0.0, 0.0, LAW, mass_kg=2.5, air_density_kg_m3=1.18))
    assert found.hover.coefficient_w == pytest.approx(hover_w, rel=1e-5)
    assert found.hover.exponent == 0.0  # all hovers are at one height
    assert isinstance(found.cruise, CruisePower)
    assert found.cruise.speed_m_s == (0.0, 3.0, 6.0, 9.0, 12.0, 15.0)
    assert found.vertical is not None
    assert found.vertical.climb_rate_m_s == (-1.5, 0.0, 2.0)
    climb_w = float(momentum_power_w(0.0, 2.0, LAW, mass_kg=2.5, air_density_kg_m3=1.18))
    assert found.vertical.power_above_hover_w[2] == pytest.approx(climb_w - hover_w, abs=0.01)


def test_with_a_mass_it_is_one_law() -> None:
    found = identify_power(flights())
    assert isinstance(found.cruise, MomentumLaw)
    assert found.hover is None
    [outcome] = found.outcomes
    assert outcome.held_out == len(CELLS)
    assert outcome.fit_percent is not None
    assert outcome.fit_percent > 95.0


def test_one_span_held_out_has_no_fit_but_an_error() -> None:
    """It has no spread about its mean: of a short flight the model was refused for a fit of -inf."""
    found = identify_power(flights(noise_w=1.0)[::4][:6])
    assert isinstance(found.cruise, MomentumLaw)
    [outcome] = found.outcomes
    assert outcome.held_out == 1
    assert outcome.fit_percent is None
    assert outcome.rms is not None
    assert outcome.rms > 0.0


def test_steady_flight_is_what_does_not_accelerate_clear_of_the_ground() -> None:
    time_s = np.arange(900) * 0.1
    # on the ground to 10 s, up 20 m until 20 s, standing to 40, 8 m/s from 44 to 74 s, braking
    height = np.interp(time_s, [10.0, 20.0], [0.0, 20.0])
    speed = np.interp(time_s, [40.0, 44.0, 74.0, 78.0], [0.0, 8.0, 8.0, 0.0])
    power = np.interp(time_s, [40.0, 44.0, 74.0, 78.0], [200.0, 160.0, 160.0, 200.0])
    record = make_record(
        is_landed=time_s < 10.0,
        height_above_home_m=height,
        altitude_amsl_m=height + 400.0,
        ground_speed_m_s=speed,
        velocity_north_m_s=speed,
        velocity_east_m_s=np.zeros(900),
        climb_m_s=np.where((time_s > 10.0) & (time_s < 20.0), 2.0, 0.0),
        power_w=power,
    )
    found = steady_flight(record, air_density_kg_m3=record_air_density_kg_m3(record))
    kinds = {(round(f.airspeed_m_s), round(f.climb_rate_m_s), round(f.power_w)) for f in found}
    assert kinds == {(0, 2, 200), (0, 0, 200), (8, 0, 160)}
    assert min(f.start_s for f in found) > 13.0  # 3 s from the ground
    assert all(f.duration_s < 31.0 for f in found)


def test_a_record_without_power_holds_no_steady_flight() -> None:
    record = make_record(
        is_landed=np.zeros(600, dtype=np.bool_),
        height_above_home_m=np.full(600, 50.0),
        ground_speed_m_s=np.zeros(600),
        climb_m_s=np.zeros(600),
    )
    density = record_air_density_kg_m3(record)
    assert density[0] == pytest.approx(1.2191, abs=1e-3)  # standard air at 50 m
    assert steady_flight(record, air_density_kg_m3=density) == ()


def test_factors_of_a_fit_are_those_that_move_its_rotor() -> None:
    # a step of each number of the fit, as factors, moves the rotor to where the step leads
    rotor = LAW
    names = rotor._fields[:6]
    for row, name in enumerate(names):
        step = np.zeros((6, 6))
        step[row, row] = 1e-8  # a standard deviation of 1e-4
        found = LawSpread.of_fit(rotor, step)
        # of one number the factors are wholly correlated: their signs are those of their correlations
        largest = int(np.argmax(found.deviations))
        sign = np.sign(found.covariance[largest] + 1e-30)
        moved = moved_rotor(
            rotor, dict(zip(found.names, (sign * found.deviations).tolist(), strict=True))
        )
        ratios = {one: math.log(getattr(moved, one) / getattr(rotor, one)) for one in names}
        # but for the direction of the step
        assert abs(ratios.pop(name)) == pytest.approx(1e-4, rel=1e-3)
        assert all(abs(one) < 1e-7 for one in ratios.values()), name


def test_what_a_fit_leaves_open_of_its_law_is_a_prior_for_further_flights() -> None:
    found = fit_steady_map(flights(noise_w=1.0))
    law = LawSpread.of_fit(Rotor(**field_values(found.law)), found.log_covariance)
    spread = ModelSpread(
        energy_fraction=0.03,
        n_flights=1,
        source="made",
        law_fraction=law.law_fraction,
        law_correlation=law.law_correlation,
    )
    read = LawSpread.of_model(spread)
    assert read.names == law.names
    assert read.covariance == pytest.approx(law.covariance, rel=0.01, abs=1e-5)
    # drag, blades and induced power are hardly told apart, their sum is: 1 % is what the law is believed to
    fractions = energy_fractions(
        Rotor(**field_values(found.law)), read, mass_kg=2.5, avionics_w=0.0
    )
    assert dict(law.law_fraction)["drag_area_m2"] > 0.05
    assert fractions.shared < 0.01
    assert fractions.beside["cruise"] < 0.015


def test_correlations_that_cannot_be_are_refused() -> None:
    known: dict[str, Any] = {"energy_fraction": 0.03, "n_flights": 1, "source": "made"}
    law = (("hover", 0.1), ("axial_factor", 0.1), ("drag_area_m2", 0.1))
    ModelSpread(**known, law_fraction=law, law_correlation=(0.9, 0.9, 0.9))
    for correlation in ((0.9,), (0.9, 0.9, -0.9)):
        with pytest.raises(ValueError, match="law_correlation"):
            ModelSpread(**known, law_fraction=law, law_correlation=correlation)
