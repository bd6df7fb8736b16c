"""Changes worth a try: each is checked before it is offered, and says its own verdict."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import MavjouleError
from planner.findings import Severity
from planner.notation import battery_text
from planner.quantity import exact, mean_of
from planner.report.text import headline
from planner.service.preflight import CheckResult, UnreadableMission
from planner.tui.checked import check_again, check_inputs
from planner.tui.rows import MARKS
from planner.tui.widgets.row_list import Table, TableColumn
from planner.values import Value
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.flight.budget import BatteryBudget
    from planner.service.split import Split
    from planner.tui.checked import Checked


_CHARGE_STEP_AH = 0.1
_ENERGY_STEP_WH = 1.0
_RESERVE_STEP = 0.01
_MOST_TRIES = 6
_MOST_LARGER = 1.5
"""A pack beyond half as much again is for another frame. [-]"""
_MOST_ITEMS = 300
"""Of a longer mission no speed is looked for: that takes many checks."""


class Suggestion(Value):
    """A change and what comes of it."""

    text: str
    changes: tuple[tuple[str, str], ...]
    """Settings by key, as typed."""
    is_go: bool
    outcome: str
    """What the flight then takes and leaves."""
    split: Split | None = None
    """The flights it is, instead of one under other settings."""


def suggestion_table(found: Sequence[Suggestion]) -> Table:
    """Return suggestions as rows: the verdict's sign and the change."""
    return Table(
        entries=found,
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="suggestions (Tab, Enter)", width=0, is_right=False),
        ),
        cells_of=lambda one: (
            "✔" if one.is_go else MARKS[Severity.ERROR],
            f"{'GO' if one.is_go else 'NO-GO'}: {one.text}",
        ),
    )


def suggestions(checked: Checked) -> Iterator[Suggestion]:
    """Yield the changes worth a try for a mission as it was checked, each tried.

    A no-go is offered what makes it go; a go is offered the most reserve it still keeps.  What cannot
    be tried is left out.
    """
    result = checked.result
    if not isinstance(result, CheckResult) or result.battery is None:
        return
    tries = [_more_reserve]
    if result.verdict != "go":
        is_energy = any(finding.code.startswith("E") for finding in result.findings)
        tries = [_lighter, _larger_battery, _other_speed, _split] if is_energy else []
    for tried in tries:
        with suppress(MavjouleError, ValueError):
            yield from tried(checked, result)


def _tried(checked: Checked, text: str, changes: dict[str, str]) -> Suggestion:
    result = check_again(checked, changes)
    return Suggestion(
        text=text,
        changes=tuple(changes.items()),
        is_go=result.verdict == "go",
        outcome=headline(result),
    )


def _lighter(checked: Checked, result: CheckResult) -> Iterator[Suggestion]:
    if mean_of(result.setup.payload_kg):
        yield _tried(checked, "no payload", {"payload_kg": "0"})
    if result.assessment is not None and result.assessment.charge < 1.0:
        yield _tried(checked, "a full battery", {"charge": "100%"})


def _other_speed(checked: Checked, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the fastest speed of all level legs that the battery does for."""
    is_asked = "speed_m_s" in checked.what_if.values()
    if is_asked or result.assessment is None or len(result.items) > _MOST_ITEMS:
        return
    from planner.service.speed import speed_curve

    fastest = speed_curve(*check_inputs(checked, result.assessment)).fastest_fitting
    if fastest is not None and fastest.speed_m_s is not None:
        change = {"speed_m_s": exact(round(fastest.speed_m_s, 6))}
        yield _tried(checked, f"saved with all level legs at {change['speed_m_s']} m/s", change)


def _split(checked: Checked, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the fewest flights that each fit the battery."""
    if result.assessment is None or len(result.items) > _MOST_ITEMS:
        return
    from planner.service.split import split_under

    split = split_under(*check_inputs(checked, result.assessment))
    if len(split.parts) > 1:
        flights = quantity.count(len(split.parts), "flight")
        energy_wh = sum(part.result.totals.energy_wh for part in split.parts)
        yield Suggestion(
            text=f"split into {flights}",
            changes=(),
            is_go=True,  # each part was checked as it reads back
            outcome=f"together {quantity.energy(energy_wh)}",
            split=split,
        )


def _larger_battery(checked: Checked, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the least battery of the same voltage that goes, carried and lifted as the check has it.

    None beyond half as much again, and none heavier than the model knows its vehicle to lift; where the
    throttle of the hover is known, E116 judges that too.
    """
    battery = result.setup.battery
    if battery is None or battery.ocv_v is not None or result.setup.battery_health is not None:
        return  # a label does not say the curve, and would promise too much
    now, most_wh = result, battery.new_energy_wh * _MOST_LARGER
    for _ in range(_MOST_TRIES):
        battery = None if battery is None else _enlarged(battery, now)
        if battery is None or battery.new_energy_wh > most_wh:
            return
        change = {"battery": battery_text(battery)}
        tried = check_again(checked, change)
        if tried.verdict == "go" and _is_lifted(tried):
            text = f"battery {change['battery']}, {_weight(tried)}"
            outcome = headline(tried)
            yield Suggestion(text=text, changes=(*change.items(),), is_go=True, outcome=outcome)
            return
        if not isinstance(tried, CheckResult) or not _is_lifted(tried):
            return
        now = tried


def _is_lifted(tried: CheckResult | UnreadableMission) -> bool:
    """Return whether nothing is known against the take-off mass of a check."""
    if not isinstance(tried, CheckResult) or tried.assessment is None:
        return False
    flown_kg, known_kg = (
        tried.assessment.flight.power.mass_kg,
        tried.setup.vehicle.valid_for.mass_kg,
    )
    return flown_kg is None or known_kg is None or flown_kg <= known_kg.high


def _weight(tried: CheckResult | UnreadableMission) -> str:
    """Return whether the weight of a battery is counted, in words."""
    if not isinstance(tried, CheckResult):
        return ""
    vehicle, added_kg = tried.setup.vehicle, tried.setup.flown_pack.added_kg
    if vehicle.battery is None or not vehicle.knows_mass:
        return "its weight not counted"
    return f"{quantity.mass(added_kg)} heavier" if added_kg else "no heavier than the model's own"


def _enlarged(battery: Battery, result: CheckResult) -> Battery | None:
    """Return a battery that covers what is missing, in steps packs are sold in; ``None`` if none."""
    budget = result.battery
    if budget is None:
        return None
    missing_wh = -_margin_wh(budget, result)
    kept = 1.0 - (budget.reserve_wh / budget.capacity_wh)
    if not (missing_wh > 0.0 and kept > 0.0):
        return None
    needed_wh = budget.capacity_wh + missing_wh / kept
    if battery.capacity_ah is not None and battery.nominal_voltage_v is not None:
        steps = math.ceil(round(needed_wh / battery.nominal_voltage_v / _CHARGE_STEP_AH, 6))
        return Battery(
            capacity_ah=round(steps * _CHARGE_STEP_AH, 6),
            nominal_voltage_v=battery.nominal_voltage_v,
        )
    return Battery(capacity_wh=math.ceil(needed_wh / _ENERGY_STEP_WH) * _ENERGY_STEP_WH)


def _margin_wh(budget: BatteryBudget, result: CheckResult) -> float:
    """Return the energy above the reserve, at landing or after the tightest return. [Wh]"""
    way = result.return_plan
    margin_wh = budget.margin_wh if way is None else way.margin_wh
    return budget.margin_wh if margin_wh is None else min(budget.margin_wh, margin_wh)


def _more_reserve(checked: Checked, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the greatest reserve, in whole percent, that still goes."""
    budget = result.battery
    if budget is None:
        return
    left_wh = _margin_wh(budget, result)
    percent = math.floor((budget.reserve_wh + left_wh) / budget.capacity_wh / _RESERVE_STEP)
    if percent > 0 and percent * _RESERVE_STEP > budget.reserve_wh / budget.capacity_wh:
        text = f"reserve {percent}%, the most that fits"
        yield _tried(checked, text, {"reserve": f"{percent}%"})
