"""Where returns lead in tests: home, or a place there on ground of another height."""

from __future__ import annotations

import numpy as np

from planner.flight.returns.destination import ReturnTargets


def to_home(
    ground_m: float = 0.0, *, above_ground_m: float = 0.0, datum_m: float = 0.0, returns: int = 1
) -> ReturnTargets:
    """Return returns to over home, or to a place there on ground of another height."""
    return ReturnTargets(
        ground_m=np.array([[0.0, 0.0, ground_m]] * returns),
        above_ground_m=np.full(returns, above_ground_m),
        datum_m=np.full(returns, datum_m),
        return_ceiling_m=np.full(returns, np.nan),
    )
