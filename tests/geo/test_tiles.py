"""Tiles of base maps: where they lie, and who is named for them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.geo.tiles import Tile, read_tile_server, tile_at, tile_server_text, tiles_over

OSM = "https://tile.openstreetmap.org/{z}/{x}/{y}.png"


def test_the_four_tiles_of_the_first_zoom_meet_at_zero_north_zero_east() -> None:
    # The edge of the square world is at arctan(sinh(π)), 85.0511°.
    assert Tile(1, 0, 0).north_west_deg == pytest.approx((85.0511, -180.0), abs=1e-4)
    assert Tile(1, 0, 0).south_east_deg == pytest.approx((0.0, 0.0), abs=1e-12)
    assert tile_at(10.0, -10.0, 1) == Tile(1, 0, 0)
    assert tile_at(-10.0, 10.0, 1) == Tile(1, 1, 1)
    # At 60° north Mercator's height is ln(tan 75°) = 1.31696: (1 - 1.31696 / π) / 2 × 1024 = 297.4.
    assert tile_at(60.0, 0.0, 10) == Tile(10, 512, 297)


@given(st.floats(-89.0, 89.0), st.floats(-180.0, 179.999), st.integers(0, 19))
def test_a_place_lies_in_its_tile(latitude_deg: float, longitude_deg: float, zoom: int) -> None:
    tile = tile_at(latitude_deg, longitude_deg, zoom)
    north_deg, west_deg = tile.north_west_deg
    south_deg, east_deg = tile.south_east_deg
    seen_deg = min(max(latitude_deg, -85.05), 85.05)
    assert south_deg - 1e-9 <= seen_deg <= north_deg + 1e-9
    assert west_deg - 1e-9 <= longitude_deg <= east_deg + 1e-9


def test_an_area_is_covered_as_finely_as_so_many_tiles_allow() -> None:
    tiles = tiles_over((47.0, 8.0), (47.01, 8.015), most=36)
    assert 9 < len(tiles) <= 36
    assert tiles[0].north_west_deg[0] >= 47.01
    assert tiles[0].north_west_deg[1] <= 8.0
    assert tiles[-1].south_east_deg[0] <= 47.0
    assert tiles[-1].south_east_deg[1] >= 8.015
    assert tiles_over((-80.0, -170.0), (80.0, 170.0), most=1) == [Tile(0, 0, 0)]


def test_a_server_is_named_by_itself_or_as_it_asks() -> None:
    assert read_tile_server(OSM).attribution == "© OpenStreetMap contributors"
    assert read_tile_server("https://a.example/{z}/{x}/{y}").attribution == "a.example"
    named = read_tile_server("https://a.example:8/{z}/{x}/{y}?k=1#© Some%20Body")
    assert named.attribution == "© Some Body"
    assert named.origin == "https://a.example:8"
    assert Tile(3, 2, 1).at(named) == "https://a.example:8/3/2/1?k=1"
    assert read_tile_server(tile_server_text(named)) == named


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("https://a.example/{z}/{x}.png", r"\{y\} missing"),
        ("ftp://a.example/{z}/{x}/{y}", "expected an address"),
        ("{z}/{x}/{y}", "expected an address"),
        ("https://a.example;script-src *//{z}/{x}/{y}", "expected an address"),
        ("https://[::1/{z}/{x}/{y}", "expected an address"),
    ],
)
def test_an_address_without_host_or_parts_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_tile_server(text)
