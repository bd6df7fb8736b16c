"""Complex items of a plan, expanded to mission items."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.expand import structure_scan
from planner.mission.expand.landing import LAND_COMMANDS, expand_landing_pattern
from planner.mission.expand.survey import (
    CLOSEST_SPACING_M,
    make_survey_items,
    read_frame,
    read_older_survey,
    read_survey,
)
from planner.mission.formats.json_document import JsonFields, describe
from planner.mission.formats.simple_item import COMPLEX_ITEM_UNKNOWN, PLAN_VALUE
from planner.mission.items import MOST_ITEMS, ItemSequence, make_items
from planner.values import Value

if TYPE_CHECKING:
    from planner.findings import Place, Remarks
    from planner.mission.formats.simple_item import SimpleItemReader
    from planner.mission.items import MissionItem


VERSIONS = {
    "survey": (2, 3, 4, 5),
    "CorridorScan": (2,),
    "StructureScan": (structure_scan.VERSION,),
    "fwLandingPattern": (1, 2),
    "vtolLandingPattern": (1,),
}
"""What QGroundControl accepts."""
_TRANSECT_VERSIONS = (1, 2)


COMPLEX_ITEM_VERSION = Rule(
    "L113 complex-item-version",
    Severity.WARNING,
    summary="A complex item is of a version that loaders refuse, but holds the items to fly.",
    why="QGroundControl refuses the whole plan, and MAVSDK any survey but version 5.",
    how="The version is compared with those QGroundControl accepts; the embedded items are used.",
    fix="save the plan again with QGroundControl",
)

SURVEY_REBUILT = Rule(
    "L114 survey-rebuilt",
    Severity.WARNING,
    summary="A survey holds no items: they are computed from its area as QGroundControl does.",
    why="QGroundControl computes what it uploads again, and its versions differ in where they begin "
    "and turn; MAVSDK refuses the file.",
    how="The path it is drawn with is used where there is one; otherwise parallel lines at the grid's "
    "angle and spacing are cut with the area, entered at the chosen corner and lengthened to turn "
    "around.  Surveys that do hold their items come out within 0.3 %.",
    fix="open the plan in a current QGroundControl and save it: then it holds the items",
)


class ComplexItemReader(Value):
    """Expands the complex items of one document; what is odd goes to its remarks."""

    simple_items: SimpleItemReader
    remarks: Remarks

    def read(self, raw: JsonFields, place: Place, *, first_number: int) -> list[MissionItem]:
        """Return the mission items of a complex item.

        Returns
        -------
        list of MissionItem
            Empty where it cannot be expanded, which is a finding of severity error.
        """
        kind = raw.value.get("complexItemType", raw.value.get("type"))
        version = raw.value.get("version")
        item = JsonFields(
            document=raw.document,
            value=raw.value,
            title=f"item {first_number} ({kind[:30] if isinstance(kind, str) else describe(kind)})",
        )
        kind = kind if isinstance(kind, str) else ""
        is_known = version in VERSIONS.get(kind, ())
        if raw.value.get("type") != "ComplexItem":
            found = describe(raw.value.get("type"))
            self._report_refused(
                item, f"'type' is {found}, read as ComplexItem", first_number, place
            )
        transects = raw.value.get("TransectStyleComplexItem")
        if isinstance(transects, dict) and "Items" in transects:
            if not is_known:
                message = (
                    f"{item.title} is of version {describe(version)}: its embedded items are used, "
                    "QGroundControl refuses the file"
                )
                self.remarks.add(COMPLEX_ITEM_VERSION, message, item=first_number, place=place)
            version = transects.get("version")
            if version not in _TRANSECT_VERSIONS:
                what = f"'TransectStyleComplexItem' is of version {describe(version)}"
                self._report_refused(item, what, first_number, place)
            return self._embedded(item, first_number)
        if not is_known:
            return self._refused(item, f"version {describe(version)} is not known", place)
        if kind == "StructureScan":
            return structure_scan.expand_structure_scan(
                item, place, first_number=first_number, remarks=self.remarks
            )
        if kind in LAND_COMMANDS:
            return expand_landing_pattern(
                item, kind, place, first_number=first_number, remarks=self.remarks
            )
        return self._without_items(item, kind, place, first_number)

    def _report_refused(self, item: JsonFields, what: str, number: int, place: Place) -> None:
        """Report that QGroundControl does not open a file with this."""
        message = f"{item.title}: {what}: QGroundControl refuses the file"
        self.remarks.add(PLAN_VALUE, message, item=number, place=place)

    def _refused(self, item: JsonFields, why: str, place: Place) -> list[MissionItem]:
        """Report that nothing of a complex item is in the prediction."""
        message = f"{item.title} cannot be expanded, {why}: missing from this prediction"
        self.remarks.add(COMPLEX_ITEM_UNKNOWN, message, place=place)
        return []

    def _embedded(self, item: JsonFields, first_number: int) -> list[MissionItem]:
        """Return the items that the file holds, as they are."""
        transects = item.fields("TransectStyleComplexItem", item.title)
        raws: list[Any] = transects.listed("Items")
        if first_number - 1 + len(raws) > MOST_ITEMS:
            transects.refuse(f"more than {MOST_ITEMS:,} items: MAVLink can send no more", "Items")
        for index, raw in enumerate(raws):
            if type(raw) is not dict:
                transects.refuse(
                    f"element {index + 1} of 'Items' is {describe(raw)}", "Items", index
                )
        places = item.document.places(raws)
        return make_items(
            [
                self.simple_items.read(raw, first_number + n, place)
                for n, (raw, place) in enumerate(zip(raws, places, strict=True))
            ]
        )

    def _without_items(
        self, item: JsonFields, kind: str, place: Place, first_number: int
    ) -> list[MissionItem]:
        """Return the items of a survey or corridor that the file does not hold."""
        drawn = self._drawn_path(item, place, first_number)
        if drawn:
            message = (
                f"{item.title} holds no items: flown along the path it is drawn with, "
                f"{quantity.count(len(drawn), 'point')}; QGroundControl and MAVSDK refuse the file"
            )
            self.remarks.add(SURVEY_REBUILT, message, item=first_number, place=place)
            return drawn
        is_older = item.value.get("version") in (2, 3)
        plan = None
        if kind == "survey":
            plan = read_older_survey(item) if is_older else read_survey(item)
        if plan is None:
            return self._refused(item, "it holds neither items nor a path", place)
        try:
            items, lines = make_survey_items(plan, place, first_number=first_number)
        except ValueError as error:
            item.refuse(f"it would have {error}")
        if not items:
            return self._refused(item, "no line crosses its area", place)
        flown = f"{quantity.count(lines, 'line')} {plan.spacing_m:g} m apart"
        if plan.spacing_m < CLOSEST_SPACING_M:
            flown = (
                f"a single line: its spacing is {plan.spacing_m:g} m, and QGroundControl flies one line "
                f"below {CLOSEST_SPACING_M:g} m"
            )
        computed = quantity.count(len(items), "item")
        message = f"{item.title} holds no items: {computed} computed from its area, {flown}"
        self.remarks.add(SURVEY_REBUILT, message, item=first_number, place=place)
        return items

    def _drawn_path(self, item: JsonFields, place: Place, first_number: int) -> list[MissionItem]:
        """Return waypoints along the path a survey or corridor is drawn with, if it is saved."""
        if not isinstance(item.value.get("TransectStyleComplexItem"), dict):
            return []
        transects = item.fields("TransectStyleComplexItem", item.title)
        if not isinstance(transects.value.get("CameraCalc"), dict):
            return []
        # Hovering at pictures is no part of the drawing.
        if transects.value.get("HoverAndCapture") or "VisualTransectPoints" not in transects.value:
            return []
        camera = transects.fields("CameraCalc", item.title)
        frame, altitude_m = read_frame(transects, camera), camera.length("DistanceToSurface")
        sequence = ItemSequence(first_number=first_number, place=place)
        for index in range(len(transects.listed("VisualTransectPoints"))):
            latitude_deg, longitude_deg = transects.position("VisualTransectPoints", index)
            sequence.add_waypoint(latitude_deg, longitude_deg, altitude_m, frame=frame)
        return sequence.items
