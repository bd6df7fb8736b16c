"""Pictures of a flight: what is drawn is what the result says, with units, on light and dark."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from fenced_missions import at, box, degrees
from made_missions import HOME, METRES_PER_DEGREE_NORTH, item, mission, rtl, takeoff

from planner.autopilot import Autopilot
from planner.errors import OutputError, UsageError
from planner.geo.fence import Fence
from planner.geo.terrain import TerrainGrid, TerrainTile
from planner.physics.wind import Wind
from planner.report import plots
from planner.report.html.mission import page_charts
from planner.report.plots.flight import limit_rows, tightest_row
from planner.report.plots.picture_files import STATE_COLOURS, chart_config
from planner.report.tables import MOST_ROWS, make_tables
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import MissionItem
    from planner.report.plots.picture_files import Scheme

OUT = (takeoff(20), at(0, 300), at(300, 300), rtl())
CLOSE = Fence(polygons=(box(-400, -400, 305, 400),))


def checked(
    *items: MissionItem, fence: Fence | None = None, vehicle: str = "falkowski-2023-quadrotor"
) -> CheckResult:
    """Return the check of items about home, with a battery of 77 Wh and some wind."""
    return check(
        replace(mission(*items), fence=fence),
        load_vehicle(vehicle),
        battery=Battery(capacity_wh=77.0),
        wind=Wind(speed_m_s=3.0, from_deg=270.0),
    )


@pytest.fixture(scope="module")
def out() -> CheckResult:
    return checked(*OUT, fence=CLOSE)


@pytest.fixture(scope="module")
def survey() -> CheckResult:
    """400 lines of 200 m, 5 m apart, each with a turn at both ends."""
    lines = [
        place
        for number in range(400)
        for place in (at(0, 5.0 * number), at(200, 5.0 * number))[:: 1 if number % 2 else -1]
    ]
    return checked(takeoff(20), *lines, rtl())


def test_the_energy_drawn_ends_at_the_energy_of_the_flight(out: CheckResult) -> None:
    rows = make_tables(out).flight
    assert rows[0]["used_wh"] == 0.0
    assert rows[-1]["used_wh"] == pytest.approx(out.totals.energy_wh, abs=1e-3)  # rows are rounded
    assert rows[-1]["time_min"] == pytest.approx(out.totals.time_s / 60.0, abs=1e-4)


def test_the_energy_drawn_is_exact_where_segments_end(out: CheckResult) -> None:
    by_time = {row["time_min"]: row["used_wh"] for row in make_tables(out).flight}
    used_wh = 0.0
    for segment in out.segments:
        used_wh += segment.energy_wh
        end_min = round((segment.start_s + segment.duration_s) / 60.0, 4)
        assert by_time[end_min] == pytest.approx(used_wh, abs=1e-3)


def test_the_highest_power_and_altitude_are_drawn_however_few_rows_there_are(
    survey: CheckResult,
) -> None:
    assert survey.assessment is not None
    rows = make_tables(survey, most_rows=300).flight
    assert len(rows) <= 300
    # The peak of the result is that of quadrature nodes, a sample may miss it by a little.
    peak_w = max(row["power_w"] for row in rows)
    assert peak_w == pytest.approx(survey.totals.peak_power_w, rel=0.01)
    assert max(row["altitude_amsl_m"] for row in rows) == pytest.approx(420.0, abs=0.5)


def test_a_long_flight_is_drawn_with_a_bounded_number_of_rows(survey: CheckResult) -> None:
    tables = make_tables(survey)
    assert len(survey.segments) > 2_000
    for rows in (tables.flight, tables.path, tables.states, tables.returns):
        assert 0 < len(rows) <= MOST_ROWS + 1


def test_the_path_drawn_holds_every_corner_of_a_survey(survey: CheckResult) -> None:
    corners = {(round(row["east_m"]), round(row["north_m"])) for row in make_tables(survey).path}
    for north_m in range(0, 2_000, 5):
        for east_m in (0, 200):
            near = [c for c in corners if math.hypot(c[0] - east_m, c[1] - north_m) < 3.0]
            assert near, f"nothing is drawn at {east_m} m east, {north_m} m north"


def test_bands_of_states_cover_the_flight_without_a_gap(
    out: CheckResult, survey: CheckResult
) -> None:
    for result in (out, survey):
        bands = make_tables(result).states
        assert bands[0]["start_min"] == 0.0
        assert bands[-1]["end_min"] == pytest.approx(result.totals.time_s / 60.0, abs=1e-4)
        for one, other in pairwise(bands):
            assert one["end_min"] == other["start_min"]
            assert one["state"] != other["state"]


def test_the_band_of_a_state_is_as_long_as_its_segments(out: CheckResult) -> None:
    bands = make_tables(out).states
    for state in STATE_COLOURS:
        drawn_min = sum(b["end_min"] - b["start_min"] for b in bands if b["state"] == state)
        flown_s = sum(s.duration_s for s in out.segments if s.state == state)
        assert drawn_min == pytest.approx(flown_s / 60.0, abs=1e-3)


def test_the_tightest_point_drawn_leaves_the_margin_of_the_result(out: CheckResult) -> None:
    assert out.battery is not None
    assert out.return_plan is not None
    row = tightest_row(make_tables(out))
    assert row is not None
    [full, reserve] = limit_rows(out.battery)
    assert full["energy_wh"] == pytest.approx(out.battery.usable_wh)
    # Energy above the reserve less that used once home: what the result calls the margin.
    assert reserve["energy_wh"] - row["needed_wh"] == pytest.approx(
        out.return_plan.margin_wh, abs=2e-3
    )


def test_no_point_of_the_return_curve_is_tighter_than_the_tightest(
    out: CheckResult, survey: CheckResult
) -> None:
    for result in (out, survey):
        tables = make_tables(result)
        row = tightest_row(tables)
        assert row is not None
        highest_wh = max(point["needed_wh"] for point in tables.returns)
        # The search may leave a point that is tighter by a thousandth: `return_search._TOLERANCE`.
        assert highest_wh <= row["needed_wh"] * 1.001 + 1e-3
        assert highest_wh >= row["needed_wh"] * 0.99


def test_a_metre_is_as_long_eastwards_as_northwards(out: CheckResult, survey: CheckResult) -> None:
    for result in (out, survey):
        chart = plots.map_figure(result).to_dict()
        x, y = (chart["layer"][0]["encoding"][axis]["scale"]["domain"] for axis in "xy")
        # Sides are whole dots: half a dot of the shorter side is the most they can be off.
        assert chart["width"] / (x[1] - x[0]) == pytest.approx(
            chart["height"] / (y[1] - y[0]), rel=0.5 / min(chart["width"], chart["height"]) + 1e-3
        )


def test_the_map_shows_the_fence_and_the_stretch_a_finding_is_about(out: CheckResult) -> None:
    [index] = [n for n, finding in enumerate(out.findings) if finding.code == "F102"]
    data = plots.map_figure(out).to_dict()["datasets"]
    stretch = [row for row in data["stretches"] if row["finding"] == index]
    assert [row["order"] for row in stretch] == [0, 1]
    found = out.findings[index].stretch
    assert found is not None
    for row, place_deg in zip(stretch, (found.start_deg, found.end_deg), strict=True):
        there = degrees(row["east_m"], row["north_m"])
        assert there == pytest.approx(place_deg, abs=1e-6)  # 0.1 m
    assert {row["kind"] for row in data["fence"]} == {"stay inside"}
    fence = [(row["east_m"], row["north_m"]) for row in data["fence"]]
    assert fence[0] == fence[-1]
    assert max(east for east, _ in fence) == pytest.approx(305.0, abs=0.2)


def test_every_axis_says_its_quantity_and_unit(out: CheckResult, tmp_path: Path) -> None:
    expected = {
        "map": ("East of home [m]", "North of home [m]", "wind 3.0 m/s from 270°", "stay inside"),
        "altitude": ("Time [min]", "Altitude [m AMSL]"),
        "speed": ("Time [min]", "Ground speed [m/s]"),
        "power": ("Time [min]", "Power [W]", "cruise", "brake"),
        "energy": ("Time [min]", "Energy [Wh]", "used so far", "tightest", "battery, 77.0 Wh"),
    }
    written = plots.write_figures(plots.mission_figures(out), tmp_path, file_formats=("svg",))
    assert {path.stem for path in written} == expected.keys()
    for path in written:
        texts = {element.text for element in ET.parse(path).iter() if element.text}
        for text in expected[path.stem]:
            assert any(text in found for found in texts), f"{text} is not in {path.name}"


@pytest.mark.parametrize("home_m", [400.0, None])
def test_heights_above_a_home_of_unknown_altitude_are_none_from_the_sea(
    home_m: float | None, tmp_path: Path
) -> None:
    made = mission(*OUT, home=replace(HOME, altitude_amsl_m=home_m))
    result = check(made, load_vehicle("arducopter-sitl-quad"))
    [path] = [
        path
        for path in plots.write_figures(
            plots.mission_figures(result), tmp_path, file_formats=("svg",)
        )
        if path.stem == "altitude"
    ]
    drawn = " ".join(element.text for element in ET.parse(path).iter() if element.text)
    assert "Above home [m]" in drawn
    assert ("AMSL" in drawn) is (home_m is not None)
    assert ("home, 400 m" if home_m else "home, altitude unknown") in drawn
    assert page_charts(make_tables(result), {})["home_amsl_m"] == home_m


def test_light_and_dark_pictures_differ_in_ink_and_paper(out: CheckResult, tmp_path: Path) -> None:
    figure = plots.profile_figure(out)
    plots.write_figure(figure, tmp_path / "light.svg")
    plots.write_figure(figure, tmp_path / "dark.svg", scheme="dark")
    light, dark = ((tmp_path / f"{s}.svg").read_text(encoding="utf-8") for s in ("light", "dark"))
    assert 'fill="#ffffff"' in light
    assert 'fill="#ffffff"' not in dark
    assert chart_config("dark")["background"] in dark


def test_a_png_is_a_png(out: CheckResult, tmp_path: Path) -> None:
    plots.write_figure(plots.power_figure(out), tmp_path / "power.png")
    assert (tmp_path / "power.png").read_bytes().startswith(b"\x89PNG")


def test_another_suffix_is_refused_in_a_sentence(out: CheckResult, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"power\.pdf: .* ends in \.svg or \.png"):
        plots.write_figure(plots.power_figure(out), tmp_path / "power.pdf")


def test_a_vehicle_of_unknown_power_has_motion_to_draw_and_no_energy() -> None:
    result = checked(*OUT, vehicle="px4-sih-quad")
    figures = plots.mission_figures(result)
    assert "energy" not in figures
    assert "Power [W]" not in str(figures["power"].to_dict())
    assert "power_w" not in make_tables(result).flight[0]


def test_a_mission_without_a_flight_has_no_picture() -> None:
    result = checked(item(201, None))
    with pytest.raises(UsageError, match="nothing is flown"):
        plots.map_figure(result)


@pytest.mark.parametrize("autopilot", list(Autopilot))
def test_a_map_has_room_where_nothing_moves_sideways(autopilot: Autopilot) -> None:
    vehicles = {"px4": "px4-sih-quad", "ardupilot": "arducopter-sitl-quad"}
    result = checked(
        takeoff(20), rtl(), vehicle=vehicles.get(autopilot.value, "falkowski-2023-quadrotor")
    )
    chart = plots.map_figure(result).to_dict()
    west_m, east_m = chart["layer"][0]["encoding"]["x"]["scale"]["domain"]
    assert west_m < 0.0 < east_m
    assert east_m - west_m >= 20.0


def test_the_ground_is_drawn_where_it_is_known_and_only_there() -> None:
    """Level ground at 390 m, in a grid that ends some 160 m north of home."""
    half_deg, cells = 0.0015, 4
    cell_deg = 2.0 * half_deg / cells
    south, west = HOME.latitude_deg - half_deg, HOME.longitude_deg - half_deg
    tile = TerrainTile(
        source="made.tif",
        heights_amsl_m=np.full((cells, cells), 390.0, np.float32),
        transform=(cell_deg, 0.0, west, 0.0, -cell_deg, south + 2.0 * half_deg),
        projection_wkt=None,
        bounds_deg=(south, west, south + 2.0 * half_deg, west + 2.0 * half_deg),
        cell_m=cell_deg * METRES_PER_DEGREE_NORTH,
    )
    result = check(
        mission(takeoff(20), at(0, 300), rtl()),
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=77.0),
        terrain=TerrainGrid(tiles=(tile,)),
    )
    for row in make_tables(result).flight:
        if row["north_m"] < 100.0:
            assert row["ground_amsl_m"] == 390.0
        elif row["north_m"] > 200.0:
            assert row["ground_amsl_m"] is None
    chart = json.dumps(plots.profile_figure(result).to_dict())
    assert "ground_amsl_m" in chart


def test_the_band_of_the_energy_is_drawn_where_the_model_has_a_spread(out: CheckResult) -> None:
    spread = checked(*OUT, vehicle="arducopter-sitl-quad")
    assert spread.totals.energy_wh_p90 is not None
    [start, *_, end] = make_tables(spread).band
    assert (start["time_min"], start["p10_wh"], start["p90_wh"]) == (0.0, 0.0, 0.0)
    assert end["p90_wh"] == pytest.approx(spread.totals.energy_wh_p90, abs=1e-3)
    assert end["time_min"] == pytest.approx(spread.totals.time_s / 60.0, abs=1e-4)
    drawn = plots.energy_figure(spread).to_dict()
    assert "8 of 10 flights" in str(drawn)
    assert out.totals.energy_wh_p90 is None
    assert make_tables(out).band == []
    assert "8 of 10 flights" not in str(plots.energy_figure(out).to_dict())


def test_figures_for_a_folder_that_is_a_file_are_refused_in_a_sentence(
    out: CheckResult, tmp_path: Path
) -> None:
    (tmp_path / "survey.plan").write_text("{}", encoding="utf-8")
    with pytest.raises(OutputError, match="is a file; figures are written to a folder"):
        plots.write_figures({"map": plots.map_figure(out)}, tmp_path / "survey.plan")


@pytest.mark.parametrize(("width_px", "shown"), [(720, ">="), (324, "<")])
def test_texts_on_the_map_are_clear_of_their_marks_and_of_each_other(
    out: CheckResult, survey: CheckResult, width_px: int, shown: str
) -> None:
    """324 px are what a telephone of 400 px leaves; the spec itself is 720 px wide."""
    for result in (out, survey):
        chart = plots.map_figure(result).to_dict()
        west_m, east_m = chart["layer"][0]["encoding"]["x"]["scale"]["domain"]
        boxes = []
        for layer in chart["layer"]:
            mark, encoding = layer["mark"], layer["encoding"]
            if mark["type"] != "text" or "field" not in encoding["text"]:
                continue
            if f"width {shown} " not in encoding["opacity"]["value"]["expr"]:
                continue
            side = 1 if mark["align"] == "left" else -1
            # A dot of 45 px² has a radius of 3.8 px.
            assert mark["dx"] * side > math.sqrt(45.0 / math.pi)
            for row in chart["datasets"][layer["data"]["name"]]:
                x, y = (
                    (row[key] - west_m) / (east_m - west_m) * width_px
                    for key in ("east_m", "north_m")
                )
                ends = sorted((x + mark["dx"], x + mark["dx"] + 5 * side * len(row["text"])))
                boxes.append((*ends, mark["dy"] - y - 5.0, mark["dy"] - y + 5.0))
        assert boxes
        for number, one in enumerate(boxes):
            for other in boxes[number + 1 :]:
                beside = one[1] <= other[0] or other[1] <= one[0]
                assert beside or one[3] <= other[2] or other[3] <= one[2]


@pytest.fixture(scope="module")
def too_far() -> CheckResult:
    """4 km out and back at 10 m/s on a battery that brings it home only from half the way."""
    far = mission(takeoff(50), at(0, 4_000), rtl())
    return check(
        far,
        load_vehicle("falkowski-2023-quadrotor"),
        battery=Battery(capacity_wh=25.0),
        reserve=0.2,
    )


def test_texts_of_a_lawn_mower_stand_outside_of_its_lines() -> None:
    """Six lines of 240 m, 30 m apart: the only place beside the path is left and right of them.

    The last one is where the return is tightest, whose name comes first.
    """
    corners = [
        (east_m, 30 * row)
        for row in range(1, 7)
        for east_m in ((-120, 120) if row % 2 else (120, -120))
    ]
    wide = Fence(polygons=(box(-300, -100, 300, 300),))
    shown = checked(takeoff(20), *(at(*corner) for corner in corners), rtl(), fence=wide)
    spec = plots.map_figure(shown).to_dict()
    rows = [
        row
        for layer in spec["layer"]
        if "width >= " in str(layer["encoding"].get("opacity"))
        for row in spec["datasets"][layer["data"]["name"]]
    ]
    sides = {(row["east_m"] > 0.0, row["side"]) for row in rows if 0.0 < row["north_m"] < 140.0}
    assert sides == {(False, -1), (True, 1)}
    assert sum("Wh" in row["text"] for row in rows) >= len(corners), "each has its time and energy"


def test_the_path_takes_the_colour_of_what_a_return_would_leave(too_far: CheckResult) -> None:
    tables = make_tables(too_far)
    budget, plan = too_far.battery, too_far.return_plan
    assert budget is not None
    assert plan is not None
    assert plan.last_return is not None
    needed = {row["time_min"]: row["needed_wh"] for row in tables.returns}
    times = sorted(needed)
    turned_min = tables.returns[-1]["time_min"]
    seen = set()
    for row in tables.path:
        if not times[0] < row["time_min"] < turned_min:
            continue
        wh = np.interp(row["time_min"], times, [needed[time] for time in times])
        above = (budget.usable_wh - budget.reserve_wh - wh) / budget.capacity_wh
        expected = (
            "an empty battery"
            if wh > budget.usable_wh
            else "less than the reserve"
            if above < 0.0
            else "reserve + up to 10 %"
            if above < 0.1
            else "reserve + 10 to 25 %"
            if above < 0.25
            else "reserve + over 25 %"
        )
        limits = (0.0, 0.1, 0.25, -budget.reserve_wh / budget.capacity_wh)
        if min(abs(above - limit) for limit in limits) > 0.01:  # a run ends where the next begins
            assert row["level"] == expected
        seen.add(row["level"])
    assert len(seen) == 5
    assert {row["run"] for row in tables.path} == set(range(max(r["run"] for r in tables.path) + 1))
    # The run below the reserve begins at the point of no return.
    below = next(row for row in tables.path if row["level"] == "less than the reserve")
    assert below["time_min"] * 60.0 == pytest.approx(plan.last_return.time_s, abs=2.0)


def test_the_points_the_return_decides_on_are_marked_at_their_places(too_far: CheckResult) -> None:
    plan, tables = too_far.return_plan, make_tables(too_far)
    assert plan is not None
    points = {row["kind"]: row for row in tables.points}
    assert list(points) == ["tightest return", "point of no return", "battery empty on the return"]
    for row, point in zip(
        tables.points, (plan.tightest, plan.last_return, plan.last_return_empty), strict=True
    ):
        assert point is not None
        assert (row["latitude_deg"], row["longitude_deg"]) == pytest.approx(
            (point.latitude_deg, point.longitude_deg), abs=1e-7
        )
    assert "into the leg to item 2" in points["point of no return"]["label"]
    assert 0.0 < points["point of no return"]["north_m"] < 4_000.0


def test_arrows_point_the_way_it_is_flown(out: CheckResult, too_far: CheckResult) -> None:
    north = {row["bearing_deg"] for row in make_tables(out).arrows if row["east_m"] == 0.0}
    assert north == {0.0}
    bearings = [row["bearing_deg"] for row in make_tables(too_far).arrows]
    assert set(bearings) == {0.0, 180.0}
    assert make_tables(checked(takeoff(20), rtl())).arrows == []


def test_a_place_has_one_mark_with_a_line_for_each_item(out: CheckResult) -> None:
    assert out.assessment is not None
    marks = make_tables(out).marks
    [home] = [row for row in marks if row["kind"] == "home"]
    assert home["short"] == "1, 4, H"
    lines = home["label"].split("\n")
    home_m = out.assessment.route.home_amsl_m
    assert lines[0].startswith("Take-off 1 · reached 0:")
    assert lines[0].endswith(f" Wh used · 20 m above home, {home_m + 20.0:.0f} m AMSL")
    assert lines[2] == f"Home · {home_m:.0f} m AMSL"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_labels_of_an_axis_keep_a_gap_of_about_a_character(scheme: Scheme) -> None:
    assert chart_config(scheme)["axis"]["labelSeparation"] >= 6.0
