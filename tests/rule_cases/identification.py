"""Family I: vehicles identified from flights."""

from __future__ import annotations

import datetime as dt
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from dataflash_writer import copter_log
from made_record import record_of
from rule_cases.case import ARDUPILOT, RuleCases, vehicle_of
from rule_cases.flight_log import records_of
from simulated_experiment import fly_horizontally, fly_vertically

from planner.identify.assembly import (
    IdentificationSettings,
    Method,
)
from planner.identify.battery import PackSettings
from planner.identify.identification import identify_vehicle
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.findings import Finding
    from planner.logs.record import FlightRecord

PACK = PackSettings(capacity_ah=5.0)


@cache
def copter() -> FlightRecord:
    """Return the made flight of ArduPilot."""
    [record] = records_of(copter_log())
    return record


def article() -> tuple[FlightRecord, FlightRecord]:
    """Return the article's two experiments."""
    noise = np.random.default_rng(1)
    return (
        record_of(fly_vertically(noise), is_vertical=True),
        record_of(fly_horizontally(noise), is_vertical=False),
    )


def told(
    *records: FlightRecord,
    about: str = "",
    **changes: Any,  # noqa: ANN401 - whatever the settings hold
) -> Iterable[Finding]:
    """Return what is told of a vehicle made of flights, about one state alone where it is named."""
    settings = IdentificationSettings(
        **{
            "name": "quad",
            "date": dt.date(2026, 11, 21),
            "version": "1",
            "mass_kg": 2.0,
            "method": Method.ARX,
            **changes,
        }
    )
    found = identify_vehicle(records or (copter(),), settings).findings
    return [finding for finding in found if finding.message.startswith(about)]


def again(**changes: Any) -> FlightRecord:  # noqa: ANN401 - whatever a record holds
    """Return the made flight once more, of which something is another."""
    return replace(copter(), source="again.bin", **changes)


CASES: Mapping[str, RuleCases] = {
    "I101": RuleCases(
        fires=lambda: told(*article()),
        boundary=lambda: told(copter()),  # asked for, and nothing can be fitted
        silent=lambda: told(copter(), method=Method.OUTPUT_ERROR),
    ),
    "I102": RuleCases(
        fires=lambda: told(about="battery"),
        boundary=lambda: told(about="battery", base=vehicle_of(ARDUPILOT)),  # the base's: I103
        silent=lambda: told(about="battery", pack=PACK),
    ),
    "I103": RuleCases(
        fires=lambda: told(about="battery", base=vehicle_of(ARDUPILOT)),
        boundary=lambda: told(about="battery", base=vehicle_of(ARDUPILOT), pack=PACK),
        silent=lambda: told(about="battery"),
    ),
    "I104": RuleCases(
        fires=lambda: told(copter(), again(parameters={"WPNAV_SPEED": 501.0})),
        boundary=lambda: told(copter(), again(parameters={"WPNAV_SPEED": 500.0})),
        silent=lambda: told(copter(), again(parameters={})),
    ),
    "I105": RuleCases(
        fires=lambda: told(mass_kg=None),
        boundary=lambda: told(mass_kg=None, base=vehicle_of(ARDUPILOT)),
        silent=told,
    ),
    "I106": RuleCases(
        fires=lambda: told(copter(), again(vehicle="OCTAQUAD/X")),
        boundary=lambda: told(copter(), again(vehicle="")),  # it does not say
        silent=lambda: told(copter(), again()),
    ),
}
