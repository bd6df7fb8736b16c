"""A file system that fails at a chosen call, in a forked copy of this process: killed, full, read-only.

What a command does to files goes through `io.open` and `os`; both are replaced in the child, which then
runs the command.  The parent looks at what is left.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import re
import shutil
import signal
import sys
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cli.main import main

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

SIGNALS = {"SIGKILL": signal.SIGKILL, "SIGINT": signal.SIGINT, "SIGTERM": signal.SIGTERM}
FAULTS = (*SIGNALS, "SIGINT after", "SIGTERM after", "full disk", "read-only", "once")
"""Signals come before the call, or after it is done; a disk stays full or read-only; once: EIO."""
_ENDING = frozenset({"SIGKILL", "read-only"})
"""After which nothing can be put back, or taken away."""
_CALLS = (
    "open",
    "replace",
    "rename",
    "link",
    "unlink",
    "mkdir",
    "rmdir",
    "chmod",
    "fsync",
    "write",
    "ftruncate",
)
_GROWING = frozenset({"open", "write", "mkdir", "link"})
"""What takes room on a disk."""
_TIME = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\.\d+)?")


@dataclass(frozen=True)
class Command:
    """A call of the command line, or of anything that returns an exit code, in a folder of files."""

    name: str
    call: Sequence[str] | Callable[[], int]
    files: Mapping[str, bytes]
    """That are there before, what is replaced among them."""
    pairs: Sequence[Sequence[str]] = ()
    """Names of files of which new and old ones never stand beside each other."""
    appends: frozenset[str] = frozenset()
    """Files whose old content stays, and may get whole lines more."""
    resumes: frozenset[str] = frozenset()
    """Files that are parts of something and may have any beginning of it."""
    ends: int = 0
    """Its exit code where nothing disturbs it: a sweep of a command that fails shows nothing."""
    prepare: Callable[[], None] = lambda: None
    """Called in the child before the command runs."""


@dataclass(frozen=True)
class Ended:
    """How a call ended, and what is in its folder."""

    code: int
    """The exit code, or −9 of one that was killed."""
    is_reached: bool
    """Whether there was such a call."""
    said: str
    files: dict[str, bytes] = field(default_factory=dict)


class _Faults:
    """Counts the calls, and fails at the chosen one."""

    def __init__(self, at: int, fault: str, reached: int) -> None:
        self._at, self._fault, self._reached = at, fault, reached
        self._count = 0
        self.whole = {name: getattr(os, name) for name in _CALLS}

    def around(self, name: str, call: Callable[[], Any]) -> Any:  # noqa: ANN401 - whatever is called
        self._count += 1
        if self._count == self._at:
            self.whole["write"](self._reached, b"x")
        is_now = self._count == self._at
        if is_now and self._fault in SIGNALS:
            os.kill(os.getpid(), SIGNALS[self._fault])
        if self.error(name) is not None:
            raise OSError(self.error(name), os.strerror(self.error(name) or 0))
        done = call()
        if is_now and self._fault.endswith(" after"):
            os.kill(os.getpid(), SIGNALS[self._fault.removesuffix(" after")])
        return done

    def error(self, name: str) -> int | None:
        if self._count < self._at:
            return None
        if self._fault == "once" and self._count == self._at:
            return errno.EIO
        if self._fault == "full disk" and name in _GROWING:
            return errno.ENOSPC
        return errno.EROFS if self._fault == "read-only" else None

    def install(self) -> None:
        """Replace what opens and changes files."""
        opened = io.open

        def open_file(file: Any, mode: str = "r", *given: Any, **more: Any) -> Any:  # noqa: ANN401 - as io.open
            if isinstance(file, int) or not set(mode) & set("wax+"):
                return opened(file, mode, *given, **more)
            raw_mode = mode.replace("b", "").replace("t", "")
            raw = self.around("open", lambda: _Raw(file, raw_mode, self))
            buffer = (io.BufferedRandom if "+" in mode else io.BufferedWriter)(raw)
            more.pop("buffering", None)
            return buffer if "b" in mode else io.TextIOWrapper(buffer, *given[1:], **more)

        for name in _CALLS:
            setattr(os, name, self._wrapped(name))
        io.open = builtins.open = open_file

    def _wrapped(self, name: str) -> Callable[..., Any]:
        whole = self.whole[name]

        def call(*given: Any, **more: Any) -> Any:  # noqa: ANN401 - as os has it
            is_reading = name == "open" and not given[1] & (os.O_WRONLY | os.O_RDWR)
            if is_reading or (name == "write" and given[0] < 3):
                return whole(*given, **more)
            return self.around(name, lambda: whole(*given, **more))

        return call


class _Raw(io.FileIO):
    """A file whose writes are calls; on a full disk half of one is done."""

    def __init__(self, file: Any, mode: str, faults: _Faults) -> None:  # noqa: ANN401 - as io.open
        super().__init__(file, mode)
        self._faults = faults

    def write(self, data: Any) -> int:  # noqa: ANN401 - any buffer
        try:
            return int(self._faults.around("write", lambda: super(_Raw, self).write(data)))
        except OSError as error:
            if error.errno == errno.ENOSPC:
                super().write(bytes(data)[: len(bytes(data)) // 2])
            raise


def run(command: Command, folder: Path, *, at: int, fault: str) -> Ended:
    """Return what comes of a command whose ``at``-th call fails."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, content in command.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    said = folder.with_suffix(".said")
    reached, reaching = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of threads: the child has one, and needs no other
        child = os.fork()
    if not child:
        _child(command, folder, said, _Faults(at, fault, reaching))
    os.close(reaching)
    _, status = os.waitpid(child, 0)
    is_reached = bool(os.read(reached, 1))
    os.close(reached)
    files = {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    text = said.read_text(encoding="utf-8", errors="replace")
    return Ended(os.waitstatus_to_exitcode(status), is_reached, text, files)


def _child(command: Command, folder: Path, said: Path, faults: _Faults) -> None:
    code = 99
    try:
        os.chdir(folder)
        output = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for stream in (1, 2):
            os.dup2(output, stream)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - till the end
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False, buffering=1)  # noqa: SIM115
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        command.prepare()
        faults.install()
        code = command.call() if callable(command.call) else main(list(command.call))
        sys.stdout.flush()
    except KeyboardInterrupt:
        code = 130
    except BaseException:  # noqa: BLE001 - reported as what it is
        faults.whole["write"](2, traceback.format_exc().encode())
    finally:
        os._exit(code)


def faults_found(command: Command, whole: Ended, ended: Ended, fault: str) -> list[str]:
    """Return what is wrong with what a fault left behind."""
    old = {name: content for name, content in command.files.items() if name in whole.files}
    found = [
        f"{name}: neither old nor new"
        for name in {**whole.files, **ended.files}
        if not _is_hidden(name) and not _is_whole(command, name, old, whole, ended)
    ]
    for pair in command.pairs:
        states = {_state(name, old, whole, ended) for name in pair}
        if {"old", "new"} <= states:
            found.append(f"{', '.join(pair)}: old and new ones")
        is_torn = "missing" in states or {"absent", "new"} <= states
        if is_torn and fault not in _ENDING:
            found.append(f"{', '.join(pair)}: one is missing")
    kept = {_plain(content) for content in ended.files.values()}
    for name, content in old.items():
        is_new = name in ended.files and ended.files[name] != content
        if not is_new and _plain(content) not in kept:
            found.append(f"{name}: what was there is lost")
    if "Traceback" in ended.said or "bug in mavjoule" in ended.said or ended.code == 99:
        found.append(f"a bug: {ended.said[-300:]}")
    if ended.code == whole.code and not ended.code:
        found += [
            f"{name}: exit 0 and not written"
            for name in whole.files
            if not (_is_hidden(name) or name in command.appends)
            and _state(name, old, whole, ended) not in {"new", "same"}
        ]
    if fault not in {*_ENDING, "once"}:
        found += [f"{name}: left behind" for name in ended.files if ".mavjoule-" in name]
    return found


def _is_hidden(name: str) -> bool:
    return Path(name).name.startswith(".")


def _plain(content: bytes) -> str:
    """Return a content without the times in it."""
    return _TIME.sub("T", content.decode("latin-1"))


def _state(name: str, old: Mapping[str, bytes], whole: Ended, ended: Ended) -> str:
    if name not in ended.files:
        return "missing" if name in old else "absent"
    here = _plain(ended.files[name])
    is_old = name in old and here == _plain(old[name])
    is_new = name in whole.files and here == _plain(whole.files[name])
    if is_old or is_new:
        return "same" if is_old and is_new else "old" if is_old else "new"
    return "half"


def _is_whole(
    command: Command, name: str, old: Mapping[str, bytes], whole: Ended, ended: Ended
) -> bool:
    if name in command.appends:
        here = ended.files.get(name, b"")
        return here.startswith(old.get(name, b"")) and here[-1:] in {b"", b"\n"}
    if name in command.resumes:
        return True
    return _state(name, old, whole, ended) != "half"
