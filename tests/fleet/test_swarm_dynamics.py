"""How agents answer commanded velocities: against `control`, and the article's stops by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_swarm import AT_ONCE, G4

from planner.fleet.swarm.dynamics import Dynamics, DynamicsStack, Motions
from planner.fleet.swarm.zones import capsules_about, distances_m

if TYPE_CHECKING:
    from planner.physics.response import TransferFunction

STEADY_M_S = 9.947018
"""The article's vehicle, commanded 10 m/s: 10 × 0.03569 / 0.3588 m/s."""


def flown(
    dynamics: Dynamics, commands: list[float], tick_s: float
) -> tuple[DynamicsStack, Motions]:
    stack = DynamicsStack([dynamics], tick_s)
    motions = stack.at_rest(np.zeros((1, 2)))
    for command in commands:
        motions = stack.advanced(motions, np.array([[command, 0.0]]))
    return stack, motions


def test_the_place_is_that_of_forced_response() -> None:
    import control

    rng = np.random.default_rng(1)
    commands = rng.uniform(-8.0, 8.0, 40)
    tick_s, fine = 0.25, 50
    _, motions = flown(Dynamics(response=G4), commands.tolist(), tick_s)
    # the reference: the commands later by the delay, even between ticks, through 1/s G
    step_s = tick_s / fine
    time_s = np.arange(len(commands) * fine + 1) * step_s
    which = np.floor((time_s + 1e-9 - G4.delay_s) / tick_s).astype(int)
    late = np.where(which >= 0, commands[np.clip(which, 0, len(commands) - 1)], 0.0)
    system = control.c2d(control.tf([*G4.numerator], [*G4.denominator, 0.0]), step_s, method="zoh")
    _, place_m = control.forced_response(system, time_s, late)
    # `control` samples the double integration every 5 ms to 1e-8
    assert motions.place_m[0, 0] == pytest.approx(place_m[-1], abs=1e-7)
    assert motions.place_m[0, 1] == 0.0


def test_stops_of_the_article_end_and_reach_as_far_as_by_hand() -> None:
    # swarm.md: 3.20591 s and 3.28278 s of the speed
    stack, motions = flown(Dynamics(response=G4), [STEADY_M_S] * 200, 0.25)
    here = motions.place_m[0, 0]
    assert stack.rest_m(motions)[0, 0] - here == pytest.approx(31.889, abs=1e-3)
    way_m = stack.ways_m(motions)[0, :, 0] - here
    # the highest of its samples is below the true one by their spacing
    assert way_m.max() == pytest.approx(32.654, abs=0.05)
    zone = capsules_about(stack.ways_m(motions), stack.velocity_m_s(motions))
    # between its samples it may bend
    assert 32.654 <= zone.end_m[0, 0] - here + zone.radius_m[0] <= 32.654 + 0.05


@pytest.mark.parametrize("response", [G4, AT_ONCE])
def test_who_sets_out_takes_no_room_behind_it_and_who_turns_round_does(
    response: TransferFunction,
) -> None:
    stack, motions = flown(Dynamics(response=response), [], 0.5)
    ways_m = stack.ways_m(motions, np.array([[5.0, 0.0]]), 1)
    zone = capsules_about(ways_m, stack.velocity_m_s(motions))
    assert zone.begin_m[0].tolist() == [0.0, 0.0]
    stack, motions = flown(Dynamics(response=response), [5.0] * 20, 0.5)
    ways_m = stack.ways_m(motions, np.array([[-5.0, 0.0]]), 20)
    zone = capsules_about(ways_m, stack.velocity_m_s(motions))
    assert zone.begin_m[0, 0] > ways_m[0, :, 0].max()


def test_a_command_of_zero_for_a_time_costs_just_that_way_and_time() -> None:
    _, without = flown(Dynamics(response=G4), [STEADY_M_S] * 100, 0.25)
    _, held = flown(
        Dynamics(response=G4), [STEADY_M_S] * 30 + [0.0] * 20 + [STEADY_M_S] * 150, 0.25
    )
    _, longer = flown(Dynamics(response=G4), [STEADY_M_S] * 200, 0.25)
    lost_m = longer.place_m[0, 0] - held.place_m[0, 0]
    assert lost_m == pytest.approx(STEADY_M_S * 20 * 0.25, abs=1e-6)
    assert without.place_m[0, 0] < held.place_m[0, 0]


def test_a_shaped_reference_respects_acceleration_and_jerk_by_hand() -> None:
    """2 m/s² and 2 m/s³ to 6 m/s: a second of jerk, two steady, one back; a stop takes v²/2a + v a/2j."""
    tick_s = 0.25
    dynamics = Dynamics(response=AT_ONCE, acceleration_m_s2=2.0, smoothing_s=1.0)
    stack = DynamicsStack([dynamics], tick_s)
    motions = stack.at_rest(np.zeros((1, 2)))
    for tick in range(1, 25):
        motions = stack.advanced(motions, np.array([[0.0, 6.0]]))
        time_s = tick * tick_s
        by_hand = np.select(
            [time_s <= 1.0, time_s <= 3.0, time_s <= 4.0],
            [time_s**2, 2.0 * time_s - 1.0, 6.0 - (4.0 - time_s) ** 2],
            6.0,
        )
        assert stack.velocity_m_s(motions)[0, 1] == pytest.approx(float(by_hand), abs=1e-9)
    # half of the four seconds is lost
    assert motions.place_m[0, 1] == pytest.approx(6.0 * (24 * tick_s - 2.0), abs=1e-9)
    way_m = stack.ways_m(motions)[0, :, 1] - motions.place_m[0, 1]
    assert way_m[-1] == pytest.approx(6.0**2 / 4.0 + 6.0 * 2.0 / 4.0, abs=1e-9)
    assert way_m.max() <= way_m[-1] + 1e-9
    commands = stack.leading_ahead_m_s(motions, np.array([[0.0, 50.0]]), np.array([6.0]), 60)
    for command in commands:
        motions = stack.advanced(motions, command)
    assert motions.place_m[0, 1] == pytest.approx(24.0 + 12.0 + 50.0, abs=1e-6)


def test_head_on_pairs_are_told_to_stop_as_far_apart_as_by_hand() -> None:
    # swarm.md: both told at once from 75.308 m apart keep 10 m
    stack = DynamicsStack([Dynamics(response=G4)] * 2, 0.25)
    motions = stack.at_rest(np.array([(0.0, 0.0), (75.308, 0.0)]))
    command = np.array([(STEADY_M_S, 0.0), (-STEADY_M_S, 0.0)])
    for _ in range(200):
        motions = stack.advanced(motions, command)
    shift = np.array([(0.0, 0.0), (75.308, 0.0)]) - motions.place_m
    ways = stack.ways_m(motions) + shift[:, None]
    gap_m = ways[1, :, 0].min() - ways[0, :, 0].max()
    assert gap_m == pytest.approx(10.0, abs=0.1)
    rest = ways[:, -1, 0]
    assert rest[1] - rest[0] == pytest.approx(11.528, abs=2e-3)
    zones = capsules_about(ways, stack.velocity_m_s(motions))
    apart_m = distances_m(zones.select(np.array([0])), zones.select(np.array([1])))
    assert 9.9 <= apart_m[0] <= 10.0  # less the bends between samples


@pytest.mark.parametrize(("later_s", "nearer_m"), [(0.5, 5.072), (1.0, 10.141), (2.0, 20.266)])
def test_a_follower_told_later_comes_nearer_by_as_much_as_by_hand(
    later_s: float, nearer_m: float
) -> None:
    """swarm.md, §6: by these at most, in the end by what it flies until it is told."""
    tick_s = 0.05
    stack = DynamicsStack([Dynamics(response=G4)] * 2, tick_s)
    motions = stack.at_rest(np.zeros((2, 2)))
    for _ in range(1000):
        motions = stack.advanced(motions, np.full((2, 2), [STEADY_M_S, 0.0]))
    nearer = []
    for tick in range(800):
        told = np.array([(0.0, 0.0), (STEADY_M_S if tick < later_s / tick_s else 0.0, 0.0)])
        motions = stack.advanced(motions, told)
        nearer.append(motions.place_m[1, 0] - motions.place_m[0, 0])
    assert max(nearer) == pytest.approx(nearer_m, abs=1.5e-3)
    assert nearer[-1] == pytest.approx(STEADY_M_S * later_s, abs=1e-3)


def test_shaped_references_brake_by_their_acceleration() -> None:
    # v² / 2a = 25 m from 10 m/s at 2 m/s²
    stack, motions = flown(Dynamics(response=AT_ONCE, acceleration_m_s2=2.0), [10.0] * 40, 0.25)
    here = motions.place_m[0, 0]
    assert stack.velocity_m_s(motions)[0, 0] == pytest.approx(10.0)
    assert stack.rest_m(motions)[0, 0] - here == pytest.approx(25.0, abs=1e-9)
    assert stack.ways_m(motions)[0, -2, 0] - here == pytest.approx(25.0, abs=1e-9)


def test_even_flight_is_passed_over_exactly() -> None:
    stack, motions = flown(Dynamics(response=G4), [STEADY_M_S] * 20, 0.25)
    command = np.array([[STEADY_M_S, 0.0]])
    assert stack.is_even(motions, command)
    far = stack.advanced_evenly(motions, 16)
    for _ in range(16):
        motions = stack.advanced(motions, command)
    assert np.allclose(far.state, motions.state, rtol=0.0, atol=1e-10)


def test_a_shaped_reference_that_leads_away_is_turned_round_to_its_goal() -> None:
    """At a third of what it can change in a tick it once went to and fro about its goal for ever."""
    stack, motions = flown(Dynamics(response=AT_ONCE, acceleration_m_s2=2.0), [1.0 / 3.0], 0.5)
    goal_m = stack.rest_m(motions) - np.array([[0.2, 0.0]])
    for _ in range(3):
        way_m = goal_m - stack.rest_m(motions)
        motions = stack.advanced(motions, stack.leading_m_s(motions, way_m, np.array([5.0])))
    assert stack.rest_m(motions) == pytest.approx(goal_m, abs=1e-9)
