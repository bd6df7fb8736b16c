"""The fields of one JSON object, read with what they have to be; anything else is refused."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from planner.frozen import frozen
from planner.mission.json_document import describe

if TYPE_CHECKING:
    from planner.mission.json_document import JsonDocument

LARGEST_NUMBER = 3.4e38
"""MAVLink sends numbers in 32 bits."""
LARGEST_LENGTH_M = 100_000.0
"""Beyond it a length or an altitude is a mistake. [m]"""

_NUMBER_TYPES = frozenset({int, float})


@frozen
class JsonFields:
    """An object of a document together with what it is called in messages."""

    document: JsonDocument
    value: dict[str, Any]
    title: str
    """As in "the fence", "item 7 (survey)"."""

    def refuse(self, message: str, *path: str | int) -> NoReturn:
        """Raise the error about this object or a value inside it."""
        self.document.refuse(f"{self.title}: {message}", self.value, *path)

    def _refuse_value(self, expected: str, *path: str | int) -> NoReturn:
        value = self._at(path)
        name = " element ".join(f"'{s}'" if isinstance(s, str) else str(s + 1) for s in path)
        self.refuse(f"{name} is {describe(value)}, expected {expected}", *path)

    def _at(self, path: tuple[str | int, ...]) -> Any:  # noqa: ANN401 (whatever JSON holds)
        value: Any = self.value
        for step in path:
            value = value[step]
        return value

    def required(self, key: str) -> Any:  # noqa: ANN401 (whatever JSON holds)
        """Return a value that has to be there, whatever it is."""
        if key not in self.value:
            self.refuse(f"'{key}' is missing")
        return self.value[key]

    def fields(self, key: str, title: str) -> JsonFields:
        """Return the fields of an object inside this one."""
        value = self.required(key)
        if not isinstance(value, dict):
            self._refuse_value("an object", key)
        return JsonFields(document=self.document, value=value, title=title)

    def listed(self, key: str) -> list[Any]:
        """Return a list."""
        value = self.required(key)
        if not isinstance(value, list):
            self._refuse_value("a list", key)
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """Return a number; with a default it need not be there."""
        if default is not None and key not in self.value:
            return default
        return self.real(self.required(key), key)

    def length(self, key: str, default: float | None = None) -> float:
        """Return a length no longer than anybody flies; it may be negative. [m]."""
        length_m = self.number(key, default)
        if abs(length_m) > LARGEST_LENGTH_M:
            self._refuse_value("a length in metres", key)
        return length_m

    def whole(self, key: str, *, least: int = 0, most: int, default: int | None = None) -> int:
        """Return a whole number of a range; with a default it need not be there."""
        number = self.number(key, default)
        if not (least <= number <= most and number == int(number)):
            self._refuse_value(f"a whole number from {least} to {most}", key)
        return int(number)

    def truth(self, key: str, default: bool | None = None) -> bool:  # noqa: FBT001 (as dict.get)
        """Return ``true`` or ``false``; with a default it need not be there."""
        if default is not None and key not in self.value:
            return default
        value = self.required(key)
        if not isinstance(value, bool):
            self._refuse_value("true or false", key)
        return value

    def real(self, value: object, *path: str | int) -> float:
        """Return a value found at a path as a number."""
        if type(value) not in _NUMBER_TYPES or not -LARGEST_NUMBER <= value <= LARGEST_NUMBER:  # type: ignore[operator]  # the set holds int and float only
            self._refuse_value("a number", *path)
        return float(value)  # type: ignore[arg-type]  # as above

    def position(self, *path: str | int) -> tuple[float, float]:
        """Return (latitude, longitude) [°] of a list that begins with them."""
        value = self._at(path)
        if not isinstance(value, list) or len(value) < 2:
            self._refuse_value("[latitude, longitude]", *path)
        return self.degrees(90.0, *path, 0), self.degrees(180.0, *path, 1)

    def degrees(self, most: float, *path: str | int) -> float:
        """Return an angle of at most so many degrees. [°]."""
        value = self._at(path)
        angle = self.real(value, *path)
        if abs(angle) > most:
            hint = " (this looks like degrees × 10⁷)" if abs(angle) > 1e5 else ""
            self._refuse_value(f"degrees from −{most:g} to {most:g}{hint}", *path)
        return angle

    def altitude(self, *path: str | int) -> float | None:
        """Return an altitude, ``None`` for null. [m]."""
        value = self._at(path)
        if value is None:
            return None
        altitude = self.real(value, *path)
        if abs(altitude) > LARGEST_LENGTH_M:
            self._refuse_value("an altitude in metres", *path)
        return altitude
