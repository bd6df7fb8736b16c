"""Family F: fences and rally points."""

from __future__ import annotations

from planner.findings import Rule, Severity

INVALID_POLYGON = Rule(
    code="F105",
    name="invalid-polygon",
    severity=Severity.ERROR,
    summary="A fence polygon or circle does not enclose an area.",
    why=(
        "An invalid polygon can switch the whole fence off without a word (ArduPilot #7138, "
        "#7411); PX4's test of a point is made for polygons that do not cross themselves."
    ),
    how=(
        "Fewer than 3 different vertices, a vertex that is no position, edges that cross or fold "
        "back, an area thinner than 1 cm, a radius that is not positive. Vertices given twice in "
        "a row are a warning. The direction of turning does not matter."
    ),
    example="inclusion polygon 1 crosses itself: the edge after vertex 2 meets that after vertex 4",
    fix="draw the fence area again",
)

INCLUSION_SEMANTICS = Rule(
    code="F106",
    name="inclusion-semantics",
    severity=Severity.ERROR,
    summary="No place is inside all the inclusion areas of the fence.",
    why=(
        "Inclusion areas look like alternatives, but PX4 (#27099) and ArduPilot demand to be "
        "inside every one of them: with areas apart from each other every flight is a breach."
    ),
    how=(
        "The intersection of all inclusion polygons and circles is empty. ArduPilot takes their "
        "union where FENCE_OPTIONS has bit 1; then the rule does not apply."
    ),
    example="inclusion polygon 1 and inclusion circle 1 have no place in common",
    fix="keep one inclusion area, make them overlap, or set bit 1 of FENCE_OPTIONS (ArduPilot)",
)

PATH_CROSSES = Rule(
    code="F101",
    name="path-crosses",
    severity=Severity.ERROR,
    summary="A straight leg leaves the fence.",
    why=(
        "PX4 checks waypoints only: the line between two of them may cross an exclusion (PX4 #22255); "
        "a breach ends the mission in the air."
    ),
    how=(
        "The straight legs between the places of the mission, from home on, against every area of "
        "the fence: by intersection, not by samples."
    ),
    example="the straight way to here is beyond inclusion polygon 1; 1.5 km are outside the fence",
    fix="move the waypoint, or the fence",
)

FENCE_IN_PART = Rule(
    code="F109",
    name="fence-checked-in-part",
    severity=Severity.INFO,
    summary="Not everything about the fence is checked yet.",
    why="A check that is silent about what it leaves out is read as a check of everything.",
    how="The mission has a fence.",
    example="straight legs are checked against the fence; curves and the way home are not",
    fix="keep a distance from the fence that leaves room to stop",
)
