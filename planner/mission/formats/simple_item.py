"""A ``SimpleItem`` of a plan: one MAVLink mission item with copies for display beside it."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

import msgspec

from planner.findings import Rule, Severity
from planner.mission.commands import AMSL_FRAMES, GLOBAL_FRAMES, Frame, load_command_table
from planner.mission.formats.json_document import (
    LARGEST_LENGTH_M,
    LARGEST_NUMBER,
    JsonFields,
    describe,
)
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Place, Remarks
    from planner.mission.formats.json_document import JsonDocument


COMPLEX_ITEM_UNKNOWN = Rule(
    "L112 complex-item-unknown",
    Severity.ERROR,
    summary="A complex item cannot be expanded: it is not in the prediction.",
    why="QGroundControl continues without it: part of the mission is not flown, without a message.",
    how="complexItemType and version are compared with those that QGroundControl has written.",
    fix="upload the plan and fetch it back from the vehicle: then it holds plain items",
    instead="a plan whose complex items are known",
)


ALTITUDE_KEYS = ("AMSLAltAboveTerrain", "Altitude", "AltitudeMode")
"""The copies of its altitude in an item, for display."""

_NUMBER_TYPES = frozenset({int, float})
_COPY_TYPES = _NUMBER_TYPES | {type(None)}
_PARAMETERS = (*(f"parameter {n}" for n in range(1, 5)), "latitude", "longitude", "altitude")
_LIMITS = (
    (90.0, "from -90 to 90°"),
    (180.0, "from -180 to 180°"),
    (LARGEST_LENGTH_M, f"within {LARGEST_LENGTH_M / 1000.0:g} km"),
)
"""Of the last three of them."""
_COPY_TOLERANCE_M = 0.01
"""Ground stations show altitudes to the centimetre. [m]"""

_MIXED, _RELATIVE, _AMSL, CALCULATED_MODE, _TERRAIN = range(5)
_MODE_NAMES = ("mixed", "above home", "AMSL", "AMSL from terrain", "above terrain")
"""QGroundControl's AltitudeMode since version 4.2 (May 2021)."""
ALTITUDE_MODE_OF_FRAME: dict[int, int] = {
    Frame.GLOBAL_RELATIVE_ALT: _RELATIVE,
    Frame.GLOBAL_RELATIVE_ALT_INT: _RELATIVE,
    Frame.GLOBAL: _AMSL,
    Frame.GLOBAL_INT: _AMSL,
    Frame.GLOBAL_TERRAIN_ALT: _TERRAIN,
    Frame.GLOBAL_TERRAIN_ALT_INT: _TERRAIN,
}
"""The AltitudeMode that means the same as a frame."""


def is_complex(raw: dict[str, Any]) -> bool:
    """Return whether an element of a plan is a complex item, in whatever version."""
    kind = raw.get("type")
    return kind != "SimpleItem" and (kind in ("ComplexItem", "survey") or "complexItemType" in raw)


def has_whole_copies(raw: dict[str, Any]) -> bool:
    """Return whether an element has copies of its altitude that QGroundControl takes, or none."""
    if type(raw.get("Altitude")) in _NUMBER_TYPES:
        return (
            type(raw.get("AltitudeMode")) in _NUMBER_TYPES
            and type(raw.get("AMSLAltAboveTerrain", "")) in _COPY_TYPES
        )
    return raw.keys().isdisjoint(ALTITUDE_KEYS)


ALTITUDE_COPY = Rule(
    "L103 altitude-copy",
    Severity.WARNING,
    summary="QGroundControl shows another altitude than the vehicle flies.",
    why="The vehicle gets 'frame' and the seventh parameter; 'Altitude' is a copy for display.  Where "
    "a script changed one of them, the pilot sees an altitude that is not flown, and editing the item "
    "overwrites the one that was meant.",
    how="Compares 'Altitude' (or 'AMSLAltAboveTerrain', where the altitude was computed from terrain) "
    "with the seventh parameter, to 0.01 m.  The seventh parameter is flown.",
    fix="edit the altitude in QGroundControl and save, or write both numbers",
)

ALTITUDE_MODE = Rule(
    "L104 altitude-mode",
    Severity.WARNING,
    summary="QGroundControl shows another altitude reference than the vehicle flies.",
    why="The numbers of 'AltitudeMode' were changed three times without a new file version (2018, "
    "2019, 2021): a file of one era shows as AMSL in another what is flown above home.  The vehicle "
    "goes by 'frame' alone.",
    how="Compares 'AltitudeMode', as QGroundControl reads it since 4.2, with 'frame'; mode 0 with a "
    "frame above home, as in 2018, is no more than a note.",
    fix="open the plan in a current QGroundControl, set the altitude reference and save",
)

AUTOCONTINUE_TYPE = Rule(
    "L109 autocontinue-type",
    Severity.WARNING,
    summary="'autoContinue' is missing or no truth value.",
    why="QGroundControl refuses the file for it.",
    how="true, false, 0 and 1 are understood; missing is taken as true.",
    fix="write true or false",
)

OLDER_ITEM = Rule(
    "L110 older-item",
    Severity.INFO,
    summary="An item is written in the form that older plans had.",
    why="QGroundControl converts it, MAVSDK and scripts that read 'params' do not.",
    how="param1 to param4, or four params, and 'coordinate'; or the type 'missionItem'.",
    fix="open the file in QGroundControl and save it as a plan",
)

COORDINATE_KEY = Rule(
    "L111 coordinate-and-params",
    Severity.WARNING,
    summary="An item has seven params and a 'coordinate' as well.",
    why="QGroundControl joins them to ten values and refuses the file.",
    how="They must be equal, or params 5 to 7 must be zero or null; then 'coordinate' is the place "
    "flown to.  Otherwise the file is refused here, too.",
    fix="write the place into params 5 to 7 and delete 'coordinate'",
)

ITEM_TYPE = Rule(
    "L118 item-type",
    Severity.WARNING,
    summary="An item's type is not SimpleItem, but it reads like one.",
    why="QGroundControl refuses the file.",
    how="The item has a command; 'type' is missing, null or another text.",
    fix='write "type": "SimpleItem"',
)

PLAN_VALUE = Rule(
    "L119 plan-value",
    Severity.WARNING,
    summary="A value is missing or of another type than QGroundControl wants.",
    why="QGroundControl refuses the whole file at the first such value, also where it means nothing "
    "to the vehicle.",
    how="What can be read all the same: the speeds and altitudes for display, 'doJumpId', "
    "'groundStation', the versions and lists inside fence and complex items.",
    fix="open the plan in the program that wrote it and save it as a QGroundControl plan",
)


_Number = Annotated[float, msgspec.Meta(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)] | None
_Latitude = Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)] | None
_Longitude = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)] | None
_Altitude = Annotated[float, msgspec.Meta(ge=-LARGEST_LENGTH_M, le=LARGEST_LENGTH_M)] | None


class _CleanItem(Value, forbid_unknown_fields=True, gc=False):
    """A simple item as QGroundControl writes it, whatever its command."""

    type: Literal["SimpleItem"]
    command: Annotated[int, msgspec.Meta(ge=0, le=65_535)]
    frame: Annotated[int, msgspec.Meta(ge=0, le=255)]
    params: tuple[_Number, _Number, _Number, _Number, _Latitude, _Longitude, _Altitude]
    autoContinue: bool  # noqa: N815 - as the keys are
    doJumpId: int  # noqa: N815
    Altitude: float | msgspec.UnsetType = msgspec.UNSET
    AltitudeMode: int | msgspec.UnsetType = msgspec.UNSET
    AMSLAltAboveTerrain: float | msgspec.UnsetType | None = msgspec.UNSET

    @property
    def is_shown_as_flown(self) -> bool:
        """Whether the copies of its altitude say what is flown, or there are none."""
        if self.Altitude is msgspec.UNSET:
            return self.AltitudeMode is self.AMSLAltAboveTerrain is msgspec.UNSET
        mode = ALTITUDE_MODE_OF_FRAME.get(self.frame)
        return self.Altitude == self.params[6] and self.AltitudeMode == mode


_UNCLEAN = msgspec.ValidationError, UnicodeEncodeError
"""What is raised of an item that is not clean; the second by half a character ("\\ud800")."""


def _clean_items(elements: Sequence[dict[str, Any]]) -> Sequence[_CleanItem | None]:
    """Return elements of a plan, of which all is checked at once; ``None``: one is not clean."""
    with suppress(*_UNCLEAN):
        return msgspec.convert(elements, list[_CleanItem])
    items: list[_CleanItem | None] = []
    for raw in elements:
        try:
            items.append(msgspec.convert(raw, _CleanItem))
        except _UNCLEAN:
            items.append(None)
    return items


class SimpleItemReader:
    """Reads the items of one document; what is odd about them goes to its remarks.

    In a file from before plans jump ids have another key, and items in an older form are no finding.
    """

    def __init__(
        self, document: JsonDocument, remarks: Remarks, *, is_legacy: bool = False
    ) -> None:
        self._document = document
        self.remarks = remarks
        self._is_legacy = is_legacy
        self._jump_key = "id" if is_legacy else "doJumpId"
        self._located = frozenset(
            number
            for number, definition in load_command_table().commands.items()
            if definition.has_location
        )

    def clean_rows(
        self, elements: Sequence[dict[str, Any]], places: Sequence[Place]
    ) -> list[tuple[Any, ...] | None]:
        """Return what `read` does of each element; ``None`` of those that are not clean."""
        if self._is_legacy:
            return [None] * len(elements)
        return [
            (one.command, one.frame, *one.params, one.autoContinue, one.doJumpId, place, None)
            if one is not None and one.is_shown_as_flown
            else None
            for one, place in zip(_clean_items(elements), places, strict=True)
        ]

    def read(self, raw: dict[str, Any], number: int, place: Place) -> tuple[Any, ...]:
        """Return the values of the mission item that an object is, for `make_items`."""
        command = raw.get("command")
        if type(command) is not int or not 0 <= command <= 65_535:
            command = self._fields(raw, number).whole("command", most=65_535)
        frame = raw.get("frame")
        if type(frame) is not int or not 0 <= frame <= 255:
            frame = self._fields(raw, number).whole("frame", most=255)
        values = self._values(raw, number, place)
        latitude, longitude, altitude = values[4:]
        agl: float | None = None
        if command in self._located and frame in GLOBAL_FRAMES:
            if not (
                -90.0 <= (latitude or 0.0) <= 90.0
                and -180.0 <= (longitude or 0.0) <= 180.0
                and abs(altitude or 0.0) <= LARGEST_LENGTH_M
            ):
                self._refuse_position(raw, number, values)
            if "Altitude" in raw and (
                raw["Altitude"] != altitude
                or raw.get("AltitudeMode") != ALTITUDE_MODE_OF_FRAME[frame]
            ):
                agl = self._compare_copies(raw, number, place, altitude, frame)
        if not has_whole_copies(raw):
            message = (
                f"item {number} needs a number in 'Altitude' and 'AltitudeMode', and one or null in "
                "'AMSLAltAboveTerrain': QGroundControl refuses the file"
            )
            self.remarks.add(PLAN_VALUE, message, item=number, place=place)
        autocontinue = raw.get("autoContinue")
        if autocontinue is not True and autocontinue is not False:
            autocontinue = self._autocontinue(raw, number, place)
        jump_id = raw.get(self._jump_key)
        if type(jump_id) is not int:
            jump_id = self._jump_id(raw, number, place)
        return (command, frame, *values, autocontinue, jump_id, place, agl)

    def is_simple(self, raw: dict[str, Any], number: int, place: Place) -> bool:
        """Return whether an object whose type is not "SimpleItem" is one all the same."""
        kind = raw.get("type")
        if is_complex(raw):
            return False
        if "command" not in raw:
            self._fields(raw, number).refuse(
                f"its type is {describe(kind)} and it has no command: "
                "expected a SimpleItem or a ComplexItem"
            )
        if kind == "missionItem":
            self._report_older(number, place, "is of the type 'missionItem', from before plans")
        else:
            what = describe(kind) if "type" in raw else "missing"
            message = (
                f"'type' of item {number} is {what}, read as SimpleItem: "
                "QGroundControl refuses the file"
            )
            self.remarks.add(ITEM_TYPE, message, item=number, place=place)
        return True

    def _fields(self, raw: dict[str, Any], number: int) -> JsonFields:
        return JsonFields(document=self._document, value=raw, title=f"item {number}")

    def _values(self, raw: dict[str, Any], number: int, place: Place) -> list[float | None]:
        if "coordinate" in raw or "param1" in raw:
            params: Any = self._older_shape(raw, number, place)
        else:
            params = raw.get("params")
        if type(params) is not list or len(params) != 7:
            self._fields(raw, number).refuse("'params' must be a list of 7 values", "params")
        values: list[float | None] = []
        for value in params:
            if value is None:
                values.append(None)
            elif type(value) in _NUMBER_TYPES and -LARGEST_NUMBER <= value <= LARGEST_NUMBER:
                values.append(float(value))
            else:
                expected = "a number of at most 32 bits or null"
                self._refuse_parameter(raw, number, len(values), value, expected)
        return values

    def _refuse_position(
        self, raw: dict[str, Any], number: int, values: list[float | None]
    ) -> NoReturn:
        """Raise the error about a place that is not on the Earth or nobody flies to."""
        for index, (limit, expected) in enumerate(_LIMITS, start=4):
            value = abs(values[index] or 0.0)
            if value > limit:
                hint = " (this looks like degrees × 10⁷)" if index < 6 and value > 1e5 else ""
                self._refuse_parameter(raw, number, index, values[index], f"{expected}{hint}")
        raise AssertionError  # called only where one of them is beyond its limit

    def _refuse_parameter(
        self, raw: dict[str, Any], number: int, index: int, value: object, expected: str
    ) -> NoReturn:
        if "coordinate" in raw and index >= 4:
            path: tuple[str | int, ...] = ("coordinate", index - 4)
        else:
            path = ("params", index) if "params" in raw else (f"param{index + 1}",)
        message = f"its {_PARAMETERS[index]} is {describe(value)}, expected {expected}"
        self._fields(raw, number).refuse(message, *path)

    def _older_shape(self, raw: dict[str, Any], number: int, place: Place) -> list[Any]:
        """Return the seven parameters of an item in one of the forms before the present one."""
        fields = self._fields(raw, number)
        if "params" in raw:
            params = fields.listed("params")
        else:
            params = [fields.required(f"param{n}") for n in range(1, 5)]
        if "coordinate" not in raw:
            return params
        coordinate = fields.listed("coordinate")
        if len(coordinate) != 3:
            fields.refuse("'coordinate' must be [latitude, longitude, altitude]", "coordinate")
        if len(params) != 7:
            self._report_older(number, place, "has its place in 'coordinate', as before plans")
            return [*params, *coordinate]
        if params[4:] != coordinate and any(params[4:]):
            fields.refuse("'params' and 'coordinate' give two different places", "coordinate")
        message = (
            f"item {number} has 7 params and a coordinate: its place is taken from 'coordinate', "
            "QGroundControl refuses the file"
        )
        self.remarks.add(COORDINATE_KEY, message, item=number, place=place)
        return [*params[:4], *coordinate]

    def _report_older(self, number: int, place: Place, what: str) -> None:
        if not self._is_legacy:
            self.remarks.add(OLDER_ITEM, f"item {number} {what}", item=number, place=place)

    def _jump_id(self, raw: dict[str, Any], number: int, place: Place) -> int | None:
        """Return the id for jumps where it is no plain integer."""
        key = self._jump_key
        if key not in raw:
            return None
        if raw[key] is None:
            message = f"'{key}' of item {number} is null: QGroundControl refuses the file"
            self.remarks.add(PLAN_VALUE, message, item=number, place=place)
            return None
        return self._fields(raw, number).whole(key, least=-1, most=2**31 - 1)

    def _autocontinue(self, raw: dict[str, Any], number: int, place: Place) -> bool:
        value = raw.get("autoContinue", 1)
        if value not in (0, 1):
            self._fields(raw, number).truth("autoContinue")
        what = describe(value) if "autoContinue" in raw else "missing"
        message = (
            f"'autoContinue' of item {number} is {what}, read as {describe(bool(value))}: "
            "QGroundControl refuses the file"
        )
        self.remarks.add(AUTOCONTINUE_TYPE, message, item=number, place=place)
        return bool(value)

    def _compare_copies(
        self, raw: dict[str, Any], number: int, place: Place, altitude: float | None, frame: int
    ) -> float | None:
        """Report where the copies for display differ from what is flown.

        Returns the height above ground of an item whose altitude is not worked out yet. [m]
        """
        mode, shown = raw.get("AltitudeMode"), raw["Altitude"]
        if mode == CALCULATED_MODE and type(raw.get("AMSLAltAboveTerrain")) in _NUMBER_TYPES:
            shown = raw["AMSLAltAboveTerrain"]
        if (
            altitude is not None
            and type(shown) in _NUMBER_TYPES
            and not altitude - _COPY_TOLERANCE_M <= shown <= altitude + _COPY_TOLERANCE_M
        ):
            # A whole number of JSON may be larger than any float.
            text = describe(shown) if abs(shown) > LARGEST_LENGTH_M else f"{shown:.10g}"
            message = f"item {number} is shown at {text} m and flown at {altitude:.10g} m"
            self.remarks.add(ALTITUDE_COPY, message, item=number, place=place)
        flown = ALTITUDE_MODE_OF_FRAME[frame]
        if type(mode) is not int or not 0 <= mode < len(_MODE_NAMES):
            return None
        if mode != flown and (mode, flown) != (CALCULATED_MODE, _AMSL):
            message = (
                f"item {number} is shown as {_MODE_NAMES[mode]} (mode {mode}) and flown "
                f"{_MODE_NAMES[flown]} (frame {frame})"
            )
            is_harmless = (mode, flown) == (_MIXED, _RELATIVE)  # as QGroundControl wrote it in 2018
            severity = Severity.INFO if is_harmless else None
            self.remarks.add(ALTITUDE_MODE, message, item=number, place=place, severity=severity)
        agl = raw["Altitude"]
        is_waiting = altitude is None and mode == CALCULATED_MODE and frame in AMSL_FRAMES
        if is_waiting and type(agl) in _NUMBER_TYPES and abs(agl) <= LARGEST_LENGTH_M:
            return float(agl)
        return None
