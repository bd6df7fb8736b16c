"""How PX4 flies a multicopter mission: the laws of its trajectory generation, in closed form.

PX4 moves a point along the mission and lets the vehicle follow it.  The point's speed is the greatest
allowed by the way left to the next waypoint (``speeds``), reached at limited jerk (``ramps``); waypoints
without a hold are flown through (``turns``).  Sources are named by file and function of PX4's 1.17 line;
"measured" means autopilots flown in simulation.
"""
