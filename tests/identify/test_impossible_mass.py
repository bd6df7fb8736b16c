"""A mass that nothing lifts on the power recorded is refused by name."""

from __future__ import annotations

import pytest

from planner.errors import IdentificationError
from planner.identify.refinement import refuse_impossible_mass
from planner.identify.segments import MeasuredPower
from planner.values import replace

HOVER = MeasuredPower(power_w=353.0, error_w=1.0, duration_s=30.0, height_above_home_m=50.0)


@pytest.mark.parametrize("mass_kg", [35.0, 8.9])
def test_a_mass_ten_times_too_large_is_named_with_the_power_it_hovers_on(mass_kg: float) -> None:
    # 353 W for 8.825 kg are 40 W/kg.
    with pytest.raises(IdentificationError, match=r"kg cannot hover on 353 W"):
        refuse_impossible_mass([replace(HOVER, mass_kg=mass_kg)])


@pytest.mark.parametrize("mass_kg", [None, 3.5, 8.8])
def test_a_mass_that_may_be_lifted_is_not_refused(mass_kg: float | None) -> None:
    refuse_impossible_mass([replace(HOVER, mass_kg=mass_kg)])
