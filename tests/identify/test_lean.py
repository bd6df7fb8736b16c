"""The airspeed at the greatest lean angle and the exponent of the drag, from made flights."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_record import make_record

from planner.identify.lean import LEANT_WIND, identified_lean
from planner.identify.refinement import refine_vehicle
from planner.logs.record import LoggedQuantity
from planner.report.endurance import refinement_text
from planner.report.text import Medium
from planner.values import replace
from planner.vehicle.declared import Interval
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import Aloft

if TYPE_CHECKING:
    from planner.identify.refinement import Refinement
    from planner.logs.record import FlightRecord

BY_LEAN = LoggedQuantity(
    name="wind_north_m_s", found_in=LEANT_WIND, rate_hz=None, coverage=1.0, absence_cost="calm"
)
SPAN = 200
"""Samples of each steady flight: 20 s."""


def flight(*flown: tuple[float, float, float], limit_cdeg: float | None = 3000.0) -> FlightRecord:
    """Return steady level flights to and fro: airspeed, lean in degrees, speed commanded."""
    airspeed, lean, commanded = (
        np.concatenate([np.full(SPAN, one[k]) for one in flown]) for k in range(3)
    )
    zero = np.zeros(airspeed.size)
    record = make_record(
        is_landed=np.zeros(airspeed.size, np.bool_),
        ground_speed_m_s=airspeed,
        velocity_north_m_s=airspeed * np.repeat((-1.0) ** np.arange(len(flown)), SPAN),
        velocity_east_m_s=zero,
        climb_m_s=zero,
        height_above_home_m=zero + 50.0,
        roll_deg=zero,
        pitch_deg=-lean,
        reference_speed_m_s=commanded,
    )
    return replace(record, parameters={} if limit_cdeg is None else {"ANGLE_MAX": limit_cdeg})


def lean_deg(airspeed: float, limit: float = 10.0, exponent: float = 1.4) -> float:
    drag = math.tan(math.radians(30.0)) * (airspeed / limit) ** exponent
    return math.degrees(math.atan(drag))


def test_the_airspeed_at_the_greatest_lean_angle_is_that_of_the_vehicle() -> None:
    record = flight((5.0, lean_deg(5.0), 5.0), (8.0, lean_deg(8.0), 8.0), (10.0, 30.0, 12.0))
    found = identified_lean([record])
    assert found.airspeed_limit_m_s == 10.0
    assert found.limit_lean_deg == 30.0
    assert found.drag_exponent == pytest.approx(1.4, abs=0.005)


def test_less_lean_tells_the_limit_where_the_exponent_of_the_drag_is_known() -> None:
    found = identified_lean([flight((5.0, 10.0, 5.0), (10.0, 29.0, 12.0))])
    exponent = math.log(math.tan(math.radians(29.0)) / math.tan(math.radians(10.0))) / math.log(2.0)
    assert found.drag_exponent == pytest.approx(exponent, abs=0.005)
    # what was flown is sure, at the lean that its drag asks for; beyond it the exponent tells
    assert found.airspeed_limit_m_s == pytest.approx(10.0)
    assert found.limit_lean_deg == pytest.approx(29.0, abs=0.01)


def test_the_limit_is_that_of_legs_flown_nose_first() -> None:
    # ArduCopter's simulator, calm: 29.3° at 10.0 m/s of legs flown nose first, 26.5° of a return flown
    # tail first; held to 10.21 m/s at 30°
    legs = [(3.98, 8.7, 4.0), (6.99, 18.6, 7.0), (8.98, 25.6, 9.0), (10.02, 26.5, 10.0)]
    record = flight(*legs)
    yaw_deg = np.where(record.velocity_north_m_s < 0.0, 180.0, 0.0)
    yaw_deg[-SPAN:] -= 180.0
    found = identified_lean([replace(record, yaw_deg=yaw_deg)])
    assert found.airspeed_limit_m_s == pytest.approx(10.02)
    assert found.limit_lean_deg == pytest.approx(29.3, abs=0.2)


def test_a_load_leans_less_against_the_same_drag() -> None:
    # 1 kg more on 3 kg, held to 30°: that drag is 4/3 of what 3 kg hold at 30°
    held = flight((5.0, lean_deg(5.0), 5.0), (10.0, 30.0, 12.0))
    found = identified_lean([held], times_heavier=[4.0 / 3.0])
    at_limit = math.degrees(math.atan(math.tan(math.radians(30.0)) * 4.0 / 3.0))
    limit = found.airspeed_limit_m_s, found.limit_lean_deg
    assert limit == pytest.approx((10.0, at_limit), abs=0.01)
    # ArduCopter's simulator with that load: 22.28° at 10.03 m/s; 3 kg are held to 10.21 m/s at 30°
    leant = [(one, lean_deg(one, 12.6, 1.48), one) for one in (5.0, 7.5, 10.03)]
    loaded = identified_lean([flight(*leant)], times_heavier=[4.0 / 3.0])
    model = replace(
        load_vehicle("arducopter-sitl-quad"),
        airspeed_limit_m_s=loaded.airspeed_limit_m_s,
        airspeed_limit_lean_deg=loaded.limit_lean_deg,
        drag_exponent=loaded.drag_exponent,
    )
    assert model.airspeed_limit_at(math.radians(30.0), Aloft()) == pytest.approx(10.21, rel=0.03)


def test_airspeeds_of_several_airs_are_those_in_the_densest() -> None:
    # 10 m/s in 1.2 kg/m³ are 11.18 m/s in 0.96 kg/m³ at the same lean
    thinner = math.sqrt(1.2 / 0.96)
    dense = flight((5.0, lean_deg(5.0), 5.0), (8.0, lean_deg(8.0), 8.0))
    thin = flight((6.0 * thinner, lean_deg(6.0), 7.0), (10.0 * thinner, 30.0, 14.0))
    found = identified_lean([dense, thin], air_kg_m3=[1.2, 0.96])
    assert found.airspeed_limit_m_s == pytest.approx(10.0)
    assert found.limit_air_kg_m3 == 1.2
    assert found.drag_exponent == pytest.approx(1.4, abs=0.005)
    alone = identified_lean([thin], air_kg_m3=[0.96])
    assert alone.airspeed_limit_m_s == pytest.approx(11.18)
    assert alone.limit_air_kg_m3 == 0.96
    # without a limit what is sure is so in any air, down to the sea's
    slow = flight((4.0, lean_deg(4.0), 4.0))
    sure_m_s = 4.0 * math.sqrt(2.5**1.4) * math.sqrt(0.96 / 1.225)
    low = identified_lean([slow], air_kg_m3=[0.96])
    assert low.sure_airspeed_m_s == pytest.approx(sure_m_s, abs=0.01)
    assert low.limit_air_kg_m3 is None


def test_a_limit_of_a_base_model_is_compared_in_one_air() -> None:
    # 11.1 m/s in 0.96 kg/m³ are 9.93 m/s in 1.2: more drag than what the flight was held to
    base = replace(
        load_vehicle("arducopter-sitl-quad"),
        airspeed_limit_m_s=11.1,
        airspeed_limit_lean_deg=30.0,
        airspeed_limit_air_density_kg_m3=0.96,
    )
    held = flight((5.0, lean_deg(5.0), 5.0), (10.0, 30.0, 12.0))
    kept = identified_lean([held], base, air_kg_m3=[1.2])
    assert (kept.airspeed_limit_m_s, kept.limit_air_kg_m3) == (11.1, 0.96)
    found = identified_lean([held], replace(base, airspeed_limit_m_s=11.3), air_kg_m3=[1.2])
    assert (found.airspeed_limit_m_s, found.limit_air_kg_m3) == (10.0, 1.2)


def test_what_still_speeds_a_vehicle_up_is_no_drag() -> None:
    # 0.2 m/s² of 9.81 are 0.0204 of the weight; 8 m/s in the middle of the second half
    steady = flight((8.0, lean_deg(8.0), 8.0))
    speed = 8.0 + 0.2 * 0.1 * (np.arange(SPAN) - 0.75 * SPAN)
    leant_deg = math.degrees(math.atan(math.tan(math.radians(lean_deg(8.0))) + 0.2 / 9.80665))
    gaining = replace(
        steady,
        ground_speed_m_s=speed,
        velocity_north_m_s=speed,
        pitch_deg=np.full(SPAN, -leant_deg),
    )
    sure = [identified_lean([one]).sure_airspeed_m_s for one in (steady, gaining)]
    assert sure[0] == pytest.approx(8.0 * math.sqrt((10.0 / 8.0) ** 1.4), abs=0.01)
    assert sure[1] == pytest.approx(sure[0], abs=0.02)


@pytest.mark.parametrize(
    ("flown", "sure_m_s"),
    [
        # one airspeed: any exponent, and drag goes by the square at most
        ([(4.0, lean_deg(4.0), 4.0)], 4.0 * math.sqrt(2.5**1.4)),
        # far from the limit: the least of what both tell
        ([(2.5, lean_deg(2.5), 2.5), (4.0, lean_deg(4.0), 4.0)], 2.5 * math.sqrt(4.0**1.4)),
        # a leg with the wind leans too little; what others tell of more lean is sure
        ([(7.0, lean_deg(7.0), 7.0), (10.0, 8.7, 10.0)], 7.0 * math.sqrt((10.0 / 7.0) ** 1.4)),
    ],
)
def test_from_far_less_lean_only_what_is_sure_is_known(
    flown: list[tuple[float, float, float]], sure_m_s: float
) -> None:
    found = identified_lean([flight(*flown)])
    assert found.airspeed_limit_m_s is None
    assert found.drag_exponent is None
    assert found.sure_airspeed_m_s == pytest.approx(sure_m_s, abs=0.01)


def test_what_is_sure_of_a_wind_that_the_lean_tells_is_two_deviations_less() -> None:
    # ArduCopter's simulator, attitudes 2.5° off: 10.1 m/s told of 9.6 flown, held to 10.94 m/s
    one = flight((10.0, 26.0, 10.0))
    zero = np.zeros(one.time_s.size)
    told = replace(one, wind_north_m_s=zero + 4.8, wind_east_m_s=zero, quantities=(BY_LEAN,))
    drag, limit = math.tan(math.radians(26.0)), math.tan(math.radians(30.0))
    error_m_s = math.hypot(0.15 * 4.8, math.radians(1.0) / 1.5 * 10.0 / drag)
    sure_m_s = (10.0 - 2.0 * error_m_s) * math.sqrt(limit / drag)
    assert identified_lean([told]).sure_airspeed_m_s == pytest.approx(sure_m_s, abs=0.01)


def test_no_flight_makes_sure_what_another_does_not() -> None:
    # a way with the wind: 8.7° at 10 m/s over ground would be 19.4 m/s at 30°
    downwind, calm = flight((10.0, 8.7, 10.0)), flight((4.0, lean_deg(4.0), 4.0))
    sure_m_s = 4.0 * math.sqrt(2.5**1.4)
    for records in ([calm], [downwind, calm], [calm, downwind]):
        assert identified_lean(records).sure_airspeed_m_s == pytest.approx(sure_m_s, abs=0.01)


@pytest.mark.parametrize("other", [(4.0, 8.7, 4.0), (8.0, 22.1, 8.0)])
def test_a_way_with_the_wind_widens_no_airspeed(other: tuple[float, float, float]) -> None:
    # ArduCopter's simulator: 500 m at 15 m/s over ground with 5.5 m/s of wind behind lean 27.5°
    downwind, calm = flight((15.0, 27.5, 15.0)), flight(other, other)
    found, alone = identified_lean([downwind, calm]), identified_lean([calm])
    assert found.sure_airspeed_m_s == alone.sure_airspeed_m_s
    assert found.shown_m_s(15.0) == alone.sure_airspeed_m_s
    # a limit that others show is not lost
    held = flight((5.0, lean_deg(5.0), 5.0), (10.0, 30.0, 12.0))
    assert identified_lean([downwind, held]).airspeed_limit_m_s == 10.0
    assert identified_lean([downwind, held]).shown_m_s(15.0) == 10.0
    # to and fro alone, what was flown was flown
    assert identified_lean([held]).shown_m_s(15.0) == 15.0


def test_a_flight_that_contradicts_itself_is_left_out_of_the_law_of_others() -> None:
    # 5 m/s in a wind of unknown strength: 1.7° with it, 23.8° against it, at two heights
    blown = flight((4.98, 1.7, 5.0), (5.0, 23.8, 5.0))
    legs = ((5.0, lean_deg(5.0), 5.0), (8.0, lean_deg(8.0), 8.0), (10.0, 30.0, 12.0))
    good = identified_lean([flight(*legs)])
    both = identified_lean([flight(*legs), blown])
    assert both.airspeed_limit_m_s == good.airspeed_limit_m_s == 10.0
    assert both.drag_exponent == good.drag_exponent
    # alone it tells at least what it leans most for
    alone = identified_lean([blown]).sure_airspeed_m_s
    most, least = (math.tan(math.radians(one)) for one in (30.0, 23.8))
    assert alone == pytest.approx(5.0 * math.sqrt(most / least), abs=0.01)


def test_a_limit_held_one_way_in_an_unknown_wind_is_not_certain() -> None:
    # ArduCopter's simulator: 20° at 9.6 m/s over ground, 2.2 m/s of wind behind: 7.37 m/s through the air
    one_way = flight((9.6, 20.0, 10.0), limit_cdeg=2000.0)
    alone = identified_lean([one_way])
    assert (alone.airspeed_limit_m_s, alone.limit_lean_deg) == (9.6, 20.0)
    assert alone.limit_fraction == pytest.approx(3.0 / 9.6, abs=0.005)
    # flights to and fro, 8 m/s at 22.2°, contradict it: theirs counts, as if it were not there
    legs = ((5.0, lean_deg(5.0, 10.21), 5.0), (8.0, 22.2, 8.0), (9.98, 29.0, 10.0))
    both, calm = identified_lean([flight(*legs), one_way]), identified_lean([flight(*legs)])
    assert (sorted(both.contradicted), sorted(calm.contradicted)) == ([1], [])
    assert both.airspeed_limit_m_s == calm.airspeed_limit_m_s == pytest.approx(9.98)
    assert both.limit_lean_deg == calm.limit_lean_deg


def test_a_limit_of_a_flight_that_contradicts_itself_is_not_certain() -> None:
    # ArduCopter's simulator, 4 m/s of wind: 5 m/s against it at 30 m, 14.24 m/s with it at the height of the
    # return, tail first and held to 30°; through the air it is 10.24 m/s
    blown = flight((5.0, 25.0, 5.0), (14.24, 30.0, 15.0))
    yaw_deg = np.where(blown.velocity_north_m_s < 0.0, 0.0, 180.0)
    yaw_deg[:SPAN] = 0.0
    blown = replace(blown, yaw_deg=yaw_deg)
    alone = identified_lean([blown])
    assert alone.airspeed_limit_m_s == 14.24
    assert alone.limit_fraction == pytest.approx(3.0 / 14.24, abs=0.005)
    # beside flights that do not, it is left out
    calm = flight((5.0, lean_deg(5.0), 5.0), (8.0, lean_deg(8.0), 8.0), (10.0, 30.0, 12.0))
    both = identified_lean([calm, blown])
    assert (both.airspeed_limit_m_s, sorted(both.contradicted)) == (10.0, [1])
    # of a frame with half as much drag again side on, both are in calm air
    aside = flight((9.0, lean_deg(9.0), 9.0), (11.0, 28.0, 15.0))
    aside = replace(aside, yaw_deg=np.where(aside.velocity_north_m_s < 0.0, 90.0, 0.0))
    assert not identified_lean([calm, aside]).contradicted


def test_of_airspeeds_flown_one_way_in_an_unknown_wind_that_of_the_wind_is_not_shown() -> None:
    # ArduCopter's simulator: 15 m/s over ground with 6.5 m/s behind at 40 m
    one_way = identified_lean([flight((15.0, 20.0, 15.0))])
    assert one_way.shown_m_s(15.0) == pytest.approx(15.0 - 2.0 * 3.0)
    assert one_way.shown_m_s(5.0) == pytest.approx(0.2 * 5.0)  # nothing is less certain than that
    # each of two ways may have had its own wind behind it
    back = flight((15.0, 20.0, 15.0))
    back = replace(back, velocity_north_m_s=-back.velocity_north_m_s)
    assert identified_lean([flight((15.0, 20.0, 15.0)), back]).shown_m_s(15.0) == 9.0
    to_and_fro = identified_lean([flight((15.0, 20.0, 15.0), (15.0, 20.0, 15.0))])
    assert to_and_fro.shown_m_s(15.0) == 15.0


def test_a_limit_held_one_way_may_have_a_breeze_in_it_too_weak_to_be_told() -> None:
    # ArduCopter's simulator: 8 m/s against 0.9 m/s, 11.14 with it at 30°; 10.24 through the air.  Any wind up
    # to 1 m/s has a standard deviation of 1/√3
    legs = (8.0, 23.0, 8.0), (11.14, 30.0, 15.0)
    breezy, both_ways = flight(*legs), flight(*legs, (9.34, 30.0, 15.0))
    assert identified_lean([breezy]).limit_fraction == pytest.approx(
        math.hypot(0.01, 1.0 / math.sqrt(3.0) / 11.14), abs=5e-4
    )
    answered = identified_lean([both_ways])
    assert (answered.airspeed_limit_m_s, answered.limit_fraction) == (9.34, 0.01)


def test_a_limit_known_better_takes_the_place_of_one_known_worse() -> None:
    # 14.24 m/s held with the wind behind, and 5.67 against it: 21 and 40 % uncertain
    calm = flight((10.0, 30.0, 12.0), (10.0, 30.0, 12.0))
    near = flight(*((one, lean_deg(one), one) for one in (4.0, 5.0, 8.0, 9.8)))
    for wrong_m_s, fraction in ((14.24, 0.21), (5.67, 0.4)):
        base = replace(
            load_vehicle("arducopter-sitl-quad"),
            airspeed_limit_m_s=wrong_m_s,
            airspeed_limit_lean_deg=30.0,
            airspeed_limit_fraction=fraction,
        )
        assert identified_lean([calm], base).airspeed_limit_m_s == 10.0
        assert identified_lean([near], base).airspeed_limit_m_s == pytest.approx(9.8)
    # known as well as what is flown it stays: a tailwind has no part in the lesser
    sure = replace(base, airspeed_limit_fraction=0.01)
    assert identified_lean([calm], sure).airspeed_limit_m_s == 5.67
    assert identified_lean([near], sure).airspeed_limit_m_s == 5.67


def test_what_leans_as_far_as_the_limit_is_at_it_whatever_speed_it_keeps() -> None:
    found = identified_lean([flight((5.0, lean_deg(5.0), 5.0), (10.4, 30.0, 10.4))])
    assert (found.airspeed_limit_m_s, found.limit_lean_deg) == (10.4, 30.0)


def test_of_limits_at_several_leans_the_one_with_the_most_drag_counts() -> None:
    # held to 10.21 m/s at 30°, and in a wind to 7.711 m/s at 20°, which is 5 % too much
    slow = flight((4.0, lean_deg(4.0, 10.21), 4.0), (7.711, 20.0, 9.0), limit_cdeg=2000.0)
    full = flight((4.0, lean_deg(4.0, 10.21), 4.0), (10.21, 30.0, 12.0))
    for records in ([slow, full], [full, slow]):
        found = identified_lean(records)
        assert (found.airspeed_limit_m_s, found.limit_lean_deg) == (10.21, 30.0)
    known = replace(
        load_vehicle("arducopter-sitl-quad"), airspeed_limit_m_s=10.21, airspeed_limit_lean_deg=30.0
    )
    kept = identified_lean([slow], known)
    assert (kept.airspeed_limit_m_s, kept.limit_lean_deg) == (10.21, 30.0)


def test_without_the_parameter_nobody_knows_the_limit() -> None:
    assert identified_lean([flight((10.0, 30.0, 12.0), limit_cdeg=None)]).limit_lean_deg is None


def test_the_limit_is_that_of_the_position_controller_where_it_has_one() -> None:
    for psc_deg, limit_deg in ((20.0, 20.0), (0.0, 30.0)):
        one = flight((10.0, limit_deg, 12.0))
        one = replace(one, parameters={**one.parameters, "PSC_ANGLE_MAX": psc_deg})
        assert identified_lean([one]).limit_lean_deg == pytest.approx(limit_deg)


def test_of_flights_with_and_against_an_unknown_wind_the_slower_counts() -> None:
    found = identified_lean([flight((12.0, 30.0, 14.0), (8.0, 30.0, 14.0))])
    assert found.airspeed_limit_m_s == 8.0


@pytest.mark.parametrize(("exponent", "found"), [(0.5, 1.0), (2.5, 2.0)])
def test_drag_is_between_that_of_rotors_and_of_a_body(exponent: float, found: float) -> None:
    record = flight((5.0, lean_deg(5.0, exponent=exponent), 5.0), (10.0, 30.0, 12.0))
    assert identified_lean([record]).drag_exponent == found


def test_what_the_flights_do_not_show_is_of_the_base_model() -> None:
    base = replace(
        load_vehicle("arducopter-sitl-quad"), airspeed_limit_m_s=18.0, airspeed_limit_lean_deg=30.0
    )
    found = identified_lean([flight((5.0, 10.0, 5.0))], base)
    assert (found.airspeed_limit_m_s, found.limit_lean_deg) == (18.0, 30.0)


@pytest.mark.parametrize(
    ("exponent", "lean", "expected"),
    [
        (1.4, 45.0, 10.0 * math.sqrt(3.0) ** (1 / 1.4)),
        (None, 45.0, 10.0 * math.sqrt(3.0) ** 0.5),  # the slower of what is possible
        (
            1.4,
            49.0,
            10.0 * (math.sqrt(3.0) * math.tan(math.radians(49.0))) ** (1 / 1.4),
        ),  # 1.99 times
        (1.4, 50.0, 10.0 * (math.sqrt(3.0) * math.tan(math.radians(50.0))) ** 0.5),  # 2.06: too far
        (None, 20.0, 10.0 * math.sqrt(3.0) * math.tan(math.radians(20.0))),
        (1.4, 30.0, 10.0),
    ],
)
def test_with_another_lean_angle_the_airspeed_is_another(
    exponent: float | None, lean: float, expected: float
) -> None:
    model = replace(
        load_vehicle("arducopter-sitl-quad"),
        airspeed_limit_m_s=10.0,
        airspeed_limit_lean_deg=30.0,
        drag_exponent=exponent,
    )
    assert model.airspeed_limit_at(math.radians(lean), Aloft()) == pytest.approx(expected)
    assert replace(model, airspeed_limit_lean_deg=None).airspeed_limit_at(1.0, Aloft()) == 10.0


def refined(*flown: tuple[float, float, float]) -> Refinement:
    record = flight(*flown)
    samples = np.ones(record.time_s.size)
    record = replace(record, power_w=250.0 * samples, voltage_v=15.0 * samples)
    return refine_vehicle(load_vehicle("holybro-x500-v2"), [record])


def test_a_refined_model_is_held_to_what_its_flight_was_held_to() -> None:
    found = refined((5.0, lean_deg(5.0), 5.0), (8.0, lean_deg(8.0), 8.0), (10.0, 30.0, 12.0))
    assert found.model.airspeed_limit_m_s == 10.0
    said = "Airspeed held to 10.0 m/s at 30° of lean."
    assert said in refinement_text(found, medium=Medium())


def test_the_airspeeds_of_a_data_sheet_end_where_the_lean_is_not_sure_to_hold_them() -> None:
    # flown by ArduCopter's simulator: 8.66° at 3.98 m/s; it leans 30° at 10.2 m/s, the sheet has 14.4
    found = refined((3.98, 8.66, 4.0))
    assert load_vehicle("holybro-x500-v2").valid_for.speed_m_s == Interval(low=0.0, high=14.4)
    sure = 3.98 * math.sqrt(math.tan(math.radians(30.0)) / math.tan(math.radians(8.66)))
    shown = found.model.valid_for.speed_m_s
    assert shown is not None
    assert shown.high == pytest.approx(sure * math.sqrt(1.219 / 1.225), abs=0.01)
    assert found.model.airspeed_limit_m_s is None


def test_a_vehicle_that_leans_little_keeps_the_airspeeds_of_its_data_sheet() -> None:
    # the square of 4 m/s grows to 14.4 m/s under 30° up to 2.54°
    found = refined((4.0, 2.5, 4.0))
    assert found.model.valid_for.speed_m_s == Interval(low=0.0, high=14.4)


def test_a_wind_that_the_lean_tells_leaves_the_limit_less_sure() -> None:
    legs = ((5.0, lean_deg(5.0), 5.0), (8.0, lean_deg(8.0), 8.0))
    held = flight(*legs, (10.0, 30.0, 12.0))
    zero = np.zeros(held.time_s.size)
    blown = replace(held, wind_north_m_s=zero + 4.0, wind_east_m_s=zero, quantities=(BY_LEAN,))
    assert identified_lean([flight((10.0, 30.0, 12.0), (10.0, 30.0, 12.0))]).limit_fraction == 0.01
    # at 10 m/s 15 % of 4 m/s, and what 1° of trim takes by the slope of the drag, 1.5 of it over the airspeed
    slopes = [
        math.tan(math.radians(lean)) / airspeed for airspeed, lean, _ in (*legs, (10.0, 30.0, 0.0))
    ]
    trim_m_s = math.radians(1.0) / 1.5 * sum(1.0 / one for one in slopes) / 3.0
    assert 0.2 < trim_m_s < 0.3
    assert identified_lean([blown]).limit_fraction == pytest.approx(
        math.hypot(0.01, 0.06, trim_m_s / 10.0), abs=1e-3
    )
    # where the limit was not come to, it is not known from such airspeeds
    near = flight(*legs, (9.8, lean_deg(9.8), 9.8))
    zero = np.zeros(near.time_s.size)
    blown = replace(near, wind_north_m_s=zero + 4.0, wind_east_m_s=zero, quantities=(BY_LEAN,))
    assert identified_lean([near]).airspeed_limit_m_s == pytest.approx(9.8)
    assert identified_lean([blown]).airspeed_limit_m_s is None
    # calm flights tell the drag beside windy ones
    assert identified_lean([near, blown]).limit_lean_deg == identified_lean([near]).limit_lean_deg
