"""Every format as bytes, one small file each, of a call made by hand.

Run as a program, this writes the files in ``golden/`` anew (``make golden``): read what changed
before it is committed.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.errors import ExitCode
from planner.findings import Finding, Place, Rule, Severity
from planner.flight.budget import BatteryBudget, Totals
from planner.flight.motion.kinematics import FlightState
from planner.flight.prediction import ItemArrival, Segment
from planner.flight.returns.tightest import ReturnPlan
from planner.physics.wind import Wind
from planner.report.github import check_github, github_summary
from planner.report.gitlab import check_gitlab
from planner.report.json import check_json, check_json_lines
from planner.report.junit import check_junit
from planner.report.sarif import check_sarif
from planner.report.text import Medium, check_text, statistics_text
from planner.service.preflight import CheckResult, UnreadableMission
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

GOLDEN = Path(__file__).parent / "golden"
FOLDER = Path("/repository")


def _rule(code: str, name: str, severity: Severity) -> Rule:
    return Rule(
        f"{code} {name}",
        severity,
        summary=f"What {name} says.",
        why=f"Why {name} matters.",
        how="a = b + c",
        fix=f"Mend {name}.",
    )


UNKNOWN = _rule("E901", "battery-unheard-of", Severity.ERROR)
NEAR = _rule("F901", "near-the-fence", Severity.WARNING)
ACROSS = _rule("F902", "across-the-fence", Severity.ERROR)
ASSUMED = _rule("X951", "assumed", Severity.INFO)
UNREADABLE = _rule("X952", "unreadable", Severity.ERROR)
RULES = {rule.code: rule for rule in (UNKNOWN, NEAR, ACROSS, ASSUMED, UNREADABLE)}


def _flown(
    file: str, *, findings: tuple[Finding, ...], suppressed: tuple[Finding, ...] = ()
) -> CheckResult:
    """Return a flight of a minute up, along and down that takes 6 of 10 Wh."""
    return CheckResult(
        file=file,
        verdict="no-go" if any(one.severity is Severity.ERROR for one in findings) else "go",
        setup=Setup(
            replace(load_vehicle(), name="quad", source="models/quad.toml"),
            position_noise_m=0.0,
            wind=Wind(speed_m_s=5.0, from_deg=270.0),
            home_amsl_m=488.0,
            temperature_c=15.0,
        ),
        totals=Totals(
            time_s=60.0,
            distance_m=200.0,
            climb_m=50.0,
            descent_m=50.0,
            energy_wh=6.0,
            charge_mah=405.0,
            mean_power_w=360.0,
            peak_power_w=400.0,
        ),
        battery=BatteryBudget(
            capacity_wh=10.0,
            usable_wh=10.0,
            used_fraction=0.6,
            reserve_fraction=0.25,
            reserve_wh=2.5,
            margin_wh=1.5,
        ),
        return_plan=ReturnPlan(tightest_item=2, energy_home_wh=2.5, margin_wh=1.25),
        segments=(
            Segment(
                index=0,
                item=1,
                state=FlightState.TAKEOFF,
                start_s=0.0,
                duration_s=20.0,
                distance_m=0.0,
                climb_m=50.0,
                speed_m_s=2.5,
                energy_wh=2.0,
                stopping_distance_m=None,
            ),
            Segment(
                index=1,
                item=2,
                state=FlightState.CRUISE,
                start_s=20.0,
                duration_s=20.0,
                distance_m=200.0,
                climb_m=0.0,
                speed_m_s=10.0,
                energy_wh=2.5,
                stopping_distance_m=26.5,
            ),
            Segment(
                index=2,
                item=3,
                state=FlightState.LAND,
                start_s=40.0,
                duration_s=20.0,
                distance_m=0.0,
                climb_m=-50.0,
                speed_m_s=2.5,
                energy_wh=1.5,
                stopping_distance_m=None,
            ),
        ),
        items=(
            ItemArrival(item=1, command="NAV_TAKEOFF", arrival_s=20.0, energy_used_wh=2.0),
            ItemArrival(item=2, command="NAV_WAYPOINT", arrival_s=40.0, energy_used_wh=4.5),
            ItemArrival(item=3, command="NAV_LAND", arrival_s=60.0, energy_used_wh=6.0),
        ),
        findings=findings,
        suppressed=suppressed,
    )


RESULTS = (
    _flown(
        "site.plan",
        findings=(
            NEAR.finding("stop 26.5 m, fence 14 m away", item=2, place=Place(line=41, column=9)),
            ASSUMED.finding("the ground is level: 100 % assumed", fix=""),
        ),
        suppressed=(
            replace(
                ACROSS.finding("3.5 m across", item=3, place=Place(line=52, column=9)),
                suppression="ignored by site.plan#3 in mavjoule.toml",
            ),
        ),
    ),
    replace(
        _flown(
            "/repository/deep/a,b: 100 %.plan",
            findings=(UNKNOWN.finding("no battery: 6.00 Wh are needed", fix="Say * or | what."),),
        ),
        battery=None,
        return_plan=ReturnPlan(tightest_item=2, energy_home_wh=2.5, margin_wh=None),
    ),
    UnreadableMission(
        file="broken.plan",
        findings=(
            UNREADABLE.finding("broken.plan:3:7: <not> JSON", place=Place(line=3, column=7)),
        ),
    ),
)
"""A go that did not look at an error, a no-go with an awkward name, and a broken file."""


def _rendered() -> dict[str, str]:
    """Return the contents of each golden file by its name."""
    return {
        "check.txt": check_text(RESULTS, medium=Medium()),
        "statistics.txt": statistics_text(RESULTS, medium=Medium()),
        "check.json": check_json(RESULTS, version="1.2.3", with_statistics=True),
        "check.jsonl": check_json_lines(RESULTS, version="1.2.3"),
        "check.sarif": check_sarif(
            RESULTS, rules=RULES, version="1.2.3", exit_code=ExitCode.UNUSABLE, folder=FOLDER
        ),
        "check.junit.xml": check_junit(RESULTS, folder=FOLDER),
        "check.github.txt": check_github(RESULTS, folder=FOLDER),
        "summary.github.md": github_summary(RESULTS, folder=FOLDER),
        "check.gitlab.json": check_gitlab(RESULTS, folder=FOLDER),
    }


@pytest.mark.parametrize("name", _rendered())
def test_a_format_is_written_byte_for_byte_as_before(name: str) -> None:
    expected = (GOLDEN / name).read_bytes()
    assert _rendered()[name].encode("utf-8") == expected, "read the change, then `make golden`"


def test_no_golden_file_is_left_over() -> None:
    assert {path.name for path in GOLDEN.iterdir()} == set(_rendered())


if __name__ == "__main__":
    GOLDEN.mkdir(exist_ok=True)
    for name, text in _rendered().items():
        (GOLDEN / name).write_bytes(text.encode("utf-8"))
