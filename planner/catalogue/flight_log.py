"""Family R: what the records of flights do not tell, or tell twice."""

from __future__ import annotations

from planner.findings import Rule, Severity

LOG_DAMAGED = Rule(
    "R101 log-damaged",
    Severity.WARNING,
    summary="Part of a log cannot be read and is left out.",
    why="Logs end in the middle of a message when the battery is pulled, and memory cards lose "
    "sectors; what is left is used, but a model made of it rests on less than the log's length.",
    how="Bytes or rows that are no message of the log's own definitions are counted.",
    fix="copy the log from the vehicle again; if it stays so, read the results with care",
)

LOG_GAP = Rule(
    "R102 log-gap",
    Severity.WARNING,
    summary="Nothing was logged for a while in flight.",
    why="What happened in the gap is unknown: its energy and its distance are not in the record.",
    how="No message of any kind used for more than 1 s, or three times as long as usual where that is "
    "more.  Nothing is interpolated over it; after 60 s of silence a flight is taken to have ended.",
    fix="use a faster memory card or a smaller logging profile",
)

LOG_CLOCK = Rule(
    "R103 log-clock",
    Severity.WARNING,
    summary="The clock of a log goes backwards.",
    why="Times before and after cannot be compared: speeds and energies over the jump are wrong.",
    how="A message is more than 1 s older than the one before.  Where the clock goes on from there "
    "the log is cut in two; single messages out of time are left out.",
    fix="nothing, if the autopilot was restarted; else mistrust the log",
)

FLIGHT_INCOMPLETE = Rule(
    "R104 flight-incomplete",
    Severity.WARNING,
    summary="A log begins or ends in the middle of a flight.",
    why="Time, distance and energy of the flight are larger than what the log tells of it.",
    how="The vehicle is in the air at the first or the last message of the flight.",
    fix="let the log run from before arming to after disarming",
)

FLIGHT_LEFT_OUT = Rule(
    "R105 flight-left-out",
    Severity.INFO,
    summary="The vehicle was armed but did not take off.",
    why="Standing on the ground counted as flying makes the vehicle look efficient.",
    how="From arming to disarming it neither rose by more than 1 m nor was seen in the air.",
    fix="nothing",
)

BATTERIES_LEFT_OUT = Rule(
    "R106 batteries-left-out",
    Severity.WARNING,
    summary="A log holds the current of more than one battery; only the first is used.",
    why="Whether the others feed the motors, share the load or measure the same current again, no log "
    "tells; the power of the vehicle may be a multiple of what is used.",
    how="Battery monitors other than the first that show more than 0.2 A are counted.",
    fix="if the batteries share the load, do not identify a model from this log",
)

VALUES_IMPOSSIBLE = Rule(
    "R108 values-impossible",
    Severity.WARNING,
    summary="A log holds values that no multirotor shows.",
    why="Damaged messages pass for sound ones in logs without checksums; one of them ruins a fit.",
    how="Latitudes beyond 90°, heights beyond 20 km, speeds beyond 300 m/s, more than 2 kV, 5 kA or 1 "
    "MW, and angles beyond two turns are left out.",
    fix="mistrust the log",
)

POSITION_RESET = Rule(
    "R107 position-reset",
    Severity.WARNING,
    summary="The autopilot's estimate of position jumped in flight.",
    why="A jump of the estimate looks like flying; stops and distances measured over it are wrong.",
    how="The estimator counts its resets; those of more than 1 m in flight are told.",
    fix="leave the manoeuvres around the jump out",
)
