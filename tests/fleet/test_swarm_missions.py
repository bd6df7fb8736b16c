"""The sorties of a fleet simulated as filed: the flights of their checks, and who gives way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import checked, pad, place, sortie, up, vehicles
from made_missions import mission, rtl
from made_swarm import simulated

from planner.errors import UsageError
from planner.service.fleet_separation import members

if TYPE_CHECKING:
    from planner.mission.items import Mission

SEPARATION = "[separation]\nhorizontal_m = 10\n"
STEP, ARDUPILOT, PX4 = "falkowski-2023-quadrotor", "arducopter-sitl-quad", "px4-sih-quad"
TO_NORTH = mission(up(50), place(300, 0, 50), rtl())
TO_EAST = mission(up(50), place(150, 150, 50), rtl())
"""From 150 m north and west: east across the track of the other, at its middle."""


def crossing(one: str = STEP, two: str = STEP, *, later_s: float = 0.0) -> tuple[str, ...]:
    """Two whose tracks cross."""
    return (
        SEPARATION + pad("a", 0, 0) + pad("b", 150, -150),
        vehicles("a", model=one) + vehicles("b", model=two),
        sortie("s1", "a", 0.0, job="to_north") + sortie("s2", "b", later_s, job="to_east"),
    )


MISSIONS: dict[str, Mission] = {"to_north": TO_NORTH, "to_east": TO_EAST}


@pytest.mark.parametrize("models", [(STEP, STEP), (PX4, ARDUPILOT)])
def test_without_avoidance_each_flies_as_its_check_says(models: tuple[str, str]) -> None:
    tables = crossing(*models, later_s=3.5)
    flown = simulated(*tables, policy="none", **MISSIONS)
    check = checked(*tables, **MISSIONS)
    for agent, one in zip(flown.agents, check.sorties, strict=True):
        assert agent.name == one.name
        assert agent.start_s == one.start_s
        assert agent.time_s == pytest.approx(one.time_s, abs=1e-6)
        # the model of the PX4 has no power
        assert (agent.energy_wh or 0.0) == pytest.approx(one.energy_wh or 0.0, rel=1e-9)
        assert agent.has_landed


def test_without_avoidance_they_meet_where_the_check_of_the_fleet_says() -> None:
    tables = crossing()
    flown = simulated(*tables, policy="none", **MISSIONS)
    check = checked(*tables, **MISSIONS)
    said = [one for one in check.findings if one.finding.code == "S101"]
    assert len(said) == 1
    (near,) = flown.distances.nearest
    assert {near.first, near.second} == set(said[0].sorties)
    assert near.time_s == pytest.approx(said[0].at_s, abs=0.01)
    # By places every millisecond about then, of the flights themselves.
    separation = check.fleet.separation
    assert separation is not None
    one, two = (each.trajectory for each in members(check.fleet, separation, check.sorties))
    at_s = near.time_s + np.linspace(-2.0, 2.0, 4001)
    apart_m = np.hypot(*(one.place_m(at_s) - two.place_m(at_s))[:, :2].T)
    assert near.time_s == pytest.approx(at_s[apart_m.argmin()], abs=0.01)
    assert near.distance_m == pytest.approx(apart_m.min(), abs=0.02)
    assert [one.code for one in flown.findings if one.code == "S128"] == ["S128"]


def test_the_trace_of_missions_has_their_heights() -> None:
    record = simulated(*crossing(), policy="none", **MISSIONS).record
    assert record.height_m is not None
    assert record.height_m.max() == pytest.approx(50.0, rel=0.01)  # G1 overshoots by 0.9 %
    assert record.height_m[0] == pytest.approx([0.0, 0.0])


def test_missions_as_filed_are_not_left_for_reciprocal_velocities() -> None:
    with pytest.raises(UsageError, match="which orca-stop leaves"):
        simulated(*crossing(), policy="orca-stop", **MISSIONS)


def test_a_fleet_without_sorties_has_nothing_to_simulate() -> None:
    with pytest.raises(UsageError, match="no sortie"):
        simulated(*crossing()[:2], policy="none", **MISSIONS)
