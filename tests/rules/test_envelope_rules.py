"""Flight outside what the model knows: always said, at the boundary too."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.findings import Severity
from planner.flight.motion.ardupilot import splines
from planner.physics.wind import Wind
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import Responses
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.power import CruisePower

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem

VEHICLE = load_vehicle("falkowski-2023-quadrotor")
BATTERY = Battery(capacity_wh=500.0)


def found(code: str, *items: MissionItem, autopilot: Autopilot | None = None) -> list[Finding]:
    return of(code, mission(*items, autopilot=autopilot))


def of(code: str, one: Mission) -> list[Finding]:
    return [f for f in check(one, VEHICLE, battery=BATTERY).findings if f.code == code]


@pytest.mark.parametrize(("speed_m_s", "fires"), [(9.9, False), (10.0, False), (10.1, True)])
def test_a_speed_beyond_the_identified_one_is_an_error(speed_m_s: float, fires: bool) -> None:  # noqa: FBT001 - a table of cases
    [*beyond] = [
        f
        for f in found("E105", takeoff(100), speed(speed_m_s), waypoint(900, 100), rtl())
        if f.severity is Severity.ERROR
    ]
    assert bool(beyond) is fires
    if fires:
        assert beyond[0].item == 3
        assert "10.1 m/s" in beyond[0].message


@pytest.mark.parametrize(
    ("name", "known", "command"),
    [
        ("falkowski-2023-quadrotor", "was identified from", "mavjoule identify"),
        ("3dr-iris-plus", "of a data sheet holds up to", "mavjoule vehicle refine"),
    ],
)
def test_a_model_of_a_data_sheet_is_narrowed_not_identified(
    name: str, known: str, command: str
) -> None:
    one = mission(takeoff(40), speed(16.0), waypoint(900, 40), rtl())
    [beyond, *_] = [f for f in check(one, load_vehicle(name)).findings if f.code == "E105"]
    assert known in beyond.message
    assert command in beyond.fix


@pytest.mark.parametrize(("height_m", "fires"), [(199.0, False), (200.0, False), (202.0, True)])
def test_a_climb_longer_than_the_identified_step_is_marked(height_m: float, fires: bool) -> None:  # noqa: FBT001 - a table of cases
    down = waypoint(0, 110)
    marked = [
        f
        for f in found("E105", takeoff(100), waypoint(0, height_m), down, waypoint(0, 50), rtl())
        if f.severity is Severity.WARNING
    ]
    assert bool(marked) is fires


def test_a_height_beyond_the_identified_ones_is_marked() -> None:
    steps = [waypoint(0, 100.0 * k) for k in range(2, 6)]
    marked = found("E105", takeoff(100), *steps, *reversed(steps[:-1]), waypoint(0, 100), rtl())
    assert any("500 m" in f.message for f in marked)


def test_hovering_below_the_hover_data_is_said_and_above_is_not() -> None:
    low = found("E105", takeoff(60), waypoint(300, 60), rtl())
    assert [f.severity for f in low] == [Severity.INFO]
    assert found("E105", takeoff(100), waypoint(300, 100), rtl()) == []


def test_the_stand_in_for_cruise_power_is_said_where_there_is_a_cruise() -> None:
    assert len(found("E107", takeoff(100), waypoint(300, 100), rtl())) == 1
    # 20 m are flown in one acceleration and one stop.
    assert found("E107", takeoff(100), waypoint(20, 100), rtl()) == []


def test_conditions_the_model_cannot_count_are_said() -> None:
    one = mission(takeoff(100), waypoint(300, 100), rtl())
    asked = check(
        one,
        VEHICLE,
        battery=BATTERY,
        wind=Wind(speed_m_s=5.0, from_deg=90.0),
        payload_kg=0.5,
        temperature_c=30.0,
        pressure_hpa=1000.0,
    )
    calm = check(one, VEHICLE, battery=BATTERY)
    assert len([f for f in asked.findings if f.code == "E108"]) == 4
    assert [f for f in calm.findings if f.code == "E108"] == []
    assert asked.totals == calm.totals
    # more is flown than is counted: no go on it
    assert [f.severity for f in asked.findings if "payload" in f.message] == [Severity.ERROR]


def test_wind_that_makes_no_difference_is_said() -> None:
    flat = replace(
        VEHICLE, cruise=CruisePower(speed_m_s=(0.0, 12.0), power_above_hover_w=(0.0, 0.0))
    )
    one = mission(takeoff(30), waypoint(300, 30), rtl())
    wind = Wind(speed_m_s=6.0, from_deg=0.0)
    found = check(one, flat, battery=BATTERY, wind=wind).findings
    assert [f.code for f in found if "wind of" in f.message] == ["E108"]


def test_what_is_said_of_a_battery_that_says_too_little_is_marked() -> None:
    one = mission(takeoff(100), waypoint(300, 100), rtl())
    label = check(
        one, VEHICLE, battery=BATTERY, battery_resistance_factor=2.0, battery_temperature_c=5.0
    )
    assert len([f for f in label.findings if f.code == "E108"]) == 2
    none = check(one, VEHICLE, battery_health=0.9)
    assert ["no battery given" in f.message for f in none.findings if f.code == "E108"] == [True]


def test_the_age_and_temperature_of_a_battery_that_knows_them_are_counted() -> None:
    pack = Battery(
        capacity_ah=10.0,
        internal_resistance_ohm=0.05,
        resistance_temperature_c=(0.0, 20.0),
        resistance_factor=(2.0, 1.0),
        ocv_soc=(0.0, 1.0),
        ocv_v=(12.0, 16.0),
    )
    one = mission(takeoff(100), waypoint(300, 100), rtl())

    def lowest_v(factor: float | None = None, battery_c: float | None = None) -> float:
        checked = check(
            one,
            VEHICLE,
            battery=pack,
            temperature_c=20.0,
            battery_resistance_factor=factor,
            battery_temperature_c=battery_c,
        )
        assert not [f for f in checked.findings if "the battery" in f.message and f.code == "E108"]
        assert checked.battery is not None
        assert checked.battery.lowest_voltage_v is not None
        return checked.battery.lowest_voltage_v

    # Twice the resistance is twice the resistance, whether by age or by cold.
    assert lowest_v(factor=2.0) < lowest_v() - 0.1
    assert lowest_v(battery_c=0.0) == pytest.approx(lowest_v(factor=2.0), abs=1e-9)
    aged = check(one, VEHICLE, battery=pack, battery_health=0.8).battery
    new = check(one, VEHICLE, battery=pack).battery
    assert aged is not None
    assert new is not None
    assert aged.capacity_wh == pytest.approx(0.8 * new.capacity_wh)


@pytest.mark.parametrize(("name", "fires"), [("px4-sih-quad", 1), ("arducopter-sitl-quad", 0)])
def test_responses_that_are_not_applied_are_said(name: str, fires: int) -> None:
    one = mission(takeoff(50), waypoint(100, 50), rtl())
    plain = load_vehicle(name)
    told = replace(plain, responses=Responses(speed=VEHICLE.responses.speed))
    assert [f.code for f in check(one, plain).findings if f.code == "E111"] == []
    assert len([f for f in check(one, told).findings if f.code == "E111"]) == fires


def test_a_file_for_an_autopilot_is_said_to_be_flown_in_steps() -> None:
    items = (takeoff(100), waypoint(300, 100), rtl())
    [finding] = found("M109", *items, autopilot=Autopilot.PX4)
    assert finding.message.endswith(
        "with a stop at each waypoint (step-response model); PX4, which the file was written for, "
        "flies through them"
    )
    assert found("M109", *items) == []


def test_a_file_for_the_other_autopilot_is_said_to_be_flown_by_the_model_s() -> None:
    one = mission(takeoff(20), waypoint(300, 20), rtl(), autopilot=Autopilot.PX4)
    found = check(one, load_vehicle("arducopter-sitl-quad"), battery=BATTERY).findings
    assert [f.message for f in found if f.code == "M109"] == [
        "predicted as ArduPilot flies; the file was written for PX4"
    ]


def test_the_articles_vehicle_is_not_flown_by_an_autopilot() -> None:
    with pytest.raises(UsageError, match="cannot be flown as PX4"):
        check(mission(takeoff(100), rtl()), VEHICLE, battery=BATTERY, autopilot=Autopilot.PX4)


def test_an_endless_mission_is_an_error_with_the_time_and_energy_of_a_lap() -> None:
    one = mission(takeoff(100), waypoint(500, 100), waypoint(0, 100), jump(2, -1))
    result = check(one, VEHICLE, battery=BATTERY)
    [finding] = [f for f in result.findings if f.code == "T101"]
    assert finding.severity is Severity.ERROR
    assert finding.item == 4
    # One lap is two legs of 500 m, each 500 / 9.94705 + 6.6234 = 56.8895 s long.
    assert "1 min 54 s" in finding.message
    lap_wh = sum(s.energy_wh for s in result.segments[-6:])
    assert f"{lap_wh:.2f} Wh" in finding.message


@pytest.mark.parametrize(
    ("autopilot", "one", "words"),
    [
        (Autopilot.PX4, item(82, north(50), 100.0), "refuses NAV_SPLINE_WAYPOINT at upload"),
        (Autopilot.PX4, item(16, north(50), 100.0, frame=10), "refuses NAV_WAYPOINT in frame 10"),
        (Autopilot.PX4, item(112, frame=2), "does not arm with CONDITION_DELAY"),
    ],
)
def test_an_item_the_autopilot_refuses_is_an_error(
    autopilot: Autopilot, one: MissionItem, words: str
) -> None:
    [finding] = found("M105", takeoff(100), one, rtl(), autopilot=autopilot)
    assert finding.severity is Severity.ERROR
    assert finding.item == 2
    assert words in finding.message


def test_splines_flown_straight_are_said() -> None:
    [finding] = found("T102", takeoff(100), item(82, north(50), 100.0), rtl())
    assert "1 spline" in finding.message


@pytest.mark.parametrize(
    ("exit_by", "onward", "severities"),
    [
        (0.0, waypoint(50, 100), []),
        (1.0, rtl(), []),  # no tangent leads to a return
        # Flown by a build of PX4: on past the second place, 14 m from the tangent point, for 2.4 km.
        (1.0, waypoint(10, 100), [Severity.ERROR]),
        (1.0, waypoint(0, 100), [Severity.WARNING]),
    ],
)
def test_a_tangent_that_is_not_flown_is_said(
    exit_by: float, onward: MissionItem, severities: list[Severity]
) -> None:
    circle = item(31, north(50), 100.0, params=(0.0, 40.0, 0.0, exit_by))
    told = found("T102", takeoff(100), circle, onward, rtl())
    assert [(one.severity, one.item) for one in told] == [(one, 3) for one in severities]


@pytest.mark.parametrize(
    ("climb_m_s", "descent_m_s", "severities"),
    [
        (2.5, 1.5, []),  # identified from −1.6 to 2.6 m/s
        (5.0, 1.5, [Severity.WARNING]),
        (5.5, 1.5, [Severity.ERROR]),
        (2.5, 3.0, [Severity.WARNING]),
        (2.5, 3.5, [Severity.ERROR]),
    ],
)
def test_a_climb_or_descent_twice_as_fast_as_any_identified_is_an_error(
    climb_m_s: float, descent_m_s: float, severities: list[Severity]
) -> None:
    fast = mission(
        takeoff(20),
        waypoint(20, 20),
        speed(climb_m_s, 2.0),
        speed(descent_m_s, 3.0),
        waypoint(50, 120),
        waypoint(100, 20),
        rtl(),
    )
    found = check(fast, load_vehicle("arducopter-sitl-quad"), battery=BATTERY).findings
    assert [
        f.severity for f in found if f.code == "E105" and "climb rate" in f.message
    ] == severities


@pytest.mark.parametrize(
    ("lag_s", "severity", "rate"),
    [(None, Severity.WARNING, "3.4 m/s"), (0.0, Severity.ERROR, "5.7 m/s")],
)
def test_a_climb_rate_of_a_moment_at_the_cusp_of_a_spline_is_judged_as_flown(
    lag_s: float | None, severity: Severity, rate: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Flown by a build of 4.7, up to 3.28 m/s, where the curve points up at 6 m/s for 0.1 s.
    if lag_s is not None:
        monkeypatch.setattr(splines, "CLIMB_LAG_S", lag_s)

    def place(command: int, north_m: float, east_m: float, height_m: float) -> MissionItem:
        east_deg = (north(east_m) - north(0.0)) / math.cos(math.radians(north(0.0)))
        longitude_deg = HOME.longitude_deg + east_deg
        return item(command, north(north_m), height_m, longitude_deg=longitude_deg)

    turned = mission(
        takeoff(15),
        place(16, 245.4, -68.5, 15),
        place(16, 93.8, 89.3, 25),
        place(82, 222.7, -51.3, 35),
        place(16, 181.0, -26.2, 15),
        rtl(),
    )
    flown = check(turned, load_vehicle("arducopter-sitl-quad"), battery=BATTERY).findings
    (told,) = (f for f in flown if f.code == "E105" and "climb rate" in f.message)
    assert told.severity is severity
    assert f"climb rate of {rate} flown at item 4" in told.message


@pytest.mark.parametrize(("home_amsl_m", "told"), [(100.0, False), (2500.0, True)])
def test_the_power_in_air_that_a_model_names_none_of_is_theory(
    home_amsl_m: float, *, told: bool
) -> None:
    quad = load_vehicle("arducopter-sitl-quad")
    nameless = replace(quad, valid_for=replace(quad.valid_for, air_density_kg_m3=None))
    flight = mission(takeoff(20), waypoint(50, 20), rtl())
    found = check(flight, nameless, battery=BATTERY, home_amsl_m=home_amsl_m).findings
    said = [one for one in found if one.code == "E105" and "is theory" in one.message]
    assert [one.severity for one in said] == [Severity.INFO] * told


def test_a_return_that_climbs_above_the_heights_of_the_model_is_told() -> None:
    # The mission stays at 20 m; RTL_ALT of 450 m is above the 403 m of the model, its cone higher still.
    flight = mission(takeoff(20), waypoint(300, 20), item(21, north(300), 0.0))
    given = parameters_from_text(b"RTL_ALT,45000\n", source="p.param")
    quad = load_vehicle("arducopter-sitl-quad")
    said = [
        one.message
        for one in check(flight, quad, battery=BATTERY, parameters=given).findings
        if one.code == "E105" and "above home" in one.message
    ]
    assert len(said) == 1
    assert "on the return from item" in said[0]
