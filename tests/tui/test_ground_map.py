"""The map: zoomed, moved, and never without the cursor."""

from __future__ import annotations

import numpy as np
import pytest
from reviews import review_app, settled

from planner.tui.widgets.canvas import Canvas
from planner.tui.widgets.ground_map import GroundMap, Scale, scale_to_fit

SURVEY = "survey-vineyard.plan"


def _drawn(drawing: GroundMap) -> str:
    return "\n".join(drawing.render_line(y).text for y in range(drawing.size.height))


def _text(canvas: Canvas) -> list[str]:
    return ["".join(text for text, _ in canvas.runs(row)) for row in range(canvas.rows)]


def test_a_scale_about_a_place_has_it_in_the_middle_and_is_larger_by_its_factor() -> None:
    scale = Scale(west_m=-50.0, north_m=80.0, m_per_dot=2.0).about((30.0, -20.0), 4.0, 101, 41)
    x, y = scale.dots(np.array([30.0, 30.5]), np.array([-20.0, -20.0]))
    assert scale.m_per_dot == 0.5
    assert x.tolist() == [50.0, 51.0]
    assert y.tolist() == [20.0, 20.0]


def test_all_there_is_lies_inside_of_the_scale_that_fits() -> None:
    scale = scale_to_fit((-100.0, -10.0, 300.0, 40.0), 80, 40)
    x, y = scale.dots(np.array([-100.0, 300.0]), np.array([40.0, -10.0]))
    assert x.min() >= 0.0
    assert x.max() <= 79.0
    assert y.min() >= 0.0
    assert y.max() <= 39.0


def test_a_line_that_goes_far_beyond_the_canvas_costs_what_is_in_sight() -> None:
    canvas = Canvas(4, 1)
    canvas.line(np.array([-1e12, 1e12]), np.array([0.0, 0.0]), "curve")  # a dot each were terabytes
    assert _text(canvas) == ["⠉⠉⠉⠉"]


def test_lines_that_pass_by_draw_nothing() -> None:
    canvas = Canvas(4, 2)
    canvas.line(np.array([-50.0, 50.0]), np.array([-9.0, -9.0]), "curve")  # above
    canvas.line(np.array([-9.0, -9.0]), np.array([-50.0, 50.0]), "curve")  # to the left
    canvas.line(np.array([-50.0, 20.0]), np.array([0.0, 70.0]), "curve")  # across the corner
    assert _text(canvas) == ["    ", "    "]


@pytest.mark.asyncio
async def test_keys_zoom_and_move_the_map_and_take_it_back() -> None:
    async with review_app(SURVEY).run_test(size=(80, 24)) as pilot:
        screen = await settled(pilot)
        await pilot.press("3")
        await settled(pilot)
        ground = screen.query_one(GroundMap)
        whole = _drawn(ground)
        await pilot.press("plus", "plus", "plus")
        await pilot.pause()
        near = _drawn(ground)
        assert "×8" in near
        assert near != whole
        await pilot.press("shift+right")
        await pilot.pause()
        assert _drawn(ground) != near
        await pilot.press("shift+left")
        await pilot.pause()
        assert _drawn(ground) == near
        await pilot.press("0")
        await pilot.pause()
        assert _drawn(ground) == whole


@pytest.mark.asyncio
async def test_a_zoomed_map_follows_the_cursor() -> None:
    async with review_app(SURVEY).run_test(size=(80, 24)) as pilot:
        screen = await settled(pilot)
        await pilot.press("3", *["plus"] * 5)
        ground = screen.query_one(GroundMap)
        for _ in range(20):
            await pilot.press("right", "right", "right", "right", "right")
            await pilot.pause()
            assert "◆" in _drawn(ground)


@pytest.mark.asyncio
async def test_no_zoom_is_too_much() -> None:
    async with review_app(SURVEY).run_test(size=(80, 24)) as pilot:
        screen = await settled(pilot)
        await pilot.press("3", *["plus"] * 40, "minus", "shift+up", "shift+down")
        await pilot.pause()
        assert "×" in _drawn(screen.query_one(GroundMap))
        await pilot.press(*["minus"] * 40)
        await pilot.pause()
        assert "×" not in _drawn(screen.query_one(GroundMap))
