from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Transformer
from thinning import examples

from planner.errors import ExitCode, MissingLibraryError, TerrainFileError
from planner.geo.terrain import TerrainGrid, TerrainTile, WindowedHeights, read_terrain

if TYPE_CHECKING:
    from pathlib import Path

    from planner.arrays import FloatArray

NODATA = -9999.0


def write_tiff(
    path: Path,
    heights: Any,  # noqa: ANN401 - an array of any type, or nested lists
    *,
    west: float = 8.0,
    north: float = 47.0,
    cell: float = 0.1,
    crs: str | None = "EPSG:4326",
    unit: str | None = None,
    nodata: float | None = NODATA,
    south_up: bool = False,
) -> Path:
    values = np.atleast_3d(np.asarray(heights))
    values = np.moveaxis(values, 2, 0)  # bands first
    if values.dtype.kind == "f":
        values = values.astype(np.float32)
    rows = values.shape[1]
    transform = rasterio.Affine(cell, 0.0, west, 0.0, -cell, north)
    if south_up:
        transform = rasterio.Affine(cell, 0.0, west, 0.0, cell, north - rows * cell)
        values = values[:, ::-1]
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        height=rows,
        width=values.shape[2],
        count=values.shape[0],
        dtype=values.dtype,
        crs=crs,
        transform=transform,
        nodata=nodata,
    ) as raster:
        raster.write(values)
        if unit is not None:
            raster.units = (unit,)
    return path


def write_hgt(path: Path, heights: np.ndarray[Any, np.dtype[np.int16]]) -> Path:
    heights.astype(">i2").tofile(path)
    return path


def height(grid: TerrainGrid, latitude: float, longitude: float) -> float | None:
    found = grid.height_amsl_m(latitude, longitude)
    return None if bool(np.ma.getmaskarray(found)) else float(found)


def test_cells_know_their_centres_and_are_bilinear_between(tmp_path: Path) -> None:
    grid = read_terrain(write_tiff(tmp_path / "a.tif", [[100.0, 200.0], [300.0, 500.0]]))
    # Cells of 0.1° from 8° E, 47° N: centres at 8.05, 8.15 and 46.95, 46.85.
    assert height(grid, 46.95, 8.05) == pytest.approx(100.0, abs=1e-3)
    assert height(grid, 46.85, 8.15) == pytest.approx(500.0, abs=1e-3)
    assert height(grid, 46.95, 8.10) == pytest.approx(150.0, abs=1e-3)
    assert height(grid, 46.90, 8.10) == pytest.approx((100 + 200 + 300 + 500) / 4, abs=1e-3)
    # A quarter right, three quarters down: ¾·¼·100 + ¼·¼·200 + ¾·¾·300 + ¼·¾·500.
    assert height(grid, 46.875, 8.075) == pytest.approx(293.75, abs=1e-3)


@given(st.floats(46.05, 46.95), st.floats(8.05, 8.95))
@settings(max_examples=examples(50), deadline=None)
def test_a_plane_is_reproduced_exactly(latitude: float, longitude: float) -> None:
    centres = np.arange(10) * 0.1 + 0.05
    tile = TerrainTile(
        source="plane",
        heights_amsl_m=(
            500.0 + 1000.0 * (-centres[:, None]) + 300.0 * centres[None, :] + 1000.0
        ).astype(np.float32),
        transform=(0.1, 0.0, 8.0, 0.0, -0.1, 47.0),
        projection_wkt=None,
        bounds_deg=(46.0, 8.0, 47.0, 9.0),
        cell_m=7600.0,
    )
    expected = 1500.0 + 1000.0 * (latitude - 47.0) + 300.0 * (longitude - 8.0)
    # Heights are kept as 32-bit floats: 1e-4 m at 1500 m.
    assert height(TerrainGrid(tiles=(tile,)), latitude, longitude) == pytest.approx(
        expected, abs=1e-3
    )


def test_the_edge_reaches_half_a_cell_beyond_the_last_centre_and_no_farther(tmp_path: Path) -> None:
    grid = read_terrain(write_tiff(tmp_path / "a.tif", [[100.0, 200.0], [300.0, 500.0]]))
    assert height(grid, 46.999, 8.001) == pytest.approx(100.0)
    assert height(grid, 46.801, 8.199) == pytest.approx(500.0)
    for latitude, longitude in ((47.001, 8.1), (46.799, 8.1), (46.9, 7.999), (46.9, 8.201)):
        assert height(grid, latitude, longitude) is None
    assert grid.tiles[0].bounds_deg == pytest.approx((46.8, 8.0, 47.0, 8.2))


def test_what_is_not_known_is_masked_and_never_zero(tmp_path: Path) -> None:
    grid = read_terrain(write_tiff(tmp_path / "a.tif", [[100.0, NODATA], [300.0, 500.0]]))
    found = grid.height_amsl_m([46.95, 46.95, 46.93, 0.0], [8.05, 8.15, 8.08, 0.0])
    # On a cell's centre its neighbours have no say; between centres all four must be known.
    assert np.ma.getmaskarray(found).tolist() == [False, True, True, True]
    assert np.isnan(found.data[1:]).all()


@pytest.mark.parametrize("void", [-32768.0, -9999.0, 3.4e38, np.nan])
def test_undeclared_voids_are_no_heights(tmp_path: Path, void: float) -> None:
    path = write_tiff(tmp_path / "a.tif", [[100.0, void], [100.0, 100.0]], nodata=None)
    assert height(read_terrain(path), 46.95, 8.15) is None
    assert height(read_terrain(path), 46.95, 8.05) == pytest.approx(100.0)


def test_shapes_broadcast(tmp_path: Path) -> None:
    grid = read_terrain(write_tiff(tmp_path / "a.tif", np.full((2, 2), 7.0)))
    assert grid.height_amsl_m(np.full((3, 1), 46.9), np.full(4, 8.1)).shape == (3, 4)


def test_a_south_up_file_gives_the_same_heights(tmp_path: Path) -> None:
    values = [[100.0, 200.0], [300.0, 500.0]]
    one = read_terrain(write_tiff(tmp_path / "a.tif", values))
    other = read_terrain(write_tiff(tmp_path / "b.tif", values, south_up=True))
    assert height(one, 46.875, 8.075) == pytest.approx(height(other, 46.875, 8.075), abs=1e-3)


def test_an_srtm_file_reaches_over_its_whole_degree(tmp_path: Path) -> None:
    values = np.full((1201, 1201), 50, np.int16)
    values[0, 0], values[1200, 1200], values[600, 600] = 1000, 2000, -32768
    grid = read_terrain(write_hgt(tmp_path / "S01W001.hgt", values))
    # Its samples lie on the edges of the degree: the first on the north-western corner.
    assert height(grid, 0.0, -1.0) == pytest.approx(1000.0)
    assert height(grid, -1.0, 0.0) == pytest.approx(2000.0)
    assert height(grid, -0.5, -0.5) is None
    assert height(grid, -0.25, -0.25) == pytest.approx(50.0)
    # 3″ of the equator: 30.87 m each second.
    assert grid.tiles[0].cell_m == pytest.approx(92.1, abs=0.8)


@pytest.mark.parametrize("order", [1, -1])
def test_between_tiles_side_by_side_the_ground_is_that_between_their_last_cells(
    tmp_path: Path, order: int
) -> None:
    west = write_tiff(tmp_path / "west.tif", np.full((4, 4), 100.0), west=8.0)
    east = write_tiff(tmp_path / "east.tif", np.full((4, 4), 200.0), west=8.4)
    grid = read_terrain(*[west, east][::order])
    longitude = np.linspace(8.0, 8.8, 401)[1:-1]
    # Their last centres are 8.35 and 8.45: 1 m of height in 0.001°.
    expected = np.clip(100.0 + (longitude - 8.35) * 1000.0, 100.0, 200.0)
    for latitude in (46.8, 46.62):  # 0.02° from the southern edge both go on as their last row
        found = grid.height_amsl_m(latitude, longitude).filled(np.nan)
        np.testing.assert_allclose(found, expected, atol=1e-3)


def pieces(
    folder: Path,
    heights: np.ndarray[Any, np.dtype[np.float64]],
    cuts: tuple[int | None, int | None],
    overlap: int,
    **place: Any,  # noqa: ANN401 - options of `write_tiff`
) -> list[TerrainTile]:
    """Return a grid cut before a row, a column or both; the first part has some cells of the next."""
    north, west, cell = place["north"], place["west"], place["cell"]
    spans = [
        [(0, size)] if cut is None else [(0, cut + overlap), (cut, size)]
        for cut, size in zip(cuts, heights.shape, strict=True)
    ]
    paths = [
        write_tiff(
            folder / f"{top}-{left}-{overlap}.tif",
            heights[top:bottom, left:right],
            **{**place, "north": north - top * cell, "west": west + left * cell},
        )
        for top, bottom in spans[0]
        for left, right in spans[1]
    ]
    return list(read_terrain(*paths).tiles)


GEOGRAPHIC = {"west": 8.0 - 0.5 / 3600, "north": 47.0 + 0.5 / 3600, "cell": 1 / 3600}
PROJECTED = {"west": 500_010.0, "north": 5_205_000.0, "cell": 30.0, "crs": "EPSG:32632"}


@pytest.mark.parametrize("place", [GEOGRAPHIC, PROJECTED], ids=["WGS 84", "UTM"])
@pytest.mark.parametrize("overlap", [0, 1, 2])
@pytest.mark.parametrize("cuts", [(None, 7), (5, None), (5, 7), (11, 15), (1, 1)])
def test_a_grid_cut_into_files_is_the_grid(
    tmp_path: Path, cuts: tuple[int | None, int | None], overlap: int, place: dict[str, Any]
) -> None:
    """In every order, with holes beside the cut and elsewhere, up to half a cell beyond the last centres."""
    random = np.random.default_rng(3)
    heights = random.uniform(400.0, 500.0, (12, 16))
    heights[[1, 5, 4, 9], [7, 2, 6, 12]] = NODATA
    whole = read_terrain(write_tiff(tmp_path / "whole.tif", heights, **place))
    tiles = pieces(tmp_path, heights, cuts, overlap, **place)
    south, west, north, east = whole.tiles[0].bounds_deg
    places = random.uniform(south, north, 2000), random.uniform(west, east, 2000)
    beyond = random.uniform(south - 2e-4, north + 2e-4, 500), np.full(500, east + 1e-5)
    lines = random.uniform(south, north, (20, 2)), random.uniform(west, east, (20, 2))
    for order in (tiles, tiles[::-1], tiles[1:] + tiles[:1], tiles[2:] + tiles[:2]):
        grid = TerrainGrid(tiles=tuple(order))
        for asked, ridged in ((places, False), (places, True), (beyond, True)):
            np.testing.assert_allclose(
                grid.height_amsl_m(*asked, ridged=ridged).filled(np.nan),
                whole.height_amsl_m(*asked, ridged=ridged).filled(np.nan),
                atol=2e-3,  # what a cell of a weight of 1e-6 adds
            )
        np.testing.assert_allclose(along(grid, *lines), along(whole, *lines), atol=2e-3)


def along(grid: TerrainGrid, latitude: FloatArray, longitude: FloatArray) -> FloatArray:
    """Return the ground under lines at 500 places of each."""
    under, t = grid.under(latitude, longitude), (np.arange(500) + 0.5) / 500
    found = []
    for line in range(len(latitude)):
        own = under.line == line
        part = np.flatnonzero(own)[np.searchsorted(under.start[own], t, side="right") - 1]
        way = (t - under.start[part]) / (under.end[part] - under.start[part])
        first, last = under.ground_amsl_m[part].T
        found.append(first + way * (last - first))
    return np.array(found)


@pytest.mark.parametrize(
    ("gap_deg", "is_known"), [(0.0, True), (1e-8, True), (1e-6, False), (0.03, False)]
)
@pytest.mark.parametrize("order", [1, -1])
def test_only_a_gap_of_rounding_between_files_is_none(
    tmp_path: Path, gap_deg: float, order: int, *, is_known: bool
) -> None:
    """1e-8° are a ten-millionth of a cell here: degrees of files edge to edge are apart by less."""
    west = write_tiff(tmp_path / "west.tif", np.full((4, 4), 100.0), west=8.0)
    east = write_tiff(tmp_path / "east.tif", np.full((4, 4), 100.0), west=8.4 + gap_deg)
    grid = read_terrain(*[west, east][::order])
    under = grid.under(np.array([[46.8, 46.82]]), np.array([[8.3, 8.5]]))
    assert bool(np.isfinite(under.ground_amsl_m).all()) is is_known
    assert (height(grid, 46.8, 8.4 + 0.5 * gap_deg) is not None) is is_known


@pytest.mark.parametrize("order", [1, -1])
def test_beside_a_file_of_other_cells_the_higher_of_both_counts(tmp_path: Path, order: int) -> None:
    """Cells of 0.2° with centres at 8.3° E end at 8.4° E; one of 0.1° beside them, at 8.45° E, is a peak."""
    fine = np.full((8, 4), 100.0)
    fine[3, 0] = 300.0  # 46.65 N, between rows of the coarse file at 46.7 and 46.5
    west = write_tiff(tmp_path / "west.tif", np.full((4, 2), 100.0), west=8.0, cell=0.2)
    east = write_tiff(tmp_path / "east.tif", fine, west=8.4)
    grid = read_terrain(*[west, east][::order])
    # From 100 m a fine cell before it: the way to 8.45 from 8.35 is 0.1°.
    assert height(grid, 46.65, 8.45) == pytest.approx(300.0, abs=1e-3)
    assert height(grid, 46.65, 8.41) == pytest.approx(220.0, abs=1e-3)
    assert height(grid, 46.65, 8.39) == pytest.approx(180.0, abs=1e-3)
    # Between centres of a file that file counts.
    assert height(grid, 46.65, 8.299) == pytest.approx(100.0, abs=1e-3)


@pytest.mark.parametrize("order", [1, -1])
def test_a_file_ends_at_its_last_centres_where_another_goes_on(tmp_path: Path, order: int) -> None:
    small = write_tiff(tmp_path / "small.tif", np.full((2, 2), 100.0))
    wide = write_tiff(tmp_path / "wide.tif", np.full((6, 6), 150.0), west=7.8, north=47.2)
    grid = read_terrain(*[small, wide][::order])
    # The small one's centres are 8.05 and 8.15.
    assert height(grid, 46.9, 8.051) == pytest.approx(100.0 if order == 1 else 150.0)
    assert height(grid, 46.9, 8.049) == pytest.approx(150.0)


def test_the_first_tile_that_knows_the_height_tells_it(tmp_path: Path) -> None:
    fine = write_tiff(tmp_path / "fine.tif", [[100.0, NODATA], [100.0, NODATA]])
    coarse = write_tiff(tmp_path / "coarse.tif", np.full((2, 2), 150.0))
    grid = read_terrain(fine, coarse)
    assert height(grid, 46.95, 8.05) == pytest.approx(100.0)
    assert height(grid, 46.95, 8.15) == pytest.approx(150.0)


@pytest.mark.parametrize("west", [179.8, -180.2])
def test_a_tile_across_the_antimeridian_is_found_from_both_sides(
    tmp_path: Path, west: float
) -> None:
    grid = read_terrain(
        write_tiff(tmp_path / "a.tif", [[10.0, 20.0, 30.0, 40.0]] * 2, west=west, north=0.1)
    )
    assert height(grid, 0.0, 179.95) == pytest.approx(20.0)
    assert height(grid, 0.0, -179.95) == pytest.approx(30.0)
    assert height(grid, 0.0, 180.0) == pytest.approx(25.0)
    assert height(grid, 0.0, -180.0) == pytest.approx(25.0)


def test_a_projected_grid_is_asked_in_its_own_coordinates(tmp_path: Path) -> None:
    # UTM 32: 100 m cells, heights rising by 1 m per 100 m east and 2 m per 100 m south.
    values = 500.0 + np.arange(20)[None, :] + 2.0 * np.arange(10)[:, None]
    path = write_tiff(
        tmp_path / "utm.tif",
        values,
        west=430_000.0,
        north=5_205_000.0,
        cell=100.0,
        crs="EPSG:32632",
    )
    grid = read_terrain(path)
    longitude, latitude = Transformer.from_crs("EPSG:32632", "EPSG:4326", always_xy=True).transform(
        431_000.0, 5_204_500.0
    )
    # 9.5 columns and 4.5 rows from the first centre.
    assert height(grid, latitude, longitude) == pytest.approx(500.0 + 9.5 + 9.0, abs=1e-2)
    assert height(grid, latitude + 1.0, longitude) is None
    assert height(grid, -80.0, -100.0) is None
    # 1 / 0.9997 on the ground at this distance from the central meridian.
    assert grid.tiles[0].cell_m == pytest.approx(100.0, abs=0.1)


def _no_file(folder: Path) -> Path:
    return folder / "missing.tif"


def _text_file(folder: Path) -> Path:
    path = folder / "notes.tif"
    path.write_text("not a raster", encoding="utf-8")
    return path


def _short_hgt(folder: Path) -> Path:
    return write_hgt(folder / "N47E008.hgt", np.zeros((11, 11), np.int16))


def _cut_off_tiff(folder: Path) -> Path:
    path = write_tiff(folder / "cut.tif", np.full((50, 50), 1.0))
    path.write_bytes(path.read_bytes()[:-5000])
    return path


@pytest.mark.parametrize("make", [_text_file, _short_hgt, _cut_off_tiff])
def test_a_file_that_is_no_raster_is_refused(tmp_path: Path, make: Any) -> None:  # noqa: ANN401 - any of the functions above
    path = make(tmp_path)
    with pytest.raises(TerrainFileError, match="no readable GeoTIFF") as caught:
        read_terrain(path)
    assert caught.value.source == str(path)
    assert caught.value.exit_code is ExitCode.UNUSABLE


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(TerrainFileError, match=r"missing\.tif: no such file"):
        read_terrain(_no_file(tmp_path))


@pytest.mark.parametrize(
    ("heights", "options", "message"),
    [
        (np.ones((2, 2)), {"crs": None}, "where on the Earth"),
        (np.ones((2, 2, 3)), {}, "has 3 bands"),
        (np.ones((2, 2), np.uint8), {"nodata": 0}, "a picture of the terrain"),
        (np.ones((2, 2)), {"unit": "ft"}, "heights are in 'ft'"),
        (np.ones((2, 2)), {"crs": "EPSG:4979"}, "above the ellipsoid"),
        (np.ones((2, 2)), {"cell": 1e-12}, "no width or no height"),
        (np.ones((2, 2)), {"cell": 1e100}, "nowhere on the Earth"),
    ],
)
def test_a_raster_that_does_not_say_where_and_what_it_is_is_refused(
    tmp_path: Path,
    heights: Any,  # noqa: ANN401 - an array of any type
    options: dict[str, Any],
    message: str,
) -> None:
    path = write_tiff(tmp_path / "a.tif", heights, **options)
    with pytest.raises(TerrainFileError, match=message):
        read_terrain(path)


def test_metres_may_be_named(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", np.full((2, 2), 7.0), unit="metre")
    assert height(read_terrain(path), 46.9, 8.1) == pytest.approx(7.0)


def test_without_rasterio_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(MissingLibraryError, match=r"pip install 'mavjoule\[terrain\]'"):
        read_terrain(tmp_path / "a.tif")


def test_no_file_at_all_is_a_mistake_of_the_caller() -> None:
    with pytest.raises(ValueError, match="at least one terrain file"):
        read_terrain()


def _sparse(path: Path, *, side: int, **layout: object) -> Path:
    """Write a file of many cells of which few are stored: 1″ each, from 48° north and 8° east."""
    profile = {
        "driver": "GTiff",
        "count": 1,
        "dtype": "int16",
        "nodata": NODATA,
        "crs": "EPSG:4326",
        "height": side,
        "width": side,
        "compress": "deflate",
        "SPARSE_OK": True,
        "transform": rasterio.Affine(1 / 3600, 0.0, 8.0, 0.0, -1 / 3600, 48.0),
    }
    with rasterio.open(path, "w", **profile, **layout) as raster:
        if layout.get("tiled"):
            row = np.arange(side - 256, side)[:, None] // 16
            raster.write(
                np.repeat(row, 256, axis=1).astype(np.int16),
                1,
                window=((side - 256, side), (0, 256)),
            )
    return path


def test_of_a_large_file_only_windows_are_read(tmp_path: Path) -> None:
    side = 36_000  # 10°: 1.3 thousand million cells, 5 GB of heights
    path = _sparse(tmp_path / "a.tif", side=side, tiled=True, blockxsize=256, blockysize=256)
    grid = read_terrain(path)
    heights = grid.tiles[0].heights_amsl_m
    assert isinstance(heights, WindowedHeights)
    # The centre of the last row but 100 and of the 51st column.
    found = height(grid, 48.0 - (side - 99.5) / 3600, 8.0 + 50.5 / 3600)
    assert found == pytest.approx((side - 100) // 16, abs=1e-6)  # places are rounded degrees
    assert height(grid, 47.0, 17.0) is None
    assert len(heights._windows) <= 8


def test_windows_give_the_heights_of_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(4)
    heights = random.integers(0, 3000, (1100, 700)).astype(np.int16)
    path = write_tiff(tmp_path / "a.tif", heights, cell=0.001)
    whole = read_terrain(path)
    monkeypatch.setattr("planner.geo.terrain._MOST_READ", 100_000)
    windows = read_terrain(path)
    assert isinstance(windows.tiles[0].heights_amsl_m, WindowedHeights)
    south, west, north, east = whole.tiles[0].bounds_deg
    latitudes = random.uniform(south - 0.01, north + 0.01, (40, 50))
    longitudes = random.uniform(west - 0.01, east + 0.01, (40, 50))
    for grid in (whole, windows):
        assert grid.height_amsl_m(latitudes, longitudes).shape == (40, 50)
    np.testing.assert_array_equal(
        windows.height_amsl_m(latitudes, longitudes).filled(np.nan),
        whole.height_amsl_m(latitudes, longitudes).filled(np.nan),
    )
    near = np.array([south + 0.02, south + 0.05]), np.array([west + 0.1, west + 0.2])
    higher = [grid.tiles[0].centres_above(2500.0, *near) for grid in (whole, windows)]
    assert len(higher[0][0]) > 0
    np.testing.assert_array_equal(higher[0], higher[1])


def test_many_cells_in_one_piece_are_refused_before_they_are_unpacked(tmp_path: Path) -> None:
    path = _sparse(tmp_path / "a.tif", side=16_000, blockysize=16_000)
    with pytest.raises(TerrainFileError, match=r"16000 × 16000 cells in one piece; save them"):
        read_terrain(path)
