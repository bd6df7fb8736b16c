"""The type of options that are a number in a range."""

from __future__ import annotations

import math
from typing import Any

import click


class FiniteRange(click.FloatRange):
    """A number in a range; click's own lets NaN through, and infinity where no end is given."""

    def convert(
        self,
        value: Any,  # noqa: ANN401 - text or a default: click's own signature
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> float:
        """Return the number of the text; fail where it is none, not finite, or out of range."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is no finite number", param, ctx)
        return float(number)
