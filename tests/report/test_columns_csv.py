"""Columns as CSV."""

from __future__ import annotations

import math

import pytest

from planner.report.columns import columns_csv


def test_columns_become_rows_under_their_heads() -> None:
    assert columns_csv({"time_s": [0.0, 0.1], "state": ["takeoff", "cruise"]}) == (
        "time_s,state\n0.0,takeoff\n0.1,cruise\n"
    )


def test_what_is_absent_or_no_number_is_an_empty_cell() -> None:
    assert columns_csv({"a": [None, math.nan], "b": [1, math.inf]}) == "a,b\n,1\n,\n"


def test_columns_of_different_length_are_refused() -> None:
    with pytest.raises(ValueError, match="shorter"):
        columns_csv({"a": [1, 2], "b": [1]})
