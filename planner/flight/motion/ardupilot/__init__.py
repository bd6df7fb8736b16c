"""Missions as ArduPilot's Copter flies them."""
