"""The simulation of a swarm, as text, JSON and trace."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.fleet.swarm.simulation import AgentPhase
from planner.report.json import envelope, finding_document, json_text, value, values
from planner.report.text import (
    by_weight,
    closing_line,
    finding_lines,
    note_lines,
    printable,
    table_lines,
)

if TYPE_CHECKING:
    from planner.report.json import Document
    from planner.report.text import Medium
    from planner.service.swarm import SwarmAgent, SwarmResult

_SHOWN = 5
"""Closest approaches in the text. [-]"""
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
)
_OF_APPROACH = ("first", "second", "distance_m", "time_s")


def swarm_text(result: SwarmResult, *, medium: Medium) -> str:
    """Return the report of a simulation: whether it is clear first, then what each agent did."""
    cut = "  (cut short)" if result.is_cut_short else ""
    agents = quantity.count(len(result.agents), "agent")
    lines = [
        f"{'CLEAR' if result.is_clear else 'NOT CLEAR'}  {printable(result.file)}{cut}",
        "",
        f"  Swarm       {agents}: {result.algorithm}, avoidance {result.policy}, seed {result.seed}",
        f"  Makespan    {quantity.duration(result.makespan_s)}",
        f"  Energy      {quantity.energy(result.energy_wh)}",
        "",
    ]
    heads = ("agent", "in the air", "distance", "energy", "stops", "waited", "")
    lines += table_lines([heads, *map(_row, result.agents)], alignment="<>>>>><")
    nearest = result.distances.nearest[:_SHOWN]
    if nearest:
        lines += ["", f"Closest; {quantity.distance(result.separation_m)} required:"]
        rows = [
            (
                f"{one.first} and {one.second}",
                quantity.distance(one.distance_m),
                quantity.duration(one.time_s),
            )
            for one in nearest
        ]
        lines += table_lines(rows, alignment="<>>")
    problems, notes = by_weight(result.findings)
    lines.append("")
    for finding in problems:
        lines += finding_lines(finding, file=result.file, medium=medium)
    for finding in notes:
        lines += note_lines(finding, medium=medium)
    lines += ["", closing_line(result.findings, suppressed=())]
    return "\n".join(lines) + "\n"


def _row(one: SwarmAgent) -> tuple[str, ...]:
    return (
        one.name,
        quantity.duration(one.time_s),
        quantity.distance(one.distance_m),
        quantity.energy(one.energy_wh),
        str(one.stops),
        quantity.duration(one.waited_s),
        "" if one.has_landed else "not landed",
    )


def swarm_json(result: SwarmResult, *, version: str) -> str:
    """Return a simulation as a JSON document, without its steps."""
    document: Document = envelope(version) | {
        "file": value(result, "file"),
        "is_clear": result.is_clear,
        "algorithm": result.algorithm,
        "policy": result.policy,
        "seed": result.seed,
        "is_cut_short": result.is_cut_short,
        "separation_m": result.separation_m,
        "totals": values(result, ("energy_wh", "makespan_s")),
        "agents": [
            values(one, _OF_AGENT)
            | {"margin_wh": None if one.battery is None else one.battery.margin_wh}
            for one in result.agents
        ],
        "approaches": [values(one, _OF_APPROACH) for one in result.distances.nearest],
        "findings": [finding_document(one) for one in result.findings],
    }
    return json_text(document, indent=2)


def swarm_trace_csv(result: SwarmResult) -> str:
    """Return every step of every agent as rows of CSV: its place at the beginning of the step."""
    record = result.record
    latitude, longitude = result.frame.latitude_longitude_deg(
        record.place_m[:-1, :, 0], record.place_m[:-1, :, 1]
    )
    speed = np.hypot(record.velocity_m_s[:-1, :, 0], record.velocity_m_s[:-1, :, 1])
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ("time_s", "agent", "phase", "latitude_deg", "longitude_deg", "ground_speed_m_s", "waits")
    )
    for step, begin_s in enumerate(record.begin_s[:-1].tolist()):
        for row, agent in enumerate(result.agents):
            writer.writerow(
                (
                    f"{begin_s:.3f}",
                    agent.name,
                    AgentPhase(record.phase[step, row]).name.lower(),
                    f"{latitude[step, row]:.8f}",
                    f"{longitude[step, row]:.8f}",
                    f"{speed[step, row]:.3f}",
                    int(record.waits[step, row]),
                )
            )
    return text.getvalue()
