"""Nothing needs a POSIX system: what is not everywhere is not imported, and not used unasked."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

PLANNER = Path(__file__).parents[2] / "planner"
POSIX_MODULES = ("curses", "fcntl", "grp", "pty", "pwd", "readline", "resource", "termios", "tty")
POSIX_NAMES = {
    "os": {
        "fork",
        "getuid",
        "geteuid",
        "getpgid",
        "killpg",
        "mkfifo",
        "openpty",
        "setsid",
        "uname",
    },
    "signal": {
        "SIGALRM",
        "SIGCHLD",
        "SIGHUP",
        "SIGKILL",
        "SIGQUIT",
        "SIGUSR1",
        "SIGWINCH",
        "alarm",
    },
    "select": {"epoll", "kqueue", "poll"},
    "time": {"tzset"},
}
"""Names that Windows lacks, by their modules."""


def test_no_module_names_what_windows_lacks(trees: dict[Path, ast.Module]) -> None:
    found = []
    for path, tree in trees.items():
        is_tried = {id(one) for node in ast.walk(tree) for one in _tried(node)}
        for node in ast.walk(tree):
            if id(node) in is_tried:
                continue
            names: set[str] = set()
            match node:
                case ast.Import(names=aliases):
                    names = {alias.name for alias in aliases} & set(POSIX_MODULES)
                case ast.ImportFrom(module=str(module), names=aliases):
                    names = {module} & set(POSIX_MODULES)
                    names |= {alias.name for alias in aliases} & POSIX_NAMES.get(module, set())
                case ast.Attribute(value=ast.Name(id=module), attr=name):
                    names = {name} & POSIX_NAMES.get(module, set())
                case _:
                    continue
            found += [f"{path}:{node.lineno}: {name}" for name in names]
    assert found == []


def _tried(node: ast.AST) -> list[ast.stmt]:
    """Return what is imported if it is there: a handler says what is done without it."""
    match node:
        case ast.Try(body=body, handlers=[ast.ExceptHandler(type=ast.Name(id="ImportError"))]):
            return body
    return []


def test_command_line_and_terminal_ui_load_without_the_modules_windows_lacks() -> None:
    modules = [
        ".".join(path.relative_to(PLANNER.parent).with_suffix("").parts)
        for folder in ("cli", "tui")
        for path in sorted((PLANNER / folder).rglob("*.py"))
        if path.stem != "__init__"
    ]
    assert {"planner.cli.review", "planner.tui.app"} <= set(modules)
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({POSIX_MODULES!r}))\n"
        "from importlib import import_module\n"
        f"for name in {modules!r}: import_module(name)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.returncode == 0
