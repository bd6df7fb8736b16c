"""Names in parameter files that are one slip of the pen away from a name that counts."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator


def misspelt_names(given: Collection[str], wanted: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield (name given, name wanted) for names that nobody knows and that were meant otherwise.

    Parameters
    ----------
    given : collection of str
        Names of a file that are not known.
    wanted : collection of str
        Names that are known, and not in the file.

    Yields
    ------
    tuple of str
        Names apart by one letter too many, too few or wrong, or two that changed places.  Digits do
        not count: BATT2_CAPACITY is another battery.
    """
    for name in given:
        for other in wanted:
            if abs(len(name) - len(other)) <= 1 and _is_a_slip(name, other):
                yield name, other
                break


def _is_a_slip(given: str, wanted: str) -> bool:
    first = next(
        (at for at, (a, b) in enumerate(zip(given, wanted, strict=False)) if a != b),
        min(len(given), len(wanted)),
    )
    before, after = given[first:], wanted[first:]
    if len(given) == len(wanted):
        swapped = before[:2] == after[:2][::-1] and before[2:] == after[2:]
        replaced = before[1:] == after[1:]
        return swapped or (replaced and not (before[0].isdigit() or after[0].isdigit()))
    longer, shorter = (before, after) if len(given) > len(wanted) else (after, before)
    return longer[1:] == shorter and not longer[0].isdigit()
