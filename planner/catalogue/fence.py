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
        "back, an area thinner than 2 cm, a radius that is not positive.  Vertices given twice in "
        "a row are a warning.  The direction of turning does not matter."
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
        "The intersection of all inclusion polygons and circles is empty, or thinner than 2 cm.  "
        "ArduPilot takes their union where FENCE_OPTIONS has bit 1; then the rule does not apply."
    ),
    example="inclusion polygon 1 and inclusion circle 1 have no place in common",
    fix="keep one inclusion area, make them overlap, or set bit 1 of FENCE_OPTIONS (ArduPilot)",
)

PATH_CROSSES = Rule(
    code="F101",
    name="path-crosses",
    severity=Severity.ERROR,
    summary="The flight leaves the fence.",
    why=(
        "PX4 checks waypoints only: the line between two of them may cross an exclusion (PX4 #22255); "
        "a breach ends the mission in the air."
    ),
    how=(
        "The whole path as it is flown, corners cut or flown through, splines, take-off and landing, "
        "against every area of the fence and the circle that GF_MAX_HOR_DIST or FENCE_RADIUS draws "
        "around home.  Curves are divided until straight pieces are within 5 cm of them; whole pieces "
        "are cut with whole edges, so that nothing lies between two samples.  Legs and edges are drawn "
        "as the autopilot takes them: PX4's edges are straight in degrees and its legs in metres, "
        "ArduPilot's are both straight in its own metres."
    ),
    example="the flight to here is beyond inclusion polygon 1; 88 m lie outside the fence",
    fix="move the waypoint, or the fence",
)

STOP_BUFFER = Rule(
    code="F102",
    name="stop-buffer",
    severity=Severity.WARNING,
    summary="There is no room to stop before the fence.",
    why=(
        "Fences are noticed when they are passed: PX4 took its predictive fence out as dangerous and "
        "its maintainers ask for a buffer in which the vehicle can stop (PX4 #27465); braking at "
        "14 m/s over a fence ended in a crash (ArduPilot #1971)."
    ),
    how=(
        "At every place of the flight, straight on in the direction of motion: speed times reaction "
        "time, plus the model's distance to stand still from that speed, plus the reaction time times "
        "the wind from behind; and within the position error (or ArduPilot's FENCE_MARGIN) of all of "
        "that.  A warning where this is not free; an error where a stop begun at once ends beyond the "
        "fence. --reaction-time is 1 s (an autopilot's own check takes some tenths of it, a hand on the "
        "switch all of it), --position-error 2.5 m (half of the fixes of a common single-frequency "
        "receiver are nearer).  Places where the vehicle is braking already count at the beginning "
        "and the end of the braking."
    ),
    example=(
        "to stand still from 12.0 m/s takes 45.7 m (12 m to react, 31.2 m to stop, 2.5 m of position "
        "error), inclusion polygon 1 is 14.0 m ahead: 4.9 m/s or less would fit"
    ),
    fix="fly slower there, or turn earlier",
)

RALLY_OUTSIDE = Rule(
    code="F103",
    name="rally-outside",
    severity=Severity.ERROR,
    summary="A rally point lies outside the fence.",
    why="A return to a rally point outside the fence is a breach: it ended in LAND and a crash "
    "(ArduPilot #7333).",
    how="Each rally point against every area of the fence.",
    example="rally point 2 is 35 m beyond inclusion polygon 1",
    fix="move the rally point, or the fence",
)

HOME_OUTSIDE = Rule(
    code="F104",
    name="home-outside",
    severity=Severity.ERROR,
    summary="Home lies outside the fence.",
    why="ArduPilot does not arm outside its fence, PX4 throws a fence away that does not hold home "
    "(PX4 #27099), and a return ends in a breach.",
    how="The home of the mission against every area of the fence.",
    example="home is 120 m beyond inclusion polygon 1",
    fix="move the fence, or the planned home to where the vehicle takes off",
)

LOITER_CROSSES = Rule(
    code="F107",
    name="loiter-crosses",
    severity=Severity.ERROR,
    summary="A loiter circle leaves the fence.",
    why="A circle of 200 m with its centre in the clear was flown 28.9 m into an exclusion "
    "(PX4 #28527): only centres are checked on board.",
    how="The circle as it is flown, its arcs divided until chords are within 5 cm of them.",
    example="the loiter circle is beyond exclusion polygon 1; 41 m lie outside the fence",
    fix="move the centre, or make the circle smaller",
)

RTL_PATH_CROSSES = Rule(
    code="F108",
    name="rtl-path-crosses",
    severity=Severity.WARNING,
    summary="The way home crosses the fence.",
    why="A return flies straight home: from a bay of the fence, or behind an exclusion, it breaches "
    "the fence in the middle of another emergency.",
    how=(
        "The straight way from every place of the flight to where the vehicle itself would return, home "
        "or a rally point or the mission's landing: the triangle between each piece of the path and the "
        "target, so that no place is left out.  The return a mission flies itself is part of its path: "
        "F101."
    ),
    example="the straight way home from here crosses exclusion circle 1, as from 4 items in all",
    fix="add a rally point that is reached in the clear, or move the waypoint",
)

FENCE_IN_PART = Rule(
    code="F109",
    name="fence-checked-in-part",
    severity=Severity.INFO,
    summary="Something about the fence could not be checked.",
    why="A check that is silent about what it leaves out is read as a check of everything.",
    how="Without a planned home the way home is that to where the flight starts.",
    example=(
        "the file says no home: ways home, and distances from home, are taken from where the "
        "flight starts"
    ),
    fix="save the mission with its planned home",
)

FENCE_HEIGHT = Rule(
    code="F110",
    name="fence-height",
    severity=Severity.ERROR,
    summary="The flight leaves the heights the fence allows.",
    why="A ceiling is a fence: passing it ends the mission in the air; a return altitude above it "
    "breaches the fence on every return.",
    how=(
        "The highest place of the flight over home, and the height returns climb to from the items, against "
        "GF_MAX_VER_DIST (PX4) or FENCE_ALT_MAX (ArduPilot, FENCE_TYPE bit 1; its returns stay below it); "
        "the lowest waypoint against FENCE_ALT_MIN (bit 8), to 1 cm.  An error for the mission, a warning "
        "for a return the mission does not fly."
    ),
    example="120 m above home are flown, FENCE_ALT_MAX is 100 m",
    fix="fly lower, or raise the limit",
)

FENCE_OFF = Rule(
    code="F111",
    name="fence-not-enforced",
    severity=Severity.WARNING,
    summary="The vehicle's parameters leave the fence without effect.",
    why="A fence that is uploaded but switched off looks like one that protects.",
    how=(
        "ArduPilot: FENCE_ENABLE and FENCE_AUTOENABLE are 0, FENCE_TYPE has no bit 4 (polygons and "
        "circles), or FENCE_ACTION is 0 (it only reports).  PX4: GF_ACTION is 0 or 1 (it only warns).  "
        "Only where a parameter file says so."
    ),
    example="FENCE_ENABLE, vehicle.param line 12: the fence is off",
    fix="switch the fence on before the flight",
)

FENCE_TOO_LARGE = Rule(
    code="F112",
    name="fence-too-large",
    severity=Severity.WARNING,
    summary="The fence has more points than the autopilot can hold.",
    why="A fence that does not fit is refused or cut, and then none is there.",
    how=(
        "PX4 stores 64 points (16 on small boards): the vertices of all polygons and one for each "
        "circle.  ArduPilot counts the vertices of a polygon in one byte: 255 at most."
    ),
    example="the fence has 80 points, PX4 holds 64",
    fix="draw the fence with fewer vertices",
)
