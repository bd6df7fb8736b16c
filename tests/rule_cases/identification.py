"""Family I: vehicles identified from flights."""

from __future__ import annotations

import datetime as dt
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from dataflash_writer import copter_log
from made_record import record_of
from rule_cases.case import ARDUPILOT, STEP, RuleCases, vehicle_of
from rule_cases.flight_log import records_of
from simulated_experiment import fly_horizontally

from planner.identify.assembly import IdentificationSettings, Method, _reported
from planner.identify.battery import PackSettings
from planner.identify.identification import identify_vehicle
from planner.identify.log_table import LogConditions, LogTable
from planner.identify.refinement import refine_vehicle
from planner.identify.responses import FittedResponse, _without_what_is_not_shown
from planner.identify.segments import StateOutcome
from planner.logs.record import LoggedItem
from planner.physics.response import TransferFunction
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.data_sheet import DataSheet, vehicle_from_data_sheet
from planner.vehicle.figures import HoverFigure, HoverKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import VehicleModel

OF_2_KG = LogTable(of_all=LogConditions(mass_kg=2.0))
LOADED = LogTable(of_all=LogConditions(mass_kg=1.8, payload_kg=0.2))
GRIPPER = LoggedItem(1, 211, 2, *[0.0] * 7)
PACK = PackSettings(capacity_ah=5.0)


@cache
def copter() -> FlightRecord:
    """Return the made flight of ArduPilot."""
    [record] = records_of(copter_log())
    return record


def article() -> FlightRecord:
    """Return the article's level experiment."""
    return record_of(fly_horizontally(np.random.default_rng(1)), is_vertical=False)


def of_its_cells() -> VehicleModel:
    """Return the shipped model that ArduPilot flies, with a battery of the four cells of the made flight."""
    model = vehicle_of(ARDUPILOT)
    assert model.battery is not None
    assert model.battery.ocv_v is not None
    four_of_six = tuple(4.0 / 6.0 * voltage for voltage in model.battery.ocv_v)
    return replace(model, battery=replace(model.battery, cells_in_series=4, ocv_v=four_of_six))


def of_data_sheet(*, hover_w: float = 160.0) -> VehicleModel:
    """Return the model of a quadrotor by a data sheet that says what its hover takes."""
    sheet = DataSheet(
        name="quad",
        mass_kg=2.0,
        battery=Battery(capacity_ah=5.2, nominal_voltage_v=14.8),
        rotors=4,
        propeller_m=0.330,
        hover=HoverFigure(kind=HoverKind.POWER, value=hover_w),
        date=dt.date(2026, 11, 23),
    )
    return vehicle_from_data_sheet(sheet)


def refined(*, hover_w: float) -> Iterable[Finding]:
    """Return what is reported of the hover."""
    found = refine_vehicle(of_data_sheet(hover_w=hover_w), [copter()]).findings
    return [one for one in found if one.message.startswith("hover")]


def refined_again(*records: FlightRecord) -> Iterable[Finding]:
    """Return what is reported where a model that one flight has narrowed is narrowed by some."""
    once = refine_vehicle(of_data_sheet(), [copter()]).model
    return refine_vehicle(once, records).findings


def reported(
    *records: FlightRecord,
    about: str = "",
    **changes: Any,  # noqa: ANN401 - whatever the settings hold
) -> Iterable[Finding]:
    """Return what is reported of a vehicle made of flights, about one state alone where it is named."""
    settings = IdentificationSettings(
        **{
            "name": "quad",
            "date": dt.date(2026, 11, 21),
            "version": "1",
            "logs": OF_2_KG,
            "method": Method.ARX,
            **changes,
        }
    )
    found = identify_vehicle(records or (copter(),), settings).findings
    return [finding for finding in found if finding.message.startswith(about)]


def there_and_back() -> FlightRecord:
    """Return the flight at half of its pace, turned back after half of what it flew level."""
    flown = copter()
    moving = np.flatnonzero(np.hypot(flown.velocity_north_m_s, flown.velocity_east_m_s) > 2.0)
    way = np.where(np.arange(flown.time_s.size) < np.median(moving), 1.0, -1.0)
    return again(
        time_s=2.0 * flown.time_s,
        velocity_north_m_s=way * flown.velocity_north_m_s,
        velocity_east_m_s=way * flown.velocity_east_m_s,
    )


def of_a_delay_as_large_as_its_error() -> tuple[str, ...]:
    """Return what a fit does not show whose delay is 0.1 ± 0.1 s."""
    system = TransferFunction(numerator=(0.05,), denominator=(1.0, 0.2, 0.05), delay_s=0.1)
    fitted = FittedResponse(
        transfer_function=system,
        estimates=(),
        window_s=None,
        coefficient_errors=((0.001,), (0.0, 0.01, 0.01), 0.1),
    )
    return _without_what_is_not_shown(fitted)[1]


def not_shown(*names: str) -> Iterable[Finding]:
    """Return what is reported of a response of which the flights do not show some numbers."""
    settings = IdentificationSettings(name="quad", date=dt.date(2026, 11, 21), version="1")
    outcome = StateOutcome(name="climb_power", summary="second order", not_shown=names)
    return _reported([outcome], settings, 2.0)


def again(**changes: Any) -> FlightRecord:  # noqa: ANN401 - whatever a record holds
    """Return the made flight once more, of which something is another."""
    return replace(copter(), source="again.bin", **changes)


CASES: Mapping[str, RuleCases] = {
    "I101": RuleCases(
        fires=lambda: reported(article(), base=vehicle_of(STEP)),
        boundary=lambda: reported(copter()),  # asked for, and nothing can be fitted
        silent=lambda: reported(copter(), method=Method.OUTPUT_ERROR),
    ),
    "I102": RuleCases(
        fires=lambda: reported(about="battery"),
        boundary=lambda: reported(about="battery", base=of_its_cells()),  # the base's: I103
        silent=lambda: reported(about="battery", pack=PACK),
    ),
    "I103": RuleCases(
        fires=lambda: reported(about="battery", base=of_its_cells()),
        boundary=lambda: reported(about="battery", base=of_its_cells(), pack=PACK),
        silent=lambda: reported(about="battery"),
    ),
    "I104": RuleCases(
        fires=lambda: reported(copter(), again(parameters={"WPNAV_SPEED": 501.0})),
        boundary=lambda: reported(copter(), again(parameters={"WPNAV_SPEED": 500.0})),
        silent=lambda: reported(copter(), again(parameters={})),
    ),
    "I105": RuleCases(
        fires=lambda: reported(logs=LogTable()),
        boundary=lambda: reported(logs=LogTable(), base=of_data_sheet()),
        silent=reported,
    ),
    "I106": RuleCases(
        fires=lambda: reported(copter(), again(vehicle="OCTAQUAD/X")),
        boundary=lambda: reported(copter(), again(vehicle="")),  # it does not say
        silent=lambda: reported(copter(), again()),
    ),
    "I107": RuleCases(
        fires=lambda: not_shown("delay_s"),
        boundary=lambda: not_shown(*of_a_delay_as_large_as_its_error()),
        fires_at_boundary=True,
        silent=not_shown,
    ),
    "I110": RuleCases(  # the made log draws 160 W
        fires=lambda: refined(hover_w=200.0),
        boundary=lambda: refined(hover_w=178.0),  # 1.9 of its standard deviations
        silent=lambda: refined(hover_w=160.0),
    ),
    "I111": RuleCases(
        fires=lambda: refined_again(copter(), again(sha256="b" * 64)),
        boundary=lambda: refined_again(again(sha256="b" * 64)),  # alike, of another file
        silent=lambda: refine_vehicle(of_data_sheet(), [copter()]).findings,
    ),
    "I112": RuleCases(
        fires=lambda: reported(again(parameters={"BATT_CAPACITY": 3300.0})),
        boundary=lambda: reported(again(parameters={"BATT_CAPACITY": 3301.0})),  # somebody set it
        silent=lambda: reported(again(parameters={"BATT_CAPACITY": 3300.0}), pack=PACK),
    ),
    "I113": RuleCases(  # the made log begins with 16.0 V: four cells of 4 V
        fires=lambda: reported(again(voltage_v=copter().voltage_v - 0.1), pack=PACK),
        boundary=lambda: reported(pack=PACK),
        silent=lambda: reported(again(voltage_v=copter().voltage_v + 0.8), pack=PACK),
    ),
    "I114": RuleCases(
        fires=lambda: reported(again(mission_items=(GRIPPER,)), logs=LOADED),
        boundary=lambda: reported(again(mission_items=(GRIPPER,))),  # without a payload
        silent=lambda: reported(logs=LOADED),
    ),
    "I115": RuleCases(
        fires=reported,
        boundary=lambda: reported(copter(), there_and_back()),  # of both one
        silent=lambda: reported(again(airspeed_m_s=copter().velocity_north_m_s)),
    ),
}
