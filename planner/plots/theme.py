"""One style for every picture: colours that colour-blind readers tell apart, on light and on dark.

The hues are those of Okabe and Ito (2008), "Color Universal Design"; no picture tells anything by
colour alone.
"""

from __future__ import annotations

from typing import Any, Literal

from planner.flight.state import FlightState

Scheme = Literal["light", "dark", "page"]
"""``page``: the ink is that of the page around the picture, whatever it is."""

BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, GREY = "#56B4E9", "#CC79A7", "#F0E442", "#8C8C8C"

STATE_COLOURS: dict[str, str] = {
    FlightState.TAKEOFF: ORANGE,
    FlightState.CLIMB: YELLOW,
    FlightState.ACCELERATE: GREEN,
    FlightState.CRUISE: SKY,
    FlightState.BRAKE: PURPLE,
    FlightState.HOVER: GREY,
    FlightState.DESCEND: BLUE,
    FlightState.LAND: RED,
}

BACKGROUND: dict[Scheme, str] = {"light": "#ffffff", "dark": "#0d1117", "page": "transparent"}
_INK: dict[Scheme, str] = {"light": "#1f2328", "dark": "#e6edf3", "page": "currentColor"}
_GRID_OPACITY = 0.15
_FRAME_OPACITY = 0.35
FONT = "system-ui, 'Segoe UI', Roboto, 'Noto Sans', Arial, sans-serif"

_LABEL_GAP_PX = 8
"""Between the labels of an axis: those nearer to each other are left out."""


def chart_config(scheme: Scheme) -> dict[str, Any]:
    """Return Vega-Lite's configuration of a scheme."""
    ink = _INK[scheme]
    text = {
        "labelColor": ink,
        "titleColor": ink,
        "labelFontSize": 11,
        "titleFontSize": 12,
        "titleFontWeight": "normal",
    }
    return {
        "background": BACKGROUND[scheme],
        "font": FONT,
        "view": {"stroke": ink, "strokeOpacity": _FRAME_OPACITY},
        "axis": {
            **text,
            "labelSeparation": _LABEL_GAP_PX,
            "domainColor": ink,
            "domainOpacity": _FRAME_OPACITY,
            "gridColor": ink,
            "gridOpacity": _GRID_OPACITY,
            "tickColor": ink,
            "tickOpacity": _FRAME_OPACITY,
        },
        "legend": {**text, "orient": "bottom", "columns": 4, "symbolStrokeWidth": 2},
        "title": {"color": ink, "fontSize": 14, "anchor": "start", "subtitleColor": ink},
        "text": {"color": ink, "fontSize": 11},
        "rule": {"color": ink},
        "point": {"color": ink},
    }
