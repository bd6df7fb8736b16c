"""Every past finding of the fuzzers is replayed; each target gets a few new inputs, make fuzz gives more."""

from __future__ import annotations

import time
from itertools import islice
from typing import TYPE_CHECKING

import pytest
from fuzz.campaign import all_targets, fuzz
from fuzz.target import CRASHERS, LONGEST_S, Target, TooSlowError

if TYPE_CHECKING:
    from pathlib import Path

TARGETS = {target.name: target for target in all_targets()}
FEW = {
    "pipeline": 4,
    "relations": 4,
    "log": 10,
    "terrain": 20,
    "vehicle": 20,
    "line": 20,
    "upload": 2,
    "guard": 4,
    "fleets": 4,
}
"""Inputs of the slow targets; the others take a millisecond each."""


@pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS)
def test_every_seed_and_past_finding_is_taken_or_refused_with_a_word(target: Target) -> None:
    for data in target.seeds:
        target.try_one(data)
    for path in target.crashers():
        target.try_one(path.read_bytes())


@pytest.mark.parametrize("target", TARGETS.values(), ids=TARGETS)
def test_damaged_inputs_are_taken_or_refused_with_a_word(target: Target) -> None:
    for data in islice(target.inputs(1), FEW.get(target.name, 60)):
        target.try_one(data)


@pytest.mark.parametrize("unit", [b"9", b"\n", b" ", b"[", b'"'], ids=repr)
@pytest.mark.parametrize("name", ["mission", "parameters", "mapping", "typed", "address"])
def test_a_run_of_anything_takes_no_more_than_its_length(name: str, unit: bytes) -> None:
    """A pattern that begins again at each of 20,000 bytes takes some seconds, all of them together 10 ms."""
    target = TARGETS[name]
    for seed in target.seeds[:3]:
        middle = seed.find(b"3") + 1
        began_s = time.process_time()
        target.try_one(seed[:middle] + unit * 20_000 + b"x" + seed[middle:])
        assert time.process_time() - began_s < 1.0


def test_every_folder_of_findings_has_its_target() -> None:
    assert {path.name for path in CRASHERS.iterdir()} <= TARGETS.keys()


def test_the_same_seed_makes_the_same_inputs() -> None:
    for target in TARGETS.values():
        assert list(islice(target.inputs(7), 3)) == list(islice(target.inputs(7), 3))


def test_a_campaign_counts_inputs_and_keeps_findings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(data: bytes) -> None:
        if len(data) % 2:
            message = "odd"
            raise KeyError(message)

    monkeypatch.setattr("fuzz.target.CRASHERS", tmp_path)
    target = Target("made-up", [b"ab"], fail)
    count, found, _ = fuzz(target, target.inputs(1), seconds=0.05)
    assert 0 < found < count
    [kept] = (tmp_path / "made-up").iterdir()
    assert len(kept.read_bytes()) % 2
    assert "KeyError" in capsys.readouterr().out


def test_an_input_that_takes_too_long_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter([0.0, LONGEST_S + 1.0])
    monkeypatch.setattr("fuzz.target.time.process_time", lambda: next(times))
    with pytest.raises(TooSlowError):
        Target("made-up", [b""], lambda _: None).try_one(b"")
