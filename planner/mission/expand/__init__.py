"""Items that stand for several, expanded as QGroundControl does."""
