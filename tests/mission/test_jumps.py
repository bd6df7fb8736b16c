from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, jump, mission, north, takeoff, waypoint

from planner.autopilot import Autopilot, Target
from planner.findings import Severity
from planner.flight.pilot import habits_of
from planner.mission.route.order import MOST_VISITS, flown_order
from planner.mission.takers import BOTH
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.resolve import resolve_parameters

if TYPE_CHECKING:
    from planner.mission.items import MissionItem


def order(*items: MissionItem, dialect: Autopilot | None = None) -> tuple[int, ...]:
    return flown_order(mission(*items).items, dialect).visits


def test_without_jumps_items_are_flown_as_they_stand() -> None:
    assert order(takeoff(10), waypoint(5, 10), waypoint(9, 10)) == (1, 2, 3)


def test_a_jump_back_is_taken_as_often_as_it_says_and_then_passed() -> None:
    flown = order(takeoff(10), waypoint(5, 10), waypoint(9, 10), jump(2, 2), waypoint(1, 10))
    assert flown == (1, 2, 3, 4, 2, 3, 4, 2, 3, 4, 5)


def test_a_jump_forward_leaves_items_out() -> None:
    # Taken once, it is never met again; the item behind it stays unflown.
    assert order(takeoff(10), jump(4, 1), waypoint(5, 10), waypoint(9, 10)) == (1, 2, 4)


def test_an_inner_loop_is_not_started_anew_by_an_outer_one() -> None:
    # PX4 counts jumps for the whole mission, and ArduPilot until 4.6.
    items = (takeoff(10), waypoint(1, 10), jump(2, 1), waypoint(2, 10), jump(2, 1))
    assert order(*items, dialect=Autopilot.PX4) == (1, 2, 3, 2, 3, 4, 5, 2, 3, 4, 5)


CAMERA, SLOW, FENCE_OFF = (
    item(206, frame=2),
    item(178, frame=2, params=(1.0, 1.0, -1.0, 0.0)),
    item(207, frame=2),
)


@pytest.mark.parametrize("laps", [1, 2, 3])
def test_ardupilot_carries_out_what_stands_behind_a_jump_a_lap_early(laps: int) -> None:
    # ArduPilot #30376: "5 Jump 2/2, 2 WP, 6 AuxFunction !!!", and once more behind the loop.
    items = (takeoff(10), waypoint(5, 10), CAMERA, jump(2, laps), SLOW, FENCE_OFF, waypoint(9, 10))
    lap = (2, 3, 4)
    found = flown_order(mission(*items).items, Autopilot.ARDUPILOT, keeps_counts=True)
    early = (2, 3, 5, 6, 4)
    assert found.visits == (1, *lap * (laps - 1), *early, *lap, 5, 6, 7)
    warned = [f for f in found.findings if f.severity is Severity.WARNING]
    assert [(f.code, f.item) for f in warned] == [("T123", 5), ("T123", 6)]
    assert order(*items, dialect=Autopilot.PX4) == (1, *lap * (laps + 1), 5, 6, 7)
    # Of a text whose autopilot is unknown ArduPilot's order counts, and nobody knows that it does.
    unknown = flown_order(mission(*items).items, None, keeps_counts=True, able=frozenset(BOTH))
    assert unknown.visits == found.visits
    assert [(f.severity, f.item) for f in unknown.findings] == [
        (Severity.ERROR, 5),
        (Severity.ERROR, 6),
    ]
    assert all("name who flies it" in one.message for one in unknown.findings)
    # Where PX4 refuses the upload there is nobody to name.
    left = flown_order(
        mission(*items).items, None, keeps_counts=True, able=frozenset({Autopilot.ARDUPILOT})
    )
    assert left == found
    # So where PX4 is only what a model assumes.
    assumed = flown_order(
        mission(*items).items, Autopilot.PX4, keeps_counts=True, able=frozenset(BOTH)
    )
    assert assumed.visits == order(*items, dialect=Autopilot.PX4)
    assert assumed.findings == unknown.findings


def test_without_an_item_before_the_jump_what_stands_behind_it_waits_for_the_loop() -> None:
    items = (takeoff(10), waypoint(5, 10), jump(2, 1), SLOW, waypoint(9, 10))
    found = flown_order(mission(*items).items, Autopilot.ARDUPILOT)
    assert found.visits == (1, 2, 3, 2, 3, 4, 5)
    assert found.findings == ()


def test_ardupilot_carries_out_nothing_at_the_head_of_the_loop_in_the_last_lap() -> None:
    # It looks for the next item behind the last one, and there is a place.
    items = (takeoff(10), SLOW, waypoint(5, 10), CAMERA, jump(2, 2), waypoint(9, 10))
    found = flown_order(mission(*items).items, Autopilot.ARDUPILOT, keeps_counts=True)
    assert found.visits == (1, 2, 3, 4, 5, 2, 3, 4, 5, 3, 4, 5, 6)
    [said] = [f for f in found.findings if f.severity is Severity.WARNING]
    assert (said.code, said.item) == ("T123", 2)
    assert "not carried out on the way to item 3" in said.message


@pytest.mark.parametrize(
    ("items", "behind", "told"),
    [
        # The first DO_ before the jump is carried out; the look for the next, from the jump on, whose count
        # is 0 again, leads to its target (AP_Mission::get_next_cmd): what stands behind it is passed over.
        ((waypoint(5, 10), CAMERA, jump(2, 2), SLOW, waypoint(9, 10)), (3, 4, 6), [5]),
        ((SLOW, waypoint(5, 10), CAMERA, jump(2, 2), waypoint(9, 10)), (4, 2, 5, 6), [2]),
        ((CAMERA, waypoint(5, 10), CAMERA, jump(2, 2), waypoint(9, 10)), (4, 2, 5, 6), []),
        ((SLOW, waypoint(5, 10), jump(2, 2), FENCE_OFF, waypoint(9, 10)), (4, 5, 6), []),
        ((SLOW, waypoint(5, 10), CAMERA, jump(2, 0), FENCE_OFF, waypoint(9, 10)), (4, 5, 6, 7), []),
    ],
)
def test_behind_a_loop_that_counts_anew_the_look_for_items_leads_to_its_head(
    items: tuple[MissionItem, ...], behind: tuple[int, ...], told: list[int]
) -> None:
    whole = mission(takeoff(10), *items).items
    anew = flown_order(whole, Autopilot.ARDUPILOT, keeps_counts=False)
    assert anew.visits[-len(behind) :] == behind
    assert {f.severity for f in anew.findings} <= {Severity.WARNING}
    # Where the version is not known, what is of one of them alone is an error.
    unknown = flown_order(whole, Autopilot.ARDUPILOT)
    assert unknown.visits == anew.visits
    errors = [f.item for f in unknown.findings if f.severity is Severity.ERROR]
    assert errors == told


def test_an_inner_loop_is_flown_once_where_ardupilot_keeps_its_count() -> None:
    items = mission(takeoff(10), waypoint(1, 10), jump(2, 1), waypoint(2, 10), jump(2, 1)).items
    lap, outer = (2, 3), (4, 5)
    anew = flown_order(items, Autopilot.ARDUPILOT).visits
    assert anew == (1, *lap, *lap, *outer, *lap, *lap, *outer)
    kept = flown_order(items, Autopilot.ARDUPILOT, keeps_counts=True).visits
    assert kept == (1, *lap, *lap, *outer, *lap, *outer)


@pytest.mark.parametrize(
    ("text", "target", "keeps"),
    [
        ("MIS_OPTIONS,8\n", Target(Autopilot.ARDUPILOT), True),
        ("MIS_OPTIONS,4\n", Target(Autopilot.ARDUPILOT), None),
        ("WPNAV_SPEED,500\n", Target(Autopilot.ARDUPILOT, (4, 6)), True),
        ("WPNAV_SPEED,500\n", Target(Autopilot.ARDUPILOT, (4, 7)), False),
    ],
)
def test_copter_keeps_counts_before_4_7_or_where_it_is_told_to(
    text: str,
    target: Target,
    keeps: bool | None,  # noqa: FBT001 - a table of cases
) -> None:
    given = parameters_from_text(text.encode(), source="p.param")
    values = resolve_parameters(Autopilot.ARDUPILOT, file=given).values
    assert habits_of(values, target).keeps_counts is keeps


def test_ardupilot_carries_out_a_tag_as_it_does_any_other_item() -> None:
    # AP_Mission::start_command starts a JUMP_TAG too: it does what the camera does above.
    tag = item(600, frame=2, params=(70.0, 0.0, 0.0, 0.0))
    items = (takeoff(10), waypoint(5, 10), tag, jump(2, 1), SLOW, waypoint(9, 10))
    found = flown_order(mission(*items).items, Autopilot.ARDUPILOT, keeps_counts=True)
    assert found.visits == (1, 2, 3, 5, 4, 2, 3, 4, 5, 6)


def test_ardupilot_finds_an_item_by_way_of_a_second_jump() -> None:
    # 3 CAMERA, 4 taken for the last time; the search goes on at 5, not yet taken, and from there to 7; behind
    # the loop, both taken, it goes on to 6.
    items = (takeoff(10), waypoint(5, 10), CAMERA, jump(2, 1), jump(7, 1), SLOW, SLOW)
    whole = (*items, waypoint(9, 10))
    found = flown_order(mission(*whole).items, Autopilot.ARDUPILOT, keeps_counts=True)
    assert found.visits == (1, 2, 3, 7, 4, 2, 3, 6, 4, 5, 7, 8)
    assert [(f.code, f.item) for f in found.findings] == [("T123", 7), ("T123", 6)]


@pytest.mark.parametrize(("fast_m_s", "is_told"), [(2.0, True), (1.0, False)])
def test_items_of_a_loop_without_a_place_undo_each_other(fast_m_s: float, *, is_told: bool) -> None:
    # 2 is started; the count of 5 is run down on the way to the place and begins anew: the look for DO_ items
    # goes 4, 5, 4, 5 … for as long as the leg lasts.
    fast = item(178, frame=2, params=(1.0, fast_m_s, -1.0, 0.0))
    items = mission(takeoff(10), CAMERA, SLOW, fast, jump(3, 2), waypoint(900, 10)).items
    found = flown_order(items, Autopilot.ARDUPILOT, keeps_counts=False)
    errors = [f.item for f in found.findings if f.severity is Severity.ERROR]
    assert errors == ([3, 4] if is_told else [])
    if not is_told:
        assert found.visits[:4] == (1, 2, 3, 4)


@pytest.mark.parametrize(("here", "is_told"), [(1.0, True), (0.0, False)])
def test_a_home_that_a_loop_sets_again_is_the_same_unless_it_is_where_the_vehicle_is(
    here: float, *, is_told: bool
) -> None:
    home = item(179, north(50), 0.0, params=(here, 0.0, 0.0, 0.0))
    items = mission(takeoff(10), CAMERA, SLOW, home, jump(3, 2), waypoint(900, 10)).items
    found = flown_order(items, Autopilot.ARDUPILOT, keeps_counts=False)
    assert [f.item for f in found.findings if f.severity is Severity.ERROR] == [4] * is_told


def test_an_endless_jump_is_flown_once_round() -> None:
    found = flown_order(
        mission(takeoff(10), waypoint(5, 10), waypoint(9, 10), jump(2, -1), waypoint(1, 10)).items,
        None,
    )
    assert found.visits == (1, 2, 3, 4, 2, 3, 4)
    assert found.lap_start == 4
    assert found.lap_item == 4


def test_a_count_of_65535_is_minus_one_in_16_bits_and_endless() -> None:
    items = mission(takeoff(10), waypoint(5, 10), jump(2, 65_535)).items
    for dialect in (Autopilot.PX4, Autopilot.ARDUPILOT):
        assert flown_order(items, dialect).lap_item == 3


# ``jump.num_times`` is an int16_t, and AP_MISSION_JUMP_REPEAT_FOREVER -1: -2 is less than the 0 times it was
# taken, and 40,000 is kept as -25,536.
@pytest.mark.parametrize(
    ("count", "visits"),
    [(-2, (1, 2, 3, 4)), (0, (1, 2, 3, 4)), (40_000, (1, 2, 3, 4)), (1, (1, 2, 3, 2, 3, 4))],
)
def test_ardupilot_takes_no_jump_of_a_count_below_minus_one(
    count: int, visits: tuple[int, ...]
) -> None:
    items = mission(takeoff(10), waypoint(5, 10), jump(2, count), waypoint(9, 10)).items
    found = flown_order(items, Autopilot.ARDUPILOT, keeps_counts=True)
    assert found.visits == visits
    assert found.lap_item is None


@pytest.mark.parametrize(
    ("jumps", "problem"), [(jump(9, 1), "no item 9"), (jump(3, 1), "jumps to itself")]
)
def test_a_jump_to_nowhere_or_to_itself_is_a_finding_and_passed(
    jumps: MissionItem, problem: str
) -> None:
    found = flown_order(mission(takeoff(10), waypoint(5, 10), jumps, waypoint(9, 10)).items, None)
    assert found.visits == (1, 2, 3, 4)
    [finding] = found.findings
    assert finding.code == "M103"
    assert finding.item == 3
    assert problem in finding.message


def test_a_jump_tag_is_found_by_its_number_and_unknown_to_px4() -> None:
    items = mission(
        takeoff(10),
        item(600, params=(70.0, 0.0, 0.0, 0.0)),
        waypoint(5, 10),
        item(601, params=(70.0, 1.0, 0.0, 0.0)),
    ).items
    assert flown_order(items, Autopilot.ARDUPILOT).visits == (1, 2, 3, 4, 2, 3, 4)
    assert flown_order(items, Autopilot.PX4).visits == (1, 2, 3, 4)


def test_ids_of_the_file_count_not_positions() -> None:
    first, second = item(16, 47.0, 10.0, jump_id=640), item(16, 47.0, 20.0, jump_id=645)
    assert order(takeoff(10), first, second, jump(640, 1)) == (1, 2, 3, 4, 2, 3, 4)


def test_too_many_repeats_are_cut_and_said() -> None:
    found = flown_order(mission(takeoff(10), waypoint(5, 10), jump(2, 65_534)).items, None)
    assert len(found.visits) == MOST_VISITS + 3
    assert [f.code for f in found.findings] == ["T106"]


def test_jumps_that_lead_in_a_circle_without_an_item_between_end() -> None:
    found = flown_order(mission(takeoff(10), jump(3, -1), jump(2, -1)).items, None)
    assert found.lap_item == 3


def test_a_loop_in_a_loop_starts_again_on_ardupilot_alone() -> None:
    # Flown by ArduCopter 4.7.0-dev: 2, 3 twice more, and the same in the second lap of the outer loop.
    items = mission(takeoff(10), waypoint(5, 10), waypoint(9, 10), jump(2, 2), jump(2, 1)).items
    inner = (2, 3, 4)
    assert flown_order(items, Autopilot.ARDUPILOT).visits == (1, *inner * 3, 5, *inner * 3, 5)
    assert flown_order(items, Autopilot.PX4).visits == (1, *inner * 3, 5, *inner, 5)
