"""The topics of ``mavjoule help``: what the help of a command has no room for, each a text beside it.

The texts are Markdown.  A line ``{settings}`` in one is replaced by what is declared, so that no table
is written twice; the keys of model and fleet files are those of the README files shipped with them.
"""

from __future__ import annotations

import re
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from planner import catalogue
from planner.report.rule_text import rules_text
from planner.report.text import Medium, table_lines
from planner.setting import Group
from planner.setup import settings
from planner.vehicle.reader import models_root

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

_TEXTS = Path(__file__).parent
_READMES = {
    "fleet-file": ("missions", "Every key of a fleet file, and the sample missions"),
    "model-file": ("models", "Every key of a model file, and how far off the shipped models are"),
}
"""Folders whose README is a topic, and its title, by the name of that."""
_WIDTH = 100
"""Columns where nobody says how many there are."""
_TABLE_ROW = re.compile(r"\|(.*)\|$")


def topic_names() -> tuple[str, ...]:
    """Return the names of the topics, sorted."""
    return tuple(sorted({path.stem for path in _TEXTS.glob("*.md")} | _READMES.keys()))


def topics_text(*, medium: Medium) -> str:
    """Return a line for each topic."""
    rows = [(f"  {name}", _source(name).partition("\n")[0].lstrip("# ")) for name in topic_names()]
    return "\n".join(["Topics of mavjoule help:", *_wrapped_table(rows, medium)]) + "\n"


def topic_text(name: str, *, medium: Medium) -> str:
    """Return a topic as a pilot reads it on a terminal."""
    medium = Medium(width=medium.width or _WIDTH, is_coloured=medium.is_coloured)
    return "\n".join(_lines(_source(name), medium)) + "\n"


def _source(name: str) -> str:
    """Return a topic in Markdown, with what is declared in its place."""
    if name in _READMES:
        folder, title = _READMES[name]
        text = (models_root().parent / folder / "README.md").read_text(encoding="utf-8")
        text = re.sub(r"^# .*", f"# {title}", text, count=1)
    else:
        text = (_TEXTS / f"{name}.md").read_text(encoding="utf-8")
    for placeholder, declared in _DECLARED.items():
        if placeholder in text:
            text = text.replace(placeholder, declared())
    return re.sub(r"^<!--.*-->\n+", "", text, flags=re.MULTILINE)


def _settings() -> str:
    """Return every setting by its group: its key, its option, what it holds and means."""
    lines = []
    for group in Group:
        lines += ["", f"## {group.value[0].upper()}{group.value[1:]}", ""]
        for setting in settings().values():
            if setting.group is not group:
                continue
            option = f"{setting.option} {setting.metavar}".strip() or "in a file only"
            held = f"in a file: {setting.kind.holds}" if setting.in_file else "typed only"
            lines.append(f"- `{setting.key}`, {option}: {setting.help_text}; {held}")
    return "\n".join(lines[1:])


def _rules() -> str:
    return f"```\n{rules_text(tuple(catalogue.rules().values()))}```"


_DECLARED: Mapping[str, Callable[[], str]] = {"{settings}": _settings, "{rules}": _rules}


def _lines(text: str, medium: Medium) -> Iterator[str]:
    """Yield the lines of a text in Markdown as they are read without it."""
    for kind, block in groupby(_marked(text), key=lambda line: line[0]):
        lines = [line for _, line in block]
        match kind:
            case "code":
                yield from (f"    {line}".rstrip() for line in lines)
            case "heading":
                yield from (medium.paint(_plain(line.lstrip("# ")), "bold") for line in lines)
            case "table":
                cells = [_plain(line).strip("|").split("|") for line in lines]
                rows = [[cell.strip() for cell in row] for row in cells]
                yield from _wrapped_table([rows[0], *rows[2:]], medium)
            case "item":
                for item in re.split(r"\n(?=- )", "\n".join(lines)):
                    yield from medium.wrapped(_plain(" ".join(item.split())), indent=2)
            case "text":
                yield from medium.wrapped(_plain(" ".join(lines)))
            case _:
                yield from lines[:1]


def _marked(text: str) -> Iterator[tuple[str, str]]:
    """Yield the lines of a text, each with what kind of line it is; not the fences of code."""
    kind, is_code = "", False
    for line in text.splitlines():
        if line.startswith("```"):
            is_code = not is_code
            continue
        if is_code:
            kind = "code"
        elif not line:
            kind = ""
        elif line.startswith("#"):
            kind = "heading"
        elif _TABLE_ROW.match(line):
            kind = "table"
        elif line.startswith("- "):
            kind = "item"
        elif kind not in {"item", "text"}:
            kind = "text"
        yield kind, line


def _plain(text: str) -> str:
    """Return a text without the signs that set off code, and links as their texts."""
    return re.sub(r"\[([^]]+)\]\([^)]+\)", r"\1", text).replace("`", "")


def _wrapped_table(rows: Sequence[Sequence[str]], medium: Medium) -> Iterator[str]:
    """Yield the rows of a table; where a column before the last is wide, a paragraph for each row."""
    heads = table_lines([(*row[:-1], "") for row in rows], alignment="<" * len(rows[0]))
    indent = max(map(len, heads)) + 2
    if indent <= 0.7 * (medium.width or _WIDTH):
        for head, row in zip(heads, rows, strict=True):
            yield from medium.wrapped(f"{head:<{indent}}{row[-1]}", indent=indent)
        return
    names = rows[0][2:]
    for first, second, *others in rows[1:]:
        rest = (f"; {name}: {text}" for name, text in zip(names, others, strict=True))
        yield from medium.wrapped(f"- {first}: {second}{''.join(rest)}", indent=2)
