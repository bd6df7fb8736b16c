"""Fuzz targets of the readers: whatever a file holds, it is read or refused with a word, in bounded time."""

from __future__ import annotations

import gzip
import mmap
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
from dataflash_writer import copter_log
from fuzz.frames import dataflash_maker, stream_maker, tlog_maker, ulog_maker
from fuzz.setups import setup_of
from fuzz.target import FOLDER, Target
from made_missions import HOME
from rasterio import Affine
from telemetry_writer import copter_telemetry
from ulog_writer import px4_log

from planner.cli.configuration import OWN_FILE, read_configuration
from planner.errors import MavjouleError
from planner.geo.terrain import read_terrain
from planner.link.address import is_address, read_address
from planner.link.files import read_packet
from planner.link.wire import Codec
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
from planner.setup import settings
from planner.site_profile import read_profile
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.reader import models_root, vehicle_from_toml

if TYPE_CHECKING:
    from collections.abc import Callable

_ROOT = Path(__file__).parents[2]


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
    path = FOLDER / name

    def run(data: bytes) -> None:
        with open(path, "wb") as file:  # noqa: PTH123 - a third of the time of Path's own
            file.write(data)
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
    messages_by_vehicle(data, Damage())  # type: ignore[arg-type] # as above


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

_FULL_LOGS = (px4_log(), copter_log(), copter_telemetry())
_LOGS = tuple(log.content() for log in _FULL_LOGS)
_KIB = 1 << 10


def _raster(
    folder: Path, *, width: int = 5, height: int = 4, kind: str = "float32", **profile: object
) -> bytes:
    import rasterio

    path = folder / "a.tif"
    heights = np.arange(width * height).astype(kind).reshape(1, height, width)
    shape = {"width": width, "height": height, "count": 1, "dtype": kind}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a raster that is nowhere
        with rasterio.open(path, "w", driver="GTiff", **shape, **profile) as raster:
            raster.write(heights)
    return path.read_bytes()


def _rasters() -> list[bytes]:
    """Return heights in the kinds of GeoTIFF that are about."""
    place = Affine(0.001, 0.0, 8.0, 0.0, -0.001, 47.1)
    grid = Affine(30.0, 0.0, 4e5, 0.0, -30.0, 5e6)
    tiled = {"compress": "deflate", "tiled": True, "blockxsize": 16, "blockysize": 16}
    with TemporaryDirectory() as name:
        folder = Path(name)
        return [
            _raster(folder, crs="EPSG:4326", transform=place, nodata=-9999),
            _raster(
                folder, width=40, height=40, kind="int16", crs="EPSG:32632", transform=grid, **tiled
            ),
            _raster(folder),
        ]


def _terrain(data: bytes) -> None:
    path = FOLDER / "a.tif"
    path.write_bytes(data)
    terrain = read_terrain(path)
    [tile] = terrain.tiles
    south, west, north, east = tile.bounds_deg
    heights = terrain.height_amsl_m(
        [south, (south + north) / 2, 0.0], [west, (west + east) / 2, 0.0]
    )
    known = heights.compressed()
    assert ((known > -500.0) & (known < 9000.0)).all()
    terrain.under(np.array([[south, north]]), np.array([[west, east]]))


def _stream(data: bytes) -> None:
    """Decode a stream in two chunks; what follows it is decoded too."""
    codec, middle = Codec(255, 190), len(data) // 2
    codec.decode(data[:middle])
    for one in codec.decode(data[middle:]):
        assert one.name
        read_packet(one) if one.name == "FILE_TRANSFER_PROTOCOL" else None


_ADDRESSES = tuple(
    text.encode()
    for text in (
        *("udpin:0.0.0.0:14550", "udpout://host:1", "tcp:[::1]:5760", "udp://:14540@host:14557"),
        *("/dev/ttyUSB0,57600", "COM3:57600", "serial:///dev/ttyACM0:115200", "127.0.0.1:14550"),
    )
)


def _address(data: bytes) -> None:
    text = data.decode("utf-8", "surrogateescape")
    is_address(text)
    read = read_address(text)
    assert read_address(read.text) == read


_TYPED = tuple(
    f"{key}={text}".encode()
    for key, text in (
        *(
            ("battery", "5.2Ah@14.8V"),
            ("battery", "77Wh"),
            ("charge", "95±2%"),
            ("reserve", "3min"),
        ),
        *(("wind", "5±2@270±20"), ("wind_profile", "log:0.03@10"), ("home_amsl_m", "488 m")),
        *(("temperature_c", "15±5"), ("payload_kg", "500 g"), ("speed_m_s", "18 km/h")),
        *(("ignore", "E105,T"), ("select", "ALL"), ("fail_on", "warning"), ("risk", "1%")),
        *(("target", "px4-1.16"), ("autopilot", "auto"), ("reaction_time_s", "1.5 s")),
        *(("battery_health", "85%"), ("position_error_m", "3 m"), ("position_noise_m", "0.3")),
        ("heading_deg", "90"),
    )
)
_KINDS = {key: setting.kind for key, setting in settings().items()}


def _typed(data: bytes) -> None:
    """Read what is typed for a setting: a sentence, or a value that can be written and read again."""
    key, _, text = data.decode("utf-8", "surrogateescape").partition("=")
    if key not in _KINDS or key in _OF_FILES:
        return
    try:
        value = _KINDS[key].read(text)
    except ValueError:  # as it is declared
        return
    assert _KINDS[key].read(_KINDS[key].text(value)) == value  # which no NaN does
    setup_of({key: value})


_OF_FILES = frozenset({"vehicle", "parameters", "terrain", "per_file_ignores"})
"""Settings whose files have targets of their own."""


_SEEDS = 0.25


def targets() -> tuple[Target, ...]:
    """Return the targets."""
    ulog, dataflash, tlog = _LOGS
    writers = _FULL_LOGS
    models = [path.read_bytes() for path in sorted(models_root().glob("*.toml"))[:3]]
    thin_tlog = b"".join(writers[2].frames[::10])
    heads = [content[: 8 * _KIB] for content in _LOGS]
    return (
        Target("mission", _plans(), _mission),
        Target("parameters", _PARAM_SEEDS, _parameters),
        Target("model", models, lambda data: vehicle_from_toml(data, name="a", source="a.toml")),
        Target("mapping", [_MAPPING_SEED], _by_path("map.toml", read_csv_mapping)),
        Target("configuration", [_CONFIGURATION_SEED], _by_path(OWN_FILE, read_configuration)),
        Target("profile", [_PROFILE_SEED], _by_path("site.toml", read_profile)),
        Target("baseline", [_BASELINE_SEED], _by_path("known.json", read_baseline)),
        Target("typed", _TYPED, _typed),
        Target("address", _ADDRESSES, _address),
        Target("terrain", _rasters(), _terrain),
        Target("ulog", [ulog[: 4 * _KIB]], _ulog, ulog_maker(ulog), _SEEDS),
        Target(
            "dataflash",
            [dataflash[: 4 * _KIB]],
            _dataflash,
            dataflash_maker(writers[1].messages),
            _SEEDS,
        ),
        Target("dataflash-text", [_TEXT_LOG], _dataflash_text),
        Target("tlog", [tlog[:1500]], _tlog, tlog_maker(writers[2].frames), _SEEDS),
        Target("stream", [tlog[8:300]], _stream, stream_maker(), _SEEDS),
        Target(
            "log",
            [*heads, *_LOGS, thin_tlog, _CSV_SEED, _TEXT_LOG, gzip.compress(_CSV_SEED)],
            _by_path("a.log", read_log),
        ),
    )
