"""Fuzz targets of the readers: whatever a file holds, it is read or refused with a word, in bounded time."""

from __future__ import annotations

import gzip
import mmap
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from dataflash_writer import copter_log
from fuzz.target import Target
from made_missions import HOME
from telemetry_writer import copter_telemetry
from ulog_writer import px4_log

from planner.cli.configuration import OWN_FILE, read_configuration
from planner.errors import MavjouleError
from planner.logs.csv import read_csv_mapping
from planner.logs.dataflash import read_binary, read_text
from planner.logs.files import read_log
from planner.logs.messages import Damage
from planner.logs.tlog import messages_by_vehicle
from planner.logs.ulog import WANTED
from planner.logs.ulog_messages import read_ulog
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.items import MissionFormat
from planner.selection import read_baseline
from planner.site_profile import read_profile
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.reader import models_root, vehicle_from_toml

if TYPE_CHECKING:
    from collections.abc import Callable

_ROOT = Path(__file__).parents[2]
_FOLDER = TemporaryDirectory(prefix="mavjoule-fuzz-")


def _mission(data: bytes) -> None:
    """Read a mission, write it in both formats, and read what was written."""
    try:
        mission = read_mission_bytes(data, source="a.plan")
    except MavjouleError:
        return
    for item in mission.items:
        values = (item.param1, item.param2, item.param3, item.param4)
        places = (item.latitude_deg, item.longitude_deg, item.altitude_m)
        assert all(one is None or np.isfinite(one) for one in (*values, *places))
    for kind in (MissionFormat.PLAN, MissionFormat.WPL):
        try:
            text = convert_mission(mission, kind).text
        except MavjouleError:
            continue
        back = read_mission_bytes(text.encode(), source="b.plan")
        assert len(back.items) == len(mission.items)
        assert [one.command for one in back.items] == [one.command for one in mission.items]


def _parameters(data: bytes) -> None:
    found = parameters_from_text(data, source="a.param")
    assert all(one.value is None or np.isfinite(one.value) for one in found.values.values())


def _by_path(name: str, read: Callable[[Path], object]) -> Callable[[bytes], None]:
    def run(data: bytes) -> None:
        path = Path(_FOLDER.name) / name
        path.write_bytes(data)
        read(path)

    return run


def _ulog(data: bytes) -> None:
    with np.errstate(invalid="ignore", over="ignore"):
        content = read_ulog(data, WANTED, Damage(), source="a.ulg")
    assert all(np.isfinite(table.time_s).all() for _, table in content.topics)


def _dataflash(data: bytes) -> None:
    with np.errstate(invalid="ignore", over="ignore"):
        read_binary(data, Damage())  # type: ignore[arg-type] # bytes do what is asked of a mapped file


def _dataflash_text(data: bytes) -> None:
    if data:
        with mmap.mmap(-1, len(data)) as mapped:
            mapped.write(data)
            mapped.seek(0)
            read_text(mapped, Damage())


def _tlog(data: bytes) -> None:
    messages_by_vehicle(data, "a.tlog", Damage())  # type: ignore[arg-type] # as above


def _plans() -> list[bytes]:
    shipped = sorted((_ROOT / "missions").glob("*.plan")) + sorted(
        (_ROOT / "missions").glob("*.waypoints")
    )
    fence = (
        '{"fileType": "Plan", "version": 1, "geoFence": {"circles": [{"circle": {"center": [47, 8], '
        '"radius": 90}, "inclusion": true, "version": 1}], "polygons": [{"inclusion": false, "polygon": '
        '[[47, 8], [47.1, 8], [47.1, 8.1]], "version": 1}], "version": 2}, "mission": {"items": '
        '[{"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, null, 47, 8, 20], '
        '"autoContinue": true, "doJumpId": 1}, {"type": "SimpleItem", "command": 177, "frame": 2, '
        '"params": [1, 3, 0, 0, 0, 0, 0], "autoContinue": true, "doJumpId": 2}], '
        '"plannedHomePosition": [47, 8, 400], "version": 2, "firmwareType": 12, "vehicleType": 2}, '
        '"rallyPoints": {"points": [[47, 8, 30]], "version": 2}}'
    )
    rows = (
        f"QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t{HOME.latitude_deg}\t{HOME.longitude_deg}\t400\t1\n"
        "1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1\n2\t0\t3\t16\t0\t0\t0\t0\t47.001\t8\t30\t1\n"
        "3\t0\t3\t177\t1\t-1\t0\t0\t0\t0\t0\t1\n4\t0\t0\t5001\t3\t0\t0\t0\t47\t8\t0\t1\n"
    )
    texts = [fence.encode(), rows.encode(), gzip.compress(rows.encode())]
    return texts + [path.read_bytes() for path in shipped if path.stat().st_size < 20_000]


_PARAM_SEEDS = [
    b"# comment\nRTL_ALT,3000\nWPNAV_SPEED 500\nBATT_LOW_VOLT\t21.0\nX,0x10 @READONLY\n",
    b"# Stack: PX4 Pro\n# Version: 1.15.0\n1\t1\tMPC_XY_CRUISE\t5.0\t9\n1\t1\tRTL_TYPE\t0\t6\n",
]
_MAPPING_SEED = b"""schema = 1
name = "m"
[columns]
time_s = { column = "t", unit = "ms" }
voltage_v = { column = "U" }
current_a = { column = "I", is_negated = true }
mode = { column = "mode" }
[orientation]
columns = ["w", "x", "y", "z"]
axes = "flu-enu"
"""
_CONFIGURATION_SEED = b"""vehicle = "a.toml"
battery = "5.2Ah@14.8V"
reserve = 0.25
wind = "5@270"
ignore = ["E107", "T"]
fail-on = "warning"
[per_file_ignores]
"a.plan#3" = "E105"
"""
_PROFILE_SEED = b"""name = "hill"
[site]
max_height_m = 120
required_items = ["NAV_TAKEOFF"]
[expect.params]
RTL_ALT = [3000, 6000]
X = { value = 3, tolerance = 0.1 }
[manual]
props = ["tight?"]
"""
_BASELINE_SEED = (
    b'{"schema": 1, "known": [{"file": "a.plan", "item": 1, "code": "E105", "severity": "warning", '
    b'"message": "x"}]}'
)
_CSV_SEED = b"t,U,I,mode\n0,15.0,10,AUTO\n100,14.9,11,AUTO\n200,14.8,12,RTL\n"
_TEXT_LOG = (
    b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n"
    b"FMT, 130, 20, BAT, Qff, TimeUS,Volt,Curr\nBAT, 1000000, 15.1, 10.2\nBAT, 1100000, 15.0, 10.3\n"
)

_LOGS = (px4_log().content(), copter_log().content(), copter_telemetry().content())
_KIB = 1 << 10


def targets() -> tuple[Target, ...]:
    """Return a target for each reader."""
    ulog, dataflash, tlog = _LOGS
    heads = [log[: 8 * _KIB] for log in _LOGS]
    models = [path.read_bytes() for path in sorted(models_root().glob("*.toml"))[:3]]
    return (
        Target("mission", _plans(), _mission),
        Target("parameters", _PARAM_SEEDS, _parameters),
        Target("model", models, lambda data: vehicle_from_toml(data, name="a", source="a.toml")),
        Target("mapping", [_MAPPING_SEED], _by_path("map.toml", read_csv_mapping)),
        Target("configuration", [_CONFIGURATION_SEED], _by_path(OWN_FILE, read_configuration)),
        Target("profile", [_PROFILE_SEED], _by_path("site.toml", read_profile)),
        Target("baseline", [_BASELINE_SEED], _by_path("known.json", read_baseline)),
        Target("ulog", [ulog[: 4 * _KIB], ulog[: 16 * _KIB]], _ulog),
        Target("dataflash", [dataflash[: 4 * _KIB], dataflash[: 8 * _KIB]], _dataflash),
        Target("dataflash-text", [_TEXT_LOG], _dataflash_text),
        Target("tlog", [tlog[:1500], tlog[: 4 * _KIB]], _tlog),
        Target(
            "log",
            [*heads, *_LOGS, _CSV_SEED, gzip.compress(_CSV_SEED)],
            _by_path("a.log", read_log),
        ),
    )
