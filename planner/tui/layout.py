"""Where the panes of a review are: one at a time, or all at once on a large terminal."""

from __future__ import annotations

LAYOUT = """
ReviewScreen .pane { height: 1fr; width: 1fr; }
ReviewScreen Panes { height: 1fr; }

ReviewScreen.-narrow .pane, ReviewScreen.-low .pane { display: none; }
ReviewScreen.-narrow .pane.-current, ReviewScreen.-low .pane.-current { display: block; }
ReviewScreen.-narrow #findings, ReviewScreen.-low #findings { height: 2fr; max-height: 40%; }
ReviewScreen.-narrow #details, ReviewScreen.-low #details {
    border-top: solid $foreground 40%;
    border-title-color: $foreground;
    height: 3fr;
}
ReviewScreen.-narrow #details.-small, ReviewScreen.-low #details.-small {
    height: 7;
    dock: bottom;
}

ReviewScreen.-wide.-high #pane-bar { display: none; }
ReviewScreen.-wide.-high Panes {
    layout: grid;
    grid-size: 3 3;
    grid-columns: 1.2fr 1fr 42;
    grid-rows: 1fr 1fr 1fr;
}
ReviewScreen.-wide.-high .pane {
    display: block;
    border: round $foreground 40%;
    border-title-color: $foreground;
    height: 100%;
    max-height: 100%;
}
ReviewScreen.-wide.-high .pane:focus, ReviewScreen.-wide.-high .pane:focus-within {
    border: round $primary;
    border-title-style: bold;
}
ReviewScreen.-wide.-high #what-if { row-span: 3; }
"""
