"""The vehicle on the line: addresses, messages, transfers, and what a vehicle reports of itself."""
