"""The report a pilot reads."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest
from made_missions import HOME, mission, rtl, takeoff, waypoint

from planner import quantity
from planner.findings import Severity
from planner.physics.wind import Wind
from planner.quantity import Spread
from planner.report.json import check_json
from planner.report.text import Medium, check_concise, check_text, headline, tally
from planner.rules.energy import RESERVE_BELOW_MINIMUM
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission

TERMINAL = Medium(width=80, is_coloured=True)


def _plain(text: str) -> str:
    return re.sub(r"\x1b\[[0-9;]*m", "", text)


@pytest.fixture
def grounded(flown: CheckResult) -> CheckResult:
    """The same flight with a battery that is too small."""
    assert flown.battery is not None
    message = "needs 24.1 Wh, 15.4 Wh are there above the reserve of 20 %: short by 8.7 Wh"
    return replace(
        flown,
        verdict="no-go",
        battery=replace(flown.battery, capacity_wh=19.25, usable_wh=19.25, margin_wh=-8.66),
        findings=(RESERVE_BELOW_MINIMUM.finding(message, item=2), *flown.findings),
    )


def test_the_verdict_stands_first_and_does_not_need_colour(
    flown: CheckResult, grounded: CheckResult, unreadable: UnreadableMission
) -> None:
    def first(result: CheckResult | UnreadableMission) -> str:
        return check_text([result], medium=Medium()).splitlines()[0]

    assert first(flown) == "GO  site.plan"
    assert first(grounded) == "NO-GO  site.plan"
    assert first(unreadable) == "NOT CHECKED  broken.plan"


def test_the_headline_says_time_distance_energy_share_and_margin(
    flown: CheckResult, grounded: CheckResult
) -> None:
    # 69.3 Wh at the start, less 15.4 Wh of reserve, less 24.06 Wh flown: 29.84 Wh
    assert headline(flown) == (
        "11 min 32 s, 4.32 km, 24.1 Wh: 31 % of the battery, 29.8 Wh above the 20 % reserve"
    )
    assert headline(grounded).endswith("8.66 Wh short of the 20 % reserve")


def test_without_a_battery_the_headline_says_so(flown: CheckResult) -> None:
    assert headline(replace(flown, battery=None)) == (
        "11 min 32 s, 4.32 km, 24.1 Wh; battery unknown"
    )


def test_the_battery_line_says_how_deep_and_how_low_where_that_is_known(flown: CheckResult) -> None:
    def line(result: CheckResult) -> str:
        lines = check_text([result], medium=Medium()).splitlines()
        return next(line for line in lines if line.startswith("Battery"))

    assert flown.battery is not None
    label = replace(flown.battery, charge_left_fraction=None, lowest_voltage_v=None)
    curve = replace(flown.battery, charge_left_fraction=0.431, lowest_voltage_v=13.27)
    assert line(replace(flown, battery=label)).endswith("used")
    assert line(replace(flown, battery=curve)).endswith("43 % of the charge left, lowest 13.3 V")


def test_a_wind_profile_and_an_old_battery_are_among_the_conditions(flown: CheckResult) -> None:
    def shown(wind: Wind) -> str:
        setup = replace(
            flown.setup,
            wind=wind,
            battery_health=0.85,
            battery_resistance_factor=1.5,
            battery_temperature_c=5.0,
        )
        return check_text([replace(flown, setup=setup)], medium=Medium())

    power = Wind(speed_m_s=5.0, from_deg=270.0, reference_height_m=10.0, shear_exponent=0.2)
    text = shown(power)
    assert "wind 5.0 m/s from 270° at 10 m (power law, exponent 0.2)" in text
    assert (
        "battery health 85 %, battery resistance 1.5 times the new one's, battery at 5 °C" in text
    )
    logarithmic = replace(power, shear_exponent=None, roughness_length_m=0.03)
    assert "(logarithmic law, roughness 0.03 m)" in shown(logarithmic)


@pytest.mark.parametrize(
    ("stated_m", "given_m", "shown"),
    [
        (400.0, None, "home 400 m AMSL"),
        (0.0, None, "altitude of home unknown"),  # what programs write that do not know it
        (None, None, "altitude of home unknown"),
        (0.0, 0.0, "home 0 m AMSL"),
    ],
)
def test_an_altitude_of_home_that_nobody_knows_is_no_number(
    stated_m: float | None, given_m: float | None, shown: str
) -> None:
    home = replace(HOME, altitude_amsl_m=stated_m)
    vehicle = load_vehicle("arducopter-sitl-quad")
    result = check(
        mission(takeoff(20), waypoint(100, 20), rtl(), home=home), vehicle, home_amsl_m=given_m
    )
    lines = check_text([result], medium=Medium()).splitlines()
    [conditions] = (line for line in lines if line.startswith("Conditions"))
    assert shown in conditions
    assert ("home 0 m" in conditions) == (given_m == 0.0)


def test_a_finding_is_one_line_for_other_programs_with_its_fix_below(flown: CheckResult) -> None:
    lines = check_text([flown], medium=Medium()).splitlines()
    at = lines.index(
        "site.plan:41:9: E105 model-outside-envelope [warning] item 2: "
        "12.0 m/s is commanded, the model was identified up to 10.0 m/s"
    )
    assert lines[at + 1] == f"    fix: {flown.findings[0].fix}"


def test_findings_come_before_figures_and_assumptions_after(grounded: CheckResult) -> None:
    text = check_text([grounded], medium=Medium())
    order = [text.index(mark) for mark in ("E101", "E105", "Flight ", "Phase ", "Found ", "E107")]
    assert order == sorted(order)
    assert "Found 1 error, 1 warning. 1 assumption:" in text


def test_a_clean_check_says_that_all_passed(flown: CheckResult) -> None:
    text = check_text([replace(flown, findings=())], medium=Medium())
    assert text.endswith("No problem found.\n")
    with_note = replace(flown, findings=flown.findings[1:])
    assert "No problem found. 1 assumption:" in check_text([with_note], medium=Medium())


def test_the_numbers_are_those_of_json_after_formatting(flown: CheckResult) -> None:
    text = check_text([flown], medium=Medium())
    [mission] = json.loads(check_json([flown], version="1"))["missions"]
    totals, battery, home = mission["totals"], mission["battery"], mission["return"]
    for written in (
        quantity.duration(totals["time_s"]),
        quantity.distance(totals["distance_m"]),
        quantity.energy(totals["energy_wh"]),
        quantity.charge(totals["charge_mah"]),
        quantity.power(totals["mean_power_w"]),
        quantity.power(totals["peak_power_w"]),
        f"climb {quantity.height(totals['climb_m'])}",
        f"descent {quantity.height(totals['descent_m'])}",
        f"{quantity.energy(battery['capacity_wh'])} full",
        f"{quantity.energy(battery['usable_wh'])} at the start",
        f"{quantity.percent(battery['used_fraction'])} used",
        f"{quantity.energy(battery['margin_wh'])} above the 20 % reserve",
        f"{quantity.energy(home['energy_home_wh'])} to get home",
        f"from item {home['tightest_item']}",
        quantity.energy(home["margin_wh"]),
    ):
        assert written in text


def test_phases_add_up_to_the_total_of_the_flight(flown: CheckResult) -> None:
    lines = check_text([flown], medium=Medium()).splitlines()
    start = lines.index(next(line for line in lines if line.startswith("Phase")))
    rows = {line.split()[0]: line.split() for line in lines[start + 1 : start + 5]}
    assert list(rows) == ["takeoff", "cruise", "land", "total"]
    assert [rows[phase][1] for phase in rows] == ["1", "1", "1", "3"]
    # 1.56 / 24.06, 20 / 24.06 and 2.5 / 24.06
    assert [" ".join(rows[phase][-2:]) for phase in rows] == ["6.5 %", "83 %", "10 %", "100 %"]


def test_no_line_is_wider_than_the_terminal(grounded: CheckResult) -> None:
    vehicle = replace(grounded.setup.vehicle, source="/home/pilot/a folder/" * 6)
    long = replace(grounded, setup=replace(grounded.setup, vehicle=vehicle))
    for line in _plain(check_text([long, grounded], medium=TERMINAL)).splitlines():
        assert len(line) <= 80, line


def test_colour_changes_no_character(grounded: CheckResult) -> None:
    coloured = check_text([grounded], medium=TERMINAL)
    assert "\x1b[" in coloured
    assert _plain(coloured) == check_text([grounded], medium=Medium(width=80))
    assert "\x1b" not in check_text([grounded], medium=Medium())


def test_several_missions_end_in_a_summary(
    flown: CheckResult, grounded: CheckResult, unreadable: UnreadableMission
) -> None:
    results = (flown, grounded, unreadable)
    assert tally(results) == "3 missions: 1 GO, 1 NO-GO, 1 NOT CHECKED"
    lines = check_text(results, medium=Medium()).splitlines()
    assert lines[-4] == tally(results)
    assert lines[-3].startswith("  NO-GO        site.plan: 11 min 32 s")
    assert lines[-3].endswith("; E101 reserve-below-minimum"), "why, and nothing that is no reason"
    assert lines[-2] == "  NOT CHECKED  broken.plan: X901 broken.plan:3:7: this is not JSON"
    assert lines[-1].startswith("  GO           site.plan: 11 min 32 s")
    assert "E1" not in lines[-1]


def test_a_line_stands_for_each_mission_and_finding_where_editors_look(
    grounded: CheckResult, unreadable: UnreadableMission
) -> None:
    lines = check_concise([grounded, unreadable]).splitlines()
    assert lines.pop() == "2 missions: 0 GO, 1 NO-GO, 1 NOT CHECKED"
    assert len(lines) == 2 + len(grounded.findings) + len(unreadable.findings)
    assert all(re.match(r"(site|broken)\.plan:\d+:\d+: \S", line) for line in lines)
    assert lines[0].startswith("site.plan:1:1: NO-GO: 11 min 32 s")
    kinds = [line.split(": ")[1] for line in lines[1 : 1 + len(grounded.findings)]]
    assert kinds == ["error", "warning", "note"]
    assert lines[-2:] == [
        "broken.plan:1:1: NOT CHECKED: the mission cannot be checked",
        "broken.plan:3:7: error: X901 file-unreadable: broken.plan:3:7: this is not JSON",
    ]


def test_a_note_of_all_missions_but_some_that_are_named_stands_once(flown: CheckResult) -> None:
    [note, *_] = [one for one in flown.findings if one.severity is Severity.INFO]
    results = [replace(flown, file=f"{name}.plan", findings=(note,)) for name in "abc"]
    bare = replace(flown, file="d.plan", findings=())
    text = f"note: {note.code} {note.name}: "
    lines = check_concise([*results, bare]).splitlines()
    assert [line.partition(text)[0] for line in lines if text in line] == [
        "all 4 missions but d.plan: "
    ]
    lines = check_concise([results[0], bare]).splitlines()
    assert [line.partition(text)[0] for line in lines if text in line] == ["a.plan:1:1: "]
    assert lines[-1] == "2 missions: 2 GO, 0 NO-GO"


def test_an_unreadable_mission_says_why_and_invents_no_figures(
    unreadable: UnreadableMission,
) -> None:
    text = check_text([unreadable], medium=Medium())
    assert "X901 file-unreadable [error] broken.plan:3:7: this is not JSON" in text
    assert "Wh" not in text


def test_a_file_cannot_steer_the_terminal(flown: CheckResult) -> None:
    evil = replace(
        flown,
        file="a\x1b[2Jb\n.plan",
        findings=(replace(flown.findings[0], message="\x1b]0;owned\x07\r\nGO"),),
    )
    text = check_text([evil], medium=Medium())
    assert "\x1b" not in text
    assert "\x07" not in text
    assert text.splitlines()[0] == r"GO  a\x1b[2Jb\n.plan"


def test_the_spread_is_told_where_the_model_has_one(flown: CheckResult) -> None:
    assert (
        "24.1 Wh (no error bar: this model was never compared with other flights), 1626 mAh"
        in check_text([flown], medium=Medium())
    )
    assert flown.battery is not None
    assert flown.return_plan is not None
    told = replace(
        flown,
        totals=replace(
            flown.totals, energy_wh_p10=22.0, energy_wh_p90=26.0, time_s_p10=680.0, time_s_p90=705.0
        ),
        battery=replace(flown.battery, below_reserve_probability=0.031),
        return_plan=replace(flown.return_plan, below_reserve_probability=0.0),
        setup=replace(
            flown.setup,
            wind=Wind(speed_m_s=5.0, from_deg=270.0, speed_sd_m_s=2.0, from_sd_deg=20.0),
            payload_kg=Spread(mean=0.5, sd=0.1),
            temperature_c=Spread(mean=15.0, sd=5.0),
        ),
    )
    text = check_text([told], medium=Medium())
    assert "11 min 32 s (8 of 10 flights: 11 min 20 s to 11 min 45 s), 4.32 km" in text
    assert "24.1 Wh (8 of 10 flights: 22.0 Wh to 26.0 Wh), 1626 mAh" in text
    assert "31 % used; 3.1 % chance to land below the reserve" in text
    assert "above the reserve; < 0.1 % chance to get home below it" in text
    assert "wind 5.0 m/s ± 2.0 m/s from 270° ± 20°, home 488 m AMSL, 15 °C ± 5 °C" in text
    assert "payload 0.50 kg ± 0.10 kg" in text


def test_what_is_not_reported_is_still_counted_beside_the_verdict(
    flown: CheckResult, grounded: CheckResult
) -> None:
    blind = replace(flown, findings=(), suppressed=grounded.findings)
    lines = check_text([blind], medium=Medium()).splitlines()
    assert lines[0] == "GO  site.plan (1 error, 1 warning suppressed)"
    summary = check_text([blind, flown], medium=Medium()).splitlines()[-2:]
    assert summary[0].startswith("  GO  site.plan: 11 min")
    assert summary[1].startswith("  GO  site.plan (1 error, 1 warning suppressed): 11 min")
    assert lines[-1] == (
        "No problem found. Not reported, as asked: 1 error, 1 warning, 1 assumption."
    )


def test_a_mission_that_flies_nothing_says_so_and_not_that_no_battery_is_known(
    flown: CheckResult,
) -> None:
    text = check_text([replace(flown, segments=(), battery=None)], medium=Medium())
    assert text.splitlines()[2] == "nothing is flown"


def test_a_flight_that_never_lands_has_no_hover_left_at_a_landing() -> None:
    result = check(
        mission(takeoff(20), waypoint(100, 20)),
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=77.0),
    )
    text = check_text([result], medium=Medium())
    assert "of hover left at the last item, where it stays in the air" in text
    assert "at landing" not in text
    [ending] = [one for one in result.findings if one.code == "M102"]
    assert "until the battery is empty, as no failsafe lands it: " in ending.message
    assert result.battery is not None
    left_wh = 77.0 - result.totals.energy_wh
    assert ending.message.endswith(f" later, with {left_wh:.1f} Wh more")
