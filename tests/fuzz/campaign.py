"""Fuzz for a time, and say what was fed: ``make fuzz SECONDS=600``.

Each target gets its part of the time; what is found is kept in tests/fuzz/crashers and printed.  With
atheris, where it is installed, ``--coverage`` lets it choose the inputs of one target.
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
import warnings
from typing import TYPE_CHECKING

from fuzz.pipeline import pipeline
from fuzz.readers import targets as readers
from fuzz.vehicles import targets as vehicles

if TYPE_CHECKING:
    from fuzz.target import Target


def all_targets() -> tuple[Target, ...]:
    """Return every target."""
    return (*readers(), *vehicles(), pipeline())


def fuzz(target: Target, *, seconds: float, seed: int) -> tuple[int, int, float]:
    """Feed a target for a time; return inputs, findings and processor time [s]."""
    count, found, seen = 0, 0, set[str]()
    began_s, processor_s = time.monotonic(), time.process_time()
    for data in target.inputs(seed):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                target.try_one(data)
        except Exception as error:  # noqa: BLE001 - what it looks for
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{type(error).__name__} {last.filename}:{last.lineno}"
            found += 1
            if where not in seen:
                seen.add(where)
                print(
                    f"  {target.name}: {where}: {error!s:.200}\n    {target.keep(data)}", flush=True
                )
        count += 1
        if time.monotonic() - began_s >= seconds:
            break
    return count, found, time.process_time() - processor_s


def _with_coverage(target: Target) -> None:
    """Let atheris choose inputs, until it is interrupted or finds something."""
    from importlib import import_module

    atheris = import_module("atheris")  # an option

    atheris.instrument_all()
    atheris.Setup(sys.argv[:1], target.try_one)
    atheris.Fuzz()


def main() -> int:
    """Fuzz as asked; return how it ends."""
    known = {target.name: target for target in all_targets()}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="for all targets together")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--target", action="append", choices=known)
    parser.add_argument("--coverage", action="store_true", help="by atheris, one target")
    given = parser.parse_args()
    chosen = [known[name] for name in given.target or known]
    if given.coverage:
        _with_coverage(chosen[0])
    total = 0
    print(f"seed {given.seed}\n{'target':16}{'inputs':>10}{'a second':>10}{'findings':>10}")
    for target in chosen:
        count, found, processor_s = fuzz(
            target, seconds=given.seconds / len(chosen), seed=given.seed
        )
        total += found
        rate = count / max(processor_s, 1e-9)
        print(f"{target.name:16}{count:10}{rate:10.0f}{found:10}", flush=True)
    return min(total, 1)


if __name__ == "__main__":
    sys.exit(main())
