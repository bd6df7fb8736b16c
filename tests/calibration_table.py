"""How often recorded flights lie between p10 and p90, family by family; not in the gate.

Run as ``make calibration FLIGHTS=folder``: writes the table in ``models/README.md``.  Each flight is
predicted from its mission, parameters and wind alone.  Its intervals come once from the spread of the
model as it stands, and once from the errors of the other flights of its family, each left out in turn.
"""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from readme_table import write_table

import planner
from planner.autopilot import Autopilot
from planner.cli.main import main as command_line
from planner.flight.uncertainty import HIGH, LOW, kind_of, spread_at_noise
from planner.identify.calibration import OF_FLIGHTS, Calibration, calibrate
from planner.identify.spread import FlownAndPredicted
from planner.vehicle.parameters.files import read_parameters
from planner.vehicle.repeatability import REPEATABILITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.flight.motion.kinematics import FlightState
    from planner.identify.calibration import FlightInterval
    from planner.vehicle.model import VehicleModel

NO_NOISE = "PX4, no noise"
_AT_ONCE_S = 0.1
"""Items are noted as done within that of when they are. [s]"""
MIXED = ("px4-[A-FN]*", "px4-N_*")
"""Folders of flights with and without noise; those without end in _quiet."""
_ROUNDING = 1e-9
HEADING_DEG = 0.0
"""Which PX4's simulator arms with, as the logs of its flights show.  [deg]"""
_DRAG_LOGS = ("c1_rtl_alt60", "f1_vertical_fast", "g3_uturns", "h1_survey8")
FAMILIES = (
    # what, folders, model or the logs it is identified from, and how
    ("ArduPilot, survey quad", "ardupilot-S_*", "arducopter-sitl-quad", ()),
    (
        "ArduPilot, stock quad",
        "ardupilot-[NQR]_*",
        ("ardupilot-Q_B_horizontal", "ardupilot-N_ident_horizontal", "ardupilot-N_ident_vertical"),
        ("--mass", "3"),
    ),
    ("PX4, noisy position", "px4-[A-FN]*", "px4-sih-quad", ()),
    (NO_NOISE, "px4-N_*", "px4-sih-quad", ()),
    (
        "PX4, drag",
        "px4-drag_*",
        tuple(f"px4-drag_{name}_quiet" for name in _DRAG_LOGS),
        ("--mass", "1", "--position-noise", "0"),
    ),
    ("DJI Matrice 100", "real/matrice-100-missions/*", "dji-matrice-100", ()),
)


def flight_of(folder: Path, vehicle: VehicleModel) -> FlownAndPredicted:
    """Return a recorded flight and its prediction, cut where its items were done."""
    flown = json.loads((folder / "flown.json").read_text(encoding="utf-8"))
    wind = flown["wind"]
    file = next(folder.glob("vehicle.param*"), None)
    result = planner.check(
        planner.read_mission(folder / "mission.plan"),
        vehicle,
        parameters=None if file is None else read_parameters(file),
        wind=planner.Wind(speed_m_s=wind["speed_m_s"], from_deg=wind["from_deg"]),
        home_amsl_m=flown["home"]["amsl_m"],
        position_noise_m=0.0 if folder.name.endswith("_quiet") else None,
        payload_kg=flown.get("payload_kg") or 0.0,
        heading_deg=HEADING_DEG,
    )
    done_s = {one.item: one.left_s for one in result.items if one.left_s is not None}
    cuts = [(0.0, 0.0)]
    for item in flown.get("items", ())[:-1]:
        at_s, expected_s = item["done_s"], done_s.get(item["item"], 0.0)
        if at_s > cuts[-1][0] and expected_s > cuts[-1][1]:
            cuts.append((at_s, expected_s))
    cuts.append((flown["time_s"], result.totals.time_s))
    parts = [(end[0] - start[0], end[1] - start[1]) for start, end in pairwise(cuts)]
    predicted_j: dict[FlightState, float] = defaultdict(float)
    if flown["energy_wh"] and vehicle.is_power_known:
        for segment in result.segments:
            predicted_j[kind_of(segment.state)] += 3600.0 * segment.energy_wh
    whole = flown["energy_wh"] / result.totals.energy_wh if predicted_j else 1.0
    return FlownAndPredicted(
        legs_s=parts[:-1],
        # what ends with its last item, done as it ends, has no part after it
        landing_s=parts[-1] if parts[-1][1] > 0.0 and parts[-1][0] > _AT_ONCE_S else None,
        flown_energy_j={kind: whole * energy_j for kind, energy_j in predicted_j.items()},
        predicted_energy_j=predicted_j,
        wind_speed_m_s=wind["speed_m_s"],
    )


def vehicle_of(model: str | tuple[str, ...], how: tuple[str, ...], flights: Path) -> VehicleModel:
    """Return a shipped model, or one identified from logs."""
    if isinstance(model, str):
        return planner.load_vehicle(model)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "identified.toml"
        logs = [next((flights / name).glob("flight.*")) for name in model]
        if command_line(["identify", *map(str, logs), "-o", str(path), *how]):
            sys.exit(f"no model of {', '.join(model)}")
        return planner.load_vehicle(path)


def cells(rows: Sequence[Calibration]) -> list[str]:
    """Return coverage and sharpness of time and energy."""
    of = {row.of: row for row in rows}
    return [
        f"{of[name].inside} of {of[name].count}, {_percent(of[name].half_width)} for "
        f"{_percent(of[name].median_error)}"
        if name in of
        else "—"
        for name in OF_FLIGHTS
    ]


def narrowest(rows: Sequence[Calibration]) -> str:
    """Return how narrow one width can be that holds at least 80 % of these very errors."""
    bounds = []
    for row in rows:
        if row.of in OF_FLIGHTS:
            errors = sorted(abs(one.error) for one in row.intervals)
            holds = math.ceil((HIGH - LOW) * len(errors) - _ROUNDING)
            bounds.append(f"{holds}: {_percent(errors[holds - 1])}")
    return ", ".join(bounds)


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.2f} %"


def together(groups: Sequence[Sequence[Calibration]]) -> list[Calibration]:
    """Return the intervals of several families by their quantity."""
    intervals: dict[str, list[FlightInterval]] = defaultdict(list)
    for rows in groups:
        for row in rows:
            intervals[row.of] += row.intervals
    return [Calibration(of=of, intervals=tuple(found)) for of, found in intervals.items()]


def main(folder: str) -> None:
    """Write the table into the README of the models, and to standard output."""
    flights = Path(folder)
    lines = [
        (
            "| family | time, its own spread | energy, its own spread | time, the others "
            "| energy, the others | 80 % of the errors: time, energy |"
        ),
        "|---|---|---|---|---|---|",
    ]
    of_px4 = []
    for label, pattern, model, how in FAMILIES:
        vehicle = vehicle_of(model, how, flights)
        is_quiet = label == NO_NOISE
        folders = [
            path.parent
            for path in sorted(flights.glob(f"{pattern}/flown.json"))
            if pattern not in MIXED or path.parent.name.endswith("_quiet") is is_quiet
        ]
        made = [flight_of(one, vehicle) for one in folders]
        spread = vehicle.spread
        assert spread is not None
        noise_m = 0.0 if folders[0].name.endswith("_quiet") else None
        own = calibrate(made, spreads=[spread_at_noise(spread, vehicle, noise_m)] * len(made))
        others = calibrate(made, known=REPEATABILITY[vehicle.reference])
        lines.append(_row(label, own, others))
        if vehicle.reference is Autopilot.PX4:
            of_px4.append((own, others))
            last_of_px4 = len(lines)
    all_own, all_others = (together(groups) for groups in zip(*of_px4, strict=True))
    lines.insert(last_of_px4, _row("PX4, all", all_own, all_others))
    write_table("calibration", lines)


def _row(label: str, own: Sequence[Calibration], others: Sequence[Calibration]) -> str:
    return f"| {' | '.join([label, *cells(own), *cells(others), narrowest(others)])} |"


if __name__ == "__main__":
    main(*sys.argv[1:])
