"""Whatever is pressed and clicked in whatever order, the review goes on."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from reviews import SURVEY, TOO_FAR, review_app

KEYS = (
    "up down left right enter escape tab shift+tab home end pageup pagedown space plus minus 0 "
    "shift+up shift+left 1 2 3 4 5 6 w p y s c f r t slash question_mark m n backspace a 7 e @ % "
    "ctrl+z j k g G h l delete full_stop"
)
"""All but those that quit."""
PRESSED = 50
CLICKED = 0.08
"""Share of clicks among what is done."""


@pytest.mark.asyncio
@pytest.mark.parametrize(
    ("files", "size", "seed"),
    [
        ((TOO_FAR,), (80, 24), 1),
        ((SURVEY,), (160, 48), 2),
        (("broken.plan",), (100, 30), 3),
        ((".",), (60, 16), 4),
        ((SURVEY, TOO_FAR), (132, 36), 5),
    ],
)
async def test_no_keys_and_clicks_end_the_review(
    files: tuple[str, ...], size: tuple[int, int], seed: int
) -> None:
    Path("broken.plan").write_text('{"fileType": "Plan", ', encoding="utf-8")
    before = {path: path.read_bytes() for path in Path().iterdir()}
    chance, keys = random.Random(seed), KEYS.split()
    app = review_app(*files)
    async with app.run_test(size=size) as pilot:  # what is raised inside is raised here
        for number in range(PRESSED):
            if chance.random() < CLICKED:
                await pilot.click(offset=(chance.randrange(size[0]), chance.randrange(size[1])))
            else:
                app.simulate_key(chance.choice(keys))
            if number % 4 == 0:
                await pilot.pause()
        await app.workers.wait_for_complete()
        await pilot.pause()
        assert app.is_running
        assert app.return_code is None
    assert {path: path.read_bytes() for path in before} == before  # what was there is as it was
