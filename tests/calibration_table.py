"""How often recorded flights lie between p10 and p90, family by family; not in the gate.

Run as ``make calibration FLIGHTS=folder``: writes the table in ``models/README.md``.  Each flight is
predicted from its mission, parameters and wind alone.  Its intervals come once from the spread of the
model as it stands, and once from the errors of the other flights of its family, each left out in turn.
The flights of the Matrice are besides predicted from the legs in their logs, which those missions were
inferred from.
"""

from __future__ import annotations

import contextlib
import csv
import json
import math
import sys
from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from leg_kinds import KINDS_HEAD, kinds_row
from readme_table import write_table

import planner
from planner.autopilot import Autopilot
from planner.cli.main import main as command_line
from planner.errors import IdentificationError, LogFileError
from planner.flight.uncertainty import HIGH, LOW, kind_of, spread_at_noise
from planner.identify.calibration import OF_FLIGHTS, Calibration, calibrate
from planner.identify.ramps import durations_s, timed_flight
from planner.identify.spread import FlownAndPredicted, fit_spread
from planner.logs.files import read_log
from planner.vehicle.parameters.files import read_parameters
from planner.vehicle.repeatability import REPEATABILITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.flight.motion.kinematics import FlightState
    from planner.identify.calibration import FlightInterval
    from planner.vehicle.model import ModelSpread, VehicleModel

NO_NOISE = "PX4, no noise"
_AT_ONCE_S = 0.1
"""Items are noted as done within that of when they are. [s]"""
MIXED = ("px4-[A-FN]*", "px4-N_*")
"""Folders of flights with and without noise; those without end in _quiet."""
_ROUNDING = 1e-9
HEADING_DEG = 0.0
"""Which PX4's simulator arms with, as the logs of its flights show.  [deg]"""
LOGS_OF_LEGS = "real/matrice-100"
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


StatesOfLegs = list[dict["FlightState", float]]
"""How long each leg is predicted to be in each state. [s]"""


def flight_of(folder: Path, vehicle: VehicleModel) -> tuple[FlownAndPredicted, StatesOfLegs]:
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
    states: StatesOfLegs = [defaultdict(float) for _ in parts[:-1]]
    for of_leg, (begin, end) in zip(
        states, pairwise(expected_s for _, expected_s in cuts), strict=False
    ):
        for segment in result.segments:
            within_s = min(segment.start_s + segment.duration_s, end) - max(segment.start_s, begin)
            if within_s > 0.0:
                of_leg[segment.state] += within_s
    flight = FlownAndPredicted(
        legs_s=parts[:-1],
        # what ends with its last item, done as it ends, has no part after it
        landing_s=parts[-1] if parts[-1][1] > 0.0 and parts[-1][0] > _AT_ONCE_S else None,
        flown_energy_j={kind: whole * energy_j for kind, energy_j in predicted_j.items()},
        predicted_energy_j=predicted_j,
        wind_speed_m_s=wind["speed_m_s"],
    )
    return flight, states


def flights_of_legs(logs: Path, vehicle: VehicleModel) -> list[FlownAndPredicted]:
    """Return the times of flights in logs and their predictions by ramps from the legs flown."""
    assert vehicle.ramps is not None
    found = []
    for path in sorted(logs.glob("*.csv.gz")):
        with contextlib.suppress(LogFileError, IdentificationError):
            flight = timed_flight(read_log(path)[0])
            predicted_s = durations_s(flight, vehicle.ramps)
            takeoff, *legs, landing = zip(
                (m.duration_s for m in flight.manoeuvres), predicted_s, strict=True
            )
            ends = (takeoff[0] + landing[0], takeoff[1] + landing[1])
            found.append(FlownAndPredicted(legs_s=legs, landing_s=ends))
    return found


def days_of(logs: Path, missions: Sequence[Path]) -> list[str]:
    """Return the day each mission was flown on, by the flight sheet of the logs."""
    with (logs / "PAYLOAD.csv").open(encoding="utf-8", newline="") as sheet:
        days = {row["file_no"]: row["date"] for row in csv.DictReader(sheet)}
    return [days[mission.name] for mission in missions]


def by_other_days(
    flights: Sequence[FlownAndPredicted], days: Sequence[str]
) -> tuple[Calibration, ...]:
    """Return the calibration by the flights of other days: those of one day may err alike."""
    known = REPEATABILITY[Autopilot.STEP]
    spreads = {}
    for day in set(days):
        others = [flight for flight, own in zip(flights, days, strict=True) if own != day]
        spreads[day] = fit_spread(others, source="other days", known=known)
    return calibrate(flights, spreads=[spreads[day] for day in days])


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
        f"{_percent(of[name].median_error)}: {of[name].sharpness:.1f}"
        if name in of
        else "—"
        for name in OF_FLIGHTS
    ]


def by_chance(rows: Sequence[Calibration]) -> str:
    """Return what right intervals of as many flights show in nine draws of ten."""
    (least, most), (sharp, wide) = rows[0].inside_by_chance, rows[0].sharpness_by_chance
    return f"{least} to {most}, {sharp:.1f} to {wide:.1f}"


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
    """Write the tables into the README of the models, and to standard output."""
    flights = Path(folder)
    lines = [
        (
            "| family | time, its own spread | energy, its own spread | time, the others "
            "| energy, the others | by chance | 80 % of the errors: time, energy |"
        ),
        "|---|---|---|---|---|---|---|",
    ]
    of_kinds = [*KINDS_HEAD]
    of_px4 = []
    for label, pattern, model, how in FAMILIES:
        vehicle = vehicle_of(model, how, flights)
        is_quiet = label == NO_NOISE
        folders = [
            path.parent
            for path in sorted(flights.glob(f"{pattern}/flown.json"))
            if pattern not in MIXED or path.parent.name.endswith("_quiet") is is_quiet
        ]
        made, states = zip(*(flight_of(one, vehicle) for one in folders), strict=True)
        spread = vehicle.spread
        assert spread is not None
        noise_m = 0.0 if folders[0].name.endswith("_quiet") else None
        own, others = _both(made, spread_at_noise(spread, vehicle, noise_m), vehicle)
        lines.append(_row(label, own, others))
        if vehicle.reference is Autopilot.STEP:  # its missions have no legs: they were not logged
            legs = flights_of_legs(flights / LOGS_OF_LEGS, vehicle)
            lines.append(_row(f"{label}, from the legs flown", *_both(legs, spread, vehicle)))
            days = days_of(flights / LOGS_OF_LEGS, folders)
            lines.append(_row(f"{label}, other days", (), by_other_days(made, days)))
        else:
            of_kinds.append(kinds_row(label, made, states, REPEATABILITY[vehicle.reference]))
        if vehicle.reference is Autopilot.PX4:
            of_px4.append((own, others))
            last_of_px4 = len(lines)
    all_own, all_others = (together(groups) for groups in zip(*of_px4, strict=True))
    lines.insert(last_of_px4, _row("PX4, all", all_own, all_others))
    write_table("calibration", lines)
    write_table("legs", of_kinds)


def _both(
    flights: Sequence[FlownAndPredicted], spread: ModelSpread, vehicle: VehicleModel
) -> tuple[tuple[Calibration, ...], tuple[Calibration, ...]]:
    """Return the calibration by the spread of the model, and by the other flights."""
    own = calibrate(flights, spreads=[spread] * len(flights))
    return own, calibrate(flights, known=REPEATABILITY[vehicle.reference])


def _row(label: str, own: Sequence[Calibration], others: Sequence[Calibration]) -> str:
    columns = [label, *cells(own), *cells(others), by_chance(others), narrowest(others)]
    return f"| {' | '.join(columns)} |"


if __name__ == "__main__":
    main(*sys.argv[1:])
