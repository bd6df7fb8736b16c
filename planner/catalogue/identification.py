"""Family I: what the identification of a vehicle from its flights has to say."""

from __future__ import annotations

from planner.findings import Rule, Severity

ARX_BIASED = Rule(
    code="I101",
    name="arx-biased",
    severity=Severity.WARNING,
    summary="A model was identified by ARX alone, which noise of the measurement biases.",
    why=(
        "ARX takes noise to have passed through the poles of the vehicle.  Noise of a sensor has "
        "not: at 10 Hz the poles then come out much too fast, a natural frequency of 1.6 rad/s as "
        "3.6 to 6.  The article identifies this way."
    ),
    how="Fires for every model fitted by ARX without the refinement in continuous time.",
    example="altitude, speed: fitted by ARX alone; noise of the measurement biases the poles",
    fix="use the default, which refines the model by output error",
)

STATE_LEFT_OUT = Rule(
    code="I102",
    name="state-left-out",
    severity=Severity.WARNING,
    summary="The flights do not tell a state of the model: it is left out.",
    why=(
        "What no flight shows cannot be identified, and nothing is invented: predictions by the model "
        "lack this state, or the model lacks its power altogether."
    ),
    how=(
        "Every segment of the state is looked at; those refused are counted with their reasons.  How an "
        "autopilot is followed is only noted: predictions for it need no such response."
    ),
    example="brake_power: left out: the flights hold no such manoeuvre",
    fix="fly the manoeuvre that is missing, or name a base model with --base",
)

STATE_OF_BASE = Rule(
    code="I103",
    name="state-of-base",
    severity=Severity.WARNING,
    summary="A state the flights do not tell is that of the base model.",
    why="The base model is another vehicle's: its power and its motion need not be this one's.",
    how="With --base, what the flights do not tell is copied from that model.",
    example="brake_power: taken from falkowski-2023-quadrotor: the flights hold no such manoeuvre",
    fix="fly the manoeuvre that is missing",
)

PARAMETERS_DIFFER = Rule(
    code="I104",
    name="parameters-differ",
    severity=Severity.WARNING,
    summary="Autopilot parameters differ between the flights a model is made of.",
    why="The vehicle flew in two ways; a model with one of them would be wrong for the other.",
    how="Parameters that predictions depend on are compared between the logs.",
    example="not the same in every flight, and left out of the model: WPNAV_SPEED, LAND_SPEED",
    fix="give --params with the parameters of the day to check, or identify from like flights",
)

MASS_UNKNOWN = Rule(
    code="I105",
    name="mass-unknown",
    severity=Severity.WARNING,
    summary="A model is made without the mass of the vehicle.",
    why="Logs do not hold the mass.  Without it payload cannot be predicted, nor air density counted.",
    how="Fires where neither --mass nor a base model gives one.",
    example="no log tells the mass: payload and air density are not modelled",
    fix="weigh the vehicle with its battery and give --mass",
)

VEHICLES_DIFFER = Rule(
    code="I106",
    name="vehicles-differ",
    severity=Severity.WARNING,
    summary="The logs name different vehicles.",
    why="A model made of two vehicles is a model of neither.",
    how="The frames that the logs name are compared; logs of two autopilots are refused.",
    example="a.BIN is of QUAD/PLUS, b.BIN of OCTAQUAD/X: is this one vehicle?",
    fix="identify each vehicle from its own logs",
)
