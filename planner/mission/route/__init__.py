"""From items to a route: what the vehicle is asked to do, in order."""
