"""The height of the ground, read from terrain files."""

from __future__ import annotations

import math
import warnings
from collections import OrderedDict
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from planner.errors import TerrainFileError, libraries_of
from planner.geo.geodesy import distance_m
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from os import PathLike

    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray, IntArray


MaskedHeights: TypeAlias = "np.ma.MaskedArray[Any, np.dtype[np.float64]]"

_WGS84 = "EPSG:4326"
# No ground lies outside: the Dead Sea's shore is at −440 m, Everest's top at 8849 m.  Beyond are
# −9999, −32768 and the like, in files that do not declare their "no data".
_LOWEST_GROUND_M, _HIGHEST_GROUND_M = -500.0, 9000.0
_METRES = frozenset({"", "m", "metre", "metres", "meter", "meters"})
_MOST_READ = 16_000_000
"""Cells that are read at once, 64 MB: a tile of 1° at 1″ has 13 million.  Of a larger file a mission's
surroundings are read, window by window: 1.2 MB of deflate may hold 250 million cells."""
_WINDOW = 512
"""Cells along a side of a window."""
_MOST_WINDOWS = 64
_LEAST_WEIGHT = 1e-6
_ROUNDED = 1e-6
"""What the rounding of degrees may be of a cell: tiles edge to edge have no gap."""
_OWN = 0.5 + _ROUNDED
"""So many cells beyond its outermost centres a tile's own cells end."""
_CORNERS = np.array([[0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.0, 1.0]])[..., None]
"""Rows and columns of four cells from the first of them."""
_MOST_NORTH_DEG, _MOST_EAST_DEG = 91.0, 541.0
"""Grids end half a cell beyond a pole, and begin anywhere around the Earth."""
_LEAST_CELL_M = 1e-3
_AROUND_DEG = 0.1
"""So far beside a projected tile places still have coordinates in it: lines enter it from there. [°]"""


class WindowedHeights:
    """The heights of a file too large to be read at once: windows as they are asked for, the last kept."""

    def __init__(self, path: Path, driver: str, shape: tuple[int, int]) -> None:
        self._path, self._driver, self.shape = path, driver, shape
        self._windows: OrderedDict[tuple[int, int], npt.NDArray[np.float32]] = OrderedDict()

    def __getitem__(self, cells: tuple[IntArray, IntArray]) -> npt.NDArray[np.float32]:
        """Return the heights of cells, by rows and columns of one shape."""
        row, column = (np.asarray(index) for index in cells)
        found = np.empty(row.shape, np.float32)
        window = row // _WINDOW * (self.shape[1] // _WINDOW + 1) + column // _WINDOW
        for number in np.unique(window).tolist():
            inside = window == number
            i, j = divmod(number, self.shape[1] // _WINDOW + 1)
            heights = self._window(i, j)
            found[inside] = heights[row[inside] - i * _WINDOW, column[inside] - j * _WINDOW]
        return found

    def part(self, rows: slice, columns: slice) -> npt.NDArray[np.float32]:
        """Return the heights of a part of the grid."""
        spans = [
            one.indices(size)[:2] for one, size in zip((rows, columns), self.shape, strict=True)
        ]
        count = math.prod(max(end - begin, 0) for begin, end in spans)
        if count > _MOST_READ:
            msg = f"the mission has {count} cells around it; give terrain of wider cells there"
            raise TerrainFileError(msg, source=str(self._path))
        if not count:
            return np.empty((0, 0), np.float32)
        with _opened(self._path, self._driver) as raster:
            return _heights(raster, (spans[0], spans[1]))

    def _window(self, i: int, j: int) -> npt.NDArray[np.float32]:
        if (i, j) not in self._windows:
            with _opened(self._path, self._driver) as raster:
                first, left = i * _WINDOW, j * _WINDOW
                last, right = (
                    min(begin + _WINDOW, size)
                    for begin, size in zip((first, left), self.shape, strict=True)
                )
                self._windows[i, j] = _heights(raster, ((first, last), (left, right)))
            if len(self._windows) > _MOST_WINDOWS:
                self._windows.popitem(last=False)
        self._windows.move_to_end((i, j))
        return self._windows[i, j]


class TerrainTile(Value, eq=False):
    """One raster of ground heights; cells are known by their centres."""

    source: str
    """The file."""
    heights_amsl_m: npt.NDArray[np.float32] | WindowedHeights
    """Heights, shape (rows, columns); NaN where the file has none. [m]"""
    transform: tuple[float, float, float, float, float, float]
    """(a, b, c, d, e, f): x = a column + b row + c, y = d column + e row + f, from the outer
    corner of the first cell, in degrees east and north or the projection's own units."""
    projection_wkt: str | None
    """How x and y come from WGS 84; ``None`` where they are its longitude and latitude."""
    bounds_deg: tuple[float, float, float, float]
    """(south, west, north, east); west > east across the antimeridian. [°]"""
    cell_m: float
    """The shorter side of the cell in the middle. [m]"""

    def height_amsl_m(
        self,
        latitude_deg: npt.ArrayLike,
        longitude_deg: npt.ArrayLike,
        *,
        ridged: bool = False,
        beyond: float = 0.5,
    ) -> FloatArray:
        """Return the bilinearly interpolated height; NaN where the tile does not know it. [m]

        Within half a cell of the tile's edge, or so many cells ``beyond`` the outermost centres, it is that
        of the outermost cells.  Of four cells of which two across from each other are high, a grid does not
        tell whether a ridge joins them: ``ridged`` it does, and the ground is the higher of the two pairs of
        triangles through their centres.
        """
        row, column = self.row_column(latitude_deg, longitude_deg)
        rows, columns = self.heights_amsl_m.shape
        known = self.reaches(row, column, beyond)
        row = np.clip(np.where(known, row, 0.0), 0.0, rows - 1.0)
        column = np.clip(np.where(known, column, 0.0), 0.0, columns - 1.0)
        top, left = np.floor(row).astype(np.intp), np.floor(column).astype(np.intp)
        below, beside = np.minimum(top + 1, rows - 1), np.minimum(left + 1, columns - 1)
        grid = self.heights_amsl_m
        cells_m = (grid[top, left], grid[top, beside], grid[below, left], grid[below, beside])
        return np.where(known, _between(cells_m, row - top, column - left, ridged=ridged), np.nan)

    def reaches(self, row: FloatArray, column: FloatArray, beyond: float) -> BoolArray:
        """Return whether places, in cells, are no more cells than that beyond the outermost centres."""
        rows, columns = self.heights_amsl_m.shape
        in_rows: BoolArray = (row >= -beyond) & (row <= rows - 1.0 + beyond)
        in_columns: BoolArray = (column >= -beyond) & (column <= columns - 1.0 + beyond)
        return in_rows & in_columns

    def row_column(
        self, latitude_deg: npt.ArrayLike, longitude_deg: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Return places in cells, whole numbers at their centres; beyond the first and last outside."""
        x, y = self._x_y(
            *np.broadcast_arrays(
                np.asarray(latitude_deg, np.float64), np.asarray(longitude_deg, np.float64)
            )
        )
        a, b, c, d, e, f = self.transform
        determinant = a * e - b * d
        column = (e * (x - c) - b * (y - f)) / determinant - 0.5
        row = (a * (y - f) - d * (x - c)) / determinant - 0.5
        return row, column

    def centres_above(
        self, height_amsl_m: float, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the centres of the cells higher than a height, among those around places. (k,), (k,) [°]"""
        row, column = self.row_column(latitude_deg, longitude_deg)
        around, first_row, first_column = self._around(row, column, beyond=1.0)
        rows, columns = np.nonzero(around > height_amsl_m)
        return self.latitude_longitude_deg(rows + first_row, columns + first_column)

    def cells_among_amsl_m(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> npt.NDArray[np.float32]:
        """Return the heights at centres of cells among dense places; NaN where it has none. (k,) [m]"""
        row, column = self.row_column(latitude_deg, longitude_deg)
        near = np.isfinite(row) & np.isfinite(column)
        if not near.any():
            return np.empty(0, np.float32)
        return self._around(row[near], column[near], beyond=0.0)[0].ravel()

    def _around(
        self, row: FloatArray, column: FloatArray, *, beyond: float
    ) -> tuple[npt.NDArray[np.float32], int, int]:
        """Return the cells among places, and less than so many beyond, and the first row and column."""
        window = []
        for own, size in zip((row, column), self.heights_amsl_m.shape, strict=True):
            is_known = bool(np.isfinite(own).all())
            low, high = (own.min(), own.max()) if is_known else (0.0, size)
            begin, end = math.floor(low - beyond) + 1, math.ceil(high + beyond)
            window.append(slice(max(begin, 0), max(end, 0)))
        grid = self.heights_amsl_m
        around = grid[tuple(window)] if isinstance(grid, np.ndarray) else grid.part(*window)
        return around, window[0].start, window[1].start

    def latitude_longitude_deg(
        self, row: npt.NDArray[Any], column: npt.NDArray[Any]
    ) -> tuple[FloatArray, FloatArray]:
        """Return where places in cells are. (k,), (k,) [°]"""
        down, right = row + 0.5, column + 0.5
        a, b, c, d, e, f = self.transform
        x, y = a * right + b * down + c, d * right + e * down + f
        if self.projection_wkt is None or not len(x):
            return y, x
        from rasterio.warp import transform

        longitude, latitude = transform(self.projection_wkt, _WGS84, x, y)
        return np.asarray(latitude), np.asarray(longitude)

    def _x_y(self, latitude: FloatArray, longitude: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates in the tile's own system, NaN for places that are not near it."""
        south, west, north, east = self.bounds_deg
        # Longitudes are counted from the tile's middle, whole turns taken off.
        half = 0.5 * ((east - west) % 360.0 or 360.0)
        eastward = (longitude - west - half + 180.0) % 360.0 - 180.0
        if self.projection_wkt is None:
            return west + half + eastward, latitude
        from rasterio.warp import transform

        near = (latitude >= south - _AROUND_DEG) & (latitude <= north + _AROUND_DEG)
        near &= np.abs(eastward) <= half + _AROUND_DEG
        x, y = np.full(latitude.shape, np.nan), np.full(latitude.shape, np.nan)
        if np.any(near):
            x[near], y[near] = transform(
                _WGS84, self.projection_wkt, longitude[near], latitude[near]
            )
        return x, y


class GroundProfile(Value, eq=False):
    """The ground under lines, in parts that are straight."""

    line: IntArray
    """Line each part is of, rising; every line has one or more. (k,)"""
    start: FloatArray
    """Where on its line each part begins and ends, 0 to 1. (k,) [-]"""
    end: FloatArray
    ground_amsl_m: FloatArray
    """At the beginning and the end of each part; NaN where it is not known. (k, 2) [m]"""


_COMPARED = 129
"""Places each way at which the ground of a box is looked up, and overlapping tiles are compared."""
_SAME_GROUND_M = 0.01
"""Tiles that differ by no more were cut from one. [m]"""
_NARROW_DEG = 180.0
"""Wider tiles are on every longitude, as good as. [°]"""
_SAME_FRACTION = 1e-12
_QUARTERS = np.array([0.25, 0.75])
_TO_ENDS = np.array([[1.5, -0.5], [-0.5, 1.5]])
"""From what is straight at its quarters to its beginning and end: a hole may begin right there."""


class OtherGround(Value, eq=False):
    """A tile that knows other ground where one before it counts."""

    grid: TerrainGrid
    """The same tiles, this one first."""
    source: str
    counted: str
    """The files: its own, and that which counts."""
    apart_m: float
    """How far its ground is above the other's where they differ most. [m]"""
    latitude_deg: float
    longitude_deg: float


class TerrainGrid(Value):
    """Ground heights above mean sea level from one tile or several."""

    tiles: tuple[TerrainTile, ...]
    """Where tiles overlap the first that has the height between centres of its cells counts; `others` are
    those that differ from it."""

    @property
    def cell_m(self) -> float:
        """The shortest side of a cell of any tile. [m]"""
        return min(tile.cell_m for tile in self.tiles)

    def height_amsl_m(
        self, latitude_deg: npt.ArrayLike, longitude_deg: npt.ArrayLike, *, ridged: bool = False
    ) -> MaskedHeights:
        """Return the height of the ground, interpolated bilinearly, or ``ridged`` as of a tile. [m]

        It is masked, and NaN beneath the mask, outside of every tile and where one of the cells
        around has no data.
        """
        latitude, longitude = np.broadcast_arrays(
            np.asarray(latitude_deg, np.float64), np.asarray(longitude_deg, np.float64)
        )
        if len(self.tiles) == 1:
            height = self.tiles[0].height_amsl_m(latitude, longitude, ridged=ridged)
        else:
            height = self._first_m(latitude, longitude, ridged=ridged, beyond=_ROUNDED)
            missing = np.isnan(height)
            if missing.any():
                height[missing] = self._at_edges_m(
                    latitude[missing], longitude[missing], ridged=ridged
                )
        masked: MaskedHeights = np.ma.array(height, mask=np.isnan(height))
        return masked

    def _first_m(
        self, latitude: FloatArray, longitude: FloatArray, *, ridged: bool = False, beyond: float
    ) -> FloatArray:
        """Return heights of the first tile that knows them, so many cells beyond its outermost centres."""
        height = np.full(latitude.shape, np.nan)
        for tile in self.tiles:
            missing = np.isnan(height)
            if not missing.any():
                break
            height[missing] = tile.height_amsl_m(
                latitude[missing], longitude[missing], ridged=ridged, beyond=beyond
            )
        return height

    def _at_edges_m(
        self, latitude: FloatArray, longitude: FloatArray, *, ridged: bool
    ) -> FloatArray:
        """Return heights of places that are between the centres of no tile. (n,) [m]

        A tile goes on there to the cell beyond its last as the others know it: tiles cut from one have the
        ground of the one.  Of several that reach a place the highest ground counts.
        """
        height, known = np.full(latitude.shape, np.nan), np.zeros(latitude.shape, bool)
        for tile in self.tiles:
            row, column = tile.row_column(latitude, longitude)
            own = tile.reaches(row, column, _OWN)
            known |= own
            # What it does not know between its own centres is a hole.
            near = tile.reaches(row, column, 1.0) & ~tile.reaches(row, column, _ROUNDED)
            place = np.array([row[near], column[near]])
            first = np.floor(place)
            down, right = place - first
            cells_m, has = self._cells(tile, _CORNERS + first[:, None])
            counts = own[near] | has.all(axis=0)
            # A cell of no tile is as that above or below, else beside; a hole of a tile stays one.
            for other in ([2, 3, 0, 1], [1, 0, 3, 2]):
                cells_m = np.where(has, cells_m, cells_m[other])
                has |= has[other]
            found = np.where(counts, _between(cells_m, down, right, ridged=ridged), np.nan)
            height[near] = np.fmax(height[near], found)
        return np.where(known, height, np.nan)

    def _cells(self, tile: TerrainTile, cells: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return heights at cells of a tile and beyond, (2, 4, k), and whether any tile has a cell there."""
        where = tile.latitude_longitude_deg(*cells.reshape(2, -1))
        height = self._first_m(*where, beyond=_ROUNDED)
        missing = np.isnan(height)
        height[missing] = self._first_m(*(axis[missing] for axis in where), beyond=_OWN)
        has = [one.reaches(*one.row_column(*where), _OWN) for one in self.tiles]
        return height.reshape(4, -1), np.any(has, axis=0).reshape(4, -1)

    def heights_within_amsl_m(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> MaskedHeights:
        """Return heights at 129 places each way of a box, by its corners (2,); masked: not known. [m]"""
        return self.height_amsl_m(*_places_within(latitude_deg, longitude_deg))

    def cells_within_amsl_m(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> npt.NDArray[np.float32]:
        """Return heights at all centres of cells in a box, by its corners (2,); NaN: not known. (k,) [m]"""
        places = _places_within(latitude_deg, longitude_deg)
        return np.concatenate([tile.cells_among_amsl_m(*places) for tile in self.tiles])

    def others(
        self, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> tuple[OtherGround, ...]:
        """Return the tiles that differ from tiles before them in a box, by its two corners. (2,)"""
        found = []
        for number, tile in enumerate(self.tiles):
            apart = [
                (*most, before.source)
                for before in self.tiles[:number]
                if (most := _most_apart(tile, before, latitude_deg, longitude_deg)) is not None
            ]
            if not apart:
                continue
            apart_m, latitude, longitude, counted = max(apart, key=lambda one: abs(one[0]))
            if abs(apart_m) > _SAME_GROUND_M:
                rest = (*self.tiles[:number], *self.tiles[number + 1 :])
                found.append(
                    OtherGround(
                        grid=TerrainGrid(tiles=(tile, *rest)),
                        source=tile.source,
                        counted=counted,
                        apart_m=apart_m,
                        latitude_deg=latitude,
                        longitude_deg=longitude,
                    )
                )
        return tuple(found)

    def peaks_above(
        self, height_amsl_m: float, latitude_deg: FloatArray, longitude_deg: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the places and heights where the ground between places may rise above a height. (k,)

        Between four centres of cells the ground is nowhere higher than the highest of them: over
        any area it is highest at a centre inside or on the area's edge.  [°], [°], [m]
        """
        found = [
            tile.centres_above(height_amsl_m, latitude_deg, longitude_deg) for tile in self.tiles
        ]
        latitude, longitude = (np.concatenate(own) for own in zip(*found, strict=True))
        return latitude, longitude, self.height_amsl_m(latitude, longitude).filled(np.nan)

    def under(self, latitude_deg: FloatArray, longitude_deg: FloatArray) -> GroundProfile:
        """Return the ground under lines, ridged as a tile's, cut wherever a triangle of it ends.

        Parameters
        ----------
        latitude_deg, longitude_deg : ndarray
            Beginnings and ends of lines that are straight in degrees. (n, 2) [°]

        Notes
        -----
        Sides of triangles join centres of cells to those beside them, of one row or column, and to those
        across.  Between them the ground is a plane: two places determine it, and nothing is left out.
        """
        turn = (longitude_deg[:, 1] - longitude_deg[:, 0] + 180.0) % 360.0 - 180.0
        north = latitude_deg[:, 1] - latitude_deg[:, 0]
        count = len(latitude_deg)
        lines = [np.arange(count), np.arange(count)]
        fractions = [np.zeros(count), np.ones(count)]
        for tile in self.tiles:
            (row, column), (rows, columns) = (
                tile.row_column(latitude_deg, longitude_deg),
                tile.heights_amsl_m.shape,
            )
            for place, least, most in (
                (row, 0, rows - 1),
                (column, 0, columns - 1),
                (row + column, 0, rows + columns - 2),
                (row - column, 1 - columns, rows - 1),
            ):
                line, fraction = _crossings(place, least, most)
                lines.append(line)
                fractions.append(fraction)
        line, fraction = np.concatenate(lines), np.concatenate(fractions)
        order = np.lexsort((fraction, line))
        line, fraction = line[order], fraction[order]
        inside = (line[1:] == line[:-1]) & (fraction[1:] - fraction[:-1] > _SAME_FRACTION)
        part = np.flatnonzero(inside)
        line, start, end = line[part], fraction[part], fraction[part + 1]
        along = start[:, None] + (end - start)[:, None] * _QUARTERS
        places = latitude_deg[line, :1] + along * north[line, None]
        heights = self.height_amsl_m(
            places, longitude_deg[line, :1] + along * turn[line, None], ridged=True
        )
        return GroundProfile(
            line=line, start=start, end=end, ground_amsl_m=heights.filled(np.nan) @ _TO_ENDS
        )


def _between(
    cells_m: Sequence[npt.NDArray[Any]] | FloatArray,
    down: FloatArray,
    right: FloatArray,
    *,
    ridged: bool,
) -> FloatArray:
    """Return heights between four cells: two above, from the left, and two below. [m]"""
    height, crest = np.zeros(down.shape), np.zeros(down.shape)
    weights = (
        (1.0 - down) * (1.0 - right),
        (1.0 - down) * right,
        down * (1.0 - right),
        down * right,
    )
    for cell_m, weight, side in zip(cells_m, weights, (1.0, -1.0, -1.0, 1.0), strict=True):
        # A cell of no weight must not spread its NaN; less is the rounding of degrees.
        height += np.where(weight > _LEAST_WEIGHT, weight * cell_m, 0.0)
        crest += side * cell_m
    if not ridged:
        return height
    # Bilinear, the middle is a quarter of this below the pair across that is the higher.
    across = np.where(crest > 0.0, down, 1.0 - down)
    lift = np.minimum(right, across) * (1.0 - np.maximum(right, across))
    return np.where(lift > 0.0, height + np.abs(crest) * lift, height)


def _places_within(
    latitude_deg: FloatArray, longitude_deg: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return 129 places each way of a box, by its corners (2,). (129, 129), (129, 129) [°]"""
    (south, north), (west, east) = latitude_deg, longitude_deg
    across = np.linspace(0.0, (east - west) % 360.0, _COMPARED)
    latitude, longitude = np.meshgrid(np.linspace(south, north, _COMPARED), west + across)
    return latitude, longitude


def _most_apart(
    tile: TerrainTile, other: TerrainTile, latitude_deg: FloatArray, longitude_deg: FloatArray
) -> tuple[float, float, float] | None:
    """Return how far a tile is above another at most in a box, and where; ``None``: nowhere common. [m, °]"""
    south, north = latitude_deg
    west, width = longitude_deg[0], (longitude_deg[1] - longitude_deg[0]) % 360.0
    low, high = 0.0, width
    for one in (tile, other):
        south, north = max(south, one.bounds_deg[0]), min(north, one.bounds_deg[2])
        begin = (one.bounds_deg[1] - west + 180.0) % 360.0 - 180.0
        across = (one.bounds_deg[3] - one.bounds_deg[1]) % 360.0 or 360.0
        if across < _NARROW_DEG:
            low, high = max(low, begin), min(high, begin + across)
    if not (south < north and low < high):
        return None
    places = np.meshgrid(
        np.linspace(south, north, _COMPARED), west + np.linspace(low, high, _COMPARED)
    )
    latitude, longitude = (axis.ravel() for axis in places)
    # Within half a cell of its edge a tile repeats its last cells: a neighbour goes on there.
    inside = np.ones(latitude.shape, bool)
    for one in (tile, other):
        for axis, size in zip(
            one.row_column(latitude, longitude), one.heights_amsl_m.shape, strict=True
        ):
            inside &= (axis > _LEAST_WEIGHT) & (axis < size - 1.0 - _LEAST_WEIGHT)
    latitude, longitude = latitude[inside], longitude[inside]
    apart_m = tile.height_amsl_m(latitude, longitude) - other.height_amsl_m(latitude, longitude)
    apart_m = np.nan_to_num(apart_m)
    if not len(apart_m):
        return None
    most = int(np.abs(apart_m).argmax())
    return float(apart_m[most]), float(latitude[most]), float(longitude[most])


def _crossings(place: FloatArray, least: int, most: int) -> tuple[IntArray, FloatArray]:
    """Return where lines, by their ends in cells (n, 2), pass centres of the cells and half a cell beyond."""
    low = np.clip(np.nan_to_num(place.min(axis=1), nan=0.0), least - 1.0, most + 1.0)
    high = np.clip(np.nan_to_num(place.max(axis=1), nan=0.0), least - 1.0, most + 1.0)
    first, last = np.ceil(low).astype(np.intp), np.floor(high).astype(np.intp)
    count = np.maximum(last - first + 1, 0)
    line = np.repeat(np.arange(len(place)), count)
    number = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
    level = (first[line] + number).astype(np.float64)
    beyond = (least - 0.5, most + 0.5)
    edges = [np.flatnonzero((low < edge) & (high > edge)) for edge in beyond]
    line = np.concatenate((line, *edges))
    level = np.concatenate((level, np.repeat(beyond, [len(edge) for edge in edges])))
    begin, way = place[line, 0], place[line, 1] - place[line, 0]
    crosses = np.isfinite(way) & (way != 0.0)
    line = line[crosses]
    return line, np.clip((level[crosses] - begin[crosses]) / way[crosses], 0.0, 1.0)


def read_terrain(*paths: str | PathLike[str]) -> TerrainGrid:
    """Read terrain files: GeoTIFF of any georeferenced kind, or SRTM ``.hgt``.

    Heights are read as above mean sea level, as SRTM (EGM96) and Copernicus (EGM2008) give them.

    Parameters
    ----------
    *paths : path
        One file or more; where they overlap, the best first.

    Raises
    ------
    TerrainFileError
        If a file cannot be read, does not say where or in what it measures, or rasterio, which
        reads it, is not installed.
    """
    if not paths:
        msg = "at least one terrain file is needed"
        raise ValueError(msg)
    return TerrainGrid(tiles=tuple(_read_tile(Path(path)) for path in paths))


def _read_tile(path: Path) -> TerrainTile:
    source = str(path)
    # One driver by name: others would follow references to further files and hosts.
    driver = "SRTMHGT" if path.suffix.lower() == ".hgt" else "GTiff"
    with _opened(path, driver) as raster:
        from rasterio.warp import transform, transform_bounds

        problem = _raster_problem(raster)
        if problem is not None:
            raise TerrainFileError(problem, source=source)
        heights: npt.NDArray[np.float32] | WindowedHeights = WindowedHeights(
            path, driver, (raster.height, raster.width)
        )
        if raster.width * raster.height <= _MOST_READ:
            heights = _heights(raster, None)
        crs, affine = raster.crs, tuple(raster.transform)[:6]
        west, south, east, north = transform_bounds(crs, _WGS84, *raster.bounds)
        # The cell in the middle and its neighbours to the right and below.
        row, column = (size / 2.0 for size in heights.shape)
        a, b, c, d, e, f = affine
        cells = ((row, column), (row, column + 1), (row + 1, column))
        xs, ys = zip(*((a * j + b * i + c, d * j + e * i + f) for i, j in cells), strict=True)
        longitude, latitude = transform(crs, _WGS84, xs, ys)

    places = np.array([[south, north, *latitude], [west, east, *longitude]])
    if not (np.abs(places) <= [[_MOST_NORTH_DEG], [_MOST_EAST_DEG]]).all():
        msg = "its cells are nowhere on the Earth; georeference it"
        raise TerrainFileError(msg, source=source)
    cell_m = float(np.min(distance_m(latitude[0], longitude[0], latitude[1:], longitude[1:])))
    if not cell_m >= _LEAST_CELL_M:
        msg = "its cells have no width or no height; georeference the file"
        raise TerrainFileError(msg, source=source)
    return TerrainTile(
        source=source,
        heights_amsl_m=heights,
        transform=affine,
        projection_wkt=None if crs.to_epsg() == 4326 else crs.to_wkt(),
        bounds_deg=(south, west, north, east),
        cell_m=cell_m,
    )


@contextmanager
def _opened(path: Path, driver: str) -> Iterator[Any]:
    """Open a raster; what is wrong with it, then or while it is read, is an error of its file."""
    with libraries_of("terrain"):
        import rasterio
        from rasterio._err import CPLE_BaseError
        from rasterio.errors import NotGeoreferencedWarning, RasterioError
    if not path.is_file():
        msg = "is not a file" if path.exists() else "no such file"
        raise TerrainFileError(msg, source=str(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)  # an error of ours
            raster = rasterio.open(path, driver=driver)
        with raster:
            yield raster
    except (RasterioError, CPLE_BaseError, ValueError) as error:
        # ValueErrors are those of coordinate systems, and of texts that are not UTF-8.
        msg = (
            "this is no readable GeoTIFF or .hgt file (a .hgt file must be complete and named "
            "after its place, such as N47E008.hgt)"
        )
        raise TerrainFileError(msg, source=str(path)) from error


def _heights(
    raster: Any,  # noqa: ANN401 - rasterio has no types
    window: tuple[tuple[int, int], tuple[int, int]] | None,
) -> npt.NDArray[np.float32]:
    """Return heights of a window, or of all; NaN where there are none. [m]"""
    read = raster.read(1, window=window, masked=True)
    heights: npt.NDArray[np.float32] = read.astype(np.float32).filled(np.nan)
    with np.errstate(over="ignore", invalid="ignore"):  # what is no height then is none below
        heights *= np.float32(raster.scales[0])
        heights += np.float32(raster.offsets[0])
    heights[~((heights > _LOWEST_GROUND_M) & (heights < _HIGHEST_GROUND_M))] = np.nan
    heights.flags.writeable = False
    return heights


def _raster_problem(raster: Any) -> str | None:  # noqa: ANN401 - rasterio has no types
    """Return what keeps a raster from being ground heights in metres, if anything."""
    crs = raster.crs
    if crs is None or tuple(raster.transform)[:6] == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0):
        return "the file does not say where on the Earth it is; georeference it"
    a, b, _, d, e, _ = tuple(raster.transform)[:6]
    unit = (raster.units[0] or "").lower()
    problems = (
        (
            not (crs.is_geographic or crs.is_projected),
            "the file's coordinates are not tied to the Earth; georeference it",
        ),
        (
            not 0.0 < abs(a * e - b * d) < math.inf,
            "its cells have no width or no height; georeference the file",
        ),
        (
            crs.to_epsg() == 4979,
            "the heights are above the ellipsoid; convert them to heights above sea level",
        ),
        (raster.count != 1, f"the file has {raster.count} bands, where a height grid has one"),
        (
            raster.dtypes[0] in {"uint8", "int8"},
            "the file has 8-bit values: a picture of the terrain, not its heights",
        ),
        (unit not in _METRES, f"the heights are in {unit!r}; convert them to metres"),
        (
            math.prod(raster.block_shapes[0]) > _MOST_READ,
            f"{raster.width} × {raster.height} cells in one piece; save them with -co TILED=YES",
        ),
    )
    return next((message for is_so, message in problems if is_so), None)
