"""A watch over a vehicle: its energy in flight, and the answers to its requests to arm."""
