"""Numbers on the command line that are none."""

from __future__ import annotations

import pytest

from planner.cli.main import main


@pytest.mark.parametrize("number", ["nan", "inf", "NaN"])
@pytest.mark.parametrize(
    "command",
    [
        ["identify", "flight.BIN", "--mass"],
        ["identify", "flight.BIN", "--temperature"],
        ["fetch", "udpin:127.0.0.1:14550", "--heartbeat-timeout"],
        ["simulate", "survey.plan", "--arm-after"],
        ["fleet", "simulate", "fleet.toml", "--until"],
        ["fleet", "simulate", "fleet.toml", "--deadline"],
        ["fleet", "check", "fleet.toml", "--geoid-height"],
        ["fleet", "plan", "fleet.toml", "-o", "planned", "--effort"],
        ["fleet", "plan", "fleet.toml", "-o", "planned", "--time-limit"],
        ["experiment", "-o", "flights", "--home", "48.4"],
    ],
)
def test_a_number_that_is_not_finite_is_refused_by_name(
    command: list[str], number: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command, number]) == 2
    said = capsys.readouterr().err
    option = next(word for word in reversed(command) if word.startswith("--"))
    assert f"'{option}'" in said
    assert "bug" not in said
