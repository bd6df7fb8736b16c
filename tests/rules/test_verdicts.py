"""What holds of every verdict: no setting makes a go of an error, no notation or load makes it greener."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from fenced_missions import box
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import mission, rtl, speed, takeoff, waypoint
from px4_quad import PX4_QUAD
from thinning import examples

from planner.findings import Severity
from planner.geo.fence import Fence
from planner.notation import read_battery
from planner.physics.wind import Wind
from planner.selection import Baseline, Exemption, KnownFinding, Selection
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.vehicle.model import VehicleModel

ARTICLE = replace(load_vehicle("falkowski-2023-quadrotor"), battery=Battery(capacity_wh=77.0))
QUAD = load_vehicle("arducopter-sitl-quad")
VEHICLES = (ARTICLE, QUAD, PX4_QUAD)
OWN_PARAMETERS = {
    QUAD.name: "BATT_LOW_VOLT,{volts}\nBATT_FS_LOW_ACT,2\nBATT_LOW_MAH,{mah}\nBATT_ARM_VOLT,{volts}\n",
    PX4_QUAD.name: "BAT_CRIT_THR,{threshold}\nCOM_LOW_BAT_ACT,3\nCOM_ARM_BAT_MIN,{threshold}\n",
    ARTICLE.name: "",
}
CODES = st.sampled_from(
    ("E", "E1", "E101", "F", "F1", "A", "A1", "W", "W1", "X", "X9", "P", "T", "M")
)
few = settings(max_examples=examples(12), deadline=None)


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Draw a flight out and back, some of it longer than the battery lasts, some of it fenced."""
    height_m = draw(st.floats(15.0, 80.0))
    places_m = draw(st.lists(st.floats(100.0, 3000.0), min_size=1, max_size=3))
    hold_s = draw(st.sampled_from((0.0, 60.0, 900.0)))
    legs = [waypoint(one, height_m, hold_s=hold_s) for one in places_m]
    one = mission(takeoff(height_m), speed(draw(st.floats(3.0, 10.0))), *legs, rtl())
    if draw(st.booleans()):
        around = box(-50.0, -50.0, 50.0, draw(st.floats(100.0, 3100.0)))
        one = replace(one, fence=Fence(polygons=(around,)))
    return one


@st.composite
def parameters(draw: st.DrawFn, vehicle: VehicleModel) -> dict[str, Any]:
    """Draw nothing, or failsafes of the battery that act at some voltage, charge or fraction."""
    text = OWN_PARAMETERS[vehicle.name].format(
        volts=draw(st.floats(19.0, 25.0)),
        mah=draw(st.floats(0.0, 7000.0)),
        threshold=draw(st.floats(0.05, 0.9)),
    )
    if not text or draw(st.booleans()):
        return {}
    return {"parameters": parameters_from_text(text.encode(), source="p.param")}


@st.composite
def flights(draw: st.DrawFn) -> tuple[Mission, VehicleModel, dict[str, Any]]:
    vehicle = draw(st.sampled_from(VEHICLES))
    given_ = draw(parameters(vehicle)) | {
        "charge": draw(st.floats(0.3, 1.0)),
        "wind": Wind(speed_m_s=draw(st.floats(0.0, 12.0)), from_deg=draw(st.floats(0.0, 360.0))),
        "payload_kg": 0.0 if vehicle is ARTICLE else draw(st.floats(0.0, 1.0)),
    }
    return draw(missions()), vehicle, given_


def is_kept(finding: Finding) -> bool:
    """Return whether an error is about energy, battery, vehicle, wind, fence or ground."""
    return finding.severity is Severity.ERROR and finding.code[0] in "EFAWX"


@few
@given(
    flight=flights(),
    ignore=st.lists(CODES, max_size=4),
    select=st.lists(CODES, max_size=2),
    exempt=st.lists(CODES, max_size=3),
    fail_on=st.sampled_from((Severity.WARNING, Severity.ERROR)),
    is_known=st.booleans(),
)
def test_no_setting_of_what_is_reported_makes_a_go_of_an_error(
    *,
    flight: tuple[Mission, VehicleModel, dict[str, Any]],
    ignore: list[str],
    select: list[str],
    exempt: list[str],
    fail_on: Severity,
    is_known: bool,
) -> None:
    one, vehicle, given_ = flight
    plain = check(one, vehicle, **given_)
    known = frozenset(
        KnownFinding(
            file=one.source,
            item=f.item or 0,
            code=f.code,
            severity=f.severity.label,
            message=f.message,
        )
        for f in plain.findings
    )
    selection = Selection(
        ignore=tuple(ignore),
        select=tuple(select),
        exemptions=(Exemption(codes=tuple(exempt), origin="here"),) if exempt else (),
        baseline=Baseline(source="b.json", folder=Path.cwd(), known=known) if is_known else None,
    )
    asked = check(one, vehicle, selection=selection, fail_on=fail_on, **given_)
    kept = {(f.code, f.message) for f in plain.findings if is_kept(f)}
    assert kept <= {(f.code, f.message) for f in asked.findings}
    if kept:
        assert asked.verdict == "no-go"


@few
@given(flight=flights())
def test_no_notation_of_the_same_pack_is_greener_than_the_pack_itself(
    flight: tuple[Mission, VehicleModel, dict[str, Any]],
) -> None:
    one, vehicle, given_ = flight
    own = vehicle.battery
    assert own is not None
    labels = [f"{own.energy_wh!r}Wh"]
    if own.voltage_v is not None:
        labels.append(f"{own.charge_ah!r}Ah@{own.voltage_v!r}V")
    whole = check(one, vehicle, **given_)
    for label in labels:
        told = check(one, vehicle, battery=read_battery(label), **given_)
        assert told.verdict == whole.verdict, label


@few
@given(
    flight=flights(),
    less=st.floats(0.0, 0.3),
    more_kg=st.floats(0.0, 1.0),
    times=st.floats(1.0, 3.0),
)
def test_less_charge_or_more_payload_is_never_greener_nor_more_wind_calmer(
    flight: tuple[Mission, VehicleModel, dict[str, Any]], less: float, more_kg: float, times: float
) -> None:
    one, vehicle, given_ = flight

    def checked(**changed: Any) -> CheckResult:  # noqa: ANN401 - whatever check takes
        return check(one, vehicle, **(given_ | changed))

    before = checked()
    worse = [checked(charge=given_["charge"] - less)]
    if vehicle.knows_mass:
        worse.append(checked(payload_kg=given_["payload_kg"] + more_kg))
    for after in worse:
        assert before.verdict == "go" or after.verdict == "no-go"
    wind: Wind = given_["wind"]
    stronger = checked(wind=replace(wind, speed_m_s=times * wind.speed_m_s))
    # A stronger wind may carry the vehicle home for less, but what it cannot hold it holds less.
    assert in_wind(before) <= in_wind(stronger)


def in_wind(result: CheckResult) -> set[str]:
    return {f.code for f in result.findings if f.code in {"W101", "W103"}}


@pytest.mark.parametrize("vehicle", VEHICLES, ids=[one.name for one in VEHICLES])
def test_the_flights_drawn_are_goes_and_no_goes(vehicle: VehicleModel) -> None:
    """Else nothing above could fail."""
    short = mission(takeoff(30), speed(6.0), waypoint(200, 30), rtl())
    long = mission(takeoff(30), speed(6.0), waypoint(200, 30, hold_s=3000.0), rtl())
    assert [check(one, vehicle).verdict for one in (short, long)] == ["go", "no-go"]
