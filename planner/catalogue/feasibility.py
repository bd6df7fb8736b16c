"""Family M: what PX4's feasibility check and ArduPilot's arming check say about a mission.

Apart from the rest of the family, because reference steps need none of them.
"""

from __future__ import annotations

from planner.findings import Rule, Severity

FIRST_WAYPOINT_FAR = Rule(
    code="M104",
    name="first-wp-far",
    severity=Severity.WARNING,
    summary="The first place of the mission is farther from home than PX4's MIS_DIST_1WP.",
    why=(
        "Most likely a mission of another site: PX4 refused it up to 1.15 and warns since 1.16 "
        "(PX4 #8146, #21262, #23568)."
    ),
    how=(
        "Distance from home to the first item with a place: MIS_DIST_1WP or more, where that is "
        "positive.  An error for --target px4-1.15."
    ),
    example="the first place is 12.4 km from home, MIS_DIST_1WP is 900 m: PX4 warns",
    fix="check home and mission, or raise MIS_DIST_1WP",
)

LAND_START_WITHOUT_LANDING = Rule(
    code="M106",
    name="land-start-without-land",
    severity=Severity.WARNING,
    summary="DO_LAND_START stands before no landing.",
    why=(
        "A failsafe that jumps there finds no landing, and the vehicle flies on or hovers "
        "(ArduPilot #4701)."
    ),
    how="No NAV_LAND, RETURN_TO_LAUNCH or next DO_LAND_START follows it in the file.",
    example="DO_LAND_START: no landing follows",
    fix="put the landing behind it, or delete it",
)

REQUIRED_ITEM_MISSING = Rule(
    code="M116",
    name="required-item-missing",
    severity=Severity.ERROR,
    summary="The vehicle is set to refuse missions without an item that this one lacks.",
    why=(
        "The upload succeeds, the vehicle then says no in the field (QGroundControl #7836: 'one of "
        "the most common user complaints'; MAVSDK #2103)."
    ),
    how=(
        "PX4 MIS_TKO_LAND_REQ: 1 take-off, 2 landing, 3 both, 4 and 5 both or neither; a return is no "
        "landing to it.  ArduPilot ARMING_MIS_ITEMS, bits 0 NAV_LAND, 1 VTOL_LAND, 2 DO_LAND_START, "
        "3 NAV_TAKEOFF, 4 VTOL_TAKEOFF, 5 a rally point within RALLY_LIMIT_KM of home, "
        "6 RETURN_TO_LAUNCH."
    ),
    example=(
        "MIS_TKO_LAND_REQ is 3: PX4 refuses the mission without NAV_LAND; a return is no landing "
        "to it"
    ),
    fix="add the item, or change the parameter on the vehicle",
)

TOO_MANY_JUMPS = Rule(
    code="M125",
    name="too-many-jumps",
    severity=Severity.WARNING,
    summary="The mission has more counted jumps than ArduPilot keeps count of.",
    why="Jumps beyond that number are not taken: the vehicle flies fewer rounds than planned, in silence.",
    how=(
        "Items DO_JUMP with a count that the flight passes, against AP_MISSION_MAX_NUM_DO_JUMP_COMMANDS: "
        "15 on boards with less than 500 kB of memory, 100 on others; an error above 100.  Endless jumps "
        "are not counted.  All jumps are predicted as taken."
    ),
    example="the flight passes 16 jumps with a count: ArduPilot takes no more than 15 on small boards",
    fix="write the rounds out, or nest fewer jumps",
)

RALLY_FAR = Rule(
    code="M118",
    name="rally-far",
    severity=Severity.WARNING,
    summary="A rally point is farther from the whole mission than ArduPilot looks, and home is nearer.",
    why=(
        "ArduPilot returns home instead of to a rally point beyond RALLY_LIMIT_KM, 300 m on Copter: "
        "the point is never used (ArduPilot #4701, #30575)."
    ),
    how=(
        "Distance from each rally point to the nearest straight leg, above RALLY_LIMIT_KM where that is "
        "not 0, and no end of a leg is nearer to it than to home (AP_Rally::find_nearest_rally_point)."
    ),
    example=(
        "rally point 1 is 1.20 km from the mission, RALLY_LIMIT_KM is 0.3: ArduPilot never goes "
        "there"
    ),
    fix="move the rally point, or raise RALLY_LIMIT_KM",
)

GATE_AT_WAYPOINT = Rule(
    code="M119",
    name="gate-at-waypoint",
    severity=Severity.ERROR,
    summary="A gate lies at the place before or behind it.",
    why="PX4 finds no direction through the gate and refuses the mission.",
    how="CONDITION_GATE less than 5 cm from its neighbour among the items with a place.",
    example="is 0.00 m from item 3, one of them a gate: PX4 refuses the mission",
    fix="move the gate between two waypoints",
)
