"""The autopilots' parameters: what a flight depends on, and where each value comes from."""
