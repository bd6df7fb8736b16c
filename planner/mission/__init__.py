"""The mission: items as a vehicle would receive them, the files they come in, the route they ask for."""
