"""Base maps: where their tiles lie, and who serves them.

Tiles are the squares of Web Mercator (EPSG:3857) as map servers number them: :math:`2^z` by :math:`2^z` at
zoom z, x from the date line to the east, y from 85.05° north to the south [1]_.

References
----------
.. [1] OpenStreetMap wiki, "Slippy map tilenames".
"""

from __future__ import annotations

import math

from planner.values import Value

_PARTS = ("{z}", "{x}", "{y}")
_DEEPEST = 19
_KNOWN = {"openstreetmap.org": "© OpenStreetMap contributors"}
"""What servers ask for, by the end of their host."""
_NORTHERNMOST_DEG = 85.05


class TileServer(Value, kw_only=False):
    """Who serves the tiles of a base map."""

    address: str
    """With {z}, {x} and {y}."""
    attribution: str
    """Whom the page names for it."""

    @property
    def origin(self) -> str:
        """Scheme and host, as a page's policy names them."""
        from urllib.parse import urlsplit  # few pages have a base map

        parts = urlsplit(self.address)
        return f"{parts.scheme}://{parts.netloc}"


def read_tile_server(text: str) -> TileServer:
    """Return the server of ``https://host/{z}/{x}/{y}.png``, with ``#whom to name`` if that is given."""
    from urllib.parse import unquote, urlsplit

    address, _, named = text.strip().partition("#")
    try:
        parts = urlsplit(address)
        host = parts.hostname or ""
        is_plain = address.isascii() and not any(one in address for one in " \"';<>,")
    except ValueError:
        host, is_plain = "", False
    if not (host and is_plain and parts.scheme in {"https", "http"}):
        msg = f"expected an address such as https://host/{{z}}/{{x}}/{{y}}.png, got {text!r}"
        raise ValueError(msg)
    if missing := [part for part in _PARTS if part not in address]:
        msg = f"expected {', '.join(_PARTS)} in the address of tiles, {', '.join(missing)} missing: {text!r}"
        raise ValueError(msg)
    known = next((words for end, words in _KNOWN.items() if f".{host}".endswith(f".{end}")), host)
    return TileServer(address, unquote(named).strip() or known)


def tile_server_text(server: TileServer) -> str:
    """Return what reads back as a server."""
    return f"{server.address}#{server.attribution}"


class Tile(Value, kw_only=False):
    """A square of a base map."""

    zoom: int
    x: int
    y: int

    @property
    def north_west_deg(self) -> tuple[float, float]:
        """Latitude and longitude of its corner. [°]"""
        count = 2**self.zoom
        latitude_rad = math.atan(math.sinh(math.pi * (1.0 - 2.0 * self.y / count)))
        return math.degrees(latitude_rad), 360.0 * self.x / count - 180.0

    @property
    def south_east_deg(self) -> tuple[float, float]:
        """Latitude and longitude of the corner across. [°]"""
        return Tile(self.zoom, self.x + 1, self.y + 1).north_west_deg

    def at(self, server: TileServer) -> str:
        """Return its address at a server."""
        address = server.address
        for part, number in zip(_PARTS, (self.zoom, self.x, self.y), strict=True):
            address = address.replace(part, str(number))
        return address


def tile_at(latitude_deg: float, longitude_deg: float, zoom: int) -> Tile:
    """Return the tile a place lies in; beyond the northernmost and southernmost that one."""
    count = 2**zoom
    latitude_rad = math.radians(max(-_NORTHERNMOST_DEG, min(_NORTHERNMOST_DEG, latitude_deg)))
    down = 0.5 * (1.0 - math.asinh(math.tan(latitude_rad)) / math.pi)
    across = (longitude_deg + 180.0) / 360.0
    return Tile(zoom, min(int(across * count), count - 1), min(int(down * count), count - 1))


def tiles_over(
    south_west_deg: tuple[float, float], north_east_deg: tuple[float, float], *, most: int
) -> list[Tile]:
    """Return the tiles over an area, as fine as so many allow, from the north-west on, row by row."""
    for zoom in range(_DEEPEST, -1, -1):
        first = tile_at(north_east_deg[0], south_west_deg[1], zoom)
        last = tile_at(south_west_deg[0], north_east_deg[1], zoom)
        across, down = range(first.x, last.x + 1), range(first.y, last.y + 1)
        if 0 < len(across) * len(down) <= most:
            return [Tile(zoom, x, y) for y in down for x in across]
    return []
