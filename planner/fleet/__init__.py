"""Several missions flown at the same time in one airspace."""
