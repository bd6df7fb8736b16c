"""Family R, from R201: what stands between a recorded flight and its prediction."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from made_record import make_record
from rule_cases.case import ARDUPILOT, STEP, RuleCases, vehicle_of

from planner.identify.flown_mission import cut_record, lift_off
from planner.identify.verification import KnownConditions, verify_flight
from planner.logs.record import Boundary, LoggedHome, LoggedItem
from planner.physics.wind import Wind
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.logs.record import FlightRecord

HOME = LoggedHome(latitude_deg=50.0, longitude_deg=20.0, altitude_amsl_m=200.0, found_in="made")
CALM = Wind()


def item(number: int, command: int, north_deg: float, height_m: float) -> LoggedItem:
    """Return an item of the mission that was flown."""
    return LoggedItem(
        item=number,
        command=command,
        frame=3,
        param1=0.0,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        latitude_deg=50.0 + north_deg,
        longitude_deg=20.0,
        altitude_m=height_m,
    )


ITEMS = (item(1, 22, 0.0, 100.0), item(2, 16, 0.002, 100.0), item(3, 21, 0.002, 0.0))


@cache
def flown() -> FlightRecord:
    """Return the flight of the article's vehicle just as it is predicted."""
    blank = replace(
        make_record(is_landed=np.zeros(20, np.bool_)),
        home=HOME,
        mission_items=ITEMS,
        mode=np.full(20, "AUTO_MISSION"),
    )
    record = verify_flight(blank, vehicle_of(STEP), KnownConditions(wind=CALM)).foreseen
    landed = record.is_landed.copy()
    landed[0] = True
    size = record.time_s.size
    return replace(record, mode=np.full(size, "AUTO_MISSION"), is_landed=landed)


def reported(
    *,
    wind: Wind | None = CALM,
    **changes: Any,  # noqa: ANN401 - whatever a record holds
) -> tuple[Finding, ...]:
    """Return what is reported of the flight with something changed."""
    known = KnownConditions(wind=wind)
    return verify_flight(replace(flown(), **changes), vehicle_of(STEP), known).findings


def by_hand(samples: int, first: int = 200) -> tuple[Finding, ...]:
    """Return what is reported of a flight of which so many tenths of a second were flown by hand."""
    mode = flown().mode.copy()
    mode[first : first + samples] = "POSCTL"
    return reported(mode=mode)


def power_unknown(more: int) -> tuple[Finding, ...]:
    """Return what is reported where power is not known for 5 % of the flight and some samples."""
    power_w = flown().power_w.copy()
    power_w[: power_w.size // 20 + more] = np.nan
    return reported(power_w=power_w)


def waiting(samples: int) -> tuple[Finding, ...]:
    """Return what is reported of a flight before which the vehicle stood armed."""
    record = flown()
    order = np.concatenate((np.zeros(samples, np.intp), np.arange(record.time_s.size)))
    columns: dict[str, Any] = {name: column[order] for name, column in record.columns().items()}
    columns["time_s"] = np.arange(float(order.size)) * 0.1
    mode = columns["mode"].copy()
    mode[:samples] = "POSCTL"
    columns["mode"] = mode
    return reported(**columns, duration_s=record.duration_s + 0.1 * samples)


def begun(samples: int) -> tuple[Finding, ...]:
    """Return what is reported of a mission begun so many samples behind the last not above 1 m."""
    return by_hand(lift_off(flown()) - 1 + samples, first=0)


def broken_off(samples: int) -> tuple[Finding, ...]:
    """Return what is reported of a log that breaks off so many samples behind the last before item 3.

    Item 2 begins in the first half of the predicted time, item 3, the landing from 100 m, in the second.
    """
    end = int(np.argmax(flown().mission_item == 3)) + samples
    record = replace(cut_record(flown(), 0, end), ends_with=Boundary.LOG)
    return verify_flight(record, vehicle_of(STEP), KnownConditions(wind=CALM)).findings


def of_firmware(version: str) -> tuple[Finding, ...]:
    """Return what is reported of a flight by a version of ArduCopter."""
    record = replace(
        flown(),
        autopilot=ARDUPILOT,
        firmware=f"ArduCopter V{version}",
        parameters={"WPNAV_SPEED": 500.0},
    )
    return verify_flight(record, vehicle_of(ARDUPILOT), KnownConditions(wind=CALM)).findings


CASES: Mapping[str, RuleCases] = {
    "R201": RuleCases(
        fires=lambda: by_hand(21), boundary=lambda: by_hand(20), silent=lambda: by_hand(0)
    ),
    "R202": RuleCases(
        fires=lambda: reported(mission_items=(ITEMS[0], ITEMS[2])),
        boundary=lambda: reported(
            mission_items=ITEMS[:2]
        ),  # what may be behind the last is not known
        silent=reported,
    ),
    "R203": RuleCases(
        fires=lambda: power_unknown(1),
        boundary=lambda: power_unknown(0),
        silent=lambda: power_unknown(-1),
    ),
    "R204": RuleCases(
        fires=lambda: reported(wind=None),
        boundary=lambda: reported(wind=Wind(speed_m_s=0.0)),
        silent=reported,
    ),
    "R205": RuleCases(
        fires=lambda: waiting(21), boundary=lambda: waiting(20), silent=lambda: waiting(0)
    ),
    "R207": RuleCases(fires=lambda: begun(1), boundary=lambda: begun(0), silent=reported),
    "R208": RuleCases(
        fires=lambda: of_firmware("4.0.7"),
        boundary=lambda: of_firmware("4.1.0"),
        silent=lambda: of_firmware("4.6.0"),
    ),
    "R209": RuleCases(fires=lambda: broken_off(0), boundary=lambda: broken_off(1), silent=reported),
}
