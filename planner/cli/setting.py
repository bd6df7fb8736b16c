"""What a setting is: one thing a user can set, on the command line and in a configuration."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Any

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


class Kind(Enum):
    """What a setting holds in a TOML file, in the words of the documentation."""

    TEXT = "text"
    NUMBER = "number"
    QUANTITY = "text or number"
    PATH = "path"
    PATHS = "path or list of paths"
    MODEL = "name of a vehicle model or path of its file"
    TEXTS = "text or list of texts"
    SWITCH = "true or false"
    TABLE = "table of codes by file"


class Setting(Value):
    """One thing a user can set."""

    key: str
    """Key of the configuration, with its unit."""
    option: str
    """Name on the command line; empty where it only stands in a configuration."""
    metavar: str
    meaning: str
    read: Callable[[str], Any]
    """From text to value; raises ``ValueError`` with a sentence."""
    kind: Kind = Kind.TEXT
    choices: Callable[[], Iterable[str]] = tuple
    """What a shell offers for it."""
