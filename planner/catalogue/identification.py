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
    example="altitude: fitted by ARX alone; its poles are biased by noise of the measurement",
    fix="use the default, which refines the model by output error",
)
