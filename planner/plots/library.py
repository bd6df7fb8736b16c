"""The library that draws, loaded where something is drawn."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError

if TYPE_CHECKING:
    from types import ModuleType

Chart = Any
"""A chart of Altair, or its data; the library is loaded where it is used."""

_MISSING = "pictures need the libraries of mavjoule[report]: pip install 'mavjoule[report]'"


def load_altair() -> ModuleType:
    """Return Altair, which builds pictures.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    return _load("altair")


def load_converter() -> ModuleType:
    """Return vl-convert, which writes pictures without a browser.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    return _load("vl_convert")


def _load(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ImportError as error:
        raise UsageError(_MISSING) from error
