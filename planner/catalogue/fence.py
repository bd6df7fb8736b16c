"""Family F: fences and rally points."""

from __future__ import annotations

from planner.findings import Rule, Severity

INVALID_POLYGON = Rule(
    "F105 invalid-polygon",
    Severity.ERROR,
    summary="A fence polygon or circle does not enclose an area.",
    why="An invalid polygon can switch the whole fence off without a word (ArduPilot #7138, #7411); "
    "PX4's test of a point is made for polygons that do not cross themselves.",
    how="Fewer than 3 different vertices, a vertex that is no position, edges that cross or fold "
    "back, an area thinner than 2 cm, a radius that is not positive.  Vertices given twice in a row "
    "are a warning.  The direction of turning does not matter.",
    fix="draw the fence area again",
)

INCLUSION_SEMANTICS = Rule(
    "F106 inclusion-semantics",
    Severity.ERROR,
    summary="No place is inside all the inclusion areas of the fence.",
    why="Inclusion areas look like alternatives, but PX4 (#27099) and ArduPilot demand to be inside "
    "every one of them: with areas apart from each other every flight is a breach.",
    how="The intersection of all inclusion polygons and circles is empty, or thinner than 2 cm.  "
    "ArduPilot takes their union where FENCE_OPTIONS has bit 1; then the rule does not apply.",
    fix="keep one inclusion area, make them overlap, or set bit 1 of FENCE_OPTIONS (ArduPilot)",
)
