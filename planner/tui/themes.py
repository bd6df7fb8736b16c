"""Light, dark and high contrast."""

from __future__ import annotations

from textual.theme import Theme

HIGH_CONTRAST = Theme(
    name="mavjoule-high-contrast",
    primary="#00ffff",
    secondary="#ffffff",
    accent="#ffff00",
    warning="#ffff00",
    error="#ff9a9a",
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
        "text-error": "#ff9a9a",
        "text-warning": "#ffff00",
        "text-success": "#00ff00",
    },
)
LIGHT = Theme(
    name="mavjoule-light",
    primary="#004578",
    secondary="#0178d4",
    accent="#8f4700",
    warning="#8f4700",
    error="#b0002e",
    success="#1c6b34",
    foreground="#181818",
    background="#e8e8e8",
    surface="#f4f4f4",
    panel="#dcdcdc",
    boost="#e4e4e4",
    dark=False,
    variables={"text-muted": "#484848"},
)
DARK = "textual-dark"
THEMES = (DARK, LIGHT.name, HIGH_CONTRAST.name)
"""The themes a key turns through; the palette offers all that Textual has."""
