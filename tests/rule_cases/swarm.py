"""Family S: several vehicles in one airspace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from made_missions import HOME, METRES_PER_DEGREE_NORTH, item, mission, takeoff
from rule_cases.case import ARDUPILOT, PLAIN, PLENTY, RuleCases, vehicle_of

from planner.service.preflight import check
from planner.service.separation import check_together
from planner.values import replace
from planner.vehicle.parameters.files import parameters_from_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.findings import Finding
    from planner.mission.items import Home, Mission


def moved(one: Mission, metres: float) -> Mission:
    """Return a mission with its home so many metres farther north, and its places with it."""
    by_deg = metres / METRES_PER_DEGREE_NORTH
    home = one.home or HOME
    return replace(
        one,
        source="other.plan",
        home=replace(home, latitude_deg=home.latitude_deg + by_deg),
        items=tuple(
            replace(each, latitude_deg=each.latitude_deg + by_deg) if each.latitude_deg else each
            for each in one.items
        ),
    )


def together(
    one: Mission,
    other: Mission,
    parameters: tuple[str, str] = ("", ""),
    *,
    separation_m: float = 5.0,
    **given: Any,  # noqa: ANN401 - whatever check_together takes
) -> tuple[Finding, ...]:
    """Return what is reported of a mission that is flown together with another."""
    results = [
        check(
            mission,
            vehicle_of(ARDUPILOT),
            battery=PLENTY,
            parameters=parameters_from_text(text.encode(), source=f"{number}.param")
            if text
            else None,
        )
        for number, (mission, text) in enumerate(zip((one, other), parameters, strict=True))
    ]
    return check_together(results, separation_m=separation_m, **given)[0].findings


def side_by_side(metres: float) -> tuple[Finding, ...]:
    """Return what is reported of two that fly the same beside each other, where 20 m are to be kept."""
    return together(PLAIN, moved(PLAIN, metres), separation_m=20.0)


def hopping(height_m: float) -> tuple[Finding, ...]:
    """Return what is reported of one that rises so high, beside one far away."""
    land = item(21, HOME.latitude_deg, 0.0)
    return together(mission(takeoff(height_m), land), moved(PLAIN, 500.0), min_nav_alt_m=3.0)


def at_unknown_heights(metres: float) -> tuple[Finding, ...]:
    """Return what is reported of two that far apart, the altitude of one of whose homes is not known."""
    other = moved(PLAIN, metres)
    home: Home = replace(other.home or HOME, altitude_amsl_m=0.0)
    return together(PLAIN, replace(other, home=home), separation_m=0.1)


CASES: Mapping[str, RuleCases] = {
    "S101": RuleCases(
        fires=lambda: side_by_side(19.98),
        boundary=lambda: side_by_side(20.0),
        silent=lambda: side_by_side(20.1),
    ),
    "S102": RuleCases(
        fires=lambda: together(
            PLAIN, moved(PLAIN, 50.0), ("SYSID_THISMAV,3\n", "MAV_SYSID,3\nWP_SPD,5\n")
        ),
        boundary=lambda: together(
            PLAIN, moved(PLAIN, 50.0), ("SYSID_THISMAV,3\n", "SYSID_THISMAV,4\n")
        ),
        silent=lambda: together(PLAIN, moved(PLAIN, 50.0), ("SYSID_THISMAV,3\n", "")),
    ),
    "S104": RuleCases(
        fires=lambda: hopping(2.9),
        boundary=lambda: at_unknown_heights(1.0),
        silent=lambda: hopping(3.1),
    ),
}
