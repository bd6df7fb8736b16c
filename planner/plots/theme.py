"""One style for every picture: colours that colour-blind readers tell apart, on light and on dark.

The hues are those of Okabe and Ito (2008), "Color Universal Design"; no picture tells anything by
colour alone.
"""

from __future__ import annotations

from typing import Any, Literal

from planner.flight.state import FlightState

Scheme = Literal["light", "dark"]

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

_INK = {"light": "#1f2328", "dark": "#e6edf3"}
_FAINT = {"light": "#d0d7de", "dark": "#3d444d"}
FONT = "system-ui, 'Segoe UI', Roboto, 'Noto Sans', Arial, sans-serif"


def chart_config(scheme: Scheme) -> dict[str, Any]:
    """Return Vega-Lite's configuration of a scheme; the background stays that of the page."""
    ink, faint = _INK[scheme], _FAINT[scheme]
    text = {"labelColor": ink, "titleColor": ink}
    return {
        "background": "transparent",
        "font": FONT,
        "view": {"stroke": faint},
        "axis": {
            **text,
            "domainColor": faint,
            "gridColor": faint,
            "gridOpacity": 0.6,
            "tickColor": faint,
            "labelFontSize": 11,
            "titleFontSize": 12,
            "titleFontWeight": "normal",
        },
        "legend": {**text, "labelFontSize": 11, "titleFontSize": 12, "titleFontWeight": "normal"},
        "title": {"color": ink, "fontSize": 14, "anchor": "start", "subtitleColor": ink},
        "text": {"color": ink},
        "rule": {"color": ink},
    }
