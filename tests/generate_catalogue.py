"""Write ``planner/catalogue.json``: where every rule is declared, and its message on its own case.

``make rules`` runs it; tests/project/test_rule_coverage.py refuses a file that is out of date.
"""

from __future__ import annotations

import ast
import json
import re
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from planner import catalogue
from planner.findings import Rule

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rule_cases.case import RuleCases

    from planner.findings import Finding

SUBJECTS = sorted(
    path.stem for path in (Path(__file__).parent / "rule_cases").glob("*.py") if path.stem != "case"
)
CASES: Mapping[str, RuleCases] = {
    code: cases
    for subject in SUBJECTS
    for code, cases in import_module(f"rule_cases.{subject}").CASES.items()
}


def example(code: str, fired: Sequence[Finding] | None = None) -> str:
    """Return the message of a rule on a case where it fires, files without their folders.

    ``fired`` are the findings of that case where it was tried already.
    """
    cases = CASES[code]
    found = cases.shown() if cases.shown is not None else fired or cases.fires()
    message = next(finding.message for finding in found if finding.code == code)
    return re.sub(r"\S+/(?=\w+\.bin\b)", "", message)


def declared() -> dict[str, tuple[str, str]]:
    """Return name and module of every ``… = Rule("CODE name", …)`` by its code."""
    root = Path(catalogue.__file__).parent
    found: dict[str, tuple[str, str]] = {}
    for path in sorted(root.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.parse(text).body if "= Rule(" in text else ():
            match node:
                case ast.Assign(
                    value=ast.Call(
                        func=ast.Name(id="Rule"), args=[ast.Constant(value=str(title)), *_]
                    )
                ):
                    code, _, name = title.partition(" ")
                    assert code not in found, f"{code} is declared twice"
                    module = path.relative_to(root.parent).with_suffix("")
                    found[code] = name, ".".join(module.parts)
    return found


def marks(code: str, module: str) -> dict[str, object]:
    """Return what is known of a rule before its module is imported."""
    declared_there = vars(import_module(module)).values()
    rule = next(one for one in declared_there if isinstance(one, Rule) and one.code == code)
    given = {"instead": rule.instead, "leaves_open": rule.leaves_open}
    return {"severity": rule.severity.label} | {name: mark for name, mark in given.items() if mark}


if __name__ == "__main__":
    entries = {
        code: {"name": name, "module": module, "example": example(code)} | marks(code, module)
        for code, (name, module) in sorted(declared().items())
    }
    path = Path(catalogue.__file__).with_suffix(".json")
    path.write_text(json.dumps(entries, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
