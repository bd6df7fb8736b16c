"""The page as text: whole in itself, escaped, small."""

from __future__ import annotations

import json
import re
import sys
from datetime import UTC, datetime

import pytest
from fenced_missions import at
from made_missions import mission, rtl, takeoff

from planner import __version__, quantity
from planner.errors import UsageError
from planner.report.html.page import check_html, plotting_bundle
from planner.service.preflight import CheckResult, UnreadableMission, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

MADE_AT = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)


def page_of(*results: CheckResult | UnreadableMission) -> str:
    return check_html(results, version=__version__, made_at=MADE_AT, sha256={"site.plan": "5e1f"})


def test_the_verdict_stands_in_words_before_everything_else(flown: CheckResult) -> None:
    page = page_of(flown)
    body = page[page.index("<body>") :]
    assert body.index(" GO</span>") < body.index("Findings")
    assert "✓" in body


def test_the_page_tells_version_day_and_hash(flown: CheckResult) -> None:
    page = page_of(flown)
    assert f"mavjoule {__version__} on <time>2026-01-02 03:04 UTC</time>" in page
    assert "5e1f" in page


def test_every_finding_is_there_with_its_fix_and_its_explanation(flown: CheckResult) -> None:
    page = page_of(flown)
    for finding in flown.findings:
        assert f'data-code="{finding.code}"' in page
        assert f"About {finding.code}" in page
    assert "mavjoule.toml" in page, "how to turn a rule off"


def test_no_figure_of_a_data_sheet_is_without_a_label_and_no_charge_is_below_none() -> None:
    """4 km out and back at hover power takes far more than 5 Wh."""
    vehicle = load_vehicle("holybro-x500-v2")
    flown = check(
        mission(takeoff(20.0), at(0.0, 4000.0), rtl()), vehicle, battery=Battery(capacity_wh=5.0)
    )
    assert flown.battery is not None
    page = page_of(flown)
    assert "empty_probability</th>" not in page
    assert "<caption>More</caption>" not in page
    assert (quantity.charge_left(-1.73), quantity.charge_left(0.04)) == ("0 %", "4 %")
    assert quantity.charge_left(None) == quantity.ABSENT


def test_a_page_without_a_picture_does_not_carry_the_plotting_library(
    flown: CheckResult, unreadable: UnreadableMission
) -> None:
    page = page_of(flown, unreadable)
    assert len(page) < 100_000
    assert "vegaEmbed = " not in page


def test_nothing_is_fetched_from_anywhere(flown: CheckResult) -> None:
    page = page_of(flown)
    assert re.findall(r"""(?:src|href)=["'](?!#)""", page) == []
    assert "default-src &#39;none&#39;" in page


def test_what_a_file_says_is_escaped(unreadable: UnreadableMission) -> None:
    evil = "</script><script>alert(1)</script>\x1b[31m\ud800.plan"
    found = replace(unreadable.findings[0], message=evil, fix=evil)
    page = page_of(replace(unreadable, file=evil, findings=(found,)))
    assert "<script>alert" not in page
    assert "\x1b" not in page
    page.encode("utf-8")


def test_a_survey_of_a_thousand_items_is_small_enough_to_mail() -> None:
    lines = [
        place
        for number in range(500)
        for place in (at(0, 5.0 * number), at(200, 5.0 * number))[:: 1 if number % 2 else -1]
    ]
    result = check(
        mission(takeoff(20), *lines, rtl()),
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=77.0),
    )
    assert len(result.segments) > 2_000
    own = page_of(result).replace(plotting_bundle(), "")
    assert len(own.encode("utf-8")) < 3_000_000


def test_data_of_the_page_is_json_that_cannot_end_its_element(flown: CheckResult) -> None:
    page = page_of(flown)
    found = re.findall(r'<script type="application/json" id="([a-z0-9-]+)">(.*?)</script>', page)
    assert [name for name, _ in found] == ["config", "payload-0"]
    for _, text in found:
        assert "<" not in text
        json.loads(text)


@pytest.mark.parametrize("library", ["altair", "jinja2", "vl_convert"])
def test_missing_libraries_are_told_in_a_sentence(
    flown: CheckResult, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    monkeypatch.setitem(sys.modules, library, None)  # an import of it fails
    with pytest.raises(UsageError, match=r"mavjoule\[report\]"):
        page_of(flown)
