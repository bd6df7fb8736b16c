"""File formats of missions: what a reader cannot read is a `MissionFileError` with line and column."""
