"""The flight: segments in closed form, the power they take, the energy they use."""
