"""Flight logs: a reader for each format raises `LogFileError` for what it cannot read."""
