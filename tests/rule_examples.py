"""Record the message of every rule on its own case: ``PYTHONPATH=.:tests python tests/rule_examples.py``.

``mavjoule explain`` prints them; tests/project/test_rule_coverage.py refuses those that are out of date.
"""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from planner import catalogue

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rule_cases.case import RuleCases

SUBJECTS = sorted(
    path.stem for path in (Path(__file__).parent / "rule_cases").glob("*.py") if path.stem != "case"
)
CASES: Mapping[str, RuleCases] = {
    code: cases
    for subject in SUBJECTS
    for code, cases in import_module(f"rule_cases.{subject}").CASES.items()
}


def example(code: str) -> str:
    """Return the message of a rule on a case where it fires, files without their folders."""
    cases = CASES[code]
    found = (cases.shown or cases.fires)()
    message = next(finding.message for finding in found if finding.code == code)
    return re.sub(r"\S+/(?=\w+\.bin\b)", "", message)


if __name__ == "__main__":
    examples = {code: example(code) for code in sorted(CASES)}
    path = Path(catalogue.__file__).parent / "examples.json"
    path.write_text(json.dumps(examples, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
