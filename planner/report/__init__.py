"""Results as text and data, for people and for programs."""
