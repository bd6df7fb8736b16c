"""Families P, A and M: what a profile of a site or a vehicle asks for.

Apart from the rest of their families, because only a check with ``--profile`` needs them.
"""

from __future__ import annotations

from planner.findings import Rule, Severity

PARAMETER_NOT_AS_EXPECTED = Rule(
    code="P103",
    name="expected-value",
    severity=Severity.ERROR,
    summary="A parameter of the vehicle does not have the value the profile asks for.",
    why=(
        "Clubs write such checkers by hand for every site (MAVProxy #629, its cmac_check): failsafes "
        "and return heights are set on the vehicle, and forgotten there."
    ),
    how=(
        "[expect.params] of --profile against the parameters of --params, under the old or the new "
        "name, compared in SI; a parameter that is not in the file is not as expected either."
    ),
    example="RTL_ALT = 1500 (line 12), site.toml asks for 3000",
    fix="set the parameter on the vehicle, or correct the profile",
)

TOO_HIGH_FOR_SITE = Rule(
    code="A114",
    name="too-high-for-site",
    severity=Severity.ERROR,
    summary="The flight is higher above home than the profile of the site allows.",
    why="What a permit allows is no property of vehicle or mission, and nobody looks it up twice.",
    how="The greatest height of the predicted flight, more than 5 cm above max_height_above_home_m.",
    example="121 m above home, site.toml allows 120 m",
    fix="fly lower",
)

TOO_FAR_FOR_SITE = Rule(
    code="M122",
    name="too-far-for-site",
    severity=Severity.ERROR,
    summary="The mission, its fence or a rally point is farther away than the profile allows.",
    why="The mission of another site is the usual slip (MAVProxy #629: mission, rally, fence near).",
    how=(
        "Distance from the place of the site, else from home, of home, every stage, rally point and "
        "corner of the fence, beyond max_distance_m."
    ),
    example="item 7 is 640 m from the site, site.toml allows 500 m",
    fix="check that this is the mission of this site",
)

ITEM_REQUIRED_BY_SITE = Rule(
    code="M123",
    name="item-required-by-site",
    severity=Severity.ERROR,
    summary="The mission lacks an item that the profile asks for.",
    why="A habit of a club or of an operation is kept by a file better than by heads.",
    how="required_items of --profile by name against the commands of the mission.",
    example="site.toml asks for NAV_RETURN_TO_LAUNCH, the mission has none",
    fix="add the item, or correct the profile",
)
