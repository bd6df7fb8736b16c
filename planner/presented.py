"""How results answer to scripts and notebooks: in a line, as plain data, as tables, as a small page."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

from planner.values import Value, brief

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from types import ModuleType

Table = Literal["segments", "items"]
FrameLibrary = Literal["pandas", "polars"]


def _report() -> ModuleType:
    """Return what writes results; it knows all of them, so that none of them knows it."""
    return import_module("planner.report.library")


def data_frame(
    columns: Mapping[str, list[Any]], *, numbers: Collection[str], library: FrameLibrary | None
) -> Any:  # noqa: ANN401 - pandas.DataFrame or polars.DataFrame
    """Return columns as a data frame of a library, or of the first that is installed.

    Raises
    ------
    MissingLibraryError
        If neither is installed, or not the one asked for.
    """
    return _report().data_frame(columns, numbers=numbers, library=library)


class Shown(Value):
    """A result that a notebook shows."""

    __repr__ = brief

    def _repr_html_(self) -> str:
        """Return what the command prints of it; of a check its figures, findings and a small map."""
        page: str = _report().result_html(self)
        return page


class Presented(Shown):
    """A result that a script looks at as well."""

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON report of the command holds, schema 1: SI, the unit in each key.

        Of the check of one mission it is the object under ``missions``.
        """
        document: dict[str, Any] = _report().result_document(self)
        return document

    def to_json(self, *, indent: int | None = 2) -> str:
        """Return `to_dict` as text, on one line where no indent is given."""
        text: str = _report().result_json(self, indent=indent)
        return text


class PresentedCheck(Presented):
    """The check of one mission."""

    def to_dataframe(
        self, table: Table = "segments", *, library: FrameLibrary | None = None
    ) -> Any:  # noqa: ANN401 - pandas.DataFrame or polars.DataFrame
        """Return the segments or the items as a data frame, the columns those of the JSON report.

        Parameters
        ----------
        table : {"segments", "items"}
            What the rows are.
        library : {"pandas", "polars"}, optional
            Whose data frame; by default of the first that is installed.

        Raises
        ------
        MissingLibraryError
            If neither is installed, or not the one asked for.
        UsageError
            If there is no such table or library.
        """
        return _report().result_frame(self, table, library=library)
