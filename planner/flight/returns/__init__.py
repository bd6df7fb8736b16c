"""Returns: where they lead from any point of a flight, what they take, and which is the tightest."""
