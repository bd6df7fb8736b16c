"""The README is true: what it shows is what the program says.

Run as a program, this writes the generated blocks of the README anew (`make readme`).
"""

from __future__ import annotations

import ast
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from planner.cli.main import COMMANDS
from planner.errors import ExitCode

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
BLOCK = re.compile(r"<!-- begin: (?P<what>[^\n]+?) -->\n(?P<body>.*?)<!-- end -->", re.DOTALL)
RUN = (sys.executable, "-c", "import sys; from planner.cli.main import main; sys.exit(main())")


def _house() -> str:
    """Return the rooms of the package, which are folders, from the contract of its layers, the lowest first.

    Each says of itself what it is, in the first sentence of its docstring.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    [contract] = project["tool"]["importlinter"]["contracts"]
    rows = []
    for layer in reversed(contract["layers"]):
        names = re.split(r"\s*[|:]\s*", layer)
        for name in names:
            place = ROOT / "planner" / name
            if not place.is_dir():
                continue
            file = place / "__init__.py"
            sentence = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
            first = " ".join(re.split(r"(?<=[.:])\s\s|\n\n", sentence)[0].split()).rstrip(".")
            rows.append(f"  {name + '/':12}{first}")
    return "\n".join(["```", "planner/", *rows, "```", ""])


def _generated(what: str) -> str:
    """Return what a block of the README is to hold."""
    if what == "house":
        return _house()
    done = subprocess.run(
        [*RUN, *shlex.split(what)[1:]],
        env={**os.environ, "COLUMNS": "80", "PYTHONUTF8": "1", "PYTHONPATH": str(ROOT)},
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
        encoding="utf-8",
    )
    return f"```console\n$ {what}\n{done.stdout}```\n"


def _blocks() -> dict[str, str]:
    return {
        found["what"]: found["body"] for found in BLOCK.finditer(README.read_text(encoding="utf-8"))
    }


@pytest.mark.parametrize("what", _blocks())
def test_a_block_shows_what_the_program_says(what: str) -> None:
    assert _blocks()[what] == _generated(what), "run `make readme`"


def test_every_command_is_documented() -> None:
    named = re.findall(r"mavjoule\s([a-z][a-z-]+)", README.read_text(encoding="utf-8"))
    assert COMMANDS.keys() <= set(named)


def test_every_exit_code_is_documented() -> None:
    text = (ROOT / "planner" / "report" / "topics" / "pipeline.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| (\d+) \| ", text, re.MULTILINE) == [str(int(one)) for one in ExitCode]


def test_the_library_example_runs_and_finds_what_the_command_finds(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    [example, *_] = re.findall(
        r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL
    )
    exec(compile(example, "README.md", "exec"), {})
    verdict, energy, unit, findings = capsys.readouterr().out.split()
    shown = _blocks()[
        "mavjoule check missions/survey-vineyard.plan --vehicle falkowski-2023-quadrotor"
    ]
    assert f", {energy} {unit}: " in shown, "the same energy as the command's headline"
    assert verdict == "go"
    assert int(findings) > 0


def test_every_picture_and_file_that_is_linked_is_there() -> None:
    linked = re.findall(r"\]\(((?!http)[^)]+)\)", README.read_text(encoding="utf-8"))
    assert len([name for name in linked if name.endswith(".svg")]) == 3
    assert [name for name in linked if not (ROOT / name).is_file()] == []


if __name__ == "__main__":
    README.write_text(
        BLOCK.sub(
            lambda found: (
                f"<!-- begin: {found['what']} -->\n{_generated(found['what'])}<!-- end -->"
            ),
            README.read_text(encoding="utf-8"),
        ),
        encoding="utf-8",
    )
