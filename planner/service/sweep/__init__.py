"""Sweeps: one mission, or several, checked over everything that may vary, and what that comes to."""
