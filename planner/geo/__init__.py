"""Places on the Earth: local frames, geodesics, fences, terrain."""
