"""What no log holds, from a table of the logs: strict reading, and what each flight is taken with."""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_record import make_record

from planner.errors import LogFileError, UsageError
from planner.identify.assembly import IdentificationSettings
from planner.identify.battery import PackSettings, capacity_of_levels, identify_battery
from planner.identify.log_table import LogConditions, LogTable, read_log_table
from planner.identify.power import power_of_manoeuvres
from planner.identify.segments import MeasuredPower
from planner.physics.rotor import Rotor, momentum_power_w
from planner.values import replace
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from pathlib import Path


def table(folder: Path, text: str) -> LogTable:
    path = folder / "logs.csv"
    path.write_text(text, encoding="utf-8")
    return read_log_table(path)


def test_a_column_may_be_in_any_unit_of_its_kind(tmp_path: Path) -> None:
    [one, other] = table(
        tmp_path,
        "log,payload_g,mass_lb,temperature_f,battery,level_start_fraction,level_end_percent,notes\n"
        '1.csv,250,2,50,A,0.9,70,"windy, late"\n'
        "2.csv,,,,,,,\n",
    ).rows
    assert one.payload_kg == pytest.approx(0.25)
    assert one.mass_kg == pytest.approx(0.90718474)
    assert one.temperature_c == pytest.approx(10.0)  # (50 - 32) * 5 / 9
    assert (one.battery, one.level_start_percent, one.level_end_percent) == ("A", 90.0, 70.0)
    assert other == LogConditions(log="2.csv")


@pytest.mark.parametrize("mark", [";", "\t"])
def test_columns_may_be_separated_as_a_spreadsheet_does(tmp_path: Path, mark: str) -> None:
    text = "log,payload_g,notes\n1.csv,250,windy\n".replace(",", mark)
    assert table(tmp_path, text).rows == (
        LogConditions(log="1.csv", payload_kg=0.25, notes="windy"),
    )


@pytest.mark.parametrize(
    ("text", "where"),
    [
        (
            "log,payload_gk\n",
            r":1:5: column 'payload_gk' is not known here; did you mean payload_g",
        ),
        ("log,payload\n", r":1:5: column 'payload' is not known here"),
        ("log,x\n", r":1:5: column 'x' is not known here: known are log, payload_kg, mass_kg, "),
        ("log,payload_kg,payload_g\n", r":1:16: column 'payload_g' gives payload_kg a second time"),
        ("payload_kg\n0\n", r":1:1: needs a column log"),
        ("", r":1:1: needs a column log"),
        ("log,payload_kg\na,1\nb,x\n", r":3:3: payload_kg: expected a number"),
        ("log,payload_kg\na,nan\n", r":2:3: payload_kg: expected a number"),
        ("log,payload_kg\na,1e999\n", r":2:3: payload_kg: must be a number"),
        ("log,payload_g\na,-1\n", r":2:3: payload_g: must not be below 0"),
        ("log,mass_kg\na,0\n", r":2:3: mass_kg: must be greater than 0"),
        ("log,payload_kg\na,0,4\n", r":2:1: has 3 columns, the heads are 2"),
        ("log,payload_kg\n,0\n", r":2:1: names no log"),
        ("log,level_start_percent\na,90\n", r":2:3: level_start_percent: .* without each other"),
        (
            "log,level_start_percent,level_end_percent\na,70,90\n",
            r":2:6: level_end_percent: must be lower",
        ),
        ("log\na\na\n", r": log: has two rows for a"),
        ('log\n"a\n', r":2:1: is not CSV"),
    ],
)
def test_what_cannot_be_is_refused_with_its_line_and_column(
    tmp_path: Path, text: str, where: str
) -> None:
    with pytest.raises(LogFileError, match=rf"logs\.csv{where}"):
        table(tmp_path, text)


def settings(**known: Any) -> IdentificationSettings:  # noqa: ANN401 - fields
    return IdentificationSettings(name="m", date=dt.date(2026, 1, 1), version="0", **known)


def test_a_row_goes_before_what_is_said_of_all(tmp_path: Path) -> None:
    known = table(tmp_path, "log,payload_kg,mass_kg\nb/1.csv,0.5,\n2.csv,,2.4\n3.csv,,2.0\n")
    of_all = LogConditions(payload_kg=0.1, temperature_c=5.0)
    of = settings(logs=replace(known, of_all=of_all))
    record = make_record(is_landed=np.zeros(10, dtype=np.bool_))
    one = of.conditions_of(replace(record, source="/a/b/1.csv"))
    # the mass of all is the median of those given
    assert (one.payload_kg, one.mass_kg, one.temperature_c) == (0.5, 2.2, 5.0)
    assert of.flown_mass_kg(replace(record, source="2.csv")) == pytest.approx(2.5)
    with pytest.raises(UsageError, match=r"no row for /c/1\.csv"):
        of.conditions_of(replace(record, source="/c/1.csv"))


def test_what_is_named_for_one_log_goes_before_the_table_and_that_before_all(
    tmp_path: Path,
) -> None:
    rows = table(tmp_path, "log,payload_kg,temperature_c\n1.csv,0.5,10\n2.csv,,\n")
    known = replace(
        rows,
        named=(LogConditions(log="1.csv", payload_kg=0.7),),
        of_all=LogConditions(payload_kg=0.2, mass_kg=2.0),
    )
    one, two = known.of("a/1.csv"), known.of("a/2.csv")
    assert (one.payload_kg, one.temperature_c, one.mass_kg) == (0.7, 10.0, 2.0)
    assert (two.payload_kg, two.temperature_c, two.mass_kg) == (0.2, None, 2.0)


def test_what_is_named_for_a_log_that_is_not_given_is_refused() -> None:
    known = LogTable(named=(LogConditions(log="flihgt.bin", payload_kg=0.7),))
    with pytest.raises(UsageError, match=r"flihgt\.bin is none of the logs.*flight\.bin"):
        known.refuse_strangers(["flight.bin"])
    known.refuse_strangers(["b/flihgt.bin"])


LAW = Rotor(0.3, 0.03, 1.4, 1.3, 0.35, 0.6)


def test_flights_of_different_payloads_are_fitted_each_with_its_own() -> None:
    flights = [
        [
            MeasuredPower(
                power_w=float(momentum_power_w(v, w, LAW, mass_kg=mass_kg, air_density_kg_m3=1.2)),
                error_w=1.0,
                duration_s=30.0,
                height_above_home_m=50.0,
                airspeed_m_s=v,
                climb_rate_m_s=w,
                air_density_kg_m3=1.2,
                mass_kg=mass_kg,
                source=f"{mass_kg}#1",
            )
            for v, w in ((4.0, 0.0), (8.0, 0.0), (12.0, 0.0), (1.0, 3.0))
        ]
        for mass_kg in (3.7, 3.95, 4.2)
    ]
    power, used = power_of_manoeuvres(flights, 0.0)
    assert isinstance(power.cruise, MomentumLaw)
    assert power.steady_map is not None
    assert max(abs(power.steady_map.residuals_w(used))) < 0.01 * 500.0
    unknown = [[replace(p, mass_kg=None) for p in flight] for flight in flights]
    assert not isinstance(power_of_manoeuvres(unknown, 0.0)[0].cruise, MomentumLaw)


def test_the_capacity_is_that_of_the_levels_whatever_is_drawn_outside_the_logs() -> None:
    charges = [0.5, 0.8, 1.0, 1.3, 1.6, 2.0]
    drops = [0.03 + ah / 5.0 for ah in charges]  # 3 % before and after each log
    found = capacity_of_levels([*drops, 0.9], [*charges, 1.1])  # one was noted wrongly
    assert found is not None
    assert found.value == pytest.approx(5.0, rel=0.02)
    assert capacity_of_levels(drops[:4], charges[:4]) is None
    assert capacity_of_levels([0.3] * 6, charges) is None


def test_levels_say_what_is_left_of_a_battery() -> None:
    # 10 A and 20 A in turn from a pack of 4 Ah that was 5 Ah when new, for one to six minutes
    records, rows = [], []
    for minutes in range(1, 7):
        samples = 600 * minutes
        current = np.where(np.arange(samples) % 100 < 50, 10.0, 20.0)
        drawn = 15.0 * minutes / 60.0 / 4.0
        record = make_record(
            is_landed=np.zeros(samples, dtype=np.bool_),
            current_a=current,
            voltage_v=16.0 - 0.05 * current,
        )
        records.append(replace(record, source=f"{minutes}.csv"))
        rows.append(
            LogConditions(
                log=f"{minutes}.csv",
                battery="A",
                level_start_percent=90.0,
                level_end_percent=90.0 - 100.0 * drawn,
            )
        )
    found = identify_battery(records, PackSettings(capacity_ah=5.0), rows)
    assert found.battery is not None
    assert found.battery.capacity_ah == 5.0
    assert found.battery.health == pytest.approx(0.8, abs=0.005)
    names = [estimate.name for estimate in found.outcome.estimates]
    assert names[-2:] == ["capacity_ah", "capacity_ah of A"]
    unknown = identify_battery(records, PackSettings(), rows)
    assert unknown.battery is not None
    assert unknown.battery.capacity_ah == pytest.approx(4.0, abs=0.02)
    assert unknown.battery.health is None
