"""Changes worth a try: each is checked before it is offered, and says its own verdict."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.cli.setting_text import setting_text
from planner.findings import Severity
from planner.frozen import frozen
from planner.report.text import headline
from planner.service import CheckResult
from planner.tui.checked import check_what_if
from planner.tui.rows import MARKS, Column
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.service import UnreadableMission
    from planner.tui.checked import Checked
    from planner.tui.what_if import WhatIf

_CHARGE_STEP_AH = 0.1
_ENERGY_STEP_WH = 1.0
_RESERVE_STEP = 0.01
_MOST_TRIES = 6
_MOST_ITEMS = 300
"""Of a longer mission no speed is looked for: that takes many checks."""


@frozen
class Suggestion:
    """A change and what comes of it."""

    text: str
    changes: tuple[tuple[str, str], ...]
    """Settings by key, as typed."""
    is_go: bool
    outcome: str
    """What the flight then takes and leaves."""


@frozen(eq=False)
class SuggestionRows:
    """Suggestions as rows of a table."""

    suggestions: tuple[Suggestion, ...]
    columns: tuple[Column, ...] = (
        Column(head="", width=1),
        Column(head="worth a try (Tab, Enter)", width=0, is_right=False),
    )

    def __len__(self) -> int:
        return len(self.suggestions)

    def cells(self, index: int) -> tuple[str, ...]:
        """Return the verdict's sign and the change."""
        suggestion = self.suggestions[index]
        verdict = "GO" if suggestion.is_go else "NO-GO"
        sign = "✔" if suggestion.is_go else MARKS[Severity.ERROR]
        return sign, f"{suggestion.text}: {verdict}"

    def tone(self, index: int) -> str:  # noqa: ARG002 - as the other rows
        """Return nothing: the sign says it."""
        return ""


def suggestions(checked: Checked) -> Iterator[Suggestion]:
    """Yield the changes worth a try for a mission as it was checked, each tried.

    A no-go is offered what makes it go; a go is offered the most reserve it still keeps.
    """
    result, what_if = checked.result, checked.what_if
    if not isinstance(result, CheckResult) or result.battery is None:
        return
    if result.verdict == "go":
        yield from _more_reserve(checked.file, what_if, result)
        return
    if any(finding.code.startswith("E") for finding in result.findings):
        yield from _lighter(checked.file, what_if, result)
        yield from _larger_battery(checked.file, what_if, result)
        yield from _other_speed(checked.file, what_if, result)


def _tried(file: str, what_if: WhatIf, text: str, changes: dict[str, str]) -> Suggestion:
    return _suggestion(text, changes, _outcome(file, what_if, changes))


def _outcome(
    file: str, what_if: WhatIf, changes: dict[str, str]
) -> CheckResult | UnreadableMission:
    return check_what_if(file, what_if.with_changes({**what_if.changes, **changes}))


def _suggestion(
    text: str, changes: dict[str, str], result: CheckResult | UnreadableMission
) -> Suggestion:
    return Suggestion(
        text=text,
        changes=tuple(changes.items()),
        is_go=result.verdict == "go",
        outcome=headline(result),
    )


def _lighter(file: str, what_if: WhatIf, result: CheckResult) -> Iterator[Suggestion]:
    if result.conditions.payload_kg:
        yield _tried(file, what_if, "no payload", {"payload_kg": "0"})
    if result.case is not None and result.case.charge < 1.0:
        yield _tried(file, what_if, "a full battery", {"charge": "100%"})


def _other_speed(file: str, what_if: WhatIf, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the fastest speed of all level legs that the battery does for."""
    if "speed_m_s" in what_if.values() or len(result.items) > _MOST_ITEMS:
        return
    from planner.fixes.speed import predict_file_speed_curve

    fastest = predict_file_speed_curve(file, what_if.request()).fastest_fitting
    if fastest is not None and fastest.speed_m_s is not None:
        change = {"speed_m_s": setting_text("speed_m_s", round(fastest.speed_m_s, 6))}
        yield _tried(file, what_if, f"all level legs at {change['speed_m_s']} m/s", change)


def _larger_battery(file: str, what_if: WhatIf, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the least battery of the same voltage that goes; its weight is the pilot's to add."""
    pack = None if result.case is None else result.case.pack
    if pack is None or pack.ocv_v is not None or pack.health is not None:
        return  # a label does not say the curve, and would promise too much
    now = result
    battery: Battery | None = pack
    for _ in range(_MOST_TRIES):
        battery = None if battery is None else _enlarged(battery, now)
        if battery is None:
            return
        change = {"battery": setting_text("battery", battery)}
        tried = _outcome(file, what_if, change)
        if tried.verdict == "go":
            yield _suggestion(f"battery {change['battery']}, no heavier", change, tried)
            return
        if not isinstance(tried, CheckResult):
            return
        now = tried


def _enlarged(battery: Battery, result: CheckResult) -> Battery | None:
    """Return a battery that covers what is missing, in steps packs are sold in; ``None`` if none."""
    budget, way = result.battery, result.way_home
    if budget is None:
        return None
    missing_wh = max(
        -budget.margin_wh, -way.margin_wh if way is not None and way.margin_wh is not None else 0.0
    )
    if not missing_wh > 0.0:
        return None
    kept = 1.0 - (budget.reserve_wh / budget.capacity_wh)
    if not kept > 0.0:
        return None
    needed_wh = budget.capacity_wh + missing_wh / kept
    if battery.capacity_ah is not None and battery.nominal_voltage_v is not None:
        steps = math.ceil(round(needed_wh / battery.nominal_voltage_v / _CHARGE_STEP_AH, 6))
        return Battery(
            capacity_ah=round(steps * _CHARGE_STEP_AH, 6),
            nominal_voltage_v=battery.nominal_voltage_v,
        )
    return Battery(capacity_wh=math.ceil(needed_wh / _ENERGY_STEP_WH) * _ENERGY_STEP_WH)


def _more_reserve(file: str, what_if: WhatIf, result: CheckResult) -> Iterator[Suggestion]:
    """Yield the greatest reserve, in whole percent, that still goes."""
    budget, way = result.battery, result.way_home
    if budget is None:
        return
    left_wh = min(
        budget.margin_wh,
        way.margin_wh if way is not None and way.margin_wh is not None else budget.margin_wh,
    )
    percent = math.floor((budget.reserve_wh + left_wh) / budget.capacity_wh / _RESERVE_STEP)
    if percent > 0 and percent * _RESERVE_STEP > budget.reserve_wh / budget.capacity_wh:
        text = f"{percent}% of reserve, the most that fits"
        yield _tried(file, what_if, text, {"reserve": f"{percent}%"})
