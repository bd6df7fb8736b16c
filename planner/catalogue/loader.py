"""Family L, from L101: what loaders make of JSON missions."""

from __future__ import annotations

from planner.findings import Rule, Severity

REQUIRED_KEY = Rule(
    "L101 plan-key-missing",
    Severity.WARNING,
    summary="A key that QGroundControl requires is missing from the plan.",
    why="QGroundControl refuses the whole file at the first key it misses, MAVSDK too where a section "
    "is missing; nothing in the missing part is checked, a fence for instance.",
    how="Looks for the keys that QGroundControl's loader requires and that can be done without.",
    fix="open the plan in the program that wrote it and save it as a QGroundControl plan",
)

MISSION_VERSION = Rule(
    "L102 mission-version",
    Severity.WARNING,
    summary="The mission section is not version 2.",
    why="MAVSDK refuses it; QGroundControl does not look at it, and may misread the file.",
    how="Compares mission.version with 2.",
    fix="save the plan anew from QGroundControl",
)

ALTITUDE_COPY = Rule(
    "L103 altitude-copy",
    Severity.WARNING,
    summary="QGroundControl shows another altitude than the vehicle flies.",
    why="The vehicle gets 'frame' and the seventh parameter; 'Altitude' is a copy for display.  Where "
    "a script changed one of them, the pilot sees an altitude that is not flown, and editing the item "
    "overwrites the one that was meant.",
    how="Compares 'Altitude' (or 'AMSLAltAboveTerrain', where the altitude was computed from terrain) "
    "with the seventh parameter, to 0.01 m.  The seventh parameter is flown.",
    fix="edit the altitude in QGroundControl and save, or write both numbers",
)

ALTITUDE_MODE = Rule(
    "L104 altitude-mode",
    Severity.WARNING,
    summary="QGroundControl shows another altitude reference than the vehicle flies.",
    why="The numbers of 'AltitudeMode' were changed three times without a new file version (2018, "
    "2019, 2021): a file of one era shows as AMSL in another what is flown above home.  The vehicle "
    "goes by 'frame' alone.",
    how="Compares 'AltitudeMode', as QGroundControl reads it since 4.2, with 'frame'; mode 0 with a "
    "frame above home, as in 2018, is no more than a note.",
    fix="open the plan in a current QGroundControl, set the altitude reference and save",
)

JUMP_IDS = Rule(
    "L106 jump-ids",
    Severity.WARNING,
    summary="Items share a doJumpId, or have none, in a mission with a DO_JUMP.",
    why="DO_JUMP names its target by doJumpId.  QGroundControl takes the first item with it, other "
    "programs count items: the vehicle may repeat another part of the mission than was meant.",
    how="Looks for repeated and missing ids; told only where a DO_JUMP makes them matter.",
    fix="save the plan anew from QGroundControl, and look where the jump goes",
)

FENCE_VERSION = Rule(
    "L107 fence-version",
    Severity.WARNING,
    summary="The fence or the rally points are of version 1, which every loader passes over.",
    why="The file looks fenced and the vehicle flies without a fence; no program says so.",
    how="Section version 1 or none, and something in it besides empty lists.",
    fix="draw the fence anew in QGroundControl and save",
)

AUTOCONTINUE_TYPE = Rule(
    "L109 autocontinue-type",
    Severity.WARNING,
    summary="'autoContinue' is missing or no truth value.",
    why="QGroundControl refuses the file for it.",
    how="true, false, 0 and 1 are understood; missing is taken as true.",
    fix="write true or false",
)

OLDER_ITEM = Rule(
    "L110 older-item",
    Severity.INFO,
    summary="An item is written in the form that older plans had.",
    why="QGroundControl converts it, MAVSDK and scripts that read 'params' do not.",
    how="param1 to param4, or four params, and 'coordinate'; or the type 'missionItem'.",
    fix="open the file in QGroundControl and save it as a plan",
)

COORDINATE_KEY = Rule(
    "L111 coordinate-and-params",
    Severity.WARNING,
    summary="An item has seven params and a 'coordinate' as well.",
    why="QGroundControl joins them to ten values and refuses the file.",
    how="They must say the same, or params 5 to 7 must be zero or null; then 'coordinate' is the "
    "place flown to.  Otherwise the file is refused here, too.",
    fix="write the place into params 5 to 7 and delete 'coordinate'",
)

COMPLEX_ITEM_UNKNOWN = Rule(
    "L112 complex-item-unknown",
    Severity.ERROR,
    summary="A complex item cannot be expanded: it is not in the prediction.",
    why="QGroundControl goes on loading without it: part of the mission is silently not flown.",
    how="complexItemType and version are compared with those that QGroundControl has written.",
    fix="upload the plan and fetch it back from the vehicle: then it holds plain items",
)

COMPLEX_ITEM_VERSION = Rule(
    "L113 complex-item-version",
    Severity.WARNING,
    summary="A complex item is of a version that loaders refuse, but holds the items to fly.",
    why="QGroundControl refuses the whole plan, and MAVSDK any survey but version 5.",
    how="The version is compared with those QGroundControl accepts; the embedded items are used.",
    fix="save the plan anew from QGroundControl",
)

SURVEY_REBUILT = Rule(
    "L114 survey-rebuilt",
    Severity.WARNING,
    summary="A survey holds no items: they are computed from its area as QGroundControl does.",
    why="What is uploaded is computed anew by QGroundControl, and its versions differ in where they "
    "begin and turn; MAVSDK refuses the file.",
    how="The path it is drawn with is used where there is one; otherwise parallel lines at the grid's "
    "angle and spacing are cut with the area, entered at the chosen corner and lengthened to turn "
    "around.  Surveys that do hold their items come out within 0.3 %.",
    fix="open the plan in a current QGroundControl and save it: then it holds the items",
)

STRUCTURE_SCAN_EXPANDED = Rule(
    "L115 structure-scan-expanded",
    Severity.INFO,
    summary="A structure scan is expanded as QGroundControl does on upload.",
    why="The file holds the structure, not the items: the vertex where the scan begins is not saved, "
    "and QGroundControl counts the layers anew when it loads the file.  Some of its versions also read "
    "the entrance altitude wrongly, as 0 m.",
    how="The outline is moved outward by the distance to the surface; one lap per layer, from the "
    "first vertex, the first half a layer from the top or bottom: 4 + layers (n + 3) items.  A warning "
    "where the layers in the file are not those QGroundControl will count.",
    fix="look at the altitudes after loading the plan in QGroundControl, before the upload",
)

LANDING_PATTERN_EXPANDED = Rule(
    "L116 landing-pattern-expanded",
    Severity.INFO,
    summary="A landing pattern is expanded as QGroundControl does on upload.",
    why="The file holds where to approach and land, not the items; MAVSDK refuses the file.",
    how="DO_LAND_START, what stops the camera, the approach and the landing.  A warning where one of "
    "its altitudes counts from home and the other does not.",
    fix="check the landing in QGroundControl before the upload",
)

LEGACY_FORMAT = Rule(
    "L117 legacy-format",
    Severity.WARNING,
    summary="The file is written in a JSON format from before plans.",
    why="QGroundControl since 3.3 opens plans only; other programs never read it.",
    how="The file has items at its top, or the file type 'Mission'.",
    fix="open it in an old QGroundControl and save it as a plan",
)

ITEM_TYPE = Rule(
    "L118 item-type",
    Severity.WARNING,
    summary="An item does not say that it is a SimpleItem, but reads like one.",
    why="QGroundControl refuses the file.",
    how="The item has a command; 'type' is missing, null or another text.",
    fix='write "type": "SimpleItem"',
)

PLAN_VALUE = Rule(
    "L119 plan-value",
    Severity.WARNING,
    summary="A value is missing or of another type than QGroundControl wants.",
    why="QGroundControl refuses the whole file at the first such value, also where it means nothing "
    "to the vehicle.",
    how="What can be read all the same: the speeds and altitudes for display, 'doJumpId', "
    "'groundStation', the versions and lists inside fence and complex items.",
    fix="open the plan in the program that wrote it and save it as a QGroundControl plan",
)

JUMP_INTO_COMPLEX_ITEM = Rule(
    "L120 jump-into-complex-item",
    Severity.WARNING,
    summary="A DO_JUMP leads into a complex item.",
    why="QGroundControl looks for the target among the simple items alone, and refuses the whole file "
    "if it is not there.",
    how="The target has a doJumpId that only an item inside a survey or other complex item has.",
    fix="let the jump lead to a simple item before or behind the complex one",
)

JUMP_SHIFTED = Rule(
    "L121 jump-shifted-by-mavsdk",
    Severity.INFO,
    summary="MAVSDK's import makes a DO_JUMP lead one item too far.",
    why="A plan numbers its items from 1, PX4 from 0.  QGroundControl converts the number at upload, "
    "MAVSDK's import does not: the vehicle repeats another part of the mission.",
    how="A plan for PX4 that holds a DO_JUMP; for ArduPilot MAVSDK puts home first, as item 0.",
    fix="upload the plan with QGroundControl",
)
