"""Flight logs in CSV: by the mappings that are known and by a user's own."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING

import made_flight as made
import numpy as np
import pytest

from planner.errors import LogFileError
from planner.logs.csv import NUMBERS, read_csv_mapping, units_of
from planner.logs.files import read_log
from planner.logs.record import Boundary, LogFormat

if TYPE_CHECKING:
    from pathlib import Path

    from planner.logs.record import FlightRecord

MAPPING = """
schema = 1
name = "logger"
vehicle = "test hexacopter"

[columns]
time_s = { column = "t", unit = "ms" }
height_above_home_m = { column = "alt", unit = "ft" }
climb_m_s = { column = "down", unit = "m/s", is_negated = true }
velocity_forward_m_s = { column = "fwd", unit = "km/h" }
velocity_right_m_s = { column = "right" }
wind_speed_m_s = { column = "ws" }
wind_from_deg = { column = "wd" }
voltage_v = { column = "mV", unit = "mV" }
current_a = { column = "I" }
mode = { column = "mode" }
is_armed = { column = "armed" }

[orientation]
columns = ["qw", "qx", "qy", "qz"]
axes = "flu-enu"
"""
HEADER = "t;alt;down;fwd;right;ws;wd;mV;I;mode;armed;qw;qx;qy;qz"


def _rows() -> list[str]:
    """Return the made flight heading east: the quaternion from east, north, up is the unit."""
    return [
        f"{moment.time_s * 1e3:.0f};{moment.height_m / 0.3048};{-moment.climb_m_s};"
        f"{moment.speed_m_s * 3.6};0;3;270;{made.VOLTAGE_V * 1e3};{moment.current_a};"
        f"{'AUTO' if moment.is_airborne else 'IDLE'};"
        f"{'true' if made.ARMED_S <= moment.time_s < made.DISARMED_S else 'false'};1;0;0;0"
        for moment in made.moments()
    ]


def _read(tmp_path: Path, rows: list[str], mapping: str = MAPPING) -> FlightRecord:
    (tmp_path / "map.toml").write_text(mapping, encoding="utf-8")
    log = tmp_path / "flight.csv"
    log.write_text("\n".join([HEADER, *rows]), encoding="utf-8")
    [record] = read_log(log, read_csv_mapping(tmp_path / "map.toml"))
    return record


def test_a_mapping_turns_columns_into_quantities(tmp_path: Path) -> None:
    record = _read(tmp_path, _rows())
    assert record.log_format is LogFormat.CSV
    assert record.vehicle == "test hexacopter"
    assert record.begins_with is Boundary.ARMING
    assert record.duration_s == pytest.approx(50.0, abs=1e-6)
    assert np.max(record.height_above_home_m) == pytest.approx(made.HEIGHT_M)
    assert np.max(record.climb_m_s) == pytest.approx(made.CLIMB_M_S)
    energy_j = np.trapezoid(record.power_w, record.time_s)
    assert energy_j == pytest.approx(made.ENERGY_J, abs=2 * 160.0 * 0.1)
    assert set(record.mode.tolist()) == {"IDLE", "AUTO"}


def test_velocities_along_the_body_are_turned_by_its_heading(tmp_path: Path) -> None:
    record = _read(tmp_path, _rows())
    assert record.yaw_deg == pytest.approx(90.0)
    assert np.max(record.velocity_east_m_s) == pytest.approx(made.CRUISE_M_S)
    assert record.velocity_north_m_s == pytest.approx(0.0, abs=1e-9)
    # The wind from the west moves the air eastwards: 3 m/s behind 5 m/s.
    assert record.wind_east_m_s == pytest.approx(3.0)
    cruising = record.ground_speed_m_s > 4.9
    assert record.airspeed_m_s[cruising] == pytest.approx(2.0)


def test_without_arming_the_power_tells_the_flight(tmp_path: Path) -> None:
    mapping = MAPPING.replace('is_armed = { column = "armed" }\n', "")
    record = _read(tmp_path, _rows(), mapping)
    assert (record.begins_with, record.ends_with) == (Boundary.POWER, Boundary.POWER)
    # The 90th percentile is 160 W; 15 % of it lies within the sampled step at either end.
    assert record.duration_s == pytest.approx(made.POWER_OFF_S - made.POWER_ON_S, abs=0.11)


def test_without_power_the_height_tells_the_flight(tmp_path: Path) -> None:
    kept = [line for line in MAPPING.splitlines() if not line.startswith(("current", "is_armed"))]
    record = _read(tmp_path, _rows(), "\n".join(kept))
    assert (record.begins_with, record.ends_with) == (Boundary.AIR, Boundary.AIR)
    # Half a metre is passed a quarter of a second behind take-off and before landing.
    assert record.duration_s == pytest.approx(made.LANDED_S - made.TAKEOFF_S - 0.5, abs=0.11)


def test_cells_that_are_no_numbers_are_unknown(tmp_path: Path) -> None:
    rows = _rows()
    rows[300:330] = [row.replace(";10.0;", ";n/a;") for row in rows[300:330]]
    record = _read(tmp_path, rows)
    inside = (record.time_s > 24.95) & (record.time_s < 27.85)
    assert np.all(np.isnan(record.current_a[inside]))
    assert np.all(np.isfinite(record.height_above_home_m))


def test_short_rows_are_counted(tmp_path: Path) -> None:
    rows = _rows()
    rows[100] = "10000;3"
    record = _read(tmp_path, rows)
    assert [finding.code for finding in record.findings] == ["R101"]
    assert "1 of 601 rows" in record.findings[0].message


def test_time_that_goes_back_cuts_the_log(tmp_path: Path) -> None:
    rows = _rows()
    (tmp_path / "map.toml").write_text(MAPPING, encoding="utf-8")
    (tmp_path / "flight.csv").write_text("\n".join([HEADER, *rows, *rows]), encoding="utf-8")
    first, second = read_log(tmp_path / "flight.csv", read_csv_mapping(tmp_path / "map.toml"))
    assert (first.number, second.number) == (1, 2)
    assert first.power_w == pytest.approx(second.power_w)


AIRDATA_HEADER = (
    "time(millisecond),latitude,longitude,height_above_takeoff(feet),"
    "altitude_above_seaLevel(feet),speed(mph), xSpeed(mph), ySpeed(mph), zSpeed(mph),"
    " compass_heading(degrees), pitch(degrees), roll(degrees),voltage(v),current(A),flycState"
)


def _airdata() -> str:
    lines = [AIRDATA_HEADER]
    for number, moment in enumerate(made.moments()):
        measured = made.moment(moment.time_s - (number % 11) / 10)
        volts = made.VOLTAGE_V + measured.time_s * 1e-3 if measured.time_s >= 1.1 else 0.0
        lines.append(
            f"{moment.time_s * 1e3:.0f},{moment.latitude_deg:.9f},8.0,{moment.height_m / 0.3048},"
            f"{(400 + moment.height_m) / 0.3048},{moment.speed_m_s / 0.44704},"
            f"{moment.speed_m_s / 0.44704},0,{-moment.climb_m_s / 0.44704},0,-4,1,"
            f"{volts},{measured.current_a},P-GPS"
        )
    return "\n".join(lines)


def test_an_airdata_export_is_recognised_zipped_or_not(tmp_path: Path) -> None:
    plain, zipped = tmp_path / "a.csv", tmp_path / "a.csv.gz"
    plain.write_text(_airdata(), encoding="utf-8")
    zipped.write_bytes(gzip.compress(_airdata().encode()))
    [record], [again] = read_log(plain), read_log(zipped)
    assert np.max(record.velocity_north_m_s) == pytest.approx(made.CRUISE_M_S)
    assert np.max(record.climb_m_s) == pytest.approx(made.CLIMB_M_S)
    assert np.max(record.height_above_home_m) == pytest.approx(made.HEIGHT_M)
    assert again.power_w == pytest.approx(record.power_w)
    assert again.sha256 != record.sha256


def test_a_value_repeated_until_the_next_measurement_counts_once(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(_airdata(), encoding="utf-8")
    [record] = read_log(tmp_path / "a.csv")
    assert record.quantity("voltage_v").rate_hz == pytest.approx(1 / 1.1)
    # Between measurements the voltage rises evenly, not in steps.
    assert np.diff(record.voltage_v[50:400]) == pytest.approx(1e-4, rel=1e-6)


def test_the_matrice_flights_are_turned_from_left_and_up(tmp_path: Path) -> None:
    header = (
        "time,wind_speed,wind_angle,battery_voltage,battery_current,position_x,position_y,"
        "position_z,orientation_x,orientation_y,orientation_z,orientation_w,velocity_x,velocity_y,"
        "velocity_z"
    )
    # Heading east and flying north: to the left.
    lines = [
        f"{moment.time_s},2.5,10,{made.VOLTAGE_V},{moment.current_a},8.0,"
        f"{moment.latitude_deg:.9f},{400 + moment.height_m},0,0,0,1,"
        f"0,{moment.speed_m_s},{moment.climb_m_s}"
        for moment in made.moments()
    ]
    (tmp_path / "m.csv").write_text("\n".join([header, *lines]), encoding="utf-8")
    [record] = read_log(tmp_path / "m.csv")
    assert record.vehicle == "DJI Matrice 100"
    assert record.yaw_deg == pytest.approx(90.0)
    assert np.max(record.velocity_north_m_s) == pytest.approx(made.CRUISE_M_S)
    assert np.ptp(record.north_m) == pytest.approx(made.DISTANCE_M, abs=0.05)
    assert record.airspeed_m_s == pytest.approx(2.5)


def test_unknown_columns_ask_for_a_mapping(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(LogFileError, match="name them with --mapping"):
        read_log(tmp_path / "x.csv")


def test_a_mapping_of_another_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text(MAPPING, encoding="utf-8")
    (tmp_path / "x.csv").write_text("t,alt\n1,2\n", encoding="utf-8")
    with pytest.raises(LogFileError, match="has no column 'I'"):
        read_log(tmp_path / "x.csv", read_csv_mapping(tmp_path / "map.toml"))


def test_a_zipped_log_that_breaks_off_gives_what_is_there(tmp_path: Path) -> None:
    whole = gzip.compress(_airdata().encode())
    (tmp_path / "a.csv.gz").write_bytes(whole[: len(whole) // 2])
    [record] = read_log(tmp_path / "a.csv.gz")
    assert "R101" in [finding.code for finding in record.findings]


def test_something_else_zipped_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.gz").write_bytes(gzip.compress(b"\xa3\x95\x80"))
    with pytest.raises(LogFileError, match="must be unpacked"):
        read_log(tmp_path / "a.gz")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("schema = 1", "schema = 2", "schema: must be 1"),
        ('"ms"', '"h"', "columns.time_s.unit: must be one of s, ms"),
        ("time_s", "times_s", "columns: must be a table with time_s"),
        ("climb_m_s", "climb_ms", "columns.climb_ms: is not known here; did you mean climb_m_s?"),
        ('wind_from_deg = { column = "wd" }\n', "", "columns.wind_speed_m_s: also needs wind_from"),
        ('{ column = "I" }', '"I"', "columns.current_a: must be a table"),
        ('{ column = "mode" }', '{ column = "mode", unit = "V" }', "none: leave it out"),
        ("is_negated = true", "negated = true", "columns.climb_m_s.negated: is not known here"),
        ('"flu-enu"', '"ned"', "orientation: must have columns"),
        ("[columns]", "[columns", "is not TOML"),
    ],
)
def test_a_wrong_mapping_is_refused_with_its_key(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    assert old in MAPPING
    (tmp_path / "map.toml").write_text(MAPPING.replace(old, new), encoding="utf-8")
    with pytest.raises(LogFileError) as refused:
        read_csv_mapping(tmp_path / "map.toml")
    assert told in str(refused.value)


def test_every_number_that_can_be_mapped_has_a_unit_of_its_own() -> None:
    for name in NUMBERS:
        assert next(iter(units_of(name).values())) == 1.0, name
