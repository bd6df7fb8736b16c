"""What the house asks of every room: one name for one thing, and nothing handed over in heaps."""

from __future__ import annotations

import ast
from collections import defaultdict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

MOST_PARAMETERS = 8
MAY_HAVE_MORE = {"parameter"}
"""A row of the table of parameters: each argument a column of it."""
LONGEST_COMMAND = 40


def _functions(trees: dict[Path, ast.Module]) -> list[tuple[str, ast.FunctionDef]]:
    return [
        (f"{path}: {node.name}", node)
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
    ]


def test_no_class_name_is_used_twice(trees: dict[Path, ast.Module]) -> None:
    places = defaultdict(list)
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(str(path))
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_no_function_takes_more_than_eight_parameters(trees: dict[Path, ast.Module]) -> None:
    heaps = []
    for name, node in _functions(trees):
        taken = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        count = sum(argument.arg not in {"self", "cls", "mcls"} for argument in taken)
        if count > MOST_PARAMETERS and node.name not in MAY_HAVE_MORE:
            heaps.append((name, count))
    assert heaps == []


def test_every_rule_takes_the_path_from_the_assessment(trees: dict[Path, ast.Module]) -> None:
    made = [
        str(path)
        for path, tree in trees.items()
        if path.parts[0] == "rules"
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).rpartition(".")[2] in {"flown_path", "FlownPath"}
    ]
    assert made == ["rules/assessment.py"]


def test_the_body_of_a_command_fits_a_screen(trees: dict[Path, ast.Module]) -> None:
    long = []
    for name, node in _functions(trees):
        if not any("command(" in ast.unparse(decorator) for decorator in node.decorator_list):
            continue
        body = node.body[1:] if ast.get_docstring(node) else node.body
        lines = sum((part.end_lineno or 0) - part.lineno + 1 for part in body)
        if lines > LONGEST_COMMAND:
            long.append((name, lines))
    assert long == []
