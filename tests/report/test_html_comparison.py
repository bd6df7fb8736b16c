"""Two results side by side on the page."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest

from planner.report.html.comparison import compared_tables, comparison_section
from planner.report.html.page import check_html
from planner.values import replace

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult, UnreadableMission


@pytest.fixture
def longer(flown: CheckResult) -> CheckResult:
    """The same flight, a minute longer and 2 Wh more."""
    totals = replace(
        flown.totals, time_s=flown.totals.time_s + 60.0, energy_wh=flown.totals.energy_wh + 2.0
    )
    return replace(flown, file="<b>longer.plan", totals=totals)


def test_differences_are_the_second_less_the_first(flown: CheckResult, longer: CheckResult) -> None:
    tables = {
        title: {row.label: row for row in rows} for title, rows in compared_tables(flown, longer)
    }
    time, energy = tables["Flight"]["Time"], tables["Energy"]["Energy"]
    assert (time.first, time.second, time.difference) == (
        "11 min 32 s",
        "12 min 32 s",
        "+1 min 00 s",
    )
    assert (energy.first, energy.second, energy.difference) == ("24.1 Wh", "26.1 Wh", "+2.00 Wh")
    assert tables["Flight"]["Distance"].difference == "0 m"
    assert list(tables["Energy by state"]) == ["takeoff", "cruise", "land", "total"]


def test_an_item_has_no_difference(flown: CheckResult, longer: CheckResult) -> None:
    tables = dict(compared_tables(flown, longer))
    [tightest] = [row for row in tables["Return"] if row.label == "Tightest from"]
    assert (tightest.first, tightest.difference, tightest.value) == ("item 2", "", None)


def test_a_section_stands_on_the_page_with_its_text_escaped(
    flown: CheckResult, longer: CheckResult
) -> None:
    section = comparison_section(flown, longer, options=("", "--wind 8@270"))
    assert "wind 5.0 m/s from 270°" in section
    assert "<code>--wind 8@270</code>" in section
    made_at = datetime(2026, 1, 2, tzinfo=UTC)
    page = check_html([flown, longer], version="1", made_at=made_at, sections=[section])
    assert "The difference is B less A." in page
    assert "<b>longer" not in page
    assert page.index('id="overview"') < page.index("B less A")


def test_states_have_times_and_what_one_alone_has_is_named(
    flown: CheckResult, longer: CheckResult
) -> None:
    tables = dict(compared_tables(flown, longer))
    [*states, total] = tables["Time by state"]
    times_s = [row.values[0] or 0.0 for row in states]
    assert sum(times_s) == pytest.approx(692.4, abs=1e-6)
    assert total.difference == "+1 min 00 s"
    gone = replace(longer, findings=())
    section = comparison_section(flown, gone)
    code = flown.findings[0].code
    assert "Found in A only" in section
    assert f"<code>{code}</code>" in section[section.index("Found in A only") :]
    assert "Found in B only" not in section


def test_what_cannot_be_read_has_nothing_to_compare(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    tables = dict(compared_tables(flown, unreadable))
    assert all(row.second == "—" and not row.difference for row in tables["Flight"])


def test_a_chance_that_stays_as_small_differs_by_nothing(flown: CheckResult) -> None:
    assert flown.battery is not None
    battery = replace(flown.battery, below_reserve_probability=0.0)
    more = replace(battery, below_reserve_probability=0.0004)
    results = [replace(flown, battery=one) for one in (battery, battery, more)]
    for other, said in ((results[1], "0 %"), (results[2], "< 0.1 %")):
        tables = dict(compared_tables(results[0], other))
        [row] = [row for row in tables["Battery"] if row.label == "Chance of landing below it"]
        assert (row.first, row.difference) == ("< 0.1 %", said)


def test_charge_that_is_overdrawn_differs_by_what_was_left(flown: CheckResult) -> None:
    assert flown.battery is not None
    left, overdrawn = (
        replace(flown, battery=replace(flown.battery, charge_left_fraction=fraction))
        for fraction in (0.65, -0.83)
    )
    tables = dict(compared_tables(left, overdrawn))
    [row] = [row for row in tables["Battery"] if row.label == "Charge left"]
    assert (row.first, row.second, row.difference) == ("65 %", "0 %", "-65 %")


def test_a_page_with_a_title_has_no_overview_and_names_its_missions(
    flown: CheckResult, longer: CheckResult
) -> None:
    page = check_html(
        [flown, longer],
        version="1",
        made_at=datetime(2026, 1, 2, tzinfo=UTC),
        sections=[comparison_section(flown, longer)],
        title="Two checks",
        names=("A", "B"),
    )
    assert 'id="overview"' not in page
    assert "<h1>Two checks</h1>" in page
    assert page.index("<h2>A: ") < page.index("<h2>B: ")
