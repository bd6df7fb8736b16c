"""What the areas of a drawing may mean besides what is certain of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.findings import Severity
from planner.geo.fence import INCLUSION_SEMANTICS
from planner.mission.formats.foreign import AREA_SIDE_UNKNOWN
from planner.rules.declaration import DRAWN, judges
from planner.rules.fence import flight_in_fence
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.geo.fence import Fence
    from planner.rules.assessment import Assessment


@judges(AREA_SIDE_UNKNOWN, needs=(DRAWN,))
def _other_readings(a: Assessment, fence: Fence) -> Iterator[Finding]:
    """Yield what breaks another reading of the areas, of a flight that keeps the certain one."""
    if any(one.severity is Severity.ERROR for one in flight_in_fence(a)):
        return
    for reading in fence.readings:
        found = list(flight_in_fence(replace(a, mission=replace(a.mission, fence=reading))))
        if any(one.code == INCLUSION_SEMANTICS.code for one in found):
            continue  # no flight could be in all of them: they are meant one by one
        first = next((one for one in found if one.severity is Severity.ERROR), None)
        if first is not None:
            what = "each of the areas" if fence.polygons else "the area of the work"
            yield a.finding(
                AREA_SIDE_UNKNOWN,
                f"nothing settles whether to stay inside {what}: {first.message}",
                item=first.item,
                stretch=first.stretch,
            )
