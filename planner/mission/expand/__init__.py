"""Complex items, expanded as QGroundControl does; a wrong value is a `MissionFileError`."""
