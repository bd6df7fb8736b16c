"""Items that stand for several, expanded as QGroundControl does; a wrong value is a `MissionFileError`."""
