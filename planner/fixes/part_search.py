"""The search for the parts of a mission: where each ends so that it still fits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import (
    quantity,
    service,
)
from planner.flight.returns.destination import HOME
from planner.mission.parts import ENDS, mission_part, resumption, split_points
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.arrays import FloatArray
    from planner.mission.parts import FlownItems, SplitPoint
    from planner.service import CheckResult
    from planner.vehicle.model import VehicleModel

    Range = tuple[SplitPoint | None, SplitPoint | None]
    """Where a part begins and ends; ``None``: where the mission does."""

MENDED = frozenset({"E101", "E102", "E103", "E104", "E119"})
"""What a shorter flight mends."""
_MOST_PARTS = 99
_TRIES = 60
"""Earlier places a part is tried to end at, where more than energy is wrong with its longest form."""
_GUESSES = 8
"""Places looked at by what the flight in one piece takes; then the rest is halved."""
_TOO_MUCH = 1.02
"""Legs that alone take so much more than there is fit no part, for they are the same in it. [-]"""


class _Trial(Value):
    """What the check says of one part."""

    fits: bool
    """Nothing is wrong that a shorter one mends."""
    goes: bool
    margin_wh: float | None
    """Least energy above the reserve, at landing or on a return. [Wh]"""


class _Forecast(Value, eq=False):
    """What parts take, by the flight in one piece: where to look first, never what is told."""

    used_wh: FloatArray
    """When each stage is done. (stages,) [Wh]"""
    home_wh: FloatArray
    """For the return from there. (stages,) [Wh]"""

    def at(self, flown: FlownItems, cut: SplitPoint) -> tuple[float, float]:
        """Return the energy used up to a cut, and for the return from there. [Wh], [Wh]"""
        stage = flown.stages[cut.step]
        assert stage is not None  # cuts are at steps that fly
        place = np.array([1.0 - cut.fraction, cut.fraction])
        rows = slice(stage - 1, stage + 1)
        return float(place @ self.used_wh[rows]), float(place @ self.home_wh[rows])


def _make_forecast(whole: CheckResult) -> _Forecast | None:
    """Return the forecast that a whole flight gives; ``None`` where its power is not known."""
    assessment = whole.assessment
    if assessment is None or not assessment.vehicle.is_power_known:
        return None
    returns = assessment.returns
    ends = returns.stage_ends
    points = returns.end_points(ends)
    _, way_wh = returns.fly(points.stop_m, points.stage, HOME)
    every = np.arange(len(assessment.route.stages))
    # a stage without a segment is done with the one before
    return _Forecast(
        used_wh=np.interp(every, points.stage, points.used_wh),
        home_wh=np.interp(every, points.stage, points.stop_wh + way_wh),
    )


class _Budget:
    """How far parts reach among places they may end at, as far as is known."""

    def __init__(
        self, forecast: _Forecast, flown: FlownItems, cuts: Sequence[SplitPoint], above_wh: float
    ) -> None:
        self._forecast = forecast
        self._steps = flown
        self._above_wh = above_wh
        both = [forecast.at(flown, cut) for cut in cuts]
        self._needed_wh = np.maximum.accumulate(np.array([used + home for used, home in both]))
        self._off_wh = 0.0
        """What parts take beyond their forecast, by the one checked last."""

    def reach(self, start: SplitPoint | None) -> int:
        """Return the last place a part should end at; below 0: none."""
        limit_wh = self._above_wh + self._begun_wh(start) - self._off_wh
        return int(np.searchsorted(self._needed_wh, limit_wh, side="right")) - 1

    def learn(self, start: SplitPoint | None, end: int, margin_wh: float | None) -> None:
        """Take what the check found left of a part."""
        if margin_wh is not None and math.isfinite(margin_wh):
            forecast_wh = float(self._needed_wh[end]) - self._begun_wh(start)
            self._off_wh = self._above_wh - margin_wh - forecast_wh

    def is_rest_too_much(self, start: SplitPoint | None) -> bool:
        """Return whether the legs from a place to the end alone take more than there is."""
        used_wh = 0.0 if start is None else self._forecast.at(self._steps, start)[0]
        return float(self._forecast.used_wh[-1]) - used_wh > _TOO_MUCH * self._above_wh

    def _begun_wh(self, start: SplitPoint | None) -> float:
        """Return what a part saves by beginning there, with its way out taken for one home."""
        if start is None:
            return 0.0
        used_wh, home_wh = self._forecast.at(self._steps, start)
        return used_wh - home_wh


class PartSearch:
    """The search for the parts of one mission.

    Parameters
    ----------
    flown : FlownItems
        The mission in flown order.
    vehicle : VehicleModel
        What flies it.
    options : dict
        Of `planner.check`.
    whole : CheckResult
        Of the mission in one flight.
    on_step : callable
        Told how far the search is, in words.
    """

    def __init__(
        self,
        flown: FlownItems,
        vehicle: VehicleModel,
        options: dict[str, Any],
        whole: CheckResult,
        on_step: Callable[[str], None],
    ) -> None:
        self.refusal = ""
        self._steps = flown
        self._vehicle = vehicle
        self._options = options | {"with_trace": False}
        self._on_step = on_step
        self._tried: dict[Range, _Trial] = {}
        self._forecast = _make_forecast(whole)
        battery = whole.battery
        self._above_wh = None if battery is None else battery.usable_wh - battery.reserve_wh
        self._whole_wh = whole.totals.energy_wh

    def fewest(self) -> int:
        """Return a number of parts below which the energy of the mission alone does not go."""
        return 1 if self._above_wh is None else math.ceil(self._whole_wh / self._above_wh)

    def ranges(self, *, inside_legs: bool) -> list[Range] | None:
        """Return where each part begins and ends; ``None`` with a `refusal` where one does not fit."""
        if self.fewest() > _MOST_PARTS:
            self._refuse_so_many()
            return None
        cuts = split_points(self._steps, inside_legs=inside_legs)
        budget = None
        if self._forecast is not None and self._above_wh is not None and cuts:
            budget = _Budget(self._forecast, self._steps, cuts, self._above_wh)
        found: list[Range] = []
        start: SplitPoint | None = None
        first = 0
        while True:
            is_last = budget is None or not budget.is_rest_too_much(start)
            if is_last and self._trial(start, None).goes:
                return [*found, (start, None)]
            end = self._farthest(start, cuts, first, budget)
            if end is None:
                self._refuse(start, cuts[first] if first < len(cuts) else None)
                return None
            if len(found) + 1 >= _MOST_PARTS:
                self._refuse_so_many()
                return None
            found.append((start, cuts[end]))
            self._tell(found, cuts[end], inside_legs=inside_legs)
            start = resumption(self._steps, cuts[end])
            first = end + 1

    def _tell(self, found: list[Range], end: SplitPoint, *, inside_legs: bool) -> None:
        where = "inside legs too" if inside_legs else "between items"
        self._on_step(
            f"cutting {where}: {quantity.count(len(found), 'part')}, up to item "
            f"{self._steps.numbers[end.step]} of {len(self._steps.mission.items)}"
        )

    def _farthest(
        self, start: SplitPoint | None, cuts: list[SplitPoint], first: int, budget: _Budget | None
    ) -> int | None:
        """Return the last cut that a part may end at; ``None``: none.

        What the flight in one piece takes says where to look, and each check how far that is off.
        """
        low, high = first - 1, len(cuts)
        stride = 1
        for tries in range(len(cuts) - first + 1):
            if high - low <= 1:
                break
            place = (low + high) // 2
            if tries < _GUESSES:
                place = low if budget is None else budget.reach(start)
                if not low < place < high:
                    place = low + stride if place <= low else high - stride
                    stride *= 2
                place = min(max(place, low + 1), high - 1)
            trial = self._trial(start, cuts[place])
            low, high = (place, high) if trial.fits else (low, place)
            if budget is not None:
                budget.learn(start, place, trial.margin_wh)
        for end in range(low, max(low - _TRIES, first - 1), -1):
            if self._trial(start, cuts[end]).goes:
                return end
        return None

    def _trial(self, start: SplitPoint | None, end: SplitPoint | None) -> _Trial:
        if (start, end) not in self._tried:
            result = self._check(start, end)
            battery, plan = result.battery, result.return_plan
            margins = [
                one.margin_wh
                for one in (battery, plan)
                if one is not None and one.margin_wh is not None
            ]
            self._tried[start, end] = _Trial(
                fits=not any(
                    finding.code in MENDED and finding.severity >= result.fail_on
                    for finding in result.findings
                ),
                goes=result.verdict == "go",
                margin_wh=min(margins, default=None),
            )
        return self._tried[start, end]

    def _check(self, start: SplitPoint | None, end: SplitPoint | None) -> CheckResult:
        part = mission_part(self._steps, start, end, name=self._steps.mission.source)
        return service.check(part.mission, self._vehicle, **self._options)

    def _refuse_so_many(self) -> None:
        self.refusal = (
            f"{self._steps.mission.source}: cannot be split: it takes more than {_MOST_PARTS} flights; "
            "what would help is a larger battery or a smaller reserve"
        )

    def _refuse(self, start: SplitPoint | None, end: SplitPoint | None) -> None:
        result = self._check(start, end)
        battery, totals = result.battery, result.totals
        flying = self._steps.flying
        places = [one for one in flying if self._steps.stage(one).kind not in ENDS] or flying
        step = end.step if end is not None and end.fraction else places[-1]
        if end is not None and not end.fraction:
            step = max(one for one in flying if one < end.step)
        elif start is not None and end is None:
            step = start.step
        number = self._steps.numbers[step]
        others = [
            one
            for one in result.findings
            if one.severity >= result.fail_on and one.code not in MENDED
        ]
        why = "".join(f": {one.code} {one.message}" for one in others[:1])
        if battery is not None and not others:
            left_wh = battery.usable_wh - battery.reserve_wh
            why = (
                f": with the way there and home it takes {quantity.energy(totals.energy_wh)}, the "
                f"battery has {quantity.energy(left_wh)} above the reserve"
            )
        if self._steps.stage(step).hold_s > totals.time_s / 2.0:
            helps = "a shorter hold there, a larger battery, or a smaller reserve"
        else:
            helps = (
                "a larger battery, a smaller reserve, another speed (mavjoule speed), or a home "
                "nearer to it"
            )
        self.refusal = (
            f"{self._steps.mission.source}: cannot be split: not even the shortest flight to "
            f"item {number} is a go{why}; what would help is {helps}"
        )
