"""The simulation of a swarm, as text, JSON and trace."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.fleet.fleet import SwarmAlgorithm
from planner.fleet.swarm.simulation import AgentPhase
from planner.report.json import envelope, found_document, json_text, value, values
from planner.report.text import (
    by_weight,
    caveat_of,
    closing_line,
    finding_lines,
    given_texts,
    note_lines,
    printable,
    table_lines,
)
from planner.service.fleet_timeline import energy_by_time
from planner.service.swarm import GOAL_FRACTIONS
from planner.service.swarm_agents import AgentsRow, Statistic, SwarmRun
from planner.service.swarm_faults import fault_text
from planner.service.swarm_timeline import swarm_timeline
from planner.setup import basis_text
from planner.values import field_names, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.fleet.swarm.distances import Approach
    from planner.report.json import Document
    from planner.report.text import Medium
    from planner.service.fleet_timeline import FleetTimeline
    from planner.service.swarm import SwarmAgent, SwarmResult
    from planner.service.swarm_agents import SwarmNumbers
    from planner.service.swarm_faults import FaultOutcome, SwarmFaultReport

_SHOWN = 5
"""Closest approaches in the text. [-]"""
_SHOWN_M = 0.05
"""Less above each other is one height. [m]"""
_OF_AGENT = (
    "name",
    "vehicle",
    "start_s",
    "time_s",
    "distance_m",
    "stops",
    "waited_s",
    "energy_wh",
    "energy_by_state_wh",
    "has_landed",
    "turned_back_s",
    "charge_left",
)
_OF_BATTERY = ("capacity_wh", "usable_wh", "used_fraction", "reserve_fraction", "margin_wh")
_OF_FAULT = ("kind", "vehicle", "at_s", "lasts_s")
_OF_APPROACH = ("first", "second", "distance_m", "time_s", "above_m")
_OF_GROUP = ("energy_wh", "makespan_s", "distance_m", "stops", "waited_s", "energy_by_state_wh")
_FLIES = (AgentPhase.CLIMBS, AgentPhase.FLIES, AgentPhase.LANDS)
_OF_RUN = (
    "agents",
    "seed",
    "goal",
    "is_clear",
    *(one for one in field_names(SwarmRun)[3:] if one not in {"unclear", "findings", "suppressed"}),
)


def swarm_text(result: SwarmResult, *, medium: Medium) -> str:
    """Return the report of a simulation: whether it is clear first, then what each agent did."""
    cut = "  (cut short)" if result.is_cut_short else ""
    hidden = caveat_of(result.suppressed)
    stops = quantity.count(result.stops, "stop for others", "stops for others")
    waited = quantity.duration(result.waited_s)
    lines = [
        f"{'CLEAR' if result.is_clear else 'NOT CLEAR'}  {printable(result.file)}{hidden}{cut}",
        *(line for given in swarm_given_texts(result) for line in medium.wrapped(given, indent=4)),
        "",
        f"  Swarm       {swarm_headline(result)}",
        f"  Makespan    {quantity.duration(result.makespan_s)}; {stops}, {waited} of waiting",
        f"  Energy      {quantity.energy(result.energy_wh)}",
        *medium.wrapped(f"  By state    {states_text(result.energy_by_state_wh)}", indent=14),
        f"  Goal        {goal_text(result)}",
        "",
    ]
    heads = ("agent", "in the air", "distance", "energy", "left", "stops", "waited", "closest", "")
    rows = [_row(result, one) for one in result.agents]
    lines += table_lines([heads, *rows], alignment="<>>>>>>><")
    nearest = result.distances.nearest[:_SHOWN]
    if nearest:
        lines += ["", f"Closest; {quantity.distance(result.separation_m)} required:"]
        rows = [
            (f"{one.first} and {one.second}", _apart_text(one), quantity.duration(one.time_s))
            for one in nearest
        ]
        lines += table_lines(rows, alignment="<>>")
    if result.faults is not None:
        lines += ["", *fault_lines(result.faults)]
    return "\n".join([*lines, *_found_lines(result, medium=medium)]) + "\n"


def _found_lines(result: SwarmResult | SwarmNumbers, *, medium: Medium) -> list[str]:
    """Return what was found: problems, then assumptions, then how many there are."""
    problems, notes = by_weight(result.findings)
    lines = [""]
    for finding in problems:
        lines += finding_lines(finding, file=result.file, medium=medium)
    for finding in notes:
        lines += note_lines(finding, medium=medium)
    return [*lines, "", closing_line(result.findings, suppressed=result.suppressed)]


def _apart_text(near: Approach) -> str:
    if near.above_m < _SHOWN_M:
        return quantity.distance(near.distance_m)
    return f"{quantity.distance(near.beside_m)} beside, {quantity.height(near.above_m)} above"


def swarm_given_texts(result: SwarmResult) -> tuple[str, ...]:
    """Return what flew: vehicle, full battery and wind, of which agents where they differ."""
    fleet = result.fleet
    given = []
    for one in result.agents:
        name = fleet.sorties[one.name].vehicle if one.name in fleet.sorties else one.name
        setup = replace(fleet.vehicles[name].setup, charge=1.0)
        capacity_wh = None if one.battery is None else one.battery.capacity_wh
        given.append((one.name, basis_text(setup, capacity_wh=capacity_wh)))
    return given_texts(given)


def swarm_headline(result: SwarmResult) -> str:
    """Return what was simulated, in a line."""
    agents = quantity.count(len(result.agents), "agent")
    vehicles = len({one.vehicle for one in result.fleet.sorties.values()})
    if result.algorithm == SwarmAlgorithm.MISSIONS and vehicles < len(result.agents):
        sorties = quantity.count(len(result.agents), "sortie", "sorties")
        agents = f"{sorties} on {quantity.count(vehicles, 'vehicle')}"
    return f"{agents}: {result.algorithm}, avoidance {result.policy}, seed {result.seed}"


def fault_lines(faults: SwarmFaultReport) -> list[str]:
    """Return what faults led to, and whether everyone else is still safe, a line each."""
    rows = [(one.name, fault_text(one.fault), outcome_text(one)) for one in faults.outcomes]
    return ["Faults:", *table_lines(rows, alignment="<<<"), f"Everyone else: {others_text(faults)}"]


def outcome_text(outcome: FaultOutcome) -> str:
    """Return what one fault led to, in a line."""
    if not outcome.agents:
        return "not tried"
    hits = quantity.count(len(outcome.hits), "pair too near", "pairs too near")
    found = [hits] * bool(outcome.hits)
    found += [f"{name} {why}" for name, why in outcome.lost.items()]
    found += [f"{name} lands below its reserve" for name in outcome.below_reserve]
    return "; ".join(found) or "survived"


def others_text(faults: SwarmFaultReport) -> str:
    """Return whether everyone without a fault of its own is safe."""
    if not faults.others:
        return "there is nobody"
    agents = quantity.count(len(faults.others), "agent")
    return f"{agents}, {'safe' if faults.are_others_safe else 'NOT SAFE'}"


def states_text(energy_by_state_wh: Mapping[str, float]) -> str:
    """Return energies by flight state, in a line."""
    return (
        ", ".join(
            f"{state} {quantity.energy(energy_wh)}"
            for state, energy_wh in energy_by_state_wh.items()
        )
        or quantity.ABSENT
    )


def reached_text(fraction: float) -> str:
    """Return how much of a goal is reached: nothing that is missing is rounded away."""
    return quantity.beside(fraction, 1.0, quantity.percent)


def goal_text(result: SwarmResult) -> str:
    """Return how much of the goal is reached, and when parts of it were."""
    goal = result.goal
    times = [
        f"{quantity.percent(fraction)} after {quantity.duration(time_s)}"
        for fraction in GOAL_FRACTIONS
        for time_s in [goal.time_to_s(fraction)]
        if time_s is not None
    ]
    reached = reached_text(goal.fraction)
    return f"{reached} of the {goal.what}; {', '.join(times) or 'never half of it'}"


def _row(result: SwarmResult, one: SwarmAgent) -> tuple[str, ...]:
    near = result.closest(one.name)
    return (
        one.name,
        quantity.duration(one.time_s),
        quantity.distance(one.distance_m),
        quantity.energy(one.energy_wh),
        quantity.charge_left(one.charge_left),
        str(one.stops),
        quantity.duration(one.waited_s),
        quantity.ABSENT if near is None else quantity.distance(near.distance_m),
        agent_end(one),
    )


def agent_end(one: SwarmAgent) -> str:
    """Return what is to be said of how the flight of an agent ended, if anything."""
    if one.flight is None:
        return "not taken off"
    if not one.has_landed:
        return "in the air"
    if one.turned_back_s is None:
        return ""
    return f"home early for its battery, from {quantity.clock(one.turned_back_s)} on"


def swarm_json(result: SwarmResult, *, version: str) -> str:
    """Return a simulation as a JSON document."""
    document = swarm_document(result, swarm_timeline(result), version=version)
    return json_text(document, indent=2)


def swarm_document(result: SwarmResult, timeline: FleetTimeline, *, version: str) -> Document:
    """Return a simulation by the keys of its JSON document."""
    goal = result.goal
    return envelope(version) | {
        "file": result.file,
        "is_clear": result.is_clear,
        "algorithm": result.algorithm,
        "policy": result.policy,
        "seed": result.seed,
        "is_cut_short": result.is_cut_short,
        "separation_m": result.separation_m,
        "totals": values(result, _OF_GROUP),
        "goal": {
            "what": goal.what,
            "fraction": goal.fraction,
            **{
                f"time_to_{one:.0%}_s".replace("%", ""): goal.time_to_s(one)
                for one in GOAL_FRACTIONS
            },
            "cell_m": value(result.coverage, "cell_m"),
            "sensor_radius_m": None if result.coverage is None else result.coverage.area.radius_m,
        },
        "agents": [
            values(one, _OF_AGENT)
            | {
                "margin_wh": value(one.battery, "margin_wh"),
                "battery": values(one.battery, _OF_BATTERY),
                "gusts_wh": one.gusts_wh,
                "closest": values(result.closest(one.name), _OF_APPROACH),
            }
            for one in result.agents
        ],
        "approaches": [values(one, _OF_APPROACH) for one in result.distances.nearest],
        "over_time": {
            "time_s": timeline.edge_s.tolist(),
            "power_w": [*timeline.power_w.tolist(), 0.0],
            "energy_wh": timeline.used_wh.tolist(),
            "goal_fraction": goal.fraction_at(timeline.edge_s).tolist(),
        },
        "pairs": [
            values(one, ("first", "second", "least_m", "least_s"))
            | {"time_s": one.time_s.tolist(), "distance_m": one.planned_m.tolist()}
            for one in timeline.pairs
        ],
        "faults": None if result.faults is None else _fault_document(result.faults),
        **found_document(result.findings, result.suppressed),
    }


def _fault_document(faults: SwarmFaultReport) -> Document:
    return {
        "others": [*faults.others],
        "are_others_safe": faults.are_others_safe if faults.others else None,
        "outcomes": [
            {
                "name": one.name,
                **values(one.fault, _OF_FAULT),
                "agents": [*one.agents],
                "hits": [values(near, _OF_APPROACH) for near in one.hits],
                "lost": [{"agent": name, "why": why} for name, why in one.lost.items()],
                "below_reserve": [*one.below_reserve],
            }
            for one in faults.outcomes
        ],
    }


def numbers_text(numbers: SwarmNumbers, *, medium: Medium) -> str:
    """Return what numbers of agents take: the one to choose first, then a row of each."""
    has_spans = numbers.seeds > 1
    span = ["p10 to p90"] * has_spans
    heads = (
        "agents",
        "clear",
        "energy",
        *span,
        "makespan",
        *span,
        *(f"{quantity.percent(one)} of the goal" for one in GOAL_FRACTIONS),
        "waited",
        "",
    )
    rows = [
        (
            str(row.agents),
            f"{row.clear} of {row.runs}",
            quantity.energy(_finite(row.energy_wh.mean)),
            *[_span(row.energy_wh, quantity.energy)] * has_spans,
            quantity.duration(_finite(row.makespan_s.mean)),
            *[_span(row.makespan_s, quantity.duration)] * has_spans,
            *(
                quantity.duration(_finite(one.mean))
                for one in (row.time_to_50_s, row.time_to_90_s, row.time_to_100_s)
            ),
            quantity.duration(row.waited_s.mean),
            marks_text(numbers, row),
        )
        for row in numbers.rows
    ]
    lines = [
        numbers_headline(numbers),
        "",
        *table_lines([heads, *rows], alignment=">" * (len(heads) - 1) + "<"),
        "",
        *medium.wrapped(numbers_note(numbers)),
    ]
    if numbers.is_cut_short:
        lines += [NUMBERS_CUT_SHORT]
    return "\n".join([*lines, *_found_lines(numbers, medium=medium)]) + "\n"


def marks_text(numbers: SwarmNumbers, row: AgentsRow) -> str:
    """Return what there is to be said of a row, and what makes it not clear."""
    return ", ".join((*numbers.marks(row), *numbers.unclear(row)))


NUMBERS_CUT_SHORT = (
    "Cut short: runs are missing, and the last number may have fewer than the others."
)


def numbers_headline(numbers: SwarmNumbers) -> str:
    """Return the numbers of agents to choose, in a line."""
    found = []
    if numbers.fewest_in_time is not None:
        agents = quantity.count(numbers.fewest_in_time.agents, "agent")
        found.append(f"Fewest home by {quantity.clock(numbers.deadline_s)}: {agents}")
    if numbers.least_energy is not None:
        row = numbers.least_energy
        energy = quantity.energy(row.energy_wh.mean)
        found.append(f"least energy: {quantity.count(row.agents, 'agent')}, {energy}")
    text = "; ".join(found)
    none = f"{'cut short: ' if numbers.is_cut_short else ''}no number of agents to choose"
    text = text or none
    return text[:1].upper() + text[1:]


def numbers_note(numbers: SwarmNumbers) -> str:
    """Return what the figures of numbers of agents mean."""
    runs = quantity.count(numbers.seeds, "run")
    of = f"Means of {runs} by seed" if numbers.seeds > 1 else "One run each, as nothing is drawn"
    return (
        f"{of}: {numbers.algorithm}, avoidance {numbers.policy}. The goal is the {numbers.goal}. A number is "
        "chosen only where every run is clear; a figure is missing where a run never got there."
    )


def _finite(figure: float) -> float | None:
    return figure if math.isfinite(figure) else None


def _span(figure: Statistic, shown: Callable[[float | None], str]) -> str:
    """Return what eight of ten runs lie between."""
    return f"{shown(_finite(figure.p10))} to {shown(_finite(figure.p90))}"


def numbers_json(numbers: SwarmNumbers, *, version: str) -> str:
    """Return what numbers of agents take as a JSON document."""
    return json_text(numbers_document(numbers, version=version), indent=2)


def numbers_document(numbers: SwarmNumbers, *, version: str) -> Document:
    """Return what numbers of agents take by the keys of the JSON document."""
    return envelope(version) | {
        **values(
            numbers, ("file", "algorithm", "policy", "goal", "seeds", "deadline_s", "reach_percent")
        ),
        "is_cut_short": numbers.is_cut_short,
        "least_energy_agents": value(numbers.least_energy, "agents"),
        "fewest_in_time_agents": value(numbers.fewest_in_time, "agents"),
        "rows": [
            values(row, ("agents", "runs", "clear"))
            | {
                f"{key}_{name}": value(getattr(row, key), name)
                for key in field_names(AgentsRow)[3:]
                for name in field_names(Statistic)
            }
            | {"marks": [*numbers.marks(row)]}
            for row in numbers.rows
        ],
        "runs": [values(one, _OF_RUN) | {"unclear": [*one.unclear]} for one in numbers.runs],
        **found_document(numbers.findings, numbers.suppressed),
    }


def swarm_trace(result: SwarmResult) -> dict[str, Sequence[object]]:
    """Return every step of every agent as columns: what is true at its beginning, and at the end of the last.

    ``least_distance_m`` is between any two agents in the air during the step, as far as it is within five
    separations; ``goal_fraction`` is of the whole swarm.  Places are where agents are: ``displaced_m`` from
    where they report to be.
    """
    record, agents = result.record, result.agents
    begin_s, count = record.begin_s, len(result.agents)
    phase = np.vstack(
        (record.phase, np.where(record.has_landed, AgentPhase.LANDED, record.phase[-1]))
    )
    latitude_deg, longitude_deg = result.frame.latitude_longitude_deg(
        record.place_m[..., 0], record.place_m[..., 1]
    )
    height_m, power_w, energy_wh = np.full((3, len(begin_s), count), np.nan)
    for row, one in enumerate(agents):
        if one.flight is None:
            continue
        own_s = np.clip(begin_s - one.start_s, 0.0, one.time_s)
        height_m[:, row] = one.flight.motion.state_at_time(own_s).height_m
        if one.energy_wh is not None:
            flies = np.isin(phase[:, row], _FLIES)
            power_w[:, row] = np.where(flies, one.flight.power_w(own_s), 0.0)
            energy_wh[:, row] = np.interp(own_s, *energy_by_time(one.flight))
    speed_m_s = np.hypot(record.velocity_m_s[..., 0], record.velocity_m_s[..., 1])
    displaced_m = np.hypot(
        *np.moveaxis(np.broadcast_to(record.carried_m, record.place_m.shape), -1, 0)
    )
    steps: dict[str, Sequence[object]] = {
        "time_s": np.repeat(np.round(begin_s, 3), count).tolist(),
        "agent": [one.name for one in agents] * len(begin_s),
        "phase": [AgentPhase(one).name.lower() for one in phase.ravel().tolist()],
        "waits": [*record.waits.ravel().tolist(), *[False] * count],
    }
    for name, column, digits in (
        ("latitude_deg", latitude_deg, 8),
        ("longitude_deg", longitude_deg, 8),
        ("height_above_home_m", height_m, 3),
        ("ground_speed_m_s", speed_m_s, 3),
        ("displaced_m", displaced_m, 3),
        ("power_w", power_w, 3),
        ("energy_wh", energy_wh, 4),
        ("least_distance_m", np.repeat(np.append(result.distances.least_m, np.nan), count), 3),
        ("goal_fraction", np.repeat(result.goal.fraction_at(begin_s), count), 5),
    ):
        steps[name] = np.round(column, digits).ravel().tolist()
    return steps
