"""The sections ``geoFence`` and ``rallyPoints`` of a plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import numbers
from planner.catalogue.loader import FENCE_VERSION, PLAN_VALUE
from planner.catalogue.loader_text import FENCE_INCOMPLETE, FENCE_ITEM_BROKEN
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.json_fields import JsonFields

if TYPE_CHECKING:
    from planner.mission.remarks import Remarks

AREA_VERSION = 1
SECTION_VERSION = 2


def read_fence(section: JsonFields, remarks: Remarks) -> Fence | None:
    """Return the fence of a plan.

    Parameters
    ----------
    section : JsonFields
        The section ``geoFence``.
    remarks : Remarks
        Where findings go.

    Returns
    -------
    Fence or None
        ``None`` where every loader passes over the section (version 1 or none).

    Raises
    ------
    MissionFileError
        If the section cannot be understood: a fence is never dropped in silence.
    """
    if not _is_current(section, "the fence", remarks):
        return None
    _check_keys(section, ("polygons", "circles"), remarks)
    polygons = []
    for index, raw in _objects(section, "polygons"):
        area = JsonFields(document=section.document, value=raw, title=f"fence polygon {index + 1}")
        area.whole("version", least=AREA_VERSION, most=AREA_VERSION, default=AREA_VERSION)
        _check_keys(area, ("version",), remarks)
        vertices = tuple(area.position("polygon", n) for n in range(len(area.listed("polygon"))))
        place = section.document.place(raw)
        if len(vertices) < 3:
            corners = numbers.count(len(vertices), "vertex", "vertices")
            message = f"{area.title} has {corners} and encloses nothing: left out"
            remarks.add(FENCE_INCOMPLETE, message, place=place)
            continue
        polygons.append(
            FencePolygon(inclusion=area.truth("inclusion"), vertices_deg=vertices, place=place)
        )
    circles = []
    for index, raw in _objects(section, "circles"):
        area = JsonFields(document=section.document, value=raw, title=f"fence circle {index + 1}")
        area.whole("version", least=AREA_VERSION, most=AREA_VERSION, default=AREA_VERSION)
        _check_keys(area, ("version",), remarks)
        circle = area.fields("circle", area.title)
        circle.listed("center")
        latitude_deg, longitude_deg = circle.position("center")
        radius_m = circle.number("radius")
        place = section.document.place(raw)
        if radius_m <= 0.0:
            message = f"{area.title} has radius {radius_m:g} m and encloses nothing: left out"
            remarks.add(FENCE_INCOMPLETE, message, place=place)
            continue
        circles.append(
            FenceCircle(
                inclusion=area.truth("inclusion"),
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                radius_m=radius_m,
                place=place,
            )
        )
    breach_return: tuple[float, float, float | None] | None = None
    if "breachReturn" in section.value:
        values = section.listed("breachReturn")
        altitude = section.altitude("breachReturn", 2) if len(values) > 2 else None
        breach_return = (*section.position("breachReturn"), altitude)
    return Fence(
        polygons=tuple(polygons), circles=tuple(circles), breach_return_deg_m=breach_return
    )


def read_rally_points(section: JsonFields, remarks: Remarks) -> tuple[RallyPoint, ...]:
    """Return the rally points of a plan.

    Parameters
    ----------
    section : JsonFields
        The section ``rallyPoints``.
    remarks : Remarks
        Where findings go.

    Raises
    ------
    MissionFileError
        If the section cannot be understood.
    """
    if not _is_current(section, "the list of rally points", remarks):
        return ()
    points = []
    raw_points = section.listed("points")
    places = section.document.element_places(section.value, "points")
    for index, (raw, place) in enumerate(zip(raw_points, places, strict=True)):
        if not isinstance(raw, list) or len(raw) != 3:
            section.refuse(
                f"rally point {index + 1} must be [latitude, longitude, altitude]", "points", index
            )
        latitude_deg, longitude_deg = section.position("points", index)
        height_m = section.altitude("points", index, 2)
        if height_m is None:
            message = f"rally point {index + 1} has no altitude: left out"
            remarks.add(FENCE_ITEM_BROKEN, message, place=place)
            continue
        points.append(
            RallyPoint(
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                height_above_home_m=height_m,
                place=place,
            )
        )
    return tuple(points)


def _is_current(section: JsonFields, what: str, remarks: Remarks) -> bool:
    """Return whether loaders read a section; tell if they pass over something in it."""
    version = section.whole("version", most=2**31, default=1)
    if version == SECTION_VERSION:
        return True
    if version != 1:
        section.refuse(
            f"{what} is of version {version}, expected {SECTION_VERSION}: "
            "no program reads it, save the plan anew",
            "version",
        )
    if any(value not in ([], {}, None) for key, value in section.value.items() if key != "version"):
        says = "of version 1" if "version" in section.value else "without a version"
        message = f"{what} is {says}: every loader ignores what is in it, and so does this check"
        remarks.add(FENCE_VERSION, message, place=section.document.place(section.value))
    return False


def _check_keys(fields: JsonFields, keys: tuple[str, ...], remarks: Remarks) -> None:
    """Tell about keys that QGroundControl requires and we can do without."""
    for key in keys:
        if key not in fields.value:
            message = f"{fields.title} has no '{key}': QGroundControl refuses the file"
            remarks.add(PLAN_VALUE, message, place=fields.document.place(fields.value))


def _objects(section: JsonFields, key: str) -> list[tuple[int, dict[str, Any]]]:
    """Return the objects in a list with their indexes; a missing list is an empty one."""
    if key not in section.value:
        return []
    values = list(enumerate(section.listed(key)))
    for index, value in values:
        if not isinstance(value, dict):
            section.refuse(f"'{key}' element {index + 1} must be an object", key, index)
    return values
