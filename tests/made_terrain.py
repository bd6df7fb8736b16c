"""Ground drawn by hand: level with home but for a ridge across the way north."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from made_missions import HOME, METRES_PER_DEGREE_NORTH, north

from planner.geo.terrain import TerrainGrid, TerrainTile
from planner.values import replace

if TYPE_CHECKING:
    import numpy.typing as npt

CELL_M = 10.0
CELL_DEG = CELL_M / METRES_PER_DEGREE_NORTH
ROWS, COLUMNS = 400, 40
SOUTH_M = -1000.0


def slope(angle_deg: float) -> TerrainGrid:
    """Return ground that falls from home towards the north, level to the east."""
    level = ground(0.0).tiles[0]
    rows = np.arange(ROWS)[::-1, None] * CELL_M + SOUTH_M
    heights = 400.0 - rows * math.tan(math.radians(angle_deg))
    return of_heights(np.repeat(heights, COLUMNS, axis=1), level)


def hill(top_m: float, *, at_m: float = 250.0, steep: float = 0.2) -> TerrainGrid:
    """Return level ground with a hill across the way north, as high as a ridge and less steep."""
    level = ground(0.0).tiles[0]
    north_m = (np.arange(ROWS)[::-1, None] + 0.5) * CELL_M + SOUTH_M
    rise_m = top_m + steep * (CELL_M - np.abs(north_m - at_m))
    return of_heights(np.repeat(400.0 + np.clip(rise_m, 0.0, top_m), COLUMNS, axis=1), level)


def wide(narrow: TerrainGrid) -> TerrainGrid:
    """Return a grid five times as wide, of ground that is level from west to east."""
    tile = narrow.tiles[0]
    a, b, west, d, e, top = tile.transform
    south, west_deg, north_deg, east_deg = tile.bounds_deg
    beside_deg = 2.0 * (east_deg - west_deg)
    return TerrainGrid(
        tiles=(
            replace(
                tile,
                heights_amsl_m=np.tile(np.asarray(tile.heights_amsl_m), (1, 5)),
                transform=(a, b, west - beside_deg, d, e, top),
                bounds_deg=(south, west_deg - beside_deg, north_deg, east_deg + beside_deg),
            ),
        )
    )


def of_heights(heights: npt.NDArray[np.float64], like: TerrainTile) -> TerrainGrid:
    """Return other heights in the place of a tile."""
    return TerrainGrid(tiles=(replace(like, heights_amsl_m=heights.astype(np.float32)),))


def cut(
    whole: TerrainGrid, *, row: int = 0, column: int = 0, overlap: int = 0
) -> list[TerrainTile]:
    """Return a tile cut before a row, a column or both; the first part has some cells of the next."""
    tile, tiles = whole.tiles[0], []
    heights = np.asarray(tile.heights_amsl_m)
    a, b, west, d, e, north_deg = tile.transform
    for top, bottom in [(0, row + overlap), (row, ROWS)] if row else [(0, ROWS)]:
        for left, right in [(0, column + overlap), (column, COLUMNS)] if column else [(0, COLUMNS)]:
            corner = (a, b, west + a * left, d, e, north_deg + e * top)
            bounds_deg = (north_deg + e * bottom, corner[2], corner[5], west + a * right)
            part = replace(
                tile,
                source=f"{top}-{left}.tif",
                heights_amsl_m=heights[top:bottom, left:right],
                transform=corner,
                bounds_deg=bounds_deg,
            )
            tiles.append(part)
    return tiles


def ground(ridge_m: float, *, at_m: float = 250.0, rows: int = ROWS) -> TerrainGrid:
    """Return a grid from 1 km south of home; the centres of two rows of cells lie on the ridge."""
    heights = np.full((rows, COLUMNS), 400.0, dtype=np.float32)
    southern = round((at_m - SOUTH_M) / CELL_M)
    heights[rows - 1 - southern - 1 : rows - 1 - southern + 1] += ridge_m
    south, west = north(SOUTH_M) - 0.5 * CELL_DEG, HOME.longitude_deg - 0.5 * COLUMNS * CELL_DEG
    top = south + rows * CELL_DEG
    tile = TerrainTile(
        source="ridge.tif",
        heights_amsl_m=heights,
        transform=(CELL_DEG, 0.0, west, 0.0, -CELL_DEG, top),
        projection_wkt=None,
        bounds_deg=(south, west, top, west + COLUMNS * CELL_DEG),
        cell_m=CELL_M,
    )
    return TerrainGrid(tiles=(tile,))


def pole(east_m: float, north_m: float, *, columns: int = 41) -> tuple[TerrainGrid, float]:
    """Return level ground in cells of 1 m by 0.68 m with one 40 m higher, and how far east its centre is."""
    rows, cell_deg = 400, CELL_DEG / CELL_M
    wide_m = math.cos(math.radians(HOME.latitude_deg))
    row, column = rows - 1 - round(north_m + 40.0), round(east_m / wide_m) + columns // 2
    heights = np.full((rows, columns), 400.0, dtype=np.float32)
    heights[row, column] += 40.0
    south, west = north(-40.5), HOME.longitude_deg - 0.5 * columns * cell_deg
    tile = replace(
        ground(0.0).tiles[0],
        heights_amsl_m=heights,
        transform=(cell_deg, 0.0, west, 0.0, -cell_deg, south + rows * cell_deg),
        bounds_deg=(south, west, south + rows * cell_deg, west + columns * cell_deg),
        cell_m=wide_m,
    )
    return TerrainGrid(tiles=(tile,)), (column - columns // 2) * wide_m
