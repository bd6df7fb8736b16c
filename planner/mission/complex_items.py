"""Complex items of a plan, expanded to the mission items they stand for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.catalogue.loader import COMPLEX_ITEM_UNKNOWN

if TYPE_CHECKING:
    from planner.findings import Place
    from planner.mission.items import MissionItem
    from planner.mission.json_fields import JsonFields
    from planner.mission.remarks import Remarks
    from planner.mission.simple_item import SimpleItemReader


def expand_complex_item(
    fields: JsonFields,
    place: Place,
    *,
    first_number: int,
    reader: SimpleItemReader,
    remarks: Remarks,
) -> list[MissionItem]:
    """Return the mission items of a complex item that holds them."""
    transects = fields.value.get("TransectStyleComplexItem")
    raws = transects.get("Items") if isinstance(transects, dict) else None
    if not isinstance(raws, list) or not all(isinstance(raw, dict) for raw in raws):
        message = f"{fields.title} cannot be expanded: it is not in this prediction"
        remarks.add(COMPLEX_ITEM_UNKNOWN, message, place=place)
        return []
    places = fields.document.places(raws)
    return [
        reader.read(raw, first_number + n, at)
        for n, (raw, at) in enumerate(zip(raws, places, strict=True))
    ]
