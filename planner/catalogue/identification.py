"""Family I: what the identification of a vehicle from its flights has to say."""

from __future__ import annotations

from planner.findings import Rule, Severity

ARX_BIASED = Rule(
    "I101 arx-biased",
    Severity.WARNING,
    summary="A model was identified by ARX alone, which noise of the measurement biases.",
    why="ARX takes noise to have passed through the poles of the vehicle.  Noise of a sensor has not: "
    "at 10 Hz the poles then come out much too fast, a natural frequency of 1.6 rad/s as 3.6 to 6.  "
    "The article identifies this way.",
    how="Fires for every model fitted by ARX without the refinement in continuous time.",
    fix="use the default, which refines the model by output error",
)

STATE_LEFT_OUT = Rule(
    "I102 state-left-out",
    Severity.WARNING,
    summary="The flights do not tell a state of the model: it is left out.",
    why="What no flight shows cannot be identified, and nothing is invented: predictions by the model "
    "lack this state, or the model lacks its power altogether.",
    how="Every segment of the state is looked at; those refused are counted with their reasons.  How "
    "an autopilot is followed is only noted: predictions for it need no such response.",
    fix="fly the manoeuvre that is missing, or name a base model with --base",
)

STATE_OF_BASE = Rule(
    "I103 state-of-base",
    Severity.WARNING,
    summary="A state the flights do not tell is that of the base model.",
    why="The base model is another vehicle's: its power and its motion need not be this one's.",
    how="With --base, what the flights do not tell is copied from that model.",
    fix="fly the manoeuvre that is missing",
)

PARAMETERS_DIFFER = Rule(
    "I104 parameters-differ",
    Severity.WARNING,
    summary="Autopilot parameters differ between the flights a model is made of.",
    why="The vehicle flew in two ways; a model with one of them would be wrong for the other.",
    how="Parameters that predictions depend on are compared between the logs.",
    fix="give --params with the parameters of the day to check, or identify from like flights",
)

MASS_UNKNOWN = Rule(
    "I105 mass-unknown",
    Severity.WARNING,
    summary="A model is made without the mass of the vehicle.",
    why="Logs do not hold the mass.  Without it payload cannot be predicted, nor air density counted.",
    how="Fires where neither --mass nor a base model gives one.",
    fix="weigh the vehicle with its battery and give --mass",
)

VEHICLES_DIFFER = Rule(
    "I106 vehicles-differ",
    Severity.WARNING,
    summary="The logs name different vehicles.",
    why="A model made of two vehicles is a model of neither.",
    how="The frames that the logs name are compared; logs of two autopilots are refused.",
    fix="identify each vehicle from its own logs",
)
