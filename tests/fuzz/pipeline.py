"""The fuzz targets of the whole: fleets, and missions of any shape, under any conditions, in every report.

An input of missions is a JSON document: the text of the mission, settings as they are typed, and the text
of the parameters.
"""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np
from fuzz.setups import setup_of
from fuzz.target import FOLDER, Target

from planner import catalogue
from planner.cli.check_output import rendered
from planner.errors import ExitCode, MavjouleError
from planner.fleet.reader import read_fleet
from planner.geo.terrain import TerrainGrid, TerrainTile
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.items import MissionFormat
from planner.report.columns import columns_csv, segments_csv, segments_text
from planner.report.fleet import fleet_json, fleet_text
from planner.report.html.page import check_html
from planner.report.text import Medium
from planner.rules.declaration import DISCHARGE, PARAMETERS, TARGET, TERRAIN
from planner.rules.ledger import Outcome
from planner.rules.lift import THRUST
from planner.rules.registry import SUBJECTS
from planner.selection import is_kept_on
from planner.service.fleet import check_fleet
from planner.service.preflight import CheckResult, check_mission
from planner.setup import FORMATS, Output, settings
from planner.values import replace
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from planner.mission.items import Mission

_MODELS = ("falkowski-2023-quadrotor", "px4-sih-quad", "arducopter-sitl-quad", "dji-matrice-100")
_COMMANDS = (
    *(16, 16, 16, 16, 16, 17, 18, 19, 20, 21, 22, 22, 31, 82, 92, 93, 94, 95, 112, 114, 115),
    *(177, 177, 178, 178, 179, 189, 195, 197, 201, 203, 206, 207, 211, 85, 84, 2000, 3000, 50_001),
)
_FRAMES = (0, 2, 3, 3, 3, 3, 5, 6, 10, 11, 99)
_ODD = (0.0, 1.0, -1.0, 2.0, 3.0, 5.0, 10.0, 100.0, -5.0, 0.001, 65_535.0, 1e6, -1e6, 3e38, None)
_TABLES = {"px4": parameter_table(Px4Parameters), "ardupilot": parameter_table(ArduPilotParameters)}
_FACTORS = (0.0, 0.01, 0.5, 1.0, 1.0, 1.5, 10.0, -1.0)
"""Of the default, a value may be so many times."""
_SETTINGS: dict[str, tuple[str, ...]] = {
    "battery": ("5.2Ah@14.8V", "170Wh", "4000Wh", "0.1Wh", "99Ah@22.2V", "1Ah@3.7V"),
    "charge": ("100%", "50%", "5%", "0%", "95±2%"),
    "reserve": ("20%", "0%", "100%", "12Wh", "3min"),
    "wind": ("0", "5@270", "12@0", "30@90", "5±2@270±20", "3@45"),
    "wind_profile": ("power:0.2@10", "log:0.03@10"),
    "home_amsl_m": ("0", "488", "-400", "8000"),
    "temperature_c": ("-40", "15", "50", "15±5"),
    "payload_kg": ("0", "0.5", "5", "0.5±0.1"),
    "position_noise_m": ("0", "0.3", "1.5"),
    "heading_deg": ("0", "270"),
    "speed_m_s": ("0.5", "5", "15", "60"),
    "reaction_time_s": ("0", "1.5", "10"),
    "battery_health": ("50%", "100%", "85%"),
    "battery_temperature_c": ("-10", "20", "45"),
    "position_error_m": ("0", "3", "100"),
    "fail_on": ("error", "warning"),
    "risk": ("1%", "50%"),
    "ignore": ("T", "M1", "W,A1"),
    "autopilot": ("auto", "px4", "ardupilot", "step"),
    "target": ("px4-1.16", "arducopter-4.6"),
}


_AUTOPILOT_OF = {_MODELS[1]: "px4", _MODELS[2]: "ardupilot"}
_FLOWN_AS = {
    **dict.fromkeys(_MODELS, ("auto", "step")),
    _MODELS[1]: ("auto", "px4"),
    _MODELS[2]: ("auto", "ardupilot"),
}
_TARGET_OF = {"px4": "px4-1.16", "ardupilot": "arducopter-4.6"}


_QUICK_FORMATS = ("text", "json", "junit", "github", "gitlab")
"""A SARIF log holds every rule: it takes as long as the check."""


def drawn_settings(draw: Random, *, given: float = 0.2) -> dict[str, str]:
    """Return settings as they are typed, any that go together; so many of them are given."""
    vehicle = draw.choice(_MODELS)
    options = {key: draw.choice(texts) for key, texts in _SETTINGS.items() if draw.random() < given}
    if draw.random() < 0.02:  # contradictions are refused
        return {"vehicle": vehicle, **options}
    flown_by = _AUTOPILOT_OF.get(vehicle)
    if "autopilot" in options:
        options["autopilot"] = draw.choice(_FLOWN_AS[vehicle])
    if "target" in options and flown_by is not None:
        options["target"] = _TARGET_OF[flown_by]
    return {"vehicle": vehicle, **options}


def _made(draw: Random) -> bytes:
    is_sound = draw.random() < 0.5
    options = drawn_settings(draw, given=0.03 if is_sound else 0.2)
    if is_sound:
        options["battery"] = draw.choice(("60Wh", "170Wh", "7.8Ah@22.2V"))
    elif draw.random() < 0.7:
        options["battery"] = draw.choice(_SETTINGS["battery"])
    stack = _AUTOPILOT_OF.get(options["vehicle"], draw.choice(tuple(_TABLES)))
    rows = draw.sample(tuple(_TABLES[stack].values()), draw.choice((1, 2, 5, 30)))
    lines = [f"{row.now.name},{_drawn_value(row.usual, draw):g}" for row in rows]
    document = {
        "mission": sound_plan(draw) if is_sound else rough_plan(draw),
        "settings": options,
        "parameters": "\n".join(lines) if draw.random() < (0.15 if is_sound else 0.4) else "",
        "page": draw.random() < 0.001,  # its pictures take a hundred times as long as the check
        "format": draw.choice((*_QUICK_FORMATS * 10, *FORMATS)),
    }
    return json.dumps(document).encode()


def _item(number: int, command: int, frame: int, *parameters: float | None) -> dict[str, Any]:
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": frame,
        "params": list(parameters),
        "doJumpId": number,
        "autoContinue": True,
    }


def _drawn_value(usual: float, draw: Random) -> float:
    if isinstance(usual, int):  # a choice, a set of bits
        return draw.choice((usual, 0, 1, 2, 3, 4, 7, 1 << draw.randrange(16), -1))
    if draw.random() < 0.2:
        return draw.choice(_ODD) or draw.uniform(0, 30)
    return usual * draw.choice(_FACTORS)


def sound_plan(draw: Random) -> str:
    """Return a mission as people plan them: places on the grid of MAVLink's degrees."""
    height_m = draw.choice((15, 30, 50, 100))
    reach_deg = draw.choice((5e-4, 2e-3, 5e-3, 2e-2))

    def near(times: float = 1.0) -> list[float]:
        reach = times * reach_deg
        return [round(at + reach * draw.uniform(-1.0, 1.0), 7) for at in (47.0, 8.0)]

    items = [_item(1, 22, 3, 0, 0, 0, None, 47.0, 8.0, height_m)]
    for _ in range(draw.choice((1, 2, 2, 3, 6, 10))):
        number, height = len(items) + 1, draw.choice((height_m, height_m, height_m + 20))
        waypoint = _item(number, 16, 3, draw.choice((0, 0, 5)), 0, 0, None, *near(), height)
        loiter = _item(number, 19, 3, draw.choice((5, 60)), 0, 0, None, *near(), height_m)
        speed = _item(number, 178, 2, 1, draw.choice((3, 8)), -1, 0, 0, 0, 0)
        jump = _item(number, 177, 2, 2, draw.choice((1, 3)), 0, 0, 0, 0, 0)
        chosen = draw.choices((waypoint, loiter, speed, jump), (15, 2, 2, 1 if number > 2 else 0))
        items += chosen
    number = len(items) + 1
    way_home = _item(number, 20, 2, *[0] * 7), _item(number, 21, 3, 0, 0, 0, None, 47.0, 8.0, 0)
    items.append(draw.choice(way_home))
    fence: dict[str, Any] = {"version": 2, "circles": [], "polygons": []}
    if draw.random() < 0.25:
        circle = {"center": near(1.5), "radius": 40.0}
        fence["circles"] = [{"circle": circle, "inclusion": False, "version": 1}]
    if draw.random() < 0.25:
        sides = ((-1, -1), (-1, 1), (1, 1), (1, -1))
        corners = [[47.0 + 1.2 * reach_deg * i, 8.0 + 1.2 * reach_deg * j] for i, j in sides]
        fence["polygons"] = [{"polygon": corners, "inclusion": True, "version": 1}]
    return plan_of(
        items,
        home=[47.0, 8.0, 400],
        firmware=draw.choice((3, 12)),
        fence=fence,
        rally=[[*near(1.5), 30.0]] if draw.random() < 0.15 else [],
    )


def plan_of(
    items: list[dict[str, Any]],
    *,
    home: list[float | None],
    firmware: int,
    fence: dict[str, Any] | None = None,
    rally: list[list[float]] | None = None,
) -> str:
    """Return the text of a plan."""
    plan = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "geoFence": fence or {"version": 2, "circles": [], "polygons": []},
        "rallyPoints": {"version": 2, "points": rally or []},
        "mission": {
            "version": 2,
            "firmwareType": firmware,
            "vehicleType": 2,
            "hoverSpeed": 5,
            "cruiseSpeed": 15,
            "plannedHomePosition": home,
            "items": items,
        },
    }
    return json.dumps(plan)


def rough_plan(draw: Random) -> str:
    """Return a mission of any commands, frames and places."""
    home = [47.0, 8.0, draw.choice((400, 0, None, 9000))]
    reach_deg = draw.choice((0.0, 1e-7, 1e-4, 3e-3, 3e-3, 0.05, 5.0))
    count = draw.choice((0, 1, 2, 2, 3, 3, 4, 4, 5, 6, 8, draw.choice((8, 20, 60))))

    def near(middle: float) -> float:
        return middle + reach_deg * draw.uniform(-1.0, 1.0)

    def item(number: int) -> dict[str, Any]:
        command = 22 if number == 1 and draw.random() < 0.7 else draw.choice(_COMMANDS)
        parameters = [
            draw.choice((0, 0, 0, draw.choice(_ODD), draw.uniform(0, 20))) for _ in range(4)
        ]
        if command == 177:
            parameters[0] = draw.choice((1, number, count, draw.randrange(1, count + 2)))
            parameters[1] = draw.choice((0, 1, 3, -1, 10_000))
        if command == 178:
            parameters[:2] = [draw.choice((0, 1, 2, 3)), draw.choice((-1, 0.5, 5, 12, 90))]
        place: list[float | None] = [
            near(47.0),
            near(8.0),
            draw.choice((20, 30, 100, 0, -20, 0.5, draw.uniform(0, 500), draw.choice((9000, 1e5)))),
        ]
        if draw.random() < 0.05:
            place = [draw.choice((0, None, 90.0, -89.9)), draw.choice((0, None, 180.0)), place[2]]
        return {
            "type": "SimpleItem",
            "command": command,
            "frame": draw.choice(_FRAMES),
            "params": [*parameters, *place],
            "doJumpId": number,
            "autoContinue": draw.random() < 0.97,
        }

    def area() -> list[list[float]]:
        return [[near(47.0), near(8.0)] for _ in range(draw.choice((3, 4, 7)))]

    fence: dict[str, Any] = {"version": 2, "circles": [], "polygons": []}
    if draw.random() < 0.25:
        circle = {"center": [near(47.0), near(8.0)], "radius": draw.choice((1.0, 50.0, 1e4))}
        fence["circles"] = [{"circle": circle, "inclusion": draw.random() < 0.5, "version": 1}]
        fence["polygons"] = [{"polygon": area(), "inclusion": draw.random() < 0.7, "version": 1}]
    rally = [
        [near(47.0), near(8.0), draw.uniform(0, 60)] for _ in range(draw.choice((0, 0, 0, 1, 3)))
    ]
    return plan_of(
        [item(number) for number in range(1, count + 1)],
        home=home if draw.random() < 0.9 else [None, None, None],
        firmware=draw.choice((0, 3, 12)),
        fence=fence,
        rally=rally,
    )


@cache
def _value(key: str, text: str) -> Any:  # noqa: ANN401 - numbers, names, models
    return settings()[key].kind.read(text)


def checked(document: dict[str, Any], **more: Any) -> CheckResult:  # noqa: ANN401 - as of `Setup`
    """Return the result of an input."""
    mission = read_mission_bytes(
        document["mission"].encode(), source=document.get("name", "a.plan")
    )
    values = {key: _value(key, text) for key, text in document["settings"].items()}
    setup = replace(setup_of(values), **more)
    if document["parameters"]:
        text = document["parameters"].encode()
        setup = replace(setup, parameters=parameters_from_text(text, source="a.param"))
    if document.get("ground_amsl_m") is not None:
        setup = replace(setup, terrain=level_ground(document["ground_amsl_m"]))
    return check_mission(mission, setup)


def level_ground(height_m: float) -> TerrainGrid:
    """Return level ground around the missions."""
    tile = TerrainTile(
        source="level.tif",
        heights_amsl_m=np.full((3, 3), height_m, np.float32),
        transform=(1.0, 0.0, 7.0, 0.0, -1.0, 49.0),
        projection_wkt=None,
        bounds_deg=(46.0, 7.0, 49.0, 10.0),
        cell_m=70_000.0,
    )
    return TerrainGrid(tiles=(tile,))


def run(data: bytes) -> None:
    """Check and report one input; raise where something does not hold."""
    document = json.loads(data)
    result = checked(document, with_trace=bool(document.get("page")))
    _holds(result)
    _reports(result, [document["format"]] if "format" in document else list(FORMATS))
    if document.get("page"):
        _draws(result)
    _reads_back(result.assessment.mission if result.assessment is not None else None)


def _holds(result: CheckResult) -> None:
    """Check what is true of every result."""
    deciding = [one for one in result.findings if one.severity >= result.setup.fail_on]
    assert (result.verdict == "no-go") is bool(deciding)
    assert not any(is_kept_on(one) for one in result.suppressed)
    totals, battery = result.totals, result.battery
    time_s, distance_m = totals.time_s, totals.distance_m
    assert math.isfinite(time_s)
    assert time_s >= 0.0
    assert math.isfinite(distance_m)
    assert distance_m >= 0.0
    durations = [one.duration_s for one in result.segments]
    assert all(one >= 0.0 for one in durations)
    # Sums of many segments are rounded: 1e-9 of a total is a thousand roundings of its last place.
    assert math.isclose(math.fsum(durations), time_s, rel_tol=1e-9, abs_tol=1e-6)
    if math.isfinite(totals.energy_wh):
        energies = [one.energy_wh for one in result.segments]
        assert all(one >= 0.0 for one in energies)
        assert math.isclose(math.fsum(energies), totals.energy_wh, rel_tol=1e-9, abs_tol=1e-9)
    for before, after in zip(result.segments, result.segments[1:], strict=False):
        assert math.isclose(
            before.start_s + before.duration_s, after.start_s, abs_tol=1e-6, rel_tol=1e-9
        )
    if result.verdict == "go":
        assert battery is not None
        assert battery.margin_wh >= 0.0
        assert result.setup.is_vehicle_named
        assert result.segments
        assert math.isfinite(totals.energy_wh)
        assert battery.used_fraction <= 1.0
        _is_checked(result)


_MAY_LACK = frozenset({TERRAIN.what, PARAMETERS.what, DISCHARGE.what, TARGET.what, THRUST.what})
"""A go may rest on a check without these, and says so; whatever else a rule lacks is no go."""


def _is_checked(result: CheckResult) -> None:
    """Check that every rule was looked at, and that none lacks what was given."""
    rules = {
        code
        for code, one in catalogue.entries().items()
        if one.module.removeprefix("planner.rules.") in SUBJECTS
    }
    assert {one.code for one in result.checked} >= rules
    given = {TERRAIN.what} if result.setup.terrain is not None else set()
    given |= {PARAMETERS.what} if result.setup.parameters is not None else set()
    target = result.assessment and result.assessment.target
    given |= {TARGET.what} if target is not None else set()
    lacked = {one.needs for one in result.checked if one.outcome is Outcome.NOT_CHECKED}
    assert lacked <= _MAY_LACK - given, lacked


def _reports(result: CheckResult, formats: list[str]) -> None:
    """Check that renderers say something that their readers can read."""
    for name in formats:
        text = rendered([result], Output(format=name), exit_code=ExitCode.GO)
        text.encode()
        assert "\x1b" not in text
        if name in {"json", "sarif", "gitlab"}:
            json.loads(text, parse_constant=refuse_constant)
        elif name == "junit":
            ET.fromstring(text)
        elif name == "text":
            segments_csv(result)
            segments_text(result)


def _draws(result: CheckResult) -> None:
    """Check that the page and the columns of the flight can be made."""
    page = check_html([result], version="1", made_at=datetime.now(UTC), sha256={result.file: ""})
    assert page.rstrip().endswith("</html>")
    if result.trace is not None:
        columns_csv(result.trace.columns())


def refuse_constant(constant: str) -> None:
    """Raise: a NaN or an infinity is no JSON."""
    msg = f"{constant} is not JSON"
    raise AssertionError(msg)


def _reads_back(mission: Mission | None) -> None:
    """Check that a written mission is the one that was written."""
    if mission is None:
        return
    for kind in (MissionFormat.PLAN, MissionFormat.WPL):
        try:
            text = convert_mission(mission, kind).text
        except MavjouleError:
            continue
        back = read_mission_bytes(text.encode(), source="b.plan")
        assert [one.command for one in back.items] == [one.command for one in mission.items]


_FLEET_SEED = b"""
schema = 1
[operation]
start = 2026-05-12T08:00:00+02:00
latest_s = 3600
[conditions]
wind = "3@270"
reserve = "25%"
[separation]
horizontal_m = 10
start_error_s = 2
[layers]
lowest_m = 40
highest_m = 80
step_m = 15
[swap]
time_s = 120
[pad.north]
latitude_deg = 47.0
longitude_deg = 8.0
[vehicle.alpha]
model = "falkowski-2023-quadrotor"
pad = "north"
payload_kg = 0.2
[vehicle.beta]
model = "falkowski-2023-quadrotor"
equipment = ["camera"]
available_until_s = 3000
[pack.A]
battery = "5.2Ah@14.8V"
charge = "90%"
count = 3
[pack.B.battery]
capacity_wh = 77
[charger.bench]
c_rate = 1
taper_soc = [0.8, 1.0]
taper_factor = [1.0, 0.1]
packs = ["A"]
[job.survey]
mission = "a.plan"
earliest_s = 5
[job.again]
mission = "a.plan"
payload_kg = 0.1
[sortie.first]
job = "survey"
vehicle = "alpha"
pack = "A-2"
start_s = 10
[sortie.second]
job = "again"
vehicle = "beta"
pack = "B"
start_s = 900
[sortie.third]
job = "again"
vehicle = "alpha"
pack = "A-2"
pad = "north"
start_s = 2000
"""


def _fleet(data: bytes) -> None:
    """Read a fleet and judge it; the mission of its jobs is always there."""
    path = FOLDER / "fleet.toml"
    path.write_bytes(data)
    fleet = read_fleet(path)
    mission = FOLDER / "a.plan"
    if not mission.exists():
        mission.write_text(sound_plan(Random(3)))
    result = check_fleet(fleet)
    fleet_text(result, medium=Medium()).encode()
    json.loads(fleet_json(result, version="1"), parse_constant=refuse_constant)
    if result.verdict == "go":
        assert all(one.result.verdict == "go" for one in result.sorties)
        assert {one.sortie.job for one in result.sorties} == {*fleet.jobs}


def targets() -> tuple[Target, ...]:
    """Return the targets."""
    crossing = Path(__file__).parents[2] / "missions" / "crossing-too-far.plan"
    seed = {
        "mission": crossing.read_text("utf-8"),
        "settings": {"vehicle": _MODELS[0]},
        "parameters": "",
    }
    return (
        Target("fleet", [_FLEET_SEED], _fleet),
        Target("pipeline", [json.dumps(seed).encode()], run, make=_made),
    )
