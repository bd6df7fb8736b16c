"""Screens: what is shown together, and the only place that asks for a check."""
