"""Light, dark and high contrast."""

from __future__ import annotations

from textual.theme import Theme

HIGH_CONTRAST = Theme(
    name="mavjoule-high-contrast",
    primary="#00ffff",
    secondary="#ffffff",
    accent="#ffff00",
    warning="#ffff00",
    error="#ff6060",
    success="#00ff00",
    foreground="#ffffff",
    background="#000000",
    surface="#000000",
    panel="#202020",
    boost="#303030",
    dark=True,
    text_alpha=1.0,
    variables={
        "block-cursor-background": "#ffff00",
        "block-cursor-foreground": "#000000",
        "footer-key-foreground": "#ffff00",
        "text-muted": "#ffffff",
        "text-error": "#ff6060",
        "text-warning": "#ffff00",
        "text-success": "#00ff00",
    },
)
THEMES = ("textual-dark", "textual-light", HIGH_CONTRAST.name)
"""The themes a key turns through; the palette offers all that Textual has."""
