"""Widgets, one per noun: they are given what to show and say what was chosen."""
