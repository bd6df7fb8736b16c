"""The vehicle: its identified model, the model file and the library of shipped models."""
