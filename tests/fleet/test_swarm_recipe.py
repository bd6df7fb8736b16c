"""The algorithm and the policy of one's own that `mavjoule help swarm` shows fly as it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from made_swarm import formation

from planner.fleet.swarm.simulation import AgentPhase

if TYPE_CHECKING:
    import pytest

    from planner.service.swarm import SwarmResult

TOPIC = Path(__file__).parents[2] / "planner" / "report" / "topics" / "swarm.md"


def test_the_topic_has_an_algorithm_and_a_policy_that_fly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fleet.toml").write_text("schema = 1\n" + formation(40.0), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", TOPIC.read_text(encoding="utf-8"), re.DOTALL)
    [recipe] = [one for one in blocks if "class Relay" in one]
    names: dict[str, Any] = {}
    exec(compile(recipe, str(TOPIC), "exec"), names)
    result: SwarmResult = names["result"]
    assert capsys.readouterr().out.startswith(f"True {result.energy_wh:.1f} Wh")
    record = result.record
    place = np.array((20.0, 80.0))
    reached_s = []
    for row in range(2):
        away_m = np.hypot(*(record.place_m[:, row] - place).T)
        assert away_m.min() < 1.0
        reached_s.append(record.begin_s[away_m.argmin()])
    # the second sets out when the first is home
    first_home_s = record.begin_s[:-1][record.phase[:, 0] == AgentPhase.LANDS][0]
    assert reached_s[0] < first_home_s < reached_s[1]
    speed_m_s = np.hypot(*record.velocity_m_s.T).max()
    commanded_m_s = np.hypot(*record.command_m_s.T).max()
    assert commanded_m_s <= 0.5 * 10.0 + 1e-9  # the article's vehicle is commanded 10 m/s
    assert speed_m_s <= commanded_m_s * 1.05  # and overshoots by 2 %
