"""Where in a log a quantity stands."""

from __future__ import annotations

from planner.frozen import frozen


@frozen
class Source:
    """One field of one message."""

    message: str
    """Message or topic."""
    field: str
    unit: float
    """The field times this is in the column's unit; negative where the log counts downwards."""
    valid: str | None
    """Field of the message that says which samples count, where it has such."""


def sources(*places: str, unit: float = 1.0, valid: str | None = None) -> tuple[Source, ...]:
    """Return sources written as ``MESSAGE.field``, all in the same unit."""
    return tuple(
        Source(message=message, field=field, unit=unit, valid=valid)
        for message, field in (place.split(".", 1) for place in places)
    )
