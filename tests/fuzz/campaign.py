"""Fuzz for a time, and say what was fed: ``make fuzz SECONDS=600``.

The targets take turns; what is found is kept in tests/fuzz/crashers and printed, and what was fed is added
up in the file of ``--record``.  With atheris, where it is installed, ``--coverage`` lets it choose the inputs
of one target.
"""

from __future__ import annotations

import argparse
import gc
import json
import resource
import signal
import sys
import time
import traceback
import warnings
from collections import defaultdict
from hashlib import sha256
from importlib import import_module
from itertools import islice
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, NoReturn

from fuzz.fleets import target as fleets
from fuzz.pipeline import targets as pipelines
from fuzz.readers import targets as readers
from fuzz.relations import relations
from fuzz.target import LONGEST_S, Target, TooSlowError
from fuzz.vehicles import targets as vehicles

if TYPE_CHECKING:
    from collections.abc import Iterator

_FIRST = 50
"""So many inputs of a target's own coverage begins from, beside its seeds."""
_TURN_S = 5.0
"""So much processor time a target has, and at most six times as long, until it is the next one's turn."""
_MOST_MEMORY = 4 << 30
"""Memory [B] that no input may exceed: what it asks for beyond is a finding, not a full computer.  Of
address space the engine that draws charts reserves more."""


def all_targets() -> tuple[Target, ...]:
    """Return every target."""
    return (*readers(), *vehicles(), *pipelines(), relations(), fleets())


def _too_slow(*_: object) -> NoReturn:
    msg = f"still not done after {LONGEST_S:.0f} s"
    raise TooSlowError(msg)


def fuzz(target: Target, inputs: Iterator[bytes], *, seconds: float) -> tuple[int, int, float]:
    """Feed a target for a time; return inputs, findings and processor time [s]."""
    count, found, seen = 0, 0, set[str]()
    began_s, processor_s = time.monotonic(), time.process_time()
    before = signal.signal(signal.SIGVTALRM, _too_slow)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for data in inputs:
            signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_S)
            try:
                target.try_one(data)
            except Exception as error:  # noqa: BLE001 - what it looks for
                last = traceback.extract_tb(error.__traceback__)[-1]
                where = f"{type(error).__name__} {last.filename}:{last.lineno}"
                found += 1
                if where not in seen:
                    seen.add(where)
                    print(f"  {target.name}: {where}: {error!s:.200}\n    {target.keep(data)}")
                    sys.stdout.flush()
            count += 1
            if (
                time.process_time() - processor_s >= seconds
                or time.monotonic() - began_s >= 6.0 * seconds
            ):
                break
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    signal.signal(signal.SIGVTALRM, before)
    return count, found, time.process_time() - processor_s


def campaign(targets: list[Target], *, seconds: float, seed: int, record: Path | None) -> int:
    """Let targets take turns for a time; return how many inputs were findings."""
    fed: dict[str, list[float]] = defaultdict(lambda: [0, 0, 0.0])
    if record is not None and record.exists():
        fed.update(json.loads(record.read_text()))
    ended_s, turn_s = time.monotonic() + seconds, min(_TURN_S, seconds / len(targets))
    inputs = {target.name: target.inputs(seed) for target in targets}
    total = 0
    while time.monotonic() < ended_s:
        for target in targets:
            told = fuzz(target, inputs[target.name], seconds=turn_s)
            fed[target.name] = [sum(pair) for pair in zip(fed[target.name], told, strict=True)]
            total += told[1]
            if record is not None:
                record.write_text(json.dumps(fed))
    print(f"seed {seed}\n{'target':16}{'inputs':>10}{'a second':>10}{'findings':>10}{'hours':>8}")
    for name, (count, found, processor_s) in fed.items():
        rate, hours = count / max(processor_s, 1e-9), processor_s / 3600
        print(f"{name:16}{count:10}{rate:10.0f}{found:10}{hours:8.2f}")
    return total


def _with_coverage(target: Target, arguments: list[str]) -> None:
    """Let atheris choose inputs, until it is interrupted or finds something."""
    atheris = import_module("atheris")  # an option
    for one in gc.get_objects():
        if isinstance(one, FunctionType) and str(one.__module__).startswith("planner."):
            atheris.instrument_func(one)
    for folder in (Path(one) for one in arguments if not one.startswith("-")):
        folder.mkdir(parents=True, exist_ok=True)
        for seed in (*target.seeds, *islice(target.inputs(1), _FIRST)):
            (folder / sha256(seed).hexdigest()[:16]).write_bytes(seed)
    atheris.Setup([sys.argv[0], *arguments], target.try_one)
    atheris.Fuzz()


def main() -> int:
    """Fuzz as asked; return how it ends."""
    known = {target.name: target for target in all_targets()}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="for all targets together")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--target", action="append", choices=known, help="twice: twice as often")
    parser.add_argument("--record", type=Path, help="where inputs, findings and seconds add up")
    parser.add_argument("--coverage", action="store_true", help="by atheris, one target")
    given, further = parser.parse_known_args()
    chosen = [known[name] for name in given.target or known]
    if given.coverage:
        _with_coverage(chosen[0], further)
    resource.setrlimit(resource.RLIMIT_DATA, (_MOST_MEMORY, _MOST_MEMORY))
    found = campaign(chosen, seconds=given.seconds, seed=given.seed, record=given.record)
    return min(found, 1)


if __name__ == "__main__":
    sys.exit(main())
