"""The list of what was checked: one entry for each rule, and what it lacked where it was not."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

from planner.rules.declaration import Need, NotEvaluated
from planner.values import Value


class Outcome(StrEnum):
    """What became of a rule."""

    CHECKED = "checked"
    NOT_CHECKED = "not-checked"
    NOT_APPLICABLE = "not-applicable"


class LedgerEntry(Value):
    """One rule in the list of what was checked."""

    code: str
    name: str
    outcome: Outcome
    needs: str = ""
    """What it lacks; empty where it was checked."""


def ledger_entry(
    code: str, name: str, missing: Need[Any] | NotEvaluated | str | None = None
) -> LedgerEntry:
    """Return what became of a rule in one of its checks."""
    match missing:
        case None:
            return LedgerEntry(code=code, name=name, outcome=Outcome.CHECKED)
        case NotEvaluated():
            needs, outcome = missing.needs, Outcome.NOT_CHECKED
        case Need(is_subject=False):
            needs, outcome = missing.what, Outcome.NOT_CHECKED
        case _:
            needs = missing if isinstance(missing, str) else missing.what
            outcome = Outcome.NOT_APPLICABLE
    return LedgerEntry(code=code, name=name, outcome=outcome, needs=needs)


_GRAVITY = (Outcome.NOT_APPLICABLE, Outcome.CHECKED, Outcome.NOT_CHECKED)
"""A rule of several checks is checked where one was made, and not checked where one could not be."""


def _is_graver(one: Outcome, other: Outcome) -> bool:
    return _GRAVITY.index(one) > _GRAVITY.index(other)


def one_entry_each(entries: list[LedgerEntry]) -> tuple[LedgerEntry, ...]:
    """Return one entry for each rule, by its code."""
    by_code: dict[str, LedgerEntry] = {}
    for entry in entries:
        known = by_code.setdefault(entry.code, entry)
        if entry is not known and _is_graver(entry.outcome, known.outcome):
            by_code[entry.code] = entry
    return tuple(by_code[code] for code in sorted(by_code))
