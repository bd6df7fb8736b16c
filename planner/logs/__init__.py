"""Flight logs: one reader per format, each to the same record of a flight."""
