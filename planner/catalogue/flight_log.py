"""Family R: what the records of flights do not tell, or tell twice."""

from __future__ import annotations

from planner.findings import Rule, Severity

LOG_DAMAGED = Rule(
    code="R101",
    name="log-damaged",
    severity=Severity.WARNING,
    summary="Part of a log cannot be read and is left out.",
    why=(
        "Logs end in the middle of a message when the battery is pulled, and memory cards lose "
        "sectors; what is left is used, but a model made of it rests on less than the log's length."
    ),
    how="Bytes or rows that are no message of the log's own definitions are counted.",
    example="flight.BIN: 312 of 9481228 bytes, the first at 70144, are no messages: left out",
    fix="copy the log from the vehicle again; if it stays so, read the results with care",
)

LOG_GAP = Rule(
    code="R102",
    name="log-gap",
    severity=Severity.WARNING,
    summary="Nothing was logged for a while in flight.",
    why="What happened in the gap is unknown: its energy and its distance are not in the record.",
    how=(
        "No message of any kind used for more than 1 s, or three times as long as usual where that is "
        "more.  Nothing is interpolated over it; after 60 s of silence a flight is taken to have ended."
    ),
    example="flight.ulg: nothing was logged for 2.4 s at 81.3 s of flight 1, and 2 shorter gaps",
    fix="use a faster memory card or a smaller logging profile",
)

LOG_CLOCK = Rule(
    code="R103",
    name="log-clock",
    severity=Severity.WARNING,
    summary="The clock of a log goes backwards.",
    why="Times before and after cannot be compared: speeds and energies over the jump are wrong.",
    how=(
        "A message is more than 1 s older than the one before.  Where the clock goes on from "
        "there the log is cut in two; single messages out of time are left out."
    ),
    example="flight.BIN: the clock restarts after 312.4 s: the log is read as 2 recordings",
    fix="nothing, if the autopilot was restarted; else mistrust the log",
)

FLIGHT_INCOMPLETE = Rule(
    code="R104",
    name="flight-incomplete",
    severity=Severity.WARNING,
    summary="A log begins or ends in the middle of a flight.",
    why="Time, distance and energy of the flight are larger than what the log tells of it.",
    how="The vehicle is in the air at the first or the last message of the flight.",
    example="flight.ulg: the log ends in the middle of flight 1",
    fix="let the log run from before arming to after disarming",
)

FLIGHT_LEFT_OUT = Rule(
    code="R105",
    name="flight-left-out",
    severity=Severity.INFO,
    summary="The vehicle was armed but did not take off.",
    why="Standing on the ground counted as flying makes the vehicle look efficient.",
    how="From arming to disarming it neither rose by more than 1 m nor was seen in the air.",
    example="flight.BIN: armed for 12.3 s at 40.1 s without taking off: no flight",
    fix="nothing",
)

BATTERIES_LEFT_OUT = Rule(
    code="R106",
    name="batteries-left-out",
    severity=Severity.WARNING,
    summary="A log holds the current of more than one battery; only the first is used.",
    why=(
        "Whether the others feed the motors, share the load or measure the same current again, no "
        "log tells; the power of the vehicle may be a multiple of what is used."
    ),
    how="Battery monitors other than the first that show more than 0.2 A are counted.",
    example="flight.BIN: BAT of another instance shows up to 23.1 A; only the first battery is used",
    fix="if the batteries share the load, do not identify a model from this log",
)

VALUES_IMPOSSIBLE = Rule(
    code="R108",
    name="values-impossible",
    severity=Severity.WARNING,
    summary="A log holds values that no multirotor shows.",
    why="Damaged messages pass for sound ones in logs without checksums; one of them ruins a fit.",
    how=(
        "Latitudes beyond 90°, heights beyond 20 km, speeds beyond 300 m/s, more than 2 kV, 5 kA or "
        "1 MW, and angles beyond two turns are left out."
    ),
    example="flight.BIN: 3 impossible values of POS.Lat left out, such as -627.06",
    fix="mistrust the log",
)

POSITION_RESET = Rule(
    code="R107",
    name="position-reset",
    severity=Severity.WARNING,
    summary="The autopilot's estimate of position jumped in flight.",
    why="A jump of the estimate looks like flying; stops and distances measured over it are wrong.",
    how="The estimator counts its resets; those of more than 1 m in flight are told.",
    example="flight.ulg: the position estimate jumped 1 time in flight 1, by up to 4.2 m at 33.0 s",
    fix="leave the manoeuvres around the jump out",
)
