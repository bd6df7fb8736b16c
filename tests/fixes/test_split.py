"""Splitting: the parts fly everything the whole does, each within its budget."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from flown_cover import deeds, is_covered, samples
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, jump, mission, north, rtl, speed, takeoff, waypoint
from qgc_rules import refuse_plan

import planner
from planner.autopilot import Autopilot
from planner.errors import OutputError, SplitError, UsageError
from planner.fixes.split import Split, split_mission, write_split
from planner.geo.fence import Fence, FenceCircle, RallyPoint
from planner.mission.plan import read_plan_text
from planner.physics.wind import Wind
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import Mission, MissionItem

ARTICLE = planner.load_vehicle("falkowski-2023-quadrotor")
SURVEYOR = planner.load_vehicle("arducopter-sitl-quad")
STAGGER_DEG = 0.0004


def trigger(distance_m: float) -> MissionItem:
    return item(206, params=(distance_m, 0.0, 1.0, 0.0), frame=2)


def survey(
    lines: int, length_m: float, *, frame: int = 3, spacing_m: float = 20.0, south_m: float = 100.0
) -> Mission:
    """Lines north and south, the camera on along them."""
    items = [takeoff(40.0), speed(9.0)]
    for line in range(lines):
        ends = (south_m, south_m + length_m)[:: 1 if line % 2 == 0 else -1]
        altitude_m = 450.0 if frame == 0 else 50.0
        for number, metres in enumerate(ends):
            where = 8.0 + STAGGER_DEG * line
            items.append(item(16, north(metres), altitude_m, longitude_deg=where, frame=frame))
            items.append(trigger(spacing_m if number == 0 else 0.0))
    return mission(*items, rtl())


def check_cover(whole: Mission, split: Split) -> None:
    """Every metre of every leg with its state, and everything done once, is in some part."""
    parts = [read_plan_text(part.text, source=part.file) for part in split.parts]
    flown = [one for part in parts for one in samples(part, every_m=1.0)]
    for wanted in samples(whole, every_m=25.0):
        # 1 m between samples, and the local frame against a plain one
        assert is_covered(wanted, flown, within_m=1.5), wanted
    done = [one for part in parts for one in deeds(part)]
    for deed in deeds(whole):
        assert deed in done
    for part, text in zip(split.parts, (one.text for one in split.parts), strict=True):
        assert part.result.verdict == "go"
        refuse_plan(text)


def test_a_survey_is_flown_in_parts_that_cover_it() -> None:
    whole = survey(12, 1200.0)
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=70.0), reserve=0.25)
    assert split.whole.verdict == "no-go"
    assert len(split.parts) >= 2
    check_cover(whole, split)
    for part in split.parts:
        assert part.result.battery is not None
        assert part.result.battery.margin_wh >= 0.0
        assert part.result.way_home is not None
        assert (part.result.way_home.margin_wh or 0.0) >= 0.0


def test_a_line_too_long_for_a_battery_is_cut_with_an_overlap_of_a_photo_and_ten_metres() -> None:
    whole = survey(2, 2500.0, spacing_m=30.0, south_m=-1250.0)
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=45.0))
    cut = [part for part in split.parts if part.begins_m is not None]
    assert cut
    for part in cut:
        assert part.flown_twice_m == pytest.approx(30.0 + 10.0, abs=0.01)
    check_cover(whole, split)


def test_the_camera_is_off_on_the_way_home_and_on_again_where_the_next_part_begins() -> None:
    whole = survey(2, 2500.0, south_m=-1250.0)
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=45.0))
    first, second, *_ = (read_plan_text(part.text, source=part.file) for part in split.parts)
    *_, off, home = first.items
    assert (off.command, off.param1, home.command) == (206, 0.0, 20)
    out = [one for one in second.items if one.command in {16, 206, 178, 22}]
    assert [one.command for one in out[:4]] == [22, 178, 16, 206]
    assert (out[1].param2, out[3].param1) == (9.0, 20.0)


def test_heights_keep_their_reference_and_the_way_out_is_level_at_the_higher_of_both() -> None:
    whole = survey(2, 2500.0, frame=0, south_m=-1250.0)
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=45.0))
    later = read_plan_text(split.parts[1].text, source="part-02.plan")
    start, _, place = [one for one in later.items if one.command in {22, 16, 178}][:3]
    assert (start.frame, place.frame) == (3, 0)
    assert start.altitude_m == pytest.approx(50.0, abs=1e-6)
    assert place.altitude_m == pytest.approx(450.0, abs=1e-6)


def test_a_lower_place_is_reached_from_above() -> None:
    low = mission(
        takeoff(80.0), waypoint(3000.0, 30.0), waypoint(0.0, 30.0), waypoint(3000.0, 30.0), rtl()
    )
    split = split_mission(low, SURVEYOR, battery=Battery(capacity_wh=90.0))
    later = read_plan_text(split.parts[1].text, source="part-02.plan")
    above, place = [one for one in later.items if one.command == 16][:2]
    assert (above.latitude_deg, above.longitude_deg) == (place.latitude_deg, place.longitude_deg)
    assert above.altitude_m == pytest.approx(80.0)
    assert place.altitude_m == pytest.approx(30.0)


def test_loops_are_written_out_and_said_to_be() -> None:
    whole = mission(
        takeoff(40.0), waypoint(900.0, 40.0), waypoint(100.0, 40.0), jump(2, 5.0), rtl()
    )
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=50.0))
    assert len(split.parts) > 1
    assert "L209" in {one.code for one in split.findings}
    check_cover(whole, split)
    for part in split.parts:
        assert 177 not in {one.command for one in read_plan_text(part.text, source="").items}


def test_fence_rally_points_and_home_are_kept_in_every_part() -> None:
    fence = Fence(
        circles=(FenceCircle(inclusion=True, latitude_deg=47.0, longitude_deg=8.0, radius_m=5e3),)
    )
    rally = (RallyPoint(latitude_deg=47.001, longitude_deg=8.0, height_above_home_m=30.0),)
    whole = replace(survey(8, 1200.0), fence=fence, rally=rally)
    for part in split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=70.0)).parts:
        read = read_plan_text(part.text, source=part.file)
        assert read.fence is not None
        assert [replace(one, place=None) for one in read.fence.circles] == list(fence.circles)
        assert [replace(one, place=None) for one in read.rally] == list(rally)
        assert read.home == whole.home


def test_what_fits_stays_one_part_with_the_items_it_has() -> None:
    whole = survey(2, 300.0)
    [part] = split_mission(whole, SURVEYOR).parts
    read = read_plan_text(part.text, source=part.file)
    assert [replace(one, place=None) for one in read.items] == list(whole.items)


def test_cut_lines_save_parts_and_are_left_whole_where_they_do_not() -> None:
    # 4 lines of 1500 m: whole lines fit, two by two
    split = split_mission(survey(4, 700.0), SURVEYOR, battery=Battery(capacity_wh=50.0))
    assert all(part.begins_m is None and part.ends_m is None for part in split.parts)


def test_outputs_are_set_again_and_the_pilot_is_told() -> None:
    pump = item(181, params=(0.0, 1.0, 0.0, 0.0), frame=2)
    whole = mission(
        takeoff(40.0),
        waypoint(100.0, 40.0),
        pump,
        waypoint(2000.0, 40.0),
        waypoint(100.0, 40.0),
        waypoint(2000.0, 40.0),
        rtl(),
    )
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=60.0))
    [told] = [one for one in split.findings if one.code == "L212"]
    assert told.item == 3
    check_cover(whole, split)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (
            mission(takeoff(40.0), waypoint(9000.0, 40.0), waypoint(0.0, 40.0), rtl()),
            "item 2 is a go",
        ),
        (mission(takeoff(40.0), waypoint(900.0, 40.0), jump(2, -1.0)), "T101|jumps back for ever"),
        (
            mission(
                takeoff(40.0),
                waypoint(900.0, 40.0),
                item(179, north(50.0), 0.0),
                waypoint(0.0, 40.0),
                rtl(),
            ),
            "DO_SET_HOME moves home",
        ),
        (
            mission(takeoff(40.0), waypoint(900.0, 40.0), waypoint(0.0, 40.0), rtl(), home=None),
            "where home is",
        ),
    ],
)
def test_what_cannot_be_split_is_a_sentence(made: Mission, said: str) -> None:
    with pytest.raises(SplitError, match=said):
        split_mission(made, SURVEYOR, battery=Battery(capacity_wh=40.0))


def test_what_is_wrong_besides_energy_is_not_mended_and_said() -> None:
    with pytest.raises(SplitError, match="splitting does not mend E100"):
        split_mission(survey(2, 300.0), ARTICLE)


def test_all_parts_are_written_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    split = split_mission(survey(8, 1200.0), SURVEYOR, battery=Battery(capacity_wh=70.0))
    assert len(split.parts) > 1
    write_split(split, tmp_path)
    assert len(list(tmp_path.iterdir())) == len(split.parts)
    with pytest.raises(UsageError, match="--force"):
        write_split(split, tmp_path)
    write_split(split, tmp_path, force=True)
    (tmp_path / "part-50.plan").write_text("{}", encoding="utf-8")
    with pytest.raises(UsageError, match="left from another split"):
        write_split(split, tmp_path, force=True)

    def fails(path: Path, text: str) -> None:
        if path.name != "part-01.plan":
            msg = "no room"
            raise OutputError(msg)
        path.write_text(text, encoding="utf-8")

    monkeypatch.setattr("planner.fixes.split.write_output_file", fails)
    empty = tmp_path / "empty"
    with pytest.raises(OutputError, match="no room"):
        write_split(split, empty)
    assert list(empty.iterdir()) == []


PLACES = st.integers(1, 30).map(lambda tens: 100.0 * tens)


def bodies() -> st.SearchStrategy[list[MissionItem]]:
    one = st.one_of(
        st.builds(waypoint, PLACES, st.sampled_from([30.0, 60.0])),
        st.builds(waypoint, PLACES, st.just(45.0), hold_s=st.just(10.0)),
        st.builds(trigger, st.sampled_from([0.0, 15.0, 40.0])),
        st.builds(speed, st.sampled_from([5.0, 9.0, 12.0])),
        st.builds(lambda place: item(201, north(place), 0.0), PLACES),
        st.just(item(197, params=(0.0, 0.0, 0.0, 0.0), frame=2)),
        st.just(item(203, params=(1.0, 0.0, 0.0, 0.0), frame=2)),
        st.builds(
            lambda angle: item(205, params=(angle, 0.0, 0.0, 0.0), frame=2),
            st.sampled_from([-90.0, -45.0]),
        ),
        st.builds(
            lambda on: item(181, params=(0.0, on, 0.0, 0.0), frame=2), st.sampled_from([0.0, 1.0])
        ),
    )
    return st.lists(one, min_size=3, max_size=14)


@given(body=bodies(), ends=st.booleans(), autopilot=st.sampled_from([None, Autopilot.ARDUPILOT]))
@settings(max_examples=20, deadline=None)
def test_the_parts_of_any_mission_fly_all_of_it(
    body: list[MissionItem], autopilot: Autopilot | None, *, ends: bool
) -> None:
    whole = replace(
        mission(takeoff(40.0), waypoint(200.0, 40.0), *body, *([rtl()] if ends else [])),
        autopilot=autopilot,
    )
    result = planner.check(whole, SURVEYOR)
    # twice as much as the farthest place and back needs, and less than the whole
    farthest = max(one.latitude_deg or 0.0 for one in whole.items if one.command == 16)
    out_and_back = mission(takeoff(60.0), item(16, farthest, 60.0), rtl())
    alone = planner.check(out_and_back, SURVEYOR).totals.energy_wh
    enough_wh = max(1.6 * alone, 0.5 * result.totals.energy_wh) / 0.8
    split = split_mission(whole, SURVEYOR, battery=Battery(capacity_wh=enough_wh))
    check_cover(whole, split)
    assert math.fsum(part.result.totals.energy_wh for part in split.parts) > 0.0


def test_more_flights_than_have_names_are_refused_at_once() -> None:
    with pytest.raises(SplitError, match="takes more than 99 flights"):
        split_mission(survey(60, 3000.0), SURVEYOR, battery=Battery(capacity_wh=10.0))


def test_each_part_is_as_long_as_fits_however_far_off_the_first_guess_is() -> None:
    # A head wind on the way out of later parts is none on their way home, by which it is forecast.
    out_and_back = [*range(1, 20), *range(20, 1, -1)]
    places = [waypoint(100.0 * n, 40.0) for n in 3 * out_and_back]
    whole = mission(takeoff(40.0), *places, rtl())
    wind = Wind(speed_m_s=4.0, from_deg=0.0)
    battery = Battery(capacity_wh=75.0)
    split = split_mission(whole, SURVEYOR, battery=battery, wind=wind)
    assert len(split.parts) > 1
    assert all(part.ends_m is None for part in split.parts)
    for part in split.parts[:-1]:
        items = list(read_plan_text(part.text, source="").items)
        *flown, home = items
        assert home.command == 20
        longer = replace(whole, items=(*flown, places[part.last_item - 1], home))
        result = planner.check(longer, SURVEYOR, battery=battery, wind=wind)
        assert result.verdict == "no-go"


def test_a_long_search_says_how_far_it_is() -> None:
    said: list[str] = []
    split = split_mission(
        survey(8, 1200.0), SURVEYOR, battery=Battery(capacity_wh=70.0), on_step=said.append
    )
    assert said[0].startswith("cutting between items: 1 part, up to item")
    assert len(said) >= len(split.parts) - 1
