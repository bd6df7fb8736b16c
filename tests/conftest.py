"""What every test shares: a gate that gives the same answer twice."""

from hypothesis import settings

# The gate draws the same examples every time; look further with --hypothesis-profile=explore.
settings.register_profile("explore", deadline=None)
settings.register_profile("gate", derandomize=True, deadline=None)
settings.load_profile("gate")
