"""Family L, from L150: what loaders make of text missions."""

from __future__ import annotations

from planner.findings import Rule, Severity

TEXT_HEADER = Rule(
    "L150 text-header",
    Severity.WARNING,
    summary="The first line is not exactly 'QGC WPL 110'.",
    why="Loaders compare the first line literally: one that differs is refused or read in another "
    "dialect (pymavlink and MAVSDK know no 120, QGroundControl splits the line at blanks).",
    how="The first line is compared with 'QGC WPL 110'.",
    fix="make 'QGC WPL 110' the first line, or save the mission anew from a ground station",
)

TEXT_DIALECT = Rule(
    "L151 text-dialect",
    Severity.INFO,
    summary="The file is written in a dialect that not every loader reads.",
    why="QGroundControl wants exactly 12 fields between tabs and no comments or blank lines, "
    "pymavlink any white space, Mission Planner also commas; the others refuse the whole file.",
    how="Each row is cut at tabs alone; rows that do not give 12 fields, and other lines, count.",
    fix="save the mission anew from the ground station that will upload it",
)

TEXT_NO_HOME_ROW = Rule(
    "L152 text-no-home-row",
    Severity.WARNING,
    summary="The first row is not a home position, but most loaders take it for one.",
    why="Version 110 files begin with home.  Where a script wrote the take-off there, QGroundControl "
    "takes it as home and ArduPilot overwrites it: the take-off is never flown.  MAVSDK uploads it to "
    "PX4, and for ArduPilot puts a copy of it in front.",
    how="The first row is home if it is a NAV_WAYPOINT (or command 0) with sequence number 0 whose "
    "altitude is AMSL or zero, or which stands before a take-off; anything else is flown.",
    fix="put a home row before it: sequence 0, frame 0, command 16, altitude AMSL",
)

TEXT_SEQUENCE = Rule(
    "L153 text-sequence",
    Severity.WARNING,
    summary="Sequence numbers are repeated or missing.",
    why="Every loader renumbers the rows in the order of the file, so a DO_JUMP goes to another row "
    "than its author meant.",
    how="Each row's number is compared with its place in the file; a warning only with a DO_JUMP.",
    fix="number the rows from 0 without gaps",
)

TEXT_UNSET_VALUE = Rule(
    "L154 text-unset-value",
    Severity.INFO,
    summary="Values are written as 'nan' or 'null'.",
    why="They are read as 'not specified'.  Mission Planner leaves rows out that hold such a word, "
    "pymavlink refuses 'null', QGroundControl reads it as 0; what ArduPilot refuses of them at upload "
    "is told as M112.",
    how="Counts the fields that hold such a word.",
    fix="write 0 where the autopilot is ArduPilot",
)

TEXT_EXTRA_COLUMNS = Rule(
    "L155 text-extra-columns",
    Severity.WARNING,
    summary="Rows have more than the format's 12 fields.",
    why="QGroundControl and pymavlink refuse such a file; what the extra fields mean is not known.",
    how="Rows whose first 12 fields make sense are read, the rest of the row is left out.",
    fix="delete the extra fields, and make sure that the first 12 are what you mean",
)

TEXT_FENCE_ROWS = Rule(
    "L156 text-fence-rows",
    Severity.ERROR,
    summary="Fence or rally rows stand among the items of a mission.",
    why="They belong to lists of their own: an autopilot refuses them inside a mission, and with them "
    "the whole upload, or flies without the fence.",
    how="Counts rows with commands 5000 to 5004 and 5100 in a file that also holds mission items.",
    fix="save fence and rally points in files of their own",
)

TEXT_NO_MISSION = Rule(
    "L157 text-no-mission",
    Severity.INFO,
    summary="The file holds a fence or rally points and no mission.",
    why="There is nothing to fly in it: most likely the wrong file was given.",
    how="Every row is a fence or rally row, or the file is ArduPilot's old list of points.",
    fix="give the mission file",
)

FENCE_ITEM_BROKEN = Rule(
    "L158 fence-item-broken",
    Severity.WARNING,
    summary="A rally point is incomplete, or the list of a fence's points is not closed.",
    why="An autopilot refuses such points, and the vehicle then returns home and not to them.",
    how="Each rally point has a place and an altitude; a list of a fence ends where it begins.",
    fix="save fence and rally points anew from a ground station",
)

FENCE_INCOMPLETE = Rule(
    "L164 fence-incomplete",
    Severity.ERROR,
    summary="A fence area is incomplete, or has other vertices than it says.",
    why="Nothing is checked against an area that is not known whole; an autopilot refuses such a "
    "fence, and the vehicle then flies without one.",
    how="The first parameter of each vertex is its polygon's number of vertices, at least 3; a circle "
    "has a centre and a radius above 0.",
    fix="save the fence anew from a ground station, and send it to the vehicle",
)

RALLY_ALTITUDE_REFERENCE = Rule(
    "L159 rally-altitude-reference",
    Severity.WARNING,
    summary="A rally point's altitude is not written as height above home.",
    why="A vehicle that returns at the wrong height hits what it should clear.",
    how="AMSL altitudes are reduced by home's altitude where it is known, else read as they stand.",
    fix="write rally altitudes relative to home (frame 3)",
)

TEXT_TERRAIN_ROWS = Rule(
    "L160 text-terrain-rows",
    Severity.WARNING,
    summary="Text rows have altitudes above terrain, which loaders get wrong.",
    why="QGroundControl shows them as AMSL when it imports text (#10596), and importers of MAVSDK "
    "before version 4 left their positions unscaled.",
    how="Counts rows in frames 10 and 11.",
    fix="upload such a file with Mission Planner or MAVProxy, or save it as a plan",
)

FILE_SUFFIX = Rule(
    "L161 file-suffix",
    Severity.INFO,
    summary="The file's suffix says another format than its content.",
    why="QGroundControl chooses the parser by the suffix and refuses the file.",
    how="Text is expected in .waypoints, .txt and .wpl, JSON in .plan, .mission and .json.",
    fix="rename the file",
)

FILE_ENCODING = Rule(
    "L162 file-encoding",
    Severity.INFO,
    summary="The file is not plain UTF-8.",
    why="Loaders compare the first bytes: with a byte order mark or in UTF-16 they refuse it.",
    how="Looks for byte order marks, UTF-16 and bytes that are not UTF-8.",
    fix="save the file as UTF-8 without a byte order mark",
)

FILE_PACKED = Rule(
    "L163 file-packed",
    Severity.INFO,
    summary="The mission was read from a compressed file.",
    why="Of the usual ground stations only QGroundControl opens such a file.",
    how="The first bytes are those of gzip or of a zip archive that holds one mission.",
    fix="unpack the file",
)
