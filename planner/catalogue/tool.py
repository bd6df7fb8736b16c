"""Family X: what the tool itself could not do."""

from __future__ import annotations

from planner.findings import Rule, Severity

FILE_UNREADABLE = Rule(
    "X901 file-unreadable",
    Severity.ERROR,
    summary="The mission file could not be read.",
    why="A mission that cannot be read cannot be judged; it is never a 'go'.",
    how="The reader refused the file; the message says where and why.  The exit code is 2.",
    fix="mend the file, or save it again from the program that wrote it",
)

NO_TERRAIN_DATA = Rule(
    "X902 no-terrain-data",
    Severity.INFO,
    summary="No terrain is known: the ground is taken to be level with home.",
    why="Heights over ground and landing heights away from home depend on it.",
    how="No terrain grid was given; a warning where a part of the flight lies outside of those given.",
    fix="check heights over ground by other means",
)
