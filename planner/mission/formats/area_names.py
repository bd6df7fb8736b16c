"""What areas of a drawing are called, and which side of them that means."""

from __future__ import annotations

import re
from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class AreaSide(StrEnum):
    """What an area of a drawing is there for."""

    INSIDE = "to stay inside"
    OUTSIDE = "to stay out of"
    WORK = "of the work"
    """Where something is done; whether the flight may leave it is another question."""


_AREAS = "area|areas|zone|zones|volume|box|boundary|perimeter|polygon|fence"
PHRASES: Mapping[AreaSide, tuple[str, ...]] = {
    AreaSide.OUTSIDE: (
        "no fly|flight|flights|flying|go|entry|access|drone|drones|uav|uavs|uas",
        "keep|stay out|away|clear",
        "off limits",
        "exclusion|exclude|excluded|prohibited|forbidden|restricted|nfz",
        "avoid|danger|dangerous|hazard|hazards|obstacle|obstacles",
    ),
    AreaSide.INSIDE: (
        "keep|stay|remain in|inside|within",
        "inclusion|include|included|containment",
        "geo fence",
        f"flight|flying|operation|operations|operational {_AREAS}|geography",
    ),
    AreaSide.WORK: (
        "aoi",
        "area of interest",
        f"survey|mission|work|working|search|mapping|project {_AREAS}",
        "field|site|farm|property boundary|perimeter",
    ),
}
"""Words one after the other, | between those that do; of an area that is called so, among other words."""
FENCES = ("fence", "boundary", "perimeter")
"""What is to be stayed inside where it is the whole name."""
CONTRARY = "not|never|non|outside|beyond|without|free|except|unless"
"""What makes the contrary of what stands beside it: nothing is settled."""


def side_of(words: str) -> AreaSide | None:
    """Return what an area is there for by what it is called, a name a line; ``None``: nothing settles it."""
    plain = plain_name(words)
    # A flight zone is none where there is no flight.
    rest, outs = _pattern(AreaSide.OUTSIDE).subn(";", plain)
    if _contrary().search(plain):
        return None
    is_fence = any(line in FENCES for line in rest.splitlines())
    is_inside = is_fence or _pattern(AreaSide.INSIDE).search(rest) is not None
    is_work = _pattern(AreaSide.WORK).search(rest) is not None
    if outs:
        return None if is_inside or is_work else AreaSide.OUTSIDE
    if is_inside:
        return AreaSide.INSIDE
    return AreaSide.WORK if is_work else None


def plain_name(words: str) -> str:
    """Return names in small letters, a line each, without numbers and signs: alike for parts of one area."""
    lines = re.sub(r"[^\w\n]|[_\d]", " ", words.lower()).splitlines()
    return "\n".join(" ".join(line.split()) for line in lines)


def phrases_text(side: AreaSide) -> str:
    """Return what areas for one thing are called, as a reader of a rule sees it."""
    return "; ".join(phrase.replace("|", "/") for phrase in PHRASES[side])


@cache
def _pattern(side: AreaSide) -> re.Pattern[str]:
    return re.compile("|".join(_phrase(phrase.split()) for phrase in PHRASES[side]))


@cache
def _contrary() -> re.Pattern[str]:
    return re.compile(_phrase([CONTRARY]))


def _phrase(words: Iterable[str]) -> str:
    return rf"\b{' ?'.join(f'(?:{word})' for word in words)}\b"
